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
//! 5. Again from 2; then each effect must still pay beside the others, and no other must do better in its place. An effect
//!    that explains less than a pattern without a name ([`crate::learn::diagnose::unnamed`]) is not named.
//! 6. What pattern is left in the residual is reported as unexplained.

use crate::effects::{Acts, Covariate, Effect};
use crate::learn::dataset::errors::errors;
use crate::learn::dataset::samples::{Class, Data};
use crate::learn::diagnose::answer::{unexplained, verdict};
use crate::learn::diagnose::candidates::{part, why_not};
use crate::learn::diagnose::residual::{noise_floor, noise_with_memory};
use crate::learn::diagnose::trial::{Trial, best_trial, chance, score_of, unphysical};
use crate::learn::diagnose::unnamed::{Free, by_no_name, foreign};
use crate::learn::model::cross_validation::{Split, held_out_residuals, improvement_by_block, t_statistic, without};
use crate::learn::model::design::Use;
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::model::whitening::{weighed_by, whitened};
use crate::learn::report::{Confounded, LearnReport, Rejected};
use rayon::prelude::*;

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
/// Rivals whose gain (twice the log-likelihood) is this close to that of the best explain the data equally well, whatever
/// their parameters are charged.
pub(in crate::learn) const MARGIN: f64 = 6.0;
/// Rounds of a fit that goes to its end.
pub(in crate::learn) const FORM_ROUNDS: usize = 25;
/// Least relative drop of the held-out error worth an effect.
const LEAST_DROP: f64 = 0.005;
/// Least share of what the base model leaves beyond the noise that one effect must take away.
const LEAST_SHARE: f64 = 0.04;
/// The same of what the effects before it leave: a small effect beside a large one.
const LEAST_REST: f64 = 0.3;
/// Least excess of the base model over the noise that shares of it refer to, as a share of its squares.
const LEAST_EXCESS: f64 = 0.02;
/// Share of the squares to which the noise is known: a rest smaller than that is no rest to be explained.
const FLOOR_KNOWN: f64 = 0.1;
/// Effects that are tried in pairs when none is found alone, and the least share that a pair must take away.
const PAIRED: usize = 6;
const PAIR_EXPLAINED: f64 = 0.7;
/// Pairs that are judged on data left out, best first.
const PAIRS_JUDGED: usize = 4;
/// Least error over the noise that makes pairs worth trying.
const PAIR_NEEDED: f64 = 1.3;
/// Least share of it that all effects together must take away, or none is named.
const LEAST_EXPLAINED: f64 = 0.5;
/// Most share that they may leave of what the base model leaves beyond the noise, and the squares of a noise with memory over
/// those that neighbouring readings show: several effects together follow nearly any structure, but not to the end.
const MOST_LEFT: f64 = 0.07;
const NOISE_WITH_MEMORY: f64 = 2.0;

/// What the engagement of a cut is known to, relative: removal rates over a millimetre of path. In a long log everything is
/// significant, the steps of the engagement itself among it, and some effect always follows those a little.
const ENGAGEMENT_KNOWN: f64 = 0.003;

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
        noise: 0.0,
    };
    let base = fit(&search.train, &[], 0)?;
    let begin = search.timed(&base);
    search.base_residual = held_out_residuals(&search.train, &begin.model.effects, split);
    search.floor = noise_floor(&search.train, &base.residuals(data)).unwrap_or(0.0);
    search.noise = noise_with_memory(&search.train, &base.residuals(data)).unwrap_or(0.0);
    let (fitted, confounded) = search.add_effects(&begin);
    let fitted = search.prune(fitted);
    let fitted = search.withdraw(&begin, fitted);
    let nothing = fitted.model.effects.len() == begin.model.effects.len();
    let fitted = if nothing { search.pair(&begin).unwrap_or(fitted) } else { fitted };
    // What an effect made of one channel has stood in its noise so far.
    let several = data.channel.iter().any(|c| *c != data.channel[0]);
    let weighed = if several { weighed_by(data, &fitted) } else { scaled.clone() };
    let train = weighed.with_weights(without(&weighed, |i| split.test[i]));
    let refitted = |f: Fitted| if several { fit(&train, &f.model.effects, FORM_ROUNDS) } else { Some(f) };
    let (base, fitted) = refitted(base).zip(refitted(fitted))?;
    let mut search = Diagnosis { data: &weighed, train, ..search };
    let mut report = search.report(&base, &fitted);
    report.confounded =
        confounded.into_iter().filter(|c| fitted.model.effects.iter().any(|u| u.effect.name == c.names[0])).collect();
    report.unexplained = unexplained(&weighed, &fitted, options.seed);
    report.verdict = verdict(&report);
    Some(report)
}

