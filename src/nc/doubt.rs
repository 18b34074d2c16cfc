//! Doubts. In: an event of a program after which the simulation cannot know where the part stands or what is left of it: a stop at which it
//! may be turned over, an unknown code, a probed zero. Out: [`Doubted`]: from which move on, until which, and why.
//!
//! A move in doubt may be slowed down where its predicted loads are too high, but it never runs faster than programmed, and it never counts
//! as air. A doubt ends where the program makes the unknown known again (a known work offset, the initial frame), or does not arise where
//! the setup confirms it to be harmless: `confirm` lists [`Doubt::name`]s.

use crate::ids::{BlockId, MoveId};

/// Why part or frame are not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Doubt {
    /// M0, M60: somebody may have turned the part over, exchanged it or clamped it anew.
    ProgramStop,
    /// A rotary axis stands elsewhere than at the start.
    RotaryAxis,
    /// Tool centre point control or a tilted plane is in force.
    TiltedFrame,
    /// A work offset whose origin the setup does not give.
    WorkOffset,
    /// The zero was shifted by an amount that is not known (G10, G52, G92, a datum preset).
    ZeroShift,
    /// The length offset in force is not the one that the tool came in with, or was set by the program.
    ToolLength,
    /// A measured position sets something: what it measures is not known.
    Probe,
    /// A subprogram or macro that is not there may have moved anything.
    MissingProgram,
    /// A code that is not known may have moved or changed anything.
    UnknownCode,
    /// A position depends on a variable that the program did not set.
    UnknownValue,
    /// The program does not say whether it is in inches, and its numbers do not either.
    Unit,
    /// M4: a right-hand cutter does not cut that way round.
    Reversed,
    /// G96, where S is a cutting speed, or G92 S below S: how fast the spindle turns is the control's to say.
    SurfaceSpeed,
    /// G41 or G42 whose path is not known: what it means to the control, the radius in the offset, or a contour that it would refuse.
    Compensation,
    /// Blocks stand under block-delete switches of different numbers: which of them are on is not known.
    BlockDelete,
}

/// What a doubt means for the place of the tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Displaced {
    /// The tool stands where it is assumed.
    No,
    /// The frame changes before the motion of the block, whose absolute words then count in the new one.
    Before,
    /// The tool may be anywhere behind the block.
    Behind,
}

impl Doubt {
    /// Every doubt.
    pub const ALL: [Doubt; 15] = [
        Doubt::ProgramStop,
        Doubt::RotaryAxis,
        Doubt::TiltedFrame,
        Doubt::WorkOffset,
        Doubt::ZeroShift,
        Doubt::ToolLength,
        Doubt::Probe,
        Doubt::MissingProgram,
        Doubt::UnknownCode,
        Doubt::UnknownValue,
        Doubt::Unit,
        Doubt::Reversed,
        Doubt::SurfaceSpeed,
        Doubt::Compensation,
        Doubt::BlockDelete,
    ];

    /// Where the tool may stand because of it.
    pub fn displaces(self) -> Displaced {
        match self {
            Doubt::RotaryAxis | Doubt::Unit | Doubt::Reversed | Doubt::SurfaceSpeed | Doubt::BlockDelete => {
                Displaced::No
            }
            Doubt::TiltedFrame | Doubt::WorkOffset | Doubt::ZeroShift | Doubt::ToolLength => Displaced::Before,
            Doubt::ProgramStop
            | Doubt::Probe
            | Doubt::MissingProgram
            | Doubt::UnknownCode
            | Doubt::UnknownValue
            | Doubt::Compensation => Displaced::Behind,
        }
    }

    /// May something run that uses the feed in force?
    pub fn may_use_the_feed(self) -> bool {
        matches!(self, Doubt::MissingProgram | Doubt::UnknownCode)
    }

    /// May anything run there, and what ran before run again? Loads of that are not known.
    pub fn may_run_anything(self) -> bool {
        matches!(self, Doubt::MissingProgram | Doubt::UnknownCode | Doubt::UnknownValue)
    }

