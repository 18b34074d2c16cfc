//! Flank wear in its three stages: k_?e · (1 + r(1 − e^(−l/λ)) + g·l + a·l³), l the distance each tooth has slid
//! through material in units of 100 m: running in, steady growth, the end of the edge.

use super::{Acts, BARE, Change, Covariate, Effect, Need, Parameter, State};

/// `flank-wear`.
pub const EFFECT: Effect = Effect {
    name: "flank-wear",
    meaning: "edge forces grow with the distance the teeth have slid",
    acts: Acts::Load,
    covariates: &[Covariate::Sliding, Covariate::Time, Covariate::Volume],
    family: &[Covariate::Sliding],
    parameters: &[
        Parameter {
            name: "growth_per_100m",
            unit: "1/100m",
            min: 0.0,
            max: 50.0,
            starts: &[0.5],
            neutral: None,
            place: None,
            meaning: "relative growth of the edge coefficients every 100 m",
        },
        Parameter {
            name: "run_in",
            unit: "-",
            min: 0.0,
            max: 3.0,
            starts: &[0.3],
            neutral: Some(0.0),
            place: None,
            meaning: "relative growth while the edge runs in",
        },
        Parameter {
            name: "run_in_length",
            unit: "100m",
            min: 0.005,
            max: 5.0,
            starts: &[0.1],
            neutral: Some(0.1),
            place: None,
            meaning: "distance over which it runs in",
        },
        Parameter {
            name: "end",
            unit: "1/(100m)^3",
            min: 0.0,
            max: 50.0,
            starts: &[0.05],
            neutral: Some(0.0),
            place: None,
            meaning: "cubic growth towards the end of the edge",
        },
    ],
    change,
    separated_by: "the first cut repeated after the last, at the same feed",
    needs: &[Need::Range(Covariate::Sliding, 1e3)],
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    let l = (state.sliding_mm * 1e-5).max(0.0);
    let growth = p[0] * l + p[1] * (1.0 - (-l / p[2]).exp()) + p[3] * l * l * l;
    Change { edge: 1.0 + growth, ..Change::default() }
}
