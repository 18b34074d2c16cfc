//! What is not simulated: a block whose start is not known stays whole, and the feed in force where something unseen may use it stays the
//! original's. What `optimize` writes keeps both, and the proof refuses what does not.

#![allow(clippy::unwrap_used)]

use feedwright::nc::{self, Dialect, Environment};
use feedwright::rewrite;

/// Does the proof hold for a text and another one that is to differ in feeds alone?
fn holds(dialect: Dialect, original: &str, rewritten: &str) -> bool {
    let parse = |text: &str| nc::parse(text.as_bytes().to_vec(), Some(dialect));
    let environment = Environment { home_mm: None, start_mm: None, clear_z_mm: 100.0, ..Environment::default() };
    rewrite::verify(&parse(original), &parse(rewritten), &environment).holds()
}

/// A cut behind an event, whole and in two pieces.
fn cut_behind(event: &str) -> [String; 2] {
    ["G1 X60. F300.", "G1 X20. F300.\nG1 X60. F600."].map(|cut| {
        format!("G21 G90 G17\nT1 M6\nS8000 M3\nG0 X-8. Y10. Z5.\nG1 Z-2. F300.\n{event}\n{cut}\nG0 Z50.\nM30\n")
    })
}

#[test]
fn a_block_whose_start_is_not_known_is_not_cut() {
    for (dialect, event) in [
        (Dialect::Fanuc, "G91 G0 X#500\nG90"),
        (Dialect::Fanuc, "G0 X#500"),
        (Dialect::Fanuc, "IF [#100 EQ 1] GOTO 50\nG0 X0. Y0. Z-2.\nN50"),
        (Dialect::Fanuc, "G10 L2 P1 X[#500]"),
        (Dialect::Fanuc, "G52 X#500"),
        (Dialect::Fanuc, "#5221=#500"),
        (Dialect::Fanuc, "M77"),
        (Dialect::Fanuc, "M0"),
        (Dialect::Fanuc, "M98 P7000"),
        (Dialect::Fanuc, "G31 X30. F50."),
        (Dialect::Fanuc, "G5 P10001 L2"),
        (Dialect::LinuxCnc, "o1 if [#500 EQ 1]\nG0 X40.\no1 endif"),
        (Dialect::LinuxCnc, "o1 if [#500 EQ 0]\nG0 X-8. Y10. Z-2.\no1 endif"),
        (Dialect::LinuxCnc, "M101"),
        (Dialect::Siemens, "IF R5==1 GOTOF A\nG0 X40\nA:"),
        (Dialect::Siemens, "MYSUB"),
        (Dialect::Siemens, "G1 MEAS=1 X30 F50"),
    ] {
        let [whole, cut] = cut_behind(event);
        assert!(!holds(dialect, &whole, &cut), "{event}");
        let slower = whole.replace("X60. F300.", "X60. F200.");
        assert!(holds(dialect, &whole, &slower), "slowed as a whole: {event}");
    }
    // Where every axis has been sent to a place since, it may be.
    for event in ["M0\nG0 X-8. Y10. Z-2.", "M0\nG0 X-8.\nY10.\nZ-2.", "(NOTHING)", "G54 G0 X-8. Y10. Z-2."] {
        let [whole, cut] = cut_behind(event);
        assert!(holds(Dialect::Fanuc, &whole, &cut), "{event}");
    }
}

#[test]
fn the_feed_that_something_unseen_may_use_stays() {
    for (dialect, user) in [
        (Dialect::Haas, "G12 I5. D1"),
        (Dialect::Fanuc, "G95\nG1 X20.\nG94"),
        (Dialect::LinuxCnc, "G93\nG94"),
        (Dialect::Siemens, "G95\nG94"),
        (Dialect::Fanuc, "M198 P5"),
        (Dialect::Fanuc, "M98 P5"),
        (Dialect::Fanuc, "G65 P9810 Z-5."),
        (Dialect::Fanuc, "M77"),
        (Dialect::Fanuc, "#101=#4109"),
        (Dialect::Fanuc, "#101=# 4109"),
        (Dialect::Fanuc, "#101=#[4100+9]"),
        (Dialect::Fanuc, "#1=4309\n#101=##1"),
        (Dialect::Fanuc, "#101=#[#500]"),
        (Dialect::Fanuc, "#101=#4509"),
        (Dialect::Fanuc, "M98 P2000 Q20"),
        (Dialect::LinuxCnc, "#101=#<_FEED>"),
        (Dialect::LinuxCnc, "M70"),
        (Dialect::Siemens, "CYCLE82(RTP,0,2,-10)"),
        (Dialect::Siemens, "CYCLE82(10,0,2)"),
        (Dialect::Siemens, "MCALL CYCLE82(10,0,2,-5)\nCYCLE802(111111111,111111111,10,10,20,20)\nMCALL"),
        (Dialect::Siemens, "MCALL MYDRILL(3)\nG0 X10\nMCALL"),
        (Dialect::Siemens, "MCALL L70\nG0 X10\nMCALL"),
        (Dialect::Siemens, "GOTOF \"LAB\"<<R1"),
        (Dialect::LinuxCnc, "#101=#<_feed>"),
        (Dialect::LinuxCnc, "M101"),
        (Dialect::Siemens, "L100"),
        (Dialect::Siemens, "R1=$P_F"),
        (Dialect::Siemens, "MYSUB"),
    ] {
        let text = |before: &str| {
            format!(
                "G21 G90 G17\nT1 M6\nS8000 M3\nG0 X-8. Y10. Z5.\nG1 Z-2. F500.\n{before}{user}\nG1 X60. F500.\nG0 Z50.\nM30\n"
            )
        };
        let faster = text("").replace("Z-2. F500.", "Z-2. F900.");
        assert!(!holds(dialect, &text(""), &faster), "{user}");
        let restated = text("F500.\n").replace("Z-2. F500.", "Z-2. F900.");
        assert!(holds(dialect, &text(""), &restated), "{user}");
    }
}

