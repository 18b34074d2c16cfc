//! Unrolling of plain language, and the search for flow control. In: a token of a block that is executed. Out: its plain text: labels, calls,
//! jumps and assignments are left out, Q parameters are replaced by their values, blocks are numbered anew.

use super::state::Heidenhain;
use crate::ids::BlockId;
use crate::nc::expr;
use crate::nc::interp::unroll::{Executed, Plain, Record, number};
use crate::nc::interp::values::left_of;
use crate::nc::number::decimal;
use crate::nc::program::Program;
use crate::nc::token::{Token, TokenKind};

/// What only the control knows.
const CONTROLS: &str = "a variable that the control keeps itself";

/// Labels, calls, jumps and assignments of plain language; the head and the end of a called program.
pub(super) fn is_left_out(executed: &Executed<'_, Heidenhain>) -> bool {
    let text = executed.program.text();
    let mut code = executed.program.tokens(executed.block).filter(|token| {
        !matches!(token.kind, TokenKind::Blank | TokenKind::Delete | TokenKind::LineEnd | TokenKind::Word(b'N'))
    });
    match code.next() {
        Some(token) if token.kind == TokenKind::Assignment => !continues(executed.program, executed.block),
        Some(token) if token.kind == TokenKind::Name => {
            let word = token.span.of(text).to_ascii_uppercase();
            let foreign = !executed.main && matches!(word.as_slice(), b"BEGIN" | b"END");
            foreign || matches!(word.as_slice(), b"LBL" | b"CALL" | b"FN")
        }
        _ => false,
    }
}

/// Is it `END PGM`?
pub(super) fn is_end(executed: &Executed<'_, Heidenhain>) -> bool {
    let name = executed.program.tokens(executed.block).find(|token| token.kind == TokenKind::Name);
    name.is_some_and(|name| executed.bytes(&name).eq_ignore_ascii_case(b"END"))
}

/// Q100 to Q199 hold what a Heidenhain control found out by itself, as long as the program does not set them.
pub(super) fn obstacles(executed: &Executed<'_, Heidenhain>, record: &mut Record) {
    let Executed { program, block, main, parameters, .. } = *executed;
    let text = program.line_text(block);
    let code = memchr::memchr(b';', text).unwrap_or(text.len());
    let result = |at: usize| {
        let digits: Vec<u8> = text[at + 1..].iter().copied().take_while(u8::is_ascii_digit).collect();
        let number = String::from_utf8_lossy(&digits).parse().unwrap_or(0);
        (100..200).contains(&number) && !parameters.numbered.contains_key(&number)
    };
    if memchr::memchr2_iter(b'Q', b'q', &text[..code]).any(result) {
        record.note_obstacle(CONTROLS, program, block, main);
    }
}

/// A token of a block in plain text.
pub(super) fn plain(executed: &Executed<'_, Heidenhain>, token: &Token, record: &mut Record) -> Plain {
    let bytes = executed.bytes(token);
    let valued = |value: f64, letter: u8, sign: &[u8]| {
        let text = number(letter, value, executed.dialect());
        let plus: &[u8] = if matches!(sign.first(), Some(b'+' | b'-')) && value >= 0.0 { b"+" } else { b"" };
        [plus, text.as_bytes()].concat()
    };
    match token.kind {
        TokenKind::Word(b'N') => {
            record.numbers += 1;
            Plain::Text((record.numbers - 1).to_string().into_bytes())
        }
        TokenKind::Computed(letter) => {
            let letters = usize::from(letter >= 0x80) + 1;
            let Some(value) = executed.result(token.span) else { return Plain::Unknown("a word without a value") };
            Plain::Text([&bytes[..letters], &valued(value, letter & 0x5f, &bytes[letters..])].concat())
        }
        TokenKind::Expression if bytes.iter().any(|byte| byte.eq_ignore_ascii_case(&b'Q')) && bytes[0] != b'"' => {
            match expr::evaluate(bytes, executed.parameters) {
                Ok(value) => Plain::Text(valued(value, b'X', bytes)),
                Err(_) => Plain::Unknown("a parameter without a value"),
            }
        }
        TokenKind::Assignment if value_of(bytes).is_none() => {
            let (left, index) = (left_of(bytes), left_of(bytes)[1..].parse().unwrap_or(0));
            let value = number(b'X', executed.parameters.number(index), executed.dialect());
            Plain::Text(format!("{left}={value}").into_bytes())
        }
        _ => Plain::Same,
    }
}

/// The line that ends a program of plain language, which is not executed where M30 ends it.
pub(super) fn end_of(program: &Program, number: u32) -> Vec<u8> {
    let ends = |block: &BlockId| {
        let name = program.tokens(*block).find(|token| token.kind == TokenKind::Name);
        name.is_some_and(|name| name.span.of(program.text()).eq_ignore_ascii_case(b"END"))
    };
    let own: Vec<BlockId> = program.blocks().take(program.own_len()).collect();
    let Some(last) = own.into_iter().rev().find(ends) else { return Vec::new() };
    let bytes = program.line_text(last).trim_ascii();
    let bare = unnumbered(bytes);
    let number = if bare.len() < bytes.len() { number.to_string() } else { String::new() };
    [number.as_bytes(), bare, b"\n"].concat()
}

/// A line without its block number.
pub(super) fn unnumbered(line: &[u8]) -> &[u8] {
    &line[line.iter().take_while(|byte| byte.is_ascii_digit()).count()..]
}

/// Is this line of plain language a part of the cycle that is defined on a line before it?
fn continues(program: &Program, block: BlockId) -> bool {
    block.0 > 0 && program.line_text(BlockId(block.0 - 1)).trim_ascii_end().ends_with(b"~")
}

/// Does a block hold loops, jumps, calls or parameters?
pub(super) fn has_flow_control(program: &Program, block: BlockId) -> bool {
    let text = program.text();
    let parameter = |bytes: &[u8]| memchr::memchr2(b'Q', b'q', bytes).is_some() && !bytes.starts_with(b"\"");
    let continued = continues(program, block);
    let mut first = true;
    program.tokens(block).any(|token| {
        let bytes = token.span.of(text);
        match token.kind {
            TokenKind::Computed(_) => true,
            TokenKind::Expression => parameter(bytes),
            TokenKind::Assignment => !continued || value_of(bytes).is_none(),
            TokenKind::Name => {
                let calls = [&b"CALL"[..], b"FN"].iter().any(|word| word.eq_ignore_ascii_case(bytes));
                std::mem::take(&mut first) && calls
            }
            _ => false,
        }
    })
}

/// The plain number behind the `=`, if that is all there is.
fn value_of(assignment: &[u8]) -> Option<f64> {
    let equals = assignment.iter().position(|&byte| byte == b'=')?;
    let right = assignment[equals + 1..].trim_ascii();
    decimal(right).filter(|(_, length)| *length == right.len()).map(|(value, _)| value)
}
