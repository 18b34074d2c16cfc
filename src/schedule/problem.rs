//! What the schedule is asked and what it answers.

use super::known_loads::KnownLoads;
use crate::ids::MoveId;
use crate::machine::LimitKind;
use crate::nc::{Doubt, Freeze};

/// Places along a move that are nearer than this are the same, mm.
const SAME_MM: f64 = 1e-6;

/// A bound on the commanded feed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Feed, mm/s.
    pub feed_mm_s: f64,
    /// What it comes from.
    pub kind: LimitKind,
    /// d feed / d limit, (mm/s) per unit of the limit as the report gives it ([`LimitKind::unit`]); 0 when not known.
    pub per_unit: f64,
}

/// Why a feed is not raised above the programmed one, whatever the limits would allow. It may still be lowered, unless the
/// node is not [`Node::free`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kept {
    /// The text or the setup keeps it.
    Frozen(Freeze),
    /// Part or frame are not known here.
    Doubt(Doubt),
    /// The engagement is uncertain.
    Uncertain,
    /// The setup says keep or slow-only.
    Mode,
    /// The end face cuts straight down.
    Plunge,
    /// The end face cuts downwards along a ramp or a helix.
    Ramp,
    /// Lead-in, lead-out, first engagement of a cut.
    Entry,
    /// The move leaves the final surface.
    Finishing,
    /// In the air beside the blank, where the setup does not say what clamps the part.
    Fixtures,
    /// Under G41 or G42.
    Compensation,
    /// A drilling or boring cycle.
    Cycle,
    /// The file was rewritten before, and what its feeds were is not known any more.
    Forgotten,
    /// No force, power, torque, deflection, stress or chip limit is in force that ever acts, or the load here is not known.
    NoLoadLimit,
    /// The simulation as a whole cannot be right: the stock is never touched, the spindle stands still in a cut, or a tool has
    /// no loads.
    Unsound,
}

impl Kept {
    /// One clause for reports, after "kept as programmed:".
    pub fn why(self) -> &'static str {
        match self {
            Kept::Frozen(freeze) => freeze.why(),
            Kept::Doubt(doubt) => doubt.why(),
            Kept::Uncertain => "what the cutter meets here is not certain",
            Kept::Mode => "the setup says keep or slow-only",
            Kept::Plunge => "the end face cuts straight down",
            Kept::Ramp => "the end face cuts downwards along a ramp",
            Kept::Entry => "lead-in, lead-out or first engagement of a cut",
            Kept::Finishing => "the move leaves the final surface",
            Kept::Fixtures => "in the air beside the blank, where clamps may stand",
            Kept::Compensation => "under G41 or G42",
            Kept::Cycle => "a drilling or boring cycle",
            Kept::Forgotten => "it was rewritten before, and what its feed was is not known any more",
            Kept::NoLoadLimit => "no load limit acts here",
            Kept::Unsound => "the stock is never touched, the spindle stands still in a cut, or a tool has no loads",
        }
    }
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
    /// Lowest feed asked for (never above the cap; a conflict is recorded in `infeasible` or [`Problem::conflicts`]).
    pub floor: Bound,
    /// Feed as programmed, mm/s.
    pub programmed_mm_s: f64,
    /// Is material cut here?
    pub cutting: bool,
    /// May the commanded feed differ from the programmed one?
    pub free: bool,
    /// The engagement is uncertain: the feed is never raised here and the block never split.
    pub uncertain: bool,
    /// The finished surface is left here.
    pub final_surface: bool,
    /// Why the feed is never above the programmed one here; `None`: it may rise.
    pub kept: Option<Kept>,
    /// Where `kept` is what lowered the cap: the cap before.
    pub unkept: Option<Bound>,
    /// A load limit that even the lowest feed allowed exceeds.
    pub infeasible: Option<LimitKind>,
}

impl Node {
    /// Length of the piece, mm.
    pub fn length_mm(&self) -> f64 {
        self.to_mm - self.from_mm
    }
}

/// A minimum that had to give way to a load limit; the load limit is met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conflict {
    /// Index of the node.
    pub node: usize,
    /// The minimum asked for.
    pub floor: Bound,
    /// The load limit that won.
    pub cap: Bound,
}

