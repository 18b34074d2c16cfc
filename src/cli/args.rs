//! The command line as clap reads it. In: the process's arguments. Out: plain structures; nothing is opened yet.

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

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
    /// Most memory the height field may take, like 500M or 2G.
    #[arg(long, global = true, value_name = "BYTES", value_parser = bytes)]
    pub max_memory: Option<u64>,
    /// Refuse every default that was not written down in the setup.
    #[arg(long, global = true)]
    pub strict: bool,
    /// Replace existing outputs that Feedwright did not write.
    #[arg(long, global = true)]
    pub force: bool,
    /// Report time per stage and peak memory.
    #[arg(long, global = true)]
    pub timings: bool,
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
    /// Print the motions as interpreted
    Toolpath(Toolpath),
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
    /// Print any stage of the pipeline
    Dump(Dump),
    /// List what is built in
    Library(Library),
    /// Print the JSON Schema of the setup file
    Schema,
    /// Print completions for a shell
    Completions(Completions),
    /// Print the manual page
    Man,
}

/// `completions`.
#[derive(Debug, Args)]
pub struct Completions {
    /// Which shell.
    pub shell: clap_complete::Shell,
}

/// Program, setup and reports.
#[derive(Debug, Args)]
pub struct Work {
    /// NC program; - is standard input.
    pub program: PathBuf,
    /// Setup file; without it PROGRAM.setup.toml beside the program.
    #[arg(long, value_name = "S.toml")]
    pub setup: Option<PathBuf>,
    /// Write the report as JSON; - is standard output.
    #[arg(long, value_name = "R.json")]
    pub json: Option<PathBuf>,
    /// With the blocks in the JSON report.
    #[arg(long)]
    pub json_blocks: bool,
    /// Write the report as one HTML file.
    #[arg(long, value_name = "R.html")]
    pub report: Option<PathBuf>,
    /// Write one row per station.
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
    /// A program with nothing else said.
    pub fn of(program: PathBuf) -> Self {
        Self {
            program,
            setup: None,
            json: None,
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

impl Optimize {
    /// With nothing else said.
    pub fn of(work: Work) -> Self {
        Self {
            work,
            output: None,
            wear_budget: Vec::new(),
            expand: false,
            accept_infeasible: false,
            accept_collisions: false,
            dry_run: false,
            stress: false,
            sign_off: None,
        }
    }
}

/// `semifinish`.
#[derive(Debug, Args)]
#[command(
    long_about = "Moves a semi-finishing path along the normal of the surface, so that the finishing pass behind it meets the same \
                  force everywhere: more stock where it cuts easily, less where it cuts hard. Both programs are simulated as one. \
                  Only coordinates of cutting moves change; feeds, words and lines stay. The moved program goes through `optimize` \
                  like any other; `verify` refuses it on purpose, `--prove` is its own proof."
)]
pub struct Semifinish {
    /// Semi-finishing program, cut with one ball end mill.
    pub program: PathBuf,
    /// Finishing program that runs behind it; it is not changed.
    #[arg(long, value_name = "FINISH", required_unless_present = "prove")]
    pub finish: Option<PathBuf>,
    /// Setup file of both; without it PROGRAM.setup.toml beside the semi-finish.
    #[arg(long, value_name = "S.toml")]
    pub setup: Option<PathBuf>,
    /// Where to write the moved program; without it PROGRAM.moved.EXT beside it.
    #[arg(short, long, value_name = "OUT")]
    pub output: Option<PathBuf>,
    /// Write the report as JSON; - is standard output.
    #[arg(long, value_name = "R.json")]
    pub json: Option<PathBuf>,
    /// Reference of the finishing force in the plane normal to the tool axis, N; without it limits.force_xy of the setup, else the
    /// mean as programmed.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub force_xy: Option<f64>,
    /// Least and largest stock that may be left, mm.
    #[arg(long, value_name = "MIN,MAX", value_parser = least_and_largest, default_value = "0.05,0.4")]
    pub stock: [f64; 2],
    /// Largest change of stock per mm along the path.
    #[arg(long, value_name = "MM", default_value_t = crate::finish::semifinish::CHANGE)]
    pub change: f64,
    /// How far chords that take the place of an arc may be off, mm.
    #[arg(long, value_name = "MM", default_value_t = crate::finish::semifinish::TOLERANCE_MM)]
    pub tolerance: f64,
    /// Prove instead that MOVED differs from PROGRAM in coordinates of cutting moves only, each by no more than --within.
    #[arg(long, value_name = "MOVED", conflicts_with_all = ["finish", "output"], requires = "within")]
    pub prove: Option<PathBuf>,
    /// Largest distance between a point of MOVED and of PROGRAM, mm.
    #[arg(long, value_name = "MM", requires = "prove")]
    pub within: Option<f64>,
}

/// `optimize`.
#[derive(Debug, Args)]
pub struct Optimize {
    /// Program, setup and reports.
    #[command(flatten)]
    pub work: Work,
    /// Where the program goes; without it PROGRAM.fw.EXT beside the program; - is standard output. In another folder the files
    /// of its subprograms are written beside it, under their own names.
    #[arg(short, long, value_name = "OUT")]
    pub output: Option<PathBuf>,
    /// Unroll loops, calls and expressions into plain blocks, so that each pass gets its own feeds. What cannot be written as
    /// plain blocks (values only the control knows, modal macros) is refused with its place.
    #[arg(long)]
    pub expand: bool,
    /// Write the program even if limits cannot be met on more than a fifth of the cutting length.
    #[arg(long)]
    pub accept_infeasible: bool,
    /// Write the program even if it cuts at rapid, or shank, holder or a fixture are touched.
    #[arg(long)]
    pub accept_collisions: bool,
    /// Use at most this share of the life of each tool that has a law of wear in the setup, like 0.05; T3=0.05 for one tool.
    #[arg(long, value_name = "SHARE", value_parser = life_share)]
    pub wear_budget: Vec<crate::machine::LifeShare>,
    /// Do everything but write the program: summary and reports tell what it would be.
    #[arg(long)]
    pub dry_run: bool,
    /// Simulate the written program again with stock, offset, coefficients, runout and override other than assumed.
    #[arg(long)]
    pub stress: bool,
    /// Write one page to print and sign: hashes, limits, assumptions, what keeps its feed, the largest rise, and the worst under --stress,
    /// which it asks for.
    #[arg(long, value_name = "FILE.html")]
    pub sign_off: Option<PathBuf>,
}

/// `verify`.
#[derive(Debug, Args)]
pub struct Verify {
    /// The program as it was.
    pub original: PathBuf,
    /// The program with its feeds rewritten.
    pub rewritten: PathBuf,
    /// Setup file: offsets, home, what compensation means.
    #[arg(long, value_name = "S.toml")]
    pub setup: Option<PathBuf>,
    /// Write the proof as JSON; - is standard output.
    #[arg(long, value_name = "R.json")]
    pub json: Option<PathBuf>,
    /// A feed that is raised by more than this ratio is a fault, like 1.3.
    #[arg(long, value_name = "R", value_parser = ratio)]
    pub max_rise: Option<f64>,
}

/// `toolpath`.
#[derive(Debug, Args)]
pub struct Toolpath {
    /// NC program; - is standard input.
    pub program: PathBuf,
    /// Setup file: offsets, home, what compensation means.
    #[arg(long, value_name = "S.toml")]
    pub setup: Option<PathBuf>,
    /// Write the motions as JSON; - is standard output.
    #[arg(long, value_name = "R.json")]
    pub json: Option<PathBuf>,
}

/// `limits`.
#[derive(Debug, Args)]
pub struct Limits {
    /// NC program; - is standard input.
    pub program: PathBuf,
    /// Setup file; without it PROGRAM.setup.toml beside the program.
    #[arg(long, value_name = "S.toml")]
    pub setup: Option<PathBuf>,
    /// Write the figures as JSON; - is standard output.
    #[arg(long, value_name = "R.json")]
    pub json: Option<PathBuf>,
    /// Put the proposed limits into the setup file; what it limits already stays.
    #[arg(long)]
    pub write: bool,
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

/// Kinds of test cuts.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum PlanKind {
    /// Eight immersions by four feeds, for spindle power
    Power,
    /// Nine cuts of an orthogonal array, for mean forces
    MeanForce,
    /// Steps of R/10 in depth, for the layers of a ball end
    Layer,
}

/// What the program's text does not tell, said by the user.
#[derive(Debug, Args)]
pub struct Told {
    /// Tool library: Fusion .json or .tools, FreeCAD .fctb or .fctl, LinuxCNC .tbl.
    #[arg(long, value_name = "LIB")]
    pub tools: Option<PathBuf>,
    /// A tool in words, over comment and library: "T1 flat D10 3 flutes".
    #[arg(long, value_name = "WORDS")]
    pub tool: Vec<String>,
    /// The blank: "X0 Y0 Z-20 X100 Y60 Z0", "around" for the box around the cutting moves, or a line of [stock].
    #[arg(long, value_name = "CORNERS", allow_hyphen_values = true)]
    pub stock: Option<String>,
    /// The material: a name of the library, or as people call it: 6061, 4140, 316.
    #[arg(long, value_name = "NAME")]
    pub material: Option<String>,
    /// The machine: a name of `feedwright library machines`.
    #[arg(long, value_name = "NAME")]
    pub machine: Option<String>,
}

/// `init`.
#[derive(Debug, Args)]
pub struct Init {
    /// NC program; - is standard input.
    pub program: PathBuf,
    /// What its text does not tell.
    #[command(flatten)]
    pub told: Told,
    /// Where the setup goes; without it PROGRAM.setup.toml beside the program; - is standard output.
    #[arg(short, long, value_name = "S.toml")]
    pub output: Option<PathBuf>,
}

/// No command.
#[derive(Debug, Args)]
pub struct Start {
    /// NC program.
    pub program: PathBuf,
    /// What its text does not tell.
    #[command(flatten)]
    pub told: Told,
    /// Do not open the page.
    #[arg(long)]
    pub no_open: bool,
}

/// `tools`.
#[derive(Debug, Subcommand)]
pub enum Tools {
    /// Print the tools of a library as [[tool]] tables of a setup
    Import(Import),
}

/// `tools import`.
#[derive(Debug, Args)]
pub struct Import {
    /// Fusion .json or .tools, FreeCAD .fctb or .fctl, LinuxCNC .tbl.
    pub file: PathBuf,
    /// A library that states no unit (LinuxCNC) is in inches.
    #[arg(long)]
    pub inch: bool,
    /// Write the tables to a file; - is standard output.
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

/// `calibrate`; `--model` names the force model: power (default), linear-edge, kienzle, sigmoid, layer, response, polynomial.
#[derive(Debug, Args)]
pub struct Calibrate {
    /// Table of steady cuts, CSV; with --log or --reading the NC program.
    #[arg(value_name = "TABLE.csv")]
    pub input: Option<PathBuf>,
    /// Write the NC program of the test cuts instead (-o), and say how well they will tell the coefficients.
    #[arg(long, value_name = "KIND", conflicts_with_all = ["input", "log", "reading"])]
    pub plan: Option<PlanKind>,
    /// Log of the program: its steady cuts are the table.
    #[arg(long, value_name = "LOG", conflicts_with = "reading")]
    pub log: Option<PathBuf>,
    /// Load meter read by eye while the program runs, one for each tool: "T1 peak 45% idle 8%" (%, W or kW).
    #[arg(long, value_name = "LINE")]
    pub reading: Vec<String>,
    /// What measured forces act on.
    #[arg(long, value_name = "WHAT", default_value = "workpiece")]
    pub force_on: ForceOn,
    /// Setup file with the tool and the efficiency of the drive.
    #[arg(long, value_name = "S.toml")]
    pub setup: Option<PathBuf>,
    /// Names of columns: THEIRS=OURS,…, or of all columns in their order; see `feedwright log`.
    #[arg(long, value_name = "MAP")]
    pub columns: Option<String>,
    /// Power with nothing cut, W, when it is known.
    #[arg(long, value_name = "W")]
    pub tare: Option<f64>,
    /// Outliers count less (Huber).
    #[arg(long)]
    pub robust: bool,
    /// Write the model file.
    #[arg(short, long, value_name = "model.toml")]
    pub output: Option<PathBuf>,
    /// Write the report as JSON; - is standard output.
    #[arg(long, value_name = "R.json")]
    pub json: Option<PathBuf>,
}

/// What a log may hold, for `learn --help`.
const LOG_COLUMNS: &str = "Columns of a log, by the names in its header or as --columns maps them (units in brackets or at the end are \
converted, case and blanks do not matter):
  time_s                       seconds, ISO 8601, a date and time, or a time of day
  x_mm y_mm z_mm               position in the work frame
  line, block                  physical line (from 1), index of the block (from 0)
  feed_mm_min, spindle_rpm, tool, feed_override_percent
and at least one of
  spindle_power_w              as the meter reads it
  spindle_torque_nm  spindle_current_a  spindle_load_percent
  force_x_n force_y_n force_z_n force_xy_n
Tables with commas, semicolons, tabs or blanks, decimal commas, lines before the header, a row of units; workbooks (.xlsx); MTConnect \
adapter output (SHDR) and streams (XML). `feedwright log FILE` shows what is read of a file.";

/// `learn`.
#[derive(Debug, Args)]
#[command(after_help = LOG_COLUMNS)]
pub struct Learn {
    /// NC program.
    pub program: PathBuf,
    /// Measured log: CSV or MTConnect adapter output.
    #[arg(long, value_name = "LOG")]
    pub log: PathBuf,
    /// Setup file; without it PROGRAM.setup.toml beside the program.
    #[arg(long, value_name = "S.toml")]
    pub setup: Option<PathBuf>,
    /// Names of columns: THEIRS=OURS,…, or of all columns in their order; see `feedwright log`.
    #[arg(long, value_name = "MAP")]
    pub columns: Option<String>,
    /// What a sample of a force is.
    #[arg(long, value_name = "WHAT", default_value = "peak")]
    pub sample: SampleKind,
    /// Time over which an instantaneous force is followed for its peak, s; one turn of the spindle when absent.
    #[arg(long, value_name = "S")]
    pub window: Option<f64>,
    /// What measured forces act on (a resultant is the same on both).
    #[arg(long, value_name = "WHAT", default_value = "workpiece")]
    pub force_on: ForceOn,
    /// Write the model file.
    #[arg(short, long, value_name = "model.toml")]
    pub output: Option<PathBuf>,
    /// Write the report as JSON; - is standard output.
    #[arg(long, value_name = "R.json")]
    pub json: Option<PathBuf>,
    /// Write the report as one HTML file.
    #[arg(long, value_name = "R.html")]
    pub report: Option<PathBuf>,
    /// Write the NC program of the cuts that separate effects which explain the log equally well.
    #[arg(long, value_name = "NEXT.nc")]
    pub experiment: Option<PathBuf>,
}

/// `log`.
#[derive(Debug, Args)]
#[command(after_help = LOG_COLUMNS)]
pub struct LogView {
    /// Measured log: a table (CSV with any separator, workbook .xlsx), MTConnect adapter output or streams.
    pub file: PathBuf,
    /// Names of columns: THEIRS=OURS,…; for a file without a header the names of all its columns: time_s,x_mm,…
    #[arg(long, value_name = "MAP")]
    pub columns: Option<String>,
    /// Write the columns that are proposed into this setup, as its [log] table.
    #[arg(long, value_name = "S.toml")]
    pub write: Option<PathBuf>,
    /// Write what was read as JSON; - is standard output.
    #[arg(long, value_name = "R.json")]
    pub json: Option<PathBuf>,
}

/// `evaluate`.
#[derive(Debug, Args)]
pub struct Evaluate {
    /// Process model, as `calibrate` and `learn` write it.
    #[arg(value_name = "MODEL.toml")]
    pub held: PathBuf,
    /// NC program of the log; without --log a table of steady cuts, CSV.
    pub input: PathBuf,
    /// Measured log of the program: CSV or MTConnect adapter output.
    #[arg(long, value_name = "LOG")]
    pub log: Option<PathBuf>,
    /// Setup file; without it PROGRAM.setup.toml beside the program.
    #[arg(long, value_name = "S.toml")]
    pub setup: Option<PathBuf>,
    /// Names of columns: THEIRS=OURS,…, or of all columns in their order; see `feedwright log`.
    #[arg(long, value_name = "MAP")]
    pub columns: Option<String>,
    /// What a sample of a force is.
    #[arg(long, value_name = "WHAT", default_value = "peak")]
    pub sample: SampleKind,
    /// Time over which an instantaneous force is followed for its peak, s; one turn of the spindle when absent.
    #[arg(long, value_name = "S")]
    pub window: Option<f64>,
    /// Write the report as JSON; - is standard output.
    #[arg(long, value_name = "R.json")]
    pub json: Option<PathBuf>,
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

/// `learn-table`.
#[derive(Debug, Args)]
pub struct LearnTable {
    /// Table of steady cuts, CSV.
    pub table: PathBuf,
    /// Setup file with the tool and the efficiency of the drive.
    #[arg(long, value_name = "S.toml")]
    pub setup: Option<PathBuf>,
    /// Names of columns: THEIRS=OURS,…, or of all columns in their order; see `feedwright log`.
    #[arg(long, value_name = "MAP")]
    pub columns: Option<String>,
    /// Write the model file.
    #[arg(short, long, value_name = "model.toml")]
    pub output: Option<PathBuf>,
    /// Write the report as JSON; - is standard output.
    #[arg(long, value_name = "R.json")]
    pub json: Option<PathBuf>,
    /// Write the report as one HTML file.
    #[arg(long, value_name = "R.html")]
    pub report: Option<PathBuf>,
}

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

/// How feeds are regulated for a long life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Least time within the wear that the program may cause
    Budget,
    /// The whole profile at the force that the line to the target has at the next check point
    Force,
}

/// What both have in common.
#[derive(Debug, Args)]
pub struct LifeFiles {
    /// NC program; for update the one that plan or the last update wrote.
    pub program: PathBuf,
    /// Setup file; without it PROGRAM.setup.toml beside the program. Its tool needs a law of wear (wear = { … }).
    #[arg(long, value_name = "S.toml")]
    pub setup: Option<PathBuf>,
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
    /// Write the report as JSON; - is standard output.
    #[arg(long, value_name = "R.json")]
    pub json: Option<PathBuf>,
    /// How the feeds are regulated.
    #[arg(long, value_name = "HOW", default_value = "budget")]
    pub method: Method,
    /// Write the program even if the target cannot be reached, or limits be met, at the lowest feeds.
    #[arg(long)]
    pub accept_infeasible: bool,
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
    /// Names of columns: THEIRS=OURS,…
    #[arg(long, value_name = "MAP")]
    pub columns: Option<String>,
    /// What a sample of a force is, in a log.
    #[arg(long, value_name = "WHAT", default_value = "peak")]
    pub sample: SampleKind,
    /// Time over which an instantaneous force is followed for its peak, s, in a log.
    #[arg(long, value_name = "S")]
    pub window: Option<f64>,
}

/// Units of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Unit {
    /// Millimetres
    Mm,
    /// Inches
    Inch,
}

/// `stepover`: passes of a ball or bull-nose end mill over a surface, each as far from the one before as the reference force and the
/// scallop limit allow. The program is simulated before it is written.
#[derive(Debug, Args)]
pub struct Stepover {
    /// Mesh of the surface, binary or text STL; it need not be closed. In work coordinates.
    #[arg(long, value_name = "PART.stl")]
    pub surface: PathBuf,
    /// Setup file: machine, tool, material, limits.
    #[arg(long, value_name = "S.toml")]
    pub setup: PathBuf,
    /// Where the program goes; without it PART.nc beside the mesh; - is standard output.
    #[arg(short, long, value_name = "OUT.nc")]
    pub output: Option<PathBuf>,
    /// Write the report as JSON; - is standard output.
    #[arg(long, value_name = "R.json")]
    pub json: Option<PathBuf>,
    /// Write the surface coloured by force and by scallop as one HTML file.
    #[arg(long, value_name = "R.html")]
    pub report: Option<PathBuf>,
    /// Unit of the numbers in the mesh.
    #[arg(long, value_name = "UNIT", default_value = "mm")]
    pub unit: Unit,
    /// Tool number; the only ball or bull-nose end mill of the setup when absent.
    #[arg(long, value_name = "T")]
    pub tool: Option<u32>,
    /// Spindle speed, rev/min; that of the tool in the setup when absent.
    #[arg(long, value_name = "RPM")]
    pub rpm: Option<f64>,
    /// One feed for all passes, mm/min; each pass gets its best one within the limits of the setup when absent.
    #[arg(long, value_name = "F")]
    pub feed: Option<f64>,
    /// Peak force that is held, N; force_xy of the setup when absent.
    #[arg(long, value_name = "N")]
    pub reference_force: Option<f64>,
    /// Largest scallop height, mm.
    #[arg(long, value_name = "MM", default_value_t = 0.01)]
    pub scallop: f64,
    /// Thickness of the stock that stands on the surface, along its normal, mm.
    #[arg(long, value_name = "MM", default_value_t = 0.1)]
    pub stock: f64,
    /// Least step-over seen from above, mm; a fiftieth of the tool's radius when absent.
    #[arg(long, value_name = "MM")]
    pub least_step_over: Option<f64>,
    /// Largest step-over seen from above, mm; the tool's radius when absent.
    #[arg(long, value_name = "MM")]
    pub largest_step_over: Option<f64>,
    /// Direction of the passes from +X, degrees; they follow each other to their left.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true)]
    pub direction: f64,
    /// How far a pass may turn away from its direction, degrees: 0 is straight.
    #[arg(long, value_name = "DEG", default_value_t = 0.0)]
    pub turn: f64,
    /// How far the lines of the program may lie from the path on the surface, mm.
    #[arg(long, value_name = "MM", default_value_t = 0.003)]
    pub tolerance: f64,
}

/// A stage of the pipeline.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Stage {
    /// Tokens with their bytes
    Tokens,
    /// Blocks
    Blocks,
    /// Motions with feed, tool and freeze
    Moves,
    /// Engaged arcs at every station
    Engagement,
    /// Loads at every station at the programmed feed
    Loads,
    /// Points of the machined walls with their error at the programmed feed
    Surface,
    /// What the schedule is asked
    Problem,
}

