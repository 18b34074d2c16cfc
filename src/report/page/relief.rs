//! The stock as the program leaves it, coarse enough for a page. In: the height field of the simulation. Out: heights on a grid.

use serde::Serialize;

use crate::path::Vec3;
use crate::stock::Field;

/// Cells along the longer side: steps of 0.7 % of it are a few pixels on the screen.
const CELLS: usize = 140;

/// Heights of a piece of stock, mm in the common frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Relief {
    /// Lowest corner.
    pub min: [f64; 3],
    /// Highest corner.
    pub max: [f64; 3],
    /// Cells along X and Y.
    pub size: [usize; 2],
    /// Heights at the middles of the cells, row by row along X.
    pub heights: Vec<f64>,
}

impl Relief {
    /// Of a field.
    pub fn of(field: &Field) -> Self {
        let (low, high) = (field.extent.min, field.extent.max);
        let sides = [high.x - low.x, high.y - low.y];
        let cell = sides[0].max(sides[1]) / CELLS as f64;
        let size = [0, 1].map(|k| ((sides[k] / cell).ceil() as usize).clamp(2, field.size[k].max(2)));
        let middle = |k: usize, i: usize| low[k] + sides[k] * (i as f64 + 0.5) / size[k] as f64;
        let height = |i: usize, j: usize| {
            let known = field.height(middle(0, i), middle(1, j)).map_or(low.z, f64::from);
            known.clamp(low.z, high.z)
        };
        let heights = (0..size[1]).flat_map(|j| (0..size[0]).map(move |i| (i, j))).map(|(i, j)| height(i, j)).collect();
        Self { min: [low.x, low.y, low.z], max: [high.x, high.y, high.z], size, heights }
    }

    /// The same less `origin`, with every length times `factor`.
    pub fn seen_from(&self, origin: Vec3, factor: f64) -> Self {
        let place = |p: [f64; 3]| [0, 1, 2].map(|k| super::digits::digits(factor * (p[k] - origin[k])));
        let heights = self.heights.iter().map(|z| super::digits::digits(factor * (z - origin.z))).collect();
        Self { min: place(self.min), max: place(self.max), size: self.size, heights }
    }
}
