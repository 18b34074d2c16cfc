//! A tool at one spindle speed in one material. In: tool, material, spindle, process model, rings, speed; then the engaged arcs of any number of
//! stations. Out: a [`LoadLine`] per station: peaks from one sweep of the rotation
//! ([`super::sweep`]), means from closed integrals over the engaged arcs ([`super::means`]), or either from samples
//! ([`super::scan`]) where the model is not linear.

use super::affine::Spans;
use super::beam::Beam;
use super::beside::{on_the_way, several_cut};
use super::error::ForceError;
use super::helix;
use super::kinds::{Kind, before, kind_of, radii};
use super::laws::{Conditions, Law};
use super::line::{Engine, LoadLine, Station};
use super::loads::Loads;
use super::means::{Means, means, top_sin};
use super::modifiers::Effects;
use super::rings::{Ring, Rings, Teeth};
use super::scan::{ANGLES_PER_TURN, Before, Edge, GAUSS, Node, Scan};
use super::summary::{Layer, Summary};
use super::surface::{self, Moment, WallPoint};
use super::sweep::{on_wall, sweep};
use super::zone::{Piece, Zone, clip, floor};
use crate::effects::{AlongEdge, EdgePiece, State};
use crate::engage::EngagedArc;
use crate::machine::material::{Material, Process};
use crate::machine::{LimitKind, Segment, Slice, Spindle, Tool};
use crate::units::rpm_from_rps;
use std::f64::consts::{PI, TAU};

/// Engagement of one station.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cut<'a> {
    /// Engaged arcs, sorted by slice.
    pub arcs: &'a [EngagedArc],
    /// Those at both ends of the station, or of the stations before and after on the same path, where there are any: what is on the way to what it
    /// shares with them counts as engaged too.
    pub beside: [&'a [EngagedArc]; 2],
    /// Vertical part of the unit feed direction (−1: straight down).
    pub tangent_z: f64,
    /// The state on which effects depend: time, sliding distance, position … Cutting speed, chip thickness, depths and the share of
    /// up-milling are filled in here from the engagement.
    pub state: State,
}

