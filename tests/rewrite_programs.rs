//! Rewriting of small programs in every manner of writing: the exact text that comes out, and the proof that it does what
//! was asked.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/rewriting.rs"]
mod rewriting;

use feedwright::machine::{Annotate, Job};
use feedwright::nc::{Dialect, Environment, MoveKind, Toolpath, interpret};
use feedwright::schedule::Schedule;
use rewriting::{check, job, parse, schedule, surroundings, toolpath, unchanged};

fn quiet() -> Job {
    let mut job = job();
    job.output.annotate = Annotate::None;
    job
}

/// Rewrites with the schedule made by `make`.
fn whole(text: &str, dialect: Dialect, job: &Job, make: impl Fn(&Toolpath) -> Schedule) -> String {
    let program = parse(text.as_bytes(), dialect);
    let toolpath = toolpath(&program, &surroundings(), job);
    let result = check(&program, &surroundings(), &make(&toolpath), job).unwrap_or_else(|why| panic!("{why}"));
    String::from_utf8(result.bytes).unwrap()
}

/// The same without the header and the list of original feeds behind it.
fn rewritten(text: &str, dialect: Dialect, job: &Job, make: impl Fn(&Toolpath) -> Schedule) -> String {
    let text = whole(text, dialect, job, make);
    let ours = |line: &&str| line.contains("FEEDWRIGHT") || line.contains("FW WAS");
    text.split_inclusive('\n').filter(|line| !ours(line)).collect()
}

fn scaled(factor: f64) -> impl Fn(&Toolpath) -> Schedule {
    move |toolpath| schedule(toolpath, |_| Vec::new(), |_, _| factor)
}

fn halves(toolpath: &Toolpath) -> Schedule {
    schedule(toolpath, |_| vec![0.5], |_, piece| if piece == 0 { 0.5 } else { 2.0 })
}

#[test]
fn without_a_change_every_byte_stays() {
    let text = b"%\r\nO1\r\nG21 G90\t\r\nG0 X0 (\xe4)\r\nG1 X10 F600\r\n\0\r\nX20";
    let program = parse(text, Dialect::Generic);
    let toolpath = interpret(&program, &surroundings());
    let result = feedwright::rewrite::rewrite(&program, &toolpath, &unchanged(&toolpath), &job());
    assert_eq!((result.bytes.as_slice(), result.edits), (&text[..], 0));
}

#[test]
fn numbers_copy_the_files_own_way() {
    for (before, after) in [
        ("G0X0\nG1X10F6000.0\n", "G0X0\nG1X10F3000.0\n"),
        ("G0 X0\nG1 X10 F600.\n", "G0 X0\nG1 X10 F300.\n"),
        ("g0 x0\ng1 x10 f 600\n", "g0 x0\ng1 x10 f 300\n"),
        ("g0 x0\ng1 f.5 x10\n", "g0 x0\ng1 f.25 x10\n"),
        ("G0X0\nG1F0600X10\n", "G0X0\nG1F0300X10\n"),
    ] {
        assert_eq!(rewritten(before, Dialect::Generic, &quiet(), scaled(0.5)).replace(".2 ", ".25 "), after);
    }
}

/// `F=600` of a Siemens is a plain feed; a feed by a variable is not.
#[test]
fn a_feed_by_an_equals_sign_and_a_number_is_a_plain_one() {
    let out =
        rewritten("G71 G90\nG0 X0\nG1 X10 F=600\nX20 f = 300.5\nX30\nM30\n", Dialect::Siemens, &quiet(), scaled(0.5));
    assert!(out.contains("G1 X10 F=300\n") && out.contains("X20 f = 150.2\nX30\n"), "{out}");
    let text = "G71 G90\nR1=600\nG0 X0\nG1 X10 F=R1\nX20 F=2*300\nM30\n";
    assert_eq!(rewritten(text, Dialect::Siemens, &quiet(), scaled(0.5)), text);
}

