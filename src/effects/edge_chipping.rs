//! Edge chipping. In: time t, the time since which the tool is in use. Out: from t₀ on, for a tool in use before, k_?c · (1 + c) and k_?e · (1 + e) (? stands for t, r and a).
//! With t₀ ≤ 0 it holds from the beginning on, for every tool.
//!
//! A chipped edge needs more force, never less: c, e ≥ 0.

use super::{Acts, BARE, Change, Covariate, Effect, Need, Parameter, Place, State};

/// `edge-chipping`.
pub const EFFECT: Effect = Effect {
    name: "edge-chipping",
    meaning: "cutting forces jump when an edge breaks, and stay",
    acts: Acts::Load,
    covariates: &[Covariate::Time],
    parameters: &[
        Parameter {
            name: "jump_cutting",
            unit: "-",
            min: 0.0,
            max: 5.0,
            starts: &[0.1],
            neutral: Some(0.0),
            place: None,
            meaning: "relative jump of the cutting coefficients",
        },
        Parameter {
            name: "jump_edge",
            unit: "-",
            min: 0.0,
            max: 5.0,
            starts: &[0.1],
            neutral: Some(0.0),
            place: None,
            meaning: "relative jump of the edge coefficients",
        },
        Parameter {
            name: "time",
            unit: "s",
            min: 0.0,
            max: 1e9,
            starts: &[0.0],
            neutral: None,
            place: Some(Place::Instant),
            meaning: "when",
        },
    ],
    change,
    separated_by: "the same cut before and after, at another place of the stock",
    needs: &[Need::Range(Covariate::Time, 1.0), Need::Samples],
    is_accident: true,
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    let is_chipped = p[2] <= 0.0 || (state.time_s >= p[2] && state.in_use_since_s <= p[2]);
    let after = f64::from(u8::from(is_chipped));
    Change { cutting: 1.0 + p[0] * after, edge: 1.0 + p[1] * after, ..Change::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_holds_for_a_tool_in_use_before_and_from_the_beginning_for_all() {
        let cutting = |instant_s: f64, time_s: f64, in_use_since_s: f64| {
            change(&[0.2, 0.1, instant_s], &State { time_s, in_use_since_s, ..State::default() }).cutting
        };
        assert_eq!([cutting(50.0, 49.0, 3.0), cutting(50.0, 51.0, 3.0), cutting(50.0, 51.0, 50.5)], [1.0, 1.2, 1.0]);
        // As a model file says it, of a program whose tool cuts from 3 s on.
        assert_eq!([cutting(0.0, 4.0, 3.0), cutting(-1.0, 4.0, 3.0)], [1.2, 1.2]);
    }
}
