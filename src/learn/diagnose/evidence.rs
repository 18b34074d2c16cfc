//! What a candidate has to show to be named. In: the diagnosis, the model so far, a candidate fitted on top of it. Out:
//! what it leaves on data left out, or why that is no effect.
//!
//! Its score pays for its parameters, they are physical, it takes away enough of what is left, on data left out too and
//! more than errors of the engagement can; no pattern without a name does better, and no other kind of cut gets worse.
//! The thresholds are those of [`super::criteria`].

use crate::effects::{Covariate, Effect};
use crate::learn::dataset::errors::errors;
use crate::learn::dataset::samples::Class;
use crate::learn::diagnose::candidates::why_not;
use crate::learn::diagnose::criteria::{
    ENGAGEMENT_KNOWN_TO, LEAST_EXCESS, NOISE_KNOWN_TO, NOISE_WITH_MEMORY, leaves_much, lowers_held_out, takes_enough,
};
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::trial::{Trial, best_trial, unphysical};
use crate::learn::diagnose::unnamed::{FreePatterns, better_pattern, unrelated_covariates};
use crate::learn::model::cross_validation::{improvement_by_block, t_statistic};
use crate::learn::model::fit::{Fitted, part};
use crate::learn::report::Rejected;
use rayon::prelude::*;

impl Diagnosis<'_> {
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
        let of_rest = self.share_of_excess(before, &after, before, NOISE_KNOWN_TO);
        if !takes_enough(share, of_rest) {
            return Err(format!("it takes away only {:.1} % of what the base model leaves", 100.0 * share));
        }
        if !lowers_held_out(drop, t) {
            return Err(format!("it does not lower the held-out error ({:+.2} %, t = {t:.1})", -100.0 * drop));
        }
        let change = self.change_of_load(present, before, &after);
        if change < ENGAGEMENT_KNOWN_TO {
            return Err(format!(
                "it changes the load by {:.2} %, and the engagement is known to {:.1} %",
                100.0 * change,
                100.0 * ENGAGEMENT_KNOWN_TO
            ));
        }
        let misfit = self.misfit_of_form(present, trial, before, &after);
        misfit.or_else(|| self.harms_another_kind(present, trial)).map_or(Ok(after), Err)
    }

    /// Held-out squares that go from `before` to `after`, over those of `whole` beyond the noise, which are taken as no
    /// less than the share `least` of `whole`.
    pub(in crate::learn) fn share_of_excess(&self, before: &[f64], after: &[f64], whole: &[f64], least: f64) -> f64 {
        let mean = |r: &[f64]| errors(&self.train, |i| r[i]).rmse.powi(2);
        let excess = mean(whole) - self.floor.powi(2);
        (mean(before) - mean(after)) / excess.max(least * mean(whole))
    }

    /// Root of the held-out squares that go from `before` to `after` over those of the load of the cut. Whatever an
    /// engagement that is off by a share ε of every load leaves, Σ w (ε l)² is all that can be taken away by following
    /// it.
    pub(in crate::learn) fn change_of_load(&self, present: &Fitted, before: &[f64], after: &[f64]) -> f64 {
        let load = self.cut(present);
        let known = |i: usize| before[i].is_finite() && after[i].is_finite();
        let used: Vec<usize> = self.train.used().filter(|i| known(*i)).collect();
        let sum = |of: &dyn Fn(usize) -> f64| used.iter().map(|&i| self.train.weight[i] * of(i)).sum::<f64>();
        let removed = sum(&|i| before[i].powi(2) - after[i].powi(2)).max(0.0);
        (removed / sum(&|i| load[i].powi(2)).max(1e-300)).sqrt()
    }

    /// Is what is left beyond any noise more than a small share of what the base model leaves beyond it?
    pub(in crate::learn) fn leaves_much(&self, after: &[f64]) -> bool {
        let noise = NOISE_WITH_MEMORY * self.floor.powi(2);
        let beyond = |r: &[f64]| (errors(&self.train, |i| r[i]).rmse.powi(2) - noise).max(0.0);
        self.floor > 0.0 && leaves_much(beyond(&self.base_residual), beyond(after))
    }

    /// Load of the cut by a model.
    pub(in crate::learn) fn cut(&self, fitted: &Fitted) -> Vec<f64> {
        part(&self.train, fitted, &[Class::Cutting, Class::Edge])
    }

    /// Does a free pattern along what the effects before it depend on explain more than the trial?
    pub(in crate::learn) fn misfit_of_form(
        &self,
        present: &Fitted,
        trial: &Trial,
        before: &[f64],
        after: &[f64],
    ) -> Option<String> {
        let known = present.model.effects.iter().flat_map(|u| u.effect.covariates.iter().copied());
        let own: Vec<Covariate> = known.filter(|c| !trial.effect.covariates.contains(c)).collect();
        let load = self.cut(present);
        let free = FreePatterns { data: &self.train, split: self.split, load: &load };
        let (along, [pattern, named]) = better_pattern(&free, &own, before, after)?;
        Some(format!(
            "what the effects before it leave follows {}, as they do: a free pattern along that leaves {:.0} % of it, this effect {:.0} %",
            along.name(),
            100.0 * pattern,
            100.0 * named
        ))
    }

    /// Why the effects found only stand in for something else: a free pattern along what none of them depends on
    /// explains more than all of them.
    pub(in crate::learn) fn stand_in(&self, base: &Fitted, fitted: &Fitted, after: &[f64]) -> Option<String> {
        let load = self.cut(base);
        let free = FreePatterns { data: &self.train, split: self.split, load: &load };
        let covariates = unrelated_covariates(&fitted.model.effects);
        let (along, [pattern, named]) = better_pattern(&free, &covariates, &self.base_residual, after)?;
        Some(format!(
            "a free pattern along {} leaves {:.0} % of the squares of the base model, all effects found together {:.0} %",
            along.name(),
            100.0 * pattern,
            100.0 * named
        ))
    }
}
