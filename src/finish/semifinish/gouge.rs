//! Gouge check: does the moved semi-finish cut below the finished surface? In: height fields after the finish alone,
//! after the original and after the moved semi-finish, on the same cells. Out: the number of gouged cells, and the
//! depth.
//!
//! Heights of cells are exact at their middles. A cell belongs to the finished surface if the finish cuts below the
//! original semi-finish by at least a part of the usual depth ([`PART`]), measured along the normal of the finished
//! surface. Beside that surface, on the far side of the ball in the first and last pass, the moved semi-finish may cut
//! below both. This is reported separately, as only the drawing shows whether it matters: there the normal of the ball
//! is perpendicular to that of the surface, and a ball moved by t along the surface normal cuts deeper by t²/2R.
//! (Measured along Z, a lifted ball leaves the same stock on its far side as elsewhere.)

use crate::stock::{Piece, UNTOUCHED};

/// Least depth of a gouge along the surface normal, mm: above the rounding of half an increment of 0.001 mm in each of
/// X, Y and Z, and 0.1 µm of heights in single precision.
const DEEP_MM: f32 = 0.001;

/// Least stock of a cell of the finished surface, over the median stock. On the far side of the ball the stock is the
/// median times the cosine between the normals of ball and surface, 0 at a right angle; moved by t ≤ R/2 the ball does
/// not cut deeper where that is at least a quarter.
const PART: f32 = 0.25;

/// Result of the check.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gouge {
    /// Cells of the finished surface.
    pub cells: usize,
    /// Of these, gouged cells.
    pub gouged: usize,
    /// Largest depth below, along the normal, mm.
    pub deepest_mm: f64,
    /// Middle of that cell, mm.
    pub at: [f64; 2],
    /// Cells beside the finished surface where the moved semi-finish cuts below both finish and original semi-finish.
    pub beside: usize,
    /// Largest depth there, along Z, mm.
    pub beside_mm: f64,
}

/// Compares the moved semi-finish with the finish alone and with the original semi-finish.
pub fn gouge(finish: &[Piece], semi: &[Piece], moved: &[Piece]) -> Gouge {
    let mut found = Gouge::default();
    for ((finish, semi), moved) in finish.iter().zip(semi).zip(moved) {
        let heights = [finish, semi, moved].map(|piece| piece.field.by_row(|tile| &tile.heights));
        let ids = finish.field.by_row(|tile| &tile.ids);
        let (field, across) = (&moved.field, moved.field.size[0]);
        if heights.iter().any(|heights| heights.len() != ids.len()) {
            continue;
        }
        let upright = |k: usize| upright(&heights[0], k, across, field.cell);
        let left = |k: usize| (heights[1][k] - heights[0][k]) * upright(k);
        let touched = (0..ids.len()).filter(|k| ids[*k] != UNTOUCHED);
        let least = least_left(touched.map(left).filter(|left| *left > DEEP_MM).collect());
        for k in 0..ids.len() {
            let [finish, semi, moved] = [heights[0][k], heights[1][k], heights[2][k]];
            if ids[k] == UNTOUCHED || left(k) < least {
                if finish.min(semi) - moved > DEEP_MM {
                    found.beside += 1;
                    found.beside_mm = found.beside_mm.max(f64::from(finish.min(semi) - moved));
                }
                continue;
            }
            found.cells += 1;
            let below = (finish.min(semi) - moved) * upright(k);
            if below <= DEEP_MM {
                continue;
            }
            found.gouged += 1;
            if f64::from(below) > found.deepest_mm {
                found.deepest_mm = f64::from(below);
                let middle = |axis: usize, k: usize| field.extent.min[axis] + (k as f64 + 0.5) * field.cell[axis];
                found.at = [middle(0, k % across), middle(1, k / across)];
            }
        }
    }
    found
}

/// The z component of the surface normal at a cell, from the gentler of the two slopes in each of x and y.
fn upright(heights: &[f32], k: usize, across: usize, cell_mm: [f64; 2]) -> f32 {
    let column = k % across;
    let along_x = [(column > 0).then(|| k - 1), (column + 1 < across).then_some(k + 1)];
    let along_y = [k.checked_sub(across), Some(k + across).filter(|beside| *beside < heights.len())];
    let slope = |beside: [Option<usize>; 2], cell_mm: f64| {
        let rises =
            beside.into_iter().flatten().map(|beside| f64::from((heights[beside] - heights[k]).abs()) / cell_mm);
        rises.reduce(f64::min).unwrap_or(0.0)
    };
    let [x, y] = [slope(along_x, cell_mm[0]), slope(along_y, cell_mm[1])];
    (1.0 + x * x + y * y).sqrt().recip() as f32
}

/// Least stock along the normal of a cell of the finished surface, mm; `left`: stock of every cell that the finish
/// cuts.
fn least_left(mut left: Vec<f32>) -> f32 {
    let middle = left.len() / 2;
    if left.is_empty() {
        return DEEP_MM;
    }
    let (_, usual, _) = left.select_nth_unstable_by(middle, f32::total_cmp);
    DEEP_MM.max(PART * *usual)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane of 45° over 4 by 4 cells, and then a step in it: up to the foot of the step the normal is that of the
    /// plane.
    #[test]
    fn depth_is_along_the_normal_of_the_gentler_side() {
        let mut heights: Vec<f32> = (0..16).map(|k| 0.1 * (k % 4) as f32).collect();
        assert!((upright(&heights, 5, 4, [0.1; 2]) - 0.5_f32.sqrt()).abs() < 1e-4);
        heights.iter_mut().skip(2).step_by(4).for_each(|height| *height += 9.0);
        assert!((upright(&heights, 5, 4, [0.1; 2]) - 0.5_f32.sqrt()).abs() < 1e-4);
        assert!(upright(&heights, 6, 4, [0.1; 2]) < 0.02);
        assert!((upright(&[1.0], 0, 1, [0.1; 2]) - 1.0).abs() < 1e-6);
    }
}
