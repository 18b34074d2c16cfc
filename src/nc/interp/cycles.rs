//! Canned cycles G73, G74, G76, G81–G89 in the three planes. In: the words of a block. Out: the motions that the cycle makes.
//!
//! The drilling axis is the normal of the plane. The initial level is where the tool stood when cycles came into force; with G98 a
//! cycle returns there (or to R, if that is higher), with G99 to R. With G91, R counts from the initial level and the depth
//! from R; whether a level that was given under G90 is kept under G91 is a property of the control. Words stay in force until the cycle is cancelled.

use super::interpreter::{Family, Interpreter};
use super::state::Cycle;
use super::words::Words;
use crate::diag::Severity;
use crate::nc::toolpath::{Event, FeedMode, Freeze, MoveKind, Spin};
use crate::path::Vec3;

/// What G73 withdraws, and how far above the last depth G83 slows down, mm (0.010 inch, as LinuxCNC has it).
const PECK_CLEARANCE_MM: f64 = 0.254;
/// Most pecks or repeats of one block that are followed.
const MAX_REPEATS: f64 = 10_000.0;

impl<F: Family> Interpreter<'_, F> {
    /// The cycle of a block, once or several times.
    pub(crate) fn cycle(&mut self, words: &Words, code: u16) {
        let place = words.g.last().map_or_else(|| self.flow.source.program().span(self.block.id), |g| g.1);
        if code == 760 && self.dialect().g76_cuts_threads {
            self.block.freeze = Some(Freeze::Synchronised);
            self.cuts_unseen();
            self.say("nc::threading", Severity::Warning, place, "the G76 threading cycle is kept, not simulated", "");
            return;
        }
        if self.modal.polar.is_some() && self.modal.incremental && self.cycle_repeats(words, code) != 1 {
            self.cuts_unseen();
            return self.misread(
                "nc::cycle",
                place,
                "holes repeated under G16 and G91 are not followed",
                "write each hole",
            );
        }
        let mut cycle = self.cycle_words(words);
        if self.dialect().r_plane_optional && cycle.depth.is_some() {
            // R may be left out: the plane is then the level the cycle began at (Haas Mill Operator's Manual, G81).
            cycle.retract = cycle.retract.or(Some(cycle.initial));
        }
        let (Some(_), Some(retract)) = (cycle.depth, cycle.retract) else {
            self.cuts_unseen();
            self.not_understood("nc::cycle", place, "the cycle has no depth or no R plane", "write Z and R");
            return;
        };
        self.block.freeze = self.block.freeze.or(match code {
            740 | 840 => Some(Freeze::Synchronised),
            730 | 810..=830 => None,
            _ => Some(Freeze::Cycle),
        });
        self.block.splittable = false;
        let (_, _, n) = self.modal.plane.axes();
        let level = if cycle.retract_is_step { retract + cycle.initial } else { retract };
        let mut hole = self.target(words);
        let step = hole - self.place.programmed;
        hole = self.place.programmed;
        if cycle.initial < level {
            hole[n] = level;
            self.line_to(MoveKind::Rapid, hole);
        }
        let repeats = self.cycle_repeats(words, code);
        for count in 0..repeats {
            for axis in (0..3).filter(|&axis| axis != n) {
                hole[axis] += if count == 0 || self.modal.incremental { step[axis] } else { 0.0 };
            }
            self.one_hole(cycle, code, hole, level);
        }
    }

    /// Takes the words of the block into the cycle in force.
    fn cycle_words(&mut self, words: &Words) -> Cycle {
        let (a, b, n) = self.modal.plane.axes();
        let unit = self.modal.unit_mm();
        let mut cycle = self.cycles.modal.unwrap_or(Cycle { initial: self.place.programmed[n], ..Cycle::default() });
        let mm = |letter: u8| words.get(letter).map(|value| value * unit);
        cycle.depth = mm(b"XYZ"[n]).or(cycle.depth);
        cycle.retract = mm(b'R').or(cycle.retract);
        let keeps = self.dialect().cycles_keep_levels;
        for (letter, is_step) in [(b"XYZ"[n], &mut cycle.depth_is_step), (b'R', &mut cycle.retract_is_step)] {
            if !keeps || words.has(letter) {
                *is_step = self.modal.incremental;
            }
        }
        cycle.peck = mm(b'Q').or(cycle.peck);
        cycle.top = mm(b"IJK"[n]).or(cycle.top);
        if let Some(seconds) = self.dwell_seconds(words, b'P') {
            cycle.dwell_s = seconds;
        }
        for (place, axis) in [a, b].into_iter().enumerate() {
            cycle.shift[place] = mm(b"IJK"[axis]).unwrap_or(cycle.shift[place]);
        }
        self.cycles.modal = Some(cycle);
        cycle
    }

    fn cycle_repeats(&mut self, words: &Words, code: u16) -> u64 {
        let k = if self.dialect().k_repeats && code != 870 { words.get(b'K') } else { None };
        let repeats = words.get(b'L').or(k).unwrap_or(1.0).max(0.0);
        if repeats > MAX_REPEATS {
            let span = words.span(b'L').or(words.span(b'K')).unwrap_or_default();
            self.not_understood("nc::cycle", span, "more than 10000 repeats are not followed", "");
        }
        repeats.min(MAX_REPEATS) as u64
    }

    /// One hole at `hole`, its rapid approach ending at `level`.
    pub(crate) fn one_hole(&mut self, cycle: Cycle, code: u16, hole: Vec3, level: f64) {
        self.cycles.in_hole = true;
        let turning = self.modal.turning;
        if matches!(code, 740 | 840) && turning == 0 && !self.as_linuxcnc() {
            // Rigid tapping starts the spindle itself.
            self.turn(if code == 840 { 1 } else { -1 });
        }
        self.motions_of_hole(cycle, code, hole, level);
        self.turn(turning);
        self.cycles.in_hole = false;
    }

    fn motions_of_hole(&mut self, cycle: Cycle, code: u16, mut hole: Vec3, level: f64) {
        if self.modal.feed_mode == FeedMode::InverseTime {
            let span = self.flow.source.program().span(self.block.id);
            let text = "a cycle has no feed in inverse time";
            self.not_understood("nc::inverse-time", span, text, "write G94 before it");
        }
        let (_, _, n) = self.modal.plane.axes();
        let clear = if self.modal.retract_to_r { level } else { level.max(cycle.initial) };
        let travel = if self.modal.retract_to_r { self.place.programmed[n] } else { clear };
        let z = cycle.depth.map_or(level, |z| if cycle.depth_is_step { level + z } else { z });
        hole[n] = travel;
        self.line_to(MoveKind::Rapid, hole);
        if travel != level {
            self.axial(MoveKind::Rapid, level);
        }
        match code {
            730 | 830 => self.peck(code == 830, cycle, level, z),
            870 => return self.back_bore(cycle, z, clear),
            _ => self.drill_to(z),
        }
        if matches!(code, 740 | 760 | 820 | 840 | 860 | 880 | 890) && (cycle.dwell_s > 0.0 || code == 820) {
            self.event(Event::Dwell { seconds: cycle.dwell_s, line: self.line_number() });
        }
        match code {
            740 | 840 => self.tap_out(level, clear),
            890 if self.as_linuxcnc() => self.drill_to(clear),
            850 | 890 => {
                self.drill_to(level);
                if clear != level {
                    self.axial(MoveKind::Rapid, clear);
                }
            }
            760 => self.shifted_out(cycle, clear),
            860 | 880 => self.spindle_stopped(|run| run.axial(MoveKind::Rapid, clear)),
            _ => self.axial(MoveKind::Rapid, clear),
        }
    }

    /// Straight along the drilling axis.
    fn axial(&mut self, kind: MoveKind, level: f64) {
        let (_, _, n) = self.modal.plane.axes();
        let mut target = self.place.programmed;
        target[n] = level;
        self.line_to(kind, target);
    }

    fn drill_to(&mut self, level: f64) {
        if let Some((block, _)) = self.modal.feed.word {
            self.cycles.driven.push((self.out.moves.len() as u32, block));
        }
        self.axial(MoveKind::Feed, level);
    }

    fn peck(&mut self, full: bool, cycle: Cycle, level: f64, z: f64) {
        let way = if z > level { 1.0 } else { -1.0 };
        let depth = (z - level).abs();
        let peck = match cycle.peck {
            Some(q) if q.abs() > 0.0 && depth / q.abs() <= MAX_REPEATS => q.abs(),
            _ => return self.drill_to(z),
        };
        let mut done = peck;
        while done < depth - 1e-9 {
            let at = level + way * done;
            self.drill_to(at);
            self.axial(MoveKind::Rapid, if full { level } else { at - way * PECK_CLEARANCE_MM });
            if full {
                self.axial(MoveKind::Rapid, at - way * PECK_CLEARANCE_MM);
            }
            done += peck;
        }
        self.drill_to(z);
    }

    /// Are cycles made as LinuxCNC makes them? There G84 and G89 come out at feed as far as the cycle returns; others go on at
    /// rapid from R.
    fn as_linuxcnc(&self) -> bool {
        self.dialect().cycles_out_at_feed
    }

    fn tap_out(&mut self, level: f64, clear: f64) {
        let turning = self.modal.turning;
        let out = if self.as_linuxcnc() { clear } else { level };
        self.turn(-turning);
        self.axial(MoveKind::Feed, out);
        self.turn(turning);
        if clear != out {
            self.axial(MoveKind::Rapid, clear);
        }
    }

    pub(crate) fn turn(&mut self, turning: i8) {
        let before = self.modal.spin();
        self.modal.turning = turning;
        let spin: Spin = self.modal.spin();
        if spin != before {
            self.event(Event::Spindle { spin, line: self.line_number() });
        }
    }

    fn spindle_stopped(&mut self, mut motion: impl FnMut(&mut Self)) {
        let turning = self.modal.turning;
        self.turn(0);
        motion(self);
        self.turn(turning);
    }

    /// Fine boring: the tool steps off the wall, goes out and steps back.
    fn shifted_out(&mut self, cycle: Cycle, clear: f64) {
        let (a, b, _) = self.modal.plane.axes();
        let mut aside = self.place.programmed;
        aside[a] += if cycle.shift == [0.0; 2] { cycle.peck.unwrap_or(0.0) } else { cycle.shift[0] };
        aside[b] += cycle.shift[1];
        let centre = self.place.programmed;
        self.spindle_stopped(|run| {
            run.line_to(MoveKind::Rapid, aside);
            run.axial(MoveKind::Rapid, clear);
            let back =
                Vec3::from_fn(|axis, _| if axis == a || axis == b { centre[axis] } else { run.place.programmed[axis] });
            run.line_to(MoveKind::Rapid, back);
        });
    }

    /// G87: aside, down, back to the centre, bore upwards to K, and the same way out.
    fn back_bore(&mut self, cycle: Cycle, z: f64, clear: f64) {
        let (a, b, _) = self.modal.plane.axes();
        let offset = if cycle.shift == [0.0; 2] { [cycle.peck.unwrap_or(0.0), 0.0] } else { cycle.shift };
        let step = |run: &mut Self, sign: f64| {
            let mut aside = run.place.programmed;
            aside[a] += sign * offset[0];
            aside[b] += sign * offset[1];
            run.line_to(MoveKind::Rapid, aside);
        };
        // LinuxCNC steps aside before it stops the spindle.
        let turning_aside = self.as_linuxcnc();
        if turning_aside {
            step(self, 1.0);
        }
        self.spindle_stopped(|run| {
            if !turning_aside {
                step(run, 1.0);
            }
            run.axial(MoveKind::Rapid, z);
            step(run, -1.0);
        });
        // K is a height, or with G91 counts from the bottom.
        if let Some(top) = cycle.top.map(|top| if self.modal.incremental { z + top } else { top }) {
            self.drill_to(top);
            self.drill_to(z);
        }
        self.spindle_stopped(|run| {
            step(run, 1.0);
            run.axial(MoveKind::Rapid, clear);
            step(run, -1.0);
        });
    }
}
