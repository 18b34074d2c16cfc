//! What a run is asked besides the feeds: limits from the program itself, stress, a measured cycle time, the problem as
//! JSON, a confidence, a rate of force, a wear budget; and setups that make no sense for a schedule.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/mesh.rs"]
mod mesh;
#[path = "common/slot.rs"]
mod slot;

use mesh::box_as_stl;
use serde_json::Value;
use slot::{feedwright, limit, number, optimized as report, warnings};
use std::fs;
use tempfile::TempDir;

/// A slot, then half-immersed passes: the engagement changes.
const PROGRAM: &str = "%\nG21 G90\nT1 M6\nS8000 M3\nG0 X-10 Y5 Z2\nG1 Z-2 F300\nG1 X50 F900\nG1 Y8\nX-10\nY11\nX50\nG2 X50 Y17 I0 J3\nG1 X-10\nG0 Z10\nM30\n%\n";

/// The setup with one limit.
fn setup() -> String {
    slot::SETUP.to_owned() + "force_xy = 80\n"
}

fn bench(setup: &str) -> TempDir {
    slot::bench(PROGRAM, setup)
}

fn time(report: &Value) -> f64 {
    number(&report["time"], "realised_after_s")
}

#[test]
fn limits_from_the_program_itself() {
    // Without limits of the setup: nothing but the loads the program meets.
    let dir = bench(&setup().replace("[limits]\nforce_xy = 80\n", ""));
    let found = report(dir.path(), &["--reference", "self:90"]);
    let limits: Vec<&str> = found["limits"].as_array().unwrap().iter().filter_map(|l| l["name"].as_str()).collect();
    assert!(limits.contains(&"force_xy") && limits.contains(&"deflection"), "{limits:?}");
    let moved = found["reference"]["coefficients"].as_array().unwrap();
    assert_eq!(moved.len(), 2);
    // A common error of the coefficients cancels, but for the tare that does not scale with them.
    for change in moved {
        assert!(change["mean_percent"].as_f64().unwrap().abs() < 5.0, "{change}");
    }
    let screen = feedwright(dir.path(), &["optimize", "part.nc", "--reference", "self"]).stdout;
    assert!(String::from_utf8_lossy(&screen).contains("coefficients +30 %"));
    assert_eq!(feedwright(dir.path(), &["optimize", "part.nc", "--reference", "other"]).status.code(), Some(2));
}

#[test]
fn stress_says_what_other_worlds_would_do() {
    let dir = bench(&setup());
    let found = report(dir.path(), &["--stress"]);
    let cases = found["stress"].as_array().unwrap();
    assert_eq!(cases.len(), 11);
    let worst = |name: &str| {
        let case = cases.iter().find(|case| case["case"].as_str().unwrap().starts_with(name)).unwrap();
        case["worst_ratio"].as_f64().unwrap()
    };
    let nominal = found["check"]["resimulated_worst_ratio"].as_f64().unwrap();
    // Forces are proportional to the coefficients.
    assert!((worst("coefficients +30") / nominal - 1.3).abs() < 0.01, "{} {nominal}", worst("coefficients +30"));
    assert!((worst("coefficients -30") / nominal - 0.7).abs() < 0.01);
    assert!(worst("feed override") > nominal && worst("runout") > nominal && worst("stock grown") > nominal);
}

/// The worst ratio of a case of `--stress`.
fn worst(report: &Value, name: &str) -> f64 {
    let cases = report["stress"].as_array().unwrap();
    let case = cases.iter().find(|case| case["case"].as_str().unwrap().starts_with(name));
    number(case.unwrap_or_else(|| panic!("{name}: {cases:?}")), "worst_ratio")
}

