//! The length offset in force: H with G43 and G44, G49, the D of a Siemens. In: the words of a block. Out: a doubt where a feed move is made
//! under another offset than the first one that the tool had since it came in, whose length the setup is taken to describe.

use super::interpreter::{Family, Interpreter};
use super::state::Length;
use super::words::Words;
use crate::diag::Span;
use crate::nc::doubt::Doubt;

impl<F: Family> Interpreter<'_, F> {
    /// G43 and G44 with H, G49 (code times ten).
    pub(crate) fn length_by_code(&mut self, code: u16, words: &Words) {
        let number = words.get(b'H').map(|h| h.max(0.0) as u32);
        match (code, number) {
            (430, Some(number)) => self.select_length(number),
            // Without H it is the offset of the tool, or the one before.
            (430, None) if self.tool_length.now == Length::Other => self.tool_length.now = self.tool_length.first,
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
    }

    /// The program writes the length of an offset (G10 L1, L10, L11; a variable of the control), which may be the one in force.
    pub(crate) fn length_is_written(&mut self, number: Option<u32>) {
        let in_force = |number: u32| self.tool_length.now == Length::Number(number);
        if self.tool_length.first != Length::Unsaid && number.is_none_or(in_force) {
            self.tool_length.now = Length::Other;
        }
    }

    /// Before a motion at a feed.
    pub(crate) fn length_in_use(&mut self, place: Span) {
        if self.tool_length.now != self.tool_length.first {
            self.doubt(Doubt::ToolLength, place);
        }
    }
}
