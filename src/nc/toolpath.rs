//! What the control does with a program: moves and other events in order of execution, in mm, s, rad.
//!
//! Nothing below this layer knows a G-code. Coordinates are those of the work offset the move was made in ([`Move::wcs`]).

use crate::diag::{Diagnostic, Span};
use crate::ids::{BlockId, MoveId};
use crate::path::{Curve, Vec3};

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
    /// The block is executed several times, or its modal feed is shared with one that is.
    Repeated,
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
            Freeze::Expression => "its feed is an expression or is set in a macro",
            Freeze::Repeated => "the block is executed several times",
            Freeze::Rotary => "a rotary axis moves at the same time",
            Freeze::NotUnderstood => "something in the block was not understood",
            Freeze::Compensation => "what radius compensation means here is not known",
            Freeze::NoFeed => "its feed is not known",
            Freeze::BlockDelete => "it depends on the block-delete switch",
            Freeze::Tool => "its tool is unknown or keeps its feed",
            Freeze::OtherFile => "it is made by a subprogram in another file",
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
}

/// Spindle state.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spin {
    /// Speed, rev/s, never negative; 0 when stopped.
    pub rps: f64,
    /// True when it turns counter-clockwise (M4).
    pub reverse: bool,
}

/// One motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Move {
    /// Block it comes from (for a cycle or a call: the block that makes it happen).
    pub block: BlockId,
    /// Physical line of that block, 1-based.
    pub line: u32,
    /// How many times this block had been executed before (0 for plain programs).
    pub instance: u32,
    /// Rapid or feed.
    pub kind: MoveKind,
    /// Where it goes, mm.
    pub curve: Curve,
    /// Its feed (meaningless for rapids).
    pub feed: Feed,
    /// Spindle while it is made.
    pub spin: Spin,
    /// Tool in the spindle; 0 when none was called.
    pub tool: u32,
    /// Work offset in force (54 for G54 …).
    pub wcs: u16,
    /// End of the move.
    pub path_mode: PathMode,
    /// Why its feed must stay; `None`: it may change.
    pub freeze: Option<Freeze>,
    /// May the block be cut in pieces? False for cycles, calls, compensation, M S T words, R arcs near a half turn …
    pub splittable: bool,
    /// Moves with the same number are made by the same text (a block executed several times, one F word of a cycle at
    /// several positions): they get one feed, the lowest of what is safe in each. `None`: the feed is its own.
    pub shared: Option<u32>,
}

/// One thing the control does, in order.
#[derive(Debug, Clone, PartialEq)]
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

/// Everything the control does, and what was to be said about the text.
#[derive(Debug, Clone, Default)]
pub struct Toolpath {
    /// Events in order.
    pub events: Vec<Event>,
    /// Motions; [`Event::Move`] points here.
    pub moves: Vec<Move>,
    /// What was found on the way.
    pub diagnostics: Vec<Diagnostic>,
    /// Shifts of the programmed zero against the work offset (G92, G52, G10), mm: each holds from its move on.
    pub shifts: Vec<(MoveId, Vec3)>,
    /// True when the program's own lengths are in inches (the unit in force at its first motion).
    pub inch: bool,
}

impl Toolpath {
    /// Shift of the programmed zero at a move, mm: programmed coordinates are those of the move less the shift.
    pub fn shift_at(&self, id: MoveId) -> Vec3 {
        let after = self.shifts.partition_point(|(from, _)| *from <= id);
        if after == 0 { Vec3::zeros() } else { self.shifts[after - 1].1 }
    }
    /// Bytes it occupies in memory.
    pub fn memory_bytes(&self) -> usize {
        self.moves.capacity() * size_of::<Move>() + self.events.capacity() * size_of::<Event>()
    }
    /// The motions, in order.
    pub fn iter_moves(&self) -> impl Iterator<Item = (MoveId, &Move)> {
        self.moves.iter().enumerate().map(|(index, motion)| (MoveId(index as u32), motion))
    }
}
