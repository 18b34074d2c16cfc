//! `stepover`: the feeds along planned passes. In: a program at its highest feed, its stock, a reference force. Out: the program with feeds at
//! which that force is kept.
//!
//! The engagement of the passes is simulated and not taken from the plan, which knows it only roughly where walls rise ahead of the tool or two
//! passes join. The ordinary schedule chooses the feeds, so that corners, axes and power are respected too. Its stations are up to a millimetre
//! long. The text is therefore simulated once more with those of the check ([`Simulated`]), and where one of them has a force above the
//! reference, the feed of its block is lowered to what keeps it. As in the schedule, that may be less than the lowest feed of the setup, or
//! else a fifth of the highest, but where it would be less than [`LEAST`] of that the block runs at that lowest feed.

use super::{JobError, Keep, ROUNDS, Task, Wanted, Watch, optimize};
use crate::engage;
use crate::finish::stepover::check::{HELD, Simulated, with_saved_stock};
use crate::force::Cap;
use crate::machine::limits::FEED_CHANGE_MIN;
use crate::machine::{Annotate, Job, LimitKind};
use crate::nc::{self, Dialect};
use crate::path::Vec3;
use crate::rewrite;
use crate::schedule::caps::LEAST;
use crate::schedule::{FeedPiece, Schedule, as_programmed};
use crate::stock::{Piece, saved};
use std::path::Path;

/// The text with feeds that keep to a force, N.
pub fn at_reference_force(
    text: &str,
    piece: &Piece,
    (job, dialect, reference_n): (&Job, Dialect, f64),
    clock: &dyn Fn() -> f64,
) -> Result<String, JobError> {
    let mut job = with_saved_stock(job);
    job.limits.force_xy_n = Some(reference_n);
    for tool in &mut job.tools {
        tool.limits.force_xy_n = None;
    }
    (job.output.annotate, job.output.marked) = (Annotate::None, false);
    let bytes = saved::to_bytes(piece, Vec3::zeros());
    let load = |_: &Path| Ok(bytes.clone());
    let watch = Watch {
        progress: &|_, _| (),
        clock,
        subprograms: &|_| None,
        engage: engage::Options {
            cell_mm: Some(piece.field.cell[0].max(piece.field.cell[1])),
            loader: Some(&load),
            ..engage::Options::default()
        },
        keep: Keep::default(),
    };
    let program = nc::parse(text.as_bytes().to_vec(), Some(dialect));
    let task = Task { program, job, assumptions: Vec::new(), wanted: Wanted::default() };
    let run = optimize(task, &watch)?;
    let top_mm_s = run.before.iter().map(|piece| piece.feed_mm_s).fold(0.0, f64::max);
    let asked_mm_s = run.job.limits.feed_min_mm_s.unwrap_or(FEED_CHANGE_MIN * top_mm_s);
    let written = run.written.map_or_else(|| text.as_bytes().to_vec(), |written| written.bytes);
    let simulated = Simulated::new(&String::from_utf8_lossy(&written), dialect, &run.job, piece)?;
    let bytes = lowered(&simulated, reference_n, asked_mm_s.min(top_mm_s)).unwrap_or(written);
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The text with the feeds of blocks lowered in which a force is above the reference; `None`: none is lowered.
/// Lower feeds may wear a tool more, so that they are lowered again until all is held.
fn lowered(simulated: &Simulated, reference_n: f64, lowest_mm_s: f64) -> Option<Vec<u8>> {
    let Simulated { program, toolpath, job, .. } = simulated;
    let mut pieces = as_programmed(toolpath);
    let mut any = false;
    for _ in 0..ROUNDS {
        let mut next: Vec<FeedPiece> = pieces.clone();
        for (station, line) in simulated.cuts(&pieces) {
            let Ok(k) = pieces.binary_search_by_key(&station.move_id, |piece| piece.move_id) else { continue };
            let Some(line) = line else { continue };
            if line.loads(pieces[k].feed_mm_s).force_xy_peak_n <= HELD * reference_n {
                continue;
            }
            let cap_mm_s = match line.cap(LimitKind::ForceXy, reference_n) {
                Cap::Free => continue,
                Cap::Feed { feed_mm_s, .. } if feed_mm_s >= LEAST * lowest_mm_s => feed_mm_s,
                Cap::Feed { .. } | Cap::Unreachable => lowest_mm_s,
            };
            next[k].feed_mm_s = next[k].feed_mm_s.min(cap_mm_s);
        }
        if next == pieces {
            break;
        }
        (pieces, any) = (next, true);
    }
    let schedule = Schedule { pieces, ..Schedule::default() };
    any.then(|| rewrite::rewrite(program, toolpath, &schedule, job).bytes)
}
