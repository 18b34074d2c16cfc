//! Hard zone. In: position (x, y) of every sector of the engaged arc. Out: a factor 1 + z u on all coefficients, averaged over the arc.
//!
//! u is 1 inside a region, 0 outside and ½ on its border ρ = 1, with ρⁿ = |(x − x₀)/a|ⁿ + |(y − y₀)/b|ⁿ: an ellipse for n = 2, nearly a box
//! for n = 16, its sides along the work coordinates. Across the border u falls as 3s² − 2s³ over ρ = 1 ± 1.5 w, where its slope is
//! −1/(2w): w is the half width of the soft border over the half width of the region.

use super::{Acts, BARE, Change, Covariate, Effect, Need, Parameter, Place, State};

/// `hard-zone`.
pub const EFFECT: Effect = Effect {
    name: "hard-zone",
    meaning: "the material is harder (or softer) in a region of the stock",
    acts: Acts::Load,
    covariates: &[Covariate::X, Covariate::Y, Covariate::Z],
    parameters: &[
        Parameter {
            name: "excess",
            unit: "-",
            min: -0.8,
            max: 5.0,
            starts: &[0.2],
            neutral: None,
            place: None,
            meaning: "relative excess of all coefficients inside",
        },
        Parameter {
            name: "x_min",
            unit: "mm",
            min: -1e9,
            max: 1e9,
            starts: &[0.0],
            neutral: None,
            place: Some(Place::XMin),
            meaning: "region",
        },
        Parameter {
            name: "x_max",
            unit: "mm",
            min: -1e9,
            max: 1e9,
            starts: &[0.0],
            neutral: None,
            place: Some(Place::XMax),
            meaning: "region",
        },
        Parameter {
            name: "y_min",
            unit: "mm",
            min: -1e9,
            max: 1e9,
            starts: &[0.0],
            neutral: None,
            place: Some(Place::YMin),
            meaning: "region",
        },
        Parameter {
            name: "y_max",
            unit: "mm",
            min: -1e9,
            max: 1e9,
            starts: &[0.0],
            neutral: None,
            place: Some(Place::YMax),
            meaning: "region",
        },
        Parameter {
            name: "border",
            unit: "-",
            min: 0.02,
            max: WIDEST_BORDER,
            starts: &[0.1, 0.4],
            neutral: None,
            place: None,
            meaning: "half the width of its border over half the width of the region",
        },
        Parameter {
            name: "squareness",
            unit: "-",
            min: 2.0,
            max: 16.0,
            starts: &[6.0, 2.5],
            // The search takes a box with round corners; the exponent is fitted once a region is found.
            neutral: Some(ROUND_BOX),
            place: None,
            meaning: "how square the region is: 2 an ellipse, 4 a box with round corners, 16 nearly a box",
        },
    ],
    change,
    separated_by: "crossing the region again, later and in another direction",
    needs: &[Need::Range(Covariate::X, 1.0), Need::Range(Covariate::Y, 1.0), Need::Samples],
    refused,
    ..BARE
};

/// Least side of the region, mm: twice the least half side that the law resolves. The value is not critical: a zone must be found again
/// with each fold of blocks left out, and fifteen development logs at 6 % noise (five with a zone) get the same answers with 0, 2 and
/// 8 mm.
const LEAST_SIDE_MM: f64 = 2.0;

/// Half width of the border over that of the region from which it is a slope over the part, as wear is: by definition.
const WIDEST_BORDER: f64 = 1.0;

fn refused(p: &[f64], _clock_s: f64) -> Option<String> {
    let side_mm = (p[2] - p[1]).abs().min((p[4] - p[3]).abs());
    if side_mm < LEAST_SIDE_MM {
        return Some(format!("a region {side_mm:.2} mm wide is no zone of a material"));
    }
    (p[5] >= WIDEST_BORDER).then(|| "its border is as wide as the region: a slope over the part, no zone".to_owned())
}

