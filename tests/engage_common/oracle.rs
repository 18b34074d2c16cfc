//! Closed forms of what a cutter meets, written without the simulator: the lowest height that earlier passes left over a
//! point, and the engaged angles and sections that follow from it.
#![allow(dead_code)] // each test file uses its own part of it

use super::{ball, bull, flat, tool};
use feedwright::engage::{EngagedArc, EngagementMap, Station};
use feedwright::machine::{Profile, Segment, Shape, Tool};
use std::f64::consts::{FRAC_PI_2, TAU};

/// A cutter by its formula.
#[derive(Debug, Clone, Copy)]
pub enum Mill {
    Flat(f64),
    Ball(f64),
    /// Radius, corner radius.
    Bull(f64, f64),
    /// Radius, radius of the ball at its tip, angle of the side to the axis.
    Taper(f64, f64, f64),
    /// Radius, radius of the flat at its tip, angle of the side to the axis.
    Chamfer(f64, f64, f64),
}

impl Mill {
    pub fn radius(self) -> f64 {
        match self {
            Mill::Flat(r) | Mill::Ball(r) | Mill::Bull(r, _) | Mill::Taper(r, ..) | Mill::Chamfer(r, ..) => r,
        }
    }
    pub fn tool(self) -> Tool {
        match self {
            Mill::Flat(r) => flat(2.0 * r),
            Mill::Ball(r) => ball(2.0 * r),
            Mill::Bull(r, corner) => bull(2.0 * r, corner),
            Mill::Taper(r, tip, side) => {
                let ball = Segment::Arc { centre: [0.0, tip], radius: tip, from_rad: -FRAC_PI_2, to_rad: -side };
                let (foot, top) = ([tip * side.cos(), tip - tip * side.sin()], self.lowest(r));
                let cone = Segment::Line { from: foot, to: [r, top] };
                let shank = Segment::Line { from: [r, top], to: [r, top + 20.0] };
                tool(1, Shape::Taper, Profile { segments: vec![ball, cone, shank] })
            }
            Mill::Chamfer(r, tip, side) => {
                tool(1, Shape::Chamfer, Profile::cone(2.0 * r, 2.0 * tip, 2.0 * side, self.lowest(r) + 20.0))
            }
        }
    }
    /// Height above the tip of what it leaves at a distance from its axis.
    pub fn lowest(self, w: f64) -> f64 {
        if w > self.radius() {
            return f64::INFINITY;
        }
        let fillet = |corner: f64, d: f64| corner - (corner * corner - d * d).max(0.0).sqrt();
        match self {
            Mill::Flat(_) => 0.0,
            Mill::Ball(r) => fillet(r, w),
            Mill::Bull(r, corner) => fillet(corner, (w - r + corner).max(0.0)),
            Mill::Taper(_, tip, side) if w <= tip * side.cos() => fillet(tip, w),
            Mill::Taper(_, tip, side) => tip - tip * side.sin() + (w - tip * side.cos()) / side.tan(),
            Mill::Chamfer(_, tip, side) => (w - tip).max(0.0) / side.tan(),
        }
    }
}

/// Where the tip of an earlier pass went.
#[derive(Debug, Clone, Copy)]
pub enum Way {
    /// Level, straight.
    Segment([f64; 2], [f64; 2], f64),
    /// Level, along an arc: centre, radius, start, sweep, height.
    Arc([f64; 2], f64, f64, f64, f64),
    /// A ball's, straight through a point for ever along a unit vector.
    Slope([f64; 3], [f64; 3]),
}

/// Height that `mill` leaves over a point.
pub fn left_by(mill: Mill, way: &Way, p: [f64; 2]) -> f64 {
    match *way {
        Way::Segment(a, b, z) => {
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let square = dx * dx + dy * dy;
            let t = if square > 0.0 { ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / square } else { 0.0 };
            let t = t.clamp(0.0, 1.0);
            z + mill.lowest((p[0] - a[0] - t * dx).hypot(p[1] - a[1] - t * dy))
        }
        Way::Arc(c, radius, start, sweep, z) => {
            let (x, y) = (p[0] - c[0], p[1] - c[1]);
            let ahead = ((y.atan2(x) - start) * sweep.signum()).rem_euclid(TAU);
            let end = |angle: f64| (x - radius * angle.cos()).hypot(y - radius * angle.sin());
            let on = if ahead <= sweep.abs() { (x.hypot(y) - radius).abs() } else { f64::INFINITY };
            z + mill.lowest(on.min(end(start)).min(end(start + sweep)))
        }
        Way::Slope(q, t) => {
            let across = t[0].hypot(t[1]);
            let (x, y) = (p[0] - q[0], p[1] - q[1]);
            let (u, v) = ((x * t[0] + y * t[1]) / across, (y * t[0] - x * t[1]) / across);
            let r = mill.radius();
            if v.abs() > r {
                return f64::INFINITY;
            }
            q[2] + r + u * t[2] / across - (r * r - v * v).sqrt() / across
        }
    }
}

