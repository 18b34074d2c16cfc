//! What each dialect's own words mean: end points worked out by hand against what the interpreter makes of them.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use feedwright::diag::Severity;
use feedwright::machine::Compensation;
use feedwright::nc::{self, Dialect, Doubt, Environment, Event, FeedMode, Freeze, MoveKind, PathMode, Toolpath};
use feedwright::path::Curve;

fn read(text: &str, dialect: Dialect) -> Toolpath {
    nc::interpret(&nc::parse(text.as_bytes().to_vec(), Some(dialect)), &Environment::default())
}

/// End points of all motions, rounded to a thousandth.
fn ends(path: &Toolpath) -> Vec<[f64; 3]> {
    let round = |value: f64| (value * 1e3).round() / 1e3 + 0.0;
    path.moves.iter().map(|m| m.curve().to()).map(|p| [round(p.x), round(p.y), round(p.z)]).collect()
}

fn assert_quiet(path: &Toolpath) {
    assert!(path.diagnostics.is_empty(), "{:?}", path.diagnostics);
}

#[test]
fn macro_b_loops_jumps_and_calls() {
    let text = "O1000\nG90 G0 X0 Y0 Z0\n#1=0\nWHILE [#1 LT 3] DO1\nG91 G1 X10. F100.\n#1=#1+1\nEND1\nG90\n\
        IF [#1 EQ 3] GOTO 50\nX999.\nN50 X0.\nM98 P2000 L2\nG65 P3000 A5. B[#1*2]\nM30\nO2000\nG91 Y1.\nG90\nM99\n\
        O3000\nX#1 Z#2\nM99\n";
    let path = read(text, Dialect::Fanuc);
    assert_quiet(&path);
    let x = [[0.0; 3], [10.0, 0.0, 0.0], [20.0, 0.0, 0.0], [30.0, 0.0, 0.0], [0.0; 3]];
    let y = [[0.0, 1.0, 0.0], [0.0, 2.0, 0.0], [5.0, 2.0, 6.0]];
    assert_eq!(ends(&path), [&x[..], &y[..]].concat());
    assert_eq!(path.moves[1..4].iter().map(|m| m.instance).collect::<Vec<_>>(), [0, 1, 2]);
    assert!(path.moves[1].shared.is_some(), "a block executed three times has one feed");
    assert_eq!(path.moves[1].shared, path.moves[3].shared);
    assert_ne!(path.moves[1].shared, path.moves[5].shared, "the subprogram has its own");
    assert_eq!(path.moves[4].shared, None);
}

#[test]
fn o_words_of_linuxcnc() {
    let text = "o100 sub\nG1 X[#1] F100\no100 endsub\no100 call [5]\n#<i> = 0\no101 while [#<i> LT 2]\n\
        #<i> = [#<i> + 1]\no102 if [#<i> EQ 1]\nY#<i>\no102 else\nY[10*#<i>]\no102 endif\no101 endwhile\n\
        o103 repeat [3]\nG91 Z1\nG90\no103 endrepeat\no104 do\n#<i> = [#<i> - 1]\nX#<i>\no104 while [#<i> GT 0]\nM2\n";
    let path = read(text, Dialect::LinuxCnc);
    assert_quiet(&path);
    let expected = [
        [5.0, 0.0, 0.0],
        [5.0, 1.0, 0.0],
        [5.0, 20.0, 0.0],
        [5.0, 20.0, 1.0],
        [5.0, 20.0, 2.0],
        [5.0, 20.0, 3.0],
        [1.0, 20.0, 3.0],
        [0.0, 20.0, 3.0],
    ];
    assert_eq!(ends(&path), expected);
}

#[test]
fn local_calls_of_haas() {
    let path = read("G91 G1 F100.\nM97 P100 L2\nM30\nN100 X2.\nM99\n", Dialect::Haas);
    assert_eq!(ends(&path)[1..], [[2.0, 0.0, 0.0], [4.0, 0.0, 0.0]]);
}

#[test]
fn subprograms_in_other_files_are_followed_and_left_alone() {
    let load = |name: &str| (name == "O0007.nc").then(|| b"G1 X7. F50.\nM99\n".to_vec());
    let program = nc::parse(b"M98 P7\nG1 Y1. F80.\nM30\n".to_vec(), Some(Dialect::Fanuc));
    let path = nc::interpret(&program, &Environment { load: &load, ..Environment::default() });
    assert_eq!(ends(&path), [[7.0, 0.0, 0.0], [7.0, 1.0, 0.0]]);
    assert_eq!(path.moves[0].freeze, Some(Freeze::OtherFile));
    assert_eq!((path.moves[0].line, path.moves[0].feed.word), (1, None));
    assert_eq!(path.moves[1].freeze, None);
}

#[test]
fn siemens_words_parameters_labels_and_cycles() {
    let text = "%_N_TEST_MPF\nDEF REAL TOP=10\nR1=5 R2=R1*2\nG0 X=R1 Y=TOP/2 Z=TOP\nG1 X0 F500\n\
        G2 X10 Y5 CR=5\nG3 X10 Y5 I=AC(10) J=AC(0)\nIF R1>4 GOTOF SKIP\nX999\nSKIP:\nG1 X=IC(2)\nTRANS X100\nX0\nTRANS\n\
        MCALL CYCLE81(20,10,2,,8)\nX1 Y2\nMCALL\nM30\n";
    let path = read(text, Dialect::Siemens);
    assert_quiet(&path);
    let expected = [
        [5.0, 5.0, 10.0],
        [0.0, 5.0, 10.0],
        [10.0, 5.0, 10.0],
        [10.0, 5.0, 10.0],
        [12.0, 5.0, 10.0],
        [100.0, 5.0, 10.0],
        [1.0, 2.0, 10.0],
        [1.0, 2.0, 20.0],
        [1.0, 2.0, 12.0],
        [1.0, 2.0, 2.0],
        [1.0, 2.0, 20.0],
    ];
    assert_eq!(ends(&path), expected);
    let Curve::Arc(full) = path.moves[3].curve() else { panic!("a full turn") };
    assert!((full.sweep_rad - std::f64::consts::TAU).abs() < 1e-9 && (full.radius_mm - 5.0).abs() < 1e-9);
}

#[test]
fn heidenhain_plain_language() {
    let text = "0 BEGIN PGM TEST MM\n1 BLK FORM 0.1 Z X+0 Y+0 Z-20\n2 TOOL CALL 5 Z S3000 F500\n\
        3 L X+10 Y-5 Z+50 R0 FMAX M3\n4 Q1 = +5 * 2\n5 L Z-Q1 F300\n6 CC X+10 Y+5\n7 C X+10 Y-5 DR+\n\
        8 L IX+5 Y+0\n9 CR X+25 Y+10 R+10 DR-\n10 LBL 1\n11 L IY+1\n12 CALL LBL 1 REP 2/2\n\
        13 CYCL DEF 200 DRILLING ~\nQ200=2 ~\nQ201=-10 ~\nQ206=150 ~\nQ202=5 ~\nQ203=+0 ~\nQ204=50\n14 L X+0 FMAX M99\n\
        15 L Z+100 FMAX M30\n16 END PGM TEST MM\n";
    let path = read(text, Dialect::Heidenhain);
    assert_quiet(&path);
    let e = ends(&path);
    let first = [[10.0, -5.0, 50.0], [10.0, -5.0, -10.0], [10.0, -5.0, -10.0], [15.0, 0.0, -10.0], [25.0, 10.0, -10.0]];
    assert_eq!(e[..5], first);
    assert_eq!(e[5..8], [[25.0, 11.0, -10.0], [25.0, 12.0, -10.0], [25.0, 13.0, -10.0]]);
    assert_eq!(path.moves[0].tool, 5);
    assert_eq!(path.moves[0].kind, MoveKind::Rapid);
    assert!((path.moves[1].feed.mm_s - 5.0).abs() < 1e-12);
    let deepest = path.moves.iter().skip(8).filter(|m| m.kind == MoveKind::Feed).map(|m| m.curve().to().z);
    assert_eq!(deepest.fold(f64::INFINITY, f64::min), -10.0);
    assert!(path.moves.iter().skip(9).all(|m| m.kind == MoveKind::Rapid || m.freeze == Some(Freeze::Cycle)));
}

