//! What is asked of a plan, and why there is none.

use super::layout::Layout;
use crate::engage::EngageError;
use crate::force::ForceError;

/// What the user requests.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Name of the program's file, without folder and ending.
    pub name: String,
    /// Tool; `None`: the only ball or bull-nose end of the setup.
    pub tool: Option<u32>,
    /// Spindle speed, rev/s; `None`: the setup's.
    pub rps: Option<f64>,
    /// Feed, mm/s; `None`: chosen up to what the setup allows.
    pub feed_mm_s: Option<f64>,
    /// Reference force, N; `None`: the setup's force_xy.
    pub force_n: Option<f64>,
    /// Largest scallop, mm.
    pub scallop_mm: f64,
    /// Thickness of the stock on the surface, mm, unless an earlier program left it.
    pub stock_mm: f64,
    /// Least and largest step-over, mm; `None`: from the tool.
    pub step_over_mm: [Option<f64>; 2],
    /// Layout of the passes.
    pub layout: Layout,
    /// Largest deviation of lines and arcs from the path on the surface, mm.
    pub tolerance_mm: f64,
}

/// Why there is no program.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// One sentence, and the remedy.
    #[error("{why}")]
    Plain {
        /// What is wrong.
        why: String,
        /// The remedy.
        help: String,
    },
}

impl Refusal {
    /// A refusal.
    pub fn new(why: impl Into<String>, help: impl Into<String>) -> Self {
        Refusal::Plain { why: why.into(), help: help.into() }
    }
}

impl From<ForceError> for Refusal {
    fn from(error: ForceError) -> Self {
        Refusal::new(error.to_string(), "correct the tool, the material or the speed in the setup")
    }
}

impl From<EngageError> for Refusal {
    fn from(error: EngageError) -> Self {
        Refusal::new(error.to_string(), "the written program could not be simulated, so it is not written")
    }
}

/// Area of a surface that passes of one height leave out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// Slope below which they leave it out, rad.
    pub shallowest_rad: f64,
    /// Machined area, mm².
    pub machined_mm2: f64,
    /// The part of it with less slope, mm².
    pub shallow_mm2: f64,
    /// Area of the steeper part, where the tool reaches it, on which more is left than the scallop limit, mm².
    pub strips_mm2: f64,
}
