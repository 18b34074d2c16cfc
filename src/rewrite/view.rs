//! One block of text as the rewriter needs it. In: the tokens of a line. Out: its plain words, its comments (the user's and ours), where its
//! code ends, what prevents changing it; and the modes that words set, in the order of the text.

use rayon::prelude::*;

use crate::diag::Span;
use crate::ids::BlockId;
use crate::nc::recognise::Control;
use crate::nc::{CommentForm, Part, Program, Syntax, TokenKind};

use super::mark::{self, Ours};

/// A letter with a plain number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Word {
    /// The letter, upper case.
    pub letter: u8,
    /// The number as written.
    pub number: f64,
    /// Letter and number.
    pub span: Span,
}

/// A line taken apart.
#[derive(Debug, Clone, Default)]
pub struct View {
    /// Plain words in order.
    pub words: Vec<Word>,
    /// Comments of ours, with the blank before them.
    pub ours: Vec<(Span, Ours)>,
    /// Where the first comment of the user begins.
    pub user_comment_at: Option<u32>,
    /// One past the last byte of code (the start of the line where there is none).
    pub code_end: u32,
    /// One past the last byte before the line end.
    pub line_end: u32,
    /// Stands under the block-delete switch.
    pub delete: bool,
    /// Steers the flow: label, call, loop, jump, routine.
    pub flow: bool,
    /// May send the control to a numbered block.
    pub jumps: bool,
    /// Sets the feed by an expression or a variable.
    pub computed_feed: bool,
    /// Everything in it is a plain word, a blank or a comment, or sets the feed.
    pub plain: bool,
    /// The same, but words may have expressions for numbers, and it may set a value (`CR=5`, `#1=[#1 + 1]`) or name a corner (`,R2`).
    pub worded: bool,
    /// Nothing but comments and blanks.
    pub empty: bool,
}

impl View {
    /// Takes a block apart.
    pub fn of(program: &Program, block: BlockId) -> Self {
        let span = program.span(block);
        let mut view = View {
            code_end: span.start,
            line_end: span.end,
            plain: true,
            worded: true,
            empty: true,
            ..View::default()
        };
        let plain = program.dialect().syntax() == Syntax::Heidenhain;
        let siemens = program.dialect().syntax() == Syntax::Siemens;
        let mut named = false;
        let mut odd = false;
        let mut first_name: &[u8] = b"";
        for token in program.tokens(block) {
            match token.kind {
                TokenKind::Blank => continue,
                TokenKind::LineEnd => {
                    view.line_end = view.line_end.min(token.span.start);
                    continue;
                }
                TokenKind::Comment => {
                    match mark::read(token.span.of(program.text())) {
                        Some(ours) => view.ours.push((mark::with_blank_before(program.text(), token.span), ours)),
                        None => view.user_comment_at = view.user_comment_at.or(Some(token.span.start)),
                    }
                    continue;
                }
                TokenKind::Word(letter) => view.words.push(Word { letter, number: token.number, span: token.span }),
                TokenKind::Delete => view.delete = true,
                kind => {
                    if kind == TokenKind::OpenComment {
                        view.user_comment_at = view.user_comment_at.or(Some(token.span.start));
                    }
                    let first = !named;
                    if first && kind == TokenKind::Name && plain {
                        first_name = token.span.of(program.text());
                    }
                    named |= kind == TokenKind::Name;
                    odd |= kind != TokenKind::Name;
                    let moves = plain && kind == TokenKind::Name && !(first && is_flow(token.span.of(program.text())));
                    view.plain &= moves || kind == TokenKind::Computed(b'F');
                    let setting =
                        siemens && kind == TokenKind::Name && crate::nc::is_setting(token.span.of(program.text()));
                    view.worded &= moves
                        || setting
                        || matches!(kind, TokenKind::Computed(_) | TokenKind::Assignment | TokenKind::Corner(_));
                    view.flow |= steers(kind) && !moves && !setting || kind == TokenKind::Percent && !view.empty;
                    view.jumps |= matches!(kind, TokenKind::Name | TokenKind::Label) && !moves && !setting;
                    view.computed_feed |= kind == TokenKind::Computed(b'F');
                }
            }
            view.empty = false;
            view.code_end = token.span.end;
        }
        view.flow |= view.words.iter().any(calls);
        // An approach of which something is not read may do anything with the feed.
        view.flow |= odd && [&b"APPR"[..], b"DEP"].iter().any(|name| name.eq_ignore_ascii_case(first_name));
        view.drop_other_f(first_name);
        view.jumps |=
            view.words.iter().any(|word| word.letter == b'M' && [97.0, 99.0].contains(&word.number)) && view.has(b'P');
        view
    }
    /// Leaves out the F words that are no feed: how long G4 dwells, an argument of a macro, the factor of M103, the feed that belongs to a cycle or
    /// a corner of plain language. `first_name`: the first name of a block of plain language.
    fn drop_other_f(&mut self, first_name: &[u8]) {
        let aside = [&b"CYCL"[..], b"RND", b"CHF"].iter().any(|name| name.eq_ignore_ascii_case(first_name));
        let factor = self.words.iter().find(|word| word.letter == b'M' && word.number == 103.0);
        let behind = factor.filter(|_| !first_name.is_empty()).map_or(u32::MAX, |word| word.span.start);
        let other = aside || self.g_codes().any(|code| [40, 650, 660, 661].contains(&code));
        self.words.retain(|word| word.letter != b'F' || !other && word.span.start < behind);
    }
    /// The word with this letter, when there is exactly one.
    pub fn only(&self, letter: u8) -> Option<&Word> {
        let mut found = self.words.iter().filter(|word| word.letter == letter);
        found.next().filter(|_| found.next().is_none())
    }
    /// Does it hold a word with this letter?
    pub fn has(&self, letter: u8) -> bool {
        self.words.iter().any(|word| word.letter == letter)
    }
    /// G codes in tenths: G38.2 is 382.
    pub fn g_codes(&self) -> impl Iterator<Item = u32> + '_ {
        self.words.iter().filter(|word| word.letter == b'G').map(|word| tenths(word.number))
    }
    /// Does it bring a tool into the spindle?
    pub fn tool_change(&self) -> bool {
        self.has(b'T') || self.words.iter().any(|word| word.letter == b'M' && word.number == 6.0)
    }
    /// Does the control never go on from it to the next block: M2, M30, M17, M99?
    pub fn ends(&self) -> bool {
        let end = |word: &Word| word.letter == b'M' && [2.0, 17.0, 30.0, 99.0].contains(&word.number);
        self.plain && !self.delete && self.words.iter().any(end)
    }
    /// Our note, where there is one.
    pub fn note(&self) -> Option<(&Span, &mark::Note)> {
        self.ours.iter().find_map(|(span, ours)| match ours {
            Ours::Note(note) => Some((span, note)),
            Ours::Header(_) | Ours::Was(_) | Ours::Check { .. } => None,
        })
    }
}

