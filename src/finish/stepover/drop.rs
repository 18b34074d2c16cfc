//! Drop-cutter: lowers a tool along its axis until it touches a mesh. In: triangles, tool shape, places in XY. Out:
//! height of the tip, with the point of contact.
//!
//! The triangles form a tree of nodes with four children or, in its leaves, four triangles; each of these has an upper bound of the tip height
//! ([`Bounds`]). The child with the highest bound is visited first; those whose bound is below the contact found so far are skipped (branch and
//! bound).

use super::bound::{Bound, Bounds, OfTool, WIDE};
use super::shape::Shape;
use super::surface::{HOLLOW, RIM_CORNER, RIM_EDGE, STEEP, Surface};
use super::touch::{Facet, Feature, Touched};
use crate::path::Vec3;
use rayon::prelude::*;
use std::ops::Range;

/// Contact of the tool with the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Height of the tip, mm.
    pub tip_mm: f64,
    /// Point of contact, mm.
    pub point: Vec3,
    /// From the point of contact towards the tool, unit.
    pub normal: Vec3,
    /// Triangle in contact.
    pub triangle: u32,
    /// Is the contact on the rim of the machined surface, or on a triangle that is too steep?
    pub rim: bool,
}

/// Places that one thread handles in sequence.
const RUN: usize = 1024;

/// A mesh prepared for one tool.
#[derive(Debug)]
pub struct Dropper<'a> {
    surface: &'a Surface,
    shape: Shape,
    /// Indices of the triangles, leaf by leaf.
    order: Vec<u32>,
    /// The triangles in that order.
    facets: Vec<Facet>,
    of_tool: OfTool,
    /// Which of their edges are tested for contact.
    kept: Vec<[bool; 3]>,
    nodes: Vec<Node>,
    /// Parent of each node.
    parents: Vec<u32>,
    /// Of each triangle its position in the order, and its leaf.
    places: Vec<[u32; 2]>,
}

/// A node: so many children, or in a leaf triangles, from `first` on, with their bounds.
#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Bounds,
    first: u32,
    count: u32,
    is_leaf: bool,
}

impl<'a> Dropper<'a> {
    /// Prepares a surface for a tool.
    pub fn new(surface: &'a Surface, shape: Shape) -> Self {
        let mut order: Vec<u32> = (0..surface.triangles.len() as u32).collect();
        let bound_of = |part: &[u32]| Bound::of(part.iter().map(|k| &surface.triangles[*k as usize]), shape);
        let mut ranges: Vec<Range<usize>> = std::iter::once(0..order.len()).collect();
        let mut parents = vec![0];
        let mut nodes: Vec<Node> = Vec::with_capacity(order.len());
        // Breadth first: the children of a node are neighbours.
        while let Some(range) = ranges.get(nodes.len()).cloned() {
            let is_leaf = range.len() <= WIDE;
            let first = if is_leaf { range.start } else { ranges.len() };
            let parts: Vec<Range<usize>> = if is_leaf {
                range.map(|k| k..k + 1).collect()
            } else {
                let halves = halved(surface, &mut order, range);
                halves.into_iter().flat_map(|half| halved(surface, &mut order, half)).collect()
            };
            let bounds: Vec<Bound> = parts.iter().map(|part| bound_of(&order[part.clone()])).collect();
            let (first, count) = (first as u32, parts.len() as u32);
            if !is_leaf {
                parents.extend([nodes.len() as u32; WIDE]);
                ranges.extend(parts);
            }
            nodes.push(Node { bounds: Bounds::of(&bounds), first, count, is_leaf });
        }
        let facets = order.iter().map(|k| Facet::new(&surface.triangles[*k as usize], shape)).collect();
        let kept =
            order.iter().map(|k| [0, 1, 2].map(|edge| surface.marks[*k as usize] & HOLLOW << edge == 0)).collect();
        let mut places = vec![[0; 2]; order.len()];
        for (leaf, node) in nodes.iter().enumerate().filter(|(_, node)| node.is_leaf) {
            for k in node.first..node.first + node.count {
                places[order[k as usize] as usize] = [k, leaf as u32];
            }
        }
        Self { surface, shape, order, facets, of_tool: OfTool::new(shape), kept, nodes, parents, places }
    }

    /// Shape of the tool.
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Lowers the tool at a place; `None` off the mesh.
    pub fn drop(&self, p: [f64; 2]) -> Option<Contact> {
        let mut best = Best::default();
        self.descend(p, 0, &mut best);
        self.contact(&best, p)
    }

    /// Lowers the tool at a place near another, where it has this contact: that saves half of the search.
    pub fn drop_near(&self, p: [f64; 2], known: &Contact) -> Option<Contact> {
        self.contact(&self.near(p, self.places[known.triangle as usize]), p)
    }

