//! `tools import`. In: a tool library of other software. Out: `[[tool]]` tables of a setup; `init` reads libraries by the same functions.

use clap::{Args, Subcommand};
use std::path::{Path, PathBuf};

use super::error::CliError;
use super::input;
use super::options::Global;
use super::output::{Kind, Outputs};
use super::screen::Screen;
use super::work::subprogram;
use crate::report::Outcome;
use crate::setup::tool_library::{self, Library};

/// `tools`.
#[derive(Debug, Subcommand)]
pub enum Tools {
    /// Print the tools of a library as [[tool]] tables of a setup
    Import(Import),
}

/// `tools import`.
#[derive(Debug, Args)]
pub struct Import {
    /// Fusion .json or .tools, FreeCAD .fctb or .fctl, LinuxCNC .tbl.
    pub file: PathBuf,
    /// A library that states no unit (LinuxCNC) is in inches.
    #[arg(long)]
    pub inch: bool,
    /// Write the tables to a file; - is standard output.
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

/// Prints or writes the tables.
pub fn import(command: &Import, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let mut outputs = Outputs::new([command.file.clone()], global.force);
    let output = outputs.open(command.output.as_deref().unwrap_or(Path::new("-")), Kind::Setup)?;
    let library = library(&command.file, command.inch)?;
    for note in &library.notes {
        screen.say(note);
    }
    output.write(tool_library::tables(&library.tools).as_bytes())?;
    outputs.commit()?;
    Ok(Outcome::Done)
}

/// Reads a library.
pub fn library(path: &Path, inch: bool) -> Result<Library, CliError> {
    let bytes = input::file(path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let beside = |name: &str| subprogram(path.parent(), name);
    tool_library::read(&name, &bytes, inch, &beside).map_err(|error| CliError::new(error.text, error.help))
}
