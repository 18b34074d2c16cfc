//! The linear edge model against a plain sum over rings, teeth and rotation angles.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/mills.rs"]
mod mills;

use feedwright::engage::EngagedArc;
use feedwright::force::{Cap, Cut, Cutter};
use feedwright::machine::material::{ForceModel, LinearEdge};
use feedwright::machine::{LimitKind, Profile, Slice, Tool};
use mills::mill;
use std::f64::consts::{PI, TAU};

const K: LinearEdge = LinearEdge { k_tc: 842.0, k_rc: 300.0, k_ac: 150.0, k_te: 15.0, k_re: 12.0, k_ae: 2.0 };
const RPS: f64 = 40.0;

fn cutter(tool: &Tool, slices: &[Slice]) -> Cutter {
    mills::cutter(tool, slices, ForceModel::LinearEdge(K), RPS)
}

/// Where an arc has a chip: c n_r sin φ + t_z n_z > 0.
fn cutting(slice: &Slice, arc: &EngagedArc, c: f64, tangent_z: f64) -> Vec<[f64; 2]> {
    let (entry, exit) = (arc.entry_rad as f64, arc.exit_rad as f64);
    let (swing, base) = (c * slice.normal_r, tangent_z * slice.normal_z);
    if base > swing.abs() {
        return vec![[entry, exit]];
    }
    if swing <= 1e-12 || base < -swing {
        return Vec::new();
    }
    let low = (-base / swing).asin();
    let zone = |turn: i32| {
        let shift = TAU * f64::from(turn);
        [entry.max(low + shift), exit.min(PI - low + shift)]
    };
    (-2..3).map(zone).filter(|[from, to]| from < to).collect()
}

/// Forces on the tool (x, y, z) and torque at rotation θ, by the definitions alone: where a cylindrical side cuts, the
/// edge on a ring lags evenly from its bottom to its top, and what of it is in the arc cuts (Gauss, four points);
/// elsewhere it is at one angle.
fn at_angle(tool: &Tool, slices: &[Slice], cut: &Cut, feed: f64, theta: f64) -> [f64; 4] {
    const GAUSS: [[f64; 2]; 4] = [
        [-0.861_136_311_594_053, 0.347_854_845_137_454],
        [-0.339_981_043_584_856, 0.652_145_154_862_546],
        [0.339_981_043_584_856, 0.652_145_154_862_546],
        [0.861_136_311_594_053, 0.347_854_845_137_454],
    ];
    let n = tool.flutes as usize;
    let c = (1.0 - cut.tangent_z * cut.tangent_z).sqrt();
    let on_side = cut.arcs.iter().any(|arc| slices[arc.slice as usize].normal_r > 0.999);
    let mut sum = [0.0; 4];
    for arc in cut.arcs {
        let slice = &slices[arc.slice as usize];
        let per_mm = tool.helix_rad.tan() / tool.radius_mm();
        let (lag, width) = (slice.z_mm * per_mm, if on_side { (slice.dz_mm() * per_mm).abs() } else { 0.0 });
        for [from, to] in cutting(slice, arc, c, cut.tangent_z) {
            let mut position = 0.0;
            for j in 0..n {
                let before = if tool.pitch_rad.is_empty() { TAU / n as f64 } else { tool.pitch_rad[(j + n - 1) % n] };
                if j > 0 {
                    position -= before;
                }
                let middle = theta + position - lag;
                let turns = ((middle + 0.5 * width - from) / TAU).floor();
                for phi in [0.0, 1.0].map(|back| middle - (turns + back) * TAU) {
                    let (low, high) = ((phi - 0.5 * width).max(from), (phi + 0.5 * width).min(to));
                    if width == 0.0 && !(from..=to).contains(&phi) || width > 0.0 && low >= high {
                        continue;
                    }
                    let share = if width > 0.0 { (high - low) / width } else { 1.0 };
                    for [place, weight] in GAUSS {
                        let phi = 0.5 * (low + high) + 0.5 * (high - low) * place;
                        let (sin, cos) = phi.sin_cos();
                        let h = feed / RPS * before / TAU * (c * sin * slice.normal_r + cut.tangent_z * slice.normal_z);
                        let du = slice.edge_mm * share * 0.5 * weight;
                        let forces = [K.k_tc * h + K.k_te, K.k_rc * h + K.k_re, K.k_ac * h + K.k_ae];
                        let [t, r, a] = forces.map(|force| force * du);
                        let (nr, nz) = (slice.normal_r, slice.normal_z);
                        sum[0] += -t * cos - r * nr * sin + a * nz * sin;
                        sum[1] += t * sin - r * nr * cos + a * nz * cos;
                        sum[2] += -r * nz - a * nr;
                        sum[3] += t * slice.radius_mm;
                    }
                }
            }
        }
    }
    sum
}