fn change(p: &[f64], state: &State) -> Change {
    let centre = [f64::midpoint(p[1], p[2]), f64::midpoint(p[3], p[4])];
    let half = [(0.5 * (p[2] - p[1])).abs().max(0.5), (0.5 * (p[4] - p[3])).abs().max(0.5)];
    let [cutting, edge] = state.over_arc(|sector| {
        let [a, b] = [0, 1].map(|k| ((sector.at[k] - centre[k]) / half[k]).abs());
        1.0 + p[0] * inside(a.max(b), a.min(b), p[6], p[5])
    });
    Change { cutting, edge, ..Change::default() }
}

/// u at (a, b) half widths from the centre, a ≥ b. ρ lies between a and √2 a, so that it need not be known far from the border.
fn inside(a: f64, b: f64, squareness: f64, border: f64) -> f64 {
    let reach = REACH * border;
    if a >= 1.0 + reach {
        return 0.0;
    }
    if std::f64::consts::SQRT_2 * a <= 1.0 - reach {
        return 1.0;
    }
    let s = ((1.0 + reach - radius(a, b, squareness)) / (2.0 * reach)).clamp(0.0, 1.0);
    s * s * (3.0 - 2.0 * s)
}

/// ρ. For the exponent that the search uses it is worked out by square roots: `powf` would take most of the time of the search.
fn radius(a: f64, b: f64, squareness: f64) -> f64 {
    if squareness == ROUND_BOX {
        let (a, b) = (a * a, b * b);
        return (a * a + b * b).sqrt().sqrt();
    }
    a * (1.0 + (b / a.max(1e-12)).powf(squareness)).powf(1.0 / squareness)
}

/// Squareness of the region while it is looked for.
const ROUND_BOX: f64 = 4.0;

/// Half widths of the border beyond which u is 0 or 1.
const REACH: f64 = 1.5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Sector;

    /// Share of the excess at a place of a zone about the origin, 10 mm wide and 6 mm high.
    fn share(at: [f64; 2], squareness: f64) -> f64 {
        let mut state = State::default();
        state.sectors[0] = Sector { share: [1.0, 1.0], at, ..Sector::default() };
        change(&[1.0, -5.0, 5.0, -3.0, 3.0, 0.1, squareness], &state).cutting - 1.0
    }

    #[test]
    fn a_region_narrower_than_two_millimetres_is_refused() {
        let wide = |mm: f64| [0.3, 10.0, 40.0, 5.0, 5.0 + mm, 0.1, 4.0];
        assert!((EFFECT.refused)(&wide(1.9), 0.0).is_some() && (EFFECT.refused)(&wide(2.1), 0.0).is_none());
    }

    #[test]
    fn a_region_whose_border_is_as_wide_as_itself_is_refused() {
        let soft = |border: f64| [0.3, 10.0, 40.0, 5.0, 35.0, border, 4.0];
        assert!((EFFECT.refused)(&soft(1.0), 0.0).is_some() && (EFFECT.refused)(&soft(0.99), 0.0).is_none());
    }

    #[test]
    fn the_box_with_round_corners_is_the_power_law_at_four() {
        for (a, b) in [(1.2, 0.9), (0.8, 0.8), (0.5, 0.0), (0.0, 0.0)] {
            assert!((radius(a, b, ROUND_BOX) - radius(a, b, ROUND_BOX + 1e-9)).abs() < 1e-8, "{a} {b}");
        }
    }

    #[test]
    fn its_border_is_an_ellipse_or_a_box() {
        let diagonal = 0.5f64.sqrt();
        for squareness in [2.0, 4.0, 16.0] {
            assert!((share([5.0, 0.0], squareness) - 0.5).abs() < 1e-9);
            assert!((share([0.0, -3.0], squareness) - 0.5).abs() < 1e-9);
            assert!(share([0.0, 0.0], squareness) > 0.999 && share([10.0, 0.0], squareness) < 1e-6);
        }
        assert!((share([5.0 * diagonal, 3.0 * diagonal], 2.0) - 0.5).abs() < 1e-9);
        assert!(share([4.5, 2.7], 2.0) < 0.02 && share([4.5, 2.7], 16.0) > 0.7);
    }
}
