//! Axes on the meter: a meter that feeds the whole machine reads the friction and the acceleration of the axes too:
//! idle reading + idle reading at the reference speed of the spindle · (f·v + a·v·max(0, a)), v the speed along the
//! path in m/min and a the acceleration in m/s²: the axes know nothing of the spindle, and a drive that brakes gives
//! nothing back.

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
