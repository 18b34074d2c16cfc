//! The path in stretches on which the page shows one value. In: a run. Out: [`Path`]: samples in columns, and the points they run
//! through.
//!
//! Level of detail: no more than [`SAMPLES`] samples, neighbours of one operation are joined; a joined sample shows the largest
//! loads of its parts, and feed, line and reason of the part with the largest share of a limit. No more than [`POINTS`] points:
//! of those nearer to each other than a tolerance one is left, and the tolerance doubles until they fit.

use serde::Serialize;

use super::digits::digits;
use super::operations::Operations;
use crate::engage::workpiece::shift;
use crate::ids::MoveId;
use crate::machine::LimitKind;
use crate::nc::{Move, MoveKind};
use crate::outcome::ProgramRun;
use crate::outcome::over_limits::load_limits;
use crate::outcome::station_loads::{Feeds, StationLoads, each_station};
use crate::path::{Curve, Vec3};
use crate::report::figures::node_at;
use crate::report::table::Clock;
use crate::report::words::plain;
use crate::schedule::rules::rules;
use crate::units::mm_min_from_mm_s;

/// Most samples: several to a pixel of the widest curve, and 6 MB of text.
const SAMPLES: usize = 20_000;
/// Most points: 6 MB of text.
const POINTS: usize = 240_000;
/// Longest chord of an arc, rad: its sagitta is 0.2 % of the radius.
const CHORD_RAD: f64 = 0.12;
/// First tolerance between points, as a part of the size of the box: a fifth of a pixel.
const FINE: f64 = 2e-4;

/// Loads that the page can show.
pub const LOADS: [LimitKind; LimitKind::LOADS.len()] = LimitKind::LOADS;

/// The path as columns, one value a sample.
#[derive(Debug, Default, Serialize)]
pub struct Columns {
    line: Vec<u32>,
    operation: Vec<usize>,
    tool: Vec<u32>,
    rapid: Vec<u8>,
    reason: Vec<usize>,
    p0: Vec<usize>,
    p1: Vec<usize>,
    s: Vec<f64>,
    before_s: Vec<f64>,
    after_s: Vec<f64>,
    feed_before: Vec<f64>,
    feed_after: Vec<f64>,
}

impl Columns {
    /// Lines that samples stand for.
    pub fn lines(&self) -> &[u32] {
        &self.line
    }
}

/// Coordinates of points, column by column.
#[derive(Debug, Default, Serialize)]
pub struct Points {
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
}

/// One load along the samples.
#[derive(Debug, Serialize)]
pub struct Load {
    key: &'static str,
    label: &'static str,
    unit: String,
    before: Vec<f64>,
    after: Vec<f64>,
    /// Where its limit changes: first sample and value.
    limit: Vec<(usize, Option<f64>)>,
}

/// Everything the views draw.
#[derive(Debug)]
pub struct Path {
    /// Samples.
    pub columns: Columns,
    /// Points.
    pub points: Points,
    /// Loads that are met anywhere.
    pub loads: Vec<Load>,
    /// Why feeds are what they are; samples point here.
    pub reasons: Vec<String>,
    /// Lowest and highest corner of the feed moves.
    pub bounds: [[f64; 3]; 2],
}

/// A sample while it is gathered.
#[derive(Debug, Clone)]
struct Sample {
    line: u32,
    operation: usize,
    tool: u32,
    rapid: bool,
    reason: usize,
    /// Largest load over its limit, as written.
    ratio: f64,
    parts: usize,
    start: [f64; 3],
    feeds: [f64; 2],
    before: [f64; LOADS.len()],
    after: [f64; LOADS.len()],
    limits: [Option<f64>; LOADS.len()],
    points: Vec<Vec3>,
}

/// Where a move lies for the page: the work coordinates of the program's first offset.
pub struct Frame<'a> {
    run: &'a ProgramRun,
    /// Origin of the first offset in the common frame.
    pub origin: Vec3,
}

