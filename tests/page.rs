//! The page in a real browser: drawn, pointed at, clicked, turned, played, on a narrow screen, in the dark, without WebGL2. Needs
//! chromium, node and playwright-core (`.ci/run` installs them); says so where they are absent.

#![allow(clippy::unwrap_used, clippy::format_collect)]

use assert_cmd::cargo::CommandCargoExt;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const SETUP: &str = r#"
[machine]
dialect = "linuxcnc"
[stock]
material = "aluminium-6061-t6"
box = { min = [0, 0, -10], max = [60, 40, 0] }
[[tool]]
number = 1
shape = "flat"
diameter = 8
flutes = 3
overhang = 30
[limits]
force_xy = 180
"#;

/// Its comment would end the block of data and run, were it not escaped.
const PROGRAM: &str = "%\n(T1 ROUGH </script><script>alert(1)</script> & \"SLOT\")\nG21 G17 G90 G94\nT1 M6\nS8000 M3\nG0 X-6 Y10\nG0 Z2\nG1 Z-3 F300\nG1 X30 F600\nG2 X30 Y26 I0 J8\nG1 X-6\nG0 Z5\n(FINISH WALL)\nG0 X-6 Y34\nG1 Z-2 F300\nG1 X66 F500\nG0 Z20\nM5\nM30\n%\n";

/// The page of a program that `optimize` rewrites.
fn page(folder: &Path, program: &str, setup: &str) -> PathBuf {
    fs::write(folder.join("part.nc"), program).unwrap();
    fs::write(folder.join("part.setup.toml"), setup).unwrap();
    let mut command = Command::cargo_bin("feedwright").unwrap();
    let done = command.current_dir(folder).args(["optimize", "part.nc", "--report", "r.html"]).output().unwrap();
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    folder.join("r.html")
}

/// The data of a page.
fn data(html: &str) -> Value {
    let (_, rest) = html.split_once("id=\"data\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

fn column<'a>(data: &'a Value, path: &str) -> &'a Vec<Value> {
    data.pointer(path).unwrap().as_array().unwrap()
}

#[test]
fn the_data_of_the_page_hang_together() {
    let dir = tempfile::tempdir().unwrap();
    let html = fs::read_to_string(page(dir.path(), PROGRAM, SETUP)).unwrap();
    assert!(!html.contains("<script>alert"), "text of the program became markup");
    assert_eq!(html.matches("</script>").count(), 2);
    // The name of the language of drawings is no address.
    let plain = html.replace("http://www.w3.org/2000/svg", "");
    let others = ["href=", "src=", "http://", "https://"];
    assert_eq!(others.iter().find(|other| plain.contains(**other)), None, "it needs another file");
    assert_eq!(
        html.split_once("<ol id=\"checks\">").unwrap().1.split_once("</ol>").unwrap().0.matches("<li>").count(),
        3
    );
    let data = data(&html);
    let samples = column(&data, "/samples/line").len();
    assert!(samples > 20);
    for (key, values) in data["samples"].as_object().unwrap() {
        assert_eq!(values.as_array().unwrap().len(), samples, "{key}");
    }
    let points = column(&data, "/points/x").len() as u64;
    for (from, to) in column(&data, "/samples/p0").iter().zip(column(&data, "/samples/p1")) {
        assert!(from.as_u64().unwrap() <= to.as_u64().unwrap() && to.as_u64().unwrap() < points);
    }
    // The half circle of radius 8 is drawn as one: its points lie on it, closely.
    let on_arc = column(&data, "/points/x").iter().zip(column(&data, "/points/y")).filter(|(x, y)| {
        let (x, y) = (x.as_f64().unwrap() - 30.0, y.as_f64().unwrap() - 18.0);
        x < -0.1 && ((x * x + y * y).sqrt() - 8.0).abs() < 1e-3
    });
    assert!(on_arc.count() >= 25);
    // Time ends where the moves end, and both texts are in the listing.
    let ends = |key: &str| column(&data, key).last().unwrap().as_f64().unwrap();
    let moves = |side: usize| -> f64 {
        column(&data, "/operations").iter().map(|one| one["time_s"][side].as_f64().unwrap()).sum()
    };
    assert!((ends("/samples/before_s") - moves(0)).abs() < 0.01 && (ends("/samples/after_s") - moves(1)).abs() < 0.01);
    let names: Vec<&str> = column(&data, "/operations").iter().map(|one| one["name"].as_str().unwrap()).collect();
    assert_eq!(names.last().unwrap(), &"T1 FINISH WALL", "{names:?}");
    let listing = column(&data, "/listing");
    let old: String = listing.iter().map(|row| format!("{}\n", row[1].as_str().unwrap())).collect();
    assert_eq!(old, PROGRAM);
    let written = fs::read_to_string(dir.path().join("part.fw.nc")).unwrap();
    let new: String = listing
        .iter()
        .flat_map(|row| match row[2].as_array() {
            Some(lines) => lines.iter().map(|line| format!("{}\n", line.as_str().unwrap())).collect::<Vec<_>>(),
            None => vec![format!("{}\n", row[1].as_str().unwrap())],
        })
        .collect();
    assert_eq!(new, written);
}

