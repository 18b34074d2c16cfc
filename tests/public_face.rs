//! The library as others use it: its functions agree with the commands, and the examples run; so do the steps for other software.

#![allow(clippy::unwrap_used)]

use assert_cmd::Command;
use feedwright::{Error, Setup, calibrate, optimise, parse, simulate, verify};
use std::fs;
use std::path::Path;

#[path = "../examples/learn.rs"]
mod learn_example;
#[path = "../examples/optimise.rs"]
mod optimise_example;
#[path = "../examples/parse.rs"]
mod parse_example;
#[path = "../examples/simulate.rs"]
mod simulate_example;

const PROGRAM: &str = "%\nG21 G90\nT1 M6\nS8000 M3\nG0 X-10 Y5 Z2\nG1 Z-2 F300\nG1 X50 F900\nY12\nX-10 F450\nY15\nX50 F1400\nG0 Z10\nM30\n%\n";

fn setup_with(k_tc: f64) -> String {
    format!(
        "resolution = 0.5\n[machine]\ndialect = \"linuxcnc\"\n[stock]\nbox = {{ min = [0, 0, -10], max = [40, 20, 0] }}\n\
         [material]\nk_tc = {k_tc}\nk_te = 14\n[[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 6\nflutes = 3\n\
         [limits]\nforce_xy = 60\n"
    )
}

fn setup(text: &str) -> Setup {
    Setup::from_toml(text, ".").unwrap()
}

#[test]
fn the_library_writes_what_the_command_writes() {
    let dir = tempfile::tempdir().unwrap();
    let [program, toml] = ["part.nc", "part.setup.toml"].map(|name| dir.path().join(name));
    fs::write(&program, PROGRAM).unwrap();
    fs::write(&toml, setup_with(800.0)).unwrap();
    let command = Command::cargo_bin("feedwright").unwrap().current_dir(&dir).args(["optimize", "part.nc"]).output();
    assert!(command.unwrap().status.code().is_some_and(|code| code < 2));
    let written = fs::read(dir.path().join("part.fw.nc")).unwrap();
    assert_eq!(optimise_example::rewritten(&program, &toml).unwrap(), written);
    assert_ne!(written, PROGRAM.as_bytes());
    let setup = setup(&setup_with(800.0));
    let found = optimise(&parse(PROGRAM, Some(&setup)).unwrap(), &setup).unwrap();
    let force = found.prediction.loads().into_iter().find(|load| load.name == "force_xy").unwrap();
    assert_eq!((force.limit, force.unit), (Some(60.0), "N"));
    assert!(force.after.unwrap() <= 60.0 * 1.01 || found.prediction.outcome() == feedwright::Outcome::Unmet);
    assert!(simulate_example::loads(&program, &toml).unwrap().contains("force_xy"));
    let proof = verify(PROGRAM, written, Some(&setup)).unwrap();
    assert!(proof.holds() && proof.motions == 8 && proof.feeds_changed > 0, "{proof:?}");
}

#[test]
fn motions_are_read_and_what_is_no_mill_is_refused() {
    let text = parse_example::motions(PROGRAM.as_bytes()).unwrap();
    assert_eq!(text.matches("rapid").count(), 2, "{text}");
    assert!(text.contains("line    7  T1  X50.000 Y5.000 Z-2.000  F900"), "{text}");
    let turning = "G21 G18\nG96 S200 M4\nG50 S3000\nG0 X40 Z2\nG71 U2 R0.5\nG71 P10 Q20 U0.5 W0.1 F0.25\nN10 G0 X20\n\
                   G1 Z-20 F0.1\nN20 X40\nG70 P10 Q20\nM30\n";
    assert!(matches!(parse(turning, None), Err(Error::Refused(..))));
}

#[test]
fn what_cannot_be_done_is_an_error_with_its_reason() {
    let wrong = Setup::from_toml("[stock]\nbux = 1\n", ".").unwrap_err();
    assert!(wrong.to_string().contains("bux"), "{wrong}");
    let no_tool = setup(&setup_with(800.0));
    let found = simulate(&parse("T5 M6\nS3000 M3\nG1 X10 F500\nM30\n", None).unwrap(), &no_tool);
    assert!(matches!(found, Err(Error::Job(_))));
    assert!(matches!(calibrate(b"x,y\n1,2\n", "power", None), Err(Error::Table(_))));
}

