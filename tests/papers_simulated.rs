//! Xu, Jerard, Fussell, Tables 4 and 5, as NC programs: text → moves → engagement → forces, against closed forms and the
//! printed estimates.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

mod common {
    pub mod papers;
}

use common::papers::{Row, number, table};
use feedwright::engage::{EngagementMap, Options, Station, engage};
use feedwright::force::closed::{Rates, SteadyCut, rates};
use feedwright::force::{Cut, Cutter};
use feedwright::ids::MoveId;
use feedwright::machine::{Job, Shape};
use feedwright::nc::{Environment, Toolpath, interpret, parse};
use std::path::Path;

/// Removal rate, contact rate and power in the steady part of a move.
struct Found {
    rates: Rates,
    power_w: f64,
}

struct Part {
    toolpath: Toolpath,
    map: EngagementMap,
    job: Job,
}

fn simulate(program: &str, setup: &str) -> Part {
    let (job, _) = feedwright::setup::load(setup, Path::new(".")).expect("a sound setup");
    let program = parse(program.as_bytes().to_vec(), None);
    let toolpath = interpret(&program, &Environment::from_job(&job));
    let options = Options { spacing_mm: 2.0, ..Options::default() };
    let map = engage(&toolpath, &job, &options, &|_| {}).expect("engagement");
    Part { toolpath, map, job }
}

impl Part {
    /// Averages over the last feed move between two shares of its length, at any feed.
    fn steady(&self, [from, to]: [f64; 2], feed_mm_s: f64) -> Found {
        let last = self.toolpath.moves.len() - 1;
        let motion = &self.toolpath.moves[last];
        let tool = &self.job.tools[0];
        let material = self.job.material(tool).expect("a material");
        let slices = self.map.slices_of(tool.number);
        let spindle = &self.job.machine.spindle;
        let cutter =
            Cutter::new(tool, material, spindle, &self.job.process, slices, motion.spin.rps).expect("a cutter");
        let length = motion.curve().length();
        let overlap = |s: &Station| (s.to_mm.min(to * length) - s.from_mm.max(from * length)).max(0.0);
        let mut found = Found { rates: Rates { removal_rate_mm3_s: 0.0, contact_rate_mm2_s: 0.0 }, power_w: 0.0 };
        for station in self.map.stations_of(MoveId(last as u32)).iter().filter(|s| overlap(s) > 0.0) {
            let share = overlap(station) / ((to - from) * length);
            let line = cutter.line(&Cut { arcs: self.map.arcs_of(station), ..Cut::default() });
            found.rates.removal_rate_mm3_s += share * line.removal_area_mm2 * feed_mm_s;
            found.rates.contact_rate_mm2_s += share * line.contact_mm2_per_rev * motion.spin.rps;
            found.power_w += share * line.loads(feed_mm_s).power_w;
        }
        found
    }
}

fn compare(no: &str, found: &Found, expected: Rates, printed_w: f64) {
    let q = found.rates.removal_rate_mm3_s / expected.removal_rate_mm3_s - 1.0;
    let a = found.rates.contact_rate_mm2_s / expected.contact_rate_mm2_s - 1.0;
    eprintln!("row {no}: Q {:+.3} %, A {:+.3} %, P {:+.2} W", 100.0 * q, 100.0 * a, found.power_w - printed_w);
    assert!(q.abs() < 3e-3, "row {no}: removal rate off by {:.3} %", 100.0 * q);
    assert!(a.abs() < 3e-3, "row {no}: contact rate off by {:.3} %", 100.0 * a);
    assert!((found.power_w - printed_w).abs() < 1.5, "row {no}: {} W for {printed_w}", found.power_w);
}

fn setup(shape: &str, diameter: f64, tare_w: f64, [k_tc, k_te]: [f64; 2], stock: &str) -> String {
    format!(
        "[machine.spindle]\nmax_rpm = 5000\ntare = [[0, {tare_w}], [5000, {tare_w}]]\n[stock]\nbox = {stock}\n[material]\n\
         model = \"power\"\nk_tc = {k_tc}\nk_te = {k_te}\n[[tool]]\nnumber = 1\nshape = \"{shape}\"\ndiameter = {diameter}\n\
         flutes = 2\nhelix = 30\nflute_length = 30\nmaterial = \"hss\"\n"
    )
}

