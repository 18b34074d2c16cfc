//! What the control does with a program. In: filled by the interpreter. Out: [`Toolpath`]: moves and other events in order of execution, in
//! mm, s, rad, which every later stage reads.
//!
//! Later stages know no G code. Coordinates are those of the work offset in force during the move (`wcs`).

use std::ops::{Deref, DerefMut};
use std::sync::Arc as Rc;

use super::doubt::Doubted;
use super::program::File;
use crate::diag::{Diagnostic, Span};
use crate::ids::{BlockId, MoveId};
use crate::path::{Arc, Curve, Plane, Vec3};

/// Rapid or feed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MoveKind {
    /// Positioning at rapid.
    Rapid,
    /// At a programmed feed.
    Feed,
}

/// Unit of an F word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FeedMode {
    /// G94: length per minute.
    PerMinute,
    /// G93: 1/minutes for the block.
    InverseTime,
    /// G95: length per revolution.
    PerRev,
}

/// Why the feed of a move must not be touched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Freeze {
    /// Feed belongs to a pitch (G33, G63, G74, G76, G84).
    Synchronised,
    /// Probing move (G31, G38.x).
    Probe,
    /// Boring, reaming and other cycles that keep their feed.
    Cycle,
    /// Feed is an expression or a variable, or is set in a macro.
    Expression,
    /// The block is executed several times.
    Repeated,
    /// The block also calls, jumps or begins a loop.
    Steers,
    /// Its F word also holds for a block before which it cannot be restated.
    SharedFeed,
    /// Simultaneous rotary motion.
    Rotary,
    /// Something in the block was not understood.
    NotUnderstood,
    /// The meaning of radius compensation is not known here.
    Compensation,
    /// The feed before the first F word, or otherwise not known.
    NoFeed,
    /// Under a block-delete switch.
    BlockDelete,
    /// The tool is not known, or must not be touched (tap, reamer, probe).
    Tool,
    /// It is made by a subprogram in another file.
    OtherFile,
    /// An approach or a departure that the control works out.
    Approach,
    /// A corner or a block with a feed of its own.
    OwnFeed,
    /// Its feed would have to be restated beside another block without a motion, under radius compensation.
    LookAhead,
    /// The proof refuses another feed in it.
    Unproved,
    /// Excluded by the setup.
    Excluded,
}

impl Freeze {
    /// One clause for reports: "feed belongs to a thread pitch".
    pub fn why(self) -> &'static str {
        match self {
            Freeze::Synchronised => "its feed belongs to a thread pitch",
            Freeze::Probe => "it is a probing move",
            Freeze::Cycle => "it is made by a cycle that keeps its feed",
            Freeze::Expression => {
                "its feed is an expression, AUTO or set in a macro; [output] computed_feeds = \"replace\" writes a number where it has one value, \
                 --expand where it has several"
            }
            Freeze::Repeated => "the block is executed several times",
            Freeze::Steers => "the block also steers the program: a call, a jump or a loop",
            Freeze::SharedFeed => "its F word also holds for a block before which it cannot be written again",
            Freeze::Rotary => "a rotary axis moves at the same time",
            Freeze::NotUnderstood => "something in the block was not understood",
            Freeze::Compensation => "the meaning of radius compensation is not known here",
            Freeze::NoFeed => "its feed is not known",
            Freeze::BlockDelete => "it depends on the block-delete switch",
            Freeze::Tool => "its tool is unknown or keeps its feed",
            Freeze::Approach => "it is an approach or a departure that the control works out",
            Freeze::OwnFeed => "it is a corner or a block with a feed of its own",
            Freeze::LookAhead => {
                "under radius compensation its feed could not be restated without two blocks in a row that do not move"
            }
            Freeze::OtherFile => "it is made by a subprogram in another file",
            Freeze::Unproved => "the proof that only feeds change does not hold with another feed in it",
            Freeze::Excluded => "the setup excludes it",
        }
    }
}

/// How the control treats the end of the move.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum PathMode {
    /// G64 without a tolerance, or nothing said: the control's own.
    #[default]
    Continuous,
    /// G64 P: within this tolerance, mm.
    Tolerance(f64),
    /// G61: exact path, corners taken at full stop only where the path bends.
    ExactPath,
    /// G61.1, G9: exact stop at the end.
    ExactStop,
}

/// Feed of a move as commanded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feed {
    /// Unit of the F word.
    pub mode: FeedMode,
    /// Feed along the path of the controlled point, mm/s (0 when not known).
    pub mm_s: f64,
    /// The block with the F word that set it, and the bytes of that word (`F` and its number); `None`: not a plain word.
    pub word: Option<(BlockId, Span)>,
    /// `mm_s` over what F says: other than 1 where a compensated arc keeps F along the contour and not along the path of the tool.
    pub over_contour: f64,
}

