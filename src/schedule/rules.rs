//! Which limits and which mode hold for each move. In: toolpath, engagement, job. Out: one [`Rule`] per combination of
//! tool and operation, and the rule of each move. Limits merge job → tool → operation; the last operation that matches wins.

use crate::engage::EngagementMap;
use crate::ids::MoveId;
use crate::machine::{Job, LimitKind, Limits, Match, Mode, Operation};
use crate::nc::{Move, MoveKind, Toolpath};

/// How the moves of one tool under one operation are treated.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// Optimise, slow only, keep.
    pub mode: Mode,
    /// Limits after merging.
    pub limits: Limits,
    /// Loads to be kept: kind and value in the unit of [`Limits`].
    pub loads: Vec<(LimitKind, f64)>,
    /// The operation, for its ramps.
    pub operation: Option<usize>,
}

/// Rules and the rule of each move (by move index).
#[derive(Debug, Clone, Default)]
pub struct Rules {
    /// The distinct rules.
    pub rules: Vec<Rule>,
    /// Index of the rule of each move.
    pub of_move: Vec<u16>,
}

impl Rules {
    /// Rule of a move.
    pub fn of(&self, id: MoveId) -> &Rule {
        &self.rules[self.of_move[id.ix()] as usize]
    }
}

/// Rules of the whole program.
pub fn rules(toolpath: &Toolpath, map: &EngagementMap, job: &Job) -> Rules {
    let mut keys: Vec<(u32, Option<usize>)> = Vec::new();
    let mut of_move = Vec::with_capacity(toolpath.moves.len());
    for (index, motion) in toolpath.moves.iter().enumerate() {
        let key = (motion.tool, operation_of(MoveId(index as u32), motion, map, job));
        let found = keys.iter().rposition(|known| *known == key).unwrap_or_else(|| {
            keys.push(key);
            keys.len() - 1
        });
        of_move.push(found as u16);
    }
    let rules = keys.into_iter().map(|(tool, operation)| rule(tool, operation, job)).collect();
    Rules { rules, of_move }
}

fn rule(tool: u32, operation: Option<usize>, job: &Job) -> Rule {
    let mut limits = job.limits;
    if let Some(tool) = job.tool(tool) {
        limits = limits.overridden_by(&tool.limits);
    }
    let found: Option<&Operation> = operation.map(|index| &job.operations[index]);
    if let Some(operation) = found {
        limits = limits.overridden_by(&operation.limits);
    }
    Rule {
        mode: found.map_or(Mode::Optimise, |operation| operation.mode),
        loads: load_limits(&limits),
        limits,
        operation,
    }
}

/// The loads that limits bound, with their values.
pub fn load_limits(limits: &Limits) -> Vec<(LimitKind, f64)> {
    [
        (LimitKind::ForceXy, limits.force_xy_n),
        (LimitKind::ForceNormalMean, limits.force_normal_mean_n),
        (LimitKind::ForceAxial, limits.force_axial_n),
        (LimitKind::Power, limits.power_w),
        (LimitKind::Torque, limits.torque_nmm),
        (LimitKind::Deflection, limits.deflection_mm),
        (LimitKind::SurfaceError, limits.surface_error_mm),
        (LimitKind::BendingStress, limits.bending_stress_mpa),
        (LimitKind::ChipThickness, limits.chip_thickness_max_mm),
        (LimitKind::FeedPerTooth, limits.feed_per_tooth_max_mm),
    ]
    .into_iter()
    .filter_map(|(kind, value)| Some((kind, value?)))
    .collect()
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
    let surface = !wanted.final_surface || map.stations_of(id).iter().any(|station| station.flags.final_surface);
    tool && lines && surface && wanted.comment.is_none()
}
