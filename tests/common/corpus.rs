//! The real programs in ../shared, found when they are there; a line says so when they are not.
#![allow(dead_code)] // each test file uses its own part of it

use std::path::{Path, PathBuf};
use std::process::Command;

/// Programs of the acceptance list: file and setup.
pub const LISTED: [(&str, &str); 6] = [
    ("programs/camotics_bear.nc", "camotics_bear"),
    ("programs/camotics_botomata_bottom.nc", "camotics_botomata_bottom"),
    ("programs/camotics_tiger.nc", "camotics_tiger"),
    ("programs/ledfloor_1121_btn8.nc", "ledfloor_1121_btn8"),
    ("programs/maestro_PARALLEL.NC", "maestro_PARALLEL"),
    ("measured/nist_mtc/nc/box_op1.nc", "box_op1"),
];

/// A file of ../shared; `None`, said aloud, when it is not there.
pub fn shared(file: &str) -> Option<PathBuf> {
    let path = Path::new("../shared").join(file);
    if path.exists() {
        Some(path)
    } else {
        eprintln!("skipped: {} is not there", path.display());
        None
    }
}

/// Every NC program of ../shared/programs, sorted.
pub fn programs() -> Vec<PathBuf> {
    let Some(folder) = shared("programs") else { return Vec::new() };
    let is_program = |path: &PathBuf| {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        extension.is_some_and(|e| ["nc", "ngc", "tap", "gcode"].contains(&e.as_str()))
    };
    let entries = std::fs::read_dir(folder).expect("the folder can be read");
    let mut found: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).filter(is_program).collect();
    found.sort();
    found
}

/// Is rs274 installed? Said aloud when not.
pub fn rs274_is_there() -> bool {
    let there = Command::new("rs274").arg("-?").output().is_ok();
    if !there {
        eprintln!("skipped: rs274 is not installed");
    }
    there
}

/// Canonical calls that rs274 makes of a program, or its complaint.
pub fn canon(text: &[u8]) -> Result<String, String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("program.ngc");
    std::fs::write(&file, text).expect("the program can be written");
    let output = Command::new("bash").arg("../shared/linuxcnc/canon.sh").arg(&file).output().expect("bash runs");
    let complaint = String::from_utf8_lossy(&output.stderr).trim().to_owned();
    if output.status.success() && complaint.is_empty() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(complaint)
    }
}

/// Canonical calls without feeds, comments, lines and block numbers; a plane selected again is not said again.
pub fn motions(canon: &str) -> Vec<String> {
    let mut plane = String::new();
    let mut kept = Vec::new();
    for (row, at) in canon.lines().filter_map(|row| row.find('(').map(|at| (row, at))) {
        let name = row[..at].rsplit(char::is_whitespace).next().unwrap_or_default();
        let call = format!("{name}{}", &row[at..]);
        let again = name == "SELECT_PLANE" && std::mem::replace(&mut plane, call.clone()) == call;
        if !again && !["SET_FEED_RATE", "COMMENT", "MESSAGE", "SET_FEED_MODE"].contains(&name) {
            kept.push(call);
        }
    }
    kept
}

/// Name and numbers of a call.
fn call(text: &str) -> (&str, Vec<f64>) {
    let (name, rest) = text.split_once('(').unwrap_or((text, ""));
    (name, rest.trim_end_matches(')').split(',').filter_map(|number| number.trim().parse().ok()).collect())
}

/// The same calls in the same order, but that a motion of the first may be several of the second: their ends advance to its
/// end, and arcs keep plane, sense and centre.
pub fn same_motions(before: &[String], after: &[String]) -> Result<(), String> {
    let mut rest = after.iter();
    for whole in before {
        let (name, numbers) = call(whole);
        loop {
            let part = rest.next().ok_or_else(|| format!("{whole} is missing"))?;
            if part == whole {
                break;
            }
            let (part_name, part_numbers) = call(part);
            let motion = ["STRAIGHT_FEED", "ARC_FEED"].contains(&name);
            if !motion || part_name != name || part_numbers.len() != numbers.len() {
                return Err(format!("{part} where {whole} was"));
            }
            if name == "ARC_FEED" {
                let centre = (numbers[2] - part_numbers[2]).abs().max((numbers[3] - part_numbers[3]).abs());
                let sense = (numbers[4] > 0.0) == (part_numbers[4] > 0.0);
                if centre > 0.0015 || !sense {
                    return Err(format!("{part} is no piece of {whole}"));
                }
                let end = [0, 1, 5].iter().all(|&k| (numbers[k] - part_numbers[k]).abs() < 1.5e-4);
                if end {
                    break;
                }
            }
        }
    }
    rest.next().map_or(Ok(()), |extra| Err(format!("{extra} goes beyond the original")))
}