/// Power of eight cuts after P = tare + k_tc Q + k_te L, with k_tc 900 N/mm² and k_te 20 N/mm: the coefficients come back.
#[test]
fn coefficients_come_back_from_a_table() {
    let mut table = "feed_mm_min,spindle_rpm,axial_depth_mm,radial_depth_mm,side,removal_rate_mm3_s,contact_rate_mm2_s,spindle_power_w\n".to_owned();
    for (k, feed) in [200.0, 400.0, 600.0, 800.0].into_iter().cycle().take(8).enumerate() {
        let depth = if k < 4 { 2.0 } else { 3.5 };
        let [removal, contact] = [depth * 4.0 * feed / 60.0, depth * 900.0];
        let power = 150.0 + 1e-3 * (900.0 * removal + 20.0 * contact);
        table += &format!("{feed},6000,{depth},4,down,{removal},{contact},{power}\n");
    }
    let found = calibrate(table.as_bytes(), "power", None).unwrap();
    let of = |name: &str| found.coefficients().into_iter().find(|one| one.name == name).unwrap().value;
    assert!((of("k_tc") - 900.0).abs() < 0.5 && (of("k_te") - 20.0).abs() < 0.05, "{:?}", found.coefficients());
}

/// A log made from the prediction of a material that is a quarter harder than the setup says: the coefficient comes back.
#[test]
fn a_harder_material_is_learned_from_a_log() {
    let dir = tempfile::tempdir().unwrap();
    let [program, toml, log] = ["part.nc", "part.setup.toml", "log.csv"].map(|name| dir.path().join(name));
    fs::write(&program, PROGRAM).unwrap();
    fs::write(&toml, setup_with(800.0)).unwrap();
    let truth = setup(&setup_with(1000.0));
    let table = simulate(&parse(PROGRAM, Some(&truth)).unwrap(), &truth).unwrap().csv();
    fs::write(&log, as_log(&table)).unwrap();
    let learned = learn_example::from_log(Path::new(&program), Path::new(&toml), Path::new(&log)).unwrap();
    let k_tc = learned.coefficients().into_iter().find(|one| one.name == "k_tc").unwrap().value;
    assert!((k_tc - 1000.0).abs() < 20.0, "{k_tc}: {}", learned.summary());
}

/// The stations of a report, twenty samples a second, as a power meter and a control would write them.
fn as_log(table: &str) -> String {
    let mut lines = table.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    let names = ["time_before_s", "x_mm", "y_mm", "z_mm", "spindle_rpm", "power_w_before"];
    let at = names.map(|name| head.iter().position(|own| *own == name).unwrap());
    let rows: Vec<[f64; 6]> = lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            at.map(|k| cells[k].parse().unwrap_or(f64::NAN))
        })
        .filter(|row| row.iter().all(|value| value.is_finite()))
        .collect();
    let mut text = "time_s,x_mm,y_mm,z_mm,spindle_rpm,spindle_power_w\n".to_owned();
    let end_s = rows.last().unwrap()[0];
    for sample in 0..(end_s / 0.05) as usize {
        let time_s = rows[0][0] + 0.05 * sample as f64;
        let Some(next) = rows.iter().position(|row| row[0] > time_s) else { break };
        let (from, to) = (rows[next - 1], rows[next]);
        let share = (time_s - from[0]) / (to[0] - from[0]);
        let place = [1, 2, 3].map(|k| from[k] + share * (to[k] - from[k]));
        text += &format!("{time_s:.3},{:.4},{:.4},{:.4},{},{:.3}\n", place[0], place[1], place[2], from[4], from[5]);
    }
    text
}

/// A folder with the program and its setup, and the program `feedwright` in the PATH of what is run there.
struct Shop {
    dir: tempfile::TempDir,
    path: std::ffi::OsString,
}

impl Shop {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("part.nc"), PROGRAM).unwrap();
        fs::write(dir.path().join("part.setup.toml"), setup_with(800.0)).unwrap();
        let binary = Path::new(env!("CARGO_BIN_EXE_feedwright")).parent().unwrap().to_owned();
        let others = std::env::var_os("PATH").unwrap_or_default();
        let path = std::env::join_paths(std::iter::once(binary).chain(std::env::split_paths(&others))).unwrap();
        Self { dir, path }
    }

    fn run(&self, program: &str, arguments: &[&str]) -> std::process::Output {
        let mut command = std::process::Command::new(program);
        command.args(arguments).current_dir(&self.dir).env("PATH", &self.path).output().unwrap()
    }

    fn text(&self, name: &str) -> String {
        fs::read_to_string(self.dir.path().join(name)).unwrap()
    }
}

