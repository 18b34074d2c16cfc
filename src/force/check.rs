//! Whether a tool, a speed and coefficients make sense, with the key of the setup file and the sensible range.

use super::ForceError;
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

/// The spindle speed.
pub(super) fn speed(spindle: &Spindle, rps: f64) -> Result<(), ForceError> {
    if rps <= 0.0 {
        return Err(ForceError::SpindleStopped);
    }
    range("S", rpm_from_rps(rps), 0.0, rpm_from_rps(spindle.max_rps) * (1.0 + 1e-9))
}

/// One value within its range.
pub(super) fn range(key: &str, value: f64, low: f64, high: f64) -> Result<(), ForceError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(ForceError::OutOfRange { key: key.to_owned(), value, low, high })
}
