//! How fast the schedule is and how near its F words come to the continuous optimum. Without arguments: synthetic paths
//! (exact pass, convex program); with the path of a program that has a setup: that program. A setup is sought beside it. With the
//! name of a CSV file: the problem and its answer for `tests/bench/peers.py`, an arc, or with `jerk` a straight path under a limit of
//! jerk; a number says how many points.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use std::path::Path;
use std::time::Instant;

use feedwright::engage::{self, engage};
use feedwright::ids::MoveId;
use feedwright::machine::{Axis, Machine};
use feedwright::nc::{Environment, MoveKind, interpret, parse};
use feedwright::schedule::FeedPiece;
use feedwright::schedule::exact_pass::{Chain, Leg, exact_pass};
use feedwright::schedule::optimum::optimum;
use feedwright::schedule::track::{Track, track};
use feedwright::schedule::{Options, as_programmed, problem, realise, solve};

fn main() {
    let mut programs: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let count = programs.iter().find_map(|word| word.parse().ok()).unwrap_or(10_000);
    let jerk = programs.iter().any(|word| word == "jerk");
    programs.retain(|word| word != "jerk" && word.parse::<usize>().is_err());
    for program in &programs {
        if Path::new(program).extension().is_none_or(|end| end != "csv") {
            real(Path::new(program));
        } else if jerk {
            emit_jerk(Path::new(program), count);
        } else {
            emit_arc(Path::new(program), count);
        }
    }
    if programs.is_empty() {
        synthetic();
    }
}

fn leg(ds_mm: f64, speed: f64, jerk_mm_s3: f64) -> Leg {
    Leg { ds_mm, cap_b: speed * speed, accel_mm_s2: 500.0, jerk_mm_s3, first_row: 0, row_count: 0 }
}

/// A finishing raster: stations of 0.3 mm, caps that wander, a turn every 200 stations.
fn raster(stations: usize, jerk_mm_s3: f64, turn: usize) -> Track {
    let mut track = Track { chain: Chain { point_b: vec![0.0], ..Chain::default() }, ..Track::default() };
    for i in 0..stations {
        let wander = 50.0 + 30.0 * (i as f64 * 0.11).sin() * (i as f64 * 0.017).cos();
        track.chain.legs.push(leg(0.3, wander, jerk_mm_s3));
        track.chain.point_b.push(if (i + 1) % turn == 0 { 4.0 } else { 1e9 });
        track.tags.push(i as u32);
        track.moves.push(MoveId(i as u32));
    }
    *track.chain.point_b.last_mut().unwrap() = 0.0;
    track
}

fn synthetic() {
    let stations = 1_000_000;
    let track = raster(stations, f64::INFINITY, 200);
    let mut b = Vec::new();
    let run = |_| {
        let start = Instant::now();
        b = exact_pass(&track.chain);
        start.elapsed().as_secs_f64()
    };
    let ns = (0..9).map(run).fold(f64::INFINITY, f64::min) * 1e9 / stations as f64;
    println!("exact pass: {ns:.1} ns a station (best of 9, {stations} stations, last b {:.1})", b[stations]);
    for turn in [200, 2000] {
        let stations = 1_000_000;
        let start = Instant::now();
        let answer = optimum(raster(stations, 20000.0, turn), 0.0);
        let us = start.elapsed().as_secs_f64() * 1e6 / stations as f64;
        println!(
            "with jerk, a turn every {turn}: {us:.1} us a station wall, {} legs, {:?} windows (all, second solver, refused), {} jerky points",
            answer.chain.legs.len(),
            answer.windows,
            answer.jerky
        );
    }
    println!("peak memory {} MB", peak_memory_bytes() / 1_000_000);
}

/// Three quarters of a circle of 20 mm from rest to rest, every axis up to 500 mm/s^2 and 90 mm/s: the grid, our b and time,
/// for `tests/bench/peers.py`.
fn emit_arc(path: &Path, count: usize) {
    let radius = 20.0;
    let text = b"G21 G17 G90\nG0 X20 Y0 Z0\nG4 P1\nG3 X0 Y-20 I-20 J0 F60000\nM2\n".to_vec();
    let toolpath = interpret(&parse(text, None), &Environment::default());
    let axis = Axis { velocity_mm_s: 90.0, acceleration_mm_s2: 500.0, jerk_mm_s3: None };
    let setup = std::fs::read_to_string("programs/pocket.setup.toml").unwrap();
    let (job, _) = feedwright::setup::load(&setup, Path::new("programs")).unwrap();
    let machine = Machine { axes: [axis; 3], block_time_s: 0.0, ..job.machine };
    let length = radius * 1.5 * std::f64::consts::PI;
    let whole = track(&toolpath, &machine, &mut |id, pieces| {
        let at = |i: usize| length * i as f64 / count as f64;
        pieces.extend((0..count).map(|i| FeedPiece::commanded(id, [at(i), at(i + 1)], 1e3)));
    });
    let skip = whole.chain.legs.len() - count;
    let mut b = Vec::new();
    let run = |_| {
        let start = Instant::now();
        b = exact_pass(&whole.chain);
        start.elapsed().as_secs_f64()
    };
    let elapsed = (0..9).map(run).fold(f64::INFINITY, f64::min);
    let mut out = format!("# radius {radius} velocity 90 acceleration 500 seconds {elapsed}\ns,b\n");
    for (i, b) in b[skip..].iter().enumerate() {
        out += &format!("{},{b}\n", length * i as f64 / count as f64);
    }
    std::fs::write(path, out).unwrap();
    println!("wrote {}, peak memory {} MB", path.display(), peak_memory_bytes() / 1_000_000);
}

