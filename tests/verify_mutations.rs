//! `verify` must find every change that is not a feed: each test makes one. Seeded corruptions: 2,000 in the ordinary run,
//! `FEEDWRIGHT_LONG=N` for N of them; those that an independent interpreter judges are a tenth of that.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/draw.rs"]
mod draw;
#[path = "common/rewriting.rs"]
mod rewriting;

use draw::Draw;
use feedwright::nc::Dialect;
use feedwright::rewrite::{Proof, rewrite, verify};
use rewriting::{job, parse, schedule, surroundings, toolpath};

const ORIGINAL: &str = "%
O1000 (PART)
N10 G21 G90 G17
N20 T1 M6
N30 S3000 M3
N40 G0 X0 Y0 Z5
N50 G1 X4 Y3 Z-1 F200
N60 X30 Y10.5 F600
N70 M8
N80 G3 X20 Y20.5 I-10
N90 G91
N100 G1 X10.5 Y2.25
N110 G90
N120 G4 P0.5
N130 G33 Z5 K1.5
N140 G38.2 Z-5 F50
N150 G1 X1 Y-9.5 Z2.5 F600 (home)
N160 M9
N170 M30
%
";

/// The original rewritten: every block that may be is cut in two, with other feeds.
fn rewritten() -> String {
    let program = parse(ORIGINAL.as_bytes(), Dialect::LinuxCnc);
    let toolpath = toolpath(&program, &surroundings(), &job());
    let asked = schedule(&toolpath, |_| vec![0.5], |_, piece| [0.5, 1.5][piece]);
    String::from_utf8(rewrite(&program, &toolpath, &asked, &job()).bytes).unwrap()
}

fn proof(changed: &str) -> Proof {
    verify(
        &parse(ORIGINAL.as_bytes(), Dialect::LinuxCnc),
        &parse(changed.as_bytes(), Dialect::LinuxCnc),
        &surroundings(),
    )
}

#[track_caller]
fn found(from: &str, to: &str) -> Proof {
    let good = rewritten();
    assert!(good.contains(from), "{from:?} is not in\n{good}");
    let proof = proof(&good.replacen(from, to, 1));
    assert!(!proof.holds(), "{from:?} → {to:?} was not found in\n{good}");
    proof
}

#[test]
fn what_we_wrote_ourselves_holds() {
    let good = rewritten();
    let proof = proof(&good);
    assert!(proof.holds(), "{:?}\n{good}", proof.differences);
    // The block after the probing move begins where that touched, which is not known: it is never cut.
    assert_eq!((proof.blocks_split, proof.feeds_changed), (4, 5), "{good}");
}

#[test]
fn each_change_that_is_not_a_feed_is_found() {
    let good = rewritten();
    for (from, to) in [
        ("X30 Y10.5", "X30.001 Y10.5"),
        ("N70 M8\n", ""),
        ("(home)", "(Home)"),
        ("(PART)", "()"),
        ("K1.5", "K1.4"),
        ("Z5 K", "Z5  K"),
        ("S3000", "S3001"),
        ("T1 M6", "T2 M6"),
        ("P0.5", "P0.6"),
        ("N110 G90", "N110 G91"),
        ("N120 G4", "N121 G4"),
        ("N160 M9\nN170 M30", "N170 M30\nN160 M9"),
        ("M30\n%\n", "M30\n"),
        ("N20 T1 M6\n", "N20 T1 M6\nM8\n"),
        ("N20 T1 M6\n", "N20 T1 M6\n(FW someone)\n"),
        ("N20 T1 M6\n", "N20 T1 M6\nG1 X1 F100\n"),
        ("G3 X20", "G2 X20"),
        ("G17", "G18"),
        ("F50", "F51"),
        ("M3\n", "M3 \n"),
    ] {
        assert!(good.contains(from), "{from:?} is not in\n{good}");
        let changed = good.replacen(from, to, 1);
        assert!(!proof(&changed).holds(), "{from:?} → {to:?} was not found in\n{changed}");
    }
}

#[test]
fn differences_name_the_lines_of_both_files() {
    let proof = found("N70 M8\n", "");
    let first = &proof.differences[0];
    assert_eq!(first.original_line, Some(9));
    assert!(first.rewritten_line.is_some() && first.text.contains("missing"), "{first:?}");
}

