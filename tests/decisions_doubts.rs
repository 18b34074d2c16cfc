//! What the simulation cannot know is never air: after an event of the text that may have moved part or frame, no feed is
//! raised, and it is said once. One row for each event; then every event at every place of a program; then what is no event.

#![allow(clippy::unwrap_used)]

#[path = "common/slot.rs"]
#[allow(dead_code)] // other tests use more of it
mod slot;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use feedwright::nc::{self, Dialect, Doubt, Environment, Freeze, MoveKind, Toolpath};
use feedwright::path::Vec3;

/// Cut once, and once more where the simulation believes that nothing is left.
const BEFORE: [&str; 9] =
    ["%", "O1234", "G21 G90 G17", "T1 M6", "S8000 M3", "G0 X-8. Y10. Z5.", "G1 Z-2. F300.", "G1 X48. F600.", "G0 Z5."];
const AFTER: [&str; 7] = ["S8000 M3", "G0 X-8. Y10.", "G1 Z-2. F300.", "G1 X48. F600.", "G0 Z5.", "M30", "%"];

/// Name, what stands between the two cuts, the dialect, and the doubt it is.
const EVENTS: [(&str, &str, Dialect, Doubt); 83] = [
    ("stop", "M0", Dialect::Fanuc, Doubt::ProgramStop),
    ("stop by a variable", "#3006=1 (TURN PART)", Dialect::Fanuc, Doubt::ProgramStop),
    ("tool changed by hand", "M5\nM0 (CHANGE TOOL)", Dialect::Grbl, Doubt::ProgramStop),
    ("pallet", "M60", Dialect::LinuxCnc, Doubt::ProgramStop),
    ("table turned", "G0 A90.", Dialect::Fanuc, Doubt::RotaryAxis),
    ("head turned", "A-75.", Dialect::Generic, Doubt::RotaryAxis),
    ("turned by an increment", "G91 G0 B45. G90", Dialect::Haas, Doubt::RotaryAxis),
    ("both, a cut and back", "G0 A-60. C30.\nG1 X0. F600.\nG0 Z5. A0. C0.", Dialect::Fanuc, Doubt::RotaryAxis),
    ("tool centre point", "G43.4 H1", Dialect::Fanuc, Doubt::TiltedFrame),
    ("tool centre point 2", "G43.5 H1", Dialect::Fanuc, Doubt::TiltedFrame),
    ("tool centre point of Haas", "G234 H1", Dialect::Haas, Doubt::TiltedFrame),
    ("tilted plane", "G68.2 X0 Y0 Z0 I0 J45. K0", Dialect::Fanuc, Doubt::TiltedFrame),
    (
        "tilted plane, a cut and back",
        "G68.2 X0 Y0 Z0 I0 J45. K0\nG1 X0. F600.\nG69",
        Dialect::Fanuc,
        Doubt::TiltedFrame,
    ),
    ("rotation in space", "G68 X0 Y0 Z0 I0 J1. K0 R30.", Dialect::Fanuc, Doubt::TiltedFrame),
    ("polar interpolation", "G12.1", Dialect::Fanuc, Doubt::TiltedFrame),
    ("offset without origin", "G55", Dialect::Fanuc, Doubt::WorkOffset),
    ("additional offset", "G54.1 P2", Dialect::Fanuc, Doubt::WorkOffset),
    ("additional offset in short", "G54 P2", Dialect::Haas, Doubt::WorkOffset),
    ("origin by its variable", "#5221=5.", Dialect::Fanuc, Doubt::ZeroShift),
    ("zero of an earlier program", "G92.3", Dialect::LinuxCnc, Doubt::ZeroShift),
    ("switches of two numbers", "/1 G0 Y12.\n/2 G0 Y10.", Dialect::Fanuc, Doubt::BlockDelete),
    (
        "branch on a name that outlasts the program",
        "o1 if [EXISTS[#<_q>]]\nG0 Y10.\no1 endif",
        Dialect::LinuxCnc,
        Doubt::UnknownValue,
    ),
    ("spiral of several turns", "G3 X0. Y20. I4. J5. L3 F300.", Dialect::Fanuc, Doubt::UnknownCode),
    ("cone", "G3 X0. Y20. I4. J5. Q1. F300.", Dialect::Haas, Doubt::UnknownCode),
    (
        "arc under two scales",
        "G51 X0 Y0 Z0 I2. J1. K1.\nG3 X0. Y20. R10. F300.\nG50",
        Dialect::Fanuc,
        Doubt::UnknownCode,
    ),
    (
        "condition whose order is not written",
        "#1=1\nIF [#1 EQ 1 AND #1 LT 2] GOTO 7\nG0 Y12.\nN7 G0 Z5.",
        Dialect::Fanuc,
        Doubt::UnknownValue,
    ),
    ("speed limited below S", "G92 S2000", Dialect::Fanuc, Doubt::SurfaceSpeed),
    ("offset by its own code", "G113", Dialect::Haas, Doubt::WorkOffset),
    ("radius by steps", "G16\nG91 G1 X5. Y10. F300.\nG90 G15", Dialect::Fanuc, Doubt::UnknownCode),
    ("machine coordinates by steps", "G91 G0 G53 Z0\nG90", Dialect::Fanuc, Doubt::UnknownCode),
    ("centre by A and B", "G68 A1. B2. R30.\nG69", Dialect::Generic, Doubt::UnknownCode),
    (
        "offset that turns, and another that does not",
        "G10 L2 P1 R45\nG10 L2 P2 X0 R0",
        Dialect::LinuxCnc,
        Doubt::TiltedFrame,
    ),
    (
        "scale about an unnamed height",
        "G0 Z7.\nG51 X0 Y0 P500\nG1 Z-1. F300.\nG50\nG0 Z5.",
        Dialect::Fanuc,
        Doubt::ZeroShift,
    ),
    ("modal call by name", "MCALL L10\nG0 Y12\nMCALL", Dialect::Siemens, Doubt::MissingProgram),
    ("another spindle", "SETMS(2)", Dialect::Siemens, Doubt::MissingProgram),
    ("inches but for F", "G70\nG71", Dialect::Siemens, Doubt::Unit),
    (
        "AND beside a comparison",
        "R1=1\nIF R1==1 AND R1<2 GOTOF END1\nG0 Y12\nEND1:",
        Dialect::Siemens,
        Doubt::UnknownValue,
    ),
    ("radius of an offset that stands alone", "D21\nG1 G41 X0. F300.\nG40 X5.", Dialect::Fanuc, Doubt::Compensation),
    ("dwell beside a motion", "G1 X5. G4 P200 F300.", Dialect::Fanuc, Doubt::UnknownCode),
    ("polar about the tool", "G16\nG1 X5 Y10 F300\nG15", Dialect::Grbl, Doubt::UnknownCode),
    ("depths that differ", "CYCLE81(10,0,2,-1,3)", Dialect::Siemens, Doubt::UnknownValue),
    (
        "shift in a turned system",
        "CYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+90\nCYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 Y+2\nCYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+0\nCYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 Y+0",
        Dialect::Heidenhain,
        Doubt::ZeroShift,
    ),
    ("condition without GOTO or THEN", "IF [1 EQ 1] G0 Y12.", Dialect::Fanuc, Doubt::UnknownCode),
    ("origin set", "G10 L2 P1 X5. Y0 Z0", Dialect::Fanuc, Doubt::ZeroShift),
    ("additional offset set, then used", "G10 L20 P1 X5. Y0. Z-3.\nG54.1 P1", Dialect::Fanuc, Doubt::ZeroShift),
    ("the same of a Haas", "G10 L20 P1 X5. Y0. Z-3.\nG154 P1", Dialect::Haas, Doubt::ZeroShift),
    ("external offset by its old variable", "#2700=-3.", Dialect::Fanuc, Doubt::ZeroShift),
    ("origin by its old variable", "#2500=-3.", Dialect::Fanuc, Doubt::ZeroShift),
    ("length in offset memory A", "G43 H1\nG10 P1 R-3.", Dialect::Fanuc, Doubt::ToolLength),
    ("compensation of unknown meaning", "G41 D1 X0. Y10.\nG40 X10. Y10.", Dialect::Fanuc, Doubt::Compensation),
    ("zero where nobody knows", "G28\nG92 X0 Y0 Z0", Dialect::Fanuc, Doubt::ZeroShift),
    ("zero from an unknown height", "G91 G28 Z0\nG90\nG10 L20 P1 Z50.", Dialect::LinuxCnc, Doubt::ZeroShift),
    ("touch plate", "G38.2 Z-10. F50.\nG92 Z1.6\nG0 Z5.", Dialect::Grbl, Doubt::Probe),
    ("touch plate, offset", "G38.2 Z-10. F50.\nG10 L20 P1 Z1.6\nG0 Z5.", Dialect::LinuxCnc, Doubt::Probe),
    ("probed value", "G31 Z-10. F50.\n#101=#5063\nG0 Z5.", Dialect::Fanuc, Doubt::Probe),
    ("missing program", "M98 P7000", Dialect::Fanuc, Doubt::MissingProgram),
    ("part of a program", "M98 P7000 Q20", Dialect::Fanuc, Doubt::MissingProgram),
    ("missing macro", "G65 P9810 Z1.", Dialect::Fanuc, Doubt::MissingProgram),
    ("missing routine", "o<gone> call [1]", Dialect::LinuxCnc, Doubt::MissingProgram),
    ("M code that may be a macro", "M77", Dialect::Fanuc, Doubt::UnknownCode),
    ("something unclamped", "M11", Dialect::Fanuc, Doubt::UnknownCode),
    ("coolant of one builder", "M88", Dialect::Fanuc, Doubt::UnknownCode),
    ("user's M code", "M101", Dialect::LinuxCnc, Doubt::UnknownCode),
    ("an origin of another control", "G15 H2", Dialect::Fanuc, Doubt::UnknownCode),
    ("a shift of another control", "G11 X10. Y5. P30.", Dialect::Fanuc, Doubt::UnknownCode),
    ("stored motions", "G5 P10001 L2", Dialect::Fanuc, Doubt::UnknownCode),
    ("parameters of the control", "G10 L50\nN1221 P1 R5\nG11", Dialect::Fanuc, Doubt::UnknownCode),
    ("a straight motion with a radius", "G1 Z5. R2. F600.", Dialect::Fanuc, Doubt::UnknownCode),
    ("unknown G code", "G200 X5.", Dialect::Fanuc, Doubt::UnknownCode),
    ("text of another dialect", "F10 AC", Dialect::Generic, Doubt::UnknownCode),
    ("a name that says nothing here", "PLANE SPATIAL", Dialect::Fanuc, Doubt::UnknownCode),
    ("a name with words behind it", "N40 HELLO X5.", Dialect::Haas, Doubt::UnknownCode),
    ("a letter without its number", "G", Dialect::Fanuc, Doubt::UnknownCode),
    ("a coordinate without its number", "X", Dialect::LinuxCnc, Doubt::UnknownCode),
    ("signs alone", "$$", Dialect::Fanuc, Doubt::UnknownCode),
    ("variable of the control", "G0 X#500", Dialect::Fanuc, Doubt::UnknownValue),
    ("branch on a variable nobody set", "IF [#105 EQ 1] GOTO 90\nN90", Dialect::LinuxCnc, Doubt::UnknownValue),
    ("variable by its computed number", "#1=450\nG0 X#[#1+50]", Dialect::Fanuc, Doubt::UnknownValue),
    ("speed nobody set", "S#110 M3", Dialect::Fanuc, Doubt::UnknownValue),
    ("an increment nobody set", "G91 G0 Z#500\nG90", Dialect::Fanuc, Doubt::UnknownValue),
    ("computed from an argument nobody passed", "G0 Z[#32-1]", Dialect::Fanuc, Doubt::UnknownValue),
    ("cutting speed for a speed", "G96 S200", Dialect::Fanuc, Doubt::SurfaceSpeed),
    ("rotary axis at its reference point", "G91 G28 Z0 A0\nG90", Dialect::Fanuc, Doubt::RotaryAxis),
];