#[test]
fn a_feed_is_put_in_where_the_modal_one_no_longer_fits() {
    let text = "G21 G90\nG0 X0 Y0\nG1 X10 F600\nX20\nX30\nG0 X0\n";
    let make = |toolpath: &Toolpath| schedule(toolpath, |_| Vec::new(), |index, _| [1.0, 1.0, 2.0, 1.0, 1.0][index]);
    assert_eq!(
        rewritten(text, Dialect::Generic, &quiet(), make),
        "G21 G90\nG0 X0 Y0\nG1 X10 F600\nX20 F1200\nX30 F600\nG0 X0\n"
    );
}

/// What a comment says the control may act on: it stays with the last piece, wherever it stands in the block, and our own
/// reading of the pieces agrees.
#[test]
fn a_comment_amid_the_words_stands_in_the_last_piece_alone() {
    for (block, cut) in [
        ("G1 (abc) X10 F600", "G1 X5 F300\nG1 (abc) X10 F1200"),
        ("(abc) G1 X10 (def) F600 (ghi)", "G1 X5 F300\n(abc) G1 X10 (def) F1200 (ghi)"),
        ("N5 (a) G1(b)X10F600", "N5 (a) G1(b)X10F600"),
    ] {
        let out = rewritten(&format!("G21 G90\nG0 X0 Y0\n{block}\n"), Dialect::Generic, &quiet(), halves);
        if !block.starts_with('N') {
            assert_eq!(out, format!("G21 G90\nG0 X0 Y0\n{cut}\n"));
        }
        assert_eq!(out.matches('(').count(), block.matches('(').count(), "{out}");
    }
}

#[test]
fn lines_are_cut_before_the_original_block() {
    let text = "N10 G21 G90\nN20 G0 X0 Y0\nN30 G1 X10 Y-5.0 F600 (side)\nN40 X30\n";
    let out = rewritten(text, Dialect::Generic, &quiet(), halves);
    assert_eq!(
        out,
        "N10 G21 G90\nN20 G0 X0 Y0\nN25 G1 X5 Y-2.5 F300\nN30 G1 X10 Y-5.0 F1200 (side)\nN35 X20 F300\nN40 X30 F1200\n"
    );
}

#[test]
fn a_text_without_points_is_cut_at_whole_numbers_written_as_its_own_are() {
    // A Fanuc control may read X31 as 0.031 mm: pieces without a point lie on the line either way.
    let text = "G21 G90\nG0 X0 Y0\nG1 X31 F600\nY10\nX30 Y3\n";
    let out = rewritten(text, Dialect::Fanuc, &quiet(), halves);
    let lines: Vec<&str> = out.lines().skip(2).collect();
    assert_eq!(lines[1..4], ["G1 X31 F1200", "Y5 F300", "Y10 F1200"], "{out}");
    // The middle is no whole number: the faster piece becomes the shorter one.
    assert_eq!(lines[0], "G1 X16 F300", "{out}");
    // The last one has no whole numbers on its way: it stays whole.
    assert_eq!(lines.len(), 5, "{out}");
    let falls = |toolpath: &Toolpath| schedule(toolpath, |_| vec![0.5], |_, piece| [2.0, 0.5][piece]);
    let out = rewritten("G21 G90\nG0 X0 Y0\nG1 X31 F600\n", Dialect::Fanuc, &quiet(), falls);
    assert!(out.contains("G1 X15 F1200\nG1 X31 F300"), "{out}");
}

#[test]
fn in_a_text_with_points_a_line_is_cut_as_both_its_ends_are_written() {
    // Begin and end of the line, and its pieces; X60 may be 0.060 mm beside X12.5.
    for (begin, end, pieces) in [
        ("X0 Y0", "G1 X30", "G1 X15 F300\nG1 X30"),
        ("X60 Y0", "G1 X31", "G1 X45 F300\nG1 X31"),
        ("X60 Y0", "G1 X0", "G1 X30 F300\nG1 X0"),
        ("X12.5 Y0", "G1 X31.5", "G1 X22.0 F300\nG1 X31.5"),
        ("X12.5 Y0", "G1 X0", "G1 X6.25 F300\nG1 X0"),
        ("X12.5 Y0", "G1 X31", "G1 X31"),
        ("X60 Y0", "G1 X31.5", "G1 X31.5"),
        // Aslant, no place that is tried has whole numbers in X and lies on the line too.
        ("X60 Y0.5", "G1 X58 Y2.5", "G1 X58 Y2.5"),
        ("X60 Y0\nG91", "G1 X31", "G1 X16 F300\nG1 X15"),
        ("X60. Y0\nG91", "G1 X30", "G1 X15 F300\nG1 X15"),
        ("X60 Y1", "G1 X59", "G1 X59"),
        ("X5. Y0", "G3 X-5 Y0 I-5", "G3 X-5 Y0 I-5"),
    ] {
        let text = format!("G21 G90 G17\nG0 Z5.5\nG0 {begin}\n{end} F600\n");
        let out = rewritten(&text, Dialect::Fanuc, &quiet(), halves);
        let tail = out.split_once(&format!("G0 {begin}\n")).unwrap().1;
        assert!(tail.starts_with(&format!("{pieces} F")), "{begin} {end}: {out}");
        assert_eq!(tail.lines().count(), pieces.lines().count(), "{begin} {end}: {out}");
    }
}