fn tenths(number: f64) -> u32 {
    (number * 10.0).round() as u32
}

/// Does a block of plain language that begins with this word do more than move, or prepare a tool?
fn is_flow(name: &[u8]) -> bool {
    const MOTIONS: [&[u8]; 18] = [
        b"L", b"C", b"CC", b"CR", b"CT", b"LP", b"CP", b"RND", b"CHF", b"TOOL", b"STOP", b"BLK", b"BEGIN", b"END",
        b"FMAX", b"F", b"APPR", b"DEP",
    ];
    !MOTIONS.iter().any(|word| word.eq_ignore_ascii_case(name))
}

fn steers(kind: TokenKind) -> bool {
    matches!(kind, TokenKind::Name | TokenKind::Routine | TokenKind::Label | TokenKind::Call)
}

/// M97, M98, M99, the M17 of Siemens, G65 to G67, and a program number.
fn calls(word: &Word) -> bool {
    match word.letter {
        b'M' => [17.0, 97.0, 98.0, 99.0].contains(&word.number),
        b'G' => [65.0, 66.0, 67.0, 66.1].contains(&word.number),
        b'O' => true,
        _ => false,
    }
}

/// Modes that words have set so far, in the order of the text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Modes {
    /// Lengths in inches.
    pub inch: bool,
    /// G91.
    pub incremental: bool,
}

impl Modes {
    /// The modes from this block on.
    pub fn after(self, switched: Switched) -> Self {
        Self { inch: switched.inch.unwrap_or(self.inch), incremental: switched.incremental.unwrap_or(self.incremental) }
    }
    /// Millimetres in one unit of length.
    pub fn unit_mm(self) -> f64 {
        if self.inch { crate::units::MM_PER_INCH } else { 1.0 }
    }
}

/// May any block of a part send the control to a numbered block?
pub fn jumps(program: &Program, part: &Part<'_>) -> bool {
    part.blocks.clone().into_par_iter().any(|block| View::of(program, BlockId(block)).jumps)
}

/// What one block switches.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Switched {
    inch: Option<bool>,
    incremental: Option<bool>,
}