fn with(event: &str, at: usize) -> String {
    let mut lines: Vec<&str> = BEFORE.into_iter().chain(AFTER).collect();
    lines.insert(at, event);
    lines.join("\n") + "\n"
}

fn read(text: &str, dialect: Dialect, environment: &Environment<'_>) -> Toolpath {
    nc::interpret(&nc::parse(text.as_bytes().to_vec(), Some(dialect)), environment)
}

/// A machine of which the setup gives neither home nor offsets.
fn bare() -> Environment<'static> {
    Environment { home_mm: None, start_mm: None, clear_z_mm: 100.0, ..Environment::default() }
}

/// Feed moves behind a line that may rise.
fn free_behind(path: &Toolpath, line: u32) -> Vec<u32> {
    let behind = path.iter_moves().filter(|(_, motion)| motion.kind == MoveKind::Feed && motion.line > line);
    behind
        .filter(|(id, motion)| motion.freeze.is_none() && path.doubts_at(*id).next().is_none())
        .map(|(_, m)| m.line)
        .collect()
}

#[test]
fn every_event_is_a_doubt_and_said_once() {
    for (name, event, dialect, doubt) in EVENTS {
        let path = read(&with(event, BEFORE.len()), dialect, &bare());
        let first = path.doubts.iter().find(|doubted| doubted.doubt == doubt);
        let first = first.unwrap_or_else(|| panic!("{name}: {:?}", path.doubts));
        assert!(first.line > BEFORE.len() as u32, "{name}");
        assert_eq!(first.until, None, "{name}");
        assert_eq!(free_behind(&path, BEFORE.len() as u32), [0_u32; 0], "{name}");
        let said = path.diagnostics.iter().filter(|d| d.code == "nc::doubt" && d.text.starts_with(doubt.why()));
        let said: Vec<_> = said.collect();
        assert_eq!(said.len(), 1, "{name}: {:?}", path.diagnostics);
        assert!(said[0].help.contains(doubt.name()), "{name}: {}", said[0].help);
    }
    let twice = read(&with("M0\nM0\nM0", BEFORE.len()), Dialect::Fanuc, &bare());
    let said: Vec<_> = twice.diagnostics.iter().filter(|d| d.code == "nc::doubt").collect();
    assert!(said.len() == 1 && said[0].text.contains("3 places"), "{said:?}");
}

#[test]
fn an_event_anywhere_leaves_nothing_behind_it_free() {
    for (name, event, dialect, _) in EVENTS {
        for at in 2..BEFORE.len() + AFTER.len() - 2 {
            let path = read(&with(event, at), dialect, &bare());
            let last = at as u32 + event.lines().count() as u32;
            // A zero set at the head, before any motion, is as unknown as later; a second offset is one only once another was used.
            let single =
                matches!(name, "offset without origin" | "additional offset" | "additional offset in short") && at <= 5;
            if !single {
                assert_eq!(free_behind(&path, last), [0_u32; 0], "{name} at line {}", at + 1);
            }
        }
    }
}

