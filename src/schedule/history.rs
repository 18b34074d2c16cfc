//! What each tool has done before it comes to a station: time since the start, distance its teeth have slid, volume it has removed, and
//! where on the part it cuts. In: a toolpath, the feeds it runs at, its engagement, the job. Out: the [`State`] on which the load
//! effects of a process model depend, filled in the same way as for diagnosis ([`crate::learn`] reads the same [`Engaged`]).
//!
//! A tooth is in material over w mm in each revolution, so over ds mm of path at n rev/s and feed v it slides w·n·ds/v: the slower
//! the feed, the longer the sliding distance. Times are those of the control at the given feeds: loads at the programmed feeds use the
//! history at the programmed feeds, loads at the written feeds the history at those. Which feeds hold their limits with the wear that
//! they cause themselves: [`super::wear`].

use super::problem::FeedPiece;
use super::realise::{pieces_of_moves, realise};
use crate::effects::{Acts, Covariate, State, named, wear};
use crate::engage::{EngagementMap, Station};
use crate::force::contact::{Engaged, engaged};
use crate::machine::wear::Lengths;
use crate::machine::{Job, Tool, Wear, WearLaw};
use crate::nc::{Event, Move, Toolpath};
use crate::path::{Curve, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Stations that one thread works through in a row.
const CHUNK: usize = 1 << 10;

/// Is a history needed at all: does the process model have effects on loads, or does a tool wear?
pub fn is_asked_for(job: &Job) -> bool {
    any_law(job, |_| true) || acting(job, &|_| true)
}

/// Do loads depend on the feeds of earlier cuts, through time or through the distance that the teeth have slid?
pub fn follows_feeds(job: &Job) -> bool {
    any_law(job, |_| true) || acting(job, &|covariate| matches!(covariate, Covariate::Time | Covariate::Sliding))
}

/// Do slower feeds wear edges more per mm of path?
pub fn wears(job: &Job) -> bool {
    any_law(job, |law| law.rate.exponent < 0.0) || acting(job, &|covariate| covariate == Covariate::Sliding)
}

/// Does a tool wear by a law by which slower feeds spare it?
pub fn spares(job: &Job, tool: u32) -> bool {
    job.tool(tool).and_then(|tool| wear::of_tool(job, tool)).is_some_and(|wear| wear.law.slower_is_safer())
}

fn any_law(job: &Job, holds: impl Fn(&WearLaw) -> bool) -> bool {
    job.tools.iter().filter_map(|tool| wear::of_tool(job, tool)).any(|wear| holds(&wear.law))
}

fn acting(job: &Job, on: &dyn Fn(Covariate) -> bool) -> bool {
    // Effects that wear edges act through the wear law of each tool instead.
    let effects = job.process.effects.iter().filter_map(|used| named(&used.name));
    effects
        .filter(|effect| effect.acts == Acts::Load && effect.wear.is_none())
        .any(|effect| effect.covariates.iter().copied().any(on))
}

/// What the tool has done before it comes to the middle of a station.
#[derive(Debug, Clone, Copy, Default)]
struct ToolHistory {
    time_s: f64,
    slid: Lengths,
    volume_mm3: f64,
    since_entry_mm: f64,
    /// Length cut, each mm weighted by the pace of wear there, mm.
    wear_mm: f64,
    /// Length cut, mm.
    cut_mm: f64,
}

/// What the tool has done before each station; empty where no effect needs it.
#[derive(Debug, Clone, Default)]
pub struct History {
    past: Arc<Vec<ToolHistory>>,
    engaged: Arc<Vec<Engaged>>,
    tare_rps: f64,
    edges: Vec<Edge>,
    /// Length that each tool has cut at the end of the program, mm: plain, and weighted by the pace of wear.
    in_all: Vec<(u32, [f64; 2])>,
}

/// A tool that wears.
#[derive(Debug, Clone, Copy)]
struct Edge {
    tool: u32,
    wear: Wear,
}

impl Edge {
    /// The tools of a job that wear.
    fn all(job: &Job) -> Vec<Self> {
        let edge = |tool: &Tool| Some(Self { tool: tool.number, wear: wear::of_tool(job, tool)? });
        job.tools.iter().filter_map(edge).collect()
    }
}

impl History {
    /// The history of a program at these feeds (pieces in order of execution).
    pub fn of(toolpath: &Toolpath, map: &EngagementMap, job: &Job, feeds: &[FeedPiece]) -> Self {
        if !is_asked_for(job) {
            return Self::default();
        }
        let engaged = met_at_all(toolpath, map, job);
        let (past, tools) = pasts(toolpath, map, job, &engaged, feeds);
        let in_all = tools.iter().map(|(tool, past)| (*tool, [past.cut_mm, past.wear_mm])).collect();
        let tare_rps = job.process.tare_rps.unwrap_or(f64::NAN);
        Self { past: Arc::new(past), engaged: Arc::new(engaged), tare_rps, edges: Edge::all(job), in_all }
    }

    /// The same history with edges that have not slid at all: a lower bound of wear for any feeds.
    pub fn unworn(mut self) -> Self {
        for past in Arc::make_mut(&mut self.past) {
            past.slid = Lengths::default();
            past.wear_mm = 0.0;
        }
        self
    }

    /// How far each tooth has slid when it is at a station of the map, mm.
    pub fn slid_mm(&self, station: usize) -> f64 {
        self.past.get(station).map_or(0.0, |past| past.slid.0[0])
    }

    /// Length that a tool has cut at the end of the program, mm: plain, and weighted by the pace of wear.
    pub fn cut_by(&self, tool: u32) -> [f64; 2] {
        self.in_all.iter().find(|(known, _)| *known == tool).map_or([0.0; 2], |(_, mm)| *mm)
    }

    /// Length that the tool has cut when it is at a station of the map, mm: plain, and weighted by the pace of wear.
    pub fn cut_mm(&self, station: usize) -> [f64; 2] {
        self.past.get(station).map_or([0.0; 2], |past| [past.cut_mm, past.wear_mm])
    }

    /// State of a cut; speed and chip thickness are filled in from the engagement, that of the sectors is at a feed of 1 mm per tooth.
    pub fn state(&self, map: &EngagementMap, motion: &Move, station: &Station) -> State {
        if self.past.is_empty() {
            return State::default();
        }
        let range = &map.of_move[station.move_id.ix()];
        let before = map.stations_of(station.move_id).partition_point(|other| other.from_mm < station.from_mm);
        let index = range.start as usize + before;
        let (past, engaged) = (&self.past[index], &self.engaged[index]);
        let middle_mm = 0.5 * (station.from_mm + station.to_mm);
        let direction = motion.curve().tangent(middle_mm);
        let left = Vec3::new(-direction.y, direction.x, 0.0);
        let at = |along: f64, aside: f64| motion.curve().point(middle_mm) + direction * along + left * aside;
        let edge = self.edges.iter().find(|edge| edge.tool == motion.tool);
        State {
            time_s: past.time_s,
            slid: past.slid,
            worn: edge.map_or(0.0, |edge| edge.wear.worn(past.wear_mm)),
            volume_mm3: past.volume_mm3,
            reference_rps: self.tare_rps,
            axial_depth_mm: engaged.axial_mm,
            radial_depth_mm: engaged.section_mm2 / engaged.axial_mm.max(1e-6),
            immersion_rad: engaged.immersion_rad,
            up_share: engaged.up_share,
            up_share_chip: engaged.up_share_chip,
            mean_cosine: engaged.mean_cosine,
            position: at(engaged.contact_mm[0], engaged.contact_mm[1]),
            sectors: engaged.sectors_at(1.0, at),
            direction,
            curvature_per_mm: motion.curve().curvature(middle_mm).norm(),
            along_edge: engaged.along_edge,
            since_entry_mm: past.since_entry_mm,
            tool: f64::from(motion.tool),
            coolant: f64::from(u8::from(motion.coolant)),
            ..State::default()
        }
    }
}

/// The engagement of every station, summarised for effects.
fn met_at_all(toolpath: &Toolpath, map: &EngagementMap, job: &Job) -> Vec<Engaged> {
    let same = |a: &Station, b: &Station| are_alike(toolpath, map, [a, b]);
    let chunks = map.stations.par_chunks(CHUNK);
    chunks.flat_map_iter(|chunk| once_for_alike(chunk, same, |station| met(toolpath, map, job, station))).collect()
}

/// Are the engagements of two stations on one line equal? Those into which a long station was cut are ([`EngagementMap::cut_to`]).
fn are_alike(toolpath: &Toolpath, map: &EngagementMap, [a, b]: [&Station; 2]) -> bool {
    // Along a line the direction does not change; along an arc in space it may.
    let is_line = || matches!(toolpath.moves[a.move_id.ix()].curve(), Curve::Line { .. });
    a.move_id == b.move_id
        && a.removal_area_mm2 == b.removal_area_mm2
        && a.axial_depth_mm == b.axial_depth_mm
        && map.arcs_of(a) == map.arcs_of(b)
        && is_line()
}

/// The result of `work` for each item; an item that is like the one before it gets the result of that one.
fn once_for_alike<T, R: Clone>(items: &[T], alike: impl Fn(&T, &T) -> bool, work: impl Fn(&T) -> R) -> Vec<R> {
    let mut found: Vec<R> = Vec::with_capacity(items.len());
    for (index, item) in items.iter().enumerate() {
        let known = index.checked_sub(1).filter(|before| alike(&items[*before], item));
        found.push(known.map_or_else(|| work(item), |before| found[before].clone()));
    }
    found
}

fn met(toolpath: &Toolpath, map: &EngagementMap, job: &Job, station: &Station) -> Engaged {
    let motion = &toolpath.moves[station.move_id.ix()];
    let Some(tool) = job.tool(motion.tool).filter(|_| station.arc_count > 0) else { return Engaged::default() };
    let tangent_z = motion.curve().tangent(0.5 * (station.from_mm + station.to_mm)).z;
    engaged(station, map, map.slices_of(motion.tool), tool.flutes, tangent_z)
}

fn pasts(
    toolpath: &Toolpath,
    map: &EngagementMap,
    job: &Job,
    engaged: &[Engaged],
    feeds: &[FeedPiece],
) -> (Vec<ToolHistory>, Vec<(u32, ToolHistory)>) {
    let seconds = realise(toolpath, feeds, &job.machine).move_s;
    let of_move = pieces_of_moves(feeds, toolpath.moves.len());
    let edges = Edge::all(job);
    let mut past = vec![ToolHistory::default(); map.stations.len()];
    let mut tools: Vec<(u32, ToolHistory)> = Vec::new();
    let mut now_s = 0.0;
    for event in toolpath.events() {
        match event {
            Event::Dwell { seconds, .. } => now_s += seconds,
            Event::Tool { .. } => now_s += job.machine.tool_change_time_s,
            Event::Spindle { .. } => now_s += job.machine.spindle.runup_time_s,
            Event::Stop { .. } => {}
            Event::Move(id) => {
                let motion = &toolpath.moves[id.ix()];
                let pieces = &feeds[of_move[id.ix()].start as usize..of_move[id.ix()].end as usize];
                let pace = MoveClock::new(pieces, motion.curve().length(), seconds[id.ix()]);
                let tool = so_far(&mut tools, motion.tool);
                let edge = edges.iter().find(|edge| edge.tool == motion.tool);
                let turning = [motion.spin.rps, job.tool(motion.tool).map_or(1.0, |tool| f64::from(tool.flutes))];
                for index in map.of_move[id.ix()].clone().map(|index| index as usize) {
                    let station = &map.stations[index];
                    let [start_s, end_s] = [station.from_mm, station.to_mm].map(|at_mm| now_s + pace.at(at_mm));
                    past[index] = tool.through(station, &engaged[index], turning, [start_s, end_s], edge);
                }
                if map.of_move[id.ix()].is_empty() {
                    tool.since_entry_mm = 0.0;
                }
                now_s += seconds[id.ix()];
            }
        }
    }
    (past, tools)
}

/// The time at which a move comes to a place on it: the time of the move is divided among its pieces in proportion to length over
/// commanded feed.
struct MoveClock<'a> {
    pieces: &'a [FeedPiece],
    /// Time over length / commanded feed; seconds per mm of a move without pieces.
    share: f64,
}

