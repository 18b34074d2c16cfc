//! The surface to be finished, as triangles for the drop-cutter. In: the bytes of an STL file. Out: triangles, marks of
//! edges and corners on the rim of the machined area, notes on repairs; or an error.
//!
//! The surface may be open. Machined are the facets that face upwards and are no steeper than a limit; their rim is
//! where the surface ends or becomes steeper. An outline that runs clockwise about its facets, seen from above, is a hole: a ball of radius r
//! would sink into it by r − √(r² − w²/4), w the diameter of the largest circle within.

use super::shape::Shape;
use crate::machine::Box3;
use crate::path::Vec3;
use crate::stock::{Mesh, MeshError, mesh};
use std::collections::HashMap;

/// Mark of a triangle whose edge k lies on the rim, shifted left by k.
pub const RIM_EDGE: u16 = 1;
/// Mark of a triangle whose corner k lies on the rim, shifted left by k.
pub const RIM_CORNER: u16 = 8;
/// Mark of a triangle that is not machined: too steep, or facing downwards.
pub const STEEP: u16 = 64;
/// Mark of a triangle whose edge k needs no contact test, because it is concave or tested with the other triangle;
/// shifted left by k.
pub const HOLLOW: u16 = 128;

/// Least sine of the angle of a concave edge.
const OPENS: f64 = 1e-6;

/// A surface to be finished.
#[derive(Debug, Clone)]
pub struct Surface {
    /// Corners of the triangles, mm.
    pub triangles: Vec<[Vec3; 3]>,
    /// Marks of each.
    pub marks: Vec<u16>,
    /// Holes seen from above, the widest first; gaps without a width, as at a vertex on an edge, among them.
    pub holes: Vec<Hole>,
    /// Smallest box that holds it, mm.
    pub extent: Box3,
    /// What was repaired, one sentence each.
    pub notes: Vec<String>,
}

/// A gap with facets about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hole {
    /// Diameter of the largest circle within, mm.
    pub width_mm: f64,
    /// Its middle, mm.
    pub at: [f64; 2],
}

impl Surface {
    /// Reads a surface; `factor` converts its numbers to mm; facets steeper than `steepest_rad` are not machined.
    pub fn read(bytes: &[u8], factor: f64, steepest_rad: f64) -> Result<Self, MeshError> {
        let (mut mesh, notes) = mesh::read_surface(bytes)?;
        mesh.vertices.iter_mut().for_each(|p| *p *= factor);
        Ok(Self::of_mesh(&mesh, steepest_rad, notes))
    }

    /// The surface of a mesh.
    pub fn of_mesh(mesh: &Mesh, steepest_rad: f64, notes: Vec<String>) -> Self {
        let corner = |k: u32| mesh.vertices[k as usize];
        let triangles: Vec<[Vec3; 3]> = mesh.triangles.iter().map(|ids| ids.map(corner)).collect();
        let least = steepest_rad.cos();
        let machined = |[a, b, c]: &[Vec3; 3]| {
            let across = (b - a).cross(&(c - a));
            across.z >= least * across.norm()
        };
        let steep: Vec<bool> = triangles.iter().map(|triangle| !machined(triangle)).collect();
        let (marks, holes) = rims(mesh, &steep);
        Self { triangles, marks, holes, extent: mesh.extent(), notes }
    }

    /// The surface rotated about Z, counter-clockwise.
    #[must_use]
    pub fn turned(mut self, angle_rad: f64) -> Self {
        let (sin, cos) = angle_rad.sin_cos();
        let turn = |p: &mut Vec3| (p.x, p.y) = (cos * p.x - sin * p.y, sin * p.x + cos * p.y);
        self.triangles.iter_mut().flatten().for_each(turn);
        let start = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        let corners = self.triangles.iter().flatten();
        let (min, max) = corners.fold(start, |(low, high), p| (low.inf(p), high.sup(p)));
        self.extent = Box3 { min, max };
        self
    }

    /// Holes into which a tool sinks by more than `tolerance_mm`.
    pub fn sinks_into(&self, shape: Shape, tolerance_mm: f64) -> Vec<Hole> {
        let sinks = |hole: &&Hole| {
            let half = 0.5 * hole.width_mm - shape.flat_mm;
            half > 0.0 && shape.height(shape.flat_mm + half).is_none_or(|by_mm| by_mm > tolerance_mm)
        };
        self.holes.iter().filter(sinks).copied().collect()
    }

    /// Machined area seen from above, mm².
    pub fn machined_mm2(&self) -> f64 {
        self.machined().map(|(_, across)| 0.5 * across.z).sum()
    }

    /// Machined area, and the part of it whose slope is below an angle, mm².
    pub fn shallow_mm2(&self, below_rad: f64) -> [f64; 2] {
        let area = |across: Vec3| 0.5 * across.norm();
        let shallow = |across: &Vec3| across.z > below_rad.cos() * across.norm();
        // Folded from +0, as the sum of an empty iterator is −0.
        let sum = |areas: f64, across: Vec3| areas + area(across);
        let machined = || self.machined().map(|(_, across)| across);
        [machined().fold(0.0, sum), machined().filter(shallow).fold(0.0, sum)]
    }

