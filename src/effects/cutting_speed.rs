//! Cutting speed. In: cutting speed v. Out: a factor on all coefficients, exp(p ln v + q ln² v) with v in m/s.
//!
//! p < 0 where heat softens the material, p > 0 where the strain rate hardens it. q > 0 where there is a speed exp(−p/2q) m/s at which the
//! material cuts most easily: below it an edge builds up, above it the strain rate or the wear of a hot edge takes over. The logarithm is
//! linear in p and q, so that their fit has one minimum.

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
            min: -12.0,
            max: 12.0,
            starts: &[0.0],
            neutral: Some(0.0),
            place: None,
            meaning: "exponent of the cutting speed at 1 m/s",
        },
        Parameter {
            name: "bend",
            unit: "-",
            min: 0.0,
            max: 3.0,
            starts: &[0.02],
            neutral: Some(0.0),
            place: None,
            meaning: "rise of the logarithm per square of ln(v / 1 m/s)",
        },
    ],
    // The power law; with a bend.
    forms: &[&[0], &[0, 1]],
    refused,
    change,
    separated_by: "one cut at four spindle speeds and the same feed per tooth",
    needs: &[Need::Ratio(Covariate::CuttingSpeed, 1.05)],
    ..BARE
};

/// Largest exponent of the power law, either way: 0.1 to 0.4 for metals, and room for more.
const STEEPEST: f64 = 0.8;

fn refused(p: &[f64], _clock_s: f64) -> Option<String> {
    let is_too_steep = p[1] == 0.0 && p[0].abs() > STEEPEST;
    is_too_steep.then(|| format!("an exponent of {:.2} of the cutting speed is beyond that of any material", p[0]))
}

fn change(p: &[f64], state: &State) -> Change {
    // A speed that is not known changes nothing.
    if state.cutting_speed_mm_s.is_nan() {
        return Change::default();
    }
    let ln = (state.cutting_speed_mm_s.max(1.0) / 1000.0).ln();
    let factor = (p[0] * ln + p[1] * ln * ln).exp();
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
        assert!((factor(&[-0.3, 0.0], 4.0) - 4f64.powf(-0.3)).abs() < 1e-12);
        assert_eq!(factor(&[-0.3, 2.0], f64::NAN), 1.0);
        // Least at 3 m/s: p = −2q ln 3.
        let bent = |speed_m_s: f64| factor(&[-3f64.ln(), 0.5], speed_m_s);
        assert!(bent(3.0) < bent(2.9) && bent(3.0) < bent(3.1) && (bent(1.5) - bent(6.0)).abs() < 1e-12);
    }

    #[test]
    fn a_power_beyond_that_of_any_material_is_refused_and_the_slope_of_a_bend_at_one_speed_is_not() {
        assert!(refused(&[-0.79, 0.0], 1.0).is_none() && refused(&[-0.81, 0.0], 1.0).is_some());
        assert!(refused(&[-2.0, 0.5], 1.0).is_none());
    }
}
