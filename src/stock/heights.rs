//! The heights that moving cutters leave, for several cells at once. In: an outline and its track. Out: the height at a point beside the
//! track, mm.
//!
//! With slope tan θ and ball radius R the lower envelope of a swept ball is z_c + u tan θ − √(R² − v²)/cos θ while the
//! contact lies on the line, and a sphere at its ends.
//!
//! A convex outline h(d), rising with the distance d from its axis, leaves at v the minimum over w = u − t of t tan θ + h(√(w² + v²)). This is
//! convex in w, with its minimum where the slope of the outline along the path equals that of the path, h′(d) w/d = tan θ; the minimum is
//! clamped to the ends of the line. h′(d) w/d rises with w, so the parts of the outline are tried from the axis outward until one contains
//! the minimum. With m = |tan θ|:
//!
//! ```text
//! cone of slope k        w = |v| m/√(k² − m²), beyond its end where k ≤ m
//! corner of radius c about f from the axis, p the sine of the angle between axis and normal (so d = f + c p, cos ψ = w/d)
//!       p cos ψ = m √(1 − p²)   ⟹   E(p) = (f + c p)² ((1 + m²) p² − m²) − v² p² = 0
//! ```
//! E rises through its one root from max(sin θ, (v − f)/c) to 1. The height is least at that place, so an error of w counts by
//! its square: four steps of Newton's method leave no more than the rounding.

#![allow(clippy::inline_always)] // lanes are registers only where all is inlined

use super::form::{Bow, Part};
use super::wide::{Lanes, Which};
use pulp::Simd;

/// Heights an outline leaves at (u, v); infinite beside it.
pub trait Heights {
    /// May a cell of this height be lowered? A test before [`Self::height`], and cheaper.
    #[inline(always)]
    fn may<S: Simd>(&self, u: Lanes<S>, _v: Lanes<S>, _cell: Lanes<S>) -> Which<S> {
        u.is(u)
    }
    /// The height.
    fn height<S: Simd>(&self, u: Lanes<S>, v: Lanes<S>) -> Lanes<S>;
}

/// A level track in the plane.
pub trait Way {
    /// Square of the distance of (u, v) from it.
    fn square<S: Simd>(&self, u: Lanes<S>, v: Lanes<S>) -> Lanes<S>;
}

/// Heights of an outline above its tip, by the square of the distance from its axis; infinite beyond it.
pub trait Section {
    /// The height.
    fn at<S: Simd>(&self, square: Lanes<S>) -> Lanes<S>;
}

/// An outline moving level with its tip at `z`.
pub struct Level<W, T> {
    /// Its track.
    pub way: W,
    /// Its outline.
    pub section: T,
    /// Height of its tip, mm.
    pub z: f32,
}

impl<W: Way, T: Section> Heights for Level<W, T> {
    #[inline(always)]
    fn height<S: Simd>(&self, u: Lanes<S>, v: Lanes<S>) -> Lanes<S> {
        self.section.at(self.way.square(u, v)) + self.z
    }
}

/// A line of this length from the origin along u.
pub struct Straight(pub f32);

impl Way for Straight {
    #[inline(always)]
    fn square<S: Simd>(&self, u: Lanes<S>, v: Lanes<S>) -> Lanes<S> {
        let du = u - u.max(u.of(0.0)).min(u.of(self.0));
        du * du + v * v
    }
}

/// An arc about the origin.
pub struct Round {
    radius: f32,
    /// Unit vectors to start and end, ordered counter-clockwise.
    first: [f32; 2],
    last: [f32; 2],
    angle: f64,
}

impl Round {
    /// Of this radius, from an angle on.
    pub fn new(radius: f64, start: f64, sweep: f64) -> Self {
        let (a, b) = if sweep >= 0.0 { (start, start + sweep) } else { (start + sweep, start) };
        let unit = |angle: f64| [angle.cos() as f32, angle.sin() as f32];
        Self { radius: radius as f32, first: unit(a), last: unit(b), angle: sweep.abs() }
    }
    #[inline(always)]
    fn to_end<S: Simd>(&self, [x, y]: [f32; 2], u: Lanes<S>, v: Lanes<S>) -> Lanes<S> {
        let (du, dv) = (u - self.radius * x, v - self.radius * y);
        du * du + dv * dv
    }
}

impl Way for Round {
    #[inline(always)]
    fn square<S: Simd>(&self, u: Lanes<S>, v: Lanes<S>) -> Lanes<S> {
        let off = (u * u + v * v).sqrt() - self.radius;
        if self.angle >= std::f64::consts::TAU {
            return off * off;
        }
        let zero = u.of(0.0);
        let after = zero.at_most(v * self.first[0] - u * self.first[1]);
        let before = zero.at_most(u * self.last[1] - v * self.last[0]);
        let within = if self.angle <= std::f64::consts::PI { after & before } else { after | before };
        within.pick(off * off, self.to_end(self.first, u, v).min(self.to_end(self.last, u, v)))
    }
}

