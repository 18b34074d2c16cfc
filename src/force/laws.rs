//! Force laws that are not affine in feed. In: chip thickness h (mm) of an edge of length du. Out: its force, N, as tangential t (against the
//! rotation), radial (along −N) and axial (along −e) parts; directions as in [`super::rings`].
//!
//! * Kienzle: t = k_c11 h^(1−m) du, radial and axial as shares of it, edge terms added.
//! * Sigmoid (Ko, Yun, Cho): normal force K_n tc dA on the rake face and friction K_f K_n tc dA along the chip, dA =
//!   cos α_r dz / cos θ_h; ln K_n = A2 + (A1 − A2)/(1 + exp((t_n − x0)/dx)), t_n = tc / range. With cos θ_tk = sin α_r sin θ_h:
//!   C1 = cos θ_h/sin θ_tk, C2 = sin θ_h/sin θ_tk, C4 = cos θ_c/sin θ_tk, s = sin θ_c − cos θ_c cot θ_tk, C3 = s sin θ_h,
//!   C5 = s cos θ_h. The range of chip thickness is the key `chip_range`; 0 is the range of the cut itself (the paper
//!   leaves it open). The chip flows up, so friction pulls the tool up while the normal force presses it down; the term C2 K_n is the larger.
//! * Polynomial (Niu, Wang, Zhao, Huang): K_t and K_r as polynomials in axial depth, feed per tooth, radial depth (mm) and
//!   speed (rev/min), with the terms 1, a_p, f_t, a_e, a_p², f_t², a_e², a_p n, a_p f_t, a_p a_e, f_t a_e.

use super::models::Values;
use super::rings::Ring;
use crate::machine::Tool;

/// Kienzle's law.
#[derive(Debug, Clone, PartialEq)]
pub struct Kienzle {
    k_c11: f64,
    exponent: f64,
    normal_share: f64,
    axial_share: f64,
    k_te: f64,
    k_re: f64,
}

/// Law of Ko, Yun, Cho.
#[derive(Debug, Clone, PartialEq)]
pub struct Sigmoid {
    a1: f64,
    a2: f64,
    x0: f64,
    dx: f64,
    /// Key `chip_range`, mm; 0: the range of the cut itself.
    chip_range_mm: f64,
    /// Tangential, radial and axial force per K_n·tc·(edge length along the axis).
    directions: [f64; 3],
}

/// Law of Niu and others.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial {
    tangential: [f64; 11],
    radial: [f64; 11],
}

/// A law.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Law {
    /// The linear coefficients of each ring.
    Rings,
    Kienzle(Kienzle),
    Sigmoid(Sigmoid),
    Polynomial(Polynomial),
}

/// The conditions of a cut, beside chip thickness, on which a law depends.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Conditions {
    pub feed_per_tooth_mm: f64,
    pub axial_depth_mm: f64,
    pub radial_depth_mm: f64,
    pub rpm: f64,
    /// Largest less least chip thickness in the revolution, mm.
    pub chip_range_mm: f64,
}

/// A law under given conditions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Ready<'a> {
    Rings,
    Kienzle(&'a Kienzle),
    Sigmoid { law: &'a Sigmoid, range_mm: f64 },
    Plain { k_t: f64, k_r: f64 },
}

impl Law {
    /// Does the law have an edge force beside the force of the chip? For [`Law::Rings`] ask the rings.
    pub(super) fn has_edge_force(&self) -> bool {
        matches!(self, Law::Kienzle(law) if law.k_te != 0.0 || law.k_re != 0.0)
    }

    pub(super) fn under(&self, conditions: &Conditions) -> Ready<'_> {
        match self {
            Law::Rings => Ready::Rings,
            Law::Kienzle(law) => Ready::Kienzle(law),
            Law::Sigmoid(law) => {
                let fixed = law.chip_range_mm;
                let range_mm = if fixed > 0.0 { fixed } else { conditions.chip_range_mm };
                Ready::Sigmoid { law, range_mm }
            }
            Law::Polynomial(law) => {
                let [k_t, k_r] = law.coefficients(conditions);
                Ready::Plain { k_t, k_r }
            }
        }
    }
}

