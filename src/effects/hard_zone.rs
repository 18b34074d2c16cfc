//! Hard zone: all coefficients · (1 + z) inside a box of the work coordinates.

use super::{Acts, Change, Covariate, Effect, Parameter, State};

/// `hard-zone`.
pub const EFFECT: Effect = Effect {
    name: "hard-zone",
    meaning: "the material is harder (or softer) in a region of the stock",
    acts: Acts::Load,
    covariates: &[Covariate::X, Covariate::Y, Covariate::Z],
    parameters: &[
        Parameter {
            name: "excess",
            unit: "-",
            min: -0.8,
            max: 5.0,
            starts: &[0.2],
            neutral: None,
            scanned: false,
            meaning: "relative excess of all coefficients inside",
        },
        Parameter {
            name: "x_min",
            unit: "mm",
            min: -1e9,
            max: 1e9,
            starts: &[0.0],
            neutral: None,
            scanned: true,
            meaning: "region",
        },
        Parameter {
            name: "x_max",
            unit: "mm",
            min: -1e9,
            max: 1e9,
            starts: &[0.0],
            neutral: None,
            scanned: true,
            meaning: "region",
        },
        Parameter {
            name: "y_min",
            unit: "mm",
            min: -1e9,
            max: 1e9,
            starts: &[0.0],
            neutral: None,
            scanned: true,
            meaning: "region",
        },
        Parameter {
            name: "y_max",
            unit: "mm",
            min: -1e9,
            max: 1e9,
            starts: &[0.0],
            neutral: None,
            scanned: true,
            meaning: "region",
        },
    ],
    change,
    separated_by: "crossing the region again, later and in another direction",
};

fn change(p: &[f64], state: &State) -> Change {
    let (x, y) = (state.position.x, state.position.y);
    let inside = x >= p[1] && x <= p[2] && y >= p[3] && y <= p[4];
    let factor = if inside { 1.0 + p[0] } else { 1.0 };
    Change { cutting: factor, edge: factor, ..Change::default() }
}
