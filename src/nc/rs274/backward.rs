//! Blocks that send the control back. In: a block, the labels of its text. Out: the earliest block it may go to: loops of LinuxCNC (O words) and
//! Macro B, GOTO, M99 P.

use crate::ids::BlockId;
use crate::nc::interp::labels::Labels;
use crate::nc::program::Program;
use crate::nc::token::{Token, TokenKind};

/// The earliest block, at most itself, to which a block may send the control back; what is computed may be the beginning of the program.
pub(super) fn goes_back_to(labels: &Labels, program: &Program, block: BlockId) -> Option<u32> {
    let line = labels.o_lines.iter().rfind(|line| line.block == block.0);
    if let Some(line) = line.filter(|line| !line.keyword.is_empty()) {
        let openers: &[&str] = match line.keyword.as_str() {
            "WHILE" => &["DO"],
            "ENDWHILE" | "CONTINUE" | "ENDREPEAT" => &["WHILE", "DO", "REPEAT"],
            _ => return None,
        };
        return labels.before(block.0, &line.label, openers).map(|start| start.block);
    }
    let text = program.text();
    let blank = |kind| matches!(kind, TokenKind::Blank | TokenKind::LineEnd | TokenKind::Comment | TokenKind::Delete);
    let tokens: Vec<Token> = program.tokens(block).filter(|token| !blank(token.kind)).collect();
    let is =
        |token: &Token, name: &[u8]| token.kind == TokenKind::Name && token.span.of(text).eq_ignore_ascii_case(name);
    if let Some(at) = tokens.iter().position(|token| is(token, b"GOTO")) {
        let target = tokens.get(at + 1).map_or(&b""[..], |token| token.span.of(text)).trim_ascii();
        return Some(target_of(labels, std::str::from_utf8(target).ok().and_then(|text| text.parse().ok()), block));
    }
    let returns = |token: &Token| token.kind == TokenKind::Word(b'M') && token.number == 99.0;
    if tokens.iter().any(returns) {
        let word = |letter: u8| tokens.iter().find(|token| token.kind == TokenKind::Word(letter));
        let computed = tokens.iter().any(|token| token.kind == TokenKind::Computed(b'P'));
        let number = word(b'P').map(|token| token.number);
        return (computed || number.is_some()).then(|| target_of(labels, number, block));
    }
    let end = labels.loops.iter().find(|(at, _, is_end)| *at == block.0 && *is_end)?;
    labels
        .loops
        .iter()
        .rev()
        .find(|(at, number, is_end)| *at < block.0 && !is_end && *number == end.1)
        .map(|start| start.0)
}

/// The block with this N number; the beginning of the program where it is computed or not there.
fn target_of(labels: &Labels, number: Option<f64>, block: BlockId) -> u32 {
    let found = number.filter(|number| *number >= 0.0).and_then(|number| labels.numbered(number as u32, block.0));
    found.unwrap_or_else(|| labels.start_of_program(block.0))
}
