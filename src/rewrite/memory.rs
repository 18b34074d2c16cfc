//! The original feeds that a file written by an earlier run remembers. In: a part of a program. Out: the original feed of each of its F words,
//! and whether these can be relied on.
//!
//! Every F word of such a file stands for a feed of the program it was optimised from: the one in its note (`was`) or, without a note, its own.
//! If a changed word has no note (notes are not wanted, or the line is too short), the header is followed by a list of the original feeds of
//! all F words, in order and run-length coded, and the list counts instead. The header has a checksum over every F word and its original. A
//! later run works out both again, and the originals count as known only if they give that checksum. If they do not (a word was changed by
//! hand, notes were deleted, the list had no room), nothing in the part runs faster than it does now; the header stays unchanged, so that
//! this remains so.

use rayon::prelude::*;

use super::mark::{self, Ours};
use super::view::{self, View};
use crate::diag::Span;
use crate::ids::BlockId;
use crate::nc::{Part, Program};

/// Bytes that the list of original feeds may always take.
const LEAST_LIST: usize = 2000;
/// In longer texts it may take one part in this many.
const MOST_SHARE: usize = 20;

/// The original feeds of a part of a program.
#[derive(Debug, Clone)]
pub struct Memory {
    /// Every F word: its first byte, and the F number it stands for.
    words: Vec<(u32, String)>,
    /// Are these the feeds it was optimised from?
    pub fits: bool,
    /// The header comment.
    pub header: Span,
    /// Blocks that hold lists of original feeds.
    pub lists: Vec<BlockId>,
}

/// One F word with its number, and what its note says.
struct NotedWord {
    start: u32,
    number: String,
    was: Option<String>,
}

/// Headers and lists, with their blocks and places.
type Marks = Vec<(BlockId, Span, Ours)>;

impl Memory {
    /// Reads them; `None`: the part was not written by Feedwright.
    pub fn of(program: &Program, part: &Part<'_>) -> Option<Self> {
        if !mark::is_marked(program, part) {
            return None;
        }
        let of_block = |block: u32| -> (Vec<NotedWord>, Marks) {
            let view = View::of(program, BlockId(block));
            let marks = view.ours.iter().filter(|(_, ours)| !matches!(ours, Ours::Note(_)));
            let marks = marks.map(|(span, ours)| (BlockId(block), *span, ours.clone())).collect();
            (found(program, &view), marks)
        };
        let blocks: Vec<(Vec<NotedWord>, Marks)> = part.blocks.clone().into_par_iter().map(of_block).collect();
        let (mut words, mut marks) = (Vec::new(), Vec::new());
        for (of_block, mut of_marks) in blocks {
            words.extend(of_block);
            marks.append(&mut of_marks);
        }
        let (mut header, mut sum, mut lists, mut listed) = (None, None, Vec::new(), Vec::new());
        for (block, span, ours) in marks {
            match ours {
                Ours::Header(found) => (header, sum) = (header.or(Some(span)), sum.or(found)),
                Ours::Was(runs) => {
                    lists.push(block);
                    // Reading one more than there are words is enough to see that the list does not match.
                    let room = (words.len() + 1).saturating_sub(listed.len());
                    let each = runs.into_iter().flat_map(|(was, count)| std::iter::repeat_n(was, count));
                    listed.extend(each.take(room));
                }
                Ours::Note(_) | Ours::Check { .. } => {}
            }
        }
        let whole = listed.is_empty() || listed.len() == words.len();
        let mut listed = listed.into_iter();
        let stands_for = |word: &NotedWord| {
            let own = || word.was.clone().unwrap_or_else(|| word.number.clone());
            (word.start, listed.next().unwrap_or_else(own))
        };
        let numbers: Vec<String> = words.iter().map(|word| word.number.clone()).collect();
        let words: Vec<(u32, String)> = words.iter().map(stands_for).collect();
        let pairs = numbers.iter().zip(&words).map(|(number, (_, was))| (number.as_str(), was.as_str()));
        let fits = whole && sum == Some(self::sum(pairs));
        header.map(|header| Self { words, fits, header, lists })
    }

    /// F number that the word at this byte stands for.
    pub fn was(&self, start: u32) -> Option<&str> {
        let at = self.words.binary_search_by_key(&start, |word| word.0).ok()?;
        Some(&self.words[at].1)
    }
}

fn found(program: &Program, view: &View) -> Vec<NotedWord> {
    let text = |word: &view::Word| String::from_utf8_lossy(view::number_bytes(program, word)).into_owned();
    let note = view.note().map(|(_, note)| note);
    let of_word = |word: &view::Word| {
        let number = text(word);
        let was = note.filter(|note| note.feed == number).and_then(|note| note.was.clone());
        NotedWord { start: word.span.start, number, was }
    };
    view.words.iter().filter(|word| word.letter == b'F').map(of_word).collect()
}

/// Sum over F words, each with its number and the one it stands for: FNV-1a of 32 bits over both with a line end behind each.
pub fn sum<'a>(words: impl Iterator<Item = (&'a str, &'a str)>) -> u32 {
    let mut sum = 0x811c_9dc5_u32;
    for (number, was) in words {
        for byte in number.bytes().chain(*b"\n").chain(was.bytes()).chain(*b"\n") {
            sum = (sum ^ u32::from(byte)).wrapping_mul(0x0100_0193);
        }
    }
    sum
}

/// The feeds that F words stand for as texts of comments of at most `most` bytes each; `None`: they have no room in a part
/// of `bytes` bytes.
pub fn lists<'a>(was: impl Iterator<Item = &'a str>, most: usize, bytes: usize) -> Option<Vec<String>> {
    let mut runs: Vec<(&str, usize)> = Vec::new();
    for was in was {
        match runs.last_mut() {
            Some((last, count)) if *last == was => *count += 1,
            _ => runs.push((was, 1)),
        }
    }
    let mut lists: Vec<Vec<String>> = Vec::new();
    let mut used = 0;
    for (was, count) in runs {
        let run = mark::run_text(was, count);
        match lists.last_mut() {
            Some(list) if mark::was_text(list).len() + 1 + run.len() <= most => list.push(run),
            _ => lists.push(vec![run]),
        }
        used += was.len() + 4;
        if used > LEAST_LIST.max(bytes / MOST_SHARE) {
            return None;
        }
    }
    Some(lists.iter().map(|list| mark::was_text(list)).collect())
}
