//! What is decided under a process model with effects holds in the file that is written: the largest load over its limit is
//! the same in the summary, in the check of the written file and where `simulate` is asked about that file, whatever the
//! effect. Edges that wear get feeds that hold on the wear that they themselves cause; where no feeds do, nothing is
//! written.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use assert_cmd::Command;
use feedwright::effects;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Every kind of cut may rise, far: the loads, not a rule of what never rises, bound the feeds.
const SETUP: &str = r#"
[machine]
rapid = 15000
[machine.axes]
x = { velocity = 15000, acceleration = 1500 }
y = { velocity = 15000, acceleration = 1500 }
z = { velocity = 12000, acceleration = 1200 }
[machine.spindle]
max_rpm = 12000
tare = [[0, 100], [12000, 100]]
[stock]
box = { min = [0, 0, -20], max = [100, 60, 0] }
[material]
MATERIAL
[[tool]]
number = 1
shape = "flat"
diameter = 10
flutes = 2
flute_length = 22
[limits]
LIMITS
feed_change = { max = 20 }
[raise]
plunges = true
ramps = true
entries = true
finishing = true
compensation = true
cycles = true
[output]
minimum_change = 0
"#;

const EDGES: &str = "k_tc = 800\nk_rc = 300\nk_ac = 100\nk_te = 20\nk_re = 15\nk_ae = 3";

fn setup(material: &str, limits: &str) -> String {
    SETUP.replace("MATERIAL", material).replace("LIMITS", limits)
}

/// Passes of half immersion along X at a depth of 4 mm, each beginning and ending in air, in blocks of 10 mm; an arc at the
/// end of the last.
fn passes(count: u32) -> String {
    let mut text = String::from("G21 G90 G94\nT1 M6\nS6000 M3\nG0 X110 Y-10 Z5\nG0 Z-4\n");
    for pass in 1..=count {
        text += &format!("G0 Y{}\nG1 X95 F300\n", 5 * pass - 5);
        text.extend((0..10).map(|block| format!("X{}\n", 85 - 10 * block)));
        text += "G0 Z5\nG0 X110\nG0 Z-4\n";
    }
    text += &format!("G0 Y{}\nG1 X50 F300\nG3 X30 Y{} I0 J-20\nG0 Z5\nM30\n", 5 * count, 5 * count - 20);
    text
}

fn run(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let output = Command::cargo_bin("feedwright").unwrap().current_dir(folder).args(arguments).output().unwrap();
    let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    (output.status.code().unwrap(), said)
}

/// Largest load over its limit among the loads of a report.
fn worst(report: &Value, key: &str) -> f64 {
    let rows = report["limits"].as_array().unwrap().iter();
    rows.filter_map(|row| Some(row[key].as_f64()? / row["limit"].as_f64()?)).fold(0.0, f64::max)
}

/// What became of a program.
struct Told {
    /// Largest load over its limit in the summary, in the check, and in a simulation of what was written.
    worst: [f64; 3],
    /// Of the program as it came, in `optimize` and in `simulate`.
    before: [f64; 2],
    /// Time as written, s.
    time_s: f64,
    text: String,
}

fn optimized(setup: &str, program: &str, model: &str) -> Told {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("part.nc"), program).unwrap();
    fs::write(folder.join("part.setup.toml"), setup).unwrap();
    fs::write(folder.join("model.toml"), model).unwrap();
    let report = |name: &str, arguments: &[&str]| -> Value {
        let arguments = [arguments, &["--setup", "part.setup.toml", "--model", "model.toml", "--json", name]].concat();
        let (code, said) = run(folder, &arguments);
        assert!(code == 0, "{said}");
        serde_json::from_slice(&fs::read(folder.join(name)).unwrap()).unwrap()
    };
    let written = report("written.json", &["optimize", "part.nc", "-o", "out.nc"]);
    let again = report("again.json", &["simulate", "out.nc"]);
    let original = report("original.json", &["simulate", "part.nc"]);
    Told {
        worst: [
            worst(&written, "after_max"),
            written["check"]["resimulated_worst_ratio"].as_f64().unwrap(),
            worst(&again, "before_max"),
        ],
        before: [worst(&written, "before_max"), worst(&original, "before_max")],
        time_s: written["time"]["realised_after_s"].as_f64().unwrap(),
        text: fs::read_to_string(folder.join("out.nc")).unwrap(),
    }
}

/// What an effect is expected to do to the file.
#[derive(Clone, Copy, PartialEq)]
enum Does {
    /// Loads, and with them feeds.
    Feeds,
    /// The time on the machine.
    Time,
    /// Nothing: it happened once, or changes readings only and not by the load, or is part of the engagement anyway.
    Nothing,
}

