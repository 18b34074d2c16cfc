//! The words of the proof: where an F word, a comment of ours and a piece of a block may stand. In: both programs, the role
//! of every line, what the control does in either. Out: differences.
//!
//! An F word may differ only in a block that moves at a feed in both programs: nowhere else is it known to be a feed (a dwell,
//! an argument, a pitch, a subprogram that nothing calls). What else a line holds is the same *tokens*, not only the same
//! bytes with ours taken out: `G5(FW F600 kept)4` is no G54. A new F is one plain number above zero. Comments of ours stand
//! after the code, and a line keeps to the length that the control reads. A new F stands where the original's does, or behind the code. A line
//! is added only where the control comes by and takes it for nothing but a feed ([`place`](super::place)). A feed per minute has no more
//! digits than the control or the file uses, unless it is smaller than their last digit; and it has a point if all feeds of the file do, because
//! F600 is 0.6 to some controls. Comments of ours have a form that the control reads.
//! Pieces are cut only from what is executed, bear no number that a jump could look for, and have a decimal point where
//! the block has one: X50 is 0.050 mm to some controls.

use std::collections::BTreeSet;

use crate::ids::BlockId;

use crate::nc::{self, CommentForm, Program, Syntax, Token, TokenKind};

use super::align::{Role, Roles};
use super::done::Done;
use super::exact::Exact;
use super::line::{self, is_ours};
use super::place::Places;
use super::proof::Proof;

/// Largest F that is believed: 1 km/min.
const MOST_F: f64 = 1e6;
/// Smallest F that is believed: a feed per revolution in inches has five digits.
const LEAST_F: f64 = 1e-5;
/// Smallest F per minute that is believed: below it a control may round to 0, which is an alarm. A Fanuc takes hundredths of an inch.
const LEAST_PER_MINUTE: f64 = 0.01;
/// Most bytes of the number of an F: a Fanuc reads eight digits.
const MOST_BYTES: usize = 10;
/// Most digits behind the point of an F that are believed: a feed per revolution in inches takes five.
const MOST_DIGITS: u32 = 5;

/// Checks every line that is not byte for byte one of the original.
pub fn check(original: &Program, rewritten: &Program, roles: &Roles, done: &[Done; 2], proof: &mut Proof) {
    let numbers = Numbers::of(original);
    let manner = FWordStyle::of(original, &done[0]);
    let places = Places::of(rewritten, roles, &done[1]);
    let mut stated: &[u8] = b"";
    let mut fed_before = false;
    for (line, role) in roles.of.iter().enumerate() {
        let block = BlockId(line as u32);
        let wrong = match role {
            Role::Same(own) if original.line_text(*own) == rewritten.line_text(block) => None,
            Role::Same(own) => same_code(original, *own, rewritten, block)
                .or_else(|| new_feed(original, *own, rewritten, block, done, stated, &manner)),
            Role::Last(own) => last_piece(original, *own, rewritten, block, done, stated, &manner),
            Role::Piece(own) => piece(original, *own, rewritten, block, done, stated, &manner)
                .or_else(|| numbers.clash(rewritten, block)),
            Role::Added => added(rewritten, block, &done[1], stated, &manner)
                .or_else(|| numbers.clash(rewritten, block))
                .or_else(|| places.wrong(line)),
        };
        let unchanged = matches!(role, Role::Same(own) if original.line_text(*own) == rewritten.line_text(block));
        let changed = || foreign_comment(original, rewritten, block).or_else(|| too_long(rewritten, block));
        let wrong = wrong.or_else(|| if unchanged { None } else { changed() });
        let feeds_alone = matches!(role, Role::Added) && !feeds(rewritten, block).is_empty();
        let wrong = wrong.or((fed_before && feeds_alone).then_some("two feeds in a row are added"));
        fed_before = feeds_alone;
        if let Role::Same(own) | Role::Last(own) = role {
            stated = feeds(original, *own).last().unwrap_or(&stated);
        }
        if let Some(text) = wrong {
            let own = match role {
                Role::Same(own) | Role::Last(own) | Role::Piece(own) => Some(own.0 + 1),
                Role::Added => None,
            };
            proof.differ(own, Some(line as u32 + 1), text);
        }
    }
}

fn is_feed(token: &Token) -> bool {
    matches!(token.kind, TokenKind::Word(b'F') | TokenKind::Computed(b'F'))
}

/// How the F words of the original are written.
struct FWordStyle {
    /// Most digits behind the point of a feed per minute; `None`: there are feeds in other units, which take what they need.
    digits: Option<u32>,
    /// All have a point, and the control may count increments without one.
    pointed: bool,
    /// In inches such a control takes F40 for 0.40 or for 40.
    counts_inches: bool,
    /// What stands before the digits: `F`, `f`, `F `.
    letters: BTreeSet<Vec<u8>>,
}

