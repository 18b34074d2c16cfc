//! Diagnostics about a text: words that cannot be read, blocks whose meaning is not known. In: a block or a place in it. Out: a diagnostic
//! with its place; the feed of the block is frozen where it was not understood.

use super::interpreter::{Family, Interpreter};
use super::words::Words;
use crate::diag::{Diagnostic, Severity, Span};
use crate::nc::recognise::Control;
use crate::nc::token::TokenKind;
use crate::nc::toolpath::Freeze;

/// Diagnostics of one code that are kept; further ones are only counted.
const SAME_CODE: u32 = 100;

impl<F: Family> Interpreter<'_, F> {
    /// Diagnoses what could not be read in a block.
    pub(crate) fn diagnose_unreadable(&mut self, words: &Words) {
        let macro_call = words.has_g(650) || words.has_g(660) || words.has_g(40) || words.has_g(1870);
        for letter in b"EUVW".iter().filter(|&&letter| words.has(letter) && !macro_call) {
            let text = format!("{} is not an axis or a word known here", char::from(*letter));
            let place = words.span(*letter).unwrap_or_default();
            self.misread("nc::unknown-word", place, text, "the block is left as it is");
        }
        self.diagnose_all_unreadable(&words.bad);
        if let Some((letter, span)) = words.repeated {
            let text = format!("{} stands twice in the block", char::from(letter));
            self.misread("nc::repeated-word", span, text, "keep one of the words");
        }
    }

    /// One diagnostic for each stretch of text that cannot be read: what it begins with and what follows belong together.
    pub(crate) fn diagnose_all_unreadable(&mut self, bad: &[(TokenKind, Span)]) {
        let mut rest = bad.iter().copied().peekable();
        while let Some((kind, mut span)) = rest.next() {
            if kind == TokenKind::OpenComment {
                self.say("nc::open-comment", Severity::Warning, span, "the comment is never closed", "close it with )");
                continue;
            }
            while let Some((_, next)) =
                rest.next_if(|(kind, next)| *kind != TokenKind::OpenComment && next.start == span.end)
            {
                span.end = next.end;
            }
            let (text, help) = unreadable(span.of(self.flow.source.program().text()));
            self.misread("nc::not-understood", span, text, help);
        }
    }

    /// Diagnoses what makes the whole block unreadable: it sets nothing.
    pub(crate) fn misread(&mut self, code: &'static str, span: Span, text: impl Into<String>, help: &str) {
        self.block.misread = self.block.misread.or(Some(span));
        self.not_understood(code, span, text, help);
    }

    /// Diagnoses something that is kept but freezes the moves of its block.
    pub(crate) fn not_understood(&mut self, code: &'static str, span: Span, text: impl Into<String>, help: &str) {
        if is_not_finite(span.of(self.flow.source.program().text())) {
            let text = "NaN or infinity stands where a number belongs";
            self.say("nc::not-finite", Severity::Error, span, text, "write a plain decimal number, such as 600");
        } else {
            self.say(code, Severity::Warning, span, text, help);
        }
        self.block.freeze = self.block.freeze.or(Some(Freeze::NotUnderstood));
    }

    pub(crate) fn say(
        &mut self,
        code: &'static str,
        severity: Severity,
        span: Span,
        text: impl Into<String>,
        help: &str,
    ) {
        let known = self.messages.said.iter().position(|(name, _)| *name == code);
        let index = known.unwrap_or_else(|| {
            self.messages.said.push((code, 0));
            self.messages.said.len() - 1
        });
        self.messages.said[index].1 += 1;
        let text = text.into();
        if self.messages.said[index].1 > SAME_CODE {
            // Counted with one of its kind that is listed.
            if let Some(listed) = self.out.diagnostics.iter_mut().find(|listed| listed.is_like(code, severity, &text)) {
                listed.places += 1;
                return;
            }
        }
        let diagnostic = Diagnostic::new(code, severity, text).help(help);
        self.out.diagnostics.push(if self.flow.source_id == 0 {
            diagnostic.at(self.program.line(self.block.id), span)
        } else {
            let file = &self.flow.files[self.flow.source_id - 1].name;
            let text = format!("subprogram {file}, line {}: {}", self.block.id.0 + 1, diagnostic.text);
            Diagnostic { text, ..diagnostic }.on_line(self.line_number())
        });
    }

    /// Tells in which dialect the text is read, where the text does not make that certain.
    pub(crate) fn say_dialect(&mut self) {
        let Some(found) = self.program.recognised() else { return };
        let own = found.control.dialect().name();
        let names: Vec<&str> = found.others.iter().map(|dialect| dialect.name()).collect();
        let diagnostic = if !names.is_empty() {
            let text = format!("the program is read as {own}, but it could be {}", names.join(" or "));
            let help =
                format!("say which it is with --dialect, or dialect under [machine]: {own} or {}", names.join(", "));
            Diagnostic::new("nc::dialect", Severity::Warning, text).help(help)
        } else if matches!(found.control, Control::Family(_)) {
            return;
        } else {
            let text = format!("a program for {} ({}), read as {own}", found.control.name(), found.why());
            Diagnostic::new("nc::dialect", Severity::Note, text).help("another dialect is chosen with --dialect")
        };
        self.out.diagnostics.push(diagnostic);
    }
}

/// Is it `NaN` or infinity, alone or as the number of a word: `FNAN`, `X = -inf`, `[nan]`?
pub(crate) fn is_not_finite(bytes: &[u8]) -> bool {
    let name: Vec<u8> = bytes.iter().filter(|byte| byte.is_ascii_alphabetic()).map(u8::to_ascii_uppercase).collect();
    let plain = bytes.iter().all(|byte| byte.is_ascii_alphabetic() || b" \t+-=[]()#0123456789".contains(byte));
    let spelt = |name: &[u8]| [&b"NAN"[..], b"INF", b"INFINITY"].contains(&name);
    plain && (spelt(&name) || name.get(1..).is_some_and(spelt))
}

/// What is wrong with text that cannot be read, and what to do.
fn unreadable(bytes: &[u8]) -> (String, &'static str) {
    let letter =
        bytes.first().filter(|byte| byte.is_ascii_alphabetic()).map(|byte| char::from(byte.to_ascii_uppercase()));
    let number = bytes.iter().skip(1).all(|byte| byte.is_ascii_digit() || matches!(byte, b'.' | b'+' | b'-'));
    if bytes.iter().any(|byte| matches!(byte, b'[' | b']')) {
        ("the brackets do not match".into(), "give each [ its ]")
    } else if let Some(letter) = letter.filter(|_| number) {
        (format!("{letter} has no number that can be read"), "write a plain decimal number, such as -1.5")
    } else {
        ("this is not NC text of the dialect".into(), "correct it, or name the --dialect it is written in")
    }
}
