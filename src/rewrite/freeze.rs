//! Feeds that the text does not let change, found before any feed is chosen. In: the program, its moves, the excluded lines. Out: for every
//! move why its feed must stay, and whether its block can be split, so that the schedule contains only feeds that can be written.
//!
//! A block without an F word belongs to the *modal span* of the F word in force. Where a block is reached with different F words in force (a
//! subprogram called twice), no single line before it could restate the feed, so nothing in those modal spans changes. Neither does a feed
//! that is set in a block under the block-delete switch.

use std::collections::{HashMap, HashSet};
use std::sync::OnceLock;

use rayon::prelude::*;

use crate::diag::Span;
use crate::ids::{BlockId, MoveId};
use crate::machine::Job;
use crate::nc::{FeedMode, Freeze, Move, MoveKind, Part, Program, Toolpath};

use super::fword::FeedUnit;
use super::plain;
use super::split::{self, Block};
use super::view::{Manners, Modes, Switched, View};

/// Moves that one thread handles in a row, because neighbours share blocks and F words.
const TOGETHER: usize = 4096;

/// Marks the moves whose feed must stay ([`Move::freeze`]) and those that cannot be cut ([`Move::splittable`]).
pub fn freeze(program: &Program, toolpath: &mut Toolpath, job: &Job) {
    hold_used_feeds(program, toolpath);
    if program.dialect().properties().counts_blocks {
        plain::one_feed_a_span(program, toolpath);
    }
    let modes = modes_by_block(program, toolpath);
    let found = forbidden(program, toolpath, &modes, job);
    let whole = uncuttable(program, toolpath, &modes);
    for (index, motion) in toolpath.moves.iter_mut().enumerate() {
        motion.freeze = found[index];
        motion.splittable &= !whole[index];
    }
    if !program.dialect().properties().counts_blocks {
        hold_under_compensation(program, toolpath);
    }
}

/// Keeps the feeds that something not simulated may use: of the moves in its block, and where no line can be inserted before that, of every
/// move under the F word in force.
fn hold_used_feeds(program: &Program, toolpath: &mut Toolpath) {
    let uses = std::mem::take(&mut toolpath.feed_uses);
    let blocks: HashSet<BlockId> = uses.iter().map(|used| used.block).collect();
    let inserts = !program.dialect().properties().counts_blocks;
    let words: HashSet<_> = uses.iter().filter(|_| !inserts).filter_map(|used| used.word).collect();
    for motion in &mut toolpath.moves {
        let held = blocks.contains(&motion.block) || motion.feed.word.is_some_and(|word| words.contains(&word));
        if held && motion.kind == MoveKind::Feed {
            motion.freeze = motion.freeze.or(Some(Freeze::NotUnderstood));
        }
    }
    toolpath.feed_uses = uses;
}

/// Keeps the feeds under radius compensation that would have to be restated beside another block without a motion: two such blocks in a row end
/// the look-ahead of many controls, and the path leaves the contour.
fn hold_under_compensation(program: &Program, toolpath: &mut Toolpath) {
    if !toolpath.moves.iter().any(|motion| motion.compensated) {
        return;
    }
    let [still, steering] = still_blocks(program, toolpath);
    let within = |blocks: &[u32], from: BlockId, to: BlockId| {
        let first = blocks.partition_point(|block| *block <= from.0);
        to < from || blocks.get(first).is_some_and(|block| *block < to.0)
    };
    // The last move at each F word that has to keep it.
    let mut last = HashMap::new();
    let mut word = None;
    for (index, pair) in toolpath.moves.windows(2).enumerate() {
        // The word in force may stand before compensation begins.
        word = if pair[0].kind == MoveKind::Feed { pair[0].feed.word } else { word };
        if !pair.iter().all(|motion| motion.compensated) {
            continue;
        }
        let [from, to] = [pair[0].block, pair[1].block];
        if within(&steering, from, to) || pair[1].freeze.is_some() && within(&still, from, to) {
            last.extend(word.map(|word| (word, index)));
        }
    }
    let feeds = |motion: &Move| motion.kind == MoveKind::Feed;
    let held = |index: usize, motion: &Move| {
        feeds(motion) && motion.feed.word.and_then(|word| last.get(&word)).is_some_and(|last| index <= *last)
    };
    let moves = toolpath.moves.iter().enumerate().filter(|(index, motion)| held(*index, motion));
    let blocks: HashSet<BlockId> = moves.map(|(_, motion)| motion.block).collect();
    for motion in toolpath.moves.iter_mut().filter(|motion| feeds(motion) && blocks.contains(&motion.block)) {
        motion.freeze = motion.freeze.or(Some(Freeze::LookAhead));
    }
}

