//! From data to named effects. In: [`Data`] and a [`Split`]. Out: a [`LearnReport`].
//!
//! 1. The base model is fitted on the training blocks and judged on the others.
//! 2. Every candidate is fitted together with what is already in the model. Its gain is G = n/φ · ln(RSS₀/RSS₁), with φ the
//!    inflation of its own residual (neighbouring samples that are left with a common error count as one); its score is
//!    G − k ln(n/φ) for k parameters.
//! 3. The best is added if its score is above the threshold, its parameters are physical, it lowers the held-out error of
//!    the folds by more than one standard error over the blocks, and it does no harm on kinds of cuts it was not fitted on.
//! 4. Rivals within the margin of the best that have nothing to add to it are reported as confounded with it.
//!    When none is found alone, pairs are tried: one may hide the other from the fit.
//! 5. Again from 2; then each effect must still pay beside the others, and no other must do better in its place.
//! 6. What pattern is left in the residual is reported as unexplained.

use super::candidates::{starts, why_not};
use super::fit::{Fitted, Use, fit};
use super::report::{Added, ChannelError, Confounded, Errors, LearnReport, Rejected, Transfer, Unexplained, Value};
use super::residual::{inflation, is_series, noise_floor, patterns};
use super::samples::{Class, Data};
use super::split::{Split, held_out_residuals, improvement_by_block, t_statistic, without};
use crate::effects::{Acts, Effect};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// How a diagnosis is run.
#[derive(Debug, Clone)]
pub struct Options {
    /// Effects that may be named.
    pub candidates: Vec<&'static Effect>,
    /// Most effects that are added.
    pub max_effects: usize,
    /// Seed of the permutation tests.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { candidates: crate::effects::ALL.to_vec(), max_effects: 4, seed: 1 }
    }
}

/// Least score of an effect: a likelihood ratio of e⁴ beyond the charge for its parameters.
const THRESHOLD: f64 = 8.0;
/// The same for tables, where nothing is scanned: "strong" on the scale of the Bayesian information criterion.
const TABLE_THRESHOLD: f64 = 4.0;
/// Rivals whose score is this close to the best explain the data equally well.
const MARGIN: f64 = 6.0;
/// Least relative drop of the held-out error worth an effect.
const LEAST_DROP: f64 = 0.005;
/// Least share of what the base model leaves beyond the noise that one effect must take away.
const LEAST_SHARE: f64 = 0.04;
/// The same of what the effects before it leave: a small effect beside a large one.
const LEAST_REST: f64 = 0.3;
/// Effects that are tried in pairs when none is found alone, and the least share that a pair must take away.
const PAIRED: usize = 6;
const PAIR_EXPLAINED: f64 = 0.7;
/// Least error over the noise that makes pairs worth trying.
const PAIR_NEEDED: f64 = 1.3;
/// Least share of it that all effects together must take away, or none is named.
const LEAST_EXPLAINED: f64 = 0.5;
/// Share of the residual's variance above which what is left is called structure.
const STRUCTURE: f64 = 0.15;

/// A candidate on top of a model.
struct Trial {
    effect: &'static Effect,
    fitted: Fitted,
    gain: f64,
    score: f64,
}

/// Runs the whole diagnosis.
pub fn diagnose(data: &Data, split: &Split, options: &Options) -> Option<LearnReport> {
    let scaled = whitened(data)?;
    let train = scaled.with_weights(without(&scaled, |i| split.test[i]));
    let mut search = Diagnosis {
        data: &scaled,
        train,
        split,
        options,
        tried: 0,
        rejected: Vec::new(),
        evidence: Vec::new(),
        base_residual: Vec::new(),
        floor: 0.0,
    };
    let base = fit(&search.train, &[], 0)?;
    let begin = search.timed(&base);
    search.base_residual = held_out_residuals(&search.train, &begin.model.effects, split);
    search.floor = noise_floor(&search.train, &base.residuals(data)).unwrap_or(0.0);
    let (fitted, confounded) = search.add_effects(&begin);
    let fitted = search.prune(fitted);
    let fitted = search.withdraw(&begin, fitted);
    let nothing = fitted.model.effects.len() == begin.model.effects.len();
    let fitted = if nothing { search.pair(&begin).unwrap_or(fitted) } else { fitted };
    let mut report = search.report(&base, &fitted);
    report.confounded =
        confounded.into_iter().filter(|c| fitted.model.effects.iter().any(|u| u.effect.name == c.names[0])).collect();
    report.unexplained = unexplained(&scaled, &fitted, options.seed);
    report.verdict = verdict(&report);
    Some(report)
}

