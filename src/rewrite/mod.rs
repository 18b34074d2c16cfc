//! From a schedule to the bytes of the new program, and the proof that only feeds changed. In: a program, its toolpath, and its new feeds.
//! Out: its bytes with F words changed or put in, blocks split where the feed changes inside them, and Feedwright's own comments ("ours");
//! everything else byte for byte as it was.
//!
//! | what | files |
//! |---|---|
//! | which feeds may not change | `freeze`, `plain` (plain language) |
//! | what each block needs | `plan` |
//! | edits of a block: F words, pieces, comments | `write`, `emit`, `split`, [`edit`] |
//! | how the file writes words and numbers | `view`, [`decimal`], [`fword`] |
//! | comments, and the original feeds that they remember | [`mark`], `memory`, `reference`, `checks` (check points of tool life) |
//! | the proof, which shares nothing with the above | [`verify`](mod@verify) |

mod checks;
pub mod decimal;
pub mod edit;
mod emit;
mod freeze;
pub mod fword;
pub mod mark;
mod memory;
mod plain;
mod plan;
mod reference;
mod split;
pub mod verify;
pub(crate) mod view;
mod write;

pub use checks::{CheckMark, checks, with_checks};
pub use freeze::freeze;
pub use mark::is_ours;
pub use reference::{forgets, references};
pub use verify::{Difference, Proof, verify};

use std::sync::Arc;

use crate::ids::BlockId;
use crate::machine::Job;
use crate::nc::{self, File, Program, Toolpath};
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

impl std::ops::AddAssign for Stats {
    fn add_assign(&mut self, other: Self) {
        self.f_words_before += other.f_words_before;
        self.f_words_after += other.f_words_after;
        self.f_words_changed += other.f_words_changed;
        self.f_words_inserted += other.f_words_inserted;
        self.blocks_added += other.blocks_added;
    }
}

/// A rewritten program.
#[derive(Debug, Clone, Default)]
pub struct Rewritten {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// The files linked to it, in order, each with its name and its bytes.
    pub files: Vec<(String, Vec<u8>)>,
    /// Number of edits that made them.
    pub edits: usize,
    /// What was done.
    pub stats: Stats,
    /// Blocks of the input that kept their feed, and why, in order.
    pub kept: Vec<(BlockId, String)>,
}

impl Rewritten {
    /// The written program, read again together with its files.
    pub fn read(&self, original: &Program) -> Program {
        let parse = |bytes: &Vec<u8>| nc::parse(bytes.clone(), Some(original.dialect()));
        if self.files.is_empty() {
            return parse(&self.bytes);
        }
        let file = |(name, bytes): &(String, Vec<u8>)| File { name: name.clone(), program: Arc::new(parse(bytes)) };
        parse(&self.bytes).with_files(self.files.iter().map(file).collect())
    }
}

/// Writes the schedule's feeds into the program. Where nothing changes, the bytes come back as they are. After [`freeze()`] a schedule
/// contains only feeds that can be written; without it, feeds that the text does not allow are left out.
pub fn rewrite(program: &Program, toolpath: &Toolpath, schedule: &Schedule, job: &Job) -> Rewritten {
    let plans = plan::plan(program, toolpath, schedule, job);
    let mut out = Rewritten::default();
    for part in program.parts() {
        let mut writer = write::Writer::new(program, &part, toolpath, job);
        for block in part.blocks() {
            writer.block(block, &plans[block.ix()]);
        }
        writer.end();
        out.edits += writer.edits.len();
        out.stats += writer.stats;
        out.kept.append(&mut writer.kept);
        let bytes = edit::apply(part.span, program.text(), writer.edits);
        match part.name {
            None => out.bytes = bytes,
            Some(name) => out.files.push((name.to_owned(), bytes)),
        }
    }
    out
}
