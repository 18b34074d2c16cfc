//! The text of an unrolled program as it grows. In: `record_block.rs` writes executed blocks into it, and each family decides what becomes of its
//! tokens. Out: [`Record`]: the plain text, and the obstacles that make it differ from the program.

use super::words::Words;
use crate::diag::{Diagnostic, Severity, Span};
use crate::ids::BlockId;
use crate::nc::dialect::Dialect;
use crate::nc::parameters::Parameters;
use crate::nc::program::Program;
use crate::nc::token::Token;

/// Letters of lengths, angles and feeds: Fanuc and Haas read them in increments where they have no point.
const POINTED: &[u8] = b"ABCEFIJKQRUVWXYZ";

/// The plain text of the executed blocks.
#[derive(Debug, Default)]
pub(crate) struct Record {
    pub(crate) text: Vec<u8>,
    pub(crate) obstacles: Vec<Diagnostic>,
    /// A block with code was written.
    pub(crate) began: bool,
    /// The text begins with `%`.
    pub(crate) percent: bool,
    /// Numbers of blocks that were written (plain language counts them).
    pub(crate) numbers: u32,
    /// The end of the program was written.
    pub(crate) ended: bool,
    /// Values of F words that are expressions: place, value, whether it was always the same.
    pub(crate) feeds: Vec<(Span, f64, bool)>,
}

/// A block that is executed, and what is known of it.
pub(crate) struct Executed<'a, F> {
    /// The text it belongs to.
    pub program: &'a Program,
    /// Which block.
    pub block: BlockId,
    /// Its words.
    pub words: &'a Words,
    /// It is executed in no subprogram.
    pub own: bool,
    /// It stands in the main text.
    pub main: bool,
    /// What its family remembers.
    pub family: &'a F,
    /// Values of parameters.
    pub parameters: &'a Parameters,
}

impl<F> Executed<'_, F> {
    /// The dialect of the text.
    pub(crate) fn dialect(&self) -> Dialect {
        self.program.dialect()
    }
    /// Bytes of a token.
    pub(crate) fn bytes(&self, token: &Token) -> &[u8] {
        token.span.of(self.program.text())
    }
    /// What the expression of a token came to.
    pub(crate) fn result(&self, span: Span) -> Option<f64> {
        self.words.results.iter().find(|(place, _)| *place == span).map(|(_, value)| *value)
    }
}

/// A token in the plain text.
pub(crate) enum Plain {
    /// As it stands.
    Same,
    /// Left out.
    Dropped,
    /// With a value in place of an expression.
    Text(Vec<u8>),
    /// It has no plain form.
    Unknown(&'static str),
}

impl Record {
    /// Notes the value of an F word that is an expression.
    pub(crate) fn note_feed(&mut self, words: &Words) {
        let (true, Some(span), Some(value)) = (words.is_computed(b'F'), words.span(b'F'), words.get(b'F')) else {
            return;
        };
        match self.feeds.iter_mut().find(|(known, ..)| *known == span) {
            Some((_, before, same)) => *same &= *before == value,
            None => self.feeds.push((span, value, true)),
        }
    }

    pub(crate) fn note_obstacle(&mut self, what: &str, program: &Program, block: BlockId, main: bool) {
        self.note_obstacle_at(what, program, block, main, None);
    }

    pub(crate) fn note_obstacle_at(
        &mut self,
        what: &str,
        program: &Program,
        block: BlockId,
        main: bool,
        place: Option<Span>,
    ) {
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

/// Why a program cannot be unrolled.
pub(crate) fn obstacle(text: impl Into<String>) -> Diagnostic {
    Diagnostic::new("nc::unroll", Severity::Error, text).help("leave --expand out: blocks keep one feed for all passes")
}

/// A number of a word of this letter: as few decimals as tell it from its neighbours.
pub(crate) fn number(letter: u8, value: f64, dialect: Dialect) -> String {
    let digits = dialect.decimals(format!("{:.0}", value.abs().trunc()).len());
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    let text = if text == "-0" { "0" } else { text };
    let point = if dialect.properties().counts_increments && POINTED.contains(&letter) && !text.contains('.') {
        "."
    } else {
        ""
    };
    format!("{text}{point}")
}
