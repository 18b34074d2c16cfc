//! Outline of a cutter: the curve (radius, height) whose rotation about the axis gives its surface. In: a shape with its dimensions, or segments.
//! Out: heights, radii and normals of the outline, and its slices (thin rings).
//!
//! Heights count from the tip (z = 0) up the axis. Segments run from the axis at the tip outward and up: a flat end mill
//! is the bottom line (0,0)→(R,0) and the side line (R,0)→(R,L); a ball is one arc and a side line. Along each segment the
//! outward normal of the outline is (n_r, n_z): (0,−1) on the bottom face, (1,0) on the side, in between on a ball.

use std::f64::consts::{FRAC_PI_2, PI};

/// One piece of the outline in the half plane (radius, height), mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Segment {
    /// Straight from (r0, z0) to (r1, z1).
    Line {
        /// Start (radius, height).
        from: [f64; 2],
        /// End (radius, height).
        to: [f64; 2],
    },
    /// Circular, convex outward, about `centre` = (radius, height), from polar angle `from_rad` to `to_rad`, where −π/2
    /// points down the axis and 0 points outward.
    Arc {
        /// Centre (radius, height).
        centre: [f64; 2],
        /// Radius of the arc, mm.
        radius: f64,
        /// First polar angle.
        from_rad: f64,
        /// Last polar angle.
        to_rad: f64,
    },
}

/// A thin ring of the cutter surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slice {
    /// Height of its middle above the tip, mm.
    pub z_mm: f64,
    /// Radius of its middle, mm.
    pub radius_mm: f64,
    /// Length along the outline, mm: the cutting-edge length `du` of the force model (for zero helix).
    pub edge_mm: f64,
    /// Outward normal, radial part.
    pub normal_r: f64,
    /// Outward normal, axial part (−1 looks down).
    pub normal_z: f64,
    /// Index of the segment of the profile it belongs to.
    pub segment: u8,
}

impl Slice {
    /// Height along the axis, mm (0 on a flat bottom).
    pub fn dz_mm(&self) -> f64 {
        self.edge_mm * self.normal_r
    }
}

/// Outline of a cutter.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Pieces from the axis at the tip outward and up, each starting where the one before ends.
    pub segments: Vec<Segment>,
}

impl Segment {
    /// Length along the outline, mm.
    pub fn length(&self) -> f64 {
        match self {
            Segment::Line { from, to } => (to[0] - from[0]).hypot(to[1] - from[1]),
            Segment::Arc { radius, from_rad, to_rad, .. } => radius * (to_rad - from_rad).abs(),
        }
    }
    /// Point (radius, height) and outward normal (n_r, n_z) at a fraction of its length.
    pub fn at(&self, t: f64) -> ([f64; 2], [f64; 2]) {
        match self {
            Segment::Line { from, to } => {
                let (dr, dz) = (to[0] - from[0], to[1] - from[1]);
                let length = dr.hypot(dz).max(f64::MIN_POSITIVE);
                ([from[0] + t * dr, from[1] + t * dz], [dz / length, -dr / length])
            }
            Segment::Arc { centre, radius, from_rad, to_rad } => {
                let angle = from_rad + t * (to_rad - from_rad);
                let (sin, cos) = angle.sin_cos();
                ([centre[0] + radius * cos, centre[1] + radius * sin], [cos, sin])
            }
        }
    }
}

