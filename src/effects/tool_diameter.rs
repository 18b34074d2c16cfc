//! Tool diameter. In: nothing of the cut. Out: difference of the diameter to the declared one, mm, with which the cut is simulated anew.

use super::{Acts, BARE, Change, Covariate, Effect, Geometry, Parameter, State};

/// `tool-diameter`.
pub const EFFECT: Effect = Effect {
    name: "tool-diameter",
    meaning: "the tool is smaller (or larger) than declared",
    acts: Acts::Geometry,
    covariates: &[Covariate::RadialDepth],
    parameters: &[Parameter {
        name: "difference",
        unit: "mm",
        min: -2.0,
        max: 2.0,
        starts: &[0.0],
        neutral: None,
        place: None,
        meaning: "true minus declared diameter",
    }],
    change,
    separated_by: "a full slot beside a light side cut",
    geometry: &[Geometry::Diameter],
    ..BARE
};

fn change(p: &[f64], _: &State) -> Change {
    Change { diameter_mm: p[0], ..Change::default() }
}
