//! `verify` must find every change that is not a feed: each test makes one.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/rewriting.rs"]
mod rewriting;

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
            let Some(at) = line.find(&format!(" {letter}")) else { continue };
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
    let bare = |line: &str| line.contains("FEEDWRIGHT") || line.contains(" kept)");
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
    let changed = rewritten().replacen("F600 (FW F600 kept)\n", "F500\n", 1);
    assert_ne!(changed, rewritten(), "{changed}");
    let proof = proof(&changed);
    assert!(proof.differences.iter().any(|d| d.text.contains("thread or probe")), "{:?}", proof.differences);
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
