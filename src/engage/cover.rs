//! Which angles of a circle are covered, exactly. In: a circle about the origin at some height, and what swept past it, in
//! the same frame. Out: the [`Gaps`] left.
//!
//! A disc (centre C, radius ρ) covers 2 r q·C ≥ r² + |C|² − ρ² of the directions q of a circle of radius r. A disc swept
//! along a line covers that of its two ends and, with u along the line and v across it, the part of the circle where u lies
//! between the ends and v within ρ of the line. A ball swept along an inclined line covers, below its axis, the discs of its
//! ends and between them what satisfies f(q) = (v − v₀)² + w² − R² ≤ 0 (w the distance from the axis in the upright plane
//! through it, linear in u, so f is a trigonometric polynomial of second degree with a bounded second derivative), and at
//! any height the columns above the axis. An arc covers a sector of a ring and two discs. Any other outline on a slope covers
//! at least what its narrowest disc at this height would and at most what its widest would; between these it is walked along
//! by its signed distance. Most of what is asked covers nothing of what is still open: that is found out first,
//! without roots or divisions.

use super::gaps::{Dir, Gaps, Interval, between, chord, root};
use crate::path::Vec3;
use crate::stock::{Disc, Form, Region, Swept, Track};
use std::f64::consts::{PI, TAU};

/// Distance below which a point counts as covered, mm: rounding of coordinates and f64.
pub const TOUCH_MM: f64 = 1e-7;
/// Parts of a rectangle shorter than this are passed over, mm: their ends could not be told apart.
const LEAST_MM: f64 = 1e-9;
/// Shortest stretch of a circle that a walk cannot overlook, mm.
const STEP_MM: f64 = 0.05;
/// How near to each other, rad, two places lie that are one: a border is known to this.
const LEAST_RAD: f64 = 1e-7;
/// What the end of a stretch may fall short of the point it begins at, by rounding, rad.
const ASIDE_RAD: f64 = 1e-5;
/// Width below which f is taken to have one sign where it has at both ends, rad.
const NARROW_RAD: f64 = 5e-4;

/// What one element swept, in the frame of the cutter: its axis the origin, the feed along x.
#[derive(Debug, Clone, Copy)]
pub struct Cover<'a> {
    swept: Swept<'a>,
    form: &'a Form,
    /// Where its track begins and ends in the plane.
    ends: [[f64; 2]; 2],
    /// Where its track ends, and whether the one prepared before it ends where this one begins.
    to: Vec3,
    joined: bool,
    /// Where a straight track begins, along itself and across, and its direction.
    base: [f64; 2],
    dir: [f64; 2],
    /// Its length, and cosine and sine of its rise.
    incline: [f64; 3],
    /// Distance of its beginning from the origin.
    off: f64,
    /// Distance of an arc from the origin, less the radius of its cutter.
    gap: f64,
}

