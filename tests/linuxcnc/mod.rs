//! LinuxCNC's own planner, headless, as the judge of realised time. In: a program's text, path mode, acceleration. Out:
//! seconds per line as LinuxCNC takes them, and as our model says.

#![allow(dead_code)] // the test and the benchmark each use a part of it

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use feedwright::machine::{Axis, Machine, Spindle, Table, Unsaid};
use feedwright::nc::{Dialect, Environment, Program, Toolpath, interpret, parse};
use feedwright::schedule::{as_programmed, realise};

/// The simulator's own scripts.
pub const SCRIPTS: &str = "../shared/linuxcnc";
/// Where LinuxCNC's user can read and write.
const PLACE: &str = "/tmp/feedwright-linuxcnc";

/// Stall of LinuxCNC's task above which its queue of moves may have run dry, s of its clock.
const STALL_S: f64 = 5.0;

/// True where LinuxCNC, its user and its scripts are there.
pub fn installed() -> bool {
    let user = Command::new("id").arg("lcnc").output().is_ok_and(|out| out.status.success());
    user && Path::new("/usr/bin/linuxcnc").exists() && Path::new(SCRIPTS).exists()
}

/// The machine of the simulator's `mill.ini`.
pub fn machine(acceleration_mm_s2: f64) -> Machine {
    let axis = Axis { velocity_mm_s: 250.0, acceleration_mm_s2, jerk_mm_s3: None };
    Machine {
        dialect: Some("linuxcnc".to_owned()),
        rapid_mm_s: 250.0, // MAX_LINEAR_VELOCITY is one of the path
        corner_tolerance_mm: 0.01,
        block_time_s: 0.001,
        tool_change_time_s: 0.0,
        home_mm: None,
        compensation: None,
        wear_mm: Vec::new(),
        tool_names: Vec::new(),
        max_line_length: None,
        max_repeated_bytes: feedwright::machine::MAX_REPEATED_BYTES,
        max_call_depth: feedwright::machine::MAX_CALL_DEPTH,
        axes: [axis; 3],
        spindle: Spindle {
            max_rps: 1e3,
            power_w: None,
            torque_nmm: None,
            tare_w: Table::constant(0.0),
            efficiency: Table::constant(1.0),
            runup_time_s: 0.0,
        },
        offsets: Vec::new(),
        unsaid: Unsaid::default(),
    }
}

/// `text` with its own path modes taken out and `mode` put at the beginning; ends as LinuxCNC wants it.
pub fn with_mode(text: &str, mode: &str) -> String {
    let own = |line: &str| -> String {
        if line.contains('(') {
            return line.to_owned();
        }
        let upper = line.to_uppercase();
        let Some(at) = upper.find("G64").or_else(|| upper.find("G61")) else { return line.to_owned() };
        let rest = upper[at + 3..].trim_start();
        let rest =
            rest.strip_prefix('P').map_or(rest, |rest| rest.trim_start_matches(|c: char| ".0123456789".contains(c)));
        format!("{}{}", &line[..at], &line[line.len() - rest.len()..])
    };
    let mut lines: Vec<String> = text.lines().map(own).collect();
    lines.insert(usize::from(text.trim_start().starts_with('%')), mode.to_owned());
    let ends = |line: &String| {
        let word = line.trim().to_uppercase();
        word.starts_with("M2") || word.starts_with("M30") || word.starts_with("M02") || word.contains(" M30")
    };
    if !lines.iter().any(ends) && !text.trim_end().ends_with('%') {
        lines.push("M2".to_owned());
    }
    lines.join("\n") + "\n"
}

/// Seconds per line of an earlier run of the same text.
pub fn stored(name: &str, text: &str, acceleration_mm_s2: f64) -> Option<BTreeMap<u32, f64>> {
    let stem = format!("{PLACE}/{name}.{acceleration_mm_s2}");
    let same = fs::read_to_string(format!("{stem}.ngc")).is_ok_and(|known| known == text);
    let csv = format!("{stem}.csv");
    if same { read_lines(Path::new(&csv)) } else { None }
}

/// Seconds per line in LinuxCNC, servo cycles counted exactly; the error says what went wrong.
pub fn run(name: &str, text: &str, acceleration_mm_s2: f64, speed_up: u32) -> Result<BTreeMap<u32, f64>, String> {
    let fail = |what: &str| format!("{name}: {what}");
    fs::create_dir_all(PLACE).map_err(|error| fail(&error.to_string()))?;
    let _ = fs::remove_file(format!("{PLACE}/{name}.{acceleration_mm_s2}.csv"));
    for entry in fs::read_dir(SCRIPTS).map_err(|error| fail(&error.to_string()))?.flatten() {
        if entry.path().is_file() {
            let _ = fs::copy(entry.path(), Path::new(PLACE).join(entry.file_name()));
        }
    }
    patient().map_err(|error| fail(&error.to_string()))?;
    let stem = format!("{PLACE}/{name}.{acceleration_mm_s2}");
    fs::write(format!("{stem}.ngc"), text).map_err(|error| fail(&error.to_string()))?;
    fs::write(format!("{stem}.tbl"), tool_table()).map_err(|error| fail(&error.to_string()))?;
    let _ = Command::new("chmod").args(["-R", "a+rwX", PLACE]).status();
    let script = format!(
        "SPEEDUP={speed_up} TOOLS={stem}.tbl MAX_S=2000 MAX_WALL=280 {PLACE}/run_sim.sh {stem}.ngc {stem}.log {acceleration_mm_s2}"
    );
    // Ahead of whatever else the computer does: a thread that starves is not the planner's time.
    let done = Command::new("nice").args(["-n", "-10", "runuser", "-u", "lcnc", "--", "bash", "-c", &script]).output();
    let done = done.map_err(|error| fail(&error.to_string()))?;
    if !done.status.success() {
        return Err(fail(&fs::read_to_string(format!("{stem}.log.out")).unwrap_or_default()));
    }
    let status = fs::read_to_string(format!("{stem}.log.status")).unwrap_or_default();
    let said = fs::read_to_string(format!("{stem}.log.out")).unwrap_or_default();
    if !status.contains("overruns=0 ") || said.contains("command timeout") || longest_stall_s(&said) > STALL_S {
        return Err(fail("the simulator could not keep up; try a lower speed-up"));
    }
    let csv = format!("{stem}.csv");
    let analyse = Command::new(format!("{PLACE}/analyse.py")).args([&format!("{stem}.log"), "--lines", &csv]).output();
    analyse.map_err(|error| fail(&error.to_string()))?;
    let lines = read_lines(Path::new(&csv)).ok_or_else(|| fail("no log"));
    let _ = fs::remove_file(format!("{stem}.log"));
    lines
}

