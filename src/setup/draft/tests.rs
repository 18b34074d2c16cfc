//! Tests of drafting. In: headers in the styles of many posts. Out: for each the setup that must be found.

use super::described::{Told, told};
use super::header::{Comment, inner, tool_comment};
use super::*;

fn of(text: &str, inch: bool) -> Told {
    let comment = Comment { text: inner(text), line: 1, tool: Some(9), same_line: true };
    let (number, description) = tool_comment(&comment).unwrap();
    told(number, &description, inch)
}

#[test]
fn tool_comments_of_many_posts_are_read() {
    let close = |told: &Told, shape, d: f64| {
        assert_eq!(told.shape, Some(shape), "{told:?}");
        assert!((told.diameter.unwrap() - d).abs() < 1e-4, "{told:?}");
    };
    close(&of("(T1 D=2 CR=0 - ZMIN=-5.9 - FLAT END MILL)", false), "flat", 2.0);
    close(&of("(T3 D=0.125 CR=0.0625 - ZMIN=-0.54 - BALL END MILL)", true), "ball", 0.125);
    close(&of("(T1| 3/4 FLAT ENDMILL|H0|XY STOCK TO LEAVE - .005)", true), "flat", 0.75);
    let bull = of("(T2| 1/2 BULL ENDMILL 0.125 RAD|H0)", true);
    close(&bull, "bull", 0.5);
    assert_eq!(bull.corner, Some(0.125));
    // Whether 6 is in mm is not guessed: the diameter is asked for.
    assert_eq!(of("(T5|   6. FLAT ENDMILL|H0)", true).diameter, None);
    close(&of("(T21| 1/8 SPOTDRILL|H0)", true), "chamfer", 0.125);
    close(&of("( T0 : 3.175 )", false), "flat", 3.175);
    close(&of(";DRILL 10.2MM", false), "drill", 10.2);
    close(&of("(TOOL DIA. 3)", false), "flat", 3.0);
    close(&of("(TOOL: 1/4 IN CARBIDE END MILL)", false), "flat", 6.35);
    close(&of("(T3|6MM EM|H0)", true), "flat", 6.0 / 25.4);
    assert_eq!(of("(T4 D=10 CR=0 - 3 FLUTE FLAT END MILL)", false).flutes, Some(3));
    assert_eq!(of("(T4 D=10 CR=0 - 3 FLUTE FLAT END MILL)", false).number, 4);
    assert_eq!(of("(T4 D=10 - 4FL ENDMILL)", false).flutes, Some(4));
    assert_eq!(of("(T1| 3/4 FLAT ENDMILL|H0)", true).flutes, None);
}

/// A line of a header; is the program in inches; number, shape and diameter that it tells.
type Header = (&'static str, bool, u32, Option<&'static str>, Option<f64>);

