//! Loads that were worked out before, so that a station whose feed did not change is not worked out again. In: feeds and loads of stations:
//! first those at programmed feeds that stay, from finding the caps; then those of each round of the check of the written file. Out: the
//! same loads, carried over to the stations of another engagement map.

use crate::engage::{Again, EngagementMap};

/// The loads of each station at the feed for which they were last worked out.
#[derive(Debug, Clone, Default)]
pub struct KnownLoads {
    /// By station: the feed, mm/s; NaN where nothing is cut or no load is known.
    pub feeds_mm_s: Vec<f64>,
    /// By station: the load under each of its limits, in their order and units, with room for `each`.
    pub loads: Vec<f64>,
    /// Loads of a station.
    pub each: usize,
}

impl KnownLoads {
    /// No known loads yet, with room for `each` loads per station.
    pub fn with_room_for(each: usize) -> Self {
        Self { each, ..Self::default() }
    }

    /// Carries the loads over to another map that has some moves of this one. Stations of other moves are not known in it.
    pub fn carried_to(&self, map: &EngagementMap, again: Again) -> Self {
        let mut there = Self::with_room_for(self.each);
        if self.each == 0 {
            return there;
        }
        there.make_room(map.stations.len());
        for (range, of) in map.of_move.iter().zip(again.of_move) {
            let Some(from) = of.map(|of| again.known.of_move[of.ix()].clone()) else { continue };
            let (from, to) = (from.start as usize..from.end as usize, range.start as usize..range.end as usize);
            there.feeds_mm_s[to.clone()].copy_from_slice(&self.feeds_mm_s[from.clone()]);
            there.loads[to.start * self.each..to.end * self.each]
                .copy_from_slice(&self.loads[from.start * self.each..from.end * self.each]);
        }
        there
    }

    /// Keeps only the stations for which `wanted` is true.
    pub fn keep_only(self, wanted: impl Iterator<Item = bool>) -> Self {
        let mut found = Self::with_room_for(self.each);
        for (index, _) in wanted.enumerate().filter(|(_, wanted)| *wanted) {
            found.feeds_mm_s.push(self.feeds_mm_s[index]);
            found.loads.extend_from_slice(self.of(index));
        }
        found
    }

    /// Room for the stations of a map.
    pub fn make_room(&mut self, stations: usize) {
        self.feeds_mm_s.resize(stations, f64::NAN);
        self.loads.resize(stations * self.each, 0.0);
    }

    /// Loads of a station.
    pub fn of(&self, station: usize) -> &[f64] {
        &self.loads[station * self.each..(station + 1) * self.each]
    }
}
