//! `calibrate`. In: a table of steady cuts, the log of a program, or readings of a load meter by eye. Out: coefficients; or, with nothing
//! measured, a program of test cuts that would give them.

use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};

use super::error::CliError;
use super::input;
use super::learn::{
    SETUP_OF_TABLE, declared_k_tc, efficiency, finish, finish_with, load, mapping_or, model_text, open, refused, steady,
};
use super::options::{ColumnMap, Common, ForceOn, Global};
use super::output::{Kind, Outputs};
use super::screen::Screen;
use crate::learn::calibrate::{CalibrateOptions, Calibration, calibrate as fit_table};
use crate::learn::calibrate::{load_meter, plan, sigmoid};
use crate::learn::dataset::binning::channels;
use crate::learn::dataset::steady_cuts::steady_cuts;
use crate::learn::dataset::steady_table::SteadyRow;
use crate::learn::log::columns::{DataError, Frame};
use crate::learn::log::read_log;
use crate::learn::log::resultant::Sample;
use crate::learn::process_model;
use crate::learn::program::simulated::{SimulatedProgram, simulate_for};
use crate::learn::regress::linear::Loss;
use crate::learn::session::{LearnError, of_another_program, of_one_run};
use crate::machine::Job;
use crate::report::Outcome;
use crate::report::calibrate_json::{calibrate_json, plan_json};
use crate::report::learn::{calibrate_words, plan_words};

/// `calibrate`; `--model` names the force model: power (default), linear-edge, kienzle, sigmoid, layer, response, polynomial.
#[derive(Debug, Args)]
#[command(mut_arg("setup", |arg| arg.help(SETUP_OF_TABLE)))]
pub struct Calibrate {
    /// Table of steady cuts, CSV; with --log or --reading the NC program.
    #[arg(value_name = "TABLE.csv")]
    pub input: Option<PathBuf>,
    /// Write the NC program of the test cuts instead (-o), and say how well they will tell the coefficients.
    #[arg(long, value_name = "KIND", conflicts_with_all = ["input", "log", "reading"])]
    pub plan: Option<PlanKind>,
    /// Log of the program: its steady cuts are the table.
    #[arg(long, value_name = "LOG", conflicts_with = "reading")]
    pub log: Option<PathBuf>,
    /// Load meter read by eye while the program runs, one for each tool: "T1 peak 45% idle 8%" (%, W or kW).
    #[arg(long, value_name = "LINE")]
    pub reading: Vec<String>,
    /// What measured forces act on.
    #[arg(long, value_name = "WHAT", default_value = "workpiece")]
    pub force_on: ForceOn,
    /// Setup and report.
    #[command(flatten)]
    pub common: Common,
    /// How its columns are named.
    #[command(flatten)]
    pub map: ColumnMap,
    /// Power with nothing cut, W, when it is known.
    #[arg(long, value_name = "W")]
    pub tare: Option<f64>,
    /// Outliers count less (Huber).
    #[arg(long)]
    pub robust: bool,
    /// Write the model file.
    #[arg(short, long, value_name = "model.toml")]
    pub output: Option<PathBuf>,
}

/// Kinds of test cuts.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum PlanKind {
    /// Eight immersions by four feeds, for spindle power
    Power,
    /// Nine cuts of an orthogonal array, for mean forces
    MeanForce,
    /// Steps of depth by two widths and feeds chosen for small errors, for the layers of a ball end
    Layer,
}

/// Coefficients from steady cuts.
pub fn calibrate(command: &Calibrate, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    if let Some(kind) = command.plan {
        return plan_tests(kind, command, global, screen);
    }
    let input = command.input.clone().ok_or_else(|| {
        CliError::new("nothing to calibrate from", "give TABLE.csv, PROGRAM with --log or --reading, or --plan KIND")
    })?;
    let inputs = [Some(input.clone()), command.common.setup.clone(), command.log.clone()];
    let mut outputs = Outputs::new(inputs.into_iter().flatten(), global.force);
    let json = open(&mut outputs, command.common.json(), Kind::Json)?;
    let model = open(&mut outputs, command.output.as_deref(), Kind::Markup)?;
    let result = if command.log.is_some() || !command.reading.is_empty() {
        from_program(command, &input, global)?
    } else {
        from_table(command, &input, global)?
    };
    let process = process_model::of_calibration(&result);
    let words = calibrate_words(&result);
    let comments = format!("# {}\n", words.lines().collect::<Vec<_>>().join("\n# "));
    finish(screen, outputs, json, &calibrate_json(&result), model, model_text(process.as_ref(), &comments), &words)
}

fn options<'a>(command: &Calibrate, setup: Option<&'a Job>) -> CalibrateOptions<'a> {
    let loss = if command.robust { Loss::Huber } else { Loss::Squares };
    CalibrateOptions {
        known_tare_w: command.tare,
        spindle: setup.map(|job| &job.machine.spindle),
        loss,
        declared_k_tc: setup.and_then(declared_k_tc),
        force_on_tool: command.force_on.is_tool(),
    }
}

