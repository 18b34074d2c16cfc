//! Feeds that are safe in both positions of the block-delete switch. In: the problem for the program with the switch off. Out: the same problem
//! with every cap lowered to what is safe with the switch on as well. With the switch on, the stock differs after each skipped block, and
//! the path of the block after it may differ too.

use std::collections::BTreeMap;

use super::edges::EdgeWear;
use super::problem::{engagement, environment, problem_of};
use super::remarks;
use super::task::{JobError, SPACING_MM, Watch};
use crate::ids::MoveId;
use crate::machine::Job;
use crate::nc::{self, Environment, Move, MoveKind, Program, Toolpath};
use crate::outcome::Switched;
use crate::rewrite;
use crate::schedule::realise::pieces_of_moves;
use crate::schedule::{FeedPiece, Problem};
use crate::setup::Assumption;

/// Lowers the caps and tells what happens with the switch on; nothing happens to a program without such blocks.
pub fn both_positions(
    program: &Program,
    job: &Job,
    toolpath: &Toolpath,
    problem: &mut Problem,
    edges: EdgeWear,
    watch: &Watch,
) -> Result<Option<(Switched, Assumption)>, JobError> {
    if !program.has_block_delete() {
        return Ok(None);
    }
    let mut other = nc::interpret(program, &Environment { block_delete: true, ..environment(job, watch) });
    remarks::freeze_tools(&mut other, job);
    rewrite::freeze(program, &mut other, job);
    let map = engagement(&other, job, watch, "simulate", SPACING_MM[0])?;
    let posed = problem_of(program, &other, &map, job, &edges.history(&other, &map, job));
    let switched = Switched { toolpath: other, map, problem: posed };
    lower_to(problem, toolpath, &switched);
    let assumption = Assumption {
        key: "block delete".into(),
        value: "feeds are the lower of those with the switch off and on; loads are shown with it off".into(),
        source: "the program has blocks under the switch".into(),
    };
    Ok(Some((switched, assumption)))
}

/// Takes over what is lower with the switch on.
pub fn lower_to(problem: &mut Problem, toolpath: &Toolpath, on: &Switched) {
    let ids = moves_off(toolpath, &on.toolpath);
    for (id, motion) in on.toolpath.iter_moves() {
        let Some(here) = ids[id.ix()] else { continue };
        let same = toolpath.moves[here.ix()].curve() == motion.curve();
        lower(problem, here, &on.problem, id, same);
    }
}

/// Feeds on the moves with the switch on: those of the same moves with it off, by share of the length.
pub fn feeds_on(feeds: &[FeedPiece], off: &Toolpath, on: &Toolpath) -> Vec<FeedPiece> {
    let ids = moves_off(off, on);
    let of_move = pieces_of_moves(feeds, off.moves.len());
    let mut found = Vec::with_capacity(feeds.len());
    for (id, motion) in on.iter_moves().filter(|(_, motion)| motion.kind == MoveKind::Feed) {
        let length_mm = motion.curve().length();
        let pieces = ids[id.ix()]
            .map_or(&[][..], |here| &feeds[of_move[here.ix()].start as usize..of_move[here.ix()].end as usize]);
        let Some(last) = pieces.last() else {
            found.push(FeedPiece::commanded(id, [0.0, length_mm], motion.feed.mm_s));
            continue;
        };
        let scale = length_mm / last.to_mm.max(f64::MIN_POSITIVE);
        let there = |piece: &FeedPiece| FeedPiece {
            move_id: id,
            from_mm: scale * piece.from_mm,
            to_mm: scale * piece.to_mm,
            ..*piece
        };
        found.extend(pieces.iter().map(there));
    }
    found
}

/// For each move with the switch on the same move with it off.
pub fn moves_off(off: &Toolpath, on: &Toolpath) -> Vec<Option<MoveId>> {
    let ids: BTreeMap<_, _> = numbered(off).map(|(key, id, _)| (key, id)).collect();
    let mut found = vec![None; on.moves.len()];
    for (key, id, _) in numbered(on) {
        found[id.ix()] = ids.get(&key).copied();
    }
    found
}

/// Feed moves with block, execution, and their number in it.
fn numbered(toolpath: &Toolpath) -> impl Iterator<Item = ((u32, u32, u32), MoveId, &Move)> {
    let mut last = (u32::MAX, 0, 0);
    let feeds = toolpath.iter_moves().filter(|(_, motion)| motion.kind == MoveKind::Feed);
    feeds.map(move |(id, motion)| {
        let again = (last.0, last.1) == (motion.block.0, motion.instance);
        last = (motion.block.0, motion.instance, if again { last.2 + 1 } else { 0 });
        (last, id, motion)
    })
}

/// Takes over lower caps; piece by piece where the path is the same, else the lowest for the whole move.
fn lower(problem: &mut Problem, here: MoveId, switched: &Problem, there: MoveId, same: bool) {
    let Some(range) = problem.of_move.get(here.ix()).cloned() else { return };
    for node in &mut problem.nodes[range.start as usize..range.end as usize] {
        for other in switched.nodes_of(there) {
            let apart = same && (other.to_mm <= node.from_mm || other.from_mm >= node.to_mm);
            if apart || !node.free {
                continue;
            }
            if other.cap.feed_mm_s < node.cap.feed_mm_s {
                node.cap = other.cap;
                node.floor.feed_mm_s = node.floor.feed_mm_s.min(node.cap.feed_mm_s);
            }
            node.infeasible = node.infeasible.or(other.infeasible);
            node.uncertain |= other.uncertain;
        }
    }
}
