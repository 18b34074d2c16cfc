//! Motions of the tool over the passes. In: passes, the tool above the surface. Out: rapids and feeds of the tip: down to a pass on
//! a quarter of a circle, along it by lines within a tolerance, up on a quarter circle, over to the next.
//!
//! Between two ends that lie near each other the tool goes over at the feed, above stock and surface; else at rapid, at the
//! safe height.

use super::drop::Dropper;
use super::passes::{Bind, Plan, Spot, way};
use crate::path::Vec3;

/// One straight motion of the tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Where it ends, mm.
    pub to: Vec3,
    /// Feed, mm/s; `None`: rapid.
    pub feed_mm_s: Option<f64>,
    /// Pass it belongs to, and what bounds the step-over there; `None`: no cut is meant.
    pub of: Option<(u32, Bind)>,
}

/// How the motions are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawing {
    /// How far lines may lie from the path on the surface, mm.
    pub tolerance_mm: f64,
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
    Step { to, feed_mm_s: None, of: None }
}

/// Points of the tip along a stretch, thinned to the tolerance, each with what bounds the pass on the way to it.
fn line(stretch: &[Spot], dropper: &Dropper, drawing: &Drawing, forward: bool) -> Vec<(Vec3, Bind)> {
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
    if !forward {
        points.reverse();
    }
    thin(&points, drawing.tolerance_mm)
}

/// Leaves out points that lie within the tolerance of the line between those kept (Ramer, Douglas, Peucker).
fn thin(points: &[(Vec3, Bind)], tolerance_mm: f64) -> Vec<(Vec3, Bind)> {
    let mut kept = vec![false; points.len()];
    let mut work = vec![(0, points.len().saturating_sub(1))];
    while let Some((from, to)) = work.pop() {
        kept[from] = true;
        kept[to] = true;
        let (a, b) = (points[from].0, points[to].0);
        let along = b - a;
        let square = along.norm_squared().max(f64::MIN_POSITIVE);
        let off = |k: usize| {
            let v = points[k].0 - a;
            (v - along * (v.dot(&along) / square).clamp(0.0, 1.0)).norm()
        };
        let farthest =
            (from + 1..to).map(|k| (off(k), k)).reduce(|best, other| if other.0 > best.0 { other } else { best });
        if let Some((_, k)) = farthest.filter(|(off, _)| *off > tolerance_mm) {
            work.extend([(from, k), (k, to)]);
        }
    }
    points.iter().zip(kept).filter(|(_, kept)| *kept).map(|(point, _)| *point).collect()
}

/// A stretch with its way there and its leads.
fn put(steps: &mut Vec<Step>, line: &[(Vec3, Bind)], (pass, feed): (u32, f64), dropper: &Dropper, drawing: &Drawing) {
    let [Some(first), Some(last)] = [line.first(), line.last()] else { return };
    let radius = drawing.stock_mm + CLEAR_MM;
    let air = |to: Vec3| Step { to, feed_mm_s: Some(feed), of: None };
    let mut lead_in = lead(first.0, direction(line[1.min(line.len() - 1)].0 - first.0), radius, dropper);
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
    steps.extend(line.windows(2).map(|two| Step { to: two[1].0, feed_mm_s: Some(feed), of: Some((pass, two[1].1)) }));
    let back = direction(line[line.len().saturating_sub(2)].0 - last.0);
    steps.extend(lead(last.0, back, radius, dropper).into_iter().skip(1).map(air));
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
