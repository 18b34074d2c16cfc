//! The unit of a program with neither G20 nor G21. In: the program, the extent of its coordinates, and the setup. Out: inch or mm, the
//! reasons, and whether they agree.
//!
//! The control then uses a setting of its own that the text does not show. An inch program read in mm is 25.4 times too small, and so are its
//! chips, so each sign compares the two readings with what can be machined at all:
//!
//! * the blank: read in inches the program reaches twice beyond it, or read in mm it hardly scratches it;
//! * the feed per revolution: below 0.004 mm no edge cuts (edge radii are 5 to 10 µm, and a third of one is the least chip),
//!   above 2 mm no end mill lives;
//! * sizes: 130 inches are more than the longest routers have (3 m), F600 in inches is 15 m/min;
//! * decimals: posts write four in inches and three in mm (increments of 0.0001 in and 0.001 mm);
//! * the retract: 1 mm above the part is too near for a rapid, 3 inches are far;
//! * the unit that the setup is written in.

use super::environment::Environment;
use super::interpret::interpret;
use super::number::decimal;
use super::program::Program;
use super::token::TokenKind;
use super::toolpath::{MoveKind, Toolpath};
use crate::machine::{Job, StockShape};
use crate::path::Vec3;
use crate::units::{MM_PER_INCH, mm_min_from_mm_s};

/// What was concluded.
#[derive(Debug, Clone, PartialEq)]
pub struct Inferred {
    /// Inches?
    pub inch: bool,
    /// Do the signs agree well enough to raise a feed on it?
    pub sure: bool,
    /// The signs that speak for it, in words.
    pub why: Vec<&'static str>,
}

/// What the setup tells about the unit of the program.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Witness {
    /// Extent of the blank, mm.
    pub blank_mm: Option<Vec3>,
    /// Is the setup written in inches? `None`: there is no setup.
    pub inch: Option<bool>,
}

impl Witness {
    /// Takes it from a setup.
    pub fn of(job: &Job) -> Self {
        let blank_mm = match job.stocks.as_slice() {
            [only] => match &only.shape {
                StockShape::Box(of) => Some(of.max - of.min),
                StockShape::Cylinder { diameter_mm, z_mm, .. } => {
                    Some(Vec3::new(*diameter_mm, *diameter_mm, z_mm[1] - z_mm[0]))
                }
                StockShape::Stl(_) | StockShape::Saved(_) => None,
            },
            _ => None,
        };
        Self { blank_mm, inch: Some(job.inch) }
    }
}

/// Lead of one reading over the other from which it is sure: two signs more, or the blank alone.
const SURE: i32 = 2;
/// A program reaches no further than this many times its blank (0.7 to 1.5 times in practice). A program that stays within this in inches
/// covers at most 8 % of the blank in mm.
const BEYOND: f64 = 2.0;
/// Feeds per revolution at which an end mill cuts, mm.
const PER_REV_MM: [f64; 2] = [0.004, 2.0];
/// Coordinates that no machine has in inches.
const LONGEST_INCH: f64 = 130.0;
/// Feeds that no machine cuts with in inches a minute.
const FASTEST_INCH: f64 = 600.0;
/// Retracts that are too near in mm, and far in inches.
const RETRACT: [f64; 2] = [1.0, 3.0];

/// The unit of the program, if it does not say it itself; plain language always does.
pub fn infer(program: &Program, environment: &Environment<'_>, witness: Witness) -> Option<Inferred> {
    if says(program) {
        return None;
    }
    let path = interpret(program, &Environment { inch: false, ..environment.clone() });
    let seen = Seen::of(program, &path)?;
    let mut signs = seen.signs();
    signs.extend(witness.blank_mm.and_then(|blank| seen.against(blank)));
    signs.extend(witness.inch.map(|inch| Sign { inch, weight: 1, what: "the setup is in that unit" }));
    let weight = |inch: bool| signs.iter().filter(|sign| sign.inch == inch).map(|sign| sign.weight).sum::<i32>();
    let inch = weight(true) > weight(false);
    let why = signs.iter().filter(|sign| sign.inch == inch).map(|sign| sign.what).collect();
    Some(Inferred { inch, sure: (weight(true) - weight(false)).abs() >= SURE, why })
}

/// The surroundings with the unit of this program, as the setup tells it or its numbers do.
pub fn with_its_unit<'a>(program: &Program, environment: Environment<'a>, job: Option<&Job>) -> Environment<'a> {
    if job.is_some_and(|job| job.machine.unsaid.inch.is_some()) {
        return environment;
    }
    let found = infer(program, &environment, job.map(Witness::of).unwrap_or_default());
    Environment { inch: found.map_or(environment.inch, |found| found.inch), ..environment }
}

