//! The certificate of a written program. In: its moves and bytes, the setup as it was read, the run. Out: the certificate's text, and the
//! places whose bounds are above their limits, with the feed they should have: the loop of `optimize` lowers them until the checker
//! ([`crate::certify`]) proves the rest.
//!
//! The written program is simulated as a whole, at a finer spacing ([`CLOSE_MM`]) and on finer rings ([`RING_PARTS`]), with the stock grown by
//! its uncertainty; what is engaged between two rings is covered by the arcs of both ([`covering`]). The bounds of loads are those of the
//! checker.

use rayon::prelude::*;

use super::certificate_arcs::covering;
use super::certificate_text::write;
use super::origins::Origin;
use super::problem::cut;
use super::task::{JobError, Watch};
use super::tighten::Breach;
use super::written_engagement::WrittenEngagement;
use crate::certify::check::{Refusal, Work, feed_moves, not_certified};
use crate::certify::cutter::Part;
use crate::certify::place::{Arc, Place};
use crate::certify::text::{MovePart, Station};
use crate::certify::{Basis, Certificate};
use crate::engage::{self, EngagementMap};
use crate::ids::MoveId;
use crate::machine::{Job, LimitKind, Segment, Slice, Tool};
use crate::nc::{Move, Toolpath};
use crate::outcome::ProgramRun;

/// Rounds in which feeds are lowered for the certificate, at most.
pub const ROUNDS: usize = 8;
/// The first rounds, in which feeds are solved anew; in later ones F words are only lowered.
pub const SOLVED: usize = 2;
/// Spacing of the simulation that a certificate rests on, mm: half of that of the check. At the check's own, loads drawn at places between
/// were up to 0.4 % above their limits on a ball-end raster (`tests/certificate.rs`).
pub const CLOSE_MM: f64 = 0.3;
/// Parts into which its rings are cut, but for those of a cylindrical side. With one and with two, loads drawn on rings a quarter as high were up
/// to 2.7 % and 0.2 % above their limits on a ball-end finishing program (`tests/certificate_draws.rs`).
pub const RING_PARTS: u32 = 4;
/// Immersion angles are widened by this, rad: twice the rounding of a full turn to the 24 bits of an arc.
const ROUNDED_RAD: f64 = 1e-6;
/// Accuracy to which the highest proven feed is searched, as a share of the feed.
const FINE: f64 = 0.002;
/// Shares of the feed that are tried first: the search is between the highest of these that is proven and the next, because most feeds are
/// only slightly too high.
const TRIED: [f64; 4] = [0.9, 0.7, 0.4, 0.0];

/// A certificate in the making.
pub struct Maker {
    /// The setup as it was read.
    job: Job,
    /// The confidence asked for.
    confidence: f64,
    /// What the cutter meets in the written file, where blocks lie as they did.
    seen: Option<(Vec<Origin>, EngagementMap)>,
}

/// A certificate, or the places that prevent it.
pub struct Attempt {
    /// Its text.
    pub text: String,
    /// Places whose bounds are above their limits.
    pub breaches: Vec<Breach>,
    /// The first of them.
    pub refusal: Option<Refusal>,
}

impl Maker {
    /// For a setup as it was read.
    pub fn new(job: &Job, confidence: f64) -> Self {
        Self { job: job.clone(), confidence, seen: None }
    }

    /// Of a written file whose moves are known.
    pub fn make(
        &mut self,
        run: &ProgramRun,
        known: &WrittenEngagement,
        bytes: &[u8],
        watch: &Watch,
    ) -> Result<Attempt, JobError> {
        let refused = |refusal: Refusal| JobError::NotCertified { line: refusal.line, why: refusal.why };
        let basis = Basis { bytes, toolpath: &known.written, job: &self.job, switched: run.program.has_block_delete() };
        not_certified(&basis).map_err(refused)?;
        if self.seen.as_ref().is_none_or(|(origins, _)| *origins != known.origins) {
            let options = engage::Options { spacing_mm: CLOSE_MM, ring_parts: RING_PARTS, ..watch.engage };
            let map = engage::engage(&known.written, &run.job, &options, &|done| (watch.progress)("certify", done))?;
            self.seen = Some((known.origins.clone(), cut(map, &run.job, CLOSE_MM)));
        }
        let Some((_, map)) = &self.seen else { unreachable!("it was just seen") };
        let mut certificate = Certificate {
            confidence: self.confidence,
            parts: parts(&known.written, map, &run.job),
            ..Certificate::default()
        };
        let work = Work::of(&certificate, &basis).map_err(refused)?;
        let given = work.given(&basis);
        let feeds: Vec<(usize, &Move)> = feed_moves(&known.written).collect();
        let of_moves: Vec<(MovePart, Vec<(Breach, Refusal)>)> =
            feeds.par_iter().map(|own| of_move(&work, *own, map, known)).collect::<Result<_, _>>().map_err(refused)?;
        let (moves, breaches): (Vec<MovePart>, Vec<Vec<(Breach, Refusal)>>) = of_moves.into_iter().unzip();
        (certificate.given, certificate.moves) = (given, moves);
        let mut breaches = breaches.into_iter().flatten().peekable();
        let refusal = breaches.peek().map(|(_, refusal)| refusal.clone());
        Ok(Attempt { text: write(&certificate), breaches: breaches.map(|(breach, _)| breach).collect(), refusal })
    }
}

