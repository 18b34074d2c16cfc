//! One verdict: exit code, first line, tables, JSON, CSV and HTML of a run say the same, also of programs where they used to
//! contradict each other.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Two passes along a block, the second (lines 8 and 9) three times as deep.
const PROGRAM: &str = "%
G21 G90 G17
T1 M6
S8000 M3
G0 X-10 Y5 Z5
G1 Z-1 F300
X50 F900
G0 Z5
G0 X-10 Y5
G1 Z-4 F300
X50 F900
G0 Z20
M30
%
";
const SETUP: &str = r#"
resolution = 0.5
[machine]
dialect = "linuxcnc"
[stock]
box = { min = [0, 0, -10], max = [40, 20, 0] }
[material]
k_tc = 800
k_te = 14
[[tool]]
number = 1
shape = "flat"
diameter = 6
flutes = 3
flute_length = 20
[limits]
force_xy = 80
power = 2000
"#;

/// What one run shows on every surface.
struct Shown {
    dir: TempDir,
    code: i32,
    screen: String,
    said: String,
    json: Value,
    csv: Vec<(f64, f64, String)>,
    html: String,
}

fn shown(program: &str, setup: &str, arguments: &[&str]) -> Shown {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("part.nc"), program).unwrap();
    fs::write(dir.path().join("part.setup.toml"), setup).unwrap();
    let mut command = Command::cargo_bin("feedwright").unwrap();
    let reports = ["part.nc", "--json", "r.json", "--csv", "r.csv", "--report", "r.html"];
    let done = command.current_dir(dir.path()).args(arguments).args(reports).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let read =
        |name: &str| fs::read_to_string(dir.path().join(name)).unwrap_or_else(|_| panic!("{}", text(&done.stderr)));
    let mut table = csv::Reader::from_reader(read("r.csv").into_bytes().leak() as &[u8]);
    let head = table.headers().unwrap().clone();
    let column = |name: &str| head.iter().position(|known| known == name).unwrap();
    let [before, after, apart] = ["load_ratio_before", "load_ratio_after", "apart"].map(column);
    let row =
        |row: csv::StringRecord| (row[before].parse().unwrap(), row[after].parse().unwrap(), row[apart].to_owned());
    Shown {
        code: done.status.code().unwrap(),
        screen: text(&done.stdout),
        said: text(&done.stderr),
        json: serde_json::from_str(&read("r.json")).unwrap(),
        csv: table.records().map(|record| row(record.unwrap())).collect(),
        html: read("r.html"),
        dir,
    }
}

