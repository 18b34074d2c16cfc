//! The engagement of a whole program. In: filled by [`super::stations`]. Out: [`EngagementMap`], which loads, caps and reports read.
//!
//! A *station* is the piece `from_mm..to_mm` of a feed move; the stations of a move tile it in order. Its arcs are all those that are in
//! material anywhere on the piece. Where a cut or a path begins or ends, those engaged at that very place are known too; elsewhere they are what
//! two stations that follow each other share. The immersion angle φ counts from the +Y normal of the feed direction, clockwise seen from the spindle,
//! feed along +X: up-milling begins at φ = 0, climb milling ends at φ = π. Under a vertical feed the last horizontal direction is used.

use crate::ids::MoveId;
use crate::machine::Slice;
use crate::nc::{Move, MoveKind};

/// Cosine of the largest bend, 1°, across which immersion angles of two stations can be compared: of the ends of blocks, rounding turns less.
const STRAIGHT: f64 = 0.99985;

/// An engaged stretch of the circle of one slice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EngagedArc {
    /// Index into the slices of the tool ([`EngagementMap::slices`]).
    pub slice: u32,
    /// Where it begins, rad.
    pub entry_rad: f32,
    /// Where it ends, rad; `entry_rad < exit_rad`.
    pub exit_rad: f32,
}

/// Properties of a station beside its arcs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StationFlags {
    /// Nothing is cut, not even with the stock grown by its uncertainty and the approach distance: air feed is allowed.
    pub clear_air: bool,
    /// In clear air, below the top of the blanks and reaching beyond their outlines: a clamp may stand here.
    pub beside_blank: bool,
    /// The engagement is uncertain here (undercut, unknown stock): the feed must not be raised, and the block must not be split.
    pub uncertain: bool,
    /// The move leaves the surface of the finished part here.
    pub final_surface: bool,
}

/// One piece of a move with its engagement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Station {
    /// Its move.
    pub move_id: MoveId,
    /// Where the piece begins, mm along the move.
    pub from_mm: f64,
    /// Where it ends, mm along the move.
    pub to_mm: f64,
    /// Volume removed per mm of path over the piece, mm².
    pub removal_area_mm2: f32,
    /// Height above the tip up to which the cutter is engaged, mm.
    pub axial_depth_mm: f32,
    /// First of its arcs.
    pub first_arc: u32,
    /// Number of its arcs; 0: nothing is cut.
    pub arc_count: u32,
    /// Numbers of those of them that are engaged at its very beginning, kept before its arcs, and at its very end, kept after them. 0 where all
    /// are, where none is, and where the path goes on with a station that shows it.
    pub at_ends: [u32; 2],
    /// Its other properties.
    pub flags: StationFlags,
}

impl Station {
    /// Length of the piece, mm.
    pub fn length_mm(&self) -> f64 {
        self.to_mm - self.from_mm
    }
}

/// A kind of dangerous event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum EventKind {
    /// The cutter removes material in a rapid.
    CutAtRapid,
    /// The shank meets stock.
    ShankContact,
    /// The holder meets stock.
    HolderContact,
    /// A fixture is touched.
    FixtureContact,
    /// A tool that does not cut at its centre plunges into material.
    PlungeNotCentreCutting,
    /// The height field cannot represent the stock here.
    Undercut,
    /// The spindle stands still while the tool cuts.
    SpindleStopped,
}

/// A dangerous event on one line of the program.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Which.
    pub kind: EventKind,
    /// The move.
    pub move_id: MoveId,
    /// More about it: depth or volume, with unit.
    pub detail: String,
}

/// Engagement of a whole program.
#[derive(Debug, Clone, Default)]
pub struct EngagementMap {
    /// Stations in order of execution.
    pub stations: Vec<Station>,
    /// Range of stations of each move (empty for rapids), by move index.
    pub of_move: Vec<std::ops::Range<u32>>,
    /// Arcs of all stations, one after the other; those of a station sorted by slice.
    pub arcs: Vec<EngagedArc>,
    /// Slices of each tool, by tool number; the index in an arc points into these.
    pub slices: Vec<(u32, Vec<Slice>)>,
    /// Dangerous events that the simulation found.
    pub events: Vec<Event>,
    /// Repairs and assumptions about the files of the stock, one sentence each.
    pub notes: Vec<String>,
    /// Volume of the stock before, mm³.
    pub initial_mm3: f64,
    /// Volume removed, mm³.
    pub removed_mm3: f64,
    /// Volume left, mm³.
    pub remaining_mm3: f64,
    /// Cell of the height field, mm.
    pub cell_mm: f64,
}

