//! A bound on how high a tool is held by triangles of which only a box in the plane and a plane above them are known. In: triangles,
//! tool shape. Out: no tip at a place is held higher than this.
//!
//! With g the gradient of the plane and h the lower side of the tool ([`touch`](super::touch)), f(p) = plane(p) − h(|p − axis|)
//! bounds what the box can hold. f is concave, and for a ball it bends by at least 1/r: about any point x₀ of the box
//!
//! f(x₀ + Δ) ≤ f(x₀) + ∇f·Δ − Δ²/2r  (without the last term where there is a flat),
//!
//! whose largest value over the box is found axis by axis. x₀ is the point of the box next to where the tool touches the
//! plane, at a + r|g|/√(1+g²) uphill.

use super::shape::Shape;
use crate::path::Vec3;

/// What a bound stays above rounding, mm.
const SLACK_MM: f64 = 1e-9;
/// A plane of a node is never steeper than this; any plane above its corners bounds it.
const STEEPEST: f64 = 20.0;
/// What lies in a box of the plane, and below a plane.
#[derive(Debug, Clone, Copy)]
pub struct Bound {
    /// Least and largest x and y, mm.
    pub low: [f64; 2],
    /// As above.
    pub high: [f64; 2],
    gradient: [f64; 2],
    /// Height of the plane above the origin, mm.
    level: f64,
    /// How far above the plane under it a tip that rests on it stands, mm.
    lift: f64,
    /// From the axis to where the tool touches the plane, mm.
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

    /// No tip at `p` is held higher than this by what lies within; minus infinity where that is no more than `known_mm`.
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
        let within = |axis: usize| (p[axis] + self.uphill[axis]).clamp(self.low[axis], self.high[axis]) - p[axis];
        let off = [within(0), within(1)];
        let square = off[0] * off[0] + off[1] * off[1];
        let out = if a > 0.0 { square.sqrt() } else { 0.0 };
        let bend = if a > 0.0 { (out - a).max(0.0).powi(2) } else { square };
        let rise = r * r - bend;
        if rise <= 1e-6 * r * r {
            // That point lies on or beyond the rim of the tool, where h has no slope: no contact is higher than on the plane,
            // nor than the plane is within the box.
            let most = |axis: usize| {
                let g = self.gradient[axis];
                (g * (self.low[axis] - p[axis])).max(g * (self.high[axis] - p[axis]))
            };
            return under + self.lift.min(most(0) + most(1));
        }
        let root = rise.sqrt();
        // Slope of h over the distance from the axis.
        let slope = if a > 0.0 { (out - a).max(0.0) / (root * out.max(f64::MIN_POSITIVE)) } else { root.recip() };
        let half_bend = 0.5 / r;
        let mut bound = under - (r - root);
        for axis in [0, 1] {
            let gradient = self.gradient[axis] - slope * off[axis];
            let [low, high] = [self.low[axis] - p[axis] - off[axis], self.high[axis] - p[axis] - off[axis]];
            let more = if a > 0.0 {
                (gradient * low).max(gradient * high)
            } else {
                let step = (r * gradient).clamp(low, high);
                step * (gradient - half_bend * step)
            };
            bound += self.gradient[axis] * off[axis] + more;
        }
        bound
    }
}
