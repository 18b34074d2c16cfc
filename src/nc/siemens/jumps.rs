//! Jumps and repeated sections of Siemens 840D: GOTOF, GOTOB, GOTO, GOTOC, GOTOS, IF … GOTO, CASE, REPEAT and REPEATB with
//! labels. In: the tokens of a block. Out: where the run goes on. Labels belong to their program of the text.
//!
//! `REPEAT A P=n` repeats from A up to itself n times more; where A lies behind it, up to ENDLABEL. `REPEAT A B P=n` repeats
//! from A to B, `REPEATB A P=n` the block A alone.

use super::state::Siemens;
use super::structures::name;
use crate::diag::{Severity, Span};
use crate::nc::doubt::Doubt;
use crate::nc::interp::interpreter::Interpreter;
use crate::nc::interp::words::Words;
use crate::nc::token::{Token, TokenKind};

/// Which way a jump looks for its target.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    Forward,
    Back,
    /// Forward, then back.
    Either,
    /// Back, then forward.
    BackFirst,
}

impl Interpreter<'_, Siemens> {
    /// `GOTOF LABEL`, `GOTOB N100`, `IF condition GOTOF LABEL`.
    pub(crate) fn siemens_jump(&mut self, tokens: &[Token], text: &[u8]) {
        let Some(goto) = next_goto(tokens, text) else {
            let why = "this jump is not followed";
            return self.not_understood("nc::not-understood", tokens[0].span, why, "");
        };
        if goto > 0 {
            let start = tokens[0].span.start + name(&tokens[0], text).len() as u32;
            let condition = Span { start, end: tokens[goto].span.start };
            match self.evaluate(condition, condition.of(text), 0) {
                Ok(value) if value != 0.0 => {}
                Ok(_) => return,
                Err(error) => return self.bad_expression(condition, &error),
            }
        }
        self.go(&tokens[goto..], text);
    }

    /// `CASE(expr) OF 1 GOTOF A 2 GOTOF B DEFAULT GOTOF C`.
    pub(crate) fn siemens_case(&mut self, tokens: &[Token], text: &[u8]) {
        let Some(of) = tokens.iter().position(|token| name(token, text) == "OF") else {
            return self.not_understood("nc::not-understood", tokens[0].span, "CASE without OF", "");
        };
        let start = tokens[0].span.start + name(&tokens[0], text).len() as u32;
        let what = Span { start, end: tokens[of].span.start };
        let value = match self.evaluate(what, what.of(text), 0) {
            Ok(value) => value,
            Err(error) => return self.bad_expression(what, &error),
        };
        let mut at = of + 1;
        while let Some(goto) = next_goto(&tokens[at.min(tokens.len())..], text) {
            let choice = Span { start: tokens[at].span.start, end: tokens[at + goto].span.start };
            let fits = name(&tokens[at], text) == "DEFAULT"
                || self.evaluate(choice, choice.of(text), 0).is_ok_and(|choice| choice == value);
            if fits {
                return self.go(&tokens[at + goto..], text);
            }
            at += goto + 2;
        }
    }

    /// Goes where `GOTO… target` says.
    fn go(&mut self, tokens: &[Token], text: &[u8]) {
        let word = name(&tokens[0], text);
        let way = match word.as_str() {
            "GOTOS" => {
                let first = self.labels().start_of_program(self.block.id.0);
                return self.jump(first as usize);
            }
            "GOTOF" => Way::Forward,
            "GOTOB" => Way::Back,
            _ => Way::Either,
        };
        let Some(target) = tokens.get(1) else {
            let why = format!("{word} without a target");
            return self.not_understood("nc::not-understood", tokens[0].span, why, "");
        };
        if let Some(block) = self.place_of(*target, text, way) {
            self.jump(block as usize);
        } else if word == "GOTOC" {
            // The control goes on with the next block only where there is no such label; one that is computed is not known here.
            if !matches!(target.kind, TokenKind::Name | TokenKind::Word(b'N')) || tokens.len() > 2 {
                self.doubt(Doubt::UnknownValue, target.span);
            }
        } else {
            let label = String::from_utf8_lossy(target.span.of(text)).into_owned();
            let text = format!("there is no label {label} there");
            self.end_without_target(target.span, text);
        }
    }

    /// The block with a label or an N number, in the same program of the text.
    fn place_of(&mut self, target: Token, text: &[u8], way: Way) -> Option<u32> {
        let label = String::from_utf8_lossy(target.span.of(text)).to_ascii_uppercase();
        let labels = self.labels();
        let here = self.block.id.0;
        let program = labels.start_of_program(here);
        let number = label.strip_prefix('N').and_then(|number| number.parse().ok());
        let numbered = number.and_then(|number: u32| labels.n_blocks.get(&number)).into_iter().flatten().copied();
        let named = labels.names.iter().filter(|(name, _)| *name == label).map(|(_, block)| *block);
        let places: Vec<u32> =
            named.chain(numbered).filter(|block| labels.start_of_program(*block) == program).collect();
        let ahead = places.iter().copied().filter(|block| *block > here).min();
        let behind = places.iter().copied().filter(|block| *block <= here).max();
        match way {
            Way::Forward => ahead,
            Way::Back => behind,
            Way::Either => ahead.or(behind),
            Way::BackFirst => behind.or(ahead),
        }
    }

    /// `REPEAT A`, `REPEAT A B`, `REPEATB A`, each with P for how many times more.
    pub(crate) fn repeat_section(&mut self, tokens: &[Token], text: &[u8], words: &Words) {
        let word = name(&tokens[0], text);
        let is_label = |token: &&Token| matches!(token.kind, TokenKind::Name | TokenKind::Word(b'N'));
        let targets: Vec<Token> = tokens[1..].iter().filter(is_label).copied().collect();
        let here = self.block.id.0;
        let places: Vec<Option<u32>> =
            targets.iter().map(|target| self.place_of(*target, text, Way::BackFirst)).collect();
        let section = match (word.as_str(), places.as_slice()) {
            ("REPEATB", [Some(only)]) => Some((*only, *only + 1)),
            ("REPEAT", [Some(first)]) if *first < here => Some((*first, here)),
            ("REPEAT", [Some(first)]) => self.end_label(*first).map(|end| (*first, end)),
            ("REPEAT", [Some(first), Some(last)]) if (*first..*last).contains(&here) => Some((*first, here)),
            ("REPEAT", [Some(first), Some(last)]) => Some((*first, *last + 1)),
            _ => None,
        };
        let times = words.get(b'P').unwrap_or(1.0).clamp(0.0, 1e9) as u64;
        if let Some((first, end)) = section.filter(|(first, end)| first < end && !(*first..*end).contains(&here)) {
            self.repeat_blocks(first as usize..end as usize, times);
        } else {
            self.end_without_target(tokens[0].span, "the blocks to be repeated are not there".to_owned());
        }
    }

    /// A target that is not found ends the run here. It may be in a variable (`GOTOF NAME`, `GOTOF "L"<<R1`): what is there then
    /// inherits the feed in force.
    fn end_without_target(&mut self, place: Span, text: String) {
        self.uses_feed();
        self.doubt(Doubt::UnknownValue, place);
        self.say("nc::no-target", Severity::Error, place, text, "the program ends here");
        self.flow.ended = true;
    }

    /// The end of a section that begins at `first` and is closed by ENDLABEL.
    fn end_label(&mut self, first: u32) -> Option<u32> {
        let labels = self.labels();
        let program = labels.start_of_program(first);
        let ends = labels.names.iter().filter(|(name, block)| name == "ENDLABEL" && *block > first);
        ends.map(|(_, block)| *block).find(|block| labels.start_of_program(*block) == program).map(|block| block + 1)
    }
}

/// Index of the first GOTO, GOTOF, GOTOB …
fn next_goto(tokens: &[Token], text: &[u8]) -> Option<usize> {
    tokens.iter().position(|token| token.kind == TokenKind::Name && name(token, text).starts_with("GOTO"))
}
