//! The pipeline from a program to its optimised text: [`optimize`]; [`simulate`] is its first half. In: a program and a job. Out: a
//! [`ProgramRun`] with everything that reports need.
//!
//! ```text
//! interpret → engage → problem → [ solve → rewrite → read back, look again at a finer spacing ] → verify
//!                                  ▲                                │ loads above 1.01 of their limit
//!                                  └──────── caps tightened ────────┘
//! ```
//! Edges wear with the distance that they slide, which is longer the slower the feed. Where loads grow with wear, *solve* therefore repeats until
//! the caps belong to the wear that the solved feeds themselves cause ([`crate::schedule::wear`]).
//!
//! Engagement does not depend on feeds. So only blocks that were split, or whose load comes near a limit, are simulated again, and only once;
//! the others keep the stations of the first simulation ([`check`]). A station whose feed has not changed keeps its loads. Later rounds use the
//! prices of F words that the first round found; binding limits and their prices are worked out for the last round only.
//!
//! When feeds are solved anew, blocks are split at other places, and the next simulation has other stations. So after [`SOLVED`] rounds the
//! blocks stay as they are, and F words are only lowered, to the caps of the very stations that will be checked again. The loop ends when no
//! commanded feed exceeds a limit by more than 1 %, or after [`ROUNDS`] rounds; a place that still exceeds one is listed as infeasible and runs
//! at the lowest feed that was tried. A block in which the proof finds a difference goes back to its original bytes and feed.

mod block_delete;
mod certificate;
mod certificate_arcs;
mod certificate_text;
mod check;
mod comments;
mod edges;
mod force_rate;
mod growth;
pub mod learned;
mod life;
mod limit_use;
mod origins;
pub mod plausible;
mod problem;
pub mod propose;
mod ratios;
mod remarks;
pub mod semifinish;
mod simulated_again;
pub mod stepover;
mod task;
mod tighten;
pub mod tool_life;
mod wanted;
mod worn;
mod written_engagement;

#[cfg(feature = "rooms")]
pub use certificate::{CLOSE_MM, RING_PARTS};
pub use comments::sections;
pub use remarks::{events, tool_assumption, unknown_tools};
pub use task::{JobError, Keep, SPACING_MM, Task, Watch};
pub use wanted::Wanted;

use certificate::Maker;
use edges::EdgeWear;
use problem::{cut, environment, problem_of};

use crate::diag::{Diagnostic, Severity};
use crate::engage::{self, EngageError, EngagementMap};
use crate::machine::Job;
use crate::nc::{self, Program, Toolpath};
use crate::outcome::{Answers, Check, ProgramRun, Written};
use crate::rewrite;
use crate::schedule::{self, Problem, Schedule};

/// Most rounds of tightening caps. Blocks that are split at other places have other stations, so each round may find a new place above a
/// limit; six such rounds in a row have been seen.
pub const ROUNDS: usize = 9;
/// Rounds in which feeds are solved anew under tightened caps; after these they are lowered where they stand.
pub const SOLVED: usize = 3;
/// Predicts loads and time as programmed.
pub fn simulate(task: Task, watch: &Watch) -> Result<ProgramRun, JobError> {
    let (mut run, _) = posed(task, EdgeWear::AsProgrammed, watch)?;
    life::used_by(&mut run);
    Ok(run)
}

