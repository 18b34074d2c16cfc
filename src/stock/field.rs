//! Height field with provenance: per cell the height of the stock and the element that last lowered it. In: the extent and
//! initial heights. Out: tiles that are swept independently of each other, volumes.
//!
//! Cells tile the extent exactly (their sides may be a little shorter than asked for). A tile holds its core cells and a
//! halo of one cell around them, swept twice, so that a 3 × 3 neighbourhood never needs another tile.

use super::past::Past;
use crate::machine::Box3;
use rayon::prelude::*;

/// Provenance of a cell nothing has lowered yet.
pub const UNTOUCHED: u32 = u32::MAX;

/// Cells along the side of a block.
pub const BLOCK: usize = 16;
/// Core cells along the side of a tile.
const TILE: usize = 192;

/// One tile of the field, halo included.
#[derive(Debug, Clone)]
pub struct Tile {
    /// Middle of cell (0, 0) in XY, mm.
    pub first: [f64; 2],
    /// Sides of a cell, mm.
    pub cell: [f64; 2],
    /// Cells along X and Y.
    pub size: [usize; 2],
    /// First core cell along X and Y, and one past the last.
    pub core: [[usize; 2]; 2],
    /// Heights, mm, row by row.
    pub heights: Vec<f32>,
    /// Element that last lowered each cell.
    pub ids: Vec<u32>,
    /// Bottom of the stock, mm.
    pub floor: f32,
    /// No height in it exceeds this, mm.
    pub highest: f32,
    /// The same for each block of [`BLOCK`] × [`BLOCK`] cells, row by row.
    pub tops: Vec<f32>,
    /// Rows that were swept since `highest` and `tops` were worked out.
    pub swept: std::ops::Range<usize>,
    /// The values that sweeps overwrote, where sweeps may have to be undone.
    pub past: Past,
}

/// Takes back what was lowered between two marks.
pub fn undo(tile: &mut Tile, marks: [usize; 2]) {
    let Tile { heights, ids, past, .. } = tile;
    past.undo(heights, ids, marks);
}

/// Lowers again what was taken back since a mark.
pub fn redo(tile: &mut Tile, from: usize) {
    let Tile { heights, ids, past, .. } = tile;
    past.redo(heights, ids, from);
}

/// How a field is divided into tiles.
#[derive(Debug, Clone, Copy)]
pub struct Tiling {
    /// Extent of the field, mm.
    pub extent: Box3,
    /// Sides of a tile, mm.
    side: [f64; 2],
    /// Tiles along X and Y.
    across: [usize; 2],
}

/// The field of one piece of stock.
#[derive(Debug, Clone)]
pub struct Field {
    /// Extent, mm.
    pub extent: Box3,
    /// Sides of a cell, mm.
    pub cell: [f64; 2],
    /// Cells along X and Y.
    pub size: [usize; 2],
    /// Tiles along X and Y.
    pub tiling: [usize; 2],
    /// Tiles, row by row.
    pub tiles: Vec<Tile>,
}

/// Number of cells along each side that `extent` needs at most `cell_mm` wide.
pub fn cells(extent: &Box3, cell_mm: f64) -> [usize; 2] {
    let count = |low: f64, high: f64| (((high - low) / cell_mm - 1e-9).ceil() as usize).max(1);
    [count(extent.min.x, extent.max.x), count(extent.min.y, extent.max.y)]
}