#[test]
fn what_stress_says_is_what_the_force_law_says() {
    // Without edge forces the force is proportional to coefficients, feed and (for a straight edge) depth.
    let sharp = "k_te = 0\nk_re = 0\nk_ae = 0\n";
    let setup =
        setup().replace("k_te = 14\nk_re = 12\nk_ae = 2\n", sharp).replace("flutes = 3", "flutes = 3\nhelix = 0");
    let found = report(bench(&setup).path(), &["--stress"]);
    let nominal = number(&found["check"], "resimulated_worst_ratio");
    for (name, factor) in [
        ("coefficients +30", 1.3),
        ("coefficients -30", 0.7),
        ("feed override", 1.2),
        ("work offset -0.3 mm in z", 2.3 / 2.0),
        ("work offset +0.3 mm in z", 1.7 / 2.0),
    ] {
        let ratio = worst(&found, name) / nominal;
        assert!((ratio - factor).abs() < 0.01 * factor, "{name}: {ratio}, {factor}");
    }
    // Grown by 0.4 mm it is also met earlier, at the feed in air.
    assert!(worst(&found, "stock grown") >= 2.4 / 2.0 * nominal, "{found}");
    // Three teeth with one 0.01 mm out: at most the whole runout is added to a chip of f_t = F / (3 · 8000).
    let feed = found["blocks"]
        .as_array()
        .unwrap()
        .iter()
        .map(|block| number(block, "feed_after"))
        .fold(f64::INFINITY, f64::min);
    let most = 1.0 + 2.0 * 0.01 / (feed / 24000.0);
    let runout = worst(&found, "runout") / nominal;
    assert!(runout > 1.05 && runout < most, "{runout} {most}");
}

#[test]
fn a_stock_from_a_file_is_stressed_like_a_box() {
    let shape = "box = { min = [0, 0, -10], max = [40, 20, 0] }";
    // Whole blocks have the same feeds on both: only the stock differs.
    let setup = format!("{}[output]\nsplit = false\n", setup());
    let plain = report(bench(&setup).path(), &["--stress"]);
    let dir = bench(&setup.replace(shape, "stl = \"stock.stl\""));
    fs::write(dir.path().join("stock.stl"), box_as_stl([[0.0, 40.0], [0.0, 20.0], [-10.0, 0.0]])).unwrap();
    let meshed = report(dir.path(), &["--stress"]);
    for axis in ["x", "y", "z"] {
        for sign in ["+", "-"] {
            let name = format!("work offset {sign}0.3 mm in {axis}");
            let (box_ratio, mesh_ratio) = (worst(&plain, &name), worst(&meshed, &name));
            assert!((mesh_ratio / box_ratio - 1.0).abs() < 0.01, "{name}: {mesh_ratio}, box {box_ratio}");
        }
    }
    assert!(worst(&meshed, "stock grown") > 1.1 * number(&meshed["check"], "resimulated_worst_ratio"));
}

#[test]
fn a_cycle_time_turns_the_saving_into_an_interval() {
    let dir = bench(&setup());
    let plain = report(dir.path(), &[]);
    assert_eq!(plain["time"]["saving_confirmed"], false);
    let screen = |more: &[&str]| {
        let words = ["optimize", "part.nc"].iter().chain(more).copied().collect::<Vec<&str>>();
        String::from_utf8(feedwright(dir.path(), &words).stdout).unwrap()
    };
    assert!(screen(&[]).contains("saving    unconfirmed: no cycle time or log"), "{}", screen(&[]));
    assert!(screen(&["--cycle-time", "0:01"]).contains("saving    unconfirmed: no acceleration explains"));
    let before = plain["time"]["realised_before_s"].as_f64().unwrap();
    let found = report(dir.path(), &["--cycle-time", &format!("0:{:.2}", 1.02 * before)]);
    let cycle = &found["cycle"];
    let at = |key: &str, i: usize| cycle[key][i].as_f64().unwrap();
    assert!(at("acceleration", 0) <= at("acceleration", 1) && at("acceleration", 0) < 1.0, "{cycle}");
    assert!(at("saved_percent", 0) <= at("saved_percent", 1), "{cycle}");
    assert_eq!(found["time"]["saving_confirmed"], true);
    let cycle_time = format!("0:{:.2}", 1.02 * before);
    let confirmed = screen(&["--cycle-time", &cycle_time]);
    assert!(confirmed.contains("% are saved") && !confirmed.contains("unconfirmed"), "{confirmed}");
    // A time that no acceleration explains confirms nothing.
    let short = report(dir.path(), &["--cycle-time", "0:01"]);
    assert_eq!(short["time"]["saving_confirmed"], false);
}

