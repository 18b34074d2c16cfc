//! Peak forces as a diagnosis sees them, and the times of pieces of moves, each a second way.

#![allow(clippy::format_collect, clippy::unwrap_used)]

use feedwright::learn::program::simulated::simulate;
use std::f64::consts::{PI, TAU};

const SETUP: &str = "units = \"mm\"\n[machine]\nDIALECT\nrapid = 12000\ncorner_tolerance = 0.02\n\
    [machine.axes]\nx = { velocity = 12000, acceleration = 1500 }\ny = { velocity = 12000, acceleration = 1500 }\n\
    z = { velocity = 12000, acceleration = 1500 }\n[machine.spindle]\nmax_rpm = 12000\ntare = [[1000, 118], [12000, 391]]\n\
    [stock]\nbox = { min = [0, 0, -30], max = [70, 40, 0] }\n\
    [material]\nk_tc = 818\nk_rc = 327\nk_ac = 0\nk_te = 17.5\nk_re = 9.8\nk_ae = 0\n\
    [[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 10\nflutes = 4\nhelix = 40\nflute_length = 30\noverhang = 45\n\
    material = \"carbide\"\n";

fn prepared(program: &str, dialect: &str, forces: bool) -> feedwright::learn::program::simulated::SimulatedProgram {
    let setup = SETUP.replace("DIALECT", dialect);
    let (job, _) = feedwright::setup::load(&setup, std::path::Path::new(".")).unwrap();
    simulate(program.as_bytes(), &job, forces).unwrap()
}

/// Largest resultant over a turn, the edge of every tooth cut into pieces of a hundredth of a millimetre.
fn by_brute_force(feed_per_tooth: f64, axial_mm: f64, phi: [f64; 2]) -> f64 {
    let (teeth, lag) = (4, 40f64.to_radians().tan() / 5.0);
    let pieces = (axial_mm / 0.01) as usize;
    let resultant = |turn: f64| {
        let (mut x, mut y) = (0.0, 0.0);
        for piece in 0..pieces * teeth {
            let z = (piece / teeth) as f64 * 0.01 + 0.005;
            let at = (turn + TAU * (piece % teeth) as f64 / teeth as f64 - lag * z).rem_euclid(TAU);
            if at < phi[0] || at > phi[1] {
                continue;
            }
            let h = feed_per_tooth * at.sin();
            let (tangential, radial) = (0.01 * (818.0 * h + 17.5), 0.01 * (327.0 * h + 9.8));
            x -= tangential * at.cos() + radial * at.sin();
            y += tangential * at.sin() - radial * at.cos();
        }
        x.hypot(y)
    };
    (0..900).map(|k| resultant(TAU / 4.0 * f64::from(k) / 900.0)).fold(0.0, f64::max)
}

#[test]
fn the_peak_of_a_light_cut_is_that_of_an_edge_in_thin_pieces() {
    // A pass of 0.6 mm by 4.2 mm, down-milling, with a helix whose lag over a ring is a fifth of the arc.
    let program = "G21 G90 G17\nT1 M6\nS3650 M3\nG0 X-9 Y44.4 Z5\nG0 Z-4.2\nG1 X80 F2920\nG0 Z5\nM30\n";
    let prepared = prepared(program, "dialect = \"generic\"", true);
    let middle = |s: &&feedwright::learn::program::timeline::Spot| s.line == 6 && (30.0..40.0).contains(&s.from.x);
    let spot = prepared.timeline().spots.iter().find(middle).unwrap();
    let peak: f64 = spot.engaged.peak.iter().zip([818.0, 327.0, 17.5, 9.8]).map(|(slope, k)| slope * k).sum();
    let width = (1.0 - 0.6 / 5.0f64).acos();
    // Fed along X with the stock on its right: what is cut lies at the end of the half turn.
    let exact = by_brute_force(2920.0 / (3650.0 * 4.0), 4.2, [PI - width, PI]);
    assert!((peak / exact - 1.0).abs() < 0.01, "{peak} {exact}");
}

#[test]
fn no_piece_of_a_rounded_corner_is_faster_than_its_feed_and_the_time_is_shared() {
    let zigzag: String = (1..8).map(|k| format!("X{} Y{}\n", 8 * k, if k % 2 == 0 { 5 } else { 10 })).collect();
    let program = format!("G21 G90 G17 G64\nT1 M6\nS6000 M3\nG0 X0 Y5 Z5\nG0 Z-1\nG1 F1500 {zigzag}G0 Z5\nM30\n");
    let prepared = prepared(&program, "dialect = \"generic\"", false);
    let feed = 1500.0 / 60.0;
    let spots: Vec<_> =
        prepared.timeline().spots.iter().filter(|s| s.length_mm > 1e-6 && (6..13).contains(&s.line)).collect();
    assert!(spots.len() > 40);
    for spot in &spots {
        assert!(spot.speed_mm_s() < 1.05 * feed, "line {}: {} mm/s", spot.line, spot.speed_mm_s());
    }
    // The two pieces at a corner are slowed alike.
    for pair in spots.windows(2).filter(|pair| pair[0].line != pair[1].line) {
        let [a, b] = [pair[0], pair[1]].map(feedwright::learn::program::timeline::Spot::speed_mm_s);
        assert!((a / b - 1.0).abs() < 0.1, "{a} {b}");
    }
}

#[test]
fn lines_that_a_control_joins_keep_their_own_time() {
    let program = "G21 G90 G17 G64 P0.05\nT1 M6\nS6000 M3\nG0 X0 Y5 Z5\nG0 Z-1\nG1 X10 F600\nX30\nX60\nG0 Z5\nM30\n";
    let prepared = prepared(program, "dialect = \"linuxcnc\"", false);
    let seconds = |line: u32| -> f64 {
        prepared.timeline().spots.iter().filter(|s| s.line == line).map(|s| s.end_s - s.start_s).sum()
    };
    // 10, 20 and 30 mm at 10 mm/s, with a ramp of 10/1500 s at either end of the whole.
    for (line, length) in [(6, 10.0), (7, 20.0), (8, 30.0)] {
        assert!((seconds(line) - length / 10.0).abs() < 0.02, "line {line}: {} s", seconds(line));
    }
}
