//! The feeds a program was written for. In: a program that an earlier run may have rewritten, with its toolpath. Out: for
//! every move the feed that our note beside its F word remembers (`was`), else the one it has.

use super::mark::Ours;
use super::view::View;
use crate::diag::Span;
use crate::ids::BlockId;
use crate::nc::{Program, Toolpath};

/// Feed of each move before the earlier run, mm/s, by move index.
pub fn references(program: &Program, toolpath: &Toolpath) -> Vec<f64> {
    let mut last: Option<((BlockId, Span), f64)> = None;
    let feed = |motion: &crate::nc::Move| {
        let Some(word) = motion.feed.word else { return motion.feed.mm_s };
        let ratio = match last {
            Some((known, ratio)) if known == word => ratio,
            _ => remembered(program, word).unwrap_or(1.0),
        };
        last = Some((word, ratio));
        motion.feed.mm_s * ratio
    };
    toolpath.moves.iter().map(feed).collect()
}

/// Does any note remember a feed?
pub fn remembers(program: &Program, toolpath: &Toolpath) -> bool {
    toolpath.moves.iter().filter_map(|motion| motion.feed.word).any(|word| remembered(program, word).is_some())
}

/// What the note remembers over what the word says; `None`: there is no note, or it speaks of another feed.
fn remembered(program: &Program, (block, span): (BlockId, Span)) -> Option<f64> {
    let view = View::of(program, block);
    let note = view.ours.iter().find_map(|(_, ours)| match ours {
        Ours::Note(note) => Some(note),
        Ours::Header => None,
    })?;
    let (was, now): (f64, f64) = (note.was.as_ref()?.parse().ok()?, note.feed.parse().ok()?);
    let word = std::str::from_utf8(span.of(program.text())).ok()?;
    let written: f64 = word.get(1..)?.trim().parse().ok()?;
    ((written - now).abs() <= 1e-9 * now.abs() && now > 0.0).then_some(was / now)
}
