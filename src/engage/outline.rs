//! Integration of the width of cut over a curved outline. In: rings with their engagement at the middle, and the width there. Out: the error
//! of the midpoint rule, the integral about a pointed tip, the place where the width becomes 0.
//!
//! The width is the volume removed per mm of path and per mm of edge. Over consecutive rings it is approximated by a parabola. About a pointed
//! tip it grows with the square of the distance as long as all of the leading half is engaged; there it is summed in parts.

use super::cutter::Cutter;
use super::gaps::Interval;
use crate::machine::Slice;

/// Engaged angles of a ring.
pub type Angles = Vec<Interval>;

/// Steps of the search for the height at which the engagement of a curved outline ends.
const LOOKS: usize = 3;

/// Parts of the ring about a pointed tip over which its width is summed.
const TIP_PARTS: u32 = 16;
/// A ring counts as fully engaged if its width is at least this share of that of its whole leading part.
const ALL: f64 = 0.999;

/// A part of a ring with one height.
#[derive(Debug, Clone, Copy)]
pub struct SubRing {
    /// Slice, and the part of its edge, from below in [0, 1].
    pub slice: u16,
    pub part: [f64; 2],
    /// Absolute height of its middle, and of its upper end.
    pub z: f64,
    pub top: f64,
    /// Radius, mm.
    pub radius: f64,
    /// Outward normal, across and along the axis.
    pub normal: [f64; 2],
}

/// A part of a curved outline that is engaged, and on which sides (below, above) its width falls to 0 at its border.
pub struct EngagedPart {
    /// The part.
    pub ring: SubRing,
    /// What is engaged of it.
    pub angles: Angles,
    /// Does the width fall to 0 at its lower, its upper border?
    pub ends: [bool; 2],
}

/// ∫ of the width over the first ring, where it lies about a pointed tip and others follow. From the tip outward the leading part (`leads`,
/// per mm of edge) is fully engaged, up to where its width exceeds the line through the widths of the next rings over the radius.
pub fn about_tip(
    cutter: &Cutter,
    found: &[EngagedPart],
    widths: &[[f64; 2]],
    leads: impl Fn(&Slice) -> f64,
) -> Option<f64> {
    let [tip, next, ..] = found else { return None };
    let is_tip = tip.ring.slice == 0 && tip.ring.part[0] == 0.0 && cutter.pointed();
    if !is_tip || !follows(&tip.ring, &next.ring) {
        return None;
    }
    // What is cut per normal: on a level path its breadth.
    let breadth = |k: usize| [found[k].ring.radius, widths[k][0] / found[k].ring.normal[0]];
    let part = |at: f64| cutter.part(tip.ring.slice, [at, at]);
    // A middle that is fully engaged does not show where full engagement ends.
    let whole = widths[0][0] > ALL * leads(&cutter.part(tip.ring.slice, tip.ring.part));
    let third = whole && found.get(2).is_some_and(|third| follows(&next.ring, &third.ring));
    let [[r0, b0], [r1, b1]] = if third { [breadth(1), breadth(2)] } else { [breadth(0), breadth(1)] };
    let slope = (b1 - b0) / (r1 - r0);
    let step = tip.ring.part[1] / f64::from(TIP_PARTS);
    let parts = (0..TIP_PARTS).map(|k| {
        let slice = part((f64::from(k) + 0.5) * step);
        leads(&slice).min(slice.normal_r * (b0 + slope * (slice.radius_mm - r0)).max(0.0))
    });
    Some(parts.sum::<f64>() * widths[0][1] / f64::from(TIP_PARTS))
}

/// Error of the midpoint rule over a part of the outline, edge³ f″/24, from the widths (with their edges) of the parts
/// beside it, or none where the width runs out; 0 where there is nothing smooth beside it.
pub fn correction(found: &[EngagedPart], widths: &[[f64; 2]], k: usize) -> f64 {
    let [width, edge] = widths[k];
    let beside = |other: Option<usize>, side: usize| {
        if found[k].ends[side] {
            return Some([0.0, 0.5 * edge]);
        }
        let other = other.filter(|j| *j < found.len())?;
        let joined = if side == 0 {
            follows(&found[other].ring, &found[k].ring)
        } else {
            follows(&found[k].ring, &found[other].ring)
        };
        joined.then(|| [widths[other][0], 0.5 * (widths[other][1] + edge)])
    };
    let (Some([w0, h0]), Some([w2, h2])) = (beside(k.checked_sub(1), 0), beside(Some(k + 1), 1)) else { return 0.0 };
    let bend = 2.0 * ((w2 - width) / h2 - (width - w0) / h0) / (h0 + h2);
    edge * edge * edge * bend / 24.0
}

/// Is `above` the next part of the outline?
pub fn follows(below: &SubRing, above: &SubRing) -> bool {
    (above.slice == below.slice && above.part[0] == below.part[1])
        || (above.slice == below.slice + 1 && above.part[0] == 0.0 && below.part[1] == 1.0)
}

/// The argument at which a width becomes 0 that is positive at `holds` (argument, width) and 0 at `fails`: [`LOOKS`] steps by the secant
/// through the last two values where that falls to 0 between (no nearer than a quarter to either end), else by bisection.
pub fn end(mut holds: [f64; 2], mut fails: f64, mut before: Option<[f64; 2]>, width: impl Fn(f64) -> f64) -> f64 {
    let runs_out = |holds: [f64; 2], fails: f64, before: Option<[f64; 2]>| {
        let [at, w] = before?;
        let end = holds[0] + holds[1] * (holds[0] - at) / (w - holds[1]);
        let share = (end - holds[0]) / (fails - holds[0]);
        (0.0..=1.0).contains(&share).then_some(share)
    };
    for _ in 0..LOOKS {
        let share = runs_out(holds, fails, before).map_or(0.5, |share| share.clamp(0.25, 0.75));
        let at = holds[0] + share * (fails - holds[0]);
        let w = width(at);
        if w > 0.0 {
            (before, holds) = (Some(holds), [at, w]);
        } else {
            fails = at;
        }
    }
    holds[0] + runs_out(holds, fails, before).unwrap_or(0.5) * (fails - holds[0])
}
