//! Lexer of Heidenhain plain language. In: the bytes of a line and a position. Out: the token there; tokens tile the line.
//!
//! A leading number is the block number (a word N); `X+10`, `IX-5`, `F500` are words, `X+Q1`, `FQ1` computed ones, `Q1 = expr`
//! an assignment, everything else made of letters a name. `;` begins a comment, `~` at the end continues the block. What
//! follows `BEGIN PGM` and `END PGM` is a name, whatever it looks like; a line that continues a comment (`; text ~`) is text.

use crate::diag::Span;
use crate::nc::number::decimal;
use crate::nc::rs274::lex::{self, blanks, length_of, to_line_end};
use crate::nc::token::{Token, TokenKind};

/// The token of `line` at `at`; `base` is where the line begins in the text.
pub(crate) fn token(line: &[u8], at: usize, base: u32, first: bool) -> Token {
    let rest = &line[at..];
    if at >= program_name(line) && !rest[0].is_ascii_whitespace() && rest[0] != b';' {
        let length = rest.iter().take_while(|byte| !byte.is_ascii_whitespace() && **byte != b';').count();
        let start = base + at as u32;
        return Token { kind: TokenKind::Name, span: Span { start, end: start + length as u32 }, number: 0.0 };
    }
    let (kind, length, number) = scan(rest, first);
    if kind == TokenKind::Bad && matches!(rest[0], b' ' | b'\t' | b'\n' | b'\r' | b';') {
        return lex::token(line, at, base, false);
    }
    let start = base + at as u32;
    Token { kind, span: Span { start, end: start + length.max(1) as u32 }, number }
}

/// Is this line nothing but a comment?
pub(crate) fn is_comment(line: &[u8]) -> bool {
    let begin = line.iter().take_while(|byte| byte.is_ascii_digit() || is_blank(**byte)).count();
    matches!(line.get(begin), Some(b';' | b'*'))
}

/// Where the name of a program begins: behind `BEGIN PGM` and `END PGM`, whose name may look like words (`END PGM X10 MM`).
fn program_name(line: &[u8]) -> usize {
    let begin = line.iter().take_while(|byte| byte.is_ascii_digit() || is_blank(**byte)).count();
    let is = |at: usize, word: &[u8]| line.get(at..at + word.len()).is_some_and(|own| own.eq_ignore_ascii_case(word));
    let blanks = |at: usize| line.get(at..).map_or(0, |rest| rest.iter().take_while(|byte| is_blank(**byte)).count());
    let word = [&b"BEGIN"[..], b"END"].into_iter().find(|word| is(begin, word));
    let Some(second) = word.map(|word| begin + word.len() + blanks(begin + word.len())) else { return usize::MAX };
    if is(second, b"PGM") { second + 3 } else { usize::MAX }
}

fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t')
}

fn scan(rest: &[u8], first: bool) -> (TokenKind, usize, f64) {
    let letter = rest[0].to_ascii_uppercase();
    match letter {
        b'*' => (TokenKind::Comment, length_of(to_line_end, rest), 0.0),
        b'~' | b':' => (TokenKind::Blank, 1, 0.0),
        b'/' if first => (TokenKind::Delete, 1, 0.0),
        b'/' => (TokenKind::Name, 1, 0.0),
        b'"' => {
            let end =
                rest[1..].iter().position(|byte| matches!(byte, b'"' | b'\n' | b'\r')).map_or(rest.len(), |e| e + 1);
            (TokenKind::Expression, end + usize::from(rest.get(end) == Some(&b'"')), 0.0)
        }
        b'0'..=b'9' | b'+' | b'-' | b'.' | b'Q' if parameter(rest) > 0 && assignment(rest) == 0 => {
            (TokenKind::Expression, parameter(rest), 0.0)
        }
        b'0'..=b'9' | b'+' | b'-' | b'.' => match decimal(rest) {
            Some((number, length)) if first => (TokenKind::Word(b'N'), length, number),
            Some((number, length)) => (TokenKind::Expression, length, number),
            None => (TokenKind::Bad, 1 + rest[1..].iter().take_while(|byte| byte.is_ascii_digit()).count(), 0.0),
        },
        b'A'..=b'Z' => word(rest, letter),
        _ => (TokenKind::Bad, 1, 0.0),
    }
}

