//! The words of one block. In: its tokens. Out: a value and a place for each letter, and the G and M codes in order.

use crate::diag::Span;
use crate::nc::token::{Token, TokenKind};

/// Code of a G or M word times ten (G38.2 → 382) and its place.
pub type Code = (u16, Span);

/// Words of a block. Letters count from A = 0.
#[derive(Debug, Clone, Default)]
pub struct Words {
    present: u32,
    computed: u32,
    /// Incremental and absolute whatever G90/G91 says (IX, IC, AC).
    incremental: u32,
    absolute: u32,
    values: [f64; 26],
    spans: [Span; 26],
    /// G codes in order.
    pub g: Vec<Code>,
    /// M codes in order.
    pub m: Vec<Code>,
    /// Begins with `/`.
    pub delete: bool,
    /// Number of that block-delete switch, 1 to 9.
    pub switch: u8,
    /// It holds more than words (flow control, an assignment, a call), which its family reads from the text.
    pub beyond: bool,
    /// Something is in it besides blanks and comments.
    pub any: bool,
    /// Tokens that could not be read.
    pub bad: Vec<(TokenKind, Span)>,
    /// A letter that stands in the block twice, with the place of the second.
    pub repeated: Option<(u8, Span)>,
    /// Values of the expressions in it, by place.
    pub results: Vec<(Span, f64)>,
    /// Places of the names that were called.
    pub called: Vec<Span>,
}

fn index(letter: u8) -> usize {
    usize::from(letter - b'A') % 26
}

impl Words {
    /// Empties it for the next block.
    pub fn clear(&mut self) {
        self.present = 0;
        self.computed = 0;
        self.incremental = 0;
        self.absolute = 0;
        self.g.clear();
        self.m.clear();
        self.delete = false;
        self.beyond = false;
        self.any = false;
        self.bad.clear();
        self.repeated = None;
        self.results.clear();
        self.called.clear();
    }
    /// Removes all words, after they have taken effect.
    pub fn settle(&mut self) {
        self.present = 0;
        self.g.clear();
        self.m.clear();
        self.repeated = None;
    }
    /// Puts a word in.
    pub fn put(&mut self, letter: u8, value: f64, span: Span, computed: bool) {
        self.any = true;
        match letter {
            b'G' => self.g.push((code(value), span)),
            b'M' => {
                self.m.push((code(value), span));
                self.values[index(letter)] = value;
            }
            _ => {
                let bit = 1 << index(letter);
                if self.present & bit != 0 {
                    self.repeated = Some((letter, span));
                }
                self.present |= bit;
                self.computed |= if computed { bit } else { 0 };
                self.values[index(letter)] = value;
                self.spans[index(letter)] = span;
            }
        }
    }
    /// Takes a word out again.
    pub fn remove(&mut self, letter: u8) {
        self.present &= !(1 << index(letter));
    }
    /// Marks a word as incremental (true) or absolute (false), whatever G90/G91 says.
    pub fn force(&mut self, letter: u8, incremental: bool) {
        let bit = 1 << index(letter);
        if incremental {
            self.incremental |= bit;
        } else {
            self.absolute |= bit;
        }
    }
    /// Is it incremental by itself?
    pub fn is_incremental(&self, letter: u8) -> bool {
        self.incremental & (1 << index(letter)) != 0
    }
    /// Is it absolute by itself?
    pub fn is_absolute(&self, letter: u8) -> bool {
        self.absolute & (1 << index(letter)) != 0
    }
    /// Puts a token in that needs no evaluation; `false` for one that does.
    #[inline]
    pub fn take(&mut self, token: Token) -> bool {
        match token.kind {
            TokenKind::Blank | TokenKind::LineEnd | TokenKind::Comment => {}
            TokenKind::Word(b'O') => {
                self.beyond = true;
                self.put(b'O', token.number, token.span, false);
            }
            TokenKind::Word(letter) if letter >= 0x80 => {
                self.put(letter & 0x5f, token.number, token.span, false);
                self.force(letter & 0x5f, true);
            }
            // `$6`, `_6`: a sign before a number is no word.
            TokenKind::Word(letter) if !letter.is_ascii_alphabetic() => self.bad.push((token.kind, token.span)),
            TokenKind::Word(letter) => self.put(letter, token.number, token.span, false),
            TokenKind::Delete => {
                self.delete = true;
                // `/` alone is `/1`; only a digit fits between the sign and the block.
                self.switch = token.number.max(1.0) as u8;
            }
            TokenKind::Bad | TokenKind::OpenComment => self.bad.push((token.kind, token.span)),
            TokenKind::Percent => self.beyond = true,
            _ => return false,
        }
        true
    }
    /// Is this letter there?
    #[inline]
    pub fn has(&self, letter: u8) -> bool {
        self.present & (1 << index(letter)) != 0
    }
    /// Is any of these letters there?
    #[inline]
    pub fn has_any(&self, letters: &[u8]) -> bool {
        letters.iter().any(|&letter| self.has(letter))
    }
    /// Value of a letter.
    #[inline]
    pub fn get(&self, letter: u8) -> Option<f64> {
        self.has(letter).then(|| self.values[index(letter)])
    }
    /// Number of the last M word, whatever code it is.
    pub fn m_value(&self) -> Option<f64> {
        (!self.m.is_empty()).then_some(self.values[index(b'M')])
    }
    /// Place of a letter's word.
    pub fn span(&self, letter: u8) -> Option<Span> {
        self.has(letter).then(|| self.spans[index(letter)])
    }
    /// Is its value the result of an expression?
    pub fn is_computed(&self, letter: u8) -> bool {
        self.computed & (1 << index(letter)) != 0
    }
    /// Does it hold this G code (times ten)?
    pub fn has_g(&self, code: u16) -> bool {
        self.g.iter().any(|g| g.0 == code)
    }
    /// Does it hold this M code (times ten)?
    pub fn has_m(&self, code: u16) -> bool {
        self.m.iter().any(|m| m.0 == code)
    }
}

/// Rounding of a number with one decimal and of its product with ten, relative: one unit in the last place each, and as much again.
const ROUNDED: f64 = 4.0 * f64::EPSILON;

/// A G or M number times ten; numbers no control has become 65535, and so do those that only come near one (`G70.0000001`).
fn code(value: f64) -> u16 {
    let tenfold = (value * 10.0).round();
    let exact = (value * 10.0 - tenfold).abs() <= ROUNDED * tenfold;
    if (0.0..65535.0).contains(&tenfold) && exact { tenfold as u16 } else { u16::MAX }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every code with one decimal as it is read from text, and what is written just beside it.
    #[test]
    fn a_code_is_exact() {
        for tenfold in 0..20_000_u16 {
            let text = format!("{}.{}", tenfold / 10, tenfold % 10);
            assert_eq!(code(crate::nc::number::decimal(text.as_bytes()).unwrap().0), tenfold, "{text}");
            for beside in [format!("{text}0000001"), format!("{text}000000001"), format!("{text}5")] {
                assert_eq!(code(crate::nc::number::decimal(beside.as_bytes()).unwrap().0), u16::MAX, "{beside}");
            }
        }
        assert_eq!([code(59.0 + 0.1), code(-0.0), code(-1.0), code(1e9)], [591, 0, u16::MAX, u16::MAX]);
    }
}
