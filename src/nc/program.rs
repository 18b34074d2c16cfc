//! A program as text: its bytes, where its lines begin, and its dialect. Blocks are physical lines; tokens are lexed on
//! demand and tile the bytes, so the text costs its own size and four bytes a line.

use super::dialect::{Dialect, Syntax};
use super::lex::{self, Token, TokenKind};
use super::{heidenhain_lex, siemens_lex};
use crate::diag::Span;
use crate::ids::BlockId;

/// The text of a program.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    text: Vec<u8>,
    /// Where each line begins; one more entry at the end of the text.
    starts: Vec<u32>,
    dialect: Dialect,
}

/// Longest text that spans can address, bytes.
pub const MAX_TEXT: usize = u32::MAX as usize;

/// Takes the bytes of a program apart into lines; never fails. `dialect`: as the setup says, else recognised from the
/// text. Bytes beyond [`MAX_TEXT`] cannot be addressed: callers refuse such files before.
pub fn parse(bytes: Vec<u8>, dialect: Option<Dialect>) -> Program {
    let mut starts = Vec::with_capacity(bytes.len() / 24 + 2);
    starts.push(0);
    let end = bytes.len().min(MAX_TEXT);
    starts.extend(memchr::memchr_iter(b'\n', &bytes[..end]).map(|at| at as u32 + 1));
    if starts.last() != Some(&(end as u32)) {
        starts.push(end as u32);
    }
    starts.shrink_to_fit();
    let dialect = dialect.unwrap_or_else(|| Dialect::detect(&bytes));
    Program { text: bytes, starts, dialect }
}

impl Program {
    /// The bytes, exactly as they were read.
    pub fn text(&self) -> &[u8] {
        &self.text
    }
    /// Number of blocks (lines).
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }
    /// True for an empty text.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// The dialect it is read in.
    pub fn dialect(&self) -> Dialect {
        self.dialect
    }
    /// Bytes of a block, its line end included.
    pub fn span(&self, block: BlockId) -> Span {
        Span { start: self.starts[block.ix()], end: self.starts[block.ix() + 1] }
    }
    /// Physical line of a block, 1-based.
    pub fn line(&self, block: BlockId) -> u32 {
        block.0 + 1
    }
    /// Text of a block, its line end included.
    pub fn line_text(&self, block: BlockId) -> &[u8] {
        self.span(block).of(&self.text)
    }
    /// Block that holds a byte.
    pub fn block_at(&self, byte: u32) -> BlockId {
        BlockId((self.starts.partition_point(|&start| start <= byte).max(1) - 1) as u32)
    }
    /// Column of a byte in its line, 1-based.
    pub fn column(&self, byte: u32) -> u32 {
        byte - self.span(self.block_at(byte)).start + 1
    }
    /// Every block in order.
    pub fn blocks(&self) -> impl Iterator<Item = BlockId> + use<> {
        (0..self.len() as u32).map(BlockId)
    }
    /// Tokens of a block; they tile [`Program::span`].
    pub fn tokens(&self, block: BlockId) -> impl Iterator<Item = Token> + '_ {
        Tokens {
            line: self.line_text(block),
            base: self.span(block).start,
            at: 0,
            first: true,
            syntax: self.dialect.syntax(),
        }
    }
    /// Does any block hang on the block-delete switch?
    pub fn has_block_delete(&self) -> bool {
        let mut slash = memchr::memchr_iter(b'/', &self.text).map(|at| self.block_at(at as u32));
        slash.any(|block| self.tokens(block).any(|token| token.kind == TokenKind::Delete))
    }
    /// Bytes the program occupies in memory.
    pub fn memory_bytes(&self) -> usize {
        self.text.capacity() + self.starts.capacity() * size_of::<u32>()
    }
}

struct Tokens<'a> {
    line: &'a [u8],
    base: u32,
    at: usize,
    /// Nothing but blanks so far.
    first: bool,
    syntax: Syntax,
}

impl Iterator for Tokens<'_> {
    type Item = Token;

    #[inline]
    fn next(&mut self) -> Option<Token> {
        if self.at >= self.line.len() {
            return None;
        }
        let token = match self.syntax {
            Syntax::Rs274 => lex::token(self.line, self.at, self.base, self.first),
            Syntax::Siemens => siemens_lex::token(self.line, self.at, self.base, self.first),
            Syntax::Heidenhain => heidenhain_lex::token(self.line, self.at, self.base, self.first),
        };
        self.at = (token.span.end - self.base) as usize;
        self.first &= token.kind == TokenKind::Blank;
        Some(token)
    }
}
