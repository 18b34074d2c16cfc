//! Entry: forces are higher where the tool has just entered: all coefficients · (1 + e·e^(−s/λ)), s the path since the tool
//! met material.

use super::{Acts, Change, Covariate, Effect, Parameter, State};

/// `entry`.
pub const EFFECT: Effect = Effect {
    name: "entry",
    meaning: "forces are higher over the first millimetres after the tool enters (shock, chips without way out, a skin)",
    acts: Acts::Load,
    covariates: &[Covariate::SinceEntry],
    parameters: &[
        Parameter {
            name: "excess",
            unit: "-",
            min: 0.0,
            max: 3.0,
            starts: &[0.2],
            neutral: None,
            scanned: false,
            meaning: "relative excess at the moment of entry",
        },
        Parameter {
            name: "length",
            unit: "mm",
            min: 0.1,
            max: 50.0,
            starts: &[2.0],
            neutral: None,
            scanned: false,
            meaning: "path over which it dies away to a third",
        },
    ],
    change,
    separated_by: "many short cuts beside one long cut, at the same engagement and feed",
};

fn change(p: &[f64], state: &State) -> Change {
    let factor = 1.0 + p[0] * (-state.since_entry_mm / p[1]).exp();
    Change { cutting: factor, edge: factor, ..Change::default() }
}
