//! The part of a circle that a ball on an inclined line covers between its ends: f(q) ≤ 0 with the quadric f of [`super::cover`]. In: f, the
//! gaps of the circle. Out: the gaps that are left. f is a trigonometric polynomial of second degree with a bounded second derivative, so
//! its sign between two points follows from few values.

use super::gaps::{Dir, Gaps, Interval, between, chord, root};
use std::f64::consts::PI;

/// An interval narrower than this, at both ends of which f has one sign, has that sign all over, rad.
const NARROW_RAD: f64 = 5e-4;

/// f(q) = (v − across)² + (off₀ + off₁ u)² − square at the point q of a circle of radius `r`, u along `dir` and v across;
/// its second derivative by the angle is at most `bend`.
pub(super) struct Quadric {
    /// Unit direction of the axis in the plane.
    pub dir: [f64; 2],
    /// Radius of the circle, mm.
    pub r: f64,
    /// The offset `across`, mm.
    pub across: f64,
    /// off₀, mm, and off₁.
    pub off: [f64; 2],
    /// The constant `square`, mm².
    pub square: f64,
    /// Bound of the second derivative ([`bend`]), mm².
    pub bend: f64,
}

/// Bound of the second derivative of f: from the terms −2 r q·A and −(τ₀ + τ₁ cos β′)² of the same function; `off` is |A|,
/// `along` |τ₀|, and τ₁ = r cos.
pub(super) fn bend(r: f64, off: f64, along: f64, cos: f64) -> f64 {
    let p1 = cos * r;
    2.0 * r * off + 2.0 * p1 * (along + p1)
}

/// An upper bound of the squared angle between two directions, up to half a turn, from the square of their chord.
fn angle_squared(chord_squared: f64) -> f64 {
    let long = 1.0 + 0.0925 * chord_squared;
    if chord_squared < 2.0 { chord_squared * long * long } else { PI * PI }
}

impl Quadric {
    #[inline]
    fn at(&self, dir: &Dir) -> f64 {
        let [x, y] = [self.r * dir.at[0], self.r * dir.at[1]];
        let u = x * self.dir[0] + y * self.dir[1];
        let v = y * self.dir[0] - x * self.dir[1] - self.across;
        let off = self.off[0] + self.off[1] * u;
        v * v + off * off - self.square
    }
    /// Is f certainly positive in all gaps? It is where its values at the ends exceed what it can fall in between.
    pub fn misses(&self, gaps: &Gaps) -> bool {
        gaps.0.iter().all(|[a, b]| {
            let [x, y] = [a.at[0] - b.at[0], a.at[1] - b.at[1]];
            // Nearly a turn has a short chord too.
            let ahead = b.key - a.key < 2.0;
            let sag = self.bend * angle_squared(x * x + y * y) / 8.0;
            ahead && self.at(a) > sag && self.at(b) > sag
        })
    }
    /// Covers where f ≤ 0 in an interval.
    pub fn cover(&self, gaps: &mut Gaps, [from, to]: Interval) {
        let parts =
            if from.key <= to.key { [[from.key, to.key], [1.0, 0.0]] } else { [[-2.0, to.key], [from.key, 2.0]] };
        // From the last gap to the first, so that changing one does not move those still to come.
        for k in (0..gaps.0.len()).rev() {
            let [a, b] = gaps.0[k];
            for [low, high] in parts {
                let first = if a.key >= low { a } else { Dir { key: low, ..from } };
                let last = if b.key <= high { b } else { Dir { key: high, ..to } };
                if first.key < last.key && low < high {
                    self.negative((first, self.at(&first)), (last, self.at(&last)), gaps);
                }
            }
        }
    }
    /// Covers where f ≤ 0 between two points (direction, value) of a gap.
    fn negative(&self, a: (Dir, f64), b: (Dir, f64), gaps: &mut Gaps) {
        let chord = chord(&a.0, &b.0);
        // No less than the angle, up to half a turn.
        let width = if chord * chord < 2.0 { chord * (1.0 + 0.0925 * chord * chord) } else { PI };
        let sag = self.bend * width * width / 8.0;
        let (below, above) = (a.1 <= 0.0, b.1 <= 0.0);
        if below == above && (width < NARROW_RAD || a.1.abs().min(b.1.abs()) > sag) {
            if below {
                gaps.cover(a.0, b.0);
            }
        } else if below != above && (width < NARROW_RAD || (a.1 - b.1).abs() > 4.0 * sag) {
            let place = |part: f64| between(&a.0, &b.0, part);
            let root = place(root(&|part| self.at(&place(part)), [0.0, 1.0], [a.1, b.1], 1e-7 / width));
            let [from, to] = if below { [a.0, root] } else { [root, b.0] };
            gaps.cover(from, to);
        } else {
            let middle = halfway(&a.0, &b.0);
            let middle = (middle, self.at(&middle));
            self.negative(a, middle, gaps);
            self.negative(middle, b, gaps);
        }
    }
}

/// The direction in the middle of an interval of at most half a turn.
fn halfway(a: &Dir, b: &Dir) -> Dir {
    if a.along(b.at) > -0.99 {
        return between(a, b, 0.5);
    }
    // Nearly opposite: square to the line from the one to the other.
    let by = 1.0 / chord(a, b);
    Dir::of([(b.at[1] - a.at[1]) * by, (a.at[0] - b.at[0]) * by])
}
