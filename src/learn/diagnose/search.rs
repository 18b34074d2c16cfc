//! From data to named effects: forward selection by score and cross-validation, then pruning. In: [`Data`] and a
//! [`Split`]. Out: a [`LearnReport`].
//!
//! 1. The base model is fitted on the training blocks and judged on the others.
//!    Effects on the tare that the readings without a cut show come first ([`super::idle`]).
//! 2. Every candidate is fitted together with the effects already in the model. Its gain is G = n/φ · ln(RSS₀/RSS₁),
//!    with φ the inflation of the residual it leaves (neighbouring samples with a common error count as one); its score
//!    is G − k ln(n/φ) for k parameters (Bayesian information criterion, Schwarz 1978).
//! 3. The best is added if it passes every test of [`super::evidence`]: score, physical parameters, held-out error, no
//!    better curve along a covariate that it does not depend on, no harm to kinds of cuts it was not fitted on.
//! 4. If no single one passes, pairs are tried: each may mask the other in the fit.
//! 5. Each effect must still earn its score beside those added later. Then each named effect is compared with
//!    everything that can replace it ([`super::contest`]): a clearly better rival replaces it and the search continues;
//!    an equal one is reported beside it.
//! 6. When no effect of the list can be added, the curve over a covariate that lowers the held-out error most is added
//!    without a name ([`super::unnamed`]); the list is tried again beside it, the curves are chosen again, and step 5
//!    is repeated. Structure that remains is reported and refutes nothing that was found.
//! 7. Base terms that a table does not determine are left out if it is predicted better without them
//!    ([`super::undetermined_terms`]).
//! 8. If the error on the data kept for the judgement rose, the curves without a name that raise it are taken back
//!    ([`super::contradicted`]).

use crate::effects::{ALL, Acts, named};
use crate::learn::dataset::errors::errors;
use crate::learn::dataset::samples::Data;
use crate::learn::diagnose::answer::{unexplained, verdict};
use crate::learn::diagnose::ceiling::without_ceilings;
use crate::learn::diagnose::contest::Outcome;
use crate::learn::diagnose::criteria::{is_lower, is_no_worse};
use crate::learn::diagnose::diagnosis::{Diagnosis, Options};
use crate::learn::diagnose::evidence::Present;
use crate::learn::diagnose::forms::{FORM_ROUNDS, remove};
use crate::learn::diagnose::free_curve::along_all;
use crate::learn::diagnose::outlying::{cost, outlying, without as without_cuts};
use crate::learn::diagnose::residual::{noise_floor, noise_with_memory};
use crate::learn::diagnose::trial::{Trial, p_value, score_of, unphysical};
use crate::learn::diagnose::trial_cache::TrialCache;
use crate::learn::diagnose::undetermined_terms::Reduced;
use crate::learn::diagnose::unnamed::{ResidualCurve, is_shape_of, is_unnamed, with_predicted_loads};
use crate::learn::model::cross_validation::{Split, held_out_residuals, improvement_by_case, t_statistic, without};
use crate::learn::model::design::{FittedEffect, in_quantity_of};
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::model::whitening::{weighed_by, whitened};
use crate::learn::report::{Confounded, LearnReport, Rejected};

/// Candidates of best score whose pairs are tried when none is found alone.
const PAIRED: usize = 6;
/// Pairs of best score that are judged on held-out data.
const PAIRS_JUDGED: usize = 4;

/// Most named effects that are replaced by a rival.
const EXCHANGES: usize = 3;

/// Most curves without a name.
const MOST_CURVES: usize = 2;

/// Runs the whole diagnosis. Of a table it is run again without the cuts that are outlying beside the plain model, or beside that of the
/// first answer, and the answer of least cost is kept ([`super::outlying`]).
pub fn diagnose(data: &Data, split: &Split, options: &Options) -> Option<LearnReport> {
    let (mut best, effects) = diagnose_all(data, split, options)?;
    if data.is_series() {
        return Some(best);
    }
    let mut least = cost(data, &effects, &[]) - options.criteria.least_score(false);
    for effects in [&[], effects.as_slice()] {
        let apart = outlying(data, effects);
        if apart.is_empty() {
            continue;
        }
        let Some((mut again, effects)) = diagnose_all(&without_cuts(data, &apart), split, options) else { continue };
        let there = cost(data, &effects, &apart);
        if there < least {
            again.outlying = apart;
            (best, least) = (again, there);
        }
    }
    best.verdict = verdict(&best);
    Some(best)
}

