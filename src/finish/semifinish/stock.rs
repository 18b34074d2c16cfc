//! Stock left between the surface of the semi-finish and that of the finish. In: the knots with their normals, the path
//! of the finishing ball. Out: the stock at each knot, mm.
//!
//! The semi-finish touches its surface at x = c − R n. Of the balls of the finish the one that reaches deepest over x
//! has its centre at the least distance D: the stock is R' − D along the normal there. Between two finishing passes
//! that counts the cusp which they leave.

use super::centres::Centres;
use crate::path::Vec3;
use rayon::prelude::*;

/// Stock under these tips with these normals, mm; negative: the semi-finish cuts below the surface of the finish;
/// `None` where no finishing pass is near.
pub(super) fn left(
    tips: &[(Vec3, Vec3)],
    semi_radius_mm: f64,
    finish: &Centres,
    finish_radius_mm: f64,
) -> Vec<Option<f64>> {
    let of = |near: &mut Vec<u32>, (tip, normal): &(Vec3, Vec3)| {
        let touched = tip + Vec3::new(0.0, 0.0, semi_radius_mm) - normal * semi_radius_mm;
        finish.near(touched + normal * finish_radius_mm, finish_radius_mm, near);
        let nearest = finish.nearest(near, touched)?;
        Some(finish_radius_mm - nearest.distance_mm)
    };
    tips.par_iter().map_init(Vec::new, of).collect()
}
