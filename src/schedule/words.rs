//! F words. In: [`Unit`]s with caps and reachable speeds. Out: one commanded feed per unit, on the grid of the program's F
//! words, never above a cap.
//!
//! A dynamic program over feed levels: levels are caps of the units, as many as keep every cap near one; staying at a level is free, a change costs the
//! price of an F word (less where the block carries one already), and a unit at level F takes length / min(F, speed).
//! Levels above the cap of a unit are closed to it; levels below its floor cost more than any word saves, unless it has no
//! other, so that a minimum gives way to a cap only. Runs of one level then get the largest F number below all their caps;
//! an F already there that lies between floors and caps and within `minimum_change` of that number stays, and a rise smaller
//! than `minimum_change` is not made.

use rayon::prelude::*;

use super::units::Unit;

/// Most levels: one bit each of the trace.
const LEVELS: usize = 128;
/// Ratio of caps that share a level at least.
const FINEST: f64 = 1.0005;

/// What a unit below its floor costs, s: more than all words of a program.
const BELOW_S: f64 = 1e7;

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
    /// A new F word at the beginning of a block, s.
    pub word_s: f64,
    /// A new block (a split) with its F word, s.
    pub split_s: f64,
    /// Relative rise worth an F word.
    pub minimum_change: f64,
}

/// Feed of each unit, mm/s. `carries(i)`: unit i begins a block that has its own F word.
pub fn choose(units: &[Unit], grid: &Grid, costs: &Costs, carries: &dyn Fn(usize) -> bool) -> Vec<f64> {
    let mut feeds: Vec<f64> = units.iter().map(|unit| unit.programmed_mm_s).collect();
    let mut start = 0;
    while start < units.len() {
        if !units[start].free {
            start += 1;
            continue;
        }
        let end = (start..units.len()).find(|&i| !units[i].free).unwrap_or(units.len());
        let run = &units[start..end];
        let levels = best_levels(run, &|i| change_price(run, i, costs, carries(start + i)));
        settle(run, &levels, grid, costs.minimum_change, &mut feeds[start..end]);
        start = end;
    }
    feeds
}

fn change_price(units: &[Unit], i: usize, costs: &Costs, carries: bool) -> f64 {
    if carries {
        0.0
    } else if units[i].from_mm > 0.0 {
        costs.split_s
    } else {
        costs.word_s
    }
}

/// Level of each unit of a run of free units.
fn best_levels(units: &[Unit], price_s: &dyn Fn(usize) -> f64) -> Vec<u8> {
    let feed = levels(units);
    let top = |unit: &Unit| feed.partition_point(|&feed| feed <= unit.cap.feed_mm_s * (1.0 + 1e-9)).max(1) - 1;
    let mut cost = vec![0.0; feed.len()];
    let mut stays: Vec<u128> = Vec::with_capacity(units.len());
    let mut from: Vec<u8> = Vec::with_capacity(units.len());
    for (i, unit) in units.iter().enumerate() {
        let best = least(&cost);
        let change = cost[best] + if i == 0 { 0.0 } else { price_s(i) };
        let (open, closed) = cost.split_at_mut(top(unit) + 1);
        closed.fill(f64::INFINITY);
        let low = feed.partition_point(|&feed| feed < unit.lowest_mm_s() * (1.0 - 1e-9)).min(open.len() - 1);
        let bits = |part: &[f64]| part.iter().rev().fold(0u32, |bits, cost| bits << 1 | u32::from(*cost <= change));
        stays.push(open.chunks(32).rev().fold(0u128, |stay, part| stay << 32 | u128::from(bits(part))));
        for (cost, feed) in open.iter_mut().zip(&feed) {
            let kept = if *cost <= change { *cost } else { change };
            *cost = kept + unit.time_s(*feed);
        }
        for cost in &mut open[..low] {
            *cost += BELOW_S;
        }
        from.push(best as u8);
    }
    let mut level = least(&cost) as u8;
    let mut levels = vec![0; units.len()];
    for i in (0..units.len()).rev() {
        levels[i] = level;
        if stays[i] >> level & 1 == 0 {
            level = from[i];
        }
    }
    levels
}