impl<'a> Cover<'a> {
    /// Prepares a track given in the frame of the cutter; `before` is the cover prepared before it.
    pub fn new(track: &Track, form: &'a Form, before: Option<&Self>) -> Self {
        let swept = Swept::new(track, form);
        let (from, to) = track.ends();
        let joined =
            before.is_some_and(|before| std::ptr::eq(before.form, form) && (before.to - from).norm_squared() < 1e-18);
        let (base, dir, gap) = match swept {
            Swept::Line { dir: [dx, dy], .. } => {
                ([from.x * dx + from.y * dy, from.y * dx - from.x * dy], [dx, dy], f64::NEG_INFINITY)
            }
            Swept::Arc { ring, .. } => ([0.0; 2], [1.0, 0.0], Region::Ring(ring).distance([0.0; 2]) - form.radius),
        };
        let incline = match swept {
            Swept::Line { run, rise, .. } => {
                let length = (run * run + rise * rise).sqrt();
                let by = if length > 0.0 { 1.0 / length } else { 0.0 };
                [length, run * by, rise * by]
            }
            Swept::Arc { .. } => [0.0; 3],
        };
        let off = (base[0] * base[0] + base[1] * base[1]).sqrt();
        Self { swept, form, ends: [[from.x, from.y], [to.x, to.y]], to, joined, base, dir, incline, off, gap }
    }
    /// Lowest height of its tip, mm.
    pub fn lowest(&self) -> f64 {
        self.swept.lowest()
    }
    /// True when it leaves a level floor.
    pub fn leaves_floor(&self) -> bool {
        self.swept.leaves_floor()
    }
    /// True when what it covers of a cylinder changes at the height of its floor only.
    pub fn is_step(&self) -> bool {
        self.form.is_flat() && self.leaves_floor()
    }
    /// Covers what it can of a circle of radius `r` at height `z`.
    pub fn cover(&self, gaps: &mut Gaps, r: f64, z: f64) {
        let zeta = z - self.lowest();
        if zeta < 0.0 || gaps.is_empty() {
            return;
        }
        match self.swept {
            Swept::Arc { .. } => {
                if self.gap <= r {
                    self.arc(gaps, r, z);
                }
            }
            Swept::Line { from, rise, run, .. } => {
                if self.beside(gaps, r, zeta) {
                    return;
                }
                if rise.abs() < 1e-9 || run < 1e-9 {
                    if let Some(reach) = self.form.radius_below(zeta) {
                        self.capsule(gaps, r, [0.0, run], reach + TOUCH_MM);
                    }
                } else if self.form.is_ball() {
                    self.ball(gaps, r, z);
                } else if self.form.is_flat() {
                    self.capsule(gaps, r, part_below(from.z, rise, run, z), self.form.radius + TOUCH_MM);
                } else {
                    self.inclined(gaps, r, z);
                }
            }
        }
    }
    /// True when a straight line parts all that is open from what is swept at `zeta` above the lowest tip: across the
    /// middle of the gaps, when these are less than half the circle.
    fn beside(&self, gaps: &Gaps, r: f64, zeta: f64) -> bool {
        let Some([a, b]) = gaps.hull() else { return true };
        let middle = [a.at[0] + b.at[0], a.at[1] + b.at[1]];
        let square = middle[0] * middle[0] + middle[1] * middle[1];
        // Less than half the circle: the turn from the first to the last is to the left.
        if a.at[0] * b.at[1] - a.at[1] * b.at[0] <= 0.0 || square < 1e-6 {
            return false;
        }
        let along = |p: [f64; 2]| p[0] * middle[0] + p[1] * middle[1];
        let apart = r * a.along(middle) - along(self.ends[0]).max(along(self.ends[1]));
        if apart <= 0.0 {
            return false;
        }
        let radius = self.form.radius + 2.0 * TOUCH_MM;
        let reach = if self.form.is_ball() {
            if zeta < radius { zeta * (2.0 * radius - zeta) } else { radius * radius }
        } else if self.form.convex {
            // An outline that only widens is nowhere wider at this height than where its tip is lowest.
            let wide = self.form.radius_below(zeta).map_or(radius, |wide| wide + 2.0 * TOUCH_MM);
            wide * wide
        } else {
            radius * radius
        };
        apart * apart > reach * square
    }
    /// An outline on a slope: discs of several radii. Beyond the widest of them all along there is nothing covered, what the
    /// narrowest covers is, and what lies between is walked along.
    fn inclined(&self, gaps: &mut Gaps, r: f64, z: f64) {
        let Swept::Line { from, rise, run, .. } = self.swept else { return };
        let part = part_below(from.z, rise, run, z);
        let radius = |u: f64| self.form.radius_below((z - from.z - rise * u / run).max(0.0)).unwrap_or(0.0);
        let [a, b] = part.map(radius);
        let (narrow, wide) = (a.min(b), a.max(b));
        if wide - narrow < TOUCH_MM {
            self.capsule(gaps, r, part, wide + TOUCH_MM);
            return;
        }
        if self.misses(gaps, r, part, wide + 2.0 * TOUCH_MM) {
            return;
        }
        if self.form.convex {
            self.rolled(gaps, r, z);
            return;
        }
        let mut beyond = gaps.clone();
        self.capsule(&mut beyond, r, part, wide + 2.0 * TOUCH_MM);
        self.capsule(gaps, r, part, narrow);
        gaps.take(&beyond);
        self.walked(gaps, r, z);
        gaps.join(beyond);
    }
    /// What a bulging outline sweeps bulges too, and each point of the circle tells of a whole stretch: the disc that it lies in
    /// covers all that this disc does, and where it lies in none, nothing beyond the tangent of the nearest disc is covered. At a
    /// border both shrink to nothing as fast as Newton's steps, and a step of [`LEAST_RAD`] leads across.
    fn rolled(&self, gaps: &mut Gaps, r: f64, z: f64) {
        let Some(Region::Outline(outline)) = self.swept.at(z) else { return };
        for k in (0..gaps.0.len()).rev() {
            let [mut at, to] = gaps.0[k];
            let mut covered: Option<Dir> = None;
            loop {
                let Disc { centre, radius, distance } = outline.disc_about(at.at.map(|x| r * x));
                let reach = radius + TOUCH_MM;
                let within = distance <= TOUCH_MM;
                match (covered, within) {
                    (Some(from), false) => {
                        gaps.cover(from, at);
                        covered = None;
                    }
                    (None, true) => covered = Some(at),
                    _ => {}
                }
                let next =
                    if within { end_of_disc(&at, r, centre, reach) } else { end_of_clear(&at, r, centre, reach) };
                match next.filter(|next| next.key < to.key) {
                    Some(next) => at = next,
                    None => break,
                }
            }
            if let Some(from) = covered {
                gaps.cover(from, to);
            }
        }
    }
    fn walked(&self, gaps: &mut Gaps, r: f64, z: f64) {
        let Some(region) = self.swept.at(z).filter(|_| !gaps.is_empty()) else { return };
        let depth = |beta: f64| {
            let (sin, cos) = beta.sin_cos();
            region.distance([r * cos, r * sin]) - TOUCH_MM
        };
        gaps.keep_where(r, STEP_MM.min(0.03 * r), &depth);
    }
    /// True when a disc of radius `reach` along the part `u` of the track surely meets nothing that is open.
    fn misses(&self, gaps: &Gaps, r: f64, [u0, u1]: [f64; 2], reach: f64) -> bool {
        let meets_disc = |u: f64| {
            let [x, y] = self.turned([self.base[0] + u, self.base[1]]);
            gaps.may_meet([2.0 * r * x, 2.0 * r * y], r * r + x * x + y * y - reach * reach)
        };
        let along = [self.base[0] + u0, self.base[0] + u1];
        let across = [self.base[1] - reach, self.base[1] + reach];
        !meets_disc(u0) && !meets_disc(u1) && !self.may_meet(gaps, r, along, across)
    }
    /// A disc of radius `reach` along the part `u` of the track.
    fn capsule(&self, gaps: &mut Gaps, r: f64, [u0, u1]: [f64; 2], reach: f64) {
        let Swept::Line { run, .. } = self.swept else { return };
        for (u, end, whole) in [(u0, self.ends[0], 0.0), (u1, self.ends[1], run)] {
            let end = if u == whole { end } else { self.turned([self.base[0] + u, self.base[1]]) };
            disc(gaps, r, end, reach * reach);
        }
        let along = [self.base[0] + u0, self.base[0] + u1];
        let across = [self.base[1] - reach, self.base[1] + reach];
        if !self.may_meet(gaps, r, along, across) {
            return;
        }
        // The half of the circle to the left of the line, then the one to the right, as if seen from below.
        for (side, [low, high]) in [(1.0, across), (-1.0, [-across[1], -across[0]])] {
            if high < 0.0 || low >= r {
                continue;
            }
            let outer = if low > 0.0 { (r * r - low * low).sqrt() } else { r };
            let inner = if high < r { (r * r - high * high).sqrt() } else { 0.0 };
            let (from, to) = (along[0].max(-outer), along[1].min(outer));
            let parts =
                if inner > 0.0 { [[from, to.min(-inner)], [from.max(inner), to]] } else { [[from, to], [1.0, 0.0]] };
            for [from, to] in parts {
                if to - from > LEAST_MM {
                    self.cover_part(gaps, r, [from, to], side);
                }
            }
        }
    }
    /// Covers the part of the circle between `from` and `to` along the line on one side of it.
    fn cover_part(&self, gaps: &mut Gaps, r: f64, part: [f64; 2], side: f64) {
        let [from, to] = self.part(r, part, side);
        gaps.cover(from, to);
    }
    /// The part of the circle between two places along the line on one side of it, counter-clockwise.
    fn part(&self, r: f64, [from, to]: [f64; 2], side: f64) -> Interval {
        let place = |u: f64| {
            let along = (u / r).clamp(-1.0, 1.0);
            Dir::of(self.turned([along, side * ((1.0 - along) * (1.0 + along)).sqrt()]))
        };
        if side > 0.0 { [place(to), place(from)] } else { [place(from), place(to)] }
    }
    /// A point given along the line and across it, in the frame of the cutter.
    fn turned(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [dx, dy] = self.dir;
        [u * dx - v * dy, u * dy + v * dx]
    }
    /// False when a line along a side of the rectangle parts it from all gaps.
    fn may_meet(&self, gaps: &Gaps, r: f64, along: [f64; 2], across: [f64; 2]) -> bool {
        let [dx, dy] = self.dir;
        along[0] < r
            && along[1] > -r
            && across[0] < r
            && across[1] > -r
            && gaps.may_meet([dx, dy], along[0] / r)
            && gaps.may_meet([-dx, -dy], -along[1] / r)
            && gaps.may_meet([-dy, dx], across[0] / r)
            && gaps.may_meet([dy, -dx], -across[1] / r)
    }
    fn ball(&self, gaps: &mut Gaps, r: f64, z: f64) {
        let Swept::Line { from, rise, run, .. } = self.swept else { return };
        let radius = self.form.radius + TOUCH_MM;
        let above = z - from.z - self.form.radius;
        for (end, above) in self.ends.iter().zip([above, above - rise]).skip(usize::from(self.joined)) {
            disc(gaps, r, *end, radius * radius - above * above);
        }
        if above >= rise.min(0.0) {
            self.capsule(gaps, r, part_below(0.0, rise, run, above), radius);
        }
        if gaps.is_empty() {
            return;
        }
        let [length, cos, sin] = self.incline;
        // Along the axis: above sin + (u − base) cos; from it in the upright plane: above cos − (u − base) sin.
        let (per_run, turned) = (1.0 / cos, above * sin);
        let along = [self.base[0] - turned * per_run, self.base[0] + (length - turned) * per_run];
        let curve = Quadric {
            dir: self.dir,
            r,
            across: self.base[1],
            off: [above * cos + self.base[0] * sin, -sin],
            square: radius * radius,
            bend: bend(r, self.off, (turned - self.base[0] * cos).abs(), cos),
        };
        let off = [0, 1].map(|k| curve.off[0] + curve.off[1] * along[k]);
        let nearest = if off[0] * off[1] <= 0.0 { 0.0 } else { off[0].abs().min(off[1].abs()) };
        let reach = radius * radius - nearest * nearest;
        if reach <= 0.0 {
            return;
        }
        let reach = reach.sqrt();
        if self.may_meet(gaps, r, along, [self.base[1] - reach, self.base[1] + reach]) && !curve.misses(gaps) {
            for side in [1.0, -1.0] {
                curve.cover(gaps, self.part(r, along, side));
            }
        }
    }
    fn arc(&self, gaps: &mut Gaps, r: f64, z: f64) {
        let Swept::Arc { z: tip, ring, .. } = self.swept else { return };
        let Some(reach) = self.form.radius_below(z - tip) else { return };
        if (ring.radius[0] - ring.radius[1]).abs() > 1e-6 {
            self.walked(gaps, r, z);
            return;
        }
        let reach = reach + TOUCH_MM;
        for end in self.ends {
            disc(gaps, r, end, reach * reach);
        }
        let [x, y] = ring.centre;
        let (d, angle) = ((x * x + y * y).sqrt(), y.atan2(x));
        let middle = ring.radius[0];
        let outer = half_width(r, d, (middle + reach) * (middle + reach));
        let inner = if middle > reach { half_width(r, d, (middle - reach) * (middle - reach)) } else { 0.0 };
        for [from, to] in [[inner, outer], [-outer, -inner]] {
            let mut cuts = [from, to].to_vec();
            let crossings = [ring.start, ring.start + ring.sweep].map(|ray| crossings(ring.centre, ray, r));
            let inside = crossings.into_iter().flatten().map(|beta| turned(beta - angle, 0.5 * (from + to)));
            cuts.extend(inside.filter(|beta| (from..to).contains(beta)));
            cuts.sort_unstable_by(f64::total_cmp);
            for pair in cuts.windows(2) {
                let (sin, cos) = (0.5 * (pair[0] + pair[1]) + angle).sin_cos();
                if pair[0] < pair[1] && ring.passes([r * cos, r * sin]) {
                    gaps.cover_angles(pair[0] + angle, pair[1] + angle);
                }
            }
        }
    }
}

