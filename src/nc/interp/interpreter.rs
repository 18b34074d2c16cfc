//! The interpreter: executes one block after the other as a control does. In: a [`Program`] and its [`Environment`]. Out: a [`Toolpath`].
//!
//! For each block: its tokens are gathered into words (`words.rs`); its family of dialects reads what is more than words
//! ([`Family::block`]); its settings are put in force (`settings.rs`, `offsets.rs`); its motion is made (`motion.rs`, `arc.rs`, `cycles.rs`).

use std::collections::BTreeMap;
use std::sync::Arc;

use super::flow::{Flow, Source, cost_of_one_pass};
use super::labels::{Labels, Way};
use super::state::{
    After, ArcFeed, BlockState, Compensation, Contour, Corner, Corners, Cycles, Frame, Messages, Modal, Motion,
    Offsets, Place, Rotary, Spindle, ToolLength,
};
use super::unroll::{Executed, Plain, Record};
use super::words::Words;
use super::{shared_feeds, thread_feeds};
use crate::diag::{Severity, Span};
use crate::ids::{BlockId, MoveId};
use crate::nc::dialect::Properties;
use crate::nc::doubt::Doubt;
use crate::nc::environment::Environment;
use crate::nc::parameters::Parameters;
use crate::nc::program::Program;
use crate::nc::token::{Token, TokenKind};
use crate::nc::toolpath::{Event, Freeze, MoveKind, Reached, State, Toolpath};
use crate::path::Vec3;

/// G codes (times ten) whose axis words bring no axis to a place that is known: G4, G10, G28, G30, G5x.x, G65, G66, G68, G92.
const NO_PLACE: [u16; 18] = [40, 100, 280, 300, 500, 501, 510, 511, 520, 530, 650, 660, 661, 680, 920, 921, 922, 923];

/// A family of dialects: how its blocks are read where they are more than words, and what only its controls remember.
///
/// A value of this type is that memory; the functions get the whole interpreter. Defaults do what ISO 6983 says.
pub(crate) trait Family: Sized {
    /// Does a subprogram have local variables even if it is called without arguments?
    const OWN_VARIABLES: bool = false;
    /// Does D select the edge of the tool, and with it its length? Else H does.
    const EDGES_BY_D: bool = false;
    /// May a corner (rounding, chamfer) stand in a block after the motion that it shortens?
    const CORNERS_BEHIND: bool = false;

