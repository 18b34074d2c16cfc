//! Bad programs through the whole of `optimize`, each fault in every dialect: no panic, the fault shown with its line, its
//! column and its bytes, the exit code that belongs to it, and the good blocks around it optimised all the same.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use assert_cmd::Command;
use std::fs;

const SETUP: &str = "resolution = 1.0\n[machine]\ncompensation = \"control\"\n[stock]\nbox = { min = [0, 0, -10], max = [40, 20, 0] }\n\
    [material]\nk_tc = 800\nk_te = 14\n[[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 6\nflutes = 3\n[raise]\nplunges = true\nramps = true\nentries = true\nfinishing = true\ncompensation = true\ncycles = true\n[limits]\nfeed_change = { max = 2.0 }\nforce_xy = 60\n";

const DIALECTS: [&str; 8] = ["generic", "fanuc", "haas", "linuxcnc", "grbl", "mach3", "siemens", "heidenhain"];

/// Which of the three kinds of text a dialect is.
fn kind(dialect: &str) -> usize {
    match dialect {
        "siemens" => 1,
        "heidenhain" => 2,
        _ => 0,
    }
}

/// What becomes of a program with a fault.
#[derive(Clone, Copy, PartialEq)]
enum Outcome {
    /// Written, with the blocks behind the fault optimised.
    Optimised,
    /// Written; what is behind the fault is not executed, so its feed stays. Exit code 1.
    Stops,
    /// The same for a loop that does not end.
    Endless,
    /// Nothing is written. Exit code 2.
    Refused,
}
use Outcome::{Endless, Optimised, Refused, Stops};

/// A fault: its name; for ISO, Siemens and plain language the code, the lines, and the bytes that are underlined.
struct Fault {
    name: &'static str,
    outcome: Outcome,
    texts: [(&'static str, String, String); 3],
}

fn fault(name: &'static str, outcome: Outcome, texts: [(&'static str, &str, &str); 3]) -> Fault {
    Fault { name, outcome, texts: texts.map(|(code, lines, bytes)| (code, lines.to_owned(), bytes.to_owned())) }
}

fn faults() -> Vec<Fault> {
    let open = "[".repeat(10_000);
    let close = "]".repeat(10_000);
    let (round, shut) = ("(".repeat(10_000), ")".repeat(10_000));
    let long = "X1 ".repeat(350_000);
    let deep = format!("#1={open}1{close}");
    let (siemens_deep, plain_deep) = (format!("R1={round}1{shut}"), format!("Q1 = {round}1{shut}"));
    vec![
        fault(
            "unbalanced brackets",
            Optimised,
            [
                ("nc::not-understood", "G1 X[1+2", "X[1+2"),
                ("nc::expression", "G1 X=(1+2", "X=(1+2"),
                ("nc::expression", "Q1 = (1+2", "Q1 = (1+2"),
            ],
        ),
        fault(
            "two signs",
            Optimised,
            [
                ("nc::not-understood", "G1 X--5", "X--5"),
                ("nc::not-understood", "G1 X--5", "X--5"),
                ("nc::not-understood", "L X--5", "X--5"),
            ],
        ),
        fault(
            "no digit",
            Optimised,
            [
                ("nc::not-understood", "G1 X.", "X."),
                ("nc::not-understood", "G1 X.", "X."),
                ("nc::not-understood", "L X.", "X."),
            ],
        ),
        fault(
            "a number out of range",
            Optimised,
            [
                ("nc::unknown-word", "G1 X1e400", "e400"),
                ("nc::unknown-word", "G1 X1e400", "e400"),
                ("nc::unknown-word", "L X+1e400", "e400"),
            ],
        ),
        fault(
            "a NUL byte",
            Optimised,
            [
                ("nc::not-understood", "G1 X1\0", "\0"),
                ("nc::not-understood", "G1 X1\0", "\0"),
                ("nc::not-understood", "L X+1\0", "\0"),
            ],
        ),
        fault(
            "an unknown code",
            Optimised,
            [
                ("nc::unknown-g", "G555 X1", "G555"),
                ("nc::unknown-g", "G777 X1", "G777"),
                ("nc::not-understood", "FOO X+1", "FOO"),
            ],
        ),
        fault(
            "an arc that cannot be",
            Optimised,
            [
                ("nc::arc", "G2 X20 Y5 R0.1", "G2"),
                ("nc::arc", "G2 X20 Y5 CR=0.1", "G2"),
                ("nc::arc", "CR X+20 Y+5 R+0.1 DR+", "CR"),
            ],
        ),
        fault(
            "10,000 brackets",
            Optimised,
            [
                ("nc::expression", &deep, &deep),
                ("nc::expression", &siemens_deep, &siemens_deep),
                ("nc::expression", &plain_deep, &plain_deep),
            ],
        ),
        fault(
            "a line of 1 MB",
            Optimised,
            [
                ("nc::not-understood", &format!("G1 {long}?"), "?"),
                ("nc::not-understood", &format!("G1 {long}?"), "?"),
                ("nc::not-understood", &format!("L {long}?"), "?"),
            ],
        ),
        fault(
            "a jump to nowhere",
            Stops,
            [
                ("nc::no-target", "GOTO 77", "77"),
                ("nc::no-target", "GOTOF NOWHERE", "NOWHERE"),
                ("nc::no-target", "FN 9: IF +1 EQU +1 GOTO LBL 77", "FN"),
            ],
        ),
        fault(
            "a subprogram that is not there",
            Optimised,
            [
                ("nc::no-routine", "M98 P77", "M98"),
                ("nc::no-routine", "L77", "L77"),
                ("nc::no-routine", "CALL LBL 77", "CALL"),
            ],
        ),
        fault(
            "a jump without end",
            Endless,
            [
                ("nc::runaway", "N10 G1 X1\nGOTO 10", "GOTO 10\n"),
                ("nc::runaway", "HERE: G1 X1\nGOTOB HERE", "GOTOB HERE\n"),
                ("nc::runaway", "LBL 1\nFN 9: IF +1 EQU +1 GOTO LBL 1", "FN 9: IF +1 EQU +1 GOTO LBL 1\n"),
            ],
        ),
        fault(
            "a subprogram that calls itself",
            Stops,
            [
                ("nc::runaway", "M98 P5\nM30\nO5\nM98 P5", "M98 P5\n"),
                ("nc::runaway", "ITSELF\nM30\n%_N_ITSELF_SPF\nITSELF", "ITSELF\n"),
                ("nc::runaway", "LBL 1\nCALL LBL 1", "CALL LBL 1\n"),
            ],
        ),
        fault(
            "a tool that is missing",
            Refused,
            [("T7", "T7 M6", ""), ("T7", "T7 M6", ""), ("T7", "TOOL CALL 7 Z S8000", "")],
        ),
    ]
}

