//! Calls of subprograms and returns from them: O call, M97, M98, M99, G65, G66, in the same text or in another file.

use std::ops::Range;
use std::rc::Rc;
use std::sync::Arc;

use super::Run;
use super::labels::Labels;
use super::line::Line;
use crate::diag::{Severity, Span};
use crate::ids::BlockId;
use crate::nc::dialect::Dialect;
use crate::nc::doubt::Doubt;
use crate::nc::environment::Environment;
use crate::nc::program::{File, Program, parse};

/// A program text being executed.
#[derive(Clone)]
pub(super) enum Source<'a> {
    /// The one that was asked for.
    Main(&'a Program),
    /// A file it calls.
    File(Arc<Program>),
}

impl Source<'_> {
    /// The text.
    pub(super) fn program(&self) -> &Program {
        match self {
            Source::Main(program) => program,
            Source::File(program) => program,
        }
    }
}

/// What a return goes back to.
pub(super) struct Call<'a> {
    source: Source<'a>,
    source_id: usize,
    /// Block after the call.
    at: usize,
    /// First block of the routine.
    start: usize,
    /// Further executions of the routine.
    again: u64,
    /// #1–#33 of the caller, where the call has its own.
    saved: Option<Vec<(u32, f64)>>,
    /// Named variables of the routine are its own.
    own_names: bool,
    /// The block of the main text that makes the call happen.
    main_block: BlockId,
    /// It is the macro of G66.
    modal: bool,
    /// It repeats these blocks of the same text (REPEAT of Siemens) and ends where they end.
    section: Option<Range<usize>>,
}

/// The macro that G66 calls after every motion.
#[derive(Debug, Clone)]
pub(super) struct ModalMacro {
    /// Its number; `None`: it is not executed (it was not found, or is called after blocks of any kind).
    label: Option<String>,
    /// #1–#33 as the last call left them.
    arguments: Vec<(u32, f64)>,
    repeats: u64,
}

/// Endings of the names of subprogram files, in the order they are tried.
const ENDINGS: [&str; 12] = [".ngc", ".nc", "", ".spf", ".SPF", ".NC", ".tap", ".MPF", ".mpf", ".H", ".h", ".txt"];
/// Local numbered parameters.
const LOCALS: std::ops::RangeInclusive<u32> = 1..=33;

