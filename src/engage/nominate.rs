//! Nomination: what the grid says around one cutter position. In: a tile as it is before the move, a sample. Out: per band
//! the directions in which material may be met, the elements that lowered the cells there and beside them, and whether
//! nothing stands within the clearance asked for.
//!
//! A cell at distance d from the axis matters to a band when |d − r| is within a cell and a half and the cell stands higher
//! than the band's lowest point. Directions are kept as 64 bins of the diamond angle from the feed direction.

use super::cutter::{Cutter, Near, NearBand};
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
    /// Per row of the window a bit per column, from its first: was the cell a hit?
    hits: Vec<u64>,
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
    let around = [sample.tip.x, sample.tip.y];
    let window = |reach: f64| {
        let [columns, rows] = tile.window(around.map(|x| x - reach), around.map(|x| x + reach));
        [clip(columns, tile.core[0]), clip(rows, tile.core[1])]
    };
    // Bands that pass above all that stands there see nothing.
    let mut outer = near.outer_below(f32::INFINITY);
    for _ in 0..2 {
        outer = outer.min(near.outer_below(tile.top_in(&window(outer)) - base));
    }
    let inner = near.inner();
    let behind = if vertical < 0.0 { f64::NEG_INFINITY } else { -cutter.margin };
    let [columns, rows] = window(outer);
    if rows.is_empty() || columns.is_empty() {
        return false;
    }
    let words = columns.len().div_ceil(64);
    work.hits.clear();
    work.hits.resize(words * rows.len(), 0);
    let dir = sample.dir.map(|d| d as f32);
    let mut look = Look { tile, near, base, dir, work, first: columns.start, found: false };
    let ahead = Ahead::new(outer, sample.dir, behind);
    let per_mm = 1.0 / tile.cell[0];
    let offset = (sample.tip.x - tile.first[0]) * per_mm;
    for j in rows.clone() {
        let y = tile.first[1] + j as f64 * tile.cell[1] - sample.tip.y;
        let Some((from, to)) = ahead.row(y) else { continue };
        let mut look_at = |from: f64, to: f64| {
            let begin = ((from * per_mm + offset).max(0.0) as usize).max(columns.start);
            let end = ((to * per_mm + offset).max(0.0) as usize + 1).min(columns.end);
            if from <= to && begin < end {
                let x = tile.first[0] + begin as f64 * tile.cell[0] - sample.tip.x;
                look.row(j, begin..end, [x as f32, y as f32], (j - rows.start) * words);
            }
        };
        // Within the innermost band there is nothing to see.
        if inner > y.abs() {
            let hole = (inner * inner - y * y).sqrt();
            look_at(from, to.min(-hole));
            look_at(from.max(hole), to);
        } else {
            look_at(from, to);
        }
    }
    let found = look.found;
    if found {
        work.gather(tile, rows, columns.start, words);
    }
    found
}

/// What lies within `outer` of the axis and no further than `behind` behind it.
struct Ahead {
    square: f64,
    behind: f64,
    across: f64,
    /// One over the component of the feed along the rows; 0 where there is none.
    per_x: f64,
}

impl Ahead {
    fn new(outer: f64, dir: [f64; 2], behind: f64) -> Self {
        let per_x = if dir[0].abs() > 1e-9 { 1.0 / dir[0] } else { 0.0 };
        Self { square: outer * outer, behind, across: dir[1], per_x }
    }
    /// Range of x in the row at `y`.
    fn row(&self, y: f64) -> Option<(f64, f64)> {
        let left = self.square - y * y;
        if left < 0.0 {
            return None;
        }
        let half = left.sqrt();
        let (mut from, mut to) = (-half, half);
        let rest = self.behind - y * self.across;
        if self.per_x > 0.0 {
            from = from.max(rest * self.per_x);
        } else if self.per_x < 0.0 {
            to = to.min(rest * self.per_x);
        } else if rest > 0.0 {
            return None;
        }
        (from <= to).then_some((from, to))
    }
}

/// Cells looked at together.
const LANES: usize = 8;

/// A look at the cells of a tile from one position.
struct Look<'a> {
    tile: &'a Tile,
    near: &'a Near,
    /// Height of the tip less the slack.
    base: f32,
    dir: [f32; 2],
    work: &'a mut Scratch,
    /// First column of the window.
    first: usize,
    found: bool,
}

