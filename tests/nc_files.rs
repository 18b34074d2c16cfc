//! Subprograms in files beside the program: rewritten beside the output and never over the originals, with the largest feed
//! that is safe in every call; read back and proved like the program itself.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/rewriting.rs"]
mod rewriting;

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use feedwright::nc::{self, Dialect, Environment, Freeze, MoveKind};
use feedwright::rewrite;
use tempfile::TempDir;

const SETUP: &str = "resolution = 0.5\n[machine]\ndialect = \"linuxcnc\"\n[stock]\nbox = { min = [0, 0, -10], max = [40, 20, 0] }\n\
    [material]\nk_tc = 800\nk_te = 14\n[[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 6\nflutes = 3\noverhang = 30\n\
    [raise]\nplunges = true\nramps = true\nentries = true\nfinishing = true\ncompensation = true\ncycles = true\n[limits]\nfeed_change = { max = 2.0 }\nforce_xy = 60\n";
const HEAD: &str = "G21 G90\nT1 M6\nS8000 M3\n";
/// A slot as wide as the tool, and a cut of half a millimetre along the edge of the stock.
const SLOT: &str = "G0 Z2\nX-10 Y10\nZ-2\no<pass> call [60]\n";
const SIDE: &str = "G0 Z2\nX-10 Y-2.5\nZ-2\no<pass> call [60]\n";
const PASS: &str = "o<pass> sub\n(one pass)\nG1 F600\nX50 (through)\no<pass> endsub\nM2\n";

/// A folder with a program, its setup, its subprogram, and an empty folder for the output.
fn bench(calls: &str) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    fs::write(at.join("part.ngc"), format!("{HEAD}{calls}G0 Z10\nM2\n")).unwrap();
    fs::write(at.join("part.setup.toml"), SETUP).unwrap();
    fs::write(at.join("pass.ngc"), PASS).unwrap();
    fs::create_dir(at.join("out")).unwrap();
    dir
}

/// Exit code, and both outputs of a command in a folder.
fn run(dir: &Path, arguments: &[&str]) -> (i32, String) {
    let output = Command::cargo_bin("feedwright").unwrap().current_dir(dir).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout) + &text(&output.stderr))
}

fn read(dir: &Path, name: &str) -> String {
    String::from_utf8(fs::read(dir.join(name)).unwrap()).unwrap()
}

/// The lowest F of a written subprogram before it restores the one it has been given.
fn feed(text: &str) -> f64 {
    let mut words = text.lines().filter(|line| !line.contains("KEPT")).filter_map(|line| {
        let code = line.split('(').next().unwrap();
        code.split_whitespace().find_map(|word| word.strip_prefix('F')?.parse::<f64>().ok())
    });
    words.next_back().unwrap()
}

fn optimized(calls: &str) -> (TempDir, f64) {
    let dir = bench(calls);
    let (code, said) = run(dir.path(), &["optimize", "part.ngc", "-o", "out/part.ngc"]);
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("pass.ngc"), "{said}");
    let feed = feed(&read(dir.path(), "out/pass.ngc"));
    (dir, feed)
}

#[test]
fn a_file_called_twice_gets_the_feed_that_is_safe_in_both_calls() {
    let (_, slot) = optimized(SLOT);
    let (_, side) = optimized(SIDE);
    let (dir, both) = optimized(&[SLOT, SIDE].concat());
    assert!(slot < 0.8 * side, "{slot} {side}");
    assert_eq!(both, slot);
    let at = dir.path();
    assert_eq!(read(at, "pass.ngc"), PASS, "the original is left alone");
    assert_eq!(
        nc::parse(read(at, "out/part.ngc").into_bytes(), Some(Dialect::LinuxCnc)).own_text(),
        fs::read(at.join("part.ngc")).unwrap()
    );
    // The proof covers the file: it holds, and breaks when a length in it is changed.
    let (code, said) = run(at, &["verify", "part.ngc", "out/part.ngc"]);
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("run at another feed") && !said.contains(" 0 run at another feed"), "{said}");
    fs::write(at.join("out/pass.ngc"), read(at, "out/pass.ngc").replace("X50", "X51")).unwrap();
    let (code, said) = run(at, &["verify", "part.ngc", "out/part.ngc"]);
    assert_eq!(code, 1, "{said}");
    assert!(said.contains("pass.ngc, line 4"), "{said}");
}

