//! A tool at one spindle speed in one material, ready to be asked about any number of stations.
//!
//! In: tool, material, spindle, process, rings, speed. Out: a [`LoadLine`] per station. The rotation is swept once: every
//! entry and exit of an edge adds or removes its precomputed contribution (see [`super::rings`]), which gives the spans
//! of the peak; means are closed integrals over the engaged arcs.

use super::ForceError;
use super::beam::Beam;
use super::coefficients::linear_edge;
use super::line::{Affine, LoadLine, Span};
use super::loads::{Cap, Loads};
use super::rings::{C, Ring, Sums, Teeth};
use super::zone::{Piece, Zone, clip};
use crate::engage::EngagedArc;
use crate::machine::material::{Material, Process};
use crate::machine::{LimitKind, Slice, Spindle, Tool};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Longest span without a candidate angle, rad: short enough that |F|², a trigonometric polynomial of degree four, has at
/// most one peak in it.
const LONGEST_SPAN_RAD: f64 = 0.2;
/// Angles arrive rounded to f32: a shorter span is an artefact of that rounding.
const SHORTEST_SPAN_RAD: f64 = 2e-6;

/// Engagement of one station.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cut<'a> {
    /// Engaged arcs, sorted by slice.
    pub arcs: &'a [EngagedArc],
    /// Vertical part of the unit feed direction (−1: straight down).
    pub tangent_z: f64,
}

/// A tool at one speed in one material.
#[derive(Debug, Clone, PartialEq)]
pub struct Cutter {
    rings: Vec<Ring>,
    teeth: Teeth,
    flutes: f64,
    largest_share: f64,
    rps: f64,
    tare_w: f64,
    beam: Beam,
}

impl Cutter {
    /// `slices` are those that the arcs of a [`Cut`] index; `rps` is the spindle speed in rev/s.
    pub fn new(
        tool: &Tool,
        material: &Material,
        spindle: &Spindle,
        process: &Process,
        slices: &[Slice],
        rps: f64,
    ) -> Result<Self, ForceError> {
        super::check::tool(tool)?;
        super::check::speed(spindle, rps)?;
        let k = linear_edge(material, process)?;
        let teeth = Teeth::of(tool);
        Ok(Self {
            rings: slices.iter().map(|slice| Ring::new(slice, &k, tool, &teeth)).collect(),
            largest_share: teeth.share.iter().copied().fold(0.0, f64::max),
            teeth,
            flutes: f64::from(tool.flutes),
            rps,
            tare_w: process.tare_w.unwrap_or_else(|| spindle.tare_w.at(rps)),
            beam: Beam::of(tool),
        })
    }

    /// Loads at one station and feed.
    pub fn loads(&self, cut: &Cut, feed_mm_s: f64) -> Loads {
        self.line(cut).loads(feed_mm_s)
    }

    /// Largest feed below which a load stays within `limit`.
    pub fn cap(&self, cut: &Cut, kind: LimitKind, limit: f64) -> Cap {
        self.line(cut).cap(kind, limit)
    }

    /// All loads of one station as functions of feed.
    pub fn line(&self, cut: &Cut) -> LoadLine {
        let tz = cut.tangent_z.clamp(-1.0, 1.0);
        let c = (1.0 - tz * tz).max(0.0).sqrt();
        let pieces = self.pieces(cut.arcs, tz);
        let mut line = LoadLine {
            rps: self.rps,
            per_feed: 1.0 / (self.flutes * self.rps),
            tare_w: self.tare_w,
            ..LoadLine::default()
        };
        self.means(&pieces, c, tz, &mut line);
        self.sweep(&pieces, c, tz, &mut line);
        line
    }

    fn pieces(&self, arcs: &[EngagedArc], tz: f64) -> Vec<Piece> {
        let mut pieces = Vec::with_capacity(arcs.len());
        for arc in arcs {
            let Some(ring) = self.rings.get(arc.slice as usize) else { continue };
            let zone = Zone::of(ring.n_r, ring.n_z, tz);
            clip(zone, arc.slice as usize, f64::from(arc.entry_rad), f64::from(arc.exit_rad), &mut pieces);
        }
        pieces
    }

