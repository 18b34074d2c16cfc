//! Gouge check: does the moved semi-finish cut below the finished surface? In: what the finish alone, the original and
//! the moved semi-finish leave, on the same cells. Out: the number of gouged cells, and the depth.
//!
//! Heights of cells are exact at their middles. The depth of a point x below the surface that a ball of radius R leaves
//! is at most min over s of d(x, c(s)) − R, with c(s) the path of its centre ([`super::centres`]), and at most the
//! difference of heights; it is the lesser of the two, which holds on steep faces too, where heights alone say little.
//! A cell belongs to the finished surface if the finish cuts below the original semi-finish by at least a part of the
//! usual depth ([`PART`]). Beside that surface, on the far side of the ball in the first and last pass and at the ends of
//! passes, the moved semi-finish may cut below both. This is reported separately, as only the drawing shows whether it
//! matters: there the normal of the ball is perpendicular to that of the surface, and a ball moved by t along the
//! surface normal cuts deeper by t²/2R.

use rayon::prelude::*;

use super::centres::{Centres, Near};
use super::programs::{ball, centres};
use super::task::{SemifinishError, Task};
use crate::machine::Job;
use crate::nc::Toolpath;
use crate::path::Vec3;
use crate::stock::{Piece, UNTOUCHED};

/// Least depth of a gouge along the surface normal, mm: above the rounding of half an increment of 0.001 mm in each of
/// X, Y and Z, and 0.1 µm of heights in single precision.
const DEEP_MM: f64 = 0.001;

/// Least stock of a cell of the finished surface, over the median stock. On the far side of the ball the stock is the
/// median times the cosine between the normals of ball and surface, 0 at a right angle; moved by t ≤ R/2 the ball does
/// not cut deeper where that is at least a quarter.
const PART: f64 = 0.25;

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
    /// Largest depth there, mm.
    pub beside_mm: f64,
}

/// What a program leaves.
pub struct LeftStock<'a> {
    /// Its stock.
    pieces: &'a [Piece],
    /// Path of the centre of its ball.
    centres: Centres,
    /// Radius of its ball, mm.
    radius_mm: f64,
}

impl<'a> LeftStock<'a> {
    fn new(job: &Job, path: &Toolpath, which: &'static str, pieces: &'a [Piece]) -> Result<Self, SemifinishError> {
        let tool = ball(which, path, job)?;
        Ok(Self { pieces, centres: centres(job, path, &path.moves, tool), radius_mm: tool.radius_mm() })
    }

    /// Depth of a point below the surface, mm; `below_mm`: depth along Z. `near`: memory for the search.
    fn depth_mm(&self, x: Vec3, below_mm: f64, near: &mut Vec<Near>) -> f64 {
        if below_mm <= DEEP_MM {
            return below_mm;
        }
        // The depth is no larger than `below_mm`: farther pieces are not the nearest.
        self.centres.near(x, self.radius_mm + below_mm, near);
        self.centres
            .nearest(near, x, &mut 0)
            .map_or(below_mm, |nearest| below_mm.min(nearest.distance_mm - self.radius_mm))
    }
}

/// Compares the stock that the moved semi-finish leaves with that of the finish alone and of the original semi-finish. `left`: of finish,
/// original and moved semi-finish, in the same cells; in others nothing could be compared, which is an error.
pub fn gouge(task: &Task, left: [&[Piece]; 3]) -> Result<Gouge, SemifinishError> {
    let [finish, semi, moved] = left;
    let sizes = left.map(|pieces| pieces.iter().map(|piece| piece.field.size).collect::<Vec<_>>());
    if sizes[0] != sizes[1] || sizes[0] != sizes[2] {
        return Err(SemifinishError::NotCompared);
    }
    let finish = LeftStock::new(task.job, task.finish, "finishing", finish)?;
    let semi = LeftStock::new(task.job, task.semi, "semi-finishing", semi)?;
    let mut found = Gouge::default();
    for ((finished, before), moved) in finish.pieces.iter().zip(semi.pieces).zip(moved) {
        found.add(&finish, &semi, [finished, before, moved]);
    }
    Ok(found)
}