/// A move with its stations, and those that are above a limit.
fn of_move(
    work: &Work,
    (index, own): (usize, &Move),
    map: &EngagementMap,
    known: &WrittenEngagement,
) -> Result<(MovePart, Vec<(Breach, Refusal)>), Refusal> {
    let (id, feed_mm_s) = (MoveId(index as u32), own.feed.mm_s);
    let mut part =
        MovePart { index, line: own.line, tool: own.tool, rps: own.spin.rps, feed_mm_s, stations: Vec::new() };
    let mut breaches = Vec::new();
    for station in map.stations_of(id) {
        let arcs = covering(map.arcs_of(station), map.slices_of(own.tool)).into_iter();
        let widened = |arc: Arc| Arc { entry: arc.entry - ROUNDED_RAD, exit: arc.exit + ROUNDED_RAD, ..arc };
        let over_mm = [station.from_mm, station.to_mm];
        let mut stated = Station { over_mm, enclosures: Default::default(), arcs: arcs.map(widened).collect() };
        if !stated.arcs.is_empty() {
            let place = work.place(own, &stated)?;
            stated.enclosures = place.enclosures();
            for (kind, bound, limit) in work.bounds(own, &place, feed_mm_s)? {
                if bound > limit {
                    let cap_mm_s = Some(highest(work, own, &place, kind)?);
                    let origin = on_original(known, id, own, stated.over_mm);
                    let why = format!("{} cannot be proven to stay below its limit", kind.name());
                    breaches.push((Breach { origin, kind, cap_mm_s }, Refusal { line: Some(own.line), why }));
                }
            }
        }
        part.stations.push(stated);
    }
    Ok((part, breaches))
}

/// The highest feed, mm/s, at which a load is proven to stay below its limit. Found by bisection: a proven bound is not worked out tightly, so
/// interpolating between two of them would not help.
fn highest(work: &Work, own: &Move, place: &Place, kind: LimitKind) -> Result<f64, Refusal> {
    let proven = |feed_mm_s: f64| -> Result<bool, Refusal> {
        let bounds = work.bounds(own, place, feed_mm_s)?;
        Ok(bounds.iter().filter(|(of, ..)| *of == kind).all(|(_, bound, limit)| bound <= limit))
    };
    let mut high = own.feed.mm_s;
    for tried in TRIED.map(|part| part * own.feed.mm_s) {
        if !proven(tried)? {
            high = tried;
            continue;
        }
        let mut low = tried;
        while high - low > FINE * own.feed.mm_s {
            let middle = 0.5 * (low + high);
            *(if proven(middle)? { &mut low } else { &mut high }) = middle;
        }
        return Ok(low);
    }
    let why = format!("{} may exceed its limit at any feed: edges rub, and a spindle idles", kind.name());
    Err(Refusal { line: Some(own.line), why })
}

/// A piece of a written move on the original's path.
fn on_original(known: &WrittenEngagement, id: MoveId, own: &Move, [from, to]: [f64; 2]) -> Origin {
    let Origin { move_id, from_mm, to_mm } = known.origins[id.ix()];
    let scale = (to_mm - from_mm) / own.curve().length();
    Origin { move_id, from_mm: from_mm + scale * from, to_mm: from_mm + scale * to }
}

/// The rings of each tool that cuts, as parts of its outline.
fn parts(written: &Toolpath, map: &EngagementMap, job: &Job) -> Vec<(u32, Vec<Part>)> {
    let fed = |number: u32| feed_moves(written).any(|(_, motion)| motion.tool == number);
    let used = map.slices.iter().filter(|(number, _)| fed(*number));
    let of = |(number, slices): &(u32, Vec<Slice>)| {
        let tool = job.tool(*number)?;
        Some((*number, slices.iter().map(|slice| part(tool, slice)).collect()))
    };
    used.filter_map(of).collect()
}

/// Where on its piece of the outline a ring lies.
fn part(tool: &Tool, slice: &Slice) -> Part {
    let segment = &tool.profile.segments[usize::from(slice.segment)];
    let middle = match segment {
        Segment::Line { from, to } => {
            let along = [to[0] - from[0], to[1] - from[1]];
            let at = [slice.radius_mm - from[0], slice.z_mm - from[1]];
            (along[0] * at[0] + along[1] * at[1]) / (along[0] * along[0] + along[1] * along[1])
        }
        Segment::Arc { centre, from_rad, to_rad, .. } => {
            let turn = (slice.z_mm - centre[1]).atan2(slice.radius_mm - centre[0]);
            (turn - from_rad) / (to_rad - from_rad)
        }
    };
    let half = 0.5 * slice.edge_mm / segment.length();
    Part { segment: usize::from(slice.segment), from: middle - half, to: middle + half }
}