#[test]
fn feeds_in_every_mode() {
    let text = "G21 G90 S600 M3\nG93 G1 X30 F2\nG95 X60 F0.1\nG94 X90 F120\nG20 G1 X4 F6\nM2\n";
    let path = read(text, Dialect::LinuxCnc);
    let feeds: Vec<f64> = path.moves.iter().map(|m| (m.feed.mm_s * 1e6).round() / 1e6).collect();
    assert_eq!(feeds, [1.0, 1.0, 2.0, 0.1], "LinuxCNC takes F6 in before G20: 6 mm/min");
    let feed_of = |dialect| read("G21 G1 X3 F60\nG20 X4 F6\nM2\n", dialect).moves[1].feed.mm_s;
    assert!((feed_of(Dialect::Fanuc) - 2.54).abs() < 1e-9, "others after it: 6 inch/min");
    assert!((feed_of(Dialect::Grbl) - 2.54).abs() < 1e-9);
    let modes: Vec<FeedMode> = path.moves.iter().map(|m| m.feed.mode).collect();
    assert_eq!(modes[..3], [FeedMode::InverseTime, FeedMode::PerRev, FeedMode::PerMinute]);
}

/// Fanuc B-64304EN and Haas: a condition governs what stands behind THEN; AND has bits; FIX drops the fraction; M of a macro call is #13.
#[test]
fn macro_b_means_what_its_manuals_say() {
    let depth = |body: &str, dialect: Dialect| {
        let path = read(&format!("G0 X0 Y0 Z5.\n{body}\nM30\nO9\nG1 Z-#13 F100.\nM99\n"), dialect);
        assert_quiet(&path);
        path.moves[1].curve().to().z
    };
    for dialect in [Dialect::Fanuc, Dialect::Haas] {
        for (body, z) in [
            ("#3=0\nIF [1 EQ 2] THEN #3=1.\nG1 Z-#3 F100.", 0.0),
            ("#3=0\nIF [1 EQ 1] THEN #3=1.\nG1 Z-#3 F100.", -1.0),
            ("#3=7\nIF [[#3 AND 4] EQ 4] GOTO 5\nG1 Z-1. F100.\nN5 G1 Z-2. F100.", -2.0),
            ("#3=8\nIF [[#3 AND 4] EQ 4] GOTO 5\nG1 Z-1. F100.\nN5 G1 Z-2. F100.", -1.0),
            ("#3=FIX[-14./8.]\nG1 Z[#3*8.] F100.", -8.0),
            ("G1 Z-[ROUND[1.23456]] F100.", -1.235),
            ("#3=ROUND[1.23456]\nG1 Z-#3 F100.", -1.0),
            ("G65 P9 M13.5", -13.5),
        ] {
            assert!((depth(body, dialect) - z).abs() < 1e-9, "{dialect:?} {body}");
        }
    }
    // Where some numbers have a point and others have none, it is said; zeros say nothing.
    let said =
        |text: &str| read(text, Dialect::Fanuc).diagnostics.iter().any(|found| found.code == "nc::decimal-point");
    assert!(said("G21\nG0 X0 Y0\nG1 X50. F100\nX60 Y30.\nM30\n"));
    assert!(!said("G21\nG0 X0 Y0\nG1 X50. F100\nX60. Y30.\nM30\n"));
    assert!(!said("G21\nG0 X0 Y0\nG1 X50 F100\nX60 Y30\nM30\n"));
    assert!(!said("G21\nG5.1 Q1 R3\nG0 X0 Y0\nG4 X500\nG1 X50. F100\nG91 X10. K7\nM30\n"));
}

/// What a word means on its control, each where another reading ends elsewhere. Sources: LinuxCNC against rs274; Fanuc B-63944EN; Haas Mill
/// Operator's Manual; 840D sl Programming Manuals; TNC 640 Klartext Programming.
#[test]
fn words_end_where_their_control_ends_them() {
    let last = |text: &str, dialect: Dialect| {
        let path = read(text, dialect);
        assert!(path.doubts.is_empty(), "{dialect:?} {text}: {:?}", path.diagnostics);
        ends(&path).pop().unwrap()
    };
    for (dialect, text, end) in [
        // Only the angle is a step: the pole stays at the zero.
        (Dialect::Fanuc, "G0 X0. Y0. Z5.\nG16\nG1 X50. Y30. F100.\nG91 Y60.\nG15\nM30\n", [0.0, 50.0, 5.0]),
        // One register for both.
        (Dialect::LinuxCnc, "G21 G0 X0 Y0 Z5\nG92 X10\nG52 X0\nG1 X3 F100\nM2\n", [3.0, 0.0, 5.0]),
        (Dialect::LinuxCnc, "G21 G0 X0 Y0 Z5\nG1 X-40 F100 G4 P0.2\nM2\n", [-40.0, 0.0, 5.0]),
        (Dialect::Fanuc, "G0 X0. Y0. Z5.\nG52 X10.\nG92 X0.\nG52 X0.\nG1 X5. F100.\nM30\n", [5.0, 0.0, 5.0]),
        (Dialect::Grbl, "G21 G0 X0 Y0 Z5\nG51 X2 Y2\nG1 X10 Y4 F100\nM30\n", [20.0, 8.0, 5.0]),
        // About the tool where no centre is named.
        (Dialect::Fanuc, "G0 X20. Y10. Z5.\nG51 P2.\nG1 X40. Y10. F100.\nM30\n", [60.0, 10.0, 5.0]),
        // A Fanuc returns to N100 of the caller, a Haas goes on there.
        (
            Dialect::Fanuc,
            "G0 X0 Y0 Z5.\nM98 P2\nG1 X1. F100.\nN100 G1 Y7. F100.\nM30\nO2\nG1 X5. F100.\nM99 P100\nN100 X9.\nM99\n",
            [5.0, 7.0, 5.0],
        ),
        (
            Dialect::Haas,
            "G0 X0 Y0 Z5.\nM98 P2\nG1 Y3. F100.\nM30\nO2\nG1 X5. F100.\nM99 P100\nX8.\nN100 X9.\nM99\n",
            [9.0, 3.0, 5.0],
        ),
        (
            Dialect::LinuxCnc,
            "G21 G0 X0 Y0 Z5\n#1=[0.33334*3]\n#2=-8\no1 if [#1 NE 1]\n#2=-1\no1 endif\nG1 Z#2 F100\nM2\n",
            [0.0, 0.0, -8.0],
        ),
        (
            Dialect::LinuxCnc,
            "G21\no1 sub\n#31=-8\no1 endsub\nG0 X0 Y0 Z5\n#31=-1\no1 call\nG1 Z#31 F100\nM2\n",
            [0.0, 0.0, -8.0],
        ),
        (Dialect::LinuxCnc, "G21 G0 X0 Y0 Z5\no1 repeat [2.7]\nG91 G1 X1 F100\no1 endrepeat\nM2\n", [3.0, 0.0, 5.0]),
        (Dialect::Siemens, "G0 X0 Y0 Z5\nROT X0 Y0 Z90\nG1 X80 F100\nM30\n", [0.0, 80.0, 5.0]),
        (
            Dialect::Siemens,
            "G0 X0 Y0 Z5\nR1=1 R2=0 R3=0\nIF (R1==1) OR (R2==1) AND (R3==1) GOTOF DEEP\nG1 X10 F100\nDEEP:\nG1 Y3 F100\nM30\n",
            [0.0, 3.0, 5.0],
        ),
        (Dialect::Siemens, "DEF INT KK\nG0 X0 Y0 Z5\nKK=7/2\nG1 X=KK*10 F100\nM30\n", [40.0, 0.0, 5.0]),
        (
            Dialect::Siemens,
            "%_N_A_MPF\nG90 G0 X0 Y0 Z5\nS1\nSUB1\nG1 X50 F100\nM30\n%_N_SUB1_SPF\nPROC SUB1 SAVE\nG91 G1 X5 F100\nTRANS Y3\nM17\n",
            [50.0, 0.0, 5.0],
        ),
        (
            Dialect::Siemens,
            "%_N_A_MPF\nG90 G0 X0 Y0 Z5\nS1\nSUB1\nG1 Y50 F100\nM30\n%_N_SUB1_SPF\nG1 X5 F100\nM30\n",
            [5.0, 50.0, 5.0],
        ),
        (
            Dialect::Heidenhain,
            "BEGIN PGM A MM\nL X+0 Y+0 Z+5 R0 FMAX\nQ1 = COS 60 * 4 - 10\nL Z+Q1 F100\nEND PGM A MM\n",
            [0.0, 0.0, -8.0],
        ),
        (
            Dialect::Heidenhain,
            "BEGIN PGM A MM\nL X+0 Y+0 Z+5 R0 FMAX\nQ1 = 2 + SQRT 16 - SIN (90)\nL Z+Q1 F100\nEND PGM A MM\n",
            [0.0, 0.0, 5.0],
        ),
    ] {
        assert_eq!(last(text, dialect), end, "{dialect:?} {text}");
    }
    // From (30, 0) by (10 on, 10 up) to (50, 0): half a turn of 10 mm about (40, 0).
    let path = read("G0 X30 Y0 Z5\nCIP X50 Y0 I1=IC(10) J1=IC(10) F100\nM30\n", Dialect::Siemens);
    assert!((path.moves[1].curve().length() - 10.0 * std::f64::consts::PI).abs() < 1e-6);
    // R alone: whether the cycle is made again there is not known.
    let path = read("G0 X0 Y0 Z5.\nG99 G81 X5. Z-1. R2. F300.\nR1.\nX9.\nG80\nM30\n", Dialect::Fanuc);
    assert_eq!(path.doubts.len(), 1, "{:?}", path.diagnostics);
    let repeated = "G0 X0 Y0 Z5.\nG16 G99 G81 X9. Y5. Z2. R3. F300.\nG91 Y9. K3\nG90 G80 G15\nM30\n";
    assert_eq!(read(repeated, Dialect::Fanuc).doubts.len(), 1);
    // SAVE restores at the end of every pass; INT is of one program.
    let saved = "%_N_A_MPF\nG90 G0 X0 Y0 Z5\nS1\nSUB1 P2\nG1 X40 F100\nM30\n%_N_SUB1_SPF\nPROC SUB1 SAVE\nG91 G1 X5 F100\nM17\n";
    assert_eq!(last(saved, Dialect::Siemens), [40.0, 0.0, 5.0]);
    let typed = "%_N_A_MPF\nG90 G0 X0 Y0 Z5\nSUBA(2)\nSUBB(-1.4)\nM30\n%_N_SUBA_SPF\nPROC SUBA(INT N)\nM17\n%_N_SUBB_SPF\nPROC SUBB(REAL N)\nG1 Z=N F100\nM17\n";
    assert_eq!(last(typed, Dialect::Siemens), [0.0, 0.0, -1.4]);
    // G50 is no limit of speed on a mill; powers stay in the text of unknown controls.
    let turns_beside = |text: &str| read(text, Dialect::Fanuc).moves.last().unwrap().spin.rps * 60.0;
    assert!((turns_beside("G21 G40 G49 G50 G80 S6000 M3\nG1 X5. F100.\nM30\n") - 6000.0).abs() < 1e-9);
    assert_eq!(last("#1=2**3\nG0 X#1 Y0 Z5\nG4 X1.\nM30\n", Dialect::Generic), [8.0, 0.0, 5.0]);
    // S beside G92 is the highest speed.
    let turns = |text: &str, dialect| read(text, dialect).moves.last().unwrap().spin.rps * 60.0;
    assert!((turns("G21 S2000 M3\nG92 S9000\nG1 X5. F100.\nM30\n", Dialect::Fanuc) - 2000.0).abs() < 1e-9);
}

