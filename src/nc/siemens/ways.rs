//! Where a block may send the control. In: a block, the labels of its text. Out: its ways: jumps, ends of structures, repeated sections, calls.

use super::structures::name;
use crate::ids::BlockId;
use crate::nc::interp::labels::{Labels, Way};
use crate::nc::program::Program;
use crate::nc::token::{Token, TokenKind};

/// Statements that run what a variable says, or a section of this program.
pub(super) const RUNS_ANYTHING: [&str; 4] = ["CALL", "PCALL", "EXTCALL", "EXECSTRING"];

/// Words behind which a block goes to a label.
const TO_LABELS: [&str; 7] = ["GOTOF", "GOTOB", "GOTO", "GOTOC", "GOTOS", "REPEAT", "REPEATB"];

/// Where a block may send the control; what is computed may be any block of its program, or any routine.
pub(super) fn ways(labels: &Labels, program: &Program, block: BlockId) -> Vec<Way> {
    let at = labels.structures.partition_point(|(known, _)| *known < block.0);
    if labels.structures.get(at).is_some_and(|(known, step)| *known == block.0 && *step < 0) {
        return labels.partner(block.0, false, false).map(Way::Block).into_iter().collect();
    }
    let text = program.text();
    let begin = labels.start_of_program(block.0);
    let blank = |kind| matches!(kind, TokenKind::Blank | TokenKind::LineEnd | TokenKind::Comment);
    let tokens: Vec<Token> = program.tokens(block).filter(|token| !blank(token.kind)).collect();
    let of_token = |(at, token): (usize, &Token)| match token.kind {
        TokenKind::Word(b'L') => vec![Way::Routine(format!("l{}", token.number as u64))],
        TokenKind::Name | TokenKind::Call => {
            let word = name(token, text);
            if TO_LABELS.contains(&word.as_str()) {
                return targets(labels, &tokens[at + 1..], text, (&word, begin));
            }
            match word.as_str() {
                _ if RUNS_ANYTHING.contains(&word.as_str()) => vec![Way::AnyRoutine],
                // RET may say where the caller goes on.
                "RET" => vec![Way::Caller],
                _ => vec![Way::Routine(word.to_ascii_lowercase())],
            }
        }
        _ => Vec::new(),
    };
    let mut ways: Vec<Way> = tokens.iter().enumerate().flat_map(of_token).collect();
    // A jump amid what is not read as words, as behind a text that is compared.
    let goes = |token: &Token| token.kind == TokenKind::Name && name(token, text).starts_with("GOTO");
    if program.line_text(block).to_ascii_uppercase().windows(4).any(|part| part == b"GOTO") && !tokens.iter().any(goes)
    {
        ways.push(Way::Block(begin));
    }
    ways
}

/// Where a jump or a repetition goes to; what is not stated may be the beginning of the program.
fn targets(labels: &Labels, behind: &[Token], text: &[u8], (word, begin): (&str, u32)) -> Vec<Way> {
    let label = |token: &&Token| matches!(token.kind, TokenKind::Name | TokenKind::Word(b'N'));
    let stated = behind.iter().take_while(label);
    let is_repeat = word.starts_with("REPEAT");
    let places = stated.take(if is_repeat { 2 } else { 1 }).map(|token| place_of(labels, token, text, begin));
    let places: Vec<Way> = places.map(|place| Way::Block(place.unwrap_or(begin))).collect();
    // REPEAT without a label begins a structure.
    if places.is_empty() && !(is_repeat && behind.is_empty()) { vec![Way::Block(begin)] } else { places }
}

/// First block of the program of the text with this label or N number.
fn place_of(labels: &Labels, token: &Token, text: &[u8], begin: u32) -> Option<u32> {
    let label = String::from_utf8_lossy(token.span.of(text)).trim().to_ascii_uppercase();
    let number = label.strip_prefix('N').and_then(|number| number.parse::<u32>().ok());
    let numbered = number.and_then(|number| labels.n_blocks.get(&number)).into_iter().flatten().copied();
    let named = labels.names.iter().filter(|(name, _)| *name == label).map(|(_, block)| *block);
    named.chain(numbered).filter(|block| labels.start_of_program(*block) == begin).min()
}
