//! What happens between two sampled points. In: the outcomes at both, the optional samples between them. Out: the volume
//! removed, in stretches with and without engagement, and the most engaged point met.
//!
//! Where both ends are engaged alike, nothing is looked at. Elsewhere the removal area is integrated by bisection over the
//! optional samples, and between two of those (closer than the cells that nominate see) over positions whose candidates are
//! those of both. A stretch is halved until its trapezoid agrees with that of its halves to [`AGREE`] of the full area over
//! a millimetre, or it is shorter than [`SHORTEST_MM`]; where engagement begins or ends it is always halved to that.

use super::batch::{Gathered, Outcome, View};
use super::nominate::Sample;
use super::stations::same;

/// Disagreement of areas, as a part of the larger, over a millimetre.
const AGREE: f64 = 4e-3;
/// Shortest stretch looked at, mm.
const SHORTEST_MM: f64 = 0.02;

/// A stretch of path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// Where it ends, mm along the move.
    pub to_mm: f64,
    /// Volume removed, mm³.
    pub volume_mm3: f64,
    /// Is anything cut?
    pub engaged: bool,
}

/// What was found between two samples.
#[derive(Debug, Clone, Default)]
pub struct Between {
    /// Its stretches in order.
    pub stretches: Vec<Stretch>,
    /// The most engaged point, if it lies between the ends.
    pub peak: Option<Outcome>,
}

/// Position on the move of the second sample, `s_mm` along it, otherwise like the first.
pub type Locate<'a> = &'a (dyn Fn(&Sample, f64) -> Sample + Sync);

/// Is the cutter engaged at both ends, and alike?
pub fn alike(outcomes: [&Outcome; 2]) -> bool {
    !outcomes[0].arcs.is_empty() && same(&outcomes[0].arcs, &outcomes[1].arcs)
}

/// Looks between the required samples `ends` (with optional ones between them); `room` is working space.
pub fn look<'b>(
    view: &View<'b>,
    ends: [usize; 2],
    outcomes: [&Outcome; 2],
    locate: Locate,
    room: &mut Gathered<'b>,
) -> Option<Between> {
    if ends[1] == ends[0] + 1 || alike(outcomes) {
        return None;
    }
    let quiet = |outcome: &Outcome| outcome.arcs.is_empty();
    if outcomes.iter().all(|outcome| quiet(outcome)) && !(ends[0] + 1..ends[1]).any(|k| view.nominated(k)) {
        return None;
    }
    let of_move = view.move_of(ends[1]);
    let start = if view.move_of(ends[0]) == of_move { view.samples[ends[0]].s_mm } else { 0.0 };
    let mut work = Work { view, locate, room, first: ends[0], start, found: Between::default(), peak_mm2: 0.0 };
    work.peak_mm2 = outcomes[0].cut.area_mm2.max(outcomes[1].cut.area_mm2);
    let [a, b] = [0, 1].map(|k| Node { index: ends[k], s_mm: work.place(ends[k]), area_mm2: outcomes[k].cut.area_mm2 });
    work.samples(a, b);
    let found = work.found;
    (found.stretches.iter().any(|stretch| stretch.engaged)).then_some(found)
}

/// A point at which the removal area is known; `index` is the sample at it or before it.
#[derive(Debug, Clone, Copy)]
struct Node {
    index: usize,
    s_mm: f64,
    area_mm2: f64,
}

struct Work<'a, 'b> {
    view: &'a View<'b>,
    locate: Locate<'a>,
    room: &'a mut Gathered<'b>,
    first: usize,
    start: f64,
    found: Between,
    peak_mm2: f64,
}

impl Work<'_, '_> {
    fn place(&self, index: usize) -> f64 {
        if index == self.first { self.start } else { self.view.samples[index].s_mm }
    }
    fn note(&mut self, outcome: Outcome) -> f64 {
        let area = outcome.cut.area_mm2;
        if area > self.peak_mm2 {
            self.peak_mm2 = area;
            self.found.peak = Some(outcome);
        }
        area
    }
    /// Between two samples, over those between them.
    fn samples(&mut self, a: Node, b: Node) {
        if b.index <= a.index + 1 {
            self.positions(a, b);
            return;
        }
        let marked = || (a.index + 1..b.index).filter(|k| self.view.nominated(*k));
        if a.area_mm2 == 0.0 && b.area_mm2 == 0.0 && marked().next().is_none() {
            self.leaf(a, b, None);
            return;
        }
        let index = usize::midpoint(a.index, b.index);
        let index = if self.view.nominated(index) { index } else { marked().next().unwrap_or(index) };
        let outcome = self.view.outcome(index, self.room);
        let area_mm2 = self.note(outcome);
        let middle = Node { index, s_mm: self.place(index), area_mm2 };
        if self.agree(a, middle, b) {
            self.leaf(a, b, Some(middle));
        } else {
            self.samples(a, middle);
            self.samples(middle, b);
        }
    }
    /// Between two neighbouring samples, over positions.
    fn positions(&mut self, a: Node, b: Node) {
        let length = b.s_mm - a.s_mm;
        if (a.area_mm2 == 0.0 && b.area_mm2 == 0.0) || length < SHORTEST_MM {
            self.leaf(a, b, None);
            return;
        }
        let s_mm = 0.5 * (a.s_mm + b.s_mm);
        let sample = (self.locate)(&self.view.samples[a.index.max(self.first + 1)], s_mm);
        let outcome = self.view.outcome_between(a.index, &sample, self.room);
        let area_mm2 = self.note(outcome);
        let middle = Node { index: a.index, s_mm, area_mm2 };
        if self.agree(a, middle, b) {
            self.leaf(a, b, Some(middle));
        } else {
            self.positions(a, middle);
            self.positions(middle, b);
        }
    }
    fn agree(&self, a: Node, middle: Node, b: Node) -> bool {
        let changes = (a.area_mm2 > 0.0) != (b.area_mm2 > 0.0) || (a.area_mm2 > 0.0) != (middle.area_mm2 > 0.0);
        let share = (middle.s_mm - a.s_mm) / (b.s_mm - a.s_mm).max(1e-12);
        let straight = a.area_mm2 + share * (b.area_mm2 - a.area_mm2);
        let length = (b.s_mm - a.s_mm).min(1.0);
        !changes && (middle.area_mm2 - straight).abs() * length <= AGREE * self.peak_mm2
    }
    fn leaf(&mut self, a: Node, b: Node, middle: Option<Node>) {
        let trapezoid = |a: Node, b: Node| 0.5 * (a.area_mm2 + b.area_mm2) * (b.s_mm - a.s_mm);
        let volume_mm3 = middle.map_or_else(|| trapezoid(a, b), |m| trapezoid(a, m) + trapezoid(m, b));
        let engaged = volume_mm3 > 0.0;
        match self.found.stretches.last_mut() {
            Some(last) if last.engaged == engaged => {
                last.to_mm = b.s_mm;
                last.volume_mm3 += volume_mm3;
            }
            _ => self.found.stretches.push(Stretch { to_mm: b.s_mm, volume_mm3, engaged }),
        }
    }
}