/// Every coordinate of every line, changed in its last place.
#[test]
fn a_shifted_split_point_is_found_wherever_it_is() {
    let good = rewritten();
    let mut tried = 0;
    for (index, line) in good.lines().enumerate().filter(|(_, line)| line.starts_with('N')) {
        for letter in ['X', 'Y', 'Z', 'I', 'J', 'K'] {
            let code = line.split('(').next().unwrap();
            let Some(at) = code.find(&format!(" {letter}")) else { continue };
            let end = line[at + 1..].find(' ').map_or(line.len(), |end| at + 1 + end);
            let value: f64 = line[at + 2..end].parse().unwrap();
            let changed = format!("{} {letter}{:.3}{}", &line[..at], value + 0.003, &line[end..]);
            let text: Vec<&str> =
                good.lines().enumerate().map(|(k, l)| if k == index { changed.as_str() } else { l }).collect();
            assert!(!proof(&(text.join("\n") + "\n")).holds(), "{changed}");
            tried += 1;
        }
    }
    assert!(tried > 20, "{tried}");
}

/// Every line taken out, doubled, or swapped with the next, unless it holds nothing but what is ours. Only the first piece
/// of a straight block under G90 may go: what is left goes the same way.
#[test]
fn a_line_missing_doubled_or_moved_is_found() {
    let good = rewritten();
    let lines: Vec<&str> = good.split_inclusive('\n').collect();
    let bare = |line: &str| line.contains("FEEDWRIGHT") || line.contains(" KEPT)");
    for at in (0..lines.len()).filter(|&at| !bare(lines[at])) {
        let mut without = lines.clone();
        without.remove(at);
        let straight_piece = ["N45 ", "N55 ", "N145 "].iter().any(|number| lines[at].starts_with(number));
        assert_eq!(proof(&without.concat()).holds(), straight_piece, "without {:?}", lines[at]);
        let mut doubled = lines.clone();
        doubled.insert(at, lines[at]);
        assert!(!proof(&doubled.concat()).holds(), "twice {:?}", lines[at]);
        if at + 1 < lines.len() && !bare(lines[at + 1]) {
            let mut moved = lines.clone();
            moved.swap(at, at + 1);
            assert!(!proof(&moved.concat()).holds(), "swapped {:?}", lines[at]);
        }
    }
}

#[test]
fn feeds_of_threads_and_probes_may_not_change_even_by_way_of_a_line_before() {
    let changed = rewritten().replacen("F600 (FW F600 KEPT)\n", "F500\n", 1);
    assert_ne!(changed, rewritten(), "{changed}");
    let proof = proof(&changed);
    assert!(proof.differences.iter().any(|d| d.text.contains("thread or probe")), "{:?}", proof.differences);
}

/// A move of a rotary axis keeps its feed; so does the digit, the point and the comment form of a control.
#[test]
fn feeds_that_must_stay_and_the_manner_of_the_control_are_held() {
    let holds = |dialect, original: &str, changed: &str| {
        let read = |text: &str| parse(text.as_bytes(), dialect);
        verify(&read(original), &read(changed), &surroundings()).holds()
    };
    let rotary = "%\nO1\nG21 G90\nT1 M6\nG0 X0. Y0. Z5.\nG1 X5. A10. F600.\nG1 X9. F600.\nM30\n%\n";
    assert!(holds(Dialect::Fanuc, rotary, &rotary.replace("X9. F600.", "X9. F500.")));
    assert!(!holds(Dialect::Fanuc, rotary, &rotary.replace("A10. F600.", "A10. F500.")));
    let with = |feed: &str| rotary.replace("X9. F600.", &format!("X9. {feed}"));
    for (feed, good) in [
        ("F500. (FW F500. was 600.)", true),
        ("F500. ; FW F500. was 600.", false),
        ("F500", false),
        ("F500.5", true),
        ("F500.25", false),
        ("F0.04", true),
        ("F0.009", false),
        ("F0.000004", false),
    ] {
        assert_eq!(holds(Dialect::Fanuc, rotary, &with(feed)), good, "{feed}");
    }
}

