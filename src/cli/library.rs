//! `library`. In: a word. Out: the built-in materials, effects or force models on the screen.

use clap::{Args, ValueEnum};

use super::error::CliError;
use super::screen;
use crate::effects::Parameter;
use crate::report::Outcome;
use crate::setup::library;

/// `library`.
#[derive(Debug, Args)]
pub struct Library {
    /// Which shelf; all of them when absent.
    pub shelf: Option<Shelf>,
}

/// A shelf of the library.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Shelf {
    /// Tool presets
    Tools,
    /// Materials with their coefficients
    Materials,
    /// Machines
    Machines,
    /// Effects that diagnosis may name
    Effects,
    /// Force models
    Models,
}

/// Lists one shelf, or all of them.
pub fn library(command: &Library) -> Result<Outcome, CliError> {
    let shelves = match command.shelf {
        Some(shelf) => vec![shelf],
        None => vec![Shelf::Tools, Shelf::Materials, Shelf::Machines, Shelf::Effects, Shelf::Models],
    };
    for shelf in shelves {
        screen::put(list(shelf).as_bytes())?;
    }
    Ok(Outcome::Done)
}

fn list(shelf: Shelf) -> String {
    match shelf {
        Shelf::Effects => effects(),
        Shelf::Models => models(),
        Shelf::Tools => tools(),
        Shelf::Materials => materials(),
        Shelf::Machines => machines(),
    }
}

fn tools() -> String {
    let mut text = String::from(
        "shapes: flat, ball, bull, taper, drill, chamfer, face, high-feed, profile; tap, reamer, probe keep their feeds\n",
    );
    for material in library::tool_materials() {
        text += &format!(
            "{}\n    {}\n    Young's modulus {} GPa ±{:.0} %, bending stress {} MPa; {}\n",
            material.name,
            material.meaning,
            material.youngs_modulus_mpa * 1e-3,
            100.0 * material.uncertainty,
            material.bending_stress_mpa,
            material.source
        );
    }
    text
}

fn materials() -> String {
    let entry = |m: library::MaterialEntry| {
        let keys: Vec<String> = m.keys().iter().map(|(key, value)| format!("{key} = {value}")).collect();
        format!(
            "{}\n    {}\n    {}\n    forces ±{:.0} %; {}\n    {}; {}\n",
            m.name,
            m.meaning,
            keys.join(", "),
            100.0 * m.uncertainty,
            m.source,
            m.edge,
            m.spread
        )
    };
    library::materials().into_iter().map(entry).collect()
}

fn machines() -> String {
    let entry = |m: library::MachineEntry| {
        let keys = library::machine_keys(&m.name).into_iter();
        let keys: Vec<String> = keys.map(|(key, value)| format!("{key} = {value}")).collect();
        let keys = keys.join("\n    ");
        format!(
            "{}\n    {}\n    {keys}\n    assumed values ±{:.0} %; {}\n",
            m.name,
            m.meaning,
            100.0 * m.uncertainty,
            m.source
        )
    };
    library::machines().into_iter().map(entry).collect()
}

fn effects() -> String {
    let mut text = String::new();
    for effect in crate::effects::ALL {
        text += &format!("{}  (acts on {})\n    {}\n", effect.name, effect.acts.name(), effect.meaning);
        for parameter in effect.parameters {
            let Parameter { name, unit, min, max, meaning, .. } = parameter;
            text += &format!("    {name} [{unit}], {min} to {max}: {meaning}\n");
        }
        let along: Vec<&str> = effect.covariates.iter().map(|covariate| covariate.name()).collect();
        text += &format!("    shows along: {}\n    told apart by: {}\n", along.join(", "), effect.separated_by);
    }
    text
}

fn models() -> String {
    let mut text = String::new();
    for model in crate::force::models::ALL {
        text += &format!("{}\n    {}\n    {}\n", model.name, model.meaning, model.source);
        for parameter in model.parameters {
            let default =
                parameter.default.map_or_else(|| "must be given".to_owned(), |value| format!("default {value}"));
            text += &format!("    {} [{}]: {}; {default}\n", parameter.name, parameter.unit, parameter.meaning);
        }
    }
    text
}
