//! A tool at one spindle speed in one material, ready to be asked about any number of stations.
//!
//! In: tool, material, spindle, process, rings, speed. Out: a [`LoadLine`] per station. The rotation is swept once: every
//! entry and exit of an edge adds or removes its precomputed contribution (see [`super::rings`]), which gives the spans
//! of the peak; means are closed integrals over the engaged arcs.

use super::ForceError;
use super::affine::{Affine, Span, Spans};
use super::beam::Beam;
use super::kinds::{Kind, before, kind_of, radii};
use super::laws::{Conditions, Law};
use super::line::{Engine, LoadLine, Station};
use super::loads::{Cap, Loads};
use super::modifiers::Effects;
use super::rings::{C, Ring, Sums, Teeth, ToothRing};
use super::scan::{ANGLES_PER_TURN, Before, Edge, GAUSS, Node, Scan};
use super::summary::{Layer, Summary};
use super::surface::{self, Moment, WallPoint};
use super::zone::{Piece, Zone, clip};
use crate::effects::State;
use crate::engage::EngagedArc;
use crate::machine::material::{Material, Process};
use crate::machine::{LimitKind, Segment, Slice, Spindle, Tool};
use crate::units::rpm_from_rps;
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
    /// What effects look at: time, distance slid, position … Speed, chip thickness, depths and the share of up-milling are
    /// filled in from the engagement.
    pub state: State,
}

