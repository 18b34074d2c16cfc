//! The largest force within a revolution, bounded from above. In: the edges that may cut at a place, the ellipsoid of coefficients, a
//! feed per tooth. Out: a number that no force exceeds, for every rotation, every direction, every coefficient of the ellipsoid, every
//! feed from none up to that one, and **every part of the engagement**: whatever of it is not cut after all counts as nothing.
//!
//! A force in the plane, seen from the turning tool, is the sum over the edges of (−t + i p) e^{−i o}, where o is what the edge's
//! immersion φ = θ + o exceeds the rotation by, t = (k_tc h + k_te) du against the rotation, p = −n_r (k_rc h + k_re) du +
//! n_z (k_ac h + k_ae) du towards the axis, and h = f (c n_r sin φ + t_z n_z) the chip. Along a direction α of the plane an edge has
//! −t cos(o + α) + p sin(o + α), linear in the coefficients. The largest sum of any of them is the sum of those that are positive; and
//! as every direction is within η of the middle of its sector, |F| ≤ (largest sum along that middle) / cos η.
//!
//! The edge winds through a ring at its helix: of its length that part is engaged whose immersion lies in the arc, and acts at the middle of it
//! (the chip of a part is at most that at its middle, as a sine between 0 and π is concave). Along a thin wall the arc turns with the height as
//! the edge does, so that all of the edge may be engaged at once: the larger part of both counts.
//!
//! Boxes of rotations and directions are halved until each is below the limit, or too small: then its bound stands. Sums are plain
//! doubles; what their rounding can be (some hundred operations, each 2⁻⁵³ of terms whose magnitude is summed up beside) is added.

use std::f64::consts::{FRAC_PI_8, TAU};

use super::cutter::Ring;
use super::ellipsoid::{Ellipsoid, P};
use crate::machine::LimitKind;

/// An edge of one tooth on one ring while it may cut.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    /// Rotations between which a part of it may cut, rad.
    pub over: [f64; 2],
    /// Immersions between which it may cut, rad.
    pub arc: [f64; 2],
    /// Immersion of its middle less the rotation, rad.
    pub off: f64,
    /// Cosine and sine of that.
    pub turn: [f64; 2],
    /// Angle by which its upper end lags behind its middle, rad.
    pub lag: f64,
    /// The least by which it may lag behind its middle against the arc, which turns with the height too, rad.
    pub against: f64,
    /// Its ring.
    pub ring: Ring,
    /// Its share of the feed per tooth.
    pub share: f64,
    /// What a newton on it counts: 1, or mm and MPa at the tool.
    pub weights: [f64; 3],
}

/// All edges at a place.
#[derive(Debug, Clone, Default)]
pub struct Edges {
    /// They.
    pub list: Vec<Edge>,
    /// Rotation after which they repeat, rad.
    pub period: f64,
    /// Largest horizontal part of the unit feed direction.
    pub across: f64,
    /// Least and largest vertical part.
    pub rise: [f64; 2],
}

/// Smallest sector (its bound is 1.3 parts in a thousand too high), and rotation, rad, that are looked at. What is too high by them makes up for edges
/// that act at the middle of their rings: with 0.02 and 0.004, and a proven feed searched four times as finely, 136 of 20,000 draws of
/// `tests/certificate_draws.rs` were above their limits by up to 0.2 %, for 0.1 % less time on a ball-end raster.
const LEAST: [f64; 2] = [0.05, 0.008];
/// Most boxes of a place.
const MOST_BOXES: usize = 40_000;
/// Bound of the rounding in a sum, relative to the sum of magnitudes: 64 operations a term and some thousand terms.
const ROUNDING: f64 = 1e-11;

impl Edges {
    /// A bound of the load in question at feeds up to `f` mm per tooth; it is searched no further once it is below `limit`.
    pub fn most(&self, kind: LimitKind, f: f64, limit: f64, known: &Ellipsoid) -> f64 {
        let half: [f64; P] = std::array::from_fn(|k| known.half_width(k));
        let work = Work { edges: self, kind, f, known, half, slack: self.slack(kind, f, known, &half) };
        let eighth = self.period / 8.0;
        let mut boxes = Vec::new();
        for k in 0..8 {
            let over = [eighth * f64::from(k), if k == 7 { self.period } else { eighth * f64::from(k + 1) }];
            if kind == LimitKind::ForceAxial {
                boxes.extend([1.0, -1.0].map(|sense| Box { over, middle: sense, half: 0.0 }));
            } else {
                let sector = |m: i32| Box { over, middle: FRAC_PI_8 * f64::from(2 * m + 1), half: FRAC_PI_8 };
                boxes.extend((0..8).map(sector));
            }
        }
        let (mut most, mut looked) = (0.0f64, 0);
        while let Some(of) = boxes.pop() {
            let bound = work.bound(&of);
            looked += 1;
            if bound <= limit || of.is_least() || looked > MOST_BOXES {
                most = most.max(bound);
                continue;
            }
            boxes.extend(of.halves());
        }
        most
    }

