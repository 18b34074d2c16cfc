//! Calibration of the other models on tables by closed forms; coefficients followed over time; model files as `simulate`
//! reads them.

#![allow(clippy::format_collect, clippy::unwrap_used)]

mod common {
    pub mod follow;
}

use assert_cmd::Command;
use common::follow::{At, Noise, SETUP, follow, job, log};
use feedwright::learn::calibrate::plan::{Kind, plan};
use feedwright::learn::calibrate::{CalibrateOptions, Calibration, calibrate};
use feedwright::learn::dataset::steady_table;
use feedwright::learn::log::columns;
use feedwright::learn::regress::linear::Loss;
use feedwright::learn::session::{LogOptions, run};
use std::f64::consts::PI;
use std::fmt::Write;

fn calibrated(csv: &str, model: &str, options: CalibrateOptions) -> Calibration {
    let frame = columns::read(csv.as_bytes(), &[]).unwrap();
    let rows = steady_table::rows(&frame, &[]).unwrap();
    calibrate(&frame, &rows, model, options, |y| y).unwrap()
}

fn value(c: &Calibration, name: &str) -> (f64, f64) {
    let found = c.parameters.iter().find(|p| p.name == name).unwrap();
    (found.value, found.std_error)
}

/// (radial depth, feed per tooth, sin of the immersion, immersion) of the cuts of a table with a 10 mm mill.
fn cuts() -> Vec<(f64, f64)> {
    [0.5, 1.5, 3.0, 5.0, 10.0].into_iter().flat_map(|b| [0.02, 0.05, 0.1].map(|f| (b, f))).collect()
}

const HEAD: &str = "group,spindle_rpm,feed_per_tooth_mm,axial_depth_mm,radial_depth_mm,side,diameter_mm,flutes";

#[test]
fn kienzle_finds_its_exponent() {
    let (k, m, tare) = (1500.0, 0.25, 200.0);
    let mut noise = Noise(1);
    let mut csv = format!("{HEAD},spindle_power_w\n");
    for (b, f) in cuts() {
        let (theta, rps) = ((1.0 - b / 5.0f64).acos(), 100.0);
        let (q, a) = (3.0 * b * f * 3.0 * rps, 3.0 * 5.0 * theta * 3.0 * rps);
        let power = tare + 1e-3 * k * q * (q / a).powf(-m);
        let _ = writeln!(csv, "g{b},6000,{f},3,{b},down,10,3,{}", power * (1.0 + 0.005 * noise.normal()));
    }
    let c = calibrated(&csv, "kienzle", CalibrateOptions::default());
    let ((found, error), (exponent, exponent_error)) = (value(&c, "k_c11"), value(&c, "m_c"));
    assert!((exponent - m).abs() < 3.0 * exponent_error && exponent_error < 0.05, "{exponent} ± {exponent_error}");
    assert!((found / k - 1.0).abs() < 0.15 && error.is_finite(), "{c:?}");
    assert!(c.doubts.is_empty(), "{c:?}");
}

#[test]
fn response_finds_its_plane_in_spite_of_an_outlier() {
    let truth = [40.0, 12.0, 900.0];
    let mut noise = Noise(2);
    let mut csv = format!("{HEAD},force_xy_n\n");
    for (k, (b, f)) in cuts().into_iter().enumerate() {
        let theta = (1.0 - b / 5.0f64).acos();
        let chip = f * if theta > 0.5 * PI { 1.0 } else { theta.sin() };
        let force = truth[0] + truth[1] * 5.0 * theta + truth[2] * chip + noise.normal();
        let _ = writeln!(csv, "g{b},6000,{f},3,{b},down,10,3,{}", if k == 4 { 3.0 * force } else { force });
    }
    let miss = |loss: Loss| {
        let c = calibrated(&csv, "response", CalibrateOptions { loss, ..CalibrateOptions::default() });
        ["b0", "b_l", "b_t"].iter().zip(truth).map(|(n, t)| (value(&c, n).0 / t - 1.0).abs()).fold(0.0, f64::max)
    };
    assert!(miss(Loss::Huber) < 0.1, "{}", miss(Loss::Huber));
    assert!(miss(Loss::Tukey) < 0.05 && miss(Loss::Squares) > 3.0 * miss(Loss::Tukey), "{}", miss(Loss::Tukey));
}

