//! Heidenhain plain language beyond its straight lines: polar and tangential motions, corners, labels, jumps, cycles that
//! move the zero; and how its feeds are rewritten though no line may be put in.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/rewriting.rs"]
mod rewriting;

use feedwright::nc::{self, Dialect, Environment, Freeze, Toolpath};
use feedwright::path::Curve;
use rewriting::{check, job, parse, schedule, surroundings, toolpath};

/// The lines between BEGIN and END, numbered.
fn program(lines: &str) -> String {
    let all = std::iter::once("BEGIN PGM T MM").chain(lines.lines()).chain(std::iter::once("END PGM T MM"));
    all.enumerate().map(|(k, line)| format!("{k} {}\n", line.trim())).collect()
}

fn read(lines: &str) -> Toolpath {
    let environment = Environment { max_repeated_bytes: 1 << 18, ..Environment::default() };
    nc::interpret(&nc::parse(program(lines).into_bytes(), Some(Dialect::Heidenhain)), &environment)
}

fn ends(path: &Toolpath) -> Vec<[f64; 2]> {
    let round = |value: f64| (value * 1e3).round() / 1e3 + 0.0;
    path.moves.iter().map(|m| m.curve().to()).map(|p| [round(p.x), round(p.y)]).collect()
}

#[track_caller]
fn assert_ends(lines: &str, expected: &[[f64; 2]]) -> Toolpath {
    let path = read(lines);
    assert!(path.diagnostics.is_empty(), "{lines}: {:?}", path.diagnostics);
    assert_eq!(ends(&path), expected, "{lines}");
    path
}

#[test]
fn polar_and_tangential_motions() {
    assert_ends("CC X+10 Y+10\nLP PR+10 PA+0 R0 F100\nLP PA+90\nLP IPA+90", &[[20.0, 10.0], [10.0, 20.0], [0.0, 10.0]]);
    let path = assert_ends(
        "CC X+0 Y+0\nL X+10 Y+0 R0 F100\nCP PA+90 DR+\nCP IPA+720 IZ-4 DR+",
        &[[10.0, 0.0], [0.0, 10.0], [0.0, 10.0]],
    );
    let Curve::Arc(helix) = path.moves[2].curve() else { panic!("a helix") };
    assert!((helix.sweep_rad - 2.0 * std::f64::consts::TAU).abs() < 1e-9 && (helix.rise_mm + 4.0).abs() < 1e-9);
    let path = assert_ends("L X+10 R0 F100\nCT X+20 Y+10", &[[10.0, 0.0], [20.0, 10.0]]);
    assert!(matches!(path.moves[1].curve(), Curve::Arc(arc) if (arc.radius_mm - 10.0).abs() < 1e-9));
}

#[test]
fn corners_stand_in_blocks_of_their_own() {
    let lines = "L X+10 R0 F100\nRND R2\nL Y+10\nCHF 3\nL X+0";
    assert_ends(lines, &[[8.0, 0.0], [10.0, 2.0], [10.0, 7.0], [7.0, 10.0], [0.0, 10.0]]);
}

