//! Unrolling, block by block. In: a block that is executed, its words, and the values of its expressions. Out: its text in [`Record`], without
//! flow control and with values in place of expressions.

use super::flow::Source;
use super::interpreter::{Family, Interpreter};
use super::state::After;
use super::unroll::{Executed, Plain, Record};
use super::words::Words;
use crate::diag::Span;
use crate::ids::BlockId;
use crate::nc::token::TokenKind;

impl<F: Family> Interpreter<'_, F> {
    /// A variable was read that the program never set. Its value is left in the control from before, so the program cannot be unrolled.
    pub(crate) fn unknown_when_unrolled(&mut self, place: Span, number: u32) {
        if self.record.is_none() {
            return;
        }
        let name = F::variable_name(number);
        self.cannot_unroll(&format!("{name}, which the program does not set,"), Some(place));
    }

    /// A variable was set that outlasts the program or belongs to the control. Unrolling would leave out an assignment that has an effect.
    pub(crate) fn sets_the_control(&mut self, number: u32) {
        if number >= self.dialect().lasting_variables_from && self.record.is_some() {
            self.cannot_unroll(&format!("setting #{number}, which outlasts the program in the control,"), None);
        }
    }

    /// Something of the block that is executed has no plain form.
    pub(crate) fn cannot_unroll(&mut self, what: &str, place: Option<Span>) {
        let Some(mut record) = self.record.take() else { return };
        let (source, block) = (self.flow.source.clone(), self.block.id);
        record.note_obstacle_at(what, source.program(), block, matches!(source, Source::Main(_)), place);
        self.record = Some(record);
    }

    /// Writes the block that is executed now into the record. `source`: the text it was read from; `own`: it is in no subprogram.
    pub(crate) fn record_block(&mut self, source: &Source<'_>, own: bool, block: BlockId, words: &Words, after: After) {
        let program = source.program();
        let main = matches!(source, Source::Main(_));
        let Some(mut record) = self.record.take() else { return };
        if main {
            record.note_feed(words);
        }
        let executed =
            Executed { program, block, words, own, main, family: &self.family, parameters: &self.parameters };
        F::obstacles(&executed, &mut record);
        if after == After::Done {
            if !record.began {
                F::head(&mut record, program.line_text(block));
            }
        } else if !F::is_left_out(&executed, &mut record) {
            write_block(&executed, &mut record);
        }
        self.record = Some(record);
    }
}

/// Writes a block.
fn write_block<F: Family>(executed: &Executed<'_, F>, record: &mut Record) {
    let text = executed.program.text();
    let (mut out, mut code, mut had_code, mut dropped) = (Vec::new(), false, false, false);
    let mut blank: Option<u32> = None;
    for token in executed.program.tokens(executed.block) {
        let bytes = token.span.of(text);
        match token.kind {
            TokenKind::Blank => {
                blank = blank.or(Some(token.span.start));
                continue;
            }
            TokenKind::LineEnd => {}
            TokenKind::Comment => had_code |= F::acts_on(executed.program, bytes),
            _ => had_code = true,
        }
        let plain = F::plain(executed, &token, record);
        let written = match &plain {
            Plain::Same => Some(bytes),
            Plain::Text(text) => Some(text.as_slice()),
            Plain::Dropped => None,
            Plain::Unknown(what) => {
                record.note_obstacle(what, executed.program, executed.block, executed.main);
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
            code |= comment && F::acts_on(executed.program, bytes);
        }
        dropped |= written.is_none();
        blank = None;
    }
    if code || !had_code {
        record.text.extend(out);
        if !record.text.ends_with(b"\n") {
            record.text.push(b'\n');
        }
        record.began |= code;
    }
}
