//! Reuse of stations from an earlier simulation, for a program that runs along the same path except in some moves. In: the earlier map, and for
//! each move the move in it with the same stations. Out: these stations under the numbers of the new moves ([`Again::carried`]); the others
//! are worked out by [`super::engage_again`].

use super::cutter::Cutter;
use super::map::EngagementMap;
use super::stations::Builder;
use crate::ids::MoveId;

/// The part of a program's engagement that is known before it is simulated.
#[derive(Clone, Copy)]
pub struct Again<'a> {
    /// Engagement of a program of the same job.
    pub known: &'a EngagementMap,
    /// For each move the one in `known` that goes the same way through the same stock; `None`: it is to be worked out.
    pub of_move: &'a [Option<MoveId>],
}

impl Again<'_> {
    /// The map as far as it is known; moves to be worked out have no stations. Volumes and events are those of the earlier map.
    pub fn carried(&self) -> EngagementMap {
        let EngagementMap { slices, events, notes, .. } = self.known;
        let (slices, events, notes) = (slices.clone(), events.clone(), notes.clone());
        let mut builder = Builder::default();
        builder.map = EngagementMap { slices, events, notes, ..EngagementMap::default() };
        (builder.map.initial_mm3, builder.map.removed_mm3) = (self.known.initial_mm3, self.known.removed_mm3);
        (builder.map.remaining_mm3, builder.map.cell_mm) = (self.known.remaining_mm3, self.known.cell_mm);
        for (index, of) in self.of_move.iter().enumerate() {
            builder.push_known(MoveId(index as u32), self.known, *of);
        }
        builder.map
    }
    /// Are the slices of the earlier map those of these cutters, apart from partial rings added after them?
    pub(super) fn fits(&self, cutters: &[Cutter]) -> bool {
        let same = |(cutter, (number, slices)): (&Cutter, &(u32, Vec<_>))| {
            cutter.number == *number && slices.starts_with(&cutter.slices)
        };
        cutters.len() == self.known.slices.len() && cutters.iter().zip(&self.known.slices).all(same)
    }
}
