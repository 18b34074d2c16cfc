//! `learn` and `learn-table`. In: measured data. Out: named effects and a model file.

use clap::Args;
use std::path::{Path, PathBuf};

use super::error::CliError;
use super::input;
use super::options::{ColumnMap, Common, ForceOn, Global, SampleKind, Samples};
use super::output::{Kind, Output, Outputs};
use super::screen::Screen;
use crate::job::learned;
use crate::learn::calibrate::experiment::experiment;
use crate::learn::dataset::samples::Data;
use crate::learn::dataset::steady_table::{SteadyRow, TableTool, rows};
use crate::learn::diagnose::Options;
use crate::learn::diagnose::doubts;
use crate::learn::diagnose::plotted::curves;
use crate::learn::log::columns::{DataError, Frame, read};
use crate::learn::log::resultant::Sample;
use crate::learn::model::design::in_model_file;
use crate::learn::process_model;
use crate::learn::program::declared::declared;
use crate::learn::report::LearnReport;
use crate::learn::session::{LearnError, Learned, LogOptions, run};
use crate::learn::table;
use crate::machine::material::Process;
use crate::machine::{Job, Table};
use crate::report::learn::learn_words;
use crate::report::learn_json::learn_json;
use crate::report::{Outcome, learn_html};
use crate::setup::{self, SetupError};

/// What a log may hold, for `learn --help`.
pub(super) const LOG_COLUMNS: &str = "Columns of a log, by the names in its header or as --columns maps them (units in brackets or at the end are \
converted, case and blanks do not matter):
  time_s                       seconds, ISO 8601, a date and time, or a time of day
  sample_1000hz                a counter of readings in place of the time, here of 1000 a second (halsampler -t)
  x_mm y_mm z_mm               position in the work frame
  line, block                  physical line (from 1), index of the block (from 0)
  feed_mm_min, spindle_rpm, tool, feed_override_percent
and at least one of
  spindle_power_w              as the meter reads it
  spindle_torque_nm  spindle_current_a  spindle_load_percent
  force_x_n force_y_n force_z_n force_xy_n
Tables with commas, semicolons, tabs or blanks, decimal commas, lines before the header, a row of units; workbooks (.xlsx); MTConnect \
adapter output (SHDR) and streams (XML). `feedwright log FILE` shows what is read of a file.";

/// What a table of steady cuts takes from a setup.
pub(super) const SETUP_OF_TABLE: &str = "Setup file with the tool and the efficiency of the drive";

/// `learn`.
#[derive(Debug, Args)]
#[command(after_help = LOG_COLUMNS)]
pub struct Learn {
    /// NC program.
    pub program: PathBuf,
    /// Measured log: CSV or MTConnect adapter output.
    #[arg(long, value_name = "LOG")]
    pub log: PathBuf,
    /// Setup and report.
    #[command(flatten)]
    pub common: Common,
    /// How its columns are named.
    #[command(flatten)]
    pub map: ColumnMap,
    /// What its forces are.
    #[command(flatten)]
    pub samples: Samples,
    /// What measured forces act on (a resultant is the same on both).
    #[arg(long, value_name = "WHAT", default_value = "workpiece")]
    pub force_on: ForceOn,
    /// Write the model file.
    #[arg(short, long, value_name = "model.toml")]
    pub output: Option<PathBuf>,
    /// Write the report as one HTML file.
    #[arg(long, value_name = "R.html")]
    pub report: Option<PathBuf>,
    /// Write the NC program of the cuts that separate effects which explain the log equally well.
    #[arg(long, value_name = "NEXT.nc")]
    pub experiment: Option<PathBuf>,
}

/// `learn-table`.
#[derive(Debug, Args)]
#[command(mut_arg("setup", |arg| arg.help(SETUP_OF_TABLE)))]
pub struct LearnTable {
    /// Table of steady cuts, CSV.
    pub table: PathBuf,
    /// Setup and report.
    #[command(flatten)]
    pub common: Common,
    /// How its columns are named.
    #[command(flatten)]
    pub map: ColumnMap,
    /// Write the model file.
    #[arg(short, long, value_name = "model.toml")]
    pub output: Option<PathBuf>,
    /// Write the report as one HTML file.
    #[arg(long, value_name = "R.html")]
    pub report: Option<PathBuf>,
}

