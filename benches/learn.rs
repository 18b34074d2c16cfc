//! Speed of closing the loop: a 10-minute log at 1 kHz of a program of 20,000 blocks, read, aligned and diagnosed over the
//! whole list of effects; aim 30 s and 1 GB. The log is laid along the predicted motion, with flank wear hidden in it, once
//! with positions, once with time and load alone. Prints wall and processor seconds of each stage, and the peak memory.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use feedwright::engage::{EngagementMap, Options, engage};
use feedwright::force::contact::engaged;
use feedwright::learn::dataset::binning::channels;
use feedwright::learn::log::read_log;
use feedwright::learn::program::simulated::SimulatedProgram;
use feedwright::learn::program::simulated::simulate;
use feedwright::learn::program::timeline::Spot;
use feedwright::learn::session::{LogOptions, learn};
use feedwright::nc::{Environment, interpret, parse};
use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

const BLOCKS: usize = 20_000;
const RATE_HZ: f64 = 1000.0;
/// Feed that makes the cuts take ten minutes, mm/min.
const FEED: f64 = 1980.0;
/// What the log is made with: N/mm², N/mm, growth of k_te per 100 m.
const K_TC: f64 = 820.0;
const K_TE: f64 = 17.0;
const GROWTH: f64 = 1.0 / 15.0;

fn main() {
    let (job, _) = feedwright::setup::load(SETUP, Path::new(".")).unwrap();
    let program = program();
    println!("{} blocks", program.lines().count());
    let watch = Watch::start();
    let prepared = simulate(program.as_bytes(), &job, false).unwrap();
    let simulated = watch.say("program simulated, with the geometries that effects ask for");
    let path = interpret(&parse(program.into_bytes(), None), &Environment::from_job(&job));
    let closely = Options { spacing_mm: 0.05, ..Options::default() };
    let truth = engage(&path, &job, &closely, &|_| ()).unwrap();
    for positions in [true, false] {
        let text = log(&prepared, &truth, positions);
        println!(
            "log of {} samples, {:.0} MB, {}",
            text.lines().count() - 1,
            text.len() as f64 / 1e6,
            if positions { "with positions" } else { "time and load alone" }
        );
        let watch = Watch::start();
        let log = read_log(text.as_bytes(), &[]).unwrap();
        drop(text);
        let read = watch.say("read");
        let watch = Watch::start();
        let report = learn(&prepared, &job, &log, &channels(&log), &LogOptions::default()).unwrap();
        let learned = watch.say("aligned and diagnosed");
        let names: Vec<&str> = report.effects.iter().map(|e| e.name.as_str()).collect();
        println!(
            "  {names:?}, {} models fitted; all together {:.1} s wall",
            report.variants_tried,
            simulated + read + learned
        );
        let growth = report.effects.iter().flat_map(|e| &e.parameters).find(|p| p.name == "growth_per_100m");
        for value in report.final_base.iter().chain(growth) {
            println!("  {} = {:.4} ± {:.4} {}", value.name, value.value, value.std_error, value.unit);
        }
        println!("  put in: k_tc {K_TC}, k_te {K_TE}, growth {GROWTH}");
        assert_eq!(names, ["flank-wear"], "what was put in is found, and nothing else");
    }
    println!("peak memory {:.0} MB", status("VmHWM:") / 1024.0);
}

struct Watch {
    wall: Instant,
    user_s: f64,
}

impl Watch {
    fn start() -> Self {
        Self { wall: Instant::now(), user_s: user_s() }
    }
    /// Says what took how long; gives the wall seconds.
    fn say(&self, what: &str) -> f64 {
        let wall = self.wall.elapsed().as_secs_f64();
        println!("  {what}: {wall:.1} s wall, {:.1} s of processors", user_s() - self.user_s);
        wall
    }
}

/// Seconds of user time so far (Linux; 0 elsewhere), at the usual 100 ticks a second.
fn user_s() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = text.rsplit(')').next().unwrap_or("");
    after.split_whitespace().nth(11).and_then(|t| t.parse::<f64>().ok()).unwrap_or(0.0) / 100.0
}

/// A line of the kernel's status of this process, kB.
fn status(key: &str) -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix(key)).unwrap_or("0");
    line.split_whitespace().next().and_then(|v| v.parse().ok()).unwrap_or(0.0)
}

