//! Level curves of the height of the tip, and borders of ground of one kind. In: the drop-cutter of a surface, a height or a
//! condition. Out: curves in the plane, each with the higher ground, or that of the kind, on its right; closed, except those that
//! leave the grid.
//!
//! The tip heights are computed on a grid. If two neighbouring nodes lie on opposite sides of the level, the crossing
//! between them is found with the drop-cutter itself. Crossings within a cell are joined in pairs (marching squares;
//! Lorensen and Cline 1987 in three dimensions). Features smaller than a cell may be missed; since the tool widens
//! every peak by its radius, these are narrow hollows.

use super::drop::{Contact, Dropper};
use crate::numeric::bisect;
use rayon::prelude::*;

/// Bisections of the side of a cell: 0.5 mm to 0.5 µm.
const HALVINGS: u32 = 10;
/// Newton steps from a chord onto a curve.
const STEPS: usize = 6;
/// Length of a Newton step below which it has converged, mm: a tenth of the last digit of a program.
const NEAR_MM: f64 = 1e-4;
/// Horizontal component of the normal below which the ground is level.
const LEVEL: f64 = 1e-6;

/// Heights of the tip on a grid.
#[derive(Debug)]
pub struct Grid {
    low: [f64; 2],
    cell_mm: f64,
    count: [usize; 2],
    nodes: Vec<Option<Contact>>,
}

/// What is positive on the ground that curves go round.
type Value<'a> = &'a (dyn Fn(Option<&Contact>) -> f64 + Sync);

/// A curve in the plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Its points, mm; the first of a closed one is not repeated.
    pub points: Vec<[f64; 2]>,
    /// Is it closed?
    pub closed: bool,
}

impl Grid {
    /// The grid over a box, widened by the tool's radius.
    pub fn new(dropper: &Dropper, low: [f64; 2], high: [f64; 2], cell_mm: f64) -> Self {
        let reach = dropper.shape().radius_mm();
        let low = low.map(|x| x - reach);
        let count = [0, 1].map(|axis| ((high[axis] + reach - low[axis]) / cell_mm).ceil() as usize + 1);
        let grid = Self { low, cell_mm, count, nodes: Vec::new() };
        let places: Vec<[f64; 2]> = (0..count[0] * count[1]).map(|k| grid.place(k)).collect();
        Self { nodes: dropper.drop_all(&places), ..grid }
    }

    /// Side of a cell, mm.
    pub fn cell_mm(&self) -> f64 {
        self.cell_mm
    }

    /// Nodes over the surface in every `stride`th row and column, with their contacts.
    pub fn contacts(&self, stride: usize) -> impl Iterator<Item = ([f64; 2], &Contact)> {
        let wide = self.count[0];
        let taken = move |k: &usize| k % wide % stride == stride / 2 && k / wide % stride == stride / 2;
        (0..self.nodes.len()).filter(taken).filter_map(|k| Some((self.place(k), self.nodes[k].as_ref()?)))
    }

    /// Place of a node, mm.
    fn place(&self, node: usize) -> [f64; 2] {
        let at = [node % self.count[0], node / self.count[0]];
        [0, 1].map(|axis| self.low[axis] + at[axis] as f64 * self.cell_mm)
    }

    /// The curves at a height, on the lower side.
    pub fn curves(&self, dropper: &Dropper, level_mm: f64) -> Vec<Curve> {
        let above = |contact: Option<&Contact>| contact.map_or(f64::NEG_INFINITY, |contact| contact.tip_mm - level_mm);
        self.round(dropper, &above, false)
    }

    /// The borders of the ground on which a condition holds, on that ground.
    pub fn borders(&self, dropper: &Dropper, holds: &(dyn Fn(&Contact) -> bool + Sync)) -> Vec<Curve> {
        let on = |contact: Option<&Contact>| if contact.is_some_and(holds) { 1.0 } else { -1.0 };
        self.round(dropper, &on, true)
    }

    /// The curves round the ground on which a value is positive, on it or just beside it.
    fn round(&self, dropper: &Dropper, value: Value, on_it: bool) -> Vec<Curve> {
        let mut links = self.links(value);
        links.sort_unstable();
        let crossing = |edge: u32| self.crossing(dropper, edge, (value, on_it));
        let mut edges: Vec<u32> = links.iter().flat_map(|(from, to)| [*from, *to]).collect();
        edges.sort_unstable();
        edges.dedup();
        let places: Vec<[f64; 2]> = edges.par_iter().map(|edge| crossing(*edge)).collect();
        let place = |edge: u32| places[edges.partition_point(|known| *known < edge)];
        let curve =
            |(chain, closed): (Vec<u32>, bool)| Curve { points: chain.into_iter().map(place).collect(), closed };
        chains(&links).into_iter().map(curve).collect()
    }

