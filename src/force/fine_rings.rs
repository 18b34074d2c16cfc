//! Rings thin enough for peak forces. In: the rings for which engagement was worked out, their tool. Out: thinner rings, and the arcs on them.
//!
//! Where forces are sampled over a revolution (`scan.rs`: runout, laws that are not linear), all of the edge on a ring enters the cut at one
//! angle. If the edge lags along the ring by as much as a light cut is wide, the peak force changes in steps of a ring's share. Rings that
//! lag by less than [`FINEST_RAD`] keep these steps small. Dividing is exact for the side of a mill, where the engagement does not change
//! within a ring.

use crate::engage::EngagedArc;
use crate::machine::{Slice, Tool};

/// Most lag of the edge from the bottom to the top of a ring, rad.
const FINEST_RAD: f64 = 0.006;
/// Most rings that one is divided into.
const MOST: f64 = 24.0;

/// Thinner rings, and which ones each of the given rings became.
#[derive(Debug, Clone)]
pub struct FineRings {
    /// The thinner rings.
    pub slices: Vec<Slice>,
    first: Vec<usize>,
}

impl FineRings {
    /// Divides the rings of a cylindrical side.
    pub fn new(slices: &[Slice], tool: &Tool) -> Self {
        let mut fine = Self { slices: Vec::new(), first: Vec::new() };
        for slice in slices {
            fine.first.push(fine.slices.len());
            let lag_rad = slice.dz_mm() * tool.helix_rad.abs().tan() / slice.radius_mm.max(1e-9);
            let parts = if slice.normal_r > 0.999 { (lag_rad / FINEST_RAD).ceil().clamp(1.0, MOST) } else { 1.0 };
            let dz_mm = slice.dz_mm() / parts;
            for part in 0..parts as usize {
                let z_mm = slice.z_mm + (part as f64 + 0.5 - 0.5 * parts) * dz_mm;
                fine.slices.push(Slice { z_mm, edge_mm: slice.edge_mm / parts, ..*slice });
            }
        }
        fine.first.push(fine.slices.len());
        fine
    }

    /// The same arcs on the thinner rings.
    pub fn arcs(&self, arcs: &[EngagedArc]) -> Vec<EngagedArc> {
        let parts = |arc: &EngagedArc| self.first[arc.slice as usize]..self.first[arc.slice as usize + 1];
        arcs.iter().flat_map(|arc| parts(arc).map(|k| EngagedArc { slice: k as u32, ..*arc })).collect()
    }
}
