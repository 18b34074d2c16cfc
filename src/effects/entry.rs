//! Entry. In: path s since the tool entered material. Out: a factor 1 + y on all coefficients, y(0) = e.
//!
//! The excess decays as λ dy/ds = −e (y/e)^m. For order m = 1 that is y = e·exp(−s/λ); for m < 1 it is
//! y = e (1 − (1 − m) s/λ)^(1/(1 − m)), which reaches 0 at s = λ/(1 − m).

use super::{Acts, BARE, Change, Covariate, Effect, Need, Parameter, State, Way};

/// `entry`.
pub const EFFECT: Effect = Effect {
    name: "entry",
    meaning: "forces are higher over the first millimetres after the tool enters (shock, chips without way out, a skin)",
    acts: Acts::Load,
    covariates: &[Covariate::SinceEntry],
    family: &[Covariate::SinceEntry],
    way: Way::Down,
    parameters: &[
        Parameter {
            name: "excess",
            unit: "-",
            min: 0.0,
            max: 3.0,
            starts: &[0.2],
            neutral: None,
            place: None,
            meaning: "relative excess at the moment of entry",
        },
        Parameter {
            name: "length",
            unit: "mm",
            min: 0.1,
            max: 50.0,
            starts: &[2.0],
            neutral: None,
            place: None,
            meaning: "path over which it would die away at the rate of the entry",
        },
        Parameter {
            name: "order",
            unit: "-",
            min: 0.0,
            max: 1.0,
            starts: &[0.6],
            neutral: Some(1.0),
            place: None,
            meaning: "how its decay slows down: 1 as an exponential does, 0 not at all before its end",
        },
    ],
    change,
    separated_by: "many short cuts beside one long cut, at the same engagement and feed",
    needs: &[Need::Known(Covariate::SinceEntry), Need::Range(Covariate::SinceEntry, 1.0)],
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    let (way, rest) = (state.since_entry_mm / p[1], 1.0 - p[2]);
    let left = if rest < 1e-6 { (-way).exp() } else { (1.0 - rest * way).max(0.0).powf(1.0 / rest) };
    // An unknown path gives an unknown factor; `max` alone would turn NaN into a number.
    let factor = if way.is_finite() { 1.0 + p[0] * left } else { f64::NAN };
    Change { cutting: factor, edge: factor, ..Change::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_excess_falls_as_its_order_says() {
        let at = |order: f64, since_entry_mm: f64| {
            change(&[0.5, 4.0, order], &State { since_entry_mm, ..State::default() }).cutting - 1.0
        };
        for order in [0.0, 0.3, 0.5, 1.0] {
            assert_eq!(at(order, 0.0), 0.5);
            for s in [0.2, 1.0, 3.0] {
                let slope = (at(order, s + 1e-6) - at(order, s - 1e-6)) / 2e-6;
                assert!((4.0 * slope + 0.5 * (at(order, s) / 0.5).powf(order)).abs() < 1e-6, "{order} {s}");
            }
        }
        assert!((at(1.0, 4.0) - 0.5 * (-1.0f64).exp()).abs() < 1e-12 && at(0.5, 8.5) == 0.0 && at(0.0, 4.1) == 0.0);
        assert!(at(0.5, f64::NAN).is_nan());
    }
}
