//! The rings of a cylindrical side: they have one radius and can only be less engaged with height. In: the parts of its rings,
//! between which levels lie, and the directions in which something may be met. Out: arcs and their removal area.
//!
//! Equal ends of a stack mean that all between are equal. Where engagement changes much though no level lies there (a floor on a
//! slope, a groove), rings are halved until it changes evenly; where it ends, until the height of that is known.

use super::cutter::Band;
use super::gaps::Interval;
use super::outline::SubRing;
use super::rings::{Shared, Work, extent, push};
use super::scene::RawArc;
use std::rc::Rc;

/// Change of engagement from one ring to the next above which both are looked at in parts, rad.
const JUMP_RAD: f64 = 0.15;
/// How far the engagement at its middle may be off the mean of that at both ends of a ring that stays whole, rad.
const EVEN_RAD: f64 = 0.05;
/// How often a ring of a cylinder is halved, and what lies as near to a level counts as at it, mm.
const HALVED: u32 = 6;
const LEVEL_MM: f64 = 1e-6;
/// Difference of keys up to which directions count as equal: at most 1e-5 rad.
const EQUAL_KEYS: f64 = 5e-6;

/// A ring of a cylinder with what was found at its middle.
pub(super) struct Side {
    ring: SubRing,
    angles: Shared,
}

