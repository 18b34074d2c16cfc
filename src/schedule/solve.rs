//! From caps to commanded feeds: the main function of this room is [`feeds`]. In: [`Problem`], toolpath, job, options. Out: [`Schedule`].
//!
//! First the continuous optimum: speeds at every node under caps, axes and corners. Then the F words that save more than their price
//! ([`super::f_words`]). Where the program would grow by more than the setup allows, words and blocks become dearer: each costs its own
//! seconds plus λ times its share of the allowed growth, and the least λ with which the program fits is found by bisection. So the words
//! that save most are written first. The time lost against the answer without this bound is `bound_costs_s`.

use super::control::Control;
use super::exact_pass::{exact_pass, leg_times};
use super::f_words::{Costs, Grid, choose};
use super::feed_segments::{FeedSegment, feed_segments};
use super::holders::holders;
use super::optimum::optimum;
use super::prices::{active, prices};
use super::problem::{Bound, Conflict, FeedPiece, Problem, Schedule};
use super::realise::{realise, realise_by};
use super::track::{Track, track};
use crate::machine::{Job, LimitKind};
use crate::nc::Toolpath;
use crate::units::{MM_PER_INCH, mm_s_from_mm_min};

/// Price of an F word, s: the time that about 20 bytes, its note included, take over a serial line at 115,200 baud. Controls without room
/// for the program are fed over such a line.
pub const WORD_S: f64 = 0.002;
/// Price of a block, s: about 50 bytes over the same line.
pub const BLOCK_S: f64 = 0.005;
/// Highest price of a word, s: less than the cost of a segment below its minimum feed, so that minima are kept first.
const DEAREST_S: f64 = 1e4;
/// Most values of λ that are tried.
const TRIES: usize = 10;
/// Share of the allowed growth that may be left unused: the search for λ ends there.
const UNUSED: f64 = 0.03;

/// Share by which an F word may lie below a minimum through rounding.
const ROUNDED: f64 = 0.005;
/// Shortest stretch below a minimum feed that is reported, mm, where the minimum holds on the rest of the piece.
const MERGED_MM: f64 = 0.1;

/// What the caller may choose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// The F numbers that the program may carry.
    pub grid: Grid,
    /// Price of an F word, s.
    pub word_s: f64,
    /// Price of a block, s.
    pub block_s: f64,
    /// What the program may grow by; `None`: by anything.
    pub room: Option<Growth>,
    /// λ of an earlier answer, s, as the first guess.
    pub lambda_s: f64,
    /// Shortest stretch that a feed of the text is raised on, mm (0: any).
    pub least_rise_mm: f64,
}

/// How much a program may grow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growth {
    /// New blocks.
    pub blocks: f64,
    /// New bytes.
    pub bytes: f64,
    /// Bytes that an F word takes with its note.
    pub word_bytes: f64,
    /// Bytes that a block takes.
    pub block_bytes: f64,
}

impl Growth {
    /// Share of the allowed growth that a word and a block take. A block takes the larger of its share of blocks and its share of bytes.
    fn shares(&self) -> [f64; 2] {
        let of = |part: f64, whole: f64| part / whole.max(f64::MIN_POSITIVE);
        let word = of(self.word_bytes, self.bytes);
        [word.min(1e6), of(1.0, self.blocks).max(of(self.block_bytes, self.bytes)).min(1e6)]
    }
}

impl Options {
    /// Defaults: one decimal in mm/min, two in inch/min.
    pub fn of(toolpath: &Toolpath) -> Self {
        let grid = if toolpath.inch {
            Grid { unit_mm_s: mm_s_from_mm_min(MM_PER_INCH), decimals: 2 }
        } else {
            Grid { unit_mm_s: mm_s_from_mm_min(1.0), decimals: 1 }
        };
        Self { grid, word_s: WORD_S, block_s: BLOCK_S, room: None, lambda_s: 0.0, least_rise_mm: 0.0 }
    }
    fn costs(&self, lambda_s: f64, job: &Job) -> Costs {
        let [word, block] = self.room.map_or([0.0; 2], |room| room.shares());
        let price = |own_s: f64, share: f64| (own_s + lambda_s * share).min(DEAREST_S);
        let (word_s, split_s) = (price(self.word_s, word), price(self.block_s, block));
        Costs { word_s, split_s, minimum_change: job.output.minimum_change }
    }
}

