//! Files of `toollife`. In: arguments. Out: paths of the outputs; the state read from its file, refused if it belongs to another tool or program.

use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

use super::super::error::CliError;
use super::super::input::{self, Source};
use super::super::lacks_of_wear::lacks_of_wear;
use super::super::options::Global;
use super::super::output::Outputs;
use super::super::work::inputs;
use super::arguments::LifeFiles;
use crate::effects::wear;
use crate::machine::{Job, Tool};
use crate::outcome::ProgramRun;
use crate::setup::{ToolState, read_tool_state};

/// Files of a command.
pub struct Files {
    /// Outputs, with the inputs that stay.
    pub outputs: Outputs,
    state: Option<PathBuf>,
    /// Folder of the program.
    pub folder: PathBuf,
}

impl Files {
    /// With the inputs of a command kept.
    pub fn new(files: &LifeFiles, source: &Source, global: &Global) -> Self {
        let outputs = Outputs::new(inputs(source, files.common.setup(), global), global.force);
        let folder = source.path.as_deref().and_then(Path::parent).unwrap_or(Path::new("")).to_owned();
        Self { outputs, state: files.state.clone(), folder }
    }

    /// Where the state of a tool lies.
    pub fn state_path(&self, tool: u32) -> PathBuf {
        self.state.clone().unwrap_or_else(|| self.folder.join(format!("T{tool}.life.toml")))
    }

    /// The state of this tool, if there is one; refused where it is another's.
    pub fn state_at(&self, number: u32, job: &Job) -> Result<Option<ToolState>, CliError> {
        let path = self.state_path(number);
        if !path.is_file() {
            return Ok(None);
        }
        let text = input::text(&path)?;
        let state = read_tool_state(&text).map_err(|why| {
            CliError::new(
                format!("{} is no state of a tool: {why}", path.display()),
                "correct it, or begin anew with `toollife plan --new-tool`",
            )
        })?;
        let other = |what: &str, there: String, here: String| {
            CliError::new(
                format!(
                    "{} is the state of another tool: its {what} is {there}, that of T{number} in the setup {here}",
                    path.display()
                ),
                "name the right file with --state, or begin with a new tool: `toollife plan --new-tool`",
            )
        };
        let tool = job.tool(number).ok_or_else(|| no_tool(&[]))?;
        let fresh = wear::of_tool(job, tool).ok_or_else(|| no_tool(&[]))?.fresh;
        let differs = |a: f64, b: f64| (a - b).abs() > 1e-6 * a.abs().max(b.abs());
        if state.tool != number {
            return Err(other("number", format!("T{}", state.tool), format!("T{number}")));
        }
        if differs(state.diameter_mm, tool.diameter_mm) {
            return Err(other("diameter", format!("{} mm", state.diameter_mm), format!("{} mm", tool.diameter_mm)));
        }
        if state.flutes != tool.flutes {
            return Err(other("number of teeth", state.flutes.to_string(), tool.flutes.to_string()));
        }
        if differs(state.fresh, fresh) {
            return Err(other("index of a fresh edge", state.fresh.to_string(), fresh.to_string()));
        }
        Ok(Some(state))
    }
}

/// The tool whose life it is.
pub fn the_tool(run: &ProgramRun, asked: Option<u32>) -> Result<u32, CliError> {
    let used = |tool: &&Tool| run.toolpath.moves.iter().any(|motion| motion.tool == tool.number);
    let wears: Vec<u32> = lives(&run.job).filter(used).map(|tool| tool.number).collect();
    match asked {
        Some(number) if wears.contains(&number) => Ok(number),
        None if wears.len() == 1 => Ok(wears[0]),
        _ if wears.is_empty() => Err(without_end(&run.job, asked).unwrap_or_else(|| no_tool(&wears))),
        _ => Err(no_tool(&wears)),
    }
}

/// The tools whose law of wear and end are known.
pub fn lives(job: &Job) -> impl Iterator<Item = &Tool> {
    job.tools.iter().filter(|tool| wear::with_end(job, tool).is_some())
}

/// A model that wears the edges of the tool, of which only the end is not known.
fn without_end(job: &Job, asked: Option<u32>) -> Option<CliError> {
    let tool = asked.map_or_else(|| job.tools.first(), |number| job.tool(number))?;
    Some(lacks_of_wear(&format!("T{}", tool.number), Some(wear::of_tool(job, tool)?)))
}

/// No tool, or more than one, whose life could be meant.
pub fn no_tool(wears: &[u32]) -> CliError {
    let wears: Vec<String> = wears.iter().map(|number| format!("T{number}")).collect();
    if wears.is_empty() {
        return lacks_of_wear("any tool of this program", None);
    }
    CliError::new(format!("which tool? {} have laws of wear", wears.join(", ")), "name one with --tool")
}

/// SHA-256 of a program, in hexadecimal.
pub fn digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
}

/// `part.nc` → `part.life.nc` → `part.life.2.nc` → …
pub fn output_name(path: Option<&Path>) -> PathBuf {
    let Some(path) = path else { return PathBuf::from("-") };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let next = match stem.split_once(".life") {
        None => format!("{stem}.life"),
        Some((plain, rest)) => {
            let number = rest.trim_start_matches('.').parse::<u32>().unwrap_or(1);
            format!("{plain}.life.{}", number + 1)
        }
    };
    let ending = path.extension().map(|ending| format!(".{}", ending.to_string_lossy())).unwrap_or_default();
    path.with_file_name(next + &ending)
}

/// `part.life.nc` → `part.life.csv`
pub fn table_name(target: &Path, folder: &Path) -> PathBuf {
    if target == Path::new("-") { folder.join("checks.csv") } else { target.with_extension("csv") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_are_numbered_on() {
        let name = |path: &str| output_name(Some(Path::new(path))).display().to_string();
        assert_eq!(name("a/part.nc"), "a/part.life.nc");
        assert_eq!(name("a/part.life.nc"), "a/part.life.2.nc");
        assert_eq!(name("a/part.life.2.nc"), "a/part.life.3.nc");
    }
}
