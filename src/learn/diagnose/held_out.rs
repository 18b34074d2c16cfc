//! Errors of a trial on data that it was not fitted on. In: the diagnosis with its split, a trial. Out: held-out
//! residuals, and whether the error rises on kinds of cuts that were left out.

use crate::effects::{Covariate, Place, State};
use crate::learn::dataset::errors::errors;
use crate::learn::dataset::samples::Data;
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::evidence::is_place;
use crate::learn::diagnose::forms::FORM_ROUNDS;
use crate::learn::diagnose::trial::{Trial, best_trial, independent};
use crate::learn::diagnose::which_curve::only_grows;
use crate::learn::model::cross_validation::{Split, held_out_residuals, improvement_by_block, t_statistic, without};
use crate::learn::model::design::{FittedEffect, carried_over};
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::report::Errors;
use rayon::prelude::*;

/// Time constant of an effect that is a lag, s; 0 for others.
fn lag_s(each: &FittedEffect) -> f64 {
    (each.effect.change)(&each.values, &State::default()).lag_s
}

/// The fit of a fold with the instant of a trial on all samples, where the fold cannot tell the two apart: a jump in what is held out shows in the
/// others only as lying between two of theirs. Its own instant is kept where that gains more than a parameter is charged, ln(n/φ).
fn with_instant_of_all(rest: &Data, trial: &Trial, own: Fitted) -> Fitted {
    let instant = trial.effect.parameters.iter().position(|parameter| parameter.place == Some(Place::Instant));
    let of_all = trial.fitted.model.effects.last();
    let (Some(k), Some(of_all)) = (instant, of_all) else { return own };
    let mut effects = own.model.effects.clone();
    if let Some(last) = effects.last_mut() {
        last.values[k] = of_all.values[k];
    }
    let n = independent(rest, &own);
    let is_as_good = |shared: &Fitted| n * (shared.squares / own.squares.max(1e-300)).ln() <= n.max(1.0).ln();
    fit(rest, &effects, FORM_ROUNDS).filter(is_as_good).unwrap_or(own)
}