/// Layers of wavy passes in blocks of 0.9 mm.
fn program() -> String {
    let mut text = String::from("G21 G90 G17 G94\nG54\nT1 M6\nS8000 M3\nG0 X-10 Y0 Z5\n");
    let (length, step, mut written, mut pass) = (180.0, 0.9, 0, 0);
    while written < BLOCKS {
        let layer = pass / 28;
        let y = 3.5 * f64::from(pass % 28) + 1.0;
        let z = -2.0 * f64::from(layer + 1);
        text += &format!("G0 Z5\nG0 X-8 Y{y:.3}\nG0 Z{z:.3}\nG1 X0 F{FEED}\n");
        let count = (length / step) as usize;
        for k in 1..=count {
            let x = step * k as f64;
            let _ = writeln!(text, "X{x:.3} Y{:.3}", y + 0.3 * (0.05 * x * f64::from(1 + pass % 5)).sin());
        }
        text += "X190\n";
        written += count + 5;
        pass += 1;
    }
    text + "G0 Z20\nM5\nM30\n"
}

/// The log of a machine that moves as was predicted, its edge wearing, with 3 % noise; what it cuts is simulated in steps of
/// 0.05 mm.
fn log(prepared: &SimulatedProgram, truth: &EngagementMap, positions: bool) -> String {
    let timeline = prepared.timeline();
    let (total, mut state, mut slid) = (timeline.total_s(), 1u64, 0.0);
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut text =
        String::from(if positions { "time_s,x_mm,y_mm,z_mm,spindle_power_w\n" } else { "time_s,spindle_power_w\n" });
    for k in 0..(total * RATE_HZ) as usize {
        let t = k as f64 / RATE_HZ;
        let Some(index) = timeline.at(t) else { continue };
        let spot = &timeline.spots[index];
        let share = ((t - spot.start_s) / (spot.end_s - spot.start_s).max(1e-9)).clamp(0.0, 1.0);
        let p = spot.from + (spot.to - spot.from) * share;
        slid += spot.engaged.way_mm * spot.rps / RATE_HZ;
        let worn = 1.0 + GROWTH * slid / 1e5;
        let [removed, contact] = cut_at(truth, spot, share);
        let cutting = 1e-3 * (K_TC * removed + K_TE * worn * contact * spot.rps);
        let tare = if spot.rps > 0.0 { 300.0 } else { 0.0 };
        let noise = 8.0 * (uniform() + uniform() + uniform() + uniform() - 2.0) * 3f64.sqrt();
        let power = tare + cutting + noise;
        let _ = if positions {
            writeln!(text, "{t:.3},{:.3},{:.3},{:.3},{power:.1}", p.x, p.y, p.z)
        } else {
            writeln!(text, "{t:.3},{power:.1}")
        };
    }
    text
}

/// Removal rate, mm³/s, and swept area, mm², a share of the way along a spot.
fn cut_at(truth: &EngagementMap, spot: &Spot, share: f64) -> [f64; 2] {
    let Some(id) = spot.move_id else { return [0.0; 2] };
    let at_mm = spot.middle_mm + (share - 0.5) * spot.length_mm;
    let stations = truth.stations_of(id);
    let k = stations.partition_point(|station| station.to_mm < at_mm);
    let Some(station) = stations.get(k.min(stations.len().saturating_sub(1))) else { return [0.0; 2] };
    let cut = engaged(station, truth, &truth.slices[0].1, 3, spot.direction.z);
    [cut.section_mm2 * spot.speed_mm_s(), cut.contact_mm2]
}

const SETUP: &str = r#"
units = "mm"
[machine]
dialect = "linuxcnc"
rapid = 15000
corner_tolerance = 0.02
block_time = 0.001
[machine.axes]
x = { velocity = 15000, acceleration = 3000 }
y = { velocity = 15000, acceleration = 3000 }
z = { velocity = 15000, acceleration = 3000 }
[machine.spindle]
max_rpm = 12000
tare = 300
[stock]
box = { min = [0, 0, -30], max = [180, 100, 0] }
[material]
k_tc = 800
k_rc = 320
k_te = 16
k_re = 10
[[tool]]
number = 1
shape = "flat"
diameter = 10
flutes = 3
flute_length = 22
overhang = 35
"#;