#[test]
fn where_there_is_no_room_between_numbers_a_piece_has_none() {
    // No number stands twice and none is changed: a GOTO finds the block it found before.
    let text = "N1 G21 G90\nN2 G0 X0 Y0\nN3 G1 X10 F600\nN4 X30\nN6 X50\n";
    let out = rewritten(text, Dialect::Generic, &quiet(), halves);
    let numbers: Vec<&str> =
        out.lines().filter(|line| line.starts_with('N')).map(|l| l.split(' ').next().unwrap()).collect();
    assert_eq!(numbers, ["N1", "N2", "N3", "N4", "N5", "N6"]);
    assert_eq!(out.lines().filter(|line| line.starts_with(['G', 'X'])).count(), 2, "{out}");
}

#[test]
fn increments_add_up_exactly() {
    let text = "G21 G90\nG0 X0 Y0\nG91\nG1 X10.001 Y1 F600\nG90 G1 X0 Y0\n";
    let out = rewritten(text, Dialect::Generic, &quiet(), |toolpath| {
        schedule(toolpath, |_| vec![1.0 / 3.0, 2.0 / 3.0], |_, piece| 1.0 + piece as f64)
    });
    let line = |n: usize| out.lines().nth(n).unwrap().to_owned();
    let x = |n: usize| line(n).split(' ').find_map(|w| w.strip_prefix('X')?.parse::<f64>().ok()).unwrap();
    assert!(line(3).starts_with("G1 X3.") && line(4).starts_with("G1 X3."), "{out}");
    assert_eq!(((x(3) + x(4) + x(5)) * 1000.0).round(), 10001.0, "{out}");
}

#[test]
fn arcs_are_cut_on_the_arc() {
    let text = "G21 G90 G17\nG0 X5 Y0\nG3 X-5 Y0 I-5 F600\nG2 X5 Y0 I5 J0\nG19 G3 Y5 Z-5 K-5\n";
    let out = rewritten(text, Dialect::Generic, &quiet(), halves);
    assert_eq!(out.lines().count(), 8, "{out}");
    assert!(out.contains("G3 X0 Y5 I-5 F300\nG3 X-5 Y0 I0 J-5 F1200\n"), "{out}");
    let radius = rewritten("G21 G90\nG0 X5 Y0\nG3 X0 Y5 R5 F600\n", Dialect::Generic, &quiet(), halves);
    assert!(radius.lines().nth(2).unwrap().ends_with("R5 F300") && radius.ends_with("G3 X0 Y5 R5 F1200\n"), "{radius}");
}

