//! Nomination: what the grid says around one cutter position. In: a tile as it is before the move, a sample. Out: per band
//! the directions in which material may be met, the elements that lowered the cells there and beside them, and whether
//! nothing stands within the clearance asked for.
//!
//! A cell at distance d from the axis matters to a band when |d − r| is within a cell and a half and the cell stands higher
//! than the band's lowest point. Directions are kept as 64 bins of the diamond angle from the feed direction.

use super::cutter::{Cutter, Near};
use crate::path::Vec3;
use crate::stock::{Tile, UNTOUCHED};

/// A point of the path at which engagement is worked out.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Element it lies on.
    pub element: u32,
    /// Distance along the element, mm.
    pub along_mm: f64,
    /// Distance along the move, mm.
    pub s_mm: f64,
    /// Tip of the tool, mm.
    pub tip: Vec3,
    /// Unit horizontal direction of the feed (the last one under a vertical feed).
    pub dir: [f64; 2],
    /// Horizontal and vertical part of the unit tangent.
    pub tangent: [f64; 2],
    /// Index of its cutter.
    pub cutter: u16,
    /// Clearance within which nothing may stand for air feed, mm.
    pub clearance_mm: f64,
    /// Looked at closely only where engagement changes between its neighbours.
    pub optional: bool,
}

/// Directions in which a band may meet material.
#[derive(Debug, Clone, Copy)]
pub struct Mark {
    /// Band.
    pub band: u16,
    /// Highest cell that matters to it, mm.
    pub top: f32,
    /// Bins of the diamond angle.
    pub bins: u64,
}

/// What one tile says about one sample.
#[derive(Debug, Clone, Copy)]
pub struct Nomination {
    /// The sample, by its number in the batch.
    pub sample: u32,
    /// Number of its marks.
    pub marks: u32,
    /// Number of its candidates.
    pub candidates: u32,
    /// Nothing stands within the clearance.
    pub clear: bool,
    /// How far stock stands above the lower end of the shank and of the holder within their radius, mm.
    pub struck: [f32; 2],
}

/// What one tile says about the samples of a batch, in order.
#[derive(Debug, Clone, Default)]
pub struct Nominations {
    /// One entry a sample.
    pub entries: Vec<Nomination>,
    /// Marks, one entry's after the other's.
    pub marks: Vec<Mark>,
    /// Candidates likewise.
    pub candidates: Vec<u32>,
}

/// Working space of [`nominate`].
#[derive(Debug, Default)]
pub struct Scratch {
    bins: Vec<u64>,
    tops: Vec<f32>,
    seen: Vec<u32>,
    found: Vec<u32>,
}

/// Height by which a cell may miss the material beside it, as a part of the cell.
const SLACK: f64 = 0.1;

/// Appends what `tile` says about `sample`.
pub fn nominate(tile: &Tile, number: u32, sample: &Sample, cutter: &Cutter, work: &mut Scratch, out: &mut Nominations) {
    let found = mark_cells(tile, sample, cutter, work);
    let (first_mark, first_candidate) = (out.marks.len(), out.candidates.len());
    if found {
        for (band, bins) in work.bins.iter().enumerate() {
            if *bins != 0 {
                out.marks.push(Mark { band: band as u16, top: work.tops[band], bins: *bins });
            }
        }
        work.found.sort_unstable();
        out.candidates.extend_from_slice(&work.found);
    }
    out.entries.push(Nomination {
        sample: number,
        marks: (out.marks.len() - first_mark) as u32,
        candidates: (out.candidates.len() - first_candidate) as u32,
        clear: !found && is_clear(tile, sample, cutter),
        struck: struck(tile, sample, cutter),
    });
}

/// Marks the bands; true when there was anything to mark.
fn mark_cells(tile: &Tile, sample: &Sample, cutter: &Cutter, work: &mut Scratch) -> bool {
    let [horizontal, vertical] = sample.tangent;
    if horizontal < 1e-9 && vertical >= 0.0 {
        return false;
    }
    let near = cutter.near(vertical);
    let base = sample.tip.z as f32 - (SLACK * cutter.margin / 1.5) as f32;
    if tile.highest <= base + near.floor() {
        return false;
    }
    work.start(cutter.bands.len());
    let [inner, outer] = near.range_mm();
    let behind = if vertical < 0.0 { f64::NEG_INFINITY } else { -cutter.margin };
    let around = [sample.tip.x, sample.tip.y];
    let [columns, rows] = tile.window(around.map(|x| x - outer), around.map(|x| x + outer));
    let (rows, columns) = (clip(rows, tile.core[1]), clip(columns, tile.core[0]));
    let mut look = Look { tile, near, cutter, base, dir: sample.dir.map(|d| d as f32), work, found: false };
    for j in rows {
        let y = tile.first[1] + j as f64 * tile.cell[1] - sample.tip.y;
        let Some((from, to)) = row_ahead(outer, sample.dir, behind, y) else { continue };
        let column = |x: f64| ((x + sample.tip.x - tile.first[0]) / tile.cell[0]).clamp(0.0, tile.size[0] as f64);
        // Within the innermost band there is nothing to see.
        let hole = (inner * inner - y * y).max(0.0).sqrt();
        for (from, to) in
            if hole > 0.0 { [(from, to.min(-hole)), (from.max(hole), to)] } else { [(from, to), (1.0, 0.0)] }
        {
            let begin = (column(from) as usize).max(columns.start);
            let end = (column(to) as usize + 1).min(columns.end);
            if from <= to && begin < end {
                let x = tile.first[0] + begin as f64 * tile.cell[0] - sample.tip.x;
                look.row(j, begin..end, [x as f32, y as f32]);
            }
        }
    }
    look.found
}