fn optimized(program: &str, setup: &str) -> Shown {
    shown(program, setup, &["optimize"])
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

impl Shown {
    fn faults(&self) -> Vec<&str> {
        self.json["verdict"]["faults"].as_array().unwrap().iter().map(|fault| fault["kind"].as_str().unwrap()).collect()
    }
    fn worst(&self) -> f64 {
        number(&self.json["verdict"]["worst"]["ratio"])
    }
    fn headline(&self) -> &str {
        self.json["verdict"]["headline"].as_str().unwrap()
    }
    fn is_written(&self) -> bool {
        self.dir.path().join("part.fw.nc").exists()
    }
    fn said_of_limits(&self) -> impl Iterator<Item = &Value> {
        self.json["limits"].as_array().unwrap().iter().filter(|limit| !limit["after_ratio"].is_null())
    }

    /// Every surface against every other.
    fn agree(&self) {
        let verdict = &self.json["verdict"];
        let headline = verdict["headline"].as_str().unwrap();
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words(&self.screen).starts_with(&words(headline)), "{headline}\n{}", self.screen);
        let plain = self.html.replace("&gt;", ">").replace("&lt;", "<").replace("&amp;", "&");
        let class = if self.code == 0 { "good" } else { "bad" };
        assert!(plain.contains(&format!("<p class=\"{class}\">{headline}</p>")), "{headline}\n{plain}");
        assert_eq!(number(&verdict["exit_code"]) as i32, self.code, "{headline}");
        assert_eq!(verdict["outcome"] == "done", self.code == 0);
        assert_eq!(self.faults().is_empty(), self.code == 0, "{headline}");
        // The largest of the table is the largest of the verdict and of the check, and its percentage is on the screen.
        let largest = self.said_of_limits().map(|limit| number(&limit["after_ratio"])).fold(0.0, f64::max);
        assert!((largest - self.worst()).abs() < 1e-12, "{largest} {}", self.worst());
        if self.json["check"].is_object() {
            assert!((number(&self.json["check"]["resimulated_worst_ratio"]) - largest).abs() < 1e-12);
            assert!(self.screen.contains(&format!("largest load {largest:.3} of its limit")), "{}", self.screen);
            assert!(largest <= 1.01 || self.code != 0, "{largest} with exit 0");
        }
        let percent = format!("{:.0} %", 100.0 * largest);
        assert!(self.screen.contains(&percent), "{percent}\n{}", self.screen);
        for limit in self.said_of_limits() {
            let ratio = number(&limit["after_max"]) / number(&limit["limit"]);
            assert!((ratio - number(&limit["after_ratio"])).abs() < 1e-9, "{limit}");
            assert!(limit["after_p99"].is_null() || number(&limit["after_p99"]) <= number(&limit["after_max"]));
        }
        assert_eq!(self.html.contains("<td class=\"bad\">"), self.beyond_anywhere(), "{plain}");
        // The table of stations has its own stations: the same loads, not to the last digit.
        let highest = self.csv.iter().map(|(_, after, _)| *after).fold(0.0, f64::max);
        assert!((highest / largest - 1.0).abs() < 0.03, "{highest} in the table, {largest} in the verdict");
        let wide: Vec<&str> = self.screen.lines().filter(|line| line.chars().count() > 100).collect();
        assert!(wide.is_empty(), "{wide:?}");
    }

    /// Is any load, before or after, beyond its limit?
    fn beyond_anywhere(&self) -> bool {
        let both = |limit: &Value| [number(&limit["before_ratio"]), number(&limit["after_ratio"])];
        self.said_of_limits().flat_map(both).any(|ratio| ratio > 1.01)
    }
}

#[test]
fn a_program_within_its_limits() {
    let found = optimized(PROGRAM, SETUP);
    found.agree();
    assert_eq!((found.code, found.is_written()), (0, true), "{}", found.said);
    assert!(found.worst() > 0.9 && found.worst() <= 1.01, "{}", found.worst());
    assert!(found.screen.starts_with("every limit is met: largest load "), "{}", found.screen);
}

#[test]
fn a_frozen_block_above_its_limit_is_a_fault_and_is_written() {
    for frozen in ["[output]\nexclude = [[11, 11]]\n", "[[operation]]\nmatch = { lines = [11, 11] }\nmode = \"keep\"\n"]
    {
        let found = optimized(PROGRAM, &format!("{SETUP}{frozen}"));
        found.agree();
        assert_eq!((found.code, found.is_written()), (1, true), "{frozen}{}", found.said);
        assert_eq!(found.faults(), ["frozen"], "{frozen}");
        assert!(found.worst() > 1.5, "{}", found.worst());
        assert!(number(&found.json["check"]["free_worst_ratio"]) <= 1.01);
        assert_eq!(found.json["verdict"]["worst"]["apart"], "frozen");
        assert_eq!(found.json["verdict"]["faults"][0]["lines"], serde_json::json!([11]));
        assert!(found.csv.iter().any(|(_, after, apart)| *after > 1.5 && apart == "frozen"));
        let first = found.screen.lines().next().unwrap();
        assert!(first.contains("keep the programmed feed") && first.contains("line 11"), "{first}");
    }
}

