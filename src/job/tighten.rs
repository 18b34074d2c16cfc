//! Caps of the next round after a check. In: the [`Breach`]es, the [`Problem`] of the schedule. Out: the same problem with the caps that these
//! places should have had; or feeds lowered without splitting blocks at other places.
//!
//! A place is listed as infeasible, and runs at the lowest feed allowed, if no feed allowed meets its limit or no round is left to try a lower
//! one.

use super::origins::Origin;
use crate::ids::BlockId;
use crate::machine::LimitKind;
use crate::machine::limits::FEED_CHANGE_MIN;
use crate::nc::{Freeze, Toolpath};
use crate::outcome::ProgramRun;
use crate::schedule::caps::LEAST;
use crate::schedule::f_words::Grid;
use crate::schedule::{Bound, FeedPiece, Node, Problem};

/// Two places share no more than this: they touch, mm.
pub const OVERLAP_MM: f64 = 1e-6;

/// A place whose load is above its limit in the written program, on the original's path.
#[derive(Debug, Clone, Copy)]
pub struct Breach {
    /// Where.
    pub origin: Origin,
    /// The limit.
    pub kind: LimitKind,
    /// The feed it should have had; `None`: there is none.
    pub cap_mm_s: Option<f64>,
}

/// Does a breach need a lower cap than the schedule had?
pub fn asks_for_lower_cap(problem: &Problem, breach: &Breach) -> bool {
    let mut over = problem.nodes_of(breach.origin.move_id).iter().filter(|node| overlaps(node, &breach.origin));
    over.any(|node| match reachable(node, breach) {
        Some(cap_mm_s) => node.cap.feed_mm_s > cap_mm_s,
        None => node.infeasible.is_none(),
    })
}

/// Does a place lie on a node, or touch it where it has no length?
pub fn overlaps(node: &Node, origin: &Origin) -> bool {
    let slack = 1e-6;
    node.from_mm < origin.to_mm - slack && node.to_mm > origin.from_mm + slack
        || origin.to_mm - origin.from_mm <= slack && node.from_mm <= origin.to_mm && node.to_mm >= origin.from_mm
}

/// Blocks in which the proof found a difference stay whole from now on; those that were whole already keep their feed.
pub fn leave_alone(run: &mut ProgramRun, blocks: &[BlockId]) {
    let splits = run.job.output.split;
    let was_whole: Vec<BlockId> =
        blocks.iter().copied().filter(|block| stays_whole(&mut run.toolpath, *block) || !splits).collect();
    for node in &mut run.problem.nodes {
        let motion = &mut run.toolpath.moves[node.move_id.ix()];
        if was_whole.contains(&motion.block) {
            node.free = false;
            node.cap = Bound { feed_mm_s: node.programmed_mm_s, kind: LimitKind::Programmed, per_unit: 0.0 };
            motion.freeze = motion.freeze.or(Some(Freeze::Unproved));
        }
    }
}

/// Makes a block stay whole, and says whether it did already.
fn stays_whole(toolpath: &mut Toolpath, block: BlockId) -> bool {
    let mut was_whole = true;
    for motion in toolpath.moves.iter_mut().filter(|motion| motion.block == block) {
        was_whole &= !std::mem::take(&mut motion.splittable);
    }
    was_whole
}

/// Lowers the caps at the breaches. `last`: no round is left, so the places are listed as infeasible.
pub fn tighten(problem: &mut Problem, breaches: &[Breach], last: bool) {
    for breach in breaches {
        let range = problem.of_move[breach.origin.move_id.ix()].clone();
        for node in &mut problem.nodes[range.start as usize..range.end as usize] {
            if overlaps(node, &breach.origin) {
                tighten_node(node, breach, last);
            }
        }
    }
}

/// Lowers the feed of each piece with a breach to the caps that the problem has there now. Blocks stay split where they are.
pub fn lower_in_place(pieces: &mut [FeedPiece], problem: &Problem, breaches: &[Breach], grid: &Grid) {
    for breach in breaches {
        let Origin { move_id, from_mm, to_mm } = breach.origin;
        let nodes = problem.nodes_of(move_id).iter().filter(|node| overlaps(node, &breach.origin));
        let cap_mm_s = nodes.map(|node| node.cap.feed_mm_s).fold(f64::INFINITY, f64::min);
        let first = pieces.partition_point(|piece| piece.move_id < move_id);
        let of_move = pieces[first..].iter_mut().take_while(|piece| piece.move_id == move_id);
        let over = of_move.filter(|p| p.from_mm < to_mm + OVERLAP_MM && p.to_mm > from_mm - OVERLAP_MM);
        for piece in over.filter(|piece| piece.feed_mm_s > cap_mm_s) {
            piece.feed_mm_s = grid.below(cap_mm_s);
            piece.limit = breach.kind;
        }
    }
}

