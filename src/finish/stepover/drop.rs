//! Drop-cutter: how far a tool can be lowered along its axis until it touches a mesh. In: triangles, tool shape, places in the
//! plane. Out: height of the tip with the point of contact.
//!
//! A bull-nose end is a disc of radius a swept by a ball of radius r: ball a = 0, flat end r = 0. Its lower side at a
//! distance ρ from the axis lies h(ρ) = r − √(r² − (ρ − a)²) above the tip (0 within a), a convex function; so over a triangle
//! z(p) − h(|p − axis|) is concave, its largest value is the height of the tip, and
//! * it lies inside the triangle where the normal points from the corner circle: at a + r sin θ from the axis, uphill;
//! * else on an edge, where it is concave again: in closed form for a ball and a flat, by bisection of its slope for a bull.
//!
//! Triangles lie in a tree of halves. A node holds a box in the plane and a plane of gradient g above all its corners, so
//! f(p) = plane(p) − h(|p − axis|) bounds what it can hold. f is concave, and for a ball it bends by at least 1/r: about any point
//! x₀ of the box
//!
//! f(x₀ + Δ) ≤ f(x₀) + ∇f·Δ − Δ²/2r  (without the last term where there is a flat),
//!
//! whose largest value over the box is found axis by axis. x₀ is the point of the box next to where the tool touches the
//! plane, at a + r|g|/√(1+g²) uphill. The child with the higher bound is opened first; what stays below the contact found so
//! far is never opened.

use super::shape::Shape;
use super::surface::{RIM_CORNER, RIM_EDGE, STEEP, Surface};
use crate::path::Vec3;
use rayon::prelude::*;

/// Where the tool rests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Height of the tip, mm.
    pub tip_mm: f64,
    /// Point of contact, mm.
    pub point: Vec3,
    /// From the point of contact towards the tool, unit.
    pub normal: Vec3,
    /// Triangle that is touched.
    pub triangle: u32,
    /// It is touched on an edge or corner where the surface ends, or is too steep to be machined.
    pub rim: bool,
}

/// Triangles of a leaf.
const LEAF: usize = 4;
/// What a bound stays above rounding, mm.
const SLACK_MM: f64 = 1e-9;
/// A plane of a node is never steeper than this; any plane above its corners bounds it.
const STEEPEST: f64 = 20.0;
/// Steps by which the range of an edge is halved: a place within 1e-12 of its length.
const HALVINGS: u32 = 40;

/// A mesh made ready for one tool.
#[derive(Debug)]
pub struct Dropper<'a> {
    surface: &'a Surface,
    shape: Shape,
    /// Numbers of the triangles, leaf by leaf.
    order: Vec<u32>,
    /// Bound of each, in that order.
    leaves: Vec<Bound>,
    nodes: Vec<Node>,
}

/// What lies in a box of the plane, and below a plane.
#[derive(Debug, Clone, Copy)]
struct Bound {
    low: [f64; 2],
    high: [f64; 2],
    gradient: [f64; 2],
    /// Height of the plane above the origin, mm.
    level: f64,
    /// How far above the plane under it a tip that rests on it stands, mm.
    lift: f64,
    /// From the axis to where the tool touches the plane, mm.
    uphill: [f64; 2],
}

/// A node: its bound; two nodes from `first` on, or a leaf with `count` triangles from `first` on.
#[derive(Debug, Clone, Copy)]
struct Node {
    bound: Bound,
    first: u32,
    count: u32,
}

