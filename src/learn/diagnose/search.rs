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
//!    that explains less than a pattern without a name ([`super::unnamed`]) is not named.
//! 6. What pattern is left in the residual is reported as unexplained.

use crate::effects::Acts;
use crate::learn::dataset::errors::errors;
use crate::learn::dataset::samples::Data;
use crate::learn::diagnose::answer::{unexplained, verdict};
use crate::learn::diagnose::criteria::{
    CONFOUNDED_WITHIN, LEAST_EXCESS, explains_too_little, pair_explains, pairs_are_worth_it,
};
use crate::learn::diagnose::diagnosis::{Diagnosis, Options};
use crate::learn::diagnose::forms::{FORM_ROUNDS, remove};
use crate::learn::diagnose::residual::{noise_floor, noise_with_memory};
use crate::learn::diagnose::trial::{Trial, best_trial, p_value, score_of, unphysical};
use crate::learn::model::cross_validation::{Split, held_out_residuals, improvement_by_block, t_statistic, without};
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::model::whitening::{weighed_by, whitened};
use crate::learn::report::{Confounded, LearnReport, Rejected};

/// Effects that are tried in pairs when none is found alone.
const PAIRED: usize = 6;
/// Pairs that are judged on data left out, best first.
const PAIRS_JUDGED: usize = 4;

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
        let each = FittedEffect { effect, values: vec![factor], free: vec![false] };
        let Some(fitted) = fit(&self.train, &[each], 5) else { return base.clone() };
        let text =
            format!("the times that the blocks took show it ({nats:.0} nats ahead of the declared acceleration)");
        let errors = [self.judged(&[]).rmse, self.judged(&fitted.model.effects).rmse];
        self.evidence.push((effect.name, text, (-nats).exp(), errors));
        fitted
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
            let p_value = p_value(trial);
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

    /// Two effects that explain together what neither does alone (each hides the other from the fit).
    fn pair(&mut self, base: &Fitted) -> Option<Fitted> {
        let left = errors(&self.train, |i| self.base_residual[i]).rmse;
        if !pairs_are_worth_it(left, self.floor) {
            return None;
        }
        let mut first = self.trials(base, false);
        first.sort_by(|a, b| b.score.total_cmp(&a.score));
        first.truncate(PAIRED);
        let mut pairs: Vec<(f64, Trial)> = Vec::new();
        for one in &first {
            for two in self.trials(&one.fitted, false) {
                let asked = two.fitted.model.effects.iter().map(FittedEffect::asked).sum();
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
            let enough = pair_explains(share, t) && !self.leaves_much(&after);
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
            self.evidence.push((each.effect.name, text, p_value(&two), errors));
            self.rejected.retain(|r| r.name != each.effect.name);
        }
        Some(self.prune(two.fitted))
    }

    /// Effects that leave most of the excess are no explanation of it. What a noise with memory has beyond the
    /// differences of neighbouring readings is no excess, nor is what lies within the accuracy of the noise.
    fn withdraw(&mut self, base: &Fitted, fitted: Fitted) -> Fitted {
        if fitted.model.effects.len() == base.model.effects.len() {
            return fitted;
        }
        let after = held_out_residuals(&self.train, &fitted.model.effects, self.split);
        let mean = |r: &[f64]| errors(&self.train, |i| r[i]).rmse.powi(2);
        let [whole, left] = [&self.base_residual, &after].map(|r| mean(r) - self.noise.powi(2));
        let little =
            || format!("all effects found together leave {:.0} % of what the base model leaves", 100.0 * left / whole);
        let why = (explains_too_little(whole, left, mean(&after)) || self.leaves_much(&after)).then(little);
        let why = why.or_else(|| self.stand_in(base, &fitted, &after));
        let Some(why) = why else { return fitted };
        let kept = base.model.effects.len();
        for each in &fitted.model.effects[kept..] {
            self.rejected.push(Rejected { name: each.effect.name.into(), why: why.clone() });
        }
        base.clone()
    }

    /// Rivals as good as the chosen one that have nothing to add to it.
    fn rivals(&self, trials: &[Trial], chosen: usize) -> Option<Confounded> {
        let best = &trials[chosen];
        let close = |t: &&Trial| {
            t.effect.name != best.effect.name && t.score > self.threshold() && best.gain - t.gain < CONFOUNDED_WITHIN
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
            why: format!(
                "their likelihoods differ by less than e^{:.0} and neither adds to the other",
                0.5 * CONFOUNDED_WITHIN
            ),
            experiment: cuts.join("; "),
        })
    }

    /// Takes effects out that no longer pay, and puts better ones in their place.
    fn prune(&mut self, fitted: Fitted) -> Fitted {
        let mut present = fitted;
        let mut k = 0;
        while present.model.effects.len() > 1 && k < present.model.effects.len() {
            let others: Vec<FittedEffect> = remove(&present.model.effects, k);
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
