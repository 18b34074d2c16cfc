//! Measured data that cannot be what they are said to be: each is recognised, said in one clear message, and no model file
//! is written. The good log beside them is made by closed forms on a program of test cuts.

#![allow(clippy::format_collect, clippy::unwrap_used)]

mod common {
    pub mod follow;
}

use assert_cmd::Command;
use common::follow::{At, Noise, SETUP, follow, job, log};
use feedwright::learn::calibrate::plan::{Kind, plan};
use std::fmt::Write;
use std::path::PathBuf;
use std::sync::OnceLock;
use tempfile::TempDir;

/// Power of a flat cut with other coefficients than the setup's.
fn power(s: &At) -> f64 {
    s.cut.map_or(310.0, |(axial, radial)| {
        let theta = (1.0 - radial / 5.0f64).acos();
        310.0 + 1e-3 * (900.0 * axial * radial * s.feed_mm_s + 21.0 * axial * 5.0 * theta * 3.0 * s.rps)
    })
}

fn program() -> &'static str {
    static TEXT: OnceLock<String> = OnceLock::new();
    TEXT.get_or_init(|| plan(Kind::Power, &job()).unwrap().program)
}

/// Every tenth reading of the run: five a second.
fn samples(program: &str) -> Vec<At> {
    follow(program, 5.0).into_iter().step_by(10).collect()
}

fn good() -> String {
    let mut noise = Noise(7);
    log(&samples(program()), "spindle_power_w", |s| format!("{:.1}", power(s) + 20.0 * noise.normal()))
}

struct Bench(TempDir);

impl Bench {
    fn new(log: &str) -> Self {
        let bench = Self(tempfile::tempdir().unwrap());
        for (name, text) in [("part.nc", program()), ("part.setup.toml", SETUP), ("log.csv", log)] {
            std::fs::write(bench.path(name), text).unwrap();
        }
        bench
    }
    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
    /// Everything that is said, and whether a model file was written.
    fn run(&self, arguments: &[&str]) -> (String, bool, i32) {
        let mut command = Command::cargo_bin("feedwright").unwrap();
        let output = command.current_dir(self.0.path()).args(arguments).output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
        (said, self.path("model.toml").exists(), output.status.code().unwrap())
    }
}

const LEARN: [&str; 6] = ["learn", "part.nc", "--log", "log.csv", "-o", "model.toml"];
const CALIBRATE: [&str; 6] = ["calibrate", "log.csv", "--setup", "part.setup.toml", "-o", "model.toml"];

/// Runs `learn` and expects `words` and no model.
fn doubted(what: &str, log: &str, words: &[&str]) {
    refused(what, log, &LEARN, words);
}

fn refused(what: &str, log: &str, arguments: &[&str], words: &[&str]) {
    let (said, written, code) = Bench::new(log).run(arguments);
    assert!(!written, "{what}: a model was written\n{said}");
    assert!(code == 2 || said.contains("no model"), "{what}: {code}\n{said}");
    for word in words {
        assert!(said.contains(word), "{what}: `{word}` is not in\n{said}");
    }
}

/// A log with one column changed; `change` sees the place of the row, from 0 to 1, and the cell.
fn with(log: &str, column: usize, mut change: impl FnMut(f64, f64) -> String) -> String {
    let count = log.lines().count() as f64;
    let mut out = String::new();
    for (k, line) in log.lines().enumerate() {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if k > 0 {
            cells[column] = change(k as f64 / count, cells[column].parse().unwrap());
        }
        let _ = writeln!(out, "{}", cells.join(","));
    }
    out
}

#[test]
fn a_good_log_gives_a_model() {
    let (said, written, code) = Bench::new(&good()).run(&LEARN);
    assert!(written && code == 0, "{said}");
    let (said, written, code) =
        Bench::new(&good()).run(&["calibrate", "part.nc", "--log", "log.csv", "-o", "model.toml"]);
    assert!(written && code == 0, "{said}");
}

