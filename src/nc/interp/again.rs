//! Blocks that may run again, unseen. In: something only the control knows, at a block; where each block of the text may send the control
//! ([`Family::ways`]). Out: the first move that may be made again because of it.
//!
//! A value that is not known may decide how often a loop runs in which it comes, which branch is taken, or which routine is called. What ran
//! before and can be reached from there may then run again, deeper or elsewhere, so that its feeds may not rise either. All blocks behind it in
//! its program of the text count as reached, and those from where any of these goes back to.

use std::collections::BTreeSet;
use std::rc::Rc;

use super::flow::{Looked, Source, Ways};
use super::interpreter::{Family, Interpreter};
use super::labels::{Labels, Way};
use crate::diag::Span;
use crate::ids::MoveId;
use crate::nc::doubt::Doubt;
use crate::nc::program::Program;

/// What calls run.
#[derive(Default)]
struct Called {
    /// First move of what ran before.
    first: Option<MoveId>,
    /// May a return from there go to any block of the caller?
    returns_to_block: bool,
}

/// The lowest block that ways lead back to from a block on.
fn lowest_reached(within: &[(u32, Way)], begin: u32, block: u32) -> u32 {
    // Ways by where they come from, the last first: each block is looked at once.
    let mut lowest = block;
    let mut looked = within.len();
    loop {
        let first = within.partition_point(|(from, _)| *from < lowest);
        let back = within[first..looked.max(first)].iter().filter_map(|(_, way)| match way {
            Way::Block(to) if (begin..lowest).contains(to) => Some(*to),
            _ => None,
        });
        let Some(lower) = back.min() else { return lowest };
        (lowest, looked) = (lower, first);
    }
}

/// Is this the file of a routine, whatever its ending?
fn is_file_of(file: &str, label: &str) -> bool {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file).to_ascii_lowercase();
    let stem = name.split('.').next().unwrap_or_default().trim_start_matches('o').trim_start_matches('0').to_owned();
    name == label || stem == label.trim_start_matches('0')
}

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
        let within = ways.of_blocks(begin, end);
        let reached =
            |lowest: u32| within[within.partition_point(|(from, _)| *from < lowest)..].iter().map(|(_, way)| way);
        // An unknown code or a missing program leaves branches and counts as they are here: calls run as simulated, behind the doubt.
        let after_motions = self.family_calls();
        let called = if doubt == Doubt::UnknownValue {
            let lowest = lowest_reached(within, begin, block);
            self.called(&ways, reached(lowest).chain(&after_motions))
        } else {
            Called::default()
        };
        let lowest = if called.returns_to_block { begin } else { lowest_reached(within, begin, block) };
        let jumps = reached(lowest).filter_map(|way| if let Way::Block(to) = way { Some(*to) } else { None });
        // Blocks further down may have run before, and are fallen into.
        let length = source.program().own_len() as u32;
        let below = (lowest..end.min(length)).chain(jumps).filter_map(|block| self.first_move_of(id, block));
        let from = below.chain(called.first).min();
        let found = Looked { block, from, returns_to_block: reached(lowest).any(|way| *way == Way::Caller) };
        self.flow.looked.insert(key, found);
        found
    }

    /// Routines called after motions.
    fn family_calls(&self) -> Vec<Way> {
        F::called_after_motions(self).map(Way::Routine).into_iter().collect()
    }

    /// What the calls among these ways run, and what that calls.
    fn called<'w>(&mut self, ways: &'w Ways, from: impl Iterator<Item = &'w Way>) -> Called {
        let (mut found, mut seen) = (Called::default(), BTreeSet::new());
        let mut open: Vec<Way> = from.filter(|way| !matches!(way, Way::Block(_) | Way::Caller)).cloned().collect();
        while let Some(way) = open.pop() {
            let Way::Routine(label) = way else {
                found.first = found.first.into_iter().chain(self.flow.entered.values().copied()).min();
                continue;
            };
            if !seen.insert(label.clone()) {
                continue;
            }
            found.first = found.first.into_iter().chain(self.flow.entered.get(&label).copied()).min();
            let body: Vec<Way> = if let Some((begin, end)) = ways.body_of(&label) {
                ways.of_blocks(begin, end).iter().map(|(_, way)| way.clone()).collect()
            } else if let Some(index) = self.flow.files.iter().position(|file| is_file_of(&file.name, &label)) {
                let program = self.flow.files[index].program.clone();
                self.ways(&program, index + 1).list.iter().map(|(_, way)| way.clone()).collect()
            } else {
                Vec::new()
            };
            found.returns_to_block |= body.contains(&Way::Caller);
            open.extend(body.into_iter().filter(|way| !matches!(way, Way::Block(_) | Way::Caller)));
        }
        found
    }

    fn ways(&mut self, program: &Program, id: usize) -> Rc<Ways> {
        if let Some(known) = self.flow.ways.get(&id) {
            return known.clone();
        }
        let labels = Labels::of(program, F::label);
        let blocks = program.blocks().take(program.own_len());
        let of_block = |block| F::ways(&labels, program, block).into_iter().map(move |way| (block.0, way));
        let list = blocks.flat_map(of_block).collect();
        let ways = Rc::new(Ways { list, labels });
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
