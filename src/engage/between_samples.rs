//! The path between two sampled points. In: the outcomes at both, the optional samples between them. Out: stretches with and without
//! engagement, each with the volume removed on it, with all arcs engaged at any examined place of it ([`super::union`]), and with those at the
//! first and the last of these.
//!
//! Where the engagement at both ends is alike and nothing else may stand between, nothing is examined. Elsewhere the removal area is integrated by bisection over the optional
//! samples. Two neighbouring optional samples are closer than the reach of a nomination, so between them any position has the candidates of
//! the two, and the bisection goes on over positions. A stretch is halved until its trapezoid agrees with that of its halves to [`AGREE`] of
//! the full area over a millimetre, or it is shorter than [`SHORTEST_MM`]. Where engagement begins or ends it is always halved down to that
//! length, and where the area jumps even further, until the jump no longer matters.

use super::nominate::Sample;
use super::sample_outcome::{Outcome, same};
use super::sample_view::{Gathered, View};
use super::scene::RawArc;

/// Disagreement of two areas that is accepted over a millimetre, as a share of the larger.
const AGREE: f64 = 4e-3;
/// From this change of the area over a stretch on, as a share of the largest area, the middle alone is not enough to accept the trapezoid,
/// because a step in the area may happen to cross the straight line there.
const STEEP: f64 = 0.1;
/// Shortest stretch to which this applies, mm.
const STEEP_MM: f64 = 0.4;
/// Shortest stretch that is examined, mm.
const SHORTEST_MM: f64 = 0.02;
/// Shortest stretch that is examined where the area jumps, mm.
const LEAST_MM: f64 = 1e-3;
/// Change of the area over a millimetre from which on it counts as a jump, as a share of the largest area.
const JUMP: f64 = 2e-3;

/// A stretch of path.
#[derive(Debug, Clone)]
pub struct Stretch {
    /// Where it ends, mm along the move.
    pub to_mm: f64,
    /// Volume removed, mm³.
    pub volume_mm3: f64,
    /// Its engagement: everything engaged anywhere on it; `None` where nothing is cut.
    pub met: Option<Outcome>,
    /// The arcs at its first and its last place.
    pub at_ends: [Vec<RawArc>; 2],
}

/// The stretches between two samples, in order.
pub type Between = Vec<Stretch>;

/// Position on the move of the second sample, `s_mm` along it, otherwise like the first.
pub type Locate<'a> = &'a (dyn Fn(&Sample, f64) -> Sample + Sync);

/// Is the cutter engaged at both ends, and alike?
pub fn alike(outcomes: [&Outcome; 2]) -> bool {
    !outcomes[0].arcs.is_empty() && same(&outcomes[0].arcs, &outcomes[1].arcs)
}

/// The stretches between the required samples `ends`, which may have optional ones between them: those of `via` are worked out in any case.
/// `room` is working space.
pub fn look<'b>(
    view: &View<'b>,
    (ends, via): ([usize; 2], &[usize]),
    outcomes: [&Outcome; 2],
    locate: Locate,
    room: &mut Gathered<'b>,
) -> Option<Between> {
    // Marks belong to the bands of one tool and cannot be used for another.
    if view.samples[ends[0]].cutter != view.samples[ends[1]].cutter {
        return None;
    }
    // A short block that continues the one before is described well enough by its neighbours.
    let begins = view.samples[ends[0]].s_mm == 0.0 && view.move_of(ends[0]) == view.move_of(ends[1]);
    if via.is_empty() && ((ends[1] == ends[0] + 1 && !begins) || alike(outcomes)) {
        return None;
    }
    let quiet = |outcome: &Outcome| outcome.arcs.is_empty();
    if outcomes.iter().all(|outcome| quiet(outcome)) && !(ends[0] + 1..ends[1]).any(|k| view.nominated(k)) {
        return None;
    }
    let of_move = view.move_of(ends[1]);
    let start = if view.move_of(ends[0]) == of_move { view.samples[ends[0]].s_mm } else { 0.0 };
    let met = outcomes.map(Clone::clone).to_vec();
    let peak_mm2 = outcomes[0].cut.area_mm2.max(outcomes[1].cut.area_mm2);
    let mut work = Work { view, locate, room, first: ends[0], start, found: Vec::new(), met, peak_mm2 };
    let [a, b] = [0, 1].map(|k| {
        let area_mm2 = outcomes[k].cut.area_mm2;
        Node { index: ends[k], s_mm: work.place(ends[k]), area_mm2, met: k }
    });
    let mut from = a;
    for &index in via {
        let outcome = view.outcome(index, work.room);
        let node = work.node(index, work.place(index), outcome);
        work.samples(from, node);
        from = node;
    }
    work.samples(from, b);
    let Work { found, met, .. } = work;
    let stretches: Between = found
        .into_iter()
        .map(|OpenStretch { to_mm, volume_mm3, places }| Stretch {
            to_mm,
            volume_mm3,
            met: Outcome::of_places(places.iter().map(|place| &met[*place])),
            at_ends: [places.first(), places.last()]
                .map(|place| place.map_or_else(Vec::new, |place| met[*place].arcs.clone())),
        })
        .collect();
    stretches.iter().any(|stretch| stretch.met.is_some()).then_some(stretches)
}

