//! Lexer of the RS274 family (generic ISO, Fanuc, Haas, LinuxCNC, GRBL). In: the bytes of a program and a position. Out:
//! the token there. Tokens tile the bytes; whatever cannot be read becomes [`TokenKind::Bad`]. A token never crosses the
//! end of a line.

use nom::branch::alt;
use nom::bytes::complete::{take, take_till, take_while, take_while_m_n, take_while1};
use nom::character::complete::char as byte;
use nom::combinator::{opt, recognize, verify};
use nom::error::Error;
use nom::sequence::preceded;
use nom::{IResult, Parser};

use crate::diag::Span;
use crate::nc::number::decimal;
use crate::nc::token::{Token, TokenKind};

/// How far past the first `)` a nested comment is looked for, bytes.
const NESTED_COMMENT: usize = 256;

type Input<'a> = &'a [u8];

/// The token of `line` (the bytes of one line, its end included) at `at`; `base` is where the line begins in the text.
#[inline]
pub(crate) fn token(line: &[u8], at: usize, base: u32, first: bool) -> Token {
    let rest = &line[at..];
    // Nearly every token is a letter with a number right behind it, or one blank.
    let letter = rest[0] & !0x20;
    let (kind, length, number) = if letter.is_ascii_uppercase()
        && let Some((number, length)) = decimal(&rest[1..])
    {
        (TokenKind::Word(letter), 1 + length, number)
    } else {
        scan(rest, first)
    };
    let start = base + at as u32;
    Token { kind, span: Span { start, end: start + length.max(1) as u32 }, number }
}

#[inline(never)]
fn scan(rest: Input<'_>, first: bool) -> (TokenKind, usize, f64) {
    match rest[0] {
        b' ' | b'\t' => (TokenKind::Blank, length_of(blanks, rest), 0.0),
        b'\n' => (TokenKind::LineEnd, 1, 0.0),
        b'\r' => (TokenKind::LineEnd, if rest.get(1) == Some(&b'\n') { 2 } else { 1 }, 0.0),
        b'(' => match balanced(rest) {
            Some(length) => (TokenKind::Comment, length, 0.0),
            None => (TokenKind::OpenComment, length_of(to_line_end, rest), 0.0),
        },
        b';' => (TokenKind::Comment, length_of(to_line_end, rest), 0.0),
        b'%' => (TokenKind::Percent, length_of(to_line_end, rest), 0.0),
        b'/' if first => {
            let length = length_of(delete, rest);
            let number = rest.get(1).filter(|_| length == 2).map_or(0.0, |digit| f64::from(digit - b'0'));
            (TokenKind::Delete, length, number)
        }
        b'#' => match length_of(assignment, rest) {
            0 => primary_or_bad(rest),
            length => (TokenKind::Assignment, length, 0.0),
        },
        b'[' | b'0'..=b'9' | b'+' | b'-' | b'.' => primary_or_bad(rest),
        b':' if first => colon_number(rest),
        b',' => corner(rest),
        letter if letter.is_ascii_alphabetic() => word(rest, letter.to_ascii_uppercase()),
        _ => (TokenKind::Bad, length_of(bad, rest), 0.0),
    }
}

/// `,R5.`, `,C2.`
fn corner(rest: Input<'_>) -> (TokenKind, usize, f64) {
    let blank = 1 + rest[1..].iter().take_while(|byte| matches!(byte, b' ' | b'\t')).count();
    let letter = rest.get(blank).map(u8::to_ascii_uppercase).filter(|letter| matches!(letter, b'R' | b'C'));
    match letter.zip(rest.get(blank + 1..).and_then(decimal)) {
        Some((letter, (number, length))) => (TokenKind::Corner(letter), blank + 1 + length, number),
        None => (TokenKind::Bad, length_of(bad, rest), 0.0),
    }
}

