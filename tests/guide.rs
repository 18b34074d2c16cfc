//! The guide is true: every command of `docs/guide.md` runs, in its order, in one folder, and does what the text around it says.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod common {
    pub mod follow;
    pub mod plain_cuts;
}

use assert_cmd::Command;
use common::plain_cuts::{Hidden, Tied, log, rows};
use std::f64::consts::{PI, TAU};
use std::path::Path;

/// Blocks of the guide, each with its language.
fn blocks(guide: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut lines = guide.lines();
    while let Some(line) = lines.next() {
        if let Some(language) = line.strip_prefix("```") {
            let body: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
            found.push((language.to_owned(), body.join("\n")));
        }
    }
    found
}

/// Words of a command line; what stands in quotes is one.
fn words(line: &str) -> Vec<String> {
    let parts = line.split('"').enumerate();
    let word = |(k, part): (usize, &str)| -> Vec<String> {
        if k % 2 == 1 { vec![part.to_owned()] } else { part.split_whitespace().map(str::to_owned).collect() }
    };
    parts.flat_map(word).collect()
}

/// The machine's answer to the test cuts: k_tc 950 N/mm², k_te 17 N/mm, 300 W of tare; 10 mm, 3 flutes. Slots of the plan are
/// cut as wide as the tool; a chip of thickness f sin φ sweeps the immersion angle φ = acos(1 − 2 ae/D).
fn filled(plan: &str) -> String {
    let mut lines = plan.lines().skip_while(|line| !line.starts_with("order"));
    let header = lines.next().unwrap();
    let columns: Vec<&str> = header.split(',').collect();
    let row = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let of =
            |name: &str| -> f64 { fields[columns.iter().position(|column| *column == name).unwrap()].parse().unwrap() };
        let rps = of("spindle_rpm") / 60.0;
        let (feed_per_tooth, depth, width) = (of("feed_per_tooth_mm"), of("axial_depth_mm"), of("radial_depth_mm"));
        let removal_mm3_s = depth * width * feed_per_tooth * 3.0 * rps;
        let immersion = (1.0 - 2.0 * width / 10.0).acos();
        let edge_mm2_s = depth * 3.0 * immersion / TAU * PI * 10.0 * rps;
        let watts = 300.0 + 1e-3 * (950.0 * removal_mm3_s + 17.0 * edge_mm2_s);
        format!("{line}{watts:.0}\n")
    };
    let rows: String = lines.take_while(|line| !line.is_empty()).map(row).collect();
    format!("{header}\n{rows}")
}

#[test]
fn every_command_of_the_guide_runs() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let put = |name: &str, text: &str| std::fs::write(at(name), text).unwrap();
    let program = rows();
    put("part.nc", &program.text);
    put("next.nc", &program.text);
    // A blunt edge: what the log of both parts has in it, and the guide does not know.
    let worn = |seed: u64| log(&program, &[Hidden::Wear(1.5)], Tied::Position, 0.03, seed).0;
    put("log.csv", &worn(7));
    put("next.csv", &worn(8));
    let guide = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/guide.md")).unwrap();
    let (mut run, mut said) = (0, String::new());
    for (language, body) in blocks(&guide) {
        if language == "toml" {
            let setup = std::fs::read_to_string(at("part.setup.toml")).unwrap();
            put("part.setup.toml", &format!("{setup}\n{body}\n"));
            continue;
        }
        for line in body.lines() {
            let line = line.strip_prefix("$ feedwright ").unwrap_or_else(|| panic!("not a command: {line}"));
            // What a person does between two commands: fills the table that the plan printed; lets the next file be written again.
            if line.starts_with("calibrate cuts.csv") {
                put("cuts.csv", &filled(&said));
            }
            let output =
                Command::cargo_bin("feedwright").unwrap().current_dir(folder.path()).args(words(line)).output();
            let output = output.unwrap();
            said = String::from_utf8_lossy(&output.stdout).into_owned();
            let error = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "feedwright {line}: exit {:?}\n{said}\n{error}", output.status.code());
            if line.starts_with("learn") {
                assert!(said.contains("flank-wear"), "{said}");
            }
            if line.starts_with("calibrate cuts.csv") {
                assert!(said.contains("k_tc = 950."), "{said}");
            }
            run += 1;
        }
    }
    assert!(run >= 10, "{run} commands only");
    let feeds = std::fs::read_to_string(at("part.fw.nc")).unwrap();
    assert!(feeds.contains("FORCE_XY") || feeds.contains("POWER"), "no feed says what holds it:\n{feeds}");
}
