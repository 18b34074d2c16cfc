//! The text part of the proof: which line of the original each line of the rewritten program stands for. In: both programs; the files linked to
//! them are aligned one by one. Out: a [`Role`] for every line, and the increment of the control there; differences go into the proof.

use crate::ids::BlockId;
use crate::nc::{Program, Token, TokenKind};
use crate::units::MM_PER_INCH;

use super::exact::Exact;
use super::line::{self, Modes};
use super::proof::Proof;

/// What a line of the rewritten program is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// This line of the original.
    Same(BlockId),
    /// A piece before the last one of this block.
    Piece(BlockId),
    /// The last piece of this block.
    Last(BlockId),
    /// An F word or a comment of ours.
    Added,
}

/// Roles of the lines of the rewritten program.
#[derive(Debug, Clone, Default)]
pub struct Roles {
    /// By line.
    pub of: Vec<Role>,
    /// Increment of the control on each line of the original, mm.
    pub increment_mm: Vec<f64>,
}

/// Most pieces a block may have.
const MOST_PIECES: usize = 10_000;
const AXES: [u8; 3] = *b"XYZ";

/// Aligns the two texts; `inch`: lengths are in inches until they say otherwise.
pub fn align(original: &Program, rewritten: &Program, inch: bool, proof: &mut Proof) -> Roles {
    let modes = Modes { inch, incremental: false };
    let mut walk = Walk { original, rewritten, i: 0, j: 0, begin: 0, ends: [0; 2], modes, roles: Roles::default() };
    let mut others = rewritten.parts();
    for part in original.parts() {
        let Some(other) = others.next().filter(|other| other.name == part.name) else {
            let name = part.name.unwrap_or_default();
            proof.differ(None, None, format!("the subprogram {name} is missing beside the rewritten program"));
            break;
        };
        walk.modes = modes;
        walk.ends = [part.blocks.end as usize, other.blocks.end as usize];
        while walk.i < walk.ends[0] || walk.j < walk.ends[1] {
            walk.step(proof);
        }
    }
    if let Some(name) = others.next().and_then(|other| other.name) {
        proof.differ(None, None, format!("the rewritten program calls the subprogram {name}, the original does not"));
    }
    let added = |role: &&Role| matches!(role, Role::Added | Role::Piece(_));
    proof.blocks_added = walk.roles.of.iter().filter(added).count();
    proof.blocks_split = walk.roles.of.iter().filter(|role| matches!(role, Role::Last(_))).count();
    walk.roles
}

struct Walk<'a> {
    original: &'a Program,
    rewritten: &'a Program,
    i: usize,
    j: usize,
    /// Where the part of the original that is being aligned begins.
    begin: usize,
    /// Where the parts that are being aligned end.
    ends: [usize; 2],
    modes: Modes,
    roles: Roles,
}

impl<'a> Walk<'a> {
    fn step(&mut self, proof: &mut Proof) {
        if self.is_untouched() {
            return self.pair(Role::Same(BlockId(self.i as u32)));
        }
        let here = (self.i < self.ends[0]).then(|| Bare::of(self.original, self.i));
        let there = (self.j < self.ends[1]).then(|| Bare::of(self.rewritten, self.j));
        match (here, there) {
            (Some(a), Some(b)) if self.same_text(&a, &b) && a.pairs_with(&b) => {
                self.pair(Role::Same(BlockId(self.i as u32)));
            }
            (_, Some(b)) if b.is_added() => self.push(Role::Added),
            (Some(a), _) if a.is_comment_of_ours() => self.pass_original(),
            (Some(_), Some(_)) => match self.pieces(self.i, self.j) {
                Some(count) => self.push_pieces(count),
                None => self.differ(proof),
            },
            (Some(_), None) => {
                proof.differ(Some(self.i as u32 + 1), None, "the line is missing");
                self.pass_original();
            }
            (None, Some(_)) => {
                proof.differ(None, Some(self.j as u32 + 1), "the line is not in the original");
                self.push(Role::Added);
            }
            (None, None) => {}
        }
    }

    /// Byte for byte the same line?
    fn is_untouched(&self) -> bool {
        let line = |program: &'a Program, line: usize| program.line_text(BlockId(line as u32));
        let inside = self.i < self.ends[0] && self.j < self.ends[1];
        inside && line(self.original, self.i) == line(self.rewritten, self.j)
    }

