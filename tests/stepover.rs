//! Passes of varying step-over: against published figures, and from the outside.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

#[path = "../examples/surfaces.rs"]
mod surfaces;

use assert_cmd::Command;
use feedwright::finish::stepover::drop::Dropper;
use feedwright::finish::stepover::reach::{Bounds, ToolOnSurface};
use feedwright::finish::stepover::section::{Beside, Ground, Section};
use feedwright::finish::stepover::shape::Shape;
use feedwright::finish::stepover::surface::Surface;
use feedwright::force::Cutter;
use feedwright::nc::{self, Dialect, Environment, MoveKind};
use feedwright::path::Vec3;
use feedwright::setup;
use feedwright::stock::Mesh;
use std::f64::consts::TAU;
use std::path::Path;

const SETUP: &str = "programs/mould.setup.toml";

/// Nishida, Eq. 1, stock 0.1 mm, 0.05 mm per tooth: the step-over along the slope at which a pass carries 5 N, by the slope from
/// level, mm (figures of the independent sum).
const FIVE_NEWTONS: [(f64, f64); 10] = [
    (5.0, 0.715),
    (10.0, 0.524),
    (15.0, 0.468),
    (20.0, 0.431),
    (30.0, 0.371),
    (40.0, 0.323),
    (50.0, 0.286),
    (60.0, 0.259),
    (70.0, 0.241),
    (75.0, 0.235),
];

#[test]
fn step_overs_for_five_newtons_are_those_of_the_layer_model() {
    let (job, _) = setup::load(&std::fs::read_to_string(SETUP).unwrap(), Path::new("programs")).unwrap();
    let tool = &job.tools[0];
    let rings: Vec<_> = tool.profile.slices(0.005).into_iter().filter(|ring| ring.z_mm < 3.5).collect();
    let material = job.material(tool).unwrap();
    let cutter = Cutter::new(tool, material, &job.machine.spindle, &job.process, &rings, 160.0).unwrap();
    for (slope_deg, expected) in FIVE_NEWTONS {
        let (sin, cos) = f64::to_radians(slope_deg).sin_cos();
        let at = |x: f64, u: f64| Vec3::new(x, u * cos, u * sin);
        let vertices = vec![at(-50.0, -50.0), at(50.0, -50.0), at(50.0, 50.0), at(-50.0, 50.0)];
        let plane = Mesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3]] };
        let surface = Surface::of_mesh(&plane, 1.5, Vec::new());
        let dropper = Dropper::new(&surface, Shape::ball(3.0));
        let on_surface =
            ToolOnSurface { dropper: &dropper, cutter: &cutter, rings: &rings, stock_mm: &|_| 0.1, one_height: false };
        let bounds = Bounds { scallop_mm: 0.1, least_mm: 0.02, largest_mm: 1.0 };
        let (p, ahead, ask) = ([0.0, 0.0], [1.0, 0.0], [16.0, 5.0]);
        let reach = on_surface.reach(p, (ahead, [0.0, 1.0]), &bounds).unwrap();
        let found = on_surface.settled_mm(p, (ahead, [0.0, 1.0]), &reach, ask) / cos;
        println!("{slope_deg} degrees: {found:.4} mm, {expected} mm");
        assert!((found / expected - 1.0).abs() < 0.01, "{slope_deg} degrees: {found} mm instead of {expected}");
    }
}

/// A part of a concave cylinder of 40 mm radius, 12 mm along X, from 10 to 60 degrees.
fn small_cylinder() -> Vec<[[f64; 3]; 3]> {
    part_of_cylinder(60.0)
}

/// The same up to a slope.
fn part_of_cylinder(up_to_deg: f64) -> Vec<[[f64; 3]; 3]> {
    surfaces::sheet([12, (5.0 * (up_to_deg - 10.0)) as usize], |u, v| {
        let slope = (10.0 + (up_to_deg - 10.0) * v).to_radians();
        [12.0 * u, 40.0 * slope.sin(), -40.0 * slope.cos()]
    })
}

fn setup_for(folder: &Path, stock: &str) -> std::path::PathBuf {
    let text = std::fs::read_to_string(SETUP).unwrap();
    let line = text.lines().find(|line| line.starts_with("box = ")).unwrap();
    let path = folder.join("part.setup.toml");
    std::fs::write(&path, text.replace(line, stock)).unwrap();
    path
}

const CYLINDER_STOCK: &str = "box = { min = [0, 6, -45], max = [12, 36, -15] }";

fn stepover(folder: &Path, stl: &[u8], stock: &str, more: &[&str]) -> std::process::Output {
    let (part, setup) = (folder.join("part.stl"), setup_for(folder, stock));
    std::fs::write(&part, stl).unwrap();
    let mut command = Command::cargo_bin("feedwright").unwrap();
    command.arg("stepover").arg("--surface").arg(&part).arg("--setup").arg(&setup).args(more);
    command.output().unwrap()
}

