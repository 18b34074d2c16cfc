//! What was learned is used: a process model with effects that look at the past of the tool, at the place of the cut and at
//! its sense changes the feeds that `optimize` writes, there and only there.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use assert_cmd::Command;
use std::fs;
use std::path::Path;

const SETUP: &str = r#"
[machine]
rapid = 15000
[machine.axes]
x = { velocity = 15000, acceleration = 1500 }
y = { velocity = 15000, acceleration = 1500 }
z = { velocity = 12000, acceleration = 1200 }
[machine.spindle]
max_rpm = 12000
tare = [[0, 100], [12000, 100]]
[stock]
box = { min = [0, 0, -20], max = [200, 120, 0] }
[material]
k_tc = 800
k_rc = 300
k_ac = 100
k_te = 20
k_re = 15
k_ae = 3
[[tool]]
number = 1
shape = "flat"
diameter = 10
flutes = 2
flute_length = 22
# This is about something else than what may rise.
[raise]
plunges = true
ramps = true
entries = true
finishing = true
compensation = true
cycles = true
[limits]
force_xy = 400
feed_change = { max = 20 }
[output]
minimum_change = 0
"#;

/// Blocks of a pass: an F word is worth little more than nothing at their ends.
const BLOCKS: u32 = 11;

/// Eight equal passes of half immersion along X at a depth of 4 mm, all climb, each beginning and ending in air, in blocks of
/// 20 mm.
fn passes() -> String {
    let mut text = String::from("G21 G90 G94\nT1 M6\nS6000 M3\nG0 X210 Y-10 Z5\nG0 Z-4\n");
    for pass in 1..=8 {
        let y = 5.0 * f64::from(pass) - 5.0;
        text += &format!("G0 Y{y}\nG1 X190 F300\n");
        text.extend((0..BLOCKS - 1).map(|block| format!("X{}\n", 170 - 20 * i64::from(block))));
        text += "G0 Z5\nG0 X210\nG0 Z-4\n";
    }
    text + "M30\n"
}

fn optimized(folder: &Path, model: Option<&str>, names: [&str; 3]) -> Vec<Vec<f64>> {
    optimized_with(folder, SETUP, model, names, &[])
}

fn optimized_with(folder: &Path, setup: &str, model: Option<&str>, names: [&str; 3], more: &[&str]) -> Vec<Vec<f64>> {
    fs::write(folder.join("part.nc"), passes()).unwrap();
    fs::write(folder.join("part.setup.toml"), setup).unwrap();
    let mut command = Command::cargo_bin("feedwright").unwrap();
    command.current_dir(folder).args(["optimize", "part.nc", "--force", "--csv", "part.csv"]).args(more);
    if let Some(text) = model {
        fs::write(folder.join("model.toml"), text).unwrap();
        command.args(["--model", "model.toml"]);
    }
    command.assert().code(0);
    let mut table = csv::Reader::from_path(folder.join("part.csv")).unwrap();
    let header = table.headers().unwrap().clone();
    let columns = names.map(|name| header.iter().position(|head| head == name).unwrap());
    let rows = table.records().map(Result::unwrap);
    let values = rows.map(|row| columns.iter().map(|&column| row[column].parse().unwrap_or(0.0)).collect());
    values.collect()
}

/// Mean feed of each pass between two places along X.
fn feeds(model: Option<&str>, [from, to]: [f64; 2]) -> Vec<f64> {
    let folder = tempfile::tempdir().unwrap();
    of_passes(&optimized(folder.path(), model, NAMES), [from, to])
}

const NAMES: [&str; 3] = ["line", "x_mm", "feed_after_mm_min"];

/// Mean of the third column in each pass between two places along X.
fn of_passes(rows: &[Vec<f64>], [from, to]: [f64; 2]) -> Vec<f64> {
    let of = |line: u32| {
        // A station begins at its x and reaches to that of the next, downwards.
        let of_pass = line..line + BLOCKS;
        let starts: Vec<&Vec<f64>> = rows.iter().filter(|row| of_pass.contains(&(row[0] as u32))).collect();
        let within = |pair: &&[&Vec<f64>]| pair[0][1] > from && pair[1][1] < to;
        let found: Vec<f64> = starts.windows(2).filter(within).map(|pair| pair[0][2]).collect();
        assert!(!found.is_empty(), "no station of line {line}");
        found.iter().sum::<f64>() / found.len() as f64
    };
    (0..8).map(|pass| of(7 + (BLOCKS + 4) * pass)).collect()
}

const MIDDLE: [f64; 2] = [20.0, 180.0];