    /// What rounding may add to a bound.
    fn slack(&self, kind: LimitKind, f: f64, known: &Ellipsoid, half: &[f64; P]) -> f64 {
        let largest: f64 = (0..P - 1).map(|k| known.mean[k] + half[k]).sum();
        let of = |edge: &Edge| edge.ring.edge * edge.weights[weight(kind)] * (1.0 + 2.0 * f * edge.share) * largest;
        ROUNDING * self.list.iter().map(of).sum::<f64>() * known.scattered()
    }
}

/// Which of an edge's weights counts for a load.
fn weight(kind: LimitKind) -> usize {
    match kind {
        LimitKind::Deflection => 1,
        LimitKind::BendingStress => 2,
        _ => 0,
    }
}

/// Rotations, and directions about a middle; of axial forces the middle is their sense.
struct Box {
    over: [f64; 2],
    middle: f64,
    half: f64,
}

impl Box {
    fn is_least(&self) -> bool {
        self.half <= LEAST[0] && self.over[1] - self.over[0] <= LEAST[1]
    }
    fn halves(self) -> [Self; 2] {
        let Self { over, middle, half } = self;
        // A sector is η²/2 too high; a stretch of rotation about a third of its length, as chips change in it.
        if half > LEAST[0] && 0.5 * half * half > 0.3 * (over[1] - over[0]) || over[1] - over[0] <= LEAST[1] {
            return [-0.5, 0.5].map(|by| Self { over, middle: middle + by * half, half: 0.5 * half });
        }
        let cut = 0.5 * (over[0] + over[1]);
        [[over[0], cut], [cut, over[1]]].map(|over| Self { over, middle, half })
    }
}

struct Work<'a> {
    edges: &'a Edges,
    kind: LimitKind,
    f: f64,
    known: &'a Ellipsoid,
    half: [f64; P],
    slack: f64,
}

