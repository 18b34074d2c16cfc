//! Stops programs that repeat without end. In: blocks as they are executed. Out: whether execution may go on; where it may not, a toolpath
//! with the first pass only.

use super::flow::BLOCK_COST;
use super::interpreter::{Family, Interpreter};
use crate::diag::Severity;
use crate::ids::{BlockId, MoveId};
use crate::nc::toolpath::Freeze;

impl<F: Family> Interpreter<'_, F> {
    /// Charges a block to the budget. False, with a diagnostic, once the budget is used up.
    pub(crate) fn charge(&mut self, block: BlockId) -> bool {
        let span = self.flow.source.program().span(block);
        let cost = (span.len() + BLOCK_COST) as u64;
        if cost > self.flow.budget {
            let text = "the program seems to run without end; the rest is not executed";
            self.say(
                "nc::runaway",
                Severity::Error,
                span,
                text,
                "look at the loop or the call that repeats this block; if it does end, allow more with max_repeated_mb in [machine]",
            );
            self.flow.ended = true;
            self.forget_repetitions();
            return false;
        }
        self.flow.budget -= cost;
        true
    }

    /// Keeps of an endless program only the first pass through the repeated blocks, with frozen feeds.
    pub(crate) fn forget_repetitions(&mut self) {
        let first = self.out.moves.iter().rposition(|motion| motion.instance == 0).map_or(0, |last| last + 1);
        self.out.moves.truncate(first);
        let there = |id: &MoveId| id.ix() <= first;
        self.out.between.retain(|(before, _)| there(before));
        self.out.shifts.retain(|(from, _)| there(from));
        self.cycles.driven.retain(|(index, _)| (*index as usize) < first);
        for motion in &mut self.out.moves {
            if self.flow.counts.get(motion.block.ix()).is_some_and(|count| *count > 1) {
                motion.freeze = motion.freeze.or(Some(Freeze::Repeated));
            }
        }
    }
}
