//! Nomination: what the grid tells about the surroundings of one cutter position. In: a tile before the move, a sample. Out: per band the
//! directions in which there may be material; the elements that last lowered the cells there and their neighbours (the candidates); and
//! whether no stock stands within the clearance.
//!
//! A cell at distance d from the axis matters to a band of radius r if |d − r| is at most a cell and a half and the cell stands higher than
//! the lowest point of the band. Directions are stored as 64 bins of the diamond angle from the feed direction.

#![allow(clippy::inline_always)] // lanes are registers only where all is inlined

use super::cutter::{Cutter, Near};
use crate::path::Vec3;
use crate::stock::wide::{Lanes, MOST_LANES, Task, widest};
use crate::stock::{Tile, UNTOUCHED};
use pulp::Simd;

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
    /// Whether its arcs are worked out.
    pub need: Need,
}

/// Whether the arcs at a sample are worked out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// Yes.
    Always,
    /// It is the end of a short block: only if the samples before and after it do not agree.
    Joint,
    /// It is an optional sample: only if the engagement changes around it, or other stock may stand there.
    Change,
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

/// What one tile tells about one sample.
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

/// What one tile tells about the samples of a batch, in order.
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
    marks: Vec<Mark>,
    met: Vec<CellsAtDistance>,
    /// Per row of the window a bit per column, from its first: was the cell a hit?
    hits: Vec<u64>,
    seen: Vec<u32>,
    found: Vec<u32>,
}

/// The cells at one distance from the axis: height of the highest, and the bins of the diamond angle in which they lie.
#[derive(Debug, Clone, Copy)]
struct CellsAtDistance {
    top: f32,
    turns: u64,
}

/// Material may stand higher than its cell by this, as a share of the width of the cell.
const SLACK: f64 = 0.1;

/// Appends what `tile` tells about `sample`.
pub fn nominate(tile: &Tile, number: u32, sample: &Sample, cutter: &Cutter, work: &mut Scratch, out: &mut Nominations) {
    let found = widest(MarkCells { tile, sample, cutter, work });
    let (first_mark, first_candidate) = (out.marks.len(), out.candidates.len());
    if found {
        out.marks.extend_from_slice(&work.marks);
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

/// A look around one sample, as a task over lanes; true when there was anything to mark.
struct MarkCells<'a> {
    tile: &'a Tile,
    sample: &'a Sample,
    cutter: &'a Cutter,
    work: &'a mut Scratch,
}

impl Task for MarkCells<'_> {
    type Out = bool;
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> bool {
        mark_cells(simd, self.tile, self.sample, self.cutter, self.work)
    }
}

/// Marks the bands; true when there was anything to mark.
#[inline(always)]
fn mark_cells<S: Simd>(simd: S, tile: &Tile, sample: &Sample, cutter: &Cutter, work: &mut Scratch) -> bool {
    let [horizontal, vertical] = sample.tangent;
    if horizontal < 1e-9 && vertical >= 0.0 {
        return false;
    }
    let near = cutter.near(vertical);
    let base = sample.tip.z as f32 - (SLACK * cutter.margin / 1.5) as f32;
    if tile.highest <= base + near.floor() {
        return false;
    }
    work.start(near.lowest.len());
    let around = [sample.tip.x, sample.tip.y];
    let window = |reach: f64| {
        let [columns, rows] = tile.window(around.map(|x| x - reach), around.map(|x| x + reach));
        [clip(columns, tile.core[0]), clip(rows, tile.core[1])]
    };
    // Bands above the highest cell of the tile touch nothing.
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
    let look = Look { simd, tile, near, base, dir: sample.dir.map(|d| d as f32), first: columns.start };
    let ahead = Ahead::new(outer, sample.dir, behind);
    let per_mm = 1.0 / tile.cell[0];
    let offset = (sample.tip.x - tile.first[0]) * per_mm;
    let mut found = false;
    for j in rows.clone() {
        let y = tile.first[1] + j as f64 * tile.cell[1] - sample.tip.y;
        let Some((from, to)) = ahead.row(y) else { continue };
        // Cells nearer to the axis than the innermost band do not matter.
        let hole = if inner > y.abs() { (inner * inner - y * y).sqrt() } else { 0.0 };
        let parts = if hole > 0.0 { [[from, to.min(-hole)], [from.max(hole), to]] } else { [[from, to], [1.0, 0.0]] };
        for [from, to] in parts {
            let begin = ((from * per_mm + offset).max(0.0) as usize).max(columns.start);
            let end = ((to * per_mm + offset).max(0.0) as usize + 1).min(columns.end);
            if from <= to && begin < end {
                let x = tile.first[0] + begin as f64 * tile.cell[0] - sample.tip.x;
                found |= look.row(work, j, begin..end, [x as f32, y as f32], (j - rows.start) * words);
            }
        }
    }
    if found {
        work.mark(near, base);
        work.gather(tile, rows, columns.start, words);
    }
    found
}

/// The places within `outer` of the axis and at most `behind` behind it.
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
    #[inline(always)]
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

/// The search of the cells of a tile around one position.
struct Look<'a, S: Simd> {
    simd: S,
    tile: &'a Tile,
    near: &'a Near,
    /// Height of the tip less the slack.
    base: f32,
    dir: [f32; 2],
    /// First column of the window.
    first: usize,
}