/// What each control does with a line is more than its motion: a comment that it acts on only as the last one, a number that something jumps to
/// and comes back to, a feed behind another word, a length or a radius that comes in within the first piece.
#[test]
fn what_a_control_does_besides_moving_is_held() {
    let holds = |dialect, original: &str, changed: &str| {
        let read = |text: &str| parse(text.as_bytes(), dialect);
        verify(&read(original), &read(changed), &surroundings()).holds()
    };
    let said = "G21 G90\nT1 M6\nS3000 M3\nG0 X0 Y0 Z5\nG1 X5 F800\nX50 F800 (MSG, CHECK CLAMP)\nM2\n";
    let with = |block: &str| said.replace("X50 F800 (MSG, CHECK CLAMP)", block);
    assert!(holds(Dialect::LinuxCnc, said, &with("X50 F900 (FW F900 was 800) (MSG, CHECK CLAMP)")));
    assert!(!holds(Dialect::LinuxCnc, said, &with("X50 F900 (MSG, CHECK CLAMP) (FW F900 was 800)")));
    let steps = "%\nO1\nG21 G90\nT1 M6\nS3000 M3\nG0 X0. Y0. Z5.\nG91\nN10 G1 X50. F800.\nG90 G1 X90.\nM99 P10\n%\n";
    let cut = |number: &str| steps.replace("N10 G1 X50. F800.", &format!("G1 X20. F800.\n{number}G1 X30. F900."));
    assert!(!holds(Dialect::Fanuc, steps, &cut("N10 ")));
    let numberless = |text: &str| text.replace("N10 ", "").replace("M99 P10", "M30");
    assert!(holds(Dialect::Fanuc, &numberless(steps), &numberless(&cut(""))));
    let asked = "%\nO1\nG21 G90\nT1 M6\nS3000 M3\nG0 X0. Y0. Z5.\nG1 X5. F800.\nN50 (FW F800.)\nG1 X90.\nM30\n%\n";
    assert!(!holds(Dialect::Fanuc, asked, &asked.replace("N50 (FW F800.)\n", "")));
    let retract = "BEGIN PGM A MM\nTOOL CALL 1 Z S3000\nL X+0 Y+0 Z+5 FMAX M3\nL X+9 F400\nL X+90 M140 MB 30 F750\nEND PGM A MM\n";
    assert!(!holds(Dialect::Heidenhain, retract, &retract.replace("F750", "F850")));
}

/// What some editors put before a text is the first thing a control reads: it stays there, whatever is written in front of the code.
#[test]
fn a_byte_order_mark_stays_in_front() {
    let marked = format!("\u{feff}{}", ORIGINAL.trim_start_matches("%\nO1000 (PART)\n"));
    let read = |text: &str| parse(text.as_bytes(), Dialect::LinuxCnc);
    let written = other_feeds(&marked, Dialect::LinuxCnc);
    assert!(written.starts_with("\u{feff}N10 G21") && written.contains("FEEDWRIGHT"), "{written}");
    let holds = |text: &str| verify(&read(&marked), &read(text), &surroundings()).holds();
    assert!(holds(&written));
    let bare = written.trim_start_matches('\u{feff}');
    for moved in [bare.to_owned(), format!("(FW F600 kept)\n{written}")] {
        assert!(!holds(&moved), "{moved}");
    }
}

#[test]
fn the_same_program_holds_without_any_change() {
    let proof = proof(ORIGINAL);
    assert!(proof.holds() && proof.feeds_changed == 0 && proof.blocks_added == 0);
}

/// Programs of every dialect: original and the same with other feeds and cut blocks.
fn pairs() -> Vec<(Dialect, String, String)> {
    let iso = |head: &str, tail: &str| {
        format!(
            "{head}G21 G90 G17 G94\nT1 M6\nS3000 M3\nG0 X0. Y0. Z5.\nG1 Z-1. F200.\nX30. Y10.5 F600.\nM8\nG3 X20. Y20.5 I-10. J0.\n\
             G1 X45.5\nG4 P500\nG1 X1. Y-9.5 Z2.5 F600. (home)\nG0 Z50.\n{tail}"
        )
    };
    let subs = "M30\nO2000\nG1 X5. F100.\nM99\n";
    let siemens = "G71 G90 G17 G94\nT1\nM6\nS3000 M3\nG0 X0 Y0 Z5\nG1 Z-1 F200\nX30 Y10.5 F600\nG3 X20 Y20.5 I-10 J0\nG1 X45.5\nG4 F2\nG1 X1 Y-9.5 ; home\nG0 Z50\nM30\n";
    let plain = "0 BEGIN PGM PART MM\n1 TOOL CALL 1 Z S3000\n2 L X+0 Y+0 Z+5 R0 FMAX M3\n3 L Z-1 F200\n4 L X+30 Y+10.5 F600\n\
                 5 L X+45.5\n6 L Y-9.5\n7 L Z+50 FMAX M30\n8 END PGM PART MM\n";
    let texts = [
        (Dialect::LinuxCnc, iso("", "M30\n")),
        (Dialect::Fanuc, iso("%\nO1000\n", subs)),
        (Dialect::Haas, iso("%\nO01000\n", subs)),
        (Dialect::Grbl, iso("", "M30\n").replace("T1 M6\n", "").replace(" (home)", "")),
        (Dialect::Generic, iso("", "M30\n")),
        (Dialect::Siemens, siemens.to_owned()),
        (Dialect::Heidenhain, plain.to_owned()),
    ];
    texts.into_iter().map(|(dialect, text)| (dialect, text.clone(), other_feeds(&text, dialect))).collect()
}