/// Longest cycle of LinuxCNC's task, s of its clock: what it said when it ended.
fn longest_stall_s(said: &str) -> f64 {
    let longest = said.split("max=").nth(1).and_then(|rest| rest.split(',').next()?.parse().ok());
    longest.unwrap_or(f64::INFINITY)
}

/// On a busy computer a clock that runs fast makes LinuxCNC give up on its own thread: it is told to wait longer. Cycles of that
/// thread are what is counted, so that no time is lost or gained.
fn patient() -> std::io::Result<()> {
    let file = format!("{PLACE}/mill.ini");
    let text = fs::read_to_string(&file)?.replace("COMM_TIMEOUT = 4.0", "COMM_TIMEOUT = 400.0");
    fs::remove_file(&file)?;
    fs::write(&file, text)
}

/// Seconds per line from the CSV of `analyse.py`.
pub fn read_lines(csv: &Path) -> Option<BTreeMap<u32, f64>> {
    let text = fs::read_to_string(csv).ok()?;
    let row = |line: &str| {
        let mut cells = line.split(',');
        Some((cells.next()?.parse().ok()?, cells.next()?.parse().ok()?))
    };
    Some(text.lines().skip(1).filter_map(row).collect())
}

/// Diameters of the simulator's tools, mm: tool 8 is small enough for the thread of `cncjs_helical_thread.gcode`.
fn diameters() -> Vec<(u32, f64)> {
    let of = |tool| match tool {
        8 => 2.54,
        _ => 6.0,
    };
    (1..100).map(|tool| (tool, of(tool))).collect()
}

fn tool_table() -> String {
    diameters().iter().map(|(tool, diameter)| format!("T{tool} P{tool} Z0 D{diameter}\n")).collect()
}

/// The text as LinuxCNC reads it.
pub fn program(text: &str) -> Program {
    parse(text.as_bytes().to_vec(), Some(Dialect::LinuxCnc))
}

/// The toolpath as LinuxCNC's simulator meets it.
pub fn toolpath(text: &str) -> Toolpath {
    let environment = Environment { diameters_mm: diameters(), ..Environment::default() };
    interpret(&program(text), &environment)
}

/// Seconds per line as our model says.
pub fn model(text: &str, acceleration_mm_s2: f64) -> BTreeMap<u32, f64> {
    let toolpath = toolpath(text);
    let realised = realise(&toolpath, &as_programmed(&toolpath), &machine(acceleration_mm_s2));
    let mut lines = BTreeMap::new();
    for (motion, time_s) in toolpath.moves.iter().zip(realised.move_s) {
        *lines.entry(motion.line).or_insert(0.0) += time_s;
    }
    for event in toolpath.events() {
        if let feedwright::nc::Event::Dwell { seconds, line } = event {
            *lines.entry(line).or_insert(0.0) += seconds;
        }
    }
    lines
}

/// How near the model comes.
#[derive(Debug, Clone, Copy)]
pub struct Agreement {
    /// LinuxCNC's time, s.
    pub theirs_s: f64,
    /// The model's, s.
    pub ours_s: f64,
    /// Blocks longer than 0.2 s, and those of them within 10 %.
    pub blocks: (usize, usize),
}

impl Agreement {
    /// Relative error of the total time.
    pub fn error(&self) -> f64 {
        self.ours_s / self.theirs_s - 1.0
    }
    /// Share of the long blocks within 10 %.
    pub fn within(&self) -> f64 {
        if self.blocks.0 == 0 { 1.0 } else { self.blocks.1 as f64 / self.blocks.0 as f64 }
    }
}

/// Compares line by line. LinuxCNC joins short lines and names the last: ours are summed up to each line it names.
pub fn compare(theirs: &BTreeMap<u32, f64>, ours: &BTreeMap<u32, f64>) -> Agreement {
    let mut last = 0;
    let (mut long, mut near) = (0, 0);
    for (line, seconds) in theirs {
        let mine: f64 = ours.range(last + 1..(*line + 1).max(last + 1)).map(|(_, seconds)| seconds).sum();
        last = *line;
        if *seconds > 0.2 {
            long += 1;
            near += usize::from((mine / seconds - 1.0).abs() <= 0.1);
        }
    }
    Agreement { theirs_s: theirs.values().sum(), ours_s: ours.values().sum(), blocks: (long, near) }
}
