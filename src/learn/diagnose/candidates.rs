//! Candidates. In: an effect, data. Out: why the data cannot show it, or the parameter values that its fit starts from.

use crate::effects::{Acts, Covariate, Effect, Geometry, Multiplies, Need, Parameter, Place};
use crate::learn::dataset::samples::{Class, Data};
use crate::learn::diagnose::criteria::PLACED_BY;
use crate::learn::diagnose::score_test::{instant, region};
use crate::learn::model::design::{FittedEffect, full_load};
use crate::learn::model::fit::Fitted;
use crate::learn::model::starts::{forms, start_values};
use crate::learn::program::variant::Variant;

/// Why these data cannot show an effect; `None` if they can.
pub fn why_not(effect: &Effect, data: &Data) -> Option<String> {
    let moves = |geometry: &Geometry| {
        let simulated = data.variants.iter().filter(|v| v.variant == Variant::of(*geometry));
        simulated.flat_map(|v| v.columns.iter().flatten()).any(|x| x.abs() > 1e-12)
    };
    if !effect.geometry.is_empty() && !effect.geometry.iter().any(moves) {
        return Some("no cut in these data changes with the geometry it acts on".to_owned());
    }
    if effect.acts == Acts::Motion && data.slower.is_empty() {
        return Some("these data have no motion model".to_owned());
    }
    effect.needs.iter().find_map(|need| lacks(*need, data))
}

/// Why data do not meet a requirement of an effect; `None` if they do.
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
        Need::Tare => (!has(Class::Tare)).then(|| "no measured quantity has a tare".to_owned()),
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

/// Two values of a covariate count as one up to this ratio: the least by which cutting speeds differ for their effect to be sought.
const ONE_LEVEL: f64 = 1.05;

/// How many different ones there are among these values of a covariate.
fn levels(mut values: Vec<f64>) -> usize {
    values.retain(|value| value.is_finite());
    values.sort_by(f64::total_cmp);
    let mut levels: Vec<f64> = Vec::new();
    for value in values {
        if levels.last().is_none_or(|last| value - last > (ONE_LEVEL - 1.0) * value.abs()) {
            levels.push(value);
        }
    }
    levels.len()
}

/// Can the values of the covariates tell so many parameters? At one value, the reference, the base coefficients take all of the load. An effect
/// on the load is told by cuts alone: a spindle that runs up passes through other speeds.
fn can_tell(effect: &Effect, parameters: usize, data: &Data) -> bool {
    let is_cut = |i: &usize| {
        let mut bases = data.base.iter().zip(&data.columns);
        bases.any(|(base, column)| base.class == Class::Cutting && column[*i] > 0.0)
    };
    let counts = |i: &usize| effect.multiplies != Multiplies::Load || is_cut(i);
    let samples: Vec<usize> = data.used().filter(counts).collect();
    let of = |covariate: &Covariate| levels(samples.iter().map(|i| covariate.of(&data.state[*i])).collect());
    parameters <= 1 || effect.covariates.iter().map(of).max().is_none_or(|levels| parameters < levels)
}

/// Forms of the effect that the data can tell, with start values of its parameters; empty if an instant or region was searched for and not
/// found.
pub fn starts(effect: &'static Effect, data: &Data, present: &Fitted) -> Vec<FittedEffect> {
    let values = if effect.is_looked_for() {
        placed(effect, data, present)
    } else if effect.changes(Geometry::Runout) && data.runouts.is_narrow() {
        vec![data.runouts.middle().to_vec()]
    } else {
        start_values(effect)
    };
    let read_off = |k: usize, value: f64| {
        let parameter = &effect.parameters[k];
        if parameter.is_read_off() { full_load(data, parameter.place) } else { value }
    };
    let values = values.into_iter().map(|own| own.into_iter().enumerate().map(|(k, v)| read_off(k, v)).collect());
    let values: Vec<Vec<f64>> = values.collect();
    let all = values.iter().flat_map(|values| forms(effect, values));
    all.filter(|each| can_tell(effect, each.free_count(), data)).collect()
}

