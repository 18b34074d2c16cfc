//! What the mill meets along each move, found by brute force. In: the part, how far its stock stands proud and which
//! diameter the mill really has. Out: stations along every feed move with their engaged arcs.
//!
//! A point of the mill's front half circle at the height z is in material when it lies in the stock and in none of the
//! bands swept by earlier moves whose tip was at or below z. The half circle is scanned in steps and the changes are
//! bracketed by bisection. φ counts from the left normal of the feed direction, clockwise seen from above, so that a
//! tooth meets the chip h = f sin φ, and a cut is up-milling for φ < π/2.

use super::programs::Part;
use super::writer::{Action, Path};
use std::f64::consts::PI;

/// Steps of the scan over the half circle.
const SCAN: usize = 60;
/// Spacing of stations, mm.
const SPACING_MM: f64 = 0.5;

/// An engaged arc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Lower end, mm above the tip.
    pub z_mm: f64,
    /// Height, mm.
    pub dz_mm: f64,
    /// Entry and exit, rad.
    pub phi: [f64; 2],
}

/// Engagement at one place of a move.
#[derive(Debug, Clone, Default)]
pub struct Station {
    /// Distance along the move, mm.
    pub s_mm: f64,
    /// Engaged arcs.
    pub arcs: Vec<Arc>,
    /// Tool tip, mm.
    pub at_mm: [f64; 3],
    /// Unit direction of the feed.
    pub direction: [f64; 2],
}

/// How the workpiece and the tool really are.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::struct_field_names)]
pub struct Reality {
    /// Stock higher than declared, mm.
    pub proud_top_mm: f64,
    /// Stock wider than declared on every side, mm.
    pub proud_side_mm: f64,
    /// Diameter of the mill, mm.
    pub diameter_mm: f64,
}

impl Reality {
    /// As declared.
    pub fn declared(part: &Part) -> Self {
        Self { proud_top_mm: 0.0, proud_side_mm: 0.0, diameter_mm: part.mill.diameter_mm }
    }
}

/// Stations of every step of the part; empty for steps that cut nothing.
pub fn stations(part: &Part, reality: &Reality) -> Vec<Vec<Station>> {
    let moves: Vec<Option<Path>> = part.steps.iter().map(|step| cutting_path(&step.action, reality)).collect();
    let boxes: Vec<_> = moves.iter().map(|path| path.as_ref().map(bounds)).collect();
    let near = |k: usize| -> Vec<Path> {
        let touches = |other: &usize| boxes_touch(boxes[*other].as_ref(), boxes[k].as_ref(), 0.5 * reality.diameter_mm);
        (0..k).filter(touches).filter_map(|other| moves[other]).collect()
    };
    (0..moves.len()).map(|k| moves[k].map_or(Vec::new(), |path| along(part, reality, &near(k), &path))).collect()
}

fn cutting_path(action: &Action, reality: &Reality) -> Option<Path> {
    match action {
        Action::Move { path, feed_mm_s: Some(_) } if path.from[2] < reality.proud_top_mm => Some(*path),
        _ => None,
    }
}

fn along(part: &Part, reality: &Reality, near: &[Path], path: &Path) -> Vec<Station> {
    let r = 0.5 * reality.diameter_mm;
    let tip = path.from[2];
    let mut levels: Vec<f64> = near.iter().map(|p| p.from[2]).filter(|z| *z > tip).collect();
    levels.extend([tip, reality.proud_top_mm]);
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    let steps = (path.length() / SPACING_MM).ceil().max(1.0);
    (0..=steps as usize)
        .map(|k| {
            let s_mm = path.length() * k as f64 / steps;
            let (at_mm, d) = path.at(s_mm);
            let mut station = Station { s_mm, arcs: Vec::new(), at_mm, direction: [d[0], d[1]] };
            let within_reach = |other: &&Path| distance(other, [at_mm[0], at_mm[1]]) < 2.0 * r + 1e-6;
            let near: Vec<Path> = near.iter().filter(within_reach).copied().collect();
            for pair in levels.windows(2) {
                let here = Slice { part, reality, near: &near, middle: 0.5 * (pair[0] + pair[1]), station: &station };
                let found: Vec<[f64; 2]> = here.engaged(r);
                let slab = |phi| Arc { z_mm: pair[0] - tip, dz_mm: pair[1] - pair[0], phi };
                station.arcs.extend(found.into_iter().map(slab));
            }
            station
        })
        .collect()
}

