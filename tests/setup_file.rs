//! The setup file: real ones load, units convert, and what makes no sense is refused with its place and a remedy.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use feedwright::force::Loads;
use feedwright::machine::limits::Role;
use feedwright::machine::{Job, LimitKind, Mode, Segment, StockShape};
use feedwright::nc;
use feedwright::setup::{self, SetupError};
use std::path::Path;

fn load(text: &str) -> Result<Job, SetupError> {
    setup::load(text, Path::new(".")).map(|(job, _)| job)
}

const SMALL: &str = r#"
[stock]
box = { min = [0, 0, -20], max = [100, 60, 0] }
[material]
k_tc = 842
k_te = 15
[[tool]]
number = 1
shape = "flat"
diameter = 10
flutes = 4
"#;

/// Every limit on a load is a key of the setup in the unit of the report, is in force then, and bounds a load that is predicted.
#[test]
fn every_limit_on_a_load_is_a_key_and_a_load() {
    let mut tried = 0;
    for kind in LimitKind::ALL {
        let is_load = matches!(kind.row().role, Role::Load { .. });
        assert_eq!(Loads::default().bounded_by(kind).is_some(), is_load, "{}", kind.name());
        if is_load || kind.row().role == Role::Rate {
            let job = load(&format!("{SMALL}[limits]\n{} = {{ max = 1.5 }}\n", kind.name())).unwrap();
            let value = job.limits.value(kind).unwrap_or_else(|| panic!("{} is not taken", kind.name()));
            assert!((kind.in_report_unit(value) - 1.5).abs() < 1e-12, "{}", kind.name());
            let loads: Vec<LimitKind> = job.limits.loads().into_iter().map(|(kind, _)| kind).collect();
            assert_eq!(loads, if is_load { vec![kind] } else { vec![] });
            tried += 1;
        }
    }
    assert!(tried >= 11, "only {tried} limits were tried");
}

const FULL: &str = r#"
units = "inch"
[machine]
dialect = "haas"
rapid = "15 m/min"
corner_tolerance = 0.0008
home = [0, 0, 8]
compensation = "wear"
max_line_length = 256
[machine.axes]
x = { velocity = 600, acceleration = "1.5 m/s2", jerk = "20000 mm/s3" }
[machine.spindle]
max_rpm = 12000
power = [[0, 0], [1500, "10 hp"], [12000, 7500]]
tare = [[1000, 120], [12000, 480]]
efficiency = [[100, 0.8], [1000, 0.92]]
[offsets]
G55 = [8, 0, "10 mm"]
[[stock]]
box = { min = [0, 0, -1], max = [4, 2, 0] }
[[stock]]
cylinder = { center = [0, 0], diameter = 2, z = [-1, 0] }
offset = "G55"
uncertainty = 0.02
[[fixture]]
box = { min = [-1, -1, -1], max = [0, 3, 0.2] }
[material]
k_tc = 842
k_rc = 300
k_ac = 150
k_te = 15
k_re = 12
k_ae = 2
[[tool]]
number = 3
shape = "bull"
diameter = "3/4 in"
corner_radius = 0.125
flutes = 4
pitch = [88, 92, 88, 92]
runout = { offset = 0.0002, angle = 95 }
holder = [[1.25, 1.5], [2, 1.2]]
limits = { force_xy = "90 lbf" }
[limits]
force_xy = "110 lbf"
torque = "35 ft lbf"
power = "6 hp"
deflection = 0.001
chip_thickness = { min = 0.0004, max = 0.006 }
feed = { min = 4, max = "600 in/min" }
feed_per_tooth = { max = 0.004 }
feed_change = { min = "20 %", max = 2.0 }
air_feed = 240
approach = 0.1
[[operation]]
match = { tool = 3, comment = "FINISH", lines = [120, 180], surface = "final" }
mode = "slow-only"
entry = { feed = 12, distance = 0.1 }
direction_change = { angle = 45, feed = 12, distance = 0.1 }
limits = { force_normal_mean = 80 }
[output]
minimum_change = 0.05
minimum_length = 0.02
split = false
annotate = "full"
exclude = [[120, 180]]
"#;

