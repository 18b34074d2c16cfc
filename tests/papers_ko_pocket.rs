//! Ko, Yun, Cho: their pocket (axial depth 5 mm, radial depth 3 mm, 1000 rev/min, 150 mm/min) as an NC program, optimised
//! for a mean normal force of 100 N and simulated again.
//!
//! Paper: largest surface error 118 µm before, 47 µm after. PAPERS.md: feeds 132 mm/min along the sides and 51 in the
//! corners, ratio of the errors 0.35–0.40. Where the paper is silent: climb milling, each force normalised by the chip
//! range of its own cut, and the overhang that the surface of Test 3 calibrates.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use assert_cmd::Command;
use std::fs;

/// Lines 1–21 rough the pocket to 3 mm from its wall; then it goes once round, a block along each side and one into each corner.
const PROGRAM: &str = "(pocket)\nG21 G90 G17 G94\nT1 M6\nS1000 M3\nG0 X0 Y0 Z5\nG1 Z-5 F60\nG1 X22 F150\nG1 Y12\nG1 X-22\nG1 Y-12\n\
    G1 X22\nG1 Y0\nG1 X16\nG1 Y6\nG1 X-16\nG1 Y-6\nG1 X16\nG1 Y0\nG1 X8\nG1 X-8\nG1 X22\nG1 X25 F150\nG1 Y7\nG1 Y15\n\
    G1 X-17\nG1 X-25\nG1 Y-7\nG1 Y-15\nG1 X17\nG1 X25\nG1 Y0\nG0 Z5\nM30\n";

const SETUP: &str = r#"
[machine]
rapid = 15000
[machine.axes]
x = { velocity = 15000, acceleration = 1500 }
y = { velocity = 15000, acceleration = 1500 }
z = { velocity = 12000, acceleration = 1200 }
[machine.spindle]
max_rpm = 4000
[stock]
box = { min = [-40, -30, -10], max = [40, 30, 0] }
[material]
model = "sigmoid"
a1 = 12.9122
a2 = 6.73768
x0 = -0.62399
dx = 0.44168
k_f = 0.8287
chip_flow = 0.471
[[tool]]
number = 1
shape = "flat"
diameter = 10
flutes = 4
helix = 30
rake = 11
flute_length = 37.85
overhang = 37.85
material = "hss"
runout = { offset = 0.006, angle = 95 }
# This is about something else than what may rise.
[raise]
plunges = true
ramps = true
entries = true
finishing = true
compensation = true
cycles = true
[limits]
feed_change = { min = 0.1, max = 2.0 }
[[operation]]
match = { lines = [1, 21] }
mode = "keep"
[[operation]]
match = { lines = [22, 31] }
limits = { force_normal_mean = 100 }
[output]
minimum_change = 0
minimum_length = 0.1
"#;

/// What is known of a place of the finishing pass, before and after.
struct Place {
    line: u32,
    /// Engaged angle, degrees.
    immersion_deg: f64,
    feed_mm_min: [f64; 2],
    force_normal_mean_n: [f64; 2],
    surface_error_um: [f64; 2],
}

/// The four sides with the corners at their ends, as `optimize --csv` tells them.
fn finishing() -> Vec<Place> {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("pocket.nc"), PROGRAM).unwrap();
    fs::write(path("pocket.setup.toml"), SETUP).unwrap();
    let mut command = Command::cargo_bin("feedwright").unwrap();
    command.arg("optimize").arg(path("pocket.nc")).arg("--csv").arg(path("pocket.csv")).assert().code(0);
    let mut table = csv::Reader::from_path(path("pocket.csv")).unwrap();
    let header = table.headers().unwrap().clone();
    let mut places = Vec::new();
    for row in table.records().map(Result::unwrap) {
        let value = |name: &str| {
            let column = header.iter().position(|head| head == name).unwrap_or_else(|| panic!("no column {name}"));
            row[column].split(';').next().unwrap().parse::<f64>().unwrap_or(0.0)
        };
        let pair = |name: &str| [value(&format!("{name}_before")), value(&format!("{name}_after"))];
        places.push(Place {
            line: value("line") as u32,
            immersion_deg: value("exit_deg") - value("entry_deg"),
            feed_mm_min: [value("feed_before_mm_min"), value("feed_after_mm_min")],
            force_normal_mean_n: pair("force_normal_mean_n"),
            surface_error_um: pair("surface_error_mm").map(|error| 1e3 * error),
        });
    }
    places.retain(|place| (23..=30).contains(&place.line));
    places
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

