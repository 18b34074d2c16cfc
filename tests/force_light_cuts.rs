//! Peaks of light cuts, whose arc is as wide as a few lags of a ring, against the closed form of a helical edge.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/mills.rs"]
mod mills;

use feedwright::force::Cut;
use feedwright::machine::Profile;
use feedwright::machine::material::{ForceModel, LinearEdge};
use mills::{cutter, mill, side_arcs};
use std::f64::consts::{PI, TAU};

const K: LinearEdge = LinearEdge { k_tc: 842.0, k_rc: 300.0, k_ac: 150.0, k_te: 15.0, k_re: 12.0, k_ae: 2.0 };
const RPS: f64 = 40.0;
const FLUTES: u32 = 3;

/// A cut on the side of a flat mill.
#[derive(Debug, Clone, Copy)]
struct Side {
    diameter_mm: f64,
    helix_deg: f64,
    depth_mm: f64,
    arc: [f64; 2],
    per_tooth_mm: f64,
}

/// ∫ of the forces of 1 mm of height over the immersion, from 0 to φ: along the feed, to its left, up the axis, and the
/// tangential force. With t = k_tc f sin φ + k_te against the rotation and r alike: F_x = −t cos φ − r sin φ, F_y = t
/// sin φ − r cos φ.
fn integral(f: f64, phi: f64) -> [f64; 4] {
    let (sin, cos) = phi.sin_cos();
    let (sin_cos, sin_sin) = (0.5 * sin * sin, 0.5 * (phi - sin * cos));
    [
        -K.k_tc * f * sin_cos - K.k_te * sin - K.k_rc * f * sin_sin + K.k_re * cos,
        K.k_tc * f * sin_sin - K.k_te * cos - K.k_rc * f * sin_cos - K.k_re * sin,
        K.k_ac * f * cos - K.k_ae * phi,
        -K.k_tc * f * cos + K.k_te * phi,
    ]
}

/// Largest force in the plane, along the axis, and torque, N and N·mm, of edges that are helices: a tooth whose tip is
/// at φ₀ reaches back to φ₀ − L, L = depth tan β / R, and what of that is in the arc [a, b] carries R / tan β ∫ dF.
fn peaks(side: &Side) -> [f64; 3] {
    let radius = 0.5 * side.diameter_mm;
    let slope = side.helix_deg.to_radians().tan() / radius;
    let (lag, [a, b]) = (side.depth_mm * slope, side.arc);
    let pitch = TAU / f64::from(FLUTES);
    let mut most = [0.0f64; 3];
    let steps = 10_000;
    for step in 0..steps {
        let theta = pitch * f64::from(step) / f64::from(steps);
        let mut sum = [0.0; 4];
        // Tips of all teeth, and of those a turn behind, whose edges still reach into the arc.
        for tooth in -9..9 {
            let tip = theta + pitch * f64::from(tooth);
            let (high, low) = (tip.min(b), (tip - lag).max(a));
            if slope == 0.0 {
                if (a..=b).contains(&tip) {
                    let h = 1e-6;
                    let ends = [integral(side.per_tooth_mm, tip - h), integral(side.per_tooth_mm, tip + h)];
                    (0..4).for_each(|k| sum[k] += side.depth_mm * (ends[1][k] - ends[0][k]) / (2.0 * h));
                }
            } else if high > low {
                let ends = [integral(side.per_tooth_mm, low), integral(side.per_tooth_mm, high)];
                (0..4).for_each(|k| sum[k] += (ends[1][k] - ends[0][k]) / slope);
            }
        }
        let here = [sum[0].hypot(sum[1]), sum[2].abs(), sum[3] * radius];
        most = [0, 1, 2].map(|k| most[k].max(here[k]));
    }
    most
}

/// Widths of 0.1 … 1 mm, up and climb, helices, diameters and depths of finishing passes.
fn cuts() -> Vec<(Side, f64)> {
    let mut cuts = Vec::new();
    for diameter_mm in [4.0, 6.0, 10.0, 16.0, 25.0] {
        for helix_deg in [0.0, 20.0, 30.0, 40.0, 45.0] {
            for depth in [0.2, 0.5, 1.0, 2.0] {
                for width_mm in [0.1f64, 0.2, 0.3, 0.5, 0.7, 1.0] {
                    let immersion = (1.0 - 2.0 * width_mm / diameter_mm).acos();
                    for arc in [[0.0, immersion], [PI - immersion, PI]] {
                        for per_tooth_mm in [0.01, 0.1] {
                            let side =
                                Side { diameter_mm, helix_deg, depth_mm: depth * diameter_mm, arc, per_tooth_mm };
                            cuts.push((side, width_mm));
                        }
                    }
                }
            }
        }
    }
    cuts
}

#[test]
fn peaks_of_light_cuts_are_those_of_a_helical_edge() {
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    let mut wrong = Vec::new();
    for (mut side, width_mm) in cuts() {
        let tool = mill(Profile::flat(side.diameter_mm, 60.0), side.diameter_mm, FLUTES, side.helix_deg);
        let rings = tool.profile.rings(1);
        let arcs = side_arcs(&rings, side.depth_mm, side.arc[0], side.arc[1]);
        // As deep as the rings that are engaged.
        side.depth_mm = arcs.iter().map(|arc| rings[arc.slice as usize].edge_mm).sum();
        let cutter = cutter(&tool, &rings, ForceModel::LinearEdge(K), RPS);
        let feed_mm_s = side.per_tooth_mm * f64::from(FLUTES) * RPS;
        let loads = cutter.loads(&Cut { arcs: &arcs, ..Cut::default() }, feed_mm_s);
        let ours = [loads.force_xy_peak_n, loads.force_axial_peak_n, 1e3 * loads.torque_peak_nm];
        for (k, (ours, known)) in ours.into_iter().zip(peaks(&side)).enumerate() {
            let error = ours / known - 1.0;
            if error < range[k][0] || error > range[k][1] {
                println!("{} {:+.3} %: {width_mm} mm of {side:?}", ["xy", "axial", "torque"][k], 100.0 * error);
            }
            range[k] = [range[k][0].min(error), range[k][1].max(error)];
            if !(-0.005..=0.02).contains(&error) {
                wrong.push(format!("{k} {:+.2} %: {width_mm} mm of {side:?}", 100.0 * error));
            }
        }
    }
    println!("errors of the peaks in the plane, along the axis, of the torque: {range:.5?}");
    assert!(wrong.is_empty(), "{} wrong, {}", wrong.len(), wrong.join("\n"));
}
