//! What the schedule is asked and what it answers.

use crate::ids::MoveId;
use crate::machine::LimitKind;

/// A bound on the commanded feed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Feed, mm/s.
    pub feed_mm_s: f64,
    /// What it comes from.
    pub kind: LimitKind,
    /// d feed / d limit, (mm/s)/unit of the limit; 0 when not known.
    pub per_unit: f64,
}

/// One piece of path with one set of bounds: usually a station of the engagement map. The nodes of a feed move tile it;
/// a rapid has one node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Its move.
    pub move_id: MoveId,
    /// Where it begins, mm along the move.
    pub from_mm: f64,
    /// Where it ends.
    pub to_mm: f64,
    /// Highest feed that meets every limit, and which limit that is.
    pub cap: Bound,
    /// Lowest feed asked for (never above the cap; a conflict is recorded in `infeasible`).
    pub floor: Bound,
    /// Feed as programmed, mm/s.
    pub programmed_mm_s: f64,
    /// Is material cut here?
    pub cutting: bool,
    /// May the commanded feed differ from the programmed one?
    pub free: bool,
    /// A load limit that even the lowest feed allowed exceeds.
    pub infeasible: Option<LimitKind>,
}

/// The path with its bounds, in order of execution.
#[derive(Debug, Clone, Default)]
pub struct Problem {
    /// Nodes in order.
    pub nodes: Vec<Node>,
}

/// One commanded feed on one piece of a move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedPiece {
    /// Its move.
    pub move_id: MoveId,
    /// Where it begins, mm along the move.
    pub from_mm: f64,
    /// Where it ends.
    pub to_mm: f64,
    /// Commanded feed, mm/s, already on the grid of the program's F words where the mode is per minute.
    pub feed_mm_s: f64,
    /// What bounds the feed here.
    pub limit: LimitKind,
    /// Price of that bound here: seconds that one percent more of it would save.
    pub price_s: f64,
}

/// Speed and time as the control will realise them.
#[derive(Debug, Clone, Default)]
pub struct Realised {
    /// Time of each move, s, by move index.
    pub move_s: Vec<f64>,
    /// Whole time with dwells, tool changes and run-ups, s.
    pub total_s: f64,
    /// Time by cause: name and seconds.
    pub by_cause: Vec<(&'static str, f64)>,
}

/// The answer.
#[derive(Debug, Clone, Default)]
pub struct Schedule {
    /// Commanded feeds of every feed move, in order; the pieces of a move tile it.
    pub pieces: Vec<FeedPiece>,
    /// Realised time of the continuous optimum (no F words), s.
    pub continuous_s: f64,
    /// Seconds saved per unit of a limit (negative: more would save time), by kind.
    pub shadow_prices: Vec<(LimitKind, f64)>,
    /// Cutting time by what bounds it, s.
    pub active_s: Vec<(LimitKind, f64)>,
    /// How it was solved: one sentence for the report.
    pub how: String,
}
