//! Loads of the written file against their limits, station by station. In: its engagement, its commanded feeds, the limits in force on the
//! original. Out: [`KnownLoads`]; from these the places above a limit ([`Breach`]) and the totals for the report ([`Over`]).
//!
//! The loads of a station are worked out once for each feed that it gets, and stay known from round to round as long as its feed stays. Only
//! where loads depend on earlier cuts, and so on the feeds of other stations, are they worked out anew in every round.

use rayon::prelude::*;

use super::force_rate::{self, Step};
use super::origins::Origin;
use super::task::SPACING_MM;
use super::tighten::{Breach, OVERLAP_MM, overlaps};
use super::written_engagement::{Side, WrittenEngagement};
use crate::engage::{EngagementMap, Station};
use crate::force::{Cap, LoadLine};
use crate::ids::BlockId;
use crate::machine::{Job, LimitKind};
use crate::nc::{MoveKind, Toolpath};
use crate::outcome::LIMIT_TOLERANCE;
use crate::outcome::over_limits::{FixedFeed, LoadLimit, Over, Place, load_limits, p99};
use crate::schedule::FeedPiece;
use crate::schedule::cutters::Cutters;
use crate::schedule::history;
use crate::schedule::known_loads::KnownLoads;
use crate::schedule::realise::{as_programmed, pieces_of_moves};
use crate::schedule::rules::{Rules, rules};

/// Stations that are tallied at once.
const CHUNK: usize = 1 << 14;

/// Limits and feeds of a written file, ready to be asked about its stations.
pub struct Ratios<'a> {
    side: &'a Side<'a>,
    written: &'a Toolpath,
    map: &'a EngagementMap,
    origins: &'a [Origin],
    cutters: Cutters,
    /// Feeds on the original's moves, the range of them of each move, and a factor on all.
    feeds: &'a [FeedPiece],
    of_move: Vec<std::ops::Range<u32>>,
    factor: f64,
    /// Of the original: operations are chosen by its lines.
    rules: Rules,
    /// Blocks of the original that the rewriting kept, sorted.
    kept: &'a [BlockId],
    /// Loads depend on what was cut before, and with it on the feeds of other stations.
    past: bool,
}

