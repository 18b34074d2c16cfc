//! `evaluate`. In: a model, and data that were not used to fit it. Out: its errors on these data.

use clap::Args;
use std::path::{Path, PathBuf};

use super::error::CliError;
use super::input;
use super::learn::{efficiency, finish, load_for_table, mapping_or, model_file, open, refused, sample, steady};
use super::options::{ColumnMap, Common, Global, Samples};
use super::output::{Kind, Outputs};
use super::screen::Screen;
use crate::job::learned;
use crate::learn::dataset::table_data::data;
use crate::learn::diagnose::Options;
use crate::learn::evaluate::{Evaluation, of_data, of_log};
use crate::learn::session::LogOptions;
use crate::machine::Job;
use crate::report::Outcome;
use crate::report::evaluate_json::evaluate_json;
use crate::report::learn::evaluate_words;
use crate::setup;

/// `evaluate`.
#[derive(Debug, Args)]
pub struct Evaluate {
    /// Process model, as `calibrate` and `learn` write it.
    #[arg(value_name = "MODEL.toml")]
    pub held: PathBuf,
    /// NC program of the log; without --log a table of steady cuts, CSV.
    pub input: PathBuf,
    /// Measured log of the program: CSV or MTConnect adapter output.
    #[arg(long, value_name = "LOG")]
    pub log: Option<PathBuf>,
    /// Setup and report.
    #[command(flatten)]
    pub common: Common,
    /// How its columns are named.
    #[command(flatten)]
    pub map: ColumnMap,
    /// What its forces are.
    #[command(flatten)]
    pub samples: Samples,
}

/// Holds a model against a log or a table.
pub fn evaluate(command: &Evaluate, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let inputs =
        [Some(command.held.clone()), Some(command.input.clone()), command.log.clone(), command.common.setup.clone()];
    let mut outputs = Outputs::new(inputs.into_iter().flatten(), global.force);
    let json = open(&mut outputs, command.common.json(), Kind::Json)?;
    let found = match &command.log {
        Some(log) => on_log(command, log, global, screen)?,
        None => on_table(command, screen)?,
    };
    finish(screen, outputs, json, &evaluate_json(&found), None, None, &evaluate_words(&found))
}

fn on_log(command: &Evaluate, log: &Path, global: &Global, screen: Screen) -> Result<Evaluation, CliError> {
    let source = input::program(&command.input)?;
    let bytes = input::file(log)?;
    let mut job = input::setup(command.common.setup(), &source, global)?.job;
    with_model(&mut job, &command.held, screen)?;
    let options = LogOptions {
        mapping: mapping_or(command.map.columns.as_deref(), &job)?,
        sample: sample(command.samples.sample),
        window_s: command.samples.window,
        diagnosis: Options::default(),
    };
    let bar = screen.progress("evaluating");
    let found = of_log(&source.bytes, &job, &bytes, &options, Some(&|path| std::fs::read(path)));
    bar.finish_and_clear();
    found.map_err(|error| refused(&error, log))
}

/// Puts a model file into a job. What happened once, in the log it was learned from, is left out, and that is said.
fn with_model(job: &mut Job, model: &Path, screen: Screen) -> Result<(), CliError> {
    job.process = model_file(model)?;
    for told in learned::apply(job) {
        screen.say(&format!("{} = {} ({})\n", told.key, told.value, told.source));
    }
    Ok(())
}

fn on_table(command: &Evaluate, screen: Screen) -> Result<Evaluation, CliError> {
    let bytes = input::file(&command.input)?;
    // A table with columns of its own for the tool needs no setup.
    let mut job = match command.common.setup() {
        Some(setup) => load_for_table(setup)?,
        None => setup::load_for_table("", Path::new(".")).map_err(|error| CliError::new(error.to_string(), ""))?,
    };
    with_model(&mut job, &command.held, screen)?;
    let of = |error| refused(&error, &command.input);
    let (frame, table) = steady(&bytes, command.map.columns.as_deref(), Some(&job)).map_err(|e| of(e.into()))?;
    let efficiency = efficiency(Some(&job));
    let spindle = Some(&job.machine.spindle);
    let found = data(&frame, &table, |y| y * efficiency.at(y), spindle).map_err(|e| of(e.into()))?;
    of_data(&found, &job).map_err(|e| of(e.into()))
}
