//! Axes on the meter. In: speed v along the path, m/min, and acceleration a, m/s². Out: a factor on the tare.
//!
//! A meter at the supply of the whole machine also reads the friction and the acceleration of the axes:
//! P = P₀(n) + P₀(n₀) · (k_f v^m + k_a v max(0, a)), P₀(n) being the idle reading at spindle speed n and n₀ the reference speed. The second
//! term does not depend on n, because the axes do not; braking counts as 0, because these drives feed nothing back. Dry friction in the guides takes a force that
//! does not depend on v, so that m is 1; in oil it grows with v, so that m comes to 2 (Stribeck); what the drives take as soon as they
//! move, whatever the speed, makes m less than 1.

use super::{Acts, BARE, Change, Covariate, Effect, Multiplies, Need, Parameter, State};

/// `axis-power`.
pub const EFFECT: Effect = Effect {
    name: "axis-power",
    meaning: "the meter also feeds the axes: idle power grows with the speed and the acceleration of the path",
    acts: Acts::Measuring,
    covariates: &[Covariate::PathSpeed, Covariate::PathAcceleration],
    multiplies: Multiplies::Tare,
    parameters: &[
        Parameter {
            name: "friction",
            unit: "1/(m/min)",
            min: 0.0,
            max: 2.0,
            starts: &[0.02],
            neutral: Some(0.0),
            place: None,
            meaning: "rise of the idle power per m/min, over the idle power",
        },
        Parameter {
            name: "acceleration",
            unit: "1/(m/min · m/s²)",
            min: 0.0,
            max: 2.0,
            starts: &[0.02],
            neutral: Some(0.0),
            place: None,
            meaning: "rise per m/min and m/s² while the axes accelerate",
        },
        Parameter {
            name: "exponent",
            unit: "-",
            min: 0.0,
            max: 2.0,
            starts: &[1.0],
            neutral: Some(1.0),
            place: None,
            meaning: "exponent of the speed in the friction",
        },
    ],
    // Friction; acceleration; both; friction with an exponent of its own; this and acceleration.
    forms: &[&[0], &[1], &[0, 1], &[0, 2], &[0, 1, 2]],
    change,
    separated_by: "the same air move at several feeds, and one zigzag of short moves in air",
    needs: &[Need::Tare, Need::Known(Covariate::PathSpeed)],
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    let speed_m_min = 0.06 * state.path_speed_mm_s;
    let acceleration_m_s2 = 1e-3 * state.path_acceleration_mm_s2.max(0.0); // unknown: none
    let share = if state.tare_share > 0.0 { state.tare_share } else { 1.0 };
    let friction = if speed_m_min > 0.0 { p[0] * speed_m_min.powf(p[2]) } else { 0.0 };
    Change { tare: 1.0 + (friction + p[1] * speed_m_min * acceleration_m_s2) / share, ..Change::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_grows_with_a_power_of_the_speed_and_takes_nothing_at_rest() {
        let tare = |p: &[f64], speed_mm_s: f64| {
            change(p, &State { path_speed_mm_s: speed_mm_s, tare_share: 0.5, ..State::default() }).tare
        };
        // 50 mm/s are 3 m/min.
        assert!((tare(&[0.02, 0.0, 1.0], 50.0) - 1.12).abs() < 1e-12);
        assert!((tare(&[0.02, 0.0, 2.0], 50.0) - 1.36).abs() < 1e-12);
        assert!((tare(&[0.02, 0.0, 0.0], 50.0) - 1.04).abs() < 1e-12 && tare(&[0.02, 0.0, 0.0], 0.0) == 1.0);
    }
}
