//! The written file is what counts: read back, proved to differ in feeds only, looked at again at a finer spacing wherever that can
//! matter. In: the run so far and the written text. Out: the worst ratio of a load to its limit on commanded feeds, and the places
//! where it is above [`MET`] with the cap they should have had.
//!
//! Engagement does not depend on feeds, and a block that the file has whole goes the same way through the same stock as in the
//! original: it keeps the stations of the first simulation, and its loads are worked out on these at the feeds read back. Simulated
//! again, in the stock as the written file cuts it, at the finer spacing, are
//!
//! * blocks that were cut in pieces: every piece,
//! * whole blocks with a load above [`NEAR`] of its limit where the feed is ours to choose,
//! * everything where the rate of change of force is limited: that is one between stations.
//!
//! What one round has simulated the next one keeps, piece by piece. Where loads on what is known already ask for a cap that the
//! schedule has not kept, that is told before anything is simulated. Stations that have the feed they had in the last round keep the ratio they had, and the proof
//! is made for the file that meets the limits.
//!
//! Where blocks hang on the block-delete switch, all this is done for both of its positions.
//!
//! Places that are infeasible, frozen or were kept by the rewriting make no cap tighter: their feed is not ours to choose. What
//! they carry counts all the same in what is reported ([`over`]).

use rayon::prelude::*;

use super::follow::{Origin, feeds, follow};
use super::force_rate::{self, Step};
use super::{JobError, MET, SPACING_MM, Watch, cut, engagement, environment, switch};
use crate::engage::{self, Again, EngagementMap, Station};
use crate::force::{Cap, LoadLine};
use crate::ids::{BlockId, MoveId};
use crate::machine::limits::FEED_CHANGE_MIN;
use crate::machine::{Job, LimitKind};
use crate::nc::{Environment, Freeze, Move, MoveKind, Toolpath};
use crate::path::{Curve, Vec3};
use crate::report::answers::Stressed;
use crate::report::over::{self, Apart, Over, Place, p99};
use crate::report::{Check, Run, Switched};
use crate::rewrite::{Rewritten, verify};
use crate::schedule::caps::Cutters;
use crate::schedule::history;
use crate::schedule::realise::{as_programmed, pieces_of_moves};
use crate::schedule::rules::{Rules, rules};
use crate::schedule::stress::cases;
use crate::schedule::words::Grid;
use crate::schedule::{FeedPiece, Node, Problem};

/// Stations that are tallied at once.
const CHUNK: usize = 1 << 14;
/// Two places share no more than this: they touch, mm.
const OVERLAP_MM: f64 = 1e-6;
/// Part of a limit above which a whole block is simulated again at the finer spacing. Of 111,000 such blocks in eight programs the
/// finer simulation found at most 1.75 times what the first one had (at 0.04 of the limit; of those below a half of it the most
/// was 0.54, of those below 0.7 it was 0.89): to be passed over, a load above its limit had to be twice what the first one found.
const NEAR: f64 = 0.5;

/// A place whose load is above its limit in the written program, on the original's path.
#[derive(Debug, Clone, Copy)]
pub struct Breach {
    /// Where.
    pub origin: Origin,
    /// The limit.
    pub kind: LimitKind,
    /// The feed it should have had; `None`: there is none.
    pub cap_mm_s: Option<f64>,
}

/// What the check found.
pub struct Found {
    /// Numbers for the report.
    pub check: Check,
    /// Written feeds on the original's moves.
    pub after: Vec<FeedPiece>,
    /// Loads above their limits.
    pub breaches: Vec<Breach>,
    /// Blocks of the original that the proof objects to.
    pub doubtful: Vec<BlockId>,
}

impl Found {
    /// Is there nothing to be done better?
    pub fn is_good(&self) -> bool {
        self.breaches.is_empty() && self.doubtful.is_empty()
    }
}

/// A written program and what is known of its engagement.
pub struct Known {
    written: Toolpath,
    origins: Vec<Origin>,
    map: EngagementMap,
    /// Where the stations of each move come from.
    met: Vec<Met>,
    /// What its stations were found to have last.
    rates: Vec<Rate>,
}

/// Where the stations of a written move come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Met {
    /// It has none yet.
    NotYet,
    /// It is whole, and they are those of the original.
    AsOriginal,
    /// It was simulated at the finer spacing.
    Finer,
}

