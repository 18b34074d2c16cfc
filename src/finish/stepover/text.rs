//! The program as text. In: motions of the tip in mm, dialect, unit. Out: text.
//!
//! The text is unambiguous: the head sets plane, unit, absolute positions, feed per minute and work offset; motion
//! codes and coordinates are written when they change. Centres of arcs are relative to their start.

use super::fit::{Circle, SAME_MM};
use super::layout::Layout;
use super::path::Step;
use super::request::Request;
use crate::nc::{CommentForm, Dialect, Syntax};
use crate::path::{Plane, Vec3};
use crate::units::{MM_PER_INCH, mm_min_from_mm_s, rpm_from_rps};
use std::fmt::Write;

/// First words of the comment at the head, by which a file is recognised.
pub const MARK: &str = "PASSES OF VARYING STEP-OVER BY FEEDWRIGHT";

/// Settings for the head of the program.
#[derive(Debug, Clone, PartialEq)]
pub struct Head {
    /// Name of the file, without folder and ending.
    pub name: String,
    /// Dialect.
    pub dialect: Dialect,
    /// In inches?
    pub inch: bool,
    /// Tool number.
    pub tool: u32,
    /// Spindle speed, rev/s.
    pub rps: f64,
    /// Comments.
    pub notes: Vec<String>,
}

/// Number of a program of Fanuc or Haas whose name has none; these controls know programs by their number.
pub const UNNAMED: u32 = 1;

/// Largest number of a user's program: from 8000 on they are protected or the machine builder's.
const MOST_NUMBER: u32 = 7999;

/// Number of a program of Fanuc or Haas from the only number in the name of its file: `part1234` is O1234.
pub fn program_number(name: &str) -> Option<u32> {
    let mut numbers = name.split(|letter: char| !letter.is_ascii_digit()).filter(|digits| !digits.is_empty());
    let only = numbers.next().filter(|_| numbers.next().is_none())?;
    only.parse().ok().filter(|number| (1..=MOST_NUMBER).contains(number))
}

/// Name of a program in plain language: letters, digits and `_` of the name of its file.
fn plain_name(name: &str) -> String {
    let known = name.chars().filter(|letter| letter.is_ascii_alphanumeric() || *letter == '_');
    let name: String = known.take(MOST_LETTERS).collect::<String>().to_ascii_uppercase();
    if name.is_empty() { "STEPOVER".into() } else { name }
}

/// Letters of a name that older controls of Heidenhain take.
const MOST_LETTERS: usize = 16;

/// What the program was made for, as comments in its own unit.
pub fn made_for(ask: &Request, reference_n: f64, by_earlier: bool, inch: bool) -> Vec<String> {
    let length = |mm: f64| {
        let (value, unit) = if inch { (mm / MM_PER_INCH, "IN") } else { (mm, "MM") };
        format!("{} {unit}", number(value, DIGITS[usize::from(inch)] + 1).trim_end_matches('.'))
    };
    let stock = if by_earlier {
        "STOCK AS LEFT BY AN EARLIER PROGRAM".into()
    } else {
        format!("STOCK {}", length(ask.stock_mm))
    };
    vec![
        format!("FORCE {} N, SCALLOP {}", number(reference_n, 2).trim_end_matches('.'), length(ask.scallop_mm)),
        format!("{stock}, LINES WITHIN {}", length(ask.tolerance_mm)),
    ]
}

/// Digits of a coordinate behind the point: mm, inch.
const DIGITS: [usize; 2] = [3, 4];

/// A length as it is written in mm or inches, mm.
pub fn rounded_mm(mm: f64, inch: bool) -> f64 {
    let per_unit = if inch { MM_PER_INCH } else { 1.0 };
    let whole = 10f64.powi(DIGITS[usize::from(inch)] as i32);
    (mm / per_unit * whole).round() / whole * per_unit
}

/// How far a written place may be from the one that is meant, mm: half a digit along each axis.
pub fn rounding_mm(inch: bool) -> f64 {
    let digit_mm = if inch { MM_PER_INCH } else { 1.0 } / 10f64.powi(DIGITS[usize::from(inch)] as i32);
    0.5 * 3f64.sqrt() * digit_mm
}

/// Usual tolerance of lines and arcs, mm. Scallops rise by it, so that it is at most a tenth of their limit: on a mould passes within 0.001 mm
/// took 4 % less time than passes within 0.003 mm, in 16 % more lines. Passes of one height keep their arcs.
pub fn usual_tolerance_mm(scallop_mm: f64, layout: &Layout, inch: bool) -> f64 {
    let least_mm = ROUNDED * rounding_mm(inch);
    match layout {
        Layout::Contour { .. } => LINES_MM.max(least_mm),
        Layout::Parallel { .. } => LINES_MM.min(0.1 * scallop_mm).max(least_mm),
    }
}

