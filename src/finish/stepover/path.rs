//! Motions of the tool over the passes. In: passes, the tool above the surface. Out: rapids and feeds of the tip: down to a pass on
//! a quarter of a circle, along it by lines and arcs within a tolerance, up on a quarter circle, over to the next.
//!
//! Between two ends that lie near each other the tool goes over at the feed, above stock and surface; else at rapid, at the
//! safe height.

use super::drop::Dropper;
use super::fit::{Part, fit};
use super::passes::{Bind, Plan, Spot, way};
use crate::path::Vec3;

/// One motion of the tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Where it ends, mm.
    pub to: Vec3,
    /// Point that it goes through on an arc in a plane across an axis, mm; `None`: a line.
    pub via: Option<Vec3>,
    /// Feed, mm/s; `None`: rapid.
    pub feed_mm_s: Option<f64>,
    /// Pass it belongs to, and what bounds the step-over there; `None`: no cut is meant.
    pub of: Option<(u32, Bind)>,
}

/// How the motions are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawing {
    /// How far lines and arcs may lie from the path on the surface, mm.
    pub tolerance_mm: f64,
    /// Arcs too?
    pub arcs: bool,
    /// Thickness of the stock: links stay above it, mm.
    pub stock_mm: f64,
    /// Height at which rapids go anywhere, mm.
    pub safe_mm: f64,
}

/// Air above stock under links, mm.
pub const CLEAR_MM: f64 = 0.5;
/// Lines that a quarter circle of a lead is drawn with.
const LEAD_LINES: usize = 6;
/// Points along a pass before those that lie on a line are left out, mm; a tenth of the tool's radius where that is less.
const FINE_MM: f64 = 0.2;
/// Links longer than this many radii go at rapid.
const NEAR_RADII: f64 = 4.0;

/// The motions of a plan, all at one feed.
pub fn steps(plan: &Plan, feed_mm_s: f64, dropper: &Dropper, drawing: &Drawing) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    for (number, pass) in plan.passes.iter().enumerate() {
        let forward = way(number) > 0.0;
        let mut stretches: Vec<&Vec<Spot>> = pass.stretches.iter().collect();
        if !forward {
            stretches.reverse();
        }
        for stretch in stretches {
            let line = line(stretch, dropper, drawing, forward);
            put(&mut steps, &line, (number as u32, feed_mm_s), dropper, drawing);
        }
    }
    if let Some(last) = steps.last().map(|step| step.to) {
        steps.push(rapid(Vec3::new(last.x, last.y, drawing.safe_mm)));
    }
    steps
}

fn rapid(to: Vec3) -> Step {
    Step { to, via: None, feed_mm_s: None, of: None }
}

/// A line or an arc of a pass.
struct Piece {
    to: Vec3,
    via: Option<Vec3>,
    bind: Bind,
}

/// A stretch as lines and arcs within the tolerance, each with what bounds the pass at its end; the first is where it begins.
fn line(stretch: &[Spot], dropper: &Dropper, drawing: &Drawing, forward: bool) -> Vec<Piece> {
    let mut points = finely(stretch, dropper);
    if !forward {
        points.reverse();
    }
    let places: Vec<Vec3> = points.iter().map(|(at, _)| *at).collect();
    let first = points.first().map(|(to, bind)| Piece { to: *to, via: None, bind: *bind });
    let part = |part: Part| Piece { to: points[part.to].0, via: part.via, bind: points[part.to].1 };
    first.into_iter().chain(fit(&places, drawing.tolerance_mm, drawing.arcs).into_iter().map(part)).collect()
}

/// Points of the tip between the spots.
fn finely(stretch: &[Spot], dropper: &Dropper) -> Vec<(Vec3, Bind)> {
    let fine = FINE_MM.min(0.1 * dropper.shape().radius_mm());
    let mut points: Vec<(Vec3, Bind)> = Vec::new();
    for (k, two) in stretch.windows(2).enumerate() {
        let [a, b] = [two[0], two[1]];
        let parts = ((b.at[0] - a.at[0]) / fine).ceil().max(1.0) as usize;
        for part in usize::from(k > 0)..=parts {
            let t = part as f64 / parts as f64;
            let p = [0, 1].map(|axis| a.at[axis] + t * (b.at[axis] - a.at[axis]));
            let known = if t < 0.5 { &a } else { &b };
            let tip = dropper.drop(p).map_or(known.tip.z, |contact| contact.tip_mm);
            points.push((Vec3::new(p[0], p[1], tip), known.bind));
        }
    }
    points
}