impl<S: Simd> Look<'_, S> {
    /// Tests a run of cells of row `j`, the first at (x, y) from the axis; `word` is the index of the first word of hits of the row.
    #[inline(always)]
    fn row(&self, work: &mut Scratch, j: usize, run: std::ops::Range<usize>, at: [f32; 2], word: usize) -> bool {
        let row = &self.tile.heights[j * self.tile.size[0]..][run.clone()];
        let (groups, rest) = S::as_simd_f32s(row);
        let (mut k, mut found) = (0, false);
        for cells in groups {
            found |=
                self.group(work, Lanes::new(self.simd, *cells), S::F32_LANES, at, [word, run.start - self.first, k]);
            k += S::F32_LANES;
        }
        if !rest.is_empty() {
            let cells = Lanes::new(self.simd, self.simd.partial_load_f32s(rest));
            found |= self.group(work, cells, rest.len(), at, [word, run.start - self.first, k]);
        }
        found
    }
    /// Tests the first `count` cells of a group: all against a lower bound of the bands' heights, and those above it exactly. The run that
    /// they belong to begins at (x, y) and in a column of the window; the group is `from` cells further.
    #[inline(always)]
    fn group(
        &self,
        work: &mut Scratch,
        cells: Lanes<S>,
        count: usize,
        [x, y]: [f32; 2],
        [word, column, from]: [usize; 3],
    ) -> bool {
        let dx = self.tile.cell[0] as f32;
        let x = (Lanes::counting(self.simd) + from as i32 as f32) * dx + x;
        let y = x.of(y);
        let square = x * x + y * y;
        let [[a0, b0], [a1, b1], [a2, b2], [a3, b3]] = self.near.bounds;
        let low = (square * b0 + a0).max(square * b1 + a1).max((square * b2 + a2).max(square * b3 + a3));
        let above = (low + self.base).below(cells);
        if !above.any() {
            return false;
        }
        let (mut heights, mut places, mut turns) = ([0.0; MOST_LANES], [0.0; MOST_LANES], [0.0; MOST_LANES]);
        above.pick(cells, x.of(f32::NEG_INFINITY)).store(&mut heights);
        (square.sqrt() * self.near.per_mm()).store(&mut places);
        (diamonds(x * self.dir[0] + y * self.dir[1], y * self.dir[0] - x * self.dir[1]) * 16.0).store(&mut turns);
        let mut hits = 0u64;
        for k in 0..count {
            let bin = self.near.bin(places[k]);
            if heights[k] > self.base + self.near.lowest[bin] {
                work.met[bin].take(heights[k], turns[k] as u32 & 63);
                hits |= 1 << k;
            }
        }
        let (word, bit) = (word + (column + from) / 64, (column + from) % 64);
        work.hits[word] |= hits << bit;
        if bit > 64 - S::F32_LANES && hits >> (64 - bit) != 0 {
            work.hits[word + 1] |= hits >> (64 - bit);
        }
        hits != 0
    }
}

/// Diamond angles of (forward, left): 0 ahead, 1 left, 2 behind, 3 right.
#[inline(always)]
fn diamonds<S: Simd>(x: Lanes<S>, y: Lanes<S>) -> Lanes<S> {
    let share = y.abs() / (x.abs() + y.abs()).max(x.of(f32::MIN_POSITIVE));
    let half = x.of(0.0).at_most(x).pick(share, x.of(2.0) - share);
    x.of(0.0).at_most(y).pick(half, x.of(4.0) - half)
}

fn clip(range: std::ops::Range<usize>, core: [usize; 2]) -> std::ops::Range<usize> {
    range.start.max(core[0])..range.end.min(core[1])
}

impl Scratch {
    fn start(&mut self, bins: usize) {
        self.marks.clear();
        self.met.clear();
        self.met.resize(bins, CellsAtDistance { top: f32::NEG_INFINITY, turns: 0 });
        self.seen.clear();
        self.seen.resize(SEEN, UNTOUCHED);
        self.found.clear();
    }
    /// Marks the bands that are lower than a cell at their distance.
    fn mark(&mut self, near: &Near, base: f32) {
        for band in &near.bands {
            let mut mark = Mark { band: band.index, top: f32::NEG_INFINITY, bins: 0 };
            for met in &self.met[band.bins[0]..band.bins[1]] {
                if met.top > base + band.low {
                    mark.bins |= met.turns;
                    mark.top = mark.top.max(met.top);
                }
            }
            if mark.bins != 0 {
                self.marks.push(Mark { bins: widened(mark.bins, band.spread), ..mark });
            }
        }
    }
    /// Collects the provenance of the 3 × 3 cells about every hit, each cell once.
    #[inline(always)]
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
    #[inline(always)]
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

impl CellsAtDistance {
    #[inline(always)]
    fn take(&mut self, height: f32, turn: u32) {
        self.turns |= 1 << turn;
        self.top = if height > self.top { height } else { self.top };
    }
}

/// The bins of a turn with those up to `by` beside them.
pub fn widened(bins: u64, by: u32) -> u64 {
    let (mut wide, mut done) = (bins, 0);
    while done < by {
        // What is widened so far has no gaps within `done` of a bin.
        let step = (by - done).min(2 * done + 1);
        wide |= wide.rotate_left(step) | wide.rotate_right(step);
        done += step;
    }
    wide
}

const SEEN_BITS: u32 = 7;
const SEEN: usize = 1 << SEEN_BITS;

/// How far cells of the tile stand into the shank and into the holder, mm. Under the width of the cutter only cells ahead count: the
/// move has already cleared those behind.
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
