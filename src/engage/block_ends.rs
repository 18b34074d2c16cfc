//! Ends of short blocks on a smooth path ("joints"). In: the samples of a batch in order, and the outcomes at those that are worked out. Out:
//! the joints that need not be worked out as long as the samples before and after them agree, and their interpolated outcomes.
//!
//! A chain of short blocks is sampled like one long move: once per spacing. Where two such samples do not agree, or the engagement runs
//! through a peak or a dip between them, every joint between them is worked out.

use super::cutter::Cutter;
use super::nominate::{Need, Sample};
use super::sample_outcome::{Outcome, STRAIGHT_RAD, turn_rad};
use super::scene::RawArc;
use crate::path::Vec3;

/// Cosine of the largest turn between two samples that are worked out.
const TURN: f64 = 0.985;
/// Largest change of an angle between two samples for which it is interpolated linearly, rad.
const BEND_RAD: f32 = 0.1;
/// Change of the removal area, and of the engaged edge, up to which two samples agree, as a part of the larger.
const AGREE: f64 = 0.05;

/// Height of a peak, or depth of a dip, from which on the joints in it are worked out, as a share of the larger removal area.
const PEAK: f64 = 0.02;

/// Goes along the samples and marks the joints. Which joints are worked out depends on their distance from the beginning of the chain, so
/// that splitting a block changes little further on.
#[derive(Default)]
pub struct Marker {
    /// Distance from the beginning of the chain, mm.
    along_mm: f64,
    /// Direction of the path at the last sample that is worked out; `None` where the next one is in any case.
    heading: Option<[f64; 3]>,
}

impl Marker {
    /// Ends the chain: the next sample is worked out, because the path does not continue here, or a batch begins.
    pub fn stop(&mut self) {
        self.heading = None;
    }
    /// Takes the samples of a move; `inherits`: it runs on from the move before; `next_mm`: length of the sampled move that
    /// runs on from it. Two samples that are worked out are about `spacing_mm` apart.
    pub fn take(
        &mut self,
        samples: &mut [Sample],
        inherits: bool,
        length_mm: f64,
        next_mm: Option<f64>,
        spacing_mm: f64,
    ) {
        if !inherits {
            *self = Self { along_mm: 0.0, heading: Some(heading(&samples[0])) };
        }
        let Some(end) = samples.last_mut() else { return };
        self.along_mm += length_mm;
        let step = |mm: f64| (mm / spacing_mm).floor();
        let goes_on = next_mm.is_some_and(|next_mm| step(self.along_mm) == step(self.along_mm + next_mm));
        let along = heading(end);
        let straight = |before: [f64; 3]| (0..3).map(|axis| along[axis] * before[axis]).sum::<f64>() >= TURN;
        if length_mm < spacing_mm && goes_on && self.heading.is_some_and(straight) {
            end.need = Need::Joint;
        } else {
            self.heading = Some(along);
        }
    }
}

fn heading(sample: &Sample) -> [f64; 3] {
    let [horizontal, vertical] = sample.tangent;
    [sample.dir[0] * horizontal, sample.dir[1] * horizontal, vertical]
}

/// The interpolated outcomes at the joints between the samples `ends`, with their numbers; `None` where the ends do not agree.
pub fn joints(
    samples: &[Sample],
    cutter: &Cutter,
    ends: [usize; 2],
    found: [&Outcome; 2],
) -> Option<Vec<(usize, Outcome)>> {
    let [a, b] = found;
    let clear = a.clear && b.clear;
    let mixes = clear || agree(&a.arcs, &b.arcs);
    if a.undercut || b.undercut || !(mixes || alike(cutter, a, b)) {
        return None;
    }
    let mut along = vec![0.0];
    for k in ends[0]..ends[1] {
        along.push(along[k - ends[0]] + (samples[k + 1].tip - samples[k].tip).norm());
    }
    let whole = along[ends[1] - ends[0]].max(1e-12);
    let inner = (ends[0] + 1..ends[1]).filter(|k| samples[*k].need == Need::Joint);
    let lead = if a.cut.area_mm2 > b.cut.area_mm2 { a } else { b };
    let at = |k: usize| {
        let part = along[k - ends[0]] / whole;
        // Along a curve the engagement goes on as seen from the tool; a block that strays from it has a heading of its own.
        let strays = turn_rad(samples[ends[0]].dir, samples[k].dir)
            - part * turn_rad(samples[ends[0]].dir, samples[ends[1]].dir);
        let mut outcome = if mixes { mixed(a, b, part) } else { lead.clone() };
        outcome.cut.area_mm2 = a.cut.area_mm2 + part * (b.cut.area_mm2 - a.cut.area_mm2);
        if strays.abs() > STRAIGHT_RAD { outcome.beyond_bend(strays, cutter, samples[k].tangent) } else { outcome }
    };
    Some(inner.map(|k| (k, at(k))).collect())
}