/// Is there a word for the unit anywhere in it?
fn says(program: &Program) -> bool {
    let unit = |number: f64| [20.0, 21.0, 70.0, 71.0, 700.0, 710.0].contains(&number);
    let plain = program.dialect().syntax() == super::dialect::Syntax::Heidenhain;
    plain
        || program
            .blocks()
            .any(|block| program.tokens(block).any(|t| t.kind == TokenKind::Word(b'G') && unit(t.number)))
}

struct Sign {
    inch: bool,
    weight: i32,
    what: &'static str,
}

/// What the program does, in its own numbers.
struct Seen {
    low: Vec3,
    high: Vec3,
    highest: f64,
    fastest: f64,
    /// Least and largest feed per revolution of a cut, in units of the program.
    per_rev: Option<[f64; 2]>,
    /// Most digits behind the point of a coordinate.
    decimals: usize,
}

impl Seen {
    fn of(program: &Program, path: &Toolpath) -> Option<Self> {
        let feeds = || path.moves.iter().filter(|motion| motion.kind == MoveKind::Feed);
        let bounds = feeds().map(|motion| motion.curve().bounds());
        let (low, high) = bounds.reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))?;
        let per_rev = feeds().filter(|motion| motion.spin.rps > 0.0 && motion.feed.mm_s > 0.0);
        let per_rev = per_rev.map(|motion| motion.feed.mm_s / motion.spin.rps).map(|each| [each, each]);
        Some(Self {
            low,
            high,
            highest: path.moves.iter().map(|motion| motion.curve().to().z).fold(f64::NEG_INFINITY, f64::max),
            fastest: feeds().map(|motion| mm_min_from_mm_s(motion.feed.mm_s)).fold(0.0, f64::max),
            per_rev: per_rev.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]),
            decimals: decimals(program),
        })
    }

    /// What the numbers say by themselves.
    fn signs(&self) -> Vec<Sign> {
        let mut signs = Vec::new();
        let mut say = |inch: bool, weight: i32, what: &'static str| signs.push(Sign { inch, weight, what });
        if let Some([least, most]) = self.per_rev {
            if least < PER_REV_MM[0] {
                say(true, 2, "in mm its feed per revolution would be too small to cut");
            } else if most * MM_PER_INCH > PER_REV_MM[1] {
                say(false, 2, "in inches its feed per revolution would be too large for any mill");
            }
        }
        if self.low.amin().abs().max(self.high.amax()).max(self.low.amax()) > LONGEST_INCH {
            say(false, 2, "in inches it would be longer than any machine");
        }
        if self.fastest > FASTEST_INCH {
            say(false, 2, "in inches its feed would be faster than any machine");
        }
        match self.decimals {
            4 => say(true, 1, "its coordinates have four decimals"),
            ..=3 => say(false, 1, "its coordinates have at most three decimals"),
            _ => {}
        }
        if self.highest <= RETRACT[0] {
            say(true, 1, "in mm it would retract by 1 mm at most");
        } else if self.highest >= RETRACT[1] {
            say(false, 1, "in inches it would retract by 3 inches and more");
        }
        signs
    }

    /// What the blank of the setup says.
    fn against(&self, blank_mm: Vec3) -> Option<Sign> {
        let across = |axis: usize| (self.high[axis] - self.low[axis]) / blank_mm[axis];
        let widest = across(0).max(across(1));
        if widest * MM_PER_INCH > BEYOND {
            return Some(Sign { inch: false, weight: 2, what: "in inches it would reach far beyond the blank" });
        }
        let fits = -self.low.z * MM_PER_INCH <= BEYOND * blank_mm.z;
        fits.then_some(Sign { inch: true, weight: 2, what: "in mm it would reach over a corner of the blank only" })
    }
}

