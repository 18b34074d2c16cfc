//! `--cache` and `--save-stock`: what is kept, used again, and recognised as stale or damaged; what is said about the stock.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use assert_cmd::Command;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const PROGRAM: &str =
    "%\nG21 G90\nT1 M6\nS8000 M3\nG0 X-10 Y5 Z2\nG1 Z-2 F300\nG1 X50 F900\nY12\nX-10\nG0 Z10\nM30\n%\n";

fn setup(stock: &str, force: f64, overhang: f64) -> String {
    format!(
        "resolution = 0.5\n[machine]\ndialect = \"linuxcnc\"\n[stock]\n{stock}\n[material]\nk_tc = 800\nk_te = 14\n[[tool]]\n\
         number = 1\nshape = \"flat\"\ndiameter = 6\nflutes = 3\noverhang = {overhang}\n[raise]\nplunges = true\nramps = true\nentries = true\nfinishing = true\ncompensation = true\ncycles = true\n[limits]\nfeed_change = {{ max = 2.0 }}\nforce_xy = {force}\n"
    )
}

const BOX: &str = "box = { min = [0, 0, -10], max = [40, 20, 0] }";

fn bench() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("part.nc"), PROGRAM).unwrap();
    fs::write(dir.path().join("part.setup.toml"), setup(BOX, 80.0, 30.0)).unwrap();
    dir
}

/// Exit code, standard output and standard error of a command in a folder.
fn run(dir: &Path, arguments: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("feedwright").unwrap().current_dir(dir).args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

#[test]
fn a_cache_is_used_again_and_recognised_when_it_no_longer_fits() {
    let dir = bench();
    let at = dir.path();
    let cache = at.join("part.fwcache");
    let (code, plain, _) = run(at, &["simulate", "part.nc", "--json", "plain.json"]);
    assert_eq!(code, 0);
    let (_, first, said) = run(at, &["simulate", "part.nc", "--cache", "--json", "first.json"]);
    assert!(cache.exists() && !said.contains("cache"), "{said}");
    let made = fs::read(&cache).unwrap();
    let (_, second, said) = run(at, &["simulate", "part.nc", "--cache", "--json", "second.json"]);
    assert!(said.contains("nothing was simulated again"), "{said}");
    assert_eq!(plain, first);
    assert_eq!(first, second);
    assert_eq!(fs::read(at.join("plain.json")).unwrap(), fs::read(at.join("second.json")).unwrap());
    // Another limit is solved from the same map.
    fs::write(at.join("part.setup.toml"), setup(BOX, 40.0, 30.0)).unwrap();
    let (_, _, said) = run(at, &["optimize", "part.nc", "--cache"]);
    assert!(said.contains("nothing was simulated again"), "{said}");
    let solved = fs::read(at.join("part.fw.nc")).unwrap();
    run(at, &["optimize", "part.nc"]);
    assert_eq!(fs::read(at.join("part.fw.nc")).unwrap(), solved);
    assert_eq!(fs::read(&cache).unwrap(), made);
    // A longer tool is another simulation.
    fs::write(at.join("part.setup.toml"), setup(BOX, 40.0, 45.0)).unwrap();
    let (code, _, said) = run(at, &["simulate", "part.nc", "--cache"]);
    assert!(code == 0 && said.contains("other moves, tools, stock or resolution"), "{said}");
    let (_, _, said) = run(at, &["simulate", "part.nc", "--cache"]);
    assert!(said.contains("nothing was simulated again"), "{said}");
    // Damage is told, and put right.
    let mut bytes = fs::read(&cache).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&cache, &bytes).unwrap();
    let (code, _, said) = run(at, &["simulate", "part.nc", "--cache"]);
    assert!(code == 0 && said.contains("damaged"), "{said}");
    let (_, _, said) = run(at, &["simulate", "part.nc", "--cache"]);
    assert!(said.contains("nothing was simulated again"), "{said}");
    // Somebody else's file is not overwritten.
    fs::write(&cache, "mine").unwrap();
    let (code, _, said) = run(at, &["simulate", "part.nc", "--cache"]);
    assert!(code == 2 && said.contains("was not written by Feedwright"), "{said}");
}

#[test]
fn saved_stock_is_the_next_programs_blank() {
    let dir = bench();
    let at = dir.path();
    let (code, _, said) = run(at, &["simulate", "part.nc", "--save-stock", "op10.stock", "--json", "first.json"]);
    assert!(code == 0 && said.contains("op10.stock"), "{said}");
    let volume = |file: &str, key: &str| -> f64 {
        let report: serde_json::Value = serde_json::from_slice(&fs::read(at.join(file)).unwrap()).unwrap();
        report["stock"][key].as_f64().unwrap()
    };
    // The same program again on what it left meets nothing: a fault, for the simulation says nothing about such a program.
    fs::write(at.join("next.nc"), PROGRAM).unwrap();
    fs::write(at.join("next.setup.toml"), setup("saved = \"op10.stock\"", 80.0, 30.0)).unwrap();
    let (code, _, said) = run(at, &["simulate", "next.nc", "--json", "next.json"]);
    assert!(code == 1 && said.contains("never touches the stock"), "{said}");
    assert!((volume("next.json", "initial_mm3") / volume("first.json", "remaining_mm3") - 1.0).abs() < 1e-6);
    assert!(volume("next.json", "removed_mm3").abs() < 1e-6);
    // As a mesh it is stock too.
    run(at, &["simulate", "part.nc", "--save-stock", "op10.stl"]);
    fs::write(at.join("next.setup.toml"), setup("stl = \"op10.stl\"", 80.0, 30.0)).unwrap();
    let (code, _, said) = run(at, &["simulate", "next.nc", "--json", "next.json"]);
    assert_eq!(code, 0, "{said}");
    let left = volume("first.json", "remaining_mm3");
    assert!((volume("next.json", "initial_mm3") / left - 1.0).abs() < 0.02, "{left}");
    let (code, _, said) = run(at, &["simulate", "part.nc", "--save-stock", "op10.txt"]);
    assert!(code == 2 && said.contains(".stl"), "{said}");
}

#[test]
fn too_little_memory_names_the_resolution_that_fits() {
    let dir = bench();
    let (code, _, said) = run(dir.path(), &["simulate", "part.nc", "--resolution", "0.005", "--max-memory", "100M"]);
    assert_eq!(code, 2, "{said}");
    assert!(said.contains("MiB") && said.contains("--resolution 0.0") && said.contains("--max-memory"), "{said}");
    let fits = said.split("--resolution ").nth(1).unwrap().split_whitespace().next().unwrap();
    let (code, _, said) = run(dir.path(), &["simulate", "part.nc", "--resolution", fits, "--max-memory", "100M"]);
    assert_eq!(code, 0, "{said}");
}

#[test]
fn what_was_repaired_in_a_mesh_is_said() {
    let dir = bench();
    let at = dir.path();
    run(at, &["simulate", "part.nc", "--save-stock", "whole.stl"]);
    let mut bytes = fs::read(at.join("whole.stl")).unwrap();
    // Turn one triangle over.
    let (a, b) = (84 + 12, 84 + 24);
    for k in 0..12 {
        bytes.swap(a + k, b + k);
    }
    fs::write(at.join("turned.stl"), bytes).unwrap();
    fs::write(at.join("part.setup.toml"), setup("stl = \"turned.stl\"", 80.0, 30.0)).unwrap();
    let (code, _, said) = run(at, &["simulate", "part.nc"]);
    assert!(code == 0 && said.contains("turned.stl"), "{said}");
}
