//! Stock proud of its model: top face and side faces shifted outward.

use super::{Acts, BARE, Change, Covariate, Effect, Geometry, Parameter, State};

/// `stock-proud`.
pub const EFFECT: Effect = Effect {
    name: "stock-proud",
    meaning: "the stock is larger than its model",
    acts: Acts::Geometry,
    covariates: &[Covariate::AxialDepth, Covariate::RadialDepth, Covariate::X, Covariate::Y, Covariate::Z],
    parameters: &[
        Parameter {
            name: "top",
            unit: "mm",
            min: -5.0,
            max: 5.0,
            starts: &[0.0],
            neutral: Some(0.0),
            place: None,
            meaning: "how much higher",
        },
        Parameter {
            name: "side",
            unit: "mm",
            min: -5.0,
            max: 5.0,
            starts: &[0.0],
            neutral: Some(0.0),
            place: None,
            meaning: "how much wider on each side",
        },
    ],
    change,
    separated_by: "one pass over the raw face and one below it",
    geometry: &[Geometry::StockTop, Geometry::StockSide],
    ..BARE
};

fn change(p: &[f64], _: &State) -> Change {
    Change { stock_top_mm: p[0], stock_side_mm: p[1], ..Change::default() }
}