/// A point at which the removal area is known: `index` is the sample at it or before it, `met` the index of its outcome.
#[derive(Debug, Clone, Copy)]
struct Node {
    index: usize,
    s_mm: f64,
    area_mm2: f64,
    met: usize,
}

/// A stretch that is not finished yet, with the outcomes at its nodes; it has none where nothing is cut.
struct OpenStretch {
    to_mm: f64,
    volume_mm3: f64,
    places: Vec<usize>,
}

struct Work<'a, 'b> {
    view: &'a View<'b>,
    locate: Locate<'a>,
    room: &'a mut Gathered<'b>,
    first: usize,
    start: f64,
    found: Vec<OpenStretch>,
    met: Vec<Outcome>,
    peak_mm2: f64,
}

impl Work<'_, '_> {
    fn place(&self, index: usize) -> f64 {
        if index == self.first { self.start } else { self.view.samples[index].s_mm }
    }
    fn node(&mut self, index: usize, s_mm: f64, outcome: Outcome) -> Node {
        let area_mm2 = outcome.cut.area_mm2;
        self.peak_mm2 = self.peak_mm2.max(area_mm2);
        self.met.push(outcome);
        Node { index, s_mm, area_mm2, met: self.met.len() - 1 }
    }
    /// Examines the path between two samples by means of the optional samples between them; true if the area changed evenly.
    fn samples(&mut self, a: Node, b: Node) -> bool {
        if b.index <= a.index + 1 {
            return self.positions(a, b);
        }
        let marked = || (a.index + 1..b.index).filter(|k| self.view.nominated(*k));
        if a.area_mm2 == 0.0 && b.area_mm2 == 0.0 && marked().next().is_none() {
            self.leaf(a, b, None);
            return true;
        }
        let index = usize::midpoint(a.index, b.index);
        let index = if self.view.nominated(index) { index } else { marked().next().unwrap_or(index) };
        let outcome = self.view.outcome(index, self.room);
        let middle = self.node(index, self.place(index), outcome);
        self.halves([a, middle, b], Self::samples)
    }
    /// Examines the path between two neighbouring samples by means of positions between them; true if the area changed evenly.
    fn positions(&mut self, a: Node, b: Node) -> bool {
        let length = b.s_mm - a.s_mm;
        let jump = (b.area_mm2 - a.area_mm2).abs() * length > JUMP * self.peak_mm2 && length > LEAST_MM;
        if (a.area_mm2 == 0.0 && b.area_mm2 == 0.0) || (length < SHORTEST_MM && !jump) {
            self.leaf(a, b, None);
            return true;
        }
        let s_mm = 0.5 * (a.s_mm + b.s_mm);
        let sample = (self.locate)(&self.view.samples[a.index.max(self.first + 1)], s_mm);
        let outcome = self.view.outcome_between(a.index, &sample, self.room);
        let middle = self.node(a.index, s_mm, outcome);
        self.halves([a, middle, b], Self::positions)
    }
    /// Takes a stretch whose middle is known as one if the middle agrees with the ends and, where the ends differ much, the first half does
    /// too; else examines both halves by `look`.
    fn halves(&mut self, [a, middle, b]: [Node; 3], look: fn(&mut Self, Node, Node) -> bool) -> bool {
        let agree = self.agree(a, middle, b);
        if agree && !self.steep(a, b) {
            self.leaf(a, b, Some(middle));
            return true;
        }
        let even = look(self, a, middle) && agree;
        if even {
            self.leaf(middle, b, None);
        } else {
            look(self, middle, b);
        }
        even
    }
    fn steep(&self, a: Node, b: Node) -> bool {
        (a.area_mm2 - b.area_mm2).abs() > STEEP * self.peak_mm2 && b.s_mm - a.s_mm > STEEP_MM
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
        let nodes = [Some(a), middle, Some(b)].into_iter().flatten().filter(|node| engaged && node.area_mm2 > 0.0);
        if self.found.last().is_none_or(|last| last.places.is_empty() == engaged) {
            self.found.push(OpenStretch { to_mm: a.s_mm, volume_mm3: 0.0, places: Vec::new() });
        }
        let Some(open) = self.found.last_mut() else { return };
        open.to_mm = b.s_mm;
        open.volume_mm3 += volume_mm3;
        for node in nodes {
            // Neighbouring leaves share a node.
            if open.places.last() != Some(&node.met) {
                open.places.push(node.met);
            }
        }
    }
}
