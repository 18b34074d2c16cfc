//! Made before the package is compiled: the SHA-256 of the sources that an engagement map depends on, so that a cache made by other
//! sources is never used (`src/engage/key.rs`); and which of the programs and data that tests compare with are there.

#![allow(clippy::print_stdout)]

use sha2::{Digest, Sha256};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Rooms whose code decides what an engagement map holds, given the moves and the setup, which the key of a cache holds themselves.
/// `tests/tidy.rs` keeps this list whole.
pub const ENGAGEMENT: [&str; 8] = [
    "src/bytes.rs",
    "src/engage",
    "src/ids.rs",
    "src/machine",
    "src/numeric.rs",
    "src/path",
    "src/stock",
    "src/units.rs",
];

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-env=FEEDWRIGHT_ENGAGEMENT_SOURCES={}", sources(&ENGAGEMENT)?);
    surroundings();
    Ok(())
}

/// Tests that need what is not there are shown as ignored: `absent_shared`, `absent_rs274`, `absent_linuxcnc`, `absent_browser`, and
/// for modules of Python `absent_openpyxl` and `absent_opencamlib`. What is there is watched; what comes later is seen after
/// `touch build.rs` (to watch what is not there would compile the package anew every time).
fn surroundings() {
    println!("cargo::rerun-if-env-changed=PATH");
    let path = std::env::var_os("PATH").unwrap_or_default();
    let program = |name: &str| std::env::split_paths(&path).map(|folder| folder.join(name)).find(|file| file.is_file());
    let found = [("shared", Some(PathBuf::from("../shared/programs"))), ("rs274", program("rs274"))];
    let driver = PathBuf::from("tests/browser/node_modules/playwright-core/package.json");
    let browser = program("chromium").and(program("node")).map(|_| driver);
    // LinuxCNC refuses to run as root: the tests ask the user lcnc for it.
    let users = fs::read_to_string("/etc/passwd").unwrap_or_default();
    let linuxcnc = program("linuxcnc").filter(|_| users.lines().any(|line| line.starts_with("lcnc:")));
    let found = found.into_iter().chain([("linuxcnc", linuxcnc), ("browser", browser)]);
    for (name, place) in found {
        println!("cargo::rustc-check-cfg=cfg(absent_{name})");
        match place.filter(|place| place.exists()) {
            Some(place) => println!("cargo::rerun-if-changed={}", place.display()),
            None => println!("cargo::rustc-cfg=absent_{name}"),
        }
    }
    for module in ["openpyxl", "opencamlib"] {
        println!("cargo::rustc-check-cfg=cfg(absent_{module})");
        let import = Command::new("python3").args(["-c", &format!("import {module}")]).output();
        if !import.is_ok_and(|output| output.status.success()) {
            println!("cargo::rustc-cfg=absent_{module}");
        }
    }
}

/// SHA-256 of all files below these paths, with their names and lengths, in hexadecimal.
pub fn sources(rooms: &[&str]) -> io::Result<String> {
    let mut files = Vec::new();
    for room in rooms {
        println!("cargo::rerun-if-changed={room}");
        below(Path::new(room), &mut files)?;
    }
    files.sort();
    let mut hash = Sha256::new();
    for file in files {
        // The same names and lines on every system.
        let name = file.to_string_lossy().replace('\\', "/");
        let text: Vec<u8> = fs::read(&file)?.into_iter().filter(|byte| *byte != b'\r').collect();
        for part in [name.as_bytes(), &text] {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
    }
    Ok(hash.finalize().iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}")))
}

fn below(path: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    if !path.is_dir() {
        files.push(path.to_owned());
        return Ok(());
    }
    for entry in fs::read_dir(path)? {
        below(&entry?.path(), files)?;
    }
    Ok(())
}
