//! Unrolled blocks of RS274 text: O words, labels, assignments and calls are left out, values stand in place of expressions.

use super::comments;
use super::state::Rs274;
use crate::nc::interp::unroll::{Noted, Plain, Record, number};
use crate::nc::token::{Token, TokenKind};

/// A token of a block in plain text.
pub(super) fn plain(noted: &Noted<'_, Rs274>, token: &Token, record: &Record) -> Plain {
    let line = noted.line;
    let call = line.m.iter().any(|m| [970, 980, 990].contains(&m.0)) && !(noted.own && line.has_m(990));
    let macro_call = line.has_g(650) || line.has_g(660);
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
        TokenKind::Comment => match comments::with_values(noted.dialect(), noted.bytes(token), noted.parameters) {
            Ok(None) => Plain::Same,
            Ok(Some(text)) => Plain::Text(text),
            Err(()) => Plain::Unknown("a message with a variable that the program does not set"),
        },
        TokenKind::Name => Plain::Unknown("a word that is not understood"),
        TokenKind::Computed(letter) => {
            let value = noted.result(token.span);
            let written = value.map(|value| number(letter, value, noted.dialect()));
            Plain::Text(written.map_or_else(Vec::new, |text| [&noted.bytes(token)[..1], text.as_bytes()].concat()))
        }
        _ => Plain::Same,
    }
}
