//! Feeds of plain language. In: program and moves. Out: moves that must share one feed, or keep theirs.
//!
//! Blocks of plain language are numbered without gaps, so no line can be inserted to restate a feed, and no block can be split. The *span* of
//! an F word is every move that runs at it. If no label, call, jump or cycle stands between the word and the last of these moves, each block can
//! have its own F. Otherwise the whole span gets one feed, written into that word, which must then stand in a block with a motion, and nothing
//! in the span may be frozen.

use std::collections::BTreeMap;

use crate::ids::BlockId;
use crate::nc::{Freeze, MoveKind, Program, Toolpath};

use super::view::View;

/// What is known of the span of one F word.
#[derive(Default)]
struct Reach {
    last: u32,
    moves: Vec<usize>,
    /// The word stands in a block that moves.
    stated: bool,
    frozen: bool,
}

/// Gives spans that are crossed by the flow of the program one feed.
pub fn one_feed_a_span(program: &Program, toolpath: &mut Toolpath) {
    let mut spans: BTreeMap<(u32, u32), Reach> = BTreeMap::new();
    for (index, motion) in toolpath.moves.iter().enumerate().filter(|(_, motion)| motion.kind == MoveKind::Feed) {
        let Some((block, span)) = motion.feed.word else { continue };
        let reach = spans.entry((block.0, span.start)).or_default();
        reach.last = reach.last.max(motion.block.0);
        reach.stated |= motion.block == block;
        reach.frozen |= motion.freeze.is_some();
        reach.moves.push(index);
    }
    let flow: Vec<u32> =
        program.blocks().filter(|block| View::of(program, *block).flow).map(|BlockId(block)| block).collect();
    let mut number = toolpath.moves.iter().filter_map(|motion| motion.shared).max().map_or(0, |most| most + 1);
    for ((first, _), reach) in spans {
        let after = flow.partition_point(|block| *block <= first);
        let crossed = flow.get(after).is_some_and(|block| *block <= reach.last);
        let back = reach.moves.iter().any(|&index| toolpath.moves[index].block.0 < first);
        if !crossed && !back {
            continue;
        }
        for index in reach.moves {
            let motion = &mut toolpath.moves[index];
            if reach.frozen || !reach.stated {
                motion.freeze = motion.freeze.or(Some(Freeze::SharedFeed));
            } else {
                motion.shared = Some(number);
            }
        }
        number += 1;
    }
}
