//! From moves to legs. In: the toolpath, the commanded feed of each piece of it, the machine. Out: a [`Track`]: the legs and
//! points of [`super::exact_pass`], each leg knowing its piece, with rests where the control stops and speeds at the corners.

use super::corner::{Side, along, corner_speed, jerk_along, speed_along};
use super::exact_pass::{Chain, Leg, Row};
use super::problem::FeedPiece;
use crate::ids::MoveId;
use crate::machine::Machine;
use crate::nc::{Event, Move, MoveKind, PathMode, Toolpath};
use crate::path::{Curve, Vec3};

/// Largest angle of one leg of an arc, rad.
const LEG_RAD: f64 = 0.15;

/// Legs of a whole program.
#[derive(Debug, Clone, Default)]
pub struct Track {
    /// Legs and points.
    pub chain: Chain,
    /// The piece that each leg belongs to: its index, from 0, among the pieces of its move.
    pub tags: Vec<u32>,
    /// Move of each leg.
    pub moves: Vec<MoveId>,
}

/// Legs of the whole program. `pieces_of` gives the pieces of a feed move; a rapid is one piece.
pub fn track(toolpath: &Toolpath, machine: &Machine, pieces_of: &mut dyn FnMut(MoveId, &mut Vec<FeedPiece>)) -> Track {
    let mut builder = Builder { track: Track::default(), machine, last: None };
    builder.track.chain.point_b.push(0.0);
    let mut pieces = Vec::new();
    for event in toolpath.events() {
        match &event {
            Event::Move(id) => {
                let motion = &toolpath.moves[id.ix()];
                pieces.clear();
                match motion.kind {
                    MoveKind::Rapid => {
                        pieces.push(FeedPiece::commanded(*id, [0.0, motion.curve().length()], machine.rapid_mm_s));
                    }
                    MoveKind::Feed => pieces_of(*id, &mut pieces),
                }
                builder.add(motion, &pieces);
            }
            Event::Dwell { .. } | Event::Tool { .. } | Event::Stop { .. } | Event::Spindle { .. } => builder.rest(),
        }
    }
    builder.rest();
    builder.track
}

struct Builder<'a> {
    track: Track,
    machine: &'a Machine,
    /// End of the last move and how the control treats it; `None` at rest.
    last: Option<(Side, PathMode)>,
}

impl Builder<'_> {
    fn rest(&mut self) {
        self.last = None;
        if let Some(b) = self.track.chain.point_b.last_mut() {
            *b = 0.0;
        }
    }

    fn add(&mut self, motion: &Move, pieces: &[FeedPiece]) {
        let length_mm = motion.curve().length();
        if length_mm <= 0.0 {
            return;
        }
        let start = Side { tangent: motion.curve().tangent(0.0), length_mm };
        let speed = self.last.map_or(0.0, |(end, mode)| junction_speed(end, start, mode, self.machine));
        if let Some(b) = self.track.chain.point_b.last_mut() {
            *b = b.min(speed * speed);
        }
        let digest_mm_s = match motion.kind {
            MoveKind::Feed if self.machine.block_time_s > 0.0 => length_mm / self.machine.block_time_s,
            _ => f64::INFINITY,
        };
        for (tag, piece) in (0..).zip(pieces).filter(|(_, piece)| piece.to_mm > piece.from_mm) {
            let known = if piece.feed_mm_s > 0.0 { piece.feed_mm_s } else { self.machine.rapid_mm_s };
            let cap_mm_s = known.min(digest_mm_s);
            match &motion.curve() {
                Curve::Line { .. } => self.line(tag, piece, cap_mm_s, start.tangent),
                curve @ Curve::Arc(_) => self.arc(tag, piece, cap_mm_s, curve, pieces.len() == 1),
            }
        }
        self.last = Some((Side { tangent: motion.curve().tangent(length_mm), length_mm }, motion.path_mode));
    }

    fn line(&mut self, tag: u32, piece: &FeedPiece, cap_mm_s: f64, tangent: Vec3) {
        let axes = &self.machine.axes;
        let leg = Leg {
            ds_mm: piece.to_mm - piece.from_mm,
            cap_b: cap_mm_s.min(speed_along(axes, tangent)).powi(2),
            accel_mm_s2: along(axes, tangent),
            jerk_mm_s3: jerk_along(axes, tangent),
            first_row: 0,
            row_count: 0,
        };
        self.push(piece.move_id, tag, leg);
    }

    fn arc(&mut self, tag: u32, piece: &FeedPiece, cap_mm_s: f64, curve: &Curve, alone: bool) {
        let length_mm = piece.to_mm - piece.from_mm;
        let turn = length_mm * curve.curvature(piece.from_mm).norm();
        let count = ((turn / LEG_RAD).ceil() as usize).clamp(if alone { 2 } else { 1 }, 4096);
        let ds_mm = length_mm / count as f64;
        for i in 0..count {
            let s0 = piece.from_mm + i as f64 * ds_mm;
            let leg = self.per_axis_leg(curve, s0, ds_mm, cap_mm_s);
            self.push(piece.move_id, tag, leg);
        }
    }

    /// A leg whose axes may each use all they have: rows t·a + k·b within ± limit at both ends.
    fn per_axis_leg(&mut self, curve: &Curve, s0_mm: f64, ds_mm: f64, cap_mm_s: f64) -> Leg {
        let ends = [s0_mm, s0_mm + ds_mm].map(|s| (curve.tangent(s), curve.curvature(s)));
        let speed = ends.iter().map(|(t, _)| speed_along(&self.machine.axes, *t)).fold(cap_mm_s, f64::min);
        let rows = &mut self.track.chain.rows;
        let first_row = rows.len() as u32;
        for (at_end, (t, k)) in ends.iter().enumerate() {
            for (axis, limit) in self.machine.axes.iter().enumerate() {
                let slope = t[axis] / (2.0 * ds_mm);
                let (p, q) = if at_end == 0 { (k[axis] - slope, slope) } else { (-slope, slope + k[axis]) };
                if p.abs().max(q.abs()) > 1e-12 {
                    let r = limit.acceleration_mm_s2;
                    rows.extend([Row { p, q, r }, Row { p: -p, q: -q, r }]);
                }
            }
        }
        let jerk_mm_s3 = ends.iter().map(|(t, _)| jerk_along(&self.machine.axes, *t)).fold(f64::INFINITY, f64::min);
        let row_count = rows.len() as u32 - first_row;
        Leg { ds_mm, cap_b: speed * speed, accel_mm_s2: 0.0, jerk_mm_s3, first_row, row_count }
    }

    fn push(&mut self, id: MoveId, tag: u32, leg: Leg) {
        self.track.chain.legs.push(leg);
        self.track.chain.point_b.push(f64::INFINITY);
        self.track.tags.push(tag);
        self.track.moves.push(id);
    }
}

fn junction_speed(before: Side, after: Side, mode: PathMode, machine: &Machine) -> f64 {
    let tolerance_mm = match mode {
        PathMode::ExactStop => return 0.0,
        PathMode::ExactPath => 0.0,
        PathMode::Tolerance(tolerance_mm) => tolerance_mm,
        PathMode::Continuous => machine.corner_tolerance_mm,
    };
    corner_speed(before, after, tolerance_mm, &machine.axes)
}
