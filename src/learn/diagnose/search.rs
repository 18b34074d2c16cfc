//! From data to named effects: forward selection by score and cross-validation, then pruning. In: [`Data`] and a
//! [`Split`]. Out: a [`LearnReport`].
//!
//! 1. The base model is fitted on the training blocks and judged on the others.
//!    Effects on the tare that the readings without a cut show come first ([`super::idle`]).
//! 2. Every candidate is fitted together with the effects already in the model. Its gain is G = n/φ · ln(RSS₀/RSS₁),
//!    with φ the inflation of the residual it leaves (neighbouring samples with a common error count as one); its score
//!    is G − k ln(n/φ) for k parameters (Bayesian information criterion, Schwarz 1978).
//! 3. Of those that pass every test of [`super::evidence`] (score, physical parameters, held-out error, no better curve
//!    along a covariate that it does not depend on, no harm to kinds of cuts it was not fitted on) that of least held-out
//!    error is added.
//!    Where several pass at first, the search is run from each ([`super::ways`]).
//! 4. If no single one passes, pairs are tried: each may mask the other in the fit ([`super::pairs`]).
//! 5. Each effect must still earn its score beside those added later ([`super::pruning`]). Then each named effect is compared with
//!    everything that can replace it ([`super::contest`]): a clearly better rival replaces it and the search continues;
//!    an equal one is reported beside it.
//! 6. When no effect of the list can be added, the curve over a covariate that lowers the held-out error most is added
//!    without a name ([`super::unnamed`]); the list is tried again beside it, the curves are chosen again, and step 5
//!    is repeated. Structure that remains is reported and refutes nothing that was found.
//!    Then one curve is tried in the place of a name and its curves ([`super::one_cause`]).
//! 7. Base terms that a table does not determine are left out if it is predicted better without them
//!    ([`super::undetermined_terms`]).
//! 8. If the error on the data kept for the judgement rose, the curves without a name that raise it are taken back
//!    ([`super::contradicted`]).

use crate::effects::Acts;
use crate::learn::dataset::samples::Data;
use crate::learn::diagnose::answer::{unexplained, verdict};
use crate::learn::diagnose::ceiling::without_ceilings;
use crate::learn::diagnose::contest::Outcome;
use crate::learn::diagnose::diagnosis::{Diagnosis, Options};
use crate::learn::diagnose::evidence::Present;
use crate::learn::diagnose::forms::{FORM_ROUNDS, remove};
use crate::learn::diagnose::free_curve::along_all;
use crate::learn::diagnose::in_doubt::{doubt_families_with_rivals, doubt_what_does_not_help};
use crate::learn::diagnose::outlying::{cost, outlying, without as without_cuts};
use crate::learn::diagnose::residual::{noise_floor, noise_with_memory};
use crate::learn::diagnose::trial::{Trial, p_value};
use crate::learn::diagnose::trial_cache::TrialCache;
use crate::learn::diagnose::undetermined_terms::Reduced;
use crate::learn::diagnose::unnamed::{is_unnamed, with_predicted_loads};
use crate::learn::model::cross_validation::{Split, held_out_residuals, improvement_by_case, t_statistic, without};
use crate::learn::model::design::{FittedEffect, in_quantity_of};
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::model::whitening::{weighed_by, whitened};
use crate::learn::report::{Confounded, LearnReport};

/// Most named effects that are replaced by a rival.
const EXCHANGES: usize = 3;

/// Most curves without a name.
const MOST_CURVES: usize = 2;

/// A trial that passes every test, and its held-out residuals.
#[derive(Clone)]
pub(in crate::learn) struct Passed {
    pub(in crate::learn) trial: Trial,
    pub(in crate::learn) left: Vec<f64>,
}

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
    let (fitted, mut confounded) = search.least_of_the_ways(&begin);
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
    doubt_what_does_not_help(&mut report, last.are_refuted_together(&fitted), &last.refuted(&fitted));
    report.unexplained = unexplained(&reduced, &fitted, &report, options.seed);
    report.verdict = verdict(&report);
    Some((report, fitted.model.effects))
}

