//! Lower bound of the time of straight passes. In: the tool on the surface, its columns, limits. Out: a time that no plan of straight passes
//! that alternate and follow each other to the left of +X can be below.
//!
//! A straight pass has one step-over from end to end, as much as its worst place allows. With t(s) the time along the pass at a Y if every
//! place of it is cut at the highest feed that keeps the force at the step-over s, → for a pass along +X and ← for one against it,
//!
//! T ≥ ∫ dY min over s₁, s₂ of (t→(s₁) + t←(s₂)) / (s₁ + s₂).
//!
//! Between the step-overs at which loads are known the feed is interpolated linearly; it is convex in the step-over, so that this is not too
//! slow. Leads, links, corners and accelerations are not counted, nor the ground beside the outermost columns.

use super::columns::Columns;
use super::least_time::Alike;
use super::passes::Requirements;
use super::reach::{Reach, ToolOnSurface};
use crate::force::LoadLine;
use rayon::prelude::*;

/// Step-overs of a row that are tried between the least and the largest. At a minimum between two of them the time per width is higher than
/// there by the square of their distance: below 0.1 %.
const TRIED: usize = 32;

/// Least times, s, from rows `apart_mm` apart with places about as far apart.
pub fn least_straight_s<const N: usize>(
    on_surface: &ToolOnSurface,
    columns: &Columns,
    required: Alike<N>,
    apart_mm: f64,
) -> [f64; N] {
    let ends = columns.stretches.iter().flatten();
    let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), [from, to]| (a.min(*from), b.max(*to)));
    if low >= high {
        return [0.0; N];
    }
    let count = ((high - low) / apart_mm).ceil() as usize;
    let high_mm = (high - low) / count as f64;
    let row = |j: usize| row(on_surface, columns, low + (j as f64 + 0.5) * high_mm, (required, apart_mm));
    let rows: Vec<[f64; N]> = (0..count).into_par_iter().map(row).collect();
    rows.iter().fold([0.0; N], |sum, row| std::array::from_fn(|k| sum[k] + high_mm * row[k]))
}

/// Least time per mm of width of the passes at a Y, s/mm.
fn row<const N: usize>(
    on_surface: &ToolOnSurface,
    columns: &Columns,
    y: f64,
    (required, apart_mm): (Alike<N>, f64),
) -> [f64; N] {
    let on: Vec<usize> = (0..columns.at_mm.len()).filter(|i| columns.on(*i, y)).collect();
    let neighbours = on.windows(2).filter(|two| two[1] == two[0] + 1);
    let long_mm: f64 = neighbours.map(|two| columns.x(two[1]) - columns.x(two[0])).sum();
    let stride = ((apart_mm / columns.column_mm).round() as usize).max(1);
    let looked: Vec<usize> = on.iter().copied().skip(on.len() % stride / 2).step_by(stride).collect();
    let of_way = |way: f64| -> Vec<Reach> {
        let at = |i: &usize| on_surface.reach([columns.x(*i), y], ([way, 0.0], [0.0, 1.0]), &required[0].bounds);
        looked.iter().filter_map(at).collect()
    };
    let ways = [of_way(1.0), of_way(-1.0)];
    if ways.iter().any(Vec::is_empty) {
        return [0.0; N];
    }
    let each_mm = long_mm / looked.len() as f64;
    required.map(|required| {
        let [there, back] = ways.each_ref().map(|way| tried(way, required, each_mm));
        let per_mm = |[s1, t1]: [f64; 2], [s2, t2]: [f64; 2]| (t1 + t2) / (s1 + s2);
        let with = |there: &[f64; 2]| back.iter().map(|back| per_mm(*there, *back)).fold(f64::INFINITY, f64::min);
        there.iter().map(with).fold(f64::INFINITY, f64::min)
    })
}

/// Step-overs that all places of a row allow, mm, each with the time along it, s.
fn tried(reaches: &[Reach], required: &Requirements, each_mm: f64) -> Vec<[f64; 2]> {
    let least = required.bounds.least_mm;
    let most = reaches.iter().map(|reach| reach.by_scallop_mm).fold(f64::INFINITY, f64::min).max(least);
    let feeds: Vec<(f64, Vec<[f64; 2]>)> = reaches
        .iter()
        .map(|reach| {
            let feed = |(step, line): &(f64, LoadLine)| [*step, required.fastest_mm_s(line)];
            (reach.longer, reach.steps().iter().map(feed).collect())
        })
        .collect();
    let time = |step: f64| feeds.iter().map(|(longer, feeds)| each_mm * longer / feed_at(feeds, step)).sum::<f64>();
    let step = |k: usize| least + (most - least) * k as f64 / (TRIED - 1) as f64;
    (0..TRIED).map(step).map(|step| [step, time(step)]).collect()
}

/// Feed at a step-over, mm/s, from those at step-overs in rising order; beyond them that of the last.
fn feed_at(feeds: &[[f64; 2]], step: f64) -> f64 {
    let after = feeds.partition_point(|[known, _]| *known < step);
    match (after.checked_sub(1).and_then(|k| feeds.get(k)), feeds.get(after)) {
        (Some([s0, f0]), Some([s1, f1])) => f0 + (f1 - f0) * (step - s0) / (s1 - s0),
        (Some([_, feed]), None) | (None, Some([_, feed])) => *feed,
        (None, None) => f64::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn feeds_lie_on_the_line_between_two_step_overs() {
        let feeds = [[0.1, 20.0], [0.3, 16.0], [0.5, 10.0]];
        assert!((feed_at(&feeds, 0.2) - 18.0).abs() < 1e-12 && (feed_at(&feeds, 0.45) - 11.5).abs() < 1e-12);
        assert!(feed_at(&feeds, 0.05) == 20.0 && feed_at(&feeds, 0.6) == 10.0 && feed_at(&feeds, 0.1) == 20.0);
        assert!(feed_at(&[], 0.2) == f64::INFINITY);
    }
}
