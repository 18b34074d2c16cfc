//! Up milling against climb milling. In: share of up-milling u, +1 (all up) … −1 (all climb), or the mean of cos φ over the arc, which tells
//! where in the arc the teeth are. Out: k_?c · (1 + c u), k_?e · (1 + e u), or the same with cos φ in place of u.

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
            name: "cutting_by_angle",
            unit: "-",
            min: -0.6,
            max: 0.6,
            starts: &[0.0],
            neutral: Some(0.0),
            place: None,
            meaning: "relative excess of the cutting coefficients where up-milling begins, falling as the cosine of the tooth's angle",
        },
        Parameter {
            name: "edge_by_angle",
            unit: "-",
            min: -1.0,
            max: 1.0,
            starts: &[0.0],
            neutral: Some(0.0),
            place: None,
            meaning: "the same of the edge coefficients",
        },
    ],
    forms: &[&[0, 1], &[0], &[1], &[2, 3], &[2], &[3]],
    change,
    separated_by: "the same wall cut up and climb",
    needs: &[Need::Range(Covariate::UpShare, 0.3)],
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    let by_half = [state.up_share_chip, state.up_share];
    let [cutting, edge] = [0, 1].map(|kind| {
        let acts = |factor: f64, share: f64| if factor == 0.0 { 0.0 } else { factor * share };
        1.0 + acts(p[kind], by_half[kind]) + acts(p[2 + kind], state.mean_cosine[kind])
    });
    Change { cutting, edge, ..Change::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_acts_by_the_half_of_the_arc_or_by_the_angle_of_the_tooth() {
        let state = State { up_share: 0.5, up_share_chip: 0.8, mean_cosine: [0.4, 0.6], ..State::default() };
        let acts = |p: [f64; 4]| [change(&p, &state).cutting, change(&p, &state).edge];
        let close = |a: [f64; 2], b: [f64; 2]| (0..2).all(|k| (a[k] - b[k]).abs() < 1e-12);
        assert!(close(acts([0.1, 0.2, 0.0, 0.0]), [1.08, 1.1]));
        assert!(close(acts([0.0, 0.0, 0.1, 0.2]), [1.04, 1.12]));
        // A table without the geometry of its cuts knows neither, and a form that does not act changes nothing there.
        let unknown = change(&[0.0; 4], &State::default());
        assert_eq!([unknown.cutting, unknown.edge], [1.0; 2]);
    }
}
