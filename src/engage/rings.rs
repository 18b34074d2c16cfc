//! The rings of a cutter at one position. In: the regions that earlier moves swept, the blanks. Out: engaged angles per part of a ring.
//!
//! A ring is split in two where a level (a flat top or floor) passes through it. Where engagement begins or ends between two rings of a curved
//! outline, the last engaged ring is split there. Rings over which the width of cut bends, or a gap opens, are split into thirds. Cylindrical
//! sides: [`super::cylinder`].

use super::cover::{Cover, TOUCH_MM};
use super::cutter::{Band, Cutter};
use super::gaps::{Dir, Gaps, Interval, chord, span, windows};
use super::inside_stock::in_blanks;
use super::nominate::{Mark, Sample};
use super::outline::{Angles, EngagedPart, SubRing, about_tip, correction, end, follows};
use super::scene::{RawArc, Scene, area};
use crate::machine::Slice;
use crate::stock::Blank;
use std::cell::Cell;
use std::f64::consts::FRAC_PI_2;
use std::rc::Rc;

/// A change of engagement from one ring of a curved outline to the next by more than this shows that a gap opens, rad.
const GAP_RAD: f64 = 0.6;
/// The change of the width integral above which the rings around such a gap are split, as a share of the whole removal area: for the first
/// and for the second time that rings are split into thirds.
const GAP_SHARES: [f64; 2] = [4.0 * ROUGH, 8.0 * ROUGH];
/// Error of the midpoint rule from which on a ring is split into thirds, as a share of the whole removal area.
const ROUGH: f64 = 0.004;
/// Change of engagement from one ring of a bottom to the next from which on both are split, rad.
const UNEVEN_RAD: f64 = 0.1;
/// Distance from the border of a ring at which it is seen whether a level at the border ends the engagement, as a share of the ring.
const BESIDE: f64 = 0.01;
/// Shortest arc kept, mm.
const SHORTEST_MM: f64 = 1e-3;

/// A gap beside the shank that is narrower than this counts as contact, mm.
const RUB_MM: f64 = 0.005;
/// Height above the flutes at which contact of the shank is tested, mm.
const RUB_ABOVE_MM: f64 = 0.05;

/// One position of the cutter.
pub(super) struct Work<'a> {
    pub(super) scene: &'a Scene<'a>,
    sample: &'a Sample,
    pub(super) cutter: &'a Cutter,
    covers: &'a [Cover<'a>],
    levels: Vec<f64>,
    /// May the engagement of a cylinder change between two levels?
    pub(super) sloped: bool,
    /// The covers that removed something last: they are likely to cover the next ring too, and are tested first.
    first: Cell<[usize; 2]>,
}

