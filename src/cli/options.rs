//! Options that several commands share, each written once. In: the process's arguments, by clap. Out: plain structures that the
//! commands flatten into their own arguments.

use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};

use super::error::CliError;
use crate::report::sha256;

/// Options of every command.
#[derive(Debug, Args, Clone)]
#[command(next_help_heading = "Options of every command")]
pub struct Global {
    /// Print nothing but errors.
    #[arg(long, global = true)]
    pub quiet: bool,
    /// No colours, whatever the terminal can do.
    #[arg(long, global = true)]
    pub no_color: bool,
    /// Threads to use; the result is the same for any number.
    #[arg(long, global = true, value_name = "N")]
    pub threads: Option<usize>,
    /// Cell of the height field of the stock, in place of the setup's choice.
    #[arg(long, global = true, value_name = "MM", allow_negative_numbers = true)]
    pub resolution: Option<f64>,
    /// Dialect of the program, in place of the setup's or the one recognised.
    #[arg(long, global = true, value_name = "NAME", value_parser = crate::nc::Dialect::NAMES)]
    pub dialect: Option<String>,
    /// It is a milling program, whatever in it looks like turning.
    #[arg(long, global = true)]
    pub mill: bool,
    /// Process model, as `calibrate` and `learn` write it; for `calibrate` the name of the force model.
    #[arg(long, global = true, value_name = "model.toml")]
    pub model: Option<PathBuf>,
    /// Most memory the run may take, like 500M or 2G; three quarters of the machine's where nothing is said. The height field gets half.
    #[arg(long, global = true, value_name = "BYTES", value_parser = bytes)]
    pub max_memory: Option<u64>,
    /// Most time the run may take, in seconds.
    #[arg(long, global = true, value_name = "S")]
    pub max_time: Option<f64>,
    /// Refuse every default that was not written down in the setup.
    #[arg(long, global = true)]
    pub strict: bool,
    /// Replace existing outputs that Feedwright did not write.
    #[arg(long, global = true)]
    pub force: bool,
    /// Report time per stage and peak memory.
    #[arg(long, global = true)]
    pub timings: bool,
    /// Say progress on standard error as LinuxCNC reads it from a filter: FILTER_PROGRESS=40.
    #[arg(long, global = true)]
    pub filter_progress: bool,
}

impl Global {
    /// Those of these options that decide feeds, as a program's provenance holds them: a model by its SHA-256.
    pub fn deciding(&self) -> Result<Vec<String>, CliError> {
        let model = self.model.as_deref().map(|path| {
            let bytes = std::fs::read(path).map_err(|error| CliError::file("read", path, &error))?;
            Ok::<_, CliError>(format!("--model {}", sha256(&bytes)))
        });
        let found = [
            model.transpose()?,
            self.resolution.map(|mm| format!("--resolution {mm}")),
            self.dialect.as_ref().map(|name| format!("--dialect {name}")),
            self.mill.then(|| "--mill".to_owned()),
        ];
        Ok(found.into_iter().flatten().collect())
    }
}

/// What the motions of a program need of a setup.
pub const SETUP_OF_MOTIONS: &str = "Setup file: offsets, home, what compensation means";

/// Setup and report, as most commands have them.
#[derive(Debug, Default, Args)]
pub struct Common {
    /// Setup file; without it PROGRAM.setup.toml beside the program.
    #[arg(long, value_name = "S.toml")]
    pub setup: Option<PathBuf>,
    /// Write the report as JSON; - is standard output.
    #[arg(long, value_name = "R.json")]
    pub json: Option<PathBuf>,
}

impl Common {
    /// The setup file that was named.
    pub fn setup(&self) -> Option<&Path> {
        self.setup.as_deref()
    }

    /// Where the JSON report goes.
    pub fn json(&self) -> Option<&Path> {
        self.json.as_deref()
    }
}

/// How the columns of a log or table are named.
#[derive(Debug, Args)]
pub struct ColumnMap {
    /// Names of columns: THEIRS=OURS,…, or of all columns in their order, time_s,x_mm,…; see `feedwright log`.
    #[arg(long, value_name = "MAP")]
    pub columns: Option<String>,
}

/// What the forces of a log are.
#[derive(Debug, Args)]
pub struct Samples {
    /// What a sample of a force is.
    #[arg(long, value_name = "WHAT", default_value = "peak")]
    pub sample: SampleKind,
    /// Time over which an instantaneous force is followed for its peak, s; one turn of the spindle when absent.
    #[arg(long, value_name = "S")]
    pub window: Option<f64>,
}

/// What a sample of a force is.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum SampleKind {
    /// The force at that moment
    Instant,
    /// The mean over the window
    Mean,
    /// The largest over the window
    Peak,
}

/// What forces act on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum ForceOn {
    /// A table dynamometer
    #[default]
    Workpiece,
    /// A rotating or spindle dynamometer
    Tool,
}

impl ForceOn {
    /// On the tool?
    pub fn is_tool(self) -> bool {
        self == ForceOn::Tool
    }
}

/// A share from 0.5 to below 1.
pub fn confidence(text: &str) -> Result<f64, String> {
    let share = text.parse::<f64>().ok().filter(|share| (0.5..1.0).contains(share));
    share.ok_or_else(|| "it is a share from 0.5 to below 1: 0.95 is usual".to_owned())
}

/// A length above 0, m.
pub fn positive(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| *value > 0.0 && value.is_finite());
    value.ok_or_else(|| "it is a length in m, above 0".to_owned())
}

/// A number that is one, in the unit of its option: no infinity, not "nan".
pub fn finite(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
    value.ok_or_else(|| "it is a number".to_owned())
}

/// A number of 0 or more, in the unit of its option.
pub fn from_zero(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|value| *value >= 0.0).ok_or_else(|| "it is a number of 0 or more".to_owned())
}

/// A positive number, in the unit of its option.
pub fn above_zero(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|value| *value > 0.0).ok_or_else(|| "it is a positive number".to_owned())
}

fn bytes(text: &str) -> Result<u64, String> {
    let text = text.trim().trim_end_matches(['B', 'b']).trim_end_matches('i');
    let (number, factor) = match text.chars().last() {
        Some('k' | 'K') => (&text[..text.len() - 1], 1u64 << 10),
        Some('m' | 'M') => (&text[..text.len() - 1], 1 << 20),
        Some('g' | 'G') => (&text[..text.len() - 1], 1 << 30),
        _ => (text, 1),
    };
    let value: f64 = number.trim().parse().map_err(|_| "write a number of bytes, like 500M or 2G".to_owned())?;
    if value > 0.0 && value.is_finite() {
        Ok((value * factor as f64) as u64)
    } else {
        Err("it must be positive".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_read_with_its_unit() {
        assert_eq!(bytes("2G"), Ok(2 << 30));
        assert_eq!(bytes("1.5 MiB"), Ok(3 << 19));
        assert!(bytes("lots").is_err() && bytes("-1").is_err());
    }

    #[test]
    fn numbers_of_options_are_finite_and_of_the_sign_that_is_meant() {
        assert!(["nan", "inf", "-inf", "1e999", "", "1,5"].iter().all(|text| finite(text).is_err()));
        assert!(finite("-3.5") == Ok(-3.5) && from_zero("0") == Ok(0.0) && above_zero("1e-3") == Ok(1e-3));
        assert!(from_zero("-1e-9").is_err() && above_zero("0").is_err() && above_zero("nan").is_err());
    }

    #[test]
    fn confidences_are_read() {
        assert!(confidence("0.95").is_ok() && confidence("1").is_err() && confidence("nan").is_err());
    }
}
