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
    let line_of = |line: &str| line.strip_prefix("pub ").unwrap_or(line).strip_prefix("mod ").map(str::to_owned);
    let mut rooms: Vec<String> =
        text.lines().filter_map(|line| line_of(line)?.strip_suffix(';').map(str::to_owned)).collect();
    // A room stands twice: hidden with the feature `rooms`, private without it.
    let mut seen = Vec::new();
    rooms.retain(|room| {
        !seen.contains(room) && {
            seen.push(room.clone());
            true
        }
    });
    rooms
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

/// The module of a file: `["nc", "interp", "arc"]` of `src/nc/interp/arc.rs`, `["nc"]` of `src/nc/mod.rs`.
fn module_of(file: &Path) -> Vec<String> {
    let inside = file.strip_prefix("src").unwrap().with_extension("");
    let mut names: Vec<String> = inside.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    names.pop_if(|last| last == "mod");
    names
}

/// The file of the longest part of a path that is a module.
fn file_of(path: &[String]) -> Option<PathBuf> {
    (1..=path.len()).rev().find_map(|n| {
        let base = format!("src/{}", path[..n].join("/"));
        [format!("{base}.rs"), format!("{base}/mod.rs")].into_iter().map(PathBuf::from).find(|path| path.exists())
    })
}

/// Every path below `before` that a use tree like `a::{b, c::d}` at the head of `text` names, and the text behind it.
fn named<'a>(before: &[String], text: &'a str, out: &mut Vec<Vec<String>>) -> &'a str {
    let mut path = before.to_vec();
    let mut rest = text.trim_start();
    loop {
        let length = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        path.extend((length > 0).then(|| rest[..length].to_owned()));
        rest = &rest[length..];
        if let Some(list) = rest.strip_prefix('{') {
            let mut inner = list.trim_start();
            while !inner.is_empty() && !inner.starts_with('}') {
                inner = named(&path, inner, out);
                let end = inner.find([',', '}']).unwrap_or(inner.len());
                inner = inner[end..].trim_start_matches(',').trim_start();
            }
            return inner.strip_prefix('}').unwrap_or(inner);
        }
        let Some(more) = rest.strip_prefix("::") else { break };
        rest = more;
    }
    out.push(path);
    rest
}

/// Files that a file uses outside its tests, by `crate::…`, by `super::…`, and, where it only gathers a room, by `use …`.
fn used_by(file: &Path) -> Vec<PathBuf> {
    let text = fs::read_to_string(file).unwrap();
    let code = text.split("#[cfg(test)]").next().unwrap();
    let code: String =
        code.lines().filter(|line| !line.trim_start().starts_with("//")).map(|line| format!("{line}\n")).collect();
    let own = module_of(file);
    let mut paths = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        named(&[], &code[at + 7..], &mut paths);
    }
    for (at, _) in code.match_indices("super::").filter(|(at, _)| !code[..*at].ends_with("super::")) {
        let ups = code[at..].split("super::").take_while(|between| between.is_empty()).count();
        named(&own[..own.len().saturating_sub(ups)], &code[at + 7 * ups..], &mut paths);
    }
    for line in code.lines().filter(|_| file.ends_with("mod.rs")) {
        if let Some(rest) = line.strip_prefix("pub use ").or(line.strip_prefix("use ")) {
            named(&own, rest, &mut paths);
        }
    }
    paths.iter().filter_map(|path| file_of(path)).filter(|other| other != file).collect()
}

/// Files below `dir` that use themselves by way of others, or lie between two that do.
fn circles(dir: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    rust_files(Path::new(dir), &mut files);
    let mut left: Vec<(PathBuf, Vec<PathBuf>)> = files.iter().map(|file| (file.clone(), used_by(file))).collect();
    // Files that use none of those left are in no circle: take them out until nothing changes.
    loop {
        let before = left.len();
        let names: Vec<PathBuf> = left.iter().map(|(file, _)| file.clone()).collect();
        left.retain(|(_, used)| used.iter().any(|other| names.contains(other)));
        if left.len() == before {
            return names;
        }
    }
}

