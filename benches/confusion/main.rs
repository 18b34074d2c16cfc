//! The confusion matrix of the diagnosis: logs with effects that no setup declares, what `learn` answers, and the rates
//! against the targets, into `matrix.md` beside this file.
//!
//! `cargo bench --bench confusion -- [--seeds A..B] [--noise PERCENT] [--only ROW] [--write DIR] [--margins]
//! [--page FILE]`. The run without options (seeds 0..20, all rows, all three noises) writes the page into `matrix.md`; the
//! others print it, or write it where `--page` says. Outcomes are kept while the run goes on: stopped and begun again, the
//! same build goes on where it was. `--write` writes the cases into folders instead, `--margins` prints how far each truth
//! is ahead of its best rival.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

mod cases;
mod cut;
mod hidden;
mod kept;
mod margin;
mod motion;
mod physics;
mod programs;
mod rng;
mod score;
mod writer;

use cases::{Case, is_twin, rows};
use feedwright::learn::dataset::binning::channels;
use feedwright::learn::log::read_log;
use feedwright::learn::program::simulated::SimulatedProgram;
use feedwright::learn::program::simulated::simulate;
use feedwright::learn::report::LearnReport;
use feedwright::learn::session::{LogOptions, learn};
use kept::Kept;
use rayon::prelude::*;
use score::{Outcome, page};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Instant;

/// What was asked for on the command line.
struct Asked {
    seeds: std::ops::Range<u64>,
    noise: Vec<f64>,
    only: Option<String>,
    write: Option<PathBuf>,
    margins: bool,
    page: Option<PathBuf>,
}

fn main() {
    let asked = asked(std::env::args().skip(1));
    match &asked.write {
        Some(dir) => write(&asked, dir),
        None if asked.margins => print_margins(&asked),
        None => judge(&asked),
    }
}

/// What is simulated once for all logs of a part: by seed, whether forces are measured, and whether it is a lean part.
type Shared = BTreeMap<(u64, bool, bool), OnceLock<SimulatedProgram>>;

fn shared_key(row: &str, seed: u64) -> (u64, bool, bool) {
    (seed, Case::has_forces(row, seed), is_twin(row))
}

/// Diagnoses every case and prints or writes the page.
fn judge(asked: &Asked) {
    let cases = asked_cases(asked);
    let kept = Kept::open();
    let shared: Shared = cases.iter().map(|(row, seed, _)| (shared_key(row, *seed), OnceLock::new())).collect();
    let outcome = |(row, seed, noise): &(&'static str, u64, f64)| {
        kept.known(row, *seed, *noise).unwrap_or_else(|| {
            let outcome = diagnosed(row, *noise, *seed, &shared);
            kept.keep(&outcome);
            println!("{}", outcome.line());
            outcome
        })
    };
    let outcomes: Vec<Outcome> = cases.par_iter().map(outcome).collect();
    let page = page(&outcomes);
    println!("{page}");
    if let Some(file) = &asked.page {
        std::fs::write(file, page).expect("the page is written");
    }
}

fn simulated(case: &Case, forces: bool) -> SimulatedProgram {
    let (job, _) = feedwright::setup::load(&case.part.setup, Path::new(".")).expect("a generated setup loads");
    simulate(case.part.program.as_bytes(), &job, forces).expect("a generated part is simulated")
}

fn diagnosed(row: &'static str, noise: f64, seed: u64, shared: &Shared) -> Outcome {
    let case = Case::new(row, seed);
    let (log, deviation) = case.log(noise / 100.0);
    let begun = Instant::now();
    let prepared = shared[&shared_key(row, seed)].get_or_init(|| simulated(&case, Case::has_forces(row, seed)));
    let report = answer(&case, &log, prepared);
    let mut outcome = Outcome::new(&case, row, noise, deviation, report);
    outcome.seconds = begun.elapsed().as_secs_f64();
    outcome
}

