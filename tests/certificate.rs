//! Certificates: what the checker proves holds. Random coefficients of the ellipsoid, stocks within their uncertainty, places on the path
//! and overrides, with loads worked out by the simulation and the force model that the checker does not use; and certificates that were
//! tampered with, which are refused. 20,000 draws in the ordinary run, `FEEDWRIGHT_LONG=N` for N of them.

#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::format_collect)]

mod common {
    pub mod draw;
}

use assert_cmd::cargo::cargo_bin;
use common::draw::Draw;
use feedwright::certify::ellipsoid::radius;
use feedwright::certify::interval::Interval;
use feedwright::certify::text::sha256;
use feedwright::certify::{Basis, check};
use feedwright::engage::{self, EngagementMap};
use feedwright::force::{Cut, Cutter};
use feedwright::job::{CLOSE_MM, MET};
use feedwright::machine::material::{ForceModel, Process};
use feedwright::machine::{Job, LimitKind, Material, StockShape};
use feedwright::nc::{self, Dialect, Environment, Toolpath};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// A program with its setup; the deviations that its coefficients may have.
struct Case {
    name: &'static str,
    program: String,
    setup: String,
}

const FLAT: &str = "[[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 10\nflutes = 3\nhelix = 30\nflute_length = 22\noverhang = 32\ncentre_cutting = true\n";
const BALL: &str =
    "[[tool]]\nnumber = 1\nshape = \"ball\"\ndiameter = 6\nflutes = 2\nhelix = 30\nflute_length = 12\noverhang = 25\n";
const BULL: &str = "[[tool]]\nnumber = 1\nshape = \"bull\"\ndiameter = 12\ncorner_radius = 2\nflutes = 4\nhelix = 40\nflute_length = 24\noverhang = 40\n";
const STEEL: &str = "[material]\nk_tc = 820\nk_rc = 310\nk_ac = 120\nk_te = 14\nk_re = 11\nk_ae = 2\n";

fn setup(stock: &str, tool: &str, limits: &str, rest: &str) -> String {
    format!(
        "units = \"mm\"\n[machine]\ndialect = \"generic\"\n[stock]\n{stock}\nuncertainty = 0.2\n{STEEL}{rest}\n{tool}[raise]\nplunges = true\nramps = true\nentries = true\nfinishing = true\n\
         [limits]\n{limits}\nfeed_change = {{ min = 0.02, max = 2 }}\n"
    )
}

fn cases() -> Vec<Case> {
    let slots = "G21 G90 G17 G94\nT1 M6\nS6000 M3\nG0 X-12 Y10 Z5\nG1 Z-3 F600\nG1 X60 F900\nG1 Y18\nG1 X-12\nG0 Z5\nG0 X30 Y-10\nG1 Z-2 F400\nG1 Y3\nG2 X36 Y9 I6 J0\nG1 X62\nG0 Z20\nM30\n";
    let down = "G21 G90 G17 G94\nT1 M6\nS5000 M3\nG0 X15 Y15 Z2\nG1 Z-1.5 F120\nG1 X35 Z-3 F500\nG3 X35 Y15 Z-5 I-6 J0 F600\nG1 X15 Y15 F500\nG0 Z20\nM30\n";
    let mut raster = "G21 G90 G17 G94\nT1 M6\nS12000 M3\nG0 X-5 Y0 Z5\nG1 Z-0.4 F800\n".to_owned();
    for pass in 0..6 {
        let (y, dip) = (0.5 * f64::from(pass), 0.6 + 0.1 * f64::from(pass % 3));
        let [from, to] = if pass % 2 == 0 { [-5.0, 20.0] } else { [20.0, -5.0] };
        raster += &format!("G1 Y{y:.3}\n");
        for step in 1..=10 {
            let x: f64 = from + (to - from) * f64::from(step) / 10.0;
            raster += &format!("G1 X{x:.3} Z{:.3} F1200\n", -dip - 0.3 * (x / 4.0).sin());
        }
    }
    raster += "G0 Z20\nM30\n";
    let wide = "box = { min = [0, 0, -10], max = [50, 30, 0] }";
    let measured = "[process]\nbase = { model = \"linear-edge\", k_tc = 900, k_rc = 350, k_ac = 130, k_te = 15, k_re = 12, k_ae = 2 }\ncovariance_of = [\"k_tc\", \"k_te\"]\ncovariance = [[900, -12], [-12, 0.6]]\nscatter = 0.03\n";
    vec![
        Case {
            name: "slots",
            program: slots.to_owned(),
            setup: setup(wide, FLAT, "force_xy = 220", "uncertainty = 0.1"),
        },
        Case {
            name: "downwards",
            program: down.to_owned(),
            setup: setup(
                wide,
                FLAT,
                "force_xy = 300\nforce_axial = 320\ntorque = 1.6\npower = 850",
                "uncertainty = 0.05",
            ),
        },
        Case {
            name: "raster",
            program: raster,
            setup: setup(
                "box = { min = [0, -2, -10], max = [16, 5, 0] }",
                BALL,
                "force_xy = 80\ndeflection = 0.06\nchip_thickness = { max = 0.06 }",
                "uncertainty = 0.15",
            ),
        },
        Case {
            name: "measured",
            program: slots.replace("Z-3", "Z-2.5"),
            setup: setup(wide, BULL, "force_xy = 350\nbending_stress = 60\nfeed_per_tooth = 0.12", measured),
        },
    ]
}

