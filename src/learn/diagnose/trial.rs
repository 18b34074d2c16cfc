//! One candidate on top of a model. In: data, the model so far, an effect. Out: its best fit with gain and score.

use crate::effects::{Effect, Parameter, Place};
use crate::learn::dataset::samples::{Class, Data};
use crate::learn::diagnose::candidates::starts;
use crate::learn::diagnose::criteria::knows_scatter;
use crate::learn::diagnose::residual::inflation;
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{Fitted, fit};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// A candidate on top of a model.
#[derive(Clone)]
pub struct Trial {
    /// Effect.
    pub effect: &'static Effect,
    /// The model with it as the last effect.
    pub fitted: Fitted,
    /// Twice the log-likelihood ratio, n/φ · ln(RSS₀/RSS₁), with φ the inflation.
    pub gain: f64,
    /// The gain less the charge for its parameters, k ln(n/φ).
    pub score: f64,
}

/// Best fit of a candidate over its forms and start values, and the number of these.
pub fn best_trial(
    data: &Data,
    present: &Fitted,
    effects: &[FittedEffect],
    effect: &'static Effect,
) -> (usize, Option<Trial>) {
    let begin = starts(effect, data, present);
    // Starts and instants are compared with the other effects held at their values, which saves most of the time.
    let held: Vec<FittedEffect> = effects.iter().map(FittedEffect::held).collect();
    let with = |others: &[FittedEffect], each: &FittedEffect| [others, std::slice::from_ref(each)].concat();
    let trial = |others: &[FittedEffect], each: &FittedEffect, iterations: usize| {
        let fitted = fit(data, &with(others, each), iterations)?;
        let (score, gain) = score_of(data, present, &fitted, each.free_count());
        Some(Trial { effect, fitted, gain, score: score - charge_of_choice(each) })
    };
    let tried: Vec<Trial> = begin.par_iter().filter_map(|each| trial(&held, each, 5)).collect();
    let best = best_start(data, present, tried);
    let polished = best.and_then(|best| {
        let found = best.fitted.model.effects.last()?;
        let beside = trial(effects, found, 5)?;
        // A negative score after five iterations is not worth fitting to convergence.
        if beside.score < 0.0 {
            return Some(beside);
        }
        let refined = refined_instant(data, found, |each| Some(fit(data, &with(&held, each), 3)?.squares));
        trial(effects, refined.as_ref().or(beside.fitted.model.effects.last())?, 25)
    });
    (begin.len(), polished)
}

/// The best of several starts and forms of one effect, by scores with the inflation φ that the closest fit leaves. One that leaves structure has
/// a φ of its own for that, and with it a higher score than a closer one of the same structure. The φ of a table tells of its set-ups, which forms
/// differ in: there each counts with its own.
fn best_start(data: &Data, present: &Fitted, tried: Vec<Trial>) -> Option<Trial> {
    if !data.is_series() {
        return tried.into_iter().max_by(|a, b| a.score.total_cmp(&b.score));
    }
    let closest = tried.iter().min_by(|a, b| a.fitted.squares.total_cmp(&b.fitted.squares))?;
    let n = independent(data, &closest.fitted);
    let score = |trial: &Trial| {
        let each = trial.fitted.model.effects.last();
        let free = each.map_or(0, FittedEffect::free_count);
        score_with(n, present, &trial.fitted, free).0 - each.map_or(0.0, charge_of_choice)
    };
    tried.into_iter().max_by(|a, b| score(a).total_cmp(&score(b)))
}

/// Charge for a form other than the law: the best of F forms gains up to 2 ln F more by chance (Bonferroni).
fn charge_of_choice(each: &FittedEffect) -> f64 {
    let forms = each.effect.forms;
    let free: Vec<usize> = (0..each.free.len()).filter(|k| each.free[*k]).collect();
    if forms.first().is_none_or(|law| *law == free) { 0.0 } else { 2.0 * (forms.len() as f64).ln() }
}

/// The instant of an effect moved along the samples while the `squares` fall: the score test used the model without the
/// effect, whose coefficients have absorbed a part of it. The instant lies half way between two samples. `None` for
/// effects without one.
fn refined_instant(
    data: &Data,
    found: &FittedEffect,
    squares: impl Fn(&FittedEffect) -> Option<f64> + Sync,
) -> Option<FittedEffect> {
    let scanned = found.effect.parameters.iter().position(Parameter::is_scanned)?;
    let mut instants: Vec<f64> = data.used().map(|i| data.state[i].time_s).filter(|t| t.is_finite()).collect();
    instants.sort_by(f64::total_cmp);
    instants.dedup();
    let at = |k: usize| {
        let mut each = found.clone();
        each.values[scanned] = f64::midpoint(instants[k.saturating_sub(1)], instants[k]);
        each
    };
    let mut k = instants.partition_point(|t| *t < found.values[scanned]).min(instants.len().checked_sub(1)?);
    let mut least = squares(&at(k))?;
    let mut step = instants.len() / 16;
    while step > 0 {
        let beside = [k.checked_sub(step), (k + step < instants.len()).then_some(k + step)];
        let of = |other: usize| Some((squares(&at(other))?, other));
        let tried: Vec<(f64, usize)> = beside.into_par_iter().flatten().filter_map(of).collect();
        match tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(value, _)| *value < least) {
            Some(better) => (least, k) = better,
            None => step /= 2,
        }
    }
    Some(at(k))
}

