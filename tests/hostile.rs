//! Input that nobody would write, through the whole binary: programs of every dialect, setups, logs, tables, meshes, models, caches and
//! saved stock, mutated by a seeded generator. No panic, no abort, no run of a few kB beyond twenty seconds or a gigabyte, no NaN or
//! infinity in a report, nothing left behind, no raw control character on the screen. Some two hundred in the ordinary run,
//! `FEEDWRIGHT_LONG=N` for N of them; `FEEDWRIGHT_SEED` for others, `FEEDWRIGHT_KEEP=DIR` keeps what fails.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod common {
    pub mod draw;
    pub mod follow;
    pub mod mesh;
}

use assert_cmd::cargo::cargo_bin;
use common::draw::Draw;
use common::follow::{SETUP as LOGGED, job, power_log};
use feedwright::learn::calibrate::plan::{Kind, plan};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Cases of the ordinary run.
const ORDINARY: usize = 200;
/// Memory of a process, kB of address space (its threads' stacks and the binary included), its processor time, s, and how long it is
/// waited for, s: what hangs without working uses no processor time, and what works beside others is not to be taken for that.
const MOST_KB: usize = 1_500_000;
const MOST_S: usize = 20;
const WAIT_S: usize = 1800;

const SETUP: &str = r#"units = "mm"
resolution = 1.0
[machine]
rapid = 15000
corner_tolerance = 0.02
block_time = 0.002
[machine.axes]
x = { velocity = 15000, acceleration = 1500, jerk = 20000 }
[machine.spindle]
max_rpm = 12000
power = [[0, 0], [1500, 7500], [12000, 7500]]
tare = [[1000, 120], [12000, 480]]
efficiency = 0.92
[stock]
box = { min = [0, 0, -20], max = [60, 40, 0] }
uncertainty = 0.5
[material]
k_tc = 842
k_rc = 300
k_ac = 150
k_te = 15
[[fixture]]
box = { min = [-20, -20, -20], max = [-10, 60, -5] }
[[tool]]
number = 1
shape = "flat"
diameter = 10
flutes = 4
helix = 30
flute_length = 22
overhang = 35
runout = { offset = 0.006, angle = 95 }
holder = [[32, 40], [50, 30]]
[[tool]]
number = 4
shape = "ball"
diameter = 6
flutes = 2
[limits]
force_xy = 300
power = 2500
deflection = 0.03
chip_thickness = { min = 0.01, max = 0.15 }
feed_change = { min = 0.2, max = 1.3 }
[raise]
entries = true
[[operation]]
match = { tool = 4 }
mode = "slow-only"
[output]
minimum_length = 0.5
"#;

const MODEL: &str = "[process.base]\nk_tc = 900\nk_rc = 300\nk_ac = 150\nk_te = 14\nk_re = 12\nk_ae = 2\n";
const TABLE: &str = "group,order,tool,feed_mm_min,spindle_rpm,axial_depth_mm,radial_depth_mm,side,spindle_power_w\n\
    a,1,1,300,6000,2,4,down,420\na,2,1,600,6000,2,4,down,530\na,3,1,900,6000,2,4,down,650\nb,4,1,300,6000,4,4,down,520\n\
    b,5,1,600,6000,4,4,down,760\nb,6,1,900,6000,4,2,down,640\nb,7,1,400,6000,1,10,slot,480\n";
const SHDR: &str = "2026-01-01T00:00:00.0Z|Block_Number|4\n2026-01-01T00:00:01.0Z|Xact|1.5|Srpm|3000\n\
    2026-01-01T00:00:02.0Z|Xact|9.5|Sload|30\n2026-01-01T00:00:03.5Z|Fact|600|Block_Number|6\n";

/// What is mutated, and where it goes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Class {
    Program,
    Setup,
    Model,
    Log,
    Table,
    Mesh,
    Cache,
    Stock,
}

const CLASSES: [Class; 14] = [
    Class::Program,
    Class::Program,
    Class::Program,
    Class::Program,
    Class::Program,
    Class::Setup,
    Class::Setup,
    Class::Setup,
    Class::Model,
    Class::Log,
    Class::Table,
    Class::Mesh,
    Class::Cache,
    Class::Stock,
];

