//! Spacing of the passes. In: the paths of both balls, places on the surface with their normals. Out: median distance
//! to the next pass.

use super::centres::Centres;
use super::programs::{Programs, Simulated};
use crate::path::Vec3;

/// Number of places.
const PLACES: usize = 400;
/// Largest cosine of the angle between the path and the vector to a neighbouring pass: 60°.
pub(super) const ACROSS: f64 = 0.5;

/// Spacing of the passes of semi-finish and finish at these tips with their normals, mm.
pub(super) fn pass_spacing(programs: &Programs, base: &Simulated, tips: &[(Vec3, Vec3)]) -> [Option<f64>; 2] {
    let semi_mm = programs.semi_tool.radius_mm();
    let semi = programs.semi_centres(base);
    let finish = programs.finish_centres(&base.toolpath);
    let step = tips.len().div_ceil(PLACES).max(1);
    let places = || tips.iter().step_by(step);
    let of = |centres: &Centres, reach_mm: f64| {
        let up = Vec3::new(0.0, 0.0, semi_mm);
        let mut found: Vec<f64> =
            places().filter_map(|(tip, normal)| centres.spacing(tip + up, *normal, reach_mm, ACROSS)).collect();
        found.sort_by(f64::total_cmp);
        found.get(found.len() / 2).copied()
    };
    [of(&semi, semi_mm), of(&finish, programs.finish_tool.radius_mm())]
}
