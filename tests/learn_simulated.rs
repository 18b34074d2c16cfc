//! What diagnosis takes for the contact of a cut is what rubs: the end face of a mill on every ramp, however shallow, and on no level move.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use feedwright::learn::program::simulated::simulate;
use feedwright::setup;
use std::f64::consts::PI;
use std::path::Path;

/// A helix of 3, 0.6 and 0.2°, and a level turn at its end.
const PROGRAM: &str = "G21 G90 G17\nT1 M6\nS8000 M3\nG0 X4 Y0\nG0 Z2\nG1 Z0.1 F800\nG3 X4 Y0 Z-1.2 I-4 J0 F900\n\
    G3 X4 Y0 Z-2.5 I-4 J0\nG3 X4 Y0 Z-2.76 I-4 J0\nG3 X4 Y0 Z-2.85 I-4 J0\nG3 X4 Y0 I-4 J0\nG3 X4 Y0 I-4 J0\nG0 Z20\nM30\n";
const SETUP: &str = r#"
[machine]
dialect = "linuxcnc"
[stock]
box = { min = [-45, -25, -10], max = [45, 25, 0] }
[material]
k_tc = 800
k_te = 15
[[tool]]
number = 1
shape = "flat"
diameter = 10
flutes = 3
"#;

#[test]
fn an_end_face_rubs_on_every_ramp_and_on_no_level_move() {
    let (job, _) = setup::load(SETUP, Path::new(".")).unwrap();
    let known = simulate(PROGRAM.as_bytes(), &job, false).unwrap();
    // Mean over a line of the area that all edges sweep over material in a revolution, mm².
    let contact = |line: u32| {
        let spots: Vec<_> = known.timeline().spots.iter().filter(|spot| spot.line == line).collect();
        let length: f64 = spots.iter().map(|spot| spot.length_mm).sum();
        spots.iter().map(|spot| spot.engaged.contact_mm2 * spot.length_mm).sum::<f64>() / length
    };
    // Three teeth sweep the end face: 3 π R². The side adds what it takes of the wall, the less the shallower the ramp.
    let face = 3.0 * PI * 25.0;
    let found = [8, 9, 10, 12].map(contact);
    println!("{found:?} of {face}");
    for (slope, area) in [0.052, 0.0103, 0.0036].into_iter().zip(found) {
        assert!(area > 0.97 * face && area < 1.25 * face, "slope {slope}: {area} of {face}");
    }
    assert!(found[3] < 0.05 * face, "level: {} of {face}", found[3]);
}