#[test]
fn a_limit_that_cannot_be_met_is_in_the_worst_ratio() {
    // Line 7 meets the limit; on line 11 the edges alone take more than that, whatever the feed is.
    let tight = SETUP.replace("force_xy = 80", "force_xy = 40");
    let short = PROGRAM.replace("G1 Z-4 F300\nX50 F900", "G1 Z-4 F300\nX2 F900");
    for (program, fault) in [(PROGRAM, "hopeless"), (&short, "infeasible")] {
        let found = optimized(program, &tight);
        found.agree();
        assert_eq!((found.code, found.faults()), (1, vec![fault]), "{}", found.screen);
        assert_eq!(found.is_written(), fault == "infeasible");
        assert_eq!(found.json["verdict"]["worst"]["apart"], "infeasible", "{}", found.screen);
        assert!(found.worst() > 1.01 && number(&found.json["check"]["free_worst_ratio"]) <= 1.01);
        assert!(!found.json["infeasible"].as_array().unwrap().is_empty());
    }
}

#[test]
fn everything_apart_is_no_load_of_zero() {
    // Every cut is kept: nothing was free to be chosen, and the largest load is still told.
    let keep = "[[operation]]\nmatch = { tool = 1 }\nmode = \"keep\"\n";
    let found = optimized(PROGRAM, &format!("{SETUP}{keep}"));
    found.agree();
    assert_eq!((found.code, found.faults()), (1, vec!["frozen"]));
    assert!(found.worst() > 1.5 && number(&found.json["check"]["free_worst_ratio"]) == 0.0);
}

#[test]
fn a_collision_is_a_fault_and_nothing_is_written() {
    let rapid = PROGRAM.replace("G1 Z-4 F300\nX50 F900", "G1 Z-4 F300\nG0 X50");
    let short = SETUP.replace("flute_length = 20", "flute_length = 2\noverhang = 30");
    let holder = SETUP.replace("flute_length = 20", "flute_length = 3.5\noverhang = 3.5\nholder = [[30, 40]]");
    let fixture = format!("{SETUP}[[fixture]]\nbox = {{ min = [45, 0, -10], max = [60, 20, 0] }}\n");
    for (program, setup, kind) in [
        (rapid.as_str(), SETUP, "cut-at-rapid"),
        (PROGRAM, short.as_str(), "shank"),
        (PROGRAM, holder.as_str(), "holder"),
        (PROGRAM, fixture.as_str(), "fixture"),
    ] {
        let found = optimized(program, setup);
        found.agree();
        assert_eq!((found.code, found.is_written()), (1, false), "{kind}: {}", found.said);
        assert!(found.faults().contains(&kind), "{kind}: {:?}", found.faults());
        assert!(found.screen.starts_with("collision: "), "{kind}: {}", found.screen);
        assert!(found.said.contains("--accept-collisions") && found.said.contains("error[engage::"), "{}", found.said);
        let accepted = shown(program, setup, &["optimize", "--accept-collisions"]);
        accepted.agree();
        assert_eq!((accepted.code, accepted.is_written()), (1, true), "{kind}");
        let simulated = shown(program, setup, &["simulate"]);
        simulated.agree();
        assert_eq!(simulated.code, 1, "{kind}");
    }
}

#[test]
fn a_spindle_at_rest_is_a_fault() {
    let found = optimized(&PROGRAM.replace("S8000 M3\n", ""), SETUP);
    assert_eq!(found.code, 1, "{}", found.screen);
    assert!(found.faults().contains(&"spindle-stopped"), "{:?}", found.faults());
    assert!(found.screen.contains("the spindle stands still"), "{}", found.screen);
}

#[test]
fn a_simulation_says_what_is_beyond_a_limit_and_changes_nothing() {
    let found = shown(PROGRAM, SETUP, &["simulate"]);
    found.agree();
    assert_eq!(found.code, 0, "{}", found.said);
    assert!(found.worst() > 1.5, "{}", found.worst());
    assert!(found.screen.starts_with("as programmed 1 line beyond a limit: largest load "), "{}", found.screen);
    assert!(!found.is_written());
}

