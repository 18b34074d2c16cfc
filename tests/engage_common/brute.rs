//! What a cutter meets, by brute force: every earlier move is asked how far a point lies from what it swept, and circles of
//! the cutter are walked along by that distance. In: moves as formulas ([`Way`]), a box of stock. Out: engaged intervals of a
//! circle, the removal area at a place, the volume of a stretch.
//!
//! A move swept a point at height z when somewhere on it the horizontal distance to the axis is at most ρ(z − tip), ρ being
//! the largest radius at or below that height. The difference of both, smallest over the move, changes by at most a
//! millimetre over a millimetre, so a walk by it misses nothing but what is shorter than [`STEP_MM`].
#![allow(dead_code)] // each test file uses its own part of it

use super::oracle::Mill;
use super::ways::{Sweep, Way};
use std::cell::Cell;
use std::f64::consts::{FRAC_PI_2, PI};

/// Distance at which a point counts as swept, mm.
const TOUCH_MM: f64 = 1e-7;
/// Shortest step along a circle, mm.
const STEP_MM: f64 = 0.02;
/// Distance within what was swept that need not be known better, mm.
const FAR_MM: f64 = 0.3;
/// Longest piece of an outline summed at once, mm along it.
const SIDE_MM: f64 = 1.5;

/// A ring of a cutter: radius, height above the tip, normal (outward, up), length along the outline.
#[derive(Debug, Clone, Copy)]
pub struct Ring {
    pub radius: f64,
    pub z: f64,
    pub normal: [f64; 2],
    pub edge: f64,
}

/// Stock and what was swept before a move and by it.
pub struct Scene<'a> {
    pub min: [f64; 3],
    pub max: [f64; 3],
    /// Earlier moves, in any order.
    pub before: Vec<&'a Sweep>,
    pub own: &'a Sweep,
    /// Horizontal unit direction that angles count from under a vertical feed.
    pub heading: [f64; 2],
}

/// A place of the cutter.
pub struct Place<'a> {
    min: [f64; 3],
    max: [f64; 3],
    tip: [f64; 3],
    /// Horizontal unit direction, horizontal and vertical part of the tangent.
    dir: [f64; 2],
    tangent: [f64; 2],
    mill: Mill,
    near: Vec<&'a Sweep>,
    /// What the move itself swept so far, where it turns.
    own: Option<Sweep>,
    /// The sweep met last: the next point is likely to be nearest to the same.
    first: Cell<usize>,
}

impl<'a> Scene<'a> {
    /// The cutter at a fraction of its move.
    pub fn place(&self, part: f64) -> Place<'a> {
        let (tip, tangent) = (self.own.way.point(part), self.own.way.tangent(part));
        let across = tangent[0].hypot(tangent[1]);
        let dir = if across > 1e-6 { [tangent[0] / across, tangent[1] / across] } else { self.heading };
        let r = self.own.mill.radius();
        let reaches = |sweep: &&&Sweep| {
            let [lo, hi] = sweep.bounds();
            (0..2).all(|k| tip[k] + r >= lo[k] && tip[k] - r <= hi[k])
        };
        let near = self.before.iter().filter(reaches).copied().collect();
        let own = matches!(self.own.way, Way::Turn(..)).then(|| Sweep::new(self.own.way.until(part), self.own.mill));
        let (min, max, mill) = (self.min, self.max, self.own.mill);
        Place { min, max, tip, dir, tangent: [across, tangent[2]], mill, near, own, first: Cell::new(0) }
    }
}

