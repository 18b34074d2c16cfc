//! What each block of text wants: nothing, its original feed, or new feeds. In: the moves, why some must keep their feed, and
//! the schedule's pieces. Out: a want for every block, with everything doubtful turned into "keep".

use crate::diag::Span;
use crate::ids::{BlockId, MoveId};
use crate::machine::{Job, LimitKind};
use crate::nc::{Freeze, Move, MoveKind, Program, Toolpath};
use crate::schedule::{FeedPiece, Schedule};

use super::freeze::freezes;

/// One feed on one stretch of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Where it ends, mm along the move.
    pub to_mm: f64,
    /// Feed, mm/s.
    pub feed_mm_s: f64,
    /// What bounds it.
    pub limit: LimitKind,
}

/// What a block wants.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Want {
    /// No feed motion: nothing.
    #[default]
    Nothing,
    /// Its bytes and the feed it was written for; why.
    Keep(&'static str),
    /// These feeds, in order along its move.
    Feeds(Vec<Piece>),
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
    let mut rest = schedule.pieces.as_slice();
    for (id, motion) in toolpath.iter_moves() {
        let mine = rest.iter().take_while(|piece| piece.move_id == id).count();
        let (pieces, after) = rest.split_at(mine);
        rest = after;
        let Some(plan) = plans.get_mut(motion.block.ix()) else { continue };
        plan.repeated |= motion.instance > 0;
        if motion.kind == MoveKind::Rapid {
            continue;
        }
        plan.first = plan.first.or(Some(id));
        plan.word = motion.feed.word;
        let common = motion.shared.and_then(|number| shared.get(number as usize).copied().flatten());
        add(plan, motion, frozen[id.ix()], pieces, common);
    }
    exclude(&mut plans, job);
    plans
}

/// The lowest feed of the moves of each shared number.
fn shared_feeds(toolpath: &Toolpath, pieces: &[FeedPiece]) -> Vec<Option<Piece>> {
    let mut least: Vec<Option<Piece>> = Vec::new();
    for piece in pieces {
        let Some(number) = toolpath.moves[piece.move_id.ix()].shared else { continue };
        let index = number as usize;
        if least.len() <= index {
            least.resize(index + 1, None);
        }
        least[index] = Some(lower(least[index], piece));
    }
    least
}

fn lower(known: Option<Piece>, piece: &FeedPiece) -> Piece {
    let new = Piece { to_mm: f64::INFINITY, feed_mm_s: piece.feed_mm_s, limit: piece.limit };
    known.filter(|known| known.feed_mm_s <= new.feed_mm_s).unwrap_or(new)
}

fn add(plan: &mut Plan, motion: &Move, frozen: Option<Freeze>, pieces: &[FeedPiece], common: Option<Piece>) {
    let length = motion.curve.length();
    if let Want::Keep(_) = plan.want {
        return;
    }
    if let Some(why) = frozen {
        plan.want = Want::Keep(why.why());
        return;
    }
    if length == 0.0 && pieces.is_empty() {
        return;
    }
    if !tile(pieces, length) || pieces.iter().any(|piece| !(piece.feed_mm_s > 0.0 && piece.feed_mm_s.is_finite())) {
        plan.want = Want::Keep("the schedule says nothing about it");
        return;
    }
    let own = match common {
        Some(piece) => vec![piece],
        None if motion.splittable => {
            pieces.iter().map(|p| Piece { to_mm: p.to_mm, feed_mm_s: p.feed_mm_s, limit: p.limit }).collect()
        }
        None => vec![pieces[1..].iter().fold(lower(None, &pieces[0]), |least, piece| lower(Some(least), piece))],
    };
    match &mut plan.want {
        Want::Feeds(before) => {
            before.extend(own);
            let least = before.iter().copied().reduce(|a, b| if b.feed_mm_s < a.feed_mm_s { b } else { a });
            *before = least.into_iter().map(|piece| Piece { to_mm: f64::INFINITY, ..piece }).collect();
        }
        want => *want = Want::Feeds(own),
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
