//! The present state of a tool in its program. In: the run over the original program, the state of the tool. Out: lengths cut and left, and when
//! the tool will be worn out at a given pace of wear.

use crate::job::tool_life::{LoadKind, ToolRun};
use crate::machine::WearLaw;
use crate::outcome::ProgramRun;
use crate::setup::ToolState;
use crate::toollife::regulation::TargetLine;
use crate::toollife::trend::Trend;

/// Probabilities of the interval of the predicted end.
const INTERVAL: [f64; 3] = [0.05, 0.5, 0.95];

/// Where the tool stands: behind the last check point that was read.
pub struct Now {
    /// Length that the program cuts, m.
    pub cut_m: f64,
    /// Length cut of it by now, and at the reference feed, m.
    pub done_m: [f64; 2],
    /// The same since the edge was fresh.
    pub total_m: [f64; 2],
    /// Length to the target, m.
    pub rest_m: f64,
    /// Mean pace of wear of the program as it came.
    pub pace: f64,
    /// Target line of force at the reference feed at the next check point, N; `None` without a check point.
    pub force_n: Option<f64>,
}

impl Now {
    /// Behind the last check point of `came`, the program as it came.
    pub fn of(came: &ProgramRun, state: &ToolState) -> Self {
        let seen = ToolRun::new(came, state.tool);
        let [cut_m, wear_m] = seen.cut_m();
        let cuts = seen.checks();
        let last = cuts.iter().rfind(|cut| cut.number <= state.program.read);
        let done_m = last.map_or([0.0; 2], |cut| [cut.cut_m, cut.wear_m]);
        let total_m = [state.cut_m + done_m[0], state.wear_m() + done_m[1]];
        let next = cuts.iter().find(|cut| cut.number > state.program.read);
        let mut now =
            Self { cut_m, done_m, total_m, rest_m: state.target_m - total_m[0], pace: wear_m / cut_m, force_n: None };
        now.force_n = next.map(|cut| {
            let flutes = f64::from(came.job.tool(state.tool).map_or(1, |tool| tool.flutes));
            let feed_mm_s = state.feed_per_tooth_mm * flutes * cut.rps;
            let worn = now.target_worn(state, state.cut_m + cut.cut_m, state.index + state.rate_per_m * done_m[1]);
            seen.load_at(cut, LoadKind::ForcePeak, Some(worn), feed_mm_s)
        });
        now
    }

    /// Rise of the index over that of a fresh edge on the line from now to the end at the target.
    pub fn target_worn(&self, state: &ToolState, total_m: f64, index_now: f64) -> f64 {
        let line = TargetLine { from_m: self.total_m[0], from_n: index_now, to_m: state.target_m, to_n: state.end };
        line.at(total_m) / state.fresh - 1.0
    }

    /// Lengths in all at which the tool is worn out with the probabilities of [`INTERVAL`] where the rest is cut at a pace, m.
    pub fn ends(&self, trend: &Trend, law: &WearLaw, pace: f64) -> [Option<f64>; 3] {
        INTERVAL.map(|share| self.end(trend, law, pace, share))
    }

    /// The same with one probability, m.
    pub fn end(&self, trend: &Trend, law: &WearLaw, pace: f64, share: f64) -> Option<f64> {
        let end_m = trend.worn_out_m(share, law.end, law.end_scatter)?;
        Some(self.total_m[0] + (end_m - self.total_m[1]) / pace)
    }
}