impl Ready<'_> {
    /// Tangential, in-plane (along (sin φ, cos φ)) and axial (up) force of one edge of a ring at chip thickness `h` along
    /// its normal, N; cutting forces times `cutting`, edge forces times `edge`.
    pub(super) fn forces(&self, ring: &Ring, h: f64, [cutting, edge]: [f64; 2]) -> [f64; 3] {
        let along = |[t, radial, axial]: [f64; 3]| {
            let (n_r, n_z, du) = (ring.n_r, ring.n_z, ring.edge_mm);
            [t * du, (-n_r * radial + n_z * axial) * du, (-n_z * radial - n_r * axial) * du]
        };
        match self {
            Ready::Rings => [
                ring.tangential_c * cutting * h + ring.tangential_e * edge,
                ring.q_c.im * cutting * h + ring.q_e.im * edge,
                ring.axial_c * cutting * h + ring.axial_e * edge,
            ],
            Ready::Kienzle(law) => along(law.per_mm(h, [cutting, edge])),
            Ready::Sigmoid { law, range_mm } => {
                let k_n = law.normal_n_mm2(h / range_mm.max(1e-9)) * h * cutting;
                along(law.directions.map(|direction| direction * k_n))
            }
            Ready::Plain { k_t, k_r } => along([k_t * h * cutting, k_r * h * cutting, 0.0]),
        }
    }
}

impl Kienzle {
    /// From the parameters of the model `kienzle`.
    pub(super) fn new(values: &Values) -> Self {
        Self {
            k_c11: values.get("k_c11"),
            exponent: values.get("m_c"),
            normal_share: values.get("normal_share"),
            axial_share: values.get("axial_share"),
            k_te: values.get("k_te"),
            k_re: values.get("k_re"),
        }
    }
    fn per_mm(&self, h: f64, [cutting, edge]: [f64; 2]) -> [f64; 3] {
        let t = self.k_c11 * h.powf(1.0 - self.exponent) * cutting;
        [t + self.k_te * edge, self.normal_share * t + self.k_re * edge, self.axial_share * t]
    }
}

impl Sigmoid {
    /// From the parameters of the model `sigmoid` and the tool's rake and helix.
    pub(super) fn new(values: &Values, tool: &Tool) -> Self {
        let (rake, helix) = (tool.rake_rad, tool.helix_rad);
        let cos_tk = rake.sin() * helix.sin();
        let sin_tk = (1.0 - cos_tk * cos_tk).sqrt();
        let flow = values.get("chip_flow");
        let friction = values.get("k_f");
        let s = flow.sin() - flow.cos() * cos_tk / sin_tk;
        let (c1, c2, c4) = (helix.cos() / sin_tk, helix.sin() / sin_tk, flow.cos() / sin_tk);
        let (c3, c5) = (s * helix.sin(), s * helix.cos());
        let area = rake.cos() / helix.cos();
        let tangential = c1 * rake.cos() + friction * (c4 * rake.sin() + c3);
        let outward = c1 * rake.sin() - friction * c4 * rake.cos();
        let up = -c2 + friction * c5; // C2 alone, as the paper prints it: the components of its normal are not of unit length
        Self {
            a1: values.get("a1"),
            a2: values.get("a2"),
            x0: values.get("x0"),
            dx: values.get("dx"),
            chip_range_mm: values.get("chip_range"),
            directions: [tangential * area, -outward * area, -up * area],
        }
    }
    /// K_n at a normalised chip thickness, N/mm².
    pub fn normal_n_mm2(&self, tcn: f64) -> f64 {
        (self.a2 + (self.a1 - self.a2) / (1.0 + ((tcn - self.x0) / self.dx).exp())).exp()
    }
}

impl Polynomial {
    /// From the parameters `a0`…`a10` (tangential) and `b0`…`b10` (radial) of the model `polynomial`.
    pub(super) fn new(values: &Values) -> Self {
        let row = |letter: char| std::array::from_fn(|k| values.get(&format!("{letter}{k}")));
        Self { tangential: row('a'), radial: row('b') }
    }
    /// K_t and K_r, N/mm².
    fn coefficients(&self, conditions: &Conditions) -> [f64; 2] {
        let c = conditions;
        let (ap, ft, ae) = (c.axial_depth_mm, c.feed_per_tooth_mm, c.radial_depth_mm);
        let terms = [1.0, ap, ft, ae, ap * ap, ft * ft, ae * ae, ap * c.rpm, ap * ft, ap * ae, ft * ae];
        let sum = |row: &[f64; 11]| row.iter().zip(terms).map(|(k, term)| k * term).sum();
        [sum(&self.tangential), sum(&self.radial)]
    }
}
