//! The public face: Feedwright as a library. In: bytes of NC programs, setups and measured data. Out: what the commands show, as values
//! and as the same text and JSON.
//!
//! [`parse`] reads a program, [`simulate`] predicts its loads and time, [`optimise`] rewrites its feeds, [`verify`] proves that only
//! feeds changed, [`calibrate`] finds coefficients in a table of steady cuts, [`learn()`] what a model lacks in a measured log. Nothing is
//! printed or written; read are only the files that a setup names (stock, process model) and subprograms beside it.
//!
//! Lengths are in mm, feeds in mm/min, times in s, whatever the unit of the program.

use std::path::{Path, PathBuf};

pub use crate::diag::{Diagnostic, Severity};
pub use crate::report::Outcome;
pub use crate::setup::SetupError;

use crate::engage;
use crate::job::{self, JobError, Keep, Task, Wanted, Watch, learned};
use crate::learn::calibrate::{CalibrateOptions, Calibration, calibrate as fit};
use crate::learn::dataset::steady_table::{TableTool, rows};
use crate::learn::diagnose::Options as Diagnosis;
use crate::learn::log::columns::{DataError, read};
use crate::learn::model::design::in_model_file;
use crate::learn::process_model;
use crate::learn::program::declared::declared;
use crate::learn::report::LearnReport;
use crate::learn::session::{LearnError, LogOptions, run as learn_from};
use crate::machine::{Job, Table};
use crate::nc::{self, Dialect, Environment, MoveKind};
use crate::outcome::ProgramRun;
use crate::report::{self, Extras, Figures, Provenance};
use crate::rewrite;
use crate::setup::{self, Assumption};
use crate::units::mm_min_from_mm_s;

/// Why there is no answer. The message says what is wrong and where.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A program for another kind of control or machine.
    #[error("{0}; {1}")]
    Refused(String, String),
    /// A program that cannot be simulated: no motion, a tool that the setup does not describe, no stock, a tool that wears out.
    #[error(transparent)]
    Job(#[from] JobError),
    /// What was written would not be the same program but for its feeds. It is never handed out; please report it.
    #[error("the rewritten program would not be the same but for its feeds: {0}")]
    NotTheSame(String),
    /// A table that cannot be read, or does not tell the coefficients.
    #[error(transparent)]
    Table(#[from] DataError),
    /// A log that cannot be read, or not be laid along the program.
    #[error(transparent)]
    Log(#[from] LearnError),
}

/// Machine, tools, stock, material and limits, as a setup file describes them.
#[derive(Debug, Clone)]
pub struct Setup {
    job: Job,
    assumptions: Vec<Assumption>,
    folder: PathBuf,
    text: String,
}

impl Setup {
    /// Reads the text of a setup file; paths in it, and subprograms, count from `folder`.
    ///
    /// # Errors
    /// Every key that is not known and every value that makes no sense, each with its place and a remedy
    /// ([`SetupError::diagnostics`]); a file it names that cannot be read.
    pub fn from_toml(text: &str, folder: impl Into<PathBuf>) -> Result<Self, SetupError> {
        let folder = folder.into();
        let (job, assumptions) = setup::load(text, &folder)?;
        Ok(Self { job, assumptions, folder, text: text.to_owned() })
    }

    /// With the process model that `calibrate` or `learn` wrote, in place of its own.
    ///
    /// # Errors
    /// As [`Setup::from_toml`], of the text of the model.
    pub fn with_model(mut self, text: &str) -> Result<Self, SetupError> {
        let process = setup::load_model(text)?;
        setup::take_model(&mut self.job, &mut self.assumptions, process);
        Ok(self)
    }
}

/// An NC program, as it was read.
#[derive(Debug, Clone)]
pub struct Program {
    text: nc::Program,
    toolpath: nc::Toolpath,
}

/// One motion of a program.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Motion {
    /// Line of the program, from 1.
    pub line: u32,
    /// End of the motion in the work coordinate system, mm.
    pub to_mm: [f64; 3],
    /// Length of the path, mm.
    pub length_mm: f64,
    /// Feed, mm/min; `None` at rapid.
    pub feed_mm_min: Option<f64>,
    /// Number of the tool in the spindle.
    pub tool: u32,
}

/// Reads a program. What cannot be understood is kept as it stands, its feed frozen, and said in [`Program::diagnostics`].
///
/// ```
/// let program = feedwright::parse("G21 G90\nT1 M6\nS8000 M3\nG0 X0 Y0 Z5\nG1 Z-2 F300\nX40 F900\nM30\n", None)?;
/// let feeds: Vec<f64> = program.motions().filter_map(|motion| motion.feed_mm_min).collect();
/// assert_eq!(feeds, [300.0, 900.0]);
/// # Ok::<(), feedwright::Error>(())
/// ```
///
/// # Errors
/// [`Error::Refused`] for a program whose words mean other things than those of every control that is read, and for turning.
pub fn parse(bytes: impl Into<Vec<u8>>, setup: Option<&Setup>) -> Result<Program, Error> {
    let job = setup.map(|setup| &setup.job);
    let named = job.and_then(|job| job.machine.dialect.as_deref());
    let text = nc::parse(bytes.into(), named.and_then(Dialect::from_name));
    if let Some(why) = nc::refusal(&text, false) {
        return Err(Error::Refused(why.text, why.help));
    }
    let toolpath = with_environment(&text, setup, &mut |environment| nc::interpret(&text, environment));
    Ok(Program { text, toolpath })
}

impl Program {
    /// Name of the dialect it is read in.
    pub fn dialect(&self) -> &'static str {
        self.text.dialect().name()
    }

    /// Its motions, in the order they are executed.
    pub fn motions(&self) -> impl Iterator<Item = Motion> + '_ {
        self.toolpath.moves.iter().zip(0..).map(|(motion, id)| {
            let curve = motion.curve();
            let to = curve.to() - self.toolpath.shift_at(crate::ids::MoveId(id));
            let feed = (motion.kind == MoveKind::Feed).then(|| mm_min_from_mm_s(motion.feed.mm_s));
            Motion {
                line: motion.line,
                to_mm: [to.x, to.y, to.z],
                length_mm: curve.length(),
                feed_mm_min: feed,
                tool: motion.tool,
            }
        })
    }

    /// What was noticed: words that are not known, moves whose feed stays, and why.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.toolpath.diagnostics
    }

    /// Its bytes, exactly as they were given.
    pub fn bytes(&self) -> &[u8] {
        self.text.own_text()
    }
}

