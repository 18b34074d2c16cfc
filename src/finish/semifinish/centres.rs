//! Path of the centre of a ball end mill. In: the curves of feed moves in the common frame, the radius. Out: short
//! straight pieces of that path in a grid of cells; for a point the nearest place on them.
//!
//! A ball of radius R with its shank removes everything within R of its centre, and above the centre everything within
//! R of its axis. A point x therefore lies on the surface that the path c(s) leaves if min over s of d(x, c(s)) is R; d
//! is the distance in space below the height of the centre, and in the plane above it.

use crate::path::{Curve, Vec3};

/// Chords of an arc stay within this of it, mm.
const SAGITTA_MM: f64 = 2e-4;
/// Pieces whose angles to the surface differ by less than this (sine; three degrees) run equally along it.
const AS_LEVEL: f64 = 0.05;
/// Side of the cells of the grid, in radii.
const CELL: f64 = 1.0 / 3.0;

/// Relative margin for the rounding of f64 where a piece is left out as too far: a thousand times that of a few products.
const ROUNDING: f64 = 1e-12;

/// A straight piece of the path of a centre.
#[derive(Debug, Clone, Copy)]
struct Piece {
    ends: [Vec3; 2],
    /// Number of its curve.
    of: u32,
    /// Its ends along the curve, mm.
    s_mm: [f64; 2],
}

/// A piece near a place: its number, and the ball around it.
#[derive(Debug, Clone, Copy)]
pub struct Near {
    middle: Vec3,
    /// From its middle to its end.
    half: Vec3,
    half_mm: f64,
    /// Height of its lowest point, mm.
    lowest_mm: f64,
    piece: u32,
}

/// The place on the path nearest to a point.
#[derive(Debug, Clone, Copy)]
pub struct Nearest {
    /// d(x, c), mm.
    pub distance_mm: f64,
    /// Number of the curve.
    pub of: u32,
    /// The place along it, mm.
    pub s_mm: f64,
    /// The centre there.
    pub centre: Vec3,
}

/// The path of a centre in a grid of cells in the plane.
#[derive(Debug, Default)]
pub struct Centres {
    pieces: Vec<Piece>,
    low: [f64; 2],
    cell_mm: f64,
    across: [usize; 2],
    /// Start of the pieces of each cell in `listed`, and the end of the last.
    first: Vec<u32>,
    listed: Vec<u32>,
}

impl Centres {
    /// The path of a ball's centre over these curves of its tip.
    pub fn new(curves: impl Iterator<Item = (u32, Curve)>, radius_mm: f64) -> Self {
        let cell_mm = CELL * radius_mm;
        let up = Vec3::new(0.0, 0.0, radius_mm);
        let mut pieces = Vec::new();
        for (of, curve) in curves {
            let length = curve.length();
            let bend = curve.curvature(0.5 * length).norm();
            let chord = if bend > 0.0 { (8.0 * SAGITTA_MM / bend).sqrt() } else { f64::INFINITY };
            let count = (length / chord.min(cell_mm)).ceil().max(1.0);
            let at = |k: f64| length * k / count;
            for k in 0..count as usize {
                let s_mm = [at(k as f64), at(k as f64 + 1.0)];
                pieces.push(Piece { ends: s_mm.map(|s| curve.point(s) + up), of, s_mm });
            }
        }
        Self::of(pieces, cell_mm)
    }

