//! Flank wear: k_?e · (1 + g·(l/100 m)^p), l the distance each tooth has slid through material.

use super::{Acts, Change, Covariate, Effect, Parameter, State};

/// `flank-wear`.
pub const EFFECT: Effect = Effect {
    name: "flank-wear",
    meaning: "edge forces grow with the distance the teeth have slid",
    acts: Acts::Load,
    covariates: &[Covariate::Sliding, Covariate::Time, Covariate::Volume],
    parameters: &[
        Parameter {
            name: "growth_per_100m",
            unit: "1/100m",
            min: 0.0,
            max: 50.0,
            starts: &[0.5],
            neutral: None,
            scanned: false,
            meaning: "relative growth of the edge coefficients after 100 m",
        },
        Parameter {
            name: "exponent",
            unit: "-",
            min: 0.4,
            max: 2.5,
            starts: &[1.0],
            neutral: Some(1.0),
            scanned: false,
            meaning: "exponent of the distance",
        },
    ],
    change,
    separated_by: "the first cut repeated after the last, at the same feed",
};

fn change(p: &[f64], state: &State) -> Change {
    let sliding_100m = (state.sliding_mm * 1e-5).max(0.0);
    Change { edge: 1.0 + p[0] * sliding_100m.powf(p[1]), ..Change::default() }
}
