//! From what each block needs to edits. In: the program, the plan of each block, the style of the file. Out: edits that change or insert F words,
//! put pieces and restated feeds before blocks, and add or replace our comments.
//!
//! The writer goes through the text in order and knows at each block whether the F in force is still the original's ([`FeedInForce`]). If it is not, a
//! line of its own restates the original F before a block that keeps its feed, holds flow control, changes the unit or depends on the
//! block-delete switch. So every label, call and jump is passed with the original F in force, and a block that a jump may reach states its feed
//! itself. In a file that Feedwright wrote before, unchanged blocks get no new notes.

use std::cell::OnceCell;

use crate::ids::BlockId;
use crate::machine::{Annotate, Job};
use crate::nc::{Dialect, FeedMode, Part, Program, Syntax, Toolpath};

use super::Stats;
use super::decimal::{Decimal, NumberStyle};
use super::edit::Edit;
use super::fword::{FeedUnit, round_down, round_down_to_whole};
use super::mark::{self, Note};
use super::memory::Memory;
use super::plan::{Plan, Want};
use super::split::{self, Block};
use super::view::{self, Manners, Modes, Switched, View, Word};
use crate::schedule::FeedPiece;

/// An F number as text and value, with the unit it is in.
#[derive(Debug, Clone, PartialEq)]
struct Feed {
    text: String,
    value: f64,
    mode: FeedMode,
    unit_mm: f64,
}

impl Feed {
    fn same(&self, other: &Feed) -> bool {
        let close = (self.value - other.value).abs() <= 1e-9 * self.value.abs();
        close && self.mode == other.mode && self.unit_mm == other.unit_mm
    }
}

/// The F in force at this place of the text being written.
#[derive(Debug, Clone, PartialEq)]
enum FeedInForce {
    /// The one the original has here.
    Original,
    /// One of ours, with the F it stands for.
    Ours(Feed, Option<String>),
    /// Either, because a jump may arrive here.
    Either,
}

/// How F words are written: letter with what follows it, and the number.
#[derive(Debug, Clone)]
struct FWordStyle {
    letter: Vec<u8>,
    style: NumberStyle,
}

/// Room for the block number and the F word of a piece, bytes.
const MOST_N_AND_F: usize = 20;

/// The writer's state.
pub struct Writer<'a> {
    pub(super) program: &'a Program,
    pub(super) part: Part<'a>,
    toolpath: &'a Toolpath,
    /// Blocks that cannot be read, by number.
    unread: Vec<BlockId>,
    /// Blocks in which something that is not simulated may use the feed in force.
    feed_uses: Vec<BlockId>,
    pub(super) job: &'a Job,
    pub(super) dialect: Dialect,
    pub(super) manners: Manners,
    pub(super) most_bytes: usize,
    pub(super) line_end: &'static [u8],
    /// Numbered blocks may be reached by a jump.
    jumps: OnceCell<bool>,
    modes: Modes,
    now: FeedInForce,
    /// The original F in force, where it is a plain number.
    original: Option<Feed>,
    /// The F word of another block that was read last: its place, its number as text and as value.
    word: Option<(crate::diag::Span, String, f64)>,
    /// G93, G94 or G95, times ten.
    feed_mode: u32,
    /// The F of the program that the input was optimised from (the original's, unless a note remembers another).
    reference: Option<String>,
    manner: FWordStyle,
    tool_changed: bool,
    pub(super) last_number: Option<f64>,
    pub(super) marked: bool,
    /// What an earlier run remembers here.
    pub(super) memory: Option<Memory>,
    /// Every F word of the output in order: its number, and the one it stands for.
    pub(super) words: Vec<(String, String)>,
    /// A word that was changed bears no note.
    pub(super) unnoted: bool,
    /// What was done.
    pub edits: Vec<Edit>,
    /// Counts.
    pub stats: Stats,
    /// Blocks left as they are, and why.
    pub kept: Vec<(BlockId, String)>,
}

