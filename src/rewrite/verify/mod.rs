//! Proof, from two texts alone, that only feeds, split points and our own comments differ. In: the original, the rewritten
//! program, and the surroundings they are read in. Out: a [`Proof`]; it holds when it lists no difference.
//!
//! Three steps, each of which can fail by itself. *Text*: with F words and our comments taken away, every line of the
//! rewritten program is a line of the original byte for byte, a line of nothing but F, or a piece of a block. *Motion*: both
//! are interpreted; every event must be the same in the same order, and the pieces of a block must lie on its path, join,
//! and end where it ends. Feeds of threads and probes must be what they were. *Words*: an F differs only in a line that moves
//! at a feed in both, and what else the line holds is the same tokens ([`words`]). Where blocks hang on the block-delete switch,
//! motions are compared with the switch on and off.
//!
//! Where the original has loops, calls or expressions and the rewritten program has none, it is an unrolled one: the
//! original is unrolled here too, its motions are compared with those of the original ([`motion::compare_unrolled`]), and
//! the proof is made against that plain text, whose lines the differences name.

mod align;
mod motion;
mod words;

use crate::ids::BlockId;
use crate::nc::{self, Environment, Program, Toolpath, interpret, parse};
use words::Done;

/// One difference that must not be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// Block of the original.
    pub block: Option<BlockId>,
    /// The file that the lines belong to; `None`: the program's own text.
    pub file: Option<String>,
    /// Line of the original, 1-based.
    pub original_line: Option<u32>,
    /// Line of the rewritten program, 1-based.
    pub rewritten_line: Option<u32>,
    /// What differs.
    pub text: String,
    /// The line of the original and that of the rewritten program as they stand, where they are shown.
    pub texts: [Option<String>; 2],
}

/// A motion that runs faster than it did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rise {
    /// Feed as rewritten over feed as it was.
    pub ratio: f64,
    /// Feed as it was and as rewritten, mm/s.
    pub feeds_mm_s: [f64; 2],
    /// Line of the original and of the rewritten program, 1-based, counted through the program and its files.
    pub lines: [u32; 2],
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{file}, ")?;
        }
        match (self.original_line, self.rewritten_line) {
            (Some(line), Some(other)) => write!(f, "line {line} (rewritten {other}): {}", self.text),
            (Some(line), None) => write!(f, "line {line}: {}", self.text),
            (None, Some(other)) => write!(f, "rewritten line {other}: {}", self.text),
            (None, None) => f.write_str(&self.text),
        }?;
        match &self.texts {
            [Some(text), Some(other)] => write!(f, ": `{text}` → `{other}`"),
            [Some(text), None] | [None, Some(text)] => write!(f, ": `{text}`"),
            [None, None] => Ok(()),
        }
    }
}

/// What was found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Proof {
    /// What differs besides feeds, split points and our comments: the first [`ENOUGH`].
    pub differences: Vec<Difference>,
    /// How many more differ.
    pub more: usize,
    /// Motions that run faster than they did, in order.
    pub rises: Vec<Rise>,
    /// Motions compared.
    pub motions: usize,
    /// Motions of the original that run at another feed now (one cut into pieces counts once).
    pub feeds_changed: usize,
    /// Lines added.
    pub blocks_added: usize,
    /// Blocks cut into pieces.
    pub blocks_split: usize,
    /// Lines of the original that move the tool, that are executed otherwise, and that are never reached (compared as text
    /// alone).
    pub lines: [usize; 3],
    /// The original was unrolled first.
    pub unrolled: bool,
    /// The original is written in inches.
    pub inch: bool,
}

impl Proof {
    /// True when only feeds, split points and our comments differ.
    pub fn holds(&self) -> bool {
        self.differences.is_empty()
    }
    /// The largest rise of a feed; the first of several.
    pub fn largest_rise(&self) -> Option<&Rise> {
        self.rises.iter().reduce(|most, rise| if rise.ratio > most.ratio { rise } else { most })
    }
    fn differ(&mut self, original_line: Option<u32>, rewritten_line: Option<u32>, text: impl Into<String>) {
        if self.differences.len() >= ENOUGH {
            self.more += 1;
            return;
        }
        let block = original_line.map(|line| BlockId(line - 1));
        let texts = [None, None];
        self.differences.push(Difference {
            block,
            file: None,
            original_line,
            rewritten_line,
            text: text.into(),
            texts,
        });
    }
    /// Puts the lines in as they stand.
    fn quote(&mut self, original: &Program, rewritten: &Program) {
        for difference in &mut self.differences {
            let line = |program: &Program, line: Option<u32>| {
                let block = BlockId(line?.checked_sub(1)?);
                (block.ix() < program.len())
                    .then(|| String::from_utf8_lossy(program.line_text(block)).trim().to_owned())
            };
            let (own, other) = (line(original, difference.original_line), line(rewritten, difference.rewritten_line));
            let from = shared(own.as_deref().unwrap_or_default(), other.as_deref().unwrap_or_default());
            difference.texts = [own, other].map(|text| text.map(|text| clipped(&text, from)));
        }
    }
    /// Lines that were counted through all texts become those of the file they stand in.
    fn name_files(&mut self, original: &Program, rewritten: &Program) {
        for difference in &mut self.differences {
            for (program, line) in
                [(original, &mut difference.original_line), (rewritten, &mut difference.rewritten_line)]
            {
                let Some(through) = line.filter(|_| !program.files().is_empty()) else { continue };
                let (own, file) = program.place(BlockId(through - 1));
                *line = Some(own);
                difference.file = file.map(str::to_owned);
            }
        }
    }
}

