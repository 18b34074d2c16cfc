//! M97, M98, M99 and the macros of G65 and G66. In: the words of a block. Out: the routine entered or left.

use super::state::{ModalMacro, Rs274};
use crate::diag::{Severity, Span};
use crate::ids::BlockId;
use crate::nc::doubt::Doubt;
use crate::nc::interp::interpreter::Interpreter;
use crate::nc::interp::words::Words;
use crate::nc::token::TokenKind;
use crate::nc::toolpath::{Move, MoveKind};

impl Interpreter<'_, Rs274> {
    /// M97, M98 (M198), M99 of a block.
    pub(crate) fn call_words(&mut self, words: &Words) {
        let repeats = words.get(b'L').unwrap_or(1.0).clamp(0.0, 1e9) as u64;
        for &(code, span) in &words.m {
            match code {
                970 => self.call_local(words, repeats, span),
                980 | 1980 => self.call_program(words, repeats, span),
                990 => self.return_word(words, span),
                // LinuxCNC: M70 keeps the feed for M72.
                700 => self.uses_feed(),
                _ => {}
            }
        }
    }

    /// A routine whose number is computed from what only the control knows may be any.
    fn doubt_of_computed_routine(&mut self, words: &Words, span: Span) {
        if words.is_computed(b'P') && self.values_are_unknown() {
            self.calls_any_routine(span);
        }
    }

    fn call_local(&mut self, words: &Words, repeats: u64, span: Span) {
        self.doubt_of_computed_routine(words, span);
        let target = words.get(b'P').and_then(|p| self.labels().numbered(p as u32, self.block.id.0));
        match target {
            Some(block) => self.enter(self.flow.source_id, block as usize, repeats, None),
            None => self.no_routine(span, "its N number"),
        }
    }

    fn call_program(&mut self, words: &Words, repeats: u64, span: Span) {
        self.doubt_of_computed_routine(words, span);
        let number = words.get(b'P').map_or(0, |p| p.max(0.0) as u64);
        if let Some(block) = words.get(b'Q') {
            return self.call_from_block(number, block, repeats, span);
        }
        if self.call_by_name(&number.to_string(), repeats, None) {
            return;
        }
        let (times, short) = (number / 10_000, number % 10_000);
        if times == 0 || !self.call_by_name(&short.to_string(), times, None) {
            self.no_routine(span, &format!("program {number}"));
        }
    }

    /// M98 P… Q…: the program from its block with this N number on.
    fn call_from_block(&mut self, number: u64, block: f64, repeats: u64, span: Span) {
        let labels = self.labels();
        let routine = labels.routine(&number.to_string()).map(|line| line.block);
        let start = routine.and_then(|routine| {
            let found = labels.numbered(block.max(0.0) as u32, routine);
            found.filter(|found| labels.start_of_program(*found) == routine + 1)
        });
        if let Some(start) = start {
            let next = self.next_move();
            self.flow.entered.entry(number.to_string()).or_insert(next);
            return self.enter(self.flow.source_id, start as usize, repeats, None);
        }
        self.calls_any_routine(span);
        self.no_routine(span, &format!("program {number} with a block N{block}"));
    }

    /// G66 P… and its arguments: the macro is called after every block with a motion from the next one on, up to G67.
    /// (G66.1 calls it after every block, with the words of that block: it is kept, not executed.)
    pub(crate) fn call_after_motions(&mut self, words: &Words, code: u16, span: Span) {
        self.doubt_of_computed_routine(words, span);
        let number = words.get(b'P').map_or(0, |p| p.max(0.0) as u64).to_string();
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
        let repeats = words.get(b'L').unwrap_or(1.0).clamp(0.0, 1e9) as u64;
        self.family.modal_macro =
            Some(ModalMacro { label: found.then_some(number), arguments: arguments(words), repeats });
    }

    /// Is a macro that G66 called being executed?
    pub(crate) fn in_modal_macro(&self) -> bool {
        self.flow.calls.iter().any(|call| call.modal)
    }

    /// After a block with a motion, where G66 is in force. The motions of the macro itself call nothing.
    pub(crate) fn call_modal_macro(&mut self, words: &Words) {
        let defines = words.has_g(660) || words.has_g(661);
        let moves = words.has_any(b"XYZ") && !defines;
        let Some(ModalMacro { label: Some(label), arguments, repeats }) =
            self.family.modal_macro.clone().filter(|_| moves && !self.flow.ended && !self.in_modal_macro())
        else {
            return;
        };
        let depth = self.flow.calls.len();
        if self.call_by_name(&label, repeats, Some(arguments))
            && let Some(call) = self.flow.calls.get_mut(depth)
        {
            call.modal = true;
        }
    }

    /// G65; G66 has done its work already.
    pub(crate) fn call_macro(&mut self, words: &Words) {
        if !words.has_g(650) {
            return;
        }
        let repeats = words.get(b'L').unwrap_or(1.0).clamp(0.0, 1e9) as u64;
        let number = words.get(b'P').map_or(0, |p| p.max(0.0) as u64);
        let arguments = arguments(words);
        let span = words.g.first().map_or_else(Span::default, |g| g.1);
        self.doubt_of_computed_routine(words, span);
        if !self.call_by_name(&number.to_string(), repeats, Some(arguments)) {
            self.no_routine(span, &format!("macro {number}"));
        }
    }

    /// Does M99 P to this block begin the program again, as M99 alone does: nothing was cut before it, and nothing is counted behind it?
    fn begins_again(&self, target: u32) -> bool {
        let program = self.flow.source.program();
        let counts = |block: u32| {
            let mut kinds = program.tokens(BlockId(block)).map(|token| token.kind);
            let steers = |kind| matches!(kind, TokenKind::Name | TokenKind::Assignment | TokenKind::Routine);
            let moves_on = |kind| matches!(kind, TokenKind::Word(b'U' | b'V' | b'W') | TokenKind::Computed(_));
            let incremental = program
                .tokens(BlockId(block))
                .any(|token| token.kind == TokenKind::Word(b'G') && [91.0, 92.0, 52.0, 10.0].contains(&token.number));
            incremental || kinds.any(|kind| steers(kind) || moves_on(kind))
        };
        let cuts = |motion: &Move| motion.kind == MoveKind::Feed && motion.block.0 < target;
        !self.modal.incremental && !self.out.moves.iter().any(cuts) && !(target..self.block.id.0).any(counts)
    }

    fn return_word(&mut self, words: &Words, span: Span) {
        if !self.in_subprogram() {
            let target = words.get(b'P').and_then(|p| self.labels().numbered(p as u32, self.block.id.0));
            let (labels, here) = (self.labels(), self.block.id.0);
            let own = |block: &u32| labels.start_of_program(*block) == labels.start_of_program(here);
            let target = target.filter(own);
            if let Some(ahead) = target.filter(|target| *target > self.block.id.0) {
                return self.jump(ahead as usize);
            }
            if words.get(b'P').is_some() && !target.is_some_and(|target| self.begins_again(target)) {
                // It goes on there, for as long as only the control knows.
                self.doubt(Doubt::UnknownValue, span);
            }
            self.say("nc::endless-program", Severity::Note, span, "M99 begins the program again; one pass is read", "");
            self.uses_feed();
            self.flow.ended = true;
            return;
        }
        let target = words.get(b'P').map(|p| p as u32);
        let within = self.dialect().m99_stays_within && target.is_some();
        if !within {
            self.return_from_call();
        }
        if let Some(number) = target {
            let from = if within { self.block.id.0 } else { (self.flow.at as u32).saturating_sub(1) };
            let labels = self.labels();
            let own = |block: &u32| labels.start_of_program(*block) == labels.start_of_program(from);
            match labels.numbered(number, from).filter(own) {
                Some(block) => self.jump(block as usize),
                None => self.no_routine(span, &format!("N{number}")),
            }
        }
    }
}

/// The arguments of a macro call: the local variable of each letter.
fn arguments(words: &Words) -> Vec<(u32, f64)> {
    let letters = b"ABCDEFHIJKMQRSTUVWXYZ";
    let places = [1, 2, 3, 7, 8, 9, 11, 4, 5, 6, 13, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26];
    let value = |letter: u8| if letter == b'M' { words.m_value() } else { words.get(letter) };
    let argument = |(&letter, place): (&u8, u32)| value(letter).map(|value| (place, value));
    letters.iter().zip(places).filter_map(argument).collect()
}
