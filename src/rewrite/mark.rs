//! Our mark: the comments by which an output is recognised as ours. In: what a comment is to say, or a program that may hold such
//! comments. Out: the text of the comment; whether a comment is ours, and the feed that it remembers.
//!
//! | comment | meaning |
//! |---|---|
//! | `FEEDWRIGHT 0.1 FEEDS ONLY 3F29A0C1` | header, one a file; the last word is a checksum over every F word and the original feed it stands for ([`super::memory`]) |
//! | `FW F1240 WAS 600 POWER 98PCT T3` | note after an F word that was changed: feed in force, original feed, binding limit, share of it in use, tool |
//! | `FW F600 KEPT` | a feed that is restated |
//! | `FW WAS 600X12 800` | after the header: original feeds in the order of the F words, where notes are not wanted or do not fit their lines |
//! | `FW CHECK 2 CYCLE 1` | force or power is to be measured here for the life of the tool ([`super::checks()`]) |
//!
//! Only comments of exactly this grammar are ours; everything else in a comment belongs to the user. The words are plain ASCII in capitals, without
//! brackets or quotes, so that every dialect can carry them in its own form of comment and controls without small letters show them, and without
//! `%`, at which many a control stops reading a file wherever it stands. Notes of before, with `%` and small letters, are still read.

use crate::diag::Span;
use crate::machine::LimitKind;
use crate::nc::{Part, Program, TokenKind};

/// First word of the header.
const HEADER: &str = "FEEDWRIGHT";
/// First word of a note.
const NOTE: &str = "FW";
/// Follows the share of a limit.
const PERCENT: &str = "PCT";
/// Before original feeds.
const WAS: &str = "WAS";
/// Ends the note of a feed that is restated.
const KEPT: &str = "KEPT";
/// Second word of the mark of a check point.
const CHECK: &str = "CHECK";

/// The content of a note.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Note {
    /// F number in force.
    pub feed: String,
    /// F number of the program it was optimised from, when it differs.
    pub was: Option<String>,
    /// What bounds the feed.
    pub limit: Option<LimitKind>,
    /// Percentage of that limit in use.
    pub percent: Option<u32>,
    /// Tool number.
    pub tool: Option<u32>,
    /// The feed is restated for text that was left as it is.
    pub kept: bool,
}

/// A comment of ours.
#[derive(Debug, Clone, PartialEq)]
pub enum Ours {
    /// The mark of the file, with its sum; `None`: an old one that has none.
    Header(Option<u32>),
    /// A note beside an F word.
    Note(Note),
    /// F numbers of the program that the file was optimised from, each with how many F words in a row stand for it.
    Was(Vec<(String, usize)>),
    /// Here force or power is to be read.
    Check {
        /// Number of the check point.
        number: u32,
        /// Number of the cut in it.
        cycle: u32,
    },
}

/// Text of the header comment.
pub fn header_text(sum: u32) -> String {
    format!("{HEADER} {} FEEDS ONLY {sum:08X}", env!("CARGO_PKG_VERSION"))
}

/// Word that stands for a number of F words in a row with one feed.
pub fn run_text(was: &str, count: usize) -> String {
    if count == 1 { was.to_owned() } else { format!("{was}X{count}") }
}

/// Text of a comment that lists original feeds.
pub fn was_text(runs: &[String]) -> String {
    format!("{NOTE} {WAS} {}", runs.join(" "))
}

/// Text of the comment before a cut of a check point.
pub fn check_text(number: u32, cycle: u32) -> String {
    format!("{NOTE} {CHECK} {number} CYCLE {cycle}")
}

fn read_check(text: &str) -> Option<Ours> {
    let mut words = text.split(' ').skip(2);
    let number = words.next()?.parse().ok()?;
    let cycle = words.nth(1)?.parse().ok()?;
    (check_text(number, cycle) == text).then_some(Ours::Check { number, cycle })
}

fn read_was(words: std::str::Split<'_, char>) -> Option<Ours> {
    let run = |word: &str| match word.split_once(['X', 'x']) {
        None => Some((number(word)?.to_owned(), 1)),
        Some((was, count)) => Some((number(was)?.to_owned(), count.parse::<usize>().ok().filter(|count| *count > 1)?)),
    };
    words.map(run).collect::<Option<Vec<_>>>().filter(|runs| !runs.is_empty()).map(Ours::Was)
}

