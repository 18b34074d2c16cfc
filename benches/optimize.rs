//! The whole pipeline on a finishing program: `optimize` by stage with peak memory; again, with the engagement kept in a file as `--cache`
//! keeps it; then with one limit changed and the engagement taken from there; and from a block, with a certificate and what its checker takes.
//! `cargo bench --bench optimize -- [blocks]` (default 100,000), `-- certificate [blocks]` for the last alone.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

use feedwright::certify::{Basis, check};
use feedwright::engage::cache::{from_bytes, to_bytes};
use feedwright::engage::{self, EngagementMap};
use feedwright::job::{Keep, Task, Wanted, Watch, optimize, simulate};
use feedwright::outcome::ProgramRun;
use feedwright::path::Vec3;
use feedwright::rewrite::rewrite;
use feedwright::schedule::{Options, solve};
use feedwright::stock::{Field, Piece, Relief, saved};
use feedwright::{machine, nc, setup};

/// Blocks of 0.24 mm in rows of 1,250, 0.3 mm apart or less.
const PER_ROW: usize = 1250;
const STAGES: [&str; 5] = ["parse", "simulate", "schedule", "rewrite", "check"];

fn main() {
    let blocks = std::env::args().skip(1).find_map(|word| word.parse().ok()).unwrap_or(100_000);
    if std::env::args().any(|word| word == "certificate") {
        return certified(blocks);
    }
    let text = program(blocks, surface);
    let stock = stock();
    let load = |_: &Path| Ok(stock.clone());
    let kept = tempfile::NamedTempFile::new().unwrap();
    let remember = |key: &engage::cache::Key, map: &EngagementMap| {
        std::fs::write(kept.path(), to_bytes(map, key)).unwrap();
    };
    let recall = |key: &engage::cache::Key| from_bytes(&std::fs::read(kept.path()).ok()?, key).ok();
    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64();
    let watch = Watch {
        progress: &|_, _| (),
        clock: &clock,
        subprograms: &|_| None,
        engage: engage::Options { loader: Some(&load), ..engage::Options::default() },
        keep: Keep { recall: Some(&recall), remember: Some(&remember), stock: None },
    };
    for (name, keep) in [("optimize", Keep::default()), ("the same with --cache", watch.keep)] {
        let begin = clock();
        let run = optimize(task(&text, 60.0), &Watch { keep, ..watch }).unwrap();
        print_run(&format!("{name}, {blocks} blocks"), clock() - begin, &run);
    }
    for (jerk, name) in [(true, "with jerk"), (false, "without jerk: the exact pass")] {
        resolve(&text, name, jerk, &watch);
    }
    certified(blocks);
}

/// `optimize` without and with a certificate, and the checker.
fn certified(blocks: usize) {
    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64();
    let engage = engage::Options::default();
    let watch = Watch { progress: &|_, _| (), clock: &clock, subprograms: &|_| None, engage, keep: Keep::default() };
    let text = program(blocks, shallow);
    let task = |certificate: bool| {
        let plain = task(&text, 80.0);
        let wanted = Wanted { confidence: Some(0.95), certificate, ..plain.wanted };
        let mut job = plain.job;
        let stock = &mut job.stocks[0];
        let extent = machine::Box3 { min: Vec3::new(-5.0, -5.0, -20.0), max: Vec3::new(305.0, 205.0, 0.0) };
        (stock.shape, stock.uncertainty_mm) = (machine::StockShape::Box(extent), 0.02);
        stock.material.uncertainty = Some(0.1);
        Task { job, wanted, ..plain }
    };
    let plain = task(false);
    let begin = clock();
    optimize(plain, &watch).unwrap();
    let plain_s = clock() - begin;
    let task = task(true);
    let job = task.job.clone();
    let begin = clock();
    let run = optimize(task, &watch).unwrap();
    let optimize_s = clock() - begin;
    let bytes = run.written.unwrap().bytes;
    let begin = clock();
    let written = nc::parse(bytes.clone(), Some(nc::Dialect::LinuxCnc));
    let toolpath = nc::interpret(&written, &nc::Environment::from_job(&job));
    let basis = Basis { bytes: &bytes, toolpath: &toolpath, job: &job, switched: false };
    let certificate = run.answers.certificate.unwrap();
    let proven = check(&certificate, &basis).unwrap();
    let check_s = clock() - begin;
    println!(
        "certificate of {blocks} blocks, {} stations, {:.0} MB: checked in {check_s:.2} s, {:.2} of the {plain_s:.2} s that optimize takes \
         without one (with one {optimize_s:.2} s)",
        proven.counts[1],
        certificate.len() as f64 / 1e6,
        check_s / plain_s
    );
}

