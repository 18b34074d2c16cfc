//! Ko, Yun, Cho: forces of Test 3, 7, 17, the slot and the pocket pass, and the surface of Test 3 (PAPERS.md).
//!
//! Where the paper is silent: the range that normalises chip thickness (own range of each cut here), the milling direction
//! (down), the overhang: it is fitted to the printed peak-to-valley, a calibration and no prediction.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

mod common {
    pub mod mills;
}

use common::mills::{cutter, mill, named, side_arcs};
use feedwright::force::closed::{entry_exit_rad, immersion_rad};
use feedwright::force::{Cap, Cut, Loads};
use feedwright::machine::material::ForceModel;
use feedwright::machine::{LimitKind, Profile, Runout, Slice, Tool};

const RPS: f64 = 1000.0 / 60.0;

fn model(chip_range: f64) -> ForceModel {
    named(
        "sigmoid",
        &[
            ("a1", 12.9122),
            ("a2", 6.73768),
            ("x0", -0.62399),
            ("dx", 0.44168),
            ("k_f", 0.8287),
            ("chip_flow", 0.471),
            ("chip_range", chip_range),
        ],
    )
}

fn tool(overhang_mm: f64, runout: bool) -> Tool {
    let mut tool = mill(Profile::flat(10.0, 30.0), 10.0, 4, 30.0);
    tool.rake_rad = 11f64.to_radians();
    tool.youngs_modulus_mpa = 210_000.0;
    tool.overhang_mm = overhang_mm;
    tool.flute_length_mm = overhang_mm;
    tool.runout = runout.then_some(Runout { offset_mm: 0.006, angle_rad: 95f64.to_radians() });
    tool
}

fn slices(axial: f64) -> Vec<Slice> {
    let ring = |k: usize| Slice {
        z_mm: axial * (k as f64 + 0.5) / 50.0,
        radius_mm: 5.0,
        edge_mm: axial / 50.0,
        normal_r: 1.0,
        normal_z: 0.0,
        segment: 1,
    };
    (0..50).map(ring).collect()
}

fn loads(radial: f64, ft: f64, climb: bool, chip_range: f64) -> Loads {
    let slices = slices(5.0);
    let (entry, exit) = entry_exit_rad(immersion_rad(5.0, radial, None), climb);
    let arcs = side_arcs(&slices, 5.0, entry, exit);
    cutter(&tool(38.14, true), &slices, model(chip_range), RPS)
        .loads(&Cut { arcs: &arcs, ..Cut::default() }, ft * 4.0 * RPS)
}

fn near(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() <= 0.01 * expected.abs() + 0.6, "{what}: {found} for {expected}");
}

#[test]
fn forces_of_the_tests() {
    let test3 = loads(5.0, 0.0375, true, 0.0);
    near(test3.mean_force_n[0], 32.0, "Test 3 mean Fx");
    near(test3.mean_force_n[1], 187.0, "Test 3 mean Fy");
    near(test3.mean_force_n[2], -38.0, "Test 3 mean Fz");
    near(test3.force_axial_peak_n, 57.0, "Test 3 largest Fz");
    assert!(test3.force_xy_peak_n >= 295.0 && test3.force_xy_peak_n <= 295.1f64.hypot(127.7));
    let test17 = loads(5.0, 0.05, true, 0.0);
    near(test17.mean_force_n[1], 247.0, "Test 17 mean Fy");
    near(loads(2.5, 0.0375, true, 0.0).force_normal_mean_n, 93.0, "Test 7 mean Fy");
    near(loads(10.0, 0.0375, true, 0.0).force_normal_mean_n, 277.0, "slot mean Fy");
    near(loads(3.0, 0.0375, true, 0.0).force_normal_mean_n, 113.0, "pocket pass mean Fy, down");
    near(loads(3.0, 0.0375, false, 0.0).force_normal_mean_n, 31.0, "pocket pass mean Fy, up");
    near(loads(5.0, 0.0375, true, 0.0565).force_normal_mean_n, 208.0, "Test 3 with the range of Test 17");
}

