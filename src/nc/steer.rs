//! Does a program steer its own flow? In: its text, and the surroundings that hold its subprograms. Out: whether it has
//! loops, jumps, calls, variables or expressions, so that unrolling it would change it.

use super::dialect::Syntax;
use super::environment::Environment;
use super::interp::{is_setting, is_variable, routine_exists};
use super::lex::{Token, TokenKind};
use super::number::decimal;
use super::program::Program;
use crate::ids::BlockId;

/// Does the program hold loops, jumps, calls, variables or expressions?
pub fn steers(program: &Program, environment: &Environment<'_>) -> bool {
    let in_rs274 = |token: Token| match token.kind {
        TokenKind::Word(b'M') => [97.0, 98.0].contains(&token.number),
        TokenKind::Word(b'G') => [65.0, 66.0].contains(&token.number),
        TokenKind::Name | TokenKind::Routine | TokenKind::Assignment | TokenKind::Computed(_) => true,
        _ => false,
    };
    match program.dialect().syntax() {
        Syntax::Rs274 => program.blocks().any(|block| program.tokens(block).any(in_rs274)),
        Syntax::Siemens => Siemens { program, environment, calls: Vec::new() }.steers(),
        Syntax::Heidenhain => program.blocks().any(|block| heidenhain(program, block)),
    }
}

/// Is this line of plain language a part of the cycle that is defined on a line before it?
pub(super) fn continues(program: &Program, block: BlockId) -> bool {
    block.0 > 0 && program.line_text(BlockId(block.0 - 1)).trim_ascii_end().ends_with(b"~")
}

fn heidenhain(program: &Program, block: BlockId) -> bool {
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
pub(super) fn value_of(assignment: &[u8]) -> Option<f64> {
    let equals = assignment.iter().position(|&byte| byte == b'=')?;
    let right = assignment[equals + 1..].trim_ascii();
    decimal(right).filter(|(_, length)| *length == right.len()).map(|(value, _)| value)
}

struct Siemens<'a> {
    program: &'a Program,
    environment: &'a Environment<'a>,
    /// Names that were looked up, and whether there is such a subprogram.
    calls: Vec<(String, bool)>,
}

/// Words of the flow; a name behind one of them is a label.
const FLOW: [&str; 23] = [
    "IF", "ELSE", "ENDIF", "FOR", "TO", "ENDFOR", "WHILE", "ENDWHILE", "LOOP", "ENDLOOP", "REPEAT", "REPEATB", "UNTIL",
    "GOTO", "GOTOF", "GOTOB", "GOTOC", "GOTOS", "CASE", "DEF", "PROC", "RET", "EXTERN",
];

impl Siemens<'_> {
    fn steers(&mut self) -> bool {
        let program = self.program;
        program.blocks().any(|block| program.tokens(block).any(|token| self.token(token)))
    }

    fn token(&mut self, token: Token) -> bool {
        let bytes = token.span.of(self.program.text());
        match token.kind {
            TokenKind::Computed(_) => !is_plain(bytes),
            TokenKind::Assignment => is_variable(bytes) || !is_plain(bytes),
            TokenKind::Word(b'L') => self.calls(&format!("L{}", token.number)),
            TokenKind::Call => {
                let open = bytes.iter().position(|&byte| byte == b'(').unwrap_or(bytes.len());
                let name = String::from_utf8_lossy(&bytes[..open]).to_ascii_uppercase();
                let inner = bytes.get(open + 1..bytes.len().saturating_sub(1)).unwrap_or_default();
                FLOW.contains(&name.as_str())
                    || name != "MSG" && inner.split(|&byte| byte == b',').any(|part| !is_literal(part.trim_ascii()))
                    || self.calls(&name)
            }
            TokenKind::Name => {
                let name = String::from_utf8_lossy(bytes).to_ascii_uppercase();
                FLOW.contains(&name.as_str()) || name != "MCALL" && !is_setting(bytes) && self.calls(&name)
            }
            _ => false,
        }
    }

    fn calls(&mut self, name: &str) -> bool {
        if let Some((_, known)) = self.calls.iter().find(|(known, _)| known == name) {
            return *known;
        }
        let found = routine_exists(self.program, self.environment, name);
        self.calls.push((name.to_owned(), found));
        found
    }
}

/// `X=5`, `X=AC(5)`, `CR=12.5`, `T="NAME"`: nothing to be worked out.
fn is_plain(bytes: &[u8]) -> bool {
    let right = bytes.iter().position(|&byte| byte == b'=').map_or(bytes, |equals| &bytes[equals + 1..]).trim_ascii();
    let inner = right.iter().position(|&byte| byte == b'(').filter(|&open| {
        open > 0 && open <= 3 && right.ends_with(b")") && right[..open].iter().all(u8::is_ascii_alphabetic)
    });
    is_literal(inner.map_or(right, |open| right[open + 1..right.len() - 1].trim_ascii()))
}

/// A number, a text, or nothing.
pub(super) fn is_literal(bytes: &[u8]) -> bool {
    bytes.is_empty() || bytes.starts_with(b"\"") || decimal(bytes).is_some_and(|(_, length)| length == bytes.len())
}
