//! Output on the screen. In: text. Out: results on standard output, everything else on standard error; colours and progress only on a terminal.

use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::borrow::Cow;
use std::io::{IsTerminal, Write};

use super::error::CliError;
use super::options::Global;
use crate::diag::{self, Diagnostic, Severity};

/// Settings of the output.
#[derive(Debug, Clone, Copy)]
pub struct Screen {
    quiet: bool,
    colour: bool,
    filter: bool,
}

impl Screen {
    /// From the options and the terminal.
    pub fn new(global: &Global) -> Self {
        let colour = !global.no_color && std::env::var_os("NO_COLOR").is_none() && std::io::stderr().is_terminal();
        Self { quiet: global.quiet, colour, filter: global.filter_progress }
    }

    /// The same without a word but errors.
    pub fn quietly(self) -> Self {
        Self { quiet: true, ..self }
    }

    /// A summary, to standard output; not when quiet.
    pub fn show(self, text: &str) -> Result<(), CliError> {
        if self.quiet { Ok(()) } else { print(text) }
    }

    /// Something worth knowing, to standard error; not when quiet.
    pub fn say(self, text: &str) {
        if !self.quiet {
            to_stderr(&readable(text));
        }
    }

    /// The error that ends the command.
    pub fn fail(self, error: &CliError) {
        match error {
            CliError::Message { text, help } | CliError::Unmet { text, help } => {
                let [text, help] = [text, help].map(|words| readable(words));
                let mut group = Level::ERROR.primary_title(text.as_ref()).elements(None::<annotate_snippets::Message>);
                if !help.is_empty() {
                    group = group.element(Level::HELP.message(help.as_ref()));
                }
                to_stderr(&self.renderer().render(&[group]));
            }
            CliError::Drawn { file, text, diagnostics } => {
                for diagnostic in diagnostics {
                    to_stderr(&self.drawn(file, text, diagnostic));
                }
            }
        }
    }

    /// Diagnostics about a text: one of each kind, with how many places there are.
    pub fn diagnostics(self, file: &str, text: &[u8], diagnostics: &[Diagnostic]) {
        if self.quiet {
            return;
        }
        for kind in diag::kinds(diagnostics) {
            to_stderr(&self.drawn(file, text, &Diagnostic { text: kind.text(), ..kind.first.clone() }));
        }
    }

    fn drawn(self, file: &str, text: &[u8], diagnostic: &Diagnostic) -> String {
        let level = match diagnostic.severity {
            Severity::Note => Level::NOTE,
            Severity::Warning => Level::WARNING,
            Severity::Error => Level::ERROR,
        };
        let [file, said, help] = [file, &diagnostic.text, &diagnostic.help].map(readable);
        let title = level.primary_title(said.as_ref()).id(diagnostic.code);
        let place = place(text, diagnostic);
        let mut group: Group = match &place {
            Some(Place { source, line, marked }) => title.element(
                Snippet::source(source.as_str())
                    .line_start(*line)
                    .path(file.as_ref())
                    .annotation(AnnotationKind::Primary.span(marked.clone())),
            ),
            None => title.elements(None::<annotate_snippets::Message>),
        };
        if !help.is_empty() {
            group = group.element(Level::HELP.message(help.as_ref()));
        }
        self.renderer().render(&[group])
    }

    fn renderer(self) -> Renderer {
        let renderer = if self.colour { Renderer::styled() } else { Renderer::plain() };
        renderer.decor_style(DecorStyle::Ascii)
    }

    /// How far the work is, %, where a filter of LinuxCNC is asked to say it.
    pub fn filter_progress(self, percent: u32) {
        if self.filter {
            to_stderr(&format!("FILTER_PROGRESS={percent}"));
        }
    }

