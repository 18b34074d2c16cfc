//! Splitting one block into several. In: a block, its one move, and where along it the feed changes. Out: the text of the blocks to be written
//! before it, and the edits of the block itself, which becomes the last piece; `None` where the block must stay whole.
//!
//! A split point is a point of the control's grid within half an increment of the path, found by trying places near the wanted one. Under G91
//! the increments of the pieces add up to the original's exactly, in decimal. An arc given by its centre gets a centre worked out anew from each
//! rounded point; an arc given by its radius keeps the radius and is split only well below half a turn. In an arc in XY that leaves out X or Y
//! (a full circle: `G3 I-6.`) both are written in all pieces, because from another start point the same words would be another arc.
//!
//! Fanuc and Haas controls may read a coordinate without a decimal point in increments (`X50` is 0.050 mm there). A line whose coordinate has no
//! point at its beginning nor at its end is split at whole numbers only, written without a point, so that the pieces lie on the line however
//! the control reads it. A line with a point at one end only stays whole; so does an arc, unless the whole text is without points. Whole
//! numbers are far apart, so the split point is chosen so that the faster piece becomes the shorter one.

use crate::ids::{BlockId, MoveId};
use crate::nc::{Dialect, Move, Program, Toolpath};
use crate::path::{Arc, Curve, Vec3};

use super::decimal::{Decimal, NumberStyle};
use super::edit::Edit;
use super::view::{Manners, Modes, Points, View, Word, number_bytes, number_span};

/// Letters of the axes and of the centre.
const AXES: [u8; 3] = *b"XYZ";
const CENTRE: [u8; 3] = *b"IJK";
/// Largest difference between the coordinates in the text and the interpreted path, mm.
const SAME_MM: f64 = 1e-6;
/// Largest turn of an arc by its radius that is cut, rad.
const MOST_R_TURN_RAD: f64 = 2.97;
/// Places tried on either side of the wanted one.
const TRIES: i32 = 40;
/// Spacing of these places, in increments of the control.
const SPACING: f64 = 0.7;

/// Where a block is to be cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Place along its move, mm.
    pub at_mm: f64,
    /// Is the feed behind it the higher one?
    pub rises: bool,
}

/// A block and what is known of it.
#[derive(Clone, Copy)]
pub struct Block<'a> {
    /// The program.
    pub program: &'a Program,
    /// Which block.
    pub id: BlockId,
    /// Its text.
    pub view: &'a View,
    /// Modes in force in it.
    pub modes: Modes,
    /// Style of the file.
    pub manners: Manners,
    /// Its move.
    pub motion: &'a Move,
    /// The moves before it, in order of execution.
    pub before: &'a [Move],
    /// Shift of the programmed zero, mm.
    pub shift: Vec3,
}

/// A block in pieces.
#[derive(Debug, Clone, PartialEq)]
pub struct Pieces {
    /// Words of the blocks written before it, without N, F and line end; each with what stands before it.
    pub before: Vec<Vec<u8>>,
    /// Edits that make the block itself the last piece.
    pub edits: Vec<Edit>,
    /// Where along its move it is cut, mm: at points of the grid near the wanted ones.
    pub at_mm: Vec<f64>,
}

impl<'a> Block<'a> {
    /// Gathers what is known of the block of a move.
    pub fn new(
        program: &'a Program,
        toolpath: &'a Toolpath,
        view: &'a View,
        modes: Modes,
        manners: Manners,
        id: MoveId,
    ) -> Self {
        let (before, motion) = (&toolpath.moves[..id.ix()], &toolpath.moves[id.ix()]);
        Self { program, id: motion.block, view, modes, manners, motion, before, shift: toolpath.shift_at(id) }
    }
}

/// Can the block be cut at all?
pub fn can_be_cut(block: &Block<'_>) -> bool {
    let somewhere = |form: Form| !form.whole || near_point(block, &form, &Cut { at_mm: 0.0, rises: true }).is_some();
    form(block).is_some_and(somewhere)
}

fn form(block: &Block<'_>) -> Option<Form> {
    let counted = block.program.dialect().properties().counts_blocks;
    let may = block.motion.splittable && !counted && is_simple(block.view);
    may.then(|| Form::of(block)).flatten()
}