#[test]
fn a_cylinder_is_finished_at_a_constant_force() {
    let folder = tempfile::tempdir().unwrap();
    let (program, json) = (folder.path().join("part.nc"), folder.path().join("r.json"));
    let page = folder.path().join("r.html");
    let (json_path, page_path) = (json.to_str().unwrap(), page.to_str().unwrap());
    let more = ["--feed", "960", "--reference-force", "6", "--json", json_path, "--report", page_path];
    let out = stepover(folder.path(), &surfaces::stl(&small_cylinder()), CYLINDER_STOCK, &more);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    let varying = &report["varying"];
    // The scallop limit holds everywhere, and the written program is simulated like any other.
    assert!(varying["scallop_max_mm"].as_f64().unwrap() <= 0.0101, "{varying}");
    assert!(varying["scallop_beyond_percent"].as_f64().unwrap() == 0.0, "{varying}");
    assert!(varying["simulated"]["within_10_percent"].as_f64().unwrap() >= 95.0, "{varying}");
    assert!((varying["simulated"]["mean_ratio"].as_f64().unwrap() - 1.0).abs() < 0.03, "{varying}");
    // Against the faster of the constant step-overs along the surface and seen from above, each at its best feed: 15.1 % (asked: 20, but no passes
    // laid alike can save more than 17.1 % of its cutting time).
    assert!(report["saved_percent"].as_f64().unwrap() > 14.0, "{report}");
    // Against the bound of straight passes that alternate: 1.6 % (asked: 3).
    let above = varying["predicted"]["least"]["cutting_above_percent"][0].as_f64().unwrap();
    assert!((0.0..2.0).contains(&above), "{varying}");
    assert!(report["price"]["s_per_n"].as_f64().unwrap() < 0.0 && report["price"]["s_per_um"].as_f64().unwrap() < 0.0);
    assert!(std::fs::read_to_string(&page).unwrap().matches("<rect").count() > 1000);
    // The stock that nothing names is said; the box of the setup is raw stock.
    let said = String::from_utf8_lossy(&out.stdout).into_owned();
    assert!(said.contains("for stock of 0.1 mm on the surface"), "{said}");
    assert!(report["notes"][0].as_str().unwrap().contains("--stock"), "{report}");
    // Every line is read without a doubt.
    let mut simulate = Command::cargo_bin("feedwright").unwrap();
    let setup = folder.path().join("part.setup.toml");
    let read = simulate.arg("toolpath").arg(&program).arg("--setup").arg(&setup).output().unwrap();
    assert!(read.status.success() && read.stderr.is_empty(), "{}", String::from_utf8_lossy(&read.stderr));
}

/// A wall that rises ahead of the tool: what a plan across the feed does not know. The program is held to the reference all the
/// same, on passes, leads and links, and takes less time than a constant step-over.
#[test]
fn a_wall_ahead_of_the_tool_is_met_no_harder_than_the_reference() {
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("r.json");
    // From a floor up a wall of 60 degrees across the passes and one along them, over fillets of 6 mm.
    let fillet = |d: f64| {
        let (r, s): (f64, f64) = (6.0, f64::to_radians(60.0));
        let (run, top) = (r * s.sin(), r * (1.0 - s.cos()));
        if d < 0.0 {
            0.0
        } else if d < run {
            r - (r * r - d * d).sqrt()
        } else {
            top + (d - run) * s.tan()
        }
    };
    let wall = surfaces::sheet([120, 60], |u, v| {
        let (x, y) = (16.0 * u, 8.0 * v);
        [x, y, fillet(x - 8.0).max(fillet(y - 4.0)) - 12.0]
    });
    let stock = "box = { min = [0, 0, -14], max = [16, 8, 0] }";
    let more = ["--reference-force", "6", "--json", json.to_str().unwrap()];
    let out = stepover(folder.path(), &surfaces::stl(&wall), stock, &more);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    let simulated = &report["varying"]["simulated"];
    for key in ["force_p99_n", "links_force_max_n"] {
        assert!(simulated[key].as_f64().unwrap() <= 6.0 * 1.01, "{simulated}");
    }
    assert!(simulated["force_max_n"].as_f64().unwrap() <= 6.6, "{simulated}");
    assert!(report["saved_percent"].as_f64().unwrap() > 0.0, "{report}");
}

/// Passes up a concave cylinder are arcs of its radius less that of the tool; on controls that do not draw upright arcs they are lines.
#[test]
fn passes_up_a_cylinder_are_arcs() {
    let patch = surfaces::sheet([8, 60], |u, v| {
        let slope = (10.0 + 20.0 * v).to_radians();
        [4.0 * u, 40.0 * slope.sin(), -40.0 * slope.cos()]
    });
    let stock = "box = { min = [0, 6, -42], max = [4, 21, -34] }";
    let of = |dialect: &str| {
        let folder = tempfile::tempdir().unwrap();
        let more = ["--direction", "90", "--feed", "960", "--dialect", dialect];
        let out = stepover(folder.path(), &surfaces::stl(&patch), stock, &more);
        assert!(out.status.success(), "{dialect}: {}", String::from_utf8_lossy(&out.stderr));
        std::fs::read_to_string(folder.path().join("part.nc")).unwrap()
    };
    let text = of("linuxcnc");
    let (mut at, mut arcs) = ([0.0f64; 3], 0);
    for line in text.lines() {
        let value = |letter: char| {
            let word = line.split_whitespace().find_map(|word| word.strip_prefix(letter));
            word.map(|text| text.parse::<f64>().unwrap())
        };
        if let (Some(j), Some(k)) = (value('J'), value('K')) {
            assert!((j.hypot(k) - 37.0).abs() < 0.5, "{line}");
            arcs += 1;
        }
        ['X', 'Y', 'Z'].iter().zip(&mut at).for_each(|(letter, at)| *at = value(*letter).unwrap_or(*at));
    }
    assert!(arcs >= 5 && text.contains("G19") && text.contains("G17\nM5"), "{text}");
    for dialect in ["siemens", "heidenhain"] {
        let text = of(dialect);
        assert!(!text.contains("G19") && !text.contains("CC "), "{text}");
    }
}