    /// A bar from 0 to 1 on a terminal, nothing elsewhere.
    pub fn progress(self, what: &'static str) -> ProgressBar {
        let bar = ProgressBar::new(1000);
        let shown = !self.quiet && std::io::stderr().is_terminal();
        bar.set_draw_target(if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() });
        let style = ProgressStyle::with_template("{msg:>10} [{wide_bar}] {percent:>3} % {eta}");
        bar.set_style(style.expect("the template is right").progress_chars("=> "));
        bar.set_message(what);
        bar
    }
}

/// Words with something of a file in them, to standard output.
pub fn print(text: &str) -> Result<(), CliError> {
    put(readable(text).as_bytes())
}

/// A text without what a terminal obeys: names of files and texts of programs may hold anything. Control characters but for line ends
/// and tabs, and those that turn the direction of writing, are shown by their numbers.
fn readable(text: &str) -> Cow<'_, str> {
    let obeyed = |c: char| {
        (c.is_control() && c != '\n' && c != '\t') || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    if !text.contains(obeyed) {
        return Cow::Borrowed(text);
    }
    let shown = |c: char| if obeyed(c) { c.escape_unicode().to_string() } else { c.to_string() };
    Cow::Owned(text.chars().map(shown).collect())
}

/// A result, to standard output. Whoever reads it may go away before the end: that is no fault.
pub fn put(text: &[u8]) -> Result<(), CliError> {
    let mut out = std::io::stdout().lock();
    written(out.write_all(text).and_then(|()| out.flush()))
}

/// What writing to standard output came to; that nobody reads on is no fault.
pub fn written(result: std::io::Result<()>) -> Result<(), CliError> {
    match result {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

fn to_stderr(text: &str) {
    // Nobody can be told when standard error is closed.
    let _ = writeln!(std::io::stderr().lock(), "{}", text.trim_end());
}

/// The line a diagnostic points to, as text that can be shown, and the bytes of it to underline.
struct Place {
    source: String,
    line: usize,
    marked: std::ops::Range<usize>,
}

fn place(text: &[u8], diagnostic: &Diagnostic) -> Option<Place> {
    let line = diagnostic.line?;
    let span = diagnostic.span.filter(|span| (span.start as usize) < text.len().max(1));
    let start = match span {
        Some(span) => memchr::memrchr(b'\n', &text[..span.start as usize]).map_or(0, |at| at + 1),
        None => memchr::memchr_iter(b'\n', text).nth((line as usize).checked_sub(2)?).map_or(0, |at| at + 1),
    };
    let end = memchr::memchr(b'\n', &text[start..]).map_or(text.len(), |at| start + at);
    let bytes = text[start..end].trim_ascii_end();
    let shown = |bytes: &[u8]| match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|byte| *byte as char).collect(),
    };
    let utf8 = std::str::from_utf8(bytes).is_ok();
    let width = |bytes: &[u8]| if utf8 { bytes.len() } else { shown(bytes).len() };
    let offset = |at: u32| width(&bytes[..(at as usize).saturating_sub(start).min(bytes.len())]);
    let marked = span.map_or(0..width(bytes), |span| offset(span.start)..offset(span.end).max(offset(span.start)));
    Some(Place { source: shown(bytes), line: line as usize, marked })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::Span;

    #[test]
    fn what_a_terminal_obeys_is_shown_by_its_number() {
        assert_eq!(readable("part\u{1b}[31m.nc\r\n\té"), "part\\u{1b}[31m.nc\\u{d}\n\té");
        assert_eq!(readable("\u{202e}cn.trap"), "\\u{202e}cn.trap");
    }

    #[test]
    fn the_offending_bytes_are_found_in_any_encoding() {
        let text = b"G0 X1\n(\xe4) G77 X2\r\n";
        let diagnostic = Diagnostic::new("nc::x", Severity::Warning, "what").at(2, Span { start: 10, end: 13 });
        let place = place(text, &diagnostic).unwrap();
        assert_eq!(place.source, "(ä) G77 X2");
        assert_eq!(&place.source[place.marked], "G77");
    }
}