/// Steps along the path.
const STEPS: i32 = 400;

/// Engaged intervals of immersion (entry, exit) of a ring: radius, height, normal, where it leads and `uncut(x, y, z)`.
pub fn engaged(
    tip: [f64; 3],
    tangent: [f64; 3],
    ring: [f64; 4],
    uncut: &impl Fn(f64, f64, f64) -> bool,
) -> Vec<[f64; 2]> {
    let [radius, z, normal_r, normal_z] = ring;
    let across = tangent[0].hypot(tangent[1]);
    let (dx, dy) = (tangent[0] / across, tangent[1] / across);
    let inside = |phi: f64| {
        // φ from the left of the feed, clockwise.
        let (forward, left) = (phi.sin(), phi.cos());
        let (x, y) = (forward * dx - left * dy, forward * dy + left * dx);
        let leads = normal_r * across * forward + normal_z * tangent[2] > 1e-12;
        leads && uncut(tip[0] + radius * x, tip[1] + radius * y, tip[2] + z)
    };
    let at = |k: i32| -FRAC_PI_2 + TAU * (f64::from(k) + 0.137) / f64::from(STEPS);
    let edge = |mut a: f64, mut b: f64| {
        let first = inside(a);
        for _ in 0..40 {
            let middle = 0.5 * (a + b);
            if inside(middle) == first {
                a = middle;
            } else {
                b = middle;
            }
        }
        0.5 * (a + b)
    };
    let mut intervals = Vec::new();
    let mut open = inside(at(0)).then(|| at(0));
    for k in 1..=STEPS {
        let now = inside(at(k));
        match (open, now) {
            (None, true) => open = Some(edge(at(k - 1), at(k))),
            (Some(from), false) => {
                intervals.push([from, edge(at(k - 1), at(k))]);
                open = None;
            }
            _ => {}
        }
    }
    if let Some(from) = open {
        intervals.push([from, at(STEPS)]);
    }
    intervals
}

/// Deviations in degrees of the angles of a station from those expected at one place `at(s)` (tip, tangent) of its part
/// within `range`: where the engagement changes over it, at the place they fit best, which must be nearly as engaged as any.
/// A wrong number of arcs counts as half the angle that is wrongly in or out.
pub fn deviations(
    map: &EngagementMap,
    tool: u32,
    station: &Station,
    range: [f64; 2],
    at: &impl Fn(f64) -> ([f64; 3], [f64; 3]),
    uncut: &impl Fn(f64, f64, f64) -> bool,
) -> Vec<f64> {
    let arcs = map.arcs_of(station);
    let slices = map.slices_of(tool);
    let mut used: Vec<u32> = arcs.iter().map(|arc| arc.slice).collect();
    used.dedup();
    let expected = |s: f64| -> Vec<(u32, Vec<[f64; 2]>)> {
        let (tip, tangent) = at(s);
        let ring = |index: u32| {
            let slice = &slices[index as usize];
            [slice.radius_mm, slice.z_mm, slice.normal_r, slice.normal_z]
        };
        used.iter().map(|index| (*index, engaged(tip, tangent, ring(*index), uncut))).collect()
    };
    let area = |s: f64, found: &[(u32, Vec<[f64; 2]>)]| -> f64 {
        let tangent = at(s).1;
        let across = tangent[0].hypot(tangent[1]);
        let one = |index: u32, arc: &[f64; 2]| {
            let ring = &slices[index as usize];
            let lead =
                ring.normal_r * across * (arc[0].cos() - arc[1].cos()) + ring.normal_z * tangent[2] * (arc[1] - arc[0]);
            ring.edge_mm * ring.radius_mm * lead
        };
        found.iter().map(|(index, arcs)| arcs.iter().map(|arc| one(*index, arc)).sum::<f64>()).sum()
    };
    let errors = |expected: &[(u32, Vec<[f64; 2]>)]| -> Vec<f64> {
        expected.iter().flat_map(|(index, expected)| errors_of_ring(arcs, *index, expected)).collect()
    };
    let (from, to) = (station.from_mm.max(range[0]), station.to_mm.min(range[1]));
    let try_at = |s: f64| {
        let expected = expected(s);
        let errors = errors(&expected);
        (errors.iter().sum::<f64>(), area(s, &expected), errors)
    };
    let first = try_at(from);
    if (try_at(to).1 - first.1).abs() < 1e-9 * first.1 {
        return first.2;
    }
    let places =
        |centre: f64, half: f64| (-16..=16).map(move |k: i32| (centre + half * f64::from(k) / 16.0).clamp(from, to));
    let (mut centre, mut half) = (0.5 * (from + to), 0.5 * (to - from));
    let (mut best, mut most) = ((f64::INFINITY, 0.0, Vec::new()), 0.0f64);
    for _ in 0..4 {
        for s in places(centre, half) {
            let tried = try_at(s);
            most = most.max(tried.1);
            if tried.0 < best.0 {
                (best, centre) = (tried, s);
            }
        }
        half /= 16.0;
    }
    assert!(best.1 >= 0.95 * most, "{} .. {}: {} where {most} is met", station.from_mm, station.to_mm, best.1);
    best.2
}

