//! Lexer of Siemens 840D text. In: the bytes of a line and a position. Out: the token there; tokens tile the line.
//!
//! `X57.` is a word, and so is `F=800`; `X=expr` is a computed one, `R1=expr`, `CR=expr`, `NAME=expr` are assignments, `NAME(…)` a call,
//! `NAME:` a label, other names stand alone. `;` begins a comment; so does a parenthesis that follows no name.

use crate::diag::Span;
use crate::nc::number::decimal;
use crate::nc::rs274::lex::{self, blanks, length_of};
use crate::nc::token::{Token, TokenKind};

/// The token of `line` at `at`; `base` is where the line begins in the text.
pub(crate) fn token(line: &[u8], at: usize, base: u32, first: bool) -> Token {
    let rest = &line[at..];
    let letter = rest[0];
    if !letter.is_ascii_alphabetic() && !matches!(letter, b'_' | b'$') {
        return match letter {
            b'#' | b'[' | b':' => bad(rest, at, base),
            b'"' => made(TokenKind::Comment, string(rest), 0.0, at, base),
            _ => lex::token(line, at, base, first),
        };
    }
    let name = rest.iter().take_while(|&&byte| is_name(byte)).count();
    let gap = length_of(blanks, &rest[name..]);
    let after = &rest[name + gap..];
    if after.first() == Some(&b'=') && after.get(1) != Some(&b'=') {
        let value = &after[1..][..expression(&after[1..])];
        let length = name + gap + 1 + value.len();
        // A feed by a plain number is a word like F800, whose number can be written anew.
        if name == 1
            && letter.eq_ignore_ascii_case(&b'F')
            && let Some((number, digits)) = decimal(value.trim_ascii_start())
            && digits == value.trim_ascii_start().len()
        {
            return made(TokenKind::Word(b'F'), length, number, at, base);
        }
        let kind = if name == 1 { TokenKind::Computed(letter.to_ascii_uppercase()) } else { TokenKind::Assignment };
        return made(kind, length, 0.0, at, base);
    }
    if after.first() == Some(&b':') && after.get(1) != Some(&b'=') && name > 1 {
        return made(TokenKind::Label, name + gap + 1, 0.0, at, base);
    }
    let named = name > 1 && (rest[1].is_ascii_alphabetic() || rest[1] == b'_');
    if named && rest.get(name) == Some(&b'(') {
        return made(TokenKind::Call, name + group(&rest[name..]), 0.0, at, base);
    }
    if !named && let Some((number, length)) = decimal(&rest[1..]) {
        return made(TokenKind::Word(letter.to_ascii_uppercase()), 1 + length, number, at, base);
    }
    if name > 1 {
        return made(TokenKind::Name, name, 0.0, at, base);
    }
    bad(rest, at, base)
}

fn made(kind: TokenKind, length: usize, number: f64, at: usize, base: u32) -> Token {
    let start = base + at as u32;
    Token { kind, span: Span { start, end: start + length.max(1) as u32 }, number }
}

fn bad(rest: &[u8], at: usize, base: u32) -> Token {
    let length = rest.iter().take_while(|byte| !byte.is_ascii_alphanumeric() && !byte.is_ascii_whitespace()).count();
    made(TokenKind::Bad, length, 0.0, at, base)
}

fn is_name(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'$')
}

fn string(rest: &[u8]) -> usize {
    let end = rest[1..].iter().position(|byte| matches!(byte, b'"' | b'\n' | b'\r'));
    end.map_or(rest.len(), |end| if rest[1 + end] == b'"' { end + 2 } else { end + 1 })
}

/// Length of `( … )` with what is nested in it; up to the line end when it is never closed.
fn group(rest: &[u8]) -> usize {
    let (mut depth, mut at) = (0_u32, 0);
    while at < rest.len() {
        match rest[at] {
            b'(' | b'[' => depth += 1,
            b')' | b']' if depth <= 1 => return at + 1,
            b')' | b']' => depth -= 1,
            b'"' => at += string(&rest[at..]) - 1,
            b'\n' | b'\r' => return at,
            _ => {}
        }
        at += 1;
    }
    rest.len()
}

/// Length of an expression: operands joined by operators.
fn expression(rest: &[u8]) -> usize {
    let mut end = 0;
    let mut at = 0;
    loop {
        at += rest[at..].iter().take_while(|byte| matches!(byte, b' ' | b'\t' | b'+' | b'-')).count();
        let operand = operand(&rest[at..]);
        if operand == 0 {
            return end;
        }
        at += operand;
        end = at;
        at += rest[at..].iter().take_while(|byte| matches!(byte, b' ' | b'\t')).count();
        let sign =
            rest[at..].iter().take_while(|byte| matches!(byte, b'+' | b'-' | b'*' | b'/' | b'<' | b'>' | b'=')).count();
        let word = ["DIV", "MOD", "AND", "XOR", "OR"].iter().find(|op| {
            let next = rest.get(at + op.len());
            rest[at..].len() >= op.len()
                && rest[at..at + op.len()].eq_ignore_ascii_case(op.as_bytes())
                && !next.is_some_and(|&byte| is_name(byte))
        });
        match (sign, word) {
            (0, None) => return end,
            (0, Some(word)) => at += word.len(),
            (length, _) => at += length,
        }
    }
}

fn operand(rest: &[u8]) -> usize {
    match rest.first() {
        Some(b'"') => string(rest),
        Some(b'(') => group(rest),
        Some(byte) if byte.is_ascii_digit() || *byte == b'.' => decimal(rest).map_or(0, |(_, length)| length),
        Some(&byte) if is_name(byte) => {
            let name = rest.iter().take_while(|&&byte| is_name(byte)).count();
            let bracket = matches!(rest.get(name), Some(b'(' | b'['));
            name + if bracket { group(&rest[name..]) } else { 0 }
        }
        _ => 0,
    }
}