/// Times have no r²: its cell is empty, not NaN.
#[test]
fn a_log_without_a_load_has_a_report_without_odd_numbers() {
    let bench = Bench::new(&good().replacen("spindle_power_w", "spindle_temperature", 1));
    let (said, ..) = bench.run(&[&LEARN[..], &["--report", "page.html"]].concat());
    assert!(said.contains("only the times of the machine are learned"), "{said}");
    let page = std::fs::read_to_string(bench.path("page.html")).unwrap();
    assert!(page.contains("with effects, held out") && !page.contains("NaN"), "{page}");
}

#[test]
fn logs_without_a_signal() {
    doubted("empty file", "", &["no samples"]);
    doubted("header only", "time_s,spindle_power_w\n", &["without rows"]);
    let log = good();
    doubted("constant", &with(&log, 5, |_, _| "412.0".into()), &["is constant", "sensor"]);
    doubted("NaN", &with(&log, 5, |_, _| "NaN".into()), &["holds no reading"]);
    let mut k = 0;
    let sparse = with(&log, 5, |_, y| {
        k += 1;
        if k % 10 == 0 { y.to_string() } else { String::new() }
    });
    doubted("90 % missing", &sparse, &["% of spindle_power_w are missing"]);
}

#[test]
fn clocks_that_cannot_be() {
    let log = good();
    let end = log.lines().count() as f64 / 5.0;
    doubted("backwards", &with(&log, 0, |_, t| (end - t).to_string()), &["backwards"]);
    doubted("standing", &with(&log, 0, |_, _| "3".into()), &["stands still"]);
    doubted("milliseconds", &with(&log, 0, |_, t| (1000.0 * t).to_string()), &["log lasts", "unit of its time"]);
    doubted("no times", &with(&log, 0, |_, t| format!("{t} seconds")), &["no cell of the times can be read"]);
    let alone = |unit: f64, every: usize| -> String {
        let rows = log.lines().skip(1).step_by(every).map(|line| line.split(',').collect::<Vec<&str>>());
        let rows = rows.map(|cells| format!("{:.6},{}\n", unit * cells[0].parse::<f64>().unwrap(), cells[5]));
        "time_s,spindle_power_w\n".to_owned() + &rows.collect::<String>()
    };
    doubted("minutes, the load alone", &alone(1.0 / 60.0, 1), &["the log lasts", "unit of its time"]);
    doubted("a reading a second", &alone(1.0, 5), &["1.00 s apart, too far"]);
}

/// The rows of a log with other times, as cells.
fn later(log: &str, by_s: f64) -> String {
    let rows = log.lines().skip(1).map(|line| line.split_once(',').unwrap());
    rows.map(|(time, rest)| format!("{:.3},{rest}\n", time.parse::<f64>().unwrap() + by_s)).collect()
}

fn last_s(log: &str) -> f64 {
    log.lines().last().unwrap().split(',').next().unwrap().parse().unwrap()
}

/// A coefficient that was printed.
fn printed(said: &str, name: &str) -> f64 {
    let line =
        said.lines().find(|line| line.trim().starts_with(&format!("{name} = "))).unwrap_or_else(|| panic!("{said}"));
    line.split_whitespace().nth(2).unwrap().parse().unwrap()
}

/// Learns from a log, expects these words and the coefficient that was put in, within so much, N/mm².
fn within(most: f64, what: &str, log: &str, words: &[&str]) {
    let (said, written, code) = Bench::new(log).run(&LEARN);
    assert!(written && code == 0, "{what}: {said}");
    assert!((printed(&said, "k_tc") - 900.0).abs() < most, "{what}: {said}");
    for word in words {
        assert!(said.contains(word), "{what}: `{word}` is not in\n{said}");
    }
}

fn as_good(what: &str, log: &str, words: &[&str]) {
    within(30.0, what, log, words);
}