/// Weights in units of one over the variance of each channel, from the residual of the base model.
pub fn whitened(data: &Data) -> Option<Data> {
    let base = Data {
        base: data.base.iter().cloned().map(|b| super::samples::Base { prior: None, ..b }).collect(),
        ..data.clone()
    };
    let fitted = fit(&base, &[], 0)?;
    let residual = fitted.residuals(data);
    let channels = data.channel.iter().max().map_or(0, |c| c + 1);
    let mut variance = vec![(0.0, 0.0); channels];
    for i in data.used() {
        variance[data.channel[i]].0 += data.weight[i] * residual[i].powi(2);
        variance[data.channel[i]].1 += data.weight[i];
    }
    let of = |c: usize| (variance[c].0 / f64::max(variance[c].1, 1e-300)).max(1e-18);
    let weight = (0..data.len()).map(|i| data.weight[i] / of(data.channel[i])).collect();
    Some(data.with_weights(weight))
}

struct Diagnosis<'a> {
    data: &'a Data,
    train: Data,
    split: &'a Split,
    options: &'a Options,
    tried: usize,
    rejected: Vec<Rejected>,
    evidence: Vec<(&'static str, String, f64, [f64; 2])>,
    /// Held-out residual of the base model on the training blocks.
    base_residual: Vec<f64>,
    /// Noise of neighbouring readings; 0 where it is not known.
    floor: f64,
}

