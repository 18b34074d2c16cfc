//! The program as text. In: motions of the tip in mm, dialect, unit. Out: text.
//!
//! Nothing is written that a control could read in two ways: plane, unit, absolute positions, feed per minute and work offset are
//! said at the head, every motion says its kind, a coordinate stands where it changes.

use super::path::Step;
use crate::nc::{CommentForm, Dialect, Syntax};
use crate::path::Vec3;
use crate::units::{MM_PER_INCH, mm_min_from_mm_s, rpm_from_rps};
use std::fmt::Write;

/// First words of the comment at the head: a file that has it was written here.
pub const MARK: &str = "PASSES OF VARYING STEP-OVER BY FEEDWRIGHT";

/// What the head says.
#[derive(Debug, Clone, PartialEq)]
pub struct Head {
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

/// The program.
pub fn program(head: &Head, steps: &[Step]) -> String {
    let mut writer = Writer { head, text: String::new(), lines: 0, at: [const { None }; 3], feed: None, kind: None };
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
    /// Coordinates as they were last written.
    at: [Option<String>; 3],
    feed: Option<String>,
    kind: Option<bool>,
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
        let Head { dialect, inch, tool, rps, notes } = self.head;
        let rpm = number(rpm_from_rps(*rps), 0);
        match dialect.syntax() {
            Syntax::Heidenhain => self.say(&format!("BEGIN PGM STEPOVER {}", if *inch { "INCH" } else { "MM" })),
            Syntax::Rs274 if matches!(dialect, Dialect::Fanuc | Dialect::Haas) => {
                self.say("%");
                self.say("O0022");
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
            // Nobody knows where the tool stands at first: up, then over.
            let height = self.coordinate(&step.to, 2);
            let sign = if self.plain() && !height.starts_with('-') { "+" } else { "" };
            let (before, after) = if self.plain() { ("L", " R0 FMAX") } else { ("G0", "") };
            self.say(&format!("{before} Z{sign}{height}{after}"));
            self.at[2] = Some(height);
        }
        let words = self.place(&step.to);
        let rapid = step.feed_mm_s.is_none();
        let mut line = String::new();
        let mut feed = String::new();
        if let Some(f) = step.feed_mm_s {
            let per_unit = if self.head.inch { MM_PER_INCH } else { 1.0 };
            let value = number(mm_min_from_mm_s(f) / per_unit, usize::from(self.head.inch));
            if self.feed.as_deref() != Some(&value) {
                feed = format!(" F{value}");
                self.feed = Some(value);
            }
        }
        if self.plain() {
            line.push('L');
            line.push_str(&words);
            line.push_str(if rapid { " R0 FMAX" } else { &feed });
        } else {
            if self.kind != Some(rapid) {
                line.push_str(if rapid { "G0" } else { "G1" });
                self.kind = Some(rapid);
            }
            line.push_str(&words);
            line.push_str(&feed);
        }
        self.say(line.trim_start());
    }

    /// A coordinate in the unit of the program.
    fn coordinate(&self, to: &Vec3, axis: usize) -> String {
        let (value, digits) = if self.head.inch { (to[axis] / MM_PER_INCH, 4) } else { (to[axis], 3) };
        number(value, digits)
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
            // A block without a word would be none: say where it stays.
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
            self.say("M5");
            self.say("M30");
        }
        if matches!(self.head.dialect, Dialect::Fanuc | Dialect::Haas) {
            self.say("%");
        }
    }
}

/// A number with a point, so that no control takes it for increments.
fn number(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    if digits == 0 {
        return text;
    }
    let text = text.trim_end_matches('0');
    if text == "-0." { "0.".into() } else { text.into() }
}
