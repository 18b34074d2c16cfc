//! A block as plain text. In: the tokens of a block that is executed, and what its expressions came to. Out: its bytes without
//! what steers the flow, with values in place of expressions, in the manner of its dialect.

use std::collections::BTreeSet;

use super::expand::Record;
use super::flow::right_of;
use super::line::Line;
use super::said;
use super::siemens::{is_variable, variable};
use crate::diag::Span;
use crate::ids::BlockId;
use crate::nc::dialect::{Dialect, Syntax};
use crate::nc::expr::{self, Parameters};
use crate::nc::lex::{Token, TokenKind};
use crate::nc::program::Program;
use crate::nc::steer::{continues, is_literal, value_of};

/// Letters of lengths, angles and feeds: Fanuc and Haas read them in increments where they have no point.
const POINTED: &[u8] = b"ABCEFIJKQRUVWXYZ";

/// A block that is executed, and what is known of it.
pub(super) struct Noted<'a> {
    /// The text it belongs to.
    pub program: &'a Program,
    /// Which block.
    pub block: BlockId,
    /// Its words.
    pub line: &'a Line,
    /// It is executed in no subprogram.
    pub own: bool,
    /// It stands in the main text.
    pub main: bool,
    /// Siemens: variables that DEF made.
    pub defined: &'a BTreeSet<String>,
    /// Values of parameters.
    pub parameters: &'a Parameters,
}

/// A token in the plain text.
enum Plain {
    Same,
    Dropped,
    Text(Vec<u8>),
    /// It has no plain form.
    Unknown(&'static str),
}

impl Record {
    /// Writes a block.
    pub(super) fn block(&mut self, noted: &Noted<'_>) {
        let text = noted.program.text();
        if noted.program.dialect() == Dialect::Heidenhain {
            if noted.steers_in_plain_language() {
                return;
            }
            self.ended |= noted.first_name().is_some_and(|name| name.eq_ignore_ascii_case(b"END"));
        }
        let (mut out, mut code, mut had_code, mut dropped) = (Vec::new(), false, false, false);
        let mut blank: Option<u32> = None;
        for token in noted.program.tokens(noted.block) {
            let bytes = token.span.of(text);
            match token.kind {
                TokenKind::Blank => {
                    blank = blank.or(Some(token.span.start));
                    continue;
                }
                TokenKind::LineEnd => {}
                TokenKind::Comment => had_code |= said::speaks(noted.program.dialect(), bytes),
                _ => had_code = true,
            }
            let plain = match noted.program.dialect().syntax() {
                Syntax::Rs274 => noted.rs274(&token, self),
                Syntax::Siemens => noted.siemens(&token),
                Syntax::Heidenhain => noted.heidenhain(&token, self),
            };
            let written = match &plain {
                Plain::Same => Some(bytes),
                Plain::Text(text) => Some(text.as_slice()),
                Plain::Dropped => None,
                Plain::Unknown(what) => {
                    self.stand_in_the_way(what, noted.program, noted.block, noted.main);
                    None
                }
            };
            if let Some(written) = written {
                if let Some(from) = blank.filter(|_| !(out.is_empty() && dropped)) {
                    out.extend_from_slice(&text[from as usize..token.span.start as usize]);
                }
                out.extend_from_slice(written);
                let comment = token.kind == TokenKind::Comment;
                code |= !comment && token.kind != TokenKind::LineEnd;
                code |= comment && said::speaks(noted.program.dialect(), bytes);
            }
            dropped |= written.is_none();
            blank = None;
        }
        if code || !had_code {
            self.text.extend(out);
            if !self.text.ends_with(b"\n") {
                self.text.push(b'\n');
            }
            self.began |= code;
        }
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
    let bare = unnumbered(bytes, program.dialect());
    let number = if bare.len() < bytes.len() { number.to_string() } else { String::new() };
    [number.as_bytes(), bare, b"\n"].concat()
}

impl Noted<'_> {
    fn dialect(&self) -> Dialect {
        self.program.dialect()
    }

