//! Loads at every station, before and after. In: a run. Out: one record per station in order. Records are worked out in parallel by chunks and
//! passed on one after the other, so that no table of all of them is needed.

use rayon::prelude::*;

use super::program_run::ProgramRun;
use crate::engage::Station;
use crate::force::Loads;
use crate::schedule::FeedPiece;
use crate::schedule::cutters::Cutters;
use crate::schedule::history;
use crate::schedule::realise::pieces_of_moves;

/// Stations worked out at once.
const CHUNK: usize = 1 << 15;

/// How far a split point may lie from the station it was meant for, mm.
const SLACK_MM: f64 = 0.02;

/// One station with its loads.
#[derive(Debug, Clone, Copy)]
pub struct StationLoads<'a> {
    /// The station.
    pub station: &'a Station,
    /// Highest feed commanded here as programmed, mm/s.
    pub feed_before_mm_s: f64,
    /// Highest feed commanded here as written, mm/s.
    pub feed_after_mm_s: f64,
    /// Loads as programmed.
    pub before: Loads,
    /// Loads as written.
    pub after: Loads,
}

/// Calls `visit` for every station in order.
pub fn each_station(run: &ProgramRun, visit: &mut dyn FnMut(&StationLoads)) {
    // The tools wear differently at the feeds before and after.
    let cutters = [&run.before[..], run.after()].map(|feeds| Cutters::new(&run.toolpath, &run.map, &run.job, feeds));
    let before = Feeds::new(&run.before, run.toolpath.moves.len());
    let after = Feeds::new(run.after(), run.toolpath.moves.len());
    let stations = &run.map.stations;
    for chunk in stations.chunks(CHUNK) {
        let found: Vec<StationLoads> =
            chunk.par_iter().map(|station| loads_at(run, &cutters, &before, &after, station)).collect();
        found.iter().for_each(&mut *visit);
    }
}

fn loads_at<'a>(
    run: &ProgramRun,
    cutters: &[Cutters; 2],
    before: &Feeds,
    after: &Feeds,
    station: &'a Station,
) -> StationLoads<'a> {
    let (feed_before_mm_s, feed_after_mm_s) = (before.highest(station), after.highest(station));
    let mut found =
        StationLoads { station, feed_before_mm_s, feed_after_mm_s, before: Loads::default(), after: Loads::default() };
    if station.arc_count == 0 {
        return found;
    }
    let motion = &run.toolpath.moves[station.move_id.ix()];
    let line = |cutters: &Cutters| Some(cutters.of(station.move_id)?.line(&cutters.cut(&run.map, motion, station)));
    if let Some(as_programmed) = line(&cutters[0]) {
        found.before = as_programmed.loads(feed_before_mm_s);
        found.after = as_programmed.loads(feed_after_mm_s);
    }
    let as_written = || history::follows_feeds(&run.job).then(|| line(&cutters[1])).flatten();
    if let Some(as_written) = as_written() {
        found.after = as_written.loads(feed_after_mm_s);
    }
    found
}

/// Commanded feeds by move.
pub struct Feeds<'a> {
    pieces: &'a [FeedPiece],
    of_move: Vec<std::ops::Range<u32>>,
}

impl<'a> Feeds<'a> {
    /// Pieces in order of execution.
    pub fn new(pieces: &'a [FeedPiece], moves: usize) -> Self {
        Self { pieces, of_move: pieces_of_moves(pieces, moves) }
    }
    /// Pieces of the move of a station.
    pub fn of(&self, station: &Station) -> &'a [FeedPiece] {
        let range = &self.of_move[station.move_id.ix()];
        &self.pieces[range.start as usize..range.end as usize]
    }
    /// Highest feed commanded anywhere on a station, mm/s. Split points are rounded to the increment of the control, so a
    /// piece that only reaches in by that much does not count.
    pub fn highest(&self, station: &Station) -> f64 {
        let slack = (0.25 * station.length_mm()).min(SLACK_MM);
        let overlaps =
            |piece: &&FeedPiece| piece.from_mm < station.to_mm - slack && piece.to_mm > station.from_mm + slack;
        let pieces = self.of(station);
        let highest = pieces.iter().filter(overlaps).map(|piece| piece.feed_mm_s).fold(0.0, f64::max);
        if highest > 0.0 { highest } else { pieces.first().map_or(0.0, |piece| piece.feed_mm_s) }
    }
    /// Time to run a station at its commanded feeds, s, corners and ramps left out.
    pub fn time_s(&self, station: &Station) -> f64 {
        let length = |piece: &FeedPiece| (piece.to_mm.min(station.to_mm) - piece.from_mm.max(station.from_mm)).max(0.0);
        self.of(station).iter().map(|piece| piece.time_s(length(piece))).sum()
    }
}