/// The first place, on the original's path, where no feed allowed meets the limit.
pub fn hopeless<'a>(problem: &Problem, breaches: &'a [Breach]) -> Option<&'a Breach> {
    breaches.iter().find(|breach| {
        let nodes = problem.nodes_of(breach.origin.move_id).iter();
        nodes.filter(|node| overlaps(node, &breach.origin)).any(|node| reachable(node, breach).is_none())
    })
}

/// Feed that a breach asks for, where it is one that may be commanded.
fn reachable(node: &Node, breach: &Breach) -> Option<f64> {
    breach.cap_mm_s.filter(|cap| *cap >= LEAST * lowest_mm_s(node))
}

/// Lowest feed of a node, mm/s; in air, where the floor is 0, the lowest change of feed that is allowed, so never 0.
fn lowest_mm_s(node: &Node) -> f64 {
    let asked = if node.floor.feed_mm_s > 0.0 { node.floor.feed_mm_s } else { FEED_CHANGE_MIN * node.programmed_mm_s };
    asked.min(node.programmed_mm_s)
}

fn tighten_node(node: &mut Node, breach: &Breach, last: bool) {
    node.cap.kind = breach.kind;
    let Some(cap_mm_s) = reachable(node, breach) else {
        node.cap.feed_mm_s = lowest_mm_s(node);
        node.infeasible = Some(breach.kind);
        return;
    };
    node.cap.feed_mm_s = node.cap.feed_mm_s.min(cap_mm_s);
    node.floor.feed_mm_s = node.floor.feed_mm_s.min(node.cap.feed_mm_s);
    if last {
        node.infeasible = Some(breach.kind);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::MoveId;

    /// A millimetre of air that may run at 80 mm/s.
    fn air() -> Node {
        let bound = |feed_mm_s: f64| Bound { feed_mm_s, kind: LimitKind::AirFeed, per_unit: 0.0 };
        Node { to_mm: 1.0, cutting: false, ..Node::between(bound(0.0), bound(80.0)) }
    }

    const MET_AT_30: Breach = Breach {
        origin: Origin { move_id: MoveId(0), from_mm: 0.0, to_mm: 1.0 },
        kind: LimitKind::ForceXy,
        cap_mm_s: Some(30.0),
    };

    /// Once the schedule has a cap, or has given a place up, the same breach asks for nothing more.
    #[test]
    fn a_breach_asks_until_the_schedule_has_its_cap() {
        let mut problem =
            Problem { nodes: vec![air()], of_move: std::iter::once(0..1).collect(), ..Problem::default() };
        for breach in [MET_AT_30, Breach { cap_mm_s: None, ..MET_AT_30 }] {
            assert!(asks_for_lower_cap(&problem, &breach), "{breach:?}");
            tighten(&mut problem, &[breach], false);
            assert!(!asks_for_lower_cap(&problem, &breach), "{breach:?}");
        }
        let elsewhere = Origin { from_mm: 1.5, to_mm: 2.0, ..MET_AT_30.origin };
        assert!(!asks_for_lower_cap(&problem, &Breach { origin: elsewhere, ..MET_AT_30 }));
    }

    /// A load that no feed can meet where the schedule saw air: the lowest change of feed holds, never a feed of zero (which
    /// no block can be written with).
    #[test]
    fn what_cannot_be_met_in_the_air_still_has_a_feed() {
        let (mut node, met) = (air(), MET_AT_30);
        tighten_node(&mut node, &met, false);
        assert!(node.cap.feed_mm_s == 30.0 && node.infeasible.is_none());
        tighten_node(&mut node, &Breach { cap_mm_s: None, ..met }, false);
        assert!(node.cap.feed_mm_s == FEED_CHANGE_MIN * 10.0 && node.infeasible == Some(LimitKind::ForceXy));
    }
}
