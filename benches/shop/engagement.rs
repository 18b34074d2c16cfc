//! The stock as a height grid of pixels, and what the rim of a flat end mill meets in it.
//!
//! In: a box of stock, then the tool's centre step by step. Out: for each direction on the rim the height of material that
//! stands there above the tool's tip, before the step is cut away.
//!
//! The grid is turned against the axes of the machine by an odd angle: a wall along x then crosses pixels everywhere, and
//! their rounding averages out along a pass. On a grid along the axes it would be the same all along the wall: an error
//! of the width of up to half a pixel.

/// Directions on the rim.
pub const RIM: usize = 480;

/// Angle between the grid and the x axis, rad; no simple fraction of a turn.
const TURN: f64 = 0.381_966;

/// Heights of the stock, mm, over square cells.
pub struct Grid {
    cell_mm: f64,
    /// Place of cell (0, 0) in the turned frame, mm.
    origin: [f64; 2],
    columns: usize,
    rows: usize,
    heights: Vec<f32>,
}

/// Height where there is nothing.
const EMPTY: f32 = -1e6;

/// A place in the frame of the grid.
fn turned(at: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = TURN.sin_cos();
    [cos * at[0] + sin * at[1], cos * at[1] - sin * at[0]]
}

impl Grid {
    /// Stock with this height at each place, mm, inside a rectangle that holds all of it.
    pub fn new(low: [f64; 2], high: [f64; 2], cell_mm: f64, height: impl Fn([f64; 2]) -> Option<f64>) -> Self {
        let corners = [[low[0], low[1]], [low[0], high[1]], [high[0], low[1]], [high[0], high[1]]].map(turned);
        let least = |k: usize| corners.iter().map(|c| c[k]).fold(f64::INFINITY, f64::min) - cell_mm;
        let most = |k: usize| corners.iter().map(|c| c[k]).fold(f64::NEG_INFINITY, f64::max) + cell_mm;
        let origin = [least(0), least(1)];
        let columns = ((most(0) - origin[0]) / cell_mm).ceil() as usize;
        let rows = ((most(1) - origin[1]) / cell_mm).ceil() as usize;
        let (sin, cos) = TURN.sin_cos();
        let mut heights = vec![EMPTY; columns * rows];
        for row in 0..rows {
            for column in 0..columns {
                let u = origin[0] + (column as f64 + 0.5) * cell_mm;
                let v = origin[1] + (row as f64 + 0.5) * cell_mm;
                if let Some(z) = height([cos * u - sin * v, sin * u + cos * v]) {
                    heights[row * columns + column] = z as f32;
                }
            }
        }
        Self { cell_mm, origin, columns, rows, heights }
    }

    /// Height at a place in the turned frame.
    fn height(&self, u: f64, v: f64) -> f32 {
        let (column, row) = ((u - self.origin[0]) / self.cell_mm, (v - self.origin[1]) / self.cell_mm);
        if column < 0.0 || row < 0.0 || column >= self.columns as f64 || row >= self.rows as f64 {
            return EMPTY;
        }
        self.heights[row as usize * self.columns + column as usize]
    }

    /// Material above the tip along the rim, mm, for a tool at `centre` that moves along the unit vector `along`. Entry i
    /// stands at φ = π (i + ½)/RIM: 0 left of the feed, π/2 ahead, π right of it, which is the way a tooth goes on a
    /// spindle that turns clockwise. Behind the tool nothing is cut.
    pub fn rim(&self, centre: [f64; 3], along: [f64; 2], radius_mm: f64, depth: &mut [f64; RIM]) {
        let c = turned([centre[0], centre[1]]);
        let ahead = turned(along);
        let right = turned([along[1], -along[0]]);
        for (i, depth) in depth.iter_mut().enumerate() {
            let (sin, cos) = rim_angle(i).sin_cos();
            let u = c[0] + radius_mm * (sin * ahead[0] - cos * right[0]);
            let v = c[1] + radius_mm * (sin * ahead[1] - cos * right[1]);
            *depth = (f64::from(self.height(u, v)) - centre[2]).max(0.0);
        }
    }

    /// Cells of each row that a disc covers: calls `each` with (row, first column, one past the last).
    fn rows_of_disc(&self, at: [f64; 2], radius_mm: f64, mut each: impl FnMut(usize, f64, f64)) {
        let (u, v) = ((at[0] - self.origin[0]) / self.cell_mm, (at[1] - self.origin[1]) / self.cell_mm);
        let radius = radius_mm / self.cell_mm;
        let first = (v - radius - 0.5).ceil().max(0.0) as usize;
        let last = ((v + radius - 0.5).floor().min(self.rows as f64 - 1.0)).max(-1.0);
        if last < 0.0 {
            return;
        }
        for row in first..=last as usize {
            let dv = row as f64 + 0.5 - v;
            let half = (radius * radius - dv * dv).max(0.0).sqrt();
            each(row, u - half, u + half);
        }
    }

