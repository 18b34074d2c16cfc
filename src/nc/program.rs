//! A program as text. In: its bytes. Out: [`Program`]: the bytes, where lines begin, and the dialect. Blocks are physical lines; tokens are
//! lexed on demand and tile the bytes, so a program takes its own size and four bytes a line.
//!
//! A *linked* program holds the text of the files that it calls after its own, in the order of their first calls. Blocks and bytes are
//! numbered through all of them, so whatever handles blocks handles those of the files too.

use std::ops::Range;
use std::sync::Arc;

use super::dialect::{Dialect, Syntax};
use super::heidenhain::lex as heidenhain_lex;
use super::recognise::{Recognised, recognise};
use super::rs274::lex as rs274_lex;
use super::siemens::lex as siemens_lex;
use super::token::{Token, TokenKind};
use crate::diag::Span;
use crate::ids::BlockId;

/// The text of a program.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    text: Vec<u8>,
    /// Where each line begins; one more entry at the end of the text.
    starts: Vec<u32>,
    dialect: Dialect,
    /// What it was recognised as; `None`: the dialect was given.
    recognised: Option<Recognised>,
    /// Blocks of its own text; those of `files` follow.
    own: u32,
    files: Vec<File>,
}

/// A file that a program calls.
#[derive(Debug, Clone, PartialEq)]
pub struct File {
    /// Its name, without a folder.
    pub name: String,
    /// Its text.
    pub program: Arc<Program>,
}

/// The program's own text, or one of its files.
#[derive(Debug, Clone, PartialEq)]
pub struct Part<'a> {
    /// Name of the file; `None`: the program itself.
    pub name: Option<&'a str>,
    /// Its blocks.
    pub blocks: Range<u32>,
    /// Its bytes.
    pub span: Span,
}

impl Part<'_> {
    /// Every block of it in order.
    pub fn blocks(&self) -> impl Iterator<Item = BlockId> + use<> {
        self.blocks.clone().map(BlockId)
    }
}

/// Most lines of one block of plain language that are searched backwards; the longest cycles have about forty.
const MOST_CONTINUED: usize = 200;

/// Some editors put these bytes before UTF-8 text. They are kept and have no meaning.
pub const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

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
    let recognised = dialect.is_none().then(|| recognise(&bytes));
    let dialect = dialect.or(recognised.as_ref().map(|found| found.control.dialect())).unwrap_or(Dialect::Generic);
    let own = starts.len() as u32 - 1;
    Program { text: bytes, starts, dialect, recognised, own, files: Vec::new() }
}

