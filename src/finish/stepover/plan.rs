//! The plan of passes as data: stretches of spots, each with its step-over, feed, force and scallop, and what bounds it; and when a scallop is
//! beyond its limit. Laid by [`super::passes`] and [`super::contour`], drawn by [`super::path`].

use crate::path::Vec3;

/// What bounds the step-over at a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepLimit {
    /// The reference force.
    Force,
    /// The scallop limit.
    Scallop,
    /// The largest step-over.
    Largest,
    /// Even the least step-over exceeds the force.
    Least,
    /// The slope of the pass, or the constant step-over.
    Neighbours,
    /// An edge of the surface.
    Edge,
}

/// Ratio of a scallop to its limit from which the limit counts as broken, as for every limit in the check of a written program.
const SCALLOP_SLACK: f64 = 1.01;

/// Height from which a scallop is beyond its limit, mm.
pub fn beyond_mm(limit_mm: f64) -> f64 {
    SCALLOP_SLACK * limit_mm
}

/// Is a scallop beyond its limit?
pub fn is_beyond(scallop_mm: f64, limit_mm: f64) -> bool {
    scallop_mm > beyond_mm(limit_mm)
}

/// One place of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Place in the plane, mm.
    pub at: [f64; 2],
    /// Step-over from the pass before, mm: seen from above; for passes of one height along the surface; 0 at an edge.
    pub step_mm: f64,
    /// Feed with the reference force, at most the largest feed of the requirements, mm/s.
    pub feed_mm_s: f64,
    /// Predicted force at that feed, N.
    pub force_n: f64,
    /// Scallop towards the pass before, mm.
    pub scallop_mm: f64,
    /// Tip on the pass before, beside this one, mm; `None`: there is none.
    pub beside: Option<Vec3>,
    /// What bounds it.
    pub limit: StepLimit,
    /// Tip, mm.
    pub tip: Vec3,
}

/// One pass.
#[derive(Debug, Clone, PartialEq)]
pub struct Pass {
    /// Stretches on the surface, each a list of spots along +X; for a pass of one height in order of cutting.
    pub stretches: Vec<Vec<Spot>>,
    /// Is it cut from the last spot to the first?
    pub back: bool,
    /// Height of the tip of a pass of one height, mm.
    pub level_mm: Option<f64>,
}

/// All passes.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    /// In the order of cutting: towards +Y, or downwards.
    pub passes: Vec<Pass>,
    /// For each feed of the requirements the largest step-over allowed at all places (except those out of reach), mm: seen from
    /// above, and along the surface; for passes of one height twice the largest step down.
    pub everywhere_mm: Vec<[f64; 2]>,
    /// Share of the places where even the least step-over exceeds the force.
    pub out_of_reach: f64,
}

impl Plan {
    /// Largest scallop, mm.
    pub fn largest_scallop_mm(&self) -> f64 {
        let spots = self.passes.iter().flat_map(|pass| pass.stretches.iter().flatten());
        spots.map(|spot| spot.scallop_mm).fold(0.0, f64::max)
    }

    /// Length of the passes, mm.
    pub fn length_mm(&self) -> f64 {
        let stretches = self.passes.iter().flat_map(|pass| &pass.stretches);
        stretches.flat_map(|stretch| stretch.windows(2)).map(|two| (two[1].tip - two[0].tip).norm()).sum()
    }
}
