//! From the changes of a block to edits. In: lines to be put before it, words inside and after its code, its note. Out: edits that keep to the
//! control's line length, new lines with block numbers in the program's series, and the mark of the file.

use crate::ids::BlockId;
use crate::machine::Annotate;
use crate::nc::{BYTE_ORDER_MARK, CommentForm, Syntax};

use super::decimal::{Decimal, NumberStyle};
use super::edit::Edit;
use super::mark::{self, Note};
use super::memory;
use super::view::{self, View};
use super::write::{Change, Line, Writer, kept_note};

/// Bytes of a comment that lists original feeds.
const LIST_BYTES: usize = 72;

fn lines_in(text: &[u8]) -> usize {
    memchr::memchr_iter(b'\n', text).count()
}

impl Writer<'_> {
    /// Turns the gathered changes of a block into edits.
    pub(super) fn emit(&mut self, id: BlockId, view: &View, mut change: Change) {
        let start = self.program.span(id).start;
        let untouched = change.before.is_empty() && change.edits.is_empty() && change.append.is_empty();
        self.stats.f_words_after += usize::from(view.has(b'F')) + usize::from(!change.append.is_empty());
        if !self.fits(view, &change, id) && !change.append.is_empty() {
            let code = change.append.trim_ascii().to_vec();
            let feed = change.feed.take().map(|feed| (feed.clone(), self.was_now(&feed)));
            change.before.push(Line { code, note: change.note.take(), feed });
            change.append.clear();
        }
        self.emit_before(start, view, &change.before);
        let there = view.note().map(|(_, note)| note);
        let same = |note: &Note| there.map_or(self.marked, |old| old.feed == note.feed && old.was == note.was);
        let leave = change.leave_note || (untouched && change.note.as_ref().is_none_or(same));
        let note = self.note_edit(id, view, &change, leave);
        self.own_words(view, &change, note.as_ref());
        if !change.append.is_empty() {
            self.edits.push(Edit::insert(self.append_at(view), change.append));
        }
        self.edits.extend(change.edits);
        self.edits.extend(note);
    }

    /// Records the F words of the block itself.
    fn own_words(&mut self, view: &View, change: &Change, note: Option<&Edit>) {
        if let Some(feed) = &change.feed {
            let noted = note.is_some_and(|edit| !edit.text.is_empty());
            let noted = noted && change.note.as_ref().is_some_and(|note| note.was.is_some());
            self.enter((feed.clone(), self.was_now(feed)), noted);
            return;
        }
        for word in view.words.iter().filter(|word| word.letter == b'F') {
            let number = String::from_utf8_lossy(view::number_bytes(self.program, word)).into_owned();
            let was = self.was_at(word.span.start, &number);
            let there = view.note().is_some_and(|(_, there)| there.feed == number && there.was.is_some());
            self.unnoted |= was != number && !(there && note.is_none());
            self.words.push((number, was));
        }
    }

    /// Records an F word with the original one that it stands for.
    fn enter(&mut self, (feed, was): (String, String), noted: bool) {
        self.unnoted |= !noted && was != feed;
        self.words.push((feed, was));
    }

    /// Bytes of the block's line after its edits, without a note.
    fn new_length(&self, view: &View, change: &Change, id: BlockId) -> usize {
        let line = (view.line_end - self.program.span(id).start) as usize;
        let removed: usize = change.edits.iter().map(|edit| edit.span.len()).sum();
        line + change.append.len() + change.edits.iter().map(|edit| edit.text.len()).sum::<usize>() - removed
    }

    fn fits(&self, view: &View, change: &Change, id: BlockId) -> bool {
        self.new_length(view, change, id) <= self.most_bytes
    }

    /// Where a word is put in: after the code; in plain language before the M functions.
    fn append_at(&self, view: &View) -> u32 {
        let m = view.words.iter().find(|word| word.letter == b'M' && self.dialect.syntax() == Syntax::Heidenhain);
        m.map_or(view.code_end, |word| mark::with_blank_before(self.program.text(), word.span).start)
    }

    fn note_edit(&self, id: BlockId, view: &View, change: &Change, leave: bool) -> Option<Edit> {
        let there = view.note();
        if leave {
            return None;
        }
        let old = there.map_or(0, |(span, _)| span.len());
        let room = self.most_bytes.saturating_sub(self.new_length(view, change, id)) + old;
        let note = change.note.as_ref().filter(|_| self.may_note(view));
        let text = note.and_then(|note| self.fitting(note, room));
        match (there, text) {
            (Some((span, _)), Some(text)) => Some(Edit::replace(*span, text)),
            (Some((span, _)), None) => Some(Edit::replace(*span, *b"")),
            (None, Some(text)) => Some(Edit::insert(self.note_at(view), text)),
            (None, None) => None,
        }
    }

    /// The note as text of at most `room` bytes. Tool and limit are left out where they do not fit; `None` if even the original feed does not.
    fn fitting(&self, note: &Note, room: usize) -> Option<Vec<u8>> {
        let short = Note { tool: None, ..note.clone() };
        let shorter = Note { limit: None, percent: None, ..short.clone() };
        let text = |note: &Note| [b" ".as_slice(), &self.comment(&note.text())].concat();
        [note, &short, &shorter].into_iter().map(text).find(|text| text.len() <= room)
    }

    /// A comment in the form of this file.
    fn comment(&self, text: &str) -> Vec<u8> {
        self.manners.comment.write(text).into_bytes()
    }

    fn note_at(&self, view: &View) -> u32 {
        if self.manners.comment == CommentForm::Parentheses { view.code_end } else { view.line_end }
    }

    /// May a note be put into this line? Not after a comment that runs to the end of the line, and not after one that the control acts on.
    fn may_note(&self, view: &View) -> bool {
        let inside = view.user_comment_at.is_some_and(|at| at < view.code_end);
        match self.manners.comment {
            CommentForm::Parentheses => !inside,
            CommentForm::Semicolon => view.user_comment_at.is_none(),
        }
    }

    /// The lines put before a block, numbered where the block is and there is room between the numbers.
    fn emit_before(&mut self, start: u32, view: &View, lines: &[Line]) {
        if lines.is_empty() {
            return;
        }
        let numbers = self.line_numbers(view, lines.len());
        let mut out = Vec::new();
        for (index, Line { code, note, feed }) in lines.iter().enumerate() {
            let begin = out.len();
            if let Some(numbers) = &numbers {
                out.extend_from_slice(numbers[index].as_bytes());
                out.extend_from_slice(if self.manners.spaced { b" " } else { b"" });
            }
            out.extend_from_slice(code.trim_ascii());
            let comment = note.as_ref().filter(|_| self.job.output.annotate != Annotate::None);
            let room = self.most_bytes.saturating_sub(out.len() - begin);
            let noted = comment.and_then(|note| Some((note.was.is_some(), self.fitting(note, room)?)));
            if let Some(feed) = feed {
                self.enter(feed.clone(), noted.as_ref().is_some_and(|(was, _)| *was));
            }
            out.extend(noted.map(|(_, text)| text).unwrap_or_default());
            out.extend_from_slice(self.line_end);
            self.stats.f_words_after += usize::from(code.iter().any(|b| b.eq_ignore_ascii_case(&b'F')));
        }
        self.stats.blocks_added += lines.len();
        self.edits.push(Edit::insert(start, out));
    }

    /// Block numbers between that of the last block and that of this one, evenly spaced. `None` where the program has no numbers, or there is
    /// no room between them: numbers must not repeat, and those of the program stay.
    fn line_numbers(&self, view: &View, count: usize) -> Option<Vec<String>> {
        let word = view.only(b'N')?;
        let (last, next) = (self.last_number?, word.number);
        let step = ((next - last) / (count as f64 + 1.0)).floor();
        if step < 1.0 || last.fract() != 0.0 || next.fract() != 0.0 {
            return None;
        }
        let number = view::number_bytes(self.program, word);
        let style = NumberStyle::of(number, true);
        let bytes = word.span.of(self.program.text());
        let letter = String::from_utf8_lossy(&bytes[..bytes.len() - number.len()]).into_owned();
        let text = |k: usize| style.write(Decimal::nearest(last + step * k as f64, 0));
        Some((1..=count).map(|k| format!("{letter}{}", text(k))).collect())
    }

    /// Ends the text. Where a file returns to its caller at its end, the original F is restated after the last block. The mark of the file is
    /// added if anything was changed.
    pub fn end(&mut self) {
        let returns = self.part.name.is_some() && self.may_insert();
        if let (true, true, Some(feed)) = (returns, self.now_is_ours(), self.original_feed()) {
            let was = self.restated_was(&feed);
            let note = kept_note(&feed, &was);
            let code = |block: &BlockId| {
                !View::of(self.program, *block).empty && !self.program.line_text(*block).starts_with(b"%")
            };
            let last = self.part.blocks().filter(code).last();
            let end = last.map_or(self.part.span.end, |block| self.program.span(block).end);
            let whole = self.program.text()[..end as usize].ends_with(b"\n");
            let before: &[u8] = if whole { b"" } else { self.line_end };
            let text = [&self.f_word(&feed), b" ".as_slice(), &self.comment(&note.text())].concat();
            let text = if self.job.output.annotate == Annotate::None { self.f_word(&feed) } else { text };
            let noted = self.job.output.annotate != Annotate::None && note.was.is_some();
            self.enter((feed, was), noted);
            self.edits.push(Edit::insert(end, [before, &text, if whole { self.line_end } else { b"" }].concat()));
            self.stats.blocks_added += 1;
            self.stats.f_words_after += 1;
        }
        if !self.edits.is_empty() && self.job.output.marked {
            self.header();
        }
    }

    /// Adds the mark of the file, or updates its checksum: on a line before the first block of code (before the second, if the first begins
    /// with a byte order mark, which must remain the first bytes), or in plain language, whose lines are numbered, at the end of the first
    /// motion. After it come the original feeds, where notes do not give them.
    fn header(&mut self) {
        let words = self.words.iter().map(|(number, was)| (number.as_str(), was.as_str()));
        let text = self.comment(&mark::header_text(memory::sum(words)));
        let memory = self.memory.take();
        if memory.as_ref().is_some_and(|memory| !memory.fits) {
            return;
        }
        let lists = self.lists();
        self.stats.blocks_added += lines_in(&lists);
        if let Some(memory) = memory {
            self.header_again(&memory, &text, lists);
            return;
        }
        let views = self.part.blocks().map(|block| (block, View::of(self.program, block)));
        if self.may_insert() {
            let marked = |block: BlockId| self.program.line_text(block).starts_with(BYTE_ORDER_MARK);
            let first = |view: &View| !view.empty && !view.flow && !view.words.is_empty();
            let mut code = views.filter(|(block, view)| first(view) && !marked(*block));
            if let Some((block, _)) = code.next() {
                let lines = [text.as_slice(), self.line_end, &lists].concat();
                self.edits.insert(0, Edit::insert(self.program.span(block).start, lines));
                self.stats.blocks_added += 1;
            }
            return;
        }
        let mut motions =
            views.filter(|(_, view)| view.has(b'X') && view.user_comment_at.is_none() && view.ours.is_empty());
        // A comment runs to the end of the line: there is room for one.
        let touched = |block: BlockId, end: u32| {
            let start = self.program.span(block).start;
            self.edits.iter().any(|edit| (start..=end).contains(&edit.span.start))
        };
        if let Some((_, view)) = motions.find(|(block, view)| !touched(*block, view.line_end)) {
            self.edits.push(Edit::insert(view.line_end, [b" ".as_slice(), &text].concat()));
        }
    }

    /// The header of an earlier run with a new sum, and its lists taken out for new ones.
    fn header_again(&mut self, memory: &memory::Memory, text: &[u8], lists: Vec<u8>) {
        let blank: &[u8] = if self.program.text()[memory.header.start as usize] == b' ' { b" " } else { b"" };
        self.edits.push(Edit::replace(memory.header, [blank, text].concat()));
        let line = self.program.block_at(memory.header.start);
        if !lists.is_empty() {
            self.edits.insert(0, Edit::insert(self.program.span(line).end, lists));
        }
        self.edits.extend(memory.lists.iter().map(|list| Edit::replace(self.program.span(*list), *b"")));
        self.stats.blocks_added = self.stats.blocks_added.saturating_sub(memory.lists.len());
    }

    /// The lines that list the original feeds. Empty where the notes give them, or where there is no room; in the latter case the checksum will
    /// not match in a later run, which then raises nothing.
    fn lists(&self) -> Vec<u8> {
        if !self.unnoted || !self.may_insert() {
            return Vec::new();
        }
        let most = self.most_bytes.saturating_sub(4).min(LIST_BYTES);
        let was = self.words.iter().map(|(_, was)| was.as_str());
        let lists = memory::lists(was, most, self.part.span.len()).unwrap_or_default();
        lists.iter().flat_map(|list| [self.comment(list), self.line_end.to_vec()].concat()).collect()
    }

    /// May lines be inserted? Not in Heidenhain plain language, whose lines are numbered without gaps.
    pub(super) fn may_insert(&self) -> bool {
        !self.dialect.properties().counts_blocks
    }
}
