//! Any log a shop has: the same readings in the styles of many loggers are the same log, and `feedwright log` shows what was read. The
//! workbook is made by openpyxl where Python has it.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

use assert_cmd::Command;
use feedwright::learn::log::{Log, read_log};
use std::fmt::Write;
use tempfile::TempDir;

/// 60 readings at 10 Hz: time s, x mm, power W, rpm.
fn readings() -> Vec<[f64; 4]> {
    (0..60)
        .map(|k| (k, f64::from(k) * 0.1))
        .map(|(k, t)| [t, 2.0 * t, 300.0 + f64::from(k % 7) * 1.5, 8000.0])
        .collect()
}

/// A table of them: head, then each row by `row`.
fn table(head: &str, row: impl Fn([f64; 4]) -> String) -> String {
    let mut text = head.to_owned();
    for reading in readings() {
        writeln!(text, "{}", row(reading)).unwrap();
    }
    text
}

fn plain() -> String {
    table("time_s,x_mm,y_mm,z_mm,spindle_power_w,spindle_rpm\n", |[t, x, p, n]| format!("{t:.1},{x:.3},0,0,{p:.1},{n}"))
}

fn comma(value: f64, decimals: usize) -> String {
    format!("{value:.decimals$}").replace('.', ",")
}

fn close(a: &Log, b: &Log, name: &str) {
    let near = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-3);
    assert!(near(&a.time_s, &b.time_s), "{name}: times {:?} {:?}", &a.time_s[..3], &b.time_s[..3.min(b.time_s.len())]);
    assert_eq!(a.measured[0].0, b.measured[0].0, "{name}");
    assert!(near(&a.measured[0].1, &b.measured[0].1), "{name}: {:?}", &b.measured[0].1[..3]);
    let rpm = |log: &Log| log.rps.clone().unwrap();
    assert!(near(&rpm(a), &rpm(b)), "{name}: speed");
    let x = |log: &Log| log.position_mm.clone().unwrap()[0].clone();
    assert!(near(&x(a), &x(b)), "{name}: position");
}

