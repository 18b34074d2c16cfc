//! Budgets of wear, one for each tool. In: a problem, engagement, the job. Out: caps lowered until each tool keeps its budget, and the time that
//! this costs.
//!
//! For a tool whose wear law and end are known ([`crate::effects::wear`]) the budget is a share of its whole life, from a fresh edge to the end
//! of its index. For others it is a share of what the program uses at the programmed feeds (`[limits] wear`: contact area times a power of the
//! feed).

use crate::effects::wear;
use crate::engage::EngagementMap;
use crate::force::contact::{Engaged, engaged};
use crate::ids::MoveId;
use crate::machine::{Job, LimitKind, Tool, Wear};
use crate::nc::{Move, Toolpath};
use crate::outcome::ProgramRun;
use crate::outcome::answers::Wear as LifeUsed;
use crate::schedule::Problem;
use crate::schedule::budget::{Budget, BudgetOutcome, apply, extra_s};
use crate::schedule::history::{self, History};

/// Longer life for which the report gives the cost in time, as a share: a tenth.
const LONGER: f64 = 0.1;

/// Lowers the caps until every budget is kept; one answer for each tool that has one.
pub fn keep_wear(problem: &mut Problem, toolpath: &Toolpath, map: &EngagementMap, job: &Job) -> Vec<LifeUsed> {
    let tools = job.tools.iter().filter(|tool| toolpath.moves.iter().any(|motion| motion.tool == tool.number));
    tools.filter_map(|tool| of_tool(tool, problem, toolpath, map, job)).collect()
}

/// The same again for tools that slower feeds spare, after the caps of the problem were adapted to their wear.
pub fn keep_again(
    answers: &mut [LifeUsed],
    problem: &mut Problem,
    toolpath: &Toolpath,
    map: &EngagementMap,
    job: &Job,
) {
    for answer in answers.iter_mut().filter(|answer| history::spares(job, answer.tool)) {
        let again = job.tool(answer.tool).and_then(|tool| of_tool(tool, problem, toolpath, map, job));
        *answer = again.unwrap_or_else(|| answer.clone());
    }
}

/// What the feeds of a run use of the life of each tool with a law of its own; without a budget it is told as well.
pub fn used_by(run: &mut ProgramRun) {
    let history = History::of(&run.toolpath, &run.map, &run.job, run.after());
    for tool in run.job.tools.iter().filter(|tool| history.cut_by(tool.number)[0] > 0.0) {
        let Some(Wear { law, fresh, .. }) = wear::with_end(&run.job, tool) else { continue };
        let used = history.cut_by(tool.number)[1] / law.life_mm(fresh);
        match run.answers.wear.iter_mut().find(|answer| answer.tool == tool.number) {
            Some(answer) if answer.of_life => answer.used = used,
            Some(_) => {}
            None => run.answers.wear.push(LifeUsed::without_budget(tool.number, used, law.slower_is_safer())),
        }
    }
}

fn of_tool(
    tool: &Tool,
    problem: &mut Problem,
    toolpath: &Toolpath,
    map: &EngagementMap,
    job: &Job,
) -> Option<LifeUsed> {
    let (rate, budget, of_life) = of_its_life(tool, problem, toolpath, map, job)
        .map(|(rate, budget)| (rate, budget, true))
        .or_else(|| of_the_program(tool, problem, toolpath, map, job).map(|(rate, budget)| (rate, budget, false)))?;
    let fresh = problem.clone();
    let kept = apply(problem, &rate, &budget);
    let (used, price_s, impossible) = match kept {
        BudgetOutcome::Slack { used } => (used, 0.0, false),
        BudgetOutcome::Bound { used, price_s } => (used, price_s, false),
        BudgetOutcome::Impossible { used } => (used, 0.0, true),
    };
    if impossible {
        let mine = problem.nodes.iter_mut().zip(&rate).filter(|(node, c)| node.cutting && node.free && **c > 0.0);
        mine.for_each(|(node, _)| node.infeasible = node.infeasible.or(Some(LimitKind::Budget)));
    }
    let shorter = Budget { most: budget.most.min(used) / (1.0 + LONGER), ..budget };
    let costs_s = extra_s(&fresh, problem, &rate, &shorter).filter(|_| !impossible);
    Some(LifeUsed {
        tool: tool.number,
        most: Some(budget.most),
        used,
        of_life,
        percent_saves_s: 0.01 * budget.most * price_s,
        longer_life_costs_s: costs_s,
        slower_is_no_safer: of_life && budget.exponent <= 0.0,
        impossible,
    })
}

/// Wear of a millimetre of each node at a feed of 1 mm/s as a share of the tool's life, and the budget.
fn of_its_life(
    tool: &Tool,
    problem: &Problem,
    toolpath: &Toolpath,
    map: &EngagementMap,
    job: &Job,
) -> Option<(Vec<f64>, Budget)> {
    let share = job.life.iter().rfind(|life| life.tool.is_none_or(|number| number == tool.number))?.share;
    let Wear { law, fresh, .. } = wear::with_end(job, tool)?;
    let (life_mm, flutes) = (law.life_mm(fresh), f64::from(tool.flutes));
    let rate = |motion: &Move, met: &Engaged| {
        let per_tooth = 1.0 / (motion.spin.rps * flutes);
        if per_tooth.is_finite() { law.rate.counts(met.way_mm, flutes, per_tooth) / life_mm } else { 0.0 }
    };
    let budget = Budget { exponent: law.rate.exponent, most: share };
    Some((at_nodes(tool, problem, toolpath, map, &rate), budget))
}

/// The same as a share of what this tool uses in the program as it stands.
fn of_the_program(
    tool: &Tool,
    problem: &Problem,
    toolpath: &Toolpath,
    map: &EngagementMap,
    job: &Job,
) -> Option<(Vec<f64>, Budget)> {
    let budget = job.wear?;
    // Edge area over material in a revolution, mm².
    let mut rate = at_nodes(tool, problem, toolpath, map, &|_, met| met.contact_mm2);
    let cuts = problem.nodes.iter().zip(&rate).filter(|(node, _)| node.cutting && node.free);
    let programmed: f64 = cuts.map(|(node, c)| c * node.programmed_mm_s.powf(budget.exponent) * node.length_mm()).sum();
    rate.iter_mut().zip(&problem.nodes).for_each(|(c, node)| *c = if node.free { *c / programmed } else { 0.0 });
    (programmed > 0.0).then_some((rate, Budget { exponent: budget.exponent, most: budget.most }))
}

/// A quantity of the engagement at each node of a tool, 0 at other nodes.
fn at_nodes(
    tool: &Tool,
    problem: &Problem,
    toolpath: &Toolpath,
    map: &EngagementMap,
    of: &dyn Fn(&Move, &Engaged) -> f64,
) -> Vec<f64> {
    let mut values = vec![0.0; problem.nodes.len()];
    for (index, motion) in toolpath.moves.iter().enumerate().filter(|(_, motion)| motion.tool == tool.number) {
        let stations = map.stations_of(MoveId(index as u32));
        for node in problem.of_move[index].clone() {
            let middle_mm = 0.5 * (problem.nodes[node as usize].from_mm + problem.nodes[node as usize].to_mm);
            let Some(station) = stations.get(stations.partition_point(|station| station.to_mm < middle_mm)) else {
                continue;
            };
            let tangent_z = motion.curve().tangent(0.5 * (station.from_mm + station.to_mm)).z;
            let met = engaged(station, map, map.slices_of(motion.tool), tool.flutes, tangent_z);
            values[node as usize] = of(motion, &met);
        }
    }
    values
}