/// Digits behind the point of the F that a piece would have had in inverse time; rounded up, so that a later run allows what this one allowed.
const REFERENCE_DIGITS: u32 = 4;

/// Changes of one block while they are gathered.
#[derive(Default)]
pub(super) struct Change {
    /// Lines before the block.
    pub(super) before: Vec<Line>,
    /// Edits inside its code.
    pub(super) edits: Vec<Edit>,
    /// Appended to its code.
    pub(super) append: Vec<u8>,
    pub(super) note: Option<Note>,
    /// Number of the F word that is put into the block or changed there.
    pub(super) feed: Option<String>,
    /// Leave a note that is already there.
    pub(super) leave_note: bool,
}

/// A line to be put before a block.
pub(super) struct Line {
    pub(super) code: Vec<u8>,
    pub(super) note: Option<Note>,
    /// Number of its F word, and the one that stands for.
    pub(super) feed: Option<(String, String)>,
}

/// The note beside a feed that is restated.
pub(super) fn kept_note(feed: &str, was: &str) -> Note {
    let was = (was != feed).then(|| was.to_owned());
    Note { feed: feed.to_owned(), was, kept: true, ..Note::default() }
}

impl<'a> Writer<'a> {
    /// A writer at the start of a text: the program's own, or that of a file.
    pub fn new(program: &'a Program, part: &Part<'a>, toolpath: &'a Toolpath, job: &'a Job) -> Self {
        let dialect = program.dialect();
        let manners = Manners::of(program, part);
        let letter = vec![if manners.lower { b'f' } else { b'F' }];
        let style = NumberStyle::of(b"0", manners.leading_zero);
        Self {
            program,
            part: part.clone(),
            toolpath,
            unread: toolpath.unread(),
            feed_uses: toolpath.blocks_that_use_the_feed(),
            job,
            dialect,
            manners,
            most_bytes: dialect.line_length(job.machine.max_line_length)
                - (view::line_end(part.span.of(program.text())).len() - 1),
            line_end: view::line_end(part.span.of(program.text())),
            jumps: OnceCell::new(),
            modes: Modes { inch: toolpath.inch, incremental: false },
            now: FeedInForce::Original,
            original: None,
            word: None,
            feed_mode: 940,
            reference: None,
            manner: FWordStyle { letter, style },
            tool_changed: false,
            last_number: None,
            marked: mark::is_marked(program, part),
            memory: Memory::of(program, part),
            words: Vec::new(),
            unnoted: false,
            edits: Vec::new(),
            stats: Stats::default(),
            kept: Vec::new(),
        }
    }

    /// Writes one block; blocks must come in order.
    pub fn block(&mut self, id: BlockId, plan: &Plan) {
        let view = View::of(self.program, id);
        let inch_before = self.modes.inch;
        self.modes = self.modes.after(Switched::by_codes(view.g_codes()));
        // After a change of unit the same F number would mean another feed.
        let unit_changes = self.modes.inch != inch_before;
        // What cannot be read puts nothing in force.
        let read = !self.is_unread(id);
        let mode = view.g_codes().filter(|code| read && matches!(code, 930 | 940 | 950)).last();
        let other_unit = mode.is_some_and(|mode| std::mem::replace(&mut self.feed_mode, mode) != mode);
        // Some controls read the number in force in the new unit.
        let handed_on = other_unit && self.uses_feed(id);
        if other_unit && !handed_on {
            self.forget_feed();
        }
        self.tool_changed |= view.tool_change();
        self.stats.f_words_before += view.words.iter().filter(|word| word.letter == b'F').count();
        let numbered = view.only(b'N').map(|word| word.number);
        if numbered.is_some() && self.may_insert() && self.now != FeedInForce::Original && self.jumps() {
            self.now = FeedInForce::Either;
        }
        let change = match &plan.want {
            _ if handed_on => self.keep(id, &view, plan),
            Want::Feeds(pieces) if !view.flow && !view.delete => self.feeds(id, plan, &view, pieces),
            Want::Keep(why) => {
                self.kept.push((id, (*why).to_owned()));
                self.keep(id, &view, plan)
            }
            Want::Feeds(_) => {
                self.kept.push((id, "it steers the flow of the program".to_owned()));
                self.keep(id, &view, plan)
            }
            Want::Nothing if view.flow || view.delete || unit_changes || self.is_unread(id) || self.uses_feed(id) => {
                self.keep(id, &view, plan)
            }
            Want::Nothing => self.pass(&view),
        };
        self.emit(id, &view, change);
        if handed_on {
            self.forget_feed();
        }
        self.last_number = numbered.or(self.last_number);
        if view.ends() || id.0 > self.part.blocks.start && self.ends_text(id) {
            // The next block is reached from elsewhere, where no feed of ours is in force.
            self.now = FeedInForce::Original;
        } else if view.flow && !self.may_insert() && !self.program.files().is_empty() {
            // Plain language has no line of its own for a feed: behind the call of a file either may be in force.
            self.now = FeedInForce::Either;
        }
    }

