//! `verify`. In: original and rewritten program. Out: the proof that only feeds differ, or the differences; exit code 0 or 1.

use clap::Args;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::allowed;
use super::error::CliError;
use super::input::{self, Source};
use super::options::{Common, Global, SETUP_OF_MOTIONS};
use super::output::{Kind, Outputs};
use super::screen::Screen;
use super::work;
use crate::ids::BlockId;
use crate::machine::Job;
use crate::nc::{self, Environment, Program};
use crate::report::{Outcome, short};
use crate::rewrite::{self, Proof, verify::Rise};
use crate::units::{MM_PER_INCH, mm_min_from_mm_s};

/// `verify`.
#[derive(Debug, Args)]
#[command(mut_arg("setup", |arg| arg.help(SETUP_OF_MOTIONS)))]
pub struct Verify {
    /// The program as it was.
    pub original: PathBuf,
    /// The program with its feeds rewritten.
    pub rewritten: PathBuf,
    /// Setup and report.
    #[command(flatten)]
    pub common: Common,
    /// A feed that is raised by more than this ratio is a fault, like 1.3.
    #[arg(long, value_name = "R", value_parser = ratio)]
    pub max_rise: Option<f64>,
}

/// Differences that are listed; the rest is counted.
const LISTED: usize = 36;
/// Relative rounding of a ratio of feeds.
const ROUNDED: f64 = 1e-9;

#[derive(Serialize)]
struct Report<'a> {
    written_by: &'static str,
    original: &'a str,
    rewritten: &'a str,
    identical: bool,
    motions: usize,
    feeds_changed: usize,
    blocks_added: usize,
    blocks_split: usize,
    /// Lines of the original that move the tool, that are executed otherwise, and that are compared as text alone.
    lines_moving: usize,
    lines_executed: usize,
    lines_not_reached: usize,
    unrolled: bool,
    differences: Vec<DifferencePart<'a>>,
    /// Differences that are not listed.
    more_differences: usize,
    largest_rise: Option<RisePart>,
    max_rise: Option<f64>,
    /// Lines of the rewritten program with a feed raised by more than `max_rise`.
    lines_beyond_max_rise: usize,
    /// The first motion that runs faster than the setup of `--setup` allows, whatever the loads.
    beyond_setup: Option<RisePart>,
}

#[derive(Serialize)]
struct DifferencePart<'a> {
    /// The subprogram that the lines belong to.
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<&'a str>,
    original_line: Option<u32>,
    rewritten_line: Option<u32>,
    text: &'a str,
    original_text: Option<&'a str>,
    rewritten_text: Option<&'a str>,
}

/// The largest rise; feeds in mm/min.
#[derive(Clone, Serialize)]
struct RisePart {
    ratio: f64,
    feed_before: f64,
    feed_after: f64,
    original_line: u32,
    rewritten_line: u32,
    /// The subprogram that the lines belong to.
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
}

/// What is said of two programs.
struct Finding<'a> {
    proof: &'a Proof,
    largest: Option<RisePart>,
    max_rise: Option<f64>,
    /// Lines raised by more than that.
    beyond: usize,
    /// A motion beyond what the setup allows, with the bound in mm/min.
    beyond_setup: Option<(RisePart, f64)>,
}

impl<'a> Finding<'a> {
    fn new(proof: &'a Proof, [before, after]: [&Program; 2], max_rise: Option<f64>, job: Option<&Job>) -> Self {
        let most = max_rise.map_or(f64::INFINITY, |ratio| ratio * (1.0 + ROUNDED));
        let mut lines: Vec<u32> =
            proof.rises.iter().filter(|rise| rise.ratio > most).map(|rise| rise.lines[1]).collect();
        lines.sort_unstable();
        lines.dedup();
        let largest = proof.largest_rise().map(|rise| placed(rise, proof.unrolled, before, after));
        let beyond_setup = job.and_then(|job| allowed::beyond(job, &proof.rises)).map(|(place, most_mm_s)| {
            (placed(&proof.rises[place], proof.unrolled, before, after), mm_min_from_mm_s(most_mm_s))
        });
        Self { proof, largest, max_rise, beyond: lines.len(), beyond_setup }
    }

