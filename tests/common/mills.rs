//! Tools, spindles and cutters for tests of forces.
#![allow(dead_code)] // each test file uses its own part of it

use feedwright::engage::EngagedArc;
use feedwright::force::{Cutter, ForceError};
use feedwright::machine::material::{ForceModel, Material, Process};
use feedwright::machine::{Limits, Profile, Shape, Slice, Spindle, Table, Tool};

/// A carbide end mill with equal teeth.
pub fn mill(profile: Profile, diameter_mm: f64, flutes: u32, helix_deg: f64) -> Tool {
    Tool {
        number: 1,
        shape: Shape::Profile,
        profile,
        diameter_mm,
        flutes,
        helix_rad: helix_deg.to_radians(),
        pitch_rad: Vec::new(),
        rake_rad: 0.0,
        flute_length_mm: 22.0,
        overhang_mm: 35.0,
        shank_diameter_mm: diameter_mm,
        flute_length_given: true,
        runout: None,
        youngs_modulus_mpa: 600_000.0,
        allowable_stress_mpa: None,
        holder_stiffness_n_mm: None,
        holder: Vec::new(),
        centre_cutting: true,
        coefficients: None,
        limits: Limits::default(),
        wear: None,
    }
}

/// A spindle with 100 W of tare.
pub fn spindle() -> Spindle {
    Spindle {
        max_rps: 1000.0,
        power_w: None,
        torque_nmm: None,
        tare_w: Table::constant(100.0),
        efficiency: Table::constant(1.0),
        runup_time_s: 0.0,
    }
}

/// A model by name.
pub fn named(name: &str, parameters: &[(&str, f64)]) -> ForceModel {
    let parameters = parameters.iter().map(|(key, value)| ((*key).to_owned(), *value)).collect();
    ForceModel::Named { name: name.to_owned(), parameters }
}

/// A cutter with a model and a process.
pub fn try_cutter(
    tool: &Tool,
    slices: &[Slice],
    model: ForceModel,
    process: &Process,
    rps: f64,
) -> Result<Cutter, ForceError> {
    let material = Material { name: "test".into(), model, uncertainty: None };
    Cutter::new(tool, &material, &spindle(), process, slices, rps)
}

/// The same without a process, where nothing can be wrong.
pub fn cutter(tool: &Tool, slices: &[Slice], model: ForceModel, rps: f64) -> Cutter {
    try_cutter(tool, slices, model, &Process::default(), rps).expect("a sound tool and model")
}

/// Arcs of all side rings up to a height.
pub fn side_arcs(slices: &[Slice], depth_mm: f64, entry_rad: f64, exit_rad: f64) -> Vec<EngagedArc> {
    let engaged = slices.iter().enumerate().filter(|(_, s)| s.normal_r > 0.01 && s.z_mm <= depth_mm);
    engaged
        .map(|(k, _)| EngagedArc { slice: k as u32, entry_rad: entry_rad as f32, exit_rad: exit_rad as f32 })
        .collect()
}
