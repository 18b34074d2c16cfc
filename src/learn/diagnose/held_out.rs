//! What a trial does to data that it was not fitted on. In: the diagnosis with its split, a trial. Out: residuals of
//! blocks left out, and whether kinds of cuts left out get worse.

use crate::effects::{Covariate, State};
use crate::learn::dataset::errors::errors;
use crate::learn::dataset::samples::Data;
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::trial::{Trial, best_trial};
use crate::learn::model::cross_validation::{Split, held_out_residuals, improvement_by_block, t_statistic, without};
use crate::learn::model::design::{FittedEffect, remembered};
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::report::Errors;
use rayon::prelude::*;

/// Time constant of an effect that is a lag, s.
fn lag_s(each: &FittedEffect) -> f64 {
    (each.effect.change)(&each.values, &State::default()).lag_s
}

impl Diagnosis<'_> {
    /// Errors on data that a model with these effects was not fitted on.
    pub(in crate::learn) fn judged(&self, effects: &[FittedEffect]) -> Errors {
        let residual = self.unseen(effects);
        errors(self.data, |i| residual[i])
    }

    /// Residuals of such data, NaN for the others.
    pub(in crate::learn) fn unseen(&self, effects: &[FittedEffect]) -> Vec<f64> {
        if !self.split.test.iter().any(|t| *t) || !self.same_kinds() {
            return held_out_residuals(&self.train, effects, self.split);
        }
        let predicted = fit(&self.train, effects, 12).map(|f| f.predicted).unwrap_or_default();
        let of = |i: usize| if self.split.test[i] { self.data.reading[i] - predicted[i] } else { f64::NAN };
        (0..predicted.len()).map(of).collect()
    }

    /// Do the samples kept for the judgement belong to the kinds that were fitted?
    pub(in crate::learn) fn same_kinds(&self) -> bool {
        let trained: Vec<usize> = self.train.used().map(|i| self.data.kind[i]).collect();
        (0..self.data.len()).filter(|i| self.split.test[*i]).all(|i| trained.contains(&self.data.kind[i]))
    }

    /// Held-out residuals with a trial; what was found by scanning is found again without each fold.
    pub(in crate::learn) fn unseen_residuals(&mut self, present: &Fitted, trial: &Trial) -> Vec<f64> {
        if let Some(lag_s) = trial.fitted.model.effects.last().map(lag_s).filter(|lag_s| *lag_s > 0.0) {
            return self.unseen_of_lag(present, trial, lag_s);
        }
        if !trial.effect.is_looked_for() {
            return held_out_residuals(&self.train, &trial.fitted.model.effects, self.split);
        }
        if let Some(known) = self.memory.left(present, trial.effect) {
            return known.to_vec();
        }
        let residuals = self.found_anew(present, trial, self.split);
        self.memory.keep_left(present, trial.effect, &residuals);
        residuals
    }

    /// Held-out residuals over the folds of a split, where the instant or place of the effect is searched anew without each fold.
    fn found_anew(&self, present: &Fitted, trial: &Trial, split: &Split) -> Vec<f64> {
        let folds: Vec<Vec<(usize, f64)>> = (0..split.folds)
            .into_par_iter()
            .map(|fold| {
                let rest = self.train.with_weights(without(&self.train, |i| split.fold[i] == fold));
                let Some(own) = fit(&rest, &present.model.effects, 8) else { return Vec::new() };
                // Where the rest shows none, the model without it is what would have been predicted.
                let found = best_trial(&rest, &own, &own.model.effects, trial.effect).1;
                let found = found.filter(|trial| trial.score >= self.threshold());
                let fitted = found.map_or(own, |trial| trial.fitted);
                let held = self.train.used().filter(|i| split.fold[*i] == fold);
                held.map(|i| (i, self.train.reading[i] - fitted.predicted[i])).collect()
            })
            .collect();
        let mut residuals = vec![f64::NAN; self.train.len()];
        folds.into_iter().flatten().for_each(|(i, r)| residuals[i] = r);
        residuals
    }

    /// The same of a lag, by what known loads say of it alone. Where a load is in doubt the chain goes by the readings,
    /// and takes whatever lasts from one to the next, be it late or not: doubts of the alignment are left out of account
    /// here, and what is remembered of loads that nobody knows is given back.
    fn unseen_of_lag(&self, present: &Fitted, trial: &Trial, lag_s: f64) -> Vec<f64> {
        let mut sure = self.train.clone();
        sure.load_variance.iter_mut().filter(|variance| variance.is_finite()).for_each(|variance| *variance = 0.0);
        let mut left = held_out_residuals(&sure, &trial.fitted.model.effects, self.split);
        if let Some(remembered) = remembered(&sure, lag_s, &present.residuals(&sure)) {
            left.iter_mut().zip(remembered).for_each(|(left, remembered)| *left += remembered);
        }
        left
    }

    pub(in crate::learn) fn drop_of(&self, before: &[f64], after: &[f64]) -> f64 {
        let (mut b, mut a) = (0.0, 0.0);
        for i in self.train.used().filter(|i| before[*i].is_finite() && after[*i].is_finite()) {
            b += self.train.weight[i] * before[i].powi(2);
            a += self.train.weight[i] * after[i].powi(2);
        }
        1.0 - (a / f64::max(b, 1e-300)).sqrt()
    }

    /// An effect must not make cuts worse that it was not fitted on: in a log all its operations together, each of them
    /// left out in turn; in a table each kind by itself.
    pub(in crate::learn) fn harms_another_kind(&self, present: &Fitted, trial: &Trial) -> Option<String> {
        if self.data.is_series() { self.harms_operations(present, trial) } else { self.harms_a_kind(present, trial) }
    }

    /// By how much the error over operations falls from one model to another, each operation left out in turn; `None`
    /// where there is only one.
    pub(in crate::learn) fn drop_elsewhere(&self, from: &[FittedEffect], to: &[FittedEffect]) -> Option<f64> {
        let by_operation = self.by_operation()?;
        let [before, after] = [from, to].map(|effects| held_out_residuals(&self.train, effects, &by_operation));
        Some(self.drop_of(&before, &after))
    }

    /// Every operation a fold of its own; `None` where there is only one.
    fn by_operation(&self) -> Option<Split> {
        Some(Split { fold: self.data.kind.clone(), folds: self.kinds().last()? + 1, ..self.split.clone() })
    }

    fn harms_operations(&self, present: &Fitted, trial: &Trial) -> Option<String> {
        let drop = if trial.effect.is_looked_for() {
            // A place that no cut of the rest lies in would run away in the fit.
            let by_operation = self.by_operation()?;
            let before = held_out_residuals(&self.train, &present.model.effects, &by_operation);
            self.drop_of(&before, &self.found_anew(present, trial, &by_operation))
        } else {
            self.drop_elsewhere(&present.model.effects, &trial.fitted.model.effects)?
        };
        if self.is_of_operations(trial.effect.covariates) && !self.criteria().lowers_elsewhere(drop) {
            return Some(format!(
                "what it follows is the same all through an operation, and an operation that it was not fitted on it does \
                 not predict better ({:+.1} % error over all of them): it may be anything they differ by",
                -100.0 * drop
            ));
        }
        self.criteria().harms_elsewhere(drop).then(|| {
            format!("fitted without an operation, it makes that worse ({:+.1} % error over all of them)", -100.0 * drop)
        })
    }

    /// Does what an effect follows change from operation to operation alone? Within one only its prediction of another
    /// could then show it.
    pub(in crate::learn) fn is_of_operations(&self, covariates: &[Covariate]) -> bool {
        self.is_steady_in_each(covariates, &self.data.kind, &self.kinds())
    }

    /// Does what an effect follows vary, but in none of these groups of samples?
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

    /// Share of the error on data left out that a lag of 4 s takes away, where readings come `late_s` behind a load that
    /// doubles in every block and is off by turns, and one sample in four is in doubt.
    fn taken(late_s: f64, off: f64) -> f64 {
        let of_block = |i: usize| if (i / EACH).is_multiple_of(2) { off } else { -off };
        let mut data = made(of_block, 1.0, |_| State::default());
        // The load doubles half way through every block.
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
        let after = diagnosis.unseen_residuals(&present, &trial);
        diagnosis.drop_of(&diagnosis.base_residual, &after)
    }

    #[test]
    fn a_lag_takes_what_comes_late_and_not_what_only_lasts() {
        assert!(taken(4.0, 0.0) > 0.5, "{}", taken(4.0, 0.0));
        assert!(taken(0.0, 0.2) < 0.0, "{}", taken(0.0, 0.2));
    }
}
