//! A closed triangle mesh as stock. In: the bytes of an STL file, binary or text. Out: a checked [`Mesh`] with what was
//! repaired, and its heights over a grid.
//!
//! A mesh is accepted if every edge joins two triangles. Repaired, with a note: vertices that differ by rounding, triangles without area or
//! given twice, single missing triangles, triangles that face the wrong way. Refused: larger holes, and edges that join more than two
//! triangles. Heights come from vertical rays through the middles of the cells. The highest crossing counts, so cavities and overhangs are
//! filled, with a note; this is safe, because it means more stock, not less.

use super::blank::Relief;
use super::field::{Field, cells};
use crate::machine::Box3;
use crate::path::Vec3;
use std::collections::HashMap;

/// Vertices closer than this part of the size of the mesh are one, when exact comparison leaves gaps.
const WELD: f64 = 1e-6;

/// By how much the cells in which the walls of a mesh are looked up are finer than those of the field: cells of 0.33 mm then show a wall to
/// 0.04 mm, a fifth of a usual finishing allowance.
const FINER: i32 = 8;
/// Most of these cells: 16 MB.
const MOST_CELLS: usize = 1 << 22;

/// Triangles over shared vertices.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// Vertices, mm.
    pub vertices: Vec<Vec3>,
    /// Triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// Why a mesh is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// Not an STL file.
    #[error("it is no STL file: {0}")]
    NotStl(&'static str),
    /// It has no triangles.
    #[error("it has no triangles with an area")]
    Empty,
    /// It is not closed.
    #[error("it is not closed: {open} edges belong to one triangle only, the first at ({:.3}, {:.3}, {:.3}); close the holes in the CAD system", at[0], at[1], at[2])]
    Open {
        /// Open edges.
        open: usize,
        /// Where the first one is.
        at: [f64; 3],
    },
    /// An edge joins more than two triangles.
    #[error("{edges} edges join more than two triangles, the first at ({:.3}, {:.3}, {:.3}): bodies touch or overlap; unite them in the CAD system", at[0], at[1], at[2])]
    Branching {
        /// Such edges.
        edges: usize,
        /// Where the first one is.
        at: [f64; 3],
    },
    /// Inside and outside cannot be told apart.
    #[error(
        "it cuts through itself: over {cells} cells inside and outside cannot be told apart; repair it in the CAD system"
    )]
    SelfIntersecting {
        /// Cells with contradictory crossings.
        cells: usize,
    },
}

/// Reads and checks a mesh; the notes say what was repaired.
pub fn read_stl(bytes: &[u8]) -> Result<(Mesh, Vec<String>), MeshError> {
    let corners = corners(bytes)?;
    let mut notes = Vec::new();
    let mut mesh = weld(&corners, 0.0);
    if has_gaps(&mesh) {
        let (low, high) = bounds(corners.iter().copied());
        let welded = weld(&corners, WELD * (high - low).norm());
        let merged = mesh.vertices.len().saturating_sub(welded.vertices.len());
        if merged > 0 {
            notes.push(format!("{merged} vertices that differ by rounding were joined"));
            mesh = welded;
        }
    }
    clean(&mut mesh, &mut notes);
    if mesh.triangles.is_empty() {
        return Err(MeshError::Empty);
    }
    orient(&mut mesh, &mut notes)?;
    close(&mut mesh, &mut notes)?;
    outward(&mut mesh, &mut notes);
    Ok((mesh, notes))
}

/// Reads a mesh as a surface, which need not be closed; it looks up. The notes say what was repaired.
pub fn read_surface(bytes: &[u8]) -> Result<(Mesh, Vec<String>), MeshError> {
    let mut notes = Vec::new();
    let mut mesh = weld(&corners(bytes)?, 0.0);
    clean(&mut mesh, &mut notes);
    if mesh.triangles.is_empty() {
        return Err(MeshError::Empty);
    }
    orient(&mut mesh, &mut notes)?;
    if is_sheet(&mesh) {
        if facing(&mesh)[0] < 0.0 {
            mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
            notes.push("the surface looked down and was turned".into());
        }
    } else {
        outward(&mut mesh, &mut notes);
    }
    Ok((mesh, notes))
}

/// Share of its area seen from above by which a sheet faces one way: 1 without folds; of a closed solid half of it faces either way, and a
/// missing facet changes little.
const ONE_WAY: f64 = 0.5;