    /// Every machined facet with an area: its number, and a vector along its normal with twice its area, mm².
    pub fn machined(&self) -> impl Iterator<Item = (u32, Vec3)> {
        let machined = (0u32..).zip(&self.triangles).zip(&self.marks).filter(|(_, marks)| **marks & STEEP == 0);
        let across = machined.map(|((k, [a, b, c]), _)| (k, (b - a).cross(&(c - a))));
        across.filter(|(_, across)| across.norm_squared() > 0.0)
    }
}

/// Marks of the triangles, and the holes of a mesh.
fn rims(mesh: &Mesh, steep: &[bool]) -> (Vec<u16>, Vec<Hole>) {
    let mut edges: Vec<(u32, u32, u32, u8)> = Vec::with_capacity(3 * mesh.triangles.len());
    for (index, ids) in mesh.triangles.iter().enumerate() {
        for k in 0..3u8 {
            let (a, b) = (ids[k as usize], ids[(k as usize + 1) % 3]);
            edges.push((a.min(b), a.max(b), index as u32, k));
        }
    }
    edges.sort_unstable();
    let mut marks: Vec<u16> = steep.iter().map(|steep| if *steep { STEEP } else { 0 }).collect();
    let mut on_rim = vec![false; mesh.vertices.len()];
    let mut open = Vec::new();
    for group in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let machined = group.iter().filter(|edge| !steep[edge.2 as usize]).count();
        if group.len() == 1 {
            // In the direction in which it runs about its triangle.
            let (ids, k) = (mesh.triangles[group[0].2 as usize], usize::from(group[0].3));
            open.push((ids[k], ids[(k + 1) % 3]));
        }
        if let [a, b] = group {
            let shared = [a, b].map(|edge| (mesh.triangles[edge.2 as usize], edge.3));
            if opens_upwards(mesh, shared) {
                marks[a.2 as usize] |= HOLLOW << a.3;
            }
            marks[b.2 as usize] |= HOLLOW << b.3;
        }
        if machined == 1 {
            for edge in group {
                marks[edge.2 as usize] |= RIM_EDGE << edge.3;
            }
            on_rim[group[0].0 as usize] = true;
            on_rim[group[0].1 as usize] = true;
        }
    }
    for (marks, ids) in marks.iter_mut().zip(&mesh.triangles) {
        for k in 0..3 {
            *marks |= if on_rim[ids[k] as usize] { RIM_CORNER << k } else { 0 };
        }
    }
    (marks, holes(mesh, &open))
}

/// Is an edge shared by two triangles concave seen from above? A tool then touches the triangles rather than the edge.
fn opens_upwards(mesh: &Mesh, [one, other]: [([u32; 3], u8); 2]) -> bool {
    let corner = |ids: [u32; 3], k: u8| mesh.vertices[ids[usize::from(k) % 3] as usize];
    let apex = |(ids, k): ([u32; 3], u8)| corner(ids, k + 2);
    let (a, b, c, d) = (corner(one.0, one.1), corner(one.0, one.1 + 1), apex(one), apex(other));
    let across = (b - a).cross(&(c - a));
    let up = if across.z < 0.0 { -across } else { across };
    // The triangles lie on opposite sides of the edge seen from above, and the other one is above the plane of this
    // one.
    let side = |q: Vec3| (b.x - a.x) * (q.y - a.y) - (b.y - a.y) * (q.x - a.x);
    let above = up.dot(&(d - a));
    side(c) * side(d) < 0.0 && above > OPENS * up.norm() * (d - a).norm()
}

/// Open edges that share a vertex form an outline; those that enclose no area counter-clockwise are holes, the widest first.
fn holes(mesh: &Mesh, open: &[(u32, u32)]) -> Vec<Hole> {
    let mut beside: HashMap<u32, Vec<usize>> = HashMap::new();
    for (k, (a, b)) in open.iter().enumerate() {
        beside.entry(*a).or_default().push(k);
        beside.entry(*b).or_default().push(k);
    }
    let mut seen = vec![false; open.len()];
    let mut found: Vec<Hole> = Vec::new();
    for start in 0..open.len() {
        let (mut outline, mut stack) = (Vec::new(), vec![start]);
        while let Some(k) = stack.pop() {
            if std::mem::replace(&mut seen[k], true) {
                continue;
            }
            let ends = [open[k].0, open[k].1];
            outline.push(ends.map(|v| mesh.vertices[v as usize].xy().into()));
            stack.extend(ends.iter().flat_map(|v| &beside[v]).filter(|k| !seen[**k]));
        }
        if !outline.is_empty() {
            found.extend(hole(&outline));
        }
    }
    found.sort_by(|a, b| b.width_mm.total_cmp(&a.width_mm));
    found
}

/// Edge of an outline seen from above, with its facet on the left, mm.
type Edge = [[f64; 2]; 2];