/// Closes the loop for a program and its log.
pub fn learn(command: &Learn, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let source = input::program(&command.program)?;
    let log = input::file(&command.log)?;
    let mut found = input::setup(command.common.setup(), &source, global)?;
    for told in learned::apply(&mut found.job) {
        screen.say(&format!("{} = {} ({})\n", told.key, told.value, told.source));
    }
    let inputs = [source.path.clone(), found.path.clone(), Some(command.log.clone())];
    let mut outputs = Outputs::new(inputs.into_iter().flatten(), global.force);
    let json = open(&mut outputs, command.common.json(), Kind::Json)?;
    let model = open(&mut outputs, command.output.as_deref(), Kind::Markup)?;
    let page = open(&mut outputs, command.report.as_deref(), Kind::Markup)?;
    let next = open(&mut outputs, command.experiment.as_deref(), Kind::Markup)?;
    let options = LogOptions {
        mapping: mapping_or(command.map.columns.as_deref(), &found.job)?,
        sample: sample(command.samples.sample),
        window_s: command.samples.window,
        diagnosis: Options { known: in_model_file(&found.job.process), ..Options::default() },
    };
    let bar = screen.progress("learning");
    let learned = run(&source.bytes, &found.job, &log, &options, Some(&|path| std::fs::read(path)));
    bar.finish_and_clear();
    let Learned { report, data } = learned.map_err(|error| refused(&error, &command.log))?;
    if let Some(next) = next {
        write_experiment(next, &data, &report, &found.job, screen)?;
    }
    if let Some(page) = page {
        page.write(learn_html(&report, &curves(&data, &report), &source.name).as_bytes())?;
    }
    let process = process_model::of_report(&report, &found.job);
    let text = model_text(process.as_ref(), &process_model::provenance(&report));
    finish(screen, outputs, json, &learn_json(&report), model, text, &learn_words(&report))
}

/// What a sample of a force is, as the command line has it.
pub(super) fn sample(kind: SampleKind) -> Sample {
    match kind {
        SampleKind::Instant => Sample::Instant,
        SampleKind::Mean => Sample::Mean,
        SampleKind::Peak => Sample::Peak,
    }
}

/// Reads a model file.
pub(super) fn model_file(path: &Path) -> Result<Process, CliError> {
    let text = input::text(path)?;
    setup::load_model(&text).map_err(|error| CliError::Drawn {
        file: path.display().to_string(),
        text: text.into_bytes(),
        diagnostics: error.diagnostics(),
    })
}

/// The cuts that separate rivals; nothing is written where there are none.
fn write_experiment(
    next: Output,
    data: &Data,
    report: &LearnReport,
    job: &Job,
    screen: Screen,
) -> Result<(), CliError> {
    let found = experiment(data, report, job)
        .map_err(|error| CliError::new(error.to_string(), "leave out --experiment to see the report"))?;
    let Some(found) = found else {
        let why = report.confounded.first().map_or_else(
            || "no effects are confounded".to_owned(),
            |group| {
                format!(
                    "of {} only one predicts other cuts; to part them: {}",
                    group.names.join(", "),
                    group.experiment
                )
            },
        );
        screen.say(&format!("no experiment was written: {why}\n"));
        return Ok(());
    };
    let noise = found.noise.map_or_else(String::new, |n| format!(" (noise of a reading {n:.3})"));
    screen.say(&format!(
        "the next cut, {}: predictions of {} differ by {:.3} in the mean{noise}\n",
        found.what,
        found.names.join(" and "),
        found.difference
    ));
    next.write(found.program.as_bytes())
}

/// Diagnosis of a table of steady cuts.
pub fn learn_table(command: &LearnTable, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let bytes = input::file(&command.table)?;
    let setup = command.common.setup().map(load_for_table).transpose()?;
    let mut outputs =
        Outputs::new([Some(command.table.clone()), command.common.setup.clone()].into_iter().flatten(), global.force);
    let json = open(&mut outputs, command.common.json(), Kind::Json)?;
    let model = open(&mut outputs, command.output.as_deref(), Kind::Markup)?;
    let page = open(&mut outputs, command.report.as_deref(), Kind::Markup)?;
    let (frame, table) = steady(&bytes, command.map.columns.as_deref(), setup.as_ref())
        .map_err(|e| refused(&e.into(), &command.table))?;
    let efficiency = efficiency(setup.as_ref());
    let spindle = setup.as_ref().map(|job| &job.machine.spindle);
    let (mut report, found) = table::learn_table(&frame, &table, |y| y * efficiency.at(y), spindle)
        .map_err(|e| refused(&e.into(), &command.table))?;
    let doubts = doubts::of_table(&report, &found, setup.as_ref().and_then(declared_k_tc));
    report.supports_model &= doubts.is_empty();
    report.warnings.extend(doubts);
    if let Some(page) = page {
        page.write(learn_html(&report, &curves(&found, &report), &command.table.display().to_string()).as_bytes())?;
    }
    let job = setup.map_or_else(|| setup::load_for_table("", Path::new(".")), Ok);
    let process = job.ok().and_then(|job| process_model::of_report(&report, &job));
    let text = model_text(process.as_ref(), &process_model::provenance(&report));
    finish(screen, outputs, json, &learn_json(&report), model, text, &learn_words(&report))
}

/// Tangential cutting coefficient of the first tool's material, N/mm².
pub(super) fn declared_k_tc(job: &Job) -> Option<f64> {
    declared(job, job.tools.first()?).map(|k| k.k_tc)
}

/// Reads a setup file.
pub(super) fn load(path: &Path) -> Result<Job, CliError> {
    read_setup(path, |text, dir| setup::load(text, dir).map(|(job, _)| job))
}

