//! The cutters of a program. In: toolpath, engagement, job. Out: for each move its tool at its spindle speed, which gives the loads at every
//! station as functions of feed; and the lengths and depths that are too small to count as a cut.

use super::history::History;
use super::problem::FeedPiece;
use crate::engage::{EngagedArc, EngagementMap, Station, goes_on};
use crate::force::{Cut, Cutter};
use crate::ids::MoveId;
use crate::machine::Job;
use crate::nc::{Move, Toolpath};
use std::collections::HashMap;

/// Longest stretch of air that counts as the edge of the cut beside it, mm.
pub(super) const SLIVER_MM: f64 = 0.05;
/// Radial depth below which a cut is one of rounding, mm: two increments of the usual third decimal.
const SKIM_MM: f64 = 0.002;

/// Is the layer that is cut here no thicker than the rounding of the program's coordinates? Whether it is cut at all is then chance.
pub(super) fn skims(station: &Station) -> bool {
    f64::from(station.removal_area_mm2) < SKIM_MM * f64::from(station.axial_depth_mm)
}

/// One cutter per tool and spindle speed, and the cutter of each move.
pub struct Cutters {
    list: Vec<Option<Cutter>>,
    of_move: Vec<u32>,
    /// Does a move go on straight from the one before, with the same tool?
    goes_on: Vec<bool>,
    history: History,
}

impl Cutters {
    /// Cutters of every tool and speed that the toolpath uses, worn and warmed as the program leaves them at these feeds.
    pub fn new(toolpath: &Toolpath, map: &EngagementMap, job: &Job, feeds: &[FeedPiece]) -> Self {
        Self::after(toolpath, map, job, &History::of(toolpath, map, job, feeds))
    }

    /// The same for a history that is known already.
    pub fn after(toolpath: &Toolpath, map: &EngagementMap, job: &Job, history: &History) -> Self {
        let mut keys: Vec<(u32, f64)> = Vec::new();
        // A program may set another speed in every block.
        let mut known: HashMap<(u32, u64), u32> = HashMap::new();
        let mut of_move = Vec::with_capacity(toolpath.moves.len());
        for motion in &toolpath.moves {
            let (tool, rps) = (motion.tool, motion.spin.rps);
            of_move.push(*known.entry((tool, rps.to_bits())).or_insert_with(|| {
                keys.push((tool, rps));
                keys.len() as u32 - 1
            }));
        }
        let list = keys.into_iter().map(|(tool, rps)| cutter(tool, rps, map, job)).collect();
        let goes_on = std::iter::once(false).chain(toolpath.moves.windows(2).map(|pair| goes_on(&pair[0], &pair[1])));
        Self { list, of_move, goes_on: goes_on.collect(), history: history.clone() }
    }
    /// Cutter of a move; `None` when its tool, material or spindle speed does not allow one.
    pub fn of(&self, id: MoveId) -> Option<&Cutter> {
        self.list[self.of_move[id.ix()] as usize].as_ref()
    }
    /// The cut at a station: its engaged arcs, and what the tool has cut before.
    pub fn cut<'a>(&self, map: &'a EngagementMap, motion: &Move, station: &Station) -> Cut<'a> {
        let tangent_z = motion.curve().tangent(0.5 * (station.from_mm + station.to_mm)).z;
        let (arcs, beside) = (map.arcs_of(station), self.beside(map, station));
        Cut { arcs, beside, tangent_z, state: self.history.state(map, motion, station) }
    }

    /// The arcs at both ends of a station, or of the stations before and after on the same path, which are engaged there too; none where neither
    /// is known.
    fn beside<'a>(&self, map: &'a EngagementMap, station: &Station) -> [&'a [EngagedArc]; 2] {
        let id = station.move_id.ix();
        let place = map.stations_of(station.move_id).partition_point(|of| of.from_mm < station.from_mm);
        let index = map.of_move[id].start as usize + place;
        let on_path = |other: &&Station| {
            let other = other.move_id.ix();
            let joint = |later: usize| self.goes_on.get(later).is_some_and(|goes_on| *goes_on);
            other == id || (other + 1 == id && joint(id)) || (other == id + 1 && joint(other))
        };
        let next_to = |other: Option<usize>| {
            let other = other.and_then(|other| map.stations.get(other)).filter(on_path);
            other.map_or(&[][..], |other| map.arcs_of(other))
        };
        let (at_ends, next_to) = (map.arcs_at_ends(station), [index.checked_sub(1), Some(index + 1)].map(next_to));
        [0, 1].map(|end| if at_ends[end].is_empty() { next_to[end] } else { at_ends[end] })
    }
}

fn cutter(number: u32, rps: f64, map: &EngagementMap, job: &Job) -> Option<Cutter> {
    let tool = job.tool(number)?;
    let material = job.material(tool)?;
    Cutter::new(tool, material, &job.machine.spindle, &job.process, map.slices_of(number), rps).ok()
}
