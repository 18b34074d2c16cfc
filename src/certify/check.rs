//! The proof. In: a certificate's text, the moves of the written program, the setup. Out: what is proven, or what is refused, with lines.

use rayon::prelude::*;

use super::cutter::Part;
use super::ellipsoid::Ellipsoid;
use super::limits::{fingerprint, in_force, not_covered, tool_of, unknown_motion};
use super::place::{Place, rise};
use super::text::{Certificate, MovePart, Stated, Station, read, sha256};
use super::witness::{Field, look};
use crate::machine::{Job, LimitKind, Tool};
use crate::nc::{Move, MoveKind, Toolpath};

/// What the control is given.
#[derive(Clone, Copy)]
pub struct Basis<'a> {
    /// The bytes of the program.
    pub bytes: &'a [u8],
    /// What it does.
    pub toolpath: &'a Toolpath,
    /// The setup as it is read.
    pub job: &'a Job,
    /// Are there blocks under the block-delete switch?
    pub switched: bool,
}

/// What is proven.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Proven {
    /// Confidence.
    pub confidence: f64,
    /// Feed moves, stations, those that cut.
    pub counts: [usize; 3],
    /// The largest bound of each load over its limit.
    pub ratios: Vec<(LimitKind, f64)>,
    /// Was the engagement held against the coarse simulation? Not with stock from a file, or under several work offsets.
    pub witnessed: bool,
}

/// Why it is not.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// Line of the written program, where it is one.
    pub line: Option<u32>,
    /// What is wrong.
    pub why: String,
}

/// Two places on a move are the same if they differ by no more, mm: the rounding of lengths.
const SAME_MM: f64 = 1e-9;
/// A move shorter than this has no stations, mm.
const NO_LENGTH_MM: f64 = 1e-9;

fn refused<T>(line: Option<u32>, why: impl Into<String>) -> Result<T, Refusal> {
    Err(Refusal { line, why: why.into() })
}

/// Proves, or says why not.
pub fn check(text: &str, basis: &Basis) -> Result<Proven, Refusal> {
    let certificate = read(text).or_else(|why| refused(None, why))?;
    bound_to(&certificate, basis)?;
    let work = Work::new(&certificate, basis)?;
    let feeds: Vec<(usize, &Move)> = feed_moves(basis.toolpath).collect();
    if feeds.len() != certificate.moves.len() {
        let [own, stated] = [feeds.len(), certificate.moves.len()];
        return refused(None, format!("the program has {own} feed moves, the certificate {stated}"));
    }
    let found: Vec<Result<Vec<(LimitKind, f64)>, Refusal>> =
        feeds.par_iter().zip(&certificate.moves).map(|(own, stated)| work.motion(*own, stated)).collect();
    let mut proven = Proven { confidence: certificate.confidence, ..Proven::default() };
    for ratios in found {
        ratios?.into_iter().for_each(|(kind, ratio)| raise(&mut proven.ratios, kind, ratio));
    }
    if let Some(mut field) = Field::new(basis.job, basis.toolpath) {
        let tool = |motion: &Move| tool_of(basis.job, motion).cloned();
        let parts = |number: u32| work.parts(number).to_vec();
        if let Some(line) = look(&mut field, basis.toolpath, &certificate.moves, &tool, &parts) {
            return refused(Some(line), "material stands where the certificate says that nothing is engaged");
        }
        proven.witnessed = true;
    }
    let stations = || certificate.moves.iter().flat_map(|motion| &motion.stations);
    proven.counts = [feeds.len(), stations().count(), stations().filter(|of| !of.arcs.is_empty()).count()];
    Ok(proven)
}

/// Moves at a feed that have a length, with their places among all.
pub fn feed_moves(toolpath: &Toolpath) -> impl Iterator<Item = (usize, &Move)> {
    let fed = |motion: &Move| motion.kind == MoveKind::Feed && motion.curve().length() > NO_LENGTH_MM;
    toolpath.moves.iter().enumerate().filter(move |(_, motion)| fed(motion))
}

fn raise(ratios: &mut Vec<(LimitKind, f64)>, kind: LimitKind, ratio: f64) {
    match ratios.iter_mut().find(|(known, _)| *known == kind) {
        Some((_, known)) => *known = known.max(ratio),
        None => ratios.push((kind, ratio)),
    }
}