#[test]
fn a_circle_without_its_end_gets_it_where_it_is_cut() {
    let text = "G21 G90 G17\nG0 X8.25 Y-2 Z0\nG3 I-5 F600\nG3 Z-1 I-5\nG2 Y0. R2.\nX3 I-2.625 J0\n";
    let out = rewritten(text, Dialect::Generic, &quiet(), halves);
    let lines: Vec<&str> = out.lines().skip(2).collect();
    assert_eq!(lines[..2], ["G3 X-1.75 Y-2 I-5 F300", "G3 X8.25 Y-2 I5 J0 F1200"], "{out}");
    assert_eq!(lines[2..4], ["G3 Z-0.5 X-1.75 Y-2 I-5 F300", "G3 Z-1 X8.25 Y-2 I5 J0 F1200"], "{out}");
    assert!(lines[5].starts_with("G2 Y0. X8.25 R2."), "{out}");
    assert_eq!(lines[6..8], ["X5.625 Y-2.625 I-2.625 J0 F300", "X3 Y0.000 I0.000 J2.625 F1200"], "{out}");
    // By increments the pieces come back to where they began.
    let out = rewritten("G21 G91\nG1 X1.5 F600\nG3 I-5.\n", Dialect::Generic, &quiet(), halves);
    assert!(out.contains("G3 X-10. Y0. I-5. F300\nG3 X10. Y0. I5. J0. F1200\n"), "{out}");
    // After an expression the text does not say where it stands: the proof objects, and a run leaves such a circle whole.
    let program = parse(b"G21 G90\nG0 X[4+4] Y0\nG3 I-5 F600\n", Dialect::LinuxCnc);
    let toolpath = toolpath(&program, &surroundings(), &quiet());
    assert!(check(&program, &surroundings(), &halves(&toolpath), &quiet()).is_err());
}

#[test]
fn arcs_near_half_a_turn_by_radius_and_blocks_that_do_more_stay_whole() {
    for text in [
        "G21 G90\nG0 X5 Y0\nG3 X-4.99 Y0 R5 F600\n",
        "G21 G90\nG0 X0\nG1 X10 F600 M8\n",
        "G21 G90\nG0 X0\nG1 X10 F600 S3000\n",
        "G21 G90\nG0 X0\nG1 X[5+5] F600\n",
        "G21 G90 G61.1\nG0 X0\nG1 X10 F600\n",
        "/G1 X10 F600\n",
    ] {
        let out = rewritten(text, Dialect::LinuxCnc, &quiet(), halves);
        assert_eq!(out.lines().count(), text.lines().count(), "{out}");
    }
}

#[test]
fn untouched_text_keeps_the_feed_it_was_written_for() {
    let mut job = quiet();
    job.output.exclude = vec![(5, 6)];
    let text = "G21 G90\nG0 X0\nG1 X10 F600\nX20\nX30\nX40\nX50\n";
    let out = rewritten(text, Dialect::Generic, &job, |toolpath| {
        schedule(toolpath, |_| Vec::new(), |index, _| if [3, 4].contains(&index) { 1.0 } else { 2.0 })
    });
    assert_eq!(out, "G21 G90\nG0 X0\nG1 X10 F1200\nX20\nF600\nX30\nX40\nX50 F1200\n");
}

#[test]
fn the_feed_is_restated_before_the_unit_changes() {
    // F300 under G20 would be 7620 mm/min for what runs at the F of the text behind a program that is not there.
    let text = "G21 G90\nG0 X0 Y0\nG1 X10 F300\nG20\no1 call [3]\nG33 Z-2 K1\n";
    let out = rewritten(text, Dialect::LinuxCnc, &quiet(), scaled(2.0));
    assert!(out.contains("G1 X10 F600\nF300\nG20\n"), "{out}");
}

#[test]
fn a_thread_gets_its_pitch_feed_back_before_it() {
    let text = "G21 G90\nG0 X0 Z5\nG1 X10 F600\nG33 Z-5 K1\nG1 X20\n";
    let out = rewritten(text, Dialect::LinuxCnc, &quiet(), scaled(2.0));
    assert_eq!(out, "G21 G90\nG0 X0 Z5\nG1 X10 F1200\nF600\nG33 Z-5 K1\nG1 X20 F1200\n");
}

#[test]
fn the_feed_is_said_again_after_a_tool_change() {
    let text = "G21 G90\nT1 M6\nG0 X0\nG1 X10 F600\nG0 Z50\nT2 M6\nG0 X0\nG1 X10\n";
    let out = rewritten(text, Dialect::Generic, &quiet(), scaled(2.0));
    assert!(out.ends_with("G1 X10 F1200\nG0 Z50\nT2 M6\nG0 X0\nG1 X10 F1200\n"), "{out}");
}