/// Part of a run along which a height `z0`, rising by `rise` in all, is at most `z`.
fn part_below(z0: f64, rise: f64, run: f64, z: f64) -> [f64; 2] {
    let u = ((z - z0) / rise).clamp(0.0, 1.0) * run;
    if rise > 0.0 { [0.0, u] } else { [u, run] }
}

/// Covers a circle of radius `r` by a disc with the square `square` of its radius.
fn disc(gaps: &mut Gaps, r: f64, [x, y]: [f64; 2], square: f64) {
    let Some([a, b]) = gaps.hull() else { return };
    if square <= 0.0 {
        return;
    }
    let d2 = x * x + y * y;
    let above = r * r + d2 - square;
    let twice = [2.0 * r * x, 2.0 * r * y];
    let (first, last) = (a.along(twice) >= above, b.along(twice) >= above);
    if !first && !last && !gaps.may_meet(twice, above) {
        return;
    }
    if d2 < 1e-24 {
        if above <= 0.0 {
            gaps.0.clear();
        }
        return;
    }
    if first && last && !gaps.may_meet([-twice[0], -twice[1]], -above) {
        gaps.0.clear();
        return;
    }
    let d = d2.sqrt();
    gaps.cover_cap([x / d, y / d], above / (2.0 * r * d));
}