/// The same passes in every dialect, in millimetres and inches: read without a doubt, and of one length. The scallop limit does not bind, as what
/// keeps it depends on how passes are written.
#[test]
fn every_dialect_and_unit_is_read_back_as_the_same_passes() {
    let patch = surfaces::sheet([18, 18], |u, v| [3.0 * u, 3.0 * v, (0.5 * u).sin() * 2.0 + v * v]);
    let stock = "box = { min = [0, 0, -4], max = [3, 3, 4] }";
    let mut first = None;
    for (dialect, unit) in [
        ("linuxcnc", "mm"),
        ("linuxcnc", "inch"),
        ("fanuc", "mm"),
        ("haas", "inch"),
        ("grbl", "mm"),
        ("siemens", "mm"),
        ("siemens", "inch"),
        ("heidenhain", "mm"),
        ("heidenhain", "inch"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = setup_for(folder.path(), stock);
        let text = std::fs::read_to_string(&path).unwrap();
        let machine = format!("[machine]\nprogram_unit = \"{unit}\"");
        std::fs::write(&path, text.replace("[machine]", &machine).replace("\"linuxcnc\"", &format!("\"{dialect}\"")))
            .unwrap();
        let part = folder.path().join("part.stl");
        std::fs::write(&part, surfaces::stl(&patch)).unwrap();
        let run = |words: &[&str]| {
            let mut command = Command::cargo_bin("feedwright").unwrap();
            command.args(words).arg("--setup").arg(&path).output().unwrap()
        };
        let part_path = part.to_str().unwrap();
        let out = run(&[
            "stepover",
            "--surface",
            part_path,
            "--feed",
            "960",
            "--scallop",
            "0.03",
            "--largest-step-over",
            "0.3",
        ]);
        assert!(out.status.success(), "{dialect} {unit}: {}", String::from_utf8_lossy(&out.stderr));
        let program = folder.path().join("part.nc");
        let read = run(&["toolpath", program.to_str().unwrap()]);
        let said = String::from_utf8_lossy(&read.stderr).into_owned();
        assert!(read.status.success() && said.is_empty(), "{dialect} {unit}: {said}");
        let source = std::fs::read(&program).unwrap();
        // 960 mm/min: in inches per minute with a point, in plain language in tenths of that without one.
        let feed = match (dialect, unit) {
            ("heidenhain", "inch") => " F378\n",
            (_, "inch") => " F37.8\n",
            _ => " F960\n",
        };
        let text = String::from_utf8_lossy(&source).into_owned();
        assert!(text.contains(feed), "{dialect} {unit}: {text}");
        let (job, _) = setup::load(&std::fs::read_to_string(&path).unwrap(), folder.path()).unwrap();
        let parsed = nc::parse(source, Dialect::from_name(dialect));
        let environment = Environment::from_job(&job);
        let read = nc::interpret(&parsed, &environment);
        let feeds = read.moves.iter().filter(|m| m.kind == MoveKind::Feed);
        let length: f64 = feeds.map(|m| m.curve().length()).sum();
        println!("{dialect} {unit}: {length:.3} mm of feed motions in {} motions", read.moves.len());
        let expected = *first.get_or_insert(length);
        assert!((length / expected - 1.0).abs() < 2e-3, "{dialect} {unit}: {length} {expected}");
    }
}

/// The scallop between two passes of a bull-nose end over a plane of any slope, against tools set down one by one, 0.01 mm apart, along
/// both passes: the highest point that none of them reaches. (Tools so far apart leave ridges of 0.01²/8r mm, 0.01 µm, themselves.)
#[test]
fn scallops_of_a_bull_nose_on_slopes_are_those_of_the_swept_volume() {
    let (sin, cos) = 0.4f64.sin_cos();
    let ahead = [cos, sin];
    let level = |along: f64, across: f64| [along * cos - across * sin, along * sin + across * cos];
    for shape in [Shape { flat_mm: 2.0, corner_mm: 1.0 }, Shape { flat_mm: 1.0, corner_mm: 2.0 }] {
        let Shape { flat_mm: a, corner_mm: r } = shape;
        for (up_deg, aside_deg) in
            [(0.0f64, 0.0f64), (2.0, 0.0), (20.0, 0.0), (-45.0, 0.0), (0.0, 30.0), (20.0, 20.0), (-20.0, 50.0)]
        {
            // Rise of the plane for each millimetre along the feed and to its left.
            let rise = [up_deg.to_radians().tan(), aside_deg.to_radians().tan()];
            let slope = rise[0].hypot(rise[1]);
            let secant = slope.hypot(1.0);
            let [gx, gy] = level(rise[0], rise[1]);
            let normal = Vec3::new(-gx, -gy, 1.0) / secant;
            let z = |p: [f64; 2]| gx * p[0] + gy * p[1];
            let tip = |p: [f64; 2]| Vec3::new(p[0], p[1], z(p) + r * (secant - 1.0) + a * slope);
            let out = if slope > 0.0 { a * secant / slope + r } else { r };
            for step in [0.3, 0.8] {
                let (first, second) = (level(0.0, -step), [0.0, 0.0]);
                let contact = [second[0] - out * normal.x, second[1] - out * normal.y];
                let ground = Ground {
                    contact: Vec3::new(contact[0], contact[1], z(contact)),
                    normal,
                    curvature_per_mm: 0.0,
                    stock_mm: 0.1,
                    turn_per_mm: 0.0,
                };
                let tangent = Vec3::new(ahead[0], ahead[1], rise[0]).normalize();
                let section = Section::new(shape, tip(second), tangent, &ground, Beside::Pass(tip(first)));
                let reached = |q: [f64; 2]| {
                    let tools = (-400..=400).flat_map(|k| {
                        let [dx, dy] = level(0.01 * f64::from(k), 0.0);
                        [first, second].map(|p| tip([p[0] + dx, p[1] + dy]))
                    });
                    let lower = tools.filter_map(|tip| Some(tip.z + shape.height((q[0] - tip.x).hypot(q[1] - tip.y))?));
                    lower.fold(f64::INFINITY, f64::min)
                };
                let expected = (0..=400)
                    .map(|k| {
                        let [dx, dy] = level(0.0, -step * f64::from(k) / 400.0);
                        let q = [contact[0] + dx, contact[1] + dy];
                        (reached(q) - z(q)) / secant
                    })
                    .fold(0.0, f64::max);
                let found = section.scallop_mm();
                println!("{shape:?} {up_deg} {aside_deg} {step}: {found:.6} mm, swept {expected:.6} mm");
                assert!((found - expected).abs() < 0.01 * expected + 2e-5, "{shape:?} {up_deg} {aside_deg} {step}");
            }
        }
    }
}

/// A bull-nose end on a slope in both directions, turned by 30 degrees: force and scallop are held.
#[test]
fn a_bull_nose_up_a_slope_holds_its_force_and_its_scallop() {
    let patch = surfaces::sheet([24, 24], |u, v| {
        let (x, y) = (6.0 * u, 6.0 * v);
        [x, y, 0.35 * x + 0.2 * y - 0.02 * x * x]
    });
    let folder = tempfile::tempdir().unwrap();
    let path = setup_for(folder.path(), "box = { min = [0, 0, -4], max = [6, 6, 5] }");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace("shape = \"ball\"", "shape = \"bull\"\ncorner_radius = 1.5")).unwrap();
    let (part, json) = (folder.path().join("part.stl"), folder.path().join("r.json"));
    std::fs::write(&part, surfaces::stl(&patch)).unwrap();
    let mut command = Command::cargo_bin("feedwright").unwrap();
    command.arg("stepover").arg("--surface").arg(&part).arg("--setup").arg(&path).arg("--json").arg(&json);
    let out = command.args(["--direction", "30", "--reference-force", "12"]).output().unwrap();
    assert!(out.status.success(), "{}{}", String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    let varying = &report["varying"];
    assert!(varying["scallop_max_mm"].as_f64().unwrap() <= 0.0101, "{varying}");
    assert!(varying["scallop_beyond_percent"].as_f64().unwrap() == 0.0, "{varying}");
    println!("{} passes", varying["passes"]);
    assert!(varying["simulated"]["force_p99_n"].as_f64().unwrap() <= 12.0 * 1.01, "{varying}");
    assert!(varying["simulated"]["contact_mm"].as_f64().unwrap() > 36.0, "{varying}");
}

/// A saddle, along which the contact wanders over the tool: the force and the scallop of the written motions are within what is asked for,
/// passes, leads and links. A force that no allowed feed keeps ends with exit code 1, the program written and the sentence said.
#[test]
fn limits_hold_on_a_saddle_or_the_exit_code_says_that_they_do_not() {
    let saddle = surfaces::sheet([28, 24], |u, v| {
        let (x, y) = (7.0 * u, 6.0 * v);
        [x, y, ((x - 3.5).powi(2) - (y - 3.0).powi(2)) / 14.0]
    });
    let stock = "box = { min = [0, 0, -10], max = [7, 6, 6] }";
    let run = |reference: &str| {
        let folder = tempfile::tempdir().unwrap();
        let json = folder.path().join("r.json");
        let more = ["--reference-force", reference, "--scallop", "0.02", "--json", json.to_str().unwrap()];
        let out = stepover(folder.path(), &surfaces::stl(&saddle), stock, &more);
        assert!(folder.path().join("part.nc").exists());
        let report: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
        (out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned(), report)
    };
    let (code, said, report) = run("6");
    let varying = &report["varying"];
    assert!(code == Some(0) && varying["unmet"].as_array().unwrap().is_empty(), "{said}{varying}");
    for key in ["force_max_n", "links_force_max_n"] {
        assert!(varying["simulated"][key].as_f64().unwrap() <= 6.0 * 1.01, "{varying}");
    }
    assert!(varying["scallop_max_mm"].as_f64().unwrap() <= 0.02 * 1.02, "{varying}");
    let (code, said, report) = run("1");
    let varying = &report["varying"];
    assert!(code == Some(1) && said.contains("the reference of 1 N is not held"), "{said}");
    assert!(varying["simulated"]["force_beyond_mm"].as_f64().unwrap() > 0.0, "{varying}");
    assert_eq!(varying["unmet"].as_array().unwrap().len(), 1, "{varying}");
}

/// Stock that the setup names as left by an earlier program is the allowance: twice as thick on one half, it is met twice as thick
/// there.
#[test]
fn stock_left_by_an_earlier_program_is_the_allowance() {
    let stl = surfaces::stl(&part_of_cylinder(30.0));
    let surface = Surface::read(&stl, 1.0, 1.4).unwrap();
    let run = |piece: Option<feedwright::stock::Piece>, more: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let stock = piece.map_or(CYLINDER_STOCK.to_owned(), |piece| {
            let bytes = feedwright::stock::saved::to_bytes(&piece, Vec3::zeros());
            std::fs::write(folder.path().join("left.stock"), bytes).unwrap();
            "saved = \"left.stock\"".into()
        });
        let json = folder.path().join("r.json");
        let all = [&["--feed", "960", "--reference-force", "6", "--json", json.to_str().unwrap()], more].concat();
        let out = stepover(folder.path(), &stl, &stock, &all);
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        serde_json::from_slice::<serde_json::Value>(&std::fs::read(&json).unwrap()).unwrap()
    };
    let time = |report: &serde_json::Value| report["varying"]["cutting_s"].as_f64().unwrap();
    let said = run(None, &["--stock", "0.2"]);
    let left = run(Some(feedwright::finish::stepover::check::stock(&surface, 0.2)), &[]);
    let thin = run(Some(feedwright::finish::stepover::check::stock(&surface, 0.1)), &[]);
    println!("0.2 mm said {:.2} s, saved {:.2} s; 0.1 mm saved {:.2} s", time(&said), time(&left), time(&thin));
    assert!((time(&left) / time(&said) - 1.0).abs() < 0.03);
    assert!(time(&thin) < 0.9 * time(&left));
    assert!(
        left["varying"]["simulated"]["mean_ratio"].as_f64().is_some_and(|ratio| (ratio - 1.0).abs() < 0.03),
        "{left}"
    );
}

