//! Up milling against climb milling. In: share of up-milling u, +1 (all up) … −1 (all climb). Out: k_?c · (1 + c u), k_?e · (1 + e u).

use super::{Acts, BARE, Change, Covariate, Effect, Need, Parameter, State};

/// `up-down-asymmetry`.
pub const EFFECT: Effect = Effect {
    name: "up-down-asymmetry",
    meaning: "up-milling and climb differ at the same geometry",
    acts: Acts::Load,
    covariates: &[Covariate::UpShare],
    family: &[Covariate::UpShare],
    parameters: &[
        Parameter {
            name: "cutting",
            unit: "-",
            min: -0.6,
            max: 0.6,
            starts: &[0.0],
            neutral: Some(0.0),
            place: None,
            meaning: "relative difference of the cutting coefficients, half of up minus climb",
        },
        Parameter {
            name: "edge",
            unit: "-",
            min: -1.0,
            max: 1.0,
            starts: &[0.0],
            neutral: Some(0.0),
            place: None,
            meaning: "the same of the edge coefficients",
        },
    ],
    change,
    separated_by: "the same wall cut up and climb",
    needs: &[Need::Range(Covariate::UpShare, 0.3)],
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    Change { cutting: 1.0 + p[0] * state.up_share_chip, edge: 1.0 + p[1] * state.up_share, ..Change::default() }
}
