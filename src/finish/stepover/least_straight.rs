//! Lower bound of the time of straight passes. In: the tool on the surface, its columns, limits. Out: a time that no plan of straight passes
//! that alternate and follow each other to the left of +X can be below.
//!
//! A straight pass has one step-over from end to end, as much as its worst place allows. With t(s) the time along the pass if every place of
//! it is cut at the highest feed that keeps the force at the step-over s from a pass at Y, → for one along +X and ← for one against it, the
//! least time V of the passes beyond one at Y follows backwards from the far end of the surface, where it is 0:
//!
//! V→(Y) = min over s of t→(s) + V←(Y + s), V←(Y) = min over s of t←(s) + V→(Y + s).
//!
//! It is a lower bound of the time of all passes: the least sum of any such passes of which the first lies on the edge. That first one is not
//! counted, and of the last one as much as its step-over lies on the surface; so it also holds where the first and the last lie up to half
//! a step-over within the edges. Lengths are those at Y, which counts the length of each pass but the last in place of each but the first.
//! An integral of the time per width over Y would not do: where step-overs fall from pass to pass it is above the least sum (on a cylinder,
//! up the slope, by 0.5 to 0.8 %), where they rise below it.
//!
//! Between the step-overs at which loads are known the feed is interpolated linearly; it is convex in the step-over, so that this is not too
//! slow. Between rows step-overs and times are interpolated. Leads, links, corners and accelerations are not counted.

use super::columns::{Columns, HALVINGS, is_on};
use super::least_time::Alike;
use super::passes::Requirements;
use super::reach::{Reach, ToolOnSurface};
use crate::force::LoadLine;
use crate::numeric::bisect;
use rayon::prelude::*;

/// Step-overs of a row that are tried between the least and the largest. At a minimum between two of them the time per width is higher than
/// there by the square of their distance: below 0.1 %.
const TRIED: usize = 32;

/// Least times, s, from rows half of `apart_mm` apart with a place in each column.
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
    let count = (CLOSER * (high - low) / apart_mm).ceil() as usize;
    let high_mm = (high - low) / count as f64;
    let row = |j: usize| row(on_surface, columns, low + (j as f64 + 0.5) * high_mm, required);
    let rows: Vec<[Option<Row>; N]> = (0..count).into_par_iter().map(row).collect();
    std::array::from_fn(|k| {
        let rows: Vec<Option<&Row>> = rows.iter().map(|row| row[k].as_ref()).collect();
        least_sum_s(&rows, [high - low, 0.5 * high_mm], NODE_MM.min(0.5 * required[k].bounds.least_mm))
    })
}

/// Rows over the distance of places for the other bounds: on a cylinder between rows 2 mm apart, step-overs interpolated at 70° are 2.7 % too small.
const CLOSER: f64 = 2.0;
/// Distance of the places at which V is worked out, mm; at most half the least step-over.
const NODE_MM: f64 = 0.02;

/// Step-overs from a row, mm, each with the time along the next pass, s: along +X, and against it.
type Row = [Vec<[f64; 2]>; 2];

/// V at the near end of the surface, `wide_mm` from the far one, from rows spread evenly, the first and the last `within_mm` within it; `None`: a
/// row without ground.
fn least_sum_s(rows: &[Option<&Row>], [wide_mm, within_mm]: [f64; 2], node_mm: f64) -> f64 {
    let last = (wide_mm / node_mm).ceil() as usize;
    let node_mm = wide_mm / last as f64;
    let mut v = [vec![0.0; last + 1], vec![0.0; last + 1]];
    for j in (0..last).rev() {
        let y = j as f64 * node_mm;
        let at = ((y - within_mm) / (wide_mm - 2.0 * within_mm)).clamp(0.0, 1.0) * (rows.len() - 1) as f64;
        let (low, share) = (at as usize, at.fract());
        let [a, b] = [low, (low + 1).min(rows.len() - 1)].map(|k| rows[k]);
        for way in [0, 1] {
            let beyond = |step_mm: f64, time_s: f64| {
                if y + step_mm >= wide_mm {
                    return time_s * (wide_mm - y) / step_mm;
                }
                let at = ((y + step_mm) / node_mm).max((j + 1) as f64);
                let (k, share) = (at as usize, at.fract());
                time_s + v[1 - way][k] + share * (v[1 - way][(k + 1).min(last)] - v[1 - way][k])
            };
            let each = |k: usize| match (a, b) {
                (Some(a), Some(b)) => [0, 1].map(|of| a[way][k][of] + share * (b[way][k][of] - a[way][k][of])),
                (Some(one), None) | (None, Some(one)) => one[way][k],
                (None, None) => [node_mm, 0.0],
            };
            v[way][j] =
                (0..TRIED).map(each).map(|[step_mm, time_s]| beyond(step_mm, time_s)).fold(f64::INFINITY, f64::min);
        }
    }
    v[0][0].min(v[1][0])
}