/// Walls of stock stand around a floor that is the whole mesh. Rapids pass above them; raw stock that is met is said, and what an earlier program
/// left there is not cut through.
#[test]
fn stock_beside_the_surface_is_passed_above_and_said() {
    let floor = surfaces::sheet([4, 4], |u, v| [4.0 * u, 4.0 * v, -6.0]);
    let around = |low: f64, high: f64| feedwright::machine::Box3 {
        min: Vec3::new(low, low, -12.0),
        max: Vec3::new(high, high, 0.0),
    };
    let run = |beside: bool, saved: bool, more: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let extent = if beside { around(-8.0, 12.0) } else { around(0.0, 4.0) };
        let stock = if saved {
            let piece = feedwright::stock::Piece::uncut(feedwright::stock::Blank::Box(extent), 0.1);
            let bytes = feedwright::stock::saved::to_bytes(&piece, Vec3::zeros());
            std::fs::write(folder.path().join("left.stock"), bytes).unwrap();
            "saved = \"left.stock\"".to_owned()
        } else {
            let corner = |p: Vec3| format!("[{}, {}, {}]", p.x, p.y, p.z);
            format!("box = {{ min = {}, max = {} }}", corner(extent.min), corner(extent.max))
        };
        let all = [&["--feed", "960", "--reference-force", "30"], more].concat();
        let out = stepover(folder.path(), &surfaces::stl(&floor), &stock, &all);
        let text = std::fs::read_to_string(folder.path().join("part.nc")).ok();
        let said = String::from_utf8_lossy(&[out.stdout, out.stderr].concat()).into_owned();
        (out.status.code().unwrap(), said, text)
    };
    let met = "meets stock that the setup says to stand there, at rapid on line";
    for (beside, code) in [(true, 0), (false, 0)] {
        let (found, said, text) = run(beside, false, &[]);
        assert_eq!((found, said.contains(met)), (code, beside), "{said}");
        let text = text.unwrap();
        let first = text.lines().find_map(|line| line.strip_prefix("G0 Z")).unwrap();
        assert!(first.parse::<f64>().unwrap() >= 5.0, "above the top at Z0: {text}");
    }
    let (code, said, text) = run(true, true, &["--stock", "0.1"]);
    assert!(code == 1 && said.contains(met) && text.is_none(), "{said}");
    let (code, said, text) = run(false, true, &["--stock", "0.1"]);
    assert!(code == 0 && !said.contains(met) && text.is_some(), "{said}");
}

