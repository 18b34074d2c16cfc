//! Solves for the feeds with which the tool lasts, and writes program, table, state and report. In: the state of the tool, its
//! trend, the program with its check points. Out: files, or nothing and the reason.

use std::path::PathBuf;

use super::super::Outcome;
use super::super::args::{Global, LifeFiles, Method};
use super::super::error::CliError;
use super::super::input::Source;
use super::super::output::{Kind, Output};
use super::super::screen::Screen;
use super::super::work::{execute, task};
use super::files::{Files, digest, output_name, table_name};
use super::simulated::simulated;
use super::taken::{Readings, law_of};
use crate::job::tool_life::{CheckCut, LoadKind, ToolRun, with_wear};
use crate::job::{self, Keep, Wanted};
use crate::machine::{Wear, WearLaw};
use crate::report::life::{CheckRow, LifeReport, checks_csv, life_json, life_words};
use crate::report::{self, Figures, HeldBack, Run, WRITTEN_BY};
use crate::rewrite;
use crate::setup::{PlannedProgram, ToolState, write_tool_state};
use crate::toollife::regulation::{Regulation, TargetLine, regulate};
use crate::toollife::trend::Trend;
use crate::units::{mm_min_from_mm_s, rpm_from_rps};

/// Probabilities of the interval of the predicted end.
const INTERVAL: [f64; 3] = [0.05, 0.5, 0.95];

/// Everything that is needed.
pub struct Planned<'a> {
    /// State of the tool when the program begins, with what was read in it.
    pub state: ToolState,
    /// What that says.
    pub seen: Readings,
    /// What is to be known.
    pub notes: Vec<String>,
    /// Last line whose feed stays; `None`: all of them.
    pub frozen_to: Option<u32>,
    /// The program with its check points.
    pub source: Source,
    /// Files.
    pub files: Files,
    /// The command.
    pub command: &'a LifeFiles,
}

/// Solves and writes.
pub fn finish(planned: Planned, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let Planned { mut state, seen, mut notes, frozen_to, source, mut files, command } = planned;
    let (name, number) = (source.name.clone(), state.tool);
    let mut outputs = Outs::open(&mut files, command, &source, number)?;
    let mut task = task(&source, command.setup.as_deref(), global, Wanted::default())?;
    let law = law_of(&state, &task.job, number);
    let wear = Wear { law, index: Some(state.index.max(state.fresh)) };
    let came = simulated(&source, command, Some((number, wear)), global, screen)?;
    let now = Now::of(&came, &state);
    if now.rest_m <= 0.0 {
        return Err(reached(&state, &now));
    }
    let wanted = wanted(&now, &seen.trend, &law, &state, command.method, &mut notes)?;
    with_wear(&mut task.job, number, wear, wanted.share);
    if let (Some(force_n), Some(tool)) = (wanted.force_n, task.job.tools.iter_mut().find(|t| t.number == number)) {
        tool.limits.force_xy_n = Some(tool.limits.force_xy_n.map_or(force_n, |known| known.min(force_n)));
    }
    let run = match frozen_to {
        None => came,
        Some(line) => {
            task.job.output.exclude.extend((line > 0).then_some((1, line)));
            execute(source, task, job::optimize, global, screen, Keep::default())?.run
        }
    };
    let figures = report::figures(&run);
    screen.diagnostics(&name, run.program.own_text(), &run.diagnostics);
    is_the_same(&run)?;
    let after = ToolRun::new(&run, number);
    let [_, after_wear_m] = after.cut_m();
    let bytes = run.written.as_ref().map_or_else(|| run.program.own_text().to_vec(), |written| written.bytes.clone());
    let sha256 = digest(&bytes);
    let unreachable = run.answers.wear.iter().any(|answer| answer.tool == number && answer.impossible);
    let lasts = wanted.lasts && !unreachable;
    let rows = check_rows(&after, &bytes, &state, &now, &seen.trend);
    let report = reported(&run, &after, &state, seen, &now, &law, &wanted, lasts, unreachable, rows, notes);
    let file = outputs.program_path.display().to_string();
    let read = state.program.read;
    state.program = PlannedProgram { file, sha256: sha256.clone(), cut_m: now.cut_m, wear_m: after_wear_m, read };
    outputs.say(&report, screen)?;
    if is_held_back(&figures, unreachable, command) {
        screen.say("nothing was written; with --accept-infeasible it is written at the lowest feeds that are allowed");
        return Ok(Outcome::Unmet);
    }
    outputs.write(&bytes, &report, &sha256, &state, screen)?;
    Ok(if lasts { figures.verdict.outcome } else { Outcome::Unmet })
}

/// Outputs, each ready before the work begins.
struct Outs {
    program: Output,
    program_path: PathBuf,
    table: Output,
    table_path: PathBuf,
    state: Output,
    state_path: PathBuf,
    json: Option<Output>,
}

