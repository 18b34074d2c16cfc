//! The main job on whole programs: seconds of processor by stage and per minute of machining, at the default cell. In: the
//! programs of this project and, where the folder `../shared` is present, its corpus, each with its setup. Out: a line a
//! program, and whether it keeps the goal: on two cores no more than 2 % of the machining time, or 10 s.
//! `cargo bench --bench corpus -- [part of a name …]`.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

#[path = "../tests/common/corpus.rs"]
mod corpus;

use std::path::{Path, PathBuf};

use feedwright::job::{Keep, Task, Wanted, Watch, optimize};
use feedwright::nc::Dialect;
use feedwright::{engage, nc, setup};

const STAGES: [&str; 5] = ["parse", "simulate", "schedule", "rewrite", "check"];
/// Cores that the goal is for, the part of the machining time it allows, and the seconds it allows in any case.
const CORES: f64 = 2.0;
const OF_MACHINING: f64 = 0.02;
const ALLOWED_S: f64 = 10.0;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    let wanted = |path: &Path| {
        let name = path.to_string_lossy();
        words.is_empty() || words.iter().any(|word| name.contains(word.as_str()))
    };
    println!("seconds of processor by stage; per machining minute; against the goal");
    for (program, setup_file) in of_this_project().into_iter().chain(of_the_corpus()) {
        if wanted(&program) {
            measure(&program, &setup_file);
        }
    }
}

/// Programs beside which a setup lies.
fn of_this_project() -> Vec<(PathBuf, PathBuf)> {
    let files = std::fs::read_dir("programs").unwrap().map(|entry| entry.unwrap().path());
    let mut found: Vec<(PathBuf, PathBuf)> = files
        .filter(|path| path.extension().is_some_and(|extension| extension == "nc" || extension == "ngc"))
        .map(|path| (path.clone(), path.with_extension("setup.toml")))
        .filter(|(_, setup_file)| setup_file.exists())
        .collect();
    found.sort();
    found
}

fn of_the_corpus() -> Vec<(PathBuf, PathBuf)> {
    let pair = |(file, name): &(&str, &str)| {
        Some((corpus::shared(file)?, corpus::shared(&format!("programs/setups/{name}.toml"))?))
    };
    corpus::LISTED.iter().filter_map(pair).collect()
}

fn measure(program: &Path, setup_file: &Path) {
    let toml = std::fs::read_to_string(setup_file).unwrap();
    let (job, assumptions) = setup::load(&toml, setup_file.parent().unwrap()).unwrap();
    let dialect = job.machine.dialect.as_deref().and_then(Dialect::from_name);
    let program_read = nc::parse(std::fs::read(program).unwrap(), dialect);
    let load = |path: &Path| std::fs::read(path);
    let watch = Watch {
        progress: &|_, _| (),
        clock: &processor_s,
        subprograms: &|_| None,
        engage: engage::Options { loader: Some(&load), ..engage::Options::default() },
        keep: Keep::default(),
    };
    let begin = processor_s();
    let name = program.file_name().unwrap_or_default().to_string_lossy();
    let run = match optimize(Task { program: program_read, job, assumptions, wanted: Wanted::default() }, &watch) {
        Ok(run) => run,
        Err(error) => {
            println!("{name}: {error}");
            return;
        }
    };
    let whole_s = processor_s() - begin;
    let machining_s = run.realised_before.total_s;
    let stages: Vec<String> =
        STAGES.iter().zip(run.stage_s).map(|(stage, seconds)| format!("{stage} {seconds:.2}")).collect();
    let allowed_s = CORES * ALLOWED_S.max(OF_MACHINING * machining_s);
    println!(
        "{name}: {}; {whole_s:.2} s in all, {:.3} a minute of {:.1}; {} {allowed_s:.1}",
        stages.join(", "),
        whole_s / (machining_s / 60.0),
        machining_s / 60.0,
        if whole_s <= allowed_s { "within" } else { "MORE THAN" },
    );
}

/// Seconds of processor that this process has used, on all cores; the kernel counts in hundredths.
fn processor_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // After the name in brackets: state, then user and system time as the 12th and 13th.
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace().skip(11).take(2);
    fields.filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}