/// Bad input: a clear error, exit code 2, and nothing written.
#[test]
fn bad_surfaces_are_refused_and_nothing_is_written() {
    let good = small_cylinder();
    let scaled = |by: f64| good.iter().map(|t| t.map(|p| p.map(|x| by * x))).collect::<Vec<_>>();
    let mut not_a_number = surfaces::stl(&good);
    not_a_number[84 + 12..84 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    // Four millimetres along X, three across.
    let in_hole = |k: usize| (4..8).contains(&(k / 2 % 12)) && (100..130).contains(&(k / 2 / 12));
    let hole: Vec<_> = good.iter().enumerate().filter(|(k, _)| !in_hole(*k)).map(|(_, t)| *t).collect();
    let flat: Vec<_> = good.iter().map(|t| [t[0], t[0], t[1]]).collect();
    // A groove whose radius is smaller than the tool's.
    let groove = surfaces::sheet([20, 100], |u, v| {
        let slope = (160.0 * v - 80.0).to_radians();
        [20.0 * u, 20.0 + 2.0 * slope.sin(), -20.0 - 2.0 * slope.cos()]
    });
    let beside: Vec<_> = good.iter().map(|t| t.map(|p| [p[0] + 40.0, p[1], p[2]])).collect();
    let feed = ["--feed", "960"];
    let low = ["--feed", "960", "--reference-force", "0.05"];
    let cases: [(&str, Vec<u8>, &[&str], &str); 8] = [
        ("25.4 times too large", surfaces::stl(&scaled(25.4)), &feed, "25.4"),
        ("25.4 times too small", surfaces::stl(&scaled(1.0 / 25.4)), &feed, "inches"),
        ("not a number", not_a_number, &feed, "no number"),
        ("hole", surfaces::stl(&hole), &feed, "hole"),
        ("no area", surfaces::stl(&flat), &feed, "no triangles with an area"),
        ("groove", surfaces::stl(&groove), &feed, "is too large for"),
        ("force out of reach", surfaces::stl(&good), &low, "out of reach"),
        ("beside the stock", surfaces::stl(&beside), &feed, "beside the stock"),
    ];
    for (what, stl, more, said) in cases {
        let folder = tempfile::tempdir().unwrap();
        let out = stepover(folder.path(), &stl, CYLINDER_STOCK, more);
        let error = String::from_utf8_lossy(&out.stderr).into_owned();
        assert_eq!(out.status.code(), Some(2), "{what}: {error}");
        assert!(error.contains(said), "{what}: {error}");
        assert!(!folder.path().join("part.nc").exists(), "{what}");
    }
}

/// What the setup leaves to defaults is refused where it has to be complete, as by every command.
#[test]
fn defaults_are_refused_when_none_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let out =
        stepover(folder.path(), &surfaces::stl(&small_cylinder()), CYLINDER_STOCK, &["--feed", "960", "--strict"]);
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(out.status.code() == Some(2) && error.contains("to defaults"), "{error}");
    assert!(!folder.path().join("part.nc").exists());
}