impl Place<'_> {
    /// Positive where there is material, mm; changes by at most 1 over a millimetre. Far within what was swept it is any
    /// distance that is safe.
    fn material(&self, q: [f64; 2], z: f64) -> f64 {
        let inside = |k: usize| (q[k] - self.min[k]).min(self.max[k] - q[k]);
        let mut left = inside(0).min(inside(1));
        let first = self.first.get();
        for k in std::iter::once(first).chain((0..self.near.len()).rev().filter(|k| *k != first)) {
            if left < -FAR_MM {
                return left;
            }
            let Some(sweep) = self.near.get(k).filter(|sweep| sweep.away(q) < left) else { continue };
            let margin = sweep.margin(q, z) - TOUCH_MM;
            if margin < left {
                left = margin;
                self.first.set(k);
            }
        }
        // Right at the cutter the sweep so far ends: only what lies within is gone.
        if let Some(own) = &self.own {
            left = left.min(own.margin(q, z - TOUCH_MM) + TOUCH_MM);
        }
        left
    }
    /// Half the angle over which a ring leads, about the feed.
    fn leads(&self, [normal_r, normal_z]: [f64; 2]) -> f64 {
        let (across, along) = (normal_r * self.tangent[0], normal_z * self.tangent[1]);
        if across < 1e-9 {
            return if along > 1e-9 { PI } else { 0.0 };
        }
        (-along / across).clamp(-1.0, 1.0).acos()
    }
    /// Engaged intervals of a ring, angles from the feed, counter-clockwise.
    pub fn engaged(&self, ring: &Ring) -> Vec<[f64; 2]> {
        let z = self.tip[2] + ring.z;
        let half = self.leads(ring.normal);
        if half <= 0.0 || z > self.max[2] || z < self.min[2] {
            return Vec::new();
        }
        let value = |beta: f64| {
            let (sin, cos) = beta.sin_cos();
            let (x, y) = (cos * self.dir[0] - sin * self.dir[1], cos * self.dir[1] + sin * self.dir[0]);
            self.material([self.tip[0] + ring.radius * x, self.tip[1] + ring.radius * y], z)
        };
        walk(&value, [-half, half], ring.radius.max(1e-3))
    }
    /// Volume per mm of path of an interval of a ring.
    pub fn width(&self, ring: &Ring, [from, to]: [f64; 2]) -> f64 {
        let turn = ring.normal[1] * self.tangent[1] * (to - from);
        ring.edge * ring.radius * (ring.normal[0] * self.tangent[0] * (to.sin() - from.sin()) + turn)
    }
    /// Volume per mm of path, mm²: over the outline, split at heights where engagement may jump and wherever it bends.
    pub fn area(&self) -> f64 {
        let top = self.max[2] - self.tip[2];
        let mut cuts: Vec<f64> = vec![top];
        cuts.extend(self.near.iter().flat_map(|sweep| sweep.heights).map(|z| z - self.tip[2]));
        cuts.sort_unstable_by(f64::total_cmp);
        let level = |piece: &Piece| matches!(piece, Piece::Line { z: [a, b], .. } if a == b);
        let pieces = pieces(self.mill).into_iter().filter(|piece| !level(piece) || self.tangent[1] < 0.0);
        pieces.map(|piece| self.area_of(&piece, &cuts, top)).sum()
    }
    fn area_of(&self, piece: &Piece, cuts: &[f64], top: f64) -> f64 {
        let width = |at: f64| {
            let ring = piece.ring(at / piece.length());
            [at, self.engaged(&ring).iter().map(|arc| self.width(&ring, *arc)).sum::<f64>()]
        };
        let mut sum = 0.0;
        for [from, to] in piece.parts(cuts, top) {
            let count = ((to - from) / piece.longest()).ceil().max(1.0);
            let at = |k: f64| from + LEAST_MM + (to - from - 2.0 * LEAST_MM) * k / count;
            let mut last = width(from + LEAST_MM);
            for k in 1..=count as usize {
                let next = width(at(k as f64));
                sum += integral(&width, [last, next]);
                last = next;
            }
        }
        sum
    }
}

/// Disagreement of Simpson's rule with the trapezoid at which a stretch of the outline is halved, mm², and the shortest.
const AGREE_MM2: f64 = 2e-3;
const LEAST_MM: f64 = 1e-6;

