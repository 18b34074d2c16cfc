//! Programmable frames of Siemens 840D: TRANS, ROT, SCALE, MIRROR set the frame anew, ATRANS, AROT, ASCALE, AMIRROR add to
//! it. In: the axis_words of a block. Out: shift, rotation and scale of the run's frame p ↦ R·S·p + t.
//!
//! An addition stands to the right: t += R·S·d, and R·S·A(a) is again of that form where S is one factor with or without
//! mirrored axes, for S·A(a) = A(±a)·S. What is not of that form freezes all feeds until the frame is set anew.

use super::state::Siemens;
use crate::diag::Span;
use crate::nc::interp::interpreter::Interpreter;
use crate::nc::interp::words::Words;
use crate::nc::token::{Token, TokenKind};
use crate::path::{Plane, Vec3};

/// What ends a frame that is not followed.
pub(crate) const ENDS_LOST_FRAME: &str = "TRANS, ROT, SCALE or MIRROR alone sets the frame anew";

impl Interpreter<'_, Siemens> {
    /// Executes a frame instruction; false when the word is none.
    pub(crate) fn frame_word(&mut self, word: &str, place: Span, tokens: &[Token], text: &[u8], words: &Words) -> bool {
        let (kind, adds) = match word.strip_prefix('A') {
            Some(kind) => (kind, true),
            None => (word, false),
        };
        if !["TRANS", "ROT", "SCALE", "MIRROR"].contains(&kind) {
            return false;
        }
        if !adds {
            self.frame.local = Vec3::zeros();
            (self.frame.rotation, self.frame.scale) = (None, None);
            self.regain_frame();
        }
        let axis_words = [b'X', b'Y', b'Z'].map(|letter| words.get(letter));
        let plain = match kind {
            "TRANS" => self.add_shift(axis_words),
            "ROT" => {
                let angle = self.plane_angle(tokens, text);
                self.add_rotation(axis_words, angle)
            }
            "SCALE" => self.add_scale(axis_words.map(|word| word.unwrap_or(1.0))),
            _ => self.add_scale(axis_words.map(|word| if word.is_some() { -1.0 } else { 1.0 })),
        };
        if !plain {
            self.lose_frame(place, &format!("this {word}"), ENDS_LOST_FRAME);
        }
        self.reframe();
        true
    }

    fn add_shift(&mut self, axis_words: [Option<f64>; 3]) -> bool {
        let unit = self.modal.unit_mm();
        let shift = Vec3::from_fn(|axis, _| axis_words[axis].unwrap_or(0.0) * unit);
        self.frame.local += self.frame.linear(shift);
        true
    }

    /// `RPL=angle`, deg.
    fn plane_angle(&mut self, tokens: &[Token], text: &[u8]) -> Option<f64> {
        let setting = |token: &Token| {
            let bytes = token.span.of(text);
            let equals = bytes.iter().position(|&byte| byte == b'=')?;
            let is_it =
                token.kind == TokenKind::Assignment && bytes[..equals].trim_ascii().eq_ignore_ascii_case(b"RPL");
            is_it.then(|| &bytes[equals + 1..])
        };
        let value = tokens.iter().find_map(setting)?;
        self.evaluate(tokens[0].span, value, 0).ok()
    }

    fn add_rotation(&mut self, axis_words: [Option<f64>; 3], in_plane: Option<f64>) -> bool {
        let planes = [Plane::Yz, Plane::Zx, Plane::Xy];
        let turned = (0..3).filter_map(|axis| axis_words[axis].map(|degrees| (planes[axis], degrees)));
        let mut turns = turned.filter(|(_, degrees)| *degrees != 0.0);
        let asked = in_plane.map(|degrees| (self.modal.plane, degrees)).or_else(|| turns.next());
        let Some((plane, degrees)) = asked else { return true };
        let before = self.frame.rotation.map_or(0.0, |(_, _, angle)| angle);
        let same = self.frame.rotation.is_none_or(|(turned, centre, _)| turned == plane && centre == Vec3::zeros());
        let (a, b, _) = plane.axes();
        let even = self.frame.scale.is_none_or(|(_, f)| (f[a].abs() - f[b].abs()).abs() < 1e-12);
        if degrees == 0.0 {
            return true;
        }
        let sign = if self.frame.mirrors(plane) { -1.0 } else { 1.0 };
        self.frame.rotation = Some((plane, Vec3::zeros(), before + sign * degrees.to_radians()));
        same && even && plane == self.modal.plane && turns.next().is_none()
    }

    fn add_scale(&mut self, factors: [f64; 3]) -> bool {
        let (centre, before) = self.frame.scale.unwrap_or((Vec3::zeros(), Vec3::repeat(1.0)));
        let factor = before.component_mul(&Vec3::from(factors));
        let sane = factor.iter().all(|f| *f != 0.0 && f.is_finite());
        if sane && factor != Vec3::repeat(1.0) {
            self.frame.scale = Some((centre, factor));
        }
        sane && centre == Vec3::zeros()
    }
}