#[test]
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn table_4_from_circular_moves() {
    let rows = table("xu2007_table4_circular.csv");
    for set in rows.chunks(4) {
        let radius = number(&set[0], "radius_mm");
        let concave = set[0]["wall"] == "concave";
        let (depth, radial) = (number(&set[0], "axial_mm"), number(&set[0], "radial_mm"));
        // A first circle clears all but the radial depth; the second one makes the cut. Clockwise: up outside, climb inside.
        let first = if concave { radius - radial } else { radius + radial };
        let program = format!(
            "G21 G90 G17 G94\nT1 M6\nS1337 M3\nG0 X{first} Y0 Z5\nG1 Z-{depth} F100\nG2 X{first} Y0 I-{first} J0 F200\n\
             G1 X{radius}\nG2 X{radius} Y0 I-{radius} J0\nM30\n"
        );
        let box3 = "{ min = [-110, -110, -10], max = [110, 110, 0] }";
        let part = simulate(&program, &setup("flat", 25.4, 228.71, [693.8, 18.98], box3));
        for row in set {
            let feed_mm_s = (number(row, "feed_mm_s") / 25.4 * 24.0).round() * 2.5 * 25.4 / 60.0;
            let expected = rates(&SteadyCut {
                diameter_mm: 25.4,
                shape: Shape::Flat,
                axial_depth_mm: depth,
                radial_depth_mm: radial,
                path_radius_mm: Some(if concave { radius } else { -radius }),
                feed_mm_s,
                flutes: 2,
                rps: 1337.0 / 60.0,
            });
            compare(&row["no"], &part.steady([0.25, 0.75], feed_mm_s), expected, number(row, "Pm_est_W"));
        }
    }
}

fn ball_program(row: &Row, radial: f64) -> String {
    let depth = number(row, "axial_used_mm");
    let slot = row["cut"] == "slot";
    let y = if slot { 0.0 } else { radial - 6.35 };
    // The face of the stock at Y0 is the wall; along +X it is to the left (up), along −X to the right (climb).
    let (from, to) = if row["cut"] == "down" { (70, -20) } else { (-20, 70) };
    format!("G21 G90 G17 G94\nT1 M6\nS2100 M3\nG0 X{from} Y{y} Z5\nG0 Z-{depth}\nG1 X{to} F300\nM30\n")
}

#[test]
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn table_5_from_straight_moves() {
    let rows = table("xu2007_table5_ball.csv");
    let mut set: Option<(String, Part)> = None;
    for row in &rows {
        let slot = row["cut"] == "slot";
        let radial = if slot { 12.7 } else { number(row, "radial_used_mm") };
        let stock = if slot {
            "{ min = [0, -30, -20], max = [50, 30, 0] }"
        } else {
            "{ min = [0, 0, -20], max = [50, 40, 0] }"
        };
        if set.as_ref().is_none_or(|(group, _)| *group != row["group"]) {
            let text = setup("ball", 12.7, 247.53, [843.2, 15.10], stock);
            set = Some((row["group"].clone(), simulate(&ball_program(row, radial), &text)));
        }
        let (_, part) = set.as_ref().expect("simulated");
        let expected = rates(&SteadyCut {
            diameter_mm: 12.7,
            shape: Shape::Ball,
            axial_depth_mm: number(row, "axial_used_mm"),
            radial_depth_mm: radial,
            path_radius_mm: None,
            feed_mm_s: number(row, "feed_mm_s"),
            flutes: 2,
            rps: 35.0,
        });
        let found = part.steady([0.45, 0.65], number(row, "feed_mm_s"));
        compare(&row["no"], &found, expected, number(row, "Pm_est_W"));
    }
}
