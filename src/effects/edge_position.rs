//! Position along the cutting edge. In: height z of the cut above the tip. Out: k_?c · (1 + s z).

use super::{Acts, BARE, Change, Covariate, Effect, Need, Parameter, State};

/// `edge-position`.
pub const EFFECT: Effect = Effect {
    name: "edge-position",
    meaning: "coefficients differ along the cutting edge (rake and helix change towards the tip)",
    acts: Acts::Load,
    covariates: &[Covariate::EdgePosition, Covariate::AxialDepth],
    parameters: &[Parameter {
        name: "slope",
        unit: "1/mm",
        min: -2.0,
        max: 2.0,
        starts: &[0.0],
        neutral: None,
        place: None,
        meaning: "relative change of the cutting coefficients per mm along the edge",
    }],
    change,
    separated_by: "layers at several heights with the same chip thickness",
    needs: &[Need::Range(Covariate::EdgePosition, 0.05)],
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    Change { cutting: (1.0 + p[0] * state.edge_position_mm).max(0.0), ..Change::default() }
}
