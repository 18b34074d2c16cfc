//! Realised time against LinuxCNC's planner: programs of the corpus through LinuxCNC where that is installed, each as it is and as
//! rewritten, under G61 and G64 P0.01, at two accelerations. What was run before is kept, so that a bench that was stopped goes on where it
//! was. Names as arguments choose programs; `stored` runs none anew; LINES=1 prints every line that is 10 % off. SPEEDUP (default
//! 8) is how much faster the simulator's clock runs; a run that could not keep up is repeated more slowly.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "../tests/linuxcnc/mod.rs"]
mod linuxcnc;

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use feedwright::job::{Keep, Task, Wanted, Watch, optimize};
use feedwright::nc::MoveKind;
use feedwright::{engage, setup};
use linuxcnc::Agreement;

/// Programs, with their setup where there is one; the last two are our own.
const PROGRAMS: [(&str, &str); 12] = [
    ("../shared/programs/lcnc_m98_loops.ngc", ""),
    ("../shared/programs/lcnc_comp-g1.ngc", ""),
    ("../shared/programs/lcnc_inverse-time-comp.ngc", ""),
    ("../shared/programs/maestro_PARALLEL.NC", "../shared/programs/setups/maestro_PARALLEL.toml"),
    ("../shared/programs/lcnc_3D_Chips.ngc", ""),
    ("../shared/programs/camotics_bear.nc", "../shared/programs/setups/camotics_bear.toml"),
    ("../shared/programs/cncjs_helical_thread.gcode", ""),
    ("../shared/programs/lcnc_cds.ngc", ""),
    ("../shared/programs/camotics_heart_cutout.ngc", ""),
    ("../shared/programs/camotics_slant_test.nc", ""),
    ("programs/pocket.nc", "programs/pocket.setup.toml"),
    ("programs/saddle.nc", "programs/saddle.setup.toml"),
];
/// Modes of the path, with the tag they have in names of files.
const MODES: [(&str, &str); 2] = [("G61", "g61"), ("G64 P0.01", "g64")];
/// Accelerations, mm/s².
const ACCELERATIONS: [f64; 2] = [500.0, 2000.0];

/// A program at one mode and acceleration, as it is and as rewritten.
struct Row {
    before: Agreement,
    after: Agreement,
}

impl Row {
    /// Percent of the time saved: in LinuxCNC, and as the model claims.
    fn saved(&self) -> [f64; 2] {
        let saved = |before: f64, after: f64| 100.0 * (1.0 - after / before);
        [saved(self.before.theirs_s, self.after.theirs_s), saved(self.before.ours_s, self.after.ours_s)]
    }
}

