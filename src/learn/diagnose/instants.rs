//! Accidents at an instant. In: a trial of an effect that begins at an instant, what is left before it. Out: why it is none, or
//! what it cannot be told from.
//!
//! Operations differ, and so do the set-ups of a table: by their tool, their coolant, their clamping. What begins where one ends
//! and the next begins may be what they differ by. So may what takes nearly as much when it begins there: of a log that is said
//! beside its name, as the load of a broken edge is the safe one to reckon with.

use crate::effects::Place;
use crate::learn::diagnose::criteria::PLACED_BY;
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::evidence::Present;
use crate::learn::diagnose::forms::FORM_ROUNDS;
use crate::learn::diagnose::trial::Trial;
use crate::learn::model::cross_validation::held_out_residuals;
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::report::Confounded;

impl Diagnosis<'_> {
    /// Why what begins at an instant is no accident: no operation is cut both before and after it, or in a table it may as well
    /// lie between two set-ups.
    pub(in crate::learn) fn between_cuts(&self, trial: &Trial, before: &[f64]) -> Option<String> {
        self.lies_between(&trial.fitted, trial.fitted.model.effects.len().checked_sub(1)?, before)
    }

    /// The same of the `e`-th effect of a model.
    pub(in crate::learn) fn lies_between(&self, fitted: &Fitted, e: usize, before: &[f64]) -> Option<String> {
        let (_, at_s) = instant(fitted, e)?;
        if !self.data.is_series() {
            return self.may_begin_between(fitted, e, before).then(|| {
                format!("it begins at cut {at_s:.0}, which may as well be between two set-ups: it may be what they differ by")
            });
        }
        let kinds = self.kinds();
        let cutting = self.cutting(fitted);
        let count = |kind: usize, is_after: bool| {
            let members = cutting.iter().filter(|i| self.data.kind[**i] == kind);
            members.filter(|i| (self.data.state[**i].time_s >= at_s) == is_after).count()
        };
        let is_within = |kind: &usize| count(*kind, false).min(count(*kind, true)) >= PLACED_BY;
        (!kinds.is_empty() && !kinds.iter().any(is_within))
            .then(|| format!("it begins at {at_s:.0} s, between two operations: it may be what they differ by"))
    }

    /// What an accident in a log cannot be told from: it takes nearly as much where it begins between two operations.
    pub(in crate::learn) fn accident_or_difference(&self, present: &Present, trial: &Trial) -> Option<Confounded> {
        let last = trial.fitted.model.effects.len().checked_sub(1)?;
        if !self.data.is_series() || !self.may_begin_between(&trial.fitted, last, &present.left) {
            return None;
        }
        Some(Confounded {
            names: vec![trial.effect.name.to_owned(), "a difference between operations".to_owned()],
            why: "it takes nearly as much where it begins between two operations".to_owned(),
            experiment: trial.effect.separated_by.to_owned(),
        })
    }

    /// Does an effect take nearly as much when it begins at the border of two operations (of a table: set-ups)?
    fn may_begin_between(&self, found: &Fitted, e: usize, before: &[f64]) -> bool {
        let Some((instant, at_s)) = instant(found, e) else { return false };
        let drop = |from_s: f64| {
            let mut effects = found.model.effects.clone();
            effects[e].values[instant] = from_s;
            let fitted = fit(&self.train, &effects, FORM_ROUNDS)?;
            Some(self.drop_of(before, &held_out_residuals(&self.train, &fitted.model.effects, self.split)))
        };
        let Some(there) = drop(at_s) else { return false };
        let is_as_good =
            |border_s: &f64| drop(*border_s).is_some_and(|drop| self.criteria().takes_as_much(drop / there.max(1e-12)));
        self.borders_about(at_s, &self.cutting(found)).iter().any(is_as_good)
    }

    /// Samples of cuts.
    fn cutting(&self, fitted: &Fitted) -> Vec<usize> {
        let load = self.cut(fitted);
        self.train.used().filter(|i| load[*i] > 0.0).collect()
    }

    /// The instants next to one, before and after it, at which one operation (of a table: set-up) ends and the next begins.
    fn borders_about(&self, at_s: f64, cutting: &[usize]) -> Vec<f64> {
        let group = if self.data.is_series() { &self.data.kind } else { &self.data.block };
        let mut in_time = cutting.to_vec();
        in_time.sort_by(|a, b| self.data.state[*a].time_s.total_cmp(&self.data.state[*b].time_s));
        let change = |pair: &[usize]| {
            let [from, to] = [pair[0], pair[1]].map(|i| self.data.state[i].time_s);
            (group[pair[0]] != group[pair[1]]).then_some(f64::midpoint(from, to))
        };
        let borders: Vec<f64> = in_time.windows(2).filter_map(change).collect();
        let before = borders.iter().copied().rfind(|border| *border < at_s);
        let behind = borders.iter().copied().find(|border| *border >= at_s);
        before.into_iter().chain(behind).collect()
    }
}

/// The parameter of the `e`-th effect that is an instant, and its value.
fn instant(fitted: &Fitted, e: usize) -> Option<(usize, f64)> {
    let each = fitted.model.effects.get(e)?;
    let instant = each.effect.parameters.iter().position(|p| p.place == Some(Place::Instant))?;
    Some((instant, each.values[instant]))
}
