//! The exact region that an element clears at one height. In: an element's track, its cutter's profile, a height. Out: a plane [`Region`]
//! with a signed distance g(x, y), mm: negative inside (cleared), positive outside.
//!
//! A cutter with radius r(ζ) at height ζ above its tip, moving along c(t), clears at height z the discs
//! |p − c_xy(t)| < r(z − c_z(t)). g is the least of |p − c_xy(t)| − r(z − c_z(t)) over t (for balls: the distance in space
//! to the axis of the sweep, less the radius), so its sign is exact and |∇g| ≤ 1: a walk along a circle may step |g|
//! without missing a boundary. Level moves, arcs, balls, flat ends and cones have closed forms; a torus on a ramp is a
//! convex function of t whose slope is brought to zero by Newton's steps.

use super::element::Track;
use super::form::{Form, Reach};
use crate::machine::Segment;
use crate::path::Vec3;

/// Radii of an arc that differ by less than this are one: a hundredth of what counts as touching, mm.
const SAME_RADIUS_MM: f64 = 1e-9;

/// Plane region cleared at one height.
#[derive(Debug, Clone, Copy)]
pub enum Region<'a> {
    /// A disc swept along a straight line.
    Capsule(Capsule),
    /// A disc swept along an arc.
    Ring(Ring),
    /// A ball swept along an inclined line.
    Ball(Ball),
    /// Any outline swept along an inclined line.
    Outline(Outline<'a>),
}

/// A disc of `radius` swept from `from` along the unit vector `dir` for `length`.
#[derive(Debug, Clone, Copy)]
pub struct Capsule {
    from: [f64; 2],
    dir: [f64; 2],
    length: f64,
    radius: f64,
}

/// A disc of radius `reach` swept along an arc.
#[derive(Debug, Clone, Copy)]
pub struct Ring {
    /// Centre of the arc.
    pub centre: [f64; 2],
    /// Its radius at start and end.
    pub radius: [f64; 2],
    /// Angle of its start.
    pub start: f64,
    /// Angle turned.
    pub sweep: f64,
    ends: [[f64; 2]; 2],
    reach: f64,
}

/// A ball swept along an inclined line, cut at height `z` (relative to the first centre), everything above it cleared too.
#[derive(Debug, Clone, Copy)]
pub struct Ball {
    from: [f64; 2],
    dir: [f64; 2],
    run: f64,
    rise: f64,
    length: f64,
    radius: f64,
    z: f64,
}

/// An outline swept along an inclined line, cut at height `z` (relative to the first tip position).
#[derive(Debug, Clone, Copy)]
pub struct Outline<'a> {
    form: &'a Form,
    from: [f64; 2],
    dir: [f64; 2],
    run: f64,
    rise: f64,
    z: f64,
}

/// The volume that one element sweeps, prepared for queries at given heights.
#[derive(Debug, Clone, Copy)]
pub enum Swept<'a> {
    /// Along a straight line.
    Line {
        /// Its cutter.
        form: &'a Form,
        /// Start of the tip.
        from: Vec3,
        /// Unit direction in the plane.
        dir: [f64; 2],
        /// Length in the plane, mm.
        run: f64,
        /// Rise of the tip, mm.
        rise: f64,
    },
    /// Along a level arc; at each height a disc of one radius clears it.
    Arc {
        /// Its cutter.
        form: &'a Form,
        /// Height of the tip, mm.
        z: f64,
        /// The ring; its reach is filled in for each height.
        ring: Ring,
    },
}

