//! Test cuts by `calibrate --plan`: the program's text alone, followed by a reader of its own at constant feed, makes a log
//! by closed forms of power and force; `calibrate` must find the coefficients in it. And a load meter read by eye.

#![allow(clippy::format_collect, clippy::unwrap_used)]

mod common {
    pub mod follow;
}

use common::follow::{At, Noise, clear_of_ends, follow, job, log};
use feedwright::learn::calibrate::load_meter::{coefficients, parse};
use feedwright::learn::calibrate::plan::{Kind, Plan, plan};
use feedwright::learn::calibrate::{CalibrateOptions, Calibration, calibrate};
use feedwright::learn::dataset::binning::channels;
use feedwright::learn::dataset::steady_cuts::steady_cuts;
use feedwright::learn::log::read_log;
use feedwright::learn::log::resultant::Sample;
use feedwright::learn::program::simulated::simulate;
use feedwright::learn::session::{LogOptions, aligned, run};
use std::f64::consts::{PI, TAU};

/// True coefficients; the setup declares others.
const K_TC: f64 = 900.0;
const K_RC: f64 = 380.0;
const K_TE: f64 = 21.0;
const K_RE: f64 = 14.0;
const TARE: f64 = 310.0;
fn calibrated(plan: &Plan, log: &str) -> Calibration {
    let job = job();
    let log = read_log(log.as_bytes(), &[]).unwrap();
    let prepared = simulate(plan.program.as_bytes(), &job, false).unwrap();
    let tied = aligned(&prepared, &job, &log, &channels(&log)).unwrap();
    let (frame, rows) = steady_cuts(&log, &tied, prepared.timeline(), &job, false).unwrap();
    calibrate(&frame, &rows, plan.model, CalibrateOptions::default(), |y| y).unwrap()
}

/// The condition that a plan states, in its program as well, is that of the fit on the log of its cuts.
fn condition_is_as_stated(plan: &Plan, c: &Calibration) {
    assert!((c.condition / plan.condition - 1.0).abs() < 0.05, "{} stated, {} found", plan.condition, c.condition);
    assert!(plan.program.contains(&format!("condition {:.1}", plan.condition)));
}

fn value(c: &Calibration, name: &str) -> (f64, f64) {
    let found = c.parameters.iter().find(|p| p.name == name).unwrap();
    (found.value, found.std_error)
}

fn agree(c: &Calibration, expected: &[(&str, f64)], share: f64) {
    for (name, truth) in expected {
        let (found, error) = value(c, name);
        assert!((found / truth - 1.0).abs() < share, "{name}: {found} ± {error} for {truth}\n{c:?}");
    }
}

/// Power in the middle of a flat cut: tare + k_tc a b f + k_te a r θ N n.
fn flat_power(axial: f64, radial: f64, feed: f64, rps: f64) -> f64 {
    let theta = (1.0 - radial / 5.0).acos();
    TARE + 1e-3 * (K_TC * axial * radial * feed + K_TE * axial * 5.0 * theta * 3.0 * rps)
}

#[test]
fn power_cuts_give_their_coefficients_back() {
    let plan = plan(Kind::Power, &job()).unwrap();
    assert_eq!(plan.cuts.len(), 32);
    assert!(plan.condition < 30.0 && plan.program.contains("condition"), "{}", plan.condition);
    let mut noise = Noise(1);
    let text = log(&follow(&plan.program, 5.0), "spindle_power_w", |s| {
        let power = s.cut.map_or(TARE, |(axial, radial)| flat_power(axial, radial, s.feed_mm_s, s.rps));
        format!("{:.1}", power + 0.03 * power * noise.normal())
    });
    let c = calibrated(&plan, &text);
    // The cuts, and three times to and fro in air.
    assert_eq!(c.tests, 32 + 6);
    agree(&c, &[("k_tc", K_TC), ("k_te", K_TE), ("tare", TARE)], 0.03);
    assert!(c.indistinguishable.is_empty() && c.condition < 30.0, "{c:?}");
    condition_is_as_stated(&plan, &c);
    // Flat: Xu's ratios leave 16 % on forces.
    assert_eq!(c.force_uncertainty, Some(0.16));
}

