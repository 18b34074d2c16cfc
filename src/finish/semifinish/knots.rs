//! Points of the semi-finishing path that can be offset. In: its motions, which of its moves may be rewritten. Out: the
//! knots, and the curves with offsets.
//!
//! A straight move has a knot at its end; an arc has knots along it too, because the surface it leaves turns with it.
//! The offset of a knot is an amount along the normal there, interpolated linearly along the path. A line stays a line
//! between its offset ends. An arc stays an arc if the one through its offset start, middle and end follows the offset
//! path within the tolerance; otherwise it is replaced by chords.

use crate::nc::{MoveKind, Toolpath};
use crate::path::{Arc, Curve, Vec3};
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// Largest distance between knots on an arc, mm: the stock changes little over it.
const ALONG_MM: f64 = 2.0;
/// Points per knot interval at which an arc is compared with the offset path.
const LOOKS: usize = 8;

/// A point of the path.
#[derive(Debug, Clone, Copy)]
pub struct Knot {
    /// Its move.
    pub of: u32,
    /// Its place along the move, mm.
    pub s_mm: f64,
    /// Position of the tip there, mm.
    pub at: Vec3,
    /// May it be offset?
    pub free: bool,
}

/// The path with its knots. Knot 0 is the start of the first move.
#[derive(Debug, Clone)]
pub struct Knots {
    /// In order along the path.
    pub list: Vec<Knot>,
    /// Knots of each move, the last at its end; it starts at the knot before them.
    pub of_move: Vec<Range<u32>>,
}

impl Knots {
    /// Knots of a toolpath; `movable`: may the coordinates of each move be rewritten? The end of a move is fixed if the
    /// feed move after it may not be rewritten, as that would start elsewhere.
    pub fn new(path: &Toolpath, movable: &[bool]) -> Self {
        let start = path.moves.first().map_or_else(Vec3::zeros, |motion| motion.curve().from());
        let mut knots = Self {
            list: vec![Knot { of: 0, s_mm: 0.0, at: start, free: false }],
            of_move: Vec::with_capacity(movable.len()),
        };
        for (index, motion) in path.moves.iter().enumerate() {
            let curve = motion.curve();
            let length = curve.length();
            let parts = match curve {
                Curve::Arc(_) if movable[index] => (length / ALONG_MM).ceil().max(2.0),
                _ => 1.0,
            };
            let behind = path.moves.get(index + 1);
            let stays = behind.is_some_and(|next| next.kind == MoveKind::Feed && !movable[index + 1]);
            let first = knots.list.len() as u32;
            for part in 1..=parts as usize {
                let s_mm = length * part as f64 / parts;
                let free = movable[index] && !(stays && part == parts as usize);
                knots.list.push(Knot { of: index as u32, s_mm, at: curve.point(s_mm), free });
            }
            knots.of_move.push(first..knots.list.len() as u32);
        }
        knots
    }

    /// The knots before and after a place on a move, and the interpolation weight of the second.
    pub fn around(&self, of: u32, s_mm: f64) -> ([u32; 2], f64) {
        let range = self.of_move[of as usize].clone();
        let on = &self.list[range.start as usize..range.end as usize];
        let behind = range.start + (on.partition_point(|knot| knot.s_mm < s_mm) as u32).min(range.len() as u32 - 1);
        let from = if behind == range.start { 0.0 } else { self.list[behind as usize - 1].s_mm };
        let length = self.list[behind as usize].s_mm - from;
        let share = if length > 0.0 { ((s_mm - from) / length).clamp(0.0, 1.0) } else { 1.0 };
        ([behind - 1, behind], share)
    }

    /// The curves that replace a move, each with its part of the move (mm along it). `offsets`: a vector for every
    /// knot.
    pub fn moved(&self, curve: &Curve, of: usize, offsets: &[Vec3], tolerance_mm: f64) -> Vec<(Curve, [f64; 2])> {
        let range = self.of_move[of].clone();
        let own = &offsets[range.start as usize - 1..range.end as usize];
        let whole = [0.0, curve.length()];
        let (from, to) = (own[0], own[own.len() - 1]);
        match curve {
            _ if own.iter().all(|offset| *offset == Vec3::zeros()) => vec![(*curve, whole)],
            Curve::Line { from: a, to: b } => vec![(Curve::Line { from: a + from, to: b + to }, whole)],
            Curve::Arc(arc) => {
                let places: Vec<f64> = self.places(of, whole[1]);
                let at = |s_mm: f64| curve.point(s_mm) + self.offset(of as u32, s_mm, offsets);
                let points: Vec<Vec3> = places.iter().map(|s_mm| at(*s_mm)).collect();
                if let Some(arc) = still_arc(arc, &points, tolerance_mm) {
                    return vec![(Curve::Arc(arc), whole)];
                }
                let kept = chords(&points, tolerance_mm);
                let piece = |two: &[usize]| {
                    let [a, b] = [two[0], two[1]];
                    (Curve::Line { from: points[a], to: points[b] }, [places[a], places[b]])
                };
                kept.windows(2).map(piece).collect()
            }
        }
    }