/// A tool at one speed in one material.
#[derive(Debug, Clone, PartialEq)]
pub struct Cutter {
    kind: Kind,
    rings: Vec<Ring>,
    /// Teeth of each ring.
    ring_teeth: Vec<Vec<ToothRing>>,
    teeth: Teeth,
    /// For each tooth, what it meets of those before it.
    before: Vec<Vec<Before>>,
    /// How far each tooth stands out by runout, mm, in the order in which they pass.
    radii: Vec<f64>,
    flutes: f64,
    radius_mm: f64,
    rps: f64,
    tare_w: f64,
    beam: Beam,
    effects: Effects,
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
        let model = process.base.as_ref().unwrap_or(&material.model);
        let (kind, coefficients) = kind_of(model, tool)?;
        let teeth = Teeth::of(tool);
        let curved =
            |slice: &Slice| matches!(tool.profile.segments.get(slice.segment as usize), Some(Segment::Arc { .. }));
        let rings: Vec<Ring> =
            slices.iter().map(|slice| Ring::new(slice, coefficients.of(slice, curved(slice)), tool)).collect();
        let exact = kind == Kind::Exact && tool.runout.is_none_or(|runout| runout.offset_mm == 0.0);
        Ok(Self {
            kind: if kind == Kind::Exact && !exact { Kind::Sampled { law: Law::Rings, bends: false } } else { kind },
            ring_teeth: rings.iter().map(|ring| ring.teeth(&teeth)).collect(),
            rings,
            before: before(tool),
            radii: radii(tool),
            teeth,
            flutes: f64::from(tool.flutes),
            radius_mm: tool.radius_mm(),
            rps,
            tare_w: tare_w(spindle, process, rps),
            beam: Beam::of(tool),
            effects: Effects::of(process)?,
        })
    }

    /// Limits that the force model says nothing about: they cannot be held.
    pub fn silent_about(&self) -> &'static [LimitKind] {
        match &self.kind {
            Kind::Summed { .. } | Kind::Sampled { law: Law::Polynomial(_), .. } => &[LimitKind::ForceAxial],
            _ => &[],
        }
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
        let direction = [(1.0 - tz * tz).max(0.0).sqrt(), tz];
        let pieces = self.pieces(cut.arcs, tz);
        let mean = self.means(&pieces, direction);
        let station = Station {
            rps: self.rps,
            per_feed: 1.0 / (self.flutes * self.rps),
            tare_w: self.tare_w,
            compliance: [self.beam.tip_mm_per_n(mean.height_mm), self.beam.stress_mpa_per_n(mean.height_mm)],
        };
        LoadLine {
            modifiers: self.effects.at(&self.state(cut, &mean), mean.chip_mm()),
            removal_area_mm2: mean.removal_mm2,
            contact_mm2_per_rev: mean.contact_mm2 * self.flutes,
            engine: match &self.kind {
                Kind::Exact => Engine::Spans(self.sweep(&pieces, direction, &mean)),
                Kind::Sampled { law, bends } => {
                    let bends = bends.then_some(station.compliance[0]);
                    Engine::Scan(Box::new(self.scan(&pieces, direction, &mean, law, bends)))
                }
                Kind::Summed { formula, normal_share } => Engine::Summary(Summary {
                    formula: formula.clone(),
                    normal_share: *normal_share,
                    flutes: self.flutes,
                    layers: self.layers(&pieces),
                }),
            },
            station,
        }
    }

    /// The wall that the teeth leave at a feed, by height; empty where no edge leaves one.
    pub fn wall(&self, cut: &Cut, feed_mm_s: f64) -> Vec<WallPoint> {
        let tz = cut.tangent_z.clamp(-1.0, 1.0);
        let direction = [(1.0 - tz * tz).max(0.0).sqrt(), tz];
        let pieces = self.pieces(cut.arcs, tz);
        let mean = self.means(&pieces, direction);
        let law = match &self.kind {
            Kind::Sampled { law, .. } => law.clone(),
            Kind::Exact => Law::Rings,
            Kind::Summed { .. } => return Vec::new(),
        };
        let scan = self.scan(&pieces, direction, &mean, &law, None);
        let moments = self.moments(&pieces, direction);
        surface::wall(&scan, &moments, &self.beam, feed_mm_s / (self.flutes * self.rps))
    }

    /// Every moment in a turn at which an edge of the side leaves the wall.
    fn moments(&self, pieces: &[Piece], direction: [f64; 2]) -> Vec<Moment> {
        let mut moments = Vec::new();
        for piece in pieces.iter().filter(|piece| self.rings[piece.slice].n_r > 0.999) {
            for end in [0, 1] {
                if !on_wall(piece.angle[end], end) {
                    continue;
                }
                for (group, tooth) in self.all_teeth() {
                    let theta = piece.angle[end] + self.rings[piece.slice].lag_rad - self.lead(group, tooth);
                    // Just inside the material, where the edge still cuts.
                    let theta = if end == 0 { theta + 1e-9 } else { theta - 1e-9 };
                    let mut edges = Vec::new();
                    for other in pieces {
                        self.edges(other, theta, 0.0, direction, &mut edges);
                    }
                    let radius_mm = self.radii[self.order(group, tooth)];
                    moments.push(Moment {
                        ring: piece.slice,
                        radius_mm,
                        side: if end == 0 { -1.0 } else { 1.0 },
                        edges,
                    });
                }
            }
        }
        moments
    }

    fn all_teeth(&self) -> impl Iterator<Item = (usize, usize)> {
        let per_group = self.teeth.per_group;
        (0..self.teeth.groups()).flat_map(move |group| (0..per_group).map(move |tooth| (group, tooth)))
    }

    /// Angle by which a tooth leads tooth 1.
    fn lead(&self, group: usize, tooth: usize) -> f64 {
        self.teeth.lead_rad[group] + tooth as f64 * self.teeth.period_rad
    }

    /// What effects see of this station.
    fn state(&self, cut: &Cut, mean: &Means) -> State {
        let given = &cut.state;
        let known = |given: f64, own: f64| if given.is_finite() { given } else { own };
        State {
            rps: self.rps,
            cutting_speed_mm_s: TAU * self.radius_mm * self.rps,
            axial_depth_mm: known(given.axial_depth_mm, mean.depth_mm),
            radial_depth_mm: known(given.radial_depth_mm, mean.radial_depth_mm),
            up_share: known(given.up_share, mean.up_share),
            edge_position_mm: known(given.edge_position_mm, mean.height_mm),
            ..*given
        }
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
    fn means(&self, pieces: &[Piece], [c, tz]: [f64; 2]) -> Means {
        let mut mean = Means::default();
        let (mut w_e, mut w_c) = (C::default(), C::default());
        let (mut weight, mut up) = (0.0, 0.0);
        for piece in pieces {
            let ring = &self.rings[piece.slice];
            let (a, b) = (c * ring.n_r, tz * ring.n_z);
            let length = piece.angle[1] - piece.angle[0];
            let (j0, j1) = piece.harmonics();
            let chip = a * (piece.cos[0] - piece.cos[1]) + b * length;
            w_e += ring.q_e * j0;
            w_c += ring.q_c * (j1 * a + j0 * b);
            mean.axial.base += ring.axial_e * length;
            mean.axial.slope += ring.axial_c * chip;
            mean.torque.base += ring.tangential_e * ring.radius_mm * length;
            mean.torque.slope += ring.tangential_c * ring.radius_mm * chip;
            mean.removal_mm2 += ring.edge_mm * ring.radius_mm * chip;
            mean.contact_mm2 += ring.edge_mm * ring.radius_mm * length;
            mean.height_mm += ring.height_mm * ring.edge_mm * length;
            mean.depth_mm = mean.depth_mm.max(ring.height_mm + 0.5 * ring.edge_mm * ring.n_r);
            mean.radial_depth_mm = mean.radial_depth_mm.max(ring.radius_mm * (piece.cos[0] - piece.cos[1]));
            weight += ring.edge_mm * length;
            up += ring.edge_mm * piece.up_less_climb();
            mean.chip = mean.chip.max(thickest(piece, a, b));
        }
        let share = self.flutes / TAU;
        mean.plane = [Affine { base: w_e.re, slope: w_c.re }, Affine { base: w_e.im, slope: w_c.im }];
        mean.plane = mean.plane.map(|component| component.scaled(share));
        mean.axial = mean.axial.scaled(share);
        mean.torque = mean.torque.scaled(share);
        mean.chip *= self.teeth.share.iter().copied().fold(0.0, f64::max);
        if weight > 0.0 {
            mean.height_mm /= weight;
            mean.up_share = up / weight;
        }
        mean
    }

    /// One period of rotation, from entry to exit to entry.
    fn sweep(&self, pieces: &[Piece], direction: [f64; 2], mean: &Means) -> Spans {
        let mut sums = Sums::default();
        let mut events = self.events(pieces, &mut sums);
        events.sort_unstable_by(|a, b| a.theta.total_cmp(&b.theta));
        let mut spans = Vec::with_capacity(events.len() + 8);
        let mut wall = Vec::with_capacity(events.iter().filter(|event| event.leaves_wall).count());
        let mut from = (0.0, C::new(1.0, 0.0));
        let end = self.teeth.period_rad;
        for event in &events {
            push_spans(from, (event.theta, event.turn), &sums, direction, &mut spans);
            let tooth = &self.ring_teeth[event.slice as usize][event.tooth as usize];
            if event.enters {
                sums.add(&tooth.sums);
            }
            if event.leaves_wall {
                wall.push(self.wall_force(event, &sums, direction));
            }
            if !event.enters {
                sums.subtract(&tooth.sums);
            }
            from = (event.theta, event.turn);
        }
        push_spans(from, (end, C::from_polar(1.0, end)), &sums, direction, &mut spans);
        let [x, y] = mean.plane;
        Spans { list: spans, mean: [x, y, mean.axial], torque: mean.torque, wall, chip: mean.chip }
    }

    /// The station sampled over a pitch, or over a turn where the teeth differ; `bends` is the compliance of a tool whose
    /// deflection changes the chip.
    fn scan(&self, pieces: &[Piece], [c, tz]: [f64; 2], mean: &Means, law: &Law, bends: Option<f64>) -> Scan {
        let differ = self.before.iter().any(|paths| paths.len() > 1) || self.teeth.groups() > 1;
        let per_tooth = ANGLES_PER_TURN.div_ceil(self.flutes as usize);
        let angles = if differ { per_tooth * self.flutes as usize } else { per_tooth };
        let step = TAU / (per_tooth as f64 * self.flutes);
        let mut scan = Scan {
            rings: self.rings.clone(),
            law: law.clone(),
            edges: Vec::new(),
            nodes: pieces.iter().flat_map(|piece| self.nodes(piece, [c, tz])).collect(),
            starts: vec![0],
            before: self.before.clone(),
            angles_per_tooth: if bends.is_some() && differ && self.teeth.groups() == 1 { per_tooth } else { 0 },
            compliance_mm_n: bends.unwrap_or(0.0),
            conditions: Conditions {
                axial_depth_mm: mean.depth_mm,
                radial_depth_mm: mean.radial_depth_mm,
                rpm: rpm_from_rps(self.rps),
                ..Conditions::default()
            },
            chip: mean.chip,
        };
        for angle in 0..angles {
            let theta = (angle as f64 + 0.5) * step;
            for piece in pieces {
                self.edges(piece, theta, step, [c, tz], &mut scan.edges);
            }
            scan.starts.push(scan.edges.len() as u32);
        }
        scan
    }

    /// The teeth that cut on a piece at rotation θ.
    fn edges(&self, piece: &Piece, theta: f64, step: f64, [c, tz]: [f64; 2], out: &mut Vec<Edge>) {
        let ring = &self.rings[piece.slice];
        for (group, tooth) in self.all_teeth() {
            let phi = theta + self.lead(group, tooth) - ring.lag_rad;
            let phi = phi - TAU * floor((phi - piece.angle[0]) / TAU) as f64;
            if phi > piece.angle[1] {
                continue;
            }
            let (sin, cos) = phi.sin_cos();
            let near = |end: usize| on_wall(piece.angle[end], end) && (phi - piece.angle[end]).abs() <= 0.5 * step;
            out.push(Edge {
                ring: piece.slice as u16,
                tooth: self.order(group, tooth) as u16,
                on_wall: near(0) || near(1),
                sin,
                cos,
                chip: c * ring.n_r * sin + tz * ring.n_z,
            });
        }
    }

    /// Quadrature over a piece.
    fn nodes(&self, piece: &Piece, [c, tz]: [f64; 2]) -> [Node; 8] {
        let ring = &self.rings[piece.slice];
        let (middle, half) = (0.5 * (piece.angle[0] + piece.angle[1]), 0.5 * (piece.angle[1] - piece.angle[0]));
        GAUSS.map(|[x, weight]| {
            let (sin, cos) = (middle + half * x).sin_cos();
            let chip = c * ring.n_r * sin + tz * ring.n_z;
            let edge = Edge { ring: piece.slice as u16, tooth: 0, on_wall: false, sin, cos, chip };
            Node { edge, weight: half * weight }
        })
    }

    /// Place of a tooth in the order in which they pass, tooth 1 being 0.
    fn order(&self, group: usize, tooth: usize) -> usize {
        if self.teeth.groups() > 1 { group } else { (self.teeth.per_group - tooth) % self.teeth.per_group }
    }

    fn layers(&self, pieces: &[Piece]) -> Vec<Layer> {
        let layer = |piece: &Piece| {
            let ring = &self.rings[piece.slice];
            Layer {
                height_mm: ring.edge_mm * ring.n_r,
                radius_mm: ring.radius_mm,
                contact_mm: ring.radius_mm * (piece.angle[1] - piece.angle[0]),
                sin: thickest(piece, 1.0, 0.0),
                chip: piece.cos[0] - piece.cos[1],
                direction: piece.harmonics().1,
            }
        };
        pieces.iter().map(layer).collect()
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
            let (ring, teeth) = (&self.rings[piece.slice], &self.ring_teeth[piece.slice]);
            for group in 0..self.teeth.groups() {
                let shift = ring.lag_rad - self.teeth.lead_rad[group];
                let mut place = |end: usize| {
                    let at = piece.angle[end] + shift;
                    let steps = floor(at / period);
                    let tooth = self.tooth_index(group, steps);
                    let turn = C::new(piece.cos[end], piece.sin[end]) * teeth[tooth].turn;
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
                    sums.add(&teeth[self.tooth_index(group, step)].sums);
                }
            }
        }
        events
    }

    fn tooth_index(&self, group: usize, step: i64) -> usize {
        group * self.teeth.per_group + step.rem_euclid(self.teeth.per_group as i64) as usize
    }
}

/// Power with nothing cut: the spindle's, or what was learned at one speed, along the spindle's curve.
fn tare_w(spindle: &Spindle, process: &Process, rps: f64) -> f64 {
    let declared = spindle.tare_w.at(rps);
    let Some(learned) = process.tare_w else { return declared };
    let there = process.tare_rps.map_or(0.0, |reference| spindle.tare_w.at(reference));
    if there > 0.0 { learned * declared / there } else { learned }
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

/// Averages over a revolution, per feed per tooth where they depend on feed.
#[derive(Debug, Clone, Copy, Default)]
struct Means {
    plane: [Affine; 2],
    axial: Affine,
    torque: Affine,
    /// Largest chip thickness.
    chip: f64,
    removal_mm2: f64,
    /// Swept by one edge in one revolution.
    contact_mm2: f64,
    /// Mean height of the engaged edges.
    height_mm: f64,
    depth_mm: f64,
    radial_depth_mm: f64,
    /// −1 all climb, +1 all up.
    up_share: f64,
}

impl Means {
    /// Chip thickness averaged over the contact, per feed per tooth.
    fn chip_mm(&self) -> f64 {
        if self.contact_mm2 > 0.0 { self.removal_mm2 / self.contact_mm2 } else { 0.0 }
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
