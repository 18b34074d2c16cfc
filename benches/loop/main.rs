//! The loop closed: from a hidden machine to a model, to feeds, to the same machine under these feeds, and once more.
//!
//! `cargo bench --bench loop -- [--seeds dev|judged] [--n 50] [--first 0] [--only CAUSE,CAUSE] [--noise 3] [--turns 2] [--binary PATH] [--keep DIR] [--reuse]`
//!
//! The machines, physics, programs and causes are those of `benches/shop`, written apart from the crate. Each machine
//! hides another cause of that list (nothing, one effect, a pair, or what no list has). A tool is limited to 70 % of the
//! greatest torque that a sound machine would meet under the programmed feeds; feeds in cuts may change by 0.2 to 2.
//!
//! Columns of a row, each the greatest true torque over its limit and the time on the true machine relative to the programmed one:
//! * `declared`: `optimize` with the coefficients the shop believes (0.85 to 1.2 of the true ones), no log;
//! * `plain`: the log of the programmed feeds → `calibrate --log` → `optimize`: coefficients without effects;
//! * `one`, `two`: the log → `learn` → `optimize --model`, and once more with the log of the new feeds, from the model before;
//! * `sure one`, `sure two`: the same models with `--confidence 0.95`.
//!
//! `--reuse` takes the first logs and models that `--keep DIR` has from a run before, where only what `optimize` does with them changed.
//!
//! Where `learn` writes no model the one before stays, at first the declared one.
//!
//! What is a moment of the first run (an override, a hold, chips under the tool, a coolant line that failed) does not come
//! again. A chipped edge stays in the spindle, chipped from the beginning, unless the report names chipping and no rival:
//! then a sound tool is put in. An edge exchanged in mid-program is not exchanged again.

#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::format_collect, dead_code)]

#[path = "../shop/case.rs"]
mod case;
#[path = "../shop/causes.rs"]
mod causes;
#[path = "../shop/dice.rs"]
mod dice;
#[path = "../shop/engagement.rs"]
mod engagement;
mod loads;
#[path = "../shop/machine.rs"]
mod machine;
#[path = "../shop/physics.rs"]
mod physics;
#[path = "../shop/programs.rs"]
mod programs;
mod read;
#[path = "../shop/shop_floor.rs"]
mod shop_floor;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use case::{Case, case};
use causes::{Cause, Hidden, Scene, hide};
use dice::Dice;
use loads::{CHANGE, COUNTS, Kept, Least, kept, least, limits, oracle_s, with_steps};
use shop_floor::{log, setup, simulate};

/// Machines at work at once.
const AT_ONCE: usize = 2;
/// From machine to machine so far along the list of causes: no divisor of its length, so that any first few are of all kinds.
const STRIDE: usize = 19;
/// Moments of the first run.
const MOMENTS: [&str; 4] = ["override", "feed-hold", "odd-passes", "coolant-off"];
/// Ways of the loop, in the order of the columns.
const WAYS: [&str; 7] = ["programmed", "declared", "plain", "one", "sure one", "two", "sure two"];

struct Options {
    base: u64,
    only: Vec<String>,
    n: usize,
    first: usize,
    noise: f64,
    turns: usize,
    binary: PathBuf,
    keep: Option<PathBuf>,
    /// First logs and models are those that the kept folder has.
    reuse: bool,
}

fn options() -> Options {
    let args: Vec<String> = std::env::args().collect();
    let value = |name: &str| args.iter().position(|arg| arg == name).and_then(|i| args.get(i + 1)).cloned();
    let number = |name: &str, usual: f64| value(name).map_or(usual, |n| n.parse().expect("a number"));
    Options {
        base: if value("--seeds").as_deref() == Some("judged") { 700_000 } else { 30_000 },
        only: value("--only").map(|list| list.split(',').map(str::to_owned).collect()).unwrap_or_default(),
        n: number("--n", 50.0) as usize,
        first: number("--first", 0.0) as usize,
        noise: number("--noise", 3.0) / 100.0,
        turns: number("--turns", 2.0) as usize,
        binary: fs::canonicalize(
            value("--binary").map_or_else(|| PathBuf::from("target/release/feedwright"), PathBuf::from),
        )
        .expect("the binary"),
        keep: value("--keep").map(PathBuf::from),
        reuse: args.iter().any(|arg| arg == "--reuse"),
    }
}