#[test]
fn turned_scaled_mirrored_and_polar_coordinates() {
    let path = read("G0 X0 Y0\nG68 X0 Y0 R90.\nG1 X10. F100.\nG69\nX0 Y0\nM30\n", Dialect::Fanuc);
    assert_eq!(ends(&path)[1..], [[0.0, 10.0, 0.0], [0.0, 0.0, 0.0]]);
    let path = read("G0 X0 Y0\nG51 X0 Y0 P2000\nG1 X10. F100.\nG2 X20. Y10. R10.\nG50\nM30\n", Dialect::Fanuc);
    assert_eq!(ends(&path)[1..], [[20.0, 0.0, 0.0], [40.0, 20.0, 0.0]]);
    let path = read("G0 X0 Y0\nG51.1 X0\nG1 X10. F100.\nG2 X20. Y10. R10.\nM30\n", Dialect::Fanuc);
    assert_eq!(ends(&path)[1..], [[-10.0, 0.0, 0.0], [-20.0, 10.0, 0.0]]);
    let Curve::Arc(mirrored) = path.moves[2].curve() else { panic!("an arc") };
    assert!(mirrored.sweep_rad > 0.0, "a mirrored G2 turns counter-clockwise");
    let path = read("G0 X0 Y0\nG16\nG1 X10. Y30. F100.\nY90.\nG15\nM30\n", Dialect::Fanuc);
    assert_eq!(ends(&path)[1..], [[8.66, 5.0, 0.0], [0.0, 10.0, 0.0]]);
}

#[test]
fn shifts_of_the_zero_move_the_numbers_and_not_the_tool() {
    let text = "G0 X10 Y0\nG92 X0\nG1 X5 F100\nG92.1\nX5\nG10 L2 P2 X100\nG55\nX0\nG52 X7\nX0\nM2\n";
    let path = read(text, Dialect::Generic);
    let x: Vec<f64> = path.moves.iter().map(|m| m.curve().to().x).collect();
    assert_eq!(x, [10.0, 15.0, 5.0, 100.0, 107.0]);
    let shown: Vec<f64> = path.iter_moves().map(|(id, m)| m.curve().to().x - path.shift_at(id).x).collect();
    assert_eq!(shown, [10.0, 5.0, 5.0, 0.0, 0.0]);
}

#[test]
fn what_keeps_its_feed_is_frozen() {
    let text =
        "G1 X1 F100 S100 M3\nG1 X2 A30\nG33 Z-5 K1\nG31 Z-6\nG84 X1 Z-5 R2\nG85 X2\nG81 X3\nG80\n/G1 X9\nG1 X10\nM2\n";
    let path = read(text, Dialect::Generic);
    let freeze =
        |line: u32| path.moves.iter().filter(move |m| m.line == line && m.kind == MoveKind::Feed).map(|m| m.freeze);
    let expected = [
        (1, None),
        (2, Some(Freeze::Rotary)),
        (3, Some(Freeze::Synchronised)),
        (4, Some(Freeze::Probe)),
        (5, Some(Freeze::Synchronised)),
        (6, Some(Freeze::Cycle)),
        (7, None),
        (9, Some(Freeze::BlockDelete)),
        (10, None),
    ];
    for (line, why) in expected {
        assert!(freeze(line).count() > 0, "line {line} moves");
        assert!(freeze(line).all(|f| f == why), "line {line}: {:?}", freeze(line).collect::<Vec<_>>());
    }
}

#[test]
fn rotary_motion_is_said_once_per_range() {
    let path = read("G0 A10\nG1 X1 F100\nX2 A20\nX3 A30\nX4\nX5 A40\nM2\n", Dialect::Generic);
    let lines = |code| path.diagnostics.iter().filter(|d| d.code == code).filter_map(|d| d.line).collect::<Vec<_>>();
    assert_eq!(lines("nc::rotary"), [3, 6]);
    assert_eq!(lines("nc::doubt"), [1]);
    assert_eq!(path.moves.iter().filter(|m| m.freeze == Some(Freeze::Rotary)).count(), 3);
}

#[test]
fn a_drilling_cycle_has_one_feed_for_all_its_holes() {
    let path = read("F80\nG99 G83 X0 Y0 Z-10 R2 Q4\nX10\nX20\nG80\nG1 X30\nM2\n", Dialect::Generic);
    let holes: Vec<_> = path.moves.iter().filter(|m| m.kind == MoveKind::Feed && m.line < 5).collect();
    assert_eq!(holes.len(), 9, "three pecks in three holes");
    assert!(holes.iter().all(|m| m.shared == holes[0].shared && m.shared.is_some() && m.feed.word.is_some()));
    assert_eq!(path.moves.last().unwrap().shared, None);
}

#[test]
fn block_delete_is_obeyed_both_ways() {
    let program = nc::parse(b"G0 X1\n/G0 X2\nG0 Y1\nM2\n".to_vec(), None);
    let off = nc::interpret(&program, &Environment::default());
    let on = nc::interpret(&program, &Environment { block_delete: true, ..Environment::default() });
    assert_eq!((off.moves.len(), on.moves.len()), (3, 2));
}

