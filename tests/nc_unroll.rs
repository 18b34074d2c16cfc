//! Programs unrolled into plain blocks: the text by hand, the motions against those of the original and of rs274, and what
//! is written from them still proves against the original.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/corpus.rs"]
mod corpus;
#[path = "common/rewriting.rs"]
mod rewriting;

use corpus::{canon, motions, programs, rs274_is_there, same_motions};
use feedwright::nc::{self, Dialect, Environment, Freeze};
use feedwright::rewrite::{rewrite, verify};
use rewriting::{job, parse, schedule, surroundings, toolpath};

const MACRO: &str = "%\nO1000 (PART)\nN10 G21 G90\nN20 T1 M6 S3000 M3\nN30 #1=0\nN40 WHILE [#1 LT 2] DO1\n\
    N50 G1 X[10+#1*2.5] Y#1 F[200+#1*100] (pass)\nN60 #1=#1+1\nN70 END1\nN80 M98 P2000 L2\nN90 M30\nO2000\n\
    G91 G1 Z-1. F50.\nG90\nM99\n%\n";

const PLAIN: &str = "%\nO1000 (PART)\nG21 G90\nT1 M6 S3000 M3\nG1 X10. Y0. F200. (pass)\nG1 X12.5 Y1. F300. (pass)\n\
    G91 G1 Z-1. F50.\nG90\nG91 G1 Z-1. F50.\nG90\nM30\n%\n";

#[test]
fn loops_calls_and_expressions_become_plain_blocks() {
    let program = parse(MACRO.as_bytes(), Dialect::Fanuc);
    let expanded = nc::expand(&program, &surroundings());
    assert!(expanded.obstacles.is_empty(), "{:?}", expanded.obstacles);
    assert_eq!(String::from_utf8(expanded.text).unwrap(), PLAIN);
    let linuxcnc = "o100 sub\nG1 X[#1/3] F100\no100 endsub\no101 repeat [2]\no100 call [1]\no101 endrepeat\nM2\n";
    let expanded = nc::expand(&parse(linuxcnc.as_bytes(), Dialect::LinuxCnc), &surroundings());
    assert_eq!(String::from_utf8(expanded.text).unwrap(), "G1 X0.333333333 F100\nG1 X0.333333333 F100\nM2\n");
}

#[test]
fn subprograms_of_other_files_come_in() {
    let load = |name: &str| (name == "O0007.nc").then(|| b"%\nO0007\nG1 X7. F50.\nM99\n%\n".to_vec());
    let environment = Environment { load: &load, ..Environment::default() };
    let program = parse(b"G90\nM98 P7\nG1 Y1. F80.\nM30\n", Dialect::Fanuc);
    let expanded = nc::expand(&program, &environment);
    assert_eq!(String::from_utf8(expanded.text.clone()).unwrap(), "G90\nG1 X7. F50.\nG1 Y1. F80.\nM30\n");
    let plain = parse(&expanded.text, Dialect::Fanuc);
    assert!(verify(&program, &plain, &environment).holds());
    assert!(nc::interpret(&plain, &environment).moves.iter().all(|motion| motion.freeze.is_none()));
}

#[test]
fn what_cannot_be_unrolled_is_said_with_its_place() {
    for (text, line) in [
        ("G31 Z-5. F50.\n#1=#5063\nG1 X#1\nM30\n", 2),
        ("G66 P9000\nG1 X1 F100\nG67\nM30\n", 1),
        ("N10 G91 G1 X1 F100\nGOTO 10\n", 1),
    ] {
        let environment = Environment { max_repeated_bytes: 1 << 16, ..Environment::default() };
        let expanded = nc::expand(&parse(text.as_bytes(), Dialect::Fanuc), &environment);
        assert_eq!(expanded.obstacles.first().and_then(|obstacle| obstacle.line), Some(line), "{text}");
    }
    let siemens = nc::expand(&parse(b"R1=1\nG1 X=R1 F100\nM30\n", Dialect::Siemens), &surroundings());
    assert_eq!(siemens.obstacles.len(), 1);
}

/// The unrolled macro with other feeds in every pass, some blocks cut.
fn rewritten() -> String {
    let plain = parse(PLAIN.as_bytes(), Dialect::Fanuc);
    let path = toolpath(&plain, &surroundings(), &job());
    let asked = schedule(&path, |_| vec![0.5], |index, piece| [0.5, 1.5, 1.2][(index + piece) % 3]);
    String::from_utf8(rewrite(&plain, &path, &asked, &job()).bytes).unwrap()
}

