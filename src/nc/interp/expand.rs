//! Unrolling: a program with loops, calls and expressions as the plain blocks it executes. In: a program and its
//! surroundings. Out: a text whose every block is executed once, from top to bottom, or what stands in the way.
//!
//! Blocks come in the order they are executed, byte for byte but for what steers the flow: O words, labels, calls with
//! their arguments, assignments and block numbers (they would stand several times) are left out; a word with an expression
//! gets its value, with nine decimals at most (eight digits in all where the control reads no more). Comments go along. Plain
//! language counts its blocks: they are numbered anew.

use super::calls::Source;
use super::expand_text::{Noted, end_of, number, unnumbered};
use super::flow::After;
use super::line::Line;
use super::{Run, execute_recorded};
use crate::diag::{Diagnostic, Severity, Span};
use crate::ids::BlockId;
use crate::nc::dialect::{Dialect, Syntax};
use crate::nc::environment::Environment;
use crate::nc::expr::Parameters;
use crate::nc::lex::TokenKind;
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
    pub(super) text: Vec<u8>,
    obstacles: Vec<Diagnostic>,
    /// A block with code was written.
    pub(super) began: bool,
    /// The text begins with `%`.
    pub(super) percent: bool,
    /// Numbers of blocks that were written (plain language counts them).
    pub(super) numbers: u32,
    /// The end of the program was written.
    pub(super) ended: bool,
    /// Values of F words that are expressions: place, value, whether it was always the same.
    feeds: Vec<(Span, f64, bool)>,
}

/// Codes after which the rest of a program is not what the control would execute.
const LOST: [&str; 6] =
    ["nc::runaway", "nc::no-routine", "nc::unbalanced", "nc::no-target", "nc::expression", "nc::modal-call"];
/// What only the control knows.
const CONTROLS: &str = "a variable that the control keeps itself";
/// Parameters from here on are the control's own: setting one does something (#3000 is an alarm, #3006 a stop).
const OWN: u32 = 1000;
/// LinuxCNC has parameters of its own from here on; the others below it are free.
const OWN_IN_LINUXCNC: u32 = 5061;

