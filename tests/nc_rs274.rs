//! Our motions against those of rs274, the stand-alone interpreter of LinuxCNC, program by program; the outcome of each
//! is kept in `tests/scoreboards/rs274.txt`. Needs `rs274` on the path and `../shared` (said aloud when missing).

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use feedwright::machine::Compensation;
use feedwright::nc::{self, Dialect, Environment, Event, FeedMode, MoveKind, Toolpath};
use feedwright::path::{Curve, Plane, Vec3};
use feedwright::units::{MM_PER_INCH, mm_min_from_mm_s, rpm_from_rps};

const SCOREBOARD: &str = "tests/scoreboards/rs274.txt";
/// Tolerance on end points and centres, in the program's unit (rs274 prints four decimals).
const TOLERANCE: f64 = 1.0e-4;

/// One motion as either interpreter has it; lengths in mm.
#[derive(Debug, Clone)]
struct Motion {
    line: u32,
    kind: &'static str,
    to: Vec3,
    centre: Option<(Plane, Vec3, f64)>,
    tool: u32,
    rpm: f64,
    /// Feed of a feed motion, mm/min; NaN per revolution.
    feed: f64,
    /// mm in the unit it was written in.
    unit_mm: f64,
}

fn ours(path: &Toolpath) -> Vec<Motion> {
    let mut motions = Vec::new();
    for event in path.events() {
        let Event::Move(id) = event else { continue };
        let motion = &path.moves[id.ix()];
        let shift = path.shift_at(id);
        let centre = match motion.curve() {
            Curve::Line { .. } => None,
            Curve::Arc(arc) => Some((arc.plane, arc.centre - shift, arc.sweep_rad / TAU)),
        };
        let kind = match (motion.kind, centre) {
            (MoveKind::Rapid, _) => "rapid",
            (MoveKind::Feed, None) => "feed",
            (MoveKind::Feed, Some(_)) => "arc",
        };
        let rpm = rpm_from_rps(motion.spin.rps) * if motion.spin.reverse { -1.0 } else { 1.0 };
        let to = motion.curve().to() - shift;
        let per_rev = motion.feed.mode == FeedMode::PerRev;
        let feed = if per_rev { f64::NAN } else { mm_min_from_mm_s(motion.feed.mm_s) };
        motions.push(Motion { line: motion.line, kind, to, centre, tool: motion.tool, rpm, feed, unit_mm: 1.0 });
    }
    motions
}

/// Reads canonical calls as `canon.sh` prints them.
fn theirs(text: &str) -> Vec<Motion> {
    let (mut unit, mut plane, mut tool, mut speed, mut turning) = (1.0, Plane::Xy, 0, 0.0, 0.0);
    let (mut at, mut feed, mut per_rev) = (Vec3::zeros(), f64::NAN, false);
    let mut motions = Vec::new();
    for row in text.lines() {
        let Some((head, call)) = row.split_once(" N").and_then(|_| row.trim_start().split_once(' ')) else { continue };
        let _ = head;
        let call = call.trim_start();
        let Some((label, call)) = call.split_once(char::is_whitespace) else { continue };
        let line = label.trim_start_matches('N').parse().unwrap_or(0);
        let call = call.trim_start();
        let Some((name, arguments)) = call.split_once('(') else { continue };
        let numbers: Vec<f64> =
            arguments.trim_end_matches(')').split(',').filter_map(|a| a.trim().parse().ok()).collect();
        let mut push = |kind, to: Vec3, centre| {
            let feed = if per_rev { f64::NAN } else { feed };
            motions.push(Motion { line, kind, to, centre, tool, rpm: speed * turning, feed, unit_mm: unit });
        };
        match name {
            "USE_LENGTH_UNITS" => unit = if arguments.contains("INCH") { MM_PER_INCH } else { 1.0 },
            "SELECT_PLANE" => {
                plane = if arguments.contains("XY") {
                    Plane::Xy
                } else if arguments.contains("XZ") {
                    Plane::Zx
                } else {
                    Plane::Yz
                };
            }
            "SET_FEED_RATE" => feed = numbers[0] * unit,
            "SET_FEED_MODE" => per_rev = numbers[1] != 0.0,
            "CHANGE_TOOL" => tool = numbers[0] as u32,
            "SET_SPINDLE_SPEED" => speed = numbers[1],
            "START_SPINDLE_CLOCKWISE" => turning = 1.0,
            "START_SPINDLE_COUNTERCLOCKWISE" => turning = -1.0,
            "STOP_SPINDLE_TURNING" => turning = 0.0,
            "STRAIGHT_TRAVERSE" | "STRAIGHT_FEED" | "STRAIGHT_PROBE" | "SPINDLE_SYNC_FEED" => {
                at = Vec3::new(numbers[0], numbers[1], numbers[2]) * unit;
                push(if name == "STRAIGHT_TRAVERSE" { "rapid" } else { "feed" }, at, None);
            }
            // One call for both ways: out again, the spindle turning the other way, to where it began.
            "RIGID_TAP" => {
                push("feed", Vec3::new(numbers[0], numbers[1], numbers[2]) * unit, None);
                turning = -turning;
                motions.push(Motion { rpm: speed * turning, to: at, ..motions[motions.len() - 1].clone() });
                turning = -turning;
            }
            "ARC_FEED" => {
                let (a, b, n) = plane.axes();
                let (mut to, mut centre) = (Vec3::zeros(), at);
                (to[a], to[b], to[n]) = (numbers[0] * unit, numbers[1] * unit, numbers[5] * unit);
                (centre[a], centre[b]) = (numbers[2] * unit, numbers[3] * unit);
                let turns = turns(plane, at, to, centre, numbers[4]);
                at = to;
                push("arc", to, Some((plane, centre, turns)));
            }
            _ => {}
        }
    }
    motions
}

