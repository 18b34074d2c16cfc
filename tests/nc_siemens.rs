//! Siemens 840D: structures, frames, corners and arcs, worked out by hand.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use feedwright::nc::{self, Dialect, Doubt, Environment, Freeze, MoveKind, Toolpath};
use feedwright::path::Curve;

fn read(text: &str) -> Toolpath {
    let environment = Environment { max_repeated_bytes: 1 << 18, ..Environment::default() };
    nc::interpret(&nc::parse(text.as_bytes().to_vec(), Some(Dialect::Siemens)), &environment)
}

fn ends(path: &Toolpath) -> Vec<[f64; 2]> {
    let round = |value: f64| (value * 1e3).round() / 1e3 + 0.0;
    path.moves.iter().map(|m| m.curve().to()).map(|p| [round(p.x), round(p.y)]).collect()
}

#[track_caller]
fn assert_ends(text: &str, expected: &[[f64; 2]]) {
    let path = read(text);
    assert!(path.diagnostics.is_empty(), "{text}: {:?}", path.diagnostics);
    let stated = usize::from(text.starts_with("G1 F100\n")); // G1 alone is a motion without length
    assert_eq!(ends(&path)[stated..], *expected, "{text}");
}

#[test]
fn a_sign_before_a_number_is_no_word() {
    let text = b"G90 T2 $6\nG1 X5 F100\nM30\n".to_vec();
    let path = nc::interpret(&nc::parse(text, Some(Dialect::Siemens)), &Environment::default());
    assert!(path.diagnostics.iter().any(|said| said.code == "nc::not-understood" && said.line == Some(1)));
}

