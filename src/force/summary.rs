//! Models that give the resultant in the tool plane alone: the response model (Kakino, Ibaraki) and the layer model of ball
//! ends (Nishida). In: for each layer its height, radius, length of contact L and largest chip thickness t_m. Out: the
//! resultant by the model. Torque, means and normal force follow from it with the model's `normal_share` s, on the assumption that the force
//! is proportional to chip thickness over the arc: F_t = F/√(1+s²), F_n = s F_t. These models give no axial force.
//!
//! The value of the formula at chip thickness 0 (b0 + b_l L + b_ll L²; C0 + C1 L) is its edge force. Effects on edge coefficients multiply it,
//! effects on cutting coefficients the rest. Wear multiplies b0, the wear index of that model, or C0 and C1 together. A negative value is not
//! an edge force but an artefact of the fit, and counts with the rest.
//!
//! On an arc from 0 to α (or π − α to π) t_m is f sin α with Ibaraki (Eq. 4) and r − √(r² + f² − 2 r f sin α) with Nishida,
//! α at most a right angle.

use super::loads::Forces;
use super::models::Values;
use super::modifiers::Factors;
use super::rings::C;

/// Millimetres in a micrometre: the layer model takes chip thickness in µm.
const UM_PER_MM: f64 = 1e3;
/// Number of contact lengths at which the edge force of a formula is evaluated: dense enough for a quadratic.
const EDGE_SAMPLES: u32 = 50;

/// The formula of a model.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Formula {
    /// b0, b_l, b_t, b_ll, b_tt, b_lt: force of the whole cut, N.
    Response([f64; 6]),
    /// C0…C3: force per mm of height, N/mm; on it a power of the layer's radius.
    Layer([f64; 4], OfRadius),
}

/// (r/R)^p of a layer with the radius r on a ball with the radius R, level below the least r/R that was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OfRadius {
    ball_mm: f64,
    exponent: f64,
    from: f64,
}

impl OfRadius {
    fn factor(&self, radius_mm: f64) -> f64 {
        if self.exponent == 0.0 { 1.0 } else { (radius_mm / self.ball_mm).max(self.from.max(1e-3)).powf(self.exponent) }
    }
}

impl Formula {
    pub(super) fn response(values: &Values) -> Self {
        Self::Response(["b0", "b_l", "b_t", "b_ll", "b_tt", "b_lt"].map(|name| values.get(name)))
    }
    pub(super) fn layer(values: &Values, ball_mm: f64) -> Self {
        let of = OfRadius { ball_mm, exponent: values.get("radius_exponent"), from: values.get("radius_from") };
        Self::Layer(["c0", "c1", "c2", "c3"].map(|name| values.get(name)), of)
    }

    /// Force on a layer at a feed per tooth, N.
    fn resultant(&self, layer: &Layer, f: f64) -> f64 {
        match self {
            Formula::Response([_, _, b_t, _, b_tt, b_lt]) => {
                let (l, t) = (layer.contact_mm, f * layer.sin);
                self.edge(layer) + b_t * t + b_tt * t * t + b_lt * l * t
            }
            Formula::Layer([_, _, c2, c3], of) => {
                let (l, t) = (layer.contact_mm, UM_PER_MM * chip_of_paths(layer.radius_mm, f, layer.sin));
                self.edge(layer) + layer.height_mm * of.factor(layer.radius_mm) * (c2 * t + c3 * l * t)
            }
        }
    }

    /// The part that wear multiplies, N: b0, the wear index of the response model; C0 and C1 of the layer model.
    fn wears(&self, layer: &Layer) -> f64 {
        match self {
            Formula::Response([b0, ..]) => *b0,
            Formula::Layer(..) => self.edge(layer).max(0.0),
        }
    }

