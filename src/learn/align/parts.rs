//! A log of several parts made one after another: what belongs to the first. In: log, timeline. Out: the log up to the end of the first
//! part, where the program is run once more after it.
//!
//! A program that was run again passes its path again. The log is followed to the end of the program; if what comes after it lasts
//! long enough for another run, and follows the path from near its beginning to near its end, it is another part.

use crate::learn::align::by_position;
use crate::learn::log::Log;
use crate::learn::program::timeline::Timeline;

/// Length of a log over that of its program from which on another part is looked for: a slow machine makes one part longer, not its path.
const LONGER: f64 = 1.4;
/// Share of the program's time at which a part counts as done, and share of it that another part must cover.
const DONE: f64 = 0.98;
const COVERED: f64 = 0.5;
/// Most places off the path in a part that was made.
const OFF: f64 = 0.2;

/// Leaves the first part in the log, and says how long it is.
pub fn first_part(log: &mut Log, timeline: &Timeline) {
    let total_s = timeline.total_s();
    let length_s = log.time_s.last().copied().unwrap_or(0.0);
    if length_s < LONGER * total_s {
        return;
    }
    let Some(aligned) = by_position(log, timeline) else { return };
    let Some(end) = aligned.program_s.iter().position(|t| *t >= DONE * total_s) else { return };
    let rest = log.part(end..log.time_s.len());
    let Some(again) = by_position(&rest, timeline).filter(|again| again.misfit < OFF) else { return };
    let placed = || again.program_s.iter().copied().filter(|t| t.is_finite());
    let covered = placed().fold(0.0, f64::max) - placed().fold(total_s, f64::min);
    if covered < COVERED * total_s {
        return;
    }
    let end_s = log.time_s[end];
    *log = log.part(0..end);
    log.warnings.push(format!(
        "the log holds more than one part: the program is run again after {end_s:.0} s of {length_s:.0} s; the first part alone is used"
    ));
}