impl Diagnosis<'_> {
    fn add_effects(&mut self, base: &Fitted) -> (Fitted, Vec<Confounded>) {
        let mut present = base.clone();
        let mut confounded: Vec<Confounded> = Vec::new();
        for round in 0..self.options.max_effects {
            let mut trials = self.trials(&present, round == 0);
            trials.sort_by(|a, b| b.score.total_cmp(&a.score));
            let Some(chosen) = self.first_accepted(&present, &trials) else { break };
            confounded.retain(|c| !c.names.iter().any(|name| name == trials[chosen].effect.name));
            confounded.extend(self.rivals(&trials, chosen));
            present = trials.swap_remove(chosen).fitted;
        }
        (present, confounded)
    }

    /// The base model, with the acceleration that the times of the blocks show.
    fn timed(&mut self, base: &Fitted) -> Fitted {
        let corner = self.options.candidates.iter().copied().find(|e| e.acts == Acts::Motion);
        let Some(((factor, nats), effect)) = self.data.timed_acceleration.zip(corner) else { return base.clone() };
        let each = Use { effect, values: vec![factor], free: vec![false] };
        let Some(fitted) = fit(&self.train, &[each], 5) else { return base.clone() };
        let text =
            format!("the times that the blocks took show it ({nats:.0} nats ahead of the declared acceleration)");
        let errors = [self.judged(&[]).rmse, self.judged(&fitted.model.effects).rmse];
        self.evidence.push((effect.name, text, (-nats).exp(), errors));
        fitted
    }

    fn is_timed(&self, effect: &Effect) -> bool {
        self.data.timed_acceleration.is_some() && effect.acts == Acts::Motion
    }

    /// Every candidate on top of the present model.
    fn trials(&mut self, present: &Fitted, note: bool) -> Vec<Trial> {
        let has = |effect: &Effect| present.model.effects.iter().any(|u| u.effect.name == effect.name);
        let mut open = Vec::new();
        for effect in self.options.candidates.iter().copied().filter(|e| !has(e)) {
            match why_not(effect, &self.train) {
                Some(why) if note => self.rejected.push(Rejected { name: effect.name.into(), why }),
                Some(_) => {}
                None => open.push(effect),
            }
        }
        let train = &self.train;
        let tried: Vec<(usize, Option<Trial>)> =
            open.par_iter().map(|effect| best_trial(train, present, &present.model.effects, effect)).collect();
        self.tried += tried.iter().map(|(count, _)| count).sum::<usize>();
        tried.into_iter().filter_map(|(_, trial)| trial).collect()
    }

    /// Index of the best trial that stands every test.
    fn first_accepted(&mut self, present: &Fitted, trials: &[Trial]) -> Option<usize> {
        let before = held_out_residuals(&self.train, &present.model.effects, self.split);
        for (k, trial) in trials.iter().enumerate() {
            if trial.score < self.threshold() {
                self.reject(trial, format!("it explains too little for its parameters (score {:.1})", trial.score));
                continue;
            }
            if let Some(why) = unphysical(trial.fitted.model.effects.last()) {
                self.reject(trial, why);
                continue;
            }
            let after = self.unseen_residuals(present, trial);
            let drop = self.drop_of(&before, &after);
            let t = t_statistic(&improvement_by_block(&self.train, &before, &after));
            let share = self.share_of_excess(&before, &after, &self.base_residual);
            let of_rest = self.share_of_excess(&before, &after, &before);
            if share < LEAST_SHARE && of_rest < LEAST_REST {
                self.reject(trial, format!("it takes away only {:.1} % of what the base model leaves", 100.0 * share));
                continue;
            }
            if drop < LEAST_DROP || t < 1.0 {
                self.reject(
                    trial,
                    format!("it does not lower the held-out error ({:+.2} %, t = {t:.1})", -100.0 * drop),
                );
                continue;
            }
            if let Some(why) = self.harms_another_kind(present, trial) {
                self.reject(trial, why);
                continue;
            }
            let p_value = chance(trial);
            let text = format!(
                "lowers the error on left-out blocks by {:.1} % (t = {t:.1}), score {:.1}",
                100.0 * drop,
                trial.score
            );
            let errors = [self.judged(&present.model.effects), self.judged(&trial.fitted.model.effects)];
            self.evidence.push((trial.effect.name, text, p_value, errors.map(|e| e.rmse)));
            self.rejected.retain(|r| r.name != trial.effect.name);
            return Some(k);
        }
        None
    }

    /// Held-out squares that go from `before` to `after`, over those of `whole` beyond the noise.
    fn share_of_excess(&self, before: &[f64], after: &[f64], whole: &[f64]) -> f64 {
        let mean = |r: &[f64]| errors(&self.train, |i| r[i]).rmse.powi(2);
        let excess = mean(whole) - self.floor.powi(2);
        (mean(before) - mean(after)) / excess.max(0.02 * mean(whole))
    }

    /// Two effects that explain together what neither does alone (each hides the other from the fit).
    fn pair(&mut self, base: &Fitted) -> Option<Fitted> {
        let left = errors(&self.train, |i| self.base_residual[i]).rmse;
        if left < PAIR_NEEDED * self.floor {
            return None;
        }
        let mut first = self.trials(base, false);
        first.sort_by(|a, b| b.score.total_cmp(&a.score));
        first.truncate(PAIRED);
        let mut best: Option<(f64, Trial)> = None;
        for one in &first {
            for two in self.trials(&one.fitted, false) {
                let asked = two.fitted.model.effects.iter().map(Use::asked).sum();
                let (score, _) = score_of(&self.train, base, &two.fitted, asked);
                let sound = two.fitted.model.effects.iter().all(|u| unphysical(Some(u)).is_none());
                if sound && best.as_ref().is_none_or(|(most, _)| score > *most) {
                    best = Some((score, two));
                }
            }
        }
        let (score, two) = best.filter(|(score, _)| *score > 2.0 * self.threshold())?;
        let after = held_out_residuals(&self.train, &two.fitted.model.effects, self.split);
        let share = self.share_of_excess(&self.base_residual, &after, &self.base_residual);
        let t = t_statistic(&improvement_by_block(&self.train, &self.base_residual, &after));
        if share < PAIR_EXPLAINED || t < 1.0 {
            return None;
        }
        let errors = [self.judged(&[]).rmse, self.judged(&two.fitted.model.effects).rmse];
        for each in &two.fitted.model.effects[base.model.effects.len()..] {
            let text = format!(
                "only together with the other it takes away {:.0} % of what the base model leaves (score {score:.1})",
                100.0 * share
            );
            self.evidence.push((each.effect.name, text, chance(&two), errors));
            self.rejected.retain(|r| r.name != each.effect.name);
        }
        Some(two.fitted)
    }

    /// Effects that leave most of the excess are no explanation of it.
    fn withdraw(&mut self, base: &Fitted, fitted: Fitted) -> Fitted {
        if fitted.model.effects.len() == base.model.effects.len() {
            return fitted;
        }
        let after = held_out_residuals(&self.train, &fitted.model.effects, self.split);
        let share = self.share_of_excess(&self.base_residual, &after, &self.base_residual);
        if share >= LEAST_EXPLAINED {
            return fitted;
        }
        let kept = base.model.effects.len();
        for each in &fitted.model.effects[kept..] {
            self.rejected.push(Rejected {
                name: each.effect.name.into(),
                why: format!(
                    "all effects found together take away only {:.0} % of what the base model leaves",
                    100.0 * share
                ),
            });
        }
        base.clone()
    }

    fn threshold(&self) -> f64 {
        if is_series(self.data) { THRESHOLD } else { TABLE_THRESHOLD }
    }

    /// Held-out residuals with a trial; what was found by scanning is found again without each fold.
    fn unseen_residuals(&self, present: &Fitted, trial: &Trial) -> Vec<f64> {
        if !trial.effect.parameters.iter().any(|p| p.scanned) {
            return held_out_residuals(&self.train, &trial.fitted.model.effects, self.split);
        }
        let folds: Vec<Vec<(usize, f64)>> = (0..self.split.folds)
            .into_par_iter()
            .map(|fold| {
                let rest = self.train.with_weights(without(&self.train, |i| self.split.fold[i] == fold));
                let found = fit(&rest, &present.model.effects, 8)
                    .and_then(|own| best_trial(&rest, &own, &own.model.effects, trial.effect).1);
                let Some(found) = found else { return Vec::new() };
                let held = self.train.used().filter(|i| self.split.fold[*i] == fold);
                held.map(|i| (i, self.train.reading[i] - found.fitted.predicted[i])).collect()
            })
            .collect();
        let mut residuals = vec![f64::NAN; self.train.len()];
        folds.into_iter().flatten().for_each(|(i, r)| residuals[i] = r);
        residuals
    }

    fn drop_of(&self, before: &[f64], after: &[f64]) -> f64 {
        let (mut b, mut a) = (0.0, 0.0);
        for i in self.train.used().filter(|i| before[*i].is_finite() && after[*i].is_finite()) {
            b += self.train.weight[i] * before[i].powi(2);
            a += self.train.weight[i] * after[i].powi(2);
        }
        1.0 - (a / f64::max(b, 1e-300)).sqrt()
    }

    fn reject(&mut self, trial: &Trial, why: String) {
        self.rejected.retain(|r| r.name != trial.effect.name);
        self.rejected.push(Rejected { name: trial.effect.name.into(), why });
    }

    /// An effect must not make cuts worse that it was not fitted on.
    fn harms_another_kind(&self, present: &Fitted, trial: &Trial) -> Option<String> {
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
            if ratio > 1.02 && t_statistic(&worse) < -1.0 {
                return Some(format!(
                    "fitted without {}, it makes that worse ({:+.1} % error)",
                    self.data.kind_names[kind],
                    100.0 * (ratio - 1.0)
                ));
            }
        }
        None
    }

    fn kinds(&self) -> Vec<usize> {
        let mut kinds: Vec<usize> = self.data.used().map(|i| self.data.kind[i]).collect();
        kinds.sort_unstable();
        kinds.dedup();
        if kinds.len() < 2 { Vec::new() } else { kinds }
    }

    /// Rivals as good as the chosen one that have nothing to add to it.
    fn rivals(&self, trials: &[Trial], chosen: usize) -> Option<Confounded> {
        let best = &trials[chosen];
        let close = |t: &&Trial| {
            t.effect.name != best.effect.name && t.score > self.threshold() && best.score - t.score < MARGIN
        };
        let adds = |t: &Trial| {
            let trial = best_trial(&self.train, &best.fitted, &best.fitted.model.effects, t.effect).1;
            trial.is_some_and(|t| t.score > self.threshold())
        };
        let rivals: Vec<&Trial> = trials.iter().filter(close).filter(|t| !adds(t)).collect();
        if rivals.is_empty() {
            return None;
        }
        let names = std::iter::once(best.effect.name).chain(rivals.iter().map(|t| t.effect.name));
        let cuts: Vec<&str> =
            std::iter::once(best.effect.separated_by).chain(rivals.iter().map(|t| t.effect.separated_by)).collect();
        Some(Confounded {
            names: names.map(str::to_owned).collect(),
            why: format!("their scores differ by less than {MARGIN} and neither adds to the other"),
            experiment: cuts.join("; "),
        })
    }

    /// Takes effects out that no longer pay, and puts better ones in their place.
    fn prune(&mut self, fitted: Fitted) -> Fitted {
        let mut present = fitted;
        let mut k = 0;
        while present.model.effects.len() > 1 && k < present.model.effects.len() {
            let others: Vec<Use> = remove(&present.model.effects, k);
            let Some(without_it) = fit(&self.train, &others, 12) else { break };
            let own = present.model.effects[k].effect;
            if self.is_timed(own) {
                k += 1;
                continue;
            }
            let asked = present.model.effects[k].asked();
            let (score, _) = score_of(&self.train, &without_it, &present, asked);
            if score < self.threshold() {
                self.rejected
                    .push(Rejected { name: own.name.into(), why: "the effects added after it explain as much".into() });
                present = without_it;
                k = 0;
                continue;
            }
            if let Some(better) = self.replacement(&without_it, own, score) {
                present = better;
            }
            k += 1;
        }
        present
    }

    fn replacement(&mut self, without_it: &Fitted, own: &'static Effect, same: f64) -> Option<Fitted> {
        let trials = self.trials(without_it, false);
        let best =
            trials.into_iter().filter(|t| t.effect.name != own.name).max_by(|a, b| a.score.total_cmp(&b.score))?;
        if best.score < same + MARGIN || unphysical(best.fitted.model.effects.last()).is_some() {
            return None;
        }
        let before = self.judged(&without_it.model.effects).rmse;
        let after = self.judged(&best.fitted.model.effects).rmse;
        let text =
            format!("beside the others it explains more than {} (score {:.1} against {same:.1})", own.name, best.score);
        self.evidence.push((best.effect.name, text, chance(&best), [before, after]));
        self.rejected.retain(|r| r.name != best.effect.name);
        self.rejected.push(Rejected { name: own.name.into(), why: format!("{} explains more", best.effect.name) });
        Some(best.fitted)
    }

    /// Errors on data that a model with these effects was not fitted on.
    fn judged(&self, effects: &[Use]) -> Errors {
        let residual = self.unseen(effects);
        errors(self.data, |i| residual[i])
    }

    /// Residuals of such data, NaN for the others.
    fn unseen(&self, effects: &[Use]) -> Vec<f64> {
        if !self.split.test.iter().any(|t| *t) || !self.same_kinds() {
            return held_out_residuals(&self.train, effects, self.split);
        }
        let predicted = fit(&self.train, effects, 12).map(|f| f.predicted).unwrap_or_default();
        let of = |i: usize| if self.split.test[i] { self.data.reading[i] - predicted[i] } else { f64::NAN };
        (0..predicted.len()).map(of).collect()
    }

    /// Held-out errors of each measured quantity.
    fn channels(&self, fitted: &Fitted) -> Vec<ChannelError> {
        let (base, last) = (self.unseen(&[]), self.unseen(&fitted.model.effects));
        let on =
            |r: &[f64], c: usize| errors(self.data, |i| if self.data.channel[i] == c { r[i] } else { f64::NAN }).rmse;
        let names = self.data.channel_names.iter().enumerate();
        names
            .map(|(c, name)| ChannelError { name: name.clone(), base_rmse: on(&base, c), final_rmse: on(&last, c) })
            .collect()
    }

    /// Do the samples kept for the judgement belong to the kinds that were fitted?
    fn same_kinds(&self) -> bool {
        let trained: Vec<usize> = self.train.used().map(|i| self.data.kind[i]).collect();
        (0..self.data.len()).filter(|i| self.split.test[*i]).all(|i| trained.contains(&self.data.kind[i]))
    }

    fn report(&mut self, base: &Fitted, fitted: &Fitted) -> LearnReport {
        let data = self.data;
        let errors_of = |f: &Fitted, d: &Data| errors(d, |i| d.reading[i] - f.predicted[i]);
        let effects = fitted.model.effects.iter().enumerate().map(|(e, each)| self.added(e, each, fitted)).collect();
        let used = data.used().count();
        LearnReport {
            samples: data.len(),
            used,
            train: self.train.used().count(),
            test: if self.split.test.iter().any(|t| *t) { used - self.train.used().count() } else { used },
            how: self.split.how.clone(),
            base: values(data, base),
            condition: base.condition,
            base_train: errors_of(base, &self.train),
            base_test: self.judged(&[]),
            effects,
            rejected: std::mem::take(&mut self.rejected),
            final_train: errors_of(fitted, &self.train),
            final_test: self.judged(&fitted.model.effects),
            channels: self.channels(fitted),
            final_base: values(data, fitted),
            covariance: covariance(data, fitted),
            tare_rps: data.state.iter().map(|state| state.reference_rps).find(|rps| rps.is_finite()),
            noise_floor: noise_floor(data, &fitted.residuals(data)),
            transfer: self.transfer(base, fitted),
            variants_tried: self.tried,
            supports_model: base.condition < 1e6,
            ..LearnReport::default()
        }
    }

    fn added(&self, e: usize, each: &Use, fitted: &Fitted) -> Added {
        let found = self.evidence.iter().rev().find(|(name, ..)| *name == each.effect.name);
        let (_, evidence, p_value, errors) =
            found.cloned().unwrap_or((each.effect.name, String::new(), 1.0, [f64::NAN; 2]));
        let first: usize =
            fitted.model.effects[..e].iter().map(|u| u.values.len()).sum::<usize>() + fitted.model.base.len();
        let parameters =
            each.effect.parameters.iter().zip(&each.values).enumerate().map(|(k, (parameter, value))| Value {
                name: parameter.name.into(),
                value: *value,
                std_error: fitted.covariance[(first + k, first + k)].max(0.0).sqrt(),
                unit: parameter.unit.into(),
            });
        Added {
            name: each.effect.name.into(),
            parameters: parameters.collect(),
            p_value,
            test_rmse_before: errors[0],
            test_rmse_after: errors[1],
            evidence,
        }
    }

    fn transfer(&self, base: &Fitted, fitted: &Fitted) -> Vec<Transfer> {
        let trained: Vec<usize> = self.train.used().map(|i| self.data.kind[i]).collect();
        let other = |kind: &usize| !trained.contains(kind);
        self.kinds()
            .into_iter()
            .filter(other)
            .map(|kind| {
                let only = self.data.with_weights(without(self.data, |i| self.data.kind[i] != kind));
                Transfer {
                    kind: self.data.kind_names[kind].clone(),
                    samples: only.used().count(),
                    rmse_before: errors(&only, |i| only.reading[i] - base.predicted[i]).rmse,
                    rmse_after: errors(&only, |i| only.reading[i] - fitted.predicted[i]).rmse,
                }
            })
            .collect()
    }
}