/// Number of named effects of a model.
fn names_of(model: &Fitted) -> usize {
    model.model.effects.iter().filter(|each| !is_unnamed(each.effect)).count()
}

/// Adds what an effect is confounded with to what is known of it.
fn add_to(confounded: &mut Vec<Confounded>, group: Confounded) {
    match confounded.iter_mut().find(|known| known.names[0] == group.names[0]) {
        Some(known) => {
            let more = group.names.into_iter().filter(|name| !known.names.contains(name)).collect::<Vec<_>>();
            known.names.extend(more);
            known.experiment = group.experiment;
        }
        None => confounded.push(group),
    }
}

/// The diagnosis of all samples, and the effects of its model.
fn diagnose_all(data: &Data, split: &Split, options: &Options) -> Option<(LearnReport, Vec<FittedEffect>)> {
    let (data, ceilings) = &without_ceilings(data, &options.criteria);
    let scaled = whitened(data)?;
    let scaled = with_predicted_loads(&scaled, &fit(&scaled, &[], 0)?.predicted);
    let train = scaled.with_weights(without(&scaled, |i| split.test[i]));
    let mut search = Diagnosis {
        data: &scaled,
        train,
        split,
        options,
        tried: 0,
        rejected: Vec::new(),
        evidence: Vec::new(),
        pair: Vec::new(),
        shown_by_idle: Vec::new(),
        base_residual: Vec::new(),
        floor: 0.0,
        noise: 0.0,
        cache: TrialCache::default(),
        along: along_all(&scaled),
    };
    let base = fit(&search.train, &[], 0)?;
    let begin = search.with_timed_acceleration(&base);
    let begin = search.with_tare_of_idle_readings(begin);
    let begin = search.with_known_effects(begin)?;
    search.base_residual = held_out_residuals(&search.train, &begin.model.effects, split);
    search.floor = noise_floor(&search.train, &base.residuals(data)).unwrap_or(0.0);
    search.noise = noise_with_memory(&search.train, &base.residuals(data)).unwrap_or(0.0);
    let (fitted, mut confounded) = search.search_from(&begin);
    let fitted = search.released(fitted);
    // The noise of each channel was estimated with the base model, whose residual held the effects as well: estimate it
    // again.
    let several = data.channel.iter().any(|c| *c != data.channel[0]);
    let weighed = if several { weighed_by(data, &fitted) } else { scaled.clone() };
    let train = weighed.with_weights(without(&weighed, |i| split.test[i]));
    let refitted = |f: Fitted| if several { fit(&train, &f.model.effects, FORM_ROUNDS) } else { Some(f) };
    let (base, fitted) = refitted(base).zip(refitted(fitted))?;
    let search = Diagnosis { data: &weighed, train, cache: TrialCache::default(), ..search };
    let Reduced { data: reduced, train, fitted, left_out } = search.without_undetermined_terms(fitted);
    let mut last = Diagnosis { data: &reduced, train, cache: TrialCache::default(), ..search.clone() };
    let fitted = last.without_contradicted_curves(fitted);
    let mut report = last.report(&search, &base, &fitted);
    report.left_out = left_out;
    report.ceilings.clone_from(ceilings);
    confounded.retain(|c| fitted.model.effects.iter().any(|u| u.effect.name == c.names[0]));
    report.confounded = confounded;
    doubt_families_with_rivals(&mut report);
    doubt_what_does_not_help(&mut report, &last.without_gain(&fitted));
    report.unexplained = unexplained(&reduced, &fitted, &report, options.seed);
    report.verdict = verdict(&report);
    Some((report, fitted.model.effects))
}