/// Lines in the styles of many posts, with the right answer; `None`: the line does not tell it.
const HEADERS: [Header; 52] = [
    // Fusion 360, HSMWorks
    ("(T1 D=8. CR=0. - ZMIN=-4.5 - FLAT END MILL)", false, 1, Some("flat"), Some(8.0)),
    ("(T5  D=6. CR=3. - ZMIN=-3.1 - BALL END MILL)", false, 5, Some("ball"), Some(6.0)),
    ("(T6 D=12. CR=1.5 - ZMIN=-9. - BULLNOSE END MILL)", false, 6, Some("bull"), Some(12.0)),
    ("(T9 D=8.5 CR=0. TAPER=118DEG - ZMIN=-21. - DRILL)", false, 9, Some("drill"), Some(8.5)),
    ("(T12 D=10. CR=0. TAPER=45DEG - ZMIN=-1. - CHAMFER MILL)", false, 12, Some("chamfer"), Some(10.0)),
    ("(T14 D=6. CR=0. TAPER=90DEG - ZMIN=-2. - SPOT DRILL)", false, 14, Some("chamfer"), Some(6.0)),
    ("(T2 D=0.375 CR=0. - ZMIN=-0.5 - FLAT END MILL)", true, 2, Some("flat"), Some(0.375)),
    ("(T7 D=63. CR=0. - ZMIN=-1. - FACE MILL)", false, 7, Some("face"), Some(63.0)),
    ("(T8 D=5. CR=0. - ZMIN=-14. - RIGHT HAND TAP)", false, 8, Some("tap"), Some(5.0)),
    // Mastercam
    ("(T1| 3/8 FLAT ENDMILL|H1)", true, 1, Some("flat"), Some(0.375)),
    ("( T4 | 10. FLAT ENDMILL | H4 | D4 | TOOL DIA. - 10. )", false, 4, Some("flat"), Some(10.0)),
    ("(1/2 FLAT ENDMILL TOOL - 3 DIA. OFF. - 43 LEN. - 3 DIA. - .5)", true, 3, Some("flat"), Some(0.5)),
    ("(T2| 1/2 BULL ENDMILL 0.06 RAD|H2)", true, 2, Some("bull"), Some(0.5)),
    ("(T11|NO. 7 DRILL|H11)", true, 11, Some("drill"), None),
    ("(T13| 1/4-20 TAPRH|H13)", true, 13, None, None),
    // SolidCAM, BobCAD, SurfCAM
    ("(TOOL NUMBER: 4 - DIAMETER: 12.0 - END MILL)", false, 4, Some("flat"), Some(12.0)),
    ("(T3 END MILL D16 R0)", false, 3, Some("flat"), Some(16.0)),
    ("(TOOL #2 0.2500 1/4 DRILL)", true, 2, Some("drill"), Some(0.25)),
    ("(TOOL #1 0.5 ENDMILL ROUGH)", true, 1, Some("flat"), Some(0.5)),
    ("(T02 ID=002 DIA-0.5000 1/2 ENDMILL)", true, 2, Some("flat"), Some(0.5)),
    ("(T13 ID=013 3MM DRILL)", true, 13, Some("drill"), Some(3.0 / 25.4)),
    ("(T13 ID=013 3MM DRILL)", false, 13, Some("drill"), Some(3.0)),
    ("(T02 ID=002 DIA-0.5000 1/2 ENDMILL)", false, 2, Some("flat"), Some(12.7)),
    // VCarve, Aspire
    ("(TOOL 1: END MILL {6 MM})", false, 1, Some("flat"), Some(6.0)),
    ("(TOOL 2: BALL NOSE {3.175 MM})", false, 2, Some("ball"), Some(3.175)),
    ("(TOOL 3: V-BIT {60 DEG 12.7 MM})", false, 3, Some("chamfer"), Some(12.7)),
    ("(TOOL 1: END MILL {1/4 INCH})", true, 1, Some("flat"), Some(0.25)),
    ("(T3 V-BIT 90 DEG 1/2\")", true, 3, Some("chamfer"), Some(0.5)),
    // FreeCAD, CamBam, Estlcam, MeshCAM, Carveco
    ("(TOOL 5: 5MM ENDMILL)", false, 5, Some("flat"), Some(5.0)),
    ("(T1 - 6MM ENDMILL 2 FLUTES)", false, 1, Some("flat"), Some(6.0)),
    ("( T0 : 3.175 )", false, 0, Some("flat"), Some(3.175)),
    ("( T2 : 6.0 )", false, 2, Some("flat"), Some(6.0)),
    ("(T2 = BOHRER 3.0MM)", false, 2, Some("drill"), Some(3.0)),
    ("(T1 = FRAESER 6MM)", false, 1, Some("flat"), Some(6.0)),
    ("(NO. 1: FR\u{c4}SER 3MM)", false, 1, Some("flat"), Some(3.0)),
    ("(TOOL #1: 1/8 BALL MILL)", true, 1, Some("ball"), Some(0.125)),
    ("(TOOL NUMBER:1, END MILL 6 MM)", false, 1, Some("flat"), Some(6.0)),
    ("(T1 END MILL 3.0 MM)", true, 1, Some("flat"), Some(3.0 / 25.4)),
    // NX, hyperMILL, PowerMill
    ("(T1 : D10R0 FLAT)", false, 1, Some("flat"), Some(10.0)),
    ("(TOOL 12: BALL D6 R3)", false, 12, Some("ball"), Some(6.0)),
    ("(T4 D=20 R=2 BULL NOSE MILL)", false, 4, Some("bull"), Some(20.0)),
    ("(T5 DIA 8.0 DRILL POINT 140)", false, 5, Some("drill"), Some(8.0)),
    ("(T7 = 16MM DIA CARBIDE END MILL, 4 FL)", false, 7, Some("flat"), Some(16.0)),
    // by hand
    ("(T1 10 MM CARBIDE END MILL, 3 FLUTES)", false, 1, Some("flat"), Some(10.0)),
    ("(T2 2\" FACE MILL)", true, 2, Some("face"), Some(2.0)),
    ("(T3 .250 DIA 4 FLUTE ENDMILL 1.0 LOC)", true, 3, Some("flat"), Some(0.25)),
    ("(T4 90 DEG SPOT DRILL 10MM)", false, 4, Some("chamfer"), Some(10.0)),
    ("(T6 M6X1.0 TAP )", false, 6, Some("tap"), None),
    ("(T8 THREAD MILL D9.9 PITCH 1.5)", false, 8, None, Some(9.9)),
    ("(T8 THREADMILL M10 X 1.5)", false, 8, None, None),
    ("(T5| 6. FLAT ENDMILL|H5)", true, 5, Some("flat"), None),
    ("(T10 SLOT DRILL 6MM 2 FLUTE 13 LONG)", false, 10, Some("flat"), Some(6.0)),
];

