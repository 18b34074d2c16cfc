//! Effects without a named cause. In: one covariate. Out: a factor on the load of the cut, or on the tare, that follows a curve over it.
//! The curve is straight between knots, or steps at each knot, and level beyond the first and the last, where nothing was measured.
//!
//! `learn` writes such a curve where a residual follows a covariate and no named effect explains it; `optimize` reads it like any other
//! effect. A curve over the time of the log or over the speed of the axes cannot be predicted for another run: every cut then counts with
//! the largest factor (`job::learned`). A curve over the reading itself, or over the acceleration of the axes, comes from the meter and
//! changes no loads.

use super::{Acts, BARE, Change, Covariate, Effect, Multiplies, Need, Parameter, Place, State};

/// Most knots of a curve.
pub const KNOTS: usize = 8;
/// How the names of the factors at the knots begin.
pub const FACTOR: &str = "factor_";
/// Beginning of the names of the parameters that are places of knots.
pub const PLACE: &str = "at_";
/// Position of unused knots.
pub const BEYOND: f64 = 1e12;
/// Least and greatest factor.
const FACTORS: (f64, f64) = (0.1, 10.0);

const fn at(name: &'static str) -> Parameter {
    Parameter {
        name,
        unit: "of the covariate",
        min: -BEYOND,
        max: BEYOND,
        starts: &[0.0],
        neutral: Some(BEYOND),
        place: Some(Place::Knot),
        meaning: "value of the covariate at this knot",
    }
}

const fn factor(name: &'static str) -> Parameter {
    Parameter {
        name,
        unit: "-",
        min: FACTORS.0,
        max: FACTORS.1,
        starts: &[1.0],
        neutral: Some(1.0),
        place: None,
        meaning: "factor at this knot",
    }
}

/// Knots, then their factors, then whether it goes in steps.
const PARAMETERS: &[Parameter; 2 * KNOTS + 1] = &[
    at("at_1"),
    at("at_2"),
    at("at_3"),
    at("at_4"),
    at("at_5"),
    at("at_6"),
    at("at_7"),
    at("at_8"),
    factor("factor_1"),
    factor("factor_2"),
    factor("factor_3"),
    factor("factor_4"),
    factor("factor_5"),
    factor("factor_6"),
    factor("factor_7"),
    factor("factor_8"),
    Parameter {
        name: "steps",
        unit: "-",
        min: 0.0,
        max: 1.0,
        starts: &[0.0],
        neutral: Some(0.0),
        place: Some(Place::Knot),
        meaning: "1: level from each knot to the next; 0: straight between them",
    },
];

/// One covariate: its effect on the load of the cut and that on the tare.
macro_rules! curves {
    ($($word:literal, $covariate:ident, $acts:ident, $accident:literal;)*) => {
        /// The curves over every covariate, as effects.
        pub const CURVES: &[(Covariate, &Effect)] = &[$(
            (Covariate::$covariate, &Effect {
                name: concat!("unnamed-load-", $word),
                meaning: concat!("no effect of the list: the load of the cut follows ", $word),
                acts: Acts::$acts,
                covariates: &[Covariate::$covariate],
                parameters: PARAMETERS,
                change: |p, state| load(p, Covariate::$covariate, state),
                separated_by: concat!("the same cut at other values of ", $word),
                needs: &[Need::Known(Covariate::$covariate)],
                is_accident: $accident,
                ..BARE
            }),
            (Covariate::$covariate, &Effect {
                name: concat!("unnamed-tare-", $word),
                meaning: concat!("no effect of the list: the tare follows ", $word),
                multiplies: Multiplies::Tare,
                acts: Acts::$acts,
                covariates: &[Covariate::$covariate],
                parameters: PARAMETERS,
                change: |p, state| tare(p, Covariate::$covariate, state),
                separated_by: concat!("air cuts at other values of ", $word),
                needs: &[Need::Tare, Need::Known(Covariate::$covariate)],
                is_accident: $accident,
                ..BARE
            }),
        )*
            // A range of the gearbox, or a belt, takes its share of whatever runs through it: no load of the tool.
            (Covariate::SpindleSpeed, &Effect {
                name: "unnamed-reading-spindle-speed",
                meaning: "no effect of the list: all that the meter shows follows spindle-speed",
                multiplies: Multiplies::Reading,
                acts: Acts::Measuring,
                covariates: &[Covariate::SpindleSpeed],
                parameters: PARAMETERS,
                change: |p, state| all(p, Covariate::SpindleSpeed, state),
                separated_by: "an air cut and the same cut at other spindle speeds",
                needs: &[Need::Tare, Need::Known(Covariate::SpindleSpeed)],
                ..BARE
            }),
        ];
    };
}

