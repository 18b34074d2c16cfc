//! F words. In: [`FeedSegment`]s with caps and reachable speeds. Out: one commanded feed per segment, a number that the program's F words can
//! carry, never above a cap.
//!
//! A dynamic program over the segments chooses for each either the feed that the text gives it or one of the levels. Levels are caps of
//! segments, chosen so that every cap has a level close below it. The cost is in seconds: a segment at feed F takes length / min(F, speed);
//! staying at the last feed is free, putting in or changing an F word costs the price of a word, a change inside a block or restating a feed
//! costs the price of a block. So a word is written exactly where it saves more seconds than its price. A segment may not take a level
//! above its cap; a level below its floor costs more than any word saves, so that a minimum gives way only where the cap leaves no other
//! level. Consecutive segments of one level then get the largest F number below all their caps.
//!
//! A feed of the text may lie up to [`SLACK`](super::feed_segments::SLACK) above a load's cap, and a rise smaller than `minimum_change` saves
//! nothing here. So optimising an optimised program changes nothing, although its stations lie at other places.

use rayon::prelude::*;

use super::feed_segments::FeedSegment;
use crate::numeric::bisect_ratio;

/// Most levels: each takes one bit of [`Step::stays`].
const LEVELS: usize = 128;
/// Caps whose ratio is below this always share a level.
const FINEST: f64 = 1.0005;

/// Cost of a segment below its floor, s: more than all words of a program together.
const BELOW_S: f64 = 1e7;
/// Stands among the numbers of levels for the feed of the text.
const TEXT: u8 = u8::MAX;

/// The F numbers a program may carry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Feed of F1, mm/s.
    pub unit_mm_s: f64,
    /// Most decimals.
    pub decimals: u32,
}

impl Grid {
    /// Largest number of the grid that is not above the feed; a feed below the grid stays as it is. Numbers carry four
    /// significant digits, so that rounding costs less than 0.1 %.
    pub fn below(&self, feed_mm_s: f64) -> f64 {
        let number = feed_mm_s / self.unit_mm_s;
        let step = self.step(number);
        let rounded = (number / step * (1.0 + 1e-12)).floor() * step;
        if rounded > 0.0 { rounded * self.unit_mm_s } else { feed_mm_s }
    }

    fn step(&self, number: f64) -> f64 {
        let finest = -(self.decimals as i32);
        let digits = if number > 0.0 { number.log10().floor() as i32 - 3 } else { finest };
        10f64.powi(digits.max(finest))
    }
}

/// What an F word costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Costs {
    /// An F word put into a block, or changed there, s.
    pub word_s: f64,
    /// A new block with its F word: a split, or a line that restates a feed, s.
    pub split_s: f64,
    /// Relative rise worth an F word.
    pub minimum_change: f64,
}

/// Feed of each segment, mm/s. `carries(i)`: segment i begins a block that has its own F word.
pub fn choose(
    segments: &[FeedSegment],
    grid: &Grid,
    costs: &Costs,
    carries: &(dyn Fn(usize) -> bool + Sync),
) -> Vec<f64> {
    let mut feeds: Vec<f64> = segments.iter().map(|segment| segment.programmed_mm_s).collect();
    let mut start = 0;
    while start < segments.len() {
        if !segments[start].free {
            start += 1;
            continue;
        }
        let end = (start..segments.len()).find(|&i| !segments[i].free).unwrap_or(segments.len());
        let run = FreeRun { segments: &segments[start..end], costs, carries: &|i| carries(start + i) };
        let restated = end < segments.len() && !carries(end);
        let levels = run.best_levels(restated);
        settle(run.segments, &levels, grid, &mut feeds[start..end]);
        start = end;
    }
    feeds
}

/// A run of free segments.
struct FreeRun<'a> {
    segments: &'a [FeedSegment],
    costs: &'a Costs,
    carries: &'a dyn Fn(usize) -> bool,
}

/// For each level that one segment may have, what the segment before it has on the cheapest way there.
struct Step {
    /// One bit for each level: the segment before has the same level.
    stays: u128,
    /// The level of the segment before, for all levels whose bit is not set.
    change: u8,
    /// The level of the segment before, if this one has the feed of the text.
    text: u8,
}