impl Look<'_> {
    /// Looks at a run of cells of row `j`, the first at (x, y) from the axis: eight at a time against a lower bound of the
    /// bands' heights, those that exceed it closely. `word` is the first of the row's words of hits.
    fn row(&mut self, j: usize, run: std::ops::Range<usize>, [x, y]: [f32; 2], word: usize) {
        let heights = &self.tile.heights[j * self.tile.size[0]..][run.clone()];
        let (dx, square) = (self.tile.cell[0] as f32, y * y);
        let [[a0, b0], [a1, b1], [a2, b2], [a3, b3]] = self.near.bounds;
        let higher = |p: f32, q: f32| if p > q { p } else { q };
        for (chunk, cells) in heights.chunks(LANES).enumerate() {
            let x = x + (chunk * LANES) as i32 as f32 * dx;
            let mut above = [f32::NEG_INFINITY; LANES];
            for (k, cell) in cells.iter().enumerate() {
                let x = x + k as i32 as f32 * dx;
                let d2 = x * x + square;
                let low = higher(higher(a0 + b0 * d2, a1 + b1 * d2), higher(a2 + b2 * d2, a3 + b3 * d2));
                above[k] = *cell - (self.base + low);
            }
            if above.iter().filter(|above| **above > 0.0).count() == 0 {
                continue;
            }
            self.chunk(cells, above, [x, y], word, run.start + chunk * LANES - self.first);
        }
    }
    /// Looks closely at the cells of a chunk that stand `above` the bound; `column` is its first, within the window.
    fn chunk(&mut self, cells: &[f32], above: [f32; LANES], [x, y]: [f32; 2], word: usize, column: usize) {
        let (mut distances, mut turns) = ([0.0f32; LANES], [0.0f32; LANES]);
        let dx = self.tile.cell[0] as f32;
        for k in 0..LANES {
            let x = x + k as i32 as f32 * dx;
            distances[k] = (x * x + y * y).sqrt();
            turns[k] = diamond([x * self.dir[0] + y * self.dir[1], y * self.dir[0] - x * self.dir[1]]);
        }
        for (k, height) in cells.iter().enumerate().filter(|(k, _)| above[*k] > 0.0) {
            let bin = self.near.bin(distances[k]);
            if *height > self.base + self.near.lowest[bin] {
                let turn = (turns[k] * 16.0) as u32 & 63;
                self.work.mark(self.near.bands(bin), *height, self.base, turn);
                let column = column + k;
                self.work.hits[word + column / 64] |= 1 << (column % 64);
                self.found = true;
            }
        }
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
    /// Marks the bands that a cell of this height matters to; `turn` is its bin of the diamond angle.
    fn mark(&mut self, bands: &[NearBand], height: f32, base: f32, turn: u32) {
        for band in bands {
            if height > base + band.low {
                self.bins[band.index as usize] |= band.spread.rotate_left(turn);
                let top = &mut self.tops[band.index as usize];
                *top = if height > *top { height } else { *top };
            }
        }
    }
    /// Collects the provenance of the 3 × 3 cells about every hit, each cell once.
    fn gather(&mut self, tile: &Tile, rows: std::ops::Range<usize>, first: usize, words: usize) {
        let hits = std::mem::take(&mut self.hits);
        let word = |row: isize, k: isize| -> u64 {
            let inside = row >= 0 && row < rows.len() as isize && k >= 0 && k < words as isize;
            if inside { hits[row as usize * words + k as usize] } else { 0 }
        };
        for row in rows.start.saturating_sub(1)..(rows.end + 1).min(tile.size[1]) {
            let at = row as isize - rows.start as isize;
            let of = |k: isize| word(at - 1, k) | word(at, k) | word(at + 1, k);
            let ids = &tile.ids[row * tile.size[0]..][..tile.size[0]];
            // Bit k of the widened words is column `first + k − 1`.
            let mut last = UNTOUCHED;
            for k in 0..=words as isize {
                let (here, before) = (of(k), of(k - 1));
                let wide = here | (here << 1 | before >> 63) | (here << 2 | before >> 62);
                self.runs(wide, ids, (first + 64 * k as usize).wrapping_sub(1), &mut last);
            }
        }
        self.hits = hits;
    }
    /// Collects the ids of the columns whose bits are set; bit 0 is column `first`, which may lie one before the row.
    fn runs(&mut self, mut bits: u64, ids: &[u32], first: usize, last: &mut u32) {
        let mut at = first;
        while bits != 0 {
            let skip = bits.trailing_zeros();
            bits >>= skip;
            let run = bits.trailing_ones();
            at = at.wrapping_add(skip as usize);
            let (begin, end) = (if at == usize::MAX { 0 } else { at }, at.wrapping_add(run as usize).min(ids.len()));
            for id in &ids[begin.min(end)..end] {
                if id != last {
                    *last = *id;
                    self.collect(*id);
                }
            }
            at = end;
            bits = if run == 64 { 0 } else { bits >> run };
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
#[inline]
pub fn diamond([x, y]: [f32; 2]) -> f32 {
    let share = y.abs() / (x.abs() + y.abs()).max(f32::MIN_POSITIVE);
    let half = if x >= 0.0 { share } else { 2.0 - share };
    if y >= 0.0 { half } else { 4.0 - half }
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
        let window = tile.window(around.map(|x| x - reach), around.map(|x| x + reach));
        if tile.top_in(&window) <= low {
            continue;
        }
        let [columns, rows] = window;
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
    let around = [sample.tip.x, sample.tip.y];
    let window = tile.window(around.map(|x| x - reach), around.map(|x| x + reach));
    if f64::from(tile.top_in(&window)) <= base {
        return true;
    }
    let [columns, rows] = window;
    let (rows, columns) = (clip(rows, tile.core[1]), clip(columns, tile.core[0]));
    rows.into_iter().all(|j| {
        let y = tile.first[1] + j as f64 * tile.cell[1] - sample.tip.y;
        let row = &tile.heights[j * tile.size[0]..][columns.start..columns.end.max(columns.start)];
        // Counted, not sought: without a way out the loop runs eight cells at a time.
        if row.iter().filter(|height| f64::from(**height) > base).count() == 0 {
            return true;
        }
        row.iter().enumerate().all(|(k, height)| {
            let x = tile.first[0] + (columns.start + k) as f64 * tile.cell[0] - sample.tip.x;
            let square = x * x + y * y;
            if f64::from(*height) <= base || square > reach * reach {
                return true;
            }
            let inside = (square.sqrt() - grow).max(0.0);
            cutter.form.height_at(inside).is_none_or(|h| f64::from(*height) <= base + h)
        })
    })
}
