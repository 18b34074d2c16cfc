//! Shape of a blank before the first cut. In: a shape in mm. Out: its extent, its height over every point of the plane, its height field.

use super::field::Field;
use crate::machine::Box3;
use crate::path::Vec3;
use rayon::prelude::*;

/// Initial shape of a piece of stock, in the common frame.
#[derive(Debug, Clone)]
pub enum Blank {
    /// A box.
    Box(Box3),
    /// An upright cylinder.
    Cylinder {
        /// Centre in XY, mm.
        centre: [f64; 2],
        /// Radius, mm.
        radius: f64,
        /// Lower and upper face, mm.
        z: [f64; 2],
    },
    /// Heights over a grid; nothing above or beside them.
    Heights(Box<Relief>),
}

/// Cells along the side of a block of a relief.
const BLOCK: usize = 4;

/// Heights worked on in one go.
const MANY: usize = 1 << 14;

/// Rise from cell to cell over the mean side of a cell, twice, from which on a wall stands between them: 76° over both sides. Drafts of castings are
/// steeper, slopes that a ball finishes are less.
const STEEP: f64 = 2.0;

/// Difference up to which heights are those of one level, mm.
const LEVEL_MM: f32 = 1e-5;

/// Heights over a grid, with the lowest height of each block of cells.
#[derive(Debug, Clone)]
pub struct Relief {
    /// Extent, mm.
    pub extent: Box3,
    /// Sides of a cell, mm.
    pub cell: [f64; 2],
    /// Cells along X and Y.
    pub size: [usize; 2],
    /// Cells per mm along X and Y.
    per_mm: [f64; 2],
    /// The heights, row by row, mm.
    pub heights: Vec<f32>,
    /// Lowest height of each block of cells, row by row, mm.
    lows: Vec<f32>,
    /// A rise from cell to cell that only a wall has is one ([`Self::with_walls`]).
    has_walls: bool,
}

impl Relief {
    /// The blank that has the heights of a field.
    pub fn new(field: &Field) -> Self {
        Self::from_rows(field.extent, field.size, field.by_row(|tile| &tile.heights))
    }
    /// The blank of `size` cells over `extent` with these heights, row by row.
    pub fn from_rows(extent: Box3, size: [usize; 2], heights: Vec<f32>) -> Self {
        let width = size[0].div_ceil(BLOCK);
        let mut lows = vec![f32::INFINITY; width * size[1].div_ceil(BLOCK)];
        let blocks = heights.par_chunks(BLOCK * size[0]).zip(lows.par_chunks_mut(width));
        blocks.for_each(|(heights, lows)| {
            for heights in heights.chunks(size[0]) {
                for (low, cells) in lows.iter_mut().zip(heights.chunks(BLOCK)) {
                    *low = cells.iter().fold(*low, |low, height| low.min(*height));
                }
            }
        });
        let cell = [0, 1].map(|axis| (extent.max[axis] - extent.min[axis]) / size[axis] as f64);
        Self { extent, cell, size, per_mm: cell.map(|side| 1.0 / side), heights, lows, has_walls: false }
    }
    /// The same with walls: between middles of cells that differ by more than [`STEEP`] all stands as high as the highest of them, so that a wall is
    /// as far out as the cells let it. So for stock from a file; a finished surface in fine cells is taken as it is.
    pub fn with_walls(self) -> Self {
        Self { has_walls: true, ..self }
    }
    /// Has it walls?
    pub fn has_walls(&self) -> bool {
        self.has_walls
    }
    /// Height at (x, y), minus infinity outside: linear between the middles of the cells, and as [`Self::with_walls`] says.
    #[inline]
    pub fn surface(&self, x: f64, y: f64) -> f64 {
        let [u, v] = [(x - self.extent.min.x) * self.per_mm[0], (y - self.extent.min.y) * self.per_mm[1]];
        let [columns, rows] = self.size;
        if !((0.0..=columns as f64).contains(&u) && (0.0..=rows as f64).contains(&v)) {
            return f64::NEG_INFINITY;
        }
        let ([i, beside], s) = cells_about(u, columns);
        let ([j, above], t) = cells_about(v, rows);
        let at = |j: usize, i: usize| f64::from(self.heights[j * columns + i]);
        let [[a, b], [c, d]] = [j, above].map(|j| [at(j, i), at(j, beside)]);
        let (least, most) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        if self.has_walls && most - least > STEEP * (self.cell[0] + self.cell[1]) {
            return most;
        }
        let [low, high] = [a + s * (b - a), c + s * (d - c)];
        low + t * (high - low)
    }
    /// The heights that occur at two or more of these places, mm: where the top is level.
    pub fn levels(&self, places: impl Iterator<Item = [f64; 2]>) -> Vec<f64> {
        let mut heights: Vec<f32> = places.filter_map(|place| self.height(place)).collect();
        heights.sort_unstable_by(f32::total_cmp);
        let level = |two: &[f32]| (two[1] - two[0] < LEVEL_MM).then_some(f64::from(two[0]));
        let mut levels: Vec<f64> = heights.windows(2).filter_map(level).collect();
        levels.dedup_by(|a, b| *a - *b < f64::from(LEVEL_MM));
        levels
    }
    /// Height of the cell under (x, y), `None` outside.
    fn height(&self, [x, y]: [f64; 2]) -> Option<f32> {
        let i = ((x - self.extent.min.x) * self.per_mm[0]).floor();
        let j = ((y - self.extent.min.y) * self.per_mm[1]).floor();
        if i < 0.0 || j < 0.0 || i >= self.size[0] as f64 || j >= self.size[1] as f64 {
            return None;
        }
        Some(self.heights[j as usize * self.size[0] + i as usize])
    }
    /// A lower bound of the heights within `reach` of (x, y), mm; minus infinity where part of that is outside the grid.
    pub fn lowest_about(&self, [x, y]: [f64; 2], reach: f64) -> f64 {
        let Self { extent, per_mm, size, .. } = self;
        let at = |low: f64, axis: usize| (low - extent.min[axis]) * per_mm[axis];
        let (low, high) =
            ([at(x - reach, 0) - 1.0, at(y - reach, 1) - 1.0], [at(x + reach, 0) + 1.0, at(y + reach, 1) + 1.0]);
        if (0..2).any(|axis| low[axis] < 0.0 || high[axis] >= size[axis] as f64) {
            return f64::NEG_INFINITY;
        }
        let block = |k: f64| k as usize / BLOCK;
        let width = size[0].div_ceil(BLOCK);
        let rows = block(low[1])..=block(high[1]);
        let lows = rows.flat_map(|row| &self.lows[row * width..][block(low[0])..=block(high[0])]);
        f64::from(lows.fold(f32::INFINITY, |low, block| low.min(*block)))
    }
}

