//! The outputs of a command are one set: they appear together and whole or not at all, no input changes, and what a killed run leaves
//! is swept by the next. Twenty kills in the ordinary run, two hundred with `FEEDWRIGHT_LONG=1`.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod common {
    pub mod follow;
}

use assert_cmd::cargo::cargo_bin;
use common::follow::{SETUP, job, power_log};
use feedwright::learn::calibrate::plan::{Kind, plan};
use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Everything `optimize` can write, at once.
const OPTIMIZE: [&str; 12] = [
    "optimize",
    "part.nc",
    "--accept-infeasible",
    "--cache",
    "--save-stock",
    "left.stock",
    "--json",
    "r.json",
    "--csv",
    "r.csv",
    "--report",
    "r.html",
];
const LEARN: [&str; 10] =
    ["learn", "part.nc", "--log", "log.csv", "-o", "model.toml", "--json", "l.json", "--report", "l.html"];

struct Bench(TempDir);

impl Bench {
    /// A program of test cuts, its setup and a log of it.
    fn new() -> Self {
        let program = plan(Kind::Power, &job()).unwrap().program;
        let power = power_log(&program, 10);
        let bench = Self(tempfile::tempdir().unwrap());
        for (name, text) in [("part.nc", &*program), ("part.setup.toml", SETUP), ("log.csv", &power)] {
            fs::write(bench.path(name), text).unwrap();
        }
        bench
    }
    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(cargo_bin("feedwright"));
        command.current_dir(self.0.path()).args(arguments).stdin(Stdio::null());
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        command
    }
    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }
    /// Exit code 2 with a sentence, and the folder as it was.
    #[track_caller]
    fn refused(&self, arguments: &[&str], words: &str) {
        let before = files(self.0.path());
        let output = self.run(arguments);
        let said = said(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(words), "{arguments:?} does not say {words:?}: {said}");
        assert!(files(self.0.path()) == before, "{arguments:?} wrote something");
    }
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Names and contents of the files of a folder.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(Result::unwrap).filter(|entry| entry.path().is_file());
    entries.map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap())).collect()
}

fn litter(folder: &Path) -> Vec<String> {
    files(folder).into_keys().filter(|name| name.starts_with(".feedwright-")).collect()
}

/// Numbers from 0 to 1 (a linear congruence: Knuth's MMIX constants).
fn draws(seed: u64) -> impl Iterator<Item = f64> {
    let step = |state: &u64| Some(state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407));
    std::iter::successors(Some(seed), step).skip(1).map(|state| (state >> 11) as f64 / (1u64 << 53) as f64)
}

fn long() -> bool {
    std::env::var_os("FEEDWRIGHT_LONG").is_some()
}

/// Kills runs at drawn moments and looks at what is there. Every second run finds the outputs of an earlier one.
fn killed_at_drawn_moments(arguments: &[&str], kills: usize, seed: u64) {
    let bench = Bench::new();
    let folder = bench.0.path();
    let inputs = files(folder);
    let start = Instant::now();
    let output = bench.run(arguments);
    let whole_s = start.elapsed().as_secs_f64();
    assert!(output.status.code() < Some(2), "{}", said(&output));
    let whole = files(folder);
    assert!(whole.len() >= inputs.len() + 3);
    let mut moments = draws(seed);
    for k in 0..kills {
        let replaces = k % 2 == 1;
        for name in whole.keys().filter(|name| !inputs.contains_key(*name)) {
            let _ = fs::remove_file(folder.join(name));
            if replaces {
                fs::write(folder.join(name), &whole[name]).unwrap();
            }
        }
        let before = files(folder);
        let mut child = bench.command(arguments).spawn().unwrap();
        std::thread::sleep(Duration::from_secs_f64(1.2 * whole_s * moments.next().unwrap()));
        let signal = ["KILL", "TERM", "INT"][k % 3];
        Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status().unwrap();
        child.wait().unwrap();
        for (name, bytes) in files(folder) {
            if name.starts_with(".feedwright-") {
                // What an earlier kill left stays where this run was ended before it swept.
                assert!(signal == "KILL" || before.contains_key(&name), "kill {k} ({signal}): {name} was left");
                continue;
            }
            let known = [before.get(&name), whole.get(&name)];
            assert!(known.contains(&Some(&bytes)), "kill {k} ({signal}): {name} is not whole");
        }
        assert!(inputs.iter().all(|(name, bytes)| fs::read(folder.join(name)).is_ok_and(|now| now == *bytes)));
    }
    assert!(bench.run(arguments).status.code() < Some(2));
    assert_eq!(litter(folder), Vec::<String>::new());
    assert!(files(folder) == whole, "a run after {kills} kills writes something else");
    println!("{}: {kills} kills, nothing lost", arguments[0]);
}