fn other_feeds(text: &str, dialect: Dialect) -> String {
    let program = parse(text.as_bytes(), dialect);
    let toolpath = toolpath(&program, &surroundings(), &job());
    let asked = schedule(&toolpath, |_| vec![0.5], |_, piece| [0.5, 1.5][piece]);
    String::from_utf8(rewrite(&program, &toolpath, &asked, &job()).bytes).unwrap()
}

/// Changes at one line of a text, each of which a control would act on or reject. A line that `new`ly stands in the text may
/// have a number, end elsewhere on the path of its block and write its numbers in another way; an F may be left out, as the one
/// before it is a feed as well: those are no corruptions.
fn corruptions(line: &str, new: bool) -> Vec<String> {
    let mut out = vec![format!("/{line}"), format!("{line} M0"), format!("{line} G91")];
    if !new {
        out.push(format!("N9{line}"));
    }
    let code = line.find(['(', ';']).unwrap_or(line.len());
    for (at, letter) in line[..code].char_indices().filter(|(_, c)| c.is_ascii_uppercase()) {
        let is_digit = |c: char| c.is_ascii_digit() || ".+-".contains(c);
        let end = line[at + 1..].find(|c| !is_digit(c)).map_or(line.len(), |length| at + 1 + length);
        let number = &line[at + 1..end];
        let Ok(value) = number.parse::<f64>() else { continue };
        let put = |text: &str| format!("{}{letter}{text}{}", &line[..at], &line[end..]);
        if letter == 'F' {
            out.extend(["0", "-600", "[#1]", "2e9", "600 F700"].map(put));
            continue;
        }
        out.extend([format!("(FW F600 kept){number}"), format!("{number}(FW F600 kept)0")].map(|text| put(&text)));
        out.push(format!("{}({}){}", &line[..at], &line[at..end], &line[end..]));
        if letter == 'G' {
            out.push(put(&(value + 1.0).to_string()));
        }
        if value != 0.0 {
            out.push(put(&(-value - 1.0).to_string()));
            out.push(format!("{}{}", &line[..at], &line[end..]));
        }
        if !new {
            out.extend([format!("{number}1"), number.replace('.', "")].map(|text| put(&text)));
        }
    }
    out
}

/// Every line of every program, corrupted in every way of the list, one at a time: none may pass.
#[test]
fn no_corruption_of_any_dialect_passes() {
    let (mut tried, mut missed) = (0, Vec::new());
    for (dialect, original, good) in pairs() {
        let before = parse(original.as_bytes(), dialect);
        let holds = |text: &str| verify(&before, &parse(text.as_bytes(), dialect), &surroundings()).holds();
        assert!(holds(&good), "{}: {good}", dialect.name());
        let lines: Vec<&str> = good.lines().collect();
        let first = |line: &str| line.split([' ', '(']).take_while(|word| !word.starts_with('F')).collect::<String>();
        let known: Vec<String> = original.lines().map(first).collect();
        for (index, line) in lines.iter().enumerate() {
            for corrupted in corruptions(line, !known.contains(&first(line))) {
                let mut changed = lines.clone();
                changed[index] = &corrupted;
                let text = changed.join("\n") + "\n";
                if text == good {
                    continue;
                }
                tried += 1;
                if holds(&text) {
                    missed.push(format!("{}: {line:?} → {corrupted:?}", dialect.name()));
                }
            }
        }
    }
    println!("{tried} corruptions, {} missed", missed.len());
    assert!(tried >= 2000, "{tried}");
    assert!(missed.is_empty(), "{} of {tried}:\n{}", missed.len(), missed.join("\n"));
}

fn asked_for(ordinary: usize) -> usize {
    std::env::var("FEEDWRIGHT_LONG").ok().and_then(|text| text.parse().ok()).unwrap_or(ordinary)
}

