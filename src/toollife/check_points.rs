//! Places to measure force or power. In: toolpath, feeds and engagement of a program. Out: check points, each a few steady cuts in a row whose
//! readings are averaged.
//!
//! A cut along one line or arc is steady if removed section and engaged angle of its stations differ by no more than [`ALIKE`]. A tool radius and
//! the way that the axes need to reach the feed, v²/2a, are taken off at both ends; the rest must last for [`LEAST_S`]. Of all steady cuts
//! only those count that resemble the largest part of the path, so that all check points measure the same cut.

use crate::engage::{EngagementMap, Station};
use crate::ids::MoveId;
use crate::machine::{Job, Tool};
use crate::nc::{Move, MoveKind, Toolpath};
use crate::schedule::FeedPiece;
use crate::schedule::realise::pieces_of_moves;

/// Relative difference of section and angle within which cuts are alike.
pub const ALIKE: f64 = 0.02;
/// Time that a reading needs, s: meters of spindle load average over some tenths of a second. Judgement.
pub const LEAST_S: f64 = 0.4;
/// Most cuts of a check point.
pub const MOST_CYCLES: usize = 4;
/// Cuts of a check point begin within this share of the distance between check points.
const NEAR: f64 = 0.25;

/// A steady cut to read at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle {
    /// Its move.
    pub move_id: MoveId,
    /// Where the reading begins and ends, mm along the move.
    pub read_mm: [f64; 2],
    /// What the tool has cut in this program when it is in the middle of the reading, mm.
    pub cut_mm: f64,
}

/// A check point.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckPoint {
    /// Number, from 1.
    pub number: u32,
    /// Its cuts in order.
    pub cycles: Vec<Cycle>,
}

/// Where check points are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Tool.
    pub tool: u32,
    /// Length cut before the first, mm.
    pub first_mm: f64,
    /// Length cut from each to the next, mm.
    pub every_mm: f64,
}

/// Length that a tool cuts in a program, mm.
pub fn cut_mm(toolpath: &Toolpath, map: &EngagementMap, tool: u32) -> f64 {
    moves_of(toolpath, tool).flat_map(|(id, _)| map.stations_of(id)).map(cut_of).sum()
}

/// Check points along the program at these feeds.
pub fn choose(
    toolpath: &Toolpath,
    map: &EngagementMap,
    job: &Job,
    feeds: &[FeedPiece],
    spread: &Spread,
) -> Vec<CheckPoint> {
    let Some(tool) = job.tool(spread.tool) else { return Vec::new() };
    let steady = most_alike(steady_cuts(toolpath, map, job, feeds, tool));
    let mut points: Vec<CheckPoint> = Vec::new();
    let mut wanted_mm = spread.first_mm;
    let all_mm = cut_mm(toolpath, map, spread.tool);
    while wanted_mm <= all_mm {
        let last_mm = wanted_mm + NEAR * spread.every_mm;
        let near = steady.iter().filter(|cut| (wanted_mm..=last_mm).contains(&cut.cycle.cut_mm));
        let cycles: Vec<Cycle> = near.take(MOST_CYCLES).map(|cut| cut.cycle).collect();
        if !cycles.is_empty() {
            points.push(CheckPoint { number: points.len() as u32 + 1, cycles });
        }
        wanted_mm += spread.every_mm;
    }
    points
}

/// Every steady cut of a tool, in order.
pub fn steady(toolpath: &Toolpath, map: &EngagementMap, job: &Job, feeds: &[FeedPiece], tool: u32) -> Vec<Cycle> {
    let cuts = job.tool(tool).map(|tool| steady_cuts(toolpath, map, job, feeds, tool));
    cuts.into_iter().flatten().map(|cut| cut.cycle).collect()
}

fn moves_of(toolpath: &Toolpath, tool: u32) -> impl Iterator<Item = (MoveId, &Move)> {
    let moves = toolpath.moves.iter().enumerate();
    moves.filter(move |(_, m)| m.tool == tool && m.kind == MoveKind::Feed).map(|(k, m)| (MoveId(k as u32), m))
}

fn cut_of(station: &Station) -> f64 {
    if station.arc_count > 0 { station.length_mm() } else { 0.0 }
}

/// A steady cut with what the cutter meets on it.
struct Steady {
    cycle: Cycle,
    kind: Kind,
}