/// The load nearest to its limit at one station.
#[derive(Debug, Clone, Copy)]
struct Rate {
    /// The feed it was worked out at, mm/s; NaN where the station does not count.
    feed_mm_s: f64,
    /// Load over limit.
    ratio: f64,
    kind: LimitKind,
}

/// The station is not cut, or its feed is not ours to choose.
const APART: Rate = Rate { feed_mm_s: f64::NAN, ratio: 0.0, kind: LimitKind::Programmed };

/// One position of the block-delete switch: what the original does in it, and what is known of that.
struct Side<'a> {
    toolpath: &'a Toolpath,
    map: &'a EngagementMap,
    problem: &'a Problem,
    job: &'a Job,
}

impl<'a> Side<'a> {
    fn off(run: &'a Run) -> Self {
        Self { toolpath: &run.toolpath, map: &run.map, problem: &run.problem, job: &run.job }
    }
    fn on(switched: &'a Switched, job: &'a Job) -> Self {
        Self { toolpath: &switched.toolpath, map: &switched.map, problem: &switched.problem, job }
    }
}

/// Loads of the written program in one position of the switch.
struct Rated {
    after: Vec<FeedPiece>,
    force_rate: Option<f64>,
    breaches: Vec<Breach>,
}

/// Reads back, simulates unless `known` says what the cutter meets already, with the block-delete switch off and, where
/// blocks hang on it, on; verifies a file that meets the limits, and the `last` one.
pub fn check(
    run: &Run,
    rewritten: &Rewritten,
    watch: &Watch,
    known: &mut [Option<Known>; 2],
    last: bool,
) -> Result<Found, JobError> {
    let environment = environment(&run.job, watch);
    let reread = |environment: &Environment| crate::nc::interpret(&rewritten.read(&run.program), environment);
    let kept: Vec<BlockId> = rewritten.kept.iter().map(|(block, _)| *block).collect();
    let [off, on] = known;
    let mut sides = vec![rated(&Side::off(run), &kept, reread(&environment), watch, off, last)?];
    if let (Some(switched), [Some(_)]) = (&run.switched, &sides[..]) {
        let written = reread(&Environment { block_delete: true, ..environment.clone() });
        let rated = rated(&Side::on(switched, &run.job), &kept, written, watch, on, last)?;
        sides.push(rated.map(|rated| on_off(rated, run, switched)));
    }
    let again = |known: &Known| known.met.iter().filter(|met| **met == Met::Finer).count();
    let simulated_again = [&*off, &*on].into_iter().flatten().map(again).sum();
    let mut check = Check { spacing_mm: SPACING_MM[1], simulated_again, ..Check::default() };
    let (mut after, mut breaches) = (None, Vec::new());
    for rated in sides.iter_mut().flatten() {
        check.force_rate_ratio = [check.force_rate_ratio, rated.force_rate].into_iter().flatten().reduce(f64::max);
        after = after.or_else(|| Some(std::mem::take(&mut rated.after)));
        breaches.append(&mut rated.breaches);
    }
    let strays = sides.iter().any(Option::is_none);
    let proof = (breaches.is_empty() || strays || last)
        .then(|| verify(&run.program, &rewritten.read(&run.program), &environment));
    let differences = || proof.iter().flat_map(|proof| &proof.differences);
    let doubtful = differences().filter_map(|difference| difference.block).collect();
    check.differences = differences().map(ToString::to_string).collect();
    check.differences.extend(strays.then(|| "the written path does not run along the original".into()));
    check.identical = proof.is_some() && check.differences.is_empty();
    Ok(Found { check, after: after.unwrap_or_else(|| run.before.clone()), breaches, doubtful })
}

/// Breaches found with the switch on, on the moves of the program with it off.
fn on_off(rated: Rated, run: &Run, switched: &Switched) -> Rated {
    let ids = switch::moves_off(&run.toolpath, &switched.toolpath);
    let place = |breach: &Breach| Some(Origin { move_id: ids[breach.origin.move_id.ix()]?, ..breach.origin });
    let breaches = rated.breaches.iter().filter_map(|b| Some(Breach { origin: place(b)?, ..*b })).collect();
    Rated { breaches, ..rated }
}

