//! What shells and `man` want of a command line: completions and the manual page, both made from the arguments themselves.

use clap::CommandFactory;

use super::Outcome;
use super::args::Arguments;
use super::error::CliError;
use super::screen;

/// Completions for a shell, to standard output.
pub fn completions(shell: clap_complete::Shell) -> Result<Outcome, CliError> {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "feedwright", &mut text);
    screen::put(&text).map(|()| Outcome::Done)
}

/// The manual page and those of the commands one after the other, in roff, to standard output.
pub fn manual() -> Result<Outcome, CliError> {
    let mut command = Arguments::command();
    command.build();
    let mut text = Vec::new();
    clap_mangen::Man::new(command.clone()).render(&mut text)?;
    for sub in command.get_subcommands().filter(|sub| !sub.is_hide_set() && sub.get_name() != "help") {
        clap_mangen::Man::new(sub.clone()).render(&mut text)?;
    }
    screen::put(&text).map(|()| Outcome::Done)
}
