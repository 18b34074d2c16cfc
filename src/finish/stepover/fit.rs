//! Fits lines and arcs to the points of a path. In: closely spaced points, a tolerance, whether arcs are allowed. Out:
//! lines and arcs within the tolerance of every point as they are written, with rounded ends and centres; each by its end, each arc also with
//! an intermediate point.
//!
//! From the end of each part the longest line and the longest arc are determined, and the longer one is used. An arc
//! lies in a plane normal to an axis, passes through the first, middle and last of its points, and turns by less than
//! half a turn, where rounding could reverse its direction.

use crate::path::{Plane, Vec3};

/// A line, or an arc, to a point of the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Index of its last point.
    pub to: usize,
    /// Intermediate point of an arc; `None`: a line.
    pub via: Option<Vec3>,
}

/// Tolerance of the plane of an arc, mm.
pub const SAME_MM: f64 = 1e-6;
/// Largest radius of an arc, mm: above it a line suffices, and controls lose digits.
const LARGEST_MM: f64 = 2000.0;
/// Largest sweep of an arc, rad.
const MOST_RAD: f64 = 3.0;
/// Angle before its start at which a point of an arc may lie by rounding in the machine, rad.
const BEFORE_RAD: f64 = 1e-6;
/// Fewest points that an arc replaces.
const FEWEST: usize = 4;

/// A place, or a vector, as it is written.
pub type Round<'a> = &'a (dyn Fn(Vec3) -> Vec3 + Sync);

/// Parts of a path.
pub fn fit(points: &[Vec3], tolerance_mm: f64, arcs: bool, round: Round) -> Vec<Part> {
    let last = points.len().saturating_sub(1);
    let (mut parts, mut from) = (Vec::new(), 0);
    while from < last {
        let line = farthest(from, last, 1, &|to| is_line(&points[from..=to], tolerance_mm, round));
        let arc = if arcs {
            farthest(from, last, FEWEST, &|to| is_arc(&points[from..=to], tolerance_mm, round))
        } else {
            from
        };
        let (to, via) =
            if arc > line { (arc, Some(points[usize::midpoint(from, arc)])) } else { (line.max(from + 1), None) };
        parts.push(Part { to, via });
        from = to;
    }
    parts
}

/// The farthest end for which `holds` is true, by doubling and halving steps.
fn farthest(from: usize, last: usize, least: usize, holds: &dyn Fn(usize) -> bool) -> usize {
    if from + least > last || !holds(from + least) {
        return from;
    }
    let (mut good, mut step) = (from + least, 1);
    while good + step <= last && holds(good + step) {
        good += step;
        step *= 2;
    }
    while step > 0 {
        if good + step <= last && holds(good + step) {
            good += step;
        }
        step /= 2;
    }
    good
}

/// Do all points lie within the tolerance of the line from the first to the last?
fn is_line(points: &[Vec3], tolerance_mm: f64, round: Round) -> bool {
    let (a, b) = (round(points[0]), round(points[points.len() - 1]));
    let along = b - a;
    let square = along.norm_squared().max(f64::MIN_POSITIVE);
    points.iter().all(|p| {
        let v = p - a;
        (v - along * (v.dot(&along) / square).clamp(0.0, 1.0)).norm() <= tolerance_mm
    })
}

/// Do all points lie, in order, within the tolerance of the arc through the first, middle and last? The end of a written arc need not lie on its
/// circle: the radius changes evenly along it.
fn is_arc(points: &[Vec3], tolerance_mm: f64, round: Round) -> bool {
    let within = |circle: &Circle| circle.radius_mm <= LARGEST_MM && circle.sweep_rad <= MOST_RAD;
    let Some((circle, end)) = written_arc(points, round).filter(|(circle, _)| within(circle)) else { return false };
    let (u, v, flat) = circle.plane.axes();
    let from_centre = |p: &Vec3| (p[u] - circle.centre[0]).hypot(p[v] - circle.centre[1]);
    let wider_mm = from_centre(&end) - circle.radius_mm;
    let slack = 1e-9 + tolerance_mm / circle.radius_mm;
    let mut before = 0.0;
    points.iter().all(|p| {
        let turned = circle.turned(p, slack);
        let radius_mm = circle.radius_mm + wider_mm * (turned / circle.sweep_rad).min(1.0);
        // Between two points the path is next to their chord, and so must the arc be.
        let bulges_mm = radius_mm * (1.0 - (0.5 * (turned - before)).cos());
        let on = (from_centre(p) - radius_mm).hypot(p[flat] - end[flat]) <= tolerance_mm
            && turned >= before - 1e-9
            && bulges_mm <= tolerance_mm;
        before = turned;
        on && turned <= circle.sweep_rad + slack
    })
}

