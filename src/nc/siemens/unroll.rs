//! Unrolling of Siemens text, and the search for flow control. In: a token of a block that is executed. Out: its plain text: labels, calls that
//! are followed and assignments are left out, expressions are replaced by their values.

use super::blocks::{is_setting, is_variable};
use super::state::Siemens;
use crate::nc::environment::Environment;
use crate::nc::expr;
use crate::nc::interp::calls::routine_exists;
use crate::nc::interp::unroll::{Executed, Plain, number};
use crate::nc::interp::values::{left_of, right_of};
use crate::nc::number::decimal;
use crate::nc::program::Program;
use crate::nc::token::{Token, TokenKind};

/// A token of a block in plain text.
pub(super) fn plain(executed: &Executed<'_, Siemens>, token: &Token) -> Plain {
    let bytes = executed.bytes(token);
    let called = executed.words.called.contains(&token.span);
    match token.kind {
        TokenKind::Word(b'N') | TokenKind::Label => Plain::Dropped,
        TokenKind::Word(b'M') if !executed.own && token.number == 17.0 => Plain::Dropped,
        TokenKind::Word(b'P') | TokenKind::Computed(b'P') if !executed.words.called.is_empty() => Plain::Dropped,
        TokenKind::Word(_) | TokenKind::Name | TokenKind::Call if called => Plain::Dropped,
        TokenKind::Name if bytes.eq_ignore_ascii_case(b"RET") => Plain::Dropped,
        TokenKind::Call => plain_call(executed, bytes),
        TokenKind::Computed(letter) => word(executed, letter, token),
        TokenKind::Assignment if is_variable(bytes) || executed.family.defined.contains(&left_of(bytes)) => {
            Plain::Dropped
        }
        TokenKind::Assignment if bytes.contains(&b'"') => Plain::Same,
        TokenKind::Assignment => {
            match executed.result(token.span).or_else(|| expr::evaluate(right_of(bytes), executed.parameters).ok()) {
                Some(value) => {
                    let text = format!("{}={}", left_of(bytes), number(b'X', value, executed.dialect()));
                    Plain::Text(text.into_bytes())
                }
                None => Plain::Unknown("an assignment without a value"),
            }
        }
        _ => Plain::Same,
    }
}

/// `X=R1*2` becomes `X10`; `X=IC(R1)` keeps its function.
fn word(executed: &Executed<'_, Siemens>, letter: u8, token: &Token) -> Plain {
    let bytes = executed.bytes(token);
    if bytes.contains(&b'"') {
        return Plain::Same;
    }
    let Some(value) = executed.result(token.span) else { return Plain::Unknown("a word without a value") };
    let value = number(letter, value, executed.dialect());
    let right = bytes.iter().position(|&byte| byte == b'=').map_or(&b""[..], |at| bytes[at + 1..].trim_ascii());
    let function = [&b"AC"[..], b"IC", b"DC", b"ACP", b"ACN"]
        .into_iter()
        .find(|name| right.get(name.len()) == Some(&b'(') && right[..name.len()].eq_ignore_ascii_case(name));
    Plain::Text(match function {
        Some(name) => [&bytes[..1], b"=", name, b"(", value.as_bytes(), b")"].concat(),
        None => [&bytes[..1], value.as_bytes()].concat(),
    })
}

/// `NAME(a, R1, , c)` with values in place of variables; a message that shows some is left out.
fn plain_call(executed: &Executed<'_, Siemens>, bytes: &[u8]) -> Plain {
    let open = bytes.iter().position(|&byte| byte == b'(').unwrap_or(bytes.len());
    let inner = bytes.get(open + 1..bytes.len().saturating_sub(1)).unwrap_or_default();
    let (mut depth, mut quoted) = (0, false);
    let parts: Vec<&[u8]> = inner
        .split(|&byte| {
            quoted ^= byte == b'"';
            depth += i32::from(byte == b'(' && !quoted) - i32::from(byte == b')' && !quoted);
            byte == b',' && depth == 0 && !quoted
        })
        .collect();
    let literal = |part: &&[u8]| is_literal(part.trim_ascii());
    let message = bytes[..open].eq_ignore_ascii_case(b"MSG");
    if parts.iter().all(literal) && !(message && inner.windows(2).any(|pair| pair == b"<<")) {
        return Plain::Same;
    }
    if message {
        return Plain::Dropped;
    }
    let mut written = Vec::new();
    for part in parts {
        match expr::evaluate(part, executed.parameters) {
            _ if literal(&part) => written.push(part.to_vec()),
            Ok(value) => written.push(number(b'X', value, executed.dialect()).into_bytes()),
            Err(_) => return Plain::Unknown("an argument without a value"),
        }
    }
    Plain::Text([&bytes[..=open], &written.join(&b","[..]), b")"].concat())
}

/// Looks for what steers the flow.
pub(super) struct FlowSearch<'a> {
    pub(super) program: &'a Program,
    pub(super) environment: &'a Environment<'a>,
    /// Names that were looked up, and whether there is such a subprogram.
    pub(super) calls: Vec<(String, bool)>,
}

/// Words of the flow; a name behind one of them is a label.
const FLOW: [&str; 23] = [
    "IF", "ELSE", "ENDIF", "FOR", "TO", "ENDFOR", "WHILE", "ENDWHILE", "LOOP", "ENDLOOP", "REPEAT", "REPEATB", "UNTIL",
    "GOTO", "GOTOF", "GOTOB", "GOTOC", "GOTOS", "CASE", "DEF", "PROC", "RET", "EXTERN",
];

impl FlowSearch<'_> {
    pub(super) fn has_flow_control(&mut self) -> bool {
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
        let found = routine_exists::<Siemens>(self.program, self.environment, name);
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
fn is_literal(bytes: &[u8]) -> bool {
    bytes.is_empty() || bytes.starts_with(b"\"") || decimal(bytes).is_some_and(|(_, length)| length == bytes.len())
}
