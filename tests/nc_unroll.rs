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
    let expanded = nc::unroll(&program, &surroundings());
    assert!(expanded.obstacles.is_empty(), "{:?}", expanded.obstacles);
    assert_eq!(String::from_utf8(expanded.text).unwrap(), PLAIN);
    let linuxcnc = "o100 sub\nG1 X[#1/3] F100\no100 endsub\no101 repeat [2]\no100 call [1]\no101 endrepeat\nM2\n";
    let expanded = nc::unroll(&parse(linuxcnc.as_bytes(), Dialect::LinuxCnc), &surroundings());
    assert_eq!(String::from_utf8(expanded.text).unwrap(), "G1 X0.333333333 F100\nG1 X0.333333333 F100\nM2\n");
}

#[test]
fn subprograms_of_other_files_come_in() {
    let load = |name: &str| (name == "O0007.nc").then(|| b"%\nO0007\nG1 X7. F50.\nM99\n%\n".to_vec());
    let environment = Environment { load: &load, ..Environment::default() };
    let program = parse(b"G90\nM98 P7\nG1 Y1. F80.\nM30\n", Dialect::Fanuc);
    let expanded = nc::unroll(&program, &environment);
    assert_eq!(String::from_utf8(expanded.text.clone()).unwrap(), "G90\nG1 X7. F50.\nG1 Y1. F80.\nM30\n");
    let plain = parse(&expanded.text, Dialect::Fanuc);
    assert!(verify(&program, &plain, &environment).holds());
    assert!(nc::interpret(&plain, &environment).moves.iter().all(|motion| motion.freeze.is_none()));
}

#[test]
fn what_cannot_be_unrolled_is_said_with_its_place() {
    for (text, line) in [
        ("G31 Z-5. F50.\n#1=#5063\nG1 X#1\nM30\n", 2),
        // A branch must not be folded on a value that only the control knows, whatever its number.
        ("IF [#500 EQ 1] GOTO 50\nM0\nN50 G1 X1. F100.\nM30\n", 1),
        ("G90\nIF [#105 EQ 0] GOTO 50\nM0\nN50 G1 X1. F100.\nM30\n", 2),
        ("G90\nG1 X1. F100.\nIF [#1 EQ #0] GOTO 50\nM0\nN50 X2.\nM30\n", 3),
        ("#2=1\n#1=#[#2+99]\nG1 X#1 F100.\nM30\n", 2),
        ("G1 X1. F#501\nM30\n", 1),
        // What an assignment does in the control must not vanish: a stop with a message, an alarm, an offset.
        ("#1=1\nIF [#1 EQ 1] THEN #3006=1\nG1 X1. F100.\nM30\n", 2),
        ("#3000=7\nM30\n", 1),
        // #500 to #999 outlast the program: the next one may rely on them.
        ("G1 X1. F100.\n#500=1\nM30\n", 2),
        ("#1=2\nG1 X#1 F100.\n#999=#1\nM30\n", 3),
        ("#1=1\nIF [#1 EQ 1] M0\nG1 X1. F100.\nM30\n", 2),
        ("G1 X1. F100.\n#1=2\nDPRNT[X#1[33]]\nM30\n", 3),
        ("G66 P9000\nG1 X1 F100\nG67\nM30\n", 1),
        ("N10 G91 G1 X1 F100\nGOTO 10\n", 1),
    ] {
        let environment = Environment { max_repeated_bytes: 1 << 16, ..Environment::default() };
        let expanded = nc::unroll(&parse(text.as_bytes(), Dialect::Fanuc), &environment);
        assert_eq!(expanded.obstacles.first().and_then(|obstacle| obstacle.line), Some(line), "{text}");
    }
    for (dialect, text, line) in [
        (Dialect::LinuxCnc, "o1 if [#105 EQ 1]\nM0\no1 endif\nG1 X1 F100\nM2\n", 1),
        (Dialect::LinuxCnc, "M66 P0 L0\no1 if [#5399 EQ 1]\nM0\no1 endif\nM2\n", 2),
        (Dialect::LinuxCnc, "#5221=3\nG1 X1 F100\nM2\n", 1),
        (Dialect::Siemens, "G1 X1 F100\nIF R5==1 GOTOF L1\nM0\nL1:\nX2\nM30\n", 2),
        (
            Dialect::Heidenhain,
            "0 BEGIN PGM A MM\n1 FN 9: IF +Q5 EQU +0 GOTO LBL 1\n2 STOP\n3 LBL 1\n4 END PGM A MM\n",
            2,
        ),
        (Dialect::Siemens, "R1=$AA_IM[X]\nG1 X=R1 F100\nM30\n", 1),
        (Dialect::Siemens, "MCALL HOLE(1)\nX1\nMCALL\nM30\n%_N_HOLE_SPF\nG1 Z-1 F100\nM17\n", 1),
        (Dialect::Siemens, "ELSEWHERE: G1 X1 F100\nGOTOB ELSEWHERE\n", 1),
        (Dialect::Siemens, "L77\nM30\n", 1),
        (Dialect::Siemens, "POCKET3(R1,_ZSD[1])\nR1=1\nM30\n", 1),
        (Dialect::Heidenhain, "0 BEGIN PGM A MM\n1 L X+Q115 F100\n2 END PGM A MM\n", 2),
        (Dialect::Heidenhain, "0 BEGIN PGM A MM\n1 CALL PGM B\n2 END PGM A MM\n", 2),
    ] {
        let environment = Environment { max_repeated_bytes: 1 << 16, ..Environment::default() };
        let expanded = nc::unroll(&parse(text.as_bytes(), dialect), &environment);
        assert_eq!(expanded.obstacles.first().and_then(|obstacle| obstacle.line), Some(line), "{text}");
    }
}