impl Run<'_> {
    /// Labels of the text being executed.
    pub(super) fn labels(&mut self) -> Rc<Labels> {
        let program = self.source.program();
        if self.labels.len() <= self.source_id {
            self.labels.resize(self.source_id + 1, None);
        }
        self.labels[self.source_id].get_or_insert_with(|| Rc::new(Labels::of(program))).clone()
    }

    /// M97, M98 (M198), M99 of a block.
    pub(super) fn call_words(&mut self, line: &Line) {
        let repeats = line.get(b'L').unwrap_or(1.0).clamp(0.0, 1e9) as u64;
        for &(code, span) in &line.m {
            match code {
                970 => self.call_local(line, repeats, span),
                980 | 1980 => self.call_program(line, repeats, span),
                990 => self.return_word(line, span),
                _ => {}
            }
        }
    }

    fn call_local(&mut self, line: &Line, repeats: u64, span: Span) {
        let target = line.get(b'P').and_then(|p| self.labels().numbered(p as u32, self.block.0));
        match target {
            Some(block) => self.enter(self.source_id, block as usize, repeats, None),
            None => self.no_routine(span, "its N number"),
        }
    }

    fn call_program(&mut self, line: &Line, repeats: u64, span: Span) {
        let number = line.get(b'P').map_or(0, |p| p.max(0.0) as u64);
        if self.call_by_name(&number.to_string(), repeats, None) {
            return;
        }
        let (times, short) = (number / 10_000, number % 10_000);
        if times == 0 || !self.call_by_name(&short.to_string(), times, None) {
            self.no_routine(span, &format!("program {number}"));
        }
    }

    /// G66 P… and its arguments: the macro is called after every block with a motion from the next one on, up to G67.
    /// (G66.1 calls it after every block, with the words of that block: it is kept, not executed.)
    pub(super) fn call_after_motions(&mut self, line: &Line, code: u16, span: Span) {
        let number = line.get(b'P').map_or(0, |p| p.max(0.0) as u64).to_string();
        let found = code == 660 && (self.labels().routine(&number).is_some() || self.file(&number).is_some());
        if !found {
            let (what, help) = if code == 660 {
                (format!("macro {number} is neither in the text nor beside it"), "put the macro beside the program")
            } else {
                ("G66.1 is not followed".into(), "G66, which calls after motions only, is followed")
            };
            let text = format!("{what}: the calls after the blocks up to G67 are kept, and so are the feeds there");
            self.doubt(Doubt::MissingProgram, span);
            self.say("nc::no-routine", Severity::Warning, span, text, help);
        }
        let repeats = line.get(b'L').unwrap_or(1.0).clamp(0.0, 1e9) as u64;
        self.modal_macro = Some(ModalMacro { label: found.then_some(number), arguments: arguments(line), repeats });
    }

    /// Is a macro that G66 called being executed?
    pub(super) fn in_modal_macro(&self) -> bool {
        self.calls.iter().any(|call| call.modal)
    }

    /// After a block with a motion, where G66 is in force. The motions of the macro itself call nothing.
    pub(super) fn call_modal_macro(&mut self, line: &Line) {
        let defines = line.has_g(660) || line.has_g(661);
        let moves = line.has_any(b"XYZ") && !defines;
        let Some(ModalMacro { label: Some(label), arguments, repeats }) =
            self.modal_macro.clone().filter(|_| moves && !self.ended && !self.in_modal_macro())
        else {
            return;
        };
        let depth = self.calls.len();
        if self.call_by_name(&label, repeats, Some(arguments))
            && let Some(call) = self.calls.get_mut(depth)
        {
            call.modal = true;
        }
    }

    /// G65; G66 has done its work already.
    pub(super) fn call_macro(&mut self, line: &Line) {
        if !line.has_g(650) {
            return;
        }
        let repeats = line.get(b'L').unwrap_or(1.0).clamp(0.0, 1e9) as u64;
        let number = line.get(b'P').map_or(0, |p| p.max(0.0) as u64);
        let arguments = arguments(line);
        if !self.call_by_name(&number.to_string(), repeats, Some(arguments)) {
            let span = line.g.first().map_or_else(Span::default, |g| g.1);
            self.no_routine(span, &format!("macro {number}"));
        }
    }

    /// Calls what begins at a block of the same text.
    pub(super) fn call_block(&mut self, start: usize, repeats: u64) {
        self.enter(self.source_id, start, repeats, None);
    }

    /// Says that a subprogram is missing: where the tool is after it, and which feed is in force, is not known.
    pub(super) fn no_routine(&mut self, span: Span, what: &str) {
        let text = format!("{what} is neither in the text nor in a file beside it");
        self.doubt(Doubt::MissingProgram, span);
        self.elsewhere = [true; 3];
        (self.modal.feed.word, self.modal.feed.computed) = (None, true);
        self.not_understood("nc::no-routine", span, text, "put the subprogram beside the program");
    }

    /// Calls the routine of this label: in the text, else in a file of that name. False when there is none.
    pub(super) fn call_by_name(&mut self, label: &str, repeats: u64, arguments: Option<Vec<(u32, f64)>>) -> bool {
        if let Some(line) = self.labels().routine(label) {
            let block = line.block as usize + 1;
            self.enter(self.source_id, block, repeats, arguments);
            return true;
        }
        let Some(id) = self.file(label) else { return false };
        let program = self.files[id].program.clone();
        let keep = (self.source.clone(), self.source_id);
        (self.source, self.source_id) = (Source::File(program), id + 1);
        let start = self.labels().routine(label).map_or(0, |line| line.block as usize + 1);
        (self.source, self.source_id) = keep;
        self.enter(id + 1, start, repeats, arguments);
        true
    }

    /// Index of the file that holds a routine: one that was called before, else one that is loaded now.
    fn file(&mut self, label: &str) -> Option<usize> {
        let names = file_names(label);
        let known = names.iter().find_map(|name| self.files.iter().position(|file| file.name == *name));
        if known.is_some() || self.missing.contains(label) {
            return known;
        }
        let Some((name, bytes)) = names.into_iter().find_map(|name| (self.env.load)(&name).map(|bytes| (name, bytes)))
        else {
            self.missing.insert(label.to_owned());
            return None;
        };
        let dialect: Dialect = self.program.dialect();
        self.files.push(File { name, program: Arc::new(parse(bytes, Some(dialect))) });
        Some(self.files.len() - 1)
    }

    fn enter(&mut self, source_id: usize, start: usize, repeats: u64, arguments: Option<Vec<(u32, f64)>>) {
        if repeats == 0 {
            return;
        }
        if self.calls.len() >= self.env.max_depth {
            let span = self.source.program().span(self.block);
            let text = format!("calls are nested deeper than {}", self.env.max_depth);
            self.say("nc::runaway", Severity::Error, span, text, "a subprogram seems to call itself without end");
            self.ended = true;
            self.forget_repetitions();
            return;
        }
        self.count_from_here();
        let saved = arguments.as_ref().map(|_| {
            let numbered = &self.parameters.numbered;
            numbered.range(LOCALS).map(|(&index, &value)| (index, value)).collect()
        });
        let own_names = arguments.is_some() || self.program.dialect() == Dialect::Siemens;
        self.calls.push(Call {
            source: self.source.clone(),
            source_id: self.source_id,
            at: self.at,
            start,
            again: repeats - 1,
            saved,
            own_names,
            main_block: self.main_block(),
            modal: false,
            section: None,
        });
        if let Some(arguments) = arguments {
            self.clear_locals();
            self.parameters.numbered.extend(arguments);
        }
        self.parameters.depth += usize::from(own_names);
        self.source = if source_id == 0 {
            Source::Main(self.program)
        } else {
            Source::File(self.files[source_id - 1].program.clone())
        };
        self.source_id = source_id;
        self.at = start;
    }

    /// Executes blocks of this text so many times, then goes on behind the block that asks for it.
    pub(super) fn repeat_blocks(&mut self, section: Range<usize>, times: u64) {
        let depth = self.calls.len();
        self.enter(self.source_id, section.start, times, None);
        if let Some(call) = self.calls.get_mut(depth) {
            self.parameters.depth -= usize::from(call.own_names);
            (call.section, call.own_names) = (Some(section), false);
        }
    }

    /// Where the blocks that are repeated end, begins them again or goes on behind the block that asked for it; a jump out
    /// of them ends the repetition.
    pub(super) fn end_sections(&mut self) {
        while let Some(call) = self.calls.last()
            && let Some(section) = call.section.as_ref().filter(|section| !section.contains(&self.at))
        {
            if self.at == section.end {
                self.leave_call();
            } else {
                self.calls.pop();
            }
        }
    }

    fn clear_locals(&mut self) {
        let set: Vec<u32> = self.parameters.numbered.range(LOCALS).map(|(&index, _)| index).collect();
        for index in set {
            self.parameters.numbered.remove(&index);
        }
    }

    /// First block and first byte that the text being executed has in the linked program; `None`: it is not linked.
    pub(super) fn linked_at(&self) -> Option<(u32, u32)> {
        if self.source_id == 0 || self.source_id > self.program.files().len() {
            return (self.source_id == 0).then_some((0, 0));
        }
        let part = self.program.parts().nth(self.source_id)?;
        Some((part.blocks.start, part.span.start))
    }

    /// The block of the main text that makes the current one happen.
    pub(super) fn main_block(&self) -> BlockId {
        match self.calls.iter().rev().take_while(|_| self.source_id != 0).last() {
            Some(call) => call.main_block,
            None => self.block,
        }
    }

    fn return_word(&mut self, line: &Line, span: Span) {
        if !self.in_subprogram() {
            self.say("nc::endless-program", Severity::Note, span, "M99 begins the program again; one pass is read", "");
            self.ended = true;
            return;
        }
        let target = line.get(b'P').map(|p| p as u32);
        self.return_from_call();
        if let Some(number) = target {
            match self.labels().numbered(number, self.block.0) {
                Some(block) => self.jump(block as usize),
                None => self.no_routine(span, &format!("N{number}")),
            }
        }
    }

    /// Is a routine being executed that was called with arguments? Those it was not given are vacant.
    pub(super) fn has_own_locals(&self) -> bool {
        self.calls.iter().any(|call| call.saved.is_some())
    }

    /// Is a subprogram being executed?
    pub(super) fn in_subprogram(&self) -> bool {
        self.calls.iter().any(|call| call.section.is_none())
    }

    /// Goes back to the caller, or once more to the start of the routine.
    pub(super) fn return_from_call(&mut self) {
        while self.calls.pop_if(|call| call.section.is_some()).is_some() {}
        self.leave_call();
    }

    fn leave_call(&mut self) {
        let Some(call) = self.calls.last_mut() else { return };
        if call.again > 0 {
            call.again -= 1;
            self.at = call.start;
            return;
        }
        let Some(call) = self.calls.pop() else { return };
        if call.modal {
            let numbered = &self.parameters.numbered;
            let locals = numbered.range(LOCALS).map(|(&index, &value)| (index, value)).collect();
            if let Some(modal) = &mut self.modal_macro {
                modal.arguments = locals;
            }
        }
        if let Some(saved) = call.saved {
            self.clear_locals();
            self.parameters.numbered.extend(saved);
        }
        if call.own_names {
            let depth = self.parameters.depth;
            self.parameters.named.retain(|key, _| key.0 != depth + 1);
            self.parameters.depth -= 1;
        }
        self.source = call.source;
        self.source_id = call.source_id;
        self.at = call.at;
    }
}

/// The arguments of a macro call: the local variable of each letter.
fn arguments(line: &Line) -> Vec<(u32, f64)> {
    let letters = b"ABCDEFHIJKMQRSTUVWXYZ";
    let places = [1, 2, 3, 7, 8, 9, 11, 4, 5, 6, 13, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26];
    let argument = |(&letter, place): (&u8, u32)| line.get(letter).map(|value| (place, value));
    letters.iter().zip(places).filter_map(argument).collect()
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
pub fn routine_exists(program: &Program, environment: &Environment<'_>, name: &str) -> bool {
    Labels::of(program).routine(name).is_some()
        || file_names(name)
            .iter()
            .any(|file| program.files().iter().any(|known| known.name == *file) || (environment.load)(file).is_some())
}
