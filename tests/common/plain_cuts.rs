//! A second generator of logs, which shares nothing with that of the confusion matrix nor with the simulation: straight cuts of
//! a flat mill, feeds reached at once, and at every instant the front of the mill in 720 directions, each of which meets what
//! no earlier move has come within a radius of. In: a program, what is hidden. Out: its text and readings of the spindle.

#![allow(dead_code)] // each test file uses its own part of it

use super::follow::Noise;
use std::f64::consts::PI;

/// Radius and teeth of the mill, and the block: x and y from 0, its top at 0.
const RADIUS_MM: f64 = 5.0;
const TEETH: f64 = 3.0;
const BLOCK_MM: [f64; 2] = [100.0, 60.0];
/// Directions of the front of the mill, and time between instants, s.
const DIRECTIONS: usize = 720;
const STEP_S: f64 = 0.01;
/// Readings a second, each a mean.
const RATE_HZ: f64 = 20.0;
const RAPID_MM_MIN: f64 = 12_000.0;

/// The job of every log.
pub const SETUP: &str = r#"units = "mm"
[machine]
dialect = "linuxcnc"
rapid = 12000
[machine.axes]
x = { velocity = 12000, acceleration = 100000 }
y = { velocity = 12000, acceleration = 100000 }
z = { velocity = 12000, acceleration = 100000 }
[stock]
material = "aluminium-6061-t6"
box = { min = [0, 0, -20], max = [100, 60, 0] }
[[tool]]
number = 1
shape = "flat"
diameter = 10
flutes = 3
helix = 30
flute_length = 25
overhang = 40
[limits]
force_xy = 500
"#;

/// A straight move: line of the program, ends, feed in mm/min (`None`: rapid), speed in rev/min.
#[derive(Clone)]
struct Leg {
    line: usize,
    from: [f64; 3],
    to: [f64; 3],
    feed: Option<f64>,
    rpm: f64,
}

/// A program as it is written.
pub struct Program {
    /// Its text.
    pub text: String,
    legs: Vec<Leg>,
    at: [f64; 3],
    rpm: f64,
}

impl Program {
    fn new() -> Self {
        let text = "G21 G90 G17\nT1 M6\nS6000 M3\nG54\n".to_owned();
        let mut program = Self { text, legs: Vec::new(), at: [0.0, 0.0, 50.0], rpm: 6000.0 };
        program.rapid([None, None, Some(10.0)]);
        program
    }
    fn speed(&mut self, rpm: f64) {
        self.rpm = rpm;
        self.text += &format!("S{rpm}\n");
    }
    fn go(&mut self, to: [Option<f64>; 3], feed: Option<f64>) {
        let words: String = "XYZ".chars().zip(to).filter_map(|(axis, v)| Some(format!(" {axis}{:.3}", v?))).collect();
        let feed_word = feed.map_or(String::new(), |f| format!(" F{f}"));
        self.text += &format!("{}{words}{feed_word}\n", if feed.is_some() { "G1" } else { "G0" });
        let end = [0, 1, 2].map(|k| to[k].unwrap_or(self.at[k]));
        let line = self.text.lines().count();
        self.legs.push(Leg { line, from: self.at, to: end, feed, rpm: self.rpm });
        self.at = end;
    }
    fn rapid(&mut self, to: [Option<f64>; 3]) {
        self.go(to, None);
    }
    /// To a depth beside the block, along it, and up again.
    fn pass(&mut self, from: [f64; 2], to: [f64; 2], z: f64, feed: f64) {
        self.rapid([Some(from[0]), Some(from[1]), None]);
        self.rapid([None, None, Some(z)]);
        self.go([Some(to[0]), Some(to[1]), None], Some(feed));
        self.rapid([None, None, Some(10.0)]);
    }
    fn end(mut self) -> Self {
        self.rapid([None, None, Some(50.0)]);
        self.text += "M30\n";
        self
    }
}

