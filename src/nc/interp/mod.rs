//! The modal interpreter. In: a [`Program`] and its [`Environment`]. Out: a [`Toolpath`]. One block is gathered into words
//! (`line`), its settings are put in force (`settings`, `offsets`), then its motion is made (`motion`, `arc`).

mod arc;
mod line;
mod motion;
mod offsets;
mod settings;
mod state;

use line::Line;
use state::{Frame, Modal};

use super::environment::Environment;
use super::lex::TokenKind;
use super::program::Program;
use super::toolpath::{Event, Freeze, Toolpath};
use crate::diag::{Diagnostic, Severity, Span};
use crate::ids::{BlockId, MoveId};
use crate::path::Vec3;

/// Diagnostics of one code that are kept; further ones are only counted.
const SAME_CODE: u32 = 100;

/// Interprets a program; never fails. What is not understood is diagnosed, and the feed of its block frozen.
pub fn interpret(program: &Program, environment: &Environment<'_>) -> Toolpath {
    let mut run = Run::new(program, environment);
    run.out.moves.reserve(program.len());
    run.out.events.reserve(program.len());
    let mut line = Line::default();
    while run.at < program.len() && !run.ended {
        let block = BlockId(run.at as u32);
        run.at += 1;
        run.gather(block, &mut line);
        if line.delete && environment.block_delete {
            continue;
        }
        if line.any || !line.bad.is_empty() {
            run.begin(block, &line);
            run.execute(&line);
        }
    }
    run.finish()
}

/// An interpretation under way.
struct Run<'a> {
    program: &'a Program,
    env: &'a Environment<'a>,
    out: Toolpath,
    modal: Modal,
    frame: Frame,
    /// Programmed position, mm, before rotation, scaling and shift.
    programmed: Vec3,
    /// Position of the tool, mm, in the work offset.
    tool: Vec3,
    /// Has this axis been commanded, or was its position known from the start?
    known: [bool; 3],
    /// Rotary axes, deg.
    rotary: [f64; 3],
    /// Next block.
    at: usize,
    ended: bool,
    /// A T word alone brings the tool in.
    t_changes_tool: bool,
    /// The block being executed.
    block: BlockId,
    /// Why the moves of this block must stay.
    freeze: Option<Freeze>,
    /// May the moves of this block be cut in pieces?
    splittable: bool,
    /// How often each code was said.
    said: Vec<(&'static str, u32)>,
}

impl<'a> Run<'a> {
    fn new(program: &'a Program, env: &'a Environment<'a>) -> Self {
        let start = env.start_mm.or(env.home_mm);
        let tool = start.unwrap_or_else(|| Vec3::new(0.0, 0.0, env.clear_z_mm));
        let modal = Modal { inch: env.inch, ..Modal::default() };
        Self {
            program,
            env,
            out: Toolpath::default(),
            modal,
            frame: Frame::default(),
            programmed: tool,
            tool,
            known: [start.is_some(); 3],
            rotary: [0.0; 3],
            at: 0,
            ended: false,
            t_changes_tool: program.dialect().t_changes_tool(has_m6(program)),
            block: BlockId(0),
            freeze: None,
            splittable: true,
            said: Vec::new(),
        }
    }

    /// Lexes a block into its words.
    fn gather(&mut self, block: BlockId, line: &mut Line) {
        line.clear();
        let program = self.program;
        for token in program.tokens(block) {
            if !line.take(token) {
                line.flow = true;
                line.bad.push((token.kind, token.span));
            }
        }
    }

    fn begin(&mut self, block: BlockId, line: &Line) {
        self.block = block;
        self.freeze = line.delete.then_some(Freeze::BlockDelete);
        self.splittable = !line.has_any(b"ST") && line.m.is_empty();
        for &(kind, span) in &line.bad {
            self.complain_about(kind, span);
        }
        if let Some((letter, span)) = line.repeated {
            let text = format!("{} stands twice in the block", char::from(letter));
            self.not_understood("nc::repeated-word", span, text, "keep one of the words");
        }
    }

    fn complain_about(&mut self, kind: TokenKind, span: Span) {
        if kind == TokenKind::OpenComment {
            self.say("nc::open-comment", Severity::Warning, span, "the comment is never closed", "close it with )");
        } else {
            self.not_understood("nc::not-understood", span, "this is not NC text of the dialect", "see --dialect");
        }
    }

    /// Diagnoses something that is kept but freezes the moves of its block.
    fn not_understood(&mut self, code: &'static str, span: Span, text: impl Into<String>, help: &str) {
        self.say(code, Severity::Warning, span, text, help);
        self.freeze = self.freeze.or(Some(Freeze::NotUnderstood));
    }

    fn say(&mut self, code: &'static str, severity: Severity, span: Span, text: impl Into<String>, help: &str) {
        let known = self.said.iter().position(|(name, _)| *name == code);
        let index = known.unwrap_or_else(|| {
            self.said.push((code, 0));
            self.said.len() - 1
        });
        self.said[index].1 += 1;
        if self.said[index].1 <= SAME_CODE {
            let line = self.program.line(self.block);
            self.out.diagnostics.push(Diagnostic::new(code, severity, text).at(line, span).help(help));
        }
    }

    fn line_number(&self) -> u32 {
        self.program.line(self.block)
    }

    fn event(&mut self, event: Event) {
        self.out.events.push(event);
    }

    fn finish(mut self) -> Toolpath {
        for &(code, count) in self.said.iter().filter(|(_, count)| *count > SAME_CODE) {
            let text = format!("{} more of {code} are not listed", count - SAME_CODE);
            self.out.diagnostics.push(Diagnostic::new(code, Severity::Note, text));
        }
        self.out.moves.shrink_to_fit();
        self.out.events.shrink_to_fit();
        self.out
    }

    fn next_move(&self) -> MoveId {
        MoveId(self.out.moves.len() as u32)
    }
}

/// Is there an M6 anywhere in the program?
fn has_m6(program: &Program) -> bool {
    let text = program.text();
    let candidate = |&at: &usize| {
        let rest = &text[at + 1..];
        let six = rest.iter().position(|byte| !matches!(byte, b' ' | b'0')).unwrap_or(rest.len());
        rest.get(six) == Some(&b'6') && !rest.get(six + 1).is_some_and(u8::is_ascii_digit)
    };
    let is_word = |at: usize| {
        let block = program.block_at(at as u32);
        program.tokens(block).any(|token| token.span.start == at as u32 && token.kind == TokenKind::Word(b'M'))
    };
    memchr::memchr2_iter(b'M', b'm', text).filter(candidate).any(is_word)
}
