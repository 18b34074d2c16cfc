//! The toolpath as the simulation takes it. In: its moves, the stock. Out: their elements in the common frame; which moves are known from an
//! earlier simulation, and from where on a tile is no longer needed; which moves make a batch.

use super::cutter::Cutter;
use super::options::Options;
use super::reused_stations::Again;
use super::scene::Scene;
use super::workpiece::shift;
use crate::ids::MoveId;
use crate::machine::{Box3, Job, Tool};
use crate::nc::{Move, MoveKind, Toolpath};
use crate::path::Vec3;
use crate::stock::{Element, Field, Tiling, append_elements};

/// Most elements in a batch.
const BATCH: u32 = 8192;
/// Most cells that the elements of a batch may sweep: the overwritten values are stored for undoing.
const BATCH_CELLS: f64 = 4e6;
/// Largest distance of optional samples, in cells: a nomination sees a cell and a half to either side of a ring, and the
/// neighbours of those cells.
const OPTIONAL_CELLS: f64 = 2.5;

/// The toolpath as elements in the common frame.
pub(super) struct PlacedElements {
    /// Those of earlier programs, then those of the moves.
    pub elements: Vec<Element>,
    /// First element of each move, and one past the last.
    pub first: Vec<u32>,
    /// Cutter of each move.
    pub cutter: Vec<Option<u16>>,
    shifts: Vec<(u16, Vec3)>,
}

/// A rapid of a cycle with the spindle stopped: G76 and G87 turn the one edge of a boring bar off the wall and step it aside before they go out.
/// The simulation knows cutters that are round: it would sweep stock away where the bar has no edge.
fn is_turned_off(motion: &Move) -> bool {
    motion.cycle && motion.kind == MoveKind::Rapid && motion.spin.rps == 0.0
}

impl PlacedElements {
    pub fn new(path: &Toolpath, job: &Job, cutting: &[&Tool]) -> Self {
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
            let cutter = cutter.filter(|_| !is_turned_off(motion));
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
    pub fn after(mut self, earlier: Vec<Element>) -> Self {
        self.first.iter_mut().for_each(|first| *first += earlier.len() as u32);
        self.elements.splice(0..0, earlier);
        self
    }
    pub fn shift(&self, motion: &Move) -> Vec3 {
        self.shifts.iter().find(|(number, _)| *number == motion.wcs).map_or_else(Vec3::zeros, |(_, by)| *by)
    }
}

/// The toolpath as the simulation takes it.
pub(super) struct Plan<'a> {
    /// The toolpath.
    pub path: &'a Toolpath,
    pub laid: PlacedElements,
    /// The pieces of stock: a move beyond all of them sweeps nothing.
    pub tilings: Vec<Tiling>,
    /// Keep-out boxes.
    pub fixtures: Vec<Box3>,
    pub spacing_mm: f64,
    /// Largest distance of optional samples, mm.
    pub optional_mm: f64,
    /// Area of a cell, mm².
    cell_mm2: f64,
    /// Clearance asked for beyond half the spacing, mm.
    clearance_mm: f64,
    /// Engagement that is known from an earlier simulation.
    pub again: Option<Again<'a>>,
    /// For each tile the element from which on it is no longer needed; empty if all are needed to the end.
    pub until: Vec<u32>,
    /// No engagement is asked for.
    pub stock_alone: bool,
}

impl<'a> Plan<'a> {
    pub fn new(path: &'a Toolpath, job: &Job, laid: PlacedElements, fields: &[Field], options: &Options) -> Self {
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
    pub fn but_for(mut self, again: Option<Again<'a>>, cutters: &[Cutter]) -> Self {
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
    pub fn known(&self, index: usize) -> Option<MoveId> {
        self.again.and_then(|again| again.of_move[index])
    }
    /// Elements of a move.
    pub fn elements_of(&self, index: usize) -> std::ops::Range<u32> {
        self.laid.first[index]..self.laid.first[index + 1]
    }
    /// One past the last move of a batch that begins with this one.
    pub fn batch_end(&self, begin: usize, scene: &Scene) -> usize {
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
    pub fn clearance(&self) -> f64 {
        self.clearance_mm + 0.5 * self.spacing_mm
    }
    /// Is anything of the stock or the fixtures within reach of the move?
    pub fn is_far(&self, motion: &Move, cutter: &Cutter) -> bool {
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