    fn first_name(&self) -> Option<&[u8]> {
        let mut tokens = self.program.tokens(self.block);
        tokens.find(|token| token.kind == TokenKind::Name).map(|token| token.span.of(self.program.text()))
    }

    fn bytes(&self, token: &Token) -> &[u8] {
        token.span.of(self.program.text())
    }

    fn result(&self, span: Span) -> Option<f64> {
        self.line.results.iter().find(|(place, _)| *place == span).map(|(_, value)| *value)
    }

    /// Value of the right side of an assignment.
    fn value_now(&self, assignment: &[u8]) -> Option<f64> {
        expr::evaluate(right_of(assignment), self.parameters).ok()
    }

    fn rs274(&self, token: &Token, record: &Record) -> Plain {
        let line = self.line;
        let call = line.m.iter().any(|m| [970, 980, 990].contains(&m.0)) && !(self.own && line.has_m(990));
        let macro_call = line.has_g(650) || line.has_g(660);
        let dropped = match token.kind {
            TokenKind::Word(b'N') | TokenKind::Assignment | TokenKind::Routine => true,
            TokenKind::Word(b'O') => record.began && !(record.percent && record.text.len() < 4),
            TokenKind::Word(b'G') if token.number == 67.0 => true,
            TokenKind::Word(b'M') => call && [97.0, 98.0, 99.0].contains(&token.number),
            TokenKind::Word(b'P' | b'L') | TokenKind::Computed(b'P' | b'L') => call || macro_call,
            TokenKind::Word(_) | TokenKind::Computed(_) => macro_call,
            _ => false,
        };
        match token.kind {
            _ if dropped => Plain::Dropped,
            TokenKind::Comment => match said::with_values(self.dialect(), self.bytes(token), self.parameters) {
                Ok(None) => Plain::Same,
                Ok(Some(text)) => Plain::Text(text),
                Err(()) => Plain::Unknown("a message with a variable that the program does not set"),
            },
            TokenKind::Name => Plain::Unknown("a word that is not understood"),
            TokenKind::Computed(letter) => {
                let value = self.result(token.span);
                let written = value.map(|value| number(letter, value, self.dialect()));
                Plain::Text(written.map_or_else(Vec::new, |text| [&self.bytes(token)[..1], text.as_bytes()].concat()))
            }
            _ => Plain::Same,
        }
    }

    fn siemens(&self, token: &Token) -> Plain {
        let bytes = self.bytes(token);
        let called = self.line.called.contains(&token.span);
        match token.kind {
            TokenKind::Word(b'N') | TokenKind::Label => Plain::Dropped,
            TokenKind::Word(b'M') if !self.own && token.number == 17.0 => Plain::Dropped,
            TokenKind::Word(b'P') | TokenKind::Computed(b'P') if !self.line.called.is_empty() => Plain::Dropped,
            TokenKind::Word(_) | TokenKind::Name | TokenKind::Call if called => Plain::Dropped,
            TokenKind::Name if bytes.eq_ignore_ascii_case(b"RET") => Plain::Dropped,
            TokenKind::Call => self.plain_call(bytes),
            TokenKind::Computed(letter) => self.siemens_word(letter, token),
            TokenKind::Assignment if is_variable(bytes) || self.defined.contains(&variable(bytes)) => Plain::Dropped,
            TokenKind::Assignment if bytes.contains(&b'"') => Plain::Same,
            TokenKind::Assignment => match self.result(token.span).or_else(|| self.value_now(bytes)) {
                Some(value) => {
                    let text = format!("{}={}", variable(bytes), number(b'X', value, self.dialect()));
                    Plain::Text(text.into_bytes())
                }
                None => Plain::Unknown("an assignment without a value"),
            },
            _ => Plain::Same,
        }
    }

