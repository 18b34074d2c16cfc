//! Heidenhain plain language beyond its straight lines: polar and tangential motions, corners, labels, jumps, cycles that
//! move the zero; and how its feeds are rewritten though no line may be put in.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/rewriting.rs"]
mod rewriting;

use feedwright::nc::{self, Dialect, Doubt, Environment, FeedMode, Freeze, Toolpath};
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

/// With a cutter of radius 5 that is moved aside by the control.
fn read_beside(lines: &str) -> Toolpath {
    let text = program(&format!("TOOL CALL 1 Z S3000\nL X+0 Y-40 R0 FMAX\n{lines}"));
    let compensation = Some(feedwright::machine::Compensation::Control);
    let environment = Environment { compensation, diameters_mm: vec![(1, 10.0)], ..Environment::default() };
    let path = nc::interpret(&nc::parse(text.into_bytes(), Some(Dialect::Heidenhain)), &environment);
    assert!(path.diagnostics.is_empty(), "{lines}: {:?}", path.diagnostics);
    path
}

/// Centre and turns of an arc.
fn arc(path: &Toolpath, index: usize) -> (f64, f64, f64) {
    let Curve::Arc(arc) = path.moves[index].curve() else { panic!("no arc: {:?}", path.moves[index].curve()) };
    let round = |value: f64| (value * 1e6).round() / 1e6 + 0.0;
    (round(arc.centre.x), round(arc.centre.y), round(arc.sweep_rad / std::f64::consts::TAU))
}

#[test]
fn approaches_lead_into_the_contour() {
    let straight = read_beside("APPR LT X+20 Y+20 LEN15 R0 F100\nL X+50");
    assert_eq!(ends(&straight)[1..], [[5.0, 20.0], [20.0, 20.0], [50.0, 20.0]]);
    let kinds: Vec<bool> = straight.moves.iter().map(|m| m.kind == nc::MoveKind::Rapid).collect();
    assert_eq!(kinds, [true, true, false, false], "to H as the tool moved last");
    let kept: Vec<bool> = straight.moves.iter().map(|m| m.freeze == Some(Freeze::Approach)).collect();
    assert_eq!(kept, [false, true, true, false]);
    assert_eq!(straight.moves.iter().map(|m| m.line).collect::<Vec<_>>(), [3, 4, 4, 5]);
    let normal = read_beside("APPR LN X+20 Y+20 LEN15 RL F100\nL X+50\nL Y-9");
    assert_eq!(ends(&normal)[1..4], [[20.0, 40.0], [20.0, 25.0], [50.0, 25.0]]);
    let round = read_beside("L X+1 R0 F600\nAPPR CT X+20 Y+20 CCA90 R+10 RR F100\nL X+50");
    assert_eq!(ends(&round)[2..], [[10.0, 5.0], [20.0, 15.0], [50.0, 15.0]]);
    assert_eq!(arc(&round, 3), (20.0, 5.0, -0.25));
    let feeds: Vec<f64> = round.moves[2..].iter().map(|m| (m.feed.mm_s * 60.0).round()).collect();
    assert_eq!(feeds, [600.0, 100.0, 100.0], "to H at the feed before");
    let inwards = read_beside("APPR CT X+20 Y+20 CCA90 R-10 RR F100\nL X+50");
    assert_eq!((ends(&inwards)[1], arc(&inwards, 2)), ([10.0, 25.0], (20.0, 25.0, 0.25)));
    let both = read_beside("L X-10 Y+5 R0 FMAX\nAPPR LCT X+0 Y+10 R5 RL F100\nL Y+60");
    // Moved aside by 5: A′ = (−5, 10), C = (−10, 10); the line from (−10, 5) touches where it begins.
    assert_eq!((ends(&both)[2..].to_vec(), arc(&both, 2)), (vec![[-5.0, 10.0], [-5.0, 60.0]], (-10.0, 10.0, 0.25)));
    let by_side = read_beside("L X-10 Y+5 R0 FMAX\nAPPR LCT X+0 Y+10 R5 R0 F100\nL Y+60");
    assert_eq!((ends(&by_side)[2..4].to_vec(), arc(&by_side, 3)), (vec![[-5.0, 5.0], [0.0, 10.0]], (-5.0, 10.0, 0.25)));
    let to_an_arc = read_beside("APPR LT X+20 Y+0 LEN5 R0 F100\nCC X+20 Y+10\nC X+30 Y+10 DR+");
    assert_eq!(ends(&to_an_arc)[1..], [[15.0, 0.0], [20.0, 0.0], [30.0, 10.0]]);
}

