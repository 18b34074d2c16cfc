//! Upper bound of the tip height of a tool that rests on triangles, from a plane above them and the rectangle that they cover, one side of
//! which runs uphill on that plane. In: triangles, tool shape. Out: the bound at a place.
//!
//! With g the slope of the plane, s and t the distances from the axis uphill and across, ρ = √(s² + t²) and h the lower side of the tool
//! ([`touch`](super::touch)), the tip above the plane under the axis is at most the maximum of F = g·s − h(ρ) over the rectangle. Without the
//! rectangle the maximum is r(√(1 + g²) − 1) + a·g =: *lift*, at s = ρ* = a + r·g/√(1 + g²), t = 0. Within it:
//!
//! * h ≥ 0, so F ≤ g·s₁, s₁ being the largest s.
//! * For a ball (a = 0) F is concave with second derivatives of at most −1/r: F ≤ lift − d²/2r at the distance d of the rectangle from that
//!   point.
//! * Otherwise, with T the least |t|: ρ − s = t²/(ρ + s) ≥ T²/2R =: e for ρ ≤ R, the radius of the tool. Along ρ the function g·ρ − h(ρ) is
//!   concave, beyond the flat with a second derivative of at most −1/r. So F = g·ρ − h(ρ) − g·(ρ − s) ≤ lift − g·e − max(0, q − e)²/2r, with q
//!   the distance from ρ* of the s of the rectangle, and not more than ρ* − a, the part of it beyond the flat. (To move ρ by δ towards ρ*
//!   costs g·δ and saves less: the derivative of the last term is at most (ρ* − a)/r < g.)

//!
//! Bounds are stored and compared in single precision, so that a node fills one line of the cache. Its errors, at most a few 2⁻²⁴ of the numbers
//! involved, are within the allowance [`ROUNDING`], by which the rectangle is wider and the plane higher.

use super::shape::Shape;
use crate::path::Vec3;

/// Allowance for rounding, of the coordinates: 64 units in the last place.
const ROUNDING: f64 = 4e-6;
/// Largest slope of the plane; for steeper triangles a level one is used, as any plane above the corners is a bound.
const STEEPEST: f64 = 20.0;

/// A plane and a rectangle, with the triangles below the one and within the other.
#[derive(Debug, Clone, Copy)]
pub struct Bound {
    /// Unit vector uphill.
    uphill: [f32; 2],
    /// Least and greatest s and t from the origin, mm.
    low: [f32; 2],
    high: [f32; 2],
    /// g.
    slope: f32,
    /// Height of the plane at the origin, mm.
    level: f32,
    /// See the head of the file, mm.
    lift: f32,
    /// ρ*, mm.
    contact: f32,
}

/// What is the same for all bounds of a tool.
#[derive(Debug, Clone, Copy)]
pub struct OfTool {
    /// a, mm.
    flat: f32,
    /// 1/2r, 1/mm; 0 without a corner radius.
    half_curvature: f32,
    /// 1/2R, 1/mm; 0 for a ball.
    per_reach: f32,
    /// R², mm².
    reach_squared: f32,
}

impl OfTool {
    /// Of an end.
    pub fn new(shape: Shape) -> Self {
        let Shape { flat_mm: a, corner_mm: r } = shape;
        let per = |mm: f64| (1.0 - ROUNDING) * 0.5 / mm;
        Self {
            flat: a as f32,
            half_curvature: if r > 0.0 { per(r) as f32 } else { 0.0 },
            per_reach: if a > 0.0 { per(shape.radius_mm()) as f32 } else { 0.0 },
            reach_squared: ((1.0 + ROUNDING) * shape.radius_mm().powi(2)) as f32,
        }
    }
}

/// A height not above this one.
pub fn below(tip_mm: f64) -> f32 {
    (tip_mm - ROUNDING * tip_mm.abs()) as f32
}

impl Bound {
    /// Bound of some triangles.
    pub fn of<'t>(triangles: impl Iterator<Item = &'t [Vec3; 3]> + Clone, shape: Shape) -> Self {
        let facing = |sum: Vec3, triangle: &[Vec3; 3]| {
            let across = (triangle[1] - triangle[0]).cross(&(triangle[2] - triangle[0]));
            sum + if across.z < 0.0 { -across } else { across }
        };
        let normal = triangles.clone().fold(Vec3::zeros(), facing);
        let level = normal.x.hypot(normal.y);
        let is_steep = level > STEEPEST * normal.z;
        // Any plane above the corners is a bound, so its slope and direction may be rounded first.
        let slope = if is_steep { 0.0 } else { (level / normal.z) as f32 };
        let uphill = if slope > 0.0 { [-normal.x / level, -normal.y / level] } else { [1.0, 0.0] };
        let uphill = uphill.map(|x| x as f32);
        let g = f64::from(slope);
        let (mut low, mut high, mut top) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], f64::NEG_INFINITY);
        for corner in triangles.flatten() {
            let [ux, uy] = uphill.map(f64::from);
            let at = [corner.x * ux + corner.y * uy, corner.y * ux - corner.x * uy];
            for axis in [0, 1] {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis]);
            }
            top = top.max(corner.z - g * at[0]);
        }
        let secant = g.hypot(1.0);
        let Shape { flat_mm: a, corner_mm: r } = shape;
        let farthest = low.into_iter().chain(high).fold(1.0, |far: f64, x| far.max(x.abs()));
        let wider = ROUNDING * (farthest + shape.radius_mm());
        Self {
            uphill,
            low: low.map(|x| (x - wider) as f32),
            high: high.map(|x| (x + wider) as f32),
            slope,
            level: (top + ROUNDING * top.abs() + wider * (1.0 + 2.0 * g)) as f32,
            lift: (r * (secant - 1.0) + a * g) as f32,
            contact: (a + r * g / secant) as f32,
        }
    }

    /// Upper bound of the tip at `p`, mm; minus infinity if it is known quickly to be at most `known_mm`.
    #[inline]
    pub fn at(&self, p: [f32; 2], tool: &OfTool, known_mm: f32) -> f32 {
        let s = p[0] * self.uphill[0] + p[1] * self.uphill[1];
        let t = p[1] * self.uphill[0] - p[0] * self.uphill[1];
        let under = self.level + self.slope * s;
        if under + self.lift <= known_mm {
            return f32::NEG_INFINITY;
        }
        let (from, to) = (self.low[0] - s, self.high[0] - s);
        let aside = (self.low[1] - t).max(t - self.high[1]).max(0.0);
        let ahead = from.max(-to).max(0.0);
        if ahead * ahead + aside * aside > tool.reach_squared {
            return f32::NEG_INFINITY;
        }
        let off = (from - self.contact).max(self.contact - to).max(0.0);
        let less = if tool.flat == 0.0 {
            (off * off + aside * aside) * tool.half_curvature
        } else {
            let longer = aside * aside * tool.per_reach;
            let short = (off.min(self.contact - tool.flat) - longer).max(0.0);
            self.slope * longer + short * short * tool.half_curvature
        };
        under + (self.lift - less).min(self.slope * to)
    }
}