#[test]
fn the_problem_as_json_holds_its_answer() {
    let dir = bench(&setup());
    report(dir.path(), &["--dump-problem", "problem.json"]);
    let problem: Value = serde_json::from_str(&fs::read_to_string(dir.path().join("problem.json")).unwrap()).unwrap();
    let (legs, points) = (problem["legs"].as_array().unwrap(), problem["points"].as_array().unwrap());
    assert_eq!(points.len(), legs.len() + 1);
    let b: Vec<f64> = points.iter().map(|point| point["b"].as_f64().unwrap()).collect();
    let scale = b.iter().copied().fold(0.0, f64::max);
    for (i, leg) in legs.iter().enumerate() {
        assert!(b[i].max(b[i + 1]) <= leg["cap_b"].as_f64().unwrap() + 1e-6 * scale);
        if let Some(a) = leg["acceleration_mm_s2"].as_f64() {
            assert!((b[i + 1] - b[i]).abs() <= 2.0 * a * leg["length_mm"].as_f64().unwrap() + 1e-6 * scale);
        }
        for row in leg["rows"].as_array().into_iter().flatten() {
            let at = |k: usize| row[k].as_f64().unwrap();
            assert!(at(0) * b[i] + at(1) * b[i + 1] <= at(2) * (1.0 + 1e-6));
        }
    }
}

#[test]
fn feeds_rise_as_uncertainty_falls() {
    let with = |deviation: f64, stock: f64| {
        let process = format!(
            "[process]\ncovariance = [[{}, 0], [0, {}]]\ncovariance_of = [\"k_tc\", \"k_te\"]\n",
            (deviation * 800.0f64).powi(2),
            (deviation * 14.0f64).powi(2)
        );
        let setup = setup().replace("uncertainty = 0.4", &format!("uncertainty = {stock}")) + &process;
        bench(&setup)
    };
    let sure = |deviation: f64, stock: f64| report(with(deviation, stock).path(), &["--confidence", "0.95"]);
    let (none, small, large) = (sure(0.0, 0.0), sure(0.05, 0.0), sure(0.15, 0.0));
    assert!(
        time(&none) < time(&small) && time(&small) < time(&large),
        "{} {} {}",
        time(&none),
        time(&small),
        time(&large)
    );
    assert!(time(&none) < time(&sure(0.0, 1.0)));
    // A stock from a file is raised by what it is uncertain.
    let from_file = |uncertainty: f64| {
        let dir = with(0.0, uncertainty);
        let setup = fs::read_to_string(dir.path().join("part.setup.toml")).unwrap();
        let shape = "box = { min = [0, 0, -10], max = [40, 20, 0] }";
        fs::write(dir.path().join("part.setup.toml"), setup.replace(shape, "stl = \"stock.stl\"")).unwrap();
        fs::write(dir.path().join("stock.stl"), box_as_stl([[0.0, 40.0], [0.0, 20.0], [-10.0, 0.0]])).unwrap();
        time(&report(dir.path(), &["--confidence", "0.95"]))
    };
    assert!(from_file(0.0) < from_file(1.0), "{} {}", from_file(0.0), from_file(1.0));
    // Both coefficients 15 % off with the same sign would be one direction of doubt; here they are independent: between one and
    // two times 1.645 · 15 % · their shares.
    let force = limit(&large, "force_xy");
    let kept = number(force, "after_max") / number(force, "limit");
    assert!(kept > 1.0 / (1.0 + 1.645 * 0.15) - 0.01 && kept < 0.95, "{kept}");
}

#[test]
fn a_confidence_leaves_room_for_what_the_model_did_not_explain() {
    // Coefficients known exactly, a load that scattered by 6 % of itself on data left out.
    let known = "[process]\ncovariance = [[0.0, 0], [0, 0.0]]\ncovariance_of = [\"k_tc\", \"k_te\"]\n";
    let kept = |scatter: &str, options: &[&str]| {
        let found = report(bench(&(setup() + known + scatter)).path(), options);
        let force = limit(&found, "force_xy");
        number(force, "after_max") / number(force, "limit")
    };
    let sure = &["--confidence", "0.95"];
    // Some 190 mm of cut are 31 places for a mill of 6 mm; Φ(2.94)³¹ = 0.95.
    let wanted = 1.0 / (1.0 + 2.94 * 0.06);
    let room = kept("scatter = 0.06\n", sure);
    assert!((wanted - 0.015..wanted + 0.005).contains(&room), "{room} {wanted}");
    assert!(kept("", sure) > 0.97 && kept("scatter = 0.06\n", &[]) > 0.97);
}

