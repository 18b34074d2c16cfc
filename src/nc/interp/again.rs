//! Blocks that may run again, unseen. In: something only the control knows, at a block; where each block of the text may send the control back to
//! ([`Family::goes_back_to`]). Out: the first move that may be made again because of it.
//!
//! A value that is not known may decide how often a loop runs in which it comes, or which routine is called. What was executed in that loop
//! before it will then run again, deeper or elsewhere, so that its feeds may not rise either.

use std::rc::Rc;

use super::flow::{Source, WaysBack};
use super::interpreter::{Family, Interpreter};
use super::labels::Labels;
use crate::diag::Span;
use crate::ids::{BlockId, MoveId};
use crate::nc::doubt::Doubt;
use crate::nc::program::Program;

impl<F: Family> Interpreter<'_, F> {
    /// First move of the loops that are under way at this block, those about the calls of it included; `None`: there are none.
    pub(crate) fn begin_of_loops(&mut self) -> Option<MoveId> {
        let here = (self.flow.source.clone(), self.flow.source_id, self.block.id.0);
        let calls = self.flow.calls.iter().map(|call| (call.source.clone(), call.source_id, call.at.max(1) as u32 - 1));
        let places: Vec<_> = std::iter::once(here).chain(calls).collect();
        places.into_iter().filter_map(|(source, id, block)| self.begin_of_loop(&source, id, block)).min()
    }

    fn begin_of_loop(&mut self, source: &Source, id: usize, block: u32) -> Option<MoveId> {
        let ways = self.ways_back(source.program(), id);
        let around = ways.iter().filter(|(from, to)| *from >= block && *to <= block);
        self.first_move_of(id, around.map(|(_, to)| *to).min()?)
    }

    fn ways_back(&mut self, program: &Program, id: usize) -> WaysBack {
        if let Some(known) = self.flow.ways_back.get(&id) {
            return known.clone();
        }
        let labels = Labels::of(program, F::label);
        let blocks = program.blocks().take(program.own_len());
        let way = |block: BlockId| F::goes_back_to(&labels, program, block).map(|to| (block.0, to));
        let ways: WaysBack = Rc::new(blocks.filter_map(way).filter(|(from, to)| to <= from).collect());
        self.flow.ways_back.insert(id, ways.clone());
        ways
    }

    /// The move that came next when a block of a linked text was executed for the first time; `None`: it has not been executed.
    fn first_move_of(&self, id: usize, block: u32) -> Option<MoveId> {
        let parts = self.program.parts().nth(id);
        let first = if id == 0 { 0 } else { parts?.blocks.start };
        if self.flow.counts.is_empty() {
            // Up to here the blocks were executed one after the other.
            return Some(MoveId(self.out.moves.partition_point(|motion| motion.block.0 < block) as u32));
        }
        self.flow.begun.get((first + block) as usize).copied().flatten()
    }

    /// Which routine is called here is not known: any of those that ran before may run again.
    pub(crate) fn calls_any_routine(&mut self, place: Span) {
        self.doubt(Doubt::UnknownValue, place);
        // Routines under a label may have run where they stand.
        let (id, labels) = (self.flow.source_id, self.labels());
        let labelled = labels.names.iter().filter_map(|(_, block)| self.first_move_of(id, *block));
        if let Some(from) = labelled.chain(self.flow.first_call).min() {
            self.doubt_since(Doubt::UnknownValue, from, place);
        }
    }

    /// Is something open that only the control knows, so that a computed value may be another than here?
    pub(crate) fn values_are_unknown(&self) -> bool {
        self.messages.raised[Doubt::UnknownValue as usize].open.is_some()
    }
}
