//! Ramps of feed at entries, exits and changes of direction. In: a problem and the operations' ramps. Out: the problem with
//! its nodes cut at the ramps and capped inside them. Minima bind the commanded F, not the ramps.
//!
//! An entry ramp covers the distance after the cutter meets material, an exit ramp the distance before it leaves it, a
//! ramp for a change of direction the distance on both sides of a corner sharper than its angle; all along feed moves.

use super::problem::{Bound, Node, Problem};
use super::rules::Rules;
use crate::ids::MoveId;
use crate::machine::{Job, LimitKind, Operation, Ramp};
use crate::nc::{Event, MoveKind, Toolpath};

/// A stretch of a move with a highest feed.
#[derive(Debug, Clone, Copy)]
struct Zone {
    move_id: MoveId,
    from_mm: f64,
    to_mm: f64,
    feed_mm_s: f64,
}

/// Puts the ramps of all operations into the problem.
pub fn apply(problem: &mut Problem, toolpath: &Toolpath, rules: &Rules, job: &Job) {
    let ramped = |operation: &Operation| {
        operation.entry.is_some() || operation.exit.is_some() || operation.direction_change.is_some()
    };
    if !job.operations.iter().any(ramped) {
        return;
    }
    let mut zones: Vec<Vec<Zone>> = vec![Vec::new(); toolpath.moves.len()];
    let mut put = |zone: Zone| zones[zone.move_id.ix()].push(zone);
    for run in feed_runs(toolpath) {
        contacts(problem, &run, rules, job, &mut put);
        corners(toolpath, &run, rules, job, &mut put);
    }
    cut(problem, &zones);
}

/// Feed moves that follow each other without a rapid or a pause between them.
fn feed_runs(toolpath: &Toolpath) -> Vec<Vec<MoveId>> {
    let mut runs = vec![Vec::new()];
    for event in toolpath.events() {
        match &event {
            Event::Move(id) if toolpath.moves[id.ix()].kind == MoveKind::Feed => {
                if let Some(run) = runs.last_mut() {
                    run.push(*id);
                }
            }
            _ => runs.push(Vec::new()),
        }
    }
    runs.retain(|run| !run.is_empty());
    runs
}

fn operation_of<'a>(id: MoveId, rules: &Rules, job: &'a Job) -> Option<&'a Operation> {
    rules.of(id).operation.map(|index| &job.operations[index])
}

/// Entry and exit ramps of one run.
fn contacts(problem: &Problem, run: &[MoveId], rules: &Rules, job: &Job, put: &mut dyn FnMut(Zone)) {
    let nodes: Vec<&Node> = run.iter().flat_map(|id| problem.nodes_of(*id)).collect();
    for (i, node) in nodes.iter().enumerate() {
        let Some(operation) = operation_of(node.move_id, rules, job) else { continue };
        let before = i.checked_sub(1).is_some_and(|before| nodes[before].cutting);
        let after = nodes.get(i + 1).is_some_and(|next| next.cutting);
        if let (Some(ramp), true, false) = (operation.entry, node.cutting, before) {
            spread(nodes[i..].iter().map(|node| (node.move_id, node.from_mm, node.to_mm)), ramp, false, put);
        }
        if let (Some(ramp), true, false) = (operation.exit, node.cutting, after) {
            spread(nodes[..=i].iter().rev().map(|node| (node.move_id, node.from_mm, node.to_mm)), ramp, true, put);
        }
    }
}

/// Ramps at the corners of one run.
fn corners(toolpath: &Toolpath, run: &[MoveId], rules: &Rules, job: &Job, put: &mut dyn FnMut(Zone)) {
    let whole = |id: &MoveId| (*id, 0.0, toolpath.moves[id.ix()].curve().length());
    for (i, pair) in run.windows(2).enumerate() {
        let change = operation_of(pair[1], rules, job).and_then(|operation| operation.direction_change);
        let Some((angle_rad, ramp)) = change else { continue };
        let (before, after) = (&toolpath.moves[pair[0].ix()].curve(), &toolpath.moves[pair[1].ix()].curve());
        let cos = before.tangent(before.length()).dot(&after.tangent(0.0));
        if cos.clamp(-1.0, 1.0).acos() > angle_rad {
            spread(run[i + 1..].iter().map(whole), ramp, false, put);
            spread(run[..=i].iter().rev().map(whole), ramp, true, put);
        }
    }
}

/// Lays a ramp over pieces until its distance is used up; `backwards`: from the end of each piece.
fn spread(pieces: impl Iterator<Item = (MoveId, f64, f64)>, ramp: Ramp, backwards: bool, put: &mut dyn FnMut(Zone)) {
    let mut left_mm = ramp.distance_mm;
    for (move_id, from_mm, to_mm) in pieces {
        let used = (to_mm - from_mm).min(left_mm);
        let (from_mm, to_mm) = if backwards { (to_mm - used, to_mm) } else { (from_mm, from_mm + used) };
        put(Zone { move_id, from_mm, to_mm, feed_mm_s: ramp.feed_mm_s });
        left_mm -= used;
        if left_mm <= 0.0 {
            return;
        }
    }
}

/// Cuts the nodes at the ends of the zones and caps them inside.
fn cut(problem: &mut Problem, zones: &[Vec<Zone>]) {
    let mut nodes = Vec::with_capacity(problem.nodes.len());
    let mut first_of_old = Vec::with_capacity(problem.nodes.len());
    for (range, zones) in problem.of_move.iter_mut().zip(zones) {
        let start = nodes.len() as u32;
        for node in &problem.nodes[range.start as usize..range.end as usize] {
            first_of_old.push(nodes.len());
            let inside = |mm: &f64| *mm > node.from_mm + 1e-6 && *mm < node.to_mm - 1e-6;
            let mut at: Vec<f64> = zones.iter().flat_map(|zone| [zone.from_mm, zone.to_mm]).filter(inside).collect();
            at.sort_by(f64::total_cmp);
            at.dedup_by(|b, a| *b - *a < 1e-6);
            at.push(node.to_mm);
            let mut from_mm = node.from_mm;
            for to_mm in at {
                nodes.push(capped(Node { from_mm, to_mm, ..*node }, zones));
                from_mm = to_mm;
            }
        }
        *range = start..nodes.len() as u32;
    }
    for conflict in &mut problem.conflicts {
        conflict.node = first_of_old[conflict.node];
    }
    problem.nodes = nodes;
}

fn capped(mut node: Node, zones: &[Zone]) -> Node {
    let middle = 0.5 * (node.from_mm + node.to_mm);
    let over = zones.iter().filter(|zone| zone.from_mm <= middle && middle <= zone.to_mm);
    let feed_mm_s = over.map(|zone| zone.feed_mm_s).fold(f64::INFINITY, f64::min);
    if node.free && feed_mm_s < node.cap.feed_mm_s {
        node.cap = Bound { feed_mm_s, kind: LimitKind::Ramp, per_unit: 0.0 };
        node.floor.feed_mm_s = node.floor.feed_mm_s.min(feed_mm_s);
    }
    node
}
