//! Reports and streams: the keys of the interface, standard input and output, the same bytes for any number of threads.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use assert_cmd::Command;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const PROGRAM: &str =
    "%\nG21 G90\nT1 M6\nS8000 M3\nG0 X-10 Y5 Z2\nG1 Z-2 F300\nG1 X50 F900\nY12\nX-10\nG0 Z10\nM30\n%\n";
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
# This is about something else than what may rise.
[raise]
plunges = true
ramps = true
entries = true
finishing = true
compensation = true
cycles = true
[limits]
feed_change = { max = 2.0 }
force_xy = 80
power = 2000
air_feed = 3000
"#;

fn bench() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("part.nc"), PROGRAM).unwrap();
    fs::write(dir.path().join("part.setup.toml"), SETUP).unwrap();
    dir
}

fn feedwright(dir: &Path) -> Command {
    let mut command = Command::cargo_bin("feedwright").unwrap();
    command.current_dir(dir);
    command
}

fn keys(value: &Value) -> Vec<&str> {
    let mut keys: Vec<&str> = value.as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}

fn has(value: &Value, wanted: &[&str]) {
    let found = keys(value);
    for key in wanted {
        assert!(found.contains(key), "{key} is not among {found:?}");
    }
}

#[test]
fn the_json_report_has_the_keys_of_the_interface() {
    let dir = bench();
    let arguments = ["optimize", "part.nc", "--json", "r.json", "--json-blocks", "--timings"];
    feedwright(dir.path()).args(arguments).assert().code(0);
    let report: Value = serde_json::from_slice(&fs::read(dir.path().join("r.json")).unwrap()).unwrap();
    has(
        &report,
        &[
            "program",
            "time",
            "limits",
            "blocks",
            "constancy",
            "check",
            "infeasible",
            "output",
            "stock",
            "performance",
            "assumptions",
            "frozen",
            "warnings",
            "tool",
        ],
    );
    has(&report["program"], &["file", "blocks", "motions", "dialect", "sha256"]);
    has(&report["time"], &["programmed_s", "realised_before_s", "realised_after_s", "saved_percent", "by_cause"]);
    has(
        &report["limits"][0],
        &[
            "name",
            "unit",
            "limit",
            "tool",
            "before_max",
            "after_max",
            "after_p99",
            "active_time_percent",
            "shadow_price",
        ],
    );
    has(
        &report["blocks"][0],
        &[
            "line",
            "motion",
            "length_mm",
            "feed_before",
            "feed_after",
            "realised_before",
            "realised_after",
            "active_limit",
            "price_s",
            "before",
            "after",
        ],
    );
    has(&report["blocks"][0]["after"], &["force_xy_peak_n", "power_w", "deflection_mm", "feed_per_tooth_mm"]);
    has(&report["constancy"][0], &["name", "reference", "within_5_percent", "within_10_percent"]);
    has(&report["check"], &["geometry_identical", "resimulated_worst_ratio", "resimulated_p99_ratio"]);
    has(
        &report["output"],
        &[
            "f_words_before",
            "f_words_after",
            "blocks_added",
            "bytes_before",
            "bytes_after",
            "loss_vs_continuous_percent",
        ],
    );
    has(&report["stock"], &["initial_mm3", "removed_mm3", "remaining_mm3", "cell_mm"]);
    has(&report["performance"]["stage_s"], &["parse", "simulate", "schedule", "rewrite", "check"]);
    has(&report["assumptions"][0], &["key", "value", "source"]);
    has(&report["tool"][0], &["number", "power_max_w", "power_ref_w", "force_peak_n", "cut_time_s", "cut_length_mm"]);
    assert_eq!(report["program"]["dialect"], "linuxcnc");
    assert_eq!(report["stock"]["initial_mm3"].as_f64().unwrap().round(), 8000.0);
    assert_eq!(report["check"]["geometry_identical"], true);
    let force = &report["limits"].as_array().unwrap().iter().find(|limit| limit["name"] == "force_xy").unwrap();
    assert!(force["before_max"].as_f64() > force["limit"].as_f64(), "the limit does not bind as programmed: {force}");
    assert!(report["check"]["resimulated_worst_ratio"].as_f64().unwrap() <= 1.01);
    assert!(report["time"]["realised_after_s"].as_f64().unwrap() > 0.0);
    let seconds: f64 = report["time"]["by_cause"].as_object().unwrap().values().filter_map(Value::as_f64).sum();
    assert!((seconds - report["time"]["realised_after_s"].as_f64().unwrap()).abs() < 1e-6);
}