impl Outs {
    fn open(files: &mut Files, command: &LifeFiles, source: &Source, tool: u32) -> Result<Self, CliError> {
        let program_path = command.output.clone().unwrap_or_else(|| output_name(source.path.as_deref()));
        let table_path = command.table.clone().unwrap_or_else(|| table_name(&program_path, &files.folder));
        let state_path = files.state_path(tool);
        Ok(Self {
            program: files.outputs.open(&program_path, Kind::Program)?,
            table: files.outputs.open(&table_path, Kind::Checks)?,
            state: files.outputs.open(&state_path, Kind::ToolState)?,
            json: command.json.as_deref().map(|path| files.outputs.open(path, Kind::Json)).transpose()?,
            program_path,
            table_path,
            state_path,
        })
    }

    /// The report, whether the program is written or not.
    fn say(&mut self, report: &LifeReport, screen: Screen) -> Result<(), CliError> {
        let files = [Some(&self.program), Some(&self.table), self.json.as_ref()];
        let words = life_words(report);
        if files.into_iter().flatten().any(Output::is_stdout) {
            screen.say(&words);
        } else {
            screen.show(&words)?;
        }
        self.json.take().map_or(Ok(()), |json| json.write(life_json(report).as_bytes()))
    }

    fn write(
        self,
        bytes: &[u8],
        report: &LifeReport,
        sha256: &str,
        state: &ToolState,
        screen: Screen,
    ) -> Result<(), CliError> {
        self.program.write(bytes)?;
        self.table.write(checks_csv(&report.check_points, &sha256[..8]).as_bytes())?;
        self.state.write(write_tool_state(state).as_bytes())?;
        for path in [&self.program_path, &self.table_path, &self.state_path] {
            screen.say(&format!("written   {}", path.display()));
        }
        Ok(())
    }
}

/// Where the tool stands: behind the last check point that was read.
struct Now {
    /// Length that the program cuts, m.
    cut_m: f64,
    /// Length cut of it by now, and at the reference feed, m.
    done_m: [f64; 2],
    /// The same since the edge was fresh.
    total_m: [f64; 2],
    /// Length to the target, m.
    rest_m: f64,
    /// Mean pace of wear of the program as it came.
    pace: f64,
    /// Target line of force at the reference feed at the next check point, N; `None` without a check point.
    force_n: Option<f64>,
}