impl Program {
    /// The program together with the files it calls, in this order; without them where the bytes of all could not be
    /// addressed.
    pub fn with_files(&self, files: Vec<File>) -> Program {
        let length = files.iter().map(|file| file.program.text.len()).sum::<usize>() + self.own_text().len();
        let mut linked = Program {
            text: self.own_text().to_vec(),
            starts: self.starts[..=self.own as usize].to_vec(),
            dialect: self.dialect,
            recognised: self.recognised.clone(),
            own: self.own,
            files: if length <= MAX_TEXT { files } else { Vec::new() },
        };
        for file in &linked.files {
            let base = linked.text.len() as u32;
            linked.starts.pop();
            linked.starts.extend(file.program.starts.iter().map(|start| base + start));
            linked.text.extend_from_slice(&file.program.text);
        }
        linked
    }
    /// Files that belong to it.
    pub fn files(&self) -> &[File] {
        &self.files
    }
    /// Its own text, then its files.
    pub fn parts(&self) -> impl Iterator<Item = Part<'_>> {
        let mut next = 0;
        let own = std::iter::once((None, self.own));
        let files = self.files.iter().map(|file| (Some(file.name.as_str()), file.program.len() as u32));
        own.chain(files).map(move |(name, count)| {
            let blocks = next..next + count;
            next = blocks.end;
            let span = Span { start: self.starts[blocks.start as usize], end: self.starts[blocks.end as usize] };
            Part { name, blocks, span }
        })
    }
    /// Number of blocks of its own text.
    pub fn own_len(&self) -> usize {
        self.own as usize
    }
    /// The bytes of its own text.
    pub fn own_text(&self) -> &[u8] {
        &self.text[..self.starts[self.own as usize] as usize]
    }
    /// The bytes, exactly as they were read, those of its files behind its own.
    pub fn text(&self) -> &[u8] {
        &self.text
    }
    /// Number of blocks (lines), those of its files included.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }
    /// True for an empty text.
    #[allow(dead_code, reason = "a public `len` has it beside it (clippy::len_without_is_empty)")]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// The dialect it is read in.
    pub fn dialect(&self) -> Dialect {
        self.dialect
    }
    /// As what it was recognised; `None` where the dialect was given.
    pub fn recognised(&self) -> Option<&Recognised> {
        self.recognised.as_ref()
    }
    /// Bytes of a block, its line end included.
    pub fn span(&self, block: BlockId) -> Span {
        Span { start: self.starts[block.ix()], end: self.starts[block.ix() + 1] }
    }
    /// Physical line of a block in the text it belongs to, 1-based.
    pub fn line(&self, block: BlockId) -> u32 {
        self.place(block).0
    }
    /// Physical line of a block, 1-based, and the file it stands in if that is not the program's own text.
    pub fn place(&self, block: BlockId) -> (u32, Option<&str>) {
        if block.0 < self.own {
            return (block.0 + 1, None);
        }
        let part = self.parts().find(|part| part.blocks.contains(&block.0));
        part.map_or((block.0 + 1, None), |part| (block.0 - part.blocks.start + 1, part.name))
    }
    /// Text of a block, its line end included.
    pub fn line_text(&self, block: BlockId) -> &[u8] {
        self.span(block).of(&self.text)
    }
    /// Block that holds a byte.
    pub fn block_at(&self, byte: u32) -> BlockId {
        BlockId((self.starts.partition_point(|&start| start <= byte).max(1) - 1) as u32)
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
            is_text: self.continues_comment(block),
        }
    }
    /// Does the block only go on with a comment of plain language: `; text ~`, and the line behind it?
    fn continues_comment(&self, block: BlockId) -> bool {
        if self.dialect.syntax() != Syntax::Heidenhain {
            return false;
        }
        let before = |block: u32| self.line_text(BlockId(block));
        let goes_on = |block: &u32| before(*block).trim_ascii_end().ends_with(b"~");
        let first = (0..block.0).rev().take(MOST_CONTINUED).take_while(goes_on).last();
        first.is_some_and(|first| heidenhain_lex::is_comment(before(first)))
    }
    /// Does any block depend on the block-delete switch?
    pub fn has_block_delete(&self) -> bool {
        let mut slash = memchr::memchr_iter(b'/', &self.text).map(|at| self.block_at(at as u32));
        slash.any(|block| self.tokens(block).any(|token| token.kind == TokenKind::Delete))
    }
    /// Bytes the program occupies in memory.
    #[cfg(feature = "rooms")]
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
    /// The line continues a comment.
    is_text: bool,
}

impl Iterator for Tokens<'_> {
    type Item = Token;

    #[inline]
    fn next(&mut self) -> Option<Token> {
        if self.at >= self.line.len() {
            return None;
        }
        if std::mem::take(&mut self.is_text) {
            let text = self.line.trim_ascii_end().len();
            self.at = text;
            let span = Span { start: self.base, end: self.base + text as u32 };
            if text > 0 {
                return Some(Token { kind: TokenKind::Comment, span, number: 0.0 });
            }
        }
        if self.base == 0 && self.at == 0 && self.line.starts_with(BYTE_ORDER_MARK) {
            self.at = BYTE_ORDER_MARK.len();
            let span = Span { start: 0, end: self.at as u32 };
            return Some(Token { kind: TokenKind::Blank, span, number: 0.0 });
        }
        let token = match self.syntax {
            Syntax::Rs274 => rs274_lex::token(self.line, self.at, self.base, self.first),
            Syntax::Siemens => siemens_lex::token(self.line, self.at, self.base, self.first),
            Syntax::Heidenhain => heidenhain_lex::token(self.line, self.at, self.base, self.first),
        };
        self.at = (token.span.end - self.base) as usize;
        let numbered_after = token.kind == TokenKind::Delete && self.syntax == Syntax::Heidenhain;
        self.first &= token.kind == TokenKind::Blank || numbered_after;
        Some(token)
    }
}
