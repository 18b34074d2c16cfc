//! Realised time against a real machine's own clock (NIST/MTC box assembly; the data are NIST's, by path only):
//! accelerations, corner tolerance and pauses are fitted on one run of operation 1; every run of both operations is
//! predicted. Prints the error of each.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use feedwright::machine::{Job, Machine};
use feedwright::nc::{Environment, Event, Toolpath, interpret, parse};
use feedwright::schedule::{as_programmed, realise};

const FOLDER: &str = "../shared/measured/nist_mtc";

/// What a log says of one run.
struct Run {
    name: String,
    /// Program active to completed, s.
    total_s: f64,
    /// When each line was first reported: (line, s since the start), in order.
    lines: Vec<(u32, f64)>,
}

/// Where something else than motion takes time: tool changes, spindle, coolant, the way home.
struct Pauses {
    /// Before the first line is reported, s.
    start_s: f64,
    /// Around each tool change, beyond the motion in it, s.
    change_s: f64,
}

fn main() {
    if !Path::new(FOLDER).exists() {
        println!("skipped: {FOLDER} is not there");
        return;
    }
    let setup = fs::read_to_string("../shared/programs/setups/box_op1.toml").unwrap();
    let (mut job, _) = feedwright::setup::load(&setup, Path::new("../shared/programs/setups")).unwrap();
    job.machine.tool_change_time_s = 0.0;
    job.machine.spindle.runup_time_s = 0.0;
    let (first, second) = (program("box_op1.nc", &job), program("box_op2.nc", &job));
    let learn = run("box_op1_run11.shdr");
    let (machine, pauses) = fitted(&first, &learn, &job.machine);
    let axis = machine.axes[0];
    println!(
        "fitted on {}: x acceleration {:.0} mm/s^2, corner tolerance {:.4} mm, start {:.1} s, tool change {:.1} s",
        learn.name, axis.acceleration_mm_s2, machine.corner_tolerance_mm, pauses.start_s, pauses.change_s
    );
    for (path, names) in [
        (&first, ["box_op1_run03.shdr", "box_op1_run07.shdr", "box_op1_run11.shdr"]),
        (&second, ["box_op2_run03.shdr", "box_op2_run07.shdr", "box_op2_run11.shdr"]),
    ] {
        let predicted = total(path, &machine) + pauses.start_s + pauses.change_s * f64::from(changes(path));
        for name in names {
            let run = run(name);
            let error = 100.0 * (predicted / run.total_s - 1.0);
            println!("  {name}: {:.1} s, predicted {predicted:.1} s, {error:+.1} %", run.total_s);
        }
    }
}

fn changes(toolpath: &Toolpath) -> u32 {
    toolpath.events().filter(|event| matches!(event, Event::Tool { .. })).count() as u32
}

/// Accelerations from the time of the stretches that only move, for each of some corner tolerances; of these the one whose
/// stretches agree best. Everything on the learning run alone.
fn fitted(toolpath: &Toolpath, run: &Run, machine: &Machine) -> (Machine, Pauses) {
    let mut best: Option<(f64, Machine)> = None;
    for tolerance in [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2] {
        let with = |factor: f64| {
            let mut machine = machine.clone();
            machine.corner_tolerance_mm = tolerance;
            machine.axes.iter_mut().for_each(|axis| axis.acceleration_mm_s2 *= factor);
            machine
        };
        let excess =
            |factor: f64| stretches(toolpath, run, &with(factor)).iter().map(|(log, model)| model - log).sum::<f64>();
        let (mut low, mut high) = (0.01f64, 100.0f64);
        for _ in 0..30 {
            let middle = (low * high).sqrt();
            if excess(middle) > 0.0 { low = middle } else { high = middle }
        }
        let error: f64 = stretches(toolpath, run, &with(high)).iter().map(|(log, model)| (model - log).abs()).sum();
        println!("  tolerance {tolerance} mm: accelerations x {high:.3}, absolute error {error:.1} s");
        if best.as_ref().is_none_or(|(least, _)| error < *least) {
            best = Some((error, with(high)));
        }
    }
    let machine = best.map(|(_, machine)| machine).unwrap();
    let start_s = run.lines.iter().find(|(line, _)| *line > 0).map_or(0.0, |(_, time)| *time);
    let change_s = (run.total_s - start_s - total(toolpath, &machine)) / f64::from(changes(toolpath));
    (machine, Pauses { start_s, change_s })
}