#[test]
fn a_feed_is_added_to_no_line_that_may_take_it_for_something_else() {
    for (dialect, line) in [
        (Dialect::Fanuc, "G65 P9810 Z-50."),
        (Dialect::Fanuc, "M77"),
        (Dialect::Fanuc, "G10 L2 P1 X0"),
        (Dialect::Fanuc, "G0 X5."),
        (Dialect::Siemens, "G33 Z-5 K1.5"),
    ] {
        let text = |line: &str| {
            format!("G21 G90 G17\nT1 M6\nS800 M3\nG0 X0. Y0. Z5.\nG1 Z-2. F500.\nG1 X9.\n{line}\nG1 X60. F500.\nM30\n")
        };
        assert!(!holds(dialect, &text(line), &text(&format!("{line} F500."))), "{line}");
    }
}

/// Each switch may be on alone.
#[test]
fn switches_of_different_numbers_are_compared_each_alone() {
    let text = "G21 G90 G17\nT1 M6\nS8000 M3\nG0 X0. Y0. Z5.\nG1 Z1. F100.\n/1 G1 X9. F500.\n/2 F100.\nG31 Z-5.\nM30\n";
    let faster = text.replace("/1 G1 X9. F500.", "/1 G1 X9. F900.");
    assert!(!holds(Dialect::Fanuc, text, &faster), "with switch 2 alone the probe runs at the other feed");
}

/// A Fanuc takes F40 in inches for 0.40 or for 40, by its parameters: a number with a point is in another unit.
#[test]
fn a_feed_in_inches_keeps_its_point_or_has_none() {
    let text =
        |feed: &str| format!("G20 G90 G17\nT1 M6\nS8000 M3\nG0 X0. Y0. Z.5\nG1 Z-.1 F10.\nG1 X4.5 {feed}\nM30\n");
    for (was, now, same) in
        [("F40", "F30", true), ("F40", "F30.5", false), ("F40.", "F30.5", true), ("F40.", "F30", false)]
    {
        assert_eq!(holds(Dialect::Fanuc, &text(was), &text(now)), same, "{was} {now}");
    }
    assert!(holds(Dialect::LinuxCnc, &text("F40"), &text("F30.5")), "this control knows no increments");
}

#[test]
fn an_absurd_feed_and_two_feeds_in_a_row_are_refused() {
    let text =
        |feed: &str| format!("G21 G90 G17\nT1 M6\nS8000 M3\nG0 X0. Y0. Z5.\nG1 Z-2. F500.\nG1 X60. {feed}\nM30\n");
    for feed in ["F999999999.", "F00000000000150.", "F.0000001"] {
        assert!(!holds(Dialect::Fanuc, &text("F500."), &text(feed)), "{feed}");
    }
    let added = |lines: &str| text("F500.").replace("G1 X60.", &format!("{lines}G1 X60."));
    assert!(holds(Dialect::Fanuc, &text("F500."), &added("F500.\n")));
    assert!(!holds(Dialect::Fanuc, &text("F500."), &added("F500.\nF500.\n")));
}

/// An arc of a thousand turns is a thread; more are a mistake whose stations would fill the memory.
#[test]
fn an_arc_of_endless_turns_is_not_followed() {
    let read = |turns: u32| {
        let text = format!("G21 G90 G17\nG0 X0 Y0 Z0\nG2 I1 P{turns} Z-4 F600\nM30\n");
        let program = nc::parse(text.into_bytes(), Some(Dialect::LinuxCnc));
        nc::interpret(&program, &Environment::default())
    };
    let way = |path: &nc::Toolpath| path.moves.iter().map(|motion| motion.curve().length()).sum::<f64>();
    let (most, endless) = (read(900), read(100_000));
    assert!(way(&most) > 5000.0 && most.doubts.is_empty());
    assert!(way(&endless) < 10.0 && !endless.doubts.is_empty(), "{}", way(&endless));
}

