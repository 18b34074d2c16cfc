//! Rewriting under test: random schedules, and what the written program must do.
#![allow(dead_code)] // each test file uses its own part of it

use feedwright::ids::MoveId;
use feedwright::machine::{Job, LimitKind};
use feedwright::nc::{self, Environment, MoveKind, Program, Toolpath};
use feedwright::rewrite::{self, Rewritten};
use feedwright::schedule::{FeedPiece, Schedule, as_programmed};

/// A job with a machine and nothing else of interest.
pub fn job() -> Job {
    let text = std::fs::read_to_string("programs/pocket.setup.toml").expect("the setup is there");
    feedwright::setup::load(&text, std::path::Path::new("programs")).expect("the setup is right").0
}

/// Surroundings that leave nothing open.
pub fn surroundings() -> Environment<'static> {
    Environment::default()
}

pub fn parse(text: &[u8], dialect: nc::Dialect) -> Program {
    nc::parse(text.to_vec(), Some(dialect))
}

/// What the program does, with what the text forbids marked.
pub fn toolpath(program: &Program, environment: &Environment<'_>, job: &Job) -> Toolpath {
    let mut toolpath = nc::interpret(program, environment);
    rewrite::freeze(program, &mut toolpath, job);
    toolpath
}

/// Every feed move in pieces: `cuts(move)` gives fractions of its length, `factor(move, piece)` the change of its feed.
pub fn schedule(
    toolpath: &Toolpath,
    cuts: impl Fn(usize) -> Vec<f64>,
    factor: impl Fn(usize, usize) -> f64,
) -> Schedule {
    let mut pieces = Vec::new();
    for (index, motion) in toolpath.moves.iter().enumerate().filter(|(_, motion)| motion.kind == MoveKind::Feed) {
        let length = motion.curve().length();
        let mut at: Vec<f64> = cuts(index).iter().map(|fraction| fraction * length).collect();
        if motion.freeze.is_some() || !motion.splittable {
            at.clear();
        }
        at.push(length);
        let mut from_mm = 0.0;
        for (piece, to_mm) in at.into_iter().enumerate() {
            let factor = if motion.freeze.is_some() { 1.0 } else { factor(index, piece) };
            let feed_mm_s = motion.feed.mm_s * factor;
            let move_id = MoveId(index as u32);
            pieces.push(FeedPiece {
                move_id,
                from_mm,
                to_mm,
                feed_mm_s,
                limit: LimitKind::Power,
                price_s: 0.0,
                used: None,
            });
            from_mm = to_mm;
        }
    }
    Schedule { pieces, ..Schedule::default() }
}

/// The schedule that changes nothing.
pub fn unchanged(toolpath: &Toolpath) -> Schedule {
    Schedule { pieces: as_programmed(toolpath), ..Schedule::default() }
}

/// Rewrites, proves, and checks every feed of the written program against the schedule; then rewrites the output with its
/// own feeds, which must change nothing.
pub fn check(
    program: &Program,
    environment: &Environment<'_>,
    schedule: &Schedule,
    job: &Job,
) -> Result<Rewritten, String> {
    let toolpath = toolpath(program, environment, job);
    let rewritten = rewrite::rewrite(program, &toolpath, schedule, job);
    let output = rewritten.read(program);
    let text = || String::from_utf8_lossy(&rewritten.bytes).into_owned();
    let proof = rewrite::verify(program, &output, environment);
    if !proof.holds() {
        return Err(format!("{:?}\n{}", proof.differences, text()));
    }
    let after = nc::interpret(&output, environment);
    // Where a number without a point may count hundredths of an inch, a feed is a whole number of them as the program writes it.
    let whole_inches = program.dialect().counts_feeds(toolpath.inch);
    let coarse_mm_s = if whole_inches { 25.4 / 60.0 } else { 0.1 / 60.0 + 25.4 * 0.01 / 60.0 + 1.0 / 60.0 };
    feeds_hold(&toolpath, &after, schedule, coarse_mm_s).map_err(|why| format!("{why}\n{}", text()))?;
    let again = rewrite::rewrite(&output, &after, &unchanged(&after), job);
    if again.bytes != rewritten.bytes || again.files != rewritten.files {
        return Err(format!("a second run changes it:\n{}\n---\n{}", text(), String::from_utf8_lossy(&again.bytes)));
    }
    Ok(rewritten)
}

/// Every stretch of the written path runs at most at the feed asked for there, and at not much less unless the block could
/// not be cut; frozen moves run at the feed they had.
fn feeds_hold(before: &Toolpath, after: &Toolpath, schedule: &Schedule, coarse_mm_s: f64) -> Result<(), String> {
    let mut rest = after.moves.iter();
    let mut pieces = schedule.pieces.as_slice();
    for (index, whole) in before.moves.iter().enumerate() {
        let mine = pieces.iter().take_while(|piece| piece.move_id.ix() == index).count();
        let (asked, later) = pieces.split_at(mine);
        pieces = later;
        let length = whole.curve().length();
        let mut from = 0.0;
        loop {
            let part = rest.next().ok_or("motions are missing")?;
            let to = if (part.curve().to() - whole.curve().to()).norm() < 1e-6 {
                length
            } else {
                from + part.curve().length()
            };
            if whole.kind == MoveKind::Feed {
                // A block of several motions (a corner of the offset path is one) has the lowest feed of all of them.
                let beside = [index.wrapping_sub(1), index + 1].map(|k| before.moves.get(k).map(|other| other.block));
                let alone = !beside.contains(&Some(whole.block));
                feed_holds(whole, part.feed.mm_s, asked, (from, to), alone, coarse_mm_s)
                    .map_err(|why| format!("line {} → {}: {why}", whole.line, part.line))?;
            }
            from = to;
            if to >= length {
                break;
            }
        }
    }
    Ok(())
}

fn feed_holds(
    whole: &nc::Move,
    feed: f64,
    asked: &[FeedPiece],
    (from, to): (f64, f64),
    alone: bool,
    coarse_mm_s: f64,
) -> Result<(), String> {
    let same = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b.abs();
    if whole.freeze.is_some() {
        return if same(feed, whole.feed.mm_s) { Ok(()) } else { Err(format!("a frozen move runs at {feed} mm/s")) };
    }
    let inside = asked.iter().filter(|piece| piece.from_mm < to - 0.1 && piece.to_mm > from + 0.1 || asked.len() == 1);
    let least = inside.map(|piece| piece.feed_mm_s).fold(f64::INFINITY, f64::min);
    if least.is_infinite() || same(feed, whole.feed.mm_s) && feed <= least * (1.0 + 1e-9) {
        return Ok(());
    }
    let all = asked.iter().map(|piece| piece.feed_mm_s).fold(f64::INFINITY, f64::min);
    if feed > least * (1.0 + 1e-9) {
        Err(format!("{feed} mm/s where {least} was asked for"))
    } else if feed < all - coarse_mm_s - 0.01 * all && whole.shared.is_none() && alone {
        Err(format!("{feed} mm/s where {all} was possible everywhere"))
    } else {
        Ok(())
    }
}
