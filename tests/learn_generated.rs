//! The generator of hidden effects against closed forms (depths and angles of its steady cuts, lengths of its moves),
//! and the diagnosis of a log without an effect; the whole matrix is `cargo bench --bench confusion`.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "../benches/confusion/cases.rs"]
#[allow(dead_code)]
mod cases;
#[path = "../benches/confusion/cut.rs"]
mod cut;
#[path = "../benches/confusion/motion.rs"]
mod motion;
#[path = "../benches/confusion/physics.rs"]
#[allow(dead_code)]
mod physics;
#[path = "../benches/confusion/programs.rs"]
#[allow(dead_code)]
mod programs;
#[path = "../benches/confusion/rng.rs"]
mod rng;
#[path = "../benches/confusion/writer.rs"]
mod writer;

use cases::Case;
use feedwright::learn::cells::channels;
use feedwright::learn::log::read_log;
use feedwright::learn::report::LearnReport;
use feedwright::learn::session::{LogOptions, learn, prepare};
use programs::{Part, Steady};
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
    let case = Case::new(row, seed);
    let (job, _) = feedwright::setup::load(&case.part.setup, std::path::Path::new(".")).unwrap();
    let (text, _) = case.log(0.03);
    let log = read_log(text.as_bytes(), &[]).unwrap();
    let prepared = prepare(case.part.program.as_bytes(), &job, false).unwrap();
    learn(&prepared, &job, &log, &channels(&log), &LogOptions::default()).unwrap()
}

fn names(report: &LearnReport) -> Vec<&str> {
    report.effects.iter().map(|e| e.name.as_str()).collect()
}

#[test]
fn a_log_without_an_effect_adds_nothing() {
    assert!(names(&diagnosed("none", 1000)).is_empty());
}