/// Is it a sheet, so that the way it faces says what is above it, and not the volume that it encloses?
fn is_sheet(mesh: &Mesh) -> bool {
    let [sum, all] = facing(mesh);
    sum.abs() > ONE_WAY * all
}

/// Twice the area seen from above: with its sign, positive where it faces up; and without, mm².
fn facing(mesh: &Mesh) -> [f64; 2] {
    let level = |[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [*a, *b, *c].map(|k| mesh.vertices[k as usize]);
        (b - a).cross(&(c - a)).z
    };
    mesh.triangles.iter().map(level).fold([0.0, 0.0], |[sum, all], z| [sum + z, all + z.abs()])
}

/// Corners of all triangles, three a triangle.
fn corners(bytes: &[u8]) -> Result<Vec<Vec3>, MeshError> {
    let count = bytes.get(80..84).map(|n| u32::from_le_bytes([n[0], n[1], n[2], n[3]]) as usize);
    if let Some(count) = count.filter(|count| bytes.len() == 84 + 50 * count) {
        let mut corners = Vec::with_capacity(3 * count);
        for record in bytes[84..].chunks_exact(50) {
            for corner in record[12..48].chunks_exact(12) {
                let at =
                    |k: usize| f64::from(f32::from_le_bytes([corner[k], corner[k + 1], corner[k + 2], corner[k + 3]]));
                corners.push(finite(Vec3::new(at(0), at(4), at(8)))?);
            }
        }
        return Ok(corners);
    }
    // Names in text files are in any encoding; bytes of value 0 are in binary ones only.
    if bytes.contains(&0) {
        return Err(MeshError::NotStl("the length does not fit its triangle count"));
    }
    corners_of_text(&String::from_utf8_lossy(bytes))
}

/// Corners of a text STL: facets of three vertices each, between `solid` and `endsolid`, in small or capital letters. What stands behind these two on
/// their lines is a name.
fn corners_of_text(text: &str) -> Result<Vec<Vec3>, MeshError> {
    let is = |word: &str, other: &str| word.eq_ignore_ascii_case(other);
    let text = text.trim_start_matches('\u{feff}').trim_start();
    if !text.get(..5).is_some_and(|word| is(word, "solid")) {
        return Err(MeshError::NotStl("it neither is binary nor begins with `solid`"));
    }
    let without_name = |line| {
        let words = str::split_ascii_whitespace(line);
        let named = words.clone().next().is_some_and(|word| is(word, "solid") || is(word, "endsolid"));
        words.take(if named { 1 } else { usize::MAX })
    };
    let mut words = text.lines().flat_map(without_name);
    let (mut corners, mut facets, mut ended) = (Vec::new(), 0, false);
    while let Some(word) = words.next() {
        if is(word, "vertex") {
            let mut number = || words.next().and_then(|word| word.parse::<f64>().ok());
            let (Some(x), Some(y), Some(z)) = (number(), number(), number()) else {
                return Err(MeshError::NotStl("a vertex without three numbers"));
            };
            corners.push(finite(Vec3::new(x, y, z))?);
            continue;
        }
        let begins = is(word, "facet");
        ended = if is(word, "endsolid") { true } else { ended && !(begins || is(word, "solid")) };
        if (begins || is(word, "endfacet") || ended) && corners.len() != 3 * facets {
            return Err(MeshError::NotStl("a facet that has not three vertices"));
        }
        facets += usize::from(begins);
    }
    if ended {
        Ok(corners)
    } else {
        Err(MeshError::NotStl("it ends without `endsolid`, so that some of it may be missing"))
    }
}

fn finite(p: Vec3) -> Result<Vec3, MeshError> {
    if p.iter().all(|x| x.is_finite()) { Ok(p) } else { Err(MeshError::NotStl("a coordinate that is no number")) }
}

fn bounds(points: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    let start = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    points.fold(start, |(low, high), p| (low.inf(&p), high.sup(&p)))
}

/// Shares equal vertices; `tolerance` 0 compares exactly.
fn weld(corners: &[Vec3], tolerance: f64) -> Mesh {
    let mut known: HashMap<[i64; 3], u32> = HashMap::with_capacity(corners.len() / 4);
    let mut mesh = Mesh { vertices: Vec::new(), triangles: Vec::with_capacity(corners.len() / 3) };
    let place = |x: f64| {
        if tolerance > 0.0 { (x / tolerance).round() as i64 } else { (x + 0.0).to_bits() as i64 }
    };
    for triangle in corners.chunks_exact(3) {
        let ids = [0, 1, 2].map(|k| {
            let p = triangle[k];
            *known.entry([place(p.x), place(p.y), place(p.z)]).or_insert_with(|| {
                mesh.vertices.push(p);
                (mesh.vertices.len() - 1) as u32
            })
        });
        mesh.triangles.push(ids);
    }
    mesh
}