/// Programs whose numbers, labels, jumps, calls and variables are there to be corrupted, beside those of [`pairs`].
fn rich_pairs() -> Vec<(Dialect, String, String)> {
    let fanuc = "%\nO1000\nN10 G21 G90 G17 G94 G54\nN20 T1 M6\nN30 S3000 M3\nN40 G0 X0. Y0. Z5.\nN50 G43 H1 Z2.\nN60 G1 Z-1. F200.\n\
                 N70 G64 X30. Y10.5 F600.\nN75 G61 X31.\nN80 #101=5.\nN90 IF [#101 EQ 5.] GOTO 110\nN100 G1 X99.\nN110 G3 X20. Y20.5 I-10. J0. F500.\n\
                 N120 M98 P2000\nN130 G95 G1 X25. F.2\nN140 G94 X26. F600.\nN150 G84 Z-3. R2. F1.5\nN160 G80\nN170 G31 Z-5. F50.\nN180 M0\n\
                 /N190 G1 X3. F400.\nN200 G91 G1 X1.5 Y-.5\nN210 G90\nN220 G4 P500\nN230 G28 G91 Z0.\nN240 M30\nO2000\nN1 G1 Y5. F300.\nN2 M99\nN3 Y-999.\n%\n";
    let linuxcnc = "%\nG21 G90 G17 G94 G54\nT1 M6\nS3000 M3\nG0 X0 Y0 Z5\nG1 Z-1 F200\nG64 P0.01\nX30 Y10.5 F600\no100 sub\nG1 X7 F300\no100 endsub\n\
                    o100 call\n#1 = 4\no200 if [#1 gt 3]\nG1 X8 F350\no200 endif\nG61\nG3 X18 Y20.5 I5 J5\nG93 G1 X20 F10\nG94 F500\nG33 Z-2 K1.5\nG38.2 Z-5 F50\nM48\n\
                    G18 G2 X25 Z-5 R4 F400\nG17\n/G1 X3 F400\nG4 P0.5\nG10 L2 P1 X0\nG41 D1 X9 F450\nG40 X12\nM0\nM2\n%\n";
    let siemens = "G71 G90 G17 G94 G54\nN10 T1\nN20 M6\nN30 S3000 M3\nN40 G0 X0 Y0 Z5\nN50 G1 Z-1 F200\nN60 X30 Y10.5 F600\nR1=5\nIF R1==5 GOTOF WEITER\n\
                   N70 G1 X99\nWEITER: G3 X20 Y20.5 I-10 J0\nN80 G64 G1 X45.5\nN90 G60 X44\nN100 G33 Z-2 K1.5\nN110 G4 F2\nN120 M0\nN130 G91 X1.5 F300\nN140 G90\nN150 M30\n";
    let heidenhain = "0 BEGIN PGM PART MM\n1 TOOL CALL 1 Z S3000\n2 L X+0 Y+0 Z+5 R0 FMAX M3\n3 L Z-1 F200\n4 L X+30 Y+10.5 F600\n5 CC X+30 Y+20\n\
                      6 C X+40 Y+20 DR+\n7 LBL 1\n8 L IX+1 F300\n9 LBL 0\n10 CALL LBL 1\n11 CYCL DEF 9.0 DWELL TIME\n12 CYCL DEF 9.1 DWELL 0.5\n13 M0\n\
                      14 L X+3 Y-2 F400\n15 L Z+50 FMAX M30\n16 END PGM PART MM\n";
    let texts = [
        (Dialect::Fanuc, fanuc),
        (Dialect::Haas, fanuc),
        (Dialect::LinuxCnc, linuxcnc),
        (Dialect::Siemens, siemens),
        (Dialect::Heidenhain, heidenhain),
    ];
    let rich = texts.map(|(dialect, text)| (dialect, text.to_owned(), other_feeds(text, dialect)));
    pairs().into_iter().chain(rich).collect()
}

const LINES: [&str; 24] = [
    "G91",
    "G20",
    "G18",
    "G55",
    "G61",
    "G64",
    "G93",
    "G95",
    "M48",
    "M49",
    "M0",
    "M30",
    "%",
    "G28 G91 Z0.",
    "G92 X0.",
    "G68 R45.",
    "G51 X0 Y0 P2.",
    "M98 P2000",
    "GOTO 10",
    "#101=6.",
    "G10 L2 P1 X1.",
    "G1 X3.3 F500.",
    "T2 M6",
    "S99 M4",
];
const CODES: [&str; 22] = [
    " G91",
    " G18",
    " G55",
    " M0",
    " M8",
    " (",
    "(",
    ")",
    " /",
    ";",
    " G4",
    " X1.",
    " I1.",
    " R5.",
    " #1=3",
    " P2",
    " H2",
    " D2",
    " G41",
    " G93",
    "%",
    "\u{425}5.",
];

