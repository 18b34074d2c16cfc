//! Rivals that explain a log equally well: the program of `learn --experiment` parts them. And the report as a page.
//!
//! The test program eats through the block from its back, so that "from some instant on" and "beyond some place" are
//! the same samples: a chipped edge and a hard zone cannot be separated by its log.

#![allow(clippy::format_collect, clippy::unwrap_used)]

mod common {
    pub mod follow;
}

use assert_cmd::Command;
use common::follow::{At, Noise, SETUP, clear_of_ends, follow, job, log};
use feedwright::learn::calibrate::experiment::{difference, experiment, rivals};
use feedwright::learn::calibrate::plan::{Kind, plan};
use feedwright::learn::report::Confounded;
use feedwright::learn::session::{Learned, LogOptions, run};

/// Power of a flat cut; from half of the run on everything takes a sixth more.
fn power(s: &At, half_s: f64) -> f64 {
    let more = if s.time_s > half_s { 1.16 } else { 1.0 };
    s.cut.map_or(310.0, |(axial, radial)| {
        let theta = (1.0 - radial / 5.0f64).acos();
        310.0 + more * 1e-3 * (900.0 * axial * radial * s.feed_mm_s + 21.0 * axial * 5.0 * theta * 3.0 * s.rps)
    })
}

fn measured() -> (String, String) {
    let program = plan(Kind::Power, &job()).unwrap().program;
    let samples: Vec<At> = clear_of_ends(follow(&program, 5.0), 5.0).into_iter().step_by(5).collect();
    let half_s = 0.5 * samples.last().unwrap().time_s;
    let mut noise = Noise(11);
    let text = log(&samples, "spindle_power_w", |s| format!("{:.1}", power(s, half_s) + 20.0 * noise.normal()));
    (program, text)
}

#[test]
fn the_next_cut_parts_the_rivals() {
    let (program, text) = measured();
    let Learned { mut report, data } =
        run(program.as_bytes(), &job(), text.as_bytes(), &LogOptions::default(), None).unwrap();
    // The truth is among the confounded, and so is the rival that the program cannot part from it.
    let both = |c: &Confounded| ["edge-chipping", "hard-zone"].iter().all(|name| c.names.iter().any(|n| n == name));
    assert!(report.confounded.iter().any(both), "{}", report.verdict);
    assert!(
        report.verdict.contains("one of: ") && report.verdict.contains("cannot be separated by this log"),
        "{}",
        report.verdict
    );
    report.confounded.retain(both);
    report.confounded[0].names.retain(|name| ["edge-chipping", "hard-zone"].contains(&name.as_str()));
    let names = report.confounded[0].names.join(" from ");
    let fitted = rivals(&data, &report, &report.confounded[0]);
    assert_eq!(fitted.len(), 2);
    // Both explain this log to within its noise (20 W at the meter)…
    let rms = |k: usize| {
        let residual = fitted[k].residuals(&data);
        (data.used().map(|i| residual[i].powi(2)).sum::<f64>() / data.used().count() as f64).sqrt()
    };
    assert!(rms(0) < 40.0 && rms(1) < 40.0, "{} {}", rms(0), rms(1));
    // … and differ in the mean by more than the noise of one reading where the experiment cuts, air included, and by
    // several times what they differ by on the log.
    let next = experiment(&data, &report, &job()).unwrap().unwrap();
    let between = fitted[0].predicted.iter().zip(&fitted[1].predicted).map(|(a, b)| (a - b).powi(2));
    let on_log = (between.sum::<f64>() / data.len() as f64).sqrt();
    assert!(next.noise.is_some_and(|n| (15.0..25.0).contains(&n) && next.difference > 1.5 * n), "{next:?}");
    assert!(next.difference > 3.0 * on_log, "{} {on_log}", next.difference);
    let again = difference(&next.program, &fitted, &job(), &data).unwrap();
    assert!((again - next.difference).abs() < 1e-9 * again, "{again} {next:?}");
    let head = next.program.lines().take(4).collect::<Vec<_>>().join("\n");
    assert!(head.contains(&format!("separates {names}")), "{head}");
}

#[test]
fn without_rivals_there_is_no_experiment_and_the_page_stands_alone() {
    let (program, text) = measured();
    let dir = tempfile::tempdir().unwrap();
    for (name, text) in [("part.nc", program.as_str()), ("part.setup.toml", SETUP), ("log.csv", text.as_str())] {
        std::fs::write(dir.path().join(name), text).unwrap();
    }
    let run = |arguments: &[&str]| {
        Command::cargo_bin("feedwright").unwrap().current_dir(dir.path()).args(arguments).output().unwrap()
    };
    let output = run(&[
        "learn",
        "part.nc",
        "--log",
        "log.csv",
        "--report",
        "r.html",
        "--experiment",
        "next.nc",
        "--json",
        "r.json",
    ]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(dir.path().join("r.json")).unwrap()).unwrap();
    let rivals = json["confounded"].as_array().unwrap().len();
    assert_eq!(dir.path().join("next.nc").exists(), rivals > 0, "{said}");
    let page = std::fs::read_to_string(dir.path().join("r.html")).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</body></html>\n"));
    assert!(page.matches("<svg").count() >= 2 && page.matches("<polyline").count() > 8);
    assert!(page.contains("predicted before") && page.contains("base model, held out"));
    // Nothing is fetched from anywhere, and no number failed.
    assert!(!page.contains("src=") && !page.contains("href=") && !page.contains("NaN"), "{page}");
    // Written again in its own place, without --force.
    assert!(run(&["learn", "part.nc", "--log", "log.csv", "--report", "r.html"]).status.success());
}