fn word(rest: &[u8], letter: u8) -> (TokenKind, usize, f64) {
    if letter == b'Q'
        && let length @ 1.. = assignment(rest)
    {
        return (TokenKind::Assignment, length, 0.0);
    }
    let letters = rest.iter().take_while(|byte| byte.is_ascii_alphabetic()).count();
    let incremental = letters == 2 && letter == b'I';
    let after = &rest[letters..];
    if let length @ 1.. = parameter(&rest[1..])
        && !matches!(letter, b'L' | b'Q')
    {
        return (TokenKind::Computed(letter), 1 + length, 0.0);
    }
    if letters == 1 || incremental {
        if let Some((number, length)) = decimal(after) {
            return (TokenKind::Word(if incremental { rest[1] | 0x80 } else { letter }), letters + length, number);
        }
        if let length @ 1.. = parameter(after) {
            let kind = TokenKind::Computed(if incremental { rest[1] | 0x80 } else { letter });
            return (kind, letters + length, 0.0);
        }
        if b"XYZABCUVW".contains(&if incremental { rest[1].to_ascii_uppercase() } else { letter })
            && let Some((kind, number, length)) = apart(after)
        {
            let axis = if incremental { rest[1] | 0x80 } else { letter };
            let kind = if kind { TokenKind::Word(axis) } else { TokenKind::Computed(axis) };
            return (kind, letters + length, number);
        }
        let number =
            after.iter().take_while(|byte| byte.is_ascii_digit() || matches!(byte, b'+' | b'-' | b'.')).count();
        if number > 0 {
            return (TokenKind::Bad, letters + number, 0.0);
        }
    }
    let signed = rest[..letters].eq_ignore_ascii_case(b"DR")
        && matches!(after.first(), Some(b'+' | b'-'))
        && !after.get(1).is_some_and(u8::is_ascii_digit);
    (TokenKind::Name, letters + usize::from(signed), 0.0)
}

/// `+ 5`, ` - Q13` behind the letter of an axis: whether it is a plain number, its value, and its length.
fn apart(after: &[u8]) -> Option<(bool, f64, usize)> {
    let blank = length_of(blanks, after);
    let sign = *after.get(blank).filter(|byte| matches!(byte, b'+' | b'-'))?;
    let gap = length_of(blanks, &after[blank + 1..]);
    let rest = &after[blank + 1 + gap..];
    if rest.first().is_some_and(|byte| byte.eq_ignore_ascii_case(&b'Q')) {
        let length = parameter(rest);
        return (length > 0).then_some((false, 0.0, blank + 1 + gap + length));
    }
    let (number, length) = decimal(rest).filter(|_| !matches!(rest.first(), Some(b'+' | b'-')))?;
    Some((true, if sign == b'-' { -number } else { number }, blank + 1 + gap + length))
}

/// Length of `Q1`, `+Q1`, `-QL5`; 0 when it is none.
fn parameter(rest: &[u8]) -> usize {
    let sign = usize::from(matches!(rest.first(), Some(b'+' | b'-')));
    if !rest.get(sign).is_some_and(|byte| byte.eq_ignore_ascii_case(&b'Q')) {
        return 0;
    }
    let kind = usize::from(rest.get(sign + 1).is_some_and(|byte| matches!(byte.to_ascii_uppercase(), b'L' | b'R')));
    let digits = rest[sign + 1 + kind..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    if digits == 0 { 0 } else { sign + 1 + kind + digits }
}

/// Length of `Q1 = …` up to a comment or the line end; 0 when it is none.
fn assignment(rest: &[u8]) -> usize {
    let name = parameter(rest);
    let gap = length_of(blanks, &rest[name..]);
    if name == 0 || rest.get(name + gap) != Some(&b'=') {
        return 0;
    }
    let end = rest.iter().position(|byte| matches!(byte, b';' | b'~' | b'\n' | b'\r')).unwrap_or(rest.len());
    rest[..end].iter().rposition(|byte| !byte.is_ascii_whitespace()).map_or(0, |last| last + 1)
}
