//! Keeps the rooms in order: a room may use only rooms declared above it in `src/lib.rs`.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

fn rust_files(dir: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, out);
        } else if path.extension().is_some_and(|ext| ext == "rs") {
            out.push(path);
        }
    }
}

fn rooms() -> Vec<String> {
    let lib = fs::read_to_string("src/lib.rs").unwrap();
    lib.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';').map(str::to_owned)).collect()
}

#[test]
fn a_room_uses_only_rooms_above_it() {
    let rooms = rooms();
    assert!(rooms.len() > 10, "no rooms found in src/lib.rs");
    let mut files = Vec::new();
    rust_files(Path::new("src"), &mut files);
    let mut wrong = Vec::new();
    for file in files {
        let inside = file.strip_prefix("src").unwrap();
        let first = inside.components().next().unwrap().as_os_str().to_string_lossy().into_owned();
        let room = first.strip_suffix(".rs").unwrap_or(&first).to_owned();
        let Some(own) = rooms.iter().position(|name| *name == room) else { continue };
        let text = fs::read_to_string(&file).unwrap();
        for (number, line) in text.lines().enumerate() {
            if line.trim_start().starts_with("//") {
                continue;
            }
            for (rank, other) in rooms.iter().enumerate() {
                if rank > own && line.contains(&format!("crate::{other}::")) {
                    wrong.push(format!("{}:{} uses {other}", file.display(), number + 1));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "rooms out of order:\n{}", wrong.join("\n"));
}

#[test]
fn every_file_begins_by_saying_what_it_is() {
    let mut files = Vec::new();
    rust_files(Path::new("src"), &mut files);
    let mute: Vec<_> = files.iter().filter(|file| !fs::read_to_string(file).unwrap().starts_with("//!")).collect();
    assert!(mute.is_empty(), "no //! head: {mute:?}");
}

#[test]
fn solver_parser_and_serialiser_live_in_one_place_each() {
    let homes = [("nom::", "src/nc"), ("clarabel::", "src/schedule")];
    let mut files = Vec::new();
    rust_files(Path::new("src"), &mut files);
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        for (name, home) in homes {
            let used = text.lines().any(|line| line.trim_start().starts_with(&format!("use {name}")));
            assert!(!used || file.starts_with(home), "{} uses {name}, which lives in {home}", file.display());
        }
    }
}
