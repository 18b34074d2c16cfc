//! Lowers the cells under a cutter that moves along an element. In: a tile, the element, the cutter. Out: the tile with
//! the heights `min over the track of tip height + outline height at the cell's distance`, and the element as provenance
//! of every cell it lowered strictly.
//!
//! Cells are worked row by row in `f32`, in coordinates along (u) and across (v) the track, several at once
//! ([`super::heights`]). Outlines without a closed form are minimised over the track (convex for convex outlines). A tile
//! that records its past stores the values that it overwrites, so that sweeps can be undone, last first.

#![allow(clippy::inline_always)] // lanes are registers only where all is inlined

use super::element::Track;
use super::field::Tile;
use super::form::{Form, Kind};
use super::heights::{
    Ball, BallSection, Bulging, BulgingRamp, FlatSection, Heights, Level, Ramp, Round, Straight, Way,
};
use super::past::Past;
use super::runs::{Grid, Line, RowRuns, Run, ring_runs};
use super::wide::{Lanes, MOST_LANES, Task, widest};
use crate::numeric::golden_section;
use crate::path::Vec3;
use pulp::Simd;
use std::ops::Range;

/// Sweeps `form` along `track`; lowered cells get `id`. If the track is joined to the one swept before it, cells behind the joint are skipped,
/// because that one has lowered them.
pub fn sweep(tile: &mut Tile, (track, joined): (&Track, bool), form: &Form, id: u32) {
    widest(Sweep { tile, track, joined, form, id });
}

struct Sweep<'a> {
    tile: &'a mut Tile,
    track: &'a Track,
    joined: bool,
    form: &'a Form,
    id: u32,
}

impl Task for Sweep<'_> {
    type Out = ();
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        sweep_body(simd, self.tile, (self.track, self.joined), self.form, self.id);
    }
}

#[inline(always)]
fn sweep_body<S: Simd>(simd: S, tile: &mut Tile, (track, joined): (&Track, bool), form: &Form, id: u32) {
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
    let before = std::mem::replace(&mut tile.swept, rows.clone());
    if !before.is_empty() {
        tile.swept = before.start.min(rows.start)..before.end.max(rows.end);
    }
    if (low.z as f32) + form.neck < tile.highest {
        sweep_under(tile, track, form, id, [columns, rows]);
        return;
    }
    match *track {
        Track::Line { from, to } => sweep_line(simd, tile, rows, ([from, to], joined), form, r, id),
        Track::Arc { centre, z, radius, start, sweep } => {
            let radius = 0.5 * (radius[0] + radius[1]);
            let arc = Arc { centre, z, radius, round: Round::new(radius, start, sweep) };
            sweep_arc(simd, tile, [columns, rows], arc, form, r, id);
        }
    }
}

/// As [`sweep`] for an outline that narrows upward: a cell that stands above the neck would be undercut, which a height
/// field cannot hold, so it stays.
fn sweep_under(tile: &mut Tile, track: &Track, form: &Form, id: u32, [columns, rows]: [Range<usize>; 2]) {
    let open = Form { neck: f32::INFINITY, ..form.clone() };
    let (before, ids) = (tile.heights.clone(), tile.ids.clone());
    let highest = std::mem::replace(&mut tile.highest, f32::INFINITY);
    sweep(tile, (track, false), &open, id);
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

/// The place along a line before which the outline at the start of the line leaves every cell as low as the rest of the line does. A falling
/// line gets lower further on; for a ball the place is where its surface has the slope of the line. Negative infinity for an outline with a
/// neck, which may have left cells standing.
fn behind(line: &Line, form: &Form) -> f64 {
    let slope = line.rise / line.run;
    match &form.kind {
        _ if form.neck.is_finite() => f64::NEG_INFINITY,
        _ if slope >= 0.0 => 0.0,
        Kind::Ball => slope * form.radius,
        _ => f64::NEG_INFINITY,
    }
}

#[inline(always)]
fn sweep_line<S: Simd>(
    simd: S,
    tile: &mut Tile,
    rows: Range<usize>,
    ([from, to], joined): ([Vec3; 2], bool),
    form: &Form,
    reach: f64,
    id: u32,
) {
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
        behind: f64::NEG_INFINITY,
    };
    let line = if joined && !plunge { Line { behind: behind(&line, form), ..line } } else { line };
    let (run, z, rise, r) = (line.run as f32, line.z as f32, line.rise as f32, form.radius as f32);
    let level = line.rise.abs() < 1e-9;
    let r2 = r * r;
    let way = Straight(run);
    let put = Put { step: [line.dir[0], -line.dir[1]].map(|dir| tile.cell[0] * dir), id };
    let grid = Grid::of(tile);
    let runs = RowRuns { grid, rows, line, reach };
    match &form.kind {
        Kind::Flat if level => lower(simd, tile, runs, &put, &Level { way, section: FlatSection(r2), z }),
        Kind::Flat => lower(simd, tile, runs, &put, &Ramp { run, z, r2, slope: rise / run }),
        Kind::Ball => {
            let length = run.hypot(rise);
            let (slope, sin, cos) = if run > 0.0 { (rise / run, rise / length, run / length) } else { (0.0, 0.0, 1.0) };
            let ball = Ball { run, centre: z + r, r2, slope, sin, cos, inv_cos: 1.0 / cos };
            lower(simd, tile, runs, &put, &ball);
        }
        Kind::Convex(parts) if level => {
            lower(simd, tile, runs, &put, &Level { way, section: Bulging { parts, r2 }, z });
        }
        Kind::Convex(parts) => {
            lower(simd, tile, runs, &put, &BulgingRamp::new([run, z, rise], Bulging { parts, r2 }));
        }
        Kind::Other => lower_each(tile, runs, &put, |at, stands| swept_height(form, &line, at, stands)),
    }
}

