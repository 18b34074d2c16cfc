//! Feeds that may not be raised above the programmed one, and why. In: toolpath, engagement, job and rules. Out: the reason ([`NotRaised`])
//! for each station, and for the stretches around first and last contact, whose ends need not be those of stations. Such a feed is still
//! lowered where a limit requires it.
//!
//! The reasons, for a station of a feed move with the tangent t of the path in its middle (t_z < 0: downwards):
//!
//! | reason | holds where |
//! |---|---|
//! | plunge | material is cut and −t_z > cos 45°: the tool goes down faster than it goes aside |
//! | ramp | material is cut, it is no plunge, and −t_z times the length of the move is more than [`LEVEL_MM`](super::kinds_of_cut::LEVEL_MM) |
//! | entry | the path is within one tool radius after first contact, or before the last one, of a cut ([`entries`]) |
//! | finishing | the station, or one within a cell's diagonal, leaves the finished surface by a cut no thicker than an [allowance](super::kinds_of_cut::ALLOWANCE) |
//! | compensation | G41 or G42 (RL, RR) is in force |
//! | fixtures | nothing is cut, below the top of the blank and beyond its outline, and the setup says nothing of clamps |
//! | cycle | the move belongs to a drilling or boring cycle (which is then neither plunge nor ramp) |
//!
//! A descent or a retract in air is neither plunge nor ramp; only compensation and cycle apply to it. A plunge, a ramp or a cycle that
//! `[raise]` allows rises only where axial force, power or torque is limited: the loads that grow with what the end face cuts.
//!
//! Where the simulation as a whole cannot be right (the stock is never touched, the spindle stands still in a cut, a tool has
//! no loads, the cuts take far less than the stock loses) nothing is raised anywhere, in air or in cuts.

use super::cutters::{Cutters, SLIVER_MM, skims};
use super::kinds_of_cut::{downwards, finishing};
use super::problem::{Bound, Node, NotRaised, Problem};
use super::ramps::spread;
use super::rules::{Rule, Rules};
use crate::engage::{EngagementMap, EventKind, Station};
use crate::ids::MoveId;
use crate::machine::{Job, LimitKind, Mode};
use crate::nc::{Move, MoveKind, Toolpath};
use crate::path::Curve;
use std::f64::consts::PI;

/// Loads that grow with what the end face cuts: a plunge is raised only where one of them is limited.
const OF_THE_END_FACE: [LimitKind; 3] = [LimitKind::ForceAxial, LimitKind::Power, LimitKind::Torque];

/// Finds the reasons of one program.
pub struct Reasons<'a> {
    toolpath: &'a Toolpath,
    map: &'a EngagementMap,
    rules: &'a Rules,
    /// By station: a finishing pass leaves the finished surface here.
    finishing: Vec<bool>,
    unsound: bool,
    /// There is air feed, and the setup does not say what clamps the part.
    clamps_unknown: bool,
}

impl<'a> Reasons<'a> {
    /// Works out once what the reasons of all stations need.
    pub fn new(toolpath: &'a Toolpath, map: &'a EngagementMap, job: &Job, rules: &'a Rules, cutters: &Cutters) -> Self {
        let finishing = finishing(toolpath, map, job);
        let unsound = unsound(toolpath, map, job, cutters);
        let clamps_unknown = job.air_feed.is_some() && !job.fixtures_are_known;
        Self { toolpath, map, rules, finishing, unsound, clamps_unknown }
    }

    /// Why the feed of a station, or of a feed move without stations, is not raised; `None`: it may rise. Entries are found by
    /// [`entries`].
    pub fn of(&self, id: MoveId, station: Option<&Station>) -> Option<NotRaised> {
        let (motion, rule) = (&self.toolpath.moves[id.ix()], self.rules.of(id));
        let of_text = motion.freeze.map(NotRaised::Frozen);
        let of_mode = (rule.mode != Mode::Optimise).then_some(NotRaised::Mode);
        let of_program = self.unsound.then_some(NotRaised::Unsound);
        let uncertain = !motion.placed || station.is_none_or(|station| station.flags.uncertain);
        let uncertain = uncertain.then_some(NotRaised::Uncertain);
        let before = of_text.or(of_mode).or(of_program).or_else(|| self.doubt(id, rule)).or(uncertain);
        before.or_else(|| self.of_cut(motion, rule, station?))
    }

    /// The first doubt about part or frame that the setup does not confirm to be harmless.
    fn doubt(&self, id: MoveId, rule: &Rule) -> Option<NotRaised> {
        let mut open = self.toolpath.doubts_at(id).filter(|doubted| !rule.confirmed.contains(&doubted.doubt.name()));
        open.next().map(|doubted| NotRaised::Doubt(doubted.doubt))
    }

