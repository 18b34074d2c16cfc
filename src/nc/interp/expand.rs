//! Unrolling: a program with loops, calls and expressions as the plain blocks it executes. In: a program and its
//! surroundings. Out: a text whose every block is executed once, from top to bottom, or what stands in the way.
//!
//! Blocks come in the order they are executed, byte for byte but for what steers the flow: O words, labels, calls with
//! their arguments, assignments and block numbers (they would stand several times) are left out; a word with an expression
//! gets its value, with nine decimals at most (eight digits in all where the control reads no more). Comments go along.

use super::calls::Source;
use super::flow::After;
use super::line::Line;
use super::{Run, execute_recorded};
use crate::diag::{Diagnostic, Severity, Span};
use crate::ids::BlockId;
use crate::nc::dialect::{Dialect, Syntax};
use crate::nc::environment::Environment;
use crate::nc::lex::{Token, TokenKind};
use crate::nc::program::Program;

/// A program unrolled.
#[derive(Debug, Clone, Default)]
pub struct Expanded {
    /// The plain text.
    pub text: Vec<u8>,
    /// Why it is not the whole program; empty when it is.
    pub obstacles: Vec<Diagnostic>,
}

/// What a run notes down.
#[derive(Debug, Default)]
pub(super) struct Record {
    text: Vec<u8>,
    obstacles: Vec<Diagnostic>,
    /// A block with code was written.
    began: bool,
    /// The text begins with `%`.
    percent: bool,
    /// Values of F words that are expressions: place, value, whether it was always the same.
    feeds: Vec<(Span, f64, bool)>,
}

/// Codes after which the rest of a program is not what the control would execute.
const LOST: [&str; 5] = ["nc::runaway", "nc::no-routine", "nc::unbalanced", "nc::no-target", "nc::expression"];
/// Letters of lengths, angles and feeds: Fanuc and Haas read them in increments where they have no point.
const POINTED: &[u8] = b"ABCEFIJKQRUVWXYZ";
/// Parameters from here on are the control's own, other than its position, tool and offset.
const OWN: u32 = 1000;

/// Does the program hold loops, jumps, calls, variables or expressions?
pub fn steers(program: &Program) -> bool {
    let steering = |token: Token| match token.kind {
        TokenKind::Word(b'M') => [97.0, 98.0].contains(&token.number),
        TokenKind::Word(b'G') => [65.0, 66.0].contains(&token.number),
        TokenKind::Name | TokenKind::Routine | TokenKind::Assignment | TokenKind::Computed(_) => true,
        _ => false,
    };
    program.blocks().any(|block| program.tokens(block).any(steering))
}

/// Unrolls a program of the RS274 family.
pub fn expand(program: &Program, environment: &Environment<'_>) -> Expanded {
    if program.dialect().syntax() != Syntax::Rs274 {
        let text = format!("programs of {} are not unrolled", program.dialect().name());
        return Expanded { text: Vec::new(), obstacles: vec![obstacle(text)] };
    }
    let (record, path) = execute_recorded(program, environment);
    let Record { mut text, mut obstacles, percent, .. } = record;
    obstacles.extend(path.diagnostics.into_iter().filter(|d| LOST.contains(&d.code)));
    if program.has_block_delete() {
        // With the switch on, the same text without those blocks must be what is executed.
        let (on, _) = execute_recorded(program, &Environment { block_delete: true, ..environment.clone() });
        let left =
            text.split_inclusive(|&byte| byte == b'\n').filter(|line| !line.trim_ascii_start().starts_with(b"/"));
        if left.collect::<Vec<_>>().concat() != on.text {
            obstacles.push(obstacle("what is executed hangs on the block-delete switch"));
        }
    }
    if percent {
        text.extend_from_slice(b"%\n");
    }
    Expanded { text, obstacles }
}

/// The program with F words that are expressions or variables replaced by their values, where each is always the same;
/// not on the excluded lines (first, last).
pub fn plain_feeds(program: &Program, environment: &Environment<'_>, exclude: &[(u32, u32)]) -> Vec<u8> {
    let (mut record, _) = execute_recorded(program, environment);
    record.feeds.sort_by_key(|(span, ..)| span.start);
    let mut text = Vec::with_capacity(program.text().len());
    let mut at = 0;
    for (span, value, same) in record.feeds {
        let line = program.line(program.block_at(span.start));
        if same && value > 0.0 && !exclude.iter().any(|(first, last)| (first..=last).contains(&&line)) {
            text.extend_from_slice(&program.text()[at..=span.start as usize]);
            text.extend_from_slice(number(b'F', value, program.dialect()).as_bytes());
            at = span.end as usize;
        }
    }
    text.extend_from_slice(&program.own_text()[at..]);
    text
}

fn obstacle(text: impl Into<String>) -> Diagnostic {
    Diagnostic::new("nc::unroll", Severity::Error, text).help("leave --expand out: blocks keep one feed for all passes")
}

