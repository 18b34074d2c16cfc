//! The tests that a candidate must pass to be named. In: the diagnosis, the model so far, a candidate fitted on top of
//! it. Out: its held-out residuals, or why it is rejected.
//!
//! 1. Its score is above the threshold and its parameters are physical.
//! 2. It removes enough of the excess over the noise and lowers the held-out error significantly.
//! 3. If it begins at an instant, that does not lie between operations or set-ups ([`super::accidents`]).
//! 4. It changes the load by more than the engagement is uncertain.
//! 5. It still lowers the held-out error when curves correct the laws of the effects before it.
//! 6. No curve over a covariate that it does not depend on explains more.
//! 7. It does not raise the error on other kinds of cuts.
//!
//! The thresholds are those of [`super::criteria`].

use crate::effects::{Covariate, Effect, Multiplies};
use crate::learn::dataset::errors::errors;
use crate::learn::dataset::samples::Class;
use crate::learn::diagnose::candidates::why_not;
use crate::learn::diagnose::criteria::{Criteria, is_taken_away};
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::trial::{Trial, best_trial, unphysical};
use crate::learn::diagnose::unnamed::ResidualCurve;
use crate::learn::diagnose::which_curve::{only_grows, rank};
use crate::learn::model::cross_validation::{
    held_out_residuals, improvement_by_block, improvement_by_case, t_statistic,
};
use crate::learn::model::fit::{Fitted, part};
use crate::learn::report::Rejected;
use rayon::prelude::*;

/// Does an effect of the model make this part of the reading depend on the covariate?
fn knows(model: &Fitted, covariate: Covariate, part: Multiplies) -> bool {
    model.model.effects.iter().any(|each| each.effect.knows(covariate, part))
}

/// Is it where the tool is?
pub(in crate::learn) fn is_place(covariate: Covariate) -> bool {
    matches!(covariate, Covariate::X | Covariate::Y | Covariate::Z)
}

/// Best curves that a trial is compared with.
const RIVAL_CURVES: usize = 4;

/// The model so far, and what its trials are compared with.
pub(in crate::learn) struct Present<'a> {
    /// The model so far.
    pub(in crate::learn) model: &'a Fitted,
    /// Its held-out residuals.
    pub(in crate::learn) left: Vec<f64>,
    /// The same less the best curve over covariates of its effects, if that is clearly better.
    less_best_curve: Vec<f64>,
    /// Curves over other covariates that its held-out residuals follow, best first.
    pub(in crate::learn) curves: Vec<ResidualCurve>,
}

