//! Check of the written program by the ordinary simulation. In: its text, the job, the stock on the surface. Out:
//! times, the largest forces, the share of the contact length with a force near the reference.
//!
//! The text is read, interpreted and simulated like any other program, in a height field of the stock. Of the plan only
//! the pass of each motion is used. A station has every arc that is engaged anywhere along it, and the force of a layer
//! model may grow or fall with the arcs that are added: over 0.87 mm of a saddle it came to 9.4 N where it is 5.5 N at
//! most. So stations here are no longer than a cell of the stock.

use super::drop::Dropper;
use super::path::Step;
use super::plan::StepLimit;
use super::shape::Shape;
use super::surface::Surface;
use crate::engage::{self, EngageError, EngagementMap, Station};
use crate::force::LoadLine;
use crate::ids::MoveId;
use crate::machine::{Box3, Job, StockShape};
use crate::nc::{self, Dialect, Environment, Move, MoveKind, Program, Toolpath};
use crate::path::{Curve, Vec3};
use crate::schedule::cutters::Cutters;
use crate::schedule::{FeedPiece, as_programmed, realise};
use crate::stock::{Blank, Piece, Relief, saved};
use rayon::prelude::*;
use std::path::Path;

/// Result of the check.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Check {
    /// Time of the program, s.
    pub time_s: f64,
    /// Time of its feed motions, s.
    pub feed_s: f64,
    /// Length of cutting on passes, mm.
    pub contact_mm: f64,
    /// Part of it on which the force bounds the step-over, mm.
    pub bound_mm: f64,
    /// Share of that part on which the force is within 10 % of the reference.
    pub within_10_percent: f64,
    /// Mean force over the reference on that part, weighted by length.
    pub mean_ratio: f64,
    /// Largest force on passes, N, and its line.
    pub largest_n: (f64, u32),
    /// Force that is not exceeded on 99 % of the contact length, N.
    pub p99_n: f64,
    /// Length of cutting, leads and links included, with a force above the reference (see [`HELD`]), mm.
    pub beyond_mm: f64,
    /// Largest force on leads and links, N, and its line.
    pub links_n: (f64, u32),
    /// For every pass 0 (not used) and the largest force, N.
    pub by_pass: Vec<[f64; 2]>,
    /// Collisions, cutting at rapid and the like, one sentence each.
    pub events: Vec<String>,
    /// Diagnostics of reading, one sentence each.
    pub doubts: Vec<String>,
}

/// Cells of the stock, mm; finer ones are not needed, as engaged arcs are exact.
const CELL_MM: f64 = 0.1;
/// Most cells along the longer side.
const CELLS: f64 = 1500.0;
/// A force counts as held up to this ratio of the reference, as every limit does in the check of a written program.
pub const HELD: f64 = 1.01;
/// Depth of the bottom of the stock below the lowest point of the surface, mm.
const BELOW_MM: f64 = 5.0;

/// Stock of constant thickness along the normal: the centre of a ball of that radius resting on the surface lies on the
/// parallel surface.
pub fn stock(surface: &Surface, thickness_mm: f64) -> Piece {
    let extent = Box3 {
        min: Vec3::new(surface.extent.min.x, surface.extent.min.y, surface.extent.min.z - BELOW_MM),
        max: Vec3::new(surface.extent.max.x, surface.extent.max.y, surface.extent.max.z + thickness_mm),
    };
    let side = (extent.max - extent.min).xy().amax();
    let cell = CELL_MM.max(side / CELLS);
    let size = [0, 1].map(|axis| (((extent.max[axis] - extent.min[axis]) / cell).ceil() as usize).max(1));
    let middle = |axis: usize, k: usize| {
        extent.min[axis] + (k as f64 + 0.5) * (extent.max[axis] - extent.min[axis]) / size[axis] as f64
    };
    let place = |k: usize| [middle(0, k % size[0]), middle(1, k / size[0])];
    let tops = on_surface_mm(surface, thickness_mm, size[0] * size[1], &place);
    let heights = tops.into_iter().map(|top_mm| top_mm.unwrap_or(extent.min.z) as f32).collect();
    Piece::uncut(Blank::Heights(Box::new(Relief::from_rows(extent, size, heights))), cell)
}