/// A text with one thing in it that is no feed of ours made another, or `None` where the draw does not fit. `original` lists the code
/// of the lines of the original: a line that is not among them may be a piece, and those have forms of their own.
fn corrupted(good: &str, original: &[String], draw: &mut Draw) -> Option<String> {
    let mut lines: Vec<String> = good.lines().map(str::to_owned).collect();
    let at = draw.below(lines.len());
    let line = lines[at].clone();
    let is_ours = |text: &str| text.contains("FEEDWRIGHT") || text.contains("(FW ") || text.contains("; FW ");
    let known = original.contains(&bare(&line)) && !bare(&line).is_empty();
    let swap = |line: &str, from: usize, to: usize, text: &str| format!("{}{text}{}", &line[..from], &line[to..]);
    let code = line.find(['(', ';']).unwrap_or(line.len());
    match draw.below(9) {
        // A line dropped, doubled, or swapped with the next.
        0 if known => drop(lines.remove(at)),
        1 if known => lines.insert(at, line),
        2 if known => {
            let next = lines.get(at + 1)?;
            if !original.contains(&bare(next)) || bare(next) == bare(&line) || bare(next).is_empty() {
                return None;
            }
            lines.swap(at, at + 1);
        }
        3 => lines.insert(at, draw.of(&LINES).to_owned()),
        4 if code > 0 => {
            let place = draw.below(code + 1);
            lines[at] = swap(&line, place, place, draw.of(&CODES));
        }
        // One letter or digit of the code for another; feeds are what may change.
        5..=7 if known && code > 0 => {
            let place = draw.below(code);
            if line[place..].starts_with(' ') {
                return None;
            }
            let word = line[..=place].rfind(|c: char| c.is_ascii_alphabetic()).unwrap_or(0);
            if line[word..].starts_with(['F', 'f']) && !line.contains("DEF") && !line.contains("G4") {
                return None;
            }
            let other = draw.of(&[
                "0", "1", "7", "9", ".", "-", "X", "Y", "Z", "G", "I", "J", "M", "T", "S", "N", "P", "R", "K", "E", "",
                "#", "/",
            ]);
            lines[at] = swap(&line, place, place + 1, other);
        }
        // A comment of the user, or code behind what is ours.
        8 if is_ours(&line) => lines[at] = format!("{line} {}", draw.of(&["G91", "M0", "X1.", "(more) Y2."])),
        _ => return None,
    }
    let text = lines.join("\n") + "\n";
    let same = || text.lines().map(bare).filter(|l| !l.is_empty()).eq(good.lines().map(bare).filter(|l| !l.is_empty()));
    (text != good && !same()).then_some(text)
}

/// A line without blanks, F words and what is in a comment of ours: what must stay.
fn bare(line: &str) -> String {
    let ours = ["(FW ", "(FEEDWRIGHT", "; FW ", "; FEEDWRIGHT"].iter().filter_map(|mark| line.find(mark)).min();
    let code = &line[..ours.unwrap_or(line.len())];
    let words = code
        .split_whitespace()
        .filter(|word| !(word.starts_with('F') && word[1..].starts_with(|c: char| c.is_ascii_digit() || c == '.')));
    words.collect()
}

#[test]
fn seeded_corruptions_do_not_pass() {
    let wanted = asked_for(2000);
    let (mut tried, mut missed, mut draw) = (0, Vec::new(), Draw(26));
    let pairs = rich_pairs();
    let mut by_dialect = std::collections::BTreeMap::new();
    for (dialect, original, good) in &pairs {
        let before = parse(original.as_bytes(), *dialect);
        let proof = verify(&before, &parse(good.as_bytes(), *dialect), &surroundings());
        assert!(proof.holds(), "{}: {:?}\n{good}", dialect.name(), proof.differences);
    }
    while tried < wanted {
        let (dialect, original, good) = &pairs[draw.below(pairs.len())];
        let lines: Vec<String> = original.lines().map(bare).collect();
        let Some(text) = corrupted(good, &lines, &mut draw) else { continue };
        tried += 1;
        *by_dialect.entry(dialect.name()).or_insert(0) += 1;
        let before = parse(original.as_bytes(), *dialect);
        if verify(&before, &parse(text.as_bytes(), *dialect), &surroundings()).holds() {
            let changed = text.lines().zip(good.lines()).find(|(a, b)| a != b);
            missed.push(format!("{}: {changed:?}", dialect.name()));
        }
    }
    println!("{tried} seeded corruptions, {} missed; {by_dialect:?}", missed.len());
    assert!(missed.is_empty(), "{} of {tried}:\n{}", missed.len(), missed.join("\n"));
}

/// A call of rs274 without its feed.
#[derive(Debug)]
struct Call {
    text: String,
    /// Where a motion ends.
    end: Option<[f64; 3]>,
    /// Of a line: none. Of an arc in XY: centre, turns as written, and the angle it goes round, rad.
    arc: Option<([f64; 2], String, f64)>,
}