#[test]
fn the_spindles_curve_stands_in_the_table_like_a_limit() {
    let weak = SETUP
        .replace("power = 2000\n", "")
        .replace("[stock]", "[machine.spindle]\npower = [[0, 0], [8000, 100], [12000, 100]]\n[stock]");
    let found = shown(PROGRAM, &weak, &["simulate"]);
    found.agree();
    let curve: Vec<&Value> = found.said_of_limits().filter(|limit| limit["of_spindle"] == true).collect();
    assert_eq!(curve.len(), 1, "{}", found.json["limits"]);
    assert_eq!((curve[0]["name"].as_str(), curve[0]["limit"].as_f64()), (Some("power"), Some(100.0)));
    assert!(found.screen.contains("spindle power, all there is"), "{}", found.screen);
}

fn verified(dir: &Path, arguments: &[&str]) -> (i32, String, Value) {
    let mut command = Command::cargo_bin("feedwright").unwrap();
    command.current_dir(dir).args(["verify", "a.nc", "b.nc", "--json", "v.json"]).args(arguments);
    let done = command.output().unwrap();
    let json = serde_json::from_slice(&fs::read(dir.join("v.json")).unwrap()).unwrap();
    (done.status.code().unwrap(), String::from_utf8_lossy(&done.stdout).into_owned(), json)
}

fn pair(original: &str, rewritten: &str) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a.nc"), original).unwrap();
    fs::write(dir.path().join("b.nc"), rewritten).unwrap();
    dir
}

#[test]
fn verify_shows_both_texts_and_counts_the_rest() {
    let dir = pair("G21\nG1 X0 F500\nG1 Z-20.\nM30\n", "G21\nG1 X0 F500\nG1 Z-21.\nM30\n");
    let (code, text, json) = verified(dir.path(), &[]);
    assert_eq!(code, 1);
    assert!(text.contains("G1 Z-20.  →  G1 Z-21."), "{text}");
    assert_eq!(json["differences"][0]["original_text"], "G1 Z-20.");
    assert_eq!(json["differences"][0]["rewritten_text"], "G1 Z-21.");
    let lines = |shift: f64| (0..250).map(|i| format!("G1 X{:.3}\n", f64::from(i) + shift)).collect::<String>();
    let dir = pair(&format!("G21 F500\n{}", lines(0.0)), &format!("G21 F500\n{}", lines(0.5)));
    let (code, text, json) = verified(dir.path(), &[]);
    let listed = json["differences"].as_array().unwrap().len();
    assert_eq!(code, 1);
    assert!((24..=48).contains(&listed) && text.lines().count() == 2 + 2 * listed, "{text}");
    assert!(text.ends_with(&format!("… and {} more\n", 250 - listed)), "{text}");
    assert_eq!(json["more_differences"], 250 - listed);
}

#[test]
fn verify_knows_the_largest_rise_and_holds_it_against_a_limit() {
    let original = "G21\nG1 X10 F500\nG1 X20 F600\nG1 X30\nM30\n";
    let dir = pair(original, "G21\nG1 X10 F400\nG1 X20 F780\nG1 X30 F720\nM30\n");
    let (code, text, json) = verified(dir.path(), &[]);
    assert_eq!((code, json["lines_beyond_max_rise"].as_u64()), (0, Some(0)), "{text}");
    assert!(text.contains("largest rise of a feed: 1.300 times, line 3 → line 3: F600 → F780 mm/min"), "{text}");
    let rise = &json["largest_rise"];
    assert_eq!((rise["original_line"].as_u64(), rise["feed_before"].as_f64().unwrap().round()), (Some(3), 600.0));
    // On the limit is no fault, a little beyond is one.
    assert_eq!(verified(dir.path(), &["--max-rise", "1.3"]).0, 0);
    let (code, text, json) = verified(dir.path(), &["--max-rise", "1.29"]);
    assert_eq!((code, json["lines_beyond_max_rise"].as_u64()), (1, Some(1)), "{text}");
    assert!(text.starts_with("feeds rise by more than --max-rise 1.29 allows, on 1 line\n"), "{text}");
    assert_eq!(json["identical"], true);
    let (_, _, json) = verified(pair(original, original).path(), &["--max-rise", "1"]);
    assert!(json["largest_rise"].is_null());
}