/// The search as it stands.
pub(in crate::learn) struct Diagnosis<'a> {
    pub(in crate::learn) data: &'a Data,
    pub(in crate::learn) train: Data,
    pub(in crate::learn) split: &'a Split,
    pub(in crate::learn) options: &'a Options,
    pub(in crate::learn) tried: usize,
    pub(in crate::learn) rejected: Vec<Rejected>,
    pub(in crate::learn) evidence: Vec<(&'static str, String, f64, [f64; 2])>,
    /// Held-out residual of the base model on the training blocks.
    pub(in crate::learn) base_residual: Vec<f64>,
    /// Noise of neighbouring readings; 0 where it is not known.
    pub(in crate::learn) floor: f64,
    /// The same with what they share.
    pub(in crate::learn) noise: f64,
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
            present = self.shaped(trials.swap_remove(chosen).fitted);
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
    pub(in crate::learn) fn trials(&mut self, present: &Fitted, note: bool) -> Vec<Trial> {
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
            let after = match self.shown(present, trial, &before) {
                Ok(after) => after,
                Err(why) => {
                    self.reject(trial, why);
                    continue;
                }
            };
            let p_value = chance(trial);
            let text = format!(
                "lowers the error on left-out blocks by {:.1} % (t = {:.1}), score {:.1}",
                100.0 * self.drop_of(&before, &after),
                t_statistic(&improvement_by_block(&self.train, &before, &after)),
                trial.score
            );
            let errors = [self.judged(&present.model.effects), self.judged(&trial.fitted.model.effects)];
            self.evidence.push((trial.effect.name, text, p_value, errors.map(|e| e.rmse)));
            self.rejected.retain(|r| r.name != trial.effect.name);
            return Some(k);
        }
        None
    }

    /// What a trial leaves on data left out where the present model leaves `before`, or why that shows no effect.
    pub(in crate::learn) fn shown(&self, present: &Fitted, trial: &Trial, before: &[f64]) -> Result<Vec<f64>, String> {
        if trial.score < self.threshold() {
            return Err(format!("it explains too little for its parameters (score {:.1})", trial.score));
        }
        if let Some(why) = unphysical(trial.fitted.model.effects.last(), self.data.clock_s) {
            return Err(why);
        }
        let after = self.unseen_residuals(present, trial);
        let drop = self.drop_of(before, &after);
        let t = t_statistic(&improvement_by_block(&self.train, before, &after));
        let share = self.share_of_excess(before, &after, &self.base_residual, LEAST_EXCESS);
        let of_rest = self.share_of_excess(before, &after, before, FLOOR_KNOWN);
        if share < LEAST_SHARE && of_rest < LEAST_REST {
            return Err(format!("it takes away only {:.1} % of what the base model leaves", 100.0 * share));
        }
        if drop < LEAST_DROP || t < 1.0 {
            return Err(format!("it does not lower the held-out error ({:+.2} %, t = {t:.1})", -100.0 * drop));
        }
        let change = self.change_of_load(present, before, &after);
        if change < ENGAGEMENT_KNOWN {
            return Err(format!(
                "it changes the load by {:.2} %, and the engagement is known to {:.1} %",
                100.0 * change,
                100.0 * ENGAGEMENT_KNOWN
            ));
        }
        let misfit = self.misfit_of_form(present, trial, before, &after);
        misfit.or_else(|| self.harms_another_kind(present, trial)).map_or(Ok(after), Err)
    }

    /// Held-out squares that go from `before` to `after`, over those of `whole` beyond the noise, which are taken as no less
    /// than the share `least` of `whole`.
    fn share_of_excess(&self, before: &[f64], after: &[f64], whole: &[f64], least: f64) -> f64 {
        let mean = |r: &[f64]| errors(&self.train, |i| r[i]).rmse.powi(2);
        let excess = mean(whole) - self.floor.powi(2);
        (mean(before) - mean(after)) / excess.max(least * mean(whole))
    }

    /// Root of the held-out squares that go from `before` to `after` over those of the load of the cut. Whatever an engagement
    /// that is off by a share ε of every load leaves, Σ w (ε l)² is all that can be taken away by following it.
    fn change_of_load(&self, present: &Fitted, before: &[f64], after: &[f64]) -> f64 {
        let load = self.cut(present);
        let known = |i: usize| before[i].is_finite() && after[i].is_finite();
        let used: Vec<usize> = self.train.used().filter(|i| known(*i)).collect();
        let sum = |of: &dyn Fn(usize) -> f64| used.iter().map(|&i| self.train.weight[i] * of(i)).sum::<f64>();
        let removed = sum(&|i| before[i].powi(2) - after[i].powi(2)).max(0.0);
        (removed / sum(&|i| load[i].powi(2)).max(1e-300)).sqrt()
    }

    /// Is what is left beyond any noise more than a small share of what the base model leaves beyond it?
    fn leaves_much(&self, after: &[f64]) -> bool {
        let noise = NOISE_WITH_MEMORY * self.floor.powi(2);
        let beyond = |r: &[f64]| (errors(&self.train, |i| r[i]).rmse.powi(2) - noise).max(0.0);
        self.floor > 0.0 && beyond(after) > MOST_LEFT * beyond(&self.base_residual)
    }

    /// Load of the cut by a model.
    fn cut(&self, fitted: &Fitted) -> Vec<f64> {
        part(&self.train, fitted, &[Class::Cutting, Class::Edge])
    }

    /// Does a free pattern along what the effects before it depend on explain more than the trial?
    fn misfit_of_form(&self, present: &Fitted, trial: &Trial, before: &[f64], after: &[f64]) -> Option<String> {
        let known = present.model.effects.iter().flat_map(|u| u.effect.covariates.iter().copied());
        let own: Vec<Covariate> = known.filter(|c| !trial.effect.covariates.contains(c)).collect();
        let load = self.cut(present);
        let free = Free { data: &self.train, split: self.split, load: &load };
        let (along, [pattern, named]) = by_no_name(&free, &own, before, after)?;
        Some(format!(
            "what the effects before it leave follows {}, as they do: a free pattern along that leaves {:.0} % of it, this effect {:.0} %",
            along.name(),
            100.0 * pattern,
            100.0 * named
        ))
    }

    /// Why the effects found only stand in for something else: a free pattern along what none of them depends on explains
    /// more than all of them.
    fn stand_in(&self, base: &Fitted, fitted: &Fitted, after: &[f64]) -> Option<String> {
        let load = self.cut(base);
        let free = Free { data: &self.train, split: self.split, load: &load };
        let covariates = foreign(&fitted.model.effects);
        let (along, [pattern, named]) = by_no_name(&free, &covariates, &self.base_residual, after)?;
        Some(format!(
            "a free pattern along {} leaves {:.0} % of the squares of the base model, all effects found together {:.0} %",
            along.name(),
            100.0 * pattern,
            100.0 * named
        ))
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
        let mut pairs: Vec<(f64, Trial)> = Vec::new();
        for one in &first {
            for two in self.trials(&one.fitted, false) {
                let asked = two.fitted.model.effects.iter().map(Use::asked).sum();
                let (score, _) = score_of(&self.train, base, &two.fitted, asked);
                if score > 2.0 * self.threshold()
                    && two.fitted.model.effects.iter().all(|u| unphysical(Some(u), self.data.clock_s).is_none())
                {
                    pairs.push((score, two));
                }
            }
        }
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
        pairs.truncate(PAIRS_JUDGED);
        let judged = pairs.into_iter().find_map(|(score, two)| {
            let after = held_out_residuals(&self.train, &two.fitted.model.effects, self.split);
            let share = self.share_of_excess(&self.base_residual, &after, &self.base_residual, LEAST_EXCESS);
            let t = t_statistic(&improvement_by_block(&self.train, &self.base_residual, &after));
            let enough = share >= PAIR_EXPLAINED && t >= 1.0 && !self.leaves_much(&after);
            let sound = enough && self.stand_in(base, &two.fitted, &after).is_none();
            sound.then_some((score, two, share))
        });
        let (score, two, share) = judged?;
        let errors = [self.judged(&[]).rmse, self.judged(&two.fitted.model.effects).rmse];
        for each in &two.fitted.model.effects[base.model.effects.len()..] {
            let text = format!(
                "only together with the other it takes away {:.0} % of what the base model leaves (score {score:.1})",
                100.0 * share
            );
            self.evidence.push((each.effect.name, text, chance(&two), errors));
            self.rejected.retain(|r| r.name != each.effect.name);
        }
        Some(self.prune(two.fitted))
    }

    /// Effects that leave most of the excess are no explanation of it. What a noise with memory has beyond the differences of
    /// neighbouring readings is no excess, nor is what lies within the accuracy of the noise.
    fn withdraw(&mut self, base: &Fitted, fitted: Fitted) -> Fitted {
        if fitted.model.effects.len() == base.model.effects.len() {
            return fitted;
        }
        let after = held_out_residuals(&self.train, &fitted.model.effects, self.split);
        let mean = |r: &[f64]| errors(&self.train, |i| r[i]).rmse.powi(2);
        let [whole, left] = [&self.base_residual, &after].map(|r| mean(r) - self.noise.powi(2));
        let most = f64::max((1.0 - LEAST_EXPLAINED) * whole, FLOOR_KNOWN * mean(&after));
        let little =
            || format!("all effects found together leave {:.0} % of what the base model leaves", 100.0 * left / whole);
        let why = (left > most || self.leaves_much(&after)).then(little);
        let why = why.or_else(|| self.stand_in(base, &fitted, &after));
        let Some(why) = why else { return fitted };
        let kept = base.model.effects.len();
        for each in &fitted.model.effects[kept..] {
            self.rejected.push(Rejected { name: each.effect.name.into(), why: why.clone() });
        }
        base.clone()
    }

    fn threshold(&self) -> f64 {
        if self.data.is_series() { THRESHOLD } else { TABLE_THRESHOLD }
    }

    fn reject(&mut self, trial: &Trial, why: String) {
        self.rejected.retain(|r| r.name != trial.effect.name);
        self.rejected.push(Rejected { name: trial.effect.name.into(), why });
    }

    /// Rivals as good as the chosen one that have nothing to add to it.
    fn rivals(&self, trials: &[Trial], chosen: usize) -> Option<Confounded> {
        let best = &trials[chosen];
        let close =
            |t: &&Trial| t.effect.name != best.effect.name && t.score > self.threshold() && best.gain - t.gain < MARGIN;
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
            why: format!("their likelihoods differ by less than e^{:.0} and neither adds to the other", 0.5 * MARGIN),
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
            if let Some(better) = self.replacement(&without_it, &present, own, score) {
                present = better;
            } else if let Some(fuller) = self.other_form(&present, k, &without_it, score) {
                present = fuller;
            }
            k += 1;
        }
        present
    }
}

pub(in crate::learn) fn remove(effects: &[Use], k: usize) -> Vec<Use> {
    effects.iter().enumerate().filter(|(e, _)| *e != k).map(|(_, each)| each.clone()).collect()
}
