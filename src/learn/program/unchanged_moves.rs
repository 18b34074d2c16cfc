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
pub fn unchanged_moves(path: &Toolpath, map: &EngagementMap, job: &Job, other: &Job) -> Option<Vec<Option<MoveId>>> {
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