fn feedwright(dir: &Path, arguments: &[&str]) -> Output {
    Command::new(cargo_bin("feedwright")).current_dir(dir).args(arguments).output().unwrap()
}

fn said(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

/// A written program with its certificate.
struct Written {
    job: Job,
    bytes: Vec<u8>,
    toolpath: Toolpath,
    certificate: String,
    setup: String,
    /// What the written program takes, s, and what it takes with `--confidence` alone.
    seconds: [f64; 2],
}

impl Written {
    fn of(case: &Case) -> Self {
        let dir = tempfile::tempdir().unwrap();
        let dir = dir.path();
        fs::write(dir.join("p.nc"), &case.program).unwrap();
        fs::write(dir.join("s.toml"), &case.setup).unwrap();
        let common = ["optimize", "p.nc", "--setup", "s.toml", "--confidence", "0.95", "--force", "--json", "r.json"];
        let seconds = [&["-o", "o.nc", "--certificate", "c.txt"][..], &["-o", "plain.nc"][..]].map(|own| {
            let output = feedwright(dir, &[&common[..], own].concat());
            assert_eq!(output.status.code(), Some(0), "{}: {}", case.name, said(&output));
            let report: serde_json::Value = serde_json::from_slice(&fs::read(dir.join("r.json")).unwrap()).unwrap();
            report["time"]["realised_after_s"].as_f64().unwrap()
        });
        let output = feedwright(dir, &["certify", "o.nc", "--setup", "s.toml", "--certificate", "c.txt"]);
        assert_eq!(output.status.code(), Some(0), "{}: {}", case.name, said(&output));
        let bytes = fs::read(dir.join("o.nc")).unwrap();
        let (job, _) = feedwright::setup::load(&case.setup, dir).unwrap();
        let toolpath = read(&bytes, &job);
        let certificate = fs::read_to_string(dir.join("c.txt")).unwrap();
        Self { job, bytes, toolpath, certificate, setup: case.setup.clone(), seconds }
    }

    fn basis(&self) -> Basis<'_> {
        Basis { bytes: &self.bytes, toolpath: &self.toolpath, job: &self.job, switched: false }
    }
}

fn read(bytes: &[u8], job: &Job) -> Toolpath {
    let program = nc::parse(bytes.to_vec(), Some(Dialect::Generic));
    nc::interpret(&program, &Environment::from_job(job))
}

/// The setup with every piece of stock larger (or smaller) by this.
fn grown(job: &Job, by_mm: f64) -> Job {
    let mut job = job.clone();
    for stock in &mut job.stocks {
        if let StockShape::Box(shape) = &mut stock.shape {
            *shape = shape.grown(by_mm);
        }
    }
    job
}

