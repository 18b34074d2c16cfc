//! Targets of jumps and calls. In: a program text, read through once when first needed. Out: the blocks of its O numbers, N numbers, O-word
//! lines and labels.

use std::collections::BTreeMap;

use crate::ids::BlockId;
use crate::nc::program::Program;
use crate::nc::token::TokenKind;

/// Where a block may send the control.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Way {
    /// To a block of the same text, for good or for a time.
    Block(u32),
    /// To a routine of this name, lower case, and back.
    Routine(String),
    /// To a routine of a computed name, and back.
    AnyRoutine,
    /// To any block of what called the routine it belongs to.
    Caller,
}

/// One O-word line: `o100 while […]`.
#[derive(Debug, Clone, PartialEq)]
pub struct OLine {
    /// Block it is.
    pub block: u32,
    /// Its number or name as written, lower case.
    pub label: String,
    /// Its keyword, upper case; empty for a bare `O1000`.
    pub keyword: String,
}

/// Index of the places of one program text.
#[derive(Debug, Clone, Default)]
pub struct Labels {
    /// O-word lines in order.
    pub o_lines: Vec<OLine>,
    /// First block of each program of the text: behind its O word or `%_N_…` line.
    pub programs: Vec<u32>,
    /// Blocks of each N number, in order.
    pub n_blocks: BTreeMap<u32, Vec<u32>>,
    /// `END m` and `WHILE … DO m` of Macro B: block, m, true for END.
    pub loops: Vec<(u32, u32, bool)>,
    /// Structures of Siemens: block, and +1 where one begins, −1 where it ends, 0 for ELSE.
    pub structures: Vec<(u32, i8)>,
    /// Named labels (`NAME:` of Siemens, `LBL 1` of Heidenhain) in upper case, and their blocks.
    pub names: Vec<(String, u32)>,
}

impl Labels {
    /// Reads a program through: its N and O words; `family` takes in what only its dialects have.
    pub fn of(program: &Program, family: fn(&mut Labels, &Program, BlockId)) -> Self {
        let mut labels = Labels::default();
        for block in program.blocks().take(program.own_len()) {
            labels.read(program, block);
            family(&mut labels, program, block);
        }
        labels.programs = labels.o_lines.iter().filter(|o| o.keyword.is_empty()).map(|o| o.block + 1).collect();
        labels
    }

    fn read(&mut self, program: &Program, block: BlockId) {
        let text = program.text();
        for token in program.tokens(block) {
            match token.kind {
                TokenKind::Word(b'N') => self.n_blocks.entry(token.number as u32).or_default().push(block.0),
                TokenKind::Word(b'O') | TokenKind::Routine => {
                    let label = label_of(token.kind, token.number, token.span.of(text));
                    self.o_lines.push(OLine { block: block.0, label, keyword: String::new() });
                }
                TokenKind::Name => {
                    if let Some(line) = self.o_lines.last_mut().filter(|line| line.block == block.0)
                        && line.keyword.is_empty()
                    {
                        line.keyword = String::from_utf8_lossy(token.span.of(text)).to_ascii_uppercase();
                    }
                }
                _ => {}
            }
        }
    }

    /// The other end of the structure that this block begins (`forward`; or its ELSE) or ends.
    pub fn partner(&self, block: u32, forward: bool, to_else: bool) -> Option<u32> {
        let (enter, mut depth) = (if forward { 1 } else { -1 }, 0);
        let mut meets = |&&(_, kind): &&(u32, i8)| {
            let found = depth == 0 && (kind == -enter || kind == 0 && to_else);
            depth += i32::from(kind) * i32::from(enter);
            found
        };
        let at = self.structures.partition_point(|(known, _)| *known < block);
        let found = if forward {
            self.structures.get(at + 1..)?.iter().find(&mut meets)
        } else {
            self.structures[..at].iter().rev().find(&mut meets)
        };
        found.map(|(block, _)| *block)
    }
    /// First O-word line after `block` with this label and one of these keywords.
    pub fn after(&self, block: u32, label: &str, keywords: &[&str]) -> Option<&OLine> {
        self.o_lines.iter().find(|line| line.block > block && line.is(label, keywords))
    }
    /// Last O-word line before `block` with this label and one of these keywords.
    pub fn before(&self, block: u32, label: &str, keywords: &[&str]) -> Option<&OLine> {
        self.o_lines.iter().rev().find(|line| line.block < block && line.is(label, keywords))
    }
    /// The line that defines a routine or begins a program.
    pub fn routine(&self, label: &str) -> Option<&OLine> {
        let label = label.to_ascii_lowercase();
        let sub = self.o_lines.iter().find(|line| line.is(&label, &["SUB"]));
        sub.or_else(|| self.o_lines.iter().find(|line| line.is(&label, &[""])))
    }
    /// First block of the program of this text that a block belongs to: behind its O word or `%_N_…` line.
    pub fn start_of_program(&self, block: u32) -> u32 {
        // The O word itself belongs to it too.
        let next = self.programs.partition_point(|begin| *begin <= block + 1);
        if next == 0 { 0 } else { self.programs[next - 1] }
    }
    /// Block with this N number: after `block` in its program, else from the beginning of that program.
    pub fn numbered(&self, number: u32, block: u32) -> Option<u32> {
        let blocks = self.n_blocks.get(&number)?;
        let program = self.start_of_program(block);
        let next = self.programs.get(self.programs.partition_point(|begin| *begin <= program)).copied();
        let before = |limit: u32| blocks.partition_point(|b| *b < limit);
        let here = &blocks[before(program.saturating_sub(1))..next.map_or(blocks.len(), |next| before(next - 1))];
        here.get(here.partition_point(|b| *b <= block)).or(here.first()).or(blocks.first()).copied()
    }
}

impl OLine {
    fn is(&self, label: &str, keywords: &[&str]) -> bool {
        self.label == label && keywords.contains(&self.keyword.as_str())
    }
}

/// A label in one spelling: numbers without leading zeros, names in lower case.
pub fn label_of(kind: TokenKind, number: f64, text: &[u8]) -> String {
    if kind == TokenKind::Routine {
        let name = String::from_utf8_lossy(&text[1..]).to_ascii_lowercase();
        name.trim().trim_start_matches('<').trim_end_matches('>').trim().to_owned()
    } else {
        format!("{}", number as u64)
    }
}
