//! Bad input: one clear message that says what to do, exit code 2, and nothing is written.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use assert_cmd::Command;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const PROGRAM: &str = "G21 G90\nT1 M6\nS8000 M3\nG0 X-10 Y5 Z2\nG1 Z-1 F300\nG1 X50 F600\nG0 Z10\nM30\n";
const SETUP: &str = r#"
resolution = 0.5
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
[limits]
force_xy = 200
"#;

struct Bench {
    dir: TempDir,
}

impl Bench {
    /// A folder with a program and its setup.
    fn new() -> Self {
        let bench = Self { dir: tempfile::tempdir().unwrap() };
        bench.put("part.nc", PROGRAM.as_bytes());
        bench.put("part.setup.toml", SETUP.as_bytes());
        bench
    }
    fn put(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, bytes).unwrap();
        path
    }
    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }
    fn names(&self) -> Vec<(String, Vec<u8>)> {
        let read = |path: PathBuf| if path.is_dir() { Vec::new() } else { fs::read(path).unwrap() };
        let mut names: Vec<_> = fs::read_dir(self.dir.path())
            .unwrap()
            .map(|entry| entry.unwrap())
            .map(|entry| (entry.file_name().to_string_lossy().into_owned(), read(entry.path())))
            .collect();
        names.sort();
        names
    }
    /// Runs and expects a refusal: exit code 2, the folder as it was, a message that says all of `words`.
    fn refused(&self, arguments: &[&str], words: &[&str]) -> String {
        let before = self.names();
        let output = feedwright(self.dir.path()).args(arguments).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(output.stdout.is_empty(), "{arguments:?} printed {}", String::from_utf8_lossy(&output.stdout));
        assert_eq!(said.matches("error").count(), 1, "not one message for {arguments:?}: {said}");
        for word in words {
            assert!(said.contains(word), "{arguments:?} does not say {word:?}: {said}");
        }
        assert!(self.names() == before, "{arguments:?} wrote something");
        said
    }
}

fn feedwright(dir: &Path) -> Command {
    let mut command = Command::cargo_bin("feedwright").unwrap();
    command.current_dir(dir);
    command
}

#[test]
fn the_bench_itself_is_right() {
    let bench = Bench::new();
    feedwright(bench.dir.path()).args(["optimize", "part.nc"]).assert().code(0);
    assert!(bench.path("part.fw.nc").is_file());
}

#[test]
fn programs_that_are_none() {
    let bench = Bench::new();
    bench.put("empty.nc", b"");
    bench.put("blank.nc", b" \r\n\r\n");
    bench.put("binary.nc", b"\x7fELF\x02\x01\x01\0\0\0\0\0\0\0\0\0\x03\0>\0\x01\0\0\0\x10\x11\x12\x13");
    bench.put("prose.nc", b"(nothing moves here)\n");
    fs::create_dir(bench.path("folder.nc")).unwrap();
    for command in ["optimize", "simulate", "toolpath"] {
        bench.refused(&[command, "empty.nc"], &["empty.nc", "is empty", "give"]);
        bench.refused(&[command, "blank.nc"], &["is empty"]);
        bench.refused(&[command, "binary.nc"], &["not a text file", "plain text"]);
        bench.refused(&[command, "folder.nc"], &["folder", "give one file"]);
        bench.refused(&[command, "absent.nc"], &["absent.nc", "no such file"]);
    }
    bench.refused(&["optimize", "prose.nc", "--setup", "part.setup.toml"], &["no motion"]);
    bench.refused(&["verify", "part.nc", "absent.nc"], &["absent.nc"]);
}

#[test]
fn a_tool_or_a_stock_that_is_not_known() {
    let bench = Bench::new();
    bench.put("other.nc", PROGRAM.replace("T1", "T7").as_bytes());
    bench.refused(&["optimize", "other.nc", "--setup", "part.setup.toml"], &["T7", "line 5", "[[tool]]", "number = 7"]);
    bench.put("named.mpf", PROGRAM.replace("G21", "G71").replace("T1", "T=\"MILL 10\" D1").as_bytes());
    bench.put(
        "two.toml",
        format!("{SETUP}[[tool]]\nnumber = 2\nshape = \"flat\"\ndiameter = 8\nflutes = 3\n").as_bytes(),
    );
    let named = ["optimize", "named.mpf", "--setup", "two.toml", "--dialect", "siemens"];
    bench.refused(&named, &["named.mpf:2:1", "MILL 10", "tool_names = { \"MILL 10\" = 1 }"]);
    bench.put("bare.nc", PROGRAM.as_bytes());
    let said =
        bench.refused(&["optimize", "bare.nc"], &["no setup for bare.nc", "flutes", "[stock]", "bare.setup.toml"]);
    assert!(said.contains("[[tool]]") && said.contains("number = 1"));
    let stockless = SETUP.replace("[stock]\nbox = { min = [0, 0, -10], max = [40, 20, 0] }", "");
    bench.put("stockless.toml", stockless.as_bytes());
    bench.refused(&["optimize", "part.nc", "--setup", "stockless.toml"], &["stock", "box"]);
}

