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