    fn outcome(&self) -> Outcome {
        let within = self.beyond == 0 && self.beyond_setup.is_none();
        if self.proof.holds() && within && !self.is_empty() { Outcome::Done } else { Outcome::Unmet }
    }

    /// No motion was compared: nothing is proven of programs that could not be read.
    fn is_empty(&self) -> bool {
        self.proof.motions == 0
    }
}

/// A rise with lines of the file they stand in. An unrolled original is one plain text.
fn placed(rise: &Rise, unrolled: bool, before: &Program, after: &Program) -> RisePart {
    let in_file = |program: &Program, line: u32| {
        let (own, file) = program.place(BlockId(line - 1));
        (own, file.map(str::to_owned))
    };
    let original_line = if unrolled { rise.lines[0] } else { in_file(before, rise.lines[0]).0 };
    let (rewritten_line, file) = in_file(after, rise.lines[1]);
    let [feed_before, feed_after] = rise.feeds_mm_s.map(mm_min_from_mm_s);
    RisePart { ratio: rise.ratio, feed_before, feed_after, original_line, rewritten_line, file }
}

/// Compares two programs.
pub fn verify(command: &Verify, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let original = input::program(&command.original)?;
    let rewritten = input::program(&command.rewritten)?;
    let setup = input::setup_if_any(command.common.setup(), &original, global)?;
    let paths = [&original, &rewritten].map(|source| source.path.clone());
    let mut outputs = Outputs::new(paths.into_iter().flatten().chain(command.common.setup.clone()), global.force);
    let json = command.common.json().map(|path| outputs.open(path, Kind::Json)).transpose()?;
    let job = setup.as_ref().map(|setup| &setup.job);
    let ([before, after], proof) = compared([&original, &rewritten], global, job)?;
    let finding =
        Finding::new(&proof, [&before, &after], command.max_rise, job.filter(|_| command.common.setup.is_some()));
    let text = words(&finding);
    if let Some(output) = json {
        let to_stdout = output.is_stdout();
        let report = report(&finding, &original.name, &rewritten.name);
        output.write((serde_json::to_string_pretty(&report).expect("plain data") + "\n").as_bytes())?;
        outputs.commit()?;
        if to_stdout {
            screen.say(&text);
            return Ok(finding.outcome());
        }
    }
    screen.show(&text)?;
    Ok(finding.outcome())
}

/// The programs with the files that they call, and the proof that only feeds differ.
pub fn compared(
    [original, rewritten]: [&Source; 2],
    global: &Global,
    job: Option<&Job>,
) -> Result<([Program; 2], Proof), CliError> {
    let before = input::parse(original, global, job)?;
    let after = nc::parse(rewritten.bytes.clone(), Some(before.dialect()));
    let folder = |source: Option<&Path>| source.and_then(Path::parent).map(Path::to_owned);
    let [own, other] = [original.path.as_deref(), rewritten.path.as_deref()].map(folder);
    let load = |name: &str| work::subprogram(own.as_deref(), name);
    // A file that is not beside the rewritten program is the original's for the control too.
    let load_other = |name: &str| work::subprogram(other.as_deref(), name).or_else(|| load(name));
    let environment = Environment { load: &load, ..job.map(Environment::from_job).unwrap_or_default() };
    let environment = nc::unit::with_its_unit(&before, environment, job);
    let (before, _) = nc::linked(&before, &environment);
    let (after, _) = nc::linked(&after, &Environment { load: &load_other, ..environment.clone() });
    let proof = rewrite::verify(&before, &after, &environment);
    Ok(([before, after], proof))
}