impl Note {
    /// Text of the comment.
    pub fn text(&self) -> String {
        let mut text = format!("{NOTE} F{}", self.feed);
        if let Some(was) = &self.was {
            text += &format!(" {WAS} {was}");
        }
        if let Some(limit) = self.limit {
            text += &format!(" {}", limit.name().to_ascii_uppercase());
        }
        if let Some(percent) = self.percent {
            text += &format!(" {percent}{PERCENT}");
        }
        if let Some(tool) = self.tool {
            text += &format!(" T{tool}");
        }
        if self.kept {
            text += &format!(" {KEPT}");
        }
        text
    }

    fn read(text: &str) -> Option<Self> {
        let mut words = text.split(' ');
        let mut note = Note::default();
        if words.next() != Some(NOTE) {
            return None;
        }
        number(words.next()?.strip_prefix('F')?)?.clone_into(&mut note.feed);
        while let Some(word) = words.next() {
            if is(word, WAS) {
                note.was = Some(number(words.next()?)?.to_owned());
            } else if is(word, KEPT) {
                note.kept = true;
            } else if let Some(percent) = word.strip_suffix(PERCENT).or(word.strip_suffix('%')) {
                note.percent = Some(percent.parse().ok()?);
            } else if let Some(tool) = word.strip_prefix('T') {
                note.tool = Some(tool.parse().ok()?);
            } else {
                let capitals = |kind: &LimitKind| kind.name().to_ascii_uppercase();
                note.limit = Some(LimitKind::ALL.into_iter().find(|kind| is(word, &capitals(kind)))?);
            }
        }
        (note.text() == text.replace('%', PERCENT).to_ascii_uppercase()).then_some(note)
    }
}

/// Is it this word of ours, in capitals or, as it was written before, in small letters?
fn is(word: &str, capitals: &str) -> bool {
    word == capitals || word == capitals.to_ascii_lowercase()
}

fn number(text: &str) -> Option<&str> {
    super::decimal::Decimal::read(text.as_bytes()).map(|_| text)
}

/// The content of a comment of ours, given with its delimiters; `None`: it is the user's.
pub fn read(comment: &[u8]) -> Option<Ours> {
    let text = std::str::from_utf8(comment).ok()?;
    let inner = match text.strip_prefix('(') {
        Some(rest) => rest.strip_suffix(')')?,
        None => text.strip_prefix("; ")?.trim_end(),
    };
    let mut words = inner.split(' ');
    let version = |word: &str| word.bytes().all(|b| b.is_ascii_digit() || b == b'.') && !word.is_empty();
    let headed = words.next() == Some(HEADER) && words.next().is_some_and(version);
    if headed && [words.next(), words.next()] == [Some("FEEDS"), Some("ONLY")] {
        let sum =
            words.next().map(|word| u32::from_str_radix(word, 16).ok().filter(|sum| format!("{sum:08X}") == word));
        return match (sum, words.next()) {
            (None, None) => Some(Ours::Header(None)),
            (Some(Some(sum)), None) => Some(Ours::Header(Some(sum))),
            _ => None,
        };
    }
    let mut words = inner.split(' ');
    if words.next() == Some(NOTE) && words.next() == Some(WAS) {
        return read_was(words);
    }
    read_check(inner).or_else(|| Note::read(inner).map(Ours::Note))
}

/// Does the program carry our mark?
pub fn is_ours(program: &Program) -> bool {
    program.parts().any(|part| is_marked(program, &part))
}

/// Does this part of the program carry our header?
pub fn is_marked(program: &Program, part: &Part<'_>) -> bool {
    let found = memchr::memmem::find_iter(part.span.of(program.text()), HEADER.as_bytes());
    found.map(|at| program.block_at(part.span.start + at as u32)).any(|block| {
        let tokens = program.tokens(block);
        tokens
            .filter(|t| t.kind == TokenKind::Comment)
            .any(|t| matches!(read(t.span.of(program.text())), Some(Ours::Header(_))))
    })
}

