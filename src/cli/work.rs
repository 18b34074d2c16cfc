//! Running the pipeline, for `optimize`, `simulate`, `limits` and `dump`. In: the options of a command. Out: a
//! [`ProgramRun`](crate::outcome::ProgramRun), or an error with a message that says what to do; progress on the screen meanwhile.

use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Instant;

use super::error::CliError;
use super::input::{self, Source};
use super::options::{Common, Global, confidence};
use super::screen::Screen;
pub(crate) use crate::api::subprogram;
use crate::engage;
use crate::job::{JobError, Keep, Task, Wanted, Watch};
use crate::outcome::ProgramRun;

/// Program, setup and reports.
#[derive(Debug, Args)]
pub struct Work {
    /// NC program; - is standard input.
    pub program: PathBuf,
    /// Setup and report.
    #[command(flatten)]
    pub common: Common,
    /// With the blocks in the JSON report.
    #[arg(long)]
    pub json_blocks: bool,
    /// Write the report as one HTML file.
    #[arg(long, value_name = "R.html")]
    pub report: Option<PathBuf>,
    /// Write one row per station: the path from there to the next row, with the loads of its fullest place
    /// (0 in air, power too).
    #[arg(long, value_name = "R.csv")]
    pub csv: Option<PathBuf>,
    /// Draw feed and load along the path.
    #[arg(long, value_name = "R.svg")]
    pub svg: Option<PathBuf>,
    /// Limit every tool to the loads it meets in this program as it stands: self, or self:PERCENTILE of the cut length.
    #[arg(long, value_name = "self[:PCT]", value_parser = own_percentile)]
    pub reference: Option<f64>,
    /// What the original takes on the machine, [h:]min:s: fits acceleration and corner tolerance to it.
    #[arg(long, value_name = "MIN:S", value_parser = cycle_time)]
    pub cycle_time: Option<f64>,
    /// Keep the load limits at this confidence against what is uncertain in coefficients and stock, like 0.95.
    #[arg(long, value_name = "SHARE", value_parser = confidence)]
    pub confidence: Option<f64>,
    /// Write the problem that is solved, with its answer, as JSON; - is standard output.
    #[arg(long, value_name = "FILE")]
    pub dump_problem: Option<PathBuf>,
    /// Keep what was simulated beside the program, as PROGRAM.fwcache: other limits are then solved at once.
    #[arg(long)]
    pub cache: bool,
    /// Write the stock as the program leaves it: FILE.stock for the next program, FILE.stl for other software.
    #[arg(long, value_name = "FILE")]
    pub save_stock: Option<PathBuf>,
}

impl Work {
    /// Those of these options that decide feeds, as a program's provenance holds them.
    pub fn deciding(&self) -> Vec<String> {
        let found = [
            self.reference.map(|percentile| format!("--reference self:{percentile}")),
            self.cycle_time.map(|seconds| format!("--cycle-time {seconds} s")),
            self.confidence.map(|share| format!("--confidence {share}")),
        ];
        found.into_iter().flatten().collect()
    }

    /// A program with nothing else said.
    pub fn of(program: PathBuf) -> Self {
        Self {
            program,
            common: Common::default(),
            json_blocks: false,
            report: None,
            csv: None,
            svg: None,
            reference: None,
            cycle_time: None,
            confidence: None,
            dump_problem: None,
            cache: false,
            save_stock: None,
        }
    }
}

/// What is asked besides, by the options of a command.
pub fn wanted(work: &Work, stress: bool) -> Wanted {
    Wanted {
        reference: work.reference,
        stress,
        cycle_time_s: work.cycle_time,
        confidence: work.confidence,
        ..Wanted::default()
    }
}

/// Runs the pipeline: `simulate` or `optimize` of [`crate::job`].
pub type Pipeline = fn(Task, &Watch) -> Result<ProgramRun, JobError>;

/// A run with the source it belongs to.
pub struct Done {
    /// The program as it was read.
    pub source: Source,
    /// What was found.
    pub run: ProgramRun,
}

/// The files a run reads, so that no output takes the place of one.
pub fn inputs(source: &Source, setup: Option<&Path>, global: &Global) -> Vec<PathBuf> {
    let setup = setup.map(Path::to_owned).or_else(|| input::beside(source));
    [source.path.clone(), setup, global.model.clone()].into_iter().flatten().collect()
}

/// Reads the setup and runs the pipeline over a program.
pub fn run(
    source: Source,
    setup: Option<&Path>,
    pipeline: Pipeline,
    global: &Global,
    wanted: Wanted,
    screen: Screen,
) -> Result<Done, CliError> {
    run_keeping(source, setup, pipeline, global, wanted, screen, Keep::default())
}

/// As [`run`], with hooks for what is kept.
pub fn run_keeping(
    source: Source,
    setup: Option<&Path>,
    pipeline: Pipeline,
    global: &Global,
    wanted: Wanted,
    screen: Screen,
    keep: Keep,
) -> Result<Done, CliError> {
    let task = task(&source, setup, global, wanted)?;
    execute(source, task, pipeline, global, screen, keep)
}

/// A program with its setup, as read.
pub fn task(source: &Source, setup: Option<&Path>, global: &Global, wanted: Wanted) -> Result<Task, CliError> {
    let found = input::setup(setup, source, global)?;
    let program = input::parse(source, global, Some(&found.job))?;
    Ok(Task { program, job: found.job, assumptions: found.assumptions, wanted })
}

