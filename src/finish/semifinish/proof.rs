//! Proof of a moved program from the two texts: only coordinates of cutting moves differ, and the path, walked in its
//! order, is nowhere further from the original than a stated distance. In: both programs and their motions. Out: a
//! [`Proof`].
//!
//! A cutting block makes exactly one feed move, executed once, and no probing move. In it the numbers of X, Y and Z may
//! differ, and a coordinate that was left out may be added; for an arc also R, or I, J, K of those that its block has or
//! its plane asks for. Its G code may become that of a straight move, which has none of them (in front of a straight move some
//! controls take R for a corner), and lines with X, Y and Z alone may follow it, each of which makes one straight move. Where
//! a control may count a number without a decimal point in increments, every number that differs has a point, and so
//! have those of the original block; none has more than [`DIGITS`] digits, unless the original's has. Everything else
//! is the same byte for byte, except blanks between the words of a
//! cutting block. The motions are compared move by move: kind, feed, spindle, tool, work offset and path mode are the
//! same, and so are dwells, tool changes and stops between them. The path of a move and that of what takes its place are
//! walked from end to end together ([`super::walk`]): with w the stated distance they are never more than w apart, and
//! their lengths differ by no more than w (θ + 2), θ the angle by which the move turns. A path at the constant distance
//! w beside it is longer or shorter by w θ (Steiner), and w at either end is for one that goes over from one side to the
//! other. Of the moved program nothing may be said while it is read that is not said of the original as often: an arc
//! whose radius changes is a motion here, but a control may refuse it. One line may be added: the comment [`MARK`] in a
//! form that the dialect has, by which the file is recognised. Apart from that no code is shared with the writing
//! ([`super::write`]).

use super::walk;
use crate::ids::BlockId;
use crate::nc::{CommentForm, Event, Freeze, Move, MoveKind, Program, Syntax, TokenKind, Toolpath};
use crate::path::{Curve, Plane};
use std::collections::BTreeMap;

/// Comment at the head of a moved program.
pub const MARK: &str = "SEMI-FINISH MOVED BY FEEDWRIGHT";
/// Tolerance for rounding of decimal numbers, mm.
const ROUNDED_MM: f64 = 1e-6;
/// Digits of a number that every control reads: a Fanuc takes eight, since the series 30i nine.
const DIGITS: usize = 9;
/// G codes of feed moves.
const MOTION: [f64; 3] = [1.0, 2.0, 3.0];
/// Most differences that are listed.
const LISTED: usize = 20;

/// Result of the comparison.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Proof {
    /// Motions compared.
    pub motions: usize,
    /// Cutting moves with another path.
    pub moved: usize,
    /// Lines with chords that follow arcs.
    pub chords: usize,
    /// Largest distance between the two paths, walked in their order, mm.
    pub largest_mm: f64,
    /// Line numbers in both programs, and what differs there.
    pub differences: Vec<([u32; 2], String)>,
}

impl Proof {
    /// Is it proven? Not for programs without a motion.
    pub fn holds(&self) -> bool {
        self.differences.is_empty() && self.motions > 0
    }

    fn differs(&mut self, lines: [u32; 2], what: impl Into<String>) {
        if self.differences.len() < LISTED {
            self.differences.push((lines, what.into()));
        }
    }
}

/// Compares two programs.
pub fn prove(programs: [&Program; 2], paths: [&Toolpath; 2], within_mm: f64) -> Proof {
    let mut proof = Proof::default();
    let cuts = cutting(programs[0], paths[0]);
    let moved = cutting(programs[1], paths[1]);
    let Some(matched) = texts(programs, [&cuts, &moved], &mut proof) else { return proof };
    remarks(paths, &mut proof);
    motions(paths, &cuts, &matched, within_mm, &mut proof);
    let between = |path: &Toolpath, of: &dyn Fn(u32) -> u32| -> Vec<Event> {
        path.between.iter().map(|(_, event)| at_line(*event, of)).collect()
    };
    let line = |line: u32| matched.get(line as usize - 1).map_or(line, |range| range.start + 1);
    if between(paths[0], &line) != between(paths[1], &|line| line) {
        proof.differs([1, 1], "dwells, tool changes, speeds or stops are not the same");
    }
    proof
}

/// Lists what is said of the second program more often than of the first, one of each kind.
fn remarks([before, after]: [&Toolpath; 2], proof: &mut Proof) {
    let mut counts: BTreeMap<&str, [u32; 2]> = BTreeMap::new();
    for (which, path) in [before, after].iter().enumerate() {
        for said in &path.diagnostics {
            counts.entry(said.code).or_default()[which] += said.places;
        }
    }
    for (code, _) in counts.iter().filter(|(_, [before, after])| after > before) {
        let more = after.diagnostics.iter().rfind(|said| said.code == *code);
        let line = more.and_then(|said| said.line).unwrap_or(1);
        let what = more.map_or("", |said| said.text.as_str());
        proof.differs([line, line], format!("it is read with a remark that the original does not get: {what}"));
    }
}

