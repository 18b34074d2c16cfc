//! Approaches and departures of Heidenhain: APPR and DEP with LT, LN, CT, LCT. In: the point they name, their length, radius
//! and angle, and the contour they lead to or leave. Out: the motions of the tool; their feeds are kept.
//!
//! With d the direction of the contour at its first point A, n its left normal and s = +1 for RL, −1 for RR, the tool goes to
//! H and from there to A′, which is A moved aside by the radius of the tool:
//!
//! - LT: H = A′ − LEN·d, straight;
//! - LN: H = A′ + s·LEN·n, straight;
//! - CT: about C = A′ ± R·n by the angle CCA, counter-clockwise where s·R > 0;
//! - LCT: about C = A′ + s·R·n, where the line from the start touches that circle (without RL and RR: s by the side the start
//!   lies on).
//!
//! A departure is the same, backwards. The radius is that of the path of the tool. H is gone to as the tool moved last, with LCT
//! at the feed of the block; a change of height is made at H.

use super::blocks::number_after;
use super::state::Heidenhain;
use super::state::{Approach, Shape, Way};
use crate::diag::{Severity, Span};
use crate::nc::doubt::Doubt;
use crate::nc::interp::interpreter::Interpreter;
use crate::nc::interp::intersection::{OffsetElement, Point};
use crate::nc::interp::state::PreviousElement;
use crate::nc::interp::words::Words;
use crate::nc::token::{Token, TokenKind};
use crate::nc::toolpath::{Freeze, Move, MoveKind};
use crate::path::{Arc, Curve, Vec3};