impl Call {
    /// Does the machine do the same? A centre is told from the end of the piece before, whose digits are rounded.
    fn does(&self, other: &Self) -> bool {
        match (&self.arc, &other.arc) {
            (Some((a, turn_a, round_a)), Some((b, turn_b, round_b))) => {
                let near = (a[0] - b[0]).hypot(a[1] - b[1]) < 2e-3 && (round_a - round_b).abs() < 2e-3;
                near && turn_a == turn_b && self.end == other.end
            }
            _ => self.text == other.text,
        }
    }

    /// The motion of two calls as one, where they lie on one line or go round one centre; pieces lie within half an increment
    /// (0.0005 mm) of the path, wherever along it they end.
    fn joins(&self, via: &Self, from: [f64; 3]) -> Option<f64> {
        let (middle, to) = (via.end?, self.end?);
        if let (Some((a, turn_a, round_a)), Some((b, turn_b, round_b))) = (&via.arc, &self.arc) {
            let apart = (a[0] - b[0]).hypot(a[1] - b[1]);
            return (apart < 2e-3 && turn_a == turn_b && middle[2] == from[2] && to[2] == from[2])
                .then_some(round_a + round_b);
        }
        let lines = [via, self].iter().all(|call| call.text.starts_with("STRAIGHT_FEED"));
        let [u, v] = [[middle, from], [to, middle]].map(|[to, from]| [0, 1, 2].map(|k| to[k] - from[k]));
        let norm = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let dot: f64 = u.iter().zip(v).map(|(a, b)| a * b).sum();
        (lines && dot >= 0.0 && norm(cross) <= 2e-3 * norm(u).max(norm(v))).then_some(0.0)
    }
}

/// What rs274 makes of a text: its calls without feeds, lines and arcs cut into pieces joined again; `None`: it refuses the text.
fn by_rs274(text: &str, folder: &std::path::Path) -> Option<Vec<Call>> {
    std::fs::write(folder.join("p.ngc"), text).unwrap();
    let mut control = std::process::Command::new("rs274");
    let output = control.current_dir(folder).args(["-g", "-n", "2", "-v", "rs.var", "p.ngc"]).output().unwrap();
    if !output.status.success() {
        return None;
    }
    // Where each call begins.
    let mut calls: Vec<(Call, [f64; 3])> = Vec::new();
    let mut at = [0.0; 3];
    for row in String::from_utf8_lossy(&output.stdout).lines() {
        let text = row.split_whitespace().skip(2).collect::<Vec<_>>().join(" ");
        let Some((name, rest)) = text.split_once('(') else { continue };
        if ["COMMENT", "SET_FEED_RATE", "MESSAGE"].contains(&name) {
            continue;
        }
        let numbers: Vec<f64> = rest.trim_end_matches(')').split(',').filter_map(|n| n.trim().parse().ok()).collect();
        let (end, arc) = match name {
            "STRAIGHT_FEED" | "STRAIGHT_TRAVERSE" => (Some([numbers[0], numbers[1], numbers[2]]), None),
            "ARC_FEED" => {
                let centre = [numbers[2], numbers[3]];
                let angle = |x: f64, y: f64| (y - centre[1]).atan2(x - centre[0]);
                let turn = angle(numbers[0], numbers[1]) - angle(at[0], at[1]);
                let round = (numbers[4].signum() * turn - 1e-6).rem_euclid(std::f64::consts::TAU) + 1e-6;
                (Some([numbers[0], numbers[1], numbers[5]]), Some((centre, numbers[4].to_string(), round)))
            }
            _ => (None, None),
        };
        let mut call = Call { text: text.clone(), end, arc };
        let mut from = at;
        if let Some((before, start)) = calls.last()
            && let Some(round) = call.joins(before, *start)
        {
            from = *start;
            if let Some(arc) = &mut call.arc {
                arc.2 = round;
            }
            calls.pop();
        }
        at = end.unwrap_or(at);
        calls.push((call, from));
    }
    Some(calls.into_iter().map(|(call, _)| call).collect())
}

