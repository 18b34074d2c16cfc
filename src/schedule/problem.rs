//! The data that the schedule starts from and ends with. In: nothing; the other files of this room fill them. Out: a [`Problem`] (nodes
//! with their caps and floors) and a [`Schedule`] (feed pieces, times and prices).

use super::known_loads::KnownLoads;
use crate::ids::MoveId;
use crate::machine::LimitKind;
use crate::nc::{Doubt, Freeze};

/// Two places along a move count as one when they are nearer to each other than this, mm.
const SAME_MM: f64 = 1e-6;

/// A bound on the commanded feed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Feed, mm/s.
    pub feed_mm_s: f64,
    /// The limit that it comes from.
    pub kind: LimitKind,
    /// d feed / d limit, (mm/s) per unit of the limit as the report shows it ([`LimitKind::unit`]); 0 where it is not known.
    pub per_unit: f64,
}

/// Why a feed is not raised above the programmed one, whatever the limits would allow. It may still be lowered, unless the
/// node is not [`Node::free`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum NotRaised {
    /// The program text or the setup does not let this feed change.
    Frozen(Freeze),
    /// It is not known where the part stands, or in which frame the coordinates are.
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
    /// In the air.
    Air,
    /// Under G41 or G42.
    Compensation,
    /// A drilling or boring cycle.
    Cycle,
    /// Feedwright rewrote this file before, and the feed that stood here originally is no longer recorded in it.
    Forgotten,
    /// No limit on force, power, torque, deflection, stress or chip thickness applies here that any load comes near
    /// ([`super::idle_limits`]), or the load here cannot be predicted.
    NoLoadLimit,
    /// The simulation as a whole cannot be right: the stock is never touched, the spindle stands still in a cut, a tool has
    /// no loads, or the cuts take far less than the stock loses.
    Unsound,
}

impl NotRaised {
    /// One clause for reports, after "kept as programmed:".
    pub fn why(self) -> &'static str {
        match self {
            NotRaised::Frozen(freeze) => freeze.why(),
            NotRaised::Doubt(doubt) => doubt.why(),
            NotRaised::Uncertain => "the engagement is uncertain here",
            NotRaised::Mode => "the setup says keep or slow-only",
            NotRaised::Plunge => "the end face cuts straight down",
            NotRaised::Ramp => "the end face cuts downwards along a ramp",
            NotRaised::Entry => "lead-in, lead-out or first engagement of a cut",
            NotRaised::Finishing => "the move leaves the final surface",
            NotRaised::Fixtures => "in the air beside the blank, where clamps may stand",
            NotRaised::Air => "in the air, where only air_feed raises",
            NotRaised::Compensation => "under G41 or G42",
            NotRaised::Cycle => "a drilling or boring cycle",
            NotRaised::Forgotten => "an earlier run rewrote it, and its original feed is lost",
            NotRaised::NoLoadLimit => "no load limit acts here",
            NotRaised::Unsound => {
                "the stock is never touched, the spindle stands still in a cut, a tool has no loads, or cuts are missing"
            }
        }
    }
}

/// A reason for a programmed feed in the written program, and the place that has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kept {
    /// The reason.
    pub why: NotRaised,
    /// Where it holds.
    pub place: KeptPlace,
}

/// The place for which a feed is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeptPlace {
    /// The place itself.
    Here,
    /// Another one under the same F word.
    SameFeed,
    /// Another one in the runs of a line that is executed several times, all with one feed.
    AnotherRun,
}