/// Where a circle of radius `r` about the origin leaves a disc in which it is `at` one place; `None`: nowhere.
fn end_of_disc(at: &Dir, r: f64, [x, y]: [f64; 2], radius: f64) -> Option<Dir> {
    let d = (x * x + y * y).sqrt();
    let above = r * r + d * d - radius * radius;
    if d < 1e-12 || above <= -2.0 * r * d {
        return None;
    }
    end_of_cap(at, [x / d, y / d], above / (2.0 * r * d))
}

/// Where it comes back to the tangent of a disc that is nearest to a point `at` beyond it; `None`: nowhere.
fn end_of_clear(at: &Dir, r: f64, [x, y]: [f64; 2], radius: f64) -> Option<Dir> {
    let off = [r * at.at[0] - x, r * at.at[1] - y];
    let by = 1.0 / (off[0] * off[0] + off[1] * off[1]).sqrt();
    let normal = off.map(|x| x * by);
    let least = (normal[0] * x + normal[1] * y + radius) / r;
    if least <= -1.0 { None } else { end_of_cap(at, normal, least) }
}

/// The end, counter-clockwise, of the cap about a unit vector with a component of at least `least`, no nearer to `at`, which
/// lies in it, than [`LEAST_RAD`]; `None` where it lies beyond the turn that `at` is in.
fn end_of_cap(at: &Dir, [x, y]: [f64; 2], least: f64) -> Option<Dir> {
    let least = least.min(1.0);
    let side = ((1.0 - least) * (1.0 + least)).sqrt();
    let end = Dir::of([x * least - y * side, y * least + x * side]);
    let turn = at.at[0] * end.at[1] - at.at[1] * end.at[0];
    if at.along(end.at) > 0.0 && turn.abs() < LEAST_RAD || (turn < 0.0 && turn > -ASIDE_RAD && at.along(end.at) > 0.0) {
        let [cos, sin] = at.at;
        return ahead_of(at, Dir::of([cos - LEAST_RAD * sin, sin + LEAST_RAD * cos]));
    }
    ahead_of(at, end)
}