/// Cuts the block at these places (in order along its move, inside it); `None`: it must stay whole.
pub fn split(block: &Block<'_>, cuts: &[Cut]) -> Option<Pieces> {
    let form = form(block)?;
    let points = split_points(block, &form, cuts)?;
    let mut before = Vec::new();
    let mut start = Start { at: block.motion.curve().from(), gone: [Decimal::nearest(0.0, 0); 3] };
    for (_, point) in &points {
        before.push(piece_text(block, &form, &start, point));
        start = Start { at: point.at, gone: point.gone };
    }
    let at_mm = points.iter().map(|(at_mm, _)| *at_mm).collect();
    Some(Pieces { before, edits: last_edits(block, &form, &start)?, at_mm })
}

/// Only motions, coordinates, feed and number: nothing that would happen twice.
fn is_simple(view: &View) -> bool {
    let allowed = |word: &Word| b"NGXYZIJKRF".contains(&word.letter);
    let motion = |code: u32| matches!(code, 10 | 20 | 30 | 170 | 180 | 190);
    let once = |letter: u8| view.words.iter().filter(|word| word.letter == letter).count() <= 1;
    view.plain
        && !view.computed_feed
        && !view.delete
        && view.words.iter().all(allowed)
        && view.g_codes().all(motion)
        && b"NXYZIJKRF".iter().all(|&l| once(l))
}

/// How the words of the block give its geometry.
struct Form {
    unit_mm: f64,
    incremental: bool,
    axes: [Option<Axis>; 3],
    centre: Centre,
    /// Is a coordinate cut at whole numbers only?
    whole: bool,
}

/// A coordinate of the pieces.
#[derive(Clone, Copy)]
struct Axis {
    /// Its word; an arc may leave it out.
    word: Option<Word>,
    /// Digits after the point that its numbers may have.
    digits: u32,
}

#[derive(Clone, Copy, PartialEq)]
enum Centre {
    None,
    /// By R.
    Radius,
    /// I J K from the start, or from the programmed zero.
    FromStart,
    Absolute,
}

impl Form {
    fn of(block: &Block<'_>) -> Option<Self> {
        let unit_mm = block.modes.unit_mm();
        let dialect = block.program.dialect();
        let pointless = is_pointless(block);
        let least = if pointless { 0 } else { dialect.coordinate_digits(block.modes.inch) as u32 };
        let (mut axes, mut whole) = ([None; 3], pointless);
        for (axis, letter) in AXES.into_iter().enumerate() {
            let Some(word) = block.view.only(letter) else {
                axes[axis] = left_out(block, axis).then_some(Axis { word: None, digits: least });
                continue;
            };
            let digits = Decimal::read(number_bytes(block.program, word))?.digits();
            let without = pointless || runs_without_point(block, axis, word)?;
            whole |= without;
            axes[axis] = Some(Axis { word: Some(*word), digits: if without { 0 } else { digits.max(least) } });
        }
        let form = Self { unit_mm, incremental: block.modes.incremental, axes, centre: Centre::None, whole };
        form.agrees(block).then_some(())?;
        match &block.motion.curve() {
            Curve::Line { .. } => no_centre_words(block.view).then_some(form),
            Curve::Arc(_) if !pointless && (whole || has_pointless_centre(block)) => None,
            Curve::Arc(arc) => Some(Self { centre: form.centre_of(block, arc)?, ..form }),
        }
    }
    /// Do the words of the block give the end point of the move, up to a shift?
    fn agrees(&self, block: &Block<'_>) -> bool {
        let (from, to) = (block.motion.curve().from(), block.motion.curve().to());
        (0..3).all(|axis| match self.axes[axis] {
            None => (to[axis] - from[axis]).abs() <= SAME_MM,
            Some(Axis { word, digits }) => {
                let start = if self.incremental { from[axis] } else { block.shift[axis] };
                let number = word.map_or_else(|| self.end(block, axis, digits).value(), |word| word.number);
                let stays = word.is_some() || (to[axis] - from[axis]).abs() <= SAME_MM;
                stays && (number * self.unit_mm + start - to[axis]).abs() <= SAME_MM
            }
        })
    }
    /// The number of a coordinate that the block leaves out, where it ends.
    fn end(&self, block: &Block<'_>, axis: usize, digits: u32) -> Decimal {
        let start = if self.incremental { block.motion.curve().from() } else { block.shift };
        Decimal::nearest((block.motion.curve().to()[axis] - start[axis]) / self.unit_mm, digits)
    }
    fn centre_of(&self, block: &Block<'_>, arc: &Arc) -> Option<Centre> {
        let (a, b, normal) = arc.plane.axes();
        if self.axes[a].is_none() || self.axes[b].is_none() || block.view.has(CENTRE[normal]) {
            return None;
        }
        if let Some(radius) = block.view.only(b'R') {
            return (radius.number > 0.0 && arc.sweep_rad.abs() < MOST_R_TURN_RAD).then_some(Centre::Radius);
        }
        let words = [a, b].map(|axis| (axis, block.view.only(CENTRE[axis]).map(|word| word.number * self.unit_mm)));
        let meets = |absolute: bool| {
            words.iter().all(|&(axis, word)| {
                let start = if absolute { block.shift[axis] } else { arc.from[axis] };
                match word {
                    Some(value) => (value + start - arc.centre[axis]).abs() <= SAME_MM,
                    None => (arc.centre[axis] - arc.from[axis]).abs() <= SAME_MM,
                }
            })
        };
        let both = words.iter().all(|(_, word)| word.is_some());
        match (meets(false), both && meets(true)) {
            (true, false) => Some(Centre::FromStart),
            (false, true) => Some(Centre::Absolute),
            _ => None,
        }
    }
}

