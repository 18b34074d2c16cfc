//! One cause in the place of two. In: the diagnosis and a model in which curves without a name stand beside named effects. Out: the model with
//! one curve instead of a name and the curves, where it explains as much.
//!
//! A rival of a name is fitted beside the curves, and a rival of a curve beside the names. If each takes half of what a third cause does, as a
//! stock that stands proud and a curve over the immersion may do of a pump that stops for a minute, none of the two is ever without the other,
//! and the third never has a place. So it is tried in the place of both.

use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::forms::FORM_ROUNDS;
use crate::learn::diagnose::trial::p_value;
use crate::learn::diagnose::unnamed::{is_shape_of, is_unnamed};
use crate::learn::model::cross_validation::held_out_residuals;
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::report::Rejected;

impl Diagnosis<'_> {
    /// The model with one curve in the place of a named effect and of the curves that are no shape of it. The curve must have no higher
    /// held-out error than what it replaces, and no more parameters.
    pub(in crate::learn) fn one_curve_for_both(&mut self, model: &Fitted) -> Option<Fitted> {
        let names: Vec<&FittedEffect> = model.model.effects.iter().filter(|each| self.is_found_name(each)).collect();
        names.into_iter().find_map(|own| self.one_curve_for(model, own))
    }

    /// Was it found here, by the loads?
    fn is_found_name(&self, each: &FittedEffect) -> bool {
        let is_known = self.options.known.iter().any(|known| known.effect.name == each.effect.name);
        !is_unnamed(each.effect) && !self.has_own_data(each.effect) && !is_known
    }

    fn one_curve_for(&mut self, model: &Fitted, own: &FittedEffect) -> Option<Fitted> {
        let effects = &model.model.effects;
        let is_beside = |each: &&FittedEffect| is_unnamed(each.effect) && !self.has_own_data(each.effect);
        if !effects.iter().filter(is_beside).any(|each| !is_shape_of(own, each)) {
            return None;
        }
        let goes = |each: &FittedEffect| each.effect.name == own.effect.name || is_beside(&each);
        let stays: Vec<FittedEffect> = effects.iter().filter(|each| !goes(each)).cloned().collect();
        let replaced: usize = effects.iter().filter(|each| goes(each)).map(FittedEffect::free_count).sum();
        let without = fit(&self.train, &stays, FORM_ROUNDS)?;
        let before = held_out_residuals(&self.train, &without.model.effects, self.split);
        let of_both = held_out_residuals(&self.train, effects, self.split);
        for found in self.curves_beside(&without, &before) {
            if self.is_better(&found.fit.left, &of_both) {
                continue;
            }
            let Some((trial, after)) = self.judged_curve(&without, &before, &found) else { continue };
            if self.is_better(&after, &of_both)
                || trial.fitted.model.effects.last().is_none_or(|curve| curve.free_count() > replaced)
            {
                continue;
            }
            let why = format!("alone it explains as much as {} with a curve beside it", own.effect.name);
            let errors = [&stays, &trial.fitted.model.effects].map(|each| self.judgement_errors(each).rmse);
            self.evidence.push((trial.effect.name, why, p_value(&trial), errors));
            let why =
                format!("a curve along {} explains as much as it does with another beside it", found.covariate.name());
            self.rejected.retain(|each| each.name != own.effect.name);
            self.rejected.push(Rejected { name: own.effect.name.into(), why });
            return Some(trial.fitted);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::effects::named;
    use crate::effects::unnamed::{BEYOND, KNOTS};
    use crate::learn::diagnose::diagnosis::Options;
    use crate::learn::diagnose::made_data::{EACH, begun, made};
    use crate::learn::model::cross_validation::Split;

    /// A curve over the depth, from 3 to 4 mm.
    fn along_depth() -> FittedEffect {
        let effect = named("unnamed-load-axial-depth").unwrap();
        let mut values = vec![BEYOND; KNOTS];
        values.resize(2 * KNOTS, 1.0);
        values.push(0.0);
        (values[0], values[1]) = (3.0, 4.0);
        let free = (0..values.len()).map(|k| k == KNOTS + 1).collect();
        FittedEffect { effect, values, free }
    }

    /// The model with up/down and that curve, and one curve in their place; blocks are cut up or climb, at 3 or 4 mm depth.
    fn one(up: impl Fn(usize) -> bool, deep: impl Fn(usize) -> bool, share: impl Fn(usize) -> f64) -> Option<String> {
        let state = |i: usize| {
            let side = if up(i / EACH) { 1.0 } else { -1.0 };
            let axial_depth_mm = if deep(i / EACH) { 4.0 } else { 3.0 };
            State { time_s: i as f64, up_share: side, up_share_chip: side, axial_depth_mm, ..State::default() }
        };
        let data = made(|i| share(i / EACH), 1.0, state);
        // Every fifth sample left out: where a while begins and ends is seen by every fold.
        let fold = (0..data.len()).map(|i| i % 5).collect();
        let split = Split { test: vec![false; data.len()], fold, folds: 5, how: String::new() };
        let options = Options::default();
        let mut diagnosis = begun(&data, &split, &options, 1.0);
        let effect = named("up-down-asymmetry").unwrap();
        let values: Vec<f64> = effect.parameters.iter().map(|p| p.starts[0]).collect();
        let sides = FittedEffect { effect, free: vec![true; values.len()], values };
        let model = fit(&data, &[sides, along_depth()], FORM_ROUNDS).unwrap();
        let found = diagnosis.one_curve_for_both(&model)?;
        let [only] = &found.model.effects[..] else { panic!("one effect") };
        Some(only.effect.name.to_owned())
    }

    #[test]
    fn what_lasts_for_a_while_is_one_cause_and_not_two_halves_of_it() {
        // Two blocks of the while are cut up, three deep, and one as the others are: neither half is quite right.
        let (first, second) = (|block: usize| (8..10).contains(&block), |block: usize| (11..14).contains(&block));
        let lasts = |block: usize| if (8..14).contains(&block) { 0.2 } else { 0.0 };
        assert_eq!(one(first, second, lasts).as_deref(), Some("unnamed-load-time"));
    }

    #[test]
    fn two_causes_that_no_curve_replaces_stay() {
        let (up, deep) = (|block: usize| block.is_multiple_of(2), |block: usize| block % 6 < 3);
        let share = |block: usize| if up(block) { 0.1 } else { -0.1 } + if deep(block) { 0.2 } else { 0.0 };
        assert_eq!(one(up, deep, share), None);
    }
}