    /// `X=R1*2` becomes `X10`; `X=IC(R1)` keeps its function.
    fn siemens_word(&self, letter: u8, token: &Token) -> Plain {
        let bytes = self.bytes(token);
        if bytes.contains(&b'"') {
            return Plain::Same;
        }
        let Some(value) = self.result(token.span) else { return Plain::Unknown("a word without a value") };
        let value = number(letter, value, self.dialect());
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
    fn plain_call(&self, bytes: &[u8]) -> Plain {
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
            match expr::evaluate(part, self.parameters) {
                _ if literal(&part) => written.push(part.to_vec()),
                Ok(value) => written.push(number(b'X', value, self.dialect()).into_bytes()),
                Err(_) => return Plain::Unknown("an argument without a value"),
            }
        }
        Plain::Text([&bytes[..=open], &written.join(&b","[..]), b")"].concat())
    }

    /// Labels, calls, jumps and assignments of plain language; the head and the end of a called program.
    fn steers_in_plain_language(&self) -> bool {
        let text = self.program.text();
        let mut code = self.program.tokens(self.block).filter(|token| {
            !matches!(token.kind, TokenKind::Blank | TokenKind::Delete | TokenKind::LineEnd | TokenKind::Word(b'N'))
        });
        match code.next() {
            Some(token) if token.kind == TokenKind::Assignment => !continues(self.program, self.block),
            Some(token) if token.kind == TokenKind::Name => {
                let word = token.span.of(text).to_ascii_uppercase();
                let foreign = !self.main && matches!(word.as_slice(), b"BEGIN" | b"END");
                foreign || matches!(word.as_slice(), b"LBL" | b"CALL" | b"FN")
            }
            _ => false,
        }
    }

    fn heidenhain(&self, token: &Token, record: &mut Record) -> Plain {
        let bytes = self.bytes(token);
        let valued = |value: f64, letter: u8, sign: &[u8]| {
            let text = number(letter, value, Dialect::Heidenhain);
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
                let Some(value) = self.result(token.span) else { return Plain::Unknown("a word without a value") };
                Plain::Text([&bytes[..letters], &valued(value, letter & 0x5f, &bytes[letters..])].concat())
            }
            TokenKind::Expression if bytes.iter().any(|byte| byte.eq_ignore_ascii_case(&b'Q')) && bytes[0] != b'"' => {
                match expr::evaluate(bytes, self.parameters) {
                    Ok(value) => Plain::Text(valued(value, b'X', bytes)),
                    Err(_) => Plain::Unknown("a parameter without a value"),
                }
            }
            TokenKind::Assignment if value_of(bytes).is_none() => {
                let (left, index) = (variable(bytes), variable(bytes)[1..].parse().unwrap_or(0));
                let value = number(b'X', self.parameters.number(index), Dialect::Heidenhain);
                Plain::Text(format!("{left}={value}").into_bytes())
            }
            _ => Plain::Same,
        }
    }
}

/// A line without its block number, where the dialect counts them.
pub(super) fn unnumbered(line: &[u8], dialect: Dialect) -> &[u8] {
    let digits =
        if dialect == Dialect::Heidenhain { line.iter().take_while(|b| b.is_ascii_digit()).count() } else { 0 };
    &line[digits..]
}

/// A number of a word of this letter: as few decimals as tell it from its neighbours.
pub(super) fn number(letter: u8, value: f64, dialect: Dialect) -> String {
    let short = matches!(dialect, Dialect::Fanuc | Dialect::Haas);
    let whole = format!("{:.0}", value.abs().trunc()).len();
    let digits = match dialect {
        _ if short => 8_usize.saturating_sub(whole),
        Dialect::Heidenhain => 5,
        _ => 9,
    };
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    let text = if text == "-0" { "0" } else { text };
    let point = if short && POINTED.contains(&letter) && !text.contains('.') { "." } else { "" };
    format!("{text}{point}")
}