/// The program around a fault, and the line the fault begins on. What stands before the fault takes the corner off the
/// stock: a program that cuts nothing writes nothing.
fn program(kind: usize, lines: &str) -> (String, usize) {
    let iso = |units: &str| {
        let head = format!("{units} G90\nT1 M6\nS8000 M3\nG0 X-10 Y5 Z2\nG1 Z-1 F300\nG1 X2\nG1 X-10\n");
        (format!("{head}{lines}\nG1 X50 Y5 F6000\nG0 Z10\nM30\n"), 8)
    };
    match kind {
        0 => iso("G21"),
        1 => iso("G71"),
        _ => {
            let head = "BEGIN PGM A MM\nTOOL CALL 1 Z S8000\nL X-10 Y+5 Z+2 R0 FMAX M3\nL Z-1 F300\nL X+2\nL X-10\n";
            (format!("{head}{lines}\nL X+50 Y+5 F6000\nL Z+10 FMAX M30\nEND PGM A MM\n"), 7)
        }
    }
}

fn check(dialect: &str, fault: &Fault) -> Result<(), String> {
    let folder = tempfile::tempdir().unwrap();
    let (code, lines, bytes) = &fault.texts[kind(dialect)];
    let (text, first) = program(kind(dialect), lines);
    fs::write(folder.path().join("part.nc"), &text).unwrap();
    fs::write(folder.path().join("part.setup.toml"), SETUP).unwrap();
    let mut command = Command::cargo_bin("feedwright").unwrap();
    let output =
        command.current_dir(folder.path()).args(["optimize", "part.nc", "--no-color", "--dialect", dialect]).output();
    let output = output.unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let head: String = said.chars().take(3000).collect();
    let written = fs::read_to_string(folder.path().join("part.fw.nc")).ok();
    let expect = |holds: bool, what: &str| {
        if holds { Ok(()) } else { Err(format!("{dialect}, {}: {what}\n{head}", fault.name)) }
    };
    let status = match fault.outcome {
        Optimised => 0,
        Stops | Endless => 1,
        Refused => 2,
    };
    expect(!said.contains("panicked"), "it panics")?;
    expect(output.status.code() == Some(status), &format!("exit code {:?}", output.status.code()))?;
    expect(said.contains(*code), &format!("{code} is not said"))?;
    if fault.outcome == Refused {
        return expect(written.is_none(), "something is written");
    }
    let at = text.find(lines.as_str()).unwrap();
    let begins = at + lines.rfind(bytes.trim_end()).unwrap();
    let line = first + text[at..begins].matches('\n').count();
    let column = begins - text[..begins].rfind('\n').map_or(0, |end| end + 1) + 1;
    // Which block of an endless loop is the last one executed hangs on the budget.
    let lines = if fault.outcome == Endless { first..=line } else { line..=line };
    let shown = lines.map(|line| format!("part.nc:{line}:{column}\n")).find(|place| said.contains(place));
    let place =
        shown.ok_or_else(|| format!("{dialect}, {}: line {line}, column {column} is not shown\n{head}", fault.name))?;
    let underlined = said.split(&place).nth(1).unwrap().lines().find(|row| row.contains('^'));
    let length = underlined.map_or(0, |row| row.matches('^').count());
    let least = if fault.outcome == Endless { 1 } else { bytes.trim_end().len().min(20) };
    expect(length >= least, &format!("{length} bytes are underlined"))?;
    let written = written.ok_or_else(|| format!("{dialect}, {}: nothing is written\n{head}", fault.name))?;
    // Where a feed is changed a note says what it was.
    let changed = written.contains("WAS 6000");
    expect(
        changed == (fault.outcome == Optimised),
        &format!("the block behind the fault is changed: {changed}\n{}", &written[written.len().saturating_sub(400)..]),
    )
}