impl<'a> Frame<'a> {
    /// Of a run.
    pub fn new(run: &'a ProgramRun) -> Self {
        let first = run.toolpath.moves.first().map_or(54, |motion| motion.wcs);
        Self { run, origin: shift(&run.job, &run.toolpath, first) }
    }
    fn at(&self, motion: &Move, s_mm: f64) -> Vec3 {
        motion.curve().point(s_mm) + shift(&self.run.job, &self.run.toolpath, motion.wcs) - self.origin
    }
    /// Points along a stretch of a move, both ends included.
    fn along(&self, motion: &Move, from_mm: f64, to_mm: f64) -> Vec<Vec3> {
        let curve = motion.curve();
        let chords = match &curve {
            Curve::Line { .. } => 1.0,
            Curve::Arc(arc) => {
                (arc.sweep_rad.abs() * (to_mm - from_mm) / curve.length().max(1e-12) / CHORD_RAD).ceil().max(1.0)
            }
        };
        (0..=chords as usize).map(|k| self.at(motion, from_mm + (to_mm - from_mm) * k as f64 / chords)).collect()
    }
}

struct Gathering<'a> {
    run: &'a ProgramRun,
    frame: Frame<'a>,
    operations: &'a Operations,
    /// Parts a sample may have.
    group: usize,
    /// Rapids are joined with what is beside them, so many are there.
    across: bool,
    samples: Vec<Sample>,
    reasons: Vec<String>,
    next_move: usize,
    s_mm: f64,
}

/// The path of a run; every length times `factor`.
pub fn path(run: &ProgramRun, operations: &Operations, factor: f64) -> Path {
    let rapids = run.toolpath.moves.iter().filter(|motion| motion.kind == MoveKind::Rapid).count();
    let entries = run.map.stations.len() + rapids;
    let mut gathering = Gathering {
        run,
        frame: Frame::new(run),
        operations,
        group: entries.div_ceil(SAMPLES).max(1),
        across: rapids > SAMPLES / 4,
        samples: Vec::new(),
        reasons: Vec::new(),
        next_move: 0,
        s_mm: 0.0,
    };
    let mut clock = Clock::new(run);
    let moves = run.toolpath.moves.len();
    let feeds = [Feeds::new(&run.before, moves), Feeds::new(run.after(), moves)];
    let rules = rules(&run.toolpath, &run.map, &run.job);
    each_station(run, &mut |found| {
        let id = found.station.move_id;
        gathering.rapids(&clock, id.ix());
        let [before_s, after_s] = clock.at(found, &feeds);
        let rps = run.toolpath.moves[id.ix()].spin.rps;
        let limits = load_limits(&rules.of(id).loads, &run.job, rps).map(|limit| (limit.kind, limit.limit));
        gathering.station(found, limits, [before_s, after_s]);
    });
    gathering.rapids(&clock, moves);
    gathering.finish(&clock, factor)
}