    /// A control just switched on.
    fn new() -> Self;
    /// Before the first block.
    fn begin(_run: &mut Interpreter<'_, Self>) {}
    /// After the last block.
    fn end(_run: &mut Interpreter<'_, Self>) {}

    /// Takes in a token that is not a plain word. By default it marks the block as more than words.
    fn token(_run: &mut Interpreter<'_, Self>, _token: Token, _text: &[u8], words: &mut Words) {
        words.beyond = true;
    }
    /// Executes what is more than words in a block, and turns the rest into words of ISO 6983.
    fn block(run: &mut Interpreter<'_, Self>, block: BlockId, words: &mut Words) -> After;
    /// Puts a G code (times ten) in force that has a meaning of its own in this family.
    fn setting(_run: &mut Interpreter<'_, Self>, _code: u16, _place: Span, _words: &Words) -> Setting {
        Setting::AsEverywhere
    }
    /// Were all words of the block arguments of a call that has been made?
    fn takes_all_words(_run: &mut Interpreter<'_, Self>, _words: &Words) -> bool {
        false
    }
    /// Is a macro called after every motion, so that the feeds of these blocks also act in the macro?
    fn calls_after_motions(_run: &Interpreter<'_, Self>) -> bool {
        false
    }
    /// The routine that is called after every motion, by its name in lower case.
    fn called_after_motions(_run: &Interpreter<'_, Self>) -> Option<String> {
        None
    }
    /// Before an element of the contour that begins in this (programmed) direction; `None`: the contour is left.
    fn before_motion(_run: &mut Interpreter<'_, Self>, _kind: MoveKind, _direction: Option<Vec3>) {}
    /// After the motion of a block, if it `moved`.
    fn after_motion(_run: &mut Interpreter<'_, Self>, _words: &Words, _moved: bool) {}
    /// After everything else of a block: calls and returns.
    fn after_block(_run: &mut Interpreter<'_, Self>, _words: &Words) {}
    /// A routine is about to be left; `modal`: it was called after a motion.
    fn before_return(_run: &mut Interpreter<'_, Self>, _modal: bool) {}
    /// Before an expression is evaluated: sets the variables in it that the control maintains itself.
    fn before_value(_run: &mut Interpreter<'_, Self>, _text: &[u8]) {}
    /// Called when a numbered variable was read that was never set. Returns its number plus 1, or 0 where its value is known all the same.
    fn unset_variable(run: &mut Interpreter<'_, Self>, number: u32, place: Span) -> u32 {
        run.unknown_when_unrolled(place, number);
        number.saturating_add(1)
    }
    /// A numbered variable is set that may be the control's own.
    fn sets_variable(_run: &mut Interpreter<'_, Self>, _number: u32) {}
    /// Where a block may send the control: a jump, the end of a loop, a repeated section, a call.
    fn ways(labels: &Labels, program: &Program, block: BlockId) -> Vec<Way>;
    /// Adds the labels of a block.
    fn label(labels: &mut Labels, program: &Program, block: BlockId);

    /// Name of a numbered variable, as this family writes it.
    fn variable_name(number: u32) -> String;
    /// Does the control act on this comment?
    fn acts_on(_program: &Program, _comment: &[u8]) -> bool {
        false
    }
    /// Unrolling: notes what of a block cannot be unrolled.
    fn obstacles(_noted: &Executed<'_, Self>, _record: &mut Record) {}
    /// Unrolling: is a block left out, because all it does is to steer the flow?
    fn is_left_out(_noted: &Executed<'_, Self>, _record: &mut Record) -> bool {
        false
    }
    /// Unrolling: a line that is no block but heads the text.
    fn head(_record: &mut Record, _line: &[u8]) {}
    /// Unrolling: what ends the text.
    fn foot(_program: &Program, _record: &Record) -> Vec<u8> {
        Vec::new()
    }
    /// A line without its number, where the family counts its blocks.
    fn unnumbered(line: &[u8]) -> &[u8] {
        line
    }
    /// Unrolling: a token of a block.
    fn plain(executed: &Executed<'_, Self>, token: &Token, record: &mut Record) -> Plain;
    /// Does a program hold loops, jumps, calls, variables or expressions?
    fn has_flow_control(program: &Program, environment: &Environment<'_>) -> bool;
}

/// Whether a family has put a G code in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Setting {
    /// It means what it means everywhere.
    AsEverywhere,
    /// It is in force.
    Done,
    /// The motion of the block is in machine coordinates.
    Machine,
}

/// An interpretation under way.
pub(crate) struct Interpreter<'a, F> {
    pub(crate) program: &'a Program,
    pub(crate) env: &'a Environment<'a>,
    /// The toolpath so far.
    pub(crate) out: Toolpath,
    /// States of the last rapid and of the last feed move.
    pub(super) states: [Option<Arc<State>>; 2],
    /// What the family of dialects remembers.
    pub(crate) family: F,
    pub(crate) flow: Flow<'a>,
    pub(crate) block: BlockState,
    pub(crate) modal: Modal,
    pub(crate) frame: Frame,
    pub(crate) place: Place,
    pub(crate) rotary: Rotary,
    pub(super) offsets: Offsets,
    pub(super) spindle: Spindle,
    pub(crate) tool_length: ToolLength,
    pub(crate) compensation: Compensation,
    pub(crate) corners: Corners,
    pub(super) cycles: Cycles,
    pub(crate) parameters: Parameters,
    pub(super) messages: Messages,
    /// The executed blocks as plain text, where the program is being unrolled.
    pub(crate) record: Option<Record>,
}

impl<'a, F: Family> Interpreter<'a, F> {
    /// A control just switched on.
    pub(crate) fn new(program: &'a Program, env: &'a Environment<'a>) -> Self {
        let start = env.start_mm.or(env.home_mm);
        let tool = start.unwrap_or_else(|| Vec3::new(0.0, 0.0, env.clear_z_mm));
        let properties = program.dialect().properties();
        let modal = Modal {
            inch: env.inch,
            retract_to_r: properties.retract_to_r,
            arc_feed: if properties.arcs_feed_along_contour { ArcFeed::Contour } else { ArcFeed::Centre },
            tool: env.only_tool.unwrap_or(0),
            ..Modal::default()
        };
        Self {
            program,
            env,
            out: Toolpath::default(),
            states: [None, None],
            family: F::new(),
            flow: Flow {
                source: Source::Main(program),
                source_id: 0,
                at: 0,
                ended: false,
                began: false,
                files: program.files().to_vec(),
                missing: std::collections::BTreeSet::new(),
                branched: false,
                switch: None,
                labels: Vec::new(),
                calls: Vec::new(),
                counts: Vec::new(),
                begun: Vec::new(),
                entered: BTreeMap::new(),
                ways: BTreeMap::new(),
                looked: BTreeMap::new(),
                budget: cost_of_one_pass(program) + env.max_repeated_bytes,
            },
            block: BlockState {
                id: BlockId(0),
                misread: None,
                freeze: None,
                splittable: true,
                steps: false,
                placed: true,
                displaced: false,
                own_feed: None,
                contour_mm: None,
                contour_arc: None,
                assignments: Vec::new(),
            },
            modal,
            frame: Frame::default(),
            place: Place {
                programmed: tool,
                tool,
                known: [start.is_some(); 3],
                elsewhere: [false; 3],
                by_switch: [false; 3],
                displaced: [false; 3],
                assumed: [false; 3],
                probed: false,
            },
            rotary: Rotary::default(),
            offsets: Offsets { first: None, last: modal.wcs, unstated: Vec::new(), turned: Vec::new() },
            spindle: Spindle {
                speed_said: false,
                by_hand: !env.speeds_rps.is_empty() && !has_m(program, &[3, 4]),
                t_changes_tool: program.dialect().t_changes_tool(has_m(program, &[6])),
            },
            tool_length: ToolLength::default(),
            compensation: Compensation {
                active: None,
                contour: Contour::Off,
                on: false,
                ranges: 0,
                refused: Vec::new(),
                refused_before: Vec::new(),
                undecided: false,
                deciding: false,
                wear_set: Vec::new(),
                radius_written: Vec::new(),
                offsets_used: Vec::new(),
                d_alone: false,
                comes_back: false,
                oversize_mm: 0.0,
            },
            corners: Corners::default(),
            cycles: Cycles::default(),
            parameters: Parameters::new(program.dialect().language()),
            messages: Messages::default(),
            record: None,
        }
    }

    /// What is particular to the dialect.
    pub(crate) fn dialect(&self) -> &'static Properties {
        self.program.dialect().properties()
    }

    /// Executes the whole program; a second time where only the end of the first pass shows what G41 and G42 mean in it.
    pub(crate) fn run(program: &'a Program, env: &'a Environment<'a>) -> Toolpath {
        let mut run = Self::new(program, env);
        run.execute_all();
        if run.compensation.undecided {
            let refused = std::mem::take(&mut run.compensation.refused);
            run = Self::new(program, env);
            (run.compensation.refused_before, run.compensation.deciding) = (refused, true);
            run.execute_all();
        }
        run.finish()
    }

    /// Executes the whole program once and records the executed blocks as plain text.
    pub(crate) fn run_recorded(program: &'a Program, env: &'a Environment<'a>) -> (Record, Toolpath) {
        let mut run = Self::new(program, env);
        run.record = Some(Record::default());
        run.execute_all();
        (run.record.take().unwrap_or_default(), run.out)
    }

    fn execute_all(&mut self) {
        self.out.moves.reserve(self.program.own_len());
        F::begin(self);
        let mut words = Words::default();
        while !self.flow.ended {
            self.step(&mut words);
        }
        F::end(self);
    }

    /// Executes the next block.
    fn step(&mut self, words: &mut Words) {
        self.end_sections();
        if self.flow.at >= self.flow.source.program().own_len() {
            self.end_of_text();
            return;
        }
        let block = BlockId(self.flow.at as u32);
        self.flow.at += 1;
        self.block.id = block;
        if !self.charge(block) {
            return;
        }
        self.count();
        (self.block.misread, self.block.freeze, self.block.contour_mm) = (None, None, None);
        (self.block.own_feed, self.block.contour_arc) = (None, None);
        self.block.displaced = false;
        if self.flow.branched && self.may_be_reached_from_elsewhere(block) {
            self.place.displaced = [true; 3];
        }
        self.gather(block, words);
        if words.delete {
            self.doubt_of_switches(words.switch);
        }
        if words.delete && (self.env.block_delete || self.env.switches_on >> words.switch & 1 == 1) {
            self.block.assignments.clear();
            self.corners.next = None;
            return;
        }
        self.begin(words);
        let source = self.record.as_ref().map(|_| (self.flow.source.clone(), !self.in_subprogram()));
        let (understood, moves) = (self.block.freeze, self.out.moves.len());
        let after = F::block(self, block, words);
        if after == After::Done && self.block.displaced && self.out.moves.len() == moves {
            // A branch that only the control can decide.
            self.flow.branched = true;
            self.uses_feed();
        }
        if let Some((source, own)) = source {
            if after == After::Done && self.block.freeze != understood {
                self.cannot_unroll("what is not understood here", None);
            }
            self.record_block(&source, own, block, words, after);
        }
        if after == After::Done {
            if let Some(place) = self.block.misread {
                self.skip_unreadable(place);
            }
            return;
        }
        if after == After::Command {
            let span = self.flow.source.program().span(block);
            let text = "a command to the control, kept as it is";
            // Homing and jogging.
            if matches!(self.flow.source.program().line_text(block).get(1), Some(b'H' | b'h' | b'J' | b'j')) {
                self.place.elsewhere = [true; 3];
            }
            return self.say("nc::command", Severity::Note, span, text, "what it moves is not simulated");
        }
        self.diagnose_unreadable(words);
        if words.any {
            self.flow.began = true;
            if self.block.misread.is_none() {
                self.execute(words);
            }
        }
        match self.block.misread {
            // Text before the first word of a program is the leader of a tape.
            Some(place) if self.flow.began => {
                self.skip_unreadable(place);
                self.stops(words);
            }
            None if words.any => self.note_places(words),
            _ => {}
        }
    }

    /// Only two positions are simulated: every block-delete switch off, and every one on.
    fn doubt_of_switches(&mut self, number: u8) {
        if *self.flow.switch.get_or_insert(number) != number {
            self.doubt(Doubt::BlockDelete, self.flow.source.program().span(self.block.id));
        }
    }

    /// Has the block a number, a label or a word of the flow, so that a branch may lead to it?
    fn may_be_reached_from_elsewhere(&self, block: BlockId) -> bool {
        let marks = |token: Token| {
            matches!(token.kind, TokenKind::Word(b'N' | b'O') | TokenKind::Label | TokenKind::Routine | TokenKind::Name)
        };
        self.flow.source.program().tokens(block).any(marks)
    }

    /// An axis that is commanded to an absolute position stands there. After a block under the block-delete switch the axes that it names (all,
    /// if it does more than move) stand where the switch says.
    fn note_places(&mut self, words: &Words) {
        let moves = words.g.iter().all(|(code, _)| matches!(code, 0 | 10 | 20 | 30));
        let places = !words.g.iter().any(|(code, _)| NO_PLACE.contains(code)) && self.modal.motion != Motion::Probe;
        for (axis, letter) in b"XYZ".iter().enumerate() {
            let placed = places && words.has(*letter) && !self.modal.incremental;
            let named = words.delete && (words.has(*letter) || !moves);
            self.place.elsewhere[axis] &= !placed;
            self.place.by_switch[axis] = named || self.place.by_switch[axis] && !placed;
            self.place.displaced[axis] = self.block.displaced || self.place.displaced[axis] && !placed;
        }
    }

    /// Skips a block of which something cannot be read: it sets neither feed nor position nor mode. Where the tool is after it, and what
    /// else the control did, is then in doubt.
    fn skip_unreadable(&mut self, place: Span) {
        self.place.elsewhere = [true; 3];
        self.corners.next = None;
        self.doubt_of_unread(place);
    }

    fn end_of_text(&mut self) {
        if self.flow.source_id != 0 {
            self.return_from_call();
        } else {
            self.flow.ended = true;
        }
    }

    /// Lexes a block into its words, with expressions evaluated.
    fn gather(&mut self, block: BlockId, words: &mut Words) {
        words.clear();
        let source = self.flow.source.clone();
        let program = source.program();
        for token in program.tokens(block) {
            if words.take(token) {
                continue;
            }
            match token.kind {
                TokenKind::Computed(letter) => self.computed_word(letter, token, program.text(), words),
                TokenKind::Corner(letter) => self.corner_word(letter, token, words),
                _ => F::token(self, token, program.text(), words),
            }
        }
    }

    /// `,R5.` and `,C2.` of Fanuc and Haas.
    fn corner_word(&mut self, letter: u8, token: Token, words: &mut Words) {
        if !self.dialect().corner_words {
            return words.bad.push((token.kind, token.span));
        }
        let size = token.number * self.modal.unit_mm();
        let corner = if letter == b'R' { Corner::Round(size) } else { Corner::Legs(size) };
        self.corner_after(corner, token.span);
    }

    /// A word whose value is an expression; `=` before it, `AC(…)`, `IC(…)` and a leading I (as 0x80) are other dialects'.
    fn computed_word(&mut self, letter: u8, token: Token, text: &[u8], words: &mut Words) {
        if let (b'T', Some(number)) = (letter, self.tool_by_name(token.span, text)) {
            return words.put(b'T', number, token.span, true);
        }
        let Some(value) = self.value(token, text) else { return };
        words.results.push((token.span, value));
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
        words.put(plain.to_ascii_uppercase(), value, token.span, true);
        let starts = |mark: &[u8]| value_text.len() > 3 && value_text[..3].eq_ignore_ascii_case(mark);
        if letter >= 0x80 || starts(b"IC(") {
            words.force(plain.to_ascii_uppercase(), true);
        } else if starts(b"AC(") || starts(b"DC(") || starts(b"ACP") || starts(b"ACN") {
            words.force(plain, false);
        }
    }

    fn begin(&mut self, words: &Words) {
        self.apply_assignments();
        if words.delete {
            self.block.freeze = Some(Freeze::BlockDelete);
        }
        if self.frame.lost {
            self.block.freeze = Some(Freeze::NotUnderstood);
        }
        if self.linked_at().is_none() {
            self.block.freeze = Some(Freeze::OtherFile);
        }
        self.block.placed = self.place.known == [true; 3];
        self.block.splittable = self.flow.calls.is_empty()
            && self.place.elsewhere == [false; 3]
            && self.place.by_switch == [false; 3]
            && self.place.displaced == [false; 3]
            && !words.has_any(b"ST")
            && !LENGTH_OFFSETS.iter().any(|code| words.has_g(*code))
            && words.m.is_empty();
        self.block.steps = false;
        self.block.splittable &= self.corners.next.is_none();
    }

    pub(crate) fn line_number(&self) -> u32 {
        self.program.line(self.main_block())
    }

    pub(crate) fn event(&mut self, event: Event) {
        self.out.between.push((self.next_move(), event));
    }

    fn finish(mut self) -> Toolpath {
        self.count_doubts();
        self.say_dialect();
        self.out.files = self.flow.files;
        self.out.reached = Reached { first: self.flow.at.min(self.program.own_len()), counts: self.flow.counts };
        thread_feeds::keep(self.program, &mut self.out.moves);
        shared_feeds::number(&mut self.out.moves, &self.cycles.driven);
        self.out.moves.shrink_to_fit();
        self.out.between.shrink_to_fit();
        self.out
    }

    pub(crate) fn next_move(&self) -> MoveId {
        MoveId(self.out.moves.len() as u32)
    }
}

/// G codes that take another length offset in: with the first piece of a block the whole of it would come in.
const LENGTH_OFFSETS: [u16; 6] = [430, 431, 432, 434, 440, 490];

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
