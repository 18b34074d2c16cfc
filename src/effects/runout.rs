//! Runout. In: nothing of the cut. Out: thickness δ added to the chip of the most loaded tooth, and the offset ρ of the tool's axis.
//!
//! With its axis off that of the spindle by ρ, one of N teeth stands out over the tooth before it by up to δ = 2ρ sin(π/N) ≤ √3 ρ
//! (N ≥ 3) and cuts h + δ. The total removed by all teeth does not change. At small feeds some teeth do not cut at all.

use super::{Acts, BARE, Change, Covariate, Effect, Geometry, Parameter, State};

/// `runout`.
pub const EFFECT: Effect = Effect {
    name: "runout",
    meaning: "the tool turns off its axis, so that one tooth cuts more than the others",
    acts: Acts::Geometry,
    covariates: &[Covariate::FeedPerTooth],
    parameters: &[
        Parameter {
            name: "offset",
            unit: "mm",
            min: 0.0,
            max: 0.1,
            starts: &[0.01],
            neutral: None,
            place: None,
            meaning: "of the tool's axis from that of the spindle",
        },
        Parameter {
            name: "phase",
            unit: "pitch",
            min: -0.5,
            max: 1.5,
            starts: &[0.06, 0.19, 0.31, 0.44, 0.56, 0.69, 0.81, 0.94],
            neutral: None,
            place: None,
            meaning: "where it points: 0 towards one tooth … 1 towards the next",
        },
    ],
    change,
    separated_by: "peak forces at four feeds: the excess does not grow with feed",
    geometry: &[Geometry::Runout],
    ..BARE
};

fn change(p: &[f64], _: &State) -> Change {
    Change { peak_chip_mm: 1.732 * p[0], runout_mm: p[0], runout_phase: p[1], ..Change::default() }
}