    /// In another unit of feed none is in force.
    fn forget_feed(&mut self) {
        (self.original, self.now) = (None, FeedInForce::Original);
    }

    /// A `%` ends the text; of a Siemens only one that names the next program does.
    fn ends_text(&self, id: BlockId) -> bool {
        let mark: &[u8] = if self.dialect.syntax() == Syntax::Siemens { b"%_" } else { b"%" };
        self.program.line_text(id).starts_with(mark)
    }

    fn jumps(&self) -> bool {
        *self.jumps.get_or_init(|| view::jumps(self.program, &self.part))
    }

    /// A block without feed motion: its F word, if any, is the original's.
    fn pass(&mut self, view: &View) -> Change {
        self.take_original(view);
        Change { leave_note: true, ..Change::default() }
    }

    /// A block that keeps its bytes: the original F is put in force before it.
    fn keep(&mut self, id: BlockId, view: &View, plan: &Plan) -> Change {
        let mut change = Change { leave_note: true, ..Change::default() };
        let without = plan.first.is_some() && plan.word.is_none();
        let aside = self.is_unread(id);
        let own = without || (view.has(b'F') || view.computed_feed) && !view.delete && !aside;
        let restates_itself = own && !self.uses_feed(id);
        if !restates_itself && self.now != FeedInForce::Original && !self.may_insert() {
            self.say_original(view, plan, &mut change);
        } else if !restates_itself && self.now != FeedInForce::Original {
            let word = plan.word.filter(|_| !view.has(b'F'));
            let inherited = word.and_then(|(block, span)| self.written_feed(block, span)).or(self.original.clone());
            match inherited {
                Some(feed) => {
                    let was = match word {
                        Some((_, span)) => self.was_at(span.start, &feed.text),
                        None => self.restated_was(&feed.text),
                    };
                    let note = Some(kept_note(&feed.text, &was));
                    change.before.push(Line { code: self.f_word(&feed.text), note, feed: Some((feed.text, was)) });
                    self.now = FeedInForce::Original;
                }
                None => self.kept.push((id, "the feed before a kept block could not be restated".to_owned())),
            }
        }
        if !aside {
            self.take_original(view);
        }
        change
    }

    /// Can something in the block not be read? Whether the control takes its F is then not known, so the original F has to be in force both
    /// before and after it.
    fn is_unread(&self, id: BlockId) -> bool {
        self.unread.binary_search(&id).is_ok()
    }

    /// May something in the block that is not simulated use the feed in force?
    fn uses_feed(&self, id: BlockId) -> bool {
        self.feed_uses.binary_search(&id).is_ok()
    }