fn word(rest: Input<'_>, letter: u8) -> (TokenKind, usize, f64) {
    let blank = rest[1..].iter().take_while(|byte| matches!(byte, b' ' | b'\t')).count();
    let after = &rest[1 + blank..];
    if let Some((number, length)) = decimal(after) {
        return (TokenKind::Word(letter), 1 + blank + length, number);
    }
    if let Some((number, length)) = spaced_sign(after) {
        return (TokenKind::Word(letter), 1 + blank + length, number);
    }
    if letter == b'O'
        && let length @ 1.. = length_of(alt((angle_name, brackets, parameter)), after)
    {
        return (TokenKind::Routine, 1 + blank + length, 0.0);
    }
    let name = rest.iter().take_while(|byte| byte.is_ascii_alphabetic()).count();
    if name > 1 {
        let function = length_of(term, after);
        if function > 0 && is_function(&rest[1..name]) {
            return (TokenKind::Computed(letter), 1 + blank + function, 0.0);
        }
        return (TokenKind::Name, name, 0.0);
    }
    match length_of(term, after) {
        0 => (TokenKind::Bad, 1, 0.0),
        length => (TokenKind::Computed(letter), 1 + blank + length, 0.0),
    }
}

/// A sign set apart from its number, as some engravers write it: `Z - 0.5`.
fn spaced_sign(after: Input<'_>) -> Option<(f64, usize)> {
    let sign = *after.first().filter(|byte| matches!(byte, b'+' | b'-'))?;
    let blank = after[1..].iter().take_while(|byte| matches!(byte, b' ' | b'\t')).count();
    let digits =
        after.get(1 + blank..).filter(|rest| rest.first().is_some_and(|b| b.is_ascii_digit() || *b == b'.'))?;
    let (number, length) = decimal(digits)?;
    Some((if sign == b'-' { -number } else { number }, 1 + blank + length))
}

fn is_function(name: &[u8]) -> bool {
    const FUNCTIONS: [&[u8]; 14] = [
        b"ABS", b"ACOS", b"ASIN", b"ATAN", b"COS", b"EXP", b"FIX", b"FUP", b"LN", b"ROUND", b"SIN", b"SQRT", b"TAN",
        b"EXISTS",
    ];
    FUNCTIONS.iter().any(|function| function.eq_ignore_ascii_case(name))
}

/// `:0097`, the way some controls write a program number.
fn colon_number(rest: Input<'_>) -> (TokenKind, usize, f64) {
    match decimal(&rest[1..]) {
        Some((number, length)) => (TokenKind::Word(b'O'), 1 + length, number),
        None => (TokenKind::Bad, 1, 0.0),
    }
}

fn primary_or_bad(rest: Input<'_>) -> (TokenKind, usize, f64) {
    match length_of(alt((recognize(term), digits)), rest) {
        0 if rest[0] == b'[' => (TokenKind::Bad, length_of(to_line_end, rest), 0.0),
        0 => (TokenKind::Bad, length_of(bad, rest), 0.0),
        length => (TokenKind::Expression, length, 0.0),
    }
}

/// Length of a comment that begins here: up to the parenthesis that closes it, else up to the first one.
fn balanced(rest: Input<'_>) -> Option<usize> {
    let (mut depth, mut first) = (0_u32, None);
    for (at, &c) in rest.iter().enumerate() {
        match c {
            b'(' => depth += 1,
            _ if first.is_some_and(|end| at > end + NESTED_COMMENT) => break,
            b')' => {
                first = first.or(Some(at + 1));
                depth -= 1;
                if depth == 0 {
                    return Some(at + 1);
                }
            }
            b'\n' | b'\r' => break,
            _ => {}
        }
    }
    first
}

/// Bytes that `parser` takes from the start of `input`; 0 when it does not match.
pub(crate) fn length_of<'a, O>(
    mut parser: impl Parser<Input<'a>, Output = O, Error = Error<Input<'a>>>,
    input: Input<'a>,
) -> usize {
    parser.parse(input).map_or(0, |(rest, _)| input.len() - rest.len())
}

fn is_blank(c: u8) -> bool {
    matches!(c, b' ' | b'\t')
}

