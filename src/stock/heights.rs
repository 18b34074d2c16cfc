//! The heights that outlines leave, in lanes. In: an outline and how it moves. Out: the height at a point beside the track.
//!
//! With slope tan θ and ball radius R the lower envelope of a swept ball is z_c + u tan θ − √(R² − v²)/cos θ while the
//! contact lies on the line, and a sphere at its ends.

#![allow(clippy::inline_always)] // lanes are registers only where all is inlined

use super::wide::{Lanes, Which};
use pulp::Simd;

/// Heights an outline leaves at (u, v); infinite beside it.
pub trait Heights {
    /// May a cell of this height be lowered? Asked first, so it should cost less.
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

/// A flat bottom with a round corner.
pub struct BullSection {
    /// Radius of the flat bottom.
    pub flat: f32,
    /// Radius of the corner.
    pub corner: f32,
    /// Square of the radius of the whole.
    pub r2: f32,
}

impl Section for BullSection {
    #[inline(always)]
    fn at<S: Simd>(&self, square: Lanes<S>) -> Lanes<S> {
        let d = (square.sqrt() - self.flat).max(square.of(0.0));
        let left = square.of(self.corner * self.corner) - d * d;
        let height = square.of(self.corner) - left.max(square.of(0.0)).sqrt();
        square.at_most(square.of(self.r2)).pick(height, square.of(f32::INFINITY))
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
