//! Operations that the setup recognises by a comment. In: the program and the operations. Out: the same operations by lines, one for each
//! stretch of text whose last comment contains the words; and the sections of the text that comments between cuts begin.

use crate::engage::EngagementMap;
use crate::ids::BlockId;
use crate::machine::{Match, Operation};
use crate::nc::{Program, TokenKind, Toolpath};
use crate::schedule::operations::Section;

/// Replaces every operation that is matched by comment by operations matched by line, each with the index of the original one; operations
/// without a match are left out.
pub fn by_lines(operations: &[Operation], program: &Program) -> Vec<(usize, Operation)> {
    let mut resolved = Vec::new();
    for (index, operation) in operations.iter().enumerate() {
        let Some(words) = &operation.matches.comment else {
            resolved.push((index, operation.clone()));
            continue;
        };
        for stretch in stretches(program, &words.to_lowercase()) {
            let lines = match operation.matches.lines {
                Some((first, last)) => (first.max(stretch.0), last.min(stretch.1)),
                None => stretch,
            };
            if lines.0 <= lines.1 {
                let matches = Match { comment: None, lines: Some(lines), ..operation.matches.clone() };
                resolved.push((index, Operation { matches, ..operation.clone() }));
            }
        }
    }
    resolved
}

/// First and last lines of the stretches whose last comment holds `words`. Our own comments do not count.
fn stretches(program: &Program, words: &str) -> Vec<(u32, u32)> {
    let mut found: Vec<(u32, u32)> = Vec::new();
    let mut inside = false;
    for block in program.blocks().take(program.own_len()) {
        if let Some(text) = last_comment(program, block) {
            inside = text.to_lowercase().contains(words);
        }
        let line = program.line(block);
        match found.last_mut() {
            Some((_, last)) if inside && *last + 1 == line => *last = line,
            _ if inside => found.push((line, line)),
            _ => {}
        }
    }
    found
}

/// The last comment of a block that is not ours.
fn last_comment(program: &Program, block: BlockId) -> Option<String> {
    let comments = program.tokens(block).filter(|token| token.kind == TokenKind::Comment);
    let bytes = comments.map(|token| token.span.of(program.text()));
    let last = bytes.filter(|bytes| crate::rewrite::mark::read(bytes).is_none()).last()?;
    Some(last.iter().map(|byte| char::from(*byte)).collect())
}

/// Sections of the text: each begins with a comment in a block of its own that stands between cuts, and bears the name of the
/// last such comment before its first cut.
pub fn sections(program: &Program, toolpath: &Toolpath, map: &EngagementMap) -> Vec<Section> {
    let cuts = |id| map.stations_of(id).iter().any(|station| station.arc_count > 0);
    let mut lines: Vec<u32> =
        toolpath.iter_moves().filter(|(id, _)| cuts(*id)).map(|(_, motion)| motion.line).collect();
    lines.sort_unstable();
    let mut found: Vec<Section> = Vec::new();
    for block in program.blocks().take(program.own_len()) {
        let Some(text) = last_comment(program, block).filter(|_| says_nothing_else(program, block)) else { continue };
        let name = text.trim_matches(|c: char| c.is_whitespace() || "();".contains(c)).to_owned();
        let line = program.line(block);
        let is_cut_since = |section: &Section| {
            let next = lines.partition_point(|cut| *cut < section.first_line);
            lines.get(next).is_some_and(|cut| *cut < line)
        };
        match found.last_mut() {
            Some(section) if !is_cut_since(section) => section.name = name,
            None if lines.first().is_none_or(|cut| *cut >= line) => found.push(Section { first_line: 1, name }),
            _ => found.push(Section { first_line: line, name }),
        }
    }
    found
}

/// A comment, perhaps with a number of the block, and nothing else.
fn says_nothing_else(program: &Program, block: BlockId) -> bool {
    use TokenKind::{Blank, Comment, LineEnd, Word};
    program.tokens(block).all(|token| matches!(token.kind, Blank | Comment | LineEnd | Word(b'N')))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_end_at_the_next_comment() {
        let text = "(rough)\nG1 X1\n(Finish wall)\nG1 X2\nG1 X3 (FW F5 kept)\n(drill)\nG1 Z1\n; FINISH floor\nG1 X4\n";
        let program = crate::nc::parse(text.into(), None);
        assert_eq!(stretches(&program, "finish"), [(3, 5), (8, 9)]);
        let operation = Operation {
            matches: Match { comment: Some("FINISH".into()), lines: Some((4, 100)), ..Match::default() },
            ..Operation::default()
        };
        let lines: Vec<_> = by_lines(&[operation], &program).iter().map(|(_, o)| o.matches.lines).collect();
        assert_eq!(lines, [Some((4, 5)), Some((8, 9))]);
    }
}