/// Options that are no numbers, of a sign that is not meant, or that leave no step-over are refused by name.
#[test]
fn options_that_make_no_sense_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let stl = surfaces::stl(&small_cylinder());
    let refused = |options: &[&str], said: &str| {
        let out = stepover(folder.path(), &stl, CYLINDER_STOCK, options);
        let error = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(out.status.code() == Some(2) && error.contains(said), "{options:?}: {error}");
        assert!(!folder.path().join("part.nc").exists(), "{options:?}");
    };
    let lengths = ["--scallop", "--stock", "--tolerance", "--least-step-over", "--largest-step-over"];
    for option in lengths.into_iter().chain(["--rpm", "--feed", "--reference-force"]) {
        for value in ["nan", "inf", "0", "-1"] {
            refused(&[option, value], option);
        }
    }
    for option in ["--direction", "--turn", "--shallowest", "--steepest"] {
        for value in ["nan", "inf"] {
            refused(&[option, value], option);
        }
    }
    let coarse = ["--feed", "960", "--scallop", "0.01", "--tolerance", "0.04"];
    refused(&coarse, "leaves nothing beside lines and arcs within 0.04 mm");
    refused(
        &["--feed", "960", "--least-step-over", "5", "--largest-step-over", "1"],
        "larger than the largest of 1.000 mm",
    );
    // Without the largest one it is the radius of the tool.
    refused(&["--feed", "960", "--least-step-over", "5"], "larger than the largest of 3.000 mm");
}

/// What can be mended is mended and said: triangles that face the wrong way, one in ten or all, without area, or missing one by one.
#[test]
fn facets_that_can_be_mended_give_the_program_of_the_good_mesh() {
    let good = surfaces::sheet([12, 30], |u, v| {
        let slope = (10.0 + 10.0 * v).to_radians();
        [4.0 * u, 40.0 * slope.sin(), -40.0 * slope.cos()]
    });
    let turn = |t: &[[f64; 3]; 3]| [t[0], t[2], t[1]];
    let some = good.iter().enumerate().map(|(k, t)| if k % 10 == 3 { turn(t) } else { *t }).collect::<Vec<_>>();
    let all: Vec<_> = good.iter().map(turn).collect();
    let mut flat = good.clone();
    flat.extend(good.iter().take(5).map(|t| [t[0], t[1], t[1]]));
    let stock = "box = { min = [0, 6, -42], max = [4, 14, -34] }";
    let mut expected = None;
    for (what, mesh, said) in [
        ("good", &good, ""),
        ("some turned", &some, "faced the wrong way"),
        ("all turned", &all, "looked down"),
        ("without area", &flat, "area"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let out = stepover(folder.path(), &surfaces::stl(mesh), stock, &["--feed", "960"]);
        let screen = String::from_utf8_lossy(&out.stdout).into_owned();
        assert!(out.status.success(), "{what}: {}", String::from_utf8_lossy(&out.stderr));
        assert!(screen.contains(said), "{what}: {screen}");
        let text = std::fs::read_to_string(folder.path().join("part.nc")).unwrap();
        assert_eq!(&text, expected.get_or_insert_with(|| text.clone()), "{what}");
    }
}

/// Tips every 0.02 mm along the feed motions of the program that was written, mm.
fn tips(folder: &Path) -> Vec<Vec3> {
    let text = std::fs::read_to_string(folder.join("part.setup.toml")).unwrap();
    let (job, _) = setup::load(&text, folder).unwrap();
    let program = nc::parse(std::fs::read(folder.join("part.nc")).unwrap(), Some(Dialect::LinuxCnc));
    let toolpath = nc::interpret(&program, &Environment::from_job(&job));
    let feeds = toolpath.moves.iter().filter(|motion| motion.kind == MoveKind::Feed);
    let along = |motion: &nc::Move| {
        let (curve, length) = (motion.curve(), motion.curve().length());
        let count = (length / 0.02).ceil().max(1.0);
        (0..=count as usize).map(|k| curve.point(length * k as f64 / count)).collect::<Vec<_>>()
    };
    feeds.flat_map(along).collect()
}

/// Plans over a mesh with a box of stock about it, and gives the folder.
fn planned(mesh: &[[[f64; 3]; 3]], more: &[&str]) -> (tempfile::TempDir, std::process::Output) {
    let folder = tempfile::tempdir().unwrap();
    let start = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let (low, high) = mesh.iter().flatten().fold(start, |(low, high), p| {
        ([0, 1, 2].map(|k| f64::min(low[k], p[k])), [0, 1, 2].map(|k| f64::max(high[k], p[k])))
    });
    let stock = format!("box = {{ min = {low:?}, max = [{}, {}, {}] }}", high[0], high[1], high[2] + 1.0);
    let json = folder.path().join("r.json");
    let more: Vec<&str> = more.iter().copied().chain(["--json", json.to_str().unwrap()]).collect();
    let out = stepover(folder.path(), &surfaces::stl(mesh), &stock, &more);
    (folder, out)
}

fn report(folder: &tempfile::TempDir) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(folder.path().join("r.json")).unwrap()).unwrap()
}

