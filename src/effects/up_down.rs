//! Up milling against climb milling. In: share of up-milling u, +1 (all up) … −1 (all climb). Out, tooth by tooth: k_?c · (1 + c u),
//! k_?e · (1 + e u); or by pass, where it is how the whole pass is cut that counts: k · (1 + b sgn u).

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
        Parameter {
            name: "by_pass",
            unit: "-",
            min: -0.6,
            max: 0.6,
            starts: &[0.0],
            neutral: Some(0.0),
            place: None,
            meaning: "the same of all coefficients, whatever share of a tooth's way is up",
        },
    ],
    forms: &[&[0], &[1], &[0, 1], &[2]],
    change,
    separated_by: "the same wall cut up and climb",
    needs: &[Need::Range(Covariate::UpShare, 0.3)],
    ..BARE
};

/// Share of up-milling below which a cut is neither up nor climb milling but goes over from one to the other: a slot has 0. Judgement.
const SLOT: f64 = 0.1;

fn change(p: &[f64], state: &State) -> Change {
    let by_pass = 1.0 + p[2] * (state.up_share / SLOT).clamp(-1.0, 1.0);
    Change {
        cutting: by_pass * (1.0 + p[0] * state.up_share_chip),
        edge: by_pass * (1.0 + p[1] * state.up_share),
        ..Change::default()
    }
}
