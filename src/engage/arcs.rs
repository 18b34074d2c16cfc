//! The exact engaged arcs at one cutter position. In: a sample, the directions and candidates that the grid nominated, the elements, the
//! blanks. Out: arcs per slice and the removal area.
//!
//! A point q of a ring is engaged if three conditions hold: the ring leads there (outward normal · feed direction > 0), q lies inside the
//! blank, and q lies in the swept region of no candidate ([`super::cover`]). A ring stands for its part of the outline at the middle of that
//! part; [`super::rings`] splits rings where engagement begins or ends between two of them.
//!
//! Removal area (volume per mm of path): Σ edge ∫ n·t r dφ = Σ edge r [n_r t_h (sin β₁ − sin β₀) + n_z t_z (β₁ − β₀)] over
//! the arcs, β counted from the feed direction.

use super::cover::Cover;
use super::cutter::Cutter;
use super::nominate::{Mark, Sample};
use super::rings::Work;
use super::scene::{Cut, RawArc, Scene};
use crate::stock::Track;

/// Appends the arcs at a sample, sorted by slice, and returns their totals; `room` is working space.
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

/// Fills `covers` with the swept regions that may have cleared material here, in the frame of the cutter: those of the candidates, and on
/// an arc that of the current move up to here. Its last stretch is left out, because it clears only what is behind the cutter.
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

/// Volume removed per mm of path by arcs, mm². Each arc counts over its part of a ring, at the middle of that part.
pub fn area_of(cutter: &Cutter, [horizontal, vertical]: [f64; 2], arcs: &[RawArc]) -> f64 {
    let of = |arc: &RawArc| {
        let ring = cutter.part(arc.slice, arc.part.map(f64::from));
        let [entry, exit] = arc.angles.map(f64::from);
        let ahead = entry.cos() - exit.cos();
        ring.edge_mm * ring.radius_mm * (ring.normal_r * horizontal * ahead + ring.normal_z * vertical * (exit - entry))
    };
    arcs.iter().map(of).sum()
}
