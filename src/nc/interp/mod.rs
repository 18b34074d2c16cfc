//! The modal interpreter. In: a [`Program`] and its [`Environment`]. Out: a [`Toolpath`]. One block is gathered into words
//! (`line`), its settings are put in force (`settings`, `offsets`), then its motion is made (`motion`, `arc`).

mod approach;
mod arc;
mod budget;
mod calls;
mod compensation;
mod corner;
mod cycles;
mod doubts;
mod expand;
mod expand_text;
mod faults;
mod flow;
mod heidenhain;
mod heidenhain_cycles;
mod heidenhain_flow;
mod labels;
mod line;
mod known;
mod meeting;
mod motion;
mod offsets;
mod pitch;
mod said;
mod settings;
mod shared;
mod siemens;
mod siemens_calls;
mod siemens_flow;
mod siemens_frames;
mod siemens_jumps;
mod state;

use std::collections::BTreeSet;
use std::rc::Rc;
use std::sync::Arc;

pub(super) use calls::routine_exists;
pub use expand::{Expanded, expand, plain_feeds};
pub use siemens::is_setting;
pub(super) use siemens::is_variable;

use approach::Approach;
use calls::{Call, ModalMacro, Source};
use compensation::{Active, Contour};
use corner::{Corner, Leg};
use cycles::Cycle;
use doubts::Raised;
use flow::After;
use labels::Labels;
use line::Line;
use siemens_calls::ModalCall;
use state::{FeedWord, Frame, Modal, Motion};

use super::dialect::{Dialect, Syntax};
use super::doubt::Doubt;
use super::environment::Environment;
use super::expr::{Parameters, Target};
use super::lex::{Token, TokenKind};
use super::program::{File, Program};
use super::toolpath::{Event, Freeze, Reached, State as MoveState, Toolpath};
use crate::diag::{Severity, Span};
use crate::ids::{BlockId, MoveId};
use crate::path::{Plane, Vec3};

/// Letters of words that do something by themselves: all but the number of a block and of a routine.
const WORDS: &[u8] = b"ABCDEFHIJKLPQRSTUVWXYZ";
/// G codes (times ten) whose axis words bring no axis to a place that is known: G4, G10, G28, G30, G5x.x, G65, G66, G68, G92.
const NO_PLACE: [u16; 18] = [40, 100, 280, 300, 500, 501, 510, 511, 520, 530, 650, 660, 661, 680, 920, 921, 922, 923];
/// Moves of a chunk of [`interpret_each`].
const CHUNK: usize = 4096;

/// Interprets a program; never fails. What is not understood is diagnosed, and the feed of its block frozen.
pub fn interpret(program: &Program, environment: &Environment<'_>) -> Toolpath {
    let mut run = Run::new(program, environment);
    run.execute_all();
    if run.undecided {
        let refused = std::mem::take(&mut run.refused);
        run = Run { refused_before: refused, deciding: true, ..Run::new(program, environment) };
        run.execute_all();
    }
    run.finish()
}

/// Interprets a program together with the files it calls, with the block-delete switch off and on: the linked program
/// ([`Program::with_files`]), and what it does in this environment.
pub fn linked(program: &Program, environment: &Environment<'_>) -> (Program, Toolpath) {
    let (mut program, mut path) = (program.clone(), interpret(program, environment));
    let known = program.files().len();
    if path.files.len() > known {
        program = program.with_files(path.files.clone());
    }
    if program.has_block_delete() {
        let switched = Environment { block_delete: !environment.block_delete, ..environment.clone() };
        let files = interpret(&program, &switched).files;
        if files.len() > program.files().len() {
            program = program.with_files(files);
        }
    }
    if program.files().len() > known {
        path = interpret(&program, environment);
    }
    (program, path)
}

/// As [`interpret`], but hands the toolpath out in chunks as it grows, so that a program of any length takes little
/// memory. Ids count from 0 in each chunk; [`super::Move::shared`] and [`Toolpath::doubts`] need the whole program and are
/// not set.
pub fn interpret_each(program: &Program, environment: &Environment<'_>, mut chunk: impl FnMut(&Toolpath)) {
    let mut run = Run::new(program, environment);
    run.reserve_parameters();
    let mut line = Line::default();
    while !run.ended {
        run.step(&mut line);
        if run.out.moves.len() >= CHUNK && run.compensation.is_none() {
            chunk(&run.out);
            run.out.moves.clear();
            run.out.between.clear();
            run.out.doubts.clear();
            run.cycle_moves.clear();
        }
    }
    chunk(&run.out);
}