#[test]
fn beside_the_originals_a_file_keeps_its_feeds() {
    let dir = bench(SLOT);
    let at = dir.path();
    let (code, said) = run(at, &["optimize", "part.ngc", "--json", "report.json"]);
    // What stays is above its limit: written, and said.
    assert_eq!(code, 1, "{said}");
    assert!(said.contains("keep the programmed feed"), "{said}");
    assert!(said.contains("the feeds of pass.ngc stay") && said.contains("another folder"), "{said}");
    assert_eq!(read(at, "pass.ngc"), PASS);
    assert!(read(at, "report.json").contains("subprogram in another file"));
    assert_eq!(fs::read_dir(at.join("out")).unwrap().count(), 0);
}

#[test]
fn what_is_not_ours_is_not_replaced() {
    let dir = bench(SLOT);
    let at = dir.path();
    let output = ["optimize", "part.ngc", "-o", "out/part.ngc"];
    fs::write(at.join("out/pass.ngc"), "(mine)\n").unwrap();
    let (code, said) = run(at, &output);
    assert_eq!(code, 2, "{said}");
    assert!(said.contains("pass.ngc exists and was not written by Feedwright"), "{said}");
    assert_eq!(read(at, "out/pass.ngc"), "(mine)\n");
    assert!(!at.join("out/part.ngc").exists(), "nothing is written");
    assert_eq!(run(at, &[&output[..], &["--force"]].concat()).0, 0);
    let first = read(at, "out/pass.ngc");
    assert_eq!(run(at, &output).0, 0, "our own files are replaced");
    assert_eq!(read(at, "out/pass.ngc"), first);
    // A link to the original is the original.
    fs::remove_file(at.join("out/pass.ngc")).unwrap();
    fs::hard_link(at.join("pass.ngc"), at.join("out/pass.ngc")).unwrap();
    let (code, said) = run(at, &[&output[..], &["--force"]].concat());
    assert_eq!(code, 2, "{said}");
    assert!(said.contains("is an input and is never overwritten"), "{said}");
    assert_eq!(read(at, "pass.ngc"), PASS);
}

#[test]
#[cfg_attr(absent_rs274, ignore = "rs274 is not installed")]
fn the_control_reads_what_was_written() {
    let (dir, feed) = optimized(&[SLOT, SIDE].concat());
    let out = dir.path().join("out");
    let ini = "[RS274NGC]\nSUBROUTINE_PATH = .\nPARAMETER_FILE = rs274.var\n[TRAJ]\nLINEAR_UNITS = mm\n[EMCIO]\nTOOL_TABLE = t.tbl\n\
        [DISPLAY]\nPROGRAM_PREFIX = .\n";
    fs::write(out.join("rs274.ini"), ini).unwrap();
    fs::write(out.join("t.tbl"), "T1 P1 D6\n").unwrap();
    let mut control = std::process::Command::new("rs274");
    control.current_dir(&out).args(["-g", "-n", "2", "-i", "rs274.ini", "-t", "t.tbl", "-v", "rs274.var", "part.ngc"]);
    let output = control.output().unwrap();
    let canon = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{canon}{}", String::from_utf8_lossy(&output.stderr));
    // The rate in force at each cut.
    let (mut rate, mut rates) = (0.0, Vec::new());
    for line in canon.lines() {
        if let Some((_, number)) = line.split_once("SET_FEED_RATE(") {
            rate = number.trim_end_matches(')').parse::<f64>().unwrap();
        } else if line.contains("STRAIGHT_FEED(50") {
            rates.push(rate);
        }
    }
    assert!(rates.len() == 2 && rates.iter().all(|rate| (rate - feed).abs() < 1e-3), "{rates:?} {feed}");
}

/// Name and text of a file.
type Named = (&'static str, &'static [u8]);