/// Another force limit on the engagement that was kept: best of three.
fn resolve(text: &str, name: &str, jerk: bool, watch: &Watch) {
    let clock = watch.clock;
    let times = [66.0, 67.0, 68.0].map(|force_xy_n| {
        let mut task = task(text, force_xy_n);
        if !jerk {
            task.job.machine.axes.iter_mut().for_each(|axis| axis.jerk_mm_s3 = None);
        }
        let begin = clock();
        let run = simulate(task, watch).unwrap();
        let (capped, moves) = (clock(), &run.toolpath);
        let schedule = solve(&run.problem, moves, &run.job, &Options::of(moves));
        let solved = clock();
        let bytes = rewrite(&run.program, moves, &schedule, &run.job).bytes.len();
        ([capped - begin, solved - capped, clock() - solved], schedule.how, bytes)
    });
    let whole = |times: &[f64; 3]| times.iter().sum::<f64>();
    let (best, how, bytes) = times.iter().min_by(|a, b| whole(&a.0).total_cmp(&whole(&b.0))).unwrap();
    println!(
        "one limit changed, {name}: {:.2} s ({:.2} interpretation, engagement from the cache, caps, time as programmed; {:.2} solving; {:.2} rewriting {bytes} bytes); {how}",
        whole(best),
        best[0],
        best[1],
        best[2]
    );
}

fn print_run(name: &str, wall_s: f64, run: &ProgramRun) {
    let written = run.written.as_ref().unwrap();
    let stages: String =
        STAGES.iter().zip(run.stage_s).map(|(stage, seconds)| format!(", {stage} {seconds:.2}")).collect();
    println!(
        "{name}: {wall_s:.2} s wall{stages}; peak {:.0} MB; {} nodes; {:.1} s -> {:.1} s, caps tightened {} times, worst {:.3}",
        peak_memory_bytes() as f64 / 1e6,
        run.problem.nodes.len(),
        run.realised_before.total_s,
        written.realised_after.total_s,
        written.check.rounds,
        written.check.over.ratio()
    );
}

fn surface(x: f64, y: f64) -> f64 {
    -8.0 + 3.0 * (x * 0.05).sin() * (y * 0.04).cos()
}

/// The same waves, 0.2 to 0.5 mm below the top of a block.
fn shallow(x: f64, y: f64) -> f64 {
    -0.35 + 0.05 * (surface(x, y) + 8.0)
}

fn program(blocks: usize, surface: fn(f64, f64) -> f64) -> String {
    let rows = blocks.div_ceil(PER_ROW);
    let pitch = (200.0 / rows as f64).min(0.3);
    let mut text = String::from("%\nG21 G17 G90 G64\nT1 M6\nS12000 M3\nG0 X0 Y0 Z5\n");
    for made in 0..blocks {
        let (row, k) = (made / PER_ROW, made % PER_ROW);
        let at = if row.is_multiple_of(2) { k } else { PER_ROW - 1 - k };
        let (x, y) = (0.24 * at as f64, pitch * row as f64);
        let feed = if made == 0 { " F1800" } else { "" };
        let _ = writeln!(text, "G1 X{x:.3} Y{y:.3} Z{:.3}{feed}", surface(x, y));
    }
    text + "G0 Z50\nM30\n%\n"
}

/// 0.3 mm over the surface, 300 by 200 mm: heights over a grid.
fn stock() -> Vec<u8> {
    let extent = machine::Box3 { min: Vec3::new(0.0, 0.0, -20.0), max: Vec3::new(300.0, 200.0, -4.0) };
    let field = Field::new(extent, 0.1, |x, y| surface(x, y) + 0.3);
    saved::to_bytes(&Piece::of_relief(Relief::new(&field), field), Vec3::zeros())
}

fn task(text: &str, force_xy_n: f64) -> Task {
    let toml = format!(
        r#"
resolution = 0.1
[machine]
dialect = "linuxcnc"
[machine.axes]
x = {{ velocity = 15000, acceleration = 2000, jerk = 50000 }}
y = {{ velocity = 15000, acceleration = 2000, jerk = 50000 }}
z = {{ velocity = 12000, acceleration = 1500, jerk = 50000 }}
[stock]
material = "aluminium-6061-t6"
saved = "roughed.stock"
[[tool]]
number = 1
shape = "ball"
diameter = 6
flutes = 2
[limits]
force_xy = {force_xy_n}
"#
    );
    let (job, assumptions) = setup::load(&toml, Path::new(".")).unwrap();
    let program = nc::parse(text.as_bytes().to_vec(), Some(nc::Dialect::LinuxCnc));
    Task { program, job, assumptions, wanted: Wanted::default() }
}

fn peak_memory_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").trim().parse::<u64>().ok()).map_or(0, |kb| kb * 1024)
}