#[test]
fn block_delete_is_safe_in_both_positions() {
    let text = "G21 G90\nG0 X0 Y0\nG1 X10 F600\n/X12 F100\nX20\nX30 F500\nX40\n";
    let out = rewritten(text, Dialect::Generic, &quiet(), scaled(2.0));
    let program = parse(text.as_bytes(), Dialect::Generic);
    let output = parse(out.as_bytes(), Dialect::Generic);
    for block_delete in [false, true] {
        let environment = Environment { block_delete, ..surroundings() };
        let (before, after) = (interpret(&program, &environment), interpret(&output, &environment));
        for (a, b) in before.moves.iter().zip(&after.moves).filter(|(a, _)| a.line == 4) {
            assert!((a.feed.mm_s - b.feed.mm_s).abs() < 1e-9, "the block under the switch keeps its feed\n{out}");
        }
        for motion in after.moves.iter().filter(|motion| motion.kind == MoveKind::Feed) {
            assert!(motion.feed.mm_s <= 20.0 + 1e-9, "{out}");
        }
    }
}

/// In inverse time a piece stands for the F that it would have had itself, not for that of the block it was cut from: optimised once more, F10 on a
/// tenth of the block would be a tenth of the speed. It is rounded up: three times F33.3333 would forbid the F100 that is there.
#[test]
fn a_piece_in_inverse_time_stands_for_an_f_of_its_own() {
    let out = whole("G21 G90\nG0 X0 Y0\nG93\nG1 X120 F10\nG94\nM2\n", Dialect::LinuxCnc, &job(), halves);
    assert!(out.contains("X60 F10 (FW F10 WAS 20") && out.contains("X120 F40 (FW F40 WAS 20"), "{out}");
    let third = |toolpath: &Toolpath| schedule(toolpath, |_| vec![0.3], |_, piece| if piece == 0 { 3.0 } else { 1.0 });
    let out = whole("G21 G90\nG0 X0 Y0\nG93\nG1 X100 F10\nG94\nM2\n", Dialect::LinuxCnc, &job(), third);
    assert!(out.contains("X30 F100 (FW F100 WAS 33.3334"), "{out}");
}

#[test]
fn inverse_time_and_per_revolution_keep_their_unit() {
    let text = "G21 G90\nG0 X0\nG93 G1 X10 F60\nX30 F30\nG94 G1 X40 F600\n";
    let out = rewritten(text, Dialect::LinuxCnc, &quiet(), halves);
    // 10 mm at 60/min is 10 mm/s; halves of 5 mm at 5 and 20 mm/s are 60 and 240 per minute.
    assert!(out.contains("X20 F30\nX30 F120\n"), "{out}");
    let turning = "G21 G90 S3000 M3\nG0 X0\nG95 G1 X10 F.1\nX20\n";
    let out = rewritten(turning, Dialect::LinuxCnc, &quiet(), scaled(1.5));
    assert_eq!(out, "G21 G90 S3000 M3\nG0 X0\nG95 G1 X10 F.15\nX20\n");
}

/// A control that keeps the number reads F100 in front of G95 as 100 mm per turn: it may not have become another.
#[test]
fn the_feed_is_restated_before_another_unit_of_feed_without_one() {
    for (dialect, switch) in [(Dialect::Fanuc, "G95\nG1 X20"), (Dialect::LinuxCnc, "G93\nG94\nG1 X20")] {
        let text = format!("G21 G90\nG0 X0\nG1 X10 F100\n{switch}\nX30 F.2\n");
        let out = rewritten(&text, dialect, &quiet(), scaled(2.0));
        assert!(out.contains(&format!("G1 X10 F200\nF100\n{switch}\n")), "{out}");
    }
    let stated = "G21 G90 S3000 M3\nG0 X0\nG1 X10 F100\nG95 G1 X20 F.1\n";
    let out = rewritten(stated, Dialect::Fanuc, &quiet(), scaled(2.0));
    assert_eq!(out, "G21 G90 S3000 M3\nG0 X0\nG1 X10 F200\nG95 G1 X20 F.2\n");
}

