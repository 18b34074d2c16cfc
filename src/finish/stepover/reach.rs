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
use crate::numeric::bisect;
use crate::path::Vec3;

/// Number of step-overs at which loads are computed.
const LOOKS: usize = 5;
/// Iterations that refine the step-over of a force: to about 0.1 %.
const SETTLING: u32 = 4;
/// Bisections for the step-over of a scallop: to 0.1 % of the range.
const HALVINGS: u32 = 10;
/// Distance over which curvature is measured, over the corner radius of the tool: longer than facets, shorter than
/// features of the surface.
const CURVATURE_SPAN: f64 = 0.25;
/// Radius assumed for a convex edge, mm.
const SHARPEST_MM: f64 = 0.05;

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
    /// Contact with the surface.
    pub contact: Contact,
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
        let shape = self.dropper.shape();
        let contact = self.dropper.drop(p)?;
        let tip = Vec3::new(p[0], p[1], contact.tip_mm);
        let tangent = along(&contact.normal, heading);
        let section = Section::new(shape, tip, tangent, &self.ground(p, &contact, heading), beside);
        Some(ToolAt { contact, tip, tangent, scallop_mm: section.scallop_mm(), section })
    }

    /// Surface and stock under the tool at a place, with a horizontal heading.
    fn ground(&self, p: [f64; 2], contact: &Contact, heading: [f64; 2]) -> Ground {
        Ground {
            contact: contact.point,
            normal: contact.normal,
            curvature_per_mm: self.curvature(p, contact, &along(&contact.normal, heading)),
            stock_mm: (self.stock_mm)(contact),
            turn_per_mm: if self.one_height { self.turn(p, contact, heading) } else { 0.0 },
        }
    }

    /// Scallop over the surface at a place, mm, that the tool leaves with its tip at the first point beside a pass with its
    /// tip at the second; neither need rest on the surface. `None` off the surface.
    pub fn scallop_between_mm(&self, p: [f64; 2], heading: [f64; 2], [tip, before]: [Vec3; 2]) -> Option<f64> {
        let contact = self.dropper.drop(p)?;
        let (ground, tangent) = (self.ground(p, &contact, heading), along(&contact.normal, heading));
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
            let found = self.dropper.drop([p[0] + by * left.x, p[1] + by * left.y]);
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
            let found = self.dropper.drop([p[0] + by * heading[0], p[1] + by * heading[1]]);
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
        let before = Beside::Pass(Vec3::new(p[0], p[1], contact.tip_mm));
        let next = |step: f64| self.here([p[0] + step * side[0], p[1] + step * side[1]], heading, before);
        let fits = |step: f64| next(step).is_none_or(|here| here.scallop_mm <= bounds.scallop_mm);
        // Beyond the rim the tool rests on an edge, where the scallop has no meaning.
        let on = |step: f64| next(step).is_some_and(|here| !here.contact.rim);
        let (least, largest) = (bounds.least_mm, bounds.largest_mm);
        let last = if on(largest) { largest } else { bisect(on, least, largest, HALVINGS)[0] };
        let low = if fits(last) { largest } else { bisect(fits, least, last, HALVINGS)[0] };
        let at = |k: usize| bounds.least_mm + (low - bounds.least_mm) * k as f64 / (LOOKS - 1) as f64;
        let steps = (0..LOOKS).filter_map(|k| Some((at(k), self.line(&next(at(k))?)))).collect();
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
