//! Lowers the cells under a cutter that moves along an element. In: a tile, the element, the cutter. Out: the tile with
//! the heights `min over the track of tip height + outline height at the cell's distance`, and the element as provenance
//! of every cell it lowered strictly.
//!
//! Cells are worked row by row in `f32`, in coordinates along (u) and across (v) the track. With slope tan θ and ball
//! radius R the lower envelope of a swept ball is z_c + u tan θ − √(R² − v²)/cos θ while the contact lies on the line, and
//! a sphere at its ends. Outlines without a closed form are minimised over the track (convex for convex outlines).

#![allow(clippy::inline_always)] // the row loops vectorise only when the height of a cell is inlined into them

use super::element::Track;
use super::field::Tile;
use super::region::least_convex;
use crate::machine::{Profile, Segment};
use crate::path::Vec3;

/// Outline of a cutter as the sweep needs it.
#[derive(Debug, Clone)]
pub struct Form {
    /// Its profile.
    pub profile: Profile,
    /// Largest radius, mm.
    pub radius: f64,
    /// Its lowest part is flat.
    pub flat_bottom: bool,
    /// Height at which the outline begins to narrow; cells that stand above it are left as they are.
    neck: f32,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Flat,
    Ball,
    /// Flat of radius `flat`, then a corner of radius `corner`.
    Bull {
        flat: f32,
        corner: f32,
    },
    Other,
}

impl Form {
    /// The form of a profile.
    pub fn new(profile: &Profile) -> Self {
        let kind = if profile.is_flat() {
            Kind::Flat
        } else if profile.as_ball().is_some() {
            Kind::Ball
        } else if let Some([flat, corner]) = profile.as_bull() {
            Kind::Bull { flat: flat as f32, corner: corner as f32 }
        } else {
            Kind::Other
        };
        let flat_bottom = matches!(profile.segments.first(), Some(Segment::Line { from, to }) if from[1] == to[1]);
        let neck = profile.neck().map_or(f32::INFINITY, |neck| neck as f32);
        Self { radius: profile.max_radius(), flat_bottom, neck, profile: profile.clone(), kind }
    }
    /// A flat end mill?
    pub fn is_flat(&self) -> bool {
        self.kind == Kind::Flat
    }
    /// A ball end mill?
    pub fn is_ball(&self) -> bool {
        self.kind == Kind::Ball
    }
    /// Radius kept clear at height `z` above the tip ([`Profile::radius_below`]).
    pub fn radius_below(&self, z: f64) -> Option<f64> {
        match self.kind {
            _ if z < 0.0 => None,
            Kind::Flat => Some(self.radius),
            Kind::Ball if z >= self.radius => Some(self.radius),
            Kind::Ball => Some((z * (2.0 * self.radius - z)).sqrt()),
            Kind::Bull { .. } | Kind::Other => self.profile.radius_below(z),
        }
    }
    /// Lowest height of the outline at distance `r` from the axis ([`Profile::height_at`]).
    pub fn height_at(&self, r: f64) -> Option<f64> {
        match self.kind {
            Kind::Flat | Kind::Ball if r > self.radius => None,
            Kind::Flat => Some(0.0),
            Kind::Ball => Some(self.radius - (self.radius * self.radius - r * r).sqrt()),
            Kind::Bull { .. } | Kind::Other => self.profile.height_at(r),
        }
    }
}

/// Sweeps `form` along `track`; lowered cells get `id`. The row loops are compiled twice, and the wider one is taken where
/// the processor has it: both do the same operations in the same order (no fused multiply-add), so the bits agree.
pub fn sweep(tile: &mut Tile, track: &Track, form: &Form, id: u32) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        #[allow(unsafe_code)] // the only unsafe line: the processor was just asked for these instructions
        unsafe {
            sweep_avx2(tile, track, form, id);
        }
        return;
    }
    sweep_portable(tile, track, form, id);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn sweep_avx2(tile: &mut Tile, track: &Track, form: &Form, id: u32) {
    sweep_body(tile, track, form, id);
}

fn sweep_portable(tile: &mut Tile, track: &Track, form: &Form, id: u32) {
    sweep_body(tile, track, form, id);
}

