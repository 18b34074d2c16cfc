//! Whose cap holds the feed of each place in the written program. In: the problem, the pieces with their feeds. Out: a [`Holder`] for each
//! node.
//!
//! One F word covers many places, and the lowest cap among them holds all: a block in a loop that touches the stock with its first
//! millimetre keeps its feed to its end. So the holder of a node is the one with the lowest cap among the nodes of the moves that share
//! one feed with it (where there are such), and of the pieces before and behind it that run at the same feed.

use super::feed_segments::groups;
use super::problem::{FeedPiece, Holder, Problem};
use crate::nc::Toolpath;

/// The holder of each node.
pub fn holders(problem: &Problem, toolpath: &Toolpath, pieces: &[FeedPiece]) -> Vec<Holder> {
    let groups = groups(toolpath);
    let piece_of = pieces_of_nodes(problem, pieces);
    let run_of = runs(pieces);
    let order = |index: usize| {
        let node = &problem.nodes[index];
        let cap = if node.free { node.cap.feed_mm_s } else { node.programmed_mm_s };
        (cap / toolpath.moves[node.move_id.ix()].feed.over_contour, !node.cutting)
    };
    let mut of_run = vec![None; run_of.last().map_or(0, |last| last + 1)];
    let mut of_group = vec![None; groups.iter().flatten().max().map_or(0, |last| *last as usize + 1)];
    let group = |index: usize| groups[problem.nodes[index].move_id.ix()].map(|group| group as usize);
    for (index, piece) in piece_of.iter().enumerate() {
        let Some(piece) = *piece else { continue };
        lower(&order, &mut of_run[run_of[piece]], index);
        if let Some(group) = group(index) {
            lower(&order, &mut of_group[group], index);
        }
    }
    let holder = |(index, piece): (usize, &Option<usize>)| {
        let Some(piece) = *piece else { return Holder { feed_mm_s: f64::INFINITY, node: index as u32 } };
        let mut least = of_run[run_of[piece]];
        if let Some(of_group) = group(index).and_then(|group| of_group[group]) {
            lower(&order, &mut least, of_group);
        }
        Holder { feed_mm_s: pieces[piece].feed_mm_s, node: least.unwrap_or(index) as u32 }
    };
    piece_of.iter().enumerate().map(holder).collect()
}

/// Keeps the node whose cap asks for the lower F, and of equal ones the cut; the cap of a node whose feed may not change is its programmed feed.
fn lower(order: &dyn Fn(usize) -> (f64, bool), least: &mut Option<usize>, index: usize) {
    if least.is_none_or(|known| order(index) < order(known)) {
        *least = Some(index);
    }
}

/// The piece that covers most of each node.
fn pieces_of_nodes(problem: &Problem, pieces: &[FeedPiece]) -> Vec<Option<usize>> {
    let mut most: Vec<(Option<usize>, f64)> = vec![(None, 0.0); problem.nodes.len()];
    // F0 is no feed that anything could be held by; the program is refused for it elsewhere.
    for (number, piece) in pieces.iter().enumerate().filter(|(_, piece)| piece.feed_mm_s > 0.0) {
        let range = &problem.of_move[piece.move_id.ix()];
        let range = range.start as usize..range.end as usize;
        for (node, most) in problem.nodes[range.clone()].iter().zip(&mut most[range]) {
            let shared_mm = node.to_mm.min(piece.to_mm) - node.from_mm.max(piece.from_mm);
            if shared_mm > most.1 {
                *most = (Some(number), shared_mm);
            }
        }
    }
    most.into_iter().map(|(piece, _)| piece).collect()
}

/// Number of the run of equal feeds that each piece lies in.
fn runs(pieces: &[FeedPiece]) -> Vec<usize> {
    let mut run = 0;
    let number = |index: usize| {
        if index > 0 && pieces[index].feed_mm_s != pieces[index - 1].feed_mm_s {
            run += 1;
        }
        run
    };
    (0..pieces.len()).map(number).collect()
}