/// An event with its line number converted by `of`.
fn at_line(event: Event, of: &dyn Fn(u32) -> u32) -> Event {
    match event {
        Event::Move(id) => Event::Move(id),
        Event::Dwell { seconds, line } => Event::Dwell { seconds, line: of(line) },
        Event::Tool { number, line } => Event::Tool { number, line: of(line) },
        Event::Spindle { spin, line } => Event::Spindle { spin, line: of(line) },
        Event::Stop { line, end } => Event::Stop { line: of(line), end },
    }
}

/// What may differ in a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cuts {
    /// Nothing.
    No,
    /// A line or an arc.
    Line,
    Arc(Plane),
}

fn cutting(program: &Program, path: &Toolpath) -> Vec<Cuts> {
    let mut of = vec![(0_u32, Cuts::No); program.len()];
    for motion in &path.moves {
        let Some(block) = of.get_mut(motion.block.ix()) else { continue };
        block.0 += 1;
        let once = motion.kind == MoveKind::Feed && motion.instance == 0;
        let plain = once && !motion.cycle && !motion.compensated && motion.freeze != Some(Freeze::Probe);
        block.1 = match motion.curve() {
            _ if !plain => Cuts::No,
            Curve::Line { .. } => Cuts::Line,
            Curve::Arc(arc) => Cuts::Arc(arc.plane),
        };
    }
    of.into_iter().map(|(count, cuts)| if count == 1 { cuts } else { Cuts::No }).collect()
}

/// Blocks of the second program that correspond to each block of the first; `None` if the texts cannot be matched.
fn texts(
    [before, after]: [&Program; 2],
    [cuts, moved]: [&[Cuts]; 2],
    proof: &mut Proof,
) -> Option<Vec<std::ops::Range<u32>>> {
    let mut matched = Vec::with_capacity(before.len());
    let (mut at, mut marked) = (0_u32, false);
    for block in before.blocks() {
        if !marked && is_mark(after, at) && !is_mark(before, block.0) {
            (at, marked) = (at + 1, true);
        }
        let lines = [block.0 + 1, at + 1];
        if at as usize >= after.len() {
            proof.differs(lines, "the moved program ends before this line");
            return None;
        }
        let cut = cuts[block.ix()];
        let own = words(before, block, cut);
        let codes = [(before, block), (after, BlockId(at))].map(|(program, block)| motion_codes(program, block));
        if own != words(after, BlockId(at), cut) || (is_arc(cut) && codes[1] > codes[0].max(1)) {
            proof.differs(lines, "more than coordinates of a cutting move differ");
            return None;
        }
        let first = at;
        at += 1;
        while is_arc(cut) && (at as usize) < after.len() && only_coordinates(after, BlockId(at)) {
            at += 1;
            proof.chords += 1;
        }
        if cut != Cuts::No && (first..at).any(|line| counted_otherwise([before, after], block, BlockId(line))) {
            proof.differs(lines, "a coordinate without a decimal point may count increments");
        }
        if cut != Cuts::No && (first..at).any(|line| is_too_long([before, after], block, BlockId(line))) {
            proof.differs(lines, format!("a number has more than {DIGITS} digits"));
        }
        if let Cuts::Arc(plane) = cut
            && !fits_arc([before, after], [block, BlockId(first)], plane, moved[first as usize])
        {
            proof.differs(
                lines,
                "the centre or the radius of an arc is given by other words, or beside a straight move",
            );
        }
        matched.push(first..at);
    }
    if (at as usize) < after.len() {
        proof.differs([before.len() as u32, at + 1], "the moved program continues after the end of the other");
        return None;
    }
    Some(matched)
}

/// The part of a block that must be the same: all its bytes, or the tokens of a cutting block without coordinates and
/// blanks.
fn words(program: &Program, block: BlockId, cuts: Cuts) -> Vec<&[u8]> {
    let text = program.text();
    if cuts == Cuts::No {
        return vec![program.span(block).of(text)];
    }
    let mut tokens: Vec<&[u8]> = Vec::new();
    for token in program.tokens(block) {
        let may = match token.kind {
            TokenKind::Blank | TokenKind::Word(b'X' | b'Y' | b'Z') => true,
            TokenKind::Word(b'I' | b'J' | b'K' | b'R') => is_arc(cuts),
            TokenKind::Word(b'G') => is_arc(cuts) && MOTION.contains(&token.number),
            _ => false,
        };
        if !may {
            tokens.push(token.span.of(text));
        }
    }
    tokens
}