/// Is it of this program and this setup, and of a kind that is certified?
fn bound_to(certificate: &Certificate, basis: &Basis) -> Result<(), Refusal> {
    let job = basis.job;
    if certificate.program != sha256(basis.bytes) {
        return refused(None, "the certificate is of another program: its SHA-256 is not that of this one");
    }
    if certificate.setup != fingerprint(job) {
        return refused(None, "the certificate was made with another setup");
    }
    if certificate.stock_mm != stock_mm(job) {
        return refused(None, "the uncertainty of the stock is not that of the setup");
    }
    not_certified(basis)
}

/// How far each piece of stock may stand proud, mm.
pub fn stock_mm(job: &Job) -> Vec<f64> {
    job.stocks.iter().map(|stock| stock.uncertainty_mm).collect()
}

/// What no certificate speaks about.
pub fn not_certified(basis: &Basis) -> Result<(), Refusal> {
    let Basis { toolpath, job, switched, .. } = basis;
    let never = |what: &str| refused(None, format!("not certified: {what}"));
    if *switched {
        return never("a program with blocks under the block-delete switch");
    }
    if !toolpath.files.is_empty() {
        return never("a program that calls subprograms in other files");
    }
    if let Some(effect) = job.process.effects.first() {
        return never(&format!("a process model with the effect {}", effect.name));
    }
    if let Some(doubted) = toolpath.doubts.iter().find(|doubted| !job.confirmed.contains(&doubted.doubt.name())) {
        let why = format!("not certified: {} is not known from here on", doubted.doubt.name());
        return refused(Some(doubted.line), why);
    }
    for (_, motion) in feed_moves(toolpath) {
        if let Some(why) = unknown_motion(motion) {
            return refused(Some(motion.line), format!("not certified: {why}"));
        }
    }
    Ok(())
}

/// What is known of each tool at each speed.
pub struct Work<'a> {
    certificate: &'a Certificate,
    known: Vec<Known<'a>>,
}

/// A tool at a speed.
struct Known<'a> {
    number: u32,
    rps: f64,
    tool: &'a Tool,
    limits: Vec<(LimitKind, f64)>,
    ellipsoid: Ellipsoid,
}

impl<'a> Work<'a> {
    /// Tools, limits and ellipsoids of a program, those that are stated being the same.
    fn new(certificate: &'a Certificate, basis: &Basis<'a>) -> Result<Self, Refusal> {
        let work = Self::of(certificate, basis)?;
        if certificate.limits != work.limits() {
            return refused(None, "the limits are not those of the setup");
        }
        if certificate.ellipsoids != work.ellipsoids() {
            return refused(None, "the ellipsoid of the coefficients is not that of the setup");
        }
        Ok(work)
    }

    /// The same for a certificate in the making.
    pub fn of(certificate: &'a Certificate, basis: &Basis<'a>) -> Result<Self, Refusal> {
        let job = basis.job;
        let mut known: Vec<Known> = Vec::new();
        for (_, motion) in feed_moves(basis.toolpath) {
            let (number, rps) = (motion.tool, motion.spin.rps);
            if known.iter().any(|of| of.number == number && of.rps == rps) {
                continue;
            }
            let line = Some(motion.line);
            let Some(tool) = tool_of(job, motion) else {
                return refused(line, format!("T{number} is not in the setup"));
            };
            let limits = in_force(job, tool, rps);
            if let Some(what) = not_covered(tool, &limits) {
                return refused(line, format!("not certified: {what}"));
            }
            let ellipsoid = Ellipsoid::of(job, tool, rps, certificate.confidence)
                .or_else(|why| refused(line, format!("not certified: {why}")))?;
            known.push(Known { number, rps, tool, limits, ellipsoid });
        }
        Ok(Self { certificate, known })
    }

    /// Limits in force, as a certificate states them.
    pub fn limits(&self) -> Vec<(u32, String, f64)> {
        let of = |known: &Known| {
            let limits = known.limits.clone().into_iter();
            let number = known.number;
            limits.map(move |(kind, value)| (number, kind.name().to_owned(), value)).collect::<Vec<_>>()
        };
        self.known.iter().flat_map(of).collect()
    }

    /// Ellipsoids, as a certificate states them.
    pub fn ellipsoids(&self) -> Vec<Stated> {
        self.known.iter().map(|known| Stated::of(known.number, known.rps, &known.ellipsoid)).collect()
    }

