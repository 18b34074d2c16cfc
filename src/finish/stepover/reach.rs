//! Allowed step-over of the next pass at a place. In: the drop-cutter of a surface, the stock on it, limits. Out: the
//! step-over at which the scallop or the force of the next pass reaches its limit, for any feed.
//!
//! The engagement of the next pass does not depend on its feed, so loads at a few step-overs up to the one that the
//! scallop allows suffice for every feed. The force grows with the step-over and is interpolated linearly between them.

use super::drop::{Contact, Dropper};
use super::section::{Beside, Ground, Section};
use super::shape::Shape;
use crate::force::{Cut, Cutter, LoadLine};
use crate::machine::Slice;
use crate::numeric::{SignChange, bisect};
use crate::path::Vec3;

/// Number of step-overs at which loads are computed.
const LOOKS: usize = 5;
/// Iterations that refine the step-over of a force: to about 0.1 %.
const SETTLING: u32 = 4;
/// Bisections for the step-over at which the next pass leaves the surface: to 0.1 % of the range.
const HALVINGS: u32 = 10;
/// Share by which the scallop at the step-over found may be below its limit: 10⁻⁵ of the step-over, as √scallop grows
/// with it. Prices are differences of 0.5 % of the step-over.
const NEAR: f64 = 2e-5;
/// Most places looked at for the step-over of a scallop.
const MOST_LOOKS: u32 = 12;
/// Distance over which curvature is measured, over the corner radius of the tool: longer than facets, shorter than
/// features of the surface.
const CURVATURE_SPAN: f64 = 0.25;
/// Radius assumed for a convex edge, mm.
const SHARPEST_MM: f64 = 0.05;
/// Most places looked at for the highest one between two passes, where the contact jumps over it.
const MOST_BETWEEN: u32 = 18;

/// Bounds of step-over and scallop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Largest scallop height, mm.
    pub scallop_mm: f64,
    /// Least step-over, mm seen from above.
    pub least_mm: f64,
    /// Largest step-over, mm seen from above.
    pub largest_mm: f64,
}

/// A place, mm, and its area seen from above, mm².
pub type Place = ([f64; 2], f64);

/// A tool, a surface, and the stock on it. The frame is rotated so that passes run along X.
pub struct ToolOnSurface<'a> {
    /// Drop-cutter of tool and surface.
    pub dropper: &'a Dropper<'a>,
    /// Force model of the tool at its speed.
    pub cutter: &'a Cutter,
    /// Rings of the tool.
    pub rings: &'a [Slice],
    /// Thickness of the stock along the normal at a point of the surface, mm.
    pub stock_mm: &'a (dyn Fn(&Contact) -> f64 + Sync),
    /// Are the passes of one height, following the level curves of the surface?
    pub one_height: bool,
}

/// Loads of the next pass at one place, by step-over.
#[derive(Debug, Clone, Default)]
pub struct Reach {
    /// Step-over that the scallop allows, mm.
    pub by_scallop_mm: f64,
    /// Length of the path over its length seen from above.
    pub longer: f64,
    /// Length of a step-over seen from above over its length on the surface.
    pub leans: f64,
    /// Step-overs in rising order, with the loads there.
    steps: Vec<(f64, LoadLine)>,
}

/// The tool at a place.
#[derive(Debug, Clone)]
pub struct ToolAt {
    /// Tip, mm.
    pub tip: Vec3,
    /// Unit feed direction.
    pub tangent: Vec3,
    /// Scallop towards the neighbouring pass, mm.
    pub scallop_mm: f64,
    section: Section,
}

