//! The diagnosis on the logs of a second generator (`common/plain_cuts.rs`), which the learner was not developed on: what is
//! hidden is named and nothing else, by position, by line and by time and load alone; what is in no list is no name.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

mod common {
    pub mod follow;
    pub mod plain_cuts;
}

use common::plain_cuts::{Hidden, Program, SETUP, Tied, log, pocket, rows};
use feedwright::learn::program::simulated::simulate;
use feedwright::learn::report::LearnReport;
use feedwright::learn::session::{LogOptions, run};
use feedwright::machine::Job;
use std::path::Path;

/// What is said of a log with 3 % of noise, and its held-out error over the noise.
fn diagnosed(program: &Program, hidden: &[Hidden], tied: Tied, seed: u64) -> (LearnReport, f64) {
    let (job, _) = feedwright::setup::load(SETUP, Path::new(".")).unwrap();
    let (text, noise_w) = log(program, hidden, tied, 0.03, seed);
    let learned = run(program.text.as_bytes(), &job, text.as_bytes(), &LogOptions::default(), None)
        .unwrap_or_else(|e| panic!("{e}"));
    let over_noise = learned.report.final_test.rmse / noise_w;
    let names: Vec<&str> = learned.report.effects.iter().map(|e| e.name.as_str()).collect();
    println!("{hidden:?} {tied:?}: {names:?}, {over_noise:.2} of the noise");
    (learned.report, over_noise)
}

/// These names and no other, with a held-out error near the noise.
fn is_named(program: &Program, hidden: &[Hidden], tied: Tied, expected: &[&str]) {
    let (report, over_noise) = diagnosed(program, hidden, tied, 7);
    let mut names: Vec<&str> = report.effects.iter().map(|e| e.name.as_str()).collect();
    names.sort_unstable();
    assert_eq!(names, expected, "{hidden:?} {tied:?}: {}", report.verdict);
    assert!(over_noise < 1.15, "{hidden:?} {tied:?}: {over_noise}");
}

#[test]
fn nothing_is_added_where_nothing_is_hidden() {
    for tied in [Tied::Position, Tied::Line, Tied::Time] {
        is_named(&rows(), &[], tied, &[]);
    }
    is_named(&pocket(), &[], Tied::Position, &[]);
}

#[test]
fn what_is_hidden_is_named_by_position() {
    let rows = rows();
    let named = |hidden: Hidden, name: &str| is_named(&rows, &[hidden], Tied::Position, &[name]);
    named(Hidden::Wear(1.5), "flank-wear");
    named(Hidden::WarmUp(40.0), "tare-warm-up");
    named(Hidden::TareSpeed(1.5), "tare-speed");
    named(Hidden::Up(0.22), "up-down-asymmetry");
    named(Hidden::Proud(0.5), "stock-proud");
    named(Hidden::Drive(3.5e-4), "drive-efficiency");
    named(Hidden::Lag(0.35), "sensor-lag");
    named(Hidden::Slab([35.0, 60.0], 0.25), "hard-zone");
    named(Hidden::Disc([60.0, 25.0], 18.0, 0.3), "hard-zone");
}

#[test]
fn and_in_another_program_by_line() {
    let (rows, pocket) = (rows(), pocket());
    is_named(&rows, &[Hidden::Wear(1.5)], Tied::Line, &["flank-wear"]);
    is_named(&rows, &[Hidden::Proud(0.5)], Tied::Line, &["stock-proud"]);
    is_named(&rows, &[Hidden::Drive(3.5e-4)], Tied::Line, &["drive-efficiency"]);
    is_named(&pocket, &[Hidden::WarmUp(40.0)], Tied::Line, &["tare-warm-up"]);
    is_named(&pocket, &[Hidden::Slab([35.0, 60.0], 0.25)], Tied::Line, &["hard-zone"]);
}

/// Wear is only asked to be among the names: by its time alone that log is matched as if the meter lagged, and a lag is named
/// beside it.
#[test]
fn and_by_its_time_alone() {
    let (rows, pocket) = (rows(), pocket());
    is_named(&rows, &[Hidden::Proud(0.5)], Tied::Time, &["stock-proud"]);
    is_named(&rows, &[Hidden::Drive(3.5e-4)], Tied::Time, &["drive-efficiency"]);
    is_named(&pocket, &[Hidden::WarmUp(40.0)], Tied::Time, &["tare-warm-up"]);
    is_named(&pocket, &[Hidden::Slab([35.0, 60.0], 0.25)], Tied::Time, &["hard-zone"]);
    let (report, _) = diagnosed(&rows, &[Hidden::Wear(1.5)], Tied::Time, 7);
    assert!(report.effects.iter().any(|e| e.name == "flank-wear"), "{}", report.verdict);
}