/// F of a piece in inverse time belongs to its length as written, which its rounded end changes.
#[test]
fn a_piece_in_inverse_time_is_not_faster_for_its_rounded_end() {
    for (dialect, text) in [
        (Dialect::LinuxCnc, "G21 G90\nG0 X0 Y0\nG93\nG1 X3.333 Y1.111 F60\n"),
        (Dialect::LinuxCnc, "G20 G90\nG0 X0 Y0\nG93\nG1 X0.1333 Y0.0711 F60\n"),
        (Dialect::Fanuc, "G21 G90\nG0 X0 Y0\nG93\nG1 X7 Y0 F60\n"),
    ] {
        let out = rewritten(text, dialect, &quiet(), halves);
        let path = interpret(&parse(out.as_bytes(), dialect), &surroundings());
        let cuts: Vec<_> = path.moves.iter().filter(|motion| motion.kind == MoveKind::Feed).collect();
        // F60: once a second.
        let programmed_mm_s = cuts.iter().map(|motion| motion.curve().length()).sum::<f64>();
        let ratios: Vec<f64> = cuts.iter().map(|motion| motion.feed.mm_s / programmed_mm_s).collect();
        assert!(ratios.len() == 2 && ratios[0] < 0.500_01 && ratios[1] < 2.000_01, "{ratios:?}: {out}");
        assert!(ratios[0] > 0.495 && ratios[1] > 1.98, "{ratios:?}: {out}");
    }
}

#[test]
fn a_block_executed_several_times_gets_the_lowest_feed_of_all() {
    let text = "G21 G90\nG0 X0 Y0\nF600\nM98 P5 L3\nM30\nO5\nG91 G1 X10\nG90\nM99\n";
    let out = rewritten(text, Dialect::Fanuc, &quiet(), |toolpath| {
        schedule(toolpath, |_| Vec::new(), |index, _| 3.0 - 0.5 * index as f64)
    });
    assert!(out.contains("G91 G1 X10 F"), "{out}");
    assert!(out.contains("\nF600\nM99"), "the caller gets its feed back:\n{out}");
}

#[test]
fn loops_with_computed_coordinates_get_feeds_too() {
    let programs = [
        (
            Dialect::LinuxCnc,
            "G21 G90\n#1=0\no1 repeat [3]\nG1 X[#1*10] Y5 F600\nX[#1*10+5]\n#1=[#1+1]\no1 endrepeat\nM2\n",
        ),
        (Dialect::Siemens, "G71 G90\nFOR R1=0 TO 2\nG1 X=R1*10 Y5 F600 NORM\nX=R1*10+5\nENDFOR\nM30\n"),
    ];
    for (dialect, text) in programs {
        let out = rewritten(text, dialect, &quiet(), |toolpath| {
            schedule(toolpath, |_| Vec::new(), |index, _| [0.9, 1.5, 0.7, 1.5, 0.8, 1.5][index % 6])
        });
        assert!(out.contains("Y5 F420") && !out.contains("Y5 F600"), "the least of 540, 420 and 480: {out}");
        assert!(out.matches("F900\n").count() == 1, "{out}");
    }
}

#[test]
fn arcs_by_a_named_radius_and_corners_in_a_loop_get_feeds_too() {
    let programs = [
        (
            Dialect::Siemens,
            "G71 G90 G17\nR1=0\nWHILE R1<3\nG1 X0 Y0 F600\nG2 X10 Y10 CR=10\nG2 X30 Y10 I10 J0 TURN=1\nR1=R1+1\nENDWHILE\nM30\n",
            ["CR=10 F", "TURN=1 F"],
        ),
        (
            Dialect::Fanuc,
            "G21 G90 G17\n#1=0\nWHILE [#1 LT 3] DO1\nG1 X0 Y0 F600.\nX10. ,R2.\nY10. #1=#1+1\nEND1\nM30\n",
            [",R2. F", "#1=#1+1 F"],
        ),
    ];
    for (dialect, text, places) in programs {
        let out = rewritten(text, dialect, &quiet(), |toolpath| {
            let line = |index: usize| toolpath.moves[index].line;
            schedule(toolpath, |_| Vec::new(), |index, _| [0.5, 0.6, 0.7][line(index) as usize % 3])
        });
        assert!(places.iter().all(|place| out.contains(place)), "{out}");
    }
}

