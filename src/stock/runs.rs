//! The cells within reach of a track. In: a tile's grid, a track, distances. Out: runs of consecutive cells, row by row, each with the position
//! of its first cell along (u) and across (v) the track.

#![allow(clippy::inline_always)] // the sweep's lanes are registers only where all is inlined

use super::element::Track;
use super::field::Tile;
use std::ops::Range;

/// A straight track in the plane: start, unit direction, length, height at the start, rise, and the distance from its start (negative: behind)
/// before which cells are skipped.
#[derive(Clone, Copy)]
pub(super) struct Line {
    pub from: [f64; 2],
    pub dir: [f64; 2],
    pub run: f64,
    pub z: f64,
    pub rise: f64,
    pub behind: f64,
}

/// Where the cells of a tile lie.
pub(super) struct Grid {
    first: [f64; 2],
    cell: [f64; 2],
    columns: usize,
}

impl Grid {
    pub fn of(tile: &Tile) -> Self {
        Self { first: tile.first, cell: tile.cell, columns: tile.size[0] }
    }
    /// Middle of a cell in XY, mm.
    pub fn place(&self, cell: usize) -> [f64; 2] {
        let index = [cell % self.columns, cell / self.columns];
        [0, 1].map(|axis| self.first[axis] + index[axis] as f64 * self.cell[axis])
    }
}

/// A run of cells of one row: their indices in the tile, and the place (u, v) of the first.
pub(super) struct Run {
    pub cells: Range<usize>,
    pub at: [f64; 2],
}

/// The runs of cells within the first of two distances of a level track, each with its part that is certainly within the second. For a track
/// that continues the one before, only cells ahead of its start.
pub(super) fn level_runs(
    grid: &Grid,
    [columns, rows]: [Range<usize>; 2],
    track: &Track,
    joined: bool,
    [outer, inner]: [f64; 2],
) -> Vec<[Option<Run>; 2]> {
    match *track {
        Track::Line { from, to } => {
            let delta = to - from;
            let run = delta.x.hypot(delta.y);
            let dir = if run > 1e-9 { [delta.x / run, delta.y / run] } else { [1.0, 0.0] };
            let behind = if joined && run > 1e-9 { 0.0 } else { f64::NEG_INFINITY };
            let line = Line { from: [from.x, from.y], dir, run, z: from.z, rise: 0.0, behind };
            // Of short lines the runs are drawn too wide.
            let certain = inner > 0.0 && run >= 0.5 * outer;
            let within = |j: usize| certain.then(|| row_run(grid, j, &line, inner)).flatten();
            rows.map(|j| [row_run(grid, j, &line, outer), within(j)]).collect()
        }
        Track::Arc { centre, radius: [r0, r1], .. } => {
            let ring = [0.5 * (r0 + r1), outer];
            rows.flat_map(|j| ring_runs(grid, j, &columns, centre, ring)).map(|run| [run, None]).collect()
        }
    }
}

/// The runs of rows that lie within reach of a line.
pub(super) struct RowRuns {
    pub grid: Grid,
    pub rows: Range<usize>,
    pub line: Line,
    pub reach: f64,
}

impl Iterator for RowRuns {
    type Item = Run;
    #[inline(always)]
    fn next(&mut self) -> Option<Run> {
        loop {
            let run = row_run(&self.grid, self.rows.next()?, &self.line, self.reach);
            if run.is_some() {
                return run;
            }
        }
    }
}

/// The run of row `j` that lies within `radius` of a line.
#[inline(always)]
fn row_run(grid: &Grid, j: usize, line: &Line, radius: f64) -> Option<Run> {
    let y = grid.first[1] + j as f64 * grid.cell[1] - line.from[1];
    let (x0, x1) = row_span(line, radius, y)?;
    let (x0, x1) = ahead(line, y, (x0, x1));
    let (per_mm, off) = (1.0 / grid.cell[0], line.from[0] - grid.first[0]);
    let begin = ((x0 + off) * per_mm).max(0.0) as usize;
    let end = (((x1 + off) * per_mm + 1.0).max(0.0) as usize).min(grid.columns);
    let x = begin as f64 * grid.cell[0] - off;
    let at = [x * line.dir[0] + y * line.dir[1], y * line.dir[0] - x * line.dir[1]];
    let row = j * grid.columns;
    (begin < end).then_some(Run { cells: row + begin..row + end, at })
}

/// What of a row lies ahead of the place from which on a line is swept.
#[inline(always)]
fn ahead(line: &Line, y: f64, (x0, x1): (f64, f64)) -> (f64, f64) {
    let [dx, dy] = line.dir;
    let rest = line.behind - y * dy;
    match () {
        () if line.behind == f64::NEG_INFINITY => (x0, x1),
        () if dx > 1e-9 => (x0.max(rest / dx), x1),
        () if dx < -1e-9 => (x0, x1.min(rest / dx)),
        () if rest > 0.0 => (1.0, 0.0),
        () => (x0, x1),
    }
}

/// The runs of row `j`, within some columns, that lie in a ring: its middle radius, and how far it reaches from there.
#[inline(always)]
pub(super) fn ring_runs(
    grid: &Grid,
    j: usize,
    columns: &Range<usize>,
    centre: [f64; 2],
    [radius, reach]: [f64; 2],
) -> [Option<Run>; 2] {
    let y = grid.first[1] + j as f64 * grid.cell[1] - centre[1];
    let half = |r: f64| (r * r - y * y).max(0.0).sqrt();
    let (outer, inner) = (half(radius + reach), half((radius - reach).max(0.0)));
    [(-outer, -inner), (inner, outer)].map(|(low, high)| {
        let index = |x: f64| (x + centre[0] - grid.first[0]) / grid.cell[0];
        let begin = (index(low).ceil().max(0.0) as usize).max(columns.start);
        let end = ((index(high).floor() + 1.0).max(0.0) as usize).min(columns.end);
        let at = [grid.first[0] + begin as f64 * grid.cell[0] - centre[0], y];
        let row = j * grid.columns;
        (begin < end).then_some(Run { cells: row + begin..row + end, at })
    })
}

/// Range of x (relative to the start) in which the row at `y` lies within `radius` of the line.
#[inline(always)]
fn row_span(line: &Line, radius: f64, y: f64) -> Option<(f64, f64)> {
    let [dx, dy] = line.dir;
    if line.run < 0.5 * radius {
        // A short line: that of the disc where it is widest, drawn out along it. What is too much is not lowered.
        let [x, across] = [line.run * dx, y - (line.run * dy * y.signum()).max(0.0).min(y.abs()).copysign(y)];
        let left = radius * radius - across * across;
        let half = left.max(0.0).sqrt();
        return (left >= 0.0).then_some((x.min(0.0) - half, x.max(0.0) + half));
    }
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