#[inline(always)]
fn sweep_body(tile: &mut Tile, track: &Track, form: &Form, id: u32) {
    let (low, high) = track.bounds();
    if low.z as f32 >= tile.highest {
        return;
    }
    let window = |r: f64| tile.window([low.x - r, low.y - r], [high.x + r, high.y + r]);
    // What stands no higher than the cutter there stays: nothing beyond the radius it has at the height of the stock.
    let mut r = form.radius;
    for _ in 0..2 {
        let above = f64::from(tile.top_in(&window(r))) - low.z;
        if above <= 0.0 {
            return;
        }
        r = form.radius_below(above + SLACK_MM).map_or(r, |reach| reach.min(r));
    }
    let [columns, rows] = window(r);
    if columns.is_empty() || rows.is_empty() {
        return;
    }
    if (low.z as f32) + form.neck < tile.highest {
        sweep_under(tile, track, form, id, [columns, rows]);
        return;
    }
    match *track {
        Track::Line { from, to } => sweep_line(tile, rows, [from, to], form, r, id),
        Track::Arc { centre, z, radius, start, sweep } => {
            let arc = ArcSweep::new(centre, z, 0.5 * (radius[0] + radius[1]), start, sweep);
            sweep_arc(tile, [columns, rows], &arc, form, r, id);
        }
    }
}

/// As [`sweep`] for an outline that narrows upward: a cell that stands above the neck would be undercut, which a height
/// field cannot hold, so it stays.
fn sweep_under(tile: &mut Tile, track: &Track, form: &Form, id: u32, [columns, rows]: [std::ops::Range<usize>; 2]) {
    let open = Form { neck: f32::INFINITY, ..form.clone() };
    let (before, ids) = (tile.heights.clone(), tile.ids.clone());
    let highest = std::mem::replace(&mut tile.highest, f32::INFINITY);
    sweep(tile, track, &open, id);
    tile.highest = highest;
    let limit = track.bounds().0.z as f32 + form.neck;
    for j in rows {
        for k in j * tile.size[0] + columns.start..j * tile.size[0] + columns.end {
            if before[k] > limit {
                (tile.heights[k], tile.ids[k]) = (before[k], ids[k]);
            }
        }
    }
}

/// A straight track in the plane: start, unit direction, length, height at the start and rise.
#[derive(Clone, Copy)]
struct Line {
    from: [f64; 2],
    dir: [f64; 2],
    run: f64,
    z: f64,
    rise: f64,
}

#[inline(always)]
fn sweep_line(tile: &mut Tile, rows: std::ops::Range<usize>, [from, to]: [Vec3; 2], form: &Form, reach: f64, id: u32) {
    let delta = to - from;
    let run = delta.x.hypot(delta.y);
    let dir = if run > 1e-9 { [delta.x / run, delta.y / run] } else { [1.0, 0.0] };
    let plunge = run <= 1e-9;
    let z = if plunge { from.z.min(to.z) } else { from.z };
    let line = Line {
        from: [from.x, from.y],
        dir,
        run: if plunge { 0.0 } else { run },
        z,
        rise: if plunge { 0.0 } else { delta.z },
    };
    let (run, z, rise, r) = (line.run as f32, z as f32, line.rise as f32, form.radius as f32);
    let level = line.rise.abs() < 1e-9;
    let r2 = r * r;
    match form.kind {
        Kind::Flat if level => lower_rows(tile, rows, &line, reach, id, |u, v| {
            let du = u - u.max(0.0).min(run);
            if du * du + v * v <= r2 { z } else { f32::INFINITY }
        }),
        Kind::Flat => {
            let slope = rise / run;
            lower_rows(tile, rows, &line, reach, id, |u, v| {
                let s = (r2 - v * v).max(0.0).sqrt();
                let lowest = if slope < 0.0 { (u + s).min(run) } else { (u - s).max(0.0) };
                let inside = v * v <= r2 && u + s >= 0.0 && u - s <= run;
                if inside { z + slope * lowest } else { f32::INFINITY }
            });
        }
        Kind::Ball => {
            let length = run.hypot(rise);
            let (slope, sin, inv_cos) =
                if run > 0.0 { (rise / run, rise / length, length / run) } else { (0.0, 0.0, 1.0) };
            let centre = z + r;
            let (cos, slack) = (if run > 0.0 { run / length } else { 1.0 }, 1e-5 * r2);
            // The endless sweep lies no higher: a cell below it stays. Asked without a root.
            let may = |u: f32, v: f32, cell: f32| {
                let below = (centre + slope * u - cell) * cos;
                below < 0.0 || below * below <= r2 - v * v + slack
            };
            lower_rows_where(tile, rows, &line, reach, id, may, |u, v| {
                let across = r2 - v * v;
                let s = across.max(0.0).sqrt();
                let contact = u - s * sin;
                let end = contact.max(0.0).min(run);
                let du = u - end;
                let left = across - du * du;
                let on_end = centre + slope * end - left.max(0.0).sqrt();
                let on_line = centre + slope * u - s * inv_cos;
                let height = if contact == end { on_line } else { on_end };
                let inside = across >= 0.0 && (contact == end || left >= 0.0);
                if inside { height } else { f32::INFINITY }
            });
        }
        Kind::Bull { flat, corner } if level => {
            let c2 = corner * corner;
            lower_rows(tile, rows, &line, reach, id, |u, v| {
                let du = u - u.max(0.0).min(run);
                let d2 = du * du + v * v;
                let d = (d2.sqrt() - flat).max(0.0);
                let height = z + corner - (c2 - d * d).max(0.0).sqrt();
                if d2 <= r2 { height } else { f32::INFINITY }
            });
        }
        Kind::Bull { .. } | Kind::Other => {
            let profile = &form.profile;
            lower_rows(tile, rows, &line, reach, id, |u, v| swept_height(profile, &line, f64::from(u), f64::from(v)));
        }
    }
}

