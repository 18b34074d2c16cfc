//! The simulation from the first move to the last. In: the toolpath, the job. Out: the [`EngagementMap`].
//!
//! Moves are processed in batches. A feed move near the stock is sampled at its beginning, at its end, and between in equal steps of at most
//! `spacing`. Where the path continues smoothly from a sampled move, the beginning takes over the outcome at the end of that move. Between
//! these samples lie optional ones, so close that the nominations of two neighbours hold for any position between them.

use super::batch::{BatchResult, Operation, Swept, assign, run};
use super::beside_blank::mark_beside_blank;
use super::block_ends::Marker;
use super::cutter::Cutter;
use super::final_surface::mark_final_surface;
use super::hazards::{report, report_fixtures, report_rapids};
use super::map::{EngagementMap, StationFlags};
use super::nominate::{Need, Sample};
use super::options::{EngageError, Options};
use super::reused_stations::Again;
use super::sample_outcome::{Outcome, STRAIGHT_RAD, turn_rad};
use super::scene::Scene;
use super::stations::{Builder, Point};
use super::workpiece::{Earlier, cell_mm, pieces, shift, sources};
use crate::ids::MoveId;
use crate::machine::{Box3, Job, MOST_MM, Shape, Tool};
use crate::nc::{Move, MoveKind, Toolpath};
use crate::path::Vec3;
use crate::stock::{Blank, Element, Field, Form, Piece, Tiling, append_elements};

/// Most elements in a batch.
const BATCH: u32 = 8192;
/// Most cells that the elements of a batch may sweep: the overwritten values are stored for undoing.
const BATCH_CELLS: f64 = 4e6;
/// Cosine of the largest bend at which a path counts as smooth.
const SMOOTH: f64 = 0.996;
/// Spacing along a chain of short blocks, as a part of the radius of the cutter.
const JOINTS: f64 = 1.0 / 3.0;
/// Largest distance of optional samples, in cells: a nomination sees a cell and a half to either side of a ring, and the
/// neighbours of those cells.
const OPTIONAL_CELLS: f64 = 2.5;
/// Distance after the beginning of a move at which it is sampled, mm: exactly at the start, the end of the move before covers the whole
/// circle.
const JUST_AFTER_MM: f64 = 2e-3;

