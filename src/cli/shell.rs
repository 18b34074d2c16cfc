//! What shells and `man` want of a command line: completions and the manual page, both made from the arguments themselves.

use clap::{Args, Command};

use super::error::CliError;
use super::screen;
use crate::report::Outcome;

/// `completions`.
#[derive(Debug, Args)]
pub struct Completions {
    /// Which shell.
    pub shell: clap_complete::Shell,
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