/// Unrolls a program.
pub fn expand(program: &Program, environment: &Environment<'_>) -> Expanded {
    let (record, path) = execute_recorded(program, environment);
    let Record { mut text, mut obstacles, percent, numbers, ended, .. } = record;
    obstacles.extend(path.diagnostics.into_iter().filter(|d| LOST.contains(&d.code)));
    if program.has_block_delete() {
        // With the switch on, the same text without those blocks must be what is executed.
        let (on, _) = execute_recorded(program, &Environment { block_delete: true, ..environment.clone() });
        let dialect = program.dialect();
        let lines = |text: &[u8], kept: fn(&[u8]) -> bool| -> Vec<u8> {
            let lines = text.split_inclusive(|&byte| byte == b'\n').filter(|line| kept(line));
            lines.flat_map(|line| unnumbered(line, dialect).to_vec()).collect()
        };
        if lines(&text, |line| !line.trim_ascii_start().starts_with(b"/")) != lines(&on.text, |_| true) {
            obstacles.push(obstacle("what is executed hangs on the block-delete switch"));
        }
    }
    // In the order of the text; those that belong to no line last.
    obstacles.sort_by_key(|obstacle| obstacle.line.unwrap_or(u32::MAX));
    if percent {
        text.extend_from_slice(b"%\n");
    }
    if program.dialect() == Dialect::Heidenhain && !ended {
        text.extend(end_of(program, numbers));
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
    /// A variable was read that nothing in the program has set: what it holds is left over in the control.
    pub(super) fn unknown_when_unrolled(&mut self, place: Span, number: u32) {
        let name = self.parameter_name(number);
        self.in_the_way(&format!("{name}, which the program does not set,"), Some(place));
    }

    /// An assignment to a variable of the control's own does something, and would be left out.
    pub(super) fn sets_the_control(&mut self, number: u32) {
        let first = match self.program.dialect() {
            Dialect::LinuxCnc => OWN_IN_LINUXCNC,
            dialect if dialect.syntax() == Syntax::Rs274 => OWN,
            _ => return,
        };
        if number >= first && self.record.is_some() {
            self.in_the_way(&format!("#{number}, which belongs to the control,"), None);
        }
    }

    /// Something of the block that is executed has no plain form.
    pub(super) fn in_the_way(&mut self, what: &str, place: Option<Span>) {
        let Some(mut record) = self.record.take() else { return };
        let (source, block) = (self.source.clone(), self.block);
        record.stand_there(what, source.program(), block, matches!(source, Source::Main(_)), place);
        self.record = Some(record);
    }

    /// How a numbered parameter is called on this control.
    fn parameter_name(&self, number: u32) -> String {
        let local = |letter: char| match number {
            20_000_000.. => format!("{letter}R{}", number - 20_000_000),
            10_000_000.. => format!("{letter}L{}", number - 10_000_000),
            _ => format!("{letter}{number}"),
        };
        match self.program.dialect().syntax() {
            Syntax::Rs274 => format!("#{number}"),
            Syntax::Siemens => local('R'),
            Syntax::Heidenhain => local('Q'),
        }
    }

    /// Notes down the block that is executed now, as it was read from `source`; `own`: in no subprogram.
    pub(super) fn note_down(&mut self, source: &Source<'_>, own: bool, block: BlockId, line: &Line, after: After) {
        let program = source.program();
        let main = matches!(source, Source::Main(_));
        let Some(mut record) = self.record.take() else { return };
        if main {
            record.note_feed(line);
        }
        record.note_machine(program, block, main, &self.parameters);
        let rs274 = program.dialect().syntax() == Syntax::Rs274;
        if after == After::Words {
            let (defined, parameters) = (&self.defined, &self.parameters);
            record.block(&Noted { program, block, line, own, main, defined, parameters });
        } else if rs274 && !record.began && program.line_text(block).starts_with(b"%") {
            record.text.extend_from_slice(program.line_text(block));
            (record.began, record.percent) = (true, true);
        } else if !rs274 && !record.began && program.line_text(block).starts_with(b"%_N_") {
            record.text.extend_from_slice(program.line_text(block));
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

    /// G66.1 calls a macro after every block; what a Heidenhain control found out by itself is not known here.
    fn note_machine(&mut self, program: &Program, block: BlockId, main: bool, parameters: &Parameters) {
        if program.dialect().syntax() != Syntax::Rs274 {
            return self.note_results(program, block, main, parameters);
        }
        if program.tokens(block).any(|t| t.kind == TokenKind::Word(b'G') && t.number == 66.1) {
            self.stand_in_the_way("a modal macro call", program, block, main);
        }
    }

    /// Q100 to Q199 hold what a Heidenhain control found out by itself, as long as the program does not set them.
    fn note_results(&mut self, program: &Program, block: BlockId, main: bool, parameters: &Parameters) {
        if program.dialect() != Dialect::Heidenhain {
            return;
        }
        let text = program.line_text(block);
        let code = memchr::memchr(b';', text).unwrap_or(text.len());
        let result = |at: usize| {
            let digits: Vec<u8> = text[at + 1..].iter().copied().take_while(u8::is_ascii_digit).collect();
            let number = String::from_utf8_lossy(&digits).parse().unwrap_or(0);
            (100..200).contains(&number) && !parameters.numbered.contains_key(&number)
        };
        if memchr::memchr2_iter(b'Q', b'q', &text[..code]).any(result) {
            self.stand_in_the_way(CONTROLS, program, block, main);
        }
    }

    pub(super) fn stand_in_the_way(&mut self, what: &str, program: &Program, block: BlockId, main: bool) {
        self.stand_there(what, program, block, main, None);
    }

    fn stand_there(&mut self, what: &str, program: &Program, block: BlockId, main: bool, place: Option<Span>) {
        let known = |found: &Diagnostic| self.obstacles.iter().any(|o| o.line == found.line && o.text == found.text);
        let line = program.line(block);
        let found = if main {
            obstacle(format!("{what} cannot be unrolled")).at(line, place.unwrap_or(program.span(block)))
        } else {
            obstacle(format!("{what} cannot be unrolled (line {line} of a subprogram)"))
        };
        if self.obstacles.len() < 10 && !known(&found) {
            self.obstacles.push(found);
        }
    }
}