/// Commanded feeds for the whole program with their prices: [`feeds`], then [`explain`].
#[cfg(feature = "rooms")]
pub fn solve(problem: &Problem, toolpath: &Toolpath, job: &Job, options: &Options) -> Schedule {
    let mut schedule = feeds(problem, toolpath, job, options);
    explain(&mut schedule, problem, toolpath, job);
    schedule
}

/// Commanded feeds for the whole program, without prices.
pub fn feeds(problem: &Problem, toolpath: &Toolpath, job: &Job, options: &Options) -> Schedule {
    let segments = feed_segments(problem, &fastest_s(problem, toolpath, job), toolpath, job);
    let carries = |i: usize| carries_word(&segments, i, toolpath);
    let attempt = |lambda_s: f64| {
        let mut feeds = choose(&segments, &options.grid, &options.costs(lambda_s, job), &carries);
        leave_short_rises(&segments, &mut feeds, options.least_rise_mm);
        Attempt { lambda_s, used: used(&segments, &feeds, options, &carries), feeds }
    };
    let timed = |attempt: &Attempt| {
        let pieces = pieces(&segments, &attempt.feeds);
        (realise(toolpath, &pieces, &job.machine).total_s, pieces)
    };
    let (continuous_s, free) = rayon::join(|| continuous_s(problem, toolpath, job), || attempt(0.0));
    let (free_s, mut pieces) = timed(&free);
    let (mut total_s, mut lambda_s) = (free_s, 0.0);
    if free.used > 1.0 {
        let fitting = fitting(free, options.lambda_s, &attempt);
        lambda_s = fitting.lambda_s;
        (total_s, pieces) = timed(&fitting);
    }
    // No program is faster than the continuous optimum; rounding must not make it look so.
    let continuous_s = continuous_s.min(free_s).min(total_s);
    Schedule { pieces, continuous_s, lambda_s, bound_costs_s: total_s - free_s, ..Schedule::default() }
}

/// Gives stretches shorter than `least_mm` on which every feed is raised their feeds of the text back.
fn leave_short_rises(segments: &[FeedSegment], feeds: &mut [f64], least_mm: f64) {
    let rises = |i: usize, feeds: &[f64]| feeds[i] > segments[i].programmed_mm_s;
    let mut start = 0;
    while start < segments.len() {
        let mut end = start + 1;
        let follows = |i: usize| segments[i].move_id.0 <= segments[i - 1].move_id.0 + 1;
        while end < segments.len() && rises(start, feeds) && rises(end, feeds) && follows(end) {
            end += 1;
        }
        let length_mm: f64 = segments[start..end].iter().map(FeedSegment::length_mm).sum();
        let text = || segments[start..end].iter().all(|segment| segment.text_s().is_finite());
        if rises(start, feeds) && length_mm <= least_mm && text() {
            for (feed, segment) in feeds[start..end].iter_mut().zip(&segments[start..end]) {
                *feed = segment.programmed_mm_s;
            }
        }
        start = end;
    }
}

/// Feeds for one λ, and the share of the allowed growth that their words and blocks take.
struct Attempt {
    lambda_s: f64,
    used: f64,
    feeds: Vec<f64>,
}