    /// The same bytes but for feeds and our comments; a last line without an end may have got one where a line was added behind it.
    fn same_text(&self, a: &Bare, b: &Bare) -> bool {
        let open = self.i + 1 == self.ends[0] && self.j + 1 < self.ends[1] && !a.text.ends_with(b"\n");
        let end = b.text.strip_suffix(b"\n").map(|text| text.strip_suffix(b"\r").unwrap_or(text));
        a.text == b.text || open && end == Some(&a.text)
    }

    fn pair(&mut self, role: Role) {
        self.push(role);
        self.pass_original();
    }

    fn push(&mut self, role: Role) {
        self.roles.of.push(role);
        self.j += 1;
    }

    fn pass_original(&mut self) {
        self.modes = self.modes_here();
        let digits = self.original.dialect().coordinate_digits(self.modes.inch) as i32;
        let unit_mm = if self.modes.inch { MM_PER_INCH } else { 1.0 };
        self.roles.increment_mm.push(10f64.powi(-digits) * unit_mm);
        self.i += 1;
    }

    fn modes_here(&self) -> Modes {
        self.modes.after(self.original, BlockId(self.i as u32))
    }

    /// Number of the last word of an axis before line `i`, where it is plain and in the modes of that line.
    fn named_before(&self, i: usize, axis: usize) -> Option<Exact> {
        let block = |line: usize| BlockId(line as u32);
        let of_axis = |token: &Token| line::is(token, AXES[axis]);
        let names = |line: usize| self.original.tokens(block(line)).any(|token| of_axis(&token));
        let read = (self.begin..i).rev().map(|at| (at, line::plain_words(self.original, block(at))));
        let (at, words) = { read }.find(|(at, words)| words.is_none() || names(*at))?;
        let mut found = words?.into_iter().filter(of_axis);
        let word = found.next().filter(|_| found.next().is_none())?;
        let same_modes = !(at + 1..=i).any(|line| line::sets_modes(self.original, block(line)));
        Exact::read(line::number_of(word.span.of(self.original.text()))).filter(|_| same_modes)
    }

    fn push_pieces(&mut self, count: usize) {
        let block = BlockId(self.i as u32);
        for _ in 1..count {
            self.push(Role::Piece(block));
        }
        self.pair(Role::Last(block));
    }

    /// Number of lines of the rewritten program, from `j` on, that are the pieces of block `i`; `None`: they are not.
    fn pieces(&self, i: usize, j: usize) -> Option<usize> {
        let mut whole = Frame::of(self.original, i)?;
        let incremental = self.modes_here().incremental;
        let first = Frame::of(self.rewritten, j)?;
        for axis in 0..2 {
            // A coordinate that an arc leaves out stays what it was: the last piece has to say so.
            if whole.arc && whole.axes[axis].is_none() && first.axes[axis].is_some() {
                whole.axes[axis] = if incremental { Some(Exact::ZERO) } else { self.named_before(i, axis) };
            }
        }
        let mut sum = [Some(Exact::ZERO); 3];
        let end = self.ends[1].min(j + MOST_PIECES);
        for (count, at) in (j..end).enumerate() {
            let piece = Frame::of(self.rewritten, at)?;
            let names = |frame: &Frame| frame.axes.map(|number| number.is_some());
            if piece.code != whole.code || names(&piece) != names(&whole) {
                return None;
            }
            for (axis, number) in sum.iter_mut().enumerate() {
                *number = piece.axes[axis].zip(*number).map(|(step, sum)| sum.plus(step));
            }
            let ended = if incremental { same(&sum, &whole.axes) } else { same(&piece.axes, &whole.axes) };
            if ended && count > 0 && piece.rest == whole.rest && piece.number == whole.number {
                return Some(count + 1);
            }
            if !piece.rest.is_empty() {
                return None;
            }
        }
        None
    }

    /// Could line `j` stand for line `i`?
    fn agree(&self, i: usize, j: usize) -> bool {
        if i >= self.ends[0] || j >= self.ends[1] {
            return i >= self.ends[0] && j >= self.ends[1];
        }
        Bare::of(self.original, i).text == Bare::of(self.rewritten, j).text || self.pieces(i, j).is_some()
    }

    /// Reports a difference and finds the next lines that agree.
    fn differ(&mut self, proof: &mut Proof) {
        let (line, other) = (self.i as u32 + 1, self.j as u32 + 1);
        if self.agree(self.i + 1, self.j) {
            proof.differ(Some(line), Some(other), "the line is missing");
            self.pass_original();
        } else if self.agree(self.i, self.j + 1) {
            proof.differ(Some(line), Some(other), "the line is not in the original");
            self.push(Role::Added);
        } else {
            proof.differ(Some(line), Some(other), "the line differs in more than its feed");
            self.pair(Role::Same(BlockId(self.i as u32)));
        }
    }
}