impl Now {
    fn of(came: &Run, state: &ToolState) -> Self {
        let seen = ToolRun::new(came, state.tool);
        let [cut_m, wear_m] = seen.cut_m();
        let cuts = seen.checks();
        let last = cuts.iter().rfind(|cut| cut.number <= state.program.read);
        let done_m = last.map_or([0.0; 2], |cut| [cut.cut_m, cut.wear_m]);
        let total_m = [state.cut_m + done_m[0], state.wear_m + done_m[1]];
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
    fn target_worn(&self, state: &ToolState, total_m: f64, index_now: f64) -> f64 {
        let line = TargetLine { from_m: self.total_m[0], from_n: index_now, to_m: state.target_m, to_n: state.end };
        line.at(total_m) / state.fresh - 1.0
    }

    /// Lengths in all at which the tool is worn out with the probabilities of [`INTERVAL`] where the rest is cut at a pace, m.
    fn ends(&self, trend: &Trend, law: &WearLaw, pace: f64) -> [Option<f64>; 3] {
        INTERVAL.map(|share| self.end(trend, law, pace, share))
    }

    fn end(&self, trend: &Trend, law: &WearLaw, pace: f64, share: f64) -> Option<f64> {
        let end_m = trend.worn_out_m(share, law.end, law.end_scatter)?;
        Some(self.total_m[0] + (end_m - self.total_m[1]) / pace)
    }
}

fn reached(state: &ToolState, now: &Now) -> CliError {
    CliError::unmet(
        format!(
            "T{} has cut {:.1} m: its target of {:.1} m is reached already",
            state.tool, now.total_m[0], state.target_m
        ),
        "nothing was written; give a longer target to `toollife plan`, or change the tool: --new-tool",
    )
}

/// What regulation asks of the feeds.
struct Wants {
    /// Share of its life that the tool may use in the whole program.
    share: Option<f64>,
    /// Most force, N.
    force_n: Option<f64>,
    /// Will the tool last?
    lasts: bool,
}

fn wanted(
    now: &Now,
    trend: &Trend,
    law: &WearLaw,
    state: &ToolState,
    method: Method,
    notes: &mut Vec<String>,
) -> Result<Wants, CliError> {
    let why = if law.exponent < 0.0 { "wears it more per metre" } else { "wears it as much per metre" };
    let exponent = report::short(law.exponent);
    match regulate(trend, law, now.total_m[1], now.rest_m, state.assurance, now.pace) {
        Regulation::WornOut => Err(CliError::unmet(
            format!(
                "T{} is worn out, or so near to it that no feed keeps the assurance of {}: index {:.1} {} at {:.1} m, end {:.1}",
                state.tool,
                state.assurance,
                trend.at(now.total_m[1]),
                state.index_unit,
                now.total_m[0],
                law.end
            ),
            "nothing was written; change the tool, then `toollife plan --new-tool`",
        )),
        Regulation::NoUse { .. } if method == Method::Force => Err(CliError::new(
            format!(
                "the exponent of the law of wear is {exponent}: a slower feed {why}, so lowering the force shortens no wear"
            ),
            "leave --method out; nothing was written",
        )),
        Regulation::NoUse { lasts } => {
            notes.push(format!(
                "the exponent of its law of wear is {exponent}: a slower feed {why}, so no feed was lowered for its life"
            ));
            Ok(Wants { share: None, force_n: None, lasts })
        }
        Regulation::Pace(_) if method == Method::Force => {
            let force_n = now.force_n.ok_or_else(|| {
                CliError::new("there is no check point ahead to regulate the force at", "leave --method out")
            })?;
            Ok(Wants { share: None, force_n: Some(force_n), lasts: true })
        }
        Regulation::Pace(pace) => {
            let wear_m = now.done_m[1] + pace * (now.cut_m - now.done_m[0]);
            let share = 1e3 * law.rate_per_mm * wear_m / (law.end - state.fresh);
            Ok(Wants { share: Some(share.max(f64::MIN_POSITIVE)), force_n: None, lasts: true })
        }
    }
}

fn is_the_same(run: &Run) -> Result<(), CliError> {
    let Some(written) = run.written.as_ref().filter(|written| !written.check.identical) else { return Ok(()) };
    let differences = written.check.differences.join("; ");
    Err(CliError::new(
        format!("the rewritten program would not be the same but for its feeds: {differences}"),
        "nothing was written; leave the block out with [output] exclude, and please report it",
    ))
}

fn is_held_back(figures: &Figures, unreachable: bool, command: &LifeFiles) -> bool {
    let held = figures.verdict.held_back();
    let never = held.iter().any(|why| *why == HeldBack::NoMeeting || *why == HeldBack::Collision);
    never || (!held.is_empty() || unreachable) && !command.accept_infeasible
}

#[allow(clippy::too_many_arguments)]
fn reported(
    run: &Run,
    after: &ToolRun,
    state: &ToolState,
    seen: Readings,
    now: &Now,
    law: &WearLaw,
    wanted: &Wants,
    lasts: bool,
    unreachable: bool,
    check_points: Vec<CheckRow>,
    notes: Vec<String>,
) -> LifeReport {
    let trend = &seen.trend;
    let [_, wear_m] = after.cut_m();
    let rest_m = now.cut_m - now.done_m[0];
    let pace = if rest_m > 0.0 { (wear_m - now.done_m[1]) / rest_m } else { now.pace };
    let assured_m = now.end(trend, law, pace, 1.0 - state.assurance);
    // A force on the target line says nothing of the assurance: that follows from the wear it leaves.
    let lasts = lasts && (wanted.force_n.is_none() || assured_m.is_none_or(|m| m >= state.target_m));
    let answer = run.answers.wear.iter().find(|answer| answer.tool == state.tool);
    LifeReport {
        written_by: WRITTEN_BY,
        tool: state.tool,
        index_unit: state.index_unit.clone(),
        index: [trend.at(now.total_m[1]), state.fresh, law.end],
        index_deviation: trend.deviation(now.total_m[1]),
        rate_per_m: [trend.rate, trend.rate_variance.sqrt()],
        exponent: law.exponent,
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
        verdict: verdict(state, lasts, unreachable, assured_m),
    }
}

fn verdict(state: &ToolState, lasts: bool, unreachable: bool, assured_m: Option<f64>) -> String {
    let (tool, target, share) = (state.tool, report::short(state.target_m), report::short(100.0 * state.assurance));
    let reach = assured_m.map_or_else(|| "any length".to_owned(), |m| format!("{} m", report::short(m)));
    let not = format!("T{tool} does not reach its target of {target} m with {share} %");
    match (lasts, unreachable) {
        (true, _) => format!("T{tool} reaches its target of {target} m with {share} %"),
        (false, true) => format!("{not}, not even at the lowest feeds: these reach {reach}"),
        (false, false) if state.exponent <= 0.0 => {
            format!("{not}, and slower feeds would not help: change it at {reach}")
        }
        (false, false) => format!("{not}: at these feeds it reaches {reach}"),
    }
}

/// The check points of the written program.
fn check_rows(after: &ToolRun, bytes: &[u8], state: &ToolState, now: &Now, trend: &Trend) -> Vec<CheckRow> {
    let written = crate::nc::parse(bytes.to_vec(), Some(after.run().program.dialect()));
    let marks = rewrite::checks(&written);
    let row = |cut: &CheckCut| {
        let mark = marks.iter().find(|mark| (mark.number, mark.cycle) == (cut.number, cut.cycle))?;
        let total_m = state.cut_m + cut.cut_m;
        let target = now.target_worn(state, total_m, trend.at(now.total_m[1]));
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
            power_w: after.load(cut, LoadKind::Power, None),
        })
    };
    after.checks().iter().filter_map(row).collect()
}