impl Switched {
    /// What a block switches.
    pub fn by(program: &Program, block: BlockId) -> Self {
        let words = program.tokens(block).filter(|token| token.kind == TokenKind::Word(b'G'));
        Self::by_codes(words.map(|token| tenths(token.number)))
    }
    /// What G codes, in tenths, switch.
    pub fn by_codes(codes: impl Iterator<Item = u32>) -> Self {
        let mut switched = Self::default();
        for code in codes {
            match code {
                200 | 700 | 7000 => switched.inch = Some(true),
                210 | 710 | 7100 => switched.inch = Some(false),
                900 => switched.incremental = Some(false),
                910 => switched.incremental = Some(true),
                _ => {}
            }
        }
        switched
    }
}

/// The bytes of a word's number.
pub fn number_bytes<'a>(program: &'a Program, word: &Word) -> &'a [u8] {
    let bytes = word.span.of(program.text());
    let at = bytes.iter().position(|b| b.is_ascii_digit() || matches!(b, b'.' | b'+' | b'-'));
    at.map_or(&[], |at| &bytes[at..])
}

/// Where a word's number stands.
pub fn number_span(program: &Program, word: &Word) -> Span {
    Span { start: word.span.end - number_bytes(program, word).len() as u32, end: word.span.end }
}

/// Style of the whole file that a single word does not show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Manners {
    /// Are words set apart by blanks?
    pub spaced: bool,
    /// Is a zero written before the point?
    pub leading_zero: bool,
    /// Letters in lower case?
    pub lower: bool,
    /// Which of its coordinates have a decimal point.
    pub points: Points,
    /// How our comments are written.
    pub comment: CommentForm,
}

/// Which coordinates of a text have a decimal point, but for zeros.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Points {
    /// None: the whole text is in one unit, whichever the control takes.
    None,
    /// Some: those without one may be in another unit than the others.
    Some,
    /// All.
    All,
}

impl Manners {
    /// The style of most words in the first 4000 lines of a part.
    pub fn of(program: &Program, part: &Part<'_>) -> Self {
        let (mut spaced, mut zero, mut lower) = (0_i64, 0_i64, 0_i64);
        let some = |with: bool| part.blocks.clone().into_par_iter().any(|k| has_coordinate(program, BlockId(k), with));
        let points = if !some(true) {
            Points::None
        } else if program.dialect().properties().counts_increments && some(false) {
            Points::Some
        } else {
            Points::All
        };
        let comment = comment_form(program, part);
        for block in part.blocks().take(4000) {
            let words = View::of(program, block).words;
            for pair in words.windows(2) {
                spaced += if pair[0].span.end < pair[1].span.start { 1 } else { -1 };
            }
            for word in &words {
                let bytes = word.span.of(program.text());
                lower += if bytes[0].is_ascii_lowercase() { 1 } else { -1 };
                let number = number_bytes(program, word);
                let unsigned = number.strip_prefix(b"-").or(number.strip_prefix(b"+")).unwrap_or(number);
                zero += i64::from(unsigned.starts_with(b"0.")) - i64::from(unsigned.starts_with(b"."));
            }
        }
        Self { spaced: spaced > 0, leading_zero: zero >= 0, lower: lower > 0, points, comment }
    }
}

/// The form of our comments: the one that this text uses, if its family of dialects has it; else the family's safest, which for Marlin is `;`
/// (parentheses are a build option of that firmware: marlinfw.org, PAREN_COMMENTS).
fn comment_form(program: &Program, part: &Part<'_>) -> CommentForm {
    let text = program.text();
    let comments = part.blocks().flat_map(|block| program.tokens(block)).filter(|t| t.kind == TokenKind::Comment);
    let own = comments.map(|token| token.span.of(text)).filter(|comment| mark::read(comment).is_none());
    let dialect = program.dialect();
    let (mut used, safest) = ([false; 2], dialect.safest_comment());
    for form in own.filter_map(CommentForm::of) {
        used[form as usize] = true;
        if used[safest as usize] {
            return safest;
        }
    }
    let other = if safest == CommentForm::Parentheses { CommentForm::Semicolon } else { CommentForm::Parentheses };
    let marlin = program.recognised().is_some_and(|found| found.control == Control::Marlin);
    if dialect.has_comment(other) && (used[other as usize] || marlin) { other } else { safest }
}

/// Has this block a coordinate, other than zero where it is without, with or without a decimal point?
fn has_coordinate(program: &Program, block: BlockId, with_point: bool) -> bool {
    let view = View::of(program, block);
    let mut coordinates = view.words.iter().filter(|word| b"XYZIJKR".contains(&word.letter));
    coordinates.any(|word| {
        let point = number_bytes(program, word).contains(&b'.');
        if with_point { point } else { !point && word.number != 0.0 }
    })
}

/// The line end of a text: that of its first line that has one.
pub fn line_end(text: &[u8]) -> &'static [u8] {
    let first = memchr::memchr(b'\n', text);
    if first.is_some_and(|at| at > 0 && text[at - 1] == b'\r') { b"\r\n" } else { b"\n" }
}
