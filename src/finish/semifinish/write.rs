//! The moved semi-finish as text. In: the program, its motions, offsets of the knots. Out: the same bytes with other
//! numbers in the coordinates of cutting moves.
//!
//! Words keep their place and number format. A coordinate that a block leaves out is added if the tool would otherwise
//! end elsewhere; for this the position is followed as on the control, where a rapid that leaves out an axis continues
//! from the end of the moved cut. An arc that cannot stay an arc becomes chords: the first in its own block, the others
//! in lines after it. A comment at the head marks the file ([`MARK`]).

use super::knots::Knots;
use super::proof::MARK;
use crate::ids::{BlockId, MoveId};
use crate::nc::{FeedMode, Move, MoveKind, Program, Syntax, Toolpath};
use crate::path::{Arc, Curve, Vec3};
use crate::rewrite::decimal::{Decimal, NumberStyle};
use crate::rewrite::edit::{Edit, apply};
use crate::rewrite::view::{Manners, Modes, Switched, View, Word, line_end, number_bytes};

const AXES: [u8; 3] = *b"XYZ";
const CENTRE: [u8; 3] = *b"IJK";
/// Largest difference between words and the interpreted path, mm.
const SAME_MM: f64 = 1e-6;

/// Can a program of this dialect be rewritten? Heidenhain plain language has arcs of two blocks and numbered lines.
pub fn is_written(program: &Program) -> bool {
    program.dialect().syntax() != Syntax::Heidenhain
}

/// For each move: may the coordinates of its block be rewritten? Only if the block makes this move alone and once, at a
/// feed per minute or per revolution, with plain numbers that give its end.
pub fn movable(program: &Program, path: &Toolpath) -> Vec<bool> {
    let mut may = vec![false; path.moves.len()];
    if !is_written(program) {
        return may;
    }
    let texts = Texts::new(program, path);
    // A block of a loop or a subprogram makes its move each time that it is executed.
    let mut moves_of = vec![0_u32; program.len()];
    for motion in &path.moves {
        if let Some(count) = moves_of.get_mut(motion.block.ix()) {
            *count += 1;
        }
    }
    for (index, motion) in path.moves.iter().enumerate() {
        let alone = moves_of.get(motion.block.ix()) == Some(&1);
        may[index] = motion.kind == MoveKind::Feed && alone && texts.may_move(program, path, index);
    }
    // After chords G1 is in force: the next block must name its motion code or be rewritable.
    for index in (0..path.moves.len()).rev() {
        let arc = matches!(path.moves[index].curve(), Curve::Arc(_));
        let Some(next) = path.moves.get(index + 1).filter(|_| arc && may[index]) else { continue };
        may[index] = texts.names_motion(next) || may[index + 1];
    }
    may
}

/// Blocks of the program's own text with the modal states in force.
struct Texts {
    views: Vec<View>,
    modes: Vec<Modes>,
}

impl Texts {
    fn new(program: &Program, path: &Toolpath) -> Self {
        let mut modes = Modes { inch: path.inch, incremental: false };
        let own = program.blocks().take(program.own_len());
        let mut texts = Self { views: Vec::new(), modes: Vec::new() };
        for block in own {
            modes = modes.after(Switched::by(program, block));
            texts.views.push(View::of(program, block));
            texts.modes.push(modes);
        }
        texts
    }

    fn may_move(&self, program: &Program, path: &Toolpath, index: usize) -> bool {
        let motion = &path.moves[index];
        let Some(view) = self.views.get(motion.block.ix()) else { return false };
        let letters = |word: &Word| b"NGXYZIJKRF".contains(&word.letter);
        let codes = |code: u32| matches!(code, 10 | 20 | 30 | 170 | 180 | 190 | 900);
        let once = |letter: u8| view.words.iter().filter(|word| word.letter == letter).count() <= 1;
        let inverse = motion.feed.mode == FeedMode::InverseTime;
        view.plain
            && !(view.delete || view.flow || view.computed_feed || inverse)
            && !(motion.compensated || motion.cycle || motion.instance > 0 || motion.freeze.is_some())
            && view.words.iter().all(letters)
            && view.g_codes().all(codes)
            && b"NXYZIJKRF".iter().all(|letter| once(*letter))
            && self.agrees(program, path, index, view)
    }

