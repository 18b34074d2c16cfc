//! A number of the setup file: bare, or a text that carries its own unit ("6 hp", "3/4 in"). In: TOML. Out: a value in the
//! internal unit of its dimension.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Visitor};
use std::borrow::Cow;
use std::fmt;

use crate::machine::MOST_MM;
use crate::units::Dimension;

/// As written in the file.
#[derive(Debug, Clone, PartialEq)]
pub enum Quantity {
    /// A bare number, in the unit of the key.
    Number(f64),
    /// A number with a unit, or any other text.
    Text(String),
}

impl Quantity {
    /// Value in the internal unit. Errors: one sentence saying what is wrong.
    pub fn value(&self, dimension: Dimension, inch: bool) -> Result<f64, String> {
        let value = match self {
            Quantity::Number(number) => number * bare_factor(dimension, inch),
            Quantity::Text(text) => {
                let (number, unit) = split(text).ok_or_else(|| format!("\"{text}\" does not begin with a number"))?;
                let unit = unit.trim();
                let factor = if unit.is_empty() { Some(bare_factor(dimension, inch)) } else { dimension.factor(unit) };
                let factor = factor.ok_or_else(|| {
                    let known: Vec<_> =
                        dimension.units().iter().map(|(name, _)| *name).filter(|n| !n.is_empty()).collect();
                    format!("the unit `{unit}` does not fit here; known are {}", known.join(", "))
                })?;
                number * factor
            }
        };
        if !value.is_finite() {
            return Err("it is not a finite number".into());
        }
        if dimension == Dimension::Length && value.abs() > MOST_MM {
            return Err(format!("it is more than {} m", MOST_MM / 1e3));
        }
        Ok(value)
    }
}

fn bare_factor(dimension: Dimension, inch: bool) -> f64 {
    dimension.factor(dimension.bare(inch)).expect("the bare unit is in the table")
}

/// Number (or fraction) at the beginning, and the rest.
fn split(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let end = text.find(|c: char| !(c.is_ascii_digit() || "+-./".contains(c))).unwrap_or(text.len());
    let end = if text[end..].starts_with(['e', 'E'])
        && text[end + 1..].starts_with(|c: char| c.is_ascii_digit() || c == '-')
    {
        let tail = &text[end + 2..];
        end + 2 + tail.find(|c: char| !c.is_ascii_digit()).unwrap_or(tail.len())
    } else {
        end
    };
    let (number, unit) = text.split_at(end);
    let value = match number.split_once('/') {
        Some((over, "")) => return Some((over.parse().ok()?, &text[end - 1..])),
        Some((over, under)) => over.parse::<f64>().ok()? / under.parse::<f64>().ok()?,
        None => number.parse().ok()?,
    };
    Some((value, unit))
}

impl<'de> Deserialize<'de> for Quantity {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AsWritten;
        impl Visitor<'_> for AsWritten {
            type Value = Quantity;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number, or a text like \"6 hp\"")
            }
            fn visit_i64<E>(self, v: i64) -> Result<Quantity, E> {
                Ok(Quantity::Number(v as f64))
            }
            fn visit_f64<E>(self, v: f64) -> Result<Quantity, E> {
                Ok(Quantity::Number(v))
            }
            fn visit_str<E>(self, v: &str) -> Result<Quantity, E> {
                Ok(Quantity::Text(v.to_owned()))
            }
        }
        deserializer.deserialize_any(AsWritten)
    }
}

impl JsonSchema for Quantity {
    fn schema_name() -> Cow<'static, str> {
        "Quantity".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A number in the unit of the key, or a text with its own unit: \"6 hp\", \"3/4 in\".",
            "type": ["number", "string"]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_carry_their_unit() {
        let text = |t: &str| Quantity::Text(t.into());
        let near = |quantity: &Quantity, dimension, inch, expected: f64| {
            let value = quantity.value(dimension, inch).unwrap();
            assert!((value - expected).abs() <= 1e-12 * expected, "{value} is not {expected}");
        };
        near(&text("3/4 in"), Dimension::Length, false, 19.05);
        near(&text("1e-2"), Dimension::Length, true, 0.254);
        near(&text("2.5e3 mm"), Dimension::Length, true, 2500.0);
        near(&Quantity::Number(600.0), Dimension::Feed, true, 254.0);
        near(&text("1200 /min"), Dimension::Speed, false, 20.0);
        assert!(text("6 hp").value(Dimension::Force, false).unwrap_err().contains("lbf"));
        assert!(text("fast").value(Dimension::Feed, false).unwrap_err().contains("number"));
        assert!(Quantity::Number(MOST_MM).value(Dimension::Length, false).is_ok());
        assert!(Quantity::Number(1.01 * MOST_MM).value(Dimension::Length, false).unwrap_err().contains("100 m"));
        assert!(Quantity::Number(f64::NAN).value(Dimension::Force, false).is_err());
    }
}
