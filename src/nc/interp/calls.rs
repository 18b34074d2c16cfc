//! Calls of subprograms and returns from them, in the same text or in another file. In: a label, arguments, how often. Out: the
//! flow of the program moved there, and back.

use std::ops::{Range, RangeInclusive};
use std::rc::Rc;
use std::sync::Arc;

use super::flow::{Call, Source};
use super::interpreter::{Family, Interpreter};
use super::labels::Labels;
use super::state::{FeedWord, Frame, Modal};
use crate::diag::{Severity, Span};
use crate::ids::{BlockId, MoveId};
use crate::nc::doubt::Doubt;
use crate::nc::environment::Environment;
use crate::nc::program::{File, Program, parse};

/// Endings of the names of subprogram files, in the order they are tried.
const ENDINGS: [&str; 12] = [".ngc", ".nc", "", ".spf", ".SPF", ".NC", ".tap", ".MPF", ".mpf", ".H", ".h", ".txt"];

impl<F: Family> Interpreter<'_, F> {
    /// Labels of the text being executed.
    pub(crate) fn labels(&mut self) -> Rc<Labels> {
        let program = self.flow.source.program();
        if self.flow.labels.len() <= self.flow.source_id {
            self.flow.labels.resize(self.flow.source_id + 1, None);
        }
        self.flow.labels[self.flow.source_id].get_or_insert_with(|| Rc::new(Labels::of(program, F::label))).clone()
    }

    /// Calls what begins at a block of the same text.
    pub(crate) fn call_block(&mut self, start: usize, repeats: u64) {
        self.enter(self.flow.source_id, start, repeats, None);
    }

    /// Goes on at another block of the same text.
    pub(crate) fn jump(&mut self, to: usize) {
        self.count_from_here();
        self.flow.at = to;
    }

    /// From the first jump on, counts how often each block is executed, those of linked files included.
    pub(crate) fn count_from_here(&mut self) {
        if self.flow.counts.is_empty() {
            let executed = self.flow.at.min(self.program.own_len());
            self.flow.counts = vec![0; self.program.len()];
            self.flow.counts[..executed].fill(1);
            let before = |block: usize| self.out.moves.partition_point(|motion| motion.block.ix() < block) as u32;
            self.flow.begun = (0..executed).map(|block| Some(MoveId(before(block)))).collect();
            self.flow.begun.resize(self.program.len(), None);
        }
    }

    /// Counts the block that is executed now.
    pub(crate) fn count(&mut self) {
        if !self.flow.counts.is_empty()
            && let Some((first, _)) = self.linked_at()
            && let index = first as usize + self.block.id.ix()
            && let Some(count) = self.flow.counts.get_mut(index)
        {
            *count += 1;
            let next = MoveId(self.out.moves.len() as u32);
            self.flow.begun[index].get_or_insert(next);
        }
    }

    /// Diagnoses a missing subprogram. Where the tool is after it, and which feed is in force, is not known.
    pub(crate) fn no_routine(&mut self, span: Span, what: &str) {
        let text = format!("{what} is neither in the text nor in a file beside it");
        self.doubt(Doubt::MissingProgram, span);
        self.place.elsewhere = [true; 3];
        (self.modal.feed.word, self.modal.feed.computed) = (None, true);
        self.not_understood("nc::no-routine", span, text, "put the subprogram beside the program");
    }

    /// Calls the routine of this label: in the text, else in a file of that name. False when there is none.
    pub(crate) fn call_by_name(&mut self, label: &str, repeats: u64, arguments: Option<Vec<(u32, f64)>>) -> bool {
        let next = self.next_move();
        if let Some(line) = self.labels().routine(label) {
            self.flow.entered.entry(label.to_ascii_lowercase()).or_insert(next);
            let block = line.block as usize + 1;
            self.enter(self.flow.source_id, block, repeats, arguments);
            return true;
        }
        let Some(id) = self.file(label) else { return false };
        self.flow.entered.entry(label.to_ascii_lowercase()).or_insert(next);
        let program = self.flow.files[id].program.clone();
        let keep = (self.flow.source.clone(), self.flow.source_id);
        (self.flow.source, self.flow.source_id) = (Source::File(program), id + 1);
        let start = self.labels().routine(label).map_or(0, |line| line.block as usize + 1);
        (self.flow.source, self.flow.source_id) = keep;
        self.enter(id + 1, start, repeats, arguments);
        true
    }

    /// Index of the file that holds a routine: one that was called before, else one that is loaded now.
    pub(crate) fn file(&mut self, label: &str) -> Option<usize> {
        let names = file_names(label);
        let known = names.iter().find_map(|name| self.flow.files.iter().position(|file| file.name == *name));
        if known.is_some() || self.flow.missing.contains(label) {
            return known;
        }
        let Some((name, bytes)) = names.into_iter().find_map(|name| (self.env.load)(&name).map(|bytes| (name, bytes)))
        else {
            self.flow.missing.insert(label.to_owned());
            return None;
        };
        self.flow.files.push(File { name, program: Arc::new(parse(bytes, Some(self.program.dialect()))) });
        Some(self.flow.files.len() - 1)
    }

    pub(crate) fn enter(&mut self, source_id: usize, start: usize, repeats: u64, arguments: Option<Vec<(u32, f64)>>) {
        if repeats == 0 {
            return;
        }
        if self.flow.calls.len() >= self.env.max_depth {
            let span = self.flow.source.program().span(self.block.id);
            let text = format!("calls are nested deeper than {}", self.env.max_depth);
            let help = "a subprogram seems to call itself without end; if it does end, allow more with max_call_depth in [machine]";
            self.say("nc::runaway", Severity::Error, span, text, help);
            self.flow.ended = true;
            self.forget_repetitions();
            return;
        }
        self.count_from_here();
        let saved = arguments.as_ref().map(|_| self.locals());
        let own_names = arguments.is_some() || F::OWN_VARIABLES;
        self.flow.calls.push(Call {
            source: self.flow.source.clone(),
            source_id: self.flow.source_id,
            at: self.flow.at,
            start,
            again: repeats - 1,
            saved,
            own_names,
            main_block: self.main_block(),
            modal: false,
            section: None,
            restores: None,
        });
        if let Some(arguments) = arguments {
            self.clear_locals();
            self.parameters.numbered.extend(arguments);
        }
        self.parameters.depth += usize::from(own_names);
        self.flow.source = if source_id == 0 {
            Source::Main(self.program)
        } else {
            Source::File(self.flow.files[source_id - 1].program.clone())
        };
        self.flow.source_id = source_id;
        self.flow.at = start;
    }

    /// Executes blocks of this text so many times, then goes on behind the block that asks for it.
    pub(crate) fn repeat_blocks(&mut self, section: Range<usize>, times: u64) {
        let depth = self.flow.calls.len();
        self.enter(self.flow.source_id, section.start, times, None);
        if let Some(call) = self.flow.calls.get_mut(depth) {
            self.parameters.depth -= usize::from(call.own_names);
            (call.section, call.own_names) = (Some(section), false);
        }
    }

    /// Where the blocks that are repeated end, begins them again or goes on behind the block that asked for it; a jump out
    /// of them ends the repetition.
    pub(crate) fn end_sections(&mut self) {
        while let Some(call) = self.flow.calls.last()
            && let Some(section) = call.section.as_ref().filter(|section| !section.contains(&self.flow.at))
        {
            if self.flow.at == section.end {
                self.leave_call();
            } else {
                self.flow.calls.pop();
            }
        }
    }

    /// Numbers of the variables that are local to a call with arguments.
    pub(crate) fn local_numbers(&self) -> RangeInclusive<u32> {
        self.dialect().locals.clone()
    }

    fn clear_locals(&mut self) {
        let set: Vec<u32> = self.parameters.numbered.range(self.local_numbers()).map(|(&index, _)| index).collect();
        for index in set {
            self.parameters.numbered.remove(&index);
        }
    }

    /// First block and first byte that the text being executed has in the linked program; `None`: it is not linked.
    pub(crate) fn linked_at(&self) -> Option<(u32, u32)> {
        self.flow.linked_at(self.program)
    }

    /// The block of the main text that makes the current one happen.
    pub(crate) fn main_block(&self) -> BlockId {
        match self.flow.calls.iter().rev().take_while(|_| self.flow.source_id != 0).last() {
            Some(call) => call.main_block,
            None => self.block.id,
        }
    }

    /// The present values of the local numbered variables.
    pub(crate) fn locals(&self) -> Vec<(u32, f64)> {
        self.parameters.numbered.range(self.local_numbers()).map(|(&index, &value)| (index, value)).collect()
    }

    /// Is a routine being executed that was called with arguments? Its local variables without an argument are vacant.
    pub(crate) fn has_own_locals(&self) -> bool {
        self.flow.calls.iter().any(|call| call.saved.is_some())
    }

    /// Is a subprogram being executed?
    pub(crate) fn in_subprogram(&self) -> bool {
        self.flow.calls.iter().any(|call| call.section.is_none())
    }

    /// Goes back to the caller, or once more to the start of the routine.
    pub(crate) fn return_from_call(&mut self) {
        while self.flow.calls.pop_if(|call| call.section.is_some()).is_some() {}
        self.leave_call();
    }

    /// Puts the modes of the caller in force again, but for what words other than G set: feed, speed, tool.
    fn restore(&mut self, (caller, frame): (Modal, Frame)) {
        if self.modal.feed_mode != caller.feed_mode {
            self.uses_feed();
            self.modal.feed = FeedWord { value: 0.0, word: None, computed: false };
        }
        let Modal { feed, speed_rps, turning, coolant, tool, next_tool, .. } = self.modal;
        self.modal = Modal { feed, speed_rps, turning, coolant, tool, next_tool, ..caller };
        self.frame = frame;
        self.reframe();
    }

    fn leave_call(&mut self) {
        let Some(call) = self.flow.calls.last_mut() else { return };
        if call.again > 0 {
            call.again -= 1;
            self.flow.at = call.start;
            if let Some(state) = call.restores.clone() {
                self.restore(*state);
            }
            return;
        }
        let modal = call.modal;
        F::before_return(self, modal);
        let Some(call) = self.flow.calls.pop() else { return };
        if let Some(saved) = call.saved {
            self.clear_locals();
            self.parameters.numbered.extend(saved);
        }
        if let Some(state) = call.restores {
            self.restore(*state);
        }
        if call.own_names {
            let depth = self.parameters.depth;
            self.parameters.named.retain(|key, _| key.0 != depth + 1);
            self.parameters.depth -= 1;
        }
        self.flow.source = call.source;
        self.flow.source_id = call.source_id;
        self.flow.at = call.at;
    }
}

/// Names a file with this routine may have.
fn file_names(label: &str) -> Vec<String> {
    let mut stems = vec![label.to_owned()];
    let lower = label.to_ascii_lowercase();
    if lower != label {
        stems.push(lower);
    }
    if let Ok(number) = label.parse::<u32>() {
        stems.extend([format!("O{number:04}"), format!("O{number:05}"), format!("o{number}")]);
    }
    let named = |stem: &String| ENDINGS.map(|ending| format!("{stem}{ending}"));
    stems.iter().flat_map(named).collect()
}

/// Is there a subprogram of this name in the text or in a file?
pub(crate) fn routine_exists<F: Family>(program: &Program, environment: &Environment<'_>, name: &str) -> bool {
    Labels::of(program, F::label).routine(name).is_some()
        || file_names(name)
            .iter()
            .any(|file| program.files().iter().any(|known| known.name == *file) || (environment.load)(file).is_some())
}