impl Profile {
    /// Flat end mill of `diameter` with cutting edges `length` long.
    pub fn flat(diameter: f64, length: f64) -> Self {
        let r = 0.5 * diameter;
        Self {
            segments: vec![
                Segment::Line { from: [0.0, 0.0], to: [r, 0.0] },
                Segment::Line { from: [r, 0.0], to: [r, length] },
            ],
        }
    }
    /// Ball end mill.
    pub fn ball(diameter: f64, length: f64) -> Self {
        Self::bull(diameter, 0.5 * diameter, length)
    }
    /// Bull-nose end mill with corner radius `corner`.
    pub fn bull(diameter: f64, corner: f64, length: f64) -> Self {
        let r = 0.5 * diameter;
        let mut segments = Vec::new();
        if r > corner {
            segments.push(Segment::Line { from: [0.0, 0.0], to: [r - corner, 0.0] });
        }
        segments.push(Segment::Arc { centre: [r - corner, corner], radius: corner, from_rad: -FRAC_PI_2, to_rad: 0.0 });
        if length > corner {
            segments.push(Segment::Line { from: [r, corner], to: [r, length] });
        }
        Self { segments }
    }
    /// Cone with the full angle `point_rad` at the tip (drill, chamfer, V), a flat of `tip_diameter`, up to `diameter`,
    /// then a cylinder up to `length`.
    pub fn cone(diameter: f64, tip_diameter: f64, point_rad: f64, length: f64) -> Self {
        let (r, tip) = (0.5 * diameter, 0.5 * tip_diameter);
        let height = (r - tip) / (0.5 * point_rad.clamp(1e-3, PI - 1e-6)).tan();
        let mut segments = Vec::new();
        if tip > 0.0 {
            segments.push(Segment::Line { from: [0.0, 0.0], to: [tip, 0.0] });
        }
        segments.push(Segment::Line { from: [tip, 0.0], to: [r, height] });
        if length > height {
            segments.push(Segment::Line { from: [r, height], to: [r, length] });
        }
        Self { segments }
    }
    /// Largest radius, mm.
    pub fn max_radius(&self) -> f64 {
        self.segments.iter().map(|segment| segment.at(0.0).0[0].max(segment.at(1.0).0[0])).fold(0.0, f64::max)
    }
    /// Radius of the ball when this is a ball end mill (its arc reaches the full width).
    pub fn as_ball(&self) -> Option<f64> {
        match self.segments.first()? {
            Segment::Arc { centre, radius, from_rad, to_rad } => {
                let half = centre[0] == 0.0 && *from_rad == -FRAC_PI_2 && *to_rad == 0.0;
                (half && self.max_radius() <= *radius).then_some(*radius)
            }
            Segment::Line { .. } => None,
        }
    }
    /// Radius of the bottom flat and of the corner when this is a bull-nose end mill.
    pub fn as_bull(&self) -> Option<[f64; 2]> {
        match self.segments.as_slice() {
            [Segment::Line { from, to }, Segment::Arc { centre, radius, from_rad, to_rad }, rest @ ..] => {
                let quarter = *from_rad == -FRAC_PI_2 && *to_rad == 0.0;
                let foot = from[1] == to[1] && to[0] == centre[0] && (centre[1] - radius).abs() < 1e-12;
                let wide = rest.iter().all(|segment| segment.at(1.0).0[0] <= centre[0] + radius);
                (quarter && foot && wide).then_some([to[0], *radius])
            }
            _ => None,
        }
    }
    /// True for a flat end mill: a bottom line and a cylindrical side.
    pub fn is_flat(&self) -> bool {
        let r = self.max_radius();
        matches!(self.segments.first(), Some(Segment::Line { from, to }) if from[1] == to[1] && to[0] == r)
            && self.segments[1..].iter().all(|segment| segment.at(0.0).0[0] == r && segment.at(1.0).0[0] == r)
    }
    /// Height at which the outline begins to narrow upward (lollipop, T-slot, dovetail); `None` for ordinary cutters.
    pub fn neck(&self) -> Option<f64> {
        let narrowing = |segment: &&Segment| match segment {
            Segment::Line { from, to } => to[0] < from[0] - 1e-9,
            Segment::Arc { to_rad, .. } => *to_rad > 1e-9,
        };
        self.segments.iter().find(narrowing).map(|segment| match segment {
            Segment::Line { from, .. } => from[1],
            Segment::Arc { centre, from_rad, .. } if *from_rad <= 0.0 => centre[1],
            Segment::Arc { .. } => segment.at(0.0).0[1],
        })
    }
    /// Height of the outline, mm.
    pub fn height(&self) -> f64 {
        self.segments.last().map_or(0.0, |segment| segment.at(1.0).0[1])
    }
    /// Lowest height of the outline at a distance `r` from the axis: the shape that a height field is swept with.
    /// `None` beyond the largest radius.
    pub fn height_at(&self, r: f64) -> Option<f64> {
        self.segments.iter().filter_map(|segment| segment_height_at(segment, r)).reduce(f64::min)
    }
    /// Radius of the disc that the cutter, standing still, keeps clear at height `z` above its tip, counting everything
    /// below that height (a height field cannot hold what overhangs). `None` below the tip.
    pub fn radius_below(&self, z: f64) -> Option<f64> {
        self.segments.iter().filter_map(|segment| segment_radius_below(segment, z)).reduce(f64::max)
    }
    /// Rings of at most `step_mm` along the outline, from the tip up. The step of each segment is equal.
    pub fn slices(&self, step_mm: f64) -> Vec<Slice> {
        self.slices_by(|_| step_mm)
    }
    /// The rings engagement is worked out for: 16 on a quarter circle (between 0.05 and 0.5 mm each), R/6 (0.1 to 0.5 mm)
    /// on a cylindrical side, R/8 (0.05 to 1 mm) on a flat bottom, 24 on a cone; each in `parts` of its own, but on a cylindrical side, where the
    /// engagement of a ring does not change with its radius.
    pub fn rings(&self, parts: u32) -> Vec<Slice> {
        let r = self.max_radius();
        let step_mm = |segment: &Segment| match segment {
            Segment::Arc { radius, .. } => (radius * PI / 32.0).clamp(0.05, 0.5),
            Segment::Line { from, to } if from[0] == to[0] => (r / 6.0).clamp(0.1, 0.5),
            Segment::Line { from, to } if from[1] == to[1] => (r / 8.0).clamp(0.05, 1.0),
            Segment::Line { .. } => (segment.length() / 24.0).clamp(0.05, 0.5),
        };
        let is_side = |segment: &Segment| matches!(segment, Segment::Line { from, to } if from[0] == to[0]);
        self.slices_by(|segment| step_mm(segment) / if is_side(segment) { 1.0 } else { f64::from(parts) })
    }
    fn slices_by(&self, step_mm: impl Fn(&Segment) -> f64) -> Vec<Slice> {
        let mut slices = Vec::new();
        for (index, segment) in self.segments.iter().enumerate() {
            let length = segment.length();
            let step_mm = step_mm(segment);
            let count = ((length / step_mm - 1e-9).ceil() as usize).max(1);
            if length <= 0.0 {
                continue;
            }
            for k in 0..count {
                let ([r, z], [normal_r, normal_z]) = segment.at((k as f64 + 0.5) / count as f64);
                let edge_mm = length / count as f64;
                slices.push(Slice { z_mm: z, radius_mm: r, edge_mm, normal_r, normal_z, segment: index as u8 });
            }
        }
        slices
    }
}

