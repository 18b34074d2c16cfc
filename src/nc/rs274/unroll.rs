//! Unrolling of RS274 text. In: a token of a block that is executed. Out: its plain text: O words, labels, assignments and calls are left out,
//! expressions are replaced by their values.

use super::comments;
use super::state::Rs274;
use crate::nc::interp::unroll::{Executed, Plain, Record, number};
use crate::nc::token::{Token, TokenKind};

/// A token of a block in plain text.
pub(super) fn plain(executed: &Executed<'_, Rs274>, token: &Token, record: &Record) -> Plain {
    let words = executed.words;
    let call = words.m.iter().any(|m| [970, 980, 990].contains(&m.0)) && !(executed.own && words.has_m(990));
    let macro_call = words.has_g(650) || words.has_g(660);
    let dropped = match token.kind {
        TokenKind::Word(b'N') | TokenKind::Assignment | TokenKind::Routine => true,
        TokenKind::Word(b'O') => record.began && !(record.percent && record.text.len() < 4),
        TokenKind::Word(b'G') if token.number == 67.0 => true,
        TokenKind::Word(b'M') => call && [97.0, 98.0, 99.0].contains(&token.number),
        TokenKind::Word(b'P' | b'L') | TokenKind::Computed(b'P' | b'L') => call || macro_call,
        TokenKind::Word(_) | TokenKind::Computed(_) => macro_call,
        _ => false,
    };
    match token.kind {
        _ if dropped => Plain::Dropped,
        TokenKind::Comment => {
            match comments::with_values(executed.dialect(), executed.bytes(token), executed.parameters) {
                Ok(None) => Plain::Same,
                Ok(Some(text)) => Plain::Text(text),
                Err(()) => Plain::Unknown("a message with a variable that the program does not set"),
            }
        }
        TokenKind::Name => Plain::Unknown("a word that is not understood"),
        TokenKind::Computed(letter) => {
            let value = executed.result(token.span);
            let written = value.map(|value| number(letter, value, executed.dialect()));
            Plain::Text(written.map_or_else(Vec::new, |text| [&executed.bytes(token)[..1], text.as_bytes()].concat()))
        }
        _ => Plain::Same,
    }
}