impl<'a> MoveClock<'a> {
    fn new(pieces: &'a [FeedPiece], length_mm: f64, seconds: f64) -> Self {
        let commanded: f64 = pieces.iter().map(|piece| commanded_s(piece, f64::INFINITY)).sum();
        let pieces = if commanded > 0.0 { pieces } else { &[] };
        Self { pieces, share: seconds / if commanded > 0.0 { commanded } else { length_mm.max(1e-9) } }
    }
    /// Time from the beginning of the move to a place on it, s.
    fn at(&self, at_mm: f64) -> f64 {
        if self.pieces.is_empty() {
            return self.share * at_mm;
        }
        self.share * self.pieces.iter().map(|piece| commanded_s(piece, at_mm)).sum::<f64>()
    }
}

/// Length over feed of the part of a piece before a place, s.
fn commanded_s(piece: &FeedPiece, before_mm: f64) -> f64 {
    let length_mm = (piece.to_mm.min(before_mm) - piece.from_mm).max(0.0);
    if piece.feed_mm_s > 0.0 { length_mm / piece.feed_mm_s } else { 0.0 }
}

fn so_far(tools: &mut Vec<(u32, ToolHistory)>, number: u32) -> &mut ToolHistory {
    let slot = tools.iter().position(|(tool, _)| *tool == number).unwrap_or_else(|| {
        tools.push((number, ToolHistory::default()));
        tools.len() - 1
    });
    &mut tools[slot].1
}

