//! Calls of subprograms and returns from them: O call, M97, M98, M99, G65, in the same text or in another file.

use std::rc::Rc;

use super::Run;
use super::labels::Labels;
use super::line::Line;
use crate::diag::{Severity, Span};
use crate::ids::BlockId;
use crate::nc::dialect::Dialect;
use crate::nc::program::{Program, parse};

/// A program text being executed.
#[derive(Clone)]
pub(super) enum Source<'a> {
    /// The one that was asked for.
    Main(&'a Program),
    /// A file it calls.
    File(Rc<Program>),
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
    /// The block of the main text that makes the call happen.
    main_block: BlockId,
}

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

    /// M97, M98, M99 and G65 of a block.
    pub(super) fn call_words(&mut self, line: &Line) {
        let repeats = line.get(b'L').unwrap_or(1.0).clamp(0.0, 1e9) as u64;
        for &(code, span) in &line.m {
            match code {
                970 => self.call_local(line, repeats, span),
                980 => self.call_program(line, repeats, span),
                990 => self.return_word(line, span),
                _ => {}
            }
        }
        if line.has_g(650) {
            self.call_macro(line, repeats);
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

    fn call_macro(&mut self, line: &Line, repeats: u64) {
        let number = line.get(b'P').map_or(0, |p| p.max(0.0) as u64);
        let letters = b"ABCDEFHIJKMQRSTUVWXYZ";
        let places = [1, 2, 3, 7, 8, 9, 11, 4, 5, 6, 13, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26];
        let argument = |(&letter, place): (&u8, u32)| line.get(letter).map(|value| (place, value));
        let arguments: Vec<_> = letters.iter().zip(places).filter_map(argument).collect();
        if !self.call_by_name(&number.to_string(), repeats, Some(arguments)) {
            let span = line.g.first().map_or_else(Span::default, |g| g.1);
            self.no_routine(span, &format!("macro {number}"));
        }
    }

    /// Calls what begins at a block of the same text.
    pub(super) fn call_block(&mut self, start: usize, repeats: u64) {
        self.enter(self.source_id, start, repeats, None);
    }

    /// Says that a subprogram is missing.
    pub(super) fn no_routine(&mut self, span: Span, what: &str) {
        let text = format!("{what} is neither in the text nor in a file beside it");
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
        let program = self.files[id].1.clone();
        let keep = (self.source.clone(), self.source_id);
        (self.source, self.source_id) = (Source::File(program), id + 1);
        let start = self.labels().routine(label).map_or(0, |line| line.block as usize + 1);
        (self.source, self.source_id) = keep;
        self.enter(id + 1, start, repeats, arguments);
        true
    }

    /// Index of the loaded file that holds a routine.
    fn file(&mut self, label: &str) -> Option<usize> {
        if let Some(index) = self.files.iter().position(|(name, _)| name == label) {
            return Some(index);
        }
        let number: Option<u32> = label.parse().ok();
        let mut names = vec![
            format!("{label}.ngc"),
            format!("{label}.nc"),
            label.to_owned(),
            format!("{label}.spf"),
            format!("{label}.SPF"),
        ];
        if let Some(number) = number {
            names.extend(["", ".nc", ".NC", ".ngc", ".tap"].map(|ending| format!("O{number:04}{ending}")));
        }
        let bytes = names.iter().find_map(|name| (self.env.load)(name))?;
        let dialect: Dialect = self.program.dialect();
        self.files.push((label.to_owned(), Rc::new(parse(bytes, Some(dialect)))));
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
            return;
        }
        self.count_from_here();
        let saved = arguments.as_ref().map(|_| {
            let numbered = &self.parameters.numbered;
            numbered.range(LOCALS).map(|(&index, &value)| (index, value)).collect()
        });
        self.calls.push(Call {
            source: self.source.clone(),
            source_id: self.source_id,
            at: self.at,
            start,
            again: repeats - 1,
            saved,
            main_block: self.main_block(),
        });
        if let Some(arguments) = arguments {
            self.clear_locals();
            self.parameters.numbered.extend(arguments);
            self.parameters.depth += 1;
        }
        self.source =
            if source_id == 0 { Source::Main(self.program) } else { Source::File(self.files[source_id - 1].1.clone()) };
        self.source_id = source_id;
        self.at = start;
    }

    fn clear_locals(&mut self) {
        let set: Vec<u32> = self.parameters.numbered.range(LOCALS).map(|(&index, _)| index).collect();
        for index in set {
            self.parameters.numbered.remove(&index);
        }
    }

    /// The block of the main text that makes the current one happen.
    pub(super) fn main_block(&self) -> BlockId {
        match self.calls.iter().rev().take_while(|_| self.source_id != 0).last() {
            Some(call) => call.main_block,
            None => self.block,
        }
    }

    fn return_word(&mut self, line: &Line, span: Span) {
        if self.calls.is_empty() {
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

    /// Goes back to the caller, or once more to the start of the routine.
    pub(super) fn return_from_call(&mut self) {
        let Some(call) = self.calls.last_mut() else { return };
        if call.again > 0 {
            call.again -= 1;
            self.at = call.start;
            return;
        }
        let Some(call) = self.calls.pop() else { return };
        if let Some(saved) = call.saved {
            self.clear_locals();
            self.parameters.numbered.extend(saved);
            let depth = self.parameters.depth;
            self.parameters.named.retain(|key, _| key.0 != depth + 1);
            self.parameters.depth -= 1;
        }
        self.source = call.source;
        self.source_id = call.source_id;
        self.at = call.at;
    }
}
