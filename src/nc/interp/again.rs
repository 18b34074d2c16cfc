//! Blocks that may run again, unseen. In: something only the control knows, at a block; where each block of the text may send the control
//! ([`Family::ways`]). Out: the first move that may be made again because of it.
//!
//! A value that is not known may decide how often a loop runs in which it comes, which branch is taken, or which routine is called. What ran
//! before and can be reached from there may then run again, deeper or elsewhere, so that its feeds may not rise either. All blocks behind it in
//! its program of the text count as reached, and those from where any of these goes back to.

use std::rc::Rc;

use super::flow::{Looked, Source, Ways};
use super::interpreter::{Family, Interpreter};
use super::labels::{Labels, Way};
use crate::diag::Span;
use crate::ids::MoveId;
use crate::nc::doubt::Doubt;
use crate::nc::program::Program;

impl<F: Family> Interpreter<'_, F> {
    /// First move that was made and may be made again because of a doubt at this block; `None`: there is none, or none before those found.
    pub(crate) fn first_again(&mut self, doubt: Doubt) -> Option<MoveId> {
        let here = (self.flow.source.clone(), self.flow.source_id, self.block.id.0);
        let calls = self.flow.calls.iter().rev();
        let calls = calls.map(|call| (call.source.clone(), call.source_id, call.at.max(1) as u32 - 1));
        let places: Vec<_> = std::iter::once(here).chain(calls).collect();
        let (mut first, mut by_return) = (None, false);
        for (source, id, block) in places {
            let found = self.first_again_in(&source, id, (block, by_return), doubt);
            by_return = found.returns_to_block;
            first = first.into_iter().chain(found.from).min();
        }
        first
    }

    /// The same for one level of calls; `by_return`: a return may go to any block of it.
    fn first_again_in(&mut self, source: &Source, id: usize, at: (u32, bool), doubt: Doubt) -> Looked {
        let ways = self.ways(source.program(), id);
        let (begin, end) = ways.program_of(at.0);
        let block = if at.1 { begin } else { at.0 };
        let key = (doubt, id, begin);
        // From a later block less is reached, and what begins later is in doubt anyhow.
        let known = self.flow.looked.get(&key).copied();
        if let Some(known) = known.filter(|known| known.block <= block) {
            return Looked { from: None, ..known };
        }
        let within =
            ways.list.partition_point(|(from, _)| *from < begin)..ways.list.partition_point(|(from, _)| *from < end);
        let within = &ways.list[within];
        let mut lowest = block;
        loop {
            let reached = within.iter().filter(|(from, _)| *from >= lowest);
            let back = reached.filter_map(|(_, way)| if let Way::Block(to) = way { Some(*to) } else { None });
            let Some(lower) = back.filter(|to| (begin..lowest).contains(to)).min() else { break };
            lowest = lower;
        }
        let reached = || within.iter().filter(|(from, _)| *from >= lowest).map(|(_, way)| way);
        // Where a code is not known the flow is.
        let calls = doubt == Doubt::UnknownValue;
        let first_move = |way: &Way| match way {
            Way::Block(to) => self.first_move_of(id, *to),
            Way::Routine(label) if calls => self.flow.entered.get(label).copied(),
            Way::AnyRoutine if calls => self.flow.entered.values().min().copied(),
            _ => None,
        };
        let back = (lowest < block || at.1).then(|| self.first_move_of(id, lowest)).flatten();
        let from = reached().filter_map(first_move).chain(back).min();
        let found = Looked { block, from, returns_to_block: reached().any(|way| *way == Way::Caller) };
        self.flow.looked.insert(key, found);
        found
    }

    fn ways(&mut self, program: &Program, id: usize) -> Rc<Ways> {
        if let Some(known) = self.flow.ways.get(&id) {
            return known.clone();
        }
        let labels = Labels::of(program, F::label);
        let blocks = program.blocks().take(program.own_len());
        let of_block = |block| F::ways(&labels, program, block).into_iter().map(move |way| (block.0, way));
        let ways = Rc::new(Ways { list: blocks.flat_map(of_block).collect(), programs: labels.programs });
        self.flow.ways.insert(id, ways.clone());
        ways
    }

    /// The move that came next when a block of a linked text was executed for the first time; `None`: it has not been executed.
    fn first_move_of(&self, id: usize, block: u32) -> Option<MoveId> {
        let parts = self.program.parts().nth(id);
        let first = if id == 0 { 0 } else { parts?.blocks.start };
        if self.flow.counts.is_empty() {
            // Up to here the blocks were executed one after the other.
            let executed = (block as usize) < self.flow.at;
            let next = self.out.moves.partition_point(|motion| motion.block.0 < block) as u32;
            return executed.then_some(MoveId(next));
        }
        self.flow.begun.get((first + block) as usize).copied().flatten()
    }

    /// Which routine is called here is not known: any of those that ran before may run again.
    pub(crate) fn calls_any_routine(&mut self, place: Span) {
        self.doubt(Doubt::UnknownValue, place);
        // Routines under a label may have run where they stand.
        let (id, labels) = (self.flow.source_id, self.labels());
        let labelled = labels.names.iter().filter_map(|(_, block)| self.first_move_of(id, *block));
        if let Some(from) = labelled.chain(self.flow.entered.values().copied()).min() {
            self.doubt_since(Doubt::UnknownValue, from, place);
        }
    }

    /// Is something open that only the control knows, so that a computed value may be another than here?
    pub(crate) fn values_are_unknown(&self) -> bool {
        self.messages.raised[Doubt::UnknownValue as usize].open.is_some()
    }
}
