//! Distance along the cutting edge. k_?c · (1 + s·z), z the height of the cut above the tip; or a land at the tip that cuts
//! otherwise than the edge above it (chamfer, corner radius): k_?c and k_?e · (1 + a·p), p the share of the cut below the height of
//! the land. A layer that begins further up, as on a ball, has no share in it.

use super::{Acts, BARE, Change, Covariate, Effect, Need, Parameter, State};

/// Middle of a cut over its depth, up to which it begins at the tip: a half, and what the rounding of a table takes. Judgement.
const AT_TIP: f64 = 0.51;

/// `edge-position`.
pub const EFFECT: Effect = Effect {
    name: "edge-position",
    meaning: "coefficients differ along the cutting edge (rake and helix change towards the tip)",
    acts: Acts::Load,
    covariates: &[Covariate::EdgePosition, Covariate::AxialDepth],
    parameters: &[
        Parameter {
            name: "slope",
            unit: "1/mm",
            min: -2.0,
            max: 2.0,
            starts: &[0.01],
            neutral: Some(0.0),
            place: None,
            meaning: "relative change of the cutting coefficients per mm along the edge",
        },
        Parameter {
            name: "tip_excess",
            unit: "-",
            min: -0.9,
            max: 5.0,
            starts: &[0.2],
            neutral: Some(0.0),
            place: None,
            meaning: "relative excess of cutting and edge coefficients on the land at the tip",
        },
        Parameter {
            name: "land",
            unit: "mm",
            min: 0.02,
            max: 20.0,
            starts: &[0.4, 1.5],
            neutral: Some(0.02),
            place: None,
            meaning: "height of that land above the tip",
        },
    ],
    forms: &[&[0], &[1, 2]],
    change,
    separated_by: "layers at several heights with the same chip thickness",
    needs: &[Need::Range(Covariate::EdgePosition, 0.05)],
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    let [middle_mm, depth_mm] = [state.edge_position_mm, state.axial_depth_mm];
    let begins_at_tip = middle_mm <= AT_TIP * depth_mm;
    let below = if begins_at_tip { (p[2] / depth_mm).min(1.0) } else { 0.0 };
    let tip = if p[1] == 0.0 { 1.0 } else { 1.0 + p[1] * below };
    Change { cutting: (1.0 + p[0] * middle_mm).max(0.0) * tip, edge: tip, ..Change::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_land_at_the_tip_acts_on_the_share_of_the_cut_below_its_height() {
        let cutting = |middle_mm: f64, depth_mm: f64| {
            let state = State { edge_position_mm: middle_mm, axial_depth_mm: depth_mm, ..State::default() };
            change(&[0.0, 0.4, 1.0], &state).cutting
        };
        // All of a cut 1 mm deep, half of one of 2 mm, also where its middle is rounded; nothing of a layer that begins further up.
        for (at, factor) in
            [([0.5, 1.0], 1.4), ([1.0, 2.0], 1.2), ([1.019, 2.0], 1.2), ([1.021, 2.0], 1.0), ([2.5, 1.0], 1.0)]
        {
            assert!((cutting(at[0], at[1]) - factor).abs() < 1e-12, "{at:?}");
        }
    }
}
