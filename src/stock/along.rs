//! Further candidates along a path. In: elements, one of them that a cell names, the width of a cell. Out: the elements shortly before and
//! after it.
//!
//! The cells do not name every element that made a wall. On a ramp the rim of a flat end lowers a cell near its side up to half a chord
//! before or after the place where it clears the wall; where the path rises and falls again, the cut at the top may lower no cell at all.
//! So an element is a candidate wherever its neighbours are. Beside the steep part of a ball, the cells that would name a short cut of a wall
//! have been lowered by the cutter at its present place.

use super::element::{Element, Track};
use super::form::Form;

/// Width of a strip along a wall that may contain no cell centre, in cells.
pub const SLIVER_CELLS: f64 = 2.25;
/// The same beside the steep part of a ball, of which the cutter itself hides a part only.
const STEEP_CELLS: f64 = 0.5;

/// The elements along the path from element `id` as far as it may matter, those before `until` only. Where a ball's steep part
/// is met (`steep`), its walls are as upright as those of a flat end.
pub fn along(
    elements: &[Element],
    id: u32,
    (form, steep): (&Form, bool),
    cell_mm: f64,
    until: u32,
) -> impl Iterator<Item = u32> {
    let sliver = match (form.is_ball(), steep) {
        (false, _) => SLIVER_CELLS,
        (true, true) => STEEP_CELLS,
        (true, false) => 0.0,
    };
    let reach = reach_mm(&elements[id as usize], form, sliver * cell_mm);
    let within = move |next: &dyn Fn(u32) -> u32, ends: &dyn Fn(u32) -> bool| {
        let (mut left, mut at, mut count) = (reach, id, 0);
        while left > 0.0 && !ends(at) {
            at = next(at);
            left -= elements[at as usize].track.length();
            count += 1;
        }
        count
    };
    let after = within(&|at| at + 1, &|at| at + 1 >= until || !elements[at as usize + 1].joined);
    let before = within(&|at| at - 1, &|at| !elements[at as usize].joined);
    (id - before..id).chain(id + 1..id + 1 + after)
}

fn reach_mm(element: &Element, form: &Form, sliver_mm: f64) -> f64 {
    let ramp = matches!(element.track, Track::Line { from, to } if (from.z - to.z).abs() > 1e-9);
    if ramp { (2.0 * form.radius * sliver_mm).sqrt() } else { 0.0 }
}
