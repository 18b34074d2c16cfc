//! Block delete: a pass under the switch takes half of what a later pass meets. The feed written for that pass must be
//! safe with the switch on, when it meets all of it; and the proof is made in both positions.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use assert_cmd::Command;
use serde_json::Value;
use std::fs;

const SETUP: &str = r#"
resolution = 0.5
[machine]
dialect = "fanuc"
[stock]
box = { min = [0, 0, -10], max = [40, 20, 0] }
[material]
k_tc = 800
k_te = 14
[[tool]]
number = 1
shape = "flat"
diameter = 6
flutes = 3
# This is about something else than what may rise.
[raise]
plunges = true
ramps = true
entries = true
finishing = true
compensation = true
cycles = true
[limits]
feed_change = { max = 2.0 }
force_xy = 200
"#;

const LAST: &str = "G1 X50. F900. (last)";

/// Feed of the longest piece of the last pass in the program with this first pass, and the worst load over its limit that was
/// found when the written program was read back.
fn last_feed(first: &str) -> (f64, f64) {
    let dir = tempfile::tempdir().unwrap();
    let text = format!(
        "%\nO1\nG21 G90\nS8000 M3\nG0 X-10. Y8. Z2.\nZ-2.\n{first}\nG0 Z5.\nX-10.\nZ-4.\n{LAST}\nG0 Z10.\nM30\n%\n"
    );
    fs::write(dir.path().join("part.nc"), &text).unwrap();
    fs::write(dir.path().join("part.setup.toml"), SETUP).unwrap();
    let mut command = Command::cargo_bin("feedwright").unwrap();
    let run =
        command.current_dir(dir.path()).args(["optimize", "part.nc", "--json", "r.json", "--json-blocks", "--quiet"]);
    run.assert().success();
    let verified = Command::cargo_bin("feedwright")
        .unwrap()
        .current_dir(dir.path())
        .args(["verify", "part.nc", "part.fw.nc"])
        .output()
        .unwrap();
    assert!(verified.status.success(), "{}", String::from_utf8_lossy(&verified.stdout));
    let report: Value = serde_json::from_slice(&fs::read(dir.path().join("r.json")).unwrap()).unwrap();
    assert_eq!(report["tool"][0]["number"], 1, "the only tool of the setup is the one that cuts");
    let written = fs::read_to_string(dir.path().join("part.fw.nc")).unwrap();
    let (_, last) = written.split_once("Z-4.\n").unwrap();
    let word = |line: &str, letter: char| -> Option<f64> {
        let at = line.find(&format!(" {letter}"))?;
        line[at + 2..].split_whitespace().next()?.parse().ok()
    };
    let (mut at, mut feed, mut longest) = (-10.0, f64::NAN, (0.0, f64::NAN));
    for line in last.lines().take_while(|line| !line.starts_with("G0")) {
        let to = word(line, 'X').unwrap();
        feed = word(line, 'F').unwrap_or(feed);
        longest = if to - at > longest.0 { (to - at, feed) } else { longest };
        at = to;
    }
    (longest.1, report["check"]["resimulated_worst_ratio"].as_f64().unwrap())
}

#[test]
fn the_feed_is_safe_in_both_positions_of_the_switch() {
    let [(with, _), (without, alone), (switched, read_back)] =
        ["G1 X50. F900.", "G4 P1", "/G1 X50. F900."].map(last_feed);
    println!("behind the pass {with:.0}, without it {without:.0}, under the switch {switched:.0} mm/min");
    assert!(without < 0.8 * with, "{without} {with}");
    assert!((switched / without - 1.0).abs() < 0.05, "{switched} where {without} is safe");
    // Read back with the switch on as well: there the pass meets what it meets where the other is not there.
    assert!((read_back - alone).abs() < 0.03 && read_back > 0.9, "{read_back} {alone}");
}
