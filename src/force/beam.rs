//! The tool as a stepped cantilever. In: a tool with its overhang. Out: deflection and bending stress per newton. The flutes count as a
//! cylinder of 0.8 D up to the flute length, then comes the shank up to the collet; the holder is a spring.
//!
//! With x from the tip and a force F at x = a, the moment is M = F (x − a) for x > a. Deflection at z per force (virtual
//! work) is ∫ (x − a)(x − z) / (E I) dx + 1/k_holder, bending stress per force the largest (x − a)·32/(π d³) at the end of each
//! step. Units mm, N, MPa.

use crate::machine::Tool;
use std::f64::consts::PI;

/// Share of the diameter that bends like the fluted part (Kops and Vo; used by Ko, Yun, Cho too).
pub const FLUTED_SHARE: f64 = 0.8;

/// A stepped cantilever.
#[derive(Debug, Clone, PartialEq)]
pub struct Beam {
    /// Steps from the tip: (from, to, diameter), mm.
    steps: Vec<[f64; 3]>,
    modulus_mpa: f64,
    holder_mm_per_n: f64,
}

impl Beam {
    /// Of a tool as it stands out of its holder.
    pub fn of(tool: &Tool) -> Self {
        let overhang = tool.overhang_mm;
        let flutes = tool.flute_length_mm.min(overhang);
        let mut steps = vec![[0.0, flutes, FLUTED_SHARE * tool.diameter_mm]];
        if overhang > flutes {
            steps.push([flutes, overhang, tool.shank_diameter_mm]);
        }
        let holder_mm_per_n = tool.holder_stiffness_n_mm.map_or(0.0, f64::recip);
        Self { steps, modulus_mpa: tool.youngs_modulus_mpa, holder_mm_per_n }
    }

    /// Deflection of the tip under a force of 1 N at the height `at_mm` above the tip, mm/N.
    pub fn tip_mm_per_n(&self, at_mm: f64) -> f64 {
        self.at_mm_per_n(0.0, at_mm)
    }

    /// Deflection at the height `z_mm` under a force of 1 N at the height `at_mm`, mm/N: ∫ (x − z)(x − a)/(E I) dx over x
    /// above both, plus the holder.
    pub fn at_mm_per_n(&self, z_mm: f64, at_mm: f64) -> f64 {
        let above = z_mm.max(at_mm);
        let bend = |[from, to, d]: &[f64; 3]| {
            let from = from.max(above);
            if *to <= from {
                return 0.0;
            }
            let integral = |x: f64| x * (x * x / 3.0 - 0.5 * x * (z_mm + at_mm) + z_mm * at_mm);
            (integral(*to) - integral(from)) / (self.modulus_mpa * PI * d.powi(4) / 64.0)
        };
        self.steps.iter().map(bend).sum::<f64>() + self.holder_mm_per_n
    }

    /// Largest bending stress under a force of 1 N at the height `at_mm` above the tip, MPa/N.
    pub fn stress_mpa_per_n(&self, at_mm: f64) -> f64 {
        let stress = |[_, to, d]: &[f64; 3]| (to - at_mm).max(0.0) * 32.0 / (PI * d.powi(3));
        self.steps.iter().map(stress).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniform_beam_has_the_textbook_deflection() {
        let (length, d, e) = (38.14, 8.0, 210_000.0);
        let beam = Beam { steps: vec![[0.0, 20.0, d], [20.0, length, d]], modulus_mpa: e, holder_mm_per_n: 0.0 };
        let inertia = PI * f64::powi(d, 4) / 64.0;
        assert!((beam.tip_mm_per_n(0.0) * 3.0 * e * inertia / length.powi(3) - 1.0).abs() < 1e-12);
        // Force at a: F (L−a)² (2L+a) / (6EI).
        let a = 5.0;
        let expected = (length - a).powi(2) * (2.0 * length + a) / (6.0 * e * inertia);
        assert!((beam.tip_mm_per_n(a) / expected - 1.0).abs() < 1e-12);
        assert!((beam.stress_mpa_per_n(a) - (length - a) * 32.0 / (PI * d.powi(3))).abs() < 1e-12);
    }
}
