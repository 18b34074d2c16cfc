//! Moves as formulas and what they sweep. In: a line or a rising arc, a mill. Out: places and directions on it, and how far a
//! point lies from what was swept.
#![allow(dead_code)] // each test file uses its own part of it

use super::oracle::Mill;
use std::f64::consts::TAU;

/// Where the tip goes: a straight line, or an arc in XY that rises evenly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    Line([f64; 3], [f64; 3]),
    /// Centre, radius, start, sweep, height at the start, rise.
    Turn([f64; 2], f64, f64, f64, f64, f64),
}

/// A move: where it goes and with what.
#[derive(Debug, Clone, Copy)]
pub struct Sweep {
    pub way: Way,
    pub mill: Mill,
    /// Lowest and highest place of its tip, and a box of the plane that it may have swept.
    pub heights: [f64; 2],
    bounds: [[f64; 2]; 2],
}

impl Way {
    pub fn length(&self) -> f64 {
        match *self {
            Way::Line(a, b) => (0..3).map(|k| (b[k] - a[k]).powi(2)).sum::<f64>().sqrt(),
            Way::Turn(_, radius, _, sweep, _, rise) => (radius * sweep).hypot(rise),
        }
    }
    pub fn point(&self, part: f64) -> [f64; 3] {
        match *self {
            Way::Line(a, b) => [0, 1, 2].map(|k| a[k] + part * (b[k] - a[k])),
            Way::Turn(c, radius, start, sweep, z, rise) => {
                let (sin, cos) = (start + part * sweep).sin_cos();
                [c[0] + radius * cos, c[1] + radius * sin, z + part * rise]
            }
        }
    }
    /// Unit direction.
    pub fn tangent(&self, part: f64) -> [f64; 3] {
        let length = self.length().max(1e-12);
        match *self {
            Way::Line(a, b) => [0, 1, 2].map(|k| (b[k] - a[k]) / length),
            Way::Turn(_, radius, start, sweep, _, rise) => {
                let (sin, cos) = (start + part * sweep).sin_cos();
                [-radius * sweep * sin / length, radius * sweep * cos / length, rise / length]
            }
        }
    }
    /// Its beginning.
    pub fn until(&self, part: f64) -> Self {
        match *self {
            Way::Line(a, _) => Way::Line(a, self.point(part)),
            Way::Turn(c, radius, start, sweep, z, rise) => Way::Turn(c, radius, start, part * sweep, z, part * rise),
        }
    }
    pub fn heights(&self) -> [f64; 2] {
        let (a, b) = (self.point(0.0)[2], self.point(1.0)[2]);
        [a.min(b), a.max(b)]
    }
    /// Distance of a point in the plane from the part of the way between two fractions.
    fn aside(&self, q: [f64; 2], [t0, t1]: [f64; 2]) -> f64 {
        match *self {
            Way::Line(a, b) => {
                let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
                let square = dx * dx + dy * dy;
                let t = if square > 0.0 { ((q[0] - a[0]) * dx + (q[1] - a[1]) * dy) / square } else { t0 };
                let t = t.clamp(t0, t1);
                far(q[0] - a[0] - t * dx, q[1] - a[1] - t * dy)
            }
            Way::Turn(c, radius, start, sweep, ..) => {
                let (x, y) = (q[0] - c[0], q[1] - c[1]);
                let first = start + t0 * sweep;
                let ahead = ((y.atan2(x) - first) * sweep.signum()).rem_euclid(TAU);
                if ahead <= (t1 - t0) * sweep.abs() {
                    return (far(x, y) - radius).abs();
                }
                let end = |t: f64| {
                    let (sin, cos) = (start + t * sweep).sin_cos();
                    far(x - radius * cos, y - radius * sin)
                };
                end(t0).min(end(t1))
            }
        }
    }
    /// The part of it that runs at most as high as `z`.
    fn below(&self, z: f64) -> Option<[f64; 2]> {
        let (a, b) = (self.point(0.0)[2], self.point(1.0)[2]);
        if a.min(b) > z + 1e-9 {
            return None;
        }
        if a.max(b) <= z {
            return Some([0.0, 1.0]);
        }
        let t = if (b - a).abs() < 1e-9 { 1.0 } else { ((z - a) / (b - a)).clamp(0.0, 1.0) };
        Some(if b >= a { [0.0, t] } else { [t, 1.0] })
    }
}

