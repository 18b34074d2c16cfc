//! Which angles of a circle are covered, exactly. In: a circle about the origin at some height, and what swept past it, in
//! the same frame. Out: the [`Gaps`] left.
//!
//! A disc (distance d, radius ρ) covers cos(β − β₀) ≥ (r² + d² − ρ²)/(2 r d) of a circle of radius r. A disc swept along a
//! line covers that of its two ends and, in angles β′ from the line, the part where r cos β′ lies between the ends and
//! r sin β′ within ρ of the line. A ball swept along an inclined line covers, below its axis, the discs of its ends and
//! what satisfies f(β′) = |q − A|² − τ² − R² ≤ 0 between them (τ along the axis, linear in cos β′, so f is a trigonometric
//! polynomial of second degree with a bounded second derivative), and at any height the columns above the axis. An arc
//! covers a sector of a ring and two discs. Whatever else there is is walked along by its signed distance.

use crate::path::Vec3;
use crate::stock::{Form, Region, Swept, Track};
use std::f64::consts::{PI, TAU};

/// Distance below which a point counts as covered, mm: rounding of coordinates and f64.
pub const TOUCH_MM: f64 = 1e-7;
/// Shortest stretch of a circle that a walk cannot overlook, mm.
const STEP_MM: f64 = 0.05;
/// Width below which f is taken to have one sign where it has at both ends, rad.
const NARROW_RAD: f64 = 5e-4;

/// Angles of a circle that nothing covers: sorted, disjoint, within [−π, π].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Gaps(pub Vec<[f64; 2]>);

impl Gaps {
    /// Takes away the angles from `from` to `to`, in whichever turn they are given.
    pub fn cover(&mut self, from: f64, to: f64) {
        let (Some(first), Some(last)) = (self.0.first(), self.0.last()) else { return };
        let (first, last) = (first[0], last[1]);
        for by in [-TAU, 0.0, TAU] {
            if from + by < last && to + by > first {
                self.cut(from + by, to + by);
            }
        }
    }
    fn cut(&mut self, from: f64, to: f64) {
        let mut k = 0;
        while let Some([a, b]) = self.0.get(k).copied() {
            if to <= a {
                break;
            }
            match (from >= b, from > a, to < b) {
                (true, ..) => k += 1,
                (_, true, true) => {
                    self.0[k] = [a, from];
                    self.0.insert(k + 1, [to, b]);
                    break;
                }
                (_, true, false) => {
                    self.0[k] = [a, from];
                    k += 1;
                }
                (_, false, true) => {
                    self.0[k] = [to, b];
                    break;
                }
                (_, false, false) => {
                    self.0.remove(k);
                }
            }
        }
    }
    /// Covers where cos(β − `angle`) ≥ `least`.
    pub fn cover_beyond(&mut self, angle: f64, least: f64) {
        if least < 1.0 {
            let half = if least <= -1.0 { PI } else { least.acos() };
            self.cover(angle - half, angle + half);
        }
    }
    /// Keeps only where `depth` is positive, walking by its value: it must be a signed distance on the circle.
    pub fn keep_where(&mut self, radius: f64, shortest: f64, depth: &impl Fn(f64) -> f64) {
        let gaps = std::mem::take(&mut self.0);
        for gap in gaps {
            walk(depth, gap, radius, shortest, &mut self.0);
        }
    }
    /// Keeps only where `inside` a point of the circle is positive, looked at every `step` along it. A point is given by
    /// cosine and sine of its angle.
    pub fn keep_points(&mut self, radius: f64, step: f64, inside: &impl Fn(f64, f64) -> f64) {
        let gaps = std::mem::take(&mut self.0);
        for [from, to] in gaps {
            let count = ((to - from) * radius / step).ceil().max(1.0);
            let by = (to - from) / count;
            let (sin_by, cos_by) = by.sin_cos();
            let (mut sin, mut cos) = from.sin_cos();
            let mut last = inside(cos, sin);
            let mut open = (last > 0.0).then_some(from);
            for k in 1..=count as usize {
                (sin, cos) = (sin * cos_by + cos * sin_by, cos * cos_by - sin * sin_by);
                let next = inside(cos, sin);
                if (next > 0.0) != (last > 0.0) {
                    // Linear between the two: the heights are so between cells.
                    let boundary = from + by * ((k - 1) as f64 + last / (last - next));
                    match open.take() {
                        Some(from) => self.0.push([from, boundary]),
                        None => open = Some(boundary),
                    }
                }
                last = next;
            }
            self.0.extend(open.map(|from| [from, to]));
        }
    }
    fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// A point in the plane by distance and angle.
#[derive(Debug, Clone, Copy)]
struct Polar {
    d: f64,
    angle: f64,
}

impl Polar {
    fn of([x, y]: [f64; 2]) -> Self {
        Self { d: (x * x + y * y).sqrt(), angle: y.atan2(x) }
    }
}

/// What one element swept, in the frame of the cutter: its axis the origin, the feed along x.
#[derive(Debug, Clone, Copy)]
pub struct Cover<'a> {
    swept: Swept<'a>,
    form: &'a Form,
    /// Distance of its track from the origin, less the radius of its cutter.
    gap: f64,
    ends: [Polar; 2],
    /// Where its track ends, and whether the one prepared before it ends where this one begins.
    to: Vec3,
    joined: bool,
    /// Where a straight track begins, along itself and across, and the angle of its direction.
    base: [f64; 2],
    angle: f64,
}

