//! Tare over spindle speed. In: spindle speed n and the reference speed n₀. Out: P₀ · (1 + a x + b x²) with x = n/n₀ − 1.

use super::{Acts, BARE, Change, Covariate, Effect, Multiplies, Need, Parameter, State};

/// `tare-speed`.
pub const EFFECT: Effect = Effect {
    name: "tare-speed",
    meaning: "the tare depends on spindle speed otherwise than declared",
    acts: Acts::Load,
    covariates: &[Covariate::SpindleSpeed],
    multiplies: Multiplies::Tare,
    family: &[Covariate::SpindleSpeed],
    parameters: &[
        Parameter {
            name: "slope",
            unit: "-",
            min: -3.0,
            max: 10.0,
            starts: &[0.3],
            neutral: None,
            place: None,
            meaning: "relative change per relative change of speed",
        },
        Parameter {
            name: "curvature",
            unit: "-",
            min: -5.0,
            max: 10.0,
            starts: &[0.0],
            neutral: Some(0.0),
            place: None,
            meaning: "second-order term",
        },
    ],
    change,
    separated_by: "air cuts at four spindle speeds",
    needs: &[Need::Tare, Need::Ratio(Covariate::SpindleSpeed, 1.05)],
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    let x = state.rps / state.reference_rps - 1.0;
    Change { tare: (1.0 + p[0] * x + p[1] * x * x).max(0.0), ..Change::default() }
}