/// Sum of a function (argument, value) between two points.
fn integral(f: &impl Fn(f64) -> [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let length = b[0] - a[0];
    let middle = f(0.5 * (a[0] + b[0]));
    if (middle[1] - 0.5 * (a[1] + b[1])).abs() * length > AGREE_MM2 && length > LEAST_MM {
        return integral(f, [a, middle]) + integral(f, [middle, b]);
    }
    length * (a[1] + 4.0 * middle[1] + b[1]) / 6.0
}

/// Where a function is positive, walked along by its value.
fn walk(value: &impl Fn(f64) -> f64, [from, to]: [f64; 2], radius: f64) -> Vec<[f64; 2]> {
    let mut intervals = Vec::new();
    let (mut at, mut v) = (from, value(from));
    let mut open = (v > 0.0).then_some(from);
    while at < to {
        let next = (at + v.abs().max(STEP_MM).min(radius) / radius).min(to);
        let w = value(next);
        if (v > 0.0) != (w > 0.0) {
            let edge = crossing(value, [at, next], [v, w]);
            match open.take() {
                Some(begin) => intervals.push([begin, edge]),
                None => open = Some(edge),
            }
        }
        (at, v) = (next, w);
    }
    intervals.extend(open.map(|begin| [begin, to]));
    intervals
}

/// Where a function changes its sign.
fn crossing(value: &impl Fn(f64) -> f64, [mut a, mut b]: [f64; 2], [mut v, mut w]: [f64; 2]) -> f64 {
    for k in 0..60 {
        if b - a < 1e-9 {
            break;
        }
        let secant = a + (b - a) * v / (v - w);
        let middle = if k % 3 == 2 || !secant.is_finite() { 0.5 * (a + b) } else { secant.clamp(a, b) };
        let m = value(middle);
        if (m > 0.0) == (v > 0.0) {
            (a, v) = (middle, m);
            w *= if k % 3 == 1 { 0.5 } else { 1.0 };
        } else {
            (b, w) = (middle, m);
            v *= if k % 3 == 1 { 0.5 } else { 1.0 };
        }
    }
    0.5 * (a + b)
}

/// A piece of an outline (radius, height).
enum Piece {
    Line {
        r: [f64; 2],
        z: [f64; 2],
    },
    /// Centre, radius, angles from −π/2 (down) to 0 (outward).
    Fillet {
        centre: [f64; 2],
        radius: f64,
        angles: [f64; 2],
    },
}

const HIGH_MM: f64 = 1e3;

fn pieces(mill: Mill) -> Vec<Piece> {
    let bottom = |r: f64| Piece::Line { r: [0.0, r], z: [0.0; 2] };
    let side = |r: f64, z: f64| Piece::Line { r: [r; 2], z: [z, HIGH_MM] };
    let fillet = |centre: [f64; 2], radius: f64, to: f64| Piece::Fillet { centre, radius, angles: [-FRAC_PI_2, to] };
    let top = mill.lowest(mill.radius());
    match mill {
        Mill::Flat(r) => vec![bottom(r), side(r, 0.0)],
        Mill::Ball(r) => vec![fillet([0.0, r], r, 0.0), side(r, r)],
        Mill::Bull(r, c) => vec![bottom(r - c), fillet([r - c, c], c, 0.0), side(r, c)],
        Mill::Taper(r, tip, angle) => {
            let foot = [tip * angle.cos(), tip - tip * angle.sin()];
            let cone = Piece::Line { r: [foot[0], r], z: [foot[1], top] };
            vec![fillet([0.0, tip], tip, -angle), cone, side(r, top)]
        }
        Mill::Chamfer(r, tip, _) => {
            vec![bottom(tip), Piece::Line { r: [tip, r], z: [0.0, top] }, side(r, top)]
        }
    }
}

impl Piece {
    fn heights(&self) -> [f64; 2] {
        match self {
            Piece::Line { z, .. } => *z,
            Piece::Fillet { centre, radius, angles } => angles.map(|angle| centre[1] + radius * angle.sin()),
        }
    }
    /// Fraction of it at a height.
    fn part_at(&self, height: f64) -> f64 {
        match self {
            Piece::Line { z: [a, b], .. } => (height - a) / (b - a),
            Piece::Fillet { centre, radius, angles: [a, b] } => {
                let angle = ((height - centre[1]) / radius).clamp(-1.0, 1.0).asin();
                (angle - a) / (b - a)
            }
        }
    }
    fn length(&self) -> f64 {
        match self {
            Piece::Line { r, z } => (r[1] - r[0]).hypot(z[1] - z[0]),
            Piece::Fillet { radius, angles, .. } => radius * (angles[1] - angles[0]),
        }
    }
    /// A ring of unit edge at a fraction of it.
    fn ring(&self, t: f64) -> Ring {
        match self {
            Piece::Line { r, z } => {
                let (dr, dz) = (r[1] - r[0], z[1] - z[0]);
                let length = dr.hypot(dz);
                Ring { radius: r[0] + t * dr, z: z[0] + t * dz, normal: [dz / length, -dr / length], edge: 1.0 }
            }
            Piece::Fillet { centre, radius, angles } => {
                let (sin, cos) = (angles[0] + t * (angles[1] - angles[0])).sin_cos();
                Ring { radius: centre[0] + radius * cos, z: centre[1] + radius * sin, normal: [cos, sin], edge: 1.0 }
            }
        }
    }
    /// Its parts between the heights `cuts`, up to `top`, mm along it.
    fn parts(&self, cuts: &[f64], top: f64) -> Vec<[f64; 2]> {
        let [low, high] = self.heights();
        let mut ends = vec![0.0];
        if high > low {
            ends.extend(cuts.iter().filter(|cut| **cut > low && **cut < high.min(top)).map(|cut| self.part_at(*cut)));
            ends.push(self.part_at(high.min(top).max(low)));
        } else if low <= top {
            ends.push(1.0);
        }
        let length = self.length();
        ends.windows(2).map(|pair| [pair[0] * length, pair[1] * length]).filter(|[a, b]| b - a > 1e-5).collect()
    }
    /// Longest stretch looked at in one, mm.
    fn longest(&self) -> f64 {
        match self {
            Piece::Line { r, .. } if r[0] == r[1] => SIDE_MM,
            Piece::Line { .. } => 0.5,
            Piece::Fillet { radius, .. } => (0.25 * radius).max(0.15),
        }
    }
}

/// Longest stretch of a move looked at at both ends and in the middle only, mm.
const LOOK_MM: f64 = 0.6;

/// What was found along a stretch of a move.
#[derive(Debug, Clone, Default)]
pub struct Along {
    /// Fractions of the move with the removal areas there, in order.
    pub places: Vec<[f64; 2]>,
    /// Mean removal area.
    pub mean: f64,
    pub most: f64,
    pub least: f64,
}

/// The removal area along a stretch (fractions of the move), looked at ever closer where it bends.
pub fn along(scene: &Scene, [from, to]: [f64; 2], tolerance: f64) -> Along {
    let length = scene.own.way.length();
    let inset = (1e-5 / length).min(0.01 * (to - from));
    let (from, to) = (from + inset, to - inset);
    let count = (((to - from) * length / LOOK_MM).ceil() as usize).max(2);
    let at = |k: usize| from + (to - from) * k as f64 / count as f64;
    let area = |t: f64| scene.place(t).area();
    let mut found = Along { least: f64::INFINITY, ..Along::default() };
    let mut last = [from, area(from)];
    found.places.push(last);
    for k in 1..=count {
        let next = [at(k), area(at(k))];
        split(&area, [last, next], tolerance, 5e-3 / length, &mut found.places);
        found.places.push(next);
        last = next;
    }
    for place in &found.places {
        found.most = found.most.max(place[1]);
        found.least = found.least.min(place[1]);
    }
    let sum: f64 = found.places.windows(2).map(|two| 0.5 * (two[0][1] + two[1][1]) * (two[1][0] - two[0][0])).sum();
    found.mean = sum / (to - from).max(1e-12);
    found
}

fn split(area: &impl Fn(f64) -> f64, [a, b]: [[f64; 2]; 2], tolerance: f64, least: f64, out: &mut Vec<[f64; 2]>) {
    let t = 0.5 * (a[0] + b[0]);
    let middle = [t, area(t)];
    if b[0] - a[0] > least && (middle[1] - 0.5 * (a[1] + b[1])).abs() > tolerance {
        split(area, [a, middle], tolerance, least, out);
        out.push(middle);
        split(area, [middle, b], tolerance, least, out);
    } else {
        out.push(middle);
    }
}