#[test]
fn departures_lead_away_from_the_contour() {
    let contour = "APPR LT X+20 Y+20 LEN15 RL F100\nL X+50\n";
    let leaves = |how: &str| {
        let path = read_beside(&format!("{contour}DEP {how}\nL X+0 Y-40 R0 FMAX"));
        assert_eq!((ends(&path)[3], *ends(&path).last().unwrap()), ([50.0, 25.0], [0.0, -40.0]), "{how}");
        assert!(path.moves[4..path.moves.len() - 1].iter().all(|m| m.freeze == Some(Freeze::Approach)));
        path
    };
    assert_eq!(ends(&leaves("LT LEN12 F300"))[4], [62.0, 25.0]);
    assert_eq!(ends(&leaves("LN LEN+20 F300"))[4], [50.0, 45.0]);
    let round = leaves("CT CCA180 R+8 F300");
    assert_eq!((ends(&round)[4], arc(&round, 4)), ([50.0, 41.0], (50.0, 33.0, 0.5)));
    assert_eq!((round.moves[4].feed.mm_s * 60.0).round(), 300.0);
    let both = leaves("LCT X+55 Y+50 R5");
    assert_eq!((ends(&both)[4..6].to_vec(), arc(&both, 4)), (vec![[55.0, 30.0], [55.0, 50.0]], (50.0, 30.0, 0.25)));
}

#[test]
fn corners_are_worked_into_a_contour_the_tool_runs_beside() {
    let outside = read_beside("L X+0 Y+0 RL F100\nL Y+60\nRND R5\nL X+100\nCHF 2\nL Y+0");
    assert_eq!(ends(&outside)[2..5], [[-5.0, 55.0], [5.0, 65.0], [98.0, 65.0]]);
    assert_eq!(arc(&outside, 3), (5.0, 55.0, -0.25));
    let inside = read_beside("L X+0 Y+0 RR F100\nL Y+60\nRND R8 F50\nL X+100");
    assert_eq!(ends(&inside)[2..], [[5.0, 52.0], [8.0, 55.0], [100.0, 55.0]]);
    let feeds: Vec<f64> = inside.moves[2..].iter().map(|m| (m.feed.mm_s * 60.0).round()).collect();
    assert_eq!((arc(&inside, 3), feeds), ((8.0, 52.0, -0.25), vec![100.0, 50.0, 100.0]));
    assert_eq!(inside.moves[3].freeze, Some(Freeze::OwnFeed));
}

