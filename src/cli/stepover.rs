//! `stepover`. In: the mesh of a surface and a setup. Out: a program of finishing passes with varying step-over.

use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::error::CliError;
use super::input;
use super::learn::open;
use super::options::{Global, above_zero, finite};
use super::output::{Kind, Outputs};
use super::screen::Screen;
use crate::engage;
use crate::engage::workpiece::{Source, pieces, sources};
use crate::finish::stepover::text::usual_tolerance_mm;
use crate::finish::stepover::{Around, Layout, Refusal, Request, Surface, around, run};
use crate::job::stepover::at_reference_force;
use crate::machine::{Job, StockShape};
use crate::nc::{Dialect, Toolpath};
use crate::report::{Outcome, stepover_html, stepover_json, stepover_unmet, stepover_words};
use crate::stock::Piece;
use crate::units::{MM_PER_INCH, mm_s_from_mm_min, rps_from_rpm};

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
    #[arg(long, value_name = "RPM", allow_negative_numbers = true, value_parser = above_zero)]
    pub rpm: Option<f64>,
    /// Highest feed, mm/min; what the limits of the setup allow when absent. It is lowered where the force asks for it.
    #[arg(long, value_name = "F", allow_negative_numbers = true, value_parser = above_zero)]
    pub feed: Option<f64>,
    /// Peak force that is held, N; force_xy of the setup when absent.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = above_zero)]
    pub reference_force: Option<f64>,
    /// Largest scallop height, mm.
    #[arg(long, value_name = "MM", default_value_t = 0.01, allow_negative_numbers = true, value_parser = above_zero)]
    pub scallop: f64,
    /// Thickness of the stock that stands on the surface, along its normal, mm; when absent that of the saved stock of the setup ([stock]
    /// saved = …), or 0.1 where there is none.
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = above_zero)]
    pub stock: Option<f64>,
    /// Slope up to which the surface is machined, degrees.
    #[arg(long, value_name = "DEG", default_value_t = STEEPEST_DEG, allow_negative_numbers = true, value_parser = finite)]
    pub steepest: f64,
    /// Least step-over, mm, seen from above, of contour passes along the surface; a fiftieth of the tool's radius when absent.
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = above_zero)]
    pub least_step_over: Option<f64>,
    /// Largest step-over, measured alike, mm; the tool's radius when absent.
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = above_zero)]
    pub largest_step_over: Option<f64>,
    /// How passes lie: side by side in one direction, or each at one height from the top downwards (constant z), for steep parts.
    #[arg(long, value_name = "HOW", default_value = "parallel")]
    pub passes: Passes,
    /// Direction of parallel passes from +X, degrees, 0 when absent; they follow each other to their left.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = finite)]
    pub direction: Option<f64>,
    /// How far a parallel pass may turn away from its direction, degrees: 0, straight, when absent.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = finite)]
    pub turn: Option<f64>,
    /// Slope from level that contour passes begin at, degrees, 30 when absent; how much of the surface is shallower is said.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = finite)]
    pub shallowest: Option<f64>,
    /// How far the lines of the program may lie from the path on the surface, mm. Scallops rise by it, so that step-overs are the shorter.
    /// When absent 0.003 mm, of parallel passes at most a tenth of --scallop, but not less than the digits of the program can keep.
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = above_zero)]
    pub tolerance: Option<f64>,
}

/// Units of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Unit {
    /// Millimetres
    Mm,
    /// Inches
    Inch,
}

/// Kinds of passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Passes {
    /// Side by side
    Parallel,
    /// Each at one height
    Contour,
}

/// Contour passes begin at this slope from level, degrees. A scallop limit allows a step-over w along the surface on any slope; that is a
/// step down of w·sin θ, and the least along a pass holds for all of it: half of w where the shallowest ground has 30°.
const SHALLOWEST_DEG: f64 = 30.0;

/// Facets steeper than this are not machined from above, degrees.
const STEEPEST_DEG: f64 = 85.0;