fn segment_radius_below(segment: &Segment, z: f64) -> Option<f64> {
    match segment {
        Segment::Line { from, to } => {
            let (low, high) = if from[1] <= to[1] { (from, to) } else { (to, from) };
            if z < low[1] {
                None
            } else if z >= high[1] {
                Some(low[0].max(high[0]))
            } else {
                let t = (z - low[1]) / (high[1] - low[1]);
                Some(low[0].max(low[0] + t * (high[0] - low[0])))
            }
        }
        Segment::Arc { centre, radius, from_rad, to_rad } => {
            let (a, b) = (from_rad.min(*to_rad), from_rad.max(*to_rad));
            let sine = (z - centre[1]) / radius;
            if sine < a.sin() {
                return None;
            }
            let angle = sine.min(1.0).asin().min(b);
            let widest = if a <= 0.0 && angle >= 0.0 { 0.0 } else { angle };
            Some(centre[0] + radius * widest.cos())
        }
    }
}

fn segment_height_at(segment: &Segment, r: f64) -> Option<f64> {
    match segment {
        Segment::Line { from, to } => {
            let (lo, hi) = (from[0].min(to[0]), from[0].max(to[0]));
            if r < lo - 1e-12 || r > hi + 1e-12 {
                None
            } else if hi - lo < 1e-12 {
                Some(from[1].min(to[1]))
            } else {
                Some(from[1] + (to[1] - from[1]) * ((r - from[0]) / (to[0] - from[0])).clamp(0.0, 1.0))
            }
        }
        Segment::Arc { centre, radius, from_rad, to_rad } => {
            let (a, b) = (from_rad.min(*to_rad), from_rad.max(*to_rad));
            let x = (r - centre[0]) / radius;
            if !(-1.0..=1.0 + 1e-12).contains(&x) {
                return None;
            }
            let angle = -x.min(1.0).acos();
            (angle >= a - 1e-12 && angle <= b + 1e-12).then(|| centre[1] + radius * angle.sin())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_tile_the_outline() {
        let bull = Profile::bull(10.0, 2.0, 20.0);
        let total: f64 = bull.slices(0.25).iter().map(|slice| slice.edge_mm).sum();
        assert!((total - (3.0 + PI + 18.0)).abs() < 1e-9);
        let height: f64 = bull.slices(0.01).iter().map(Slice::dz_mm).sum();
        assert!((height - 20.0).abs() < 1e-4);
    }

    #[test]
    fn lowest_height_follows_the_ball() {
        let ball = Profile::ball(6.0, 10.0);
        for r in [0.0, 1.0, 2.9, 3.0] {
            assert!((ball.height_at(r).unwrap() - (3.0 - (9.0f64 - r * r).sqrt())).abs() < 1e-9);
        }
        assert!(ball.height_at(3.1).is_none());
        assert_eq!(Profile::flat(6.0, 10.0).height_at(3.0), Some(0.0));
    }
}