fn main() {
    let mut words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let anew = words.iter().position(|word| word == "stored").map(|at| words.remove(at)).is_none();
    if !linuxcnc::installed() {
        println!("skipped: LinuxCNC, its user lcnc or {} is not there", linuxcnc::SCRIPTS);
        return;
    }
    println!(
        "| program | mode, mm/s² | LinuxCNC, s | model, % | blocks | rewritten, s | model, % | blocks | saved there, % | claimed, % |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut rows = Vec::new();
    for (program, setup_file) in PROGRAMS {
        let name = Path::new(program).file_stem().unwrap().to_string_lossy().into_owned();
        if words.is_empty() || words.contains(&name) {
            for ((mode, tag), acceleration) in MODES.iter().flat_map(|mode| ACCELERATIONS.map(|each| (*mode, each))) {
                let stem = format!("{name}_{tag}");
                match both(program, setup_file, mode, &stem, acceleration, anew) {
                    Ok(row) => {
                        print_row(&name, mode, acceleration, &row);
                        rows.push(row);
                    }
                    Err(why) => println!("| {name} | {mode}, {acceleration} | {why} |"),
                }
            }
        }
    }
    summary(&rows);
}

fn print_row(name: &str, mode: &str, acceleration: f64, row: &Row) {
    let part = |found: &Agreement| {
        format!("{:.2} | {:+.2} | {}/{}", found.theirs_s, 100.0 * found.error(), found.blocks.1, found.blocks.0)
    };
    let [real, claimed] = row.saved();
    println!(
        "| {name} | {mode}, {acceleration} | {} | {} | {real:.1} | {claimed:.1} |",
        part(&row.before),
        part(&row.after)
    );
}

fn summary(rows: &[Row]) {
    let runs: Vec<&Agreement> = rows.iter().flat_map(|row| [&row.before, &row.after]).collect();
    let worst = runs.iter().map(|run| run.error().abs()).fold(0.0, f64::max);
    let count = |test: &dyn Fn(&Agreement) -> bool| runs.iter().filter(|run| test(run)).count();
    let (long, near) = runs.iter().fold((0, 0), |sum, run| (sum.0 + run.blocks.0, sum.1 + run.blocks.1));
    let off = rows.iter().map(|row| (row.saved()[0] - row.saved()[1]).abs()).fold(0.0, f64::max);
    println!(
        "{} runs: {} within 3 % (worst {:.2} %), {} with 90 % of the blocks longer than 0.2 s within 10 % ({near} of {long} over all); saving within {off:.2} points of the claim",
        runs.len(),
        count(&|run| run.error().abs() <= 0.03),
        100.0 * worst,
        count(&|run| run.within() >= 0.9),
    );
}

/// One program as it is and as rewritten.
fn both(program: &str, setup_file: &str, mode: &str, name: &str, acceleration: f64, anew: bool) -> Result<Row, String> {
    let bytes = fs::read(program).map_err(|error| error.to_string())?;
    let text: String = bytes.iter().map(|byte| *byte as char).collect();
    let turns = linuxcnc::toolpath(&text).moves.iter().any(|motion| motion.spin.rps > 0.0);
    // A program that names no spindle speed gets one: loads need it.
    let original = linuxcnc::with_mode(&text, &if turns { mode.to_owned() } else { format!("{mode}\nS8000 M3") });
    let before = judged(name, &original, acceleration, anew)?;
    let rewritten = rewritten(&original, setup_file, acceleration)?;
    let after = judged(&format!("{name}_fw"), &rewritten, acceleration, anew)?;
    Ok(Row { before, after })
}

/// LinuxCNC's time and the model's.
fn judged(name: &str, text: &str, acceleration: f64, anew: bool) -> Result<Agreement, String> {
    let speed_up = std::env::var("SPEEDUP").ok().and_then(|text| text.parse().ok()).unwrap_or(8u32);
    let theirs: BTreeMap<u32, f64> = match linuxcnc::stored(name, text, acceleration) {
        Some(known) => known,
        None if !anew => return Err("not run yet".to_owned()),
        None => [speed_up, speed_up.div_ceil(2), speed_up.div_ceil(4)]
            .iter()
            .find_map(|speed_up| linuxcnc::run(name, text, acceleration, *speed_up).ok())
            .ok_or("LinuxCNC does not run it")?,
    };
    let ours = linuxcnc::model(text, acceleration);
    if std::env::var("LINES").is_ok() {
        print_lines(&theirs, &ours);
    }
    Ok(linuxcnc::compare(&theirs, &ours))
}

fn print_lines(theirs: &BTreeMap<u32, f64>, ours: &BTreeMap<u32, f64>) {
    let mut last = 0;
    for (line, seconds) in theirs {
        let mine: f64 = ours.range(last + 1..(*line + 1).max(last + 1)).map(|(_, seconds)| seconds).sum();
        last = *line;
        if (mine - seconds).abs() > 0.1 * seconds {
            println!("   line {line}: {seconds:.3} s, model {mine:.3} s");
        }
    }
}

/// The text as Feedwright writes it for the simulator's machine. Without a setup: small end mills in a block of aluminium under all
/// feed moves, with a force limit.
fn rewritten(text: &str, setup_file: &str, acceleration: f64) -> Result<String, String> {
    let program = linuxcnc::program(text);
    let toml = if setup_file.is_empty() {
        assumed(text)
    } else {
        fs::read_to_string(setup_file).map_err(|error| error.to_string())?
    };
    let folder = Path::new(setup_file).parent().unwrap_or(Path::new("."));
    let (mut job, assumptions) = setup::load(&toml, folder).map_err(|error| error.to_string())?;
    job.machine = linuxcnc::machine(acceleration);
    let watch = Watch {
        progress: &|_, _| (),
        clock: &|| 0.0,
        subprograms: &|_| None,
        engage: engage::Options::default(),
        keep: Keep::default(),
    };
    let task = Task { program, job, assumptions, wanted: Wanted::default() };
    let run = optimize(task, &watch).map_err(|error| error.to_string())?;
    Ok(run.written.unwrap().bytes.iter().map(|byte| *byte as char).collect())
}

fn assumed(text: &str) -> String {
    let path = linuxcnc::toolpath(text);
    let mut tools: Vec<u32> = path.moves.iter().map(|motion| motion.tool).collect();
    tools.sort_unstable();
    tools.dedup();
    let ends = path.moves.iter().filter(|motion| motion.kind == MoveKind::Feed).map(|motion| motion.curve().to());
    let corner = |pick: fn(f64, f64) -> f64, start: f64| {
        ends.clone().fold([start; 3], |c, p| [pick(c[0], p.x), pick(c[1], p.y), pick(c[2], p.z)])
    };
    let (low, high) = (corner(f64::min, f64::INFINITY), corner(f64::max, f64::NEG_INFINITY));
    let top = high[2].min(0.0).max(low[2] + 0.5);
    let mut toml = format!(
        "[stock]\nmaterial = \"aluminium-6061-t6\"\nbox = {{ min = [{}, {}, {}], max = [{}, {}, {top}] }}\n[limits]\nforce_xy = 60\n",
        low[0] - 5.0,
        low[1] - 5.0,
        low[2] - 1.0,
        high[0] + 5.0,
        high[1] + 5.0
    );
    for tool in tools {
        let _ = write!(toml, "[[tool]]\nnumber = {tool}\nshape = \"flat\"\ndiameter = 3\nflutes = 2\n");
    }
    toml
}