/// The start values with the instant or region found by the score test. Optional parameters of a region stay neutral in
/// the search: with a free shape it would fit too much as a rival of other effects.
fn placed(effect: &Effect, data: &Data, present: &Fitted) -> Vec<Vec<f64>> {
    let is_instant = effect.parameters.iter().any(|p| p.place == Some(Place::Instant));
    let found = if is_instant { instant(data, present).map(|t| [t; 4]) } else { region(data, present) };
    let Some(found) = found else { return Vec::new() };
    let with_place = |values: Vec<f64>| -> Vec<f64> {
        let value = |(p, start): (&Parameter, f64)| match p.place {
            Some(Place::Instant | Place::XMin) => found[0],
            Some(Place::XMax) => found[1],
            Some(Place::YMin) => found[2],
            Some(Place::YMax) => found[3],
            Some(Place::Knot | Place::LargestPower | Place::LargestTorque) | None => {
                p.neutral.filter(|_| !is_instant).unwrap_or(start)
            }
        };
        effect.parameters.iter().zip(values).map(value).collect()
    };
    let mut all: Vec<Vec<f64>> = start_values(effect).into_iter().map(with_place).collect();
    all.dedup();
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{State, named};
    use crate::learn::dataset::samples::{Base, UNBOUNDED, VariantColumns};
    use crate::path::Vec3;

    /// A log with a tare and a cutting coefficient; x runs over `mm`, chip thickness from 0.05 mm to `factor` times
    /// that.
    fn data(n: usize, mm: f64, factor: f64) -> Data {
        let base =
            |name: &str, class| Base { name: name.into(), unit: String::new(), class, prior: None, bounds: UNBOUNDED };
        let part = |i: usize| i as f64 / (n - 1) as f64;
        let state = |i: usize| State {
            position: Vec3::new(mm * part(i), 0.0, 0.0),
            chip_thickness_mm: 0.05 * factor.powf(part(i)),
            ..State::default()
        };
        Data {
            base: vec![base("tare", Class::Tare), base("k_tc", Class::Cutting)],
            reading: vec![1.0; n],
            weight: vec![1.0; n],
            state: (0..n).map(state).collect(),
            run: vec![0; n],
            ..Data::default()
        }
    }

    #[test]
    fn every_need_lets_some_data_through_and_stops_others() {
        let ok = |need: Need, data: &Data| lacks(need, data).is_none();
        let plain = data(50, 2.0, 1.3);
        assert!(ok(Need::Range(Covariate::X, 1.9), &plain) && !ok(Need::Range(Covariate::X, 2.1), &plain));
        assert!(!ok(Need::Range(Covariate::Y, 0.1), &plain) && !ok(Need::Range(Covariate::Sliding, 0.0), &plain));
        let chips = |by| Need::Ratio(Covariate::ChipThickness, by);
        assert!(ok(chips(1.29), &plain) && !ok(chips(1.31), &plain));
        assert!(ok(Need::Known(Covariate::X), &plain) && !ok(Need::Known(Covariate::PathSpeed), &plain));
        assert!(ok(Need::Samples, &data(40, 1.0, 1.0)) && !ok(Need::Samples, &data(39, 1.0, 1.0)));
        let table = Data { run: (0..50).collect(), ..plain.clone() };
        assert!(ok(Need::Series, &plain) && !ok(Need::Series, &table));
        let force = Data { base: plain.base[1..].to_vec(), ..plain.clone() };
        assert!(ok(Need::Tare, &plain) && !ok(Need::Tare, &force));
        let edge = Data { base: vec![Base { class: Class::Edge, ..plain.base[1].clone() }], ..plain.clone() };
        assert!(ok(Need::NoEdgeCoefficients, &plain) && !ok(Need::NoEdgeCoefficients, &edge));
    }

    /// A power law needs two speeds, a least value at an optimum three; a fortieth more is the same speed, and without a cut there is none.
    #[test]
    fn a_form_has_fewer_parameters_than_its_covariate_has_values() {
        let speed = named("cutting-speed").unwrap();
        let most = |speeds: &[f64], load: f64| {
            let state = speeds.iter().map(|v| State { cutting_speed_mm_s: *v, rps: *v, ..State::default() });
            let mut columns = vec![vec![1.0; speeds.len()]; 2];
            columns[1][2] = load;
            let found = Data { columns, state: state.collect(), ..data(speeds.len(), 1.0, 1.0) };
            (1..4).filter(|parameters| can_tell(speed, *parameters, &found)).max().unwrap()
        };
        assert_eq!(most(&[1000.0, 1500.0, 1000.0, 1500.0], 1.0), 1);
        assert_eq!(most(&[1000.0, 1500.0, 1537.0], 1.0), 1);
        assert_eq!(most(&[1000.0, 1500.0, 1600.0], 1.0), 2);
        assert_eq!(most(&[1000.0, 1500.0, 1600.0], 0.0), 1);
    }

    /// Without a load in the data, as in readings between cuts, an effect on the tare has all the values that it had.
    #[test]
    fn an_effect_on_the_tare_is_told_without_a_cut() {
        let warm_up = named("tare-warm-up").unwrap();
        let state = (0..20).map(|i| State { time_s: 10.0 * f64::from(i), ..State::default() });
        let idle = Data { columns: vec![vec![1.0; 20], vec![0.0; 20]], state: state.collect(), ..data(20, 1.0, 1.0) };
        assert!(can_tell(warm_up, 2, &idle));
    }

    #[test]
    fn an_effect_on_geometry_is_sought_where_some_of_it_shows() {
        let proud = named("stock-proud").unwrap();
        let with = |variant: Variant, by: f64| Data {
            variants: vec![VariantColumns { variant, size: 1.0, columns: vec![vec![by]] }],
            ..data(50, 1.0, 1.0)
        };
        assert!(
            why_not(proud, &data(50, 1.0, 1.0)).is_some() && why_not(proud, &with(Variant::StockSide, 0.0)).is_some()
        );
        assert!(why_not(proud, &with(Variant::StockSide, 0.1)).is_none());
        assert!(why_not(proud, &with(Variant::Diameter, 0.1)).is_some());
    }
}
