//! Two programs linked to one. In: the motions of the semi-finish (original or moved) and of the finish. Out: one
//! toolpath in which the finish cuts the stock that the semi-finish left, and the number of its first move.

use crate::ids::MoveId;
use crate::nc::{Doubted, Toolpath};
use crate::path::Vec3;

/// Both programs in order of execution.
#[derive(Debug, Clone)]
pub struct Linked {
    /// All moves; those of the finish are numbered from `first` on.
    pub toolpath: Toolpath,
    /// First move of the finish.
    pub first: usize,
}

/// Appends the finish to the semi-finish.
pub fn linked(semi: Toolpath, finish: &Toolpath) -> Linked {
    let first = semi.moves.len();
    let shifted = |id: MoveId| MoveId(id.0 + first as u32);
    let mut toolpath = semi;
    toolpath.moves.extend(finish.moves.iter().cloned());
    toolpath.between.extend(finish.between.iter().map(|(id, event)| (shifted(*id), *event)));
    if !toolpath.shifts.is_empty() {
        toolpath.shifts.push((MoveId(first as u32), Vec3::zeros()));
    }
    toolpath.shifts.extend(finish.shifts.iter().map(|(id, shift)| (shifted(*id), *shift)));
    for doubted in &mut toolpath.doubts {
        doubted.until = Some(doubted.until.unwrap_or(MoveId(first as u32)));
    }
    let behind = |doubted: &Doubted| Doubted {
        from: shifted(doubted.from),
        until: doubted.until.map(shifted),
        ..doubted.clone()
    };
    toolpath.doubts.extend(finish.doubts.iter().map(behind));
    Linked { toolpath, first }
}
