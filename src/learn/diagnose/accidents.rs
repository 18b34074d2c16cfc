//! Accidents (a chipped edge): effects that begin at an instant. In: a trial of such an effect, the held-out residuals
//! without it. Out: why it is rejected, or what it is confounded with.
//!
//! Operations differ in tool, coolant or clamping, and so do set-ups of a table. An effect that begins between two of
//! them may be such a difference. The same holds if it explains nearly as much when its instant is moved there. In a
//! log this is reported with the effect instead of rejecting it, because the higher load of a broken edge is the safe
//! assumption. The readings between the two instants may speak against it: where the model that begins at the border fits them worse than
//! it fits any other stretch of the log as long, the effect began where it was found.

use crate::effects::{Covariate, Place};
use crate::learn::diagnose::criteria::{PLACED_BY, tells_a_rank};
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::evidence::Present;
use crate::learn::diagnose::forms::FORM_ROUNDS;
use crate::learn::diagnose::trial::Trial;
use crate::learn::model::cross_validation::held_out_residuals;
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::report::Confounded;

/// Quantities of the process that a program sets level by level or operation by operation.
const SETTINGS: [Covariate; 3] = [Covariate::Z, Covariate::AxialDepth, Covariate::SpindleSpeed];
/// Share of its range by which the values of a setting before and after an instant must differ. A surface finished downwards, row by row, goes
/// over by less with every row. Judgement.
const APART: f64 = 0.1;

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

    /// What an accident in a log is confounded with, if it explains nearly as much when it begins between two operations, or where a quantity
    /// of the process goes over for good to values that no cut had before: a layer that is harder from a level down is the same step in time.
    pub(in crate::learn) fn accident_or_difference(&self, present: &Present, trial: &Trial) -> Option<Confounded> {
        let last = trial.fitted.model.effects.len().checked_sub(1)?;
        let (_, at_s) = instant(&trial.fitted, last)?;
        if !self.data.is_series() {
            return None;
        }
        let cutting = self.cutting_in_time(&trial.fitted);
        let may_begin = |borders: Vec<f64>| self.may_begin_at(&borders, &trial.fitted, last, &present.left);
        let (others, why) = if may_begin(self.borders_about(at_s, &cutting)) {
            (
                vec!["a difference between operations".to_owned()],
                "it explains nearly as much if it begins between two operations",
            )
        } else {
            let goes_over = |covariate: &&Covariate| may_begin(about(at_s, &self.overs(**covariate, &cutting)));
            let said = |covariate: &Covariate| format!("a curve of the load along {}", covariate.name());
            (
                SETTINGS.iter().filter(goes_over).map(said).collect(),
                "no cut before it and none after it have a value in common",
            )
        };
        (!others.is_empty()).then(|| Confounded {
            names: std::iter::once(trial.effect.name.to_owned()).chain(others).collect(),
            why: why.to_owned(),
            experiment: trial.effect.separated_by.to_owned(),
        })
    }

    /// Does an effect explain nearly as much if it begins at the next border between two operations (in a table:
    /// set-ups)?
    fn may_begin_between(&self, found: &Fitted, e: usize, before: &[f64]) -> bool {
        let Some((_, at_s)) = instant(found, e) else { return false };
        self.may_begin_at(&self.borders_about(at_s, &self.cutting_in_time(found)), found, e, before)
    }

    /// Does an effect explain nearly as much if it begins at one of these instants, s?
    fn may_begin_at(&self, instants_s: &[f64], found: &Fitted, e: usize, before: &[f64]) -> bool {
        let Some((instant, at_s)) = instant(found, e) else { return false };
        let left = |from_s: f64| {
            let mut effects = found.model.effects.clone();
            effects[e].values[instant] = from_s;
            let fitted = fit(&self.train, &effects, FORM_ROUNDS)?;
            Some(held_out_residuals(&self.train, &fitted.model.effects, self.split))
        };
        let Some(there) = (!instants_s.is_empty()).then(|| left(at_s)).flatten() else { return false };
        let there = self.drop_of(before, &there).max(1e-12);
        let cutting = self.cutting_in_time(found);
        let is_as_good = |border_s: &f64, left: &[f64]| {
            let between_s = [at_s.min(*border_s), at_s.max(*border_s)];
            self.criteria().takes_as_much(self.drop_of(before, left) / there)
                && !self.is_worst_between(&cutting, between_s, left)
        };
        instants_s.iter().any(|border_s| left(*border_s).is_some_and(|left| is_as_good(border_s, &left)))
    }

    /// Is the mean residual `left` of the readings between two instants larger than that of every other stretch of as many readings? Samples in
    /// which the tool cuts, in the order of time. No where a log has too few such stretches to tell.
    fn is_worst_between(&self, cutting: &[usize], [from_s, to_s]: [f64; 2], left: &[f64]) -> bool {
        let is_between = |i: &usize| (from_s..to_s).contains(&self.data.state[*i].time_s);
        let (between, others): (Vec<usize>, Vec<usize>) = cutting.iter().copied().partition(is_between);
        let off = |members: &[usize]| members.iter().map(|i| self.data.weight[*i].sqrt() * left[*i]).sum::<f64>().abs();
        let mut stretches = others.chunks_exact(between.len().max(1));
        tells_a_rank(stretches.len()) && stretches.all(|stretch| off(stretch) < off(&between))
    }

    /// Samples in which the tool cuts.
    fn cutting(&self, fitted: &Fitted) -> Vec<usize> {
        let load = self.cut_load(fitted);
        self.train.used().filter(|i| load[*i] > 0.0).collect()
    }

    /// The same in the order of time.
    fn cutting_in_time(&self, fitted: &Fitted) -> Vec<usize> {
        let mut cutting = self.cutting(fitted);
        cutting.sort_by(|a, b| self.data.state[*a].time_s.total_cmp(&self.data.state[*b].time_s));
        cutting
    }

    /// The last border between operations (in a table: set-ups) before an instant and the first after it, s; samples in the order of time.
    fn borders_about(&self, at_s: f64, cutting: &[usize]) -> Vec<f64> {
        let group = if self.data.is_series() { &self.data.kind } else { &self.data.block };
        let is_border = |pair: &&[usize]| group[pair[0]] != group[pair[1]];
        about(at_s, &cutting.windows(2).filter(is_border).map(|pair| self.between_s(pair)).collect::<Vec<f64>>())
    }

    /// The instants at which a quantity of the process goes over to values that all cuts after them have and none before, s; samples in the
    /// order of time.
    fn overs(&self, covariate: Covariate, cutting: &[usize]) -> Vec<f64> {
        let known: Vec<usize> =
            cutting.iter().copied().filter(|i| covariate.of(&self.data.state[*i]).is_finite()).collect();
        let values: Vec<f64> = known.iter().map(|i| covariate.of(&self.data.state[*i])).collect();
        let ranges = |values: &mut dyn Iterator<Item = f64>| -> Vec<[f64; 2]> {
            let mut range = [f64::INFINITY, f64::NEG_INFINITY];
            values
                .map(|value| {
                    range = [range[0].min(value), range[1].max(value)];
                    range
                })
                .collect()
        };
        let before = ranges(&mut values.iter().copied());
        let mut after = ranges(&mut values.iter().rev().copied());
        after.reverse();
        let Some([least, most]) = before.last().copied() else { return Vec::new() };
        let apart = APART * (most - least);
        let goes_over = |k: &usize| after[k + 1][0] - before[*k][1] > apart || before[*k][0] - after[k + 1][1] > apart;
        (0..known.len().saturating_sub(1)).filter(goes_over).map(|k| self.between_s(&known[k..k + 2])).collect()
    }

    /// Half way between two samples, s.
    fn between_s(&self, pair: &[usize]) -> f64 {
        f64::midpoint(self.data.state[pair[0]].time_s, self.data.state[pair[1]].time_s)
    }
}