impl FWordStyle {
    fn of(original: &Program, done: &Done) -> Self {
        let words = || original.blocks().flat_map(|block| feeds(original, block));
        let digits = words().filter_map(plain_number).map(Exact::digits).max().unwrap_or(0);
        let dialect = original.dialect();
        let pointed = dialect.properties().counts_increments
            && words().next().is_some()
            && words().all(|word| word.contains(&b'.'));
        let digits = (!done.other_units).then(|| digits.max(dialect.feed_digits(true) as u32));
        let counts_inches = dialect.properties().counts_increments && done.inch;
        // A feed that was computed (`F#1`) may be written as a number.
        let letters = words().map(|word| if plain_number(word).is_some() { letter(word) } else { &word[..1] });
        let letters = letters.map(<[u8]>::to_vec).collect();
        Self { digits, pointed, counts_inches, letters }
    }
    /// What is wrong with a new F word.
    fn wrong(&self, word: &[u8], like: &[u8]) -> Option<&'static str> {
        let number = plain_number(word)?;
        if !self.letters.contains(letter(word)) {
            return Some("an F is written in another way than those of the original");
        }
        if line::number_of(word).len() > MOST_BYTES {
            return Some("an F has more digits than a control reads");
        }
        if self.digits.is_some() && number.value() < LEAST_PER_MINUTE {
            return Some("an F is so small that a control may take it for 0");
        }
        if self.counts_inches && plain_number(like).is_some() && like.contains(&b'.') != word.contains(&b'.') {
            return Some("an F has a decimal point where the original's has none, or none where that has one");
        }
        let finer = |most: u32| number.digits() > most && number.value() * 10f64.powi(most as i32) >= 1.0;
        if number.digits() > MOST_DIGITS || self.digits.is_some_and(finer) {
            return Some("an F has more digits than the control or the file");
        }
        (self.pointed && !word.contains(&b'.')).then_some("an F has no decimal point, as all others have")
    }
}

/// What stands before the digits of an F word.
fn letter(word: &[u8]) -> &[u8] {
    let digits = word.iter().position(|byte| byte.is_ascii_digit() || *byte == b'.');
    &word[..digits.unwrap_or(word.len())]
}

/// The number of an F word that is plain.
fn plain_number(word: &[u8]) -> Option<Exact> {
    let digits = word.iter().position(|byte| !matches!(byte, b'F' | b'f' | b' ' | b'='))?;
    Exact::read(&word[digits..])
}

/// A comment of ours in a form that the control does not have. A Siemens reads parentheses as a comment in its ISO mode only: there the
/// original has some.
fn foreign_comment(original: &Program, rewritten: &Program, block: BlockId) -> Option<&'static str> {
    let form = |token: Token| CommentForm::of(token.span.of(rewritten.text()));
    let mut forms = rewritten.tokens(block).filter(|token| is_ours(rewritten, token)).filter_map(form);
    let dialect = original.dialect();
    let by_mode = |form| dialect.syntax() == Syntax::Siemens && form != dialect.safest_comment();
    let foreign = forms.any(|form| !dialect.has_comment(form) || by_mode(form) && !has_comment(original, form));
    foreign.then_some("a comment of ours is in a form that this control does not have")
}

fn has_comment(program: &Program, form: CommentForm) -> bool {
    let is =
        |token: Token| token.kind == TokenKind::Comment && CommentForm::of(token.span.of(program.text())) == Some(form);
    program.blocks().any(|block| program.tokens(block).any(is))
}

/// A changed line that is longer than any that the control reads.
fn too_long(program: &Program, block: BlockId) -> Option<&'static str> {
    let properties = program.dialect().properties();
    let line = program.line_text(block);
    let bytes = line.strip_suffix(b"\n").unwrap_or(line).len();
    let long = properties.refuses_longer_lines && bytes > program.dialect().max_line_length();
    long.then_some("the line is longer than the control reads")
}

/// Kind and bytes of everything but blanks, line ends, F words and comments of ours.
fn code(program: &Program, block: BlockId) -> Vec<(TokenKind, &[u8])> {
    let kept = |token: &Token| {
        !matches!(token.kind, TokenKind::Blank | TokenKind::LineEnd) && !is_feed(token) && !is_ours(program, token)
    };
    program.tokens(block).filter(kept).map(|token| (token.kind, token.span.of(program.text()))).collect()
}

fn feeds(program: &Program, block: BlockId) -> Vec<&[u8]> {
    program.tokens(block).filter(is_feed).map(|token| token.span.of(program.text())).collect()
}

fn same_code(original: &Program, own: BlockId, rewritten: &Program, block: BlockId) -> Option<&'static str> {
    if code(original, own) != code(rewritten, block) {
        return Some("the words of the line are others");
    }
    misplaced(rewritten, block)
}