impl Bound {
    /// Bound of some triangles.
    fn of<'t>(triangles: impl Iterator<Item = &'t [Vec3; 3]> + Clone, shape: Shape) -> Self {
        let (mut low, mut high, mut normal) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], Vec3::zeros());
        for triangle in triangles.clone() {
            let across = (triangle[1] - triangle[0]).cross(&(triangle[2] - triangle[0]));
            normal += if across.z < 0.0 { -across } else { across };
            for corner in triangle {
                for axis in [0, 1] {
                    low[axis] = low[axis].min(corner[axis]);
                    high[axis] = high[axis].max(corner[axis]);
                }
            }
        }
        let steep = normal.x.hypot(normal.y) > STEEPEST * normal.z;
        let gradient = if steep { [0.0; 2] } else { [-normal.x / normal.z, -normal.y / normal.z] };
        let above = |p: &Vec3| p.z - gradient[0] * p.x - gradient[1] * p.y;
        let top = triangles.flatten().map(above).fold(f64::NEG_INFINITY, f64::max);
        let slope = gradient[0].hypot(gradient[1]);
        let secant = slope.hypot(1.0);
        let out = if slope > 0.0 { shape.flat_mm / slope } else { 0.0 } + shape.corner_mm / secant;
        Self {
            low,
            high,
            gradient,
            level: top + SLACK_MM,
            lift: shape.corner_mm * (secant - 1.0) + shape.flat_mm * slope,
            uphill: gradient.map(|g| out * g),
        }
    }

    /// No tip at `p` is held higher than this by what lies within; minus infinity where that is no more than `known_mm`.
    #[inline]
    fn at(&self, p: [f64; 2], shape: Shape, known_mm: f64) -> f64 {
        let Shape { flat_mm: a, corner_mm: r } = shape;
        let under = self.level + self.gradient[0] * p[0] + self.gradient[1] * p[1];
        if under + self.lift <= known_mm {
            return f64::NEG_INFINITY;
        }
        let beside = |axis: usize| (self.low[axis] - p[axis]).max(p[axis] - self.high[axis]).max(0.0);
        let (reach, least) = (shape.radius_mm(), [beside(0), beside(1)]);
        if least[0] * least[0] + least[1] * least[1] > reach * reach {
            return f64::NEG_INFINITY;
        }
        let within = |axis: usize| (p[axis] + self.uphill[axis]).clamp(self.low[axis], self.high[axis]) - p[axis];
        let off = [within(0), within(1)];
        let square = off[0] * off[0] + off[1] * off[1];
        let out = if a > 0.0 { square.sqrt() } else { 0.0 };
        let bend = if a > 0.0 { (out - a).max(0.0).powi(2) } else { square };
        let rise = r * r - bend;
        if rise <= 1e-6 * r * r {
            // That point lies on or beyond the rim of the tool, where h has no slope: no contact is higher than on the plane,
            // nor than the plane is within the box.
            let most = |axis: usize| {
                let g = self.gradient[axis];
                (g * (self.low[axis] - p[axis])).max(g * (self.high[axis] - p[axis]))
            };
            return under + self.lift.min(most(0) + most(1));
        }
        let root = rise.sqrt();
        // Slope of h over the distance from the axis.
        let slope = if a > 0.0 { (out - a).max(0.0) / (root * out.max(f64::MIN_POSITIVE)) } else { root.recip() };
        let half_bend = 0.5 / r;
        let mut bound = under - (r - root);
        for axis in [0, 1] {
            let gradient = self.gradient[axis] - slope * off[axis];
            let [low, high] = [self.low[axis] - p[axis] - off[axis], self.high[axis] - p[axis] - off[axis]];
            let more = if a > 0.0 {
                (gradient * low).max(gradient * high)
            } else {
                let step = (r * gradient).clamp(low, high);
                step * (gradient - half_bend * step)
            };
            bound += self.gradient[axis] * off[axis] + more;
        }
        bound
    }
}

impl<'a> Dropper<'a> {
    /// Makes a surface ready for a tool.
    pub fn new(surface: &'a Surface, shape: Shape) -> Self {
        let middle = |t: &[Vec3; 3], axis: usize| t[0][axis] + t[1][axis] + t[2][axis];
        let mut order: Vec<u32> = (0..surface.triangles.len() as u32).collect();
        let mut ranges = vec![(0, order.len())];
        let mut nodes: Vec<Node> = Vec::with_capacity(order.len());
        let mut next = 0;
        // Breadth first: the two halves of a node stand side by side.
        while next < ranges.len() {
            let (from, to) = ranges[next];
            next += 1;
            let part = &mut order[from..to];
            let bound = Bound::of(part.iter().map(|k| &surface.triangles[*k as usize]), shape);
            if part.len() <= LEAF {
                nodes.push(Node { bound, first: from as u32, count: part.len() as u32 });
                continue;
            }
            let axis = usize::from(bound.high[1] - bound.low[1] > bound.high[0] - bound.low[0]);
            let key = |k: &u32| middle(&surface.triangles[*k as usize], axis);
            let half = part.len() / 2;
            part.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
            nodes.push(Node { bound, first: ranges.len() as u32, count: 0 });
            ranges.extend([(from, from + half), (from + half, to)]);
        }
        let leaf = |k: &u32| Bound::of(std::iter::once(&surface.triangles[*k as usize]), shape);
        let leaves = order.par_iter().map(leaf).collect();
        Self { surface, shape, order, leaves, nodes }
    }

