//! Calls of Siemens 840D: subprograms with arguments, MCALL, the drilling cycles and hole patterns. In: the name and the
//! arguments. Out: the routine entered, or the motions the cycle makes; other cycles are kept, and said.

use super::frames::ENDS_LOST_FRAME;
use super::state::ModalCall;
use super::state::Siemens;
use super::structures::name;
use super::ways::RUNS_ANYTHING;
use crate::diag::{Severity, Span};
use crate::ids::MoveId;
use crate::nc::doubt::Doubt;
use crate::nc::interp::interpreter::Interpreter;
use crate::nc::interp::state::Cycle;
use crate::nc::interp::words::Words;
use crate::nc::token::{Token, TokenKind};
use crate::nc::toolpath::Freeze;

/// Calls that move nothing here.
const WITHOUT_EFFECT: [&str; 7] = ["MSG", "SETAL", "G4", "WORKPIECE", "CYCLE832", "STOPRE", "ORISOF"];

/// Beginnings of the names of the control's own cycles: they cut and come back, and leave frame and feed as they were. Those
/// that measure (CYCLE97x) set offsets.
const OWN_CYCLES: [&str; 5] = ["CYCLE", "POCKET", "SLOT", "LONGHOLE", "HOLES"];

impl Interpreter<'_, Siemens> {
    /// Name and arguments of `NAME(a, b, , c)`.
    pub(crate) fn call_parts(&mut self, place: Span, bytes: &[u8]) -> (String, Vec<Option<f64>>) {
        let open = bytes.iter().position(|&byte| byte == b'(').unwrap_or(bytes.len());
        let name = String::from_utf8_lossy(&bytes[..open]).to_ascii_uppercase();
        let inner = bytes.get(open + 1..bytes.len().saturating_sub(1)).unwrap_or_default();
        let mut depth = 0;
        let parts = inner.split(|&byte| {
            depth += i32::from(byte == b'(') - i32::from(byte == b')');
            byte == b',' && depth == 0
        });
        let arguments = parts.map(|part| self.evaluate(place, part, 0).ok()).collect();
        (name, arguments)
    }

    pub(crate) fn siemens_call(
        &mut self,
        name: &str,
        arguments: Vec<Option<f64>>,
        modal: bool,
        span: Span,
        words: &mut Words,
    ) {
        match name {
            _ if WITHOUT_EFFECT.contains(&name) => {}
            "SETMS" if arguments.iter().all(|spindle| spindle.is_none_or(|number| number == 1.0)) => {}
            "FGROUP" => self.feed_group(span),
            "CYCLE800" if arguments.iter().all(|value| value.unwrap_or(0.0) == 0.0) => self.regain_frame(),
            "CYCLE800" | "TRAORI" => self.lose_frame(span, name, ENDS_LOST_FRAME),
            "HOLES1" | "HOLES2" => self.hole_pattern(name, &arguments),
            _ if modal => {
                if drilling_code(name).is_none() {
                    self.doubt_of_foreign(name, span);
                    self.cuts_unseen();
                    let text = format!("the modal call of {name} is kept, not simulated");
                    self.say("nc::modal-call", Severity::Warning, span, text, "feeds are kept up to the next MCALL");
                }
                self.family.modal_call = Some(ModalCall { name: name.to_owned(), arguments });
            }
            _ if drilling_code(name).is_some() => {
                words.any = true;
                self.drilling_cycle(&ModalCall { name: name.to_owned(), arguments });
            }
            _ => {
                if self.call_siemens(name, repeats(words), arguments) {
                    words.called.push(span);
                } else {
                    self.doubt_of_foreign(name, span);
                    self.keep_cycle(name, span);
                }
            }
        }
    }

    /// FGROUP(X,Y): F is the feed of these axes, and the tool is faster where others move with them. Without axes it is that of the path.
    fn feed_group(&mut self, place: Span) {
        let source = self.flow.source.clone();
        let text = String::from_utf8_lossy(place.of(source.program().text())).to_ascii_uppercase();
        let axes = text.split(['(', ')']).nth(1).unwrap_or_default();
        let named = |axis: &str| axes.split(',').any(|name| name.trim() == axis);
        if !axes.trim().is_empty() && !["X", "Y", "Z"].into_iter().all(named) {
            self.doubt(Doubt::UnknownCode, place);
            let text = "F is the feed of some axes only";
            self.say("nc::feed-group", Severity::Warning, place, text, "FGROUP() makes it that of the path again");
        }
    }

    /// A call that is not followed: anything may be in a program that is not there, and a cycle that measures sets offsets.
    fn doubt_of_foreign(&mut self, name: &str, place: Span) {
        if !OWN_CYCLES.iter().any(|cycle| name.starts_with(cycle)) {
            self.doubt(Doubt::MissingProgram, place);
            if RUNS_ANYTHING.contains(&name) {
                self.doubt_since(Doubt::MissingProgram, MoveId(0), place);
            }
        } else if name.starts_with("CYCLE97") {
            self.doubt(Doubt::Probe, place);
        }
    }

    /// A cycle that is not simulated. It may drill at the feed in force, and so may the one that MCALL has called for its positions.
    fn keep_cycle(&mut self, name: &str, place: Span) {
        self.uses_feed();
        // A measuring cycle cuts nothing; what a program does that is not there is a doubt.
        if OWN_CYCLES.iter().any(|cycle| name.starts_with(cycle)) && !name.starts_with("CYCLE97") {
            self.cuts_unseen();
        }
        let text = format!("{name} is kept, not simulated");
        self.say("nc::cycle", Severity::Warning, place, text, "what it cuts is not known to the simulation");
    }

    /// Calls a subprogram; R parameters are those of the caller, other variables its own.
    pub(crate) fn call_siemens(&mut self, name: &str, times: u64, arguments: Vec<Option<f64>>) -> bool {
        let found = self.call_by_name(name, times, None);
        if found {
            self.family.passed = arguments;
        }
        found
    }

    /// `PROC NAME(REAL A, INT B=5)`: the arguments of the call by the names they have here.
    ///
    /// SAVE: at its end the modes and the frame of the caller are in force again (840D sl Function Manual K2, subroutine with SAVE).
    pub(crate) fn procedure(&mut self, tokens: &[Token], text: &[u8]) {
        let saves = |token: &Token| token.kind == TokenKind::Name && token.span.of(text).eq_ignore_ascii_case(b"SAVE");
        if tokens.iter().any(saves)
            && let Some(call) = self.flow.calls.last_mut()
        {
            let state = || Box::new((self.modal, self.frame.clone()));
            call.restores.get_or_insert_with(state);
        }
        let passed = std::mem::take(&mut self.family.passed);
        let Some(head) = tokens.iter().find(|token| token.kind == TokenKind::Call) else { return };
        let bytes = head.span.of(text);
        let open = name(head, text).len() + 1;
        let inner = bytes.get(open..bytes.len().saturating_sub(1)).unwrap_or_default();
        for (index, part) in inner.split(|&byte| byte == b',').enumerate() {
            let part = String::from_utf8_lossy(part).to_ascii_uppercase();
            let (left, default) = part.split_once('=').map_or((part.as_str(), None), |(l, r)| (l, Some(r)));
            let Some(variable) = left.split_whitespace().last() else { continue };
            let default = default.and_then(|text| self.evaluate(head.span, text.trim().as_bytes(), 0).ok());
            let value = passed.get(index).copied().flatten().or(default).unwrap_or(0.0);
            self.type_variable(variable, left.split_whitespace().any(|word| word == "INT"));
            self.set_variable(variable, value);
            self.family.defined.insert(variable.to_owned());
            if left.split_whitespace().next() == Some("VAR") {
                let said = format!("{variable} is not handed back to the caller");
                self.not_understood("nc::not-understood", head.span, said, "");
            }
        }
    }

    /// Why the motions of a block under MCALL keep their feed.
    pub(crate) fn modal_call_kept(&self) -> bool {
        self.family.modal_call.as_ref().is_some_and(|call| drilling_code(&call.name).is_none())
    }

    /// After a block that positions: the cycle MCALL put in force.
    pub(crate) fn modal_cycle(&mut self, words: &Words) {
        if words.has_any(b"XY")
            && let Some(call) = self.family.modal_call.clone()
        {
            self.drilling_cycle(&call);
        }
    }

    /// HOLES1 (row: X, Y, angle, distance to the first, spacing, number), HOLES2 (circle: X, Y, radius, angle, step, number).
    fn hole_pattern(&mut self, name: &str, arguments: &[Option<f64>]) {
        let Some(call) = self.family.modal_call.clone() else { return };
        let value = |index: usize| arguments.get(index).copied().flatten().unwrap_or(0.0);
        let count = value(5).clamp(0.0, 1000.0) as u32;
        let unit = self.modal.unit_mm();
        for k in 0..count {
            let k = f64::from(k);
            let (radius, angle) = if name == "HOLES1" {
                (value(3) + k * value(4), value(2))
            } else {
                let step = if value(4) == 0.0 { 360.0 / f64::from(count) } else { value(4) };
                (value(2), value(3) + k * step)
            };
            let mut at = self.place.programmed;
            at.x = (value(0) + radius * angle.to_radians().cos()) * unit;
            at.y = (value(1) + radius * angle.to_radians().sin()) * unit;
            self.line_to(crate::nc::toolpath::MoveKind::Rapid, at);
            self.drilling_cycle(&call);
        }
    }

    /// CYCLE81 … CYCLE89: retract plane, reference plane, safety distance, depth (absolute, or relative to the reference).
    fn drilling_cycle(&mut self, call: &ModalCall) {
        let value = |index: usize| call.arguments.get(index).copied().flatten();
        if let (Some(absolute), Some(relative), Some(reference)) = (value(3), value(4).filter(|d| *d != 0.0), value(1))
            && (absolute - (reference - relative.abs())).abs() > 1e-6
        {
            // DPR counts where both are given, by some manuals.
            self.doubt(Doubt::UnknownValue, self.flow.source.program().span(self.block.id));
        }
        let depth = value(3).or(value(1).zip(value(4)).map(|(reference, relative)| reference - relative.abs()));
        let place = self.flow.source.program().span(self.block.id);
        let (Some(code), Some(retract), Some(reference), Some(depth)) =
            (drilling_code(&call.name), value(0), value(1), depth)
        else {
            return self.keep_cycle(&call.name, place);
        };
        let unit = self.modal.unit_mm();
        let chip_break = call.name == "CYCLE83" && value(11).unwrap_or(0.0) == 0.0;
        let first = value(5).map(|d| (reference - d).abs()).or(value(6));
        let cycle = Cycle {
            initial: retract * unit,
            depth: Some(depth * unit),
            peck: first.map(|d| d * unit),
            dwell_s: if code == 820 { value(5).unwrap_or(0.0).max(0.0) } else { 0.0 },
            ..Cycle::default()
        };
        let before = (self.block.freeze, self.block.splittable, self.modal.retract_to_r, self.modal.incremental);
        self.block.freeze = self.block.freeze.or(match code {
            840 => Some(Freeze::Synchronised),
            810..=830 => None,
            _ => Some(Freeze::Cycle),
        });
        self.block.splittable = false;
        (self.modal.retract_to_r, self.modal.incremental) = (false, false);
        let level = (reference + value(2).unwrap_or(0.0)) * unit;
        self.one_hole(cycle, if chip_break { 730 } else { code }, self.place.programmed, level);
        (self.block.freeze, self.block.splittable, self.modal.retract_to_r, self.modal.incremental) = before;
    }
}

/// P beside the name of a subprogram.
pub(crate) fn repeats(words: &Words) -> u64 {
    words.get(b'P').unwrap_or(1.0).clamp(0.0, 1e9) as u64
}

fn drilling_code(name: &str) -> Option<u16> {
    let number = match name {
        "CYCLE840" => 84,
        _ => name.strip_prefix("CYCLE")?.parse::<u16>().ok()?,
    };
    (81..=89).contains(&number).then_some(number * 10)
}