/// A place at which something that is not simulated may use the feed in force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedUse {
    /// Its block.
    pub block: BlockId,
    /// The feed in force, in mm and the unit of `mode`.
    pub value: f64,
    /// Unit of the feed.
    pub mode: FeedMode,
    /// The F word that set it; `None`: not a plain word.
    pub word: Option<(BlockId, Span)>,
}

/// Spindle state.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spin {
    /// Speed, rev/s, never negative; 0 when stopped.
    pub rps: f64,
    /// True when it turns counter-clockwise (M4).
    pub reverse: bool,
}

/// Additional work offset n (G54.1 P, G54 P, G154 P) has the number n above this in [`State::wcs`]; those from G54 to G59 have their code,
/// G59.1 to G59.3 have 60 to 62, G505 to G599 of a Siemens their code.
pub const BEFORE_ADDITIONAL_OFFSETS: u16 = 100;
/// Additional work offsets there are at most (Fanuc B-64304EN: 48 or 300).
pub const ADDITIONAL_OFFSETS: u16 = 300;

/// What a move has in common with most of its neighbours, kept once for all of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Feed of the move (meaningless for rapids).
    pub feed: Feed,
    /// Spindle while it is made.
    pub spin: Spin,
    /// Tool in the spindle; 0 when none was called.
    pub tool: u32,
    /// Work offset in force (54 for G54 …).
    pub wcs: u16,
    /// End of the move.
    pub path_mode: PathMode,
    /// Moves with the same number come from the same text (a block executed several times, one F word of a cycle at several positions) and
    /// so get one feed, the lowest that is safe in all of them. `None`: the feed is its own.
    pub shared: Option<u32>,
    /// Made while G41 or G42 (RL, RR) is in force, whatever it does to the path.
    pub compensated: bool,
    /// Made by a drilling or boring cycle.
    pub cycle: bool,
    /// Coolant or mist is on (M7, M8).
    pub coolant: bool,
}

/// One motion; its [`State`] reads and writes like fields of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Move {
    /// Block it comes from (for a cycle, or a call of a file that is not linked: the block that makes it happen).
    pub block: BlockId,
    /// Physical line of the program's own text that makes it happen, 1-based: that of the block, or of the call of its file.
    pub line: u32,
    /// How many times this block had been executed before (0 for plain programs).
    pub instance: u32,
    /// Rapid or feed.
    pub kind: MoveKind,
    /// Why its feed must stay; `None`: it may change.
    pub freeze: Option<Freeze>,
    /// May the block be cut in pieces? False for cycles, calls, compensation, M S T words, R arcs near a half turn …
    pub splittable: bool,
    /// Is it known where it begins? False while only the control knows where an axis stands.
    pub placed: bool,
    from: Vec3,
    to: Vec3,
    /// Centre and sweep of an arc; boxed, because few moves are arcs.
    bend: Option<Box<Bend>>,
    state: Rc<State>,
}

/// An arc without its end points: see [`Arc`].
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bend {
    plane: Plane,
    centre: Vec3,
    radius_mm: f64,
    radius_end_mm: f64,
    start_rad: f64,
    sweep_rad: f64,
    rise_mm: f64,
}

impl Move {
    /// A move of one block, its feed free to change.
    pub fn new(block: BlockId, kind: MoveKind, curve: Curve, state: Rc<State>) -> Self {
        let (from, to) = (curve.from(), curve.to());
        let line = block.0 + 1;
        let (freeze, splittable, placed) = (None, true, true);
        let mut made = Self { block, line, instance: 0, kind, freeze, splittable, placed, from, to, bend: None, state };
        made.set_curve(curve);
        made
    }
    /// Where it goes, mm.
    #[inline]
    pub fn curve(&self) -> Curve {
        let (from, to) = (self.from, self.to);
        let Some(bend) = &self.bend else { return Curve::Line { from, to } };
        let Bend { plane, centre, radius_mm, radius_end_mm, start_rad, sweep_rad, rise_mm } = **bend;
        Curve::Arc(Arc { plane, from, to, centre, radius_mm, radius_end_mm, start_rad, sweep_rad, rise_mm })
    }
    /// Sends it another way.
    pub fn set_curve(&mut self, curve: Curve) {
        (self.from, self.to) = (curve.from(), curve.to());
        self.bend = match curve {
            Curve::Line { .. } => None,
            Curve::Arc(Arc { plane, centre, radius_mm, radius_end_mm, start_rad, sweep_rad, rise_mm, .. }) => {
                Some(Box::new(Bend { plane, centre, radius_mm, radius_end_mm, start_rad, sweep_rad, rise_mm }))
            }
        };
    }
}

impl Deref for Move {
    type Target = State;
    #[inline]
    fn deref(&self) -> &State {
        &self.state
    }
}

impl DerefMut for Move {
    fn deref_mut(&mut self) -> &mut State {
        Rc::make_mut(&mut self.state)
    }
}