    /// Lowers the tool near a contact with a triangle, given by its position and its leaf: starts at that leaf and goes up the tree, where most
    /// siblings can be skipped.
    fn near(&self, p: [f64; 2], [k, leaf]: [u32; 2]) -> Best {
        let mut best = Best::default();
        best.take(self.facets[k as usize].touch(p, self.shape, self.kept[k as usize], f64::NEG_INFINITY), k);
        let mut at = leaf;
        self.descend(p, at, &mut best);
        while at > 0 {
            let parent = self.parents[at as usize];
            let node = &self.nodes[parent as usize];
            let bounds = node.bounds.at(p.map(|x| x as f32), &self.of_tool);
            for (bound, child) in bounds.into_iter().zip(node.first..node.first + node.count) {
                if child != at && f64::from(bound) > best.tip_mm {
                    self.descend(p, child, &mut best);
                }
            }
            at = parent;
        }
        best
    }

    /// Searches for a higher contact below a node.
    fn descend(&self, p: [f64; 2], from: u32, best: &mut Best) {
        let at = p.map(|x| x as f32);
        let (mut stack, mut depth) = ([(0.0f32, 0u32); 64], 1);
        stack[0] = (f32::INFINITY, from);
        while depth > 0 {
            depth -= 1;
            let (highest_mm, index) = stack[depth];
            if f64::from(highest_mm) <= best.tip_mm {
                continue;
            }
            let node = &self.nodes[index as usize];
            let bounds = node.bounds.at(at, &self.of_tool);
            if node.is_leaf {
                self.visit(p, node.first, bounds, best);
                continue;
            }
            // Pushed so that the highest is on top.
            let lowest = depth;
            for (bound, child) in bounds.into_iter().zip(node.first..node.first + node.count) {
                if f64::from(bound) <= best.tip_mm {
                    continue;
                }
                let mut place = depth;
                while place > lowest && stack[place - 1].0 > bound {
                    stack[place] = stack[place - 1];
                    place -= 1;
                }
                stack[place] = (bound, child);
                depth += 1;
            }
        }
    }

    /// Touches the triangles of a leaf, the one with the highest bound first.
    #[inline]
    fn visit(&self, p: [f64; 2], first: u32, mut bounds: [f32; WIDE], best: &mut Best) {
        loop {
            let highest = (1..WIDE).fold(0, |most, k| if bounds[k] > bounds[most] { k } else { most });
            if f64::from(bounds[highest]) <= best.tip_mm {
                return;
            }
            bounds[highest] = f32::NEG_INFINITY;
            let k = first as usize + highest;
            best.take(self.facets[k].touch(p, self.shape, self.kept[k], best.tip_mm), k as u32);
        }
    }

    /// Lowers the tool at many places, sorted so that consecutive ones are close and use the same part of the mesh.
    pub fn drop_all(&self, places: &[[f64; 2]]) -> Vec<Option<Contact>> {
        let tile = |x: f64| (x / self.shape.radius_mm()).floor() as i64;
        let tiles = places.par_iter().enumerate().map(|(k, [x, y])| (tile(*x), tile(*y), k as u32));
        let mut tiles: Vec<(i64, i64, u32)> = tiles.collect();
        tiles.par_sort_unstable();
        let order: Vec<u32> = tiles.into_iter().map(|(_, _, k)| k).collect();
        let run = |part: &[u32]| {
            let mut last: Option<Contact> = None;
            let drop = |k: &u32| {
                let p = places[*k as usize];
                let found = last.map_or_else(|| self.drop(p), |last| self.drop_near(p, &last));
                last = found.or(last);
                found
            };
            part.iter().map(drop).collect::<Vec<_>>()
        };
        let found: Vec<Option<Contact>> = order.par_chunks(RUN).flat_map_iter(run).collect();
        let mut sorted = vec![None; places.len()];
        order.iter().zip(found).for_each(|(k, contact)| sorted[*k as usize] = contact);
        sorted
    }

    fn contact(&self, best: &Best, p: [f64; 2]) -> Option<Contact> {
        let (touched, k) = best.touched?;
        let triangle = self.order[k as usize];
        let marks = self.surface.marks[triangle as usize];
        let rim = match touched.feature {
            Feature::Facet => marks & STEEP != 0,
            Feature::Edge(k) => marks & (STEEP | RIM_EDGE << k) != 0,
            Feature::Corner(k) => marks & (STEEP | RIM_CORNER << k) != 0,
        };
        let normal = self.shape.normal(touched.point - Vec3::new(p[0], p[1], touched.tip_mm));
        Some(Contact { tip_mm: touched.tip_mm, point: touched.point, normal, triangle, rim })
    }
}

