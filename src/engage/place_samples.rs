//! Where a move is sampled. In: the plan, a move. Out: its samples, or where else its stations come from.
//!
//! A feed move near the stock is sampled at its beginning, at its end, and between in equal steps of at most `spacing`. Where the path
//! continues smoothly from a sampled move, the beginning takes over the outcome at the end of that move. Between these samples lie optional
//! ones, so close that the nominations of two neighbours hold for any position between them.

use super::block_ends::Marker;
use super::map::{StationFlags, runs_on};
use super::nominate::{Need, Sample};
use super::plan::Plan;
use super::sample_outcome::turn_rad;
use super::scene::Scene;
use crate::ids::MoveId;
use crate::nc::MoveKind;
use crate::path::Vec3;

/// Cosine of the largest bend at which a path counts as smooth.
const SMOOTH: f64 = 0.996;
/// Spacing along a chain of short blocks, as a part of the radius of the cutter.
const JOINTS: f64 = 1.0 / 3.0;
/// Distance after the beginning of a move at which it is sampled, mm: exactly at the start, the end of the move before covers the whole
/// circle.
const JUST_AFTER_MM: f64 = 2e-3;

/// How a move of the batch gets its stations.
pub(super) enum StationSource {
    /// None: a rapid, or no engagement is asked for.
    None,
    /// Those of a move of the known map.
    Known(MoveId),
    /// One without engagement.
    Idle(StationFlags),
    /// From its samples (range in the batch); the first one is the end of the move before where `inherits`.
    Sampled { samples: std::ops::Range<usize>, inherits: bool },
}

/// State of the sampling between moves.
pub(super) struct Sampling {
    /// Last horizontal direction of the path.
    pub heading: [f64; 2],
    /// The move before was sampled: its last sample stands where this one begins.
    pub goes_on: bool,
    pub marker: Marker,
}

/// Marks the ends of short blocks that run on as joints.
pub(super) fn mark_joints(
    plan: &Plan,
    scene: &Scene,
    begin: usize,
    ways: &[StationSource],
    samples: &mut [Sample],
    marker: &mut Marker,
) {
    marker.stop();
    for (k, way) in ways.iter().enumerate() {
        let length = |k: usize| plan.path.moves[begin + k].curve().length();
        let StationSource::Sampled { samples: range, inherits } = way else {
            marker.stop();
            continue;
        };
        let next =
            matches!(ways.get(k + 1), Some(StationSource::Sampled { inherits: true, .. })).then(|| length(k + 1));
        let radius = scene.cutters[samples[range.start].cutter as usize].form.radius;
        marker.take(&mut samples[range.clone()], *inherits, length(k), next, plan.spacing_mm.min(JOINTS * radius));
    }
}

pub(super) fn sample_move(
    plan: &Plan,
    scene: &Scene,
    index: usize,
    state: &mut Sampling,
    samples: &mut Vec<Sample>,
) -> StationSource {
    let motion = &plan.path.moves[index];
    let length = motion.curve().length();
    let at_end = motion.curve().tangent(length);
    let before = state.heading;
    turn(&mut state.heading, at_end);
    let goes_on = std::mem::take(&mut state.goes_on);
    if motion.kind == MoveKind::Rapid || plan.stock_alone {
        return StationSource::None;
    }
    if let Some(of) = plan.known(index) {
        return StationSource::Known(of);
    }
    let Some(cutter) = plan.laid.cutter[index] else {
        return StationSource::Idle(StationFlags { uncertain: true, ..StationFlags::default() });
    };
    if length <= 0.0 || plan.is_far(motion, &scene.cutters[cutter as usize]) {
        return StationSource::Idle(StationFlags { clear_air: length > 0.0, ..StationFlags::default() });
    }
    let inherits = goes_on && continues(plan, index);
    state.goes_on = true;
    let first = samples.len();
    let count = (length / plan.spacing_mm - 1e-9).ceil().max(1.0) as usize;
    let parts = (length / count as f64 / plan.optional_mm - 1e-9).ceil().max(1.0) as usize;
    let mut dir = before;
    for k in usize::from(inherits)..=count * parts {
        let need = if k % parts == 0 { Need::Always } else { Need::Change };
        let s_mm = if k == count * parts { length } else { length * k as f64 / (count * parts) as f64 };
        let sample = sample_at(plan, index, s_mm, dir, cutter);
        dir = sample.dir;
        samples.push(Sample { need, ..sample });
    }
    StationSource::Sampled { samples: first..samples.len(), inherits }
}

/// The cutter at a place of a move; `dir` is kept under a vertical feed.
pub(super) fn sample_at(plan: &Plan, index: usize, s_mm: f64, dir: [f64; 2], cutter: u16) -> Sample {
    let motion = &plan.path.moves[index];
    let curve = motion.curve();
    let at = if s_mm > 0.0 { s_mm } else { JUST_AFTER_MM.min(0.5 * curve.length()) };
    let elements = plan.elements_of(index);
    let of_move = &plan.laid.elements[elements.start as usize..elements.end as usize];
    let element = of_move.partition_point(|element| element.from_mm <= s_mm - JUST_AFTER_MM).max(1) as u32 - 1;
    let tangent = curve.tangent(at);
    let mut dir = dir;
    turn(&mut dir, tangent);
    Sample {
        element: elements.start + element,
        along_mm: at - of_move[element as usize].from_mm,
        s_mm,
        tip: curve.point(at) + plan.laid.shift(motion),
        dir,
        tangent: [tangent.x.hypot(tangent.y), tangent.z],
        cutter,
        clearance_mm: plan.clearance(),
        need: Need::Always,
    }
}

/// Sets `heading` to the horizontal direction of a tangent; a vertical tangent leaves it.
fn turn(heading: &mut [f64; 2], tangent: Vec3) {
    let across = tangent.x.hypot(tangent.y);
    if across > 1e-6 {
        *heading = [tangent.x / across, tangent.y / across];
    }
}

/// True when the move continues the one before without a bend, with the same tool.
fn continues(plan: &Plan, index: usize) -> bool {
    index > 0 && runs_on(&plan.path.moves[index - 1], &plan.path.moves[index], SMOOTH)
}

/// Angle by which the path turns in the plane at the beginning of a move, rad.
pub(super) fn bend(plan: &Plan, index: usize) -> f64 {
    let curve = plan.path.moves[index - 1].curve();
    let [before, after] = [curve.tangent(curve.length()), plan.path.moves[index].curve().tangent(0.0)];
    let level = |v: &Vec3| v.x.hypot(v.y) > 1e-6;
    if level(&before) && level(&after) { turn_rad([before.x, before.y], [after.x, after.y]) } else { 0.0 }
}
