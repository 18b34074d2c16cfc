//! The result of the proof. In: filled by the three parts. Out: [`Proof`]: differences with their lines, motions that run faster, counts of what
//! was compared.

use crate::ids::BlockId;
use crate::nc::Program;

/// One difference that is not allowed.
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

/// The result of comparing two programs.
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
    pub(super) fn differ(&mut self, original_line: Option<u32>, rewritten_line: Option<u32>, text: impl Into<String>) {
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
    pub(super) fn quote(&mut self, original: &Program, rewritten: &Program) {
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
    pub(super) fn name_files(&mut self, original: &Program, rewritten: &Program) {
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
