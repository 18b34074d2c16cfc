//! The main question of the room: from caps to commanded feeds. In: [`Problem`], toolpath, job, options. Out: [`Schedule`].
//!
//! First the continuous optimum: speeds at every node under caps, axes and corners. Then the F words that come nearest to it.

use super::optimum::optimum;
use super::pass::{exact_pass, leg_times};
use super::prices::prices;
use super::problem::{Bound, Conflict, FeedPiece, Problem, Schedule};
use super::realise::realise;
use super::track::{Span, Track, track};
use super::units::{Unit, units};
use super::words::{Costs, Grid, choose};
use crate::machine::{Job, LimitKind};
use crate::nc::{MoveKind, Toolpath};
use crate::units::{MM_PER_INCH, mm_s_from_mm_min};

/// Loss against the continuous optimum above which F words are made cheaper.
const LOSS: f64 = 0.008;
/// New blocks, as a share of those there are, above which splits are made dearer.
const GROWTH: f64 = 0.5;
/// New blocks that any program may gain, however short.
const FEW: f64 = 24.0;
/// Price of a split that only a minimum pays, s.
const DEAREST_S: f64 = 1e6;
/// How often prices are changed.
const ROUNDS: usize = 9;
/// Ratio of two prices that are near enough to stop between them.
const NEAR: f64 = 1.1;
/// Share of the time that new F words must save to replace those that are within their limits.
const WORTH: f64 = 0.002;
/// How far an F word that is there may lie above a cap: half of what the check of the written file allows a load.
const SLACK: f64 = 0.005;

/// Share by which an F word may lie below a minimum through rounding.
const ROUNDED: f64 = 0.005;
/// Length of a place that counts, where only a part of it is below a minimum, mm.
const MERGED_MM: f64 = 0.1;

/// What the caller may choose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// The F numbers that the program may carry.
    pub grid: Grid,
    /// Price of an F word, s.
    pub word_s: f64,
    /// Price of a split, s.
    pub split_s: f64,
    /// The prices are those an earlier answer settled on: cheaper ones are not tried.
    pub settled: bool,
}

impl Options {
    /// Defaults: one decimal in mm/min, two in inch/min.
    pub fn of(toolpath: &Toolpath) -> Self {
        let grid = if toolpath.inch {
            Grid { unit_mm_s: mm_s_from_mm_min(MM_PER_INCH), decimals: 2 }
        } else {
            Grid { unit_mm_s: mm_s_from_mm_min(1.0), decimals: 1 }
        };
        Self { grid, word_s: 0.005, split_s: 0.015, settled: false }
    }
    /// The prices that an answer settled on, for the same program under caps that differ in a few places.
    pub fn after(self, schedule: &Schedule) -> Self {
        let [word_s, split_s] = schedule.word_split_s;
        Self { word_s, split_s, settled: true, ..self }
    }
}

/// Commanded feeds for the whole program, and why.
pub fn solve(problem: &Problem, toolpath: &Toolpath, job: &Job, options: &Options) -> Schedule {
    let mut schedule = feeds(problem, toolpath, job, options);
    explain(&mut schedule, problem, toolpath, job);
    schedule
}

/// Commanded feeds for the whole program, without prices.
pub fn feeds(problem: &Problem, toolpath: &Toolpath, job: &Job, options: &Options) -> Schedule {
    let units = units(problem, &fastest_s(problem, toolpath, job), toolpath, job);
    let carries = |i: usize| carries_word(&units, i, toolpath);
    let time_s = |pieces: &[FeedPiece]| realise(toolpath, pieces, &job.machine).total_s;
    let attempt = |costs: Costs| {
        let pieces = pieces(&units, &choose(&units, &options.grid, &costs, &carries));
        Attempt { costs, total_s: time_s(&pieces), pieces }
    };
    let costs = costs(options, job);
    let (continuous_s, first) = rayon::join(|| time_s(&continuous_pieces(problem, &units)), || attempt(costs));
    let mut search = Search { costs, settled: options.settled, affordable: None, too_cheap: 0.0 };
    let mut next = Some(first);
    for _ in 0..ROUNDS {
        let attempt = next.take().unwrap_or_else(|| attempt(search.costs));
        let (loss, grows) = (attempt.total_s / continuous_s - 1.0, grows_too_much(toolpath, &attempt.pieces));
        if search.is_settled(attempt, loss, grows) {
            break;
        }
    }
    let whole = || attempt(Costs { split_s: DEAREST_S, ..search.costs });
    let best = search.affordable.map_or_else(whole, |(_, attempt)| attempt);
    let word_split_s = [best.costs.word_s, best.costs.split_s];
    let pieces = settled(&units, best, &time_s, continuous_s);
    Schedule { pieces, continuous_s, word_split_s, ..Schedule::default() }
}