fn answer(case: &Case, log: &str, prepared: &SimulatedProgram) -> Result<LearnReport, String> {
    let (job, _) = feedwright::setup::load(&case.part.setup, Path::new(".")).map_err(|e| e.to_string())?;
    let log = read_log(log.as_bytes(), &[]).map_err(|e| e.to_string())?;
    let channels = channels(&log);
    learn(prepared, &job, &log, &channels, &LogOptions::default()).map_err(|e| e.to_string())
}

fn asked(arguments: impl Iterator<Item = String>) -> Asked {
    let mut asked =
        Asked { seeds: 0..20, noise: vec![3.0, 1.0, 6.0], only: None, write: None, margins: false, page: None };
    let mut untouched = true;
    let mut arguments = arguments.filter(|a| a != "--bench");
    while let Some(option) = arguments.next() {
        untouched = false;
        if option == "--margins" {
            asked.margins = true;
            continue;
        }
        let value = arguments.next().unwrap_or_else(|| panic!("{option} needs a value"));
        match option.as_str() {
            "--seeds" => {
                let (from, to) = value.split_once("..").expect("--seeds A..B");
                asked.seeds = from.parse().expect("a seed")..to.parse().expect("a seed");
            }
            "--noise" => asked.noise = vec![value.parse().expect("a noise in percent")],
            "--only" => asked.only = Some(value),
            "--page" => asked.page = Some(value.into()),
            "--write" => asked.write = Some(value.into()),
            _ => panic!("unknown option {option}"),
        }
    }
    if untouched {
        asked.page = Some(concat!(env!("CARGO_MANIFEST_DIR"), "/benches/confusion/matrix.md").into());
    }
    asked
}

/// Cases that were asked for, noise by noise.
fn asked_cases(asked: &Asked) -> Vec<(&'static str, u64, f64)> {
    let mut all = Vec::new();
    for noise in &asked.noise {
        for row in rows() {
            if asked.only.as_deref().is_none_or(|only| only == row) {
                all.extend(asked.seeds.clone().map(|seed| (row, seed, *noise)));
            }
        }
    }
    all
}

/// Writes program, setup, log and truth of every case into a folder of its own.
fn write(asked: &Asked, dir: &Path) {
    asked_cases(asked).into_par_iter().for_each(|(row, seed, noise)| {
        let case = Case::new(row, seed);
        let (log, deviation) = case.log(noise / 100.0);
        let folder = dir.join(format!("{row}-{seed}-noise{noise}"));
        let truth = format!(
            "{:?}\nnames {:?}\n{:?}\nnoise {deviation:?}\n{:?}\n",
            case.hidden, case.names, case.truth, case.form
        );
        let files = [
            ("part.nc", &case.part.program),
            ("part.setup.toml", &case.part.setup),
            ("log.csv", &log),
            ("truth.txt", &truth),
        ];
        std::fs::create_dir_all(&folder).expect("a folder for the case");
        for (name, text) in files {
            std::fs::write(folder.join(name), text).expect("a file of the case");
        }
    });
}

/// How far the truth of every case is ahead of its best rival.
fn print_margins(asked: &Asked) {
    let listed =
        |(row, ..): &(&'static str, u64, f64)| *row != "none" && !is_twin(row) && !hidden::UNLISTED.contains(row);
    let cases: Vec<_> = asked_cases(asked).into_iter().filter(listed).collect();
    let margins: Vec<_> =
        cases.par_iter().map(|(row, seed, noise)| margin::margin(&Case::new(row, *seed), noise / 100.0)).collect();
    for ((row, seed, noise), margin) in cases.iter().zip(margins) {
        let below = if margin.nats < margin::THRESHOLD_NATS { " below the threshold" } else { "" };
        println!(
            "{row} seed {seed} noise {noise} %: {:.0} nats over {} ({:.0} over none){below}",
            margin.nats, margin.rival, margin.over_none_nats
        );
    }
}