/// Radii that only the control knows, contours that it would refuse, and steps from an unknown place, in programs of their own.
#[test]
fn where_the_tool_is_beside_a_contour_or_begins_is_known_or_in_doubt() {
    let control = Environment {
        compensation: Some(feedwright::machine::Compensation::Control),
        diameters_mm: vec![(1, 10.0)],
        ..bare()
    };
    let contour = |head: &str, d: &str| {
        format!(
            "%\nO1\nG21 G90 G17\n{head}T1 M6\nS8000 M3\nG0 X-20. Y-20. Z-2.\nG1 G42 {d} X0. Y0. F600.\nX40.\nG40 X60. Y-20.\n\
             G42 D1 X40. Y0.\nX0.\nG40 X-20. Y-20.\nM30\n%\n"
        )
    };
    let doubts = |text: &str, dialect| -> Vec<Doubt> {
        read(text, dialect, &control).doubts.iter().map(|doubted| doubted.doubt).collect()
    };
    assert_eq!(doubts(&contour("", "D1"), Dialect::Fanuc), []);
    // Another radius than that of the first pass, or it would be the same number.
    assert_eq!(doubts(&contour("", "D11").replace("D1 ", "D12 "), Dialect::Fanuc), [Doubt::Compensation]);
    assert_eq!(doubts(&contour("", "D11").replace("D1 ", "D11 "), Dialect::Fanuc), []);
    assert_eq!(doubts(&contour("G10 L12 P1 R5.5\n", "D1"), Dialect::Fanuc), [Doubt::Compensation]);
    assert_eq!(doubts(&contour("G10 L12 P1 R5.\n", "D1"), Dialect::Fanuc), []);
    // The tool's own offset and another; one that the program gives the radius of the tool.
    assert_eq!(doubts(&contour("", "D51"), Dialect::Fanuc), [Doubt::Compensation]);
    assert_eq!(doubts(&contour("G10 L12 P51 R5.\n", "D51").replace("D1 ", "D51 "), Dialect::Fanuc), []);
    // Where the path is that of the tool, any radius moves it.
    let wear = Environment { compensation: Some(feedwright::machine::Compensation::Wear), ..control.clone() };
    let of_wear = |radius: &str| {
        let path = read(&contour(&format!("G10 L12 P1 R{radius}\n"), "D1"), Dialect::Fanuc, &wear);
        path.doubts.iter().map(|doubted| doubted.doubt).collect::<Vec<_>>()
    };
    assert_eq!([of_wear("0."), of_wear("5.")], [vec![], vec![Doubt::Compensation]]);
    assert_eq!(doubts(&contour("G10 L1 P1 R6.5\n", "D1"), Dialect::LinuxCnc), [Doubt::Compensation]);
    // An arc inside of which the tool has no room.
    let refused = contour("", "D1").replace("G42 D1 X40. Y0.\n", "G42 D1 X40. Y0.\nG2 X36. Y-4. I-4.\n");
    assert!(doubts(&refused, Dialect::Fanuc).contains(&Doubt::Compensation));
    let steps = "%\nO1\nG21 G91 G17\nT1 M6\nS8000 M3\nG0 X-10. Y20. Z5.\nG0 Z-9.\nG1 X30. F900.\nM30\n%\n";
    assert_eq!(doubts(steps, Dialect::Fanuc), [Doubt::ZeroShift]);
    let from = |start_mm| read(steps, Dialect::Fanuc, &Environment { start_mm, ..bare() }).doubts.len();
    assert_eq!([from(None), from(Some(Vec3::zeros()))], [1, 0]);
    for head in ["G91 G28 Z0\nG90", "G91 G0 Z50.\nG90"] {
        assert_eq!(doubts(&steps.replace("G91 G17", head), Dialect::Fanuc), [], "{head}");
    }
    let at_rest = steps.replace("G0 X-10. Y20. Z5.", "G0 X0. Y0. Z0.\nX-10. Y20. Z5.");
    assert_eq!(doubts(&at_rest, Dialect::Fanuc), [Doubt::ZeroShift]);
}

/// A jump to a block of steps makes all of them, so such a block is not cut in pieces where something could jump to it.
#[test]
fn a_block_of_steps_that_can_be_jumped_to_stays_whole() {
    let whole = |block: &str, dialect| {
        let text = format!("G21 G90\nG0 X0 Y0 Z0\n{block} F600\nM30\n");
        let path = read(&text, dialect, &Environment { start_mm: Some(Vec3::zeros()), ..bare() });
        !path.moves.iter().find(|motion| motion.kind == MoveKind::Feed).unwrap().splittable
    };
    assert!(whole("N10 G91 G1 X80", Dialect::Fanuc) && whole("N10 G1 X=IC(80)", Dialect::Siemens));
    assert!(!whole("N10 G1 X80", Dialect::Fanuc) && !whole("G91 G1 X80", Dialect::Fanuc));
    assert!(!whole("N10 G91 G1 X80", Dialect::LinuxCnc));
    // The length comes in with the first piece.
    assert!(whole("G43 H1 G1 X80", Dialect::Fanuc));
}

#[test]
fn what_is_known_is_no_doubt() {
    let origins = vec![(54, Vec3::new(0.0, 0.0, 0.0)), (55, Vec3::new(80.0, 0.0, 0.0))];
    let known = Environment { origins, ..bare() };
    for (name, event) in [
        ("optional stop", "M1"),
        ("local shift", "G52 X5."),
        ("zero of a place that is known", "G92 X-8."),
        ("end of the zero", "G92.1"),
        ("offset whose origin is given", "G55"),
        ("the same origin", "G10 L2 P1 X0.004 Y0 Z0"),
        ("offset elsewhere", "G10 L2 P6 X9."),
        ("rotary axis at rest", "G0 A0."),
        ("rotary axis there and back", "G0 A90.\nG0 A0."),
        ("rotary axis at its reference point and at 0", "G28 C0\nG90 G0 C0."),
        ("reading ahead", "G5 P10000\nG5 P0\nG5.1 Q1\nG5.1 Q0"),
        ("the radius of a tool that nothing describes", "G10 L12 P31 R5."),
        ("tool centre point without a cut", "G43.4 H1\nG0 X0.\nG49"),
        ("probe that sets nothing", "G31 Z-10. F50.\nG0 Z5."),
        ("coolant, gears", "M8\nM9\nM41"),
        ("variable that is set", "#500=5.\nG0 X#500"),
        ("variable in a feed", "G1 F#500\nG1 F600."),
        ("a print", "POPEN\nDPRNT[X#500[33]]\nPCLOS"),
        ("vacant argument asked for", "IF [#7 EQ #0] THEN #100=1"),
    ] {
        let path = read(&with(event, BEFORE.len()), Dialect::Fanuc, &known);
        let second: Vec<_> = path.iter_moves().filter(|(_, m)| m.line > BEFORE.len() as u32 + 4).collect();
        assert!(!second.is_empty(), "{name}");
        assert!(second.iter().all(|(id, _)| path.doubts_at(*id).next().is_none()), "{name}: {:?}", path.doubts);
    }
    for (name, event, doubt) in [
        ("another origin", "G10 L2 P1 X0.006 Y0 Z0", Doubt::ZeroShift),
        ("an origin nobody gave", "G56", Doubt::WorkOffset),
        ("an origin set by the program, then used", "G10 L2 P6 X9.\nG59", Doubt::ZeroShift),
    ] {
        let path = read(&with(event, BEFORE.len()), Dialect::Fanuc, &known);
        assert!(path.doubts.iter().any(|doubted| doubted.doubt == doubt), "{name}: {:?}", path.doubts);
    }
}

