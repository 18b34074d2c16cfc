//! One period of rotation, swept from event to event. In: the pieces that cut. Out: the [`Spans`] in which the same teeth
//! cut, from which every peak follows. Each entry or exit of an edge adds or removes its precomputed contribution.

use super::affine::{Affine, Span, Spans};
use super::means::Means;
use super::rings::{C, Rings, Sums};
use super::zone::{Piece, floor};
use std::f64::consts::{PI, TAU};

/// Longest span without a candidate angle, rad: short enough that |F|², a trigonometric polynomial of degree four, has at
/// most one peak in it.
const LONGEST_SPAN_RAD: f64 = 0.2;
/// Angles arrive rounded to f32: a shorter span is an artefact of that rounding.
const SHORTEST_SPAN_RAD: f64 = 2e-6;

/// One period of rotation, from entry to exit to entry.
pub(super) fn sweep(rings: &Rings, pieces: &[Piece], direction: [f64; 2], mean: &Means) -> Spans {
    let mut sums = Sums::default();
    let events = events_of(rings, pieces, &mut sums);
    let mut spans = Vec::with_capacity(events.len() + 8);
    let mut wall = Vec::with_capacity(pieces.len());
    let mut from = (0.0, C::new(1.0, 0.0));
    let end = rings.teeth.period_rad;
    for event in in_order(&events) {
        push_spans(from, (event.theta, event.turn), &sums, direction, &mut spans);
        let tooth = &rings.teeth_of[event.slice as usize][event.tooth as usize];
        if event.enters {
            sums.add(&tooth.sums);
        }
        if event.leaves_wall {
            wall.push(wall_force(event, &sums, direction).scaled(rings.list[event.slice as usize].n_r));
        }
        if !event.enters {
            sums.subtract(&tooth.sums);
        }
        from = (event.theta, event.turn);
    }
    push_spans(from, (end, C::from_polar(1.0, end)), &sums, direction, &mut spans);
    Spans { list: spans, wall, ..mean.spans() }
}

/// Normal force in the plane, F_y = Im(e^{−iθ} (E + f B)), at an event that leaves the wall.
fn wall_force(event: &Event, sums: &Sums, [c, tz]: [f64; 2]) -> Affine {
    let back = event.turn.conj();
    let b = sums.c0 * event.turn * c + sums.c1 * tz + sums.c2 * back * c;
    Affine { base: (back * sums.edge).im, slope: (back * b).im }
}

/// Entries and exits within one period; `sums` becomes the state at its beginning.
fn events_of(rings: &Rings, pieces: &[Piece], sums: &mut Sums) -> Vec<Event> {
    let (period, per_period) = (rings.teeth.period_rad, rings.teeth.period_rad.recip());
    let mut events = Vec::with_capacity(2 * pieces.len() * rings.teeth.groups());
    for piece in pieces {
        let (ring, teeth) = (&rings.list[piece.slice], &rings.teeth_of[piece.slice]);
        for group in 0..rings.teeth.groups() {
            let shift = ring.lag_rad - rings.teeth.lead_rad[group];
            let mut place = |end: usize| {
                let at = piece.angle[end] + shift;
                let steps = floor(at * per_period) as i32;
                let tooth = rings.teeth.index(group, steps);
                let turn = C::new(piece.cos[end], piece.sin[end]) * teeth[tooth].turn;
                events.push(Event {
                    theta: (at - f64::from(steps) * period).max(0.0),
                    turn,
                    slice: piece.slice as u32,
                    tooth: tooth as u32,
                    enters: end == 0,
                    leaves_wall: on_wall(piece.angle[end], end),
                });
                steps
            };
            let (first, last) = (place(0), place(1));
            for step in first + 1..=last {
                sums.add(&teeth[rings.teeth.index(group, step)].sums);
            }
        }
    }
    events
}
/// Events by angle. Angles are not negative, so their bits sort as they do; the lowest bits make room for the index.
fn in_order(events: &[Event]) -> impl Iterator<Item = &Event> {
    let room = events.len().next_power_of_two() as u64 - 1;
    let key = |(index, event): (usize, &Event)| event.theta.to_bits() & !room | index as u64;
    let mut keys: Vec<u64> = events.iter().enumerate().map(key).collect();
    keys.sort_unstable();
    keys.into_iter().map(move |key| &events[(key & room) as usize])
}

/// Adds the spans from one event to the next.
fn push_spans(from: (f64, C), to: (f64, C), sums: &Sums, [c, tz]: [f64; 2], out: &mut Vec<Span>) {
    let length = to.0 - from.0;
    if length < SHORTEST_SPAN_RAD {
        return;
    }
    let parts = if length > LONGEST_SPAN_RAD { (length / LONGEST_SPAN_RAD).ceil() } else { 1.0 };
    let step = length / parts;
    let advance = if parts > 1.0 { C::from_polar(1.0, step) } else { C::default() };
    let mut turn = from.1;
    for part in 1..=parts as u32 {
        let next = if f64::from(part) == parts { to.1 } else { turn * advance };
        out.push(Span::new(turn, next, step, sums, c, tz));
        turn = next;
    }
}

/// An edge enters or leaves the material.
struct Event {
    theta: f64,
    turn: C,
    slice: u32,
    tooth: u32,
    enters: bool,
    leaves_wall: bool,
}

/// Up-milling leaves the wall where an edge enters at φ = 0, climb where it leaves at φ = π.
pub(super) fn on_wall(angle: f64, end: usize) -> bool {
    let offset = if end == 0 { angle } else { angle - PI };
    offset.abs() < 1e-6 || (offset - TAU).abs() < 1e-6
}