#[test]
fn an_unrolled_and_rewritten_program_proves_against_the_original() {
    let original = parse(MACRO.as_bytes(), Dialect::Fanuc);
    let good = rewritten();
    let proof = verify(&original, &parse(good.as_bytes(), Dialect::Fanuc), &surroundings());
    assert!(proof.holds() && proof.unrolled && proof.blocks_split > 1, "{:?}\n{good}", proof.differences);
    for (from, to) in [("X12.5", "X12.6"), ("(pass)", "(Pass)"), ("S3000", "S3001"), ("M30\n", ""), ("G90\n", "")] {
        assert!(good.contains(from), "{from} in\n{good}");
        let changed = parse(good.replacen(from, to, 1).as_bytes(), Dialect::Fanuc);
        assert!(!verify(&original, &changed, &surroundings()).holds(), "{from} → {to} was not found");
    }
    let one_pass_less: Vec<&str> = good.split_inclusive('\n').filter(|line| !line.contains("Z-1.")).collect();
    assert!(!verify(&original, &parse(one_pass_less.concat().as_bytes(), Dialect::Fanuc), &surroundings()).holds());
}

/// Both programs of the corpus that loop or call, and every one with expressions.
#[test]
fn unrolled_programs_of_the_corpus_do_the_same() {
    let mut unrolled = 0;
    for file in programs() {
        let program = nc::parse(std::fs::read(&file).unwrap(), None);
        if !nc::steers(&program) || program.dialect().syntax() != nc::Syntax::Rs274 {
            continue;
        }
        let expanded = nc::expand(&program, &surroundings());
        if !expanded.obstacles.is_empty() {
            println!("{}: {}", file.display(), expanded.obstacles[0].text);
            continue;
        }
        let plain = parse(&expanded.text, program.dialect());
        assert!(!nc::steers(&plain), "{}", file.display());
        let proof = verify(&program, &plain, &surroundings());
        assert!(proof.holds(), "{}: {:?}", file.display(), proof.differences);
        unrolled += 1;
        if rs274_is_there()
            && let Ok(before) = canon(program.text())
        {
            let after = canon(plain.text()).unwrap_or_else(|why| panic!("{}: rs274 refuses: {why}", file.display()));
            same_motions(&motions(&before), &motions(&after)).unwrap_or_else(|why| panic!("{}: {why}", file.display()));
        }
    }
    println!("{unrolled} programs unrolled");
    assert!(unrolled > 2 || programs().is_empty());
}

#[test]
fn computed_feeds_are_kept_or_replaced() {
    let text = "#1=300\nG1 X10. F#1\nX20. F[#1*2]\nX30.\nM98 P2 L2\nM30\nO2\n#1=#1+1\nG1 Z[-#1] F#1\nM99\n";
    let program = parse(text.as_bytes(), Dialect::Fanuc);
    let kept = toolpath(&program, &surroundings(), &job());
    assert!(kept.moves.iter().all(|motion| motion.freeze == Some(Freeze::Expression)));
    let bytes = nc::plain_feeds(&program, &surroundings(), &[]);
    let expected = text.replace("X10. F#1", "X10. F300.").replace("F[#1*2]", "F600.");
    assert_eq!(String::from_utf8(bytes.clone()).unwrap(), expected, "F of the subprogram differs between calls");
    assert_eq!(nc::plain_feeds(&program, &surroundings(), &[(2, 3)]), text.as_bytes(), "excluded lines stay");
    let plain = parse(&bytes, Dialect::Fanuc);
    let path = toolpath(&plain, &surroundings(), &job());
    assert!(path.moves[..3].iter().all(|motion| motion.freeze.is_none()));
    let asked = schedule(&path, |_| vec![0.4], |_, piece| [0.5, 1.5][piece]);
    let written = parse(&rewrite(&plain, &path, &asked, &job()).bytes, Dialect::Fanuc);
    let proof = verify(&program, &written, &surroundings());
    assert!(proof.holds() && proof.feeds_changed == 3, "{proof:?}\n{}", String::from_utf8_lossy(written.text()));
}