/// At least 90 % of what the lines tell is read, and nothing wrong: what is not read is asked for.
#[test]
fn headers_of_many_posts_are_read() {
    let (mut told_so, mut read) = (0, 0);
    let mut wrong = Vec::new();
    for (line, inch, number, shape, diameter) in HEADERS {
        let comment = Comment { text: inner(line), line: 1, tool: None, same_line: false };
        let found = tool_comment(&comment).map(|(number, text)| told(number, &text, inch)).unwrap_or_default();
        told_so += usize::from(shape.is_some()) + usize::from(diameter.is_some());
        let same = |a: f64| diameter.is_some_and(|b| (a - b).abs() < 1e-4);
        read += usize::from(found.shape.is_some() && found.shape == shape);
        read += usize::from(found.diameter.is_some_and(same));
        let other = found.shape.is_some_and(|own| Some(own) != shape)
            || found.diameter.is_some_and(|own| !same(own))
            || found != Told::default() && found.number != number;
        if other {
            wrong.push(format!("{line}: {found:?}"));
        }
        println!("{} {line}: {:?} {:?}", if inch { "inch" } else { "mm  " }, found.shape, found.diameter);
    }
    println!("{read} of {told_so} read");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(read * 10 >= told_so * 9, "{read} of {told_so}");
}

#[test]
fn points_flutes_and_guesses_are_told_apart() {
    let point = |line: &str| {
        let text = format!("{line}\nT1 M6\nG1 X10 Z-1 F500\n");
        let program = crate::nc::parse(text.into(), None);
        let path = crate::nc::interpret(&program, &crate::nc::Environment::default());
        Facts::of_program(&program, &path).text()
    };
    assert!(point("(T1 D=6. CR=0. TAPER=90DEG - ZMIN=-2. - SPOT DRILL)").contains("point_angle = 90  # line 1\n"));
    assert!(point("(T1 D=10. CR=0. TAPER=45DEG - ZMIN=-1. - CHAMFER MILL)").contains("point_angle = 90  # line 1\n"));
    assert!(point("(T1 D=8. CR=0. TAPER=118DEG - ZMIN=-1. - DRILL)").contains("point_angle = 118  # line 1\n"));
    // A number alone may be anything: it does not run before it is confirmed.
    assert!(point("( T1 : 6.0 )").contains("# diameter = unknown: 6 is a guess from line 1"));
    assert!(point("(T1 10 MM CARBIDE END MILL, 3 FLUTES)").contains("\ndiameter = 10  # line 1\n"));
    assert_eq!(of("(T1 10 MM CARBIDE END MILL, 3 FLUTES)", false).flutes, Some(3));
}