    /// The original feed for which the F in force stands.
    pub(super) fn restated_was(&self, feed: &str) -> String {
        self.reference.clone().filter(|_| self.memory.is_some()).unwrap_or_else(|| feed.to_owned())
    }

    /// In plain language, writes the original F into a motion that keeps its feed.
    fn say_original(&mut self, view: &View, plan: &Plan, change: &mut Change) {
        let word = plan.word.and_then(|(block, span)| self.written_feed(block, span));
        let per_block = |feed: &Feed| feed.mode == FeedMode::InverseTime;
        let Some(feed) = word.filter(|feed| !per_block(feed) && !view.flow && !view.delete && plan.first.is_some())
        else {
            return;
        };
        change.append = [b" ".as_slice(), &self.f_word(&feed.text)].concat();
        change.feed = Some(feed.text);
        self.stats.f_words_inserted += 1;
        self.now = FeedInForce::Original;
    }

    /// The F of the block comes from the input: the original's feed is in force after it.
    fn take_original(&mut self, view: &View) {
        if let Some(word) = view.words.iter().rfind(|word| word.letter == b'F') {
            let mode = self.original.as_ref().map_or(FeedMode::PerMinute, |feed| feed.mode);
            self.remember(word, mode);
            if !view.delete {
                self.now = FeedInForce::Original;
            }
        } else if view.computed_feed {
            self.original = None;
            self.now = FeedInForce::Original;
        }
    }

    /// Notes the original feed and the manner of an F word of the input.
    fn remember(&mut self, word: &Word, mode: FeedMode) {
        let text = String::from_utf8_lossy(view::number_bytes(self.program, word)).into_owned();
        self.write_like(word);
        self.reference = Some(self.was_at(word.span.start, &text));
        self.original = Some(Feed { text, value: word.number, mode, unit_mm: self.feed_unit_mm() });
    }

    /// F words are written like this one from here on.
    fn write_like(&mut self, word: &Word) {
        let number = view::number_bytes(self.program, word);
        let bytes = word.span.of(self.program.text());
        let letter = bytes[..bytes.len() - number.len()].to_vec();
        self.manner = FWordStyle { letter, style: NumberStyle::of(number, self.manners.leading_zero) };
    }

    /// The F number that the word of the input at this byte stands for.
    pub(super) fn was_at(&self, start: u32, number: &str) -> String {
        let known = self.memory.as_ref().and_then(|memory| memory.was(start));
        known.unwrap_or(number).to_owned()
    }

    /// The F word at a place of the input, if its unit is the one in force.
    fn written_feed(&self, block: BlockId, span: crate::diag::Span) -> Option<Feed> {
        let view = View::of(self.program, block);
        let word = view.words.iter().find(|word| word.span == span)?;
        let text = String::from_utf8_lossy(view::number_bytes(self.program, word)).into_owned();
        let known = self.original.as_ref()?;
        Some(Feed { text, value: word.number, mode: known.mode, unit_mm: self.feed_unit_mm() })
    }

    pub(super) fn f_word(&self, number: &str) -> Vec<u8> {
        [self.manner.letter.as_slice(), number.as_bytes()].concat()
    }