/// Height of a triangle over its longest side below which it has no area: rounding of coordinates in single precision.
const FLAT: f64 = 1e-6;

/// Has a triangle no area: two equal corners, or three on one line?
fn is_flat(vertices: &[Vec3], triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|k| vertices[k as usize]);
    let longest = [b - a, c - b, a - c].map(|side| side.norm_squared()).into_iter().fold(0.0, f64::max);
    (b - a).cross(&(c - a)).norm() <= FLAT * longest
}

/// Takes out triangles without area and triangles given twice. One whose corners lie on a line stays if it joins others at a vertex on their
/// edge, and goes if it lies beside two that share an edge anyway.
fn clean(mesh: &mut Mesh, notes: &mut Vec<String>) {
    let before = mesh.triangles.len();
    mesh.triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    let mut flat = before - mesh.triangles.len();
    let mut seen = std::collections::HashSet::with_capacity(mesh.triangles.len());
    mesh.triangles.retain(|triangle| {
        let mut sorted = *triangle;
        sorted.sort_unstable();
        seen.insert(sorted)
    });
    let double = before - flat - mesh.triangles.len();
    flat += leave_out_idle(mesh);
    for (n, what) in [(flat, "without an area"), (double, "given twice")] {
        if n > 0 {
            notes.push(format!("{n} triangles {what} were left out"));
        }
    }
}

/// Takes out triangles without area at edges that join more than two; how many.
fn leave_out_idle(mesh: &mut Mesh) -> usize {
    let edges = half_edges(mesh);
    let crowded = edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).filter(|group| group.len() > 2).flatten();
    let is_idle = |index: &u32| is_flat(&mesh.vertices, mesh.triangles[*index as usize]);
    let idle: std::collections::HashSet<u32> = crowded.map(|edge| edge.2).filter(is_idle).collect();
    let mut index = 0;
    mesh.triangles.retain(|_| {
        index += 1;
        !idle.contains(&(index - 1))
    });
    idle.len()
}

/// Half edges (low vertex, high vertex) sorted, each with its triangle and whether it runs upward in it.
fn half_edges(mesh: &Mesh) -> Vec<(u32, u32, u32, bool)> {
    let mut edges = Vec::with_capacity(3 * mesh.triangles.len());
    for (index, [a, b, c]) in mesh.triangles.iter().enumerate() {
        for (from, to) in [(*a, *b), (*b, *c), (*c, *a)] {
            edges.push((from.min(to), from.max(to), index as u32, from < to));
        }
    }
    edges.sort_unstable();
    edges
}

/// Edges that belong to one triangle only, in the direction that a filling triangle must run.
fn open_edges(mesh: &Mesh) -> Vec<(u32, u32)> {
    let edges = half_edges(mesh);
    let alone = edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).filter(|group| group.len() == 1);
    alone.map(|group| if group[0].3 { (group[0].1, group[0].0) } else { (group[0].0, group[0].1) }).collect()
}

/// Would it be open as it is?
fn has_gaps(mesh: &Mesh) -> bool {
    let mut cleaned = mesh.clone();
    clean(&mut cleaned, &mut Vec::new());
    !open_edges(&cleaned).is_empty()
}

