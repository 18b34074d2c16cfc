//! Schedule → edits → bytes, and the proof that only feeds changed. In: a program, what it does, and the feeds it shall
//! have. Out: its bytes with F words changed or put in, blocks cut where the feed changes inside them, and comments of our
//! own; everything else byte for byte as it was.

pub mod decimal;
pub mod edit;
mod emit;
mod freeze;
pub mod fword;
pub mod mark;
mod plain;
mod plan;
mod reference;
mod split;
pub mod verify;
mod view;
mod write;

pub use freeze::freeze;
pub use mark::{is_ours, strip};
pub use reference::{references, remembers};
pub use verify::{Difference, Proof, verify};

use crate::machine::Job;
use crate::nc::{Program, Toolpath};
use crate::schedule::Schedule;

/// What rewriting did, in numbers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Stats {
    /// F words in the input.
    pub f_words_before: usize,
    /// F words in the output.
    pub f_words_after: usize,
    /// F words whose number was changed.
    pub f_words_changed: usize,
    /// F words put into blocks that had none.
    pub f_words_inserted: usize,
    /// Lines added.
    pub blocks_added: usize,
}

/// A rewritten program.
#[derive(Debug, Clone, Default)]
pub struct Rewritten {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Number of edits that made them.
    pub edits: usize,
    /// What was done.
    pub stats: Stats,
    /// Lines of the input that kept their feed, and why.
    pub kept: Vec<(u32, String)>,
}

/// Writes the schedule's feeds into the program. Where nothing changes, the bytes come back as they are. A schedule made
/// after [`freeze`] asks for nothing that cannot be written; one made without it is obeyed as far as the text allows.
pub fn rewrite(program: &Program, toolpath: &Toolpath, schedule: &Schedule, job: &Job) -> Rewritten {
    let plans = plan::plan(program, toolpath, schedule, job);
    let mut writer = write::Writer::new(program, toolpath, job);
    for (block, plan) in program.blocks().zip(&plans) {
        writer.block(block, plan);
    }
    if !writer.edits.is_empty() {
        writer.header();
    }
    let count = writer.edits.len();
    let (stats, kept) = (writer.stats, writer.kept);
    Rewritten { bytes: edit::apply(program.text(), writer.edits), edits: count, stats, kept }
}
