//! Realised time against LinuxCNC's planner. With a folder of `prog/NAME.ngc` and `log/NAME.ACC.csv` as argument it
//! compares those; without, it runs programs of the corpus through LinuxCNC where that is installed (half an hour): each as it is and as
//! rewritten, under G61 and G64 P0.01, at two accelerations. Names as arguments choose programs. SPEEDUP (default 4) is how much
//! faster the simulator's clock runs; a run that could not keep up is repeated at real time.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "../tests/linuxcnc/mod.rs"]
mod linuxcnc;

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use feedwright::job::{Keep, Task, Wanted, Watch, optimize};
use feedwright::nc::{self, MoveKind};
use feedwright::{engage, setup};

/// Programs, with their setup where there is one.
const PROGRAMS: [(&str, &str); 10] = [
    ("programs/pocket.nc", "programs/pocket.setup.toml"),
    ("../shared/programs/camotics_heart.ngc", ""),
    ("../shared/programs/lcnc_comp-g1.ngc", ""),
    ("../shared/programs/pygcode_DB25.tap", ""),
    ("../shared/programs/lcnc_cam-nisley.ngc", ""),
    ("../shared/programs/maestro_PARALLEL.NC", "../shared/programs/setups/maestro_PARALLEL.toml"),
    ("../shared/programs/lcnc_inverse-time-comp.ngc", ""),
    ("../shared/programs/camotics_heart_cutout.ngc", ""),
    ("../shared/programs/lcnc_cds.ngc", ""),
    ("programs/saddle.nc", "programs/saddle.setup.toml"),
];

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    if let [folder] = words.as_slice()
        && Path::new(folder).is_dir()
    {
        return stored(Path::new(folder));
    }
    if !linuxcnc::installed() {
        println!("skipped: LinuxCNC, its user lcnc or {} is not there", linuxcnc::SCRIPTS);
        return;
    }
    println!(
        "program mode acceleration: LinuxCNC s, model s, error %, blocks within 10 % | the same rewritten | saved % there, saved % claimed"
    );
    for (program, setup_file) in PROGRAMS {
        let name = Path::new(program).file_stem().unwrap().to_string_lossy().into_owned();
        if words.is_empty() || words.contains(&name) {
            for (mode, tag) in [("G61", "g61"), ("G64 P0.01", "g64")] {
                for acceleration in [500.0, 2000.0] {
                    let row = both(program, setup_file, mode, &format!("{name}_{tag}"), acceleration);
                    println!("{name} {mode} {acceleration}: {}", row.unwrap_or_else(|why| why));
                }
            }
        }
    }
}

/// One program as it is and as rewritten.
fn both(program: &str, setup_file: &str, mode: &str, name: &str, acceleration: f64) -> Result<String, String> {
    let bytes = fs::read(program).map_err(|error| error.to_string())?;
    let text: String = bytes.iter().map(|byte| *byte as char).collect();
    let original = linuxcnc::with_mode(&text, mode);
    let rewritten = rewritten(&original, setup_file, acceleration)?;
    let (before, first) = judged(name, &original, acceleration)?;
    let (after, second) = judged(&format!("{name}_fw"), &rewritten, acceleration)?;
    let saved = |before: f64, after: f64| 100.0 * (1.0 - after / before);
    let (real, claimed) = (saved(before[0], after[0]), saved(before[1], after[1]));
    Ok(format!("{first} | {second} | {real:.1} {claimed:.1}"))
}

/// LinuxCNC's time and the model's, and both as text.
fn judged(name: &str, text: &str, acceleration: f64) -> Result<([f64; 2], String), String> {
    let speed_up = std::env::var("SPEEDUP").ok().and_then(|text| text.parse().ok()).unwrap_or(4);
    let theirs: BTreeMap<u32, f64> = linuxcnc::run(name, text, acceleration, speed_up)
        .or_else(|_| linuxcnc::run(name, text, acceleration, 1))
        .map_err(|why| why.lines().last().unwrap_or_default().to_owned())?;
    let found = linuxcnc::compare(&theirs, &linuxcnc::model(text, acceleration));
    let words = format!(
        "{:.2} {:.2} {:+.2} {:.0}/{}",
        found.theirs_s,
        found.ours_s,
        100.0 * found.error(),
        100.0 * found.within(),
        found.blocks.0
    );
    Ok(([found.theirs_s, found.ours_s], words))
}

/// The text as Feedwright writes it for the simulator's machine. Without a setup: small end mills in a block of aluminium under all
/// feed moves, with a force limit.
fn rewritten(text: &str, setup_file: &str, acceleration: f64) -> Result<String, String> {
    let program = nc::parse(text.as_bytes().to_vec(), None);
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

fn stored(folder: &Path) {
    let mut logs: Vec<_> = fs::read_dir(folder.join("log")).unwrap().flatten().map(|entry| entry.path()).collect();
    logs.sort();
    for csv in logs.iter().filter(|path| path.extension().is_some_and(|extension| extension == "csv")) {
        let stem = csv.file_stem().unwrap().to_string_lossy().into_owned();
        let (name, acceleration) = stem.rsplit_once('.').unwrap();
        let text = fs::read(folder.join("prog").join(format!("{name}.ngc"))).unwrap();
        let text: String = text.iter().map(|byte| *byte as char).collect();
        let theirs = linuxcnc::read_lines(csv).unwrap();
        let ours = linuxcnc::model(&text, acceleration.parse().unwrap());
        let agreement = linuxcnc::compare(&theirs, &ours);
        println!(
            "{stem:40} {:9.2} s {:9.2} s {:+6.2} %  {:3.0} % of {} blocks",
            agreement.theirs_s,
            agreement.ours_s,
            100.0 * agreement.error(),
            100.0 * agreement.within(),
            agreement.blocks.0
        );
        if std::env::var("LINES").is_ok() {
            let mut last = 0;
            for (line, seconds) in &theirs {
                let mine: f64 = ours.range(last + 1..(*line + 1).max(last + 1)).map(|(_, seconds)| seconds).sum();
                last = *line;
                println!("   {line} {seconds:.3} {mine:.3}");
            }
        }
    }
}
