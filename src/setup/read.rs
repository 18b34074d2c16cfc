//! Reading single values: units, ranges, defaults. In: quantities as written, each with its key. Out: values in internal units, and lists of
//! assumptions and errors.
//!
//! Keys are paths like `machine.axes.x.jerk`, `tool[T3].helix` (the tool with number 3) or `stock[2].box` (the second).

use super::error::place;
use super::quantity::Quantity;
use crate::diag::{Diagnostic, Severity};
use crate::machine::Table;
use crate::units::Dimension;
use toml::de::{DeTable, DeValue};

use super::forms::Curve;

/// Source of what a learned effect changes of the job, among what was assumed.
pub const LEARNED: &str = "the process model";

/// A default that is in force because nothing else was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Assumption {
    /// Key it stands for.
    pub key: String,
    /// Value, with unit.
    pub value: String,
    /// Where it comes from.
    pub source: String,
}

/// Which values make sense.
#[derive(Debug, Clone, Copy)]
pub enum Sense {
    /// Any finite number.
    Any,
    /// Zero or more.
    NotNegative,
    /// More than zero.
    Positive,
    /// Between the two, ends excluded, in internal units; the text says so in the user's units.
    Within(f64, f64, &'static str),
}

/// Smallest positive number that is accepted, in internal units: a path of 100 m at this feed still takes a finite time, and no real quantity of
/// a setup is so small. Our judgement.
const LEAST: f64 = 1e-12;

/// Largest number that is accepted, in internal units: a tare of 10³⁰⁸ W ends as an infinite load in the reports. No real quantity of a setup
/// is so large. Our judgement.
const LARGEST: f64 = 1e15;

/// The state of one reading.
pub struct Reader<'a> {
    text: &'a str,
    inch: bool,
    /// Defaults put in.
    pub assumptions: Vec<Assumption>,
    /// What is wrong.
    pub wrong: Vec<Diagnostic>,
}

impl<'a> Reader<'a> {
    /// For the text of a setup file.
    pub fn new(text: &'a str, inch: bool) -> Self {
        Self { text, inch, assumptions: Vec::new(), wrong: Vec::new() }
    }

    /// Records a default.
    pub fn assume(&mut self, key: &str, value: impl Into<String>, source: &str) {
        self.assumptions.push(Assumption { key: key.into(), value: value.into(), source: source.into() });
    }

    /// Records that something is wrong at a key.
    pub fn complain(&mut self, key: &str, text: impl Into<String>, help: impl Into<String>) {
        let text = format!("`{key}`: {}", text.into());
        let diagnostic = Diagnostic::new("setup::value", Severity::Error, text).help(help);
        self.wrong.push(match locate(self.text, key) {
            Some(span) => place(diagnostic, self.text, span),
            None => diagnostic,
        });
    }

    /// Something needed is not there.
    pub fn missing(&mut self, key: &str, help: impl Into<String>) {
        self.complain(key, "is needed and not given", help);
    }

    /// A value that is there; 1 stands in for one that is wrong.
    pub fn value(&mut self, key: &str, quantity: &Quantity, dimension: Dimension, sense: Sense) -> f64 {
        match quantity.value(dimension, self.inch) {
            Ok(value) => {
                if let Some(asked) = senseless(value, sense) {
                    self.complain(key, format!("{} makes no sense here", as_written(quantity)), asked);
                }
                value
            }
            Err(why) => {
                self.complain(
                    key,
                    format!("{} cannot be used: {why}", as_written(quantity)),
                    "write a number, or a text with its unit like \"110 lbf\"",
                );
                1.0
            }
        }
    }

    /// A value that may be absent.
    pub fn optional(
        &mut self,
        key: &str,
        quantity: Option<&Quantity>,
        dimension: Dimension,
        sense: Sense,
    ) -> Option<f64> {
        quantity.map(|quantity| self.value(key, quantity, dimension, sense))
    }

    /// A value that has a default (in metric bare units: mm, mm/min, deg …).
    pub fn or(
        &mut self,
        key: &str,
        quantity: Option<&Quantity>,
        dimension: Dimension,
        sense: Sense,
        default: f64,
    ) -> f64 {
        if let Some(quantity) = quantity {
            return self.value(key, quantity, dimension, sense);
        }
        let unit = dimension.bare(false);
        self.assume(key, format!("{default} {unit}").trim_end(), "default");
        default * dimension.factor(unit).expect("the bare unit is in the table")
    }

    /// Three coordinates.
    pub fn point(&mut self, key: &str, written: &[Quantity; 3]) -> crate::path::Vec3 {
        let [x, y, z] = [0, 1, 2].map(|k| self.value(key, &written[k], Dimension::Length, Sense::Any));
        crate::path::Vec3::new(x, y, z)
    }