impl<'a> Work<'a> {
    /// A position, with the regions that may cover rings there.
    pub fn new(scene: &'a Scene<'a>, sample: &'a Sample, cutter: &'a Cutter, covers: &'a [Cover<'a>]) -> Self {
        let levels = levels(scene, sample, cutter, covers);
        let relief = scene.blanks.iter().any(|blank| matches!(blank, Blank::Heights(_)));
        let sloped = relief || covers.iter().any(|cover| !cover.is_step());
        let first = Cell::new([covers.len().saturating_sub(1), usize::MAX]);
        Self { scene, sample, cutter, covers, levels, sloped, first }
    }

    /// Appends the engaged arcs of the marked bands and returns the volume they remove per mm of path, mm².
    pub fn arcs(&self, marks: &[Mark], out: &mut Vec<RawArc>) -> f64 {
        let mut curved: Vec<Curved> = Vec::new();
        let mut area_mm2 = 0.0;
        let (mut bins, mut within): (u64, Shared) = (0, Rc::new([]));
        for mark in marks {
            let band = &self.cutter.bands[mark.band as usize];
            if mark.bins != bins {
                (bins, within) = (mark.bins, windows(mark.bins).into());
            }
            let rings = self.sub_rings(band, f64::from(mark.top));
            if band.slices[0] == band.slices[1] {
                curved.extend(rings.iter().map(|ring| Curved {
                    ring: *ring,
                    bottom: band.bottom,
                    angles: self.ring(ring, &within),
                    windows: within.clone(),
                }));
            } else {
                area_mm2 += self.ends(&mut curved, out);
                let sides = self.stack_up(band, &rings, &within);
                area_mm2 += self.sides(&self.refine(sides, &within), out);
            }
        }
        area_mm2 + self.ends(&mut curved, out)
    }

    /// Height of the wall above the flutes along which a shank as wide as the cutter rubs, mm; tested by a ring just above the flutes that
    /// is wider than the shank by [`RUB_MM`].
    pub fn rub_mm(&self, marks: &[Mark]) -> f64 {
        let Some(from) = self.cutter.rubs_from_mm else { return 0.0 };
        let low = self.sample.tip.z + from + RUB_ABOVE_MM;
        let stands = |mark: &&Mark| {
            f64::from(mark.top) > low && self.cutter.bands[mark.band as usize].radius >= self.cutter.form.radius
        };
        let Some(mark) = marks.iter().find(stands) else { return 0.0 };
        let radius = self.cutter.form.radius + RUB_MM;
        let ring = SubRing { slice: 0, part: [0.0, 1.0], z: low, top: low, radius, normal: [1.0, 0.0] };
        let touches = !self.ring(&ring, &windows(mark.bins)).is_empty();
        if touches { f64::from(mark.top) - self.sample.tip.z - from } else { 0.0 }
    }

    /// The leading part of a ring; `None` when it does not lead anywhere.
    fn zone(&self, [normal_r, normal_z]: [f64; 2]) -> Option<Interval> {
        let [horizontal, vertical] = self.sample.tangent;
        let (across, along) = (normal_r * horizontal, normal_z * vertical);
        let whole = Gaps::whole().0[0];
        if across <= 1e-9 {
            return (along > 1e-9).then_some(whole);
        }
        let limit = -along / across;
        if limit <= -1.0 {
            return Some(whole);
        }
        let side = ((1.0 - limit) * (1.0 + limit)).sqrt();
        (limit < 1.0).then(|| [Dir::of([limit, -side]), Dir::of([limit, side])])
    }

    /// Rings of a band that lie lower than `top`, split where a level passes through them.
    pub(super) fn sub_rings(&self, band: &Band, top: f64) -> Vec<SubRing> {
        let mut rings = Vec::new();
        let slack = 0.1 * self.cutter.margin;
        for index in band.slices[0]..=band.slices[1] {
            let slice = &self.cutter.slices[index as usize];
            let dz = slice.dz_mm().abs();
            let low = self.sample.tip.z + slice.z_mm - 0.5 * dz;
            if low > top + slack {
                break;
            }
            let first = self.levels.partition_point(|level| *level <= low + 0.01 * dz);
            let last = self.levels.partition_point(|level| *level < low + 0.99 * dz);
            let place = |level: &f64| self.cutter.part_at(index, level - self.sample.tip.z);
            let cuts = self.levels[first..last.max(first)].iter().map(place).filter(|at| (0.01..0.99).contains(at));
            let mut from = 0.0;
            for to in cuts.chain([1.0]) {
                rings.push(self.sub_ring(index, [from, to], band.bottom));
                from = to;
            }
        }
        rings
    }

    /// A part of a ring. A bottom that comes down onto a floor does not cut at its end, so it is taken slightly higher.
    pub(super) fn sub_ring(&self, index: u16, part: [f64; 2], bottom: bool) -> SubRing {
        let slice = self.cutter.part(index, part);
        let z = self.sample.tip.z + slice.z_mm;
        let top = self.sample.tip.z + self.cutter.height_at(index, part[1]);
        let normal = [slice.normal_r, slice.normal_z];
        SubRing { slice: index, part, z: if bottom { z + TOUCH_MM } else { z }, top, radius: slice.radius_mm, normal }
    }

    /// Appends the arcs of the rings of a curved outline, split where engagement begins and ends, and returns their removal area, mm².
    fn ends(&self, curved: &mut Vec<Curved>, out: &mut Vec<RawArc>) -> f64 {
        let mut found: Vec<EngagedPart> = Vec::with_capacity(curved.len() + 2);
        for k in 0..curved.len() {
            let this = &curved[k];
            if this.angles.is_empty() {
                continue;
            }
            let below = k.checked_sub(1).map(|k| &curved[k]).filter(|below| follows(&below.ring, &this.ring));
            let above = curved.get(k + 1).filter(|above| follows(&this.ring, &above.ring));
            let mut part = this.ring.part;
            let mut ends = [this.ring.slice == 0 && part[0] == 0.0 && self.cutter.pointed(), false];
            let none_below = this.bottom && this.ring.slice > 0 && below.is_none();
            if none_below || below.is_some_and(|below| below.angles.is_empty()) {
                match self.limit(this, below, 0) {
                    Limit::Within(limit) => (part[0], ends[0]) = (limit, true),
                    Limit::Beyond(ring, angles) => found.push(EngagedPart { ring, angles, ends: [true, false] }),
                    Limit::Between => {}
                }
            }
            let mut beyond = None;
            if above.is_none_or(|above| above.angles.is_empty()) {
                match self.limit(this, above, 1) {
                    Limit::Within(limit) => (part[1], ends[1]) = (limit, true),
                    Limit::Beyond(ring, angles) => beyond = Some(EngagedPart { ring, angles, ends: [false, true] }),
                    Limit::Between => {}
                }
            }
            if part == this.ring.part {
                found.push(EngagedPart { ring: this.ring, angles: this.angles.clone(), ends });
            } else {
                let ring = self.sub_ring(this.ring.slice, part, this.bottom);
                found.push(EngagedPart { ring, angles: self.ring(&ring, &this.windows), ends });
            }
            found.extend(beyond);
        }
        found.extend(curved.last().and_then(|last| self.edge(last)));
        found.retain(|of| !of.angles.is_empty());
        let found = self.in_thirds(found, curved);
        for of in &found {
            push(&of.ring, &of.angles, out);
        }
        curved.clear();
        self.integral(&found)
    }

    /// The engagement at the edge of the outermost ring of a bottom, where its middle is not engaged.
    fn edge(&self, last: &Curved) -> Option<EngagedPart> {
        if !last.bottom || !last.angles.is_empty() || last.ring.part[1] < 1.0 {
            return None;
        }
        let width = |at: f64| extent(&self.ring(&self.sub_ring(last.ring.slice, [at, at], true), &last.windows));
        let at_edge = width(1.0);
        let from = (at_edge > 0.0).then(|| end([1.0, at_edge], 0.5 * (last.ring.part[0] + 1.0), None, width))?;
        let ring = self.sub_ring(last.ring.slice, [from, 1.0], true);
        Some(EngagedPart { ring, angles: self.ring(&ring, &last.windows), ends: [true, false] })
    }

    /// ∫ of the width over the outline, mm²: the midpoint rule with its second-order error corrected.
    fn integral(&self, found: &[EngagedPart]) -> f64 {
        let widths: Vec<[f64; 2]> = found.iter().map(|of| self.width(&of.ring, &of.angles)).collect();
        let leads = |slice: &Slice| {
            let zone = self.zone([slice.normal_r, slice.normal_z]);
            zone.map_or(0.0, |zone| area(&Slice { edge_mm: 1.0, ..*slice }, self.sample.tangent, &zone))
        };
        let tip = about_tip(self.cutter, found, &widths, leads);
        let ring = |(k, [width, edge]): (usize, &[f64; 2])| match tip {
            Some(tip) if k == 0 => tip,
            _ => (edge * width + correction(found, &widths, k)).max(0.0),
        };
        widths.iter().enumerate().map(ring).sum()
    }

    /// Splits the rings for which the midpoint rule is too rough into thirds. The engagement at the middle is used again.
    fn in_thirds(&self, found: Vec<EngagedPart>, curved: &[Curved]) -> Vec<EngagedPart> {
        let mut found = found;
        for gap_share in GAP_SHARES {
            let widths: Vec<[f64; 2]> = found.iter().map(|of| self.width(&of.ring, &of.angles)).collect();
            let total: f64 = widths.iter().map(|[width, edge]| width * edge).sum();
            let gap = |k: usize| {
                let [[w0, e0], [w1, e1]] = [widths[k], widths[k + 1]];
                (w1 - w0).abs() * e0.min(e1) > gap_share * total && divides(&found[k], &found[k + 1])
            };
            let gaps: Vec<bool> = (1..found.len()).map(|k| gap(k - 1)).collect();
            let beside = |k: usize| (k > 0 && gaps[k - 1]) || gaps.get(k).is_some_and(|gap| *gap);
            let bends = |k: usize| correction(&found, &widths, k).abs() > ROUGH * total;
            let rough = |k: usize| beside(k) || bends(k) || (found[k].ring.normal[0] == 0.0 && uneven(&found, k));
            let rough: Vec<bool> = (0..found.len()).map(rough).collect();
            if !rough.contains(&true) {
                break;
            }
            let mut next = Vec::with_capacity(3 * found.len());
            for (of, rough) in found.into_iter().zip(rough) {
                let Some(curved) = curved.iter().find(|c| c.ring.slice == of.ring.slice).filter(|_| rough) else {
                    next.push(of);
                    continue;
                };
                let [from, to] = of.ring.part;
                let at = |third: f64| from + (to - from) * third / 3.0;
                let part = |part: [f64; 2]| self.sub_ring(of.ring.slice, part, curved.bottom);
                let [low, middle, high] = [[from, at(1.0)], [at(1.0), at(2.0)], [at(2.0), to]].map(part);
                let outer = |ring: SubRing| self.ring(&ring, &curved.windows);
                let [below, above] = [outer(low), outer(high)];
                let [ends_below, ends_above] = of.ends;
                next.push(EngagedPart { ring: low, angles: below, ends: [ends_below, false] });
                next.push(EngagedPart { ring: middle, angles: of.angles, ends: [false; 2] });
                next.push(EngagedPart { ring: high, angles: above, ends: [false, ends_above] });
            }
            next.retain(|of| !of.angles.is_empty());
            found = next;
        }
        found
    }

    /// Volume per mm of path and mm of edge of a ring, and its edge, mm.
    pub(super) fn width(&self, ring: &SubRing, angles: &[Interval]) -> [f64; 2] {
        let slice = self.cutter.part(ring.slice, ring.part);
        let width = |arc: &Interval| area(&slice, self.sample.tangent, arc);
        [angles.iter().map(width).sum::<f64>() / slice.edge_mm, slice.edge_mm]
    }

    /// Where the engagement of `this` ends towards its neighbour on one side (0 below, 1 above), which is not engaged.
    fn limit(&self, this: &Curved, beside: Option<&Curved>, side: usize) -> Limit {
        let border = this.ring.part[side];
        let height = if side == 1 { this.ring.top } else { beside.map_or(f64::NEG_INFINITY, |beside| beside.ring.top) };
        let width = |of: &Curved, at: f64| {
            let ring = self.sub_ring(of.ring.slice, [at, at], of.bottom);
            extent(&self.ring(&ring, &of.windows))
        };
        // A level at the border is what ends the engagement, unless something is engaged beyond it too.
        if !this.bottom && self.levels.iter().any(|level| (level - height).abs() < 1e-6) {
            let beyond = |of: &Curved| {
                let [from, to] = of.ring.part;
                of.ring.part[1 - side] + [-BESIDE, BESIDE][side] * (to - from)
            };
            if beside.is_none_or(|of| width(of, beyond(of)) == 0.0) {
                return Limit::Between;
            }
        }
        let middle = |ring: &SubRing| 0.5 * (ring.part[0] + ring.part[1]);
        let (inner, of_inner) = (middle(&this.ring), extent(&this.angles));
        let at_border = width(this, border);
        if at_border == 0.0 {
            return Limit::Within(end([inner, of_inner], border, None, |at| width(this, at)));
        }
        let Some(beside) = beside else { return Limit::Between };
        let scale = self.cutter.slices[this.ring.slice as usize].edge_mm
            / self.cutter.slices[beside.ring.slice as usize].edge_mm;
        let within = border;
        let border = beside.ring.part[1 - side];
        let before = [border + (inner - within) * scale, of_inner];
        let end = end([border, at_border], middle(&beside.ring), Some(before), |at| width(beside, at));
        if (end - border).abs() < 1e-3 {
            return Limit::Between;
        }
        let ring = self.sub_ring(beside.ring.slice, [border.min(end), border.max(end)], beside.bottom);
        Limit::Beyond(ring, self.ring(&ring, &beside.windows))
    }

    /// Engaged intervals of one ring, counted from the feed direction, counter-clockwise. The covers that removed something of the last ring
    /// are applied first, then the others, latest first.
    pub(super) fn ring(&self, ring: &SubRing, windows: &[Interval]) -> Angles {
        let Some([low, high]) = self.zone(ring.normal) else { return Angles::new() };
        let later = |a: Dir, b: Dir| if a.key > b.key { a } else { b };
        let sooner = |a: Dir, b: Dir| if a.key < b.key { a } else { b };
        let ahead = windows.iter().map(|[from, to]| [later(*from, low), sooner(*to, high)]);
        let mut gaps = Gaps(ahead.filter(|[from, to]| from.key < to.key).collect());
        let first = self.first.get();
        let others = (0..self.covers.len()).rev().filter(|k| !first.contains(k));
        for k in first.into_iter().filter(|k| *k < self.covers.len()).chain(others) {
            let before = gaps.hull().map(|[a, b]| (a.key, b.key));
            self.covers[k].cover(&mut gaps, ring.radius, ring.z);
            let hull = gaps.hull().map(|[a, b]| (a.key, b.key));
            if hull != before {
                let [one, other] = self.first.get();
                self.first.set(if one == k { [one, other] } else { [k, one] });
            }
            if gaps.is_empty() {
                return gaps.0;
            }
        }
        gaps.0.retain(|[from, to]| to.key - from.key > 1.0 || chord(from, to) * ring.radius >= SHORTEST_MM);
        in_blanks(self.scene.blanks, self.sample, gaps, ring.radius, ring.z)
    }
}

