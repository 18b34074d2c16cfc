//! Flank wear in its three stages. In: distance l that each tooth has slid through material, in units of 100 m. Out:
//! k_?e · (1 + r (1 − e^(−l/λ)) + g l + a l³): running in, steady growth, the end of the edge.
//!
//! It is the wear law of a tool ([`crate::machine::wear`]) over the sliding distance, for a wear index that is 1 on a fresh edge. `learn` fits
//! it with the exponent −1, for which every mm slid counts the same whatever the feed.

use super::{Acts, BARE, Change, Covariate, Effect, Need, Parameter, State, Way};
use crate::machine::wear::{COUNTED_AT_MM, Counted, WearRate};

/// Unit of the sliding distance l, mm.
const UNIT_MM: f64 = 1e5;

/// `flank-wear`.
pub const EFFECT: Effect = Effect {
    name: "flank-wear",
    meaning: "edge forces grow with the distance the teeth have slid",
    acts: Acts::Load,
    covariates: &[Covariate::Sliding, Covariate::Time, Covariate::Volume],
    family: &[Covariate::Sliding],
    way: Way::Up,
    parameters: &[
        Parameter {
            name: "growth_per_100m",
            unit: "1/100m",
            min: 0.0,
            max: 50.0,
            starts: &[0.5],
            neutral: None,
            place: None,
            meaning: "relative growth of the edge coefficients every 100 m",
        },
        Parameter {
            name: "run_in",
            unit: "-",
            min: 0.0,
            max: 3.0,
            starts: &[0.3],
            neutral: Some(0.0),
            place: None,
            meaning: "relative growth while the edge runs in",
        },
        Parameter {
            name: "run_in_length",
            unit: "100m",
            min: 0.005,
            max: 5.0,
            starts: &[0.1],
            neutral: Some(0.1),
            place: None,
            meaning: "distance over which it runs in",
        },
        Parameter {
            name: "end",
            unit: "1/(100m)^3",
            min: 0.0,
            max: 50.0,
            starts: &[0.05],
            neutral: Some(0.0),
            place: None,
            meaning: "cubic growth towards the end of the edge",
        },
        Parameter {
            name: "exponent",
            unit: "-",
            min: -1.0,
            max: 2.0,
            starts: &[-1.0],
            neutral: Some(-1.0),
            place: None,
            meaning: "power of the feed in the growth per length of cut; -1: the way slid alone, above 0: slower feeds spare the edge",
        },
        Parameter {
            name: "feed_per_tooth",
            unit: "mm",
            min: 1e-3,
            max: 10.0,
            starts: &[COUNTED_AT_MM],
            neutral: Some(COUNTED_AT_MM),
            place: None,
            meaning: "feed per tooth at which the growth holds; of no matter to the exponent -1",
        },
    ],
    // All combinations of the stages. The exponent and its feed are never fitted here: a model file or the readings over the life of a tool
    // give them.
    forms: &[&[0, 1, 2, 3], &[0, 2, 3], &[0, 1, 3], &[0, 3], &[0, 1, 2], &[0, 2], &[0, 1], &[0]],
    change,
    wear: Some(rate),
    as_worn: Some(as_worn),
    separated_by: "the first cut repeated after the last, at the same feed",
    needs: &[Need::Range(Covariate::Sliding, 1e3)],
    ..BARE
};

fn as_worn(p: &[f64], way_mm: f64) -> Vec<f64> {
    let mut values = p.to_vec();
    let lowest = EFFECT.parameters[2].min;
    (values[0], values[1], values[2], values[3]) = (0.0, rate(p).rise(way_mm), lowest, 0.0);
    values
}

fn rate(p: &[f64]) -> WearRate {
    WearRate {
        per_mm: p[0] / UNIT_MM,
        counted: Counted::TeethWay,
        feed_per_tooth_mm: p[5],
        exponent: p[4],
        run_in: p[1],
        run_in_mm: p[2] * UNIT_MM,
        end_per_mm3: p[3] / UNIT_MM.powi(3),
    }
}

fn change(p: &[f64], state: &State) -> Change {
    let rate = rate(p);
    let mm = state.slid.at(rate.exponent) * (COUNTED_AT_MM / rate.feed_per_tooth_mm).powf(rate.exponent + 1.0);
    Change { edge: 1.0 + rate.rise(mm), ..Change::default() }
}
