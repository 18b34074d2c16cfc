//! Stock that is larger or smaller than its model, was set beside it or askew, or has a top that is not level, in logs of the third generator (`benches/shop`: cells of its
//! own, teeth one by one; it uses nothing of the crate): found, with the size that was hidden.

#![allow(dead_code, unused_imports, clippy::unwrap_used)]

#[path = "../benches/shop/causes.rs"]
mod causes;
#[path = "../benches/shop/dice.rs"]
mod dice;
#[path = "../benches/shop/engagement.rs"]
mod engagement;
#[path = "../benches/shop/machine.rs"]
mod machine;
#[path = "../benches/shop/physics.rs"]
mod physics;
#[path = "../benches/shop/programs.rs"]
mod programs;
#[path = "../benches/shop/shop_floor.rs"]
mod shop_floor;

use causes::{Hidden, Stock};
use feedwright::learn::dataset::binning::channels;
use feedwright::learn::log::read_log;
use feedwright::learn::program::simulated::simulate_for;
use feedwright::learn::report::LearnReport;
use feedwright::learn::session::{LogOptions, learn};
use programs::{Needs, everyday};
use shop_floor::{Machine, log, mean_cutting_w, setup, simulate};

/// Noise over the mean power of the cut.
const NOISE: f64 = 0.03;

/// What is learned from a log with positions, of a program with such stock.
fn learned(seed: u64, stock: Stock) -> LearnReport {
    let job = everyday(seed, Needs::Any, false);
    let machine = Machine { positions: true, ..Machine::new(seed) };
    let plain = simulate(&job, &machine, &Hidden::default());
    let noise_w = NOISE * mean_cutting_w(&plain, &machine);
    let run = simulate(&job, &machine, &Hidden { stock, ..Hidden::default() });
    let declared = feedwright::setup::load(&setup(&job, &machine), std::path::Path::new(".")).unwrap().0;
    let log = read_log(log(&run, &machine, noise_w, seed).as_bytes(), &[]).unwrap();
    let prepared = simulate_for(job.text.as_bytes(), &declared, None, None).unwrap();
    learn(&prepared, &declared, &log, &channels(&log), &LogOptions::default()).unwrap()
}

/// The parameter of `stock-proud`, which must be the only name.
fn size(report: &LearnReport, parameter: &str) -> f64 {
    let names: Vec<&str> = report.effects.iter().map(|each| each.name.as_str()).collect();
    assert_eq!(names, ["stock-proud"], "{} {:?}", report.verdict, report.rejected);
    report.effects[0].parameters.iter().find(|each| each.name == parameter).unwrap().value
}

#[test]
fn a_face_that_stands_out_far_is_found_with_its_size() {
    let far = size(&learned(3, Stock { faces: [1.8, 0.0, 0.0, 0.0, 0.0], ..Stock::default() }), "x_min");
    assert!((far / 1.8 - 1.0).abs() < 0.05, "{far}");
}

#[test]
fn a_zero_point_beside_the_stock_moves_one_face_out_and_the_other_in() {
    let report = learned(3, Stock { shift: [0.9, 0.0, 0.0], ..Stock::default() });
    let [x_min, x_max] = ["x_min", "x_max"].map(|face| size(&report, face));
    assert!((x_min + 0.9).abs() < 0.15 && (x_max - 0.9).abs() < 0.15, "{x_min} {x_max}");
}

#[test]
fn stock_that_was_set_askew_is_found_with_its_angle() {
    for turn in [0.02, -0.012] {
        let found = size(&learned(3, Stock { turn, ..Stock::default() }), "turn");
        assert!((found / turn - 1.0).abs() < 0.1, "{found} for {turn}");
    }
}

#[test]
fn a_top_that_is_not_level_is_found_with_its_slope() {
    let found = size(&learned(3, Stock { slope: [0.012, 0.0], ..Stock::default() }), "slope_x");
    assert!((found / 1.2 - 1.0).abs() < 0.1, "{found} mm/100 mm for 1.2");
}

/// A step has not the form of a slope; what there is of it in a slope is learned all the same, and nothing but the stock is named.
#[test]
fn half_a_blank_that_is_higher_is_stock_with_a_slope() {
    let report = learned(3, Stock { half: 1.0, ..Stock::default() });
    assert!(size(&report, "slope_x") > 0.5, "{}", report.verdict);
    let [before, after] = [report.base_test.rmse, report.final_test.rmse];
    assert!(after < 0.7 * before, "{before} → {after}");
}
