//! Figures of the report on the life of a tool. In: the solved program, the present state of the tool, the readings. Out: the report with its
//! verdict, and the check points of the written program.

use super::now::Now;
use super::taken::Readings;
use super::wanted::Wants;
use crate::job::tool_life::{CheckCut, LoadKind, ToolRun};
use crate::machine::WearLaw;
use crate::outcome::ProgramRun;
use crate::report::life::{CheckRow, LifeReport};
use crate::report::{self, WRITTEN_BY};
use crate::rewrite;
use crate::schedule::wear::SETTLED;
use crate::setup::ToolState;
use crate::toollife::trend::Trend;
use crate::units::{mm_min_from_mm_s, rpm_from_rps};

/// A program with the feeds with which the tool is to last, and what they were solved for.
pub struct Solved<'a> {
    /// The run over the written program.
    pub run: &'a ProgramRun,
    /// The tool in it.
    pub after: &'a ToolRun<'a>,
    /// State of the tool when the program begins.
    pub state: &'a ToolState,
    /// Where the tool stands.
    pub now: &'a Now,
    /// Law of its wear.
    pub law: &'a WearLaw,
    /// What was asked of the feeds.
    pub wanted: &'a Wants,
    /// Not even the lowest feeds keep the budget.
    pub unreachable: bool,
}

impl Solved<'_> {
    /// The report; `seen` is what the readings say.
    pub fn report(&self, seen: Readings, check_points: Vec<CheckRow>, notes: Vec<String>) -> LifeReport {
        let Self { run, after, state, now, law, wanted, .. } = self;
        let trend = &seen.trend;
        let [_, wear_m] = after.cut_m();
        let rest_m = now.cut_m - now.done_m[0];
        let pace = if rest_m > 0.0 { (wear_m - now.done_m[1]) / rest_m } else { now.pace };
        let assured_m = now.end(trend, law, pace, 1.0 - state.assurance);
        // Whatever was asked of the feeds: what counts is the wear that those of the file leave.
        let lasts = assured_m.is_none_or(|m| m >= (1.0 - SETTLED) * state.target_m);
        let answer = run.answers.wear.iter().find(|answer| answer.tool == state.tool);
        LifeReport {
            written_by: WRITTEN_BY,
            tool: state.tool,
            index_unit: state.index_unit.clone(),
            index: [trend.at(now.total_m[1]), state.fresh, law.end],
            index_deviation: trend.deviation(now.total_m[1]),
            rate_per_m: [trend.rate, trend.rate_variance.sqrt()],
            counted: law.rate.counted.name(),
            exponent: law.rate.exponent,
            exponent_seen: seen.exponent.map(|seen| [seen.power, seen.deviation]),
            left_out: [trend.run_in, trend.outliers],
            cut_m: now.total_m[0],
            target_m: state.target_m,
            assurance: state.assurance,
            worn_out_m: now.ends(trend, law, pace),
            worn_out_as_it_came_m: now.ends(trend, law, now.pace),
            budget: wanted.share,
            longer_life_costs_s: answer.and_then(|answer| answer.longer_life_costs_s),
            time_s: [run.realised_before.total_s, run.realised_after().total_s],
            readings: seen.rows,
            check_points,
            notes,
            lasts,
            verdict: verdict(self, lasts, assured_m),
        }
    }
}

fn verdict(solved: &Solved, lasts: bool, assured_m: Option<f64>) -> String {
    let Solved { state, wanted, unreachable, .. } = solved;
    let (tool, target, share) = (state.tool, report::short(state.target_m), report::short(100.0 * state.assurance));
    let reach = assured_m.map_or_else(|| "any length".to_owned(), |m| format!("{} m", report::short(m)));
    let not = format!("T{tool} does not reach its target of {target} m with {share} %");
    if lasts {
        format!("T{tool} reaches its target of {target} m with {share} %")
    } else if *unreachable {
        format!("{not}, not even at the lowest feeds: these reach {reach}")
    } else if wanted.force_n.is_some() {
        format!("{not}: the feeds of this force reach {reach}; --method budget keeps the {share} % wherever feeds can")
    } else if state.exponent <= 0.0 {
        format!("{not}, and slower feeds would not help: change it at {reach}")
    } else {
        format!("{not}: at these feeds it reaches {reach}")
    }
}

/// The check points of the written program.
pub fn check_rows(after: &ToolRun, bytes: &[u8], state: &ToolState, now: &Now, trend: &Trend) -> Vec<CheckRow> {
    let written = crate::nc::parse(bytes.to_vec(), Some(after.run().program.dialect()));
    let marks = rewrite::checks(&written);
    let row = |cut: &CheckCut| {
        let mark = marks.iter().find(|mark| (mark.number, mark.cycle) == (cut.number, cut.cycle))?;
        let total_m = state.cut_m + cut.cut_m;
        let target = now.target_worn(state, total_m, trend.at(now.total_m[1]));
        let power_w = after.load(cut, LoadKind::Power, None);
        Some(CheckRow {
            check: cut.number,
            cycle: cut.cycle,
            line: written.place(mark.block).0,
            position_mm: [cut.position.x, cut.position.y, cut.position.z],
            cut_m: cut.cut_m,
            total_m,
            feed_mm_min: mm_min_from_mm_s(cut.feed_mm_s),
            spindle_rpm: rpm_from_rps(cut.rps),
            force_xy_n: after.load(cut, LoadKind::ForcePeak, None),
            target_force_xy_n: after.load(cut, LoadKind::ForcePeak, Some(target)),
            power_w,
            meter_w: after.run().job.machine.spindle.meter_w(power_w),
        })
    };
    after.checks().iter().filter_map(row).collect()
}