/// Largest usual tolerance of lines and arcs, mm.
const LINES_MM: f64 = 0.003;
/// Least usual tolerance over the rounding of coordinates: 0.001 mm in millimetres, 0.0025 mm in inches.
const ROUNDED: f64 = 1.16;

/// Are arcs in this plane written? On Siemens controls a plane other than XY changes the axis of the tool length, and
/// Heidenhain plain language has no arcs in it.
pub fn has_arcs(dialect: Dialect, plane: Plane) -> bool {
    plane == Plane::Xy || dialect.syntax() == Syntax::Rs274
}

/// The program.
pub fn program(head: &Head, steps: &[Step]) -> String {
    let mut writer = Writer {
        head,
        text: String::new(),
        lines: 0,
        at: [const { None }; 3],
        feed: None,
        kind: None,
        plane: Plane::Xy,
    };
    writer.head();
    for step in steps {
        writer.step(step);
    }
    writer.foot();
    writer.text
}

struct Writer<'a> {
    head: &'a Head,
    text: String,
    lines: u32,
    /// Coordinates last written.
    at: [Option<String>; 3],
    feed: Option<String>,
    kind: Option<&'static str>,
    plane: Plane,
}

impl Writer<'_> {
    fn plain(&self) -> bool {
        self.head.dialect.syntax() == Syntax::Heidenhain
    }

    fn say(&mut self, line: &str) {
        if self.plain() {
            let _ = write!(self.text, "{} ", self.lines);
        }
        self.text.push_str(line);
        self.text.push('\n');
        self.lines += 1;
    }

    fn comment(&mut self, text: &str) {
        let form = match self.head.dialect.syntax() {
            Syntax::Rs274 => CommentForm::Parentheses,
            _ => CommentForm::Semicolon,
        };
        let ascii: String = text.chars().filter(char::is_ascii).collect();
        self.say(&form.write(&ascii));
    }

    fn head(&mut self) {
        let Head { name, dialect, inch, tool, rps, notes } = self.head;
        let rpm = number(rpm_from_rps(*rps), 0);
        match dialect.syntax() {
            Syntax::Heidenhain => {
                self.say(&format!("BEGIN PGM {} {}", plain_name(name), if *inch { "INCH" } else { "MM" }));
            }
            Syntax::Rs274 if matches!(dialect, Dialect::Fanuc | Dialect::Haas) => {
                self.say("%");
                self.say(&format!("O{:04}", program_number(name).unwrap_or(UNNAMED)));
            }
            _ => {}
        }
        self.comment(MARK);
        for note in notes {
            self.comment(note);
        }
        match dialect.syntax() {
            Syntax::Heidenhain => {
                self.say(&format!("TOOL CALL {tool} Z S{rpm}"));
                self.say("M3");
            }
            Syntax::Siemens => {
                self.say(&format!("{} G17 G40 G90 G94", if *inch { "G700" } else { "G710" }));
                self.say(&format!("T{tool}"));
                self.say("M6");
                self.say("G54 D1");
                self.say(&format!("S{rpm} M3"));
            }
            Syntax::Rs274 => {
                self.say(&format!("{} G17 G40 G90 G94", if *inch { "G20" } else { "G21" }));
                if *dialect == Dialect::Grbl {
                    self.comment(&format!("TOOL {tool}"));
                    self.say("G54");
                } else {
                    self.say(&format!("T{tool} M6"));
                    self.say(&format!("G54 G43 H{tool}"));
                }
                self.say(&format!("S{rpm} M3"));
            }
        }
    }

    fn step(&mut self, step: &Step) {
        if self.at[2].is_none() {
            // The start position is not known: first up, then across.
            let height = self.coordinate(&step.to, 2);
            let sign = if self.plain() && !height.starts_with('-') { "+" } else { "" };
            let (before, after) = if self.plain() { ("L", " R0 FMAX") } else { ("G0", "") };
            self.say(&format!("{before} Z{sign}{height}{after}"));
            self.at[2] = Some(height);
        }
        let arc = step.via.and_then(|via| self.arc(via, &step.to));
        let words = self.place(&step.to);
        let rapid = step.feed_mm_s.is_none();
        let mut feed = String::new();
        if let Some(f) = step.feed_mm_s {
            let Head { dialect, inch, .. } = self.head;
            let value = feed_number(mm_min_from_mm_s(f) / dialect.feed_unit_mm(*inch), *inch && !self.plain());
            if self.feed.as_deref() != Some(&value) {
                feed = format!(" F{value}");
                self.feed = Some(value);
            }
        }
        if self.plain() {
            self.plain_motion(&words, arc, if rapid { " R0 FMAX" } else { &feed });
        } else {
            self.motion(&words, arc, rapid, &feed);
        }
    }

    /// A motion block in G code.
    fn motion(&mut self, words: &str, arc: Option<Arc>, rapid: bool, feed: &str) {
        let mut line = String::new();
        if let Some(arc) = arc.filter(|arc| arc.plane != self.plane) {
            line.push_str(plane_word(arc.plane));
            line.push(' ');
            self.plane = arc.plane;
        }
        let kind = match arc {
            Some(arc) if arc.left => "G3",
            Some(_) => "G2",
            None if rapid => "G0",
            None => "G1",
        };
        if self.kind != Some(kind) {
            line.push_str(kind);
            self.kind = Some(kind);
        }
        line.push_str(words);
        if let Some(arc) = arc {
            let (u, v, _) = arc.plane.axes();
            let (one, other) = if u < v { (0, 1) } else { (1, 0) };
            for k in [one, other] {
                let letter = ["I", "J", "K"][[u, v][k]];
                let _ = write!(line, " {letter}{}", self.value(arc.from_start_mm[k]));
            }
        }
        line.push_str(feed);
        self.say(line.trim_start());
    }

    /// A motion block in plain language; an arc is a block with its centre and one with its end.
    fn plain_motion(&mut self, words: &str, arc: Option<Arc>, end: &str) {
        let Some(arc) = arc else {
            self.say(&format!("L{words}{end}"));
            return;
        };
        let at = |axis: usize| self.at_start(arc, axis);
        let (x, y) = (at(0), at(1));
        self.say(&format!("CC X{x} Y{y}"));
        let way = if arc.left { "+" } else { "-" };
        self.say(&format!("C{words} DR{way}{end}"));
    }

    /// Coordinate of the centre of an arc in plain language (absolute, with sign).
    fn at_start(&self, arc: Arc, axis: usize) -> String {
        let text = self.value(arc.start_mm[axis] + arc.from_start_mm[axis]);
        if text.starts_with('-') { text } else { format!("+{text}") }
    }

    /// The arc from the last written position through `via` to the written position of `to`, mm.
    fn arc(&self, via: Vec3, to: &Vec3) -> Option<Arc> {
        let per_unit = if self.head.inch { MM_PER_INCH } else { 1.0 };
        let mut from = Vec3::zeros();
        for axis in 0..3 {
            from[axis] = self.at[axis].as_ref()?.parse::<f64>().ok()? * per_unit;
        }
        let end = Vec3::from_fn(|axis, _| self.coordinate(to, axis).parse::<f64>().unwrap_or(to[axis]) * per_unit);
        // Along the axis normal to its plane an arc does not move at all. Along another one its ends may be written alike, and a shallow arc differs from
        // them by less than a digit.
        let still_mm = |axis: usize| (via[axis] - to[axis]).abs();
        let written_alike = (0..3).filter(|axis| from[*axis] == end[*axis] && still_mm(*axis) < SAME_MM);
        let flat = written_alike.min_by(|a, b| still_mm(*a).total_cmp(&still_mm(*b)))?;
        let mut via = via;
        via[flat] = from[flat];
        let circle = Circle::through(from, via, end)?;
        let (u, v, _) = circle.plane.axes();
        let start_mm = [from[u], from[v]];
        let from_start_mm = [circle.centre[0] - from[u], circle.centre[1] - from[v]];
        Some(Arc { plane: circle.plane, left: circle.left, start_mm, from_start_mm })
    }

    /// A coordinate in the unit of the program.
    fn coordinate(&self, to: &Vec3, axis: usize) -> String {
        self.value(to[axis])
    }

    /// A length in the unit of the program.
    fn value(&self, mm: f64) -> String {
        let per_unit = if self.head.inch { MM_PER_INCH } else { 1.0 };
        let text = number(mm / per_unit, DIGITS[usize::from(self.head.inch)]);
        // Plain language counts no increments, and a TNC writes no number that ends in a point.
        if self.plain() { text.trim_end_matches('.').into() } else { text }
    }

    /// The coordinates that differ from those last written.
    fn place(&mut self, to: &Vec3) -> String {
        let mut words = String::new();
        for (axis, letter) in ["X", "Y", "Z"].into_iter().enumerate() {
            let value = self.coordinate(to, axis);
            if self.at[axis].as_ref() != Some(&value) {
                let sign = if self.plain() && !value.starts_with('-') { "+" } else { "" };
                let _ = write!(words, " {letter}{sign}{value}");
                self.at[axis] = Some(value);
            }
        }
        if words.is_empty() {
            // A block needs a coordinate: repeat Z.
            let value = self.at[2].clone().unwrap_or_default();
            let sign = if self.plain() && !value.starts_with('-') { "+" } else { "" };
            let _ = write!(words, " Z{sign}{value}");
        }
        words
    }

    fn foot(&mut self) {
        if self.plain() {
            self.say("M30");
            self.say(&format!("END PGM STEPOVER {}", if self.head.inch { "INCH" } else { "MM" }));
        } else {
            if self.plane != Plane::Xy {
                self.say("G17");
            }
            self.say("M5");
            self.say("M30");
        }
        if matches!(self.head.dialect, Dialect::Fanuc | Dialect::Haas) {
            self.say("%");
        }
    }
}

