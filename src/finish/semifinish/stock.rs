//! Stock between the surfaces of semi-finish and finish. In: the knots with their normals, the path of the finishing
//! ball. Out: the stock at each knot, mm.
//!
//! The semi-finishing ball of radius R and centre c touches its surface at x = c − R n. With D the least distance of x
//! from the path of the finishing ball's centre and R' its radius, the stock along the normal is R' − D. Between two
//! finishing passes it is measured to the scallop that they leave.

use super::centres::{Centres, Near};
use crate::path::Vec3;
use rayon::prelude::*;

/// Stock at these tips with these normals, mm; negative if the semi-finish cuts below the surface of the finish; `None`
/// if no finishing pass is near.
pub(super) fn left(
    tips: &[(Vec3, Vec3)],
    semi_radius_mm: f64,
    finish: &Centres,
    finish_radius_mm: f64,
) -> Vec<Option<f64>> {
    let of = |near: &mut Vec<Near>, (tip, normal): &(Vec3, Vec3)| {
        let touched = tip + Vec3::new(0.0, 0.0, semi_radius_mm) - normal * semi_radius_mm;
        finish.near(touched + normal * finish_radius_mm, finish_radius_mm, near);
        let nearest = finish.nearest(near, touched, &mut 0)?;
        Some(finish_radius_mm - nearest.distance_mm)
    };
    tips.par_iter().map_init(Vec::new, of).collect()
}