/// Share of the volume that the path removes below which the cuts that were found contradict it. What begins in material or goes through it at
/// rapid removes some that is no cut; of all programs of the corpus the cuts make up more than this.
const LEAST_FOUND: f64 = 0.5;
/// Cells by which the heights of a strip may be wider than the strip, on both sides together: a strip of 0.1 mm that holds a row of middles
/// counts as a cell.
const WIDER_CELLS: f64 = 2.0;

impl EngagementMap {
    /// Is nothing of the stock met?
    pub fn touches_nothing(&self) -> bool {
        self.removed_mm3 <= 0.0 && self.stations.iter().all(|station| station.arc_count == 0)
    }
    /// The volume of all cuts that were found, mm³, where it is far less than the heights fell by: two ways to one number that should agree.
    pub fn misses_cuts(&self) -> Option<f64> {
        let volume = |station: &Station| f64::from(station.removal_area_mm2) * station.length_mm();
        let met_mm3: f64 = self.stations.iter().map(volume).sum();
        let flank = |station: &Station| f64::from(station.axial_depth_mm) * station.length_mm();
        let by_cells_mm3 = WIDER_CELLS * self.cell_mm * self.stations.iter().map(flank).sum::<f64>();
        (met_mm3 + by_cells_mm3 < LEAST_FOUND * self.removed_mm3).then_some(met_mm3)
    }

    /// Arcs of a station.
    pub fn arcs_of(&self, station: &Station) -> &[EngagedArc] {
        let first = station.first_arc as usize;
        &self.arcs[first..first + station.arc_count as usize]
    }
    /// The arcs of a station that are engaged at its very beginning and at its very end ([`Station::at_ends`]).
    pub fn arcs_at_ends(&self, station: &Station) -> [&[EngagedArc]; 2] {
        let [begin, end] = station.at_ends.map(|count| count as usize);
        let (first, after) = (station.first_arc as usize, (station.first_arc + station.arc_count) as usize);
        [&self.arcs[first - begin..first], &self.arcs[after..after + end]]
    }
    /// Slices of a tool; empty for a tool that never cut.
    pub fn slices_of(&self, tool: u32) -> &[Slice] {
        self.slices.iter().find(|(number, _)| *number == tool).map_or(&[], |(_, slices)| slices)
    }
    /// Stations of a move.
    pub fn stations_of(&self, id: MoveId) -> &[Station] {
        self.of_move.get(id.ix()).map_or(&[], |range| &self.stations[range.start as usize..range.end as usize])
    }
    /// The same map with no station longer than `longest_mm`. Where loads depend on the position or on what the tool has cut before, a long
    /// station has one engagement but not one load.
    pub fn cut_to(mut self, longest_mm: f64) -> Self {
        let mut stations = Vec::with_capacity(self.stations.len());
        for range in &mut self.of_move {
            let first = stations.len() as u32;
            for station in &self.stations[range.start as usize..range.end as usize] {
                let parts = (station.length_mm() / longest_mm).ceil().max(1.0);
                let at = |part: f64| station.from_mm + station.length_mm() * part / parts;
                let cut = (0..parts as usize).map(|part| {
                    let (first, last) = (part == 0, part + 1 == parts as usize);
                    let to_mm = if last { station.to_mm } else { at(part as f64 + 1.0) };
                    let at_ends = [first, last].map(u32::from);
                    let at_ends = [0, 1].map(|end| at_ends[end] * station.at_ends[end]);
                    Station { from_mm: at(part as f64), to_mm, at_ends, ..*station }
                });
                stations.extend(cut);
            }
            *range = first..stations.len() as u32;
        }
        self.stations = stations;
        self
    }
}

/// Does the path go on straight from one move to the next, so that both have the same engagement where they meet?
pub fn goes_on(a: &Move, b: &Move) -> bool {
    runs_on(a, b, STRAIGHT)
}

/// Does one move continue the other at feed, with the same tool in the same system, with no larger bend than one of this cosine?
pub(super) fn runs_on(a: &Move, b: &Move, least: f64) -> bool {
    let fed = a.kind == MoveKind::Feed && b.kind == MoveKind::Feed;
    let joined = || (a.curve().to() - b.curve().from()).norm() < 1e-6;
    let bend = || a.curve().tangent(a.curve().length()).dot(&b.curve().tangent(0.0));
    fed && a.tool == b.tool && a.wcs == b.wcs && joined() && bend() >= least
}
