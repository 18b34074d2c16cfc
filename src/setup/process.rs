//! `[process]` and model files, as `calibrate` and `learn` write them. In: a table or file. Out: [`Process`]; and back.

use super::error::{SetupError, from_toml};
use super::file::{ProcessTable, RelativeTable};
use super::forms::MaterialTable;
use super::material::material;
use super::quantity::Quantity;
use super::read::{Reader, Sense};
use crate::machine::material::{EffectUse, ForceModel, Process, RelativeLoad};
use crate::units::{Dimension, rpm_from_rps};
use std::path::Path;

/// `[process]`, or what is in the file it includes.
pub fn process(reader: &mut Reader, table: &ProcessTable, dir: &Path) -> Result<Process, SetupError> {
    match &table.include {
        Some(name) => load(&read(&dir.join(name))?),
        None => Ok(from_table(reader, "process", table)),
    }
}

/// A model file.
pub fn load(text: &str) -> Result<Process, SetupError> {
    let table: ProcessTable = toml::from_str(text).map_err(|error| from_toml(&error, text))?;
    let mut reader = Reader::new(text, false);
    let process = from_table(&mut reader, "", &table);
    if reader.wrong.is_empty() { Ok(process) } else { Err(SetupError::Values(reader.wrong)) }
}

fn read(path: &Path) -> Result<String, SetupError> {
    std::fs::read_to_string(path)
        .map_err(|error| SetupError::File { path: path.display().to_string(), why: error.to_string() })
}

fn from_table(reader: &mut Reader, key: &str, table: &ProcessTable) -> Process {
    let within = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    let effects = table.effect.iter().flatten();
    let base = table.base.as_ref().map(|base| material(reader, &within("base"), base).model);
    // A covariance is that of the coefficients in the same file: of the material's own it says nothing.
    let covariance = table.covariance.clone().filter(|_| base.is_some()).unwrap_or_default();
    let covariance_of = table.covariance_of.clone().filter(|_| base.is_some()).unwrap_or_default();
    Process {
        base,
        relative: table.relative.as_ref().map(|relative| of_relative(reader, &within("relative"), relative)),
        tare_w: reader.optional(&within("tare"), table.tare.as_ref(), Dimension::Power, Sense::NotNegative),
        tare_rps: reader.optional(&within("tare_speed"), table.tare_speed.as_ref(), Dimension::Speed, Sense::Positive),
        effects: effects
            .map(|effect| EffectUse {
                name: effect.name.clone(),
                parameters: effect.parameters.iter().flatten().map(|(name, value)| (name.clone(), *value)).collect(),
            })
            .collect(),
        covariance,
        covariance_of,
        scatter: reader.optional(&within("scatter"), table.scatter.as_ref(), Dimension::Ratio, Sense::NotNegative),
        feed_per_tooth_mm: feeds_per_tooth(reader, &within("feed_per_tooth"), table),
    }
}

fn of_relative(reader: &mut Reader, key: &str, table: &RelativeTable) -> RelativeLoad {
    let RelativeTable { unit, tare, tare_speed, k_tc, k_te } = table;
    let speed = reader.optional(&format!("{key}.tare_speed"), tare_speed.as_ref(), Dimension::Speed, Sense::Positive);
    RelativeLoad { unit: unit.clone(), tare: *tare, tare_rps: speed, k_tc: *k_tc, k_te: *k_te }
}

fn feeds_per_tooth(reader: &mut Reader, key: &str, table: &ProcessTable) -> Vec<(u32, f64)> {
    let mut found = Vec::new();
    for (tool, feed) in table.feed_per_tooth.iter().flatten() {
        match tool.parse() {
            Ok(number) => {
                let feed = reader.optional(&format!("{key}.{tool}"), Some(feed), Dimension::Length, Sense::Positive);
                found.extend(feed.map(|feed| (number, feed)));
            }
            Err(_) => reader.complain(key, format!("{tool} is no tool"), "write the number of the tool: { 1 = 0.08 }"),
        }
    }
    found.sort_by_key(|(number, _)| *number);
    found
}

