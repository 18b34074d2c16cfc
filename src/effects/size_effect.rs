//! Size effect (Kienzle). In: chip thickness h in every sector of the engaged arc. Out: k_?c · (h / 0.05 mm)^(−m), averaged over the arc.

use super::{Acts, BARE, Change, Covariate, Effect, Need, Parameter, State, Way};

/// `size-effect`.
pub const EFFECT: Effect = Effect {
    name: "size-effect",
    meaning: "cutting coefficients fall as the chip gets thicker",
    acts: Acts::Load,
    covariates: &[Covariate::ChipThickness, Covariate::FeedPerTooth],
    family: &[Covariate::ChipThickness, Covariate::FeedPerTooth],
    way: Way::Down,
    parameters: &[Parameter {
        name: "exponent",
        unit: "-",
        min: 0.0,
        max: 0.9,
        starts: &[0.2],
        neutral: None,
        place: None,
        meaning: "exponent of the chip thickness over 0.05 mm",
    }],
    change,
    separated_by: "one immersion at five feeds over a factor of eight",
    needs: &[Need::Ratio(Covariate::ChipThickness, 1.2)],
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    let [cutting, _] = state.over_arc(|sector| (sector.chip_thickness_mm.max(1e-4) / 0.05).powf(-p[0]));
    Change { cutting, ..Change::default() }
}
