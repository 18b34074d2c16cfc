//! The angles of a circle that a swept region covers, exactly. In: a circle about the cutter's axis at some height, and the track of an
//! element in the same frame. Out: the [`Gaps`] that are left.
//!
//! A disc (centre C, radius ρ) covers 2 r q·C ≥ r² + |C|² − ρ² of the directions q of a circle of radius r. A disc swept
//! along a line covers that of its two ends and, with u along the line and v across it, the part of the circle where u lies
//! between the ends and v within ρ of the line. A ball swept along an inclined line covers, below its axis, the discs of its
//! ends and between them what satisfies f(q) = (v − v₀)² + w² − R² ≤ 0 (w the distance from the axis in the upright plane
//! through it, linear in u, so f is a trigonometric polynomial of second degree with a bounded second derivative), and at
//! any height the columns above the axis. An arc covers a sector of a ring and two discs. Any other outline on a slope covers at least what
//! its narrowest disc at this height would and at most what its widest would; between these two the circle is followed in steps by the
//! signed distance to the region. Most queries cover nothing of what is still open; that is tested first, without roots or divisions.

use super::discs::{disc, end_of_clear, end_of_disc, half_width};
use super::gaps::{Dir, Gaps, Interval};
use super::quadric::{Quadric, bend};
use crate::path::Vec3;
use crate::stock::{Disc, Form, Region, Swept, Track};
use std::f64::consts::TAU;

/// Distance below which a point counts as covered, mm: rounding of coordinates and f64.
pub const TOUCH_MM: f64 = 1e-7;
/// Parts of a rectangle shorter than this are ignored, mm: rounding would not keep their ends apart.
const LEAST_MM: f64 = 1e-9;
/// Shortest stretch of a circle that a walk cannot overlook, mm.
const STEP_MM: f64 = 0.05;

/// The region that one element swept, in the frame of the cutter: its axis is the origin, the feed runs along x.
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
    /// Removes from `gaps` what the region covers of a circle of radius `r` at height `z`.
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
    /// Quick test: is the region at `zeta` above the lowest tip separated from all gaps by the straight line across their middle? Only
    /// where the gaps span less than half the circle.
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
    /// An outline on a slope sweeps discs of several radii. What the narrowest disc covers all along is covered; nothing beyond the widest
    /// is; the circle between the two is followed in steps.
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
    /// A convex outline sweeps a convex region, so each point of the circle decides a whole stretch. If the point lies in a disc, all of the
    /// circle in that disc is covered; if it lies in none, nothing is covered up to the tangent of the nearest disc. Towards a border both
    /// stretches shrink as fast as Newton steps, and a step of [`LEAST_RAD`](super::discs::LEAST_RAD) crosses it.
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
    /// Quick test: does a disc of radius `reach` along the part `u` of the track certainly miss all gaps?
    fn misses(&self, gaps: &Gaps, r: f64, [u0, u1]: [f64; 2], reach: f64) -> bool {
        let meets_disc = |u: f64| {
            let [x, y] = self.turned([self.base[0] + u, self.base[1]]);
            gaps.may_meet([2.0 * r * x, 2.0 * r * y], r * r + x * x + y * y - reach * reach)
        };
        let along = [self.base[0] + u0, self.base[0] + u1];
        let across = [self.base[1] - reach, self.base[1] + reach];
        !meets_disc(u0) && !meets_disc(u1) && !self.may_meet(gaps, r, along, across)
    }
    /// Covers with a disc of radius `reach` that is swept along the part `u` of the track.
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
        // The half of the circle to the left of the line, then the right one, mirrored.
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
    /// A point given along the line and across it, transformed into the frame of the cutter.
    fn turned(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [dx, dy] = self.dir;
        [u * dx - v * dy, u * dy + v * dx]
    }
    /// Quick test: false if a line along a side of the rectangle separates it from all gaps.
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

/// `angle` shifted by whole turns to within half a turn of `middle`.
fn turned(angle: f64, middle: f64) -> f64 {
    angle - TAU * ((angle - middle) / TAU).round()
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
