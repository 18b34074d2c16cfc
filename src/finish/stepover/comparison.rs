//! Comparisons for passes of varying step-over. In: columns, their plan. Out: lower bounds of the time, and the best
//! plan of a constant step-over.

use super::columns::Columns;
use super::least_time::{Alike, Over, headings};
use super::passes::{self, Constant, Requirements};
use super::plan::Plan;
use super::reach::{Place, ToolOnSurface};
use std::f64::consts::PI;

/// Number of headings within the allowed slope for the lower bound.
const FAN: usize = 5;
/// Number of headings all round.
const ROUND: usize = 8;

/// One of so many places is looked at for the bound of any passes, which has every heading; no divisor of most grids, so that neighbouring
/// rows are looked at in different columns. On a dome the bound changes by 3 %.
const ONE_OF: usize = 5;

/// Least time of any passes, s.
pub fn least_of_any_s(on_surface: &ToolOnSurface, places: &[Place], required: &Requirements) -> f64 {
    let area = |places: &[Place]| places.iter().map(|(_, area)| area).sum::<f64>();
    let some: Vec<Place> = places.iter().copied().step_by(ONE_OF).collect();
    // Without a place the time is 0.
    let of_all = area(places) / area(&some).max(f64::MIN_POSITIVE);
    of_all * Over { on_surface, places: &some, required: [required] }.least_s(&headings(PI, ROUND))[0]
}

/// Least times of curved passes within the allowed slope that alternate and follow each other to the same side as those of a plan, s.
pub fn least_alike_s<const N: usize>(on_surface: &ToolOnSurface, places: &[Place], required: Alike<N>) -> [f64; N] {
    let turn = required[0].turn;
    let headings = headings(turn.atan(), if turn > 0.0 { FAN } else { 1 });
    Over { on_surface, places, required }.least_alternating_s(&headings)
}

/// The best plan of one step-over and one feed that keep force and scallop at all places of the varying plan, except
/// where even the least step-over exceeds the force. The step-over is measured from above or along the surface,
/// whichever is faster.
pub fn constant(
    on_surface: &ToolOnSurface,
    columns: &Columns,
    required: &Requirements,
    everywhere_mm: &[[f64; 2]],
) -> Option<(Constant, f64, Plan)> {
    let best = |way: usize| {
        let rate = |k: &usize| required.feeds_mm_s[*k] * everywhere_mm[*k][way];
        (0..required.feeds_mm_s.len())
            .filter(|k| everywhere_mm[*k][way].is_finite())
            .reduce(|a, b| if rate(&b) > rate(&a) { b } else { a })
    };
    let plan = |step: Constant, k: usize| {
        let feed = required.feeds_mm_s[k];
        let required = Requirements { feeds_mm_s: vec![feed], turn: 0.0, constant: Some(step), ..required.clone() };
        (step, feed, passes::plan(on_surface, columns, &required, None))
    };
    let above = best(0).map(|k| plan(Constant::Above(everywhere_mm[k][0]), k));
    let along = best(1).map(|k| plan(Constant::Along(everywhere_mm[k][1]), k));
    let time = |(_, feed, plan): &(Constant, f64, Plan)| plan.length_mm() / feed;
    above.into_iter().chain(along).reduce(|a, b| if time(&b) < time(&a) { b } else { a })
}