/// Is it a coordinate of an arc in XY that the block does not name?
fn left_out(block: &Block<'_>, axis: usize) -> bool {
    matches!(block.motion.curve(), Curve::Arc(arc) if arc.plane.axes().2 == 2) && axis < 2
}

/// Is a coordinate written without a point from where the block begins to where it ends? `None`: at one end only, or that is
/// not known.
fn runs_without_point(block: &Block<'_>, axis: usize, word: &Word) -> Option<bool> {
    if !counts_increments(block.program.dialect()) || block.manners.points == Points::All {
        return Some(false);
    }
    let has_point =
        |program: &Program, word: &Word| (word.number != 0.0).then(|| number_bytes(program, word).contains(&b'.'));
    let end = has_point(block.program, word);
    let start = if block.modes.incremental {
        Some(end)
    } else {
        begins_with(block, axis).map(|w| has_point(block.program, &w))
    };
    match (start, end) {
        (Some(Some(start)), Some(end)) if start != end => None,
        (None, Some(false)) => None,
        (start, end) => Some(start.flatten().or(end) == Some(false)),
    }
}

/// Is a centre or radius written without a point, which may be increments?
fn has_pointless_centre(block: &Block<'_>) -> bool {
    let pointless = |word: &Word| word.number != 0.0 && !number_bytes(block.program, word).contains(&b'.');
    let counts = counts_increments(block.program.dialect()) && block.manners.points != Points::All;
    counts && b"IJKR".iter().any(|letter| block.view.only(*letter).is_some_and(pointless))
}

/// The word that says where a coordinate begins; `None`: the last one says something else, or there is none.
fn begins_with(block: &Block<'_>, axis: usize) -> Option<Word> {
    let from = block.motion.curve().from()[axis];
    let word = block.before.iter().rev().find_map(|motion| {
        let view = View::of(block.program, motion.block);
        view.has(AXES[axis]).then(|| view.only(AXES[axis]).copied())
    });
    let says = |word: &Word| (word.number * block.modes.unit_mm() + block.shift[axis] - from).abs() <= SAME_MM;
    word.flatten().filter(says)
}

fn no_centre_words(view: &View) -> bool {
    !b"IJKR".iter().any(|&letter| view.has(letter))
}

/// Older Fanuc controls read a coordinate without a point in increments.
fn counts_increments(dialect: Dialect) -> bool {
    dialect.properties().counts_increments
}

/// Where a piece begins: the point, and what the increments before it add up to (units of the program).
struct Start {
    at: Vec3,
    gone: [Decimal; 3],
}

/// A rounded split point.
struct Point {
    at: Vec3,
    /// Programmed coordinates under G90, sum of the increments under G91.
    coordinate: [Decimal; 3],
    gone: [Decimal; 3],
}

/// The points, each with its place along the move.
fn split_points(block: &Block<'_>, form: &Form, cuts: &[Cut]) -> Option<Vec<(f64, Point)>> {
    let mut points = Vec::new();
    let mut last_mm = 0.0;
    for cut in cuts {
        let (at_mm, point) = near_point(block, form, cut)?;
        if at_mm - last_mm < SAME_MM {
            return None;
        }
        last_mm = at_mm;
        points.push((at_mm, point));
    }
    Some(points)
}

