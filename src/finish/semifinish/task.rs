//! Input and errors of the semi-finish stock adjustment: both programs, the job, the settings.

use crate::engage::{Again, EngageError, EngagementMap};
use crate::machine::Job;
use crate::nc::Toolpath;

/// The settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Reference force, N; `None`: the mean of the finishing force as it is.
    pub force_n: Option<f64>,
    /// Least and largest stock that may be left, mm.
    pub stock_mm: [f64; 2],
    /// Largest change of stock per mm along the path.
    pub change: f64,
    /// Largest deviation of chords from the arc they replace, mm.
    pub tolerance_mm: f64,
}

/// Default bounds of stock, mm: the least is that of the cuts by which layer models are calibrated (Nishida, Table 1:
/// 50 to 200 µm); the largest reaches the depths that Eq. 1 gives for a pick feed of 0.3 mm (0.38 mm), beyond the
/// calibrated range.
pub const STOCK_MM: [f64; 2] = [0.05, 0.4];
/// Range of depths for which layer models are calibrated, mm (Nishida, Table 1); a warning is given outside it.
pub const CALIBRATED_MM: [f64; 2] = [0.05, 0.2];
/// Default largest change of stock per mm of path: the angle between semi-finished and finished surface is at most 3°.
/// Judgement.
pub const CHANGE: f64 = 0.05;
/// Default tolerance of chords, mm: two increments of the third decimal.
pub const TOLERANCE_MM: f64 = 0.002;

/// Simulates a toolpath, reusing the stations of moves that are known.
pub type Simulate<'a> = dyn Fn(&Toolpath, Option<Again>) -> Result<EngagementMap, EngageError> + 'a;

/// Both programs with the job.
pub struct Task<'a> {
    /// Motions of the semi-finish.
    pub semi: &'a Toolpath,
    /// Motions of the finish.
    pub finish: &'a Toolpath,
    /// The job.
    pub job: &'a Job,
    /// For each move of the semi-finish: may its coordinates be rewritten?
    pub movable: &'a [bool],
    /// The settings.
    pub wanted: Wanted,
    /// The simulation.
    pub simulate: &'a Simulate<'a>,
}

/// Why the semi-finish cannot be adjusted.
#[derive(Debug, thiserror::Error)]
pub enum SemifinishError {
    /// A program without a feed move of a ball end mill.
    #[error("the {which} program cuts with no ball end mill: {found}")]
    NoBall {
        /// Semi-finish or finish.
        which: &'static str,
        /// What it cuts with instead.
        found: String,
    },
    /// Two different balls.
    #[error(
        "the {which} program cuts with two ball end mills, T{} and T{}: give each operation as a program of its own",
        .tools[0], .tools[1]
    )]
    TwoBalls {
        /// Semi-finish or finish.
        which: &'static str,
        /// Both numbers.
        tools: [u32; 2],
    },
    /// Nothing that the finish cuts was left by the semi-finish.
    #[error(
        "the finish cuts nothing that the semi-finish left: {cut_mm:.1} mm of its path cut stock, none of it on the \
         surface of the semi-finish"
    )]
    NeverMeet {
        /// Length on which the finish cuts at all, mm.
        cut_mm: f64,
    },
    /// They meet in the other order.
    #[error(
        "the finish cuts nothing that the semi-finish left, but the semi-finish cuts what the finish left: the two \
         programs are in the wrong order"
    )]
    WrongOrder,
    /// One is in another unit.
    #[error(
        "the finish is {times:.3} times as large as the semi-finish, and they hardly meet: one of the two is in \
         another unit (an inch is 25.4 mm)"
    )]
    OtherUnit {
        /// Extent of the finish over that of the semi-finish.
        times: f64,
    },
    /// The ball of the semi-finish is too large to reach the surface.
    #[error(
        "the semi-finishing ball of R {semi_mm} mm leaves no surface along the finish: it is larger than the hollows \
         that the finishing ball of R {finish_mm} mm cuts"
    )]
    TooLarge {
        /// Radius of the semi-finishing ball, mm.
        semi_mm: f64,
        /// Radius of the finishing ball, mm.
        finish_mm: f64,
    },
    /// No stock that may be left gives the reference anywhere.
    #[error(
        "a finishing force of {wanted_n} N is out of reach: the nearest that was found is {:.2} to {:.2} N, with {:.3} \
         to {:.3} mm of stock", force_n[0], force_n[1], stock_mm[0], stock_mm[1]
    )]
    OutOfReach {
        /// Reference, N.
        wanted_n: f64,
        /// Least and largest force, N.
        force_n: [f64; 2],
        /// Least and largest stock with it, mm.
        stock_mm: [f64; 2],
    },
    /// No force can be predicted for the finish.
    #[error(
        "no finishing force can be predicted: the setup gives T{tool} no valid force model, or its spindle stands still"
    )]
    NoForce {
        /// Its tool.
        tool: u32,
    },
    /// No move whose stock the finish cuts may be rewritten.
    #[error(
        "none of the moves that leave the stock of the finish can be rewritten: they stand in loops, cycles or \
         subprograms, under radius compensation, or in blocks that do more than move"
    )]
    NothingFree,
    /// What the programs leave lies in different cells.
    #[error(
        "what the programs leave cannot be compared, so whether the moved one gouges is not known: give --resolution"
    )]
    NotCompared,
    /// The finish meets the semi-finish only in entries and exits.
    #[error(
        "the finish is nowhere in full cut in the stock that the semi-finish left: every cut is shorter than twice the \
         contact of the ball"
    )]
    NoFullCut,
    /// A dialect that cannot be rewritten.
    #[error("semi-finishes in the dialect {name} cannot be moved")]
    Dialect {
        /// Its name.
        name: &'static str,
    },
    /// An inconsistent setting.
    #[error("{what}")]
    Bad {
        /// What is wrong.
        what: String,
    },
    /// The stock cannot be simulated.
    #[error(transparent)]
    Engage(#[from] EngageError),
}

impl SemifinishError {
    /// What to do about it.
    pub fn help(&self) -> &'static str {
        match self {
            Self::NoBall { .. } => {
                "only ball ends are moved; give the program of the ball, and shape = \"ball\" in its [[tool]]"
            }
            Self::TwoBalls { .. } | Self::Engage(_) | Self::NotCompared => "",
            Self::NeverMeet { .. } => {
                "give the semi-finish that runs right before this finish, both with the same zero point; more than the \
                 least stock must be left between them"
            }
            Self::OtherUnit { .. } => "look at G20 and G21, and at what the post wrote",
            Self::TooLarge { .. } => {
                "take a smaller ball for the semi-finish; its stock can be chosen only where it touches"
            }
            Self::WrongOrder => "give the semi-finish first, and the program behind it with --finish",
            Self::OutOfReach { .. } => {
                "nothing was written; take another --force-xy, allow other --stock, or change feed or pick of the \
                 finish"
            }
            Self::NoForce { .. } => {
                "give [material] and an S word; `feedwright simulate` on the finish says what is missing"
            }
            Self::NoFullCut => "give programs of whole passes",
            Self::NothingFree => "post the semi-finish as plain moves",
            Self::Dialect { .. } => {
                "post the semi-finish for a control that reads G code (ISO 6983), if the machine does"
            }
            Self::Bad { .. } => "see `feedwright semifinish --help`",
        }
    }
}