#[test]
fn optimize_can_be_killed_at_any_moment() {
    killed_at_drawn_moments(&OPTIMIZE, if long() { 140 } else { 14 }, 26);
}

#[test]
fn learn_can_be_killed_at_any_moment() {
    killed_at_drawn_moments(&LEARN, if long() { 60 } else { 6 }, 27);
}

/// A file size limit stands for the full disk: writing beyond 16 kB fails.
#[test]
fn a_full_disk_leaves_nothing() {
    let bench = Bench::new();
    let before = files(bench.0.path());
    let script = "trap '' XFSZ; ulimit -f 16; exec \"$@\"";
    let mut command = Command::new("bash");
    command.current_dir(bench.0.path()).args(["-c", script, "bash"]).arg(cargo_bin("feedwright"));
    let output = command.args(OPTIMIZE).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(said(&output).contains("cannot write"), "{}", said(&output));
    assert!(files(bench.0.path()) == before);
}

#[test]
fn two_processes_on_one_output_are_told_apart() {
    let bench = Bench::new();
    // The first one waits for its program: it comes through a pipe that is not closed yet.
    let arguments = ["optimize", "-", "--setup", "part.setup.toml", "--accept-infeasible", "-o", "out.nc"];
    let mut first = bench.command(&["optimize", "part.nc", "-o", "out.nc", "--report", "fifo"]);
    let fifo = bench.path("fifo");
    assert!(Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    let mut first = first.arg("--accept-infeasible").spawn().unwrap();
    let begun = Instant::now();
    while litter(bench.0.path()).is_empty() && begun.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(10));
    }
    // It stands at the pipe until somebody reads the page.
    let mut second = bench.command(&arguments).stdin(Stdio::piped()).spawn().unwrap();
    second.stdin.take().unwrap().write_all(&fs::read(bench.path("part.nc")).unwrap()).unwrap();
    let output = second.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("another Feedwright is writing out.nc"), "{}", said(&output));
    let page = fs::read(&fifo).unwrap();
    assert!(first.wait().unwrap().code() < Some(2));
    assert!(page.ends_with(b"</html>\n") && bench.path("out.nc").exists());
    assert_eq!(litter(bench.0.path()), Vec::<String>::new());
}

#[test]
fn an_input_that_changes_meanwhile_ends_the_run() {
    let bench = Bench::new();
    let fifo = bench.path("page");
    assert!(Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    let child = bench.command(&["simulate", "part.nc", "--report", "page", "--json", "r.json"]).spawn().unwrap();
    // It stands at the pipe; the program becomes another before somebody reads the page.
    let begun = Instant::now();
    while litter(bench.0.path()).is_empty() && begun.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(10));
    }
    fs::write(bench.path("part.nc"), "G1 X1 F100\n").unwrap();
    // Somebody reads the page, if it comes that far.
    let mut reader = Command::new("cat").arg(&fifo).stdout(Stdio::null()).spawn().unwrap();
    let output = child.wait_with_output().unwrap();
    let _ = reader.kill();
    reader.wait().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(said(&output).contains("was changed while Feedwright worked on it"), "{}", said(&output));
    assert!(!bench.path("r.json").exists() && litter(bench.0.path()).is_empty());
}

