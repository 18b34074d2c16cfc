//! What a station shares with those beside it. In: the pieces of rings that cut at a station, and at the one before or after it or at its very end. Out: the pieces
//! that cut at both.
//!
//! A station has all that is engaged anywhere on it. Where two edges cut at once, their forces may cancel in part, and where it is engaged less, with
//! one edge alone, the force may be larger: three straight teeth in arcs of 0–34° and 124–180° have a peak 6 % below that in 0–28° and
//! 130–180°. The place between two stations is on both, so what is engaged there is what they share;
//! on the way there it is anything between. Where a cut or a path begins or ends, it is what is engaged at that very place.

use super::rings::Rings;
use super::zone::{Piece, clip_to};
use std::f64::consts::TAU;

/// Steps from one station to what it shares with the next. Program 16624 of `tests/limits_hold.rs` is 2.2 % above its limit with one, 0.9 % with two and
/// with four.
const STEPS: usize = 2;

/// Does more than one edge cut at some rotation?
pub(super) fn several_cut(rings: &Rings, pieces: &[Piece]) -> bool {
    let lag = |piece: &Piece| rings.list[piece.slice].lag_rad;
    let first = pieces.iter().map(|piece| piece.angle[0] + lag(piece)).fold(f64::INFINITY, f64::min);
    let last = pieces.iter().map(|piece| piece.angle[1] + lag(piece)).fold(f64::NEG_INFINITY, f64::max);
    // Teeth of uneven pitch count as even ones do: about a pitch is what matters.
    last - first > TAU / rings.flutes()
}

/// What cuts on the way from a station to the place that it shares with the one beside it, both sorted by slice: the last of these is what they
/// share. Empty where that is nothing, or all of the first.
///
/// The ends of the arcs move towards those shared, and where material opens in the middle of an arc, they move apart from the middle of the gap.
/// The largest force may lie between: two teeth in arcs of 0–22° and 133–180° bear most where these have shrunk to 120° apart, and one has just
/// left as the other enters.
pub(super) fn on_the_way(own: &[Piece], beside: &[Piece]) -> Vec<Vec<Piece>> {
    let mut steps = vec![Vec::new(); STEPS];
    let (mut from, mut less) = (0, false);
    for piece in own {
        from += beside[from..].partition_point(|other| other.slice < piece.slice);
        let same = beside[from..].iter().take_while(|other| other.slice == piece.slice);
        let mut shared: Vec<Piece> = same.filter_map(|other| clip_to(piece, other.angle)).collect();
        shared.sort_by(|a, b| a.angle[0].total_cmp(&b.angle[0]));
        less |= shared.len() != 1 || shared[0].angle != piece.angle;
        for (i, part) in shared.iter().enumerate() {
            let before = i.checked_sub(1).map_or(piece.angle[0], |b| 0.5 * (shared[b].angle[1] + part.angle[0]));
            let after = shared.get(i + 1).map_or(piece.angle[1], |a| 0.5 * (part.angle[1] + a.angle[0]));
            for (step, pieces) in steps.iter_mut().enumerate() {
                let share = (step + 1) as f64 / STEPS as f64;
                let towards = |whole: f64, end: f64| whole + share * (end - whole);
                let angle = [towards(before, part.angle[0]), towards(after, part.angle[1])];
                pieces.extend(clip_to(piece, angle));
            }
        }
    }
    if less && !steps[STEPS - 1].is_empty() { steps } else { Vec::new() }
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

    fn angles(pieces: &[Piece]) -> Vec<(usize, [f64; 2])> {
        pieces.iter().map(|piece| (piece.slice, piece.angle)).collect()
    }

    fn shared(own: &[Piece], beside: &[Piece]) -> Option<Vec<(usize, [f64; 2])>> {
        on_the_way(own, beside).last().map(|last| angles(last))
    }

    /// Two arcs that both stations have in part; a ring that only one has.
    #[test]
    fn what_both_have_is_shared() {
        let own = pieces(&[(0, [0.0, 0.6]), (0, [2.2, 3.1]), (1, [1.0, 2.0])]);
        let next = pieces(&[(0, [0.0, 0.4]), (0, [2.4, 3.1])]);
        assert_eq!(shared(&own, &next).unwrap(), [(0, [0.0, 0.4]), (0, [2.4, 3.1])]);
        assert_eq!(shared(&next, &pieces(&[(0, [0.3, 2.5])])).unwrap(), [(0, [0.3, 0.4]), (0, [2.4, 2.5])]);
    }

    /// All of the first, or nothing, is no part of it.
    #[test]
    fn all_or_nothing_is_no_part() {
        let own = pieces(&[(0, [0.5, 1.0]), (1, [0.5, 1.0])]);
        assert!(shared(&own, &own).is_none());
        assert!(shared(&own, &pieces(&[(0, [0.0, 2.0]), (1, [0.4, 1.0]), (2, [0.0, 1.0])])).is_none());
        assert!(shared(&own, &pieces(&[(0, [1.5, 2.0]), (2, [0.5, 1.0])])).is_none());
    }

    /// Arcs shrink in even steps; a slot that opens in the middle opens from there, and its two parts never overlap.
    #[test]
    fn ends_move_in_even_steps() {
        let own = pieces(&[(0, [0.0, 0.8]), (1, [0.0, 3.0])]);
        let next = pieces(&[(0, [0.4, 0.8]), (1, [0.0, 0.4]), (1, [2.4, 3.0])]);
        let steps = on_the_way(&own, &next);
        assert_eq!(steps.len(), STEPS);
        let half = angles(&steps[STEPS / 2 - 1]);
        let expected = [(0, [0.2, 0.8]), (1, [0.0, 0.9]), (1, [1.9, 3.0])];
        for ((slice, angle), (of, wanted)) in half.into_iter().zip(expected) {
            assert_eq!(slice, of);
            assert!((angle[0] - wanted[0]).abs() + (angle[1] - wanted[1]).abs() < 1e-12, "{angle:?} {wanted:?}");
        }
    }
}
