//! Why no model file should rest on coefficients. In: parameters of a fit, what the setup declares. Out: one clause for each
//! doubt, with the likely cause.

use crate::learn::log::columns::DataError;
use crate::learn::report::Value;

/// Tangential cutting coefficients of materials that are milled, wood to superalloys, N/mm².
const METALS: [f64; 2] = [20.0, 20_000.0];
/// Factors on the declared coefficient beyond which the units are wrong rather than the material.
const FACTORS: [f64; 2] = [0.05, 20.0];

/// Doubts about a tangential cutting coefficient.
pub fn doubts(parameters: &[Value], declared: Option<f64>) -> Vec<String> {
    let Some(k_tc) = parameters.iter().find(|p| (p.name == "k_tc" || p.name == "k_c11") && p.unit == "N/mm²") else {
        return Vec::new();
    };
    let ask = "are the units right, or columns swapped?";
    match declared.filter(|k| *k > 0.0).map(|k| k_tc.value / k) {
        Some(ratio) if !(FACTORS[0]..=FACTORS[1]).contains(&ratio) => {
            vec![format!("{} would be {ratio:.3} times the declared one: {ask}", k_tc.name)]
        }
        None if !(METALS[0]..=METALS[1]).contains(&k_tc.value) => {
            vec![format!("{} = {:.3} N/mm² is that of no material: {ask}", k_tc.name, k_tc.value)]
        }
        _ => Vec::new(),
    }
}

/// Refuses a signal that does not change between its least and its greatest value.
pub fn changes(name: &str, least: f64, greatest: f64) -> Result<(), DataError> {
    if greatest - least > 1e-9 * greatest.abs() {
        return Ok(());
    }
    Err(DataError::Unfit(format!("{name} is constant ({greatest}): the sensor was not connected")))
}

/// Refuses measured columns of a table that are constant or mostly missing.
pub fn readable(name: &str, values: &[f64]) -> Result<(), DataError> {
    let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let missing = values.len() - known.len();
    if 2 * missing > values.len() {
        return Err(DataError::Unfit(format!("{} % of {name} are missing", 100 * missing / values.len())));
    }
    let (least, greatest) = known.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    changes(name, least, greatest)
}

/// Doubts about tangential coefficients that are negative beyond their errors.
pub fn negative(parameters: &[Value]) -> Vec<String> {
    let below = |p: &&Value| {
        matches!(p.name.as_str(), "k_tc" | "k_te") && p.unit.starts_with("N/") && p.value < -2.0 * p.std_error
    };
    let said = |p: &Value| {
        format!(
            "{} = {:.2} ± {:.2} {} is negative, which no cut is: are columns swapped?",
            p.name, p.value, p.std_error, p.unit
        )
    };
    parameters.iter().filter(below).map(said).collect()
}