/// Least height of an outline along an inclined line at (u, v).
fn swept_height(profile: &Profile, line: &Line, u: f64, v: f64) -> f32 {
    let r = profile.max_radius();
    if v.abs() > r {
        return f32::INFINITY;
    }
    let s = (r * r - v * v).sqrt();
    let (a, b) = ((u - s).max(0.0), (u + s).min(line.run));
    if a > b {
        return f32::INFINITY;
    }
    let slope = if line.run > 0.0 { line.rise / line.run } else { 0.0 };
    let height = |t: f64| profile.height_at((u - t).hypot(v).min(r)).map_or(f64::INFINITY, |h| line.z + slope * t + h);
    if line.rise == 0.0 { height(u.clamp(a, b)) as f32 } else { least_convex(height, a, b).1 as f32 }
}

/// Applies `height(u, v)` to every cell within `radius` of the line.
#[inline(always)]
fn lower_rows(
    tile: &mut Tile,
    rows: std::ops::Range<usize>,
    line: &Line,
    radius: f64,
    id: u32,
    height: impl Fn(f32, f32) -> f32,
) {
    lower_rows_where(tile, rows, line, radius, id, |_, _, _| true, height);
}

/// As [`lower_rows`], for those cells only of which `may(u, v, its height)` says that they may be lowered.
#[inline(always)]
fn lower_rows_where(
    tile: &mut Tile,
    rows: std::ops::Range<usize>,
    line: &Line,
    radius: f64,
    id: u32,
    may: impl Fn(f32, f32, f32) -> bool,
    height: impl Fn(f32, f32) -> f32,
) {
    for j in rows {
        let y = tile.first[1] + j as f64 * tile.cell[1] - line.from[1];
        let Some((x0, x1)) = row_span(line, radius, y) else { continue };
        let begin = ((x0 + line.from[0] - tile.first[0]) / tile.cell[0]).ceil().max(0.0) as usize;
        let end = ((x1 + line.from[0] - tile.first[0]) / tile.cell[0]).floor() + 1.0;
        let end = end.clamp(0.0, tile.size[0] as f64) as usize;
        if begin >= end {
            continue;
        }
        let x = tile.first[0] + begin as f64 * tile.cell[0] - line.from[0];
        let u = (x * line.dir[0] + y * line.dir[1]) as f32;
        let v = (y * line.dir[0] - x * line.dir[1]) as f32;
        let (du, dv) = ((tile.cell[0] * line.dir[0]) as f32, (-tile.cell[0] * line.dir[1]) as f32);
        let row = j * tile.size[0];
        for first in (begin..end).step_by(CHUNK) {
            let last = (first + CHUNK).min(end);
            let from = (first - begin) as i32;
            let mut some = false;
            for (k, cell) in tile.heights[row + first..row + last].iter().enumerate() {
                let k = (from + k as i32) as f32;
                some |= may(u + k * du, v + k * dv, *cell);
            }
            if some {
                lower_cells(tile, j, first..last, id, |k| {
                    height(u + (from as f32 + k) * du, v + (from as f32 + k) * dv)
                });
            }
        }
    }
}

