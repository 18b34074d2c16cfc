//! Flow control of LinuxCNC (O words) and Macro B (IF, GOTO, WHILE). In: a block. Out: where the run goes on. Every jump is charged to the
//! budget ([`crate::nc::interp::budget`]), so that endless loops stop.

use super::state::Rs274;
use crate::diag::{Severity, Span};
use crate::ids::BlockId;
use crate::nc::doubt::Doubt;
use crate::nc::expr;
use crate::nc::interp::interpreter::Interpreter;
use crate::nc::interp::labels::label_of;
use crate::nc::interp::state::After;
use crate::nc::token::{Token, TokenKind};

/// Statements of Macro B that print, or name a variable: they move nothing.
const PRINTS: [&str; 5] = ["POPEN", "DPRNT", "BPRNT", "PCLOS", "SETVN"];

impl Interpreter<'_, Rs274> {
    /// Executes the flow control of a block.
    pub(super) fn flow_control(&mut self, block: BlockId) -> After {
        let source = self.flow.source.clone();
        let skip =
            |kind| matches!(kind, TokenKind::Blank | TokenKind::LineEnd | TokenKind::Comment | TokenKind::Delete);
        let mut tokens: Vec<Token> = source.program().tokens(block).filter(|token| !skip(token.kind)).collect();
        if tokens.first().is_some_and(|token| token.kind == TokenKind::Word(b'N')) {
            tokens.remove(0);
        }
        let text = source.program().text();
        match tokens.first().map(|token| token.kind) {
            Some(TokenKind::Percent) => self.percent(block),
            Some(TokenKind::Word(b'O') | TokenKind::Routine) => self.o_line(block, &tokens, text),
            Some(TokenKind::Name) => self.macro_line(block, &tokens, text),
            _ => After::Words,
        }
    }

    /// The second `%` ends the program (ISO 6983-1: it stands alone, or before a program's name). `% vfd enable`, with a blank
    /// and words behind it, is a remark (PlanetCNC, G-code reference, Comments), and so is `%( START )`.
    fn percent(&mut self, block: BlockId) -> After {
        let line = self.flow.source.program().line_text(block).trim_ascii();
        if line.len() > 2 && (line[1].is_ascii_whitespace() || line[1] == b'(' && self.flow.began) {
            return After::Done;
        }
        if self.flow.began && self.flow.source_id == 0 && block.0 > 0 {
            self.flow.ended = true;
        }
        self.flow.began = true;
        After::Done
    }

    fn o_line(&mut self, block: BlockId, tokens: &[Token], text: &[u8]) -> After {
        let head = tokens[0];
        let Some(keyword) = tokens.get(1).filter(|token| token.kind == TokenKind::Name) else { return After::Words };
        let word = String::from_utf8_lossy(keyword.span.of(text)).to_ascii_uppercase();
        let label = self.o_label(head, text);
        let rest = &tokens[2..];
        let labels = self.labels();
        match word.as_str() {
            "SUB" => match labels.after(block.0, &label, &["ENDSUB"]) {
                Some(end) => self.jump(end.block as usize + 1),
                None => self.no_end(keyword.span, "endsub"),
            },
            "ENDSUB" | "RETURN" => {
                let value = rest.first().and_then(|token| self.value(*token, text));
                self.return_from_call();
                if let Some(value) = value {
                    self.parameters.set_name("_value", value);
                }
            }
            "CALL" => {
                let values = rest.iter().filter_map(|token| self.value(*token, text));
                let arguments = (1..=30).zip(values).collect();
                let computed =
                    head.kind == TokenKind::Routine && matches!(head.span.of(text).get(1), Some(b'#' | b'['));
                if computed && self.values_are_unknown() {
                    self.calls_any_routine(head.span);
                }
                if !self.call_by_name(&label, 1, Some(arguments)) {
                    self.no_routine(head.span, &format!("routine {label}"));
                }
            }
            "WHILE" => self.o_while(block, &label, rest, text),
            "DO" | "ENDIF" => {}
            "ENDWHILE" | "CONTINUE" => {
                if let Some(start) = labels.before(block.0, &label, &["WHILE", "DO", "REPEAT"]) {
                    match start.keyword.as_str() {
                        "WHILE" => self.jump(start.block as usize),
                        "REPEAT" => self.o_end_repeat(start.block, block.0, &label),
                        _ => self.jump_after(block.0, &label, &["WHILE"], 0),
                    }
                }
            }
            "BREAK" => {
                self.family.repeats.retain(|repeat| repeat.0 != self.flow.calls.len() || repeat.1 >= block.0);
                self.jump_after(block.0, &label, &["ENDWHILE", "ENDREPEAT", "WHILE"], 1);
            }
            "IF" => self.o_if(block, &label, rest, text),
            "ELSEIF" | "ELSE" => self.jump_after(block.0, &label, &["ENDIF"], 1),
            "REPEAT" => self.o_repeat(block, &label, rest, text),
            "ENDREPEAT" => {
                if let Some(start) = labels.before(block.0, &label, &["REPEAT"]) {
                    self.o_end_repeat(start.block, block.0, &label);
                }
            }
            _ => self.not_understood("nc::not-understood", keyword.span, format!("{word} is not an O-word"), ""),
        }
        After::Done
    }

    fn o_label(&mut self, head: Token, text: &[u8]) -> String {
        let label = label_of(head.kind, head.number, head.span.of(text));
        if head.kind == TokenKind::Routine && label.starts_with(['[', '#']) {
            let number = self.evaluate(head.span, label.as_bytes(), 0);
            return number.map_or(label, |value| format!("{}", value as u64));
        }
        label
    }

    fn no_end(&mut self, span: Span, what: &str) {
        let text = format!("there is no {what} with this label");
        self.say("nc::unbalanced", Severity::Error, span, text, "the rest of the program is not executed");
        self.flow.ended = true;
    }

    fn jump_after(&mut self, block: u32, label: &str, keywords: &[&str], beyond: usize) {
        match self.labels().after(block, label, keywords) {
            Some(line) => self.jump(line.block as usize + beyond),
            None => self.no_end(self.flow.source.program().span(BlockId(block)), keywords[0]),
        }
    }

    fn o_while(&mut self, block: BlockId, label: &str, rest: &[Token], text: &[u8]) {
        let labels = self.labels();
        let holds = self.condition(rest, text);
        let opener = labels.before(block.0, label, &["DO", "ENDWHILE", "WHILE"]).filter(|line| line.keyword == "DO");
        match (opener, holds) {
            (Some(start), true) => self.jump(start.block as usize + 1),
            (None, false) => self.jump_after(block.0, label, &["ENDWHILE"], 1),
            _ => {}
        }
    }

    fn o_if(&mut self, block: BlockId, label: &str, rest: &[Token], text: &[u8]) {
        if self.condition(rest, text) {
            return;
        }
        let labels = self.labels();
        let mut at = block.0;
        while let Some(next) = labels.after(at, label, &["ELSEIF", "ELSE", "ENDIF"]) {
            at = next.block;
            let source = self.flow.source.clone();
            let is_condition = |token: &Token| token.kind == TokenKind::Expression;
            let tokens: Vec<Token> = source.program().tokens(BlockId(at)).filter(is_condition).collect();
            if next.keyword != "ELSEIF" || self.condition(&tokens, text) {
                return self.jump(at as usize + 1);
            }
        }
        self.no_end(self.flow.source.program().span(block), "endif");
    }

    fn o_repeat(&mut self, block: BlockId, label: &str, rest: &[Token], text: &[u8]) {
        let times = rest.first().and_then(|token| self.value(*token, text)).unwrap_or(0.0).round();
        if times < 1.0 {
            self.jump_after(block.0, label, &["ENDREPEAT"], 1);
        } else {
            self.family.repeats.push((self.flow.calls.len(), block.0, times.min(1e12) as u64 - 1));
        }
    }

    fn o_end_repeat(&mut self, start: u32, block: u32, label: &str) {
        let depth = self.flow.calls.len();
        match self.family.repeats.iter_mut().rev().find(|repeat| repeat.0 == depth && repeat.1 == start) {
            Some(repeat) if repeat.2 > 0 => {
                repeat.2 -= 1;
                self.jump(start as usize + 1);
            }
            _ => {
                self.family.repeats.retain(|repeat| repeat.0 != depth || repeat.1 != start);
                if !self.labels().o_lines.iter().any(|o| o.block == block && o.keyword == "ENDREPEAT") {
                    self.jump_after(block, label, &["ENDREPEAT"], 1);
                }
            }
        }
    }

    /// Macro B: IF, WHILE, END, GOTO.
    fn macro_line(&mut self, block: BlockId, tokens: &[Token], text: &[u8]) -> After {
        let name = |token: &Token| String::from_utf8_lossy(token.span.of(text)).to_ascii_uppercase();
        match name(&tokens[0]).as_str() {
            "IF" => {
                let then = tokens.get(2).map(name).unwrap_or_default();
                if self.condition(&tokens[1..2.min(tokens.len())], text) {
                    match (then.as_str(), tokens.get(3)) {
                        ("GOTO", Some(target)) => self.goto(*target, text),
                        ("THEN", Some(_)) => tokens[3..].iter().for_each(|token| self.assign(*token, text)),
                        _ => self.misread("nc::not-understood", tokens[0].span, "IF without GOTO or THEN", ""),
                    }
                }
            }
            "GOTO" => match tokens.get(1) {
                Some(target) => self.goto(*target, text),
                None => self.not_understood("nc::not-understood", tokens[0].span, "GOTO without a number", ""),
            },
            "WHILE" => {
                if !self.condition(&tokens[1..2.min(tokens.len())], text) {
                    self.leave_loop(block, tokens[0].span);
                }
            }
            "DO" => {}
            "END" => {
                let labels = self.labels();
                let number = labels.loops.iter().find(|l| l.0 == block.0).map(|l| l.1);
                let start = labels.loops.iter().rev().find(|l| l.0 < block.0 && !l.2 && Some(l.1) == number);
                match start {
                    Some(start) => self.jump(start.0 as usize),
                    None => self.not_understood("nc::unbalanced", tokens[0].span, "END without WHILE … DO", ""),
                }
            }
            other => {
                let text = format!("{other} is not known here");
                let help = "its block is kept as it is";
                if PRINTS.contains(&other) {
                    self.not_understood("nc::not-understood", tokens[0].span, text, help);
                } else {
                    self.misread("nc::not-understood", tokens[0].span, text, help);
                }
                return After::Words;
            }
        }
        After::Done
    }

    fn leave_loop(&mut self, block: BlockId, span: Span) {
        let labels = self.labels();
        let number = labels.loops.iter().find(|l| l.0 == block.0).map(|l| l.1);
        match labels.loops.iter().find(|l| l.0 > block.0 && l.2 && Some(l.1) == number) {
            Some(end) => self.jump(end.0 as usize + 1),
            None => self.no_end(span, "END"),
        }
    }

    fn goto(&mut self, target: Token, text: &[u8]) {
        let Some(number) = self.value(target, text) else { return };
        if let Some(block) = self.labels().numbered(number.max(0.0) as u32, self.block.id.0) {
            self.jump(block as usize);
        } else {
            let text = format!("there is no N{number}");
            self.say("nc::no-target", Severity::Error, target.span, text, "the program ends here");
            self.flow.ended = true;
        }
    }

    fn condition(&mut self, tokens: &[Token], text: &[u8]) -> bool {
        tokens.first().and_then(|token| self.value(*token, text)).is_some_and(|value| value != 0.0)
    }

    /// Executes `#… = …`.
    pub(crate) fn assign(&mut self, token: Token, text: &[u8]) {
        self.read_assignment(token, text);
        self.apply_assignments();
    }

    /// Reads `#… = …`. The value may later be used in any word, so a value that only the control knows raises a doubt at once.
    pub(crate) fn read_assignment(&mut self, token: Token, text: &[u8]) {
        self.predefine(token.span.of(text));
        self.parameters.take_unset();
        let read = expr::assignment(token.span.of(text), &self.parameters);
        if self.doubt_unset_variables(token.span) > 0 {
            self.doubt(Doubt::UnknownValue, token.span);
        }
        match read {
            Ok(setting) => self.block.assignments.push(setting),
            Err(error) => self.bad_expression(token.span, &error),
        }
    }

    /// Sets the parameters a control keeps itself, where the expression may ask for them.
    pub(crate) fn predefine(&mut self, text: &[u8]) {
        if memchr::memchr(b'#', text).is_none() {
            return;
        }
        let text: Vec<u8> =
            text.iter().filter(|byte| !byte.is_ascii_whitespace()).map(u8::to_ascii_lowercase).collect();
        let asks = |mark: &[u8]| text.windows(mark.len()).any(|window| window == mark);
        let unit = self.modal.unit_mm();
        let at = self.place.programmed / unit;
        let stands = |axis: usize| {
            let [name, number] = [b"xyz"[axis], b"123"[axis]];
            asks(&[b'#', b'<', b'_', name, b'>'])
                || asks(b"#[")
                || asks(&[b'#', b'5', b'0', b'4', number])
                || asks(&[b'#', b'5', b'4', b'2', number - 1])
        };
        // Where it stands behind a probing move only the control knows.
        if (0..3).any(|axis| self.place.elsewhere[axis] && stands(axis)) {
            self.doubt(Doubt::UnknownValue, self.flow.source.program().span(self.block.id));
        }
        if asks(b"#5") || asks(b"#[") {
            let tool = f64::from(self.modal.tool);
            let offset = f64::from(self.modal.wcs) - 53.0;
            self.parameters.numbered.extend([(5220, offset), (5400, tool)]);
            for axis in 0..3 {
                self.parameters.numbered.extend([(5420 + axis, at[axis as usize]), (5041 + axis, at[axis as usize])]);
            }
        }
        if asks(b"#") {
            self.parameters.set_feed(self.modal.feed.value / unit);
        }
        if asks(b"#<_") {
            let truth = |it: bool| f64::from(u8::from(it));
            let values = [
                ("_x", at.x),
                ("_y", at.y),
                ("_z", at.z),
                ("_metric", truth(!self.modal.inch)),
                ("_imperial", truth(self.modal.inch)),
                ("_absolute", truth(!self.modal.incremental)),
                ("_incremental", truth(self.modal.incremental)),
                ("_current_tool", f64::from(self.modal.tool)),
                ("_rpm", crate::units::rpm_from_rps(self.modal.speed_rps)),
                ("_coord_system", f64::from(self.modal.wcs) * 10.0),
            ];
            for (name, value) in values {
                self.parameters.set_name(name, value);
            }
        }
    }
}