/// A direction, where it comes after another in the turn.
fn ahead_of(at: &Dir, next: Dir) -> Option<Dir> {
    (next.key > at.key).then_some(next)
}

/// Half the angle that a disc at distance `d` covers of a circle of radius `r`, the square of its radius given.
fn half_width(r: f64, d: f64, square: f64) -> f64 {
    let above = r * r + d * d - square;
    if d < 1e-12 {
        return if above <= 0.0 { PI } else { 0.0 };
    }
    (above / (2.0 * r * d)).clamp(-1.0, 1.0).acos()
}

/// Angles about the origin where a ray from `from` at `angle` crosses a circle of radius `r`.
fn crossings(from: [f64; 2], angle: f64, r: f64) -> Vec<f64> {
    let (sin, cos) = angle.sin_cos();
    let along = from[0] * cos + from[1] * sin;
    let root = along * along + r * r - from[0] * from[0] - from[1] * from[1];
    let half = if root >= 0.0 { root.sqrt() } else { f64::NAN };
    [-along - half, -along + half]
        .into_iter()
        .filter(|s| *s >= 0.0)
        .map(|s| (from[1] + s * sin).atan2(from[0] + s * cos))
        .collect()
}

/// `angle` in the turn about `middle`.
fn turned(angle: f64, middle: f64) -> f64 {
    angle - TAU * ((angle - middle) / TAU).round()
}