/// Passes end where the surface does and not at the column before, and ground between two columns is cut too: every point of a cylinder up to
/// 84 degrees, of a strip narrower than a column and of a patch smaller than one is left with no more than the scallop limit.
#[test]
fn passes_reach_the_ends_of_the_surface() {
    type Sheet<'a> = &'a dyn Fn(f64, f64) -> [f64; 3];
    let cylinder = |u: f64, v: f64| {
        let slope = (88.0 * u).to_radians();
        [8.0 * slope.sin(), 1.5 * v, 8.0 * slope.cos()]
    };
    let strip = |u: f64, v: f64| [7.29 + 0.42 * u, 2.0 * v, 0.1 * v];
    let patch = |u: f64, v: f64| [0.4 * u, 0.4 * v, 0.04 * u];
    let cases: [(&str, Sheet, [usize; 2], f64); 3] = [
        ("cylinder", &cylinder, [176, 2], 84.0 / 88.0),
        ("strip", &strip, [2, 4], 1.0),
        ("patch", &patch, [2, 2], 1.0),
    ];
    for (what, at, cells, up_to) in cases {
        let (folder, out) = planned(&surfaces::sheet(cells, at), &["--feed", "960", "--reference-force", "60"]);
        assert!(out.status.success(), "{what}: {}", String::from_utf8_lossy(&out.stderr));
        let tips = tips(folder.path());
        let left = |k: usize| {
            let p = Vec3::from(at(up_to * (k % 40) as f64 / 39.0, (k / 40) as f64 / 9.0));
            tips.iter().map(|tip| (tip + 3.0 * Vec3::z() - p).norm() - 3.0).fold(f64::INFINITY, f64::min)
        };
        let most = (0..400).map(left).fold(0.0, f64::max);
        println!("{what}: {most:.4} mm left");
        assert!(most < 0.0105, "{what}: {most} mm left");
        let said = &report(&folder)["varying"]["left"];
        assert!(said["beyond_mm2"] == 0.0 && said["height_max_mm"].as_f64().unwrap() < 0.0105, "{what}: {said}");
    }
}

/// Passes askew over a wall of 70 degrees: between two that touch floor and wall, or wall and top, the surface is no circle. Between the rims no more
/// than the scallop limit stays where the tool reaches. At the rims, where passes end askew on the wall, more stays today: exit code 1 says it.
#[test]
fn scallops_at_the_foot_and_the_edge_of_a_wall_are_held() {
    let slope = 70f64.to_radians();
    let profile = [[0.0, 0.0], [4.0, 0.0], [4.0 + 3.0 / slope.tan(), 3.0], [8.0, 3.0]];
    let wall = surfaces::sheet([2, 3], |u, v| {
        let [y, z] = profile[(3.0 * v).round() as usize];
        [8.0 * u, y, z]
    });
    let words = ["--feed", "960", "--reference-force", "60", "--direction", "20"];
    let (folder, out) = planned(&wall, &words);
    let tips = tips(folder.path());
    // The tool touches the floor no nearer to the foot than 3 tan 35, and the wall no lower than 3 (1 − cos 70).
    let (near, low) = (3.0 * (0.5 * slope).tan(), 3.0 * (1.0 - slope.cos()));
    let point = |k: u32| {
        let (u, v) = (f64::from(k) * 0.754_877_666 % 1.0, f64::from(k) * 0.569_840_291 % 1.0);
        let (low, from) = (low / 3.0 + v * (1.0 - low / 3.0), v * (4.0 - near));
        let [y, z] = match k % 3 {
            0 => [from, 0.0],
            1 => [4.0 + 3.0 * low / slope.tan(), 3.0 * low],
            _ => [8.0 - v * (4.0 - 3.0 / slope.tan()), 3.0],
        };
        Vec3::new(1.5 + 5.0 * u, y, z)
    };
    let left = |k: u32| {
        let p = point(k);
        let square = |tip: &Vec3| (tip + 3.0 * Vec3::z() - p).norm_squared();
        (tips.iter().map(square).fold(f64::INFINITY, f64::min).sqrt() - 3.0, p)
    };
    let (most, p) = (1..2000).map(left).reduce(|a, b| if b.0 > a.0 { b } else { a }).unwrap();
    let varying = &report(&folder)["varying"];
    println!("{most:.5} mm left at {p:.3?}, {} mm said, {} passes", varying["scallop_max_mm"], varying["passes"]);
    assert!(most < 0.0101, "{most} mm left at {p:?}");
    let is_held = varying["unmet"].as_array().unwrap().is_empty();
    assert_eq!(out.status.code(), Some(i32::from(!is_held)), "{varying}");
    assert!(is_held == (varying["left"]["beyond_mm2"] == 0.0 && varying["scallop_beyond_percent"] == 0.0), "{varying}");
}