/// Good inputs to begin from.
struct Good {
    programs: Vec<(&'static str, String)>,
    logged: String,
    log: String,
    mesh: [Vec<u8>; 2],
    cache: Vec<u8>,
    stock: Vec<u8>,
}

/// A program with what dialects of the ISO kind share.
fn iso(head: &str, tail: &str) -> String {
    format!(
        "{head}G21 G90 G17 G94\nT1 M6\nS3000 M3\nG0 X-10. Y10. Z5.\nG1 Z-2. F200.\nX30. F600. (ROUGH)\nM8\nG3 X40. Y20. I0. J10.\n\
         G1 X65.5\nG0 Z5.\nG98 G81 X10. Y30. Z-4. R2. F120.\nX20.\nG80\nG4 P500\nT4 M6\nG0 X1.3 Y1.9\nG1 Z0. F40.\nG41 D1 X8.\nY9.\nG40\n\
         G91 G1 X5. Y-2. Z-.5 F300.\nG90\nG0 Z50.\n{tail}"
    )
}

fn programs() -> Vec<(&'static str, String)> {
    let subs =
        "M98 P2000\nM30\nO2000\nG1 X5. F100.\n#1=5.\nWHILE [#1 GT 0] DO1\n#1=#1-1.\nG1 X[#1*2.] F300.\nEND1\nM99\n";
    let linuxcnc = "#<a> = 3\no100 while [#<a> gt 0]\nG1 X[10+#<a>] F250\n#<a> = [#<a>-1]\no100 endwhile\nG2 X20 Y5 R12 F200\nM2\n";
    let siemens = "G71 G90 G17 G94\nT1\nM6\nS3000 M3\nG0 X-10 Y10 Z5\nG1 Z-2 F200\nX30 F600\nG3 X40 Y20 CR=10\nR1=5\nG1 X=R1+40\n\
                   CYCLE81(5,0,2,-4)\nG4 F2\nG1 X1 Y-9.5 ; home\nG0 Z50\nM30\n";
    let heidenhain = "0 BEGIN PGM PART MM\n1 BLK FORM 0.1 Z X+0 Y+0 Z-20\n2 BLK FORM 0.2 X+60 Y+40 Z+0\n3 TOOL CALL 1 Z S3000\n\
                      4 L X-10 Y+10 Z+5 R0 FMAX M3\n5 L Z-2 F200\n6 L X+30 F600\n7 CC X+30 Y+20\n8 C X+40 Y+20 DR+\n9 LBL 1\n10 L IX+2 F300\n\
                      11 CALL LBL 1 REP3\n12 Q1 = 5\n13 L X+Q1\n14 L Z+50 FMAX M30\n15 END PGM PART MM\n";
    vec![
        ("linuxcnc", iso("", linuxcnc)),
        ("fanuc", iso("%\nO1000\n", subs)),
        ("haas", iso("%\nO01000\n", subs)),
        (
            "grbl",
            iso("", "M30\n")
                .replace("T1 M6\n", "")
                .replace("T4 M6\n", "")
                .replace("G98 G81 X10. Y30. Z-4. R2. F120.\nX20.\n", ""),
        ),
        ("generic", iso("", "M30\n")),
        ("siemens", siemens.to_owned()),
        ("heidenhain", heidenhain.to_owned()),
    ]
}

const NUMBERS: [&str; 24] = [
    "0",
    "-0",
    "1e308",
    "-1e308",
    "1e-308",
    "1000000000",
    "-1000000000",
    "99999",
    "-99999",
    "1e5",
    "NaN",
    "inf",
    "-inf",
    "1e400",
    "0.0000001",
    "-1",
    "4294967296",
    "18446744073709551616",
    "1.7976931348623157e308",
    "65536",
    "360",
    "1e15",
    "",
    "1e20",
];
const WORDS: [&str; 36] = [
    "\x1b[31m",
    "\0",
    "\r",
    "\n",
    "\r\n",
    "\u{feff}",
    "%",
    "(",
    ")",
    "\"",
    ";",
    "/",
    "[",
    "]",
    "{",
    "}",
    "=cmd|' /C calc'!A0",
    "<script>alert(1)</script>",
    "</script>",
    "&amp;",
    "F0",
    "F-5",
    "G91",
    "G20",
    "G93",
    "G95",
    "M98 P2000",
    "M99",
    "GOTO 1",
    "#1=#1+1",
    "G2 I1e9",
    "T99999 M6",
    "S0",
    "S1e9 M3",
    "é\u{202e}",
    "X1000000000",
];

/// One to four changes: a number for another, a word put in, bytes gone, doubled, flipped, a line moved.
fn mutated(bytes: &[u8], draw: &mut Draw) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=draw.below(4) {
        let at = draw.below(bytes.len());
        let end = (at + 1 + draw.below(24)).min(bytes.len());
        match draw.below(8) {
            0..=2 => {
                let Some(from) = (at..bytes.len()).find(|k| bytes[*k].is_ascii_digit()) else { continue };
                let digits = bytes[from..].iter().take_while(|byte| byte.is_ascii_digit() || **byte == b'.').count();
                bytes.splice(from..from + digits, draw.of(&NUMBERS).bytes());
            }
            3 => drop(bytes.splice(at..at, draw.of(&WORDS).bytes())),
            4 => drop(bytes.drain(at..end)),
            5 => {
                let part = bytes[at..end].to_vec();
                drop(bytes.splice(at..at, part));
            }
            6 if !bytes.is_empty() => bytes[at] ^= 1 << draw.below(8),
            _ => {
                let mut lines: Vec<Vec<u8>> =
                    bytes.split_inclusive(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect();
                let (from, to) = (draw.below(lines.len()), draw.below(lines.len()));
                if !lines.is_empty() {
                    lines.swap(from, to);
                }
                bytes = lines.concat();
            }
        }
    }
    bytes
}

impl Good {
    fn new() -> Self {
        let logged = plan(Kind::Power, &job()).unwrap().program;
        // A short log: the tests of `learn` have the long ones.
        let log = power_log(&logged, 25);
        let text = common::mesh::box_as_stl([[0.0, 60.0], [0.0, 40.0], [-20.0, 0.0]]);
        let dir = tempfile::tempdir().unwrap();
        let programs = programs();
        fs::write(dir.path().join("in.nc"), &programs[0].1).unwrap();
        fs::write(dir.path().join("s.toml"), SETUP).unwrap();
        let output = Command::new(cargo_bin("feedwright"))
            .current_dir(dir.path())
            .args(["simulate", "in.nc", "--setup", "s.toml", "--cache", "--save-stock", "left.stock"])
            .output()
            .unwrap();
        assert!(output.status.code() < Some(2), "{}", String::from_utf8_lossy(&output.stderr));
        let read = |name: &str| fs::read(dir.path().join(name)).unwrap();
        let (cache, stock) = (read("in.fwcache"), read("left.stock"));
        Self { programs, logged, log, mesh: [binary(&text), text.into_bytes()], cache, stock }
    }
}

/// The triangles of an ASCII mesh as binary STL.
fn binary(text: &str) -> Vec<u8> {
    let numbers = |line: &str| -> Vec<f32> { line.split_whitespace().filter_map(|word| word.parse().ok()).collect() };
    let corners: Vec<Vec<f32>> = text.lines().filter(|line| line.contains("vertex")).map(numbers).collect();
    let mut out = vec![b' '; 80];
    out.extend(((corners.len() / 3) as u32).to_le_bytes());
    for triangle in corners.chunks(3) {
        out.extend([0u8; 12]);
        triangle.iter().flatten().for_each(|value| out.extend(value.to_le_bytes()));
        out.extend([0u8; 2]);
    }
    out
}

/// A case: the files of a folder and the words of a command.
struct Case {
    class: Class,
    files: Vec<(String, Vec<u8>)>,
    arguments: Vec<String>,
}

fn case(good: &Good, number: usize, draw: &mut Draw) -> Case {
    let class = CLASSES[number % CLASSES.len()];
    let (dialect, program) = &good.programs[draw.below(good.programs.len())];
    let logs = matches!(class, Class::Log | Class::Table);
    let mut program = if logs { good.logged.clone().into_bytes() } else { program.clone().into_bytes() };
    let mut setup = if logs { LOGGED.to_owned() } else { SETUP.to_owned() }.into_bytes();
    let mut files = Vec::new();
    let mut arguments: Vec<&str> = Vec::new();
    let optimize = [
        "optimize",
        "in.nc",
        "--setup",
        "s.toml",
        "-o",
        "out.nc",
        "--json",
        "r.json",
        "--csv",
        "r.csv",
        "--report",
        "r.html",
        "--svg",
        "r.svg",
        "--accept-infeasible",
        "--accept-collisions",
    ];
    if !logs {
        arguments.extend(optimize);
        arguments.extend(["--dialect", dialect]);
    }
    match class {
        Class::Program => program = mutated(&program, draw),
        Class::Setup => setup = mutated(&setup, draw),
        Class::Model => {
            files.push(("m.toml", mutated(MODEL.as_bytes(), draw)));
            arguments.extend(["--model", "m.toml"]);
        }
        Class::Mesh => {
            let place = b"box = { min = [0, 0, -20], max = [60, 40, 0] }";
            let text =
                String::from_utf8(setup).unwrap().replace(std::str::from_utf8(place).unwrap(), "stl = \"b.stl\"");
            setup = text.into_bytes();
            files.push(("b.stl", mutated(&good.mesh[draw.below(2)], draw)));
        }
        Class::Cache => {
            files.push(("in.fwcache", mutated(&good.cache, draw)));
            arguments.push("--cache");
        }
        Class::Stock => {
            let text = String::from_utf8(setup).unwrap();
            let text = text.replace("box = { min = [0, 0, -20], max = [60, 40, 0] }", "saved = \"left.stock\"");
            setup = text.into_bytes();
            files.push(("left.stock", mutated(&good.stock, draw)));
        }
        Class::Log => {
            let text = if draw.below(4) == 0 { SHDR.as_bytes() } else { good.log.as_bytes() };
            files.push(("log.csv", mutated(text, draw)));
            arguments.extend(draw.of(&[
                &[
                    "learn", "in.nc", "--setup", "s.toml", "--log", "log.csv", "-o", "o.toml", "--json", "r.json",
                    "--report", "r.html",
                ][..],
                &["log", "log.csv", "--json", "r.json"],
                &["calibrate", "in.nc", "--setup", "s.toml", "--log", "log.csv", "-o", "o.toml", "--json", "r.json"],
            ]));
        }
        Class::Table => {
            files.push(("t.csv", mutated(TABLE.as_bytes(), draw)));
            arguments.extend(draw.of(&[
                &["learn-table", "t.csv", "--setup", "s.toml", "-o", "o.toml", "--json", "r.json"][..],
                &["calibrate", "t.csv", "--setup", "s.toml", "-o", "o.toml", "--json", "r.json"],
            ]));
        }
    }
    if class == Class::Setup && draw.below(2) == 0 {
        arguments.extend(["--stress", "--confidence", "0.9"]);
    }
    if class == Class::Program && draw.below(4) == 0 {
        arguments.push("--expand");
    }
    arguments.extend(["--threads", "1"]);
    files.extend([("in.nc", program), ("s.toml", setup)]);
    let files = files.into_iter().map(|(name, bytes)| (name.to_owned(), bytes)).collect();
    Case { class, files, arguments: arguments.into_iter().map(str::to_owned).collect() }
}

fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(Result::unwrap);
    entries.map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap())).collect()
}