fn is_arc(cuts: Cuts) -> bool {
    matches!(cuts, Cuts::Arc(_))
}

/// Letters of the words that give the centre or the radius of an arc.
fn centre_letters(program: &Program, block: BlockId) -> Vec<u8> {
    let letter = |kind: TokenKind| match kind {
        TokenKind::Word(letter) if b"IJKR".contains(&letter) => Some(letter),
        _ => None,
    };
    program.tokens(block).filter_map(|token| letter(token.kind)).collect()
}

/// May the block in the place of an arc's have the words for centre and radius that it has? None beside a straight move; R, once, in the
/// place of R; else those that the block of the arc has and those of its plane, each once.
fn fits_arc([before, after]: [&Program; 2], [own, other]: [BlockId; 2], plane: Plane, moved: Cuts) -> bool {
    let [known, letters] = [centre_letters(before, own), centre_letters(after, other)];
    let (a, b, _) = plane.axes();
    let of_plane = [a, b].map(|axis| b"IJK"[axis]);
    let may = |letter: &u8| known.contains(letter) || !known.contains(&b'R') && of_plane.contains(letter);
    let place = |letter: &u8| letters.iter().position(|other| other == letter);
    let once = |letter: &u8| letters.iter().rposition(|other| other == letter) == place(letter);
    if is_arc(moved) { letters.iter().all(|letter| may(letter) && once(letter)) } else { letters.is_empty() }
}

/// Number of motion codes in a block.
fn motion_codes(program: &Program, block: BlockId) -> usize {
    let is_one = |kind: TokenKind, number: f64| kind == TokenKind::Word(b'G') && MOTION.contains(&number);
    program.tokens(block).filter(|token| is_one(token.kind, token.number)).count()
}

/// Does a block in the place of another write a number that the control may count in another unit than is meant? In the
/// dialects that count increments that is one without a point, unless the other writes the same, or any beside one
/// without a point.
fn counted_otherwise([before, after]: [&Program; 2], own: BlockId, other: BlockId) -> bool {
    let words = |program: &Program, block: BlockId| -> Vec<Vec<u8>> {
        let places = program.tokens(block).filter(|t| matches!(t.kind, TokenKind::Word(l) if b"XYZIJKR".contains(&l)));
        let numbers = places.filter(|token| token.number != 0.0);
        numbers.map(|token| token.span.of(program.text()).to_vec()).collect()
    };
    let known = words(before, own);
    let pointless = known.iter().any(|word| !word.contains(&b'.'));
    let new = |word: &Vec<u8>| !known.contains(word) && (pointless || !word.contains(&b'.'));
    before.dialect().properties().counts_increments && words(after, other).iter().any(new)
}

/// Does a block in the place of another write a number with more digits than every control reads, and than its own has?
fn is_too_long([before, after]: [&Program; 2], own: BlockId, other: BlockId) -> bool {
    let digits = |program: &Program, block: BlockId| {
        let places = program.tokens(block).filter(|t| matches!(t.kind, TokenKind::Word(l) if b"XYZIJKR".contains(&l)));
        let count = |bytes: &[u8]| bytes.iter().filter(|byte| byte.is_ascii_digit()).count();
        places.map(|token| count(token.span.of(program.text()))).max().unwrap_or(0)
    };
    digits(after, other) > DIGITS.max(digits(before, own))
}

/// Is a line the mark in a form of the dialect, and nothing else? Plain language numbers its lines; no program in it is moved.
fn is_mark(program: &Program, line: u32) -> bool {
    let text = || program.span(BlockId(line)).of(program.text()).trim_ascii();
    if program.dialect().syntax() == Syntax::Heidenhain {
        return false;
    }
    let forms = [CommentForm::Parentheses, CommentForm::Semicolon];
    let forms = forms.into_iter().filter(|form| program.dialect().has_comment(*form));
    (line as usize) < program.len() && forms.map(|form| form.write(MARK)).any(|mark| text() == mark.as_bytes())
}

fn only_coordinates(program: &Program, block: BlockId) -> bool {
    let mut some = false;
    program.tokens(block).all(|token| match token.kind {
        TokenKind::Blank | TokenKind::LineEnd => true,
        TokenKind::Word(b'X' | b'Y' | b'Z') => {
            some = true;
            true
        }
        _ => false,
    }) && some
}