/// Codes of the warnings of a simulation.
fn codes(program: &str, setup: &str) -> Vec<String> {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("part.nc"), program).unwrap();
    fs::write(dir.path().join("part.setup.toml"), setup).unwrap();
    let mut command = Command::cargo_bin("feedwright").unwrap();
    let done = command.current_dir(dir.path()).args(["simulate", "part.nc", "--json", "r.json"]).output().unwrap();
    let read = fs::read(dir.path().join("r.json"));
    let json: Value = serde_json::from_slice(&read.unwrap_or_else(|_| panic!("{done:?}"))).unwrap();
    json["warnings"].as_array().unwrap().iter().map(|warning| warning["code"].as_str().unwrap().to_owned()).collect()
}

/// Once around the block.
const AROUND: &str = "G21 G90 G17
T1 M6
S8000 M3
G0 X-2 Y-2 Z5
G1 Z-2 F300
X42 F900
Y22
X-2
Y-2
G0 Z20
M30
";

#[track_caller]
fn told(code: &str, [program, setup]: [&str; 2], [other_program, other_setup]: [&str; 2]) {
    let (here, there) = (codes(program, setup), codes(other_program, other_setup));
    assert!(here.iter().any(|known| known == code), "{code} is not among {here:?}");
    assert!(there.iter().all(|known| known != code), "{code} is said of what is right");
}

#[test]
fn units_that_were_mixed_up_are_said() {
    let inch = AROUND.replace("G21", "G20").replace("F300", "F10").replace("F900", "F30");
    told("plausible::units", [&inch, SETUP], [AROUND, SETUP]);
    // Ten times as far is a long way in the air, not another unit.
    let far = AROUND.replace("X42", "X420").replace("Y22", "Y220");
    assert!(!codes(&far, SETUP).contains(&"plausible::units".to_owned()));
    let plate = |height: &str| {
        let shape = format!("box = {{ min = [0, 0, -{height}], max = [1016, 508, 0] }}");
        SETUP
            .replace("box = { min = [0, 0, -10], max = [40, 20, 0] }", &shape)
            .replace("resolution = 0.5", "resolution = 2")
    };
    told("plausible::units", [AROUND, &plate("254")], [AROUND, &plate("20")]);
}

#[test]
fn a_feed_per_tooth_that_no_mill_cuts_with_is_said() {
    // 6 mm, 3 flutes, 200 rev/min: 1.5 mm a tooth at F900.
    let slow = |feed: &str| AROUND.replace("S8000", "S200").replace("F900", feed);
    told("plausible::feed-per-tooth", [&slow("F920"), SETUP], [&slow("F880"), SETUP]);
}

#[test]
fn a_stock_of_cubic_metres_is_said() {
    let of = |height: &str| {
        let shape = format!("box = {{ min = [0, 0, -{height}], max = [1000, 1000, 0] }}");
        SETUP
            .replace("box = { min = [0, 0, -10], max = [40, 20, 0] }", &shape)
            .replace("resolution = 0.5", "resolution = 2")
    };
    told("plausible::stock-size", [AROUND, &of("1010")], [AROUND, &of("990")]);
}

#[test]
fn a_coefficient_ten_times_that_of_any_metal_is_said() {
    let of = |k_tc: &str| SETUP.replace("k_tc = 800", k_tc);
    told("plausible::coefficient", [AROUND, &of("k_tc = 20100")], [AROUND, &of("k_tc = 19900")]);
    told("plausible::coefficient", [AROUND, &of("k_tc = 54")], [AROUND, &of("k_tc = 56")]);
    let own = |k_tc: &str| {
        SETUP.replace("flutes = 3\n", &format!("flutes = 3\ncoefficients = {{ k_tc = {k_tc}, k_te = 14 }}\n"))
    };
    told("plausible::coefficient", [AROUND, &own("8100")], [AROUND, &own("7900")]);
}