/// Coefficients of the ellipsoid, drawn from its inside and from its rim: χ² of 1 and 3 directions at 95 % is 3.841 and 7.815.
fn drawn(job: &Job, draw: &mut Draw) -> (Material, Process) {
    let mut material = job.stocks[0].material.clone();
    let mut process = job.process.clone();
    let directions = process.covariance_of.len();
    let depth = if draw.share() < 0.5 { 1.0 } else { draw.share() };
    if directions == 0 {
        let ForceModel::LinearEdge(k) = &mut material.model else { unreachable!() };
        let sense = if draw.share() < 0.7 { 1.0 } else { -1.0 };
        let by = 1.0 + sense * depth * 3.841_f64.sqrt() * material.uncertainty.unwrap();
        for k in [&mut k.k_tc, &mut k.k_rc, &mut k.k_ac, &mut k.k_te, &mut k.k_re, &mut k.k_ae] {
            *k *= by;
        }
        return (material, process);
    }
    // A direction of three: k_tc, k_te by their covariance, and the scatter.
    let mut on_ball: Vec<f64> = (0..3).map(|_| draw.between(-1.0, 1.0)).collect();
    let norm = on_ball.iter().map(|x| x * x).sum::<f64>().sqrt();
    for x in &mut on_ball {
        *x *= depth * 7.815_f64.sqrt() / norm;
    }
    let [[a, b], [_, c]] = [0, 1].map(|i| [0, 1].map(|k| process.covariance[i][k]));
    let lower = [a.sqrt(), b / a.sqrt(), (c - b * b / a).sqrt()];
    let moved = [lower[0] * on_ball[0], lower[1] * on_ball[0] + lower[2] * on_ball[1]];
    let by = 1.0 + process.scatter.unwrap() * on_ball[2];
    let Some(ForceModel::LinearEdge(k)) = &mut process.base else { unreachable!() };
    let [cut, edge] = [(k.k_tc + moved[0]) / k.k_tc * by, (k.k_te + moved[1]) / k.k_te * by];
    for k in [&mut k.k_tc, &mut k.k_rc, &mut k.k_ac] {
        *k *= cut;
    }
    for k in [&mut k.k_te, &mut k.k_re, &mut k.k_ae] {
        *k *= edge;
    }
    (material, process)
}

/// Limits of the setup, its tool's in their place.
fn limits(job: &Job) -> Vec<(LimitKind, f64)> {
    job.limits.overridden_by(&job.tools[0].limits).loads()
}

#[test]
fn no_draw_exceeds_a_limit_that_was_proven() {
    let count: usize = std::env::var("FEEDWRIGHT_LONG").ok().and_then(|text| text.parse().ok()).unwrap_or(20_000);
    let cases = cases();
    let (mut above, mut above_between, mut worst_between) = (Vec::new(), 0, 0.0f64);
    for (number, case) in cases.iter().enumerate() {
        let written = Written::of(case);
        let mut draw = Draw(0x5EED_u64.wrapping_mul(number as u64 + 1));
        let offsets = [0.2, 0.0, -0.2, draw.between(-0.2, 0.2)];
        // The places that the certificate rests on, and others between them.
        let spacings = [CLOSE_MM, 0.37];
        let pairs = offsets.iter().flat_map(|by| spacings.map(|spacing_mm| (by, spacing_mm)));
        let maps: Vec<EngagementMap> = pairs
            .map(|(by, spacing_mm)| {
                let options = engage::Options { spacing_mm, ..engage::Options::default() };
                engage::engage(&written.toolpath, &grown(&written.job, *by), &options, &|_| ()).unwrap()
            })
            .collect();
        let (mut largest, limits) = (0.0f64, limits(&written.job));
        for _ in 0..count / cases.len() {
            let which = (draw.share() * maps.len() as f64) as usize;
            let (map, between) = (&maps[which], which % 2 == 1);
            let (material, process) = drawn(&written.job, &mut draw);
            let factor = if draw.share() < 0.7 { 1.0 } else { draw.share() };
            let cutting: Vec<_> = map.stations.iter().filter(|station| station.arc_count > 0).collect();
            let station = cutting[(draw.share() * cutting.len() as f64) as usize];
            let motion = &written.toolpath.moves[station.move_id.ix()];
            let (tool, spindle) = (&written.job.tools[0], &written.job.machine.spindle);
            let cutter =
                Cutter::new(tool, &material, spindle, &process, map.slices_of(motion.tool), motion.spin.rps).unwrap();
            let tangent_z = motion.curve().tangent(0.5 * (station.from_mm + station.to_mm)).z;
            let cut = Cut { arcs: map.arcs_of(station), tangent_z, ..Cut::default() };
            let loads = cutter.loads(&cut, factor * motion.feed.mm_s);
            for (kind, limit) in &limits {
                let ratio = loads.bounded_by(*kind).unwrap() / limit;
                largest = largest.max(ratio);
                if between {
                    worst_between = worst_between.max(ratio);
                    above_between += usize::from(ratio > 1.0);
                } else if ratio > 1.0 {
                    let place = (motion.line, station.from_mm, station.to_mm);
                    above.push(format!("{}: {} {ratio:.4} of its limit, {place:?}", case.name, kind.name()));
                }
            }
        }
        let [certified, plain] = written.seconds;
        println!(
            "{}: largest drawn load {largest:.4} of its limit; {certified:.2} s, with --confidence alone {plain:.2} s ({:+.1} %)",
            case.name,
            100.0 * (certified / plain - 1.0)
        );
        assert!(largest > 0.7, "{}: no draw came near a limit ({largest})", case.name);
    }
    println!(
        "{count} draws: of the half at the places of the certificate's simulation {} above a limit, of that at places between {above_between}, \
         the largest {worst_between:.4}",
        above.len()
    );
    assert!(worst_between <= MET, "{worst_between} between the places of the simulation");
    assert!(above.is_empty(), "{} of {count}:\n{}", above.len(), above[..above.len().min(20)].join("\n"));
}