/// The command in a folder, bounded in memory and time.
fn bounded(folder: &Path, arguments: &[String]) -> Output {
    let script = format!("ulimit -c 0; ulimit -v {MOST_KB}; ulimit -t {MOST_S}; exec timeout {WAIT_S} \"$@\"");
    let mut command = Command::new("bash");
    command
        .current_dir(folder)
        .args(["-c", &script, "bash"])
        .arg(cargo_bin("feedwright"))
        .args(arguments)
        .output()
        .unwrap()
}

/// What is wrong with how a case went; `None`: nothing.
fn fault(case: &Case) -> Option<String> {
    let dir = tempfile::tempdir().unwrap();
    for (name, bytes) in &case.files {
        fs::write(dir.path().join(name), bytes).unwrap();
    }
    let before = contents(dir.path());
    let output = bounded(dir.path(), &case.arguments);
    let after = contents(dir.path());
    let said = String::from_utf8_lossy(&output.stderr);
    let short = || said.chars().filter(|c| !c.is_control()).take(300).collect::<String>();
    match output.status.code() {
        Some(0 | 1) => {}
        Some(2) if after == before => {}
        Some(2) => return Some("exit 2 left something".into()),
        Some(124) => return Some(format!("more than {WAIT_S} s of waiting")),
        Some(137 | 152) | None => return Some(format!("killed: more than {MOST_S} s, or an abort: {}", short())),
        code => return Some(format!("ended with {code:?}: {}", short())),
    }
    if said.contains("panicked") {
        return Some(short());
    }
    let raw = |text: &[u8]| text.iter().any(|byte| matches!(byte, 0..=8 | 11..=12 | 14..=31 | 127));
    if raw(&output.stdout) || raw(&output.stderr) {
        return Some("a raw control character on the screen".into());
    }
    let litter = after.keys().find(|name| name.starts_with('.'));
    if let Some(name) = litter {
        return Some(format!("{name} was left"));
    }
    if before.iter().any(|(name, bytes)| name != "in.fwcache" && after.get(name) != Some(bytes)) {
        return Some("an input changed".into());
    }
    let new = after.iter().filter(|(name, _)| !before.contains_key(*name));
    { new }.find_map(|(name, bytes)| odd_number(name, bytes, &before))
}