/// A spindle that turns backwards, or at a cutting speed, is in doubt while it does so and no longer: where the part is was never open.
#[test]
fn what_the_spindle_does_is_in_doubt_until_it_is_known() {
    for (name, from, until, doubt) in [
        ("M4 and M3", "S8000 M4", "M3", Doubt::Reversed),
        ("M4 and M5", "S8000 M4", "M5", Doubt::Reversed),
        ("M4 and another tool", "S8000 M4", "T2 M6", Doubt::Reversed),
        ("M14 and M13", "S8000 M14", "M13", Doubt::Reversed),
        ("M14 and M19", "S8000 M14", "M19", Doubt::Reversed),
        ("cutting speed and speed", "G96 S200 M3", "G97 S8000", Doubt::SurfaceSpeed),
    ] {
        let text = format!("G21 G90 G17\nT1 M6\n{from}\nG0 X0. Y0. Z5.\nG1 Z-2. F300.\n{until}\nX20.\nM30\n");
        let path = read(&text, Dialect::Fanuc, &bare());
        let [doubted] = path.doubts.as_slice() else { panic!("{name}: {:?}", path.doubts) };
        assert_eq!((doubted.doubt, doubted.line), (doubt, 3), "{name}");
        let in_doubt =
            |line: u32| path.iter_moves().any(|(id, m)| m.line == line && path.doubts_at(id).next().is_some());
        assert!(in_doubt(5) && !in_doubt(7), "{name}: {:?}", path.doubts);
    }
    // Tapping cycles turn the spindle themselves.
    let tapped =
        read("G21 G90\nT1 M6\nS500 M3\nG84 X5. Y5. Z-9. R2. F625.\nG80\nG1 X9. F99.\nM30\n", Dialect::Fanuc, &bare());
    assert!(tapped.doubts.is_empty(), "{:?}", tapped.doubts);
}

/// What starts the spindle and what lets it stand. A spindle that stands in a cut forbids every rise.
#[test]
fn a_spindle_stands_after_it_was_oriented() {
    let turns = |dialect: Dialect, event: &str| {
        let text = format!("G21 G90 G17\nT1 M6\n{event}\nG0 X0 Y0 Z5\nG1 Z-2 F300\nM30\n");
        let path = read(&text, dialect, &bare());
        let last = path.moves.last().unwrap().spin;
        last.rps * if last.reverse { -1.0 } else { 1.0 }
    };
    for (dialect, event, rps) in [
        (Dialect::Fanuc, "S600 M13", 10.0),
        (Dialect::Fanuc, "S600 M14", -10.0),
        (Dialect::Haas, "S600 M13", 0.0),
        (Dialect::Fanuc, "S600 M3\nM19", 0.0),
        (Dialect::LinuxCnc, "S600 M3\nM19 R90", 0.0),
        (Dialect::LinuxCnc, "S600 M3\nM70", 10.0),
        (Dialect::Fanuc, "S600 M3\nM19\nM3", 10.0),
        (Dialect::Siemens, "S600 M3\nSPOS=90", 0.0),
        (Dialect::Siemens, "S600 M3\nSPOSA=DC(90)", 0.0),
        (Dialect::Siemens, "S600 M3\nM70", 0.0),
    ] {
        assert_eq!(turns(dialect, event), rps, "{dialect:?} {event}");
    }
    let text =
        "0 BEGIN PGM P MM\n1 TOOL CALL 1 Z S600\n2 L X+0 Y+0 Z+5 FMAX M13\n3 L Z-2 F300\n4 L X+5 M14\n5 END PGM P MM\n";
    let path = read(text, Dialect::Heidenhain, &bare());
    assert_eq!(path.moves[1].spin.rps, 10.0);
    assert!(path.doubts.iter().any(|of| of.doubt == Doubt::Reversed));
}

/// After a probing move, or one to a place of the control's own, nothing rises until the axes are commanded to absolute positions.
#[test]
fn a_move_from_where_only_the_control_knows_does_not_rise() {
    for (name, event, dialect) in [
        ("touched somewhere", "G31 Z-6. F50.", Dialect::Fanuc),
        ("touched somewhere", "G38.2 Z-6. F50.\nG1 F600.", Dialect::LinuxCnc),
        ("reference point", "G91 G28 Z0\nG90", Dialect::Fanuc),
        ("machine coordinates", "G53 G0 Z-100.\nG1", Dialect::Haas),
        ("homed", "$H", Dialect::Grbl),
        ("jogged", "$J=G91 Z-1 F100", Dialect::Grbl),
    ] {
        let text = format!(
            "G21 G90 G17\nT1 M6\nS8000 M3\nG0 X0. Y0. Z5.\nG1 Z-2. F300.\n{event}\nG1 X20. F600.\nG0 X0. Y9. Z5.\nG1 X20.\nM30\n"
        );
        let path = read(&text, dialect, &bare());
        let line = 6 + event.lines().count() as u32;
        let placed = |line: u32| path.iter_moves().filter(move |(_, m)| m.line == line).all(|(_, m)| m.placed);
        assert!(!placed(line) && placed(line + 2), "{name}: {:?}", path.moves);
        assert!(placed(5), "{name}");
    }
    for command in ["$X", "$10=3"] {
        let text = format!("G21 G90\nG0 X0 Y0 Z5.\nG1 X5. F300.\n{command}\nX9.\nM30\n");
        let path = read(&text, Dialect::Grbl, &bare());
        let moves = path.moves.iter().filter(|motion| motion.kind == MoveKind::Feed);
        assert_eq!(moves.filter(|motion| motion.placed).count(), 2, "{command}");
    }
}

/// Where the tool stands before an axis is commanded for the first time nobody knows, unless the setup says.
#[test]
fn a_feed_move_from_a_start_that_nobody_gave_is_not_placed() {
    let text = "G21 G90\nT1 M6\nS8000 M3\nG1 X50. Y40. F1000.\nG1 X20.\nG1 Z-5. F500.\nG1 X60.\nM30\n";
    let placed = |environment: &Environment| -> Vec<bool> {
        read(text, Dialect::Fanuc, environment).moves.iter().map(|motion| motion.placed).collect()
    };
    assert_eq!(placed(&bare()), [false, false, false, true]);
    assert_eq!(placed(&Environment { start_mm: Some(Vec3::new(0.0, 0.0, 200.0)), ..bare() }), [true; 4]);
}

