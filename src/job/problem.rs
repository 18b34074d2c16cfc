//! Caps and floors of a program: the problem that the schedule then solves. In: program, toolpath, engagement, and what each tool has
//! cut before it comes to a place (its history, by which edges wear). Out: a [`Problem`]; and the engagement of a toolpath at a spacing.

use super::task::{SPACING_MM, Watch};
use crate::engage::{self, EngageError, EngagementMap};
use crate::machine::{Job, LimitKind};
use crate::nc::{Environment, Program, Toolpath};
use crate::rewrite;
use crate::schedule::history::History;
use crate::schedule::{self, Bound, EarlierOutput, NotRaised, Problem};

pub(super) fn environment<'a>(job: &Job, watch: &Watch<'a>) -> Environment<'a> {
    Environment { load: watch.subprograms, ..Environment::from_job(job) }
}

/// Divides stations longer than the spacing where loads depend on what the tool has cut before.
pub(super) fn cut(map: EngagementMap, job: &Job, spacing_mm: f64) -> EngagementMap {
    if schedule::history::is_asked_for(job) { map.cut_to(spacing_mm) } else { map }
}

pub(super) fn engagement(
    toolpath: &Toolpath,
    job: &Job,
    watch: &Watch,
    stage: &'static str,
    spacing_mm: f64,
) -> Result<EngagementMap, EngageError> {
    let options = engage::Options { spacing_mm, ..watch.engage };
    let map = engage::engage(toolpath, job, &options, &|done| (watch.progress)(stage, done))?;
    Ok(cut(map, job, spacing_mm))
}

/// Caps and floors relative to the original feeds: F words that an earlier run wrote do not count as the user's. The ends of entries and
/// finishing passes are known only to a station, so they stay where the file has them. Where the original feeds are lost, nothing is raised.
/// `history`: what each tool has cut before each station.
pub(super) fn problem_of(
    program: &Program,
    toolpath: &Toolpath,
    map: &EngagementMap,
    job: &Job,
    history: &History,
) -> Problem {
    if !rewrite::is_ours(program) {
        return schedule::problem_after(toolpath, map, job, history, None);
    }
    let mut original = toolpath.clone();
    let references = rewrite::references(program, toolpath);
    for (motion, reference) in original.moves.iter_mut().zip(&references) {
        motion.feed.mm_s = reference.feed_mm_s;
    }
    let earlier = EarlierOutput { toolpath, apart_mm: 2.0 * SPACING_MM[0] };
    let mut problem = schedule::problem_after(&original, map, job, history, Some(earlier));
    for node in &mut problem.nodes {
        let now_mm_s = toolpath.moves[node.move_id.ix()].feed.mm_s;
        node.programmed_mm_s = now_mm_s;
        if !references[node.move_id.ix()].known && node.free {
            node.not_raised = node.not_raised.or(Some(NotRaised::Forgotten));
            if node.cap.feed_mm_s > now_mm_s {
                node.cap = Bound { feed_mm_s: now_mm_s, kind: LimitKind::Programmed, per_unit: 0.0 };
                node.floor.feed_mm_s = node.floor.feed_mm_s.min(now_mm_s);
            }
        }
    }
    problem
}