#[test]
fn each_fault_in_every_dialect() {
    let faults = faults();
    let wrong: Vec<String> = DIALECTS
        .iter()
        .flat_map(|dialect| faults.iter().map(move |fault| check(dialect, fault)))
        .filter_map(Result::err)
        .collect();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), faults.len() * DIALECTS.len(), wrong.join("\n-----\n"));
}

/// A program of a style, run through `optimize` with the setup of a mill.
fn optimised(name: &str, text: &str, options: &[&str]) -> (Option<i32>, String, bool) {
    let folder = tempfile::tempdir().unwrap();
    let [program, setup, out] = ["p.nc", "s.toml", "o.nc"].map(|name| folder.path().join(name));
    fs::write(&program, text).unwrap();
    fs::write(&setup, SETUP).unwrap();
    let mut command = Command::cargo_bin("feedwright").unwrap();
    command.args(["optimize", "--no-color"]).arg(&program).arg("--setup").arg(&setup).arg("-o").arg(&out).args(options);
    let result = command.output().unwrap();
    println!("{name}: {:?}\n{}", result.status.code(), String::from_utf8_lossy(&result.stderr));
    (result.status.code(), String::from_utf8_lossy(&result.stderr).into_owned(), out.exists())
}

/// Seven styles of turning (F0.4 became F6000 once): one sentence, exit code 2, nothing written; `--mill` has the last word.
#[test]
fn turning_programs_are_refused_unless_a_mill_runs_them() {
    let styles = [
        ("Fanuc", "%\nO0101\nG50 S2500\nT0101\nG96 S180 M3\nG0 X30. Z2.\nG1 Z-5. F0.25\nM30\n%\n"),
        (
            "Fanuc cycles",
            "O1\nT0101\nG97 S900 M3\nG71 U2. R0.5\nG71 P1 Q2 U0.4 W0.1 F0.25\nN1 G0 X20.\nN2 G1 Z-5. F0.1\nM30\n",
        ),
        ("increments", "O7\nT0404\nG97 S700 M3\nG0 X40. Z1.\nG1 W-21. F0.2\nU2.\nM30\n"),
        ("Haas", "%\nO00012\nT202\nG97 S900 M03\nG99\nG00 X2.1 Z0.1\nG01 X-0.06 F0.008\nM30\n%\n"),
        ("Okuma", "G00 X800 Z700\nG97 S300 M03\nG01 Z552 F0.4\nX160\nM02\n"),
        (
            "Siemens",
            "N1 G18 G90 G95\nN2 T=\"SCHRUPPER\" D1\nN3 G96 S200 LIMS=3000 M4\nN4 G0 X62 Z2\nN5 G1 Z-40 F0.3\nM30\n",
        ),
        ("thread", "%\nO14\nT0303\nG97 S600 M03\nG0 X1.1 Z0.3\nG76 X0.88 Z-1. K0.061 D0.012 F0.0833\nM30\n%\n"),
    ];
    for (name, text) in styles {
        let (code, said, written) = optimised(name, text, &[]);
        assert_eq!((code, written), (Some(2), false), "{name}");
        assert!(said.contains("turning program") && said.contains("--mill"), "{name}: {said}");
    }
    let slot = "G21\nT1 M6\nM3 S8000\nG0 X-10 Z2\nG1 Z-1 F200\nX50 F400\nG0 Z50\nM30\n";
    assert_ne!(optimised("a slot without Y", slot, &[]).0, Some(2));
    let (code, said, _) = optimised("with --mill", styles[4].1, &["--mill"]);
    assert!(code != Some(2) || !said.contains("turning"), "{said}");
}

/// Controls whose words mean other things than in every dialect that is read.
#[test]
fn controls_that_are_not_read_are_refused_by_name() {
    let texts = [
        ("WinCNC", "G90\nS12000\nM3\nF10 XY\nF30 Z\nG1 X5 Y5\n"),
        ("Okuma OSP", "O100\nG15 H1\nG56 H1\nG0 X10 Y20\nG1 Z-1 F200\nM02\n"),
        ("Fadal", "#CLEAR\nL100\nG91 G1 X1. F100.\nM17\nM30\nG0 X0 Y0\nM2\n"),
    ];
    for (name, text) in texts {
        let (code, said, written) = optimised(name, text, &[]);
        assert_eq!((code, written), (Some(2), false), "{name}");
        // Naming a dialect that has none of these words would not help.
        assert!(said.contains(name) && said.contains("post it for a control that is read"), "{name}: {said}");
    }
}