#[test]
fn the_blank_of_plain_language_is_the_stock() {
    let text = "0 BEGIN PGM T MM\n1 BLK FORM 0.1 Z X-10 Y+0 Z-20\n2 BLK FORM 0.2 IX+100 Y+60 Z+0\n3 TOOL CALL 1 Z S3000\n\
        4 L X+5 R0 F500\n5 END PGM T MM\n";
    let program = crate::nc::parse(text.into(), None);
    let path = crate::nc::interpret(&program, &crate::nc::Environment::default());
    let text = Facts::of_program(&program, &path).text();
    assert!(text.contains("box = { min = [-10, 0, -20], max = [90, 60, 0] }  # BLK FORM\n"), "{text}");
}

#[test]
fn the_round_blank_of_plain_language_is_the_stock() {
    for (form, expected) in [
        ("BLK FORM CYLINDER Z R50 L105 DIST+5", "diameter = 100, z = [-100, 5] }  # BLK FORM\n"),
        ("BLK FORM CYLINDER Z D80 L30", "diameter = 80, z = [-30, 0] }  # BLK FORM\n"),
        ("BLK FORM CYLINDER Z D80 L30 DI20 ; RING", "z = [-30, 0] }  # BLK FORM; its bore is taken as full\n"),
        ("BLK FORM CYLINDER X D80 L30", "# box = unknown"),
        ("BLK FORM CYLINDER Z D80", "# box = unknown"),
    ] {
        let text = format!("0 BEGIN PGM T MM\n1 {form}\n2 TOOL CALL 1 Z S3000\n3 L X+5 R0 F500\n4 END PGM T MM\n");
        let program = crate::nc::parse(text.into(), None);
        let path = crate::nc::interpret(&program, &crate::nc::Environment::default());
        let text = Facts::of_program(&program, &path).text();
        assert!(text.contains(expected), "{form}: {text}");
    }
}

#[test]
fn other_comments_are_not_tools() {
    for text in ["(POCKET: LAYER 6)", "(MILLING AN ENCLOSED POCKET)", "(T)", "(TOP OF STOCK AT Z=2)"] {
        let comment = Comment { text: inner(text), line: 1, tool: Some(1), same_line: false };
        assert!(tool_comment(&comment).is_none(), "{text}");
    }
}

#[test]
fn complete_comments_make_a_setup_that_loads() {
    let text = "(STOCK/BLOCK,100,60,20,0,0,20)\n(MATERIAL: AL 6061-T6)\n(T1 D=10 CR=0 - 4 FLUTES FLAT END MILL)\nT1 M6\nG1 X10 Z-1 F500\n";
    let program = crate::nc::parse(text.into(), None);
    let path = crate::nc::interpret(&program, &crate::nc::Environment::default());
    let facts = Facts::of_program(&program, &path);
    assert_eq!(facts.lacking(), Vec::new());
    assert!(facts.text().contains("max = [100, 60, 0]"), "{}", facts.text());
    assert!(crate::setup::load(&facts.text(), std::path::Path::new(".")).is_ok());
}

fn facts(text: &str) -> Facts {
    let program = crate::nc::parse(text.into(), None);
    let path = crate::nc::interpret(&program, &crate::nc::Environment::default());
    Facts::of_program(&program, &path)
}