/// Every effect with strong parameters.
const TABLE: &[(&str, &str, Does)] = &[
    ("flank-wear", "growth_per_100m = 2, run_in = 0.3, run_in_length = 0.1, end = 0", Does::Feeds),
    ("edge-chipping", "jump_cutting = 0.5, jump_edge = 0.5, time = 5", Does::Nothing),
    ("size-effect", "exponent = 0.5", Does::Feeds),
    ("edge-force", "equivalent_chip = 0.02", Does::Feeds),
    ("cutting-speed", "exponent = 0.5", Does::Feeds),
    ("edge-position", "slope = 0.3", Does::Feeds),
    ("up-down-asymmetry", "cutting = -0.4, edge = -0.4", Does::Feeds),
    ("entry", "excess = 1, length = 10, order = 1", Does::Feeds),
    ("hard-zone", "excess = 0.6, x_min = 20, x_max = 60, y_min = -50, y_max = 200, border = 0.1", Does::Feeds),
    ("runout", "offset = 0.03, phase = 0", Does::Feeds),
    ("stock-proud", "top = 1, side = 1", Does::Feeds),
    ("tool-diameter", "difference = -1.5", Does::Feeds),
    ("path-curvature", "", Does::Nothing),
    ("corner-feed", "acceleration = 0.2", Does::Time),
    ("tare-warm-up", "excess = 1, time_constant = 20", Does::Feeds),
    ("tare-speed", "slope = 0.5, curvature = 0", Does::Feeds),
    ("axis-power", "friction = 0.5, acceleration = 0.5", Does::Nothing),
    // What a meter reads beyond the load counts as load until the setup has the losses of the drive.
    ("drive-efficiency", "excess = 0.5, exponent = 2", Does::Feeds),
    ("drive-efficiency", "excess = 0.5, exponent = 2, full_power = 400", Does::Feeds),
    ("drive-efficiency", "excess = 0.5, exponent = 2, full_torque = 1.3", Does::Feeds),
    ("sensor-lag", "time_constant = 2", Does::Nothing),
];

#[test]
fn summary_check_and_simulation_of_the_written_file_agree_under_every_effect() {
    for effect in effects::ALL {
        assert!(TABLE.iter().any(|(name, ..)| *name == effect.name), "{} has no row", effect.name);
    }
    // Both limits bind: the power one includes the tare of 100 W.
    let setup = setup(EDGES, "force_xy = 400\npower = 450");
    let model = |name: &str, parameters: &str| {
        let base = "tare = 100\ntare_speed = 3000\n";
        format!("{base}[[effect]]\nname = \"{name}\"\nparameters = {{ {parameters} }}\n")
    };
    let program = passes(5);
    let plain = optimized(&setup, &program, "tare = 100\ntare_speed = 3000\n");
    for (name, parameters, does) in TABLE {
        let told = optimized(&setup, &program, &model(name, parameters));
        let [low, high] = [f64::min, f64::max].map(|pick| told.worst.into_iter().reduce(pick).unwrap());
        println!("{name:<20} {:.4?} before {:.4?} {:.2} s", told.worst, told.before, told.time_s);
        assert!(high / low < 1.01, "{name}: summary, check, simulation {:?}", told.worst);
        assert!(high <= 1.01, "{name}: {:?}", told.worst);
        assert!((told.before[0] / told.before[1] - 1.0).abs() < 1e-9, "{name}: before {:?}", told.before);
        let (slower, other) = (told.time_s / plain.time_s - 1.0, told.text != plain.text);
        match does {
            Does::Feeds => assert!(other && slower.abs() > 0.01, "{name}: {slower}"),
            Does::Time => assert!(slower > 0.01, "{name}: {slower}"),
            Does::Nothing => assert!(!other && slower.abs() < 1e-9, "{name}: {slower}"),
        }
    }
}

/// The law that the setup gives to the tool itself, whatever its power, fresh and used.
#[test]
fn summary_check_and_simulation_agree_under_a_tools_own_law_of_wear() {
    let response = "model = \"response\"\nb0 = 40\nb_l = 2\nb_t = 2500";
    for (material, fresh, rate) in [(EDGES, 20.0, 10.0), (response, 40.0, 40.0)] {
        let bare = setup(material, "force_xy = 400");
        let of = |table: &str| {
            let own = bare.replace("flute_length = 22", &format!("flute_length = 22\n{table}"));
            optimized(&own, &passes(5), "tare = 100\ntare_speed = 3000\n")
        };
        let plain = of("").time_s;
        for exponent in [-1.0, 0.0, 0.5, 1.0, 2.0] {
            let law = |index: f64| {
                let own =
                    format!("rate = {rate}, feed_per_tooth = 0.05, exponent = {exponent}, end = {}", 50.0 * fresh);
                of(&format!("wear = {{ {own}, index = {index} }}"))
            };
            let [new, used] = [law(fresh), law(1.5 * fresh)];
            for told in [&new, &used] {
                let [low, high] = [f64::min, f64::max].map(|pick| told.worst.into_iter().reduce(pick).unwrap());
                println!("{fresh} p = {exponent}: {:.4?} before {:.4?} {:.2} s", told.worst, told.before, told.time_s);
                assert!(high / low < 1.01 && (0.98..=1.01).contains(&high), "p = {exponent}: {:?}", told.worst);
                assert!((told.before[0] / told.before[1] - 1.0).abs() < 1e-9, "p = {exponent}: {:?}", told.before);
            }
            assert!(
                plain < new.time_s && new.time_s < used.time_s,
                "p = {exponent}: {plain} {} {}",
                new.time_s,
                used.time_s
            );
        }
    }
}