/// Directions ahead: 0°, ± 25°, ± 50°, ± 75°.
const AHEAD: [[f64; 2]; 7] = [
    [1.0, 0.0],
    [0.906_307_787, 0.422_618_262],
    [0.906_307_787, -0.422_618_262],
    [0.642_787_610, 0.766_044_443],
    [0.642_787_610, -0.766_044_443],
    [0.258_819_045, 0.965_925_826],
    [0.258_819_045, -0.965_925_826],
];

/// A ring of a curved outline with what was found at its middle.
struct Curved {
    ring: SubRing,
    bottom: bool,
    windows: Shared,
    angles: Angles,
}

/// Arcs that several rings of a cylinder share.
pub(super) type Shared = Rc<[Interval]>;

/// Where engagement ends beside a ring.
enum Limit {
    /// At its border.
    Between,
    /// At this part of it.
    Within(f64),
    /// In its neighbour, of which this much is engaged.
    Beyond(SubRing, Angles),
}

/// Heights at which engagement may change abruptly: flat tops and bottoms of blanks, level floors left by candidates.
fn levels(scene: &Scene, sample: &Sample, cutter: &Cutter, covers: &[Cover]) -> Vec<f64> {
    let mut levels = Vec::new();
    for blank in scene.blanks {
        levels.push(blank.bottom_mm());
        match blank {
            Blank::Box(extent) => levels.push(extent.max.z),
            Blank::Cylinder { z, .. } => levels.push(z[1]),
            Blank::Heights(relief) => levels.extend(relief.levels(ahead(sample, cutter.form.radius))),
        }
    }
    levels.extend(covers.iter().filter(|cover| cover.leaves_floor()).map(Cover::lowest));
    levels.sort_unstable_by(f64::total_cmp);
    levels.dedup_by(|a, b| *a - *b < 1e-6);
    levels
}

