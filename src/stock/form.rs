//! Outline of a cutter as the workpiece sees it. In: its profile. Out: the radius it keeps clear at a height and the height
//! it leaves at a distance from the axis, in closed form where it has one.

use crate::machine::{Profile, Segment};
use std::f64::consts::FRAC_PI_2;

/// Outline of a cutter as the sweep needs it.
#[derive(Debug, Clone)]
pub struct Form {
    /// Its profile.
    pub profile: Profile,
    /// Largest radius, mm.
    pub radius: f64,
    /// Its lowest part is flat.
    pub flat_bottom: bool,
    /// It is convex and never narrows upward, so the region that it sweeps along a line is convex too.
    pub convex: bool,
    /// Height at which the outline begins to narrow; cells that stand above it are left as they are.
    pub(super) neck: f32,
    pub(super) kind: Kind,
    /// Lowest and highest point of each segment, and the whole, mm.
    pub(super) reaches: Vec<Reach>,
    pub(super) top: f64,
}

/// Lowest and highest point of a segment above the tip, and the larger radius of its ends, mm.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    pub low: f64,
    pub high: f64,
    pub widest: f64,
}

impl Reach {
    fn of(segment: &Segment) -> Self {
        let [[r0, z0], [r1, z1]] = [0.0, 1.0].map(|t| segment.at(t).0);
        Self { low: z0.min(z1), high: z0.max(z1), widest: r0.max(r1) }
    }
}

/// Kinds of outline with a sweep of their own.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    Flat,
    Ball,
    /// Convex: its parts from the axis outward, without upright ones.
    Convex(Vec<Part>),
    Other,
}

/// A part of an outline between two distances from the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Part {
    /// Where it begins and ends, mm from the axis.
    pub from: f32,
    pub to: f32,
    pub bow: Bow,
}

/// How a part of an outline rises with the distance from the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Bow {
    /// From a height on, by so much a mm.
    Cone { low: f32, slope: f32 },
    /// About a centre (distance f from the axis, height) with a radius c, and the third root of f/2c: on a slope tan θ the sine p
    /// of its normal is near that times the third root of tan² θ at the distance f beside the path, as 2 c p³ is about f tan² θ.
    Corner { centre: [f32; 2], radius: f32, about: f32 },
}

impl Form {
    /// The form of a profile.
    pub fn new(profile: &Profile) -> Self {
        let convex = is_convex(profile);
        let kind = match parts(profile) {
            _ if profile.is_flat() => Kind::Flat,
            _ if profile.as_ball().is_some() => Kind::Ball,
            Some(parts) if convex => Kind::Convex(parts),
            _ => Kind::Other,
        };
        let flat_bottom = matches!(profile.segments.first(), Some(Segment::Line { from, to }) if from[1] == to[1]);
        let neck = profile.neck().map_or(f32::INFINITY, |neck| neck as f32);
        let reaches = profile.segments.iter().map(Reach::of).collect();
        let (radius, top) = (profile.max_radius(), profile.height());
        Self { radius, flat_bottom, convex, neck, profile: profile.clone(), kind, reaches, top }
    }
    /// A flat end mill?
    pub fn is_flat(&self) -> bool {
        self.kind == Kind::Flat
    }
    /// A ball end mill?
    pub fn is_ball(&self) -> bool {
        self.kind == Kind::Ball
    }
    /// Radius kept clear at height `z` above the tip ([`Profile::radius_below`]).
    pub fn radius_below(&self, z: f64) -> Option<f64> {
        match self.kind {
            _ if z < 0.0 => None,
            Kind::Flat => Some(self.radius),
            Kind::Ball if z >= self.radius => Some(self.radius),
            Kind::Ball => Some((z * (2.0 * self.radius - z)).sqrt()),
            _ if !self.convex => self.profile.radius_below(z),
            _ => {
                // The outline widens all the way up: the last segment that begins no higher.
                let segments = self.profile.segments.iter().zip(&self.reaches);
                let (segment, reach) = segments.rev().find(|(_, reach)| reach.low <= z)?;
                Some(radius_at(segment, reach, z))
            }
        }
    }
    /// Lowest height of the outline at distance `r` from the axis ([`Profile::height_at`]).
    pub fn height_at(&self, r: f64) -> Option<f64> {
        match self.kind {
            Kind::Flat | Kind::Ball if r > self.radius => None,
            Kind::Flat => Some(0.0),
            Kind::Ball => Some(self.radius - (self.radius * self.radius - r * r).sqrt()),
            Kind::Convex(_) | Kind::Other => self.profile.height_at(r),
        }
    }
}

/// Radius of a segment that widens upward at a height, or at its upper end, mm.
fn radius_at(segment: &Segment, reach: &Reach, z: f64) -> f64 {
    match segment {
        _ if z >= reach.high => reach.widest,
        Segment::Line { from, to } => from[0] + (z - from[1]) / (to[1] - from[1]) * (to[0] - from[0]),
        Segment::Arc { centre, radius, .. } => {
            let above = z - centre[1];
            centre[0] + (radius * radius - above * above).max(0.0).sqrt()
        }
    }
}

/// Does the outward normal turn only upward from the tip, from straight down to level at most?
fn is_convex(profile: &Profile) -> bool {
    /// Turn that is rounding, rad.
    const STRAIGHT_RAD: f64 = 1e-9;
    let angle = |segment: &Segment, t: f64| {
        let [across, up] = segment.at(t).1;
        up.atan2(across)
    };
    let whole = profile.segments.iter().filter(|segment| segment.length() > 0.0);
    let angles = whole.flat_map(|segment| [angle(segment, 0.0), angle(segment, 1.0)]);
    let angles: Vec<f64> = [-FRAC_PI_2].into_iter().chain(angles).chain([0.0]).collect();
    angles.windows(2).all(|two| two[1] >= two[0] - STRAIGHT_RAD)
}

/// The parts of an outline; `None` where one turns about a centre beyond the axis.
fn parts(profile: &Profile) -> Option<Vec<Part>> {
    let mut parts = Vec::new();
    for segment in &profile.segments {
        let [[from, low], [to, high]] = [0.0, 1.0].map(|t| segment.at(t).0);
        if to - from < 1e-9 {
            continue;
        }
        let bow = match segment {
            Segment::Line { .. } => Bow::Cone { low: low as f32, slope: ((high - low) / (to - from)) as f32 },
            Segment::Arc { centre, .. } if centre[0] < 0.0 => return None,
            Segment::Arc { centre, radius, .. } => {
                let about = (centre[0] / (2.0 * radius)).cbrt() as f32;
                Bow::Corner { centre: centre.map(|x| x as f32), radius: *radius as f32, about }
            }
        };
        parts.push(Part { from: from as f32, to: to as f32, bow });
    }
    Some(parts)
}