/// Interprets a program and notes down what is executed.
fn execute_recorded(program: &Program, environment: &Environment<'_>) -> (expand::Record, Toolpath) {
    let mut run = Run::new(program, environment);
    run.record = Some(expand::Record::default());
    run.execute_all();
    (run.record.take().unwrap_or_default(), run.out)
}

/// An interpretation under way.
struct Run<'a> {
    program: &'a Program,
    env: &'a Environment<'a>,
    out: Toolpath,
    modal: Modal,
    /// States of the last rapid and of the last feed move.
    states: [Option<Arc<MoveState>>; 2],
    frame: Frame,
    /// Programmed position, mm, before rotation, scaling and shift.
    programmed: Vec3,
    /// Position of the tool, mm, in the work offset.
    tool: Vec3,
    /// Has this axis been commanded, or was its position known from the start?
    known: [bool; 3],
    /// May this axis stand elsewhere than it is taken to: with the block-delete switch on, after a probing move, after what
    /// was not understood, at a reference point that the setup does not give? Until it is commanded to an absolute place.
    elsewhere: [bool; 3],
    /// A probing move was made.
    probed: bool,
    /// The rotary zero was set anew while a rotary axis was turned.
    rotary_lost: bool,
    /// The work offset of the first motion, and those that the program sets otherwise than the setup has them.
    first_wcs: Option<u16>,
    last_wcs: u16,
    unstated: Vec<u16>,
    /// An S word was executed; nothing in the program switches the spindle.
    speed_said: bool,
    by_hand: bool,
    /// Rotary axes, deg.
    rotary: [f64; 3],
    /// The last motion turned one of them in a cut.
    rotary_range: bool,
    /// Next block.
    at: usize,
    ended: bool,
    /// Something of the program was seen (a `%` now ends it).
    began: bool,
    /// A T word alone brings the tool in.
    t_changes_tool: bool,
    /// The block being executed.
    block: BlockId,
    /// Something in the block cannot be read: it sets nothing.
    misread: Option<Span>,
    /// Why the moves of this block must stay.
    freeze: Option<Freeze>,
    /// May the moves of this block be cut in pieces?
    splittable: bool,
    /// Length of the contour that the block programs, mm, where the tool runs beside it: its time is that of this length.
    contour_mm: Option<f64>,
    /// How often each code was said.
    said: Vec<(&'static str, u32)>,
    /// What is said of each doubt.
    raised: [Raised; Doubt::ALL.len()],
    parameters: Parameters,
    /// Assignments of the block, in force once it is read.
    assignments: Vec<(Target, f64)>,
    /// The text being executed; 0 is the main one, 1 the first of `files` …
    source: Source<'a>,
    source_id: usize,
    files: Vec<File>,
    /// Routines that no file was found for.
    missing: BTreeSet<String>,
    labels: Vec<Option<Rc<Labels>>>,
    calls: Vec<Call<'a>>,
    /// O-repeat loops under way: depth of calls, block, times left.
    repeats: Vec<(usize, u32, u64)>,
    /// Executions of each block of the main text so far; empty until the first jump.
    counts: Vec<u32>,
    /// Radius compensation in force.
    compensation: Option<Active>,
    /// G41/G42 is in force but moves nothing aside.
    contour_only: Contour,
    /// G41 or G42 is in force, whatever it does to the path.
    under_compensation: bool,
    /// The motions of a drilling or boring cycle are being made.
    in_cycle: bool,
    /// G41/G42 ranges seen so far.
    ranges: usize,
    /// Ranges a control would have to refuse in this pass, and in the one before.
    refused: Vec<usize>,
    refused_before: Vec<usize>,
    /// Wear offsets that the program set, mm.
    wear_set: Vec<(u32, f64)>,
    /// A range was read as if the control offset it, only to see whether it could.
    undecided: bool,
    /// The second pass, in which that is known.
    deciding: bool,
    /// Siemens: the cycle MCALL repeats.
    modal_call: Option<ModalCall>,
    /// Siemens: arguments of the call, until PROC gives them names.
    passed: Vec<Option<f64>>,
    /// Siemens: names of variables that DEF and PROC have made.
    defined: BTreeSet<String>,
    /// Siemens: the point that CIP goes through; a frame that is not followed is in force.
    through: [Option<f64>; 3],
    frame_lost: bool,
    /// How the corner between the last motion and the next is worked; the corner behind this block.
    corner: Option<(Corner, Span)>,
    next_corner: Option<(Corner, Span)>,
    /// Feed of the corner where it has its own, mm/s; the straight motion it cuts.
    corner_feed: Option<f64>,
    leg: Option<Leg>,
    /// Heidenhain: an approach that is made when the element it leads to is known.
    approach: Option<Approach>,
    /// Heidenhain: centre of circles, cycle defined last, whether it is called at the end of this block, side of R.
    pole: Vec3,
    /// Heidenhain: planes of arcs about the pole and of everything else, frames that are not followed, the first preset.
    pole_plane: Plane,
    tool_plane: Plane,
    tilted: u8,
    first_preset: Option<f64>,
    cycle_number: u32,
    call_after: bool,
    compensation_side: u16,
    /// Heidenhain: what the radius of the tool exceeds that of the table by (DR), mm; the feed of the tool call, for FAUTO.
    oversize_mm: f64,
    tool_feed: FeedWord,
    /// Radius of polar coordinates (G16), mm, and angle, rad, as last written.
    polar: Option<(f64, f64)>,
    /// G66 is in force: the macro that is called after every motion.
    modal_macro: Option<ModalMacro>,
    /// The canned cycle in force.
    cycle: Option<Cycle>,
    /// Feed moves of drilling cycles, each with the block whose F word drives it.
    cycle_moves: Vec<(u32, BlockId)>,
    /// Bytes that may still be executed.
    budget: u64,
    /// What is executed is noted down here, if it is asked for.
    record: Option<expand::Record>,
}