#[test]
fn variables_that_end_with_the_program_are_left_out() {
    for (text, dialect, plain) in [
        ("#499=1.5\nG1 X#499 F100.\nM30\n", Dialect::Fanuc, "G1 X1.5 F100.\nM30\n"),
        ("#500=1.5\nG1 X#500 F100\nM2\n", Dialect::LinuxCnc, "G1 X1.5 F100\nM2\n"),
    ] {
        let expanded = nc::unroll(&parse(text.as_bytes(), dialect), &surroundings());
        assert!(expanded.obstacles.is_empty(), "{:?}", expanded.obstacles);
        assert_eq!(String::from_utf8(expanded.text).unwrap(), plain);
    }
}

/// Libraries of subroutines as LinuxCNC and Macro B have them: arguments that may be left out, defaults, globals, numbers from
/// 1000 on, values handed back, and messages with values in them.
#[test]
fn libraries_of_subroutines_become_plain_blocks() {
    let text = "o<row> sub\n#1001=[#1 * 2]\no1 if [#2 EQ 0]\n#2 = 3\no1 endif\n(DEBUG, row #1 of #<_rows>, %d#1001)\n\
        G1 X[#1001] Y#2 F200\no<row> endsub [#1001 + 1]\no<many> sub\no2 repeat [#1]\no<row> call [#<_value>]\n\
        o2 endrepeat\no<many> endsub\n#<_rows> = 2 (MSG, now #1)\no<row> call [1]\no<many> call [#<_rows>]\nM2\n";
    let expected = "(DEBUG, row 1.000000 of 2.000000, %d2)\n";
    let expected = format!(
        "(MSG, now #1)\n{expected}G1 X2 Y3 F200\n{}G1 X6 Y3 F200\n{}G1 X14 Y3 F200\nM2\n",
        expected.replace("row 1", "row 3").replace("%d2", "%d6"),
        expected.replace("row 1", "row 7").replace("%d2", "%d14")
    );
    unrolls(Dialect::LinuxCnc, text, &surroundings(), &expected);
    if rs274_is_there() {
        let said = |text: &str| {
            let canon = canon(text.as_bytes()).unwrap();
            canon
                .lines()
                .filter_map(|line| line.split_once("MESSAGE"))
                .map(|(_, said)| said.to_owned())
                .collect::<Vec<_>>()
        };
        assert_eq!(said(text), said(&expected));
        assert_eq!(said(text).len(), 4);
    }
    let macro_b = "G90 G0 X0. Y0.\nG65 P9010 X5. D2.\nG65 P9010 X5.\nM30\nO9010\nIF [#7 NE #0] GOTO 5\n#7=1.\nN5 G1 X[#24+#7] F80.\nM99\n";
    let plain = "G90 G0 X0. Y0.\nG1 X7. F80.\nG1 X6. F80.\nM30\n";
    unrolls(Dialect::Fanuc, macro_b, &surroundings(), plain);
}