/// Every term of the polynomial of Kakino and Ibaraki comes back, in mm and about the middle of the table; where the table has
/// two chips only, the square of the chip cannot be told and is said.
#[test]
fn response_finds_all_six_terms_where_the_table_tells_them() {
    let names = ["b0", "b_l", "b_t", "b_ll", "b_tt", "b_lt"];
    let truth = [40.0, 12.0, 900.0, 1.5, 4000.0, 150.0];
    let table = |feeds: &[f64]| {
        let mut noise = Noise(3);
        let mut csv = format!("{HEAD},force_xy_n\n");
        for (b, f) in [0.5, 1.5, 3.0, 5.0, 10.0].into_iter().flat_map(|b| feeds.iter().map(move |f| (b, *f))) {
            let theta = (1.0 - b / 5.0f64).acos();
            let (l, t) = (5.0 * theta, f * if theta > 0.5 * PI { 1.0 } else { theta.sin() });
            let terms = [1.0, l, t, l * l, t * t, l * t];
            let force: f64 = terms.iter().zip(truth).map(|(x, b)| x * b).sum::<f64>() + 0.1 * noise.normal();
            let _ = writeln!(csv, "g{b},6000,{f},3,{b},down,10,3,{force}");
        }
        calibrated(&csv, "response", CalibrateOptions::default())
    };
    let whole = table(&[0.02, 0.05, 0.1]);
    assert_eq!(whole.parameters.len(), 6, "{whole:?}");
    for (name, truth) in names.iter().zip(truth) {
        let (found, error) = value(&whole, name);
        assert!((found - truth).abs() < 4.0 * error && error < 0.3 * truth, "{name}: {found} ± {error} for {truth}");
    }
    // b0 as a polynomial about the middle of the table: β₀ is the force there.
    let derived = |name: &str| whole.derived.iter().find(|v| v.name == name).unwrap().value;
    let (l, t) = (derived("x1_middle"), derived("x2_middle"));
    let middle: f64 = [1.0, l, t, l * l, t * t, l * t].iter().zip(names).map(|(x, n)| x * value(&whole, n).0).sum();
    assert!((derived("beta_0") / middle - 1.0).abs() < 1e-9);
    let flat =
        "group,spindle_rpm,feed_per_tooth_mm,axial_depth_mm,radial_depth_mm,side,diameter_mm,flutes,force_xy_n\n";
    let mut csv = flat.to_owned();
    for (k, f) in [0.02, 0.04, 0.06, 0.08].into_iter().cycle().take(8).enumerate() {
        let b = if k < 4 { 1.0 } else { 4.0 };
        let theta = (1.0 - b / 5.0f64).acos();
        let (l, t) = (5.0 * theta, f * theta.sin());
        let _ = writeln!(csv, "g{b},6000,{f},3,{b},down,10,3,{}", 40.0 + 12.0 * l + 900.0 * t + 9000.0 * t * t);
    }
    let two = calibrated(&csv, "response", CalibrateOptions::default());
    assert!(two.notes.iter().any(|note| note.contains("does not determine b_ll")), "{:?}", two.notes);
}

#[test]
fn force_from_power_is_stated_as_uncertain_as_it_is() {
    let row = |shape: &str| {
        let mut csv = format!("{HEAD},shape,spindle_power_w\n");
        for (b, f) in cuts() {
            let _ = writeln!(csv, "g{b},6000,{f},3,{b},down,10,3,{shape},{}", 300.0 + 100.0 * b * f + 10.0 * b);
        }
        calibrated(&csv, "power", CalibrateOptions::default()).force_uncertainty
    };
    assert_eq!((row("flat"), row("ball")), (Some(0.16), Some(0.30)));
}