/// Blocks without a motion, in order, and those of them before which the original feed is restated.
fn still_blocks(program: &Program, toolpath: &Toolpath) -> [Vec<u32>; 2] {
    let mut moves = vec![false; program.len()];
    for block in toolpath.moves.iter().map(|motion| motion.block.ix()).filter(|block| *block < program.len()) {
        moves[block] = true;
    }
    let (unread, used) = (toolpath.unread(), toolpath.blocks_that_use_the_feed());
    let [mut still, mut steering] = [Vec::new(), Vec::new()];
    for block in program.blocks().filter(|block| !moves[block.ix()]) {
        let view = View::of(program, block);
        if view.empty {
            continue;
        }
        still.push(block.0);
        let known = !view.flow && !view.delete && unread.binary_search(&block).is_err();
        if !known || used.binary_search(&block).is_ok() {
            steering.push(block.0);
        }
    }
    [still, steering]
}

/// Why each move must keep its feed, by move index: what the interpreter found, then what the text forbids.
pub fn freezes(program: &Program, toolpath: &Toolpath, job: &Job) -> Vec<Option<Freeze>> {
    forbidden(program, toolpath, &modes_by_block(program, toolpath), job)
}

fn forbidden(program: &Program, toolpath: &Toolpath, modes: &[Modes], job: &Job) -> Vec<Option<Freeze>> {
    let spans = mixed_spans(program, toolpath, modes);
    let uneven = uneven_groups(toolpath);
    let of_move = |text: &mut Text, motion: &Move| {
        if motion.freeze.is_some() || motion.kind == MoveKind::Rapid || motion.block.ix() >= program.len() {
            return motion.freeze;
        }
        let excluded = job.output.exclude.iter().any(|&(first, last)| (first..=last).contains(&motion.line));
        let one_f = !motion.shared.is_some_and(|number| uneven[number as usize]);
        let shared = motion.feed.word.is_some_and(|word| spans.binary_search(&start(word)).is_ok());
        if excluded {
            Some(Freeze::Excluded)
        } else if shared {
            Some(Freeze::SharedFeed)
        } else if !one_f {
            Some(Freeze::Repeated)
        } else {
            text.read(program, motion);
            text.forbids(motion, program.dialect().feed_unit_mm(modes[motion.block.ix()].inch))
        }
    };
    let together = |moves: &[Move]| {
        let mut text = Text::default();
        moves.iter().map(|motion| of_move(&mut text, motion)).collect::<Vec<_>>()
    };
    toolpath.moves.par_chunks(TOGETHER).flat_map_iter(together).collect()
}

fn start((_, span): (BlockId, Span)) -> u32 {
    span.start
}

/// Modes in force in each block, in the order of each text.
fn modes_by_block(program: &Program, toolpath: &Toolpath) -> Vec<Modes> {
    let blocks = 0..program.len() as u32;
    let switched: Vec<Switched> = blocks.into_par_iter().map(|block| Switched::by(program, BlockId(block))).collect();
    let of_part = |part: Part<'_>| {
        let mut modes = Modes { inch: toolpath.inch, incremental: false };
        switched[part.blocks.start as usize..part.blocks.end as usize].iter().map(move |switched| {
            modes = modes.after(*switched);
            modes
        })
    };
    program.parts().flat_map(of_part).collect()
}

/// Places of the F words, sorted, that are in force in a block in which another F word may be in force too, or in which the unit of length is
/// another than where the word stands. An approach of plain language begins with the feed before it and ends with its own, which is in force behind it
/// whatever came before and is not held. A corner or a block with a feed of its own takes no part.
fn mixed_spans(program: &Program, toolpath: &Toolpath, modes: &[Modes]) -> Vec<u32> {
    let takes_part = |motion: &&Move| {
        let is_own = motion.freeze == Some(Freeze::OwnFeed) && motion.feed.word.is_none();
        motion.kind == MoveKind::Feed && motion.block.ix() < program.len() && !is_own
    };
    let feeds = || toolpath.moves.iter().filter(takes_part);
    let mut first: Vec<Option<Option<u32>>> = vec![None; program.len()];
    let mut mixed = vec![false; program.len()];
    let unit = |block: BlockId| modes[block.ix()].inch;
    for motion in feeds() {
        let word = motion.feed.word.map(start);
        mixed[motion.block.ix()] |= motion.feed.word.is_some_and(|(block, _)| unit(block) != unit(motion.block));
        let known = first[motion.block.ix()].get_or_insert(word);
        mixed[motion.block.ix()] |= *known != word;
    }
    let ends_approach = |motion: &Move| {
        motion.freeze == Some(Freeze::Approach) && motion.feed.word.is_some_and(|(block, _)| block == motion.block)
    };
    let in_mixed = feeds().filter(|motion| mixed[motion.block.ix()] && !ends_approach(motion));
    let mut words: Vec<u32> = in_mixed.filter_map(|motion| motion.feed.word.map(start)).collect();
    words.sort_unstable();
    words.dedup();
    words
}