fn residual_on(members: &[usize], fitted: &Fitted, data: &Data) -> Vec<f64> {
    let mut residual = vec![f64::NAN; data.len()];
    for &i in members {
        residual[i] = data.reading[i] - fitted.predicted[i];
    }
    residual
}

fn remove(effects: &[Use], k: usize) -> Vec<Use> {
    effects.iter().enumerate().filter(|(e, _)| *e != k).map(|(_, each)| each.clone()).collect()
}

/// Best fit of a candidate over its forms and starts, and how many fits that took.
fn best_trial(data: &Data, present: &Fitted, effects: &[Use], effect: &'static Effect) -> (usize, Option<Trial>) {
    let begin = starts(effect, data, present);
    let with = |each: &Use| effects.iter().cloned().chain([each.clone()]).collect::<Vec<Use>>();
    let trial = |each: &Use, iterations: usize| {
        let fitted = fit(data, &with(each), iterations)?;
        let (score, gain) = score_of(data, present, &fitted, each.asked());
        Some(Trial { effect, fitted, gain, score })
    };
    let best = begin.iter().filter_map(|each| trial(each, 5)).max_by(|a, b| a.score.total_cmp(&b.score));
    let polished = best.and_then(|b| trial(b.fitted.model.effects.last()?, 25));
    (begin.len(), polished)
}