#[test]
fn compensation_is_what_the_setup_or_the_geometry_says() {
    // An arc of 3 mm cannot be followed inside by a cutter of radius 5: the path must be written as the tool runs.
    let tight = "T1 M6\nG0 X0 Y-20\nG1 F100 Y-19\nG41 D1 X0 Y0\nG3 X3 Y3 I0 J3\nG1 X10\nG40 Y20\nM30\n";
    let open = "T1 M6\nG0 X0 Y-20\nG1 F100 Y-19\nG41 D1 X0 Y0\nG1 Y30\nG40 X-20\nM30\n";
    let read = |text: &str, compensation| {
        let environment = Environment { compensation, diameters_mm: vec![(1, 10.0)], ..Environment::default() };
        nc::interpret(&nc::parse(text.as_bytes().to_vec(), Some(Dialect::Fanuc)), &environment)
    };
    let by_geometry = read(tight, None);
    assert_eq!(by_geometry.moves[2].curve().to().x, 0.0, "as written");
    assert!(by_geometry.moves.iter().all(|m| m.freeze.is_none()), "decided, not frozen");
    let asked = read(open, None);
    assert_eq!(asked.moves[2].freeze, Some(Freeze::Compensation));
    assert!(asked.diagnostics.iter().any(|d| d.code == "nc::compensation" && d.line == Some(4)));
    let control = read(open, Some(Compensation::Control));
    assert_eq!(control.moves[2].curve().to().x, -5.0, "the tool runs 5 mm left of the contour");
    assert_eq!(read(open, Some(Compensation::Wear)).moves[2].curve().to().x, 0.0);
    let refused = read(tight, Some(Compensation::Control));
    assert!(refused.diagnostics.iter().any(|d| d.code == "nc::compensation" && d.line == Some(5)));
}

#[test]
fn dwells_and_stops_are_events() {
    let path = read("G4 P500\nG4 X1.5\nM0\nM30\n", Dialect::Fanuc);
    let dwells: Vec<f64> =
        path.events().filter_map(|e| if let Event::Dwell { seconds, .. } = e { Some(seconds) } else { None }).collect();
    assert_eq!(dwells, [0.5, 1.5]);
    let stops: Vec<bool> =
        path.events().filter_map(|e| if let Event::Stop { end, .. } = e { Some(end) } else { None }).collect();
    assert_eq!(stops, [false, true]);
}

/// Kind of each motion and its end.
fn shape(path: &Toolpath) -> Vec<(MoveKind, [f64; 3])> {
    path.moves.iter().map(|m| m.kind).zip(ends(path)).collect()
}

#[test]
fn fine_boring_steps_off_the_wall_with_the_spindle_still() {
    use MoveKind::{Feed as F, Rapid as R};
    let path = read("G0 X0 Y0 Z10.\nS500 M3\nG98 G76 X5. Y0 Z-4. R2. Q.5 F50.\nG80\nM30\n", Dialect::Fanuc);
    let expected = [
        (R, [5.0, 0.0, 10.0]),
        (R, [5.0, 0.0, 2.0]),
        (F, [5.0, 0.0, -4.0]),
        (R, [5.5, 0.0, -4.0]),
        (R, [5.5, 0.0, 10.0]),
        (R, [5.0, 0.0, 10.0]),
    ];
    assert_eq!(shape(&path)[1..], expected);
    assert_eq!(path.moves[3].freeze, Some(Freeze::Cycle));
    assert!(path.moves[4].spin.rps == 0.0 && path.moves[3].spin.rps > 0.0, "it steps aside at rest");
}

#[test]
fn back_boring_goes_in_aside_and_bores_upwards() {
    use MoveKind::{Feed as F, Rapid as R};
    let text = "G0 X0 Y0 Z10.\nS500 M3\nG98 G87 X5. Y0 Z-8. R2. I.5 J0 K-3. F50.\nG80\nM30\n";
    let path = read(text, Dialect::Fanuc);
    let feeds: Vec<_> = shape(&path).into_iter().filter(|(kind, _)| *kind == F).collect();
    assert_eq!(feeds, [(F, [5.0, 0.0, -3.0]), (F, [5.0, 0.0, -8.0])]);
    let down = shape(&path).iter().position(|step| *step == (R, [5.5, 0.0, -8.0]));
    let centre = shape(&path).iter().position(|step| *step == (R, [5.0, 0.0, -8.0]));
    assert!(down.is_some() && down < centre, "{:?}", shape(&path));
    assert_eq!(shape(&path).last(), Some(&(R, [5.0, 0.0, 10.0])));
    assert!(path.moves.iter().filter(|m| m.kind == F).all(|m| m.freeze == Some(Freeze::Cycle)));
}

#[test]
fn boring_with_a_manual_way_out_dwells_and_leaves_at_rest() {
    let path = read("G0 X0 Y0 Z10.\nS500 M3\nG98 G88 X5. Z-4. R2. P.3 F50.\nG80\nM30\n", Dialect::Haas);
    let dwell = path.events().any(|e| matches!(e, Event::Dwell { seconds, .. } if (seconds - 0.3).abs() < 1e-12));
    let last = path.moves.last().unwrap();
    assert!(dwell && last.kind == MoveKind::Rapid && last.spin.rps == 0.0 && last.curve().to().z == 10.0);
}

#[test]
fn modal_macros_are_said_and_freeze_what_they_follow() {
    let path = read("G1 X1. F100.\nG66 P9000\nX2.\nG67\nX3.\nM30\n", Dialect::Fanuc);
    assert_eq!(path.moves.iter().map(|m| m.freeze).collect::<Vec<_>>(), [None, Some(Freeze::Cycle), None]);
    let said: Vec<_> = path.diagnostics.iter().map(|d| (d.code, d.line)).collect();
    assert_eq!(said, [("nc::doubt", Some(2)), ("nc::no-routine", Some(2))], "a missing macro leaves a doubt");
}

#[test]
fn entry_ends_square_to_the_contour_as_its_control_makes_it() {
    let contour = |units: &str| {
        format!("{units} G90 T1 M6\nG0 X-10 Y-10 Z5\nG1 G41 D1 X0 Y0 F100\nZ-1\nY60\nX80\nG40 X90 Y90\nM30\n")
    };
    let read = |text: &str, dialect| {
        let compensation = Some(Compensation::Control);
        let environment = Environment { compensation, diameters_mm: vec![(1, 10.0)], ..Environment::default() };
        let path = nc::interpret(&nc::parse(text.as_bytes().to_vec(), Some(dialect)), &environment);
        assert_quiet(&path);
        path
    };
    for dialect in [Dialect::Fanuc, Dialect::Haas, Dialect::Siemens] {
        let units = if dialect == Dialect::Siemens { "G71" } else { "G21" };
        let path = read(&contour(units), dialect);
        let expected = [[-5.0, 0.0, 5.0], [-5.0, 0.0, -1.0], [-5.0, 60.0, -1.0], [0.0, 65.0, -1.0], [80.0, 65.0, -1.0]];
        assert_eq!(ends(&path)[1..6], expected, "{dialect:?}");
    }
    // LinuxCNC ends it square to itself, (−3.536, 3.536), and cuts it back to where x is −5.
    let path = read(&contour("G21"), Dialect::LinuxCnc);
    assert_eq!(ends(&path)[1], [-5.0, 2.071, 5.0]);
    let into_an_arc =
        "G21 G90 T1 M6\nG0 X-10. Y-10.\nG1 G41 D1 X0 Y0 F100\nG3 X20. Y20. I0 J20.\nG1 G40 X20. Y40.\nM30\n";
    let path = read(into_an_arc, Dialect::Fanuc);
    assert_eq!(ends(&path)[1..3], [[0.0, 5.0, 0.0], [15.0, 20.0, 0.0]]);
}

#[test]
fn coolant_is_kept_with_the_motions() {
    let text = "G21 G90 G94 F100\nG1 X1\nM8\nG1 X2\nM9 G1 X3\nM7\nG1 X4\nM9\nM13 S1000\nG1 X5\nM30\n";
    let coolant = |dialect| read(text, dialect).moves.iter().map(|motion| motion.coolant).collect::<Vec<bool>>();
    assert_eq!(coolant(Dialect::Fanuc), [false, true, false, true, true]);
    // There M13 belongs to the brake of a rotary axis.
    assert_eq!(coolant(Dialect::Haas), [false, true, false, true, false]);
}

#[test]
fn path_modes_are_kept_with_the_motions() {
    let text = "G64 P0.01 Q0.02\nG1 X1 F100\nG64\nX2\nG61\nX3\nG61.1\nX4\nG64 P0.5\nG9 X5\nX6\nM2\n";
    for dialect in [Dialect::LinuxCnc, Dialect::Fanuc] {
        let path = read(text, dialect);
        assert_quiet(&path);
        let modes: Vec<PathMode> = path.moves.iter().map(|m| m.path_mode).collect();
        let expected = [
            PathMode::Tolerance(0.01),
            PathMode::Continuous,
            PathMode::ExactPath,
            PathMode::ExactStop,
            PathMode::ExactStop,
            PathMode::Tolerance(0.5),
        ];
        assert_eq!(modes, expected);
    }
    let siemens = read("G64\nG1 X1 F100\nG60\nX2\nG641 ADIS=0.5\nX3\nM30\n", Dialect::Siemens);
    let modes: Vec<PathMode> = siemens.moves.iter().map(|m| m.path_mode).collect();
    assert_eq!(modes, [PathMode::Continuous, PathMode::ExactStop, PathMode::Continuous]);
}

