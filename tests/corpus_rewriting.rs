//! Every program of the corpus under hard schedules: feeds that change in every block and inside it. The output proves, does
//! what was asked, comes back unchanged from a second run, and rs274 reads the same motions in it.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/corpus.rs"]
mod corpus;
#[path = "common/rewriting.rs"]
mod rewriting;

use corpus::{LISTED, canon, motions, programs, same_motions, shared};
use feedwright::machine::Annotate;
use feedwright::nc::{self, Environment, Program};
use feedwright::rewrite::rewrite;
use rewriting::{check, job, schedule, surroundings, toolpath, unchanged};

fn everything() -> Vec<std::path::PathBuf> {
    let mut files = programs();
    files.extend(LISTED.iter().map(|(file, _)| shared(file).unwrap()));
    for own in ["programs", "tests/nc"] {
        let entries = std::fs::read_dir(own).unwrap().map(|entry| entry.unwrap().path());
        files.extend(entries.filter(|file| file.extension().is_some_and(|ending| ending == "nc" || ending == "ngc")));
    }
    files.sort();
    files.dedup();
    files
}

fn read(file: &std::path::Path) -> Program {
    nc::parse(std::fs::read(file).unwrap(), None)
}

#[test]
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn feeds_as_programmed_give_back_every_byte() {
    for file in everything() {
        let program = read(&file);
        let toolpath = toolpath(&program, &surroundings(), &job());
        let result = rewrite(&program, &toolpath, &unchanged(&toolpath), &job());
        assert!(result.bytes == program.text(), "{} came back changed", file.display());
    }
}

/// Feeds that jump from block to block, every seventh block in three pieces.
fn hard(program: &Program, environment: &Environment<'_>, annotate: Annotate) -> Result<Vec<u8>, String> {
    let mut job = job();
    job.output.annotate = annotate;
    let toolpath = toolpath(program, environment, &job);
    let long = |index: usize| toolpath.moves[index].curve().length() > 3.0;
    let cuts = |index: usize| if index % 7 == 3 && long(index) { vec![0.31, 0.62] } else { Vec::new() };
    let asked = schedule(&toolpath, cuts, |index, piece| [0.4, 1.0, 0.8, 1.7, 1.0][(index / 2 + piece) % 5]);
    check(program, environment, &asked, &job).map(|rewritten| rewritten.bytes)
}

#[test]
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn hard_schedules_prove_on_every_program() {
    let mut wrong = Vec::new();
    for file in everything() {
        let program = read(&file);
        for annotate in [Annotate::None, Annotate::Changes] {
            if let Err(why) = hard(&program, &surroundings(), annotate) {
                wrong.push(format!("{}: {}", file.display(), why.chars().take(600).collect::<String>()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n---\n"));
}

#[test]
#[cfg_attr(any(absent_shared, absent_rs274), ignore = "rs274 or ../shared is not there")]
fn rs274_reads_the_same_motions_in_what_was_written() {
    let mut read_alike = 0;
    let mut wrong = Vec::new();
    for file in everything() {
        let program = read(&file);
        let Ok(before) = canon(program.text()) else { continue };
        let Ok(written) = hard(&program, &surroundings(), Annotate::Changes) else { continue };
        let after = canon(&written).map_err(|why| format!("rs274 refuses: {why}"));
        if let Err(why) = after.and_then(|after| same_motions(&motions(&before), &motions(&after))) {
            wrong.push(format!("{}: {why}", file.display()));
        }
        read_alike += 1;
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(read_alike > 10, "only {read_alike} programs were compared");
}
