//! Diagnostics about a program or a setup: collected, never thrown. In: a code, a place, a text. Out: plain data; the
//! command line draws them with the offending bytes underlined.

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
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
}

impl Diagnostic {
    /// A diagnostic without place or help; add them with [`Diagnostic::at`] and [`Diagnostic::help`].
    pub fn new(code: &'static str, severity: Severity, text: impl Into<String>) -> Self {
        Self { code, severity, line: None, span: None, text: text.into(), help: String::new() }
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