impl Field {
    /// Field over `extent` with cells of at most `cell_mm` and the heights that `height(x, y)` gives.
    pub fn new(extent: Box3, cell_mm: f64, height: impl Fn(f64, f64) -> f64 + Sync) -> Self {
        let size = cells(&extent, cell_mm);
        let cell = [0, 1].map(|axis| (extent.max[axis] - extent.min[axis]) / size[axis] as f64);
        let middle = |axis: usize, k: usize| extent.min[axis] + (k as f64 + 0.5) * cell[axis];
        Self::from_rows(extent, size, |i, j| height(middle(0, i), middle(1, j)))
    }
    /// Field of `size` cells over `extent` with the heights that `height(column, row)` gives.
    pub fn from_rows(extent: Box3, size: [usize; 2], height: impl Fn(usize, usize) -> f64 + Sync) -> Self {
        Self::from_cells(extent, size, |i, j| (height(i, j), UNTOUCHED))
    }
    /// Field of `size` cells over `extent` with the heights and the provenance that `cell(column, row)` gives.
    pub fn from_cells(extent: Box3, size: [usize; 2], at: impl Fn(usize, usize) -> (f64, u32) + Sync) -> Self {
        let cell = [0, 1].map(|axis| (extent.max[axis] - extent.min[axis]) / size[axis] as f64);
        let tiling = size.map(|n| n.div_ceil(TILE));
        let place = |k: usize| [k % tiling[0], k / tiling[0]];
        let tiles = (0..tiling[0] * tiling[1]).into_par_iter().map(|k| tile(&extent, cell, size, place(k), &at));
        Self { extent, cell, size, tiling, tiles: tiles.collect() }
    }
    /// Values of all cells, row by row of the field; `of` gives those of a tile.
    pub fn by_row<T: Copy + Default + Send>(&self, of: impl Fn(&Tile) -> &[T] + Sync) -> Vec<T> {
        let mut all = vec![T::default(); self.size[0] * self.size[1]];
        all.par_chunks_mut(self.size[0]).enumerate().for_each(|(j, row)| {
            let tiles = &self.tiles[j / TILE * self.tiling[0]..][..self.tiling[0]];
            for (tile, out) in tiles.iter().zip(row.chunks_mut(TILE)) {
                let first = (j % TILE + tile.core[1][0]) * tile.size[0] + tile.core[0][0];
                out.copy_from_slice(&of(tile)[first..][..out.len()]);
            }
        });
        all
    }
    /// Gives the elements that lowered the cells other numbers.
    pub fn renumber(&mut self, number: impl Fn(u32) -> u32 + Sync) {
        self.tiles.par_iter_mut().for_each(|tile| {
            tile.ids.iter_mut().filter(|id| **id != UNTOUCHED).for_each(|id| *id = number(*id));
        });
    }
    fn at(&self, i: usize, j: usize) -> f32 {
        let tile = &self.tiles[(j / TILE) * self.tiling[0] + i / TILE];
        let (i, j) = (i % TILE + tile.core[0][0], j % TILE + tile.core[1][0]);
        tile.heights[j * tile.size[0] + i]
    }
    /// How it is divided.
    pub fn tiling(&self) -> Tiling {
        Tiling { extent: self.extent, side: self.cell.map(|side| TILE as f64 * side), across: self.tiling }
    }
    /// Volume of the stock, mm³.
    pub fn volume_mm3(&self) -> f64 {
        self.tiles.iter().map(Tile::volume_mm3).sum()
    }
    /// Height of the cell under (x, y), `None` outside.
    pub fn height(&self, x: f64, y: f64) -> Option<f32> {
        let i = ((x - self.extent.min.x) / self.cell[0]).floor();
        let j = ((y - self.extent.min.y) / self.cell[1]).floor();
        if i < 0.0 || j < 0.0 || i >= self.size[0] as f64 || j >= self.size[1] as f64 {
            return None;
        }
        Some(self.at(i as usize, j as usize))
    }
}

impl Tiling {
    /// Number of tiles.
    pub fn count(&self) -> usize {
        self.across[0] * self.across[1]
    }
    /// Indices of the tiles whose cores meet the box from `low` to `high` in XY.
    pub fn tiles_under(&self, low: [f64; 2], high: [f64; 2]) -> impl Iterator<Item = usize> + use<> {
        let [columns, rows] = [0, 1].map(|axis| {
            let index = |at: f64| ((at - self.extent.min[axis]) / self.side[axis]).floor();
            let (first, last) = (index(low[axis]).max(0.0) as usize, index(high[axis]));
            let end = if last < 0.0 { 0 } else { (last as usize + 1).min(self.across[axis]) };
            first..end.max(first)
        });
        let width = self.across[0];
        rows.flat_map(move |row| columns.clone().map(move |column| row * width + column))
    }
}