/// The first length offset of a tool is taken for the one that the setup describes; another one moves its tip.
#[test]
fn another_length_of_the_same_tool_is_a_doubt() {
    let doubted = |dialect: Dialect, first: &str, between: &str| {
        let text = format!(
            "G21 G90 G17\nT1 M6\nS8000 M3\n{first}G0 X0. Y0. Z5.\nG1 Z-2. F300.\nX20.\n{between}\nG0 X0.\nG1 X20.\nM30\n"
        );
        let path = read(&text, dialect, &bare());
        path.doubts.iter().any(|of| of.doubt == Doubt::ToolLength)
    };
    let fanuc = |between: &str| doubted(Dialect::Fanuc, "G43 H1\n", between);
    for other in ["G43 H2", "H2", "H0", "G49", "G44 H1", "G10 L10 P1 R-1.", "G10 L11 P1 R-1.", "#2001=5.", "#11001=5."]
    {
        assert!(fanuc(other), "{other}");
    }
    for other in [
        "G10 L10 P1 R98.\nG43 H1",
        "G49\nG91 G10 L11 P1 R-2.\nG90 G43 H1",
        "#2001=98.\nG43 H1",
        "#2201=98.\nG43 H1",
        "#11001=0.1\nG43 H1",
        "T2 M6\nS8000 M3\nG10 L10 P1 R98.\nG43 H2\nT1 M6\nS8000 M3\nG43 H1",
    ] {
        assert!(fanuc(other), "{other}");
    }
    for same in [
        "G43 H1",
        "H1",
        "G43",
        "G49\nG43 H1",
        "G10 L10 P2 R-1.",
        "G10 L10 P2 R-1.\nG43 H1",
        "T2 M6\nS8000 M3\nG43 H2",
        "T2 M6\nS8000 M3\nG10 L10 P2 R98.\nG43 H2",
        "#2002=98.\n#2202=98.\n#11002=0.1\nG43 H1",
        "G49\nM30",
        "G43 H2\nG43 H1",
    ] {
        assert!(!fanuc(same), "{same}");
    }
    assert!(!doubted(Dialect::Fanuc, "", "G49"), "no offset was ever in force");
    // After another tool its length stays in force, until the next one has its own.
    for other in ["T8 M6\nS8000 M3", "T8 M6\nS8000 M3\nG43 H1", "T8 M6\nS8000 M3\nG43 H0", "T8 M6\nT1 M6\nG1 X5."] {
        assert!(fanuc(other), "{other}");
    }
    for same in ["T8 M6\nS8000 M3\nG43 H8", "T8 M6\nS8000 M3\nG43", "T1 M6\nS8000 M3", "T8 M6\nT1 M6\nG43 H1"] {
        assert!(!fanuc(same), "{same}");
    }
    assert!(!doubted(Dialect::Fanuc, "", "T8 M6\nS8000 M3"), "no tool has a length by its number");
    for other in ["G43.1 Z-3.", "G43.2 H3", "G10 L1 P1 Z5."] {
        assert!(doubted(Dialect::LinuxCnc, "G43 H1\n", other), "{other}");
    }
    for other in ["D2", "D0", "TOFFL=3", "DL=2"] {
        assert!(doubted(Dialect::Siemens, "D1\n", other), "{other}");
    }
    assert!(doubted(Dialect::Siemens, "", "D2"), "the first edge came in with the tool");
    assert!(doubted(Dialect::Siemens, "", "D0") && !doubted(Dialect::Siemens, "", "D1"));
}

/// A G0 without coordinates in the first line goes nowhere: the offset chosen before the first motion is the only one.
#[test]
fn a_bare_motion_code_uses_no_work_offset() {
    let doubted = |head: &str| {
        let text = format!("{head}\nT1 M6\nS8000 M3\nG55\nG43 H1\nG0 X0. Y0. Z5.\nG1 Z-2. F300.\nX20.\nM30\n");
        read(&text, Dialect::Fanuc, &bare()).doubts.iter().any(|of| of.doubt == Doubt::WorkOffset)
    };
    assert!(!doubted("G21 G0 G17 G40 G80 G90") && !doubted("G21 G90"));
    assert!(doubted("G21 G90 G0 X0."), "with a coordinate G54 is in use");
}

/// G58 and G59 of a Siemens shift the frame by axis; alone, or with a motion, they are taken for what an 808D has: work offsets.
#[test]
fn a_shift_by_g58_of_a_siemens_is_not_followed() {
    let path = |line: &str| {
        let text =
            format!("G71 G90\nT1 M6\nS8000 M3\nG0 X0 Y0 Z5\nG1 Z-2 F300\nX20\n{line}\nX0 F500\nTRANS\nX20\nM30\n");
        read(&text, Dialect::Siemens, &bare())
    };
    for shift in ["G58 Z-2", "G59 X5 Y5"] {
        let path = path(shift);
        assert_eq!(path.doubts.iter().map(|of| of.doubt).collect::<Vec<_>>(), [Doubt::TiltedFrame], "{shift}");
        assert_eq!(path.moves.len(), 5, "the words are no motion: {:?}", path.moves);
    }
    assert_eq!(path("G58").doubts.iter().map(|of| of.doubt).collect::<Vec<_>>(), [Doubt::WorkOffset]);
}

/// What a Siemens program sets without having defined it.
#[test]
fn names_that_a_siemens_program_did_not_define_are_the_controls() {
    let doubts = |event: &str| {
        let text =
            format!("G71 G90 G17\nT1 M6\nS8000 M3\nG0 X0 Y0 Z5\nG1 Z-2 F300\nX20\n{event}\nG0 X0\nG1 X20\nM30\n");
        let path = read(&text, Dialect::Siemens, &bare());
        let probing = path.moves.iter().any(|motion| motion.freeze == Some(Freeze::Probe));
        (path.doubts.iter().map(|of| of.doubt).collect::<Vec<_>>(), probing)
    };
    for (event, doubt) in [
        ("G1 MEAS=1 X-5 F100", Doubt::Probe),
        ("MEAW=1 G1 X-5 F100", Doubt::Probe),
        ("G0 C1=90", Doubt::RotaryAxis),
        ("G0 Z1=-10", Doubt::UnknownCode),
        ("OVR=50", Doubt::UnknownCode),
        ("TCARR=1", Doubt::ToolLength),
        ("FGROUP(X,Y)", Doubt::UnknownCode),
        ("G1 AP=30 RP=20", Doubt::UnknownCode),
        ("G1 X30 ANG=20", Doubt::UnknownCode),
    ] {
        let (found, probing) = doubts(event);
        assert!(found.contains(&doubt), "{event}: {found:?}");
        assert_eq!(probing, doubt == Doubt::Probe, "{event}");
    }
    for event in [
        "FGROUP()",
        "FGROUP(X,Y,Z,A)",
        "R5=3",
        "DEF REAL DEEP\nDEEP=5",
        "_ZSD=1",
        "SPOS=90",
        "ADIS=0.5",
        "S2=500",
        "CTOL=0.01",
    ] {
        assert_eq!(doubts(event).0, [], "{event}");
    }
}

/// Two slots side by side with a stop between: with the stop the second is as wide as the part may stand, and nothing of it rises.
#[test]
fn the_second_of_two_slots_behind_a_stop_keeps_its_feed() {
    let setup = slot::SETUP.replace("linuxcnc", "fanuc") + "feed_change = { max = 2.0 }\nforce_xy = 350\n";
    let program = |between: &str| {
        format!(
            "%\nO1\nG21 G90 G17\nT1 M6\nS8000 M3\nG0 X-8. Y8. Z5.\nG1 Z-2. F300.\nG1 X48. F600.\nG0 Z5.\n{between}\nS8000 M3\n\
             G0 X-8. Y10.\nG1 Z-2. F300.\nG1 X48. F600.\nG0 Z5.\nM30\n%\n"
        )
    };
    let second = |between: &str| {
        let dir = slot::bench(&program(between), &setup);
        slot::optimized(dir.path(), &[]);
        highest(dir.path())[&14]
    };
    assert!(second("(NOTHING)") > 1000.0, "2 mm of a slot that is there already bear more: {}", second("(NOTHING)"));
    assert!(second("M0") < 600.5, "behind a stop it may be a whole slot: {}", second("M0"));
}