#[test]
fn odd_outputs_are_refused_or_written_as_is_said() {
    use std::os::unix::fs::symlink;
    let bench = Bench::new();
    let at = |name: &str| bench.path(name);
    symlink("part.nc", at("same.nc")).unwrap();
    symlink("nowhere.nc", at("dangling.nc")).unwrap();
    fs::hard_link(at("part.nc"), at("hard.nc")).unwrap();
    fs::create_dir(at("folder")).unwrap();
    fs::write(at("real.nc"), "").unwrap();
    symlink("real.nc", at("link.nc")).unwrap();
    let out = |name| ["optimize", "part.nc", "--accept-infeasible", "-o", name];
    for name in ["part.nc", "same.nc", "hard.nc", "./folder/../part.nc"] {
        bench.refused(&out(name), "is an input and is never overwritten");
    }
    bench.refused(&out("dangling.nc"), "is a link to a file that does not exist");
    bench.refused(&out("folder"), "is a folder");
    bench.refused(&out("no/where.nc"), "there is no such file or folder");
    bench.refused(&["simulate", "part.nc", "--json", "x", "--csv", "./x"], "is written twice");
    assert!(bench.run(&out("link.nc")).status.code() < Some(2));
    assert!(at("link.nc").is_symlink() && fs::metadata(at("real.nc")).unwrap().len() > 0);
    assert_eq!(fs::read_link(at("same.nc")).unwrap(), Path::new("part.nc"));
}

#[test]
fn a_read_only_folder_is_found_out_before_the_work() {
    use std::os::unix::fs::PermissionsExt;
    let bench = Bench::new();
    let folder = bench.path("locked");
    fs::create_dir(&folder).unwrap();
    fs::set_permissions(&folder, fs::Permissions::from_mode(0o555)).unwrap();
    // Nothing is read-only for root but what the system makes so.
    let out = if fs::write(folder.join("probe"), "").is_ok() { "/proc/out.nc" } else { "locked/out.nc" };
    bench.refused(&["optimize", "part.nc", "--json", "r.json", "-o", out], "cannot write");
}

/// Whoever reads the summary may go away: the files are there all the same.
#[test]
fn a_closed_pipe_does_not_cost_the_files() {
    let bench = Bench::new();
    let mut command = Command::new("bash");
    command.current_dir(bench.0.path()).args(["-c", "\"$@\" | true; exit ${PIPESTATUS[0]}", "bash"]);
    let output = command.arg(cargo_bin("feedwright")).args(OPTIMIZE).output().unwrap();
    assert!(output.status.code() < Some(2), "{}", said(&output));
    assert!(bench.path("part.fw.nc").exists() && bench.path("r.json").exists());
}

/// Two folders, two numbers of threads, two times: the same bytes, and neither folder nor host in them.
#[test]
fn outputs_say_nothing_of_where_and_when_they_were_made() {
    for arguments in [&OPTIMIZE[..], &LEARN[..]] {
        let made = ["1", "7"].map(|threads| {
            let bench = Bench::new();
            let output = bench.command(arguments).args(["--threads", threads]).output().unwrap();
            assert!(output.status.code() < Some(2), "{}", said(&output));
            let host = fs::read("/etc/hostname").unwrap_or_default();
            let told = [bench.0.path().as_os_str().as_encoded_bytes(), host.trim_ascii()];
            let files = files(bench.0.path());
            for (name, bytes) in &files {
                let holds = |part: &&[u8]| part.len() > 3 && memchr::memmem::find(bytes, part).is_some();
                assert!(!told.iter().any(holds), "{name} says where it was made");
            }
            files
        });
        assert!(made[0] == made[1], "{}: other bytes in another folder with other threads", arguments[0]);
    }
}