/// What of some intervals of angles lies in none of others.
pub fn uncovered(intervals: &[[f64; 2]], by: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut by = by.to_vec();
    by.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut open = Vec::new();
    for [from, to] in intervals {
        let mut at = *from;
        for [begin, end] in &by {
            open.push([at, begin.min(*to)]);
            at = at.max(*end);
        }
        open.push([at, *to]);
    }
    open.retain(|[from, to]| from < to);
    open
}

/// Contact on the rings of a station that is met at a place `at(s)` (tip, tangent) of it and is in none of its arcs, as a share of what
/// these hold: the most of five places.
pub fn missing(
    map: &EngagementMap,
    tool: u32,
    station: &Station,
    at: &impl Fn(f64) -> ([f64; 3], [f64; 3]),
    uncut: &impl Fn(f64, f64, f64) -> bool,
) -> f64 {
    let slices = map.slices_of(tool);
    let contact = |slice: usize, [from, to]: [f64; 2]| slices[slice].radius_mm * slices[slice].edge_mm * (to - from);
    let arcs: Vec<(usize, [f64; 2])> = map
        .arcs_of(station)
        .iter()
        .map(|arc| (arc.slice as usize, [arc.entry_rad, arc.exit_rad].map(f64::from)))
        .collect();
    let mut used: Vec<usize> = arcs.iter().map(|(slice, _)| *slice).collect();
    used.dedup();
    let held: f64 = arcs.iter().map(|(slice, angles)| contact(*slice, *angles)).sum();
    let lacking = |k: u32| {
        let (tip, tangent) = at(station.from_mm + station.length_mm() * f64::from(k) / 4.0);
        let of_ring = |index: &usize| {
            let slice = &slices[*index];
            let ring = [slice.radius_mm, slice.z_mm, slice.normal_r, slice.normal_z];
            let met: Vec<[f64; 2]> =
                arcs.iter().filter(|(slice, _)| slice == index).map(|(_, angles)| *angles).collect();
            let open = uncovered(&engaged(tip, tangent, ring, uncut), &met);
            open.into_iter().map(|angles| contact(*index, angles)).sum::<f64>()
        };
        used.iter().map(of_ring).sum::<f64>()
    };
    (0..=4).map(lacking).fold(0.0, f64::max) / held
}

/// Deviations of the arcs of one ring, in degrees.
fn errors_of_ring(arcs: &[EngagedArc], index: u32, expected: &[[f64; 2]]) -> Vec<f64> {
    let of_ring = arcs.iter().filter(|arc| arc.slice == index);
    let mut found: Vec<[f64; 2]> = of_ring.map(|arc| [f64::from(arc.entry_rad), f64::from(arc.exit_rad)]).collect();
    found.sort_by(|a, b| a[0].total_cmp(&b[0]));
    if found.len() == expected.len() {
        let both = found.iter().zip(expected);
        return both.flat_map(|(found, e)| [0, 1].map(|k| (found[k] - e[k]).abs().to_degrees())).collect();
    }
    let sum = |arcs: &[[f64; 2]]| arcs.iter().map(|arc| arc[1] - arc[0]).sum::<f64>();
    vec![0.5 * (sum(&found) - sum(expected)).abs().to_degrees()]
}

/// Median, 99 % and worst.
pub fn quantiles(values: &mut [f64]) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
    [at(0.5), at(0.99), at(1.0)]
}

/// Volume that the stations of a move remove between two places, mm³.
pub fn removed_between(stations: &[Station], from: f64, to: f64) -> f64 {
    let overlap = |s: &Station| (s.to_mm.min(to) - s.from_mm.max(from)).max(0.0);
    stations.iter().map(|s| f64::from(s.removal_area_mm2) * overlap(s)).sum()
}

/// Largest relative deviation of the removed volume from `expected_per_mm` over windows of 1 mm between two places.
pub fn worst_rate(stations: &[Station], [from, to]: [f64; 2], expected_per_mm: f64) -> f64 {
    let count = ((to - from - 1.0) / 0.25) as usize;
    let window = |k: usize| {
        let begin = from + 0.25 * k as f64;
        (removed_between(stations, begin, begin + 1.0) / expected_per_mm - 1.0).abs()
    };
    (0..=count).map(window).fold(0.0, f64::max)
}

/// ∫ f over an interval, midpoint rule.
pub fn integral(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    let count = ((to - from) / 2e-5).ceil();
    let step = (to - from) / count;
    (0..count as usize).map(|k| f(from + (k as f64 + 0.5) * step)).sum::<f64>() * step
}

/// A program seen from a frame turned by some degrees about the origin.
pub fn turned(degrees: f64, u: f64, v: f64, z: f64) -> [f64; 3] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    [u * cos - v * sin, u * sin + v * cos, z]
}

pub fn xy(p: [f64; 3]) -> [f64; 2] {
    [p[0], p[1]]
}