#[test]
fn blanks_in_the_styles_of_many_posts_are_read() {
    for (header, expected) in [
        ("(STOCK X0 Y0 Z-20 X100 Y60 Z0)", Some("min = [0, 0, -20], max = [100, 60, 0]")),
        ("(STOCK: X=-50. Y=-30. Z=-10. TO X=50. Y=30. Z=1.)", Some("min = [-50, -30, -10], max = [50, 30, 1]")),
        ("(STOCK MIN X-5 Y-5 Z-12)\n(STOCK MAX X105 Y65 Z1)", Some("min = [-5, -5, -12], max = [105, 65, 1]")),
        ("(STOCK LOWER X0. Y0. Z-1.)\n(STOCK UPPER X4. Y3. Z0.)", Some("min = [0, 0, -1], max = [4, 3, 0]")),
        (
            "(MATERIAL SIZE)\n(X= 600.000, Y= 400.000, Z= 18.000)\n(Z ORIGIN FOR MATERIAL = MATERIAL SURFACE)\n\
             (XY ORIGIN FOR MATERIAL = BOTTOM LEFT CORNER)",
            Some("min = [0, 0, -18], max = [600, 400, 0]"),
        ),
        (
            "(MATERIAL SIZE)\n(X= 600, Y= 400, Z= 18)\n(Z ORIGIN FOR MATERIAL = TABLE SURFACE)\n\
             (XY ORIGIN FOR MATERIAL = CENTER)",
            Some("min = [-300, -200, 0], max = [300, 200, 18]"),
        ),
        // Where it lies is not said, or nothing is said of a blank.
        ("(MATERIAL SIZE)\n(X= 600, Y= 400, Z= 18)", None),
        ("(STOCK X100 Y60 Z20)", None),
        ("(STOCK TO LEAVE X0.5 Z0.1)", None),
        ("(XY STOCK TO LEAVE - .005)", None),
    ] {
        let found = facts(&format!("{header}\nT1 M6\nG1 X10 Z-1 F500\n")).blank.map(|known| known.value);
        assert_eq!(found, expected.map(|corners| format!("box = {{ {corners} }}")), "{header}");
    }
}

#[test]
fn a_material_without_coefficients_is_asked_for_by_its_name() {
    let lacking = facts("(MATERIAL - WOOD MDF)\nT1 M6\nG1 X10 Z-1 F500\n").lacking();
    assert!(lacking[0].what.contains("WOOD MDF"), "{lacking:?}");
    assert!(facts("(MATERIAL - STEEL INCH - 4140)\nT1 M6\nG1 X10 F500\n").material.is_some());
}

#[test]
fn what_the_user_says_completes_the_draft() {
    let mut facts = facts("(T1 10 MM END MILL)\nT1 M6\nG1 X10 Z-1 F500\nX50\n");
    let what: Vec<String> = facts.lacking().into_iter().map(|lacking| lacking.what).collect();
    assert_eq!(what, ["material of the stock", "box of the stock", "flutes of T1"]);
    assert!(facts.text().contains("# flutes = unknown: count them\n"), "{}", facts.text());
    facts.take_tool("t1 3 flutes", "--tool").unwrap();
    facts.take_material("7075", "--material").unwrap();
    facts.take_blank("X0 Y0 Z-20 X100 Y60 Z0", "--stock").unwrap();
    facts.take_machine("haas-vf2", "--machine").unwrap();
    assert_eq!(facts.lacking(), Vec::new());
    assert!(facts.text().contains("diameter = 10  # line 1\nflutes = 3  # --tool\n"), "{}", facts.text());
    assert!(crate::setup::load(&facts.text(), std::path::Path::new(".")).is_ok(), "{}", facts.text());
    assert!(facts.take_tool("T4 flat D10", "").is_err() && facts.take_tool("flat D10", "").is_err());
    assert!(facts.take_material("MDF", "").is_err() && facts.take_machine("toaster", "").is_err());
    assert!(facts.take_blank("a lump", "").is_err() && facts.take_blank("X0 Y0 Z0 X0 Y1 Z1", "").is_err());
}
