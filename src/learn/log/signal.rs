//! Checks that a measured signal can be used. In: a column. Out: an error if it is constant or mostly missing.

use crate::learn::log::Log;
use crate::learn::log::columns::DataError;

/// Rejects a constant signal, by its least and greatest value.
pub fn changes(name: &str, least: f64, greatest: f64) -> Result<(), DataError> {
    if greatest - least > 1e-9 * greatest.abs() {
        return Ok(());
    }
    Err(DataError::Unfit(format!("{name} is constant ({greatest}): the sensor was not connected")))
}

/// Rejects measured columns of a table that are constant or mostly missing.
pub fn readable(name: &str, values: &[f64]) -> Result<(), DataError> {
    let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let missing = values.len() - known.len();
    if 2 * missing > values.len() {
        return Err(DataError::Unfit(format!("{} % of {name} are missing", 100 * missing / values.len())));
    }
    let (least, greatest) = known.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    changes(name, least, greatest)
}

/// Rejects a log with a measured signal that is constant or has fewer than 20 values.
pub fn reject_dead_signals(log: &Log) -> Result<(), DataError> {
    for (name, values) in &log.measured {
        let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        let (lo, hi) = known.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(*v), hi.max(*v)));
        if known.len() < 20 {
            return Err(DataError::Unfit(format!("{name} has only {} values; 20 are the least", known.len())));
        }
        changes(name, lo, hi)?;
    }
    Ok(())
}
