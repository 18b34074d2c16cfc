//! Feeds for the wear that they themselves cause. In: a run whose caps were worked out for unworn edges. Out: its caps and feeds after the
//! iteration of [`crate::schedule::wear`], in both positions of the block-delete switch; or the place from which on the tool is worn out.

use super::block_delete;
use super::edges::WornOut;
use super::life;
use super::problem::problem_of;
use super::task::JobError;
use super::tighten::{self, Breach};
use crate::diag::{Diagnostic, Severity};
use crate::effects;
use crate::engage::EngagementMap;
use crate::ids::MoveId;
use crate::machine::{Job, LimitKind, Tool};
use crate::nc::{Program, Toolpath};
use crate::outcome::{ProgramRun, Switched};
use crate::report::short;
use crate::schedule::history::{self, History};
use crate::schedule::wear::{self, ROUNDS, SETTLED};
use crate::schedule::{self, FeedPiece, Node, Options, Problem, Schedule};

/// The problem for edges that have not worn, before any budget, in both positions of the block-delete switch, with the caps that
/// the check of the written file lowered.
pub struct Fresh {
    off: Problem,
    on: Option<Problem>,
}

impl Fresh {
    /// `off`: of the run with the switch off.
    pub fn of(run: &ProgramRun, off: Problem) -> Self {
        Self { off, on: run.switched.as_ref().map(|on| on.problem.clone()) }
    }
    /// Takes breaches into the caps.
    pub fn tighten(&mut self, breaches: &[Breach]) {
        tighten::tighten(&mut self.off, breaches, false);
    }
}

/// Feeds from the caps of the problem, which follow the wear of these very feeds where there is a `fresh` one.
pub fn feeds(run: &mut ProgramRun, fresh: Option<&Fresh>, options: &Options) -> Result<Schedule, JobError> {
    for round in 0..ROUNDS {
        let schedule = schedule::feeds(&run.problem, &run.toolpath, &run.job, options);
        let Some(fresh) = fresh else { return Ok(schedule) };
        if follow(run, fresh, &schedule.pieces, round < ROUNDS / 2)? <= SETTLED {
            return Ok(schedule);
        }
    }
    Err(JobError::Unsettled(ROUNDS))
}

/// The first place where the check of the file with these feeds found a worn tool above a limit that no feed meets.
pub fn beyond(run: &ProgramRun, feeds: &[FeedPiece], breaches: &[Breach]) -> Option<WornOut> {
    let breach = tighten::hopeless(&run.problem, breaches).filter(|_| history::wears(&run.job))?;
    let history = History::of(&run.toolpath, &run.map, &run.job, feeds);
    Some(worn_out_at(&run.toolpath, &run.map, &history, breach.origin.move_id, breach.origin.from_mm, breach.kind))
}

/// A diagnostic for each tool that wears so far that no feed meets a limit which a fresh edge meets: from where on, and what helps. The
/// iteration gives each place the highest feed for the wear there; it does not slow down an earlier place to spare the tool for a later one.
pub fn too_worn(run: &ProgramRun, fresh: &Fresh, feeds: &[FeedPiece]) -> Vec<Diagnostic> {
    let history = History::of(&run.toolpath, &run.map, &run.job, feeds);
    let motion = |node: &Node| &run.toolpath.moves[node.move_id.ix()];
    let of_tool = |tool: &Tool| {
        let wear = effects::wear::of_tool(&run.job, tool)?;
        let nodes = run.problem.nodes.iter().zip(&fresh.off.nodes).filter(|(node, _)| motion(node).tool == tool.number);
        let unmet = |(now, new): &(&Node, &Node)| new.infeasible.is_none().then_some(now.infeasible).flatten();
        let (node, kind) = nodes.map(|pair| (pair.0, unmet(&pair))).find_map(|(node, kind)| Some((node, kind?)))?;
        if kind == LimitKind::Budget {
            return None;
        }
        let before = run.map.stations_of(node.move_id).partition_point(|station| station.to_mm <= node.from_mm);
        let [_, wear_mm] = history.cut_mm(run.map.of_move[node.move_id.ix()].start as usize + before);
        let (number, line, name) = (tool.number, motion(node).line, kind.name());
        let share = wear_mm / wear.law.life_mm(wear.fresh);
        let text = format!(
            "from line {line} on the edge of T{number} is so worn that no feed meets {name}, which a new one meets"
        );
        let help = if !wear.law.slower_is_safer() {
            "slower feeds do not spare it: change the tool before this line, or raise the limit".to_owned()
        } else if share > 0.0 {
            format!("slower feeds before it spare the edge: --wear-budget T{number}={}", short(round_down(share)))
        } else {
            format!("slower feeds before it spare the edge: write wear = {{ end = … }} of T{number}, and --wear-budget")
        };
        Some(Diagnostic::new("schedule::too-worn", Severity::Warning, text).on_line(line).help(help))
    };
    run.job.tools.iter().filter_map(of_tool).collect()
}