/// The last of these instants before `at_s` and the first after it.
fn about(at_s: f64, instants_s: &[f64]) -> Vec<f64> {
    let before = instants_s.iter().copied().rfind(|instant| *instant < at_s);
    let behind = instants_s.iter().copied().find(|instant| *instant >= at_s);
    before.into_iter().chain(behind).collect()
}

/// The parameter of the `e`-th effect that is an instant, and its value.
fn instant(fitted: &Fitted, e: usize) -> Option<(usize, f64)> {
    let each = fitted.model.effects.get(e)?;
    let instant = each.effect.parameters.iter().position(|p| p.place == Some(Place::Instant))?;
    Some((instant, each.values[instant]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{State, named};
    use crate::learn::diagnose::diagnosis::Options;
    use crate::learn::diagnose::made_data::{BLOCKS, EACH, begun, fifths, made};
    use crate::path::Vec3;

    /// What a chipped edge half way through a log is confounded with if its blocks are cut at these heights.
    fn doubts(height_mm: impl Fn(usize) -> f64) -> Vec<String> {
        doubts_of(0.4, height_mm, None)
    }

    /// The same for the rise of the load, and for a second operation that begins at a sample.
    fn doubts_of(rise: f64, height_mm: impl Fn(usize) -> f64, second_from: Option<usize>) -> Vec<String> {
        let half = BLOCKS / 2 * EACH;
        let state = |i: usize| State {
            time_s: i as f64,
            position: Vec3::new((i * 31 % EACH) as f64, 0.0, height_mm(i / EACH)),
            ..State::default()
        };
        let mut data = made(|i| if i >= half { rise } else { 0.0 }, 1.0, state);
        if let Some(from) = second_from {
            data.kind = (0..data.len()).map(|i| usize::from(i >= from)).collect();
        }
        let (split, chipping) = (fifths(&data), named("edge-chipping").unwrap());
        let options = Options { candidates: vec![chipping], ..Options::default() };
        let mut diagnosis = begun(&data, &split, &options, 1.0);
        let base = fit(&data, &[], 0).unwrap();
        let present = diagnosis.present(&base);
        let trial =
            diagnosis.trials(&base, false).into_iter().find(|trial| trial.effect.name == chipping.name).unwrap();
        let doubt = diagnosis.accident_or_difference(&present, &trial);
        doubt.map_or_else(Vec::new, |doubt| doubt.names[1..].to_vec())
    }

    /// A jump of four and a half scatters, half a block before an operation ends: nothing else in the log fits as badly as that half block. A
    /// small one that a single reading tells from the border is as good a difference between the operations.
    #[test]
    fn an_edge_that_clearly_chips_before_an_operation_ends_is_no_difference_between_operations() {
        let (half, level) = (BLOCKS / 2 * EACH, |_| -2.0);
        let difference = ["a difference between operations"];
        assert!(doubts_of(0.02, level, Some(half + EACH / 2)).is_empty());
        assert_eq!(doubts_of(0.006, level, Some(half - 1)), difference);
        assert_eq!(doubts_of(0.02, level, Some(half)), difference);
    }

    #[test]
    fn an_edge_that_chips_where_a_new_level_begins_may_be_a_layer() {
        assert_eq!(
            doubts(|block| if block < BLOCKS / 2 { -2.0 } else { -5.0 }),
            ["a curve of the load along position z"]
        );
        // A level later, the layer does not explain the jump.
        assert!(doubts(|block| if block < BLOCKS / 2 + 6 { -2.0 } else { -5.0 }).is_empty());
        // Heights that come again separate the two.
        assert!(doubts(|block| if block % 3 > 0 { -2.0 } else { -5.0 }).is_empty());
        // Rows down a surface: no height comes again, and each is hardly lower than the one before.
        assert!(doubts(|block| -(block as f64)).is_empty());
    }
}