/// NaN or infinity in a report. A page shows the program's own text: there a word that an input holds itself says nothing.
fn odd_number(name: &str, bytes: &[u8], inputs: &BTreeMap<String, Vec<u8>>) -> Option<String> {
    let text = String::from_utf8_lossy(bytes);
    let odd =
        |cell: &str| matches!(cell.trim_matches(['"', ' ', '-', '+']), "NaN" | "nan" | "inf" | "infinity" | "Infinity");
    let ending = name.rsplit('.').next().unwrap_or_default();
    if ending == "csv" {
        let cell = text.lines().find(|line| line.split([',', ';']).any(odd));
        return cell.map(|line| format!("{name}: {line}"));
    }
    if ending == "json"
        && let Err(error) = serde_json::from_slice::<serde_json::Value>(bytes)
    {
        return Some(format!("{name}: {error}"));
    }
    if ["html", "svg"].contains(&ending) {
        let own = |odd: &str| {
            inputs.values().any(|input| input.windows(odd.len()).any(|part| part.eq_ignore_ascii_case(odd.as_bytes())))
        };
        let numbers = ["NaN", ">inf<", ">-inf<", "=\"inf", " inf "];
        let odd =
            numbers.into_iter().find(|odd| text.contains(odd) && !own(odd.trim_matches(['>', '<', '"', '=', ' '])));
        let odd = odd.or_else(|| text.contains("<script>alert").then_some("<script>alert"));
        return odd.map(|odd| format!("{name} holds {odd}"));
    }
    None
}