#[test]
fn tool_length_codes_change_nothing_in_work_coordinates() {
    for word in ["G43 H1", "G43", "G43.1 Z-50.", "G49", "G44 H1"] {
        let path = read(&format!("G0 X1. Y2. Z3.\n{word}\nG1 X5. F100.\nM30\n"), Dialect::Fanuc);
        // A length that the setup cannot describe is a doubt.
        let own = matches!(word, "G43.1 Z-50." | "G44 H1");
        assert_eq!(
            path.doubts.iter().map(|of| of.doubt).collect::<Vec<_>>(),
            [Doubt::ToolLength][..usize::from(own)],
            "{word}"
        );
        assert_eq!(ends(&path).last(), Some(&[5.0, 2.0, if word.contains("Z-50") { -50.0 } else { 3.0 }]), "{word}");
    }
}

#[test]
fn lathe_codes_are_refused_and_nothing_after_them_changes() {
    for (word, dialect) in [("G7", Dialect::LinuxCnc), ("G8", Dialect::LinuxCnc), ("G7", Dialect::Generic)] {
        let path = read(&format!("G1 X1 F100\n{word}\nX5\nY5\nM2\n"), dialect);
        let said: Vec<_> = path.diagnostics.iter().map(|d| (d.code, d.severity, d.line)).collect();
        assert_eq!(said, [("nc::lathe", Severity::Error, Some(2))]);
        let kept: Vec<bool> = path.moves.iter().map(|m| m.freeze.is_some()).collect();
        assert_eq!(kept, [false, true, true]);
    }
    assert_quiet(&read("G08 P1\nG1 X1. F100.\nM30\n", Dialect::Fanuc));
}

#[test]
fn codes_of_fanuc_and_haas_that_say_how_to_move() {
    let quiet = "G05.1 Q1\nG05 P10000\nG103 P1\nG187 P3 E0.01\nG61.1\nG64\nM29 S500\nG1 X1. F100.\nM30\n";
    assert_quiet(&read(quiet, Dialect::Fanuc));
    let path = read("G154 P2\nG1 X1. F100.\nG54.1 P3\nX2.\nM30\n", Dialect::Haas);
    assert_eq!(path.moves.iter().map(|m| m.wcs).collect::<Vec<_>>(), [102, 103]);
    for (text, code) in [
        ("G1 X1. F100.\nG68.2 X0 Y0 Z0 I0 J45. K0\nX2.\nG69\nX3.\nM30\n", "nc::frame"),
        ("G1 X1. F100.\nG12.1\nX2.\nG13.1\nX3.\nM30\n", "nc::frame"),
        ("G1 X1. F100.\nG66.1 P9000\nX2.\nG67\nX3.\nM30\n", "nc::no-routine"),
    ] {
        let path = read(text, Dialect::Fanuc);
        let said: Vec<_> = path.diagnostics.iter().map(|d| (d.code, d.line)).collect();
        assert_eq!(said, [("nc::doubt", Some(2)), (code, Some(2))], "{text}");
        assert!(path.diagnostics.iter().all(|d| !d.help.is_empty()));
        assert_eq!(path.moves.iter().map(|m| m.freeze.is_some()).collect::<Vec<_>>(), [false, true, false], "{text}");
    }
    let pocket = read("G1 X1. F100.\nG12 I10. D1 F200.\nX2.\nM30\n", Dialect::Haas);
    assert_eq!(pocket.diagnostics.iter().map(|d| d.code).collect::<Vec<_>>(), ["nc::cycle"]);
    let command = read("$H\nG1 X1 F100\nM2\n", Dialect::Grbl);
    assert_eq!(command.diagnostics.iter().map(|d| (d.code, d.line)).collect::<Vec<_>>(), [("nc::command", Some(1))]);
    assert_eq!(command.moves.len(), 1);
}

#[test]
fn variables_that_only_the_control_knows_are_said_once() {
    let path = read("#1=#500+1\nG1 X#500 F100.\nX#501\n#502=3\nX#502\nX#5041\nM30\n", Dialect::Fanuc);
    let said: Vec<_> = path.diagnostics.iter().map(|d| (d.code, d.line)).collect();
    assert_eq!(said, [("nc::control-variable", Some(1)), ("nc::doubt", Some(1)), ("nc::control-variable", Some(3))]);
    assert_eq!(path.moves[1].freeze, Some(Freeze::NotUnderstood));
}

/// In Macro B an argument that a call does not give is vacant: it differs from 0 in EQ and NE, and the word it stands in is left
/// out. LinuxCNC has no vacancy: there it is 0.
#[test]
fn a_vacant_argument_is_not_zero() {
    let text = "G90 G21\nG0 X5. Y5. Z1.\nG65 P9010 Y0\nG65 P9010 X0 Y2.\nM30\nO9010\nIF [#24 EQ #0] GOTO 10\n\
        G1 X#24 F100.\nN10 G1 Y#25 F200.\nX#24 Z-1.\nM99\n";
    let ends = |dialect| -> Vec<(f64, f64)> {
        let path = read(text, dialect);
        assert!(path.doubts.is_empty(), "{:?}", path.doubts);
        path.moves.iter().map(|motion| (motion.curve().to().x, motion.curve().to().y)).collect()
    };
    for dialect in [Dialect::Fanuc, Dialect::Haas, Dialect::Generic] {
        let of_first_call = [(5.0, 0.0), (5.0, 0.0)];
        let of_second_call = [(0.0, 0.0), (0.0, 2.0), (0.0, 2.0)];
        assert_eq!(ends(dialect), [&[(5.0, 5.0)][..], &of_first_call, &of_second_call].concat(), "{dialect:?}");
    }
    let path = read(
        "#7=0\nIF [#7 NE #0] GOTO 20\nG1 X1. F100.\nN20 #7=#0\nIF [#7 EQ #0] GOTO 30\nG1 X2. F100.\nN30 M30\n",
        Dialect::Fanuc,
    );
    assert_eq!(path.moves.len(), 0, "0 is not vacant, and #7=#0 makes it so");
}

/// M129 ends that the tool tip is followed, not a plane that is still tilted.
#[test]
fn a_plane_stays_in_doubt_until_it_is_reset() {
    let doubtful = |end: &str| {
        let head = "0 BEGIN PGM A MM\n1 PLANE SPATIAL SPA+0 SPB+45 SPC+0 STAY\n2 M128\n3 M129\n";
        let path = read(&format!("{head}{end}9 L X+10 F500\n10 END PGM A MM\n"), Dialect::Heidenhain);
        path.doubts_at(feedwright::ids::MoveId(0)).next().map(|doubted| doubted.doubt)
    };
    assert_eq!(doubtful(""), Some(Doubt::TiltedFrame));
    assert_eq!(doubtful("4 PLANE RESET STAY\n"), None);
}

#[test]
fn what_is_of_one_family_is_unknown_to_the_others() {
    let unread = |text: &str, dialect| read(text, dialect).unread().iter().map(|block| block.0).collect::<Vec<_>>();
    let text = "G1 X2 F100\nG65 P100 X1\nM30\n";
    assert_eq!(unread(text, Dialect::Siemens), [1], "no macro of Fanuc's");
    assert!(unread(&format!("{text}O100\nM99\n"), Dialect::Fanuc).is_empty());
}

#[test]
fn a_block_that_cannot_be_read_puts_no_polar_coordinates_in_force() {
    let end = |text: &str| read(text, Dialect::Fanuc).moves[0].curve().to();
    let plain = end("G17 G90 G16 G987\nG1 X10. Y90. F100.\nM30\n");
    assert_eq!((plain.x, plain.y), (10.0, 90.0));
    assert!((end("G17 G90 G16\nG1 X10. Y90. F100.\nM30\n").y - 10.0).abs() < 1e-9);
}

