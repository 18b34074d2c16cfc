//! `semifinish`. In: semi-finishing and finishing program with their setup. Out: the semi-finish moved for a constant finishing force; or the
//! proof that an earlier result moved no more than that.

use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::error::CliError;
use super::input::{self, Source};
use super::options::{Common, Global, above_zero, finite, from_zero};
use super::output::{Kind, Outputs};
use super::screen::Screen;
use super::work;
use crate::engage;
use crate::finish::semifinish::{CHANGE, STOCK_MM, TOLERANCE_MM, Wanted, proof};
use crate::job::semifinish::{MoveError, Pair, Shifted, Which, semifinish as moved};
use crate::job::{Keep, Watch};
use crate::nc::{self, Environment};
use crate::report::{Outcome, Semifinished, semifinish_report};

/// `semifinish`.
#[derive(Debug, Args)]
#[command(
    long_about = "Moves a semi-finishing path along the normal of the surface, so that the finishing pass behind it meets the same \
                  force everywhere: more stock where it cuts easily, less where it cuts hard. Both programs are simulated as one. \
                  Only coordinates of cutting moves change; feeds, words and lines stay. The moved program goes through `optimize` \
                  like any other; `verify` refuses it on purpose, `--prove` is its own proof."
)]
#[command(mut_arg("setup", |arg| arg.help("Setup file of both; without it PROGRAM.setup.toml beside the semi-finish")))]
pub struct Semifinish {
    /// Semi-finishing program, cut with one ball end mill; in G code, as plain language (Heidenhain) is not moved.
    pub program: PathBuf,
    /// Finishing program that runs behind it; it is not changed.
    #[arg(long, value_name = "FINISH", required_unless_present = "prove")]
    pub finish: Option<PathBuf>,
    /// Setup and report.
    #[command(flatten)]
    pub common: Common,
    /// Where to write the moved program; without it PROGRAM.moved.EXT beside it.
    #[arg(short, long, value_name = "OUT")]
    pub output: Option<PathBuf>,
    /// Reference of the finishing force in the plane normal to the tool axis, N; without it limits.force_xy of the setup, else the
    /// mean as programmed.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = above_zero)]
    pub force_xy: Option<f64>,
    #[arg(long, value_name = "MIN,MAX", allow_hyphen_values = true, value_parser = least_and_largest,
        help = format!("Least and largest stock that may be left, mm [default: {},{}]", STOCK_MM[0], STOCK_MM[1]))]
    pub stock: Option<[f64; 2]>,
    /// Largest change of stock per mm along the path.
    #[arg(long, value_name = "MM", default_value_t = CHANGE, allow_negative_numbers = true, value_parser = above_zero)]
    pub change: f64,
    /// How far chords that take the place of an arc may be off, mm.
    #[arg(long, value_name = "MM", default_value_t = TOLERANCE_MM, allow_negative_numbers = true, value_parser = above_zero)]
    pub tolerance: f64,
    /// Prove instead that MOVED differs from PROGRAM in coordinates of cutting moves only, each by no more than --within.
    #[arg(long, value_name = "MOVED", conflicts_with_all = ["finish", "output"], requires = "within")]
    pub prove: Option<PathBuf>,
    /// Largest distance between a point of MOVED and of PROGRAM, mm.
    #[arg(long, value_name = "MM", requires = "prove", allow_negative_numbers = true, value_parser = from_zero)]
    pub within: Option<f64>,
}

/// Moves the semi-finish, or proves that a program is one that was moved.
pub fn semifinish(command: &Semifinish, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    if let (Some(other), Some(within_mm)) = (&command.prove, command.within) {
        return proven(command, other, within_mm, global, screen);
    }
    let semi = input::program(&command.program)?;
    let Some(finish) = &command.finish else {
        return Err(CliError::new("the finishing program is missing", "name it with --finish"));
    };
    let finish = input::program(finish)?;
    if semi.bytes == finish.bytes {
        return Err(CliError::new(
            "semi-finish and finish are the same program",
            "give the program that runs before the finishing pass first, and the finishing pass with --finish",
        ));
    }
    let setup = input::setup(command.common.setup(), &semi, global)?;
    let inputs = [semi.path.clone(), finish.path.clone(), setup.path.clone(), global.model.clone()];
    let mut outputs = Outputs::new(inputs.into_iter().flatten(), global.force);
    let target = target(command.output.as_deref(), &semi);
    let output = outputs.open(&target, Kind::Program)?;
    let json = command.common.json().map(|path| outputs.open(path, Kind::Json)).transpose()?;
    let wanted = Wanted {
        force_n: command.force_xy,
        stock_mm: command.stock.unwrap_or(STOCK_MM),
        change: command.change,
        tolerance_mm: command.tolerance,
    };
    let programs = [input::parse(&semi, global, Some(&setup.job))?, input::parse(&finish, global, Some(&setup.job))?];
    let [semi_program, finish_program] = programs;
    let pair =
        Pair { semi: semi_program, finish: finish_program, job: setup.job, assumptions: setup.assumptions, wanted };
    let shifted = run(pair, [&semi, &finish], global, screen)?;
    screen.diagnostics(&semi.name, &semi.bytes, &shifted.diagnostics);
    let report = semifinish_report(Semifinished {
        names: [&semi.name, &finish.name],
        job: &shifted.job,
        paths: &shifted.paths,
        wanted: shifted.wanted,
        reference_source: shifted.reference_source,
        answer: &shifted.answer,
        after: &shifted.again.loads,
        deviation_n: &shifted.again.deviation_n,
        gouge: shifted.gouge,
        written: [
            shifted.moved.blocks_changed,
            shifted.moved.words_added,
            shifted.moved.arcs_cut[0],
            shifted.moved.arcs_cut[1],
        ],
        assumptions: &shifted.assumptions,
        warnings: shifted.warnings.clone(),
    });
    let to_stdout = output.is_stdout() || json.as_ref().is_some_and(super::output::Output::is_stdout);
    let text = report.text();
    if to_stdout {
        screen.say(&text);
    } else {
        screen.show(&text)?;
    }
    for warning in &shifted.warnings {
        screen.say(&format!("warning: {warning}"));
    }
    if let Some(json) = json {
        json.write(report.json().as_bytes())?;
    }
    if let Some([why, help]) = &shifted.refused {
        outputs.commit()?;
        return Err(CliError::unmet(why.clone(), help.clone()));
    }
    output.write(&shifted.moved.bytes)?;
    outputs.commit()?;
    if !to_stdout {
        screen.say(&format!("written   {}", target.display()));
    }
    let Some(unmet) = report.unmet() else { return Ok(Outcome::Done) };
    screen.say(&format!("{unmet}; allow other stock there (--stock), or take a larger --force-xy"));
    Ok(Outcome::Unmet)
}