/// The text of a model file.
pub fn write(process: &Process) -> String {
    let mut text = String::from("# Written by feedwright; use with --model, or [process] include = \"…\".\n");
    if let Some(tare_w) = process.tare_w {
        text += &format!("tare = {tare_w:?} # W\n");
    }
    if let Some(tare_rps) = process.tare_rps {
        text += &format!("tare_speed = {:?} # rev/min\n", rpm_from_rps(tare_rps));
    }
    if !process.covariance.is_empty() {
        text += &format!("covariance = {:?}\ncovariance_of = {:?}\n", process.covariance, process.covariance_of);
    }
    if let Some(scatter) = process.scatter {
        text += &format!("scatter = {scatter:?} # of a cut's load, unexplained on held-out data\n");
    }
    if !process.feed_per_tooth_mm.is_empty() {
        let each: Vec<String> = process.feed_per_tooth_mm.iter().map(|(tool, f)| format!("{tool} = {f:?}")).collect();
        text += &format!("feed_per_tooth = {{ {} }} # mm, highest that was measured, by tool\n", each.join(", "));
    }
    if let Some(base) = &process.base {
        text += "\n[base]\n";
        for (name, value) in &parameters(base).0 {
            text += &match value {
                Quantity::Number(number) => format!("{name} = {number:?}\n"),
                Quantity::Text(word) => format!("{name} = \"{word}\"\n"),
            };
        }
    }
    if let Some(RelativeLoad { unit, tare, tare_rps, k_tc, k_te }) = &process.relative {
        text += "\n# Loads in parts of an unknown rating: for readings alone, no feed rests on them.\n[relative]\n";
        text += &format!("unit = \"{unit}\"\ntare = {tare:?}\n");
        if let Some(tare_rps) = tare_rps {
            text += &format!("tare_speed = {:?} # rev/min\n", rpm_from_rps(*tare_rps));
        }
        text += &format!("k_tc = {k_tc:?} # {unit}/(1000 mm³/s)\nk_te = {k_te:?} # {unit}/(1000 mm²/s)\n");
    }
    for effect in &process.effects {
        text += &format!("\n[[effect]]\nname = \"{}\"\n[effect.parameters]\n", effect.name);
        for (name, value) in &effect.parameters {
            text += &format!("{name} = {value:?}\n");
        }
    }
    text
}

fn parameters(model: &ForceModel) -> MaterialTable {
    let number = |name: &str, value: f64| (name.to_owned(), Quantity::Number(value));
    let word = |value: &str| ("model".to_owned(), Quantity::Text(value.to_owned()));
    MaterialTable(match model {
        ForceModel::LinearEdge(k) => [
            word("linear-edge"),
            number("k_tc", k.k_tc),
            number("k_rc", k.k_rc),
            number("k_ac", k.k_ac),
            number("k_te", k.k_te),
            number("k_re", k.k_re),
            number("k_ae", k.k_ae),
        ]
        .into(),
        ForceModel::Named { name, parameters } => {
            parameters.iter().map(|(name, value)| number(name, *value)).chain([word(name)]).collect()
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::material::LinearEdge;

    #[test]
    fn a_model_file_reads_back_as_it_was() {
        let edge = LinearEdge { k_tc: 800.1, k_rc: 300.0, k_ac: 100.0, k_te: 14.0, k_re: 12.0, k_ae: 2.0 };
        let process = Process {
            base: Some(ForceModel::LinearEdge(edge)),
            tare_w: Some(0.1 + 0.2),
            tare_rps: Some(50.0),
            relative: Some(RelativeLoad { unit: "%".into(), tare: 2.5, tare_rps: Some(25.0), k_tc: 478.1, k_te: 2.3 }),
            effects: vec![EffectUse { name: "runout".into(), parameters: vec![("offset_mm".into(), 1e-3)] }],
            covariance: vec![vec![1.0, 1e-9], vec![1e-9, 2.0]],
            covariance_of: vec!["k_tc".into(), "k_te".into()],
            scatter: Some(0.04),
            feed_per_tooth_mm: vec![(1, 0.08), (12, 0.05)],
        };
        assert_eq!(load(&write(&process)).unwrap(), process);
    }

    #[test]
    fn a_covariance_without_its_coefficients_is_none() {
        let text = "covariance = [[450.0]]\ncovariance_of = [\"k_tc\"]\n";
        assert_eq!(load(text).unwrap(), Process::default());
    }
}