impl Diagnosis<'_> {
    /// The model at the end of the search, and what its effects are confounded with. Rivals are compared before curves
    /// are added: a curve beside a wrong effect would correct its error and hide that it is wrong.
    fn search_from(&mut self, begin: &Fitted) -> (Fitted, Vec<Confounded>) {
        let mut confounded: Vec<Confounded> = Vec::new();
        let named = self.add_names(begin, true, &mut confounded);
        let (mut found, mut in_doubt) = self.contested_until_stable(named, EXCHANGES, &mut confounded);
        if let Some(more) = self.add_curves(&found, &mut confounded) {
            let more = self.curves_chosen_again(more, false);
            let names = names_of(&more);
            (found, in_doubt) = self.contested_until_stable(more, EXCHANGES, &mut confounded);
            // Beside a name that has gone since, the last curve may have been another one than without it.
            if names_of(&found) < names {
                let again = self.curves_chosen_again(found, true);
                (found, in_doubt) = self.contested_until_stable(again, 0, &mut confounded);
            }
            if let Some(one) = self.one_curve_for_both(&found) {
                (found, in_doubt) = self.contested_until_stable(one, 0, &mut confounded);
            }
        }
        for group in in_doubt {
            add_to(&mut confounded, group);
        }
        (found, confounded)
    }

    /// The names found without curves of their own, and the names of those that are in doubt.
    pub(in crate::learn) fn names_alone(&mut self, base: &Fitted) -> (Fitted, Vec<String>) {
        let mut confounded: Vec<Confounded> = Vec::new();
        let named = self.add_names(base, true, &mut confounded);
        let (found, in_doubt) = self.contested_until_stable(named, EXCHANGES, &mut confounded);
        confounded.extend(in_doubt);
        (found, confounded.into_iter().map(|group| group.names[0].clone()).collect())
    }

    /// Prunes the model and replaces effects by clearly better rivals, at most `exchanges` times, until none is better;
    /// with what the remaining ones are confounded with.
    fn contested_until_stable(
        &mut self,
        added: Fitted,
        exchanges: usize,
        confounded: &mut Vec<Confounded>,
    ) -> (Fitted, Vec<Confounded>) {
        let mut found = self.prune(added);
        for round in 0.. {
            match self.contested(&found, round < exchanges) {
                Outcome::Holds(in_doubt) => return (found, in_doubt),
                Outcome::Exchanged(exchanged) => {
                    let named = self.add_names(&exchanged, false, confounded);
                    let added = self.add_curves(&named, confounded).unwrap_or(named);
                    found = self.prune(added);
                }
            }
        }
        (found, Vec::new())
    }

    /// Adds effects of the list one after the other until none passes; on the first step of a search, pairs too.
    fn add_names(&mut self, base: &Fitted, is_first: bool, confounded: &mut Vec<Confounded>) -> Fitted {
        let mut found = base.clone();
        let mut is_first = is_first;
        loop {
            let named = found.model.effects.iter().filter(|each| !is_unnamed(each.effect)).count();
            let next =
                if named < self.options.max_effects { self.next_named(&found, is_first, confounded) } else { None };
            let pair = if next.is_none() && is_first { self.pair(base) } else { None };
            is_first = false;
            match next.or(pair) {
                Some(more) => found = more,
                None => return found,
            }
        }
    }

    /// Adds curves without a name, and after each the effects of the list that pass beside it; `None` if no curve is
    /// significant.
    fn add_curves(&mut self, base: &Fitted, confounded: &mut Vec<Confounded>) -> Option<Fitted> {
        let mut found = None;
        loop {
            let present = found.as_ref().unwrap_or(base);
            let curves = present.model.effects.iter().filter(|each| is_unnamed(each.effect)).count();
            let curve = if curves < MOST_CURVES { self.with_best_curve(present) } else { None };
            let Some(curve) = curve else { return found };
            found = Some(self.add_names(&curve, false, confounded));
        }
    }

    /// The model with every curve but the last, or `and_last`, chosen again: when it was chosen, the effects added after it were
    /// missing from the model, and it may have taken their part.
    fn curves_chosen_again(&mut self, model: Fitted, and_last: bool) -> Fitted {
        let mut present = model;
        let names = present.model.effects.iter().filter(|each| is_unnamed(each.effect)).map(|each| each.effect.name);
        for name in names.collect::<Vec<_>>() {
            let Some(e) = present.model.effects.iter().position(|each| each.effect.name == name) else { continue };
            let is_last = e + 1 == present.model.effects.len();
            if (is_last && !and_last) || self.has_own_data(present.model.effects[e].effect) {
                continue;
            }
            let Some(without_it) = fit(&self.train, &remove(&present.model.effects, e), FORM_ROUNDS) else { continue };
            if let Some(other) = self
                .with_best_curve(&without_it)
                .filter(|other| other.model.effects.last().is_some_and(|last| last.effect.name != name))
            {
                present = other;
            }
        }
        present
    }

    /// The model with the effects of the model file that learning starts from.
    fn with_known_effects(&mut self, begin: Fitted) -> Option<Fitted> {
        let has = |known: &FittedEffect| begin.model.effects.iter().any(|each| each.effect.name == known.effect.name);
        let known: Vec<FittedEffect> = self.options.known.iter().filter(|known| !has(known)).cloned().collect();
        let known: Vec<FittedEffect> = known.into_iter().map(|each| in_quantity_of(self.data, each)).collect();
        if known.is_empty() {
            return Some(begin);
        }
        let effects: Vec<FittedEffect> = begin.model.effects.iter().cloned().chain(known.iter().cloned()).collect();
        let fitted = fit(&self.train, &effects, FORM_ROUNDS)?;
        let errors =
            [self.judgement_errors(&begin.model.effects).rmse, self.judgement_errors(&fitted.model.effects).rmse];
        for each in &known {
            self.evidence.push((each.effect.name, "from the model that learning began with".to_owned(), 1.0, errors));
        }
        Some(fitted)
    }

    /// The model with the best effect of the list that passes every test; notes what it is confounded with.
    fn next_named(&mut self, model: &Fitted, note: bool, confounded: &mut Vec<Confounded>) -> Option<Fitted> {
        let mut trials = self.trials(model, note);
        trials.sort_by(|a, b| b.score.total_cmp(&a.score));
        let present = self.present(model);
        let (chosen, after) = self.first_accepted(&present, &trials)?;
        confounded.retain(|c| !c.names.iter().any(|name| name == trials[chosen].effect.name));
        confounded.extend(self.drift(&present, &trials[chosen], &after));
        confounded.extend(self.accident_or_difference(&present, &trials[chosen]));
        Some(self.with_best_shape(trials.swap_remove(chosen).fitted))
    }

    /// The base model with the acceleration fitted to the block times, if these show a slower machine.
    fn with_timed_acceleration(&mut self, base: &Fitted) -> Fitted {
        let corner = self.options.candidates.iter().copied().find(|e| e.acts == Acts::Motion);
        let Some(((factor, nats), effect)) = self.data.timed_acceleration.zip(corner) else { return base.clone() };
        let each = FittedEffect { effect, values: vec![factor], free: vec![false] };
        let Some(fitted) = fit(&self.train, &[each], 5) else { return base.clone() };
        let text =
            format!("the block times show it (log-likelihood {nats:.0} nats above that of the declared acceleration)");
        let errors = [self.judgement_errors(&[]).rmse, self.judgement_errors(&fitted.model.effects).rmse];
        self.evidence.push((effect.name, text, (-nats).exp(), errors));
        fitted
    }

    /// Index of the best trial that passes every test, and its held-out residuals.
    fn first_accepted(&mut self, present: &Present, trials: &[Trial]) -> Option<(usize, Vec<f64>)> {
        for (k, trial) in trials.iter().enumerate() {
            let after = match self.tested(present, trial) {
                Ok(after) => after,
                Err(why) => {
                    self.reject(trial, why);
                    continue;
                }
            };
            let p_value = self.p_of_the_search(trial);
            let is_first = present.model.model.effects.is_empty();
            if !is_first && self.criteria().may_be_chance(p_value) {
                let why = format!("among {} models tried such a gain comes by chance (p = {p_value:.2})", self.tried);
                self.reject(trial, why);
                continue;
            }
            let text = format!(
                "lowers the error on left-out blocks by {:.1} % (t = {:.1}), score {:.1}",
                100.0 * self.drop_of(&present.left, &after),
                t_statistic(&improvement_by_case(&self.train, &present.left, &after)),
                trial.score
            );
            let errors = [
                self.judgement_errors(&present.model.model.effects),
                self.judgement_errors(&trial.fitted.model.effects),
            ];
            self.evidence.push((trial.effect.name, text, p_value, errors.map(|e| e.rmse)));
            self.rejected.retain(|r| r.name != trial.effect.name);
            return Some((k, after));
        }
        None
    }

    /// Two effects that explain together what neither explains alone, because each masks the other in the fit.
    fn pair(&mut self, base: &Fitted) -> Option<Fitted> {
        let left = errors(&self.train, |i| self.base_residual[i]).rmse;
        if !self.criteria().pairs_are_worth_it(left, self.floor) {
            return None;
        }
        let mut first = self.trials(base, false);
        first.sort_by(|a, b| b.score.total_cmp(&a.score));
        first.truncate(PAIRED);
        let mut pairs: Vec<(f64, Trial)> = Vec::new();
        for one in &first {
            for two in self.trials(&one.fitted, false) {
                let asked = two.fitted.model.effects.iter().map(FittedEffect::free_count).sum();
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
        let curves = self.fitted_curves(base, &self.base_residual, |_, _| true);
        let judged = pairs.into_iter().find_map(|(score, two)| {
            let after = held_out_residuals(&self.train, &two.fitted.model.effects, self.split);
            let share =
                self.share_of_excess(&self.base_residual, &after, &self.base_residual, self.criteria().least_excess);
            let t = t_statistic(&improvement_by_case(&self.train, &self.base_residual, &after));
            // A change of load within the error of the engagement is no evidence, for two effects as for one.
            let is_seen = self.change_of_load(base, &self.base_residual, &after) >= self.criteria().engagement_known_to;
            let enough = is_seen && self.criteria().pair_explains(share, t) && !self.leaves_much(&after);
            let better = |found: &ResidualCurve| {
                let knows = |u: &FittedEffect| u.effect.knows(found.covariate, found.effect.multiplies);
                let known = two.fitted.model.effects.iter().any(knows);
                !known && self.is_better(&after, &found.fit.left)
            };
            // A single curve with the same held-out error is the simpler explanation.
            let simpler = || curves.first().is_some_and(|found| !self.is_better(&found.fit.left, &after));
            let new = base.model.effects.len()..two.fitted.model.effects.len();
            let is_accident = |e| self.why_between_operations(&two.fitted, e, &self.base_residual).is_none();
            let sound = enough && !curves.iter().any(better) && !simpler() && new.into_iter().all(is_accident);
            sound.then_some((score, two, share))
        });
        let (score, two, share) = judged?;
        let errors = [self.judgement_errors(&[]).rmse, self.judgement_errors(&two.fitted.model.effects).rmse];
        for each in &two.fitted.model.effects[base.model.effects.len()..] {
            let text = format!(
                "only together with the other it removes {:.0} % of what the base model leaves beyond the noise \
                 (score {score:.1})",
                100.0 * share
            );
            self.evidence.push((each.effect.name, text, self.p_of_the_search(&two), errors));
            self.rejected.retain(|r| r.name != each.effect.name);
        }
        self.pair = two.fitted.model.effects[base.model.effects.len()..].iter().map(|u| u.effect.name).collect();
        Some(self.prune(two.fitted)).filter(|left| left.model.effects.len() > base.model.effects.len() + 1)
    }

    /// Removes effects whose score beside the others is too low, and changes the others to a form of clearly better
    /// score.
    fn prune(&mut self, fitted: Fitted) -> Fitted {
        let mut present = fitted;
        let mut k = 0;
        while present.model.effects.len() > 1 && k < present.model.effects.len() {
            let others: Vec<FittedEffect> = remove(&present.model.effects, k);
            let Some(without_it) = fit(&self.train, &others, 12) else { break };
            let own = present.model.effects[k].effect;
            if self.has_own_data(own) {
                k += 1;
                continue;
            }
            let Some((score, lowers)) = self.worth_of(&present, &without_it, k) else { break };
            if score < self.threshold() || !lowers {
                self.rejected
                    .push(Rejected { name: own.name.into(), why: "the effects added after it explain as much".into() });
                present = if self.pair.contains(&own.name) { self.without_pair(&without_it) } else { without_it };
                k = 0;
                continue;
            }
            if let Some(fuller) = self.other_form(&present, k, &without_it, score) {
                present = fuller;
            }
            k += 1;
        }
        present
    }

    /// The model without the second effect of a pair after the first was removed: alone it explains nothing.
    fn without_pair(&mut self, present: &Fitted) -> Fitted {
        let is_left = |each: &&FittedEffect| !self.pair.contains(&each.effect.name);
        let others: Vec<FittedEffect> = present.model.effects.iter().filter(is_left).cloned().collect();
        for name in present.model.effects.iter().map(|u| u.effect.name).filter(|name| self.pair.contains(name)) {
            self.rejected
                .push(Rejected { name: name.into(), why: "it explained the residual only with another".into() });
        }
        fit(&self.train, &others, 12).unwrap_or_else(|| present.clone())
    }

    /// Score of the `k`-th effect beside the others, and whether it lowers the held-out error if there are curves
    /// without a name. Curves over its own covariates correct its law and are left out of both models, so that they
    /// cannot replace it.
    fn worth_of(&self, present: &Fitted, without_it: &Fitted, k: usize) -> Option<(f64, bool)> {
        let effects = &present.model.effects;
        let own = &effects[k];
        let score = |without: &Fitted, with: &Fitted| score_of(&self.train, without, with, own.free_count()).0;
        if !effects.iter().any(|each| is_unnamed(each.effect)) {
            return Some((score(without_it, present), true));
        }
        let others: Vec<FittedEffect> = remove(effects, k).into_iter().filter(|each| !is_shape_of(own, each)).collect();
        let with: Vec<FittedEffect> = others.iter().chain([own]).cloned().collect();
        let [before, after] = [&others, &with].map(|each| held_out_residuals(&self.train, each, self.split));
        let t = t_statistic(&improvement_by_case(&self.train, &before, &after));
        let lowers = self.criteria().lowers_held_out(self.drop_of(&before, &after), t);
        if with.len() == effects.len() {
            return Some((score(without_it, present), lowers));
        }
        Some((score(&fit(&self.train, &others, FORM_ROUNDS)?, &fit(&self.train, &with, FORM_ROUNDS)?), lowers))
    }

    /// The named effects without which the error on the data kept for the judgement is hardly higher. Curves over its own
    /// covariates are the shape of an effect and are left out with it. An effect with data of its own is not asked.
    pub(in crate::learn) fn without_gain(&self, fitted: &Fitted) -> Vec<&'static str> {
        let effects = &fitted.model.effects;
        let whole = self.judgement_errors(effects).rmse;
        let gains = |e: usize| {
            let is_open = |each: &FittedEffect| !is_shape_of(&effects[e], each);
            let others: Vec<FittedEffect> = remove(effects, e).into_iter().filter(is_open).collect();
            is_lower(self.judgement_errors(&others).rmse, whole)
        };
        let is_asked = |e: &usize| !is_unnamed(effects[*e].effect) && !self.has_own_data(effects[*e].effect);
        (0..effects.len()).filter(is_asked).filter(|e| !gains(*e)).map(|e| effects[e].effect.name).collect()
    }

    /// p value of the gain of a trial, multiplied by the number of models fitted (Bonferroni).
    pub(in crate::learn) fn p_of_the_search(&self, trial: &Trial) -> f64 {
        (p_value(trial) * self.tried.max(1) as f64).min(1.0)
    }
}

