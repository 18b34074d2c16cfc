//! The surface to be finished, as triangles for the drop-cutter. In: the bytes of an STL file. Out: triangles, marks of
//! edges and corners on the rim of the machined area, notes on repairs; or an error.
//!
//! The surface may be open. Machined are the facets that face upwards and are no steeper than a limit; their rim is
//! where the surface ends or becomes steeper. A hole is an outline other than the longest: a ball of radius r would
//! sink into a hole of width w by r − √(r² − w²/4).

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
    /// Outlines where the surface ends, the longest first.
    pub outlines: Vec<Outline>,
    /// Smallest box that holds it, mm.
    pub extent: Box3,
    /// What was repaired, one sentence each.
    pub notes: Vec<String>,
}

/// A closed chain of edges that belong to one triangle only.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outline {
    /// Length, mm.
    pub length_mm: f64,
    /// Smallest box about it, mm.
    pub low: Vec3,
    /// Its other corner, mm.
    pub high: Vec3,
}

impl Outline {
    /// Its narrower side in the plane, mm.
    pub fn width_mm(&self) -> f64 {
        (self.high.x - self.low.x).min(self.high.y - self.low.y)
    }
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
        let (marks, outlines) = rims(mesh, &steep);
        Self { triangles, marks, outlines, extent: mesh.extent(), notes }
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
    pub fn holes(&self, shape: Shape, tolerance_mm: f64) -> Vec<Outline> {
        let sinks = |hole: &&Outline| {
            let half = 0.5 * hole.width_mm() - shape.flat_mm;
            half > 0.0 && shape.height(shape.flat_mm + half).is_none_or(|by_mm| by_mm > tolerance_mm)
        };
        // The longest outline is the border of the surface.
        self.outlines.iter().skip(1).filter(sinks).copied().collect()
    }

    /// Machined area seen from above, mm².
    pub fn machined_mm2(&self) -> f64 {
        self.machined().map(|across| 0.5 * across.z).sum()
    }

    /// Machined area, and the part of it whose slope is below an angle, mm².
    pub fn shallow_mm2(&self, below_rad: f64) -> [f64; 2] {
        let area = |across: Vec3| 0.5 * across.norm();
        let shallow = |across: &Vec3| across.z > below_rad.cos() * across.norm();
        // Folded from +0, as the sum of an empty iterator is −0.
        let sum = |areas: f64, across: Vec3| areas + area(across);
        [self.machined().fold(0.0, sum), self.machined().filter(shallow).fold(0.0, sum)]
    }

    /// For every machined facet a vector along its normal with twice its area, mm².
    fn machined(&self) -> impl Iterator<Item = Vec3> {
        let machined = self.triangles.iter().zip(&self.marks).filter(|(_, marks)| **marks & STEEP == 0);
        machined.map(|([a, b, c], _)| (b - a).cross(&(c - a)))
    }
}

/// Marks of the triangles, and the outlines of a mesh.
fn rims(mesh: &Mesh, steep: &[bool]) -> (Vec<u16>, Vec<Outline>) {
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
            open.push((group[0].0, group[0].1));
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
    (marks, outlines(mesh, &open))
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

/// Joins open edges that share a vertex to outlines, the longest first.
fn outlines(mesh: &Mesh, open: &[(u32, u32)]) -> Vec<Outline> {
    let mut beside: HashMap<u32, Vec<usize>> = HashMap::new();
    for (k, (a, b)) in open.iter().enumerate() {
        beside.entry(*a).or_default().push(k);
        beside.entry(*b).or_default().push(k);
    }
    let mut seen = vec![false; open.len()];
    let mut found = Vec::new();
    for start in 0..open.len() {
        let mut outline =
            Outline { length_mm: 0.0, low: Vec3::repeat(f64::INFINITY), high: Vec3::repeat(f64::NEG_INFINITY) };
        let mut stack = vec![start];
        while let Some(k) = stack.pop() {
            if std::mem::replace(&mut seen[k], true) {
                continue;
            }
            let ends = [open[k].0, open[k].1];
            let [a, b] = ends.map(|v| mesh.vertices[v as usize]);
            outline.length_mm += (b - a).norm();
            outline.low = outline.low.inf(&a).inf(&b);
            outline.high = outline.high.sup(&a).sup(&b);
            stack.extend(ends.iter().flat_map(|v| &beside[v]).filter(|k| !seen[**k]));
        }
        if outline.length_mm > 0.0 {
            found.push(outline);
        }
    }
    found.sort_by(|a, b| b.length_mm.total_cmp(&a.length_mm));
    found
}
