//! Efficiency of the drive. In: predicted power (or torque) P. Out: the reading, P · (1 + c (P/P₁)^p).
//!
//! The losses of a loaded drive, beyond those without load, grow as P^(1+p): p = 1 for resistive losses in the windings, more where the
//! drive is run beyond its rating. The full load P₁ is the largest that was read in the data that the effect was learned from; with it c and
//! p hold for another program too.

use super::{Acts, BARE, Change, Covariate, Effect, Excess, Need, Parameter, Place, State};

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
            meaning: "relative excess of the reading at full load",
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
        Parameter {
            name: "full_power",
            unit: "W",
            min: 0.0,
            max: 1e9,
            starts: &[0.0],
            neutral: Some(0.0),
            place: Some(Place::LargestPower),
            meaning: "full load where a power was read: the largest reading",
        },
        Parameter {
            name: "full_torque",
            unit: "N·m",
            min: 0.0,
            max: 1e9,
            starts: &[0.0],
            neutral: Some(0.0),
            place: Some(Place::LargestTorque),
            meaning: "full load where a torque was read: the largest reading",
        },
    ],
    forms: &[&[0], &[0, 1]],
    change,
    separated_by: "one immersion at five feeds, up to the largest power",
    needs: &[Need::Tare],
    ..BARE
};

fn change(p: &[f64], _: &State) -> Change {
    let excess = Excess { at_full: p[0], exponent: p[1], full_power: p[2], full_torque_nm: p[3] };
    Change { excess, ..Change::default() }
}
