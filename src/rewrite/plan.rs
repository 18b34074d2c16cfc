//! What each block of text needs: nothing, its original feed, or new feeds. In: the moves, why some must keep their feed, and the schedule's
//! pieces. Out: a [`Want`] for every block; where anything is unclear, the block keeps its feed.

use crate::diag::Span;
use crate::ids::{BlockId, MoveId};
use crate::machine::Job;
use crate::nc::{Freeze, Move, MoveKind, Program, Toolpath};
use crate::schedule::{FeedPiece, Schedule};

use super::freeze::freezes;

/// What a block needs.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Want {
    /// No feed motion: nothing.
    #[default]
    Nothing,
    /// Its bytes and the feed it was written for; why.
    Keep(&'static str),
    /// These feeds, in order along its move; one for the whole block ends at infinity. Of a block of several moves it is the feed of
    /// the first; the others run at the same F, on a compensated arc with another feed ([`crate::nc::Feed::over_contour`]).
    Feeds(Vec<FeedPiece>),
}

/// A block with its want.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    /// What it wants.
    pub want: Want,
    /// Its first feed move.
    pub first: Option<MoveId>,
    /// Executed several times.
    pub repeated: bool,
    /// The F word its moves run at.
    pub word: Option<(BlockId, Span)>,
}

/// The plan of every block.
pub fn plan(program: &Program, toolpath: &Toolpath, schedule: &Schedule, job: &Job) -> Vec<Plan> {
    let frozen = freezes(program, toolpath, job);
    let mut plans = vec![Plan::default(); program.len()];
    let shared = shared_feeds(toolpath, &schedule.pieces);
    let mut next = 0;
    for (id, motion) in toolpath.iter_moves() {
        let first = next;
        next += schedule.pieces[first..].iter().take_while(|piece| piece.move_id == id).count();
        let Some(plan) = plans.get_mut(motion.block.ix()) else { continue };
        plan.repeated |= motion.instance > 0;
        if motion.kind == MoveKind::Rapid {
            continue;
        }
        plan.first = plan.first.or(Some(id));
        plan.word = motion.feed.word;
        let length_mm = motion.curve().length();
        if let Some(why) = frozen[id.ix()] {
            plan.want = Want::Keep(why.why());
        } else if length_mm > 0.0 || first < next {
            let common = motion.shared.and_then(|number| shared.get(number as usize).copied().flatten());
            let in_first = toolpath.moves[plan.first.unwrap_or(id).ix()].feed.over_contour;
            let pieces = &schedule.pieces[first..next];
            let of_first: Vec<FeedPiece> =
                pieces.iter().map(|piece| times(piece, in_first / motion.feed.over_contour)).collect();
            let common = common.map(|piece| times(&piece, in_first));
            add(plan, motion, if tile(pieces, length_mm) { &of_first } else { &[] }, common);
        }
    }
    exclude(&mut plans[..program.own_len()], job);
    plans
}

/// The lowest F of the moves of each shared number, as a feed along the contour.
fn shared_feeds(toolpath: &Toolpath, pieces: &[FeedPiece]) -> Vec<Option<FeedPiece>> {
    let mut least: Vec<Option<FeedPiece>> = Vec::new();
    for piece in pieces {
        let motion = &toolpath.moves[piece.move_id.ix()];
        let Some(number) = motion.shared else { continue };
        let (index, piece) = (number as usize, times(piece, 1.0 / motion.feed.over_contour));
        if least.len() <= index {
            least.resize(index + 1, None);
        }
        least[index] = lowest(&[least[index].unwrap_or(piece), piece]);
    }
    least
}

/// The same piece where the tool centre is so many times as fast at the same F.
fn times(piece: &FeedPiece, ratio: f64) -> FeedPiece {
    FeedPiece { feed_mm_s: piece.feed_mm_s * ratio, ..*piece }
}

/// The piece with the lowest feed, for the whole block.
fn lowest(pieces: &[FeedPiece]) -> Option<FeedPiece> {
    let least = pieces.iter().copied().reduce(|a, b| if b.feed_mm_s < a.feed_mm_s { b } else { a });
    least.map(|piece| FeedPiece { to_mm: f64::INFINITY, ..piece })
}

fn add(plan: &mut Plan, motion: &Move, pieces: &[FeedPiece], common: Option<FeedPiece>) {
    if let Some(why) = unwritable(motion, pieces) {
        plan.want = Want::Keep(why);
    }
    let own = match common {
        None if motion.splittable => pieces.to_vec(),
        None => lowest(pieces).into_iter().collect(),
        Some(piece) => vec![piece],
    };
    match &mut plan.want {
        Want::Keep(_) => {}
        Want::Feeds(before) => {
            before.extend(own);
            *before = lowest(before).into_iter().collect();
        }
        want @ Want::Nothing => *want = Want::Feeds(own),
    }
}

/// Why these pieces cannot be written as feeds.
fn unwritable(motion: &Move, pieces: &[FeedPiece]) -> Option<&'static str> {
    let known = |piece: &FeedPiece| piece.feed_mm_s > 0.0 && piece.feed_mm_s.is_finite();
    if pieces.is_empty() {
        Some("the pieces it was scheduled in do not add up to its path: please report it")
    } else if pieces.iter().all(known) {
        None
    } else if !(motion.feed.mm_s > 0.0 && motion.feed.mm_s.is_finite()) {
        Some("no feed above zero is in force in it")
    } else {
        Some("no feed above zero meets its limits")
    }
}

/// Do the pieces cover the move from end to end?
fn tile(pieces: &[FeedPiece], length_mm: f64) -> bool {
    let slack = 1e-6 * (1.0 + length_mm);
    let joined = pieces.windows(2).all(|pair| (pair[0].to_mm - pair[1].from_mm).abs() <= slack);
    let ends = pieces.first().is_some_and(|p| p.from_mm.abs() <= slack)
        && pieces.last().is_some_and(|p| (p.to_mm - length_mm).abs() <= slack);
    joined && ends
}

fn exclude(plans: &mut [Plan], job: &Job) {
    for &(first, last) in &job.output.exclude {
        let range = (first.max(1) as usize - 1).min(plans.len())..(last as usize).min(plans.len());
        for plan in plans.get_mut(range).unwrap_or_default() {
            plan.want = Want::Keep(Freeze::Excluded.why());
        }
    }
}