/// Reads the setup file of a table, which brings its own geometry: it needs no stock.
pub(super) fn load_for_table(path: &Path) -> Result<Job, CliError> {
    read_setup(path, setup::load_for_table)
}

fn read_setup(path: &Path, read: impl Fn(&str, &Path) -> Result<Job, SetupError>) -> Result<Job, CliError> {
    let text = input::text(path)?;
    let dir = path.parent().unwrap_or(Path::new("."));
    read(&text, dir).map_err(|error| CliError::Drawn {
        file: path.display().to_string(),
        text: text.into_bytes(),
        diagnostics: error.diagnostics(),
    })
}

/// A table of steady cuts, with the tools of a setup.
pub(super) fn steady(
    bytes: &[u8],
    columns: Option<&str>,
    setup: Option<&Job>,
) -> Result<(Frame, Vec<SteadyRow>), DataError> {
    let mapping = mapping(columns).map_err(|error| DataError::Unfit(error.to_string()))?;
    let frame = read(bytes, &mapping)?;
    let tools: Vec<TableTool> = setup.iter().flat_map(|job| &job.tools).map(TableTool::from).collect();
    let table = rows(&frame, &tools)?;
    Ok((frame, table))
}

/// Efficiency of the drive; 1 without a setup.
pub(super) fn efficiency(setup: Option<&Job>) -> Table {
    setup.map_or_else(|| Table::constant(1.0), |job| job.machine.spindle.efficiency.clone())
}

/// `theirs=ours,…`, or the names of all columns in their order, `time_s,x_mm,…`, for a file without a header (theirs is then empty).
pub(super) fn mapping(text: Option<&str>) -> Result<Vec<(String, String)>, CliError> {
    let Some(text) = text else { return Ok(Vec::new()) };
    let in_order = !text.contains('=');
    let pair = |part: &str| {
        let (theirs, ours) = if in_order { ("", part) } else { part.split_once('=').unwrap_or(("", "")) };
        if ours.trim().is_empty() {
            return Err(CliError::new(
                format!("--columns: `{part}` is no mapping"),
                "write THEIRS=OURS, several with commas, or the names of all columns in their order",
            ));
        }
        Ok((theirs.trim().to_owned(), ours.trim().to_owned()))
    };
    text.split(',').map(pair).collect()
}

/// The mapping of the command line, else that of the setup.
pub(super) fn mapping_or(text: Option<&str>, job: &Job) -> Result<Vec<(String, String)>, CliError> {
    if text.is_none() { Ok(job.log_columns.clone()) } else { mapping(text) }
}

/// Data that cannot be used.
pub(super) fn refused(error: &LearnError, path: &Path) -> CliError {
    CliError::new(
        format!("{}: {error}", path.display()),
        "no model was written; see `feedwright learn --help` for the columns",
    )
}

/// Makes ready an output, if it is wanted.
pub(super) fn open(outputs: &mut Outputs, path: Option<&Path>, kind: Kind) -> Result<Option<Output>, CliError> {
    path.map(|path| outputs.open(path, kind)).transpose()
}

/// A model file with its provenance.
pub(super) fn model_text(process: Option<&Process>, comments: &str) -> Option<String> {
    process.map(|process| setup::write_model(process) + comments)
}

/// Writes all outputs and says the words.
pub(super) fn finish(
    screen: Screen,
    outputs: Outputs,
    json: Option<Output>,
    report: &str,
    model: Option<Output>,
    text: Option<String>,
    words: &str,
) -> Result<Outcome, CliError> {
    let read_back = text.map(|text| setup::load_model(&text).map(|_| text));
    let text = match read_back {
        Some(Ok(text)) => Ok(text),
        Some(Err(error)) => Err(format!("no model file was written, for none could be read back: {error}")),
        None => Err("no model file was written: the data do not support one".to_owned()),
    };
    finish_with(screen, outputs, (json, report), (model, text), words)
}

/// The same for a file whose text is ready, or the reason why there is none.
pub(super) fn finish_with(
    screen: Screen,
    outputs: Outputs,
    (json, report): (Option<Output>, &str),
    (model, text): (Option<Output>, Result<String, String>),
    words: &str,
) -> Result<Outcome, CliError> {
    let quiet = json.as_ref().is_some_and(Output::is_stdout) || model.as_ref().is_some_and(Output::is_stdout);
    if let Some(output) = json {
        output.write(report.as_bytes())?;
    }
    if let Some(output) = model {
        match text {
            Ok(text) => output.write(text.as_bytes())?,
            Err(why) => {
                let old = output.existing().map_or_else(String::new, |old| {
                    format!("; {} is that of an earlier run, and not of these data", old.display())
                });
                screen.say(&format!("{why}{old}\n"));
            }
        }
    }
    outputs.commit()?;
    if quiet {
        screen.say(words);
    } else {
        screen.show(words)?;
    }
    Ok(Outcome::Done)
}
