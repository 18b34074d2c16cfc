//! One line of text as the proof reads it, written apart from how the writer reads it. In: the tokens of a line. Out: its plain words,
//! what they switch, and whether it may send the control to a numbered block.

use rayon::prelude::*;

use crate::diag::Span;
use crate::ids::BlockId;
use crate::nc::{self, Part, Program, Syntax, Token, TokenKind};

use super::comment;

/// The number that follows a word's letter.
pub fn number_of(word: &[u8]) -> &[u8] {
    let at = word.iter().position(|byte| byte.is_ascii_digit() || b".+-".contains(byte));
    at.map_or(&[], |at| &word[at..])
}

/// Is the token a comment that a rewriting may leave?
pub fn is_ours(program: &Program, token: &Token) -> bool {
    token.kind == TokenKind::Comment && comment::is_ours(token.span.of(program.text()))
}

/// A token with the blank before it, if there is one.
pub fn with_blank(text: &[u8], span: Span) -> Span {
    let blank = span.start.checked_sub(1).is_some_and(|before| text[before as usize] == b' ');
    Span { start: span.start - u32::from(blank), end: span.end }
}

/// The words of a line of nothing but plain words, F, blanks, comments and block-delete signs; `None`: another line.
pub fn plain_words(program: &Program, block: BlockId) -> Option<Vec<Token>> {
    let mut words = Vec::new();
    for token in program.tokens(block) {
        match token.kind {
            TokenKind::Word(_) => words.push(token),
            TokenKind::Blank
            | TokenKind::LineEnd
            | TokenKind::Comment
            | TokenKind::Delete
            | TokenKind::Computed(b'F') => {}
            _ => return None,
        }
    }
    Some(words)
}

/// Is it the letter of this word?
pub fn is(token: &Token, letter: u8) -> bool {
    token.kind == TokenKind::Word(letter)
}

/// Modes of coordinates that words set in the order of the text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Modes {
    /// Lengths in inches.
    pub inch: bool,
    /// G91.
    pub incremental: bool,
}

/// G codes that set one of the modes, in tenths.
const SETTING: [u32; 8] = [200, 210, 700, 710, 7000, 7100, 900, 910];

fn g_codes(program: &Program, block: BlockId) -> impl Iterator<Item = u32> {
    program.tokens(block).filter(|token| is(token, b'G')).map(|token| (token.number * 10.0).round() as u32)
}

/// Does the line set one of the modes?
pub fn sets_modes(program: &Program, block: BlockId) -> bool {
    g_codes(program, block).any(|code| SETTING.contains(&code))
}

impl Modes {
    /// The modes from this line on.
    pub fn after(mut self, program: &Program, block: BlockId) -> Self {
        for code in g_codes(program, block) {
            match code {
                200 | 700 | 7000 => self.inch = true,
                210 | 710 | 7100 => self.inch = false,
                900 | 910 => self.incremental = code == 910,
                _ => {}
            }
        }
        self
    }
}

/// May a line of this part send the control to a numbered block? A name that is no setting, a label, `M96 P` (on a signal), `M97 P`, `M99 P`,
/// or a call (`M98`, `G65`, `G66`) of what may return so; of plain language the first word of a line, unless it moves or prepares a tool.
pub fn jumps(program: &Program, part: &Part<'_>) -> bool {
    part.blocks.clone().into_par_iter().any(|block| {
        let words = || program.tokens(BlockId(block));
        let back = |token: &Token| {
            is(token, b'M') && [96.0, 97.0, 98.0, 99.0].contains(&token.number)
                || is(token, b'G') && [65.0, 66.0, 66.1].contains(&token.number)
        };
        words().any(|token| back(&token)) && words().any(|token| is(&token, b'P')) || names_a_place(program, words())
    })
}

fn names_a_place(program: &Program, words: impl Iterator<Item = Token>) -> bool {
    const MOVES: [&[u8]; 16] = [
        b"L", b"C", b"CC", b"CR", b"CT", b"LP", b"CP", b"RND", b"CHF", b"TOOL", b"STOP", b"BLK", b"BEGIN", b"END",
        b"FMAX", b"F",
    ];
    let mut names = words.filter(|token| matches!(token.kind, TokenKind::Name | TokenKind::Label));
    let text = |token: &Token| token.span.of(program.text());
    match program.dialect().syntax() {
        Syntax::Heidenhain => {
            names.next().is_some_and(|first| !MOVES.iter().any(|word| word.eq_ignore_ascii_case(text(&first))))
        }
        Syntax::Siemens => names.any(|name| name.kind == TokenKind::Label || !nc::is_setting(text(&name))),
        Syntax::Rs274 => names.next().is_some(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_follow_their_words() {
        let program = nc::parse(b"G20 G91\nG1 X1\nG90 G21\n".to_vec(), Some(nc::Dialect::Generic));
        let modes = Modes { inch: false, incremental: false };
        let set = modes.after(&program, BlockId(0));
        assert_eq!(set, Modes { inch: true, incremental: true });
        assert!(set.after(&program, BlockId(1)) == set && !sets_modes(&program, BlockId(1)));
        assert_eq!(set.after(&program, BlockId(2)), modes);
    }
}