#[test]
fn blocks_that_cannot_be_read_stand_in_their_doubt() {
    let path = read("G1 X1. F100.\nG987 X2.\nX3.\nM77\nG987 X4.\nM30\n", Dialect::Fanuc);
    assert_eq!(path.unread().iter().map(|block| block.0).collect::<Vec<_>>(), [1, 4], "an unknown M is read");
    assert_eq!(path.doubts.iter().map(|doubted| doubted.doubt).collect::<Vec<_>>(), [Doubt::UnknownCode]);
}

#[test]
fn corners_behind_a_comma() {
    for dialect in [Dialect::Fanuc, Dialect::Haas] {
        let path = read("G1 X10. F100. ,R2.\nY10. ,C3.\nX0\nM30\n", dialect);
        assert_quiet(&path);
        let xy: Vec<[f64; 2]> = ends(&path).iter().map(|end| [end[0], end[1]]).collect();
        assert_eq!(xy, [[8.0, 0.0], [10.0, 2.0], [10.0, 7.0], [7.0, 10.0], [0.0, 10.0]]);
        assert!(path.moves.iter().all(|m| m.freeze.is_none() && !m.splittable), "{:?}", path.moves);
        assert_eq!(path.moves.iter().map(|m| m.line).collect::<Vec<_>>(), [1, 1, 2, 2, 3]);
    }
    // LinuxCNC has no such corners: the block sets nothing, so that the next one has no motion.
    let path = read("G1 X10 F100 ,R2\nY10\nM2\n", Dialect::LinuxCnc);
    let said: Vec<_> = path.diagnostics.iter().map(|d| (d.code, d.line)).collect();
    assert_eq!(said, [("nc::not-understood", Some(1)), ("nc::doubt", Some(1)), ("nc::no-motion", Some(2))]);
    assert!(path.moves.is_empty());
}

#[test]
fn a_radius_in_the_block_moves_the_path_aside_by_it() {
    for word in ["G41 D.75", "G41 R.75", "G41.1 D1.5"] {
        let text = format!("G0 X0 Y-20.\nG1 F100. Y-19.\n{word} X0 Y-10.\nY30.\nG40 X-20.\nM30\n");
        let path = read(&text, Dialect::Fanuc);
        assert_quiet(&path);
        assert_eq!(path.moves[3].curve().to().x, -0.75, "{word}");
        assert!(path.moves.iter().all(|m| m.freeze.is_none()), "{word}");
    }
}

#[test]
fn a_cycle_without_g98_or_g99_withdraws_as_its_control_does() {
    let last_z = |dialect| {
        let path = read("G21 G90 G0 X0 Y0 Z10.\nG81 X1. Z-1. R2. F100.\nG80\nM30\n", dialect);
        path.moves.last().unwrap().curve().to().z
    };
    assert_eq!(last_z(Dialect::LinuxCnc), 2.0, "LinuxCNC begins with G99");
    assert_eq!(last_z(Dialect::Fanuc), 10.0, "the others with G98");
}

const MODAL: &str = "O1\nG90 G0 X0 Y0 Z5.\nG66 P9100 Z-3. R1. F77.\nX10.\nX20. Y5.\nG67\nX0 Y0\nG1 X5. F300.\nM30\nO9100\n\
    G0 Z#18\nG1 Z#26 F200.\nG0 Z5.\n#26=#26-1\nM99\n";

#[test]
fn a_modal_macro_is_called_after_every_motion() {
    let path = read(MODAL, Dialect::Fanuc);
    assert_quiet(&path);
    // The second call finds the variables as the first one left them: one deeper.
    let hole = |x: f64, y: f64, z: f64| [[x, y, 5.0], [x, y, 1.0], [x, y, z], [x, y, 5.0]];
    let expected = [&[[0.0, 0.0, 5.0]][..], &hole(10.0, 0.0, -3.0), &hole(20.0, 5.0, -4.0)].concat();
    assert_eq!(ends(&path)[..9], expected);
    assert_eq!(ends(&path)[9..], [[0.0, 0.0, 5.0], [5.0, 0.0, 5.0]]);
    let drilled: Vec<_> = path.moves.iter().filter(|m| m.kind == MoveKind::Feed && m.block.0 == 11).collect();
    assert_eq!(drilled.len(), 2);
    assert!(drilled.iter().all(|m| m.freeze.is_none() && m.shared.is_some() && m.shared == drilled[0].shared));
    assert!((path.moves[3].feed.mm_s - 200.0 / 60.0).abs() < 1e-12, "F of G66 is an argument");
}

#[test]
fn a_modal_macro_that_is_not_there_is_kept_and_said() {
    let path = read(&MODAL.replace("O9100", "O9101"), Dialect::Fanuc);
    assert!(path.diagnostics.iter().any(|d| d.code == "nc::no-routine" && d.line == Some(3)), "{:?}", path.diagnostics);
    assert!(ends(&path).iter().all(|end| end[2] == 5.0));
}

#[test]
fn arguments_of_a_macro_call_are_no_words() {
    let path = read("G0 X0 Y0\nG1 X1. F60.\nG65 P5 F9. S7. X3.\nM30\nO5\nG1 Y#24\nM99\n", Dialect::Fanuc);
    assert_eq!(ends(&path)[2], [1.0, 3.0, 0.0]);
    assert!((path.moves[2].feed.mm_s - 1.0).abs() < 1e-12 && path.moves[2].spin.rps == 0.0);
}

#[test]
fn wear_moves_the_path_by_its_value() {
    let text = "G0 X0 Y0\nG41 D1 G1 X10 Y5 F100\nX20\nY30\nG2 X30 Y40 I10\nG40 G1 X50\n";
    let with = |text: &str, environment: Environment<'_>| {
        let path = nc::interpret(&nc::parse(text.as_bytes().to_vec(), Some(Dialect::Fanuc)), &environment);
        ends(&path)
    };
    let wear = |meaning, wear_mm| Environment { compensation: Some(meaning), wear_mm, ..Environment::default() };
    // The same as the control with a tool of twice that diameter.
    let control = |side: &str| {
        let tool = Environment {
            diameters_mm: vec![(1, 0.2)],
            compensation: Some(Compensation::Control),
            ..Environment::default()
        };
        with(&text.replace("G41", side), tool)
    };
    let plain = with(text, wear(Compensation::Wear, Vec::new()));
    assert_eq!(plain, with(&text.replace("G41 D1", "").replace("G40", ""), Environment::default()));
    assert_ne!(plain, control("G41"));
    assert_eq!(with(text, wear(Compensation::Wear, vec![(1, 0.1)])), control("G41"));
    assert_eq!(with(text, wear(Compensation::Wear, vec![(1, -0.1)])), control("G42"));
    assert_eq!(with(text, wear(Compensation::InverseWear, vec![(1, 0.1)])), control("G42"));
    assert_eq!(with(&format!("G10 L13 P1 R0.1\n{text}"), wear(Compensation::Wear, vec![(1, 5.0)])), control("G41"));
    let unknown = nc::parse(text.as_bytes().to_vec(), Some(Dialect::Fanuc));
    let said = nc::interpret(&unknown, &wear(Compensation::Wear, Vec::new())).diagnostics;
    assert!(said.iter().any(|d| d.code == "nc::wear" && d.line == Some(2)), "{said:?}");
}

/// Settings of a printer's firmware carry axis letters, and move nothing.
#[test]
fn settings_of_a_firmware_are_no_motions() {
    let text = "G21\nM92 X100 Y100\nM203 X5000 Y5000 Z300\nM204 P500\nG0 X1 Y1\nG1 X10 F300\nM205 X8\n";
    let program = nc::parse(text.as_bytes().to_vec(), None);
    let found = program.recognised().expect("recognised");
    assert_eq!((found.control, program.dialect()), (nc::recognise::Control::Marlin, Dialect::Grbl));
    let path = nc::interpret(&program, &Environment::default());
    assert_eq!(ends(&path), [[1.0, 1.0, 0.0], [10.0, 1.0, 0.0]]);
    let codes: Vec<&str> = path.diagnostics.iter().map(|said| said.code).collect();
    assert_eq!(codes, ["nc::dialect"], "said once as what it is read");
}

/// A line that begins with `%` and goes on in words is a remark; `%` alone ends the program.
#[test]
fn a_percent_with_words_is_a_remark() {
    let after = |line: &str| read(&format!("%\nG1 X1 F100\n{line}\nX2\n"), Dialect::Generic).moves.len();
    assert_eq!([after("% vfd enable"), after("%"), after("% ")], [2, 1, 1]);
    assert_eq!([after("%( *** START end ***)"), after("%O2")], [2, 1], "a program's name begins another one");
}