/// The text with a seal that fits.
fn sealed(body: &str) -> String {
    format!("{body}sealed {}\n", sha256(body.as_bytes()))
}

/// The lines of a certificate without its seal.
fn body(certificate: &str) -> Vec<String> {
    let lines: Vec<&str> = certificate.lines().collect();
    lines[..lines.len() - 1].iter().map(|line| (*line).to_owned()).collect()
}

fn joined(lines: &[String]) -> String {
    lines.iter().map(|line| format!("{line}\n")).collect()
}

/// Replaces the word of a line.
fn with_word(line: &str, place: usize, change: impl Fn(f64) -> f64) -> String {
    let mut words: Vec<String> = line.split(' ').map(str::to_owned).collect();
    words[place] = format!("{:?}", change(words[place].parse().unwrap()));
    words.join(" ")
}

/// One way to tamper with a certificate, sealed anew as a forger would; `None` where it does not fit this draw.
fn forged(certificate: &str, draw: &mut Draw) -> Option<(&'static str, String)> {
    let mut lines = body(certificate);
    let which: Vec<usize> = {
        let word = draw.of(&["station", "move", "limit", "ellipsoid", "program", "setup", "stock", "confidence"]);
        (0..lines.len()).filter(|k| lines[*k].starts_with(word)).collect()
    };
    let at = which[(draw.share() * which.len() as f64) as usize];
    let line = lines[at].clone();
    let words: Vec<&str> = line.split(' ').collect();
    let by = 1.0 + draw.between(0.001, 0.5);
    let (what, new) = match words[0] {
        "station" if draw.share() < 0.4 => ("station dropped", None),
        "station" if draw.share() < 0.4 => {
            let end = draw.of(&[1, 2]);
            ("station moved", Some(with_word(&line, end, |mm| mm + 0.01 * by)))
        }
        // Depth, torque and chip at their upper ends.
        "station" if words.len() > 11 => {
            let place = draw.of(&[4, 6, 8, 10]);
            if words[place] == "0.0" {
                return None;
            }
            ("enclosure narrowed", Some(with_word(&line, place, |bound| bound / by)))
        }
        "station" => return None,
        "move" if draw.share() < 0.3 => ("move dropped", None),
        "move" => {
            let place = draw.of(&[4, 5]);
            ("feed or speed", Some(with_word(&line, place, |value| if place == 5 { value / by } else { value * by })))
        }
        "limit" => ("limit raised", Some(with_word(&line, 3, |limit| limit * by))),
        "ellipsoid" => ("ellipsoid smaller", Some(with_word(&line, draw.of(&[3, 4, 7, 11]), |value| value / by))),
        "stock" => ("stock surer", Some(with_word(&line, 1, |mm| mm / by))),
        "confidence" => ("confidence", Some(with_word(&line, 1, |share| 1.0 - (1.0 - share) / by))),
        _ => {
            let mut digest = words[1].to_owned();
            let digit = (draw.share() * 64.0) as usize;
            let other = if digest.as_bytes()[digit] == b'0' { "1" } else { "0" };
            digest.replace_range(digit..=digit, other);
            ("hash", Some(format!("{} {digest}", words[0])))
        }
    };
    match new {
        Some(new) => lines[at] = new,
        None => drop(lines.remove(at)),
    }
    Some((what, sealed(&joined(&lines))))
}

