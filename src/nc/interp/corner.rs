//! Corners rounded or chamfered by a word (RND, CHF, CHR, `,R`, `,C`), tangential arcs (CT), arcs through a point (CIP). In: the
//! contour before and after. Out: both cut back and the element between them; the tool follows it with its compensation.
//!
//! With the change of direction δ at the corner, a radius r begins r·tan(δ/2) before it; a chamfer of length c begins
//! c / (2 cos(δ/2)) before it.

use std::f64::consts::PI;

use super::interpreter::{Family, Interpreter};
use super::state::{Corner, Leg};
use super::words::Words;
use crate::diag::Span;
use crate::nc::doubt::Doubt;
use crate::nc::toolpath::{Feed, FeedMode, Freeze, Move, MoveKind};
use crate::path::{Plane, Vec3};

impl Corner {
    /// How far before the corner it begins.
    fn reach(self, turn: f64) -> f64 {
        match self {
            Corner::Round(radius) => radius * (0.5 * turn).tan(),
            Corner::Chamfer(length) => 0.5 * length / (0.5 * turn).cos(),
            Corner::Legs(leg) => leg,
        }
    }
}

/// Where a corner begins and ends, and the centre and the sweep of its arc.
type Worked = (Vec3, Vec3, Option<(Vec3, f64)>);

