//! A toolpath as text, for comparison with a control. In: a [`Toolpath`]. Out: one motion or event a line; mm, active work coordinates, six
//! decimals.
//!
//! `LINE rapid|feed X Y Z`, `LINE arc PLANE X Y Z CX CY CZ TURNS`, `LINE dwell S`, `LINE tool N`, `LINE spindle RPM`,
//! `LINE stop`.

use std::f64::consts::TAU;
use std::fmt::Write;

use super::toolpath::{Event, Move, MoveKind, Toolpath};
use crate::path::{Curve, Vec3};
use crate::units::rpm_from_rps;

/// The motions and other events as text.
pub fn toolpath_text(path: &Toolpath) -> String {
    let mut text = String::with_capacity(path.moves.len() * 40);
    for event in path.events() {
        let written = match event {
            Event::Move(id) => write_move(&mut text, &path.moves[id.ix()], path.shift_at(id)),
            Event::Dwell { seconds, line } => writeln!(text, "{line} dwell {}", number(seconds)),
            Event::Tool { number, line } => writeln!(text, "{line} tool {number}"),
            Event::Spindle { spin, line } => {
                let rpm = rpm_from_rps(spin.rps);
                writeln!(text, "{line} spindle {}", number(if spin.reverse { -rpm } else { rpm }))
            }
            Event::Stop { line, .. } => writeln!(text, "{line} stop"),
        };
        debug_assert!(written.is_ok(), "a String takes every text");
    }
    text
}

fn write_move(text: &mut String, motion: &Move, shift: Vec3) -> std::fmt::Result {
    let to = motion.curve().to() - shift;
    match motion.curve() {
        Curve::Line { .. } => {
            let kind = if motion.kind == MoveKind::Rapid { "rapid" } else { "feed" };
            writeln!(text, "{} {kind} {}", motion.line, point(to))
        }
        Curve::Arc(arc) => {
            let (plane, turns) = (arc.plane.name(), number(arc.sweep_rad / TAU));
            writeln!(text, "{} arc {plane} {} {} {turns}", motion.line, point(to), point(arc.centre - shift))
        }
    }
}

fn point(p: Vec3) -> String {
    format!("{} {} {}", number(p.x), number(p.y), number(p.z))
}

/// Six decimals, without a negative zero.
fn number(value: f64) -> String {
    let text = format!("{value:.6}");
    if text.trim_start_matches('-').bytes().all(|byte| matches!(byte, b'0' | b'.')) { "0.000000".into() } else { text }
}