impl Diagnosis<'_> {
    /// Errors of a model with these effects on the data kept for the judgement; see [`Self::judgement_residuals`].
    pub(in crate::learn) fn judgement_errors(&self, effects: &[FittedEffect]) -> Errors {
        let residual = self.judgement_residuals(effects);
        errors(self.data, |i| residual[i])
    }

    /// Residuals on the data kept for the judgement, NaN for the others. Without such data, or if they are of another
    /// kind than those fitted: residuals over the folds.
    pub(in crate::learn) fn judgement_residuals(&self, effects: &[FittedEffect]) -> Vec<f64> {
        if !self.split.test.iter().any(|t| *t) || !self.same_kinds() {
            return held_out_residuals(&self.train, effects, self.split);
        }
        let predicted = fit(&self.train, effects, 12).map(|f| f.predicted).unwrap_or_default();
        let of = |i: usize| if self.split.test[i] { self.data.reading[i] - predicted[i] } else { f64::NAN };
        (0..predicted.len()).map(of).collect()
    }

    /// Are the data kept for the judgement of kinds that were fitted?
    pub(in crate::learn) fn same_kinds(&self) -> bool {
        let trained: Vec<usize> = self.train.used().map(|i| self.data.kind[i]).collect();
        (0..self.data.len()).filter(|i| self.split.test[*i]).all(|i| trained.contains(&self.data.kind[i]))
    }

    /// Held-out residuals of a trial; an instant or region that was searched for is searched again without each fold.
    pub(in crate::learn) fn held_out_of_trial(&mut self, present: &Fitted, trial: &Trial) -> Vec<f64> {
        if let Some(lag_s) = trial.fitted.model.effects.last().map(lag_s).filter(|lag_s| *lag_s > 0.0) {
            return self.held_out_of_lag(present, trial, lag_s);
        }
        if !trial.effect.is_looked_for() {
            return held_out_residuals(&self.train, &trial.fitted.model.effects, self.split);
        }
        if let Some(known) = self.cache.left(present, trial.effect) {
            return known.to_vec();
        }
        let residuals = self.held_out_searched_anew(present, trial, self.split);
        self.cache.keep_left(present, trial.effect, &residuals);
        residuals
    }

    /// The same for an effect whose instant or region is searched for.
    fn held_out_searched_anew(&self, present: &Fitted, trial: &Trial, split: &Split) -> Vec<f64> {
        let folds: Vec<Vec<(usize, f64)>> = (0..split.folds)
            .into_par_iter()
            .map(|fold| {
                let rest = self.train.with_weights(without(&self.train, |i| split.fold[i] == fold));
                let Some(own) = fit(&rest, &present.model.effects, 8) else { return Vec::new() };
                // If the other folds do not show the effect, the prediction is that of the model without it.
                let found = best_trial(&rest, &own, &own.model.effects, trial.effect).1;
                let found = found.filter(|trial| trial.score >= self.threshold());
                let fitted = found.map_or(own, |found| with_instant_of_all(&rest, trial, found.fitted));
                let held = self.train.used().filter(|i| split.fold[*i] == fold);
                held.map(|i| (i, self.train.reading[i] - fitted.predicted[i])).collect()
            })
            .collect();
        let mut residuals = vec![f64::NAN; self.train.len()];
        folds.into_iter().flatten().for_each(|(i, r)| residuals[i] = r);
        residuals
    }

    /// The same for a lag, from predicted loads alone. Where a load is uncertain, the filter of the lag starts from the
    /// reading before, and would then also explain errors that persist without any lag. So the variance of the loads is
    /// set to 0 here, and what the filter carries over from readings at unknown loads is added back to the residual.
    fn held_out_of_lag(&self, present: &Fitted, trial: &Trial, lag_s: f64) -> Vec<f64> {
        let mut sure = self.train.clone();
        sure.load_variance.iter_mut().filter(|variance| variance.is_finite()).for_each(|variance| *variance = 0.0);
        let mut left = held_out_residuals(&sure, &trial.fitted.model.effects, self.split);
        if let Some(carried_over) = carried_over(&sure, lag_s, &present.residuals(&sure)) {
            left.iter_mut().zip(carried_over).for_each(|(left, carried_over)| *left += carried_over);
        }
        left
    }

    /// Relative fall of the root of Σ w r² from `before` to `after`, over samples where both are finite.
    pub(in crate::learn) fn drop_of(&self, before: &[f64], after: &[f64]) -> f64 {
        let (mut b, mut a) = (0.0, 0.0);
        for i in self.train.used().filter(|i| before[*i].is_finite() && after[*i].is_finite()) {
            b += self.train.weight[i] * before[i].powi(2);
            a += self.train.weight[i] * after[i].powi(2);
        }
        1.0 - (a / f64::max(b, 1e-300)).sqrt()
    }

    /// Why a trial harms cuts that it was not fitted on. In a log each operation is left out in turn and the error over
    /// all counts; in a table each kind is left out and judged by itself.
    pub(in crate::learn) fn harms_another_kind(&self, present: &Fitted, trial: &Trial) -> Option<String> {
        if self.data.is_series() { self.harms_operations(present, trial) } else { self.harms_a_kind(present, trial) }
    }

    /// Relative fall of the error from one model to another, each operation left out in turn; `None` if there is only
    /// one.
    pub(in crate::learn) fn drop_elsewhere(&self, from: &[FittedEffect], to: &[FittedEffect]) -> Option<f64> {
        let by_operation = self.by_operation()?;
        let [before, after] = [from, to].map(|effects| held_out_residuals(&self.train, effects, &by_operation));
        Some(self.drop_of(&before, &after))
    }

    /// A split with every operation as a fold; `None` if there is only one.
    fn by_operation(&self) -> Option<Split> {
        Some(Split { fold: self.data.kind.clone(), folds: self.kinds().last()? + 1, ..self.split.clone() })
    }

    fn harms_operations(&self, present: &Fitted, trial: &Trial) -> Option<String> {
        // A lag belongs to the meter and is the same in every operation, so the blocks of time that were held out judge it. Operations left out
        // refused a true one on five logs of ten, and curves over the distance since entry took its place.
        if trial.effect.covariates.contains(&Covariate::LoadChange) {
            return None;
        }
        let by_operation = self.by_operation()?;
        let left = |effects: &[FittedEffect]| held_out_residuals(&self.train, effects, &by_operation);
        let before = left(&present.model.effects);
        // Fitted without the operation it lies in, a region would have no data and diverge: it is searched again.
        let after = if trial.effect.is_looked_for() {
            self.held_out_searched_anew(present, trial, &by_operation)
        } else {
            left(&trial.fitted.model.effects)
        };
        let drop = self.drop_of(&before, &after);
        if self.varies_between_operations_only(trial.effect.covariates) && !self.criteria().lowers_elsewhere(drop) {
            return Some(format!(
                "its covariate is constant within each operation, and operations that it was not fitted on are not \
                 predicted better ({:+.1} % error over all of them): any other difference between operations may be \
                 the cause",
                -100.0 * drop
            ));
        }
        self.is_made_worse(trial.effect.covariates, &before, &after).then(|| {
            format!("fitted without an operation, it makes that worse ({:+.1} % error over all of them)", -100.0 * drop)
        })
    }

    /// Is an effect on these covariates refused, because operations are predicted worse with it? `before`, `after`: residuals without and with the
    /// effect, each operation predicted from the others. An effect of the process holds everywhere, so the error over all operations decides. A
    /// region may lie in one operation, and an edge may wear in its last one: the others cannot tell how far or how fast. For effects of a place, of
    /// time or of wear one operation that is predicted worse is therefore a single case, and only several refuse them.
    fn is_made_worse(&self, covariates: &[Covariate], before: &[f64], after: &[f64]) -> bool {
        let drop = self.drop_of(before, after);
        if covariates.iter().any(|covariate| is_place(*covariate) || only_grows(*covariate)) {
            self.criteria().harms(1.0 - drop, t_statistic(&self.improvement_by_operation(before, after)))
        } else {
            self.criteria().harms_elsewhere(drop)
        }
    }

    /// Fall of the squares of each operation.
    fn improvement_by_operation(&self, before: &[f64], after: &[f64]) -> Vec<f64> {
        let of = |kind: usize| {
            let members = self.train.used().filter(|i| self.data.kind[*i] == kind);
            let known = members.filter(|i| before[*i].is_finite() && after[*i].is_finite());
            known.map(|i| self.train.weight[i] * (before[i].powi(2) - after[i].powi(2))).sum()
        };
        self.kinds().into_iter().map(of).collect()
    }

    /// Are these covariates constant within every operation? Then only predictions of other operations can show an
    /// effect.
    pub(in crate::learn) fn varies_between_operations_only(&self, covariates: &[Covariate]) -> bool {
        self.is_steady_in_each(covariates, &self.data.kind, &self.kinds())
    }

    /// Do these covariates vary, but not within any of these groups of samples? `of`: group of each sample.
    pub(in crate::learn) fn is_steady_in_each(&self, covariates: &[Covariate], of: &[usize], groups: &[usize]) -> bool {
        let range = |covariate: Covariate, group: Option<usize>| {
            let members = self.train.used().filter(|i| group.is_none_or(|group| of[*i] == group));
            let values = members.map(|i| covariate.of(&self.data.state[i])).filter(|value| value.is_finite());
            let (least, most) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
            (most - least).max(0.0)
        };
        let is_steady = |covariate: &Covariate| {
            let all = range(*covariate, None);
            all > 0.0
                && groups.iter().all(|group| self.criteria().is_steady_within(range(*covariate, Some(*group)), all))
        };
        !covariates.is_empty() && covariates.iter().all(is_steady)
    }

    fn harms_a_kind(&self, present: &Fitted, trial: &Trial) -> Option<String> {
        for kind in self.kinds() {
            let members: Vec<usize> = self.data.used().filter(|i| self.data.kind[*i] == kind).collect();
            let others = self.train.with_weights(without(&self.train, |i| self.data.kind[i] == kind));
            let rest = others.used().count();
            if members.len() * 20 < self.data.len() || rest * 5 < self.data.len() {
                continue;
            }
            let (Some(plain), Some(with)) =
                (fit(&others, &present.model.effects, 8), fit(&others, &trial.fitted.model.effects, 8))
            else {
                continue;
            };
            let squares = |f: &Fitted| -> Vec<f64> {
                members.iter().map(|&i| (self.data.reading[i] - f.predicted[i]).powi(2)).collect()
            };
            let (a, b) = (squares(&plain), squares(&with));
            let ratio = (b.iter().sum::<f64>() / a.iter().sum::<f64>().max(1e-300)).sqrt();
            let worse = improvement_by_block(
                self.data,
                &residual_on(&members, &plain, self.data),
                &residual_on(&members, &with, self.data),
            );
            if self.criteria().harms(ratio, t_statistic(&worse)) {
                return Some(format!(
                    "fitted without {}, it makes that worse ({:+.1} % error)",
                    self.data.kind_names[kind],
                    100.0 * (ratio - 1.0)
                ));
            }
        }
        None
    }
}