/// A model learned from a load in percent has no coefficients of its own: those of the material are as uncertain as the setup says,
/// beside the scatter, and a covariance in percent says nothing of them.
#[test]
fn at_a_confidence_coefficients_that_were_not_measured_keep_their_stated_uncertainty() {
    let (declared, measured) = (setup(), "[process.base]");
    let from = declared.find(measured).unwrap();
    let rest = declared[from + 1..].find("\n[").unwrap() + from + 1;
    let without_base = format!("{}{}", &declared[..from], &declared[rest..]);
    let kept = |uncertainty: &str| {
        let learned = "[process]\nscatter = 0.06\ncovariance = [[450.0]]\ncovariance_of = [\"k_tc\"]\n";
        let setup = without_base.replace("[material]", &format!("[material]\n{uncertainty}")) + learned;
        let found = report(bench(&setup).path(), &["--confidence", "0.95"]);
        let force = limit(&found, "force_xy");
        number(force, "after_max") / number(force, "limit")
    };
    let (scatter, both) = (kept(""), kept("uncertainty = 0.1\n"));
    // 1.645 · 10 % of the coefficients and 2.94 · 6 % of the residual, in squares.
    let wanted = 1.0 / (1.0 + (1.645f64 * 0.1).hypot(2.94 * 0.06));
    assert!((both - wanted).abs() < 0.015 && scatter > both + 0.03, "{scatter} {both} {wanted}");
}

#[test]
fn at_a_confidence_loads_grow_in_proportion_beyond_the_feeds_that_were_measured() {
    let known = "[process]\ncovariance = [[0.0, 0], [0, 0.0]]\ncovariance_of = [\"k_tc\", \"k_te\"]\n";
    let of = |feed: &str, options: &[&str]| {
        let found = report(bench(&(setup() + known + feed)).path(), options);
        let force = limit(&found, "force_xy");
        (time(&found), number(force, "after_max") / number(force, "limit"))
    };
    let sure = &["--confidence", "0.95"];
    let [thin, thick] = ["feed_per_tooth = { 1 = 0.01 }\n", "feed_per_tooth = { 1 = 2 }\n"];
    let (free, as_measured, beyond) = (of("", sure), of(thick, sure), of(thin, sure));
    assert_eq!(free, as_measured);
    assert_eq!(of(thin, &[]), of("", &[]));
    // Of the 80 N that the model has at 0.0185 mm in the slot 43 N are the edge's. At 0.01 mm it has 63 N: in proportion from there on the
    // limit is met at 0.0127 mm, where the model has 68 N.
    assert!(beyond.0 > free.0 && (beyond.1 - 68.4 / 80.0).abs() < 0.005, "{free:?} {beyond:?}");
    let refused =
        feedwright(bench(&(setup() + "[process]\nfeed_per_tooth = { x = 1 }\n")).path(), &["optimize", "part.nc"]);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("x is no tool"), "{refused:?}");
}

#[test]
fn a_limit_on_the_rate_of_force_slows_entries_and_exits_only() {
    let blocks = |setup: &str| report(bench(setup).path(), &[]);
    let free = blocks(&setup());
    let held = blocks(&setup().replace("force_xy = 80", "force_xy = 80\nforce_rate = \"0.4 kN/s\""));
    assert!(time(&held) > time(&free));
    let active = |report: &Value| {
        let limits = report["limits"].as_array().unwrap();
        limits.iter().any(|limit| limit["name"] == "force_rate" && limit["active_time_percent"].as_f64().unwrap() > 0.0)
    };
    assert!(active(&held) && !active(&free));
    // The written file keeps it, at the finer spacing of the check.
    let ratio = held["check"]["resimulated_force_rate_ratio"].as_f64().unwrap();
    assert!(ratio > 0.3 && ratio <= 1.01, "{ratio}");
    assert!(free["check"]["resimulated_force_rate_ratio"].is_null());
}