/// (score, gain) of model `after` over `before` with `k` more parameters.
pub fn score_of(data: &Data, before: &Fitted, after: &Fitted, k: usize) -> (f64, f64) {
    if data.is_series() {
        return score_with(independent(data, after), before, after, k);
    }
    let n = independent(data, after);
    let (_, gain) = score_with(n, before, after, k);
    let gain = gain * share_of_few(data.used().count(), after.model.parameter_count(), k);
    (gain - k as f64 * n.max(2.0).ln(), gain)
}

/// Twice the log-likelihood ratio counts every case of n, those too that the parameters of the model before have taken up: n − (p − k) are left
/// of them. It counts nothing where the model with the k new ones leaves too few to know the scatter by ([`knows_scatter`]).
fn share_of_few(cases: usize, parameters: usize, k: usize) -> f64 {
    if knows_scatter(cases, parameters) { (cases + k - parameters) as f64 / cases as f64 } else { 0.0 }
}

/// Number of samples that count as independent beside a model, n/φ.
pub fn independent(data: &Data, fitted: &Fitted) -> f64 {
    data.used().count() as f64 / inflation(data, &fitted.residuals(data))
}

/// The same with `n` independent samples.
fn score_with(n: f64, before: &Fitted, after: &Fitted, k: usize) -> (f64, f64) {
    let gain = n * (before.squares.max(1e-300) / after.squares.max(1e-300)).ln();
    (gain - k as f64 * n.max(2.0).ln(), gain)
}

/// Probability of such a gain without the effect: χ² distribution of as many degrees of freedom as free parameters
/// (Wilks 1938).
pub fn p_value(trial: &Trial) -> f64 {
    let freedom = trial.fitted.model.effects.last().map_or(1, FittedEffect::free_count).max(1) as f64;
    ChiSquared::new(freedom).map_or(1.0, |chi| chi.sf(trial.gain.max(0.0)))
}

/// Why the parameters of an effect are not physical.
pub fn unphysical(each: Option<&FittedEffect>, data: &Data) -> Option<String> {
    let each = each?;
    if !each.effect.is_physical(&each.values) {
        return Some("its parameters leave their physical bounds".into());
    }
    if let Some(why) = (each.effect.refused)(&each.values, data.clock_s) {
        return Some(why);
    }
    if is_without_border(each, data) {
        return Some("none of its borders lies in the cuts".into());
    }
    let strength = (0..each.values.len()).find(|k| each.free[*k] && !each.effect.parameters[*k].is_scanned())?;
    let (value, parameter) = (each.values[strength], &each.effect.parameters[strength]);
    let at = |bound: f64| (value - bound).abs() < 1e-6 * (parameter.max - parameter.min);
    (at(parameter.max) || (at(parameter.min) && parameter.min != 0.0))
        .then(|| format!("{} runs into its physical bound ({value:.3})", parameter.name))
}