/// Hands the surroundings of a program to `read`: what the setup says, subprograms beside it, the unit its numbers are in.
fn with_environment<T>(text: &nc::Program, setup: Option<&Setup>, read: &mut dyn FnMut(&Environment) -> T) -> T {
    let folder = setup.map(|setup| setup.folder.as_path());
    let load = |name: &str| subprogram(folder, name);
    let job = setup.map(|setup| &setup.job);
    let environment = Environment { load: &load, ..job.map(Environment::from_job).unwrap_or_default() };
    read(&nc::unit::with_its_unit(text, environment, job))
}

/// A file of this name in the folder, if the name cannot lead out of it.
pub(crate) fn subprogram(folder: Option<&Path>, name: &str) -> Option<Vec<u8>> {
    let safe = !name.is_empty()
        && name.chars().all(|c| c.is_ascii_alphanumeric() || "._-".contains(c))
        && !name.starts_with('.');
    std::fs::read(folder.filter(|_| safe)?.join(name)).ok()
}

/// Loads and times of a program: as programmed, and with new feeds where it was optimised.
pub struct Prediction {
    run: ProgramRun,
    figures: Figures,
    provenance: Provenance,
}

/// The largest value of a limited load, or of one that every report tells.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct LargestLoad {
    /// Name of the load, as in `[limits]`.
    pub name: &'static str,
    /// Unit of its values.
    pub unit: &'static str,
    /// The tool it holds for; `None`: all.
    pub tool: Option<u32>,
    /// The limit; `None` where it is not one number.
    pub limit: Option<f64>,
    /// Largest value as programmed.
    pub before: Option<f64>,
    /// Largest value as written.
    pub after: Option<f64>,
}

impl Prediction {
    fn of(run: ProgramRun, setup: &Setup) -> Self {
        let figures = report::figures(&run);
        let provenance = report::provenance(&run, Some(setup.text.as_bytes()), Vec::new());
        Self { run, figures, provenance }
    }

    /// Time as programmed, and as written, as the control realises it, s.
    pub fn time_s(&self) -> [f64; 2] {
        [self.run.realised_before.total_s, self.run.realised_after().total_s]
    }

    /// Largest loads, in the units of the report.
    pub fn loads(&self) -> Vec<LargestLoad> {
        let load = |figure: &report::LimitFigure| LargestLoad {
            name: figure.kind.name(),
            unit: figure.kind.unit(),
            tool: figure.tool,
            limit: figure.limit,
            before: figure.before_max,
            after: figure.after_max,
        };
        self.figures.limits.iter().filter(|figure| figure.kind.is_load()).map(load).collect()
    }

    /// [`Outcome::Unmet`] where a limit is not met somewhere, or something collides; [`Prediction::headline`] says it.
    pub fn outcome(&self) -> Outcome {
        self.figures.verdict.outcome
    }

