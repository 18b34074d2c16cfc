//! What a station shares with those beside it. In: the pieces of rings that cut at a station, and at the one before or after it. Out: the pieces
//! that cut at both.
//!
//! A station has all that is engaged anywhere on it. Where two edges cut at once, their forces may cancel in part, and where it is engaged less, with
//! one edge alone, the force may be larger: three straight teeth in arcs of 0–34° and 124–180° have a peak 6 % below that in 0–28° and
//! 130–180°. The place between two stations is on both, so what is engaged there is what they share.

use super::rings::Rings;
use super::zone::{Piece, clip_to};
use std::f64::consts::TAU;

/// Does more than one edge cut at some rotation?
pub(super) fn several_cut(rings: &Rings, pieces: &[Piece]) -> bool {
    let lag = |piece: &Piece| rings.list[piece.slice].lag_rad;
    let first = pieces.iter().map(|piece| piece.angle[0] + lag(piece)).fold(f64::INFINITY, f64::min);
    let last = pieces.iter().map(|piece| piece.angle[1] + lag(piece)).fold(f64::NEG_INFINITY, f64::max);
    // Teeth of uneven pitch count as even ones do: about a pitch is what matters.
    last - first > TAU / rings.flutes()
}

/// The pieces that two stations share, both sorted by slice; `None` where that is nothing, or all of the first.
pub(super) fn shared(own: &[Piece], beside: &[Piece]) -> Option<Vec<Piece>> {
    let mut shared = Vec::with_capacity(own.len());
    let (mut from, mut less) = (0, false);
    for piece in own {
        from += beside[from..].partition_point(|other| other.slice < piece.slice);
        let same = beside[from..].iter().take_while(|other| other.slice == piece.slice);
        let before = shared.len();
        shared.extend(same.filter_map(|other| clip_to(piece, other.angle)));
        less |= shared.len() != before + 1 || shared[before].angle != piece.angle;
    }
    (less && !shared.is_empty()).then_some(shared)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::zone::{Zone, clip};

    fn pieces(arcs: &[(usize, [f64; 2])]) -> Vec<Piece> {
        let mut out = Vec::new();
        for (slice, [entry, exit]) in arcs {
            clip(Zone::From(0.0), *slice, *entry, *exit, &mut out);
        }
        out
    }

    fn angles(pieces: Vec<Piece>) -> Vec<(usize, [f64; 2])> {
        pieces.into_iter().map(|piece| (piece.slice, piece.angle)).collect()
    }

    /// Two arcs that both stations have in part; a ring that only one has.
    #[test]
    fn what_both_have_is_shared() {
        let own = pieces(&[(0, [0.0, 0.6]), (0, [2.2, 3.1]), (1, [1.0, 2.0])]);
        let next = pieces(&[(0, [0.0, 0.4]), (0, [2.4, 3.1])]);
        assert_eq!(angles(shared(&own, &next).unwrap()), [(0, [0.0, 0.4]), (0, [2.4, 3.1])]);
        assert_eq!(angles(shared(&next, &pieces(&[(0, [0.3, 2.5])])).unwrap()), [(0, [0.3, 0.4]), (0, [2.4, 2.5])]);
    }

    /// All of the first, or nothing, is no part of it.
    #[test]
    fn all_or_nothing_is_no_part() {
        let own = pieces(&[(0, [0.5, 1.0]), (1, [0.5, 1.0])]);
        assert!(shared(&own, &own).is_none());
        assert!(shared(&own, &pieces(&[(0, [0.0, 2.0]), (1, [0.4, 1.0]), (2, [0.0, 1.0])])).is_none());
        assert!(shared(&own, &pieces(&[(0, [1.5, 2.0]), (2, [0.5, 1.0])])).is_none());
    }
}
