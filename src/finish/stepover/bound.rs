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

use super::shape::Shape;
use crate::path::Vec3;

/// Allowance for rounding, mm.
const SLACK_MM: f64 = 1e-9;
/// Largest slope of the plane; for steeper triangles a level one is used, as any plane above the corners is a bound.
const STEEPEST: f64 = 20.0;

/// A plane and a rectangle, with the triangles below the one and within the other.
#[derive(Debug, Clone, Copy)]
pub struct Bound {
    /// Unit vector uphill.
    uphill: [f64; 2],
    /// Least and greatest s and t from the origin, mm.
    low: [f64; 2],
    high: [f64; 2],
    /// g.
    slope: f64,
    /// Height of the plane at the origin, mm.
    level: f64,
    /// See the head of the file, mm.
    lift: f64,
    /// ρ*, mm.
    contact: f64,
    /// 1/2r, 1/mm; 0 without a corner radius.
    half_curvature: f64,
    /// 1/2R, 1/mm; 0 for a ball.
    per_reach: f64,
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
        let slope = if is_steep { 0.0 } else { level / normal.z };
        let uphill = if slope > 0.0 { [-normal.x / level, -normal.y / level] } else { [1.0, 0.0] };
        let (mut low, mut high, mut top) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], f64::NEG_INFINITY);
        for corner in triangles.flatten() {
            let at = along(uphill, [corner.x, corner.y]);
            for axis in [0, 1] {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis]);
            }
            top = top.max(corner.z - slope * at[0]);
        }
        let secant = slope.hypot(1.0);
        let Shape { flat_mm: a, corner_mm: r } = shape;
        Self {
            uphill,
            low,
            high,
            slope,
            level: top + SLACK_MM,
            lift: r * (secant - 1.0) + a * slope,
            contact: a + r * slope / secant,
            half_curvature: if r > 0.0 { 0.5 / r } else { 0.0 },
            per_reach: if a > 0.0 { 0.5 / shape.radius_mm() } else { 0.0 },
        }
    }

    /// Upper bound of the tip at `p`, mm; minus infinity if it is known quickly to be at most `known_mm`.
    #[inline]
    pub fn at(&self, p: [f64; 2], shape: Shape, known_mm: f64) -> f64 {
        let [s, t] = along(self.uphill, p);
        let under = self.level + self.slope * s;
        if under + self.lift <= known_mm {
            return f64::NEG_INFINITY;
        }
        let (from, to) = (self.low[0] - s, self.high[0] - s);
        let aside = (self.low[1] - t).max(t - self.high[1]).max(0.0);
        let (reach, ahead) = (shape.radius_mm(), from.max(-to).max(0.0));
        if ahead * ahead + aside * aside > reach * reach + SLACK_MM {
            return f64::NEG_INFINITY;
        }
        let off = (from - self.contact).max(self.contact - to).max(0.0);
        let less = if shape.flat_mm == 0.0 {
            (off * off + aside * aside) * self.half_curvature
        } else {
            let longer = aside * aside * self.per_reach;
            let short = (off.min(self.contact - shape.flat_mm) - longer).max(0.0);
            self.slope * longer + short * short * self.half_curvature
        };
        under + (self.lift - less).min(self.slope * to)
    }
}

/// Coordinates of a place uphill and across.
#[inline]
fn along(uphill: [f64; 2], p: [f64; 2]) -> [f64; 2] {
    [p[0] * uphill[0] + p[1] * uphill[1], p[1] * uphill[0] - p[0] * uphill[1]]
}
