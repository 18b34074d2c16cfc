//! The generator of hidden effects against closed forms (depths and angles of its steady cuts, lengths of its moves),
//! and the diagnosis of a log without an effect; the whole matrix is `cargo bench --bench confusion`.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "../benches/confusion/generator.rs"]
mod generator;

#[path = "common/mesh.rs"]
mod mesh;

use feedwright::learn::dataset::binning::channels;
use feedwright::learn::log::read_log;
use feedwright::learn::program::simulated::simulate_for;
use feedwright::learn::report::LearnReport;
use feedwright::learn::session::{LogOptions, learn};
use feedwright::machine::{Job, StockShape};
use generator::cases::Case;
use generator::cut;
use generator::hidden::Hidden;
use generator::motion;
use generator::motion::Moment;
use generator::physics::{Channel, Coefficients, Milling};
use generator::programs::{Part, Steady};
use generator::writer;
use mesh::box_as_stl;
use std::f64::consts::PI;

/// Entry and exit of a straight cut of known depth: θ = acos(1 − b/r), from the side on which the material stands.
fn closed_angles(steady: &Steady, r: f64) -> [f64; 2] {
    let theta = (1.0 - steady.radial_mm / r).clamp(-1.0, 1.0).acos();
    if steady.slot {
        [0.0, PI]
    } else if steady.up {
        [0.0, theta]
    } else {
        [PI - theta, PI]
    }
}

/// Share of the stations inside the stock that meet exactly the depth and the angles of the closed form.
fn agreement(part: &Part, steady: &Steady, stations: &[cut::Station]) -> (usize, usize) {
    let r = 0.5 * part.mill.diameter_mm;
    let expected = closed_angles(steady, r);
    // The whole front half circle is past the edge where the pass enters and before the one where it leaves.
    let inside = |s: &&cut::Station| {
        let k = usize::from(s.direction[1].abs() > 0.5);
        s.at_mm[k] > r && s.at_mm[k] < part.stock_mm[k] - r
    };
    let agrees = |s: &&cut::Station| {
        let height: f64 = s.arcs.iter().map(|arc| arc.dz_mm).sum();
        let angles = |arc: &cut::Arc| (0..2).all(|k| (arc.phi[k] - expected[k]).abs() < 2e-3);
        (height - steady.axial_mm).abs() < 1e-9 && s.arcs.iter().all(angles)
    };
    let cutting: Vec<&cut::Station> = stations.iter().filter(inside).filter(|s| !s.arcs.is_empty()).collect();
    (cutting.iter().filter(|s| agrees(s)).count(), cutting.len())
}

#[test]
fn steady_cuts_meet_what_their_depths_say() {
    let (mut agree, mut all) = (0, 0);
    for seed in 1000..1006 {
        let part = Part::new(seed);
        let stations = cut::stations(&part, &cut::Reality::declared(&part));
        for steady in &part.steady {
            let (a, n) = agreement(&part, steady, &stations[steady.step]);
            (agree, all) = (agree + a, all + n);
        }
    }
    // The rest are stations beside the rounded corners of contours and the last scallops of sawtooth passes.
    assert!(all > 10_000 && agree * 100 > all * 98, "{agree} of {all} stations agree");
}

/// Tare + k_tc·a·b·f + k_te·a·r·θ·N·n, at the meter, W.
fn closed_power(part: &Part, truth: &Coefficients, steady: &Steady, feed_mm_s: f64, rps: f64) -> f64 {
    let r = 0.5 * part.mill.diameter_mm;
    let [entry, exit] = closed_angles(steady, r);
    let cutting = truth.k_tc * steady.axial_mm * steady.radial_mm * feed_mm_s;
    let edge = truth.k_te * steady.axial_mm * r * (exit - entry) * f64::from(part.mill.flutes) * rps;
    (truth.tare * part.shop.tare_at(rps) + 1e-3 * (cutting + edge)) / part.shop.efficiency
}

/// The generator's power in the middle of its steady cuts is the closed form within 0.2 %, in nearly all readings: the
/// others are in passes that meet the rounded corners of contours or what a sawtooth left.
#[test]
fn steady_cuts_take_the_power_of_the_closed_form() {
    let (mut agree, mut all) = (0, 0);
    for seed in [1000, 1001, 1002] {
        let part = Part::new(seed);
        let truth = Coefficients { k_tc: 800.0, k_rc: 300.0, k_te: 15.0, k_re: 8.0, tare: 1.02 };
        let milling = Milling::new(&part, &truth, &[], Channel::Power);
        let times: Vec<f64> = (1..(milling.end_s() * 10.0) as usize).map(|k| 0.1 * k as f64).collect();
        for reading in milling.read(&times) {
            let Some(steady) = part.steady.iter().find(|s| s.step == reading.moment.step) else { continue };
            let r = 0.5 * part.mill.diameter_mm;
            let Moment { at_mm, speed_mm_s, rps, .. } = reading.moment;
            let inside = |k: usize| at_mm[k] > r && at_mm[k] < part.stock_mm[k] - r;
            let writer::Action::Move { path, .. } = part.steps[steady.step].action else { continue };
            if !inside(usize::from(path.from[0] == path.to[0])) {
                continue;
            }
            let expected = closed_power(&part, &truth, steady, speed_mm_s, rps);
            all += 1;
            agree += usize::from((reading.value / expected - 1.0).abs() < 2e-3);
        }
    }
    assert!(all > 1500 && agree * 100 > all * 95, "{agree} of {all} readings agree");
}