/// What a report names.
#[derive(Default)]
struct Named {
    effects: String,
    rivals: String,
    unnamed: String,
    has_model: bool,
}

impl Named {
    /// Says the report that the edge has chipped, and nothing else that it might be?
    fn tells_chipping(&self) -> bool {
        self.effects.contains("edge-chipping") && !self.rivals.contains("edge-chipping")
    }

    fn said(&self) -> String {
        let Self { effects, rivals, unnamed, .. } = self;
        format!("{effects} / {rivals} / {unnamed}{}", if self.has_model { "" } else { " NO MODEL" })
    }
}

/// What becomes of one machine.
struct Outcome {
    name: String,
    /// By the ways; none where a program was refused.
    kept: [Option<Kept>; WAYS.len()],
    /// Time over that of the programmed feeds.
    oracle: f64,
    /// Names in the first and the second report.
    named: [String; 2],
    /// What went wrong or was refused.
    said: String,
}

/// A machine with its folder, limits and truth.
struct Shop<'a> {
    options: &'a Options,
    folder: &'a Path,
    case: &'a Case,
    limits: Vec<f64>,
    seed: u64,
    said: String,
}

impl Shop<'_> {
    /// Runs the binary in the folder; whether it wrote what it should.
    fn ask(&mut self, args: &[&str], wanted: &str) -> bool {
        let _ = fs::remove_file(self.folder.join(wanted));
        let error = format!("{wanted}.err");
        let out = format!("{wanted}.out");
        let status = Command::new(&self.options.binary)
            .args(args)
            .args(["--threads", "1", "--force"])
            .current_dir(self.folder)
            .stdout(Stdio::from(fs::File::create(self.folder.join(&out)).unwrap()))
            .stderr(Stdio::from(fs::File::create(self.folder.join(&error)).unwrap()))
            .status()
            .unwrap();
        let there = self.folder.join(wanted).exists();
        if !there {
            let text = fs::read_to_string(self.folder.join(&error)).unwrap_or_default();
            let line: String = text.lines().take(2).collect::<Vec<_>>().join(" ").chars().take(160).collect();
            self.said += &format!(" [{wanted}: {} {line}]", status.code().unwrap_or(-1));
        }
        there
    }

    /// Writes new feeds by a model, and runs them on the true machine.
    fn optimised(&mut self, to: &str, model: Option<&str>, sure: bool, hidden: &Hidden, least: &Least) -> Option<Kept> {
        let report = format!("{to}.json");
        let mut args = vec!["optimize", "part.nc", "--setup", "part.setup.toml", "-o", to, "--json", &report];
        if let Some(model) = model {
            args.extend(["--model", model]);
        }
        args.extend(if sure { &["--confidence", "0.95"][..] } else { &[] });
        self.ask(&args, to).then(|| {
            let job = self.job_of(to);
            let kept = kept(&job, &self.case.machine, hidden, &self.limits, least);
            let step = &job.steps[kept.at];
            fs::write(
                self.folder.join(format!("{to}.kept")),
                format!(
                    "{kept:?}\nline {} at {:?} pass {} feed {:.0} mm/min\n",
                    step.line,
                    step.to,
                    step.pass,
                    60.0 * step.speed_mm_s
                ),
            )
            .unwrap();
            kept
        })
    }

    fn job_of(&self, program: &str) -> programs::Job {
        let text = fs::read_to_string(self.folder.join(program)).unwrap();
        let steps = read::steps(&text, &self.case.job.tools, &self.case.job.steps);
        let apart = read::apart_mm(&steps, &self.case.job.steps);
        assert!(apart < 0.05, "{program} of {} leaves the path by {apart:.3} mm", self.seed);
        with_steps(&self.case.job, steps)
    }

    /// Logs a program on the true machine and learns from it; the model that holds then.
    fn learned(&mut self, program: &str, before: Option<&str>, to: &str, hidden: &Hidden) -> (Option<String>, Named) {
        let run = simulate(&self.job_of(program), &self.case.machine, hidden);
        let (csv, report) = (format!("{to}.csv"), format!("{to}.json"));
        let noisy = log(&run, &self.case.machine, self.case.noise_w, self.seed + to.len() as u64);
        fs::write(self.folder.join(&csv), noisy).unwrap();
        let mut args = vec!["learn", program, "--setup", "part.setup.toml", "--log", &csv, "-o", to, "--json", &report];
        if let Some(model) = before {
            args.extend(["--model", model]);
        }
        let is_kept = self.options.reuse && program == "part.nc" && self.folder.join(&report).exists();
        let there = if is_kept { self.folder.join(to).exists() } else { self.ask(&args, to) };
        let text = fs::read_to_string(self.folder.join(&report)).unwrap_or_default();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
        let names = |of: &str, key: &str| -> Vec<String> {
            let list = json[of].as_array().into_iter().flatten();
            list.map(|item| item[key].to_string().replace('"', "")).collect()
        };
        let named = Named {
            effects: names("effects", "name").join(", "),
            rivals: names("confounded", "names").join(", "),
            unnamed: names("unnamed", "covariate").join(", "),
            has_model: there,
        };
        (if there { Some(to.to_owned()) } else { before.map(str::to_owned) }, named)
    }
}

