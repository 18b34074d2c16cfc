//! Engagement between the ends of a spot. In: spots with their engagement, a time. Out: spots with weights.
//!
//! Of a spot the mean removal area m is known, and from its arcs the removal area at its most engaged end. At the joint
//! of two spots of a move the removal area is the smaller of these two values: s₀ at the start and s₁ at the end of the
//! spot. Between them it is s₀ + (s₁ − s₀)·τ^q over the share τ of the length, with q such that the mean is m. A round
//! tool enters a wall, or breaks through it, with its foremost point, so that the removal area changes fastest at
//! first.

use crate::force::contact::Engaged;
use crate::learn::dataset::placed_log::PlacedLog;
use crate::learn::program::timeline::Activity;

/// Largest q, and 1/q. Judgement.
const STEEPEST: f64 = 5.0;
/// Least relative change of the removal area.
const CHANGE: f64 = 0.02;
/// Largest z component of the direction of a level move.
const LEVEL: f64 = 0.02;

/// A spot, and removal area at an end, mm², that its arcs stand for.
type End = (usize, f64);

impl PlacedLog<'_> {
    /// Spots with weights whose weighted loads add up to that at a time, in the engagement `of` the spots. For a
    /// growing or shrinking cut the weights do not add up to 1.
    pub(in crate::learn) fn section_shares<'e>(
        &self,
        time_s: f64,
        of: &impl Fn(usize) -> &'e Engaged,
    ) -> [(usize, f64); 3] {
        let spots = &self.known.timeline.spots;
        let [own, beside] = self.spot_shares(time_s);
        let spot = &spots[own.0];
        let (mean, most) = (of(own.0).section_mm2, largest_section(of(own.0)));
        if spot.activity != Activity::Feed || spot.direction.z.abs() > LEVEL {
            return [own, beside, (own.0, 0.0)];
        }
        let alone = [(own.0, 1.0), (own.0, 0.0), (own.0, 0.0)];
        if most < 1e-9 || mean < 1e-9 {
            return alone;
        }
        let near = |k: usize| spots.get(k).filter(|s| s.move_id == spot.move_id).map(|_| (k, largest_section(of(k))));
        let sides = [near(own.0.wrapping_sub(1)), near(own.0 + 1)];
        let [from, to] = [0, 1].map(|side| end_section((own.0, most), mean, sides[side], sides[1 - side]));
        let over = ((time_s - spot.start_s) / (spot.end_s - spot.start_s).max(1e-9)).clamp(0.0, 1.0);
        let Some(late) = share_at_end([from.1, to.1], mean, over) else { return alone };
        let share = |(k, section): End, part: f64| (k, part * section / of(k).section_mm2.max(1e-9));
        [share(from, 1.0 - late), share(to, late), (own.0, 0.0)]
    }
}

/// Weight of the removal area at the end for the share `over` of the length: τ^q; `None` if the mean does not lie
/// between the ends.
fn share_at_end([from, to]: [f64; 2], mean: f64, over: f64) -> Option<f64> {
    let (low, high) = (from.min(to), from.max(to));
    let changes = mean > low && mean < high && high - low >= CHANGE * high;
    let q = ((to - from) / (mean - from) - 1.0).clamp(1.0 / STEEPEST, STEEPEST);
    changes.then(|| over.powf(q))
}

/// Removal area of the arcs of a spot, which are those of its most engaged place, mm².
fn largest_section(engaged: &Engaged) -> f64 {
    engaged.sectors.iter().map(|s| s[0]).sum()
}

/// Removal area at an end of a spot: the smaller of the two that meet there. At the first or last spot of a move:
/// 2·mean − most, if the other end is the most engaged one.
fn end_section((own, most): End, mean: f64, there: Option<End>, opposite: Option<End>) -> End {
    match (there, opposite) {
        (Some(there), _) if there.1 < most => there,
        (None, Some((_, other))) if other >= most => (own, (2.0 * mean - most).max(0.0)),
        _ => (own, most),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Width of cut of a mill of radius 1 whose foremost point is `u` beyond a wall.
    fn width(u: f64) -> f64 {
        2.0 * (1.0 - (1.0 - u).powi(2)).sqrt()
    }

    fn mean(of: impl Fn(f64) -> f64) -> f64 {
        (0..1000).map(|k| of((f64::from(k) + 0.5) / 1000.0)).sum::<f64>() / 1000.0
    }

    #[test]
    fn a_mill_that_enters_a_wall_or_breaks_through_one_is_met_between_the_ends_too() {
        for (begin, length) in [(0.0, 0.1), (0.0, 0.2), (0.1, 0.1), (0.3, 0.2)] {
            let entering = |t: f64| width(begin + t * length);
            let leaving = |t: f64| 2.0 - entering(t);
            for section in [&entering as &dyn Fn(f64) -> f64, &leaving] {
                let (ends, middle) = ([section(0.0), section(1.0)], mean(section));
                let at = |t: f64| ends[0] + (ends[1] - ends[0]) * share_at_end(ends, middle, t).unwrap();
                assert!((mean(at) - middle).abs() < 1e-3 * (ends[1] - ends[0]).abs());
                for t in [0.0, 0.05, 0.3, 0.7, 1.0] {
                    assert!((at(t) - section(t)).abs() < 0.02 * (ends[1] - ends[0]).abs(), "{begin} {length} {t}");
                }
            }
        }
        assert_eq!(share_at_end([1.0, 1.0], 1.0, 0.5), None);
        assert_eq!(share_at_end([1.0, 2.0], 2.5, 0.5), None);
    }
}
