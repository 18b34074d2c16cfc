//! Byte edits over the original text. In: the bytes and replacements, each a span and what stands there instead (an empty
//! span inserts). Out: the new bytes. Edits are disjoint and applied once; with none the bytes come back as they are.

use crate::diag::Span;

/// One replacement.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edit {
    /// What is replaced; empty: an insertion before this byte.
    pub span: Span,
    /// What stands there afterwards.
    pub text: Vec<u8>,
}

impl Edit {
    /// Puts `text` in place of `span`.
    pub fn replace(span: Span, text: impl Into<Vec<u8>>) -> Self {
        Self { span, text: text.into() }
    }
    /// Puts `text` before the byte at `at`.
    pub fn insert(at: u32, text: impl Into<Vec<u8>>) -> Self {
        Self::replace(Span { start: at, end: at }, text)
    }
}

/// Applies the edits to this part of a text: sorted by place, those at one place in the order given. Panics when two overlap
/// or leave the part: that is a bug of the caller, and half an edit must never be written.
pub fn apply(part: Span, text: &[u8], mut edits: Vec<Edit>) -> Vec<u8> {
    edits.sort_by_key(|edit| (edit.span.start, edit.span.end));
    let grown: usize = edits.iter().map(|edit| edit.text.len()).sum();
    let mut out = Vec::with_capacity(part.len() + grown);
    let (mut at, last) = (part.start as usize, part.end as usize);
    for edit in &edits {
        let (start, end) = (edit.span.start as usize, edit.span.end as usize);
        assert!(at <= start && start <= end && end <= last, "edits overlap or leave the text at byte {start}");
        out.extend_from_slice(&text[at..start]);
        out.extend_from_slice(&edit.text);
        at = end;
    }
    out.extend_from_slice(&text[at..last]);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apply_all(text: &[u8], edits: Vec<Edit>) -> Vec<u8> {
        apply(Span { start: 0, end: text.len() as u32 }, text, edits)
    }

    #[test]
    fn nothing_changes_without_edits() {
        let text = b"%\r\nG1\tX1 (\xe4) \0\r\n";
        assert_eq!(apply_all(text, Vec::new()), text);
    }

    #[test]
    fn edits_apply_in_order_of_place() {
        let edits =
            vec![Edit::replace(Span { start: 3, end: 5 }, *b"F9"), Edit::insert(0, *b"N1 "), Edit::insert(5, *b"!")];
        assert_eq!(apply_all(b"G1 F8\n", edits), b"N1 G1 F9!\n");
    }

    #[test]
    #[should_panic(expected = "overlap")]
    fn overlapping_edits_are_refused() {
        let edits =
            vec![Edit::replace(Span { start: 0, end: 2 }, *b"a"), Edit::replace(Span { start: 1, end: 3 }, *b"b")];
        apply_all(b"xyz", edits);
    }
}
