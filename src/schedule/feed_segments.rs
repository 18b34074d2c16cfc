//! The smallest pieces that may carry an F word of their own. In: the problem, the speeds the machine can reach, what may be
//! split. Out: [`FeedSegment`]s in order of execution; those of a feed move tile it, none inside a block is shorter than allowed, in
//! length or in time.
//!
//! A piece that is too short takes what it lacks from a neighbour in its block with a higher cap, or is merged with the
//! neighbour whose cap is nearest. Feed moves of one block (cycles, compensation, repeated blocks) share one feed.

use super::problem::{Bound, Node, Problem};
use crate::ids::MoveId;
use crate::machine::{Job, LimitKind};
use crate::nc::{Move, MoveKind, Toolpath};

/// Share by which an F word of the text may lie above the cap of a load and still stay: half of what the check of the written file allows.
pub const SLACK: f64 = 0.005;
/// Caps that differ by less than this share, over all of a piece, are one.
const SAME: f64 = 0.004;

/// A piece that may carry its own F word.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedSegment {
    /// Its move.
    pub move_id: MoveId,
    /// Where it begins, mm along the move.
    pub from_mm: f64,
    /// Where it ends.
    pub to_mm: f64,
    /// Highest feed.
    pub cap: Bound,
    /// Lowest feed asked for, where acceleration lets the machine reach it; the greatest along the piece.
    pub floor_mm_s: f64,
    /// Mean speed of the continuous optimum, mm/s.
    pub speed_mm_s: f64,
    /// Feed as programmed, mm/s.
    pub programmed_mm_s: f64,
    /// May its feed change?
    pub free: bool,
    /// May its move be split?
    pub splittable: bool,
}

impl FeedSegment {
    /// Length, mm.
    pub fn length_mm(&self) -> f64 {
        self.to_mm - self.from_mm
    }
    /// Lowest feed it may be given, mm/s: the floor, or the cap where that is lower. 0 where the lower cap comes from a load limit: load limits
    /// overrule every minimum.
    pub fn lowest_mm_s(&self) -> f64 {
        use LimitKind::{AirFeed, Feed, FeedChange, Programmed};
        if self.floor_mm_s < self.cap.feed_mm_s * (1.0 - 1e-9) {
            self.floor_mm_s
        } else if matches!(self.cap.kind, AirFeed | Feed | FeedChange | Programmed) {
            self.cap.feed_mm_s
        } else {
            0.0
        }
    }
    /// Time at the feed of the text, s; higher than every price where that feed is above the cap (the cap of a load: by more than [`SLACK`])
    /// or below the floor by more than rounding.
    pub fn text_s(&self) -> f64 {
        let slack = if self.cap.kind.is_load() { SLACK } else { 1e-9 };
        let there = self.programmed_mm_s;
        let within = there <= self.cap.feed_mm_s * (1.0 + slack) && there >= self.lowest_mm_s() * (1.0 - SLACK);
        if within { self.time_s(there) } else { f64::INFINITY }
    }
    /// Time at a commanded feed, s.
    pub fn time_s(&self, feed_mm_s: f64) -> f64 {
        self.length_mm() / feed_mm_s.min(self.speed_mm_s)
    }
}

/// Feed segments of the whole program. `node_s` is the time of each node in the continuous optimum, s.
pub fn feed_segments(problem: &Problem, node_s: &[f64], toolpath: &Toolpath, job: &Job) -> Vec<FeedSegment> {
    let output = &job.output;
    let groups = groups(toolpath);
    let mut out: Vec<FeedSegment> = Vec::new();
    let mut pieces: Vec<FeedSegment> = Vec::new();
    for (index, motion) in toolpath.moves.iter().enumerate() {
        if motion.kind == MoveKind::Rapid {
            continue;
        }
        let range = problem.of_move[index].start as usize..problem.of_move[index].end as usize;
        pieces.clear();
        pieces.extend(problem.nodes[range.clone()].iter().zip(&node_s[range]).map(|(node, &s)| segment(node, s)));
        let alone = output.split && motion.splittable && groups[index].is_none();
        if alone && pieces.iter().all(|piece| piece.free) {
            for piece in &mut pieces {
                piece.splittable = true;
            }
            join_equal(&mut pieces);
            lengthen(&mut pieces, output.minimum_length_mm, job.machine.block_time_s);
        } else {
            join_all(&mut pieces);
        }
        out.append(&mut pieces);
    }
    share_caps(&mut out, &groups, toolpath);
    out
}

fn segment(node: &Node, time_s: f64) -> FeedSegment {
    let length_mm = node.length_mm();
    let speed_mm_s = if time_s > 0.0 { length_mm / time_s } else { node.cap.feed_mm_s.max(f64::MIN_POSITIVE) };
    FeedSegment {
        move_id: node.move_id,
        from_mm: node.from_mm,
        to_mm: node.to_mm,
        cap: node.cap,
        floor_mm_s: node.floor.feed_mm_s.min(speed_mm_s),
        speed_mm_s,
        programmed_mm_s: node.programmed_mm_s,
        // A segment without a cap above zero stays as it is, and its cap must not become a level.
        free: node.free && node.cap.feed_mm_s > 0.0 && node.cap.feed_mm_s.is_finite(),
        splittable: false,
    }
}