fn ratio(found: f64, expected: f64, what: &str) {
    assert!((found / expected - 1.0).abs() < 0.01, "{what}: {found} for {expected}");
}

#[test]
fn feeds_fall_as_the_edge_wears() {
    let plain = feeds(None, MIDDLE);
    plain[1..].iter().for_each(|feed| ratio(*feed, plain[1], "without wear every pass is alike"));
    let worn = feeds(
        Some(
            "[[effect]]\nname = \"flank-wear\"\nparameters = { growth_per_100m = 0.2, run_in = 0, run_in_length = 0.1, end = 0 }\n",
        ),
        MIDDLE,
    );
    println!("feeds by pass: {plain:.0?} without wear, {worn:.0?} with");
    assert!(worn.windows(2).skip(1).all(|pair| pair[1] < pair[0]), "{worn:?}");
    assert!(worn[7] < 0.97 * worn[1]);
    assert!((worn[1] / plain[1]) < 1.0);
}

#[test]
fn feeds_are_lower_where_the_tool_has_just_entered() {
    let model = "[[effect]]\nname = \"entry\"\n[effect.parameters]\nexcess = 0.5\nlength = 10\n";
    // The passes run downwards in x: the tool enters at x = 200.
    let (near, far) = (feeds(Some(model), [170.0, 198.0]), feeds(Some(model), [20.0, 100.0]));
    let plain = feeds(None, MIDDLE);
    for pass in 1..8 {
        assert!(near[pass] < 0.95 * plain[pass], "pass {pass}: {} for {}", near[pass], plain[pass]);
        // Within what a further F word would be worth.
        assert!((0.96..1.001).contains(&(far[pass] / plain[pass])), "far from it: {} for {}", far[pass], plain[pass]);
    }
}

#[test]
fn feeds_fall_in_the_hard_zone_only() {
    let zone = "[[effect]]\nname = \"hard-zone\"\n[effect.parameters]\nexcess = 0.4\nx_min = 90\nx_max = 130\ny_min = -50\ny_max = 200\nborder = 0.05\n";
    let plain = feeds(None, [100.0, 115.0]);
    let inside = feeds(Some(zone), [100.0, 115.0]);
    let outside = feeds(Some(zone), [30.0, 70.0]);
    println!("{plain:.0?} {inside:.0?} {outside:.0?}");
    for pass in 1..8 {
        assert!(inside[pass] < 0.85 * plain[pass], "pass {pass}: {} for {}", inside[pass], plain[pass]);
        ratio(outside[pass], plain[pass], "outside the zone");
    }
}

/// The teeth of the fourth pass meet material from y = 15 to 20: of a zone that begins at 17.5 they feel a part.
#[test]
fn a_tooth_that_is_in_a_hard_zone_for_a_part_of_its_way_is_loaded_by_that_part() {
    let from_y = |y: f64| {
        let zone = format!(
            "[[effect]]\nname = \"hard-zone\"\n[effect.parameters]\nexcess = 0.4\nx_min = -50\nx_max = 250\ny_min = {y}\n\
             y_max = 300\nborder = 0.02\n"
        );
        feeds(Some(&zone), MIDDLE)[3]
    };
    let [none, part, all] = [200.0, 17.5, -100.0].map(from_y);
    println!("{none:.0} without, {part:.0} in a part of the way, {all:.0} in all of it");
    assert!(all < 0.9 * part && part < 0.98 * none, "{none} {part} {all}");
}

#[test]
fn climb_is_slower_where_climb_was_learned_to_be_heavier() {
    let model = "[[effect]]\nname = \"up-down-asymmetry\"\n[effect.parameters]\ncutting = -0.2\nedge = 0\n";
    let (plain, climb) = (feeds(None, MIDDLE), feeds(Some(model), MIDDLE));
    for pass in 1..8 {
        ratio(climb[pass], plain[pass] / 1.2, "all climb: cutting coefficients 1.2 times as large");
    }
}

/// A model file whose k_tc is known to within `deviation`, relative; the other coefficients exactly, k_rc and k_ac in their
/// ratio to it.
fn uncertain(factor: f64, deviation: f64) -> String {
    let [k_tc, k_rc, k_ac] = [800.0, 300.0, 100.0].map(|k| k * factor);
    let variance = (deviation * k_tc).powi(2);
    format!(
        "covariance = [[{variance:?}, 0.0], [0.0, 0.0]]\ncovariance_of = [\"k_tc\", \"k_te\"]\n\
         [base]\nk_tc = {k_tc:?}\nk_rc = {k_rc:?}\nk_ac = {k_ac:?}\nk_te = 20\nk_re = 15\nk_ae = 3\n"
    )
}