impl<'a> Ratios<'a> {
    /// Of a written file under these feeds, each times a factor.
    pub fn new(
        side: &'a Side<'a>,
        known: &'a WrittenEngagement,
        map: &'a EngagementMap,
        job: &Job,
        (feeds, factor): (&'a [FeedPiece], f64),
        kept: &'a [BlockId],
    ) -> Self {
        let mut commanded = as_programmed(&known.written);
        for piece in &mut commanded {
            piece.feed_mm_s *= factor;
        }
        Self {
            side,
            written: &known.written,
            map,
            origins: &known.origins,
            cutters: Cutters::new(&known.written, map, job, &commanded),
            feeds,
            of_move: pieces_of_moves(feeds, side.toolpath.moves.len()),
            factor,
            rules: rules(side.toolpath, side.map, side.job),
            kept,
            past: history::is_asked_for(job),
        }
    }

    /// Works out what is not known, or not at this feed.
    pub fn work_out(&self, carried: &mut KnownLoads) {
        let each = self.rules.most_loads();
        if self.past || carried.each != each {
            *carried = KnownLoads::with_room_for(each);
        }
        carried.make_room(self.map.stations.len());
        let of_station = carried.feeds_mm_s.par_iter_mut().zip(carried.loads.par_chunks_mut(each));
        self.map.stations.par_iter().zip(of_station).for_each(|(station, (known_mm_s, loads))| {
            if station.arc_count == 0 {
                return;
            }
            let origin = self.on_original(station);
            let feed_mm_s = self.feed_mm_s(&origin);
            if *known_mm_s == feed_mm_s {
                return;
            }
            let Some(line) = self.line(station) else { return };
            let found = line.loads(feed_mm_s);
            for (load, limit) in loads.iter_mut().zip(self.limits(&origin, station)) {
                *load = found.bounded_by(limit.kind).unwrap_or(0.0);
            }
            *known_mm_s = feed_mm_s;
        });
    }

    /// The feed that a station has, mm/s, and the load nearest to its limit; `None` where nothing is cut, or no load is known.
    pub fn nearest(&self, index: usize, carried: &KnownLoads) -> Option<(f64, LimitKind, f64)> {
        let feed_mm_s = carried.feeds_mm_s[index];
        if feed_mm_s.is_nan() {
            return None;
        }
        let station = &self.map.stations[index];
        let mut worst = (feed_mm_s, LimitKind::Programmed, 0.0);
        for (limit, load) in self.limits(&self.on_original(station), station).zip(carried.of(index)) {
            let ratio = load / limit.limit;
            if ratio > worst.2 {
                worst = (feed_mm_s, limit.kind, ratio);
            }
        }
        Some(worst)
    }

    /// Is the feed of a station one that cannot be chosen (frozen, kept, infeasible)?
    pub fn is_fixed(&self, station: &Station) -> bool {
        self.fixed_feed(&self.on_original(station)).is_some()
    }

    /// The places above a limit whose feed can be chosen.
    pub fn breaches(&self, carried: &KnownLoads) -> Vec<Breach> {
        let of_station = |index: usize| {
            let (_, kind, _) = self.nearest(index, carried).filter(|(.., ratio)| *ratio > LIMIT_TOLERANCE)?;
            let station = &self.map.stations[index];
            let origin = self.on_original(station);
            if self.fixed_feed(&origin).is_some() {
                return None;
            }
            Some(Breach { origin, kind, cap_mm_s: self.cap(&self.line(station)?, &origin, station) })
        };
        (0..self.map.stations.len()).into_par_iter().filter_map(of_station).collect()
    }

    /// Loads over limits of everything that cuts, wherever its feed comes from.
    pub fn tally(&self, carried: &KnownLoads) -> Over {
        let starts: Vec<usize> = (0..self.map.stations.len()).step_by(CHUNK).collect();
        let of_chunk = |start: &usize| {
            let end = (start + CHUNK).min(self.map.stations.len());
            self.tally_of(*start..end, carried)
        };
        let parts: Vec<(Over, Vec<(f64, f64)>)> = starts.par_iter().map(of_chunk).collect();
        let (mut over, mut ratios) = (Over::default(), Vec::new());
        for (part, mut found) in parts {
            over.join(part);
            ratios.append(&mut found);
        }
        Over { p99_ratio: p99(ratios), ..over }
    }

    fn tally_of(&self, stations: std::ops::Range<usize>, carried: &KnownLoads) -> (Over, Vec<(f64, f64)>) {
        let (mut over, mut ratios) = (Over::default(), Vec::new());
        for index in stations.filter(|index| !carried.feeds_mm_s[*index].is_nan()) {
            let station = &self.map.stations[index];
            let origin = self.on_original(station);
            let motion = &self.side.toolpath.moves[origin.move_id.ix()];
            let length_mm = station.length_mm();
            let place = Place { line: motion.line, tool: motion.tool, length_mm, fixed: self.fixed_feed(&origin) };
            let limits = self.limits(&origin, station);
            let ratio = over.add(&place, limits.zip(carried.of(index).iter().copied()));
            ratios.push((ratio, length_mm));
        }
        (over, ratios)
    }

    /// Is the rate of change of force limited anywhere?
    pub fn limits_force_rate(&self) -> bool {
        self.rules.rules.iter().any(|rule| rule.limits.force_rate_n_s.is_some())
    }

    /// Largest rate of change of force over its limit, where one is in force.
    pub fn force_rate(&self, breaches: &mut Vec<Breach>) -> Option<f64> {
        if !self.limits_force_rate() {
            return None;
        }
        let places: Vec<(Origin, Step)> = self.map.stations.par_iter().map(|station| self.step(station)).collect();
        let mut steps: Vec<Step> = places.iter().map(|(_, step)| *step).collect();
        let stations = &self.map.stations;
        for i in 1..steps.len() {
            let between = stations[i - 1].move_id.ix()..=stations[i].move_id.ix();
            steps[i].joined &= self.written.moves[between].iter().all(|motion| motion.kind == MoveKind::Feed);
        }
        force_rate::worst(&steps, SPACING_MM[0], LIMIT_TOLERANCE, &mut |from, to, ratio| {
            let slower = places[from..=to].iter().map(|(origin, step)| Breach {
                origin: *origin,
                kind: LimitKind::ForceRate,
                cap_mm_s: Some(step.feed_mm_s / ratio),
            });
            breaches.extend(slower);
        })
    }

    fn step(&self, station: &Station) -> (Origin, Step) {
        let origin = self.on_original(station);
        let feed_mm_s = self.feed_mm_s(&origin);
        let line = (station.arc_count > 0).then(|| self.line(station)).flatten();
        let step = Step {
            force_n: line.map_or(0.0, |line| line.loads(feed_mm_s).force_xy_peak_n),
            length_mm: station.length_mm(),
            feed_mm_s,
            limit_n_s: self.rules.of(origin.move_id).limits.force_rate_n_s,
            joined: self.fixed_feed(&origin).is_none(),
        };
        (origin, step)
    }

    /// Loads of a station as functions of feed.
    fn line(&self, station: &Station) -> Option<LoadLine> {
        let motion = &self.written.moves[station.move_id.ix()];
        Some(self.cutters.of(station.move_id)?.line(&self.cutters.cut(self.map, motion, station)))
    }

    fn limits(&self, origin: &Origin, station: &Station) -> impl Iterator<Item = LoadLimit> + '_ {
        let rps = self.written.moves[station.move_id.ix()].spin.rps;
        load_limits(&self.rules.of(origin.move_id).loads, self.side.job, rps)
    }

