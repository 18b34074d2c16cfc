//! The command line. In: arguments. Out: files, text, and the exit code: 0 done; 1 done, but there is a fault
//! ([`crate::report::Verdict`]) or `verify` found a difference; 2 bad usage or bad input, nothing written. One file per command.

mod allowed;
mod args;
mod batch;
mod bounds;
mod calibrate;
mod certify;
mod dump;
mod error;
mod evaluate;
mod init;
mod input;
mod keep;
mod lacks_of_wear;
mod learn;
mod library;
mod limits;
mod log;
mod optimize;
mod options;
mod output;
mod problem;
mod plain;
mod screen;
mod semifinish;
mod serve;
mod stepover;
mod shell;
mod start;
mod subprograms;
mod toollife;
mod toolpath;
mod tools;
mod under_way;
mod verify;
mod work;

use clap::{CommandFactory, Parser};
use std::ffi::OsString;
use std::process::ExitCode;

use crate::report::Outcome;
use args::{Arguments, Command};
use error::CliError;
use options::Global;
use screen::Screen;

/// Reads the arguments of the process, does what they say.
pub fn run() -> ExitCode {
    ExitCode::from(run_with(std::env::args_os()))
}

/// Does what these arguments say, the first of which is the name of the command; returns the exit code.
pub fn run_with(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let arguments = Arguments::parse_from(start::with_command(arguments.into_iter(), &Arguments::command()));
    let screen = Screen::new(&arguments.global);
    match dispatch(&arguments, screen) {
        Ok(outcome) => outcome.exit_code(),
        Err(error) => {
            screen.fail(&error);
            error.exit_code()
        }
    }
}

fn dispatch(arguments: &Arguments, screen: Screen) -> Result<Outcome, CliError> {
    let global = &arguments.global;
    threads(global)?;
    under_way::clean_up_on_signals();
    bounds::keep(global, screen)?;
    match &arguments.command {
        Command::Optimize(command) => optimize::optimize(command, global, screen),
        Command::Simulate(command) => optimize::simulate(command, global, screen),
        Command::Verify(command) => verify::verify(command, global, screen),
        Command::Certify(command) => certify::certify(command, global, screen),
        Command::Toolpath(command) => toolpath::toolpath(command, global, screen),
        Command::Limits(command) => limits::limits(command, global, screen),
        Command::Calibrate(command) => calibrate::calibrate(command, global, screen),
        Command::Learn(command) => learn::learn(command, global, screen),
        Command::LearnTable(command) => learn::learn_table(command, global, screen),
        Command::Log(command) => log::log(command, global, screen),
        Command::Evaluate(command) => evaluate::evaluate(command, global, screen),
        Command::Init(command) => init::init(command, global, screen),
        Command::Start(command) => start::start(command, global, screen),
        Command::Tools(tools::Tools::Import(command)) => tools::import(command, global, screen),
        Command::Toollife(command) => toollife::toollife(command, global, screen),
        Command::Semifinish(command) => semifinish::semifinish(command, global, screen),
        Command::Stepover(command) => stepover::stepover(command, global, screen),
        Command::Batch(command) => batch::batch(command, global, screen),
        Command::Serve(command) => serve::serve(command, global, screen),
        Command::Merge(command) => batch::merge(command, global, screen),
        Command::Dump(command) => dump::dump(command, global, screen),
        Command::Library(command) => library::library(command),
        Command::Completions(command) => shell::completions(command.shell, Arguments::command()),
        Command::Man => shell::manual(Arguments::command()),
        Command::Schema(command) => shell::schema(command),
    }
}

fn threads(global: &Global) -> Result<(), CliError> {
    let Some(count) = global.threads else { return Ok(()) };
    if count == 0 || count > 1024 {
        return Err(CliError::new(format!("--threads {count} makes no sense"), "give a number from 1 to 1024"));
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(count)
        .build_global()
        .map_err(|error| CliError::new(format!("cannot start {count} threads: {error}"), "give a smaller --threads"))
}
