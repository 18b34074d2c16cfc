//! `feedwright part.nc` without a command. In: a program. Out: a setup, if there is none (drafted from the text, with questions on a terminal for
//! what the text does not tell); the program with new feeds; the page in the browser.

use clap::{Args, Command};
use std::ffi::OsString;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use super::error::CliError;
use super::init::Told;
use super::input::Source;
use super::optimize::Optimize;
use super::options::{Common, Global};
use super::output::{Kind, Outputs};
use super::screen::Screen;
use super::work::Work;
use super::{init, input, optimize};
use crate::machine::{Job, Limits};
use crate::report::Outcome;

/// No command.
#[derive(Debug, Args)]
pub struct Start {
    /// NC program.
    pub program: PathBuf,
    /// What its text does not tell.
    #[command(flatten)]
    pub told: Told,
    /// Do not open the page.
    #[arg(long)]
    pub no_open: bool,
}

/// The arguments with the command `start` put in where the first is a file and no command.
pub fn with_command(arguments: impl Iterator<Item = OsString>, known: &Command) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = arguments.collect();
    let is_program = arguments.get(1).is_some_and(|first| {
        let command = known.get_subcommands().any(|command| command.get_name() == first);
        let option = first.to_string_lossy().starts_with('-');
        !command && !option && Path::new(first).is_file()
    });
    if is_program {
        arguments.insert(1, "start".into());
    }
    arguments
}

/// Setup, feeds, page.
pub fn start(command: &Start, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let source = input::program(&command.program)?;
    let setup = match input::beside(&source) {
        Some(path) => path,
        None => drafted(command, &source, global, screen)?,
    };
    let page = command.program.with_extension("fw.html");
    let job = input::setup(Some(&setup), &source, global)?.job;
    let work = Work {
        report: Some(page.clone()),
        common: Common { setup: Some(setup), json: None },
        reference: own_loads(&job),
        ..Work::of(command.program.clone())
    };
    let outcome = optimize::optimize(&Optimize::of(work), global, screen)?;
    screen.say(&format!("page      {}", page.display()));
    if !command.no_open && !global.quiet && std::io::stdout().is_terminal() {
        // A machine without a browser shows nothing; the page is there all the same.
        let _ = open::that_detached(&page);
    }
    Ok(outcome)
}

/// The setup of a program that has none, where its text and the user tell enough.
fn drafted(command: &Start, source: &Source, global: &Global, screen: Screen) -> Result<PathBuf, CliError> {
    let target = init::target(&command.program);
    let mut outputs = Outputs::new(source.path.clone(), global.force);
    let output = outputs.open(&target, Kind::Setup)?;
    let facts = init::known(source, &command.told, global, screen)?;
    let lacking = facts.lacking();
    if !lacking.is_empty() {
        let program = typed(&command.program);
        return Err(CliError::new(
            format!("{} does not tell:\n{}", source.name, init::listed(&lacking)),
            format!(
                "say it here: feedwright {program} {}\nor fill it in: feedwright init {program}",
                init::options(&lacking)
            ),
        ));
    }
    output.write(facts.text().as_bytes())?;
    outputs.commit()?;
    screen.say(&format!("written   {}", target.display()));
    Ok(target)
}

/// A path as it is typed in a command: in quotes where it has a blank.
fn typed(path: &Path) -> String {
    let text = path.display().to_string();
    if text.contains(char::is_whitespace) { format!("\"{text}\"") } else { text }
}

/// Without a limit of its own the program's own loads are the limit: nothing is loaded more than it is already. The percentile of the cut
/// length for [`crate::job::Wanted`].
pub fn own_loads(job: &Job) -> Option<f64> {
    (!limits_a_load(job)).then_some(100.0)
}

/// Does the setup limit a load anywhere?
fn limits_a_load(job: &Job) -> bool {
    let tools = job.tools.iter().map(|tool| &tool.limits);
    let operations = job.operations.iter().map(|operation| &operation.limits);
    std::iter::once(&job.limits).chain(tools).chain(operations).any(Limits::bounds_a_load)
}