    fn of(pieces: Vec<Piece>, cell_mm: f64) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for end in pieces.iter().flat_map(|piece| piece.ends) {
            for axis in 0..2 {
                (low[axis], high[axis]) = (low[axis].min(end[axis]), high[axis].max(end[axis]));
            }
        }
        if pieces.is_empty() {
            return Self::default();
        }
        let across = [0, 1].map(|axis| ((high[axis] - low[axis]) / cell_mm) as usize + 1);
        let mut centres =
            Self { pieces, low, cell_mm, across, first: vec![0; across[0] * across[1] + 1], listed: vec![] };
        let cells: Vec<Vec<usize>> = centres.pieces.iter().map(|piece| centres.cells_of(piece)).collect();
        for cell in cells.iter().flatten() {
            centres.first[cell + 1] += 1;
        }
        for k in 1..centres.first.len() {
            centres.first[k] += centres.first[k - 1];
        }
        let mut next = centres.first.clone();
        centres.listed = vec![0; cells.iter().map(Vec::len).sum()];
        for (index, cells) in cells.iter().enumerate() {
            for cell in cells {
                centres.listed[next[*cell] as usize] = index as u32;
                next[*cell] += 1;
            }
        }
        centres
    }

    fn column(&self, axis: usize, at: f64) -> usize {
        (((at - self.low[axis]) / self.cell_mm).max(0.0) as usize).min(self.across[axis] - 1)
    }

    fn window(&self, low: [f64; 2], high: [f64; 2]) -> [std::ops::RangeInclusive<usize>; 2] {
        [0, 1].map(|axis| self.column(axis, low[axis])..=self.column(axis, high[axis]))
    }

    fn cells_of(&self, piece: &Piece) -> Vec<usize> {
        let [a, b] = piece.ends;
        let [columns, rows] = self.window([a.x.min(b.x), a.y.min(b.y)], [a.x.max(b.x), a.y.max(b.y)]);
        rows.flat_map(|row| columns.clone().map(move |column| row * self.across[0] + column)).collect()
    }

    /// Is there no path?
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Pieces within about `reach_mm` of a place, each once; `out` is emptied first.
    pub fn near(&self, at: Vec3, reach_mm: f64, out: &mut Vec<Near>) {
        out.clear();
        if self.is_empty() {
            return;
        }
        let [columns, rows] = self.window([at.x - reach_mm, at.y - reach_mm], [at.x + reach_mm, at.y + reach_mm]);
        for row in rows.clone() {
            for column in columns.clone() {
                let cell = row * self.across[0] + column;
                let listed = &self.listed[self.first[cell] as usize..self.first[cell + 1] as usize];
                out.extend(listed.iter().filter_map(|piece| {
                    let [a, b] = self.pieces[*piece as usize].ends;
                    let (low, high) = (a.inf(&b), a.sup(&b));
                    let within =
                        (0..3).all(|axis| at[axis] + reach_mm >= low[axis] && at[axis] - reach_mm <= high[axis]);
                    // Of the cells that list it the first one in the window.
                    let is_first = || {
                        column == self.column(0, low.x).max(*columns.start())
                            && row == self.column(1, low.y).max(*rows.start())
                    };
                    (within && is_first()).then(|| Near {
                        middle: 0.5 * (a + b),
                        half: 0.5 * (b - a),
                        half_mm: 0.5 * (b - a).norm(),
                        lowest_mm: low.z,
                        piece: *piece,
                    })
                }));
            }
        }
    }

    /// Leaves out pieces of which some other piece is nearer to each of these points, by d(x, c).
    ///
    /// With the points in a ball (m, ρ), r the place of the path nearest to m, and p a place of another piece,
    /// |x − p|² − |x − r|² ≥ |m − p|² − |m − r|² − 2ρ|p − r|. The piece is farther from all of them if that is positive
    /// all along it, and none of them is above its lowest point.
    pub fn narrow(&self, points: &[Vec3], pieces: &mut Vec<Near>) {
        let Some(start) = points.first() else { return };
        let (low, high) = points.iter().fold((*start, *start), |(low, high), x| (low.inf(x), high.sup(x)));
        let middle = 0.5 * (low + high);
        let Some(nearest) = self.nearest(pieces, middle, &mut 0) else { return };
        let reach_mm = points.iter().map(|x| (x - middle).norm_squared()).fold(0.0, f64::max).sqrt();
        let square = (middle - nearest.centre).norm_squared();
        pieces.retain(|near| {
            let far_mm = (near.middle - nearest.centre).norm() + near.half_mm;
            high.z > near.lowest_mm
                || near.least_square(middle - near.middle) <= (square + 2.0 * reach_mm * far_mm) * (1.0 + ROUNDING)
        });
    }

    /// The place on these pieces with the least d(x, c). `first`: the piece looked at first, by its place in the list; then that found, with
    /// which a search near by begins best.
    pub fn nearest(&self, pieces: &[Near], x: Vec3, first: &mut usize) -> Option<Nearest> {
        let distance = |k: usize| self.pieces[pieces[k].piece as usize].distance(x);
        let mut found = (*first).min(pieces.len().checked_sub(1)?);
        let (mut t, mut distance_mm) = distance(found);
        for (k, near) in pieces.iter().enumerate() {
            if near.is_farther(x, distance_mm) {
                continue;
            }
            let (place, here_mm) = distance(k);
            // Of two that meet in the nearest place the first.
            if here_mm < distance_mm || (here_mm == distance_mm && near.piece < pieces[found].piece) {
                (found, t, distance_mm) = (k, place, here_mm);
            }
        }
        *first = found;
        let piece = &self.pieces[pieces[found].piece as usize];
        let ([a, b], [from, to]) = (piece.ends, piece.s_mm);
        Some(Nearest { distance_mm, of: piece.of, s_mm: from + t * (to - from), centre: a + (b - a) * t })
    }

    /// Distance from the pass nearest to a place to the neighbouring pass, in the plane normal to `normal`; `None` if
    /// there is none within `reach_mm`. `across`: largest cosine of the angle between the way to a neighbour and the
    /// direction of the path.
    pub fn spacing(&self, at: Vec3, normal: Vec3, reach_mm: f64, across: f64) -> Option<f64> {
        self.beside(at, normal, reach_mm, across).map(|way| (way - normal * way.dot(&normal)).norm())
    }

    /// The vector to that pass.
    pub fn beside(&self, at: Vec3, normal: Vec3, reach_mm: f64, across: f64) -> Option<Vec3> {
        let mut near = Vec::new();
        self.near(at, reach_mm, &mut near);
        near.sort_unstable_by_key(|near| near.piece);
        let own = self.nearest_piece(&near, at, normal)?;
        let [a, b] = self.pieces[own as usize].ends;
        let along = (b - a).try_normalize(0.0)?;
        let from = a + along * (at - a).dot(&along).clamp(0.0, (b - a).norm());
        let beside = near.iter().filter(|near| near.piece != own).filter_map(|near| {
            let [a, b] = self.pieces[near.piece as usize].ends;
            let (t, off) = closest(b - a, from - a, false);
            let way = a + (b - a) * t - from;
            let level = way - normal * way.dot(&normal);
            // Only passes, not the plunges at their ends.
            let runs_along = (b - a).dot(&along).abs() > across * (b - a).norm();
            (off > 1e-6 && runs_along && level.dot(&along).abs() < across * level.norm()).then_some((level.norm(), way))
        });
        beside.reduce(|a, b| if b.0 < a.0 { b } else { a }).map(|(_, way)| way)
    }

    /// The nearest piece of a pass: of those that run most nearly along the surface, since the plunge of a pass may be
    /// nearer.
    fn nearest_piece(&self, near: &[Near], at: Vec3, normal: Vec3) -> Option<u32> {
        let ends = |piece: &u32| self.pieces[*piece as usize].ends;
        let off = |piece: &u32| closest(ends(piece)[1] - ends(piece)[0], at - ends(piece)[0], false).1;
        let rise = |piece: &u32| {
            (ends(piece)[1] - ends(piece)[0]).try_normalize(0.0).map_or(1.0, |along| along.dot(&normal).abs())
        };
        let pieces = || near.iter().map(|near| near.piece);
        let least = pieces().map(|piece| rise(&piece)).fold(f64::INFINITY, f64::min);
        let passes = pieces().filter(|piece| rise(piece) <= least + AS_LEVEL);
        passes.min_by(|p, q| off(p).total_cmp(&off(q)))
    }
}