#[test]
fn the_table_has_one_row_per_station_and_the_columns_of_the_interface() {
    let dir = bench();
    feedwright(dir.path()).args(["optimize", "part.nc", "--csv", "r.csv"]).assert().code(0);
    let mut table = csv::Reader::from_path(dir.path().join("r.csv")).unwrap();
    let head = table.headers().unwrap().clone();
    let first = "line,motion,s_mm,time_before_s,time_after_s,x_mm,y_mm,z_mm,feed_before_mm_min,feed_after_mm_min,spindle_rpm,tool,removal_area_mm2,contact_area_mm2_per_rev,entry_deg,exit_deg,axial_depth_mm";
    assert_eq!(head.iter().take(17).collect::<Vec<_>>().join(","), first);
    let column = |name: &str| head.iter().position(|known| known == name).unwrap_or_else(|| panic!("no {name}"));
    let (force, line, feed) = (column("force_xy_peak_n_after"), column("line"), column("feed_after_mm_min"));
    column("power_w_before");
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    let number = |row: &csv::StringRecord, at: usize| row[at].parse::<f64>().unwrap();
    assert!(rows.iter().all(|row| number(row, force) <= 80.8), "a load is above its limit");
    assert!(rows.iter().any(|row| number(row, force) > 50.0), "nothing is cut");
    assert!(rows.iter().any(|row| number(row, line) == 7.0 && number(row, feed) > 0.0));
    let times: Vec<f64> = rows.iter().map(|row| number(row, column("time_after_s"))).collect();
    assert!(times.windows(2).all(|pair| pair[0] <= pair[1] + 1e-9), "time runs backwards");
}

/// Cells of a table are numbers, angles joined by `;`, or words of ours: no text of program, setup or file name reaches one, so that none
/// begins a formula of a spreadsheet.
#[test]
fn no_cell_of_a_table_is_a_formula() {
    let dir = bench();
    let program = PROGRAM.replace("G1 X50", "(=1+cmd|' /C calc'!A0)\nG1 X50 (@SUM -2+3)");
    fs::write(dir.path().join("=1+1.nc"), program).unwrap();
    fs::write(dir.path().join("s.toml"), SETUP).unwrap();
    let arguments = ["optimize", "=1+1.nc", "--setup", "s.toml", "-o", "o.nc", "--csv", "t.csv", "--quiet"];
    feedwright(dir.path()).args(arguments).assert().success();
    let table = fs::read_to_string(dir.path().join("t.csv")).unwrap();
    let words = ["", "infeasible", "frozen", "kept"];
    let number = |part: &str| part.parse::<f64>().is_ok_and(f64::is_finite);
    let mut cells = 0;
    for line in table.lines().skip(1) {
        for cell in line.split(',') {
            assert!(words.contains(&cell) || cell.split(';').all(number), "{cell:?} in {line}");
            cells += 1;
        }
    }
    assert!(cells > 100 && !table.starts_with(['=', '+', '-', '@']), "{cells}");
}

#[test]
fn streams_take_the_place_of_files() {
    let dir = bench();
    feedwright(dir.path()).args(["optimize", "part.nc", "--quiet"]).assert().code(0).stdout("").stderr("");
    let written = fs::read(dir.path().join("part.fw.nc")).unwrap();
    let piped = feedwright(dir.path())
        .args(["optimize", "-", "--setup", "part.setup.toml"])
        .write_stdin(PROGRAM)
        .output()
        .unwrap();
    assert_eq!(piped.status.code(), Some(0));
    assert!(piped.stdout == written, "standard output differs from the file");
    assert!(String::from_utf8_lossy(&piped.stderr).contains("time"), "no summary beside the program");
    let json = feedwright(dir.path()).args(["simulate", "part.nc", "--json", "-"]).output().unwrap();
    let report: Value = serde_json::from_slice(&json.stdout).unwrap();
    assert!(report["output"].is_null() && report["check"].is_null());
    assert_eq!(report["time"]["saved_percent"], 0.0);
}

