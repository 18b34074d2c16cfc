//! What a control remembers from block to block: modes, frame, position, offsets, spindle, compensation, corners, cycles. In: changed by the
//! files beside this one. Out: read by them. What only one family of dialects remembers is in its own folder.

use super::intersection::{OffsetElement, Point};
use crate::diag::Span;
use crate::ids::BlockId;
use crate::nc::doubt::Doubt;
use crate::nc::expr::Target;
use crate::nc::toolpath::{Feed, FeedMode, Freeze, PathMode, Spin};
use crate::path::{Plane, Vec3};
use crate::units::{MM_PER_INCH, mm_s_from_mm_min};

/// What is left to execute in a block after its family has read it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum After {
    /// Nothing: it was flow control, or its family has executed it.
    Done,
    /// Its words.
    Words,
    /// It is a command to the control, not a block of the program: it stays as it is and does nothing here.
    Command,
}

/// What a block does with its axis words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// The modal or stated motion.
    Move,
    /// A motion in machine coordinates (G53).
    Machine,
    /// G28, G30: to the reference point.
    Home,
    /// G92, G52, G10 and the like (code times ten).
    Offset(u16),
    /// G4
    Dwell,
    /// Nothing: the words belong to something that is kept as it is.
    Keep,
}

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

/// Where the feed of a compensated arc holds. With the contour's radius r and the tool centre's R that centre runs at F · R/r where it holds along the
/// contour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArcFeed {
    /// Along the path of the tool centre (CFTCP, M111).
    Centre,
    /// Along the contour (CFC, M109).
    Contour,
    /// Along the contour inside of it, where the centre gets slower, and along the path of the centre outside (CFIN, M110).
    Inside,
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
    /// Where F holds on compensated arcs.
    pub arc_feed: ArcFeed,
    /// Commanded spindle speed, rev/s.
    pub speed_rps: f64,
    /// Highest speed that the program allows (G92 S), rev/s.
    pub most_rps: f64,
    /// +1 clockwise, −1 counter-clockwise, 0 stopped.
    pub turning: i8,
    /// Coolant or mist is on.
    pub coolant: bool,
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
    /// G16: radius, mm, and angle, rad, of polar coordinates as last written; `None` under G15.
    pub polar: Option<(f64, f64)>,
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
            arc_feed: ArcFeed::Centre,
            feed_mode: FeedMode::PerMinute,
            feed: FeedWord { value: 0.0, word: None, computed: false },
            speed_rps: 0.0,
            most_rps: f64::INFINITY,
            turning: 0,
            coolant: false,
            tool: 0,
            next_tool: 0,
            wcs: 54,
            path_mode: PathMode::Continuous,
            retract_to_r: false,
            polar: None,
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
        Feed { mode: self.feed_mode, mm_s, word: self.feed.word, over_contour: 1.0 }
    }
}

/// How programmed coordinates become coordinates of the work offset: mirrored and scaled (G51), turned (G68), shifted
/// (G92, G52, G10, an allowance for the length of the tool).
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// G92
    pub g92: Vec3,
    /// G92 kept aside by G92.2.
    pub g92_aside: Vec3,
    /// The program has set or cleared it.
    pub g92_said: bool,
    /// G52
    pub local: Vec3,
    /// Changes of work offsets by G10 L2 against the setup, by number.
    pub changed: Vec<(u16, Vec3)>,
    /// Allowance for the length of the tool (DL of a tool call): its tip stands so much higher than the program says, mm.
    pub longer_mm: f64,
    /// Sum of the shifts in force.
    pub shift: Vec3,
    /// G68: plane, centre, angle in rad.
    pub rotation: Option<(Plane, Vec3, f64)>,
    /// G51: centre and factor of each axis.
    pub scale: Option<(Vec3, Vec3)>,
    /// A frame that is not followed is in force (a tilted plane, polar interpolation): every feed is kept.
    pub lost: bool,
}