impl Interpreter<'_, Heidenhain> {
    /// APPR: the contour begins at the named point. The motion to it is made when the next block shows the direction of the contour.
    pub(crate) fn approach(&mut self, names: &[&str], tokens: &[Token], text: &[u8], words: &mut Words, place: Span) {
        self.approach_without_contour();
        let way = self.way(names, tokens, text);
        self.side_of(names, words, place);
        self.block.freeze = self.block.freeze.or(Some(Freeze::Approach));
        self.block.splittable = false;
        let last = self.out.moves.last().map_or(MoveKind::Feed, |motion| motion.kind);
        let here = Curve::Line { from: self.place.tool, to: self.place.tool };
        let first = self.motion_of(last, here);
        self.own_feed(words);
        let then = self.motion_of(MoveKind::Feed, here);
        let target = self.peek_target(words);
        // Its point may be given by polar words, which are not read here.
        if !words.has_any(b"XYZ") {
            self.doubt(Doubt::UnknownCode, place);
        }
        clear_motion(words);
        self.place.programmed = target;
        let at_own_feed = way.is_none_or(|way| way.shape == Shape::LineAndArc);
        let first = if at_own_feed { then.clone() } else { first };
        self.family.approach = Some(Approach { way, moves: Box::new([first, then]), place });
    }

    /// Before an element of the contour that begins in this (programmed) direction: makes the approach that waits for it.
    pub(crate) fn approach_along(&mut self, kind: MoveKind, direction: Vec3) {
        let Some(approach) = self.family.approach.take() else { return };
        let (a, b, _) = self.modal.plane.axes();
        let along = self.frame.linear(direction);
        let at = self.frame.apply(self.place.programmed);
        let contour = unit([along[a], along[b]]).filter(|_| kind == MoveKind::Feed && self.frame.scale.is_none());
        let beside = contour
            .map(|d| (d, self.compensation.active.map_or([at[a], at[b]], |active| active.beside([at[a], at[b]], d))));
        let way = beside
            .zip(approach.way)
            .and_then(|((d, to), way)| way.to_contour([self.place.tool[a], self.place.tool[b]], to, d));
        let (Some((d, to)), Some((meets, arc))) = (beside, way) else {
            self.family.approach = Some(approach);
            return self.approach_without_contour();
        };
        let [first, then] = *approach.moves;
        let mut path = self.place.tool;
        (path[a], path[b]) = (meets[0], meets[1]);
        self.go_as(&first, Curve::Line { from: self.place.tool, to: path });
        let mut deep = at;
        (deep[a], deep[b]) = (meets[0], meets[1]);
        if (deep - path).norm() > 1e-9 {
            let text = "the depth is read as reached before the last part of the approach";
            self.say("nc::approach", Severity::Note, approach.place, text, "newer controls sink on the way");
            self.go_as(&first, Curve::Line { from: path, to: deep });
        }
        let mut end = at;
        (end[a], end[b]) = (to[0], to[1]);
        let index = self.out.moves.len();
        self.go_as(&then, self.flat_curve(deep, end, arc));
        if let Some(active) = &mut self.compensation.active {
            active.before = Some(PreviousElement {
                moved: OffsetElement::Line(to, d),
                direction: d,
                index,
                bend: 0.0,
                entry: false,
            });
        }
    }

    /// Makes an approach without a contour after it as a straight motion to its point, with a diagnostic.
    pub(crate) fn approach_without_contour(&mut self) {
        let Some(approach) = self.family.approach.take() else { return };
        let [_, then] = *approach.moves;
        let here = std::mem::replace(&mut self.block.id, then.block);
        self.say("nc::approach", Severity::Warning, approach.place, "this approach is read as a straight motion", HELP);
        self.block.id = here;
        let to = self.frame.apply(self.place.programmed);
        self.go_as(&then, Curve::Line { from: self.place.tool, to });
    }

    /// DEP: from the end of the contour.
    pub(crate) fn departure(&mut self, names: &[&str], tokens: &[Token], text: &[u8], words: &mut Words, place: Span) {
        self.approach_without_contour();
        let way = self.way(names, tokens, text);
        self.own_feed(words);
        self.block.freeze = self.block.freeze.or(Some(Freeze::Approach));
        self.block.splittable = false;
        let (a, b, n) = self.modal.plane.axes();
        let last = self.out.moves.last().filter(|motion| motion.kind == MoveKind::Feed && self.frame.scale.is_none());
        let along = last.map(|motion| motion.curve().tangent(motion.curve().length()));
        let target = self.peek_target(words);
        let target = self.frame.apply(target);
        let (from, d) = ([self.place.tool[a], self.place.tool[b]], along.and_then(|t| unit([t[a], t[b]])));
        let leaves = way.zip(d).and_then(|(way, d)| way.off_contour(from, [target[a], target[b]], d));
        let end = |p: Point, height: f64| {
            let mut end = target;
            (end[a], end[b], end[n]) = (p[0], p[1], height);
            end
        };
        let height = self.place.tool[n];
        if let Some((leaves, arc)) = leaves {
            let curve = self.flat_curve(self.place.tool, end(leaves, height), arc);
            self.tool_to(MoveKind::Feed, curve);
            if way.is_some_and(|way| way.shape == Shape::LineAndArc) {
                let to = end([target[a], target[b]], height);
                self.tool_to(MoveKind::Feed, Curve::Line { from: self.place.tool, to });
            }
        } else {
            self.say("nc::approach", Severity::Warning, place, "this departure is read as a straight motion", HELP);
            if words.has_any(b"XYZ") {
                self.tool_to(MoveKind::Feed, Curve::Line { from: self.place.tool, to: target });
            } else {
                self.doubt(Doubt::UnknownCode, place);
            }
        }
        let at = [self.place.tool[a], self.place.tool[b]];
        if (target[n] - self.place.tool[n]).abs() > 1e-9 {
            self.tool_to(MoveKind::Feed, Curve::Line { from: self.place.tool, to: end(at, target[n]) });
        }
        self.place.programmed = self.frame.invert(self.place.tool);
        clear_motion(words);
        if self.family.compensation_side != 400 {
            self.family.compensation_side = 400;
            words.g.push((400, place));
        }
    }

    /// F of the block, in force at once.
    fn own_feed(&mut self, words: &mut Words) {
        if let Some(value) = words.get(b'F') {
            self.feed_word(value, words, self.modal.unit_mm());
            words.remove(b'F');
        }
    }

    /// RL and RR of the block; R is its radius, unless it is R0.
    fn side_of(&mut self, names: &[&str], words: &mut Words, place: Span) {
        if words.get(b'R') != Some(0.0) {
            words.remove(b'R');
        }
        self.radius_side(names, words, place);
    }

    /// What the block says; `None`: something is missing, or it is written in polar coordinates.
    fn way(&mut self, names: &[&str], tokens: &[Token], text: &[u8]) -> Option<Way> {
        let unit = self.modal.unit_mm();
        let side = match (names.contains(&"RL"), names.contains(&"RR"), self.family.compensation_side) {
            (true, ..) | (false, false, 410) => 1.0,
            (_, true, _) | (false, false, 420) => -1.0,
            _ => 0.0,
        };
        let radius = || {
            let is_radius = |token: &&Token| token.kind == TokenKind::Word(b'R') && token.number != 0.0;
            tokens.iter().find(is_radius).map(|token| token.number * unit)
        };
        let length = || number_after(tokens, text, "LEN").filter(|length| *length > 0.0).map(|length| length * unit);
        let (shape, size) = match *names.get(1)? {
            "LT" => (Shape::Tangent, length()?),
            "LN" => (Shape::Normal, length()?),
            "CT" => (Shape::Arc, radius()?),
            "LCT" => (Shape::LineAndArc, radius()?.abs()),
            _ => return None,
        };
        let angle = number_after(tokens, text, "CCA").unwrap_or(0.0).to_radians();
        let sure = side != 0.0 || matches!(shape, Shape::Tangent | Shape::LineAndArc);
        (sure && (shape != Shape::Arc || angle > 0.0)).then_some(Way { shape, side, size, angle })
    }

    /// A motion like another, along a curve.
    fn go_as(&mut self, like: &Move, curve: Curve) {
        if curve.length() > 1e-9 {
            let mut motion = like.clone();
            self.place.tool = curve.to();
            motion.set_curve(curve);
            self.out.moves.push(motion);
        }
    }

    fn flat_curve(&self, from: Vec3, to: Vec3, arc: Option<(Point, f64)>) -> Curve {
        let (a, b, _) = self.modal.plane.axes();
        let Some((centre, sweep)) = arc else { return Curve::Line { from, to } };
        let mut about = from;
        (about[a], about[b]) = (centre[0], centre[1]);
        Curve::Arc(Arc::new(self.modal.plane, from, to, about, sweep))
    }
}