/// Standard deviations that 95 % leave on one side.
const DEVIATIONS: f64 = 1.645;

/// Mean feeds in the middle of the passes, and the peak forces there that the written file has in `real`, a setup, by
/// coefficients that are higher by what the confidence covers.
fn sure(setup: &str, real: &str, deviation: f64, more: &[&str]) -> (Vec<f64>, Vec<f64>) {
    let folder = tempfile::tempdir().unwrap();
    let rows = optimized_with(folder.path(), setup, Some(&uncertain(1.0, deviation)), NAMES, more);
    let heavier = uncertain(1.0 + DEVIATIONS * deviation, 0.0);
    fs::write(folder.path().join("heavier.toml"), heavier).unwrap();
    fs::write(folder.path().join("real.toml"), real).unwrap();
    let mut command = Command::cargo_bin("feedwright").unwrap();
    command.current_dir(folder.path());
    command.args(["simulate", "part.fw.nc", "--setup", "real.toml", "--model", "heavier.toml", "--csv", "real.csv"]);
    let _ = command.assert();
    let mut table = csv::Reader::from_path(folder.path().join("real.csv")).unwrap();
    let header = table.headers().unwrap().clone();
    let columns = ["x_mm", "force_xy_peak_n_before"].map(|name| header.iter().position(|head| head == name).unwrap());
    let value = |row: &csv::StringRecord, column: usize| row[column].parse::<f64>().unwrap_or(0.0);
    let rows_of_real: Vec<[f64; 2]> =
        table.records().map(Result::unwrap).map(|row| columns.map(|column| value(&row, column))).collect();
    let middle = |row: &&[f64; 2]| (MIDDLE[0]..MIDDLE[1]).contains(&row[0]) && row[1] > 0.0;
    (of_passes(&rows, MIDDLE), rows_of_real.iter().filter(middle).map(|row| row[1]).collect())
}

/// Forces of cuts that are all held at the limit of 400 N: closely, and not above it.
fn at_the_limit(forces: &[f64]) {
    let (lo, hi) = forces.iter().fold((f64::INFINITY, 0.0f64), |(lo, hi), force| (lo.min(*force), hi.max(*force)));
    println!("{} forces from {lo:.1} to {hi:.1} N of 400", forces.len());
    assert!(forces.len() > 40 && lo > 0.99 * 400.0 && hi < 1.001 * 400.0, "{lo} to {hi} N of 400");
}

const CONFIDENT: [&str; 2] = ["--confidence", "0.95"];

#[test]
fn at_a_confidence_feeds_fall_as_the_coefficients_are_known_less_and_the_limit_holds_at_the_raised_ones() {
    let setup = SETUP.replace("max = [200, 120, 0] }\n", "max = [200, 120, 0] }\nuncertainty = 0\n");
    let [exact, close, vague] = [0.0, 0.05, 0.15].map(|deviation| sure(&setup, &setup, deviation, &CONFIDENT));
    let unasked = sure(&setup, &setup, 0.15, &[]);
    for pass in 1..8 {
        println!("{:.0} {:.0} {:.0} mm/min", exact.0[pass], close.0[pass], vague.0[pass]);
        // All cutting coefficients rise together: the chip must be thinner in the same ratio for the same force.
        ratio(close.0[pass], exact.0[pass] / (1.0 + DEVIATIONS * 0.05), "feed at 5 %");
        ratio(vague.0[pass], exact.0[pass] / (1.0 + DEVIATIONS * 0.15), "feed at 15 %");
        ratio(unasked.0[pass], exact.0[pass], "no confidence asked for");
    }
    for (_, forces) in [exact, close, vague] {
        at_the_limit(&forces);
    }
}

#[test]
fn at_a_confidence_the_limit_holds_in_the_stock_at_its_largest() {
    let setup = SETUP.replace("max = [200, 120, 0] }\n", "max = [200, 120, 0] }\nuncertainty = 0.3\n");
    let grown =
        SETUP.replace("min = [0, 0, -20], max = [200, 120, 0]", "min = [-0.3, -0.3, -20.3], max = [200.3, 120.3, 0.3]");
    assert!(setup != SETUP && grown != SETUP);
    let sure_of = |deviation: f64| sure(&setup, &grown, deviation, &CONFIDENT);
    let (exact, vague) = (sure_of(0.0), sure_of(0.15));
    let plain = feeds(None, MIDDLE);
    assert!((1..8).all(|pass| exact.0[pass] < 0.95 * plain[pass] && vague.0[pass] < 0.85 * exact.0[pass]));
    at_the_limit(&exact.1);
    at_the_limit(&vague.1);
}