/// (score, gain) of `after` over `before` with `k` more parameters.
fn score_of(data: &Data, before: &Fitted, after: &Fitted, k: usize) -> (f64, f64) {
    let n = data.used().count() as f64 / inflation(data, &after.residuals(data));
    let gain = n * (before.squares.max(1e-300) / after.squares.max(1e-300)).ln();
    (gain - k as f64 * n.max(2.0).ln(), gain)
}

fn chance(trial: &Trial) -> f64 {
    let freedom = trial.fitted.model.effects.last().map_or(1, Use::asked).max(1) as f64;
    ChiSquared::new(freedom).map_or(1.0, |chi| chi.sf(trial.gain.max(0.0)))
}

/// Why the strength of an effect is not physical.
fn unphysical(each: Option<&Use>) -> Option<String> {
    let each = each?;
    if !each.effect.is_physical(&each.values) {
        return Some("its parameters leave their physical bounds".into());
    }
    let strength = (0..each.values.len()).find(|k| each.free[*k] && !each.effect.parameters[*k].scanned)?;
    let (value, parameter) = (each.values[strength], &each.effect.parameters[strength]);
    let at = |bound: f64| (value - bound).abs() < 1e-6 * (parameter.max - parameter.min);
    (at(parameter.max) || (at(parameter.min) && parameter.min != 0.0))
        .then(|| format!("{} runs into its physical bound ({value:.3})", parameter.name))
}