/// A tool at one speed in one material.
#[derive(Debug, Clone, PartialEq)]
pub struct Cutter {
    kind: Kind,
    rings: Rings,
    /// For each tooth, the paths of the teeth before it.
    before: Vec<Vec<Before>>,
    /// How far each tooth stands out by runout, mm, in the order in which they pass.
    radii: Vec<f64>,
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
        let curved =
            |slice: &Slice| matches!(tool.profile.segments.get(slice.segment as usize), Some(Segment::Arc { .. }));
        let rings: Vec<Ring> =
            slices.iter().map(|slice| Ring::new(slice, coefficients.of(slice, curved(slice)), tool)).collect();
        let (effects, wearing) = Effects::of(process)?;
        if let Some(effect) = wearing.filter(|_| !has_edge_force(&kind, &rings, tool)) {
            return Err(ForceError::NoEdgeForce { effect, model: model.name().to_owned() });
        }
        let exact = kind == Kind::Exact && tool.runout.is_none_or(|runout| runout.offset_mm == 0.0);
        Ok(Self {
            kind: if kind == Kind::Exact && !exact { Kind::Sampled { law: Law::Rings, bends: false } } else { kind },
            rings: Rings::new(rings, Teeth::of(tool)),
            before: before(tool),
            radii: radii(tool),
            radius_mm: tool.radius_mm(),
            rps,
            tare_w: tare_w(spindle, process, rps),
            beam: Beam::of(tool),
            effects,
        })
    }

    /// Loads that the force model does not give, so that limits on them cannot be held.
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

    /// All loads of one station as functions of feed.
    pub fn line(&self, cut: &Cut) -> LoadLine {
        let tz = cut.tangent_z.clamp(-1.0, 1.0);
        let direction = [(1.0 - tz * tz).max(0.0).sqrt(), tz];
        let pieces = self.pieces(cut.arcs, direction);
        let mean = means(&self.rings, &pieces, direction);
        let station = Station {
            rps: self.rps,
            per_feed: 1.0 / (self.rings.flutes() * self.rps),
            tare_w: self.tare_w,
            compliance: [self.beam.tip_mm_per_n(mean.height_mm), self.beam.stress_mpa_per_n(mean.height_mm)],
            excess: self.effects.excess(),
        };
        LoadLine {
            modifiers: self.effects.at(&self.state(cut, &mean, &pieces, direction), mean.chip_mm()),
            removal_area_mm2: mean.removal_mm2,
            contact_mm2_per_rev: mean.contact_mm2 * self.rings.flutes(),
            engine: match &self.kind {
                Kind::Exact => Engine::Spans(self.spans(&pieces, cut.beside, direction, &mean)),
                Kind::Sampled { law, bends } => {
                    let bends = bends.then_some(station.compliance[0]);
                    Engine::Scan(Box::new(self.scan(&pieces, direction, &mean, law, bends)))
                }
                Kind::Summed { formula, normal_share } => Engine::Summary(Summary {
                    formula: formula.clone(),
                    normal_share: *normal_share,
                    flutes: self.rings.flutes(),
                    layers: self.layers(&pieces),
                }),
            },
            station,
        }
    }

    /// Forces over a revolution of the linear model: of all that cuts, and of what cuts on the way to the stations beside it.
    fn spans(&self, pieces: &[Piece], beside: [&[EngagedArc]; 2], direction: [f64; 2], mean: &Means) -> Spans {
        let of = |pieces: &[Piece]| {
            if helix::is_spread(&self.rings, pieces) {
                return helix::turn(&self.rings, pieces, direction, mean);
            }
            sweep(&self.rings, pieces, direction, mean)
        };
        let mut spans = of(pieces);
        if beside.iter().all(|arcs| arcs.is_empty()) || !several_cut(&self.rings, pieces) {
            return spans;
        }
        for step in beside.into_iter().flat_map(|arcs| on_the_way(pieces, &self.pieces(arcs, direction))) {
            let more = of(&step);
            spans.list.extend(more.list);
            spans.points.extend(more.points);
        }
        spans
    }

    /// The wall that the teeth leave at a feed, by height; empty where no edge leaves one.
    pub fn wall(&self, cut: &Cut, feed_mm_s: f64) -> Vec<WallPoint> {
        let tz = cut.tangent_z.clamp(-1.0, 1.0);
        let direction = [(1.0 - tz * tz).max(0.0).sqrt(), tz];
        let pieces = self.pieces(cut.arcs, direction);
        let mean = means(&self.rings, &pieces, direction);
        let law = match &self.kind {
            Kind::Sampled { law, .. } => law.clone(),
            Kind::Exact => Law::Rings,
            Kind::Summed { .. } => return Vec::new(),
        };
        let scan = self.scan(&pieces, direction, &mean, &law, None);
        let moments = self.moments(&pieces, direction);
        surface::wall(&scan, &moments, &self.beam, feed_mm_s / (self.rings.flutes() * self.rps))
    }

    /// Every moment in a turn at which an edge of the side leaves the wall.
    fn moments(&self, pieces: &[Piece], direction: [f64; 2]) -> Vec<Moment> {
        let mut moments = Vec::new();
        for piece in pieces.iter().filter(|piece| self.rings.list[piece.slice].n_r > 0.999) {
            for end in [0, 1] {
                if !on_wall(piece.angle[end], end) {
                    continue;
                }
                for (group, tooth) in self.all_teeth() {
                    let theta = piece.angle[end] + self.rings.list[piece.slice].lag_rad - self.lead(group, tooth);
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
        let per_group = self.rings.teeth.per_group;
        (0..self.rings.teeth.groups()).flat_map(move |group| (0..per_group).map(move |tooth| (group, tooth)))
    }

    /// Angle by which a tooth leads tooth 1.
    fn lead(&self, group: usize, tooth: usize) -> f64 {
        self.rings.teeth.lead_rad[group] + tooth as f64 * self.rings.teeth.period_rad
    }

    /// The state on which effects depend, filled in for this station.
    fn state(&self, cut: &Cut, mean: &Means, pieces: &[Piece], direction: [f64; 2]) -> State {
        let given = &cut.state;
        let known = |given: f64, own: f64| if given.is_finite() { given } else { own };
        let is_given = given.along_edge.is_known() || self.effects.is_empty();
        State {
            rps: self.rps,
            cutting_speed_mm_s: TAU * self.radius_mm * self.rps,
            axial_depth_mm: known(given.axial_depth_mm, mean.depth_mm),
            radial_depth_mm: known(given.radial_depth_mm, mean.radial_depth_mm),
            immersion_rad: known(given.immersion_rad, mean.immersion_rad),
            up_share: known(given.up_share, mean.up_share),
            along_edge: if is_given { given.along_edge } else { self.along_edge(pieces, direction) },
            ..*given
        }
    }

    fn along_edge(&self, pieces: &[Piece], [c, tz]: [f64; 2]) -> AlongEdge {
        AlongEdge::of(pieces.iter().map(|piece| {
            let (ring, length_rad) = (&self.rings.list[piece.slice], piece.angle[1] - piece.angle[0]);
            let (half_mm, area_mm2) = (0.5 * (ring.edge_mm * ring.n_r).abs(), ring.edge_mm * ring.radius_mm);
            let chip = c * ring.n_r * (piece.cos[0] - piece.cos[1]) + tz * ring.n_z * length_rad;
            EdgePiece {
                from_to_mm: [ring.height_mm - half_mm, ring.height_mm + half_mm],
                section_and_contact_mm2: [area_mm2 * chip.max(0.0), area_mm2 * length_rad],
            }
        }))
    }

    fn pieces(&self, arcs: &[EngagedArc], direction: [f64; 2]) -> Vec<Piece> {
        let mut pieces = Vec::with_capacity(arcs.len());
        for arc in arcs {
            let Some(ring) = self.rings.list.get(arc.slice as usize) else { continue };
            let zone = Zone::of(ring.n_r, ring.n_z, direction);
            clip(zone, arc.slice as usize, f64::from(arc.entry_rad), f64::from(arc.exit_rad), &mut pieces);
        }
        pieces
    }

    /// The station sampled over a pitch, or over a turn where the teeth differ; `bends` is the compliance of a tool whose
    /// deflection changes the chip.
    fn scan(&self, pieces: &[Piece], [c, tz]: [f64; 2], mean: &Means, law: &Law, bends: Option<f64>) -> Scan {
        let differ = self.before.iter().any(|paths| paths.len() > 1) || self.rings.teeth.groups() > 1;
        let per_tooth = ANGLES_PER_TURN.div_ceil(self.rings.flutes() as usize);
        let angles = if differ { per_tooth * self.rings.flutes() as usize } else { per_tooth };
        let step = TAU / (per_tooth as f64 * self.rings.flutes());
        let mut scan = Scan {
            rings: self.rings.list.clone(),
            law: law.clone(),
            edges: Vec::new(),
            nodes: pieces.iter().flat_map(|piece| self.nodes(piece, [c, tz])).collect(),
            starts: vec![0],
            before: self.before.clone(),
            angles_per_tooth: if bends.is_some() && differ && self.rings.teeth.groups() == 1 { per_tooth } else { 0 },
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
        let ring = &self.rings.list[piece.slice];
        for (group, tooth) in self.all_teeth() {
            let phi = theta + self.lead(group, tooth) - ring.lag_rad;
            let phi = phi - TAU * floor((phi - piece.angle[0]) / TAU) as f64;
            if phi > piece.angle[1] {
                continue;
            }
            let (sin, cos) = phi.sin_cos();
            let near = |end: usize| on_wall(piece.angle[end], end) && (phi - piece.angle[end]).abs() <= 0.5 * step;
            out.push(Edge {
                ring: piece.slice as u32,
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
        let ring = &self.rings.list[piece.slice];
        let (middle, half) = (0.5 * (piece.angle[0] + piece.angle[1]), 0.5 * (piece.angle[1] - piece.angle[0]));
        GAUSS.map(|[x, weight]| {
            let (sin, cos) = (middle + half * x).sin_cos();
            let chip = c * ring.n_r * sin + tz * ring.n_z;
            let edge = Edge { ring: piece.slice as u32, tooth: 0, on_wall: false, sin, cos, chip };
            Node { edge, weight: half * weight }
        })
    }

    /// Place of a tooth in the order in which they pass, tooth 1 being 0.
    fn order(&self, group: usize, tooth: usize) -> usize {
        if self.rings.teeth.groups() > 1 {
            group
        } else {
            (self.rings.teeth.per_group - tooth) % self.rings.teeth.per_group
        }
    }

    fn layers(&self, pieces: &[Piece]) -> Vec<Layer> {
        let layer = |piece: &Piece| {
            let ring = &self.rings.list[piece.slice];
            Layer {
                height_mm: ring.edge_mm * ring.n_r,
                radius_mm: ring.radius_mm,
                contact_mm: ring.radius_mm * (piece.angle[1] - piece.angle[0]),
                sin: top_sin(piece),
                chip: piece.cos[0] - piece.cos[1],
                direction: piece.harmonics().1,
            }
        };
        pieces.iter().map(layer).collect()
    }
}

/// Does the model have an edge force, which can grow with wear?
fn has_edge_force(kind: &Kind, rings: &[Ring], tool: &Tool) -> bool {
    match kind {
        Kind::Exact | Kind::Sampled { law: Law::Rings, .. } => {
            rings.is_empty() || rings.iter().any(Ring::has_edge_force)
        }
        Kind::Sampled { law, .. } => law.has_edge_force(),
        Kind::Summed { formula, .. } => formula.has_edge(PI * tool.radius_mm()),
    }
}

/// Power of the idle spindle at this speed, W: from the setup, or learned at one speed and scaled along the curve of the setup.
fn tare_w(spindle: &Spindle, process: &Process, rps: f64) -> f64 {
    let declared = spindle.tare_w.at(rps);
    let Some(learned) = process.tare_w else { return declared };
    let there = process.tare_rps.map_or(0.0, |reference| spindle.tare_w.at(reference));
    if there > 0.0 { learned * declared / there } else { learned }
}
