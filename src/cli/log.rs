//! `log`. In: a measured log. Out: how its columns and times are read, before it is compared with any program.

use clap::Args;
use std::path::{Path, PathBuf};

use super::error::CliError;
use super::input;
use super::learn::{LOG_COLUMNS, mapping, open};
use super::options::{ColumnMap, Global};
use super::output::{Kind, Outputs};
use super::screen::Screen;
use crate::learn::log::overview::{LogOverview, overview};
use crate::report;
use crate::report::Outcome;

/// `log`.
#[derive(Debug, Args)]
#[command(after_help = LOG_COLUMNS)]
pub struct LogView {
    /// Measured log: a table (CSV with any separator, workbook .xlsx), MTConnect adapter output or streams.
    pub file: PathBuf,
    /// How its columns are named.
    #[command(flatten)]
    pub map: ColumnMap,
    /// Write the columns that are proposed into this setup, as its [log] table.
    #[arg(long, value_name = "S.toml")]
    pub write: Option<PathBuf>,
    /// Write what was read as JSON; - is standard output.
    #[arg(long, value_name = "R.json")]
    pub json: Option<PathBuf>,
}

/// Shows a log, and writes the mapping it proposes into the setup where that is asked for.
pub fn log(command: &LogView, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let mut outputs = Outputs::new([command.file.clone()], global.force);
    let json = open(&mut outputs, command.json.as_deref(), Kind::Json)?;
    let bytes = input::file(&command.file)?;
    let name = command.file.display().to_string();
    let seen = overview(&bytes, &mapping(command.map.columns.as_deref())?).map_err(|error| {
        CliError::new(
            format!("{name}: {error}"),
            "give a table with a header (CSV, workbook), or MTConnect output; --columns names columns",
        )
    })?;
    if json.as_ref().is_some_and(super::output::Output::is_stdout) {
        screen.say(&report::log_text(&seen, &name));
    } else {
        screen.show(&report::log_text(&seen, &name))?;
    }
    if let Some(output) = json {
        output.write(report::log_json(&seen, &name).as_bytes())?;
    }
    if let Some(setup) = &command.write {
        return write_mapping(setup, &seen, &bytes, outputs, screen);
    }
    outputs.commit()?;
    Ok(if seen.unusable.is_some() { Outcome::Unmet } else { Outcome::Done })
}

/// Writes the mapping that the log proposes into the setup.
fn write_mapping(
    setup: &Path,
    seen: &LogOverview,
    bytes: &[u8],
    mut outputs: Outputs,
    screen: Screen,
) -> Result<Outcome, CliError> {
    let proposed = seen.proposed();
    if proposed.is_empty() {
        outputs.commit()?;
        screen.say("there is nothing to map: the setup stays as it is");
        return Ok(Outcome::Done);
    }
    let text = input::text(setup)?;
    if text.lines().any(|line| line.trim() == "[log]") {
        return Err(CliError::new(
            format!("{} has a [log] table already", setup.display()),
            format!("put this into it: {}", report::log_columns(&proposed)),
        ));
    }
    let table = format!("{}\n\n[log]\n{}\n", text.trim_end(), report::log_columns(&proposed));
    // The file was just read and only grows: it is written over whoever wrote it.
    outputs.open_over(setup, Kind::Setup)?.write(table.as_bytes())?;
    outputs.commit()?;
    screen.say(&format!("written   [log] columns into {}", setup.display()));
    let mapped = overview(bytes, &proposed).is_ok_and(|seen| seen.unusable.is_none());
    Ok(if mapped { Outcome::Done } else { Outcome::Unmet })
}