/// A comment of ours with code behind it, or behind a comment that the control acts on: LinuxCNC acts on the last one of a line alone.
fn misplaced(program: &Program, block: BlockId) -> Option<&'static str> {
    let behind = program.tokens(block).skip_while(|token| !is_ours(program, token));
    if { behind }.any(|token| is_code(&token)) {
        return Some("a comment of ours stands before code");
    }
    let comments = program.tokens(block).filter(|token| token.kind == TokenKind::Comment);
    let mut acting =
        comments.skip_while(|token| !nc::acts_on_comment(program.dialect(), token.span.of(program.text())));
    { acting.by_ref() }
        .any(|token| is_ours(program, &token))
        .then_some("a comment of ours stands behind one that the control acts on")
}

fn new_feed(
    original: &Program,
    own: BlockId,
    rewritten: &Program,
    block: BlockId,
    done: &[Done; 2],
    stated: &[u8],
    manner: &FWordStyle,
) -> Option<&'static str> {
    let (was, now) = (feeds(original, own), feeds(rewritten, block));
    // In plain language, where no line can be added, a feed is stated in a motion that keeps its own.
    let counted = original.dialect().properties().counts_blocks;
    let in_block = counted && done[0].fed(own.ix()) && done[1].fed(block.ix());
    if feed_is_elsewhere(original, own, rewritten, block) {
        Some("the F stands neither where it stood nor behind the code")
    } else if was == now {
        None
    } else if counted && has_named_feed(rewritten, block) {
        Some("the line has a feed by its name already")
    } else if in_block && was.is_empty() && is_stated(&now, stated) {
        None
    } else if !done[0].feeds(own.ix()) || !done[1].feeds(block.ix()) {
        Some("the F of a line that does not move at a feed is another")
    } else {
        no_plain_feed(rewritten, block, manner, was.last().copied().unwrap_or(stated))
    }
}

/// Neither a blank nor a comment.
fn is_code(token: &Token) -> bool {
    !matches!(token.kind, TokenKind::Blank | TokenKind::LineEnd | TokenKind::Comment)
}

/// How many tokens of code stand before the first F; `None`: there is no F.
fn place_of_feed(program: &Program, block: BlockId) -> Option<usize> {
    program.tokens(block).filter(is_code).position(|token| is_feed(&token))
}

/// Does the F stand elsewhere than that of the original? A new one stands behind the code, in plain language before the M functions: LinuxCNC
/// refuses `F600 N10`, and plain language `F600 L X+30`.
fn feed_is_elsewhere(original: &Program, own: BlockId, rewritten: &Program, block: BlockId) -> bool {
    let Some(place) = place_of_feed(rewritten, block) else { return false };
    if let Some(before) = place_of_feed(original, own) {
        return place != before;
    }
    let next = rewritten.tokens(block).filter(is_code).nth(place + 1);
    let counted = original.dialect().properties().counts_blocks;
    next.is_some_and(|token| !(counted && line::is(&token, b'M')))
}

/// FMAX, FAUTO, FU … of plain language.
fn has_named_feed(program: &Program, block: BlockId) -> bool {
    let named = |token: Token| {
        token.kind == TokenKind::Name && matches!(token.span.of(program.text()).first(), Some(b'F' | b'f'))
    };
    program.tokens(block).any(named)
}

/// The line has not one F that is a plain number above zero.
/// `like`: the F word of the original that it stands for.
fn no_plain_feed(program: &Program, block: BlockId, manner: &FWordStyle, like: &[u8]) -> Option<&'static str> {
    let mut found = program.tokens(block).filter(is_feed);
    let bytes = |token: &Token| token.span.of(program.text());
    let plain = |token: &Token| token.kind == TokenKind::Word(b'F') && plain_number(bytes(token)).is_some();
    let good = |token: &Token| plain(token) && (LEAST_F..=MOST_F).contains(&token.number);
    match (found.next().filter(good), found.next()) {
        (Some(token), None) => manner.wrong(bytes(&token), like),
        _ => Some("the line has not one plain F above zero"),
    }
}

fn piece(
    original: &Program,
    own: BlockId,
    rewritten: &Program,
    block: BlockId,
    done: &[Done; 2],
    stated: &[u8],
    manner: &FWordStyle,
) -> Option<&'static str> {
    if !done[0].feeds(own.ix()) || !done[1].feeds(block.ix()) {
        return Some("a block that does not move at a feed is cut");
    }
    if foreign_centre(original, own, rewritten, block, done[0].centres.get(own.ix()).copied().flatten()) {
        return Some("a piece has a word of a centre or a radius that its block's arc cannot have");
    }
    let like = feeds(original, own).last().copied().unwrap_or(stated);
    let feed = if feeds(rewritten, block).is_empty() { None } else { no_plain_feed(rewritten, block, manner, like) };
    feed.or_else(|| misplaced(rewritten, block)).or_else(|| without_point(original, own, rewritten, block))
}

