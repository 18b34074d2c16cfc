//! Edge force, for base models without one. In: mean chip thickness h. Out: k_?c · (1 + l/h) with l = k_?e / k_?c.
//!
//! The force is that of chips thicker by l: the edge ploughs even where it hardly cuts.

use super::{Acts, BARE, Change, Covariate, Effect, Need, Parameter, State};

/// `edge-force`.
pub const EFFECT: Effect = Effect {
    name: "edge-force",
    meaning: "the edge rubs with a force that does not depend on the chip, and the model has no edge coefficients",
    acts: Acts::Load,
    covariates: &[Covariate::ChipThickness, Covariate::FeedPerTooth],
    parameters: &[Parameter {
        name: "equivalent_chip",
        unit: "mm",
        min: 0.0,
        max: 0.2,
        starts: &[0.02],
        neutral: None,
        place: None,
        meaning: "edge over cutting coefficient: the chip thickness that would take the same force",
    }],
    change,
    separated_by: "one immersion at five feeds over a factor of eight",
    needs: &[Need::NoEdgeCoefficients, Need::Ratio(Covariate::ChipThickness, 1.2)],
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    Change { cutting: 1.0 + p[0] / state.chip_thickness_mm.max(1e-4), ..Change::default() }
}