/// The feeds for about the least λ with which the program grows no more than allowed. Some words are needed at any price, so the growth
/// may be larger even for the highest λ tried; that answer is then returned. `known_s`: λ for a problem whose caps differ in few places.
fn fitting(free: Attempt, known_s: f64, attempt: &dyn Fn(f64) -> Attempt) -> Attempt {
    let mut best = free;
    let mut low_s = 0.0;
    let mut next_s = if known_s > 0.0 { known_s } else { 1.0 };
    for _ in 0..TRIES {
        let found = attempt(next_s);
        let fits = found.used <= 1.0;
        if !fits {
            low_s = next_s;
        }
        if fits || best.used > 1.0 {
            best = found;
        }
        if best.used <= 1.0 && (best.used >= 1.0 - UNUSED || best.lambda_s == known_s) {
            break;
        }
        next_s = match (best.used <= 1.0, low_s > 0.0) {
            (true, true) => (low_s * best.lambda_s).sqrt(),
            (true, false) => 0.1 * best.lambda_s,
            (false, _) => 10.0 * low_s,
        };
    }
    best
}

/// Share of the allowed growth that new blocks, and F words that the text does not have, take.
fn used(segments: &[FeedSegment], feeds: &[f64], options: &Options, carries: &dyn Fn(usize) -> bool) -> f64 {
    let Some(room) = options.room else { return 0.0 };
    let [word, block] = room.shares();
    let mut shares = 0.0;
    for (i, segment) in segments.iter().enumerate() {
        let same = |j: usize| feeds[j] == segments[j].programmed_mm_s;
        let changes = i > 0 && feeds[i] != feeds[i - 1] && !(same(i) && same(i - 1));
        shares += if segment.from_mm > 0.0 {
            if changes { block } else { 0.0 }
        } else if carries(i) {
            if same(i) { 0.0 } else { word }
        } else if changes || i == 0 && !same(i) {
            if segment.free { word } else { block }
        } else {
            0.0
        };
    }
    shares
}

/// Time of the continuous optimum, s: every node at its cap, or at the feed of the text where that may not change, as if F could change
/// anywhere without a word. It does not depend on any choice of words and blocks.
pub fn continuous_s(problem: &Problem, toolpath: &Toolpath, job: &Job) -> f64 {
    let control = Control { feed_changes_anywhere: true, ..Control::of(&job.machine) };
    let realised = realise_by(toolpath, &job.machine, &control, &mut |id, pieces| {
        pieces.extend(problem.nodes_of(id).iter().map(|node| {
            let feed_mm_s = if node.free { node.cap.feed_mm_s } else { node.programmed_mm_s };
            FeedPiece::commanded(id, [node.from_mm, node.to_mm], feed_mm_s)
        }));
    });
    realised.total_s
}

/// Fills in the binding limit of each piece with its price, and the shadow prices of the whole program.
pub fn explain(schedule: &mut Schedule, problem: &Problem, toolpath: &Toolpath, job: &Job) {
    let optimum = optimum(node_track(problem, toolpath, job), 0.0);
    let prices = prices(problem, toolpath, &optimum);
    schedule.holders = holders(problem, toolpath, &schedule.pieces);
    let active = active(problem, toolpath, &optimum, &schedule.holders);
    put_prices(&mut schedule.pieces, problem, &prices.node_s);
    schedule.missed = missed(problem, &schedule.pieces, &fastest_s(problem, toolpath, job));
    (schedule.shadow_prices, schedule.active_s, schedule.not_raised_s) =
        (prices.shadow, active.by_limit_s, active.not_raised_s);
    (schedule.how, schedule.windows) = (optimum.how(), optimum.windows);
}