impl Gouge {
    /// Adds a piece of stock: as the finish, the original and the moved semi-finish leave it.
    fn add(&mut self, finish: &LeftStock, semi: &LeftStock, pieces: [&Piece; 3]) {
        let heights = pieces.map(|piece| piece.field.by_row(|tile| &tile.heights));
        let ids = pieces[0].field.by_row(|tile| &tile.ids);
        let field = &pieces[2].field;
        let across = field.size[0];
        let middle = |k: usize| {
            let at = |axis: usize, k: usize| field.extent.min[axis] + (k as f64 + 0.5) * field.cell[axis];
            [at(0, k % across), at(1, k / across)]
        };
        let point = |k: usize, z: f32| Vec3::new(middle(k)[0], middle(k)[1], f64::from(z));
        // Stock that the semi-finish leaves to the finish in each cell, and depth of the moved semi-finish below both.
        let look = |near: &mut Vec<Near>, k: usize| {
            let [finished, before, moved] = heights.each_ref().map(|heights| heights[k]);
            let left = if ids[k] == UNTOUCHED {
                0.0
            } else {
                semi.depth_mm(point(k, finished), f64::from(before - finished), near)
            };
            let x = point(k, moved);
            let below = finish.depth_mm(x, f64::from(finished.min(before) - moved), near);
            (left, semi.depth_mm(x, below, near))
        };
        let cells: Vec<(f64, f64)> = (0..ids.len()).into_par_iter().map_init(Vec::new, look).collect();
        let least = least_left(cells.iter().map(|(left, _)| *left).filter(|left| *left > DEEP_MM).collect());
        for (k, (left, below)) in cells.into_iter().enumerate() {
            let of_surface = left >= least;
            self.cells += usize::from(of_surface);
            if below <= DEEP_MM {
                continue;
            }
            if !of_surface {
                self.beside += 1;
                self.beside_mm = self.beside_mm.max(below);
                continue;
            }
            self.gouged += 1;
            if below > self.deepest_mm {
                (self.deepest_mm, self.at) = (below, middle(k));
            }
        }
    }
}

/// Least stock along the normal of a cell of the finished surface, mm; `left`: stock of every cell that the finish
/// cuts.
fn least_left(mut left: Vec<f64>) -> f64 {
    let middle = left.len() / 2;
    if left.is_empty() {
        return DEEP_MM;
    }
    let (_, usual, _) = left.select_nth_unstable_by(middle, f64::total_cmp);
    DEEP_MM.max(PART * *usual)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::Curve;

    /// A ball of radius 3 that has run along X at z = 0: below its lowest line a point is as deep as it looks, beside
    /// the rim, where the wall is steep, only as deep as it is away from the ball.
    #[test]
    fn depth_is_along_the_normal_of_the_ball() {
        let way = Curve::Line { from: Vec3::zeros(), to: Vec3::new(9.0, 0.0, 0.0) };
        let left = LeftStock { pieces: &[], centres: Centres::new(std::iter::once((0, way)), 3.0), radius_mm: 3.0 };
        let mut near = Vec::new();
        assert!((left.depth_mm(Vec3::new(5.0, 0.0, -0.02), 0.02, &mut near) - 0.02).abs() < 1e-12);
        // At 2.99 mm from the axis the wall is at 2.755 mm; 0.3 mm below, the ball is 0.0075 mm away.
        let wall = 3.0 - (9.0_f64 - 2.99 * 2.99).sqrt();
        let depth = left.depth_mm(Vec3::new(5.0, 2.99, wall - 0.3), 0.3, &mut near);
        assert!((depth - (2.99_f64.hypot(3.0 - wall + 0.3) - 3.0)).abs() < 1e-12 && depth < 0.04, "{depth}");
        // What other tools left is no deeper than its heights say.
        assert!((left.depth_mm(Vec3::new(5.0, 40.0, -0.02), 0.02, &mut near) - 0.02).abs() < 1e-12);
    }

    #[test]
    fn the_finished_surface_begins_at_a_quarter_of_the_usual_stock() {
        assert!((least_left(vec![0.1, 0.2, 0.3]) - 0.05).abs() < 1e-12);
        assert!(
            (least_left(vec![0.002; 3]) - DEEP_MM).abs() < 1e-12 && (least_left(Vec::new()) - DEEP_MM).abs() < 1e-12
        );
    }
}
