//! Shape of the lower side of a finishing tool. In: an outline. Out: radius of the bottom flat and of the corner;
//! heights and normals.

use crate::machine::{Profile, Tool};
use crate::path::Vec3;

/// A ball end (no flat), a bull-nose end, or a flat end (no corner radius).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Radius of the bottom flat, mm.
    pub flat_mm: f64,
    /// Radius of the corner, mm.
    pub corner_mm: f64,
}

impl Shape {
    /// A ball of this radius.
    pub fn ball(radius_mm: f64) -> Self {
        Self { flat_mm: 0.0, corner_mm: radius_mm }
    }

    /// The shape of a ball or bull-nose end mill; `None` for other tools.
    pub fn of(tool: &Tool) -> Option<Self> {
        let profile: &Profile = &tool.profile;
        let ball = profile.as_ball().map(Self::ball);
        ball.or_else(|| profile.as_bull().map(|[flat_mm, corner_mm]| Self { flat_mm, corner_mm }))
    }

    /// Largest radius, mm.
    #[inline]
    pub fn radius_mm(&self) -> f64 {
        self.flat_mm + self.corner_mm
    }

    /// Height above the tip at a distance from the axis, mm; `None` beyond the radius.
    #[inline]
    pub fn height(&self, from_axis_mm: f64) -> Option<f64> {
        let q = from_axis_mm - self.flat_mm;
        if q <= 0.0 {
            return Some(0.0);
        }
        let square = self.corner_mm * self.corner_mm - q * q;
        // A point at the largest radius may lie beyond it by rounding.
        (q <= self.corner_mm + 1e-9).then(|| self.corner_mm - square.max(0.0).sqrt())
    }

    /// Distance of a point from the tool, given relative to the tip, mm; negative inside.
    pub fn distance_mm(&self, from_tip: Vec3) -> f64 {
        let out = from_tip.x.hypot(from_tip.y);
        let below = (from_tip.z - self.corner_mm).min(0.0);
        (out - self.flat_mm).max(0.0).hypot(below) - self.corner_mm
    }

    /// Unit normal into the tool at a point of its lower side, given relative to the tip.
    pub fn normal(&self, from_tip: Vec3) -> Vec3 {
        let out = from_tip.x.hypot(from_tip.y);
        if out <= self.flat_mm || self.corner_mm == 0.0 {
            return Vec3::z();
        }
        let on_circle = self.flat_mm / out;
        let centre = Vec3::new(from_tip.x * on_circle, from_tip.y * on_circle, self.corner_mm);
        (centre - from_tip).normalize()
    }
}