/// A straight path from rest to rest under caps that wander and a limit of jerk: the highest b and ours at each of its points, and the
/// time of travel as leg times say it.
fn emit_jerk(path: &Path, count: usize) {
    const JERK: f64 = 20_000.0;
    let track = raster(count, JERK, usize::MAX);
    let caps: Vec<f64> = track.chain.legs.iter().map(|leg| leg.cap_b).collect();
    let mut answer = optimum(raster(count, JERK, usize::MAX), 0.0);
    let mut elapsed = f64::INFINITY;
    for _ in 0..3 {
        let track = raster(count, JERK, usize::MAX);
        let start = Instant::now();
        answer = optimum(track, 0.0);
        elapsed = elapsed.min(start.elapsed().as_secs_f64());
    }
    let travel: f64 = answer.leg_times().iter().sum();
    let mut out = format!(
        "# jerk {JERK} acceleration 500 step 0.3 travel {travel} jerky {} seconds {elapsed}\ns,cap_b\n",
        answer.jerky
    );
    for i in 0..=count {
        let cap = caps[i.saturating_sub(1)].min(caps[i.min(count - 1)]);
        out += &format!("{},{cap}\n", 0.3 * i as f64);
    }
    std::fs::write(path, out).unwrap();
    println!("wrote {}, peak memory {} MB", path.display(), peak_memory_bytes() / 1_000_000);
}

fn peak_memory_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").trim().parse::<u64>().ok()).map_or(0, |kb| kb * 1024)
}

fn real(path: &Path) {
    let stem = path.file_stem().unwrap().to_string_lossy().into_owned();
    let beside = [format!("{stem}.setup.toml"), format!("setups/{stem}.toml")];
    let folder = path.parent().unwrap();
    let shared = Path::new("../shared/programs/setups").join(format!("{stem}.toml"));
    let setup = beside.iter().map(|name| folder.join(name)).find(|path| path.exists()).unwrap_or(shared);
    let text = std::fs::read_to_string(&setup).unwrap();
    let (job, _) = feedwright::setup::load(&text, setup.parent().unwrap()).unwrap();
    let program = parse(std::fs::read(path).unwrap(), None);
    let toolpath = interpret(&program, &Environment::from_job(&job));
    let start = Instant::now();
    let map = engage(&toolpath, &job, &engage::Options::default(), &|_| {}).unwrap();
    let engaged = start.elapsed();
    let start = Instant::now();
    let problem = problem(&toolpath, &map, &job);
    let capped = start.elapsed();
    let start = Instant::now();
    let schedule = solve(&problem, &toolpath, &job, &Options::of(&toolpath));
    let solved = start.elapsed();
    let before = realise(&toolpath, &as_programmed(&toolpath), &job.machine).total_s;
    let after = realise(&toolpath, &schedule.pieces, &job.machine).total_s;
    let feeds: Vec<f64> = schedule.pieces.iter().map(|piece| piece.feed_mm_s).collect();
    let words = feeds.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let moves = toolpath.moves.iter().filter(|motion| motion.kind == MoveKind::Feed).count();
    println!(
        "{stem}: {} moves, {} nodes, {} infeasible",
        toolpath.moves.len(),
        problem.nodes.len(),
        problem.nodes.iter().filter(|node| node.infeasible.is_some()).count()
    );
    println!("  engage {engaged:.1?}, caps {capped:.1?}, solve {solved:.1?}: {}", schedule.how);
    println!(
        "  {before:.1} s -> {after:.1} s, continuous {:.1} s, loss {:.2} %; {words} feed changes, {} pieces of {moves} feed moves, growth {:.2}",
        schedule.continuous_s,
        100.0 * (after / schedule.continuous_s - 1.0),
        schedule.pieces.len(),
        schedule.pieces.len() as f64 / moves as f64
    );
    for (kind, seconds) in &schedule.active_s {
        println!("    {:20} {seconds:8.1} s", kind.name());
    }
    for price in &schedule.shadow_prices {
        let (kind, tool) = (price.kind, price.tool);
        println!("    price of {:16} of T{tool} {:+.5} s per {}", kind.name(), price.per_unit_s, kind.unit());
    }
}
