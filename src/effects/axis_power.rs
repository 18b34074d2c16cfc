//! Axes on the meter. In: speed v along the path, m/min, and acceleration a, m/s². Out: a factor on the tare.
//!
//! A meter at the supply of the whole machine also reads the friction and the acceleration of the axes:
//! P = P₀(n) + P₀(n₀) · (k_f v + k_a v max(0, a)), P₀(n) being the idle reading at spindle speed n and n₀ the reference speed. The second
//! term does not depend on n, because the axes do not; braking counts as 0, because these drives feed nothing back.

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
    ],
    change,
    separated_by: "the same air move at several feeds, and one zigzag of short moves in air",
    needs: &[Need::Tare, Need::Known(Covariate::PathSpeed)],
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    let speed_m_min = 0.06 * state.path_speed_mm_s;
    let acceleration_m_s2 = 1e-3 * state.path_acceleration_mm_s2.max(0.0); // unknown: none
    let share = if state.tare_share > 0.0 { state.tare_share } else { 1.0 };
    Change { tare: 1.0 + speed_m_min * (p[0] + p[1] * acceleration_m_s2) / share, ..Change::default() }
}
