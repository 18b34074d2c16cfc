//! Warm-up of the tare. In: time t since the start. Out: P₀ · (1 + c·exp(−t/τ)).

use super::{Acts, BARE, Change, Covariate, Effect, Multiplies, Need, Parameter, State};

/// `tare-warm-up`.
pub const EFFECT: Effect = Effect {
    name: "tare-warm-up",
    meaning: "the tare falls (or rises) as the spindle warms up",
    acts: Acts::Load,
    covariates: &[Covariate::Time],
    multiplies: Multiplies::Tare,
    parameters: &[
        Parameter {
            name: "excess",
            unit: "-",
            min: -0.8,
            max: 5.0,
            starts: &[0.3],
            neutral: None,
            place: None,
            meaning: "relative excess of the tare when cold",
        },
        Parameter {
            name: "time_constant",
            unit: "s",
            min: 5.0,
            max: 20000.0,
            starts: &[60.0, 200.0, 800.0],
            neutral: None,
            place: None,
            meaning: "of the warming",
        },
    ],
    change,
    separated_by: "air cuts at the start and every few minutes",
    needs: &[Need::Tare, Need::Range(Covariate::Time, 1.0), Need::Samples],
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    Change { tare: 1.0 + p[0] * (-state.time_s / p[1]).exp(), ..Change::default() }
}