impl Gathering<'_> {
    /// Rapids up to the move of this number.
    fn rapids(&mut self, clock: &Clock, until: usize) {
        while self.next_move < until {
            let id = MoveId(self.next_move as u32);
            self.next_move += 1;
            let motion = &self.run.toolpath.moves[id.ix()];
            if motion.kind != MoveKind::Rapid {
                continue;
            }
            let [before_s, after_s] = clock.start_of(id);
            let points = self.frame.along(motion, 0.0, motion.curve().length());
            let sample = self.sample(motion, [before_s, after_s], points);
            self.join(sample);
        }
    }

    fn station(
        &mut self,
        found: &StationLoads,
        limits: impl Iterator<Item = (LimitKind, f64)>,
        [before_s, after_s]: [f64; 2],
    ) {
        let station = found.station;
        let motion = &self.run.toolpath.moves[station.move_id.ix()];
        let points = self.frame.along(motion, station.from_mm, station.to_mm);
        let mut sample = self.sample(motion, [before_s, after_s], points);
        sample.feeds = [found.feed_before_mm_s, found.feed_after_mm_s].map(mm_min_from_mm_s);
        for (k, kind) in LOADS.into_iter().enumerate() {
            let shown = |value: Option<f64>| kind.in_report_unit(value.unwrap_or(0.0));
            (sample.before[k], sample.after[k]) =
                (shown(found.before.bounded_by(kind)), shown(found.after.bounded_by(kind)));
        }
        for (kind, limit) in limits {
            sample.ratio = sample.ratio.max(found.after.bounded_by(kind).unwrap_or(0.0) / limit);
            if let Some(k) = LOADS.iter().position(|known| *known == kind) {
                let limit = kind.in_report_unit(limit);
                sample.limits[k] = Some(sample.limits[k].map_or(limit, |known: f64| known.min(limit)));
            }
        }
        sample.reason = self.reason(found);
        self.s_mm += station.length_mm();
        self.join(sample);
    }

    fn sample(&self, motion: &Move, [before_s, after_s]: [f64; 2], points: Vec<Vec3>) -> Sample {
        let none = [0.0; LOADS.len()];
        Sample {
            line: motion.line,
            operation: self.operations.of(motion),
            tool: motion.tool,
            rapid: motion.kind == MoveKind::Rapid,
            reason: 0,
            ratio: 0.0,
            parts: 1,
            start: [self.s_mm, before_s, after_s],
            feeds: [0.0; 2],
            before: none,
            after: none,
            limits: [None; LOADS.len()],
            points,
        }
    }

    /// Why the feed is what it is here; by number, 0 is nothing.
    fn reason(&mut self, found: &StationLoads) -> usize {
        if self.reasons.is_empty() {
            self.reasons.push(String::new());
        }
        let Some(at) = node_at(self.run, found.station) else { return 0 };
        let nodes = &self.run.problem.nodes;
        let holder = self.run.written.as_ref().map(|written| written.schedule.holders[at]);
        let elsewhere = holder.filter(|holder| holder.is_elsewhere(nodes[at].cap.feed_mm_s));
        let node = elsewhere.map_or(&nodes[at], |holder| &nodes[holder.node as usize]);
        let place = if elsewhere.is_some() { ", elsewhere under the same feed" } else { "" };
        let text = match (nodes[at].infeasible, node.not_raised) {
            (Some(kind), _) => format!("{} is above its limit even at the lowest feed allowed", plain(kind)),
            (None, Some(kept)) if found.feed_after_mm_s >= found.feed_before_mm_s => {
                format!("not raised: {}{place}", kept.why())
            }
            _ if holder.is_none() => return 0,
            (None, _) => format!("held by: {}{place}", plain(node.cap.kind)),
        };
        self.reasons.iter().position(|known| *known == text).unwrap_or_else(|| {
            self.reasons.push(text);
            self.reasons.len() - 1
        })
    }

    fn join(&mut self, new: Sample) {
        let alike = |known: &&mut Sample| {
            known.parts < self.group
                && (known.operation, known.tool) == (new.operation, new.tool)
                && (known.rapid == new.rapid || self.across)
        };
        let Some(known) = self.samples.last_mut().filter(alike) else {
            self.samples.push(new);
            return;
        };
        let gravest = new.ratio > known.ratio || known.rapid && !new.rapid;
        if gravest {
            (known.line, known.reason, known.feeds, known.ratio) = (new.line, new.reason, new.feeds, new.ratio);
        }
        known.rapid &= new.rapid;
        known.parts += 1;
        for k in 0..LOADS.len() {
            known.before[k] = known.before[k].max(new.before[k]);
            known.after[k] = known.after[k].max(new.after[k]);
            known.limits[k] = known.limits[k].into_iter().chain(new.limits[k]).reduce(f64::min);
        }
        known.points.extend(new.points);
    }

    fn finish(self, clock: &Clock, factor: f64) -> Path {
        let Self { mut samples, reasons, s_mm, .. } = self;
        let bounds = bounds(&samples, factor);
        thin(&mut samples, bounds, factor);
        let mut columns = Columns::default();
        let mut points = Points::default();
        let [before_s, after_s] = clock.end();
        let mut ends = samples.iter().skip(1).map(|sample| sample.start).collect::<Vec<_>>();
        ends.push([s_mm, before_s, after_s]);
        for (sample, end) in samples.iter().zip(ends) {
            columns.push(sample, end, factor);
            let (first, last) = points.push(&sample.points, factor);
            columns.p0.push(first);
            columns.p1.push(last);
        }
        Path { columns, points, loads: loads(&samples, factor), reasons, bounds }
    }
}