/// Stretches of some ten seconds without tool changes or spindle commands: (time in the log, time of the model), s.
fn stretches(toolpath: &Toolpath, run: &Run, machine: &Machine) -> Vec<(f64, f64)> {
    let realised = realise(toolpath, &as_programmed(toolpath), machine);
    let last = toolpath.moves.last().map_or(0, |motion| motion.line) as usize + 2;
    let mut line_s = vec![0.0; last];
    for (motion, time_s) in toolpath.moves.iter().zip(realised.move_s) {
        line_s[motion.line as usize] += time_s;
    }
    let mut pause = vec![false; last];
    for event in toolpath.events() {
        let line = match &event {
            Event::Tool { line, .. }
            | Event::Spindle { line, .. }
            | Event::Stop { line, .. }
            | Event::Dwell { line, .. } => *line,
            Event::Move(_) => continue,
        };
        for near in line.saturating_sub(4)..(line + 5).min(last as u32) {
            pause[near as usize] = true;
        }
    }
    let mut out = Vec::new();
    let mut from = 0;
    for at in 1..run.lines.len() {
        let ((line0, time0), (line1, time1)) = (run.lines[from], run.lines[at]);
        if line1 <= line0 {
            from = at;
            continue;
        }
        let inside = line0 as usize..(line1 as usize).min(last);
        if pause[inside.clone()].contains(&true) {
            from = at;
        } else if time1 - time0 > 10.0 {
            out.push((time1 - time0, line_s[inside].iter().sum()));
            from = at;
        }
    }
    out
}

fn total(toolpath: &Toolpath, machine: &Machine) -> f64 {
    realise(toolpath, &as_programmed(toolpath), machine).total_s
}

fn program(name: &str, job: &Job) -> Toolpath {
    let text = fs::read(Path::new(FOLDER).join("nc").join(name)).unwrap();
    let toolpath = interpret(&parse(text, None), &Environment::from_job(job));
    let changes = toolpath.events().filter(|event| matches!(event, Event::Tool { .. })).count();
    println!("{name}: {} motions, {changes} tool changes", toolpath.moves.len());
    toolpath
}

fn run(name: &str) -> Run {
    let text = fs::read_to_string(Path::new(FOLDER).join("log").join(name)).unwrap();
    let rows: Vec<(f64, &str, &str)> = text.lines().filter_map(row).collect();
    let status = |what: &str| rows.iter().find(|(_, item, value)| *item == "Program_Status" && *value == what);
    let start = status("ACTIVE").map_or(rows[0].0, |row| row.0);
    let end = status("PROGRAM_COMPLETED").map_or(rows[rows.len() - 1].0, |row| row.0);
    // 0-based in the log.
    let line = |row: &(f64, &str, &str)| {
        Some((row.2.parse::<u32>().ok().filter(|_| row.1 == "Block_Number")? + 1, row.0 - start))
    };
    let lines = rows.iter().filter_map(line).filter(|(_, time)| *time >= 0.0).collect();
    Run { name: name.to_owned(), total_s: end - start, lines }
}

/// Time of day in s, item, value.
fn row(line: &str) -> Option<(f64, &str, &str)> {
    let mut cells = line.split('|');
    let clock = cells.next()?.split('T').nth(1)?.trim_end_matches('Z');
    let mut parts = clock.split(':').map(|part| part.parse::<f64>().ok());
    let (hours, minutes, seconds) = (parts.next()??, parts.next()??, parts.next()??);
    Some((3600.0 * hours + 60.0 * minutes + seconds, cells.next()?, cells.next()?.trim()))
}
