//! The shop: hidden machines that `feedwright learn` has not seen, and how often it finds what is wrong with them.
//!
//! `cargo bench --bench shop -- [--seeds dev|judged] [--only CAUSE] [--n 3] [--noise 3] [--binary PATH] [--keep DIR] [--keep-all DIR]`
//!
//! It shares nothing with the crate: engagement by pixels, forces tooth by tooth, its own machine, meter and programs
//! (`engagement.rs`, `physics.rs`, `machine.rs`, `programs.rs`, `shop_floor.rs`), causes in forms of their own (`causes.rs`).
//! For each cause and seed it writes program, setup and log to a folder, runs the binary on them, and judges the report
//! (`judge.rs`). Nothing here may be fitted to what the binary answers.
//!
//! Strength: a cause is made so strong that the best plain model is left with twice to three times the noise (`VISIBLE`),
//! no stronger: less could not be asked for, more would be easy (`least_strength` keeps what would be no event at all from
//! being called one). Where that takes more than five times what is usual the
//! log is left out and counted as `unseen`.
//!
//! Seeds: `dev` (1000 and up) are for whoever works on `learn`; `judged` (500,000 and up) are run once, when a claim is
//! made, and their logs are not looked at.
//!
//! Columns: logs judged; right (every hidden effect named or voiced as a rival of a named one, for a plain log no name,
//! for a cause without a name its covariate and no false name); silent (nothing named); false (a name for which nothing
//! was hidden); covariate (the carrying covariate said); medians of the held-out error before and after over the noise, by
//! the binary's own claim; the share of the error above the noise that is gone, by that claim; and where the binary has
//! `evaluate`, the same after on a second program of the same machine, whose truth is known here.

#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::format_collect)]

mod causes;
mod dice;
mod engagement;
mod judge;
mod machine;
mod physics;
mod programs;
mod shop_floor;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use causes::{Cause, Hidden, Scene, Truth, hide, least_strength};
use dice::Dice;
use judge::{Answer, Verdict, judge};
use programs::{Job, everyday};
use shop_floor::{Machine, Run, log, mean_cutting_w, misfit_w, setup, simulate, truth};

/// Error of the best plain model over the noise, least and most.
const VISIBLE: [f64; 2] = [2.0, 3.2];
/// Longest time an answer may take, s.
const PATIENCE_S: u64 = 120;

/// What was asked for on the command line.
struct Options {
    base: u64,
    only: Option<String>,
    n: u64,
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
        only: value("--only"),
        n: value("--n").map_or(3, |n| n.parse().expect("--n takes a number")),
        noise: value("--noise").map_or(3.0, |n| n.parse().expect("--noise takes a number, %")) / 100.0,
        binary: value("--binary").map_or_else(|| PathBuf::from("target/release/feedwright"), PathBuf::from),
        keep: value("--keep").or_else(|| value("--keep-all")).map(PathBuf::from),
        keep_all: value("--keep-all").is_some(),
    }
}

/// A log with its truth.
struct Case {
    job: Job,
    machine: Machine,
    hidden: Hidden,
    noise_w: f64,
    /// Error of the best plain model over the noise.
    seen: f64,
    strengths: Vec<f64>,
    run: Run,
}

