//! Where a program can be entered: O numbers, N numbers, O-word lines and labels, found once when first needed.

use std::collections::BTreeMap;

use super::siemens_flow::{STRUCTURES, structure_word};
use crate::ids::BlockId;
use crate::nc::dialect::Dialect;
use crate::nc::lex::{Token, TokenKind};
use crate::nc::program::Program;

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
    /// Blocks of each N number, in order.
    pub n_blocks: BTreeMap<u32, Vec<u32>>,
    /// `END m` and `WHILE … DO m` of Macro B: block, m, true for END.
    pub loops: Vec<(u32, u32, bool)>,
    /// Structures of Siemens: block, and +1 where one begins, −1 where it ends, 0 for ELSE.
    structures: Vec<(u32, i8)>,
    /// Named labels (`NAME:` of Siemens, `LBL 1` of Heidenhain) in upper case, and their blocks.
    pub names: Vec<(String, u32)>,
}

impl Labels {
    /// Reads a program through.
    pub fn of(program: &Program) -> Self {
        let mut labels = Labels::default();
        for block in program.blocks().take(program.own_len()) {
            labels.read(program, block);
        }
        labels
    }

    fn read(&mut self, program: &Program, block: BlockId) {
        let text = program.text();
        if program.dialect() == Dialect::Siemens {
            self.read_structure(program, block);
        }
        let mut name = String::new();
        let mut called = false;
        for token in program.tokens(block) {
            match token.kind {
                TokenKind::Word(b'N') => self.n_blocks.entry(token.number as u32).or_default().push(block.0),
                TokenKind::Percent if program.dialect() == Dialect::Siemens => {
                    if let Some(label) = archived(token.span.of(text)) {
                        self.o_lines.push(OLine { block: block.0, label, keyword: String::new() });
                    }
                }
                TokenKind::Word(b'O') | TokenKind::Routine => {
                    let label = label_of(token.kind, token.number, token.span.of(text));
                    self.o_lines.push(OLine { block: block.0, label, keyword: String::new() });
                }
                TokenKind::Name => {
                    called |= name == "CALL" || name == "GOTO";
                    name = String::from_utf8_lossy(token.span.of(text)).to_ascii_uppercase();
                    if let Some(line) = self.o_lines.last_mut().filter(|line| line.block == block.0)
                        && line.keyword.is_empty()
                    {
                        line.keyword.clone_from(&name);
                    }
                }
                TokenKind::Label => {
                    let label = String::from_utf8_lossy(token.span.of(text)).to_ascii_uppercase();
                    self.names.push((label.trim_end_matches(':').trim().to_owned(), block.0));
                }
                TokenKind::Expression if name == "LBL" && !called => {
                    self.names.push((plain_label(&token, text), block.0));
                }
                TokenKind::Expression if name == "DO" || name == "END" => {
                    let number = crate::nc::decimal(token.span.of(text)).map_or(0, |(value, _)| value as u32);
                    self.loops.push((block.0, number, name == "END"));
                }
                _ => {}
            }
        }
    }

    fn read_structure(&mut self, program: &Program, block: BlockId) {
        let code =
            |kind| !matches!(kind, TokenKind::Blank | TokenKind::LineEnd | TokenKind::Comment | TokenKind::Label);
        let mut tokens: Vec<Token> = program.tokens(block).filter(|token| code(token.kind)).collect();
        tokens.retain(|token| token.kind != TokenKind::Word(b'N'));
        let Some(word) = structure_word(&tokens, program.text()) else { return };
        let opens = STRUCTURES.iter().any(|(open, _)| *open == word);
        let closes = STRUCTURES.iter().any(|(_, close)| *close == word);
        self.structures.push((block.0, i8::from(opens) - i8::from(closes)));
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
        self.o_lines.iter().rev().find(|o| o.block <= block && o.keyword.is_empty()).map_or(0, |o| o.block + 1)
    }
    /// Block with this N number: after `block` in its program, else from the beginning of that program.
    pub fn numbered(&self, number: u32, block: u32) -> Option<u32> {
        let blocks = self.n_blocks.get(&number)?;
        let program = self.start_of_program(block);
        let here = blocks.iter().filter(|&&b| self.start_of_program(b) == program);
        here.clone().find(|&&b| b > block).or(here.clone().next()).or(blocks.first()).copied()
    }
}

impl OLine {
    fn is(&self, label: &str, keywords: &[&str]) -> bool {
        self.label == label && keywords.contains(&self.keyword.as_str())
    }
}

/// Name of the program that `%_N_NAME_MPF` or `%_N_NAME_SPF` begins, lower case.
pub fn archived(line: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(line).trim().to_ascii_lowercase();
    let name = text.strip_prefix("%_n_")?;
    Some(name.strip_suffix("_mpf").or(name.strip_suffix("_spf")).unwrap_or(name).to_owned())
}

/// `LBL 1` or `LBL "NAME"` of plain language.
pub fn plain_label(token: &Token, text: &[u8]) -> String {
    let bytes = token.span.of(text);
    if bytes.starts_with(b"\"") {
        return format!("LBL {}", String::from_utf8_lossy(bytes).to_ascii_uppercase());
    }
    format!("LBL {}", token.number as u32)
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