/// Group of moves that share one feed, by move index: those that the toolpath says are made by the same text, and the feed
/// moves of one block.
pub fn groups(toolpath: &Toolpath) -> Vec<Option<u32>> {
    let blocks = toolpath.moves.iter().map(|motion| motion.block.0 + 1).max().unwrap_or(0);
    let mut count = vec![0; blocks as usize];
    for motion in toolpath.moves.iter().filter(|motion| motion.kind == MoveKind::Feed) {
        count[motion.block.ix()] += 1;
    }
    let group = |motion: &Move| match motion.shared {
        Some(number) => Some(blocks + number),
        None => (count[motion.block.ix()] > 1).then_some(motion.block.0),
    };
    toolpath.moves.iter().map(group).collect()
}

/// One F for all moves of a group: the least that a cap allows; and none is free unless all are.
fn share_caps(segments: &mut [FeedSegment], groups: &[Option<u32>], toolpath: &Toolpath) {
    let size = groups.iter().flatten().max().map_or(0, |largest| *largest as usize + 1);
    let over_contour = |segment: &FeedSegment| toolpath.moves[segment.move_id.ix()].feed.over_contour;
    let times = |cap: Bound, ratio: f64| Bound { feed_mm_s: cap.feed_mm_s * ratio, ..cap };
    let mut least: Vec<Option<(Bound, bool)>> = vec![None; size];
    for segment in segments.iter() {
        let Some(group) = groups[segment.move_id.ix()] else { continue };
        let own = times(segment.cap, 1.0 / over_contour(segment));
        let (cap, free) = least[group as usize].unwrap_or((own, true));
        let lower = if own.feed_mm_s < cap.feed_mm_s { own } else { cap };
        least[group as usize] = Some((lower, free && segment.free));
    }
    for segment in segments.iter_mut() {
        if let Some((cap, free)) = groups[segment.move_id.ix()].and_then(|group| least[group as usize]) {
            (segment.cap, segment.free) = (times(cap, over_contour(segment)), free);
        }
    }
}

/// Two neighbours as one.
fn joined(a: &FeedSegment, b: &FeedSegment) -> FeedSegment {
    let time_s = a.length_mm() / a.speed_mm_s + b.length_mm() / b.speed_mm_s;
    let length_mm = b.to_mm - a.from_mm;
    FeedSegment {
        to_mm: b.to_mm,
        cap: if b.cap.feed_mm_s < a.cap.feed_mm_s { b.cap } else { a.cap },
        floor_mm_s: a.floor_mm_s.max(b.floor_mm_s),
        speed_mm_s: if time_s > 0.0 { length_mm / time_s } else { a.speed_mm_s.max(b.speed_mm_s) },
        free: a.free && b.free,
        ..*a
    }
}

fn join_all(pieces: &mut Vec<FeedSegment>) {
    if let Some(all) = pieces.iter().copied().reduce(|a, b| joined(&a, &b)) {
        pieces.clear();
        pieces.push(all);
    }
}

/// Joins neighbours whose caps are the same (kind and value); a slow rise or fall is not joined step by step.
fn join_equal(pieces: &mut Vec<FeedSegment>) {
    let mut highest = pieces.first().map_or(0.0, |segment| segment.cap.feed_mm_s);
    pieces.dedup_by(|b, a| {
        let low = a.cap.feed_mm_s.min(b.cap.feed_mm_s);
        let high = highest.max(b.cap.feed_mm_s);
        let same = a.cap.kind == b.cap.kind && high - low <= SAME * low;
        highest = if same { high } else { b.cap.feed_mm_s };
        if same {
            *a = joined(a, b);
        }
        same
    });
}

/// Makes every piece at least `least_mm` long, and long enough to take `least_s` at its cap (or the block one piece).
fn lengthen(pieces: &mut Vec<FeedSegment>, least_mm: f64, least_s: f64) {
    let least = |piece: &FeedSegment| least_mm.max(least_s * piece.cap.feed_mm_s);
    let mut i = 0;
    while pieces.len() > 1 && i < pieces.len() {
        let lacking = least(&pieces[i]) - pieces[i].length_mm();
        if lacking <= 1e-9 {
            i += 1;
            continue;
        }
        let before = i.checked_sub(1);
        let after = (i + 1 < pieces.len()).then_some(i + 1);
        let gives = |at: &usize| {
            pieces[*at].length_mm() - lacking >= least(&pieces[*at])
                && pieces[*at].cap.feed_mm_s >= pieces[i].cap.feed_mm_s
        };
        if let Some(from) = [after, before].into_iter().flatten().find(gives) {
            take(pieces, i, from, lacking);
            i += 1;
            continue;
        }
        let far = |at: &usize| (pieces[*at].cap.feed_mm_s / pieces[i].cap.feed_mm_s).ln().abs();
        let near = [before, after].into_iter().flatten().min_by(|a, b| far(a).total_cmp(&far(b)));
        let first = near.map_or(i, |near| near.min(i));
        pieces[first] = joined(&pieces[first], &pieces[first + 1]);
        pieces.remove(first + 1);
        i = first;
    }
}

/// Moves the boundary between neighbours so that `to` gains `length_mm` from `from`.
fn take(pieces: &mut [FeedSegment], to: usize, from: usize, length_mm: f64) {
    let time_s = pieces[to].length_mm() / pieces[to].speed_mm_s + length_mm / pieces[from].speed_mm_s;
    if from > to {
        pieces[to].to_mm += length_mm;
        pieces[from].from_mm = pieces[to].to_mm;
    } else {
        pieces[to].from_mm -= length_mm;
        pieces[from].to_mm = pieces[to].from_mm;
    }
    pieces[to].speed_mm_s = pieces[to].length_mm() / time_s;
}
