//! Size effect, h the chip thickness in every sector of the engaged arc: k_?c · (h/0.05 mm)^−m, Kienzle's exponent; or one level
//! of k_?c for thin chips and another for thick ones, k_?c · (1 + a/(1 + (h/h₀)⁴)), the shape of Ko, Yun and Cho's K_n.

use super::{Acts, BARE, Change, Covariate, Effect, Need, Parameter, State, Way};

/// `size-effect`.
pub const EFFECT: Effect = Effect {
    name: "size-effect",
    meaning: "cutting coefficients fall as the chip gets thicker",
    acts: Acts::Load,
    covariates: &[Covariate::ChipThickness, Covariate::FeedPerTooth],
    family: &[Covariate::ChipThickness, Covariate::FeedPerTooth],
    way: Way::Down,
    parameters: &[
        Parameter {
            name: "exponent",
            unit: "-",
            min: 0.0,
            max: 0.9,
            starts: &[0.2],
            neutral: Some(0.0),
            place: None,
            meaning: "exponent of the chip thickness over 0.05 mm",
        },
        Parameter {
            name: "thin_excess",
            unit: "-",
            min: 0.0,
            max: 10.0,
            starts: &[0.5],
            neutral: Some(0.0),
            place: None,
            meaning: "relative excess of the thinnest chips over thick ones",
        },
        Parameter {
            name: "thin",
            unit: "mm",
            min: 0.002,
            max: 0.5,
            starts: &[0.02, 0.05],
            neutral: Some(0.002),
            place: None,
            meaning: "chip thickness at which half of that excess is left",
        },
    ],
    forms: &[&[0], &[1, 2]],
    change,
    separated_by: "one immersion at five feeds over a factor of eight",
    needs: &[Need::Ratio(Covariate::ChipThickness, 1.2)],
    ..BARE
};

fn change(p: &[f64], state: &State) -> Change {
    let factor = |h_mm: f64| (h_mm / 0.05).powf(-p[0]) * (1.0 + p[1] / (1.0 + (h_mm / p[2]).powi(4)));
    let [cutting, _] = state.over_arc(|sector| factor(sector.chip_thickness_mm.max(1e-4)));
    Change { cutting, ..Change::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thin_chips_have_a_level_of_their_own_of_which_half_is_left_where_it_says() {
        let cutting =
            |h_mm: f64| change(&[0.0, 0.6, 0.03], &State { chip_thickness_mm: h_mm, ..State::default() }).cutting;
        assert!((cutting(0.001) - 1.6).abs() < 1e-3 && (cutting(0.03) - 1.3).abs() < 1e-12);
        assert!((cutting(0.3) - 1.0).abs() < 1e-3);
        let kienzle = State { chip_thickness_mm: 0.1, ..State::default() };
        assert!((change(&[0.25, 0.0, 0.002], &kienzle).cutting - 2.0_f64.powf(-0.25)).abs() < 1e-12);
    }
}
