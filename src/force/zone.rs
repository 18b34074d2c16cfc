//! The parts of a ring that cut. In: engaged arcs. Out: the pieces of them with a positive chip thickness, with their sines and cosines.
//!
//! With outward normal (n_r, n_z) and unit feed direction of horizontal part c = √(1 − t_z²) and vertical part t_z, the chip thickness per
//! feed per tooth is g(φ) = c n_r sin φ + t_z n_z. An engaged arc cuts only where g > 0.

use super::rings::C;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A stretch of one ring that cuts, with the trigonometry every integral over it needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// Index of the ring.
    pub slice: usize,
    /// Entry and exit, rad.
    pub angle: [f64; 2],
    /// Their sines.
    pub sin: [f64; 2],
    /// Their cosines.
    pub cos: [f64; 2],
}

impl Piece {
    /// J₀ = ∫ e^{−iφ} dφ and J₁ = ∫ sin φ e^{−iφ} dφ.
    pub(super) fn harmonics(&self) -> (C, C) {
        let length = self.angle[1] - self.angle[0];
        let ends = [C::new(self.cos[0], -self.sin[0]), C::new(self.cos[1], -self.sin[1])];
        let j0 = C::new(0.0, 1.0) * (ends[1] - ends[0]);
        let j1 = C::new(0.0, -0.5 * length) - (ends[1] * ends[1] - ends[0] * ends[0]) * 0.25;
        (j0, j1)
    }
    /// Length of the piece before φ = π/2 (up-milling) less that after it (climb), within one turn.
    pub(super) fn up_less_climb(&self) -> f64 {
        let [from, to] = self.angle.map(|angle| angle.clamp(0.0, PI) - FRAC_PI_2);
        from.min(0.0).abs() - to.min(0.0).abs() - (to.max(0.0) - from.max(0.0))
    }
}

/// Angles with g > 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Zone {
    Nowhere,
    Everywhere,
    /// Between `lo` and π − `lo` (modulo a turn).
    From(f64),
}

impl Zone {
    /// Of a ring with normal (`n_r`, `n_z`) under a feed with the unit direction (c, t_z).
    pub(super) fn of(n_r: f64, n_z: f64, [c, tangent_z]: [f64; 2]) -> Self {
        let swing = c * n_r.max(0.0);
        let base = tangent_z * n_z;
        if base.abs() < 1e-12 && swing > 1e-12 {
            return Zone::From(0.0);
        }
        if base - swing > -1e-12 && base > 1e-12 {
            return Zone::Everywhere;
        }
        if base + swing <= 1e-12 {
            return Zone::Nowhere;
        }
        Zone::From((-base / swing).clamp(-1.0, 1.0).asin())
    }
}

/// Appends what cuts of the arc from `entry` to `exit` on ring `slice`.
pub(super) fn clip(zone: Zone, slice: usize, entry: f64, exit: f64, out: &mut Vec<Piece>) {
    match zone {
        Zone::Nowhere => {}
        // Angles are rounded to f32: an arc within that rounding of a full turn is one.
        Zone::Everywhere if exit - entry > TAU - 2e-6 => push(slice, entry, entry + TAU, out),
        Zone::Everywhere => push(slice, entry, exit, out),
        Zone::From(lo) => {
            let (lo, hi) = (lo, PI - lo);
            // Mostly it is the zone of the first turn that is met, and no other.
            if entry <= hi && entry > hi - TAU && exit >= lo && exit < lo + TAU {
                push(slice, entry.max(lo), exit.min(hi), out);
                return;
            }
            let first = -floor((hi - entry) / TAU);
            let last = floor((exit - lo) / TAU);
            for turn in first..=last {
                let shift = turn as f64 * TAU;
                push(slice, entry.max(lo + shift), exit.min(hi + shift), out);
            }
        }
    }
}

/// The part of a piece within a stretch of angles.
pub(super) fn clip_to(piece: &Piece, [from, to]: [f64; 2]) -> Option<Piece> {
    let [entry, exit] = [piece.angle[0].max(from), piece.angle[1].min(to)];
    if [entry, exit] == piece.angle {
        return Some(*piece);
    }
    let mut part = Vec::with_capacity(1);
    push(piece.slice, entry, exit, &mut part);
    part.pop()
}

fn push(slice: usize, entry: f64, exit: f64, out: &mut Vec<Piece>) {
    if exit - entry <= 1e-9 {
        return;
    }
    // Rings of one tool mostly share their angles: the trigonometry of the last piece is used again.
    if let Some(last) = out.last().filter(|last| last.angle == [entry, exit]) {
        let same = Piece { slice, ..*last };
        out.push(same);
        return;
    }
    let ((s0, c0), (s1, c1)) = (entry.sin_cos(), exit.sin_cos());
    out.push(Piece { slice, angle: [entry, exit], sin: [s0, s1], cos: [c0, c1] });
}

/// Greatest whole number not above `x` (without the call that a baseline processor needs for `f64::floor`).
pub(super) fn floor(x: f64) -> i64 {
    let whole = x as i64;
    whole - i64::from((whole as f64) > x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pieces(n_r: f64, n_z: f64, tangent_z: f64, arc: [f64; 2]) -> Vec<[f64; 2]> {
        let mut out = Vec::new();
        let c = (1.0f64 - tangent_z * tangent_z).sqrt();
        clip(Zone::of(n_r, n_z, [c, tangent_z]), 0, arc[0], arc[1], &mut out);
        out.iter().map(|piece| piece.angle).collect()
    }

    #[test]
    fn only_the_leading_half_cuts_on_the_side_and_only_descending_cuts_on_the_bottom() {
        assert_eq!(pieces(1.0, 0.0, 0.0, [0.0, TAU]), [[0.0, PI]]);
        assert_eq!(pieces(1.0, 0.0, 0.0, [-0.5, 1.0]), [[0.0, 1.0]]);
        assert_eq!(pieces(1.0, 0.0, 0.0, [2.0, TAU + 1.0]), [[2.0, PI], [TAU, TAU + 1.0]]);
        assert!(pieces(0.0, -1.0, 0.0, [0.0, TAU]).is_empty());
        assert!(pieces(0.0, -1.0, 0.5, [0.0, TAU]).is_empty());
        assert_eq!(pieces(0.0, -1.0, -0.5, [0.0, TAU]), [[0.0, TAU]]);
        assert!(pieces(1.0, 0.0, -1.0, [0.0, TAU]).is_empty());
    }

    #[test]
    fn the_zone_is_where_the_chip_is_thick() {
        for (n_r, n_z, tz) in [(0.8, -0.6, -0.3), (0.8, -0.6, 0.3), (0.6, -0.8, -0.9), (0.3, -0.954, 0.2)] {
            let c = (1.0f64 - tz * tz).sqrt();
            let found = pieces(n_r, n_z, tz, [0.0, TAU]);
            for k in 0..1000 {
                let phi = k as f64 * TAU / 1000.0 + 1e-3;
                let g = c * n_r * phi.sin() + tz * n_z;
                let inside = found.iter().any(|[a, b]| (*a..*b).contains(&phi));
                assert!(g.abs() < 1e-2 || inside == (g > 0.0), "{n_r} {n_z} {tz} {phi}");
            }
        }
    }
}
