//! Arcs and helices. In: end point and I J K or R words of a block. Out: a motion with centre and sweep.
//!
//! In the plane with axes (a, b) seen against its normal, G3 turns from a to b. An arc that ends where it begins (or
//! within 1e-6 rad of it, as LinuxCNC has it) is a full turn; P asks for more of them.

use std::f64::consts::{PI, TAU};

use super::interpreter::{Family, Interpreter};
use super::state::Motion;
use super::words::Words;
use crate::diag::{Severity, Span};
use crate::nc::toolpath::{FeedMode, MoveKind};
use crate::path::{Arc, Curve, Plane, Vec3};

/// Difference of start and end radius from which on there is a warning, mm; from ten times that on it is an error.
const RADIUS_MISMATCH_MM: f64 = 0.05;
/// Turns of one arc that are followed: a thread of 0.25 mm pitch over 250 mm has as many. What asks for more is a mistake, and its stations
/// would fill the memory.
const MOST_TURNS: f64 = 1000.0;
/// Angle below which an arc is a full turn, rad.
const FULL_TURN_RAD: f64 = 1e-6;

impl<F: Family> Interpreter<'_, F> {
    /// The arc of a block.
    pub(crate) fn arc(&mut self, words: &Words, turned: bool) {
        self.freeze_feed(turned);
        let target = self.target(words);
        let clockwise = self.modal.motion == Motion::Clockwise;
        let place = words.g.last().map(|g| g.1).or(words.span(b'R')).or(words.span(b'I')).or(words.span(b'J'));
        let place = place.unwrap_or_else(|| self.flow.source.program().span(self.block.id));
        if let Some(why) = self.unknown_arc(words) {
            return self.misread("nc::arc", place, why, "the block is left as it is");
        }
        let from = self.place.programmed;
        // P beside a call names the program.
        let turns = words.get(b'P').filter(|_| !words.has_m(980) && !words.has_m(970));
        let turns = turns.map_or(1.0, |p| p.round().max(1.0));
        if self.modal.feed_mode == FeedMode::InverseTime && self.dialect().arcs_by_radius {
            self.cuts_unseen();
            self.not_understood("nc::inverse-time", place, "F of an arc under G93 is over its radius here", "");
        }
        let centre = match words.get(b'R') {
            Some(radius) => self.centre_from_radius(from, target, radius * self.modal.unit_mm(), clockwise, place),
            None => self.centre_from_words(words, from, target, place),
        };
        let Some(centre) = centre else {
            self.line_to(MoveKind::Feed, target);
            return;
        };
        let plane = self.modal.plane;
        let sweep = sweep(plane, from, target, centre, clockwise, turns);
        if words.has(b'R') && (sweep.abs() - PI).abs() < 0.1 {
            self.block.splittable = false;
        }
        let (a, b, _) = plane.axes();
        let mut tangent = Vec3::zeros();
        (tangent[a], tangent[b]) = (centre[b] - from[b], from[a] - centre[a]);
        F::before_motion(self, MoveKind::Feed, Some(tangent * sweep.signum()));
        self.corners.leg = None;
        if let Some((_, place)) = self.corners.now.take() {
            self.refuse_corner(place);
        }
        self.arc_to(plane, target, centre, sweep);
    }

    /// Why the path of an arc is the control's to say. L and Q of Macro B make it a spiral or a cone of so many turns (Fanuc B-63944EN, Helical,
    /// spiral and conical interpolation). Under two scale factors it is no circle: controls take the greater factor for R, and with I J K such an
    /// arc ends beside its circle.
    fn unknown_arc(&self, words: &Words) -> Option<&'static str> {
        let (a, b, _) = self.modal.plane.axes();
        let two_factors = |factor: Vec3| factor[a].abs() != factor[b].abs();
        match self.frame.scale {
            _ if self.dialect().macro_b && words.has_any(b"LQ") => Some("L or Q makes this arc a spiral or a cone"),
            Some((_, factor)) if two_factors(factor) => Some("an arc under two scale factors is no circle"),
            _ => None,
        }
    }

    /// Makes an arc given in programmed coordinates.
    pub(crate) fn arc_to(&mut self, plane: Plane, target: Vec3, centre: Vec3, sweep: f64) {
        if sweep.abs() > MOST_TURNS * TAU {
            let place = self.flow.source.program().span(self.block.id);
            let text = format!("an arc of {:.0} turns is not followed", sweep.abs() / TAU);
            return self.misread("nc::turns", place, text, "write it in parts that have fewer");
        }
        let centre = self.frame.apply(centre);
        let sweep = if self.frame.mirrors(plane) { -sweep } else { sweep };
        if self.compensated(MoveKind::Feed, target, Some((centre, sweep))) {
            return;
        }
        self.place.programmed = target;
        let to = self.frame.apply(target);
        self.tool_to(MoveKind::Feed, Curve::Arc(Arc::new(plane, self.place.tool, to, centre, sweep)));
    }

    fn centre_from_words(&mut self, words: &Words, from: Vec3, target: Vec3, place: Span) -> Option<Vec3> {
        let (a, b, _) = self.modal.plane.axes();
        let unit = self.modal.unit_mm();
        let offsets = [a, b].map(|axis| words.get(b"IJK"[axis]));
        if offsets.iter().all(Option::is_none) {
            self.bad_arc(place, "the arc has neither centre nor radius");
            return None;
        }
        let mut centre = from;
        for (axis, word) in [a, b].into_iter().zip(offsets) {
            match word {
                Some(value) if self.modal.absolute_centres || words.is_absolute(b"IJK"[axis]) => {
                    centre[axis] = value * unit;
                }
                Some(value) => centre[axis] += value * unit,
                None => {}
            }
        }
        let start = (from[a] - centre[a]).hypot(from[b] - centre[b]);
        let end = (target[a] - centre[a]).hypot(target[b] - centre[b]);
        let mismatch = (start - end).abs();
        if start == 0.0 {
            self.bad_arc(place, "the centre of the arc is its start");
            return None;
        }
        if mismatch > 10.0 * RADIUS_MISMATCH_MM && mismatch > 0.01 * start {
            self.bad_arc(place, format!("the arc ends {mismatch:.3} mm off the circle it begins on"));
        } else if mismatch > RADIUS_MISMATCH_MM {
            let text = format!("the radius of the arc changes by {mismatch:.3} mm");
            self.say("nc::arc-radius", Severity::Warning, place, text, "a control may refuse it");
        }
        Some(centre)
    }

    fn centre_from_radius(
        &mut self,
        from: Vec3,
        target: Vec3,
        radius: f64,
        clockwise: bool,
        place: Span,
    ) -> Option<Vec3> {
        let (a, b, _) = self.modal.plane.axes();
        let (du, dv) = (target[a] - from[a], target[b] - from[b]);
        let chord = du.hypot(dv);
        if chord == 0.0 {
            self.bad_arc(place, "an arc with R cannot end where it begins");
            return None;
        }
        let square = radius * radius - 0.25 * chord * chord;
        if 0.5 * chord > radius.abs() + RADIUS_MISMATCH_MM {
            self.bad_arc(place, format!("radius {:.4} mm does not reach across {chord:.4} mm", radius.abs()));
            return None;
        }
        let height = square.max(0.0).sqrt();
        let side = if clockwise == (radius > 0.0) { -1.0 } else { 1.0 };
        let mut centre = from;
        centre[a] += 0.5 * du - side * height * dv / chord;
        centre[b] += 0.5 * dv + side * height * du / chord;
        Some(centre)
    }

    fn bad_arc(&mut self, place: Span, text: impl Into<String>) {
        self.not_understood("nc::arc", place, text, "correct the arc; its feed is kept");
    }
}

/// Angle turned about `centre`, rad, in the sense of the motion, with `turns` − 1 further full turns.
pub(crate) fn sweep(plane: Plane, from: Vec3, to: Vec3, centre: Vec3, clockwise: bool, turns: f64) -> f64 {
    let (a, b, _) = plane.axes();
    let start = (from[b] - centre[b]).atan2(from[a] - centre[a]);
    let end = (to[b] - centre[b]).atan2(to[a] - centre[a]);
    let ccw = if clockwise { start - end } else { end - start };
    let ccw = ccw.rem_euclid(TAU);
    let once = if ccw < FULL_TURN_RAD { ccw + TAU } else { ccw };
    let angle = once + (turns - 1.0) * TAU;
    if clockwise { -angle } else { angle }
}
