//! Control structures of Siemens 840D: IF … ELSE … ENDIF, FOR … TO … ENDFOR, WHILE … ENDWHILE, LOOP … ENDLOOP,
//! REPEAT … UNTIL. In: a block. Out: where the run goes on. Every jump is charged to the budget, so that endless loops stop.

use super::state::Siemens;
use crate::diag::{Severity, Span};
use crate::ids::BlockId;
use crate::nc::doubt::Doubt;
use crate::nc::interp::interpreter::Interpreter;
use crate::nc::interp::words::Words;
use crate::nc::program::Program;
use crate::nc::token::{Token, TokenKind};

/// Words that begin a structure, each with the one that ends it.
pub(crate) const STRUCTURES: [(&str, &str); 5] =
    [("IF", "ENDIF"), ("FOR", "ENDFOR"), ("WHILE", "ENDWHILE"), ("LOOP", "ENDLOOP"), ("REPEAT", "UNTIL")];

/// The word that a block of this text begins with, upper case, if it belongs to a structure.
pub(crate) fn structure_word(tokens: &[Token], text: &[u8]) -> Option<String> {
    let first = tokens.first().filter(|token| matches!(token.kind, TokenKind::Name | TokenKind::Call))?;
    let word: String = name(first, text);
    let known = word == "ELSE" || STRUCTURES.iter().any(|(open, close)| *open == word || *close == word);
    let jumps = tokens.iter().any(|token| token.kind == TokenKind::Name && name(token, text).starts_with("GOTO"));
    let repeats_label = word == "REPEAT" && tokens.len() > 1;
    (known && !jumps && !repeats_label).then_some(word)
}

/// +1 for a block that begins a structure, −1 for one that ends it, 0 for ELSE.
pub(super) fn step(program: &Program, block: BlockId) -> Option<i8> {
    let code = |kind| !matches!(kind, TokenKind::Blank | TokenKind::LineEnd | TokenKind::Comment | TokenKind::Label);
    let mut tokens: Vec<Token> = program.tokens(block).filter(|token| code(token.kind)).collect();
    tokens.retain(|token| token.kind != TokenKind::Word(b'N'));
    let word = structure_word(&tokens, program.text())?;
    let opens = STRUCTURES.iter().any(|(open, _)| *open == word);
    let closes = STRUCTURES.iter().any(|(_, close)| *close == word);
    Some(i8::from(opens) - i8::from(closes))
}

/// Letters of a name or of a call before its parenthesis, upper case.
pub(crate) fn name(token: &Token, text: &[u8]) -> String {
    let bytes = token.span.of(text);
    let length = bytes.iter().take_while(|byte| byte.is_ascii_alphanumeric() || **byte == b'_').count();
    String::from_utf8_lossy(&bytes[..length]).to_ascii_uppercase()
}

impl Interpreter<'_, Siemens> {
    /// Executes a block that belongs to a structure.
    pub(crate) fn structure(&mut self, word: &str, block: BlockId, tokens: &[Token], text: &[u8], words: &mut Words) {
        match word {
            "IF" if !self.holds(tokens[0], text) => self.leave(block, tokens[0].span, true),
            "ELSE" => self.leave(block, tokens[0].span, false),
            "WHILE" if !self.holds(tokens[0], text) => self.leave(block, tokens[0].span, false),
            "ENDWHILE" => self.back(block, tokens[0].span, 0),
            "ENDLOOP" => self.back(block, tokens[0].span, 1),
            "UNTIL" if !self.holds(tokens[0], text) => self.back(block, tokens[0].span, 1),
            "FOR" => {
                for token in tokens.iter().filter(|token| token.kind == TokenKind::Assignment) {
                    self.siemens_assignment(*token, token.span.of(text), words);
                }
                if !self.counts_on(tokens, text, 0.0) {
                    self.leave(block, tokens[0].span, false);
                }
            }
            "ENDFOR" => self.next_count(block, tokens[0].span),
            _ => {}
        }
    }

    /// Value of the condition behind the first word of a block.
    fn holds(&mut self, first: Token, text: &[u8]) -> bool {
        let word = name(&first, text).len() as u32;
        let condition = to_comment(Span { start: first.span.start + word, end: text.len() as u32 }, text);
        match self.evaluate(condition, condition.of(text), 0) {
            Ok(value) => value != 0.0,
            Err(error) => {
                self.bad_expression(condition, &error);
                false
            }
        }
    }

    /// `FOR var = a TO b`: adds `step` to the variable; is it still within b?
    fn counts_on(&mut self, tokens: &[Token], text: &[u8], step: f64) -> bool {
        let setting = tokens.iter().find(|token| token.kind == TokenKind::Assignment);
        let to = tokens.iter().find(|token| token.kind == TokenKind::Name && name(token, text) == "TO");
        let (Some(setting), Some(to)) = (setting, to) else {
            self.not_understood("nc::not-understood", tokens[0].span, "FOR without a variable or TO", "");
            return false;
        };
        let bytes = setting.span.of(text);
        let equals = bytes.iter().position(|&byte| byte == b'=').unwrap_or(0);
        let variable = bytes[..equals].trim_ascii();
        let limit = to_comment(Span { start: to.span.end, end: text.len() as u32 }, text);
        let values = self
            .evaluate(setting.span, variable, 0)
            .and_then(|value| Ok((value + step, self.evaluate(limit, limit.of(text), 0)?)));
        match values {
            Ok((value, limit)) => {
                self.set_variable(&String::from_utf8_lossy(variable).to_ascii_uppercase(), value);
                value <= limit
            }
            Err(error) => {
                self.bad_expression(limit, &error);
                false
            }
        }
    }

    fn next_count(&mut self, block: BlockId, span: Span) {
        let Some(start) = self.labels().partner(block.0, false, false) else { return self.unbalanced(span) };
        let source = self.flow.source.clone();
        let skip = |kind| matches!(kind, TokenKind::Blank | TokenKind::LineEnd | TokenKind::Comment | TokenKind::Label);
        let tokens: Vec<Token> = source.program().tokens(BlockId(start)).filter(|token| !skip(token.kind)).collect();
        let first = tokens.iter().position(|token| token.kind == TokenKind::Name).unwrap_or(0);
        if self.counts_on(&tokens[first..], source.program().text(), 1.0) {
            self.jump(start as usize + 1);
        }
    }

    /// Goes on behind the end of the structure (behind ELSE, where there is one and it is asked for).
    fn leave(&mut self, block: BlockId, span: Span, to_else: bool) {
        match self.labels().partner(block.0, true, to_else) {
            Some(end) => self.jump(end as usize + 1),
            None => self.unbalanced(span),
        }
    }

    /// Goes back to the beginning of the structure, or `beyond` it.
    fn back(&mut self, block: BlockId, span: Span, beyond: usize) {
        match self.labels().partner(block.0, false, false) {
            Some(start) => self.jump(start as usize + beyond),
            None => self.unbalanced(span),
        }
    }

    fn unbalanced(&mut self, span: Span) {
        self.doubt(Doubt::UnknownValue, span);
        let text = "the other end of this structure is missing";
        self.say("nc::unbalanced", Severity::Error, span, text, "the rest of the program is not executed");
        self.flow.ended = true;
    }
}

/// The span up to a comment or the end of its line, without blanks at its end.
fn to_comment(span: Span, text: &[u8]) -> Span {
    let bytes = span.of(text);
    let end = bytes.iter().position(|byte| matches!(byte, b';' | b'\n' | b'\r')).unwrap_or(bytes.len());
    let length = bytes[..end].trim_ascii_end().len();
    Span { start: span.start, end: span.start + length as u32 }
}