/// If a curve over another covariate explains as much, the effect that a curve was named after is reported as one of
/// several possible causes. So is wear that comes at once: an edge that broke out leaves the same curve.
fn doubt_families_with_rivals(report: &mut LearnReport) {
    let in_doubt = report.unnamed.iter().filter_map(|curve| {
        let name = curve.family.clone()?;
        let family = named(&name)?;
        let along = curve.rivals.iter().map(|rival| format!("a curve of the {} along {rival}", curve.multiplies));
        let comes_at_once = family.wear.is_some() && is_stepped(&curve.knots);
        let accidents = ALL.iter().filter(|effect| comes_at_once && effect.is_accident).map(|e| e.name.to_owned());
        let rivals: Vec<String> = along.chain(accidents).collect();
        (!rivals.is_empty()).then(|| Confounded {
            experiment: family.separated_by.to_owned(),
            names: std::iter::once(name).chain(rivals).collect(),
            why: if comes_at_once { "the load rises at once and not by and by" } else { AS_LOW }.to_owned(),
        })
    });
    let in_doubt: Vec<Confounded> = in_doubt.collect();
    report.confounded.extend(in_doubt);
}

/// Why a curve has rivals.
const AS_LOW: &str = "in its place each has as low a held-out error";

/// Does a curve change at steps, two knots at one place, more than between them?
fn is_stepped(knots: &[[f64; 2]]) -> bool {
    let change = |at_once: bool| -> f64 {
        let pairs = knots.windows(2).filter(|pair| (pair[0][0] == pair[1][0]) == at_once);
        pairs.map(|pair| (pair[1][1] - pair[0][1]).abs()).sum()
    };
    change(true) > change(false)
}

