//! The generator of hidden effects against closed forms: depths and angles of its steady cuts.

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
