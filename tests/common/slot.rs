//! A block of 40 × 20 × 10 mm for a mill of 6 mm, optimised through the command: what the tests of the schedule share.

use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Output;
use tempfile::TempDir;

/// The setup, ready for limits.
pub const SETUP: &str = r#"
resolution = 0.5
fixtures = "none"
[machine]
dialect = "linuxcnc"
[stock]
box = { min = [0, 0, -10], max = [40, 20, 0] }
uncertainty = 0.4
[material]
k_tc = 800
k_rc = 300
k_ac = 150
k_te = 14
k_re = 12
k_ae = 2
[[tool]]
number = 1
shape = "flat"
diameter = 6
flutes = 3
overhang = 30
# Measured coefficients: feeds may rise to twice the programmed ones.
[process.base]
k_tc = 800
k_rc = 300
k_ac = 150
k_te = 14
k_re = 12
k_ae = 2
# This is about something else than what may rise.
[raise]
plunges = true
ramps = true
entries = true
finishing = true
compensation = true
cycles = true
[limits]
"#;

/// A folder with the program `part.nc` and its setup.
pub fn bench(program: &str, setup: &str) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("part.nc"), program).unwrap();
    fs::write(dir.path().join("part.setup.toml"), setup).unwrap();
    dir
}

/// The command in a folder.
pub fn feedwright(dir: &Path, words: &[&str]) -> Output {
    Command::cargo_bin("feedwright").unwrap().current_dir(dir).args(words).output().unwrap()
}

/// The report of `optimize` with these options; the table of stations is in `r.csv`.
pub fn optimized(dir: &Path, more: &[&str]) -> Value {
    let words = ["optimize", "part.nc", "--json", "r.json", "--json-blocks", "--csv", "r.csv"];
    let out = feedwright(dir, &[&words, more].concat());
    assert!(out.status.code().is_some_and(|code| code < 2), "{}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_str(&fs::read_to_string(dir.join("r.json")).unwrap()).unwrap()
}

/// A number of a report.
pub fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key}: {value}"))
}

/// What a report says of a limit.
pub fn limit<'a>(report: &'a Value, name: &str) -> &'a Value {
    let limits = report["limits"].as_array().unwrap();
    limits.iter().find(|limit| limit["name"] == name).unwrap_or_else(|| panic!("{name}: {limits:?}"))
}

/// The texts of the warnings of a code.
pub fn warnings(report: &Value, code: &str) -> Vec<String> {
    let warnings = report["warnings"].as_array().unwrap().iter().filter(|warning| warning["code"] == code);
    warnings.map(|warning| warning["text"].as_str().unwrap().to_owned()).collect()
}
