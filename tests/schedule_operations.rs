//! `[[operation]]` in all its ways to choose moves and to treat them, and excluded lines, through the command.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/slot.rs"]
mod slot;

use serde_json::Value;
use slot::{SETUP, bench, feedwright, limit, number, optimized, warnings};
use std::fs;
use std::path::Path;

/// Two tools, two comments, passes from air to air at lines 7 to 13 (the first tool) and 19 to 21 (the second).
const PROGRAM: &str = "%\nG21 G90\nT1 M6\nS8000 M3\nG0 X-10 Y5 Z2\n(ROUGH)\nG1 Z-2 F900\nX50\nY8\n(FINISH WALL)\nX-10\nY11\nX50\n(DONE)\n\
    G0 Z10\nT2 M6\nS8000 M3\nG0 X50 Y17 Z2\nG1 Z-2 F900\nX-10\nX-20\nG0 Z10\nM30\n%\n";

fn setup(rest: &str) -> String {
    let second = "[[tool]]\nnumber = 2\nshape = \"flat\"\ndiameter = 5\nflutes = 3\noverhang = 30\n[limits]\n";
    SETUP.replace("[limits]\n", second) + "force_xy = 70\n" + rest
}

/// The report, and line and feed in mm/min of every station as written.
fn run(rest: &str) -> (Value, Vec<(u64, f64)>) {
    let dir = bench(PROGRAM, &setup(rest));
    let report = optimized(dir.path(), &[]);
    (report, feeds(dir.path()))
}

fn feeds(dir: &Path) -> Vec<(u64, f64)> {
    let mut reader = csv::Reader::from_path(dir.join("r.csv")).unwrap();
    let at = |name: &str| reader.headers().unwrap().iter().position(|header| header == name).unwrap();
    let [line, feed, motion] = ["line", "feed_after_mm_min", "motion"].map(at);
    let records = reader.records().map(Result::unwrap).filter(|record| &record[motion] != "rapid");
    records.map(|record| (record[line].parse().unwrap(), record[feed].parse().unwrap())).collect()
}

/// Lines whose feed differs from 900 anywhere.
fn changed(feeds: &[(u64, f64)]) -> Vec<u64> {
    let mut lines: Vec<u64> = feeds.iter().filter(|(_, feed)| *feed != 900.0).map(|(line, _)| *line).collect();
    lines.dedup();
    lines
}

#[test]
fn every_way_to_choose_moves_keeps_those_and_no_others() {
    let all = changed(&run("").1);
    assert!([8, 11, 13, 20].iter().all(|line| all.contains(line)), "{all:?}");
    for (matches, kept) in [
        ("tool = 1", 7..=13),
        ("tool = 2", 19..=21),
        ("comment = \"finish\"", 11..=13),
        ("lines = [8, 9]", 8..=9),
        ("tool = 1, lines = [10, 30]", 10..=13),
    ] {
        let (report, feeds) = run(&format!("[[operation]]\nmatch = {{ {matches} }}\nmode = \"keep\"\n"));
        let wanted: Vec<u64> = all.iter().copied().filter(|line| !kept.contains(line)).collect();
        assert_eq!(changed(&feeds), wanted, "{matches}");
        assert!(warnings(&report, "setup::idle-operation").is_empty(), "{matches}");
    }
    // The walls are left by some of the moves only: those keep their feed.
    let walls = changed(&run("[[operation]]\nmatch = { surface = \"final\" }\nmode = \"keep\"\n").1);
    assert!(walls.len() < all.len() && walls.iter().all(|line| all.contains(line)), "{walls:?} of {all:?}");
    // The last that matches wins.
    let two = "[[operation]]\nmatch = { tool = 1 }\nmode = \"keep\"\n[[operation]]\nmatch = { lines = [8, 8] }\nmode = \"optimise\"\n";
    let lines = changed(&run(two).1);
    assert!(lines.contains(&8) && !lines.contains(&11), "{lines:?}");
}

#[test]
fn slow_only_never_raises_and_optimise_does() {
    let most = |mode: &str| {
        let with = format!("air_feed = 3000\n[[operation]]\nmatch = {{ tool = 1 }}\nmode = \"{mode}\"\n");
        let feeds = run(&with).1;
        let first = feeds.iter().filter(|(line, _)| *line <= 13).map(|(_, feed)| *feed);
        first.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), feed| (low.min(feed), high.max(feed)))
    };
    let (low, high) = most("optimise");
    assert!(low < 900.0 && high > 900.0, "{low} {high}");
    let (low, high) = most("slow-only");
    assert!(low < 900.0 && high <= 900.0, "{low} {high}");
    assert_eq!(most("keep"), (900.0, 900.0));
}

#[test]
fn limits_of_an_operation_hold_for_its_moves() {
    let (report, _) = run("[[operation]]\nmatch = { tool = 2 }\nlimits = { force_xy = 40 }\n");
    let largest = |first: u64, last: u64| {
        let blocks = report["blocks"].as_array().unwrap().iter();
        let of = blocks.filter(|block| (first..=last).contains(&block["line"].as_u64().unwrap()));
        of.map(|block| block["after"]["force_xy_peak_n"].as_f64().unwrap_or(0.0)).fold(0.0, f64::max)
    };
    assert!(largest(7, 13) > 60.0 && largest(19, 21) <= 40.0 * 1.01, "{} {}", largest(7, 13), largest(19, 21));
    assert!(number(limit(&report, "force_xy"), "after_max") <= 70.0 * 1.01);
}

#[test]
fn excluded_lines_keep_their_bytes_and_their_feed() {
    let dir = bench(PROGRAM, &setup("[output]\nexclude = [[10, 12]]\n"));
    optimized(dir.path(), &[]);
    let lines = changed(&feeds(dir.path()));
    assert!(
        lines.contains(&8) && lines.contains(&13) && !lines.iter().any(|line| (10..=12).contains(line)),
        "{lines:?}"
    );
    let written = fs::read_to_string(dir.path().join("part.fw.nc")).unwrap();
    assert!(written.contains("\n(FINISH WALL)\nX-10\nY11\n"), "{written}");
    let verified = feedwright(dir.path(), &["verify", "part.nc", "part.fw.nc"]);
    assert_eq!(verified.status.code(), Some(0));
}
