//! Outline of a cutter as the workpiece sees it. In: its profile. Out: the radius it keeps clear at a height and the height
//! it leaves at a distance from the axis, in closed form where it has one.

use crate::machine::{Profile, Segment};

/// Outline of a cutter as the sweep needs it.
#[derive(Debug, Clone)]
pub struct Form {
    /// Its profile.
    pub profile: Profile,
    /// Largest radius, mm.
    pub radius: f64,
    /// Its lowest part is flat.
    pub flat_bottom: bool,
    /// Height at which the outline begins to narrow; cells that stand above it are left as they are.
    pub(super) neck: f32,
    pub(super) kind: Kind,
    /// How high each segment reaches, and the whole, mm.
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
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Flat,
    Ball,
    /// Flat of radius `flat`, then a corner of radius `corner`.
    Bull {
        flat: f32,
        corner: f32,
    },
    Other,
}

impl Form {
    /// The form of a profile.
    pub fn new(profile: &Profile) -> Self {
        let kind = if profile.is_flat() {
            Kind::Flat
        } else if profile.as_ball().is_some() {
            Kind::Ball
        } else if let Some([flat, corner]) = profile.as_bull() {
            Kind::Bull { flat: flat as f32, corner: corner as f32 }
        } else {
            Kind::Other
        };
        let flat_bottom = matches!(profile.segments.first(), Some(Segment::Line { from, to }) if from[1] == to[1]);
        let neck = profile.neck().map_or(f32::INFINITY, |neck| neck as f32);
        let reaches = profile.segments.iter().map(Reach::of).collect();
        let (radius, top) = (profile.max_radius(), profile.height());
        Self { radius, flat_bottom, neck, profile: profile.clone(), kind, reaches, top }
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
            Kind::Bull { .. } | Kind::Other => self.profile.radius_below(z),
        }
    }
    /// Lowest height of the outline at distance `r` from the axis ([`Profile::height_at`]).
    pub fn height_at(&self, r: f64) -> Option<f64> {
        match self.kind {
            Kind::Flat | Kind::Ball if r > self.radius => None,
            Kind::Flat => Some(0.0),
            Kind::Ball => Some(self.radius - (self.radius * self.radius - r * r).sqrt()),
            Kind::Bull { .. } | Kind::Other => self.profile.height_at(r),
        }
    }
}