/// Length of a vector of the plane.
fn far(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// Largest radius of a cutter at or below a height above its tip.
pub fn widest(mill: Mill, zeta: f64) -> f64 {
    let zeta = zeta.max(0.0);
    let fillet = |corner: f64| if zeta < corner { (zeta * (2.0 * corner - zeta)).sqrt() } else { corner };
    match mill {
        Mill::Flat(r) => r,
        Mill::Ball(r) => fillet(r),
        Mill::Bull(r, corner) => r - corner + fillet(corner),
        Mill::Taper(r, tip, side) => {
            let foot = tip - tip * side.sin();
            if zeta < foot { fillet(tip) } else { (tip * side.cos() + (zeta - foot) * side.tan()).min(r) }
        }
        Mill::Chamfer(r, tip, side) => (tip + zeta * side.tan()).min(r),
    }
}

/// Least of a function that sinks and then rises.
fn least(f: impl Fn(f64) -> f64, [mut a, mut b]: [f64; 2]) -> f64 {
    const SHARE: f64 = 0.618_033_988_749_895;
    let ends = f(a).min(f(b));
    let (mut c, mut d) = (b - SHARE * (b - a), a + SHARE * (b - a));
    let (mut fc, mut fd) = (f(c), f(d));
    for _ in 0..30 {
        if fc < fd {
            (b, d, fd) = (d, c, fc);
            c = b - SHARE * (b - a);
            fc = f(c);
        } else {
            (a, c, fc) = (c, d, fd);
            d = a + SHARE * (b - a);
            fd = f(d);
        }
    }
    fc.min(fd).min(ends)
}

impl Sweep {
    pub fn new(way: Way, mill: Mill) -> Self {
        let r = mill.radius();
        let bounds = match way {
            Way::Line(a, b) => [[0, 1].map(|k| a[k].min(b[k]) - r), [0, 1].map(|k| a[k].max(b[k]) + r)],
            Way::Turn(c, radius, ..) => [c.map(|x| x - radius - r), c.map(|x| x + radius + r)],
        };
        Self { way, mill, heights: way.heights(), bounds }
    }
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        self.bounds
    }
    /// No more than the distance of a point from what was swept.
    pub fn away(&self, q: [f64; 2]) -> f64 {
        let [lo, hi] = self.bounds;
        (lo[0] - q[0]).max(q[0] - hi[0]).max(lo[1] - q[1]).max(q[1] - hi[1])
    }
    /// Distance of a point (in its plane) from what was swept, negative within; for a ball on a slope that in space.
    pub fn margin(&self, q: [f64; 2], z: f64) -> f64 {
        let [low, high] = self.heights;
        if z < low - 1e-9 {
            return f64::INFINITY;
        }
        if high - low < 1e-9 {
            return self.way.aside(q, [0.0, 1.0]) - widest(self.mill, z - low);
        }
        let Some(part) = self.way.below(z) else { return f64::INFINITY };
        let r = self.mill.radius();
        let aside = self.way.aside(q, part);
        if matches!(self.mill, Mill::Flat(_)) || aside > r + 1.0 {
            return aside - r;
        }
        match (self.way, self.mill) {
            (Way::Line(a, b), _) if far(a[0] - b[0], a[1] - b[1]) < 1e-12 => aside - widest(self.mill, z - low),
            (Way::Line(a, b), Mill::Ball(_)) => {
                let d = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
                let p = [q[0] - a[0], q[1] - a[1], z - a[2] - r];
                let dot = |u: [f64; 3], v: [f64; 3]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
                let t = (dot(p, d) / dot(d, d)).clamp(0.0, 1.0);
                let off = [0, 1, 2].map(|k| p[k] - t * d[k]);
                let ball = dot(off, off).sqrt() - r;
                self.way.below(z - r).map_or(ball, |part| ball.min(self.way.aside(q, part) - r))
            }
            (Way::Line(..), _) => least(|t| self.margin_at(t, q, z), part),
            (Way::Turn(..), _) => self.margin_of_turn(q, z, part),
        }
    }
    fn margin_at(&self, t: f64, q: [f64; 2], z: f64) -> f64 {
        let p = self.way.point(t);
        far(q[0] - p[0], q[1] - p[1]) - widest(self.mill, z - p[2])
    }
    fn margin_of_turn(&self, q: [f64; 2], z: f64, [t0, t1]: [f64; 2]) -> f64 {
        let Way::Turn(_, _, _, sweep, ..) = self.way else { return f64::INFINITY };
        let count = ((t1 - t0) * sweep.abs() / 0.15).ceil().max(2.0) as usize;
        let at = |k: usize| t0 + (t1 - t0) * k as f64 / count as f64;
        let values: Vec<f64> = (0..=count).map(|k| self.margin_at(at(k), q, z)).collect();
        let best = values.iter().copied().fold(f64::INFINITY, f64::min);
        let near = |k: &usize| {
            let sinks = *k == 0 || values[k - 1] >= values[*k];
            sinks && (*k == count || values[k + 1] >= values[*k]) && values[*k] < best + 0.1
        };
        let around = |k: usize| [at(k.saturating_sub(1)), at((k + 1).min(count))];
        (0..=count).filter(near).map(|k| least(|t| self.margin_at(t, q, z), around(k))).fold(best, f64::min)
    }
}
