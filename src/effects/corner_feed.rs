//! Corner feed. In: nothing of the cut. Out: the acceleration of the machine as a share of the declared one.
//!
//! A machine that accelerates less than declared slows down more, and over a longer way, around corners.

use super::{Acts, BARE, Change, Covariate, Effect, Parameter, State};

/// `corner-feed`.
pub const EFFECT: Effect = Effect {
    name: "corner-feed",
    meaning: "the feed is not reached at corners and in short blocks",
    acts: Acts::Motion,
    covariates: &[Covariate::FeedRatio],
    parameters: &[Parameter {
        name: "acceleration",
        unit: "-",
        min: 0.001,
        max: 1.0,
        starts: &[0.05],
        neutral: None,
        place: None,
        meaning: "true over declared acceleration",
    }],
    change,
    separated_by: "one long straight cut beside a zigzag of short ones",
    ..BARE
};

fn change(p: &[f64], _: &State) -> Change {
    Change { acceleration: p[0], ..Change::default() }
}