/// Unrolls a program, holds the text against the one expected, and its motions and the proof against the original.
#[track_caller]
fn unrolls(dialect: Dialect, text: &str, environment: &Environment<'_>, expected: &str) {
    let program = parse(text.as_bytes(), dialect);
    let expanded = nc::unroll(&program, environment);
    assert!(expanded.obstacles.is_empty(), "{:?}", expanded.obstacles);
    assert_eq!(String::from_utf8(expanded.text.clone()).unwrap(), expected);
    let plain = parse(&expanded.text, dialect);
    assert!(nc::has_flow_control(&program, environment) && !nc::has_flow_control(&plain, environment));
    let [before, after] = [&program, &plain].map(|program| nc::interpret(program, environment));
    assert!(before.diagnostics.is_empty() && after.diagnostics.is_empty(), "{:?}", before.diagnostics);
    assert_eq!(before.moves.len(), after.moves.len());
    for (a, b) in before.moves.iter().zip(&after.moves) {
        let off = (a.curve().to() - b.curve().to()).amax().max((a.curve().length() - b.curve().length()).abs());
        assert!(off < 1e-4 && a.kind == b.kind && a.tool == b.tool && a.spin == b.spin && b.instance == 0);
        assert!((a.feed.mm_s - b.feed.mm_s).abs() < 1e-6);
    }
    let path = toolpath(&plain, environment, &job());
    let asked = schedule(&path, |_| vec![0.5], |index, piece| [0.5, 1.5, 1.2][(index + piece) % 3]);
    let written = parse(&rewrite(&plain, &path, &asked, &job()).bytes, dialect);
    let proof = verify(&program, &written, environment);
    assert!(proof.holds() && proof.unrolled && proof.feeds_changed > 1, "{:?}", proof.differences);
}

#[test]
fn siemens_structures_calls_and_repeats_become_plain_blocks() {
    let text = "%_N_PART_MPF\n;$PATH=/_N_WKS_DIR\nDEF REAL DEEP=-2, FEEDR=200\nN10 G17 G90 NORM\nN20 S3000 M3 ; (on)\n\
        N30 FOR R1=1 TO 2\nN40 G1 X=R1*2.5 Y=IC(R1) F=FEEDR+R1*100\nN50 ENDFOR\nR2=0\nWHILE R2<2\nR2=R2+1\n\
        G3 X=R2 CR=R2*20\nENDWHILE\nAGAIN:\nR2=R2-1\nG1 Z=DEEP-R2 RND=0.1*5\nIF R2>0 GOTOB AGAIN\nX20\n\
        L10 P2\nROW(30, 1)\nFIRST: G1 X1 F100\nLAST: X2\nX3\nREPEAT FIRST LAST P=2\nREPEATB LAST\n\
        MSG(\"PASS \"<<R2)\nTRANS X=R2+5\nAROT RPL=R2+45\nX7 Y0\nTRANS\n  X1\nCYCLE81(R2+10,0,2,-8)\nM30\n%_N_L10_SPF\nG91 G1 Z-1 F50\nG90\nM17\n\
        %_N_ROW_SPF\nPROC ROW(REAL AT, INT N, INT MORE=2)\nX=AT Y=N+MORE\nRET\n";
    let sub = "G91 G1 Z-1 F50\nG90\n";
    let expected = format!(
        "%_N_PART_MPF\n;$PATH=/_N_WKS_DIR\nG17 G90 NORM\nS3000 M3 ; (on)\nG1 X2.5 Y=IC(1) F300\nG1 X5 Y=IC(2) F400\n\
        G3 X1 CR=20\nG3 X2 CR=40\nG1 Z-3 RND=0.5\nG1 Z-2 RND=0.5\nX20\n{sub}{sub}X30 Y3\nG1 X1 F100\nX2\nX3\n\
        G1 X1 F100\nX2\nG1 X1 F100\nX2\nX2\nTRANS X5\nAROT RPL=45\nX7 Y0\nTRANS\n  X1\nCYCLE81(10,0,2,-8)\nM30\n"
    );
    unrolls_quietly(text, &expected);
}

