//! Motions of the tool for the passes. In: passes, the drop-cutter. Out: rapid and feed motions of the tip: a quarter
//! circle down to a pass, lines and arcs along it within a tolerance, a quarter circle up, a link to the next.
//!
//! Short links run at the feed, just above stock and surface; longer ones at rapid, at the safe height.

use super::drop::Dropper;
use super::fit::{Part, Round, fit, written_arc};
use super::levels::onto;
use super::plan::{Pass, Plan, Spot, StepLimit};
use crate::path::{Arc, Curve, Vec3};

/// One motion of the tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Its end, mm.
    pub to: Vec3,
    /// Intermediate point of an arc in a plane normal to an axis, mm; `None`: a line.
    pub via: Option<Vec3>,
    /// Feed, mm/s; `None`: rapid.
    pub feed_mm_s: Option<f64>,
    /// Its pass, and what bounds the step-over there; `None`: a lead or link.
    pub of: Option<(u32, StepLimit)>,
}

/// How the motions are drawn.
#[derive(Clone, Copy)]
pub struct Drawing<'a> {
    /// Largest deviation of lines and arcs from the path on the surface, mm.
    pub tolerance_mm: f64,
    /// Are arcs written?
    pub arcs: bool,
    /// Thickness of the stock, mm; links stay above it.
    pub stock_mm: f64,
    /// Safe height of rapids, mm.
    pub safe_mm: f64,
    /// A place as it is written.
    pub round: Round<'a>,
}

/// Clearance of links above the stock, mm.
pub const CLEAR_MM: f64 = 0.5;
/// Number of lines of the quarter circle of a lead.
const LEAD_LINES: usize = 6;
/// Spacing of points along a pass before lines and arcs are fitted, mm; at most a tenth of the tool radius.
const FINE_MM: f64 = 0.2;
/// Share of the tolerance by which a path may deviate from the chords between its points; lines and arcs are fitted to
/// the points within what is left of it.
const SAMPLED: f64 = 0.2;
/// Depth below the surface, over the tolerance, from which a point of a pass of one height is lifted.
const OFF_LEVEL: f64 = 0.2;
/// Length of a link, in tool radii, from which it runs at rapid.
const NEAR_RADII: f64 = 4.0;