impl Work<'_> {
    fn bound(&self, of: &Box) -> f64 {
        let turns = of.over.map(f64::sin_cos);
        let (sin, cos) = of.middle.sin_cos();
        let mut sum = [0.0; P];
        let mut rest = 0.0;
        for edge in &self.edges.list {
            if edge.over[0] > of.over[1] || edge.over[1] < of.over[0] {
                continue;
            }
            let (part, thick) = self.thickest(edge, of, turns);
            if part <= 0.0 || thick <= 0.0 {
                continue;
            }
            let chip = self.f * edge.share * thick;
            let size = edge.ring.edge * part * edge.most_engaged(of.over) * edge.weights[weight(self.kind)];
            let [n_r, n_z] = edge.ring.normal;
            let along = if self.kind == LimitKind::ForceAxial {
                [0.0, -n_z * of.middle * size, -n_r * of.middle * size]
            } else {
                let [x, y] = [edge.turn[0] * cos - edge.turn[1] * sin, edge.turn[1] * cos + edge.turn[0] * sin];
                [-x * size, -n_r * y * size, n_z * y * size]
            };
            rest += self.take(along, chip, &mut sum);
        }
        let most = (self.known.most(&sum) + rest * self.known.scattered() + self.slack).max(0.0);
        if self.kind == LimitKind::ForceAxial { most } else { most / of.half.cos() * (1.0 + ROUNDING) }
    }

    /// The part of an edge that has a chip somewhere in a box, and the largest mean chip thickness of that part, per mm of the edge's feed: along the
    /// ring the chip goes about straight from its lower end to its upper end.
    fn thickest(&self, edge: &Edge, of: &Box, turns: [(f64, f64); 2]) -> (f64, f64) {
        let [x, y] = edge.turn;
        let at = |k: usize| {
            let theta = of.over[k].clamp(edge.over[0], edge.over[1]);
            let [first, last] = [theta + edge.off - edge.lag, theta + edge.off + edge.lag];
            if theta == of.over[k] && first >= edge.arc[0] && last <= edge.arc[1] {
                let (sin, cos) = turns[k];
                return [sin * x + cos * y, cos * x - sin * y];
            }
            (0.5 * (first.max(edge.arc[0]) + last.min(edge.arc[1]))).sin_cos().into()
        };
        let [[s0, c0], [s1, c1]] = [at(0), at(1)];
        let top = if c0 >= -1e-9 && c1 <= 1e-9 { 1.0 } else { s0.max(s1) };
        let chip = |[n_r, n_z]: [f64; 2]| {
            let [down, up] = self.edges.rise.map(|rise| rise * n_z);
            // A falling sine is cut off at nothing: what is left of the chip is the vertical part.
            self.edges.across * n_r * top.max(0.0) + down.max(up)
        };
        let (middle, [lower, upper]) = (chip(edge.ring.normal), edge.ring.ends.map(chip));
        let half = 0.5 * (upper - lower).abs();
        if middle >= half { (1.0, middle) } else { (0.5 * (1.0 + middle / half), 0.5 * (middle + half)) }
    }

    /// Adds what an edge may carry: as a linear form of the coefficients where it is positive for all of them, else its largest value.
    fn take(&self, [a, b, c]: [f64; 3], chip: f64, sum: &mut [f64; P]) -> f64 {
        let mean = &self.known.mean;
        let of = |first: usize| {
            let middle = a * mean[first] + b * mean[first + 1] + c * mean[first + 2];
            let off = a.abs() * self.half[first] + b.abs() * self.half[first + 1] + c.abs() * self.half[first + 2];
            [middle - off, middle + off]
        };
        let ([cut_low, cut_high], [edge_low, edge_high]) = (of(0), of(3));
        let chip = if cut_high > 0.0 { chip } else { 0.0 };
        let (least, most) = (chip * cut_low + edge_low, chip * cut_high + edge_high);
        if most <= 0.0 {
            return 0.0;
        }
        // Thinner chips may carry more where the chip's own force turns its sign within the ellipsoid.
        if least < 0.0 || chip > 0.0 && cut_low < 0.0 {
            return most;
        }
        for (k, part) in [a, b, c].into_iter().enumerate() {
            sum[k] += chip * part;
            sum[k + 3] += part;
        }
        0.0
    }
}

impl Edge {
    /// The largest part of it, 0 to 1, that is in its arc at one of these rotations, be the arc upright or turning with the height as those
    /// beside it say.
    fn most_engaged(&self, over: [f64; 2]) -> f64 {
        self.engaged(over, self.lag).max(self.engaged(over, self.against))
    }

    /// That part where the upper end lags by so much: it grows with slope 1/(2 lag) from where the leading end enters, and falls alike to where
    /// the trailing end leaves.
    fn engaged(&self, over: [f64; 2], lag: f64) -> f64 {
        let [entry, exit] = self.arc.map(|phi| phi - self.off);
        let best = (0.5 * (entry + exit)).clamp(over[0], over[1]);
        let inside = (best + lag - entry).min(exit + lag - best).min(exit - entry);
        if inside >= 2.0 * lag { 1.0 } else { (inside / (2.0 * lag) * (1.0 + ROUNDING)).clamp(0.0, 1.0) }
    }
}

/// Immersions between which an edge may cut that is engaged all around, rad: more than any edge lags.
const ANYWHERE: [f64; 2] = [-1e4, 1e4];

/// When an edge of this lead, the half of which lags by so much, may be in an arc of immersions: rotations within a period, what the immersion then
/// exceeds the rotation by, and the arc. An edge that is never all out of it counts once at every rotation: an arc of a turn ends where it
/// begins, and would have it twice there.
pub fn passes(arc: [f64; 2], lag: f64, lead: f64, period: f64) -> Vec<([f64; 2], f64, [f64; 2])> {
    let [entry, exit] = [arc[0] - lag, arc[1] + lag];
    let off = |turn: i64| lead + turn as f64 * period;
    if exit - entry >= TAU {
        return (0..(TAU / period).round() as i64).map(|turn| ([0.0, period], off(turn), ANYWHERE)).collect();
    }
    let [first, last] = [((entry - lead) / period).floor() as i64 - 1, ((exit - lead) / period).ceil() as i64];
    let of = |off: f64| ([(entry - off).max(0.0), (exit - off).min(period)], off, arc);
    (first..=last).map(off).map(of).filter(|(over, ..)| over[0] < over[1]).collect()
}
