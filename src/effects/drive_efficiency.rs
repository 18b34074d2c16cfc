//! Efficiency of the drive: reading = P · (1 + c·(P/P_max)^p): its losses beyond those of no load grow as the power 1 +
//! p of the load: p = 1 for losses in the windings, more where a drive is run beyond what it is made for.

use super::{Acts, BARE, Change, Covariate, Effect, Parameter, State};

/// `drive-efficiency`.
pub const EFFECT: Effect = Effect {
    name: "drive-efficiency",
    meaning: "the drive wastes a larger share at high load",
    acts: Acts::Measuring,
    covariates: &[Covariate::Load],
    parameters: &[
        Parameter {
            name: "excess",
            unit: "-",
            min: 0.0,
            max: 1.5,
            starts: &[0.05],
            neutral: None,
            place: None,
            meaning: "relative excess of the reading at the largest load",
        },
        Parameter {
            name: "exponent",
            unit: "-",
            min: 0.3,
            max: 4.0,
            starts: &[1.2],
            neutral: Some(1.0),
            place: None,
            meaning: "power of the load with which the excess grows",
        },
    ],
    change,
    separated_by: "one immersion at five feeds, up to the largest power",
    ..BARE
};

fn change(p: &[f64], _: &State) -> Change {
    Change { reading_excess: p[0], reading_exponent: p[1], ..Change::default() }
}