#[test]
fn structures_are_executed() {
    assert_ends("FOR R1=1 TO 3\nG1 X=R1 F100\nENDFOR\nM30\n", &[[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]);
    assert_ends("FOR R1=5 TO 3\nG1 X=R1 F100\nENDFOR\nG0 X9\nM30\n", &[[9.0, 0.0]]);
    assert_ends(
        "G1 F100\nFOR R1 = 0 TO 1\nFOR R2 = 1 TO 2\nX=R1*10+R2\nENDFOR\nENDFOR\nM30\n",
        &[[1.0, 0.0], [2.0, 0.0], [11.0, 0.0], [12.0, 0.0]],
    );
    assert_ends("R1=0\nWHILE R1<2\nG1 Y=R1 F100\nR1=R1+1\nENDWHILE\nM30\n", &[[0.0, 0.0], [0.0, 1.0]]);
    assert_ends("R1=0\nREPEAT\nG1 Y=R1 F100\nR1=R1+1\nUNTIL (R1==2)\nM30\n", &[[0.0, 0.0], [0.0, 1.0]]);
    assert_ends(
        "R1=0\nLOOP\nR1=R1+1\nIF R1>2 GOTOF OUT\nG1 X=R1 F100\nENDLOOP\nOUT:\nX9\nM30\n",
        &[[1.0, 0.0], [2.0, 0.0], [9.0, 0.0]],
    );
    let choice = "G1 F100\nR1=0 R2=0\nIF R1==1\nX1\nIF R2==1\nX2\nELSE\nX3\nENDIF\nELSE\nX4\nENDIF\nY1\nM30\n";
    assert_ends(choice, &[[4.0, 0.0], [4.0, 1.0]]);
    assert_ends(&choice.replace("R1=0", "R1=1"), &[[1.0, 0.0], [3.0, 0.0], [3.0, 1.0]]);
    assert_ends("N10 GOTOF END\nG1 X1 F1\nEND: G1 X2 F100\nM30\n", &[[2.0, 0.0]]);
}

#[test]
fn what_does_not_end_or_close_is_said() {
    for (text, code) in [
        ("LOOP\nENDLOOP\n", "nc::runaway"),
        ("FOR R1=1 TO 3\nG1 X1 F1\n", ""),
        ("ENDWHILE\n", "nc::unbalanced"),
        ("WHILE 1<0\nG1 X1 F1\n", "nc::unbalanced"),
        ("GOTOF NOWHERE\n", "nc::no-target"),
        ("CASE R1 GOTOF HERE\nHERE:\n", "nc::not-understood"),
        ("THERE:\nGOTOF THERE\n", "nc::no-target"),
        ("GOTOB THERE\nTHERE:\n", "nc::no-target"),
        ("REPEAT NOWHERE P=2\nG1 X1 F1\n", "nc::no-target"),
        ("REPEAT LATER P=2\nG1 X1 F1\nLATER:\n", "nc::no-target"),
        ("ON:\nG91 X1\nREPEAT ON P=1000000000\n", "nc::runaway"),
        ("DEEPER\nM30\n%_N_DEEPER_SPF\nDEEPER\nM17\n", "nc::runaway"),
        ("MCALL OWNCYCLE(1)\nG1 X1 F1\n", "nc::modal-call"),
        ("TRAORI\nG1 X1 F1\n", "nc::frame"),
        ("CYCLE800(1,\"TABLE\",0,57,0,0,0,0,45,0,0,0,0,1)\nG1 X1 F1\n", "nc::frame"),
        ("FOR R1=1\nENDFOR\n", "nc::not-understood"),
    ] {
        let found: Vec<_> = read(text).diagnostics.iter().map(|d| d.code).collect();
        assert!(found.contains(&code) || code.is_empty() && found.is_empty(), "{text}: {found:?}");
    }
}

#[test]
fn jumps_go_where_they_say() {
    let case = |value: i32| {
        format!(
            "R1={value}\nG1 F100\nCASE(R1+1) OF 2 GOTOF ONE 3 GOTOF TWO DEFAULT GOTOF NONE\nONE: X1\nTWO: X2\nNONE: X3\nM30\n"
        )
    };
    for (value, expected) in [(1, vec![1.0, 2.0, 3.0]), (2, vec![2.0, 3.0]), (5, vec![3.0])] {
        let path = read(&case(value));
        assert!(path.diagnostics.is_empty(), "{:?}", path.diagnostics);
        assert_eq!(ends(&path)[1..].iter().map(|end| end[0]).collect::<Vec<_>>(), expected, "R1={value}");
    }
    assert_ends("G1 F100\nX1\nGOTOC NOWHERE\nGOTO ON\nX9\nON: X2\nM30\n", &[[1.0, 0.0], [2.0, 0.0]]);
    // R1 lasts from the run before: it is read as 0, and that is a doubt.
    let again = read("G1 F100\nIF R1>1 GOTOF OUT\nX=R1\nR1=R1+1\nGOTOS\nOUT:\nM30\n");
    assert_eq!(ends(&again)[1..].iter().map(|end| end[0]).collect::<Vec<_>>(), [0.0, 0.0, 1.0, 1.0]);
    // GOTOS may begin all of it again.
    let said: Vec<_> = again.diagnostics.iter().map(|d| (d.code, d.line)).collect();
    assert_eq!(said, [("nc::doubt", Some(2)), ("nc::runs-again", Some(2))]);
}

#[test]
fn sections_are_repeated() {
    let back = "G1 F100\nG91\nMARK: X1\nY1\nREPEAT MARK P=2\nX5\nM30\n";
    let step = |n: u32| [f64::from(n), f64::from(n)];
    assert_ends(back, &[[1.0, 0.0], step(1), [2.0, 1.0], step(2), [3.0, 2.0], step(3), [8.0, 3.0]]);
    let between = "G1 F100\nG91\nR1=1\nFROM: X1\nUPTO: Y1\nX5\nREPEAT FROM UPTO P=R1\nM30\n";
    assert_ends(between, &[[1.0, 0.0], [1.0, 1.0], [6.0, 1.0], [7.0, 1.0], [7.0, 2.0]]);
    let ahead = "G1 F100\nG91\nREPEAT FROM UPTO\nX5\nGOTOF OUT\nFROM: X1\nUPTO: Y1\nOUT: M30\n";
    assert_ends(ahead, &[[1.0, 0.0], [1.0, 1.0], [6.0, 1.0]]);
    let closed = "G1 F100\nG91\nREPEAT FROM P=2\nM30\nFROM: X1\nENDLABEL: Y1\nX9\n";
    assert_ends(closed, &[[1.0, 0.0], [1.0, 1.0], [2.0, 1.0], [2.0, 2.0]]);
    let one = "G1 F100\nG91\nHERE: X1\nY1\nREPEATB HERE P=3\nREPEAT N70\nM30\n";
    assert_eq!(
        read(one).diagnostics.iter().map(|d| (d.code, d.line)).collect::<Vec<_>>(),
        [("nc::doubt", Some(6)), ("nc::no-target", Some(6))]
    );
    assert_ends(&one.replace("REPEAT N70\n", ""), &[[1.0, 0.0], [1.0, 1.0], [2.0, 1.0], [3.0, 1.0], [4.0, 1.0]]);
    let nested = "G1 F100\nG91\nOUTER: X1\nINNER: Y1\nREPEAT INNER P=1\nREPEAT OUTER P=1\nM30\n";
    assert_eq!(read(nested).moves.last().unwrap().curve().to().y, 4.0);
    let left = "G1 F100\nG91\nR1=0\nMARK: X1\nR1=R1+1\nIF R1==2 GOTOF OUT\nREPEAT MARK P=5\nOUT: Y1\nM30\n";
    assert_ends(left, &[[1.0, 0.0], [2.0, 0.0], [2.0, 1.0]]);
    let repeated = read(back);
    assert_eq!(repeated.moves[1..6].iter().map(|m| m.instance).collect::<Vec<_>>(), [0, 0, 1, 1, 2]);
    assert!(repeated.moves[1].shared.is_some() && repeated.moves[1].shared == repeated.moves[5].shared);
}

#[test]
fn subprograms_have_names_of_their_own_and_share_r() {
    let text = "G1 F100\nDEF REAL AT=7\nR1=1\nSIDE(3, 4)\nX=AT Y=R1\nL5 P2\nM30\n\
        %_N_SIDE_SPF\nPROC SIDE(REAL AT, REAL UP, REAL HIGH=9) SAVE DISPLOF\nDEF INT II\nX=AT Y=UP Z=HIGH\nR1=R1+1\nRET\n\
        %_N_L5_SPF\nG91 X1\nG90\nM17\n";
    assert_ends(text, &[[3.0, 4.0], [7.0, 2.0], [8.0, 2.0], [9.0, 2.0]]);
    let same_label = "G1 F100\nGOTOF OUT\nX9\nOUT: X1\nSUB1\nM30\n%_N_SUB1_SPF\nGOTOF OUT\nX9\nOUT: X2\nM17\n";
    assert_ends(same_label, &[[1.0, 0.0], [2.0, 0.0]]);
}

#[test]
fn the_edge_number_is_not_a_tool_number() {
    let compensation = Some(feedwright::machine::Compensation::Control);
    let diameters_mm = vec![(1, 20.0), (5, 10.0)];
    let environment = Environment { compensation, diameters_mm, ..Environment::default() };
    let text = "T5 D1\nM6\nG0 X0 Y-40\nG1 G41 D1 X0 Y0 F100\nY60 RND=5\nX100\nM30\n";
    let path = nc::interpret(&nc::parse(text.as_bytes().to_vec(), Some(Dialect::Siemens)), &environment);
    assert!(path.diagnostics.is_empty(), "{:?}", path.diagnostics);
    assert_eq!(ends(&path)[1..], [[-5.0, 0.0], [-5.0, 55.0], [5.0, 65.0], [100.0, 65.0]]);
}

#[test]
fn machine_coordinates_and_offsets() {
    let origins = vec![(54, feedwright::path::Vec3::new(100.0, 0.0, 0.0))];
    let environment = Environment { origins, ..Environment::default() };
    let program =
        nc::parse(b"G54 G0 X1\nSUPA X5\nG153 X6\nX1\nG500 X2\nG505 X3\nM30\n".to_vec(), Some(Dialect::Siemens));
    let path = nc::interpret(&program, &environment);
    // The setup gives the origin of G54 alone: where the other two lie is a doubt.
    assert_eq!(path.diagnostics.iter().map(|d| (d.code, d.line)).collect::<Vec<_>>(), [("nc::doubt", Some(5))]);
    assert_eq!(path.moves.iter().map(|m| m.curve().to().x).collect::<Vec<_>>(), [1.0, -95.0, -94.0, 1.0, 2.0, 3.0]);
    let quiet = "WORKPIECE(,,,\"BOX\",112,0,-20,-80,0,0,100,60)\nCYCLE832(0.01,_FINISH,1)\nCYCLE800()\nG331 Z1\nG1 X1 F100 NORM\nM30\n";
    let path = read(quiet);
    assert!(path.diagnostics.is_empty(), "{:?}", path.diagnostics);
    assert_eq!(path.moves.iter().map(|m| m.freeze).collect::<Vec<_>>(), [Some(Freeze::Synchronised), None]);
}

#[test]
fn frames_shift_turn_scale_and_mirror() {
    assert_ends("G1 F100\nTRANS X10\nX1\nATRANS X5\nX1\nTRANS\nX1\nM30\n", &[[11.0, 0.0], [16.0, 0.0], [1.0, 0.0]]);
    assert_ends("G1 F100\nTRANS X10 Y5\nAROT RPL=90\nX2 Y0\nM30\n", &[[10.0, 7.0]]);
    assert_ends("G1 F100\nROT Z90\nX2 Y0\nATRANS X3\nX0\nROT\nX1 Y0\nM30\n", &[[0.0, 2.0], [0.0, 3.0], [1.0, 0.0]]);
    assert_ends(
        "G1 F100\nSCALE X2 Y2\nX3 Y1\nAROT RPL=90\nX1 Y0\nSCALE\nX1\nM30\n",
        &[[6.0, 2.0], [0.0, 2.0], [1.0, 2.0]],
    );
    assert_ends("G1 F100\nMIRROR X0\nX3 Y1\nAROT RPL=90\nX1 Y0\nMIRROR\nM30\n", &[[-3.0, 1.0], [0.0, 1.0]]);
    let mirrored = read("G1 F100\nAMIRROR Y0\nG2 X10 Y0 CR=5\nM30\n");
    let Curve::Arc(arc) = mirrored.moves[1].curve() else { panic!("an arc") };
    assert!(arc.sweep_rad > 0.0);
    let tilted = read("G1 F100\nX1\nROT X30\nX2\nTRANS\nX3\nM30\n");
    assert_eq!(
        tilted.moves.iter().map(|m| m.freeze).collect::<Vec<_>>(),
        [None, None, Some(Freeze::NotUnderstood), None]
    );
    let said: Vec<_> = tilted.diagnostics.iter().map(|d| (d.code, d.line)).collect();
    assert_eq!(said, [("nc::doubt", Some(3)), ("nc::frame", Some(3))]);
}

#[test]
fn arcs_through_a_point_and_tangential_ones() {
    let path = read("G1 F100 X0 Y0\nCIP X10 Y0 I1=5 J1=5\nM30\n");
    assert!(path.diagnostics.is_empty(), "{:?}", path.diagnostics);
    let Curve::Arc(arc) = path.moves[1].curve() else { panic!("an arc") };
    assert!((arc.radius_mm - 5.0).abs() < 1e-9 && (arc.sweep_rad + std::f64::consts::PI).abs() < 1e-9, "{arc:?}");
    let path = read("G1 F100 X10\nCT X20 Y10\nG1 X20 Y20\nM30\n");
    assert!(path.diagnostics.is_empty(), "{:?}", path.diagnostics);
    let Curve::Arc(arc) = path.moves[1].curve() else { panic!("an arc") };
    assert!((arc.radius_mm - 10.0).abs() < 1e-9 && (arc.sweep_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
    // Turned by 90 degrees, and mirrored: the same arc there.
    for (frame, end, sweep) in [("ROT RPL=90", [-10.0, 20.0], 1.0), ("MIRROR X0", [-20.0, 10.0], -1.0)] {
        let path = read(&format!("{frame}\nG1 F100 X10\nCT X20 Y10\nM30\n"));
        let Curve::Arc(arc) = path.moves[1].curve() else { panic!("{frame}: an arc, {:?}", path.diagnostics) };
        let off = [arc.to.x - end[0], arc.to.y - end[1]];
        assert!(off.iter().all(|mm| mm.abs() < 1e-9) && (arc.radius_mm - 10.0).abs() < 1e-9, "{frame}: {arc:?}");
        assert!((arc.sweep_rad - sweep * std::f64::consts::FRAC_PI_2).abs() < 1e-9, "{frame}: {arc:?}");
    }
    let lost = read("G0 X10\nCT X20 Y10 F100\nM30\n");
    assert_eq!(lost.moves[1].freeze, Some(Freeze::NotUnderstood));
    assert!(lost.doubts.iter().any(|doubted| doubted.doubt == Doubt::UnknownCode), "{:?}", lost.doubts);
}

#[test]
fn corners_are_rounded_and_chamfered() {
    let path = read("G1 F100 X10 RND=2\nY10 CHR=3\nX0\nM30\n");
    assert!(path.diagnostics.is_empty(), "{:?}", path.diagnostics);
    let expected = [[8.0, 0.0], [10.0, 2.0], [10.0, 7.0], [7.0, 10.0], [0.0, 10.0]];
    assert_eq!(ends(&path), expected);
    let Curve::Arc(arc) = path.moves[1].curve() else { panic!("an arc") };
    assert!((arc.radius_mm - 2.0).abs() < 1e-9 && (arc.centre.x - 8.0).abs() < 1e-9 && arc.sweep_rad > 0.0);
    let chamfer = read("G1 F100 X10 CHF=2\nY10\nM30\n");
    let Curve::Line { from, to } = chamfer.moves[1].curve() else { panic!("a line") };
    assert!(((to - from).norm() - 2.0).abs() < 1e-9);
    let too_large = read("G1 F100 X10 RND=20\nY10\nM30\n");
    assert_eq!(ends(&too_large), [[10.0, 0.0], [10.0, 10.0]]);
    assert!(too_large.moves.iter().all(|m| m.freeze == Some(Freeze::NotUnderstood)));
    assert_eq!(too_large.diagnostics[0].code, "nc::corner");
}

#[test]
fn common_drilling_cycles_are_simulated_and_the_others_said() {
    let deepest = |text: &str| {
        let path = read(text);
        let feeds = path.moves.iter().filter(|m| m.kind == MoveKind::Feed);
        (feeds.clone().count(), feeds.map(|m| m.curve().to().z).fold(f64::INFINITY, f64::min), path)
    };
    assert_eq!(deepest("G0 Z50\nF100\nCYCLE81(10,0,2,-8)\nM30\n").1, -8.0);
    assert_eq!(deepest("G0 Z50\nF100\nCYCLE82(10,0,2,,8,0.5)\nM30\n").1, -8.0);
    let (pecks, depth, _) = deepest("G0 Z50\nF100\nCYCLE83(10,0,1,-9,,-3,,3,0,0,1,1)\nM30\n");
    assert!(pecks >= 3 && depth == -9.0, "{pecks} {depth}");
    let (moves, _, path) = deepest("G0 Z50\nPOCKET3(10,0,2,-5)\nM30\n");
    assert_eq!((moves, path.diagnostics[0].code), (0, "nc::cycle"));
}

#[test]
fn tools_are_called_by_name() {
    let names = || Environment { tool_names: vec![("MILL 10".into(), 7)], ..Environment::default() };
    let programs = [
        (Dialect::Siemens, "T=\"MILL 10\" D1\nM6\nG1 X1 F100\nM30\n"),
        (Dialect::Heidenhain, "0 BEGIN PGM T MM\n1 TOOL CALL \"MILL 10\" Z S3000\n2 L X+1 F100\n3 END PGM T MM\n"),
    ];
    for (dialect, text) in programs {
        let program = nc::parse(text.as_bytes().to_vec(), Some(dialect));
        let path = nc::interpret(&program, &names());
        assert!(path.diagnostics.is_empty(), "{:?}", path.diagnostics);
        assert_eq!((path.moves[0].tool, path.moves[0].freeze), (7, None));
        let changes = path.between.iter().filter(|(_, event)| matches!(event, nc::Event::Tool { .. })).count();
        assert_eq!(changes, 1, "{dialect:?}: the tool is changed once");
        let unknown = nc::interpret(&program, &Environment::default());
        assert_eq!((unknown.moves[0].tool, unknown.diagnostics[0].code), (0, "nc::tool-name"));
        assert!(unknown.diagnostics[0].help.contains("tool_names = { \"MILL 10\" = 1 }"));
    }
}

/// DC, ACP and ACN give the angle of a rotary axis; FNORM changes nothing; a rounding of every corner that is not followed is a
/// doubt, its end is none.
#[test]
fn angles_feeds_and_modal_rounding_of_siemens() {
    let path = read("G90\nG1 X10 C=DC(90) F400 FNORM\nX20 C=ACP(0)\nM30\n");
    let codes: Vec<_> = path.diagnostics.iter().map(|said| said.code).collect();
    assert!(codes.iter().all(|code| ["nc::rotary", "nc::doubt"].contains(code)), "{:?}", path.diagnostics);
    assert_eq!(ends(&path), [[10.0, 0.0], [20.0, 0.0]]);
    assert!(path.doubts.iter().all(|doubted| doubted.doubt == Doubt::RotaryAxis), "{:?}", path.doubts);
    let rounded = read("G1 X10 F400\nRNDM=2\nX20\nY20\nRNDM=0\nM30\n");
    assert_eq!(rounded.doubts.iter().map(|doubted| doubted.line).collect::<Vec<_>>(), [2]);
    assert!(read("G1 X10 F400\nRNDM=0\nX20\nM30\n").doubts.is_empty());
    assert!(!read("G1 X10 F400 FCUB\nX20\nM30\n").doubts.is_empty(), "a feed that is not constant is not known");
}

/// FRC is the feed of one corner and FRCM that of all others, FB the feed of one block; they are kept, and the feed behind them is F again.
#[test]
fn corners_and_blocks_have_feeds_of_their_own() {
    let feeds = |text: &str| -> Vec<(f64, Option<Freeze>)> {
        let path = read(text);
        assert!(path.diagnostics.is_empty() && path.doubts.is_empty(), "{:?}", path.diagnostics);
        path.moves.iter().map(|motion| ((60.0 * motion.feed.mm_s).round(), motion.freeze)).collect()
    };
    let own = Some(Freeze::OwnFeed);
    let corner = feeds("G1 F400 X10 RND=2 FRC=100\nY10\nX0 RND=2\nY0\nM30\n");
    assert_eq!(corner[1], (100.0, own));
    assert!(corner.iter().enumerate().all(|(k, (feed, why))| k == 1 || *feed == 400.0 && why.is_none()), "{corner:?}");
    let all = feeds("FRCM=200\nG1 F400 X10 RND=2\nY10 RND=2 FRC=100\nX0 RND=2\nY0\nFRCM=0\nX10 RND=2\nY10\nM30\n");
    let corners = all.iter().filter(|(_, why)| *why == own).map(|(feed, _)| *feed).collect::<Vec<_>>();
    assert_eq!(corners, [200.0, 100.0, 200.0]);
    assert_eq!(feeds("G1 F400 X10\nFB=150 X20\nX30\nM30\n"), [(400.0, None), (150.0, own), (400.0, None)]);
    assert_eq!(feeds("S600 M3 G1 G95 F0.1 X10\nX20 FB=0.2\nM30\n")[1], (120.0, own));
}

/// Under compensation F holds along the contour unless CFTCP says otherwise: with the contour's radius r and the tool radius R the centre runs at
/// F (r ± R) / r; under CFIN inside of the contour alone. On lines it is F.
#[test]
fn the_feed_of_a_compensated_arc_holds_along_the_contour() {
    let compensation = Some(feedwright::machine::Compensation::Control);
    let environment = Environment { compensation, diameters_mm: vec![(1, 10.0)], ..Environment::default() };
    let feeds = |manner: &str, arc: &str| {
        let text = format!(
            "T1 D1\nM6\nS3000 M3\nG0 X-20 Y0\nG1 G41 {manner} X0 Y0 F600\nX30\n{arc}\nG1 X40 Y40\nG40 X60 Y60\nM30\n"
        );
        let program = nc::parse(text.into_bytes(), Some(Dialect::Siemens));
        let path = nc::interpret(&program, &environment);
        let round = |motion: &nc::Move| (60.0 * motion.feed.mm_s * 10.0).round() / 10.0;
        let arcs = path.moves.iter().filter(|motion| matches!(motion.curve(), Curve::Arc(_)));
        let lines = path.moves.iter().filter(|m| matches!(m.curve(), Curve::Line { .. }) && m.kind == MoveKind::Feed);
        assert!(lines.into_iter().all(|motion| round(motion) == 600.0), "{:?}", path.moves);
        arcs.map(round).collect::<Vec<_>>()
    };
    // G41 is left of the contour: a left turn of radius 10 is run at radius 5, a right turn at 15.
    let [inner, outer] = ["G3 X40 Y10 CR=10", "G2 X40 Y-10 CR=10"];
    for (manner, expected) in
        [("", [300.0, 900.0]), ("CFC", [300.0, 900.0]), ("CFTCP", [600.0; 2]), ("CFIN", [300.0, 600.0])]
    {
        assert_eq!(feeds(manner, inner)[0], expected[0], "{manner}");
        assert_eq!(feeds(manner, outer)[0], expected[1], "{manner}");
    }
}