/// Plain language of Heidenhain: a cut, an event, the same cut again.
#[test]
fn what_plain_language_leaves_open_is_a_doubt() {
    let read = |event: &str| {
        let text = format!(
            "0 BEGIN PGM P MM\n1 TOOL CALL 1 Z S3000\n2 L X+0 Y+0 Z+5 FMAX M3\n3 L Z-2 F300\n4 L X+50 F600\n{event}\n9 L X+0\n\
             10 END PGM P MM\n"
        );
        read(&text, Dialect::Heidenhain, &bare()).doubts
    };
    for (name, event) in [
        ("a word nobody knows", "5 FN 99: D1"),
        ("a value written into the control", "5 FN 17: SYSWRITE ID 210 NR4 IDX3 = +Q1"),
        ("the datum", "5 FN 25: PRESET = X/+Q5/+0"),
        ("half a cycle", "5 CYCL DEF 19.0 WORKING PLANE"),
        ("half a cycle, another after it", "5 CYCL DEF 7.0 DATUM SHIFT\n6 CYCL DEF 8.1 X"),
    ] {
        let doubts = read(event);
        assert!(doubts.iter().any(|d| d.doubt == Doubt::UnknownCode && d.line == 6), "{name}: {doubts:?}");
    }
    for (name, event, doubt) in [
        ("a line of a datum table", "5 CYCL DEF 7.0 DATUM SHIFT\n6 CYCL DEF 7.1 #5", Doubt::ZeroShift),
        ("a preset after a cut", "5 CYCL DEF 247 DATUM SETTING ~\nQ339=+1", Doubt::WorkOffset),
        ("the same in one line", "5 CYCL DEF 247 DATUM SETTING Q339=+1", Doubt::WorkOffset),
        (
            "a program as a cycle",
            "5 CYCL DEF 12.0 PGM CALL\n6 CYCL DEF 12.1 LOT31\n7 L X+40 M99",
            Doubt::MissingProgram,
        ),
    ] {
        let doubts = read(event);
        assert!(doubts.iter().any(|d| d.doubt == doubt), "{name}: {doubts:?}");
    }
    for (name, event) in [
        ("a sum", "5 FN 1: Q5 = +3 + +4"),
        ("a value read", "5 FN 18: SYSREAD Q25 = ID210 NR4 IDX3"),
        ("a cell of a table", "5 FN 28: TABREAD Q10 = +2/\"X\""),
        ("a print", "5 FN 16: F-PRINT A.A / B.TXT"),
        ("a whole cycle", "5 CYCL DEF 19.0 WORKING PLANE\n6 CYCL DEF 19.1 A+0 B+0 C+0"),
        ("a whole cycle about a comment", "5 CYCL DEF 7.0 DATUM SHIFT\n; in X\n6 CYCL DEF 7.1 X+0"),
    ] {
        let doubts = read(event);
        assert!(doubts.is_empty(), "{name}: {doubts:?}");
    }
}

#[test]
fn a_block_that_cannot_be_read_sets_nothing() {
    for block in
        ["F10 XY", "F30 Z", "G0 X1. X2. F10", "G91 X5. U3. F10", "G1 F10 X[1+2", "G200 G91 G0 X5. F10", "F10 X[1/0]"]
    {
        let path =
            read(&format!("G90 G1 X1. F100.\n{block}\nX7. Y3.\nM30\n"), Dialect::Generic, &Environment::default());
        let [_, last] = path.moves.as_slice() else { panic!("{block}: {:?}", path.moves) };
        assert_eq!(last.kind, MoveKind::Feed, "{block}");
        assert_eq!(last.curve().to(), Vec3::new(7.0, 3.0, 0.0), "{block}");
        assert_eq!((last.feed.mm_s * 60.0).round(), 100.0, "{block}");
        assert!(!last.splittable, "{block}: where it begins is not known");
        assert_eq!(path.doubts[0].doubt, Doubt::UnknownCode, "{block}");
    }
    let path = read("G1 X1. F100.\nM98 P7000\nX2.\nX3. F200.\nM30\n", Dialect::Fanuc, &Environment::default());
    assert!(path.moves[1].freeze.is_some(), "the feed after a missing program is not known");
    assert_eq!(path.moves[2].freeze, None);
}

#[test]
fn feeds_that_belong_to_a_pitch_are_kept() {
    let hole = "G0 X5. Y5. Z2.\n";
    for (name, text, dialect) in [
        ("G63 as a mode", "S500 M3\nG63\nG1 Z-10. F600.\nM4\nG1 Z2.\nG64\n", Dialect::Fanuc),
        ("G63 with its motion", "S500 M3\nG63 Z-10. F600\nG63 Z2. M4\n", Dialect::Siemens),
        ("G32", "S500 M3\nG32 Z-10. F1.25\nG32 Z2.\n", Dialect::Fanuc),
        ("rigid tapping", "S500 M3\nG84.2 Z-10. R2. F625.\nG80\n", Dialect::Fanuc),
        ("left-hand rigid tapping", "S500 M4\nG84.3 Z-10. R2. F625.\nG80\n", Dialect::Fanuc),
        ("spindle reversed at the bottom", "S500 M3\nG1 Z-10. F611.\nM4\nZ2.\n", Dialect::Fanuc),
        ("F = P S, self-reversing head", "S500 M3\nG1 Z-10. F625.\nZ2.\n", Dialect::Fanuc),
        ("F = P S in threads per inch", "S500 M3\nG1 Z-10. F635.\nZ2.\n", Dialect::Fanuc),
        ("tap by its comment", "(T2 M8 TAP)\nT2 M6\nS500 M3\nG1 Z-10. F611.\nG0 Z2.\n", Dialect::Fanuc),
        (
            "thread mill",
            "T3 M6 (THREAD MILL M20X1.5)\nS500 M3\nG1 Z-10. F611.\nG3 X5. Y5. Z-8.5 I2. J0 F200.\nG0 Z2.\n",
            Dialect::Fanuc,
        ),
    ] {
        let path = read(&format!("G21 G90\n{hole}{text}M30\n"), dialect, &Environment::default());
        let feeds: Vec<_> = path.moves.iter().filter(|m| m.kind == MoveKind::Feed).collect();
        assert!(feeds.len() > usize::from(!name.contains("comment")), "{name}");
        assert!(feeds.iter().all(|m| m.freeze == Some(Freeze::Synchronised)), "{name}: {feeds:?}");
    }
    for (name, text) in [
        ("G63 has ended", "S500 M3\nG63\nG64\nG1 Z-10. F611.\n"),
        ("drilling by hand, feed per turn no pitch", "S500 M3\nG1 Z-10. F611.\nZ2.\n"),
        ("just off the pitch", "S500 M3\nG1 Z-10. F627.\nZ2.\n"),
        ("up first", "S500 M3\nG1 Z10. F625.\nZ2.\n"),
        ("not straight", "S500 M3\nG1 X6. Z-10. F625.\nX5. Z2.\n"),
        ("a taper is no tap", "(T2 TAPER MILL)\nT2 M6\nS500 M3\nG1 Z-10. F611.\n"),
    ] {
        let path = read(&format!("G21 G90\n{hole}{text}M30\n"), Dialect::Fanuc, &Environment::default());
        assert!(path.moves.iter().all(|m| m.freeze.is_none()), "{name}: {:?}", path.moves);
    }
}

