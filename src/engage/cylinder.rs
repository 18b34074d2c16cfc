//! The rings of a cylindrical side. In: parts of its rings, split at levels, and the directions in which there may be material. Out: arcs and
//! their removal area.
//!
//! All rings have one radius, so engagement can only shrink with height from the bottom of a blank up, and equal arcs at both ends of a stack
//! mean equal arcs all between. Below its bottom a blank has no material: stacks end at the bottoms of blanks.
//! Where engagement changes much without a level (a floor on a slope, a groove), rings are halved until it changes evenly; where it ends,
//! until the height of the end is known.

use super::cutter::Band;
use super::gaps::Interval;
use super::outline::SubRing;
use super::rings::{Shared, Work, extent, push};
use super::scene::RawArc;
use std::rc::Rc;

/// Change of engagement from one ring to the next above which both are divided, rad.
const JUMP_RAD: f64 = 0.15;
/// A ring stays whole if the engagement at its middle differs by less than this from the mean of both its ends, rad.
const EVEN_RAD: f64 = 0.05;
/// Most halvings of a ring of a cylinder.
const HALVED: u32 = 6;
/// A height within this of a level counts as the level, mm.
const LEVEL_MM: f64 = 1e-6;
/// Difference of keys up to which directions count as equal: at most 1e-5 rad.
const EQUAL_KEYS: f64 = 5e-6;

/// A ring of a cylinder with what was found at its middle.
#[derive(Clone)]
pub(super) struct Side {
    ring: SubRing,
    angles: Shared,
}

impl Work<'_> {
    /// Appends the arcs of the rings of a cylinder and returns their removal area, mm². The area of arcs that consecutive rings share is
    /// worked out once.
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

    /// Halves rings over which engagement changes much, or ends, without a level (a floor on a slope, a groove), until it changes little
    /// over each part. The engagement at the lower end of the lowest ring and at the upper end of the highest is worked out, because no
    /// neighbour gives it.
    pub(super) fn refine(&self, found: Vec<Side>, windows: &Shared) -> Vec<Side> {
        if !self.sloped {
            return found;
        }
        let stacks = found.chunk_by(|a, b| self.in_one_stack(&a.ring, &b.ring));
        stacks.flat_map(|stack| self.refine_stack(stack.to_vec(), windows)).collect()
    }

    fn refine_stack(&self, found: Vec<Side>, windows: &Shared) -> Vec<Side> {
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

    /// The engagement at a border of a part of a cylinder (0: its lower end, 1: just below its upper end, where a level belongs to the next
    /// part), searched for within the engagement of a ring below it.
    fn at_border(&self, ring: &SubRing, side: f64, within: &[Interval]) -> Shared {
        let [from, to] = ring.part;
        let at = self.sub_ring(ring.slice, [from + side * (to - from); 2], false);
        self.ring(&SubRing { z: at.z - side * LEVEL_MM, ..at }, within).into()
    }

    /// Appends a ring of a cylinder, halved at most `depth` times, given the engagement at its lower and its upper end. It stays whole where
    /// its middle is engaged about as their mean. Where engagement ends in it, the height of the end is searched for: the removed layer
    /// depends on it, however short the contact.
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

    /// Arcs of consecutive rings with one radius.
    fn stacks(&self, rings: &[SubRing], windows: &[Interval]) -> Vec<Side> {
        let stacks = rings.chunk_by(|a, b| self.in_one_stack(a, b));
        stacks.flat_map(|stack| self.stack(stack, windows)).collect()
    }

    /// Does no bottom of a blank lie between two rings?
    fn in_one_stack(&self, a: &SubRing, b: &SubRing) -> bool {
        let begun_at = |z: f64| self.scene.blanks.iter().filter(|blank| blank.bottom_mm() < z).count();
        begun_at(a.z) == begun_at(b.z)
    }

    /// Arcs of the rings of one stack, at least one. They only shrink with height: equal arcs at both ends mean equal arcs between, and the
    /// arcs of a ring are searched for only within those of a ring below.
    fn stack(&self, rings: &[SubRing], windows: &[Interval]) -> Vec<Side> {
        let lower: Shared = self.ring(&rings[0], windows).into();
        let mut sides: Vec<Side> = rings.iter().map(|ring| Side { ring: *ring, angles: lower.clone() }).collect();
        let last = rings.len() - 1;
        if last > 0 && !lower.is_empty() {
            sides[last].angles = self.ring(&rings[last], &lower).into();
            self.between(&mut sides);
        }
        sides
    }

    /// Arcs of these rings of a band, and of all rings above where the topmost is still engaged: material thinner than a cell may stand
    /// higher than the cells around it.
    pub(super) fn stack_up(&self, band: &Band, rings: &[SubRing], windows: &[Interval]) -> Vec<Side> {
        let sides = self.stacks(rings, windows);
        match sides.last() {
            Some(top) if !top.angles.is_empty() => self.stacks(&self.sub_rings(band, f64::INFINITY), windows),
            _ => sides,
        }
    }

    /// Works out the rings between the first and the last of a stack, whose arcs are known.
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
