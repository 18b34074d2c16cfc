//! `[material]` and coefficients. In: these tables of the setup. Out: [`Material`]. The linear edge model needs k_tc and k_te; radial and axial
//! coefficients that are not given follow from them by measured shares ([`SHARES`]), recorded as assumptions.

use super::error::suggest;
use super::forms::MaterialTable;
use super::library;
use super::quantity::Quantity;
use super::read::{Reader, Sense};
use crate::force::ForceError;
use crate::machine::Material;
use crate::machine::material::{ForceModel, LinearEdge, SHARES};
use crate::units::Dimension;

const LINEAR_EDGE: [&str; 6] = ["k_tc", "k_rc", "k_ac", "k_te", "k_re", "k_ae"];
/// Keys of the model `power`: radial and axial coefficients as shares of the tangential ones.
const POWER_SHARES: [&str; 4] =
    ["normal_cutting_share", "axial_cutting_share", "normal_edge_share", "axial_edge_share"];
const MODELS: &str = "`feedwright library models` lists the models with their parameters";
const COMMON: [&str; 3] = ["model", "name", "uncertainty"];

/// A material written out.
pub fn material(reader: &mut Reader, key: &str, table: &MaterialTable) -> Material {
    let model = text(table, "model").unwrap_or("linear-edge");
    let uncertainty = table.0.get("uncertainty");
    let uncertainty = uncertainty
        .map(|written| reader.value(&format!("{key}.uncertainty"), written, Dimension::Ratio, Sense::NotNegative));
    let complaints = reader.wrong.len();
    let model = match model {
        "linear-edge" | "power" => ForceModel::LinearEdge(linear_edge(reader, key, table)),
        other => named(reader, key, table, other),
    };
    if reader.wrong.len() == complaints {
        check(reader, key, &model);
    }
    Material { name: text(table, "name").unwrap_or("as in the setup").to_owned(), model, uncertainty }
}

/// Complains about coefficients that no material has.
fn check(reader: &mut Reader, key: &str, model: &ForceModel) {
    match crate::force::check::model(model) {
        Ok(()) => {}
        Err(ForceError::OutOfRange { key: name, value, low, high }) => reader.complain(
            &format!("{key}.{name}"),
            format!("{value} makes no sense here"),
            format!("sensible values lie between {low} and {high}"),
        ),
        Err(ForceError::UnknownParameter { key: name, .. }) => {
            reader.complain(&format!("{key}.{name}"), "is no parameter of this model", MODELS);
        }
        Err(ForceError::MissingParameter { key: name, .. }) => reader.missing(&format!("{key}.{name}"), MODELS),
        Err(other) => reader.complain(&format!("{key}.model"), other.to_string(), MODELS),
    }
}

/// A material of the library.
pub fn named_material(reader: &mut Reader, key: &str, name: &str) -> Option<Material> {
    let entries = library::materials();
    if let Some(entry) = entries.iter().find(|entry| entry.name == name) {
        reader.assume(key, format!("{name}, forces ±{:.0} %", 100.0 * entry.uncertainty), "library");
        return Some(material(reader, key, &entry.table()));
    }
    let known: Vec<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
    reader.complain(key, format!("the library has no material \"{name}\""), suggest(name, &known));
    None
}

fn text<'a>(table: &'a MaterialTable, name: &str) -> Option<&'a str> {
    match table.0.get(name) {
        Some(Quantity::Text(text)) => Some(text),
        _ => None,
    }
}

fn linear_edge(reader: &mut Reader, key: &str, table: &MaterialTable) -> LinearEdge {
    let shares: &[&str] = if text(table, "model") == Some("power") { &POWER_SHARES } else { &[] };
    let known: Vec<&str> = COMMON.iter().chain(&LINEAR_EDGE).chain(shares).copied().collect();
    for name in table.0.keys().filter(|name| !known.contains(&name.as_str())) {
        reader.complain(&format!("{key}.{name}"), "is no coefficient of the linear edge model", suggest(name, &known));
    }
    let (k_tc, k_te) = (
        needed(reader, key, table, "k_tc", Dimension::Stress),
        needed(reader, key, table, "k_te", Dimension::ForcePerLength),
    );
    let mut of = |name: &str, [base_name, share_name]: [&str; 2], base: f64, usual: f64, dimension: Dimension| {
        let full = format!("{key}.{name}");
        if let Some(written) = table.0.get(name) {
            return reader.value(&full, written, dimension, Sense::NotNegative);
        }
        if let Some(written) = table.0.get(share_name).filter(|_| shares.contains(&share_name)) {
            return base * reader.value(&format!("{key}.{share_name}"), written, Dimension::Ratio, Sense::NotNegative);
        }
        reader.assume(&full, format!("{usual} {base_name}"), "measured on 6061-T6 (Xu, Jerard, Fussell); axial: half");
        usual * base
    };
    let [rc, ac, re, ae] = POWER_SHARES;
    LinearEdge {
        k_tc,
        k_te,
        k_rc: of("k_rc", ["k_tc", rc], k_tc, SHARES.radial_cutting, Dimension::Stress),
        k_ac: of("k_ac", ["k_tc", ac], k_tc, SHARES.axial_cutting, Dimension::Stress),
        k_re: of("k_re", ["k_te", re], k_te, SHARES.radial_edge, Dimension::ForcePerLength),
        k_ae: of("k_ae", ["k_te", ae], k_te, SHARES.axial_edge, Dimension::ForcePerLength),
    }
}

fn needed(reader: &mut Reader, key: &str, table: &MaterialTable, name: &str, dimension: Dimension) -> f64 {
    let full = format!("{key}.{name}");
    if let Some(written) = table.0.get(name) {
        return reader.value(&full, written, dimension, Sense::NotNegative);
    }
    let remedy = "name a material of `feedwright library materials` (`material = \"…\"` in [stock]) or take it from a calibration";
    reader.missing(&full, remedy);
    1.0
}

fn named(reader: &mut Reader, key: &str, table: &MaterialTable, model: &str) -> ForceModel {
    let parameters = table.0.iter().filter(|(name, _)| !COMMON.contains(&name.as_str()));
    let parameters = parameters
        .map(|(name, written)| {
            (name.clone(), reader.value(&format!("{key}.{name}"), written, Dimension::Ratio, Sense::Any))
        })
        .collect();
    ForceModel::Named { name: model.to_owned(), parameters }
}
