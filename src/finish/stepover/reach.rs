//! How far the next pass may step over from a place. In: a tool made ready for a surface, the stock on it, limits. Out:
//! the step-over at which the scallop or the force of the next pass meets its limit, for any feed.
//!
//! What the next pass engages does not depend on its feed; so its loads at a few step-overs up to the one that the
//! scallop allows answer for every feed: force grows with the step-over, between two of them along a straight line.

use super::drop::{Contact, Dropper};
use super::section::{Beside, Ground, Section};
use super::shape::Shape;
use crate::force::{Cut, Cutter, LoadLine};
use crate::machine::Slice;
use crate::numeric::bisect;
use crate::path::Vec3;

/// Step-overs at which loads are worked out.
const LOOKS: usize = 5;
/// Steps by which the step-over of a force is settled: within a thousandth of it.
const SETTLING: u32 = 4;
/// Halvings by which the step-over of a scallop is found: a thousandth of the range.
const HALVINGS: u32 = 10;
/// Distance over which curvature is looked at, over the corner radius of the tool: facets are shorter, bends of the
/// surface longer.
const CURVATURE_SPAN: f64 = 0.25;
/// A convex edge counts as a bend of this radius, mm.
const SHARPEST_MM: f64 = 0.05;

/// Bounds of step-over and scallop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Largest scallop height, mm.
    pub scallop_mm: f64,
    /// Least step-over, mm in the plane.
    pub least_mm: f64,
    /// Largest step-over, mm in the plane.
    pub largest_mm: f64,
}

/// A place, mm, and the area it stands for seen from above, mm².
pub type Place = ([f64; 2], f64);

/// A tool above a surface with stock on it. The frame is turned so that passes run along X.
pub struct Terrain<'a> {
    /// The tool made ready for the surface.
    pub dropper: &'a Dropper<'a>,
    /// Its loads at its speed.
    pub cutter: &'a Cutter,
    /// Rings its arcs belong to.
    pub rings: &'a [Slice],
    /// Thickness of the stock along the normal at a point of the surface, mm.
    pub stock_mm: &'a (dyn Fn(&Contact) -> f64 + Sync),
    /// Do passes keep to one height, and bend as the surface asks?
    pub one_height: bool,
}

/// The next pass at one place: what it carries, by step-over.
#[derive(Debug, Clone, Default)]
pub struct Reach {
    /// Step-over that the scallop allows, mm.
    pub by_scallop_mm: f64,
    /// Length of the path over its length seen from above.
    pub longer: f64,
    /// Length of a step-over seen from above over its length on the surface.
    pub leans: f64,
    /// Step-overs with the loads there, growing.
    steps: Vec<(f64, LoadLine)>,
}

/// What the tool does at a place.
#[derive(Debug, Clone)]
pub struct ToolAt {
    /// Where it rests.
    pub contact: Contact,
    /// Tip, mm.
    pub tip: Vec3,
    /// Unit feed direction.
    pub tangent: Vec3,
    /// Scallop towards the pass beside, mm.
    pub scallop_mm: f64,
    section: Section,
}