/// Range of x in which the row at `y` lies within `outer` of the axis and no further than `behind` behind it.
fn row_ahead(outer: f64, dir: [f64; 2], behind: f64, y: f64) -> Option<(f64, f64)> {
    let left = outer * outer - y * y;
    if left < 0.0 {
        return None;
    }
    let (mut from, mut to) = (-left.sqrt(), left.sqrt());
    let rest = behind - y * dir[1];
    if dir[0] > 1e-9 {
        from = from.max(rest / dir[0]);
    } else if dir[0] < -1e-9 {
        to = to.min(rest / dir[0]);
    } else if rest > 0.0 {
        return None;
    }
    (from <= to).then_some((from, to))
}

/// Cells looked at together.
const LANES: usize = 8;

/// A look at the cells of a tile from one position.
struct Look<'a> {
    tile: &'a Tile,
    near: &'a Near,
    cutter: &'a Cutter,
    /// Height of the tip less the slack.
    base: f32,
    dir: [f32; 2],
    work: &'a mut Scratch,
    found: bool,
}

impl Look<'_> {
    /// Looks at a run of cells of row `j`, the first at (x, y) from the axis: eight at a time against a lower bound of the
    /// bands' heights, those that exceed it closely.
    fn row(&mut self, j: usize, run: std::ops::Range<usize>, [x, y]: [f32; 2]) {
        let first = j * self.tile.size[0];
        let heights = &self.tile.heights[first..][run.clone()];
        let (dx, square) = (self.tile.cell[0] as f32, y * y);
        let [[a0, b0], [a1, b1], [a2, b2], [a3, b3]] = self.near.bounds;
        let higher = |p: f32, q: f32| if p > q { p } else { q };
        let mut last = usize::MAX;
        for (chunk, cells) in heights.chunks(LANES).enumerate() {
            let x = x + (chunk * LANES) as i32 as f32 * dx;
            let mut hits = [false; LANES];
            for (k, cell) in cells.iter().enumerate() {
                let x = x + k as i32 as f32 * dx;
                let d2 = x * x + square;
                let low = higher(higher(a0 + b0 * d2, a1 + b1 * d2), higher(a2 + b2 * d2, a3 + b3 * d2));
                hits[k] = *cell > self.base + low;
            }
            if hits == [false; LANES] {
                continue;
            }
            for k in 0..cells.len() {
                let i = run.start + chunk * LANES + k;
                let x = x + k as i32 as f32 * dx;
                if hits[k] && self.cell([i, j], cells[k], [x, y], last.checked_add(1) == Some(i)) {
                    last = i;
                }
            }
        }
    }
    /// True when some band may meet the cell.
    fn cell(&mut self, [i, j]: [usize; 2], height: f32, [x, y]: [f32; 2], neighbour_done: bool) -> bool {
        let bin = self.near.bin((x * x + y * y).sqrt());
        if height <= self.base + self.near.lowest[bin] {
            return false;
        }
        let at = [x * self.dir[0] + y * self.dir[1], y * self.dir[0] - x * self.dir[1]];
        self.work.mark(self.near.bands(bin), self.cutter, height, self.base, at);
        self.work.gather(self.tile, i, j, neighbour_done);
        self.found = true;
        true
    }
}

fn clip(range: std::ops::Range<usize>, core: [usize; 2]) -> std::ops::Range<usize> {
    range.start.max(core[0])..range.end.min(core[1])
}

