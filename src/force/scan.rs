//! Forces sampled over a revolution. In: the edges in material at each rotation angle, any law of chip thickness, runout, compliance of the tool.
//! Out: peaks and means at any feed.
//!
//! Tooth i (counted in the order in which the teeth pass) stands R_i = ρ cos(α − ψ_i) further out, ψ_i its angle behind
//! tooth 1. It cuts what the teeth before it left: h = min over m = 1…N of (Σ feed of the last m teeth) g + (R_i − R_{i−m})
//! n_r, the feed of a tooth being that of its own pitch (Ko, Yun, Cho, Eq. for t_c; m = N is its own last path). Peaks come
//! from the samples; means from Gauss–Legendre quadrature over each arc, because a chip does not depend on the rotation but
//! through φ. Where the tool deflects by δ(θ) = F_xy·compliance, (δ − δ of tooth i−m at the same φ)·(sin φ, cos φ) is added, by fixed-point rounds.

use super::laws::{Conditions, Law, Ready};
use super::loads::Forces;
use super::modifiers::Factors;
use super::rings::{C, Ring};
use std::f64::consts::TAU;

/// Rotation angles in a turn.
pub(super) const ANGLES_PER_TURN: usize = 360;
/// Rounds of the deflection.
const ROUNDS: usize = 4;

/// One edge in the material at one rotation angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Edge {
    pub ring: u32,
    pub tooth: u16,
    /// At the angle where it leaves the wall.
    pub on_wall: bool,
    pub sin: f64,
    pub cos: f64,
    /// Chip thickness per feed per tooth.
    pub chip: f64,
}

/// The path of the tooth m before tooth i, seen from tooth i.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Before {
    /// Feed since then, over the mean feed per tooth.
    pub feeds: f64,
    /// R_i − R_{i−m}, mm.
    pub radius_mm: f64,
}

/// A node of the quadrature over the engaged arcs; its weight is in rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Node {
    pub edge: Edge,
    pub weight: f64,
}

/// Abscissae and weights of eight-point Gauss–Legendre quadrature on (−1, 1).
pub(super) const GAUSS: [[f64; 2]; 8] = [
    [-0.960_289_856_497_536_2, 0.101_228_536_290_376_26],
    [-0.796_666_477_413_626_7, 0.222_381_034_453_374_48],
    [-0.525_532_409_916_329, 0.313_706_645_877_887_27],
    [-0.183_434_642_495_649_8, 0.362_683_783_378_362],
    [0.183_434_642_495_649_8, 0.362_683_783_378_362],
    [0.525_532_409_916_329, 0.313_706_645_877_887_27],
    [0.796_666_477_413_626_7, 0.222_381_034_453_374_48],
    [0.960_289_856_497_536_2, 0.101_228_536_290_376_26],
];

/// A station, sampled.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scan {
    pub rings: Vec<Ring>,
    pub law: Law,
    pub edges: Vec<Edge>,
    /// Quadrature over the engaged arcs (the tooth in its edges is of no account).
    pub nodes: Vec<Node>,
    /// First edge of each angle, and the end of the last.
    pub starts: Vec<u32>,
    /// By tooth, then m − 1.
    pub before: Vec<Vec<Before>>,
    /// Angles between one tooth and the next; 0 where deflection does not change the chip.
    pub angles_per_tooth: usize,
    /// Deflection of the tip per N.
    pub compliance_mm_n: f64,
    pub conditions: Conditions,
    /// Chip thickness per feed per tooth, largest.
    pub chip: f64,
}

impl Scan {
    /// Forces at feed per tooth `f`.
    pub(super) fn forces(&self, f: f64, factors: &Factors) -> Forces {
        let mut deflection = Vec::new();
        if self.angles_per_tooth > 0 {
            deflection = vec![C::default(); self.angles()];
            for _ in 0..ROUNDS {
                let bent = self.force_by_angle(f, factors, &deflection).into_iter();
                deflection = bent.map(|sample| sample.plane * self.compliance_mm_n).collect();
            }
        }
        let samples = self.force_by_angle(f, factors, &deflection);
        let mut forces = Forces { chip: self.thickest(f, &deflection), ..Forces::default() };
        let mut mean = Sample::default();
        for sample in &samples {
            forces.xy_peak = forces.xy_peak.max(sample.plane.norm());
            forces.axial_peak = forces.axial_peak.max(sample.axial.abs());
            forces.torque_peak = forces.torque_peak.max(sample.torque);
            forces.wall = forces.wall.max(sample.wall);
            mean.add(sample, 1.0 / samples.len() as f64);
        }
        if deflection.is_empty() {
            mean = self.mean(f, factors);
        }
        forces.mean = [mean.plane.re, mean.plane.im, mean.axial];
        forces.torque = mean.torque;
        forces
    }

    /// Averages over a revolution of a tool that does not bend: 1/2π Σ over teeth and arcs of ∫ dφ.
    fn mean(&self, f: f64, factors: &Factors) -> Sample {
        let conditions = self.conditions_at(f, &[]);
        let law = self.law.under(&conditions);
        let mut mean = Sample::default();
        for tooth in 0..self.before.len() {
            for node in &self.nodes {
                let edge = Edge { tooth: tooth as u16, ..node.edge };
                let h = self.chip_thickness(&edge, 0, f, &[]);
                if h > 0.0 {
                    mean.add(&self.of_edge(&edge, h, law, factors), node.weight / TAU);
                }
            }
        }
        mean
    }