/// A level arc.
struct Arc {
    centre: [f64; 2],
    z: f64,
    radius: f64,
    round: Round,
}

#[inline(always)]
fn sweep_arc<S: Simd>(
    simd: S,
    tile: &mut Tile,
    [columns, rows]: [Range<usize>; 2],
    arc: Arc,
    form: &Form,
    reach: f64,
    id: u32,
) {
    let (z, r) = (arc.z as f32, form.radius as f32);
    let put = Put { step: [tile.cell[0], 0.0], id };
    let grid = Grid::of(tile);
    let (centre, radius) = (arc.centre, arc.radius);
    let runs = rows.flat_map(|j| ring_runs(&grid, j, &columns, centre, [radius, reach])).flatten();
    let way = arc.round;
    match &form.kind {
        Kind::Flat => lower(simd, tile, runs, &put, &Level { way, section: FlatSection(r * r), z }),
        Kind::Ball => lower(simd, tile, runs, &put, &Level { way, section: BallSection(r), z }),
        Kind::Convex(parts) => {
            lower(simd, tile, runs, &put, &Level { way, section: Bulging { parts, r2: r * r }, z });
        }
        Kind::Other => lower_each(tile, runs, &put, |at, _| {
            let [x, y] = at.map(|x| Lanes::new(pulp::Scalar::new(), x as f32));
            let distance = f64::from(way.square(x, y).value.sqrt());
            form.profile.height_at(distance).map_or(f32::INFINITY, |h| z + h as f32)
        }),
    }
}

/// Least height of an outline along an inclined line at (u, v). Not searched for where the cell cannot be lowered: where it stands no higher
/// than the outline at the nearest place with the tip at its lowest.
fn swept_height(form: &Form, line: &Line, [u, v]: [f64; 2], stands: f32) -> f32 {
    let (profile, r) = (&form.profile, form.radius);
    if v.abs() > r {
        return f32::INFINITY;
    }
    let s = (r * r - v * v).sqrt();
    let (a, b) = ((u - s).max(0.0), (u + s).min(line.run));
    if a > b {
        return f32::INFINITY;
    }
    let slope = if line.run > 0.0 { line.rise / line.run } else { 0.0 };
    let outline = |t: f64| {
        let off = u - t;
        profile.height_at((off * off + v * v).sqrt().min(r)).unwrap_or(f64::INFINITY)
    };
    let height = |t: f64| line.z + slope * t + outline(t);
    let nearest = u.clamp(a, b);
    if line.rise == 0.0 {
        return height(nearest) as f32;
    }
    let lowest = line.z + (slope * a).min(slope * b) + outline(nearest);
    if lowest > f64::from(stands) {
        return f32::INFINITY;
    }
    golden_section(height, a, b, 1e-9 * (b - a) + 1e-12).1 as f32
}

/// How (u, v) change from cell to cell, and what lowers them.
struct Put {
    step: [f64; 2],
    id: u32,
}

/// Lowers the cells of runs to the heights of an outline.
#[inline(always)]
fn lower<S: Simd>(simd: S, tile: &mut Tile, runs: impl Iterator<Item = Run>, put: &Put, heights: &impl Heights) {
    let step = put.step.map(|step| step as f32);
    for Run { cells: run, at } in runs {
        let mut group =
            Group { first: run.start, k: 0.0, at: at.map(|x| x as f32), step, floor: tile.floor, id: put.id };
        let (cells, last) = S::as_mut_simd_f32s(&mut tile.heights[run.clone()]);
        let (ids, last_ids) = S::as_mut_simd_u32s(&mut tile.ids[run]);
        for (cells, ids) in cells.iter_mut().zip(ids) {
            group.lower(simd, heights, cells, ids, &mut tile.past, S::F32_LANES);
            group.k += S::F32_LANES as f32;
            group.first += S::F32_LANES;
        }
        if !last.is_empty() {
            let (mut cells, mut ids) = (simd.partial_load_f32s(last), simd.partial_load_u32s(last_ids));
            group.lower(simd, heights, &mut cells, &mut ids, &mut tile.past, last.len());
            simd.partial_store_f32s(last, cells);
            simd.partial_store_u32s(last_ids, ids);
        }
    }
}