fn same(a: &[Option<Exact>; 3], b: &[Option<Exact>; 3]) -> bool {
    let equal = |(a, b): (&Option<Exact>, &Option<Exact>)| match (a, b) {
        (Some(a), Some(b)) => a.equals(*b),
        (None, None) => true,
        _ => false,
    };
    a.iter().zip(b).all(equal)
}

/// A line without its F words and our comments, each with the blank before it.
struct Bare {
    text: Vec<u8>,
    /// Its F words.
    feeds: Vec<u8>,
    ours: bool,
    /// Nothing but a block number is left.
    void: bool,
    /// It has a block number, to which something may jump.
    numbered: bool,
}

impl Bare {
    fn of(program: &Program, line: usize) -> Self {
        let block = BlockId(line as u32);
        let span = program.span(block);
        let mut bare =
            Self { text: Vec::with_capacity(span.len()), feeds: Vec::new(), ours: false, void: true, numbered: false };
        let mut at = span.start;
        for token in program.tokens(block) {
            let is_feed = matches!(token.kind, TokenKind::Word(b'F') | TokenKind::Computed(b'F'));
            let is_ours = line::is_ours(program, &token);
            if is_feed {
                bare.feeds.extend_from_slice(token.span.of(program.text()));
            }
            bare.ours |= is_ours;
            bare.numbered |= matches!(token.kind, TokenKind::Word(b'N'));
            let blank = matches!(token.kind, TokenKind::Blank | TokenKind::LineEnd | TokenKind::Word(b'N'));
            bare.void &= is_feed || is_ours || blank;
            if is_feed || is_ours {
                let cut = line::with_blank(program.text(), token.span);
                bare.text.extend_from_slice(&program.text()[at as usize..cut.start.max(at) as usize]);
                at = cut.end;
            }
        }
        bare.text.extend_from_slice(&program.text()[at as usize..span.end as usize]);
        bare
    }
    /// A line that the rewriter may have put in.
    fn is_added(&self) -> bool {
        self.void && (!self.feeds.is_empty() || self.ours)
    }
    fn is_comment_of_ours(&self) -> bool {
        self.void && self.ours && self.feeds.is_empty() && !self.numbered
    }
    /// Lines with nothing left pair only when both or neither could have been put in, and state the same feed.
    fn pairs_with(&self, other: &Self) -> bool {
        !self.void || self.is_added() == other.is_added() && self.feeds == other.feeds
    }
}

/// What pieces of one block have in common, and what tells them apart.
struct Frame {
    /// Every word but N, F, axes and centre: letter and number.
    code: Vec<u8>,
    /// Has it words of a centre or a radius?
    arc: bool,
    /// Numbers of X, Y, Z.
    axes: [Option<Exact>; 3],
    /// Comments of the user: only the last piece has them.
    rest: Vec<u8>,
    /// Number of the block: the last piece keeps it.
    number: Option<f64>,
}

impl Frame {
    /// `None` for a line that could never be a piece.
    fn of(program: &Program, at: usize) -> Option<Self> {
        let block = BlockId(at as u32);
        let words = line::plain_words(program, block)?;
        let letters =
            words.iter().filter_map(|word| if let TokenKind::Word(letter) = word.kind { Some(letter) } else { None });
        let letters: Vec<u8> = letters.collect();
        let deleted = program.tokens(block).any(|token| token.kind == TokenKind::Delete);
        // Controls read a block number at the beginning only; LinuxCNC refuses the line otherwise.
        let numbered_late = letters.iter().skip(1).any(|letter| *letter == b'N');
        if deleted || numbered_late || words.is_empty() || !letters.iter().all(|letter| b"NFGXYZIJKR".contains(letter))
        {
            return None;
        }
        let arc = letters.iter().any(|letter| b"IJKR".contains(letter));
        let mut frame = Self { code: Vec::new(), arc, axes: [None; 3], rest: Vec::new(), number: None };
        for (word, letter) in words.iter().zip(letters) {
            let bytes = word.span.of(program.text());
            if let Some(axis) = AXES.iter().position(|axis| *axis == letter) {
                frame.axes[axis] = Some(Exact::read(line::number_of(bytes))?);
            } else if b"GR".contains(&letter) {
                frame.code.extend_from_slice(bytes);
            } else if letter == b'N' {
                frame.number = Some(word.number);
            }
        }
        for token in program.tokens(block).filter(|token| token.kind == TokenKind::Comment) {
            if !line::is_ours(program, &token) {
                frame.rest.extend_from_slice(token.span.of(program.text()));
            }
        }
        Some(frame)
    }
}
