//! Two programs as one. In: the motions of the semi-finish (as written, or moved) and of the finish. Out: one toolpath
//! in which the finish meets what the semi-finish left, and where its moves begin.

use crate::ids::MoveId;
use crate::nc::{Doubted, Toolpath};
use crate::path::Vec3;

/// Both programs in order of execution.
#[derive(Debug, Clone)]
pub struct Linked {
    /// All moves; the numbers of those of the finish are shifted by `first`.
    pub toolpath: Toolpath,
    /// First move of the finish.
    pub first: usize,
}

/// The finish behind the semi-finish.
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
