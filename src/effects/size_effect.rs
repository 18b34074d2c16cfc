//! Size effect: k_?c · (h/0.05 mm)^−m with the mean chip thickness h over the engaged arc (Kienzle's exponent).

use super::{Acts, Change, Covariate, Effect, Parameter, State};

/// `size-effect`.
pub const EFFECT: Effect = Effect {
    name: "size-effect",
    meaning: "cutting coefficients fall as the chip gets thicker",
    acts: Acts::Load,
    covariates: &[Covariate::ChipThickness, Covariate::FeedPerTooth],
    parameters: &[Parameter {
        name: "exponent",
        unit: "-",
        min: 0.0,
        max: 0.9,
        starts: &[0.2],
        neutral: None,
        scanned: false,
        meaning: "exponent of the mean chip thickness over 0.05 mm",
    }],
    change,
    separated_by: "one immersion at five feeds over a factor of eight",
};

fn change(p: &[f64], state: &State) -> Change {
    let h = state.chip_thickness_mm.max(1e-4);
    Change { cutting: (h / 0.05).powf(-p[0]), ..Change::default() }
}