/// The arc through the first, middle and last of some points as it is written, and its end.
pub fn written_arc(points: &[Vec3], round: Round) -> Option<(Circle, Vec3)> {
    let (first, mut middle, last) = (points[0], points[(points.len() - 1) / 2], points[points.len() - 1]);
    let (_, _, flat) = plane_of(first, middle, last)?.axes();
    let (from, end) = (round(first), round(last));
    // Not in one plane, if only by rounding, it would be a helix.
    if (from[flat] - end[flat]).abs() > SAME_MM {
        return None;
    }
    middle[flat] = from[flat];
    let exact = Circle::through(from, middle, end)?;
    let (u, v, _) = exact.plane.axes();
    let mut to_centre = Vec3::zeros();
    (to_centre[u], to_centre[v]) = (exact.centre[0] - from[u], exact.centre[1] - from[v]);
    let centre = from + round(to_centre);
    Some((exact.about([centre[u], centre[v]], from, end), end))
}

/// The plane normal to an axis in which three points lie.
fn plane_of(a: Vec3, m: Vec3, b: Vec3) -> Option<Plane> {
    let level = |n: usize| (a[n] - m[n]).abs() < SAME_MM && (b[n] - m[n]).abs() < SAME_MM;
    [Plane::Xy, Plane::Zx, Plane::Yz].into_iter().find(|plane| level(plane.axes().2))
}

/// An arc in a plane normal to an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Plane.
    pub plane: Plane,
    /// Centre along the two axes of the plane, mm.
    pub centre: [f64; 2],
    /// Radius, mm.
    pub radius_mm: f64,
    /// Angle of the first point, rad.
    start_rad: f64,
    /// Counter-clockwise?
    pub left: bool,
    /// Angle from the first to the last point, rad, positive.
    pub sweep_rad: f64,
}

impl Circle {
    /// The arc from `a` through `m` to `b`; `None` if they are collinear or in no plane normal to an axis.
    pub fn through(a: Vec3, m: Vec3, b: Vec3) -> Option<Self> {
        let plane = plane_of(a, m, b)?;
        let (u, v, _) = plane.axes();
        let [mx, my, bx, by] = [m[u] - a[u], m[v] - a[v], b[u] - a[u], b[v] - a[v]];
        let twice = 2.0 * (mx * by - my * bx);
        if twice == 0.0 {
            return None;
        }
        let (mm, bb) = (mx * mx + my * my, bx * bx + by * by);
        let (x, y) = ((by * mm - my * bb) / twice, (mx * bb - bx * mm) / twice);
        let radius_mm = x.hypot(y);
        let (centre, left) = ([a[u] + x, a[v] + y], twice > 0.0);
        let mut circle = Self { plane, centre, radius_mm, start_rad: (-y).atan2(-x), left, sweep_rad: 0.0 };
        circle.sweep_rad = circle.turned(&b, BEFORE_RAD);
        Some(circle)
    }

    /// The arc about another centre with these ends; its radius is that of its start.
    fn about(mut self, centre: [f64; 2], from: Vec3, end: Vec3) -> Self {
        let (u, v, _) = self.plane.axes();
        let (x, y) = (from[u] - centre[0], from[v] - centre[1]);
        (self.centre, self.radius_mm, self.start_rad) = (centre, x.hypot(y), y.atan2(x));
        self.sweep_rad = self.turned(&end, BEFORE_RAD);
        self
    }