/// Builds a case: each part as strong as can just be asked for.
fn case(cause: &Cause, seed: u64, noise: f64) -> Case {
    let job = everyday(seed, cause.needs, false);
    let mut machine = Machine::new(seed);
    machine.positions &= !cause.only_without_positions;
    let plain = simulate(&job, &machine, &Hidden::default());
    let noise_w = noise * mean_cutting_w(&plain, &machine);
    let scene = Scene::new(&job, &plain, &machine);
    let over_noise = |hidden: &Hidden| {
        let run = simulate(&job, &machine, hidden);
        let misfit = misfit_w(&run, &plain, &machine);
        (run, misfit.hypot(noise_w) / noise_w)
    };
    let mut hidden = Hidden::default();
    let mut strengths = Vec::new();
    for part in cause.parts {
        let mut strength: f64 = 1.0;
        for _ in 0..7 {
            let mut alone = Hidden::default();
            hide(part, strength, &scene, &mut Dice::new(seed, part), &mut alone);
            let seen = over_noise(&alone).1;
            if (VISIBLE[0]..=VISIBLE[1]).contains(&seen) {
                break;
            }
            let wanted: f64 = 0.5 * (VISIBLE[0] + VISIBLE[1]);
            let step = ((wanted * wanted - 1.0) / (seen * seen - 1.0).max(1e-3)).sqrt().clamp(0.4, 2.5);
            strength = (strength * step).clamp(least_strength(part), 5.0);
        }
        hide(part, strength, &scene, &mut Dice::new(seed, part), &mut hidden);
        strengths.push(strength);
    }
    let (run, seen) = over_noise(&hidden);
    Case { job, machine, hidden, noise_w, seen, strengths, run }
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

/// Sums of one row of the table.
#[derive(Default)]
struct Row {
    logs: usize,
    unseen: usize,
    right: usize,
    silent: usize,
    wrong: usize,
    covariate: usize,
    failed: usize,
    before: Vec<f64>,
    after: Vec<f64>,
    second: Vec<f64>,
    gone: Vec<f64>,
    seconds: Vec<f64>,
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    if sorted.is_empty() { f64::NAN } else { sorted[sorted.len() / 2] }
}

impl Row {
    fn add(&mut self, verdict: &Verdict, answer: &Answer, noise_w: f64, second: Option<f64>, seconds: f64) {
        self.logs += 1;
        self.right += usize::from(verdict.right);
        self.silent += usize::from(verdict.silent);
        self.wrong += usize::from(!verdict.false_names.is_empty());
        self.covariate += usize::from(verdict.covariate_right);
        self.failed += usize::from(answer.failure.is_some());
        self.seconds.push(seconds);
        if let (Some(before), Some(after)) = (answer.before, answer.after) {
            self.before.push(before / noise_w);
            self.after.push(after / noise_w);
            if before > noise_w {
                self.gone.push(((before - after) / (before - noise_w)).min(1.0));
            }
        }
        self.second.extend(second.map(|watts| watts / noise_w));
    }

    fn print(&self, name: &str) {
        println!(
            "{name:<18} {:>4} {:>5} {:>6} {:>5} {:>9} {:>6} {:>6} {:>8.2} {:>6.2} {:>6.2} {:>5.0}% {:>5.1}",
            self.logs,
            self.right,
            self.silent,
            self.wrong,
            self.covariate,
            self.failed,
            self.unseen,
            median(&self.before),
            median(&self.after),
            median(&self.second),
            100.0 * median(&self.gone),
            median(&self.seconds)
        );
    }

    fn take_in(&mut self, other: &Self) {
        self.logs += other.logs;
        self.unseen += other.unseen;
        self.right += other.right;
        self.silent += other.silent;
        self.wrong += other.wrong;
        self.covariate += other.covariate;
        self.failed += other.failed;
        self.before.extend(&other.before);
        self.after.extend(&other.after);
        self.second.extend(&other.second);
        self.gone.extend(&other.gone);
        self.seconds.extend(&other.seconds);
    }
}

/// One log: made, asked, judged.
fn one(options: &Options, cause: &Cause, seed: u64, folder: &Path, row: &mut Row) {
    let case = case(cause, seed, options.noise);
    if !cause.parts.is_empty() && case.seen < 0.95 * VISIBLE[0] {
        println!("    {} {seed}: unseen, {:.2} of the noise at strength {:?}", cause.name, case.seen, case.strengths);
        row.unseen += 1;
        return;
    }
    write(folder, &case, &case.run, seed);
    let args = ["learn", "part.nc", "--setup", "part.setup.toml", "--log", "log.csv", "-o", "model.toml"];
    let begin = Instant::now();
    let answer = match ask(options, folder, &args, "report.json") {
        Ok(report) => Answer::read(&report),
        Err(failure) => Answer { failure: Some(failure), ..Answer::default() },
    };
    let seconds = begin.elapsed().as_secs_f64();
    let verdict = judge(cause, &answer);
    let second = on_second_program(options, cause, &case, seed, folder);
    row.add(&verdict, &answer, case.noise_w, second, seconds);
    let failed = !verdict.right || !verdict.false_names.is_empty();
    if failed {
        println!(
            "    {} {seed} ({}, {:.0} s, {:.1} of the noise, strength {:.2?}): named {:?}, confounded {:?}, carried by {:?} {}",
            cause.name,
            if case.machine.positions { "positions" } else { "time" },
            case.run.duration_s,
            case.seen,
            case.strengths,
            answer.names,
            answer.confounded,
            answer.covariates,
            answer.failure.as_deref().unwrap_or("")
        );
    }
    if let Some(keep) = options.keep.as_ref().filter(|_| failed || options.keep_all) {
        let truth = format!(
            "{:?}\nstrength {:.3?}, {:.2} of the noise of {:.2} W\n{:?}\n{:?}\n",
            cause.truth, case.strengths, case.seen, case.noise_w, case.job.truth, case.machine
        );
        keep_case(folder, &keep.join(format!("{}-{seed}", cause.name)), &truth);
    }
}

/// Copies the files of a case, with its truth.
fn keep_case(folder: &Path, to: &Path, truth: &str) {
    fs::create_dir_all(to).unwrap();
    for file in ["part.nc", "part.setup.toml", "log.csv", "truth.csv", "report.json", "stderr.txt"] {
        let _ = fs::copy(folder.join(file), to.join(file));
    }
    fs::write(to.join("truth.txt"), truth).unwrap();
}

fn main() {
    let options = options();
    let folder = tempfile::tempdir().unwrap();
    println!(
        "{:<18} {:>4} {:>5} {:>6} {:>5} {:>9} {:>6} {:>6} {:>8} {:>6} {:>6} {:>6} {:>5}",
        "cause",
        "logs",
        "right",
        "silent",
        "false",
        "covariate",
        "failed",
        "unseen",
        "before",
        "after",
        "second",
        "gone",
        "s"
    );
    let mut totals: [Row; 4] = Default::default();
    for (index, cause) in causes::all().iter().enumerate() {
        if options.only.as_ref().is_some_and(|only| *only != cause.name) {
            continue;
        }
        let mut row = Row::default();
        for n in 0..options.n {
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
    println!();
    for (name, total) in ["plain", "one listed", "two listed", "no name"].iter().zip(&totals) {
        total.print(name);
    }
    let share = |part: usize, of: usize| 100.0 * part as f64 / of.max(1) as f64;
    let logs: usize = totals.iter().map(|row| row.logs).sum();
    let wrong: usize = totals.iter().map(|row| row.wrong).sum();
    println!("\nlisted effect right  {:5.1} %  goal 95", share(totals[1].right, totals[1].logs));
    println!("pairs right          {:5.1} %  goal 90", share(totals[2].right, totals[2].logs));
    println!("false names          {:5.1} %  goal at most 2", share(wrong, logs));
    println!("covariate right      {:5.1} %  goal 80", share(totals[3].covariate, totals[3].logs));
    println!(
        "error above the noise that is gone, median over causes without a name {:3.0} %  goal 70",
        100.0 * median(&totals[3].gone)
    );
}