/// Area over the square of the size from which an outline encloses something: coordinates in single precision.
const ENCLOSES: f64 = 1e-6;
/// Part of the size of a hole to which its width is found.
const WIDTH: f64 = 1e-3;

/// The hole within an outline; `None` if it is a border of the surface.
fn hole(outline: &[Edge]) -> Option<Hole> {
    let corners = || outline.iter().map(|edge| edge[0]);
    let start = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let (low, high) =
        corners().fold(start, |(low, high), p| ([0, 1].map(|k| p[k].min(low[k])), [0, 1].map(|k| p[k].max(high[k]))));
    let (middle, size) = ([0, 1].map(|k| 0.5 * (low[k] + high[k])), (high[0] - low[0]).max(high[1] - low[1]));
    let turned = |[a, b]: &Edge| (a[0] - middle[0]) * (b[1] - middle[1]) - (b[0] - middle[0]) * (a[1] - middle[1]);
    let area = 0.5 * outline.iter().map(turned).sum::<f64>();
    if area > ENCLOSES * size * size {
        return None;
    }
    // The farthest place from the outline, in cells that are quartered while they may hold a farther one.
    let (mut best, mut at, mut cells) = (0.0, middle, vec![(middle, 0.5 * size)]);
    while let Some((p, half)) = cells.pop() {
        let inside_mm = inside_mm(outline, p);
        if inside_mm > best {
            (best, at) = (inside_mm, p);
        }
        if inside_mm + half * std::f64::consts::SQRT_2 > best + WIDTH * size {
            let half = 0.5 * half;
            cells.extend(
                [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
                    .map(|[x, y]| ([p[0] + x * half, p[1] + y * half], half)),
            );
        }
    }
    Some(Hole { width_mm: 2.0 * best, at })
}

/// Distance of a place from an outline, mm, negative outside.
fn inside_mm(outline: &[Edge], p: [f64; 2]) -> f64 {
    let (mut nearest, mut inside) = (f64::INFINITY, false);
    for [a, b] in outline {
        let [[ax, ay], [bx, by]] = [a, b].map(|q| [q[0] - p[0], q[1] - p[1]]);
        let (x, y) = (bx - ax, by - ay);
        let t = (-(ax * x + ay * y) / (x * x + y * y).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        nearest = f64::min(nearest, (ax + t * x).hypot(ay + t * y));
        // Edges that a ray along +X crosses.
        inside ^= (ay > 0.0) != (by > 0.0) && ax - ay * x / y > 0.0;
    }
    if inside { nearest } else { -nearest }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet of squares of 1 mm, without those that are left out.
    fn sheet(cells: [u32; 2], out: impl Fn(u32, u32) -> bool) -> Mesh {
        let wide = cells[0] + 1;
        let vertices = (0..wide * (cells[1] + 1)).map(|k| Vec3::new(f64::from(k % wide), f64::from(k / wide), 0.0));
        let squares = (0..cells[0] * cells[1]).map(|k| [k % cells[0], k / cells[0]]).filter(|[i, j]| !out(*i, *j));
        let triangles = squares.flat_map(|[i, j]| {
            let a = i + j * wide;
            [[a, a + 1, a + wide + 1], [a, a + wide + 1, a + wide]]
        });
        Mesh { vertices: vertices.collect(), triangles: triangles.collect() }
    }

    fn widths_mm(mesh: &Mesh) -> Vec<f64> {
        Surface::of_mesh(mesh, 1.4, Vec::new()).holes.iter().map(|hole| hole.width_mm).collect()
    }

    /// The border of each sheet is none; a square of 2 mm has a circle of 2 mm within, a slot its width.
    #[test]
    fn holes_are_outlines_that_run_clockwise() {
        assert!(widths_mm(&sheet([9, 4], |i, _| i == 4)).is_empty());
        let square = |i: u32, j: u32| (2..4).contains(&i) && (2..4).contains(&j);
        let slot = |i: u32, j: u32| (6..7).contains(&i) && (1..6).contains(&j);
        let found = widths_mm(&sheet([9, 7], |i, j| square(i, j) || slot(i, j)));
        assert!(found.len() == 2 && (found[0] - 2.0).abs() < 0.01 && (found[1] - 1.0).abs() < 0.02, "{found:?}");
    }

    /// A vertex in the middle of a long edge leaves a gap without a width.
    #[test]
    fn a_crack_has_no_width() {
        let at = |x: f64, y: f64| Vec3::new(x, y, 0.0);
        let vertices = vec![at(0.0, 0.0), at(8.0, 0.0), at(8.0, 8.0), at(0.0, 8.0), at(4.0, 4.0), at(4.0, 9.0)];
        let triangles = vec![[0, 1, 2], [0, 4, 3], [4, 2, 3], [2, 5, 3]];
        let found = widths_mm(&Mesh { vertices, triangles });
        assert!(found.is_empty() || found.iter().all(|width| *width < 1e-9), "{found:?}");
    }
}