impl Diagnosis<'_> {
    /// See [`Present`].
    pub(in crate::learn) fn present<'m>(&self, model: &'m Fitted) -> Present<'m> {
        let left = held_out_residuals(&self.train, &model.model.effects, self.split);
        let less_best_curve = self.less_best_curve(model, &left, |covariate, part| knows(model, covariate, part));
        // As a rival a curve may have any shape: even an implausible one shows that there is another cause.
        let others = |covariate, part| !knows(model, covariate, part);
        let curves = self.curves_of_shapes(model, &left, others, |_, _| true);
        Present { model, left, less_best_curve, curves }
    }

    /// Every candidate fitted on top of the present model; `note`: record those that the data cannot show.
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
        if let Some(known) = self.cache.trials(present) {
            return known.to_vec();
        }
        let train = &self.train;
        let tried: Vec<(usize, Option<Trial>)> =
            open.par_iter().map(|effect| best_trial(train, present, &present.model.effects, effect)).collect();
        self.tried += tried.iter().map(|(count, _)| count).sum::<usize>();
        let trials: Vec<Trial> = tried.into_iter().filter_map(|(_, trial)| trial).collect();
        self.cache.keep_trials(present, &trials);
        trials
    }

    /// Held-out residuals of a trial, or why it is rejected.
    pub(in crate::learn) fn tested(&mut self, present: &Present, trial: &Trial) -> Result<Vec<f64>, String> {
        if trial.score < self.threshold() {
            return Err(format!("it explains too little for its parameters (score {:.1})", trial.score));
        }
        if let Some(why) = unphysical(trial.fitted.model.effects.last(), self.data) {
            return Err(why);
        }
        if let Some(name) = self.edge_without_load(present.model, trial) {
            return Err(format!("beside it {name} would be 0, and every edge rubs"));
        }
        let before = &present.left;
        let after = self.held_out_of_trial(present.model, trial);
        let drop = self.drop_of(before, &after);
        // A covariate that is constant within a set-up gives one independent case per set-up.
        let by = if self.varies_between_set_ups_only(trial) { improvement_by_block } else { improvement_by_case };
        let t = t_statistic(&by(&self.train, before, &after));
        let share = self.share_of_excess(before, &after, &self.base_residual, self.criteria().least_excess);
        let of_rest = self.share_of_excess(before, &after, before, self.criteria().noise_known_to);
        if !self.criteria().takes_enough(share, of_rest) {
            return Err(format!(
                "it removes only {:.1} % of what the base model leaves beyond the noise",
                100.0 * share
            ));
        }
        if !self.criteria().lowers_clearly(drop, t, trial.score) && !self.lowers_cut_by_cut(present.model, trial, drop)
        {
            return Err(format!("it does not clearly lower the held-out error ({:+.2} %, t = {t:.1})", -100.0 * drop));
        }
        if let Some(why) = self.why_between_cuts(trial, before) {
            return Err(why);
        }
        let change = self.change_of_load(present.model, before, &after);
        if change < self.criteria().engagement_known_to {
            return Err(format!(
                "it changes the load by {:.2} %, less than the uncertainty of the engagement ({:.1} %)",
                100.0 * change,
                100.0 * self.criteria().engagement_known_to
            ));
        }
        let misfit = self.misfit_of_form(present, trial, &after).or_else(|| self.stands_in(present, trial, &after));
        misfit.or_else(|| self.harms_another_kind(present.model, trial)).map_or(Ok(after), Err)
    }

    /// The edge coefficient that an effect takes the load of, if it does. A law of the chip thickness can stand for the edges, but no tool cuts
    /// without them.
    fn edge_without_load(&self, present: &Fitted, trial: &Trial) -> Option<&str> {
        let of_edge = |b: &usize| self.data.base[*b].class == Class::Edge;
        let taken = |b: &usize| is_taken_away(present.model.base[*b], trial.fitted.model.base[*b]);
        (0..self.data.base.len()).filter(of_edge).find(taken).map(|b| self.data.base[b].name.as_str())
    }

    /// (mean `before`² − mean `after`²) / max(mean `whole`² − σ², `least` · mean `whole`²), σ being the noise floor.
    pub(in crate::learn) fn share_of_excess(&self, before: &[f64], after: &[f64], whole: &[f64], least: f64) -> f64 {
        let mean = |r: &[f64]| errors(&self.train, |i| r[i]).rmse.powi(2);
        let excess = mean(whole) - self.floor.powi(2);
        (mean(before) - mean(after)) / excess.max(least * mean(whole))
    }

    /// √((Σ w `before`² − Σ w `after`²) / Σ w l²), l being the load of the cut. An engagement with a relative error ε
    /// leaves squares of Σ w (ε l)²; an effect that only fits these errors has a value of at most ε.
    pub(in crate::learn) fn change_of_load(&self, present: &Fitted, before: &[f64], after: &[f64]) -> f64 {
        let load = self.cut_load(present);
        let known = |i: usize| before[i].is_finite() && after[i].is_finite();
        let used: Vec<usize> = self.train.used().filter(|i| known(*i)).collect();
        let sum = |of: &dyn Fn(usize) -> f64| used.iter().map(|&i| self.train.weight[i] * of(i)).sum::<f64>();
        let removed = sum(&|i| before[i].powi(2) - after[i].powi(2)).max(0.0);
        (removed / sum(&|i| load[i].powi(2)).max(1e-300)).sqrt()
    }

    /// Is the excess over the noise still more than a small share of that of the base model? The noise is taken at its
    /// upper bound, autocorrelated.
    pub(in crate::learn) fn leaves_much(&self, after: &[f64]) -> bool {
        let noise = self.criteria().noise_with_memory * self.floor.powi(2);
        let beyond = |r: &[f64]| (errors(&self.train, |i| r[i]).rmse.powi(2) - noise).max(0.0);
        self.floor > 0.0 && self.criteria().leaves_much(beyond(&self.base_residual), beyond(after))
    }

    /// Load of the cut predicted by a model: the readings without the tare.
    pub(in crate::learn) fn cut_load(&self, fitted: &Fitted) -> Vec<f64> {
        part(&self.train, fitted, &[Class::Cutting, Class::Edge])
    }

    /// Why the trial only corrects the laws of the effects before it: it does not lower the held-out error once a curve
    /// over their covariates corrects them.
    fn misfit_of_form(&self, present: &Present, trial: &Trial, after: &[f64]) -> Option<String> {
        if present.model.model.effects.is_empty() {
            return None;
        }
        let before = &present.less_best_curve;
        let theirs = |covariate, part| knows(present.model, covariate, part) && !trial.effect.knows(covariate, part);
        let after = self.less_best_curve(&trial.fitted, after, theirs);
        let drop = self.drop_of(before, &after);
        let t = t_statistic(&improvement_by_case(&self.train, before, &after));
        let rest = self.share_of_excess(before, &after, before, self.criteria().noise_known_to);
        let share = self.share_of_excess(before, &after, &self.base_residual, self.criteria().least_excess);
        // In a log an effect may show in few passes (a face that stands proud), so that its t is small; its rivals are
        // compared with it at the end. A table has too few cuts for that comparison.
        let lowers = if self.data.is_series() { Criteria::lowers_held_out } else { Criteria::lowers_held_out_beside };
        (!lowers(self.criteria(), drop, t) || !self.criteria().takes_enough(share, rest)).then(|| {
            format!(
                "beside the effects found before it, with curves that correct their laws, it lowers the held-out error \
                 by {:.2} % (t = {t:.1})",
                100.0 * drop
            )
        })
    }

    /// Why the trial is only a proxy for another cause: a curve along a covariate that it does not depend on explains
    /// more than the trial with a curve that corrects its law. So does one along a place that the effect depends on, if it explains more than the
    /// law and the law adds nothing to it: of stock that stands elsewhere and of a region the law says which cuts at that place differ, and a layer
    /// or a side of the part where all do is neither. For an effect whose covariates only grow while the
    /// program runs, a curve over a quantity of the process that explains as much is enough.
    pub(in crate::learn) fn stands_in(&self, present: &Present, trial: &Trial, after: &[f64]) -> Option<String> {
        let own = |covariate, part| trial.effect.knows(covariate, part);
        let shaped = self.less_best_curve(&trial.fitted, after, own);
        let others = present.curves.iter().filter(|found| !own(found.covariate, found.effect.multiplies));
        let is_late = trial.effect.covariates.iter().all(|covariate| only_grows(*covariate));
        let of_place =
            |found: &&ResidualCurve| own(found.covariate, found.effect.multiplies) && is_place(found.covariate);
        let does_without = present
            .curves
            .iter()
            .filter(of_place)
            .take(RIVAL_CURVES)
            .find(|found| self.is_better(after, &found.fit.left) && !self.is_better(&found.fit.left, &shaped));
        if let Some(found) = does_without {
            return Some(format!(
                "a curve along {} explains more, and as much as this effect with a curve that corrects its law",
                found.covariate.name()
            ));
        }
        let better = others.take(RIVAL_CURVES).find(|found| {
            let left = &found.fit.left;
            if is_late && rank(found.covariate) == 0 {
                return !self.is_better(left, after);
            }
            self.is_better(&shaped, left)
        })?;
        let share = |left: &[f64]| 100.0 * (1.0 - self.drop_of(&present.left, left)).powi(2);
        Some(format!(
            "a curve along {} leaves {:.0} % of the squares, this effect with a curve that corrects its law {:.0} %",
            better.covariate.name(),
            share(&better.fit.left),
            share(&shaped)
        ))
    }
}