    /// A block with new feeds.
    fn feeds(&mut self, id: BlockId, plan: &Plan, view: &View, pieces: &[FeedPiece]) -> Change {
        let Some(first) = plan.first else { return Change::default() };
        let motion = &self.toolpath.moves[first.ix()];
        if let Some(word) = view.only(b'F') {
            self.remember(word, motion.feed.mode);
        } else if let Some((block, span)) = plan.word {
            self.original = self.inherited(block, span, motion).or(self.original.take());
            let read = self.word.as_ref().filter(|(read, ..)| *read == span);
            self.reference = read.map(|(_, text, _)| self.was_at(span.start, text)).or(self.reference.take());
        }
        let numbers = if view.computed_feed { None } else { self.numbers(pieces, motion) };
        let Some(numbers) = numbers else {
            self.kept.push((id, "its feed cannot be written as an F word".to_owned()));
            return self.keep(id, view, plan);
        };
        let splits = numbers.len() > 1 && !(view.has(b'N') && self.jumps()) && !plan.repeated;
        if splits {
            let block = Block::new(self.program, self.toolpath, view, self.modes, self.manners, first);
            let rises = |pair: &[(FeedPiece, Feed)]| pair[1].0.feed_mm_s > pair[0].0.feed_mm_s;
            let cuts = numbers.windows(2).map(|pair| split::Cut { at_mm: pair[0].0.to_mm, rises: rises(pair) });
            let cuts: Vec<split::Cut> = cuts.collect();
            let short =
                |cut: &split::Pieces| cut.before.iter().all(|code| code.len() + MOST_N_AND_F <= self.most_bytes);
            if let Some(cut) = split::split(&block, &cuts).filter(short) {
                if view.has(b'F') && self.now == FeedInForce::Original {
                    self.now = FeedInForce::Either;
                }
                let numbers = self.numbers_of_times(pieces, &cut.at_mm, motion).unwrap_or(numbers);
                return self.cut(view, plan, &numbers, cut);
            }
        }
        let whole = if numbers.len() > 1 { self.least(pieces, motion) } else { numbers.into_iter().next() };
        let mut change = Change::default();
        if let Some((piece, feed)) = whole {
            self.last_feed(view, plan, &piece, &feed, &mut change);
        }
        change
    }

    fn inherited(&mut self, block: BlockId, span: crate::diag::Span, motion: &crate::nc::Move) -> Option<Feed> {
        if self.word.as_ref().is_none_or(|(known, ..)| *known != span) {
            let word = View::of(self.program, block).words.into_iter().find(|word| word.span == span)?;
            self.write_like(&word);
            let text = String::from_utf8_lossy(view::number_bytes(self.program, &word)).into_owned();
            self.word = Some((span, text, word.number));
        }
        let (_, text, value) = self.word.clone()?;
        Some(Feed { text, value, mode: motion.feed.mode, unit_mm: self.feed_unit_mm() })
    }

    /// Is the F in force another than the original's?
    pub(super) fn now_is_ours(&self) -> bool {
        self.now != FeedInForce::Original
    }

    /// The F of the program that the input was optimised from, for the words being written.
    pub(super) fn was_now(&self, feed: &str) -> String {
        self.reference.clone().unwrap_or_else(|| feed.to_owned())
    }

    /// Number of the original F in force.
    pub(super) fn original_feed(&self) -> Option<String> {
        self.original.as_ref().map(|feed| feed.text.clone())
    }

    fn feed_unit_mm(&self) -> f64 {
        self.program.dialect().feed_unit_mm(self.modes.inch)
    }

    /// In inverse time a block that stays whole has the time of its contour, which the tool may run beside.
    fn unit(&self, motion: &crate::nc::Move, length_mm: f64) -> FeedUnit {
        let contour_mm = || Some(crate::units::mm_min_from_mm_s(motion.feed.mm_s) / self.original.as_ref()?.value);
        let whole = motion.feed.mode == FeedMode::InverseTime && !motion.splittable;
        let length_mm = if whole { contour_mm().unwrap_or(length_mm) } else { length_mm };
        FeedUnit {
            mode: motion.feed.mode,
            unit_mm: self.feed_unit_mm(),
            rps: motion.spin.rps,
            length_mm,
            over_contour: motion.feed.over_contour,
        }
    }

