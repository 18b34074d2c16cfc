//! Cutting speed. In: cutting speed v. Out: a factor on all coefficients, (v / 1 m/s)^p.
//!
//! p < 0 where heat softens the material, p > 0 where the strain rate hardens it.

use super::{Acts, BARE, Change, Covariate, Effect, Need, Parameter, State, Way};

/// `cutting-speed`.
pub const EFFECT: Effect = Effect {
    name: "cutting-speed",
    meaning: "cutting and edge coefficients depend on cutting speed",
    acts: Acts::Load,
    covariates: &[Covariate::CuttingSpeed, Covariate::SpindleSpeed],
    family: &[Covariate::SpindleSpeed],
    // A load that is largest at one speed inside the range is a resonance of the machine.
    way: Way::NoPeak,
    parameters: &[Parameter {
        name: "exponent",
        unit: "-",
        min: -0.8,
        max: 0.8,
        starts: &[0.0],
        neutral: None,
        place: None,
        meaning: "exponent of the cutting speed over 1 m/s",
    }],
    change,
    separated_by: "one cut at four spindle speeds and the same feed per tooth",
    needs: &[Need::Ratio(Covariate::CuttingSpeed, 1.05)],
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    let factor = (state.cutting_speed_mm_s.max(1.0) / 1000.0).powf(p[0]);
    Change { cutting: factor, edge: factor, ..Change::default() }
}