/// The point of the grid near this place that lies within half an increment of the path, and where along it; the nearest place
/// first. Of whole numbers only those that make the faster piece shorter.
fn near_point(block: &Block<'_>, form: &Form, cut: &Cut) -> Option<(f64, Point)> {
    let increment_mm = increment_mm(block);
    let length_mm = block.motion.curve().length();
    let grid_mm = if form.whole { form.unit_mm } else { increment_mm };
    let offsets = (0..=2 * TRIES).map(|i| f64::from(if i % 2 == 0 { i / 2 } else { -(i + 1) / 2 }));
    let inside = offsets.map(|k| cut.at_mm + k * SPACING * grid_mm).filter(|s| (0.0..=length_mm).contains(s));
    inside.map(|s| (s, rounded(block, form, s))).find_map(|(s, point)| {
        let (at_mm, off_mm) = nearest(&block.motion.curve(), s, point.at, 4.0 * grid_mm);
        let slower = !form.whole || if cut.rises { at_mm >= cut.at_mm - SAME_MM } else { at_mm <= cut.at_mm + SAME_MM };
        let within = at_mm > SAME_MM && at_mm < length_mm - SAME_MM;
        (off_mm <= 0.5 * increment_mm && slower && within).then_some((at_mm, point))
    })
}

/// Is the block of a text without points?
fn is_pointless(block: &Block<'_>) -> bool {
    counts_increments(block.program.dialect()) && block.manners.points == Points::None
}

/// The increment of the control, mm.
pub fn increment_mm(block: &Block<'_>) -> f64 {
    10f64.powi(-(block.program.dialect().coordinate_digits(block.modes.inch) as i32)) * block.modes.unit_mm()
}

/// The place of the curve within `reach_mm` of the place `s_mm` that is nearest to a point, and its distance.
fn nearest(curve: &Curve, s_mm: f64, point: Vec3, reach_mm: f64) -> (f64, f64) {
    let mut s = s_mm;
    for _ in 0..4 {
        s += (point - curve.point(s)).dot(&curve.tangent(s)).clamp(-reach_mm, reach_mm);
    }
    (s, (point - curve.point(s)).norm())
}

fn rounded(block: &Block<'_>, form: &Form, s_mm: f64) -> Point {
    let exact = block.motion.curve().point(s_mm);
    let from = block.motion.curve().from();
    let mut point = Point { at: exact, coordinate: [Decimal::nearest(0.0, 0); 3], gone: [Decimal::nearest(0.0, 0); 3] };
    for axis in 0..3 {
        let Some(Axis { digits, .. }) = form.axes[axis] else { continue };
        let zero = if form.incremental { from[axis] } else { block.shift[axis] };
        let number = Decimal::nearest((exact[axis] - zero) / form.unit_mm, digits);
        point.at[axis] = zero + number.value() * form.unit_mm;
        point.coordinate[axis] = number;
        point.gone[axis] = number;
    }
    point
}

/// The words of a piece before the block itself.
fn piece_text(block: &Block<'_>, form: &Form, start: &Start, point: &Point) -> Vec<u8> {
    let mut out = Vec::new();
    let text = block.program.text();
    let mut end = block.program.span(block.id).start;
    let coordinate = |axis: usize| {
        if form.incremental { point.coordinate[axis].minus(start.gone[axis]) } else { point.coordinate[axis] }
    };
    for (index, word) in block.view.words.iter().enumerate() {
        // A comment stays with the last piece: the control may act on it.
        let gap = text[end as usize..word.span.start as usize].split(|&byte| byte == b'(').next().unwrap_or_default();
        end = word.span.end;
        if first_of_centre(block) == Some(index) {
            for axis in written_in(form) {
                out.extend_from_slice(gap);
                out.extend_from_slice(&written(block, form, word, AXES[axis], coordinate(axis)));
            }
        }
        if b"NF".contains(&word.letter) {
            if out.is_empty() && word.letter == b'N' {
                out.extend_from_slice(gap);
            }
            continue;
        }
        let replaced = match axis_of(word.letter) {
            Some(axis) => vec![(AXES[axis], coordinate(axis))],
            None => centre_numbers(block, form, start, word),
        };
        if replaced.is_empty() {
            out.extend_from_slice(gap);
            out.extend_from_slice(word.span.of(text));
        }
        for (letter, number) in replaced {
            out.extend_from_slice(gap);
            out.extend_from_slice(&written(block, form, word, letter, number));
        }
    }
    out
}