/// Differences that are kept with their place; further ones are only counted.
pub const ENOUGH: usize = 100;
/// Characters of a line that are shown.
const SHOWN: usize = 40;

/// Characters at their beginning that two lines share.
fn shared(a: &str, b: &str) -> usize {
    a.chars().zip(b.chars()).take_while(|(a, b)| a == b).count()
}

/// A line as it is shown: a long one from a little before the place where it differs.
fn clipped(text: &str, differs_at: usize) -> String {
    let length = text.chars().count();
    if length <= SHOWN {
        return text.to_owned();
    }
    let from = differs_at.saturating_sub(SHOWN / 4).min(length - SHOWN);
    let inside: String = text.chars().skip(from).take(SHOWN).collect();
    format!("{}{inside}{}", if from > 0 { "…" } else { "" }, if from + SHOWN < length { "…" } else { "" })
}

/// Compares the two; see the head of the file. The rewritten program is read in the dialect of the original. Files linked
/// to the programs ([`nc::linked`]) are compared like their own texts; others are the same for both.
pub fn verify(original: &Program, rewritten: &Program, environment: &Environment<'_>) -> Proof {
    if rewritten.dialect() != original.dialect() {
        let same = parse(rewritten.own_text().to_vec(), Some(original.dialect()));
        return verify(original, &same, environment);
    }
    if nc::steers(original, environment) && !nc::steers(rewritten, environment) {
        return verify_unrolled(original, rewritten, environment);
    }
    prove(original, rewritten, environment)
}

fn verify_unrolled(original: &Program, rewritten: &Program, environment: &Environment<'_>) -> Proof {
    let mut proof = Proof { unrolled: true, ..Proof::default() };
    let expanded = nc::unroll(original, environment);
    let plain = parse(expanded.text, Some(original.dialect()));
    for obstacle in expanded.obstacles {
        proof.differ(obstacle.line, None, format!("the original cannot be unrolled: {}", obstacle.text));
    }
    each_switch(original, environment, |environment| {
        motion::compare_unrolled(&interpret(original, environment), &interpret(&plain, environment), &mut proof);
    });
    if proof.holds() { Proof { unrolled: true, ..prove(&plain, rewritten, environment) } } else { proof }
}

fn prove(original: &Program, rewritten: &Program, environment: &Environment<'_>) -> Proof {
    let mut proof = Proof::default();
    let read = |block_delete| {
        let environment = Environment { block_delete, ..environment.clone() };
        let read = |program| interpret(program, &environment);
        <[Toolpath; 2]>::from(rayon::join(|| read(original), || read(rewritten)))
    };
    let (roles, off) = rayon::join(|| align::align(original, rewritten, environment.inch, &mut proof), || read(false));
    if proof.holds() {
        let mut done = [original, rewritten].map(|program| Done::new(program.len()));
        let mut compare = |both: &[Toolpath; 2], proof: &mut Proof| {
            motion::compare(both, &roles, proof);
            done.iter_mut().zip(both).for_each(|(done, toolpath)| done.add(toolpath));
        };
        compare(&off, &mut proof);
        if original.has_block_delete() {
            compare(&read(true), &mut proof);
        }
        words::check(original, rewritten, &roles, &done, &mut proof);
        proof.lines = done[0].lines();
    }
    proof.inch = off[0].inch;
    proof.quote(original, rewritten);
    proof.name_files(original, rewritten);
    proof
}

/// With the block-delete switch off, and on where a block hangs on it.
fn each_switch(original: &Program, environment: &Environment<'_>, mut with: impl FnMut(&Environment<'_>)) {
    let switches: &[bool] = if original.has_block_delete() { &[false, true] } else { &[false] };
    for &block_delete in switches {
        with(&Environment { block_delete, ..environment.clone() });
    }
}