    fn conditions_at(&self, f: f64, deflection: &[C]) -> Conditions {
        let mut conditions = Conditions { feed_per_tooth_mm: f, ..self.conditions };
        if matches!(self.law, Law::Sigmoid(_)) {
            conditions.chip_range_mm = self.chip_range(f, deflection);
        }
        conditions
    }

    /// Height and F_y of each edge in the material, of a tool that does not bend.
    pub(super) fn forces_of(&self, edges: &[Edge], f: f64, factors: &Factors) -> Vec<(f64, f64)> {
        let conditions = self.conditions_at(f, &[]);
        let law = self.law.under(&conditions);
        let chips = edges.iter().map(|edge| (edge, self.chip_thickness(edge, 0, f, &[]))).filter(|(_, h)| *h > 0.0);
        let force = |(edge, h): (&Edge, f64)| {
            (self.rings[edge.ring as usize].height_mm, self.of_edge(edge, h, law, factors).plane.im)
        };
        chips.map(force).collect()
    }

    /// Force of one edge at chip thickness `h`.
    fn of_edge(&self, edge: &Edge, h: f64, law: Ready, factors: &Factors) -> Sample {
        let ring = &self.rings[edge.ring as usize];
        let [t, p, axial] = law.forces(ring, h, [factors.cutting, factors.edge_worn()]);
        let plane = C::new(-t * edge.cos + p * edge.sin, t * edge.sin + p * edge.cos);
        Sample { plane, axial, torque: t * ring.radius_mm, wall: 0.0 }
    }

    /// Number of rotation angles.
    pub(super) fn angles(&self) -> usize {
        self.starts.len() - 1
    }

    /// Forces at every rotation angle.
    pub(super) fn force_by_angle(&self, f: f64, factors: &Factors, deflection: &[C]) -> Vec<Sample> {
        let conditions = self.conditions_at(f, deflection);
        let law = self.law.under(&conditions);
        (0..self.angles()).map(|angle| self.sample(angle, f, law, factors, deflection)).collect()
    }

    fn sample(&self, angle: usize, f: f64, law: Ready, factors: &Factors, deflection: &[C]) -> Sample {
        let mut sample = Sample::default();
        let mut wall_normal = 0.0f64;
        for edge in self.edges_at(angle) {
            let h = self.chip_thickness(edge, angle, f, deflection);
            if h <= 0.0 {
                continue;
            }
            sample.add(&self.of_edge(edge, h, law, factors), 1.0);
            if edge.on_wall {
                wall_normal = wall_normal.max(self.rings[edge.ring as usize].n_r);
            }
        }
        sample.wall = sample.plane.im.abs() * wall_normal;
        sample
    }

    /// Edges in the material at a rotation angle.
    pub(super) fn edges_at(&self, angle: usize) -> &[Edge] {
        &self.edges[self.starts[angle] as usize..self.starts[angle + 1] as usize]
    }

    /// Chip thickness that an edge meets, mm; not positive: it does not cut.
    pub(super) fn chip_thickness(&self, edge: &Edge, angle: usize, f: f64, deflection: &[C]) -> f64 {
        let n_r = self.rings[edge.ring as usize].n_r;
        let mut least = f64::INFINITY;
        for (k, before) in self.before[edge.tooth as usize].iter().enumerate() {
            let mut h = before.feeds * f * edge.chip + before.radius_mm * n_r;
            if !deflection.is_empty() {
                let turns = deflection.len();
                let then = (angle + turns - (k + 1) * self.angles_per_tooth % turns) % turns;
                let moved = deflection[angle] - deflection[then];
                h += (moved.re * edge.sin + moved.im * edge.cos) * n_r;
            }
            least = least.min(h);
        }
        least
    }

    fn chip_range(&self, f: f64, deflection: &[C]) -> f64 {
        let (mut least, mut most) = (f64::INFINITY, 0.0f64);
        for angle in 0..self.angles() {
            for edge in self.edges_at(angle) {
                let h = self.chip_thickness(edge, angle, f, deflection);
                if h > 0.0 {
                    (least, most) = (least.min(h), most.max(h));
                }
            }
        }
        if most > least { most - least } else { most }
    }

    fn thickest(&self, f: f64, deflection: &[C]) -> f64 {
        if self.before.iter().all(|paths| paths.len() == 1) {
            return self.chip * f;
        }
        let angles = 0..self.angles();
        let each = angles.flat_map(|angle| self.edges_at(angle).iter().map(move |edge| (angle, edge)));
        each.map(|(angle, edge)| self.chip_thickness(edge, angle, f, deflection)).fold(0.0, f64::max)
    }
}

/// Force at one rotation angle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Sample {
    /// F_x + i F_y, N.
    pub plane: C,
    /// F_z, N.
    pub axial: f64,
    /// N·mm.
    pub torque: f64,
    /// Force normal to the wall where an edge leaves it here, N.
    pub wall: f64,
}

impl Sample {
    fn add(&mut self, other: &Sample, weight: f64) {
        self.plane += other.plane * weight;
        self.axial += other.axial * weight;
        self.torque += other.torque * weight;
    }
}