    /// The tool it was made ready for.
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Lowers the tool at a place; `None` where nothing lies below it.
    pub fn drop(&self, p: [f64; 2]) -> Option<Contact> {
        let shape = self.shape;
        let (mut best, mut stack, mut depth) = (None::<Contact>, [(0.0, 0u32); 64], 0);
        let mut highest = f64::NEG_INFINITY;
        let root =
            self.nodes.first().filter(|node| node.bound.high[0] >= node.bound.low[0])?.bound.at(p, shape, highest);
        if root > f64::NEG_INFINITY {
            (stack[0], depth) = ((root, 0), 1);
        }
        while depth > 0 {
            depth -= 1;
            let (bound, index) = stack[depth];
            if bound <= highest {
                continue;
            }
            let node = &self.nodes[index as usize];
            let first = node.first as usize;
            if node.count == 0 {
                let [a, b] = [0, 1].map(|k| (self.nodes[first + k].bound.at(p, shape, highest), (first + k) as u32));
                let (less, more) = if a.0 < b.0 { (a, b) } else { (b, a) };
                for child in [less, more] {
                    if child.0 > highest {
                        stack[depth] = child;
                        depth += 1;
                    }
                }
                continue;
            }
            for k in first..first + node.count as usize {
                if self.leaves[k].at(p, shape, highest) > highest {
                    let number = self.order[k];
                    let touched = touch(&self.surface.triangles[number as usize], p, shape);
                    if let Some(touched) = touched.filter(|touched| touched.tip_mm > highest) {
                        highest = touched.tip_mm;
                        best = Some(self.contact(touched, number, p));
                    }
                }
            }
        }
        best
    }

    /// Lowers it at many places; those near each other one after the other, as they need the same part of the mesh.
    pub fn drop_all(&self, places: &[[f64; 2]]) -> Vec<Option<Contact>> {
        let tile = |x: f64| (x / self.shape.radius_mm()).floor() as i64;
        let mut order: Vec<u32> = (0..places.len() as u32).collect();
        order.par_sort_by_key(|k| {
            let [x, y] = places[*k as usize];
            (tile(x), tile(y), *k)
        });
        let found: Vec<Option<Contact>> =
            order.par_iter().with_min_len(256).map(|k| self.drop(places[*k as usize])).collect();
        let mut sorted = vec![None; places.len()];
        order.iter().zip(found).for_each(|(k, contact)| sorted[*k as usize] = contact);
        sorted
    }

    fn contact(&self, touched: Touched, triangle: u32, p: [f64; 2]) -> Contact {
        let marks = self.surface.marks[triangle as usize];
        let rim = match touched.feature {
            Feature::Facet => marks & STEEP != 0,
            Feature::Edge(k) => marks & (STEEP | RIM_EDGE << k) != 0,
            Feature::Corner(k) => marks & (STEEP | RIM_CORNER << k) != 0,
        };
        let normal = self.shape.normal(touched.point - Vec3::new(p[0], p[1], touched.tip_mm));
        Contact { tip_mm: touched.tip_mm, point: touched.point, normal, triangle, rim }
    }
}

#[derive(Debug, Clone, Copy)]
enum Feature {
    Facet,
    Edge(u8),
    Corner(u8),
}

#[derive(Debug, Clone, Copy)]
struct Touched {
    tip_mm: f64,
    point: Vec3,
    feature: Feature,
}

/// Where a tool above `p` touches a triangle.
fn touch(triangle: &[Vec3; 3], p: [f64; 2], shape: Shape) -> Option<Touched> {
    facet(triangle, p, shape).or_else(|| {
        let edges = (0..3).filter_map(|k| edge(triangle, k, p, shape));
        edges.reduce(|best, other| if other.tip_mm > best.tip_mm { other } else { best })
    })
}

/// Contact inside the triangle.
fn facet(triangle: &[Vec3; 3], p: [f64; 2], shape: Shape) -> Option<Touched> {
    let [a, b, c] = *triangle;
    let across = (b - a).cross(&(c - a));
    if across.z == 0.0 {
        return None;
    }
    let n = if across.z < 0.0 { -across } else { across } / across.norm();
    let sin = (n.x * n.x + n.y * n.y).sqrt();
    // Uphill is against the level part of the normal; on a level facet under a flat bottom the axis stands for the disc.
    let out = if sin > 0.0 { shape.flat_mm / sin + shape.corner_mm } else { 0.0 };
    let (x, y) = (p[0] - out * n.x, p[1] - out * n.y);
    let side = |a: &Vec3, b: &Vec3| ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)) * across.z.signum();
    if side(&a, &b) < 0.0 || side(&b, &c) < 0.0 || side(&c, &a) < 0.0 {
        return None;
    }
    let z = a.z - (n.x * (x - a.x) + n.y * (y - a.y)) / n.z;
    Some(Touched { tip_mm: z - shape.corner_mm * (1.0 - n.z), point: Vec3::new(x, y, z), feature: Feature::Facet })
}

