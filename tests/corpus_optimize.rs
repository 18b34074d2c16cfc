//! The main job on six real programs: every limit met in the simulation of the written file, proof clean, rs274 reads the
//! same motions, and a second run changes next to nothing.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/corpus.rs"]
mod corpus;

use std::path::Path;
use std::sync::Mutex;

use corpus::{LISTED, canon, motions, rs274_is_there, same_motions, shared};
use feedwright::job::{Keep, Task, Wanted, Watch, optimize};
use feedwright::machine::Raise;
use feedwright::nc::{self, Dialect, Doubt, Environment, Program};
use feedwright::outcome::LIMIT_TOLERANCE;
use feedwright::outcome::ProgramRun;
use feedwright::{engage, rewrite, setup};

/// One at a time: each run uses every core already.
static ONE: Mutex<()> = Mutex::new(());

fn run(program: Program, setup_file: &Path) -> ProgramRun {
    let text = std::fs::read_to_string(setup_file).unwrap();
    let (mut job, assumptions) = setup::load(&text, setup_file.parent().unwrap()).unwrap();
    // As many feeds as possible change: that is what reading back and the second run are tried on.
    job.raise = Raise::ALL;
    // Botomata sets the origin of G55 at its head and before each part of its work, which its setup does not vouch for.
    job.confirmed = vec![Doubt::ZeroShift.name()];
    if assumptions.iter().any(|assumed| assumed.key == "limits.feed_change.max") {
        job.limits.feed_change_max = Some(2.0);
    }
    let watch = Watch {
        progress: &|_, _| (),
        clock: &|| 0.0,
        subprograms: &|_| None,
        engage: engage::Options::default(),
        keep: Keep::default(),
    };
    optimize(Task { program, job, assumptions, wanted: Wanted::default() }, &watch).unwrap()
}

fn dialect_of(setup_file: &Path) -> Option<Dialect> {
    let text = std::fs::read_to_string(setup_file).unwrap();
    let (job, _) = setup::load(&text, setup_file.parent().unwrap()).unwrap();
    job.machine.dialect.as_deref().and_then(Dialect::from_name)
}

/// The whole acceptance of one program.
fn accept(name: &str) {
    let (file, setup_name) = LISTED.iter().find(|(_, setup)| *setup == name).unwrap();
    let [path, setup_file] =
        [(*file).to_owned(), format!("programs/setups/{setup_name}.toml")].map(|file| shared(&file).unwrap());
    let _alone = ONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let text = std::fs::read(path).unwrap();
    let dialect = dialect_of(&setup_file);
    let first = run(nc::parse(text.clone(), dialect), &setup_file);
    let written = first.written.as_ref().unwrap();
    assert!(written.check.identical, "{:?}", written.check.differences);
    assert!(
        written.check.over.free_ratio <= LIMIT_TOLERANCE,
        "a load reaches {} of its limit",
        written.check.over.free_ratio
    );

    // The proof once more, by itself, on a control that knows nothing of the setup.
    let output = nc::parse(written.bytes.clone(), dialect);
    let proof = rewrite::verify(&first.program, &output, &Environment::default());
    assert!(proof.holds(), "{:?}", proof.differences);
    assert!(proof.feeds_changed > 0 && rewrite::is_ours(&output));

    if rs274_is_there() {
        let before = canon(&text).expect("rs274 takes the original");
        let after = canon(&written.bytes).expect("rs274 takes the rewritten program");
        same_motions(&motions(&before), &motions(&after)).unwrap();
    }

    let second = run(output, &setup_file);
    let again = second.written.as_ref().unwrap();
    let stats = &again.stats;
    let changed = stats.f_words_changed + stats.f_words_inserted + stats.blocks_added;
    assert!(100 * changed < stats.f_words_before, "{changed} of {} F values change", stats.f_words_before);
    assert!(again.check.identical && again.check.over.free_ratio <= LIMIT_TOLERANCE);
    let marks = |bytes: &[u8]| bytes.windows(10).filter(|window| window == b"FEEDWRIGHT").count();
    assert_eq!(marks(&again.bytes), 1, "our mark is there once");
    println!(
        "{name}: {:.1} s → {:.1} s, worst {:.4}, {} F words, a second run changes {changed}",
        first.realised_before.total_s,
        written.realised_after.total_s,
        written.check.over.free_ratio,
        written.stats.f_words_after
    );
}

#[test]
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn camotics_bear() {
    accept("camotics_bear");
}

#[test]
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn camotics_botomata_bottom() {
    accept("camotics_botomata_bottom");
}

#[test]
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn camotics_tiger() {
    accept("camotics_tiger");
}

#[test]
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn ledfloor_1121_btn8() {
    accept("ledfloor_1121_btn8");
}

#[test]
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn maestro_parallel() {
    accept("maestro_PARALLEL");
}

#[test]
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn nist_box_op1() {
    accept("box_op1");
}
