//! Arbitrary bytes, and real programs with bytes changed: nothing panics, tokens tile the text, a program without new
//! feeds comes back byte for byte, and what is written proves against what was read.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/rewriting.rs"]
mod rewriting;

use feedwright::nc::{self, Dialect, Environment, Program, Syntax};
use feedwright::rewrite::{rewrite, verify};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rewriting::{job, schedule, toolpath, unchanged};

/// Lines of ISO programs, loops and calls among them.
const ISO: [&str; 43] = [
    "G1 X9 ,R1.",
    "G1 Y9 ,C1.",
    "G1 X1.5 Y-2 F300",
    "G0 Z5",
    "X3",
    "G2 X1 Y1 R5",
    "G3 X0 Y0 I1 J1",
    "G91",
    "G90",
    "G20",
    "G21",
    "G93 G1 X5 F2",
    "G94 F100",
    "G95 F0.1",
    "S1000 M3",
    "T2 M6",
    "G41 D1",
    "G40",
    "G81 X1 Z-5 R2",
    "G83 Z-9 R1 Q2",
    "G80",
    "G33 Z-2 K1",
    "#1=#1+1",
    "G1 X#1 F[#1*10]",
    "IF [#1 LT 5] GOTO 10",
    "N10 G1 X1",
    "WHILE [#1 LT 3] DO1",
    "END1",
    "M98 P7",
    "O7",
    "M99",
    "o1 sub",
    "o1 endsub",
    "o1 call [3]",
    "o2 repeat [2]",
    "o2 endrepeat",
    "/G1 X7 F50",
    "%",
    "(note)",
    "; note",
    "G68 X0 Y0 R30",
    "G10 L2 P1 X5",
    "G92 X0",
];
/// Lines of plain language.
const PLAIN: [&str; 20] = [
    "APPR LCT X+5 Y+5 R2 RL F200",
    "APPR CT X+5 Y+5 CCA90 R+2 RR F200",
    "APPR LT X+5 Y+5 LEN3 R0",
    "DEP LCT X+9 Y+9 R2",
    "DEP LN LEN3 F300",
    "L X+3 Y+7 RL",
    "L Z+Q1 FQ2",
    "LP PR+Q1 PA+30",
    "CHF 0.5",
    "L X+5 Y+2 R0 FMAX",
    "LBL 1",
    "CALL LBL 1 REP 2/2",
    "L X+10 F500",
    "CC X+0 Y+0",
    "C X+5 Y+5 DR+",
    "CP IPA+90 DR-",
    "RND R1",
    "CYCL DEF 200",
    "Q1=Q1+1",
    "FN 12: IF +Q1 LT +3 GOTO LBL 1",
];
/// What Siemens adds to ISO.
const SIEMENS: [&str; 16] = [
    "HERE: G1 X3",
    "REPEAT HERE P=2",
    "REPEATB HERE",
    "GOTOB HERE",
    "CASE R1 OF 1 GOTOF HERE DEFAULT GOTOB HERE",
    "L10 P2",
    "%_N_L10_SPF",
    "M17",
    "FOR R1=1 TO 3",
    "ENDFOR",
    "G1 X=R1*2 F=R2",
    "CIP X5 Y5 I1=2 J1=3",
    "CT X7 Y7",
    "ROT RPL=45",
    "G1 X9 RND=2",
    "MCALL CYCLE81(5,0,1,-3)",
];

fn environment() -> Environment<'static> {
    Environment { max_repeated_bytes: 1 << 14, max_depth: 8, ..Environment::default() }
}