/// Bytes changed anywhere in what was written for LinuxCNC: whatever its own interpreter does otherwise, or refuses, must be found.
#[test]
#[cfg_attr(absent_rs274, ignore = "rs274 is not installed")]
fn what_rs274_does_otherwise_does_not_pass() {
    let wanted = asked_for(800) / 10;
    let folder = tempfile::tempdir().unwrap();
    let (dialect, original) = (Dialect::LinuxCnc, pairs().swap_remove(0).1);
    let good = other_feeds(&original, dialect);
    let before = parse(original.as_bytes(), dialect);
    let does = by_rs274(&good, folder.path()).expect("rs274 reads it");
    assert!(does.len() > 10);
    let (mut judged, mut same, mut missed, mut draw) = (0, 0, Vec::new(), Draw(274));
    while judged < wanted {
        let mut bytes = good.clone().into_bytes();
        let at = draw.below(bytes.len());
        let new = draw.of(b"0123456789.-+XYZIJKFGMNSTPR()/;%# \n");
        match draw.below(3) {
            0 => bytes[at] = new,
            1 => bytes.insert(at, new),
            _ => drop(bytes.remove(at)),
        }
        let text = String::from_utf8(bytes).unwrap();
        judged += 1;
        let holds = verify(&before, &parse(text.as_bytes(), dialect), &surroundings()).holds();
        let theirs = by_rs274(&text, folder.path());
        let alike = |theirs: &Vec<Call>| theirs.len() == does.len() && theirs.iter().zip(&does).all(|(a, b)| a.does(b));
        if theirs.as_ref().is_some_and(alike) {
            same += 1;
        } else if holds {
            let changed = text.lines().zip(good.lines()).find(|(a, b)| a != b);
            missed.push(format!("{changed:?}"));
        }
    }
    println!("{judged} changes judged by rs274: {same} the same, {} of the others missed", missed.len());
    assert!(missed.is_empty(), "{} of {judged}:\n{}", missed.len(), missed.join("\n"));
}

/// A block number stands at the beginning of a block: LinuxCNC refuses `G1 N9000 X30`, wherever the point lies.
#[test]
fn a_piece_with_a_number_behind_its_first_word_is_found() {
    let good = rewritten();
    let piece = good.lines().find(|line| line.starts_with("N45 G1 ")).unwrap();
    let late = good.replace(piece, &piece.replace("N45 G1 ", "G1 N45 "));
    assert!(proof(&good).holds() && !proof(&late).holds(), "{late}");
}

/// What is written where something beside the feed could be taken for it, or where no line may be put: the proof holds, and some feed is another.
#[test]
fn what_is_written_beside_other_uses_of_f_holds() {
    let iso = |middle: &str| {
        format!(
            "G21 G90 G17 G94\nT1 M6\nS3000 M3\nG0 X0. Y0. Z5.\nG1 Z-1. F200.\nX30. F600.\n{middle}\nG1 X45. F600.\nG0 Z50.\nM30\n"
        )
    };
    let plain = |middle: &str| {
        let text = format!(
            "BEGIN PGM PART MM\nTOOL CALL 1 Z S3000\nL X+0 Y+0 Z+5 R0 FMAX M3\nL Z-1 F200\nL X+30 F600\n{middle}\nL X+45 F500\n\
             L Z+50 FMAX M30\nEND PGM PART MM"
        );
        text.lines().enumerate().map(|(number, line)| format!("{number} {line}\n")).collect::<String>()
    };
    for (dialect, text) in [
        (Dialect::Fanuc, iso("G41 D1 X40.\nY20.\nM9\nY40.\nM77\nX50.\nG40 X60.")),
        (Dialect::Fanuc, iso("G41 D1 X40.\nY20.\n#1=0\nWHILE [#1 LT 2] DO1\nY40.\nY20.\n#1=#1+1\nEND1\nG40 X60.")),
        (Dialect::Fanuc, iso("G41 D1 X40.\nY20.\nM98 P5\nG40 X60.").replace("M30\n", "M30\nO5\nG1 Y30.\nM99\n")),
        (Dialect::Fanuc, iso("G41 D1 X40.\nM9\nY20. ,R3.\nX60.\nG40 X70.")),
        (Dialect::Siemens, iso("G4 F1\nMYSUB\nG1 X35. F600.").replace("M6\n", "\nM6\n")),
        (Dialect::Siemens, iso("G4 F1\nX=35 Y=R5")),
        (Dialect::Heidenhain, plain("L X+31 M103 F20\nL X+32\nL X+40 F500")),
        (Dialect::Heidenhain, plain("L X+31 FU0.1\nL X+32\nL X+40 F500")),
        (Dialect::Heidenhain, plain("RND R2 F100\nL Y+20\nL X+Q5\nL X+40 F500")),
        (Dialect::Heidenhain, plain("CYCL DEF 1.0 PECKING\nCYCL DEF 1.5 F150\nL X+Q5\nL X+40 F500")),
    ] {
        let good = other_feeds(&text, dialect);
        let proof = verify(&parse(text.as_bytes(), dialect), &parse(good.as_bytes(), dialect), &surroundings());
        assert!(proof.holds() && proof.feeds_changed > 0, "{}: {:?}\n{good}", dialect.name(), proof.differences);
    }
    let titled = format!("%\nO1000 (DRILL AND TAP)\n{}%\n", iso("X35."));
    assert_ne!(other_feeds(&titled, Dialect::Fanuc), titled, "the title names no tap");
}
