//! The command line as clap reads it: its commands, whose arguments stand in the file of each. In: the process's arguments. Out:
//! plain structures; nothing is opened yet.

use clap::{Parser, Subcommand};

use super::batch::Batch;
use super::calibrate::Calibrate;
use super::certify::Certify;
use super::dump::Dump;
use super::evaluate::Evaluate;
use super::init::Init;
use super::learn::{Learn, LearnTable};
use super::library::Library;
use super::limits::Limits;
use super::log::LogView;
use super::optimize::Optimize;
use super::options::Global;
use super::semifinish::Semifinish;
use super::serve::Serve;
use super::shell::{Completions, Schema};
use super::start::Start;
use super::stepover::Stepover;
use super::toollife::ToolLife;
use super::toolpath::Motions;
use super::tools::Tools;
use super::verify::Verify;
use super::work::Work;

/// Off-line feedrate optimiser for NC milling programs: simulates what the cutter meets, predicts forces and power,
/// solves for the feeds, rewrites only the feeds, and proves it.
#[derive(Debug, Parser)]
#[command(
    name = "feedwright",
    version,
    max_term_width = 100,
    subcommand_required = true,
    arg_required_else_help = true
)]
#[command(
    after_help = "Exit codes: 0 done; 1 done, but a limit cannot be met or verify found a difference; 2 bad usage or input, nothing written."
)]
pub struct Arguments {
    /// Options that make sense everywhere.
    #[command(flatten)]
    pub global: Global,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Rewrite the feeds of a program
    Optimize(Optimize),
    /// Predict loads and time as programmed, change nothing
    Simulate(Work),
    /// Prove that only feeds differ between two programs
    Verify(Verify),
    /// Prove from its certificate that no load of a written program exceeds its limit
    Certify(Certify),
    /// Print the motions as interpreted
    Toolpath(Motions),
    /// Distribution of loads per tool, and suggested reference limits
    Limits(Limits),
    /// Coefficients from a table of steady cuts
    Calibrate(Calibrate),
    /// Find what the model lacks from a measured log
    Learn(Learn),
    /// The same from a table of steady cuts
    LearnTable(LearnTable),
    /// Show what is read of a measured log, and propose its columns
    Log(LogView),
    /// Hold a model against a log or a table that it has not seen
    Evaluate(Evaluate),
    /// Draft a setup from the program's text and a tool library
    Init(Init),
    /// Without a command: draft a setup where none is there, rewrite the feeds, show the page
    #[command(hide = true)]
    Start(Start),
    /// Read the tool libraries of other software
    #[command(subcommand)]
    Tools(Tools),
    /// Make a tool last: check points, wear index, feeds that reach a target
    Toollife(ToolLife),
    /// Move a semi-finishing path so that the force of the finish is constant
    Semifinish(Semifinish),
    /// Plan finishing passes of varying step-over on the mesh of a surface, and write their program
    Stepover(Stepover),
    /// Rewrite many programs; one that was done before is not done again
    Batch(Batch),
    /// Sum up a batch whose shards ran apart
    Merge(Batch),
    /// Show the page of the programs of a folder to a browser on this computer: drop a program, change a limit, see the feeds
    Serve(Serve),
    /// Print any stage of the pipeline
    Dump(Dump),
    /// List what is built in
    Library(Library),
    /// Print the JSON Schema of the setup file or of the report
    Schema(Schema),
    /// Print completions for a shell
    Completions(Completions),
    /// Print the manual page
    Man,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }
}