#[test]
fn lines_of_grbl_stay_within_80_bytes_without_being_told() {
    let mut job = quiet();
    job.output.annotate = Annotate::Full;
    job.machine.max_line_length = None;
    let text = "G21 G90\nG0 X0 Y0 Z0\nG1 X100.000000 Y100.000000 Z10.00000000 F600 (a comment that is long enough)\n";
    let out = rewritten(text, Dialect::Grbl, &job, scaled(2.0));
    assert!(out.lines().all(|line| line.len() <= 80) && out.contains("F1200"), "{out}");
}

#[test]
fn drilling_cycles_share_one_feed() {
    let text = "G21 G90\nG0 X0 Y0 Z5\nG81 X10 Y0 Z-5 R2 F100\nX20\nX30\nG80\nG1 X0 F600\n";
    let out = rewritten(text, Dialect::LinuxCnc, &quiet(), |toolpath| {
        schedule(toolpath, |_| Vec::new(), |index, _| if index < 4 { 1.5 } else { 1.2 })
    });
    assert!(out.contains("G81 X10 Y0 Z-5 R2 F120\nX20\nX30\nG80\nG1 X0 F720\n"), "{out}");
}

#[test]
fn lines_stay_within_the_length_the_control_reads() {
    let mut job = quiet();
    job.output.annotate = Annotate::Full;
    job.machine.max_line_length = Some(40);
    let text = "G21 G90\nG0 X0 Y0 Z0\nG1 X10.000000 Y10.000000 Z10.0000000\nG1 X1 F600\nX10.00000000 Y10.00000000 Z10.0000000\n";
    let out = rewritten(text, Dialect::Generic, &job, scaled(2.0));
    assert!(out.lines().all(|line| line.len() <= 40), "{out}");
    assert!(out.contains("F1200"), "{out}");
}

#[test]
fn notes_say_what_bounds_the_feed_and_are_replaced_not_repeated() {
    let mut job = quiet();
    job.output.annotate = Annotate::Changes;
    let text = "G21 G90\nT3 M6\nG0 X0\nG1 X10 F600 (user)\nX20\n";
    let once = whole(text, Dialect::Generic, &job, scaled(2.0));
    assert!(once.contains("G1 X10 F1200 (FW F1200 WAS 600 POWER T3) (user)\nX20\n"), "{once}");
    let twice = rewritten(&once, Dialect::Generic, &job, scaled(0.75));
    assert!(twice.contains("G1 X10 F900 (FW F900 WAS 600 POWER T3) (user)\nX20\n"), "{twice}");
    let back = rewritten(&once, Dialect::Generic, &job, scaled(0.5));
    assert!(back.contains("G1 X10 F600 (user)\nX20\n"), "{back}");
}

#[test]
fn plain_language_keeps_its_line_count() {
    let text = "0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S3000\n2 L X+0 Y+0 Z+5 R0 FMAX M3\n3 L X+10 R0 F600 M8\n4 L Y+20\n5 END PGM A MM\n";
    let out = rewritten(text, Dialect::Heidenhain, &quiet(), halves);
    assert_eq!(out.lines().filter(|l| !l.is_empty()).count() + usize::from(!out.contains("2 L")), 6, "{out}");
}

/// An approach begins with the feed before it, which stays, and ends with its own, which stays in its block; what follows has a feed of its own,
/// and the departure states its own.
#[test]
fn feeds_of_a_contour_change_between_its_approach_and_its_departure() {
    let text = "0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S3000\n2 L X-20 Y+30 R0 FMAX M3\n3 L Z-5 F300\n4 APPR LT X+0 Y+30 LEN15 R0 F600\n\
                5 L X+90\n6 L Y+70\n7 DEP LT LEN20 F800\n8 L Z+50 R0 FMAX\n9 END PGM A MM\n";
    let out = rewritten(text, Dialect::Heidenhain, &quiet(), scaled(0.5));
    assert!(
        out.contains("3 L Z-5 F300\n4 APPR LT X+0 Y+30 LEN15 R0 F600\n5 L X+90 F300\n6 L Y+70\n7 DEP LT LEN20 F800\n"),
        "{out}"
    );
}