impl<'a> Cover<'a> {
    /// Prepares a track given in the frame of the cutter; `before` is the cover prepared before it.
    pub fn new(track: &Track, form: &'a Form, before: Option<&Self>) -> Self {
        let swept = Swept::new(track, form);
        let (from, to) = track.ends();
        let joined = before.is_some_and(|before| std::ptr::eq(before.form, form) && (before.to - from).norm() < 1e-9);
        let (base, angle, gap) = match swept {
            Swept::Line { dir: [dx, dy], run, .. } => {
                let base = [from.x * dx + from.y * dy, from.y * dx - from.x * dy];
                let off = -base[0] - (-base[0]).clamp(0.0, run);
                (base, dy.atan2(dx), (off * off + base[1] * base[1]).sqrt())
            }
            Swept::Arc { ring, .. } => ([0.0; 2], 0.0, Region::Ring(ring).distance([0.0; 2])),
        };
        let ends = [from, to].map(|end| Polar::of([end.x, end.y]));
        Self { swept, form, gap: gap - form.radius, ends, to, joined, base, angle }
    }
    /// Lowest height of its tip, mm.
    pub fn lowest(&self) -> f64 {
        self.swept.lowest()
    }
    /// True when it leaves a level floor.
    pub fn leaves_floor(&self) -> bool {
        self.swept.leaves_floor()
    }
    /// Covers what it can of a circle of radius `r` at height `z`.
    pub fn cover(&self, gaps: &mut Gaps, r: f64, z: f64) {
        if self.gap > r || gaps.is_empty() {
            return;
        }
        match self.swept {
            Swept::Arc { .. } => self.arc(gaps, r, z),
            Swept::Line { from, rise, run, .. } => {
                let zeta = z - (from.z + rise.min(0.0));
                if zeta < 0.0 {
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
                    self.walked(gaps, r, z);
                }
            }
        }
    }
    fn walked(&self, gaps: &mut Gaps, r: f64, z: f64) {
        let Some(region) = self.swept.at(z) else { return };
        let depth = |beta: f64| {
            let (sin, cos) = beta.sin_cos();
            region.distance([r * cos, r * sin]) - TOUCH_MM
        };
        gaps.keep_where(r, STEP_MM.min(0.03 * r), &depth);
    }
    /// A disc of radius `reach` along the part `u` of the track.
    fn capsule(&self, gaps: &mut Gaps, r: f64, [u0, u1]: [f64; 2], reach: f64) {
        let Swept::Line { run, .. } = self.swept else { return };
        for (u, end, whole) in [(u0, self.ends[0], 0.0), (u1, self.ends[1], run)] {
            let end = if u == whole { end } else { self.point(u) };
            disc(gaps, r, end, reach * reach);
        }
        let Some(along) = arccos_range((self.base[0] + u0) / r, (self.base[0] + u1) / r) else { return };
        let (low, high) = ((self.base[1] - reach) / r, (self.base[1] + reach) / r);
        if low >= 1.0 || high <= -1.0 || gaps.is_empty() {
            return;
        }
        let (b0, b1) = (low.max(-1.0).asin(), high.min(1.0).asin());
        let mirrored = [-along[1], -along[0]];
        for (a, b) in
            [(along, [b0, b1]), (along, [PI - b1, PI - b0]), (mirrored, [b0, b1]), (mirrored, [-PI - b1, -PI - b0])]
        {
            let (from, to) = (a[0].max(b[0]), a[1].min(b[1]));
            if from < to {
                gaps.cover(from + self.angle, to + self.angle);
            }
        }
    }
    fn point(&self, u: f64) -> Polar {
        let (x, y) = (self.base[0] + u, self.base[1]);
        let polar = Polar::of([x, y]);
        Polar { angle: polar.angle + self.angle, ..polar }
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
        let length = (run * run + rise * rise).sqrt();
        let (cos, sin) = (run / length, rise / length);
        let p0 = above * sin - self.base[0] * cos;
        let p1 = cos * r;
        let Some(along) = arccos_range(-p0 / p1, (length - p0) / p1) else { return };
        let [u, v] = self.base;
        let curve = Quadric {
            constant: r * r + u * u + v * v + above * above - radius * radius,
            linear: [-2.0 * r * u, -2.0 * r * v],
            axis: [p0, p1],
            bend: 2.0 * r * (u * u + v * v).sqrt() + 2.0 * p1 * (p0.abs() + p1),
        };
        for interval in [along, [-along[1], -along[0]]] {
            curve.cover(gaps, interval, self.angle);
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
        let centre = Polar::of(ring.centre);
        let middle = ring.radius[0];
        let outer = half_width(r, centre.d, (middle + reach) * (middle + reach));
        let inner = if middle > reach { half_width(r, centre.d, (middle - reach) * (middle - reach)) } else { 0.0 };
        for [from, to] in [[inner, outer], [-outer, -inner]] {
            let mut cuts = [from, to].to_vec();
            let crossings = [ring.start, ring.start + ring.sweep].map(|ray| crossings(ring.centre, ray, r));
            let inside = crossings.into_iter().flatten().map(|beta| turned(beta - centre.angle, 0.5 * (from + to)));
            cuts.extend(inside.filter(|beta| (from..to).contains(beta)));
            cuts.sort_unstable_by(f64::total_cmp);
            for pair in cuts.windows(2) {
                let (sin, cos) = (0.5 * (pair[0] + pair[1]) + centre.angle).sin_cos();
                if pair[0] < pair[1] && ring.passes([r * cos, r * sin]) {
                    gaps.cover(pair[0] + centre.angle, pair[1] + centre.angle);
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
fn disc(gaps: &mut Gaps, r: f64, centre: Polar, square: f64) {
    if square <= 0.0 || gaps.is_empty() {
        return;
    }
    let above = r * r + centre.d * centre.d - square;
    if centre.d < 1e-12 {
        if above <= 0.0 {
            gaps.0.clear();
        }
        return;
    }
    gaps.cover_beyond(centre.angle, above / (2.0 * r * centre.d));
}

/// Half the angle that a disc at distance `d` covers of a circle of radius `r`.
fn half_width(r: f64, d: f64, square: f64) -> f64 {
    let above = r * r + d * d - square;
    if d < 1e-12 {
        return if above <= 0.0 { PI } else { 0.0 };
    }
    (above / (2.0 * r * d)).clamp(-1.0, 1.0).acos()
}

/// Angles in [0, π] whose cosine lies between two values.
fn arccos_range(low: f64, high: f64) -> Option<[f64; 2]> {
    (low < 1.0 && high > -1.0 && low < high).then(|| [high.min(1.0).acos(), low.max(-1.0).acos()])
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

/// f(β′) = constant + linear · (cos β′, sin β′) − (axis₀ + axis₁ cos β′)², |f″| ≤ bend.
struct Quadric {
    constant: f64,
    linear: [f64; 2],
    axis: [f64; 2],
    bend: f64,
}

impl Quadric {
    fn at(&self, beta: f64) -> f64 {
        let (sin, cos) = beta.sin_cos();
        let along = self.axis[0] + self.axis[1] * cos;
        self.constant + self.linear[0] * cos + self.linear[1] * sin - along * along
    }
    /// Covers where f ≤ 0 in an interval of β′, given in gaps of β = β′ + `shift`.
    fn cover(&self, gaps: &mut Gaps, [low, high]: [f64; 2], shift: f64) {
        let mut covered = Vec::new();
        for [a, b] in &gaps.0 {
            for by in [shift - TAU, shift, shift + TAU] {
                let (from, to) = ((a - by).max(low), (b - by).min(high));
                if from < to {
                    self.negative([from, self.at(from)], [to, self.at(to)], by, &mut covered);
                }
            }
        }
        for [from, to] in covered {
            gaps.cover(from, to);
        }
    }
    /// Appends where f ≤ 0 between two points (argument, value), shifted.
    fn negative(&self, a: [f64; 2], b: [f64; 2], by: f64, out: &mut Vec<[f64; 2]>) {
        let width = b[0] - a[0];
        let sag = self.bend * width * width / 8.0;
        let (below, above) = (a[1] <= 0.0, b[1] <= 0.0);
        if below == above && (width < NARROW_RAD || a[1].abs().min(b[1].abs()) > sag) {
            if below {
                out.push([a[0] + by, b[0] + by]);
            }
        } else if below != above && (width < NARROW_RAD || (a[1] - b[1]).abs() > 4.0 * sag) {
            let root = root(&|beta| self.at(beta), [a[0], b[0]], [a[1], b[1]]);
            out.push(if below { [a[0] + by, root + by] } else { [root + by, b[0] + by] });
        } else {
            let middle = 0.5 * (a[0] + b[0]);
            let middle = [middle, self.at(middle)];
            self.negative(a, middle, by, out);
            self.negative(middle, b, by, out);
        }
    }
}

/// Appends the intervals of `window` in which `depth` is positive.
fn walk(depth: &impl Fn(f64) -> f64, window: [f64; 2], radius: f64, shortest: f64, out: &mut Vec<[f64; 2]>) {
    let (mut at, mut value) = (window[0], depth(window[0]));
    let mut open = (value > 0.0).then_some(at);
    while at < window[1] {
        let next = (at + value.abs().max(shortest) / radius).min(window[1]);
        let next_value = depth(next);
        if (next_value > 0.0) != (value > 0.0) {
            let boundary = root(depth, [at, next], [value, next_value]);
            match open.take() {
                Some(from) => out.push([from, boundary]),
                None => open = Some(boundary),
            }
        }
        (at, value) = (next, next_value);
    }
    if let Some(from) = open {
        out.push([from, window[1]]);
    }
}

/// Root of a function that changes sign on an interval: regula falsi (Illinois), to 1e-7 rad.
fn root(f: &impl Fn(f64) -> f64, [mut a, mut b]: [f64; 2], [mut fa, mut fb]: [f64; 2]) -> f64 {
    let mut side = 0;
    for _ in 0..60 {
        if b - a < 1e-7 {
            break;
        }
        let x = ((a * fb - b * fa) / (fb - fa)).clamp(a, b);
        let fx = f(x);
        if fx.abs() < 2e-8 {
            return x;
        }
        if (fx > 0.0) == (fb > 0.0) {
            (b, fb) = (x, fx);
            if side == -1 {
                fa *= 0.5;
            }
            side = -1;
        } else {
            (a, fa) = (x, fx);
            if side == 1 {
                fb *= 0.5;
            }
            side = 1;
        }
    }
    0.5 * (a + b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Profile;
    use crate::path::Vec3;

    /// Covered angles against the signed distance of the region, at many points of many circles.
    #[test]
    fn covers_agree_with_the_signed_distance() {
        let forms =
            [Profile::flat(6.0, 20.0), Profile::ball(6.0, 20.0), Profile::bull(10.0, 2.0, 20.0)].map(|p| Form::new(&p));
        let wave = |k: usize, a: f64| (k as f64 * a).sin();
        let mut looked_at = 0;
        for k in 0..3000 {
            let form = &forms[k % 3];
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
            let mut gaps = Gaps(vec![[-PI, PI]]);
            Cover::new(&track, form, None).cover(&mut gaps, r, z);
            let region = Swept::new(&track, form).at(z);
            for step in 0..360 {
                let beta = (f64::from(step) - 179.5).to_radians();
                let distance = region.map_or(1.0, |region| region.distance([r * beta.cos(), r * beta.sin()]));
                let open = gaps.0.iter().any(|gap| (gap[0]..=gap[1]).contains(&beta));
                assert!(
                    distance.abs() < 1e-4 || open == (distance > 0.0),
                    "{k}: {track:?} r {r} z {z} at {beta}: {distance}"
                );
                looked_at += usize::from(distance < 0.0);
            }
        }
        assert!(looked_at > 10_000, "{looked_at}");
    }
}
