//! Effects whose covariate is constant within each set-up of a table. In: a diagnosis, a trial. Out: whether cuts left
//! out one at a time confirm it, and the drift between set-ups that it is confounded with.
//!
//! For such an effect a table of eight set-ups holds eight independent cases, however many cuts it has, and the tare
//! may have drifted from set-up to set-up as well. With whole set-ups left out the drop of the error is rarely
//! significant; with single cuts it can be.

use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::evidence::Present;
use crate::learn::diagnose::trial::Trial;
use crate::learn::model::cross_validation::{
    Split, held_out_residuals, improvement_by_block, improvement_by_case, t_statistic,
};
use crate::learn::model::fit::Fitted;
use crate::learn::report::Confounded;

/// Name of the rival.
const DRIFT: &str = "drift from set-up to set-up";

impl Diagnosis<'_> {
    /// Does an effect that only changes between set-ups lower the error over cuts left out one at a time? `drop`:
    /// relative fall of the error over whole set-ups left out, which has to be positive too.
    pub(in crate::learn) fn lowers_cut_by_cut(&self, present: &Fitted, trial: &Trial, drop: f64) -> bool {
        if !self.criteria().lowers_elsewhere(drop) || !self.varies_between_set_ups_only(trial) {
            return false;
        }
        let by_cut = Split { fold: (0..self.data.len()).collect(), folds: self.data.len(), ..self.split.clone() };
        let [before, after] =
            [present, &trial.fitted].map(|fitted| held_out_residuals(&self.train, &fitted.model.effects, &by_cut));
        let t = t_statistic(&improvement_by_case(&self.train, &before, &after));
        self.criteria().lowers_held_out_beside(self.drop_of(&before, &after), t)
    }

    /// The drift that an accepted trial is confounded with, if whole set-ups left out do not confirm it.
    pub(in crate::learn) fn drift(&self, present: &Present, trial: &Trial, after: &[f64]) -> Option<Confounded> {
        let t = t_statistic(&improvement_by_block(&self.train, &present.left, after));
        if !self.varies_between_set_ups_only(trial)
            || self.criteria().lowers_held_out(self.drop_of(&present.left, after), t)
        {
            return None;
        }
        Some(Confounded {
            names: vec![trial.effect.name.to_owned(), DRIFT.to_owned()],
            why:
                "its covariate is constant within each set-up, and the error over whole set-ups falls by less than its \
                 scatter"
                    .to_owned(),
            experiment: format!("an air cut before each set-up; {}", trial.effect.separated_by),
        })
    }

    /// Is every covariate of the effect constant within set-ups, in a table with at least two cuts per set-up on
    /// average?
    pub(in crate::learn) fn varies_between_set_ups_only(&self, trial: &Trial) -> bool {
        let set_ups = self.train.blocks();
        !self.data.is_series()
            && set_ups.len() * 2 <= self.train.used().count()
            && self.is_steady_in_each(trial.effect.covariates, &self.data.block, &set_ups)
    }
}