/// The coordinates that the block leaves out and its pieces must have.
fn written_in(form: &Form) -> impl Iterator<Item = usize> {
    (0..3).filter(|&axis| form.axes[axis].is_some_and(|axis| axis.word.is_none()))
}

/// The first word of the block that says centre or radius: coordinates stand before it.
fn first_of_centre(block: &Block<'_>) -> Option<usize> {
    block.view.words.iter().position(|word| b"IJKR".contains(&word.letter))
}

/// What stands in place of a word of the centre: nothing new (empty), or the word and, where it was left out, its partner.
fn centre_numbers(block: &Block<'_>, form: &Form, start: &Start, word: &Word) -> Vec<(u8, Decimal)> {
    let (Curve::Arc(arc), Centre::FromStart) = (&block.motion.curve(), form.centre) else { return Vec::new() };
    let (a, b, _) = arc.plane.axes();
    if !CENTRE.contains(&word.letter) || (start.at - arc.from).norm() < SAME_MM {
        return Vec::new();
    }
    let least =
        if is_pointless(block) { 0 } else { block.program.dialect().coordinate_digits(block.modes.inch) as u32 };
    let number = |axis: usize| {
        let digits = block
            .view
            .only(CENTRE[axis])
            .and_then(|w| Decimal::read(number_bytes(block.program, w)))
            .map_or(0, Decimal::digits);
        (CENTRE[axis], Decimal::nearest((arc.centre[axis] - start.at[axis]) / form.unit_mm, digits.max(least)))
    };
    let own = usize::from(word.letter - b'I');
    let partner = if own == a { b } else { a };
    if block.view.has(CENTRE[partner]) { vec![number(own)] } else { vec![number(own), number(partner)] }
}

fn axis_of(letter: u8) -> Option<usize> {
    AXES.iter().position(|&axis| axis == letter)
}

/// A word in the style of another.
fn written(block: &Block<'_>, form: &Form, like: &Word, letter: u8, number: Decimal) -> Vec<u8> {
    let bytes = like.span.of(block.program.text());
    let own = number_bytes(block.program, like);
    let mut style = NumberStyle::of(own, block.manners.leading_zero);
    let without = match axis_of(letter).and_then(|axis| form.axes[axis]) {
        Some(axis) => form.whole && axis.digits == 0,
        None => is_pointless(block),
    };
    style.point |= counts_increments(block.program.dialect()) && !without;
    let between = &bytes[1..bytes.len() - own.len()];
    let letter = if bytes[0].is_ascii_lowercase() { letter.to_ascii_lowercase() } else { letter };
    [&[letter], between, style.write(number).as_bytes()].concat()
}

/// Edits that let the block begin at the last split point.
fn last_edits(block: &Block<'_>, form: &Form, start: &Start) -> Option<Vec<Edit>> {
    let mut edits = Vec::new();
    for (index, word) in block.view.words.iter().enumerate() {
        let span = number_span(block.program, word);
        if let (Some(axis), true) = (axis_of(word.letter), form.incremental) {
            let whole = Decimal::read(span.of(block.program.text()))?;
            let text = written(block, form, word, word.letter, whole.minus(start.gone[axis]));
            edits.push(Edit::replace(word.span, text));
        }
        let mut texts = Vec::new();
        if first_of_centre(block) == Some(index) {
            for axis in written_in(form) {
                let digits = form.axes[axis].map_or(0, |axis| axis.digits);
                let end = form.end(block, axis, digits);
                let rest = if form.incremental { end.minus(start.gone[axis]) } else { end };
                texts.push(written(block, form, word, AXES[axis], rest));
            }
        }
        let words = centre_numbers(block, form, start, word);
        if words.is_empty() && texts.is_empty() {
            continue;
        }
        texts.extend(words.iter().map(|&(letter, number)| written(block, form, word, letter, number)));
        if words.is_empty() {
            texts.push(word.span.of(block.program.text()).to_vec());
        }
        let gap: &[u8] = if block.manners.spaced { b" " } else { b"" };
        edits.push(Edit::replace(word.span, texts.join(gap)));
    }
    Some(edits)
}