/// A price is the time that one more unit of the limit saves, in the unit that the report shows, and stands where the limit binds: not beside
/// the limit of a second tool, nor beside what the spindle could give.
#[test]
fn prices_of_the_report_are_what_one_percent_saves() {
    let second = "T2 M6\nS8000 M3\nG0 X-10 Y19\nG0 Z-2.4\nG1 X50 F300\nG0 Z10\nM30";
    let program = PROGRAM.replace("G0 Z10\nM30", &format!("G0 Z10\n{second}"));
    let tool =
        "[[tool]]\nnumber = 2\nshape = \"flat\"\ndiameter = 10\nflutes = 3\n[limits]\nfeed_change = { max = 4 }\n";
    for (name, value) in [("force_xy", 80.0), ("torque", 0.35), ("power", 420.0)] {
        let told = |value: f64| {
            let setup = slot::SETUP.replace("[limits]\n", &format!("{tool}{name} = {value}\n"));
            let dir = bench(&setup);
            fs::write(dir.path().join("part.nc"), &program).unwrap();
            report(dir.path(), &[])
        };
        let (found, more) = (told(value), told(1.01 * value));
        let rows: Vec<&Value> = found["limits"].as_array().unwrap().iter().filter(|row| row["name"] == name).collect();
        let priced: Vec<&&Value> = rows.iter().filter(|row| !row["shadow_price"].is_null()).collect();
        assert!(priced.len() == 1 && priced[0]["tool"] == 1 && rows.len() > 1, "{rows:?}");
        let (price, limit) = (number(priced[0], "shadow_price"), number(priced[0], "limit"));
        let slope = (time(&more) - time(&found)) / (0.01 * limit);
        println!("{name}: told {price} s per {}, found {slope}", priced[0]["unit"]);
        assert!(price < 0.0 && (price / slope - 1.0).abs() < 0.15, "{name}: told {price}, found {slope}");
    }
}

#[test]
fn a_load_that_a_tool_does_not_meet_limits_nothing() {
    // A drill has no force in the plane: its own loads give no limit on it, and no price is told beyond the time there is.
    let drill = PROGRAM.replace("G0 Z10\nM30", "G0 Z10\nT2 M6\nS3000 M3\nG0 X20 Y10\nG1 Z-8 F200\nG0 Z10\nM30");
    let setup =
        setup().replace("[limits]", "[[tool]]\nnumber = 2\nshape = \"drill\"\ndiameter = 5\nflutes = 2\n[limits]");
    let dir = bench(&setup.replace("force_xy = 80\n", ""));
    fs::write(dir.path().join("part.nc"), drill).unwrap();
    let found = report(dir.path(), &["--reference", "self", "--stress"]);
    for limit in found["limits"].as_array().unwrap() {
        assert!(limit["limit"].as_f64().is_none_or(|limit| limit > 1e-9), "{limit}");
        let saved = 0.01 * limit["shadow_price"].as_f64().unwrap_or(0.0) * limit["limit"].as_f64().unwrap_or(0.0);
        assert!(saved.abs() <= 0.05 * time(&found), "{limit}");
    }
    for case in found["stress"].as_array().unwrap() {
        assert!(case["worst_ratio"].as_f64().unwrap() < 10.0, "{case}");
    }
}

#[test]
fn an_operation_that_no_move_is_under_is_said() {
    let warned = |matches: &str| {
        let setup = format!("{}[[operation]]\nmatch = {{ {matches} }}\nmode = \"keep\"\n", setup());
        let found = report(bench(&setup).path(), &[]);
        !warnings(&found, "setup::idle-operation").is_empty()
    };
    assert!(warned("tool = 7") && warned("comment = \"FINISH\"") && warned("lines = [90, 95]"));
    assert!(!warned("tool = 1") && !warned("lines = [6, 8]") && !warned("surface = \"final\""));
}

/// Largest F of a program.
fn largest_f(text: &str) -> f64 {
    let code = text.lines().map(|line| line.split('(').next().unwrap());
    let words = code.flat_map(str::split_whitespace).filter_map(|word| word.strip_prefix('F'));
    words.map(|number| number.parse().unwrap()).fold(0.0, f64::max)
}

