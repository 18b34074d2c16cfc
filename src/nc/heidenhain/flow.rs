//! Labels, calls and jumps of Heidenhain plain language: LBL, CALL LBL … REP, CALL PGM, FN 9 to FN 12. In: the tokens of a block. Out: where
//! the run goes on.

use super::state::Heidenhain;
use crate::diag::{Severity, Span};
use crate::nc::doubt::Doubt;
use crate::nc::interp::interpreter::Interpreter;
use crate::nc::token::{Token, TokenKind};

impl Interpreter<'_, Heidenhain> {
    /// `CALL LBL n REP k`: k further times.
    pub(crate) fn call_label(&mut self, tokens: &[Token], text: &[u8], place: Span) {
        let values: Vec<&Token> = tokens.iter().filter(|token| token.kind == TokenKind::Expression).collect();
        let Some(label) = values.first() else { return self.no_routine(place, "a label") };
        let computed = label.span.of(text).trim_ascii().iter().any(|byte| matches!(byte, b'Q' | b'q'))
            && !label.span.of(text).starts_with(b"\"");
        let label = if computed {
            let number = self.value(**label, text);
            if self.values_are_unknown() {
                self.calls_any_routine(place);
            }
            format!("LBL {}", number.unwrap_or(0.0).max(0.0) as u32)
        } else {
            plain_label(label, text)
        };
        let repeats = values.get(1).and_then(|token| self.value(**token, text));
        let repeats = repeats.map(|count| count.clamp(0.0, 1e6) as u64);
        // LBL 0 ends a routine and is none.
        let Some(start) = self.label(&label).filter(|_| label != "LBL 0") else {
            return self.no_routine(place, &label);
        };
        let Some(count) = repeats else { return self.call_block(start + 1, 1) };
        let key = (self.flow.calls.len(), self.block.id.0);
        let known = self.family.repeats.iter().position(|repeat| (repeat.0, repeat.1) == key);
        let index = known.unwrap_or_else(|| {
            self.family.repeats.push((key.0, key.1, count));
            self.family.repeats.len() - 1
        });
        if self.family.repeats[index].2 == 0 {
            self.family.repeats.remove(index);
        } else {
            self.family.repeats[index].2 -= 1;
            self.jump(start + 1);
        }
    }

    fn label(&mut self, label: &str) -> Option<usize> {
        self.labels().names.iter().find(|(name, _)| name == label).map(|(_, block)| *block as usize)
    }

    /// `CALL PGM NAME`: the program of this name beside this one.
    pub(crate) fn call_file(&mut self, line_text: &[u8], place: Span) {
        let text = String::from_utf8_lossy(line_text).into_owned();
        let name = text.to_ascii_uppercase().find("PGM").map_or("", |at| &text[at + 3..]);
        let name = name.split(';').next().unwrap_or_default().trim().trim_matches('"');
        let name = name.rsplit(['\\', '/']).next().unwrap_or_default();
        let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
        if stem.is_empty()
            || !(self.call_by_name(name, 1, Some(Vec::new())) || self.call_by_name(stem, 1, Some(Vec::new())))
        {
            self.no_routine(place, &format!("program {name}"));
        }
    }

    /// `FN 9: IF +Q1 EQU +Q2 GOTO LBL 5` (10: NE, 11: GT, 12: LT); false when it is no jump.
    pub(crate) fn q_jump(&mut self, line_text: &[u8], place: Span) -> bool {
        let upper = line_text.to_ascii_uppercase();
        let find = |mark: &[u8]| memchr::memmem::find(&upper, mark);
        let Some((condition, goto)) = find(b"IF ").zip(find(b" GOTO")) else { return find(b"GOTO").is_some() };
        let operators: [(&[u8], &str); 4] = [(b" EQU ", "=="), (b" NE ", "<>"), (b" GT ", ">"), (b" LT ", "<")];
        let found = operators.iter().find_map(|(mark, sign)| find(mark).map(|at| (at, mark.len(), *sign)));
        let Some((at, length, sign)) = found.filter(|(at, ..)| condition + 3 <= *at && *at < goto) else {
            self.doubt(Doubt::UnknownValue, place);
            self.not_understood("nc::not-understood", place, "this jump is not followed", "");
            return true;
        };
        let text = [&upper[condition + 3..at], sign.as_bytes(), &upper[at + length..goto]].concat();
        match self.evaluate(place, text.trim_ascii(), 0) {
            Ok(value) if value != 0.0 => self.go_to_label(&upper[goto..], place),
            Ok(_) => {}
            Err(error) => self.bad_expression(place, &error),
        }
        true
    }

    fn go_to_label(&mut self, goto: &[u8], place: Span) {
        let name = memchr::memmem::find(goto, b"LBL").map_or(&b""[..], |at| goto[at + 3..].trim_ascii());
        let end = name.iter().position(|byte| matches!(byte, b' ' | b';' | b'\r' | b'\n')).unwrap_or(name.len());
        let label = format!("LBL {}", String::from_utf8_lossy(&name[..end]).trim_start_matches('0'));
        if let Some(block) = self.label(&label) {
            self.jump(block + 1);
        } else {
            // It may be computed.
            self.uses_feed();
            self.doubt(Doubt::UnknownValue, place);
            let text = format!("there is no {label}");
            self.say("nc::no-target", Severity::Error, place, text, "the program ends here");
            self.flow.ended = true;
        }
    }
}

/// `LBL 1` or `LBL "NAME"` of plain language.
pub(super) fn plain_label(token: &Token, text: &[u8]) -> String {
    let bytes = token.span.of(text);
    if bytes.starts_with(b"\"") {
        return format!("LBL {}", String::from_utf8_lossy(bytes).to_ascii_uppercase());
    }
    format!("LBL {}", token.number as u32)
}