    /// Pieces with their F numbers; neighbours with one number are one piece.
    fn numbers(&self, pieces: &[FeedPiece], motion: &crate::nc::Move) -> Option<Vec<(FeedPiece, Feed)>> {
        let whole = motion.curve().length();
        let mut out: Vec<(FeedPiece, Feed)> = Vec::new();
        let mut from = 0.0;
        for piece in pieces {
            let length = piece.to_mm.min(whole) - from;
            from = piece.to_mm.min(whole);
            let feed = self.number(piece.feed_mm_s, motion, if pieces.len() == 1 { whole } else { length })?;
            match out.last_mut() {
                Some((last, same)) if motion.feed.mode != FeedMode::InverseTime && same.same(&feed) => {
                    last.to_mm = piece.to_mm;
                }
                _ => out.push((*piece, feed)),
            }
        }
        Some(out)
    }

    /// In inverse time, where F belongs to the length of a piece: the numbers of pieces that are cut at these places. `None`: another unit.
    fn numbers_of_times(
        &self,
        pieces: &[FeedPiece],
        at_mm: &[f64],
        motion: &crate::nc::Move,
    ) -> Option<Vec<(FeedPiece, Feed)>> {
        let mut pieces = pieces.to_vec();
        if motion.feed.mode != FeedMode::InverseTime || pieces.len() != at_mm.len() + 1 {
            return None;
        }
        pieces.iter_mut().zip(at_mm).for_each(|(piece, at_mm)| piece.to_mm = *at_mm);
        self.numbers(&pieces, motion)
    }

    fn number(&self, feed_mm_s: f64, motion: &crate::nc::Move, length_mm: f64) -> Option<Feed> {
        let original = self.original.as_ref()?;
        let whole = (length_mm - motion.curve().length()).abs() <= 1e-9;
        let per_block = motion.feed.mode == FeedMode::InverseTime && !whole;
        if !per_block && (feed_mm_s - motion.feed.mm_s).abs() <= 1e-9 * motion.feed.mm_s {
            return Some(original.clone());
        }
        let style = self.manner.style;
        let unit = self.unit(motion, length_mm);
        // Without a point it may count hundredths: only a number without one is then in the unit of the original's.
        let number = if self.dialect.counts_feeds(self.modes.inch) && !style.point && style.digits == 0 {
            round_down_to_whole(feed_mm_s, unit)?
        } else {
            round_down(feed_mm_s, unit, style, self.dialect)?
        };
        Some(Feed { text: style.write(number), value: number.value(), ..original.clone() })
    }

    fn least(&self, pieces: &[FeedPiece], motion: &crate::nc::Move) -> Option<(FeedPiece, Feed)> {
        let piece = pieces.iter().copied().reduce(|a, b| if b.feed_mm_s < a.feed_mm_s { b } else { a })?;
        let feed = self.number(piece.feed_mm_s, motion, motion.curve().length())?;
        Some((piece, feed))
    }

    /// A block in pieces.
    fn cut(&mut self, view: &View, plan: &Plan, numbers: &[(FeedPiece, Feed)], cut: split::Pieces) -> Change {
        let mut change = Change { edits: cut.edits, ..Change::default() };
        let sep: &[u8] = if self.manners.spaced { b" " } else { b"" };
        let references = self.references_of(numbers, plan);
        let mut references = references.into_iter();
        for ((piece, feed), mut code) in numbers.iter().zip(cut.before) {
            self.reference = references.next().or(self.reference.take());
            let full = self.job.output.annotate == Annotate::Full;
            let mut note = self.note(piece, feed, plan).filter(|_| full);
            let says = self.must_say(feed, plan);
            if says {
                code.extend_from_slice(sep);
                code.extend(self.f_word(&feed.text));
                note = self.note(piece, feed, plan);
                self.now = self.now_after(feed);
            }
            let was = self.was_now(&feed.text);
            change.before.push(Line { code, note, feed: says.then(|| (feed.text.clone(), was)) });
        }
        if let Some((piece, feed)) = numbers.last() {
            self.reference = references.next().or(self.reference.take());
            self.last_feed(view, plan, piece, feed, &mut change);
        }
        change
    }

