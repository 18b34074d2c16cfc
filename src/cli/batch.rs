//! `batch` and `merge`: many programs, each with its setup, and one summary. In: a folder or a list of programs. Out: for each
//! program what `optimize` writes, with its JSON report as the record that it is done.
//!
//! A record holds the hashes of the program, the setup and the output, the options that decide feeds, and the version. Where all of them
//! still hold the program is not run again: a batch that was killed goes on where it was, and several shards of one list on several machines do every program once.
//! Whoever runs, the files are the same bytes, and so is the summary.
//!
//! A scheduler may start a shard again while the first one still runs (its worker is lost, the program it called is not). So a batch
//! takes a program with a lock on its record, waits while another has it, and looks at the record once it has the lock.

use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::error::CliError;
use super::optimize::{Optimize, line, optimize};
use super::options::{Common, Global};
use super::output::{Kind, Outputs};
use super::screen::Screen;
use super::under_way::{Refusal, UnderWay};
use super::work::Work;
use crate::report::{Outcome, sha256};

/// `batch`, `merge`.
#[derive(Debug, Args)]
pub struct Batch {
    /// A folder of programs with their setups, or a list: one program a line, its setup behind a tab or beside it.
    pub of: PathBuf,
    /// Folder for the programs and their JSON reports; without it beside the programs.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Only this part of the programs, like 2/8.
    #[arg(long, value_name = "I/N", value_parser = shard)]
    pub shard: Option<(usize, usize)>,
    /// Write the summary as JSON; - is standard output.
    #[arg(long, value_name = "R.json")]
    pub json: Option<PathBuf>,
}

/// "2/8": the second of eight parts.
fn shard(text: &str) -> Result<(usize, usize), String> {
    let parts = text.split_once('/').and_then(|(part, parts)| Some((part.parse().ok()?, parts.parse().ok()?)));
    parts.filter(|(part, parts)| (1..=*parts).contains(part)).ok_or_else(|| "write it like 2/8, from 1/8 to 8/8".into())
}

/// Endings of files beside a program that are none.
const OTHERS: [&str; 13] =
    ["toml", "json", "html", "csv", "svg", "fwcache", "stock", "stl", "log", "md", "pdf", "png", "zip"];

/// May it be a program, by the ending of its name?
pub fn is_program(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    !OTHERS.contains(&ending.as_str())
}

/// How often it is seen whether another process has done with a program.
const LOOK_AGAIN: Duration = Duration::from_millis(100);

/// One program of a batch.
struct Job {
    /// As the list names it.
    name: String,
    program: PathBuf,
    setup: PathBuf,
    output: PathBuf,
    record: PathBuf,
}

/// Runs what is not done yet, and sums up its shard.
pub fn batch(command: &Batch, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let (shard, shards) = command.shard.unwrap_or((1, 1));
    let jobs = jobs(command)?;
    let own: Vec<&Job> = jobs.iter().skip(shard - 1).step_by(shards).collect();
    if let Some(folder) = &command.out {
        std::fs::create_dir_all(folder).map_err(|error| CliError::file("make the folder", folder, &error))?;
    }
    let options = global.deciding()?;
    for job in &own {
        let is_done = || done(job, &options).is_some();
        let taken = if is_done() { None } else { take(job, screen) };
        // Another may have done it between the look and the lock.
        if is_done() {
            screen.say(&format!("known     {}", job.name));
        } else {
            run(job, global, screen);
        }
        drop(taken);
    }
    sum_up(&own, command, global, screen)
}

/// What `optimize` does with a program; an error is said and ends this program only.
fn run(job: &Job, global: &Global, screen: Screen) {
    screen.say(&format!("runs      {}", job.name));
    let common = Common { setup: Some(job.setup.clone()), json: Some(job.record.clone()) };
    let work = Work { common, ..Work::of(job.program.clone()) };
    let one = Optimize { output: Some(job.output.clone()), ..Optimize::of(work) };
    if let Err(error) = optimize(&one, global, screen.quietly()) {
        screen.fail(&error);
    }
}

/// The program for this process alone, until what is returned is dropped or the process dies. Waits while another has it. `None`
/// where the folder cannot be written: then the run says so itself.
fn take(job: &Job, screen: Screen) -> Option<UnderWay> {
    let folder = job.record.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut lock = job.record.clone().into_os_string();
    lock.push(" is taken");
    let mut waits = false;
    loop {
        match UnderWay::begin(folder, Path::new(&lock)) {
            Ok(taken) => return Some(taken),
            Err(Refusal::Io(_)) => return None,
            Err(Refusal::Busy) if waits => {}
            Err(Refusal::Busy) => screen.say(&format!("waits     {}: another Feedwright has it", job.name)),
        }
        waits = true;
        std::thread::sleep(LOOK_AGAIN);
    }
}

/// Sums up what all shards have done.
pub fn merge(command: &Batch, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let jobs = jobs(command)?;
    sum_up(&jobs.iter().collect::<Vec<_>>(), command, global, screen)
}

/// The programs in the order of the list, or of their names.
fn jobs(command: &Batch) -> Result<Vec<Job>, CliError> {
    let pairs = if command.of.is_dir() { in_folder(&command.of)? } else { in_list(&command.of)? };
    if pairs.is_empty() {
        return Err(CliError::new(
            format!("{}: there is no program with a setup in it", command.of.display()),
            "give a folder with part.nc and part.setup.toml, or a list with one program a line",
        ));
    }
    let jobs: Vec<Job> = pairs.into_iter().map(|(name, program, setup)| job(name, program, setup, command)).collect();
    let mut outputs: Vec<&PathBuf> = jobs.iter().map(|job| &job.output).collect();
    outputs.sort();
    match outputs.windows(2).find(|pair| pair[0] == pair[1]) {
        None => Ok(jobs),
        Some(pair) => Err(CliError::new(
            format!("two programs of the batch would be written as {}", pair[0].display()),
            "name each program once, and give programs of one name folders of their own",
        )),
    }
}