/// Loads of the written program in one position of the switch; `None` where it does not run along the original. In the `last`
/// round nothing is left unseen.
fn rated(
    side: &Side,
    kept: &[BlockId],
    mut written: Toolpath,
    watch: &Watch,
    known: &mut Option<Known>,
    last: bool,
) -> Result<Option<Rated>, JobError> {
    super::look::freeze_tools(&mut written, side.job);
    let Some(origins) = follow(side.toolpath, &written) else { return Ok(None) };
    let mut now = match known.take() {
        Some(known) if known.origins == origins => Known { written, ..known },
        Some(known) => known.on_with(written, origins),
        None => Known::whole(side, written, origins),
    };
    let unseen = now.met.contains(&Met::NotYet);
    // With effects of the past nothing may be missing of it.
    let found = now.rate(side, kept);
    let tells = !(last || unseen && history::is_asked_for(side.job));
    if tells && found.breaches.iter().any(|breach| asks(side.problem, breach)) {
        *known = Some(now);
        return Ok(Some(found));
    }
    let again = now.to_be_seen(side);
    let found = if again.contains(&true) {
        now.see(side, &again, watch)?;
        now.rate(side, kept)
    } else {
        found
    };
    *known = Some(now);
    Ok(Some(found))
}

impl Known {
    /// Of a file that was not looked at before: blocks it has whole are met as those of the original are.
    fn whole(side: &Side, written: Toolpath, origins: Vec<Origin>) -> Self {
        let of_move: Vec<Option<MoveId>> = written
            .moves
            .iter()
            .zip(&origins)
            .map(|(motion, origin)| {
                same_way(motion, &side.toolpath.moves[origin.move_id.ix()]).then_some(origin.move_id)
            })
            .collect();
        let map = Again { known: side.map, of_move: &of_move }.carried();
        let met = of_move.iter().map(|of| of.map_or(Met::NotYet, |_| Met::AsOriginal)).collect();
        Self { written, origins, map, met, rates: Vec::new() }
    }

    /// Of a file that cuts some blocks otherwise than this one: places that both have keep what is known of them.
    fn on_with(self, written: Toolpath, origins: Vec<Origin>) -> Self {
        let mut at = 0;
        let of_move: Vec<Option<MoveId>> = origins
            .iter()
            .map(|origin| {
                let key = |origin: &Origin| (origin.move_id, origin.from_mm);
                at += self.origins[at..].partition_point(|known| key(known) < key(origin));
                let same = self.origins.get(at).is_some_and(|known| known == origin);
                (same && self.met[at] != Met::NotYet).then_some(MoveId(at as u32))
            })
            .collect();
        let map = Again { known: &self.map, of_move: &of_move }.carried();
        let met = of_move.iter().map(|of| of.map_or(Met::NotYet, |of| self.met[of.ix()])).collect();
        Self { written, origins, map, met, rates: Vec::new() }
    }

    /// Loads over limits at its stations, at the feeds it commands.
    fn rate(&mut self, side: &Side, kept: &[BlockId]) -> Rated {
        let after = feeds(&self.written, &self.origins);
        let mut rates = std::mem::take(&mut self.rates);
        let ratios = Ratios::new(side, self, &self.map, side.job, (&after, 1.0), kept.to_vec());
        let mut breaches = ratios.all(&mut rates);
        let force_rate = ratios.force_rate(&mut breaches);
        self.rates = rates;
        Rated { after, force_rate, breaches }
    }

    /// Which moves are to be simulated for the check.
    fn to_be_seen(&self, side: &Side) -> Vec<bool> {
        let of_rate =
            rules(side.toolpath, side.map, side.job).rules.iter().any(|rule| rule.limits.force_rate_n_s.is_some());
        let near = |index: usize| {
            let range = &self.map.of_move[index];
            self.rates[range.start as usize..range.end as usize].iter().any(|rate| rate.ratio > NEAR)
        };
        let wanted = |(index, met): (usize, &Met)| match met {
            Met::NotYet => true,
            Met::AsOriginal => of_rate || near(index),
            Met::Finer => false,
        };
        self.met.iter().enumerate().map(wanted).collect()
    }

