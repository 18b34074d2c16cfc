//! Bad programs: each fault is diagnosed with its line and its bytes, the rest of the program is still read, and nothing
//! panics, hangs or grows without bound.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use feedwright::nc::{self, Dialect, Environment, Toolpath};

fn read(text: &[u8]) -> Toolpath {
    nc::interpret(&nc::parse(text.to_vec(), None), &Environment::default())
}

/// The program has one fault of this code, on this line, over these bytes; the last motion ends at X5.
fn assert_fault(text: &str, code: &str, line: u32, bytes: &str) {
    let path = read(text.as_bytes());
    let found = path.diagnostics.iter().find(|d| d.code == code);
    let fault = found.unwrap_or_else(|| panic!("{text:?}: no {code} in {:?}", path.diagnostics));
    assert_eq!(fault.line, Some(line), "{text:?}");
    let span = fault.span.unwrap();
    assert_eq!(String::from_utf8_lossy(span.of(text.as_bytes())), bytes, "{text:?}");
    assert_eq!(path.moves.last().unwrap().curve().to().x, 5.0, "{text:?}: the rest is read");
}

#[test]
fn each_fault_is_shown_and_the_rest_is_read() {
    let cases = [
        ("G1 F100\nX[1+2\nX5\n", "nc::not-understood", 2, "X[1+2"),
        ("G1 F100\nX1]\nX5\n", "nc::not-understood", 2, "]"),
        ("G1 F100\nX--3\nX5\n", "nc::not-understood", 2, "X--3"),
        ("G1 F100\nX.\nX5\n", "nc::not-understood", 2, "X."),
        ("G1 F100\nX1e400\nX5\n", "nc::unknown-word", 2, "e400"),
        ("G1 F100\nX1\0\nX5\n", "nc::not-understood", 2, "\0"),
        ("G1 F100 X1\nG2 X2 Y0 R0.1\nG1 X5\n", "nc::arc", 2, "G2"),
        ("G1 F100 X1\nG2 X2 Y0\nG1 X5\n", "nc::arc", 2, "G2"),
        ("G1 F100 X1\nG3 X2 Y9 I1 J0\nG1 X5\n", "nc::arc", 2, "G3"),
        ("G1 F100\nG555 X1\nX5\n", "nc::unknown-g", 2, "G555"),
        ("G1 F100\nX1 X2\nX5\n", "nc::repeated-word", 2, "X2"),
        ("X1\nG1 F100 X5\n", "nc::no-motion", 1, "X1"),
        ("G1 F100 X1 (never closed\nX5\n", "nc::open-comment", 1, "(never closed"),
        ("G1 F100\nX[1/0]\nX5\n", "nc::expression", 2, "X[1/0]"),
        ("G1 F100\nX#<nowhere>\nX5\n", "nc::expression", 2, "X#<nowhere>"),
        ("G1 F100\nM98 P77\nX5\n", "nc::no-routine", 2, "M98"),
        ("G1 F100 X1\nG81 X3 Z-1\nG1 X5\n", "nc::cycle", 2, "G81"),
        ("G1 F-3 X1\nX5\n", "nc::feed-not-positive", 1, "F-3"),
        ("G93 G1 F100 X1\nX2\nG94 F100 X5\n", "nc::inverse-time", 2, "X2\n"),
        ("G7\nG1 F100 X5\n", "nc::lathe", 1, "G7"),
    ];
    for (text, code, line, bytes) in cases {
        assert_fault(text, code, line, bytes);
    }
}

#[test]
fn programs_without_end_are_stopped() {
    let endless = [
        "N10 G91 G1 X1 F100\nGOTO 10\n",
        "O1 sub\nO1 call\nO1 endsub\nO1 call\nM2\n",
        "M98 P5\nM30\nO5\nM98 P5\nM99\n",
        "#1=1\nWHILE [#1 EQ 1] DO1\nEND1\n",
        "o1 repeat [1000000000]\nG91 G1 X1 F1\no1 endrepeat\n",
        "o1 while [1]\no1 endwhile\n",
    ];
    for text in endless {
        let program = nc::parse(text.as_bytes().to_vec(), None);
        let path = nc::interpret(&program, &Environment { max_repeated_bytes: 1 << 20, ..Environment::default() });
        assert!(path.diagnostics.iter().any(|d| d.code == "nc::runaway"), "{text:?}: {:?}", path.diagnostics);
        assert!(path.moves.len() < 100_000);
    }
}

#[test]
fn hostile_text_takes_linear_time() {
    let million = 1_000_000;
    let hostile: Vec<Vec<u8>> = vec![
        vec![b'['; million],
        vec![b'('; million],
        vec![b'#'; million],
        vec![b'-'; million],
        vec![b'9'; million],
        b"X[".repeat(million / 2),
        b"- ".repeat(million / 2),
        b"()(".repeat(million / 3),
        b"G1 X1 ".repeat(million / 6),
        b"#1=#1+".repeat(million / 6),
        [b"#1=".to_vec(), vec![b'['; 10_000], b"1".to_vec(), vec![b']'; 10_000]].concat(),
        [vec![b'A'; million], b"\n".to_vec()].concat(),
        vec![0; million],
        b"\r".repeat(million),
    ];
    for text in hostile {
        for dialect in Dialect::ALL {
            let program = nc::parse(text.clone(), Some(dialect));
            let path = nc::interpret(&program, &Environment::default());
            assert!(path.diagnostics.len() < 2_000, "diagnostics are bounded");
        }
    }
}

#[test]
fn faults_in_blocks_that_are_not_executed_are_shown_too() {
    let path = read(b"GOTO 20\nX--3\nN20 G1 F100 X5\nM30\nO7\nX.\nM99\n%\n:-) not code\n");
    let lines: Vec<_> = path.diagnostics.iter().filter(|d| d.code == "nc::not-understood").map(|d| d.line).collect();
    assert_eq!(lines, [Some(2), Some(6)], "{:?}", path.diagnostics);
}

#[test]
fn long_lines_deep_nesting_and_missing_tools_are_placed_exactly() {
    let long = format!("G1 F100 {}X5 $\nX5\n", "X1 ".repeat(333_000));
    let fault = read(long.as_bytes()).diagnostics.into_iter().find(|d| d.code == "nc::not-understood").unwrap();
    assert_eq!((fault.line, fault.span.unwrap().of(long.as_bytes())), (Some(1), &b"$"[..]));
    let program = nc::parse(long.clone().into_bytes(), None);
    assert_eq!(program.block_at(fault.span.unwrap().start).0, 0);
    let deep = format!("#1={}1{}\nG1 F100 X5\n", "[".repeat(10_000), "]".repeat(10_000));
    let path = read(deep.as_bytes());
    assert_eq!(path.diagnostics[0].code, "nc::expression");
    assert!(path.diagnostics[0].text.contains("nested") && path.moves.len() == 1, "{:?}", path.diagnostics);
}

#[test]
fn a_fault_is_said_once_and_in_its_own_words() {
    for (word, said) in
        [("X--5", "X has no number"), ("y.", "Y has no number"), ("X[1+[2", "brackets"), ("Z3]", "brackets")]
    {
        let path = read(format!("G1 F100\n{word}\nX5\n").as_bytes());
        let found: Vec<_> = path.diagnostics.iter().filter(|d| d.code == "nc::not-understood").collect();
        assert!(matches!(found.as_slice(), [one] if one.text.contains(said)), "{word}: {found:?}");
    }
}