/// Without runout and with its own range, force is exactly proportional to feed: the size effect does not act between feeds.
#[test]
fn own_range_makes_force_proportional_to_feed() {
    let slices = slices(5.0);
    let (entry, exit) = entry_exit_rad(immersion_rad(5.0, 5.0, None), true);
    let arcs = side_arcs(&slices, 5.0, entry, exit);
    let cutter = cutter(&tool(38.14, false), &slices, model(0.0), RPS);
    let at = |ft: f64| cutter.loads(&Cut { arcs: &arcs, ..Cut::default() }, ft * 4.0 * RPS).force_normal_mean_n;
    near(at(0.0375), 177.39, "mean Fy");
    assert!((at(0.075) / at(0.0375) - 2.0).abs() < 1e-9);
}

/// Highest less lowest error of the wall of Test 3, µm.
fn test3_wall(overhang_mm: f64) -> f64 {
    let slices = slices(5.0);
    let (entry, exit) = entry_exit_rad(immersion_rad(5.0, 5.0, None), true);
    let arcs = side_arcs(&slices, 5.0, entry, exit);
    let cutter = cutter(&tool(overhang_mm, true), &slices, model(0.0), RPS);
    let wall = cutter.wall(&Cut { arcs: &arcs, ..Cut::default() }, 0.0375 * 4.0 * RPS);
    assert_eq!(wall.len(), 50);
    let errors = wall.iter().map(|point| point.error_mm);
    1e3 * (errors.clone().fold(f64::NEG_INFINITY, f64::max) - errors.fold(f64::INFINITY, f64::min))
}

/// Every edge bends the cantilever at its own height here (49.0 µm at 38.14 mm). PAPERS.md's 47.6 µm at 38.14 mm is what the
/// whole force at half the depth gives (47.7 µm, an independent program); this beam needs 0.3 mm less. Its 38.8 µm without
/// runout and 31.1 µm up are not found by either: both programs give 46.6 and 91.
#[test]
fn surface_of_test_3_is_a_calibration_of_the_overhang() {
    let (mut short, mut long) = (35.0, 41.0);
    for _ in 0..40 {
        let middle = 0.5 * (short + long);
        *(if test3_wall(middle) < 47.6 { &mut short } else { &mut long }) = middle;
    }
    assert!((short - 37.85).abs() < 0.1, "overhang for 47.6 µm: {short}");
    assert!((test3_wall(38.14) / 47.6 - 1.0).abs() < 0.04, "{}", test3_wall(38.14));
    assert!(test3_wall(39.0) > 1.02 * test3_wall(38.0), "stiffness counts");
}

/// Feeds that hold the mean normal force at 100 N: 132 mm/min on the straight, 51 in the corner, where the immersion grows
/// by a right angle, from 66.4° to 156.4°.
#[test]
fn reference_force_sets_the_feed() {
    let slices = slices(5.0);
    let cutter = cutter(&tool(38.14, true), &slices, model(0.0), RPS);
    let straight = entry_exit_rad(immersion_rad(5.0, 3.0, None), true);
    let corner = entry_exit_rad(156.4f64.to_radians(), true);
    for ((entry, exit), at_150, scheduled) in [(straight, 113.0, 132.0), (corner, 282.0, 51.0)] {
        let arcs = side_arcs(&slices, 5.0, entry, exit);
        let line = cutter.line(&Cut { arcs: &arcs, ..Cut::default() });
        near(line.loads(2.5).force_normal_mean_n, at_150, "mean Fn at 150 mm/min");
        let Cap::Feed { feed_mm_s, .. } = line.cap(LimitKind::ForceNormalMean, 100.0) else { panic!("in reach") };
        assert!((line.loads(feed_mm_s).force_normal_mean_n - 100.0).abs() < 1e-6);
        assert!((feed_mm_s * 60.0 - scheduled).abs() < 1.5, "{}", feed_mm_s * 60.0);
    }
}