    /// Simulates some moves at the finer spacing.
    fn see(&mut self, side: &Side, which: &[bool], watch: &Watch) -> Result<(), JobError> {
        let keep = |(index, again): (usize, &bool)| (!again).then_some(MoveId(index as u32));
        let of_move: Vec<Option<MoveId>> = which.iter().enumerate().map(keep).collect();
        let options = engage::Options { spacing_mm: SPACING_MM[1], ..watch.engage };
        let progress = |done| (watch.progress)("check", done);
        let again = Again { known: &self.map, of_move: &of_move };
        let map = engage::engage_again(&self.written, side.job, &options, again, &progress)?;
        self.map = cut(map, side.job, SPACING_MM[1]);
        self.rates.clear();
        for (met, _) in self.met.iter_mut().zip(which).filter(|(_, again)| **again) {
            *met = Met::Finer;
        }
        Ok(())
    }
}

/// Does a move go the way of another, from end to end, with the same tool?
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

/// The written program under each variation of what was assumed.
pub fn stressed(run: &Run, known: &Known, watch: &Watch) -> Vec<Stressed> {
    let after = feeds(&known.written, &known.origins);
    let kept = run.written.iter().flat_map(|written| &written.kept);
    let kept: Vec<BlockId> = kept.map(|(block, _)| *block).collect();
    let side = Side::off(run);
    cases(&run.job)
        .into_iter()
        .map(|case| {
            let same = case.job.stocks == run.job.stocks;
            let map = (!same).then(|| engagement(&known.written, &case.job, watch, "stress", SPACING_MM[1]));
            let ratios = |map: &EngagementMap| {
                let feeds = (&after[..], case.override_factor);
                Ratios::new(&side, known, map, &case.job, feeds, kept.clone()).tally()
            };
            let found = match &map {
                None => Some(ratios(&known.map)),
                Some(map) => map.as_ref().ok().map(ratios),
            };
            let (worst_ratio, p99_ratio) =
                found.map_or((None, None), |found| (Some(found.ratio()), Some(found.p99_ratio)));
            Stressed { case: case.name, worst_ratio, p99_ratio }
        })
        .collect()
}

struct Ratios<'a> {
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
    kept: Vec<BlockId>,
    /// Loads depend on what was cut before, and with it on the feeds of other stations.
    past: bool,
}