#[test]
fn the_summary_fits_the_screen() {
    let dir = bench();
    let output = feedwright(dir.path()).args(["optimize", "part.nc"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    for word in ["time", "cutting force", "power", "limit", "held by", "F words", "checked", "assumed"] {
        assert!(text.contains(word), "no {word} in\n{text}");
    }
    agrees_with_a_shop(&text);
    assert!(
        !text.contains('\u{1b}') && !String::from_utf8(output.stderr).unwrap().contains('\u{1b}'),
        "colours in a pipe"
    );
}

/// Words of the trade of those who write such programs, and keys of files: none of them is to be read by a machinist.
const JARGON: [&str; 22] = [
    "force_xy",
    "force_axial",
    "feed_change",
    "feed_per_tooth",
    "air_feed",
    "block_time",
    "infeasible",
    "frozen",
    "optimum",
    "shadow",
    "station",
    " node",
    " caps",
    "p99",
    "percentile",
    "continuous",
    "resimulat",
    "lambda",
    "convex",
    "modal",
    "prices",
    "motions",
];

/// At most 20 lines, at most 100 wide, in words a machinist uses.
fn agrees_with_a_shop(text: &str) {
    assert!(text.lines().count() <= 20, "{} lines:\n{text}", text.lines().count());
    let wide: Vec<&str> = text.lines().filter(|line| line.chars().count() > 100).collect();
    assert!(wide.is_empty(), "{wide:?}");
    let lower = text.to_lowercase();
    let found: Vec<&str> = JARGON.into_iter().filter(|word| lower.contains(word)).collect();
    assert!(found.is_empty(), "{found:?} in\n{text}");
}

#[test]
fn the_summary_of_every_example_is_in_the_words_of_the_shop() {
    for name in ["bracket.nc", "pocket.nc", "island.nc", "calibration.ngc"] {
        let program = format!("{}/programs/{name}", env!("CARGO_MANIFEST_DIR"));
        let dir = tempfile::tempdir().unwrap();
        let output = feedwright(dir.path()).args(["optimize", &program, "--dry-run"]).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(text.contains("time  "), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        agrees_with_a_shop(&text);
    }
    // Lengths and feeds are in the program's own unit.
    let bracket = format!("{}/programs/bracket.nc", env!("CARGO_MANIFEST_DIR"));
    let output = feedwright(Path::new(".")).args(["optimize", &bracket, "--dry-run"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains(", inch\n") && !text.contains(" mm"), "{text}");
}

#[test]
fn a_summary_of_many_faults_is_no_longer() {
    let dir = bench();
    // A limit that no cut meets, a rapid through the stock, and a fixture in the way.
    let program = PROGRAM.replace("Y12\nX-10\n", "Y12\nG0 X-10\n");
    fs::write(dir.path().join("part.nc"), program).unwrap();
    let setup = SETUP.replace("force_xy = 80", "force_xy = 1")
        + "[[fixture]]\nbox = { min = [30, 0, -10], max = [60, 20, 0] }\n";
    fs::write(dir.path().join("part.setup.toml"), setup).unwrap();
    let output = feedwright(dir.path()).args(["optimize", "part.nc"]).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    agrees_with_a_shop(&String::from_utf8(output.stdout).unwrap());
}

#[test]
fn a_sign_off_is_one_page_with_what_the_program_came_from() {
    let dir = bench();
    let arguments = ["optimize", "part.nc", "--sign-off", "s.html", "--json", "r.json"];
    feedwright(dir.path()).args(arguments).assert().code(0);
    let read = |name: &str| fs::read_to_string(dir.path().join(name)).unwrap();
    let report: Value = serde_json::from_str(&read("r.json")).unwrap();
    let from = &report["provenance"];
    let page = read("s.html");
    for (key, file) in
        [("original_sha256", "part.nc"), ("setup_sha256", "part.setup.toml"), ("output_sha256", "part.fw.nc")]
    {
        let hash = Sha256::digest(fs::read(dir.path().join(file)).unwrap());
        let hash = hash.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"));
        assert_eq!(from[key], hash.as_str(), "{file}");
        assert!(page.contains(&hash), "{file} is not on the page");
    }
    let worst = report["stress"].as_array().unwrap().iter().map(|case| case["worst_ratio"].as_f64().unwrap());
    assert_eq!(from["stress_worst_ratio"].as_f64(), worst.reduce(f64::max));
    // The largest rise is a rise, at a line whose feed the file raises.
    let rise = &from["largest_rise"];
    assert!(rise["feed_after"].as_f64() > rise["feed_before"].as_f64(), "{from}");
    assert!(page.contains(&format!("line {}: ", rise["line"])) && page.contains("released by"), "{page}");
    assert!(!page.contains("src=") && !page.contains("href="), "it needs another file");
    // What is not written is not signed off.
    feedwright(dir.path()).args(["optimize", "part.nc", "--sign-off", "n.html", "--dry-run"]).assert().code(0);
    assert!(read("n.html").contains("The program was not written."));
}

#[test]
fn proposed_limits_are_written_into_the_setup_and_hold() {
    let dir = bench();
    let program = PROGRAM.replace("G0", "(SLOT)\nG0");
    assert_ne!(program, PROGRAM);
    fs::write(dir.path().join("part.nc"), &program).unwrap();
    let setup = SETUP.replace("force_xy = 80", "# my drawer");
    fs::write(dir.path().join("part.setup.toml"), &setup).unwrap();
    feedwright(dir.path()).args(["limits", "part.nc", "--write", "--json", "l.json"]).assert().code(0);
    let new = fs::read_to_string(dir.path().join("part.setup.toml")).unwrap();
    let lost: Vec<&str> = setup.lines().filter(|line| !new.lines().any(|other| other == *line)).collect();
    assert!(
        lost.is_empty() && new.contains("# force_xy: ") && new.contains("of its cuts stay below"),
        "{lost:?}\n{new}"
    );
    // The value is the one proposed, it is met by 95 % of the length, and the setup runs with it.
    let report: Value = serde_json::from_str(&fs::read_to_string(dir.path().join("l.json")).unwrap()).unwrap();
    let force = &report["proposed"][0]["limits"][0];
    let written: toml::Table = new.parse().unwrap();
    let limit = written["tool"][0]["limits"]["force_xy"].as_float().unwrap();
    assert!((limit / force["value"].as_f64().unwrap() - 1.0).abs() < 1e-3, "{limit} {force}");
    assert_eq!(force["value"], report["tools"][0]["loads"][0]["p95"]);
    feedwright(dir.path()).args(["optimize", "part.nc"]).assert().code(0);
    // A second time nothing changes.
    feedwright(dir.path()).args(["limits", "part.nc", "--write"]).assert().code(0);
    assert_eq!(fs::read_to_string(dir.path().join("part.setup.toml")).unwrap(), new);
}

#[test]
fn limits_that_cannot_be_put_into_the_setup_leave_no_report() {
    let dir = bench();
    let setup = dir.path().join("part.setup.toml");
    fs::write(&setup, SETUP.replace("force_xy = 80", "")).unwrap();
    let mut permissions = fs::metadata(&setup).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&setup, permissions).unwrap();
    feedwright(dir.path()).args(["limits", "part.nc", "--write", "--json", "l.json"]).assert().code(2);
    assert!(!dir.path().join("l.json").exists());
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let dir = bench();
    let run = |threads: &str| {
        let arguments =
            ["optimize", "part.nc", "--json", "r.json", "--csv", "r.csv", "--svg", "r.svg", "--threads", threads];
        feedwright(dir.path()).args(arguments).assert().code(0);
        ["part.fw.nc", "r.json", "r.csv", "r.svg"].map(|name| fs::read(dir.path().join(name)).unwrap())
    };
    let one = run("1");
    assert!(one == run("2") && one == run("7"));
}

#[test]
fn the_picture_and_the_page_are_complete_in_themselves() {
    let dir = bench();
    feedwright(dir.path()).args(["optimize", "part.nc", "--svg", "r.svg", "--report", "r.html"]).assert().code(0);
    let svg = fs::read_to_string(dir.path().join("r.svg")).unwrap();
    assert!(svg.starts_with("<svg xmlns=") && svg.ends_with("</svg>\n") && svg.contains("limit 80 N"));
    let html = fs::read_to_string(dir.path().join("r.html")).unwrap();
    assert!(html.contains("<svg") && html.contains("</html>") && html.contains("force_xy"));
    for text in [svg, html] {
        assert!(!text.contains("href=") && !text.contains("src="), "it needs another file");
    }
}

#[test]
fn verify_finds_what_was_tampered_with() {
    let dir = bench();
    feedwright(dir.path()).args(["optimize", "part.nc"]).assert().code(0);
    feedwright(dir.path()).args(["verify", "part.nc", "part.fw.nc"]).assert().code(0);
    let text = fs::read_to_string(dir.path().join("part.fw.nc")).unwrap();
    fs::write(dir.path().join("moved.nc"), text.replace("Y12", "Y13")).unwrap();
    let output = feedwright(dir.path()).args(["verify", "part.nc", "moved.nc", "--json", "v.json"]).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let report: Value = serde_json::from_slice(&fs::read(dir.path().join("v.json")).unwrap()).unwrap();
    assert_eq!(report["identical"], false);
    assert!(!report["differences"].as_array().unwrap().is_empty());
}

#[test]
fn a_limit_that_cannot_be_met_is_said_first_and_nothing_is_written() {
    let dir = bench();
    fs::write(dir.path().join("tight.toml"), SETUP.replace("force_xy = 80", "force_xy = 1")).unwrap();
    let run = |more: &[&str]| {
        feedwright(dir.path()).args(["optimize", "part.nc", "--setup", "tight.toml"]).args(more).output().unwrap()
    };
    let held = run(&[]);
    assert_eq!(held.status.code(), Some(1));
    let said = String::from_utf8(held.stdout).unwrap();
    assert!(said.starts_with("Limits cannot be met on"), "{said}");
    assert!(!dir.path().join("part.fw.nc").exists());
    assert_eq!(run(&["--accept-infeasible"]).status.code(), Some(1));
    assert!(dir.path().join("part.fw.nc").exists());
}

#[test]
fn every_stage_can_be_dumped() {
    let dir = bench();
    for stage in ["tokens", "blocks", "moves", "engagement", "loads", "surface", "problem"] {
        let output = feedwright(dir.path()).args(["dump", stage, "part.nc"]).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{stage}");
        assert!(output.stdout.split(|byte| *byte == b'\n').count() > 5, "{stage} says nothing");
    }
    for shelf in ["tools", "materials", "machines", "effects", "models"] {
        let output = feedwright(dir.path()).args(["library", shelf]).output().unwrap();
        assert!(output.status.success() && output.stdout.len() > 50, "{shelf} is empty");
        let text = String::from_utf8(output.stdout).unwrap();
        let shown = match shelf {
            "materials" => "k_tc = 693.8",
            "machines" => "corner_tolerance = \"0.03 mm\"",
            "effects" => "offset [mm], 0 to 0.1",
            _ => "",
        };
        assert!(text.contains(shown), "{shelf} shows no {shown}");
    }
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let dir = bench();
    let shell = format!("{} dump tokens part.nc | head -1; exit ${{PIPESTATUS[0]}}", env!("CARGO_BIN_EXE_feedwright"));
    let long = PROGRAM.repeat(4000);
    fs::write(dir.path().join("part.nc"), long).unwrap();
    let output = std::process::Command::new("bash").arg("-c").arg(shell).current_dir(dir.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn limits_suggest_what_the_program_already_does() {
    let dir = bench();
    let output = feedwright(dir.path()).args(["limits", "part.nc", "--json", "l.json"]).output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    let report: Value = serde_json::from_slice(&fs::read(dir.path().join("l.json")).unwrap()).unwrap();
    let force = &report["tools"][0]["loads"][0];
    assert_eq!(force["name"], "force_xy");
    let figures: Vec<f64> = ["p50", "p90", "p95", "p99", "max"].map(|key| force[key].as_f64().unwrap()).to_vec();
    assert!(figures[0] > 10.0 && figures.windows(2).all(|pair| pair[0] <= pair[1]), "{figures:?}");
}

/// A drill, a tap and an end mill, each with one cut.
const THREE_TOOLS: &str = "%\nG21 G90\nT1 M6\nS2000 M3\nG0 X10 Y10 Z5\nG81 Z-8 R2 F100\nG80\nG0 Z20\nT2 M6\nS500 M3\n\
    G0 X10 Y10 Z5\nG84 Z-8 R2 F500\nG80\nG0 Z20\nT3 M6\nS8000 M3\nG0 X-10 Y2 Z2\nG1 Z-2 F300\nG1 X50 F900\nG0 Z20\nM30\n%\n";

/// Limits of one tool as `limits` proposes them: the text behind `limits =`.
fn proposed(text: &str, tool: &str) -> Option<String> {
    let part = &text[text.find(tool)?..];
    let part = &part[..part[1..].find("\nT").map_or(part.len(), |end| end + 2)];
    let line = part.lines().find_map(|line| line.trim().strip_prefix("limits = "))?;
    Some(line.to_owned())
}

#[test]
fn limits_propose_nothing_that_is_not_met_and_keep_to_the_units_of_the_setup() {
    let tools = "[[tool]]\nnumber = 1\nshape = \"drill\"\ndiameter = 5\nflutes = 2\n[[tool]]\nnumber = 2\nshape = \"tap\"\n\
        diameter = 6\n[[tool]]\nnumber = 3\nshape = \"flat\"\ndiameter = 6\nflutes = 3\noverhang = 30\nmaterial = \"carbide\"\n";
    let setup = SETUP.replace("[[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 6\nflutes = 3\n", tools);
    let dir = bench();
    fs::write(dir.path().join("part.nc"), THREE_TOOLS).unwrap();
    let said = |setup: &str| {
        fs::write(dir.path().join("part.setup.toml"), setup).unwrap();
        let output = feedwright(dir.path()).args(["limits", "part.nc", "--resolution", "0.5"]).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let metric = said(&setup);
    assert!(!metric.contains("= 0 ") && !metric.contains("= 0,") && !metric.contains("-0 "), "{metric}");
    let drill = proposed(&metric, "T1:").unwrap();
    assert!(drill.contains("force_axial = ") && drill.contains("power = ") && !drill.contains("force_xy"), "{drill}");
    assert_eq!(proposed(&metric, "T2:"), None, "a tap keeps its feed: {metric}");
    let bent = |text: &str| -> f64 {
        let proposal: toml::Table = format!("limits = {}", proposed(text, "T3:").unwrap()).parse().unwrap();
        proposal["limits"]["deflection"].as_float().unwrap()
    };
    // The same job written in inches: the proposal, pasted into it, is the same length.
    let inches =
        [("-10], max = [40, 20, 0", "-0.3937], max = [1.5748, 0.7874, 0"), ("air_feed = 3000", "air_feed = 118.11")];
    let lengths = [
        ("diameter = 5", "diameter = 0.19685"),
        ("diameter = 6", "diameter = 0.23622"),
        ("overhang = 30", "overhang = 1.1811"),
    ];
    let text = inches.iter().chain(&lengths).fold(
        setup.replace("resolution = 0.5\n", "units = \"inch\"\n"),
        |text, (mm, inch)| {
            assert!(text.contains(mm), "{mm}");
            text.replace(mm, inch)
        },
    );
    let (mm, inch) = (bent(&metric), bent(&said(&text)));
    assert!((inch * 25.4 / mm - 1.0).abs() < 0.02, "{mm} mm, {inch} in");
}

#[test]
fn no_number_of_the_table_is_a_zero_with_a_sign() {
    let dir = bench();
    feedwright(dir.path()).args(["simulate", "part.nc", "--csv", "t.csv", "--quiet"]).assert().code(0);
    let table = fs::read_to_string(dir.path().join("t.csv")).unwrap();
    assert!(table.lines().count() > 10);
    let signed = |cell: &&str| cell.starts_with('-') && cell.parse::<f64>().is_ok_and(|value| value == 0.0);
    let found = table.lines().find(|line| line.split([',', ';']).any(|cell| signed(&cell)));
    assert_eq!(found, None);
}

#[test]
fn an_operation_found_by_its_comment_keeps_its_feed() {
    let dir = bench();
    let program = PROGRAM.replace("Y12\nX-10\n", "(finish)\nY12\nX-10\n(end)\n");
    fs::write(dir.path().join("part.nc"), program).unwrap();
    let setup = "fixtures = \"none\"\n".to_owned()
        + SETUP
        + "[[operation]]\nmatch = { comment = \"FINISH\" }\nmode = \"keep\"\n";
    fs::write(dir.path().join("part.setup.toml"), setup).unwrap();
    // Line 10 is kept at 119 % of the force limit: done, but a limit is not met.
    feedwright(dir.path()).args(["optimize", "part.nc", "--json", "r.json", "--json-blocks"]).assert().code(1);
    let report: Value = serde_json::from_slice(&fs::read(dir.path().join("r.json")).unwrap()).unwrap();
    assert_eq!(report["verdict"]["faults"][0]["kind"], "frozen");
    for block in report["blocks"].as_array().unwrap() {
        let kept = block["feed_after"] == block["feed_before"];
        assert_eq!(kept, [9, 10].contains(&block["line"].as_u64().unwrap()), "{block}");
    }
}

/// A folder with three programs, one of them with a fault.
fn many() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    for (name, force) in [("a.nc", 80), ("b.tap", 90), ("c.nc", 70)] {
        fs::write(dir.path().join(name), PROGRAM).unwrap();
        let setup = SETUP.replace("force_xy = 80", &format!("force_xy = {force}"));
        let stem = name.split('.').next().unwrap();
        fs::write(dir.path().join(format!("{stem}.setup.toml")), setup).unwrap();
    }
    dir
}

/// A program that is held back has no time in the sum, and says so.
#[test]
fn a_batch_counts_no_time_of_what_it_does_not_write() {
    let dir = tempfile::tempdir().unwrap();
    for (name, force) in [("good", 80), ("held", 1)] {
        fs::write(dir.path().join(format!("{name}.nc")), PROGRAM).unwrap();
        let setup = SETUP.replace("force_xy = 80", &format!("force_xy = {force}"));
        fs::write(dir.path().join(format!("{name}.setup.toml")), setup).unwrap();
    }
    let output = feedwright(dir.path()).args(["batch", ".", "--out", "out", "--json", "s.json"]).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8(output.stdout).unwrap();
    let held = said.lines().find(|line| line.starts_with("held.nc")).unwrap();
    assert!(
        held.contains("not written: Limits cannot be met") && !dir.path().join("out/held.fw.nc").exists(),
        "{said}"
    );
    let sum: Value = serde_json::from_slice(&fs::read(dir.path().join("s.json")).unwrap()).unwrap();
    let [good, held] = [0, 1].map(|k| &sum["programs"][k]);
    assert_eq!(good["realised_after_s"], sum["realised_after_s"]);
    assert!(held["outcome"] == "not written" && held["provenance"]["output_sha256"].is_null(), "{held}");
}

#[test]
fn a_batch_does_every_program_once_whoever_runs_it() {
    let dir = many();
    let run = |arguments: &[&str]| {
        let output = feedwright(dir.path()).args(arguments).output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
        (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
    };
    let done = |said: &str, word: &str| said.lines().filter(|line| line.starts_with(word)).count();
    // What one program alone gives.
    let read = |name: &str| fs::read(dir.path().join(name)).unwrap();
    assert_eq!(run(&["optimize", "a.nc"]).0, 0);
    let alone = read("a.fw.nc");
    // Two shards, one after the other; before the second a summary says what is not done.
    let (_, _, said) = run(&["batch", ".", "--out", "out", "--shard", "1/2"]);
    assert_eq!(done(&said, "runs "), 2, "{said}");
    let early = run(&["merge", ".", "--out", "out"]).1;
    assert!(early.lines().any(|line| line.starts_with("b.tap ") && line.contains("not done")), "{early}");
    let (_, _, said) = run(&["batch", ".", "--out", "out", "--shard", "2/2"]);
    assert_eq!(done(&said, "runs "), 1, "{said}");
    let (code, merged, _) = run(&["merge", ".", "--out", "out", "--json", "m.json"]);
    assert!(code == 0 && merged.contains("3 programs, 0 to look at"), "{code} {merged}");
    assert!(read("out/a.fw.nc") == alone, "a batch writes other bytes");
    // One run over all: nothing again, the same summary. What was lost or changed is done again, and only that.
    let (_, shown, said) = run(&["batch", ".", "--out", "out", "--json", "w.json"]);
    assert_eq!((done(&said, "known "), done(&said, "runs ")), (3, 0), "{said}");
    assert!(shown == merged && read("m.json") == read("w.json"));
    fs::remove_file(dir.path().join("out/b.fw.tap")).unwrap();
    fs::write(dir.path().join("c.setup.toml"), SETUP.replace("force_xy = 80", "force_xy = 75")).unwrap();
    let (_, _, said) = run(&["batch", ".", "--out", "out"]);
    assert_eq!((done(&said, "known "), done(&said, "runs ")), (1, 2), "{said}");
    // Another cell or another model is another answer, and so is the way back to none; what a record was made with is known again.
    for (options, runs) in [(&["--resolution", "0.7"][..], 3), (&["--resolution", "0.7"], 0), (&[], 3), (&[], 0)] {
        let (_, _, said) = run(&[&["batch", ".", "--out", "out"], options].concat());
        assert_eq!(done(&said, "runs "), runs, "{options:?}: {said}");
    }
    // A list does the same; a program without its setup is said and does not stop the others.
    fs::write(dir.path().join("list.txt"), "# today\na.nc\nb.tap\tb.setup.toml\ngone.nc\n").unwrap();
    let (code, shown, said) = run(&["batch", "list.txt", "--out", "out"]);
    assert!(
        code == 1 && shown.contains("3 programs, 1 to look at") && said.contains("gone.nc"),
        "{code} {shown} {said}"
    );
    assert_eq!(run(&["batch", ".", "--shard", "3/2"]).0, 2);
}

#[test]
fn two_batches_over_one_list_do_every_program_once() {
    let dir = many();
    let start = || {
        let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin("feedwright"));
        let command = command.current_dir(dir.path()).args(["batch", ".", "--out", "out"]);
        command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped()).spawn().unwrap()
    };
    let done = [start(), start()].map(|child| child.wait_with_output().unwrap());
    let said: Vec<String> = done.iter().map(|done| String::from_utf8(done.stderr.clone()).unwrap()).collect();
    assert!(done.iter().all(|done| done.status.code() == Some(0)), "{said:?}");
    assert_eq!(done[0].stdout, done[1].stdout);
    let mut runs: Vec<&str> =
        said.iter().flat_map(|said| said.lines()).filter_map(|line| line.strip_prefix("runs ")).collect();
    runs.sort_unstable();
    assert_eq!(runs.iter().map(|name| name.trim()).collect::<Vec<_>>(), ["a.nc", "b.tap", "c.nc"], "{said:?}");
}

/// Another program that the same tool cuts.
fn other_program() -> String {
    PROGRAM.replace("Z-2 F300", "Z-4 F300")
}

#[test]
fn several_programs_are_written_all_or_none() {
    let dir = bench();
    let at = dir.path();
    fs::write(at.join("b.nc"), other_program()).unwrap();
    // Each alone, as what it must be.
    let alone = |name: &str| {
        let arguments = ["optimize", name, "--setup", "part.setup.toml", "-o", "alone.nc", "--force"];
        let code = feedwright(at).args(arguments).output().unwrap().status.code();
        (code, fs::read(at.join("alone.nc")).unwrap())
    };
    let [(first_code, first), (second_code, second)] = ["part.nc", "b.nc"].map(alone);
    let both = ["optimize", "part.nc", "b.nc", "--setup", "part.setup.toml"];
    let done = feedwright(at).args(both).args(["--out-dir", "out"]).output().unwrap();
    assert_eq!(done.status.code(), first_code.max(second_code));
    assert_eq!(fs::read(at.join("out/part.fw.nc")).unwrap(), first);
    assert_eq!(fs::read(at.join("out/b.fw.nc")).unwrap(), second);
    let shown = String::from_utf8(done.stdout).unwrap();
    assert_eq!(shown.lines().count(), 2, "{shown}");
    assert!(shown.lines().all(|line| line.contains('→')) && shown.starts_with("part.nc "), "{shown}");
    // Without a folder beside each program, and nothing with --dry-run.
    assert!(said(feedwright(at).args(both).arg("--dry-run")).1.contains("not written"));
    assert!(!at.join("b.fw.nc").exists());
    feedwright(at).args(both).output().unwrap();
    assert_eq!(fs::read(at.join("b.fw.nc")).unwrap(), second);
    // The last one cannot be used: none is written.
    fs::write(at.join("c.nc"), "T9 M6\nS3000 M3\nG1 X10 F500\nM30\n").unwrap();
    let three = ["optimize", "part.nc", "c.nc", "--setup", "part.setup.toml", "--out-dir", "none"];
    feedwright(at).args(three).assert().code(2);
    assert_eq!(fs::read_dir(at.join("none")).unwrap().count(), 0);
    // Two of one name, and what is for one program alone.
    fs::create_dir(at.join("deep")).unwrap();
    fs::write(at.join("deep/part.nc"), PROGRAM).unwrap();
    let twice = ["optimize", "part.nc", "deep/part.nc", "--setup", "part.setup.toml", "--out-dir", "out"];
    let (code, text) = said(feedwright(at).args(twice));
    assert!(code == 2 && text.contains("is written twice"), "{text}");
    for option in [["--json", "r.json"], ["-o", "x.nc"], ["--cycle-time", "1:00"], ["--sign-off", "s.html"]] {
        let (code, text) = said(feedwright(at).args(both).args(option));
        assert!(code == 2 && text.contains(option[0]), "{text}");
    }
}

/// Exit code and standard error.
fn said(command: &mut Command) -> (i32, String) {
    let done = command.output().unwrap();
    (done.status.code().unwrap(), String::from_utf8(done.stderr).unwrap())
}

/// What a report has that its schema does not describe or describes otherwise, with its place.
fn unlike(schema: &Value, whole: &Value, value: &Value, at: &str, found: &mut Vec<String>) {
    if let Some(name) = schema["$ref"].as_str() {
        return unlike(whole.pointer(&name[1..]).unwrap(), whole, value, at, found);
    }
    if let Some(any) = schema["anyOf"].as_array() {
        let fits = |one: &Value| {
            let mut wrong = Vec::new();
            unlike(one, whole, value, at, &mut wrong);
            wrong.is_empty()
        };
        if !any.iter().any(fits) {
            found.push(format!("{at}: none of its forms"));
        }
        return;
    }
    let name = match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(number) if number.is_f64() => "number",
        Value::Number(_) => "integer",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    };
    let is = |wanted: &Value| wanted == name || (wanted == "number" && name == "integer");
    if !(is(&schema["type"]) || schema["type"].as_array().is_some_and(|types| types.iter().any(is))) {
        found.push(format!("{at} is {name}, not {}", schema["type"]));
    }
    for (k, one) in value.as_array().into_iter().flatten().enumerate() {
        unlike(&schema["items"], whole, one, &format!("{at}[{k}]"), found);
    }
    for (key, one) in value.as_object().into_iter().flatten() {
        let of = schema["properties"].get(key).or_else(|| schema.get("additionalProperties"));
        match of {
            Some(of) => unlike(of, whole, one, &format!("{at}.{key}"), found),
            None => found.push(format!("{at}.{key} is not described")),
        }
    }
    for key in schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str) {
        if value.get(key).is_none() {
            found.push(format!("{at}.{key} is missing"));
        }
    }
}

#[test]
fn the_schema_of_the_report_describes_every_report() {
    let dir = bench();
    let at = dir.path();
    let schema = |of: &[&str]| feedwright(at).arg("schema").args(of).output().unwrap().stdout;
    let schema_of_report: Value = serde_json::from_slice(&schema(&["report"])).unwrap();
    assert_eq!(schema(&[]), schema(&["setup"]));
    for arguments in [
        &["optimize", "--json-blocks", "--timings", "--stress", "--reference", "self", "--cycle-time", "0:20"][..],
        &["simulate"],
        &["optimize", "--sign-off", "s.html"],
    ] {
        feedwright(at).args(arguments).args(["part.nc", "--json", "r.json", "--force"]).output().unwrap();
        let report: Value = serde_json::from_slice(&fs::read(at.join("r.json")).unwrap()).unwrap();
        let mut found = Vec::new();
        unlike(&schema_of_report, &schema_of_report, &report, "report", &mut found);
        assert!(found.is_empty(), "{arguments:?}: {found:?}");
        // And it would be noticed.
        let mut wrong = report.clone();
        wrong["time"].as_object_mut().unwrap().remove("realised_after_s");
        wrong["program"]["blocks"] = "many".into();
        wrong["check"]["new"] = 1.into();
        unlike(&schema_of_report, &schema_of_report, &wrong, "report", &mut found);
        assert!(found.len() >= 3, "{found:?}");
    }
}