/// A flat bottom, by the square of its radius.
pub struct FlatSection(pub f32);

impl Section for FlatSection {
    #[inline(always)]
    fn at<S: Simd>(&self, square: Lanes<S>) -> Lanes<S> {
        square.at_most(square.of(self.0)).pick(square.of(0.0), square.of(f32::INFINITY))
    }
}

/// A ball of this radius.
pub struct BallSection(pub f32);

impl Section for BallSection {
    #[inline(always)]
    fn at<S: Simd>(&self, square: Lanes<S>) -> Lanes<S> {
        let left = square.of(self.0 * self.0) - square;
        let height = square.of(self.0) - left.max(square.of(0.0)).sqrt();
        square.of(0.0).at_most(left).pick(height, square.of(f32::INFINITY))
    }
}

/// A bulging outline: its parts from the axis outward, and the square of its radius.
#[derive(Clone, Copy)]
pub struct Bulging<'a> {
    /// Its parts.
    pub parts: &'a [Part],
    /// Square of its radius.
    pub r2: f32,
}

impl Bulging<'_> {
    /// Height above the tip at a distance no larger than its radius.
    #[inline(always)]
    fn height_at<S: Simd>(self, d: Lanes<S>) -> Lanes<S> {
        let mut height = d.of(0.0);
        for Part { from, to, bow } in self.parts {
            let at = d.max(d.of(*from)).min(d.of(*to));
            let of_part = match bow {
                Bow::Cone { low, slope } => (at - *from) * *slope + *low,
                Bow::Corner { centre: [middle, up], radius, .. } => {
                    let off = at - *middle;
                    d.of(*up) - (d.of(radius * radius) - off * off).max(d.of(0.0)).sqrt()
                }
            };
            height = d.of(*from).at_most(d).pick(of_part, height);
        }
        height
    }
}

impl Section for Bulging<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, square: Lanes<S>) -> Lanes<S> {
        square.at_most(square.of(self.r2)).pick(self.height_at(square.sqrt()), square.of(f32::INFINITY))
    }
}

/// A flat bottom on a ramp.
pub struct Ramp {
    /// Its length.
    pub run: f32,
    /// Height of its tip at the start.
    pub z: f32,
    /// Square of its radius.
    pub r2: f32,
    /// Rise over length.
    pub slope: f32,
}

impl Heights for Ramp {
    #[inline(always)]
    fn height<S: Simd>(&self, u: Lanes<S>, v: Lanes<S>) -> Lanes<S> {
        let (zero, run, r2) = (u.of(0.0), u.of(self.run), u.of(self.r2));
        let s = (r2 - v * v).max(zero).sqrt();
        let lowest = if self.slope < 0.0 { (u + s).min(run) } else { (u - s).max(zero) };
        let inside = (v * v).at_most(r2) & zero.at_most(u + s) & (u - s).at_most(run);
        inside.pick(lowest * self.slope + self.z, u.of(f32::INFINITY))
    }
}

/// A ball on any line.
pub struct Ball {
    /// Its length.
    pub run: f32,
    /// Height of its centre at the start.
    pub centre: f32,
    /// Square of its radius.
    pub r2: f32,
    /// Rise over length.
    pub slope: f32,
    /// Sine of the rise.
    pub sin: f32,
    /// Its cosine, and one over that.
    pub cos: f32,
    /// See `cos`.
    pub inv_cos: f32,
}

impl Heights for Ball {
    /// The endless sweep lies no higher: a cell below it stays. Asked without a root.
    #[inline(always)]
    fn may<S: Simd>(&self, u: Lanes<S>, v: Lanes<S>, cell: Lanes<S>) -> Which<S> {
        let below = ((u * self.slope + self.centre - cell) * self.cos).max(u.of(0.0));
        (below * below).at_most(u.of(self.r2 + 1e-5 * self.r2) - v * v)
    }
    #[inline(always)]
    fn height<S: Simd>(&self, u: Lanes<S>, v: Lanes<S>) -> Lanes<S> {
        let zero = u.of(0.0);
        let across = u.of(self.r2) - v * v;
        let s = across.max(zero).sqrt();
        let contact = u - s * self.sin;
        let end = contact.max(zero).min(u.of(self.run));
        let du = u - end;
        let left = across - du * du;
        let on_end = end * self.slope + self.centre - left.max(zero).sqrt();
        let on_line = u * self.slope + self.centre - s * self.inv_cos;
        let touches = contact.is(end);
        let inside = zero.at_most(across) & (touches | zero.at_most(left));
        inside.pick(touches.pick(on_line, on_end), u.of(f32::INFINITY))
    }
}

