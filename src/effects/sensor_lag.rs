//! Lag of the measuring chain. In: nothing of the cut. Out: time constant T of a first-order lag, T dy/dt + y = P.

use super::{Acts, BARE, Change, Covariate, Effect, Need, Parameter, State};

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
        place: None,
        meaning: "of a first-order lag",
    }],
    change,
    separated_by: "short cuts between air moves",
    needs: &[Need::Series],
    refused,
    ..BARE
};

fn refused(p: &[f64], clock_s: f64) -> Option<String> {
    let late = format!("a lag of {:.3} s is less than what the times are known to ({clock_s:.3} s)", p[0]);
    (p[0] < clock_s).then_some(late)
}

fn change(p: &[f64], _: &State) -> Change {
    Change { lag_s: p[0], ..Change::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_shorter_than_the_times_are_known_to_is_refused() {
        assert!((EFFECT.refused)(&[0.09], 0.1).is_some() && (EFFECT.refused)(&[0.11], 0.1).is_none());
    }
}
