//! The engagement of the written file, as far as it is known. In: its toolpath; toolpath and engagement of the original. Out: the stations of the
//! written moves. A block that was not split runs along the same path through the same stock and has the stations of the original; the
//! pieces of a split block have none until they are simulated. Stations, and with them their loads ([`KnownLoads`]), are kept from round to
//! round.

use super::origins::Origin;
use super::problem::cut;
use super::task::{JobError, SPACING_MM, Watch};
use crate::engage::{self, Again, EngagementMap};
use crate::ids::MoveId;
use crate::machine::Job;
use crate::nc::{Move, Toolpath};
use crate::outcome::{ProgramRun, Switched};
use crate::path::{Curve, Vec3};
use crate::schedule::Problem;
use crate::schedule::known_loads::KnownLoads;

/// A written program and what is known of its engagement.
pub struct WrittenEngagement {
    /// Its moves.
    pub written: Toolpath,
    /// The piece of the original that each of them is.
    pub origins: Vec<Origin>,
    /// Its engagement, as far as it is known.
    pub map: EngagementMap,
    /// Where the stations of each move come from.
    pub stations_from: Vec<StationsFrom>,
    /// The loads of its stations.
    pub carried: KnownLoads,
}

/// Where the stations of a written move come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StationsFrom {
    /// It has none yet.
    NotYet,
    /// It is whole, and they are those of the original.
    AsOriginal,
    /// It was simulated at the finer spacing.
    Finer,
}

/// The original in one position of the block-delete switch.
pub struct Side<'a> {
    /// The original's moves.
    pub toolpath: &'a Toolpath,
    /// What the cutter meets on them.
    pub map: &'a EngagementMap,
    /// The feeds allowed there.
    pub problem: &'a Problem,
    /// Machine, tools, limits.
    pub job: &'a Job,
}

impl<'a> Side<'a> {
    /// With the switch off.
    pub fn off(run: &'a ProgramRun) -> Self {
        Self { toolpath: &run.toolpath, map: &run.map, problem: &run.problem, job: &run.job }
    }
    /// With the switch on.
    pub fn on(switched: &'a Switched, job: &'a Job) -> Self {
        Self { toolpath: &switched.toolpath, map: &switched.map, problem: &switched.problem, job }
    }
}

impl WrittenEngagement {
    /// Of a file of which nothing has been simulated: blocks that are not split have the stations of the original.
    pub fn whole(side: &Side, written: Toolpath, origins: Vec<Origin>) -> Self {
        let of_move: Vec<Option<MoveId>> = written
            .moves
            .iter()
            .zip(&origins)
            .map(|(motion, origin)| {
                same_way(motion, &side.toolpath.moves[origin.move_id.ix()]).then_some(origin.move_id)
            })
            .collect();
        let again = Again { known: side.map, of_move: &of_move };
        let map = again.carried();
        let carried = side.problem.known.carried_to(&map, again);
        let stations_from =
            of_move.iter().map(|of| of.map_or(StationsFrom::NotYet, |_| StationsFrom::AsOriginal)).collect();
        Self { written, origins, map, stations_from, carried }
    }

    /// Of a file in which some blocks are split at other places: pieces that both files have keep their stations.
    pub fn on_with(self, written: Toolpath, origins: Vec<Origin>) -> Self {
        if self.origins == origins {
            return Self { written, ..self };
        }
        let mut at = 0;
        let of_move: Vec<Option<MoveId>> = origins
            .iter()
            .map(|origin| {
                let key = |origin: &Origin| (origin.move_id, origin.from_mm);
                at += self.origins[at..].partition_point(|known| key(known) < key(origin));
                let same = self.origins.get(at).is_some_and(|known| known == origin);
                (same && self.stations_from[at] != StationsFrom::NotYet).then_some(MoveId(at as u32))
            })
            .collect();
        let again = Again { known: &self.map, of_move: &of_move };
        let map = again.carried();
        let carried = self.carried.carried_to(&map, again);
        let stations_from =
            of_move.iter().map(|of| of.map_or(StationsFrom::NotYet, |of| self.stations_from[of.ix()])).collect();
        Self { written, origins, map, stations_from, carried }
    }

    /// Simulates some moves at the finer spacing.
    pub fn see(&mut self, side: &Side, which: &[bool], watch: &Watch) -> Result<(), JobError> {
        let keep = |(index, again): (usize, &bool)| (!again).then_some(MoveId(index as u32));
        let of_move: Vec<Option<MoveId>> = which.iter().enumerate().map(keep).collect();
        let options = engage::Options { spacing_mm: SPACING_MM[1], ..watch.engage };
        let progress = |done| (watch.progress)("check", done);
        let again = Again { known: &self.map, of_move: &of_move };
        let map = engage::engage_again(&self.written, side.job, &options, again, &progress)?;
        let carried = self.carried.carried_to(&map, again);
        (self.map, self.carried) = (cut(map, side.job, SPACING_MM[1]), carried);
        for (met, _) in self.stations_from.iter_mut().zip(which).filter(|(_, again)| **again) {
            *met = StationsFrom::Finer;
        }
        Ok(())
    }
}

/// Do two moves run along the same path, from end to end, with the same tool?
fn same_way(a: &Move, b: &Move) -> bool {
    /// Rounding of coordinates that are added up.
    const SAME_MM: f64 = 1e-6;
    let near = |a: Vec3, b: Vec3| (a - b).norm() < SAME_MM;
    let curves = match (a.curve(), b.curve()) {
        (Curve::Line { from, to }, Curve::Line { from: other_from, to: other_to }) => {
            near(from, other_from) && near(to, other_to)
        }
        (Curve::Arc(a), Curve::Arc(b)) => {
            let ends = near(a.from, b.from) && near(a.to, b.to) && near(a.centre, b.centre);
            ends && a.plane == b.plane && (a.sweep_rad - b.sweep_rad).abs() < 1e-9
        }
        _ => false,
    };
    curves && a.kind == b.kind && a.tool == b.tool && a.wcs == b.wcs
}