/// A bulging outline on a ramp.
pub struct BulgingRamp<'a> {
    outline: Bulging<'a>,
    line: [f32; 2],
    z: f32,
    /// Rise over length, its size m, 1 + m², m/√(1 + m²), and the third root of m².
    slope: f32,
    steep: f32,
    length2: f32,
    sin: f32,
    third: f32,
}

/// Steps of Newton's method for the place where a corner touches.
const STEPS: usize = 4;
/// Margin for rounding when testing whether a cell may be lowered, mm.
const ROUNDING_MM: f32 = 1e-4;

impl<'a> BulgingRamp<'a> {
    /// Along a line of this length in the plane that begins at height `z` and rises by `rise`.
    pub fn new([run, z, rise]: [f32; 3], outline: Bulging<'a>) -> Self {
        let slope = rise / run;
        let steep = slope.abs();
        let length2 = 1.0 + steep * steep;
        let (sin, third) = (steep / length2.sqrt(), (steep * steep).cbrt());
        Self { outline, line: [run, rise], z, slope, steep, length2, sin, third }
    }
    /// How far ahead of its axis (behind, where it falls) it touches what it leaves at v, on a line without ends.
    #[inline(always)]
    fn ahead<S: Simd>(&self, v: Lanes<S>) -> Lanes<S> {
        let (zero, v2) = (v.of(0.0), v * v);
        let (mut ahead, mut end) = (zero, zero);
        for Part { from, to, bow } in self.outline.parts {
            // The place goes on into this part where it lies at the end of the one before.
            let goes_on = end.at_most(ahead);
            let begin = end;
            end = (v.of(to * to) - v2).max(zero).sqrt();
            let place = match bow {
                Bow::Cone { slope, .. } if *slope <= self.steep => end,
                Bow::Cone { slope, .. } => {
                    v.abs() * (self.steep / ((slope - self.steep) * (slope + self.steep)).sqrt())
                }
                Bow::Corner { centre: [middle, _], radius, about } => {
                    self.at_corner(v, [*middle, *radius, about * self.third], [*from, *to])
                }
            };
            ahead = goes_on.pick(place.max(begin).min(end), ahead);
        }
        ahead * self.slope.signum()
    }
    /// The same for a corner between two distances from the axis; `about` is where p begins about v = f.
    #[inline(always)]
    fn at_corner<S: Simd>(&self, v: Lanes<S>, [flat, corner, about]: [f32; 3], [from, to]: [f32; 2]) -> Lanes<S> {
        let zero = v.of(0.0);
        let (v2, m2) = (v * v, self.steep * self.steep);
        let beyond = ((v.abs() - flat) / v.of(corner)).max(v.of((from - flat) / corner)).max(zero);
        let (lowest, highest) = (beyond.max(v.of(self.sin)), v.of((to - flat) / corner));
        // As if the corner had no radius (far beyond where it begins beside the flat), and as if there were no flat.
        let no_corner =
            v.of((self.steep * flat).max(1e-6)) / (v.of(flat * flat * self.length2) - v2).max(v.of(1e-12)).sqrt();
        let no_flat = ((beyond * beyond + m2) / v.of(self.length2)).sqrt();
        let mut p = no_corner.min((beyond + about).max(no_flat)).max(lowest).min(highest);
        for _ in 0..STEPS {
            let (d, p2) = (p * corner + flat, p * p);
            let b = p2 * self.length2 - m2;
            let value = d * d * b - v2 * p2;
            let per_p = (d * (b * corner + d * p * self.length2) - v2 * p) * 2.0;
            p = (p - value / per_p.max(v.of(1e-12))).max(lowest).min(highest);
        }
        let d = p * corner + flat;
        (d * d - v2).max(zero).sqrt()
    }
}

impl Heights for BulgingRamp<'_> {
    /// Not below the outline at the nearest place of the line, at the lowest height that the tip has within reach.
    #[inline(always)]
    fn may<S: Simd>(&self, u: Lanes<S>, v: Lanes<S>, cell: Lanes<S>) -> Which<S> {
        let square = Straight(self.line[0]).square(u, v);
        let lowest =
            (u * self.slope + (self.z - self.steep * self.outline.r2.sqrt())).max(u.of(self.z + self.line[1].min(0.0)));
        square.at_most(u.of(self.outline.r2))
            & (lowest + self.outline.height_at(square.sqrt()) - ROUNDING_MM).below(cell)
    }
    #[inline(always)]
    fn height<S: Simd>(&self, u: Lanes<S>, v: Lanes<S>) -> Lanes<S> {
        let along = (u - self.ahead(v)).max(u.of(0.0)).min(u.of(self.line[0]));
        let du = u - along;
        let height = along * self.slope + self.z + self.outline.height_at((du * du + v * v).sqrt());
        let within = Straight(self.line[0]).square(u, v).at_most(u.of(self.outline.r2));
        within.pick(height, u.of(f32::INFINITY))
    }
}
