//! Runout: the most loaded tooth cuts h + δ; means over a revolution stay as they are.

use super::{Acts, Change, Covariate, Effect, Parameter, State};

/// `runout`.
pub const EFFECT: Effect = Effect {
    name: "runout",
    meaning: "the tool turns off its axis, so that one tooth cuts more than the others",
    acts: Acts::Geometry,
    covariates: &[Covariate::FeedPerTooth],
    parameters: &[Parameter {
        name: "chip_offset",
        unit: "mm",
        min: 0.0,
        max: 0.2,
        starts: &[0.01],
        neutral: None,
        scanned: false,
        meaning: "added to the chip of the most loaded tooth",
    }],
    change,
    separated_by: "peak forces at four feeds: the excess does not grow with feed",
};

fn change(p: &[f64], _: &State) -> Change {
    Change { peak_chip_mm: p[0], ..Change::default() }
}