impl Near {
    /// Is it quickly known that d(x, c) is larger all along? Where x is below the piece that is the distance in space.
    fn is_farther(&self, x: Vec3, than_mm: f64) -> bool {
        let v = x - self.middle;
        let beyond = than_mm * than_mm;
        x.z <= self.lowest_mm && v.norm_squared() > beyond && self.least_square(v) > beyond * (1.0 + ROUNDING)
    }

    /// A lower bound of the square of the distance in space, from v, the way from the middle to the point: with
    /// p = v·half the square is v² − p²/half² ≥ v² − |p| beside the piece, and v² − 2|p| + half² beyond its ends, where
    /// |p| ≥ half².
    fn least_square(&self, v: Vec3) -> f64 {
        let (along, half) = (v.dot(&self.half).abs(), self.half_mm * self.half_mm);
        v.norm_squared() - if along < half { along } else { 2.0 * along - half }
    }
}

impl Piece {
    /// The place (0 … 1) of least d(x, c), and d there.
    fn distance(&self, x: Vec3) -> (f64, f64) {
        let [a, b] = self.ends;
        let along = b - a;
        let (t, level) = closest(along, x - a, false);
        let centre_z = a.z + t * along.z;
        if x.z <= centre_z {
            return (t, level);
        }
        closest(along, x - a, true)
    }
}