/// Fills in what binds where and at what price.
pub fn explain(schedule: &mut Schedule, problem: &Problem, toolpath: &Toolpath, job: &Job) {
    let optimum = optimum(node_track(problem, toolpath, job), 0.0);
    let prices = prices(problem, &optimum, &optimum.leg_times());
    put_prices(&mut schedule.pieces, problem, &prices.node_s);
    schedule.missed = missed(problem, &schedule.pieces, &fastest_s(problem, toolpath, job));
    (schedule.shadow_prices, schedule.active_s, schedule.kept_s) = (prices.shadow, prices.active_s, prices.kept_s);
    (schedule.how, schedule.windows) = (optimum.how(), optimum.windows);
}

/// Minima for which no cap of the same place had to make room, but that of a place with the same F word.
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

/// Time of each node at the fastest, s. F words are held against the control's trapezoids, which know no jerk.
fn fastest_s(problem: &Problem, toolpath: &Toolpath, job: &Job) -> Vec<f64> {
    let track = node_track(problem, toolpath, job);
    let mut node_s = vec![0.0; problem.nodes.len()];
    for (time_s, tag) in leg_times(&track.chain, &exact_pass(&track.chain)).iter().zip(&track.tags) {
        node_s[*tag as usize] += time_s;
    }
    node_s
}

fn costs(options: &Options, job: &Job) -> Costs {
    Costs { word_s: options.word_s, split_s: options.split_s, minimum_change: job.output.minimum_change }
}

/// Feeds at some prices.
struct Attempt {
    costs: Costs,
    total_s: f64,
    pieces: Vec<FeedPiece>,
}

/// The search for the price of a split: the cheapest at which the program grows no more than it may, unless the loss is
/// small enough before, or a cheaper one is no better.
struct Search {
    costs: Costs,
    /// Whatever does not grow too much is good enough.
    settled: bool,
    /// Loss and feeds at a price at which the program does not grow too much; of these the ones with the least loss.
    affordable: Option<(f64, Attempt)>,
    /// Highest price at which it does; 0: none is known.
    too_cheap: f64,
}

impl Search {
    /// Takes in what a price gave; sets the next one unless this one is good enough.
    fn is_settled(&mut self, attempt: Attempt, loss: f64, grows: bool) -> bool {
        let price = self.costs.split_s;
        if grows {
            self.too_cheap = self.too_cheap.max(price);
        } else if self.affordable.as_ref().is_none_or(|(least, _)| loss < *least) {
            self.affordable = Some((loss, attempt));
        }
        let known = self.affordable.as_ref().map(|(loss, attempt)| (*loss, attempt.costs.split_s));
        let next = match (known, self.too_cheap > 0.0) {
            (Some((loss, _)), _) if loss <= LOSS || self.settled => return true,
            (Some((_, known)), true) if known < NEAR * self.too_cheap => return true,
            (Some((_, known)), true) => (known * self.too_cheap).sqrt(),
            (Some((_, known)), false) if 0.25 * known >= price => return true,
            (Some((_, known)), false) => 0.25 * known,
            (None, _) => 4.0 * price,
        };
        self.costs.split_s = next;
        self.costs.word_s = self.costs.word_s.min(0.25 * next);
        false
    }
}

/// The feeds of the text, wherever they are within their limits, if they come as near to the continuous optimum as new ones
/// must, or cost next to no time (so that an optimised program stays as it is, though its stations lie elsewhere); else the
/// new ones.
fn settled(units: &[Unit], new: Attempt, time_s: &dyn Fn(&[FeedPiece]) -> f64, continuous_s: f64) -> Vec<FeedPiece> {
    let mut at = 0;
    let kept = |unit: &Unit| {
        while new.pieces[at].move_id != unit.move_id || new.pieces[at].to_mm < unit.to_mm - 1e-9 {
            at += 1;
        }
        let (there, chosen) = (unit.programmed_mm_s, new.pieces[at].feed_mm_s);
        let low = there < unit.floor_mm_s.min(chosen);
        if low || there > unit.cap.feed_mm_s * (1.0 + SLACK) { chosen } else { there }
    };
    let feeds: Vec<f64> = units.iter().map(kept).collect();
    let old = pieces(units, &feeds);
    if old == new.pieces {
        return old;
    }
    let old_s = time_s(&old);
    let good = old_s <= (1.0 + LOSS) * continuous_s || old_s <= (1.0 + WORTH) * new.total_s;
    if good { old } else { new.pieces }
}