impl<'a> Ratios<'a> {
    fn new(
        side: &'a Side<'a>,
        known: &'a Known,
        map: &'a EngagementMap,
        job: &Job,
        (feeds, factor): (&'a [FeedPiece], f64),
        kept: Vec<BlockId>,
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

    /// The breaches; `rates` are those of the last round, by station, or none.
    fn all(&self, rates: &mut Vec<Rate>) -> Vec<Breach> {
        let stations = &self.map.stations;
        if self.past {
            rates.clear();
        }
        rates.resize(stations.len(), APART);
        stations.par_iter().zip(rates.par_iter_mut()).for_each(|(station, rate)| *rate = self.at(station, *rate));
        let counting = || stations.iter().zip(&*rates).filter(|(_, rate)| !rate.feed_mm_s.is_nan());
        let above = counting().filter(|(_, rate)| rate.ratio > MET);
        above.filter_map(|(station, rate)| self.breach(station, rate.kind)).collect()
    }

    /// Loads over limits of everything that cuts, wherever its feed comes from.
    fn tally(&self) -> Over {
        let parts: Vec<(Over, Vec<(f64, f64)>)> =
            self.map.stations.par_chunks(CHUNK).map(|stations| self.tally_of(stations)).collect();
        let (mut over, mut ratios) = (Over::default(), Vec::new());
        for (part, mut found) in parts {
            over.join(part);
            ratios.append(&mut found);
        }
        Over { p99_ratio: p99(ratios), ..over }
    }

    fn tally_of(&self, stations: &[Station]) -> (Over, Vec<(f64, f64)>) {
        let (mut over, mut ratios) = (Over::default(), Vec::new());
        for station in stations.iter().filter(|station| station.arc_count > 0) {
            let Some(line) = self.line(station) else { continue };
            let origin = self.on_original(station);
            let loads = line.loads(self.feed_mm_s(&origin));
            let motion = &self.side.toolpath.moves[origin.move_id.ix()];
            let length_mm = station.length_mm();
            let place = Place { line: motion.line, tool: motion.tool, length_mm, apart: self.apart(&origin) };
            let limits = over::load_limits(&self.rules.of(origin.move_id).loads, self.side.job, self.rps(station));
            let ratio = over.add(&place, limits.map(|limit| (limit, loads.bounded_by(limit.kind).unwrap_or(0.0))));
            ratios.push((ratio, length_mm));
        }
        (over, ratios)
    }

    /// Largest rate of change of force over its limit, where one is in force.
    fn force_rate(&self, breaches: &mut Vec<Breach>) -> Option<f64> {
        if self.rules.rules.iter().all(|rule| rule.limits.force_rate_n_s.is_none()) {
            return None;
        }
        let places: Vec<(Origin, Step)> = self.map.stations.par_iter().map(|station| self.step(station)).collect();
        let mut steps: Vec<Step> = places.iter().map(|(_, step)| *step).collect();
        let stations = &self.map.stations;
        for i in 1..steps.len() {
            let between = stations[i - 1].move_id.ix()..=stations[i].move_id.ix();
            steps[i].joined &= self.written.moves[between].iter().all(|motion| motion.kind == MoveKind::Feed);
        }
        force_rate::worst(&steps, SPACING_MM[0], MET, &mut |from, to, ratio| {
            let slower = places[from..=to].iter().map(|(origin, step)| Breach {
                origin: *origin,
                kind: LimitKind::ForceRate,
                cap_mm_s: Some(step.feed_mm_s / ratio),
            });
            breaches.extend(slower);
        })
    }

    fn step(&self, station: &Station) -> (Origin, Step) {
        let motion = &self.written.moves[station.move_id.ix()];
        let origin = self.on_original(station);
        let feed_mm_s = self.feed_mm_s(&origin);
        let cutter = self.cutters.of(station.move_id).filter(|_| station.arc_count > 0);
        let loads = cutter.map(|cutter| cutter.loads(&self.cutters.cut(self.map, motion, station), feed_mm_s));
        let step = Step {
            force_n: loads.map_or(0.0, |loads| loads.force_xy_peak_n),
            length_mm: station.length_mm(),
            feed_mm_s,
            limit_n_s: self.rules.of(origin.move_id).limits.force_rate_n_s,
            joined: !self.is_apart(&origin),
        };
        (origin, step)
    }

    /// What a station has now; `before` is what it had last.
    fn at(&self, station: &Station, before: Rate) -> Rate {
        if station.arc_count == 0 {
            return APART;
        }
        let origin = self.on_original(station);
        let feed_mm_s = self.feed_mm_s(&origin);
        if self.is_apart(&origin) {
            return APART;
        }
        if before.feed_mm_s == feed_mm_s {
            return before;
        }
        let Some(line) = self.line(station) else { return APART };
        let loads = line.loads(feed_mm_s);
        let mut worst = Rate { feed_mm_s, ..APART };
        for (kind, limit) in self.limits(&origin, self.rps(station)) {
            let ratio = loads.bounded_by(kind).unwrap_or(0.0) / limit;
            if ratio > worst.ratio {
                (worst.ratio, worst.kind) = (ratio, kind);
            }
        }
        worst
    }

    /// Loads of a station as functions of feed.
    fn line(&self, station: &Station) -> Option<LoadLine> {
        let motion = &self.written.moves[station.move_id.ix()];
        Some(self.cutters.of(station.move_id)?.line(&self.cutters.cut(self.map, motion, station)))
    }

    fn rps(&self, station: &Station) -> f64 {
        self.written.moves[station.move_id.ix()].spin.rps
    }

    fn breach(&self, station: &Station, kind: LimitKind) -> Option<Breach> {
        let origin = self.on_original(station);
        Some(Breach { origin, kind, cap_mm_s: self.cap(&self.line(station)?, &origin, self.rps(station)) })
    }

    fn limits(&self, origin: &Origin, rps: f64) -> impl Iterator<Item = (LimitKind, f64)> + '_ {
        load_limits(&self.rules.of(origin.move_id).loads, self.side.job, rps)
    }

    /// Largest feed that meets every limit.
    fn cap(&self, line: &LoadLine, origin: &Origin, rps: f64) -> Option<f64> {
        let mut least = f64::INFINITY;
        for (kind, limit) in self.limits(origin, rps) {
            match line.cap(kind, limit) {
                Cap::Free => {}
                Cap::Feed { feed_mm_s, .. } => least = least.min(feed_mm_s),
                Cap::Unreachable => return None,
            }
        }
        Some(least)
    }

    fn on_original(&self, station: &Station) -> Origin {
        let Origin { move_id, from_mm, to_mm } = self.origins[station.move_id.ix()];
        let whole = self.written.moves[station.move_id.ix()].curve().length();
        let scale = if whole > 0.0 { (to_mm - from_mm) / whole } else { 0.0 };
        Origin { move_id, from_mm: from_mm + scale * station.from_mm, to_mm: from_mm + scale * station.to_mm }
    }

    fn is_apart(&self, origin: &Origin) -> bool {
        self.apart(origin).is_some()
    }

    fn apart(&self, origin: &Origin) -> Option<Apart> {
        let motion = &self.side.toolpath.moves[origin.move_id.ix()];
        let nodes = self.side.problem.nodes_of(origin.move_id).iter().filter(|node| overlaps(node, origin));
        Apart::of(motion, nodes, self.kept.binary_search(&motion.block).is_ok())
    }
}

/// Load limits in force, those of the spindle's curves included.
pub fn load_limits<'a>(
    rule: &'a [(LimitKind, f64)],
    job: &Job,
    rps: f64,
) -> impl Iterator<Item = (LimitKind, f64)> + 'a {
    over::load_limits(rule, job, rps).map(|limit| (limit.kind, limit.limit))
}