/// Contact with an edge, its ends included.
fn edge(triangle: &[Vec3; 3], k: u8, p: [f64; 2], shape: Shape) -> Option<Touched> {
    let next = (k + 1) % 3;
    let (a, b) = (triangle[k as usize], triangle[next as usize]);
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    let length = (dx * dx + dy * dy).sqrt();
    if length < 1e-12 {
        let (end, k) = if a.z > b.z { (a, k) } else { (b, next) };
        let tip_mm = end.z - shape.height((end.x - p[0]).hypot(end.y - p[1]))?;
        return Some(Touched { tip_mm, point: end, feature: Feature::Corner(k) });
    }
    let (ux, uy) = (dx / length, dy / length);
    // Along the edge, from the foot of the axis on it.
    let begin = (a.x - p[0]) * ux + (a.y - p[1]) * uy;
    let off = (a.x - p[0]) * uy - (a.y - p[1]) * ux;
    let half = shape.radius_mm().powi(2) - off * off;
    if half < 0.0 {
        return None;
    }
    let half = half.sqrt();
    let (from, to) = (begin.max(-half), (begin + length).min(half));
    if from > to {
        return None;
    }
    let slope = (b.z - a.z) / length;
    let u = lowest_gap(slope, off.abs(), [from, to], shape);
    let feature = match u {
        u if u <= begin => Feature::Corner(k),
        u if u >= begin + length => Feature::Corner(next),
        _ => Feature::Edge(k),
    };
    let t = (u - begin) / length;
    let point = a + (b - a) * t;
    let tip_mm = point.z - shape.height((u * u + off * off).sqrt().min(shape.radius_mm()))?;
    Some(Touched { tip_mm, point, feature })
}

/// Where slope·u − h(√(u² + off²)) is largest between two places.
fn lowest_gap(slope: f64, off: f64, [from, to]: [f64; 2], shape: Shape) -> f64 {
    let Shape { flat_mm, corner_mm } = shape;
    if corner_mm == 0.0 {
        return if slope > 0.0 { to } else { from };
    }
    if flat_mm == 0.0 {
        let half = (corner_mm * corner_mm - off * off).max(0.0).sqrt();
        return (half * slope / (slope * slope + 1.0).sqrt()).clamp(from, to);
    }
    let rises = |u: f64| {
        let out = (u * u + off * off).sqrt();
        slope * out > shape.slope(out) * u
    };
    if !rises(from) {
        return from;
    }
    if rises(to) {
        return to;
    }
    let (mut low, mut high) = (from, to);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if rises(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Box3;

    fn surface(triangles: Vec<[Vec3; 3]>) -> Surface {
        let marks = vec![0; triangles.len()];
        let extent = Box3 { min: Vec3::zeros(), max: Vec3::zeros() };
        Surface { triangles, marks, outlines: Vec::new(), extent, notes: Vec::new() }
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

    /// The tree only leaves out what cannot be touched.
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
                let every = cloud.triangles.iter().filter_map(|triangle| touch(triangle, p, shape));
                let expected = every.map(|touched| touched.tip_mm).reduce(f64::max);
                assert_eq!(dropper.drop(p).map(|found| found.tip_mm), expected, "{shape:?} {p:?}");
            }
        }
    }

    /// No point of a triangle stands inside a tool that rests on it, and one touches it: by points strewn over the triangle.
    #[test]
    fn no_point_of_a_triangle_is_inside_the_tool_that_rests_on_it() {
        let triangle = [Vec3::new(0.0, 0.0, 0.0), Vec3::new(4.0, 1.0, 2.0), Vec3::new(1.0, 3.0, -1.5)];
        for shape in SHAPES {
            for k in 0..100 {
                let p = [0.07 * f64::from(k) - 1.0, 0.05 * f64::from(k % 13)];
                let Some(found) = touch(&triangle, p, shape) else { continue };
                let mut nearest = f64::INFINITY;
                for i in 0..=400 {
                    for j in 0..=400 - i {
                        let (u, v) = (f64::from(i) / 400.0, f64::from(j) / 400.0);
                        let q = triangle[0] * (1.0 - u - v) + triangle[1] * u + triangle[2] * v;
                        let Some(height) = shape.height((q.x - p[0]).hypot(q.y - p[1])) else { continue };
                        nearest = nearest.min(found.tip_mm + height - q.z);
                    }
                }
                assert!((-1e-9..0.02).contains(&nearest), "{shape:?} {p:?} {nearest}");
            }
        }
    }
}