impl Run<'_> {
    /// Notes down the block that is executed now, as it was read from `source`.
    pub(super) fn note_down(&mut self, source: &Source<'_>, block: BlockId, line: &Line, after: After) {
        let program = source.program();
        let main = matches!(source, Source::Main(_));
        let Some(mut record) = self.record.take() else { return };
        if main {
            record.note_feed(line);
        }
        record.note_machine(program, block, main);
        if after == After::Words {
            record.block(program, block, line, self.calls.is_empty());
        } else if !record.began && program.line_text(block).starts_with(b"%") {
            record.text.extend_from_slice(program.line_text(block));
            (record.began, record.percent) = (true, true);
        }
        self.record = Some(record);
    }
}

impl Record {
    fn note_feed(&mut self, line: &Line) {
        let (true, Some(span), Some(value)) = (line.is_computed(b'F'), line.span(b'F'), line.get(b'F')) else { return };
        match self.feeds.iter_mut().find(|(known, ..)| *known == span) {
            Some((_, before, same)) => *same &= *before == value,
            None => self.feeds.push((span, value, true)),
        }
    }

    /// What the control keeps itself (probe results, tool tables, alarms) is not known here.
    fn note_machine(&mut self, program: &Program, block: BlockId, main: bool) {
        let text = program.line_text(block);
        let modal = program.tokens(block).any(|t| t.kind == TokenKind::Word(b'G') && t.number == 66.1);
        let own = memchr::memchr_iter(b'#', text).any(|at| {
            let (number, length) = crate::nc::decimal(&text[at + 1..]).unwrap_or_default();
            let known = [5041, 5042, 5043, 5220, 5400, 5420, 5421, 5422];
            length > 0 && number >= f64::from(OWN) && !known.contains(&(number as u32))
        });
        if (own || modal) && self.obstacles.len() < 10 {
            let what = if modal { "a modal macro call" } else { "a variable that the control keeps itself" };
            let found = obstacle(format!("{what} cannot be unrolled"));
            self.obstacles.push(if main { found.at(program.line(block), program.span(block)) } else { found });
        }
    }

    fn block(&mut self, program: &Program, block: BlockId, line: &Line, in_main: bool) {
        let text = program.text();
        let call = line.m.iter().any(|m| [970, 980, 990].contains(&m.0)) && !(in_main && line.has_m(990));
        let macro_call = line.has_g(650) || line.has_g(660);
        let dropped = |token: &Token| match token.kind {
            TokenKind::Word(b'N') | TokenKind::Assignment | TokenKind::Routine => true,
            TokenKind::Word(b'O') => self.began && !(self.percent && self.text.len() < 4),
            TokenKind::Word(b'G') if token.number == 67.0 => true,
            TokenKind::Word(b'M') => call && [97.0, 98.0, 99.0].contains(&token.number),
            TokenKind::Word(b'P' | b'L') | TokenKind::Computed(b'P' | b'L') => call || macro_call,
            TokenKind::Word(_) | TokenKind::Computed(_) => macro_call,
            _ => false,
        };
        let (mut out, mut code, mut had_code) = (Vec::new(), false, false);
        let mut blank: &[u8] = b"";
        for token in program.tokens(block) {
            let bytes = token.span.of(text);
            match token.kind {
                TokenKind::Blank => {
                    blank = bytes;
                    continue;
                }
                TokenKind::LineEnd | TokenKind::Comment => {}
                _ => had_code = true,
            }
            if !dropped(&token) {
                if !(out.is_empty() && had_code) {
                    out.extend_from_slice(blank);
                }
                match token.kind {
                    TokenKind::Computed(letter) => out.extend(computed(letter, token.span, line, program)),
                    _ => out.extend_from_slice(bytes),
                }
                code |= !matches!(token.kind, TokenKind::LineEnd | TokenKind::Comment);
            }
            blank = b"";
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

/// A word with its value in place of its expression.
fn computed(letter: u8, span: Span, line: &Line, program: &Program) -> Vec<u8> {
    let code = |codes: &[super::line::Code]| codes.iter().find(|c| c.1 == span).map(|c| f64::from(c.0) / 10.0);
    let value = match letter {
        b'G' => code(&line.g),
        b'M' => code(&line.m),
        _ => line.get(letter),
    };
    let Some(value) = value else { return Vec::new() };
    let written = program.text()[span.start as usize];
    [&[written][..], number(letter, value, program.dialect()).as_bytes()].concat()
}

/// A number of a word of this letter: as few decimals as tell it from its neighbours.
fn number(letter: u8, value: f64, dialect: Dialect) -> String {
    let short = matches!(dialect, Dialect::Fanuc | Dialect::Haas);
    let whole = format!("{:.0}", value.abs().trunc()).len();
    let digits = if short { 8_usize.saturating_sub(whole) } else { 9 };
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    let text = if text == "-0" { "0" } else { text };
    let point = if short && POINTED.contains(&letter) && !text.contains('.') { "." } else { "" };
    format!("{text}{point}")
}