    /// Area under the disc where material stands above `centre[2]`, mm².
    pub fn area_above(&self, centre: [f64; 3], radius_mm: f64) -> f64 {
        let mut cells = 0_usize;
        self.rows_of_disc(turned([centre[0], centre[1]]), radius_mm, |row, from, to| {
            let line = &self.heights[row * self.columns..(row + 1) * self.columns];
            let (a, b) = columns(from, to, self.columns);
            cells += line[a..b.max(a)].iter().filter(|h| f64::from(**h) > centre[2] + 1e-9).count();
        });
        cells as f64 * self.cell_mm * self.cell_mm
    }

    /// Cuts the disc at `to` away down to its height. Where the tool came from `from` at the same height, only the
    /// crescent between the two discs is touched.
    pub fn cut(&mut self, from: [f64; 3], to: [f64; 3], radius_mm: f64) {
        let (old, new) = (turned([from[0], from[1]]), turned([to[0], to[1]]));
        let level = from[2] == to[2];
        let (cell, width, z) = (self.cell_mm, self.columns, to[2] as f32);
        let mut spans = Vec::new();
        self.rows_of_disc(new, radius_mm, |row, a, b| spans.push((row, a, b)));
        for (row, a, b) in spans {
            let v = self.origin[1] + (row as f64 + 0.5) * cell - old[1];
            let half = (radius_mm * radius_mm - v * v).max(0.0).sqrt() / cell;
            let middle = (old[0] - self.origin[0]) / cell;
            let line = &mut self.heights[row * width..(row + 1) * width];
            let mut lower = |from: f64, to: f64| {
                let (a, b) = columns(from, to, width);
                line[a..b.max(a)].iter_mut().for_each(|h| *h = h.min(z));
            };
            if level && half > 0.0 {
                lower(a, b.min(middle - half + 1.0));
                lower(a.max(middle + half - 1.0), b);
            } else {
                lower(a, b);
            }
        }
    }
}

/// The last steps of a straight move, not yet cut away. On a straight move the rim ahead lies outside every disc behind
/// it, so leaving these is no error; cutting them would make the rim's ends beside the tool, which touch the newest disc
/// by much less than a pixel, seem free: an arc of contact too short by some degrees.
#[derive(Default)]
pub struct Trail(std::collections::VecDeque<([f64; 3], [f64; 3])>);

/// Steps that a trail holds: at 0.3 mm a step the ends that a pixel blurs are then below 1° on a tool of 10 mm.
const TRAIL: usize = 8;

impl Trail {
    /// Makes the stock ready for the step from `from` to `to`: what is left of another move is cut away.
    pub fn before(&mut self, stock: &mut Grid, from: [f64; 3], to: [f64; 3], radius_mm: f64) {
        let along = |a: [f64; 3], b: [f64; 3]| {
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            [0, 1].map(|k| (b[k] - a[k]) / length.max(1e-9))
        };
        let straight = self.0.back().is_none_or(|last| {
            let (old, new) = (along(last.0, last.1), along(from, to));
            old[0] * new[0] + old[1] * new[1] > 1.0 - 1e-9 && last.1 == from && from[2] == to[2]
        });
        if !straight {
            self.end(stock, radius_mm);
        }
    }

    /// Adds a step that was made.
    pub fn after(&mut self, stock: &mut Grid, from: [f64; 3], to: [f64; 3], radius_mm: f64) {
        self.0.push_back((from, to));
        if self.0.len() > TRAIL
            && let Some((from, to)) = self.0.pop_front()
        {
            stock.cut(from, to, radius_mm);
        }
    }

    /// Cuts all of it away.
    pub fn end(&mut self, stock: &mut Grid, radius_mm: f64) {
        while let Some((from, to)) = self.0.pop_front() {
            stock.cut(from, to, radius_mm);
        }
    }
}

/// Columns whose centres lie between two places, counted in cells.
fn columns(from: f64, to: f64, width: usize) -> (usize, usize) {
    let clamp = |place: f64| ((place - 0.5).ceil().max(0.0) as usize).min(width);
    (clamp(from), clamp(to))
}

/// Angle of a direction on the rim, rad.
pub fn rim_angle(i: usize) -> f64 {
    std::f64::consts::PI * (i as f64 + 0.5) / RIM as f64
}