/// The place (0 … 1) on a line from the origin nearest to `x`, in space or in the plane (`level`), and its distance.
fn closest(along: Vec3, x: Vec3, level: bool) -> (f64, f64) {
    let flat = |v: Vec3| if level { Vec3::new(v.x, v.y, 0.0) } else { v };
    let (along, x) = (flat(along), flat(x));
    let square = along.norm_squared();
    let t = if square > 0.0 { (x.dot(&along) / square).clamp(0.0, 1.0) } else { 0.0 };
    (t, (x - along * t).norm())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_finds_the_pass_that_left_it() {
        // Three passes along Y, 1 mm apart in X; their balls of radius 3 leave cusps half way.
        let pass = |k: u32| {
            let x = f64::from(k);
            (k, Curve::Line { from: Vec3::new(x, 0.0, 0.0), to: Vec3::new(x, 40.0, 0.0) })
        };
        let centres = Centres::new((0..3).map(pass), 3.0);
        let mut near = Vec::new();
        for (x, of) in [(0.9_f64, 1), (1.4, 1), (1.6, 2)] {
            let left = Vec3::new(x, 17.3, 3.0 - (9.0 - (x - f64::from(of)).powi(2)).sqrt());
            centres.near(Vec3::new(x, 17.3, 3.0), 3.0, &mut near);
            let found = centres.nearest(&near, left, &mut 0).expect("a pass");
            assert_eq!(found.of, of);
            assert!((found.distance_mm - 3.0).abs() < 1e-12 && (found.s_mm - 17.3).abs() < 1e-12);
        }
        // Above the centre the distance is that from the shank's axis.
        centres.near(Vec3::new(2.0, 5.0, 3.0), 4.0, &mut near);
        let beside = centres.nearest(&near, Vec3::new(5.0, 5.0, 9.0), &mut 0).expect("a pass");
        assert_eq!((beside.of, beside.distance_mm), (2, 3.0));
    }

    /// Passes over a wave and plunges between them.
    fn wave() -> Centres {
        let height = |x: f64, y: f64| 1.5 * (0.3 * x).sin() * (0.2 * y).cos();
        let mut curves = Vec::new();
        for pass in 0..9 {
            let y = 0.7 * f64::from(pass);
            let at = |x: f64| Vec3::new(x, y, height(x, y));
            curves.push(Curve::Line { from: at(0.0) + Vec3::new(0.0, 0.0, 4.0), to: at(0.0) });
            curves.extend((0..12).map(|k| Curve::Line { from: at(f64::from(k)), to: at(f64::from(k) + 1.0) }));
        }
        Centres::new(curves.into_iter().enumerate().map(|(k, curve)| (k as u32, curve)), 3.0)
    }

    /// Points below, beside and above the centres: each finds the piece that trying every piece finds.
    #[test]
    fn pieces_too_far_to_be_nearest_are_left_out_and_no_others() {
        let centres = wave();
        let mut near = Vec::new();
        let part = |k: u32, step: f64| (f64::from(k) * step).fract();
        let mut first = 0;
        for k in 0..2000 {
            let x = Vec3::new(12.0 * part(k, 0.618), 6.0 * part(k, 0.414), 9.0 * part(k, 0.732) - 2.0);
            centres.near(x, 12.0, &mut near);
            let found = centres.nearest(&near, x, &mut first).expect("a piece");
            let tried = near.iter().map(|near| centres.pieces[near.piece as usize].distance(x).1);
            assert!(found.distance_mm == tried.fold(f64::INFINITY, f64::min), "{x:?} {found:?}");
        }
    }

    /// Clouds of points as wide as a contact, and larger and higher ones: every point finds the same place before and after.
    #[test]
    fn pieces_left_out_for_a_cloud_of_points_are_nearest_to_none_of_them() {
        let centres = wave();
        let part = |k: u32, step: f64| (f64::from(k) * step).fract();
        let (mut near, mut listed, mut left_out) = (Vec::new(), 0, 0);
        for k in 0..300 {
            let at = Vec3::new(12.0 * part(k, 0.618), 6.0 * part(k, 0.414), 9.0 * part(k, 0.732) - 2.0);
            let size = [0.2, 0.8, 3.0][k as usize % 3];
            let off = |n: u32, step: f64| size * (part(n, step) - 0.5);
            let cloud = |n: u32| at + Vec3::new(off(n, 0.755), off(n, 0.57), off(n, 0.32));
            let points: Vec<Vec3> = (1..20).map(cloud).collect();
            centres.near(at, 12.0, &mut near);
            let all = near.clone();
            centres.narrow(&points, &mut near);
            (listed, left_out) = (listed + all.len(), left_out + all.len() - near.len());
            for x in points {
                let [before, after] = [&all, &near].map(|pieces| centres.nearest(pieces, x, &mut 0).expect("a piece"));
                assert_eq!((before.of, before.s_mm, before.distance_mm), (after.of, after.s_mm, after.distance_mm));
            }
        }
        assert!(3 * left_out > listed, "{left_out} of {listed}");
    }

    #[test]
    fn an_arc_is_followed_within_its_sagitta() {
        use crate::path::{Arc, Plane};
        let arc = Arc::new(
            Plane::Zx,
            Vec3::new(20.0, 0.0, 0.0),
            Vec3::new(0.0, 0.0, -20.0),
            Vec3::zeros(),
            std::f64::consts::FRAC_PI_2,
        );
        let centres = Centres::new(std::iter::once((7, Curve::Arc(arc))), 3.0);
        let mut near = Vec::new();
        for part in [0.1, 0.37, 0.8] {
            let s = part * arc.length();
            let centre = Curve::Arc(arc).point(s) + Vec3::new(0.0, 0.0, 3.0);
            centres.near(centre, 1.0, &mut near);
            let found = centres.nearest(&near, centre, &mut 0).expect("the arc");
            assert!(found.distance_mm < SAGITTA_MM && (found.s_mm - s).abs() < 1e-3, "{found:?}");
        }
    }
}