impl<'a> Run<'a> {
    fn new(program: &'a Program, env: &'a Environment<'a>) -> Self {
        let start = env.start_mm.or(env.home_mm);
        let tool = start.unwrap_or_else(|| Vec3::new(0.0, 0.0, env.clear_z_mm));
        let retract_to_r = program.dialect() == Dialect::LinuxCnc;
        let modal = Modal { inch: env.inch, retract_to_r, tool: env.only_tool.unwrap_or(0), ..Modal::default() };
        Self {
            program,
            env,
            out: Toolpath::default(),
            modal,
            states: [None, None],
            frame: Frame::default(),
            programmed: tool,
            tool,
            known: [start.is_some(); 3],
            elsewhere: [false; 3],
            probed: false,
            rotary_lost: false,
            first_wcs: None,
            last_wcs: modal.wcs,
            unstated: Vec::new(),
            speed_said: false,
            by_hand: !env.speeds_rps.is_empty() && !has_m(program, &[3, 4]),
            rotary: [0.0; 3],
            rotary_range: false,
            at: 0,
            ended: false,
            began: false,
            t_changes_tool: program.dialect().t_changes_tool(has_m(program, &[6])),
            block: BlockId(0),
            misread: None,
            freeze: None,
            splittable: true,
            contour_mm: None,
            said: Vec::new(),
            raised: [Raised::default(); Doubt::ALL.len()],
            parameters: Parameters::default(),
            assignments: Vec::new(),
            source: Source::Main(program),
            source_id: 0,
            files: program.files().to_vec(),
            missing: BTreeSet::new(),
            labels: Vec::new(),
            calls: Vec::new(),
            repeats: Vec::new(),
            counts: Vec::new(),
            compensation: None,
            contour_only: Contour::Off,
            under_compensation: false,
            in_cycle: false,
            ranges: 0,
            refused: Vec::new(),
            refused_before: Vec::new(),
            wear_set: Vec::new(),
            undecided: false,
            deciding: false,
            modal_call: None,
            passed: Vec::new(),
            defined: BTreeSet::new(),
            through: [None; 3],
            frame_lost: false,
            corner: None,
            next_corner: None,
            corner_feed: None,
            leg: None,
            approach: None,
            pole: Vec3::zeros(),
            pole_plane: Plane::Xy,
            tool_plane: Plane::Xy,
            tilted: 0,
            first_preset: None,
            cycle_number: 0,
            call_after: false,
            compensation_side: 400,
            oversize_mm: 0.0,
            tool_feed: FeedWord { value: 0.0, word: None, computed: true },
            polar: None,
            modal_macro: None,
            cycle: None,
            cycle_moves: Vec::new(),
            budget: budget::first(program) + env.max_repeated_bytes,
            record: None,
        }
    }