#[test]
fn the_same_readings_in_many_styles_are_the_same_log() {
    let own = read_log(plain().as_bytes(), &[]).unwrap();
    let in_order: Vec<(String, String)> = ["time_s", "x_mm", "y_mm", "z_mm", "spindle_power_w", "spindle_rpm"]
        .iter()
        .map(|ours| (String::new(), (*ours).to_owned()))
        .collect();
    let counted: Vec<(String, String)> = in_order
        .iter()
        .map(|(theirs, ours)| (theirs.clone(), if ours == "time_s" { "sample_10hz".to_owned() } else { ours.clone() }))
        .collect();
    let german = [
        ("Zeit [s]", "time_s"),
        ("X-Ist [mm]", "x_mm"),
        ("Y-Ist [mm]", "y_mm"),
        ("Z-Ist [mm]", "z_mm"),
        ("Leistung [kW]", "spindle_power_kw"),
        ("Drehzahl", "spindle_rpm"),
    ]
    .map(|(theirs, ours)| (theirs.to_owned(), ours.to_owned()));
    for (name, text, mapping) in [
        (
            "semicolons and decimal commas",
            table("time_s;x_mm;y_mm;z_mm;spindle_power_w;spindle_rpm\n", |[t, x, p, n]| {
                format!("{};{};0,0;0,0;{};{n}", comma(t, 1), comma(x, 3), comma(p, 1))
            }),
            &[][..],
        ),
        (
            "a preamble, a row of units, tabs",
            table(
                "Scope 3.1\nMachine\tVMC\nComment\tfacing\n\nTime\tX\tY\tZ\tPower\tSpindle\ns\tmm\tmm\tmm\tkW\trpm\n",
                |[t, x, p, n]| format!("{}\t{}\t0,0\t0,0\t{}\t{n}", comma(t, 1), comma(x, 3), comma(p * 1e-3, 6)),
            ),
            &[],
        ),
        (
            "names of another language",
            table("Zeit;X-Ist;Y-Ist;Z-Ist;Leistung;Drehzahl\n[s];[mm];[mm];[mm];[kW];-\n", |[t, x, p, n]| {
                format!("{};{};0,0;0,0;{};{n}", comma(t, 1), comma(x, 3), comma(p * 1e-3, 6))
            }),
            &german,
        ),
        (
            "dates of ISO 8601",
            table("timestamp,x_mm,y_mm,z_mm,spindle_power_w,spindle_rpm\n", |[t, x, p, n]| {
                format!("2026-03-29T23:59:{:06.3}Z,{x:.3},0,0,{p:.1},{n}", 50.0 + t)
            }),
            &[],
        ),
        (
            "times of day over midnight",
            table("time,x_mm,y_mm,z_mm,spindle_power_w,spindle_rpm\n", |[t, x, p, n]| {
                let clock =
                    if t < 2.95 { format!("23:59:{:06.3}", 57.0 + t) } else { format!("00:00:{:06.3}", t - 3.0) };
                format!("{clock},{x:.3},0,0,{p:.1},{n}")
            }),
            &[],
        ),
        ("no header", table("", |[t, x, p, n]| format!("{t:.1} {x:.3} 0 0 {p:.1} {n}")), &in_order),
        (
            "names in a remark",
            table("# hal\n# time_s x_mm y_mm z_mm spindle_power_w spindle_rpm\n", |[t, x, p, n]| {
                format!("{t:.1} {x:.3} 0 0 {p:.1} {n}")
            }),
            &[],
        ),
        (
            "a counter of readings",
            table("", |[t, x, p, n]| format!("{:.0} {x:.3} 0 0 {p:.1} {n} ", t * 10.0)),
            &counted,
        ),
        (
            "bars, and thousands apart",
            table("time_s|x_mm|y_mm|z_mm|spindle_power_w|spindle_rpm\n", |[t, x, p, n]| {
                format!("{t:.1}|{x:.3}|0|0|{p:.1}|{},{:03}", n as u32 / 1000, n as u32 % 1000)
            }),
            &[],
        ),
        (
            "units of German drives, decimal commas in quotes",
            table("time [sec],x [mm],y [mm],z [mm],power [Watt],n [1/min]\n", |[t, x, p, n]| {
                format!("\"{}\",\"{}\",0,0,\"{}\",{n}", comma(t, 1), comma(x, 3), comma(p, 1))
            }),
            &[],
        ),
        (
            "minutes and seconds over the hour",
            table("time,x_mm,y_mm,z_mm,spindle_power_w,spindle_rpm\n", |[t, x, p, n]| {
                let (minutes, seconds) = if t < 2.95 { (59, 57.0 + t) } else { (0, t - 3.0) };
                format!("{minutes:02}:{seconds:04.1},{x:.3},0,0,{p:.1},{n}")
            }),
            &[],
        ),
        (
            "milliseconds",
            table("time_ms,x_mm,y_mm,z_mm,spindle_power_w,spindle_rpm\n", |[t, x, p, n]| {
                format!("{:.0},{x:.3},0,0,{p:.1},{n}", t * 1e3)
            }),
            &[],
        ),
    ] {
        let read = read_log(text.as_bytes(), mapping).unwrap_or_else(|error| panic!("{name}: {error}"));
        close(&own, &read, name);
    }
}

#[test]
#[cfg_attr(absent_openpyxl, ignore = "python3 with openpyxl is absent")]
fn a_workbook_is_the_same_log() {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("log.csv"), plain()).unwrap();
    let script = "import csv, openpyxl\nbook = openpyxl.Workbook()\nsheet = book.active\nsheet.append(['measured on a Tuesday'])\n\
        for row in csv.reader(open('log.csv')):\n    sheet.append([float(c) if c[0].isdigit() else c for c in row])\nbook.save('log.xlsx')\n";
    let made = std::process::Command::new("python3").args(["-c", script]).current_dir(folder.path()).output();
    assert!(made.is_ok_and(|output| output.status.success()));
    let own = read_log(plain().as_bytes(), &[]).unwrap();
    let bytes = std::fs::read(folder.path().join("log.xlsx")).unwrap();
    close(&own, &read_log(&bytes, &[]).unwrap(), "workbook");
    assert!(read_log(&bytes[..bytes.len() / 2], &[]).is_err());
}