/// Thickness of the stock where nothing else says it, mm.
const STOCK_MM: f64 = 0.1;

/// The first stock of the setup, in cells fine enough to see what stands beside the surface; what an earlier program left in its own cells.
fn around(job: &Job) -> Result<Option<Around>, CliError> {
    let mut alone = job.clone();
    alone.stocks.truncate(1);
    alone.machine.offsets.clear();
    let Some(stock) = alone.stocks.first() else { return Ok(None) };
    let is_left = matches!(stock.shape, StockShape::Saved(_));
    let load = |file: &Path| std::fs::read(file);
    let options = engage::Options { loader: Some(&load), ..engage::Options::default() };
    let why = |error: engage::EngageError| CliError::new(error.to_string(), "correct [stock] of the setup");
    let sources = sources(&alone, &Toolpath::default(), &options, &mut Vec::new()).map_err(why)?;
    let cell_mm = |source: &Source| match source {
        Source::Saved(piece) if !piece.cuts.is_empty() => piece.field.cell[0].max(piece.field.cell[1]),
        other => around::cell_mm(&other.extent()),
    };
    let cell_mm = sources.iter().map(cell_mm).fold(0.0, f64::max);
    let pieces = pieces(sources, cell_mm, &mut Vec::new()).map_err(why)?;
    Ok(pieces.into_iter().next().map(|piece| Around { piece, is_left }))
}

/// Plans, checks, writes.
pub fn stepover(command: &Stepover, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let inputs = [Some(command.surface.clone()), Some(command.setup.clone()), global.model.clone()];
    let mut outputs = Outputs::new(inputs.into_iter().flatten(), global.force);
    let target = command.output.clone().unwrap_or_else(|| command.surface.with_extension("nc"));
    let program = outputs.open(&target, Kind::Program)?;
    let json = open(&mut outputs, command.json.as_deref(), Kind::Json)?;
    let page = open(&mut outputs, command.report.as_deref(), Kind::Markup)?;
    let read = input::read(input::text(&command.setup)?, &command.setup)?;
    let mut job = input::with_options(read, global)?.job;
    for told in crate::job::learned::apply(&mut job) {
        screen.say(&format!("{} = {} ({})\n", told.key, told.value, told.source));
    }
    let dialect = job.machine.dialect.as_deref().and_then(Dialect::from_name).unwrap_or(Dialect::Generic);
    let factor = if command.unit == Unit::Inch { MM_PER_INCH } else { 1.0 };
    let bytes = input::file(&command.surface)?;
    let surface = Surface::read(&bytes, factor, command.steepest.to_radians())
        .map_err(|error| CliError::new(format!("{}: {error}", command.surface.display()), "give the surface as STL"))?;
    let layout = layout(command)?;
    if !(command.steepest > 0.0 && command.steepest < 90.0) {
        return Err(CliError::new(
            format!("--steepest {} makes no sense", command.steepest),
            "give degrees between 0 and 90",
        ));
    }
    let inch = job.machine.unsaid.inch.unwrap_or(job.inch);
    let file = if target.as_os_str() == "-" { &command.surface } else { &target };
    let ask = Request {
        name: file.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
        tool: command.tool,
        rps: command.rpm.map(rps_from_rpm),
        feed_mm_s: command.feed.map(mm_s_from_mm_min),
        force_n: command.reference_force,
        scallop_mm: command.scallop,
        stock_mm: command.stock.unwrap_or(STOCK_MM),
        step_over_mm: [command.least_step_over, command.largest_step_over],
        layout,
        tolerance_mm: command.tolerance.unwrap_or_else(|| usual_tolerance_mm(command.scallop, &layout, inch)),
    };
    let bar = screen.progress("planning");
    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64();
    let hold = |text: &str, piece: &Piece, reference_n: f64| {
        at_reference_force(text, piece, (&job, dialect, reference_n), &clock).map_err(|error| Refusal::Plain {
            why: format!("no feeds could be found for the planned passes: {error}"),
            help: "correct the setup as it says".into(),
        })
    };
    let around = around(&job)?;
    let left = around.as_ref().filter(|around| around.is_left && command.stock.is_none()).cloned();
    let assumed = command.stock.is_none() && left.is_none();
    let found = run(&surface, (&job, dialect), &ask, (left.map(|left| left.piece), around), &hold);
    bar.finish_and_clear();
    if found.is_err() {
        // What was repaired may be why.
        surface.notes.iter().for_each(|note| screen.say(&format!("note      {note}")));
    }
    let mut answer = found.map_err(|error| refused(&error, &command.surface))?;
    if assumed {
        answer.notes.insert(0, assumed_stock());
    }
    let to_stdout = program.is_stdout() || json.as_ref().is_some_and(super::output::Output::is_stdout);
    let words = stepover_words(&answer);
    if to_stdout {
        screen.say(&words);
    } else {
        screen.show(&words)?;
    }
    if let Some(json) = json {
        json.write(stepover_json(&answer).as_bytes())?;
    }
    if let Some(page) = page {
        page.write(stepover_html(&answer, &command.surface.display().to_string()).as_bytes())?;
    }
    if !answer.varying.check.events.is_empty() {
        outputs.commit()?;
        screen.say(
            "nothing was written: the program would do what it must not (events above); lines are those of the program that was planned. Clear what \
             stands in the way first, or give mesh and stock of the whole part",
        );
        return Ok(Outcome::Unmet);
    }
    program.write(answer.varying.text.as_bytes())?;
    outputs.commit()?;
    if !to_stdout {
        screen.say(&format!("written   {}", target.display()));
    }
    let unmet = stepover_unmet(&answer);
    for sentence in &unmet {
        screen.say(&format!("{sentence}; look at the page (--report) before it runs"));
    }
    Ok(if unmet.is_empty() { Outcome::Done } else { Outcome::Unmet })
}

