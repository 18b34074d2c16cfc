//! Descriptions of the command line for other programs. In: the definition of the arguments. Out: shell completions, the manual page, and the
//! JSON Schemas of setup and report.

use clap::{Args, Command, ValueEnum};

use super::error::CliError;
use super::screen;
use crate::report::Outcome;

/// `completions`.
#[derive(Debug, Args)]
pub struct Completions {
    /// Which shell.
    pub shell: clap_complete::Shell,
}

/// `schema`.
#[derive(Debug, Args)]
pub struct Schema {
    /// Of what.
    #[arg(default_value = "setup")]
    pub of: SchemaOf,
}

/// What has a schema.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum SchemaOf {
    /// The setup file
    Setup,
    /// The JSON report of optimize and simulate
    Report,
}

/// A JSON Schema, to standard output.
pub fn schema(command: &Schema) -> Result<Outcome, CliError> {
    let text = match command.of {
        SchemaOf::Setup => crate::setup::schema(),
        SchemaOf::Report => crate::report::json_schema(),
    };
    screen::put(text.as_bytes()).map(|()| Outcome::Done)
}

/// Completions for a shell, to standard output.
pub fn completions(shell: clap_complete::Shell, mut arguments: Command) -> Result<Outcome, CliError> {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut arguments, "feedwright", &mut text);
    screen::put(&text).map(|()| Outcome::Done)
}

/// The manual page and those of the commands one after the other, in roff, to standard output.
pub fn manual(mut command: Command) -> Result<Outcome, CliError> {
    command.build();
    let mut text = Vec::new();
    clap_mangen::Man::new(command.clone()).render(&mut text)?;
    for sub in command.get_subcommands().filter(|sub| !sub.is_hide_set() && sub.get_name() != "help") {
        clap_mangen::Man::new(sub.clone()).render(&mut text)?;
    }
    screen::put(&text).map(|()| Outcome::Done)
}
