//! The shop: hidden machines that `feedwright learn` has not seen, and how often it finds what is wrong with them.
//!
//! `cargo bench --bench shop -- [--seeds dev|judged] [--only CAUSE,CAUSE] [--n 3] [--first 0] [--noise 3] [--binary PATH] [--keep DIR] [--keep-all DIR]`
//!
//! It shares nothing with the crate: engagement by pixels, forces tooth by tooth, its own machine, meter and programs
//! (`engagement.rs`, `physics.rs`, `machine.rs`, `programs.rs`, `shop_floor.rs`), causes in forms of their own (`causes.rs`).
//! For each cause and seed it writes program, setup and log to a folder, runs the binary on them, and judges the report
//! (`judge.rs`, `board.rs`). Causes named `table:…` are tables of steady cuts (`tables.rs`) for `learn-table`. Nothing here may be fitted to what the binary answers.
//!
//! Strength: a cause is made so strong that the best plain model is left with twice to three times the noise (`VISIBLE`),
//! no stronger: less could not be asked for, more would be easy (`least_strength` keeps what would be no event at all from
//! being called one). Where that takes more than five times what is usual the
//! log is left out and counted as `unseen`.
//!
//! Seeds: `dev` (1000 and up) are for whoever works on `learn`; `judged` (500,000 and up) are run once, when a claim is
//! made, and their logs are not looked at.
//!
//! Columns: logs judged; right (every hidden effect named alone, for a plain log no name, for a cause without a name its
//! covariate and no false name); silent (nothing named); false (a name asserted alone for which nothing was hidden); one of
//! (several names that it cannot part), and in it (what was hidden is among them or named beside them); covariate (the carrying covariate said first; below the table also how often it is that or one of its
//! `rivals`); medians of the held-out error before and after over the noise, by
//! the binary's own claim; the share of the error above the noise that is gone, by that claim; and where the binary has
//! `evaluate`, the same after on a second program of the same machine, whose truth is known here.

#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::format_collect)]

mod board;
mod case;
mod causes;
mod dice;
mod engagement;
mod judge;
mod machine;
mod physics;
mod programs;
mod shop_floor;
mod tables;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use board::{Row, print_goals, print_heads};
use case::{Case, VISIBLE, case, strong_enough};
use causes::{Cause, Truth};
use judge::{Answer, judge};
use programs::everyday;
use shop_floor::{Run, log, setup, simulate, truth};

/// Longest time an answer may take, s.
const PATIENCE_S: u64 = 120;

/// What was asked for on the command line.
struct Options {
    base: u64,
    /// Causes to run; all when empty.
    only: Vec<String>,
    /// Seeds of each cause, and the first of them: even ones log positions, odd ones time and power alone.
    n: u64,
    first: u64,
    noise: f64,
    binary: PathBuf,
    /// Where failing cases are kept, and whether the others are too.
    keep: Option<PathBuf>,
    keep_all: bool,
}

fn options() -> Options {
    let args: Vec<String> = std::env::args().collect();
    let value = |name: &str| args.iter().position(|arg| arg == name).and_then(|i| args.get(i + 1)).cloned();
    Options {
        base: if value("--seeds").as_deref() == Some("judged") { 500_000 } else { 1000 },
        only: value("--only").map(|list| list.split(',').map(str::to_owned).collect()).unwrap_or_default(),
        n: value("--n").map_or(3, |n| n.parse().expect("--n takes a number")),
        first: value("--first").map_or(0, |n| n.parse().expect("--first takes a number")),
        noise: value("--noise").map_or(3.0, |n| n.parse().expect("--noise takes a number, %")) / 100.0,
        binary: value("--binary").map_or_else(|| PathBuf::from("target/release/feedwright"), PathBuf::from),
        keep: value("--keep").or_else(|| value("--keep-all")).map(PathBuf::from),
        keep_all: value("--keep-all").is_some(),
    }
}

/// Writes program, setup and log.
fn write(folder: &Path, case: &Case, run: &Run, seed: u64) {
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join("part.nc"), &case.job.text).unwrap();
    fs::write(folder.join("part.setup.toml"), setup(&case.job, &case.machine)).unwrap();
    fs::write(folder.join("log.csv"), log(run, &case.machine, case.noise_w, seed)).unwrap();
    fs::write(folder.join("truth.csv"), truth(run, &case.job, &case.machine, seed)).unwrap();
}

