//! What `optimize`, `simulate`, `limits` and `dump` share: reading, running the pipeline with progress and clock, and
//! turning its errors into messages that say what to do.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::args::{Global, Work};
use super::error::CliError;
use super::input::{self, Source};
use super::screen::Screen;
use crate::engage;
use crate::job::{JobError, Keep, Task, Wanted, Watch};
use crate::report::Run;

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
pub type Pipeline = fn(Task, &Watch) -> Result<Run, JobError>;

/// A run with the source it belongs to.
pub struct Done {
    /// The program as it was read.
    pub source: Source,
    /// What was found.
    pub run: Run,
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
    let start = Instant::now();
    let folder = source.path.as_deref().and_then(Path::parent).map(Path::to_owned);
    let watch = Watch {
        progress: &|stage, done| {
            bar.set_message(stage);
            bar.set_position((1000.0 * done) as u64);
        },
        clock: &|| start.elapsed().as_secs_f64(),
        subprograms: &|name| subprogram(folder.as_deref(), name),
        engage: engage::Options {
            max_memory_bytes: global.max_memory.or_else(half_the_machine),
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

/// A file of this name beside the program.
pub fn subprogram(folder: Option<&Path>, name: &str) -> Option<Vec<u8>> {
    let safe = !name.is_empty()
        && name.chars().all(|c| c.is_ascii_alphanumeric() || "._-".contains(c))
        && !name.starts_with('.');
    let folder = folder.filter(|_| safe)?;
    std::fs::read(folder.join(name)).ok()
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
        JobError::ToolNames(_) | JobError::NotFinite(_) | JobError::Engage(_) => {
            CliError::new(format!("{file}: {error}"), "")
        }
    }
}

fn tool_table(number: u32) -> String {
    format!("[[tool]]\nnumber = {number}\nshape = \"flat\"\ndiameter = 10\nflutes = 4\n")
}

/// Half the memory of the machine, bytes, where the system tells.
pub fn half_the_machine() -> Option<u64> {
    let info = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = info.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 512)
}

/// Largest memory the process ever had, bytes, where the system tells.
pub fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}