/// Turns triangles so that neighbours agree.
fn orient(mesh: &mut Mesh, notes: &mut Vec<String>) -> Result<(), MeshError> {
    let edges = half_edges(mesh);
    let mut branching = Vec::new();
    // Neighbours of each triangle: (other, do they agree).
    let mut neighbours: Vec<[(u32, bool); 3]> = vec![[(u32::MAX, true); 3]; mesh.triangles.len()];
    let mut put = |triangle: u32, other: u32, agree: bool| {
        if let Some(slot) = neighbours[triangle as usize].iter_mut().find(|slot| slot.0 == u32::MAX) {
            *slot = (other, agree);
        }
    };
    for group in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        match group {
            [a, b] => {
                put(a.2, b.2, a.3 != b.3);
                put(b.2, a.2, a.3 != b.3);
            }
            [_] => {}
            _ => branching.push(group[0].0),
        }
    }
    if let Some(first) = branching.first() {
        let at = mesh.vertices[*first as usize].into();
        return Err(MeshError::Branching { edges: branching.len(), at });
    }
    let mut turned: Vec<Option<bool>> = vec![None; mesh.triangles.len()];
    let mut stack = Vec::new();
    let mut contradictions = 0;
    for start in 0..mesh.triangles.len() {
        if turned[start].is_some() {
            continue;
        }
        turned[start] = Some(false);
        let mut shell = vec![start];
        stack.push(start);
        while let Some(at) = stack.pop() {
            let here = turned[at].unwrap_or(false);
            for (other, agree) in neighbours[at].iter().filter(|(other, _)| *other != u32::MAX) {
                let wanted = here == *agree;
                match turned[*other as usize] {
                    None => {
                        turned[*other as usize] = Some(wanted);
                        shell.push(*other as usize);
                        stack.push(*other as usize);
                    }
                    Some(is) => contradictions += usize::from(is != wanted),
                }
            }
        }
        // The smaller part is the one that was wrong.
        let flipped = shell.iter().filter(|k| turned[**k] == Some(true)).count();
        if 2 * flipped > shell.len() {
            for k in &shell {
                turned[*k] = turned[*k].map(|turn| !turn);
            }
        }
    }
    if contradictions > 0 {
        return Err(MeshError::SelfIntersecting { cells: contradictions });
    }
    let mut count = 0;
    for (triangle, turn) in mesh.triangles.iter_mut().zip(&turned) {
        if *turn == Some(true) {
            triangle.swap(1, 2);
            count += 1;
        }
    }
    if count > 0 {
        notes.push(format!("{count} triangles that faced the wrong way were turned"));
    }
    Ok(())
}

/// Fills holes of a single missing triangle; refuses larger ones.
fn close(mesh: &mut Mesh, notes: &mut Vec<String>) -> Result<(), MeshError> {
    let open = open_edges(mesh);
    if open.is_empty() {
        return Ok(());
    }
    let next: HashMap<u32, u32> = open.iter().copied().collect();
    let mut filled = 0;
    for (a, b) in &open {
        let third = next.get(b).copied();
        let Some(c) = third.filter(|c| next.get(c) == Some(a)) else { continue };
        if a < b && *a < c {
            mesh.triangles.push([*a, *b, c]);
            filled += 1;
        }
    }
    if filled > 0 {
        notes.push(format!("{filled} missing triangles were put in"));
    }
    let open = open_edges(mesh);
    match open.first() {
        None => Ok(()),
        Some((a, _)) => Err(MeshError::Open { open: open.len(), at: mesh.vertices[*a as usize].into() }),
    }
}

/// Turns the whole mesh when its volume comes out negative.
fn outward(mesh: &mut Mesh, notes: &mut Vec<String>) {
    if mesh.volume() < 0.0 {
        mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        notes.push("all triangles faced inward and were turned".into());
    }
}

