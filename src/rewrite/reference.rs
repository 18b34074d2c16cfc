//! The original feed of every move. In: a program that an earlier run may have rewritten, with its toolpath. Out: for every move its feed in
//! the program that was optimised first, and whether that is known ([`super::memory`]).

use super::memory::Memory;
use crate::diag::Span;
use crate::ids::BlockId;
use crate::nc::{Move, Part, Program, Toolpath};

/// Feed of a move before any run of ours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    /// That feed, mm/s; where it is not known, the one it has.
    pub feed_mm_s: f64,
    /// Is it known?
    pub known: bool,
}

/// The reference of each move, by move index.
pub fn references(program: &Program, toolpath: &Toolpath) -> Vec<Reference> {
    let parts: Vec<(Part<'_>, Option<Memory>)> =
        program.parts().map(|part| (part.clone(), Memory::of(program, &part))).collect();
    let memory_of = |block: BlockId| {
        let part = parts.partition_point(|(part, _)| part.blocks.end <= block.0);
        parts.get(part).and_then(|(_, memory)| memory.as_ref())
    };
    let mut last: Option<((BlockId, Span), f64)> = None;
    let reference = |motion: &Move| {
        let word = motion.feed.word;
        let fits = |block: BlockId| memory_of(block).is_none_or(|memory| memory.fits);
        let known = fits(motion.block) && word.is_none_or(|(block, _)| fits(block));
        let Some(word) = word.filter(|_| known) else { return Reference { feed_mm_s: motion.feed.mm_s, known } };
        let ratio = match last {
            Some((read, ratio)) if read == word => ratio,
            _ => memory_of(word.0).and_then(|memory| ratio(program, memory, word.1)).unwrap_or(1.0),
        };
        last = Some((word, ratio));
        Reference { feed_mm_s: motion.feed.mm_s * ratio, known }
    };
    toolpath.moves.iter().map(reference).collect()
}

/// Was a part of the program written by Feedwright and has lost its original feeds?
pub fn forgets(program: &Program) -> bool {
    program.parts().filter_map(|part| Memory::of(program, &part)).any(|memory| !memory.fits)
}

/// Original feed of an F word over the feed that it gives now.
fn ratio(program: &Program, memory: &Memory, span: Span) -> Option<f64> {
    let was: f64 = memory.was(span.start)?.parse().ok()?;
    let word = std::str::from_utf8(span.of(program.text())).ok()?;
    let number = word.find(|c: char| c.is_ascii_digit() || matches!(c, '.' | '+' | '-')).map(|at| &word[at..])?;
    let now: f64 = number.parse().ok()?;
    (now > 0.0 && was > 0.0).then_some(was / now)
}