    fn of_cut(&self, motion: &Move, rule: &Rule, station: &Station) -> Option<NotRaised> {
        let raise = rule.raise;
        let refused = |kept: NotRaised, allowed: Option<bool>| (allowed != Some(true)).then_some(kept);
        let way = if motion.cycle { Some(NotRaised::Cycle) } else { downwards(motion, station) };
        let of_way = way.and_then(|kept| match kept {
            NotRaised::Plunge => refused(kept, raise.plunges),
            NotRaised::Ramp => refused(kept, raise.ramps),
            _ => refused(kept, raise.cycles),
        });
        let compensated = motion.compensated.then(|| refused(NotRaised::Compensation, raise.compensation)).flatten();
        let index = self.map.of_move[station.move_id.ix()].start as usize + self.index_in_move(station);
        let final_surface = self.finishing[index].then(|| refused(NotRaised::Finishing, raise.finishing)).flatten();
        let answers = rule.loads.iter().any(|(kind, _)| OF_THE_END_FACE.contains(kind));
        let unanswered = (way.is_some() && !answers).then_some(NotRaised::NoLoadLimit);
        let clamps = (station.flags.beside_blank && self.clamps_unknown).then_some(NotRaised::Fixtures);
        of_way.or(compensated).or(final_surface).or(unanswered).or(clamps)
    }

    /// Index of a station among those of its move.
    fn index_in_move(&self, station: &Station) -> usize {
        self.map.stations_of(station.move_id).partition_point(|other| other.from_mm < station.from_mm)
    }
}

/// Is the simulation as a whole impossible? That is so if the stock is never touched, the spindle stands still in a cut, a tool that cuts
/// has no loads, or the cuts take far less than the stock loses.
fn unsound(toolpath: &Toolpath, map: &EngagementMap, job: &Job, cutters: &Cutters) -> bool {
    let untouched = map.touches_nothing() && toolpath.moves.iter().any(|motion| motion.kind == MoveKind::Feed);
    let at_rest = map.events.iter().any(|event| event.kind == EventKind::SpindleStopped);
    let cuts = |motion: &Move, station: &Station| station.arc_count > 0 && motion.freeze.is_none();
    let without_loads = |station: &Station| {
        let motion = &toolpath.moves[station.move_id.ix()];
        cuts(motion, station) && cutters.of(station.move_id).is_none() && job.tool(motion.tool).is_some()
    };
    untouched || at_rest || map.misses_cuts().is_some() || map.stations.iter().any(without_loads)
}

/// Keeps the feed at the beginnings and the ends of cuts, cutting nodes where they end. `touches`: by node, is more than the
/// rounding of coordinates cut?
///
/// A cut lasts while the tool touches material along feed moves of one tool, gaps up to [`SLIVER_MM`] included. Engagement
/// is established once the tool has travelled its radius from first contact: going straight into a straight flank with any
/// immersion φ it has its final engagement after R·sin φ (R in a slot). An arc of at most half a turn on which contact begins
/// or ends in the middle is a lead-in or a lead-out, and counts as a whole: a contour goes on after it with another block.
pub fn entries(problem: &mut Problem, toolpath: &Toolpath, job: &Job, rules: &Rules, touches: &[bool]) {
    let mut zones: Vec<Vec<[f64; 2]>> = vec![Vec::new(); toolpath.moves.len()];
    let mut put = |id: MoveId, zone: [f64; 2]| zones[id.ix()].push(zone);
    for cut in cuts(&problem.nodes, toolpath, touches) {
        let nodes = &problem.nodes[cut];
        let pieces = || nodes.iter().map(|node| (node.move_id, node.from_mm, node.to_mm));
        let ends = nodes.first().zip(nodes.last());
        let Some((first, last)) = ends else { continue };
        let radius_mm = job.tool(toolpath.moves[first.move_id.ix()].tool).map_or(0.0, |tool| 0.5 * tool.diameter_mm);
        let lead = |node: &Node, in_air_mm: f64, rest_mm: f64| {
            let curve = toolpath.moves[node.move_id.ix()].curve();
            let is_lead = in_air_mm > SLIVER_MM && matches!(curve, Curve::Arc(arc) if arc.sweep_rad.abs() <= PI + 1e-6);
            if is_lead { radius_mm.max(rest_mm) } else { radius_mm }
        };
        let whole = |node: &Node| toolpath.moves[node.move_id.ix()].curve().length();
        spread(pieces(), lead(first, first.from_mm, whole(first) - first.from_mm), false, &mut put);
        spread(pieces().rev(), lead(last, whole(last) - last.to_mm, last.to_mm), true, &mut put);
    }
    problem.cut_at(&zones);
    for node in problem.nodes.iter_mut().filter(|node| node.free && node.not_raised.is_none()) {
        let middle = 0.5 * (node.from_mm + node.to_mm);
        let within = zones[node.move_id.ix()].iter().any(|zone| zone[0] <= middle && middle <= zone[1]);
        if within && rules.of(node.move_id).raise.entries != Some(true) {
            hold_at_programmed(node, NotRaised::Entry);
        }
    }
}

/// Lowers the cap of a node to the programmed feed, and records why.
pub fn hold_at_programmed(node: &mut Node, why: NotRaised) {
    node.not_raised = node.not_raised.or(Some(why));
    if node.programmed_mm_s < node.cap.feed_mm_s {
        node.cap_if_raised = Some(node.cap);
        node.cap = Bound { feed_mm_s: node.programmed_mm_s, kind: LimitKind::Programmed, per_unit: 0.0 };
        node.floor.feed_mm_s = node.floor.feed_mm_s.min(node.cap.feed_mm_s);
    }
}