impl Mesh {
    /// Volume, mm³.
    pub fn volume(&self) -> f64 {
        // About the middle, so that a small gap changes little wherever the mesh lies.
        let Box3 { min, max } = self.extent();
        let at = |k: u32| self.vertices[k as usize] - 0.5 * (min + max);
        self.triangles.iter().map(|[a, b, c]| at(*a).dot(&at(*b).cross(&at(*c)))).sum::<f64>() / 6.0
    }
    /// Smallest box that holds it.
    pub fn extent(&self) -> Box3 {
        let (min, max) = bounds(self.vertices.iter().copied());
        Box3 { min, max }
    }
    /// The mesh shifted.
    pub fn shifted(mut self, by: Vec3) -> Self {
        self.vertices.iter_mut().for_each(|p| *p += by);
        self
    }
    /// Heights over cells of at most `cell_mm`.
    pub fn field(&self, cell_mm: f64, notes: &mut Vec<String>) -> Result<Field, MeshError> {
        let extent = self.extent();
        let size = cells(&extent, cell_mm);
        let rays = self.rays(&extent, size);
        let crossed: Vec<&Ray> = rays.iter().filter(|ray| ray.crossings > 0).collect();
        let wrong = crossed.iter().filter(|ray| ray.balance != 0 || !ray.top_faces_up).count();
        if wrong > 0 {
            return Err(MeshError::SelfIntersecting { cells: wrong });
        }
        let hollow = crossed.iter().filter(|ray| ray.crossings > 2).count();
        let raised = crossed.iter().filter(|ray| f64::from(ray.bottom) > extent.min.z + 1e-3).count();
        for (n, what) in [(hollow, "cavities or overhangs"), (raised, "room under the stock")] {
            if n > 0 {
                notes.push(format!("{what} over {n} of {} cells are taken as filled", crossed.len()));
            }
        }
        let cell = [0, 1].map(|axis| (extent.max[axis] - extent.min[axis]) / size[axis] as f64);
        Ok(Field::new(extent, cell_mm, |x, y| {
            let index = |axis: usize, at: f64| (((at - extent.min[axis]) / cell[axis]) as usize).min(size[axis] - 1);
            f64::from(rays[index(1, y) * size[0] + index(0, x)].top)
        }))
    }
    /// Its heights in cells finer than `cell_mm`, so that its walls stand where they are, or just outside: [`FINER`] times, or as far as [`MOST_CELLS`] go.
    pub fn relief(&self, cell_mm: f64) -> Relief {
        let extent = self.extent();
        let count = |size: [usize; 2]| size[0].saturating_mul(size[1]);
        let sizes = (0..).map(|halvings: i32| (halvings, cells(&extent, cell_mm * 0.5f64.powi(halvings))));
        let fits = |(halvings, size): &(i32, [usize; 2])| {
            *halvings == 0 || (count(*size) <= MOST_CELLS && 1 << halvings <= FINER)
        };
        let (_, size) = sizes.take_while(fits).last().unwrap_or((0, [1, 1]));
        let heights = self.rays(&extent, size).iter().map(|ray| ray.top.max(extent.min.z as f32)).collect();
        Relief::from_rows(extent, size, heights).with_walls()
    }
    /// The crossings of a vertical ray through the middle of each cell.
    fn rays(&self, extent: &Box3, size: [usize; 2]) -> Vec<Ray> {
        let cell = [0, 1].map(|axis| (extent.max[axis] - extent.min[axis]) / size[axis] as f64);
        // A hair beside the middle, so that no ray runs through an edge of a mesh drawn on a round grid.
        let first = [0, 1].map(|axis| extent.min[axis] + (0.5 + [1.37e-5, 2.11e-5][axis]) * cell[axis]);
        let mut rays = vec![Ray::default(); size[0] * size[1]];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|k| self.vertices[k as usize]);
            let double = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
            if double == 0.0 {
                continue;
            }
            let range = |axis: usize| {
                let (low, high) = (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
                let begin = ((low - first[axis]) / cell[axis]).ceil().max(0.0) as usize;
                let end = ((high - first[axis]) / cell[axis]).floor() + 1.0;
                begin..end.clamp(0.0, size[axis] as f64) as usize
            };
            for j in range(1) {
                let y = first[1] + j as f64 * cell[1];
                for i in range(0) {
                    let x = first[0] + i as f64 * cell[0];
                    let u = ((b.x - x) * (c.y - y) - (c.x - x) * (b.y - y)) / double;
                    let v = ((c.x - x) * (a.y - y) - (a.x - x) * (c.y - y)) / double;
                    if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
                        let z = u * a.z + v * b.z + (1.0 - u - v) * c.z;
                        rays[j * size[0] + i].cross(z as f32, double > 0.0);
                    }
                }
            }
        }
        rays
    }
}

#[derive(Debug, Clone, Copy)]
struct Ray {
    top: f32,
    bottom: f32,
    crossings: u16,
    balance: i16,
    top_faces_up: bool,
}

impl Default for Ray {
    fn default() -> Self {
        Self { top: f32::NEG_INFINITY, bottom: f32::INFINITY, crossings: 0, balance: 0, top_faces_up: true }
    }
}