/// Places ahead of the cutter, about its edge, where the top of a blank is looked at.
fn ahead(sample: &Sample, radius: f64) -> impl Iterator<Item = [f64; 2]> {
    let ([dx, dy], tip) = (sample.dir, sample.tip);
    AHEAD.iter().map(move |[cos, sin]| {
        let [u, v] = [radius * cos, radius * sin];
        [tip.x + u * dx - v * dy, tip.y + u * dy + v * dx]
    })
}

pub(super) fn push(ring: &SubRing, angles: &[Interval], out: &mut Vec<RawArc>) {
    for [from, to] in angles {
        let angles = [(FRAC_PI_2 - to.angle()) as f32, (FRAC_PI_2 - from.angle()) as f32];
        out.push(RawArc { slice: ring.slice, part: ring.part.map(|p| p as f32), angles });
    }
}

/// Sum of the lengths of intervals, rad.
pub(super) fn extent(angles: &[Interval]) -> f64 {
    angles.iter().map(span).sum()
}

/// Does a gap open or close from one ring to the next? The width has a kink there.
fn divides(below: &EngagedPart, above: &EngagedPart) -> bool {
    let jumps = || (extent(&below.angles) - extent(&above.angles)).abs() > GAP_RAD;
    follows(&below.ring, &above.ring) && (below.angles.len() != above.angles.len() || jumps())
}

/// Does the engagement of a ring of a bottom differ from that of the next ring inward or outward, or is the ring inward not engaged? Where a
/// wall meets a bottom the width bends sharply, and beyond the edge of the bottom there is no ring to show it.
fn uneven(found: &[EngagedPart], k: usize) -> bool {
    let turns = |inward: &EngagedPart, outward: &EngagedPart| {
        follows(&inward.ring, &outward.ring) && (extent(&inward.angles) - extent(&outward.angles)).abs() > UNEVEN_RAD
    };
    let of = &found[k];
    of.ends[0] || (k > 0 && turns(&found[k - 1], of)) || found.get(k + 1).is_some_and(|outward| turns(of, outward))
}