/// With notes or without, a second run counts `feed_change` from the feeds of the original: nothing is doubled twice.
#[test]
fn the_original_feeds_are_known_with_and_without_notes() {
    for annotate in ["none", "changes"] {
        let wide = setup().replace("force_xy = 80", "force_xy = 300\nfeed_change = { max = 2 }");
        let dir = bench(&format!("{wide}[output]\nannotate = \"{annotate}\"\n"));
        let mut written = Vec::new();
        for run in ["1.nc", "2.nc", "3.nc"] {
            let found = report(dir.path(), &["-o", run]);
            assert!(warnings(&found, "rewrite::forgotten").is_empty(), "{annotate} {run}");
            fs::copy(dir.path().join(run), dir.path().join("part.nc")).unwrap();
            written.push(fs::read_to_string(dir.path().join(run)).unwrap());
        }
        assert!(largest_f(&written[0]) > 1000.0, "{}", written[0]);
        assert_eq!(written[0], written[1], "{annotate}");
        assert_eq!(written[1], written[2], "{annotate}");
        // Somebody changed a feed: nobody knows any more what it was, and nothing is raised.
        let f = format!("F{:.0}", largest_f(&written[0]));
        assert!(written[0].contains(&f), "{}", written[0]);
        fs::write(dir.path().join("part.nc"), written[0].replacen(&f, "F950", 1)).unwrap();
        let found = report(dir.path(), &["-o", "4.nc"]);
        assert!(!warnings(&found, "rewrite::forgotten").is_empty(), "{annotate}");
        let again = fs::read_to_string(dir.path().join("4.nc")).unwrap();
        assert!(largest_f(&again) <= largest_f(&written[0]) && again.contains("F950"), "{again}");
    }
}

#[test]
fn a_wear_budget_is_kept_and_priced() {
    let with = |most: f64| {
        let line = format!("force_xy = 80\nwear = {{ exponent = 1.2, most = {most} }}");
        report(bench(&setup().replace("force_xy = 80", &line)).path(), &[])
    };
    let (slack, held) = (with(10.0), with(0.4));
    assert!(slack["wear"][0]["used"].as_f64().unwrap() < 10.0 && slack["wear"][0]["percent_saves_s"] == 0.0);
    assert!((held["wear"][0]["used"].as_f64().unwrap() - 0.4).abs() < 1e-6, "{}", held["wear"]);
    assert!(held["wear"][0]["percent_saves_s"].as_f64().unwrap() > 0.0 && time(&held) > time(&slack));
}

#[test]
fn feed_marks_on_final_surfaces_are_those_of_the_closed_form() {
    let dir = bench(&setup());
    let found = report(dir.path(), &[]);
    let surface = &found["final_surface"];
    // 900 mm/min at 8000 rev/min and three teeth: f_t = 0.0375 mm; R = 3 mm.
    let mark = 0.0375f64.powi(2) / (8.0 * 3.0);
    let at = |key: &str, i: usize| surface[key][i].as_f64().unwrap();
    assert!((at("mark_max_mm", 0) / mark - 1.0).abs() < 1e-9, "{surface}");
    assert!(at("mark_mean_mm", 1) <= at("mark_max_mm", 1) && at("commanded_s", 0) > 0.0);
    let highest = 0.0375f64 * 2.0;
    assert!(at("mark_max_mm", 1) <= highest.powi(2) / 24.0 * (1.0 + 1e-9), "{surface}");
    // A plunge leaves none on the wall that it cuts, however fast.
    let plunge = "G21 G90 G17\nT1 M6\nS8000 M3\nG0 X10 Y10 Z2\nG1 Z-2 F3000\nG1 X30 F900\nG0 Z5\nM2\n";
    fs::write(dir.path().join("part.nc"), plunge).unwrap();
    let plunged = &report(dir.path(), &[])["final_surface"];
    assert!((plunged["mark_max_mm"][0].as_f64().unwrap() / mark - 1.0).abs() < 1e-9, "{plunged}");
}

