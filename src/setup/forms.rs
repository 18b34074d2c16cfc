//! Values that the setup file may give in more than one form: a name or a table, one or many, a value or a curve. In: TOML. Out: one enum each.
//!
//! Deserialised by hand instead of by untagged enums, so that an error about a misspelt key inside keeps its place and its message.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

use super::quantity::Quantity;

/// A name from the library, or the thing itself.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum NameOr<T> {
    /// Name in the library.
    Name(String),
    /// Written out.
    Table(Box<T>),
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for NameOr<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Either<T> {
            type Value = NameOr<T>;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a name from the library, or a table")
            }
            fn visit_str<E>(self, v: &str) -> Result<Self::Value, E> {
                Ok(NameOr::Name(v.to_owned()))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                T::deserialize(MapAccessDeserializer::new(map)).map(|table| NameOr::Table(Box::new(table)))
            }
        }
        deserializer.deserialize_any(Either(PhantomData))
    }
}

/// `[stock]` or `[[stock]]`.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum OneOrMany<T> {
    /// One table.
    One(Box<T>),
    /// Several.
    Many(Vec<T>),
}

impl<T> OneOrMany<T> {
    /// All of them.
    pub fn as_slice(&self) -> &[T] {
        match self {
            OneOrMany::One(one) => std::slice::from_ref(one),
            OneOrMany::Many(many) => many,
        }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for OneOrMany<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Either<T> {
            type Value = OneOrMany<T>;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a table, or an array of tables")
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                T::deserialize(MapAccessDeserializer::new(map)).map(|table| OneOrMany::One(Box::new(table)))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(seq)).map(OneOrMany::Many)
            }
        }
        deserializer.deserialize_any(Either(PhantomData))
    }
}

/// A limit: the largest value alone, or a table with the smallest, the largest, or both.
#[derive(Debug, Clone, Default)]
pub struct Bounds {
    /// Smallest.
    pub min: Option<Quantity>,
    /// Largest.
    pub max: Option<Quantity>,
}

impl<'de> Deserialize<'de> for Bounds {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl Either {
            fn most(max: Quantity) -> Bounds {
                Bounds { min: None, max: Some(max) }
            }
        }
        impl<'de> Visitor<'de> for Either {
            type Value = Bounds;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("the largest value as a number, or a table like { min = 100, max = 2000 }")
            }
            fn visit_i64<E>(self, v: i64) -> Result<Bounds, E> {
                Ok(Self::most(Quantity::Number(v as f64)))
            }
            fn visit_f64<E>(self, v: f64) -> Result<Bounds, E> {
                Ok(Self::most(Quantity::Number(v)))
            }
            fn visit_str<E>(self, v: &str) -> Result<Bounds, E> {
                Ok(Self::most(Quantity::Text(v.to_owned())))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Bounds, A::Error> {
                let table = BoundsTable::deserialize(MapAccessDeserializer::new(map))?;
                Ok(Bounds { min: table.min, max: table.max })
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl JsonSchema for Bounds {
    fn schema_name() -> Cow<'static, str> {
        "Bounds".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let (largest, table) = (generator.subschema_for::<Quantity>(), generator.subschema_for::<BoundsTable>());
        json_schema!({ "description": "The largest value alone, or { min, max }.", "anyOf": [largest, table] })
    }
}

/// [`Bounds`] as a table.
#[derive(serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table like { min = 100, max = 2000 }")]
struct BoundsTable {
    /// Smallest.
    min: Option<Quantity>,
    /// Largest.
    max: Option<Quantity>,
}

/// One value, or points [x, y] with rising x.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Curve {
    /// The same everywhere.
    Constant(Quantity),
    /// Linear between the points.
    Points(Vec<[Quantity; 2]>),
}

impl<'de> Deserialize<'de> for Curve {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Curve;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number, or points like [[0, 0], [1500, 7500]]")
            }
            fn visit_i64<E>(self, v: i64) -> Result<Curve, E> {
                Ok(Curve::Constant(Quantity::Number(v as f64)))
            }
            fn visit_f64<E>(self, v: f64) -> Result<Curve, E> {
                Ok(Curve::Constant(Quantity::Number(v)))
            }
            fn visit_str<E>(self, v: &str) -> Result<Curve, E> {
                Ok(Curve::Constant(Quantity::Text(v.to_owned())))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Curve, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(seq)).map(Curve::Points)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// A point of a tool outline, reached by a line or by an arc.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum ProfilePoint {
    /// Reached by a line: [radius, height].
    Line([Quantity; 2]),
    /// Reached by an arc.
    Arc(ArcPoint),
}

/// A point reached by an arc.
#[derive(Debug, Clone, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArcPoint {
    /// [radius, height]
    pub to: [Quantity; 2],
    /// Centre [radius, height].
    #[serde(alias = "center")]
    pub centre: [Quantity; 2],
}

impl<'de> Deserialize<'de> for ProfilePoint {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = ProfilePoint;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("[radius, height], or { to = [radius, height], centre = [radius, height] }")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<ProfilePoint, A::Error> {
                <[Quantity; 2]>::deserialize(SeqAccessDeserializer::new(seq)).map(ProfilePoint::Line)
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<ProfilePoint, A::Error> {
                ArcPoint::deserialize(MapAccessDeserializer::new(map)).map(ProfilePoint::Arc)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// Coefficients of a material: `model`, `name`, `uncertainty`, and the parameters of the model by name.
#[derive(Debug, Clone, Default, serde::Deserialize)]
#[serde(transparent)]
pub struct MaterialTable(pub BTreeMap<String, Quantity>);

impl JsonSchema for MaterialTable {
    fn schema_name() -> Cow<'static, str> {
        "MaterialTable".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let quantity = generator.subschema_for::<Quantity>();
        json_schema!({
            "description": "Cutting coefficients: N/mm² for k_?c, N/mm for k_?e; other models have their own parameters (`feedwright library models`).",
            "type": "object",
            "properties": {
                "model": { "type": "string", "description": "Force model; linear-edge when absent." },
                "name": { "type": "string", "description": "Name for the report." },
                "uncertainty": { "type": "number", "description": "Relative standard uncertainty of the forces." },
                "k_tc": quantity.clone(), "k_rc": quantity.clone(), "k_ac": quantity.clone(),
                "k_te": quantity.clone(), "k_re": quantity.clone(), "k_ae": quantity.clone()
            },
            "additionalProperties": quantity
        })
    }
}
