//! Motions near a place. In: curves. Out: those in the cells about a place, and the nearest place of them.

use crate::path::{Curve, Vec3};
use std::f64::consts::TAU;

/// Least side of a cell of the grid, mm.
const CELL_MM: f64 = 1.0;
/// Most cells along a side.
const CELLS: f64 = 1000.0;
/// Curves in a grid of cells seen from above.
pub struct Near<'a> {
    curves: &'a [Curve],
    low: [f64; 2],
    cell_mm: f64,
    count: [usize; 2],
    /// Numbers of the curves whose boxes reach into each cell.
    cells: Vec<Vec<u32>>,
}

impl<'a> Near<'a> {
    /// Sorts motions into cells, so that those of a cell and the eight about it include all within `reach_mm` of a point of it.
    pub fn new(curves: &'a [Curve], reach_mm: f64) -> Self {
        let bounds: Vec<(Vec3, Vec3)> = curves.iter().map(Curve::bounds).collect();
        let low = bounds.iter().map(|(low, _)| *low).reduce(|a, b| a.inf(&b)).unwrap_or_default();
        let high = bounds.iter().map(|(_, high)| *high).reduce(|a, b| a.sup(&b)).unwrap_or_default();
        let size = (high - low).xy();
        let cell_mm = CELL_MM.max(reach_mm).max(size.amax() / CELLS);
        let count = [size.x, size.y].map(|side| (side / cell_mm) as usize + 1);
        let mut near =
            Self { curves, low: [low.x, low.y], cell_mm, count, cells: vec![Vec::new(); count[0] * count[1]] };
        for (k, (low, high)) in bounds.iter().enumerate() {
            let ([i0, j0], [i1, j1]) = (near.cell(*low), near.cell(*high));
            for (i, j) in (i0..=i1).flat_map(|i| (j0..=j1).map(move |j| (i, j))) {
                near.cells[j * count[0] + i].push(k as u32);
            }
        }
        near
    }

    /// The cell of a point, or the nearest one.
    fn cell(&self, p: Vec3) -> [usize; 2] {
        [0, 1].map(|axis| (((p[axis] - self.low[axis]) / self.cell_mm).max(0.0) as usize).min(self.count[axis] - 1))
    }

    /// The curves in the cell of a point and the eight about it; one in several cells comes several times.
    pub fn about(&self, p: Vec3) -> impl Iterator<Item = &'a Curve> {
        let [i, j] = self.cell(p);
        let about = |k: usize, count: usize| k.saturating_sub(1)..(k + 2).min(count);
        let cells =
            about(j, self.count[1]).flat_map(move |j| about(i, self.count[0]).map(move |i| j * self.count[0] + i));
        cells.flat_map(|cell| &self.cells[cell]).map(|k| &self.curves[*k as usize])
    }

    /// The point of the curves nearest to another, of those in its cell and the eight about it, and the tangent there.
    pub fn nearest(&self, p: Vec3) -> Option<(Vec3, Vec3)> {
        let places = self.about(p).map(|curve| {
            let s_mm = nearest_mm(curve, p);
            (curve, s_mm, (curve.point(s_mm) - p).norm())
        });
        let (curve, s_mm, _) = places.min_by(|a, b| a.2.total_cmp(&b.2))?;
        Some((curve.point(s_mm), curve.tangent(s_mm)))
    }
}

/// Arc length of the point of a line or a plane arc nearest to another, mm.
pub fn nearest_mm(curve: &Curve, p: Vec3) -> f64 {
    let length = curve.length();
    match curve {
        Curve::Line { from, .. } => (p - from).dot(&curve.tangent(0.0)).clamp(0.0, length),
        Curve::Arc(arc) => {
            let (a, b, _) = arc.plane.axes();
            let angle = (p[b] - arc.centre[b]).atan2(p[a] - arc.centre[a]) - arc.start_rad;
            let (turned, sweep) = ((angle * arc.sweep_rad.signum()).rem_euclid(TAU), arc.sweep_rad.abs());
            // Beyond the end, up to the middle of what is left of the circle, the end is nearest, then the start.
            match turned {
                turned if turned <= sweep => length * turned / sweep,
                turned if turned < 0.5 * (sweep + TAU) => length,
                _ => 0.0,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::{Arc, Plane};

    #[test]
    fn the_nearest_place_of_a_line_and_an_arc() {
        let line = Curve::Line { from: Vec3::zeros(), to: Vec3::new(4.0, 0.0, 0.0) };
        assert_eq!([-1.0, 1.5, 9.0].map(|x| nearest_mm(&line, Vec3::new(x, 2.0, 1.0))), [0.0, 1.5, 4.0]);
        // A quarter of a circle of 2 mm radius in ZX, either way round.
        for sweep in [1.0, -1.0].map(|way| way * std::f64::consts::FRAC_PI_2) {
            let point = |angle: f64| Vec3::new(2.0 * angle.sin(), 0.0, 2.0 * angle.cos());
            let arc = Curve::Arc(Arc::new(Plane::Zx, point(0.0), point(sweep), Vec3::zeros(), sweep));
            for (share, expected) in [(-0.4, 0.0), (0.0, 0.0), (0.3, 0.3), (1.0, 1.0), (1.6, 1.0), (3.2, 0.0)] {
                let found = nearest_mm(&arc, 1.5 * point(share * sweep)) / arc.length();
                assert!((found - expected).abs() < 1e-9, "{sweep} {share}: {found}");
            }
        }
    }

    #[test]
    fn the_nearest_curve_is_found_by_its_cells() {
        let line = |y: f64| Curve::Line { from: Vec3::new(0.0, y, 0.0), to: Vec3::new(30.0, y, 3.0) };
        let curves: Vec<Curve> = (0..40).map(|k| line(0.4 * f64::from(k))).collect();
        let near = Near::new(&curves, 0.0);
        for k in 0..40 {
            let (at, tangent) = near.nearest(Vec3::new(17.0, 0.4 * f64::from(k) + 0.1, 1.7)).unwrap();
            assert!((at.y - 0.4 * f64::from(k)).abs() < 1e-12 && (at.x - 17.0).abs() < 1e-9 && tangent.x > 0.9);
        }
        assert!(Near::new(&[], 0.0).nearest(Vec3::zeros()).is_none());
    }
}