/// What is taken to stand on the surface where nothing says it: raw stock there would be met at rapid.
fn assumed_stock() -> String {
    format!(
        "the program is for stock of {STOCK_MM} mm on the surface, as nothing says it: give --stock, or [stock] saved = … with what the program \
         before left"
    )
}

/// How passes are to lie.
fn layout(command: &Stepover) -> Result<Layout, CliError> {
    let (turn, shallowest) = (command.turn.unwrap_or(0.0), command.shallowest.unwrap_or(SHALLOWEST_DEG));
    if !(0.0..=45.0).contains(&turn) {
        return Err(CliError::new(format!("--turn {turn} makes no sense"), "give degrees from 0 to 45"));
    }
    let contour = command.passes == Passes::Contour;
    if contour && !(shallowest > 0.0 && shallowest < command.steepest) {
        return Err(CliError::new(
            format!("--shallowest {shallowest} makes no sense"),
            "give degrees above 0 and below --steepest",
        ));
    }
    let other = [
        ("--direction", command.direction, contour),
        ("--turn", command.turn, contour),
        ("--shallowest", command.shallowest, !contour),
    ];
    if let Some((name, ..)) = other.iter().find(|(_, value, idle)| *idle && value.is_some()) {
        return Err(CliError::new(
            format!("{name} says nothing to these passes"),
            "--direction and --turn go with --passes parallel, --shallowest with --passes contour",
        ));
    }
    Ok(if contour {
        Layout::Contour { shallowest_rad: shallowest.to_radians() }
    } else {
        let direction = command.direction.unwrap_or(0.0);
        Layout::Parallel { direction_rad: direction.to_radians(), turn_rad: turn.to_radians() }
    })
}

fn refused(error: &Refusal, surface: &Path) -> CliError {
    let Refusal::Plain { why, help } = error;
    CliError::new(format!("{}: {why}", surface.display()), help.clone())
}