/// An effect that does not lower the error on the data kept for the judgement is not asserted alone: it is reported as one
/// of several possible causes. `without_gain`: those effects; all of them if the model with all effects has a larger error
/// than the base model.
fn doubt_what_does_not_help(report: &mut LearnReport, without_gain: &[&str]) {
    let is_worse = !is_no_worse(report.base_test.rmse, report.final_test.rmse);
    let in_doubt = |name: &&str| report.one_of(name).is_none() && (is_worse || without_gain.contains(name));
    let in_doubt: Vec<String> = report.names().into_iter().filter(in_doubt).map(str::to_owned).collect();
    let why = if is_worse { "the error rose" } else { "the error is no lower with it" };
    report.confounded.extend(in_doubt.into_iter().map(|name| Confounded {
        experiment: named(&name).map_or_else(String::new, |effect| effect.separated_by.to_owned()),
        names: vec![name, "a cause that the data kept for the judgement do not share".to_owned()],
        why: format!("on the data kept for the judgement {why}"),
    }));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::effects::unnamed::{BEYOND, KNOTS};
    use crate::learn::diagnose::made_data::{EACH, begun, fifths, made};
    use crate::learn::report::{Added, Errors, Unnamed};
    use crate::path::Vec3;

    /// A report with these errors on the data kept for the judgement, one effect, and a curve named after an effect,
    /// with rivals.
    fn report(before: f64, after: f64, rivals: &[&str]) -> LearnReport {
        let errors = |rmse: f64| Errors { rmse, ..Errors::default() };
        let added = |name: &str| Added {
            name: name.into(),
            parameters: Vec::new(),
            p_value: 0.0,
            test_rmse_before: before,
            test_rmse_after: after,
            evidence: String::new(),
        };
        let curve = Unnamed {
            added: added("unnamed-load-feed-per-tooth"),
            covariate: "feed per tooth".into(),
            unit: "mm".into(),
            multiplies: "load".into(),
            knots: Vec::new(),
            beside: None,
            rivals: rivals.iter().map(|rival| (*rival).to_owned()).collect(),
            family: Some("size-effect".into()),
            sentence: String::new(),
        };
        LearnReport {
            base_test: errors(before),
            final_test: errors(after),
            effects: vec![added("tool-diameter")],
            unnamed: vec![curve],
            ..LearnReport::default()
        }
    }

    /// A curve that steps at 0.
    fn step(name: &str) -> FittedEffect {
        let at = |k: usize| [-1.0, 0.0].get(k).copied().unwrap_or(BEYOND);
        let values = (0..KNOTS).map(at).chain(vec![1.0; KNOTS]).chain([1.0]).collect();
        FittedEffect { effect: named(name).unwrap(), values, free: (0..=2 * KNOTS).map(|k| k == KNOTS + 1).collect() }
    }

    /// Names of the effects after the curves of a model, the last too or not, were chosen again. The load is a fifth higher where
    /// `hard(z, is_fast)`; z, speed and milling mode alternate with different periods.
    fn chosen_again(curves: &[&str], and_last: bool, hard: impl Fn(f64, bool) -> bool) -> Vec<&'static str> {
        let turn = |i: usize, every: usize| ((i / EACH) / every).is_multiple_of(2);
        let (z, is_fast) = (|i| if turn(i, 1) { 1.0 } else { -1.0 }, |i| turn(i, 3));
        let state = |i: usize| State {
            position: Vec3::new(0.0, 0.0, z(i)),
            rps: if is_fast(i) { 150.0 } else { 90.0 },
            up_share: if turn(i, 2) { 1.0 } else { -1.0 },
            ..State::default()
        };
        let data = made(|i| if hard(z(i), is_fast(i)) { 0.2 } else { 0.0 }, 1.0, state);
        let effects: Vec<FittedEffect> = curves.iter().map(|name| step(name)).collect();
        let (split, options) = (fifths(&data), Options { candidates: Vec::new(), ..Options::default() });
        let model = fit(&data, &effects, FORM_ROUNDS).unwrap();
        let chosen = begun(&data, &split, &options, 1.0).curves_chosen_again(model, and_last);
        chosen.model.effects.iter().map(|each| each.effect.name).collect()
    }

    #[test]
    fn a_curve_gives_way_to_the_one_that_is_better_beside_what_came_later_and_stays_where_it_is_the_best() {
        let both = ["unnamed-load-z", "unnamed-load-up-share"];
        let by_speed = chosen_again(&both, false, |_, is_fast| is_fast);
        assert!(
            by_speed.contains(&"unnamed-load-spindle-speed") && !by_speed.contains(&"unnamed-load-z"),
            "{by_speed:?}"
        );
        assert_eq!(chosen_again(&both, false, |z, _| z > 0.0)[0], "unnamed-load-z");
        let last = |and_last: bool| chosen_again(&["unnamed-load-z"], and_last, |_, is_fast| is_fast);
        assert_eq!([false, true].map(last), [["unnamed-load-z"], ["unnamed-load-spindle-speed"]]);
    }

    #[test]
    fn what_raises_the_error_on_the_data_kept_is_asserted_alone_no_more() {
        let in_doubt = |after: f64, without_gain: &[&str]| {
            let mut report = report(10.0, after, &[]);
            doubt_what_does_not_help(&mut report, without_gain);
            ["tool-diameter", "size-effect"].map(|name| report.one_of(name).is_some())
        };
        assert_eq!([in_doubt(9.0, &[]), in_doubt(10.1, &[])], [[false; 2], [true; 2]]);
        assert_eq!(in_doubt(9.0, &["tool-diameter"]), [true, false]);
    }

    #[test]
    fn wear_that_comes_at_once_may_be_an_edge_that_broke_out() {
        let doubted = |family: &str, knots: &[[f64; 2]]| {
            let mut report = report(10.0, 9.0, &[]);
            (report.unnamed[0].family, report.unnamed[0].knots) = (Some(family.into()), knots.to_vec());
            doubt_families_with_rivals(&mut report);
            report.one_of(family).map(|group| group.names.clone())
        };
        let step = [[50.0, 1.0], [50.0, 1.3]];
        assert_eq!(doubted("flank-wear", &step).unwrap(), ["flank-wear", "edge-chipping"]);
        assert_eq!(doubted("flank-wear", &[[0.0, 1.0], [50.0, 1.1], [50.0, 1.15], [90.0, 1.3]]), None);
        assert_eq!(doubted("size-effect", &step), None);
    }

    #[test]
    fn a_family_is_one_of_several_where_its_curve_follows_something_else_as_well() {
        let said = |rivals: &[&str]| {
            let mut report = report(10.0, 9.0, rivals);
            doubt_families_with_rivals(&mut report);
            report.one_of("size-effect").map(|group| group.names.clone())
        };
        assert_eq!(said(&[]), None);
        assert_eq!(said(&["tool"]).unwrap(), ["size-effect", "a curve of the load along tool"]);
    }
}
