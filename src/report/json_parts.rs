//! What the JSON of `learn`, `calibrate` and `evaluate` have in common. In: coefficients, errors. Out: their parts, and text with the
//! keys of each object in alphabetical order.

use serde::Serialize;

use crate::learn::report::{Errors, Estimate};

/// By way of a value, which sorts the keys: so they stood from the first version on, and scripts compare whole files.
pub(super) fn text(part: &impl Serialize) -> String {
    let sorted = serde_json::to_value(part).expect("plain data");
    serde_json::to_string_pretty(&sorted).expect("plain data") + "\n"
}

pub(super) fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// A coefficient; without a standard error where the data cannot tell it.
#[derive(Serialize)]
pub(super) struct EstimatePart<'a> {
    name: &'a str,
    value: f64,
    std_error: Option<f64>,
    unit: &'a str,
}

impl<'a> EstimatePart<'a> {
    fn of(v: &'a Estimate) -> Self {
        Self { name: &v.name, value: v.value, std_error: finite(v.std_error), unit: &v.unit }
    }
}

pub(super) fn estimates(values: &[Estimate]) -> Vec<EstimatePart<'_>> {
    values.iter().map(EstimatePart::of).collect()
}

#[derive(Serialize)]
pub(super) struct ErrorsPart {
    rmse: f64,
    mape: f64,
    r2: f64,
}

impl ErrorsPart {
    pub(super) fn of(errors: &Errors) -> Self {
        Self { rmse: errors.rmse, mape: errors.mape, r2: errors.r2 }
    }
}