#[test]
fn the_setup_that_is_printed_is_one() {
    let bench = Bench::new();
    bench.put("bare.nc", PROGRAM.as_bytes());
    let said = bench.refused(&["optimize", "bare.nc"], &[]);
    let (_, sketch) = said.split_once("units").unwrap();
    let clean: String = format!("units{sketch}")
        .lines()
        .map(|line| line.trim_start_matches(['|', ' ', '=']))
        .map(|l| format!("{l}\n"))
        .collect();
    let toml: toml::Table = clean.parse().unwrap_or_else(|error| panic!("{error}\n{clean}"));
    assert!(toml.contains_key("stock") && toml.contains_key("tool"));
}

#[test]
fn setups_that_cannot_be_used() {
    let bench = Bench::new();
    let with = |name: &str, old: &str, new: &str| bench.put(name, SETUP.replace(old, new).as_bytes());
    with("misspelt.toml", "force_xy", "froce_xy");
    let said =
        bench.refused(&["optimize", "part.nc", "--setup", "misspelt.toml"], &["froce_xy", "did you mean `force_xy`"]);
    assert!(said.contains("froce_xy = 200") && said.contains("misspelt.toml:14"), "the line is not shown: {said}");
    with("nan.toml", "force_xy = 200", "force_xy = nan");
    bench.refused(&["optimize", "part.nc", "--setup", "nan.toml"], &["force_xy", "not a finite number"]);
    with("infinite.toml", "force_xy = 200", "force_xy = inf");
    bench.refused(&["optimize", "part.nc", "--setup", "infinite.toml"], &["force_xy", "not a finite number"]);
    bench.put("broken.toml", b"[limits\n");
    bench.refused(&["optimize", "part.nc", "--setup", "broken.toml"], &["broken.toml"]);
    bench.put("latin.toml", b"# \xe4\n");
    bench.refused(&["optimize", "part.nc", "--setup", "latin.toml"], &["UTF-8"]);
    bench.refused(&["optimize", "part.nc", "--setup", "absent.toml"], &["absent.toml", "no such file"]);
    bench.refused(&["optimize", "part.nc", "--strict"], &["defaults", "machine.rapid", "write them down"]);
}

#[test]
fn outputs_that_must_not_be_written() {
    let bench = Bench::new();
    bench.refused(&["optimize", "part.nc", "-o", "part.nc"], &["input", "-o"]);
    bench.refused(&["optimize", "part.nc", "--force", "-o", "part.nc"], &["input"]);
    bench.refused(&["optimize", "part.nc", "--force", "-o", "./part.setup.toml"], &["input"]);
    bench.put("other.nc", b"G0 X1\n");
    bench.refused(&["optimize", "part.nc", "-o", "other.nc"], &["other.nc", "not written by Feedwright", "--force"]);
    bench.put("notes.json", b"{}\n");
    bench.refused(&["optimize", "part.nc", "--json", "notes.json"], &["notes.json", "--force"]);
    bench.refused(&["optimize", "part.nc", "-o", "absent/out.nc"], &["absent/out.nc", "no such file or folder"]);
    bench.refused(&["optimize", "part.nc", "-o", "."], &["folder"]);
    bench.refused(&["optimize", "part.nc", "-o", "a.x", "--json", "a.x"], &["twice"]);
    bench.refused(&["optimize", "part.nc", "-o", "-", "--json", "-"], &["standard output"]);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("part.nc", bench.path("link.nc")).unwrap();
        bench.refused(&["optimize", "part.nc", "--force", "-o", "link.nc"], &["input"]);
        fs::hard_link(bench.path("part.nc"), bench.path("hard.nc")).unwrap();
        bench.refused(&["optimize", "part.nc", "--force", "-o", "hard.nc"], &["input"]);
    }
}

#[test]
fn our_own_output_is_replaced_and_force_replaces_others() {
    let bench = Bench::new();
    let run = |arguments: &[&str]| feedwright(bench.dir.path()).args(arguments).assert().code(0);
    run(&["optimize", "part.nc", "--json", "r.json", "--csv", "r.csv", "--svg", "r.svg", "--report", "r.html"]);
    run(&["optimize", "part.nc", "--json", "r.json", "--csv", "r.csv", "--svg", "r.svg", "--report", "r.html"]);
    bench.put("other.nc", b"G0 X1\n");
    run(&["optimize", "part.nc", "-o", "other.nc", "--force"]);
    assert_eq!(fs::read(bench.path("other.nc")).unwrap(), fs::read(bench.path("part.fw.nc")).unwrap());
}

#[test]
fn nonsense_on_the_command_line() {
    let bench = Bench::new();
    bench.refused(&["optimize", "part.nc", "--threads", "0"], &["--threads"]);
    bench.refused(&["optimize", "part.nc", "--resolution", "-1"], &["--resolution"]);
    bench.refused(&["optimize", "part.nc", "--resolution", "0.0001", "--max-memory", "1M"], &["--max-memory"]);
    bench.refused(&["optimize"], &["PROGRAM"]);
    bench.refused(&["optimise-all"], &["optimise-all"]);
    bench.refused(&["toolpath", "part.nc", "--dialect", "fanuk"], &["fanuc"]);
}