/// For each number of [`Move::shared`]: does one F word give different feeds in its moves? It does in inverse time with different lengths, and
/// per revolution at different spindle speeds.
fn uneven_groups(toolpath: &Toolpath) -> Vec<bool> {
    let mut groups: Vec<Option<([f64; 2], bool)>> = Vec::new();
    for motion in &toolpath.moves {
        let Some(number) = motion.shared else { continue };
        if groups.len() <= number as usize {
            groups.resize(number as usize + 1, None);
        }
        let length = motion.curve().length();
        let ([rps, first], uneven) = groups[number as usize].get_or_insert(([motion.spin.rps, length], false));
        *uneven |= match motion.feed.mode {
            FeedMode::PerMinute => false,
            FeedMode::InverseTime => (*first - length).abs() > 1e-9 * length,
            FeedMode::PerRev => *rps != motion.spin.rps,
        };
    }
    groups.into_iter().map(|group| group.is_some_and(|(_, uneven)| uneven)).collect()
}

/// The block and the F word that were read last: neighbours share them.
#[derive(Default)]
struct Text {
    block: Option<(BlockId, View)>,
    word: Option<((BlockId, Span), f64, bool)>,
}

impl Text {
    fn read(&mut self, program: &Program, motion: &Move) {
        if self.block.as_ref().is_none_or(|(block, _)| *block != motion.block) {
            self.block = Some((motion.block, View::of(program, motion.block)));
        }
        let Some(word) = motion.feed.word else { return };
        if self.word.is_none_or(|(known, ..)| known != word) {
            let view = View::of(program, word.0);
            let number = view.words.iter().find(|w| w.span == word.1).map_or(f64::NAN, |w| w.number);
            self.word = Some((word, number, view.delete));
        }
    }

    fn forbids(&self, motion: &Move, unit_mm: f64) -> Option<Freeze> {
        let (_, view) = self.block.as_ref()?;
        let (_, number, deleted) = self.word.filter(|(word, ..)| motion.feed.word == Some(*word))?;
        let twice = view.words.iter().filter(|word| word.letter == b'F').count() > 1;
        if deleted || view.delete {
            Some(Freeze::BlockDelete)
        } else if (view.flow || !view.worded || view.computed_feed) && (motion.instance > 0 || motion.shared.is_some())
        {
            Some(Freeze::Repeated)
        } else if view.flow {
            Some(Freeze::Steers)
        } else if view.computed_feed {
            Some(Freeze::Expression)
        } else if twice || !explains(number, motion, unit_mm) {
            Some(Freeze::NotUnderstood)
        } else {
            None
        }
    }
}

/// Does this F number, in this unit of length, give the feed of the move? Not tested in inverse time under radius compensation, where the
/// length of the contour counts and not that of the move.
fn explains(number: f64, motion: &Move, unit_mm: f64) -> bool {
    let length_mm = motion.curve().length();
    let inverse = motion.feed.mode == FeedMode::InverseTime;
    let beside = inverse && !motion.splittable && number > 0.0 && motion.feed.mm_s > 0.0;
    let (mode, rps, over_contour) = (motion.feed.mode, motion.spin.rps, motion.feed.over_contour);
    let unit = FeedUnit { mode, unit_mm, rps, length_mm, over_contour };
    let empty = inverse && length_mm == 0.0;
    empty || beside || unit.is_usable() && (unit.f_of(motion.feed.mm_s) - number).abs() <= 1e-6 * number.abs()
}

/// Which moves belong to a block that cannot be cut, by move index.
fn uncuttable(program: &Program, toolpath: &Toolpath, modes: &[Modes]) -> Vec<bool> {
    let parts: Vec<(Part<'_>, Manners, OnceLock<bool>)> =
        program.parts().map(|part| (part.clone(), Manners::of(program, &part), OnceLock::new())).collect();
    let of_move = |(index, motion): (usize, &Move)| {
        if !motion.splittable || motion.kind == MoveKind::Rapid || motion.block.ix() >= program.len() {
            return true;
        }
        let view = View::of(program, motion.block);
        let part = parts.partition_point(|(part, ..)| part.blocks.end <= motion.block.0);
        let (part, manners, jumps) = &parts[part];
        let jumps = || *jumps.get_or_init(|| part.blocks().any(|block| View::of(program, block).jumps));
        let block = Block::new(program, toolpath, &view, modes[motion.block.ix()], *manners, MoveId(index as u32));
        (view.has(b'N') && jumps()) || !split::can_be_cut(&block)
    };
    toolpath.moves.par_iter().enumerate().map(of_move).collect()
}