    /// Segments of the curves in each cell, from edge to edge, with the ground of positive values on the right.
    fn links(&self, value: Value) -> Vec<(u32, u32)> {
        let [wide, high] = self.count;
        let mut links = Vec::new();
        for j in 0..high - 1 {
            for i in 0..wide - 1 {
                let node = j * wide + i;
                // Counter-clockwise about the cell: its corners, and the edge from each to the next.
                let corners = [node, node + 1, node + wide + 1, node + wide];
                let edges = [2 * node, 2 * (node + 1) + 1, 2 * (node + wide), 2 * node + 1];
                let [a, b, c, d] = corners.map(|k| value(self.nodes[k].as_ref()));
                let above = [a, b, c, d].map(|value| value > 0.0);
                let turns = |rising: bool| (0..4).filter(move |k| above[(k + 1) % 4] == rising && above[*k] != rising);
                // In a saddle cell the mean decides whether the high or the low corners are connected.
                let middle_is_high = a + b + c + d > 0.0;
                for rise in turns(true) {
                    let after = |fall: &usize| (fall + 4 - rise) % 4;
                    let fall =
                        if middle_is_high { turns(false).max_by_key(after) } else { turns(false).min_by_key(after) };
                    links.extend(fall.map(|fall| (edges[rise] as u32, edges[fall] as u32)));
                }
            }
        }
        links
    }

    /// Where the value changes its sign on an edge of the grid: the last place found where it is positive, or the first where it is not.
    fn crossing(&self, dropper: &Dropper, edge: u32, (value, on_it): (Value, bool)) -> [f64; 2] {
        let node = edge as usize / 2;
        let other = node + if edge.is_multiple_of(2) { 1 } else { self.count[0] };
        let ends = [node, other].map(|k| self.place(k));
        let between = |t: f64| [0, 1].map(|axis| ends[0][axis] + t * (ends[1][axis] - ends[0][axis]));
        let above = |t: f64| value(dropper.drop(between(t)).as_ref()) > 0.0;
        let first_is_high = value(self.nodes[node].as_ref()) > 0.0;
        let (high, low) = if first_is_high { (0.0, 1.0) } else { (1.0, 0.0) };
        between(bisect(above, high, low, HALVINGS)[usize::from(!on_it)])
    }
}

/// Joins segments, sorted by their start, to chains; and whether each is closed.
fn chains(links: &[(u32, u32)]) -> Vec<(Vec<u32>, bool)> {
    let from = |edge: u32| links.binary_search_by_key(&edge, |link| link.0).ok();
    let mut has_before = vec![false; links.len()];
    for next in links.iter().filter_map(|link| from(link.1)) {
        has_before[next] = true;
    }
    let mut seen = vec![false; links.len()];
    let mut found = Vec::new();
    // First the open chains from their starts, then the rest, which are closed.
    let open = (0..links.len()).filter(|k| !has_before[*k]).map(|k| (k, false));
    for (start, closed) in open.chain((0..links.len()).map(|k| (k, true))) {
        let (mut chain, mut at) = (Vec::new(), Some(start));
        while let Some(k) = at.filter(|k| !seen[*k]) {
            seen[k] = true;
            chain.push(links[k].0);
            at = from(links[k].1);
            if at.is_none() {
                chain.push(links[k].1);
            }
        }
        if chain.len() > 1 {
            found.push((chain, closed));
        }
    }
    found
}

/// Horizontal unit vector downhill at a contact; `None` on level ground.
pub fn downhill(contact: &Contact) -> Option<[f64; 2]> {
    let level = contact.normal.x.hypot(contact.normal.y);
    (level > LEVEL).then(|| [contact.normal.x / level, contact.normal.y / level])
}