    /// The largest bounds of a move over their limits.
    fn motion(&self, (index, own): (usize, &Move), stated: &MovePart) -> Result<Vec<(LimitKind, f64)>, Refusal> {
        let line = Some(own.line);
        let of_program = (index, own.line, own.tool, own.spin.rps, own.feed.mm_s);
        if of_program != (stated.index, stated.line, stated.tool, stated.rps, stated.feed_mm_s) {
            return refused(line, "line, tool, speed or feed of the certificate are not those of the program");
        }
        let length = own.curve().length();
        let mut at = 0.0;
        for station in &stated.stations {
            let [from, to] = station.over_mm;
            if (from - at).abs() > SAME_MM || to < from {
                return refused(line, format!("the stations do not cover the move: a gap at {at:.4} mm"));
            }
            at = to;
        }
        if (at - length).abs() > SAME_MM * (1.0 + length) {
            return refused(line, format!("the stations cover {at:.4} mm of {length:.4} mm"));
        }
        let mut ratios = Vec::new();
        for station in stated.stations.iter().filter(|station| !station.arcs.is_empty()) {
            for (kind, bound, limit) in self.loads(own, station, own.feed.mm_s)? {
                if bound.is_nan() || bound > limit {
                    let [bound, limit] = [bound, limit].map(|value| kind.in_report_unit(value));
                    let (name, unit) = (kind.name(), kind.unit());
                    let [from, to] = station.over_mm;
                    return refused(
                        line,
                        format!(
                            "{name} may reach {bound:.4} {unit} of {limit:.4} from {from:.2} to {to:.2} mm of the move"
                        ),
                    );
                }
                raise(&mut ratios, kind, bound / limit);
            }
        }
        Ok(ratios)
    }

    /// Bounds of the limited loads of a station at a feed: kind, bound, limit. What the station states must hold them.
    pub fn loads(&self, own: &Move, station: &Station, feed_mm_s: f64) -> Result<Vec<(LimitKind, f64, f64)>, Refusal> {
        let line = Some(own.line);
        let place = self.place(own, station)?;
        let of_own = [(station.depth, place.depth), (station.torque[0], place.torque[0])];
        let of_own = of_own.into_iter().chain([(station.torque[1], place.torque[1]), (station.chip, place.chip)]);
        for (stated, found) in of_own {
            if !stated.holds(found) {
                return refused(line, "an enclosure of depth, torque or chip does not hold what follows from its arcs");
            }
        }
        self.bounds(own, &place, feed_mm_s)
    }

    /// The place of a station, worked out.
    pub fn place(&self, own: &Move, station: &Station) -> Result<Place, Refusal> {
        let known = self.known_of(own)?;
        let place = Place::new(known.tool, self.parts(own.tool), &station.arcs, rise(&own.curve(), station.over_mm));
        place.map_or_else(|| refused(Some(own.line), "an arc lies on no part of the tool"), Ok)
    }

    /// The rings of a tool.
    pub fn parts(&self, number: u32) -> &[Part] {
        let found = self.certificate.parts.iter().find(|(known, _)| *known == number);
        found.map_or(&[], |(_, parts)| parts)
    }

    /// Bounds of the limited loads at a place.
    pub fn bounds(&self, own: &Move, place: &Place, feed_mm_s: f64) -> Result<Vec<(LimitKind, f64, f64)>, Refusal> {
        let known = self.known_of(own)?;
        if known.rps.is_nan() || known.rps <= 0.0 {
            return refused(Some(own.line), "the spindle stands while the tool may cut");
        }
        // One rounding up: a feed per tooth that is not below the exact one.
        let f = (feed_mm_s / (f64::from(known.tool.flutes) * known.rps)).next_up().next_up();
        let of = |(kind, limit): &(LimitKind, f64)| {
            let bound = place.most(*kind, f, known.rps, *limit, &known.ellipsoid)?;
            Some((*kind, bound, *limit))
        };
        Ok(known.limits.iter().filter_map(of).collect())
    }

    fn known_of(&self, own: &Move) -> Result<&Known<'a>, Refusal> {
        let found = self.known.iter().find(|known| known.number == own.tool && known.rps == own.spin.rps);
        found.map_or_else(|| refused(Some(own.line), "a tool or speed that is not known"), Ok)
    }
}