/// The motions of a plan, all at one feed.
pub fn steps(plan: &Plan, feed_mm_s: f64, dropper: &Dropper, drawing: &Drawing) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    for (number, pass) in plan.passes.iter().enumerate() {
        let mut stretches: Vec<&Vec<Spot>> = pass.stretches.iter().collect();
        if pass.back {
            stretches.reverse();
        }
        for stretch in stretches {
            let line = line(pass, stretch, dropper, drawing);
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
    limit: StepLimit,
}

/// A stretch as lines and arcs within the tolerance, each with what bounds the pass at its end; the first is where it
/// begins.
fn line(pass: &Pass, stretch: &[Spot], dropper: &Dropper, drawing: &Drawing) -> Vec<Piece> {
    let (mut points, left) = match pass.level_mm {
        None => (finely(stretch, dropper, drawing.tolerance_mm), 1.0 - SAMPLED),
        Some(level_mm) => (finely_level(stretch, level_mm, dropper, drawing.tolerance_mm), 1.0 - SAMPLED - OFF_LEVEL),
    };
    if pass.back {
        points.reverse();
    }
    let places: Vec<Vec3> = points.iter().map(|(at, _)| *at).collect();
    let first = points.first().map(|(to, limit)| Piece { to: *to, via: None, limit: *limit });
    let part = |part: Part| Piece { to: points[part.to].0, via: part.via, limit: points[part.to].1 };
    let parts = fit(&places, left * drawing.tolerance_mm, drawing.arcs, drawing.round);
    first.into_iter().chain(parts.into_iter().map(part)).collect()
}

/// The motions along the stretches of a pass as they will be written, each with rounded ends and centre.
pub fn as_written(pass: &Pass, dropper: &Dropper, drawing: &Drawing) -> Vec<Curve> {
    let curve = |two: &[Piece]| {
        let [from, to] = [two[0].to, two[1].to];
        let arc = two[1].via.and_then(|via| written_arc(&[from, via, to], drawing.round));
        let Some((circle, end)) = arc else {
            return Curve::Line { from: (drawing.round)(from), to: (drawing.round)(to) };
        };
        let (u, v, _) = circle.plane.axes();
        let mut centre = end;
        (centre[u], centre[v]) = (circle.centre[0], circle.centre[1]);
        let sweep_rad = if circle.left { circle.sweep_rad } else { -circle.sweep_rad };
        Curve::Arc(Arc::new(circle.plane, (drawing.round)(from), end, centre, sweep_rad))
    };
    let lines = pass.stretches.iter().map(|stretch| line(pass, stretch, dropper, drawing));
    lines.flat_map(|line| line.windows(2).map(curve).collect::<Vec<_>>()).collect()
}

/// Points of the tip between the spots, so close that the path deviates from its chords by less than [`SAMPLED`] of the
/// tolerance.
fn finely(stretch: &[Spot], dropper: &Dropper, tolerance_mm: f64) -> Vec<(Vec3, StepLimit)> {
    let fine = fine_mm(dropper);
    let Some(first) = stretch.first() else { return Vec::new() };
    let mut points: Vec<(Vec3, StepLimit)> = vec![(tip_at(first.at, first.tip.z, dropper), first.limit)];
    for two in stretch.windows(2) {
        let [a, b] = [two[0], two[1]];
        let parts = ((b.at[0] - a.at[0]).hypot(b.at[1] - a.at[1]) / fine).ceil().max(1.0) as usize;
        for part in 1..=parts {
            let t = part as f64 / parts as f64;
            let p = [0, 1].map(|axis| a.at[axis] + t * (b.at[axis] - a.at[axis]));
            let known = if t < 0.5 { &a } else { &b };
            let (from, to) = (points[points.len() - 1].0, tip_at(p, known.tip.z, dropper));
            let mut between = Vec::new();
            closer([from, to], dropper, SAMPLED * tolerance_mm, &mut between);
            between.push(to);
            points.extend(between.into_iter().map(|at| (at, known.limit)));
        }
    }
    points
}

/// The tip at a place, at the height `known_mm` off the surface.
fn tip_at(p: [f64; 2], known_mm: f64, dropper: &Dropper) -> Vec3 {
    Vec3::new(p[0], p[1], dropper.drop(p).map_or(known_mm, |contact| contact.tip_mm))
}

/// Points of the path between two of its points, by repeated halving, until it deviates from its chords by no more than
/// `within_mm`, or over an edge until they are as close together.
fn closer([from, to]: [Vec3; 2], dropper: &Dropper, within_mm: f64, out: &mut Vec<Vec3>) {
    let chord = 0.5 * (from + to);
    let middle = tip_at([chord.x, chord.y], chord.z, dropper);
    if (middle - chord).norm() <= within_mm || (to - from).xy().norm() <= within_mm {
        return;
    }
    closer([from, middle], dropper, within_mm, out);
    out.push(middle);
    closer([middle, to], dropper, within_mm, out);
}

/// Points of a pass of one height between the spots, so close that the curve deviates from its chords by less than
/// [`SAMPLED`] of the tolerance.
pub fn finely_level(stretch: &[Spot], level_mm: f64, dropper: &Dropper, tolerance_mm: f64) -> Vec<(Vec3, StepLimit)> {
    let fine = fine_mm(dropper);
    let place = |p: [f64; 2]| {
        let Some(contact) = dropper.drop(p) else { return Vec3::new(p[0], p[1], level_mm) };
        // Points stay at the level, so that arcs are level, unless they would cut into the surface by more than
        // rounding.
        let into_mm = (contact.tip_mm - level_mm) * contact.normal.z;
        Vec3::new(p[0], p[1], if into_mm > OFF_LEVEL * tolerance_mm { contact.tip_mm } else { level_mm })
    };
    let Some(first) = stretch.first() else { return Vec::new() };
    let mut points = vec![(place(first.at), first.limit)];
    for two in stretch.windows(2) {
        let ends = [two[0].at, two[1].at];
        let parts = ((ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]) / fine).ceil().max(1.0) as usize;
        let halves = (usize::BITS - (parts - 1).leading_zeros(), tolerance_mm);
        let mut between = Vec::new();
        halve(ends, (level_mm, dropper), halves, &mut between);
        between.push(ends[1]);
        let count = between.len();
        let limit = |k: usize| if 2 * k < count { two[0].limit } else { two[1].limit };
        points.extend(between.into_iter().enumerate().map(|(k, p)| (place(p), limit(k))));
    }
    points
}

/// Points of a level curve between two of its points, by repeated halving: `often` times, and further while the
/// deviation from the chord is more than [`SAMPLED`] of the tolerance, as in a corner.
fn halve(
    ends: [[f64; 2]; 2],
    (level_mm, dropper): (f64, &Dropper),
    (often, tolerance_mm): (u32, f64),
    out: &mut Vec<[f64; 2]>,
) {
    let [a, b] = ends;
    let apart = (b[0] - a[0]).hypot(b[1] - a[1]);
    let chord = [0, 1].map(|axis| 0.5 * (a[axis] + b[axis]));
    // Within half the chord, so that both halves are shorter than it and the halving ends.
    let Some(middle) = onto(dropper, chord, level_mm, 0.5 * apart) else { return };
    let bends = (middle[0] - chord[0]).hypot(middle[1] - chord[1]) > SAMPLED * tolerance_mm;
    if often == 0 && (!bends || apart < tolerance_mm) {
        return;
    }
    let next = (often.saturating_sub(1), tolerance_mm);
    halve([a, middle], (level_mm, dropper), next, out);
    out.push(middle);
    halve([middle, b], (level_mm, dropper), next, out);
}