fn motions(
    [before, after]: [&Toolpath; 2],
    cuts: &[Cuts],
    matched: &[std::ops::Range<u32>],
    within_mm: f64,
    proof: &mut Proof,
) {
    let mut next = after.moves.iter().peekable();
    for motion in &before.moves {
        let Some(blocks) = matched.get(motion.block.ix()) else {
            proof.differs([motion.line, motion.line], "moves of called files are not compared");
            return;
        };
        let Some(first) = next.next().filter(|other| blocks.contains(&other.block.0)) else {
            proof.differs([motion.line, blocks.start + 1], "this line no longer moves the tool as it did");
            return;
        };
        let mut pieces = vec![first];
        if is_arc(cuts[motion.block.ix()]) {
            while let Some(piece) = next.next_if(|other| blocks.contains(&other.block.0)) {
                pieces.push(piece);
            }
        }
        proof.motions += 1;
        let chords = || pieces.iter().all(|piece| matches!(piece.curve(), Curve::Line { .. }));
        if blocks.len() > 1 && !(pieces.len() == blocks.len() && chords()) {
            proof.differs(
                [motion.line, first.line],
                "the lines in the place of the arc make other moves than one straight line each",
            );
        }
        if let Some(what) = pieces.iter().find_map(|piece| state(motion, piece)) {
            proof.differs([motion.line, first.line], format!("{what} is not the same"));
        }
        let (own, others) = (motion.curve(), pieces.iter().map(|piece| piece.curve()).collect::<Vec<_>>());
        let far_mm = walk::apart_mm(&own, &others);
        proof.moved += usize::from(far_mm > ROUNDED_MM && motion.kind == MoveKind::Feed);
        proof.largest_mm = proof.largest_mm.max(far_mm);
        if let Some(what) = misfit(&own, &others, far_mm, within_mm) {
            proof.differs([motion.line, first.line], what);
        }
    }
    if let Some(more) = next.next() {
        proof.differs([before.moves.last().map_or(1, |motion| motion.line), more.line], "there are more motions");
    }
}

/// What differs between two moves besides their path.
fn state(a: &Move, b: &Move) -> Option<&'static str> {
    let checks = [
        (a.kind == b.kind, "rapid or feed"),
        (a.kind == MoveKind::Rapid || (a.feed.mode == b.feed.mode && same(a.feed.mm_s, b.feed.mm_s)), "the feed"),
        (a.spin == b.spin, "the spindle"),
        (a.tool == b.tool, "the tool"),
        (a.wcs == b.wcs, "the work offset"),
        (a.path_mode == b.path_mode, "the path mode"),
    ];
    checks.iter().find(|(same, _)| !same).map(|(_, what)| *what)
}

fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(b.abs())
}

/// Why the pieces in the place of a curve do not follow it within a distance; `None` if they do.
fn misfit(own: &Curve, others: &[Curve], far_mm: f64, within_mm: f64) -> Option<String> {
    let most_mm = within_mm + ROUNDED_MM;
    let near = far_mm <= most_mm;
    if !near {
        return Some(format!(
            "the path lies {far_mm:.4} mm from the original one, walked in the same order; {within_mm} mm are allowed"
        ));
    }
    let [own_mm, other_mm] = [own.length(), others.iter().map(Curve::length).sum()];
    let fits = (other_mm - own_mm).abs() <= most_mm * (walk::turned_rad(own) + 2.0);
    (!fits).then(|| format!("the path is {other_mm:.3} mm long instead of {own_mm:.3}: more than {within_mm} mm make"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::{Arc, Plane, Vec3};
    use std::f64::consts::FRAC_PI_2;

    /// A quarter of a circle of 10 mm radius.
    fn quarter() -> Curve {
        let [from, to] = [Vec3::new(10.0, 0.0, 0.0), Vec3::new(0.0, 10.0, 0.0)];
        Curve::Arc(Arc::new(Plane::Xy, from, to, Vec3::zeros(), FRAC_PI_2))
    }

    #[test]
    fn nothing_is_near_a_bound_that_is_no_number() {
        assert!(misfit(&quarter(), &[quarter()], 0.0, 0.0).is_none());
        assert!(misfit(&quarter(), &[quarter()], 0.0, f64::NAN).is_some());
        assert!(misfit(&quarter(), &[quarter()], 0.0, -1.0).is_some());
    }

    /// On both sides of w (θ + 2): 0.3 mm times 3.57 is 1.071 mm.
    #[test]
    fn a_path_is_no_longer_than_its_distance_makes_it() {
        let length = quarter().length();
        let line = |mm: f64| [Curve::Line { from: Vec3::zeros(), to: Vec3::new(mm, 0.0, 0.0) }];
        for (more, fits) in [(1.07, true), (1.08, false), (-1.07, true), (-1.08, false)] {
            assert_eq!(misfit(&quarter(), &line(length + more), 0.3, 0.3).is_none(), fits, "{more}");
        }
    }
}
