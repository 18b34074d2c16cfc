//! Checks of the input of force models. In: a tool, coefficients, a spindle speed. Out: an error with the key of the setup file and the
//! sensible range, where a value is outside it.

use super::coefficients::ByPart;
use super::error::{ForceError, range};
use super::models::{self, Values};
use crate::machine::material::ForceModel;
use crate::machine::{Spindle, Tool};
use crate::units::rpm_from_rps;

/// The tool as far as forces need it.
pub(super) fn tool(tool: &Tool) -> Result<(), ForceError> {
    range("flutes", f64::from(tool.flutes), 1.0, 100.0)?;
    range("diameter", tool.diameter_mm, 1e-3, 1e3)?;
    range("helix", tool.helix_rad.to_degrees(), -75.0, 75.0)?;
    range("overhang", tool.overhang_mm, 1e-3, 1e4)?;
    if !tool.pitch_rad.is_empty() {
        range("pitch", tool.pitch_rad.len() as f64, f64::from(tool.flutes), f64::from(tool.flutes))?;
        range("pitch", tool.pitch_rad.iter().sum::<f64>().to_degrees(), 359.9, 360.1)?;
    }
    Ok(())
}

/// The coefficients of a model, whatever tool they are used with.
pub fn model(model: &ForceModel) -> Result<(), ForceError> {
    let (name, given) = match model {
        ForceModel::LinearEdge(k) => return ByPart::same(k).map(drop),
        ForceModel::Named { name, parameters } => (name, parameters),
    };
    if let Some(coefficients) = ByPart::named(name, given) {
        return coefficients.map(drop);
    }
    let known = models::ALL.iter().find(|known| known.name == name);
    let known = known.ok_or_else(|| ForceError::UnknownModel { name: name.clone() })?;
    Values::checked(known, given).map(drop)
}

/// The spindle speed.
pub(super) fn speed(spindle: &Spindle, rps: f64) -> Result<(), ForceError> {
    if rps <= 0.0 {
        return Err(ForceError::SpindleStopped);
    }
    // The highest speed, converted to rev/s and back, may exceed itself by rounding.
    let (rpm, most) = (rpm_from_rps(rps), rpm_from_rps(spindle.max_rps));
    if rpm <= most * (1.0 + 1e-9) { Ok(()) } else { range("S", rpm, 0.0, most) }
}
