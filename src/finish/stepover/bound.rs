//! Upper bound of the tip height of a tool that rests on triangles, from a box in XY and a plane above them. In:
//! triangles, tool shape. Out: the bound at a place.
//!
//! With g the gradient of the plane and h the lower side of the tool ([`touch`](super::touch)), the tip is at most the
//! maximum of f(x) = plane(x) − h(|x − axis|) over the box. For a ball f is concave with second derivatives of at most
//! −1/r, so for any point x₀ of the box
//!
//! f(x₀ + Δ) ≤ f(x₀) + ∇f·Δ − Δ²/2r,
//!
//! whose maximum over the box is found axis by axis. x₀ is the point of the box nearest to the contact with the plane,
//! which is a + r|g|/√(1+g²) uphill of the axis. With a flat of radius a, f is not strictly concave; there, with ρ = |x
//! − axis| and γ the angle from uphill,
//!
//! f(x) = plane(axis) + ρ|g| cos γ − h(ρ).
//!
//! The largest cos γ over the box combined with any ρ of the box bounds f: the maximum is at ρ = a + r·s/√(1+s²), s =
//! |g| cos γ.

use super::shape::Shape;
use crate::path::Vec3;

/// Allowance for rounding, mm.
const SLACK_MM: f64 = 1e-9;
/// Largest slope of the plane; for steeper triangles a level one is used, as any plane above the corners is a bound.
const STEEPEST: f64 = 20.0;
/// A box in XY and a plane, with the triangles in the one and below the other.
#[derive(Debug, Clone, Copy)]
pub struct Bound {
    /// Least and largest x and y, mm.
    pub low: [f64; 2],
    /// As above.
    pub high: [f64; 2],
    gradient: [f64; 2],
    /// Height of the plane at the origin, mm.
    level: f64,
    /// Height of the tip above the plane, measured at the axis, when the tool rests on the plane, mm.
    lift: f64,
    /// Vector from the axis to the contact with the plane, mm.
    uphill: [f64; 2],
    /// Slope of the plane.
    slope: f64,
}