impl FreeRun<'_> {
    /// Price of changing the feed at segment i, s; 0 where the block carries an F word anyway, which [`Self::advance`] charges whatever the
    /// word says.
    fn change_s(&self, i: usize, carries: bool) -> f64 {
        if carries {
            0.0
        } else if self.segments[i].from_mm > 0.0 {
            self.costs.split_s
        } else {
            self.costs.word_s
        }
    }

    /// The level of each segment, or [`TEXT`]. `restated`: after the last segment the feed of the text has to be in force again.
    fn best_levels(&self, restated: bool) -> Vec<u8> {
        let feed = levels(self.segments);
        let mut cost = vec![f64::INFINITY; feed.len()];
        let mut text_s = 0.0;
        let mut steps: Vec<Step> = Vec::with_capacity(self.segments.len());
        for (i, segment) in self.segments.iter().enumerate() {
            let carries = (self.carries)(i);
            let price = self.change_s(i, carries);
            let best = least(&cost);
            let (before, from) = if text_s <= cost[best] { (text_s, TEXT) } else { (cost[best], best as u8) };
            let text = if text_s <= cost[best] + price { TEXT } else { best as u8 };
            text_s = text_s.min(cost[best] + price) + segment.text_s();
            let stays = self.advance(segment, &feed, before + price, &mut cost, carries);
            steps.push(Step { stays, change: from, text });
        }
        let best = least(&cost);
        let back_s = if restated { self.costs.split_s } else { 0.0 };
        let mut state = if text_s <= cost[best] + back_s { TEXT } else { best as u8 };
        let mut states = vec![0; self.segments.len()];
        for (at, step) in states.iter_mut().zip(&steps).rev() {
            *at = state;
            if state == TEXT {
                state = step.text;
            } else if step.stays >> state & 1 == 0 {
                state = step.change;
            }
        }
        states
    }

    /// Carries the costs of all levels over one segment, where changing the level costs `change`. Returns a bit for each level that is
    /// cheapest to stay at.
    fn advance(&self, segment: &FeedSegment, feed: &[f64], change: f64, cost: &mut [f64], carries: bool) -> u128 {
        let top = feed.partition_point(|&feed| feed <= segment.cap.feed_mm_s * (1.0 + 1e-9)).max(1) - 1;
        let (open, closed) = cost.split_at_mut(top + 1);
        closed.fill(f64::INFINITY);
        let low = feed.partition_point(|&feed| feed < segment.lowest_mm_s() * (1.0 - 1e-9)).min(open.len() - 1);
        let bits = |part: &[f64]| part.iter().rev().fold(0u32, |bits, cost| bits << 1 | u32::from(*cost <= change));
        let stays = open.chunks(32).rev().fold(0u128, |stay, part| stay << 32 | u128::from(bits(part)));
        let word_s = if carries { self.costs.word_s } else { 0.0 };
        for (cost, feed) in open.iter_mut().zip(feed) {
            let kept = if *cost <= change { *cost } else { change };
            *cost = kept + word_s + segment.time_s(*feed);
        }
        for cost in &mut open[..low] {
            *cost += BELOW_S;
        }
        // A rise that is too small to count takes the time of the text.
        let there = segment.programmed_mm_s;
        if segment.text_s() < BELOW_S {
            let first = feed.partition_point(|&feed| feed <= there);
            let small = feed.partition_point(|&feed| feed <= there * (1.0 + self.costs.minimum_change)).min(open.len());
            for k in first..small {
                open[k] += segment.time_s(there) - segment.time_s(feed[k]);
            }
        }
        stays
    }
}

/// Feeds of the levels: caps, each the lowest of those within one ratio above it; the ratio is the least that leaves no more
/// than [`LEVELS`].
fn levels(segments: &[FeedSegment]) -> Vec<f64> {
    let mut caps: Vec<f64> = segments.iter().map(|segment| segment.cap.feed_mm_s).collect();
    caps.par_sort_unstable_by(f64::total_cmp);
    let (low, high) = (caps[0], caps[caps.len() - 1]);
    let spaced = |ratio: f64| {
        let mut levels: Vec<f64> = Vec::new();
        for &cap in &caps {
            if levels.len() <= LEVELS && levels.last().is_none_or(|level| cap > level * ratio) {
                levels.push(cap);
            }
        }
        levels
    };
    let widest = (high / low).max(FINEST).powf(1.0 / (LEVELS - 1) as f64);
    if spaced(FINEST).len() <= LEVELS {
        return spaced(FINEST);
    }
    spaced(bisect_ratio(|ratio| spaced(ratio).len() > LEVELS, FINEST, widest, 20)[1])
}