/// Runs the binary with patience; its report, or why there is none.
fn ask(options: &Options, folder: &Path, args: &[&str], report: &str) -> Result<serde_json::Value, String> {
    let _ = fs::remove_file(folder.join(report));
    let mut child = Command::new(fs::canonicalize(&options.binary).unwrap())
        .args(args)
        .args(["--json", report, "--threads", "1", "--quiet", "--force"])
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(fs::File::create(folder.join("stderr.txt")).unwrap())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    loop {
        if child.try_wait().unwrap().is_some() {
            break;
        }
        if begin.elapsed() > Duration::from_secs(PATIENCE_S) {
            let _ = child.kill();
            let _ = child.wait();
            return Err(format!("no answer in {PATIENCE_S} s"));
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    let text = fs::read_to_string(folder.join(report)).map_err(|_| {
        fs::read_to_string(folder.join("stderr.txt")).unwrap_or_default().lines().take(2).collect::<String>()
    })?;
    serde_json::from_str(&text).map_err(|error| error.to_string())
}

/// Held-out error of the model on a second program of the same machine, W; none where the binary cannot say.
fn on_second_program(options: &Options, cause: &Cause, case: &Case, seed: u64, folder: &Path) -> Option<f64> {
    if !cause.carries_over || !folder.join("model.toml").exists() {
        return None;
    }
    let second = folder.join("second");
    let job = everyday(seed, cause.needs, true);
    let run = simulate(&job, &case.machine, &case.hidden);
    fs::create_dir_all(&second).unwrap();
    fs::write(second.join("part.nc"), &job.text).unwrap();
    fs::write(second.join("part.setup.toml"), setup(&job, &case.machine)).unwrap();
    fs::write(second.join("log.csv"), log(&run, &case.machine, case.noise_w, seed + 1)).unwrap();
    let args = ["evaluate", "../model.toml", "part.nc", "--setup", "part.setup.toml", "--log", "log.csv"];
    let report = ask(options, &second, &args, "report.json").ok()?;
    ["rmse", "score", "test"].iter().find_map(|key| report[*key].as_f64().or_else(|| report[*key]["rmse"].as_f64()))
}

/// What there is to ask: how, and what to know about it.
struct Question {
    args: &'static [&'static str],
    noise_w: f64,
    seen: f64,
    /// For a person who looks at it.
    about: String,
    case: Option<Case>,
}

/// A log with its program and setup, written to the folder.
fn log_of(options: &Options, cause: &Cause, seed: u64, folder: &Path) -> Question {
    let case = case(cause, seed, options.noise);
    write(folder, &case, &case.run, seed);
    let about = format!(
        "{}, {:.0} s, strength {:.2?}, {:.1} of the noise of {:.1} W\n{:?}\n{:?}",
        if case.machine.positions { "positions" } else { "time and power" },
        case.run.duration_s,
        case.strengths,
        case.seen,
        case.noise_w,
        case.job.truth,
        case.machine
    );
    Question {
        args: &["learn", "part.nc", "--setup", "part.setup.toml", "--log", "log.csv", "-o", "model.toml"],
        noise_w: case.noise_w,
        seen: case.seen,
        about,
        case: Some(case),
    }
}

/// A table of steady cuts with its setup, written to the folder.
fn table_of(options: &Options, cause: &Cause, seed: u64, folder: &Path) -> Question {
    let part = cause.parts.first().copied().unwrap_or("plain");
    let made = |strength: f64| tables::table(part, strength, seed, options.noise);
    let strength = strong_enough(part, |strength| made(strength).seen);
    let table = made(strength);
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join("table.csv"), &table.text).unwrap();
    fs::write(folder.join("part.setup.toml"), &table.setup).unwrap();
    Question {
        args: &["learn-table", "table.csv", "--setup", "part.setup.toml", "-o", "model.toml"],
        noise_w: table.noise_w,
        seen: table.seen,
        about: format!("table, strength {strength:.2}, {:.1} of the noise of {:.1} W", table.seen, table.noise_w),
        case: None,
    }
}

/// One log or table: made, asked, judged.
fn one(options: &Options, cause: &Cause, seed: u64, folder: &Path, row: &mut Row) {
    let question = if cause.table { table_of } else { log_of }(options, cause, seed, folder);
    let about = question.about.lines().next().unwrap_or_default();
    if !cause.parts.is_empty() && question.seen < 0.95 * VISIBLE[0] {
        println!("    {} {seed}: unseen ({about})", cause.name);
        row.unseen += 1;
        return;
    }
    let begin = Instant::now();
    let answer = match ask(options, folder, question.args, "report.json") {
        Ok(report) => Answer::read(&report),
        Err(failure) => Answer { failure: Some(failure), ..Answer::default() },
    };
    let seconds = begin.elapsed().as_secs_f64();
    let verdict = judge(cause, &answer);
    let second = question.case.as_ref().and_then(|case| on_second_program(options, cause, case, seed, folder));
    row.add(&verdict, &answer, question.noise_w, second, seconds);
    let failed = !verdict.right || !verdict.false_names.is_empty();
    if failed {
        println!(
            "    {} {seed} ({about}): named {:?}, confounded {:?}, carried by {:?} {}",
            cause.name,
            answer.names,
            answer.confounded,
            answer.covariates,
            answer.failure.as_deref().unwrap_or("")
        );
    }
    if let Some(keep) = options.keep.as_ref().filter(|_| failed || options.keep_all) {
        let truth = format!("{:?}\n{}\n", cause.truth, question.about);
        keep_case(folder, &keep.join(format!("{}-{seed}", cause.name)), &truth);
    }
}

/// Copies the files of a case, with its truth.
fn keep_case(folder: &Path, to: &Path, truth: &str) {
    fs::create_dir_all(to).unwrap();
    for file in ["part.nc", "part.setup.toml", "table.csv", "log.csv", "truth.csv", "report.json", "stderr.txt"] {
        let _ = fs::copy(folder.join(file), to.join(file));
    }
    fs::write(to.join("truth.txt"), truth).unwrap();
}

fn main() {
    let options = options();
    let folder = tempfile::tempdir().unwrap();
    print_heads();
    let mut totals: [Row; 4] = Default::default();
    for (index, cause) in causes::all().iter().enumerate() {
        if !options.only.is_empty() && !options.only.iter().any(|only| only == cause.name) {
            continue;
        }
        let mut row = Row::default();
        for n in options.first..options.first + options.n {
            let seed = options.base + 64 * index as u64 + n;
            one(&options, cause, seed, &folder.path().join(format!("{index}-{n}")), &mut row);
        }
        row.print(cause.name);
        let kind = match cause.truth {
            Truth::Plain => 0,
            Truth::Named(names) => names.len().min(2),
            Truth::Unlisted(_) => 3,
        };
        totals[kind].take_in(&row);
    }
    print_goals(&totals);
}