#[test]
fn setups_that_make_no_sense_are_refused() {
    let axes =
        |x: &str| format!("[machine.axes]\nx = {{ velocity = 15000, acceleration = {x}, jerk = 20000 }}\n[stock]");
    let tolerance = |value: &str| format!("dialect = \"linuxcnc\"\ncorner_tolerance = {value}");
    let cases = [
        (setup().replace("[stock]", &axes("0")), "`machine.axes.x.acceleration`: 0 makes no sense"),
        (setup().replace("[stock]", &axes("-5")), "`machine.axes.x.acceleration`: -5 makes no sense"),
        (setup().replace("[stock]", &axes("nan")), "`machine.axes.x.acceleration`: NaN cannot be used"),
        (
            setup().replace("[stock]", "[machine.spindle]\npower = [[0, 0], [6000, 5000], [1500, 7500]]\n[stock]"),
            "`machine.spindle.power`: the first numbers of its points must rise",
        ),
        (
            setup().replace("dialect = \"linuxcnc\"", &tolerance("-0.01")),
            "`machine.corner_tolerance`: -0.01 makes no sense",
        ),
        (setup().replace("dialect = \"linuxcnc\"", &tolerance("0")), "`machine.corner_tolerance`: 0 makes no sense"),
        (setup().replace("force_xy = 80", "force_xy = nan"), "`limits.force_xy`: NaN cannot be used"),
        (setup().replace("force_xy = 80", "force_xy = 80\nforce_rate = 0"), "`limits.force_rate`: 0 makes no sense"),
        (setup().replace("force_xy = 80", "force_xy = 80\nwear = { exponent = 2.5 }"), "`limits.wear.exponent`: 2.5"),
    ];
    for (setup, wanted) in &cases {
        let dir = bench(setup);
        let out = feedwright(dir.path(), &["optimize", "part.nc"]);
        let said = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{setup}\n{said}");
        assert!(said.contains(wanted) && said.contains("help:"), "{wanted}: {said}");
        assert!(!dir.path().join("part.fw.nc").exists());
    }
}

#[test]
fn a_feed_that_cannot_be_read_is_said_and_its_block_stays() {
    let dir = bench(&setup());
    for feed in ["F", "F..5"] {
        fs::write(dir.path().join("part.nc"), PROGRAM.replace("F900", feed)).unwrap();
        let found = report(dir.path(), &[]);
        let warnings = found["warnings"].as_array().unwrap();
        let said = |warning: &Value| warning["code"] == "nc::not-understood" && warning["line"] == 7;
        assert!(warnings.iter().any(said), "{feed}: {warnings:?}");
        let written = fs::read_to_string(dir.path().join("part.fw.nc")).unwrap();
        assert!(written.contains(&format!("G1 X50 {feed}\n")), "{written}");
        // Nothing was changed, so the copy bears no mark and would not be replaced.
        fs::remove_file(dir.path().join("part.fw.nc")).unwrap();
    }
}

#[test]
fn nan_or_infinity_in_a_program_is_said_and_nothing_is_written() {
    let texts = [
        ("linuxcnc", "FNAN"),
        ("linuxcnc", "F NaN"),
        ("linuxcnc", "F-inf"),
        ("linuxcnc", "Finfinity"),
        ("linuxcnc", "F[nan]"),
        ("linuxcnc", "YNAN F900"),
        ("linuxcnc", "#3=nan F900"),
        ("fanuc", "FNAN"),
        ("grbl", "f nan"),
        ("siemens", "F=NAN"),
        ("siemens", "FNAN"),
        ("siemens", "F inf"),
    ];
    for (dialect, text) in texts {
        let dir = bench(&setup());
        fs::write(dir.path().join("part.nc"), PROGRAM.replace("F900", text)).unwrap();
        for command in ["optimize", "simulate", "limits"] {
            let words = [command, "part.nc", "--dialect", dialect, "--json", "r.json"];
            let out = feedwright(dir.path(), &words);
            let said = String::from_utf8_lossy(&out.stderr);
            assert_eq!(out.status.code(), Some(2), "{dialect} {command} {text}: {said}");
            assert!(said.contains("nc::not-finite") && said.contains("part.nc:7:"), "{dialect} {text}: {said}");
            assert!(said.contains("help: write a plain decimal number"), "{dialect} {text}: {said}");
            let files = fs::read_dir(dir.path()).unwrap().count();
            assert_eq!(files, 2, "{dialect} {command} {text} wrote something");
        }
    }
}