impl ToolOnSurface<'_> {
    /// Shape of the tool.
    pub fn shape(&self) -> Shape {
        self.dropper.shape()
    }

    /// The tool at a place with a horizontal heading, beside another pass; `None` off the surface.
    pub fn here(&self, p: [f64; 2], heading: [f64; 2], beside: Beside) -> Option<ToolAt> {
        let contact = self.dropper.drop(p)?;
        let turn_per_mm = if self.one_height { self.turn(p, &contact, heading) } else { 0.0 };
        let ground = Ground { turn_per_mm, ..self.straight_ground(p, &contact, heading) };
        let (tip, tangent) = (Vec3::new(p[0], p[1], contact.tip_mm), along(&contact.normal, heading));
        let section = Section::new(self.dropper.shape(), tip, tangent, &ground, beside);
        Some(ToolAt { tip, tangent, scallop_mm: section.scallop_mm(), section })
    }

    /// Height that a pass through `to`, with a horizontal heading, and one with its tip at `before` leave between them, mm. `None` off the surface.
    /// Between passes of one height the section has to do: in a valley the contact jumps from one side to the other however small the step
    /// is, and the strip there is none of these passes.
    fn left_between_mm(&self, before: Vec3, to: [f64; 2], heading: [f64; 2]) -> Option<f64> {
        let contact = self.dropper.drop(to)?;
        let tips = [before, Vec3::new(to[0], to[1], contact.tip_mm)];
        if self.one_height {
            let (tangent, ground) = (along(&contact.normal, heading), self.straight_ground(to, &contact, heading));
            let section = Section::new(self.dropper.shape(), tips[1], tangent, &ground, Beside::Pass(before));
            return Some(section.scallop_mm());
        }
        Some(self.highest_between(tips, along(&contact.normal, heading)).map_or(0.0, |(left_mm, _)| left_mm))
    }

    /// Where most is left between a pass with its tip at the first place and one along a tangent with its tip at the second, and the height, mm:
    /// of the points of the surface that the tool would touch on its way from one to the other, the one that is as high below the one pass
    /// as below the other; where the contact jumps over that, a point on the chord of the jump. A section over a circle in place of the
    /// surface is not enough at the foot of a wall or over an edge, where the contact jumps or rests while the tool goes on.
    pub fn highest_between(&self, [before, tip]: [Vec3; 2], tangent: Vec3) -> Option<(f64, Contact)> {
        let ground = Ground { contact: tip, normal: Vec3::z(), curvature_per_mm: 0.0, stock_mm: 0.0, turn_per_mm: 0.0 };
        let section = Section::new(self.dropper.shape(), tip, tangent, &ground, Beside::Pass(before));
        let most_mm = self.shape().corner_mm;
        let mut highest = None;
        // From the one pass to the other the height below the first grows from 0 and that below the second falls to 0; on even ground both
        // by squares, so that their difference is linear.
        let (mut middle, mut crossing, mut last) = (0.5, None, None::<Contact>);
        let mut beside: [Option<(f64, Contact)>; 2] = [None; 2];
        let mut enter = |contact: Contact| {
            let [below_this, below_before] = section.left_mm(contact.point, contact.normal).map(|mm| mm.min(most_mm));
            let left_mm = below_this.min(below_before).max(0.0);
            if !contact.rim && highest.is_none_or(|(known_mm, _)| left_mm > known_mm) {
                highest = Some((left_mm, contact));
            }
            [below_this, below_before, left_mm]
        };
        for _ in 0..MOST_BETWEEN {
            let at = [0, 1].map(|axis| before[axis] + middle * (tip[axis] - before[axis]));
            let contact = last.map_or_else(|| self.dropper.drop(at), |last| self.dropper.drop_near(at, &last))?;
            last = Some(contact);
            let [below_this, below_before, left_mm] = enter(contact);
            let off_mm = below_before - below_this;
            // The height where both are equal is between them.
            if off_mm.abs() <= NEAR * left_mm {
                return highest;
            }
            beside[usize::from(off_mm > 0.0)] = Some((off_mm, contact));
            let ends_mm = 2.0 * (below_this.abs() + below_before.abs());
            let crossing = crossing.get_or_insert_with(|| SignChange::new((0.0, -ends_mm), (1.0, ends_mm)));
            crossing.narrow(middle, off_mm);
            middle = crossing.next();
        }
        // The contact jumps over it: from one facet of a hollow to the next, or from the foot of a wall to the wall. Both passes may leave more
        // beside the chord between the two contacts than at its ends. Above a hollow that the tool cannot reach the chord is within the tool.
        if let [Some((low, a)), Some((high, b))] = beside {
            let share = low / (low - high);
            let mixed = |a: Vec3, b: Vec3| a + share * (b - a);
            let normal = mixed(a.normal, b.normal).try_normalize(0.0);
            if let Some(normal) = normal.filter(|_| !a.rim && !b.rim) {
                enter(Contact { point: mixed(a.point, b.point), normal, ..a });
            }
        }
        highest
    }

    /// Surface and stock under the tool at a place of a straight pass, with a horizontal heading.
    fn straight_ground(&self, p: [f64; 2], contact: &Contact, heading: [f64; 2]) -> Ground {
        Ground {
            contact: contact.point,
            normal: contact.normal,
            curvature_per_mm: self.curvature(p, contact, &along(&contact.normal, heading)),
            stock_mm: (self.stock_mm)(contact),
            turn_per_mm: 0.0,
        }
    }

    /// Scallop over the surface at a place, mm, that the tool leaves with its tip at the first point beside a pass with its
    /// tip at the second; neither need rest on the surface. `None` off the surface.
    pub fn scallop_between_mm(&self, p: [f64; 2], heading: [f64; 2], [tip, before]: [Vec3; 2]) -> Option<f64> {
        let contact = self.dropper.drop(p)?;
        let (ground, tangent) = (self.straight_ground(p, &contact, heading), along(&contact.normal, heading));
        let rests = Vec3::new(p[0], p[1], contact.tip_mm);
        Some(Section::new(self.dropper.shape(), tip, tangent, &ground, Beside::Pass(before)).scallop_off_mm(rests))
    }

    /// Loads there as functions of feed.
    pub fn line(&self, here: &ToolAt) -> LoadLine {
        let arcs = here.section.arcs(self.rings);
        self.cutter.line(&Cut { arcs: &arcs, tangent_z: here.tangent.z, ..Cut::default() })
    }

    /// Curvature of the surface across the feed, 1/mm, positive concave: from the circle through the centres of the
    /// corner at three places across, which lie on the parallel surface at the corner radius.
    fn curvature(&self, p: [f64; 2], contact: &Contact, tangent: &Vec3) -> f64 {
        let shape = self.dropper.shape();
        let span = CURVATURE_SPAN * shape.corner_mm.max(0.2 * shape.radius_mm());
        let left = Vec3::new(-tangent.y, tangent.x, 0.0).normalize();
        let up = tangent.cross(&left);
        let middle = |contact: &Contact| {
            let at = contact.point + shape.corner_mm * contact.normal;
            [at.dot(&left), at.dot(&up)]
        };
        let beside = |by: f64| {
            let found = self.dropper.drop_near([p[0] + by * left.x, p[1] + by * left.y], contact);
            found.filter(|contact| !contact.rim).map(|contact| middle(&contact))
        };
        // At the rim the tool rolls over an edge, which is not part of the surface: use two places on the other side.
        let here = middle(contact);
        let of_middles = match [-span, span].map(beside) {
            [Some(a), Some(b)] => bend(a, here, b),
            [Some(a), None] => beside(-2.0 * span).map_or(0.0, |far| bend(far, a, here)),
            [None, Some(b)] => beside(2.0 * span).map_or(0.0, |far| bend(here, b, far)),
            [None, None] => 0.0,
        };
        let r = shape.corner_mm;
        // Parallel surfaces have the same centre of curvature: ρ = ρ_centres + r, concave radii positive.
        let least = r / (r + SHARPEST_MM);
        let of_middles = of_middles.max(-least / r);
        of_middles / (1.0 + r * of_middles)
    }

    /// Curvature of the level curve through a place, 1/mm, positive with its centre on the right: κ = −H″/|∇H|, with H″
    /// the second derivative of the tip height along the heading; with the higher ground on the left of the heading the
    /// sign is reversed.
    fn turn(&self, p: [f64; 2], contact: &Contact, heading: [f64; 2]) -> f64 {
        let shape = self.dropper.shape();
        let span = CURVATURE_SPAN * shape.corner_mm.max(0.2 * shape.radius_mm());
        let level = contact.normal.x.hypot(contact.normal.y);
        let beside = |by: f64| {
            let found = self.dropper.drop_near([p[0] + by * heading[0], p[1] + by * heading[1]], contact);
            found.filter(|contact| !contact.rim).map(|contact| contact.tip_mm)
        };
        let [Some(behind), Some(ahead)] = [-span, span].map(beside) else { return 0.0 };
        let sinks = 2.0 * contact.tip_mm - behind - ahead;
        let turn = sinks * contact.normal.z / (span * span * level.max(1e-6));
        let downhill_is_right = contact.normal.x * heading[1] > contact.normal.y * heading[0];
        // Limited to the curvature of the tool itself.
        let tightest = shape.radius_mm().recip();
        (if downhill_is_right { -turn } else { turn }).clamp(-tightest, tightest)
    }

    /// The step-over at which the force of the next pass equals the reference at a feed, mm, refined between two known
    /// ones.
    pub fn settled_mm(
        &self,
        p: [f64; 2],
        (heading, side): ([f64; 2], [f64; 2]),
        reach: &Reach,
        [feed_mm_s, reference_n]: [f64; 2],
    ) -> f64 {
        let (start, _) = reach.step_mm(feed_mm_s, reference_n);
        let force = |line: &LoadLine| line.loads(feed_mm_s).force_xy_peak_n - reference_n;
        let after = reach.steps.iter().position(|(_, line)| force(line) > 0.0);
        let (Some(after), Some(contact)) = (after.filter(|k| *k > 0), self.dropper.drop(p)) else { return start };
        let before = Beside::Pass(Vec3::new(p[0], p[1], contact.tip_mm));
        let [mut low, mut high] = [after - 1, after].map(|k| (reach.steps[k].0, force(&reach.steps[k].1)));
        let mut at = start;
        // Regula falsi with the Illinois modification (Dowell and Jarratt 1971).
        for _ in 0..SETTLING {
            let next = [0, 1].map(|axis| p[axis] + at * side[axis]);
            let Some(here) = self.here(next, heading, before) else { return start };
            let off = force(&self.line(&here));
            if off > 0.0 {
                high = (at, off);
                low.1 *= 0.5;
            } else {
                low = (at, off);
                high.1 *= 0.5;
            }
            at = low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1).max(f64::MIN_POSITIVE);
        }
        at
    }

    /// Allowed step-over of the pass after the one through `p`, towards the horizontal unit vector `side`.
    pub fn reach(&self, p: [f64; 2], (heading, side): ([f64; 2], [f64; 2]), bounds: &Bounds) -> Option<Reach> {
        let contact = self.dropper.drop(p)?;
        let tip = Vec3::new(p[0], p[1], contact.tip_mm);
        let before = Beside::Pass(tip);
        let at = |step: f64| [p[0] + step * side[0], p[1] + step * side[1]];
        let left = |step: f64| self.left_between_mm(tip, at(step), heading);
        let scallop = |step: f64| left(step).map_or(0.0, |mm| mm / bounds.scallop_mm);
        // Beyond the rim the tool rests on an edge, where the scallop has no meaning.
        let on = |step: f64| self.dropper.drop(at(step)).is_some_and(|contact| !contact.rim);
        let (least, largest) = (bounds.least_mm, bounds.largest_mm);
        let last = if on(largest) { largest } else { bisect(on, least, largest, HALVINGS)[0] };
        // Where the surface ends before the limit is reached, the step-over goes on with the root of the scallop, as on what is there of it.
        let beyond = || if last < largest { (last / scallop(last).sqrt()).clamp(last, largest) } else { largest };
        let low = last_within(scallop, least, last).unwrap_or_else(beyond);
        let look = |k: usize| least + (low - least) * k as f64 / (LOOKS - 1) as f64;
        let line = |step: f64| Some((step, self.line(&self.here(at(step), heading, before)?)));
        let steps = (0..LOOKS).filter_map(|k| line(look(k))).collect();
        let longer = along(&contact.normal, heading).xy().norm().recip();
        Some(Reach { by_scallop_mm: low, longer, leans: leans(&contact.normal, heading), steps })
    }

    /// Length of a step-over seen from above over its length on the surface, at a place.
    pub fn leans(&self, p: [f64; 2], heading: [f64; 2]) -> Option<f64> {
        Some(leans(&self.dropper.drop(p)?.normal, heading))
    }
}