/// Most digits behind the point of the first coordinates.
fn decimals(program: &Program) -> usize {
    let coordinates = program.blocks().take(4000).flat_map(|block| program.tokens(block));
    let number = coordinates.filter_map(|token| match token.kind {
        TokenKind::Word(b'X' | b'Y' | b'Z' | b'I' | b'J') => token.span.of(program.text()).get(1..),
        _ => None,
    });
    let digits = |bytes: &[u8]| {
        let from = bytes.iter().position(|byte| byte.is_ascii_digit() || b"+-.".contains(byte)).unwrap_or(bytes.len());
        let length = decimal(&bytes[from..]).map_or(0, |(_, length)| length);
        let text = &bytes[from..from + length];
        text.iter().position(|byte| *byte == b'.').map_or(0, |point| text.len() - point - 1)
    };
    number.map(digits).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nc::parse;

    fn of(text: &str, witness: Witness) -> Option<Inferred> {
        infer(&parse(text.into(), None), &Environment::default(), witness)
    }

    const INCH: &str = "%\nO1\nT1 M6\nS3000 M3\nG0 X1.125 Y-.25 Z.1\nG1 Z-.05 F8.\nX2.3125 F12.\nG0 Z1.\nM30\n%\n";
    const METRIC: &str = "T1 M6\nS8000 M3\nG0 X-10 Y5 Z5\nG1 Z-2 F300\nX110 F600\nG0 Z25\nM30\n";

    #[test]
    fn a_program_that_says_its_unit_is_believed() {
        for text in [format!("G20\n{METRIC}"), format!("G21\n{INCH}"), "0 BEGIN PGM A INCH\n1 L X+1 F9\n".into()] {
            assert_eq!(of(&text, Witness::default()), None, "{text}");
        }
    }

    #[test]
    fn numbers_and_the_blank_tell_the_unit() {
        let blank = |x: f64, y: f64, z: f64| Witness { blank_mm: Some(Vec3::new(x, y, z)), inch: Some(false) };
        for (text, witness, inch) in [
            (INCH, Witness::default(), true),
            (INCH, blank(70.0, 30.0, 20.0), true),
            (METRIC, Witness::default(), false),
            (METRIC, blank(120.0, 40.0, 10.0), false),
        ] {
            let found = of(text, witness).unwrap();
            assert!(found.inch == inch && found.sure, "{text}{witness:?}: {found:?}");
        }
        // A small engraving in the corner of a large plate, in mm.
        let small = "S20000 M3\nG0 X2 Y2 Z3\nG1 Z-0.1 F150\nX7.5 F400\nY7.5\nG0 Z3\nM30\n";
        let found = of(small, blank(100.0, 100.0, 5.0)).unwrap();
        assert!(!found.inch, "{found:?}");
    }

    #[test]
    fn signs_against_each_other_are_not_sure() {
        // Four decimals and a near retract, but a metric feed and a metric setup.
        let text = "S9000 M3\nG0 X0.5 Y0.25 Z0.5\nG1 Z-0.125 F400\nX1.7525\nG0 Z0.5\nM30\n";
        let found = of(text, Witness { blank_mm: None, inch: Some(false) }).unwrap();
        assert!(!found.sure, "{found:?}");
    }

    #[test]
    fn each_threshold_has_two_sides() {
        let per_rev = |f: f64| of(&format!("S1000 M3\nG1 X10.00000 F{f}\nG0 Z2\n"), Witness::default()).unwrap();
        assert!(per_rev(3.9).inch && !per_rev(4.1).inch, "0.004 mm a turn");
        assert!(!per_rev(78.0).sure && per_rev(79.0).sure, "2 mm a turn");
        let long = |x: f64| of(&format!("G1 X{x}.00000 F100\nG0 Z2\n"), Witness::default()).unwrap().sure;
        assert!(!long(130.0) && long(131.0));
        let fast = |f: u32| of(&format!("G1 X9.00000 F{f}\nG0 Z2\n"), Witness::default()).unwrap().sure;
        assert!(!fast(600) && fast(601));
        let on = |x: f64, z: f64| {
            let witness = Witness { blank_mm: Some(Vec3::new(x, x, z)), inch: None };
            of("G1 X10.00000 Z-1. F100\nG0 Z2\n", witness).unwrap().inch
        };
        assert!(on(127.5, 20.0) && !on(126.5, 20.0), "twice the blank across");
        assert!(on(200.0, 13.0) && !on(200.0, 12.5), "twice the blank deep");
    }

    /// Signs of weight 1, each on the side of a setup in the same unit, so that it is listed when it is there.
    #[test]
    fn each_sign_that_only_helps_has_two_sides() {
        let says = |text: &str, inch: bool, sign: &str| {
            let found = of(text, Witness { blank_mm: None, inch: Some(inch) }).unwrap();
            found.inch == inch && found.why.iter().any(|why| why.contains(sign))
        };
        let up_to = |z: &str| format!("G1 X10.00000 F100\nG0 Z{z}\n");
        assert!(says(&up_to("1"), true, "retract by 1 mm") && !says(&up_to("1.001"), true, "retract by 1 mm"));
        assert!(
            says(&up_to("3"), false, "retract by 3 inches") && !says(&up_to("2.999"), false, "retract by 3 inches")
        );
        let at = |x: &str| format!("G1 X{x} F100\nG0 Z2\n");
        assert!(says(&at("9.123"), false, "three decimals") && !says(&at("9.1234"), false, "three decimals"));
        assert!(says(&at("9.1234"), true, "four decimals") && !says(&at("9.12345"), true, "four decimals"));
    }

    #[test]
    fn a_lead_of_two_is_sure_and_of_one_is_not() {
        let with =
            |x: &str| of(&format!("G1 X{x} F100\nG0 Z2\n"), Witness { blank_mm: None, inch: Some(false) }).unwrap();
        assert!(with("9.123").sure, "the setup and the decimals");
        assert!(!with("9.12345").sure, "the setup alone");
        let against = of("G1 X9.1234 F100\nG0 Z2\n", Witness { blank_mm: None, inch: Some(false) }).unwrap();
        assert!(!against.sure, "one against one");
    }
}
