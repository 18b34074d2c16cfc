//! Engaged arcs at one cutter position, exactly. In: a sample, the marks and candidates the grid nominated, the elements,
//! the blanks. Out: arcs per slice and the removal area.
//!
//! A point q of a ring is engaged when the ring leads there (outward normal · feed direction > 0), q lies inside the blank,
//! and no candidate's swept region holds it. With D(q) the least of the candidates' signed distances and the distance to the
//! outside of the blank, that is D > 0, and |∇D| ≤ 1: the walk along the circle steps |D| at a time and cannot step over
//! an interval longer than [`STEP_MM`]; boundaries are roots of D.
//!
//! Removal area (volume per mm of path): Σ edge ∫ n·t r dφ = Σ edge r [n_r t_h (sin β₁ − sin β₀) + n_z t_z (β₁ − β₀)] over
//! the arcs, β counted from the feed direction.

use super::cutter::{Band, Cutter};
use super::nominate::{Mark, Sample};
use crate::machine::Box3;
use crate::stock::{Blank, Element, Region, Swept, Track};
use std::cell::Cell;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::LazyLock;

/// Shortest stretch of a circle that cannot be overlooked, mm.
const STEP_MM: f64 = 0.05;
/// Distance below which a point counts as cleared, mm: rounding of coordinates and f64.
const TOUCH_MM: f64 = 1e-7;
/// Deep enough inside the region that covered the point before to ask no other, mm.
const DEEP_MM: f64 = 0.03;
/// Change of engagement from one ring to the next above which both are looked at in parts, rad.
const JUMP_RAD: f64 = 0.15;
/// Shortest arc kept, mm.
const SHORTEST_MM: f64 = 1e-3;

/// Everything there is to be asked.
pub struct Scene<'a> {
    /// All elements.
    pub elements: &'a [Element],
    /// All cutters.
    pub cutters: &'a [Cutter],
    /// The blanks.
    pub blanks: &'a [Blank],
    /// Keep-out boxes.
    pub fixtures: &'a [Box3],
}

impl Scene<'_> {
    /// True when no fixture is within the clearance of a sample.
    pub fn clear_of_fixtures(&self, sample: &Sample) -> bool {
        let reach = self.cutters[sample.cutter as usize].form.radius + sample.clearance_mm;
        self.fixtures.iter().all(|fixture| {
            let beside =
                |axis: usize| (fixture.min[axis] - sample.tip[axis]).max(sample.tip[axis] - fixture.max[axis]).max(0.0);
            sample.tip.z - sample.clearance_mm >= fixture.max.z || beside(0).hypot(beside(1)) > reach
        })
    }
}

/// An engaged arc of a part of a ring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawArc {
    /// Slice of the tool.
    pub slice: u16,
    /// Part of its edge, from below, in [0, 1].
    pub part: [f32; 2],
    /// Immersion angles, rad.
    pub angles: [f32; 2],
}

/// Removal area and reach of the arcs at a sample.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cut {
    /// Number of arcs.
    pub arcs: u32,
    /// Volume removed per mm of path, mm².
    pub area_mm2: f64,
    /// Height above the tip up to which it is engaged, mm.
    pub top_mm: f64,
}

/// A part of a ring with one height.
#[derive(Debug, Clone, Copy)]
struct SubRing {
    slice: u16,
    part: [f64; 2],
    /// Absolute height of its middle, and of its upper end.
    z: f64,
    top: f64,
    radius: f64,
}

/// Appends the arcs at a sample, sorted by slice.
pub fn arcs_at(scene: &Scene, sample: &Sample, marks: &[Mark], candidates: &[u32], out: &mut Vec<RawArc>) -> Cut {
    let cutter = &scene.cutters[sample.cutter as usize];
    let swept = if marks.is_empty() { Vec::new() } else { swept(scene, sample, cutter, candidates) };
    let work = Work { scene, sample, cutter, swept };
    let begin = out.len();
    let levels = work.levels();
    for mark in marks {
        work.band(mark, &levels, out);
    }
    let mut cut = Cut { arcs: (out.len() - begin) as u32, ..Cut::default() };
    for arc in &out[begin..] {
        let slice = &cutter.slices[arc.slice as usize];
        cut.area_mm2 += work.area(arc);
        cut.top_mm = cut.top_mm.max(slice.z_mm + (f64::from(arc.part[1]) - 0.5) * slice.dz_mm());
    }
    cut
}