/// What is hidden in later runs: no moment of the first one.
fn later(cause: &Cause, case: &Case, seed: u64, sound: bool) -> Hidden {
    let plain = simulate(&case.job, &case.machine, &Hidden::default());
    let scene = Scene::new(&case.job, &plain, &case.machine);
    let mut hidden = Hidden::default();
    for (part, strength) in cause.parts.iter().zip(&case.strengths) {
        if MOMENTS.contains(part) || (*part == "edge-chipping" && sound) {
            continue;
        }
        let mut alone = Hidden::default();
        let to = if *part == "edge-chipping" { &mut alone } else { &mut hidden };
        hide(part, *strength, &scene, &mut Dice::new(seed, part), to);
        for chipped in alone.stations {
            let always = move |at: &physics::Station| chipped(&physics::Station { time_s: at.time_s + 1e4, ..*at });
            hidden.stations.push(Box::new(always));
        }
    }
    hidden.fresh_edge_at.clear();
    hidden
}

/// The setup with the limits.
fn limited(case: &Case, limits: &[f64]) -> String {
    // Some programs ask for more than the spindle of that setup has.
    let text = setup(&case.job, &case.machine);
    let mut text = text.replace("max_rpm = 18000", "max_rpm = 24000").replace("[18000, 7500]", "[24000, 7500]");
    for (tool, limit) in case.job.tools.iter().zip(limits) {
        let number = format!("[[tool]]\nnumber = {}\n", tool.number);
        text = text.replace(&number, &format!("{number}limits = {{ torque = {limit:.4} }}\n"));
    }
    // Between 0.85 and 1.2 of the true ones: a standard deviation of 10 %.
    let text = text.replace("\n[material]\n", "\n[material]\nuncertainty = 0.1\n");
    text + &format!("\n[limits]\nfeed_change = {{ min = {}, max = {} }}\n", CHANGE[0], CHANGE[1])
}

/// Takes one machine through the loop.
fn one(options: &Options, cause: &Cause, seed: u64, folder: &Path) -> Outcome {
    let case = case(cause, seed, options.noise);
    fs::create_dir_all(folder).unwrap();
    let limits = limits(&case.job, &case.machine);
    fs::write(folder.join("part.nc"), &case.job.text).unwrap();
    fs::write(folder.join("part.setup.toml"), limited(&case, &limits)).unwrap();
    let mut shop = Shop { options, folder, case: &case, limits, seed, said: String::new() };

    // The first log, under the programmed feeds.
    let (first, named) = shop.learned("part.nc", None, "model1.toml", &case.hidden);
    let hidden = later(cause, &case, seed, named.tells_chipping());
    let least = least(&case.job, &case.machine, &hidden);
    let programmed = kept(&case.job, &case.machine, &hidden, &shop.limits, &least);
    let declared = shop.optimised("declared.nc", None, false, &hidden, &least);
    let fit = ["calibrate", "part.nc", "--setup", "part.setup.toml", "--log", "model1.toml.csv", "-o", "plain.toml"];
    let plain = shop
        .ask(&fit, "plain.toml")
        .then(|| shop.optimised("plain.nc", Some("plain.toml"), false, &hidden, &least))
        .flatten();

    let mut named = [named.said(), String::new()];
    let mut turns = [None; 4];
    turns[0] = shop.optimised("turn1.nc", first.as_deref(), false, &hidden, &least);
    turns[1] = shop.optimised("sure1.nc", first.as_deref(), true, &hidden, &least);
    if options.turns > 1 && turns[0].is_some() {
        let (second, said) = shop.learned("turn1.nc", first.as_deref(), "model2.toml", &hidden);
        named[1] = said.said();
        turns[2] = shop.optimised("turn2.nc", second.as_deref(), false, &hidden, &least);
        turns[3] = shop.optimised("sure2.nc", second.as_deref(), true, &hidden, &least);
    }
    Outcome {
        name: format!("{} {seed}", cause.name),
        kept: [Some(programmed), declared, plain, turns[0], turns[1], turns[2], turns[3]],
        oracle: oracle_s(&case.job, &case.machine, &hidden, &shop.limits) / programmed.duration_s,
        named,
        said: shop.said,
    }
}

