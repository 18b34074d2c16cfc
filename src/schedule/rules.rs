//! Which limits and which mode hold for each move. In: toolpath, engagement, job. Out: one [`Rule`] per combination of
//! tool, operation and reference, and the rule of each move. Limits of the job are overridden by those of the tool, these by those of the
//! operation; of several operations that match, the last. Limits from the program itself ([`super::reference`](mod@super::reference))
//! can only lower them.

use super::kinds_of_cut;
use super::operations::{finishes, nearest};
use crate::engage::EngagementMap;
use crate::ids::MoveId;
use crate::machine::limits::FEED_CHANGE_MAX;
use crate::machine::{Job, LimitKind, Limits, Match, Mode, Operation, Raise, Shape};
use crate::nc::{Move, MoveKind, Toolpath};

/// How the moves of one tool under one operation are treated.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// Optimise, slow only, keep.
    pub mode: Mode,
    /// Limits after merging.
    pub limits: Limits,
    /// Limits on loads: kind and value in the unit of [`Limits`].
    pub loads: Vec<(LimitKind, f64)>,
    /// Index of the operation, whose ramps apply.
    pub operation: Option<usize>,
    /// What may be raised, after merging.
    pub raise: Raise,
    /// Names of the doubts that the setup confirms to be harmless (`confirm`).
    pub confirmed: Vec<&'static str>,
}

impl Rule {
    /// Highest feed that `feed_change` and `feed` allow in a cut programmed at a feed, mm/s.
    pub fn highest_in_cut_mm_s(&self, programmed_mm_s: f64) -> f64 {
        let change = self.limits.feed_change_max.unwrap_or(FEED_CHANGE_MAX[0]);
        (change * programmed_mm_s).min(self.limits.feed_max_mm_s.unwrap_or(f64::INFINITY))
    }
}

/// Rules and the rule of each move (by move index).
#[derive(Debug, Clone, Default)]
pub struct Rules {
    /// The distinct rules.
    pub rules: Vec<Rule>,
    /// Index of the rule of each move.
    pub of_move: Vec<u32>,
}

/// Number of loads that the curves of the spindle limit: power and torque.
const OF_SPINDLE: usize = 2;

impl Rules {
    /// Most loads that are limited at one place, those of the spindle included.
    pub fn most_loads(&self) -> usize {
        OF_SPINDLE + self.rules.iter().map(|rule| rule.loads.len()).max().unwrap_or(0)
    }
    /// Rule of a move.
    pub fn of(&self, id: MoveId) -> &Rule {
        &self.rules[self.index_of(id)]
    }
    /// Index of the rule of a move.
    pub fn index_of(&self, id: MoveId) -> usize {
        self.of_move[id.ix()] as usize
    }
}

/// Rules of the whole program.
pub fn rules(toolpath: &Toolpath, map: &EngagementMap, job: &Job) -> Rules {
    let mut keys: Vec<(u32, Option<usize>, Option<usize>)> = Vec::new();
    let mut of_move = Vec::with_capacity(toolpath.moves.len());
    let cuts = if job.references.is_empty() { Vec::new() } else { kinds_of_cut::cuts(toolpath, map, job) };
    let reference_of = |index: usize, motion: &Move| {
        let scopes = job.references.iter().map(|reference| &reference.scope);
        nearest(scopes, motion, (*cuts.get(index)?)?)
    };
    for (index, motion) in toolpath.moves.iter().enumerate() {
        let id = MoveId(index as u32);
        let key = (motion.tool, operation_of(id, motion, map, job), reference_of(index, motion));
        let found = keys.iter().rposition(|known| *known == key).unwrap_or_else(|| {
            keys.push(key);
            keys.len() - 1
        });
        of_move.push(found as u32);
    }
    let rules = keys.into_iter().map(|(tool, operation, reference)| rule(tool, operation, reference, job)).collect();
    Rules { rules, of_move }
}

fn rule(tool: u32, operation: Option<usize>, reference: Option<usize>, job: &Job) -> Rule {
    let mut limits = job.limits;
    if let Some(tool) = job.tool(tool) {
        limits = limits.overridden_by(&tool.limits);
    }
    let found: Option<&Operation> = operation.map(|index| &job.operations[index]);
    if let Some(operation) = found {
        limits = limits.overridden_by(&operation.limits);
    }
    if let Some(reference) = reference {
        limits = limits.lowered_to(&job.references[reference].limits);
    }
    let mut loads = limits.loads();
    // A tap advances by its pitch: it has no feed per tooth.
    if job.tool(tool).is_some_and(|tool| tool.shape == Shape::Tap) {
        loads.retain(|(kind, _)| !matches!(kind, LimitKind::FeedPerTooth | LimitKind::ChipThickness));
    }
    Rule {
        mode: found.map_or(Mode::Optimise, |operation| operation.mode),
        loads,
        limits,
        operation,
        raise: job.raise.overridden_by(found.map(|operation| operation.raise).unwrap_or_default()),
        confirmed: job.confirmed.iter().chain(found.iter().flat_map(|of| &of.confirmed)).copied().collect(),
    }
}

fn operation_of(id: MoveId, motion: &Move, map: &EngagementMap, job: &Job) -> Option<usize> {
    if motion.kind == MoveKind::Rapid {
        return None;
    }
    job.operations.iter().rposition(|operation| matches(&operation.matches, id, motion, map))
}

fn matches(wanted: &Match, id: MoveId, motion: &Move, map: &EngagementMap) -> bool {
    let tool = wanted.tool.is_none_or(|tool| tool == motion.tool);
    let lines = wanted.lines.is_none_or(|(first, last)| (first..=last).contains(&motion.line));
    let surface = !wanted.final_surface || finishes(id, map);
    tool && lines && surface && wanted.comment.is_none()
}