/// Reads and simulates the program, and works out its caps for edges worn as `edges` says. Returns also the problem before any budget lowered
/// its caps, where loads depend on the feeds of earlier cuts.
fn posed(task: Task, edges: EdgeWear, watch: &Watch) -> Result<(ProgramRun, Option<Problem>), JobError> {
    let Task { program, mut job, mut assumptions, wanted } = task;
    let start = (watch.clock)();
    assumptions.extend(wanted.confidence.map(|confidence| wanted::at_confidence(&mut job, confidence)));
    assumptions.extend(learned::unexplained(&job));
    assumptions.extend(learned::at_their_largest(&mut job));
    assumptions.extend(learned::no_easier_at_less_feed(&mut job));
    assumptions.extend(learned::apply(&mut job));
    let asked_for = job.operations.len();
    let origins: Vec<usize>;
    (origins, job.operations) = comments::by_lines(&job.operations, &program).into_iter().unzip();
    let unit = remarks::unit(&program, &environment(&job, watch), &mut job);
    let (program, mut toolpath) = read(program, &job, wanted, watch);
    let (unit, unit_doubted) = unit.map_or((None, false), |(told, said, sure)| {
        assumptions.push(told);
        (Some(said), !sure)
    });
    if unit_doubted {
        toolpath.doubts.insert(
            0,
            nc::Doubted {
                from: crate::ids::MoveId(0),
                until: None,
                doubt: nc::Doubt::Unit,
                line: 1,
                unread: Vec::new(),
            },
        );
    }
    let not_finite = remarks::not_finite(&toolpath);
    if !not_finite.is_empty() {
        return Err(JobError::NotFinite(not_finite));
    }
    if toolpath.moves.is_empty() {
        return Err(JobError::NoMotion);
    }
    assumptions.extend(tool_assumption(&toolpath, &mut job));
    let unknown = unknown_tools(&toolpath, &job);
    if !unknown.is_empty() {
        let named = toolpath.diagnostics.into_iter().filter(|diagnostic| diagnostic.code == "nc::tool-name");
        let named: Vec<Diagnostic> =
            named.map(|diagnostic| Diagnostic { severity: Severity::Error, ..diagnostic }).collect();
        if unknown.iter().any(|(tool, _)| *tool == 0) && !named.is_empty() {
            return Err(JobError::ToolNames(named));
        }
        return Err(JobError::UnknownTools(unknown));
    }
    remarks::freeze_tools(&mut toolpath, &job);
    rewrite::freeze(&program, &mut toolpath, &job);
    let parsed = (watch.clock)();
    let map = first_engagement(&toolpath, &job, watch)?;
    let simulated = (watch.clock)();
    let mut answers = Answers::default();
    if let Some(percentile) = wanted.reference {
        answers.reference =
            Some(wanted::limit_to_itself(&mut job, &sections(&program, &toolpath, &map), &toolpath, &map, percentile));
    }
    let mut problem = problem_of(&program, &toolpath, &map, &job, &edges.history(&toolpath, &map, &job));
    let fresh = schedule::history::follows_feeds(&job).then(|| problem.clone());
    answers.wear = life::keep_wear(&mut problem, &toolpath, &map, &job);
    let switched = block_delete::both_positions(&program, &job, &toolpath, &mut problem, edges, watch)?;
    let (switched, told) = switched.map_or((None, None), |(switched, told)| (Some(Box::new(switched)), Some(told)));
    assumptions.extend(told);
    let before = schedule::as_programmed(&toolpath);
    let realised_before = schedule::realise(&toolpath, &before, &job.machine);
    let mut diagnostics: Vec<Diagnostic> = remarks::idle_limits(&toolpath, &map, &job);
    diagnostics.extend(remarks::without_rate(&job));
    diagnostics.extend(unit);
    diagnostics.append(&mut toolpath.diagnostics);
    diagnostics.extend(remarks::forgotten(&program));
    diagnostics.extend(remarks::idle_operations(&toolpath, &map, &job, &origins, asked_for));
    diagnostics.extend(remarks::overruled(&problem, &toolpath));
    diagnostics.extend(remarks::rubbing(&problem, &toolpath, &job));
    diagnostics.extend(remarks::files(&program, &toolpath));
    diagnostics.extend(remarks::stock(&map, &toolpath));
    diagnostics.extend(plausible::implausible(&plausible::Simulation { toolpath: &toolpath, map: &map, job: &job }));
    diagnostics.extend(events(&map, &toolpath));
    diagnostics.extend(remarks::cutters(&map, &toolpath, &job));
    if plausible::allow_no_rise(&diagnostics) {
        plausible::raise_nothing(&mut problem);
    }
    let scheduled = (watch.clock)();
    let stage_s = [parsed - start, simulated - parsed, scheduled - simulated, 0.0, 0.0];
    let mut run = ProgramRun {
        program,
        job,
        assumptions,
        toolpath,
        map,
        problem,
        switched,
        before,
        realised_before,
        diagnostics,
        written: None,
        answers,
        stage_s,
    };
    run.answers.cycle = wanted.cycle_time_s.map(|measured_s| wanted::fit_control(&run, measured_s));
    run.answers.final_surface = wanted::final_surface_of(&run);
    Ok((run, fresh))
}

