//! A load line (peaks, means, exact cap) at a station of a flat end mill with 20 rings, against the plain sum over 360
//! angles of rotation in the same run. Prints times, their ratio, and the error of the sum.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "../tests/common/mills.rs"]
mod mills;

use feedwright::engage::EngagedArc;
use feedwright::force::{Cap, Cut};
use feedwright::machine::material::{ForceModel, LinearEdge};
use feedwright::machine::{LimitKind, Profile, Slice, Tool};
use mills::mill;
use std::f64::consts::{PI, TAU};
use std::hint::black_box;
use std::time::Instant;

const K: LinearEdge = LinearEdge { k_tc: 842.0, k_rc: 300.0, k_ac: 150.0, k_te: 15.0, k_re: 12.0, k_ae: 2.0 };
const RPS: f64 = 100.0;
const FEED: f64 = 20.0;

fn main() {
    let tool = mill(Profile::flat(10.0, 20.0), 10.0, 3, 30.0);
    let slices = tool.profile.slices(0.25);
    let cutter = mills::cutter(&tool, &slices, ForceModel::LinearEdge(K), RPS);
    let arcs: Vec<EngagedArc> = slices
        .iter()
        .enumerate()
        .filter(|(_, slice)| slice.normal_r > 0.5 && slice.z_mm < 5.0)
        .map(|(k, _)| EngagedArc { slice: k as u32, entry_rad: (PI - 1.1) as f32, exit_rad: PI as f32 })
        .collect();
    let cut = Cut { arcs: &arcs, ..Cut::default() };
    let line_s = best_of(|| black_box(cutter.line(black_box(&cut))));
    let loads_s = best_of(|| black_box(cutter.loads(black_box(&cut), FEED)));
    let cap_s = best_of(|| {
        let line = cutter.line(black_box(&cut));
        (black_box(line.loads(FEED)), black_box(line.cap(LimitKind::ForceXy, 300.0)))
    });
    let sum_s = best_of(|| black_box(peak_by_sum(&tool, &slices, black_box(&arcs), FEED, 360)));
    let exact = cutter.loads(&cut, FEED).force_xy_peak_n;
    let fine = peak_by_sum(&tool, &slices, &arcs, FEED, 360_000);
    let coarse = peak_by_sum(&tool, &slices, &arcs, FEED, 360);
    println!("{} rings engaged", arcs.len());
    println!("load line of a station        {:8.3} µs", line_s * 1e6);
    println!("load line and loads at a feed {:8.3} µs", loads_s * 1e6);
    println!("the same and an exact cap     {:8.3} µs", cap_s * 1e6);
    println!("sum over 360 angles           {:8.3} µs, {:.0} times as long", sum_s * 1e6, sum_s / loads_s);
    println!("peak: exact {exact:.6} N, 360,000 angles {fine:.6} N, 360 angles {coarse:.6} N");
    println!("error of ours against 360,000 angles {:.1e}", (exact / fine - 1.0).abs());
    let Cap::Feed { feed_mm_s, .. } = cutter.line(&cut).cap(LimitKind::ForceXy, 300.0) else { return };
    let back = peak_by_sum(&tool, &slices, &arcs, feed_mm_s, 360_000);
    println!("cap at 300 N: {feed_mm_s:.6} mm/s, where 360,000 angles give {back:.6} N");
}

/// Shortest mean time of four hundred short runs, s.
fn best_of<T>(mut work: impl FnMut() -> T) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..400 {
        let begin = Instant::now();
        let mut repeats = 0;
        while begin.elapsed().as_secs_f64() < 0.002 {
            for _ in 0..20 {
                black_box(work());
            }
            repeats += 20;
        }
        best = best.min(begin.elapsed().as_secs_f64() / f64::from(repeats));
    }
    best
}

/// Largest resultant over `steps` angles of one turn, by the definitions alone.
fn peak_by_sum(tool: &Tool, slices: &[Slice], arcs: &[EngagedArc], feed: f64, steps: usize) -> f64 {
    let per_tooth = feed / (RPS * f64::from(tool.flutes));
    let mut peak = 0.0f64;
    for step in 0..steps {
        let theta = (step as f64 + 0.5) * TAU / steps as f64;
        let (mut x, mut y) = (0.0, 0.0);
        for arc in arcs {
            let slice = &slices[arc.slice as usize];
            for tooth in 0..tool.flutes {
                let lag = slice.z_mm * tool.helix_rad.tan() / tool.radius_mm();
                let phi = (theta + TAU * f64::from(tooth) / f64::from(tool.flutes) - lag).rem_euclid(TAU);
                if phi < f64::from(arc.entry_rad) || phi > f64::from(arc.exit_rad) {
                    continue;
                }
                let (sin, cos) = phi.sin_cos();
                let h = per_tooth * sin;
                let (t, r) = ((K.k_tc * h + K.k_te) * slice.edge_mm, (K.k_rc * h + K.k_re) * slice.edge_mm);
                x += -t * cos - r * sin;
                y += t * sin - r * cos;
            }
        }
        peak = peak.max(x.hypot(y));
    }
    peak
}