/// What may have cleared material here: the candidates, and on arcs what the current move itself has swept so far, but
/// for the last stretch, which only clears what is behind the cutter.
fn swept<'a>(scene: &'a Scene, sample: &Sample, cutter: &'a Cutter, candidates: &[u32]) -> Vec<Swept<'a>> {
    let mut swept: Vec<Swept> = candidates
        .iter()
        .map(|id| {
            let element = &scene.elements[*id as usize];
            Swept::new(&element.track, &scene.cutters[element.cutter as usize].form)
        })
        .collect();
    let element = &scene.elements[sample.element as usize];
    let length = sample.along_mm - 0.25 * cutter.form.radius;
    if matches!(element.track, Track::Arc { .. }) && length > 0.0 {
        swept.push(Swept::new(&element.track.until(length), &cutter.form));
    }
    swept
}

/// A region with its distance where it was last asked; it cannot have come nearer than by the way gone since.
struct Known<'a> {
    region: Region<'a>,
    value: Cell<f64>,
    at: Cell<f64>,
}

impl Known<'_> {
    fn ask(&self, q: [f64; 2], beta: f64) -> f64 {
        let distance = self.region.distance(q);
        self.value.set(distance);
        self.at.set(beta);
        distance
    }
    fn bound(&self, beta: f64, radius: f64) -> f64 {
        self.value.get() - radius * (beta - self.at.get()).abs()
    }
}

struct Work<'a> {
    scene: &'a Scene<'a>,
    sample: &'a Sample,
    cutter: &'a Cutter,
    swept: Vec<Swept<'a>>,
}

type Angles = Vec<[f64; 2]>;