    /// A constant or a curve over `x`.
    pub fn curve(&mut self, key: &str, curve: &Curve, x: Dimension, y: Dimension, sense: Sense) -> Table {
        let wrong_before = self.wrong.len();
        let points: Vec<[f64; 2]> = match curve {
            Curve::Constant(value) => vec![[0.0, self.value(key, value, y, sense)]],
            Curve::Points(points) => points
                .iter()
                .map(|[a, b]| [self.value(key, a, x, Sense::NotNegative), self.value(key, b, y, sense)])
                .collect(),
        };
        Table::new(points).unwrap_or_else(|| {
            if self.wrong.len() == wrong_before {
                self.complain(
                    key,
                    "the first numbers of its points must rise",
                    "sort the points by their first number and give each once",
                );
            }
            Table::constant(1.0)
        })
    }

    /// One of a few words.
    pub fn choice<T: Copy>(&mut self, key: &str, word: &str, known: &[(&str, T)]) -> Option<T> {
        let found = known.iter().find(|(name, _)| *name == word).map(|(_, value)| *value);
        if found.is_none() {
            let names: Vec<_> = known.iter().map(|(name, _)| *name).collect();
            self.complain(key, format!("\"{word}\" is not known"), super::error::suggest(word, &names));
        }
        found
    }
}

fn as_written(quantity: &Quantity) -> String {
    match quantity {
        Quantity::Number(number) if number.abs() >= 1e10 => format!("{number:e}"),
        Quantity::Number(number) => number.to_string(),
        Quantity::Text(text) => format!("\"{text}\""),
    }
}

fn senseless(value: f64, sense: Sense) -> Option<String> {
    match sense {
        _ if value.abs() > LARGEST => Some("it is larger than anything that can be measured".into()),
        Sense::NotNegative if value < 0.0 => Some("it must be zero or more".into()),
        Sense::Positive if value <= 0.0 => {
            Some("it must be more than zero; leave the key out if it is not known".into())
        }
        Sense::Positive if value < LEAST => Some("it is smaller than anything that can be measured".into()),
        Sense::Within(low, high, asked) if value <= low || value >= high => Some(asked.into()),
        _ => None,
    }
}

/// Bytes of the value at a key, or of the nearest part of its path that is written.
fn locate(text: &str, key: &str) -> Option<std::ops::Range<usize>> {
    let root = DeTable::parse(text).ok()?;
    let mut table = root.get_ref();
    let mut found = None;
    for segment in key.split('.') {
        let (name, item) =
            segment.split_once('[').map_or((segment, None), |(name, rest)| (name, rest.strip_suffix(']')));
        let Some((_, value)) = table.iter().find(|(written, _)| written.get_ref() == name) else { break };
        let mut value = value;
        if let (Some(item), DeValue::Array(array)) = (item, value.get_ref()) {
            let Some(element) = element(array, item) else { break };
            value = element;
        }
        found = Some(value.span());
        match value.get_ref() {
            DeValue::Table(inner) => table = inner,
            _ => break,
        }
    }
    found
}

fn element<'a, 'b>(array: &'a toml::de::DeArray<'b>, item: &str) -> Option<&'a toml::Spanned<DeValue<'b>>> {
    match item.strip_prefix('T') {
        Some(number) => array.iter().find(|entry| match entry.get_ref() {
            DeValue::Table(table) => table.iter().any(|(name, value)| {
                name.get_ref() == "number" && matches!(value.get_ref(), DeValue::Integer(i) if i.as_str() == number)
            }),
            _ => false,
        }),
        None => array.get(item.parse::<usize>().ok()?.checked_sub(1)?),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_find_their_bytes() {
        let text = "[[tool]]\nnumber = 1\nhelix = 5\n[[tool]]\nnumber = 3\nhelix = 90\n[[stock]]\nuncertainty = 7\n";
        assert_eq!(&text[locate(text, "tool[T3].helix").unwrap()], "90");
        assert_eq!(&text[locate(text, "stock[1].uncertainty").unwrap()], "7");
        assert!(locate(text, "limits.power").is_none());
    }

    #[test]
    fn numbers_that_nothing_measures_are_refused() {
        assert!(senseless(1e16, Sense::NotNegative).is_some() && senseless(-1e16, Sense::Any).is_some());
        assert!(senseless(1e14, Sense::NotNegative).is_none() && senseless(-1e14, Sense::Any).is_none());
        assert!(senseless(1e-13, Sense::Positive).is_some() && senseless(1e-11, Sense::Positive).is_none());
    }

    #[test]
    fn a_curve_backwards_is_refused() {
        let mut reader = Reader::new("", false);
        let curve = Curve::Points(vec![
            [Quantity::Number(100.0), Quantity::Number(1.0)],
            [Quantity::Number(50.0), Quantity::Number(1.0)],
        ]);
        reader.curve("machine.spindle.power", &curve, Dimension::Speed, Dimension::Power, Sense::NotNegative);
        assert_eq!(reader.wrong.len(), 1);
    }
}