/// A stretch with its way there and its leads.
fn put(steps: &mut Vec<Step>, line: &[Piece], (pass, feed): (u32, f64), dropper: &Dropper, drawing: &Drawing) {
    let ([first, second, ..], [.., before_last, last]) = (line, line) else { return };
    let radius = drawing.stock_mm + CLEAR_MM;
    let air = |to: Vec3| Step { to, via: None, feed_mm_s: Some(feed), of: None };
    let mut lead_in = lead(first.to, tangent(first.to, second.via, second.to), radius, dropper);
    lead_in.reverse();
    let before = steps.last().map(|step| step.to);
    let start = lead_in[0];
    let near = before.filter(|from| (start - from).xy().norm() < NEAR_RADII * dropper.shape().radius_mm());
    if let Some(from) = near {
        let high = over(from, start, dropper) + drawing.stock_mm + CLEAR_MM;
        let high = high.max(from.z).max(start.z);
        for to in [Vec3::new(from.x, from.y, high), Vec3::new(start.x, start.y, high)] {
            if steps.last().is_some_and(|step| (step.to - to).norm() > 1e-9) {
                steps.push(air(to));
            }
        }
    } else {
        let from = before.unwrap_or(start);
        steps.push(rapid(Vec3::new(from.x, from.y, drawing.safe_mm)));
        steps.push(rapid(Vec3::new(start.x, start.y, drawing.safe_mm)));
        steps.push(rapid(start + CLEAR_MM * Vec3::z()));
    }
    steps.extend(lead_in.iter().map(|to| air(*to)));
    let piece =
        |piece: &Piece| Step { to: piece.to, via: piece.via, feed_mm_s: Some(feed), of: Some((pass, piece.bind)) };
    steps.extend(line.iter().skip(1).map(piece));
    let back = tangent(last.to, last.via, before_last.to);
    steps.extend(lead(last.to, back, radius, dropper).into_iter().skip(1).map(air));
}

/// Level direction in which a line or an arc leaves its end `from`.
fn tangent(from: Vec3, via: Option<Vec3>, to: Vec3) -> Vec3 {
    // Inversion at the end turns the circle into the line through near/|near|² and far/|far|², parallel to the tangent.
    let Some(via) = via else { return direction(to - from) };
    let (near, far) = (via - from, to - from);
    direction(near / near.norm_squared().max(f64::MIN_POSITIVE) - far / far.norm_squared().max(f64::MIN_POSITIVE))
}

/// Level unit vector.
fn direction(along: Vec3) -> Vec3 {
    let level = Vec3::new(along.x, along.y, 0.0);
    if level.norm() > 1e-12 { level.normalize() } else { Vec3::x() }
}

/// From an end of a pass away from it and up on a quarter circle; never below where the tool rests.
fn lead(end: Vec3, into: Vec3, radius: f64, dropper: &Dropper) -> Vec<Vec3> {
    let point = |k: usize| {
        let (sin, cos) = (std::f64::consts::FRAC_PI_2 * k as f64 / LEAD_LINES as f64).sin_cos();
        let at = end - into * (radius * sin) + Vec3::z() * (radius * (1.0 - cos));
        let rest = dropper.drop([at.x, at.y]).map_or(at.z, |contact| contact.tip_mm);
        Vec3::new(at.x, at.y, at.z.max(rest))
    };
    (0..=LEAD_LINES).map(point).collect()
}

/// Highest tip at which the tool rests between two places, mm.
fn over(from: Vec3, to: Vec3, dropper: &Dropper) -> f64 {
    let length = (to - from).xy().norm();
    let parts = (length / FINE_MM).ceil().max(1.0) as usize;
    let at = |k: usize| from + (to - from) * (k as f64 / parts as f64);
    let rests = (0..=parts).filter_map(|k| dropper.drop([at(k).x, at(k).y])).map(|contact| contact.tip_mm);
    rests.fold(f64::NEG_INFINITY, f64::max)
}
