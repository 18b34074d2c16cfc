//! What can be wrong with a setup file, with its place and a remedy. In: the text, what serde or a check says. Out:
//! diagnostics whose spans count in the bytes of the setup text.

use crate::diag::{Diagnostic, Severity, Span};

/// A setup that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// The text is not TOML, has a key that is not known, or a value of the wrong form.
    #[error("{}", .0.text)]
    Form(Box<Diagnostic>),
    /// Values that make no sense; all that were found.
    #[error("{}", .0.iter().map(|d| d.text.as_str()).collect::<Vec<_>>().join("; "))]
    Values(Vec<Diagnostic>),
    /// A file it names cannot be used.
    #[error("{path}: {why}")]
    File {
        /// The file.
        path: String,
        /// Why not.
        why: String,
    },
}

impl SetupError {
    /// What to show.
    pub fn diagnostics(&self) -> Vec<Diagnostic> {
        match self {
            SetupError::Form(one) => vec![(**one).clone()],
            SetupError::Values(many) => many.clone(),
            SetupError::File { .. } => vec![Diagnostic::new("setup::file", Severity::Error, self.to_string())],
        }
    }
}

/// From what the TOML reader says: the place underlined, and the nearest known key when one is misspelt.
pub fn from_toml(error: &toml::de::Error, text: &str) -> SetupError {
    let message = error.message().replace('\n', " ");
    let (code, said, help) = if let Some((found, known)) = unknown_field(&message) {
        ("setup::unknown-key", format!("the key `{found}` is not known here"), suggest(found, &known))
    } else {
        let (said, help) = of_form(&message, error.span().and_then(|span| text.get(span)).unwrap_or_default());
        ("setup::form", said, help)
    };
    let mut diagnostic = Diagnostic::new(code, Severity::Error, said).help(help);
    if let Some(span) = error.span() {
        diagnostic = place(diagnostic, text, span);
    }
    SetupError::Form(Box::new(diagnostic))
}

/// What is wrong with the form of a value, in words of the file's format and not of its reader, and the remedy.
fn of_form(message: &str, value: &str) -> (String, String) {
    let is_word = value.starts_with(|c: char| c.is_ascii_alphabetic()) && !matches!(value, "true" | "false");
    if is_word {
        (format!("text stands in quotes, and `{value}` has none"), format!("write \"{}\"", value.trim_end()))
    } else if message.contains("floating point") && message.ends_with(", expected u32") {
        (format!("a whole number belongs here, not {value}"), "leave the decimal point out".to_owned())
    } else {
        (message.to_owned(), "`feedwright schema` prints what may stand here".to_owned())
    }
}

/// Puts a byte range of the text in as line and span.
pub fn place(diagnostic: Diagnostic, text: &str, span: std::ops::Range<usize>) -> Diagnostic {
    let start = span.start.min(text.len());
    let line = memchr::memchr_iter(b'\n', &text.as_bytes()[..start]).count() as u32 + 1;
    diagnostic.at(line, Span { start: start as u32, end: span.end.min(text.len()) as u32 })
}

fn unknown_field(message: &str) -> Option<(&str, Vec<&str>)> {
    let rest = message.strip_prefix("unknown field ")?;
    let mut quoted = rest.split('`').skip(1).step_by(2);
    let found = quoted.next()?;
    Some((found, quoted.collect()))
}

/// "did you mean" for the nearest of `known`, else the list of them.
pub fn suggest(found: &str, known: &[&str]) -> String {
    match nearest(found, known) {
        Some(name) => format!("did you mean `{name}`?"),
        None => format!("known here: {}", known.join(", ")),
    }
}

/// The known name that is near enough to be meant.
pub fn nearest<'a>(found: &str, known: &[&'a str]) -> Option<&'a str> {
    let allowed = (found.chars().count() / 3).max(1);
    let scored = known.iter().map(|name| (distance(&found.to_lowercase(), name), *name));
    scored.filter(|(d, _)| *d <= allowed).min_by_key(|(d, _)| *d).map(|(_, name)| name)
}

/// Edit distance where swapping two neighbours counts once.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut rows = vec![vec![0; b.len() + 1]; a.len() + 1];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            rows[i][j] = if i == 0 || j == 0 {
                i + j
            } else {
                let replaced = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
                let mut best = replaced.min(rows[i - 1][j] + 1).min(rows[i][j - 1] + 1);
                if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                    best = best.min(rows[i - 2][j - 2] + 1);
                }
                best
            };
        }
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_of_the_wrong_form_is_said_in_words_of_the_file() {
        assert_eq!(toml::from_str::<Flutes>("flutes = 4").unwrap().flutes, 4);
        let said = |text: &str| {
            let error = toml::from_str::<Flutes>(text).unwrap_err();
            let one = from_toml(&error, text).diagnostics().remove(0);
            (one.text, one.help)
        };
        let (text, help) = said("flutes = four");
        assert!(text.contains("`four` has none") && help == "write \"four\"", "{text}, {help}");
        assert_eq!(said("flutes = 4.0").0, "a whole number belongs here, not 4.0");
        assert!(said("flutes = -4").0.contains("-4") && said("flutes = true").1.contains("schema"));
    }

    #[derive(Debug, serde::Deserialize)]
    struct Flutes {
        flutes: u32,
    }

    #[test]
    fn misspelt_keys_find_their_neighbour() {
        let known = ["force_xy", "force_axial", "power", "deflection"];
        assert_eq!(nearest("froce_xy", &known), Some("force_xy"));
        assert_eq!(nearest("deflexion", &known), Some("deflection"));
        assert_eq!(nearest("Power", &known), Some("power"));
        assert_eq!(nearest("weather", &known), None);
    }
}