#[test]
fn two_at_once_are_both_named() {
    let both = [Hidden::Wear(1.5), Hidden::Slab([35.0, 60.0], 0.25)];
    is_named(&rows(), &both, Tied::Position, &["flank-wear", "hard-zone"]);
}

/// Where the edge chips in a stretch that is held out nobody who has not seen it knows when: the error is not asked for.
#[test]
fn a_chipped_edge_is_named() {
    let (report, _) = diagnosed(&rows(), &[Hidden::Chipped(0.55, 1.18)], Tied::Position, 7);
    assert_eq!(report.effects.iter().map(|e| e.name.as_str()).collect::<Vec<_>>(), ["edge-chipping"]);
}

#[test]
fn what_is_in_no_list_is_unexplained() {
    let (report, over_noise) = diagnosed(&rows(), &[Hidden::Pump(60.0)], Tied::Position, 7);
    assert!(report.effects.is_empty() && report.unexplained.is_some(), "{}", report.verdict);
    assert!(over_noise > 1.5, "{over_noise}");
}

/// What the guide of an axis takes grows along it, whatever is cut: no effect of the list, and a curve over X.
#[test]
fn what_is_in_no_list_and_follows_a_covariate_is_learned_without_a_name() {
    let (report, over_noise) = diagnosed(&rows(), &[Hidden::Slide(0.4)], Tied::Position, 7);
    assert!(report.effects.is_empty() && report.unexplained.is_some(), "{}", report.verdict);
    let curve = &report.unnamed[0];
    assert_eq!((curve.covariate.as_str(), curve.multiplies.as_str()), ("position x", "tare"), "{}", report.verdict);
    assert!(curve.added.test_rmse_after < 0.8 * curve.added.test_rmse_before && over_noise < 1.1, "{over_noise}");
}

/// An override and a hold are found, listed and taken out: with them the coefficients are those without, to a percent.
#[test]
fn an_override_and_a_hold_are_events_and_no_effect() {
    let k_tc = |report: &LearnReport| report.final_base.iter().find(|v| v.name == "k_tc").unwrap().value;
    let (plain, _) = diagnosed(&rows(), &[], Tied::Position, 7);
    let turned_down = [Hidden::Override([0.3, 0.6], 0.7), Hidden::Held(0.8, 12.0)];
    let (report, over_noise) = diagnosed(&rows(), &turned_down, Tied::Position, 7);
    assert!(report.effects.is_empty() && report.unnamed.is_empty() && over_noise < 1.15, "{}", report.verdict);
    let deviation = k_tc(&report) / k_tc(&plain) - 1.0;
    assert!(deviation.abs() < 0.01, "{deviation}");
    let ratios: Vec<f64> = report.events.iter().map(|event| event.ratio).collect();
    assert!(ratios.iter().any(|r| (r - 0.7).abs() < 0.02) && ratios.contains(&0.0), "{:?}", report.events);
}

/// The columns of a log as text, row by row, changed.
fn changed(text: &str, change: impl Fn(&[String], &mut [String])) -> String {
    let mut names: Vec<String> = Vec::new();
    let mut out = String::new();
    for line in text.lines() {
        let cells: Vec<&str> = line.split(',').collect();
        let mut row: Vec<String> = cells.iter().map(|cell| (*cell).to_owned()).collect();
        if names.is_empty() {
            names.clone_from(&row);
        } else {
            change(&names, &mut row);
        }
        out += &(row.join(",") + "\n");
    }
    out
}

#[test]
fn a_log_in_machine_coordinates_is_learned_from_as_one_in_the_work_frame() {
    let program = rows();
    let (job, _) = feedwright::setup::load(SETUP, Path::new(".")).unwrap();
    let (text, noise_w) = log(&program, &[Hidden::Wear(1.5)], Tied::Position, 0.03, 7);
    let shift = [("x_mm", -412.35), ("y_mm", 218.4), ("z_mm", -164.02)];
    let machine = changed(&text, |names, row| {
        for (name, by) in shift {
            let k = names.iter().position(|n| *n == name).unwrap();
            row[k] = format!("{:.4}", row[k].parse::<f64>().unwrap() + by);
        }
    });
    let learned = run(program.text.as_bytes(), &job, machine.as_bytes(), &LogOptions::default(), None).unwrap();
    let report = learned.report;
    assert!(
        report.warnings.iter().any(|w| w.contains("X -412.3") && w.contains("Z -164.0") && w.contains("taken off")),
        "{:?}",
        report.warnings
    );
    let names: Vec<&str> = report.effects.iter().map(|e| e.name.as_str()).collect();
    assert_eq!((names, report.final_test.rmse < 1.15 * noise_w), (vec!["flank-wear"], true), "{}", report.verdict);
}

