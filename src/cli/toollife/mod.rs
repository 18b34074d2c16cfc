//! `toollife plan` and `toollife update`. In: a program, its setup, the state of a tool, readings. Out: the program with check
//! points and new feeds, the table to fill in, the state, a report.

mod arguments;
mod files;
mod finish;
mod now;
mod outputs;
mod readings;
mod reported;
mod simulated;
mod taken;
mod wanted;

use super::error::CliError;
use super::input::{self, Source};
use super::options::Global;
use super::screen::Screen;
use crate::ids::BlockId;
use crate::job::tool_life::{LoadKind, ToolRun};
use crate::machine::Wear;
use crate::outcome::ProgramRun;
use crate::report::Outcome;
use crate::rewrite::{self, CheckMark};
use crate::setup::ToolState;
use crate::toollife::check_points::{self, CheckPoint, Spread};
pub use arguments::ToolLife;
use arguments::{LifePlan, LifeUpdate, ToolLifeCommand};
use files::{Files, digest, lives, no_tool, the_tool};
use finish::{Planned, finish};
use simulated::simulated;
use taken::{Readings, begun, law_of, noise, take_in, trend_of};

/// Plans or updates.
pub fn toollife(command: &ToolLife, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    match &command.what {
        ToolLifeCommand::Plan(command) => plan(command, global, screen),
        ToolLifeCommand::Update(command) => update(command, global, screen),
    }
}

fn plan(command: &LifePlan, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let source = input::program(&command.files.program)?;
    let files = Files::new(&command.files, &source, global);
    let run = simulated(&source, &command.files, None, global, screen)?;
    let tool = the_tool(&run, command.files.tool)?;
    let old = if command.new_tool { None } else { files.state_at(tool, &run.job)? };
    let cut_m = 1e-3 * check_points::cut_mm(&run.toolpath, &run.map, tool);
    if cut_m <= 0.0 {
        let text = format!("T{tool} cuts nothing in {}", source.name);
        return Err(CliError::new(text, "correct [stock], or name another --tool"));
    }
    let mut state = begun(&run, tool, old, command.assurance);
    let parts = f64::from(command.target_parts.unwrap_or(1));
    state.target_m = command.target_length.unwrap_or(state.cut_m + parts * cut_m);
    let every_m = command.every.unwrap_or(0.25 * cut_m);
    let spread = Spread { tool, first_mm: 1e3 * command.first.unwrap_or(every_m), every_mm: 1e3 * every_m };
    let points = check_points::choose(&run.toolpath, &run.map, &run.job, &run.before, &spread);
    let mut notes = Vec::new();
    if points.is_empty() {
        let is_any = !check_points::steady(&run.toolpath, &run.map, &run.job, &run.before, tool).is_empty();
        let why = if is_any {
            "no steady cut lies at the lengths asked for: no check points; give another --first or --every, m"
        } else {
            "no cut of this program is steady for long enough to read a load in it: no check points"
        };
        notes.push(why.to_owned());
    }
    let marked = rewrite::with_checks(&run.program, &marks(&run, &points));
    let seen_from = ToolRun::new(&run, tool);
    let first = points.first().and_then(|point| seen_from.cut(1, 1, *point.cycles.first()?));
    let trend = trend_of(&state, noise(&seen_from, first.as_ref(), LoadKind::ForcePeak, &state));
    let planned = Planned {
        state,
        seen: Readings { trend, rows: Vec::new(), exponent: None },
        notes,
        frozen_to: Some(0),
        source: Source { bytes: marked, ..source },
        files,
        command: &command.files,
    };
    finish(planned, global, screen)
}

fn marks(run: &ProgramRun, points: &[CheckPoint]) -> Vec<CheckMark> {
    let block = |place: &check_points::Cycle| run.toolpath.moves[place.move_id.ix()].block;
    let of_point = |point: &CheckPoint| {
        let number = point.number;
        let cycles = point.cycles.iter().zip(1..).map(move |(place, cycle)| (block(place), number, cycle));
        cycles.collect::<Vec<(BlockId, u32, u32)>>()
    };
    let all = points.iter().flat_map(of_point);
    all.map(|(block, number, cycle)| CheckMark { block, number, cycle }).collect()
}

fn update(command: &LifeUpdate, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let source = input::program(&command.files.program)?;
    let mut files = Files::new(&command.files, &source, global);
    files.outputs.keep(&command.measured);
    let job = input::setup(command.files.common.setup(), &source, global)?.job;
    let wears: Vec<u32> = lives(&job).map(|tool| tool.number).collect();
    let only = wears.first().copied().filter(|_| wears.len() == 1);
    let number = command.files.tool.or(only).ok_or_else(|| no_tool(&wears))?;
    let state = planned_for(&files, &source, number, &job)?;
    let wear = Wear { law: law_of(&state, &job, number), fresh: state.fresh, index: state.index };
    let run = simulated(&source, &command.files, Some((number, wear)), global, screen)?;
    let told = readings::read(command, &run, number, &state)?;
    let (state, seen, mut notes) = take_in(&run, number, state, &told)?;
    notes.extend(told.notes);
    let next = rewrite::checks(&run.program).into_iter().find(|mark| mark.number > state.program.read);
    if next.is_none() {
        notes.push("no check point is left here: the feeds stay, and the next plan begins from this state".into());
    }
    let frozen_to = next.map(|mark| run.program.place(mark.block).0.saturating_sub(1));
    finish(Planned { state, seen, notes, frozen_to, source, files, command: &command.files }, global, screen)
}

/// The state that was written when this very program was planned.
fn planned_for(files: &Files, source: &Source, number: u32, job: &crate::machine::Job) -> Result<ToolState, CliError> {
    let state = files.state_at(number, job)?.ok_or_else(|| {
        CliError::new(
            format!("{}: there is no state of T{number}", files.state_path(number).display()),
            "run `feedwright toollife plan` first, or name the file with --state",
        )
    })?;
    if digest(&source.bytes) == state.program.sha256 {
        return Ok(state);
    }
    Err(CliError::new(
        format!("{} is not the program that was planned for T{number}, {}", source.name, state.program.file),
        "give the file that `toollife plan` or the last `toollife update` wrote, as it was written",
    ))
}