#[cfg(test)]
mod tests {
    use crate::effects::{State, named};
    use crate::learn::dataset::samples::Data;
    use crate::learn::diagnose::diagnosis::Options;
    use crate::learn::diagnose::made_data::{EACH, begun, fifths, made};
    use crate::learn::model::fit::fit;
    use crate::path::Vec3;

    /// Passes along X, one a block; where `hard` is true, the load is larger by the share `excess` between 30 and 70
    /// mm.
    fn passes(hard: impl Fn(usize) -> bool, excess: f64, noise: f64) -> Data {
        let x_mm = |i: usize| 100.0 * (i % EACH) as f64 / EACH as f64;
        let share = |i: usize| if hard(i / EACH) && (30.0..70.0).contains(&x_mm(i)) { excess } else { 0.0 };
        let state = |i: usize| State {
            time_s: i as f64,
            position: Vec3::new(x_mm(i), 5.0 * (i / EACH) as f64, 0.0),
            ..State::default()
        };
        made(share, noise, state)
    }

    /// Passes along X, one a block, in all of which the load is larger by `share(x)`.
    fn alike(share: impl Fn(f64) -> f64) -> Data {
        let x_mm = |i: usize| 100.0 * (i % EACH) as f64 / EACH as f64;
        let state = |i: usize| State {
            time_s: i as f64,
            position: Vec3::new(x_mm(i), 5.0 * (i / EACH) as f64, 0.0),
            ..State::default()
        };
        made(|i| share(x_mm(i)), 1.0, state)
    }

