//! Cutting speed. In: cutting speed v. Out: a factor on all coefficients, (v / 1 m/s)^p · exp(q ln²(v/v_o)).
//!
//! p < 0 where heat softens the material, p > 0 where the strain rate hardens it. q > 0 where there is a speed v_o at which the material
//! cuts most easily: below it an edge builds up, above it the strain rate or the wear of a hot edge takes over.

use super::{Acts, BARE, Change, Covariate, Effect, Need, Parameter, State, Way};

/// `cutting-speed`.
pub const EFFECT: Effect = Effect {
    name: "cutting-speed",
    meaning: "cutting and edge coefficients depend on cutting speed",
    acts: Acts::Load,
    covariates: &[Covariate::CuttingSpeed, Covariate::SpindleSpeed],
    family: &[Covariate::CuttingSpeed, Covariate::SpindleSpeed],
    // A load that is largest at one speed inside the range is a resonance of the machine.
    way: Way::NoPeak,
    parameters: &[
        Parameter {
            name: "exponent",
            unit: "-",
            min: -0.8,
            max: 0.8,
            starts: &[0.0],
            neutral: Some(0.0),
            place: None,
            meaning: "exponent of the cutting speed over 1 m/s",
        },
        Parameter {
            name: "bend",
            unit: "-",
            min: 0.0,
            max: 3.0,
            // From next to nothing: where the optimum is far off, a strong bend turns the load away from what it should follow.
            starts: &[0.02],
            neutral: Some(0.0),
            place: None,
            meaning: "rise of the logarithm per square of ln(v/v_o)",
        },
        Parameter {
            name: "optimum",
            unit: "m/s",
            min: 0.05,
            max: 50.0,
            starts: &[1.0, 2.0, 4.0, 8.0],
            neutral: Some(1.0),
            place: None,
            meaning: "cutting speed v_o of the least coefficients",
        },
    ],
    // The power law; a least value at an optimum.
    forms: &[&[0], &[1, 2]],
    change,
    separated_by: "one cut at four spindle speeds and the same feed per tooth",
    needs: &[Need::Ratio(Covariate::CuttingSpeed, 1.05)],
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    // A speed that is not known changes nothing.
    if state.cutting_speed_mm_s.is_nan() {
        return Change::default();
    }
    let speed_m_s = state.cutting_speed_mm_s.max(1.0) / 1000.0;
    let factor = speed_m_s.powf(p[0]) * (p[1] * (speed_m_s / p[2]).ln().powi(2)).exp();
    Change { cutting: factor, edge: factor, ..Change::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factor(p: &[f64], speed_m_s: f64) -> f64 {
        change(p, &State { cutting_speed_mm_s: 1000.0 * speed_m_s, ..State::default() }).cutting
    }

    #[test]
    fn the_load_follows_a_power_of_the_speed_or_is_least_at_an_optimum() {
        assert!((factor(&[-0.3, 0.0, 1.0], 4.0) - 4f64.powf(-0.3)).abs() < 1e-12);
        assert_eq!(factor(&[-0.3, 2.0, 3.0], f64::NAN), 1.0);
        let bent = |speed_m_s: f64| factor(&[0.0, 0.5, 3.0], speed_m_s);
        assert!((bent(3.0) - 1.0).abs() < 1e-12 && (bent(1.5) - bent(6.0)).abs() < 1e-12 && bent(6.0) > 1.2);
    }
}
