//! Candidates: whether data can show an effect at all, and where the search for it begins.

use crate::effects::{Acts, Covariate, Effect, Geometry, Need, Parameter, Place};
use crate::learn::dataset::samples::{Class, Data};
use crate::learn::diagnose::criteria::PLACED_BY;
use crate::learn::diagnose::score_test::{instant, region};
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::Fitted;
use crate::learn::model::starts::{forms, product};
use crate::learn::program::variant::Variant;

/// Why an effect cannot be seen in these data; `None`: it can.
pub fn why_not(effect: &Effect, data: &Data) -> Option<String> {
    let moves = |geometry: &Geometry| {
        let columns = data.variant(Variant::of(*geometry)).map(|v| v.columns.iter().flatten());
        columns.is_some_and(|mut all| all.any(|x| x.abs() > 1e-12))
    };
    if !effect.geometry.is_empty() && !effect.geometry.iter().any(moves) {
        return Some("these data do not show the geometry it acts on".to_owned());
    }
    if effect.acts == Acts::Motion && data.slower.is_empty() {
        return Some("no motion model belongs to these data".to_owned());
    }
    effect.needs.iter().find_map(|need| lacks(*need, data))
}

/// Why data do not meet a need.
fn lacks(need: Need, data: &Data) -> Option<String> {
    let has = |class: Class| data.base.iter().any(|base| base.class == class);
    match need {
        Need::Range(covariate, by) => {
            let (lo, hi) = range(covariate, data, f64::NEG_INFINITY);
            (hi - lo <= by).then(|| format!("{} does not vary in these data", covariate.name()))
        }
        Need::Ratio(covariate, by) => {
            let top = range(covariate, data, f64::NEG_INFINITY).1;
            let (lo, hi) = range(covariate, data, 0.02 * top);
            let enough = hi.max(0.0) / lo >= by;
            (!enough).then(|| format!("{} varies by less than a factor of {by}", covariate.name()))
        }
        Need::Known(covariate) => {
            let known = data.used().any(|i| covariate.of(&data.state[i]).is_finite());
            (!known).then(|| format!("{} is not known of these data", covariate.name()))
        }
        Need::Tare => (!has(Class::Tare)).then(|| "nothing measured has a tare".to_owned()),
        Need::NoEdgeCoefficients => has(Class::Edge).then(|| "the base model has edge coefficients".to_owned()),
        Need::Samples => (data.used().count() < PLACED_BY).then(|| "too few samples to place it".to_owned()),
        Need::Series => (!data.is_series()).then(|| "steady readings have no lag".to_owned()),
    }
}

/// Least and greatest value of a covariate above `floor`.
fn range(covariate: Covariate, data: &Data, floor: f64) -> (f64, f64) {
    let values = data.used().map(|i| covariate.of(&data.state[i])).filter(|v| v.is_finite() && *v > floor);
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)))
}

/// Forms of the effect and values of its parameters to begin with; empty when none are worth trying.
pub fn starts(effect: &'static Effect, data: &Data, present: &Fitted) -> Vec<FittedEffect> {
    let values = if effect.is_looked_for() {
        placed(effect, data, present)
    } else if effect.changes(Geometry::Runout) && data.runouts.is_narrow() {
        vec![data.runouts.middle().to_vec()]
    } else {
        product(effect)
    };
    values.iter().flat_map(|values| forms(effect, values)).collect()
}

/// The starting values with the instant or the region that the data show. What is optional of a region stays neutral until it is found:
/// with a free shape it would follow too much as a rival of others.
fn placed(effect: &Effect, data: &Data, present: &Fitted) -> Vec<Vec<f64>> {
    let is_instant = effect.parameters.iter().any(|p| p.place == Some(Place::Instant));
    let found = if is_instant { instant(data, present).map(|t| [t; 4]) } else { region(data, present) };
    let Some(found) = found else { return Vec::new() };
    let settled = |values: Vec<f64>| -> Vec<f64> {
        let value = |(p, start): (&Parameter, f64)| match p.place {
            Some(Place::Instant | Place::XMin) => found[0],
            Some(Place::XMax) => found[1],
            Some(Place::YMin) => found[2],
            Some(Place::YMax) => found[3],
            None => p.neutral.filter(|_| !is_instant).unwrap_or(start),
        };
        effect.parameters.iter().zip(values).map(value).collect()
    };
    let mut all: Vec<Vec<f64>> = product(effect).into_iter().map(settled).collect();
    all.dedup();
    all
}