impl Default for Frame {
    fn default() -> Self {
        let zero = Vec3::zeros();
        Self {
            g92: zero,
            g92_aside: zero,
            g92_said: false,
            local: zero,
            changed: Vec::new(),
            longer_mm: 0.0,
            shift: zero,
            rotation: None,
            scale: None,
            lost: false,
        }
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
        self.shift = self.g92 + self.local + self.change_of(wcs) + Vec3::new(0.0, 0.0, self.longer_mm);
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

/// Where the tool is.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// Programmed position, mm, before scaling, rotation and shift.
    pub programmed: Vec3,
    /// Position of the tool, mm, in the work offset.
    pub tool: Vec3,
    /// Has this axis been commanded, or was its position known from the start?
    pub known: [bool; 3],
    /// Does only the control know where this axis stands? So after a probing move, a block that was not understood, a command to the control
    /// itself, or a reference point that the setup does not give, until the axis is commanded to an absolute position.
    pub elsewhere: [bool; 3],
    /// Does it depend on the block-delete switch where this axis stands?
    pub by_switch: [bool; 3],
    /// May this axis stand elsewhere because of a doubt? Until it is commanded to an absolute position no block is cut in pieces.
    pub displaced: [bool; 3],
    /// Was this axis taken to begin at zero, because only steps of it were commanded? Until it is commanded to an absolute position.
    pub assumed: [bool; 3],
    /// A probing move was made.
    pub probed: bool,
}

impl Place {
    /// Is the place of this axis not known: never commanded, after a probing move, after something not understood?
    pub fn is_open(&self, axis: usize) -> bool {
        !self.known[axis] || self.elsewhere[axis] || self.by_switch[axis] || self.assumed[axis]
    }
}

/// The rotary axes A, B, C.
#[derive(Debug, Clone, Copy, Default)]
pub struct Rotary {
    /// Where they stand, deg; NaN at a reference point.
    pub at: [f64; 3],
    /// The last motion turned one of them in a cut.
    pub in_cut: bool,
    /// Their zero was set anew while one of them was turned.
    pub zero_lost: bool,
}

/// Work offsets as the program uses them.
#[derive(Debug, Clone)]
pub struct Offsets {
    /// The offset of the first motion.
    pub first: Option<u16>,
    /// The offset of the last motion.
    pub last: u16,
    /// Offsets that the program sets to other values than the setup.
    pub unstated: Vec<u16>,
    /// Work offsets that G10 has turned (R), by the number behind P.
    pub turned: Vec<u16>,
}

/// Which offset is in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Length {
    /// None since the tool came in.
    #[default]
    Unsaid,
    /// The one with this number.
    Number(u32),
    /// None any more, or one that the setup cannot describe: G49, G44, G43.1, one that the program has written.
    Other,
}

/// The length offset of the tool in the spindle.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ToolLength {
    /// The first one since it came in.
    pub first: Length,
    /// The one in force.
    pub now: Length,
    /// Of the tools so far that took a length by its number: that number and the tool.
    pub taken: Vec<(u32, u32)>,
    /// Numbers that the program wrote anew after a tool had taken them: what they say then is another length.
    pub rewritten: Vec<u32>,
}

/// How spindle and tool changes are commanded.
#[derive(Debug, Clone, Copy)]
pub struct Spindle {
    /// An S word was executed.
    pub speed_said: bool,
    /// Nothing in the program switches the spindle, and the setup has its speed: it is switched by hand.
    pub by_hand: bool,
    /// A T word alone brings the tool in.
    pub t_changes_tool: bool,
}

/// The block being executed.
#[derive(Debug, Clone)]
pub struct BlockState {
    /// Which one, in the text it stands in.
    pub id: BlockId,
    /// Something in it cannot be read: it sets nothing.
    pub misread: Option<Span>,
    /// Why its moves must keep their feed.
    pub freeze: Option<Freeze>,
    /// Feed of its moves alone, in mm and the feed mode in force.
    pub own_feed: Option<f64>,
    /// May its moves be cut in pieces?
    pub splittable: bool,
    /// Does it command a step rather than a place?
    pub steps: bool,
    /// Was each axis commanded before it, or its place known from the start?
    pub placed: bool,
    /// Where the tool stands behind it is in doubt, whatever its words say.
    pub displaced: bool,
    /// Length of the contour that it programs, mm, where the tool runs beside it: its time is that of this length.
    pub contour_mm: Option<f64>,
    /// Centre and radius of an arc of the contour, mm, where the tool runs beside it.
    pub contour_arc: Option<(Vec3, f64)>,
    /// Its assignments, in force once it is read; `None` makes a variable vacant.
    pub assignments: Vec<(Target, Option<f64>)>,
}

/// G41/G42 in force without moving the tool aside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contour {
    /// It is not.
    Off,
    /// The path is written as the tool runs, and there is no wear.
    AsWritten,
    /// What it means is not known: feeds are kept.
    Unknown,
}

/// Radius compensation.
#[derive(Debug, Clone)]
pub struct Compensation {
    /// It moves the tool aside.
    pub active: Option<Active>,
    /// It is in force but moves nothing aside.
    pub contour: Contour,
    /// G41 or G42 is in force, whatever it does to the path.
    pub on: bool,
    /// G41/G42 ranges seen so far.
    pub ranges: usize,
    /// Ranges a control would have to refuse in this pass, and in the one before.
    pub refused: Vec<usize>,
    /// The same, found in the pass before.
    pub refused_before: Vec<usize>,
    /// A range was read as if the control offset it, only to see whether it could.
    pub undecided: bool,
    /// The second pass, in which that is known.
    pub deciding: bool,
    /// Wear offsets that the program set, mm.
    pub wear_set: Vec<(u32, f64)>,
    /// Radii that the program wrote, by the number of their offset, mm.
    pub radius_written: Vec<(u32, f64)>,
    /// (tool, offset) with which it was switched on.
    pub offsets_used: Vec<(u32, u32)>,
    /// A D word stood alone: it holds for the next G41 or G42 without one.
    pub d_alone: bool,
    /// The next motion comes back from a contour that is not known.
    pub comes_back: bool,
    /// Oversize of the tool's radius over the tool table, mm (DR in a tool call).
    pub oversize_mm: f64,
}