#[test]
fn every_key_arrives_in_internal_units() {
    let job = load(FULL).unwrap();
    assert!((job.machine.rapid_mm_s - 250.0).abs() < 1e-9);
    assert!((job.machine.axes[0].velocity_mm_s - 254.0).abs() < 1e-9);
    assert!((job.machine.axes[0].acceleration_mm_s2 - 1500.0).abs() < 1e-9);
    assert!((job.machine.axes[0].jerk_mm_s3.unwrap() - 20000.0).abs() < 1e-9);
    assert!((job.machine.spindle.power_w.as_ref().unwrap().at(25.0) - 7457.0).abs() < 0.1);
    assert_eq!(job.machine.offsets[0].0, 55);
    assert!((job.machine.offsets[0].1 - feedwright::path::Vec3::new(203.2, 0.0, 10.0)).norm() < 1e-9);
    assert_eq!(job.stocks[1].offset, Some(55));
    assert!(
        matches!(job.stocks[1].shape, StockShape::Cylinder { diameter_mm, .. } if (diameter_mm - 50.8).abs() < 1e-9)
    );
    let tool = job.tool(3).unwrap();
    assert!((tool.diameter_mm - 19.05).abs() < 1e-9);
    assert!((tool.limits.force_xy_n.unwrap() - 400.34).abs() < 0.01);
    assert!(matches!(tool.profile.segments[1], Segment::Arc { radius, .. } if (radius - 3.175).abs() < 1e-9));
    assert!((tool.pitch_rad.iter().sum::<f64>() - std::f64::consts::TAU).abs() < 1e-9);
    assert!((job.limits.force_xy_n.unwrap() - 489.3).abs() < 0.01);
    assert!((job.limits.torque_nmm.unwrap() - 47453.7).abs() < 0.1);
    assert!((job.limits.feed_max_mm_s.unwrap() - 254.0).abs() < 1e-9);
    assert_eq!(job.limits.feed_change_min, Some(0.2));
    assert!((job.air_feed.unwrap().approach_mm - 2.54).abs() < 1e-9);
    assert_eq!(job.operations[0].mode, Mode::SlowOnly);
    assert_eq!(job.operations[0].matches.lines, Some((120, 180)));
    assert!(!job.output.split && job.output.exclude == [(120, 180)]);
}

/// A tool without a flute length has flutes of three diameters, but none longer than it reaches out of its holder.
#[test]
fn flutes_that_are_not_given_end_at_the_holder() {
    for (overhang, expected_mm) in [(60, 30.0), (25, 25.0)] {
        let text = SMALL.replace("flutes = 4", &format!("flutes = 4\noverhang = {overhang}"));
        let (job, assumptions) = setup::load(&text, Path::new(".")).unwrap();
        assert_eq!(job.tools[0].flute_length_mm, expected_mm);
        assert!(assumptions.iter().any(|assumed| assumed.key == "tool[T1].flute_length"));
    }
}

#[test]
fn every_default_is_listed_and_only_defaults() {
    let (_, assumptions) = setup::load(SMALL, Path::new(".")).unwrap();
    let keys: Vec<_> = assumptions.iter().map(|a| a.key.as_str()).collect();
    for key in [
        "machine",
        "machine.rapid",
        "limits.feed_change.max",
        "tool[T1].overhang",
        "stock.uncertainty",
        "material.k_rc",
    ] {
        assert!(keys.contains(&key), "{key} is assumed but not listed: {keys:?}");
    }
    assert!(!keys.contains(&"material.k_tc") && !keys.contains(&"tool[T1].diameter"));
}

