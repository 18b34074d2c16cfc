//! Answers to what a run was asked besides: how far limits taken from the program itself depend on the coefficients, what
//! happens when the world is not as assumed, what a measured cycle time says; and final surfaces on their own. In: numbers found by [`crate::job`].
//! Out: lines for the screen; the JSON report takes them as they are.

use super::number::{clock, length, short};
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

impl Answers {
    /// Lines for the screen; `rewritten`: there is a time saved to speak of.
    pub fn text(&self, rewritten: bool) -> String {
        let mut text = String::new();
        match &self.cycle {
            Some(cycle) => text += &cycle.text(),
            None if rewritten => text += "saving    unconfirmed: no cycle time or log of this machine was given\n",
            None => {}
        }
        if let Some(reference) = &self.reference {
            text += &reference.text();
        }
        text.extend(self.wear.iter().map(Wear::text));
        if !self.stress.is_empty() {
            text += "stress    the written program, largest load over its limit (99 % of the length below)\n";
        }
        for case in &self.stress {
            text += &case.text();
        }
        text
    }
}

impl Reference {
    fn text(&self) -> String {
        let each = |moved: &Moved| {
            format!(
                "          coefficients {:+.0} %: feeds {:+.1} % on average, {:+.1} % at most\n",
                100.0 * (moved.factor - 1.0),
                super::number::unsigned_zero(moved.mean_percent, 1),
                super::number::unsigned_zero(moved.largest_percent, 1)
            )
        };
        let lines: String = self.coefficients.iter().map(each).collect();
        format!("reference loads that {} % of each tool's own cut length stays below\n{lines}", short(self.percentile))
    }
}

impl Stressed {
    fn text(&self) -> String {
        match (self.worst_ratio, self.p99_ratio) {
            (Some(worst), Some(p99)) => format!("          {:<34}{worst:>8.3}  ({p99:.3})\n", self.case),
            _ => format!("          {:<34} cannot be simulated\n", self.case),
        }
    }
}

impl Cycle {
    fn text(&self) -> String {
        let measured = clock(self.measured_s);
        let Some([low, high]) = self.acceleration else {
            return format!("saving    unconfirmed: no acceleration explains the {measured} measured\n");
        };
        let saved = self.saved_percent.map_or(String::new(), |[least, most]| {
            format!("; with them {} … {} % are saved", short(least), short(most))
        });
        format!(
            "cycle     {measured} measured: accelerations {} … {} of the setup's, by corner tolerance{saved}\n",
            short(low),
            short(high)
        )
    }
}

impl Surface {
    /// A line for the screen; the length in the unit of the program.
    pub fn text(&self, rewritten: bool, inch: bool) -> String {
        let [before, after] = self.mark_max_mm.map(|mm| short(1e3 * mm));
        let marks = if rewritten { format!("{before} → {after}") } else { before };
        let [before, after] = self.commanded_s.map(clock);
        let time = if rewritten { format!("{before} → {after}") } else { before };
        let length = length(self.length_mm, inch);
        format!("surface   {length} of cuts make the finished surface, {time}; feed marks up to {marks} µm\n")
    }
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
    fn text(&self) -> String {
        let of = if self.of_life { "its life" } else { "the program's as programmed" };
        let Some(most) = self.most else { return format!("wear T{}   {} of {of}\n", self.tool, short(self.used)) };
        let rest = match self.longer_life_costs_s {
            _ if self.impossible && self.slower_is_no_safer => {
                "no feeds keep it: slower ones do not spare this tool; change it earlier".to_owned()
            }
            _ if self.impossible => "not even the lowest feeds keep it".to_owned(),
            Some(costs_s) => {
                let saves = short(self.percent_saves_s);
                format!("10 % more life costs {} s, one percent more wear saves {saves} s", short(costs_s))
            }
            None => {
                format!("no feeds give 10 % more life; one percent more wear saves {} s", short(self.percent_saves_s))
            }
        };
        format!("wear T{}   {} of {of}, {} allowed; {rest}\n", self.tool, short(self.used), short(most))
    }
}
