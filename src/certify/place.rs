//! Bounds of the loads at one place, implemented independently of [`crate::force`]. In: tool, ellipsoid, the arcs of its rings that may be
//! engaged, the direction of the feed. Out: upper bounds of its loads at all feeds up to a given one.
//!
//! Mean torque: N/2π Σ r du (k_te Δφ + k_tc f ∫ h/f dφ) over the arcs where the chip is positive, affine in coefficients and feed; power:
//! 2π n times that, and the tare. Both only grow with engagement. Chip: the largest c n_r sin φ + t_z n_z times the feed per tooth. Peaks:
//! [`super::peak`]. A force at the height z bends the tip by its own lever; the model of the setup takes the resultant at the mean height
//! instead: each ring counts with the larger of both.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::cutter::{Part, Ring, Teeth, compliance, lag_rad};
use super::ellipsoid::{Ellipsoid, P};
use super::interval::Interval;
use super::peak::{Edge, Edges, passes};
use crate::machine::{LimitKind, Tool};
use crate::path::{Curve, Plane};

/// An arc of a ring: immersions between which it may be engaged, rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Index of the ring among the parts of its tool.
    pub ring: usize,
    /// First immersion.
    pub entry: f64,
    /// Last immersion.
    pub exit: f64,
}

/// Relative bound of the rounding of the closed forms here: a hundred operations.
const ROUNDING: f64 = 1e-12;
/// Parts of the outline that are no further apart touch, as a share of its piece: the rounding of their ends.
const TOUCHES: f64 = 1e-6;
/// Shortest piece of an arc that counts, rad: the rounding of immersions.
const NOTHING_RAD: f64 = 1e-9;

/// What is engaged at a place, ready to be asked.
#[derive(Debug, Clone, Default)]
pub struct Place {
    edges: Edges,
    /// Mean torque over (k_te, k_tc · feed per tooth), N·mm over N/mm and N/mm².
    pub torque: [Interval; 2],
    /// Largest chip thickness over feed per tooth.
    pub chip: Interval,
    /// Height above the tip up to which it may be engaged, mm.
    pub depth: Interval,
}

/// Does a certificate speak about this kind of limit?
pub fn is_covered(kind: LimitKind) -> bool {
    use LimitKind::{BendingStress, ChipThickness, Deflection, FeedPerTooth, ForceAxial, ForceXy, Power, Torque};
    matches!(kind, ForceXy | ForceAxial | Power | Torque | Deflection | BendingStress | ChipThickness | FeedPerTooth)
}

/// Vertical part of the unit direction of a path between two places on it, mm.
pub fn rise(curve: &Curve, [from, to]: [f64; 2]) -> Interval {
    let middle = 0.5 * (from + to);
    let at = Interval::exact(curve.tangent(middle).z);
    match curve {
        // The direction of an arc turns by its curvature a mm.
        Curve::Arc(arc) if arc.plane != Plane::Xy => {
            let turn = 1.1 * curve.curvature(middle).norm() * 0.5 * (to - from) + 1e-12;
            Interval { lo: (at.lo - turn).max(-1.0), hi: (at.hi + turn).min(1.0) }
        }
        _ => at.widened(1e-12),
    }
}

impl Place {
    /// Of arcs on parts of a tool's outline, with the path rising like this; `None` where a part is none of it, or an arc no arc.
    pub fn new(tool: &Tool, parts: &[Part], arcs: &[Arc], rise: Interval) -> Option<Self> {
        let teeth = Teeth::of(tool);
        let across = (Interval::exact(1.0) - (rise * rise).not_negative()).sqrt();
        let edges = Edges { list: Vec::new(), period: teeth.period, across: across.hi, rise: [rise.lo, rise.hi] };
        let zero = Interval::exact(0.0);
        let mut place = Self { edges, torque: [zero; 2], chip: zero, depth: zero };
        let rings = arcs.iter().map(|arc| Ring::of(tool, parts.get(arc.ring)?)).collect::<Option<Vec<Ring>>>()?;
        let weights = weights(tool, arcs, &rings);
        let largest_share = teeth.each.iter().map(|[_, share]| *share).fold(0.0, f64::max);
        for (k, ((arc, ring), weights)) in arcs.iter().zip(&rings).zip(weights).enumerate() {
            let length = arc.exit - arc.entry;
            if !(length > 0.0 && length <= TAU + 1e-4 && arc.entry.abs() <= 2.0 * TAU) {
                return None;
            }
            place.depth.hi = place.depth.hi.max(ring.top);
            for [lead, share] in &teeth.each {
                let lag = lag_rad(tool, ring.half).abs();
                let against = lag.min(ring.half * turn_beside(k, tool, parts, arcs, &rings));
                let passes = passes([arc.entry, arc.exit], lag, lead - lag_rad(tool, ring.z), teeth.period);
                let (ring, share) = (*ring, *share);
                let edge = |(over, off, arc)| Edge {
                    over,
                    arc,
                    off,
                    turn: [f64::cos(off), f64::sin(off)],
                    lag,
                    against,
                    ring,
                    share,
                    weights,
                };
                place.edges.list.extend(passes.into_iter().map(edge));
            }
            place.take_means(arc, ring, (across.hi, rise), f64::from(tool.flutes), largest_share);
        }
        Some(place)
    }

