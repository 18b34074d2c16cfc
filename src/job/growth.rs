//! How much a program may grow. In: the program and `output.max_growth`. Out: the options of the schedule, and a schedule whose text keeps to
//! the bound.
//!
//! The schedule counts lines and words with their usual lengths. If the resulting text is longer than allowed, the bound is reduced in proportion
//! and the schedule is solved again.

use super::task::{JobError, SPACING_MM};
use super::{limit_use, worn};
use crate::machine::{Annotate, Job};
use crate::nc::Program;
use crate::outcome::ProgramRun;
use crate::rewrite::{self, Rewritten};
use crate::schedule::{Growth, Options, Schedule};

/// Largest ratio of output to input where the setup gives none, in blocks and in bytes. Controls with little memory are fed over a line, and
/// the others have megabytes; a program four times as long can still be read by people.
const MAX_GROWTH: f64 = 4.0;
/// The same for a program that Feedwright has written before, which has grown already.
const OURS_MAX_GROWTH: f64 = 1.01;
/// Bytes that any program may have where the setup says nothing: 160 m of tape at ten characters to the inch, a usual part
/// memory of milling controls that have little.
const LEAST_BYTES: f64 = 63_000.0;
/// Bytes of a block with its F word and note, to turn those bytes into blocks.
const BLOCK_BYTES: f64 = 50.0;
/// Bytes of an F word.
const WORD_BYTES: f64 = 7.0;
/// Bytes of the note beside it.
const NOTE_BYTES: f64 = 34.0;
/// Bytes and blocks of the mark of the file.
const MARK_BYTES: f64 = 40.0;
/// Most times that the schedule is solved again because its text is too long.
const AGAIN: usize = 3;

/// Blocks and bytes that the output may have.
fn most(program: &Program, job: &Job) -> [f64; 2] {
    let [blocks, bytes] = [program.len() as f64, program.text().len() as f64];
    let ours = if rewrite::is_ours(program) { OURS_MAX_GROWTH } else { f64::INFINITY };
    let growth = job.output.max_growth.unwrap_or(MAX_GROWTH).min(ours);
    let least_bytes = if job.output.max_growth.is_none() { LEAST_BYTES } else { 0.0 };
    [(growth * blocks).max(least_bytes / BLOCK_BYTES), (growth * bytes).max(least_bytes)]
}

/// The options of the first round. In a program that Feedwright has written before a word costs twice as much, and no stretch shorter than two
/// stations is raised: with other stations, a word that the earlier run left out may seem to save slightly more than its price, and the end of
/// a cut may differ by a station. So a second run changes nothing.
pub fn options(run: &ProgramRun) -> Options {
    let (program, job) = (&run.program, &run.job);
    let mut options = Options::of(&run.toolpath);
    if rewrite::is_ours(program) {
        (options.word_s, options.block_s) = (2.0 * options.word_s, 2.0 * options.block_s);
        options.least_rise_mm = 2.0 * SPACING_MM[0];
    }
    let [blocks, bytes] = [program.len() as f64, program.text().len() as f64];
    let [most_blocks, most_bytes] = most(program, job);
    let word_bytes = WORD_BYTES + if job.output.annotate == Annotate::None { 0.0 } else { NOTE_BYTES };
    options.room = Some(Growth {
        blocks: (most_blocks - blocks - 1.0).max(0.0),
        bytes: (most_bytes - bytes - MARK_BYTES).max(0.0),
        word_bytes,
        block_bytes: word_bytes + bytes / blocks.max(1.0),
    });
    options
}

/// Schedule and text of one round, and the seconds that either took.
pub type Round = (Schedule, Rewritten, [f64; 2]);

/// A schedule whose text keeps to what it may grow by, or comes as near as [`AGAIN`] tries bring it.
pub fn schedule_within_growth(
    run: &mut ProgramRun,
    fresh: Option<&worn::Fresh>,
    options: &mut Options,
    clock: &dyn Fn() -> f64,
) -> Result<Round, JobError> {
    let mut spent_s = [0.0; 2];
    let mut again = 0;
    loop {
        let start = clock();
        let schedule = worn::feeds(run, fresh, options)?;
        spent_s[0] += clock() - start;
        let (schedule, rewritten, [_, write_s]) = text_of_schedule(run, schedule, clock);
        spent_s[1] += write_s;
        let over = over(run, &rewritten);
        match &mut options.room {
            Some(room) if over > 1.0 && again < AGAIN => {
                (room.blocks, room.bytes) = (room.blocks / over, room.bytes / over);
                again += 1;
            }
            _ => return Ok((schedule, rewritten, spent_s)),
        }
    }
}

/// The text of a schedule, however long.
pub fn text_of_schedule(run: &ProgramRun, mut schedule: Schedule, clock: &dyn Fn() -> f64) -> Round {
    let start = clock();
    limit_use::tell(run, &mut schedule.pieces);
    let rewritten = rewrite::rewrite(&run.program, &run.toolpath, &schedule, &run.job);
    (schedule, rewritten, [0.0, clock() - start])
}

/// What the text grew by over what it may grow by.
fn over(run: &ProgramRun, rewritten: &Rewritten) -> f64 {
    let [most_blocks, most_bytes] = most(&run.program, &run.job);
    let [blocks, bytes] = [run.program.len() as f64, run.program.text().len() as f64];
    let written = rewritten.bytes.len() + rewritten.files.iter().map(|(_, bytes)| bytes.len()).sum::<usize>();
    let share = |new: f64, most: f64| if new > 0.0 { new / most.max(1.0) } else { 0.0 };
    share(rewritten.stats.blocks_added as f64, most_blocks - blocks)
        .max(share(written as f64 - bytes, most_bytes - bytes))
}