impl Work<'_> {
    /// Heights at which engagement may change abruptly: flat tops of blanks, level floors left by candidates.
    fn levels(&self) -> Vec<f64> {
        let mut levels: Vec<f64> = self
            .scene
            .blanks
            .iter()
            .filter_map(|blank| match blank {
                Blank::Box(extent) => Some(extent.max.z),
                Blank::Cylinder { z, .. } => Some(z[1]),
                Blank::Heights(_) => None,
            })
            .collect();
        levels.extend(self.swept.iter().filter(|swept| swept.leaves_floor()).map(Swept::lowest));
        levels.sort_unstable_by(f64::total_cmp);
        levels.dedup_by(|a, b| *a - *b < 1e-6);
        levels
    }

    fn band(&self, mark: &Mark, levels: &[f64], out: &mut Vec<RawArc>) {
        let band = &self.cutter.bands[mark.band as usize];
        let Some(zone) = self.zone(band) else { return };
        let windows = windows(mark.bins, zone);
        let rings = self.sub_rings(band, f64::from(mark.top), levels);
        let found = if band.slices[0] == band.slices[1] {
            rings.iter().map(|ring| (*ring, self.ring(ring, &windows))).collect()
        } else {
            self.refine(&self.stack(&rings, &windows), levels, &windows)
        };
        for (ring, angles) in found {
            for [from, to] in angles {
                if (to - from) * ring.radius < SHORTEST_MM {
                    continue;
                }
                let angles = [(FRAC_PI_2 - to) as f32, (FRAC_PI_2 - from) as f32];
                out.push(RawArc { slice: ring.slice, part: ring.part.map(|p| p as f32), angles });
            }
        }
    }

    /// Half width of the leading part of a band; `None` when it does not lead anywhere.
    fn zone(&self, band: &Band) -> Option<f64> {
        let slice = &self.cutter.slices[band.slices[0] as usize];
        let [horizontal, vertical] = self.sample.tangent;
        let (across, along) = (slice.normal_r * horizontal, slice.normal_z * vertical);
        if across <= 1e-9 {
            return (along > 1e-9).then_some(PI);
        }
        let limit = -along / across;
        (limit < 1.0).then(|| limit.max(-1.0).acos())
    }

    /// Rings of a band that lie lower than `top`, split where a level passes through them.
    fn sub_rings(&self, band: &Band, top: f64, levels: &[f64]) -> Vec<SubRing> {
        let mut rings = Vec::new();
        let slack = 0.1 * self.cutter.margin;
        for index in band.slices[0]..=band.slices[1] {
            let slice = &self.cutter.slices[index as usize];
            let dz = slice.dz_mm().abs();
            let low = self.sample.tip.z + slice.z_mm - 0.5 * dz;
            if low > top + slack {
                break;
            }
            let first = levels.partition_point(|level| *level <= low + 0.01 * dz);
            let last = levels.partition_point(|level| *level < low + 0.99 * dz);
            let cuts = levels[first..last.max(first)].iter().map(|level| (level - low) / dz).chain([1.0]);
            let mut from = 0.0;
            for to in cuts {
                rings.push(self.sub_ring(band, index, [from, to]));
                from = to;
            }
        }
        rings
    }

    /// A part of a ring. A bottom meets what lies under it: exactly at its height the sweep so far has cleared it all.
    fn sub_ring(&self, band: &Band, index: u16, part: [f64; 2]) -> SubRing {
        let slice = &self.cutter.slices[index as usize];
        let middle = 0.5 * (part[0] + part[1]) - 0.5;
        let base = self.sample.tip.z + slice.z_mm;
        SubRing {
            slice: index,
            part,
            z: base + middle * slice.dz_mm() - if band.bottom { TOUCH_MM } else { 0.0 },
            top: base + (part[1] - 0.5) * slice.dz_mm(),
            radius: slice.radius_mm - middle * slice.edge_mm * slice.normal_z,
        }
    }

    /// Where the arcs of neighbouring rings of a cylinder differ much though no level lies between them (a floor on a
    /// slope), both rings are looked at in four parts.
    fn refine(&self, found: &[(SubRing, Angles)], levels: &[f64], windows: &[[f64; 2]]) -> Vec<(SubRing, Angles)> {
        let jumps = |k: usize| {
            let (ring, angles) = &found[k];
            let above = found.get(k + 1).map_or(0.0, |(_, above)| extent(above));
            let at_level = levels.iter().any(|level| (level - ring.top).abs() < 1e-3);
            !at_level && (extent(angles) - above).abs() > JUMP_RAD
        };
        let mut refined: Vec<(SubRing, Angles)> = Vec::with_capacity(found.len());
        for (k, (ring, angles)) in found.iter().enumerate() {
            if !jumps(k) && (k == 0 || !jumps(k - 1)) {
                refined.push((*ring, angles.clone()));
                continue;
            }
            let band = Band { slices: [ring.slice; 2], radius: ring.radius, low: 0.0, bottom: false };
            for quarter in 0..4 {
                let at = |q: i32| ring.part[0] + (ring.part[1] - ring.part[0]) * 0.25 * f64::from(q);
                let part = self.sub_ring(&band, ring.slice, [at(quarter), at(quarter + 1)]);
                let angles = self.ring(&part, windows);
                match refined.last_mut() {
                    Some((last, held))
                        if last.slice == part.slice && last.part[1] == part.part[0] && same(held, &angles) =>
                    {
                        *last = self.sub_ring(&band, ring.slice, [last.part[0], part.part[1]]);
                    }
                    _ => refined.push((part, angles)),
                }
            }
        }
        refined
    }

    /// Arcs of rings above each other with one radius: they only shrink with height, so equal ends mean all equal.
    fn stack(&self, rings: &[SubRing], windows: &[[f64; 2]]) -> Vec<(SubRing, Angles)> {
        let mut found = vec![None; rings.len()];
        if rings.is_empty() {
            return Vec::new();
        }
        let last = rings.len() - 1;
        found[0] = Some(self.ring(&rings[0], windows));
        if last > 0 {
            let lower = found[0].clone().unwrap_or_default();
            found[last] = Some(if lower.is_empty() { Angles::new() } else { self.ring(&rings[last], windows) });
            self.between(rings, windows, 0, last, &mut found);
        }
        rings.iter().copied().zip(found.into_iter().map(Option::unwrap_or_default)).collect()
    }

    fn between(&self, rings: &[SubRing], windows: &[[f64; 2]], low: usize, high: usize, found: &mut [Option<Angles>]) {
        if high - low < 2 {
            return;
        }
        let (below, above) = (found[low].clone().unwrap_or_default(), found[high].clone().unwrap_or_default());
        if below.is_empty() || same(&below, &above) {
            found[low + 1..high].fill(Some(below));
            return;
        }
        let middle = usize::midpoint(low, high);
        found[middle] = Some(self.ring(&rings[middle], windows));
        self.between(rings, windows, low, middle, found);
        self.between(rings, windows, middle, high, found);
    }

    /// Engaged intervals of one ring, angles from the feed direction, counter-clockwise.
    fn ring(&self, ring: &SubRing, windows: &[[f64; 2]]) -> Angles {
        let centre = [self.sample.tip.x, self.sample.tip.y];
        let Some(regions) = self.regions(ring, centre) else { return Angles::new() };
        let mut angles = Angles::new();
        let dir = self.sample.dir;
        let last = Cell::new(0);
        let depth = |beta: f64| {
            let (sin, cos) = beta.sin_cos();
            let (x, y) = (ring.radius * (cos * dir[0] - sin * dir[1]), ring.radius * (cos * dir[1] + sin * dir[0]));
            let q = [centre[0] + x, centre[1] + y];
            let mut least = f64::INFINITY;
            if let Some(known) = regions.get(last.get()) {
                least = known.ask(q, beta);
                if least < -DEEP_MM {
                    return least;
                }
            }
            let beside = self.scene.blanks.iter().map(|blank| blank.distance(q, ring.z)).fold(f64::INFINITY, f64::min);
            least = least.min(-beside);
            for (index, known) in regions.iter().enumerate() {
                if known.bound(beta, ring.radius) < least {
                    let distance = known.ask(q, beta);
                    if distance < least {
                        least = distance;
                        last.set(index);
                    }
                }
            }
            least - TOUCH_MM
        };
        for window in windows {
            walk(&depth, *window, ring.radius, &mut angles);
        }
        angles
    }

    /// What reaches a ring; `None` when something covers all of it.
    fn regions(&self, ring: &SubRing, centre: [f64; 2]) -> Option<Vec<Known<'_>>> {
        let mut regions = Vec::with_capacity(self.swept.len());
        for region in self.swept.iter().filter_map(|swept| swept.at(ring.z)) {
            let distance = region.distance(centre);
            if distance < -ring.radius - TOUCH_MM {
                return None;
            }
            if distance < ring.radius + TOUCH_MM {
                regions.push(Known { region, value: Cell::new(f64::NEG_INFINITY), at: Cell::new(0.0) });
            }
        }
        Some(regions)
    }

    fn area(&self, arc: &RawArc) -> f64 {
        let slice = &self.cutter.slices[arc.slice as usize];
        let [horizontal, vertical] = self.sample.tangent;
        let [entry, exit] = arc.angles.map(f64::from);
        let [from, to] = arc.part.map(f64::from);
        let middle = 0.5 * (from + to) - 0.5;
        let radius = slice.radius_mm - middle * slice.edge_mm * slice.normal_z;
        let lead =
            slice.normal_r * horizontal * (entry.cos() - exit.cos()) + slice.normal_z * vertical * (exit - entry);
        (to - from) * slice.edge_mm * radius * lead
    }
}

