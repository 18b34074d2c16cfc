//! Doubts about part and frame, as the program raises and resolves them. In: an event of the text that raises a doubt
//! ([`Interpreter::doubt`]), and one that resolves it ([`Interpreter::settle`]). Out: the stretches of
//! [`Toolpath::doubts`](crate::nc::toolpath::Toolpath), with one diagnostic for each kind of doubt.
//!
//! A doubt is resolved only if there was no feed move in the stretch. Otherwise material was removed at an unknown place, the simulated
//! stock is wrong there, and returning to the known frame does not correct it.

use super::interpreter::{Family, Interpreter};
use super::state::FeedWord;
use crate::diag::{Severity, Span};
use crate::ids::{BlockId, MoveId};
use crate::nc::doubt::{Displaced, Doubt, Doubted};
use crate::nc::toolpath::{FeedMode, FeedUse, MoveKind};

impl<F: Family> Interpreter<'_, F> {
    /// From the next move on part or frame are not known.
    pub(crate) fn doubt(&mut self, doubt: Doubt, place: Span) {
        self.displace(doubt);
        if doubt.may_use_the_feed() {
            self.uses_feed();
        }
        let raised = &mut self.messages.raised[doubt as usize];
        raised.count += 1;
        if raised.open.is_none() {
            raised.open = Some(self.out.doubts.len());
            self.flow.looked.retain(|(of, ..), _| *of != doubt);
            let (from, line) = (self.next_move(), self.line_number());
            self.out.doubts.push(Doubted { from, until: None, doubt, line, unread: Vec::new() });
        }
        if self.messages.raised[doubt as usize].diagnostic.is_none() {
            self.messages.raised[doubt as usize].diagnostic = Some(self.out.diagnostics.len());
            let [is_confirmed, in_part] = [0, 1].map(|k| self.env.confirmed[k].contains(&doubt.name()));
            let (severity, consequence, remedy) = match (is_confirmed, in_part) {
                (true, _) => (Severity::Note, "the setup confirms that nothing changes by it", ""),
                (_, true) => (Severity::Warning, "from here on feeds are raised only where the setup confirms it", ""),
                _ => (Severity::Warning, "no feed is raised from here on", doubt.remedy()),
            };
            self.say("nc::doubt", severity, place, format!("{}: {consequence}", doubt.why()), remedy);
        }
        if doubt.may_run_anything()
            && let Some(from) = self.first_again(doubt)
        {
            self.doubt_since(doubt, from, place);
        }
    }

    /// An open doubt holds since an earlier move: what ran from there on may run again.
    pub(crate) fn doubt_since(&mut self, doubt: Doubt, from: MoveId, place: Span) {
        let Some(open) = self.messages.raised[doubt as usize].open else { return };
        let since = self.out.moves.get(from.ix()).map(|motion| motion.line);
        let Some(stretch) = self.out.doubts.get_mut(open).filter(|stretch| from < stretch.from) else { return };
        stretch.from = from;
        if let Some(line) = since.filter(|_| !self.env.confirmed[0].contains(&doubt.name())) {
            let text =
                format!("what runs from line {line} on may run again because of it: no feed is raised there either");
            self.say("nc::runs-again", Severity::Warning, place, text, doubt.remedy());
        }
    }

    /// Where the tool stands is not known any more: no block is cut in pieces until each axis is commanded to an absolute position, because
    /// a piece would send it to a point on a path that it does not take.
    fn displace(&mut self, doubt: Doubt) {
        let displaced = doubt.displaces();
        if displaced != Displaced::No {
            self.place.displaced = [true; 3];
            self.block.splittable = false;
        }
        self.block.displaced |= displaced == Displaced::Behind;
    }

    /// Something that is not simulated may use the feed in force: another program, a code that is not known, a variable that reads it.
    pub(crate) fn uses_feed(&mut self) {
        let Some((first, _)) = self.linked_at() else { return };
        if self.modal.feed_mode == FeedMode::InverseTime {
            // Each block has its own.
            return;
        }
        let FeedWord { value, word, .. } = self.modal.feed;
        let block = BlockId(first + self.block.id.0);
        self.out.feed_uses.push(FeedUse { block, value, mode: self.modal.feed_mode, word });
    }

    /// The block cuts something that is not simulated: loads there are not known.
    pub(crate) fn cuts_unseen(&mut self) {
        let line = self.line_number();
        self.out.unseen_cuts.push(line);
    }

    /// Raises the doubt of a block that cannot be read: neither its effect nor the feed after it is known.
    pub(crate) fn doubt_of_unread(&mut self, place: Span) {
        self.doubt(Doubt::UnknownCode, place);
        let stretch =
            self.messages.raised[Doubt::UnknownCode as usize].open.and_then(|open| self.out.doubts.get_mut(open));
        if let (Some((first, _)), Some(stretch)) = (self.flow.linked_at(self.program), stretch) {
            stretch.unread.push(BlockId(first + self.block.id.0));
        }
    }

    /// Resolves a doubt: from the next move on it does not hold, unless there was a feed move meanwhile.
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

    /// Resolves a doubt about the spindle. It never concerned the position of the part, so feed moves meanwhile do not matter.
    pub(crate) fn spindle_is_known(&mut self, doubt: Doubt) {
        let Some(open) = self.messages.raised[doubt as usize].open.take() else { return };
        let next = self.next_move();
        if let Some(stretch) = self.out.doubts.get_mut(open) {
            stretch.until = Some(next);
        }
    }

    /// After the last block: puts the doubts in order, and adds to the diagnostic of each the number of places that raise it.
    pub(crate) fn count_doubts(&mut self) {
        self.out.doubts.sort_by_key(|doubted| doubted.from);
        for raised in self.messages.raised.iter().filter(|raised| raised.count > 1) {
            if let Some(diagnostic) = raised.diagnostic.and_then(|index| self.out.diagnostics.get_mut(index)) {
                diagnostic.text += &format!(" (the first of {} places)", raised.count);
            }
        }
    }
}