/// One thing the control does, in order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// A motion.
    Move(MoveId),
    /// A pause.
    Dwell {
        /// Length, s.
        seconds: f64,
        /// Physical line.
        line: u32,
    },
    /// A tool comes into the spindle.
    Tool {
        /// Its number.
        number: u32,
        /// Physical line.
        line: u32,
    },
    /// The spindle is started, stopped or set to another speed.
    Spindle {
        /// New state.
        spin: Spin,
        /// Physical line.
        line: u32,
    },
    /// M0, M1, M2, M30, M60.
    Stop {
        /// Physical line.
        line: u32,
        /// True for the end of the program.
        end: bool,
    },
}

/// Everything the control does with a program, and the diagnostics about its text.
#[derive(Debug, Clone, Default)]
pub struct Toolpath {
    /// Motions; [`Event::Move`] points here.
    pub moves: Vec<Move>,
    /// What happens between motions: each before the move of this number.
    pub between: Vec<(MoveId, Event)>,
    /// What was found on the way.
    pub diagnostics: Vec<Diagnostic>,
    /// Shifts of the programmed zero against the work offset (G92, G52, G10), mm: each holds from its move on.
    pub shifts: Vec<(MoveId, Vec3)>,
    /// Stretches on which part or frame are not known, in order of their first moves; they may overlap.
    pub doubts: Vec<Doubted>,
    /// Where something that is not simulated may use the feed in force, in order of execution.
    pub feed_uses: Vec<FeedUse>,
    /// Lines of cycles that cut and are not simulated, in order of execution.
    pub unseen_cuts: Vec<u32>,
    /// The files that were called, in the order of their first call; those linked to the program come first.
    pub files: Vec<File>,
    /// True when the program's own lengths are in inches (the unit in force at its first motion).
    pub inch: bool,
    /// Which blocks the control came to.
    pub reached: Reached,
}

/// Which blocks the control came to.
#[derive(Debug, Clone, Default)]
pub struct Reached {
    /// Number of blocks executed from the beginning, in a program without jumps and calls.
    pub(crate) first: usize,
    /// How often each block was executed, in a program with jumps or calls; else empty.
    pub(crate) counts: Vec<u32>,
}

impl Reached {
    /// Was a block executed at all?
    pub fn holds(&self, block: BlockId) -> bool {
        match self.counts.get(block.ix()) {
            Some(count) => *count > 0,
            None => self.counts.is_empty() && block.ix() < self.first,
        }
    }
}

impl Toolpath {
    /// Shift of the programmed zero at a move, mm: programmed coordinates are those of the move less the shift.
    pub fn shift_at(&self, id: MoveId) -> Vec3 {
        let after = self.shifts.partition_point(|(from, _)| *from <= id);
        if after == 0 { Vec3::zeros() } else { self.shifts[after - 1].1 }
    }
    /// Blocks that cannot be read, by number, each once. Nothing in them takes effect here, not even an F word.
    pub fn unread(&self) -> Vec<BlockId> {
        let mut blocks: Vec<BlockId> = self.doubts.iter().flat_map(|doubted| doubted.unread.iter().copied()).collect();
        blocks.sort_unstable();
        blocks.dedup();
        blocks
    }
    /// Blocks in which something that is not simulated may use the feed in force, by number, each once.
    pub fn blocks_that_use_the_feed(&self) -> Vec<BlockId> {
        let mut blocks: Vec<BlockId> = self.feed_uses.iter().map(|used| used.block).collect();
        blocks.sort_unstable();
        blocks.dedup();
        blocks
    }
    /// Every doubt that holds at a move.
    pub fn doubts_at(&self, id: MoveId) -> impl Iterator<Item = &Doubted> {
        self.doubts.iter().take_while(move |doubted| doubted.from <= id).filter(move |doubted| doubted.holds_at(id))
    }
    /// Everything the control does, in order.
    pub fn events(&self) -> impl Iterator<Item = Event> + Clone + '_ {
        let mut between = self.between.iter().peekable();
        let mut next = MoveId(0);
        std::iter::from_fn(move || {
            if let Some((_, event)) = between.next_if(|(before, _)| *before <= next) {
                return Some(*event);
            }
            let here = next;
            next.0 += 1;
            (here.ix() < self.moves.len()).then_some(Event::Move(here))
        })
    }
    /// Bytes it occupies in memory; a state counts for its share in the moves that have it.
    #[cfg(feature = "rooms")]
    pub fn memory_bytes(&self) -> usize {
        let state = size_of::<State>() + 2 * size_of::<usize>();
        let beside = |motion: &Move| {
            let bend = motion.bend.as_ref().map_or(0, |_| size_of::<Bend>());
            bend as f64 + state as f64 / Rc::strong_count(&motion.state) as f64
        };
        let vectors =
            self.moves.capacity() * size_of::<Move>() + self.between.capacity() * size_of::<(MoveId, Event)>();
        vectors + self.moves.iter().map(beside).sum::<f64>().round() as usize
    }
    /// The motions, in order.
    pub fn iter_moves(&self) -> impl Iterator<Item = (MoveId, &Move)> {
        self.moves.iter().enumerate().map(|(index, motion)| (MoveId(index as u32), motion))
    }
}
