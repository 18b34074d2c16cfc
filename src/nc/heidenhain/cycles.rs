//! Cycles of Heidenhain plain language. In: `CYCL DEF`, `CYCL CALL` and M99. Out: changes of the frame, dwells, motions. Cycles 7 (datum
//! shift), 8 (mirror), 9 (dwell), 10 (rotation) and 11 (scaling) act where they are defined; the drilling cycles 200, 201, 203 where they
//! are called. All others are left as they are, with a diagnostic.

use super::blocks::LostFrame;
use super::state::Heidenhain;
use crate::diag::{Severity, Span};
use crate::ids::BlockId;
use crate::nc::doubt::Doubt;
use crate::nc::interp::interpreter::Interpreter;
use crate::nc::interp::state::Cycle;
use crate::nc::interp::words::Words;
use crate::nc::token::{Token, TokenKind};
use crate::nc::toolpath::{Event, Freeze};
use crate::path::Vec3;

/// Cycles that put something in force that is not followed: patterns, axis factors.
const LOST: [u32; 4] = [26, 220, 221, 224];

impl Interpreter<'_, Heidenhain> {
    /// `CYCL DEF n.k`: number and part, and what acts at once.
    pub(crate) fn define_cycle(&mut self, block: BlockId, tokens: &[Token], text: &[u8], words: &Words, place: Span) {
        let mut numbers = tokens.iter().filter(|token| token.kind == TokenKind::Expression);
        let Some(first) = numbers.next() else { return };
        let whole = first.number as u32;
        let named = first.span.of(text).iter().position(|&byte| byte == b'.');
        let part = named.map_or(0, |at| first.span.of(text)[at + 1..].first().map_or(0, |digit| digit - b'0'));
        let name = |word: &str| tokens.iter().any(|t| t.span.of(text).eq_ignore_ascii_case(word.as_bytes()));
        let value = numbers.next().map(|token| token.number);
        let axis_words = [b'X', b'Y', b'Z'].map(|letter| words.get(letter).map(|value| (letter, value)));
        match (whole, part) {
            (7 | 8 | 10 | 11 | 19, 0) => {
                if !self.goes_on(block, whole) {
                    let what = format!("cycle {whole} lacks its part {whole}.1; the block is kept");
                    self.misread("nc::cycle", place, what, "write the part, or take the cycle out");
                }
                return;
            }
            (19, _) => {
                let tilted =
                    words.has_any(b"ABC") && b"ABC".iter().any(|axis| words.get(*axis).is_some_and(|at| at != 0.0));
                return self.set_lost_frame(LostFrame::Cycle19, tilted, place);
            }
            (7, _) => {
                if name("#") {
                    // A line of a table that only the control has.
                    self.doubt(Doubt::ZeroShift, place);
                }
                if !self.frame.is_plain() && axis_words.iter().flatten().any(|(_, value)| *value != 0.0) {
                    self.built_up(place);
                }
                for (axis, word) in axis_words.into_iter().enumerate() {
                    let Some((letter, value)) = word else { continue };
                    let before = if words.is_incremental(letter) { self.frame.local[axis] } else { 0.0 };
                    self.frame.local[axis] = before + value * self.modal.unit_mm();
                }
            }
            (8, _) => {
                let mirrored = |axis: usize| tokens.iter().any(|t| is_axis(t, text, b"XYZ"[axis]));
                let size = self.factors().abs();
                self.stretch_by(Vec3::from_fn(|axis, _| if mirrored(axis) { -size[axis] } else { size[axis] }));
            }
            (10, _) if self.factors().min() < 0.0 && value.is_some_and(|angle| angle != 0.0) => self.built_up(place),
            (10, _) => {
                let before = self.frame.rotation.map_or(0.0, |(_, _, angle)| if name("IROT") { angle } else { 0.0 });
                let angle = before + value.unwrap_or(0.0).to_radians();
                self.frame.rotation = (angle != 0.0).then_some((self.modal.plane, Vec3::zeros(), angle));
            }
            (11, _) => {
                let factor = value.filter(|factor| *factor > 0.0).unwrap_or(1.0);
                self.stretch_by(self.factors().map(|before| factor * before.signum()));
            }
            (9, 1..) => {
                let seconds = value.unwrap_or(0.0).max(0.0);
                return self.event(Event::Dwell { seconds, line: self.line_number() });
            }
            _ if LOST.contains(&whole) && part == 0 => {
                self.frame.lost = true;
                self.doubt(Doubt::TiltedFrame, place);
                let text = format!("cycle {whole} is not followed: feeds are kept from here on");
                return self.say(
                    "nc::cycle",
                    Severity::Warning,
                    place,
                    text,
                    "give the part after it as its own program",
                );
            }
            _ => {
                if part == 0 {
                    self.family.cycle_number = whole;
                    // Parameters of the same line were set before it was known whose they are.
                    let own = tokens.iter().filter(|token| token.kind == TokenKind::Assignment);
                    let starts = |token: &Token| token.span.of(text).to_ascii_uppercase().starts_with(b"Q339");
                    if { own }.any(starts) {
                        self.preset(339, self.parameters.number(339), place);
                    }
                }
                return;
            }
        }
        self.reframe();
    }

    /// Shifts, mirrors and turns that build up on one another in an order other than shift, turn, mirror or scale are not followed (TNC 620, User's
    /// Manual Setup, Working plane coordinate system: the result depends on the sequence).
    fn built_up(&mut self, place: Span) {
        self.doubt(Doubt::ZeroShift, place);
        let text = "a shift, turn, mirror or scale upon another is not followed in this order";
        self.say(
            "nc::frame",
            Severity::Warning,
            place,
            text,
            "write the shift first, then the turn, then mirror and scale",
        );
    }

    /// The factors of the axes that mirror (8) and scaling (11) have put in force.
    fn factors(&self) -> Vec3 {
        self.frame.scale.map_or(Vec3::repeat(1.0), |(_, factor)| factor)
    }

    fn stretch_by(&mut self, factor: Vec3) {
        self.frame.scale = (factor != Vec3::repeat(1.0)).then_some((Vec3::zeros(), factor));
    }

    /// Does the next line that says something define a part of this cycle?
    fn goes_on(&self, block: BlockId, cycle: u32) -> bool {
        let source = self.flow.source.clone();
        let program = source.program();
        let after = (block.0 + 1..program.len() as u32).map(|next| program.line_text(BlockId(next)));
        let mut said = after.map(|line| String::from_utf8_lossy(line).trim().to_ascii_uppercase());
        let next = said.find(|line| !line.is_empty() && !line.starts_with(';')).unwrap_or_default();
        let words = next.trim_start_matches(|letter: char| letter.is_ascii_digit()).trim_start();
        words.strip_prefix("CYCL DEF").is_some_and(|part| part.trim_start().starts_with(&format!("{cycle}.")))
    }

    /// The cycle defined last, where the tool is.
    pub(crate) fn call_cycle(&mut self, place: Span) {
        if !matches!(self.family.cycle_number, 200 | 201 | 203) {
            let text = format!("cycle {} is kept, not simulated", self.family.cycle_number);
            let help = "what it cuts is not known to the simulation";
            self.cuts_unseen();
            // From 200 on cycles have feeds of their own.
            if self.family.cycle_number < 200 {
                self.uses_feed();
            }
            if self.family.cycle_number == 12 {
                // It calls a program.
                self.doubt(Doubt::MissingProgram, place);
            }
            return self.say("nc::cycle", Severity::Warning, place, text, help);
        }
        let unknown = [200, 201, 202, 203, 204, 206].into_iter().find(|index| self.parameters.known(*index).is_none());
        // Reaming (201) has no depth of a peck.
        let unknown = unknown.filter(|index| *index != 202 || self.family.cycle_number != 201);
        if let Some(index) = unknown {
            self.cuts_unseen();
            let text = format!(
                "cycle {} is kept, not simulated: the program does not tell Q{index}",
                self.family.cycle_number
            );
            return self.not_understood("nc::cycle", place, text, "write its number, or F in the tool call for AUTO");
        }
        let unit = self.modal.unit_mm();
        let q = |index: u32| self.parameters.number(index) * unit;
        let (surface, clearance) = (q(203), q(200));
        let cycle = Cycle {
            initial: surface + q(204).max(clearance),
            depth: Some(surface + q(201)),
            peck: Some(q(202)),
            dwell_s: self.parameters.known(211).unwrap_or(0.0),
            ..Cycle::default()
        };
        let feed = self.modal.feed;
        self.modal.feed.value = self.parameters.number(206) * self.feed_unit_mm();
        (self.modal.feed.word, self.modal.feed.computed) = (None, true);
        let before = (self.block.freeze, self.block.splittable);
        self.block.freeze = Some(Freeze::Cycle);
        self.block.splittable = false;
        let code = if self.family.cycle_number == 201 { 850 } else { 830 };
        self.one_hole(cycle, code, self.place.programmed, surface + clearance);
        (self.block.freeze, self.block.splittable) = before;
        self.modal.feed = feed;
    }
}

/// An axis letter alone, as the mirror cycle has it.
fn is_axis(token: &Token, text: &[u8], letter: u8) -> bool {
    matches!(token.kind, TokenKind::Name | TokenKind::Bad) && token.span.of(text).eq_ignore_ascii_case(&[letter])
}