/// Errors over the samples that count, by their weights.
pub fn errors(data: &Data, residual: impl Fn(usize) -> f64) -> Errors {
    let used: Vec<usize> = data.used().filter(|i| residual(*i).is_finite()).collect();
    let sum = |of: &dyn Fn(usize) -> f64| used.iter().map(|&i| data.weight[i] * of(i)).sum::<f64>();
    let whole = sum(&|_| 1.0).max(1e-300);
    let mean = sum(&|i| data.reading[i]) / whole;
    let squares = sum(&|i| residual(i).powi(2));
    let total = sum(&|i| (data.reading[i] - mean).powi(2));
    let top = used.iter().map(|i| data.reading[*i].abs()).fold(0.0, f64::max);
    let large = |i: usize| if data.reading[i].abs() > 0.05 * top { 1.0 } else { 0.0 };
    let relative = sum(&|i| large(i) * (residual(i) / data.reading[i].abs().max(1e-300)).abs());
    Errors {
        rmse: (squares / whole).sqrt(),
        mape: 100.0 * relative / sum(&large).max(1e-300),
        r2: 1.0 - squares / total.max(1e-300),
    }
}

fn values(data: &Data, fitted: &Fitted) -> Vec<Value> {
    let value = |(b, base): (usize, &super::samples::Base)| Value {
        name: base.name.clone(),
        value: fitted.model.base[b],
        std_error: fitted.std_error(b),
        unit: base.unit.clone(),
    };
    data.base.iter().enumerate().map(value).collect()
}