fn example(name: &str) -> String {
    format!("{}/examples/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// What LinuxCNC does when a program with the ending of the filter is opened: the program on standard output, progress beside it.
#[cfg(unix)]
#[test]
fn the_filter_of_linuxcnc_gives_the_program_and_its_progress() {
    let shop = Shop::new();
    let filter = example("linuxcnc/feedwright-filter");
    let ini = fs::read_to_string(example("linuxcnc/feedwright.ini")).unwrap();
    assert!(ini.contains("[FILTER]") && ini.lines().any(|line| line == "fwnc = feedwright-filter"), "{ini}");
    fs::copy(shop.dir.path().join("part.nc"), shop.dir.path().join("part.fwnc")).unwrap();
    let done = shop.run(&filter, &["part.fwnc"]);
    let said = String::from_utf8(done.stderr).unwrap();
    assert_eq!(done.status.code(), Some(0), "{said}");
    let mut command = Command::cargo_bin("feedwright").unwrap();
    command.current_dir(&shop.dir).args(["optimize", "part.nc", "--quiet"]).assert().code(0);
    assert_eq!(String::from_utf8(done.stdout).unwrap(), shop.text("part.fw.nc"));
    let percent: Vec<u32> =
        said.lines().filter_map(|line| line.strip_prefix("FILTER_PROGRESS=")).map(|n| n.parse().unwrap()).collect();
    assert!(percent.len() >= 2 && percent.is_sorted() && percent.last() == Some(&100), "{said}");
    // What cannot be read says why and gives nothing.
    fs::write(shop.dir.path().join("other.fwnc"), "T7 M6\nS1000 M3\nG1 X1 F10\nM30\n").unwrap();
    let done = shop.run(&filter, &["other.fwnc"]);
    assert!(done.status.code() == Some(2) && done.stdout.is_empty() && !done.stderr.is_empty());
}

/// The real interpreter runs what the filter gives: the same motions, other feeds.
#[test]
#[cfg_attr(absent_rs274, ignore = "rs274 is not there")]
fn linuxcnc_reads_what_its_filter_gives() {
    let shop = Shop::new();
    let given = shop.run(&example("linuxcnc/feedwright-filter"), &["part.nc"]).stdout;
    fs::write(shop.dir.path().join("given.ngc"), given).unwrap();
    fs::write(shop.dir.path().join("t.tbl"), "T1 P1 D6.0 Z0\n").unwrap();
    let canon = |name: &str| {
        let done = shop.run("rs274", &["-g", "-n", "2", "-t", "t.tbl", "-v", "rs.var", name]);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        String::from_utf8(done.stdout).unwrap()
    };
    let ends = |text: &str| -> Vec<String> {
        let feeds = text.lines().filter(|line| line.contains("STRAIGHT_"));
        feeds.map(|line| line.split_once("STRAIGHT_").unwrap().1.to_owned()).collect()
    };
    let [before, after] = ["part.nc", "given.ngc"].map(canon);
    let [old, new] = [ends(&before), ends(&after)];
    assert!(old.len() > 6 && old.iter().all(|end| new.contains(end)), "{old:?} {new:?}");
    assert_ne!(before.matches("SET_FEED_RATE").count(), after.matches("SET_FEED_RATE").count());
}

/// The step for FreeCAD, with a post and tool controllers as FreeCAD has them.
#[test]
fn the_step_for_freecad_runs_in_plain_python() {
    let shop = Shop::new();
    assert!(shop.run("python3", &["--version"]).status.success(), "python3 is not there");
    let post = format!(
        "PROGRAM = {PROGRAM:?}\ndef export(objects, filename, arguments):\n    assert filename == '-'\n    open('asked', 'w').write(arguments)\n    return PROGRAM\n"
    );
    fs::write(shop.dir.path().join("plain_post.py"), post).unwrap();
    let code = "
import sys; from types import SimpleNamespace as T
sys.path[:0] = [sys.argv[1], '.']
import feedwright_post as step
bit = T(ShapeName='endmill', Diameter=T(Value=6.0), Flutes=3)
text = step.export([T(Label='job'), T(ToolNumber=1, Tool=bit)], 'job.nc', '--post=plain --setup=part.setup.toml --precision=4')
open('returned', 'w', newline='').write(text)
try: step.export([], 'bad.nc', '--post=plain --setup=none.toml --precision=4'); print('NO ERROR')
except RuntimeError as error: print('ERROR', error)
";
    let done = shop.run("python3", &["-c", code, &example("freecad")]);
    let (shown, said) = (String::from_utf8(done.stdout).unwrap(), String::from_utf8(done.stderr).unwrap());
    assert!(done.status.success(), "{said}");
    assert!(shown.contains("ERROR Feedwright wrote no program; bad.nc has the feeds of the job"), "{shown}");
    assert!(
        shop.text("job.nc").starts_with("%\n(T1 6 MM FLAT END MILL, 3 FLUTES)\nG21 G90\n"),
        "{}",
        shop.text("job.nc")
    );
    assert_eq!(shop.text("returned"), shop.text("job.fw.nc"));
    assert!(shop.text("job.fw.nc").contains("(FW ") && shop.text("asked").contains("--precision=4"));
    // Its comments are read.
    let done = shop.run(env!("CARGO_BIN_EXE_feedwright"), &["init", "job.nc", "-o", "drafted.toml"]);
    assert!(done.status.code().is_some_and(|code| code < 3));
    let drafted = shop.text("drafted.toml");
    assert!(drafted.contains("diameter = 6") && drafted.contains("flutes = 3"), "{drafted}");
}

/// The lines for a post of Fusion, with the functions of the post kernel as stand-ins.
#[test]
#[cfg_attr(absent_browser, ignore = "node is not there")]
fn the_lines_for_a_post_of_fusion_run() {
    let shop = Shop::new();
    let code = "
const { readFileSync, writeFileSync } = require('fs'); const { execSync } = require('child_process'); const vm = require('vm');
const header = [], said = [];
const tool = { number: 1, diameter: 6, cornerRadius: 0, numberOfFlutes: 3, type: 'flat end mill' };
const kernel = {
  getWorkpiece: () => ({ lower: { x: 0, y: 0, z: -10 }, upper: { x: 40, y: 20, z: 0.00001 } }),
  getToolTable: () => ({ getNumberOfTools: () => 1, getTool: () => tool }), getToolTypeName: (type) => type,
  writeComment: (text) => header.push(`(${text})`), warning: (text) => said.push(text),
  getOutputPath: () => 'job.nc', FileSystem: { getFolderPath: () => '.' },
  execute: (path, line, hide, folder) => { try { execSync(`${path} ${line}`, { cwd: folder, stdio: 'pipe' }); return 0; } catch (e) { return e.status; } },
};
vm.createContext(kernel); vm.runInContext(readFileSync(process.argv[1], 'utf8'), kernel);
kernel.feedwrightHeader();
writeFileSync('job.nc', readFileSync('part.nc', 'utf8').replace('%\\n', '%\\n' + header.join('\\n') + '\\n'));
kernel.onTerminate(); console.log(JSON.stringify(said));
";
    // Without material and limits it says what is missing; with the setup beside it the program is written.
    let run =
        || String::from_utf8(shop.run("node", &["-e", code, &example("fusion/feedwright.cps.js")]).stdout).unwrap();
    assert!(run().contains("feedwright init job.nc"));
    fs::copy(shop.dir.path().join("part.setup.toml"), shop.dir.path().join("job.setup.toml")).unwrap();
    assert_eq!(run().trim(), "[]");
    let written = shop.text("job.fw.nc");
    assert!(written.contains("(STOCK X0 Y0 Z-10 X40 Y20 Z0)\n(T1 D=6 CR=0 - 3 FLUTES FLAT END MILL)\n"), "{written}");
    let done = shop.run(env!("CARGO_BIN_EXE_feedwright"), &["init", "job.nc", "-o", "drafted.toml"]);
    assert!(done.status.code().is_some_and(|code| code < 3));
    let drafted = shop.text("drafted.toml");
    assert!(drafted.contains("min = [0, 0, -10], max = [40, 20, 0]") && drafted.contains("flutes = 3"), "{drafted}");
}
