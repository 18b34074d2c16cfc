#!/usr/bin/env python3
"""The exact pass against the crate copp (TOPP2-RA) on one arc: same grid, same axis limits, same optimum?

    cargo bench --bench schedule -- /tmp/arc.csv
    tests/bench/compare_copp.py /tmp/arc.csv

Builds a project of its own in a temporary folder with copp from crates.io (says so and leaves where the registry cannot be
reached). Prints both times of travel, the largest difference of speed, and the ratio of computing times (best of nine)."""
import os
import subprocess
import sys
import tempfile

MANIFEST = """[package]
name = "compare-copp"
version = "0.0.0"
edition = "2024"
[dependencies]
copp = "0.2.2"
"""
MAIN = """use copp::path::{Jet3, Path, cos, sin};
use copp::robot::Robot;
use copp::solver::topp2_ra::{ReachSet2OptionsBuilder, Topp2ProblemBuilder, topp2_ra};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let text = std::fs::read_to_string(std::env::args().nth(1).ok_or("no file")?)?;
    let words: Vec<&str> = text.lines().next().ok_or("empty")?.split_whitespace().collect();
    let value = |name: &str| -> f64 { words[words.iter().position(|w| *w == name).unwrap() + 1].parse().unwrap() };
    let (radius, v, a) = (value("radius"), value("velocity"), value("acceleration"));
    let rows = text.lines().skip(2).map(|l| l.split_once(',').unwrap());
    let (s, ours): (Vec<f64>, Vec<f64>) = rows.map(|(s, b)| (s.parse::<f64>().unwrap(), b.parse::<f64>().unwrap())).unzip();
    let n = s.len();
    let path = Path::from_parametric(move |s: Jet3| vec![radius * cos(s / radius), radius * sin(s / radius)], 0.0, s[n - 1])?;
    let mut robot = Robot::with_capacity(2, n);
    let (vel, acc) = (vec![v; 2], vec![a; 2]);
    let (low, down) = (vec![-v; 2], vec![-a; 2]);
    robot
        .with_s(s.as_slice())?
        .with_q_from_path_2nd(&path, 0, n)?
        .with_axial_velocity((vel.as_slice(), n), (low.as_slice(), n), 0)?
        .with_axial_acceleration((acc.as_slice(), n), (down.as_slice(), n), 0)?;
    let problem = Topp2ProblemBuilder::new(&robot, (0, n - 1), (0.0, 0.0)).build()?;
    let options = ReachSet2OptionsBuilder::new().build()?;
    let (mut best, mut theirs) = (f64::INFINITY, Vec::new());
    for _ in 0..9 {
        let start = Instant::now();
        theirs = topp2_ra(&problem, &options)?;
        best = best.min(start.elapsed().as_secs_f64());
    }
    let travel = |b: &[f64]| (1..n).map(|i| 2.0 * (s[i] - s[i - 1]) / (b[i].sqrt() + b[i - 1].sqrt())).sum::<f64>();
    let apart = (0..n).map(|i| (ours[i].sqrt() - theirs[i].sqrt()).abs()).fold(0.0, f64::max);
    let fastest = theirs.iter().fold(0.0, |m: f64, b| m.max(b.sqrt()));
    println!("travel: ours {:.6} s, copp {:.6} s", travel(&ours), travel(&theirs));
    println!("largest difference of speed {apart:.2e} mm/s of {fastest:.2}");
    let mine = value("seconds");
    println!("computing: ours {:.3} ms, copp {:.3} ms, ratio {:.1}", mine * 1e3, best * 1e3, best / mine);
    Ok(())
}
"""


def main():
    arc = os.path.abspath(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        os.mkdir(os.path.join(folder, "src"))
        open(os.path.join(folder, "Cargo.toml"), "w").write(MANIFEST)
        open(os.path.join(folder, "src", "main.rs"), "w").write(MAIN)
        if subprocess.run(["cargo", "fetch", "--quiet"], cwd=folder).returncode != 0:
            sys.exit("skipped: the registry cannot be reached, so nothing was compared")
        done = subprocess.run(["cargo", "run", "--release", "--quiet", "--", arc], cwd=folder)
        sys.exit(done.returncode)


if __name__ == "__main__":
    main()