/// The feeds of a file that Feedwright wrote before, when it is optimised once more.
#[derive(Clone, Copy)]
pub struct EarlierOutput<'a> {
    /// Its moves with the feeds that stand in it.
    pub toolpath: &'a Toolpath,
    /// How far the ends of entries and finishing passes may differ between two simulations of one path that is divided into other blocks,
    /// mm: each simulation knows them only to a station.
    pub apart_mm: f64,
}

/// Lets an entry or a finishing pass end where the earlier run let it end. That run split the blocks there. Simulated in the split blocks,
/// the first contact belongs to another station, and the end falls a little into the block whose feed was raised. So where a stretch
/// shorter than this uncertainty stands above its original feed, it keeps the feed that stands there, as far as the limits allow. A longer
/// stretch goes back to its original feed: then setup or file have changed since.
pub fn keep_earlier_ends(problem: &mut Problem, earlier: &EarlierOutput<'_>) {
    let stands = |node: &Node| earlier.toolpath.moves[node.move_id.ix()].feed.mm_s;
    let raised = |node: &Node| {
        let of_zone = matches!(node.not_raised, Some(NotRaised::Entry | NotRaised::Finishing))
            && node.cap.kind == LimitKind::Programmed;
        node.free && of_zone && node.cap_if_raised.is_some() && stands(node) > node.cap.feed_mm_s * (1.0 + 1e-9)
    };
    for run in problem.nodes.chunk_by_mut(|a, b| raised(a) == raised(b)) {
        let length_mm: f64 = run.iter().map(Node::length_mm).sum();
        if length_mm >= earlier.apart_mm || !run.first().is_some_and(raised) {
            continue;
        }
        for node in run {
            let there = Bound { feed_mm_s: stands(node), kind: LimitKind::Programmed, per_unit: 0.0 };
            let allowed = node.cap_if_raised.take().unwrap_or(there);
            node.cap = if allowed.feed_mm_s < there.feed_mm_s { allowed } else { there };
            node.not_raised = None;
        }
    }
}

/// Ranges of nodes between first and last contact.
fn cuts(nodes: &[Node], toolpath: &Toolpath, touches: &[bool]) -> Vec<std::ops::Range<usize>> {
    let mut found: Vec<std::ops::Range<usize>> = Vec::new();
    let mut gap_mm = f64::INFINITY;
    let mut tool = None;
    for (i, node) in nodes.iter().enumerate() {
        let motion = &toolpath.moves[node.move_id.ix()];
        if motion.kind == MoveKind::Rapid || tool != Some(motion.tool) {
            gap_mm = f64::INFINITY;
        }
        tool = Some(motion.tool);
        if !touches[i] {
            gap_mm += node.length_mm();
            continue;
        }
        match found.last_mut() {
            Some(cut) if gap_mm <= SLIVER_MM => cut.end = i + 1,
            _ => found.push(i..i + 1),
        }
        gap_mm = 0.0;
    }
    found
}

/// Is more than the rounding of coordinates cut at a station?
pub fn touches(station: Option<&Station>) -> bool {
    station.is_some_and(|station| station.arc_count > 0 && !skims(station))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nc::{Environment, interpret, parse};

    /// A block written at F2400 of which an entry of this length is to run at 600, with 1800 allowed by a force: cap in mm/min
    /// of the entry and of the rest.
    fn caps(entry_mm: f64, why: NotRaised, apart_mm: f64) -> [f64; 2] {
        let program = parse("G21 G90 G94\nG1 X20 F2400\nM30\n".into(), None);
        let toolpath = interpret(&program, &Environment::default());
        let bound = |feed_mm_min: f64, kind| Bound { feed_mm_s: feed_mm_min / 60.0, kind, per_unit: 0.0 };
        let bounds = [bound(0.0, LimitKind::FeedMin), bound(1800.0, LimitKind::ForceXy)];
        let rest = Node { from_mm: entry_mm, to_mm: 20.0, ..Node::between(bounds[0], bounds[1]) };
        let mut entry = Node { from_mm: 0.0, to_mm: entry_mm, ..rest };
        hold_at_programmed(&mut entry, why);
        let mut problem = Problem { nodes: vec![entry, rest], ..Problem::default() };
        keep_earlier_ends(&mut problem, &EarlierOutput { toolpath: &toolpath, apart_mm });
        [0, 1].map(|i| (60.0 * problem.nodes[i].cap.feed_mm_s).round())
    }

    #[test]
    fn an_entry_ends_where_the_file_lets_it_end_within_a_station_and_under_the_loads() {
        assert_eq!(caps(0.99, NotRaised::Entry, 1.0), [1800.0; 2]);
        assert_eq!(caps(1.01, NotRaised::Entry, 1.0), [600.0, 1800.0]);
        assert_eq!(caps(0.99, NotRaised::Finishing, 1.0), [1800.0; 2]);
        assert_eq!(caps(0.99, NotRaised::Plunge, 1.0), [600.0, 1800.0]);
    }
}
