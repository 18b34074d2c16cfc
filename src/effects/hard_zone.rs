//! Hard zone: all coefficients · (1 + z·u), u = ½(1 + tanh((1 − ρ)/w)), ρ⁴ = ((x − x₀)/a)⁴ + ((y − y₀)/b)⁴: a box of the
//! work coordinates with rounded corners and a soft border, w its half width over that of the box; mean over the arc.

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
            scanned: false,
            meaning: "region",
        },
        Parameter {
            name: "x_max",
            unit: "mm",
            min: -1e9,
            max: 1e9,
            starts: &[0.0],
            neutral: None,
            scanned: false,
            meaning: "region",
        },
        Parameter {
            name: "y_min",
            unit: "mm",
            min: -1e9,
            max: 1e9,
            starts: &[0.0],
            neutral: None,
            scanned: false,
            meaning: "region",
        },
        Parameter {
            name: "y_max",
            unit: "mm",
            min: -1e9,
            max: 1e9,
            starts: &[0.0],
            neutral: None,
            scanned: false,
            meaning: "region",
        },
        Parameter {
            name: "border",
            unit: "-",
            min: 0.02,
            max: 2.0,
            starts: &[0.2],
            neutral: None,
            scanned: false,
            meaning: "half the width of its border over half the width of the region",
        },
    ],
    change,
    separated_by: "crossing the region again, later and in another direction",
};

fn change(p: &[f64], state: &State) -> Change {
    let centre = [f64::midpoint(p[1], p[2]), f64::midpoint(p[3], p[4])];
    let half = [(0.5 * (p[2] - p[1])).abs().max(0.5), (0.5 * (p[4] - p[3])).abs().max(0.5)];
    let [cutting, edge] = state.over_arc(|sector| {
        let far: f64 = (0..2).map(|k| ((sector.at[k] - centre[k]) / half[k]).powi(4)).sum();
        1.0 + p[0] * 0.5 * (1.0 + ((1.0 - far.sqrt().sqrt()) / p[5]).tanh())
    });
    Change { cutting, edge, ..Change::default() }
}
