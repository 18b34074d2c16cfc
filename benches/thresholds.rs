//! How the answers of `learn` move when a threshold of its diagnosis is halved or doubled.
//!
//! `cargo bench --bench thresholds -- DIR [--only NAME,NAME]`, with a folder of logs that
//! `cargo bench --bench shop -- --keep-all DIR` has written. Each log is simulated and binned once; then it is diagnosed by the usual
//! criteria, and by those in which one threshold is half or twice what it is.
//!
//! Columns: logs in which names are missing that stood there; in which there are names that did not; in which a curve without a
//! name follows another covariate; held-out error over that by the usual criteria, mean of the logs.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use feedwright::learn::dataset::binning::channels;
use feedwright::learn::dataset::samples::Data;
use feedwright::learn::diagnose::criteria::Criteria;
use feedwright::learn::diagnose::{Options, diagnose};
use feedwright::learn::log::read_any_log;
use feedwright::learn::model::cross_validation::by_blocks;
use feedwright::learn::program::simulated::simulate_for;
use feedwright::learn::session::{aligned, dataset_of};
use feedwright::setup;
use rayon::prelude::*;

/// What is compared of an answer.
struct Answer {
    names: BTreeSet<String>,
    curves: BTreeSet<String>,
    error: f64,
}

/// The data of a log, with its program and setup in the same folder.
fn data(folder: &Path) -> Option<Data> {
    let log = fs::read(folder.join("log.csv")).ok()?;
    let text = fs::read_to_string(folder.join("part.setup.toml")).ok()?;
    let (job, _) = setup::load(&text, folder).ok()?;
    let log = read_any_log(&log, &[]).ok()?;
    let channels = channels(&log);
    let program = fs::read(folder.join("part.nc")).ok()?;
    let prepared = simulate_for(&program, &job, None, None).ok()?;
    let aligned = aligned(&prepared, &job, &log, &channels).ok()?;
    Some(dataset_of(&prepared, &job, &log, &channels, aligned).0)
}

fn answer(data: &Data, criteria: Criteria) -> Option<Answer> {
    let options = Options { criteria, ..Options::default() };
    let report = diagnose(data, &by_blocks(data, "stretch of time"), &options)?;
    Some(Answer {
        names: report.names().into_iter().map(str::to_owned).collect(),
        curves: report.nameless().map(|curve| curve.covariate.clone()).collect(),
        error: report.final_test.rmse,
    })
}

/// One cell of the table: names lost, names added, other curves, error over the usual one.
fn moved(logs: &[(Data, Answer)], criteria: Criteria) -> String {
    let answers: Vec<Option<Answer>> = logs.par_iter().map(|(data, _)| answer(data, criteria)).collect();
    let pairs: Vec<(&Answer, &Answer)> =
        logs.iter().zip(&answers).filter_map(|((_, usual), other)| Some((usual, other.as_ref()?))).collect();
    let count = |is: &dyn Fn(&Answer, &Answer) -> bool| pairs.iter().filter(|(usual, other)| is(usual, other)).count();
    let lost = count(&|usual, other| !usual.names.is_subset(&other.names));
    let added = count(&|usual, other| !other.names.is_subset(&usual.names));
    let curves = count(&|usual, other| usual.curves != other.curves);
    let ratio = pairs.iter().map(|(usual, other)| other.error / usual.error).sum::<f64>() / pairs.len().max(1) as f64;
    format!("{lost:>5} {added:>5} {curves:>6} {ratio:>7.3}")
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|arg| arg != "--bench").collect();
    let only = args.iter().position(|arg| arg == "--only").and_then(|k| args.get(k + 1));
    let Some(folder) = args.first().filter(|arg| !arg.starts_with("--")).map(PathBuf::from) else {
        println!("thresholds: give a folder that `cargo bench --bench shop -- --keep-all DIR` has written");
        return;
    };
    let mut cases: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    cases.sort();
    let read = |case: &PathBuf| {
        let data = data(case)?;
        let usual = answer(&data, Criteria::default())?;
        Some((data, usual))
    };
    let logs: Vec<(Data, Answer)> = cases.iter().filter_map(read).collect();
    println!("{} logs\n{:<22} {:>29}   {:>29}", logs.len(), "", "halved", "doubled");
    let head = format!("{:>5} {:>5} {:>6} {:>7}", "lost", "added", "curves", "error");
    println!("{:<22} {head}   {head}", "threshold");
    for name in Criteria::NAMES.iter().filter(|name| only.is_none_or(|only| only.split(',').any(|o| o == **name))) {
        let [halved, doubled] = [0.5, 2.0].map(|factor| moved(&logs, Criteria::default().times(name, factor)));
        println!("{name:<22} {halved}   {doubled}");
    }
}
