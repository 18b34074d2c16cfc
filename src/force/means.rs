//! Averages over a revolution. In: the rings and the pieces of them that cut. Out: mean forces, torque, removal, contact,
//! and what describes the cut as a whole (depths, thickest chip, sense of milling).

use super::affine::{Affine, Spans};
use super::rings::{C, Rings};
use super::zone::{Piece, floor};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Averages over a revolution: N/2π ∫ over each piece. With J₀ = ∫ e^{−iφ} = i[e^{−iφ}] and
/// J₁ = ∫ sin φ e^{−iφ} = Δφ/2i − [e^{−2iφ}]/4 the mean of w is Σ q_e J₀ + f q_c (c n_r J₁ + t_z n_z J₀).
pub(super) fn means(rings: &Rings, pieces: &[Piece], [c, tz]: [f64; 2]) -> Means {
    let mut mean = Means::default();
    let (mut w_e, mut w_c) = (C::default(), C::default());
    let (mut weight, mut up) = (0.0, 0.0);
    let (mut angle, mut edge, mut last_slice) = (0.0, 0.0, None);
    let mut shape = Shape::default();
    for piece in pieces {
        let ring = &rings.list[piece.slice];
        let (a, b) = (c * ring.n_r, tz * ring.n_z);
        if shape.angle != piece.angle {
            shape = Shape::of(piece);
        }
        let Shape { length, j0, j1, .. } = shape;
        let chip = a * (piece.cos[0] - piece.cos[1]) + b * length;
        w_e += ring.q_e * j0;
        w_c += ring.q_c * (j1 * a + j0 * b);
        mean.axial.base += ring.axial_e * length;
        mean.axial.slope += ring.axial_c * chip;
        mean.torque.base += ring.tangential_e * ring.radius_mm * length;
        mean.torque.slope += ring.tangential_c * ring.radius_mm * chip;
        mean.removal_mm2 += ring.edge_mm * ring.radius_mm * chip;
        mean.contact_mm2 += ring.edge_mm * ring.radius_mm * length;
        angle += ring.edge_mm * length;
        if last_slice.replace(piece.slice) != Some(piece.slice) {
            edge += ring.edge_mm;
        }
        mean.height_mm += ring.height_mm * ring.edge_mm * length;
        mean.depth_mm = mean.depth_mm.max(ring.height_mm + 0.5 * ring.edge_mm * ring.n_r);
        mean.radial_depth_mm = mean.radial_depth_mm.max(ring.radius_mm * (piece.cos[0] - piece.cos[1]));
        weight += ring.edge_mm * length;
        up += ring.edge_mm * shape.up_less_climb;
        mean.chip = mean.chip.max(a * shape.top_sin + b);
    }
    let share = rings.flutes() / TAU;
    mean.plane = [Affine { base: w_e.re, slope: w_c.re }, Affine { base: w_e.im, slope: w_c.im }];
    mean.plane = mean.plane.map(|component| component.scaled(share));
    mean.axial = mean.axial.scaled(share);
    mean.torque = mean.torque.scaled(share);
    mean.chip *= rings.teeth.share.iter().copied().fold(0.0, f64::max);
    if weight > 0.0 {
        mean.height_mm /= weight;
        mean.up_share = up / weight;
        mean.immersion_rad = angle / edge;
    }
    mean
}

/// Averages over a revolution, per feed per tooth where they depend on feed.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Means {
    pub plane: [Affine; 2],
    pub axial: Affine,
    pub torque: Affine,
    /// Largest chip thickness.
    pub chip: f64,
    pub removal_mm2: f64,
    /// Swept by one edge in one revolution.
    pub contact_mm2: f64,
    /// Mean height of the engaged edges.
    pub height_mm: f64,
    pub depth_mm: f64,
    pub radial_depth_mm: f64,
    /// Angle over which a tooth is in material, mean over the edges.
    pub immersion_rad: f64,
    /// −1 all climb, +1 all up.
    pub up_share: f64,
}

impl Means {
    /// Spans with the means only, without peaks.
    pub(super) fn spans(&self) -> Spans {
        let [x, y] = self.plane;
        Spans { mean: [x, y, self.axial], torque: self.torque, chip: self.chip, ..Spans::default() }
    }

    /// Chip thickness averaged over the contact, per feed per tooth.
    pub(super) fn chip_mm(&self) -> f64 {
        if self.contact_mm2 > 0.0 { self.removal_mm2 / self.contact_mm2 } else { 0.0 }
    }
}

/// Integrals over a piece, which all rings with the same angles share.
#[derive(Default)]
struct Shape {
    angle: [f64; 2],
    length: f64,
    j0: C,
    j1: C,
    top_sin: f64,
    up_less_climb: f64,
}

impl Shape {
    fn of(piece: &Piece) -> Self {
        let (j0, j1) = piece.harmonics();
        Self {
            angle: piece.angle,
            length: piece.angle[1] - piece.angle[0],
            j0,
            j1,
            top_sin: top_sin(piece),
            up_less_climb: piece.up_less_climb(),
        }
    }
}

/// Largest sin φ on a piece.
pub(super) fn top_sin(piece: &Piece) -> f64 {
    let turns = floor((piece.angle[1] - FRAC_PI_2) / TAU);
    let top = FRAC_PI_2 + TAU * turns as f64;
    if top >= piece.angle[0] { 1.0 } else { piece.sin[0].max(piece.sin[1]) }
}
