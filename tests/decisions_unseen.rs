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
        (Dialect::Fanuc, "M198 P5"),
        (Dialect::Fanuc, "M98 P5"),
        (Dialect::Fanuc, "G65 P9810 Z-5."),
        (Dialect::Fanuc, "M77"),
        (Dialect::Fanuc, "#101=#4109"),
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