/// Appends a stretch with the link to it and its leads.
fn put(steps: &mut Vec<Step>, line: &[Piece], (pass, feed): (u32, f64), dropper: &Dropper, drawing: &Drawing) {
    let ([first, second, ..], [.., before_last, last]) = (line, line) else { return };
    let radius = drawing.stock_mm + CLEAR_MM;
    let air = |to: Vec3| Step { to, via: None, feed_mm_s: Some(feed), of: None };
    let within_mm = SAMPLED * drawing.tolerance_mm;
    let mut lead_in = lead(first.to, tangent(first.to, second.via, second.to), radius, dropper, within_mm);
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
        |piece: &Piece| Step { to: piece.to, via: piece.via, feed_mm_s: Some(feed), of: Some((pass, piece.limit)) };
    steps.extend(line.iter().skip(1).map(piece));
    let back = tangent(last.to, last.via, before_last.to);
    steps.extend(lead(last.to, back, radius, dropper, within_mm).into_iter().skip(1).map(air));
}

/// Horizontal direction in which a line or an arc leaves its end `from`.
fn tangent(from: Vec3, via: Option<Vec3>, to: Vec3) -> Vec3 {
    // Inversion about the end maps the circle to the line through near/|near|² and far/|far|², parallel to the tangent.
    let Some(via) = via else { return direction(to - from) };
    let (near, far) = (via - from, to - from);
    direction(near / near.norm_squared().max(f64::MIN_POSITIVE) - far / far.norm_squared().max(f64::MIN_POSITIVE))
}

/// Horizontal unit vector.
fn direction(along: Vec3) -> Vec3 {
    let level = Vec3::new(along.x, along.y, 0.0);
    if level.norm() > 1e-12 { level.normalize() } else { Vec3::x() }
}

/// Quarter circle from an end of a pass, away from it and up, as lines; where it or one of its lines would be below the surface, lines along
/// the surface. Before a wall, which would take it higher than its own rise, it turns aside, first to the ground already cut, or back.
fn lead(end: Vec3, into: Vec3, radius: f64, dropper: &Dropper, within_mm: f64) -> Vec<Vec3> {
    let cut = if into.x > 0.0 { Vec3::new(into.y, -into.x, 0.0) } else { Vec3::new(-into.y, into.x, 0.0) };
    let ways = [into, -cut, cut, -into];
    let rises = |way: &Vec3| quarter(end, *way, radius).skip(1).all(|at| lifted(at, dropper).z - at.z <= radius);
    let way = ways.into_iter().find(rises).unwrap_or(into);
    let mut points = vec![end];
    for at in quarter(end, way, radius).skip(1) {
        let (from, to) = (points[points.len() - 1], lifted(at, dropper));
        cleared([from, to], dropper, within_mm, &mut points);
        points.push(to);
    }
    points
}

/// Points of a quarter circle from a place, against a horizontal direction and up.
fn quarter(end: Vec3, into: Vec3, radius: f64) -> impl Iterator<Item = Vec3> {
    (0..=LEAD_LINES).map(move |k| {
        let (sin, cos) = (std::f64::consts::FRAC_PI_2 * k as f64 / LEAD_LINES as f64).sin_cos();
        end - into * (radius * sin) + Vec3::z() * (radius * (1.0 - cos))
    })
}

/// A place, or the tip above it where it is below the surface.
fn lifted(at: Vec3, dropper: &Dropper) -> Vec3 {
    Vec3::new(at.x, at.y, at.z.max(tip_at([at.x, at.y], at.z, dropper).z))
}

/// Points on the surface between two points of a lead, by repeated halving, so that the lines between them are nowhere below it by more than
/// `within_mm`; over an edge until they are as close together.
fn cleared([from, to]: [Vec3; 2], dropper: &Dropper, within_mm: f64, out: &mut Vec<Vec3>) {
    let apart_mm = (to - from).xy().norm();
    if apart_mm <= within_mm {
        return;
    }
    let chord = 0.5 * (from + to);
    let rest = tip_at([chord.x, chord.y], chord.z, dropper);
    let is_below = rest.z > chord.z + within_mm;
    // A tool rolls over whatever stands up in a wider way than this, so that it cannot be missed.
    if !is_below && apart_mm <= fine_mm(dropper) {
        return;
    }
    let middle = if is_below { rest } else { chord };
    cleared([from, middle], dropper, within_mm, out);
    if is_below {
        out.push(middle);
    }
    cleared([middle, to], dropper, within_mm, out);
}

/// Spacing of points along a path, mm.
fn fine_mm(dropper: &Dropper) -> f64 {
    FINE_MM.min(0.1 * dropper.shape().radius_mm())
}

/// Highest tip of the tool on the surface between two places, mm.
fn over(from: Vec3, to: Vec3, dropper: &Dropper) -> f64 {
    let length = (to - from).xy().norm();
    let parts = (length / fine_mm(dropper)).ceil().max(1.0) as usize;
    let at = |k: usize| from + (to - from) * (k as f64 / parts as f64);
    let rests = (0..=parts).filter_map(|k| dropper.drop([at(k).x, at(k).y])).map(|contact| contact.tip_mm);
    rests.fold(f64::NEG_INFINITY, f64::max)
}
