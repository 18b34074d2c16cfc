//! Proof of a moved program from the two texts: only coordinates of cutting moves differ, and no point of the path is
//! further from the original than a stated distance. In: both programs and their motions. Out: a [`Proof`].
//!
//! A cutting block makes exactly one feed move, executed once. In it the numbers of X, Y and Z may differ, and a
//! coordinate that was left out may be added; for an arc also I, J, K, R may differ, its G code may become that of a
//! straight move, and lines with X, Y and Z alone may follow it. Everything else is the same byte for byte, except
//! blanks between the words of a cutting block. The motions are compared move by move: kind, feed, spindle, tool, work
//! offset and path mode are the same, and so are dwells, tool changes and stops between them. One line may be added:
//! the comment [`MARK`], by which the file is recognised. Apart from that no code is shared with the writing
//! ([`super::write`]).

use crate::ids::BlockId;
use crate::nc::{Event, Move, MoveKind, Program, TokenKind, Toolpath};
use crate::path::{Curve, Vec3};

/// Comment at the head of a moved program.
pub const MARK: &str = "SEMI-FINISH MOVED BY FEEDWRIGHT";
/// Points along a curve at which its distance to the other is computed.
const PLACES: usize = 16;
/// Tolerance for rounding of decimal numbers, mm.
const ROUNDED_MM: f64 = 1e-6;
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
    /// Largest distance of a point from the original path, mm.
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
    let Some(matched) = texts(programs, &cuts, &mut proof) else { return proof };
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
    Arc,
}

fn cutting(program: &Program, path: &Toolpath) -> Vec<Cuts> {
    let mut of = vec![(0_u32, Cuts::No); program.len()];
    for motion in &path.moves {
        let Some(block) = of.get_mut(motion.block.ix()) else { continue };
        block.0 += 1;
        let plain = motion.kind == MoveKind::Feed && motion.instance == 0 && !motion.cycle && !motion.compensated;
        block.1 = match motion.curve() {
            _ if !plain => Cuts::No,
            Curve::Line { .. } => Cuts::Line,
            Curve::Arc(_) => Cuts::Arc,
        };
    }
    of.into_iter().map(|(count, cuts)| if count == 1 { cuts } else { Cuts::No }).collect()
}

/// Blocks of the second program that correspond to each block of the first; `None` if the texts cannot be matched.
fn texts([before, after]: [&Program; 2], cuts: &[Cuts], proof: &mut Proof) -> Option<Vec<std::ops::Range<u32>>> {
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
        if own != words(after, BlockId(at), cut) {
            proof.differs(lines, "more than coordinates of a cutting move differ");
            return None;
        }
        let first = at;
        at += 1;
        while cut == Cuts::Arc && (at as usize) < after.len() && only_coordinates(after, BlockId(at)) {
            at += 1;
            proof.chords += 1;
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
            TokenKind::Word(b'I' | b'J' | b'K' | b'R') => cuts == Cuts::Arc,
            TokenKind::Word(b'G') => cuts == Cuts::Arc && [1.0, 2.0, 3.0].contains(&token.number),
            _ => false,
        };
        if !may {
            tokens.push(token.span.of(text));
        }
    }
    tokens
}

/// Is a line the mark, and nothing else?
fn is_mark(program: &Program, line: u32) -> bool {
    let text = || program.span(BlockId(line)).of(program.text()).trim_ascii();
    (line as usize) < program.len()
        && [format!("({MARK})"), format!("; {MARK}")].iter().any(|mark| text() == mark.as_bytes())
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
        if cuts[motion.block.ix()] == Cuts::Arc {
            while let Some(piece) = next.next_if(|other| blocks.contains(&other.block.0)) {
                pieces.push(piece);
            }
        }
        proof.motions += 1;
        if let Some(what) = pieces.iter().find_map(|piece| state(motion, piece)) {
            proof.differs([motion.line, first.line], format!("{what} is not the same"));
        }
        let far_mm = distance(&motion.curve(), &pieces);
        proof.moved += usize::from(far_mm > ROUNDED_MM && motion.kind == MoveKind::Feed);
        proof.largest_mm = proof.largest_mm.max(far_mm);
        let near = far_mm <= within_mm + ROUNDED_MM;
        if !near {
            let text = format!("the path lies {far_mm:.4} mm from the original one, {within_mm} mm are allowed");
            proof.differs([motion.line, first.line], text);
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

/// Largest distance between a curve and the pieces in its place: of their ends, and of points of each from the other.
fn distance(curve: &Curve, pieces: &[&Move]) -> f64 {
    let others: Vec<Curve> = pieces.iter().map(|piece| piece.curve()).collect();
    let ends = [curve.from() - others[0].from(), curve.to() - others[others.len() - 1].to()].map(|off| off.norm());
    let places = |of: &Curve| -> Vec<Vec3> {
        let of = *of;
        (0..=PLACES).map(|k| of.point(of.length() * k as f64 / PLACES as f64)).collect()
    };
    let there = others.iter().flat_map(places).map(|point| to_curve(curve, point));
    let nearest = |point: Vec3| others.iter().map(|other| to_curve(other, point)).fold(f64::INFINITY, f64::min);
    let back = places(curve).into_iter().map(nearest);
    there.chain(back).fold(ends[0].max(ends[1]), f64::max)
}

/// Distance of a point from a curve.
fn to_curve(curve: &Curve, point: Vec3) -> f64 {
    let length = curve.length();
    let off = |s: f64| (curve.point(s) - point).norm();
    let looks = if matches!(curve, Curve::Line { .. }) { 1 } else { 64 };
    let start =
        (0..=looks).map(|k| length * f64::from(k) / f64::from(looks)).min_by(|a, b| off(*a).total_cmp(&off(*b)));
    let mut s = start.unwrap_or(0.0);
    for _ in 0..6 {
        s = (s + (point - curve.point(s)).dot(&curve.tangent(s))).clamp(0.0, length);
    }
    off(s)
}