/// The proof is worth what it shares with what it judges: the reading of a text (`nc`) and what that is made of, no more.
#[test]
fn the_proof_shares_only_the_reading_of_a_text_with_what_writes() {
    let mut files = Vec::new();
    rust_files(Path::new("src/rewrite/verify"), &mut files);
    let shared = ["nc", "path", "ids", "diag", "units", "machine"].map(|room| format!("src/{room}"));
    let may = |other: &Path| {
        other.starts_with("src/rewrite/verify") || shared.iter().any(|room| other.with_extension("").starts_with(room))
    };
    assert!(files.len() > 4 && !may(Path::new("src/rewrite/view.rs")) && may(Path::new("src/ids.rs")));
    let uses = files.iter().flat_map(|file| used_by(file).into_iter().map(move |other| (file, other)));
    let wrong: Vec<_> = uses.filter(|(_, other)| !may(other)).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn no_file_uses_itself_by_way_of_others() {
    for room in declared("src/lib.rs") {
        let folder = format!("src/{room}");
        let left = if Path::new(&folder).is_dir() { circles(&folder) } else { Vec::new() };
        assert!(left.is_empty(), "circles among or below: {left:?}");
    }
}

#[test]
fn uses_are_found_in_every_form() {
    let mut paths = Vec::new();
    let rest = named(&["nc".to_owned()], "a::{b, c::{D, e as f}, g::*}; rest", &mut paths);
    let joined: Vec<String> = paths.iter().map(|path| path.join("::")).collect();
    assert_eq!(joined, ["nc::a::b", "nc::a::c::D", "nc::a::c::e", "nc::a::g"]);
    assert_eq!(rest, "; rest");
    let used = used_by(Path::new("src/nc/interp/arc.rs"));
    assert!(used.contains(&PathBuf::from("src/nc/interp/interpreter.rs")), "by super: {used:?}");
    assert!(used.contains(&PathBuf::from("src/nc/toolpath.rs")), "by crate: {used:?}");
    assert!(
        used_by(Path::new("src/nc/mod.rs")).contains(&PathBuf::from("src/nc/interpret.rs")),
        "by a list of its room"
    );
}

/// The interpreter knows no family of dialects: what is particular to one is asked for through `Family` or stands in the table.
#[test]
fn the_interpreter_names_no_dialect() {
    let mut files = Vec::new();
    rust_files(Path::new("src/nc/interp"), &mut files);
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        for name in ["rs274", "siemens", "heidenhain", "Dialect::", "Syntax::"] {
            let named = code.lines().any(|line| !line.trim_start().starts_with("//") && line.contains(name));
            assert!(!named, "{} names {name}", file.display());
        }
    }
}

#[path = "../build.rs"]
#[allow(dead_code)]
mod build;

/// A test that cannot run is shown as ignored (`build.rs` says what is there); it does not return early and pass.
#[test]
fn no_test_passes_by_leaving_out_its_work() {
    let mut files = Vec::new();
    rust_files(Path::new("tests"), &mut files);
    let early = |file: &PathBuf| {
        let text = fs::read_to_string(file).unwrap();
        ["println!(\"skipped", "println!(\"SKIPPED"]
            .iter()
            .any(|said| text.contains(said) && !file.ends_with("tidy.rs"))
    };
    let early: Vec<PathBuf> = files.into_iter().filter(early).collect();
    let known = ["tests/common/corpus.rs"].map(PathBuf::from);
    assert!(early.iter().all(|file| known.contains(file)), "these pass without their work: {early:?}");
}

/// What decides an engagement map is in the key of a cache: the toolpath of `nc` and the setup by value, all else by its source.
#[test]
fn the_key_of_a_cache_holds_every_room_that_engagement_uses() {
    let listed: Vec<PathBuf> = build::ENGAGEMENT.iter().map(PathBuf::from).collect();
    let in_list = |file: &Path| listed.iter().any(|room| file.starts_with(room));
    let mut files = Vec::new();
    for room in &listed {
        if room.is_dir() { rust_files(room, &mut files) } else { files.push(room.clone()) }
    }
    assert!(files.len() > 40, "only these files were found: {files:?}");
    for file in &files {
        let used = used_by(file);
        let missing: Vec<&PathBuf> = used.iter().filter(|o| !in_list(o) && !o.starts_with("src/nc")).collect();
        assert!(missing.is_empty(), "{} uses {missing:?}, which build.rs does not name", file.display());
    }
}

#[test]
fn any_byte_of_a_source_changes_the_key_of_a_cache() {
    let dir = tempfile::tempdir().unwrap();
    let (room, file) = (dir.path().to_str().unwrap(), dir.path().join("a.rs"));
    let hash = |name: &Path, text: &str| {
        fs::write(name, text).unwrap();
        build::sources(&[room]).unwrap()
    };
    let first = hash(&file, "let x = 1.0;\n");
    assert_eq!(first.len(), 64);
    assert_eq!(hash(&file, "let x = 1.0;\r\n"), first, "ends of lines decide nothing");
    assert_ne!(hash(&file, "let x = 1.1;\n"), first);
    assert_eq!(hash(&file, "let x = 1.0;\n"), first);
    fs::create_dir(dir.path().join("b")).unwrap();
    assert_ne!(hash(&dir.path().join("b/c.rs"), ""), first, "a file more");
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

/// `maud` escapes all text of a page; only style, scripts and data go around it, each encoded in one file.
#[test]
fn markup_is_escaped_by_construction() {
    let mut files = Vec::new();
    rust_files(Path::new("src"), &mut files);
    let around = |file: &&PathBuf| fs::read_to_string(file).unwrap().contains("PreEscaped");
    let found: Vec<&PathBuf> = files.iter().filter(around).collect();
    assert_eq!(found, [Path::new("src/report/embedded.rs")]);
    // Whoever writes a tag into a string does not use the macro.
    let tag = ["<div", "<p>", "<p ", "<td", "<tr>", "<table", "<span", "<svg", "<text", "<a href", "<script", "<style"];
    let by_hand = files.iter().filter(|file| file.starts_with("src/report")).filter_map(|file| {
        let text = fs::read_to_string(file).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
        lines.into_iter().find(|line| tag.iter().any(|tag| line.contains(tag))).map(|line| format!("{file:?}: {line}"))
    });
    assert_eq!(by_hand.collect::<Vec<_>>(), Vec::<String>::new());
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