/// Programs with the files they call, by dialect.
fn programs() -> Vec<(Dialect, &'static [u8], Vec<Named>)> {
    let fanuc: &[u8] = b"%\r\nO0001\r\nG21 G90 G0 X0 Y0 Z0\r\nG1 X50. F500.\r\nM98 P0007\r\nG1 X90.\r\nM98 P20008\r\nY50.\r\nM30\r\n%\r\n";
    let seven: &[u8] = b"%\r\nO0007 (T\xe4sche)\r\nG1 Y20. F300.\r\nX20.\r\nM99\r\n%";
    let eight: &[u8] = b"O0008\nG91 G1 Z-30. F100.\nX40.\nG90\nM98 P7\nM99\n";
    let spf: &[u8] = b"G1 X30 F200\nY40\nM17\n";
    let open: &[u8] = b"G1 X30 F200\nX70";
    let plain: &[u8] = b"0 BEGIN PGM SUB MM\n1 L X+60 F700\n2 L Y+60\n3 END PGM SUB MM\n";
    vec![
        (Dialect::Fanuc, fanuc, vec![("O0007.nc", seven), ("8.nc", eight)]),
        (Dialect::Siemens, b"G0 X0 Y0 Z0\nG1 X90 F900\nL20\nG1 X0\nY0\nM30\n", vec![("L20.SPF", spf)]),
        (Dialect::Haas, b"G0 X0. Y0. Z0.\nG1 X90. F900.\nM98 P5\nX0.\nY30.\nM30\n", vec![("O00005.nc", open)]),
        (
            Dialect::Heidenhain,
            b"0 BEGIN PGM A MM\n1 L X+0 Y+0 Z+0 R0 FMAX\n2 L X+50 F500\n3 CALL PGM SUB.H\n4 L X+0 F400\n5 END PGM A MM\n",
            vec![("SUB.H", plain)],
        ),
    ]
}

#[test]
fn files_are_rewritten_as_the_program_is() {
    let job = rewriting::job();
    for (dialect, text, files) in programs() {
        let load = |name: &str| files.iter().find(|(file, _)| *file == name).map(|(_, text)| text.to_vec());
        let environment = Environment { load: &load, ..Environment::default() };
        let (program, path) = nc::linked(&rewriting::parse(text, dialect), &environment);
        assert_eq!(program.files().len(), files.len(), "{dialect:?}: {:?}", path.diagnostics);
        assert!(path.moves.iter().all(|motion| motion.freeze != Some(Freeze::OtherFile)));
        assert!(path.moves.iter().all(|motion| motion.line as usize <= program.own_len()));
        // Nothing asked, nothing changed, byte for byte.
        let same = rewrite::rewrite(&program, &path, &rewriting::unchanged(&path), &job);
        assert_eq!(same.bytes, text);
        assert_eq!(same.files.iter().map(|(name, text)| (name.as_str(), text.as_slice())).collect::<Vec<_>>(), files);
        // Every move another feed, in pieces: what is written says so, and what follows a call runs as it should.
        let frozen = rewriting::toolpath(&program, &environment, &job);
        for seed in 0..40 {
            let factor = |index: usize, piece: usize| 0.4 + ((index * 7 + piece * 3 + seed * 11) % 13) as f64 / 10.0;
            let cuts = |index: usize| if (index + seed).is_multiple_of(3) { vec![0.5] } else { Vec::new() };
            let schedule = rewriting::schedule(&frozen, cuts, factor);
            let written = rewriting::check(&program, &environment, &schedule, &job)
                .unwrap_or_else(|why| panic!("{dialect:?}, seed {seed}: {why}"));
            let changed =
                |(name, text): &(String, Vec<u8>)| files.iter().any(|(file, old)| file == name && old != text);
            let rewritten = written.files.iter().any(changed);
            let free = frozen
                .moves
                .iter()
                .any(|m| m.block.ix() >= program.own_len() && m.freeze.is_none() && m.kind == MoveKind::Feed);
            assert_eq!(rewritten, free, "{dialect:?}, seed {seed}");
        }
    }
}