/// Sum of the lengths of intervals, rad.
fn extent(angles: &Angles) -> f64 {
    angles.iter().map(|[from, to]| to - from).sum()
}

fn same(a: &Angles, b: &Angles) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a[0] - b[0]).abs() < 1e-5 && (a[1] - b[1]).abs() < 1e-5)
}

/// The parts of [−zone, zone] whose bins are marked, in order.
fn windows(bins: u64, zone: f64) -> Angles {
    let mut windows = Angles::new();
    let ordered = bins.rotate_left(32); // from straight behind, counter-clockwise
    let edges = &*BIN_EDGES;
    for k in 0..64 {
        if ordered >> k & 1 == 0 {
            continue;
        }
        let (from, to) = (edges[k].max(-zone), edges[k + 1].min(zone));
        if from >= to {
            continue;
        }
        match windows.last_mut() {
            Some(last) if last[1] >= from => last[1] = to,
            _ => windows.push([from, to]),
        }
    }
    windows
}

/// Angles from −π of the edges of the 64 bins of the diamond angle, counted from straight behind.
static BIN_EDGES: LazyLock<[f64; 65]> = LazyLock::new(|| {
    std::array::from_fn(|k| {
        let x = (k % 16) as f64 / 16.0;
        (k / 16) as f64 * FRAC_PI_2 + x.atan2(1.0 - x) - PI
    })
});

/// Appends the intervals of `window` in which `depth` is positive.
fn walk(depth: &impl Fn(f64) -> f64, window: [f64; 2], radius: f64, out: &mut Angles) {
    let shortest = STEP_MM.min(0.03 * radius);
    let (mut at, mut value) = (window[0], depth(window[0]));
    let mut open = (value > 0.0).then_some(at);
    while at < window[1] {
        let next = (at + value.abs().max(shortest) / radius).min(window[1]);
        let next_value = depth(next);
        if (next_value > 0.0) != (value > 0.0) {
            let boundary = root(depth, [at, next], [value, next_value]);
            match open.take() {
                Some(from) => close(out, from, boundary),
                None => open = Some(boundary),
            }
        }
        (at, value) = (next, next_value);
    }
    if let Some(from) = open {
        close(out, from, window[1]);
    }
}

fn close(out: &mut Angles, from: f64, to: f64) {
    match out.last_mut() {
        Some(last) if last[1] >= from - 1e-9 => last[1] = to,
        _ => out.push([from, to]),
    }
}

/// Root of a function that changes sign on an interval: regula falsi (Illinois), to 1e-6 rad.
fn root(f: &impl Fn(f64) -> f64, [mut a, mut b]: [f64; 2], [mut fa, mut fb]: [f64; 2]) -> f64 {
    let mut side = 0;
    for _ in 0..60 {
        if b - a < 1e-6 {
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