/// `dump`.
#[derive(Debug, Args)]
pub struct Dump {
    /// Which stage.
    pub stage: Stage,
    /// NC program; - is standard input.
    pub program: PathBuf,
    /// Setup file; without it PROGRAM.setup.toml beside the program.
    #[arg(long, value_name = "S.toml")]
    pub setup: Option<PathBuf>,
}

/// A shelf of the library.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Shelf {
    /// Tool presets
    Tools,
    /// Materials with their coefficients
    Materials,
    /// Machines
    Machines,
    /// Effects that diagnosis may name
    Effects,
    /// Force models
    Models,
}

/// `library`.
#[derive(Debug, Args)]
pub struct Library {
    /// Which shelf; all of them when absent.
    pub shelf: Option<Shelf>,
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

fn life_share(text: &str) -> Result<crate::machine::LifeShare, String> {
    let (tool, share) = match text.split_once('=') {
        Some((tool, share)) => (Some(tool), share),
        None => (None, text),
    };
    let help = "write a share of the life from above 0 to 1, like 0.05 for every tool or T3=0.05 for one";
    let number = |tool: &str| tool.strip_prefix(['T', 't']).and_then(|number| number.parse().ok());
    let tool = tool.map(|tool| number(tool).ok_or(help)).transpose()?;
    let share = share.parse::<f64>().ok().filter(|share| *share > 0.0 && *share <= 1.0).ok_or(help)?;
    Ok(crate::machine::LifeShare { tool, share })
}

fn ratio(text: &str) -> Result<f64, String> {
    let ratio = text.parse::<f64>().ok().filter(|ratio| *ratio > 0.0 && ratio.is_finite());
    ratio.ok_or_else(|| "it is a ratio of feeds, after over before: 1.3 allows 30 % more".to_owned())
}

fn cycle_time(text: &str) -> Result<f64, String> {
    let parts: Vec<Option<f64>> = text.split(':').map(|part| part.parse::<f64>().ok()).collect();
    let seconds = parts.iter().try_fold(0.0, |sum, part| part.filter(|p| *p >= 0.0).map(|part| 60.0 * sum + part));
    let sound = seconds.filter(|seconds| parts.len() <= 3 && *seconds > 0.0 && seconds.is_finite());
    sound.ok_or_else(|| "write minutes and seconds, like 12:34, or 1:12:34".to_owned())
}

fn positive(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| *value > 0.0 && value.is_finite());
    value.ok_or_else(|| "it is a length in m, above 0".to_owned())
}

