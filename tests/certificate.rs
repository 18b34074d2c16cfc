//! Certificates that were tampered with, and programs that are not certified: refused. What a certificate proves is held against draws in
//! `certificate_draws.rs`.

#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::format_collect)]

mod common {
    pub mod certified;
    pub mod draw;
}

use common::certified::{STEEL, Written, by_hand, feedwright, read, said};
use common::draw::Draw;
use feedwright::certify::check;
use feedwright::certify::cutter::Part;
use feedwright::certify::ellipsoid::{Ellipsoid, radius};
use feedwright::certify::interval::Interval;
use feedwright::certify::place::{Arc, Place};
use feedwright::certify::text::sha256;
use feedwright::machine::LimitKind;
use std::f64::consts::PI;
use std::fs;
use std::path::Path;

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
    let cases = by_hand();
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
    let mut written = Written::of(&by_hand()[0]);
    let text = String::from_utf8(written.bytes.clone()).unwrap();
    let place = text.lines().position(|line| line.contains("FORCE_XY") && line.contains(" F8")).unwrap();
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
}

/// What is not covered is refused by its name, and nothing is written.
#[test]
fn what_is_not_certified_is_named() {
    let case = &by_hand()[0];
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
        (case.setup.replace("\"generic\"", "\"haas\""), "G13 I10. D1 F500.\n", "what this cuts is not simulated"),
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

/// With the original before the written program only feeds may differ, too.
#[test]
fn the_original_is_compared_where_it_is_given() {
    let case = &by_hand()[0];
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let output = feedwright(dir.path(), arguments);
        (output.status.code(), said(&output))
    };
    fs::write(dir.path().join("p.nc"), &case.program).unwrap();
    fs::write(dir.path().join("p.setup.toml"), &case.setup).unwrap();
    let (code, text) = run(&["optimize", "p.nc", "--confidence", "0.95", "-o", "o.nc", "--certificate", "c.txt"]);
    assert_eq!(code, Some(0), "{text}");
    let (code, text) = run(&["certify", "p.nc", "o.nc", "--certificate", "c.txt"]);
    assert!(code == Some(0) && text.contains("only feeds differ") && text.contains("proven"), "{text}");
    let other = case.program.replacen("G0 Z20", "G0 Z21", 1);
    assert_ne!(other, case.program);
    fs::write(dir.path().join("other.nc"), other).unwrap();
    let (code, text) = run(&["certify", "other.nc", "o.nc", "--setup", "p.setup.toml", "--certificate", "c.txt"]);
    assert!(code == Some(1) && text.contains("more than feeds differ"), "{text}");
}

/// Arcs of a station in the middle of a slot left out, or half of each: the coarse simulation sees it.
#[test]
fn engagement_that_was_left_out_is_seen() {
    let written = Written::of(&by_hand()[0]);
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
    assert!((Interval::exact(1.0) / Interval { lo: -1.0, hi: 1.0 }).hi.is_infinite());
    assert!(!Interval { lo: 0.0, hi: 1.0 }.holds(Interval::exact(f64::NAN)));
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
    let case = &by_hand()[3];
    for (rows, named) in [("[[900, -24], [-24, 0.6]]", "not positive"), ("[[900, -12]]", "no square table")] {
        let setup = case.setup.replace("[[900, -12], [-12, 0.6]]", rows);
        let (job, _) = feedwright::setup::load(&setup, Path::new(".")).unwrap();
        let refused = Ellipsoid::of(&job, &job.tools[0], 100.0, 0.95).unwrap_err();
        assert!(refused.contains(named), "{refused}");
    }
}

/// A helical edge in an arc of 0.05 rad: R Δφ / tan β of its height is engaged at once, however high the rings are. A ring of 0.75 mm that entered as
/// a whole had 1.7 times as much. Rotations are looked at in steps of 0.008 rad, so a bound may be higher by 0.008 / 0.05.
#[test]
fn a_narrow_arc_is_bounded_by_the_height_that_is_engaged_at_once() {
    let (job, _) = feedwright::setup::load(&by_hand()[0].setup, Path::new(".")).unwrap();
    let tool = job.tool(1).unwrap();
    let known = Ellipsoid::of(&job, tool, 100.0, 0.95).unwrap();
    let side = tool.profile.segments.iter().position(|of| of.at(0.5).1[0] > 0.999).unwrap();
    let (width, first, feed) = (0.05, 1.0, 0.05);
    let bound = |rings: usize| {
        let at = |k: usize| 3.0 * k as f64 / rings as f64 / tool.profile.segments[side].length();
        let parts: Vec<Part> = (0..rings).map(|k| Part { segment: side, from: at(k), to: at(k + 1) }).collect();
        let arcs: Vec<Arc> = (0..rings).map(|ring| Arc { ring, entry: first, exit: first + width }).collect();
        let place = Place::new(tool, &parts, &arcs, Interval::exact(0.0)).unwrap();
        place.most(LimitKind::ForceXy, feed, 100.0, 0.0, &known).unwrap()
    };
    let height = 5.0 * width / tool.helix_rad.tan();
    let chip = feed * (first + 0.5 * width).sin();
    // 10 % of every coefficient, at 1.96 standard deviations.
    let force = 1.196 * height * (820.0 * chip + 14.0f64).hypot(310.0 * chip + 11.0);
    for rings in [4, 12, 40] {
        let ratio = bound(rings) / force;
        println!("{rings} rings: {ratio:.4}");
        assert!((1.0..1.0 + 0.008 / width).contains(&ratio), "{rings} rings: {ratio}");
    }
}

/// Straight down, all of the end face cuts: three edges of R mm, each with the chip of the feed per tooth, along the axis. An arc of a turn ends where
/// it begins; an edge that counted twice there had four in place of three.
#[test]
fn an_arc_of_a_turn_has_each_tooth_once() {
    let (job, _) = feedwright::setup::load(&by_hand()[0].setup, Path::new(".")).unwrap();
    let tool = job.tool(1).unwrap();
    let known = Ellipsoid::of(&job, tool, 100.0, 0.95).unwrap();
    let face = tool.profile.segments.iter().position(|of| of.at(0.5).1[1] < -0.999).unwrap();
    let feed = 0.05;
    for rounded in [0.0, 1e-6] {
        let arcs = [Arc { ring: 0, entry: -0.5 * PI - rounded, exit: 1.5 * PI + rounded }];
        let parts = [Part { segment: face, from: 0.0, to: 1.0 }];
        let place = Place::new(tool, &parts, &arcs, Interval::exact(-1.0)).unwrap();
        let bound = place.most(LimitKind::ForceAxial, feed, 100.0, 0.0, &known).unwrap();
        // 10 % of every coefficient, at 1.95996 standard deviations.
        let force = 1.195996 * 3.0 * 5.0 * (310.0 * feed + 11.0);
        assert!((1.0..1.001).contains(&(bound / force)), "{rounded}: {bound} N of {force}");
    }
}
