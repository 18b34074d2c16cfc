//! Distance along the cutting edge. k_?c · (1 + s·z), z the mean height of the cut above the tip; or a land at the tip that cuts
//! otherwise than the edge above it (chamfer, corner radius): k_?c and k_?e · (1 + a·p), p the share of the removed section, and of
//! the contact, below the height of the land. A layer that begins further up, as on a ball, has no share in it.

use super::{Acts, BARE, Change, Covariate, Effect, Need, Parameter, State};

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
    let along = &state.along_edge;
    let [slope, tip_excess, land_mm] = [p[0], p[1], p[2]];
    let by_height = if slope == 0.0 { 1.0 } else { (1.0 + slope * along.middle_mm()).max(0.0) };
    let has_land = tip_excess != 0.0 && along.begins_at_tip();
    let tip = if has_land { along.below(land_mm).map(|share| 1.0 + tip_excess * share) } else { [1.0; 2] };
    Change { cutting: by_height * tip[0], edge: tip[1], ..Change::default() }
}

#[cfg(test)]
mod tests {
    use super::super::along_edge::{AlongEdge, EdgePiece};
    use super::*;

    #[test]
    fn a_land_at_the_tip_acts_on_the_share_of_the_cut_below_its_height() {
        let cutting = |from_mm: f64, to_mm: f64| {
            let state = State { along_edge: AlongEdge::even([from_mm, to_mm]), ..State::default() };
            change(&[0.0, 0.4, 1.0], &state).cutting
        };
        // All of a cut 1 mm deep, half of one of 2 mm; nothing of a layer that begins further up, though it begins below the height of the land.
        for (at, factor) in [([0.0, 1.0], 1.4), ([0.0, 2.0], 1.2), ([0.9, 1.9], 1.0), ([2.0, 3.0], 1.0)] {
            assert!((cutting(at[0], at[1]) - factor).abs() < 1e-12, "{at:?}");
        }
    }

    #[test]
    fn a_slope_acts_at_the_middle_of_what_is_cut() {
        let state = State { along_edge: AlongEdge::even([2.0, 4.0]), ..State::default() };
        assert!((change(&[0.1, 0.0, 0.02], &state).cutting - 1.3).abs() < 1e-12);
        assert_eq!(change(&[0.1, 0.0, 0.02], &state).edge, 1.0);
        // A plunge with the end face alone is cut at the tip, and keeps its load.
        let face = EdgePiece { from_to_mm: [0.0; 2], section_and_contact_mm2: [3.0, 5.0] };
        let plunge = State { along_edge: AlongEdge::of(std::iter::once(face)), ..State::default() };
        assert_eq!(change(&[0.1, 0.0, 0.02], &plunge).cutting, 1.0);
    }
}