fn model_name(global: &Global) -> String {
    global.model.as_ref().map_or("power".into(), |name| name.to_string_lossy().into_owned())
}

fn from_table(command: &Calibrate, table: &Path, global: &Global) -> Result<Calibration, CliError> {
    let bytes = input::file(table)?;
    let setup = command.common.setup().map(load).transpose()?;
    let wrong = |error: DataError| refused(&error.into(), table);
    let (frame, rows) = steady(&bytes, command.map.columns.as_deref(), setup.as_ref()).map_err(wrong)?;
    if model_name(global) == "sigmoid" {
        let tool = setup.as_ref().and_then(|job| record_tool(job, &frame));
        let tool = tool.ok_or_else(|| {
            CliError::new(
                "the model sigmoid needs the tool of the record",
                "give --setup with diameter, flutes, helix and rake",
            )
        })?;
        return sigmoid::calibrate(&frame, &rows, tool, command.force_on.is_tool()).map_err(wrong);
    }
    fit(command, global, &frame, &rows, setup.as_ref()).map_err(wrong)
}

/// The tool that a record names, or the first.
fn record_tool<'a>(job: &'a Job, frame: &Frame) -> Option<&'a crate::machine::Tool> {
    let named = frame.numbers("tool").and_then(|t| t.into_iter().find(|n| n.is_finite()));
    named.and_then(|n| job.tool(n as u32)).or(job.tools.first())
}

fn fit(
    command: &Calibrate,
    global: &Global,
    frame: &Frame,
    rows: &[SteadyRow],
    setup: Option<&Job>,
) -> Result<Calibration, DataError> {
    let efficiency = efficiency(setup);
    fit_table(frame, rows, &model_name(global), options(command, setup), |y| y * efficiency.at(y))
}

/// Readings of a load meter, or a log, of a program.
fn from_program(command: &Calibrate, program: &Path, global: &Global) -> Result<Calibration, CliError> {
    let source = input::program(program)?;
    // Here --model names a force model, not a file.
    let job = input::setup(command.common.setup(), &source, &Global { model: None, ..global.clone() })?.job;
    let wrong = |error: LearnError| refused(&error, program);
    let ready = |forces: bool| -> Result<SimulatedProgram, CliError> {
        let sample = forces.then(Sample::default);
        simulate_for(&source.bytes, &job, sample, Some(&|path| std::fs::read(path))).map_err(|e| wrong(e.into()))
    };
    let Some(path) = &command.log else {
        let readings = command.reading.iter().map(|text| load_meter::parse(text)).collect::<Result<Vec<_>, _>>();
        let readings = readings.map_err(|e| wrong(e.into()))?;
        return load_meter::coefficients(&readings, &ready(false)?, &job).map_err(|e| wrong(e.into()));
    };
    let wrong = |error: LearnError| refused(&error, path);
    let log = read_log(&input::file(path)?, &mapping_or(command.map.columns.as_deref(), &job)?)
        .map_err(|e| wrong(e.into()))?;
    let channels = channels(&log);
    let prepared = ready(false)?;
    let (log, tied) = of_one_run(log, &prepared, &job, &channels).map_err(wrong)?;
    if let Some(why) = of_another_program(&tied) {
        return Err(wrong(DataError::Unfit(why).into()));
    }
    let (frame, rows) =
        steady_cuts(&log, &tied, prepared.timeline(), &job, command.force_on.is_tool()).map_err(|e| wrong(e.into()))?;
    let mut result = fit(command, global, &frame, &rows, Some(&job)).map_err(|e| wrong(e.into()))?;
    result.notes.extend(log.warnings);
    Ok(result)
}

/// Writes the program of test cuts.
fn plan_tests(kind: PlanKind, command: &Calibrate, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let setup = command.common.setup().ok_or_else(|| {
        CliError::new("test cuts need a setup", "give --setup with machine, stock (a box) and the tool to be tested")
    })?;
    let job = load(setup)?;
    let kind = match kind {
        PlanKind::Power => plan::Kind::Power,
        PlanKind::MeanForce => plan::Kind::MeanForce,
        PlanKind::Layer => plan::Kind::Layer,
    };
    let mut outputs = Outputs::new([setup.to_owned()], global.force);
    let json = open(&mut outputs, command.common.json(), Kind::Json)?;
    let program = open(&mut outputs, command.output.as_deref(), Kind::Markup)?;
    let plan = plan::plan(kind, &job)
        .map_err(|error| CliError::new(error.to_string(), "see `feedwright schema` for stock and tools"))?;
    finish_with(screen, outputs, (json, &plan_json(&plan)), (program, Ok(plan.program.clone())), &plan_words(&plan))
}