/// Slots and shoulders of several widths, both ways, at two depths and speeds.
pub fn rows() -> Program {
    let mut program = Program::new();
    let feeds = [400.0, 700.0, 550.0, 900.0, 500.0, 1100.0];
    for (z, rpm) in [(-2.0, 6000.0), (-5.0, 8000.0)] {
        program.speed(rpm);
        let mut y = 6.0;
        for (k, width) in [0.0, 3.0, 6.0, 2.0, 8.0, 4.0].into_iter().enumerate() {
            y += width;
            let [from, to] = if k % 2 == 0 { [-8.0, 108.0] } else { [108.0, -8.0] };
            program.pass([from, y], [to, y], z, feeds[k]);
        }
    }
    program.end()
}

/// Closed rectangles from a slot outward, in three layers.
pub fn pocket() -> Program {
    let mut program = Program::new();
    for z in [-1.5, -3.0, -4.5] {
        program.rapid([Some(-8.0), Some(30.0), None]);
        program.rapid([None, None, Some(z)]);
        program.go([Some(50.0), Some(30.0), None], Some(600.0));
        for (ring, feed) in [600.0, 800.0, 500.0, 700.0].into_iter().enumerate() {
            let a = 4.0 * ring as f64;
            let [x0, x1, y0, y1] = [30.0 - a, 70.0 + a, 26.0 - 0.9 * a, 34.0 + 0.9 * a];
            for [x, y] in [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]] {
                program.go([Some(x), Some(y), None], Some(feed));
            }
        }
        program.rapid([None, None, Some(10.0)]);
    }
    program.end()
}

/// What no setup declares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hidden {
    /// The edge force grows to this many times more with the way the teeth have slid.
    Wear(f64),
    /// Power that fades with this part of the log as its time, W.
    WarmUp(f64),
    /// Tare grows with this power of the speed.
    TareSpeed(f64),
    /// Cutting takes more where the tooth enters with no chip.
    Up(f64),
    /// The block is higher, mm.
    Proud(f64),
    /// The drive takes more, per W at the tool.
    Drive(f64),
    /// Time constant of the meter, s.
    Lag(f64),
    /// Everything takes more between two planes across x.
    Slab([f64; 2], f64),
    /// Everything takes more within a circle: centre, radius.
    Disc([f64; 2], f64, f64),
    /// Everything takes more from this part of the log on.
    Chipped(f64, f64),
    /// A pump that is on for 3.5 of 9 s, W. In no list.
    Pump(f64),
    /// Tare rises along x, W/mm. In no list.
    Slide(f64),
    /// The feed is turned down to this share between two parts of the program. In no list.
    Override([f64; 2], f64),
    /// The tool is held at the end of the first cut behind this part of the program, s. In no list.
    Held(f64, f64),
}

/// One instant.
struct Instant {
    time_s: f64,
    line: usize,
    at: [f64; 3],
    rpm: f64,
    cutting_w: f64,
    edge_w: f64,
    /// Way of a tooth in the material since the instant before, mm.
    slid_mm: f64,
}

const K_TC: f64 = 780.0;
const K_TE: f64 = 16.0;

/// Depth that the front of the mill meets at a place: from there down to its tip.
fn depth(place: [f64; 2], tip_z: f64, before: &[&Leg], top: f64) -> f64 {
    if (0..2).any(|k| place[k] < 0.0 || place[k] > BLOCK_MM[k]) {
        return 0.0;
    }
    let stands = |leg: &&&Leg| square_of_distance(place, leg) <= RADIUS_MM * RADIUS_MM;
    let low = |leg: &&Leg| leg.from[2].min(leg.to[2]);
    (before.iter().filter(stands).map(low).fold(top, f64::min) - tip_z).max(0.0)
}