/// Plain language with its block numbers, in an environment that knows tool 1.
fn plain(lines: &str) -> Toolpath {
    let all = std::iter::once("BEGIN PGM T MM").chain(lines.lines()).chain(std::iter::once("END PGM T MM"));
    let text: String = all.enumerate().map(|(k, line)| format!("{k} {line}\n")).collect();
    let environment = Environment { diameters_mm: vec![(1, 10.0)], ..Environment::default() };
    nc::interpret(&nc::parse(text.into_bytes(), Some(Dialect::Heidenhain)), &environment)
}

fn codes(path: &Toolpath) -> Vec<&'static str> {
    path.diagnostics.iter().map(|said| said.code).collect()
}

/// The plane of an arc follows from the axes of CC (TNC 640, Setting the pole); a ramp of Fusion lies in ZX.
#[test]
fn arcs_about_a_pole_lie_in_the_plane_of_its_axes() {
    let path = plain(
        "L X+10 Y+0 Z+0 R0 F500\nCC X+10 Z+5\nCP IPA+90 DR+\nL X+40\nCC Y+0 Z+0\nC Y+5 Z+0 DR-\nCC X+30 Y+5\nC X+30 Y+15 DR+",
    );
    assert_quiet(&path);
    let arcs: Vec<(&str, f64)> = path
        .moves
        .iter()
        .filter_map(|motion| match motion.curve() {
            Curve::Arc(arc) => Some((arc.plane.name(), (arc.sweep_rad / std::f64::consts::TAU * 1e6).round() / 1e6)),
            Curve::Line { .. } => None,
        })
        .collect();
    // In ZX the angle counts from +Z towards +X: from (X10, Z0) below the pole a quarter turn leads to X5, Z5.
    assert_eq!(arcs[0], ("zx", 0.25));
    assert_eq!(ends(&path)[1], [5.0, 0.0, 5.0]);
    assert_eq!(arcs[1].0, "yz");
    assert_eq!((arcs[1].1, ends(&path)[3]), (-0.25, [40.0, 5.0, 0.0]));
    assert_eq!(arcs[2].0, "xy", "the next pole is in XY again");
}

/// What turns the frame keeps feeds until the initial frame is there again, whatever turned it; a preset does not.
#[test]
fn frames_of_plain_language_keep_feeds_until_they_end() {
    let frozen = |on: &str, off: &str| {
        let path = plain(&format!("TOOL CALL 1 Z S3000\nL X+1 F500\n{on}\nL X+2\n{off}\nL X+3"));
        path.moves.iter().map(|motion| motion.freeze == Some(Freeze::NotUnderstood)).collect::<Vec<_>>()
    };
    for (on, off) in [
        ("PLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN MBMAX FMAX", "PLANE RESET STAY"),
        ("PLANE SPATIAL SPA+30 SPB+0 SPC+0 STAY", "PLANE SPATIAL SPA+0 SPB+0 SPC+0 STAY"),
        ("CYCL DEF 19.0 WORKING PLANE\nCYCL DEF 19.1 A+0 B+45", "CYCL DEF 19.0 WORKING PLANE\nCYCL DEF 19.1 A+0 B+0"),
        ("M128", "M129"),
        ("FUNCTION TCPM F TCP AXIS POS", "FUNCTION RESET TCPM"),
        ("TOOL CALL 1 Y S3000", "TOOL CALL 1 Z S3000"),
    ] {
        assert_eq!(frozen(on, off), [false, true, false], "{on}");
    }
    let both = frozen("M128\nPLANE SPATIAL SPA+30 SPB+0 SPC+0 STAY", "PLANE RESET STAY");
    assert_eq!(both, [false, true, true], "M128 is still in force");
    assert_eq!(frozen("CYCL DEF 247 DATUM SETTING ~\nQ339=+1 ;DATUM NUMBER", ""), [false, true, true], "after a cut");
    let presets = |first: &str, second: &str| {
        let path = plain(&format!("TOOL CALL 1 Z S3000\nL Z-1 FMAX M91\n{first}\nL X+1 F500\n{second}\nL X+2"));
        path.moves[1..].iter().map(|motion| motion.freeze == Some(Freeze::NotUnderstood)).collect::<Vec<_>>()
    };
    let of = |number: u32| format!("CYCL DEF 247 DATUM SETTING ~\nQ339=+{number} ;DATUM NUMBER");
    assert_eq!(presets(&of(1), &of(1)), [false, false]);
    assert_eq!(presets(&of(1), &of(2)), [false, true], "another preset lies elsewhere");
    assert_eq!(presets("CYCL DEF 247 DATUM SETTING Q339=+1", &of(2)), [false, true], "in one line");
}

/// What only the control knows is not 0: its words are left out and said, its cycle is kept.
#[test]
fn parameters_of_the_control_are_never_zero_by_silence() {
    let hole = |feed: &str, call: &str| {
        plain(&format!(
            "TOOL CALL {call}\nL X+5 Y+5 Z+50 R0 FMAX M3\nCYCL DEF 200 DRILLING ~\nQ200=2 ~\nQ201=-10 ~\nQ206={feed} ~\nQ202=5 ~\nQ203=+0 ~\nQ204=50\nCYCL CALL"
        ))
    };
    let feeds = |path: &Toolpath| -> Vec<f64> {
        path.moves.iter().filter(|m| m.kind == MoveKind::Feed).map(|m| (m.feed.mm_s * 60.0).round()).collect()
    };
    assert_eq!(feeds(&hole("AUTO", "1 Z S3000 F250")), [250.0; 3], "the feed of the tool call");
    let unknown = hole("AUTO", "1 Z S3000");
    assert_eq!((feeds(&unknown), codes(&unknown)), (vec![], vec!["nc::cycle"]));
    let radius = plain("TOOL CALL 1 Z S3000\nL X+Q108 R0 F500");
    assert_eq!(ends(&radius), [[5.0, 0.0, 0.0]]);
    for text in
        ["TOOL CALL 7 Z S3000\nL X+Q108 R0 F500", "L X+1 R0 F500\nQ1 = Q108 / 2\nL X+Q1", "L X+1 R0 F500\nL X+Q115"]
    {
        let path = plain(text);
        assert!(codes(&path).contains(&"nc::expression"), "{text}: {:?}", path.diagnostics);
        assert!(path.moves.iter().all(|motion| motion.curve().to().x != 0.0 || motion.freeze.is_some()), "{text}");
    }
}

/// A loop whose end hangs on a value that is not known is not run.
#[test]
fn no_loop_runs_on_a_value_that_is_not_known() {
    let path = plain(
        "L X+1 R0 F500\nQ5 = +0\nLBL 1\nQ5 = Q5 + Q108\nL IX+1\nFN 12: IF +Q5 LT +100 GOTO LBL 1\nCALL LBL 1 REP Q120",
    );
    assert!(path.moves.len() < 20, "{}", path.moves.len());
    assert!(codes(&path).contains(&"nc::expression"));
}

/// A name is a name and text is text, whatever they look like.
#[test]
fn names_and_continued_comments_are_no_words() {
    let text = "0 BEGIN PGM X10 MM\n1 ; made by ~\n  L X+99 F9 M3 ~\n  Q1 = 5\n2 L X+1 R0 F500\n3 * - part ~\n4 L X+98\n5 L X+Q1\n6 END PGM E5X7F9 MM\n";
    let program = nc::parse(text.as_bytes().to_vec(), Some(Dialect::Heidenhain));
    let path = nc::interpret(&program, &Environment::default());
    // The Q1 of the comment is not set: what it holds is not known, and that is all there is to say.
    assert_eq!(path.diagnostics.iter().map(|d| (d.code, d.line)).collect::<Vec<_>>(), [("nc::doubt", Some(8))]);
    assert_eq!(ends(&path), [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]);
    for block in program.blocks() {
        let tokens: Vec<u8> = program.tokens(block).flat_map(|token| token.span.of(program.text()).to_vec()).collect();
        assert_eq!(tokens, program.line_text(block), "tokens tile the line");
    }
}