/// Does the removal area run through a peak or a dip between two samples? Given are places and areas of four samples of one chain: before,
/// both ends, after. It does if the lines through the two samples on either side both pass the middle on the same side.
pub fn turns(before: Option<(Vec3, f64)>, ends: [(Vec3, f64); 2], after: Option<(Vec3, f64)>) -> bool {
    let (Some(before), Some(after)) = (before, after) else { return false };
    let [a, b] = ends;
    let half = 0.5 * (b.0 - a.0).norm();
    let run_on =
        |beyond: (Vec3, f64), end: (Vec3, f64)| end.1 + (end.1 - beyond.1) * half / (end.0 - beyond.0).norm().max(half);
    let middle = 0.5 * (a.1 + b.1);
    let [left, right] = [run_on(before, a), run_on(after, b)].map(|area| area - middle);
    left * right > 0.0 && left.abs().min(right.abs()) > PEAK * a.1.max(b.1)
}

/// The same rings, at angles that differ little?
fn agree(a: &[RawArc], b: &[RawArc]) -> bool {
    !a.is_empty()
        && a.len() == b.len()
        && a.iter().zip(b).all(|(a, b)| {
            a.slice == b.slice
                && (0..2).all(|k| (a.angles[k] - b.angles[k]).abs() < BEND_RAD && (a.part[k] - b.part[k]).abs() < 0.25)
        })
}

/// Much the same, though not the same rings? Compared are the removal areas and the engaged areas of the cutter.
fn alike(cutter: &Cutter, a: &Outcome, b: &Outcome) -> bool {
    let engaged = |outcome: &Outcome| {
        let of = |arc: &RawArc| {
            let ring = &cutter.slices[arc.slice as usize];
            let share = f64::from((arc.angles[1] - arc.angles[0]) * (arc.part[1] - arc.part[0]));
            ring.radius_mm * ring.edge_mm * share
        };
        outcome.arcs.iter().map(of).sum::<f64>()
    };
    let near = |x: f64, y: f64| (x - y).abs() <= AGREE * x.max(y);
    !a.arcs.is_empty() && !b.arcs.is_empty() && near(a.cut.area_mm2, b.cut.area_mm2) && near(engaged(a), engaged(b))
}

/// The outcome at `part` (0 … 1) of the way from one to the other, interpolated linearly.
fn mixed(a: &Outcome, b: &Outcome, part: f64) -> Outcome {
    let at = |a: f64, b: f64| a + part * (b - a);
    let of = |a: [f32; 2], b: [f32; 2]| [0, 1].map(|k| at(f64::from(a[k]), f64::from(b[k])) as f32);
    let arc = |(a, b): (&RawArc, &RawArc)| RawArc {
        slice: a.slice,
        part: of(a.part, b.part),
        angles: of(a.angles, b.angles),
    };
    let mut cut = a.cut;
    cut.area_mm2 = at(a.cut.area_mm2, b.cut.area_mm2);
    cut.top_mm = at(a.cut.top_mm, b.cut.top_mm);
    cut.rub_mm = a.cut.rub_mm.max(b.cut.rub_mm);
    Outcome {
        arcs: a.arcs.iter().zip(&b.arcs).map(arc).collect(),
        cut,
        clear: a.clear && b.clear,
        struck: [0, 1].map(|k| a.struck[k].max(b.struck[k])),
        undercut: false,
    }
}