/// What a cutter meets: removed section (mm²), engaged angle of all slices (rad), signed curvature of the path (1/mm).
#[derive(Clone, Copy)]
struct Kind {
    section_mm2: f64,
    angle_rad: f64,
    curvature_per_mm: f64,
}

impl Kind {
    fn of(map: &EngagementMap, station: &Station, curvature_per_mm: f64) -> Self {
        let angle = |arc: &crate::engage::EngagedArc| f64::from(arc.exit_rad - arc.entry_rad);
        let angle_rad = map.arcs_of(station).iter().map(angle).sum();
        Self { section_mm2: f64::from(station.removal_area_mm2), angle_rad, curvature_per_mm }
    }
    fn is_like(&self, other: &Self) -> bool {
        let near = |a: f64, b: f64| (a - b).abs() <= ALIKE * a.abs().max(b.abs());
        near(self.section_mm2, other.section_mm2)
            && near(self.angle_rad, other.angle_rad)
            && near(self.curvature_per_mm, other.curvature_per_mm)
    }
}

fn steady_cuts(toolpath: &Toolpath, map: &EngagementMap, job: &Job, feeds: &[FeedPiece], tool: &Tool) -> Vec<Steady> {
    let pieces = pieces_of_moves(feeds, toolpath.moves.len());
    let slowest = job.machine.axes[..2].iter().map(|axis| axis.acceleration_mm_s2).fold(f64::INFINITY, f64::min);
    let (mut found, mut before_mm) = (Vec::new(), 0.0);
    for (id, motion) in moves_of(toolpath, tool.number) {
        let range = &pieces[id.ix()];
        let feed = feeds[range.start as usize..range.end as usize].iter().map(|piece| piece.feed_mm_s).reduce(f64::max);
        let stations = map.stations_of(id);
        // A block that is executed twice has one line for two places.
        let once = motion.instance == 0 && motion.shared.is_none() && !motion.cycle;
        if let Some(feed_mm_s) = feed.filter(|feed| once && *feed > 0.0) {
            let off_mm = tool.radius_mm().max(feed_mm_s * feed_mm_s / (2.0 * slowest));
            for (first, last, kind) in alike(map, motion, stations) {
                let read_mm = [stations[first].from_mm + off_mm, stations[last].to_mm - off_mm];
                if read_mm[1] - read_mm[0] >= LEAST_S * feed_mm_s {
                    let middle_mm = 0.5 * (read_mm[0] + read_mm[1]);
                    let whole: f64 = stations[..first].iter().map(cut_of).sum();
                    let cut_mm = before_mm + whole + middle_mm - stations[first].from_mm;
                    found.push(Steady { cycle: Cycle { move_id: id, read_mm, cut_mm }, kind });
                }
            }
        }
        before_mm += stations.iter().map(cut_of).sum::<f64>();
    }
    found
}

/// Runs of stations of one move that meet the same: first, last, and what.
fn alike(map: &EngagementMap, motion: &Move, stations: &[Station]) -> Vec<(usize, usize, Kind)> {
    let curve = motion.curve();
    let kind = |station: &Station| {
        let middle_mm = 0.5 * (station.from_mm + station.to_mm);
        let (tangent, bend) = (curve.tangent(middle_mm), curve.curvature(middle_mm));
        Kind::of(map, station, tangent.x * bend.y - tangent.y * bend.x)
    };
    let mut runs: Vec<(usize, usize, Kind)> = Vec::new();
    for (index, station) in stations.iter().enumerate() {
        if station.arc_count == 0 || station.flags.uncertain {
            continue;
        }
        let here = kind(station);
        match runs.last_mut() {
            Some((_, last, known)) if *last + 1 == index && known.is_like(&here) => *last = index,
            _ => runs.push((index, index, here)),
        }
    }
    runs
}

/// Those that are like most of the length.
fn most_alike(cuts: Vec<Steady>) -> Vec<Steady> {
    let length = |cut: &Steady| cut.cycle.read_mm[1] - cut.cycle.read_mm[0];
    let mut kinds: Vec<(Kind, f64)> = Vec::new();
    for cut in &cuts {
        match kinds.iter_mut().find(|(kind, _)| kind.is_like(&cut.kind)) {
            Some((_, all_mm)) => *all_mm += length(cut),
            None => kinds.push((cut.kind, length(cut))),
        }
    }
    let Some((most, _)) = kinds.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)) else { return cuts };
    cuts.into_iter().filter(|cut| most.is_like(&cut.kind)).collect()
}