impl Columns {
    fn push(&mut self, sample: &Sample, [s_mm, before_s, after_s]: [f64; 3], factor: f64) {
        self.line.push(sample.line);
        self.operation.push(sample.operation);
        self.tool.push(sample.tool);
        self.rapid.push(u8::from(sample.rapid));
        self.reason.push(sample.reason);
        self.s.push(digits(factor * s_mm));
        self.before_s.push(digits(before_s));
        self.after_s.push(digits(after_s));
        self.feed_before.push(digits(factor * sample.feeds[0]));
        self.feed_after.push(digits(factor * sample.feeds[1]));
    }
}

impl Points {
    /// Adds a chain of points, the first only where it is not where the last one ended; returns its first and last.
    fn push(&mut self, chain: &[Vec3], factor: f64) -> (usize, usize) {
        let mut first = None;
        for point in chain {
            let [x, y, z] = [0, 1, 2].map(|k| digits(factor * point[k]));
            if first.is_some() || (self.x.last(), self.y.last(), self.z.last()) != (Some(&x), Some(&y), Some(&z)) {
                self.x.push(x);
                self.y.push(y);
                self.z.push(z);
            }
            first = first.or(Some(self.x.len() - 1));
        }
        (first.unwrap_or(0), self.x.len().saturating_sub(1))
    }
}

fn bounds(samples: &[Sample], factor: f64) -> [[f64; 3]; 2] {
    let points = samples.iter().filter(|sample| !sample.rapid).flat_map(|sample| &sample.points);
    let start = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let (low, high) = points.fold(start, |(low, high), point| (low.inf(point), high.sup(point)));
    [low, high].map(|corner| [0, 1, 2].map(|k| if corner[k].is_finite() { digits(factor * corner[k]) } else { 0.0 }))
}

/// Leaves points out until no more than [`POINTS`] are left; the ends of samples stay.
fn thin(samples: &mut [Sample], [low, high]: [[f64; 3]; 2], factor: f64) {
    let size = (0..3).map(|k| (high[k] - low[k]).powi(2)).sum::<f64>().sqrt() / factor;
    let mut apart_mm = FINE * size;
    while apart_mm > 0.0 && samples.iter().map(|sample| sample.points.len()).sum::<usize>() > POINTS {
        for sample in &mut *samples {
            let Some((last, inner)) = sample.points.split_last() else { continue };
            let mut kept: Vec<Vec3> = Vec::new();
            for point in inner {
                if kept.last().is_none_or(|known| (point - known).norm() > apart_mm) {
                    kept.push(*point);
                }
            }
            kept.push(*last);
            sample.points = kept;
        }
        if samples.iter().all(|sample| sample.points.len() <= 2) {
            break;
        }
        apart_mm *= 2.0;
    }
}

/// The loads that are met or limited anywhere, those with a limit first.
fn loads(samples: &[Sample], factor: f64) -> Vec<Load> {
    let load = |k: usize| {
        let kind = LOADS[k];
        let unit = kind.unit();
        let (unit, factor) = if unit == "mm" && factor < 1.0 { ("in", factor) } else { (unit, 1.0) };
        let column = |of: fn(&Sample) -> &[f64; LOADS.len()]| -> Vec<f64> {
            samples.iter().map(|sample| digits(factor * of(sample)[k])).collect()
        };
        let mut limit: Vec<(usize, Option<f64>)> = Vec::new();
        for (i, sample) in samples.iter().enumerate().filter(|(_, sample)| !sample.rapid) {
            let value = sample.limits[k].map(|value| digits(factor * value));
            if limit.last().is_none_or(|(_, known)| *known != value) {
                limit.push((i, value));
            }
        }
        if limit.iter().all(|(_, value)| value.is_none()) {
            limit.clear();
        }
        let (before, after) = (column(|sample| &sample.before), column(|sample| &sample.after));
        Load { key: kind.name(), label: plain(kind), unit: unit.into(), before, after, limit }
    };
    let mut found: Vec<Load> = (0..LOADS.len()).map(load).collect();
    found.retain(|load| load.before.iter().chain(&load.after).any(|value| *value > 0.0) || !load.limit.is_empty());
    found.sort_by_key(|load| load.limit.is_empty());
    found
}
