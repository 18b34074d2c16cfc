//! The main question of the room: from caps to commanded feeds. In: [`Problem`], toolpath, job, options. Out: [`Schedule`].
//!
//! First the continuous optimum: speeds at every node under caps, axes and corners. Then the F words that come nearest to it.

use super::pass::{exact_pass, leg_times};
use super::problem::{FeedPiece, Problem, Schedule};
use super::realise::realise;
use super::track::{ArcLaw, Span, Track, track};
use super::units::{Unit, units};
use super::words::{Grid, Prices, choose};
use crate::machine::{Job, LimitKind};
use crate::nc::{MoveKind, Toolpath};
use crate::units::{MM_PER_INCH, mm_s_from_mm_min};

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
    let track = node_track(problem, toolpath, job, ArcLaw::PerAxis);
    let b = exact_pass(&track.chain);
    let leg_s = leg_times(&track.chain, &b);
    let mut node_s = vec![0.0; problem.nodes.len()];
    for (time_s, tag) in leg_s.iter().zip(&track.tags) {
        node_s[*tag as usize] += time_s;
    }
    let units = units(problem, &node_s, toolpath, &job.output);
    let carries = |i: usize| carries_word(&units, i, toolpath);
    let prices = Prices { word_s: options.word_s, split_s: options.split_s, minimum_change: job.output.minimum_change };
    let feeds = choose(&units, &options.grid, &prices, &carries);
    let pieces = pieces(&units, &feeds);
    let continuous_s = realise(toolpath, &continuous_pieces(problem, toolpath), &job.machine).total_s;
    Schedule {
        active_s: active_times(problem, &node_s),
        pieces,
        continuous_s,
        shadow_prices: Vec::new(),
        how: "exact forward-backward pass".to_owned(),
    }
}

/// The track whose spans are the nodes of the problem with their caps.
pub fn node_track(problem: &Problem, toolpath: &Toolpath, job: &Job, law: ArcLaw) -> Track {
    track(toolpath, &job.machine, law, &mut |id, spans| {
        let range = &problem.of_move[id.ix()];
        spans.extend(range.clone().map(|tag| {
            let node = &problem.nodes[tag as usize];
            let (from_mm, to_mm, feed_mm_s) = (node.from_mm, node.to_mm, node.cap.feed_mm_s);
            Span { from_mm, to_mm, feed_mm_s, tag }
        }));
    })
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
                limit: if unit.free { unit.cap.kind } else { LimitKind::Programmed },
                price_s: 0.0,
            }),
        }
    }
    pieces
}

/// Every node at its cap: what an unlimited number of F words could do.
fn continuous_pieces(problem: &Problem, toolpath: &Toolpath) -> Vec<FeedPiece> {
    let feed = |node: &&super::problem::Node| toolpath.moves[node.move_id.ix()].kind == MoveKind::Feed;
    let piece = |node: &super::problem::Node| FeedPiece {
        move_id: node.move_id,
        from_mm: node.from_mm,
        to_mm: node.to_mm,
        feed_mm_s: node.cap.feed_mm_s,
        limit: node.cap.kind,
        price_s: 0.0,
    };
    problem.nodes.iter().filter(feed).map(piece).collect()
}

fn active_times(problem: &Problem, node_s: &[f64]) -> Vec<(LimitKind, f64)> {
    let mut seconds = [0.0; LimitKind::ALL.len()];
    for (node, time_s) in problem.nodes.iter().zip(node_s).filter(|(node, _)| node.cutting) {
        seconds[node.cap.kind as usize] += time_s;
    }
    LimitKind::ALL.into_iter().zip(seconds).filter(|(_, time_s)| *time_s > 0.0).collect()
}
