//! Lag of the measuring chain: first order, T·ẏ + y = P.

use super::{Acts, Change, Covariate, Effect, Parameter, State};

/// `sensor-lag`.
pub const EFFECT: Effect = Effect {
    name: "sensor-lag",
    meaning: "the reading follows the load with a delay",
    acts: Acts::Measuring,
    covariates: &[Covariate::LoadChange],
    parameters: &[Parameter {
        name: "time_constant",
        unit: "s",
        min: 0.005,
        max: 20.0,
        starts: &[0.05, 0.2, 0.8, 3.0],
        neutral: None,
        scanned: false,
        meaning: "of a first-order lag",
    }],
    change,
    separated_by: "short cuts between air moves",
};

fn change(p: &[f64], _: &State) -> Change {
    Change { lag_s: p[0], ..Change::default() }
}
