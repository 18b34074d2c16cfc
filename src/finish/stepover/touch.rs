//! Contact of a tool lowered onto one triangle. In: triangle, tool shape, position of the axis in XY. Out: height of
//! the tip, point of contact, and whether it lies on the facet, an edge or a corner.
//!
//! A bull-nose end is a disc of radius a swept by a ball of radius r; ball: a = 0, flat end: r = 0. Its lower side at a
//! distance ρ from the axis is h(ρ) = r − √(r² − (ρ − a)²) above the tip (0 within a), a convex function. So z(p) −
//! h(|p − axis|) is concave over the triangle, and its maximum is the height of the tip. With θ the slope of the facet
//! it lies
//! * on the facet, at a + r sin θ uphill of the axis, if that point is inside the triangle;
//! * otherwise on an edge that separates the triangle from that point, where the function is again concave: in closed
//!   form for a ball and a flat end, by Newton steps for a bull-nose end.
//!
//! Bull-nose end on an edge of slope m ≥ 0 at the horizontal distance d from the axis: let w be the component across the edge of the unit vector
//! from the axis towards the contact, at ρ. Along that vector the lower side rises by G = m/√(1 − w²), so ρ = a + r·G/√(1 + G²) and
//!
//! d = ρ w = w (a + r m/√(m² + 1 − w²)).
//!
//! The right side is convex and grows from 0 to a + r, so Newton steps from a w that is too large come down to the root. On any plane through
//! the edge the tool rests at least as high as on the edge alone; of those whose steepest direction has the component w across the edge, the
//! slope is G, and with z the height of the edge nearest to the axis
//!
//! tip ≤ z − G w d + r(√(1 + G²) − 1) + a G,
//!
//! whatever w is. Edges that this keeps below a known contact are not looked at further.

use super::shape::Shape;
use crate::path::Vec3;

/// Tolerance of the component w for a bull-nose end: steps are squared from one to the next, so that the last one leaves an error of 1e-12.
const ACROSS: f64 = 1e-12;
/// Most steps for it; about three are needed, twenty on an edge that is nearly level.
const STEPS: u32 = 60;

/// Part of a triangle.
#[derive(Debug, Clone, Copy)]
pub enum Feature {
    /// Inside.
    Facet,
    /// The edge that starts at this corner.
    Edge(u8),
    /// This corner.
    Corner(u8),
}

/// A contact.
#[derive(Debug, Clone, Copy)]
pub struct Touched {
    /// Height of the tip, mm.
    pub tip_mm: f64,
    /// Point of contact, mm.
    pub point: Vec3,
    /// Part of the triangle.
    pub feature: Feature,
}

/// A triangle prepared for one tool.
#[derive(Debug, Clone, Copy)]
pub struct Facet {
    corners: [Vec3; 3],
    /// Unit normal that faces upwards; zero where the triangle is upright.
    normal: Vec3,
    /// Do the corners run counter-clockwise seen from above?
    left: bool,
    /// From the axis to the contact with the plane of the facet, mm.
    uphill: [f64; 2],
}

impl Facet {
    /// Prepares a triangle.
    pub fn new(corners: &[Vec3; 3], shape: Shape) -> Self {
        let [a, b, c] = corners;
        let across = (b - a).cross(&(c - a));
        let left = across.z > 0.0;
        let normal = if across.z == 0.0 { Vec3::zeros() } else { across / across.norm().copysign(across.z) };
        // Uphill is opposite to the horizontal component of the normal; on a level facet a flat bottom is tested at its
        // axis.
        let sin = normal.x.hypot(normal.y);
        let out = if sin > 0.0 { shape.flat_mm / sin } else { 0.0 } + shape.corner_mm;
        Self { corners: *corners, normal, left, uphill: [-out * normal.x, -out * normal.y] }
    }

    /// Contact of a tool above `p`; only edges that are `kept` are tested. `None` too where the tip is at most `known_mm`: nowhere on the plane
    /// of the facet is it higher than at the contact with that, and of a ball it is lower by d²/2r at a distance d from there.
    #[inline]
    pub fn touch(&self, p: [f64; 2], shape: Shape, kept: [bool; 3], known_mm: f64) -> Option<Touched> {
        let ([a, b, c], n) = (&self.corners, self.normal);
        let mut tested = kept;
        if n.z > 0.0 {
            let (x, y) = (p[0] + self.uphill[0], p[1] + self.uphill[1]);
            let z = a.z - (n.x * (x - a.x) + n.y * (y - a.y)) / n.z;
            let tip_mm = z - shape.corner_mm * (1.0 - n.z);
            if tip_mm <= known_mm {
                return None;
            }
            let farthest =
                if shape.flat_mm == 0.0 { 2.0 * shape.corner_mm * (tip_mm - known_mm) } else { f64::INFINITY };
            // Does the edge separate the triangle from that contact, and is it near enough?
            let side = |a: &Vec3, b: &Vec3| {
                let (dx, dy) = (b.x - a.x, b.y - a.y);
                let left = dx * (y - a.y) - dy * (x - a.x);
                let separates = if self.left { left < 0.0 } else { left > 0.0 };
                [separates, left * left < farthest * (dx * dx + dy * dy)]
            };
            let sides = [side(a, b), side(b, c), side(c, a)];
            if sides.iter().all(|[separates, _]| !separates) {
                return Some(Touched { tip_mm, point: Vec3::new(x, y, z), feature: Feature::Facet });
            }
            for (tested, side) in tested.iter_mut().zip(sides) {
                *tested &= side == [true; 2];
            }
        }
        let mut best: Option<Touched> = None;
        for k in 0..3u8 {
            if tested[usize::from(k)] {
                let known_mm = best.map_or(known_mm, |best| best.tip_mm.max(known_mm));
                let other = edge(&self.corners, k, p, shape, known_mm);
                best = best.filter(|best| other.is_none_or(|other| other.tip_mm <= best.tip_mm)).or(other);
            }
        }
        best
    }
}

