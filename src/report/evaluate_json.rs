//! JSON of `evaluate`, with the keys of the interface. In: a model held against data that it has not seen. Out: text.

use serde::Serialize;

use super::json_parts::{ErrorsPart, text};
use super::marks::WRITTEN_BY;
use crate::learn::evaluate::{Evaluation, OfQuantity};

/// JSON of a model held against data that it has not seen.
pub fn evaluate_json(evaluation: &Evaluation) -> String {
    text(&EvaluationPart::of(evaluation))
}

#[derive(Serialize)]
struct EvaluationPart<'a> {
    written_by: &'static str,
    samples: usize,
    alignment: Option<TiedPart>,
    effects: &'a [String],
    quantities: Vec<QuantityPart<'a>>,
    warnings: &'a [String],
    /// Of the first quantity.
    test: Option<ErrorsPart>,
}

/// How the log was tied to the program.
#[derive(Serialize)]
struct TiedPart {
    method: &'static str,
    uncertainty_s: f64,
}

#[derive(Serialize)]
struct QuantityPart<'a> {
    name: &'a str,
    samples: usize,
    model: ErrorsPart,
    without_effects: ErrorsPart,
    about_mean_rmse: f64,
    bias: f64,
    median_of_cuts_percent: f64,
}

impl<'a> EvaluationPart<'a> {
    fn of(e: &'a Evaluation) -> Self {
        Self {
            written_by: WRITTEN_BY,
            samples: e.samples,
            alignment: e.tied.map(|(method, uncertainty_s)| TiedPart { method, uncertainty_s }),
            effects: &e.effects,
            quantities: e.quantities.iter().map(QuantityPart::of).collect(),
            warnings: &e.warnings,
            test: e.quantities.first().map(|quantity| ErrorsPart::of(&quantity.model)),
        }
    }
}

impl<'a> QuantityPart<'a> {
    fn of(q: &'a OfQuantity) -> Self {
        Self {
            name: &q.name,
            samples: q.samples,
            model: ErrorsPart::of(&q.model),
            without_effects: ErrorsPart::of(&q.without_effects),
            about_mean_rmse: q.about_mean,
            bias: q.bias,
            median_of_cuts_percent: q.median_of_cuts,
        }
    }
}