/// Compensation that moves the tool aside.
#[derive(Debug, Clone, Copy)]
pub struct Active {
    /// +1: the tool is left of the contour, −1: right.
    pub side: f64,
    /// Radius of the tool, mm.
    pub radius: f64,
    /// Where it was switched on: its ordinal in the program.
    pub range: usize,
    /// The element of the contour before the next corner.
    pub before: Option<PreviousElement>,
}

/// An element of the contour whose end the next corner may still move.
#[derive(Debug, Clone, Copy)]
pub struct PreviousElement {
    /// The element, moved aside.
    pub moved: OffsetElement,
    /// Direction of the contour at its end.
    pub direction: Point,
    /// Its move; those after it only rise or sink.
    pub index: usize,
    /// +1 when it bends counter-clockwise, −1 clockwise, 0 straight.
    pub bend: f64,
    /// It leads to the contour: its end is square to the element after it, once that is known.
    pub entry: bool,
}

/// What a corner becomes, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Corner {
    /// An arc of this radius.
    Round(f64),
    /// A chamfer of this length.
    Chamfer(f64),
    /// A chamfer that takes this much of either side.
    Legs(f64),
}

/// A straight motion that a corner may follow, and how things stood before it.
#[derive(Debug, Clone)]
pub struct Leg {
    /// Programmed start.
    pub from: Vec3,
    /// Programmed end.
    pub to: Vec3,
    /// Where the tool was.
    pub tool: Vec3,
    /// Compensation at its start.
    pub compensation: Option<Active>,
    /// Moves made before it.
    pub first_move: usize,
    /// Events before it.
    pub events: usize,
}

/// Corners that are rounded or chamfered by a word.
#[derive(Debug, Clone, Default)]
pub struct Corners {
    /// The corner between the last motion and the next, and where it is asked for.
    pub now: Option<(Corner, Span)>,
    /// The corner behind the motion of this block.
    pub next: Option<(Corner, Span)>,
    /// Feed of the corner between the last motion and the next where it has its own, mm/s.
    pub feed: Option<f64>,
    /// Feed of the corner behind the motion of this block where it has its own, mm/s.
    pub next_feed: Option<f64>,
    /// Feed of every corner without its own, where it is not that of the motion before it, mm/s.
    pub modal_feed: Option<f64>,
    /// The straight motion it cuts short.
    pub leg: Option<Leg>,
}

/// Words of a drilling or boring cycle that stay in force, mm and s.
#[derive(Debug, Clone, Copy, Default)]
pub struct Cycle {
    /// Level at which cycles came into force.
    pub initial: f64,
    /// Depth.
    pub depth: Option<f64>,
    /// R
    pub retract: Option<f64>,
    /// Is the depth a step from the R plane?
    pub depth_is_step: bool,
    /// Is the R plane a step from the initial level?
    pub retract_is_step: bool,
    /// Q
    pub peck: Option<f64>,
    /// P
    pub dwell_s: f64,
    /// I, J: how far a boring tool steps aside.
    pub shift: [f64; 2],
    /// K: where back boring ends.
    pub top: Option<f64>,
}

/// Drilling and boring cycles.
#[derive(Debug, Clone, Default)]
pub struct Cycles {
    /// The cycle in force.
    pub modal: Option<Cycle>,
    /// The motions of one hole are being made.
    pub in_hole: bool,
    /// Feed moves of cycles, each with the block whose F word drives it.
    pub driven: Vec<(u32, BlockId)>,
}

/// Counts of the diagnostics so far.
#[derive(Debug, Clone, Default)]
pub struct Messages {
    /// How often each diagnostic code was used.
    pub said: Vec<(&'static str, u32)>,
    /// For each doubt, in the order of [`Doubt::ALL`].
    pub raised: [Raised; Doubt::ALL.len()],
}

/// Diagnostic and open stretch of one kind of doubt.
#[derive(Debug, Clone, Copy, Default)]
pub struct Raised {
    /// Place of its diagnostic in the list.
    pub diagnostic: Option<usize>,
    /// Places that raise it.
    pub count: u32,
    /// Place of the open stretch in the list.
    pub open: Option<usize>,
}