    /// Name in the setup file and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Doubt::ProgramStop => "program-stop",
            Doubt::RotaryAxis => "rotary-axis",
            Doubt::TiltedFrame => "tilted-frame",
            Doubt::WorkOffset => "work-offset",
            Doubt::ZeroShift => "zero-shift",
            Doubt::ToolLength => "tool-length",
            Doubt::Probe => "probe",
            Doubt::MissingProgram => "missing-program",
            Doubt::UnknownCode => "unknown-code",
            Doubt::UnknownValue => "unknown-value",
            Doubt::Unit => "unit",
            Doubt::Reversed => "reversed-spindle",
            Doubt::SurfaceSpeed => "surface-speed",
            Doubt::Compensation => "compensation",
            Doubt::BlockDelete => "block-delete",
        }
    }

    /// What the setup can say to settle it.
    pub fn remedy(self) -> &'static str {
        match self {
            Doubt::ProgramStop => "if the part stays as it is clamped: confirm = [\"program-stop\"] in the setup",
            Doubt::RotaryAxis => {
                "give each position as a program of its own, or confirm = [\"rotary-axis\"] in the setup"
            }
            Doubt::TiltedFrame => {
                "give each plane as a program of its own, or confirm = [\"tilted-frame\"] in the setup"
            }
            Doubt::WorkOffset => "give the origin of every work offset under [offsets], or confirm = [\"work-offset\"]",
            Doubt::ZeroShift => {
                "give the origin under [offsets] or the start of the tool, or confirm = [\"zero-shift\"]"
            }
            Doubt::ToolLength => "if the tip stays where it was: confirm = [\"tool-length\"] in the setup",
            Doubt::Probe => "if the probed zero is that of the setup: confirm = [\"probe\"]",
            Doubt::MissingProgram => "put it beside the program, or confirm = [\"missing-program\"] in the setup",
            Doubt::UnknownCode => "if it moves neither part nor frame: confirm = [\"unknown-code\"] in the setup",
            Doubt::Unit => "write G20 or G21 into the program, or program_unit under [machine]",
            Doubt::Reversed => "if the tool is a left-hand one: confirm = [\"reversed-spindle\"] in the setup",
            Doubt::SurfaceSpeed => "write G97 and the speed in rpm, or confirm = [\"surface-speed\"] in the setup",
            Doubt::Compensation => {
                "say what G41 means (compensation under [machine]) and give the tool; if the radius is its own: confirm = [\"compensation\"]"
            }
            Doubt::BlockDelete => {
                "if no more than one of these switches is ever on, or all of them are: confirm = [\"block-delete\"]"
            }
            Doubt::UnknownValue => "set the variable in the program, or confirm = [\"unknown-value\"] in the setup",
        }
    }

    /// One clause for reports: "the part may have been turned over".
    pub fn why(self) -> &'static str {
        match self {
            Doubt::ProgramStop => "the part may have been turned over or clamped anew at the stop",
            Doubt::RotaryAxis => "a rotary axis has turned the part",
            Doubt::TiltedFrame => "the plane is tilted, or the control follows the tool tip",
            Doubt::WorkOffset => "the setup does not say where this work offset lies",
            Doubt::ZeroShift => "the zero, or the place where the tool starts, is not known",
            Doubt::ToolLength => "the tool length in force may be another than that of this tool",
            Doubt::Probe => "a probed position sets the zero",
            Doubt::MissingProgram => "a subprogram or macro is missing",
            Doubt::UnknownCode => "a code whose meaning is not known stands before it",
            Doubt::Unit => "whether it is in inches or mm is not certain: neither G20 nor G21, or F beside G70",
            Doubt::Reversed => "the spindle turns backwards (M4)",
            Doubt::SurfaceSpeed => {
                "how fast the spindle turns is the control's to say (G96, or a limit by G92 S below S)"
            }
            Doubt::Compensation => "where radius compensation (G41, G42) has taken the tool is not known",
            Doubt::BlockDelete => "which of several block-delete switches are on is not known",
            Doubt::UnknownValue => "where it goes, or how often, depends on a variable that the program does not set",
        }
    }
}

/// A stretch of the program in doubt.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Doubted {
    /// First move in doubt.
    pub from: MoveId,
    /// First move that is no longer in doubt; `None`: all are, to the end.
    pub until: Option<MoveId>,
    /// Why.
    pub doubt: Doubt,
    /// Physical line of the event, 1-based.
    pub line: u32,
    /// Blocks in it that cannot be read, in the order of execution. Nothing in them takes effect here, not even an F word; what the control
    /// does with them is not known.
    pub unread: Vec<BlockId>,
}

impl Doubted {
    /// Is this move in doubt?
    pub fn holds_at(&self, id: MoveId) -> bool {
        self.from <= id && self.until.is_none_or(|until| id < until)
    }
}