impl Reach {
    /// Step-overs in rising order, with the loads there.
    pub fn steps(&self) -> &[(f64, LoadLine)] {
        &self.steps
    }

    /// Largest step-over at a feed with at most the reference force, mm; and whether the least one is within it.
    pub fn step_mm(&self, feed_mm_s: f64, reference_n: f64) -> (f64, bool) {
        let force = |line: &LoadLine| line.loads(feed_mm_s).force_xy_peak_n;
        let mut before: Option<(f64, f64)> = None;
        for (step, line) in &self.steps {
            let here = force(line);
            if here > reference_n {
                return match before {
                    None => (*step, false),
                    Some((at, less)) => (at + (step - at) * (reference_n - less) / (here - less), true),
                };
            }
            before = Some((*step, here));
        }
        (self.by_scallop_mm, true)
    }
}

/// The step-over between two, mm, whose scallop is at most the limit and at least 1 − [`NEAR`] of it; the least one if
/// every scallop is above the limit, `None` if even the largest one is within it. `scallop`: height over its limit.
fn last_within(scallop: impl Fn(f64) -> f64, least_mm: f64, most_mm: f64) -> Option<f64> {
    // √scallop is about proportional to the step-over (h ≈ s²/8r), so that few looks suffice; a scallop without bound is a
    // high one. Aimed at the middle of what is near enough.
    let off = |step: f64| scallop(step).min(4.0).sqrt() - (1.0 - 0.5 * NEAR).sqrt();
    let near = 0.25 * NEAR;
    let [low, high] = [least_mm, most_mm].map(|step| (step, off(step)));
    if high.1 <= near {
        return None;
    }
    if low.1 > near {
        return Some(least_mm);
    }
    let mut crossing = SignChange::new(low, high);
    for _ in 0..MOST_LOOKS {
        let step = crossing.next();
        let here = off(step);
        if here.abs() <= near {
            return Some(step);
        }
        crossing.narrow(step, here);
    }
    Some(crossing.negative())
}

