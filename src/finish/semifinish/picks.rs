//! How far apart the passes are. In: a path of centres, places on it with the normal of the surface. Out: the middle
//! one of the distances to the next pass.

use super::bench::{Bench, Look};
use super::centres::Centres;
use crate::path::Vec3;

/// Places that are looked at.
const PLACES: usize = 400;
/// A neighbour lies across the path: more than 60° from its direction.
pub(super) const ACROSS: f64 = 0.5;

/// Spacing of the passes of semi-finish and finish about these tips with their normals, mm.
pub(super) fn picks(bench: &Bench, base: &Look, tips: &[(Vec3, Vec3)]) -> [Option<f64>; 2] {
    let semi_mm = bench.semi_tool.radius_mm();
    let semi = bench.semi_centres(base);
    let finish = bench.finish_centres(&base.toolpath);
    let step = tips.len().div_ceil(PLACES).max(1);
    let places = || tips.iter().step_by(step);
    let of = |centres: &Centres, reach_mm: f64| {
        let up = Vec3::new(0.0, 0.0, semi_mm);
        let mut found: Vec<f64> =
            places().filter_map(|(tip, normal)| centres.spacing(tip + up, *normal, reach_mm, ACROSS)).collect();
        found.sort_by(f64::total_cmp);
        found.get(found.len() / 2).copied()
    };
    [of(&semi, semi_mm), of(&finish, bench.finish_tool.radius_mm())]
}
