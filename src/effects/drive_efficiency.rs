//! Efficiency of the drive: reading = P · (1 + c·P/P_max).

use super::{Acts, Change, Covariate, Effect, Parameter, State};

/// `drive-efficiency`.
pub const EFFECT: Effect = Effect {
    name: "drive-efficiency",
    meaning: "the drive wastes a larger share at high load",
    acts: Acts::Measuring,
    covariates: &[Covariate::Load],
    parameters: &[Parameter {
        name: "excess",
        unit: "-",
        min: 0.0,
        max: 1.5,
        starts: &[0.05],
        neutral: None,
        scanned: false,
        meaning: "relative excess of the reading at the largest load",
    }],
    change,
    separated_by: "one immersion at five feeds, up to the largest power",
};

fn change(p: &[f64], _: &State) -> Change {
    Change { reading_excess: p[0], ..Change::default() }
}
