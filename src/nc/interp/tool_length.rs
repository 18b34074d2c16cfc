//! The length offset in force: H with G43 and G44, G49, the D of a Siemens. In: the words of a block. Out: a doubt where a feed move is made
//! under another offset than the first one that the tool had since it came in, whose length the setup is taken to describe; under the number of
//! another tool; or under none, where an earlier tool had one (a G43 that was forgotten: the length of that tool stays in force).

use super::interpreter::{Family, Interpreter};
use super::state::{Length, ToolLength};
use super::words::Words;
use crate::diag::Span;
use crate::nc::doubt::Doubt;

impl ToolLength {
    /// A tool is in the spindle. Where it is the one whose length is in force, that stays.
    pub fn comes_in(&mut self, tool: u32) {
        let same = matches!(self.now, Length::Number(number) if self.taken.contains(&(number, tool)));
        if !same {
            (self.first, self.now) = (Length::Unsaid, Length::Unsaid);
        }
    }

    /// The tool takes the length with this number. True where another tool had it.
    fn take(&mut self, number: u32, tool: u32) -> bool {
        let known = self.taken.iter().find(|(of, _)| *of == number);
        let anothers = known.is_some_and(|(_, other)| *other != tool && *other != 0);
        if known.is_none() {
            self.taken.push((number, tool));
        }
        anothers
    }
}

impl<F: Family> Interpreter<'_, F> {
    /// G43 and G44 with H, G49 (code times ten).
    pub(crate) fn length_by_code(&mut self, code: u16, words: &Words) {
        let number = words.get(b'H').map(|h| h.max(0.0) as u32);
        match (code, number) {
            (430, Some(number)) => self.select_length(number),
            // Without H it is the offset of the tool, or the one before.
            (430, None) if self.tool_length.now == Length::Other => self.tool_length.now = self.tool_length.first,
            (430, None) if self.tool_length.first == Length::Unsaid => self.select_length(self.modal.tool),
            (430, None) => {}
            (440, _) => self.tool_length.now = Length::Other,
            _ if self.tool_length.first != Length::Unsaid => self.tool_length.now = Length::Other,
            _ => {}
        }
    }

    /// An H alone while an offset is in force; on a Siemens D.
    pub(crate) fn length_by_word(&mut self, words: &Words) {
        let letter = if F::EDGES_BY_D { b'D' } else { b'H' };
        let alone = words.g.iter().all(|(code, _)| matches!(code, 0 | 10 | 20 | 30 | 400 | 410 | 420 | 900 | 910));
        let in_force = F::EDGES_BY_D || self.tool_length.first != Length::Unsaid;
        if let Some(number) = words.get(letter).filter(|_| in_force && (alone || F::EDGES_BY_D)) {
            self.select_length(number.max(0.0) as u32);
        }
    }

    /// The offset with a number; 0 is none.
    fn select_length(&mut self, number: u32) {
        let chosen = if number == 0 { Length::Other } else { Length::Number(number) };
        if self.tool_length.first == Length::Unsaid && number == 0 {
            if F::EDGES_BY_D {
                // The first edge comes in with the tool.
                (self.tool_length.first, self.tool_length.now) = (Length::Number(1), Length::Other);
            }
            return;
        }
        if self.tool_length.first == Length::Unsaid {
            self.tool_length.first = chosen;
        }
        self.tool_length.now = chosen;
        let rewritten = self.tool_length.rewritten.contains(&number);
        if number > 0 && !F::EDGES_BY_D && (self.tool_length.take(number, self.modal.tool) || rewritten) {
            self.tool_length.now = Length::Other;
        }
    }

    /// The program writes the length of an offset (G10 L1, L10, L11; a variable of the control; `None`: of which one is not known). It may be the one
    /// in force; one that a tool had before is another length when it is taken again.
    pub(crate) fn length_is_written(&mut self, number: Option<u32>) {
        let taken = self.tool_length.taken.iter().map(|(taken, _)| *taken);
        self.tool_length.rewritten.extend(taken.filter(|taken| number.is_none_or(|number| number == *taken)));
        let in_force = |number: u32| self.tool_length.now == Length::Number(number);
        if self.tool_length.first != Length::Unsaid && number.is_none_or(in_force) {
            self.tool_length.now = Length::Other;
        }
    }

    /// Before a motion at a feed.
    pub(crate) fn length_in_use(&mut self, place: Span) {
        if F::EDGES_BY_D && self.tool_length.first == Length::Unsaid {
            // A tool comes in with its first edge.
            (self.tool_length.first, self.tool_length.now) = (Length::Number(1), Length::Number(1));
        }
        let forgotten = self.tool_length.first == Length::Unsaid && !self.tool_length.taken.is_empty();
        if self.tool_length.now != self.tool_length.first || forgotten && !F::EDGES_BY_D {
            self.doubt(Doubt::ToolLength, place);
        }
    }
}