/// A corner with a feed of its own holds nothing but itself.
#[test]
fn feeds_beside_a_corner_with_its_own_feed_change() {
    let text = "0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S3000\n2 L X+0 Y+0 R0 FMAX M3\n3 L X+40 F600\n4 L Y+40\n5 RND R4 F200\n6 L X+0\n\
                7 L Z+50 R0 FMAX\n8 END PGM A MM\n";
    let out = rewritten(text, Dialect::Heidenhain, &quiet(), scaled(0.5));
    assert!(out.contains("3 L X+40 F300\n4 L Y+40\n5 RND R4 F200\n6 L X+0\n"), "{out}");
    let siemens = "G71 G90\nS3000 M3\nG0 X0 Y0 Z0\nG1 X40 F600\nY40 RND=4 FRC=200\nX0\nX10 FB=150\nX20\nM30\n";
    let out = rewritten(siemens, Dialect::Siemens, &quiet(), scaled(0.5));
    assert!(out.contains("G1 X40 F300\nY40 RND=4 FRC=200\nX0\n") && out.contains("FB=150\n"), "{out}");
}

/// Where F holds along the contour, the F that is written gives the tool centre the feed that was chosen for it.
#[test]
fn a_compensated_arc_is_written_with_the_feed_along_its_contour() {
    let text = "0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S3000 F600 DR+5\n2 L X-40 Y+0 R0 FMAX M3\n3 L X+0 Y+0 RL F600\n4 L X+30 M109\n\
                5 CR X+40 Y-10 R+10 DR- F600\n6 L Y-40\n7 L X+60 R0 FMAX\n8 END PGM A MM\n";
    let environment = Environment {
        compensation: Some(feedwright::machine::Compensation::Control),
        diameters_mm: vec![(1, 10.0)],
        ..surroundings()
    };
    let text = text.replace(" DR+5", "");
    let program = parse(text.as_bytes(), Dialect::Heidenhain);
    let path = toolpath(&program, &environment, &quiet());
    let arc = path.moves.iter().find(|motion| motion.block.0 == 5 && motion.feed.over_contour != 1.0).unwrap();
    assert!((arc.feed.over_contour - 1.5).abs() < 1e-9 && (60.0 * arc.feed.mm_s - 900.0).abs() < 1e-6, "{arc:?}");
    let asked = schedule(&path, |_| Vec::new(), |_, _| 0.5);
    let out = check(&program, &environment, &asked, &quiet()).unwrap_or_else(|why| panic!("{why}"));
    let out = String::from_utf8(out.bytes).unwrap();
    assert!(out.contains("DR- F300"), "{out}");
}

/// A rounded corner under compensation shares the F of its line: it is the one that neither the line nor its arc is too fast with.
#[test]
fn a_rounded_corner_under_compensation_shares_one_f_with_its_line() {
    let text = "G71 G90 G17\nT1 D1\nS3000 M3\nG0 X-40 Y0\nG41 G1 X0 F600\nX30 RND=10\nY-40\nG40 X60\nM30\n";
    let environment = Environment {
        compensation: Some(feedwright::machine::Compensation::Control),
        diameters_mm: vec![(1, 10.0)],
        ..surroundings()
    };
    let program = parse(text.as_bytes(), Dialect::Siemens);
    let path = toolpath(&program, &environment, &quiet());
    let corner: Vec<_> = path.moves.iter().filter(|motion| motion.block.0 == 5).collect();
    assert_eq!(corner.len(), 2, "a line and its arc: {corner:?}");
    assert!((corner[1].feed.over_contour - 1.5).abs() < 1e-9 && (60.0 * corner[1].feed.mm_s - 900.0).abs() < 1e-6);
    for (line, arc, expected) in [(0.9, 0.5, "RND=10 F300"), (0.5, 0.9, "RND=10 F300"), (0.9, 0.7, "RND=10 F420")] {
        let first = path.moves.iter().position(|motion| motion.block.0 == 5).unwrap();
        let asked = schedule(
            &path,
            |_| Vec::new(),
            |index, _| {
                if index == first {
                    line
                } else if index == first + 1 {
                    arc
                } else {
                    1.0
                }
            },
        );
        let out = check(&program, &environment, &asked, &quiet()).unwrap_or_else(|why| panic!("{why}"));
        let out = String::from_utf8(out.bytes).unwrap();
        assert!(out.contains(expected), "{line} {arc}: {out}");
    }
}
