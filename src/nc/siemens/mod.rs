//! The family of Siemens 840D. In: blocks of its texts. Out: their words, and the flow of the program.

mod blocks;
mod calls;
mod frames;
mod jumps;
pub(crate) mod lex;
pub(super) mod state;
mod structures;
mod unroll;
mod ways;

use std::collections::BTreeSet;

use blocks::archived;
pub use blocks::is_setting;
use state::Siemens;

use super::environment::Environment;
use super::interp::interpreter::{Family, Interpreter, Setting};
use super::interp::labels::{Labels, OLine, Way};
use super::interp::state::After;
use super::interp::unroll::{Executed, Plain, Record};
use super::interp::words::Words;
use super::program::Program;
use super::token::{Token, TokenKind};
use crate::diag::Span;
use crate::ids::BlockId;

/// Variables of the control that hold the feed.
const FEEDS: [&[u8]; 4] = [b"$P_F", b"$AC_F", b"$AC_VC", b"$AC_VACTB"];

impl Family for Siemens {
    const OWN_VARIABLES: bool = true;
    const EDGES_BY_D: bool = true;

    fn new() -> Self {
        Self {
            modal_call: None,
            passed: Vec::new(),
            defined: BTreeSet::new(),
            whole: BTreeSet::new(),
            through: [None; 3],
        }
    }

    fn block(run: &mut Interpreter<'_, Self>, block: BlockId, words: &mut Words) -> After {
        run.siemens(block, words)
    }

    fn setting(run: &mut Interpreter<'_, Self>, code: u16, _place: Span, words: &Words) -> Setting {
        run.siemens_setting(code, words)
    }

    /// A shift by G58 or G59 is not followed.
    fn takes_all_words(run: &mut Interpreter<'_, Self>, words: &Words) -> bool {
        let place = words.g.iter().find(|(code, _)| matches!(code, 580 | 590)).map(|(_, place)| *place);
        let Some(place) = place.filter(|_| blocks::shifts_frame(words)) else { return false };
        if words.has_any(b"FSTMDH") {
            // Nothing of the block takes effect here.
            run.doubt_of_unread(place);
        }
        run.lose_frame(place, "a shift by G58 or G59", "TRANS with the sum of the shifts is followed");
        true
    }

    fn calls_after_motions(run: &Interpreter<'_, Self>) -> bool {
        run.modal_call_kept()
    }

    fn after_motion(run: &mut Interpreter<'_, Self>, words: &Words, moved: bool) {
        if moved {
            run.modal_cycle(words);
        }
    }

    fn before_value(run: &mut Interpreter<'_, Self>, text: &[u8]) {
        let text = text.to_ascii_uppercase();
        if FEEDS.iter().any(|name| text.windows(name.len()).any(|part| part == *name)) {
            run.uses_feed();
        }
    }

    fn ways(labels: &Labels, program: &Program, block: BlockId) -> Vec<Way> {
        ways::ways(labels, program, block)
    }

    fn label(labels: &mut Labels, program: &Program, block: BlockId) {
        if let Some(step) = structures::step(program, block) {
            labels.structures.push((block.0, step));
        }
        for token in program.tokens(block) {
            let bytes = token.span.of(program.text());
            match token.kind {
                TokenKind::Percent => {
                    if let Some(label) = archived(bytes) {
                        labels.o_lines.push(OLine { block: block.0, label, keyword: String::new() });
                    }
                }
                TokenKind::Label => {
                    let label = String::from_utf8_lossy(bytes).to_ascii_uppercase();
                    labels.names.push((label.trim_end_matches(':').trim().to_owned(), block.0));
                }
                _ => {}
            }
        }
    }

    fn variable_name(number: u32) -> String {
        super::parameters::local_name('R', number)
    }

    fn head(record: &mut Record, line: &[u8]) {
        if line.starts_with(b"%_N_") {
            record.text.extend_from_slice(line);
        }
    }

    fn plain(executed: &Executed<'_, Self>, token: &Token, _record: &mut Record) -> Plain {
        unroll::plain(executed, token)
    }

    fn has_flow_control(program: &Program, environment: &Environment<'_>) -> bool {
        unroll::FlowSearch { program, environment, calls: Vec::new() }.has_flow_control()
    }
}