/// flank-wear that grows by so much every 100 m, and nothing else.
fn wear(growth_per_100m: f64) -> String {
    format!("[[effect]]\nname = \"flank-wear\"\nparameters = {{ growth_per_100m = {growth_per_100m}, run_in = 0 }}\n")
}

#[test]
fn wear_follows_the_new_feeds_and_holds_the_limit_on_both_sides_of_twofold_force() {
    let setup = setup(EDGES, "force_xy = 600");
    for growth in [1.0, 5.0, 10.0] {
        let told = optimized(&setup, &passes(5), &wear(growth));
        println!("growth {growth}: {:.4?}, before {:.3}, {:.1} s", told.worst, told.before[0], told.time_s);
        assert!(told.worst.iter().all(|ratio| (0.98..=1.01).contains(ratio)), "growth {growth}: {:?}", told.worst);
    }
}

/// A slot of so many mm, as wide as the tool, 2 mm deep, in one direction along X.
fn slot(length_mm: f64) -> (String, String) {
    let program = format!("G21 G90 G94\nT1 M6\nS6000 M3\nG0 X-10 Y0 Z5\nG0 Z-2\nG1 X{length_mm:.3} F600\nG0 Z5\nM30\n");
    let stock = format!("box = {{ min = [0, -20, -20], max = [{:.3}, 20, 0] }}", length_mm + 20.0);
    (program, stock)
}

/// In a slot the mean power is P₀ + n N a_p (R π k_te κ + 2 R k_tc f) with κ = 1 + g S, f per tooth, and each tooth slides πR in a
/// revolution: with u = L − P₀ − E κ, E = n N a_p R π k_te, K = 2 n a_p R k_tc·(1/1) per unit of N f, it is
/// u² = u₀² − 2 E g α K x (`schedule/wear.rs`), where v = u / K and α = π R n.
#[test]
fn a_slot_is_written_up_to_the_length_at_which_no_feed_helps_and_refused_beyond() {
    let (n, teeth, depth, radius) = (100.0, 2.0, 2.0, 5.0);
    let (k_tc, k_te) = (800.0, 20.0);
    let (growth_per_mm, limit_w, tare_w) = (3.0e-5, 400.0, 100.0);
    let edge_w = 1e-3 * n * teeth * depth * radius * std::f64::consts::PI * k_te;
    // Power per feed in mm/s: k_tc times the volume removed in a second.
    let per_feed = 1e-3 * k_tc * depth * 2.0 * radius;
    let way_per_s = std::f64::consts::PI * radius * n;
    let reserve = limit_w - tare_w - edge_w;
    let furthest_mm = reserve * reserve / (2.0 * edge_w * growth_per_mm * way_per_s * per_feed);
    println!("edge {edge_w:.1} W, feed at first {:.1} mm/s, furthest {furthest_mm:.0} mm", reserve / per_feed);
    let told = |length_mm: f64| {
        let folder = tempfile::tempdir().unwrap();
        let (program, stock) = slot(length_mm);
        let setup = setup(EDGES, &format!("power = {limit_w}"));
        let setup = setup.replace("box = { min = [0, 0, -20], max = [100, 60, 0] }", &stock);
        fs::write(folder.path().join("part.nc"), program).unwrap();
        fs::write(folder.path().join("part.setup.toml"), setup).unwrap();
        fs::write(folder.path().join("model.toml"), wear(1e5 * growth_per_mm)).unwrap();
        let (code, said) = run(folder.path(), &["optimize", "part.nc", "--model", "model.toml", "-o", "out.nc"]);
        (code, said, folder.path().join("out.nc").exists())
    };
    let (code, said, written) = told(0.8 * furthest_mm);
    assert!(code == 0 && written, "{said}");
    let (code, said, written) = told(1.05 * furthest_mm);
    assert!(code == 1 && !written, "{said}");
    assert!(
        said.contains("slower feeds wear this tool faster than they unload it") && said.contains("line 6"),
        "{said}"
    );
}