#[test]
fn mean_force_cuts_give_their_coefficients_back() {
    let plan = plan(Kind::MeanForce, &job()).unwrap();
    assert_eq!(plan.cuts.len(), 9);
    assert!(plan.condition < 40.0, "{}", plan.condition);
    let c = calibrated(&plan, &mean_forces(&follow(&plan.program, 5.0)));
    assert_eq!(c.tests, 9);
    condition_is_as_stated(&plan, &c);
    agree(&c, &[("k_tc", K_TC), ("k_rc", K_RC), ("k_te", K_TE), ("k_re", K_RE)], 0.03);
}

/// A log whose force samples are means over turns: `learn --sample mean` compares them with the predicted mean force.
#[test]
fn mean_forces_of_a_log_are_learned_from() {
    let plan = plan(Kind::MeanForce, &job()).unwrap();
    let samples: Vec<At> = clear_of_ends(follow(&plan.program, 5.0), 5.0).into_iter().step_by(2).collect();
    let text = mean_forces(&samples);
    let options = LogOptions { sample: Sample::Mean, ..LogOptions::default() };
    let learned = run(plan.program.as_bytes(), &job(), text.as_bytes(), &options, None).unwrap();
    let (report, data) = (learned.report, learned.data);
    assert_eq!(data.channel_names, ["force_xy_n (mean)"]);
    assert!(report.effects.is_empty() && report.supports_model, "{}", report.verdict);
    // The declared coefficients miss by far more than the 4 N of the noise; those learned do not.
    let declared: Vec<f64> = data.base.iter().map(|b| b.prior.unwrap().0).collect();
    let of = |k: &dyn Fn(usize) -> f64, i: usize| (0..4).map(|b| k(b) * data.columns[b][i]).sum::<f64>();
    let cutting: Vec<usize> = data.used().filter(|i| data.reading[*i] > 50.0).collect();
    let rms = |k: &dyn Fn(usize) -> f64| {
        let squares = cutting.iter().map(|i| (data.reading[*i] - of(k, *i)).powi(2)).sum::<f64>();
        (squares / cutting.len() as f64).sqrt()
    };
    let learned = |b: usize| report.final_base.iter().find(|v| v.name == data.base[b].name).unwrap().value;
    assert!(
        cutting.len() > 200 && rms(&|b| declared[b]) > 20.0 && rms(&learned) < 5.0,
        "{} {}",
        rms(&|b| declared[b]),
        rms(&learned)
    );
}

/// Mean forces of flat climb cuts with 4 N of noise. Independent of the closed form: the mean over a turn of the force of one
/// tooth, summed over its angles, on the workpiece, machine axes: feed along +X, the wall towards −Y.
fn mean_forces(samples: &[At]) -> String {
    let mut noise = Noise(2);
    log(samples, "force_x_n,force_y_n", |s| {
        let (mut fx, mut fy) = (0.0, 0.0);
        if let Some((axial, radial)) = s.cut {
            let (theta, ft, steps) = ((1.0 - radial / 5.0).acos(), s.feed_mm_s / (3.0 * s.rps), 400);
            for k in 0..steps {
                let phi = PI - theta + theta * (f64::from(k) + 0.5) / f64::from(steps);
                let h = ft * phi.sin();
                let (t, r) = (K_TC * h + K_TE, K_RC * h + K_RE);
                // On the tool, y to the left: tangential along (−cos φ, sin φ), radial along −(sin φ, cos φ).
                let share = axial * 3.0 / TAU * theta / f64::from(steps);
                fx -= share * (-t * phi.cos() - r * phi.sin());
                fy -= share * (t * phi.sin() - r * phi.cos());
            }
        }
        format!("{:.2},{:.2}", fx + 4.0 * noise.normal(), fy + 4.0 * noise.normal())
    })
}