/// The path with its bounds, in order of execution.
#[derive(Debug, Clone, Default)]
pub struct Problem {
    /// Nodes in order.
    pub nodes: Vec<Node>,
    /// Range of nodes of each move, by move index.
    pub of_move: Vec<std::ops::Range<u32>>,
    /// Minima that a load limit overruled.
    pub conflicts: Vec<Conflict>,
    /// By station: the loads at the programmed feed where that is kept.
    pub known: KnownLoads,
}

impl Problem {
    /// Cuts nodes in two where a zone (from, to; mm along the move) of their move begins or ends.
    pub fn cut_at(&mut self, zones: &[Vec<[f64; 2]>]) {
        let mut nodes = Vec::with_capacity(self.nodes.len());
        let mut first_of_old = Vec::with_capacity(self.nodes.len());
        for (range, zones) in self.of_move.iter_mut().zip(zones) {
            let start = nodes.len() as u32;
            for node in &self.nodes[range.start as usize..range.end as usize] {
                first_of_old.push(nodes.len());
                let inside = |mm: &f64| *mm > node.from_mm + SAME_MM && *mm < node.to_mm - SAME_MM;
                let mut at: Vec<f64> = zones.iter().flatten().copied().filter(inside).collect();
                at.sort_by(f64::total_cmp);
                at.dedup_by(|b, a| *b - *a < SAME_MM);
                at.push(node.to_mm);
                let mut from_mm = node.from_mm;
                for to_mm in at {
                    nodes.push(Node { from_mm, to_mm, ..*node });
                    from_mm = to_mm;
                }
            }
            *range = start..nodes.len() as u32;
        }
        for conflict in &mut self.conflicts {
            conflict.node = first_of_old[conflict.node];
        }
        self.nodes = nodes;
    }
    /// Nodes of a move.
    pub fn nodes_of(&self, id: MoveId) -> &[Node] {
        self.of_move.get(id.ix()).map_or(&[], |range| &self.nodes[range.start as usize..range.end as usize])
    }
}

/// A stretch of a move with one commanded feed, and what is known of it: what the schedule answers, what the control is given, what is
/// written, and what was read back.
///
/// Three other stretches of a path are no such thing: a [`Node`] has bounds and no feed yet; a
/// [`FeedSegment`](super::feed_segments::FeedSegment) is as many nodes as one F word may stand for; the ramps' zones and
/// [`crate::job`]'s origins say where, not how fast.
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
    /// Share of the load limit that bounds it which the feed uses; `None`: no load bounds it, or the share is not known.
    pub used: Option<f64>,
}

impl FeedPiece {
    /// A feed that the program commands, of which nothing else is known.
    pub fn commanded(move_id: MoveId, [from_mm, to_mm]: [f64; 2], feed_mm_s: f64) -> Self {
        let limit = LimitKind::Programmed;
        Self { move_id, from_mm, to_mm, feed_mm_s, limit, price_s: 0.0, used: None }
    }

    /// Time for a length of it at the commanded feed, s. Nothing where the feed is not known (F0, or none was given): such a move
    /// stands still or is an error, whatever the control makes of it.
    pub fn time_s(&self, length_mm: f64) -> f64 {
        if self.feed_mm_s > 0.0 { length_mm / self.feed_mm_s } else { 0.0 }
    }
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
    /// Price of the whole room that the program may grow by, s; 0: it is not used up.
    pub lambda_s: f64,
    /// What the bound on growth costs, s.
    pub bound_costs_s: f64,
    /// Seconds saved per unit of a limit (negative: more would save time), by kind.
    pub shadow_prices: Vec<(LimitKind, f64)>,
    /// Cutting time by what bounds it, s.
    pub active_s: Vec<(LimitKind, f64)>,
    /// That of [`LimitKind::Programmed`] by the reason why the feed is not raised, s; what has none is left out.
    pub kept_s: Vec<(Kept, f64)>,
    /// How it was solved: one sentence for the report.
    pub how: String,
    /// Minima that gave way to the cap of another place under the same F word: `cap` is that word's feed and what it is for.
    pub missed: Vec<Conflict>,
    /// Windows of the convex program, those that the second solver answered, and those whose answers were refused.
    pub windows: [usize; 3],
}
