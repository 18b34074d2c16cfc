//! Doubts about part and frame, as the program raises and settles them. In: an event of the text ([`Interpreter::doubt`]) and what
//! settles it ([`Interpreter::settle`]). Out: the stretches of [`Toolpath::doubts`](crate::nc::toolpath::Toolpath), one diagnostic
//! a kind.
//!
//! A stretch ends only where nothing was fed in it: what was cut meanwhile lies elsewhere than the simulated stock has it, and
//! a return to the frame known before does not mend that.

use super::interpreter::{Family, Interpreter};
use crate::diag::{Severity, Span};
use crate::ids::BlockId;
use crate::nc::doubt::{Doubt, Doubted};
use crate::nc::toolpath::MoveKind;

impl<F: Family> Interpreter<'_, F> {
    /// From the next move on part or frame are not known.
    pub(crate) fn doubt(&mut self, doubt: Doubt, place: Span) {
        let raised = &mut self.messages.raised[doubt as usize];
        raised.count += 1;
        if raised.open.is_none() {
            raised.open = Some(self.out.doubts.len());
            let (from, line) = (self.next_move(), self.line_number());
            self.out.doubts.push(Doubted { from, until: None, doubt, line, unread: Vec::new() });
        }
        if self.messages.raised[doubt as usize].diagnostic.is_none() {
            self.messages.raised[doubt as usize].diagnostic = Some(self.out.diagnostics.len());
            let text = format!("{}: no feed is raised from here on", doubt.why());
            self.say("nc::doubt", Severity::Warning, place, text, doubt.remedy());
        }
    }

    /// Nothing of the block can be taken: what it does is not known, nor whether the control takes its feed.
    pub(crate) fn doubt_of_unread(&mut self, place: Span) {
        self.doubt(Doubt::UnknownCode, place);
        let stretch =
            self.messages.raised[Doubt::UnknownCode as usize].open.and_then(|open| self.out.doubts.get_mut(open));
        if let (Some((first, _)), Some(stretch)) = (self.flow.linked_at(self.program), stretch) {
            stretch.unread.push(BlockId(first + self.block.id.0));
        }
    }

    /// The program says absolutely what was open: the next move is not in doubt any more, unless something was fed meanwhile.
    pub(crate) fn settle(&mut self, doubt: Doubt) {
        let Some(open) = self.messages.raised[doubt as usize].open else { return };
        let next = self.next_move();
        let Some(stretch) = self.out.doubts.get_mut(open) else { return };
        let since = self.out.moves.get(stretch.from.ix()..).unwrap_or_default();
        if since.iter().all(|motion| motion.kind == MoveKind::Rapid) {
            stretch.until = Some(next);
            self.messages.raised[doubt as usize].open = None;
        }
    }

    /// How the spindle turns is known again: where the part is was never in doubt, so what was fed meanwhile does not matter.
    pub(crate) fn spindle_is_known(&mut self, doubt: Doubt) {
        let Some(open) = self.messages.raised[doubt as usize].open.take() else { return };
        let next = self.next_move();
        if let Some(stretch) = self.out.doubts.get_mut(open) {
            stretch.until = Some(next);
        }
    }

    /// Adds to each diagnostic in how many places its doubt was raised.
    pub(crate) fn count_doubts(&mut self) {
        for raised in self.messages.raised.iter().filter(|raised| raised.count > 1) {
            if let Some(diagnostic) = raised.diagnostic.and_then(|index| self.out.diagnostics.get_mut(index)) {
                diagnostic.text += &format!(" (the first of {} places)", raised.count);
            }
        }
    }
}
