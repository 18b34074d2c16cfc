//! The built-in library: materials, machines, tool materials, each with its source and the uncertainty it states.
//!
//! In: the TOML files beside this one, embedded. Out: entries for the `library` commands, and what the setup file asks for by
//! name. A published specific cutting force k = k_c1.1 h^(−m_c), brought to milling at a rake of 0°, becomes the tangent of the force k_c1.1 h^(1−m_c) at
//! [`TANGENT_MM`]: k_tc = (1 − m_c) k_c1.1 h₀^(−m_c), k_te = m_c k_c1.1 h₀^(1−m_c). The force is concave in h, so the line lies above it.

use super::file::MachineTable;
use super::forms::MaterialTable;
use super::quantity::Quantity;
use serde::Deserialize;

/// Chip thickness at which a linear edge model touches Kienzle's curve, mm.
pub const TANGENT_MM: f64 = 0.05;
/// Radial over tangential force where only the tangential one is published (conservative end of what is measured).
const NORMAL_SHARE: f64 = 0.7;
/// Axial over tangential force likewise.
const AXIAL_SHARE: f64 = 0.3;

/// Chip compression is stronger in milling than in turning (Tabellenbuch Zerspantechnik, 5th edition, p. 215).
const MILLING: f64 = 1.2;

/// A material.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialEntry {
    /// Name in the setup file.
    pub name: String,
    /// What people call it, in small letters.
    #[serde(default)]
    pub names: Vec<String>,
    /// What it is.
    pub meaning: String,
    /// Where the numbers come from.
    pub source: String,
    /// What is known of other alloys of its kind and of other sources.
    pub spread: String,
    /// State of the edge the numbers hold for.
    pub edge: String,
    /// Relative standard uncertainty of forces.
    pub uncertainty: f64,
    coefficients: Option<MaterialTable>,
    /// Specific cutting force at a chip of 1 × 1 mm as the source prints it, N/mm².
    k_c11: Option<f64>,
    m_c: Option<f64>,
    /// Rake angle the source holds for, deg; absent: not stated.
    rake_deg: Option<f64>,
    /// Names of the entries whose upper bound this one is.
    family: Option<Vec<String>>,
}

/// Specific cutting force in milling, sharp, at a rake of 0°: k = k_c1.1 h^(−m_c), h in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kienzle {
    /// At a chip of 1 × 1 mm, N/mm².
    pub k_c11: f64,
    /// Exponent.
    pub m_c: f64,
}

/// A machine.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MachineEntry {
    /// Name in the setup file.
    pub name: String,
    /// What it is.
    pub meaning: String,
    /// Where the numbers come from.
    pub source: String,
    /// Relative uncertainty of what is assumed.
    pub uncertainty: f64,
    pub(super) machine: MachineTable,
}

/// A tool material.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ToolMaterialEntry {
    /// Name in the setup file.
    pub name: String,
    /// What it is.
    pub meaning: String,
    /// Young's modulus, MPa.
    pub youngs_modulus_mpa: f64,
    /// Bending stress that is safe to allow, MPa.
    pub bending_stress_mpa: f64,
    /// Where the numbers come from.
    pub source: String,
    /// Relative uncertainty of the modulus.
    pub uncertainty: f64,
}

impl MaterialEntry {
    /// Its model and coefficients, as keys of a `[material]` table.
    pub fn keys(&self) -> Vec<(String, String)> {
        let table = self.table().0.into_iter().filter(|(key, _)| key != "name" && key != "uncertainty");
        let text = |quantity| match quantity {
            Quantity::Number(number) => format!("{}", (number * 1e4).round() / 1e4),
            Quantity::Text(text) => format!("\"{text}\""),
        };
        table.map(|(key, quantity)| (key, text(quantity))).collect()
    }

    /// Its specific cutting force; `None` where coefficients were measured.
    pub fn kienzle(&self) -> Option<Kienzle> {
        let Some(family) = &self.family else {
            let (printed, m_c) = self.k_c11.zip(self.m_c)?;
            return Some(Kienzle { k_c11: printed * MILLING / (1.0 - 0.01 * self.rake_deg.unwrap_or(0.0)), m_c });
        };
        let entries = materials();
        let members = entries.iter().filter(|entry| family.contains(&entry.name)).filter_map(MaterialEntry::kienzle);
        members.reduce(|a, b| Kienzle { k_c11: a.k_c11.max(b.k_c11), m_c: a.m_c.max(b.m_c) })
    }

    /// The entries whose upper bound this one is.
    #[cfg(feature = "rooms")]
    pub fn family(&self) -> &[String] {
        self.family.as_deref().unwrap_or(&[])
    }

    /// Its `[material]` table.
    pub(super) fn table(&self) -> MaterialTable {
        let mut table = match (&self.coefficients, self.kienzle()) {
            (Some(coefficients), _) => coefficients.clone(),
            (None, Some(Kienzle { k_c11, m_c })) => tangent(k_c11, m_c),
            (None, None) => MaterialTable::default(),
        };
        table.0.insert("name".to_owned(), Quantity::Text(self.name.clone()));
        table.0.insert("uncertainty".to_owned(), Quantity::Number(self.uncertainty));
        table
    }
}

/// Linear edge model that touches Kienzle's curve at [`TANGENT_MM`].
fn tangent(k_c11: f64, m_c: f64) -> MaterialTable {
    let k_tc = (1.0 - m_c) * k_c11 * TANGENT_MM.powf(-m_c);
    let k_te = m_c * k_c11 * TANGENT_MM.powf(1.0 - m_c);
    let entries = [
        ("k_tc", k_tc),
        ("k_te", k_te),
        ("k_rc", NORMAL_SHARE * k_tc),
        ("k_re", NORMAL_SHARE * k_te),
        ("k_ac", AXIAL_SHARE * k_tc),
        ("k_ae", AXIAL_SHARE * k_te),
    ];
    MaterialTable(entries.map(|(key, value)| (key.to_owned(), Quantity::Number(value))).into())
}

/// Every material.
pub fn materials() -> Vec<MaterialEntry> {
    #[derive(Deserialize)]
    struct File {
        material: Vec<MaterialEntry>,
    }
    let file: File = toml::from_str(include_str!("materials.toml")).expect("the built-in materials are well formed");
    file.material
}

/// Every machine.
pub fn machines() -> Vec<MachineEntry> {
    #[derive(Deserialize)]
    struct File {
        machine: Vec<MachineEntry>,
    }
    let file: File = toml::from_str(include_str!("machines.toml")).expect("the built-in machines are well formed");
    file.machine
}

/// The keys of a machine as its `[machine]` table in a setup file would hold them.
pub fn machine_keys(name: &str) -> Vec<(String, String)> {
    #[derive(Deserialize)]
    struct File {
        machine: Vec<toml::Table>,
    }
    let file: File = toml::from_str(include_str!("machines.toml")).expect("the built-in machines are well formed");
    let entry = file.machine.into_iter().find(|entry| entry["name"].as_str() == Some(name));
    let table = entry.as_ref().and_then(|entry| entry.get("machine")?.as_table());
    table.into_iter().flatten().map(|(key, value)| (key.clone(), value.to_string())).collect()
}

/// Every tool material.
pub fn tool_materials() -> Vec<ToolMaterialEntry> {
    #[derive(Deserialize)]
    struct File {
        tool_material: Vec<ToolMaterialEntry>,
    }
    let file: File =
        toml::from_str(include_str!("tool_materials.toml")).expect("the built-in tool materials are well formed");
    file.tool_material
}