#[test]
fn mutated_input_of_every_kind_is_refused_or_worked() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<usize>().ok());
    let count = number("FEEDWRIGHT_LONG").unwrap_or(ORDINARY);
    let seed = number("FEEDWRIGHT_SEED").unwrap_or(26) as u64;
    let good = Good::new();
    let next = AtomicUsize::new(0);
    let faults: Mutex<Vec<String>> = Mutex::default();
    let work = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= count {
                return;
            }
            let mut draw = Draw(seed.wrapping_mul(1_000_003).wrapping_add(number as u64));
            draw.below(2);
            let case = case(&good, number, &mut draw);
            let Some(fault) = fault(&case) else { continue };
            let fault = format!("{number} {:?} `{}`: {fault}", case.class, case.arguments.join(" "));
            println!("{fault}");
            if let Some(folder) = std::env::var_os("FEEDWRIGHT_KEEP") {
                let folder = Path::new(&folder).join(format!("{seed}-{number}"));
                fs::create_dir_all(&folder).unwrap();
                case.files.iter().for_each(|(name, bytes)| fs::write(folder.join(name), bytes).unwrap());
                fs::write(folder.join("why"), &fault).unwrap();
            }
            faults.lock().unwrap().push(fault);
        }
    };
    std::thread::scope(|scope| {
        let workers = std::thread::available_parallelism().map_or(1, usize::from).min(8);
        (0..workers).for_each(|_| drop(scope.spawn(work)));
    });
    let faults = faults.into_inner().unwrap();
    println!("{count} mutated inputs, {} faults", faults.len());
    assert!(faults.is_empty(), "{} of {count}:\n{}", faults.len(), faults.join("\n"));
}