#[test]
fn tampered_certificates_are_refused() {
    let cases = cases();
    let written: Vec<Written> = [0, 3].map(|k| Written::of(&cases[k])).into();
    let mut draw = Draw(0xC0DE);
    let (mut tried, mut passed) = (0, Vec::new());
    // Any byte, without a new seal.
    while tried < 250 {
        let of = &written[tried % written.len()];
        let mut bytes = of.certificate.clone().into_bytes();
        let at = (draw.share() * bytes.len() as f64) as usize;
        let new = b"0123456789.-e \n"[(draw.share() * 15.0) as usize];
        if bytes[at] == new {
            continue;
        }
        bytes[at] = new;
        tried += 1;
        if check(&String::from_utf8(bytes).unwrap(), &of.basis()).is_ok() {
            passed.push(format!("byte {at}"));
        }
    }
    // What changes its meaning, with a seal that fits.
    let mut counts = std::collections::BTreeMap::new();
    while tried < 500 {
        let of = &written[tried % written.len()];
        let Some((what, text)) = forged(&of.certificate, &mut draw) else { continue };
        tried += 1;
        *counts.entry(what).or_insert(0) += 1;
        match check(&text, &of.basis()) {
            Ok(_) => passed.push(what.to_owned()),
            Err(refusal) => assert!(!refusal.why.contains("seal"), "{what}: {}", refusal.why),
        }
    }
    println!("{tried} tampered certificates, {} passed; sealed anew: {counts:?}", passed.len());
    assert!(passed.is_empty(), "{passed:?}");
    assert!(counts.len() >= 9, "{counts:?}");
}

/// A feed raised in the program and in its certificate, hash and seal made to fit: the load itself is above its limit.
#[test]
fn a_feed_raised_everywhere_is_refused_with_its_line() {
    let mut written = Written::of(&cases()[0]);
    let text = String::from_utf8(written.bytes.clone()).unwrap();
    let place = text.lines().position(|line| line.contains("force_xy") && line.contains(" F8")).unwrap();
    let feed = text.lines().nth(place).unwrap().split(" F").nth(1).unwrap().split(' ').next().unwrap().to_owned();
    let raised = format!("{}", feed.parse::<f64>().unwrap() + 30.0);
    written.bytes = text.replace(&format!(" F{feed} ("), &format!(" F{raised} (")).into_bytes();
    written.toolpath = read(&written.bytes, &written.job);
    let [old, new] = [feed, raised].map(|feed| format!(" {:?}", feed.parse::<f64>().unwrap() / 60.0));
    let mut lines = body(&written.certificate);
    lines.iter_mut().filter(|line| line.starts_with("move")).for_each(|line| *line = line.replace(&old, &new));
    lines[1] = format!("program {}", sha256(&written.bytes));
    let refusal = check(&sealed(&joined(&lines)), &written.basis()).unwrap_err();
    assert!(refusal.why.starts_with("force_xy may reach"), "{refusal:?}");
    assert_eq!(refusal.line, Some(place as u32 + 1), "{refusal:?}");
    let _ = &written.setup;
}

