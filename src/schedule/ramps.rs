//! Ramps of feed at entries, exits and changes of direction. In: a problem and the operations' ramps. Out: the problem with
//! its nodes cut where ramps begin and end, and lower caps inside them. A minimum feed does not hold inside a ramp.
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
    /// From and to, mm along the move.
    along: [f64; 2],
    feed_mm_s: f64,
}

/// Takes a stretch of a move that a ramp covers.
type Put<'a> = dyn FnMut(MoveId, [f64; 2], Ramp) + 'a;

/// Puts the ramps of all operations into the problem.
pub fn apply(problem: &mut Problem, toolpath: &Toolpath, rules: &Rules, job: &Job) {
    let ramped = |operation: &Operation| {
        operation.entry.is_some() || operation.exit.is_some() || operation.direction_change.is_some()
    };
    if !job.operations.iter().any(ramped) {
        return;
    }
    let mut zones: Vec<Vec<Zone>> = vec![Vec::new(); toolpath.moves.len()];
    let mut put = |id: MoveId, along: [f64; 2], ramp: Ramp| {
        zones[id.ix()].push(Zone { along, feed_mm_s: ramp.feed_mm_s });
    };
    for run in feed_runs(toolpath) {
        contacts(problem, &run, rules, job, &mut put);
        corners(toolpath, &run, rules, job, &mut put);
    }
    let along: Vec<Vec<[f64; 2]>> = zones.iter().map(|of| of.iter().map(|zone| zone.along).collect()).collect();
    problem.cut_at(&along);
    for node in &mut problem.nodes {
        capped(node, &zones[node.move_id.ix()]);
    }
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
fn contacts(problem: &Problem, run: &[MoveId], rules: &Rules, job: &Job, put: &mut Put) {
    let nodes: Vec<&Node> = run.iter().flat_map(|id| problem.nodes_of(*id)).collect();
    for (i, node) in nodes.iter().enumerate() {
        let Some(operation) = operation_of(node.move_id, rules, job) else { continue };
        let before = i.checked_sub(1).is_some_and(|before| nodes[before].cutting);
        let after = nodes.get(i + 1).is_some_and(|next| next.cutting);
        if let (Some(ramp), true, false) = (operation.entry, node.cutting, before) {
            spread(
                nodes[i..].iter().map(|node| (node.move_id, node.from_mm, node.to_mm)),
                ramp.distance_mm,
                false,
                &mut |id, along| put(id, along, ramp),
            );
        }
        if let (Some(ramp), true, false) = (operation.exit, node.cutting, after) {
            spread(
                nodes[..=i].iter().rev().map(|node| (node.move_id, node.from_mm, node.to_mm)),
                ramp.distance_mm,
                true,
                &mut |id, along| put(id, along, ramp),
            );
        }
    }
}

/// Ramps at the corners of one run.
fn corners(toolpath: &Toolpath, run: &[MoveId], rules: &Rules, job: &Job, put: &mut Put) {
    let whole = |id: &MoveId| (*id, 0.0, toolpath.moves[id.ix()].curve().length());
    for (i, pair) in run.windows(2).enumerate() {
        let change = operation_of(pair[1], rules, job).and_then(|operation| operation.direction_change);
        let Some((angle_rad, ramp)) = change else { continue };
        let (before, after) = (&toolpath.moves[pair[0].ix()].curve(), &toolpath.moves[pair[1].ix()].curve());
        let cos = before.tangent(before.length()).dot(&after.tangent(0.0));
        if cos.clamp(-1.0, 1.0).acos() > angle_rad {
            spread(run[i + 1..].iter().map(whole), ramp.distance_mm, false, &mut |id, along| put(id, along, ramp));
            spread(run[..=i].iter().rev().map(whole), ramp.distance_mm, true, &mut |id, along| put(id, along, ramp));
        }
    }
}

/// Distributes a distance over consecutive pieces until it is used up; `backwards`: from the end of each piece.
pub(super) fn spread(
    pieces: impl Iterator<Item = (MoveId, f64, f64)>,
    distance_mm: f64,
    backwards: bool,
    put: &mut dyn FnMut(MoveId, [f64; 2]),
) {
    let mut left_mm = distance_mm;
    for (move_id, from_mm, to_mm) in pieces {
        let used = (to_mm - from_mm).min(left_mm);
        put(move_id, if backwards { [to_mm - used, to_mm] } else { [from_mm, from_mm + used] });
        left_mm -= used;
        if left_mm <= 0.0 {
            return;
        }
    }
}

fn capped(node: &mut Node, zones: &[Zone]) {
    let middle = 0.5 * (node.from_mm + node.to_mm);
    let over = zones.iter().filter(|zone| zone.along[0] <= middle && middle <= zone.along[1]);
    let feed_mm_s = over.map(|zone| zone.feed_mm_s).fold(f64::INFINITY, f64::min);
    if node.free && feed_mm_s < node.cap.feed_mm_s {
        node.cap = Bound { feed_mm_s, kind: LimitKind::Ramp, per_unit: 0.0 };
        node.floor.feed_mm_s = node.floor.feed_mm_s.min(feed_mm_s);
    }
}