/// Runs the pipeline over a task.
pub fn execute(
    source: Source,
    task: Task,
    pipeline: Pipeline,
    global: &Global,
    screen: Screen,
    keep: Keep,
) -> Result<Done, CliError> {
    let bar = screen.progress("");
    let told = AtomicU32::new(0);
    let start = Instant::now();
    let folder = source.path.as_deref().and_then(Path::parent).map(Path::to_owned);
    let watch = Watch {
        progress: &|stage, done| {
            bar.set_message(stage);
            bar.set_position((1000.0 * done) as u64);
            let percent = of_the_whole(stage, done);
            if told.fetch_max(percent, Ordering::Relaxed) < percent {
                screen.filter_progress(percent);
            }
        },
        clock: &|| start.elapsed().as_secs_f64(),
        subprograms: &|name| subprogram(folder.as_deref(), name),
        engage: engage::Options {
            max_memory_bytes: memory_of_the_field(global),
            loader: Some(&|path| std::fs::read(path)),
            ..engage::Options::default()
        },
        keep,
    };
    let result = pipeline(task, &watch);
    bar.finish_and_clear();
    match result {
        Ok(run) => Ok(Done { source, run }),
        Err(JobError::ToolNames(diagnostics) | JobError::NotFinite(diagnostics)) => {
            Err(CliError::Drawn { file: source.name, text: source.bytes, diagnostics })
        }
        Err(error) => Err(explain(&error, &source.name)),
    }
}

/// How far the whole work is, %, by its stage and the part of it that is done: on most programs the two simulations take about as long as
/// each other, and little is between them.
fn of_the_whole(stage: &str, done: f64) -> u32 {
    let [from, to] = match stage {
        "simulate" => [0.0, 50.0],
        "schedule" => [50.0, 60.0],
        _ => [60.0, 100.0],
    };
    (from + (to - from) * done.clamp(0.0, 1.0)) as u32
}

/// An error of the pipeline with its remedy.
pub fn explain(error: &JobError, file: &str) -> CliError {
    match error {
        JobError::NoMotion => {
            CliError::new(format!("{file}: {error}"), "give an NC program; if it is one, name its --dialect")
        }
        JobError::UnknownTools(tools) => {
            let tables: Vec<String> = tools.iter().map(|(number, _)| tool_table(*number)).collect();
            CliError::new(
                format!("{file} cuts with tools that the setup does not describe: {error}"),
                format!("add to the setup, with the sizes of your tool:\n{}", tables.join("\n")),
            )
        }
        JobError::WornOut(_) | JobError::Unsettled(_) => CliError::unmet(
            format!("{file}: {error}"),
            "nothing was written; change the tool before this line, raise the limit, or correct flank-wear in the process model",
        ),
        JobError::NotCertified { .. } => CliError::unmet(
            format!("{file}: no certificate can be made: {error}"),
            "nothing was written; without --certificate the program is written, with no such proof",
        ),
        JobError::ToolNames(_) | JobError::NotFinite(_) | JobError::Engage(_) => {
            CliError::new(format!("{file}: {error}"), "")
        }
    }
}

fn tool_table(number: u32) -> String {
    format!("[[tool]]\nnumber = {number}\nshape = \"flat\"\ndiameter = 10\nflutes = 4\n")
}

/// Most memory that the run may take, bytes: as asked for, else three quarters of the machine's, where the system tells.
pub fn most_memory(global: &Global) -> Option<u64> {
    global.max_memory.or_else(|| machine_memory().map(|bytes| bytes / 4 * 3))
}

/// Most memory of the height field: half of the run's; the rest is for stations, pieces and reports.
pub fn memory_of_the_field(global: &Global) -> Option<u64> {
    most_memory(global).map(|bytes| bytes / 2)
}

/// Memory of the machine, bytes, where the system tells.
fn machine_memory() -> Option<u64> {
    let info = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = info.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// Largest memory the process ever had, bytes, where the system tells.
pub fn peak_memory() -> Option<u64> {
    status("VmHWM:")
}

/// Memory the process has now, bytes, where the system tells.
pub fn memory() -> Option<u64> {
    status("VmRSS:")
}

fn status(key: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(key))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

fn own_percentile(text: &str) -> Result<f64, String> {
    let help = "write self, or self:95 for the 95th percentile of the cut length";
    let percentile = match text.split_once(':') {
        None if text == "self" => Some(100.0),
        Some(("self", number)) => number.trim_end_matches('%').parse().ok(),
        _ => None,
    };
    percentile.filter(|percentile| (0.0..=100.0).contains(percentile)).ok_or_else(|| help.to_owned())
}

fn cycle_time(text: &str) -> Result<f64, String> {
    let parts: Vec<Option<f64>> = text.split(':').map(|part| part.parse::<f64>().ok()).collect();
    let seconds = parts.iter().try_fold(0.0, |sum, part| part.filter(|p| *p >= 0.0).map(|part| 60.0 * sum + part));
    let sound = seconds.filter(|seconds| parts.len() <= 3 && *seconds > 0.0 && seconds.is_finite());
    sound.ok_or_else(|| "write minutes and seconds, like 12:34, or 1:12:34".to_owned())
}
