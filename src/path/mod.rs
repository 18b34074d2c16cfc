//! What a machine moves along: lines, arcs and helices. In: end points in mm. Out: arc length, points, tangents,
//! curvature, and exact pieces between two arc lengths.
//!
//! An arc turns by `sweep_rad` (counter-clockwise positive, seen against the plane's normal) about `centre`, while its
//! radius runs linearly from `radius_mm` to `radius_end_mm` (a control tolerates a small mismatch) and it rises by
//! `rise_mm` along the normal. Planes follow NC: XY (G17), ZX (G18), YZ (G19).

pub use nalgebra::Vector3;

/// A point or direction, mm.
pub type Vec3 = Vector3<f64>;

/// Plane of an arc.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Plane {
    /// G17
    Xy,
    /// G18
    Zx,
    /// G19
    Yz,
}

impl Plane {
    /// Indices of (first axis, second axis, normal axis): XY → (0,1,2), ZX → (2,0,1), YZ → (1,2,0).
    pub fn axes(self) -> (usize, usize, usize) {
        match self {
            Plane::Xy => (0, 1, 2),
            Plane::Zx => (2, 0, 1),
            Plane::Yz => (1, 2, 0),
        }
    }
    /// Name as the `toolpath` command prints it.
    pub fn name(self) -> &'static str {
        match self {
            Plane::Xy => "xy",
            Plane::Zx => "zx",
            Plane::Yz => "yz",
        }
    }
}

/// Arc or helix; see the head of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Plane it turns in.
    pub plane: Plane,
    /// Start point, mm.
    pub from: Vec3,
    /// End point as programmed, mm.
    pub to: Vec3,
    /// Centre, mm; its coordinate along the normal is that of `from`.
    pub centre: Vec3,
    /// Radius at the start, mm.
    pub radius_mm: f64,
    /// Radius at the end, mm.
    pub radius_end_mm: f64,
    /// Angle of the start point in the plane, rad, from the plane's first axis.
    pub start_rad: f64,
    /// Angle turned, rad; counter-clockwise positive; more than a full turn is allowed.
    pub sweep_rad: f64,
    /// Rise along the normal, mm.
    pub rise_mm: f64,
}

impl Arc {
    /// Arc from `from` to `to` about `centre` (only its in-plane coordinates are used), turning by `sweep_rad`.
    pub fn new(plane: Plane, from: Vec3, to: Vec3, centre: Vec3, sweep_rad: f64) -> Self {
        let (a, b, n) = plane.axes();
        let mut centre = centre;
        centre[n] = from[n];
        let (u, v) = (from[a] - centre[a], from[b] - centre[b]);
        let (ue, ve) = (to[a] - centre[a], to[b] - centre[b]);
        Self {
            plane,
            from,
            to,
            centre,
            radius_mm: u.hypot(v),
            radius_end_mm: ue.hypot(ve),
            start_rad: v.atan2(u),
            sweep_rad,
            rise_mm: to[n] - from[n],
        }
    }

    fn mean_radius(&self) -> f64 {
        0.5 * (self.radius_mm + self.radius_end_mm)
    }

    /// Length of the path, mm (the small change of radius is neglected in it).
    pub fn length(&self) -> f64 {
        (self.mean_radius() * self.sweep_rad).hypot(self.rise_mm)
    }

    fn point_at_fraction(&self, t: f64) -> Vec3 {
        if t >= 1.0 {
            return self.to;
        }
        if t <= 0.0 {
            return self.from;
        }
        let (a, b, n) = self.plane.axes();
        let angle = self.start_rad + t * self.sweep_rad;
        let radius = self.radius_mm + t * (self.radius_end_mm - self.radius_mm);
        let mut p = self.centre;
        p[a] += radius * angle.cos();
        p[b] += radius * angle.sin();
        p[n] += t * self.rise_mm;
        p
    }

    fn tangent_at_fraction(&self, t: f64) -> Vec3 {
        let (a, b, n) = self.plane.axes();
        let angle = self.start_rad + t.clamp(0.0, 1.0) * self.sweep_rad;
        let speed = self.mean_radius() * self.sweep_rad;
        let mut d = Vec3::zeros();
        d[a] = -speed * angle.sin();
        d[b] = speed * angle.cos();
        d[n] = self.rise_mm;
        d.try_normalize(0.0).unwrap_or_else(Vec3::zeros)
    }

    /// Part between two fractions of its length.
    fn part(&self, t0: f64, t1: f64) -> Self {
        let radius = |t: f64| self.radius_mm + t * (self.radius_end_mm - self.radius_mm);
        let (_, _, n) = self.plane.axes();
        let from = self.point_at_fraction(t0);
        let mut centre = self.centre;
        centre[n] = from[n];
        Self {
            from,
            to: self.point_at_fraction(t1),
            centre,
            radius_mm: radius(t0),
            radius_end_mm: radius(t1),
            start_rad: self.start_rad + t0 * self.sweep_rad,
            sweep_rad: (t1 - t0) * self.sweep_rad,
            rise_mm: (t1 - t0) * self.rise_mm,
            ..*self
        }
    }
}

/// A piece of path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Curve {
    /// Straight line.
    Line {
        /// Start, mm.
        from: Vec3,
        /// End, mm.
        to: Vec3,
    },
    /// Arc or helix.
    Arc(Arc),
}

