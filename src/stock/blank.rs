//! Shape of a blank before the first cut. In: a shape in mm. Out: its extent, its height over every point of the plane, and
//! a signed distance in the plane at a given height (negative inside), exact for boxes and cylinders.

use super::field::Field;
use crate::machine::Box3;
use crate::path::Vec3;

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

/// Heights over a grid, with what none of them goes below block by block.
#[derive(Debug, Clone)]
pub struct Relief {
    /// The heights.
    pub field: Field,
    /// Lowest height of each block of cells, row by row, mm.
    lows: Vec<f32>,
}

impl Relief {
    /// The blank that has the heights of a field.
    pub fn new(field: Field) -> Self {
        let width = field.size[0].div_ceil(BLOCK);
        let mut lows = vec![f32::INFINITY; width * field.size[1].div_ceil(BLOCK)];
        for (k, height) in field.rows().enumerate() {
            let low = &mut lows[k / field.size[0] / BLOCK * width + k % field.size[0] / BLOCK];
            *low = low.min(height);
        }
        Self { field, lows }
    }
    /// A height that none within `reach` of (x, y) goes below, mm; minus infinity where that is not all over the grid.
    pub fn lowest_about(&self, [x, y]: [f64; 2], reach: f64) -> f64 {
        let Field { extent, cell, size, .. } = &self.field;
        let at = |low: f64, axis: usize| ((low - extent.min[axis]) / cell[axis]).floor();
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

impl Blank {
    /// Smallest box that holds it.
    pub fn extent(&self) -> Box3 {
        match self {
            Blank::Box(extent) => *extent,
            Blank::Cylinder { centre: [x, y], radius, z } => {
                Box3 { min: Vec3::new(x - radius, y - radius, z[0]), max: Vec3::new(x + radius, y + radius, z[1]) }
            }
            Blank::Heights(relief) => relief.field.extent,
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
            Blank::Heights(relief) => relief.field.height(x, y).map_or(f64::NEG_INFINITY, f64::from),
        }
    }
    /// Its field of cells of at most `cell_mm`.
    pub fn field(&self, cell_mm: f64) -> Field {
        match self {
            Blank::Heights(relief) if fits(&relief.field, cell_mm) => relief.field.clone(),
            _ => Field::new(self.extent(), cell_mm, |x, y| self.height(x, y)),
        }
    }
    /// Signed distance in the plane to its section at height `z` (for heights over a grid: half a cell either way).
    pub fn distance(&self, p: [f64; 2], z: f64) -> f64 {
        match self {
            Blank::Box(extent) => {
                if z < extent.min.z || z > extent.max.z {
                    return f64::INFINITY;
                }
                let beyond = |axis: usize| (extent.min[axis] - p[axis]).max(p[axis] - extent.max[axis]);
                outside_box(beyond(0), beyond(1))
            }
            Blank::Cylinder { centre, radius, z: [low, high] } => {
                if z < *low || z > *high {
                    return f64::INFINITY;
                }
                (p[0] - centre[0]).hypot(p[1] - centre[1]) - radius
            }
            Blank::Heights(relief) => {
                let field = &relief.field;
                let half = 0.5 * field.cell[0].min(field.cell[1]);
                let inside = z >= field.extent.min.z && field.height(p[0], p[1]).is_some_and(|h| z < f64::from(h));
                if inside { -half } else { half }
            }
        }
    }
}

/// Are these the cells asked for?
fn fits(field: &Field, cell_mm: f64) -> bool {
    field.size == super::field::cells(&field.extent, cell_mm)
}

fn outside_box(x: f64, y: f64) -> f64 {
    if x > 0.0 && y > 0.0 { x.hypot(y) } else { x.max(y) }
}