    /// The edge force on a layer, N: the force at chip thickness 0.
    fn edge(&self, layer: &Layer) -> f64 {
        let per_height = self.edge_at(layer.contact_mm);
        match self {
            Formula::Layer(_, of) => layer.height_mm * of.factor(layer.radius_mm) * per_height,
            Formula::Response(_) => per_height,
        }
    }

    /// The edge force by length of contact, N; per mm of height for the layer model.
    fn edge_at(&self, contact_mm: f64) -> f64 {
        match self {
            Formula::Response([b0, b_l, _, b_ll, ..]) => b0 + b_l * contact_mm + b_ll * contact_mm * contact_mm,
            Formula::Layer([c0, c1, ..], _) => c0 + c1 * contact_mm,
        }
    }

    /// Is the force that wear multiplies positive for every length of contact up to this one?
    pub(super) fn has_edge(&self, longest_mm: f64) -> bool {
        let at = |k: u32| self.edge_at(longest_mm * f64::from(k) / f64::from(EDGE_SAMPLES));
        match self {
            Formula::Response([b0, ..]) => *b0 > 0.0,
            Formula::Layer(..) => (1..=EDGE_SAMPLES).all(|k| at(k) > 0.0),
        }
    }
}

/// A layer in contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Layer {
    pub height_mm: f64,
    pub radius_mm: f64,
    /// Length of contact along the circle, mm.
    pub contact_mm: f64,
    /// Largest sin φ.
    pub sin: f64,
    /// ∫ sin φ dφ and ∫ sin φ e^{−iφ} dφ over the contact.
    pub chip: f64,
    pub direction: C,
}

/// A station under such a model.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Summary {
    pub formula: Formula,
    pub normal_share: f64,
    pub flutes: f64,
    pub layers: Vec<Layer>,
}

impl Summary {
    /// Forces at feed per tooth `f`.
    pub(super) fn forces(&self, f: f64, factors: &Factors) -> Forces {
        let along = (1.0 + self.normal_share * self.normal_share).sqrt().recip();
        let mut forces = Forces::default();
        let mut mean = C::default();
        for layer in self.cutting_layers() {
            let edge = self.formula.edge(layer);
            let rest = self.formula.resultant(layer, f + factors.peak_feed_mm) - edge.max(0.0);
            let worn = edge.max(0.0) + self.formula.wears(layer) * factors.worn;
            let peak = (rest * factors.cutting + worn * factors.edge).max(0.0);
            let (t, n) = (peak * along, peak * along * self.normal_share);
            forces.xy_peak += peak;
            forces.torque_peak += t * layer.radius_mm;
            forces.wall += n;
            let per_turn = self.flutes / (std::f64::consts::TAU * layer.sin);
            mean += C::new(-t, -n) * layer.direction * per_turn;
            forces.torque += t * layer.radius_mm * layer.chip * per_turn;
            forces.chip = forces.chip.max(f * layer.sin);
        }
        forces.mean = [mean.re, mean.im, 0.0];
        forces
    }

    /// The layers to which the formula applies: all (layer model), or the one with the longest contact (response model).
    fn cutting_layers(&self) -> impl Iterator<Item = &Layer> {
        let one = matches!(self.formula, Formula::Response(_));
        let longest = self
            .layers
            .iter()
            .enumerate()
            .fold(0, |best, (k, layer)| if layer.contact_mm > self.layers[best].contact_mm { k } else { best });
        let chosen = if one && !self.layers.is_empty() { longest..longest + 1 } else { 0..self.layers.len() };
        self.layers[chosen].iter().filter(|layer| layer.sin > 0.0)
    }
}

/// Largest chip thickness between two circular paths of radius `r`, a feed `f` apart, where `sin` is that of the
/// contact angle: r − √(r² + f² − 2 r f sin α), mm.
pub fn chip_of_paths(r: f64, f: f64, sin: f64) -> f64 {
    (r - (r * r + f * f - 2.0 * r * f * sin).max(0.0).sqrt()).max(0.0)
}