#[test]
fn after_g80_group_one_is_in_force_again() {
    for dialect in [Dialect::Fanuc, Dialect::Haas, Dialect::Generic] {
        let text = "G90 G0 X0 Y0 Z10.\nG98 G81 X5. Z-5. R2. F100.\nG80\nZ15.\nG81 X8. Z-5. R2.\nG80 X9. Y2.\nG0 X50. Y30.\nM30\n";
        let path = read(text, dialect, &Environment::default());
        let ends = |line: u32| path.moves.iter().filter(move |m| m.line == line).map(|m| (m.kind, m.curve().to()));
        assert_eq!(ends(4).collect::<Vec<_>>(), [(MoveKind::Rapid, Vec3::new(5.0, 0.0, 15.0))]);
        assert_eq!(ends(6).collect::<Vec<_>>(), [(MoveKind::Rapid, Vec3::new(9.0, 2.0, 15.0))]);
        assert!(path.diagnostics.is_empty(), "{:?}", path.diagnostics);
    }
}

/// A cut in a loop or a routine that the control may run again, deeper: what decides it, the dialect. The first cut comes before that in the order
/// of execution, and keeps its feed all the same.
const AGAIN: [(&str, &str, Dialect); 44] = [
    ("jump back", "N7 CUT\nIF[#1 LT #500]GOTO7", Dialect::Fanuc),
    ("computed target", "N7 CUT\nGOTO#500", Dialect::Fanuc),
    ("a number taken over", "N7 CUT\n#2=#500\nIF[#1 LT #2]GOTO7", Dialect::Fanuc),
    ("through a later jump", "N7 CUT\nIF[#500 EQ 1]GOTO9\nGOTO20\nN9 GOTO7\nN20", Dialect::Fanuc),
    ("WHILE", "#3=0\nWHILE[#3 LT 1]DO1\nCUT\nIF[#500 EQ 1]THEN #3=-5\n#3=#3+1\nEND1", Dialect::Fanuc),
    ("M99 P", "#1=0\nN7 #1=#1+1\nIF[#1 GT 2]GOTO9\nCUT\nM99 P7\nN9", Dialect::Fanuc),
    ("routine of any number", "M98 P82\nM98 P#500\nM30\nO82\nCUT\nM99", Dialect::Fanuc),
    ("macro of any number", "M98 P82\nG65 P#500\nM30\nO82\nCUT\nM99", Dialect::Haas),
    ("do while", "o1 do\nCUT\no1 while [#1 LT #<_passes>]", Dialect::LinuxCnc),
    ("routine by a variable", "o5 sub\nCUT\no5 endsub\no5 call\no#50 call", Dialect::LinuxCnc),
    ("GOTOB", "AA: CUT\nIF R1<R50 GOTOB AA", Dialect::Siemens),
    ("GOTOC", "AA: CUT\nGOTOC \"A\"<<R50", Dialect::Siemens),
    ("CASE", "AA: CUT\nCASE R50 OF 1 GOTOB AA DEFAULT GOTOF BB\nBB: G0 Z5", Dialect::Siemens),
    ("REPEAT", "AA: CUT\nXX: R1=R1+1\nREPEAT AA XX P=R50", Dialect::Siemens),
    ("CALL BLOCK", "AA: CUT\nXX: R1=R1+1\nCALL BLOCK AA TO XX", Dialect::Siemens),
    ("UNTIL", "REPEAT\nCUT\nUNTIL R1>R50", Dialect::Siemens),
    ("a routine in a branch", "M98 P100\nIF[#500 NE 1]GOTO20\nM98 P100\nN20\nM30\nO100\nCUT\nM99", Dialect::Fanuc),
    ("a routine so many times", "M98 P100\nM98 P100 L#500\nM30\nO100\nCUT\nM99", Dialect::Fanuc),
    ("a macro so many times", "G65 P100 Z1.\nG65 P100 L#500 Z11.\nM30\nO100\nCUT\nM99", Dialect::Fanuc),
    (
        "a macro after motions in a branch",
        "M98 P100\nIF[#500 NE 1]GOTO20\nG66 P100\nN20\nM30\nO100\nCUT\nM99",
        Dialect::Fanuc,
    ),
    ("a local routine", "M97 P100\nIF[#500 NE 1]GOTO20\nM97 P100\nN20\nM30\nN100 CUT\nM99", Dialect::Haas),
    ("a routine in IF", "o5 sub\nCUT\no5 endsub\no5 call\no3 if [#5399 EQ 1]\no5 call\no3 endif", Dialect::LinuxCnc),
    (
        "a routine in repeat",
        "o5 sub\nCUT\no5 endsub\no5 call\no3 repeat [#5399]\no5 call\no3 endrepeat",
        Dialect::LinuxCnc,
    ),
    (
        "a routine by a name without a value",
        "o5 sub\nCUT\no5 endsub\no5 call\no3 if [#<_deep> GT 0]\no5 call\no3 endif",
        Dialect::LinuxCnc,
    ),
    ("a section so many times", "SA: CUT\nSE: G0 Z5\nSX: G0 X0\nREPEAT SA SE P=R50", Dialect::Siemens),
    ("a section in IF", "SA: CUT\nSE: G0 Z5\nIF R50==1\nREPEAT SA SE\nENDIF", Dialect::Siemens),
    ("ways chained", "#1=0\nN10 CUT\nN20 #1=#1+1\nIF[#1 EQ 2]GOTO10\nIF[#500 EQ 1]GOTO20", Dialect::Fanuc),
    ("out and back", "N10 CUT\nGOTO30\nN20 IF[#500 EQ 1]GOTO40\nGOTO50\nN30 GOTO20\nN40 GOTO10\nN50", Dialect::Fanuc),
    ("a return to a block", "N10 CUT\nM98 P200\nM30\nO200\nIF[#500 NE 1]GOTO5\nM99 P10\nN5 M99", Dialect::Fanuc),
    ("a return to a computed block", "N10 CUT\nM98 P200\nM30\nO200\nM99 P#500", Dialect::Fanuc),
    ("as far as a probe went", "N10 CUT\nG31 Z-10. F100\nIF[#5043 GT -5]GOTO10", Dialect::Fanuc),
    ("as far as a probe of LinuxCNC went", "o1 do\nCUT\nG38.3 Z-10 F100\no1 while [#<_z> GT -5]", Dialect::LinuxCnc),
    ("GOTOB to a computed label", "AA: CUT\nGOTOB \"A\"<<R50", Dialect::Siemens),
    (
        "a routine of a routine",
        "M98 P200\nIF[#500 NE 1]GOTO50\nM98 P100\nN50 M30\nO100\nM98 P200\nM99\nO200\nCUT\nM99",
        Dialect::Fanuc,
    ),
    ("a return by a routine", "N10 CUT\nIF[#500 NE 1]GOTO50\nM98 P100\nN50 M30\nO100\nM99 P10", Dialect::Fanuc),
    ("fallen into", "GOTO20\nN10 IF[#501 NE 1]GOTO99\nN20 CUT\nGOTO10\nN99", Dialect::Fanuc),
    ("a jump by an input", "N10 CUT\nM96 P10 Q8", Dialect::Haas),
    ("a jump of macro A", "N10 CUT\nG65 H81 P10 Q#500 R1", Dialect::Fanuc),
    ("a macro in force", "G66 P100\nG0 X5.\nIF[#500 NE 1]GOTO20\nG0 X9.\nN20 G67\nM30\nO100\nCUT\nM99", Dialect::Fanuc),
    ("in capital letters", "o1 do\nCUT\nG38.3 Z-10 F100\no1 while [# < _Z > GT -5]", Dialect::LinuxCnc),
    ("by a computed number", "N10 CUT\n#1=3\nG31 Z-10. F100\nIF[#[5040+#1] GT -5]GOTO10", Dialect::Fanuc),
    (
        "a return with a label",
        "LAB1: CUT\nL100\nM30\n%_N_L100_SPF\nIF R50==1\nRET(\"LAB1\")\nENDIF\nM17",
        Dialect::Siemens,
    ),
    ("a text compared", "LAB1: CUT\nIF GUDS==\"X\" GOTOB LAB1", Dialect::Siemens),
    ("LOOP", "LOOP\nCUT\nIF R50==0 GOTOF BB\nENDLOOP\nBB: G0 Z5", Dialect::Siemens),
];