/// Is it a region that no cut enters or leaves? With all its borders beyond the cuts it is a slope over the whole part, which any
/// change in the course of the program resembles.
fn is_without_border(each: &FittedEffect, data: &Data) -> bool {
    let border = |place| {
        let k = each.effect.parameters.iter().position(|parameter| parameter.place == Some(place))?;
        Some(each.values[k])
    };
    let (Some(x_min), Some(x_max), Some(y_min), Some(y_max)) =
        (border(Place::XMin), border(Place::XMax), border(Place::YMin), border(Place::YMax))
    else {
        return false;
    };
    let loads: Vec<usize> = (0..data.base.len()).filter(|&k| data.base[k].class != Class::Tare).collect();
    let cuts = || data.used().filter(|&i| loads.iter().any(|&k| data.columns[k][i] != 0.0));
    let is_within = |axis: usize, border: f64| {
        let places = || cuts().map(|i| data.state[i].position[axis]);
        places().any(|at| at < border) && places().any(|at| at > border)
    };
    !([x_min, x_max].iter().any(|border| is_within(0, *border))
        || [y_min, y_max].iter().any(|border| is_within(1, *border)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{State, named};
    use crate::learn::dataset::samples::Base;
    use crate::learn::diagnose::made_data::made;
    use crate::path::Vec3;

    /// Nine cuts and a model of four parameters leave five to know the scatter by, eight do not.
    #[test]
    fn few_cases_count_for_less_or_nothing() {
        assert_eq!([8, 9].map(|cases| share_of_few(cases, 4, 1)), [0.0, 6.0 / 9.0]);
        assert!(share_of_few(10_000, 4, 1) > 0.999);
    }

    /// Cuts along x from 0 to 100 mm at y = 5 mm.
    fn cuts_along_x() -> Data {
        let bounds = crate::learn::dataset::samples::UNBOUNDED;
        let base = |name: &str, class| Base { name: name.into(), unit: String::new(), class, prior: None, bounds };
        let at = |i: usize| State { position: Vec3::new(i as f64, 5.0, 0.0), ..State::default() };
        Data {
            base: vec![base("tare", Class::Tare), base("k_tc", Class::Cutting)],
            columns: vec![vec![1.0; 101]; 2],
            reading: vec![1.0; 101],
            weight: vec![1.0; 101],
            state: (0..101).map(at).collect(),
            run: vec![0; 101],
            ..Data::default()
        }
    }

    #[test]
    fn a_region_needs_a_border_in_the_cuts() {
        let data = cuts_along_x();
        let refused = |name: &str, place: [f64; 4]| {
            let effect = named(name).unwrap();
            let start = |p: &Parameter| match p.place {
                Some(Place::XMin) => place[0],
                Some(Place::XMax) => place[1],
                Some(Place::YMin) => place[2],
                Some(Place::YMax) => place[3],
                _ => p.starts[0],
            };
            let values: Vec<f64> = effect.parameters.iter().map(start).collect();
            let free = vec![true; values.len()];
            unphysical(Some(&FittedEffect { effect, values, free }), &data).is_some()
        };
        assert!(!refused("hard-zone", [99.0, 500.0, -100.0, 100.0]));
        assert!(refused("hard-zone", [101.0, 500.0, -100.0, 100.0]));
        assert!(refused("hard-zone", [-7979.0, 92086.0, -143.0, 2204.0]));
        assert!(!refused("size-effect", [0.0; 4]));
    }

    #[test]
    fn the_closest_of_the_starts_wins_though_what_it_leaves_changes_slowly() {
        // Half way the load rises, that of the edges by more; every other reading is of edges alone. A slow wave is left when both are known.
        let at = |i: usize| State { time_s: i as f64, ..State::default() };
        let mut data = made(|_| 0.0, 0.5, at);
        let half = data.len() / 2;
        let is_edge = |i: usize| (i * 7) % 11 < 5;
        let edge = Base { name: "k_te".into(), class: Class::Edge, ..data.base[0].clone() };
        data.base.push(edge);
        data.columns =
            vec![vec![100.0; data.len()], (0..data.len()).map(|i| f64::from(u8::from(is_edge(i)))).collect()];
        data.columns[1].iter_mut().for_each(|each| *each *= 100.0);
        for i in 0..data.len() {
            let [cutting, of_edge] = if i < half { [1.0, 1.0] } else { [1.2, 1.5] };
            data.reading[i] =
                cutting * data.columns[0][i] + of_edge * data.columns[1][i] + 4.0 * (i as f64 / 25.0).sin();
        }
        let effect = named("edge-chipping").unwrap();
        let present = fit(&data, &[], 0).unwrap();
        let trial = |free: [bool; 3], jumps: [f64; 2]| {
            let each =
                FittedEffect { effect, values: vec![jumps[0], jumps[1], half as f64 - 0.5], free: free.to_vec() };
            let fitted = fit(&data, &[each], 10).unwrap();
            let free = free.iter().filter(|free| **free).count();
            let (score, gain) = score_of(&data, &present, &fitted, free);
            Trial { effect, fitted, gain, score }
        };
        let tried = [trial([true, false, false], [0.1, 0.0]), trial([true, true, false], [0.1, 0.1])];
        assert!(tried[0].score > tried[1].score && tried[0].fitted.squares > 5.0 * tried[1].fitted.squares);
        let best = best_start(&data, &present, tried.to_vec()).unwrap();
        assert_eq!(best.fitted.model.effects[0].free_count(), 2);
    }

    #[test]
    fn the_law_is_free_and_another_form_is_charged_for_the_choice() {
        let thin = |free: [bool; 3]| {
            let effect = named("size-effect").unwrap();
            charge_of_choice(&FittedEffect { effect, values: vec![0.0, 0.1, 0.03], free: free.to_vec() })
        };
        assert_eq!(thin([true, false, false]), 0.0);
        assert!((thin([false, true, true]) - 2.0 * 2.0_f64.ln()).abs() < 1e-12);
    }
}