/// Fractional turns from rs274's whole number of them (its sign is the sense).
fn turns(plane: Plane, from: Vec3, to: Vec3, centre: Vec3, rotation: f64) -> f64 {
    let (a, b, _) = plane.axes();
    let angle = |p: Vec3| (p[b] - centre[b]).atan2(p[a] - centre[a]) / TAU;
    let part = (rotation.signum() * (angle(to) - angle(from))).rem_euclid(1.0);
    let closed = (to[a] - from[a]).hypot(to[b] - from[b]) < 1e-9;
    rotation.signum() * (rotation.abs() - 1.0 + if closed { 1.0 } else { part })
}

/// First difference between the two lists, in words; `None` when they agree.
fn difference(ours: &[Motion], theirs: &[Motion]) -> Option<String> {
    for (index, (a, b)) in ours.iter().zip(theirs).enumerate() {
        let tolerance = TOLERANCE * b.unit_mm + 1e-9;
        let place = format!("motion {} (line {}, rs274 {})", index + 1, a.line, b.line);
        if a.kind != b.kind {
            return Some(format!("{place}: {} here, {} there", a.kind, b.kind));
        }
        if (a.to - b.to).amax() > tolerance {
            return Some(format!("{place}: ends at {:?} here, {:?} there", a.to.as_slice(), b.to.as_slice()));
        }
        if let (Some((plane, centre, turns)), Some((plane_b, centre_b, turns_b))) = (a.centre, b.centre) {
            let (u, v, _) = plane.axes();
            let off = (centre[u] - centre_b[u]).abs().max((centre[v] - centre_b[v]).abs());
            // Printed ends are rounded, so that an angle is known to tolerance / radius; a full turn and none look alike.
            let radius = (b.to[u] - centre_b[u]).hypot(b.to[v] - centre_b[v]).max(1e-9);
            let slack = 4.0 * tolerance / radius / TAU;
            let apart = (turns - turns_b).abs();
            if plane != plane_b
                || off > 1.5 * tolerance
                || apart.min((apart - 1.0).abs()) > slack
                || apart > 1.0 + slack
            {
                return Some(format!("{place}: {:?} here, {:?} there", a.centre, b.centre));
            }
        }
        if a.kind != "rapid" && (a.feed - b.feed).abs() > 1e-4 * b.unit_mm + 1e-5 * b.feed {
            return Some(format!("{place}: feed {} here, {} there", a.feed, b.feed));
        }
        if (a.rpm - b.rpm).abs() > 1e-3 {
            return Some(format!("{place}: spindle {} here, {} there", a.rpm, b.rpm));
        }
    }
    let other_tool = ours.iter().zip(theirs).find(|(a, b)| a.tool != b.tool);
    if let Some((a, b)) = other_tool.filter(|_| ours.len() == theirs.len()) {
        return Some(format!("all {} motions alike, but the tool is {} here, {} there", ours.len(), a.tool, b.tool));
    }
    (ours.len() != theirs.len()).then(|| format!("{} motions here, {} there", ours.len(), theirs.len()))
}

/// Canonical calls of rs274, or its complaint.
fn run_rs274(program: &Path, tools: &Path) -> Result<String, String> {
    let output = Command::new("bash").arg("../shared/linuxcnc/canon.sh").arg(program).arg(tools).output().unwrap();
    let complaint = String::from_utf8_lossy(&output.stderr);
    let first = complaint.lines().find(|line| !line.trim().is_empty()).unwrap_or("").to_owned();
    if output.status.success() && first.is_empty() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(first)
    }
}

