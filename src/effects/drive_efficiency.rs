//! Efficiency of the drive. In: predicted power P. Out: the reading, P · (1 + c (P/P_max)^p).
//!
//! The losses of a loaded drive, beyond those without load, grow as P^(1+p): p = 1 for resistive losses in the windings, more where the
//! drive is run beyond its rating.

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