impl<F: Family> Interpreter<'_, F> {
    /// Rounds or chamfers the corner between the last straight motion and the one to `target`: the last one is taken back and made
    /// again up to where the corner begins; the motions of the corner follow it as parts of its block.
    pub(crate) fn work_corner(&mut self, kind: MoveKind, target: Vec3) {
        let Some((corner, place)) = self.corners.now.take() else { return };
        let feed = self.corners.feed.take();
        let leg = self.corners.leg.take().filter(|leg| kind == MoveKind::Feed && self.can_go_back(leg));
        let worked = leg.and_then(|leg| between(self.modal.plane, corner, &leg, target).map(|worked| (leg, worked)));
        let Some((leg, (start, end, arc))) = worked else { return self.refuse_corner(place) };
        let first = leg.first_move;
        let before = self.out.moves[first].clone();
        self.out.moves.truncate(first);
        (self.place.tool, self.place.programmed, self.compensation.active) = (leg.tool, leg.from, leg.compensation);
        self.straight_to(MoveKind::Feed, start);
        let cut = self.out.moves.len();
        match arc {
            Some((centre, sweep)) => self.arc_to(self.modal.plane, end, centre, sweep),
            None => self.straight_to(MoveKind::Feed, end),
        }
        for (index, motion) in self.out.moves.iter_mut().enumerate().skip(first) {
            let mut named = before.clone();
            named.set_curve(motion.curve());
            named.splittable = false;
            let over_contour = motion.feed.over_contour;
            named.feed =
                Feed { mm_s: named.feed.mm_s * over_contour / before.feed.over_contour, over_contour, ..named.feed };
            if let Some(mm_s) = feed.filter(|_| index >= cut) {
                named.feed = Feed { mm_s: mm_s * over_contour, word: None, ..named.feed };
                named.freeze = named.freeze.or(Some(Freeze::OwnFeed));
            }
            *motion = named;
        }
        self.block.splittable = false;
    }

    /// A corner between this block and the next.
    pub(crate) fn corner_after(&mut self, corner: Corner, place: Span) {
        self.block.splittable = false;
        self.corners.next = Some((corner, place));
    }

    /// Leaves the requested corner out, with a diagnostic.
    pub(crate) fn refuse_corner(&mut self, place: Span) {
        let text = "this corner is not followed: the motions are read without it";
        self.not_understood("nc::corner", place, text, "it is followed between two straight lines in the plane");
        if let Some(before) = self.out.moves.last_mut() {
            before.freeze = before.freeze.or(Some(Freeze::NotUnderstood));
        }
    }

    /// Remembers the straight motion to `target`, if a corner may cut it short.
    pub(crate) fn keep_leg(&mut self, kind: MoveKind, target: Vec3) {
        let wanted = self.corners.next.is_some() || F::CORNERS_BEHIND;
        if !wanted || kind == MoveKind::Rapid {
            self.corners.leg = None;
            return;
        }
        self.corners.leg = Some(Leg {
            from: self.place.programmed,
            to: target,
            tool: self.place.tool,
            compensation: self.compensation.active,
            first_move: self.out.moves.len(),
            events: self.out.between.len(),
        });
    }

    fn can_go_back(&self, leg: &Leg) -> bool {
        let made = self.out.moves.get(leg.first_move..).unwrap_or_default();
        let one = |motion: &Move| motion.block == made[0].block && motion.instance == made[0].instance;
        !made.is_empty()
            && made.iter().all(one)
            && leg.events == self.out.between.len()
            && leg.to == self.place.programmed
            && self.modal.feed_mode != FeedMode::InverseTime
    }

    /// CT: an arc that leaves the last motion without a bend, as a centre and a sense; a line where it would be straight.
    pub(crate) fn tangential_arc(&mut self, words: &mut Words, place: Span) {
        let (a, b, _) = self.modal.plane.axes();
        let from = self.place.programmed;
        let to = self.peek_target(words);
        let known = !self.frame.lost && self.compensation.active.is_none() && self.corners.now.is_none();
        let before = self.out.moves.last().filter(|motion| known && motion.kind == MoveKind::Feed);
        let programmed = |motion: &Move| {
            let (end, ahead) = (motion.curve().to(), motion.curve().tangent(motion.curve().length()));
            (self.frame.invert(end + ahead) - self.frame.invert(end)).normalize()
        };
        let Some(tangent) = before.map(programmed).filter(|t| t[a].hypot(t[b]) > 0.5) else {
            // It is read as its chord: where the tool cuts is not known.
            self.doubt(Doubt::UnknownCode, place);
            self.not_understood("nc::tangent", place, "what this arc is tangential to is not known", "");
            return words.g.push((10, place));
        };
        let (u, v) = (to[a] - from[a], to[b] - from[b]);
        let across = tangent[a] * v - tangent[b] * u;
        if across.abs() < 1e-9 * (u * u + v * v).max(1e-12) {
            return words.g.push((10, place));
        }
        let radius = (u * u + v * v) * tangent[a].hypot(tangent[b]) / (2.0 * across);
        let length = tangent[a].hypot(tangent[b]);
        let mut centre = from;
        centre[a] -= radius * tangent[b] / length;
        centre[b] += radius * tangent[a] / length;
        self.put_centre(words, centre, across > 0.0, place);
    }

    /// CIP: an arc through `through` (mm), in the plane; a line with its feed kept where it is not.
    pub(crate) fn arc_through(&mut self, words: &mut Words, through: [Option<(f64, bool)>; 3], place: Span) {
        let (a, b, n) = self.modal.plane.axes();
        let (from, to) = (self.place.programmed, self.peek_target(words));
        let middle = Vec3::from_fn(|axis, _| match through[axis] {
            Some((value, by_steps)) => value + if by_steps { from[axis] } else { 0.0 },
            None => from[axis],
        });
        let (u, v) = (middle - from, to - from);
        let across = u[a] * v[b] - u[b] * v[a];
        if across.abs() < 1e-9 || v[n].abs() > 1e-9 || u[n].abs() > 1e-9 {
            self.not_understood("nc::arc", place, "this arc through a point does not lie in the plane", "");
            return words.g.push((10, place));
        }
        let (uu, vv) = (u[a] * u[a] + u[b] * u[b], v[a] * v[a] + v[b] * v[b]);
        let mut centre = from;
        centre[a] += (v[b] * uu - u[b] * vv) / (2.0 * across);
        centre[b] += (u[a] * vv - v[a] * uu) / (2.0 * across);
        self.put_centre(words, centre, across > 0.0, place);
    }

    /// Puts an arc about an absolute centre (mm) into the words of a block.
    pub(crate) fn put_centre(&mut self, words: &mut Words, centre: Vec3, counter_clockwise: bool, place: Span) {
        let unit = self.modal.unit_mm();
        let (a, b, _) = self.modal.plane.axes();
        for axis in [a, b] {
            words.put(b"IJK"[axis], centre[axis] / unit, place, true);
            words.force(b"IJK"[axis], false);
        }
        words.g.push((if counter_clockwise { 30 } else { 20 }, place));
    }

    /// Where the block will end, without putting anything in force.
    pub(crate) fn peek_target(&mut self, words: &Words) -> Vec3 {
        let keep = (self.place.known, self.place.programmed, self.place.tool, self.block.splittable, self.modal.polar);
        let target = self.target(words);
        (self.place.known, self.place.programmed, self.place.tool, self.block.splittable, self.modal.polar) = keep;
        target
    }
}

/// The corner between a straight motion and the one to `last`; `None`: there is no room for it, or it is not in the plane.
fn between(plane: Plane, corner: Corner, leg: &Leg, last: Vec3) -> Option<Worked> {
    let (a, b, n) = plane.axes();
    let (into, out) = ((leg.to - leg.from).try_normalize(1e-9)?, (last - leg.to).try_normalize(1e-9)?);
    let turn = into.dot(&out).clamp(-1.0, 1.0).acos();
    let flat = into[n].abs() < 1e-9 && out[n].abs() < 1e-9;
    let reach = corner.reach(turn);
    let room = (leg.to - leg.from).norm().min((last - leg.to).norm()) + 1e-9;
    if !flat || reach <= 0.0 || reach > room || !(1e-6..PI - 1e-6).contains(&turn) {
        return None;
    }
    let (start, end) = (leg.to - into * reach, leg.to + out * reach);
    let Corner::Round(radius) = corner else { return Some((start, end, None)) };
    let side = (into[a] * out[b] - into[b] * out[a]).signum();
    let mut centre = start;
    centre[a] -= side * radius * into[b];
    centre[b] += side * radius * into[a];
    Some((start, end, Some((centre, side * turn))))
}