impl Diagnosis<'_> {
    /// The model at the end of a search that begins with an effect, if one passes every test, and what its effects are confounded with.
    /// Rivals are compared before curves are added: a curve beside a wrong effect would correct its error and hide that it is wrong.
    pub(in crate::learn) fn search_after(
        &mut self,
        begin: &Fitted,
        first: Option<Passed>,
    ) -> (Fitted, Vec<Confounded>) {
        let mut confounded: Vec<Confounded> = Vec::new();
        let named = self.names_after(begin, first, &mut confounded);
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
        }
        if let Some(one) = self.one_curve_for_both(&found) {
            (found, in_doubt) = self.contested_until_stable(one, 0, &mut confounded);
        }
        for group in in_doubt {
            add_to(&mut confounded, group);
        }
        (found, confounded)
    }

    /// The names found without curves of their own, and the names of those that are in doubt.
    pub(in crate::learn) fn names_alone(&mut self, base: &Fitted) -> (Fitted, Vec<String>) {
        let mut confounded: Vec<Confounded> = Vec::new();
        let first = self.passing(base, true).into_iter().next();
        let named = self.names_after(base, first, &mut confounded);
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
                    let named = self.add_names(&exchanged, confounded);
                    let added = self.add_curves(&named, confounded).unwrap_or(named);
                    found = self.prune(added);
                }
            }
        }
        (found, Vec::new())
    }

    /// The base model with the effect that comes first and those that pass beside it; with a pair, if none passes alone.
    fn names_after(&mut self, base: &Fitted, first: Option<Passed>, confounded: &mut Vec<Confounded>) -> Fitted {
        let one = first.map(|first| self.with_passed(base, first, confounded));
        match one.or_else(|| self.pair(base)) {
            Some(begun) => self.add_names(&begun, confounded),
            None => base.clone(),
        }
    }

    /// Adds effects of the list one after the other until none passes.
    fn add_names(&mut self, base: &Fitted, confounded: &mut Vec<Confounded>) -> Fitted {
        let mut found = base.clone();
        while names_of(&found) < self.options.max_effects {
            let Some(next) = self.passing(&found, false).into_iter().next() else { break };
            found = self.with_passed(&found, next, confounded);
        }
        found
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
            found = Some(self.add_names(&curve, confounded));
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

    /// The effects of the list that pass every test beside a model, the best first.
    pub(in crate::learn) fn passing(&mut self, model: &Fitted, note: bool) -> Vec<Passed> {
        let mut trials = self.trials(model, note);
        trials.sort_by(|a, b| b.score.total_cmp(&a.score));
        let present = self.present(model);
        self.best_first(&present, trials)
    }

    /// The model with an effect that passed; notes what shows it, and what it is confounded with.
    fn with_passed(&mut self, model: &Fitted, passed: Passed, confounded: &mut Vec<Confounded>) -> Fitted {
        let Passed { trial, left } = passed;
        let present = self.present(model);
        let text = format!(
            "lowers the error on left-out blocks by {:.1} % (t = {:.1}), score {:.1}",
            100.0 * self.drop_of(&present.left, &left),
            t_statistic(&improvement_by_case(&self.train, &present.left, &left)),
            trial.score
        );
        let errors = [&model.model.effects, &trial.fitted.model.effects].map(|each| self.judgement_errors(each).rmse);
        self.evidence.push((trial.effect.name, text, self.p_of_the_search(&trial), errors));
        self.rejected.retain(|r| r.name != trial.effect.name);
        confounded.retain(|c| !c.names.iter().any(|name| name == trial.effect.name));
        confounded.extend(self.drift(&present, &trial, &left));
        confounded.extend(self.accident_or_difference(&present, &trial));
        self.with_best_shape(trial.fitted)
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

    /// Those of these trials, highest score first, that pass every test; at their head the one that leaves the least held-out error. Scores are
    /// no measure between them, as each has the inflation of its own residual in it.
    fn best_first(&mut self, present: &Present, trials: Vec<Trial>) -> Vec<Passed> {
        let mut passed: Vec<Passed> = Vec::new();
        for trial in trials {
            match self.accepted(present, &trial) {
                Ok(left) => passed.push(Passed { trial, left }),
                Err(why) => self.reject(&trial, why),
            }
        }
        let drops: Vec<f64> = passed.iter().map(|each| self.drop_of(&present.left, &each.left)).collect();
        if let Some(best) = (0..drops.len()).max_by(|a, b| drops[*a].total_cmp(&drops[*b])) {
            passed[..=best].rotate_right(1);
        }
        passed
    }

    /// Held-out residuals of a trial that passes every test, or why it does not.
    fn accepted(&mut self, present: &Present, trial: &Trial) -> Result<Vec<f64>, String> {
        let after = self.tested(present, trial)?;
        let p_value = self.p_of_the_search(trial);
        if !present.model.model.effects.is_empty() && self.criteria().may_be_chance(p_value) {
            return Err(format!("among {} models tried such a gain comes by chance (p = {p_value:.2})", self.tried));
        }
        Ok(after)
    }

    /// p value of the gain of a trial, multiplied by the number of models fitted (Bonferroni).
    pub(in crate::learn) fn p_of_the_search(&self, trial: &Trial) -> f64 {
        (p_value(trial) * self.tried.max(1) as f64).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::unnamed::{BEYOND, KNOTS};
    use crate::effects::{State, named};
    use crate::learn::diagnose::made_data::{EACH, begun, fifths, made};
    use crate::learn::diagnose::trial::best_trial;
    use crate::path::Vec3;

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
    fn of_trials_that_pass_the_one_of_least_held_out_error_is_added_whatever_its_score() {
        // Up and climb milling differ a little more than fast and slow cuts do, or a little less.
        let turn = |i: usize, every: usize| if ((i / EACH) / every).is_multiple_of(2) { 1.0 } else { -1.0 };
        let state = |i: usize| State {
            time_s: i as f64,
            up_share: turn(i, 1),
            up_share_chip: turn(i, 1),
            cutting_speed_mm_s: 3000.0 + 1000.0 * turn(i, 2),
            rps: 90.0 + 30.0 * turn(i, 2),
            ..State::default()
        };
        let first_of = |shares: [f64; 2], scores: [f64; 2], is_useless: [bool; 2]| {
            let data = made(|i| shares[0] * turn(i, 1) + shares[1] * turn(i, 2), 1.0, state);
            let (split, options) = (fifths(&data), Options { candidates: Vec::new(), ..Options::default() });
            let mut diagnosis = begun(&data, &split, &options, 1.0);
            let plain = fit(&data, &[], FORM_ROUNDS).unwrap();
            let trial = |k: usize| {
                let name = ["up-down-asymmetry", "cutting-speed"][k];
                let found = best_trial(&data, &plain, &[], named(name).unwrap()).1.unwrap();
                let fitted = if is_useless[k] { plain.clone() } else { found.fitted };
                Trial { score: scores[k], fitted, ..found }
            };
            let mut trials = vec![trial(0), trial(1)];
            trials.sort_by(|a, b| b.score.total_cmp(&a.score));
            let present = diagnosis.present(&plain);
            diagnosis.best_first(&present, trials)[0].trial.effect.name
        };
        for scores in [[200.0, 100.0], [100.0, 200.0]] {
            assert_eq!(first_of([0.102, 0.1], scores, [false; 2]), "up-down-asymmetry");
            assert_eq!(first_of([0.1, 0.102], scores, [false; 2]), "cutting-speed");
        }
        // One that does not pass is not added.
        assert_eq!(first_of([0.1, 0.102], [100.0, 300.0], [false, true]), "up-down-asymmetry");
    }
}
