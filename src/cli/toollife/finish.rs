//! Solves for the feeds with which the tool lasts, and writes program, table, state and report. In: the state of the tool, its
//! trend, the program with its check points. Out: files, or nothing and the reason.

use super::super::error::CliError;
use super::super::input::Source;
use super::super::options::Global;
use super::super::screen::Screen;
use super::super::work::{execute, task};
use super::arguments::LifeFiles;
use super::files::{Files, digest};
use super::now::Now;
use super::outputs::Outs;
use super::reported::{Solved, check_rows};
use super::simulated::simulated;
use super::taken::{Readings, law_of};
use super::wanted::{Wants, wanted};
use crate::job::tool_life::{ToolRun, with_wear};
use crate::job::{self, Keep, Wanted};
use crate::machine::{Limits, Wear};
use crate::outcome::ProgramRun;
use crate::report::{self, Figures, HeldBack, Outcome};
use crate::setup::{PlannedProgram, ToolState};

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
    let mut task = task(&source, command.common.setup(), global, Wanted::default())?;
    let law = law_of(&state, &task.job, number);
    let wear = Wear { law, fresh: state.fresh, index: state.index.max(state.fresh) };
    let came = simulated(&source, command, Some((number, wear)), global, screen)?;
    let now = Now::of(&came, &state);
    if now.rest_m <= 0.0 {
        return Err(reached(&state, &now));
    }
    let wanted = wanted(&now, &seen.trend, &law, seen.exponent.as_ref(), &state, command.method, &mut notes)?;
    with_wear(&mut task.job, number, wear, wanted.share);
    let mine = task.job.tools.iter_mut().filter(|tool| tool.number == number);
    mine.for_each(|tool| hold(&mut tool.limits, &wanted));
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
    let lengths_m = after.lengths(None).0;
    let bytes = run.written.as_ref().map_or_else(|| run.program.own_text().to_vec(), |written| written.bytes.clone());
    let sha256 = digest(&bytes);
    let unreachable = run.answers.wear.iter().any(|answer| answer.tool == number && answer.impossible);
    let rows = check_rows(&after, &bytes, &state, &now, &seen.trend);
    let solved = Solved { run: &run, after: &after, state: &state, now: &now, law: &law, wanted: &wanted, unreachable };
    let report = solved.report(seen, rows, notes);
    let lasts = report.lasts;
    let file = outputs.program_path.display().to_string();
    let read = state.program.read;
    state.program = PlannedProgram { file, sha256: sha256.clone(), cut_m: now.cut_m, lengths_m, read };
    outputs.say(&report, screen)?;
    if is_held_back(&figures, unreachable, command) {
        files.outputs.commit()?;
        screen.say("nothing was written; with --accept-infeasible it is written at the lowest feeds that are allowed");
        return Ok(Outcome::Unmet);
    }
    outputs.write(&bytes, &report, &sha256, &state, files.outputs, screen)?;
    Ok(if lasts { figures.verdict.outcome } else { Outcome::Unmet })
}

/// What is wanted, as limits of the tool.
fn hold(limits: &mut Limits, wanted: &Wants) {
    let least = |known: Option<f64>, new: f64| Some(known.map_or(new, |known| known.min(new)));
    if let Some(force_n) = wanted.force_n {
        limits.force_xy_n = least(limits.force_xy_n, force_n);
    }
    if !wanted.may_rise {
        limits.feed_change_max = least(limits.feed_change_max, 1.0);
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

fn is_the_same(run: &ProgramRun) -> Result<(), CliError> {
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