fn tile(
    extent: &Box3,
    cell: [f64; 2],
    cells: [usize; 2],
    place: [usize; 2],
    at: &(impl Fn(usize, usize) -> (f64, u32) + Sync),
) -> Tile {
    let begin = [0, 1].map(|axis| place[axis] * TILE);
    let end = [0, 1].map(|axis| (begin[axis] + TILE).min(cells[axis]));
    let low = begin.map(|b| b.saturating_sub(1));
    let high = [0, 1].map(|axis| (end[axis] + 1).min(cells[axis]));
    let size = [high[0] - low[0], high[1] - low[1]];
    let first = [extent.min.x + (low[0] as f64 + 0.5) * cell[0], extent.min.y + (low[1] as f64 + 0.5) * cell[1]];
    let count = size[0] * size[1];
    let (mut heights, mut ids) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for j in 0..size[1] {
        for i in 0..size[0] {
            let (height, id) = at(low[0] + i, low[1] + j);
            heights.push(height.max(extent.min.z) as f32);
            ids.push(id);
        }
    }
    let core = [0, 1].map(|axis| [begin[axis] - low[axis], end[axis] - low[axis]]);
    let (floor, tops) = (extent.min.z as f32, Vec::new());
    let (highest, swept, past) = (f32::INFINITY, 0..size[1], Past::default());
    let mut tile = Tile { first, cell, size, core, heights, ids, floor, highest, tops, swept, past };
    tile.update_highest();
    tile
}

impl Tile {
    /// Works out the upper bounds of the heights anew.
    pub fn update_highest(&mut self) {
        let higher = |a: f32, b: &f32| if *b > a { *b } else { a };
        let width = self.size[0].div_ceil(BLOCK);
        self.tops.resize(width * self.size[1].div_ceil(BLOCK), f32::NEG_INFINITY);
        let blocks = self.swept.start / BLOCK..self.swept.end.div_ceil(BLOCK);
        self.swept = 0..0;
        let mut columns = vec![f32::NEG_INFINITY; self.size[0]];
        for block in blocks {
            columns.fill(f32::NEG_INFINITY);
            for j in block * BLOCK..((block + 1) * BLOCK).min(self.size[1]) {
                let row = &self.heights[j * self.size[0]..][..self.size[0]];
                columns.iter_mut().zip(row).for_each(|(top, height)| *top = higher(*top, height));
            }
            for (top, columns) in self.tops[block * width..][..width].iter_mut().zip(columns.chunks(BLOCK)) {
                *top = columns.iter().fold(f32::NEG_INFINITY, higher);
            }
        }
        self.highest = self.tops.iter().fold(f32::NEG_INFINITY, higher);
    }
    /// Upper bound of the heights in a window (columns, rows), mm.
    pub fn top_in(&self, [columns, rows]: &[std::ops::Range<usize>; 2]) -> f32 {
        let mut top = f32::NEG_INFINITY;
        if columns.is_empty() || rows.is_empty() {
            return top;
        }
        let width = self.size[0].div_ceil(BLOCK);
        for row in rows.start / BLOCK..=(rows.end - 1) / BLOCK {
            for block in &self.tops[row * width..][columns.start / BLOCK..=(columns.end - 1) / BLOCK] {
                top = if *block > top { *block } else { top };
            }
        }
        top
    }
    /// Volume above the floor in the core cells, mm³.
    pub fn volume_mm3(&self) -> f64 {
        let mut sum = 0.0;
        for j in self.core[1][0]..self.core[1][1] {
            let row = &self.heights[j * self.size[0]..][self.core[0][0]..self.core[0][1]];
            sum += row.iter().map(|&h| f64::from(h) - f64::from(self.floor)).sum::<f64>();
        }
        sum * self.cell[0] * self.cell[1]
    }
    /// Volume above the floor in the core cells of a window (low, high in XY, mm), mm³.
    pub fn volume_in_mm3(&self, low: [f64; 2], high: [f64; 2]) -> f64 {
        let [columns, rows] = self.window(low, high);
        let mut sum = 0.0;
        for j in rows.start.max(self.core[1][0])..rows.end.min(self.core[1][1]) {
            for i in columns.start.max(self.core[0][0])..columns.end.min(self.core[0][1]) {
                sum += f64::from(self.heights[j * self.size[0] + i]) - f64::from(self.floor);
            }
        }
        sum * self.cell[0] * self.cell[1]
    }
    /// Cells (columns, rows) whose middles lie in the box from `low` to `high`.
    #[inline]
    pub fn window(&self, low: [f64; 2], high: [f64; 2]) -> [std::ops::Range<usize>; 2] {
        [0, 1].map(|axis| {
            let index = |x: f64| (x - self.first[axis]) / self.cell[axis];
            let (from, to) = (index(low[axis]), index(high[axis]));
            // The conversion rounds toward none.
            let below = from as usize;
            let begin = below + usize::from((below as f64) < from);
            let end = if to < 0.0 { 0 } else { (to as usize).saturating_add(1).min(self.size[axis]) };
            begin.min(end)..end
        })
    }
}