#[test]
fn a_log_of_two_parts_is_read_as_that_of_one() {
    let log = good();
    let end_s = last_s(&log);
    let twice = log.clone() + &later(&log, end_s + 25.0);
    as_good("two parts", &twice, &["the program runs 2 times in this log", "that from 0.0 s on is used"]);
    as_good(
        "the clock begins again",
        &(log.clone() + &later(&log, 0.07)),
        &["the clock begins again at row", "runs 2 times"],
    );
    let bench = Bench::new(&twice);
    let (said, written, _) = bench.run(&["calibrate", "part.nc", "--log", "log.csv", "-o", "model.toml"]);
    assert!(written && said.contains("runs 2 times"), "{said}");
    let (said, ..) = bench.run(&["evaluate", "model.toml", "part.nc", "--log", "log.csv"]);
    assert!(said.contains("runs 2 times") && !said.contains("less of these data"), "{said}");
}

#[test]
fn a_log_of_two_parts_with_the_load_alone_is_read_as_that_of_one() {
    let times_and_loads = |log: &str| -> String {
        let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<String>>();
        log.lines().map(cells).map(|cells| format!("{},{}\n", cells[0], cells[5])).collect()
    };
    let log = times_and_loads(&good());
    let twice = log.clone() + &later(&log, last_s(&log) + 25.0);
    as_good("two parts", &twice, &["the program runs 2 times in this log"]);
}

#[test]
fn positions_that_are_missing_or_old_are_those_between_the_others() {
    let log = good();
    let rows: Vec<Vec<&str>> = log.lines().map(|line| line.split(',').collect()).collect();
    let text = |cell: &dyn Fn(usize, usize) -> String| -> String {
        let row = |k: usize| (0..6).map(|c| cell(k, c)).collect::<Vec<String>>().join(",") + "\n";
        (0..rows.len()).map(row).collect()
    };
    let is_position = |c: usize| (1..4).contains(&c);
    let old = |k: usize, c: usize| rows[if k > 0 && is_position(c) { 1 + (k - 1) / 3 * 3 } else { k }][c].to_owned();
    // Where the tool turned between two of them, its way was longer than the straight one.
    within(45.0, "old", &text(&old), &["positions stay the same for 3 readings"]);
    let empty = |k: usize, c: usize| {
        if k > 0 && is_position(c) && (7 * k + c).is_multiple_of(10) { String::new() } else { rows[k][c].to_owned() }
    };
    as_good("empty", &text(&empty), &["positions are empty"]);
}

#[test]
fn a_log_in_machine_coordinates_or_with_spikes_is_calibrated_and_one_of_another_program_is_not() {
    let calibrate = ["calibrate", "part.nc", "--log", "log.csv", "-o", "model.toml"];
    let shifted = with(&good(), 1, |_, x| (x - 412.3).to_string());
    let (said, written, _) = Bench::new(&shifted).run(&calibrate);
    assert!(written && said.contains("machine coordinates"), "{said}");
    let mut k = 0;
    let spiky = with(&good(), 5, |_, y| {
        k += 1;
        if k % 400 == 0 { "20000".into() } else { y.to_string() }
    });
    as_good("spikes", &spiky, &["of a single reading", "beyond all other readings", "left out"]);
    let mut noise = Noise(8);
    let other = plan(Kind::MeanForce, &job()).unwrap().program;
    let wrong = log(&samples(&other), "spindle_power_w", |s| format!("{:.1}", power(s) + noise.normal()));
    refused("another program", &wrong, &calibrate, &["do not fit this program"]);
}

#[test]
fn columns_and_units_that_are_wrong() {
    let log = good();
    doubted("kilowatts", &with(&log, 5, |_, y| (0.001 * y).to_string()), &["units"]);
    doubted("milliwatts", &with(&log, 5, |_, y| (1000.0 * y).to_string()), &["units"]);
    doubted("metres", &with(&log, 1, |_, x| (0.001 * x).to_string()), &["units"]);
    let named = |from: &str, to: &str| log.replacen(from, to, 1);
    doubted("x and y swapped", &named("x_mm,y_mm", "y_mm,x_mm"), &["do not fit this program"]);
    doubted("speed and power swapped", &named("spindle_rpm,spindle_power_w", "spindle_power_w,spindle_rpm"), &[]);
    doubted(
        "time and power swapped",
        &log.replacen("time_s", "p", 1).replacen("spindle_power_w", "time_s", 1).replacen("p,", "spindle_power_w,", 1),
        &["clock"],
    );
}