    /// Adds the torque of an arc, and looks for its thickest chip.
    fn take_means(&mut self, arc: &Arc, ring: &Ring, (across, rise): (f64, Interval), flutes: f64, share: f64) {
        let of = |normal: [f64; 2]| (across * normal[0].max(0.0), (rise * Interval::exact(normal[1])).hi);
        let (swing, lift) = of(ring.normal);
        for [from, to] in leading([arc.entry, arc.exit], swing, lift) {
            let (s, c) = (ring.edge * ring.r * flutes / TAU, from.cos() - to.cos());
            let [rubbed, cut] = [s * (to - from), s * (swing * c + lift * (to - from)).max(0.0)];
            let about = |x: f64| Interval::exact(x).widened(ROUNDING * (x.abs() + s));
            self.torque = [self.torque[0] + about(rubbed), self.torque[1] + about(cut)];
        }
        // The chip goes as the cosine of an angle along the outline, of which the nearest of three places is at most a quarter of the ring away.
        let [lower, upper] = ring.ends;
        let half = |cosine: f64| (0.5 * (1.0 + cosine)).sqrt();
        let beyond = share / half(half((lower[0] * upper[0] + lower[1] * upper[1]).min(1.0)));
        for (swing, lift) in [lower, ring.normal, upper].map(of) {
            for [from, to] in leading([arc.entry, arc.exit], swing, lift) {
                let top = ((to - FRAC_PI_2) / TAU).floor() * TAU + FRAC_PI_2 >= from;
                let sine = if top { 1.0 } else { from.sin().max(to.sin()) };
                self.chip.hi = self.chip.hi.max((swing * sine + lift) * beyond + ROUNDING);
                self.chip.lo = self.chip.hi - 4.0 * ROUNDING;
            }
        }
    }

    /// What a certificate states of it.
    pub fn enclosures(&self) -> [Interval; 4] {
        [self.depth, self.torque[0], self.torque[1], self.chip]
    }

    /// Bound of a load, in the unit of the setup's limits inside the program, at feeds per tooth up to `f` mm and this speed; `None` for
    /// kinds that are not covered.
    pub fn most(&self, kind: LimitKind, f: f64, rps: f64, limit: f64, known: &Ellipsoid) -> Option<f64> {
        Some(match kind {
            LimitKind::ForceXy | LimitKind::ForceAxial | LimitKind::Deflection | LimitKind::BendingStress => {
                self.edges.most(kind, f, limit, known)
            }
            LimitKind::Torque => known.most(&self.torque_form(f, 1.0, 0.0)),
            // N·mm/s are mW.
            LimitKind::Power => known.most(&self.torque_form(f, 1e-3 * TAU * rps, 1.0)),
            LimitKind::ChipThickness => self.chip.hi * f * (1.0 + ROUNDING),
            LimitKind::FeedPerTooth => f,
            _ => return None,
        })
    }

    fn torque_form(&self, f: f64, by: f64, tare: f64) -> [f64; P] {
        let [rubbed, cut] = self.torque.map(|part| part.hi * by * (1.0 + ROUNDING));
        [cut * f, 0.0, 0.0, rubbed, 0.0, 0.0, tare]
    }
}

/// Counts of a newton on each ring: as a force, as deflection, mm, as stress, MPa.
fn weights(tool: &Tool, arcs: &[Arc], rings: &[Ring]) -> Vec<[f64; 3]> {
    let sum = |of: &dyn Fn(&Ring) -> f64| -> f64 {
        arcs.iter().zip(rings).map(|(arc, ring)| (arc.exit - arc.entry) * ring.edge * of(ring)).sum()
    };
    let mean_height = sum(&|ring| ring.z) / sum(&|_| 1.0).max(f64::MIN_POSITIVE);
    let of_mean = compliance(tool, mean_height);
    let each = |ring: &Ring| {
        let own = compliance(tool, ring.z);
        [1.0, own[0].hi.max(of_mean[0].hi), own[1].hi.max(of_mean[1].hi)]
    };
    rings.iter().map(each).collect()
}

/// The least turn of an edge against the border of an arc, rad per mm of height, as the arcs on the rings above and below tell it.
fn turn_beside(k: usize, tool: &Tool, parts: &[Part], arcs: &[Arc], rings: &[Ring]) -> f64 {
    let own = &parts[arcs[k].ring];
    let beside = |j: &usize| {
        let other = &parts[arcs[*j].ring];
        let touches = (other.from - own.to).abs() < TOUCHES || (own.from - other.to).abs() < TOUCHES;
        touches && other.segment == own.segment && rings[*j].z != rings[k].z
    };
    let turns = (0..arcs.len()).filter(beside).flat_map(|j| {
        let (by, up) = ([arcs[j].entry - arcs[k].entry, arcs[j].exit - arcs[k].exit], rings[j].z - rings[k].z);
        by.map(|by| (lag_rad(tool, 1.0) + by / up).abs())
    });
    turns.fold(f64::INFINITY, f64::min)
}

/// The parts of an arc where `swing` sin φ + `lift` is positive.
fn leading([entry, exit]: [f64; 2], swing: f64, lift: f64) -> Vec<[f64; 2]> {
    if lift >= swing {
        return if lift > 0.0 { vec![[entry, exit]] } else { Vec::new() };
    }
    if lift <= -swing {
        return Vec::new();
    }
    let low = (-lift / swing).asin();
    let first = ((entry - (PI - low)) / TAU).floor();
    let turns = (0..4).map(|k| TAU * (first + f64::from(k)));
    let parts = turns.map(|turn| [entry.max(low + turn), exit.min(PI - low + turn)]);
    parts.filter(|[from, to]| to - from > NOTHING_RAD).collect()
}