#[test]
fn layers_of_a_ball_give_their_coefficients_back() {
    let plan = plan(Kind::Layer, &job()).unwrap();
    // Before the cuts were chosen: 62.
    assert!(plan.condition < 14.0, "{}", plan.condition);
    let truth = [3.6, 8.0, 0.35, 0.9];
    let per_mm = |height: f64, radial: f64, fz: f64| {
        let r = (16.0 - (4.0 - height).powi(2)).sqrt();
        let alpha = (1.0 - (radial / r).min(2.0)).acos();
        let chip_um = 1e3 * (r - (r * r + fz * fz - 2.0 * r * fz * alpha.sin()).sqrt());
        let length = r * alpha;
        truth[0] + truth[1] * length + truth[2] * chip_um + truth[3] * length * chip_um
    };
    let mut noise = Noise(3);
    let text = log(&follow(&plan.program, 4.0), "force_xy_n", |s| {
        let fz = s.feed_mm_s / (2.0 * s.rps);
        let force = s.cut.map_or(0.0, |(axial, radial)| {
            (0..200).map(|k| per_mm(axial * (f64::from(k) + 0.5) / 200.0, radial, fz) * axial / 200.0).sum()
        });
        format!("{:.3}", force * (1.0 + 0.01 * noise.normal()))
    });
    let c = calibrated(&plan, &text);
    assert_eq!(c.tests + 4, plan.cuts.len());
    condition_is_as_stated(&plan, &c);
    // The four coefficients hang together; what they say of a layer is what counts.
    let found = ["c0", "c1", "c2", "c3"].map(|name| value(&c, name).0);
    for cut in plan.cuts.iter().filter(|cut| cut.axial_mm > 1.0) {
        let (height, fz) = (cut.axial_mm - 0.4, cut.feed_per_tooth_mm);
        let r = (16.0 - (4.0 - height).powi(2)).sqrt();
        let (length, chip) = feedwright::force::closed::ball_layer(4.0, height, cut.radial_mm, fz);
        assert!(length < r * PI);
        let layer = found[0] + found[1] * length + found[2] * 1e3 * chip + found[3] * length * 1e3 * chip;
        assert!((layer / per_mm(height, cut.radial_mm, fz) - 1.0).abs() < 0.05, "{cut:?}: {layer} {found:?}");
    }
}

#[test]
fn a_block_or_a_tool_that_does_not_suit_is_said() {
    let mut small = job();
    if let feedwright::machine::StockShape::Box(b) = &mut small.stocks[0].shape {
        b.max.y = 12.0;
    }
    assert!(plan(Kind::Power, &small).unwrap_err().to_string().contains("too small"));
    let mut bare = job();
    bare.tools.remove(1);
    assert!(plan(Kind::Layer, &bare).unwrap_err().to_string().contains("no ball end mill"));
}

/// The needle shows the heaviest cut of the power plan: the slot at the largest feed.
#[test]
fn a_load_meter_read_by_eye_gives_coefficients_within_their_errors() {
    let job = job();
    let plan = plan(Kind::Power, &job).unwrap();
    let prepared = simulate(plan.program.as_bytes(), &job, false).unwrap();
    let heaviest = plan
        .cuts
        .iter()
        .filter(|c| c.radial_mm > 9.9)
        .max_by(|a, b| a.feed_per_tooth_mm.total_cmp(&b.feed_per_tooth_mm));
    let (rps, cut) =
        (prepared.timeline().spots.iter().find(|s| s.engaged.section_mm2 > 0.0).unwrap().rps, heaviest.unwrap());
    let peak = flat_power(cut.axial_mm, cut.radial_mm, cut.feed_per_tooth_mm * 3.0 * rps, rps);
    let reading = format!("T1 peak {:.0}% idle {:.0}%", peak / 75.0, TARE / 75.0);
    let c = coefficients(&[parse(&reading).unwrap()], &prepared, &job).unwrap();
    let ((k_tc, tc_error), (k_te, te_error)) = (value(&c, "k_tc"), value(&c, "k_te"));
    assert!((k_tc - K_TC).abs() < 2.0 * tc_error && (k_te - K_TE).abs() < 2.0 * te_error, "{reading}: {c:?}");
    // Honest: worse than a calibration, and not so bad that it says nothing.
    assert!((0.1..0.5).contains(&(tc_error / k_tc)) && te_error / k_te > tc_error / k_tc, "{c:?}");
    assert!(c.force_uncertainty.unwrap() > 0.18);
    let close = parse("T1 peak 6% idle 4%").unwrap();
    assert!(coefficients(&[close], &prepared, &job).unwrap_err().to_string().contains("closer than they can be read"));
    let other = parse("T9 peak 60% idle 4%").unwrap();
    assert!(coefficients(&[other], &prepared, &job).unwrap_err().to_string().contains("no such tool"));
}
