//! Engaged arcs at one cutter position, exactly. In: a sample, the marks and candidates the grid nominated, the elements,
//! the blanks. Out: arcs per slice and the removal area.
//!
//! A point q of a ring is engaged when the ring leads there (outward normal · feed direction > 0), q lies inside the blank,
//! and no candidate's swept region holds it ([`super::cover`]). Rings are taken at the middle of their part of the outline;
//! [`super::rings`] splits them where engagement begins or ends between two of them.
//!
//! Removal area (volume per mm of path): Σ edge ∫ n·t r dφ = Σ edge r [n_r t_h (sin β₁ − sin β₀) + n_z t_z (β₁ − β₀)] over
//! the arcs, β counted from the feed direction.

use super::cover::Cover;
use super::cutter::{Cutter, MARGIN_CELLS};
use super::gaps::{Interval, span};
use super::nominate::{Mark, Sample};
use super::rings::Work;
use crate::machine::{Box3, Slice};
use crate::stock::{Blank, Element, Form, Track, along};

/// Part of its radius from which a part of a cutter counts as steep.
const STEEP: f64 = 0.98;

/// Everything there is to be asked.
pub struct Scene<'a> {
    /// All elements: the cuts of earlier programs, then those of this one.
    pub elements: &'a [Element],
    /// All cutters.
    pub cutters: &'a [Cutter],
    /// Outlines of the cutters of earlier programs: elements count them on from the cutters.
    pub earlier: &'a [Form],
    /// The blanks.
    pub blanks: &'a [Blank],
    /// Keep-out boxes.
    pub fixtures: &'a [Box3],
}

impl Scene<'_> {
    /// Outline of the cutter of an element.
    pub fn form(&self, element: &Element) -> &Form {
        let cutter = element.cutter as usize;
        self.cutters.get(cutter).map_or_else(|| &self.earlier[cutter - self.cutters.len()], |cutter| &cutter.form)
    }
    /// Adds to candidates, which are sorted, those that lie along the path from one of them; of balls only where a steep part
    /// of the cutter is marked.
    pub fn add_along(&self, candidates: &mut Vec<u32>, sample: &Sample, marks: &[Mark]) {
        let named = candidates.len();
        let cutter = &self.cutters[sample.cutter as usize];
        let cell_mm = cutter.margin / MARGIN_CELLS;
        let steep = marks.iter().any(|mark| cutter.bands[mark.band as usize].radius >= STEEP * cutter.form.radius);
        for k in 0..named {
            let form = self.form(&self.elements[candidates[k] as usize]);
            candidates.extend(along(self.elements, candidates[k], (form, steep), cell_mm, sample.element));
        }
        if candidates.len() > named {
            candidates.sort_unstable();
            candidates.dedup();
        }
    }
    /// True when no fixture is within the clearance of a sample.
    pub fn clear_of_fixtures(&self, sample: &Sample) -> bool {
        let reach = self.cutters[sample.cutter as usize].form.radius + sample.clearance_mm;
        self.fixtures.iter().all(|fixture| {
            let beside =
                |axis: usize| (fixture.min[axis] - sample.tip[axis]).max(sample.tip[axis] - fixture.max[axis]).max(0.0);
            sample.tip.z - sample.clearance_mm >= fixture.max.z || beside(0).hypot(beside(1)) > reach
        })
    }
}

/// An engaged arc of a part of a ring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawArc {
    /// Slice of the tool.
    pub slice: u16,
    /// Part of its edge, from below, in [0, 1].
    pub part: [f32; 2],
    /// Immersion angles, rad.
    pub angles: [f32; 2],
}

/// Removal area and reach of the arcs at a sample.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cut {
    /// Number of arcs.
    pub arcs: u32,
    /// Volume removed per mm of path, mm².
    pub area_mm2: f64,
    /// Height above the tip up to which it is engaged, mm.
    pub top_mm: f64,
    /// How far a wall stands up along a shank as wide as the cutter, mm.
    pub rub_mm: f64,
}

/// Appends the arcs at a sample, sorted by slice; `room` is working space.
pub fn arcs_at<'a>(
    scene: &'a Scene<'a>,
    sample: &Sample,
    (marks, candidates): (&[Mark], &[u32]),
    room: &mut Vec<Cover<'a>>,
    out: &mut Vec<RawArc>,
) -> Cut {
    if marks.is_empty() {
        return Cut::default();
    }
    let cutter = &scene.cutters[sample.cutter as usize];
    fill(room, scene, sample, candidates);
    let work = Work::new(scene, sample, cutter, room);
    let begin = out.len();
    let area_mm2 = work.arcs(marks, out);
    let mut cut = Cut { arcs: (out.len() - begin) as u32, area_mm2, rub_mm: work.rub_mm(marks), ..Cut::default() };
    for arc in &out[begin..] {
        let slice = cutter.part(arc.slice, arc.part.map(f64::from));
        cut.top_mm = cut.top_mm.max(slice.z_mm + 0.5 * slice.dz_mm());
    }
    cut
}

/// What may have cleared material here, seen from the cutter: the candidates, and on arcs what the current move itself has
/// swept so far, but for the last stretch, which only clears what is behind the cutter.
fn fill<'a>(covers: &mut Vec<Cover<'a>>, scene: &'a Scene<'a>, sample: &Sample, candidates: &[u32]) {
    let cutter = &scene.cutters[sample.cutter as usize];
    let origin = [sample.tip.x, sample.tip.y];
    covers.clear();
    for id in candidates {
        let element = &scene.elements[*id as usize];
        covers.push(Cover::new(&element.track.seen_from(origin, sample.dir), scene.form(element), covers.last()));
    }
    let element = &scene.elements[sample.element as usize];
    let length = sample.along_mm - 0.25 * cutter.form.radius;
    if matches!(element.track, Track::Arc { .. }) && length > 0.0 {
        let own = element.track.until(length).seen_from(origin, sample.dir);
        covers.push(Cover::new(&own, &cutter.form, None));
    }
}

/// Volume removed per mm of path along an arc of a ring, mm².
pub fn area(ring: &Slice, [horizontal, vertical]: [f64; 2], arc: &Interval) -> f64 {
    let rising = ring.normal_z * vertical;
    let turn = if rising == 0.0 { 0.0 } else { rising * span(arc) };
    ring.edge_mm * ring.radius_mm * (ring.normal_r * horizontal * (arc[1].at[1] - arc[0].at[1]) + turn)
}

/// Volume removed per mm of path by arcs, each over its part of a ring at the middle of that, mm².
pub fn area_of(cutter: &Cutter, [horizontal, vertical]: [f64; 2], arcs: &[RawArc]) -> f64 {
    let of = |arc: &RawArc| {
        let ring = cutter.part(arc.slice, arc.part.map(f64::from));
        let [entry, exit] = arc.angles.map(f64::from);
        let ahead = entry.cos() - exit.cos();
        ring.edge_mm * ring.radius_mm * (ring.normal_r * horizontal * ahead + ring.normal_z * vertical * (exit - entry))
    };
    arcs.iter().map(of).sum()
}