/// f(q) = (v − across)² + (off₀ + off₁ u)² − square at the point q of a circle of radius `r`, u along `dir` and v across;
/// its second derivative by the angle is at most `bend`.
struct Quadric {
    dir: [f64; 2],
    r: f64,
    across: f64,
    off: [f64; 2],
    square: f64,
    bend: f64,
}

/// Bound of the second derivative of f: from the terms −2 r q·A and −(τ₀ + τ₁ cos β′)² of the same function; `off` is |A|,
/// `along` |τ₀|, and τ₁ = r cos.
fn bend(r: f64, off: f64, along: f64, cos: f64) -> f64 {
    let p1 = cos * r;
    2.0 * r * off + 2.0 * p1 * (along + p1)
}

/// No less than the square of the angle between two directions, up to half a turn, from that of their chord.
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
    /// True when f > 0 in all gaps for certain: at their ends it is more than it can sink between.
    fn misses(&self, gaps: &Gaps) -> bool {
        gaps.0.iter().all(|[a, b]| {
            let [x, y] = [a.at[0] - b.at[0], a.at[1] - b.at[1]];
            // Nearly a turn has a short chord too.
            let ahead = b.key - a.key < 2.0;
            let sag = self.bend * angle_squared(x * x + y * y) / 8.0;
            ahead && self.at(a) > sag && self.at(b) > sag
        })
    }
    /// Covers where f ≤ 0 in an interval.
    fn cover(&self, gaps: &mut Gaps, [from, to]: Interval) {
        let parts =
            if from.key <= to.key { [[from.key, to.key], [1.0, 0.0]] } else { [[-2.0, to.key], [from.key, 2.0]] };
        // The last gap first: what is taken out of one leaves those before it where they are.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Profile, Segment};
    use crate::path::Vec3;

    /// Covered angles against the signed distance of the region, at many points of many circles.
    #[test]
    fn covers_agree_with_the_signed_distance() {
        let corner = Segment::Arc { centre: [2.0, 1.0], radius: 1.0, from_rad: -1.5, to_rad: -0.6 };
        let (from, to) = (corner.at(0.0).0, corner.at(1.0).0);
        let profile = Profile {
            segments: vec![
                Segment::Line { from: [0.0; 2], to: from },
                corner,
                Segment::Line { from: to, to: [4.0, 8.0] },
            ],
        };
        let forms = [
            Profile::flat(6.0, 20.0),
            Profile::ball(6.0, 20.0),
            Profile::bull(10.0, 2.0, 20.0),
            Profile::cone(8.0, 1.0, 1.5, 20.0),
            profile,
        ]
        .map(|p| Form::new(&p));
        let wave = |k: usize, a: f64| (k as f64 * a).sin();
        let mut looked_at = 0;
        for k in 0..6000 {
            let form = &forms[k % 7 % 5];
            let at = |b: f64| Vec3::new(4.0 * wave(k, 1.3 + b), 4.0 * wave(k, 2.1 + b), 1.5 * wave(k, 0.7 + b));
            let level = Vec3::new(1.0, 1.0, if k % 2 == 0 { 1.0 } else { 0.0 });
            let line = Track::Line {
                from: at(0.0).component_mul(&level),
                to: at(0.01 + 0.5 * wave(k, 0.1)).component_mul(&level),
            };
            let arc = Track::Arc {
                centre: [3.0 * wave(k, 1.1), 3.0 * wave(k, 1.9)],
                z: wave(k, 0.3),
                radius: [1.0 + 4.0 * wave(k, 0.9).abs(); 2],
                start: 3.0 * wave(k, 0.77),
                sweep: 7.0 * wave(k, 0.55),
            };
            let track = if k % 5 == 4 { arc } else { line };
            let (r, z) = (0.2 + 3.0 * wave(k, 0.4).abs(), 2.0 * wave(k, 0.6) + 1.0);
            // The whole circle, and one of which little is open: what lies beside that is found out without looking closer.
            let mut gaps = Gaps::whole();
            if k % 3 > 0 {
                gaps.cover_angles(2.9 * wave(k, 0.83), 2.9 * wave(k, 0.83) + 3.3 + 2.0 * wave(k, 0.29));
            }
            let before = gaps.clone();
            Cover::new(&track, form, None).cover(&mut gaps, r, z);
            let region = Swept::new(&track, form).at(z);
            for step in 0..360 {
                let beta = (f64::from(step) - 179.5).to_radians();
                let distance = region.map_or(1.0, |region| region.distance([r * beta.cos(), r * beta.sin()]));
                let [was_open, open] = [&before, &gaps]
                    .map(|gaps| gaps.0.iter().any(|gap| (gap[0].angle()..=gap[1].angle()).contains(&beta)));
                assert!(
                    distance.abs() < 1e-4 || open == (was_open && distance > 0.0),
                    "{k}: {track:?} r {r} z {z} at {beta}: {distance}"
                );
                looked_at += usize::from(distance < 0.0);
            }
        }
        assert!(looked_at > 10_000, "{looked_at}");
    }
}