/// Feeds of the levels: caps, each the lowest of those within one ratio above it; the ratio is the least that leaves no more
/// than [`LEVELS`].
fn levels(units: &[Unit]) -> Vec<f64> {
    let mut caps: Vec<f64> = units.iter().map(|unit| unit.cap.feed_mm_s).collect();
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
    let (mut near, mut far) = (FINEST, (high / low).max(FINEST).powf(1.0 / (LEVELS - 1) as f64));
    if spaced(near).len() <= LEVELS {
        return spaced(near);
    }
    for _ in 0..20 {
        let middle = (near * far).sqrt();
        if spaced(middle).len() > LEVELS { near = middle } else { far = middle }
    }
    spaced(far)
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
fn settle(units: &[Unit], levels: &[u8], grid: &Grid, minimum_change: f64, feeds: &mut [f64]) {
    let mut start = 0;
    let mut last: Option<f64> = None;
    while start < units.len() {
        let end = (start..units.len()).find(|&i| levels[i] != levels[start]).unwrap_or(units.len());
        let cap = units[start..end].iter().map(|unit| unit.cap.feed_mm_s).fold(f64::INFINITY, f64::min);
        let best = grid.below(cap);
        let floor = units[start..end].iter().map(Unit::lowest_mm_s).fold(best / (1.0 + minimum_change), f64::max);
        let there = units[start].programmed_mm_s;
        let kept = |feed: f64| feed <= cap * (1.0 + 1e-9) && feed >= floor.min(best) * (1.0 - 1e-9);
        let same = units[start..end].iter().all(|unit| unit.programmed_mm_s == there);
        let chosen = if same && kept(there) { there } else { last.filter(|&last| kept(last)).unwrap_or(best) };
        feeds[start..end].fill(chosen);
        last = Some(chosen);
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

    fn unit(index: u32, cap: f64) -> Unit {
        let cap = Bound { feed_mm_s: cap, kind: LimitKind::Power, per_unit: 0.0 };
        let (from_mm, to_mm) = (0.0, 1.0);
        let (floor_mm_s, speed_mm_s, programmed_mm_s) = (0.0, 1e9, 7.77);
        Unit {
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
        let mut units: Vec<Unit> = (0..40).map(|i| unit(i, if i % 2 == 0 { 50.0 } else { 60.0 })).collect();
        let costs = Costs { word_s: 1e-4, split_s: 1e-4, minimum_change: 0.0 };
        let words = |units: &[Unit]| {
            let feeds = choose(units, &Grid { unit_mm_s: 1e-6, decimals: 0 }, &costs, &|_| false);
            feeds.windows(2).filter(|pair| pair[0] != pair[1]).count()
        };
        assert_eq!(words(&units), 39);
        for unit in &mut units {
            unit.speed_mm_s = 45.0;
        }
        assert_eq!(words(&units), 0);
    }

    #[test]
    fn a_floor_holds_unless_a_load_lies_below_it() {
        let grid = Grid { unit_mm_s: 1e-6, decimals: 0 };
        let costs = Costs { word_s: 1.0, split_s: 1.0, minimum_change: 0.0 };
        let feeds = |kind: LimitKind, cap: f64, floor: f64| {
            let mut units = vec![unit(0, 10.0), unit(1, cap), unit(2, 10.0)];
            (units[1].cap.kind, units[1].floor_mm_s) = (kind, floor);
            choose(&units, &grid, &costs, &|_| false)
        };
        let same = |found: &[f64], wanted: [f64; 3]| found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-3);
        // A word costs more than the time it saves; a minimum asks for it all the same.
        assert!(same(&feeds(LimitKind::Power, 12.0, 0.0), [10.0; 3]));
        assert!(same(&feeds(LimitKind::Power, 12.0, 11.0), [10.0, 12.0, 10.0]));
        assert!(same(&feeds(LimitKind::FeedChange, 12.0, 12.0), [10.0, 12.0, 10.0]));
        assert!(same(&feeds(LimitKind::Power, 12.0, 12.0), [10.0; 3]));
    }

    /// Least cost over all 2ⁿ⁻¹ ways to cut a run of n units into pieces, each at its least cap.
    fn brute(units: &[Unit], word_s: f64) -> f64 {
        (0..1u32 << (units.len() - 1))
            .map(|cuts| {
                let mut cost = 0.0;
                let mut start = 0;
                for end in 1..=units.len() {
                    if end == units.len() || cuts >> (end - 1) & 1 == 1 {
                        let cap = units[start..end].iter().map(|unit| unit.cap.feed_mm_s).fold(f64::INFINITY, f64::min);
                        cost += units[start..end].iter().map(|unit| unit.time_s(cap)).sum::<f64>();
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
        let units: Vec<Unit> = caps.iter().enumerate().map(|(i, &cap)| unit(i as u32, cap)).collect();
        for word_s in [0.0, 0.005, 0.02, 0.1] {
            let costs = Costs { word_s, split_s: word_s, minimum_change: 0.0 };
            let feeds = choose(&units, &Grid { unit_mm_s: 1e-6, decimals: 0 }, &costs, &|_| false);
            let words = feeds.windows(2).filter(|pair| pair[0] != pair[1]).count() as f64;
            let cost = units.iter().zip(&feeds).map(|(unit, &feed)| unit.time_s(feed)).sum::<f64>() + words * word_s;
            assert!(units.iter().zip(&feeds).all(|(unit, &feed)| feed <= unit.cap.feed_mm_s));
            assert!(cost <= brute(&units, word_s) * 1.01, "{word_s}: {cost} {}", brute(&units, word_s));
        }
    }
}