/// Power of a flat cut with factors on k_tc and k_te.
fn power(s: &At, cutting: f64, edge: f64) -> f64 {
    s.cut.map_or(310.0, |(axial, radial)| {
        let theta = (1.0 - radial / 5.0f64).acos();
        let contact = axial * 5.0 * theta * 3.0 * s.rps;
        310.0 + 1e-3 * (cutting * 900.0 * axial * radial * s.feed_mm_s + edge * 21.0 * contact)
    })
}

/// The run of the power tests, and its log where the factors depend on the share of the run.
fn run_with(factors: impl Fn(f64) -> [f64; 2]) -> (String, String) {
    let program = plan(Kind::Power, &job()).unwrap().program;
    let samples: Vec<At> = follow(&program, 5.0).into_iter().step_by(2).collect();
    let end_s = samples.last().unwrap().time_s;
    let mut noise = Noise(3);
    let text = log(&samples, "spindle_power_w", |s| {
        let [cutting, edge] = factors(s.time_s / end_s);
        format!("{:.1}", power(s, cutting, edge) + 8.0 * noise.normal())
    });
    (program, text)
}

#[test]
fn windows_show_wear_and_a_chipped_edge() {
    let learned = |factors: fn(f64) -> [f64; 2]| {
        let (program, text) = run_with(factors);
        run(program.as_bytes(), &job(), text.as_bytes(), &LogOptions::default(), None).unwrap().report
    };
    let worn = learned(|x| [1.0, 1.0 + 0.9 * x]);
    assert!(worn.windows.len() >= 6, "{:?}", worn.windows);
    assert!(worn.wear.as_deref().is_some_and(|w| w.contains("wear")), "{:?} {:?}", worn.wear, worn.windows);
    let chipped = learned(|x| if x > 0.6 { [1.3, 1.1] } else { [1.0, 1.0] });
    assert!(chipped.wear.as_deref().is_some_and(|w| w.contains("chipped")), "{:?} {:?}", chipped.wear, chipped.windows);
    let steady = learned(|_| [1.0, 1.0]);
    assert_eq!(steady.wear, None, "{:?}", steady.windows);
}

#[test]
fn a_calibrated_model_file_predicts_what_was_measured() {
    let (program, text) = run_with(|_| [1.0, 1.0]);
    let dir = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    put("part.nc", &program);
    put("part.setup.toml", SETUP);
    put("log.csv", &text);
    put("own.setup.toml", &format!("{SETUP}\n[process]\ninclude = \"model.toml\"\n"));
    let run = |arguments: &[&str]| {
        let output =
            Command::cargo_bin("feedwright").unwrap().current_dir(dir.path()).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    run(&["calibrate", "part.nc", "--log", "log.csv", "-o", "model.toml"]);
    run(&["learn", "part.nc", "--log", "log.csv", "-o", "learned.toml"]);
    let largest = |arguments: &[&str]| {
        run(&[&["simulate", "part.nc", "--json", "r.json"], arguments].concat());
        let report: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(dir.path().join("r.json")).unwrap()).unwrap();
        report["tool"][0]["power_max_w"].as_f64().unwrap()
    };
    let truth = follow(&program, 5.0).iter().map(|s| power(s, 1.0, 1.0)).fold(0.0, f64::max);
    let declared = largest(&[]);
    assert!((declared / truth - 1.0).abs() > 0.05, "the setup declares other coefficients: {declared} {truth}");
    for arguments in [["--model", "model.toml"], ["--setup", "own.setup.toml"], ["--model", "learned.toml"]] {
        let found = largest(&arguments);
        assert!((found / truth - 1.0).abs() < 0.02, "{arguments:?}: {found} for {truth}, declared {declared}");
    }
}