impl Scratch {
    fn start(&mut self, bands: usize) {
        self.bins.clear();
        self.bins.resize(bands, 0);
        self.tops.clear();
        self.tops.resize(bands, f32::NEG_INFINITY);
        self.seen.clear();
        self.seen.resize(SEEN, UNTOUCHED);
        self.found.clear();
    }
    /// Marks the bands that a cell of this height matters to; `at` is (forward, left).
    fn mark(&mut self, bands: &[u16], cutter: &Cutter, height: f32, base: f32, at: [f32; 2]) {
        let bin = (diamond(at) * 16.0) as u32 & 63;
        for &index in bands {
            let band = &cutter.bands[index as usize];
            if height <= base + band.low as f32 {
                continue;
            }
            self.bins[index as usize] |= band.spread.rotate_left(bin);
            let top = &mut self.tops[index as usize];
            *top = top.max(height);
        }
    }
    /// Collects the provenance of the 3 × 3 cells about (i, j); only the new column when the cell before was done.
    fn gather(&mut self, tile: &Tile, i: usize, j: usize, neighbour_done: bool) {
        let columns = if neighbour_done { i + 1 } else { i.saturating_sub(1) }..(i + 2).min(tile.size[0]);
        for row in j.saturating_sub(1)..(j + 2).min(tile.size[1]) {
            for id in &tile.ids[row * tile.size[0]..][columns.start.min(columns.end)..columns.end] {
                self.collect(*id);
            }
        }
    }
    fn collect(&mut self, id: u32) {
        let slot = &mut self.seen[id.wrapping_mul(0x9E37_79B1) as usize >> (32 - SEEN_BITS)];
        if id == *slot || id == UNTOUCHED {
            return;
        }
        *slot = id;
        self.found.push(id);
    }
}

const SEEN_BITS: u32 = 7;
const SEEN: usize = 1 << SEEN_BITS;

/// Diamond angle of (forward, left): 0 ahead, 1 left, 2 behind, 3 right.
pub fn diamond([x, y]: [f32; 2]) -> f32 {
    let sum = x.abs() + y.abs();
    if sum == 0.0 {
        return 0.0;
    }
    match (x >= 0.0, y >= 0.0) {
        (true, true) => y / sum,
        (false, true) => 1.0 - x / sum,
        (false, false) => 2.0 - y / sum,
        (true, false) => 3.0 + x / sum,
    }
}

/// How far cells of the tile stand into the shank and into the holder. Under the cutter's own width only what lies ahead
/// counts: behind it this move has been.
fn struck(tile: &Tile, sample: &Sample, cutter: &Cutter) -> [f32; 2] {
    let mut worst = [0.0f32; 2];
    for body in &cutter.bodies {
        let low = (sample.tip.z + body.low) as f32;
        // A cell beside the circle may stand within it by half its width.
        let reach = body.radius - cutter.margin / 1.5;
        if tile.highest <= low || reach <= 0.0 {
            continue;
        }
        let around = [sample.tip.x, sample.tip.y];
        let [columns, rows] = tile.window(around.map(|x| x - reach), around.map(|x| x + reach));
        for j in clip(rows, tile.core[1]) {
            let y = tile.first[1] + j as f64 * tile.cell[1] - sample.tip.y;
            let columns = clip(columns.clone(), tile.core[0]);
            let row = &tile.heights[j * tile.size[0]..][columns.start..columns.end.max(columns.start)];
            let level = low + worst[usize::from(body.holder)];
            // Counted, not sought: without a way out the loop runs eight cells at a time.
            if row.iter().filter(|height| **height > level).count() == 0 {
                continue;
            }
            for i in columns {
                let above = tile.heights[j * tile.size[0] + i] - low;
                let x = tile.first[0] + i as f64 * tile.cell[0] - sample.tip.x;
                if above <= worst[usize::from(body.holder)] || x * x + y * y > reach * reach {
                    continue;
                }
                let forward = x * sample.dir[0] + y * sample.dir[1];
                let left = y * sample.dir[0] - x * sample.dir[1];
                if forward > 0.0 || left.abs() > cutter.form.radius + cutter.margin {
                    worst[usize::from(body.holder)] = above;
                }
            }
        }
    }
    worst
}

/// True when no cell of the tile stands within the clearance of the cutter.
fn is_clear(tile: &Tile, sample: &Sample, cutter: &Cutter) -> bool {
    let grow = sample.clearance_mm;
    let base = sample.tip.z - grow;
    if f64::from(tile.highest) <= base {
        return true;
    }
    let reach = cutter.form.radius + grow;
    let [columns, rows] =
        tile.window([sample.tip.x - reach, sample.tip.y - reach], [sample.tip.x + reach, sample.tip.y + reach]);
    let (rows, columns) = (clip(rows, tile.core[1]), clip(columns, tile.core[0]));
    for j in rows {
        let y = tile.first[1] + j as f64 * tile.cell[1] - sample.tip.y;
        for i in columns.clone() {
            let height = f64::from(tile.heights[j * tile.size[0] + i]);
            if height <= base {
                continue;
            }
            let x = tile.first[0] + i as f64 * tile.cell[0] - sample.tip.x;
            let inside = (x.hypot(y) - grow).max(0.0);
            if cutter.form.profile.height_at(inside).is_some_and(|h| height > base + h) {
                return false;
            }
        }
    }
    true
}
