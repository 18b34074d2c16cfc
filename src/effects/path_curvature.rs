//! Path curvature. In: nothing of the cut. Out: removal and contact rate of the curved path instead of those of a straight one with the
//! same depths. No parameter.

use super::{Acts, BARE, Change, Covariate, Effect, Geometry, State};

/// `path-curvature`.
pub const EFFECT: Effect = Effect {
    name: "path-curvature",
    meaning: "on a curved path the tool meets more (concave) or less (convex) than on a straight one",
    acts: Acts::Geometry,
    covariates: &[Covariate::Curvature],
    parameters: &[],
    change,
    separated_by: "concave and convex arcs of two radii, both up and climb",
    geometry: &[Geometry::Curved],
    ..BARE
};

fn change(_: &[f64], _: &State) -> Change {
    Change { curved: 1.0, ..Change::default() }
}
