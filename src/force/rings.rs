//! The cutter as rings with coefficients. In: slices, tool, coefficients. Out: everything about forces that does not depend on the station.
//!
//! Frame: x along the feed, y its left normal, z up the tool axis; a tooth at immersion φ stands at (sin φ, cos φ) R and φ
//! rises as the tool turns. Forces act on the tool. On a ring with outward normal N = (n_r sin φ, n_r cos φ, n_z) and edge
//! length du an edge feels, with h the chip thickness,
//! * tangential (k_tc h + k_te) du along (−cos φ, sin φ, 0), against the rotation,
//! * radial (k_rc h + k_re) du along −N, into the tool,
//! * axial (k_ac h + k_ae) du along −e, where e = (−n_z, n_r) runs up the outline: on the side of a flat mill it pulls the
//!   tool down out of its holder, on a bottom face it presses towards the axis (Lee, Altintas 1996).
//!
//! In the plane, with w = F_x + i F_y: w = (−t + i p) e^{−iφ}, t being the tangential force and p the sum of the other two
//! along (sin φ, cos φ). With the tool turned by θ, tooth j of a ring is at φ = θ − s, s = lag − ψ_j, ψ_j the angle by
//! which tooth j leads tooth 0 and lag = z tan β / R. With h = f g, g = c n_r sin φ + t_z n_z,
//! w e^{iθ} = E + f (c C₀ e^{iθ} + t_z C₁ + c C₂ e^{−iθ}): E = Σ q_e e^{is}, C₀ = Σ q_c n_r/2i, C₁ = Σ q_c n_z e^{is},
//! C₂ = −Σ q_c n_r e^{2is}/2i, summed over the teeth in cut. These sums are all that a peak needs.

use crate::machine::material::LinearEdge;
use crate::machine::{Slice, Tool};
use nalgebra::Complex;
use std::f64::consts::TAU;

/// Complex number.
pub(super) type C = Complex<f64>;

/// Contribution of one tooth on one ring, or the sum of those in cut. Axial force and torque are
/// `e + f (t_z·c + c·Im(s e^{iθ}))` with fields `z_*` and `t_*`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Sums {
    pub edge: C,
    pub c0: C,
    pub c1: C,
    pub c2: C,
    pub z_s: C,
    pub t_s: C,
    pub z_e: f64,
    pub z_c: f64,
    pub t_e: f64,
    pub t_c: f64,
}

impl Sums {
    pub(super) fn add(&mut self, other: &Sums) {
        self.edge += other.edge;
        self.c0 += other.c0;
        self.c1 += other.c1;
        self.c2 += other.c2;
        self.z_s += other.z_s;
        self.t_s += other.t_s;
        self.z_e += other.z_e;
        self.z_c += other.z_c;
        self.t_e += other.t_e;
        self.t_c += other.t_c;
    }
    pub(super) fn subtract(&mut self, other: &Sums) {
        self.edge -= other.edge;
        self.c0 -= other.c0;
        self.c1 -= other.c1;
        self.c2 -= other.c2;
        self.z_s -= other.z_s;
        self.t_s -= other.t_s;
        self.z_e -= other.z_e;
        self.z_c -= other.z_c;
        self.t_e -= other.t_e;
        self.t_c -= other.t_c;
    }
}

/// Where the teeth are.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Teeth {
    /// Rotation after which the pattern repeats: the pitch, or a turn where the pitch varies.
    pub period_rad: f64,
    /// Lead ψ of the first tooth of each group; the teeth of a group are one period apart.
    pub lead_rad: Vec<f64>,
    /// Teeth in a group.
    pub per_group: usize,
    /// Feed of the first tooth of each group relative to the mean feed per tooth.
    pub share: Vec<f64>,
}

impl Teeth {
    pub(super) fn of(tool: &Tool) -> Self {
        let n = tool.flutes as usize;
        if tool.pitch_rad.is_empty() {
            return Self { period_rad: TAU / n as f64, lead_rad: vec![0.0], per_group: n, share: vec![1.0] };
        }
        // Tooth j+1 follows tooth j by pitch_rad[j]: it lags, so its lead is negative; what it cuts was left by tooth j.
        let mut lead_rad = vec![0.0];
        for pitch in &tool.pitch_rad[..n - 1] {
            lead_rad.push(lead_rad[lead_rad.len() - 1] - pitch);
        }
        let share = (0..n).map(|j| tool.pitch_rad[(j + n - 1) % n] * n as f64 / TAU).collect();
        Self { period_rad: TAU, lead_rad, per_group: 1, share }
    }
    pub(super) fn groups(&self) -> usize {
        self.lead_rad.len()
    }
    /// Index of the tooth of a group that is `step` periods on.
    pub(super) fn index(&self, group: usize, step: i32) -> usize {
        group * self.per_group + step.rem_euclid(self.per_group as i32) as usize
    }
}

