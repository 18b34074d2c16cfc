//! Tokens. In: filled by the lexer of each family of dialects (`rs274/lex.rs`, `siemens/lex.rs`, `heidenhain/lex.rs`). Out: kind, place and, for
//! a plain word, its number; the tokens of a line tile its bytes.

use crate::diag::Span;

/// What a token is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TokenKind {
    /// Spaces and tabs.
    Blank,
    /// `\n`, `\r\n`, or stray `\r`.
    LineEnd,
    /// `( … )` or `;` to the end of the line.
    Comment,
    /// A `(` that is never closed, to the end of the line.
    OpenComment,
    /// `%` and what follows it.
    Percent,
    /// `/` at the start of a block, with its digit.
    Delete,
    /// A letter and a plain number; the letter is in upper case.
    Word(u8),
    /// A letter and a parameter, an expression or a function.
    Computed(u8),
    /// `O` with a name or a computed number: `o<name>`, `o[#1]`.
    Routine,
    /// A word of several letters (IF, WHILE, GOTO, sub, call …).
    Name,
    /// `#… = …`, or another assignment.
    Assignment,
    /// `[…]`, `#…` or a number standing alone.
    Expression,
    /// `NAME( … )`: a call with arguments in parentheses (Siemens).
    Call,
    /// A label with its colon (Siemens).
    Label,
    /// `,R5.` or `,C2.`: the corner behind the block.
    Corner(u8),
    /// Not understood.
    Bad,
}

/// A token: kind, place, and for a [`TokenKind::Word`] its number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Token {
    /// What it is.
    pub kind: TokenKind,
    /// Where it is.
    pub span: Span,
    /// Value of a plain number, as written (no unit); 0 otherwise.
    pub number: f64,
}
