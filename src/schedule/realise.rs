//! The time that a program takes on the machine. In: toolpath, commanded feeds, machine. Out: [`Realised`].
//!
//! The model of the control ([`super::control`]) looks ahead, changes speed at constant acceleration between corners (rounded within the
//! path tolerance in force there), stops at exact stops, dwells, tool changes and changes of spindle speed, and takes at least its
//! block time for each block.

use super::control::{Control, in_whole_periods, plan, seconds_of_moves};
use super::exact_pass::exact_pass;
use super::first_period::leg_times;
use super::problem::{FeedPiece, Realised};
use crate::ids::MoveId;
use crate::machine::Machine;
use crate::nc::{Event, MoveKind, Spin, Toolpath};

/// Time that the program takes with these feeds (pieces in order of execution, as [`as_programmed`] gives them).
pub fn realise(toolpath: &Toolpath, feeds: &[FeedPiece], machine: &Machine) -> Realised {
    let ranges = pieces_of_moves(feeds, toolpath.moves.len());
    realise_by(toolpath, machine, &Control::of(machine), &mut |id, pieces| {
        let range = &ranges[id.ix()];
        pieces.extend_from_slice(&feeds[range.start as usize..range.end as usize]);
    })
}

/// The same on a given control. `pieces_of` gives the pieces of a feed move.
pub fn realise_by(
    toolpath: &Toolpath,
    machine: &Machine,
    control: &Control,
    pieces_of: &mut dyn FnMut(MoveId, &mut Vec<FeedPiece>),
) -> Realised {
    let plan = plan(toolpath, machine, control, pieces_of);
    let b = exact_pass(&plan.chain);
    let is_rapid = |id: MoveId| toolpath.moves[id.ix()].kind == MoveKind::Rapid;
    let leg_s = in_whole_periods(&plan, leg_times(&plan, b, control, is_rapid));
    let move_s = seconds_of_moves(&plan, leg_s.into_iter(), toolpath.moves.len());
    let by_cause = causes(toolpath, machine, &move_s);
    Realised { total_s: by_cause.iter().map(|(_, seconds)| seconds).sum(), move_s, by_cause }
}

/// The feeds as the program gives them: one piece per feed move.
pub fn as_programmed(toolpath: &Toolpath) -> Vec<FeedPiece> {
    let feed = |(index, motion): (usize, &crate::nc::Move)| {
        let whole_mm = [0.0, motion.curve().length()];
        (motion.kind == MoveKind::Feed).then(|| FeedPiece::commanded(MoveId(index as u32), whole_mm, motion.feed.mm_s))
    };
    toolpath.moves.iter().enumerate().filter_map(feed).collect()
}

/// Range of pieces of each move, by move index.
pub fn pieces_of_moves(feeds: &[FeedPiece], moves: usize) -> Vec<std::ops::Range<u32>> {
    let mut ranges = vec![0..0; moves];
    for (i, piece) in feeds.iter().enumerate() {
        let range: &mut std::ops::Range<u32> = &mut ranges[piece.move_id.ix()];
        if range.start == range.end {
            range.start = i as u32;
        }
        range.end = i as u32 + 1;
    }
    ranges
}

fn causes(toolpath: &Toolpath, machine: &Machine, move_s: &[f64]) -> Vec<(&'static str, f64)> {
    let (mut feed, mut rapid, mut dwell, mut change, mut run_up) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut spin, mut tool) = (Spin::default(), None);
    for event in toolpath.events() {
        match &event {
            Event::Move(id) => match toolpath.moves[id.ix()].kind {
                MoveKind::Feed => feed += move_s[id.ix()],
                MoveKind::Rapid => rapid += move_s[id.ix()],
            },
            Event::Dwell { seconds, .. } => dwell += seconds,
            Event::Tool { number, .. } => {
                if tool.replace(*number) != Some(*number) {
                    change += machine.tool_change_time_s;
                }
            }
            Event::Spindle { spin: to, .. } => {
                if *to != spin && to.rps > 0.0 {
                    run_up += machine.spindle.runup_time_s;
                }
                spin = *to;
            }
            Event::Stop { .. } => {}
        }
    }
    vec![("feed", feed), ("rapid", rapid), ("dwell", dwell), ("tool change", change), ("spindle run-up", run_up)]
}
