//! Simulation of a program without new feeds. In: its text, the setup, the wear of the tool. Out: the run.

use super::super::error::CliError;
use super::super::input::Source;
use super::super::options::Global;
use super::super::screen::Screen;
use super::super::work::{execute, task};
use super::arguments::LifeFiles;
use crate::job::tool_life::with_wear;
use crate::job::{self, Keep, Wanted};
use crate::machine::Wear;
use crate::outcome::ProgramRun;

/// The run over a program as it stands.
pub fn simulated(
    source: &Source,
    files: &LifeFiles,
    wear: Option<(u32, Wear)>,
    global: &Global,
    screen: Screen,
) -> Result<ProgramRun, CliError> {
    let copy = Source { bytes: source.bytes.clone(), name: source.name.clone(), path: source.path.clone() };
    let mut task = task(&copy, files.common.setup(), global, Wanted::default())?;
    if let Some((tool, wear)) = wear {
        with_wear(&mut task.job, tool, wear, None);
    }
    Ok(execute(copy, task, job::simulate, global, screen, Keep::default())?.run)
}