fn run(pair: Pair, [semi, finish]: [&Source; 2], global: &Global, screen: Screen) -> Result<Shifted, CliError> {
    let bar = screen.progress("");
    let start = Instant::now();
    let folder = semi.path.as_deref().and_then(Path::parent).map(Path::to_owned);
    let watch = Watch {
        progress: &|stage, done| {
            bar.set_message(stage);
            bar.set_position((1000.0 * done) as u64);
        },
        clock: &|| start.elapsed().as_secs_f64(),
        subprograms: &|name| work::subprogram(folder.as_deref(), name),
        engage: engage::Options {
            max_memory_bytes: work::memory_of_the_field(global),
            loader: Some(&|path| std::fs::read(path)),
            ..engage::Options::default()
        },
        keep: Keep::default(),
    };
    let result = moved(pair, &watch);
    bar.finish_and_clear();
    result.map_err(|error| match error {
        MoveError::Job { error, of: Which::Semi } => work::explain(&error, &semi.name),
        MoveError::Job { error, of: Which::Finish } => work::explain(&error, &finish.name),
        MoveError::Finish(error) => CliError::new(error.to_string(), error.help()),
    })
}

/// `part.nc` → `part.moved.nc`.
fn target(given: Option<&Path>, source: &Source) -> PathBuf {
    if let Some(path) = given {
        return path.to_owned();
    }
    let Some(path) = &source.path else { return PathBuf::from("-") };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let name = match path.extension() {
        Some(extension) => format!("{stem}.moved.{}", extension.to_string_lossy()),
        None => format!("{stem}.moved"),
    };
    path.with_file_name(name)
}

/// The proof of a moved program.
fn proven(
    command: &Semifinish,
    other: &Path,
    within_mm: f64,
    global: &Global,
    screen: Screen,
) -> Result<Outcome, CliError> {
    let [before, after] = [input::program(&command.program)?, input::program(other)?];
    let setup = input::setup_if_any(command.common.setup(), &before, global)?;
    let inputs = [before.path.clone(), after.path.clone(), command.common.setup.clone()];
    let mut outputs = Outputs::new(inputs.into_iter().flatten(), global.force);
    let json = command.common.json().map(|path| outputs.open(path, Kind::Json)).transpose()?;
    let job = setup.as_ref().map(|setup| &setup.job);
    let program = input::parse(&before, global, job)?;
    let moved = nc::parse(after.bytes.clone(), Some(program.dialect()));
    let folder = before.path.as_deref().and_then(Path::parent).map(Path::to_owned);
    let load = |name: &str| work::subprogram(folder.as_deref(), name);
    let environment = Environment { load: &load, ..job.map(Environment::from_job).unwrap_or_default() };
    let environment = nc::unit::with_its_unit(&program, environment, job);
    let paths = [nc::interpret(&program, &environment), nc::interpret(&moved, &environment)];
    let proof = proof::prove([&program, &moved], [&paths[0], &paths[1]], within_mm);
    let mut text = if proof.holds() {
        format!(
            "only coordinates of cutting moves differ: {} motions compared, {} moved, by {:.4} mm at most; {} lines of chords in place of arcs\n",
            proof.motions, proof.moved, proof.largest_mm, proof.chords
        )
    } else if proof.differences.is_empty() {
        "nothing is proven: no motion could be read from these programs\n".to_owned()
    } else {
        "more than coordinates of cutting moves differ, or by more than allowed:\n".to_owned()
    };
    for ([own, other], what) in &proof.differences {
        text += &format!("  line {own} → line {other}: {what}\n");
    }
    if let Some(json) = json {
        let lines = proof
            .differences
            .iter()
            .map(|([own, other], what)| serde_json::json!({ "original_line": own, "moved_line": other, "text": what }));
        let report = serde_json::json!({
            "written_by": crate::report::WRITTEN_BY, "holds": proof.holds(), "motions": proof.motions, "moved": proof.moved,
            "chords": proof.chords, "largest_mm": proof.largest_mm, "within_mm": within_mm,
            "differences": lines.collect::<Vec<_>>(),
        });
        json.write((serde_json::to_string_pretty(&report).expect("plain data") + "\n").as_bytes())?;
    }
    outputs.commit()?;
    screen.show(&text)?;
    Ok(if proof.holds() { Outcome::Done } else { Outcome::Unmet })
}

/// `0.05,0.4`: two numbers.
fn least_and_largest(text: &str) -> Result<[f64; 2], String> {
    let both: Result<Vec<f64>, String> = text.split(',').map(|part| finite(part.trim())).collect();
    both.unwrap_or_default().try_into().map_err(|_| "two numbers with a comma between, like 0.05,0.4".to_owned())
}
