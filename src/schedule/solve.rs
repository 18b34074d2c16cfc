//! The main question of the room: from caps to commanded feeds. In: [`Problem`], toolpath, job, options. Out: [`Schedule`].
//!
//! First the continuous optimum: speeds at every node under caps, axes and corners. Then the F words that come nearest to it.

use super::optimum::{Optimum, optimum};
use super::pass::{exact_pass, leg_times};
use super::prices::prices;
use super::problem::{Bound, FeedPiece, Problem, Schedule};
use super::realise::realise;
use super::track::{Span, Track, track};
use super::units::{Unit, units};
use super::words::{Costs, Grid, choose};
use crate::machine::{Job, LimitKind};
use crate::nc::{MoveKind, Toolpath};
use crate::units::{MM_PER_INCH, mm_s_from_mm_min};

/// Loss against the continuous optimum above which F words are made cheaper.
const LOSS: f64 = 0.008;
/// Growth of the program, in blocks, above which splits are made dearer.
const GROWTH: f64 = 1.5;
/// How often prices are changed.
const ROUNDS: usize = 9;
/// Ratio of two prices that are near enough to stop between them.
const NEAR: f64 = 1.1;
/// Share of the time that new F words must save to replace those that are within their limits.
const WORTH: f64 = 0.002;
/// How far an F word that is there may lie above a cap: half of what the check of the written file allows a load.
const SLACK: f64 = 0.005;

/// What the caller may choose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// The F numbers that the program may carry.
    pub grid: Grid,
    /// Price of an F word, s.
    pub word_s: f64,
    /// Price of a split, s.
    pub split_s: f64,
}

impl Options {
    /// Defaults: one decimal in mm/min, two in inch/min.
    pub fn of(toolpath: &Toolpath) -> Self {
        let grid = if toolpath.inch {
            Grid { unit_mm_s: mm_s_from_mm_min(MM_PER_INCH), decimals: 2 }
        } else {
            Grid { unit_mm_s: mm_s_from_mm_min(1.0), decimals: 1 }
        };
        Self { grid, word_s: 0.005, split_s: 0.015 }
    }
}

/// Commanded feeds for the whole program.
pub fn solve(problem: &Problem, toolpath: &Toolpath, job: &Job, options: &Options) -> Schedule {
    let track = node_track(problem, toolpath, job);
    let mut node_s = vec![0.0; problem.nodes.len()];
    // F words are held against the control's trapezoids, which know no jerk.
    for (time_s, tag) in leg_times(&track.chain, &exact_pass(&track.chain)).iter().zip(&track.tags) {
        node_s[*tag as usize] += time_s;
    }
    let optimum = optimum(track, 0.0);
    let prices = prices(problem, &optimum, &optimum.leg_times());
    let units = units(problem, &node_s, toolpath, &job.output);
    let carries = |i: usize| carries_word(&units, i, toolpath);
    let continuous_s = realise(toolpath, &continuous_pieces(problem, &units), &job.machine).total_s;
    let mut search = Search { costs: costs(options, job), affordable: None, too_cheap: 0.0 };
    for _ in 0..ROUNDS {
        let pieces = pieces(&units, &choose(&units, &options.grid, &search.costs, &carries));
        let loss = realise(toolpath, &pieces, &job.machine).total_s / continuous_s - 1.0;
        let growth = growth(toolpath, &pieces);
        if search.is_settled(pieces, loss, growth) {
            break;
        }
    }
    let whole = Costs { split_s: f64::INFINITY, ..search.costs };
    let mut pieces = match search.affordable {
        Some((_, _, pieces)) => pieces,
        None => pieces(&units, &choose(&units, &options.grid, &whole, &carries)),
    };
    pieces = settled(&units, pieces, toolpath, job, continuous_s);
    put_prices(&mut pieces, problem, &prices.node_s);
    let how = how(&optimum);
    let used = Vec::new();
    Schedule { pieces, used, continuous_s, shadow_prices: prices.shadow, active_s: prices.active_s, how }
}

fn costs(options: &Options, job: &Job) -> Costs {
    Costs { word_s: options.word_s, split_s: options.split_s, minimum_change: job.output.minimum_change }
}

/// The search for the price of a split: the cheapest at which the program grows no more than it may, unless the loss is
/// small enough before.
struct Search {
    costs: Costs,
    /// Price, loss and feeds at which the program does not grow too much; of these the ones with the least loss.
    affordable: Option<(f64, f64, Vec<FeedPiece>)>,
    /// Highest price at which it does; 0: none is known.
    too_cheap: f64,
}

impl Search {
    /// Takes in what a price gave; sets the next one unless this one is good enough.
    fn is_settled(&mut self, pieces: Vec<FeedPiece>, loss: f64, growth: f64) -> bool {
        let price = self.costs.split_s;
        if growth > GROWTH {
            self.too_cheap = self.too_cheap.max(price);
        } else if self.affordable.as_ref().is_none_or(|(_, least, _)| loss < *least) {
            self.affordable = Some((price, loss, pieces));
        }
        let next = match (&self.affordable, self.too_cheap > 0.0) {
            (Some((_, loss, _)), _) if *loss <= LOSS => return true,
            (Some((known, ..)), true) if *known < NEAR * self.too_cheap => return true,
            (Some((known, ..)), true) => (known * self.too_cheap).sqrt(),
            (Some((known, ..)), false) => 0.25 * known,
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
fn settled(units: &[Unit], new: Vec<FeedPiece>, toolpath: &Toolpath, job: &Job, continuous_s: f64) -> Vec<FeedPiece> {
    let mut at = 0;
    let kept = |unit: &Unit| {
        while new[at].move_id != unit.move_id || new[at].to_mm < unit.to_mm - 1e-9 {
            at += 1;
        }
        let (there, chosen) = (unit.programmed_mm_s, new[at].feed_mm_s);
        let low = there < unit.floor_mm_s.min(chosen);
        if low || there > unit.cap.feed_mm_s * (1.0 + SLACK) { chosen } else { there }
    };
    let feeds: Vec<f64> = units.iter().map(kept).collect();
    let old = pieces(units, &feeds);
    let time_s = |pieces: &[FeedPiece]| realise(toolpath, pieces, &job.machine).total_s;
    let old_s = time_s(&old);
    let good = old_s <= (1.0 + LOSS) * continuous_s || old_s <= (1.0 + WORTH) * time_s(&new);
    if good { old } else { new }
}

fn how(optimum: &Optimum) -> String {
    let [windows, by_clarabel, refused] = optimum.windows;
    let mut text = format!("exact forward-backward pass over {} legs", optimum.chain.legs.len());
    if windows > 0 {
        text += &format!("; convex program in {windows} windows where speeds are coupled");
    }
    if by_clarabel > 0 {
        text += &format!(", {by_clarabel} of them by the second solver");
    }
    if refused > 0 {
        text += &format!(", {refused} of them refused by the check and left to the exact pass");
    }
    if optimum.jerky > 0 {
        text += &format!("; jerk above its limit at {} points", optimum.jerky);
    }
    text
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

/// Blocks after splitting over blocks before, up to the last that moves.
fn growth(toolpath: &Toolpath, pieces: &[FeedPiece]) -> f64 {
    let feed_moves = toolpath.moves.iter().filter(|motion| motion.kind == MoveKind::Feed).count();
    let blocks = toolpath.moves.last().map_or(1.0, |motion| f64::from(motion.block.0 + 1));
    (blocks + (pieces.len() - feed_moves.min(pieces.len())) as f64) / blocks
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