fn words(finding: &Finding) -> String {
    let proof = finding.proof;
    if !proof.holds() {
        return differences(proof);
    }
    if finding.is_empty() {
        return "nothing is proven: no motion could be read from these programs\n".to_owned();
    }
    let unrolled = if proof.unrolled { "unrolled, motions the same; " } else { "" };
    let mut text = format!(
        "{unrolled}only feeds differ: {} motions compared, {} run at another feed, {} blocks split, {} lines added\n",
        proof.motions, proof.feeds_changed, proof.blocks_split, proof.blocks_added
    );
    let [moving, executed, unreached] = proof.lines;
    text += &format!(
        "of {} lines {moving} move the tool, {executed} are executed otherwise, {unreached} are not reached and compared as text\n",
        moving + executed + unreached
    );
    if let Some(rise) = &finding.largest {
        text += &largest(rise, proof.inch);
    }
    if let Some((rise, most_mm_min)) = &finding.beyond_setup {
        text = format!(
            "line {} runs at F{} where the setup allows F{} at most ([limits] feed_change, feed, air_feed; axes)\n{text}",
            rise.rewritten_line,
            in_unit(rise.feed_after, proof.inch),
            in_unit(*most_mm_min, proof.inch)
        );
    }
    if let (Some(most), 1..) = (finding.max_rise, finding.beyond) {
        let s = if finding.beyond == 1 { "" } else { "s" };
        text = format!("feeds rise by more than --max-rise {most} allows, on {} line{s}\n{text}", finding.beyond);
    }
    text
}

/// A feed in the unit of the program.
fn in_unit(mm_min: f64, inch: bool) -> String {
    short(if inch { mm_min / MM_PER_INCH } else { mm_min })
}

fn largest(rise: &RisePart, inch: bool) -> String {
    let feed = |mm_min: f64| in_unit(mm_min, inch);
    format!(
        "largest rise of a feed: {:.3} times, line {}{} → line {}: F{} → F{} {}\n",
        rise.ratio,
        rise.original_line,
        rise.file.as_ref().map_or_else(String::new, |file| format!(" of {file}")),
        rise.rewritten_line,
        feed(rise.feed_before),
        feed(rise.feed_after),
        if inch { "in/min" } else { "mm/min" }
    )
}

/// What differs beside feeds, for the screen.
pub fn differences(proof: &Proof) -> String {
    let mut text = String::from("more than feeds differ:\n");
    for difference in proof.differences.iter().take(LISTED) {
        let line = |line: Option<u32>| line.map_or_else(|| "-".to_owned(), |line| line.to_string());
        let (original, rewritten) = (line(difference.original_line), line(difference.rewritten_line));
        let file = difference.file.as_ref().map_or_else(String::new, |file| format!("{file}, "));
        text += &format!("  {file}line {original} → line {rewritten}: {}\n", difference.text);
        text += &match &difference.texts {
            [Some(own), Some(other)] => format!("    {own}  →  {other}\n"),
            [Some(only), None] | [None, Some(only)] => format!("    {only}\n"),
            [None, None] => String::new(),
        };
    }
    let more = unlisted(proof);
    if more > 0 { text + &format!("  … and {more} more\n") } else { text }
}

/// Differences beyond those listed.
fn unlisted(proof: &Proof) -> usize {
    proof.more + proof.differences.len().saturating_sub(LISTED)
}

fn report<'a>(finding: &'a Finding, original: &'a str, rewritten: &'a str) -> Report<'a> {
    let proof = finding.proof;
    let part = |difference: &'a rewrite::Difference| DifferencePart {
        file: difference.file.as_deref(),
        original_line: difference.original_line,
        rewritten_line: difference.rewritten_line,
        text: &difference.text,
        original_text: difference.texts[0].as_deref(),
        rewritten_text: difference.texts[1].as_deref(),
    };
    Report {
        written_by: crate::report::WRITTEN_BY,
        original,
        rewritten,
        identical: proof.holds(),
        motions: proof.motions,
        feeds_changed: proof.feeds_changed,
        blocks_added: proof.blocks_added,
        blocks_split: proof.blocks_split,
        lines_moving: proof.lines[0],
        lines_executed: proof.lines[1],
        lines_not_reached: proof.lines[2],
        unrolled: proof.unrolled,
        differences: proof.differences.iter().take(LISTED).map(part).collect(),
        more_differences: unlisted(proof),
        largest_rise: finding.largest.clone(),
        max_rise: finding.max_rise,
        lines_beyond_max_rise: finding.beyond,
        beyond_setup: finding.beyond_setup.as_ref().map(|(rise, _)| rise.clone()),
    }
}

fn ratio(text: &str) -> Result<f64, String> {
    let ratio = text.parse::<f64>().ok().filter(|ratio| *ratio > 0.0 && ratio.is_finite());
    ratio.ok_or_else(|| "it is a ratio of feeds, after over before: 1.3 allows 30 % more".to_owned())
}