#[test]
fn the_mean_normal_force_is_held_along_the_sides_and_in_the_corners() {
    let places = finishing();
    let steady = |place: &&Place| (place.immersion_deg - 66.42).abs() < 0.1 || place.immersion_deg > 156.0;
    let along: Vec<&Place> = places.iter().filter(steady).collect();
    assert_eq!(along.iter().filter(|place| place.immersion_deg > 156.0).count(), 4, "four corners");
    assert_eq!(along.len(), 8, "four sides and four corners");
    for place in &along {
        let [before, after] = place.force_normal_mean_n;
        let [expected, feed] = if place.immersion_deg < 100.0 { [113.0, 132.0] } else { [282.0, 51.0] };
        println!("line {}: {before:.1} -> {after:.2} N at {} mm/min", place.line, place.feed_mm_min[1]);
        assert!((before / expected - 1.0).abs() < 0.01, "line {}: {before} N as programmed", place.line);
        assert!((after - 100.0).abs() <= 1.0, "line {}: {after} N", place.line);
        assert!((place.feed_mm_min[1] / feed - 1.0).abs() < 0.015, "line {}: F{}", place.line, place.feed_mm_min[1]);
    }
    // On the way into a corner the force changes within a station: it never goes above.
    let highest = largest(places.iter().map(|place| place.force_normal_mean_n[1]));
    assert!(highest <= 101.0, "{highest} N");
}

#[test]
fn the_surface_error_falls_as_in_the_paper() {
    let places = finishing();
    let before = largest(places.iter().map(|place| place.surface_error_um[0]));
    let after = largest(places.iter().map(|place| place.surface_error_um[1]));
    println!("largest surface error {before:.1} -> {after:.1} um (paper: 118 -> 47)");
    assert!((80.0..=120.0).contains(&before), "{before} µm before");
    assert!((30.0..=50.0).contains(&after), "{after} µm after");
    assert!((0.35..=0.40).contains(&(after / before)), "ratio {}", after / before);
}

/// The wall in space: its points lie on the walls of the pocket, at every height of the cut, and stand off it as the paper's
/// surface does.
#[test]
fn the_surface_map_lies_on_the_walls() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("pocket.nc"), PROGRAM).unwrap();
    fs::write(folder.path().join("pocket.setup.toml"), SETUP).unwrap();
    let mut command = Command::cargo_bin("feedwright").unwrap();
    let output = command.current_dir(folder.path()).args(["dump", "surface", "pocket.nc"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let rows: Vec<Vec<f64>> =
        text.lines().skip(1).map(|row| row.split('\t').map(|field| field.parse().unwrap()).collect()).collect();
    // The side x = 30, away from the corners.
    let side: Vec<&Vec<f64>> = rows.iter().filter(|row| row[0] == 23.0 && row[2] > 0.0 && row[2] < 7.0).collect();
    assert!(side.len() >= 8, "{} points", side.len());
    let (mut low, mut high, mut errors) = (f64::INFINITY, f64::NEG_INFINITY, Vec::new());
    for row in side {
        assert!((row[1] - 30.0).abs() < 1e-3, "x = {}", row[1]);
        (low, high) = (low.min(row[3]), high.max(row[3]));
        errors.push(1e3 * row[4]);
    }
    assert!(low < -4.7 && high > -0.3, "heights {low} to {high}");
    let most = errors.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    println!("side wall: up to {most:.1} um");
    assert!(most > 5.0 && most < 60.0, "{most} µm");
}