/// Has a piece an I, J, K or R that its block has not, and that does not belong to the plane of its block's arc either? To rs274 a K in an arc
/// in XY is an error.
fn foreign_centre(
    original: &Program,
    own: BlockId,
    rewritten: &Program,
    block: BlockId,
    of_plane: Option<[u8; 2]>,
) -> bool {
    let letters = |program: &Program, block: BlockId| -> Vec<u8> {
        let of = |token: Token| match token.kind {
            TokenKind::Word(letter) | TokenKind::Computed(letter) if b"IJKR".contains(&letter) => Some(letter),
            _ => None,
        };
        program.tokens(block).filter_map(of).collect()
    };
    let has = letters(original, own);
    let allowed = |letter: &u8| has.contains(letter) || of_plane.is_some_and(|plane| plane.contains(letter));
    !letters(rewritten, block).iter().all(allowed)
}

/// A piece, whose coordinates stand as they stood where they are the same numbers: all of them but under G91.
fn last_piece(
    original: &Program,
    own: BlockId,
    rewritten: &Program,
    block: BlockId,
    done: &[Done; 2],
    stated: &[u8],
    manner: &FWordStyle,
) -> Option<&'static str> {
    let axis = |token: &Token| matches!(token.kind, TokenKind::Word(letter) if b"XYZ".contains(&letter));
    let same = |a: &Token| {
        let mut others = rewritten.tokens(block).filter(|b| b.kind == a.kind && b.number == a.number);
        others.all(|b| b.span.of(rewritten.text()) == a.span.of(original.text()))
    };
    let kept = original.tokens(own).filter(axis).all(|token| same(&token));
    let wrong = (!kept).then_some("the last piece writes a coordinate in another way");
    wrong.or_else(|| piece(original, own, rewritten, block, done, stated, manner))
}

/// A coordinate of a piece that has no decimal point where the block's has one, or one where it has none.
fn without_point(original: &Program, own: BlockId, rewritten: &Program, block: BlockId) -> Option<&'static str> {
    if !original.dialect().properties().counts_increments {
        return None;
    }
    // Of a zero only a point that is there says anything.
    let points = |program: &Program, block: BlockId, zeros: bool| -> Vec<bool> {
        let places = program.tokens(block).filter(|t| matches!(t.kind, TokenKind::Word(l) if b"XYZIJKR".contains(&l)));
        let pointed = places.map(|t| (t.number == 0.0, t.span.of(program.text()).contains(&b'.')));
        { pointed }.filter(|(zero, point)| !zero || zeros && *point).map(|(_, point)| point).collect()
    };
    let whole = points(original, own, true);
    let other = |point: &bool| whole.iter().any(|own| own != point);
    { points(rewritten, block, false) }
        .iter()
        .any(other)
        .then_some("a piece has decimal points where the block has none, or none where it has some")
}

/// Do these F words say what the last one of the original says?
fn is_stated(now: &[&[u8]], stated: &[u8]) -> bool {
    let number = |word: &[u8]| word.iter().copied().filter(|byte| !b"Ff =".contains(byte)).collect::<Vec<u8>>();
    now.iter().all(|word| number(word) == number(stated))
}

/// A line that is not in the original: a feed, a comment of ours, or both. `stated`: the last F of the original before it.
fn added(rewritten: &Program, block: BlockId, done: &Done, stated: &[u8], manner: &FWordStyle) -> Option<&'static str> {
    if feeds(rewritten, block).is_empty() {
        return None;
    }
    if !done.reaches(block.ix()) {
        return Some("a feed is stated where the control does not come by");
    }
    no_plain_feed(rewritten, block, manner, stated).or_else(|| misplaced(rewritten, block))
}

/// Numbers of blocks that a jump may look for.
struct Numbers {
    /// In millionths, where anything jumps.
    known: Option<BTreeSet<i64>>,
}

impl Numbers {
    fn of(program: &Program) -> Self {
        let jumps = program.parts().any(|part| line::jumps(program, &part));
        let number = |block: BlockId| program.tokens(block).find(|t| t.kind == TokenKind::Word(b'N')).map(Self::key);
        Self { known: jumps.then(|| program.blocks().filter_map(number).collect()) }
    }
    fn key(token: Token) -> i64 {
        (token.number * 1e6).round() as i64
    }
    fn clash(&self, program: &Program, block: BlockId) -> Option<&'static str> {
        let known = self.known.as_ref()?;
        let number = program.tokens(block).find(|token| token.kind == TokenKind::Word(b'N'))?;
        known.contains(&Self::key(number)).then_some("a new line has the number of another block")
    }
}
