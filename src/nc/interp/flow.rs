//! Where the control reads. In: filled by `calls.rs`, which enters and leaves subprograms, and by `budget.rs`, which stops endless programs.
//! Out: [`Flow`]: the text being executed, the calls under way, how often each block was executed, and how much may still be.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::rc::Rc;
use std::sync::Arc;

use super::labels::{Labels, Way};
use super::state::{Frame, Modal};
use crate::ids::{BlockId, MoveId};
use crate::nc::doubt::Doubt;
use crate::nc::program::{File, Program};

/// What executing a block costs besides its bytes.
pub const BLOCK_COST: usize = 32;

/// Where blocks of a text may send the control.
pub struct Ways {
    /// Each block with one of its ways, in order.
    pub list: Vec<(u32, Way)>,
    /// The labels of the text.
    pub labels: Labels,
}

impl Ways {
    /// First block of the program that a block belongs to, and that of the next one.
    pub fn program_of(&self, block: u32) -> (u32, u32) {
        let programs = &self.labels.programs;
        let next = programs.partition_point(|begin| *begin <= block + 1);
        let begin = if next == 0 { 0 } else { programs[next - 1] };
        (begin, programs.get(next).copied().unwrap_or(u32::MAX))
    }

    /// The ways of these blocks.
    pub fn of_blocks(&self, begin: u32, end: u32) -> &[(u32, Way)] {
        let before = |block: u32| self.list.partition_point(|(from, _)| *from < block);
        &self.list[before(begin)..before(end.max(begin))]
    }

    /// First block of a routine of this text, and the one behind it.
    pub fn body_of(&self, label: &str) -> Option<(u32, u32)> {
        let line = self.labels.routine(label)?;
        let begin = line.block + 1;
        if line.keyword.is_empty() {
            return Some(self.program_of(begin));
        }
        Some((begin, self.labels.after(line.block, &line.label, &["ENDSUB"]).map_or(u32::MAX, |end| end.block)))
    }
}

/// What may run again because of a doubt at a block.
#[derive(Clone, Copy)]
pub struct Looked {
    /// The earliest block that the doubt came at.
    pub block: u32,
    /// First move that may be made again.
    pub from: Option<MoveId>,
    /// May a return from there go to any block of the caller?
    pub returns_to_block: bool,
}

/// A program text being executed.
#[derive(Clone)]
pub enum Source<'a> {
    /// The one that was asked for.
    Main(&'a Program),
    /// A file it calls.
    File(Arc<Program>),
}

impl Source<'_> {
    /// The text.
    pub fn program(&self) -> &Program {
        match self {
            Source::Main(program) => program,
            Source::File(program) => program,
        }
    }
}

/// What a return goes back to.
pub struct Call<'a> {
    /// The text it was called from.
    pub source: Source<'a>,
    /// Its number, see [`Flow::source_id`].
    pub source_id: usize,
    /// Block after the call.
    pub at: usize,
    /// First block of the routine.
    pub start: usize,
    /// Further executions of the routine.
    pub again: u64,
    /// #1–#33 of the caller, where the call has its own.
    pub saved: Option<Vec<(u32, f64)>>,
    /// Named variables of the routine are its own.
    pub own_names: bool,
    /// The block of the main text that makes the call happen.
    pub main_block: BlockId,
    /// It was made by a modal call (G66), not by a word of the block.
    pub modal: bool,
    /// What the return puts in force again (PROC … SAVE of Siemens).
    pub restores: Option<Box<(Modal, Frame)>>,
    /// It repeats these blocks of the same text (REPEAT of Siemens) and ends where they end.
    pub section: Option<Range<usize>>,
}

/// The flow of the program.
pub struct Flow<'a> {
    /// The text being executed.
    pub source: Source<'a>,
    /// Its number: 0 is the main one, 1 the first of `files` …
    pub source_id: usize,
    /// Next block.
    pub at: usize,
    /// Nothing more is executed.
    pub ended: bool,
    /// The program has begun, so that a `%` ends it.
    pub began: bool,
    /// Files that were called.
    pub files: Vec<File>,
    /// Routines that no file was found for.
    pub missing: BTreeSet<String>,
    /// There was a branch that only the control can decide.
    pub branched: bool,
    /// The block-delete switch of the first block that has one.
    pub switch: Option<u8>,
    /// Labels of each text, read when they are first asked for.
    pub labels: Vec<Option<Rc<Labels>>>,
    /// Calls under way, the innermost last.
    pub calls: Vec<Call<'a>>,
    /// Executions of each block of the main text so far; empty until the first jump.
    pub counts: Vec<u32>,
    /// The move that came next when each of these blocks was executed for the first time.
    pub begun: Vec<Option<MoveId>>,
    /// The move that came next at the first call of each routine, by its name in lower case.
    pub entered: BTreeMap<String, MoveId>,
    /// Ways in each text, found when they are first asked for.
    pub ways: BTreeMap<usize, Rc<Ways>>,
    /// What may run again, as far as it was looked at: by doubt, text and first block of the program of the text.
    pub looked: BTreeMap<(Doubt, usize, u32), Looked>,
    /// Bytes that may still be executed.
    pub budget: u64,
}

impl Flow<'_> {
    /// First block and first byte that the text being executed has in the linked program; `None`: it is not linked.
    pub fn linked_at(&self, program: &Program) -> Option<(u32, u32)> {
        if self.source_id == 0 || self.source_id > program.files().len() {
            return (self.source_id == 0).then_some((0, 0));
        }
        let part = program.parts().nth(self.source_id)?;
        Some((part.blocks.start, part.span.start))
    }
}

/// What executing every block once costs.
pub fn cost_of_one_pass(program: &Program) -> u64 {
    (program.text().len() + BLOCK_COST * program.len()) as u64
}
