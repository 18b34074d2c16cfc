//! Siemens 840D beyond what it shares with ISO: names, calls, labels, frames, and the drilling cycles.

use super::Run;
use super::corner::Corner;
use super::cycles::Cycle;
use super::flow::After;
use super::line::Line;
use super::siemens_flow::structure_word;
use crate::diag::{Severity, Span};
use crate::ids::BlockId;
use crate::nc::expr;
use crate::nc::lex::{Token, TokenKind};
use crate::nc::toolpath::{Freeze, PathMode};

/// A cycle that MCALL repeats at every position.
#[derive(Debug, Clone)]
pub(super) struct ModalCall {
    name: String,
    arguments: Vec<Option<f64>>,
}

/// Names that change nothing the toolpath shows.
const QUIET: [&str; 22] = [
    "SOFT",
    "BRISK",
    "DRIVE",
    "FFWON",
    "FFWOF",
    "COMPOF",
    "COMPON",
    "COMPCAD",
    "CFC",
    "CFTCP",
    "CFIN",
    "DIAMOF",
    "NORM",
    "STOPRE",
    "WORKPIECE",
    "FGROUP",
    "EXTERN",
    "PROC",
    "DISPLOF",
    "SAVE",
    "SUPA",
    "UPATH",
];

impl Run<'_> {
    /// Names, calls, labels and assignments of a block.
    pub(super) fn siemens(&mut self, block: BlockId, line: &mut Line) -> After {
        let source = self.source.clone();
        let text = source.program().text();
        let skip = |kind| matches!(kind, TokenKind::Blank | TokenKind::LineEnd | TokenKind::Comment | TokenKind::Label);
        let tokens: Vec<Token> = source.program().tokens(block).filter(|token| !skip(token.kind)).collect();
        let start = tokens.iter().position(|token| token.kind != TokenKind::Word(b'N')).unwrap_or(0);
        if let Some(word) = structure_word(&tokens[start..], text) {
            self.structure(&word, block, &tokens[start..], text, line);
            return After::Done;
        }
        let mut modal = false;
        let mut curve = None;
        for (index, token) in tokens.iter().enumerate() {
            let bytes = token.span.of(text);
            match token.kind {
                TokenKind::Percent => return After::Done,
                TokenKind::Assignment => self.siemens_assignment(*token, bytes, line),
                TokenKind::Call => {
                    let (name, arguments) = self.call_parts(bytes);
                    if name == "IF" {
                        self.siemens_jump(&tokens[index..], text);
                        return After::Done;
                    }
                    self.siemens_call(&name, arguments, modal, token.span, line);
                }
                TokenKind::Name => {
                    let name = String::from_utf8_lossy(bytes).to_ascii_uppercase();
                    match name.as_str() {
                        "MCALL" => {
                            modal = true;
                            self.modal_call = None;
                        }
                        "IF" | "GOTOF" | "GOTOB" | "GOTO" => {
                            self.siemens_jump(&tokens[index..], text);
                            return After::Done;
                        }
                        "CIP" | "CT" => curve = Some((name, token.span)),
                        "CASE" => {
                            self.not_understood("nc::not-understood", token.span, "CASE is not followed", "");
                            return After::Done;
                        }
                        _ if self.frame_word(&name, token.span, &tokens[index..], text, line) => return After::Done,
                        "RET" => self.siemens_return(),
                        "DEF" => {}
                        "REAL" | "INT" | "BOOL" | "AXIS" | "CHAR" | "STRING" => self.define(&tokens[index + 1..], text),
                        _ if QUIET.contains(&name.as_str()) => {}
                        _ if self.call_by_name(&name, repeats(line), None) => {}
                        _ => self.not_understood(
                            "nc::not-understood",
                            token.span,
                            format!("{name} is not known here"),
                            "",
                        ),
                    }
                }
                _ => {}
            }
        }
        let through = std::mem::take(&mut self.through);
        match curve {
            Some((word, place)) if word == "CT" => self.tangential_arc(line, place),
            Some((_, place)) => self.arc_through(line, through, place),
            None => {}
        }
        if let (Some(number), Some(place)) = (line.get(b'L'), line.span(b'L')) {
            let name = format!("L{number}");
            if !self.call_by_name(&name, repeats(line), None) {
                self.no_routine(place, &name);
            }
        }
        if line.has_m(170) {
            self.siemens_return();
        }
        After::Words
    }

    fn siemens_return(&mut self) {
        if self.calls.is_empty() {
            self.ended = true;
        } else {
            self.return_from_call();
        }
    }

    /// `DEF REAL A, B`: names without a value begin at zero.
    fn define(&mut self, tokens: &[Token], text: &[u8]) {
        for token in tokens.iter().filter(|token| token.kind == TokenKind::Name) {
            let name = String::from_utf8_lossy(token.span.of(text)).into_owned();
            self.parameters.set_name(&name, 0.0);
        }
    }

    pub(super) fn siemens_assignment(&mut self, token: Token, bytes: &[u8], line: &mut Line) {
        let Some(equals) = bytes.iter().position(|&byte| byte == b'=') else { return };
        let name = String::from_utf8_lossy(&bytes[..equals]).trim().to_ascii_uppercase();
        let value = match expr::evaluate(&bytes[equals + 1..], &self.parameters) {
            Ok(value) => value,
            Err(error) => return self.bad_expression(token.span, &error),
        };
        let number = name[1..].parse::<u32>().ok();
        match (name.as_str(), number) {
            ("CR", _) => line.put(b'R', value, token.span, true),
            ("TURN", _) => line.put(b'P', value + 1.0, token.span, true),
            ("RND", _) => self.corner_after(Corner::Round(value * self.modal.unit_mm()), token.span),
            ("CHF", _) => self.corner_after(Corner::Chamfer(value * self.modal.unit_mm()), token.span),
            ("CHR", _) => self.corner_after(Corner::Legs(value * self.modal.unit_mm()), token.span),
            ("I1" | "J1" | "K1", _) => {
                self.through[usize::from(name.as_bytes()[0] - b'I')] = Some(value * self.modal.unit_mm());
            }
            ("RNDM" | "AR" | "AP" | "RP" | "ANG", _) => {
                let text = format!("{name} is not followed: the block is read without it");
                self.not_understood("nc::not-understood", token.span, text, "");
            }
            (_, Some(1)) if name.starts_with('S') => line.put(b'S', value, token.span, true),
            (_, Some(1)) if name.starts_with('M') => line.put(b'M', value, token.span, true),
            _ => self.set_variable(&name, value),
        }
    }

    /// Sets `R12` or a variable by its name.
    pub(super) fn set_variable(&mut self, name: &str, value: f64) {
        match name.strip_prefix('R').and_then(|number| number.parse().ok()) {
            Some(index) => {
                self.parameters.numbered.insert(index, value);
            }
            None => self.parameters.set_name(name, value),
        }
    }

    /// A corner between this block and the next.
    fn corner_after(&mut self, corner: Corner, place: Span) {
        self.splittable = false;
        self.next_corner = Some((corner, place));
    }

    /// Name and arguments of `NAME(a, b, , c)`.
    fn call_parts(&mut self, bytes: &[u8]) -> (String, Vec<Option<f64>>) {
        let open = bytes.iter().position(|&byte| byte == b'(').unwrap_or(bytes.len());
        let name = String::from_utf8_lossy(&bytes[..open]).to_ascii_uppercase();
        let inner = bytes.get(open + 1..bytes.len().saturating_sub(1)).unwrap_or_default();
        let mut depth = 0;
        let parts = inner.split(|&byte| {
            depth += i32::from(byte == b'(') - i32::from(byte == b')');
            byte == b',' && depth == 0
        });
        let arguments = parts.map(|part| expr::evaluate(part, &self.parameters).ok()).collect();
        (name, arguments)
    }

    fn siemens_call(&mut self, name: &str, arguments: Vec<Option<f64>>, modal: bool, span: Span, line: &mut Line) {
        match name {
            "MSG" | "SETAL" | "G4" => {}
            "HOLES1" | "HOLES2" => self.hole_pattern(name, &arguments),
            _ if modal => self.modal_call = Some(ModalCall { name: name.to_owned(), arguments }),
            _ if drilling_code(name).is_some() => {
                line.any = true;
                self.drilling_cycle(&ModalCall { name: name.to_owned(), arguments });
            }
            _ => {
                let values = (1..).zip(arguments.into_iter().map(Option::unwrap_or_default)).collect();
                if !self.call_by_name(name, 1, Some(values)) {
                    let text = format!("{name} is kept, not simulated");
                    self.say("nc::cycle", Severity::Warning, span, text, "what it cuts is not known to the simulation");
                }
            }
        }
    }

    /// After a block that positions: the cycle MCALL put in force.
    pub(super) fn modal_cycle(&mut self, line: &Line) {
        if line.has_any(b"XY")
            && let Some(call) = self.modal_call.clone()
        {
            self.drilling_cycle(&call);
        }
    }

    /// HOLES1 (row: X, Y, angle, distance to the first, spacing, number), HOLES2 (circle: X, Y, radius, angle, step, number).
    fn hole_pattern(&mut self, name: &str, arguments: &[Option<f64>]) {
        let Some(call) = self.modal_call.clone() else { return };
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
            let mut at = self.programmed;
            at.x = (value(0) + radius * angle.to_radians().cos()) * unit;
            at.y = (value(1) + radius * angle.to_radians().sin()) * unit;
            self.line_to(crate::nc::toolpath::MoveKind::Rapid, at);
            self.drilling_cycle(&call);
        }
    }

    /// CYCLE81 … CYCLE89: retract plane, reference plane, safety distance, depth (absolute, or relative to the reference).
    fn drilling_cycle(&mut self, call: &ModalCall) {
        let value = |index: usize| call.arguments.get(index).copied().flatten();
        let (Some(code), Some(retract), Some(reference)) = (drilling_code(&call.name), value(0), value(1)) else {
            return;
        };
        let unit = self.modal.unit_mm();
        let depth = value(3).or(value(4).map(|relative| reference - relative.abs()));
        let Some(depth) = depth else { return };
        let chip_break = call.name == "CYCLE83" && value(11).unwrap_or(0.0) == 0.0;
        let first = value(5).map(|d| (reference - d).abs()).or(value(6));
        let cycle = Cycle {
            initial: retract * unit,
            depth: Some(depth * unit),
            peck: first.map(|d| d * unit),
            dwell_s: if code == 820 { value(5).unwrap_or(0.0).max(0.0) } else { 0.0 },
            ..Cycle::default()
        };
        let before = (self.freeze, self.splittable, self.modal.retract_to_r, self.modal.incremental);
        self.freeze = self.freeze.or(match code {
            840 => Some(Freeze::Synchronised),
            810..=830 => None,
            _ => Some(Freeze::Cycle),
        });
        self.splittable = false;
        (self.modal.retract_to_r, self.modal.incremental) = (false, false);
        let level = (reference + value(2).unwrap_or(0.0)) * unit;
        self.one_hole(cycle, if chip_break { 730 } else { code }, self.programmed, level);
        (self.freeze, self.splittable, self.modal.retract_to_r, self.modal.incremental) = before;
    }

    /// G codes that mean something else on this control; `false`: read it as everywhere.
    pub(super) fn siemens_setting(&mut self, code: u16) -> bool {
        match code {
            600 => self.modal.path_mode = PathMode::ExactStop,
            6410..=6450 => self.modal.path_mode = PathMode::Continuous,
            700 | 7000 => self.modal.inch = true,
            710 | 7100 => self.modal.inch = false,
            4500 | 4510 | 6010..=6030 | 1530 | 9010 | 9020 => {}
            _ => return false,
        }
        true
    }
}

/// P beside the name of a subprogram.
fn repeats(line: &Line) -> u64 {
    line.get(b'P').unwrap_or(1.0).clamp(0.0, 1e9) as u64
}

fn drilling_code(name: &str) -> Option<u16> {
    let number = match name {
        "CYCLE840" => 84,
        _ => name.strip_prefix("CYCLE")?.parse::<u16>().ok()?,
    };
    (81..=89).contains(&number).then_some(number * 10)
}
