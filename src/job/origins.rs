//! Which move of the original each move of the written program is a piece of. In: the two toolpaths. Out: for every
//! written move its original and where on it the piece begins; and the written feeds on the moves of the original.

use crate::ids::MoveId;
use crate::nc::{MoveKind, Toolpath};
use crate::schedule::FeedPiece;

/// End points of the same block may differ by this much, mm.
const SAME_MM: f64 = 1e-5;

/// A piece of an original move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Origin {
    /// The original move.
    pub move_id: MoveId,
    /// Where the piece begins on it, mm.
    pub from_mm: f64,
    /// Where it ends, mm.
    pub to_mm: f64,
}

/// Origins of all moves of `written`; `None` when the paths do not run side by side.
pub fn follow(original: &Toolpath, written: &Toolpath) -> Option<Vec<Origin>> {
    let mut origins = Vec::with_capacity(written.moves.len());
    let mut rest = original.iter_moves();
    let mut current = rest.next();
    let mut at = 0.0;
    for motion in &written.moves {
        let (id, whole) = current?;
        let length = whole.curve().length();
        let to = at + motion.curve().length();
        // A closed curve ends where it begins, so its last piece is recognised by its length.
        let ends = (motion.curve().to() - whole.curve().to()).norm() < SAME_MM && to > 0.9 * length - 0.01;
        if motion.kind != whole.kind || to > 1.1 * length + 0.1 {
            return None;
        }
        origins.push(Origin {
            move_id: id,
            from_mm: at.min(length),
            to_mm: if ends { length } else { to.min(length) },
        });
        at = if ends { 0.0 } else { to };
        if ends {
            current = rest.next();
        }
    }
    current.is_none().then_some(origins)
}

/// Feeds that the written program commands, on the moves of the original.
pub fn feeds(written: &Toolpath, origins: &[Origin]) -> Vec<FeedPiece> {
    let feed = |(motion, origin): (&crate::nc::Move, &Origin)| {
        let along_mm = [origin.from_mm, origin.to_mm];
        (motion.kind == MoveKind::Feed).then(|| FeedPiece::commanded(origin.move_id, along_mm, motion.feed.mm_s))
    };
    written.moves.iter().zip(origins).filter_map(feed).collect()
}