#[test]
fn labels_and_jumps() {
    let count = "Q1 = 0\nLBL 1\nL IX+1 R0 F100\nQ1 = Q1 + 1\nFN 12: IF +Q1 LT +3 GOTO LBL 1\nL Y+5";
    assert_ends(count, &[[1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [3.0, 5.0]]);
    let choose = "FN 0: Q5 = +2\nFN 9: IF +Q5 EQU +2 GOTO LBL \"THERE\"\nL X+99 R0 F1\nLBL \"THERE\"\nL X+1 R0 F100";
    assert_ends(choose, &[[1.0, 0.0]]);
    assert_ends("CALL LBL \"A\"\nL X+5 R0 F100 M30\nLBL \"A\"\nL Y+1 R0 F100\nLBL 0", &[[0.0, 1.0], [5.0, 1.0]]);
    for (lines, code) in [
        ("FN 11: IF +1 GT +0 GOTO LBL 7\nL X+1 F1", "nc::no-target"),
        ("CALL LBL 7\nL X+1 F1", "nc::no-routine"),
        ("CALL PGM OTHER.H\nL X+1 F1", "nc::no-routine"),
        ("LBL 1\nFN 9: IF +1 EQU +1 GOTO LBL 1", "nc::runaway"),
        ("APPR LCT X+10 Y+0 R5 RL F100", "nc::approach"),
        ("FPOL X+0 Y+0", "nc::not-understood"),
        ("CYCL DEF 247 PRESET ~\nQ339=1\nL X+1 F1", "nc::cycle"),
    ] {
        let path = read(lines);
        assert!(path.diagnostics.iter().any(|d| d.code == code && d.line.is_some()), "{lines}: {:?}", path.diagnostics);
    }
}

#[test]
fn parameters_stand_wherever_numbers_do() {
    let path = assert_ends(
        "Q1 = +10\nQR2 = +600\nQL1 = -3\nTOOL CALL Q1 Z SQR2\nL X+Q1 R0 FQR2\nCC X+0 Y+0\nLP PR+Q1 PA-QL1\nL IX-QL1 Y+0 FQ1",
        &[[10.0, 0.0], [9.986, 0.523], [12.986, 0.0]],
    );
    let feeds: Vec<f64> = path.moves.iter().map(|m| (m.feed.mm_s * 6e3).round() / 1e2).collect();
    assert_eq!((path.moves[0].tool, feeds), (10, vec![600.0, 600.0, 10.0]));
    assert!((path.moves[0].spin.rps).abs() < 1e-12 && path.moves.iter().all(|m| m.freeze == Some(Freeze::Expression)));
}

#[test]
fn feeds_in_their_other_spellings() {
    let path =
        read("TOOL CALL 1 Z S3000 F500\nL X+1 R0 F MAX M3\nL X+2 F200\nL X+3 FAUTO\nL X+4 FU0.1\nL X+5\nL X+6 F300");
    let kinds: Vec<bool> = path.moves.iter().map(|m| m.kind == nc::MoveKind::Rapid).collect();
    assert_eq!(kinds, [true, false, false, false, false, false]);
    let feeds: Vec<f64> = path.moves[1..3].iter().map(|m| (m.feed.mm_s * 60.0).round()).collect();
    assert_eq!(feeds, [200.0, 500.0]);
    let frozen: Vec<bool> = path.moves.iter().map(|m| m.freeze.is_some()).collect();
    assert_eq!(frozen, [false, false, true, true, true, false], "what FAUTO and FU mean is not written into them");
    assert_eq!(path.diagnostics.iter().map(|d| d.line).collect::<Vec<_>>(), [Some(6)], "{:?}", path.diagnostics);
}

#[test]
fn programs_beside_it_are_called() {
    let load =
        |name: &str| (name == "OTHER").then(|| b"0 BEGIN PGM OTHER MM\n1 L X+7 R0 F50\n2 END PGM OTHER MM\n".to_vec());
    let environment = Environment { load: &load, ..Environment::default() };
    let text = program("CALL PGM TNC:\\DIR\\OTHER.H\nL Y+1 F100");
    let path = nc::interpret(&nc::parse(text.into_bytes(), Some(Dialect::Heidenhain)), &environment);
    assert_eq!(ends(&path), [[7.0, 0.0], [7.0, 1.0]]);
    assert_eq!(path.moves[0].freeze, Some(Freeze::OtherFile));
}

#[test]
fn cycles_that_move_the_zero() {
    assert_ends(
        "CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+10\nCYCL DEF 7.2 Y+5\nL X+1 Y+0 R0 F100\nCYCL DEF 7.0 DATUM SHIFT\n\
        CYCL DEF 7.1 X+0\nCYCL DEF 7.2 Y+0\nL X+1 Y+0",
        &[[11.0, 5.0], [1.0, 0.0]],
    );
    assert_ends("CYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+90\nL X+2 Y+0 R0 F100", &[[0.0, 2.0]]);
    assert_ends("CYCL DEF 11.0 SCALING\nCYCL DEF 11.1 SCL 0.5\nL X+2 Y+4 R0 F100", &[[1.0, 2.0]]);
    assert_ends("CYCL DEF 8.0 MIRROR IMAGE\nCYCL DEF 8.1 X\nL X+2 Y+4 R0 F100", &[[-2.0, 4.0]]);
    let lost = read("L X+1 R0 F100\nCYCL DEF 19.0 WORKING PLANE\nL X+2");
    assert_eq!(lost.moves.iter().map(|m| m.freeze).collect::<Vec<_>>(), [None, Some(Freeze::NotUnderstood)]);
}

/// Feeds of every block changed, as far as the text allows; what is written proves and keeps its number of lines.
fn rewritten(lines: &str) -> String {
    let program = parse(program(lines).as_bytes(), Dialect::Heidenhain);
    let mut job = job();
    job.output.annotate = feedwright::machine::Annotate::None;
    let path = toolpath(&program, &surroundings(), &job);
    let asked = schedule(&path, |_| Vec::new(), |index, _| [0.5, 1.5][index % 2]);
    let out = check(&program, &surroundings(), &asked, &job).unwrap();
    let text = String::from_utf8(out.bytes).unwrap();
    assert_eq!(text.lines().count(), program.len(), "{text}");
    text
}

#[test]
fn each_block_says_its_feed_where_nothing_crosses_the_span() {
    let out =
        rewritten("TOOL CALL 1 Z S3000\nL X+0 Y+0 R0 FMAX M3\nL X+10 R0 F600 M8\nL Y+20\nL X+0\nL Z+100 R0 FMAX M30");
    assert!(out.contains("L X+10 R0 F900 M8\n"), "{out}");
    assert!(out.contains("L Y+20 F300\n") && out.contains("L X+0 F900\n"), "{out}");
}

#[test]
fn spans_that_labels_cross_have_one_feed() {
    let out = rewritten("L X+1 R0 F600\nL Y+5\nLBL 1\nL IX+1\nCALL LBL 1 REP 2/2\nL Y+0\nL X+9 F800\nL Y+9");
    assert!(
        out.contains("L X+1 R0 F300") && out.contains("L Y+5\n") && out.contains("4 L IX+1") && !out.contains("F600"),
        "{out}"
    );
    assert!(out.contains("L X+9 F") && !out.contains("F800"), "{out}");
    let tool = rewritten("TOOL CALL 1 Z S3000 F500\nL X+1 R0\nLBL 1\nL IX+1\nCALL LBL 1 REP 2/2");
    assert!(tool.contains("F500\n") && tool.matches(" F").count() == 1, "no block of the span states it: {tool}");
}