curves! {
    "feed-per-tooth", FeedPerTooth, Load, false;
    "chip-thickness", ChipThickness, Load, false;
    "spindle-speed", SpindleSpeed, Load, false;
    "cutting-speed", CuttingSpeed, Load, false;
    "axial-depth", AxialDepth, Load, false;
    "radial-depth", RadialDepth, Load, false;
    "immersion", Immersion, Load, false;
    "up-share", UpShare, Load, false;
    "z", Z, Load, false;
    "entry-distance", SinceEntry, Load, false;
    "curvature", Curvature, Load, false;
    "direction", Heading, Load, false;
    "slope", Slope, Load, false;
    "path-speed", PathSpeed, Measuring, false;
    "path-acceleration", PathAcceleration, Measuring, false;
    "tool", Tool, Load, false;
    "coolant", Coolant, Load, false;
    "predicted-load", Load, Measuring, false;
    "x", X, Load, false;
    "y", Y, Load, false;
    "sliding-distance", Sliding, Load, false;
    "volume-removed", Volume, Load, false;
    "time", Time, Load, true;
}

fn load(p: &[f64], covariate: Covariate, state: &State) -> Change {
    let factor = curve(p, covariate.of(state));
    Change { cutting: factor, edge: factor, ..Change::default() }
}

fn tare(p: &[f64], covariate: Covariate, state: &State) -> Change {
    Change { tare: curve(p, covariate.of(state)), ..Change::default() }
}

fn all(p: &[f64], covariate: Covariate, state: &State) -> Change {
    let factor = curve(p, covariate.of(state));
    Change { tare: factor, cutting: factor, edge: factor, ..Change::default() }
}

/// Values of the parameters: those of [`CURVES`] are knots in rising order, their factors, and whether it goes in steps.
fn parts(p: &[f64]) -> (&[f64], &[f64], bool) {
    (&p[..KNOTS], &p[KNOTS..2 * KNOTS], p[2 * KNOTS] > 0.5)
}

/// Value of the curve at x; NaN where x is not known.
fn curve(p: &[f64], x: f64) -> f64 {
    let (at, factors, steps) = parts(p);
    if x.is_nan() {
        return f64::NAN;
    }
    let next = at.partition_point(|a| *a <= x);
    if next == 0 {
        return factors[0];
    }
    if steps || next == KNOTS || at[next] >= BEYOND {
        return factors[next - 1];
    }
    let share = (x - at[next - 1]) / (at[next] - at[next - 1]);
    factors[next - 1] + share * (factors[next] - factors[next - 1])
}

/// The curve of an effect of [`CURVES`] as (covariate, factor) pairs, two at one place where it goes in steps.
pub fn knots(values: &[f64]) -> Vec<[f64; 2]> {
    let (at, factors, steps) = parts(values);
    let own: Vec<[f64; 2]> =
        at.iter().zip(factors).filter(|(at, _)| **at < BEYOND).map(|(at, factor)| [*at, *factor]).collect();
    if !steps {
        return own;
    }
    own.windows(2).flat_map(|pair| [[pair[1][0], pair[0][1]], pair[1]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parameters of a curve through these knots, or in steps from them on.
    fn through(knots: &[[f64; 2]], steps: f64) -> Vec<f64> {
        let of = |k: usize, column: usize, none: f64| knots.get(k).map_or(none, |knot| knot[column]);
        (0..KNOTS).map(|k| of(k, 0, BEYOND)).chain((0..KNOTS).map(|k| of(k, 1, 1.0))).chain([steps]).collect()
    }

    #[test]
    fn a_curve_is_straight_between_knots_and_level_beyond_them() {
        let p = through(&[[-4.5, 1.2], [0.0, 1.0], [10.0, 0.5]], 0.0);
        for (x, factor) in [(-9.0, 1.2), (-4.5, 1.2), (-2.25, 1.1), (5.0, 0.75), (10.0, 0.5), (99.0, 0.5)] {
            assert!((curve(&p, x) - factor).abs() < 1e-12, "{x}: {}", curve(&p, x));
        }
        assert!(curve(&p, f64::NAN).is_nan());
        assert_eq!(knots(&p), [[-4.5, 1.2], [0.0, 1.0], [10.0, 0.5]]);
    }

    #[test]
    fn in_steps_it_is_level_from_each_knot_on() {
        let p = through(&[[0.0, 1.0], [2.0, 1.3], [3.0, 0.9]], 1.0);
        let at = [-1.0, 1.999, 2.0, 2.999, 9.0].map(|x| curve(&p, x));
        assert_eq!(at, [1.0, 1.0, 1.3, 1.3, 0.9]);
        assert_eq!(knots(&p), [[2.0, 1.0], [2.0, 1.3], [3.0, 1.3], [3.0, 0.9]]);
    }
}