/// A block with a hole of 3 mm radius, from above: at the rim passes end askew and leave more than between them, so that they lie closer there.
/// Elsewhere they stay as far apart as the limit allows on level ground, √(8·3·0.01) mm.
#[test]
fn a_rim_lowers_the_limit_about_itself_alone() {
    let block = surfaces::sheet([96, 4], |u, v| {
        let (sin, cos) = (-u * TAU).sin_cos();
        let out = f64::min(8.0 / cos.abs().max(1e-9), if sin > 0.0 { 20.0 } else { 6.0 } / sin.abs().max(1e-9));
        let [radius, z] = [[3.0, -8.0], [3.0, 0.0], [out, 0.0], [out, -8.0], [3.0, -8.0]][(4.0 * v).round() as usize];
        [8.0 + radius * cos, 6.0 + radius * sin, z]
    });
    let (folder, out) = planned(&block, &["--feed", "960", "--reference-force", "60"]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let mut rows: Vec<f64> = tips(folder.path()).iter().filter(|tip| tip.z.abs() < 1e-6).map(|tip| tip.y).collect();
    rows.sort_by(f64::total_cmp);
    rows.dedup_by(|a, b| (*a - *b).abs() < 2e-3);
    let steps = |from: f64, to: f64| {
        let near = rows.windows(2).filter(|two| (from..to).contains(&two[0]));
        let mut steps: Vec<f64> = near.map(|two| two[1] - two[0]).collect();
        steps.sort_by(f64::total_cmp);
        steps
    };
    // Elsewhere one pass lies closer: where the outline of these facets ends at the sides.
    let (at_rim, elsewhere) = (steps(1.0, 9.0)[0], steps(15.1, 25.0));
    let (usual, most) = (elsewhere[elsewhere.len() / 2], elsewhere[elsewhere.len() - 1]);
    println!("{at_rim:.3} mm at the rim, usually {usual:.3} and at most {most:.3} mm elsewhere");
    let level = f64::sqrt(8.0 * 3.0 * 0.01);
    assert!(at_rim < 0.95 * level && usual > 0.99 * level && most < 1.005 * level, "{at_rim} {elsewhere:?}");
}

/// From a floor to a wall of 5 mm: no motion, leads and links included, comes closer to the wall's edge than the radius.
#[test]
fn leads_keep_off_a_wall() {
    let profile = [[0.0, 0.0], [8.0, 0.0], [8.0, 5.0], [14.0, 5.0]];
    let step = surfaces::sheet([3, 2], |u, v| {
        let [x, z] = profile[(3.0 * u).round() as usize];
        [x, 2.0 * v, z]
    });
    let (folder, out) = planned(&step, &["--feed", "960", "--stock", "1.0", "--reference-force", "300"]);
    assert!(folder.path().join("part.nc").exists(), "{}", String::from_utf8_lossy(&out.stderr));
    let into = |tip: &Vec3| {
        let (x, z) = (tip.x - 8.0, tip.z + 3.0 - 5.0);
        let from_wall = if z <= 0.0 { -x } else { x.hypot(z) };
        if x < 0.0 { 3.0 - from_wall } else { -tip.z + 5.0 }
    };
    let deepest = tips(folder.path()).iter().map(into).fold(f64::NEG_INFINITY, f64::max);
    println!("deepest {deepest:.5} mm");
    assert!(deepest < 0.004, "{deepest}");
}

/// A pass uphill meets another force than one downhill. The bound counts the better of both, so that no program is faster than it.
#[test]
fn a_program_is_not_faster_than_its_bound() {
    let slope = surfaces::sheet([4, 3], |u, v| [12.0 * u, 4.0 * v, 6.0 * u]);
    let (folder, out) = planned(&slope, &["--feed", "960", "--reference-force", "6"]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let varying = &report(&folder)["varying"];
    let least = &varying["predicted"]["least"];
    let [alike, any] = ["laid_alike_s", "any_passes_s"].map(|key| least[key].as_f64().unwrap());
    assert!(varying["cutting_s"].as_f64().unwrap() > alike && alike >= any, "{varying}");
}

/// A crease of 10 degrees in large facets is no reason to refuse, however few facets it has: what stays in it is said.
#[test]
fn a_crease_is_noted_and_not_refused() {
    let crease = surfaces::sheet([2, 2], |u, v| [12.0 * u, 4.0 * v, (12.0 * u - 6.0).abs() * 5f64.to_radians().tan()]);
    let (_folder, out) = planned(&crease, &["--feed", "960", "--reference-force", "60"]);
    let screen = String::from_utf8_lossy(&out.stdout).into_owned();
    assert!(out.status.success() && screen.contains("the tool is too large for"), "{screen}");
}

/// Coordinates are rounded: a tolerance finer than that is refused. One for parallel passes may lie below the least slope of the others.
#[test]
fn a_tolerance_finer_than_the_coordinates_is_refused() {
    let slope = surfaces::sheet([2, 2], |u, v| [4.0 * u, 4.0 * v, u]);
    let (_folder, out) = planned(&slope, &["--feed", "960", "--tolerance", "0.0008"]);
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(out.status.code() == Some(2) && error.contains("--tolerance 0.0008 mm cannot be held"), "{error}");
    let (_folder, out) = planned(&slope, &["--feed", "960", "--tolerance", "0.0009", "--steepest", "20"]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
}

/// Feeds of a planned program are its own: the file has no mark of changed feeds, so that `optimize` may raise them.
#[test]
fn a_planned_program_is_not_marked_as_one_with_changed_feeds() {
    let slope = surfaces::sheet([2, 2], |u, v| [6.0 * u, 3.0 * v, 3.0 * u]);
    for dialect in ["linuxcnc", "heidenhain"] {
        let (folder, out) = planned(&slope, &["--feed", "960", "--reference-force", "4", "--dialect", dialect]);
        let text = std::fs::read_to_string(folder.path().join("part.nc")).unwrap();
        let feeds = text.matches(" F").count();
        assert!(feeds > 2 && !text.contains("FW"), "{dialect}: {}\n{text}", String::from_utf8_lossy(&out.stderr));
    }
}

/// Heights against opencamlib, where Python has it.
#[test]
#[cfg_attr(absent_opencamlib, ignore = "python3 with opencamlib is absent")]
fn heights_are_those_of_opencamlib() {
    let folder = tempfile::tempdir().unwrap();
    let triangles = surfaces::mould([60, 40]);
    let stl = surfaces::stl(&triangles);
    let surface = Surface::read(&stl, 1.0, 1.4).unwrap();
    std::fs::write(folder.path().join("mould.stl"), &stl).unwrap();
    let shapes = [("ball", Shape::ball(3.0)), ("bull", Shape { flat_mm: 2.0, corner_mm: 1.0 })];
    for (name, shape) in shapes {
        let dropper = Dropper::new(&surface, shape);
        let mut csv = format!("x,y,tip_mm\n# {name} {} {} 1 2000\n", shape.radius_mm(), shape.corner_mm);
        for k in 0..2000 {
            let p = [80.0 * f64::from(k % 50) / 49.0, 60.0 * f64::from(k / 50) / 39.0];
            csv += &format!("{},{},{}\n", p[0], p[1], dropper.drop(p).unwrap().tip_mm);
        }
        std::fs::write(folder.path().join(format!("{name}.csv")), csv).unwrap();
    }
    let script = std::process::Command::new("python3")
        .arg("tests/bench/compare_opencamlib.py")
        .args([folder.path().to_str().unwrap(), "ball", "bull"])
        .output()
        .unwrap();
    assert!(script.status.success(), "{}", String::from_utf8_lossy(&script.stdout));
}
