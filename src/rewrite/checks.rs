//! Marks of check points: comments before the blocks at which force or power is to be measured. In: a program and the blocks; or a program
//! with such marks. Out: the program with the marks; or the marks with the blocks after them.

use super::edit::{self, Edit};
use super::mark::{self, Ours};
use super::view::{Manners, View};
use crate::diag::Span;
use crate::ids::BlockId;
use crate::nc::{Program, TokenKind};

/// A cut of a check point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CheckMark {
    /// The block.
    pub block: BlockId,
    /// Number of the check point.
    pub number: u32,
    /// Number of the cut in it.
    pub cycle: u32,
}

/// The program with a comment on a line before each block; in plain language, whose blocks are numbered without gaps, at the end of the block
/// itself. A block without room for a comment gets none. Old marks are removed.
pub fn with_checks(program: &Program, marks: &[CheckMark]) -> Vec<u8> {
    let text = program.text();
    let Some(part) = program.parts().find(|part| part.name.is_none()) else { return text.to_vec() };
    let form = Manners::of(program, &part).comment;
    let line_end: &[u8] = if memchr::memmem::find(text, b"\r\n").is_some() { b"\r\n" } else { b"\n" };
    let mut edits: Vec<Edit> = old(program).into_iter().map(|span| Edit::replace(span, *b"")).collect();
    for mark in marks {
        let comment = form.write(&mark::check_text(mark.number, mark.cycle)).into_bytes();
        if program.dialect().properties().counts_blocks {
            let view = View::of(program, mark.block);
            if view.user_comment_at.is_none() && view.ours.is_empty() {
                edits.push(Edit::insert(view.line_end, [b" ".as_slice(), &comment].concat()));
            }
        } else {
            edits.push(Edit::insert(program.span(mark.block).start, [&comment, line_end].concat()));
        }
    }
    edit::apply(Span { start: 0, end: text.len() as u32 }, text, edits)
}

/// Old marks, with their line where nothing else stands on it.
fn old(program: &Program) -> Vec<Span> {
    let spans = found(program).map(|(block, span, ..)| {
        let others = program
            .tokens(block)
            .any(|token| token.span != span && !matches!(token.kind, TokenKind::Blank | TokenKind::LineEnd));
        if others { mark::with_blank_before(program.text(), span) } else { program.span(block) }
    });
    spans.collect()
}

fn found(program: &Program) -> impl Iterator<Item = (BlockId, Span, u32, u32)> {
    program.blocks().flat_map(|block| {
        let comments = program.tokens(block).filter(|token| token.kind == TokenKind::Comment);
        let checks = comments.filter_map(|token| match mark::read(token.span.of(program.text())) {
            Some(Ours::Check { number, cycle }) => Some((block, token.span, number, cycle)),
            _ => None,
        });
        checks.collect::<Vec<_>>()
    })
}

/// The marks of a program, each with the next block that moves the tool (in plain language its own).
pub fn checks(program: &Program) -> Vec<CheckMark> {
    let moves = |block: &BlockId| [b'X', b'Y', b'Z'].iter().any(|axis| View::of(program, *block).has(*axis));
    let mark = |(block, _, number, cycle): (BlockId, Span, u32, u32)| {
        let block = (block.0..program.len() as u32).map(BlockId).find(moves)?;
        Some(CheckMark { block, number, cycle })
    };
    found(program).filter_map(mark).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nc::{Dialect, parse};

    #[test]
    fn marks_are_put_in_found_again_and_replaced() {
        let text = b"G1 X1 F100\r\nX2\r\n(MINE)\r\nX3\r\n".to_vec();
        let program = parse(text.clone(), Some(Dialect::Generic));
        let mark = |block, number, cycle| CheckMark { block: BlockId(block), number, cycle };
        let marked = parse(with_checks(&program, &[mark(1, 1, 1), mark(3, 2, 1)]), Some(Dialect::Generic));
        let expected = "G1 X1 F100\r\n(FW CHECK 1 CYCLE 1)\r\nX2\r\n(MINE)\r\n(FW CHECK 2 CYCLE 1)\r\nX3\r\n";
        assert_eq!(String::from_utf8(marked.text().to_vec()).unwrap(), expected);
        assert_eq!(checks(&marked), [mark(2, 1, 1), mark(5, 2, 1)]);
        assert_eq!(with_checks(&marked, &[]), text);
        assert_eq!(mark::strip(&marked), text);
    }

    #[test]
    fn in_plain_language_the_mark_stands_behind_its_block() {
        let text = b"0 BEGIN PGM A MM\n1 L X+1 Y+0 F100\n2 L X+2\n3 END PGM A MM\n".to_vec();
        let program = parse(text.clone(), Some(Dialect::Heidenhain));
        let marked = with_checks(&program, &[CheckMark { block: BlockId(2), number: 1, cycle: 2 }]);
        let marked = parse(marked, Some(Dialect::Heidenhain));
        assert!(String::from_utf8_lossy(marked.text()).contains("2 L X+2 ; FW CHECK 1 CYCLE 2\n"));
        assert_eq!(checks(&marked), [CheckMark { block: BlockId(2), number: 1, cycle: 2 }]);
        assert_eq!(mark::strip(&marked), text);
    }
}
