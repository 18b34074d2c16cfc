//! Straight motions, and what every motion leaves in the toolpath.

use std::sync::Arc;

use super::Run;
use super::line::Line;
use super::state::{Modal, Motion};
use crate::diag::Severity;
use crate::ids::BlockId;
use crate::nc::doubt::Doubt;
use crate::nc::toolpath::{Feed, FeedMode, Freeze, Move, MoveKind, State};
use crate::path::{Curve, Vec3};

const AXES: [u8; 3] = *b"XYZ";
const ROTARY: [u8; 3] = *b"ABC";
/// Rounding of sums of coordinates, mm.
const SAME_MM: f64 = 1e-9;

impl Run<'_> {
    /// The motion of a block: the one it states, or the modal one when it has axis words.
    pub(super) fn motion(&mut self, line: &Line, machine: bool, stated: bool) {
        let arc = matches!(self.modal.motion, Motion::Clockwise | Motion::CounterClockwise);
        let straight = matches!(self.modal.motion, Motion::Rapid | Motion::Feed);
        let axes = line.has_any(b"XYZABC")
            || (arc && line.has_any(b"IJKR"))
            || (stated && straight)
            || (stated && line.has(b'R'));
        if !axes {
            return;
        }
        let turned = self.rotary_words(line);
        if !machine {
            self.offset_in_use();
        }
        let feeding = matches!(self.modal.motion, Motion::Feed | Motion::Clockwise | Motion::CounterClockwise);
        self.warn_of_rotary(line, turned, feeding);
        if feeding && self.modal.feed_mode == FeedMode::InverseTime && !line.has(b'F') {
            let span = self.source.program().span(self.block);
            self.not_understood("nc::inverse-time", span, "with G93 every block needs its own F", "write its F");
        }
        match self.modal.motion {
            Motion::None => {
                let span = line.span(b'X').or(line.span(b'Y')).or(line.span(b'Z')).unwrap_or_default();
                self.not_understood("nc::no-motion", span, "axis words without a motion in force", "write G0 or G1");
            }
            _ if machine => self.machine_move(line),
            Motion::Rapid => {
                let target = self.target(line);
                self.line_to(MoveKind::Rapid, target);
            }
            Motion::Feed => self.feed_line(line, turned),
            Motion::Clockwise | Motion::CounterClockwise => self.arc(line, turned),
            Motion::Synchronised => self.frozen_line(line, Freeze::Synchronised),
            Motion::RigidTap => self.rigid_tap(line),
            Motion::Probe => self.probe(line),
            Motion::Cycle(code) => self.cycle(line, code),
        }
    }

    /// Says once per range that a rotary axis turns in a cut.
    fn warn_of_rotary(&mut self, line: &Line, turned: bool, feeding: bool) {
        let range = turned && feeding;
        let span = ROTARY.iter().find_map(|&letter| line.span(letter)).unwrap_or_default();
        if range && !self.rotary_range {
            let text = "a rotary axis turns in this motion: feeds are kept until it rests";
            self.say("nc::rotary", Severity::Warning, span, text, "");
        }
        self.rotary_range = range;
    }

    fn feed_line(&mut self, line: &Line, turned: bool) {
        self.freeze_feed(turned);
        let target = self.target(line);
        self.line_to(MoveKind::Feed, target);
    }

    /// The feed stays where a rotary axis turns, and under G63 as a mode, where it belongs to a pitch.
    pub(super) fn freeze_feed(&mut self, turned: bool) {
        if turned {
            self.freeze = self.freeze.or(Some(Freeze::Rotary));
        }
        if self.modal.tapping {
            self.freeze = self.freeze.or(Some(Freeze::Synchronised));
        }
    }

    /// G33.1 taps and comes back to where it began, the spindle turning the other way.
    fn rigid_tap(&mut self, line: &Line) {
        let (start, turning) = (self.programmed, self.modal.turning);
        self.frozen_line(line, Freeze::Synchronised);
        self.turn(-turning);
        self.line_to(MoveKind::Feed, start);
        self.turn(turning);
    }

    /// A probing move ends where it touches: its axes may be anywhere on the way.
    fn probe(&mut self, line: &Line) {
        self.frozen_line(line, Freeze::Probe);
        self.probed = true;
        for (axis, letter) in AXES.into_iter().enumerate() {
            self.elsewhere[axis] |= line.has(letter);
        }
    }

    fn frozen_line(&mut self, line: &Line, why: Freeze) {
        self.freeze = Some(why);
        let target = self.target(line);
        self.line_to(MoveKind::Feed, target);
    }

    /// Takes A, B, C in; true when one of them turns.
    fn rotary_words(&mut self, line: &Line) -> bool {
        let mut turned = false;
        let Some(place) = ROTARY.iter().find_map(|&letter| line.span(letter)) else { return false };
        for (axis, letter) in ROTARY.into_iter().enumerate() {
            if let Some(value) = line.get(letter) {
                let to = if self.modal.incremental { self.rotary[axis] + value } else { value };
                turned |= to != self.rotary[axis];
                self.rotary[axis] = to;
            }
        }
        // The part as the setup has it stands at 0, where every control begins.
        if self.rotary != [0.0; 3] || self.rotary_lost {
            self.doubt(Doubt::RotaryAxis, place);
        } else {
            self.certain(Doubt::RotaryAxis);
        }
        turned
    }

    /// A rotary axis goes to its reference point: at which angle of the part that is, is not known until it is commanded to an
    /// absolute one.
    pub(super) fn rotary_home(&mut self, line: &Line) {
        for (axis, letter) in ROTARY.into_iter().enumerate() {
            if let Some(place) = line.span(letter) {
                self.rotary[axis] = f64::NAN;
                self.doubt(Doubt::RotaryAxis, place);
            }
        }
    }

    /// Programmed end point of the block, mm.
    pub(super) fn target(&mut self, line: &Line) -> Vec3 {
        let unit = self.modal.unit_mm();
        let mut target = self.programmed;
        for (axis, letter) in AXES.into_iter().enumerate() {
            let Some(value) = line.get(letter) else { continue };
            let incremental =
                if self.modal.incremental { !line.is_absolute(letter) } else { line.is_incremental(letter) };
            if !self.known[axis] {
                self.known[axis] = true;
                self.splittable = false;
                if incremental {
                    self.assume_zero(axis);
                    target[axis] = self.programmed[axis];
                }
            }
            target[axis] = if incremental { target[axis] + value * unit } else { value * unit };
        }
        if self.polar.is_some() { self.polar_target(line, target) } else { target }
    }

    /// G16: the first axis of the plane is a radius about the zero (about the position with G91), the second an angle.
    fn polar_target(&mut self, line: &Line, mut target: Vec3) -> Vec3 {
        let (a, b, _) = self.modal.plane.axes();
        let (mut radius, mut angle) = self.polar.unwrap_or_default();
        if !line.has(AXES[a]) && !line.has(AXES[b]) {
            return target;
        }
        let increment = |value: f64, before: f64| if self.modal.incremental { before + value } else { value };
        radius = line.get(AXES[a]).map_or(radius, |value| value * self.modal.unit_mm());
        angle = line.get(AXES[b]).map_or(angle, |value| increment(value.to_radians(), angle));
        self.polar = Some((radius, angle));
        let centre = if self.modal.incremental { [self.programmed[a], self.programmed[b]] } else { [0.0; 2] };
        target[a] = centre[0] + radius * angle.cos();
        target[b] = centre[1] + radius * angle.sin();
        target
    }

    /// An axis first commanded by an increment begins at zero.
    fn assume_zero(&mut self, axis: usize) {
        self.programmed[axis] = 0.0;
        self.tool = self.frame.apply(self.programmed);
    }

    fn machine_move(&mut self, line: &Line) {
        self.approach_without_contour();
        let unit = self.modal.unit_mm();
        let origin = self.env.origin(self.modal.wcs);
        // Where compensation has ended, the tool comes back to the contour with this motion.
        let mut to = if self.compensation.is_none() { self.frame.apply(self.programmed) } else { self.tool };
        for (axis, letter) in AXES.into_iter().enumerate() {
            let Some(value) = line.get(letter) else { continue };
            if self.env.home_mm.is_some() {
                to[axis] = value * unit - origin[axis];
            } else if axis == 2 {
                to.z = to.z.max(self.env.clear_z_mm);
                self.elsewhere[2] = true;
            } else {
                self.elsewhere[axis] = true;
            }
        }
        let kind = if self.modal.motion == Motion::Rapid { MoveKind::Rapid } else { MoveKind::Feed };
        self.tool_to(kind, Curve::Line { from: self.tool, to });
        self.programmed = self.frame.invert(self.tool);
    }

    /// Goes straight to a programmed point; what was asked for before it, an approach or a corner, is made first.
    pub(super) fn line_to(&mut self, kind: MoveKind, target: Vec3) {
        if self.approach.is_some() {
            self.approach_along(kind, target - self.programmed);
        }
        if self.corner.is_some() {
            self.work_corner(kind, target);
        }
        self.keep_leg(kind, target);
        self.straight_to(kind, target);
    }

    /// Goes straight to a programmed point.
    pub(super) fn straight_to(&mut self, kind: MoveKind, target: Vec3) {
        if self.compensated(kind, target, None) {
            return;
        }
        let (from, to) = (self.frame.apply(self.programmed), self.frame.apply(target));
        self.contour_mm = ((from - self.tool).norm() > SAME_MM).then(|| (to - from).norm());
        self.programmed = target;
        self.tool_to(kind, Curve::Line { from: self.tool, to });
    }

    /// Leaves a motion of the tool in the toolpath.
    pub(super) fn tool_to(&mut self, kind: MoveKind, curve: Curve) {
        let motion = self.motion_of(kind, curve);
        self.out.moves.push(motion);
    }

    /// The motion the block makes along a curve.
    pub(super) fn motion_of(&mut self, kind: MoveKind, curve: Curve) -> Move {
        let (feed, freeze) = match kind {
            MoveKind::Rapid => (Feed { mode: self.modal.feed_mode, mm_s: 0.0, word: None }, self.freeze),
            MoveKind::Feed => {
                let length_mm = self.contour_mm.unwrap_or_else(|| curve.length());
                (self.modal.feed_of(length_mm), self.freeze.or_else(|| self.feed_freeze()))
            }
        };
        if self.out.moves.is_empty() {
            self.out.inch = self.modal.inch;
        }
        self.tool = curve.to();
        let main = self.main_block();
        let block = self.linked_at().map_or(main, |(first, _)| BlockId(first + self.block.0));
        let state = self.state(kind, feed);
        let mut motion = Move::new(block, kind, curve, state);
        motion.line = main.0 + 1;
        motion.instance = self.counts.get(block.ix()).map_or(0, |count| count.saturating_sub(1));
        motion.freeze = freeze;
        motion.splittable = self.splittable;
        motion
    }

    /// The state of a move made now: the one of the last move of its kind, unless something changed.
    fn state(&mut self, kind: MoveKind, feed: Feed) -> Arc<State> {
        let Modal { tool, wcs, path_mode, .. } = self.modal;
        let now = State {
            feed,
            spin: self.modal.spin(),
            tool,
            wcs,
            path_mode,
            shared: None,
            compensated: self.under_compensation,
            cycle: self.in_cycle,
        };
        let last = &mut self.states[usize::from(kind == MoveKind::Feed)];
        match last {
            Some(state) if **state == now => state.clone(),
            _ => last.insert(Arc::new(now)).clone(),
        }
    }
}