/// One line for a machine: excess in %, and time over that of the programmed feeds.
fn print_outcome(outcome: &Outcome) {
    let programmed = outcome.kept[0].map_or(1.0, |kept| kept.duration_s);
    let one = |kept: &Option<Kept>| {
        kept.map_or("      –      ".to_owned(), |k| {
            format!("{:+6.1} ({:.2})", 100.0 * k.worst, k.duration_s / programmed)
        })
    };
    println!(
        "{:<24}{}  oracle {:.2}{}\n    1: {}\n    2: {}",
        outcome.name,
        outcome.kept.iter().map(one).collect::<Vec<_>>().join(" "),
        outcome.oracle,
        outcome.said,
        outcome.named[0],
        outcome.named[1]
    );
}

/// Value at a share of a list in order.
fn at(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(((values.len().saturating_sub(1)) as f64 * share).round() as usize).copied().unwrap_or(f64::NAN)
}

fn print_table(outcomes: &[Outcome]) {
    println!(
        "\n| feeds by | machines | median | 90th | worst | cut length over by 5 %: median, worst | time over programmed, median | over the oracle's, median |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (way, name) in WAYS.iter().enumerate() {
        let kept: Vec<(&Outcome, Kept)> = outcomes.iter().filter_map(|o| o.kept[way].map(|kept| (o, kept))).collect();
        let excess = |share| 100.0 * at(kept.iter().map(|(_, k)| k.worst).collect(), share);
        let over = |share| 100.0 * at(kept.iter().map(|(_, k)| k.over).collect(), share);
        let time = |o: &Outcome, k: &Kept| k.duration_s / o.kept[0].map_or(f64::NAN, |kept| kept.duration_s);
        let times: Vec<f64> = kept.iter().map(|(o, k)| time(o, k)).collect();
        let oracle: Vec<f64> = kept.iter().map(|(o, k)| time(o, k) / o.oracle).collect();
        println!(
            "| {name} | {} | {:+.1} % | {:+.1} % | {:+.1} % | {:.1} %, {:.0} % | {:.2} | {:.2} |",
            kept.len(),
            excess(0.5),
            excess(0.9),
            excess(1.0),
            over(0.5),
            over(1.0),
            at(times, 0.5),
            at(oracle, 0.5)
        );
    }
    println!("excess above {:.0} % of the limit counts in the length", 100.0 * COUNTS);
}

fn main() {
    let options = options();
    let temporary = tempfile::tempdir().unwrap();
    let folder = options.keep.clone().unwrap_or_else(|| temporary.path().to_owned());
    let causes: Vec<Cause> = causes::all().into_iter().filter(|cause| !cause.table && !cause.forces).collect();
    let wanted = |n: &usize| {
        let name = causes[n * STRIDE % causes.len()].name;
        options.only.is_empty() || options.only.iter().any(|only| only == name)
    };
    let machines: Vec<usize> = (options.first..options.first + options.n).filter(wanted).collect();
    println!("{:<24}{}", "", WAYS.map(|way| format!("{way:>13}")).join(" "));
    let next = AtomicUsize::new(0);
    let outcomes = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..AT_ONCE {
            scope.spawn(|| {
                while let Some(n) = machines.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let cause = &causes[n * STRIDE % causes.len()];
                    let seed = options.base + *n as u64;
                    let outcome = one(&options, cause, seed, &folder.join(format!("{}-{seed}", cause.name)));
                    print_outcome(&outcome);
                    outcomes.lock().unwrap().push((*n, outcome));
                }
            });
        }
    });
    let mut outcomes = outcomes.into_inner().unwrap();
    outcomes.sort_by_key(|(n, _)| *n);
    print_table(&outcomes.into_iter().map(|(_, outcome)| outcome).collect::<Vec<_>>());
}
