//! Blocks that send the control back. In: a block, the labels of its text. Out: the earliest block it may go to: jumps, ends of structures,
//! repeated sections.

use super::structures::name;
use crate::ids::BlockId;
use crate::nc::interp::labels::Labels;
use crate::nc::program::Program;
use crate::nc::token::{Token, TokenKind};

/// Words behind which a block goes to a label.
const TO_LABELS: [&str; 7] = ["GOTOF", "GOTOB", "GOTO", "GOTOC", "GOTOS", "REPEAT", "REPEATB"];

/// The earliest block, at most itself, to which a block may send the control back; what is computed may be the beginning of the program.
pub(super) fn goes_back_to(labels: &Labels, program: &Program, block: BlockId) -> Option<u32> {
    let at = labels.structures.partition_point(|(known, _)| *known < block.0);
    if labels.structures.get(at).is_some_and(|(known, step)| *known == block.0 && *step < 0) {
        return labels.partner(block.0, false, false);
    }
    let text = program.text();
    let begin = labels.start_of_program(block.0);
    let tokens: Vec<Token> =
        program.tokens(block).filter(|token| !matches!(token.kind, TokenKind::Blank | TokenKind::LineEnd)).collect();
    let goes =
        |at: &usize| tokens[*at].kind == TokenKind::Name && TO_LABELS.contains(&name(&tokens[*at], text).as_str());
    let targets = (0..tokens.len()).filter(goes).flat_map(|at| {
        let word = name(&tokens[at], text);
        let label = |token: &&Token| matches!(token.kind, TokenKind::Name | TokenKind::Word(b'N'));
        let stated: Vec<&Token> = tokens[at + 1..].iter().take_while(label).collect();
        let is_repeat = word.starts_with("REPEAT");
        if stated.is_empty() && is_repeat {
            return Vec::new();
        }
        let count = if is_repeat { stated.len() } else { 1 };
        let place = |token: &Token| place_of(labels, token, text, begin).unwrap_or(begin);
        match stated.get(..count) {
            Some(stated) => stated.iter().map(|token| place(token)).collect(),
            None => vec![begin],
        }
    });
    targets.min()
}

/// First block of the program of the text with this label or N number.
fn place_of(labels: &Labels, token: &Token, text: &[u8], begin: u32) -> Option<u32> {
    let label = String::from_utf8_lossy(token.span.of(text)).trim().to_ascii_uppercase();
    let number = label.strip_prefix('N').and_then(|number| number.parse::<u32>().ok());
    let numbered = number.and_then(|number| labels.n_blocks.get(&number)).into_iter().flatten().copied();
    let named = labels.names.iter().filter(|(name, _)| *name == label).map(|(_, block)| *block);
    named.chain(numbered).filter(|block| labels.start_of_program(*block) == begin).min()
}