/// Height that rounding does not exceed, mm.
const SLACK_MM: f64 = 1e-3;
/// Cells asked together whether any may be lowered.
const CHUNK: usize = 32;

/// Lowers a run of cells of one row; `height` takes the number of the cell in the run.
#[inline(always)]
fn lower_cells(tile: &mut Tile, row: usize, run: std::ops::Range<usize>, id: u32, height: impl Fn(f32) -> f32) {
    let first = row * tile.size[0];
    let floor = tile.floor;
    let heights = &mut tile.heights[first..][run.clone()];
    let ids = &mut tile.ids[first..][run];
    for (k, (cell, provenance)) in heights.iter_mut().zip(ids).enumerate() {
        let h = height(k as i32 as f32).max(floor);
        let lower = h < *cell;
        *cell = if lower { h } else { *cell };
        *provenance = if lower { id } else { *provenance };
    }
}

/// Range of x (relative to the start) in which the row at `y` lies within `radius` of the line.
fn row_span(line: &Line, radius: f64, y: f64) -> Option<(f64, f64)> {
    let [dx, dy] = line.dir;
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for [cx, cy] in [[0.0, 0.0], [line.run * dx, line.run * dy]] {
        let left = radius * radius - (y - cy) * (y - cy);
        if left >= 0.0 {
            let s = left.sqrt();
            (low, high) = (low.min(cx - s), high.max(cx + s));
        }
    }
    // The strip |v| ≤ R, 0 ≤ u ≤ run between the two discs.
    let across = slab(y * dx - radius, y * dx + radius, dy);
    let along = slab(-y * dy, line.run - y * dy, dx);
    let (a, b) = (across.0.max(along.0), across.1.min(along.1));
    if a <= b {
        (low, high) = (low.min(a), high.max(b));
    }
    (low <= high).then_some((low, high))
}

/// x with `low ≤ x·slope ≤ high`.
fn slab(low: f64, high: f64, slope: f64) -> (f64, f64) {
    if slope.abs() < 1e-12 {
        return if low <= 0.0 && high >= 0.0 { (f64::NEG_INFINITY, f64::INFINITY) } else { (1.0, 0.0) };
    }
    let (a, b) = (low / slope, high / slope);
    (a.min(b), a.max(b))
}

/// A level arc as its sweep needs it.
struct ArcSweep {
    centre: [f64; 2],
    z: f64,
    radius: f64,
    /// Unit vectors to start and end, ordered counter-clockwise.
    first: [f32; 2],
    last: [f32; 2],
    angle: f64,
}

impl ArcSweep {
    fn new(centre: [f64; 2], z: f64, radius: f64, start: f64, sweep: f64) -> Self {
        let (a, b) = if sweep >= 0.0 { (start, start + sweep) } else { (start + sweep, start) };
        let unit = |angle: f64| [angle.cos() as f32, angle.sin() as f32];
        Self { centre, z, radius, first: unit(a), last: unit(b), angle: sweep.abs() }
    }
    /// Distance from the arc of the point (x, y) relative to the centre.
    #[inline(always)]
    fn distance(&self, x: f32, y: f32) -> f32 {
        let radius = self.radius as f32;
        let after = self.first[0] * y - self.first[1] * x >= 0.0;
        let before = x * self.last[1] - y * self.last[0] >= 0.0;
        let within = if self.angle >= std::f64::consts::TAU {
            true
        } else if self.angle <= std::f64::consts::PI {
            after && before
        } else {
            after || before
        };
        let to = |end: [f32; 2]| {
            let (dx, dy) = (x - radius * end[0], y - radius * end[1]);
            (dx * dx + dy * dy).sqrt()
        };
        let on_arc = ((x * x + y * y).sqrt() - radius).abs();
        if within { on_arc } else { to(self.first).min(to(self.last)) }
    }
}