/// Seconds that one percent more of the bound saves, summed over the nodes under each piece.
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

/// The track whose spans are the nodes of the problem with their caps.
pub fn node_track(problem: &Problem, toolpath: &Toolpath, job: &Job) -> Track {
    let mut track = track(toolpath, &job.machine, &mut |id, spans| {
        let range = &problem.of_move[id.ix()];
        spans.extend(range.clone().map(|tag| {
            let node = &problem.nodes[tag as usize];
            let (from_mm, to_mm, feed_mm_s) = (node.from_mm, node.to_mm, node.cap.feed_mm_s);
            Span { from_mm, to_mm, feed_mm_s, tag }
        }));
    });
    // A rapid has one node.
    for (tag, id) in track.tags.iter_mut().zip(&track.moves) {
        if toolpath.moves[id.ix()].kind == MoveKind::Rapid {
            *tag = problem.of_move[id.ix()].start;
        }
    }
    track
}

fn carries_word(units: &[Unit], i: usize, toolpath: &Toolpath) -> bool {
    let motion = &toolpath.moves[units[i].move_id.ix()];
    units[i].from_mm <= 0.0 && motion.feed.word.is_some_and(|(block, _)| block == motion.block)
}

/// Pieces of equal feed within each move.
fn pieces(units: &[Unit], feeds: &[f64]) -> Vec<FeedPiece> {
    let mut pieces: Vec<FeedPiece> = Vec::with_capacity(units.len());
    for (unit, &feed_mm_s) in units.iter().zip(feeds) {
        match pieces.last_mut() {
            Some(last) if last.move_id == unit.move_id && last.feed_mm_s == feed_mm_s => last.to_mm = unit.to_mm,
            _ => pieces.push(FeedPiece {
                move_id: unit.move_id,
                from_mm: unit.from_mm,
                to_mm: unit.to_mm,
                feed_mm_s,
                limit: binding(unit, feed_mm_s),
                price_s: 0.0,
            }),
        }
    }
    pieces
}

fn binding(unit: &Unit, feed_mm_s: f64) -> LimitKind {
    if !unit.free {
        LimitKind::Programmed
    } else if unit.speed_mm_s < 0.95 * feed_mm_s {
        LimitKind::Acceleration
    } else {
        unit.cap.kind
    }
}

/// Do the pieces add more blocks than a program of this many, counted up to the last that moves, may gain?
fn grows_too_much(toolpath: &Toolpath, pieces: &[FeedPiece]) -> bool {
    let feed_moves = toolpath.moves.iter().filter(|motion| motion.kind == MoveKind::Feed).count();
    let blocks = toolpath.moves.last().map_or(1.0, |motion| f64::from(motion.block.0 + 1));
    pieces.len().saturating_sub(feed_moves) as f64 > (GROWTH * blocks).max(FEW)
}

/// What an unlimited number of F words could do: every node at its cap where the move may be split, else the move at its own.
fn continuous_pieces(problem: &Problem, units: &[Unit]) -> Vec<FeedPiece> {
    let piece = |unit: &Unit, from_mm: f64, to_mm: f64, cap: &Bound| FeedPiece {
        move_id: unit.move_id,
        from_mm,
        to_mm,
        feed_mm_s: if unit.free { cap.feed_mm_s } else { unit.programmed_mm_s },
        limit: cap.kind,
        price_s: 0.0,
    };
    let mut pieces = Vec::with_capacity(problem.nodes.len());
    for unit in units {
        if !unit.splittable {
            pieces.push(piece(unit, unit.from_mm, unit.to_mm, &unit.cap));
            continue;
        }
        for node in problem.nodes_of(unit.move_id) {
            let (from_mm, to_mm) = (node.from_mm.max(unit.from_mm), node.to_mm.min(unit.to_mm));
            if to_mm > from_mm {
                pieces.push(piece(unit, from_mm, to_mm, &node.cap));
            }
        }
    }
    pieces
}
