//! Diagnostics about a program or a setup: collected, never thrown. In: a code, a place, a text. Out: plain data; the
//! command line draws them with the offending bytes underlined.

use std::collections::HashMap;

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// For information; nothing was left out because of it.
    Note,
    /// Something was kept as it is, or assumed.
    Warning,
    /// The input is wrong; the run cannot be trusted without a correction.
    Error,
}

/// A range of bytes in the text of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Span {
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// The bytes of `text` it covers (clipped to the text).
    pub fn of(self, text: &[u8]) -> &[u8] {
        let end = (self.end as usize).min(text.len());
        &text[(self.start as usize).min(end)..end]
    }
    /// Length in bytes.
    pub fn len(self) -> usize {
        (self.end - self.start) as usize
    }
    /// True when it covers nothing.
    pub fn is_empty(self) -> bool {
        self.end <= self.start
    }
}

/// One thing to tell the user about the input.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    /// Stable code, like `nc::unknown-g` or `setup::tool`.
    pub code: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// Physical line, 1-based, where there is one.
    pub line: Option<u32>,
    /// Offending bytes, where there are some.
    pub span: Option<Span>,
    /// What is wrong, one sentence.
    pub text: String,
    /// What to do about it, one sentence; empty when there is nothing to do.
    pub help: String,
    /// How many places it stands for: this one, and others like it that are not listed.
    pub places: u32,
}

/// Diagnostics of one kind: the same code, severity and sentence but for its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Kind<'a> {
    /// The first of them.
    pub first: &'a Diagnostic,
    /// In how many places.
    pub places: u32,
}

impl Kind<'_> {
    /// The sentence of the first, and how many there are.
    pub fn text(&self) -> String {
        match (self.places, self.first.line) {
            (..=1, _) => self.first.text.clone(),
            (places, Some(line)) => format!("{} (×{places}, first at line {line})", self.first.text),
            (places, None) => format!("{} (×{places})", self.first.text),
        }
    }
}

/// The kinds of diagnostics in the order in which each is said first.
pub fn kinds(diagnostics: &[Diagnostic]) -> Vec<Kind<'_>> {
    let mut kinds: Vec<Kind> = Vec::new();
    let mut known: HashMap<(&str, Severity, String), usize> = HashMap::new();
    for said in diagnostics {
        let at = *known.entry((said.code, said.severity, without_numbers(&said.text))).or_insert_with(|| {
            kinds.push(Kind { first: said, places: 0 });
            kinds.len() - 1
        });
        kinds[at].places += said.places;
    }
    kinds
}

/// A sentence with one sign in place of each number.
fn without_numbers(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '0'..='9' | '.' | ',' if out.ends_with('#') => {}
            '0'..='9' => out.push('#'),
            c => out.push(c),
        }
    }
    out
}

impl Diagnostic {
    /// A diagnostic without place or help; add them with [`Diagnostic::at`] and [`Diagnostic::help`].
    pub fn new(code: &'static str, severity: Severity, text: impl Into<String>) -> Self {
        Self { code, severity, line: None, span: None, text: text.into(), help: String::new(), places: 1 }
    }
    /// Would this be said in the same sentence, numbers aside?
    pub fn is_like(&self, code: &str, severity: Severity, text: &str) -> bool {
        self.code == code && self.severity == severity && without_numbers(&self.text) == without_numbers(text)
    }
    /// Puts the place in.
    pub fn at(mut self, line: u32, span: Span) -> Self {
        self.line = Some(line);
        self.span = Some(span);
        self
    }
    /// Puts the line in.
    pub fn on_line(mut self, line: u32) -> Self {
        self.line = Some(line);
        self
    }
    /// Puts the remedy in.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = help.into();
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_often_is_one_kind_with_its_count() {
        let at = |line: u32, text: &str| Diagnostic::new("nc::arc", Severity::Warning, text).on_line(line);
        let mut many: Vec<Diagnostic> =
            (7..107).map(|line| at(line, &format!("off by {line}.5 mm at N{line}"))).collect();
        many.insert(3, at(1, "another sentence"));
        many.push(Diagnostic { places: 400, ..at(9, "off by 3 mm at N1") });
        let kinds = kinds(&many);
        assert_eq!(kinds.iter().map(|kind| kind.places).collect::<Vec<_>>(), [500, 1]);
        assert_eq!(kinds[0].text(), "off by 7.5 mm at N7 (×500, first at line 7)");
        assert_eq!(kinds[1].text(), "another sentence");
    }
}