/// Cells worked together: from the `k`-th of a run on, which begins at (u, v) and goes on in steps; `first` in the tile.
struct Group {
    first: usize,
    k: f32,
    at: [f32; 2],
    step: [f32; 2],
    floor: f32,
    id: u32,
}

impl Group {
    /// Lowers a group of which the first `count` are cells.
    #[inline(always)]
    fn lower<S: Simd>(
        &self,
        simd: S,
        heights: &impl Heights,
        cells: &mut S::f32s,
        ids: &mut S::u32s,
        past: &mut Past,
        count: usize,
    ) {
        let k = Lanes::counting(simd) + self.k;
        let (u, v, cell) = (k * self.step[0] + self.at[0], k * self.step[1] + self.at[1], Lanes::new(simd, *cells));
        if !heights.may(u, v, cell).any() {
            return;
        }
        let new = heights.height(u, v).max(cell.of(self.floor));
        let lower = new.below(cell);
        if past.on && lower.any() {
            let (mut old, mut of) = ([0.0; MOST_LANES], [0; MOST_LANES]);
            simd.partial_store_f32s(&mut old[..S::F32_LANES], *cells);
            simd.partial_store_u32s(&mut of[..S::F32_LANES], *ids);
            past.keep(self.first, count, old, of);
        }
        *cells = lower.pick(new, cell).value;
        lower.put(self.id, ids);
    }
}

/// As [`lower`] for an outline without a closed form, cell by cell; `height` is told how high the cell stands.
fn lower_each(tile: &mut Tile, runs: impl Iterator<Item = Run>, put: &Put, height: impl Fn([f64; 2], f32) -> f32) {
    for Run { cells, at } in runs {
        for (k, cell) in cells.enumerate() {
            let place = [0, 1].map(|axis| at[axis] + k as f64 * put.step[axis]);
            let new = height(place, tile.heights[cell]).max(tile.floor);
            if new < tile.heights[cell] {
                if tile.past.on {
                    let (mut heights, mut ids) = ([0.0; MOST_LANES], [0; MOST_LANES]);
                    (heights[0], ids[0]) = (tile.heights[cell], tile.ids[cell]);
                    tile.past.keep(cell, 1, heights, ids);
                }
                (tile.heights[cell], tile.ids[cell]) = (new, put.id);
            }
        }
    }
}