#[test]
fn a_power_limit_below_what_the_spindle_takes_in_air_is_said() {
    let spindle = "[machine.spindle]\ntare = [[0, 0], [8000, 500], [12000, 500]]\n[stock]";
    let of = |limit: &str| SETUP.replace("[stock]", spindle).replace("power = 2000", limit);
    told("plausible::limit-below-tare", [AROUND, &of("power = 499")], [AROUND, &of("power = 501")]);
}

#[test]
fn a_tool_that_never_cuts_is_said() {
    let setup = SETUP.replace("[limits]", "[[tool]]\nnumber = 2\nshape = \"flat\"\ndiameter = 4\nflutes = 2\n[limits]");
    let second =
        |depth: &str| AROUND.replace("M30", &format!("T2 M6\nS8000 M3\nG0 X10 Y10\nG1 Z{depth} F200\nG0 Z20\nM30"));
    told("plausible::idle-tool", [&second("1"), &setup], [&second("-1"), &setup]);
}

#[test]
fn a_program_that_does_not_meet_its_stock_raises_nothing_and_is_not_written() {
    let setup = SETUP.replace("power = 2000", "power = 2000\nair_feed = 6000");
    let beside = |cut: &str| {
        format!("G21 G90 G17\nT1 M6\nS8000 M3\nG0 X45 Y10 Z5\nG1 Z-2 F300\nX{cut} F900\nX45\nX1045\nG0 Z20\nM30\n")
    };
    let away = setup
        .replace("box = { min = [0, 0, -10], max = [40, 20, 0] }", "box = { min = [0, 900, -10], max = [40, 920, 0] }");
    for (program, setup) in [(beside("31"), &setup), (beside("-3"), &away)] {
        let found = shown(&program, setup, &["optimize", "--json-blocks"]);
        assert_eq!((found.code, found.faults(), found.is_written()), (1, vec!["no-meeting"], false), "{}", found.said);
        assert!(found.screen.starts_with("stock and program do not meet"), "{}", found.screen);
        for block in found.json["blocks"].as_array().unwrap() {
            assert!(number(&block["feed_after"]) <= number(&block["feed_before"]) * (1.0 + 1e-9), "{block}");
        }
        // No option helps: what was predicted holds nowhere.
        assert!(!shown(&program, setup, &["optimize", "--accept-infeasible", "--accept-collisions"]).is_written());
    }
    // Three in a hundred are met: a long way through the air.
    let found = shown(&beside("0"), &setup, &["optimize"]);
    assert_eq!((found.code, found.is_written()), (0, true), "{}", found.said);
}

#[test]
fn verify_proves_nothing_of_programs_without_a_motion() {
    let empty = "%\nO1 (NOTHING HERE)\nM30\n%\n";
    let (code, text, json) = verified(pair(empty, empty).path(), &[]);
    assert!(code == 1 && text.contains("nothing is proven"), "{text}");
    assert_eq!((json["motions"].as_u64(), json["lines_executed"].as_u64()), (Some(0), Some(3)), "{json}");
}

/// What a cycle cuts that is not simulated is not counted, and the headline says so.
#[test]
fn a_cycle_that_is_not_simulated_is_not_counted() {
    let setup = SETUP.replace("linuxcnc", "haas").replace("force_xy = 80", "force_xy = 800");
    let counted = optimized(PROGRAM, &setup);
    assert!(counted.headline().ends_with("all cuts counted"), "{}", counted.headline());
    for unseen in ["G13 I10. D1 F500.", "G65 P8000"] {
        let found = optimized(&PROGRAM.replace("G0 Z20", &format!("G0 Z5\n{unseen}\nG0 Z20")), &setup);
        assert_eq!(found.code, 0, "{}", found.said);
        let headline = found.headline();
        assert!(
            headline.contains("what is simulated") && headline.ends_with("not counted: what line 13 may cut"),
            "{headline}"
        );
        found.agree();
    }
}
