//! Effects that change from one set-up of a table to the next alone. In: a diagnosis, a trial. Out: whether cuts left out
//! one at a time bear it out, and the drift between set-ups that it cannot be told from.
//!
//! Of such an effect a table with eight set-ups holds eight cases, whatever its number of cuts, and the tare of each set-up
//! may have drifted besides. Left out whole, they seldom lower the error by more than its own uncertainty; the cuts do.

use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::evidence::Present;
use crate::learn::diagnose::trial::Trial;
use crate::learn::model::cross_validation::{
    Split, held_out_residuals, improvement_by_block, improvement_by_case, t_statistic,
};
use crate::learn::model::fit::Fitted;
use crate::learn::report::Confounded;

/// How the rival is called.
const DRIFT: &str = "drift from set-up to set-up";

impl Diagnosis<'_> {
    /// Do cuts left out one at a time bear out what only changes between set-ups? `drop`: of the error over set-ups left
    /// out whole, which may not rise.
    pub(in crate::learn) fn lowers_cut_by_cut(&self, present: &Fitted, trial: &Trial, drop: f64) -> bool {
        if !self.criteria().lowers_elsewhere(drop) || !self.is_of_set_ups(trial) {
            return false;
        }
        let by_cut = Split { fold: (0..self.data.len()).collect(), folds: self.data.len(), ..self.split.clone() };
        let [before, after] =
            [present, &trial.fitted].map(|fitted| held_out_residuals(&self.train, &fitted.model.effects, &by_cut));
        let t = t_statistic(&improvement_by_case(&self.train, &before, &after));
        self.criteria().lowers_held_out_beside(self.drop_of(&before, &after), t)
    }

    /// The drift that an accepted trial cannot be told from: set-ups left out whole do not bear it out.
    pub(in crate::learn) fn drift(&self, present: &Present, trial: &Trial, after: &[f64]) -> Option<Confounded> {
        let t = t_statistic(&improvement_by_block(&self.train, &present.left, after));
        if !self.is_of_set_ups(trial) || self.criteria().lowers_held_out(self.drop_of(&present.left, after), t) {
            return None;
        }
        Some(Confounded {
            names: vec![trial.effect.name.to_owned(), DRIFT.to_owned()],
            why:
                "each set-up has it in one way only, and set-ups left out whole bear it out by less than their scatter"
                    .to_owned(),
            experiment: format!("an air cut before each set-up; {}", trial.effect.separated_by),
        })
    }

    /// Does what the effect of a trial follows change between set-ups of several cuts alone?
    pub(in crate::learn) fn is_of_set_ups(&self, trial: &Trial) -> bool {
        let set_ups = self.train.blocks();
        !self.data.is_series()
            && set_ups.len() * 2 <= self.train.used().count()
            && self.is_steady_in_each(trial.effect.covariates, &self.data.block, &set_ups)
    }
}
