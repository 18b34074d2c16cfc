//! Results of the options of a run: how far limits from the program itself depend on the coefficients (`--reference`), loads under other
//! assumptions (`--stress`), the control fitted to a measured time (`--cycle-time`); also totals of final surfaces. In: filled by [`crate::job`].
//! Out: plain data, which the JSON report contains as it is and [`crate::report`] puts into words.

use schemars::JsonSchema;
use serde::Serialize;

/// What was found; each part only if it was asked for.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct Answers {
    /// `--reference self`: percentile of the program's own loads that became limits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<Reference>,
    /// `--stress`: the written program under each variation.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stress: Vec<Stressed>,
    /// `--cycle-time`: the control fitted to it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cycle: Option<Cycle>,
    /// Moves that leave the finished surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub final_surface: Option<Surface>,
    /// `--certificate`: its text, a file of its own.
    #[serde(skip)]
    pub certificate: Option<String>,
    /// What the program uses of the budget of wear of each tool.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub wear: Vec<Wear>,
}

/// Limits taken from the program itself.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Reference {
    /// Percentile of the cut length.
    pub percentile: f64,
    /// How the highest feeds allowed in cuts move when all coefficients are off.
    pub coefficients: Vec<Moved>,
}

/// Feeds under other coefficients.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Moved {
    /// Factor on all coefficients.
    pub factor: f64,
    /// Mean change of the highest feed over the cut length, %.
    pub mean_percent: f64,
    /// Largest change, %.
    pub largest_percent: f64,
}

/// The written program under one variation.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Stressed {
    /// What is varied.
    pub case: &'static str,
    /// Largest load over its limit; `None`: it cannot be simulated.
    pub worst_ratio: Option<f64>,
    /// The ratio that 99 % of the cut length stays below.
    pub p99_ratio: Option<f64>,
}

/// What one measured time says.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Cycle {
    /// Time measured, s.
    pub measured_s: f64,
    /// Factors on the accelerations of the setup that explain it, least and largest; `None`: none does.
    pub acceleration: Option<[f64; 2]>,
    /// Time saved under them, %.
    pub saved_percent: Option<[f64; 2]>,
}

/// Final surfaces before and after.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Surface {
    /// Length of path that leaves final surface, mm.
    pub length_mm: f64,
    /// Length over commanded feed there, before and after, s.
    pub commanded_s: [f64; 2],
    /// Highest feed marks f_t² / 8R, before and after, mm.
    pub mark_max_mm: [f64; 2],
    /// Their mean over the length, before and after, mm.
    pub mark_mean_mm: [f64; 2],
}

/// What a program uses of the life of a tool, and what a budget of it came to.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Wear {
    /// Tool number.
    pub tool: u32,
    /// The most it may use: a share of its life, or of what the program uses as programmed; `None`: no budget was asked for.
    pub most: Option<f64>,
    /// What it uses: of its life at the feeds of the program, of the program's at the highest feeds allowed.
    pub used: f64,
    /// Is it a share of its life?
    pub of_life: bool,
    /// Seconds that one percent more of it would save.
    pub percent_saves_s: f64,
    /// Seconds that a life longer by a tenth costs, at the highest feeds allowed; `None` where no feeds give it.
    pub longer_life_costs_s: Option<f64>,
    /// By the law of this tool a slower feed never spares it.
    pub slower_is_no_safer: bool,
    /// No feeds keep it.
    pub impossible: bool,
}

impl Wear {
    /// The answer where no budget was asked for: only what the program uses of a tool's life.
    pub fn without_budget(tool: u32, used: f64, slower_is_safer: bool) -> Self {
        Self {
            tool,
            most: None,
            used,
            of_life: true,
            percent_saves_s: 0.0,
            longer_life_costs_s: None,
            slower_is_no_safer: !slower_is_safer,
            impossible: false,
        }
    }
}
