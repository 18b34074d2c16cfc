//! Where a block may send the control. In: a block, the labels of its text. Out: its ways: loops of LinuxCNC (O words) and Macro B, GOTO, M97, M98,
//! M99 P, G65, G66, O calls.

use crate::ids::BlockId;
use crate::nc::interp::labels::{Labels, Way, label_of};
use crate::nc::program::Program;
use crate::nc::token::{Token, TokenKind};

/// Codes that call a routine: M98, M198, G65, G66, G66.1.
const CALLS: [(u8, f64); 5] = [(b'M', 98.0), (b'M', 198.0), (b'G', 65.0), (b'G', 66.0), (b'G', 66.1)];

/// Where a block may send the control; what is computed may be any block of its program, or any routine.
pub(super) fn ways(labels: &Labels, program: &Program, block: BlockId) -> Vec<Way> {
    let text = program.text();
    let at = labels.o_lines.partition_point(|line| line.block < block.0);
    if let Some(line) = labels.o_lines.get(at).filter(|line| line.block == block.0 && !line.keyword.is_empty()) {
        let openers: &[&str] = match line.keyword.as_str() {
            "WHILE" => &["DO"],
            "ENDWHILE" | "CONTINUE" | "ENDREPEAT" => &["WHILE", "DO", "REPEAT"],
            "CALL" if line.label.starts_with(['#', '[']) => return vec![Way::AnyRoutine],
            "CALL" => return vec![Way::Routine(line.label.clone())],
            _ => return Vec::new(),
        };
        return labels.before(block.0, &line.label, openers).map(|start| Way::Block(start.block)).into_iter().collect();
    }
    let blank = |kind| matches!(kind, TokenKind::Blank | TokenKind::LineEnd | TokenKind::Comment | TokenKind::Delete);
    let tokens: Vec<Token> = program.tokens(block).filter(|token| !blank(token.kind)).collect();
    let is =
        |token: &Token, name: &[u8]| token.kind == TokenKind::Name && token.span.of(text).eq_ignore_ascii_case(name);
    if let Some(at) = tokens.iter().position(|token| is(token, b"GOTO")) {
        let target = tokens.get(at + 1).map_or(&b""[..], |token| token.span.of(text)).trim_ascii();
        return vec![numbered(labels, std::str::from_utf8(target).ok().and_then(|text| text.parse().ok()), block)];
    }
    let has = |letter: u8, number: f64| {
        tokens.iter().any(|token| token.kind == TokenKind::Word(letter) && token.number == number)
    };
    let to = tokens.iter().find(|token| matches!(token.kind, TokenKind::Word(b'P') | TokenKind::Computed(b'P')));
    let number = to.filter(|token| token.kind == TokenKind::Word(b'P')).map(|token| token.number);
    // Macro A: G65 H80 to H86 jump.
    let jumps = |token: &Token| token.kind == TokenKind::Word(b'H') && (80.0..=86.0).contains(&token.number);
    if has(b'G', 65.0) && tokens.iter().any(jumps) {
        return vec![numbered(labels, number, block)];
    }
    if CALLS.iter().any(|(letter, number)| has(*letter, *number)) {
        // P100082 of some controls is ten times program 82.
        let routines = |number: f64| [number, number % 10_000.0].map(|of| Way::Routine(routine(of))).to_vec();
        return number.map_or_else(|| vec![Way::AnyRoutine], routines);
    }
    // M96 of Haas jumps where an input is off.
    if has(b'M', 97.0) || has(b'M', 96.0) {
        return vec![numbered(labels, number, block)];
    }
    if has(b'M', 99.0) && to.is_some() {
        return vec![numbered(labels, number, block), Way::Caller];
    }
    let Ok(end) = labels.loops.binary_search_by_key(&block.0, |each| each.0) else { return Vec::new() };
    let (_, number, is_end) = labels.loops[end];
    let opens = |other: &&(u32, u32, bool)| !other.2 && other.1 == number;
    let start = labels.loops[..end].iter().rev().find(opens).filter(|_| is_end);
    start.map(|start| Way::Block(start.0)).into_iter().collect()
}

fn routine(number: f64) -> String {
    label_of(TokenKind::Word(b'O'), number.max(0.0), b"")
}

/// The block with this N number; the beginning of the program where it is computed or not there.
fn numbered(labels: &Labels, number: Option<f64>, block: BlockId) -> Way {
    let found = number.filter(|number| *number >= 0.0).and_then(|number| labels.numbered(number as u32, block.0));
    Way::Block(found.unwrap_or_else(|| labels.start_of_program(block.0)))
}