struct Numeric {
    xy_peak: f64,
    z_peak: f64,
    torque_peak: f64,
    mean: [f64; 4],
}

fn numeric(tool: &Tool, slices: &[Slice], cut: &Cut, feed: f64, steps: usize) -> Numeric {
    let mut out = Numeric { xy_peak: 0.0, z_peak: 0.0, torque_peak: 0.0, mean: [0.0; 4] };
    for k in 0..steps {
        let f = at_angle(tool, slices, cut, feed, (k as f64 + 0.5) * TAU / steps as f64);
        out.xy_peak = out.xy_peak.max(f[0].hypot(f[1]));
        out.z_peak = out.z_peak.max(f[2].abs());
        out.torque_peak = out.torque_peak.max(f[3]);
        for (mean, value) in out.mean.iter_mut().zip(f) {
            *mean += value / steps as f64;
        }
    }
    out
}

fn arcs(slices: &[Slice], depth: f64, entry: f64, exit: f64) -> Vec<EngagedArc> {
    let engaged = slices.iter().enumerate().filter(|(_, slice)| slice.z_mm <= depth);
    engaged.map(|(k, _)| EngagedArc { slice: k as u32, entry_rad: entry as f32, exit_rad: exit as f32 }).collect()
}

/// Name, tool, rings, engaged arcs, vertical part of the feed direction.
type Case = (&'static str, Tool, Vec<Slice>, Vec<EngagedArc>, f64);

fn cases() -> Vec<Case> {
    let flat = Profile::flat(10.0, 22.0);
    let ball = Profile::ball(8.0, 20.0);
    let bull = Profile::bull(12.0, 2.0, 20.0);
    let mut out = Vec::new();
    let mut case = |name, tool: Tool, step: f64, depth: f64, entry: f64, exit: f64, tz: f64| {
        let slices = tool.profile.slices(step);
        let arcs = arcs(&slices, depth, entry, exit);
        out.push((name, tool, slices, arcs, tz));
    };
    case("flat climb", mill(flat.clone(), 10.0, 4, 30.0), 0.25, 5.0, PI - 1.0, PI, 0.0);
    case("flat slot, two teeth", mill(flat.clone(), 10.0, 2, 30.0), 0.25, 4.0, 0.0, PI, 0.0);
    case("flat slot, one straight tooth", mill(flat.clone(), 10.0, 1, 0.0), 0.25, 4.0, 0.0, PI, 0.0);
    case("flat up, straight teeth", mill(flat.clone(), 10.0, 3, 0.0), 0.25, 4.0, 0.0, 1.3, 0.0);
    case("flat deep, steep helix", mill(flat.clone(), 10.0, 4, 45.0), 0.5, 20.0, 0.4, 2.9, 0.0);
    case("flat ramping down", mill(flat.clone(), 10.0, 3, 35.0), 0.5, 4.0, 0.0, TAU, -0.1);
    case("flat plunge", mill(flat.clone(), 10.0, 3, 35.0), 0.5, 4.0, 0.0, TAU, -1.0);
    case("ball descending", mill(ball.clone(), 8.0, 2, 30.0), 0.2, 3.0, 0.2, 5.0, -0.4);
    case("ball rising", mill(ball, 8.0, 2, 30.0), 0.2, 3.0, 0.2, 2.5, 0.4);
    case("bull", mill(bull, 12.0, 5, 38.0), 0.3, 6.0, 1.8, PI, 0.0);
    let mut uneven = mill(flat, 10.0, 4, 38.0);
    uneven.pitch_rad = [83.0f64, 97.0, 83.0, 97.0].map(f64::to_radians).to_vec();
    case("uneven pitch", uneven, 0.5, 8.0, 1.0, PI, 0.0);
    out
}

#[test]
fn means_and_peaks_agree_with_the_sum_over_angles() {
    for (name, tool, slices, arcs, tangent_z) in cases() {
        let cut = Cut { arcs: &arcs, tangent_z, ..Cut::default() };
        let cutter = cutter(&tool, &slices);
        for feed in [0.0, 4.0, 16.0] {
            let loads = cutter.loads(&cut, feed);
            let sum = numeric(&tool, &slices, &cut, feed, 36_000);
            let scale = sum.xy_peak.max(sum.z_peak).max(1.0);
            for axis in 0..3 {
                let error = (loads.mean_force_n[axis] - sum.mean[axis]).abs() / scale;
                assert!(
                    error < 3e-4,
                    "{name} feed {feed} axis {axis}: {} {}",
                    loads.mean_force_n[axis],
                    sum.mean[axis]
                );
            }
            // The grid of angles can only miss a peak; of torque and axial force ours may, by a sine's bend over 0.02
            // rad.
            let bend = 0.02f64.powi(2) / 8.0;
            let close = |ours: f64, theirs: f64, what: &str| {
                let missed = if what == "xy" { 5e-6 } else { bend };
                assert!(
                    ours > theirs - missed * theirs.max(scale) - 1e-6,
                    "{name} feed {feed} {what}: {ours} below {theirs}"
                );
                assert!(ours < theirs * 1.001 + 1e-6, "{name} feed {feed} {what}: {ours} above {theirs}");
            };
            close(loads.force_xy_peak_n, sum.xy_peak, "xy");
            close(loads.force_axial_peak_n, sum.z_peak, "z");
            close(loads.torque_peak_nm * 1e3, sum.torque_peak, "torque");
            assert!((loads.torque_nm * 1e3 - sum.mean[3]).abs() < 3e-4 * sum.torque_peak + 1e-9, "{name}");
            let power = 100.0 + TAU * RPS * loads.torque_nm;
            assert!((loads.power_w - power).abs() < 1e-9);
        }
    }
}

#[test]
fn caps_give_back_their_limit_and_its_derivative() {
    for (name, tool, slices, arcs, tangent_z) in cases() {
        let cut = Cut { arcs: &arcs, tangent_z, ..Cut::default() };
        let line = cutter(&tool, &slices).line(&cut);
        for kind in LimitKind::LOADS {
            let limit = line.loads(9.0).bounded_by(kind).unwrap();
            match line.cap(kind, limit) {
                Cap::Feed { feed_mm_s, per_unit } => {
                    // A force that falls before it rises meets the limit twice; what counts is that the load is there.
                    let load = line.loads(feed_mm_s).bounded_by(kind).unwrap();
                    assert!((load / limit - 1.0).abs() < 1e-9, "{name} {kind:?}: {load} at the cap of {limit}");
                    assert!(feed_mm_s > 9.0 - 1e-6, "{name} {kind:?}: {feed_mm_s}");
                    let step = 1e-5 * limit;
                    let Cap::Feed { feed_mm_s: above, .. } = line.cap(kind, limit + step) else { panic!() };
                    let numeric = (above - feed_mm_s) / step;
                    assert!((numeric / per_unit - 1.0).abs() < 1e-3, "{name} {kind:?}: {numeric} {per_unit}");
                }
                Cap::Free => {
                    let far = line.loads(1e4).bounded_by(kind).unwrap();
                    assert!(limit == 0.0 || (far / limit - 1.0).abs() < 1e-9, "{name} {kind:?}: {far} {limit}");
                }
                Cap::Unreachable => {
                    assert!(line.loads(0.0).bounded_by(kind).unwrap() > limit, "{name} {kind:?}");
                }
            }
        }
        let expected = if name == "flat plunge" { Cap::Free } else { Cap::Unreachable };
        assert_eq!(line.cap(LimitKind::ForceXy, 1e-3), expected, "{name}");
    }
}

#[test]
fn nothing_engaged_leaves_the_tare() {
    let tool = mill(Profile::flat(10.0, 22.0), 10.0, 4, 30.0);
    let slices = tool.profile.slices(0.25);
    let line = cutter(&tool, &slices).line(&Cut::default());
    let loads = line.loads(10.0);
    assert_eq!((loads.power_w, loads.force_xy_peak_n, loads.force_axial_peak_n), (100.0, 0.0, 0.0));
    assert_eq!(line.cap(LimitKind::ForceXy, 10.0), Cap::Free);
    assert_eq!(line.cap(LimitKind::Power, 50.0), Cap::Unreachable);
}

#[test]
fn a_plunge_presses_on_the_bottom_only() {
    let tool = mill(Profile::flat(10.0, 22.0), 10.0, 3, 30.0);
    let slices = tool.profile.slices(0.25);
    let arcs = arcs(&slices, 5.0, 0.0, TAU);
    let loads = cutter(&tool, &slices).loads(&Cut { arcs: &arcs, tangent_z: -1.0, ..Cut::default() }, 3.0);
    let h = 3.0 / (3.0 * RPS);
    assert!((loads.force_axial_peak_n / (3.0 * 5.0 * (K.k_rc * h + K.k_re)) - 1.0).abs() < 1e-9);
    let torque = 3.0 * (K.k_tc * h + K.k_te) * 12.5;
    assert!((loads.torque_nm * 1e3 / torque - 1.0).abs() < 1e-9);
    assert!(loads.force_xy_peak_n < 1e-9 && loads.mean_force_n[2] > 0.0);
}