#[test]
fn every_leg_of_the_timeline_ends_where_its_path_ends() {
    let part = Part::new(1002);
    for leg in motion::timeline(&part, 0.1) {
        if let writer::Action::Move { path, .. } = part.steps[leg.step].action {
            let end = leg.at(leg.end_s());
            assert!((end.s_mm - path.length()).abs() < 1e-6, "{end:?}");
            assert!((leg.speed_at(end.s_mm) - end.speed_mm_s).abs() < 1e-3, "{end:?}");
        }
    }
}

fn diagnosed(row: &'static str, seed: u64) -> LearnReport {
    diagnosed_in(row, seed, &|job| (job, Vec::new()))
}

/// The same in a stock that may come from a file.
fn diagnosed_in(row: &'static str, seed: u64, stock: &dyn Fn(Job) -> (Job, Vec<u8>)) -> LearnReport {
    let case = Case::new(row, seed);
    let (job, _) = feedwright::setup::load(&case.part.setup, std::path::Path::new(".")).unwrap();
    let (job, file) = stock(job);
    let (text, _) = case.log(0.03);
    let log = read_log(text.as_bytes(), &[]).unwrap();
    let load = |_: &std::path::Path| Ok(file.clone());
    let prepared = simulate_for(case.part.program.as_bytes(), &job, None, Some(&load)).unwrap();
    learn(&prepared, &job, &log, &channels(&log), &LogOptions::default()).unwrap()
}

/// The job with its box as a mesh, and the file.
fn as_mesh(mut job: Job) -> (Job, Vec<u8>) {
    let StockShape::Box(extent) = job.stocks[0].shape else { panic!("{:?}", job.stocks[0].shape) };
    job.stocks[0].shape = StockShape::Stl("part.stl".into());
    (job, box_as_stl([0, 1, 2].map(|k| [extent.min[k], extent.max[k]])).into_bytes())
}

#[test]
fn a_stock_from_a_file_that_stands_proud_is_found() {
    let found = diagnosed_in("stock-proud", PROUD, &as_mesh);
    assert_eq!(names(&found), ["stock-proud"], "{}", found.verdict);
    assert_eq!(names(&diagnosed_in("none", 1000, &as_mesh)), [""; 0]);
    let top = |report: &LearnReport| report.effects[0].parameters[0].value;
    let boxed = diagnosed("stock-proud", PROUD);
    assert!((top(&found) / top(&boxed) - 1.0).abs() < 0.05, "{} {}", top(&found), top(&boxed));
}

/// A development case whose stock is higher than declared.
const PROUD: u64 = 1001;

fn names(report: &LearnReport) -> Vec<&str> {
    report.effects.iter().map(|e| e.name.as_str()).collect()
}

#[test]
fn a_log_without_an_effect_adds_nothing() {
    assert!(names(&diagnosed("none", 1000)).is_empty());
}

/// The value of a parameter of an effect that was found.
fn found(report: &LearnReport, effect: &str, parameter: &str) -> f64 {
    let effect = report.effects.iter().find(|e| e.name == effect).unwrap_or_else(|| panic!("{:?}", names(report)));
    effect.parameters.iter().find(|p| p.name == parameter).unwrap().value
}

#[test]
fn stock_that_stands_out_is_simulated_as_it_was_found() {
    let Hidden::StockProud { top_mm, side_mm } = Case::new("stock-proud", 1004).hidden[0] else { panic!("stock") };
    let report = diagnosed("stock-proud", 1004);
    let (top, side) = (found(&report, "stock-proud", "top"), found(&report, "stock-proud", "side"));
    // Half a millimetre more and twice what that changes is another 20 % beside it.
    assert!((top / top_mm - 1.0).abs() < 0.03 && (side / side_mm - 1.0).abs() < 0.05, "{top} {side}");
    // Here other samples are doubtful once it is, and the log has another number of cells.
    assert_eq!(names(&diagnosed("stock-proud", 1007)), ["stock-proud"]);
}

#[test]
fn an_effect_takes_another_form_beside_those_found_after_it() {
    let report = diagnosed("two", 1000);
    let mut named = names(&report);
    named.sort_unstable();
    assert_eq!(named, ["flank-wear", "tare-warm-up"]);
    // The generator's wear begins with a run-in and ends steeply; found first, before the tare's warm-up, it is a plain rise.
    let [run_in, end] = ["run_in", "end"].map(|parameter| found(&report, "flank-wear", parameter));
    assert!(run_in > 0.1 || end > 0.1, "{run_in} {end}");
}

#[test]
fn the_excess_of_an_entry_and_of_a_drive_are_followed_to_their_end() {
    let Hidden::Entry { excess, length_mm } = Case::new("entry", 1001).hidden[0] else { panic!("entry") };
    let report = diagnosed("entry", 1001);
    let value = |parameter: &str| found(&report, "entry", parameter);
    assert!((value("excess") / excess - 1.0).abs() < 0.05, "{}", value("excess"));
    let end_mm = value("length") / (1.0 - value("order"));
    assert!((end_mm / length_mm - 1.0).abs() < 0.15, "{end_mm} for {length_mm}");
    // η falls with the load: 1/(1 − c x) grows faster than 1 + c x.
    let exponent = found(&diagnosed("drive-efficiency", 1000), "drive-efficiency", "exponent");
    assert!((1.05..1.5).contains(&exponent), "{exponent}");
}