impl ToolHistory {
    /// Takes a tool through a station. Returns what it has done before the middle of the station; for the path since entry, before its
    /// beginning, where the effect of an entry is largest.
    fn through(
        &mut self,
        station: &Station,
        met: &Engaged,
        [rps, flutes]: [f64; 2],
        [start_s, end_s]: [f64; 2],
        edge: Option<&Edge>,
    ) -> Self {
        let (length_mm, took_s) = (station.length_mm(), end_s - start_s);
        let cut_mm = if station.arc_count > 0 { length_mm } else { 0.0 };
        let feed_mm = length_mm / (took_s * rps * flutes);
        let counts = |edge: &Edge| edge.wear.law.rate.counts(met.way_mm, flutes, feed_mm);
        let wear_mm =
            edge.filter(|_| cut_mm > 0.0 && took_s > 0.0 && rps > 0.0).map_or(0.0, |edge| cut_mm * counts(edge));
        let slid = Lengths::slid(met.way_mm * rps * took_s, feed_mm);
        let removed_mm3 = met.section_mm2 * length_mm;
        if station.arc_count == 0 {
            self.since_entry_mm = 0.0;
        }
        let behind = Self {
            time_s: start_s + 0.5 * took_s,
            slid: self.slid.and(&slid.times(0.5)),
            volume_mm3: self.volume_mm3 + 0.5 * removed_mm3,
            since_entry_mm: self.since_entry_mm,
            wear_mm: self.wear_mm + 0.5 * wear_mm,
            cut_mm: self.cut_mm + 0.5 * cut_mm,
        };
        self.slid = self.slid.and(&slid);
        self.volume_mm3 += removed_mm3;
        self.wear_mm += wear_mm;
        self.cut_mm += cut_mm;
        if station.arc_count > 0 {
            self.since_entry_mm += length_mm;
        }
        behind
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engage::EngagedArc;
    use crate::engage::map::StationFlags;
    use crate::ids::MoveId;
    use crate::nc;
    use std::cell::Cell;

    #[test]
    fn what_is_like_the_item_before_is_not_worked_out_again() {
        let worked = Cell::new(0);
        let work = |item: &f64| {
            worked.set(worked.get() + 1);
            10.0 * item
        };
        let found = once_for_alike(&[1.0, 1.0, 2.0, 2.0, 1.0, 1.0], |a, b| a == b, work);
        assert_eq!(found, [10.0, 10.0, 20.0, 20.0, 10.0, 10.0]);
        assert_eq!(worked.get(), 3);
    }

    #[test]
    fn stations_are_alike_on_one_line_with_equal_engagement() {
        let text = "G21 G90 G17\nG1 X10 Y0 Z0 F100\nX20\nG2 X30 Y0 I5 J0\n";
        let toolpath = nc::interpret(&nc::parse(text.into(), None), &nc::Environment::default());
        let [first, second, arc] = [0, 1, 2].map(|index| MoveId(toolpath.moves.len() as u32 - 3 + index));
        assert!(matches!(toolpath.moves[arc.ix()].curve(), Curve::Arc(_)));
        let arcs = [0.5, 0.5, 0.6].map(|entry_rad| EngagedArc { slice: 0, entry_rad, exit_rad: 2.0 });
        let map = EngagementMap { arcs: arcs.to_vec(), ..EngagementMap::default() };
        let station = |move_id: MoveId, from_mm: f64, first_arc: u32| Station {
            move_id,
            from_mm,
            to_mm: from_mm + 1.0,
            removal_area_mm2: 3.0,
            axial_depth_mm: 6.0,
            first_arc,
            arc_count: 1,
            at_ends: [0; 2],
            flags: StationFlags::default(),
        };
        let here = station(first, 0.0, 0);
        let alike = |other: Station| are_alike(&toolpath, &map, [&here, &other]);
        assert!(alike(station(first, 1.0, 0)) && alike(station(first, 1.0, 1)));
        assert!(!alike(station(first, 1.0, 2)), "other arcs");
        assert!(!alike(station(second, 0.0, 0)), "another move may go another way");
        assert!(!alike(Station { removal_area_mm2: 3.1, ..station(first, 1.0, 0) }));
        assert!(!alike(Station { axial_depth_mm: 5.0, ..station(first, 1.0, 0) }));
        assert!(!are_alike(&toolpath, &map, [&station(arc, 0.0, 0), &station(arc, 1.0, 0)]), "an arc turns");
    }
}
