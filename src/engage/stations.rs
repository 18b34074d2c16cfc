//! From samples to stations. In: the outcomes at the sampled points of each move, in order. Out: the stations of the
//! [`EngagementMap`], their arcs, and the partial rings those arcs need.
//!
//! A piece between two samples takes the arcs of the more engaged one (by removal area) and the mean of both areas;
//! neighbouring pieces with equal arcs become one station. A ring that a level cuts in two is entered into the tool's list
//! of slices as a ring of its own, its bounds rounded to 1/128 of the whole.

use super::arcs::RawArc;
use super::batch::Outcome;
use super::cutter::Cutter;
use super::map::{EngagedArc, EngagementMap, Station, StationFlags};
use crate::ids::MoveId;
use crate::machine::Slice;
use std::collections::BTreeMap;

/// Angle by which arcs may differ and still count as equal, rad.
const EQUAL_RAD: f32 = 2e-3;
/// Steps in which the bounds of partial rings are kept.
const PARTS: f32 = 128.0;

/// Builds the map station by station.
#[derive(Debug, Default)]
pub struct Builder {
    /// The map so far.
    pub map: EngagementMap,
    /// Partial rings entered: (cutter, slice, from, to) → slice.
    partial: BTreeMap<(u16, u16, u8, u8), u16>,
}

/// A sampled point of a move: distance along it and what was found.
pub struct Point<'a> {
    /// Distance along the move, mm.
    pub s_mm: f64,
    /// What was found.
    pub outcome: &'a Outcome,
}

impl Builder {
    /// Enters the stations of a move sampled at `points` (at least two, the first at its beginning, the last at its end).
    pub fn push_move(&mut self, id: MoveId, cutter_index: u16, cutter: &Cutter, points: &[Point], uncertain: bool) {
        let first = self.map.stations.len() as u32;
        let mut current: Option<(&Outcome, Station, f64)> = None;
        for pair in points.windows(2) {
            let (a, b) = (pair[0].outcome, pair[1].outcome);
            let length = pair[1].s_mm - pair[0].s_mm;
            let volume = 0.5 * (a.cut.area_mm2 + b.cut.area_mm2) * length;
            let lead = if a.cut.area_mm2 > b.cut.area_mm2 { a } else { b };
            let clear = a.clear && b.clear && lead.arcs.is_empty();
            match &mut current {
                Some((held, station, sum)) if station.flags.clear_air == clear && same(&held.arcs, &lead.arcs) => {
                    station.to_mm = pair[1].s_mm;
                    *sum += volume;
                    if lead.cut.area_mm2 > held.cut.area_mm2 {
                        *held = lead;
                    }
                }
                _ => {
                    if let Some(done) = current.take() {
                        self.close(cutter_index, cutter, done);
                    }
                    let flags = StationFlags { clear_air: clear, uncertain, final_surface: false };
                    let station = empty_station(id, [pair[0].s_mm, pair[1].s_mm], flags);
                    current = Some((lead, station, volume));
                }
            }
        }
        if let Some(done) = current {
            self.close(cutter_index, cutter, done);
        }
        self.end_move(id, first);
    }

    /// Enters one station without engagement for a whole move.
    pub fn push_idle(&mut self, id: MoveId, length_mm: f64, flags: StationFlags) {
        let first = self.map.stations.len() as u32;
        let mut station = empty_station(id, [0.0, length_mm], flags);
        station.first_arc = self.map.arcs.len() as u32;
        self.map.stations.push(station);
        self.end_move(id, first);
    }

    /// Enters a move without stations.
    pub fn push_none(&mut self, id: MoveId) {
        let first = self.map.stations.len() as u32;
        self.end_move(id, first);
    }

    fn end_move(&mut self, id: MoveId, first: u32) {
        debug_assert_eq!(self.map.of_move.len(), id.ix());
        self.map.of_move.push(first..self.map.stations.len() as u32);
    }

    fn close(&mut self, index: u16, cutter: &Cutter, (outcome, mut station, volume): (&Outcome, Station, f64)) {
        station.first_arc = self.map.arcs.len() as u32;
        station.arc_count = outcome.arcs.len() as u32;
        station.axial_depth_mm = outcome.cut.top_mm as f32;
        station.removal_area_mm2 = if station.length_mm() > 0.0 { (volume / station.length_mm()) as f32 } else { 0.0 };
        for arc in &outcome.arcs {
            let slice = self.slice(index, cutter, arc);
            let [entry_rad, exit_rad] = arc.angles;
            self.map.arcs.push(EngagedArc { slice, entry_rad, exit_rad });
        }
        self.map.stations.push(station);
    }

    /// Slice of an arc: the whole ring, or a partial one entered for it.
    fn slice(&mut self, index: u16, cutter: &Cutter, arc: &RawArc) -> u16 {
        let [from, to] = arc.part.map(|part| (part * PARTS).round() as u8);
        if (from, to) == (0, PARTS as u8) {
            return arc.slice;
        }
        let slices = &mut self.map.slices[index as usize].1;
        *self.partial.entry((index, arc.slice, from, to.max(from + 1))).or_insert_with(|| {
            if slices.len() >= usize::from(u16::MAX) {
                return arc.slice;
            }
            slices.push(part_of(&cutter.slices[arc.slice as usize], [from, to.max(from + 1)]));
            (slices.len() - 1) as u16
        })
    }
}

fn part_of(ring: &Slice, [from, to]: [u8; 2]) -> Slice {
    let (from, to) = (f64::from(from) / f64::from(PARTS), f64::from(to) / f64::from(PARTS));
    let middle = 0.5 * (from + to) - 0.5;
    Slice {
        z_mm: ring.z_mm + middle * ring.dz_mm(),
        radius_mm: ring.radius_mm - middle * ring.edge_mm * ring.normal_z,
        edge_mm: (to - from) * ring.edge_mm,
        ..*ring
    }
}

fn empty_station(move_id: MoveId, [from_mm, to_mm]: [f64; 2], flags: StationFlags) -> Station {
    Station { move_id, from_mm, to_mm, removal_area_mm2: 0.0, axial_depth_mm: 0.0, first_arc: 0, arc_count: 0, flags }
}

fn same(a: &[RawArc], b: &[RawArc]) -> bool {
    a.len() == b.len()
        && a.iter().zip(b).all(|(a, b)| {
            let near =
                |k: usize| (a.angles[k] - b.angles[k]).abs() < EQUAL_RAD && (a.part[k] - b.part[k]).abs() < 0.5 / PARTS;
            a.slice == b.slice && near(0) && near(1)
        })
}