/// Two halves of some triangles, side by side along the longer side of what they cover.
fn halved(surface: &Surface, order: &mut [u32], range: Range<usize>) -> [Range<usize>; 2] {
    let part = &mut order[range.clone()];
    let extent = |axis: usize| {
        let of_corners = part.iter().flat_map(|k| surface.triangles[*k as usize]).map(|corner| corner[axis]);
        let (least, most) = of_corners.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        most - least
    };
    let axis = usize::from(extent(1) > extent(0));
    let middle = |t: &[Vec3; 3]| t[0][axis] + t[1][axis] + t[2][axis];
    let key = |k: &u32| middle(&surface.triangles[*k as usize]);
    let half = part.len() / 2;
    part.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
    [range.start..range.start + half, range.start + half..range.end]
}

/// The highest contact found so far.
#[derive(Debug, Clone, Copy)]
struct Best {
    /// Its tip, mm; minus infinity before there is one.
    tip_mm: f64,
    /// The contact, and the position of its triangle among the leaves.
    touched: Option<(Touched, u32)>,
}

impl Default for Best {
    fn default() -> Self {
        Self { tip_mm: f64::NEG_INFINITY, touched: None }
    }
}

impl Best {
    #[inline]
    fn take(&mut self, touched: Option<Touched>, k: u32) {
        if let Some(touched) = touched.filter(|touched| touched.tip_mm > self.tip_mm) {
            *self = Self { tip_mm: touched.tip_mm, touched: Some((touched, k)) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Box3;
    use crate::stock::Mesh;

    fn surface(triangles: Vec<[Vec3; 3]>) -> Surface {
        let marks = vec![0; triangles.len()];
        let extent = Box3 { min: Vec3::zeros(), max: Vec3::zeros() };
        Surface { triangles, marks, holes: Vec::new(), extent, notes: Vec::new() }
    }

    /// Triangles of a height function over a square about the origin.
    fn sheet(half_mm: f64, cells: usize, z: impl Fn(f64, f64) -> f64) -> Surface {
        let at = |i: usize, j: usize| {
            let [x, y] = [i, j].map(|k| half_mm * (2.0 * k as f64 / cells as f64 - 1.0));
            Vec3::new(x, y, z(x, y))
        };
        let cell = |k: usize| {
            let (i, j) = (k % cells, k / cells);
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        };
        surface((0..cells * cells).flat_map(cell).collect())
    }

    const SHAPES: [Shape; 3] = [
        Shape { flat_mm: 0.0, corner_mm: 3.0 },
        Shape { flat_mm: 2.0, corner_mm: 1.0 },
        Shape { flat_mm: 3.0, corner_mm: 0.0 },
    ];

    #[test]
    fn a_slope_a_ridge_and_a_spike_are_touched_as_their_closed_forms_say() {
        for shape in SHAPES {
            let Shape { flat_mm: a, corner_mm: r } = shape;
            // A slope of 30 degrees: the tip stands r (1/cos - 1) + a tan above the plane under it.
            let (sin, cos) = 30f64.to_radians().sin_cos();
            let slope = sheet(20.0, 7, |x, _| x * sin / cos);
            let found = Dropper::new(&slope, shape).drop([1.3, 0.4]).unwrap();
            let expected = 1.3 * sin / cos + r * (1.0 / cos - 1.0) + a * sin / cos;
            assert!((found.tip_mm - expected).abs() < 1e-9, "{shape:?} {} {expected}", found.tip_mm);
            if r > 0.0 {
                assert!((found.normal - Vec3::new(-sin, 0.0, cos)).norm() < 1e-9, "{shape:?} {}", found.normal);
            }
            // A level ridge along y at x = 0, with flanks too steep to be touched: tip -h(distance).
            let ridge = sheet(20.0, 2, |x, _| -30.0 * x.abs());
            for x in [0.0, 0.7, 2.5] {
                let found = Dropper::new(&ridge, shape).drop([x, 0.4]).unwrap();
                let drop = -shape.height(x).unwrap();
                let facet = -30.0 * x + r * (901f64.sqrt() - 1.0) + a * 30.0;
                let inside = a + r * 30.0 / 901f64.sqrt() < x;
                assert!((found.tip_mm - if inside { facet } else { drop }).abs() < 1e-9, "{shape:?} {x}");
            }
            // A spike.
            let (top, foot) = (Vec3::new(0.0, 0.0, 5.0), |k: f64| {
                let (sin, cos) = (2.094 * k).sin_cos();
                Vec3::new(0.01 * cos, 0.01 * sin, -90.0)
            });
            let spike = surface((0..3).map(|k| [top, foot(k as f64), foot(k as f64 + 1.0)]).collect());
            let found = Dropper::new(&spike, shape).drop([1.2, -1.5]).unwrap();
            let expected = 5.0 - shape.height(1.2f64.hypot(1.5)).unwrap();
            assert!((found.tip_mm - expected).abs() < 1e-9, "{shape:?}");
            assert!(Dropper::new(&spike, shape).drop([3.2, 0.0]).is_none());
        }
    }

    #[test]
    fn a_ball_in_a_bowl_and_on_a_dome_keeps_its_distance_from_the_centre() {
        let (radius, shape) = (20.0, SHAPES[0]);
        // Facets of a sphere lie within side^2/4R of it: 0.2 mm of side, 0.5 micrometres.
        for sign in [1.0, -1.0] {
            let sphere = sheet(10.0, 100, |x, y| sign * (radius * radius - x * x - y * y).sqrt());
            let dropper = Dropper::new(&sphere, shape);
            for (x, y) in [(0.0, 0.0), (3.0, 1.0), (-4.1, 5.2)] {
                let around = radius + sign * 3.0;
                let centre = sign * (around * around - x * x - y * y).sqrt();
                let found = dropper.drop([x, y]).unwrap();
                assert!((found.tip_mm + 3.0 - centre).abs() < 1e-3, "{sign} {x} {y} {} {centre}", found.tip_mm);
                assert!(!found.rim);
            }
        }
    }

    /// The tree skips only triangles that cannot be touched.
    #[test]
    fn the_tree_finds_what_trying_every_triangle_finds() {
        let mut state = 7u64;
        let mut random = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        let mut corner = || Vec3::new(20.0 * random(), 20.0 * random(), 5.0 * random());
        let mut triangles: Vec<[Vec3; 3]> = Vec::new();
        for _ in 0..400 {
            let (at, size) = (corner(), 0.1);
            triangles.push([0, 1, 2].map(|_| at + corner() * size));
        }
        let cloud = surface(triangles);
        for shape in SHAPES {
            let dropper = Dropper::new(&cloud, shape);
            for k in 0..400 {
                let p = [f64::from(k % 20) + 0.31, f64::from(k / 20) + 0.17];
                let every = cloud
                    .triangles
                    .iter()
                    .filter_map(|t| Facet::new(t, shape).touch(p, shape, [true; 3], f64::NEG_INFINITY));
                let expected = every.map(|touched| touched.tip_mm).reduce(f64::max);
                assert_eq!(dropper.drop(p).map(|found| found.tip_mm), expected, "{shape:?} {p:?}");
            }
        }
    }

    /// Skipped edges, and starting from a nearby contact, do not change the result: sheets of random heights, from
    /// gentle to steeper than 85 degrees.
    #[test]
    fn a_rough_sheet_holds_the_tool_where_its_triangles_do() {
        let mut state = 11u64;
        let mut random = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        let cells = 24u32;
        for rough_mm in [0.05, 0.4, 3.0, 12.0] {
            let mut corner = |k: u32| {
                let at = |k: u32| 0.5 * f64::from(k);
                Vec3::new(at(k % (cells + 1)), at(k / (cells + 1)), rough_mm * random())
            };
            let vertices = (0..(cells + 1) * (cells + 1)).map(&mut corner).collect();
            let cell = |k: u32| {
                let a = k % cells + k / cells * (cells + 1);
                let [b, c, d] = [a + 1, a + cells + 2, a + cells + 1];
                [[a, b, c], [a, c, d]]
            };
            let triangles = (0..cells * cells).flat_map(cell).collect();
            let sheet = Surface::of_mesh(&Mesh { vertices, triangles }, 1.4, Vec::new());
            let places: Vec<[f64; 2]> =
                (0..400).map(|k| [f64::from(k % 20) * 0.7 - 0.8, f64::from(k / 20) * 0.7 - 0.8]).collect();
            for shape in SHAPES {
                let dropper = Dropper::new(&sheet, shape);
                for (p, found) in places.iter().zip(dropper.drop_all(&places)) {
                    let every = sheet
                        .triangles
                        .iter()
                        .filter_map(|t| Facet::new(t, shape).touch(*p, shape, [true; 3], f64::NEG_INFINITY));
                    let expected = every.map(|touched| touched.tip_mm).fold(f64::NEG_INFINITY, f64::max);
                    let found = found.map_or(f64::NEG_INFINITY, |found| found.tip_mm);
                    let alone = dropper.drop(*p).map_or(f64::NEG_INFINITY, |found| found.tip_mm);
                    let same = |a: f64, b: f64| a == b || (a - b).abs() < 1e-9;
                    assert!(
                        same(found, expected) && same(alone, expected),
                        "{shape:?} {rough_mm} {p:?} {found} {expected}"
                    );
                }
            }
        }
    }
}
