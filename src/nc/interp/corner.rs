//! Corners rounded or chamfered by a word (RND, CHF, CHR), tangential arcs (CT), arcs through a point (CIP). In: the move
//! before, the move after. Out: both cut back and the element between them.
//!
//! With the change of direction δ at the corner, a radius r begins r·tan(δ/2) before it; a chamfer of length c begins
//! c / (2 cos(δ/2)) before it.

use super::Run;
use super::line::Line;
use crate::diag::Span;
use crate::nc::toolpath::{Freeze, MoveKind};
use crate::path::{Arc, Curve, Vec3};

/// What a corner becomes, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Corner {
    /// An arc of this radius.
    Round(f64),
    /// A chamfer of this length.
    Chamfer(f64),
    /// A chamfer that takes this much of either side.
    Legs(f64),
}

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

impl Run<'_> {
    /// Works the corner asked for into the move before and the one to be made; gives what is left of that.
    pub(super) fn cornered(&mut self, kind: MoveKind, curve: Curve) -> Curve {
        let Some((corner, place)) = self.corner.take() else { return curve };
        if let (MoveKind::Feed, Some((rest, rounding))) = (kind, self.cut_corner(corner, curve))
            && let Some(before) = self.out.moves.last_mut()
        {
            let Curve::Line { from, .. } = before.curve() else { return curve };
            before.set_curve(Curve::Line { from, to: rounding.from() });
            before.splittable = false;
            let mut between = before.clone();
            between.set_curve(rounding);
            self.out.moves.push(between);
            self.splittable = false;
            return rest;
        }
        let text = "this corner is not followed: the motions are read without it";
        self.not_understood("nc::corner", place, text, "it is followed between two straight lines in the plane");
        if let Some(before) = self.out.moves.last_mut() {
            before.freeze = before.freeze.or(Some(Freeze::NotUnderstood));
        }
        curve
    }

    fn cut_corner(&self, corner: Corner, after: Curve) -> Option<(Curve, Curve)> {
        let (plane, (_, _, n)) = (self.modal.plane, self.modal.plane.axes());
        let before = self.out.moves.last().filter(|motion| motion.kind == MoveKind::Feed)?;
        let (Curve::Line { from: first, to: at }, Curve::Line { from, to: last }) = (before.curve(), after) else {
            return None;
        };
        let (into, out) = ((at - first).try_normalize(1e-9)?, (last - at).try_normalize(1e-9)?);
        let turn = into.dot(&out).clamp(-1.0, 1.0).acos();
        let flat = into[n].abs() < 1e-9 && out[n].abs() < 1e-9 && (at - from).norm() < 1e-6;
        let reach = corner.reach(turn);
        let fits = reach > 0.0 && reach <= (at - first).norm() + 1e-9 && reach <= (last - at).norm() + 1e-9;
        if !flat || !fits || self.compensation.is_some() || !(1e-6..std::f64::consts::PI - 1e-6).contains(&turn) {
            return None;
        }
        let (start, end) = (at - into * reach, at + out * reach);
        let between = match corner {
            Corner::Round(radius) => {
                let (a, b, _) = plane.axes();
                let side = (into[a] * out[b] - into[b] * out[a]).signum();
                let mut centre = start;
                centre[a] -= side * radius * into[b];
                centre[b] += side * radius * into[a];
                Curve::Arc(Arc::new(plane, start, end, centre, side * turn))
            }
            _ => Curve::Line { from: start, to: end },
        };
        Some((Curve::Line { from: end, to: last }, between))
    }

    /// CT: an arc that leaves the last motion without a bend, as a centre and a sense; a line where it would be straight.
    pub(super) fn tangential_arc(&mut self, line: &mut Line, place: Span) {
        let (a, b, _) = self.modal.plane.axes();
        let from = self.programmed;
        let to = self.peek_target(line);
        let known = self.frame.is_plain() && self.compensation.is_none() && self.corner.is_none();
        let before = self.out.moves.last().filter(|motion| known && motion.kind == MoveKind::Feed);
        let tangent = before.map(|motion| motion.curve().tangent(motion.curve().length()));
        let Some(tangent) = tangent.filter(|t| t[a].hypot(t[b]) > 0.5) else {
            self.not_understood("nc::tangent", place, "what this arc is tangential to is not known", "");
            return line.g.push((10, place));
        };
        let (u, v) = (to[a] - from[a], to[b] - from[b]);
        let across = tangent[a] * v - tangent[b] * u;
        if across.abs() < 1e-9 * (u * u + v * v).max(1e-12) {
            return line.g.push((10, place));
        }
        let radius = (u * u + v * v) * tangent[a].hypot(tangent[b]) / (2.0 * across);
        let length = tangent[a].hypot(tangent[b]);
        let mut centre = from;
        centre[a] -= radius * tangent[b] / length;
        centre[b] += radius * tangent[a] / length;
        self.put_centre(line, centre, across > 0.0, place);
    }

    /// CIP: an arc through `through` (mm), in the plane; a line with its feed kept where it is not.
    pub(super) fn arc_through(&mut self, line: &mut Line, through: [Option<f64>; 3], place: Span) {
        let (a, b, n) = self.modal.plane.axes();
        let (from, to) = (self.programmed, self.peek_target(line));
        let middle = Vec3::from_fn(|axis, _| match through[axis] {
            Some(value) if self.modal.incremental => from[axis] + value,
            Some(value) => value,
            None => from[axis],
        });
        let (u, v) = (middle - from, to - from);
        let across = u[a] * v[b] - u[b] * v[a];
        if across.abs() < 1e-9 || v[n].abs() > 1e-9 || u[n].abs() > 1e-9 {
            self.not_understood("nc::arc", place, "this arc through a point does not lie in the plane", "");
            return line.g.push((10, place));
        }
        let (uu, vv) = (u[a] * u[a] + u[b] * u[b], v[a] * v[a] + v[b] * v[b]);
        let mut centre = from;
        centre[a] += (v[b] * uu - u[b] * vv) / (2.0 * across);
        centre[b] += (u[a] * vv - v[a] * uu) / (2.0 * across);
        self.put_centre(line, centre, across > 0.0, place);
    }

    /// Puts an arc about an absolute centre (mm) into the words of a block.
    pub(super) fn put_centre(&mut self, line: &mut Line, centre: Vec3, counter_clockwise: bool, place: Span) {
        let unit = self.modal.unit_mm();
        let (a, b, _) = self.modal.plane.axes();
        for axis in [a, b] {
            line.put(b"IJK"[axis], centre[axis] / unit, place, true);
            line.force(b"IJK"[axis], false);
        }
        line.g.push((if counter_clockwise { 30 } else { 20 }, place));
    }

    /// Where the block will end, without putting anything in force.
    fn peek_target(&mut self, line: &Line) -> Vec3 {
        let keep = (self.known, self.programmed, self.tool, self.splittable, self.polar);
        let target = self.target(line);
        (self.known, self.programmed, self.tool, self.splittable, self.polar) = keep;
        target
    }
}