    /// Largest feed that meets every limit.
    fn cap(&self, line: &LoadLine, origin: &Origin, station: &Station) -> Option<f64> {
        let mut least = f64::INFINITY;
        for limit in self.limits(origin, station) {
            match line.cap(limit.kind, limit.limit) {
                Cap::Free => {}
                Cap::Feed { feed_mm_s, .. } => least = least.min(feed_mm_s),
                Cap::Unreachable => return None,
            }
        }
        Some(least)
    }

    /// Highest feed over a place.
    fn feed_mm_s(&self, origin: &Origin) -> f64 {
        let range = &self.of_move[origin.move_id.ix()];
        let pieces = &self.feeds[range.start as usize..range.end as usize];
        let first = pieces.partition_point(|piece| piece.to_mm <= origin.from_mm + OVERLAP_MM);
        let over = |piece: &&FeedPiece| piece.from_mm < origin.to_mm - OVERLAP_MM;
        let feeds = pieces[first.min(pieces.len().saturating_sub(1))..].iter();
        let highest = feeds.clone().take_while(over).map(|piece| piece.feed_mm_s).reduce(f64::max);
        self.factor * highest.or_else(|| feeds.map(|piece| piece.feed_mm_s).next()).unwrap_or(0.0)
    }

    fn on_original(&self, station: &Station) -> Origin {
        let Origin { move_id, from_mm, to_mm } = self.origins[station.move_id.ix()];
        let whole = self.written.moves[station.move_id.ix()].curve().length();
        let scale = if whole > 0.0 { (to_mm - from_mm) / whole } else { 0.0 };
        Origin { move_id, from_mm: from_mm + scale * station.from_mm, to_mm: from_mm + scale * station.to_mm }
    }

    fn fixed_feed(&self, origin: &Origin) -> Option<FixedFeed> {
        let motion = &self.side.toolpath.moves[origin.move_id.ix()];
        let nodes = self.side.problem.nodes_of(origin.move_id).iter().filter(|node| overlaps(node, origin));
        FixedFeed::of(motion, nodes, self.kept.binary_search(&motion.block).is_ok())
    }
}
