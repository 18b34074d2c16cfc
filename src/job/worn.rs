//! Feeds under the wear that they cause. In: a run whose problem was posed for edges that have not slid. Out: its problem and
//! feeds settled by the rounds of [`crate::schedule::wear`], in both positions of the block-delete switch, or the place from which the
//! tool is worn out.

use super::asked::asked;
use super::edges::WornOut;
use super::switch;
use super::task::JobError;
use super::tighten::{self, Breach};
use crate::engage::EngagementMap;
use crate::ids::MoveId;
use crate::machine::{Job, LimitKind};
use crate::nc::{Program, Toolpath};
use crate::report::{Run, Switched};
use crate::schedule::history::{self, History};
use crate::schedule::wear::{self, ROUNDS, SETTLED};
use crate::schedule::{self, FeedPiece, Options, Problem, Schedule};

/// Feeds from the caps of the problem, which are lowered until they hold behind these very feeds.
pub fn feeds(run: &mut Run, options: &Options) -> Result<Schedule, JobError> {
    for _ in 0..ROUNDS {
        let schedule = schedule::feeds(&run.problem, &run.toolpath, &run.job, options);
        if !history::follows_feeds(&run.job) || lower(run, &schedule.pieces)? <= SETTLED {
            return Ok(schedule);
        }
    }
    Err(JobError::Unsettled(ROUNDS))
}

/// The first place where the check of the file with these feeds found a worn tool above a limit that no feed meets.
pub fn beyond(run: &Run, feeds: &[FeedPiece], breaches: &[Breach]) -> Option<WornOut> {
    let breach = tighten::hopeless(&run.problem, breaches).filter(|_| history::wears(&run.job))?;
    let history = History::of(&run.toolpath, &run.map, &run.job, feeds);
    Some(worn_out(&run.toolpath, &run.map, &history, breach.origin.move_id, breach.origin.from_mm, breach.kind))
}

fn worn_out(
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

/// Lowers the caps to those behind these feeds; the largest share by which one fell.
fn lower(run: &mut Run, feeds: &[FeedPiece]) -> Result<f64, JobError> {
    let Run { program, job, toolpath, map, problem, switched, .. } = run;
    let mut off = Side { program, job, toolpath, map, problem };
    let mut fell = off.lower(feeds)?;
    if let Some(on) = switched {
        let there = switch::feeds_on(feeds, off.toolpath, &on.toolpath);
        let Switched { toolpath, map, problem } = on.as_mut();
        fell = fell.max(Side { program, job, toolpath, map, problem }.lower(&there)?);
        switch::lower_to(off.problem, off.toolpath, on);
    }
    Ok(fell)
}

/// One position of the block-delete switch.
struct Side<'a> {
    program: &'a Program,
    job: &'a Job,
    toolpath: &'a Toolpath,
    map: &'a EngagementMap,
    problem: &'a mut Problem,
}

impl Side<'_> {
    fn lower(&mut self, feeds: &[FeedPiece]) -> Result<f64, JobError> {
        let history = History::of(self.toolpath, self.map, self.job, feeds);
        let worn = asked(self.program, self.toolpath, self.map, self.job, &history);
        let fall = wear::lower(self.problem, &worn);
        match fall.worn_out.filter(|_| history::wears(self.job)) {
            Some((node, kind)) => {
                let node = &self.problem.nodes[node];
                Err(JobError::WornOut(worn_out(self.toolpath, self.map, &history, node.move_id, node.from_mm, kind)))
            }
            None => Ok(fall.largest),
        }
    }
}