/// What is not covered is refused by its name, and nothing is written.
#[test]
fn what_is_not_certified_is_named() {
    let case = &cases()[0];
    let kienzle = "model = \"kienzle\"\nk_c11 = 1500\nm_c = 0.25\n";
    let cases = [
        (case.setup.replace("force_xy = 220", "force_xy = 220\nsurface_error = 0.05"), "", "the limit surface_error"),
        (case.setup.replace("force_xy = 220", "force_normal_mean = 100"), "", "the limit force_normal_mean"),
        (case.setup.replace(&STEEL[11..], kienzle), "", "the force model kienzle"),
        (
            case.setup.replace("helix = 30", "helix = 30\nrunout = { offset = 0.01, angle = 0 }"),
            "",
            "a tool with runout",
        ),
        (case.setup.clone(), "/G1 X0 F100\n", "block-delete"),
    ];
    for (setup, line, named) in cases {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("p.nc"), case.program.replace("G0 Z20\n", &format!("{line}G0 Z20\n"))).unwrap();
        fs::write(dir.path().join("s.toml"), setup).unwrap();
        let arguments =
            ["optimize", "p.nc", "--setup", "s.toml", "--confidence", "0.95", "-o", "o.nc", "--certificate", "c.txt"];
        let output = feedwright(dir.path(), &arguments);
        assert_eq!(output.status.code(), Some(1), "{named}: {}", said(&output));
        assert!(said(&output).contains(named), "{named}: {}", said(&output));
        assert!(!dir.path().join("o.nc").exists() && !dir.path().join("c.txt").exists(), "{named}");
    }
}

/// Arcs of a station in the middle of a slot left out, or half of each: the coarse simulation sees it.
#[test]
fn engagement_that_was_left_out_is_seen() {
    let written = Written::of(&cases()[0]);
    let lines = body(&written.certificate);
    let of_slot =
        lines.iter().position(|line| line.starts_with("move") && line.split(' ').nth(2) == Some("6")).unwrap();
    let deep = |line: &String| {
        let words: Vec<&str> = line.split(' ').collect();
        let from: f64 = words.get(1).and_then(|word| word.parse().ok()).unwrap_or(0.0);
        words[0] == "station" && words.len() > 20 && from > 15.0
    };
    let at = of_slot + lines[of_slot..].iter().position(deep).unwrap();
    let words: Vec<String> = lines[at].split(' ').map(str::to_owned).collect();
    let head = words[..11].to_vec();
    let mut halved = words.clone();
    for arc in 0..(words.len() - 11) / 3 {
        let [entry, exit]: [f64; 2] = [12, 13].map(|k| words[k + 3 * arc].parse().unwrap());
        halved[12 + 3 * arc] = format!("{:?}", 0.5 * (entry + exit));
    }
    // The forger widens what would show it.
    for bound in [5, 7, 9] {
        "0.0".clone_into(&mut halved[bound]);
    }
    for other in [head, halved] {
        let mut lines = lines.clone();
        lines[at] = other.join(" ");
        let refusal = check(&sealed(&joined(&lines)), &written.basis()).unwrap_err();
        assert!(refusal.why.starts_with("material stands"), "{refusal:?}");
    }
}

/// A third is between the bounds of 1/3, and so is its product with three around one; nothing is narrower than a rounding.
#[test]
fn bounds_lie_outside() {
    let third = Interval::exact(1.0) / Interval::exact(3.0);
    assert!(third.lo < third.hi && third.hi - third.lo < 1e-15);
    let one = third * Interval::exact(3.0);
    assert!(one.lo < 1.0 && one.hi > 1.0);
    assert!((Interval::exact(1.0) / Interval::of(-1.0, 1.0)).hi.is_infinite());
    assert!(!Interval::of(0.0, 1.0).holds(Interval::exact(f64::NAN)));
}

/// χ² tables: 3.841, 5.991 and 12.592 at 95 % for 1, 2 and 6 degrees of freedom.
#[test]
fn radii_are_those_of_the_tables() {
    for (p, square) in [(1, 3.841), (2, 5.991), (6, 12.592)] {
        let found = radius(0.95, p).unwrap();
        assert!((found * found - square).abs() < 1e-3, "{p}: {found}");
    }
    assert!(radius(1.0, 2).is_err() && radius(0.95, 0) == Ok(0.0));
}

/// What is no covariance is refused: [4, 2.1; 2.1, 1] has a negative eigenvalue.
#[test]
fn what_is_no_covariance_is_refused() {
    let case = &cases()[3];
    for (rows, named) in [("[[900, -24], [-24, 0.6]]", "not positive"), ("[[900, -12]]", "no square table")] {
        let setup = case.setup.replace("[[900, -12], [-12, 0.6]]", rows);
        let (job, _) = feedwright::setup::load(&setup, Path::new(".")).unwrap();
        let refused = feedwright::certify::ellipsoid::Ellipsoid::of(&job, &job.tools[0], 100.0, 0.95).unwrap_err();
        assert!(refused.contains(named), "{refused}");
    }
}
