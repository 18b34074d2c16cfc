//! Values of expressions, and assignments. In: the text of an expression and the variables as they are. Out: its value, and a
//! doubt where that depends on a variable that only the control knows.

use super::interpreter::{Family, Interpreter};
use crate::diag::Span;
use crate::nc::doubt::Doubt;
use crate::nc::expr::{self, ExprError};
use crate::nc::token::{Token, TokenKind};

impl<F: Family> Interpreter<'_, F> {
    /// Value of an expression token; `None` with a diagnostic when it has none, and without one for a word whose variable is known
    /// to be vacant: the control leaves that word out (Fanuc B-64304EN, Custom macro, Undefined variable).
    pub(crate) fn value(&mut self, token: Token, text: &[u8]) -> Option<f64> {
        let bytes = token.span.of(text);
        let skip = match token.kind {
            TokenKind::Computed(letter) if letter >= 0x80 => 2,
            TokenKind::Computed(_) => 1,
            _ => 0,
        };
        let bytes = bytes[skip..].trim_ascii_start();
        let bytes = bytes.strip_prefix(b"=").unwrap_or(bytes);
        F::before_value(self, bytes);
        let word = matches!(token.kind, TokenKind::Computed(_));
        // A condition may well ask whether a local variable is vacant: #1 to the last; QL of plain language has a value or is a doubt.
        let decides = match token.kind {
            TokenKind::Computed(b'F' | b'N') => u32::MAX,
            TokenKind::Computed(_) => 0,
            _ if *self.dialect().locals.start() == 1 => *self.dialect().locals.end(),
            _ => 0,
        };
        let increment = match token.kind {
            TokenKind::Computed(letter) => self.least_increment(letter),
            _ => 1.0,
        };
        match self.evaluate_or_vacant(token.span, bytes, decides, increment) {
            Ok(value) if word => value,
            Ok(value) => Some(value.unwrap_or(0.0)),
            Err(error) => {
                self.bad_expression(token.span, &error);
                None
            }
        }
    }

    /// Value of an expression. Where it depends on a variable that the program did not set, numbered above `decides`, that is a
    /// doubt.
    pub(crate) fn evaluate(&mut self, place: Span, text: &[u8], decides: u32) -> Result<f64, ExprError> {
        Ok(self.evaluate_or_vacant(place, text, decides, 1.0)?.unwrap_or(0.0))
    }

    /// To what ROUND rounds in a word: the least input increment of its letter (Fanuc B-64304EN, Custom macro, ROUND function: IS-B, 0.001 mm or
    /// degrees, 0.0001 in), and 1 in every other language.
    fn least_increment(&self, letter: u8) -> f64 {
        let is_length = b"XYZUVWIJKRQ".contains(&letter.to_ascii_uppercase());
        match letter.to_ascii_uppercase() {
            _ if !self.dialect().macro_b => 1.0,
            _ if is_length && self.modal.inch => 1e-4,
            b'A' | b'B' | b'C' => 1e-3,
            _ if is_length => 1e-3,
            _ => 1.0,
        }
    }

    /// The same; `None`: it is a variable that is known to be vacant.
    fn evaluate_or_vacant(
        &mut self,
        place: Span,
        text: &[u8],
        decides: u32,
        increment: f64,
    ) -> Result<Option<f64>, ExprError> {
        self.parameters.take_unset();
        let value = expr::evaluate_word(text, &self.parameters, increment);
        let asked = self.doubt_unset_variables(place);
        if asked > decides {
            self.doubt(Doubt::UnknownValue, place);
        }
        Ok(value?.or((asked > 0).then_some(0.0)))
    }

    /// Diagnoses the variables just read that only the control knows: they last from program to program, belong to the control, or are left
    /// over from an earlier program. Returns the highest of their numbers as [`Family::unset_variable`] counts them, or 0.
    pub(crate) fn doubt_unset_variables(&mut self, place: Span) -> u32 {
        if self.parameters.take_feed_read() {
            // What the program makes of the feed that it reads may be anything.
            self.uses_feed();
        }
        let unset = self.parameters.take_unset();
        unset.into_iter().map(|number| F::unset_variable(self, number, place)).max().unwrap_or(0)
    }

    /// Puts the assignments of a block in force.
    pub(crate) fn apply_assignments(&mut self) {
        for (target, value) in std::mem::take(&mut self.block.assignments) {
            match target {
                expr::Target::Number(index) => {
                    self.sets_the_control(index);
                    F::sets_variable(self, index);
                    match value {
                        Some(value) => self.parameters.numbered.insert(index, value),
                        None => self.parameters.numbered.remove(&index),
                    };
                }
                expr::Target::Name(name) => self.parameters.set_name(&name, value.unwrap_or(0.0)),
            }
        }
    }

    pub(crate) fn bad_expression(&mut self, span: Span, error: &ExprError) {
        if matches!(error, ExprError::NotKnown(_)) {
            self.doubt(Doubt::UnknownValue, span);
            self.not_understood("nc::expression", span, error.to_string(), "the word is left out");
        } else {
            self.misread("nc::expression", span, error.to_string(), "the block is left as it is");
            if matches!(error, ExprError::Unknown(_) | ExprError::Ambiguous(_)) {
                self.doubt(Doubt::UnknownValue, span);
            }
        }
    }
}

/// What stands behind the `=` of an assignment.
pub(crate) fn right_of(assignment: &[u8]) -> &[u8] {
    memchr::memchr(b'=', assignment).map_or(b"", |equals| &assignment[equals + 1..])
}

/// Left side of an assignment, upper case.
pub(crate) fn left_of(assignment: &[u8]) -> String {
    let left = assignment.split(|&byte| byte == b'=').next().unwrap_or_default();
    String::from_utf8_lossy(left).trim().to_ascii_uppercase()
}