/// A case that is written by hand: a program, a setup, and what `optimize` is told beside its outputs.
fn by_hand(program: &[u8], setup: &str, more: &[&str]) -> Case {
    let outputs = ["-o", "out.nc", "--json", "r.json", "--csv", "r.csv", "--report", "r.html", "--svg", "r.svg"];
    let allowed = ["--accept-infeasible", "--accept-collisions", "--threads", "1"];
    let words = ["optimize", "in.nc", "--setup", "s.toml"].iter().chain(&outputs).chain(&allowed).chain(more);
    let files = vec![("in.nc".to_owned(), program.to_vec()), ("s.toml".to_owned(), setup.as_bytes().to_vec())];
    Case { class: Class::Program, files, arguments: words.map(|word| (*word).to_owned()).collect() }
}

const PLAIN: &str = "G21 G90 G17 G94\nT1 M6\nS3000 M3\nG0 X-10. Y10. Z5.\nG1 Z-2. F200.\nX30. F600.\nG0 Z5.\nM30\n";

/// Runs a case in a folder: exit code, what it says, and the files it wrote.
fn ran(case: &Case) -> (Option<i32>, String, BTreeMap<String, Vec<u8>>) {
    let dir = tempfile::tempdir().unwrap();
    for (name, bytes) in &case.files {
        fs::write(dir.path().join(name), bytes).unwrap();
    }
    let output = bounded(dir.path(), &case.arguments);
    let mut after = contents(dir.path());
    case.files.iter().for_each(|(name, _)| drop(after.remove(name)));
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned(), after)
}

/// Programs that once took memory, time or a number that is none.
#[test]
fn programs_that_were_found_are_refused_or_worked() {
    let far = PLAIN.replace("X30.", "X1000000000");
    let deep = "O1\nM98 P1\nM30\n".to_owned();
    let endless = format!("{PLAIN}GOTO 1\n").replace("G1 Z-2.", "N1 G1 Z-2.").replace("M30\n", "");
    for (what, program, code, words) in [
        ("a coordinate of 1000 km", far, 2, "farther than any mill"),
        ("a feed of nothing", PLAIN.replace("F600.", "F0"), 1, "not positive"),
        ("no feed but nothing", PLAIN.replace("F600.", "F0").replace("F200.", "F0"), 1, "not positive"),
        ("lines that end in CR alone", PLAIN.replace('\n', "\r"), 2, "CR alone"),
        ("a program that calls itself", PLAIN.replace("G0 Z5.", "M98 P7\nG0 Z5.") + "O7\nM98 P7\nM99\n", 1, ""),
        ("nothing but a call of itself", deep, 2, ""),
        ("a jump without an end", endless, 1, ""),
    ] {
        let case = by_hand(program.as_bytes(), SETUP, &["--dialect", "fanuc"]);
        assert_eq!(fault(&case), None, "{what}");
        let (ended, said, _) = ran(&case);
        assert!(said.contains(words), "{what}: {said}");
        assert!(ended.is_some_and(|ended| ended == code || code == 1 && ended == 0), "{what}: {ended:?} {said}");
    }
}

