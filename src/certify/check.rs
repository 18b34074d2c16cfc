//! The check of a certificate. In: its text, the moves of the written program, the setup. Out: what is proven; or the line and the reason why it
//! is not.

use rayon::prelude::*;

use super::ellipsoid::Ellipsoid;
use super::limits::{Basis, fingerprint, in_force, not_covered, tool_of, unknown_motion};
use super::place::{Place, rise};
use super::text::{Certificate, MovePart, Station, read, sha256};
use super::witness::{Field, look};
use crate::machine::{LimitKind, Tool};
use crate::nc::{Move, MoveKind, Toolpath};

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

/// Checks a certificate. Returns the proven bounds, or why it does not prove them.
pub fn check(text: &str, basis: &Basis) -> Result<Proven, Refusal> {
    let certificate = read(text).or_else(|why| refused(None, why))?;
    not_certified(basis)?;
    let work = Work::of(&certificate, basis)?;
    work.is_of(basis)?;
    let feeds: Vec<(usize, &Move)> = feed_moves(basis.toolpath).collect();
    if feeds.len() != certificate.moves.len() {
        let [own, stated] = [feeds.len(), certificate.moves.len()];
        return refused(None, format!("the program has {own} feed moves, the certificate {stated}"));
    }
    let found: Vec<Result<Vec<(LimitKind, f64)>, Refusal>> =
        feeds.par_iter().zip(&certificate.moves).map(|(own, stated)| work.motion(*own, stated)).collect();
    let ratios: Vec<(LimitKind, f64)> = found.into_iter().collect::<Result<Vec<_>, _>>()?.concat();
    let largest = |kind: LimitKind| {
        let of_kind = ratios.iter().filter(|(of, _)| *of == kind).map(|(_, ratio)| *ratio);
        Some((kind, of_kind.reduce(f64::max)?))
    };
    let ratios = LimitKind::ALL.into_iter().filter_map(largest).collect();
    let mut proven = Proven { confidence: certificate.confidence, ratios, ..Proven::default() };
    if let Some(mut field) = Field::new(basis.job, basis.toolpath) {
        if let Some(line) = look(&mut field, basis, &certificate) {
            return refused(Some(line), "material stands where the certificate says that nothing is engaged");
        }
        proven.witnessed = true;
    }
    let stations = || certificate.moves.iter().flat_map(|motion| &motion.stations);
    proven.counts = [feeds.len(), stations().count(), stations().filter(|of| !of.arcs.is_empty()).count()];
    Ok(proven)
}

fn words(numbers: impl Iterator<Item = f64>) -> String {
    numbers.fold(String::new(), |text, number| text + &format!(" {number:?}"))
}

/// Moves at a feed that have a length, with their places among all.
pub fn feed_moves(toolpath: &Toolpath) -> impl Iterator<Item = (usize, &Move)> {
    let fed = |motion: &Move| motion.kind == MoveKind::Feed && motion.curve().length() > NO_LENGTH_MM;
    toolpath.moves.iter().enumerate().filter(move |(_, motion)| fed(motion))
}

/// Why no certificate is possible for this program and setup, if so.
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
    if let Some(line) = toolpath.unseen_cuts.first() {
        return refused(Some(*line), "not certified: what this cuts is not simulated".to_owned());
    }
    let unknown = feed_moves(toolpath).find_map(|(_, motion)| Some((motion.line, unknown_motion(motion)?)));
    unknown.map_or(Ok(()), |(line, why)| refused(Some(line), format!("not certified: {why}")))
}

/// Limits and ellipsoids of each tool at each spindle speed.
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
    /// Tools, limits and ellipsoids of a program.
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

    /// What a certificate has to say of program and setup, line by line.
    pub fn given(&self, basis: &Basis) -> Vec<String> {
        let mut lines = vec![
            format!("program {}", sha256(basis.bytes)),
            format!("setup {}", fingerprint(basis.job)),
            format!("confidence {:?}", self.certificate.confidence),
            format!("stock{}", words(basis.job.stocks.iter().map(|stock| stock.uncertainty_mm))),
        ];
        for Known { number, rps, limits, ellipsoid: Ellipsoid { radius, mean, shape, .. }, .. } in &self.known {
            lines.extend(limits.iter().map(|(kind, value)| format!("limit {number} {} {value:?}", kind.name())));
            let numbers = [*radius].into_iter().chain(*mean).chain(shape.iter().flatten().copied());
            lines.push(format!("ellipsoid {number} {rps:?}{}", words(numbers)));
        }
        lines
    }

    /// Is the certificate of this program and this setup?
    fn is_of(&self, basis: &Basis) -> Result<(), Refusal> {
        let (own, stated) = (self.given(basis), &self.certificate.given);
        let differs = own.iter().zip(stated).find(|(own, stated)| own != stated).map(|(own, _)| own.split(' ').next());
        match differs.flatten() {
            None if own.len() == stated.len() => Ok(()),
            Some("program") => {
                refused(None, "the certificate is of another program: its SHA-256 is not that of this one")
            }
            Some("setup") => refused(None, "the certificate was made with another setup"),
            what => refused(None, format!("{} of the certificate is not that of the setup", what.unwrap_or("a limit"))),
        }
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
            let place = self.place(own, station)?;
            if station.enclosures.iter().zip(place.enclosures()).any(|(stated, found)| !stated.holds(found)) {
                return refused(line, "an enclosure of depth, torque or chip does not hold what follows from its arcs");
            }
            for (kind, bound, limit) in self.bounds(own, &place, own.feed.mm_s)? {
                if bound.is_nan() || bound > limit {
                    let [bound, limit] = [bound, limit].map(|value| kind.in_report_unit(value));
                    let (name, unit, [from, to]) = (kind.name(), kind.unit(), station.over_mm);
                    let load = format!("{name} may reach {bound:.4} {unit} of {limit:.4}");
                    return refused(line, format!("{load} from {from:.2} to {to:.2} mm of the move"));
                }
                ratios.push((kind, bound / limit));
            }
        }
        Ok(ratios)
    }

    /// The place of a station, worked out.
    pub fn place(&self, own: &Move, station: &Station) -> Result<Place, Refusal> {
        let known = self.known_of(own)?;
        let (parts, rise) = (self.certificate.parts_of(own.tool), rise(&own.curve(), station.over_mm));
        let place = Place::new(known.tool, parts, &station.arcs, rise);
        place.map_or_else(|| refused(Some(own.line), "an arc lies on no part of the tool"), Ok)
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