/// Minimum feeds that are not kept although the caps of their own place would allow it: another place under the same F word has a lower cap.
fn missed(problem: &Problem, pieces: &[FeedPiece], node_s: &[f64]) -> Vec<Conflict> {
    let mut missed = Vec::new();
    for piece in pieces {
        let first = problem.of_move[piece.move_id.ix()].start as usize;
        for (index, node) in problem.nodes_of(piece.move_id).iter().enumerate().map(|(k, node)| (first + k, node)) {
            let shared_mm = node.to_mm.min(piece.to_mm) - node.from_mm.max(piece.from_mm);
            let asked = matches!(node.floor.kind, LimitKind::FeedMin | LimitKind::ChipThicknessMin);
            let reached_mm_s = node.floor.feed_mm_s.min(node.length_mm() / node_s[index]);
            let low = piece.feed_mm_s < (1.0 - ROUNDED) * reached_mm_s;
            if asked && low && node.free && node.cutting && shared_mm > MERGED_MM.min(0.5 * node.length_mm()) {
                let cap = Bound { feed_mm_s: piece.feed_mm_s, kind: piece.limit, per_unit: 0.0 };
                missed.push(Conflict { node: index, floor: node.floor, cap });
            }
        }
    }
    missed
}

/// Time of each node in the continuous optimum, s, without jerk limits: F words are compared with the motion of the control, which has none.
fn fastest_s(problem: &Problem, toolpath: &Toolpath, job: &Job) -> Vec<f64> {
    let track = node_track(problem, toolpath, job);
    let mut node_s = vec![0.0; problem.nodes.len()];
    for (time_s, tag) in leg_times(&track.chain, &exact_pass(&track.chain)).iter().zip(&track.tags) {
        node_s[*tag as usize] += time_s;
    }
    node_s
}

/// Sets `price_s` of each piece: the seconds that one percent more of its bound saves, summed over its nodes.
fn put_prices(pieces: &mut [FeedPiece], problem: &Problem, node_s: &[f64]) {
    for piece in pieces {
        let range = problem.of_move[piece.move_id.ix()].clone();
        for index in range {
            let node = &problem.nodes[index as usize];
            let shared = node.to_mm.min(piece.to_mm) - node.from_mm.max(piece.from_mm);
            if shared > 0.0 {
                let share = shared / node.length_mm();
                piece.price_s += share * 0.01 * node.cap.feed_mm_s * node_s[index as usize];
            }
        }
    }
}

/// The track with every node at its cap; the tag of a leg is the index of its node.
pub fn node_track(problem: &Problem, toolpath: &Toolpath, job: &Job) -> Track {
    let mut track = track(toolpath, &job.machine, &mut |id, pieces| {
        let nodes = problem.nodes_of(id).iter();
        pieces.extend(nodes.map(|node| FeedPiece::commanded(id, [node.from_mm, node.to_mm], node.cap.feed_mm_s)));
    });
    for (tag, id) in track.tags.iter_mut().zip(&track.moves) {
        *tag += problem.of_move[id.ix()].start;
    }
    track
}

fn carries_word(segments: &[FeedSegment], i: usize, toolpath: &Toolpath) -> bool {
    let motion = &toolpath.moves[segments[i].move_id.ix()];
    segments[i].from_mm <= 0.0 && motion.feed.word.is_some_and(|(block, _)| block == motion.block)
}

/// Pieces of equal feed within each move.
fn pieces(segments: &[FeedSegment], feeds: &[f64]) -> Vec<FeedPiece> {
    let mut pieces: Vec<FeedPiece> = Vec::with_capacity(segments.len());
    for (segment, &feed_mm_s) in segments.iter().zip(feeds) {
        match pieces.last_mut() {
            Some(last) if last.move_id == segment.move_id && last.feed_mm_s == feed_mm_s => last.to_mm = segment.to_mm,
            _ => pieces.push(FeedPiece {
                move_id: segment.move_id,
                from_mm: segment.from_mm,
                to_mm: segment.to_mm,
                feed_mm_s,
                limit: binding(segment, feed_mm_s),
                price_s: 0.0,
                used: None,
            }),
        }
    }
    pieces
}

fn binding(segment: &FeedSegment, feed_mm_s: f64) -> LimitKind {
    if !segment.free {
        LimitKind::Programmed
    } else if segment.speed_mm_s < 0.95 * feed_mm_s {
        LimitKind::Acceleration
    } else {
        segment.cap.kind
    }
}