/// An arc as written.
#[derive(Debug, Clone, Copy)]
struct Arc {
    plane: Plane,
    /// Counter-clockwise?
    left: bool,
    /// Start along the two axes of the plane, mm.
    start_mm: [f64; 2],
    /// Centre from there, mm.
    from_start_mm: [f64; 2],
}

fn plane_word(plane: Plane) -> &'static str {
    match plane {
        Plane::Xy => "G17",
        Plane::Zx => "G18",
        Plane::Yz => "G19",
    }
}

/// A number with a decimal point, so that no control takes it for increments.
fn number(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    if digits == 0 {
        return text;
    }
    let text = text.trim_end_matches('0');
    if text == "-0." { "0.".into() } else { text.into() }
}

/// Figures of a feed.
const FIGURES: i32 = 4;
/// Most digits of a feed behind the point.
const MOST_DIGITS: i32 = 5;

/// A feed with as many digits as keep its figures, and a decimal point where asked for.
fn feed_number(value: f64, point: bool) -> String {
    let before_point = value.log10().floor() as i32 + 1;
    let text = number(value, (FIGURES - before_point).clamp(i32::from(point), MOST_DIGITS) as usize);
    if point { text } else { text.trim_end_matches('.').into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nc::{Environment, interpret, parse};

    /// A feed of less than one per minute is not zero, and one that is not whole is not rounded to the next whole one.
    #[test]
    fn feeds_keep_four_figures() {
        for (value, without, with) in [
            (12_345.6, "12346", "12345.6"),
            (960.0, "960", "960."),
            (544.13, "544.1", "544.1"),
            (37.795, "37.8", "37.8"),
            (6.404, "6.404", "6.404"),
            (0.3, "0.3", "0.3"),
            (0.012_345_6, "0.01235", "0.01235"),
        ] {
            assert_eq!([false, true].map(|point| feed_number(value, point)), [without, with], "{value}");
        }
    }

    #[test]
    fn a_program_has_the_name_of_its_file() {
        for (name, number) in [
            ("part1234", Some(1234)),
            ("12", Some(12)),
            ("die", None),
            ("part0", None),
            ("a12345", None),
            ("v2-part7", None),
            ("p7999", Some(7999)),
            ("p8000", None),
        ] {
            assert_eq!(program_number(name), number, "{name}");
        }
        for (name, plain) in
            [("floor-2", "FLOOR2"), ("", "STEPOVER"), ("a_very_long_name_of_a_part", "A_VERY_LONG_NAME")]
        {
            assert_eq!(plain_name(name), plain);
        }
    }

    /// An arc whose ends have the same X, as written: in inches it rises by less than ten digits, and the height is rounded by half a digit. Its
    /// plane is that of its heights all the same; with the plane taken from X it went 1.7 mm into the part.
    #[test]
    fn a_shallow_arc_stays_in_its_plane() {
        let (radius_mm, half_rad) = (7.73, 0.0487f64);
        let at = |angle: f64| Vec3::new(-radius_mm * angle.cos(), radius_mm * angle.sin(), 2.00004);
        let step = |to, via| Step { to, via, feed_mm_s: Some(10.0), of: None };
        let steps = [step(at(-half_rad), None), step(at(half_rad), Some(at(0.0)))];
        for dialect in [Dialect::Heidenhain, Dialect::LinuxCnc, Dialect::Fanuc] {
            for inch in [false, true] {
                let head = Head { name: String::new(), dialect, inch, tool: 1, rps: 100.0, notes: Vec::new() };
                let text = program(&head, &steps);
                let path = interpret(&parse(text.clone().into_bytes(), Some(dialect)), &Environment::default());
                let curve = path.moves.last().unwrap().curve();
                assert!(matches!(curve, crate::path::Curve::Arc(_)), "{text}");
                for k in 0..=10 {
                    let p = curve.point(0.1 * f64::from(k) * curve.length());
                    let off_mm = (p.x.hypot(p.y) - radius_mm).abs().max((p.z - 2.00004).abs());
                    assert!(off_mm < 0.004, "{off_mm} mm\n{text}");
                }
            }
        }
    }
}