/// Simulates the whole toolpath; `progress` is called with the fraction done.
pub fn engage(
    path: &Toolpath,
    job: &Job,
    options: &Options,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<EngagementMap, EngageError> {
    engage_all(path, job, options, Asked::Everything, progress).map(|(map, _)| map)
}

/// As [`engage`], for a program of which the engagement of some moves is known: these keep their stations, and a tile is swept only as long
/// as it is still needed. Events and volumes are those of the earlier map.
pub fn engage_again(
    path: &Toolpath,
    job: &Job,
    options: &Options,
    again: Again,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<EngagementMap, EngageError> {
    let (map, _) = engage_all(path, job, options, Asked::AllBut(again), progress)?;
    let EngagementMap { initial_mm3, removed_mm3, remaining_mm3, .. } = *again.known;
    Ok(EngagementMap { events: again.known.events.clone(), initial_mm3, removed_mm3, remaining_mm3, ..map })
}

/// As [`engage`]; returns also the pieces of stock that the program leaves, in the common frame.
pub fn engage_and_keep(
    path: &Toolpath,
    job: &Job,
    options: &Options,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(EngagementMap, Vec<Piece>), EngageError> {
    engage_all(path, job, options, Asked::Everything, progress).map(|(map, left)| (map, left.pieces()))
}

/// The pieces of stock that the program leaves, in the common frame; no engagement is worked out.
pub fn left_stock(
    path: &Toolpath,
    job: &Job,
    options: &Options,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Vec<Piece>, EngageError> {
    engage_all(path, job, options, Asked::StockAlone, progress).map(|(_, left)| left.pieces())
}

/// What is asked of a simulation.
#[derive(Clone, Copy)]
enum Asked<'a> {
    /// The engagement of all moves.
    Everything,
    /// That of the moves whose engagement is not known.
    AllBut(Again<'a>),
    /// Only the stock that is left.
    StockAlone,
}

/// The result of a simulation.
struct Simulated {
    blanks: Vec<Blank>,
    fields: Vec<Field>,
    elements: Vec<Element>,
    cutters: Vec<Cutter>,
    earlier: Vec<Form>,
}

impl Simulated {
    fn pieces(self) -> Vec<Piece> {
        let Self { blanks, fields, elements, cutters, earlier } = self;
        let scene = Scene { elements: &elements, cutters: &cutters, earlier: &earlier, blanks: &[], fixtures: &[] };
        let piece = |(blank, field)| Piece::left(blank, field, &elements, |element| scene.form(element));
        blanks.into_iter().zip(fields).map(piece).collect()
    }
}

fn engage_all(
    path: &Toolpath,
    job: &Job,
    options: &Options,
    asked: Asked,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(EngagementMap, Simulated), EngageError> {
    within_reach(path)?;
    let mut notes = Vec::new();
    let used: Vec<&Tool> = numbers_used(path).into_iter().filter_map(|number| job.tool(number)).collect();
    let smallest = used.iter().map(|tool| tool.diameter_mm).fold(10.0, f64::min);
    let cutting: Vec<&Tool> = used.into_iter().filter(|tool| tool.shape != Shape::Probe).collect();
    let (stock, laid) = rayon::join(
        || -> Result<(f64, Vec<Piece>), EngageError> {
            let sources = sources(job, path, options, &mut notes)?;
            let cell = cell_mm(job, options, &sources, smallest)?;
            Ok((cell, pieces(sources, cell, &mut notes)?))
        },
        || PlacedElements::new(path, job, &cutting),
    );
    let (cell, pieces) = stock?;
    let cutters: Vec<Cutter> = cutting.iter().map(|tool| Cutter::new(tool, cell, options.ring_parts)).collect();
    let (earlier, blanks, mut fields) = Earlier::of(pieces, cutters.len());
    let again = match asked {
        Asked::AllBut(again) => Some(again).filter(|again| again.fits(&cutters)),
        Asked::Everything | Asked::StockAlone => None,
    };
    let stock_alone = matches!(asked, Asked::StockAlone);
    let plan = Plan::new(path, job, laid.after(earlier.elements), &fields, options).but_for(again, &cutters);
    let plan = Plan { stock_alone, ..plan };
    let elements = &plan.laid.elements;
    let scene =
        Scene { elements, cutters: &cutters, earlier: &earlier.forms, blanks: &blanks, fixtures: &job.fixtures };
    let whole = || cutters.iter().map(|cutter| (cutter.number, cutter.slices.clone())).collect();
    let slices = again.map_or_else(whole, |again| again.known.slices.clone());
    let mut builder = Builder::with_slices(slices, &cutters);
    builder.map.cell_mm = cell;
    builder.map.notes = notes;
    builder.map.initial_mm3 = fields.iter().map(Field::volume_mm3).sum();
    simulate(&plan, &scene, &mut fields, &mut builder, progress);
    let mut map = builder.map;
    map.remaining_mm3 = fields.iter().map(Field::volume_mm3).sum();
    map.removed_mm3 = map.initial_mm3 - map.remaining_mm3;
    let placed = |motion: &Move| {
        let radius_mm = job.tool(motion.tool).map_or(0.0, |tool| 0.5 * tool.diameter_mm);
        (plan.laid.shift(motion), radius_mm)
    };
    let extents: Vec<Box3> = plan.tilings.iter().map(|stock| stock.extent).collect();
    mark_beside_blank(&mut map, path, &extents, &placed);
    if again.is_none() && !stock_alone {
        mark_final_surface(&mut map, elements, &fields);
    }
    Ok((map, Simulated { blanks, fields, elements: plan.laid.elements, cutters, earlier: earlier.forms }))
}

/// Refuses moves that no mill can make, because time and memory of the simulation grow with the length of the path.
fn within_reach(path: &Toolpath) -> Result<(), EngageError> {
    let farthest = |motion: &Move| {
        let (low, high) = motion.curve().bounds();
        low.iter().chain(high.iter()).map(|x| if x.is_finite() { x.abs() } else { f64::INFINITY }).fold(0.0, f64::max)
    };
    let beyond = path.moves.iter().map(|motion| (motion.line, farthest(motion))).find(|(_, most)| *most > MOST_MM);
    beyond.map_or(Ok(()), |(line, most_mm)| Err(EngageError::TooFar { line, distance_m: most_mm / 1e3 }))
}

fn numbers_used(path: &Toolpath) -> Vec<u32> {
    let mut used: Vec<u32> = path.moves.iter().map(|motion| motion.tool).collect();
    used.sort_unstable();
    used.dedup();
    used
}

/// The toolpath as elements in the common frame.
struct PlacedElements {
    /// Those of earlier programs, then those of the moves.
    elements: Vec<Element>,
    /// First element of each move, and one past the last.
    first: Vec<u32>,
    /// Cutter of each move.
    cutter: Vec<Option<u16>>,
    shifts: Vec<(u16, Vec3)>,
}

impl PlacedElements {
    fn new(path: &Toolpath, job: &Job, cutting: &[&Tool]) -> Self {
        let mut wcs: Vec<u16> = path.moves.iter().map(|motion| motion.wcs).collect();
        wcs.sort_unstable();
        wcs.dedup();
        let mut laid = Self {
            elements: Vec::with_capacity(path.moves.len()),
            first: vec![0],
            cutter: Vec::with_capacity(path.moves.len()),
            shifts: wcs.iter().map(|number| (*number, shift(job, path, *number))).collect(),
        };
        laid.first.reserve(path.moves.len());
        for (index, motion) in path.moves.iter().enumerate() {
            let cutter = cutting.iter().position(|tool| tool.number == motion.tool).map(|k| k as u16);
            laid.cutter.push(cutter);
            if let Some(cutter) = cutter {
                let by = laid.shift(motion);
                append_elements(&mut laid.elements, &motion.curve(), by, MoveId(index as u32), cutter);
            }
            laid.first.push(laid.elements.len() as u32);
        }
        laid
    }
    /// The same after the elements of earlier programs.
    fn after(mut self, earlier: Vec<Element>) -> Self {
        self.first.iter_mut().for_each(|first| *first += earlier.len() as u32);
        self.elements.splice(0..0, earlier);
        self
    }
    fn shift(&self, motion: &Move) -> Vec3 {
        self.shifts.iter().find(|(number, _)| *number == motion.wcs).map_or_else(Vec3::zeros, |(_, by)| *by)
    }
}

/// The toolpath as the simulation takes it.
pub(super) struct Plan<'a> {
    /// The toolpath.
    pub path: &'a Toolpath,
    laid: PlacedElements,
    /// The pieces of stock: a move beyond all of them sweeps nothing.
    tilings: Vec<Tiling>,
    /// Keep-out boxes.
    pub fixtures: Vec<Box3>,
    spacing_mm: f64,
    /// Largest distance of optional samples, mm.
    optional_mm: f64,
    /// Area of a cell, mm².
    cell_mm2: f64,
    /// Clearance asked for beyond half the spacing, mm.
    clearance_mm: f64,
    /// Engagement that is known from an earlier simulation.
    again: Option<Again<'a>>,
    /// For each tile the element from which on it is no longer needed; empty if all are needed to the end.
    until: Vec<u32>,
    /// No engagement is asked for.
    stock_alone: bool,
}

impl<'a> Plan<'a> {
    fn new(path: &'a Toolpath, job: &Job, laid: PlacedElements, fields: &[Field], options: &Options) -> Self {
        let uncertainty = job.stocks.iter().map(|stock| stock.uncertainty_mm).fold(0.0, f64::max);
        let approach = job.air_feed.map_or(0.0, |air| air.approach_mm);
        let cell = fields.iter().map(|field| field.cell[0].min(field.cell[1])).fold(f64::INFINITY, f64::min);
        Self {
            path,
            laid,
            tilings: fields.iter().map(Field::tiling).collect(),
            fixtures: job.fixtures.clone(),
            spacing_mm: options.spacing_mm,
            optional_mm: OPTIONAL_CELLS * cell,
            cell_mm2: cell * cell,
            clearance_mm: uncertainty + approach,
            again: None,
            until: Vec::new(),
            stock_alone: false,
        }
    }
    /// The same plan, with the moves left out whose engagement is known.
    fn but_for(mut self, again: Option<Again<'a>>, cutters: &[Cutter]) -> Self {
        self.again = again;
        if again.is_none() {
            return self;
        }
        let mut until = vec![0; self.tilings.iter().map(Tiling::count).sum()];
        for (index, motion) in self.path.moves.iter().enumerate() {
            let Some(cutter) = self.laid.cutter[index].filter(|_| self.known(index).is_none()) else { continue };
            if motion.kind == MoveKind::Rapid {
                continue;
            }
            let (by, reach) = (self.laid.shift(motion), cutters[cutter as usize].asks_within(self.clearance()));
            let (low, high) = motion.curve().bounds();
            let [low, high] = [low + by, high + by];
            let mut first = 0;
            for tiling in &self.tilings {
                for tile in tiling.tiles_under([low.x - reach, low.y - reach], [high.x + reach, high.y + reach]) {
                    until[first + tile] = self.laid.first[index + 1];
                }
                first += tiling.count();
            }
        }
        self.until = until;
        self
    }
    /// The move of the known map that a move has its stations from.
    fn known(&self, index: usize) -> Option<MoveId> {
        self.again.and_then(|again| again.of_move[index])
    }
    /// Elements of a move.
    pub fn elements_of(&self, index: usize) -> std::ops::Range<u32> {
        self.laid.first[index]..self.laid.first[index + 1]
    }
    /// One past the last move of a batch that begins with this one.
    fn batch_end(&self, begin: usize, scene: &Scene) -> usize {
        let (mut end, mut cells) = (begin, 0.0);
        while end < self.path.moves.len()
            && cells < BATCH_CELLS
            && self.laid.first[end] < self.laid.first[begin] + BATCH
        {
            if let Some(cutter) = self.laid.cutter[end] {
                let width = 2.0 * scene.cutters[cutter as usize].form.radius;
                cells += width * (width + self.path.moves[end].curve().length()) / self.cell_mm2;
            }
            end += 1;
        }
        end
    }
    fn clearance(&self) -> f64 {
        self.clearance_mm + 0.5 * self.spacing_mm
    }
    /// Is anything of the stock or the fixtures within reach of the move?
    fn is_far(&self, motion: &Move, cutter: &Cutter) -> bool {
        let (low, high) = motion.curve().bounds();
        let by = self.laid.shift(motion);
        let away = |body: &Box3| {
            let deep = low.z + by.z + cutter.lowest_body() < body.max.z;
            let reach = (cutter.form.radius + self.clearance_mm).max(if deep { cutter.widest_body() } else { 0.0 });
            low.z + by.z - self.clearance_mm >= body.max.z
                || (0..2).any(|axis| {
                    low[axis] + by[axis] - reach > body.max[axis] || high[axis] + by[axis] + reach < body.min[axis]
                })
        };
        self.tilings.iter().all(|stock| away(&stock.extent)) && self.fixtures.iter().all(away)
    }
}

/// How a move of the batch gets its stations.
enum StationSource {
    /// None: a rapid, or no engagement is asked for.
    None,
    /// Those of a move of the known map.
    Known(MoveId),
    /// One without engagement.
    Idle(StationFlags),
    /// From its samples (range in the batch); the first one is the end of the move before where `inherits`.
    Sampled { samples: std::ops::Range<usize>, inherits: bool },
}

/// Moves worked together.
struct Batch {
    moves: std::ops::Range<usize>,
    samples: Vec<Sample>,
    ways: Vec<StationSource>,
    /// What the tiles do.
    operations: Vec<Vec<Operation>>,
}

/// State of the sampling between moves.
struct Sampling {
    /// Last horizontal direction of the path.
    heading: [f64; 2],
    /// The move before was sampled: its last sample stands where this one begins.
    goes_on: bool,
    marker: Marker,
}

/// Processes all batches. While the tiles of one batch are swept, the arcs of the batch before are worked out and entered into the map, and
/// the next batch is sampled.
fn simulate(plan: &Plan, scene: &Scene, fields: &mut [Field], builder: &mut Builder, progress: &(dyn Fn(f64) + Sync)) {
    let mut held = Outcome::default();
    let mut state = Sampling { heading: [1.0, 0.0], goes_on: false, marker: Marker::default() };
    let mut next = prepare(plan, scene, 0, &mut state);
    let mut done: Option<(Batch, Swept)> = None;
    let rapid = |element: u32| {
        let motion = || &plan.path.moves[scene.elements[element as usize].move_id.ix()];
        plan.again.is_none() && motion().kind == MoveKind::Rapid
    };
    while let Some(batch) = next.take() {
        let fields = &mut *fields;
        let (swept, prepared) = rayon::join(
            || run(scene, fields, &batch.operations, &batch.samples, rapid),
            || {
                if let Some((batch, swept)) = done.take() {
                    enter_batch(plan, scene, &batch, swept, &mut held, builder);
                }
                prepare(plan, scene, batch.moves.end, &mut state)
            },
        );
        progress(batch.moves.end as f64 / plan.path.moves.len() as f64);
        (next, done) = (prepared, Some((batch, swept)));
    }
    if let Some((batch, swept)) = done {
        enter_batch(plan, scene, &batch, swept, &mut held, builder);
    }
}

/// Samples the moves of the batch that begins with this one; `None` after the last.
fn prepare(plan: &Plan, scene: &Scene, begin: usize, state: &mut Sampling) -> Option<Batch> {
    let moves = begin..plan.batch_end(begin, scene);
    let mut samples = Vec::new();
    let ways: Vec<StationSource> =
        moves.clone().map(|index| sample_move(plan, scene, index, state, &mut samples)).collect();
    mark_joints(plan, scene, begin, &ways, &mut samples, &mut state.marker);
    let elements = plan.laid.first[moves.start]..plan.laid.first[moves.end];
    let operations = assign(scene, &plan.tilings, elements, &samples, &plan.until);
    (!moves.is_empty()).then_some(Batch { moves, samples, ways, operations })
}

fn enter_batch(plan: &Plan, scene: &Scene, batch: &Batch, swept: Swept, held: &mut Outcome, builder: &mut Builder) {
    let locate = |like: &Sample, s_mm: f64| {
        let element = &scene.elements[like.element as usize];
        sample_at(plan, element.move_id.ix(), s_mm, like.dir, like.cutter)
    };
    let result = swept.finish(scene, &batch.samples, &locate);
    report_rapids(scene, &result, &mut builder.map);
    report_fixtures(&plan.fixtures, |index| plan.elements_of(index), scene, batch.moves.clone(), &mut builder.map);
    let idle = [false, true].map(|clear| Outcome { clear, ..Outcome::default() });
    let mut last = &*held;
    for (index, way) in batch.moves.clone().zip(&batch.ways) {
        last = match way {
            StationSource::None => {
                builder.push_none(MoveId(index as u32));
                &idle[0]
            }
            StationSource::Known(of) => {
                if let Some(again) = plan.again {
                    builder.push_known(MoveId(index as u32), again.known, Some(*of));
                }
                &idle[0]
            }
            StationSource::Idle(flags) => {
                builder.push_idle(MoveId(index as u32), plan.path.moves[index].curve().length(), *flags);
                &idle[usize::from(flags.clear_air)]
            }
            StationSource::Sampled { samples, inherits } => {
                let bend = if *inherits { bend(plan, index) } else { 0.0 };
                let seen = (bend.abs() > STRAIGHT_RAD).then(|| {
                    let sample = &batch.samples[samples.start];
                    last.beyond_bend(bend, &scene.cutters[sample.cutter as usize], sample.tangent)
                });
                let begin = seen.as_ref().unwrap_or(last);
                let mut points: Vec<Point> = Vec::with_capacity(samples.len() + 1);
                points.extend(inherits.then_some(Point { s_mm: 0.0, outcome: begin, before: None }));
                points.extend(points_of(&batch.samples, &result, samples.clone()));
                enter(
                    plan,
                    scene,
                    index,
                    (&batch.samples[samples.clone()], &result.outcomes[samples.clone()]),
                    &points,
                    builder,
                );
                &result.outcomes[samples.end - 1]
            }
        };
    }
    *held = last.clone();
}

/// Marks the ends of short blocks that run on as joints.
fn mark_joints(
    plan: &Plan,
    scene: &Scene,
    begin: usize,
    ways: &[StationSource],
    samples: &mut [Sample],
    marker: &mut Marker,
) {
    marker.stop();
    for (k, way) in ways.iter().enumerate() {
        let length = |k: usize| plan.path.moves[begin + k].curve().length();
        let StationSource::Sampled { samples: range, inherits } = way else {
            marker.stop();
            continue;
        };
        let next =
            matches!(ways.get(k + 1), Some(StationSource::Sampled { inherits: true, .. })).then(|| length(k + 1));
        let radius = scene.cutters[samples[range.start].cutter as usize].form.radius;
        marker.take(&mut samples[range.clone()], *inherits, length(k), next, plan.spacing_mm.min(JOINTS * radius));
    }
}

fn sample_move(
    plan: &Plan,
    scene: &Scene,
    index: usize,
    state: &mut Sampling,
    samples: &mut Vec<Sample>,
) -> StationSource {
    let motion = &plan.path.moves[index];
    let length = motion.curve().length();
    let at_end = motion.curve().tangent(length);
    let before = state.heading;
    turn(&mut state.heading, at_end);
    let goes_on = std::mem::take(&mut state.goes_on);
    if motion.kind == MoveKind::Rapid || plan.stock_alone {
        return StationSource::None;
    }
    if let Some(of) = plan.known(index) {
        return StationSource::Known(of);
    }
    let Some(cutter) = plan.laid.cutter[index] else {
        return StationSource::Idle(StationFlags { uncertain: true, ..StationFlags::default() });
    };
    if length <= 0.0 || plan.is_far(motion, &scene.cutters[cutter as usize]) {
        return StationSource::Idle(StationFlags { clear_air: length > 0.0, ..StationFlags::default() });
    }
    let inherits = goes_on && runs_on(plan, index);
    state.goes_on = true;
    let first = samples.len();
    let count = (length / plan.spacing_mm - 1e-9).ceil().max(1.0) as usize;
    let parts = (length / count as f64 / plan.optional_mm - 1e-9).ceil().max(1.0) as usize;
    let mut dir = before;
    for k in usize::from(inherits)..=count * parts {
        let need = if k % parts == 0 { Need::Always } else { Need::Change };
        let s_mm = if k == count * parts { length } else { length * k as f64 / (count * parts) as f64 };
        let sample = sample_at(plan, index, s_mm, dir, cutter);
        dir = sample.dir;
        samples.push(Sample { need, ..sample });
    }
    StationSource::Sampled { samples: first..samples.len(), inherits }
}

/// The cutter at a place of a move; `dir` is kept under a vertical feed.
fn sample_at(plan: &Plan, index: usize, s_mm: f64, dir: [f64; 2], cutter: u16) -> Sample {
    let motion = &plan.path.moves[index];
    let curve = motion.curve();
    let at = if s_mm > 0.0 { s_mm } else { JUST_AFTER_MM.min(0.5 * curve.length()) };
    let elements = plan.elements_of(index);
    let of_move = &plan.laid.elements[elements.start as usize..elements.end as usize];
    let element = of_move.partition_point(|element| element.from_mm <= s_mm - JUST_AFTER_MM).max(1) as u32 - 1;
    let tangent = curve.tangent(at);
    let mut dir = dir;
    turn(&mut dir, tangent);
    Sample {
        element: elements.start + element,
        along_mm: at - of_move[element as usize].from_mm,
        s_mm,
        tip: curve.point(at) + plan.laid.shift(motion),
        dir,
        tangent: [tangent.x.hypot(tangent.y), tangent.z],
        cutter,
        clearance_mm: plan.clearance(),
        need: Need::Always,
    }
}

/// Sets `heading` to the horizontal direction of a tangent; a vertical tangent leaves it.
fn turn(heading: &mut [f64; 2], tangent: Vec3) {
    let across = tangent.x.hypot(tangent.y);
    if across > 1e-6 {
        *heading = [tangent.x / across, tangent.y / across];
    }
}

/// True when the move continues the one before without a bend, with the same tool.
fn runs_on(plan: &Plan, index: usize) -> bool {
    if index == 0 {
        return false;
    }
    let (a, b) = (&plan.path.moves[index - 1], &plan.path.moves[index]);
    let smooth = a.curve().tangent(a.curve().length()).dot(&b.curve().tangent(0.0)) >= SMOOTH;
    let joined = (a.curve().to() - b.curve().from()).norm() < 1e-6;
    a.kind == MoveKind::Feed && a.tool == b.tool && a.wcs == b.wcs && smooth && joined
}

/// Angle by which the path turns in the plane at the beginning of a move, rad.
fn bend(plan: &Plan, index: usize) -> f64 {
    let curve = plan.path.moves[index - 1].curve();
    let [before, after] = [curve.tangent(curve.length()), plan.path.moves[index].curve().tangent(0.0)];
    let level = |v: &Vec3| v.x.hypot(v.y) > 1e-6;
    if level(&before) && level(&after) { turn_rad([before.x, before.y], [after.x, after.y]) } else { 0.0 }
}

/// The sampled points of a move but for optional ones.
fn points_of<'a>(
    samples: &'a [Sample],
    result: &'a BatchResult,
    range: std::ops::Range<usize>,
) -> impl Iterator<Item = Point<'a>> {
    range.filter(|k| samples[*k].need != Need::Change).map(|k| Point {
        s_mm: samples[k].s_mm,
        outcome: &result.outcomes[k],
        before: result.between[k].as_ref(),
    })
}

/// Enters a move into the map, from its samples and their outcomes.
fn enter(
    plan: &Plan,
    scene: &Scene,
    index: usize,
    (samples, outcomes): (&[Sample], &[Outcome]),
    points: &[Point],
    builder: &mut Builder,
) {
    let id = MoveId(index as u32);
    let cutter = samples[0].cutter;
    let tool = &scene.cutters[cutter as usize];
    let uncertain = points.iter().any(|point| point.outcome.undercut);
    report(&mut builder.map, id, &plan.path.moves[index], tool, samples, outcomes);
    builder.push_move(id, cutter, tool, points, uncertain);
}