/// One tooth on one ring.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ToothRing {
    /// e^{is}.
    pub turn: C,
    /// What it adds while it cuts.
    pub sums: Sums,
}

/// One ring; forces of one edge per mm of chip thickness along the normal (`_c`) and at none (`_e`), N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ring {
    pub lag_rad: f64,
    /// How much more its top lags than its bottom, as a magnitude.
    pub lag_width_rad: f64,
    pub radius_mm: f64,
    pub height_mm: f64,
    pub edge_mm: f64,
    pub n_r: f64,
    pub n_z: f64,
    /// −t + i p per mm of chip thickness.
    pub q_c: C,
    pub q_e: C,
    pub axial_c: f64,
    pub axial_e: f64,
    pub tangential_c: f64,
    pub tangential_e: f64,
}

impl Ring {
    /// Does its edge have an edge force?
    pub(super) fn has_edge_force(&self) -> bool {
        self.q_e.norm_sqr() > 0.0 || self.axial_e != 0.0
    }

    pub(super) fn new(slice: &Slice, k: &LinearEdge, tool: &Tool) -> Self {
        let (n_r, n_z, du) = (slice.normal_r, slice.normal_z, slice.edge_mm);
        let radius = tool.radius_mm();
        let lag_rad = |height_mm: f64| if radius > 0.0 { height_mm * tool.helix_rad.tan() / radius } else { 0.0 };
        Self {
            lag_rad: lag_rad(slice.z_mm),
            lag_width_rad: lag_rad(slice.dz_mm()).abs(),
            radius_mm: slice.radius_mm,
            height_mm: slice.z_mm,
            edge_mm: du,
            n_r,
            n_z,
            q_c: C::new(-k.k_tc, -n_r * k.k_rc + n_z * k.k_ac) * du,
            q_e: C::new(-k.k_te, -n_r * k.k_re + n_z * k.k_ae) * du,
            axial_c: (-n_z * k.k_rc - n_r * k.k_ac) * du,
            axial_e: (-n_z * k.k_re - n_r * k.k_ae) * du,
            tangential_c: k.k_tc * du,
            tangential_e: k.k_te * du,
        }
    }

    /// Is the next ring the same edge further up?
    pub(super) fn continues_in(&self, next: &Self) -> bool {
        let same = |a: f64, b: f64| (a - b).abs() <= 1e-9;
        let alike =
            Self { lag_rad: next.lag_rad, lag_width_rad: next.lag_width_rad, height_mm: next.height_mm, ..*self };
        let meets = same((next.lag_rad - self.lag_rad).abs(), self.lag_width_rad);
        alike == *next && same(next.lag_width_rad, self.lag_width_rad) && meets
    }

    /// All teeth on this ring, by [`Teeth::index`].
    pub(super) fn teeth(&self, teeth: &Teeth) -> Vec<ToothRing> {
        let places = (0..teeth.groups()).flat_map(|group| (0..teeth.per_group).map(move |tooth| (group, tooth)));
        let lead = |(group, tooth): (usize, usize)| teeth.lead_rad[group] + tooth as f64 * teeth.period_rad;
        places.map(|place| self.tooth(self.lag_rad - lead(place), teeth.share[place.0])).collect()
    }

    fn tooth(&self, s: f64, share: f64) -> ToothRing {
        let turn = C::from_polar(1.0, s);
        let half = self.q_c * self.n_r * share * C::new(0.0, -0.5);
        let sums = Sums {
            edge: self.q_e * turn,
            c0: half,
            c1: self.q_c * self.n_z * share * turn,
            c2: -half * turn * turn,
            z_e: self.axial_e,
            z_c: self.axial_c * self.n_z * share,
            z_s: turn.conj() * (self.axial_c * self.n_r * share),
            t_e: self.tangential_e * self.radius_mm,
            t_c: self.tangential_c * self.radius_mm * self.n_z * share,
            t_s: turn.conj() * (self.tangential_c * self.radius_mm * self.n_r * share),
        };
        ToothRing { turn, sums }
    }
}

/// The rings of a cutter with all their teeth.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rings {
    pub list: Vec<Ring>,
    pub teeth: Teeth,
    /// Teeth of each ring, by [`Teeth::index`].
    pub teeth_of: Vec<Vec<ToothRing>>,
}

impl Rings {
    pub(super) fn new(list: Vec<Ring>, teeth: Teeth) -> Self {
        let teeth_of = list.iter().map(|ring| ring.teeth(&teeth)).collect();
        Self { list, teeth, teeth_of }
    }
    /// Number of teeth.
    pub(super) fn flutes(&self) -> f64 {
        (self.teeth.groups() * self.teeth.per_group) as f64
    }
}