#[test]
fn a_log_without_a_load_tells_how_the_machine_moves() {
    let setup = SETUP.replace("acceleration = 100000", "acceleration = 3000");
    let (declared, _) = feedwright::setup::load(&setup, Path::new(".")).unwrap();
    let program = rows();
    // What a machine with a twentieth of the acceleration passes when, every tenth of a second.
    let logged = |factor: f64| {
        let slow = Job { machine: declared.machine.with_acceleration(factor), ..declared.clone() };
        let prepared = simulate(program.text.as_bytes(), &slow, false).unwrap();
        let timeline = prepared.timeline();
        let mut text = String::from("time_s,x_mm,y_mm,z_mm\n");
        for sample in 0..(10.0 * timeline.total_s()) as usize {
            let time = 0.1 * sample as f64;
            let spot = &timeline.spots[timeline.at(time).unwrap()];
            let share = (time - spot.start_s) / (spot.end_s - spot.start_s).max(1e-9);
            let p = spot.from + (spot.to - spot.from) * share.clamp(0.0, 1.0);
            text += &format!("{time:.1},{:.3},{:.3},{:.3}\n", p.x, p.y, p.z);
        }
        run(program.text.as_bytes(), &declared, text.as_bytes(), &LogOptions::default(), None).unwrap().report
    };
    let report = logged(0.05);
    let found = report.effects.iter().find(|e| e.name == "corner-feed").map(|e| e.parameters[0].value);
    assert!(found.is_some_and(|factor| (0.04..0.0625).contains(&factor)), "{found:?} {}", report.verdict);
    assert!(report.supports_model && report.final_test.rmse < 0.5 * report.base_test.rmse, "{}", report.verdict);
    // The machine as declared: nothing to learn, and no model.
    let report = logged(1.0);
    assert!(report.effects.is_empty() && !report.supports_model, "{}", report.verdict);
    // A log that tells neither loads nor places is refused as before.
    let text = "time_s,spindle_rpm\n".to_owned() + &(0..40).map(|i| format!("{i},1000\n")).collect::<String>();
    let refused = run(program.text.as_bytes(), &declared, text.as_bytes(), &LogOptions::default(), None);
    assert!(refused.unwrap_err().to_string().contains("spindle_power_w"));
}

/// A log as a meter writes it that gives the mean of its last interval, beside the position at the end of it.
fn as_means(text: &str) -> String {
    let mut lines = text.lines();
    let head = lines.next().unwrap();
    let at = head.split(',').position(|name| name == "spindle_power_w").unwrap();
    let mut before: Option<f64> = None;
    let row = |line: &str| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        let own: f64 = cells[at].parse().unwrap();
        cells[at] = format!("{:.3}", 0.5 * (own + before.replace(own).unwrap_or(own)));
        cells.join(",") + "\n"
    };
    format!("{head}\n") + &lines.map(row).collect::<String>()
}

#[test]
fn readings_that_are_means_of_the_last_interval_hide_nothing() {
    let (job, _) = feedwright::setup::load(SETUP, Path::new(".")).unwrap();
    for program in [rows(), pocket()] {
        let (text, _) = log(&program, &[], Tied::Position, 0.03, 7);
        let learned =
            run(program.text.as_bytes(), &job, as_means(&text).as_bytes(), &LogOptions::default(), None).unwrap();
        let report = learned.report;
        let names: Vec<&str> = report.effects.iter().map(|effect| effect.name.as_str()).collect();
        assert!(names.is_empty() && report.unnamed.is_empty(), "{}", report.verdict);
        let times: Vec<f64> =
            text.lines().skip(1).take(2).map(|row| row.split(',').next().unwrap().parse().unwrap()).collect();
        let later = report.alignment.unwrap().read_later_s / (times[1] - times[0]);
        assert!((-0.75..-0.25).contains(&later), "{later} of an interval");
    }
}
