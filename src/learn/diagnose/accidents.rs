//! Accidents (a chipped edge): effects that begin at an instant. In: a trial of such an effect, the held-out residuals
//! without it. Out: why it is rejected, or what it is confounded with.
//!
//! Operations differ in tool, coolant or clamping, and so do set-ups of a table. An effect that begins between two of
//! them may be such a difference. The same holds if it explains nearly as much when its instant is moved there. In a
//! log this is reported with the effect instead of rejecting it, because the higher load of a broken edge is the safe
//! assumption.

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
    /// Why an effect that begins at an instant is rejected: no operation is cut both before and after it, or, in a
    /// table, it may begin between two set-ups.
    pub(in crate::learn) fn why_between_cuts(&self, trial: &Trial, before: &[f64]) -> Option<String> {
        self.why_between_operations(&trial.fitted, trial.fitted.model.effects.len().checked_sub(1)?, before)
    }

    /// The same for the `e`-th effect of a model.
    pub(in crate::learn) fn why_between_operations(&self, fitted: &Fitted, e: usize, before: &[f64]) -> Option<String> {
        let (_, at_s) = instant(fitted, e)?;
        if !self.data.is_series() {
            return self.may_begin_between(fitted, e, before).then(|| {
                format!(
                    "it begins at cut {at_s:.0} or between two set-ups near it: a difference between them may be the \
                     cause"
                )
            });
        }
        let kinds = self.kinds();
        let cutting = self.cutting(fitted);
        let count = |kind: usize, is_after: bool| {
            let members = cutting.iter().filter(|i| self.data.kind[**i] == kind);
            members.filter(|i| (self.data.state[**i].time_s >= at_s) == is_after).count()
        };
        let is_within = |kind: &usize| count(*kind, false).min(count(*kind, true)) >= PLACED_BY;
        (!kinds.is_empty() && !kinds.iter().any(is_within)).then(|| {
            format!("it begins at {at_s:.0} s, between two operations: a difference between them may be the cause")
        })
    }

    /// What an accident in a log is confounded with, if it explains nearly as much when it begins between two
    /// operations.
    pub(in crate::learn) fn accident_or_difference(&self, present: &Present, trial: &Trial) -> Option<Confounded> {
        let last = trial.fitted.model.effects.len().checked_sub(1)?;
        if !self.data.is_series() || !self.may_begin_between(&trial.fitted, last, &present.left) {
            return None;
        }
        Some(Confounded {
            names: vec![trial.effect.name.to_owned(), "a difference between operations".to_owned()],
            why: "it explains nearly as much if it begins between two operations".to_owned(),
            experiment: trial.effect.separated_by.to_owned(),
        })
    }

    /// Does an effect explain nearly as much if it begins at the next border between two operations (in a table:
    /// set-ups)?
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

    /// Samples in which the tool cuts.
    fn cutting(&self, fitted: &Fitted) -> Vec<usize> {
        let load = self.cut_load(fitted);
        self.train.used().filter(|i| load[*i] > 0.0).collect()
    }

    /// The last border between operations (in a table: set-ups) before an instant and the first after it, s.
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