/// Top of stock of this thickness on the surface at `count` places, mm; `None` where the surface has no stock.
pub fn on_surface_mm(
    surface: &Surface,
    thickness_mm: f64,
    count: usize,
    place: &(dyn Fn(usize) -> [f64; 2] + Sync),
) -> Vec<Option<f64>> {
    let ball = Dropper::new(surface, Shape::ball(thickness_mm.max(1e-3)));
    let top = |k: usize| ball.drop(place(k)).map(|contact| contact.tip_mm + thickness_mm);
    (0..count).into_par_iter().with_min_len(256).map(top).collect()
}

/// Distance within which an end of a motion is that of a step, mm: coordinates are written to 0.001 mm or 0.0001 in and
/// so are off by at most 0.0013 mm.
const SAME_MM: f64 = 0.002;
/// Name of the saved stock.
const NAME: &str = "stock above the surface";

/// The job with a saved stock instead of its own, to be supplied by a loader.
pub fn with_saved_stock(job: &Job) -> Job {
    let mut job = job.clone();
    job.stocks.truncate(1);
    for stock in &mut job.stocks {
        stock.shape = StockShape::Saved(NAME.into());
        stock.offset = None;
        stock.moved_mm = Vec3::zeros();
    }
    job
}

/// Pass and bound of each motion of a text. A step may be several motions; the last of these ends at the end of the
/// step.
fn parts(toolpath: &Toolpath, steps: &[Step]) -> Vec<Option<(u32, StepLimit)>> {
    let (mut parts, mut k) = (Vec::with_capacity(toolpath.moves.len()), 0);
    for motion in &toolpath.moves {
        parts.push(steps.get(k).and_then(|step| step.of));
        let end = motion.curve().to();
        // A step without length makes no motion in the text.
        while steps.get(k).is_some_and(|step| (end - step.to).amax() < SAME_MM) {
            k += 1;
        }
    }
    parts
}

/// A text as it is read back; `top_mm`: top of the stock, above which the tool is at first.
fn read(text: &str, dialect: Dialect, job: &Job, top_mm: f64) -> (Program, Toolpath) {
    let program = nc::parse(text.as_bytes().to_vec(), Some(dialect));
    let mut environment = Environment::from_job(job);
    environment.clear_z_mm += top_mm.max(0.0);
    let toolpath = nc::interpret(&program, &nc::unit::with_its_unit(&program, environment, Some(job)));
    (program, toolpath)
}

/// The motions on passes of a text as they are read back, in order; `steps`: the motions it was written from.
pub fn passes_of(text: &str, dialect: Dialect, job: &Job, steps: &[Step]) -> Vec<Curve> {
    let (_, toolpath) = read(text, dialect, &with_saved_stock(job), 0.0);
    let parts = parts(&toolpath, steps);
    let on_pass = toolpath.moves.iter().zip(&parts);
    let on_pass = on_pass.filter(|(motion, part)| part.is_some() && motion.kind == MoveKind::Feed);
    on_pass.map(|(motion, _)| motion.curve()).collect()
}

/// A written program, read back and simulated in the stock on the surface.
pub struct Simulated {
    /// The program.
    pub program: Program,
    /// Its motions.
    pub toolpath: Toolpath,
    /// The job, with that stock.
    pub job: Job,
    /// Its engagement.
    pub map: EngagementMap,
}

impl Simulated {
    /// Reads and simulates a text; `piece`: the stock.
    pub fn new(text: &str, dialect: Dialect, job: &Job, piece: &Piece) -> Result<Self, EngageError> {
        let job = with_saved_stock(job);
        let (program, toolpath) = read(text, dialect, &job, piece.field.extent.max.z);
        let bytes = saved::to_bytes(piece, Vec3::zeros());
        let load = |_: &Path| Ok(bytes.clone());
        let cell_mm = piece.field.cell[0].max(piece.field.cell[1]);
        let options = engage::Options {
            spacing_mm: cell_mm,
            cell_mm: Some(cell_mm),
            loader: Some(&load),
            ..engage::Options::default()
        };
        let map = engage::engage(&toolpath, &job, &options, &|_| {})?;
        Ok(Self { program, toolpath, job, map })
    }

    /// Every station that cuts, with its loads as functions of the feed, as tools are worn at these feeds; `None`: the
    /// loads are not known.
    pub fn cuts(&self, feeds: &[FeedPiece]) -> Vec<(&Station, Option<LoadLine>)> {
        let cutters = Cutters::new(&self.toolpath, &self.map, &self.job, feeds);
        let line = |station: &Station| {
            let cut = cutters.cut(&self.map, &self.toolpath.moves[station.move_id.ix()], station);
            Some(cutters.of(station.move_id)?.line(&cut))
        };
        let cutting: Vec<&Station> = self.map.stations.iter().filter(|station| station.arc_count > 0).collect();
        cutting.into_par_iter().map(|station| (station, line(station))).collect()
    }
}