#[test]
fn nan_and_a_feed_without_a_number_are_said_in_plain_language_too() {
    let setup = setup().replace("linuxcnc", "heidenhain");
    for (block, status, code) in [
        ("L X+50 F600", 0, ""),
        ("L X+50 FQ1", 0, ""),
        ("L X+50 F AUTO", 0, ""),
        ("L X+50 FNAN", 2, "nc::not-finite"),
        ("L X+50 F inf", 2, "nc::not-finite"),
        ("L X+NAN F600", 2, "nc::not-finite"),
        ("L X+50 F", 0, "nc::not-understood"),
        ("L X+50 FFOO", 0, "nc::not-understood"),
    ] {
        let program = format!(
            "BEGIN PGM A MM\nTOOL CALL 1 Z S8000 F300\nQ1 = 500\nL X-10 Y+5 Z+2 R0 FMAX M3\nL Z-1 F300\n{block}\n\
            L Y+9 F900\nL Z+10 FMAX M30\nEND PGM A MM\n"
        );
        let dir = slot::bench(&program, &setup);
        let out = feedwright(dir.path(), &["optimize", "part.nc"]);
        let said = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(status), "{block}: {said}");
        assert_eq!(dir.path().join("part.fw.nc").exists(), status == 0, "{block}");
        if code.is_empty() {
            assert!(!said.contains("nc::"), "{block}: {said}");
            continue;
        }
        assert!(said.contains(code) && said.contains("part.nc:6:"), "{block}: {said}");
        if status == 0 {
            assert!(fs::read_to_string(dir.path().join("part.fw.nc")).unwrap().contains(&format!("\n{block}\n")));
        }
    }
}

#[test]
fn nan_in_any_number_of_the_setup_is_said_and_nothing_is_written() {
    let text = "units = \"mm\"\nresolution = 0.5\n[machine]\nrapid = 15000\ncorner_tolerance = 0.02\nblock_time = 0.002\n\
        tool_change_time = 6\nhome = [0, 0, 200]\n[machine.axes]\nx = { velocity = 15000, acceleration = 1500, jerk = 20000 }\n\
        [machine.spindle]\nmax_rpm = 12000\npower = [[0, 10], [1500, 7500], [12000, 7500]]\ntare = [[1000, 120], [12000, 480]]\n\
        efficiency = 0.92\nrunup_time = 1.5\n[offsets]\nG55 = [200, 0, 0]\n[stock]\n\
        box = { min = [0, 0, -10], max = [40, 20, 0] }\nuncertainty = 0.5\n[[fixture]]\nbox = { min = [90, 90, -20], max = [99, 99, 5] }\n\
        [material]\nk_tc = 800\nk_te = 14\n[[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 6\nflutes = 3\nhelix = 30\n\
        flute_length = 22\noverhang = 35\nrunout = { offset = 0.001, angle = 95 }\nholder = [[32, 40], [50, 30]]\n[limits]\n\
        force_xy = 500\nforce_normal_mean = 100\nforce_axial = 300\npower = 4500\ndeflection = 0.03\nsurface_error = 0.03\n\
        bending_stress = 900\nchip_thickness = { min = 0.001, max = 0.15 }\nfeed = { min = 100, max = 6000 }\n\
        feed_per_tooth = { max = 0.2 }\nfeed_change = { min = 0.2, max = 2.0 }\nair_feed = 6000\napproach = 2\n[[operation]]\n\
        match = { lines = [1, 20] }\nentry = { feed = 300, distance = 2 }\n[output]\nminimum_change = 0.05\nminimum_length = 0.5\n";
    let dir = bench(text);
    assert!(feedwright(dir.path(), &["simulate", "part.nc"]).status.code().is_some_and(|code| code < 2));
    let digit = |at: usize| text[at..].starts_with(|c: char| c.is_ascii_digit());
    let begins =
        |at: &usize| digit(*at) && !text[..*at].ends_with(|c: char| c.is_ascii_alphanumeric() || c == '.' || c == '_');
    let numbers: Vec<usize> = (0..text.len()).filter(begins).collect();
    assert!(numbers.len() > 70);
    for at in numbers {
        let end = at + text[at..].find(|c: char| !c.is_ascii_digit() && c != '.').unwrap();
        fs::write(dir.path().join("part.setup.toml"), format!("{}nan{}", &text[..at], &text[end..])).unwrap();
        let out = feedwright(dir.path(), &["optimize", "part.nc"]);
        let said = String::from_utf8_lossy(&out.stderr);
        let line = text[..at].matches('\n').count() + 1;
        let shown = text.lines().nth(line - 1).unwrap();
        assert_eq!(out.status.code(), Some(2), "{shown}: {said}");
        assert!(said.contains(&format!("part.setup.toml:{line}:")) || said.contains('`'), "{shown}: {said}");
        assert!(said.contains("help:") && !dir.path().join("part.fw.nc").exists(), "{shown}: {said}");
    }
}