/// Moves a point beside a level curve onto it along the slope, by Newton steps; `None` if that is farther than
/// `most_mm`.
pub fn onto(dropper: &Dropper, from: [f64; 2], level_mm: f64, most_mm: f64) -> Option<[f64; 2]> {
    let mut p = from;
    for _ in 0..STEPS {
        let contact = dropper.drop(p)?;
        let down = downhill(&contact)?;
        let slope = contact.normal.x.hypot(contact.normal.y) / contact.normal.z.max(LEVEL);
        let by = (contact.tip_mm - level_mm) / slope;
        if by.abs() < NEAR_MM {
            return Some(p);
        }
        p = [0, 1].map(|axis| p[axis] + by * down[axis]);
        if (p[0] - from[0]).hypot(p[1] - from[1]) > most_mm {
            return None;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::super::shape::Shape;
    use super::super::surface::Surface;
    use super::*;
    use crate::path::Vec3;
    use crate::stock::Mesh;

    /// Triangles over a square of 20 mm about the origin.
    fn sheet(cells: u32, z: impl Fn(f64, f64) -> f64) -> Surface {
        let at = |k: u32| -10.0 + 20.0 * f64::from(k) / f64::from(cells);
        let corner = |k: u32| {
            let (x, y) = (at(k % (cells + 1)), at(k / (cells + 1)));
            Vec3::new(x, y, z(x, y))
        };
        let cell = |k: u32| {
            let a = k % cells + k / cells * (cells + 1);
            let [b, c, d] = [a + 1, a + cells + 2, a + cells + 1];
            [[a, b, c], [a, c, d]]
        };
        let vertices = (0..(cells + 1) * (cells + 1)).map(corner).collect();
        Surface::of_mesh(&Mesh { vertices, triangles: (0..cells * cells).flat_map(cell).collect() }, 1.5, Vec::new())
    }

    /// Area to the left of a closed curve, mm²: positive where it runs counter-clockwise.
    fn area_mm2(curve: &Curve) -> f64 {
        let points = &curve.points;
        (0..points.len())
            .map(|k| (points[k], points[(k + 1) % points.len()]))
            .map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0]))
            .sum()
    }

    /// A cone of 45 degrees under a ball of 2 mm radius: the tip is r (√2 − 1) above the cone, and the level curve runs
    /// clockwise, with the top on its right; about a pit of the same form counter-clockwise. Facets of 0.1 mm lie
    /// within 0.1²/8 · √2 mm of a circle of 1 mm.
    #[test]
    fn a_cone_is_cut_in_one_circle_with_the_higher_ground_on_its_right() {
        let shape = Shape::ball(2.0);
        for up in [1.0, -1.0] {
            let cone = sheet(200, |x, y| -up * x.hypot(y));
            let dropper = Dropper::new(&cone, shape);
            let grid = Grid::new(&dropper, [-10.0; 2], [10.0; 2], 0.4);
            let mut curves = grid.curves(&dropper, -up * 5.0);
            // Others go round the sheet, where the tool comes off it.
            curves.retain(|curve| curve.points.iter().all(|p| p[0].abs() < 9.0 && p[1].abs() < 9.0));
            assert_eq!(curves.len(), 1, "{up}");
            assert!(curves[0].closed && area_mm2(&curves[0]) * up < 0.0, "{up}");
            let expected = 5.0 + up * 2.0 * (2f64.sqrt() - 1.0);
            for p in &curves[0].points {
                let found = p[0].hypot(p[1]);
                assert!((found - expected).abs() < 2e-3, "{up}: {found} {expected}");
            }
        }
    }

    /// A saddle: above it two curves, below it two others. A ridge that runs off the sheet: curves with ends.
    #[test]
    fn a_saddle_and_a_ridge_give_curves_apart() {
        let shape = Shape::ball(0.5);
        let saddle = sheet(100, |x, y| 0.05 * (x * x - y * y));
        let dropper = Dropper::new(&saddle, shape);
        let grid = Grid::new(&dropper, [-10.0; 2], [10.0; 2], 0.3);
        for (level, along) in [(1.0, 0), (-1.0, 1)] {
            let mut sides = [0, 0];
            for curve in grid.curves(&dropper, level) {
                let inside = |p: &[f64; 2]| p[0].abs() < 9.0 && p[1].abs() < 9.0;
                for two in curve.points.windows(2).filter(|two| two.iter().all(inside)) {
                    assert!(two[0][along].abs() > 3.0, "{level}: {two:?}");
                    assert!((two[1][0] - two[0][0]).hypot(two[1][1] - two[0][1]) < 0.43, "{level}: {two:?}");
                    sides[usize::from(two[0][along] > 0.0)] += 1;
                }
            }
            assert!(sides[0] > 20 && sides[1] > 20, "{level}: {sides:?}");
        }
        // A saddle exactly at the level counts as low ground.
        assert!(!grid.curves(&dropper, 0.0).is_empty());
    }

    #[test]
    fn a_place_beside_a_curve_is_brought_onto_it() {
        let cone = sheet(200, |x, y| -2.0 * x.hypot(y));
        let dropper = Dropper::new(&cone, Shape::ball(2.0));
        let level = dropper.drop([5.0, 0.0]).unwrap().tip_mm;
        let found = onto(&dropper, [4.0, 2.8], level, 0.5).unwrap();
        assert!((dropper.drop(found).unwrap().tip_mm - level).abs() < 1e-3, "{found:?}");
        assert!((found[0].hypot(found[1]) - 5.0).abs() < 1e-2, "{found:?}");
        assert!(onto(&dropper, [4.0, 0.0], level, 0.5).is_none());
        assert!(onto(&dropper, [40.0, 0.0], level, 0.5).is_none());
    }
}