const HELP: &str = "its feed is kept; write LEN, or R and CCA, and RL or RR, before a contour in the plane";

/// Where the tool meets the last part, and the centre and the sweep of that where it is an arc.
type Part = (Point, Option<(Point, f64)>);

impl Way {
    /// From `start` to the contour point `to`, where the contour runs along `d`.
    fn to_contour(self, start: Point, to: Point, d: Point) -> Option<Part> {
        let n = [-d[1], d[0]];
        match self.shape {
            Shape::Tangent => Some((moved(to, d, -self.size), None)),
            Shape::Normal => Some((moved(to, n, self.side * self.size), None)),
            Shape::Arc => {
                let turn = (self.side * self.size).signum();
                let centre = moved(to, n, turn * self.size.abs());
                Some((turned(to, centre, -turn * self.angle), Some((centre, turn * self.angle))))
            }
            Shape::LineAndArc => {
                let side = self.side_towards(to, d, start);
                let centre = moved(to, n, side * self.size);
                let meets = touching(centre, self.size, start, side > 0.0)?;
                Some((meets, Some((centre, sweep(meets, to, centre, side)))))
            }
        }
    }

    /// From the contour point `from`, where the contour runs along `d`, towards `end`: the first part and where it ends.
    fn off_contour(self, from: Point, end: Point, d: Point) -> Option<Part> {
        let n = [-d[1], d[0]];
        match self.shape {
            Shape::Tangent => Some((moved(from, d, self.size), None)),
            Shape::Normal => Some((moved(from, n, self.side * self.size), None)),
            Shape::Arc => {
                let turn = (self.side * self.size).signum();
                let centre = moved(from, n, turn * self.size.abs());
                Some((turned(from, centre, turn * self.angle), Some((centre, turn * self.angle))))
            }
            Shape::LineAndArc => {
                let side = self.side_towards(from, d, end);
                let centre = moved(from, n, side * self.size);
                let leaves = touching(centre, self.size, end, side < 0.0)?;
                Some((leaves, Some((centre, sweep(from, leaves, centre, side)))))
            }
        }
    }

    fn side_towards(self, at: Point, d: Point, other: Point) -> f64 {
        let across = d[0] * (other[1] - at[1]) - d[1] * (other[0] - at[0]);
        if self.side == 0.0 { across.signum() } else { self.side }
    }
}

/// Where a line from `p` touches the circle, so that it goes on counter-clockwise (or clockwise) there.
fn touching(centre: Point, radius: f64, p: Point, counter_clockwise: bool) -> Option<Point> {
    let (u, v) = (p[0] - centre[0], p[1] - centre[1]);
    let reach = radius / u.hypot(v);
    let cosine = if (reach - 1.0).abs() < 1e-9 { 1.0 } else { reach };
    let angle = v.atan2(u) + if counter_clockwise { cosine.acos() } else { -cosine.acos() };
    (cosine <= 1.0).then(|| [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()])
}

fn moved(p: Point, direction: Point, by: f64) -> Point {
    [p[0] + by * direction[0], p[1] + by * direction[1]]
}

fn turned(p: Point, centre: Point, angle: f64) -> Point {
    let (sin, cos) = angle.sin_cos();
    let (u, v) = (p[0] - centre[0], p[1] - centre[1]);
    [centre[0] + u * cos - v * sin, centre[1] + u * sin + v * cos]
}

/// Angle from one point of a circle to another, counter-clockwise where `turn` is positive.
fn sweep(from: Point, to: Point, centre: Point, turn: f64) -> f64 {
    let angle = |p: Point| (p[1] - centre[1]).atan2(p[0] - centre[0]);
    turn.signum() * (turn.signum() * (angle(to) - angle(from))).rem_euclid(std::f64::consts::TAU)
}

fn unit(v: Point) -> Option<Point> {
    let length = v[0].hypot(v[1]);
    (length > 1e-9).then(|| [v[0] / length, v[1] / length])
}

fn clear_motion(words: &mut Words) {
    for letter in *b"XYZR" {
        words.remove(letter);
    }
    words.repeated = None;
}
