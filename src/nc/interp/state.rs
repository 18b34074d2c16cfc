//! The modal state of a control, and the frame that programmed coordinates are turned into.

use crate::diag::Span;
use crate::ids::BlockId;
use crate::nc::{Feed, FeedMode, PathMode, Spin};
use crate::path::{Plane, Vec3};
use crate::units::{MM_PER_INCH, mm_s_from_mm_min};

/// Motion that axis words alone repeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// G80, or nothing yet.
    None,
    /// G0
    Rapid,
    /// G1
    Feed,
    /// G2
    Clockwise,
    /// G3
    CounterClockwise,
    /// G32, G33, G331 … : feed bound to the spindle.
    Synchronised,
    /// G33.1: in and out again, feed bound to the spindle.
    RigidTap,
    /// G31, G38.x
    Probe,
    /// A canned cycle, by its G code times ten.
    Cycle(u16),
}

/// The F word in force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedWord {
    /// Value: mm/min, mm/rev, or 1/min, by mode; 0 when there is none.
    pub value: f64,
    /// Where it stands; `None` when it is computed or not there.
    pub word: Option<(BlockId, Span)>,
    /// Set by an expression or a variable.
    pub computed: bool,
}

/// Modal state.
#[derive(Debug, Clone, Copy)]
pub struct Modal {
    /// Motion.
    pub motion: Motion,
    /// The motion of group 1 that is in force again once a cycle is cancelled.
    pub group_one: Motion,
    /// G63 as a mode: the operator's and the control's feed overrides are off, because the feed belongs to a pitch.
    pub tapping: bool,
    /// Plane of arcs, cycles and compensation.
    pub plane: Plane,
    /// G20
    pub inch: bool,
    /// G91
    pub incremental: bool,
    /// G90.1
    pub absolute_centres: bool,
    /// G93, G94, G95
    pub feed_mode: FeedMode,
    /// F
    pub feed: FeedWord,
    /// Commanded spindle speed, rev/s.
    pub speed_rps: f64,
    /// +1 clockwise, −1 counter-clockwise, 0 stopped.
    pub turning: i8,
    /// Tool in the spindle.
    pub tool: u32,
    /// Tool made ready by T.
    pub next_tool: u32,
    /// Work offset.
    pub wcs: u16,
    /// G61, G61.1, G64
    pub path_mode: PathMode,
    /// G99: cycles retract to R, not to the level they began at.
    pub retract_to_r: bool,
}

impl Default for Modal {
    fn default() -> Self {
        Self {
            motion: Motion::None,
            group_one: Motion::None,
            tapping: false,
            plane: Plane::Xy,
            inch: false,
            incremental: false,
            absolute_centres: false,
            feed_mode: FeedMode::PerMinute,
            feed: FeedWord { value: 0.0, word: None, computed: false },
            speed_rps: 0.0,
            turning: 0,
            tool: 0,
            next_tool: 0,
            wcs: 54,
            path_mode: PathMode::Continuous,
            retract_to_r: false,
        }
    }
}

impl Modal {
    /// Length unit of the program, mm.
    pub fn unit_mm(&self) -> f64 {
        if self.inch { MM_PER_INCH } else { 1.0 }
    }
    /// Spindle state.
    pub fn spin(&self) -> Spin {
        let rps = if self.turning == 0 { 0.0 } else { self.speed_rps };
        Spin { rps, reverse: self.turning < 0 && rps > 0.0 }
    }
    /// Feed of a move of this length.
    pub fn feed_of(&self, length_mm: f64) -> Feed {
        let mm_s = match self.feed_mode {
            FeedMode::PerMinute => mm_s_from_mm_min(self.feed.value),
            FeedMode::InverseTime => mm_s_from_mm_min(self.feed.value * length_mm),
            FeedMode::PerRev => self.feed.value * self.spin().rps,
        };
        Feed { mode: self.feed_mode, mm_s, word: self.feed.word }
    }
}

/// How programmed coordinates become coordinates of the work offset: mirrored and scaled (G51), turned (G68), shifted
/// (G92, G52, G10).
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// G92
    pub g92: Vec3,
    /// G92 kept aside by G92.2.
    pub g92_aside: Vec3,
    /// G52
    pub local: Vec3,
    /// Changes of work offsets by G10 L2 against the setup, by number.
    pub changed: Vec<(u16, Vec3)>,
    /// Sum of the shifts in force.
    pub shift: Vec3,
    /// G68: plane, centre, angle in rad.
    pub rotation: Option<(Plane, Vec3, f64)>,
    /// G51: centre and factor of each axis.
    pub scale: Option<(Vec3, Vec3)>,
}

impl Default for Frame {
    fn default() -> Self {
        let zero = Vec3::zeros();
        Self { g92: zero, g92_aside: zero, local: zero, changed: Vec::new(), shift: zero, rotation: None, scale: None }
    }
}

impl Frame {
    /// True when programmed coordinates are only shifted.
    #[inline]
    pub fn is_plain(&self) -> bool {
        self.rotation.is_none() && self.scale.is_none()
    }
    /// Programmed point → point in the work offset.
    #[inline]
    pub fn apply(&self, point: Vec3) -> Vec3 {
        if self.is_plain() { point + self.shift } else { self.turn(self.stretch(point)) + self.shift }
    }
    /// Point in the work offset → programmed point.
    pub fn invert(&self, point: Vec3) -> Vec3 {
        let mut p = point - self.shift;
        if let Some((plane, centre, angle)) = self.rotation {
            p = rotated(plane, centre, -angle, p);
        }
        if let Some((centre, factor)) = self.scale {
            p = centre + (p - centre).component_div(&factor);
        }
        p
    }
    /// Direction in programmed coordinates → direction in the work offset.
    pub fn linear(&self, direction: Vec3) -> Vec3 {
        let origin = Vec3::zeros();
        self.turn(self.stretch(direction)) - self.turn(self.stretch(origin))
    }
    /// Scale and mirror alone.
    pub fn stretch(&self, point: Vec3) -> Vec3 {
        self.scale.map_or(point, |(centre, factor)| centre + (point - centre).component_mul(&factor))
    }
    fn turn(&self, point: Vec3) -> Vec3 {
        self.rotation.map_or(point, |(plane, centre, angle)| rotated(plane, centre, angle, point))
    }
    /// Does it mirror the plane, so that arcs turn the other way?
    pub fn mirrors(&self, plane: Plane) -> bool {
        let (a, b, _) = plane.axes();
        self.scale.is_some_and(|(_, factor)| factor[a] * factor[b] < 0.0)
    }
    /// The change of this work offset.
    pub fn change_of(&self, wcs: u16) -> Vec3 {
        self.changed.iter().find(|(number, _)| *number == wcs).map_or_else(Vec3::zeros, |(_, change)| *change)
    }
    /// Sums the shifts up again.
    pub fn refresh(&mut self, wcs: u16) {
        self.shift = self.g92 + self.local + self.change_of(wcs);
    }
}

fn rotated(plane: Plane, centre: Vec3, angle: f64, point: Vec3) -> Vec3 {
    let (a, b, _) = plane.axes();
    let (sin, cos) = angle.sin_cos();
    let (u, v) = (point[a] - centre[a], point[b] - centre[b]);
    let mut p = point;
    p[a] = centre[a] + u * cos - v * sin;
    p[b] = centre[b] + u * sin + v * cos;
    p
}