/// Blanks between the letter of an axis, its sign and its number or parameter; assignments without FN 0.
#[test]
fn plain_language_may_set_signs_and_parameters_apart() {
    let text = "0 BEGIN PGM A MM\n1 Q11 = 3\n2 Q1 = Q11 + 7\n3 Q13 = -2\n4 L X-10 Y+5 R0 FMAX\n5 L Z + Q13 R0 F300\n\
        6 L X + Q1 Y - 5 R0 F400\n7 L IX - 4 F400\n8 L X -Q13\n9 CC X + 1 Y+0\n10 END PGM A MM\n";
    let program = nc::parse(text.as_bytes().to_vec(), Some(Dialect::Heidenhain));
    let path = nc::interpret(&program, &Environment::default());
    assert_quiet(&path);
    assert_eq!(
        ends(&path),
        [[-10.0, 5.0, 0.0], [-10.0, 5.0, -2.0], [10.0, -5.0, -2.0], [6.0, -5.0, -2.0], [2.0, -5.0, -2.0]]
    );
    for block in program.blocks() {
        let tokens: Vec<u8> = program.tokens(block).flat_map(|token| token.span.of(program.text()).to_vec()).collect();
        assert_eq!(tokens, program.line_text(block), "tokens tile the line");
    }
}

/// R left out is the level the cycle began at on a Haas; elsewhere the cycle is kept, and said.
#[test]
fn a_cycle_without_r_begins_at_its_initial_level_on_a_haas() {
    let text = "G21 G90\nS900 M3\nG0 X5. Y5. Z10.\nG81 G98 Z-5. F300.\nX10.\nG80\nM30\n";
    let read = |dialect| nc::interpret(&nc::parse(text.as_bytes().to_vec(), Some(dialect)), &Environment::default());
    let haas = read(Dialect::Haas);
    assert_quiet(&haas);
    let feeds: Vec<_> = haas.moves.iter().filter(|motion| motion.kind == MoveKind::Feed).collect();
    assert_eq!(feeds.len(), 2);
    assert!(feeds.iter().all(|motion| motion.curve().from().z == 10.0 && motion.curve().to().z == -5.0));
    assert!(read(Dialect::Fanuc).diagnostics.iter().any(|said| said.text.contains("no R plane")));
}

/// G63 as a mode: what belongs to a pitch keeps its feed, on arcs as on lines.
#[test]
fn arcs_under_g63_keep_their_feed() {
    let text = "G21 G90\nS900 M3\nG0 X5. Y0. Z0.\nG63\nG1 X10. F300.\nG3 X20. Y10. I0. J10.\nG64\nG3 X10. Y0. I-10. J0.\nM30\n";
    let path = nc::interpret(&nc::parse(text.as_bytes().to_vec(), Some(Dialect::Fanuc)), &Environment::default());
    let kept: Vec<bool> = path.moves.iter().filter(|m| m.kind == MoveKind::Feed).map(|m| m.freeze.is_some()).collect();
    assert_eq!(kept, [true, true, false]);
}

/// Settings of a firmware move nothing, whatever the text is called; only where the control may be one, they are no doubt.
#[test]
fn settings_of_a_firmware_are_no_motions_in_any_dialect() {
    for dialect in [Dialect::Grbl, Dialect::Generic, Dialect::LinuxCnc, Dialect::Fanuc, Dialect::Haas] {
        let text = "G21 G90\nG1 X1. F300.\nM203 X5000 Y5000\nM92 X100 Y100 Z400\nM201 X9000\nX2.\n";
        let path = nc::interpret(&nc::parse(text.as_bytes().to_vec(), Some(dialect)), &Environment::default());
        assert_eq!(ends(&path), [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], "{}", dialect.name());
        let may_be_one = matches!(dialect, Dialect::Grbl | Dialect::Generic);
        assert_eq!(path.doubts.is_empty(), may_be_one, "{}", dialect.name());
    }
}

#[test]
fn a_doubt_that_the_setup_confirms_is_a_note_and_promises_nothing_else() {
    let program = nc::parse(b"G21 G90\nG0 X0 Y0 Z5\nM77\nG1 X9 F100\nM30\n".to_vec(), Some(Dialect::Fanuc));
    let said = |confirmed: [Vec<&'static str>; 2]| {
        let path = nc::interpret(&program, &Environment { confirmed, ..Environment::default() });
        let doubt = path.diagnostics.iter().find(|d| d.code == "nc::doubt").unwrap();
        (doubt.severity, doubt.text.rsplit(": ").next().unwrap().to_owned())
    };
    let warning = |text: &str| (Severity::Warning, text.to_owned());
    assert_eq!(said([vec![], vec![]]), warning("no feed is raised from here on"));
    assert_eq!(said([vec!["probe"], vec!["probe"]]), warning("no feed is raised from here on"));
    let in_part = "from here on feeds are raised only where the setup confirms it";
    assert_eq!(said([vec![], vec!["unknown-code"]]), warning(in_part));
    let note = (Severity::Note, "the setup confirms that nothing changes by it".to_owned());
    assert_eq!(said([vec!["unknown-code"], vec![]]), note);
}

/// Lowest heights of the feed moves.
fn depths(path: &Toolpath) -> Vec<f64> {
    let feeds = path.moves.iter().filter(|motion| motion.kind == MoveKind::Feed);
    feeds.map(|motion| motion.curve().to().z).filter(|z| *z < 0.0).collect()
}

/// On a Haas only L repeats a cycle; K is the smallest peck of G73 and G83. Elsewhere `K0` drills nothing.
#[test]
fn k_of_a_haas_is_a_peck_and_no_number_of_repeats() {
    let text = "G21 G90 G0 X0 Y0 Z10.\nG83 G99 X1. Z-6. R1. I2. J0.5 K0.5 F240.\nX5.\nG80\nM30\n";
    assert_eq!(depths(&read(text, Dialect::Haas)), [-6.0, -6.0]);
    assert_eq!(depths(&read(text, Dialect::Fanuc)), [-6.0]);
    let several = "G21 G90 G0 X0 Y0 Z10.\nG81 G99 X1. Z-6. R1. F240.\nG91 X5. L3\nG80\nM30\n";
    assert_eq!(depths(&read(several, Dialect::Haas)), [-6.0; 4]);
}

/// A row of holes in steps: on Fanuc and Haas depth and R plane stay where G90 has put them; LinuxCNC counts them from the initial level and R.
#[test]
fn levels_of_a_cycle_stay_when_its_holes_go_on_in_steps() {
    let text = "G21 G90 G0 X0 Y0 Z10.\nG99 G81 X10. Y10. Z-12. R2. F250.\nG91 X10. K2\nG90 G80\nM30\n";
    assert_eq!(depths(&read(text, Dialect::Fanuc)), [-12.0; 3]);
    let steps = "G21 G91 G0 X0 Y0 Z10.\nG99 G81 X10. Y10. Z-14. R-8. F250.\nX10. K2\nG90 G80\nM30\n";
    assert_eq!(depths(&read(steps, Dialect::Fanuc)), [-12.0; 3]);
    let lcnc = read(&text.replace("K2", "L2"), Dialect::LinuxCnc);
    assert_eq!(lcnc.moves.iter().rfind(|m| m.kind == MoveKind::Feed).unwrap().curve().to().z, 0.0);
}

#[test]
fn s_behind_g4_is_turns_to_dwell_and_no_speed() {
    let path = read("G71 G90\nS3000 M3\nG1 X10 F500\nG4 S30\nX20\nM30\n", Dialect::Siemens);
    assert!(path.moves.iter().all(|motion| motion.spin.rps == 50.0), "{:?}", path.moves);
}

/// Rigid tapping starts the spindle itself, right- or left-handed, and leaves it standing; LinuxCNC wants it to turn before.
#[test]
fn rigid_tapping_starts_the_spindle() {
    let turns = |dialect: Dialect, cycle: &str| -> Vec<(f64, bool)> {
        let text = format!("T1 M6\nS600\nG0 X0. Y0. Z5.\n{cycle}\nG0 Z50.\nG1 X10. F100.\nM30\n");
        let path = read(&text, dialect);
        let feeds = path.moves.iter().filter(|m| m.kind == MoveKind::Feed);
        feeds.map(|m| (m.spin.rps, m.spin.reverse)).collect()
    };
    let right = [(10.0, false), (10.0, true), (0.0, false)];
    let left = [(10.0, true), (10.0, false), (0.0, false)];
    for dialect in [Dialect::Fanuc, Dialect::Haas] {
        assert_eq!(turns(dialect, "G98 G84 Z-15. R2. F600.\nG80"), right);
        assert_eq!(turns(dialect, "G98 G74 Z-15. R2. F600.\nG80"), left);
    }
    assert_eq!(turns(Dialect::Fanuc, "M29 S600\nG98 G84 Z-15. R2. F600.\nG80"), right);
    assert_eq!(turns(Dialect::Siemens, "CYCLE84(50,0,2,-15,,,3,,1,0,600,600)"), right);
    assert_eq!(turns(Dialect::LinuxCnc, "G98 G84 Z-15. R2. F600.\nG80"), [(0.0, false); 3]);
}
