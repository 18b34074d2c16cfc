//! The family of Heidenhain plain language. In: blocks of its texts. Out: their words as ISO has them, and the flow of the program.

mod approach;
mod blocks;
mod cycles;
mod flow;
pub(crate) mod lex;
pub(super) mod state;
mod unroll;
mod ways;

use flow::plain_label;
use state::Heidenhain;

use super::environment::Environment;
use super::interp::interpreter::{Family, Interpreter};
use super::interp::labels::{Labels, Way};
use super::interp::state::{After, FeedWord};
use super::interp::unroll::{Executed, Plain, Record};
use super::interp::words::Words;
use super::program::Program;
use super::token::{Token, TokenKind};
use crate::ids::BlockId;
use crate::nc::toolpath::MoveKind;
use crate::path::{Plane, Vec3};

impl Family for Heidenhain {
    const CORNERS_BEHIND: bool = true;

    fn new() -> Self {
        Self {
            approach: None,
            pole: Vec3::zeros(),
            pole_plane: Plane::Xy,
            tool_plane: Plane::Xy,
            lost_frames: 0,
            first_preset: None,
            cycle_number: 0,
            call_after: false,
            compensation_side: 400,
            tool_feed: FeedWord { value: 0.0, word: None, computed: true },
            repeats: Vec::new(),
        }
    }

    fn begin(run: &mut Interpreter<'_, Self>) {
        run.reserve_parameters();
    }

    fn end(run: &mut Interpreter<'_, Self>) {
        run.approach_without_contour();
    }

    fn block(run: &mut Interpreter<'_, Self>, block: BlockId, words: &mut Words) -> After {
        run.heidenhain(block, words)
    }

    fn before_motion(run: &mut Interpreter<'_, Self>, kind: MoveKind, direction: Option<Vec3>) {
        match direction {
            Some(direction) => run.approach_along(kind, direction),
            None => run.approach_without_contour(),
        }
    }

    fn after_motion(run: &mut Interpreter<'_, Self>, _words: &Words, _moved: bool) {
        if std::mem::take(&mut run.family.call_after) {
            run.call_cycle(run.flow.source.program().span(run.block.id));
        }
    }

    fn ways(labels: &Labels, program: &Program, block: BlockId) -> Vec<Way> {
        ways::ways(labels, program, block)
    }

    /// `LBL 1` and `LBL "NAME"`, where they stand, not where they are called.
    fn label(labels: &mut Labels, program: &Program, block: BlockId) {
        let text = program.text();
        let (mut name, mut called): (&[u8], bool) = (b"", false);
        for token in program.tokens(block) {
            let is = |word: &[u8]| name.eq_ignore_ascii_case(word);
            match token.kind {
                TokenKind::Name => {
                    called |= is(b"CALL") || is(b"GOTO");
                    name = token.span.of(text);
                }
                TokenKind::Expression if is(b"LBL") && !called => {
                    labels.names.push((plain_label(&token, text), block.0));
                }
                _ => {}
            }
        }
    }

    fn variable_name(number: u32) -> String {
        super::parameters::local_name('Q', number)
    }

    fn obstacles(executed: &Executed<'_, Self>, record: &mut Record) {
        unroll::obstacles(executed, record);
    }

    fn is_left_out(executed: &Executed<'_, Self>, record: &mut Record) -> bool {
        let steers = unroll::is_left_out(executed);
        record.ended |= !steers && unroll::is_end(executed);
        steers
    }

    fn unnumbered(line: &[u8]) -> &[u8] {
        unroll::unnumbered(line)
    }

    fn foot(program: &Program, record: &Record) -> Vec<u8> {
        if record.ended { Vec::new() } else { unroll::end_of(program, record.numbers) }
    }

    fn plain(executed: &Executed<'_, Self>, token: &Token, record: &mut Record) -> Plain {
        unroll::plain(executed, token, record)
    }

    fn has_flow_control(program: &Program, _environment: &Environment<'_>) -> bool {
        program.blocks().any(|block| unroll::has_flow_control(program, block))
    }
}
