//! Errors that end a command. In: an error of any stage. Out: a message that says what to do, and the exit code: 2, or 1 where the input is
//! sound but no feeds meet its limits. Nothing is written.

use crate::diag::Diagnostic;
use std::path::Path;

/// Cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// One sentence, and what to do.
    #[error("{text}")]
    Message {
        /// What is wrong.
        text: String,
        /// The remedy.
        help: String,
    },
    /// The input is sound, but no feeds meet the limits: one sentence, and what to do.
    #[error("{text}")]
    Unmet {
        /// What cannot be met, and why.
        text: String,
        /// The remedy.
        help: String,
    },
    /// Something in a text, drawn with its place.
    #[error("{file} cannot be used")]
    Drawn {
        /// Name of the file.
        file: String,
        /// Its bytes.
        text: Vec<u8>,
        /// What is wrong in it.
        diagnostics: Vec<Diagnostic>,
    },
}

impl CliError {
    /// A message with its remedy.
    pub fn new(text: impl Into<String>, help: impl Into<String>) -> Self {
        CliError::Message { text: text.into(), help: help.into() }
    }

    /// Limits that no feeds meet.
    pub fn unmet(text: impl Into<String>, help: impl Into<String>) -> Self {
        CliError::Unmet { text: text.into(), help: help.into() }
    }

    /// The exit code.
    pub fn exit_code(&self) -> u8 {
        if matches!(self, CliError::Unmet { .. }) { 1 } else { 2 }
    }

    /// A file that cannot be read or written.
    pub fn file(doing: &str, path: &Path, error: &std::io::Error) -> Self {
        let why = match error.kind() {
            std::io::ErrorKind::NotFound => "there is no such file or folder".to_owned(),
            std::io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
            _ => error.to_string(),
        };
        CliError::new(
            format!("cannot {doing} {}: {why}", path.display()),
            "check the path and the permissions of its folder",
        )
    }
}

impl From<std::io::Error> for CliError {
    /// For writing to standard output only: files are reported with their path.
    fn from(error: std::io::Error) -> Self {
        CliError::new(format!("cannot write to standard output: {error}"), "write to a file with -o instead")
    }
}