fn job(name: String, program: PathBuf, setup: PathBuf, command: &Batch) -> Job {
    let stem = program.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let ending = program.extension().map_or(String::new(), |ending| format!(".{}", ending.to_string_lossy()));
    let folder = command.out.clone().unwrap_or_else(|| program.parent().unwrap_or(Path::new("")).to_owned());
    let output = folder.join(format!("{stem}.fw{ending}"));
    // With its ending: O0001.nc and O0001.tap are two programs.
    let record = folder.join(format!("{stem}.fw{ending}.json"));
    Job { name, program, setup, output, record }
}

/// Every program in a folder that has a setup beside it.
fn in_folder(folder: &Path) -> Result<Vec<(String, PathBuf, PathBuf)>, CliError> {
    let entries = std::fs::read_dir(folder).map_err(|error| CliError::file("read", folder, &error))?;
    let mut found = Vec::new();
    for path in entries.filter_map(|entry| Some(entry.ok()?.path())) {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let setup = folder.join(format!("{stem}.setup.toml"));
        if is_program(&path) && setup.is_file() {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            found.push((name, path, setup));
        }
    }
    found.sort();
    Ok(found)
}

/// One program a line, its setup behind a tab or, without one, beside it; paths are seen from the list. Lines with # are comments.
fn in_list(list: &Path) -> Result<Vec<(String, PathBuf, PathBuf)>, CliError> {
    let text = super::input::text(list)?;
    let folder = list.parent().unwrap_or(Path::new(""));
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let one = |line: &str| {
        let (program, setup) = line.split_once('\t').map_or((line, None), |(a, b)| (a.trim(), Some(b.trim())));
        let path = folder.join(program);
        let setup = setup.map_or_else(|| path.with_extension("setup.toml"), |setup| folder.join(setup));
        (program.to_owned(), path, setup)
    };
    Ok(lines.map(one).collect())
}

/// The record of a program, where it, its setup, its output and the options are still those of the record; and whether there is an output, which a
/// collision for one holds back.
fn done(job: &Job, options: &[String]) -> Option<(Value, bool)> {
    let record: Value = serde_json::from_slice(&std::fs::read(&job.record).ok()?).ok()?;
    let from = &record["provenance"];
    let hash = |path: &Path| std::fs::read(path).ok().map(|bytes| sha256(&bytes));
    let held = record["verdict"]["faults"].as_array()?.iter().any(|fault| fault["holds_back"] == true);
    let same = |key: &str, path: &Path| hash(path).is_some_and(|hash| from[key] == hash.as_str());
    let is_written = same("output_sha256", &job.output);
    let whole = from["version"] == env!("CARGO_PKG_VERSION")
        && from["options"] == json!(options)
        && same("original_sha256", &job.program)
        && same("setup_sha256", &job.setup)
        && (held || is_written);
    whole.then_some((record, is_written))
}

/// One line a program, the whole, and the same as JSON.
fn sum_up(jobs: &[&Job], command: &Batch, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let mut outputs = Outputs::new(jobs.iter().flat_map(|job| [job.program.clone(), job.setup.clone()]), global.force);
    let file = command.json.as_deref().map(|path| outputs.open(path, Kind::Json)).transpose()?;
    let options = global.deciding()?;
    let mut text = String::new();
    let (mut rows, mut whole, mut bad) = (Vec::new(), [0.0, 0.0], 0);
    for job in jobs {
        let Some((mut record, is_written)) = done(job, &options) else {
            text += &format!("{:<32} not done: run it alone to see why\n", job.name);
            rows.push(json!({ "program": job.name, "outcome": "not done" }));
            bad += 1;
            continue;
        };
        if !is_written {
            let headline = record["verdict"]["headline"].as_str().unwrap_or_default();
            text += &format!("{:<32} not written: {headline}\n", job.name);
            if let Some(from) = record["provenance"].as_object_mut() {
                from.remove("output_sha256");
            }
            rows.push(json!({
                "program": job.name, "outcome": "not written", "headline": record["verdict"]["headline"],
                "provenance": record["provenance"],
            }));
            bad += 1;
            continue;
        }
        let seconds = |key: &str| record["time"][key].as_f64().unwrap_or(0.0);
        let (before, after) = (seconds("realised_before_s"), seconds("realised_after_s"));
        whole = [whole[0] + before, whole[1] + after];
        let verdict = &record["verdict"];
        bad += usize::from(verdict["outcome"] != "done");
        let headline = verdict["headline"].as_str().unwrap_or_default();
        text += &line(&job.name, [before, after], headline);
        rows.push(json!({
            "program": job.name, "outcome": verdict["outcome"], "headline": headline, "realised_before_s": before,
            "realised_after_s": after, "provenance": record["provenance"],
        }));
    }
    text += &format!(
        "{} programs, {bad} to look at; {} → {}\n",
        jobs.len(),
        crate::report::clock(whole[0]),
        crate::report::clock(whole[1])
    );
    if let Some(file) = file {
        let summary = json!({ "written_by": crate::report::WRITTEN_BY, "programs": rows, "realised_before_s": whole[0], "realised_after_s": whole[1] });
        file.write((serde_json::to_string_pretty(&summary).expect("plain data") + "\n").as_bytes())?;
    }
    outputs.commit()?;
    screen.show(&text)?;
    Ok(if bad == 0 { Outcome::Done } else { Outcome::Unmet })
}
