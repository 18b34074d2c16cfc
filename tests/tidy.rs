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

/// Modules that a file declares, in its order.
fn declared(file: &str) -> Vec<String> {
    let text = fs::read_to_string(file).unwrap();
    text.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';').map(str::to_owned)).collect()
}

/// Uses of a later room in the files below `dir`, whose rooms are `rooms` and whose paths begin with `path`.
fn uses_of_later_rooms(dir: &str, path: &str, rooms: &[String]) -> Vec<String> {
    let mut files = Vec::new();
    rust_files(Path::new(dir), &mut files);
    let mut wrong = Vec::new();
    for file in files {
        let inside = file.strip_prefix(dir).unwrap();
        let first = inside.components().next().unwrap().as_os_str().to_string_lossy().into_owned();
        let room = first.strip_suffix(".rs").unwrap_or(&first).to_owned();
        let Some(own) = rooms.iter().position(|name| *name == room) else { continue };
        let text = fs::read_to_string(&file).unwrap();
        for (number, line) in text.lines().enumerate() {
            if line.trim_start().starts_with("//") {
                continue;
            }
            for (rank, other) in rooms.iter().enumerate() {
                if rank > own && line.contains(&format!("{path}{other}::")) {
                    wrong.push(format!("{}:{} uses {other}", file.display(), number + 1));
                }
            }
        }
    }
    wrong
}

#[test]
fn a_room_uses_only_rooms_above_it() {
    let rooms = declared("src/lib.rs");
    assert!(rooms.len() > 10, "no rooms found in src/lib.rs");
    let wrong = uses_of_later_rooms("src", "crate::", &rooms);
    assert!(wrong.is_empty(), "rooms out of order:\n{}", wrong.join("\n"));
}

#[test]
fn a_room_of_learn_uses_only_rooms_above_it() {
    let rooms = declared("src/learn/mod.rs");
    assert!(rooms.len() > 8, "no rooms found in src/learn/mod.rs");
    let wrong = uses_of_later_rooms("src/learn", "crate::learn::", &rooms);
    assert!(wrong.is_empty(), "rooms of learn out of order:\n{}", wrong.join("\n"));
}

/// Files of learn that a file uses outside its tests.
fn used_by(file: &Path) -> Vec<PathBuf> {
    let text = fs::read_to_string(file).unwrap();
    let code = text.split("#[cfg(test)]").next().unwrap();
    let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
    let paths = lines.flat_map(|line| line.split("crate::learn::").skip(1).map(str::to_owned).collect::<Vec<_>>());
    let named = |path: String| -> Option<PathBuf> {
        let end = path.find(|c: char| !c.is_alphanumeric() && c != '_' && c != ':').unwrap_or(path.len());
        let parts: Vec<&str> = path[..end].split("::").filter(|part| !part.is_empty()).collect();
        (1..=parts.len()).rev().find_map(|n| {
            let base = format!("src/learn/{}", parts[..n].join("/"));
            [format!("{base}.rs"), format!("{base}/mod.rs")].into_iter().map(PathBuf::from).find(|path| path.exists())
        })
    };
    paths.filter_map(named).filter(|other| other != file).collect()
}

#[test]
fn no_file_of_learn_uses_itself_by_way_of_others() {
    let mut files = Vec::new();
    rust_files(Path::new("src/learn"), &mut files);
    let mut left: Vec<(PathBuf, Vec<PathBuf>)> = files.iter().map(|file| (file.clone(), used_by(file))).collect();
    // Files that use none of those left are in no circle: take them out until nothing changes.
    loop {
        let before = left.len();
        let names: Vec<PathBuf> = left.iter().map(|(file, _)| file.clone()).collect();
        left.retain(|(_, used)| used.iter().any(|other| names.contains(other)));
        if left.len() == before {
            break;
        }
    }
    assert!(left.is_empty(), "circles among or below: {:?}", left.iter().map(|(file, _)| file).collect::<Vec<_>>());
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

/// Everything of an effect stands in its file: no other file asks for one by its name. `setup/` has keys of the same words.
#[test]
fn no_effect_is_called_by_its_name_outside_its_file() {
    let mut files = Vec::new();
    rust_files(Path::new("src/effects"), &mut files);
    let name = |file: &PathBuf| {
        let text = fs::read_to_string(file).unwrap();
        let effect = text.split("EFFECT: Effect = Effect {").nth(1)?;
        Some(effect.split("name: \"").nth(1)?.split('"').next()?.to_owned())
    };
    let names: Vec<String> = files.iter().filter_map(name).collect();
    assert!(names.len() >= 19, "only these effects were found: {names:?}");
    let mut others = Vec::new();
    rust_files(Path::new("src"), &mut others);
    let mut wrong = Vec::new();
    for file in others.iter().filter(|file| !file.starts_with("src/effects") && !file.starts_with("src/setup")) {
        let text = fs::read_to_string(file).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        let called = names.iter().filter(|name| code.contains(&format!("\"{name}\"")));
        wrong.extend(called.map(|name| format!("{} calls {name}", file.display())));
    }
    assert!(wrong.is_empty(), "effects called by name:\n{}", wrong.join("\n"));
}