impl Bound {
    /// Bound of some triangles.
    pub fn of<'t>(triangles: impl Iterator<Item = &'t [Vec3; 3]> + Clone, shape: Shape) -> Self {
        let (mut low, mut high, mut normal) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], Vec3::zeros());
        for triangle in triangles.clone() {
            let across = (triangle[1] - triangle[0]).cross(&(triangle[2] - triangle[0]));
            normal += if across.z < 0.0 { -across } else { across };
            for corner in triangle {
                for axis in [0, 1] {
                    low[axis] = low[axis].min(corner[axis]);
                    high[axis] = high[axis].max(corner[axis]);
                }
            }
        }
        let steep = normal.x.hypot(normal.y) > STEEPEST * normal.z;
        let gradient = if steep { [0.0; 2] } else { [-normal.x / normal.z, -normal.y / normal.z] };
        let above = |p: &Vec3| p.z - gradient[0] * p.x - gradient[1] * p.y;
        let top = triangles.flatten().map(above).fold(f64::NEG_INFINITY, f64::max);
        let slope = gradient[0].hypot(gradient[1]);
        let secant = slope.hypot(1.0);
        let out = if slope > 0.0 { shape.flat_mm / slope } else { 0.0 } + shape.corner_mm / secant;
        Self {
            low,
            high,
            gradient,
            level: top + SLACK_MM,
            lift: shape.corner_mm * (secant - 1.0) + shape.flat_mm * slope,
            uphill: gradient.map(|g| out * g),
            slope,
        }
    }

    /// Upper bound of the tip at `p`, mm; minus infinity if it is known quickly to be at most `known_mm`.
    #[inline]
    pub fn at(&self, p: [f64; 2], shape: Shape, known_mm: f64) -> f64 {
        let Shape { flat_mm: a, corner_mm: r } = shape;
        let under = self.level + self.gradient[0] * p[0] + self.gradient[1] * p[1];
        if under + self.lift <= known_mm {
            return f64::NEG_INFINITY;
        }
        let beside = |axis: usize| (self.low[axis] - p[axis]).max(p[axis] - self.high[axis]).max(0.0);
        let (reach, least) = (shape.radius_mm(), [beside(0), beside(1)]);
        if least[0] * least[0] + least[1] * least[1] > reach * reach {
            return f64::NEG_INFINITY;
        }
        if a > 0.0 { under + self.around(p, shape, least) } else { under + self.below_ball(p, r) }
    }

    /// Bound of f over the box, less the height of the plane at the axis, for a ball of radius `r`.
    #[inline]
    fn below_ball(&self, p: [f64; 2], r: f64) -> f64 {
        let within = |axis: usize| (p[axis] + self.uphill[axis]).clamp(self.low[axis], self.high[axis]) - p[axis];
        let off = [within(0), within(1)];
        let rise = r * r - (off[0] * off[0] + off[1] * off[1]);
        if rise <= 1e-6 * r * r {
            // x₀ is at or beyond the largest radius of the tool, where h has no finite slope: use the smaller of the
            // contact with the plane and the highest point of the plane within the box.
            let most = |axis: usize| {
                let g = self.gradient[axis];
                (g * (self.low[axis] - p[axis])).max(g * (self.high[axis] - p[axis]))
            };
            return self.lift.min(most(0) + most(1));
        }
        let root = rise.sqrt();
        let (slope, half_bend) = (root.recip(), 0.5 / r);
        let mut bound = root - r;
        for axis in [0, 1] {
            let gradient = self.gradient[axis] - slope * off[axis];
            let [low, high] = [self.low[axis] - p[axis] - off[axis], self.high[axis] - p[axis] - off[axis]];
            let step = (r * gradient).clamp(low, high);
            bound += self.gradient[axis] * off[axis] + step * (gradient - half_bend * step);
        }
        bound
    }

    /// The same for a tool with a flat; `least`: distance of the box from the axis along x and y.
    #[inline]
    fn around(&self, p: [f64; 2], shape: Shape, least: [f64; 2]) -> f64 {
        let Shape { flat_mm: a, corner_mm: r } = shape;
        let nearest = (least[0] * least[0] + least[1] * least[1]).sqrt();
        let [x, y] = [0, 1].map(|axis| [self.low[axis] - p[axis], self.high[axis] - p[axis]]);
        let far = |ends: [f64; 2]| (ends[0] * ends[0]).max(ends[1] * ends[1]);
        let farthest = (far(x) + far(y)).sqrt().min(a + r);
        let s = self.slope * if nearest == 0.0 { 1.0 } else { self.most_uphill(x, y) };
        let touches = if s > 0.0 { a + r * s / (1.0 + s * s).sqrt() } else { 0.0 };
        let out = touches.clamp(nearest, farthest.max(nearest));
        let q = (out - a).max(0.0);
        out * s - (r - (r * r - q * q).max(0.0).sqrt())
    }

    /// Largest cosine of the angle from uphill over a box beside the axis: 1 if the box crosses the uphill direction,
    /// else at a corner.
    #[inline]
    fn most_uphill(&self, x: [f64; 2], y: [f64; 2]) -> f64 {
        let [gx, gy] = self.gradient;
        // A corner to the left of the uphill direction and one to the right; squared cosines with sign.
        let (mut left, mut right, mut most) = ([0.0; 2], [0.0; 2], f64::NEG_INFINITY);
        for x in x {
            for y in y {
                let along = gx * x + gy * y;
                if gx * y - gy * x > 0.0 {
                    left = [x, y];
                } else {
                    right = [x, y];
                }
                most = most.max(along * along.abs() / (x * x + y * y));
            }
        }
        // Less than half a turn from the right one to the left one: the uphill direction lies between them.
        if right[0] * left[1] - right[1] * left[0] > 0.0 {
            return 1.0;
        }
        (most.abs().sqrt() / self.slope.max(f64::MIN_POSITIVE)).copysign(most)
    }
}