/// Contact with an edge, including its ends; `None` too where the tip is found to be at most `known_mm` on the way.
fn edge(triangle: &[Vec3; 3], k: u8, p: [f64; 2], shape: Shape, known_mm: f64) -> Option<Touched> {
    let next = (k + 1) % 3;
    let (a, b) = (triangle[k as usize], triangle[next as usize]);
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    let length = (dx * dx + dy * dy).sqrt();
    if length < 1e-12 {
        let (end, k) = if a.z > b.z { (a, k) } else { (b, next) };
        let tip_mm = end.z - shape.height((end.x - p[0]).hypot(end.y - p[1]))?;
        return Some(Touched { tip_mm, point: end, feature: Feature::Corner(k) });
    }
    let (ux, uy) = (dx / length, dy / length);
    // Positions along the edge, from the foot of the perpendicular from the axis.
    let begin = (a.x - p[0]) * ux + (a.y - p[1]) * uy;
    let off = (a.x - p[0]) * uy - (a.y - p[1]) * ux;
    let half = shape.radius_mm().powi(2) - off * off;
    if half < 0.0 {
        return None;
    }
    let half = half.sqrt();
    let (from, to) = (begin.max(-half), (begin + length).min(half));
    if from > to {
        return None;
    }
    let slope = (b.z - a.z) / length;
    let u = lowest_gap(slope, off.abs(), shape, known_mm - (a.z - slope * begin))?.clamp(from, to);
    let feature = match u {
        u if u <= begin => Feature::Corner(k),
        u if u >= begin + length => Feature::Corner(next),
        _ => Feature::Edge(k),
    };
    let t = (u - begin) / length;
    let point = a + (b - a) * t;
    let tip_mm = point.z - shape.height((u * u + off * off).sqrt().min(shape.radius_mm()))?;
    Some(Touched { tip_mm, point, feature })
}

/// Position u at which slope·u − h(√(u² + off²)) is largest; `None` if that is found to be at most `known_mm`.
fn lowest_gap(slope: f64, off: f64, shape: Shape, known_mm: f64) -> Option<f64> {
    let Shape { flat_mm: a, corner_mm: r } = shape;
    let m = slope.abs();
    if r == 0.0 {
        return Some(if slope > 0.0 { f64::INFINITY } else { f64::NEG_INFINITY });
    }
    if a == 0.0 {
        return Some((r * r - off * off).max(0.0).sqrt() * slope / (m * m + 1.0).sqrt());
    }
    if m == 0.0 {
        return Some(0.0);
    }
    let mut w = (off / (a + r * m / (m * m + 1.0).sqrt())).min(1.0);
    let steepest = m / (1.0 - w * w).sqrt();
    let most_mm = r * ((1.0 + steepest * steepest).sqrt() - 1.0) + (a - w * off) * steepest;
    if most_mm <= known_mm {
        return None;
    }
    let square = m * m + 1.0;
    for _ in 0..STEPS {
        let per = 1.0 / (square - w * w).sqrt();
        let corner = r * m * per;
        let by = (w * (a + corner) - off) / (a + corner * square * per * per);
        w -= by;
        if by <= ACROSS {
            break;
        }
    }
    let along = (1.0 - w * w).max(0.0).sqrt();
    Some(along * (a + r * m / (square - w * w).sqrt()) * slope.signum())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPES: [Shape; 3] = [
        Shape { flat_mm: 0.0, corner_mm: 3.0 },
        Shape { flat_mm: 2.0, corner_mm: 1.0 },
        Shape { flat_mm: 3.0, corner_mm: 0.0 },
    ];

    /// No point of a triangle is inside a tool that rests on it, and one touches it: by points spread over the
    /// triangle.
    #[test]
    fn no_point_of_a_triangle_is_inside_the_tool_that_rests_on_it() {
        let triangle = [Vec3::new(0.0, 0.0, 0.0), Vec3::new(4.0, 1.0, 2.0), Vec3::new(1.0, 3.0, -1.5)];
        for shape in SHAPES {
            for k in 0..100 {
                let p = [0.07 * f64::from(k) - 1.0, 0.05 * f64::from(k % 13)];
                let Some(found) = Facet::new(&triangle, shape).touch(p, shape, [true; 3], f64::NEG_INFINITY) else {
                    continue;
                };
                let mut nearest = f64::INFINITY;
                for i in 0..=400 {
                    for j in 0..=400 - i {
                        let (u, v) = (f64::from(i) / 400.0, f64::from(j) / 400.0);
                        let q = triangle[0] * (1.0 - u - v) + triangle[1] * u + triangle[2] * v;
                        let Some(height) = shape.height((q.x - p[0]).hypot(q.y - p[1])) else { continue };
                        nearest = nearest.min(found.tip_mm + height - q.z);
                    }
                }
                assert!((-1e-9..0.02).contains(&nearest), "{shape:?} {p:?} {nearest}");
            }
        }
    }
}