/// Text to replace in [`SMALL`], what to put there, and what the message must say.
const WRONG: &[(&str, &str, &str)] = &[
    ("flutes = 4", "flutes = 0", "teeth"),
    ("flutes = 4", "", "flutes"),
    ("flutes = 4", "flutes = 4\nhelix = 90", "80 deg"),
    ("flutes = 4", "flutes = 4\nhelx = 30", "did you mean `helix`"),
    ("flutes = 4", "flutes = 4\noverhang = 3\nflute_length = 20", "overhang"),
    ("flutes = 4", "flutes = 4\ncorner_radius = 2", "bull"),
    ("flutes = 4", "flutes = 4\npitch = [90, 90]", "360"),
    ("diameter = 10", "diameter = -10", "diameter"),
    ("diameter = 10", "diameter = nan", "finite"),
    ("diameter = 10", "diameter = 2000", "2 m"),
    ("diameter = 10", "diameter = \"10 hp\"", "hp"),
    ("shape = \"flat\"", "shape = \"flatt\"", "did you mean `flat`"),
    ("shape = \"flat\"", "shape = \"bull\"", "corner_radius"),
    ("k_tc = 842", "k_tc = -842", "k_tc"),
    ("k_tc = 842", "k_ct = 842", "k_tc"),
    ("k_te = 15", "k_te = inf", "finite"),
    ("k_tc = 842", "k_tc = 8e8", "between 0 and 50000"),
    ("k_tc = 842", "model = \"kienzle\"\nk_c11 = 842", "material.m_c"),
    ("flutes = 4", "flutes = 4\nrunout = 0.02", "offset = "),
    ("min = [0, 0, -20], max = [100, 60, 0]", "min = [0, 0, 0], max = [100, 60, -20]", "volume"),
    ("[material]", "[limits]\npower = nan\n[material]", "finite"),
    ("[material]", "[limits]\npower = 0\n[material]", "more than zero"),
    ("[material]", "[limits]\nfroce_xy = 3\n[material]", "did you mean `force_xy`"),
    ("[material]", "[limits]\nfeed = { min = 500, max = 100 }\n[material]", "minimum"),
    ("[material]", "[machine]\ncorner_tolerance = 0\n[material]", "0.005"),
    ("[material]", "[machine]\ndialect = \"fanuk\"\n[material]", "fanuc"),
    ("[material]", "[machine]\nmax_repeated_mb = 0\n[material]", "between 1 and 4096"),
    ("[material]", "[machine]\nmax_call_depth = 1001\n[material]", "between 1 and 1000"),
    ("[material]", "[machine.axes]\nx = { acceleration = 0 }\n[material]", "acceleration"),
    ("[material]", "[machine.spindle]\npower = [[1500, 100], [0, 0]]\n[material]", "rise"),
    ("[material]", "[offsets]\nG95 = [0, 0, 0]\n[material]", "G54"),
    ("[material]", "[[operation]]\nmode = \"keep\"\n[material]", "match"),
    ("[material]", "[output]\nexclude = [[20, 10]]\n[material]", "lines"),
    ("[stock]", "units = \"metric\"\n[stock]", "inch"),
    ("[stock]", "[stock]\nstl = \"part.stl\"", "exactly one"),
    ("[stock]", "[stock", "unclosed table"),
];

#[test]
fn nonsense_is_refused_with_its_place_and_a_remedy() {
    load(SMALL).expect("the setup the wrong ones are made from is right");
    for (old, new, must_say) in WRONG {
        let text = SMALL.replacen(old, new, 1);
        assert_ne!(text, SMALL);
        let error = load(&text).expect_err(new);
        let said: String = error.diagnostics().iter().map(|d| format!("{} ({})\n", d.text, d.help)).collect();
        assert!(said.contains(must_say), "{new:?}: {said}");
        let placed = error.diagnostics().iter().any(|d| d.line.is_some());
        assert!(placed, "{new:?} has no place: {said}");
    }
}