impl Kept {
    /// For reports, after "kept,".
    pub fn in_words(self) -> String {
        let why = self.why.why();
        match self.place {
            KeptPlace::Here => why.to_owned(),
            KeptPlace::SameFeed => format!("for another place with the same F word: {why}"),
            KeptPlace::AnotherRun => {
                format!("for another place in the runs of the same line, which --expand writes apart: {why}")
            }
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
    /// Highest feed at which every limit is met, and the limit that sets it.
    pub cap: Bound,
    /// Lowest feed that the setup asks for. Never above the cap: where the two contradict each other, `infeasible` or
    /// [`Problem::conflicts`] records it.
    pub floor: Bound,
    /// Feed as programmed, mm/s.
    pub programmed_mm_s: f64,
    /// Is material cut here?
    pub cutting: bool,
    /// May the commanded feed differ from the programmed one?
    pub free: bool,
    /// The engagement is uncertain: the feed is never raised here and the block never split.
    pub uncertain: bool,
    /// What this cut leaves is the surface of the finished part.
    pub final_surface: bool,
    /// Why the feed is never above the programmed one here; `None`: it may rise.
    pub not_raised: Option<NotRaised>,
    /// Where the cap was lowered to the programmed feed because of `not_raised`: the cap that the limits alone give.
    pub cap_if_raised: Option<Bound>,
    /// A load limit that is exceeded even at the lowest feed allowed.
    pub infeasible: Option<LimitKind>,
}

#[cfg(test)]
impl Node {
    /// For tests: 10 mm of a cut of the first move, programmed at 10 mm/s, between these bounds; everything else open.
    pub(crate) fn between(floor: Bound, cap: Bound) -> Self {
        Self {
            move_id: MoveId(0),
            from_mm: 0.0,
            to_mm: 10.0,
            cap,
            floor,
            programmed_mm_s: 10.0,
            cutting: true,
            free: true,
            uncertain: false,
            final_surface: false,
            not_raised: None,
            cap_if_raised: None,
            infeasible: None,
        }
    }
}

impl Node {
    /// Length of the piece, mm.
    pub fn length_mm(&self) -> f64 {
        self.to_mm - self.from_mm
    }
}

/// A minimum feed that lies above the cap: that of a load limit, or of how much a feed may change. The cap is kept, the minimum is not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conflict {
    /// Index of the node.
    pub node: usize,
    /// The minimum asked for.
    pub floor: Bound,
    /// What won.
    pub cap: Bound,
}

/// The path with its bounds, in order of execution.
#[derive(Debug, Clone, Default)]
pub struct Problem {
    /// Nodes in order.
    pub nodes: Vec<Node>,
    /// Range of nodes of each move, by move index.
    pub of_move: Vec<std::ops::Range<u32>>,
    /// Minima that were overruled.
    pub conflicts: Vec<Conflict>,
    /// By station: the loads at the programmed feed, where the feed stays at that.
    pub known: KnownLoads,
}

impl Problem {
    /// Cuts nodes in two where a zone of their move begins or ends. `zones`: by move, [from, to] in mm along it.
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

/// A stretch of a move with one commanded feed. The schedule answers with these, the model of the control takes them, the text is written
/// from them, and reading the text back gives them again.
///
/// Not to be confused with three other stretches of a path: a [`Node`] has bounds and no feed yet; a
/// [`FeedSegment`](super::feed_segments::FeedSegment) is as many nodes as one F word may stand for; the zones of ramps and the
/// origins in [`crate::job`] say where, not how fast.
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
    /// Where a load limit bounds the feed: the load at this feed as a share of that limit. `None`: no load bounds it, or the load is not
    /// known.
    pub used: Option<f64>,
}

impl FeedPiece {
    /// A feed that the program commands, of which nothing else is known.
    pub fn commanded(move_id: MoveId, [from_mm, to_mm]: [f64; 2], feed_mm_s: f64) -> Self {
        let limit = LimitKind::Programmed;
        Self { move_id, from_mm, to_mm, feed_mm_s, limit, price_s: 0.0, used: None }
    }

    /// Time that `length_mm` of it takes at the commanded feed, s; 0 where the feed is not known (F0, or no F word yet): at such a move a
    /// control stands still or reports an error.
    pub fn time_s(&self, length_mm: f64) -> f64 {
        if self.feed_mm_s > 0.0 { length_mm / self.feed_mm_s } else { 0.0 }
    }
}

/// Times of the program as the model of the control predicts them.
#[derive(Debug, Clone, Default)]
pub struct Realised {
    /// Time of each move, s, by move index.
    pub move_s: Vec<f64>,
    /// Cycle time with dwells, tool changes and spindle run-ups, s.
    pub total_s: f64,
    /// Time by cause: name and seconds.
    pub by_cause: Vec<(&'static str, f64)>,
}

/// The written feed of a node, and whose cap it comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holder {
    /// Written feed, mm/s; infinite where no piece covers the node.
    pub feed_mm_s: f64,
    /// Index of the node with the lowest cap under the same feed.
    pub node: u32,
}

/// Share of what a place allows that its written feed must reach for the place to hold it itself; the rounding of an F word is less.
const OWN: f64 = 0.98;

impl Holder {
    /// Is the written feed lower than what the place itself would run at, mm/s, so that another place holds it?
    pub fn is_elsewhere(&self, own_mm_s: f64) -> bool {
        self.feed_mm_s < OWN * own_mm_s
    }
}

/// What one more unit of a limit for one tool changes the time by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowPrice {
    /// The limit.
    pub kind: LimitKind,
    /// The tool whose cuts it bounds.
    pub tool: u32,
    /// Seconds per unit of the report ([`LimitKind::unit`]); negative: more saves time.
    pub per_unit_s: f64,
}

/// The feeds of the whole program, with their times and prices.
#[derive(Debug, Clone, Default)]
pub struct Schedule {
    /// Commanded feeds of every feed move, in order; the pieces of a move tile it.
    pub pieces: Vec<FeedPiece>,
    /// Cycle time if the feed could change anywhere without an F word, s: no written program is faster.
    pub continuous_s: f64,
    /// Multiplier λ of the bound on the program's growth: seconds that using up all of the allowed growth is charged with; 0 where the
    /// bound does not bind.
    pub lambda_s: f64,
    /// How much longer the program takes because its growth is bounded, s.
    pub bound_costs_s: f64,
    /// What one more unit of a limit would save.
    pub shadow_prices: Vec<ShadowPrice>,
    /// What holds the written feed of each node, by node.
    pub holders: Vec<Holder>,
    /// Cutting time of the written program by what bounds it, s.
    pub active_s: Vec<(LimitKind, f64)>,
    /// The part of `active_s` that [`LimitKind::Programmed`] bounds, by the reason why the feed is not raised, s. Time without such a
    /// reason is left out.
    pub not_raised_s: Vec<(Kept, f64)>,
    /// How it was solved: one sentence for the report.
    pub how: String,
    /// Minimum feeds that are not kept because the same F word also covers a place with a lower cap. `cap` is the feed of that word with
    /// the limit it comes from.
    pub missed: Vec<Conflict>,
    /// Number of windows of the convex program, of those that the second solver answered, and of those whose answers the checker refused.
    pub windows: [usize; 3],
}