impl Work<'_> {
    /// Hands on the rings of a cylinder; their removal area, mm². What rings above each other share is worked out once.
    pub(super) fn sides(&self, found: &[Side], out: &mut Vec<RawArc>) -> f64 {
        let mut area_mm2 = 0.0;
        for shared in found.chunk_by(|a, b| Rc::ptr_eq(&a.angles, &b.angles)) {
            let angles = &shared[0].angles;
            if angles.is_empty() {
                continue;
            }
            let [width, _] = self.width(&shared[0].ring, angles);
            let first = out.len();
            push(&shared[0].ring, angles, out);
            let end = out.len();
            for Side { ring, .. } in shared {
                area_mm2 += width * self.cutter.part(ring.slice, ring.part).edge_mm;
            }
            for Side { ring, .. } in &shared[1..] {
                let (from, part) = (out.len(), ring.part.map(|p| p as f32));
                out.extend_from_within(first..end);
                for arc in &mut out[from..] {
                    (arc.slice, arc.part) = (ring.slice, part);
                }
            }
        }
        area_mm2
    }

    /// Rings of a cylinder over which engagement changes much or ends though no level lies there (a floor on a slope, a groove) are
    /// halved until it changes little over each part. What the lowest meets at its lower end, and the highest at its upper,
    /// no other ring tells.
    pub(super) fn refine(&self, found: Vec<Side>, windows: &Shared) -> Vec<Side> {
        if !self.sloped || found.is_empty() {
            return found;
        }
        let last = found.len() - 1;
        let bottom = self.at_border(&found[0].ring, 0.0, windows);
        let top = self.at_border(&found[last].ring, 1.0, &found[last].angles);
        let mut borders = vec![differ(&bottom, &found[0].angles)];
        borders.extend(found.windows(2).map(|two| differ(&two[0].angles, &two[1].angles)));
        borders.push(differ(&found[last].angles, &top));
        if !borders.contains(&true) {
            return found;
        }
        let mut refined = Vec::with_capacity(found.len() + 8);
        let mut below = bottom.clone();
        for (k, side) in found.into_iter().enumerate() {
            let middle = side.angles.clone();
            if borders[k] || borders[k + 1] {
                let from = if k == 0 { bottom.clone() } else { self.at_border(&side.ring, 0.0, &below) };
                let to = if k == last { top.clone() } else { self.at_border(&side.ring, 1.0, &middle) };
                self.halve(&side.ring, [&from, &to], HALVED, &mut refined);
            } else {
                refined.push(side);
            }
            below = middle;
        }
        refined
    }

    /// What the ring at a border of a part of a cylinder meets (0 its lower end, 1 its upper: just below it, a level there is
    /// that of the next), within what one below it does.
    fn at_border(&self, ring: &SubRing, side: f64, within: &[Interval]) -> Shared {
        let [from, to] = ring.part;
        let at = self.sub_ring(ring.slice, [from + side * (to - from); 2], false);
        self.ring(&SubRing { z: at.z - side * LEVEL_MM, ..at }, within).into()
    }

    /// Appends a ring of a cylinder in so many halves of halves at most, given what its lower and its upper end meet: whole
    /// where its middle meets about their mean. Where engagement ends in it, its height is sought: a layer counts by it, however
    /// short its contact.
    fn halve(&self, ring: &SubRing, [from, to]: [&Shared; 2], depth: u32, out: &mut Vec<Side>) {
        if same(from, to) {
            out.push(Side { ring: *ring, angles: from.clone() });
            return;
        }
        let middle: Shared = self.ring(ring, from).into();
        let ends = from.is_empty() != to.is_empty();
        let even = (extent(&middle) - 0.5 * (extent(from) + extent(to))).abs() <= EVEN_RAD;
        if depth == 0 || (even && !ends) {
            out.push(Side { ring: *ring, angles: middle });
            return;
        }
        let [low, high] = ring.part;
        let half = 0.5 * (low + high);
        let [lower, upper] = [[low, half], [half, high]].map(|part| self.sub_ring(ring.slice, part, false));
        self.halve(&lower, [from, &middle], depth - 1, out);
        self.halve(&upper, [&middle, to], depth - 1, out);
    }

    /// Arcs of rings above each other with one radius: they only shrink with height, so equal ends mean all equal, and one
    /// is looked for only within what one below it meets.
    fn stack(&self, rings: &[SubRing], windows: &[Interval]) -> Vec<Side> {
        let Some(lowest) = rings.first() else { return Vec::new() };
        let lower: Shared = self.ring(lowest, windows).into();
        let mut sides: Vec<Side> = rings.iter().map(|ring| Side { ring: *ring, angles: lower.clone() }).collect();
        let last = rings.len() - 1;
        if last > 0 && !lower.is_empty() {
            sides[last].angles = self.ring(&rings[last], &lower).into();
            self.between(&mut sides);
        }
        sides
    }

    /// Arcs of those rings of a band, and of all above them where the topmost still meets something: what is thinner than a cell stands
    /// as high as none of the cells around it show.
    pub(super) fn stack_up(&self, band: &Band, rings: &[SubRing], windows: &[Interval]) -> Vec<Side> {
        let sides = self.stack(rings, windows);
        match sides.last() {
            Some(top) if !top.angles.is_empty() => self.stack(&self.sub_rings(band, f64::INFINITY), windows),
            _ => sides,
        }
    }

    /// Fills in what lies between the first and the last of a stack, which are known.
    fn between(&self, sides: &mut [Side]) {
        let [first, between @ .., last] = sides else { return };
        if between.is_empty() {
            return;
        }
        if first.angles.is_empty() || same(&first.angles, &last.angles) {
            for side in between {
                side.angles = first.angles.clone();
            }
            return;
        }
        let middle = (sides.len() - 1) / 2;
        sides[middle].angles = self.ring(&sides[middle].ring, &sides[0].angles).into();
        self.between(&mut sides[..=middle]);
        self.between(&mut sides[middle..]);
    }
}

/// Does engagement change much from one to the other, or end between them?
fn differ(a: &Shared, b: &Shared) -> bool {
    !Rc::ptr_eq(a, b) && (a.is_empty() != b.is_empty() || (extent(a) - extent(b)).abs() > JUMP_RAD)
}

fn same(a: &[Interval], b: &[Interval]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (0..2).all(|k| (a[k].key - b[k].key).abs() < EQUAL_KEYS))
}
