//! Feeds that a thread pitch sets although no tapping code stands there: tapping written as G1, thread milling. In: the moves and
//! the comments. Out: moves frozen as [`Freeze::Synchronised`].
//!
//! Tapping written as G1: a straight feed move along Z, at once followed by one back along the same line, and either
//! the spindle turns the other way on the way back, or on both ways F = P · S with P a pitch of ISO 261 or ASME B1.1. And
//! every feed move of a tool that a comment calls a tap or a thread mill: at its depth a thread mill's helix is one pitch a turn.

use crate::ids::BlockId;
use crate::nc::program::Program;
use crate::nc::token::{Token, TokenKind};
use crate::nc::toolpath::{Freeze, Move, MoveKind};

/// Pitches of metric threads, mm (ISO 261, M1 to M64).
const METRIC_MM: [f64; 23] = [
    0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.6, 0.7, 0.75, 0.8, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5,
    6.0,
];
/// Threads per inch of unified and pipe threads (ASME B1.1, B1.20.1).
const PER_INCH: [f64; 25] = [
    80.0, 72.0, 64.0, 56.0, 48.0, 44.0, 40.0, 36.0, 32.0, 28.0, 27.0, 24.0, 20.0, 18.0, 16.0, 14.0, 13.0, 12.0, 11.5,
    11.0, 10.0, 9.0, 8.0, 7.0, 6.0,
];
/// Relative difference up to which F counts as P · S. F is written with few digits (F88 for 1.25 mm at 70/min) and is off by up to half of
/// the last. 0.2 % covers that at usual speeds, and the feed per revolution of a drill is seldom so close to a pitch by chance.
const ROUNDING: f64 = 0.002;
/// A move is straight along Z if it leaves the line by no more than rounding, mm.
const STRAIGHT_MM: f64 = 1e-6;
/// A comment names the tool that is called within so many blocks after it.
const NEAR_BLOCKS: u32 = 3;

/// Freezes what belongs to a pitch.
pub(super) fn keep(program: &Program, moves: &mut [Move]) {
    for index in 1..moves.len() {
        if is_tapping(&moves[index - 1], &moves[index]) {
            for motion in &mut moves[index - 1..=index] {
                motion.freeze = motion.freeze.or(Some(Freeze::Synchronised));
            }
        }
    }
    let threading = threading_tools(program);
    if !threading.is_empty() {
        for motion in moves.iter_mut().filter(|m| m.kind == MoveKind::Feed && threading.contains(&m.tool)) {
            motion.freeze = motion.freeze.or(Some(Freeze::Synchronised));
        }
    }
}

fn is_tapping(into: &Move, out: &Move) -> bool {
    if into.kind != MoveKind::Feed || out.kind != MoveKind::Feed {
        return false;
    }
    let (Some(depth), Some(rise)) = (along_z(into), along_z(out)) else { return false };
    let reversed = into.spin.reverse != out.spin.reverse && into.spin.rps > 0.0 && out.spin.rps > 0.0;
    depth < 0.0 && rise > 0.0 && (reversed || at_pitch(into) && at_pitch(out))
}

/// How far it rises, mm; `None`: it is not straight along Z.
fn along_z(motion: &Move) -> Option<f64> {
    let curve = motion.curve();
    let way = curve.to() - curve.from();
    (way.x.abs() <= STRAIGHT_MM && way.y.abs() <= STRAIGHT_MM && (curve.length() - way.z.abs()).abs() <= STRAIGHT_MM)
        .then_some(way.z)
}

/// Is its feed per turn a thread pitch?
fn at_pitch(motion: &Move) -> bool {
    let per_turn = motion.feed.mm_s / motion.spin.rps;
    let is = |pitch: f64| (per_turn - pitch).abs() <= ROUNDING * pitch;
    METRIC_MM.into_iter().chain(PER_INCH.map(|threads| crate::units::MM_PER_INCH / threads)).any(is)
}

/// Numbers of the tools that comments call a tap or a thread mill.
fn threading_tools(program: &Program) -> Vec<u32> {
    let text = program.text();
    let mut tools = Vec::new();
    for at in memchr::memchr2_iter(b'T', b't', text).filter(|&at| names_thread(&text[at..])) {
        let letter = |byte: Option<&u8>| byte.is_some_and(u8::is_ascii_alphabetic);
        if at > 0 && letter(text.get(at - 1)) {
            continue;
        }
        let block = program.block_at(at as u32);
        // Beside the number of the program stands its title: `O1000 (DRILL AND TAP)`.
        if program.tokens(block).any(|token| token.kind == TokenKind::Word(b'O')) {
            continue;
        }
        let inside = |token: &Token| {
            token.kind == TokenKind::Comment && (token.span.start..token.span.end).contains(&(at as u32))
        };
        let Some(comment) = program.tokens(block).find(inside) else { continue };
        tools.extend(number_in(comment.span.of(text)).or_else(|| called_near(program, block)));
    }
    tools
}

/// `TAP`, `TAPPING`, `THREAD MILL`, `THREADMILL`, `THREAD-MILL` at the start of this text; no `TAPER`.
fn names_thread(text: &[u8]) -> bool {
    let begins = |word: &str| text.len() >= word.len() && text[..word.len()].eq_ignore_ascii_case(word.as_bytes());
    let ends_at = |at: usize| !text.get(at).is_some_and(u8::is_ascii_alphabetic);
    begins("TAP") && ends_at(3)
        || begins("TAPPING")
        || ["THREAD MILL", "THREADMILL", "THREAD-MILL"].into_iter().any(begins)
}

/// `T5` at the beginning of a comment.
fn number_in(comment: &[u8]) -> Option<u32> {
    let inner = comment.trim_ascii().strip_prefix(b"(").or(comment.strip_prefix(b";"))?.trim_ascii_start();
    let digits = inner.strip_prefix(b"T").or(inner.strip_prefix(b"t"))?;
    let end = digits.iter().position(|byte| !byte.is_ascii_digit()).unwrap_or(digits.len());
    std::str::from_utf8(&digits[..end]).ok()?.parse().ok()
}

/// The T word of this block, else the next one close by, else the one close before.
fn called_near(program: &Program, block: BlockId) -> Option<u32> {
    let tool = |block: u32| {
        let word = program.tokens(BlockId(block)).find(|token| token.kind == TokenKind::Word(b'T'));
        word.map(|token| token.number.max(0.0) as u32)
    };
    let last = (program.len() as u32).saturating_sub(1);
    let after = (block.0..=(block.0 + NEAR_BLOCKS).min(last)).find_map(tool);
    after.or_else(|| (block.0.saturating_sub(NEAR_BLOCKS)..block.0).rev().find_map(tool))
}