impl Ray {
    fn cross(&mut self, z: f32, up: bool) {
        self.crossings = self.crossings.saturating_add(1);
        self.balance += if up { 1 } else { -1 };
        if z > self.top || (z == self.top && up) {
            self.top = z;
            self.top_faces_up = up;
        }
        self.bottom = self.bottom.min(z);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box of 4 × 4 × 2 mm beside the origin, each side of two triangles, as corners.
    fn corners_of_a_box() -> Vec<[Vec3; 3]> {
        let at = |k: u32| {
            let bit = |n: u32| f64::from(k >> n & 1);
            Vec3::new(10.0 + 4.0 * bit(0), 20.0 + 4.0 * bit(1), 2.0 * bit(2))
        };
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]];
        sides.iter().flat_map(|[a, b, c, d]| [[at(*a), at(*b), at(*c)], [at(*a), at(*c), at(*d)]]).collect()
    }

    fn surface(triangles: &[[Vec3; 3]]) -> Result<(Mesh, Vec<String>), MeshError> {
        let vertex = |p: &Vec3| format!("vertex {} {} {}\n", p.x, p.y, p.z);
        let facet = |t: &[Vec3; 3]| format!("facet\n{}endfacet\n", t.iter().map(vertex).collect::<Vec<_>>().concat());
        let text = format!("solid\n{}endsolid\n", triangles.iter().map(facet).collect::<Vec<_>>().concat());
        read_surface(text.as_bytes())
    }

    /// Names say nothing and are in any encoding, letters are large or small; a facet has three vertices, and a file that was cut off anywhere is refused.
    #[test]
    fn a_text_file_is_read_whole_or_not_at_all() {
        let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
        let read = |text: &str| corners(text.as_bytes()).map(|corners| corners.len());
        let whole = format!("solid a vertex\n{facet}{facet}endsolid a vertex\n");
        assert_eq!(read(&whole), Ok(6));
        assert_eq!(read(&format!("\u{feff}{}", whole.to_uppercase())), Ok(6));
        assert_eq!(read(&[whole.as_str(), whole.as_str()].concat()), Ok(12));
        let latin = [b"solid Geh\xe4use\n", facet.as_bytes(), b"endsolid Geh\xe4use\n"].concat();
        assert_eq!(corners(&latin).map(|corners| corners.len()), Ok(3));
        let end = whole.find("endsolid").unwrap();
        for cut in 0..end {
            assert!(read(&whole[..cut]).is_err(), "{}", &whole[..cut]);
        }
        assert!(read(&format!("{}endsolid\n", &whole[..end - 30])).is_err());
        for count in [2, 4] {
            let lines = "vertex 0 0 0\n".repeat(count);
            let other = format!("solid\nfacet\n{lines}endfacet\n{facet}endsolid\n");
            assert!(read(&other).unwrap_err().to_string().contains("three vertices"), "{other}");
        }
    }

    /// A vertex on an edge, or a missing facet, wherever it is: the outside stays outside, and a solid that is inside out is turned.
    #[test]
    fn a_solid_with_a_gap_is_not_turned_inside_out() {
        let whole = corners_of_a_box();
        for k in 0..whole.len() {
            let mut gap = whole.clone();
            let [a, b, c] = gap.remove(k);
            let mut split = gap.clone();
            let middle = 0.5 * (a + b);
            split.extend([[a, middle, c], [middle, b, c]]);
            for mesh in [gap, split] {
                let (found, notes) = surface(&mesh).unwrap();
                assert!(found.volume() > 20.0 && notes.is_empty(), "{k}: {} {notes:?}", found.volume());
                let turned: Vec<[Vec3; 3]> = mesh.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
                let (found, notes) = surface(&turned).unwrap();
                assert!(found.volume() > 20.0 && notes[0].contains("inward"), "{k}: {notes:?}");
            }
        }
    }

    #[test]
    fn a_sheet_looks_up_though_it_is_closed_on_no_side() {
        let top = [corners_of_a_box()[2], corners_of_a_box()[3]];
        assert!(surface(&top).unwrap().1.is_empty());
        let down = top.map(|[a, b, c]| [a, c, b]);
        assert!(surface(&down).unwrap().1[0].contains("looked down"));
    }

    /// Three corners on an edge that two triangles share already are left out; where they close a gap they stay.
    #[test]
    fn a_facet_on_a_line_does_not_make_bodies_touch() {
        let mut mesh = corners_of_a_box();
        let [a, b, _] = mesh[0];
        mesh.push([a, 0.5 * (a + b), b]);
        let (found, notes) = surface(&mesh).unwrap();
        assert!(found.triangles.len() == 12 && notes[0].contains("without an area"), "{notes:?}");
        let [a, b, c] = mesh[0];
        let middle = 0.5 * (a + b);
        mesh[0] = [a, middle, c];
        mesh[12] = [middle, b, c];
        mesh.push([a, b, middle]);
        let (found, notes) = surface(&mesh).unwrap();
        assert!(found.triangles.len() == 14 && notes.is_empty(), "{} {notes:?}", found.triangles.len());
    }
}