fn bounds(path: &Path) -> [[f64; 2]; 2] {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for k in 0..=16 {
        let (p, _) = path.at(path.length() * f64::from(k) / 16.0);
        for axis in 0..2 {
            low[axis] = low[axis].min(p[axis] - 0.5);
            high[axis] = high[axis].max(p[axis] + 0.5);
        }
    }
    [low, high]
}

fn boxes_touch(a: Option<&[[f64; 2]; 2]>, b: Option<&[[f64; 2]; 2]>, r: f64) -> bool {
    let (Some([la, ha]), Some([lb, hb])) = (a, b) else { return false };
    (0..2).all(|k| la[k] - r <= hb[k] + r && lb[k] - r <= ha[k] + r)
}

/// One height at one station.
struct Slice<'a> {
    part: &'a Part,
    reality: &'a Reality,
    near: &'a [Path],
    middle: f64,
    station: &'a Station,
}

impl Slice<'_> {
    /// Intervals of φ in material.
    fn engaged(&self, r: f64) -> Vec<[f64; 2]> {
        let inside = |phi: f64| self.in_material(self.point(phi, r), r);
        let step = PI / SCAN as f64;
        let mut arcs = Vec::new();
        let mut entry = None;
        let mut last = false;
        for k in 0..SCAN {
            let phi = (k as f64 + 0.5) * step;
            let now = inside(phi);
            let from = if k == 0 { 0.0 } else { phi - step };
            if now && !last {
                entry = Some(if k == 0 { edge(&inside, phi, 0.0) } else { edge(&inside, phi, from) });
            }
            if last && !now {
                arcs.push([entry.take().expect("an arc was entered"), edge(&inside, from, phi)]);
            }
            last = now;
        }
        if let Some(entry) = entry {
            arcs.push([entry, edge(&inside, PI - 0.5 * step, PI)]);
        }
        arcs
    }

    fn point(&self, phi: f64, r: f64) -> [f64; 2] {
        contact_point(self.station, phi, r)
    }

    fn in_material(&self, p: [f64; 2], r: f64) -> bool {
        let side = self.reality.proud_side_mm;
        let in_stock = (0..2).all(|k| p[k] >= -side && p[k] <= self.part.stock_mm[k] + side);
        in_stock && !self.near.iter().any(|path| path.from[2] <= self.middle && swept(path, p, r))
    }
}

/// Point of the circle at φ.
pub fn contact_point(station: &Station, phi: f64, r: f64) -> [f64; 2] {
    let [dx, dy] = station.direction;
    let (sin, cos) = phi.sin_cos();
    [station.at_mm[0] + r * (sin * dx - cos * dy), station.at_mm[1] + r * (sin * dy + cos * dx)]
}

/// Where it changes between an angle inside and one outside (or the end of the range, if it does not change).
fn edge(inside: &impl Fn(f64) -> bool, within: f64, beyond: f64) -> f64 {
    let (mut a, mut b) = (within, beyond);
    if inside(b) {
        return b;
    }
    for _ in 0..14 {
        let middle = 0.5 * (a + b);
        if inside(middle) {
            a = middle;
        } else {
            b = middle;
        }
    }
    0.5 * (a + b)
}

/// Is the point nearer to the path than the radius (by more than rounding)?
fn swept(path: &Path, p: [f64; 2], r: f64) -> bool {
    distance(path, p) < r - 1e-6
}

fn distance(path: &Path, p: [f64; 2]) -> f64 {
    let (a, b) = (path.from, path.to);
    let ends = (p[0] - a[0]).hypot(p[1] - a[1]).min((p[0] - b[0]).hypot(p[1] - b[1]));
    match path.arc {
        None => {
            let d = [b[0] - a[0], b[1] - a[1]];
            let squared = d[0] * d[0] + d[1] * d[1];
            if squared < 1e-18 {
                return ends;
            }
            let t = (((p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1]) / squared).clamp(0.0, 1.0);
            (p[0] - a[0] - t * d[0]).hypot(p[1] - a[1] - t * d[1])
        }
        Some((c, sweep)) => {
            let start = (a[1] - c[1]).atan2(a[0] - c[0]);
            let angle = (p[1] - c[1]).atan2(p[0] - c[0]);
            let turned = ((angle - start) * sweep.signum()).rem_euclid(2.0 * PI);
            if turned <= sweep.abs() { ((p[0] - c[0]).hypot(p[1] - c[1]) - path.radius()).abs() } else { ends }
        }
    }
}