fn confidence(text: &str) -> Result<f64, String> {
    let share = text.parse::<f64>().ok().filter(|share| (0.5..1.0).contains(share));
    share.ok_or_else(|| "it is a share from 0.5 to below 1: 0.95 is usual".to_owned())
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

/// `0.05,0.4`: two numbers.
fn least_and_largest(text: &str) -> Result<[f64; 2], String> {
    let both: Vec<f64> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    both.try_into().map_err(|_| "two numbers with a comma between, like 0.05,0.4".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn times_percentiles_and_confidences_are_read() {
        assert_eq!([cycle_time("12:34"), cycle_time("1:00:01.5"), cycle_time("90")], [Ok(754.0), Ok(3601.5), Ok(90.0)]);
        assert!(["", "x", "1:-2", "0:0", "1:2:3:4", "nan"].iter().all(|text| cycle_time(text).is_err()));
        assert_eq!([own_percentile("self"), own_percentile("self:95")], [Ok(100.0), Ok(95.0)]);
        assert!(["", "other", "self:", "self:101", "self:nan"].iter().all(|text| own_percentile(text).is_err()));
        let life = |text: &str| life_share(text).map(|life| (life.tool, life.share)).ok();
        assert_eq!([life("0.05"), life("T3=1")], [Some((None, 0.05)), Some((Some(3), 1.0))]);
        assert!(["", "0", "1.1", "3=0.5", "T=0.5", "nan"].iter().all(|text| life(text).is_none()));
        assert!(confidence("0.95").is_ok() && confidence("1").is_err() && confidence("nan").is_err());
    }

    #[test]
    fn memory_is_read_with_its_unit() {
        assert_eq!(bytes("2G"), Ok(2 << 30));
        assert_eq!(bytes("1.5 MiB"), Ok(3 << 19));
        assert!(bytes("lots").is_err() && bytes("-1").is_err());
    }
}
