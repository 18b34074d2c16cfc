//! Input and errors of the pipeline. In: program, setup, hooks to the outside world. Out: [`Task`] and [`Watch`] for the pipeline, [`JobError`]
//! from it.

use super::edges::WornOut;
use super::wanted::Wanted;
use crate::diag::Diagnostic;
use crate::engage::cache::Key;
use crate::engage::{self, EngageError, EngagementMap};
use crate::machine::Job;
use crate::nc::{self, Program};
use crate::path::Vec3;
use crate::setup::Assumption;
use crate::stock::Piece;

/// Spacing of the stations that the solver uses, and the finer one of the check, mm.
pub const SPACING_MM: [f64; 2] = [1.0, 0.6];

/// Why a run cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// Nothing in the text moves.
    #[error("there is no motion in it")]
    NoMotion,
    /// Feed moves with a tool that the setup does not describe: number and first line.
    #[error("{}", .0.iter().map(|(tool, line)| format!("T{tool} (line {line})")).collect::<Vec<_>>().join(", "))]
    UnknownTools(Vec<(u32, u32)>),
    /// Tools are called by names that have no numbers here.
    #[error("tools are called by names that have no numbers here")]
    ToolNames(Vec<Diagnostic>),
    /// A number of the program is written as NaN or as infinity.
    #[error("a number is written as NaN or as infinity")]
    NotFinite(Vec<Diagnostic>),
    /// From some place on no feeds hold the limits, because of the wear they cause.
    #[error(
        "line {}: T{} is worn out: its teeth have slid {:.1} m, and no feed holds {} from here on; slower feeds wear this tool faster than they unload it",
        .0.line, .0.tool, .0.slid_m, .0.kind.name()
    )]
    WornOut(WornOut),
    /// Feeds and wear did not come to rest within so many rounds.
    #[error("feeds and the wear that they cause do not settle within {0} rounds")]
    Unsettled(usize),
    /// No certificate can be made.
    #[error("{}{why}", .line.map_or_else(String::new, |line| format!("line {line} of the written program: ")))]
    NotCertified {
        /// Line of the written program.
        line: Option<u32>,
        /// Why.
        why: String,
    },
    /// The stock cannot be simulated.
    #[error(transparent)]
    Engage(#[from] EngageError),
}

/// The pipeline's connections to the outside world.
pub struct Watch<'a> {
    /// Called with the stage and the fraction of it that is done.
    pub progress: &'a (dyn Fn(&'static str, f64) + Sync),
    /// A clock: seconds since any fixed moment.
    pub clock: &'a dyn Fn() -> f64,
    /// Reads subprograms.
    pub subprograms: nc::environment::Loader<'a>,
    /// Settings of the simulation; its spacing is that of [`SPACING_MM`].
    pub engage: engage::Options<'a>,
    /// Where engagement maps and stock are stored.
    pub keep: Keep<'a>,
}

/// Finds a map by its key.
pub type Recall<'a> = dyn Fn(&Key) -> Option<EngagementMap> + 'a;
/// Keeps a map.
pub type Remember<'a> = dyn Fn(&Key, &EngagementMap) + 'a;
/// Takes pieces of stock with their shifts.
pub type TakeStock<'a> = dyn Fn(Vec<(Piece, Vec3)>) + 'a;

/// Hooks to store results beyond a run.
#[derive(Clone, Copy, Default)]
pub struct Keep<'a> {
    /// The map of an earlier run with this key. Nothing is simulated then, and `stock` is not called.
    pub recall: Option<&'a Recall<'a>>,
    /// Keeps a map under its key.
    pub remember: Option<&'a Remember<'a>>,
    /// Takes the stock as the program leaves it, each piece with the shift from the common frame into its own.
    pub stock: Option<&'a TakeStock<'a>>,
}

/// A program with its setup.
pub struct Task {
    /// The program.
    pub program: Program,
    /// Its setup.
    pub job: Job,
    /// What the setup assumes.
    pub assumptions: Vec<Assumption>,
    /// What is asked besides.
    pub wanted: Wanted,
}
