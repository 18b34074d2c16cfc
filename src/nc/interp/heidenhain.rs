//! Heidenhain plain language: each block is put into the words of ISO and executed as such.
//!
//! `L` is G0 (FMAX) or G1, `CC` keeps a centre for `C`, `CR` is an arc with R, `R0 RL RR` are G40 G41 G42, an `I` before an
//! axis makes it incremental. CYCL DEF 200 and 203 drill where M99 or CYCL CALL stands; other cycles are kept.

use super::Run;
use super::cycles::Cycle;
use super::flow::After;
use super::line::Line;
use crate::diag::{Severity, Span};
use crate::ids::BlockId;
use crate::nc::expr::{self, Target};
use crate::nc::lex::{Token, TokenKind};
use crate::nc::toolpath::{Event, Freeze};

impl Run<'_> {
    /// Puts a block into ISO words.
    pub(super) fn heidenhain(&mut self, block: BlockId, line: &mut Line) -> After {
        let source = self.source.clone();
        let text = source.program().text();
        let skip =
            |kind| matches!(kind, TokenKind::Blank | TokenKind::LineEnd | TokenKind::Comment | TokenKind::Delete);
        let mut tokens: Vec<Token> = source.program().tokens(block).filter(|token| !skip(token.kind)).collect();
        if tokens.first().is_some_and(|token| token.kind == TokenKind::Word(b'N')) {
            tokens.remove(0);
        }
        let names: Vec<String> = tokens
            .iter()
            .filter(|token| token.kind == TokenKind::Name)
            .map(|token| String::from_utf8_lossy(token.span.of(text)).to_ascii_uppercase())
            .collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let place = tokens.first().map_or_else(|| source.program().span(block), |token| token.span);
        for token in tokens.iter().filter(|token| token.kind == TokenKind::Assignment) {
            self.q_assignment(*token, text);
        }
        let numbers: Vec<f64> = tokens.iter().filter(|t| t.kind == TokenKind::Expression).map(|t| t.number).collect();
        line.flow = false;
        match names.as_slice() {
            ["BEGIN", "PGM", ..] => {
                self.modal.inch = names.last() == Some(&"INCH");
                line.clear();
            }
            ["END", "PGM", ..] => self.ended = true,
            ["L", ..] => self.straight(&names, line, place),
            ["CC", ..] => self.pole(line),
            ["C" | "CR", ..] => self.circle(&names, line, place),
            ["TOOL", "CALL", ..] => tool_call(line, numbers.first().copied(), place),
            ["CALL", "LBL", ..] => self.call_label(&numbers, place),
            ["LBL"] if numbers.first() == Some(&0.0) => self.return_from_call(),
            ["STOP", ..] => self.event(Event::Stop { line: self.line_number(), end: false }),
            ["CYCL", "DEF", ..] => self.cycle_number = numbers.first().copied().unwrap_or(0.0) as u32,
            ["CYCL", "CALL", ..] => self.call_cycle(place),
            ["LBL" | "BLK" | "CYCL" | "FN", ..] | ["TOOL", "DEF", ..] => line.clear(),
            [] => {}
            [first, ..] => {
                let what = format!("{first} is not followed; the block is kept");
                self.not_understood("nc::not-understood", place, what, "");
                line.clear();
            }
        }
        if line.has_m(990) {
            line.m.retain(|m| m.0 != 990);
            self.call_after = true;
        }
        After::Words
    }

    fn q_assignment(&mut self, token: Token, text: &[u8]) {
        let bytes = token.span.of(text);
        let Some(equals) = bytes.iter().position(|&byte| byte == b'=') else { return };
        let index = String::from_utf8_lossy(&bytes[1..equals]).trim().parse().unwrap_or(0);
        match expr::evaluate(&bytes[equals + 1..], &self.parameters) {
            Ok(value) => self.assignments.push((Target::Number(index), value)),
            Err(error) => self.bad_expression(token.span, &error),
        }
        self.apply_assignments();
    }

    fn straight(&mut self, names: &[&str], line: &mut Line, place: Span) {
        self.radius_side(names, line, place);
        if line.has_any(b"XYZABC") {
            line.g.push((if names.contains(&"FMAX") { 0 } else { 10 }, place));
        }
    }

    /// `R0`, `RL`, `RR`; R0 reads as a word, the others as names.
    fn radius_side(&mut self, names: &[&str], line: &mut Line, place: Span) {
        let side = if names.contains(&"RL") {
            410
        } else if names.contains(&"RR") {
            420
        } else if line.get(b'R') == Some(0.0) {
            line.remove(b'R');
            400
        } else {
            return;
        };
        if side != self.compensation_side {
            self.compensation_side = side;
            line.g.push((side, place));
        }
    }

    fn pole(&mut self, line: &mut Line) {
        let unit = self.modal.unit_mm();
        for (axis, letter) in b"XYZ".iter().enumerate() {
            if let Some(value) = line.get(*letter) {
                let from = if line.is_incremental(*letter) { self.programmed[axis] } else { 0.0 };
                self.pole[axis] = from + value * unit;
            }
        }
        line.clear();
    }

    /// `C … DR±` about the pole, `CR … R DR±` by radius.
    fn circle(&mut self, names: &[&str], line: &mut Line, place: Span) {
        if names[0] == "C" {
            self.radius_side(names, line, place);
            let unit = self.modal.unit_mm();
            for (axis, letter) in b"IJK".iter().enumerate() {
                line.put(*letter, self.pole[axis] / unit, place, true);
                line.force(*letter, false);
            }
        }
        line.g.push((if names.contains(&"DR+") { 30 } else { 20 }, place));
    }

    /// `CALL LBL n REP k`: k further times.
    fn call_label(&mut self, numbers: &[f64], place: Span) {
        let label = numbers.first().copied().unwrap_or(0.0) as u32;
        let repeats = numbers.get(1).map(|count| count.clamp(0.0, 1e6) as u64);
        let labels = self.labels();
        let Some(&(_, start)) = labels.names.iter().find(|(name, _)| *name == format!("LBL {label}")) else {
            return self.no_routine(place, &format!("LBL {label}"));
        };
        match repeats {
            None => self.call_block(start as usize + 1, 1),
            Some(count) => {
                let key = (self.calls.len(), self.block.0);
                let known = self.repeats.iter().position(|repeat| (repeat.0, repeat.1) == key);
                let index = known.unwrap_or_else(|| {
                    self.repeats.push((key.0, key.1, count));
                    self.repeats.len() - 1
                });
                if self.repeats[index].2 == 0 {
                    self.repeats.remove(index);
                } else {
                    self.repeats[index].2 -= 1;
                    self.jump(start as usize + 1);
                }
            }
        }
    }

    /// The cycle defined last, where the tool is.
    pub(super) fn call_cycle(&mut self, place: Span) {
        if !matches!(self.cycle_number, 200 | 201 | 203) {
            let text = format!("cycle {} is kept, not simulated", self.cycle_number);
            return self.say(
                "nc::cycle",
                Severity::Warning,
                place,
                text,
                "what it cuts is not known to the simulation",
            );
        }
        let unit = self.modal.unit_mm();
        let q = |index: u32| self.parameters.number(index) * unit;
        let (surface, clearance) = (q(203), q(200));
        let cycle = Cycle {
            initial: surface + q(204).max(clearance),
            depth: Some(surface + q(201)),
            peck: Some(q(202)),
            dwell_s: self.parameters.number(211),
            ..Cycle::default()
        };
        let feed = self.modal.feed;
        self.modal.feed.value = q(206);
        (self.modal.feed.word, self.modal.feed.computed) = (None, true);
        let before = (self.freeze, self.splittable);
        self.freeze = Some(Freeze::Cycle);
        self.splittable = false;
        let code = if self.cycle_number == 201 { 850 } else { 830 };
        self.one_hole(cycle, code, self.programmed, surface + clearance);
        (self.freeze, self.splittable) = before;
        self.modal.feed = feed;
    }
}

fn tool_call(line: &mut Line, number: Option<f64>, place: Span) {
    line.remove(b'R');
    if let Some(number) = number {
        line.put(b'T', number, place, false);
        line.m.push((60, place));
    }
}