    fn execute_all(&mut self) {
        self.out.moves.reserve(self.program.own_len());
        self.reserve_parameters();
        let mut line = Line::default();
        while !self.ended {
            self.step(&mut line);
        }
        self.approach_without_contour();
        self.faults_not_executed();
    }

    /// Executes the next block.
    fn step(&mut self, line: &mut Line) {
        self.end_sections();
        if self.at >= self.source.program().own_len() {
            self.end_of_text();
            return;
        }
        let block = BlockId(self.at as u32);
        let dialect = self.program.dialect();
        self.at += 1;
        self.block = block;
        if !self.pay(block) {
            return;
        }
        self.count();
        (self.misread, self.freeze, self.contour_mm) = (None, None, None);
        self.gather(block, line);
        if line.delete && self.env.block_delete {
            self.assignments.clear();
            self.next_corner = None;
            return;
        }
        self.begin(line);
        let source = self.record.as_ref().map(|_| (self.source.clone(), !self.in_subprogram()));
        let understood = self.freeze;
        let after = match dialect.syntax() {
            Syntax::Rs274 if line.flow => self.flow(block),
            Syntax::Rs274 => After::Words,
            Syntax::Siemens => self.siemens(block, line),
            Syntax::Heidenhain => self.heidenhain(block, line),
        };
        if let Some((source, own)) = source {
            if after == After::Done && self.freeze != understood {
                self.in_the_way("what is not understood here", None);
            }
            self.note_down(&source, own, block, line, after);
        }
        if after == After::Done {
            if let Some(place) = self.misread {
                self.set_aside(place);
            }
            return;
        }
        if dialect == Dialect::Grbl && self.source.program().line_text(block).starts_with(b"$") {
            let span = self.source.program().span(block);
            let text = "a command to the control, kept as it is";
            return self.say("nc::command", Severity::Note, span, text, "what it moves is not simulated");
        }
        self.complain(line);
        if line.any {
            self.began = true;
            if self.misread.is_none() {
                self.execute(line);
            }
            match self.misread {
                Some(place) => {
                    self.set_aside(place);
                    self.stops(line);
                }
                None => self.note_places(line),
            }
        }
    }

    /// After a block under the switch the axes it names (all, if it does more than move) may be elsewhere, until they are
    /// commanded to an absolute place.
    fn note_places(&mut self, line: &Line) {
        let moves = line.g.iter().all(|(code, _)| matches!(code, 0 | 10 | 20 | 30));
        let places = !line.g.iter().any(|(code, _)| NO_PLACE.contains(code)) && self.modal.motion != Motion::Probe;
        for (axis, letter) in b"XYZ".iter().enumerate() {
            let placed = places && line.has(*letter) && !self.modal.incremental;
            let named = line.delete && (line.has(*letter) || !moves);
            self.elsewhere[axis] = named || self.elsewhere[axis] && !placed;
        }
    }

    /// A block of which something cannot be read sets nothing: neither feed nor place nor mode. Where the tool is after it,
    /// and what else the control did, is not known.
    fn set_aside(&mut self, place: Span) {
        self.elsewhere = [true; 3];
        self.next_corner = None;
        if let Some((first, _)) = self.linked_at() {
            self.out.set_aside.push(BlockId(first + self.block.0));
        }
        self.doubt(Doubt::UnknownCode, place);
    }

    fn end_of_text(&mut self) {
        if self.source_id != 0 {
            self.return_from_call();
        } else {
            self.ended = true;
        }
    }

    /// Lexes a block into its words, with expressions evaluated.
    fn gather(&mut self, block: BlockId, line: &mut Line) {
        line.clear();
        let source = self.source.clone();
        let program = source.program();
        for token in program.tokens(block) {
            if line.take(token) {
                continue;
            }
            match token.kind {
                TokenKind::Computed(letter) => self.computed_word(letter, token, program.text(), line),
                TokenKind::Corner(letter) => self.corner_word(letter, token, line),
                _ if program.dialect().syntax() != Syntax::Rs274 => line.flow = true,
                TokenKind::Assignment => self.read_assignment(token, program.text()),
                TokenKind::Expression if !line.flow => line.bad.push((token.kind, token.span)),
                // A name amid words is none that steers.
                TokenKind::Name if !line.flow && (!line.g.is_empty() || line.has_any(WORDS)) => {
                    line.bad.push((token.kind, token.span));
                }
                _ => line.flow = true,
            }
        }
    }