/// An axis is as fast as the rapid where nothing else is said, however slow that is: rounded to whole mm/min it stood still, and every time
/// was none.
#[test]
fn a_rapid_of_less_than_half_a_mm_a_minute_has_its_times() {
    for rapid in ["0.4", "1e-9"] {
        let setup = SETUP.replace("rapid = 15000", &format!("rapid = {rapid}"));
        assert_eq!(fault(&by_hand(PLAIN.as_bytes(), &setup, &["--stress", "--confidence", "0.9"])), None, "{rapid}");
    }
}

/// A mark of UTF-8 at the beginning stays, and what follows it is read as ever; UTF-16 is refused.
#[test]
fn marks_of_an_encoding_are_kept_or_refused() {
    let marked = ["\u{feff}".as_bytes(), PLAIN.as_bytes()].concat();
    let (plain, with_mark) = (by_hand(PLAIN.as_bytes(), SETUP, &[]), by_hand(&marked, SETUP, &[]));
    assert_eq!(fault(&with_mark), None);
    let [(code, _, plain), (same, _, marked)] = [ran(&plain), ran(&with_mark)];
    assert_eq!(code, same);
    // The comment of the file comes behind the first line then.
    let text = |files: &BTreeMap<String, Vec<u8>>| String::from_utf8(files["out.nc"].clone()).unwrap();
    let without = |text: &str| text.lines().filter(|line| !line.contains("FEEDWRIGHT")).collect::<Vec<_>>().join("\n");
    assert_eq!(without(&text(&marked)), format!("\u{feff}{}", without(&text(&plain))));
    assert!(text(&marked).starts_with("\u{feff}G21") && text(&marked).contains("FEEDWRIGHT"));

    let wide: Vec<u8> = std::iter::once(0xFEFF).chain(PLAIN.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let (code, said, files) = ran(&by_hand(&wide, SETUP, &[]));
    assert!(code == Some(2) && said.contains("UTF-16") && files.is_empty(), "{code:?} {said}");
}

/// The rings of a tool were once looked up among the samples of the tool before it. Where that did not end the program, it must not have
/// met anything else either: a tool meets the same behind a drill that never comes near as without it.
#[test]
fn a_tool_is_met_with_its_own_rings_whatever_ran_before() {
    let first = |lines: &str| {
        format!("G21 G90 G17\n{lines}T4 M6\nS3000 M3\nG0 X1.3 Y1.9\nG1 Z0. F40.\nZ-1.\nX30.\nZ-2.\nY20.\nM30\n")
    };
    let drilled = first("T1 M6\nS3000 M3\nG98 G81 X10. Y30. Z-4. R2. F120.\nX55. Y35.\nG80\n");
    // From the same place, as a plunge is met in the direction of the motion before it.
    let alone = first("T1 M6\nS3000 M3\nG0 X55. Y35.\n\n\n");
    for program in [&drilled, &drilled.replace("G1 Z0. F40.\n", "G1 Z0. F40.\nM30\n")] {
        assert_eq!(fault(&by_hand(program.as_bytes(), SETUP, &[])), None, "{program}");
    }
    let rows = |program: &str| -> Vec<String> {
        let (code, said, files) = ran(&by_hand(program.as_bytes(), SETUP, &[]));
        let text =
            String::from_utf8_lossy(files.get("r.csv").unwrap_or_else(|| panic!("{code:?} {said}"))).into_owned();
        let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let column =
            |name: &str| head.iter().position(|cell| *cell == name).unwrap_or_else(|| panic!("{name}: {head:?}"));
        let tool = column("tool");
        let wanted = |row: &&str| row.split(',').nth(tool) == Some("4");
        // But for the count of motions and the time at which it is met.
        let place = column("x_mm");
        let met = |row: &str| row.split(',').skip(place).map(str::to_owned).collect::<Vec<_>>().join(",");
        text.lines().skip(1).filter(|row| wanted(row)).map(met).collect()
    };
    let [with, without] = [rows(&drilled), rows(&alone)];
    assert!(with.len() > 4, "{with:?}");
    assert_eq!(with, without);
}

/// A log with one reading beyond all reason once never ended. All values with `FEEDWRIGHT_LONG`.
#[test]
fn readings_beyond_reason_do_not_keep_learn() {
    let good = Good::new();
    let lines: Vec<&str> = good.log.lines().collect();
    let head: Vec<&str> = lines[0].split(',').collect();
    let values = ["1e308", "-1e308", "1e-308", "NaN", "inf"];
    let long = std::env::var_os("FEEDWRIGHT_LONG").is_some();
    for column in 0..head.len() {
        for value in values.into_iter().take(if long { values.len() } else { 1 }) {
            let mut cells: Vec<&str> = lines[lines.len() / 2].split(',').collect();
            cells[column] = value;
            let row = cells.join(",");
            let mut log = lines.clone();
            log[lines.len() / 2] = &row;
            let files = [("in.nc", good.logged.as_str()), ("s.toml", LOGGED), ("log.csv", &(log.join("\n") + "\n"))];
            let files = files.map(|(name, text)| (name.to_owned(), text.as_bytes().to_vec())).to_vec();
            let words = "learn in.nc --setup s.toml --log log.csv -o o.toml --json r.json --report r.html --threads 1";
            let arguments = words.split(' ').map(str::to_owned).collect();
            let case = Case { class: Class::Log, files, arguments };
            assert_eq!(fault(&case), None, "{value} in {}", head[column]);
        }
    }
}

/// Every number of a setup made an extreme one, under `--stress`. One extreme a number in the ordinary run, all with `FEEDWRIGHT_LONG`.
#[test]
fn extreme_numbers_in_a_setup_are_refused_or_worked() {
    const EXTREMES: [&str; 6] = ["1e308", "1e-308", "0", "-1", "1e9", "1e-9"];
    let digit = |at: usize| SETUP.as_bytes().get(at).is_some_and(|byte| byte.is_ascii_digit() || *byte == b'.');
    let starts = (1..SETUP.len()).filter(|&at| {
        let before = SETUP.as_bytes()[at - 1];
        digit(at) && !digit(at - 1) && !before.is_ascii_alphanumeric() && before != b'_'
    });
    let long = std::env::var_os("FEEDWRIGHT_LONG").is_some();
    let (mut tried, mut faults) = (0, Vec::new());
    for (index, from) in starts.enumerate() {
        let to = (from..SETUP.len()).find(|&at| !digit(at)).unwrap();
        for (k, extreme) in EXTREMES.iter().enumerate() {
            if !long && k != index % EXTREMES.len() {
                continue;
            }
            let setup = format!("{}{extreme}{}", &SETUP[..from], &SETUP[to..]);
            let case = by_hand(PLAIN.as_bytes(), &setup, &["--stress", "--confidence", "0.9"]);
            tried += 1;
            if let Some(fault) = fault(&case) {
                let line = SETUP[..from].lines().count();
                faults.push(format!("line {line}, {:?} → {extreme}: {fault}", &SETUP[from..to]));
            }
        }
    }
    println!("{tried} setups with one extreme number, {} faults", faults.len());
    assert!(tried >= 60 && faults.is_empty(), "{tried}:\n{}", faults.join("\n"));
}

/// Names of files are data: an escape in one does not reach the screen, nor does markup in one reach the page as markup.
#[test]
fn odd_file_names_are_shown_harmlessly() {
    for name in ["red\x1b[31m.nc", "bell\x07.nc", "<script>alert(1)<.nc", "=cmd|' !A0.nc"] {
        let mut case = by_hand(PLAIN.as_bytes(), SETUP, &[]);
        case.files[0].0 = name.to_owned();
        case.arguments[1] = name.to_owned();
        assert_eq!(fault(&case), None, "{name:?}");
        case.arguments[1] = format!("no{name}");
        let (code, said, _) = ran(&case);
        assert!(code == Some(2) && !said.contains(['\x1b', '\x07']), "{name:?}: {code:?} {said:?}");
    }
}