    /// Averages over a revolution: N/2π ∫ over each piece. With J₀ = ∫ e^{−iφ} = i[e^{−iφ}] and
    /// J₁ = ∫ sin φ e^{−iφ} = Δφ/2i − [e^{−2iφ}]/4 the mean of w is Σ q_e J₀ + f q_c (c n_r J₁ + t_z n_z J₀).
    fn means(&self, pieces: &[Piece], c: f64, tz: f64, line: &mut LoadLine) {
        let (mut w_e, mut w_c) = (C::default(), C::default());
        let (mut z, mut torque) = (Affine::default(), Affine::default());
        let (mut area, mut contact, mut height, mut weight) = (0.0, 0.0, 0.0, 0.0);
        for piece in pieces {
            let ring = &self.rings[piece.slice];
            let (a, b) = (c * ring.n_r, tz * ring.n_z);
            let length = piece.angle[1] - piece.angle[0];
            let ends = [C::new(piece.cos[0], -piece.sin[0]), C::new(piece.cos[1], -piece.sin[1])];
            let j0 = C::new(0.0, 1.0) * (ends[1] - ends[0]);
            let j1 = C::new(0.0, -0.5 * length) - (ends[1] * ends[1] - ends[0] * ends[0]) * 0.25;
            let chip = a * (piece.cos[0] - piece.cos[1]) + b * length;
            w_e += ring.q_e * j0;
            w_c += ring.q_c * (j1 * a + j0 * b);
            z.base += ring.axial_e * length;
            z.slope += ring.axial_c * chip;
            torque.base += ring.tangential_e * ring.radius_mm * length;
            torque.slope += ring.tangential_c * ring.radius_mm * chip;
            area += ring.edge_mm * ring.radius_mm * chip;
            contact += ring.edge_mm * ring.radius_mm * length;
            height += ring.height_mm * ring.edge_mm * length;
            weight += ring.edge_mm * length;
            line.chip = line.chip.max(thickest(piece, a, b));
        }
        let share = self.flutes / TAU;
        line.mean[0] = Affine { base: w_e.re, slope: w_c.re }.scaled(share);
        line.mean[1] = Affine { base: w_e.im, slope: w_c.im }.scaled(share);
        line.mean[2] = z.scaled(share);
        line.torque = torque.scaled(share);
        line.chip *= self.largest_share;
        line.removal_area_mm2 = area;
        line.contact_mm2_per_rev = contact * self.flutes;
        let at = if weight > 0.0 { height / weight } else { 0.0 };
        line.compliance = [self.beam.tip_mm_per_n(at), self.beam.stress_mpa_per_n(at)];
    }

    /// One period of rotation, from entry to exit to entry.
    fn sweep(&self, pieces: &[Piece], c: f64, tz: f64, line: &mut LoadLine) {
        let mut sums = Sums::default();
        let mut events = self.events(pieces, &mut sums);
        events.sort_unstable_by(|a, b| a.theta.total_cmp(&b.theta));
        let mut from = (0.0, C::new(1.0, 0.0));
        let end = self.teeth.period_rad;
        line.spans.reserve(events.len() + 8);
        line.wall.reserve(events.iter().filter(|event| event.leaves_wall).count());
        for event in &events {
            push_spans(from, (event.theta, event.turn), &sums, [c, tz], line);
            let tooth = &self.rings[event.slice as usize].teeth[event.tooth as usize];
            if event.enters {
                sums.add(&tooth.sums);
            }
            if event.leaves_wall {
                line.wall.push(self.wall_force(event, &sums, [c, tz]));
            }
            if !event.enters {
                sums.subtract(&tooth.sums);
            }
            from = (event.theta, event.turn);
        }
        push_spans(from, (end, C::from_polar(1.0, end)), &sums, [c, tz], line);
    }

    /// Normal force in the plane, F_y = Im(e^{−iθ} (E + f B)), at an event that leaves the wall.
    fn wall_force(&self, event: &Event, sums: &Sums, [c, tz]: [f64; 2]) -> Affine {
        let back = event.turn.conj();
        let b = sums.c0 * event.turn * c + sums.c1 * tz + sums.c2 * back * c;
        let force = Affine { base: (back * sums.edge).im, slope: (back * b).im };
        force.scaled(self.rings[event.slice as usize].n_r)
    }

    /// Entries and exits within one period; `sums` becomes the state at its beginning.
    fn events(&self, pieces: &[Piece], sums: &mut Sums) -> Vec<Event> {
        let period = self.teeth.period_rad;
        let mut events = Vec::with_capacity(2 * pieces.len() * self.teeth.groups());
        for piece in pieces {
            let ring = &self.rings[piece.slice];
            for group in 0..self.teeth.groups() {
                let shift = ring.lag_rad - self.teeth.lead_rad[group];
                let mut place = |end: usize| {
                    let at = piece.angle[end] + shift;
                    let steps = floor(at / period);
                    let tooth = self.tooth_index(group, steps);
                    let turn = C::new(piece.cos[end], piece.sin[end]) * ring.teeth[tooth].turn;
                    events.push(Event {
                        theta: at - steps as f64 * period,
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
                    sums.add(&ring.teeth[self.tooth_index(group, step)].sums);
                }
            }
        }
        events
    }

    fn tooth_index(&self, group: usize, step: i64) -> usize {
        group * self.teeth.per_group + step.rem_euclid(self.teeth.per_group as i64) as usize
    }
}

/// Adds the spans from one event to the next.
fn push_spans(from: (f64, C), to: (f64, C), sums: &Sums, [c, tz]: [f64; 2], line: &mut LoadLine) {
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
        line.spans.push(Span::new(turn, next, step, sums, c, tz));
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
fn on_wall(angle: f64, end: usize) -> bool {
    let offset = if end == 0 { angle } else { angle - PI };
    offset.abs() < 1e-6 || (offset - TAU).abs() < 1e-6
}

/// Greatest whole number not above `x` (without the call that a baseline processor needs for `f64::floor`).
fn floor(x: f64) -> i64 {
    let whole = x as i64;
    whole - i64::from((whole as f64) > x)
}

/// Largest chip thickness per feed on a piece, a sin φ + b.
fn thickest(piece: &Piece, a: f64, b: f64) -> f64 {
    let top = FRAC_PI_2 + TAU * ((piece.angle[0] - FRAC_PI_2) / TAU).ceil();
    let sin = if top <= piece.angle[1] { 1.0 } else { piece.sin[0].max(piece.sin[1]) };
    a * sin + b
}