    /// Do the words of the block give the end and the centre of the move?
    fn agrees(&self, program: &Program, path: &Toolpath, index: usize, view: &View) -> bool {
        let motion = &path.moves[index];
        let (curve, modes) = (motion.curve(), self.modes[motion.block.ix()]);
        let (from, to, shift) = (curve.from(), curve.to(), path.shift_at(MoveId(index as u32)));
        let counts = program.dialect().properties().counts_increments;
        let sound = |word: &Word| {
            let number = number_bytes(program, word);
            Decimal::read(number).is_some() && (number.contains(&b'.') || word.number == 0.0 || !counts)
        };
        let ends = (0..3).all(|axis| match view.only(AXES[axis]) {
            None => (to[axis] - from[axis]).abs() <= SAME_MM,
            Some(word) => {
                let start = if modes.incremental { from[axis] } else { shift[axis] };
                sound(word) && (word.number * modes.unit_mm() + start - to[axis]).abs() <= SAME_MM
            }
        });
        let centre = match curve {
            Curve::Line { .. } => !b"IJKR".iter().any(|letter| view.has(*letter)),
            Curve::Arc(arc) => {
                let (a, b, _) = arc.plane.axes();
                let named = [a, b].iter().all(|axis| view.has(AXES[*axis]));
                let words = view.words.iter().filter(|word| b"IJKR".contains(&word.letter));
                let plain = words.into_iter().all(sound);
                let from_start = |axis: usize| {
                    let number = view.only(CENTRE[axis]).map_or(0.0, |word| word.number);
                    (number * modes.unit_mm() - arc.centre[axis] + arc.from[axis]).abs() <= SAME_MM
                };
                let by_radius = view.has(b'R') && !CENTRE.iter().any(|letter| view.has(*letter));
                named && plain && (by_radius || [a, b].into_iter().all(from_start))
            }
        };
        ends && centre
    }

    /// Does the block of a move have a motion code?
    fn names_motion(&self, motion: &Move) -> bool {
        let names = |view: &View| view.g_codes().any(|code| matches!(code, 0 | 10 | 20 | 30));
        self.views.get(motion.block.ix()).is_some_and(names)
    }
}

/// A moved program.
#[derive(Debug, Clone, PartialEq)]
pub struct Moved {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Blocks with changed coordinates.
    pub blocks_changed: usize,
    /// Coordinates added to blocks that left them out.
    pub words_added: usize,
    /// Arcs that became chords, and the lines added for these.
    pub arcs_cut: [usize; 2],
}

/// Writes the offsets into the program.
pub fn write(program: &Program, path: &Toolpath, knots: &Knots, offsets: &[Vec3], tolerance_mm: f64) -> Moved {
    let texts = Texts::new(program, path);
    let part = program.parts().next().expect("a program has its own text");
    let start = path.moves.first().map_or_else(Vec3::zeros, |motion| motion.curve().from());
    let mut writer = Writer {
        program,
        manners: Manners::of(program, &part),
        at: start,
        motion: None,
        edits: Vec::new(),
        moved: Moved { bytes: Vec::new(), blocks_changed: 0, words_added: 0, arcs_cut: [0; 2] },
    };
    for (index, motion) in path.moves.iter().enumerate() {
        let curve = motion.curve();
        let curves = knots.moved(&curve, index, offsets, tolerance_mm);
        let text = texts.views.get(motion.block.ix()).zip(texts.modes.get(motion.block.ix()));
        let free = |k: usize| knots.list[k].free;
        let may = knots.of_move[index].clone().any(|k| free(k as usize));
        match text {
            Some((view, modes)) if may => {
                let block = Block { view, modes: *modes, shift: path.shift_at(MoveId(index as u32)) };
                let ends: Vec<Curve> = curves.into_iter().map(|(curve, _)| curve).collect();
                writer.block(&block, &curve, &ends);
            }
            _ => writer.as_it_is(text.map(|(view, modes)| (view, *modes)), &curve, motion.kind),
        }
    }
    let Writer { edits, mut moved, .. } = writer;
    moved.bytes = apply(part.span, program.text(), marked(program, edits));
    moved
}

/// The edits with the mark before the first block of code, if there are edits and no mark yet.
fn marked(program: &Program, edits: Vec<Edit>) -> Vec<Edit> {
    let stands = memchr::memmem::find(program.text(), MARK.as_bytes()).is_some();
    let part = program.parts().next().expect("a program has its own text");
    let view = |block: &BlockId| View::of(program, *block);
    let code = |block: &BlockId| !view(block).empty && !view(block).flow && !view(block).words.is_empty();
    match part.blocks().find(code).filter(|_| !stands && !edits.is_empty()) {
        None => edits,
        Some(block) => {
            let comment = Manners::of(program, &part).comment.write(MARK).into_bytes();
            let line = [comment.as_slice(), line_end(program.text())].concat();
            std::iter::once(Edit::insert(program.span(block).start, line)).chain(edits).collect()
        }
    }
}

struct Block<'a> {
    view: &'a View,
    modes: Modes,
    shift: Vec3,
}