/// The step-overs from a Y, for each requirement.
fn row<const N: usize>(on_surface: &ToolOnSurface, columns: &Columns, y: f64, required: Alike<N>) -> [Option<Row>; N] {
    let on: Vec<usize> = (0..columns.at_mm.len()).filter(|i| columns.on(*i, y)).collect();
    let stretches = on.chunk_by(|a, b| *b == a + 1);
    let long_mm: f64 = stretches.map(|stretch| length_mm(on_surface, columns, stretch, y)).sum();
    let of_way = |way: f64| -> Vec<Reach> {
        let at = |i: &usize| on_surface.reach([columns.x(*i), y], ([way, 0.0], [0.0, 1.0]), &required[0].bounds);
        on.iter().filter_map(at).collect()
    };
    let ways = [of_way(1.0), of_way(-1.0)];
    if ways.iter().any(Vec::is_empty) {
        return required.map(|_| None);
    }
    let each_mm = long_mm / on.len() as f64;
    required.map(|required| Some(ways.each_ref().map(|way| tried(way, required, each_mm))))
}

/// Length of a row over some columns side by side, to where the surface ends between the outermost ones and those beside them, mm.
fn length_mm(on_surface: &ToolOnSurface, columns: &Columns, stretch: &[usize], y: f64) -> f64 {
    let ([first, ..], [.., last]) = (stretch, stretch) else { return 0.0 };
    let end = |i: usize, off: Option<&f64>| {
        off.map_or(columns.x(i), |off| bisect(|x| is_on(on_surface, [x, y]), columns.x(i), *off, HALVINGS)[0])
    };
    let before = first.checked_sub(1).and_then(|k| columns.at_mm.get(k));
    end(*last, columns.at_mm.get(last + 1)) - end(*first, before)
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

    /// Passes whose step-over is a tenth of Y, at 1 s each: from 1 to 1.1ⁿ in n of them, of the last one as much as lies on the ground. And
    /// alternate ones of 1 s with a step-over of 0.1 mm and of 2 s with 0.3 mm or of 1 s with 0.05 mm.
    #[test]
    fn the_least_sum_is_that_of_passes_one_after_the_other() {
        let rows: Vec<Row> = (0..900)
            .map(|j| 0.1 * (1.0 + (f64::from(j) + 0.5) / 900.0))
            .map(|step| [0, 1].map(|_| vec![[step, 1.0]; TRIED]))
            .collect();
        let rows: Vec<Option<&Row>> = rows.iter().map(Some).collect();
        let passes = |width: f64| {
            let (mut y, mut count) = (1.0, 0.0);
            while 1.1 * y < 1.0 + width {
                (y, count) = (1.1 * y, count + 1.0);
            }
            count + (1.0 + width - y) / (0.1 * y)
        };
        let found = least_sum_s(&rows, [1.0, 0.5 / 900.0], 0.01);
        assert!((found - passes(1.0)).abs() < 1e-2, "{found} {}", passes(1.0));
        // The other way round the integral of the rate, ln 2 / 0.1 = 6.93, is as large, and the sum is larger.
        let back: Vec<Option<&Row>> = rows.into_iter().rev().collect();
        assert!(least_sum_s(&back, [1.0, 0.5 / 900.0], 0.01) < 10.0 * 2f64.ln() && found > 10.0 * 2f64.ln());
        let slow = [[0.05, 1.0], [0.3, 2.0]];
        let row: Row = [vec![[0.1, 1.0]; TRIED], (0..TRIED).map(|k| slow[k % 2]).collect()];
        assert!((least_sum_s(&[Some(&row)], [4.0, 0.0], 0.01) - 30.0).abs() < 1e-6);
        assert!(least_sum_s(&[None], [4.0, 0.0], 0.01) == 0.0);
    }

    #[test]
    fn feeds_lie_on_the_line_between_two_step_overs() {
        let feeds = [[0.1, 20.0], [0.3, 16.0], [0.5, 10.0]];
        assert!((feed_at(&feeds, 0.2) - 18.0).abs() < 1e-12 && (feed_at(&feeds, 0.45) - 11.5).abs() < 1e-12);
        assert!(feed_at(&feeds, 0.05) == 20.0 && feed_at(&feeds, 0.6) == 10.0 && feed_at(&feeds, 0.1) == 20.0);
        assert!(feed_at(&[], 0.2) == f64::INFINITY);
    }
}