/// Times of a toolpath at the feeds it has.
fn times(toolpath: &Toolpath, job: &Job) -> Check {
    let realised = realise(toolpath, &as_programmed(toolpath), &job.machine);
    let fed = toolpath.moves.iter().zip(&realised.move_s).filter(|(m, _)| m.kind == MoveKind::Feed);
    Check { time_s: realised.total_s, feed_s: fed.map(|(_, s)| s).sum(), ..Check::default() }
}

/// For each motion on a pass the way from the begin of its stretch to the begin of the motion, and from there to the end of the stretch, mm.
fn from_ends(toolpath: &Toolpath, parts: &[Option<(u32, StepLimit)>]) -> Vec<Option<[f64; 2]>> {
    let of = |k: &usize| parts[*k].filter(|_| toolpath.moves[*k].kind == MoveKind::Feed).map(|(pass, _)| pass);
    let motions: Vec<usize> = (0..parts.len()).collect();
    let stretches = motions.chunk_by(|a, b| of(a).is_some() && of(a) == of(b));
    let ends = stretches.flat_map(|stretch| {
        let lengths: Vec<f64> = stretch.iter().map(|k| toolpath.moves[*k].curve().length()).collect();
        let whole: f64 = lengths.iter().sum();
        let begins = lengths.iter().scan(0.0, |sum, length| Some(std::mem::replace(sum, *sum + length)));
        let on_pass = stretch.first().is_some_and(|k| of(k).is_some());
        begins.map(move |begin| on_pass.then_some([begin, whole - begin])).collect::<Vec<_>>()
    });
    ends.collect()
}

/// Spacing of places on a motion at which it is compared with the surface, over the radius of the tool; a bump that is missed between two is
/// lower than an eighth of its square times the radius: 1 µm for a tool of 6 mm.
const COMPARED: f64 = 0.05;

/// Motions that cut deeper than `within_mm` into a surface, one sentence each. A tool whose corner is smaller by that must not touch the surface
/// with its centre on the path.
fn gouges(toolpath: &Toolpath, (surface, shape, within_mm): (&Surface, Shape, f64)) -> Vec<String> {
    let within_mm = within_mm.min(0.5 * shape.corner_mm);
    let smaller = Shape { corner_mm: shape.corner_mm - within_mm, ..shape };
    let dropper = Dropper::new(surface, smaller);
    let highest_mm = toolpath.moves.iter().map(|motion| motion.curve().to().z).fold(f64::NEG_INFINITY, f64::max);
    // The first motion begins where the tool happens to be.
    let is_off = |motion: &&Move| motion.curve().to().z < highest_mm;
    let motions: Vec<&Move> = toolpath.moves.iter().skip_while(is_off).skip(1).collect();
    let deepest_mm = |motion: &&Move| {
        let curve = motion.curve();
        let parts = (curve.length() / (COMPARED * shape.radius_mm())).ceil().max(1.0) as usize;
        let deep = |k: usize| {
            let tip = curve.point(curve.length() * k as f64 / parts as f64);
            dropper.drop([tip.x, tip.y]).map_or(f64::NEG_INFINITY, |contact| contact.tip_mm - tip.z - within_mm)
        };
        (0..=parts).map(deep).fold(f64::NEG_INFINITY, f64::max)
    };
    let deepest: Vec<f64> = motions.par_iter().map(deepest_mm).collect();
    let gouging = motions.iter().zip(deepest).filter(|(_, deep_mm)| *deep_mm > 0.0);
    let said = |(motion, deep_mm): (&&Move, f64)| {
        format!(
            "line {}: the tool cuts deeper into the surface than {within_mm:.4} mm: it would have to be {:.4} mm higher",
            motion.line,
            deep_mm + within_mm
        )
    };
    gouging.map(said).collect()
}