pub(crate) fn blanks(i: Input<'_>) -> IResult<Input<'_>, Input<'_>> {
    take_while(is_blank)(i)
}

pub(crate) fn to_line_end(i: Input<'_>) -> IResult<Input<'_>, Input<'_>> {
    take_till(|c| matches!(c, b'\n' | b'\r'))(i)
}

fn delete(i: Input<'_>) -> IResult<Input<'_>, Input<'_>> {
    recognize((byte('/'), opt(verify(take(1_usize), |d: &[u8]| matches!(d, [b'1'..=b'9']))))).parse(i)
}

fn bad(i: Input<'_>) -> IResult<Input<'_>, Input<'_>> {
    let plain =
        |c: u8| !c.is_ascii_alphabetic() && !matches!(c, b' ' | b'\t' | b'\n' | b'\r' | b'(' | b';' | b'#' | b'[');
    alt((take_while1(plain), take(1_usize))).parse(i)
}

fn digits(i: Input<'_>) -> IResult<Input<'_>, Input<'_>> {
    match decimal(i) {
        Some((_, length)) => take(length)(i),
        None => Err(nom::Err::Error(Error::new(i, nom::error::ErrorKind::Digit))),
    }
}

fn angle_name(i: Input<'_>) -> IResult<Input<'_>, Input<'_>> {
    recognize((byte('<'), take_till(|c| matches!(c, b'>' | b'\n' | b'\r')), byte('>'))).parse(i)
}

/// `[ … ]` with its brackets in balance, counted, so that depth costs nothing.
fn brackets(i: Input<'_>) -> IResult<Input<'_>, Input<'_>> {
    let mut depth = 0_u32;
    for (at, &c) in i.iter().enumerate() {
        match c {
            b'[' => depth += 1,
            b']' if depth == 1 => return take(at + 1)(i),
            b']' => depth = depth.saturating_sub(1),
            b'\n' | b'\r' => break,
            _ => {}
        }
        if depth == 0 {
            break;
        }
    }
    Err(nom::Err::Error(Error::new(i, nom::error::ErrorKind::Char)))
}

/// `#12`, `#<name>`, `#[…]`, `##12`.
fn parameter(i: Input<'_>) -> IResult<Input<'_>, Input<'_>> {
    let hashes = take_while_m_n(1, 8, |c| c == b'#' || is_blank(c));
    recognize((verify(hashes, |h: &[u8]| h[0] == b'#'), alt((angle_name, brackets, digits)))).parse(i)
}

/// One operand: signs, then a number, a parameter, brackets, or a function of brackets (`ATAN[1]/[2]` too).
fn term(i: Input<'_>) -> IResult<Input<'_>, Input<'_>> {
    let signs = take_while_m_n(0, 8, |c| matches!(c, b'+' | b'-' | b' ' | b'\t'));
    let letters = take_while1(|c: u8| c.is_ascii_alphabetic());
    let second = preceded((blanks, byte('/'), blanks), brackets);
    let function = recognize((letters, blanks, brackets, opt(second)));
    recognize((signs, alt((parameter, brackets, function)))).parse(i)
}

/// `#… = operand operator operand …`, as far as it reads as an expression.
fn assignment(i: Input<'_>) -> IResult<Input<'_>, Input<'_>> {
    let operand = || recognize((blanks, alt((term, digits))));
    let (mut rest, _) = (parameter, blanks, byte('='), operand()).parse(i)?;
    while let Ok((more, _)) = (blanks, operator, operand()).parse(rest) {
        rest = more;
    }
    take(i.len() - rest.len())(i)
}

fn operator(i: Input<'_>) -> IResult<Input<'_>, Input<'_>> {
    let sign = take_while1(|c| matches!(c, b'+' | b'-' | b'*' | b'/'));
    let is_operator = |w: &[u8]| [&b"MOD"[..], b"AND", b"OR", b"XOR"].iter().any(|op| op.eq_ignore_ascii_case(w));
    alt((sign, verify(take_while1(|c: u8| c.is_ascii_alphabetic()), is_operator))).parse(i)
}