/// Does a breach ask for a cap that the schedule did not have?
fn asks(problem: &Problem, breach: &Breach) -> bool {
    let mut over = problem.nodes_of(breach.origin.move_id).iter().filter(|node| overlaps(node, &breach.origin));
    over.any(|node| match reachable(node, breach) {
        Some(cap_mm_s) => node.cap.feed_mm_s > cap_mm_s,
        None => node.infeasible.is_none(),
    })
}

fn overlaps(node: &Node, origin: &Origin) -> bool {
    let slack = 1e-6;
    node.from_mm < origin.to_mm - slack && node.to_mm > origin.from_mm + slack
        || origin.to_mm - origin.from_mm <= slack && node.from_mm <= origin.to_mm && node.to_mm >= origin.from_mm
}

/// Loads over limits of everything that cuts in the written program, in both positions of the switch.
pub fn over(run: &Run, rewritten: &Rewritten, known: &[Option<Known>; 2]) -> Over {
    let kept: Vec<BlockId> = rewritten.kept.iter().map(|(block, _)| *block).collect();
    let on = run.switched.as_ref().map(|switched| Side::on(switched, &run.job));
    let mut found = Over::default();
    for (side, known) in [Some(Side::off(run)), on].iter().zip(known) {
        let (Some(side), Some(known)) = (side, known) else { continue };
        let after = feeds(&known.written, &known.origins);
        found.join(Ratios::new(side, known, &known.map, side.job, (&after, 1.0), kept.clone()).tally());
    }
    found
}

/// Blocks that the proof objects to keep their feed from now on.
pub fn leave_alone(run: &mut Run, blocks: &[BlockId]) {
    for node in &mut run.problem.nodes {
        let motion = &mut run.toolpath.moves[node.move_id.ix()];
        if blocks.contains(&motion.block) {
            node.free = false;
            node.cap =
                crate::schedule::Bound { feed_mm_s: node.programmed_mm_s, kind: LimitKind::Programmed, per_unit: 0.0 };
            motion.freeze = motion.freeze.or(Some(Freeze::NotUnderstood));
        }
    }
}

/// Takes the breaches into the caps. `last`: no round is left, so they are listed as infeasible.
pub fn tighten(problem: &mut Problem, breaches: &[Breach], last: bool) {
    for breach in breaches {
        let range = problem.of_move[breach.origin.move_id.ix()].clone();
        for node in &mut problem.nodes[range.start as usize..range.end as usize] {
            if overlaps(node, &breach.origin) {
                tighten_node(node, breach, last);
            }
        }
    }
}

/// Lowers feeds where they stand: over each breach to the caps that the problem has there by now. Where blocks are split stays.
pub fn lower_in_place(pieces: &mut [FeedPiece], problem: &Problem, breaches: &[Breach], grid: &Grid) {
    for breach in breaches {
        let Origin { move_id, from_mm, to_mm } = breach.origin;
        let nodes = problem.nodes_of(move_id).iter().filter(|node| overlaps(node, &breach.origin));
        let cap_mm_s = nodes.map(|node| node.cap.feed_mm_s).fold(f64::INFINITY, f64::min);
        let first = pieces.partition_point(|piece| piece.move_id < move_id);
        let of_move = pieces[first..].iter_mut().take_while(|piece| piece.move_id == move_id);
        let over = of_move.filter(|p| p.from_mm < to_mm + OVERLAP_MM && p.to_mm > from_mm - OVERLAP_MM);
        for piece in over.filter(|piece| piece.feed_mm_s > cap_mm_s) {
            piece.feed_mm_s = grid.below(cap_mm_s);
            piece.limit = breach.kind;
        }
    }
}