impl Terrain<'_> {
    /// Shape of the tool.
    pub fn shape(&self) -> Shape {
        self.dropper.shape()
    }

    /// The tool at a place with a level heading, beside another pass; `None` where nothing lies below.
    pub fn here(&self, p: [f64; 2], heading: [f64; 2], beside: Beside) -> Option<ToolAt> {
        let shape = self.dropper.shape();
        let contact = self.dropper.drop(p)?;
        let tip = Vec3::new(p[0], p[1], contact.tip_mm);
        let tangent = along(&contact.normal, heading);
        let ground = Ground {
            contact: contact.point,
            normal: contact.normal,
            curvature_per_mm: self.curvature(p, &contact, &tangent),
            stock_mm: (self.stock_mm)(&contact),
            turn_per_mm: if self.one_height { self.turn(p, &contact, heading) } else { 0.0 },
        };
        let section = Section::new(shape, tip, tangent, &ground, beside);
        Some(ToolAt { contact, tip, tangent, scallop_mm: section.scallop_mm(), section })
    }

    /// Loads there as functions of feed.
    pub fn line(&self, here: &ToolAt) -> LoadLine {
        let arcs = here.section.arcs(self.rings);
        self.cutter.line(&Cut { arcs: &arcs, tangent_z: here.tangent.z, ..Cut::default() })
    }

    /// Curvature of the surface across the feed, 1/mm, positive concave: from the circle through the middles of the
    /// corner at three places across, which runs parallel to the surface at the corner radius.
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
        // At the rim the tool rolls over an edge, which is no bend of the surface: there both others lie on one side.
        let here = middle(contact);
        let of_middles = match [-span, span].map(beside) {
            [Some(a), Some(b)] => bend(a, here, b),
            [Some(a), None] => beside(-2.0 * span).map_or(0.0, |far| bend(far, a, here)),
            [None, Some(b)] => beside(2.0 * span).map_or(0.0, |far| bend(here, b, far)),
            [None, None] => 0.0,
        };
        let r = shape.corner_mm;
        // Surface and middles have one centre of curvature: ρ = ρ_middles + r, concave radii counted positive.
        let least = r / (r + SHARPEST_MM);
        let of_middles = of_middles.max(-least / r);
        of_middles / (1.0 + r * of_middles)
    }

    /// Curvature of the curve of one height through a place, 1/mm, positive with its centre on the right: by how much a
    /// tip sinks that goes straight on, κ = −H″/|∇H|; with the higher ground on the left of the heading the sign turns.
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
        // No tighter than the tool itself: around less it would turn on the spot.
        let tightest = shape.radius_mm().recip();
        (if downhill_is_right { -turn } else { turn }).clamp(-tightest, tightest)
    }

    /// The step-over at which the force of the next pass meets the reference at a feed, between two of those known, mm.
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
        // Regula falsi; the end that stays counts half (Illinois).
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

    /// How far the pass after the one through `p` with its tip there may step over, towards the level unit vector
    /// `side`.
    pub fn reach(&self, p: [f64; 2], (heading, side): ([f64; 2], [f64; 2]), bounds: &Bounds) -> Option<Reach> {
        let contact = self.dropper.drop(p)?;
        let before = Beside::Pass(Vec3::new(p[0], p[1], contact.tip_mm));
        let next = |step: f64| self.here([p[0] + step * side[0], p[1] + step * side[1]], heading, before);
        let fits = |step: f64| next(step).is_none_or(|here| here.scallop_mm <= bounds.scallop_mm);
        // Beyond the rim the tool rests on an edge, which leaves no scallop: what it would be there says nothing of the
        // surface.
        let on = |step: f64| next(step).is_some_and(|here| !here.contact.rim);
        let (least, largest) = (bounds.least_mm, bounds.largest_mm);
        let last = if on(largest) { largest } else { bisect(on, least, largest, HALVINGS)[0] };
        let low = if fits(last) { largest } else { bisect(fits, least, last, HALVINGS)[0] };
        let at = |k: usize| bounds.least_mm + (low - bounds.least_mm) * k as f64 / (LOOKS - 1) as f64;
        let steps = (0..LOOKS).filter_map(|k| Some((at(k), self.line(&next(at(k))?)))).collect();
        let longer = along(&contact.normal, heading).xy().norm().recip();
        Some(Reach { by_scallop_mm: low, longer, leans: leans(&contact.normal, heading), steps })
    }

    /// Length seen from above of a step-over over its length on the surface, at a place.
    pub fn leans(&self, p: [f64; 2], heading: [f64; 2]) -> Option<f64> {
        Some(leans(&self.dropper.drop(p)?.normal, heading))
    }
}

impl Reach {
    /// Step-overs with the loads there, growing.
    pub fn steps(&self) -> &[(f64, LoadLine)] {
        &self.steps
    }

    /// Largest step-over at a feed whose force stays at the reference, mm; and whether the least one is within it.
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

/// Unit feed direction along the surface with a normal, above a level heading.
fn along(normal: &Vec3, heading: [f64; 2]) -> Vec3 {
    let rise = -(heading[0] * normal.x + heading[1] * normal.y) / normal.z.max(1e-6);
    Vec3::new(heading[0], heading[1], rise).normalize()
}

/// Level part of the direction across a heading on a surface with a normal.
fn leans(normal: &Vec3, heading: [f64; 2]) -> f64 {
    let across = normal.cross(&along(normal, heading));
    (across.x * -heading[1] + across.y * heading[0]).abs()
}

/// Curvature of the circle through three points of a plane, 1/mm; positive where it bends to the left on the way.
fn bend(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let part = |p: [f64; 2], q: [f64; 2]| [q[0] - p[0], q[1] - p[1]];
    let (ab, bc, ac) = (part(a, b), part(b, c), part(a, c));
    let length = |v: [f64; 2]| (v[0] * v[0] + v[1] * v[1]).sqrt();
    let product = length(ab) * length(bc) * length(ac);
    if product < 1e-12 { 0.0 } else { 2.0 * (ab[0] * bc[1] - ab[1] * bc[0]) / product }
}