    /// The verdict in one sentence.
    pub fn headline(&self) -> &str {
        &self.figures.verdict.headline
    }

    /// What was noticed about program, setup and cuts.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.run.diagnostics
    }

    /// The summary that the commands print; `name` stands for the program.
    pub fn summary(&self, name: &str) -> String {
        report::summary(&self.run, &self.figures, name)
    }

    /// A table with one row per station of the path: time, place, feeds, engagement and loads before and after.
    ///
    /// # Panics
    /// Never: what is written into memory cannot fail.
    pub fn csv(&self) -> String {
        let mut table = Vec::new();
        report::csv(&self.run, &mut table).expect("memory takes everything");
        String::from_utf8(table).expect("a table is text")
    }

    /// The JSON report.
    pub fn json(&self, name: &str) -> String {
        report::json(&self.run, &self.figures, &self.provenance, name, Extras { blocks: false, timings: None })
    }
}

/// Predicts loads and time of a program as it stands.
///
/// ```
/// # let setup = "[stock]\nmaterial = \"aluminium-6061-t6\"\nbox = { min = [0, 0, -10], max = [40, 20, 0] }\n\
/// #     [[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 6\nflutes = 3\n";
/// let setup = feedwright::Setup::from_toml(setup, ".")?;
/// let text = "G21 G90\nT1 M6\nS8000 M3\nG0 X-10 Y5 Z2\nG1 Z-2 F300\nX50 F900\nG0 Z10\nM30\n";
/// let program = feedwright::parse(text, Some(&setup))?;
/// let predicted = feedwright::simulate(&program, &setup)?;
/// assert!(predicted.time_s()[0] > 4.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::Job`].
pub fn simulate(program: &Program, setup: &Setup) -> Result<Prediction, Error> {
    Ok(Prediction::of(with_watch(program, setup, job::simulate)?, setup))
}

fn with_watch(
    program: &Program,
    setup: &Setup,
    pipeline: fn(Task, &Watch) -> Result<ProgramRun, JobError>,
) -> Result<ProgramRun, JobError> {
    let watch = Watch {
        progress: &|_, _| {},
        clock: &|| 0.0,
        subprograms: &|name| subprogram(Some(&setup.folder), name),
        engage: engage::Options { loader: Some(&|path| std::fs::read(path)), ..engage::Options::default() },
        keep: Keep::default(),
    };
    let task = Task {
        program: program.text.clone(),
        job: setup.job.clone(),
        assumptions: setup.assumptions.clone(),
        wanted: Wanted::default(),
    };
    pipeline(task, &watch)
}

/// A program with new feeds.
pub struct Optimised {
    /// Loads and times before and after.
    pub prediction: Prediction,
    /// The rewritten program; `None` where it must not run: something collides, stock and program do not meet, or limits cannot be met
    /// on more than a fifth of the cutting length ([`Prediction::headline`]).
    pub program: Option<Vec<u8>>,
}

/// Rewrites the feeds of a program within the limits of the setup.
///
/// The new text is proved to differ in feeds only, and simulated again, before it is handed out.
///
/// # Errors
/// [`Error::Job`]; [`Error::NotTheSame`].
pub fn optimise(program: &Program, setup: &Setup) -> Result<Optimised, Error> {
    let prediction = Prediction::of(with_watch(program, setup, job::optimize)?, setup);
    let written = prediction.run.written.as_ref().expect("optimize always writes");
    if !written.check.identical {
        return Err(Error::NotTheSame(written.check.differences.join("; ")));
    }
    let may_run = prediction.figures.verdict.held_back().is_empty();
    let program = may_run.then(|| written.bytes.clone());
    Ok(Optimised { prediction, program })
}

/// What the proof of two programs found.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Proof {
    /// Motions compared; nothing is proven where there are none.
    pub motions: usize,
    /// Motions that run at another feed.
    pub feeds_changed: usize,
    /// What differs besides feeds, with its lines: the first ones.
    pub differences: Vec<String>,
}

impl Proof {
    /// Is it proven that only feeds differ?
    pub fn holds(&self) -> bool {
        self.motions > 0 && self.differences.is_empty()
    }
}