    /// Angle from the first point to another, in the direction of the arc, rad; 0 if it lies before the first by at most `before_rad`.
    fn turned(&self, p: &Vec3, before_rad: f64) -> f64 {
        let (u, v, _) = self.plane.axes();
        let angle = (p[v] - self.centre[1]).atan2(p[u] - self.centre[0]) - self.start_rad;
        let angle = (if self.left { angle } else { -angle }).rem_euclid(std::f64::consts::TAU);
        // Just before the first point by rounding: 0 instead of a whole turn.
        if angle > std::f64::consts::TAU - before_rad { 0.0 } else { angle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quarter(plane: Plane, radius: f64, count: usize) -> Vec<Vec3> {
        let (u, v, n) = plane.axes();
        let point = |k: usize| {
            let angle = std::f64::consts::FRAC_PI_2 * k as f64 / (count - 1) as f64;
            let mut p = Vec3::zeros();
            (p[u], p[v], p[n]) = (radius * angle.cos(), radius * angle.sin(), 4.0);
            p
        };
        (0..count).map(point).collect()
    }

    /// A quarter circle is one arc in each plane and either way round; a straight rest is one line.
    #[test]
    fn a_quarter_circle_is_one_arc_and_a_straight_rest_one_line() {
        for plane in [Plane::Xy, Plane::Zx, Plane::Yz] {
            for back in [false, true] {
                let mut points = quarter(plane, 10.0, 80);
                let (_, v, _) = plane.axes();
                if back {
                    for p in &mut points {
                        p[v] = -p[v];
                    }
                }
                let end = points[79];
                let way = points[79] - points[78];
                points.extend((1..40).map(|k| end + way * f64::from(k)));
                let parts = fit(&points, 1e-3, true, &|p| p);
                assert_eq!(parts.len(), 2, "{plane:?} {parts:?}");
                assert!(parts[0].via.is_some() && parts[1].via.is_none() && parts[1].to == 118, "{plane:?} {parts:?}");
                let circle = Circle::through(points[0], parts[0].via.unwrap(), points[parts[0].to]).unwrap();
                assert!(circle.plane == plane && circle.left != back && (circle.radius_mm - 10.0).abs() < 1e-2);
            }
        }
    }

    /// No point is farther from its part than the tolerance, an arc in an oblique plane is not used, and a full turn
    /// becomes several arcs.
    #[test]
    fn parts_stay_within_the_tolerance() {
        let wave = |k: usize| Vec3::new(0.1 * k as f64, 2.0, (0.05 * k as f64).sin());
        let points: Vec<Vec3> = (0..400).map(wave).collect();
        // A line of 1 µm sagitta is √(8 · 1 µm / κ) long: 0.18 mm at the crests, where κ = 0.25 /mm, and the points are
        // 0.1 mm apart.
        for (arcs, most) in [(true, 80), (false, 260)] {
            let parts = fit(&points, 1e-3, arcs, &|p| p);
            assert!(parts.len() < most, "{arcs}: {}", parts.len());
            let mut from = 0;
            for part in parts {
                let piece = &points[from..=part.to];
                assert!(if part.via.is_some() {
                    is_arc(piece, 1.001e-3, &|p| p)
                } else {
                    is_line(piece, 1.001e-3, &|p| p)
                });
                from = part.to;
            }
        }
        let askew: Vec<Vec3> = quarter(Plane::Xy, 10.0, 80).iter().map(|p| Vec3::new(p.x, p.y, 0.3 * p.x)).collect();
        assert!(fit(&askew, 1e-3, true, &|p| p).iter().all(|part| part.via.is_none()));
        let round: Vec<Vec3> = (0..=200)
            .map(|k| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / 200.0).sin_cos();
                Vec3::new(5.0 * cos, 5.0 * sin, 1.0)
            })
            .collect();
        assert!((3..=4).contains(&fit(&round, 1e-3, true, &|p| p).len()));
    }

    /// Points crowded at both ends of a corner lie on a wide arc too, which bulges away from the path between them.
    #[test]
    fn an_arc_does_not_bulge_between_far_points() {
        let point = |angle: f64| Vec3::new(0.04 * angle.cos(), 0.0, 0.04 * angle.sin());
        let points: Vec<Vec3> = [0.0, 0.01, 0.02, 1.5, 1.51, 1.52].map(point).into();
        assert!(fit(&points, 3e-3, true, &|p| p).iter().all(|part| part.via.is_none()));
    }

    /// Written to 0.01 mm, lines and arcs are within the tolerance of every point as they are written.
    #[test]
    fn rounding_is_within_the_tolerance() {
        let round = |p: Vec3| p.map(|x| (100.0 * x).round() / 100.0);
        let points: Vec<Vec3> = quarter(Plane::Xy, 7.0, 400).iter().map(|p| p.add_scalar(0.0037)).collect();
        for tolerance_mm in [0.01, 0.02] {
            let (mut from, mut arcs) = (0, 0);
            for part in fit(&points, tolerance_mm, true, &round) {
                let piece = &points[from..=part.to];
                if part.via.is_some() {
                    let (circle, end) = written_arc(piece, &round).unwrap();
                    let off = |p: &Vec3| (p - Vec3::new(circle.centre[0], circle.centre[1], p.z)).norm();
                    let most = off(&end).max(circle.radius_mm) + tolerance_mm;
                    let least = off(&end).min(circle.radius_mm) - tolerance_mm;
                    assert!(piece.iter().all(|p| (least..=most).contains(&off(p))), "{tolerance_mm}: {part:?}");
                    arcs += 1;
                } else {
                    assert!(is_line(piece, tolerance_mm, &round), "{tolerance_mm}: {part:?}");
                }
                from = part.to;
            }
            assert!(arcs > 0 || tolerance_mm < 0.02, "{tolerance_mm}");
        }
    }
}