impl<'a> Swept<'a> {
    /// Prepares an element.
    pub fn new(track: &Track, form: &'a Form) -> Self {
        match *track {
            Track::Line { from, to } => {
                let delta = to - from;
                let run = norm(delta.x, delta.y);
                let dir = if run > 0.0 { [delta.x / run, delta.y / run] } else { [1.0, 0.0] };
                Swept::Line { form, from, dir, run, rise: delta.z }
            }
            Track::Arc { centre, z, radius, start, sweep } => {
                let end = |angle: f64, r: f64| [centre[0] + r * angle.cos(), centre[1] + r * angle.sin()];
                let ends = [end(start, radius[0]), end(start + sweep, radius[1])];
                Swept::Arc { form, z, ring: Ring { centre, radius, start, sweep, ends, reach: 0.0 } }
            }
        }
    }
    /// Lowest height of its tip, mm.
    pub fn lowest(&self) -> f64 {
        match self {
            Swept::Line { from, rise, .. } => from.z + rise.min(0.0),
            Swept::Arc { z, .. } => *z,
        }
    }
    /// True when its cutter has a flat bottom and stays level, or plunges: it leaves a floor.
    pub fn leaves_floor(&self) -> bool {
        match self {
            Swept::Line { form, rise, run, .. } => form.flat_bottom && (rise.abs() < 1e-9 || *run < 1e-9),
            Swept::Arc { form, .. } => form.flat_bottom,
        }
    }
    /// The region it clears at height `z`; `None` when it stays above `z`.
    pub fn at(&self, z: f64) -> Option<Region<'a>> {
        match *self {
            Swept::Arc { form, z: tip, mut ring } => {
                ring.reach = form.radius_below(z - tip)?;
                Some(Region::Ring(ring))
            }
            Swept::Line { form, from, dir, run, rise } => line_region(form, from, dir, [run, rise], z),
        }
    }
}

fn line_region(form: &Form, from: Vec3, dir: [f64; 2], [run, rise]: [f64; 2], z: f64) -> Option<Region<'_>> {
    let start = [from.x, from.y];
    let zeta = z - (from.z + rise.min(0.0));
    if zeta < 0.0 {
        return None;
    }
    if rise.abs() < 1e-9 || run < 1e-9 {
        let radius = form.radius_below(zeta)?;
        return Some(Region::Capsule(Capsule { from: start, dir, length: run, radius }));
    }
    if form.is_ball() {
        let (radius, z) = (form.radius, z - from.z - form.radius);
        return Some(Region::Ball(Ball { from: start, dir, run, rise, length: norm(run, rise), radius, z }));
    }
    if form.is_flat() {
        let (t0, t1) = below(from.z, rise, z);
        let start = [start[0] + t0 * run * dir[0], start[1] + t0 * run * dir[1]];
        return Some(Region::Capsule(Capsule { from: start, dir, length: (t1 - t0) * run, radius: form.radius }));
    }
    form.radius_below(zeta)?;
    Some(Region::Outline(Outline { form, from: start, dir, run, rise, z: z - from.z }))
}

/// Fractions of a line between which its height `z0 + t·rise` is at most `z` (it is somewhere).
fn below(z0: f64, rise: f64, z: f64) -> (f64, f64) {
    let t = ((z - z0) / rise).clamp(0.0, 1.0);
    if rise > 0.0 { (0.0, t) } else { (t, 1.0) }
}

impl Region<'_> {
    /// Signed distance (see the head of the file) at `p`, mm.
    pub fn distance(&self, p: [f64; 2]) -> f64 {
        match self {
            Region::Capsule(capsule) => capsule.distance(p),
            Region::Ring(ring) => ring.distance(p),
            Region::Ball(ball) => ball.distance(p),
            Region::Outline(outline) => outline.distance(p),
        }
    }
}

/// (along, across) of `p` seen from `from` along `dir`.
fn local(p: [f64; 2], from: [f64; 2], dir: [f64; 2]) -> (f64, f64) {
    let (x, y) = (p[0] - from[0], p[1] - from[1]);
    (x * dir[0] + y * dir[1], y * dir[0] - x * dir[1])
}