fn run(folder: &TempDir, arguments: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("feedwright").unwrap().current_dir(folder.path()).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_log_is_shown_with_its_columns_its_clock_and_what_is_odd() {
    let folder = TempDir::new().unwrap();
    let text = table(
        "Zeit;X-Ist;Y-Ist;Z-Ist;Leistung;Drehzahl;Temperatur\n[s];[mm];[mm];[mm];[kW];-;[K]\n",
        |[t, x, p, n]| {
            // Four seconds are missing, and the spindle stands at the end.
            let (late, n) = (if t > 3.05 { t + 4.0 } else { t }, if t > 3.45 { 0.0 } else { n });
            format!("{};{};0,0;0,0;{};{n};293", comma(late, 1), comma(x, 3), comma(p * 1e-3, 6))
        },
    );
    std::fs::write(folder.path().join("log.csv"), text).unwrap();
    let (code, shown, said) = run(&folder, &["log", "log.csv", "--json", "seen.json"]);
    assert_eq!(code, 1, "nothing is read as a load yet: {shown}{said}");
    for words in ["semicolons, decimal comma, a row of units", "not used; spindle_power_kw?", "proposed  --columns"] {
        assert!(shown.contains(words), "{words}: {shown}");
    }
    assert!(shown.contains("temperatur_k") && shown.contains("constant"), "{shown}");
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("seen.json")).unwrap()).unwrap();
    let proposed = json["proposed"].as_object().unwrap();
    assert_eq!(proposed["leistung_kw"], "spindle_power_kw");
    assert_eq!(proposed["x_ist_mm"], "x_mm");
    assert!(!proposed.contains_key("temperatur_k"), "{proposed:?}");
    // What is proposed is taken as it is printed.
    let pairs: Vec<String> =
        proposed.iter().map(|(theirs, ours)| format!("{theirs}={}", ours.as_str().unwrap())).collect();
    let (code, shown, _) = run(&folder, &["log", "log.csv", "--columns", &pairs.join(",")]);
    assert_eq!(code, 0, "{shown}");
    for words in
        ["60 rows", "9.9 s, readings 0.1000 s apart, 10.0000 Hz", "gap       3.0 to 7.1 s", "the spindle stands"]
    {
        assert!(shown.contains(words), "{words}: {shown}");
    }
    // And written into a setup, once.
    std::fs::write(folder.path().join("s.toml"), "# mine\nunits = \"mm\"\n").unwrap();
    assert_eq!(run(&folder, &["log", "log.csv", "--write", "s.toml"]).0, 0);
    let setup = std::fs::read_to_string(folder.path().join("s.toml")).unwrap();
    assert!(
        setup.starts_with("# mine\nunits = \"mm\"\n\n[log]\ncolumns = {")
            && setup.contains("\"leistung_kw\" = \"spindle_power_kw\""),
        "{setup}"
    );
    assert!(setup.parse::<toml::Table>().is_ok(), "{setup}");
    let (code, _, said) = run(&folder, &["log", "log.csv", "--write", "s.toml"]);
    assert!(code == 2 && said.contains("[log] table already"), "{said}");
}

#[test]
fn what_is_no_log_is_refused_and_two_columns_of_a_kind_are_said() {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("empty.csv"), "").unwrap();
    std::fs::write(folder.path().join("twice.csv"), plain().replace("spindle_rpm", "power")).unwrap();
    std::fs::write(folder.path().join("part.xml"), "<MTConnectStreams><Streams").unwrap();
    assert_eq!(run(&folder, &["log", "empty.csv"]).0, 2);
    assert_eq!(run(&folder, &["log", "part.xml"]).0, 2);
    let (_, shown, _) = run(&folder, &["log", "twice.csv"]);
    assert!(shown.contains("columns spindle_power_w and power are both spindle_power"), "{shown}");
    let (code, _, said) = run(&folder, &["log", "twice.csv", "--columns", "a,b"]);
    assert!(code == 2 && said.contains("names 2 columns; the data have 6"), "{said}");
}
