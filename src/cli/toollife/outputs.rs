//! Files that `toollife` writes. In: where they go. Out: program, table of check points, state and report, all of them or none.

use std::path::PathBuf;

use super::super::error::CliError;
use super::super::input::Source;
use super::super::output::{Kind, Output, Outputs};
use super::super::screen::Screen;
use super::arguments::LifeFiles;
use super::files::{Files, output_name, table_name};
use crate::report::life::{LifeReport, checks_csv, life_json, life_words};
use crate::setup::{ToolState, write_tool_state};

/// Outputs, each ready before the work begins.
pub struct Outs {
    program: Output,
    /// Where the program goes.
    pub program_path: PathBuf,
    table: Output,
    table_path: PathBuf,
    state: Output,
    state_path: PathBuf,
    json: Option<Output>,
}

impl Outs {
    /// Makes them ready.
    pub fn open(files: &mut Files, command: &LifeFiles, source: &Source, tool: u32) -> Result<Self, CliError> {
        let program_path = command.output.clone().unwrap_or_else(|| output_name(source.path.as_deref()));
        let table_path = command.table.clone().unwrap_or_else(|| table_name(&program_path, &files.folder));
        let state_path = files.state_path(tool);
        Ok(Self {
            program: files.outputs.open(&program_path, Kind::Program)?,
            table: files.outputs.open(&table_path, Kind::Checks)?,
            state: files.outputs.open(&state_path, Kind::ToolState)?,
            json: command.common.json().map(|path| files.outputs.open(path, Kind::Json)).transpose()?,
            program_path,
            table_path,
            state_path,
        })
    }

    /// The report, whether the program is written or not.
    pub fn say(&mut self, report: &LifeReport, screen: Screen) -> Result<(), CliError> {
        let files = [Some(&self.program), Some(&self.table), self.json.as_ref()];
        let words = life_words(report);
        if files.into_iter().flatten().any(Output::is_stdout) {
            screen.say(&words);
        } else {
            screen.show(&words)?;
        }
        self.json.take().map_or(Ok(()), |json| json.write(life_json(report).as_bytes()))
    }

    /// Program, table, state.
    pub fn write(
        self,
        bytes: &[u8],
        report: &LifeReport,
        sha256: &str,
        state: &ToolState,
        all: Outputs,
        screen: Screen,
    ) -> Result<(), CliError> {
        self.program.write(bytes)?;
        self.table.write(checks_csv(&report.check_points, &sha256[..8]).as_bytes())?;
        self.state.write(write_tool_state(state).as_bytes())?;
        all.commit()?;
        for path in [&self.program_path, &self.table_path, &self.state_path] {
            screen.say(&format!("written   {}", path.display()));
        }
        Ok(())
    }
}
