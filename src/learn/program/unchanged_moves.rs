//! The moves that other sides of the stock do not concern. In: a program, its job, its engagement, the job with sides that stand elsewhere. Out:
//! for each move itself, where its tool keeps clear of what is there more or less; there it meets the stock that it met before.

use crate::engage::EngagementMap;
use crate::engage::workpiece::{shift, stock_shift};
use crate::ids::MoveId;
use crate::machine::{Box3, Job, Stock, StockShape};
use crate::nc::{Move, Toolpath};

/// Cells of the height field by which a tool keeps clear: its neighbours are looked at too.
const CLEAR_CELLS: f64 = 4.0;

/// A rectangle in XY of the common frame, mm: least and greatest x, least and greatest y.
type Rectangle = [f64; 4];

/// For each move itself, or `None` where its tool may meet what differs between the stock of the two jobs; `None` for all where the stock is
/// not of boxes or differs in height, or the tools differ.
pub(in crate::learn) fn unchanged_moves(
    path: &Toolpath,
    map: &EngagementMap,
    job: &Job,
    other: &Job,
) -> Option<Vec<Option<MoveId>>> {
    if job.tools != other.tools {
        return None;
    }
    let pairs = job.stocks.iter().zip(&other.stocks);
    let slabs: Vec<Rectangle> = pairs
        .map(|(before, after)| Some(slabs(placed(path, job, before)?, placed(path, other, after)?)?.into_iter()))
        .collect::<Option<Vec<_>>>()?
        .into_iter()
        .flatten()
        .collect();
    let is_clear = |motion: &Move| {
        let tool = job.tool(motion.tool)?;
        let runout_mm = tool.runout.map_or(0.0, |runout| runout.offset_mm);
        let reach_mm = 0.5 * tool.diameter_mm + runout_mm + CLEAR_CELLS * map.cell_mm;
        let (low, high) = motion.curve().bounds();
        let by = shift(job, path, motion.wcs);
        let swept =
            [low.x + by.x - reach_mm, high.x + by.x + reach_mm, low.y + by.y - reach_mm, high.y + by.y + reach_mm];
        (!slabs.iter().any(|slab| meet(slab, &swept))).then_some(())
    };
    let own = |(index, motion): (usize, &Move)| is_clear(motion).map(|()| MoveId(index as u32));
    Some(path.moves.iter().enumerate().map(own).collect())
}

/// The box of a piece of stock in the common frame.
fn placed(path: &Toolpath, job: &Job, stock: &Stock) -> Option<Box3> {
    let StockShape::Box(own) = &stock.shape else { return None };
    let by = stock_shift(job, path, stock);
    Some(Box3 { min: own.min + by, max: own.max + by })
}

/// What is in one box and not in the other: between the two faces of each side, over the length of the longer. `None` where top or bottom
/// differ.
fn slabs(before: Box3, after: Box3) -> Option<Vec<Rectangle>> {
    if before.min.z != after.min.z || before.max.z != after.max.z {
        return None;
    }
    let (low, high) = (before.min.inf(&after.min), before.max.sup(&after.max));
    let (inner_low, inner_high) = (before.min.sup(&after.min), before.max.inf(&after.max));
    let sides = [
        [low.x, inner_low.x, low.y, high.y],
        [inner_high.x, high.x, low.y, high.y],
        [low.x, high.x, low.y, inner_low.y],
        [low.x, high.x, inner_high.y, high.y],
    ];
    Some(sides.into_iter().filter(|[x0, x1, y0, y1]| x0 < x1 && y0 < y1).collect())
}

fn meet(a: &Rectangle, b: &Rectangle) -> bool {
    a[0] <= b[1] && b[0] <= a[1] && a[2] <= b[3] && b[2] <= a[3]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engage::{Again, engage, engage_again};
    use crate::learn::program::other_geometry::options;
    use crate::learn::program::simulated::simulate_declared;
    use crate::learn::program::timeline::engaged_otherwise;

    /// Relative accuracy of the engagement over a millimetre of path (`tests/engage_accuracy.rs`).
    const ENGAGEMENT_KNOWN_TO: f64 = 0.003;

    fn job() -> Job {
        let text = "[machine.axes]\nx = { velocity = 6000 }\ny = { velocity = 6000 }\nz = { velocity = 3000 }\n[stock]\n\
                    box = { min = [0, 0, -12], max = [60, 40, 0] }\n[material]\nk_tc = 800\nk_te = 15\nk_rc = 300\nk_re = 10\n\
                    [[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 8\nflutes = 3\n";
        crate::setup::load(text, std::path::Path::new(".")).unwrap().0
    }

    /// Passes along x at y = 0, 6 … 42, then a round in the middle.
    fn program() -> String {
        let pass = |k: i32| format!("G0 X-8 Y{}\nG1 Z-3 F400\nG1 X68 F600\nG0 Z2\n", 6 * k);
        let passes: String = (0..8).map(pass).collect();
        let round = "G0 X20 Y20\nG1 Z-5 F200\nG1 X40 F500\nG2 X20 Y20 I-10 J0\nG0 Z20\nM2\n";
        format!("G21 G90 G17\nT1 M6\nS6000 M3\nG0 Z2\n{passes}{round}")
    }

    #[test]
    fn moves_away_from_a_side_cut_the_same_and_the_others_are_worked_out() {
        let job = job();
        let declared = simulate_declared(program().as_bytes(), &job, None, None).unwrap();
        let (path, map) = (&declared.path, &declared.map);
        for (face, by_mm) in (0..4).flat_map(|face| [-1.5, -0.5, 0.5, 1.5].map(|by_mm| (face, by_mm))) {
            let mut sides_mm = [0.0; 4];
            sides_mm[face] = by_mm;
            let other = job.with_faces_moved(0.0, sides_mm);
            let of_move = unchanged_moves(path, map, &job, &other).unwrap();
            let share = of_move.iter().flatten().count() as f64 / path.moves.len() as f64;
            // Every pass crosses both sides in x; the first or the last two meet one in y.
            assert!((if face < 2 { 0.2..0.6 } else { 0.7..0.95 }).contains(&share), "{face}: {share}");
            let again = Again { known: map, of_move: &of_move };
            let maps = [
                engage(path, &other, &options(None), &|_| ()).unwrap(),
                engage_again(path, &other, &options(None), again, &|_| ()).unwrap(),
            ];
            let [whole, in_part] =
                maps.map(|map| engaged_otherwise(path, &map, &other, &declared.timeline, None, None));
            for (k, (a, b)) in whole.iter().zip(&in_part).enumerate() {
                // Stations of the two lie at other places on a bend.
                let near = |a: f64, b: f64| (a - b).abs() <= ENGAGEMENT_KNOWN_TO * a.max(b);
                let is_same = near(a.section_mm2, b.section_mm2) && near(a.contact_mm2, b.contact_mm2);
                assert!(is_same, "{face} {by_mm} line {}: {a:?} {b:?}", declared.timeline.spots[k].line);
            }
        }
    }

    #[test]
    fn nothing_is_taken_over_where_the_top_or_the_tools_differ() {
        let job = job();
        let declared = simulate_declared(program().as_bytes(), &job, None, None).unwrap();
        let of = |other: &Job| unchanged_moves(&declared.path, &declared.map, &job, other);
        assert!(of(&job.with_stock_grown(0.5, 0.0)).is_none());
        assert!(of(&job.with_mills_wider(-0.2).unwrap()).is_none());
        assert!(of(&job.with_stock_grown(0.0, 0.5)).is_some());
    }
}
