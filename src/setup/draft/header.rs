//! Which comments of a program describe tools. In: the program. Out: its comments with the T word in force, and for a description
//! the number of its tool.

use crate::nc::{Program, TokenKind};

/// A comment of a program.
pub struct Comment {
    /// Without its brackets, in capitals.
    pub text: String,
    /// Physical line, 1-based.
    pub line: u32,
    /// T word in force where it stands.
    pub tool: Option<u32>,
    /// The T word stands on the same line.
    pub same_line: bool,
}

/// The comments of a program in their order.
pub fn comments(program: &Program) -> Vec<Comment> {
    let mut found = Vec::new();
    let mut tool = None;
    for block in program.blocks() {
        let mut same_line = false;
        for token in program.tokens(block) {
            match token.kind {
                TokenKind::Word(b'T') if token.number >= 0.0 => {
                    tool = Some(token.number as u32);
                    same_line = true;
                }
                TokenKind::Comment => {
                    let bytes = token.span.of(program.text());
                    let text: String = bytes.iter().map(|byte| (*byte as char).to_ascii_uppercase()).collect();
                    let line = program.line(block);
                    found.push(Comment { text: inner(&text), line, tool, same_line });
                }
                _ => {}
            }
        }
    }
    found
}

/// A comment without its brackets or semicolons.
pub fn inner(comment: &str) -> String {
    let text = comment.trim_start_matches([';', '(']);
    text.strip_suffix(')').unwrap_or(text).trim().to_owned()
}

/// Words by which a comment describes a tool.
pub const TOOL_WORDS: [&str; 28] = [
    "MILL",
    "DRILL",
    "TAP ",
    "REAM",
    "PROBE",
    "CHAMFER",
    "CUTTER",
    "DIA",
    "BALL",
    "BULL",
    "FLAT",
    "SPOT",
    "V-BIT",
    "VBIT",
    "ENGRAV",
    "CORE",
    "COUNTERSINK",
    "BORING",
    "FLUTE",
    "BOHRER",
    "FRAESER",
    "FR\u{c4}SER",
    "FR\u{e4}SER",
    "FR\u{c3}",
    "KUGEL",
    "SENKER",
    "NOSE",
    " EM",
];

/// Tool number and description, when a comment describes a tool.
pub fn tool_comment(comment: &Comment) -> Option<(u32, String)> {
    let text = comment.text.as_str();
    let described = TOOL_WORDS.iter().any(|word| text.contains(word));
    if let Some((number, rest)) = numbered(text) {
        let bare = rest.trim_start_matches([' ', ':', '=', '|', '-']).parse::<f64>().is_ok();
        if described || bare || rest.trim_start().starts_with("D=") {
            return Some((number, rest.trim_start().trim_start_matches(['|', ':', '-', ',', ' ']).to_owned()));
        }
    }
    let named = text.starts_with("TOOL:") || text.starts_with("TOOL DIA") || text.starts_with("TOOL/");
    (described && (named || comment.same_line)).then(|| comment.tool.map(|number| (number, text.to_owned())))?
}

/// `T1 …`, `TOOL #1 …`, `TOOL 1: …`, `TOOL NUMBER: 1 …`, or `… TOOL - 1 DIA. OFF. …`: the number, and what describes the tool.
pub fn numbered(text: &str) -> Option<(u32, String)> {
    for name in ["TOOL NUMBER", "TOOL NO", "TOOL", "NO", "T"] {
        let Some(rest) = text.strip_prefix(name) else { continue };
        let rest = rest.trim_start_matches([' ', ':', '#', '-', '.', '=']);
        if let (Some(number), rest) = split_number(rest)
            && !rest.starts_with(['.', '/', 'M'])
        {
            return Some((number, rest.to_owned()));
        }
    }
    let at = text.find("TOOL - ")?;
    let (number, _) = split_number(text[at + 7..].trim_start());
    number.map(|number| (number, text.to_owned()))
}

fn split_number(text: &str) -> (Option<u32>, &str) {
    let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    (text[..end].parse().ok(), &text[end..])
}