/// A corner that does not fit is said; the rest must be quiet.
#[track_caller]
fn unrolls_quietly(text: &str, expected: &str) {
    let without = |text: &str| text.replace(" RND=0.1*5", "").replace(" RND=0.5", "");
    unrolls(Dialect::Siemens, &without(text), &surroundings(), &without(expected));
    let expanded = nc::unroll(&parse(text.as_bytes(), Dialect::Siemens), &surroundings());
    assert_eq!(String::from_utf8(expanded.text).unwrap(), expected);
}

#[test]
fn labels_calls_and_parameters_of_plain_language_become_plain_blocks() {
    let text = "0 BEGIN PGM PART MM\n1 TOOL CALL 1 Z S3000 F500\n2 Q1 = +5 * 2\n3 FN 0: Q2 = +300\n4 LBL 1\n\
        5 L IX+Q1 R0 FQ2 M8\n6 Q1 = Q1 - 4\n7 CALL LBL 1 REP 1\n8 CYCL DEF 200 DRILLING ~\nQ200=2 ~\nQ201=-Q1 ~\n\
        Q206=150 ~\nQ202=5 ~\nQ203=+0 ~\nQ204=50\n9 CALL LBL \"ROW\"\n10 CC X+0 Y+0\n11 LP PR+Q2 PA-Q1\n\
        12 FN 12: IF +Q1 LT +3 GOTO LBL 7\n13 L X+99\n14 LBL 7\n15 CALL PGM DEEP\n16 L Z+100 R0 FMAX M30\n\
        17 LBL \"ROW\"\n18 L X+20 FMAX M99\n19 LBL 0\n20 END PGM PART MM\n";
    let load =
        |name: &str| (name == "deep.h").then(|| b"0 BEGIN PGM DEEP MM\n1 L Z-Q1 F80\n2 END PGM DEEP MM\n".to_vec());
    let environment = Environment { load: &load, ..Environment::default() };
    let expected = "0 BEGIN PGM PART MM\n1 TOOL CALL 1 Z S3000 F500\n2 L IX+10 R0 F300 M8\n3 L IX+6 R0 F300 M8\n\
        4 CYCL DEF 200 DRILLING ~\nQ200=2 ~\nQ201=-2 ~\nQ206=150 ~\nQ202=5 ~\nQ203=+0 ~\nQ204=50\n5 L X+20 FMAX M99\n\
        6 CC X+0 Y+0\n7 LP PR+300 PA-2\n8 L Z-2 F80\n9 L Z+100 R0 FMAX M30\n10 END PGM PART MM\n";
    unrolls(Dialect::Heidenhain, text, &environment, expected);
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
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn unrolled_programs_of_the_corpus_do_the_same() {
    let mut unrolled = 0;
    for file in programs() {
        let program = nc::parse(std::fs::read(&file).unwrap(), None);
        if !nc::has_flow_control(&program, &surroundings()) || program.dialect().syntax() != nc::Syntax::Rs274 {
            continue;
        }
        let expanded = nc::unroll(&program, &surroundings());
        if !expanded.obstacles.is_empty() {
            println!("{}: {}", file.display(), expanded.obstacles[0].text);
            continue;
        }
        let plain = parse(&expanded.text, program.dialect());
        assert!(!nc::has_flow_control(&plain, &surroundings()), "{}", file.display());
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
    assert!(unrolled > 2);
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