    /// Does a hard zone pass the tests?
    fn is_shown(data: &Data, noise: f64) -> bool {
        let split = fifths(data);
        let options = Options { candidates: vec![named("hard-zone").unwrap()], ..Options::default() };
        let plain = fit(data, &[], 0).unwrap();
        let mut diagnosis = begun(data, &split, &options, noise);
        let trials = diagnosis.trials(&plain, false);
        let present = diagnosis.present(&plain);
        trials.iter().any(|trial| diagnosis.tested(&present, trial).is_ok())
    }

    #[test]
    fn an_effect_is_named_only_by_what_it_shows_on_data_left_out() {
        // The zone crosses several neighbouring passes: when one is left out, the others still show it.
        assert!(is_shown(&passes(|block| (8..16).contains(&block), 0.2, 1.0), 1.0));
        // The zone lies in one pass: the fit to the others cannot predict it.
        assert!(!is_shown(&passes(|block| block == 11, 0.2, 1.0), 1.0));
    }

    #[test]
    fn a_region_that_a_curve_along_one_axis_does_without_is_not_shown() {
        assert!(is_shown(&passes(|block| (8..16).contains(&block), 0.2, 1.0), 1.0));
        // Harder and harder along X: a region takes a part of that, and adds nothing to a curve along X.
        assert!(!is_shown(&alike(|x_mm| 0.3 * (x_mm / 100.0).powi(2)), 1.0));
    }

    #[test]
    fn what_the_engagement_may_be_off_by_is_no_effect_however_clearly_it_shows() {
        let zone = |excess: f64| is_shown(&passes(|block| (8..16).contains(&block), excess, 0.01), 0.01);
        assert!(zone(0.02) && !zone(0.002));
    }
}