/// Where a control takes a line for more than a feed, none is added, and none where two blocks without a motion would stand in a row under
/// radius compensation.
#[test]
fn a_line_is_added_only_where_it_is_nothing_but_a_feed() {
    let text = |between: &str| {
        format!(
            "%\nO1\nG21 G90 G17\nT1 M6\nS800 M3\nG0 X0. Y0. Z5.\nG1 Z-2. F500.\nX9.\n{between}\nX30. Y0. F500.\nG0 Z9.\nM30\n%\n"
        )
    };
    for (between, place, may) in [
        ("G10 L50\nN1221 P1 R5\nG11", "N1221", false),
        ("G10 L50\nN1221 P1 R5\nG11", "G10", true),
        ("G10 L2 P6 X0.\nM8", "M8", true),
        ("G66.1 P9100\nX5.\nG67", "X5.", false),
        ("G41 D1 X20.\nY9.\nM8\nY20.\nG40 X9.", "M8", false),
        ("G41 D1 X20.\nY9.\nM8\nY20.\nG40 X9.", "Y20.", false),
        ("G41 D1 X20.\nY9.\nY20.\nG40 X9.", "Y20.", true),
        ("M8\nY20.", "Y20.", true),
    ] {
        let whole = text(between);
        let added = whole.replacen(place, &format!("F500.\n{place}"), 1);
        assert_eq!(holds(Dialect::Fanuc, &whole, &added), may, "before {place} in {between}");
    }
    let whole = text("M8");
    for line in ["F500.\n", "(FW F500. kept)\n"] {
        assert!(!holds(Dialect::Fanuc, &whole, &format!("{line}{whole}")), "before the first %: {line}");
        assert!(!holds(Dialect::Fanuc, &whole, &whole.replace("O1\n", &format!("{line}O1\n"))), "before O: {line}");
    }
    let sub = whole.replace("M30\n", "M30\nO2\nG1 X7.\nM99\n");
    assert!(!holds(Dialect::Fanuc, &sub, &sub.replace("O2\n", "O2\nF500.\n")), "nothing calls it here");
    let plain =
        "0 BEGIN PGM P MM\n1 TOOL CALL 1 Z S3000\n2 L X+0 Y+0 Z+5 FMAX M3\n3 L Z-2 F300\n4 L X+50\n5 END PGM P MM\n";
    for line in ["F300\n", "; FW F300 kept\n"] {
        assert!(!holds(Dialect::Heidenhain, plain, &plain.replace("4 L", &format!("{line}4 L"))), "{line}");
    }
}

/// An F stands where the control looks for it, once, and is a feed.
#[test]
fn an_f_stands_where_the_control_takes_it_for_a_feed() {
    let plain = |block: &str| {
        format!(
            "0 BEGIN PGM P MM\n1 TOOL CALL 1 Z S3000 F250\n2 L X+0 Y+0 Z+5 FMAX M3\n3 L Z-2 F300\n4 {block}\n5 L X+60\n6 END PGM P MM\n"
        )
    };
    for (was, now, same) in [
        ("L X+50", "L X+50 F200", true),
        ("L X+50 R0 M8", "L X+50 R0 F200 M8", true),
        ("L X+50", "L F200 X+50", false),
        ("L X+50", "F200 L X+50", false),
        ("L X+50 RL", "L X+50 F200 RL", false),
        ("L X+Q5", "L F200 X+Q5", false),
        ("L X+50 F AUTO", "L X+50 F AUTO F200", false),
        ("L X+50 FMAX M99", "L X+50 FMAX M99 F300", false),
        ("L X+50 M103 F20", "L X+50 M103 F40", false),
        ("CYCL CALL PAT F300", "CYCL CALL PAT F200", false),
    ] {
        assert_eq!(holds(Dialect::Heidenhain, &plain(was), &plain(now)), same, "{was} → {now}");
    }
    let iso = |block: &str| format!("G21 G90 G17\nT1 M6\nS800 M3\nG0 X0 Y0 Z5\nG1 Z-2 F500\n{block}\nM2\n");
    let long = format!("X9 ({})", "A".repeat(240));
    for (was, now, same) in [
        ("N5 X9", "N5 X9 F400", true),
        ("N5 X9", "N5 F400 X9", false),
        ("N5 X9 F500", "F400 N5 X9", false),
        ("X9", "X9 f400", false),
        ("X9", "X9 F+400", false),
        ("X9 f500", "X9 f400", true),
        (&*long, &*format!("{long} (FW F500 kept)"), false),
        ("X9 R5", "X5 R5 F400\nX9 R5 F500", false),
        ("X9 I5", "X5 I5 F400\nX9 I5 F500", false),
        ("G61.1 X9", "G61.1 X5 F400\nG61.1 X9 F500", false),
    ] {
        assert_eq!(holds(Dialect::LinuxCnc, &iso(was), &iso(now)), same, "{was} → {now}");
    }
    let siemens = |comment: &str| format!("G71 G90 G17\nT1\nM6\nS800 M3\nG0 X0 Y0 Z5\nG1 Z-2 F500{comment}\nX9\nM30\n");
    assert!(holds(Dialect::Siemens, &siemens(""), &siemens(" ; FW F500 kept")));
    assert!(!holds(Dialect::Siemens, &siemens(""), &siemens(" (FW F500 kept)")), "parentheses only in its ISO mode");
}