/// Compares one program; the verdict as a line of the scoreboard.
fn verdict(file: &Path, scratch: &Path) -> String {
    let text = fs::read(file).unwrap();
    let copy = scratch.join("program.ngc");
    fs::write(&copy, &text).unwrap();
    let mut note = "";
    let own = Path::new("../shared/linuxcnc/tbl").join(format!("{}.tbl", file.file_name().unwrap().to_string_lossy()));
    let tools = if own.exists() { own } else { PathBuf::from("../shared/linuxcnc/generic.tbl") };
    let mut canon = run_rs274(&copy, &tools);
    if canon.as_ref().is_err_and(|complaint| complaint.contains("ended with no percent")) {
        note = " (M2 appended for rs274)";
        fs::write(&copy, [&text[..], b"\nM2\n"].concat()).unwrap();
        canon = run_rs274(&copy, &tools);
    }
    match canon {
        Err(complaint) => format!("rejected by rs274: {complaint}{note}; {}", policy(text, &tools)),
        Ok(canon) => {
            let program = nc::parse(text, None);
            let environment = rs274_environment(&tools);
            let mine = ours(&nc::interpret(&program, &environment));
            let reference = theirs(&canon);
            match difference(&mine, &reference) {
                None => format!("identical, {} motions{note}", mine.len()),
                Some(what) if what.contains("but the tool is") => {
                    let program = nc::parse(program.text().to_vec(), Some(Dialect::LinuxCnc));
                    let mine = ours(&nc::interpret(&program, &environment));
                    match difference(&mine, &reference) {
                        None => format!("identical read as linuxcnc, {} motions; {what}{note}", mine.len()),
                        Some(what) => format!("DIFFERS: {what}{note}"),
                    }
                }
                Some(what) => format!("DIFFERS: {what}{note}"),
            }
        }
    }
}

/// What becomes of a program that rs274 rejects: the dialect it is read in, and how much of it keeps its feed.
fn policy(text: Vec<u8>, tools: &Path) -> String {
    let program = nc::parse(text, None);
    let path = nc::interpret(&program, &rs274_environment(tools));
    let feeds = || path.moves.iter().filter(|motion| motion.kind == MoveKind::Feed);
    let kept = feeds().filter(|motion| motion.freeze.is_some()).count();
    let mut codes: Vec<&str> = path.diagnostics.iter().map(|diagnostic| diagnostic.code).collect();
    codes.sort_unstable();
    codes.dedup();
    let said = if codes.is_empty() { "nothing".to_owned() } else { codes.join(", ") };
    let (dialect, all) = (program.dialect().name(), feeds().count());
    format!("read as {dialect}, {all} feed motions, {kept} of them kept; said: {said}")
}

/// A control just switched on, with the diameters (inch) of a LinuxCNC tool table.
fn rs274_environment(tools: &Path) -> Environment<'static> {
    let table = fs::read_to_string(tools).unwrap();
    let field = |row: &str, letter: char| {
        row.split_whitespace().find_map(|word| word.strip_prefix(letter)).and_then(|value| value.parse::<f64>().ok())
    };
    let rows = table.lines().filter_map(|row| Some((field(row, 'T')? as u32, field(row, 'D')? * MM_PER_INCH)));
    Environment { diameters_mm: rows.collect(), compensation: Some(Compensation::Control), ..Environment::default() }
}

fn programs(folder: &str) -> Vec<PathBuf> {
    let known = ["nc", "ngc", "gcode", "tap"];
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| {
        let extension = file.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        extension.is_some_and(|e| known.contains(&e.as_str()))
    });
    files.sort();
    files
}

#[test]
#[cfg_attr(any(absent_shared, absent_rs274), ignore = "rs274 or ../shared is not there")]
fn motions_equal_those_of_rs274() {
    let scratch = tempfile::tempdir().unwrap();
    let mut board = BTreeMap::new();
    for folder in ["../shared/programs", "../shared/measured/nist_mtc/nc", "programs", "tests/nc"] {
        for file in programs(folder) {
            let name = file.file_name().unwrap().to_string_lossy().into_owned();
            board.insert(name, verdict(&file, scratch.path()));
        }
    }
    let expected = fs::read_to_string(SCOREBOARD).unwrap();
    let stated: Vec<&str> = expected.lines().filter(|line| !line.starts_with('#') && !line.is_empty()).collect();
    // A new program that is read as rs274 reads it need not be listed.
    board.retain(|name, verdict| {
        let listed = stated.iter().any(|line| line.starts_with(&format!("{name}: ")));
        listed || !verdict.starts_with("identical")
    });
    let found: Vec<String> = board.iter().map(|(name, verdict)| format!("{name}: {verdict}")).collect();
    if stated != found {
        let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("rs274_scoreboard.txt");
        let found = found.join("\n");
        fs::write(&place, &found).unwrap();
        panic!("the scoreboard has changed; the new one is {}:\n{found}", place.display());
    }
}

#[test]
#[cfg_attr(absent_rs274, ignore = "rs274 is not installed")]
fn lines_are_as_long_as_the_control_reads() {
    let scratch = tempfile::tempdir().unwrap();
    let most = Dialect::LinuxCnc.max_line_length();
    for (length, end) in [(most - 1, "\n"), (most, "\n"), (most + 1, "\n"), (most - 1, "\r\n"), (most, "\r\n")] {
        let words = format!("G1 X1 F100{}Y2", " ".repeat(length - 12));
        fs::write(scratch.path().join("long.ngc"), ["G21", &words, "M2", ""].join(end)).unwrap();
        let mut control = Command::new("rs274");
        let output = control.current_dir(scratch.path()).args(["-g", "-n", "2", "-v", "rs.var", "long.ngc"]).output();
        let reads = length + end.len() - 1 <= most;
        assert_eq!(output.unwrap().status.success(), reads, "{length} bytes and {end:?}");
    }
}
