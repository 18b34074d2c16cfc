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
//! which is a + r|g|/√(1+g²) uphill of the axis. With a flat of radius a, f is concave but not strictly: the last term
//! is dropped. The contact with the plane itself, the maximum of f without the box, is a bound as well.

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
        }
    }

    /// Upper bound of the tip at `p`, mm; minus infinity if it is known quickly to be at most `known_mm`.
    #[inline]
    pub fn at(&self, p: [f64; 2], shape: Shape, known_mm: f64) -> f64 {
        let under = self.level + self.gradient[0] * p[0] + self.gradient[1] * p[1];
        if under + self.lift <= known_mm {
            return f64::NEG_INFINITY;
        }
        let beside = |axis: usize| (self.low[axis] - p[axis]).max(p[axis] - self.high[axis]).max(0.0);
        let (reach, least) = (shape.radius_mm(), [beside(0), beside(1)]);
        if least[0] * least[0] + least[1] * least[1] > reach * reach {
            return f64::NEG_INFINITY;
        }
        under + self.below(p, shape)
    }

    /// Bound of f over the box, less the height of the plane at the axis.
    #[inline]
    fn below(&self, p: [f64; 2], shape: Shape) -> f64 {
        let Shape { flat_mm: a, corner_mm: r } = shape;
        let within = |axis: usize| (p[axis] + self.uphill[axis]).clamp(self.low[axis], self.high[axis]) - p[axis];
        let off = [within(0), within(1)];
        let square = off[0] * off[0] + off[1] * off[1];
        let out = if a > 0.0 { square.sqrt() } else { 0.0 };
        // How far x₀ lies beyond the flat, squared; for a ball ρ² itself.
        let beyond = if a > 0.0 { (out - a).max(0.0).powi(2) } else { square };
        let rise = r * r - beyond;
        if rise <= 1e-6 * r * r {
            // x₀ is at or beyond the largest radius of the tool, where h has no finite slope, or the tool has no corner
            // radius: the smaller of the contact with the plane and the highest point of the plane within the box.
            let most = |axis: usize| {
                let g = self.gradient[axis];
                (g * (self.low[axis] - p[axis])).max(g * (self.high[axis] - p[axis]))
            };
            return self.lift.min(most(0) + most(1));
        }
        let root = rise.sqrt();
        let slope = if a > 0.0 { (1.0 - a / out).max(0.0) / root } else { root.recip() };
        let mut bound = root - r;
        for axis in [0, 1] {
            let gradient = self.gradient[axis] - slope * off[axis];
            let [low, high] = [self.low[axis] - p[axis] - off[axis], self.high[axis] - p[axis] - off[axis]];
            bound += self.gradient[axis] * off[axis];
            if a > 0.0 {
                bound += (gradient * low).max(gradient * high);
            } else {
                let step = (r * gradient).clamp(low, high);
                bound += step * (gradient - 0.5 / r * step);
            }
        }
        bound.min(self.lift)
    }
}