/// Simulates a program; `steps`: the motions it was written from; `piece`: the stock; `reach_mm`: how far ahead of its tip the tool meets
/// stock. So near the ends of a pass it does not meet all of it, and the force is no measure of the step-over. `finished`: the surface, the tool,
/// and how deep its motions may cut into it, mm.
pub fn check(
    text: &str,
    dialect: Dialect,
    job: &Job,
    piece: &Piece,
    (steps, reach_mm): (&[Step], f64),
    reference_n: f64,
    finished: (&Surface, Shape, f64),
) -> Result<Check, EngageError> {
    let simulated = Simulated::new(text, dialect, job, piece)?;
    let Simulated { toolpath, map, job, .. } = &simulated;
    let parts = parts(toolpath, steps);
    let ends = from_ends(toolpath, &parts);
    let mut found = times(toolpath, job);
    let cuts = simulated.cuts(&as_programmed(toolpath));
    let force = |(station, line): &(&Station, Option<LoadLine>)| {
        let feed_mm_s = toolpath.moves[station.move_id.ix()].feed.mm_s;
        line.as_ref().map_or(0.0, |line| line.loads(feed_mm_s).force_xy_peak_n)
    };
    let forces: Vec<f64> = cuts.par_iter().map(force).collect();
    let (mut near, mut sum, mut all) = (0.0, 0.0, Vec::new());
    for ((station, _), force) in cuts.iter().zip(forces) {
        let line = toolpath.moves[station.move_id.ix()].line;
        let part = parts[station.move_id.ix()];
        let length = station.length_mm();
        found.beyond_mm += if force > HELD * reference_n { length } else { 0.0 };
        let Some((pass, limit)) = part else {
            if force > found.links_n.0 {
                found.links_n = (force, line);
            }
            continue;
        };
        found.contact_mm += length;
        all.push((force, length));
        if force > found.largest_n.0 {
            found.largest_n = (force, line);
        }
        let pass = pass as usize;
        if found.by_pass.len() <= pass {
            found.by_pass.resize(pass + 1, [0.0; 2]);
        }
        found.by_pass[pass][1] = found.by_pass[pass][1].max(force);
        let length = ends[station.move_id.ix()].map_or(length, |[from_begin, to_end]| {
            let from = station.from_mm.max(reach_mm - from_begin);
            (station.to_mm.min(to_end - reach_mm) - from).max(0.0)
        });
        if limit == StepLimit::Force {
            found.bound_mm += length;
            sum += force * length;
            near += if (force / reference_n - 1.0).abs() <= 0.1 { length } else { 0.0 };
        }
    }
    let of = |sum: f64| if found.bound_mm > 0.0 { sum / found.bound_mm } else { 0.0 };
    (found.within_10_percent, found.mean_ratio) = (of(near), of(sum) / reference_n);
    found.p99_n = below(&mut all, 0.99);
    let line_of = |id: MoveId| toolpath.moves[id.ix()].line;
    found.events = map
        .events
        .iter()
        .map(|event| format!("line {}: {:?} {}", line_of(event.move_id), event.kind, event.detail))
        .chain(gouges(toolpath, finished))
        .collect();
    found.doubts = toolpath.diagnostics.iter().map(|diagnostic| diagnostic.text.clone()).collect();
    Ok(found)
}

/// The force that is not exceeded on a share of the length.
fn below(all: &mut [(f64, f64)], share: f64) -> f64 {
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole: f64 = all.iter().map(|(_, length)| length).sum();
    let mut sum = 0.0;
    for (force, length) in all.iter() {
        sum += length;
        if sum >= share * whole {
            return *force;
        }
    }
    all.last().map_or(0.0, |(force, _)| *force)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of 1 mm along X, the second without length; the text has the third in two pieces. A difference of 0.0013
    /// mm is rounding, one of 0.0021 mm is not.
    #[test]
    fn motions_belong_to_the_step_that_they_lie_on() {
        let step = |x: f64, pass: u32| Step {
            to: Vec3::new(x, 0.0, 0.0),
            via: None,
            feed_mm_s: Some(10.0),
            of: Some((pass, StepLimit::Force)),
        };
        let steps = [step(1.0, 1), step(1.0, 2), step(2.0, 3), step(3.0, 4)];
        let of = |text: &str| {
            let program = nc::parse(format!("G21 G90 G94 F600\nG1 {text}\n").into_bytes(), Some(Dialect::LinuxCnc));
            let toolpath = nc::interpret(&program, &Environment::default());
            parts(&toolpath, &steps).into_iter().map(|part| part.map_or(0, |(pass, _)| pass)).collect::<Vec<_>>()
        };
        assert_eq!(of("X1.0013\nX1.5\nX2\nX3"), [1, 3, 3, 4]);
        assert_eq!(of("X1.0021\nX1.5\nX2\nX3"), [1, 1, 1, 1]);
    }
}