/// Proves from two texts alone that they differ only in feeds, in where blocks are cut, and in Feedwright's own comments.
///
/// ```
/// let proof = |after| feedwright::verify("G1 X10 F500\nX20\n", after, None);
/// assert!(proof("G1 X10 F500\nX20 F700\n")?.holds());
/// assert!(!proof("G1 X10 F500\nX21 F700\n")?.holds());
/// # Ok::<(), feedwright::Error>(())
/// ```
///
/// # Errors
/// [`Error::Refused`], of the original.
pub fn verify(
    original: impl Into<Vec<u8>>,
    rewritten: impl Into<Vec<u8>>,
    setup: Option<&Setup>,
) -> Result<Proof, Error> {
    let before = parse(original, setup)?.text;
    let after = nc::parse(rewritten.into(), Some(before.dialect()));
    let proof = with_environment(&before, setup, &mut |environment| {
        let [(before, _), (after, _)] = [&before, &after].map(|program| nc::linked(program, environment));
        rewrite::verify(&before, &after, environment)
    });
    let differences = proof.differences.iter().map(ToString::to_string).collect();
    Ok(Proof { motions: proof.motions, feeds_changed: proof.feeds_changed, differences })
}

/// A coefficient with its doubt.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Coefficient {
    /// Name, as in `[material]`.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Standard error; infinite where the data cannot tell.
    pub std_error: f64,
    /// Unit.
    pub unit: String,
}

/// Coefficients found in steady cuts.
pub struct Calibrated(Calibration);

impl Calibrated {
    /// The coefficients.
    pub fn coefficients(&self) -> Vec<Coefficient> {
        self.0.parameters.iter().map(coefficient).collect()
    }

    /// Why no model should rest on them; empty: nothing speaks against one.
    pub fn doubts(&self) -> &[String] {
        &self.0.doubts
    }

    /// The process model for [`Setup::with_model`]; `None` where the data do not support one.
    pub fn model(&self) -> Option<String> {
        process_model::of_calibration(&self.0).as_ref().map(setup::write_model)
    }
}

fn coefficient(value: &crate::learn::report::Estimate) -> Coefficient {
    Coefficient { name: value.name.clone(), value: value.value, std_error: value.std_error, unit: value.unit.clone() }
}

/// Finds the coefficients of a force model (`power`, `linear-edge`, `kienzle`, `layer`, `response`, `polynomial`) in a table of steady
/// cuts, CSV with a header. The setup gives the tools, and the efficiency between power meter and motor shaft.
///
/// # Errors
/// [`Error::Table`].
pub fn calibrate(table: &[u8], model: &str, setup: Option<&Setup>) -> Result<Calibrated, Error> {
    let job = setup.map(|setup| &setup.job);
    let frame = read(table, &[])?;
    let tools: Vec<TableTool> = job.iter().flat_map(|job| &job.tools).map(TableTool::from).collect();
    let rows = rows(&frame, &tools)?;
    let efficiency = job.map_or_else(|| Table::constant(1.0), |job| job.machine.spindle.efficiency.clone());
    let declared_k_tc = job.and_then(|job| declared(job, job.tools.first()?)).map(|k| k.k_tc);
    let spindle = job.map(|job| &job.machine.spindle);
    let options = CalibrateOptions { spindle, declared_k_tc, ..CalibrateOptions::default() };
    Ok(Calibrated(fit(&frame, &rows, model, options, |reading| reading * efficiency.at(reading))?))
}

/// What a measured log says of a model.
pub struct Learned {
    report: LearnReport,
    job: Job,
}

impl Learned {
    /// Names of the effects that the model lacked, as in `feedwright library effects`, in the order found.
    pub fn effects(&self) -> Vec<&str> {
        self.report.effects.iter().map(|effect| effect.name.as_str()).collect()
    }

    /// Coefficients of the model with these effects.
    pub fn coefficients(&self) -> Vec<Coefficient> {
        self.report.final_base.iter().map(coefficient).collect()
    }

    /// The summary that the command prints.
    pub fn summary(&self) -> String {
        report::learn::learn_words(&self.report)
    }

    /// The JSON report.
    pub fn json(&self) -> String {
        report::learn_json::learn_json(&self.report)
    }

    /// The process model for [`Setup::with_model`]; `None` where the data do not support one.
    pub fn model(&self) -> Option<String> {
        process_model::of_report(&self.report, &self.job).as_ref().map(setup::write_model)
    }
}

/// Finds what the model lacks in a log that was measured while the program ran. `feedwright learn --help` lists its columns; the setup's
/// `[log] columns` map other names to them.
///
/// # Errors
/// [`Error::Log`].
pub fn learn(program: &Program, log: &[u8], setup: &Setup) -> Result<Learned, Error> {
    let mut job = setup.job.clone();
    learned::apply(&mut job);
    let diagnosis = Diagnosis { known: in_model_file(&job.process), ..Diagnosis::default() };
    let options = LogOptions { mapping: job.log_columns.clone(), diagnosis, ..LogOptions::default() };
    let found = learn_from(program.bytes(), &job, log, &options, Some(&|path| std::fs::read(path)))?;
    Ok(Learned { report: found.report, job })
}