/// Height that rounding does not exceed, mm.
const SLACK_MM: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Box3, Profile, Segment};
    use crate::stock::Field;
    use pulp::Scalar;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn the_wide_and_the_portable_sweep_agree_bit_for_bit() {
        let extent = Box3 { min: Vec3::zeros(), max: Vec3::new(15.0, 15.0, 5.0) };
        let field = Field::new(extent, 0.1, |_, _| 5.0);
        let (mut wide, mut portable) = (field.tiles[0].clone(), field.tiles[0].clone());
        for (index, profile) in [
            Profile::flat(3.0, 9.0),
            Profile::ball(4.0, 9.0),
            Profile::bull(5.0, 1.0, 9.0),
            Profile::cone(6.0, 0.5, 1.2, 9.0),
        ]
        .iter()
        .enumerate()
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
                    sweep(&mut wide, (&track, false), &form, id);
                    sweep_body(Scalar::new(), &mut portable, (&track, false), &form, id);
                }
            }
        }
        assert!(wide.heights.iter().any(|h| *h < 4.0));
        assert!(wide.heights.iter().zip(&portable.heights).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert_eq!(wide.ids, portable.ids);
    }

    /// Every bulging outline on slopes from gentle to nearly upright, rising and falling, short and long, against the least height
    /// of its outline along the line: corners small and large, cones blunt and pointed, a face mill with its corner between flat
    /// and cone, a taper with its corner below the cone, a corner between two cones.
    #[test]
    fn a_bulging_outline_on_a_slope_leaves_the_least_height_along_the_line() {
        let extent = Box3 { min: Vec3::zeros(), max: Vec3::new(20.0, 20.0, 30.0) };
        let field = Field::new(extent, 0.1, |_, _| 30.0);
        let bulls =
            [(12.0, 2.0), (12.0, 0.1), (10.0, 4.95)].map(|(diameter, corner)| Profile::bull(diameter, corner, 40.0));
        let cones = [(12.0, 0.0, 2.06), (10.0, 0.4, 1.57), (11.0, 6.0, 1.57), (9.0, 1.0, 0.3)]
            .map(|(diameter, tip, point)| Profile::cone(diameter, tip, point, 40.0));
        let cornered = [(3.0, 0.8, 0.78, 5.5), (0.0, 1.5, 0.1, 4.0), (0.0, 2.0, 1.2, 6.0)].map(cornered);
        for (shape, profile) in bulls.iter().chain(&cones).chain(&cornered).enumerate() {
            let form = Form::new(profile);
            assert!(matches!(form.kind, Kind::Convex(_)));
            for (k, slope) in [1e-4, -0.003, 0.03, -0.2, 1.0, -5.0].into_iter().enumerate() {
                for run in [0.05, 1.3, 6.0] {
                    let (sin, cos) = (0.7 * k as f64).sin_cos();
                    let from = Vec3::new(10.0 - 0.5 * run * cos, 10.0 - 0.5 * run * sin, 10.0);
                    let to = from + Vec3::new(run * cos, run * sin, run * slope);
                    let mut tile = field.tiles[0].clone();
                    sweep(&mut tile, (&Track::Line { from, to }, false), &form, 1);
                    let line =
                        Line { from: [from.x, from.y], dir: [cos, sin], run, z: 10.0, rise: run * slope, behind: 0.0 };
                    let grid = Grid::of(&tile);
                    let mut lowered = 0;
                    for cell in 0..tile.heights.len() {
                        let [x, y] = [0, 1].map(|axis| grid.place(cell)[axis] - line.from[axis]);
                        let at = [x * cos + y * sin, y * cos - x * sin];
                        let height = swept_height(&form, &line, at, f32::INFINITY).min(30.0).max(tile.floor);
                        // Places are rounded to 1e-6 mm or so, which the outline takes up to 12 times as high 0.02 mm from
                        // its edge; nearer to that it stands upright.
                        let edge = at[1].hypot(at[0] - at[0].clamp(0.0, run)) > form.radius - 0.02;
                        let off = (height - tile.heights[cell]).abs();
                        assert!(edge || off < 5e-5 * (1.0 + slope.abs() as f32), "{shape} {slope} {run} {at:?}: {off}");
                        lowered += usize::from(height < 30.0);
                    }
                    // The disc of the cutter at least, but for cells below the floor or above the stock.
                    let disc_cells = PI * form.radius * form.radius / (0.1 * 0.1);
                    assert!(lowered as f64 > 0.4 * disc_cells, "{shape} {slope} {run}: {lowered}");
                }
            }
        }
    }

    /// A flat, a corner, a cone at an angle to the axis, up to a radius; 40 mm high.
    fn cornered((flat, corner, side_rad, radius): (f64, f64, f64, f64)) -> Profile {
        let arc = Segment::Arc { centre: [flat, corner], radius: corner, from_rad: -FRAC_PI_2, to_rad: -side_rad };
        let [from, to] = [arc.at(1.0).0, [radius, arc.at(1.0).0[1] + (radius - arc.at(1.0).0[0]) / side_rad.tan()]];
        let bottom = Segment::Line { from: [0.0; 2], to: [flat, 0.0] };
        let side = Segment::Line { from: to, to: [radius, 40.0] };
        Profile { segments: vec![bottom, arc, Segment::Line { from, to }, side] }
    }

    #[test]
    fn what_is_passed_over_behind_a_joint_was_swept_before_it() {
        let extent = Box3 { min: Vec3::zeros(), max: Vec3::new(15.0, 15.0, 6.0) };
        let profiles = [Profile::flat(3.0, 9.0), Profile::ball(4.0, 9.0), Profile::bull(5.0, 1.0, 9.0)];
        for profile in profiles.iter().chain([&Profile::cone(6.0, 0.5, 1.2, 9.0)]) {
            let form = Form::new(profile);
            // Rising, falling steeply, level, turning; long and short.
            let at = |k: u32| {
                let a = 0.4 * f64::from(k / 2);
                let z = if k % 8 < 3 { 2.0 } else { 2.5 + 1.8 * (3.3 * f64::from(k)).sin() };
                Vec3::new(7.5 + (4.0 + (5.0 * a).sin()) * a.cos(), 7.5 + 4.0 * (1.3 * a).sin(), z)
            };
            let mut tiles = [(); 2].map(|()| Field::new(extent, 0.1, |_, _| 5.0).tiles.swap_remove(0));
            for k in 0..60 {
                let track = Track::Line { from: at(k), to: at(k + 1) };
                for (tile, joined) in tiles.iter_mut().zip([false, k > 0]) {
                    sweep(tile, (&track, joined), &form, k);
                }
            }
            // Along a steep ramp the rounding of places counts more than once.
            let [all, ahead] = tiles;
            let off = all.heights.iter().zip(&ahead.heights).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(off < 1e-5 && all.heights.iter().any(|h| *h < 1.0), "{profile:?}: {off} mm");
        }
    }
}