/// The two cells of a row of `count` between whose middles a place lies (in cells from the beginning of the row), and the share of the way
/// from the first to the second, clamped to the first and the last middle.
#[inline]
fn cells_about(place: f64, count: usize) -> ([usize; 2], f64) {
    let last = count as i32 - 1;
    let at = (place - 0.5).max(0.0).min(f64::from(last));
    // Positive: the conversion rounds down.
    let k = at as i32;
    ([k as usize, (k + 1).min(last) as usize], at - f64::from(k))
}

impl Blank {
    /// Smallest box that holds it.
    pub fn extent(&self) -> Box3 {
        match self {
            Blank::Box(extent) => *extent,
            Blank::Cylinder { centre: [x, y], radius, z } => {
                Box3 { min: Vec3::new(x - radius, y - radius, z[0]), max: Vec3::new(x + radius, y + radius, z[1]) }
            }
            Blank::Heights(relief) => relief.extent,
        }
    }
    /// Height of its lower face, mm.
    pub fn bottom_mm(&self) -> f64 {
        self.extent().min.z
    }
    /// The same blank elsewhere.
    pub fn moved(self, by: Vec3) -> Self {
        if by == Vec3::zeros() {
            return self;
        }
        let shifted = |of: Box3| Box3 { min: of.min + by, max: of.max + by };
        match self {
            Blank::Box(extent) => Blank::Box(shifted(extent)),
            Blank::Cylinder { centre: [x, y], radius, z } => {
                Blank::Cylinder { centre: [x + by.x, y + by.y], radius, z: z.map(|z| z + by.z) }
            }
            Blank::Heights(relief) => {
                let Relief { extent, size, mut heights, has_walls, .. } = *relief;
                heights
                    .par_iter_mut()
                    .with_min_len(MANY)
                    .for_each(|height| *height = (f64::from(*height) + by.z) as f32);
                let moved = Relief::from_rows(shifted(extent), size, heights);
                Blank::Heights(Box::new(Relief { has_walls, ..moved }))
            }
        }
    }
    /// Height of its top over (x, y); minus infinity beside it.
    pub fn height(&self, x: f64, y: f64) -> f64 {
        match self {
            Blank::Box(extent) => extent.max.z,
            Blank::Cylinder { centre, radius, z } => {
                if (x - centre[0]).hypot(y - centre[1]) <= *radius {
                    z[1]
                } else {
                    f64::NEG_INFINITY
                }
            }
            Blank::Heights(relief) => relief.height([x, y]).map_or(f64::NEG_INFINITY, f64::from),
        }
    }
    /// Its field of cells of at most `cell_mm`.
    pub fn field(&self, cell_mm: f64) -> Field {
        match self {
            Blank::Heights(relief) if relief.size == super::field::cells(&relief.extent, cell_mm) => {
                let Relief { extent, size, heights, .. } = relief.as_ref();
                Field::from_rows(*extent, *size, |i, j| f64::from(heights[j * size[0] + i]))
            }
            _ => Field::new(self.extent(), cell_mm, |x, y| self.height(x, y)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rise_of_more_than_four_over_a_cell_of_one_is_a_wall_of_stock_that_has_walls() {
        let extent = Box3 { min: Vec3::zeros(), max: Vec3::new(2.0, 1.0, 9.0) };
        let middle = |rise: f32, walls: bool| {
            let relief = Relief::from_rows(extent, [2, 1], vec![0.0, rise]);
            if walls { relief.with_walls() } else { relief }.surface(1.0, 0.5)
        };
        assert!((middle(3.9, true) - 1.95).abs() < 1e-6 && (middle(4.1, true) - 4.1).abs() < 1e-6);
        assert!((middle(4.1, false) - 2.05).abs() < 1e-6);
    }
}
