//! Does the moved semi-finish cut below what the finish leaves? In: the stock as the finish alone leaves it, as the
//! semi-finish left it, and as the moved one does, on the same cells. Out: the cells on which it does, and how deep.
//!
//! Heights of cells are exact at their middles. The finished surface is where the finish cuts deeper than the
//! semi-finish as it came did, by at least a part of what is usual ([`PART`]), both along the normal of what the finish
//! leaves. Beside it, at the far side of the ball on the first and last pass, the moved one may reach further than
//! both: that is told apart, for whether it matters only the drawing says. There the normal of the ball stands at a
//! right angle to that of the surface; a ball that is moved by t runs along it, and deeper by t²/2R. (Along Z there is
//! as much stock at the far side as anywhere: a ball that is lifted by t is so all around.)

use crate::stock::{Piece, UNTOUCHED};

/// Depth along the normal of the surface that counts, mm: half an increment of 0.001 mm in X, Y and Z each, and the 0.1
/// µm of heights kept in single precision.
const DEEP_MM: f32 = 0.001;

/// Part of the stock usually left (the median) from which a cell is one of the finished surface, and not of the far
/// side of the ball: there the stock is that share of the usual one that the cosine between both normals is, 0 at the
/// right angle. Moved by t ≤ R/2 the ball stays above where that is a quarter.
const PART: f32 = 0.25;

/// What was found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gouge {
    /// Cells of the finished surface.
    pub cells: usize,
    /// Of these, cells that the moved semi-finish leaves lower.
    pub gouged: usize,
    /// Largest depth below, along the normal, mm.
    pub deepest_mm: f64,
    /// Middle of that cell, mm.
    pub at: [f64; 2],
    /// Cells beside the finished surface that the moved semi-finish leaves lower than finish and semi-finish as they
    /// came.
    pub beside: usize,
    /// Largest depth below there, along Z, mm.
    pub beside_mm: f64,
}

/// Holds the moved semi-finish against the finish alone, and against itself as it came.
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

/// The vertical part of the normal at a cell: of the slopes to the cells beside it, either way, the gentler counts.
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

/// Stock along the normal from which a cell belongs to the finished surface, mm; `left`: that of every cell that the
/// finish cuts.
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

    /// A plane of 45° over 4 by 4 cells, and a step in it: the normal is that of the plane up to the foot of the step.
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
