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
//! * Where |t| ≥ T and s ≥ s₀, for any j, k ≥ 0, F ≤ (g + j)·s + k·|t| − h(ρ) − j·s₀ − k·T, and the first three terms are at most the lift of
//!   the slope √((g + j)² + k²). As √(x² + k²) ≤ x + k²/2x, that is at most the lift of g + j and k²(a/g + r/√(1 + g²))/2 more. With the best k,
//!   F ≤ lift(g + j) − j·s₀ − T²·*across*, across = 1/2(a/g + r/√(1 + g²)), and with the best j, F ≤ lift − q²/2r − T²·across with q =
//!   max(0, s₀ − ρ*).
//!
//! Bounds are stored and compared in single precision, four side by side ([`Bounds`]), so that they are worked out in one go. Its errors, at most
//! a few 2⁻²⁴ of the numbers involved, are within the allowance [`ROUNDING`], by which the rectangle is wider and the plane higher.

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
    /// See the head of the file, 1/mm.
    across: f32,
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
    /// 1 for a ball, 0 otherwise; and the other way round.
    as_ball: f32,
    as_bull: f32,
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
            as_ball: if a > 0.0 { 0.0 } else { 1.0 },
            as_bull: if a > 0.0 { 1.0 } else { 0.0 },
            reach_squared: ((1.0 + ROUNDING) * shape.radius_mm().powi(2)) as f32,
        }
    }
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
            across: ((1.0 - ROUNDING) * 0.5 * g / (a + r * g / secant).max(f64::MIN_POSITIVE)) as f32,
        }
    }
}

/// Number of bounds side by side.
pub const WIDE: usize = 4;

/// One number of each bound.
type Each = [f32; WIDE];

/// Bounds side by side; see [`Bound`].
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    uphill: [Each; 2],
    low: [Each; 2],
    high: [Each; 2],
    slope: Each,
    level: Each,
    lift: Each,
    contact: Each,
    across: Each,
}

/// The larger of two numbers, as one instruction.
#[inline]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

impl Bounds {
    /// Of at most [`WIDE`] bounds; those that are lacking are minus infinity.
    pub fn of(bounds: &[Bound]) -> Self {
        let each = |of: &dyn Fn(&Bound) -> f32, else_: f32| [0, 1, 2, 3].map(|k| bounds.get(k).map_or(else_, of));
        let both = |of: &dyn Fn(&Bound) -> [f32; 2]| [0, 1].map(|axis| each(&|bound| of(bound)[axis], 0.0));
        Self {
            uphill: both(&|bound| bound.uphill),
            low: both(&|bound| bound.low),
            high: both(&|bound| bound.high),
            slope: each(&|bound| bound.slope, 0.0),
            level: each(&|bound| bound.level, f32::NEG_INFINITY),
            lift: each(&|bound| bound.lift, 0.0),
            contact: each(&|bound| bound.contact, 0.0),
            across: each(&|bound| bound.across, 0.0),
        }
    }

    /// Upper bounds of the tip at `p`, mm; minus infinity beyond the reach of the tool.
    #[inline]
    pub fn at(&self, p: [f32; 2], tool: &OfTool) -> Each {
        let mut most = [0.0; WIDE];
        for (k, most) in most.iter_mut().enumerate() {
            let s = p[0] * self.uphill[0][k] + p[1] * self.uphill[1][k];
            let t = p[1] * self.uphill[0][k] - p[0] * self.uphill[1][k];
            let under = self.level[k] + self.slope[k] * s;
            let (from, to) = (self.low[0][k] - s, self.high[0][k] - s);
            let aside = larger(larger(self.low[1][k] - t, t - self.high[1][k]), 0.0);
            let ahead = larger(larger(from, -to), 0.0);
            let beyond = larger(from - self.contact[k], 0.0);
            let off = larger(beyond, self.contact[k] - to);
            let aside = aside * aside;
            // Of a ball, a = 0, the first is what is said of it; the other two are 0.
            let longer = aside * tool.per_reach;
            let most_off = if tool.flat == 0.0 { off } else { -larger(-off, tool.flat - self.contact[k]) };
            let short = larger(most_off - longer, 0.0);
            let first = (short * short + aside * tool.as_ball) * tool.half_curvature + self.slope[k] * longer;
            let second = aside * self.across[k] * tool.as_bull + beyond * beyond * tool.half_curvature;
            let (highest, corner) = (self.lift[k] - larger(first, second), self.slope[k] * to);
            let found = under - larger(-highest, -corner);
            let is_near = ahead * ahead + aside <= tool.reach_squared;
            *most = if is_near { found } else { f32::NEG_INFINITY };
        }
        most
    }
}