fn covariance(data: &Data, fitted: &Fitted) -> Vec<Vec<f64>> {
    let p = data.base.len();
    (0..p).map(|a| (0..p).map(|b| fitted.covariance[(a, b)]).collect()).collect()
}

fn unexplained(data: &Data, fitted: &Fitted, seed: u64) -> Option<Unexplained> {
    let residual = fitted.residuals(data);
    let least = if is_series(data) { STRUCTURE } else { 2.0 * STRUCTURE };
    let strongest = patterns(data, &residual, &fitted.predicted, seed).into_iter().next()?;
    (strongest.test_r2 > least)
        .then_some(Unexplained { test_r2_of_residual_structure: strongest.test_r2, largest_correlate: strongest.along })
}

fn verdict(report: &LearnReport) -> String {
    let names: Vec<&str> = report.effects.iter().map(|e| e.name.as_str()).collect();
    let (before, after) = (report.base_test.rmse, report.final_test.rmse);
    let found = match names.as_slice() {
        [] => "Nothing to add: no effect of the list explains the residual".to_owned(),
        some => format!("The residual is explained by {}; held-out error {before:.4} → {after:.4}", some.join(" and ")),
    };
    let rivals =
        report.confounded.iter().map(|c| format!("{} cannot be told from {}", c.names[0], c.names[1..].join(", ")));
    let left = report.unexplained.as_ref().map(|u| {
        format!(
            "{:.0} % of the remaining variance follows {} and is unexplained",
            100.0 * u.test_r2_of_residual_structure,
            u.largest_correlate
        )
    });
    let mut parts: Vec<String> = std::iter::once(found).chain(rivals).chain(left).collect();
    if report.effects.is_empty() && report.unexplained.is_none() {
        parts[0] = format!("Nothing to add: what is left ({after:.4}) has no structure beyond noise");
    }
    parts.join("; ") + "."
}

/// Does any base coefficient belong to the class?
pub fn has_class(data: &Data, class: Class) -> bool {
    data.base.iter().any(|base| base.class == class)
}