/// Unit feed direction along a surface with this normal, above a horizontal heading.
fn along(normal: &Vec3, heading: [f64; 2]) -> Vec3 {
    let rise = -(heading[0] * normal.x + heading[1] * normal.y) / normal.z.max(1e-6);
    Vec3::new(heading[0], heading[1], rise).normalize()
}

/// Horizontal component of the unit vector along the surface across a heading.
fn leans(normal: &Vec3, heading: [f64; 2]) -> f64 {
    let across = normal.cross(&along(normal, heading));
    (across.x * -heading[1] + across.y * heading[0]).abs()
}

/// Curvature of the circle through three points of a plane, 1/mm; positive if it turns left.
fn bend(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let part = |p: [f64; 2], q: [f64; 2]| [q[0] - p[0], q[1] - p[1]];
    let (ab, bc, ac) = (part(a, b), part(b, c), part(a, c));
    let length = |v: [f64; 2]| (v[0] * v[0] + v[1] * v[1]).sqrt();
    let product = length(ab) * length(bc) * length(ac);
    if product < 1e-12 { 0.0 } else { 2.0 * (ab[0] * bc[1] - ab[1] * bc[0]) / product }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    /// Scallops that grow with other powers of the step-over than the second, from nothing, or at a jump.
    #[test]
    fn the_step_over_of_a_scallop_limit_is_found_from_below() {
        for (power, looks) in [(2.0, 4), (1.0, 9), (4.0, 11)] {
            for at in [0.11, 0.5, 0.99] {
                let count = Cell::new(0);
                let scallop = |step: f64| {
                    count.set(count.get() + 1);
                    f64::powf(step / at, power)
                };
                let found = last_within(scallop, 0.1, 1.0).unwrap();
                let share = f64::powf(found / at, power);
                assert!((1.0 - 1.01 * NEAR..=1.0).contains(&share), "{power} {at}: {share}");
                assert!(count.get() <= looks, "{power} {at}: {} looks", count.get());
            }
        }
        assert_eq!(last_within(|step| step, 0.1, 0.9), None);
        assert_eq!(last_within(|step| 20.0 * step, 0.1, 0.9), Some(0.1));
        // The flats of a bull-nose end part: no scallop until then, one without bound beyond the diameter.
        let flats = |step: f64| if step < 1.0 { (8.0 * (step - 0.6).max(0.0)).powi(2) } else { f64::INFINITY };
        let found = last_within(flats, 0.1, 2.0).unwrap();
        assert!((0.72..=0.725).contains(&found), "{found}");
        // A jump over the limit: from below.
        let found = last_within(|step| if step < 0.5 { 0.1 } else { 9.0 }, 0.1, 2.0).unwrap();
        assert!((0.4..0.5).contains(&found), "{found}");
    }
}