#[inline(always)]
fn sweep_arc(tile: &mut Tile, window: [std::ops::Range<usize>; 2], arc: &ArcSweep, form: &Form, reach: f64, id: u32) {
    let (z, r) = (arc.z as f32, form.radius as f32);
    match form.kind {
        Kind::Flat => lower_ring(tile, window, arc, reach, id, |d| if d <= r { z } else { f32::INFINITY }),
        Kind::Ball => lower_ring(tile, window, arc, reach, id, |d| {
            let left = r * r - d * d;
            if left >= 0.0 { z + r - left.max(0.0).sqrt() } else { f32::INFINITY }
        }),
        Kind::Bull { flat, corner } => lower_ring(tile, window, arc, reach, id, |d| {
            let e = (d - flat).max(0.0);
            let height = z + corner - (corner * corner - e * e).max(0.0).sqrt();
            if d <= r { height } else { f32::INFINITY }
        }),
        Kind::Other => lower_ring(tile, window, arc, reach, id, |d| {
            form.profile.height_at(f64::from(d)).map_or(f32::INFINITY, |h| z + h as f32)
        }),
    }
}

/// Applies `height(distance)` to the cells of the window that lie in the ring about the arc.
#[inline(always)]
fn lower_ring(
    tile: &mut Tile,
    window: [std::ops::Range<usize>; 2],
    arc: &ArcSweep,
    radius: f64,
    id: u32,
    height: impl Fn(f32) -> f32,
) {
    let [columns, rows] = window;
    for j in rows {
        let y = tile.first[1] + j as f64 * tile.cell[1] - arc.centre[1];
        let half = |r: f64| (r * r - y * y).max(0.0).sqrt();
        let (outer, inner) = (half(arc.radius + radius), half((arc.radius - radius).max(0.0)));
        for (low, high) in [(-outer, -inner), (inner, outer)] {
            let index = |x: f64| (x + arc.centre[0] - tile.first[0]) / tile.cell[0];
            let begin = (index(low).ceil().max(0.0) as usize).max(columns.start);
            let end = ((index(high).floor() + 1.0).max(0.0) as usize).min(columns.end);
            if begin >= end {
                continue;
            }
            let x = (tile.first[0] + begin as f64 * tile.cell[0] - arc.centre[0]) as f32;
            let (dx, y) = (tile.cell[0] as f32, y as f32);
            lower_cells(tile, j, begin..end, id, |k| height(arc.distance(x + k * dx, y)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Box3;
    use crate::stock::Field;

    #[test]
    fn the_wide_and_the_portable_sweep_agree_bit_for_bit() {
        let extent = Box3 { min: Vec3::zeros(), max: Vec3::new(15.0, 15.0, 5.0) };
        let field = Field::new(extent, 0.1, |_, _| 5.0);
        let (mut wide, mut portable) = (field.tiles[0].clone(), field.tiles[0].clone());
        for (index, profile) in
            [Profile::flat(3.0, 9.0), Profile::ball(4.0, 9.0), Profile::bull(5.0, 1.0, 9.0)].iter().enumerate()
        {
            let form = Form::new(profile);
            for k in 0..40 {
                let at =
                    |a: f64| Vec3::new(7.0 + 7.0 * (a * 1.7).sin(), 7.0 + 7.0 * (a * 2.3).cos(), 3.0 + (a * 5.1).sin());
                let id = (100 * index + k) as u32;
                let line = Track::Line { from: at(f64::from(id)), to: at(f64::from(id) + 0.3) };
                let arc = Track::Arc {
                    centre: [7.0, 7.0],
                    z: 1.0 + 0.01 * k as f64,
                    radius: [4.0; 2],
                    start: k as f64,
                    sweep: 2.0,
                };
                for track in [line, arc] {
                    sweep(&mut wide, &track, &form, id);
                    sweep_portable(&mut portable, &track, &form, id);
                }
            }
        }
        assert!(wide.heights.iter().any(|h| *h < 4.0));
        assert!(wide.heights.iter().zip(&portable.heights).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert_eq!(wide.ids, portable.ids);
    }
}