/// The whole way of a text in one dialect.
fn go_through(text: &[u8], dialect: Dialect, seed: u64) -> Result<(), TestCaseError> {
    let program = nc::parse(text.to_vec(), Some(dialect));
    tiles(&program)?;
    let environment = environment();
    let path = toolpath(&program, &environment, &job());
    for diagnostic in &path.diagnostics {
        let (line, span) = (diagnostic.line, diagnostic.span);
        prop_assert!(line.is_none_or(|line| line as usize <= program.len().max(1)), "{diagnostic:?}");
        prop_assert!(
            span.is_none_or(|span| span.start <= span.end && span.end as usize <= text.len()),
            "{diagnostic:?}"
        );
    }
    let same = rewrite(&program, &path, &unchanged(&path), &job());
    prop_assert_eq!(&same.bytes[..], text);
    if path.diagnostics.iter().any(|d| d.code == "nc::runaway") {
        return Ok(()); // where an endless program is stopped depends on its bytes
    }
    let factor = |index: usize, piece: usize| [0.5, 1.0, 1.5, 0.8][(index + piece + seed as usize) % 4];
    let asked = schedule(&path, |index| if index % 3 == 0 { vec![0.5] } else { Vec::new() }, factor);
    let written = rewrite(&program, &path, &asked, &job());
    let output = nc::parse(written.bytes, Some(dialect));
    let proof = verify(&program, &output, &environment);
    prop_assert!(proof.holds(), "{:?}\n{}\n→\n{}", proof.differences, show(text), show(output.text()));
    // Unrolled text that does not prove is refused by the command; here it must only not panic.
    let plain = nc::parse(nc::unroll(&program, &environment).text, Some(dialect));
    verify(&program, &plain, &environment);
    Ok(())
}

fn show(text: &[u8]) -> String {
    String::from_utf8_lossy(text).into_owned()
}

fn tiles(program: &Program) -> Result<(), TestCaseError> {
    let mut at = 0;
    for block in program.blocks() {
        for token in program.tokens(block) {
            prop_assert_eq!(token.span.start, at);
            prop_assert!(token.span.end > at);
            at = token.span.end;
        }
    }
    prop_assert_eq!(at as usize, program.text().len());
    Ok(())
}

fn dialects() -> impl Strategy<Value = Dialect> {
    prop::sample::select(Dialect::ALL.to_vec())
}

/// Lines that the dialect may have, in any order, a byte of some of them changed.
fn mixed(dialect: Dialect) -> impl Strategy<Value = Vec<u8>> {
    let known: Vec<&str> = match dialect.syntax() {
        Syntax::Rs274 => ISO.to_vec(),
        Syntax::Siemens => [&ISO[..], &SIEMENS].concat(),
        Syntax::Heidenhain => PLAIN.to_vec(),
    };
    let line =
        (prop::sample::select(known), proptest::option::weighted(0.1, (any::<prop::sample::Index>(), any::<u8>())));
    proptest::collection::vec(line, 1..30).prop_map(|lines| {
        let mut text = Vec::new();
        for (line, change) in lines {
            let mut line = line.as_bytes().to_vec();
            if let Some((at, byte)) = change {
                let at = at.index(line.len());
                line[at] = byte;
            }
            text.extend(line);
            text.push(b'\n');
        }
        text
    })
}

/// A corner asked for in a block that cannot be read is asked of nothing: a feed put in behind it changes no motion.
#[test]
fn a_corner_of_a_block_that_cannot_be_read_is_dropped() {
    let text = b"o1{sub\nG1 X1.5 Y-2 F300\n 1 X9 ,R1.\nN10 G1 X1\nG1 X9 ,R1.\n";
    for seed in 0..4 {
        go_through(text, Dialect::Generic, seed).unwrap();
    }
}

/// An F in a block that cannot be read is no feed: before a thread the original's is stated again.
#[test]
fn a_feed_in_a_block_that_cannot_be_read_is_not_in_force() {
    let text = b"G1 X1.5 Y-2 F300\nN10 G1 X1\nG1 X1.5 Y-2 F300\n 93 G1 X5 F2\nG33 Z-2 K1\n";
    for seed in 0..4 {
        go_through(text, Dialect::LinuxCnc, seed).unwrap();
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: RngSeed::Fixed(20260), ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_bytes(text in proptest::collection::vec(any::<u8>(), 0..300), dialect in dialects(), seed in any::<u64>()) {
        go_through(&text, dialect, seed)?;
    }

    #[test]
    fn bytes_of_the_alphabet_of_programs(
        text in proptest::collection::vec(prop::sample::select(&b"GXYZIJKRFSTMNOPLQD0123456789.-+#[]()<>=/%;:* \n\r\t\"IFWHLEDOsubcal"[..]), 0..200),
        dialect in dialects(),
        seed in any::<u64>(),
    ) {
        go_through(&text, dialect, seed)?;
    }

    #[test]
    fn lines_of_programs_with_a_byte_changed_here_and_there((dialect, text) in dialects().prop_flat_map(|dialect| (Just(dialect), mixed(dialect))), seed in any::<u64>()) {
        go_through(&text, dialect, seed)?;
    }
}