#[test]
fn machine_coordinates_and_retracts() {
    let environment =
        Environment { home_mm: Some(feedwright::path::Vec3::new(0.0, 0.0, 300.0)), ..Environment::default() };
    let read =
        |lines: &str| nc::interpret(&nc::parse(program(lines).into_bytes(), Some(Dialect::Heidenhain)), &environment);
    let path = read(
        "CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 Z+50\nL Z-5 R0 FMAX\nL Z-1 R0 FMAX M91\nL Z-5 FMAX\nM140 MB MAX\nL Z+0 FMAX\nL M140 MB+20\nL X+1 M97 FMAX",
    );
    assert!(path.diagnostics.is_empty(), "{:?}", path.diagnostics);
    let z: Vec<f64> = path.moves.iter().map(|m| m.curve().to().z).collect();
    assert_eq!(z, [45.0, -1.0, 45.0, 300.0, 50.0, 70.0, 70.0]);
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
        ("APPR PLT PR+10 PA+0 LEN5 RL F100\nL X+9", "nc::approach"),
        ("APPR LN X+10 Y+0 LEN5 R0 F100\nL X+20", "nc::approach"),
        ("L X+5 R0 F100\nDEP LCT X+5 Y+1 R5", "nc::approach"),
        ("FPOL X+0 Y+0", "nc::not-understood"),
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

/// In a program in inches F is in tenths of an inch per minute, in every block that has one: F100 is 254 mm/min.
#[test]
fn feeds_in_inches_are_tenths_of_an_inch_per_minute() {
    let lines = "TOOL CALL 1 Z S3000 F200\nL X+1 R0 F100\nL X+2 FAUTO\nRND R0.1 F50\nL Y+2 F100\nL Y+3";
    let text = program(lines).replace("PGM T MM", "PGM T INCH");
    let path = nc::interpret(&nc::parse(text.into_bytes(), Some(Dialect::Heidenhain)), &Environment::default());
    let feeds: Vec<f64> = path.moves.iter().map(|m| (m.feed.mm_s * 600.0).round() / 10.0).collect();
    assert_eq!(feeds, [254.0, 508.0, 127.0, 254.0, 254.0], "{:?}", path.diagnostics);
    assert!((path.moves[0].curve().to().x - 25.4).abs() < 1e-9);
    let lines = "TOOL CALL 1 Z S3000\nL X+0 Y+0 R0 FMAX M3\nL X+10 R0 F600 M8\nL Y+20\nL Z+100 R0 FMAX M30";
    let out = rewritten_text(&program(lines).replace("PGM T MM", "PGM T INCH"));
    assert!(out.contains("L X+10 R0 F900 M8\n") && out.contains("L Y+20 F300\n"), "{out}");
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

/// QL belongs to its program; Q and QR are those of all.
#[test]
fn local_parameters_are_those_of_their_program() {
    let load = |name: &str| {
        (name == "OTHER").then(|| b"0 BEGIN PGM OTHER MM\n1 QL1 = 1\n2 Q1 = 2\n3 END PGM OTHER MM\n".to_vec())
    };
    let environment = Environment { load: &load, ..Environment::default() };
    let text = program("QL1 = 8\nQ1 = 9\nCALL PGM OTHER.H\nL X+QL1 Y+Q1 R0 F100");
    let path = nc::interpret(&nc::parse(text.into_bytes(), Some(Dialect::Heidenhain)), &environment);
    assert_eq!(ends(&path), [[8.0, 2.0]]);
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
    let lost = read("L X+1 R0 F100\nCYCL DEF 19.0 WORKING PLANE\nCYCL DEF 19.1 A+0 B+45 C+0\nL X+2");
    assert_eq!(lost.moves.iter().map(|m| m.freeze).collect::<Vec<_>>(), [None, Some(Freeze::NotUnderstood)]);
}

/// Feeds of every block changed, as far as the text allows; what is written proves and keeps its number of lines.
fn rewritten(lines: &str) -> String {
    rewritten_text(&program(lines))
}

fn rewritten_text(text: &str) -> String {
    let program = parse(text.as_bytes(), Dialect::Heidenhain);
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
fn no_block_is_ever_cut_for_all_that_follow_would_be_renumbered() {
    let lines =
        "TOOL CALL 1 Z S3000\nL X+0 Y+0 R0 FMAX M3\nL X+90 F600\nCC X+90 Y+10\nC X+90 Y+20 DR+\nL X+0\nL Z+9 FMAX M30";
    let program = parse(program(lines).as_bytes(), Dialect::Heidenhain);
    let path = toolpath(&program, &surroundings(), &job());
    assert!(
        path.moves.iter().all(|motion| !motion.splittable),
        "the schedule knows it beforehand: one feed for one block"
    );
    let asked = schedule(&path, |_| vec![0.3, 0.6], |index, piece| [0.5, 0.9, 0.7][(index + piece) % 3]);
    let out = check(&program, &surroundings(), &asked, &job()).unwrap();
    let numbers: Vec<u32> = String::from_utf8(out.bytes)
        .unwrap()
        .lines()
        .map(|line| line.split(' ').next().unwrap().parse().unwrap())
        .collect();
    assert_eq!(numbers, (0..9).collect::<Vec<_>>());
}

#[test]
fn oversize_of_the_tool_call_widens_the_path() {
    let path = read_beside("TOOL CALL Z S5000 DR+0.5\nL X+0 Y+0 RL F100\nL Y+60");
    assert_eq!((path.moves[1].tool, path.moves[2].curve().to().x), (1, -5.5));
}

#[test]
fn a_longer_tool_stands_higher() {
    let heights = |lines: &str| -> Vec<f64> { read(lines).moves.iter().map(|motion| motion.curve().to().z).collect() };
    let cut = "L X+0 Z+5 FMAX M3\nL Z-2 F300\n";
    assert_eq!(heights(&format!("TOOL CALL 1 Z S3000 DL+0.25 DR+0.1\n{cut}")), [5.25, -1.75]);
    let of_two = format!("TOOL CALL 1 Z S3000 DL-0.5\n{cut}TOOL CALL 2 Z S3000\nL Z-2 F300\n");
    assert_eq!(heights(&of_two), [4.5, -2.5, -2.0]);
}

#[test]
fn mirror_and_scaling_act_together() {
    let turned = "L X+10 Y+5 F300\nCYCL DEF 8.0 MIRROR\nCYCL DEF 8.1 X\nCYCL DEF 11.0 SCALING\nCYCL DEF 11.1 SCL 0.5\nL X+20 Y+6\n";
    assert_ends(turned, &[[10.0, 5.0], [-10.0, 3.0]]);
    let back = format!("{turned}CYCL DEF 8.0 MIRROR\nCYCL DEF 8.1\nL X+20 Y+6\n");
    assert_ends(&back, &[[10.0, 5.0], [-10.0, 3.0], [10.0, 3.0]]);
    let scaled_first =
        "CYCL DEF 11.0 SCALING\nCYCL DEF 11.1 SCL 2\nCYCL DEF 8.0 MIRROR\nCYCL DEF 8.1 Y\nL X+20 Y+6 F300\n";
    assert_ends(scaled_first, &[[40.0, -12.0]]);
}

#[test]
fn a_feed_per_turn_is_one_until_it_ends() {
    let path = read("TOOL CALL 1 Z S3000\nL X+0 FMAX M3\nL X+10 F600\nL X+20 F0.2 M136\nL X+30\nL X+40 F500 M137\n");
    let feeds: Vec<f64> = path.moves[1..].iter().map(|motion| (60.0 * motion.feed.mm_s).round()).collect();
    assert_eq!(feeds, [600.0, 600.0, 600.0, 500.0]);
    let modes: Vec<bool> = path.moves[1..].iter().map(|motion| motion.feed.mode == FeedMode::PerRev).collect();
    assert_eq!(modes, [false, true, true, false]);
}

#[test]
fn a_tolerance_is_no_tool() {
    let path = read("TOOL CALL 1 Z S3000\nL X+0 FMAX M3\nM124 T0.01\nL X+10 F600 M112 T0.02\n");
    assert!(path.moves.iter().all(|motion| motion.tool == 1), "{:?}", path.moves);
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

#[test]
fn a_block_that_says_nothing_here_is_a_doubt() {
    let of = |block: &str| read(&format!("L X+0 Y+0 R0 F600\n{block}\nL X+9"));
    for block in ["HELLO WORLD", "TCH PROBE 411 Q321=+50"] {
        let path = of(block);
        assert!(path.doubts.iter().any(|doubted| doubted.doubt == Doubt::UnknownCode), "{block}: {:?}", path.doubts);
    }
    for block in ["FN 16: F-PRINT", "BLK FORM 0.1 Z X+0 Y+0 Z-20", "LBL 3", "; HELLO"] {
        assert!(of(block).doubts.is_empty(), "{block}: {:?}", of(block).doubts);
    }
}

/// Where the contour begins is not read of polar words, and where a departure without its length ends is not known: a doubt is left behind.
#[test]
fn approaches_and_departures_whose_end_is_not_read_are_in_doubt() {
    let doubts = |lines: &str| read(lines).doubts.len();
    let contour = "L X+60 Y+0\nL X+60 Y+40\n";
    for approach in ["APPR PLT PR+20 PA+180 LEN20 RL F600", "APPR PLCT PR+20 PA+180 R5 RL F600"] {
        let lines = format!("CC X+30 Y+30\nL X-40 Y+0 Z+5 R0 FMAX M3\nL Z-5 F300\n{approach}\n{contour}");
        assert!(doubts(&lines) > 0, "{approach}");
    }
    let known =
        format!("L X-40 Y+0 Z+5 R0 FMAX M3\nL Z-5 F300\nAPPR LT X+0 Y+0 LEN20 R0 F600\n{contour}DEP LT LEN20\n");
    assert_eq!(doubts(&known), 0);
    assert!(doubts(&known.replace("DEP LT LEN20", "DEP LT")) > 0);
}
