//! The simulation from the first move to the last. In: the toolpath, the job. Out: the [`EngagementMap`].

use super::beside_blank::mark_beside_blank;
use super::cutter::Cutter;
use super::final_surface::mark_final_surface;
use super::in_batches::simulate;
use super::map::EngagementMap;
use super::options::{EngageError, Options};
use super::plan::{PlacedElements, Plan};
use super::retraced::Retraced;
use super::reused_stations::Again;
use super::scene::{Scene, form_of};
use super::stations::Builder;
use super::workpiece::{Earlier, cell_mm, pieces, sources};
use crate::machine::{Box3, Job, MOST_MM, Shape, Tool};
use crate::nc::{Move, Toolpath};
use crate::stock::{Blank, Element, Field, Form, Piece};

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
        let retraced = Retraced::default();
        let scene = Scene {
            elements: &elements,
            cutters: &cutters,
            earlier: &earlier,
            blanks: &[],
            fixtures: &[],
            retraced: &retraced,
        };
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
    let mut plan = Plan::new(path, job, laid.after(earlier.elements), &fields, options).but_for(again, &cutters);
    plan.stock_alone = stock_alone;
    let elements = &plan.laid.elements;
    let extents: Vec<Box3> = plan.tilings.iter().map(|stock| stock.extent).collect();
    let retraced = Retraced::new(elements, |element| form_of(element, &cutters, &earlier.forms).radius, &extents, cell);
    let scene = Scene {
        elements,
        cutters: &cutters,
        earlier: &earlier.forms,
        blanks: &blanks,
        fixtures: &job.fixtures,
        retraced: &retraced,
    };
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