/// Rewrites the feeds, and closes the loop over the written file.
pub fn optimize(task: Task, watch: &Watch) -> Result<ProgramRun, JobError> {
    let wanted = task.wanted;
    let confidence = wanted.confidence.filter(|_| wanted.certificate);
    let mut making = confidence.map(|confidence| Maker::new(&task.job, confidence));
    let last = if making.is_some() { ROUNDS + certificate::ROUNDS } else { ROUNDS };
    let mut certified = 0;
    let (mut run, fresh) = posed(task, EdgeWear::Unworn, watch)?;
    let mut fresh = fresh.map(|off| worn::Fresh::of(&run, off));
    let mut options = growth::options(&run);
    let mut known = [None, None];
    let mut lowered: Option<Schedule> = None;
    for round in 0..=last {
        (watch.progress)("schedule", 0.0);
        let (mut schedule, rewritten, [solve_s, write_s]) = match lowered.take() {
            Some(schedule) => growth::text_of_schedule(&run, schedule, watch.clock),
            None => growth::schedule_within_growth(&mut run, fresh.as_ref(), &mut options, watch.clock)?,
        };
        let wrote = (watch.clock)();
        let mut found = check::check(&run, &rewritten, watch, &mut known, round == last)?;
        if let Some(worn_out) = worn::beyond(&run, &schedule.pieces, &found.breaches) {
            return Err(JobError::WornOut(worn_out));
        }
        if let (Some(making), [Some(known), _], true) = (&mut making, &known, found.is_good()) {
            certified += 1;
            let made = making.make(&run, known, &rewritten.bytes, watch)?;
            if let Some(refusal) = made.refusal.filter(|_| certified > certificate::ROUNDS || round == last) {
                return Err(JobError::NotCertified { line: refusal.line, why: refusal.why });
            }
            (found.breaches, run.answers.certificate) = (made.breaches, Some(made.text));
        }
        let checked = (watch.clock)();
        run.stage_s[2] += solve_s;
        run.stage_s[3] += write_s;
        run.stage_s[4] += checked - wrote;
        if !found.is_good() && round < last {
            tighten::leave_alone(&mut run, &found.doubtful);
            tighten::tighten(&mut run.problem, &found.breaches, false);
            if let Some(fresh) = &mut fresh {
                fresh.tighten(&found.breaches);
            }
            options.lambda_s = schedule.lambda_s;
            let solved = if certified > 0 { certified > certificate::SOLVED } else { round >= SOLVED };
            if solved && found.doubtful.is_empty() {
                tighten::lower_in_place(&mut schedule.pieces, &run.problem, &found.breaches, &options.grid);
                lowered = Some(schedule);
            }
            continue;
        }
        let ((), realised_after) = rayon::join(
            || schedule::explain(&mut schedule, &run.problem, &run.toolpath, &run.job),
            || schedule::realise(&run.toolpath, &found.after, &run.job.machine),
        );
        run.diagnostics.extend(remarks::refused(&schedule));
        run.diagnostics.extend(remarks::held_by_feed_change(&schedule, &run.job));
        run.diagnostics.extend(remarks::held_by_clamps(&run.problem));
        run.diagnostics.extend(remarks::missed(&schedule, &run.problem, &run.toolpath));
        let too_worn = fresh.as_ref().map(|fresh| worn::too_worn(&run, fresh, &found.after));
        run.diagnostics.extend(too_worn.into_iter().flatten());
        tighten::leave_alone(&mut run, &found.doubtful);
        tighten::tighten(&mut run.problem, &found.breaches, true);
        let over = check::over(&run, &rewritten, &known);
        run.stage_s[2] += (watch.clock)() - checked;
        run.written = Some(Written {
            bytes: rewritten.bytes,
            files: rewritten.files,
            after: found.after,
            realised_after,
            schedule,
            stats: rewritten.stats,
            kept: rewritten.kept,
            check: Check { rounds: round, over, ..found.check },
        });
        break;
    }
    life::used_by(&mut run);
    if let (true, [Some(known), _]) = (wanted.stress, &known) {
        run.answers.stress = check::stressed(&run, known, watch);
    }
    run.answers.cycle = wanted.cycle_time_s.map(|measured_s| wanted::fit_control(&run, measured_s));
    run.answers.final_surface = wanted::final_surface_of(&run);
    Ok(run)
}

/// Reads the moves of a program as the setup says, linked to the files it calls if those are written again.
fn read(program: Program, job: &Job, wanted: Wanted, watch: &Watch) -> (Program, Toolpath) {
    let environment = environment(job, watch);
    if wanted.rewrites_files {
        return nc::linked(&program, &environment);
    }
    let toolpath = nc::interpret(&program, &environment);
    (program, toolpath)
}

/// Engagement of the original program: from the cache of an earlier run, or simulated now.
fn first_engagement(toolpath: &Toolpath, job: &Job, watch: &Watch) -> Result<EngagementMap, EngageError> {
    let options = engage::Options { spacing_mm: SPACING_MM[0], ..watch.engage };
    let Keep { recall, remember, stock } = watch.keep;
    let key = (recall.is_some() || remember.is_some()).then(|| engage::cache::key(toolpath, job, &options));
    let known = recall.zip(key.as_ref()).and_then(|(recall, key)| recall(key));
    if let Some(map) = known {
        return Ok(cut(map, job, SPACING_MM[0]));
    }
    let progress = |done| (watch.progress)("simulate", done);
    let map = if let Some(take) = stock {
        let (map, pieces) = engage::engage_and_keep(toolpath, job, &options, &progress)?;
        let shifts = job.stocks.iter().map(|stock| -engage::workpiece::stock_shift(job, toolpath, stock));
        take(pieces.into_iter().zip(shifts).collect());
        map
    } else {
        engage::engage(toolpath, job, &options, &progress)?
    };
    if let Some((remember, key)) = remember.zip(key.as_ref()) {
        remember(key, &map);
    }
    Ok(cut(map, job, SPACING_MM[0]))
}