/// The span, with the blank before it if there is one.
pub fn with_blank_before(text: &[u8], span: Span) -> Span {
    let blank = span.start > 0 && text[span.start as usize - 1] == b' ';
    Span { start: span.start - u32::from(blank), end: span.end }
}

/// For tests: the program without our comments: with the blank before them, and with their line where nothing else stood on it.
#[cfg(test)]
pub fn strip(program: &Program) -> Vec<u8> {
    use super::edit::{self, Edit};
    let edits = program.blocks().flat_map(|block| {
        let tokens: Vec<_> = program.tokens(block).collect();
        let ours = |t: &&crate::nc::Token| t.kind == TokenKind::Comment && read(t.span.of(program.text())).is_some();
        let empty = |kind| matches!(kind, TokenKind::Blank | TokenKind::LineEnd);
        if tokens.iter().any(|t| ours(&t)) && tokens.iter().all(|t| ours(&t) || empty(t.kind)) {
            return vec![Edit::replace(program.span(block), *b"")];
        }
        let with_blank = |t: &crate::nc::Token| Edit::replace(with_blank_before(program.text(), t.span), *b"");
        tokens.iter().filter(ours).map(with_blank).collect()
    });
    let all = Span { start: 0, end: program.text().len() as u32 };
    edit::apply(all, program.text(), edits.collect())
}

#[cfg(test)]
mod tests {
    use super::super::verify::comment::is_ours;
    use super::*;
    use crate::nc::{CommentForm, Dialect};

    #[test]
    fn our_comments_are_read_back_in_every_form() {
        let note = Note {
            feed: "1240.5".to_owned(),
            was: Some("600".to_owned()),
            limit: Some(LimitKind::Power),
            percent: Some(98),
            tool: Some(3),
            kept: false,
        };
        assert_eq!(note.text(), "FW F1240.5 WAS 600 POWER 98PCT T3");
        let comment = |form: CommentForm, text: &str| form.write(text).into_bytes();
        for form in [CommentForm::Parentheses, CommentForm::Semicolon] {
            assert_eq!(read(&comment(form, &note.text())), Some(Ours::Note(note.clone())), "{form:?}");
            assert_eq!(read(&comment(form, &header_text(0x3F2))), Some(Ours::Header(Some(0x3F2))));
            let runs = [run_text("600.", 12), run_text(".5", 1)];
            let was = Ours::Was(vec![("600.".to_owned(), 12), (".5".to_owned(), 1)]);
            assert_eq!(read(&comment(form, &was_text(&runs))), Some(was));
            // The proof, which reads comments by itself, knows each that is written.
            for text in [note.text(), header_text(0x3F2), was_text(&runs), check_text(2, 1)] {
                assert!(is_ours(&comment(form, &text)), "{text}");
            }
        }
    }

    #[test]
    fn comments_of_the_user_are_not_ours() {
        for text in [
            "(FW)",
            "(FW HELLO)",
            "(FW F600 power 98% T3 MORE)",
            "(F1240 power 98% T3)",
            "(FEEDWRIGHT IS GOOD)",
            "(fw F600)",
            "(FW  F600)",
            "(FW F)",
            "(FW CHECK 1)",
            "(FW CHECK 1 CYCLE 01)",
            "(FW CHECK 1 CYCLE 1 MORE)",
            "(FW WAS)",
            "(FW WAS 600x1)",
            "(FW WAS 600 MORE)",
            "(FEEDWRIGHT 0.1 FEEDS ONLY 3F2)",
            "(FEEDWRIGHT 0.1 FEEDS ONLY 000003F2 MORE)",
        ] {
            assert_eq!(read(text.as_bytes()), None, "{text}");
            assert!(!is_ours(text.as_bytes()), "{text}");
        }
    }

    #[test]
    fn stripping_takes_only_what_is_ours() {
        let text =
            format!("%\n({})\nG1 X1 F600 (FW F600 was 500 power 98%)\nF5 (FW F5 kept)\n(FW user)\n", header_text(7));
        let program = crate::nc::parse(text.into_bytes(), Some(Dialect::Generic));
        assert!(super::is_ours(&program));
        assert_eq!(String::from_utf8(strip(&program)).unwrap(), "%\nG1 X1 F600\nF5\n(FW user)\n");
    }
}