#[test]
fn what_may_run_again_is_in_doubt_from_its_first_run_on() {
    for (name, body, dialect) in AGAIN {
        let text = |body: &str| format!("G21 G90 G17\nT1 M6\nS8000 M3\nG0 X0 Y10 Z5\n{body}\nG0 Z50\nM30\n");
        let path = read(&text(&body.replace("CUT", "G1 X48 F600")), dialect, &bare());
        let cut = path.iter_moves().find(|(_, motion)| motion.kind == MoveKind::Feed).map(|(id, _)| id);
        let cut = cut.unwrap_or_else(|| panic!("{name}: no cut"));
        assert!(path.doubts_at(cut).next().is_some(), "{name}: {:?}", path.diagnostics);
    }
    // What the program decides itself is no doubt, however it runs.
    let known: [(&str, Dialect, usize); 9] = [
        ("#1=0\nN7 #1=#1+1\nCUT\nIF[#1 LT 3]GOTO7", Dialect::Fanuc, 3),
        ("N1 G0 X0\nCUT\nM99 P1", Dialect::Fanuc, 1),
        ("N7 CUT\nM99 P7", Dialect::Fanuc, 1),
        ("CUT\nM99 P9\nCUT\nN9 CUT", Dialect::Fanuc, 2),
        ("M98 P82\nM98 P82\nIF[1 EQ 2]GOTO9\nN9\nM30\nO82\nCUT\nM99", Dialect::Fanuc, 2),
        ("M98 P82\nM98 P82 Q5\nM30\nO82\nCUT\nN5 CUT\nM99", Dialect::Fanuc, 3),
        ("#1=82\nM98 P#1\nM30\nO82\nCUT\nM99", Dialect::Fanuc, 1),
        ("R1=0\nAA: CUT\nR1=R1+1\nIF R1<2 GOTOB AA", Dialect::Siemens, 2),
        ("AA: CUT\nXX: R1=1\nREPEAT AA XX P=2", Dialect::Siemens, 3),
    ];
    let deeper = "G0 Z9\nN10 G91\nG1 Z-10 F300\nG90 X48 F600\nM99 P10";
    assert!(
        !read(&format!("G21\nT1 M6\nS8000 M3\n{deeper}\n"), Dialect::Fanuc, &bare()).doubts.is_empty(),
        "deeper in each pass"
    );
    for (body, dialect, cuts) in known {
        let text = format!(
            "G21 G90 G17\nT1 M6\nS8000 M3\nG0 X0 Y10 Z5\n{}\nG0 Z50\nM30\n",
            body.replace("CUT", "G1 X48 F600")
        );
        let path = read(&text, dialect, &Environment { start_mm: Some(Vec3::zeros()), ..bare() });
        let made = path.iter_moves().filter(|(_, motion)| motion.kind == MoveKind::Feed).count();
        assert_eq!(made, cuts, "{body}: {:?}", path.diagnostics);
        assert!(path.doubts.is_empty(), "{body}: {:?}", path.doubts);
    }
}

/// The same in plain language.
#[test]
fn what_plain_language_may_run_again_is_in_doubt_too() {
    let text = |body: &str| {
        format!(
            "0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S8000\n2 L X+0 Y+10 Z+5 R0 FMAX M3\n3 LBL 5\n4 L X+48 R0 F600\n5 L X+0 R0 F600\n{body}\n\
             7 L Z+50 R0 FMAX\n8 M30\n9 END PGM A MM\n"
        )
    };
    for body in [
        "6 LBL 0\nCALL LBL 5\nFN 9: IF +Q50 EQU +0 GOTO LBL 9\nCALL LBL 5\nLBL 9",
        "6 FN 9: IF +Q50 IS UNDEFINED GOTO LBL 5",
        "6 Q5 = 5\nFN 9: IF +Q5 EQU +5 GOTO LBL Q5",
        "6 CALL LBL 5 REP Q50",
        "6 FN 9: IF +Q1 EQU +Q50 GOTO LBL 5",
        "6 LBL 0\nCALL LBL Q50",
    ] {
        let path = read(&text(body), Dialect::Heidenhain, &bare());
        let first = path.iter_moves().find(|(_, motion)| motion.kind == MoveKind::Feed).map(|(id, _)| id).unwrap();
        assert!(path.doubts_at(first).next().is_some(), "{body}: {:?}", path.diagnostics);
    }
    let path = read(&text("6 CALL LBL 5 REP 2"), Dialect::Heidenhain, &bare());
    assert!(path.doubts.is_empty(), "{:?}", path.doubts);
}

/// Highest feed of the stations of each line as written, mm/min.
fn highest(dir: &Path) -> BTreeMap<u32, f64> {
    let mut reader = csv::Reader::from_path(dir.join("r.csv")).unwrap();
    let headers = reader.headers().unwrap().clone();
    let at = |name: &str| headers.iter().position(|header| header == name).unwrap();
    let (line, feed, motion) = (at("line"), at("feed_after_mm_min"), at("motion"));
    let mut highest = BTreeMap::new();
    for record in reader.records().map(Result::unwrap).filter(|record| &record[motion] != "rapid") {
        let known: &mut f64 = highest.entry(record[line].parse().unwrap()).or_default();
        *known = known.max(record[feed].parse().unwrap());
    }
    highest
}

/// Feeds behind the first cut after `optimize`, with a limit that the first cut meets and a high feed in air: those above what
/// is programmed.
fn raised(event: &str, dialect: Dialect) -> (Vec<(u32, f64)>, String) {
    let setup = slot::SETUP.replace("linuxcnc", dialect.name()) + "air_feed = 4000\nforce_xy = 70\n";
    let dir = slot::bench(&with(event, BEFORE.len()), &setup);
    let out = slot::feedwright(dir.path(), &["optimize", "part.nc", "--csv", "r.csv", "--json", "r.json"]);
    let behind = BEFORE.len() as u32 + event.lines().count() as u32;
    if !dir.path().join("r.csv").exists() {
        return (Vec::new(), String::from_utf8_lossy(&out.stderr).into_owned());
    }
    let said = fs::read_to_string(dir.path().join("r.json")).unwrap();
    let feeds = highest(dir.path()).into_iter().filter(|(line, feed)| *line > behind && *feed > 600.5);
    (feeds.collect(), said)
}

#[test]
fn optimize_raises_nothing_behind_an_event() {
    let (control, _) = raised("(NOTHING)", Dialect::Fanuc);
    assert!(!control.is_empty(), "without an event the second cut is air and runs faster");
    for (name, event, dialect, doubt) in EVENTS {
        let (feeds, said) = raised(event, dialect);
        assert!(feeds.is_empty(), "{name}: {feeds:?}");
        assert!(said.contains(doubt.why()), "{name}: {said}");
    }
}