    /// `,R5.` and `,C2.` of Fanuc and Haas.
    fn corner_word(&mut self, letter: u8, token: Token, line: &mut Line) {
        if !matches!(self.program.dialect(), Dialect::Generic | Dialect::Fanuc | Dialect::Haas) {
            return line.bad.push((token.kind, token.span));
        }
        let size = token.number * self.modal.unit_mm();
        let corner = if letter == b'R' { Corner::Round(size) } else { Corner::Legs(size) };
        self.corner_after(corner, token.span);
    }

    /// A word whose value is an expression; `=` before it, `AC(…)`, `IC(…)` and a leading I (as 0x80) are other dialects'.
    fn computed_word(&mut self, letter: u8, token: Token, text: &[u8], line: &mut Line) {
        if let (b'T', Some(number)) = (letter, self.tool_by_name(token.span, text)) {
            return line.put(b'T', number, token.span, true);
        }
        let Some(value) = self.value(token, text) else { return };
        line.results.push((token.span, value));
        let bytes = token.span.of(text);
        let value_text =
            bytes[1..].trim_ascii_start().trim_ascii_start().strip_prefix(b"=").unwrap_or(&bytes[1..]).trim_ascii();
        let plain = letter & 0x7f;
        if !plain.is_ascii_alphabetic() {
            return self.not_understood(
                "nc::not-understood",
                token.span,
                "no letter stands before this value",
                "the word is left out",
            );
        }
        line.put(plain.to_ascii_uppercase(), value, token.span, true);
        let starts = |mark: &[u8]| value_text.len() > 3 && value_text[..3].eq_ignore_ascii_case(mark);
        if letter >= 0x80 || starts(b"IC(") {
            line.force(plain.to_ascii_uppercase(), true);
        } else if starts(b"AC(") || starts(b"DC(") || starts(b"ACP") || starts(b"ACN") {
            line.force(plain, false);
        }
    }

    fn begin(&mut self, line: &Line) {
        self.apply_assignments();
        if line.delete {
            self.freeze = Some(Freeze::BlockDelete);
        }
        if self.frame_lost {
            self.freeze = Some(Freeze::NotUnderstood);
        }
        if self.linked_at().is_none() {
            self.freeze = Some(Freeze::OtherFile);
        }
        self.splittable =
            self.calls.is_empty() && self.elsewhere == [false; 3] && !line.has_any(b"ST") && line.m.is_empty();
        self.splittable &= self.next_corner.is_none();
    }

    fn line_number(&self) -> u32 {
        self.program.line(self.main_block())
    }

    fn event(&mut self, event: Event) {
        self.out.between.push((self.next_move(), event));
    }

    fn finish(mut self) -> Toolpath {
        self.count_doubts();
        self.say_dialect();
        self.out.files = self.files;
        self.out.set_aside.sort_unstable();
        self.out.set_aside.dedup();
        self.out.reached = Reached { first: self.at.min(self.program.own_len()), counts: self.counts };
        pitch::keep(self.program, &mut self.out.moves);
        shared::number(&mut self.out.moves, &self.cycle_moves);
        self.out.moves.shrink_to_fit();
        self.out.between.shrink_to_fit();
        self.out
    }

    fn next_move(&self) -> MoveId {
        MoveId(self.out.moves.len() as u32)
    }
}

/// Is there an M of one of these numbers (below 10) anywhere in the program?
fn has_m(program: &Program, numbers: &[u8]) -> bool {
    let text = program.text();
    let candidate = |&at: &usize| {
        let rest = &text[at + 1..];
        let digit = rest.iter().position(|byte| !matches!(byte, b' ' | b'0')).unwrap_or(rest.len());
        let asked = rest.get(digit).is_some_and(|byte| numbers.iter().any(|number| b'0' + number == *byte));
        asked && !rest.get(digit + 1).is_some_and(u8::is_ascii_digit)
    };
    let is_word = |at: usize| {
        let block = program.block_at(at as u32);
        program.tokens(block).any(|token| token.span.start == at as u32 && token.kind == TokenKind::Word(b'M'))
    };
    memchr::memchr2_iter(b'M', b'm', text).filter(candidate).any(is_word)
}