    /// In inverse time, where F belongs to the length of the block: the F that each piece would have had of the program this was optimised from, L/l
    /// times that of the block of length L. Empty in another unit, where it is that of the block.
    fn references_of(&self, numbers: &[(FeedPiece, Feed)], plan: &Plan) -> Vec<String> {
        let Some(first) = plan.first.filter(|_| numbers.iter().any(|(_, feed)| feed.mode == FeedMode::InverseTime))
        else {
            return Vec::new();
        };
        let whole_mm = self.toolpath.moves[first.ix()].curve().length();
        let Some(of_block) = self.reference.as_ref().and_then(|text| text.parse::<f64>().ok()) else {
            return Vec::new();
        };
        let mut from_mm = 0.0;
        let of_piece = |(piece, _): &(FeedPiece, Feed)| {
            let length_mm = piece.to_mm.min(whole_mm) - std::mem::replace(&mut from_mm, piece.to_mm);
            self.manner.style.write(Decimal::at_least(of_block * whole_mm / length_mm, REFERENCE_DIGITS))
        };
        numbers.iter().map(of_piece).collect()
    }

    fn now_after(&self, feed: &Feed) -> FeedInForce {
        if self.original.as_ref().is_some_and(|original| original.text == feed.text) {
            FeedInForce::Original
        } else {
            FeedInForce::Ours(feed.clone(), self.reference.clone())
        }
    }

    /// Does a block without an F word need one to run at this feed?
    fn must_say(&mut self, feed: &Feed, plan: &Plan) -> bool {
        let said = match &self.now {
            FeedInForce::Original => {
                self.original.as_ref().is_some_and(|original| original.same(feed)) && plan.word.is_some()
            }
            // A feed that stands for another one of the original is said again: a later run reads from each F word what it stands for.
            FeedInForce::Ours(ours, was) => ours.same(feed) && *was == self.reference && !self.tool_changed,
            FeedInForce::Either => false,
        };
        let says = !said || plan.repeated && self.now != FeedInForce::Original || feed.mode == FeedMode::InverseTime;
        self.tool_changed = false;
        says
    }

    /// The feed of the block itself (its last piece).
    fn last_feed(&mut self, view: &View, plan: &Plan, piece: &FeedPiece, feed: &Feed, change: &mut Change) {
        if let Some(word) = view.only(b'F') {
            let span = view::number_span(self.program, word);
            if span.of(self.program.text()) == feed.text.as_bytes() {
                change.leave_note = true;
            } else {
                change.edits.push(Edit::replace(span, feed.text.as_bytes()));
                change.feed = Some(feed.text.clone());
                self.stats.f_words_changed += 1;
            }
            self.tool_changed = false;
        } else if self.must_say(feed, plan) {
            if self.manners.spaced {
                change.append.push(b' ');
            }
            change.append.extend(self.f_word(&feed.text));
            change.feed = Some(feed.text.clone());
            self.stats.f_words_inserted += 1;
        } else {
            if self.job.output.annotate == Annotate::Full {
                change.note = self.note(piece, feed, plan);
            }
            return;
        }
        change.note = self.note(piece, feed, plan);
        self.now = self.now_after(feed);
    }

    /// The note for a feed, as far as annotation is asked for.
    fn note(&self, piece: &FeedPiece, feed: &Feed, plan: &Plan) -> Option<Note> {
        let differs = self.reference.as_ref().is_none_or(|reference| *reference != feed.text);
        let wanted = match self.job.output.annotate {
            Annotate::None => false,
            Annotate::Changes => differs,
            Annotate::Full => true,
        };
        let tool = plan.first.map(|id| self.toolpath.moves[id.ix()].tool).filter(|&tool| tool > 0);
        wanted.then(|| Note {
            feed: feed.text.clone(),
            was: self.reference.clone().filter(|_| differs),
            limit: Some(piece.limit),
            percent: piece.used.map(|used| (100.0 * used).round() as u32),
            tool,
            kept: false,
        })
    }
}