/// Of a place from the line of a leg, mm².
fn square_of_distance(place: [f64; 2], leg: &Leg) -> f64 {
    let along = [leg.to[0] - leg.from[0], leg.to[1] - leg.from[1]];
    let off = [place[0] - leg.from[0], place[1] - leg.from[1]];
    let square = along[0] * along[0] + along[1] * along[1];
    let share = if square > 0.0 { ((off[0] * along[0] + off[1] * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    (off[0] - share * along[0]).powi(2) + (off[1] - share * along[1]).powi(2)
}

/// Power of the cut at a place of a leg: cutting and edge, W, and the way a tooth slides in a turn, mm.
fn cut(leg: &Leg, at: [f64; 3], before: &[Leg], hidden: &[Hidden]) -> [f64; 3] {
    let run = [leg.to[0] - leg.from[0], leg.to[1] - leg.from[1]];
    let (Some(feed), length) = (leg.feed, run[0].hypot(run[1])) else { return [0.0; 3] };
    let top = hidden.iter().map(|h| if let Hidden::Proud(top) = h { *top } else { 0.0 }).sum();
    let (feed_per_tooth, heading) = (feed / leg.rpm / TEETH, run[1].atan2(run[0]));
    let step = PI / DIRECTIONS as f64;
    // No other leg comes within a radius of the front of the mill.
    let is_near = |leg: &&Leg| square_of_distance([at[0], at[1]], leg) <= 4.1 * RADIUS_MM * RADIUS_MM;
    let before: Vec<&Leg> = before.iter().filter(is_near).collect();
    let (mut chips, mut edges, mut met) = (0.0, 0.0, 0.0);
    for k in 0..if length > 0.0 { DIRECTIONS } else { 0 } {
        let ahead = (k as f64 + 0.5) * step - 0.5 * PI;
        let place = [0, 1].map(|axis| at[axis] + RADIUS_MM * (heading + ahead - 0.5 * PI * axis as f64).cos());
        let depth = depth(place, at[2], &before, top);
        let mut factor = 1.0;
        for each in hidden {
            factor *= match *each {
                Hidden::Slab([from, to], more) if place[0] > from && place[0] < to => 1.0 + more,
                Hidden::Disc([x, y], radius, more) if (place[0] - x).hypot(place[1] - y) < radius => 1.0 + more,
                _ => 1.0,
            };
        }
        let side = hidden.iter().map(|h| if let Hidden::Up(more) = h { *more } else { 0.0 }).sum::<f64>();
        let own = if ahead < 0.0 { 1.0 + side } else { 1.0 };
        chips += factor * own * feed_per_tooth * ahead.cos() * depth * step;
        edges += factor * depth * step;
        met += if depth > 0.0 { step } else { 0.0 };
    }
    let per_n = 1e-3 * RADIUS_MM * TEETH * leg.rpm / 60.0;
    [K_TC * chips * per_n, K_TE * edges * per_n, RADIUS_MM * met]
}

/// Share of the programmed feed at which the machine runs in a part of the program.
fn run_at(hidden: &[Hidden], part: f64) -> f64 {
    let of = |h: &Hidden| match *h {
        Hidden::Override([from, to], share) if (from..to).contains(&part) => share,
        _ => 1.0,
    };
    hidden.iter().map(of).product()
}

fn instants(program: &Program, hidden: &[Hidden]) -> Vec<Instant> {
    let (mut all, mut begin_s, mut held) = (Vec::new(), 0.0, false);
    for (number, leg) in program.legs.iter().enumerate() {
        let part = number as f64 / program.legs.len() as f64;
        let feed = leg.feed.map(|feed| feed * run_at(hidden, part));
        let leg = &Leg { feed, ..leg.clone() };
        let length = (0..3).map(|k| (leg.to[k] - leg.from[k]).powi(2)).sum::<f64>().sqrt();
        let takes_s = length / (leg.feed.unwrap_or(RAPID_MM_MIN) / 60.0);
        let count = (takes_s / STEP_S).ceil().max(1.0) as usize;
        for k in 0..if length > 0.0 { count } else { 0 } {
            let share = (k as f64 + 0.5) / count as f64;
            let at = [0, 1, 2].map(|axis| leg.from[axis] + share * (leg.to[axis] - leg.from[axis]));
            let [cutting_w, edge_w, slides] = cut(leg, at, &program.legs[..number], hidden);
            let slid_mm = slides * leg.rpm / 60.0 * takes_s / count as f64;
            let time_s = begin_s + share * takes_s;
            all.push(Instant { time_s, line: leg.line, at, rpm: leg.rpm, cutting_w, edge_w, slid_mm });
        }
        begin_s += takes_s;
        let next = (number + 1) as f64 / program.legs.len() as f64;
        for each in hidden {
            if let Hidden::Held(at, seconds) = *each
                && leg.feed.is_some()
                && next > at
                && !held
            {
                held = true;
                let stands = |k: usize| Instant {
                    time_s: begin_s + (k as f64 + 0.5) * STEP_S,
                    line: leg.line,
                    at: leg.to,
                    rpm: leg.rpm,
                    cutting_w: 0.0,
                    edge_w: 0.0,
                    slid_mm: 0.0,
                };
                all.extend((0..(seconds / STEP_S) as usize).map(stands));
                begin_s += seconds;
            }
        }
    }
    all
}

/// What the spindle takes at every instant, W.
fn readings(all: &[Instant], hidden: &[Hidden]) -> Vec<f64> {
    let end_s = all.last().map_or(1.0, |i| i.time_s);
    let whole_mm: f64 = all.iter().map(|i| i.slid_mm).sum();
    let (mut slid_mm, mut level) = (0.0, f64::NAN);
    let mut read = |now: &Instant| {
        slid_mm += now.slid_mm;
        let (mut cut, mut edge, mut idle) = (now.cutting_w, now.edge_w, 140.0);
        let (mut beside, mut lag_s, mut drive) = (0.0, 0.0, 0.0);
        for each in hidden {
            match *each {
                Hidden::Wear(more) => edge *= 1.0 + more * slid_mm / whole_mm,
                Hidden::Chipped(from, more) if now.time_s > from * end_s => (cut, edge) = (cut * more, edge * more),
                Hidden::WarmUp(watts) => beside += watts * (-now.time_s / (0.25 * end_s)).exp(),
                Hidden::TareSpeed(power) => idle *= (now.rpm / 6000.0).powf(power),
                Hidden::Pump(watts) if now.time_s % 9.0 < 3.5 => beside += watts,
                Hidden::Slide(per_mm) => beside += per_mm * now.at[0],
                Hidden::Drive(more) => drive = more,
                Hidden::Lag(constant_s) => lag_s = constant_s,
                _ => {}
            }
        }
        let tool = cut + edge;
        let power = idle + beside + tool * (1.0 + drive * tool);
        let share = if level.is_nan() || lag_s == 0.0 { 1.0 } else { 1.0 - (-STEP_S / lag_s).exp() };
        level = if level.is_nan() { power } else { level + share * (power - level) };
        level
    };
    all.iter().map(&mut read).collect()
}

/// How the samples of a log tell where they were.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tied {
    /// By position.
    Position,
    /// By the line of the program.
    Line,
    /// By nothing but their time.
    Time,
}

/// A log, and the noise put into it: a share of the mean power of the cut, W.
pub fn log(program: &Program, hidden: &[Hidden], tied: Tied, noise: f64, seed: u64) -> (String, f64) {
    let all = instants(program, hidden);
    let power = readings(&all, hidden);
    let cuts: Vec<f64> = all.iter().map(|i| i.cutting_w + i.edge_w).filter(|w| *w > 1.0).collect();
    let noise_w = noise * cuts.iter().sum::<f64>() / cuts.len() as f64;
    let mut chance = Noise(seed);
    let mut text = match tied {
        Tied::Position => "time_s,x_mm,y_mm,z_mm,spindle_power_w\n".to_owned(),
        Tied::Line => "time_s,line,spindle_power_w\n".to_owned(),
        Tied::Time => "time_s,spindle_power_w\n".to_owned(),
    };
    let end_s = all.last().map_or(0.0, |i| i.time_s);
    let mut first = 0;
    for k in 0..(end_s * RATE_HZ) as usize {
        let [from_s, to_s] = [k as f64, k as f64 + 1.0].map(|n| n / RATE_HZ);
        let last = first + all[first..].partition_point(|i| i.time_s < to_s);
        if last == first {
            continue;
        }
        let mean = power[first..last].iter().sum::<f64>() / (last - first) as f64;
        let (now, time_s) = (&all[first + (last - first) / 2], 0.5 * (from_s + to_s));
        let value = mean + noise_w * chance.normal();
        let [x, y, z] = now.at;
        text += &match tied {
            Tied::Position => format!("{time_s:.3},{x:.3},{y:.3},{z:.3},{value:.3}\n"),
            Tied::Line => format!("{time_s:.3},{},{value:.3}\n", now.line),
            Tied::Time => format!("{time_s:.3},{value:.3}\n"),
        };
        first = last;
    }
    (text, noise_w)
}