#[test]
fn forces_in_other_units() {
    // About what a tooth of the cut takes at its thickest chip, and no prediction of it.
    let force = |s: &At| {
        let chip = s.feed_mm_s / (3.0 * s.rps);
        s.cut.map_or(0.0, |(axial, radial)| 1.2 * axial * (900.0 * chip * (radial / 10.0).min(0.5) * 2.0 + 21.0))
    };
    let samples = samples(program());
    for (unit, what) in [(1e-3, "kilonewtons"), (1e3, "millinewtons")] {
        let mut noise = Noise(9);
        let text = log(&samples, "force_xy_n", |s| format!("{:.6}", unit * (force(s) + 5.0 * noise.normal()).abs()));
        doubted(what, &text, &["units"]);
    }
}

#[test]
fn logs_of_something_else() {
    let other = plan(Kind::MeanForce, &job()).unwrap().program;
    let mut noise = Noise(8);
    let wrong = log(&samples(&other), "spindle_power_w", |s| format!("{:.1}", power(s) + 20.0 * noise.normal()));
    doubted("another program", &wrong, &["do not fit this program"]);
    let log = good();
    let lines: Vec<&str> = log.lines().collect();
    let short: String = lines[..lines.len() / 5].iter().map(|l| format!("{l}\n")).collect();
    doubted("a fifth of the program", &short, &["covers only"]);
    let few: String = lines[..15].iter().map(|l| format!("{l}\n")).collect();
    doubted("a few samples", &few, &["20 are the least"]);
}

/// A table of steady cuts by closed forms, its power multiplied and its feed's unit shifted.
fn table(power_unit: f64, depth_unit: f64) -> String {
    let mut text =
        String::from("group,tool,spindle_rpm,feed_mm_min,axial_depth_mm,radial_depth_mm,side,spindle_power_w\n");
    for (k, radial) in [1.0, 2.5, 5.0, 10.0].into_iter().enumerate() {
        for feed in [300.0, 600.0, 900.0] {
            let s =
                At { time_s: 0.0, position: [0.0; 3], rps: 100.0, feed_mm_s: feed / 60.0, cut: Some((3.0, radial)) };
            let wobble = 1.0 + 0.01 * ((k * 7 + feed as usize) % 5) as f64;
            let _ = writeln!(
                text,
                "g{k},1,6000,{feed},{},{},down,{}",
                3.0 * depth_unit,
                radial * depth_unit,
                power(&s) * wobble * power_unit
            );
        }
    }
    text
}

#[test]
fn tables_that_cannot_be() {
    let learn = ["learn-table", "log.csv", "--setup", "part.setup.toml", "-o", "model.toml"];
    for arguments in [&CALIBRATE, &learn] {
        let (said, written, _) = Bench::new(&table(1.0, 1.0)).run(arguments);
        assert!(written, "{said}");
        let check = |what: &str, text: &str, words: &[&str]| refused(what, text, arguments, words);
        check("empty", "", &["empty"]);
        check("header only", table(1.0, 1.0).lines().next().unwrap(), &["without rows"]);
        check("kilowatts", &table(1e-3, 1.0), &["units"]);
        check("depths in metres", &table(1.0, 1e-3), &["units"]);
        check("constant", &with(&table(1.0, 1.0), 7, |_, _| "412".into()), &["constant"]);
        check("NaN", &with(&table(1.0, 1.0), 7, |_, _| "NaN".into()), &["spindle_power_w"]);
        let most = with(&table(1.0, 1.0), 7, |place, y| if place < 0.7 { String::new() } else { y.to_string() });
        check("most missing", &most, &["missing"]);
        let swapped = table(1.0, 1.0)
            .replacen("feed_mm_min", "p", 1)
            .replacen("spindle_power_w", "feed_mm_min", 1)
            .replacen(",p,", ",spindle_power_w,", 1);
        check("feed and power swapped", &swapped, &[]);
        let three: String = table(1.0, 1.0).lines().take(4).map(|l| format!("{l}\n")).collect();
        check("three cuts", &three, &[]);
    }
}
