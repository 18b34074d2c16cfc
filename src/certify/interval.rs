//! Intervals with outward rounding. In: doubles. Out: the same operations on enclosures: whatever the operands are within theirs, the
//! exact result is within that of the answer.
//!
//! Sums, products, quotients and roots of IEEE 754 are rounded to the nearest double, so one step outward holds them.

use std::f64::consts::PI;
use std::ops::{Add, Div, Mul, Sub};

/// An enclosure of a number.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Interval {
    /// Not above the number.
    pub lo: f64,
    /// Not below it.
    pub hi: f64,
}

impl Interval {
    /// A number that is exact.
    pub fn exact(x: f64) -> Self {
        Self { lo: x, hi: x }
    }
    /// A step outward.
    fn out(self) -> Self {
        Self { lo: self.lo.next_down(), hi: self.hi.next_up() }
    }
    /// Wider by this on both sides.
    pub fn widened(self, by: f64) -> Self {
        Self { lo: self.lo - by, hi: self.hi + by }.out()
    }
    /// Does it hold all of the other? Never where a bound is no number.
    pub fn holds(self, other: Self) -> bool {
        self.lo <= other.lo && other.hi <= self.hi
    }
    /// Its negative part cut off.
    pub fn not_negative(self) -> Self {
        Self { lo: self.lo.max(0.0), hi: self.hi.max(0.0) }
    }
    /// Square root of what is not negative in it.
    pub fn sqrt(self) -> Self {
        Self { lo: self.lo.max(0.0).sqrt(), hi: self.hi.max(0.0).sqrt() }.out().not_negative()
    }
    /// The circle's half turn.
    pub fn pi() -> Self {
        Self { lo: PI, hi: PI.next_up() }
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { lo: self.lo + other.lo, hi: self.hi + other.hi }.out()
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self { lo: self.lo - other.hi, hi: self.hi - other.lo }.out()
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let products = [self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi];
        let [lo, hi] =
            [f64::min, f64::max].map(|of: fn(f64, f64) -> f64| products.into_iter().reduce(of).unwrap_or(f64::NAN));
        Self { lo, hi }.out()
    }
}

impl Div for Interval {
    type Output = Self;
    /// Without bounds where the divisor may be 0.
    fn div(self, other: Self) -> Self {
        if other.lo <= 0.0 && other.hi >= 0.0 {
            return Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY };
        }
        self * Self { lo: 1.0 / other.hi, hi: 1.0 / other.lo }.out()
    }
}
