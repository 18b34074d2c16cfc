//! What is cut at a place within a spot. In: spots with their engagement, a time. Out: spots with how much of each counts.
//!
//! Of a spot the mean section m is known, and the section at its most engaged end. Where two spots of a move meet, the section
//! is that of the lesser of their most engaged ends: s₀ before and s₁ after. Between them it goes as s₀ + (s₁ − s₀)·τ^q over
//! the share τ of the way, q such that the mean is m: a round tool that meets a wall, or breaks through one, does so with its
//! foremost point, and the section changes fastest at first.

use super::cells::Along;
use super::timeline::Doing;
use crate::force::contact::Engaged;

/// Steepest change, as q or 1/q.
const STEEPEST: f64 = 5.0;
/// Least part of a section that counts as a change.
const CHANGE: f64 = 0.02;
/// Most share of z in the direction of a level move.
const LEVEL: f64 = 0.02;

/// Section at an end of a spot, mm², and the spot whose arcs these are.
type End = (usize, f64);

impl Along<'_> {
    /// Spots whose cuts add up to that at a time, with how much of each, in the engagement `of` the spots. The shares of a cut
    /// that grows or shrinks do not add up to 1.
    pub(super) fn within<'e>(&self, time_s: f64, of: &impl Fn(usize) -> &'e Engaged) -> [(usize, f64); 3] {
        let spots = &self.known.timeline.spots;
        let [own, beside] = self.about(time_s);
        let spot = &spots[own.0];
        let (mean, most) = (of(own.0).section_mm2, most(of(own.0)));
        if spot.doing != Doing::Feed || spot.direction.z.abs() > LEVEL {
            return [own, beside, (own.0, 0.0)];
        }
        let alone = [(own.0, 1.0), (own.0, 0.0), (own.0, 0.0)];
        if most < 1e-9 || mean < 1e-9 {
            return alone;
        }
        let near = |k: usize| spots.get(k).filter(|s| s.move_id == spot.move_id).map(|_| (k, self::most(of(k))));
        let sides = [near(own.0.wrapping_sub(1)), near(own.0 + 1)];
        let [from, to] = [0, 1].map(|side| end((own.0, most), mean, sides[side], sides[1 - side]));
        let (low, high) = (from.1.min(to.1), from.1.max(to.1));
        if mean <= low || mean >= high || high - low < CHANGE * high {
            return alone;
        }
        let over = ((time_s - spot.start_s) / (spot.end_s - spot.start_s).max(1e-9)).clamp(0.0, 1.0);
        let q = ((to.1 - from.1) / (mean - from.1) - 1.0).clamp(1.0 / STEEPEST, STEEPEST);
        let late = over.powf(q);
        let share = |(k, section): End, part: f64| (k, part * section / of(k).section_mm2.max(1e-9));
        [share(from, 1.0 - late), share(to, late), (own.0, 0.0)]
    }
}

/// Section at the most engaged end, mm².
fn most(engaged: &Engaged) -> f64 {
    engaged.sectors.iter().map(|s| s[0]).sum()
}

/// Section at an end of a spot: the lesser of those that meet; where the move begins or ends, what the mean leaves if the
/// other end is the most engaged one.
fn end((own, most): End, mean: f64, there: Option<End>, opposite: Option<End>) -> End {
    match (there, opposite) {
        (Some(there), _) if there.1 < most => there,
        (None, Some((_, other))) if other >= most => (own, (2.0 * mean - most).max(0.0)),
        _ => (own, most),
    }
}