fn residual_on(members: &[usize], fitted: &Fitted, data: &Data) -> Vec<f64> {
    let mut residual = vec![f64::NAN; data.len()];
    for &i in members {
        residual[i] = data.reading[i] - fitted.predicted[i];
    }
    residual
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::named;
    use crate::learn::diagnose::diagnosis::Options;
    use crate::learn::diagnose::made_data::{EACH, begun, fifths, made};

    /// Relative drop of the held-out error by a lag of 4 s, if readings lag by `late_s` behind a load that doubles half
    /// way through every block, with an error of ±`off` that alternates from block to block, and with one uncertain
    /// load in four.
    fn taken(late_s: f64, off: f64) -> f64 {
        let of_block = |i: usize| if (i / EACH).is_multiple_of(2) { off } else { -off };
        let mut data = made(of_block, 1.0, |_| State::default());
        let load = |i: usize| if i % EACH < EACH / 2 { 100.0 } else { 200.0 };
        data.columns[0] = (0..data.len()).map(load).collect();
        let mut level = 100.0;
        for i in 0..data.len() {
            let noise = ((i * 7919) % 101) as f64 / 50.0 - 1.0;
            let now = load(i) * (1.0 + of_block(i));
            level = if late_s > 0.0 { now + (level - now) * (-1.0 / late_s).exp() } else { now };
            data.reading[i] = level + noise;
        }
        data.load_variance = (0..data.len()).map(|i| if i % 4 == 0 { 1e4 } else { 0.0 }).collect();
        let (split, options) = (fifths(&data), Options::default());
        let mut diagnosis = begun(&data, &split, &options, 1.0);
        let lag = named("sensor-lag").unwrap();
        let present = fit(&data, &[], 0).unwrap();
        let each = FittedEffect { effect: lag, values: vec![4.0], free: vec![false] };
        let trial = Trial { effect: lag, fitted: fit(&data, &[each], 5).unwrap(), gain: 1.0, score: 1.0 };
        let after = diagnosis.held_out_of_trial(&present, &trial);
        diagnosis.drop_of(&diagnosis.base_residual, &after)
    }

    /// The instant that a fold without every fifth block keeps, when all samples show this one and its own this one, s. The load jumps by a
    /// fifth in the middle of the block at 480 s; readings have a noise of up to ±`noise`.
    fn kept_instant(of_all_s: f64, own_s: f64, fold: usize, noise: f64) -> f64 {
        let jump_s = 500.0;
        let state = |i: usize| State { time_s: i as f64, ..State::default() };
        let data = made(|i| if i as f64 >= jump_s { 0.2 } else { 0.0 }, noise, state);
        let effect = named("edge-chipping").unwrap();
        let at = |time_s: f64| FittedEffect { effect, values: vec![0.1, 0.0, time_s], free: vec![true, false, false] };
        let trial = Trial { effect, fitted: fit(&data, &[at(of_all_s)], 5).unwrap(), gain: 1.0, score: 1.0 };
        let split = fifths(&data);
        let rest = data.with_weights(without(&data, |i| split.fold[i] == fold));
        let own = fit(&rest, &[at(own_s)], 5).unwrap();
        with_instant_of_all(&rest, &trial, own).model.effects[0].values[2]
    }

    #[test]
    fn an_instant_that_a_fold_cannot_tell_is_that_of_all_samples() {
        // The block from 480 to 520 s is left out in the third fold, which knows no more than that the load jumped in it.
        assert_eq!(kept_instant(500.0, 479.5, 2, 1.0), 500.0);
        assert_eq!(kept_instant(470.5, 479.5, 2, 1.0), 479.5);
        assert_eq!(kept_instant(500.0, 499.5, 0, 1.0), 500.0);
        assert_eq!(kept_instant(501.5, 499.5, 0, 1.0), 499.5);
        // Where noise hides a jump that comes a few readings later, it does not matter either.
        assert_eq!(kept_instant(502.5, 499.5, 0, 60.0), 502.5);
        assert_eq!(kept_instant(560.5, 499.5, 0, 60.0), 499.5);
    }

    /// Do four operations refuse an effect on a covariate that changes their residuals by these shares?
    fn is_refused(covariate: Covariate, changes: [f64; 4]) -> bool {
        let mut data = made(|_| 0.0, 1.0, |_| State::default());
        data.kind = (0..data.len()).map(|i| (i / EACH) % 4).collect();
        let (split, options) = (fifths(&data), Options::default());
        let before = vec![1.0; data.len()];
        let after: Vec<f64> = data.kind.iter().map(|kind| 1.0 + changes[*kind]).collect();
        begun(&data, &split, &options, 1.0).is_made_worse(&[covariate], &before, &after)
    }

    #[test]
    fn an_operation_that_is_made_worse_refuses_an_effect_and_of_places_and_wear_several_do() {
        for covariate in [Covariate::SpindleSpeed, Covariate::X, Covariate::Volume] {
            assert!(!is_refused(covariate, [-0.1, -0.2, -0.1, 0.0]), "{covariate:?}");
            assert!(is_refused(covariate, [0.3, 0.2, 0.25, -0.1]), "{covariate:?}");
        }
        let one = [-0.1, 0.0, -0.1, 0.8];
        assert!(is_refused(Covariate::SpindleSpeed, one));
        assert!(!is_refused(Covariate::X, one) && !is_refused(Covariate::Volume, one));
    }

    /// Do two operations at two speeds refuse an effect with these values, which the readings do not have?
    fn refuse(name: &str, values: &[f64]) -> bool {
        let speed = |i: usize| if (i / EACH).is_multiple_of(2) { 1000.0 } else { 4000.0 };
        let mut data = made(|_| 0.0, 1.0, |i| State { cutting_speed_mm_s: speed(i), ..State::default() });
        data.kind = (0..data.len()).map(|i| (i / EACH) % 2).collect();
        let load = |i: usize| if i % EACH < EACH / 2 { 100.0 } else { 200.0 };
        data.columns[0] = (0..data.len()).map(load).collect();
        data.reading.clone_from(&data.columns[0]);
        let (split, options) = (fifths(&data), Options::default());
        let effect = named(name).unwrap();
        let present = fit(&data, &[], 0).unwrap();
        let each = FittedEffect { effect, values: values.to_vec(), free: vec![false; values.len()] };
        let trial = Trial { effect, fitted: fit(&data, &[each], 5).unwrap(), gain: 1.0, score: 1.0 };
        begun(&data, &split, &options, 1.0).harms_operations(&present, &trial).is_some()
    }

    #[test]
    fn operations_refuse_an_effect_of_the_cut_that_they_do_not_have_and_leave_a_lag_to_the_blocks_of_time() {
        assert!(refuse("cutting-speed", &[0.8, 0.0, 1.0]));
        assert!(!refuse("sensor-lag", &[4.0]));
    }

    #[test]
    fn a_lag_takes_what_comes_late_and_not_what_only_lasts() {
        assert!(taken(4.0, 0.0) > 0.5, "{}", taken(4.0, 0.0));
        assert!(taken(0.0, 0.2) < 0.0, "{}", taken(0.0, 0.2));
    }
}