#[test]
fn a_long_program_is_joined_and_its_largest_load_stays() {
    // A wave in 30,000 short blocks; somewhere in it one pass is deeper.
    let mut program =
        String::from("%\nG21 G17 G90 G94\nT1 M6\nS8000 M3\nG0 X0 Y10\nG0 Z2\nG1 Z-1 F300\nG1 X0.002 F600\n");
    for k in 1..=30_000 {
        let (x, deep) = (f64::from(k) * 0.002, if k == 17_000 { 1.2 } else { 1.0 });
        program += &format!("X{x:.3} Z-{deep:.3}\n");
    }
    program += "G0 Z20\nM30\n%\n";
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("part.nc"), &program).unwrap();
    fs::write(dir.path().join("part.setup.toml"), SETUP).unwrap();
    let mut command = Command::cargo_bin("feedwright").unwrap();
    let reports = ["simulate", "part.nc", "--report", "r.html", "--json", "r.json"];
    assert!(command.current_dir(dir.path()).args(reports).status().unwrap().success());
    let report: Value = serde_json::from_slice(&fs::read(dir.path().join("r.json")).unwrap()).unwrap();
    let data = data(&fs::read_to_string(dir.path().join("r.html")).unwrap());
    let samples = column(&data, "/samples/line").len();
    assert!((10_000..=20_000).contains(&samples), "{samples}");
    let largest = column(&data, "/loads/0/before").iter().filter_map(Value::as_f64).fold(0.0, f64::max);
    let known = report["limits"][0]["before_max"].as_f64().unwrap();
    assert!((largest / known - 1.0).abs() < 1e-3, "{largest} {known}");
}

#[test]
#[cfg_attr(absent_browser, ignore = "chromium, node or tests/browser/node_modules is not there")]
fn a_page_in_a_browser() {
    let dir = tempfile::tempdir().unwrap();
    let seen = seen(&page(dir.path(), PROGRAM, SETUP));
    assert_eq!(seen["noise"], serde_json::json!([]), "the browser complains");
    let many = |key: &str| seen[key].as_u64().unwrap();
    for canvas in ["above", "curves", "space", "dark_above", "above_without_webgl"] {
        assert!(many(canvas) > 12, "{canvas} is blank: {seen}");
    }
    for text in ["hover_above", "hover_curves"] {
        let text = seen[text].as_str().unwrap();
        let number: usize = text.strip_prefix("Line ").unwrap().split(',').next().unwrap().parse().unwrap();
        assert!(text.contains(PROGRAM.lines().nth(number - 1).unwrap()), "{text}");
    }
    assert!(
        many("clicked") >= 1
            && seen["hover_above"].as_str().unwrap().starts_with(&format!("Line {},", many("clicked_line")))
    );
    assert_eq!(many("checks"), 3);
    assert!(seen["verdict"].as_str().unwrap().contains("Within its limits"), "{seen}");
    for what in ["listing_moves_the_cursor", "turns", "without_webgl"] {
        assert_eq!(seen[what], true, "{what}: {seen}");
    }
    assert!(many("changed_rows") > 0 && (1..1000).contains(&many("played_to")), "{seen}");
    assert_eq!(seen["too_wide_at_400"], 0);
}

/// What a headless browser saw of a page.
fn seen(page: &Path) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/page.mjs");
    let chromium = Command::new("sh").args(["-c", "command -v chromium"]).output().unwrap().stdout;
    let chromium = String::from_utf8(chromium).unwrap();
    let done = Command::new("node").arg(script).arg(page).env("CHROMIUM", chromium.trim()).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    serde_json::from_slice(&done.stdout).unwrap()
}