struct Writer<'a> {
    program: &'a Program,
    manners: Manners,
    /// Position of the tool in the written program, mm.
    at: Vec3,
    /// Motion code in force in the written program, in tenths.
    motion: Option<u32>,
    edits: Vec<Edit>,
    moved: Moved,
}

impl Writer<'_> {
    /// A block that is not rewritten: axes that it does not name keep the written position.
    fn as_it_is(&mut self, text: Option<(&View, Modes)>, curve: &Curve, kind: MoveKind) {
        let (from, to) = (curve.from(), curve.to());
        for axis in 0..3 {
            let moves = (to[axis] - from[axis]).abs() > SAME_MM;
            match text {
                Some((_, modes)) if modes.incremental => self.at[axis] += to[axis] - from[axis],
                Some((view, _)) if !moves && !view.has(AXES[axis]) => {}
                _ => self.at[axis] = to[axis],
            }
        }
        self.motion = Some(code(curve, kind));
    }

    fn block(&mut self, block: &Block, before: &Curve, after: &[Curve]) {
        let count = self.edits.len();
        let first = &after[0];
        let wanted = code(first, MoveKind::Feed);
        self.name_motion(block, [before, first], wanted);
        let start = self.at;
        self.coordinates(block, first.to());
        if let Curve::Arc(arc) = first {
            self.centre(block, arc, start);
        } else if matches!(before, Curve::Arc(_)) {
            let words = block.view.words.iter().filter(|word| b"IJKR".contains(&word.letter));
            let gone = words.map(|word| Edit::replace(self.with_blank_before(word), ""));
            self.edits.extend(gone.collect::<Vec<_>>());
        }
        // A chord shorter than the digits has no line.
        let mut rest: Vec<Vec<u8>> = after[1..].iter().map(|curve| self.line(block, curve.to())).collect();
        rest.retain(|line| !line.is_empty());
        if matches!((before, first), (Curve::Arc(_), Curve::Line { .. })) {
            self.moved.arcs_cut[0] += 1;
            self.moved.arcs_cut[1] += rest.len();
        }
        if !rest.is_empty() {
            let end = line_end(self.program.text());
            let text: Vec<u8> = rest.iter().flat_map(|line| [end, line].concat()).collect();
            self.edits.push(Edit::insert(block.view.line_end, text));
        }
        self.moved.blocks_changed += usize::from(self.edits.len() > count);
    }

    /// Writes the motion code if it differs from the one in force. The block of an arc that becomes a line always has
    /// it: with coordinates alone it would read as one more chord of the arc before.
    fn name_motion(&mut self, block: &Block, [before, first]: [&Curve; 2], wanted: u32) {
        let cut = matches!((before, first), (Curve::Arc(_), Curve::Line { .. }));
        let own = block.view.words.iter().find(|word| word.letter == b'G' && is_motion(word.number));
        let name = format!("{}{}", if self.manners.lower { 'g' } else { 'G' }, wanted / 10);
        match own {
            Some(word) if (word.number * 10.0).round() as u32 != wanted => {
                self.edits.push(Edit::replace(word.span, name));
            }
            None if cut || self.motion.unwrap_or(code(before, MoveKind::Feed)) != wanted => {
                let at = block
                    .view
                    .words
                    .iter()
                    .find(|word| word.letter != b'N')
                    .map_or(block.view.code_end, |w| w.span.start);
                let gap = if self.manners.spaced { " " } else { "" };
                self.edits.push(Edit::insert(at, format!("{name}{gap}")));
            }
            _ => {}
        }
        self.motion = Some(wanted);
    }

    /// Writes the words of the end point.
    fn coordinates(&mut self, block: &Block, to: Vec3) {
        let mut put_in = Vec::new();
        let like = block.view.words.iter().rfind(|word| AXES.contains(&word.letter)).copied();
        for axis in 0..3 {
            let word = block.view.only(AXES[axis]).copied();
            let Some(pattern) = word.or(like) else { continue };
            let (number, end) = self.number(block, axis, to[axis], &pattern);
            match word {
                Some(word) => {
                    let own = number_bytes(self.program, &word);
                    let same = Decimal::read(own).is_some_and(|own| own.minus(number).is_zero());
                    if !same {
                        self.edits.push(Edit::replace(word.span, self.written(&word, word.letter, number)));
                    }
                    self.at[axis] = end;
                }
                None if (end - self.at[axis]).abs() > SAME_MM => {
                    put_in.push(self.written(&pattern, AXES[axis], number));
                    self.at[axis] = end;
                }
                None => {}
            }
        }
        if let (Some(like), false) = (like, put_in.is_empty()) {
            self.moved.words_added += put_in.len();
            let gap: &[u8] = if self.manners.spaced { b" " } else { b"" };
            let text: Vec<u8> = put_in.iter().flat_map(|word| [gap, word].concat()).collect();
            self.edits.push(Edit::insert(like.span.end, text));
        }
    }

    /// The number of a coordinate, and the position it gives, mm.
    fn number(&self, block: &Block, axis: usize, to_mm: f64, like: &Word) -> (Decimal, f64) {
        let unit_mm = block.modes.unit_mm();
        let start = if block.modes.incremental { self.at[axis] } else { block.shift[axis] };
        let number = Decimal::nearest((to_mm - start) / unit_mm, self.digits(block, like));
        (number, start + number.value() * unit_mm)
    }

    fn digits(&self, block: &Block, like: &Word) -> u32 {
        let own = Decimal::read(number_bytes(self.program, like)).map_or(0, Decimal::digits);
        own.max(self.program.dialect().coordinate_digits(block.modes.inch) as u32)
    }

    /// Writes the words of the centre or radius of an arc that begins at `start`.
    fn centre(&mut self, block: &Block, arc: &Arc, start: Vec3) {
        let unit_mm = block.modes.unit_mm();
        if let Some(word) = block.view.only(b'R').copied() {
            let number = Decimal::nearest(word.number.signum() * arc.radius_mm / unit_mm, self.digits(block, &word));
            self.edits.push(Edit::replace(word.span, self.written(&word, b'R', number)));
            return;
        }
        let (a, b, _) = arc.plane.axes();
        let Some(like) = block.view.words.iter().rfind(|word| CENTRE.contains(&word.letter)).copied() else { return };
        for axis in [a, b] {
            let word = block.view.only(CENTRE[axis]).copied();
            let pattern = word.unwrap_or(like);
            let number = Decimal::nearest((arc.centre[axis] - start[axis]) / unit_mm, self.digits(block, &pattern));
            let text = self.written(&pattern, CENTRE[axis], number);
            match word {
                Some(word) => self.edits.push(Edit::replace(word.span, text)),
                None if !number.is_zero() => {
                    let gap: &[u8] = if self.manners.spaced { b" " } else { b"" };
                    self.edits.push(Edit::insert(like.span.end, [gap, &text].concat()));
                }
                None => {}
            }
        }
    }

    /// A line of coordinates that follows a block.
    fn line(&mut self, block: &Block, to: Vec3) -> Vec<u8> {
        let gap: &[u8] = if self.manners.spaced { b" " } else { b"" };
        let mut out = Vec::new();
        let like = block.view.words.iter().rfind(|word| AXES.contains(&word.letter)).copied();
        for axis in 0..3 {
            let Some(pattern) = block.view.only(AXES[axis]).copied().or(like) else { continue };
            let (number, end) = self.number(block, axis, to[axis], &pattern);
            if (end - self.at[axis]).abs() <= SAME_MM {
                continue;
            }
            self.at[axis] = end;
            if !out.is_empty() {
                out.extend_from_slice(gap);
            }
            out.extend(self.written(&pattern, AXES[axis], number));
        }
        out
    }

    fn with_blank_before(&self, word: &Word) -> crate::diag::Span {
        let text = self.program.text();
        let mut start = word.span.start;
        while start > 0 && matches!(text[start as usize - 1], b' ' | b'\t') {
            start -= 1;
        }
        crate::diag::Span { start, end: word.span.end }
    }

    /// A word in the format of another.
    fn written(&self, like: &Word, letter: u8, number: Decimal) -> Vec<u8> {
        let bytes = like.span.of(self.program.text());
        let own = number_bytes(self.program, like);
        let mut style = NumberStyle::of(own, self.manners.leading_zero);
        style.point |= self.program.dialect().properties().counts_increments;
        let between = &bytes[1..bytes.len() - own.len()];
        let letter = if bytes[0].is_ascii_lowercase() { letter.to_ascii_lowercase() } else { letter };
        [&[letter], between, style.write(number).as_bytes()].concat()
    }
}

fn is_motion(number: f64) -> bool {
    [0.0, 1.0, 2.0, 3.0].contains(&number)
}

/// The motion code of a curve, in tenths; an arc in XY and the other planes turns clockwise with G2.
fn code(curve: &Curve, kind: MoveKind) -> u32 {
    match (kind, curve) {
        (MoveKind::Rapid, _) => 0,
        (MoveKind::Feed, Curve::Line { .. }) => 10,
        (MoveKind::Feed, Curve::Arc(arc)) => {
            if arc.sweep_rad < 0.0 {
                20
            } else {
                30
            }
        }
    }
}
