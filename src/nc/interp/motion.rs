//! Straight motions, and what all motions have in common. In: the words of a block. Out: a move in the toolpath, the tool at its end.

use std::sync::Arc;

use super::interpreter::{Family, Interpreter};
use super::state::{ArcFeed, FeedWord, Modal, Motion};
use super::words::Words;
use crate::diag::Severity;
use crate::ids::BlockId;
use crate::nc::doubt::Doubt;
use crate::nc::token::TokenKind;
use crate::nc::toolpath::{Feed, FeedMode, Freeze, Move, MoveKind, PathMode, State};
use crate::path::{Curve, Vec3};

const AXES: [u8; 3] = *b"XYZ";
const ROTARY: [u8; 3] = *b"ABC";
/// Rounding of sums of coordinates, mm.
const SAME_MM: f64 = 1e-9;
/// Two arcs about points no further apart have one centre, mm: it is worked out twice.
const ONE_CENTRE_MM: f64 = 1e-6;

impl<F: Family> Interpreter<'_, F> {
    /// The motion of a block: the one it states, or the modal one when it has axis words.
    pub(crate) fn motion(&mut self, words: &Words, machine: bool, stated: bool) {
        let arc = matches!(self.modal.motion, Motion::Clockwise | Motion::CounterClockwise);
        let straight = matches!(self.modal.motion, Motion::Rapid | Motion::Feed);
        let axes = words.has_any(b"XYZABC")
            || (arc && words.has_any(b"IJKR"))
            || (stated && straight)
            || (stated && words.has(b'R'));
        if !axes {
            if let (Motion::Cycle(_), Some(place)) = (self.modal.motion, words.span(b'R')) {
                self.misread(
                    "nc::cycle",
                    place,
                    "R alone: whether the cycle is made again is not known",
                    "name the place of the hole",
                );
            }
            return;
        }
        let turned = self.rotary_words(words);
        if !machine {
            if words.has_any(b"XYZABCIJKR") {
                // A bare G0 in the first line goes nowhere, in whatever offset.
                self.offset_in_use();
            }
            if self.modal.motion != Motion::Rapid {
                self.length_in_use(self.flow.source.program().span(self.block.id));
            }
        }
        let feeding = matches!(self.modal.motion, Motion::Feed | Motion::Clockwise | Motion::CounterClockwise);
        self.warn_of_rotary(words, turned, feeding);
        if feeding && self.modal.feed_mode == FeedMode::InverseTime && !words.has(b'F') {
            let span = self.flow.source.program().span(self.block.id);
            self.not_understood("nc::inverse-time", span, "with G93 every block needs its own F", "write its F");
        }
        match self.modal.motion {
            Motion::None => {
                let span = words.span(b'X').or(words.span(b'Y')).or(words.span(b'Z')).unwrap_or_default();
                self.not_understood("nc::no-motion", span, "axis words without a motion in force", "write G0 or G1");
            }
            _ if machine => self.machine_move(words),
            Motion::Rapid => {
                let target = self.target(words);
                self.line_to(MoveKind::Rapid, target);
            }
            Motion::Feed => self.feed_line(words, turned),
            Motion::Clockwise | Motion::CounterClockwise => self.arc(words, turned),
            Motion::Synchronised => self.frozen_line(words, Freeze::Synchronised),
            Motion::RigidTap => self.rigid_tap(words),
            Motion::Probe => self.probe(words),
            Motion::Cycle(code) => self.cycle(words, code),
        }
    }

    /// Warns of a rotary axis that turns in a cut, once until it rests.
    fn warn_of_rotary(&mut self, words: &Words, turned: bool, feeding: bool) {
        let range = turned && feeding;
        let span = ROTARY.iter().find_map(|&letter| words.span(letter)).unwrap_or_default();
        if range && !self.rotary.in_cut {
            let text = "a rotary axis turns in this motion: feeds are kept until it rests";
            self.say("nc::rotary", Severity::Warning, span, text, "");
        }
        self.rotary.in_cut = range;
    }

    fn feed_line(&mut self, words: &Words, turned: bool) {
        self.freeze_feed(turned);
        self.doubt_of_arc_words(words);
        let target = self.target(words);
        self.line_to(MoveKind::Feed, target);
    }

    /// A straight motion with I, J, K or R: a corner to some controls, nothing or an error to others. Beside G40 to G42 they are the direction
    /// in which compensation begins or ends.
    fn doubt_of_arc_words(&mut self, words: &Words) {
        let Some(letter) = b"IJKR".iter().find(|letter| words.has(**letter)) else { return };
        if words.g.iter().any(|(code, _)| (400..=422).contains(code)) {
            return;
        }
        let place = words.span(*letter).unwrap_or_default();
        self.doubt(Doubt::UnknownCode, place);
        let text = format!("{} does not belong to a straight motion", char::from(*letter));
        self.not_understood("nc::unknown-word", place, text, "its feed is kept; a corner is ,R or ,C");
    }

    /// The feed is kept where a rotary axis turns, and under G63 as a mode, where it belongs to a thread pitch.
    pub(crate) fn freeze_feed(&mut self, turned: bool) {
        if turned {
            self.block.freeze = self.block.freeze.or(Some(Freeze::Rotary));
        }
        if self.modal.tapping {
            self.block.freeze = self.block.freeze.or(Some(Freeze::Synchronised));
        }
    }

    /// G33.1 taps and comes back to where it began, the spindle turning the other way.
    fn rigid_tap(&mut self, words: &Words) {
        let (start, turning) = (self.place.programmed, self.modal.turning);
        self.frozen_line(words, Freeze::Synchronised);
        self.turn(-turning);
        self.line_to(MoveKind::Feed, start);
        self.turn(turning);
    }

    /// A probing move ends where it touches: its axes may be anywhere on the way.
    fn probe(&mut self, words: &Words) {
        self.frozen_line(words, Freeze::Probe);
        self.place.probed = true;
        for (axis, letter) in AXES.into_iter().enumerate() {
            self.place.elsewhere[axis] |= words.has(letter);
        }
    }

    fn frozen_line(&mut self, words: &Words, why: Freeze) {
        self.block.freeze = Some(why);
        let target = self.target(words);
        self.line_to(MoveKind::Feed, target);
    }

    /// Takes A, B, C in; true when one of them turns.
    fn rotary_words(&mut self, words: &Words) -> bool {
        let mut turned = false;
        let Some(place) = ROTARY.iter().find_map(|&letter| words.span(letter)) else { return false };
        for (axis, letter) in ROTARY.into_iter().enumerate() {
            if let Some(value) = words.get(letter) {
                let to = if self.modal.incremental { self.rotary.at[axis] + value } else { value };
                turned |= to != self.rotary.at[axis];
                self.rotary.at[axis] = to;
            }
        }
        // The setup describes the part with the rotary axes at 0.
        if self.rotary.at != [0.0; 3] || self.rotary.zero_lost {
            self.doubt(Doubt::RotaryAxis, place);
        } else {
            self.settle(Doubt::RotaryAxis);
        }
        turned
    }

    /// Sends rotary axes to their reference points. The angle of the part is then unknown until it is commanded to an absolute one.
    pub(crate) fn rotary_home(&mut self, words: &Words) {
        for (axis, letter) in ROTARY.into_iter().enumerate() {
            if let Some(place) = words.span(letter) {
                self.rotary.at[axis] = f64::NAN;
                self.doubt(Doubt::RotaryAxis, place);
            }
        }
    }

    /// Programmed end point of the block, mm.
    pub(crate) fn target(&mut self, words: &Words) -> Vec3 {
        let unit = self.modal.unit_mm();
        let mut target = self.place.programmed;
        for (axis, letter) in AXES.into_iter().enumerate() {
            let Some(value) = words.get(letter) else { continue };
            let incremental =
                if self.modal.incremental { !words.is_absolute(letter) } else { words.is_incremental(letter) };
            if !self.place.known[axis] {
                self.place.known[axis] = true;
                self.block.splittable = false;
                if incremental {
                    self.place.assumed[axis] = true;
                    self.assume_zero(axis);
                    target[axis] = self.place.programmed[axis];
                }
            }
            self.block.steps |= incremental;
            self.place.assumed[axis] &= incremental;
            target[axis] = if incremental { target[axis] + value * unit } else { value * unit };
        }
        if self.modal.polar.is_some() { self.polar_target(words, target) } else { target }
    }

    /// G16: the first axis of the plane is a radius about the zero, the second an angle, which G91 adds to the last one. A radius under G91 is
    /// measured from where the tool stands (Fanuc B-63944EN, Polar coordinate command): what a later angle then turns about is not followed.
    fn polar_target(&mut self, words: &Words, mut target: Vec3) -> Vec3 {
        let (a, b, _) = self.modal.plane.axes();
        let (mut radius, mut angle) = self.modal.polar.unwrap_or_default();
        if !words.has(AXES[a]) && !words.has(AXES[b]) {
            return target;
        }
        if self.modal.incremental && words.has(AXES[a]) {
            let place = words.span(AXES[a]).unwrap_or_default();
            self.misread("nc::polar", place, "a radius under G16 and G91 is not followed", "write it under G90");
            return target;
        }
        let increment = |value: f64, before: f64| if self.modal.incremental { before + value } else { value };
        radius = words.get(AXES[a]).map_or(radius, |value| value * self.modal.unit_mm());
        angle = words.get(AXES[b]).map_or(angle, |value| increment(value.to_radians(), angle));
        self.modal.polar = Some((radius, angle));
        target[a] = radius * angle.cos();
        target[b] = radius * angle.sin();
        target
    }

    /// An axis first commanded by an increment begins at zero.
    fn assume_zero(&mut self, axis: usize) {
        self.place.programmed[axis] = 0.0;
        self.place.tool = self.frame.apply(self.place.programmed);
    }

    fn machine_move(&mut self, words: &Words) {
        if self.modal.incremental && self.dialect().g53_needs_g90 {
            let place = self.flow.source.program().span(self.block.id);
            return self.misread(
                "nc::machine-move",
                place,
                "G53 under G91: a Fanuc leaves it out",
                "write it under G90",
            );
        }
        F::before_motion(self, MoveKind::Rapid, None);
        let unit = self.modal.unit_mm();
        let origin = self.env.origin(self.modal.wcs);
        // Where compensation has ended, the tool comes back to the contour with this motion.
        let mut to =
            if self.compensation.active.is_none() { self.frame.apply(self.place.programmed) } else { self.place.tool };
        for (axis, letter) in AXES.into_iter().enumerate() {
            let Some(value) = words.get(letter) else { continue };
            if self.env.home_mm.is_some() {
                to[axis] = value * unit - origin[axis];
            } else if axis == 2 {
                to.z = to.z.max(self.env.clear_z_mm);
                self.place.elsewhere[2] = true;
            } else {
                self.place.elsewhere[axis] = true;
            }
        }
        let kind = if self.modal.motion == Motion::Rapid { MoveKind::Rapid } else { MoveKind::Feed };
        self.tool_to(kind, Curve::Line { from: self.place.tool, to });
        self.place.programmed = self.frame.invert(self.place.tool);
    }

    /// Goes straight to a programmed point, after the approach or the corner that an earlier block asked for.
    pub(crate) fn line_to(&mut self, kind: MoveKind, target: Vec3) {
        F::before_motion(self, kind, Some(target - self.place.programmed));
        if self.corners.now.is_some() {
            self.work_corner(kind, target);
        }
        self.keep_leg(kind, target);
        self.straight_to(kind, target);
    }

    /// Goes straight to a programmed point.
    pub(crate) fn straight_to(&mut self, kind: MoveKind, target: Vec3) {
        if self.compensated(kind, target, None) {
            return;
        }
        let (from, to) = (self.frame.apply(self.place.programmed), self.frame.apply(target));
        self.block.contour_mm = ((from - self.place.tool).norm() > SAME_MM).then(|| (to - from).norm());
        self.place.programmed = target;
        self.tool_to(kind, Curve::Line { from: self.place.tool, to });
    }

    /// Moves the tool along a curve: one more motion of the toolpath.
    pub(crate) fn tool_to(&mut self, kind: MoveKind, curve: Curve) {
        let motion = self.motion_of(kind, curve);
        self.out.moves.push(motion);
    }

    /// Can a jump lead to the block that is executed? Where its words are steps, it can be made only as a whole.
    fn bears_target(&self) -> bool {
        let program = self.flow.source.program();
        let is_target = |kind: TokenKind| matches!(kind, TokenKind::Word(b'N') | TokenKind::Label);
        self.dialect().jumps_to_numbers && program.tokens(self.block.id).any(|token| is_target(token.kind))
    }

    /// The motion the block makes along a curve.
    pub(crate) fn motion_of(&mut self, kind: MoveKind, curve: Curve) -> Move {
        // In doubt once: what is cut from there on is, whatever is commanded later.
        if kind == MoveKind::Feed && std::mem::take(&mut self.place.assumed) != [false; 3] {
            self.doubt(Doubt::ZeroShift, self.flow.source.program().span(self.block.id));
        }
        let (feed, freeze) = match kind {
            MoveKind::Rapid => {
                (Feed { mode: self.modal.feed_mode, mm_s: 0.0, word: None, over_contour: 1.0 }, self.block.freeze)
            }
            MoveKind::Feed => {
                let length_mm = self.block.contour_mm.unwrap_or_else(|| curve.length());
                let (feed, over_contour) = (self.feed_of_block(length_mm), self.over_contour(&curve));
                let feed = Feed { mm_s: feed.mm_s * over_contour, over_contour, ..feed };
                (feed, self.block.freeze.or_else(|| self.feed_freeze()))
            }
        };
        if self.out.moves.is_empty() {
            self.out.inch = self.modal.inch;
        }
        self.place.tool = curve.to();
        let main = self.main_block();
        let block = self.linked_at().map_or(main, |(first, _)| BlockId(first + self.block.id.0));
        let (state, path_mode) = (self.state(kind, feed), self.modal.path_mode);
        let mut motion = Move::new(block, kind, curve, state);
        motion.line = main.0 + 1;
        motion.instance = self.flow.counts.get(block.ix()).map_or(0, |count| count.saturating_sub(1));
        motion.freeze = freeze;
        // Every piece of a block would stop at its end.
        let as_a_whole = path_mode == PathMode::ExactStop || (self.block.steps && self.bears_target());
        motion.splittable = self.block.splittable && !as_a_whole;
        motion.placed = self.block.placed && self.place.elsewhere == [false; 3];
        motion
    }

    /// Speed of the tool centre on a curve over F, see [`ArcFeed`].
    fn over_contour(&self, curve: &Curve) -> f64 {
        let (Some((centre, radius_mm)), Curve::Arc(arc)) = (self.block.contour_arc, curve) else { return 1.0 };
        let (a, b, _) = self.modal.plane.axes();
        let off = (arc.centre[a] - centre[a]).hypot(arc.centre[b] - centre[b]);
        if off > ONE_CENTRE_MM || radius_mm <= ONE_CENTRE_MM || self.modal.feed_mode == FeedMode::InverseTime {
            return 1.0;
        }
        match self.modal.arc_feed {
            ArcFeed::Centre => 1.0,
            ArcFeed::Contour => arc.radius_mm / radius_mm,
            ArcFeed::Inside => (arc.radius_mm / radius_mm).min(1.0),
        }
    }

    /// Feed of a move of this length that the block makes.
    fn feed_of_block(&self, length_mm: f64) -> Feed {
        let Some(value) = self.block.own_feed else { return self.modal.feed_of(length_mm) };
        Modal { feed: FeedWord { value, word: None, computed: true }, ..self.modal }.feed_of(length_mm)
    }

    /// The state of a move made now, shared with the last move of its kind unless something changed.
    fn state(&mut self, kind: MoveKind, feed: Feed) -> Arc<State> {
        let Modal { tool, wcs, path_mode, coolant, .. } = self.modal;
        let now = State {
            feed,
            spin: self.modal.spin(),
            tool,
            wcs,
            path_mode,
            shared: None,
            compensated: self.compensation.on,
            cycle: self.cycles.in_hole,
            coolant,
        };
        let last = &mut self.states[usize::from(kind == MoveKind::Feed)];
        match last {
            Some(state) if **state == now => state.clone(),
            _ => last.insert(Arc::new(now)).clone(),
        }
    }
}