fn norm(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

impl Capsule {
    fn distance(&self, p: [f64; 2]) -> f64 {
        let (u, v) = local(p, self.from, self.dir);
        norm(u - u.clamp(0.0, self.length), v) - self.radius
    }
}

impl Ring {
    /// Angle from the start to where the arc passes nearest to `p`, in its own sense, less than a turn.
    fn ahead(&self, p: [f64; 2]) -> f64 {
        let (x, y) = (p[0] - self.centre[0], p[1] - self.centre[1]);
        ((y.atan2(x) - self.start) * self.sweep.signum()).rem_euclid(std::f64::consts::TAU)
    }
    /// Share of the arc behind which `p` lies; what rounding puts before its start is its start, and beyond its end is its end.
    fn share(&self, p: [f64; 2]) -> f64 {
        let (ahead, whole) = (self.ahead(p), self.sweep.abs());
        match ahead {
            _ if ahead <= whole => ahead / whole,
            _ if ahead - whole > std::f64::consts::TAU - ahead => 0.0,
            _ => 1.0,
        }
    }
    /// Is the point of the arc nearest to `p` inside the arc, and not one of its ends? By the sides of the two radii on which it lies: behind the
    /// first and before the last, or for more than half a turn one of both.
    pub fn passes(&self, p: [f64; 2]) -> bool {
        let side = |from: [f64; 2], to: [f64; 2]| {
            let [a, b] = [from, to].map(|q| [q[0] - self.centre[0], q[1] - self.centre[1]]);
            (a[0] * b[1] - a[1] * b[0]) * self.sweep >= 0.0
        };
        let sides = [side(self.ends[0], p), side(p, self.ends[1])];
        if self.sweep.abs() >= std::f64::consts::TAU {
            true
        } else if self.sweep.abs() > std::f64::consts::PI {
            sides.contains(&true)
        } else {
            sides == [true; 2]
        }
    }
    fn distance(&self, p: [f64; 2]) -> f64 {
        let to_end = |end: [f64; 2]| norm(p[0] - end[0], p[1] - end[1]);
        let nearest = to_end(self.ends[0]).min(to_end(self.ends[1]));
        let aside = if self.passes(p) {
            let growth = self.radius[1] - self.radius[0];
            let grown = if growth.abs() < SAME_RADIUS_MM { 0.0 } else { growth * self.share(p) };
            (norm(p[0] - self.centre[0], p[1] - self.centre[1]) - self.radius[0] - grown).abs()
        } else {
            f64::INFINITY
        };
        nearest.min(aside) - self.reach
    }
}

impl Ball {
    fn distance(&self, p: [f64; 2]) -> f64 {
        let (u, v) = local(p, self.from, self.dir);
        let level = u.clamp(0.0, self.run);
        if self.z >= self.rise * level / self.run {
            return norm(u - level, v) - self.radius;
        }
        let (cos, sin) = (self.run / self.length, self.rise / self.length);
        let along = (u * cos + self.z * sin).clamp(0.0, self.length);
        let (du, dz) = (u - along * cos, self.z - along * sin);
        (du * du + v * v + dz * dz).sqrt() - self.radius
    }
}

/// A disc that an outline on a slope sweeps at a height.
#[derive(Debug, Clone, Copy)]
pub struct Disc {
    /// Where its middle lies.
    pub centre: [f64; 2],
    /// Its radius, mm.
    pub radius: f64,
    /// Distance of a point from it, negative within.
    pub distance: f64,
}

/// A place along the run, the radius of the disc there, and the distance of a point from that disc.
#[derive(Clone, Copy)]
struct Touch {
    along: f64,
    radius: f64,
    distance: f64,
}

impl Touch {
    const NONE: Self = Self { along: 0.0, radius: 0.0, distance: f64::INFINITY };

    fn of(u: f64, v: f64, along: f64, radius: f64) -> Self {
        Self { along, radius, distance: norm(u - along, v) - radius }
    }
    fn nearer(self, other: Self) -> Self {
        if other.distance < self.distance { other } else { self }
    }
}

impl Outline<'_> {
    fn distance(&self, p: [f64; 2]) -> f64 {
        let (u, v) = local(p, self.from, self.dir);
        self.touch(u, v).distance
    }
    /// Of all discs that it sweeps, the one in which `p` lies deepest, or to which it is nearest.
    pub fn disc_about(&self, p: [f64; 2]) -> Disc {
        let (u, v) = local(p, self.from, self.dir);
        let Touch { along, radius, distance } = self.touch(u, v);
        Disc { centre: [0, 1].map(|axis| self.from[axis] + along * self.dir[axis]), radius, distance }
    }
    fn touch(&self, u: f64, v: f64) -> Touch {
        let top = self.column(u, v, self.form.top, self.form.radius);
        let of_segment = |(segment, reach): (&Segment, &Reach)| {
            let at_its_height = self.segment(segment, reach, u, v);
            // Where an outline only widens, what stands above a segment lies within those that follow.
            if self.form.convex {
                return at_its_height;
            }
            at_its_height.nearer(self.column(u, v, reach.high, reach.widest))
        };
        self.form.profile.segments.iter().zip(&self.form.reaches).map(of_segment).fold(top, Touch::nearer)
    }
    /// Range of the run in which the outline's heights `low..high` are at height `z`.
    fn range(&self, low: f64, high: f64) -> Option<(f64, f64)> {
        let at = |zeta: f64| (self.z - zeta) / self.rise * self.run;
        let (a, b) = (at(low), at(high));
        let (a, b) = (a.min(b).max(0.0), a.max(b).min(self.run));
        (a <= b).then_some((a, b))
    }
    /// A disc of `radius` from height `low` up for ever.
    fn column(&self, u: f64, v: f64, low: f64, radius: f64) -> Touch {
        self.range(low, f64::INFINITY).map_or(Touch::NONE, |(a, b)| Touch::of(u, v, u.clamp(a, b), radius))
    }
    /// The discs of a segment at its own height.
    fn segment(&self, segment: &Segment, reach: &Reach, u: f64, v: f64) -> Touch {
        match segment {
            Segment::Line { from, to } => {
                let ([r0, z0], [r1, z1]) = if from[1] <= to[1] { (*from, *to) } else { (*to, *from) };
                let Some((a, b)) = self.range(z0, z1).filter(|_| z1 > z0) else { return Touch::NONE };
                // r(t) = r_a + slope (t − a): the least of hypot(u − t, v) − r(t) is where (t − u) = |v| slope/√(1 − slope²).
                let per_height = (r1 - r0) / (z1 - z0);
                let radius = |t: f64| r0 + per_height * (self.z - self.rise * t / self.run - z0);
                let slope = -per_height * self.rise / self.run;
                let best = if slope.abs() < 1.0 {
                    u + v.abs() * slope / (1.0 - slope * slope).sqrt()
                } else {
                    slope * f64::INFINITY
                };
                let t = best.clamp(a, b);
                Touch::of(u, v, t, radius(t))
            }
            Segment::Arc { centre, radius, .. } => {
                let Some((a, b)) = self.range(reach.low, reach.high) else { return Touch::NONE };
                let per_run = self.rise / self.run;
                let (r2, above) = (radius * radius, self.z - centre[1]);
                let radius = |t: f64| {
                    let h = above - per_run * t;
                    centre[0] + (r2 - h * h).max(0.0).sqrt()
                };
                // Slope of hypot(u − t, v) − r(t): it rises with t, and that by `bend`.
                let slope = |t: f64| {
                    let (off, h) = (u - t, above - per_run * t);
                    let (far, width) = (norm(off, v).max(1e-12), (r2 - h * h).max(1e-18).sqrt());
                    let bend = v * v / (far * far * far) + per_run * per_run * r2 / (width * width * width);
                    (-off / far - per_run * h / width, bend)
                };
                let t = rising_root(slope, a, b);
                Touch::of(u, v, t, radius(t))
            }
        }
    }
}

/// Where a function that rises over an interval, given with its derivative, passes zero: Newton's steps, halves where one would
/// leave what is left of the interval; its end where there is no such place. To about 1e-6 of the interval.
fn rising_root(f: impl Fn(f64) -> (f64, f64), a: f64, b: f64) -> f64 {
    if f(a).0 >= 0.0 {
        return a;
    }
    if f(b).0 <= 0.0 {
        return b;
    }
    let (mut low, mut high) = (a, b);
    let mut t = 0.5 * (a + b);
    let enough = 1e-6 * (b - a) + 1e-12;
    for _ in 0..60 {
        let (value, per_t) = f(t);
        if value > 0.0 {
            high = t;
        } else {
            low = t;
        }
        let step = t - value / per_t;
        let next = if step > low && step < high { step } else { 0.5 * (low + high) };
        if (next - t).abs() < enough || high - low < enough {
            return next;
        }
        t = next;
    }
    t
}