/// A loop of 40,000 passes over 42 bytes of text with 4 blocks of 32 each is 6.8 MB; nine subprograms that call the next are nine deep.
#[test]
fn how_much_may_be_repeated_is_a_setting() {
    let looped = "G21 G90\n#1 = 40000\nWHILE [#1 GT 0] DO1\n#1 = #1 - 1\nG1 X#1 F100\nEND1\nM30\n";
    let subs: String = (1..9).map(|k| format!("O{k}\nM98 P{}\nM99\n", k + 1)).collect();
    let nested = format!("G21 G90\nM98 P1\nM30\n{subs}O9\nG1 X1 F100\nM99\n");
    for (program, setting, few, enough) in
        [(looped, "max_repeated_mb", 6, 8), (nested.as_str(), "max_call_depth", 8, 9)]
    {
        let ends = |value: u32| {
            let setup = SMALL.replacen("[material]", &format!("[machine]\n{setting} = {value}\n[material]"), 1);
            let job = load(&setup).unwrap();
            let program = nc::parse(program.into(), Some(nc::Dialect::Fanuc));
            let path = nc::interpret(&program, &nc::Environment::from_job(&job));
            path.diagnostics.iter().all(|said| {
                assert!(said.code != "nc::runaway" || said.help.contains(setting), "{}", said.help);
                said.code != "nc::runaway"
            })
        };
        assert!(ends(enough) && !ends(few), "{setting}");
    }
}

#[test]
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn setups_of_the_shared_programs_load() {
    let dir = Path::new("../shared/programs/setups");
    let mut names: Vec<_> = std::fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path()).collect();
    names.sort();
    assert!(names.len() >= 6);
    for path in names {
        let text = std::fs::read_to_string(&path).unwrap();
        let (job, _) = setup::load(&text, dir).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert!(!job.tools.is_empty() && job.stocks.len() == 1, "{}", path.display());
    }
}

#[test]
fn every_limit_is_a_number_or_a_table_with_its_largest() {
    let names = [
        "force_xy",
        "force_normal_mean",
        "force_axial",
        "power",
        "torque",
        "deflection",
        "surface_error",
        "bending_stress",
        "force_rate",
        "chip_thickness",
        "feed",
        "feed_per_tooth",
        "feed_change",
    ];
    let limits = |value: &str| {
        let lines: Vec<String> = names.iter().map(|name| format!("{name} = {value}")).collect();
        load(&format!("{SMALL}\n[limits]\n{}\n", lines.join("\n"))).map(|job| job.limits)
    };
    let bare = limits("2").unwrap();
    assert_eq!(bare, limits("{ max = 2 }").unwrap());
    assert!(bare.force_xy_n == Some(2.0) && bare.deflection_mm == Some(2.0) && bare.feed_per_tooth_max_mm == Some(2.0));
    assert!(
        bare.chip_thickness_max_mm == Some(2.0) && bare.feed_change_max == Some(2.0) && bare.feed_max_mm_s.is_some()
    );
    // A smallest value only where it has a meaning.
    for (name, fits) in [
        ("feed", true),
        ("chip_thickness", true),
        ("feed_change", true),
        ("force_xy", false),
        ("feed_per_tooth", false),
    ] {
        let found = load(&format!("{SMALL}\n[limits]\n{name} = {{ min = 1, max = 2 }}\n"));
        assert_eq!(found.is_ok(), fits, "{name}");
        assert!(fits || format!("{:?}", found.unwrap_err()).contains("no smallest"), "{name}");
    }
    assert!(limits("{}").is_err() && limits("{ most = 2 }").is_err() && limits("[1, 2]").is_err());
}

#[test]
fn checked_in_schema_is_the_one_of_the_code() {
    let path = "src/setup/schema.json";
    let written = std::fs::read_to_string(path).unwrap_or_default();
    assert!(written == setup::schema(), "{path} is old: `cargo run -- schema > {path}` writes it anew");
}
