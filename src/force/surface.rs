//! The error of the machined wall. In: the moments at which a tooth leaves the wall, forces and compliance. Out: by height, how far the wall is
//! from where it should be, mm.
//!
//! Tooth i leaves the wall at height z at the rotation angle at which its edge there is at φ = 0 (up) or φ = π (climb). The
//! tool is then bent by the forces of all edges in the material, each at its own height: δ(z) = Σ F_y,k G(z, z_k), with G the deflection of the
//! cantilever at z under a unit force at z_k. The surface left by tooth i is δ(z) − R_i from the ideal wall, R_i being how far runout pushes the
//! tooth outward; the tooth that cuts deepest forms the surface (Ko, Yun, Cho 2002). Positive: material is left. Compliance of the holder
//! shifts all heights by the same amount.

use super::beam::Beam;
use super::modifiers::Factors;
use super::scan::{Edge, Scan};

/// One height of the wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallPoint {
    /// Height above the tip, mm.
    pub z_mm: f64,
    /// Material left beyond the ideal wall (negative: cut too deep), mm.
    pub error_mm: f64,
    /// Radius of the cutter at this height, mm.
    pub radius_mm: f64,
    /// Side of the feed on which the wall stands: +1 right (climb), −1 left (up).
    pub side: f64,
}

/// A moment at which an edge leaves the wall, with all edges in the material then.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Moment {
    /// Ring that leaves the wall.
    pub ring: usize,
    /// R_i of its tooth towards the wall, mm.
    pub radius_mm: f64,
    /// +1 where the wall is on the −y side (climb), −1 on the +y side (up).
    pub side: f64,
    pub edges: Vec<Edge>,
}

/// The wall left at feed per tooth `f`, by height.
pub(super) fn wall(scan: &Scan, moments: &[Moment], beam: &Beam, f: f64) -> Vec<WallPoint> {
    let mut points: Vec<WallPoint> = Vec::new();
    for moment in moments {
        let ring = &scan.rings[moment.ring];
        let z_mm = ring.height_mm;
        let bent: f64 = scan
            .forces_of(&moment.edges, f, &Factors::default())
            .iter()
            .map(|(z, force_y)| force_y * beam.at_mm_per_n(z_mm, *z))
            .sum();
        let error_mm = moment.side * bent - moment.radius_mm;
        match points.iter_mut().find(|point| point.z_mm == z_mm && point.side == moment.side) {
            Some(point) => point.error_mm = point.error_mm.min(error_mm),
            None => points.push(WallPoint { z_mm, error_mm, radius_mm: ring.radius_mm, side: moment.side }),
        }
    }
    points.sort_by(|a, b| a.side.total_cmp(&b.side).then(a.z_mm.total_cmp(&b.z_mm)));
    points
}