    /// The offset at a place on a move.
    pub fn offset(&self, of: u32, s_mm: f64, offsets: &[Vec3]) -> Vec3 {
        let ([a, b], share) = self.around(of, s_mm);
        let [a, b] = [a, b].map(|knot| offsets[knot as usize]);
        // The amount is interpolated linearly; the direction turns from one normal to the other.
        let turned = a + (b - a) * share;
        let amount = a.norm() + (b.norm() - a.norm()) * share;
        if a.dot(&b) > 0.0 { turned.try_normalize(0.0).map_or(turned, |along| along * amount) } else { turned }
    }

    fn places(&self, of: usize, length_mm: f64) -> Vec<f64> {
        let count = LOOKS * self.of_move[of].len();
        (0..=count).map(|k| length_mm * k as f64 / count as f64).collect()
    }
}

/// The arc through the first, middle and last of the points, in the plane of another arc; `None` if it is not within
/// the tolerance of all points.
fn still_arc(arc: &Arc, points: &[Vec3], tolerance_mm: f64) -> Option<Arc> {
    let (a, b, normal) = arc.plane.axes();
    let flat = |point: &Vec3| [point[a], point[b]];
    let [first, middle, last] = [0, points.len() / 2, points.len() - 1].map(|k| &points[k]);
    if arc.sweep_rad.abs() > TAU - 0.1 {
        return None;
    }
    let [u, v] = circumcentre(flat(first), flat(middle), flat(last))?;
    let mut centre = arc.centre;
    (centre[a], centre[b], centre[normal]) = (u, v, first[normal]);
    let angle = |point: &Vec3| (point[b] - v).atan2(point[a] - u);
    let turn = (angle(last) - angle(first)).rem_euclid(TAU);
    let sweep = if arc.sweep_rad > 0.0 { turn } else { turn - TAU };
    if (sweep - arc.sweep_rad).abs() > 0.5 * PI.min(arc.sweep_rad.abs()) {
        return None;
    }
    let found = Arc::new(arc.plane, *first, *last, centre, sweep);
    let curve = Curve::Arc(found);
    let count = points.len() - 1;
    let off = |(k, point): (usize, &Vec3)| (curve.point(curve.length() * k as f64 / count as f64) - point).norm();
    // With changing amounts points also move along the arc, which is no deviation of the path.
    let across = |k: usize, point: &Vec3| {
        let s_mm = curve.length() * k as f64 / count as f64;
        let (away, along) = (curve.point(s_mm) - point, curve.tangent(s_mm));
        (away - along * away.dot(&along)).norm()
    };
    let fits = points.iter().enumerate().all(|(k, point)| across(k, point) <= tolerance_mm && off((k, point)) < 0.1);
    fits.then_some(found)
}

fn circumcentre(p: [f64; 2], q: [f64; 2], r: [f64; 2]) -> Option<[f64; 2]> {
    let ([bx, by], [cx, cy]) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
    let d = 2.0 * (bx * cy - by * cx);
    let (bb, cc) = (bx * bx + by * by, cx * cx + cy * cy);
    let centre = [p[0] + (cy * bb - by * cc) / d, p[1] + (bx * cc - cx * bb) / d];
    (d.abs() > 1e-12 && centre.iter().all(|x| x.is_finite())).then_some(centre)
}

/// Indices of the points joined by chords that are within the tolerance of all points.
fn chords(points: &[Vec3], tolerance_mm: f64) -> Vec<usize> {
    let mut kept = vec![0];
    let mut from = 0;
    while from + 1 < points.len() {
        let within = |to: usize| {
            let (a, along) = (points[from], points[to] - points[from]);
            let square = along.norm_squared().max(f64::MIN_POSITIVE);
            points[from + 1..to].iter().all(|point| {
                let t = ((point - a).dot(&along) / square).clamp(0.0, 1.0);
                (point - a - along * t).norm() <= tolerance_mm
            })
        };
        let mut to = from + 1;
        while to + 1 < points.len() && within(to + 1) {
            to += 1;
        }
        kept.push(to);
        from = to;
    }
    kept
}