/// The first place, on the original's path, where no feed allowed meets the limit.
pub fn hopeless<'a>(problem: &Problem, breaches: &'a [Breach]) -> Option<&'a Breach> {
    breaches.iter().find(|breach| {
        let nodes = problem.nodes_of(breach.origin.move_id).iter();
        nodes.filter(|node| overlaps(node, &breach.origin)).any(|node| reachable(node, breach).is_none())
    })
}

/// Feed that a breach asks for, where it is one that may be commanded.
fn reachable(node: &Node, breach: &Breach) -> Option<f64> {
    breach.cap_mm_s.filter(|cap| *cap >= crate::schedule::caps::LEAST * lowest_mm_s(node))
}

/// Where nothing was asked for because nothing was met, the lowest change of feed holds: never a feed of zero.
fn lowest_mm_s(node: &Node) -> f64 {
    let asked = if node.floor.feed_mm_s > 0.0 { node.floor.feed_mm_s } else { FEED_CHANGE_MIN * node.programmed_mm_s };
    asked.min(node.programmed_mm_s)
}

fn tighten_node(node: &mut Node, breach: &Breach, last: bool) {
    node.cap.kind = breach.kind;
    let Some(cap_mm_s) = reachable(node, breach) else {
        node.cap.feed_mm_s = lowest_mm_s(node);
        node.infeasible = Some(breach.kind);
        return;
    };
    node.cap.feed_mm_s = node.cap.feed_mm_s.min(cap_mm_s);
    node.floor.feed_mm_s = node.floor.feed_mm_s.min(node.cap.feed_mm_s);
    if last {
        node.infeasible = Some(breach.kind);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schedule::Bound;

    /// A millimetre of air that may run at 80 mm/s.
    fn air() -> Node {
        let bound = |feed_mm_s: f64| Bound { feed_mm_s, kind: LimitKind::AirFeed, per_unit: 0.0 };
        Node {
            move_id: MoveId(0),
            from_mm: 0.0,
            to_mm: 1.0,
            cap: bound(80.0),
            floor: bound(0.0),
            programmed_mm_s: 10.0,
            cutting: false,
            free: true,
            uncertain: false,
            final_surface: false,
            kept: None,
            unkept: None,
            infeasible: None,
        }
    }

    const MET_AT_30: Breach = Breach {
        origin: Origin { move_id: MoveId(0), from_mm: 0.0, to_mm: 1.0 },
        kind: LimitKind::ForceXy,
        cap_mm_s: Some(30.0),
    };

    /// Once the schedule has a cap, or has given a place up, the same breach asks for nothing more.
    #[test]
    fn a_breach_asks_until_the_schedule_has_its_cap() {
        let mut problem =
            Problem { nodes: vec![air()], of_move: std::iter::once(0..1).collect(), ..Problem::default() };
        for breach in [MET_AT_30, Breach { cap_mm_s: None, ..MET_AT_30 }] {
            assert!(asks(&problem, &breach), "{breach:?}");
            tighten(&mut problem, &[breach], false);
            assert!(!asks(&problem, &breach), "{breach:?}");
        }
        let elsewhere = Origin { from_mm: 1.5, to_mm: 2.0, ..MET_AT_30.origin };
        assert!(!asks(&problem, &Breach { origin: elsewhere, ..MET_AT_30 }));
    }

    /// A load that no feed can meet where the schedule saw air: the lowest change of feed holds, never a feed of zero (which
    /// no block can be written with).
    #[test]
    fn what_cannot_be_met_in_the_air_still_has_a_feed() {
        let (mut node, met) = (air(), MET_AT_30);
        tighten_node(&mut node, &met, false);
        assert!(node.cap.feed_mm_s == 30.0 && node.infeasible.is_none());
        tighten_node(&mut node, &Breach { cap_mm_s: None, ..met }, false);
        assert!(node.cap.feed_mm_s == FEED_CHANGE_MIN * 10.0 && node.infeasible == Some(LimitKind::ForceXy));
    }
}