/// Two digits, downwards.
fn round_down(share: f64) -> f64 {
    let digit = 10f64.powf(share.log10().floor() - 1.0);
    (share / digit).floor() * digit
}

fn worn_out_at(
    toolpath: &Toolpath,
    map: &EngagementMap,
    history: &History,
    id: MoveId,
    from_mm: f64,
    kind: LimitKind,
) -> WornOut {
    let motion = &toolpath.moves[id.ix()];
    let before = map.stations_of(id).partition_point(|station| station.to_mm <= from_mm);
    let slid_m = 1e-3 * history.slid_mm(map.of_move[id.ix()].start as usize + before);
    WornOut { tool: motion.tool, line: motion.line, kind, slid_m }
}

/// Gives the problem the caps behind these feeds; the largest share by which one changed.
fn follow(run: &mut ProgramRun, fresh: &Fresh, feeds: &[FeedPiece], may_rise: bool) -> Result<f64, JobError> {
    let ProgramRun { program, job, toolpath, map, problem, switched, answers, .. } = run;
    let before = problem.clone();
    Side { program, job, toolpath, map, problem, fresh: &fresh.off, may_rise }.follow(feeds)?;
    if let (Some(on), Some(fresh)) = (switched, &fresh.on) {
        let there = block_delete::feeds_on(feeds, toolpath, &on.toolpath);
        let Switched { toolpath: on_path, map, problem: on_problem } = on.as_mut();
        Side { program, job, toolpath: on_path, map, problem: on_problem, fresh, may_rise }.follow(&there)?;
        block_delete::lower_to(problem, toolpath, on);
    }
    life::keep_again(&mut answers.wear, problem, toolpath, map, job);
    Ok(wear::largest_change(&before, problem, &fresh.off))
}

/// One position of the block-delete switch.
struct Side<'a> {
    program: &'a Program,
    job: &'a Job,
    toolpath: &'a Toolpath,
    map: &'a EngagementMap,
    problem: &'a mut Problem,
    fresh: &'a Problem,
    /// May caps rise again where slower feeds spare the edge?
    may_rise: bool,
}

impl Side<'_> {
    fn follow(&mut self, feeds: &[FeedPiece]) -> Result<(), JobError> {
        let history = History::of(self.toolpath, self.map, self.job, feeds);
        let worn = problem_of(self.program, self.toolpath, self.map, self.job, &history);
        let tools = self.job.tools.iter().map(|tool| tool.number);
        let spared: Vec<u32> = tools.filter(|tool| self.may_rise && history::spares(self.job, *tool)).collect();
        let spares = |node: &Node| spared.contains(&self.toolpath.moves[node.move_id.ix()].tool);
        let worn_out = wear::follow(self.problem, self.fresh, &worn, &spares);
        let Some((node, kind)) = worn_out.filter(|_| history::wears(self.job)) else { return Ok(()) };
        let node = &self.problem.nodes[node];
        Err(JobError::WornOut(worn_out_at(self.toolpath, self.map, &history, node.move_id, node.from_mm, kind)))
    }
}