/// The cheapest level; among equals the highest.
fn least(cost: &[f64]) -> usize {
    let lesser = |a: f64, b: f64| if b < a { b } else { a };
    let (fours, rest) = cost.as_chunks::<4>();
    let lanes = fours.iter().fold([f64::INFINITY; 4], |least, four| [0, 1, 2, 3].map(|k| lesser(least[k], four[k])));
    let least = rest.iter().chain(&lanes).copied().fold(f64::INFINITY, lesser);
    cost.iter().rposition(|&cost| cost == least).unwrap_or(0)
}

/// Feeds of the runs of one level.
fn settle(segments: &[FeedSegment], levels: &[u8], grid: &Grid, feeds: &mut [f64]) {
    let mut start = 0;
    while start < segments.len() {
        let end = (start..segments.len()).find(|&i| levels[i] != levels[start]).unwrap_or(segments.len());
        if levels[start] != TEXT {
            let caps = segments[start..end].iter().map(|segment| segment.cap.feed_mm_s);
            feeds[start..end].fill(grid.below(caps.fold(f64::INFINITY, f64::min)));
        }
        start = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::MoveId;
    use crate::machine::LimitKind;
    use crate::schedule::problem::Bound;

    #[test]
    fn rounds_down_to_four_digits() {
        let grid = Grid { unit_mm_s: 1.0 / 60.0, decimals: 1 };
        let below = |number: f64| (grid.below(number / 60.0) * 60.0 * 1e6).round() / 1e6;
        assert_eq!([below(12345.6), below(1234.56), below(123.456), below(9.99)], [12340.0, 1234.0, 123.4, 9.9]);
        assert_eq!([below(1200.0), below(0.04)], [1200.0, 0.04]);
    }

    fn segment(index: u32, cap: f64) -> FeedSegment {
        let cap = Bound { feed_mm_s: cap, kind: LimitKind::Power, per_unit: 0.0 };
        let (from_mm, to_mm) = (0.0, 1.0);
        let (floor_mm_s, speed_mm_s, programmed_mm_s) = (0.0, 1e9, 7.77);
        FeedSegment {
            move_id: MoveId(index),
            from_mm,
            to_mm,
            cap,
            floor_mm_s,
            speed_mm_s,
            programmed_mm_s,
            free: true,
            splittable: true,
        }
    }

    #[test]
    fn no_word_is_spent_where_the_machine_does_not_get_so_fast() {
        let mut segments: Vec<FeedSegment> =
            (0..40).map(|i| segment(i, if i % 2 == 0 { 50.0 } else { 60.0 })).collect();
        let costs = Costs { word_s: 1e-4, split_s: 1e-4, minimum_change: 0.0 };
        let words = |segments: &[FeedSegment]| {
            let feeds = choose(segments, &Grid { unit_mm_s: 1e-6, decimals: 0 }, &costs, &|_| false);
            feeds.windows(2).filter(|pair| pair[0] != pair[1]).count()
        };
        assert_eq!(words(&segments), 39);
        for segment in &mut segments {
            segment.speed_mm_s = 45.0;
        }
        assert_eq!(words(&segments), 0);
    }

    #[test]
    fn a_floor_holds_unless_a_load_lies_below_it() {
        let grid = Grid { unit_mm_s: 1e-6, decimals: 0 };
        let costs = Costs { word_s: 1.0, split_s: 1.0, minimum_change: 0.0 };
        let feeds = |kind: LimitKind, cap: f64, floor: f64| {
            let mut segments = vec![segment(0, 10.0), segment(1, cap), segment(2, 10.0)];
            (segments[1].cap.kind, segments[1].floor_mm_s) = (kind, floor);
            for segment in &mut segments {
                segment.programmed_mm_s = 10.0;
            }
            choose(&segments, &grid, &costs, &|_| false)
        };
        let same = |found: &[f64], wanted: [f64; 3]| found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-3);
        // A word costs more than the time it saves; a minimum asks for it all the same.
        assert!(same(&feeds(LimitKind::Power, 12.0, 0.0), [10.0; 3]));
        assert!(same(&feeds(LimitKind::Power, 12.0, 11.0), [10.0, 12.0, 10.0]));
        assert!(same(&feeds(LimitKind::FeedChange, 12.0, 12.0), [10.0, 12.0, 10.0]));
        assert!(same(&feeds(LimitKind::Power, 12.0, 12.0), [10.0; 3]));
    }

    /// Least cost over all 2ⁿ⁻¹ ways to cut a run of n segments into pieces, each at its least cap.
    fn brute(segments: &[FeedSegment], word_s: f64) -> f64 {
        (0..1u32 << (segments.len() - 1))
            .map(|cuts| {
                let mut cost = 0.0;
                let mut start = 0;
                for end in 1..=segments.len() {
                    if end == segments.len() || cuts >> (end - 1) & 1 == 1 {
                        let cap = segments[start..end]
                            .iter()
                            .map(|segment| segment.cap.feed_mm_s)
                            .fold(f64::INFINITY, f64::min);
                        cost += segments[start..end].iter().map(|segment| segment.time_s(cap)).sum::<f64>();
                        cost += if start > 0 { word_s } else { 0.0 };
                        start = end;
                    }
                }
                cost
            })
            .fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn is_as_good_as_every_way_to_cut() {
        let caps = [20.0, 22.0, 55.0, 50.0, 12.0, 13.0, 60.0, 58.0, 40.0, 10.0];
        let slow = |(i, &cap): (usize, &f64)| FeedSegment { programmed_mm_s: 0.1, ..segment(i as u32, cap) };
        let segments: Vec<FeedSegment> = caps.iter().enumerate().map(slow).collect();
        for word_s in [0.0, 0.005, 0.02, 0.1] {
            let costs = Costs { word_s, split_s: word_s, minimum_change: 0.0 };
            let feeds = choose(&segments, &Grid { unit_mm_s: 1e-6, decimals: 0 }, &costs, &|_| false);
            let words = feeds.windows(2).filter(|pair| pair[0] != pair[1]).count() as f64;
            let cost =
                segments.iter().zip(&feeds).map(|(segment, &feed)| segment.time_s(feed)).sum::<f64>() + words * word_s;
            assert!(segments.iter().zip(&feeds).all(|(segment, &feed)| feed <= segment.cap.feed_mm_s));
            assert!(cost <= brute(&segments, word_s) * 1.01, "{word_s}: {cost} {}", brute(&segments, word_s));
        }
    }

    /// A feed is changed exactly where that saves more seconds than its price.
    #[test]
    fn a_word_is_worth_what_it_saves() {
        let grid = Grid { unit_mm_s: 1e-6, decimals: 0 };
        let costs = Costs { word_s: 0.002, split_s: 0.005, minimum_change: 0.01 };
        // 1 mm at 7.77 mm/s and at another feed: what is saved, s.
        let saved_s = |cap: f64| 1.0 / 7.77 - 1.0 / cap;
        let changes = |cap: f64, from_mm: f64, carries: bool| {
            let (mut last, mut inner) = (segment(0, 7.77), segment(1, cap));
            (last.programmed_mm_s, inner.programmed_mm_s, inner.from_mm, inner.to_mm) =
                (7.77, 7.77, from_mm, from_mm + 1.0);
            (last.cap.kind, last.move_id) = (LimitKind::Programmed, MoveId(0));
            choose(&[last, inner], &grid, &costs, &|i| i == 1 && carries)[1] > 7.8
        };
        assert!(saved_s(7.88) < 0.002 && saved_s(7.91) > 0.002 && saved_s(8.05) < 0.005 && saved_s(8.10) > 0.005);
        assert_eq!([7.88, 7.91].map(|cap| changes(cap, 0.0, false)), [false, true]);
        assert_eq!([7.88, 7.91].map(|cap| changes(cap, 0.0, true)), [false, true]);
        assert_eq!([8.05, 8.10].map(|cap| changes(cap, 1.0, false)), [false, true]);
    }

    /// The feed of the text stays a little above the cap of a load (two simulations of one path differ by so much), not above
    /// what was asked for in so many words; and a rise below the minimum is not made, however long the way.
    #[test]
    fn a_feed_that_is_near_enough_stays() {
        let grid = Grid { unit_mm_s: 1e-6, decimals: 0 };
        let costs = Costs { word_s: 0.002, split_s: 0.005, minimum_change: 0.01 };
        let stays = |cap: f64, kind: LimitKind| {
            let mut long = FeedSegment { to_mm: 1000.0, ..segment(0, cap) };
            long.cap.kind = kind;
            choose(&[long], &grid, &costs, &|_| true)[0] == 7.77
        };
        assert!(stays(7.77 / 1.0049, LimitKind::Power) && !stays(7.77 / 1.0051, LimitKind::Power));
        assert!(!stays(7.77 / 1.0049, LimitKind::Feed) && stays(7.77, LimitKind::Feed));
        assert!(stays(7.77 * 1.0099, LimitKind::Power) && !stays(7.77 * 1.0101, LimitKind::Power));
    }
}
