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

/// What no dialect that is read can mean stays refused, whatever the setup or the command line calls the text.
#[test]
fn a_dialect_in_the_setup_makes_no_other_control_of_a_text() {
    let bench = Bench::new();
    for (name, text, control) in [
        ("wincnc.tap", "G20\nG90\nF10 XY\nF30 Z\nG0 X0 Y0\nG1 Z-0.1\nG1 X2 Y1\nL91\n", "WinCNC"),
        ("okuma.min", "$PART.MIN%\nO1\nG15 H1\nG56 H1 Z5.\nG0 X0 Y0\nG1 X10. F500\nM02\n", "Okuma"),
        ("fadal.nc", "#CLEAR\nL100\nG91 X1.\nM17\nM30\nG90 G0 X0 Y0\nG1 X10. F500\nM2\n", "Fadal"),
    ] {
        bench.put(name, text.as_bytes());
        for dialect in ["linuxcnc", "fanuc", "haas", "grbl", "generic"] {
            bench.put(
                "named.toml",
                format!("[machine]\ndialect = \"{dialect}\"\n{}", SETUP.trim_start().replace("resolution = 0.5\n", ""))
                    .as_bytes(),
            );
            bench.refused(
                &["optimize", name, "--setup", "named.toml"],
                &[control, "post it for a control that is read"],
            );
            bench.refused(&["optimize", name, "--dialect", dialect, "--setup", "part.setup.toml"], &[control]);
        }
    }
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

/// Neither G20 nor G21: the numbers and the setup tell the unit, it is said and asked for, and where they disagree nothing is
/// raised. What is written is read in the same unit by `verify`, with the setup and without it.
#[test]
fn a_program_without_its_unit_is_read_in_the_one_its_numbers_have() {
    let bench = Bench::new();
    let setup = SETUP.replace("[40, 20, 0]", "[80, 20, 0]")
        + "feed_change = { max = 2.0 }\n[raise]\nentries = true\nfinishing = true\n";
    bench.put("setup.toml", setup.as_bytes());
    let run = |program: &str, more: &str| {
        bench.put("unit.nc", program.as_bytes());
        bench.put("setup.toml", format!("{more}{setup}").as_bytes());
        let arguments =
            ["optimize", "unit.nc", "--setup", "setup.toml", "-o", "out.nc", "--force", "--json", "out.json"];
        let output = feedwright(bench.dir.path()).args(arguments).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        for setup in [&["--setup", "setup.toml"][..], &[]] {
            let proof =
                feedwright(bench.dir.path()).args(["verify", "unit.nc", "out.nc"]).args(setup).output().unwrap();
            assert_eq!(proof.status.code(), Some(0), "{}", String::from_utf8_lossy(&proof.stdout));
        }
        let report: serde_json::Value = serde_json::from_slice(&fs::read(bench.path("out.json")).unwrap()).unwrap();
        (
            String::from_utf8_lossy(&output.stderr).into_owned(),
            report,
            fs::read_to_string(bench.path("out.nc")).unwrap(),
        )
    };
    let removed = |report: &serde_json::Value| report["stock"]["removed_mm3"].as_f64().unwrap();
    let inch = "T1 M6\nS5000 M3\nG0 X-.5 Y.4 Z.1\nG1 Z-.0394 F10.\nX3.3125 F15.\nG0 Z1.\nM30\n";
    let (said, report, written) = run(inch, "");
    assert!(said.contains("read in inch, because") && said.contains("program_unit = \"inch\""), "{said}");
    assert!((removed(&report) - 80.0 * 6.0 * 1.0).abs() < 2.0, "{}", removed(&report));
    assert!(report["assumptions"].as_array().unwrap().iter().any(|told| told["key"] == "machine.program_unit"));
    assert_ne!(written, inch);
    let (said, same, _) = run(&format!("G20\n{inch}"), "");
    assert!(!said.contains("nc::unit") && removed(&same) == removed(&report), "{said}");
    let (said, same, _) = run(inch, "machine = { program_unit = \"inch\" }\n");
    assert!(!said.contains("nc::unit") && removed(&same) == removed(&report), "{said}");
    // Four decimals and a retract of half a unit, a feed as metric as the setup.
    let open = "T1 M6\nS8000 M3\nG0 X-8. Y5. Z.5\nG1 Z-1. F300\nX88.1255 F550.\nG0 Z.5\nM30\n";
    let (said, _, written) = run(open, "");
    assert!(said.contains("warning[nc::unit]") && said.contains("no feed is raised"), "{said}");
    assert_eq!(written, open);
}

/// M3 without S: the speed stands in the setup, where the control has it; a router switched by hand has no M3 either.
#[test]
fn a_speed_that_the_program_leaves_out_is_taken_from_the_setup() {
    let bench = Bench::new();
    let moves = "G0 X-8 Y5 Z5\nG1 Z-1 F300\nX48 F600\nG0 Z5\nM30\n";
    for (head, rpm, code) in [
        ("G21\nT1 M6\nM3\n", "", 1),
        ("G21\nT1 M6\nM3\n", "rpm = 8000\n", 0),
        ("G21\nT1 M6\n", "rpm = 8000\n", 0),
        ("G21\nT1 M6\nM5\n", "rpm = 8000\n", 0),
        ("G21\nT1 M6\nS0 M3\n", "rpm = 8000\n", 1),
    ] {
        bench.put("speed.nc", format!("{head}{moves}").as_bytes());
        bench.put("setup.toml", SETUP.replace("number = 1\n", &format!("number = 1\n{rpm}")).as_bytes());
        let arguments = ["simulate", "speed.nc", "--setup", "setup.toml", "--json", "out.json", "--force"];
        let output = feedwright(bench.dir.path()).args(arguments).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{head}{rpm}: {said}");
        assert_eq!(said.contains("give rpm in its [[tool]]"), code == 1, "{head}{rpm}: {said}");
        let report: serde_json::Value = serde_json::from_slice(&fs::read(bench.path("out.json")).unwrap()).unwrap();
        assert_eq!(report["tool"][0]["force_peak_n"].as_f64().unwrap() > 10.0, code == 0, "{head}{rpm}");
    }
}

/// The same thing in many places is said once, with their number and the first line, on every surface.
#[test]
fn what_happens_often_is_one_warning_with_a_count() {
    let bench = Bench::new();
    let mut text = String::from("G21 G90\nT1 M6\nS8000 M3\nG0 X-8 Y5 Z5\nG1 Z-1 F300\n");
    for pass in 0..250 {
        text += &format!("G1 X{} Y5 F600 W{pass}\n", if pass % 2 == 0 { 48 } else { -8 });
    }
    bench.put("often.nc", format!("{text}G0 Z5\nM30\n").as_bytes());
    let arguments =
        ["simulate", "often.nc", "--setup", "part.setup.toml", "--json", "out.json", "--report", "out.html", "--force"];
    let output = feedwright(bench.dir.path()).args(arguments).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let times = "W is not an axis or a word known here (×250, first at line 6)";
    assert_eq!(said.matches("W is not an axis").count(), 1, "{said}");
    assert!(said.contains(times), "{said}");
    assert_eq!(fs::read_to_string(bench.path("out.html")).unwrap().matches(times).count(), 1);
    let report: serde_json::Value = serde_json::from_slice(&fs::read(bench.path("out.json")).unwrap()).unwrap();
    let warnings = report["warnings"].as_array().unwrap();
    let found: Vec<_> = warnings.iter().filter(|warning| warning["code"] == "nc::unknown-word").collect();
    assert_eq!((found.len(), &found[0]["count"], &found[0]["line"]), (1, &250.into(), &6.into()), "{warnings:?}");
}
