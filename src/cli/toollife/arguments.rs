//! Arguments of `toollife plan` and `toollife update`. In: the command line. Out: plain structures.

use clap::{Args, Subcommand, ValueEnum};
use std::path::PathBuf;

use super::super::options::{ColumnMap, Common, Samples, confidence, positive};

/// What the setup has to hold.
const SETUP_OF_LIFE: &str =
    "Setup file; without it PROGRAM.setup.toml beside the program. Its tool needs a law of wear (wear = { … })";

/// `toollife`.
#[derive(Debug, Args)]
pub struct ToolLife {
    /// What of it.
    #[command(subcommand)]
    pub what: ToolLifeCommand,
}

/// Long-term regulation of the cutting load over the life of a tool.
#[derive(Debug, Subcommand)]
pub enum ToolLifeCommand {
    /// Choose check points, mark them in the program, and write the first feeds with which the tool shall last
    Plan(LifePlan),
    /// Take what was read at check points, predict when the tool is worn out, and rewrite the feeds from the next one on
    Update(LifeUpdate),
}

/// What both have in common.
#[derive(Debug, Args)]
#[command(mut_arg("setup", |arg| arg.help(SETUP_OF_LIFE)))]
pub struct LifeFiles {
    /// NC program; for update the one that plan or the last update wrote.
    pub program: PathBuf,
    /// Setup and report.
    #[command(flatten)]
    pub common: Common,
    /// Tool; without it the only one of the program with a law of wear.
    #[arg(long, value_name = "N")]
    pub tool: Option<u32>,
    /// State of the tool, read where it is there and written; without it TN.life.toml beside the program.
    #[arg(long, value_name = "T.life.toml")]
    pub state: Option<PathBuf>,
    /// Where the program goes; without it PROGRAM.life.EXT, then PROGRAM.life.2.EXT … beside the program.
    #[arg(short, long, value_name = "OUT")]
    pub output: Option<PathBuf>,
    /// Where the table of check points goes, to be filled in; without it beside the output, as .csv.
    #[arg(long, value_name = "CHECKS.csv")]
    pub table: Option<PathBuf>,
    /// How the feeds are regulated.
    #[arg(long, value_name = "HOW", default_value = "budget")]
    pub method: Method,
    /// Write the program even if the target cannot be reached, or limits be met, at the lowest feeds.
    #[arg(long)]
    pub accept_infeasible: bool,
}

/// How feeds are regulated for a long life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Least time within the wear that the program may cause
    Budget,
    /// The whole profile at the force that the line to the target has at the next check point
    Force,
}

/// `toollife plan`.
#[derive(Debug, Args)]
#[command(group(clap::ArgGroup::new("target").required(true).args(["target_length", "target_parts"])))]
pub struct LifePlan {
    /// Files.
    #[command(flatten)]
    pub files: LifeFiles,
    /// Length that the tool shall cut in all, what it has cut already included, m.
    #[arg(long, value_name = "M", value_parser = positive)]
    pub target_length: Option<f64>,
    /// Programs like this one that the tool shall still cut, this one included.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub target_parts: Option<u32>,
    /// Probability with which it shall last.
    #[arg(long, value_name = "SHARE", value_parser = confidence, default_value = "0.9")]
    pub assurance: f64,
    /// Length cut before the first check point, m; without it as between the others.
    #[arg(long, value_name = "M", value_parser = positive)]
    pub first: Option<f64>,
    /// Length cut from each check point to the next, m; without it a quarter of what the program cuts.
    #[arg(long, value_name = "M", value_parser = positive)]
    pub every: Option<f64>,
    /// A new tool is in the spindle: what is in the state file belongs to the old one.
    #[arg(long)]
    pub new_tool: bool,
}

/// `toollife update`.
#[derive(Debug, Args)]
pub struct LifeUpdate {
    /// Files.
    #[command(flatten)]
    pub files: LifeFiles,
    /// What was read: the table of check points with force_xy_n, force_xy_mean_n or spindle_power_w filled in; or a whole log
    /// with positions or lines, from which the check points are cut.
    #[arg(long, value_name = "CSV")]
    pub measured: PathBuf,
    /// How its columns are named.
    #[command(flatten)]
    pub map: ColumnMap,
    /// What its forces are.
    #[command(flatten)]
    pub samples: Samples,
}