impl Curve {
    /// Start point, mm.
    pub fn from(&self) -> Vec3 {
        match self {
            Curve::Line { from, .. } => *from,
            Curve::Arc(arc) => arc.from,
        }
    }
    /// End point, mm.
    pub fn to(&self) -> Vec3 {
        match self {
            Curve::Line { to, .. } => *to,
            Curve::Arc(arc) => arc.to,
        }
    }
    /// Length, mm.
    pub fn length(&self) -> f64 {
        match self {
            Curve::Line { from, to } => (to - from).norm(),
            Curve::Arc(arc) => arc.length(),
        }
    }
    /// Point at arc length `s_mm` from the start.
    pub fn point(&self, s_mm: f64) -> Vec3 {
        let t = self.fraction(s_mm);
        match self {
            Curve::Line { from, to } => {
                if t >= 1.0 {
                    *to
                } else {
                    from + (to - from) * t
                }
            }
            Curve::Arc(arc) => arc.point_at_fraction(t),
        }
    }
    /// Unit tangent at arc length `s_mm`; zero for a line without length.
    pub fn tangent(&self, s_mm: f64) -> Vec3 {
        match self {
            Curve::Line { from, to } => (to - from).try_normalize(0.0).unwrap_or_else(Vec3::zeros),
            Curve::Arc(arc) => arc.tangent_at_fraction(self.fraction(s_mm)),
        }
    }
    /// Curvature vector d²p/ds² at arc length `s_mm`, 1/mm, pointing to the centre; zero on a line.
    pub fn curvature(&self, s_mm: f64) -> Vec3 {
        match self {
            Curve::Line { .. } => Vec3::zeros(),
            Curve::Arc(arc) => {
                let length = arc.length();
                if length <= 0.0 {
                    return Vec3::zeros();
                }
                let (a, b, _) = arc.plane.axes();
                let angle = arc.start_rad + self.fraction(s_mm) * arc.sweep_rad;
                let magnitude = arc.mean_radius() * (arc.sweep_rad / length).powi(2);
                let mut k = Vec3::zeros();
                k[a] = -magnitude * angle.cos();
                k[b] = -magnitude * angle.sin();
                k
            }
        }
    }
    /// The piece between two arc lengths (clipped to the curve).
    pub fn part(&self, s0_mm: f64, s1_mm: f64) -> Self {
        let (t0, t1) = (self.fraction(s0_mm), self.fraction(s1_mm));
        match self {
            Curve::Line { .. } => Curve::Line { from: self.point(s0_mm), to: self.point(s1_mm) },
            Curve::Arc(arc) => Curve::Arc(arc.part(t0, t1)),
        }
    }
    /// Smallest box that holds the curve (min, max), mm; exact for lines, safe (never too small) for arcs.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let (mut lo, mut hi) = (self.from().inf(&self.to()), self.from().sup(&self.to()));
        if let Curve::Arc(arc) = self {
            let (a, b, _) = arc.plane.axes();
            let radius = arc.radius_mm.max(arc.radius_end_mm);
            let quarter = std::f64::consts::FRAC_PI_2;
            let (t0, t1) = {
                let end = arc.start_rad + arc.sweep_rad;
                (arc.start_rad.min(end), arc.start_rad.max(end))
            };
            let first = (t0 / quarter).ceil() as i64;
            let last = (t1 / quarter).floor() as i64;
            for k in first..=last.min(first + 3) {
                let angle = k as f64 * quarter;
                let (x, y) = (arc.centre[a] + radius * angle.cos(), arc.centre[b] + radius * angle.sin());
                lo[a] = lo[a].min(x);
                hi[a] = hi[a].max(x);
                lo[b] = lo[b].min(y);
                hi[b] = hi[b].max(y);
            }
        }
        (lo, hi)
    }
    fn fraction(&self, s_mm: f64) -> f64 {
        let length = self.length();
        if length > 0.0 { (s_mm / length).clamp(0.0, 1.0) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn half_turn_helix_has_the_length_of_the_unrolled_triangle() {
        let arc = Arc::new(Plane::Xy, Vec3::new(5.0, 0.0, 0.0), Vec3::new(-5.0, 0.0, 2.0), Vec3::zeros(), PI);
        let curve = Curve::Arc(arc);
        assert!((curve.length() - (5.0 * PI).hypot(2.0)).abs() < 1e-12);
        let mid = curve.point(curve.length() / 2.0);
        assert!((mid - Vec3::new(0.0, 5.0, 1.0)).norm() < 1e-12);
        let h = 1e-5;
        let s = 3.0;
        let numeric = (curve.point(s + h) - curve.point(s - h)) / (2.0 * h);
        assert!((numeric - curve.tangent(s)).norm() < 1e-8);
        let bend = (curve.tangent(s + h) - curve.tangent(s - h)) / (2.0 * h);
        assert!((bend - curve.curvature(s)).norm() < 1e-8);
        let part = curve.part(2.0, 6.0);
        assert!((part.length() - 4.0).abs() < 1e-9);
        assert!((part.point(1.0) - curve.point(3.0)).norm() < 1e-9);
        let (lo, hi) = curve.bounds();
        assert!((lo.y).abs() < 1e-9 && (hi.y - 5.0).abs() < 1e-9);
    }

    #[test]
    fn planes_turn_as_nc_says() {
        // G18 counter-clockwise (G3): from +Z towards +X.
        let arc = Arc::new(Plane::Zx, Vec3::new(0.0, 0.0, 1.0), Vec3::new(1.0, 0.0, 0.0), Vec3::zeros(), PI / 2.0);
        let mid = Curve::Arc(arc).point(PI / 4.0);
        assert!((mid - Vec3::new(0.5f64.sqrt(), 0.0, 0.5f64.sqrt())).norm() < 1e-12);
    }
}
