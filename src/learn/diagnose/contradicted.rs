//! What the data kept for the judgement contradict. In: a diagnosis and its final model. Out: the model without the curves that they
//! contradict, and whether they refute all its effects together.
//!
//! Curves are chosen by cross-validation on the training data. If the error on the data kept for the judgement is higher with the model than
//! without any effect, no model would be written, and a curve that raises it belongs to the stretches it was learned on alone. It is taken
//! back and said among what was rejected. Nothing is chosen by these data for the better: what is left is what was found without that curve.

use crate::learn::dataset::errors::errors;
use crate::learn::diagnose::criteria::{is_less_than_whole, is_no_worse};
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::forms::{FORM_ROUNDS, remove};
use crate::learn::diagnose::unnamed::is_unnamed;
use crate::learn::model::cross_validation::share_borne_out;
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::report::Rejected;

impl Diagnosis<'_> {
    /// The model without the curves that raise the error on the data kept for the judgement, the worst first, until it is no higher than
    /// that of the base model.
    pub(in crate::learn) fn without_contradicted_curves(&mut self, model: Fitted) -> Fitted {
        let base_rmse = self.judgement_errors(&[]).rmse;
        let mut present = model;
        loop {
            let effects = &present.model.effects;
            let whole_rmse = self.judgement_errors(effects).rmse;
            if is_no_worse(base_rmse, whole_rmse) {
                return present;
            }
            let is_curve = |each: &FittedEffect| is_unnamed(each.effect) && !self.has_own_data(each.effect);
            let without = (0..effects.len()).filter(|e| is_curve(&effects[*e])).map(|e| {
                let others = remove(effects, e);
                (self.judgement_errors(&others).rmse, e, others)
            });
            let Some((rmse, worst, others)) = without.min_by(|a, b| a.0.total_cmp(&b.0)) else { return present };
            if is_no_worse(rmse, whole_rmse) {
                return present;
            }
            let Some(fitted) = fit(&self.train, &others, FORM_ROUNDS) else { return present };
            let why = "the error on the data kept for the judgement rises with it".to_owned();
            self.rejected.push(Rejected { name: effects[worst].effect.name.into(), why });
            present = fitted;
        }
    }

    /// Is the error on these data higher with the effects than without, and is less borne out there than they predict
    /// ([`share_borne_out`])? Where the effects act on few of these data, a higher error alone says little.
    pub(in crate::learn) fn are_refuted_together(&self, fitted: &Fitted) -> bool {
        let rmse = |residual: &[f64]| errors(self.data, |i| residual[i]).rmse;
        let [without, with] = [&[][..], &fitted.model.effects].map(|effects| self.judgement_residuals(effects));
        let [share, std_error] = share_borne_out(self.data, &without, &with);
        !is_no_worse(rmse(&without), rmse(&with)) && is_less_than_whole(share, std_error)
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
    use crate::learn::model::cross_validation::without;

    /// What is found of a curve with a step between depths of 3 and 4 mm, where the load of the deep cuts, every other block, is higher by 0.2
    /// in training and by `kept` in every third block, which is kept for the judgement.
    fn found_of<T>(kept: impl Fn(usize) -> f64, found: impl FnOnce(&mut Diagnosis, Fitted) -> T) -> T {
        let is_kept = |block: usize| block % 3 == 1;
        let is_deep = |block: usize| block % 2 == 1;
        let more = |i: usize| match (is_deep(i / EACH), is_kept(i / EACH)) {
            (true, true) => kept(i / EACH),
            (true, false) => 0.2,
            (false, _) => 0.0,
        };
        let state = |i: usize| State { axial_depth_mm: if is_deep(i / EACH) { 4.0 } else { 3.0 }, ..State::default() };
        let data = made(more, 1.0, state);
        let test: Vec<bool> = data.block.iter().map(|block| is_kept(*block)).collect();
        let fold = data.block.iter().map(|block| (block / 5 + block) % 5).collect();
        let split = Split { test, fold, folds: 5, how: String::new() };
        let options = Options::default();
        let mut diagnosis = begun(&data, &split, &options, 1.0);
        diagnosis.train = data.with_weights(without(&data, |i| split.test[i]));
        let mut values = vec![BEYOND; KNOTS];
        values.resize(2 * KNOTS, 1.0);
        values.push(0.0);
        (values[0], values[1]) = (3.0, 4.0);
        let free = (0..values.len()).map(|k| k == KNOTS + 1).collect();
        let curve = FittedEffect { effect: named("unnamed-load-axial-depth").unwrap(), values, free };
        let model = fit(&diagnosis.train, &[curve], FORM_ROUNDS).unwrap();
        found(&mut diagnosis, model)
    }

    /// Names that are left, and the number of those that are taken back.
    fn left(kept: f64) -> (Vec<&'static str>, usize) {
        found_of(
            |_| kept,
            |diagnosis, model| {
                let found = diagnosis.without_contradicted_curves(model);
                (found.model.effects.iter().map(|each| each.effect.name).collect(), diagnosis.rejected.len())
            },
        )
    }

    #[test]
    fn a_curve_that_the_kept_data_contradict_is_taken_back_and_one_that_they_share_stays() {
        assert_eq!(left(0.2), (vec!["unnamed-load-axial-depth"], 0));
        assert_eq!(left(0.11), (vec!["unnamed-load-axial-depth"], 0));
        assert_eq!(left(-0.1), (vec![], 1));
    }

    #[test]
    fn effects_are_refuted_by_kept_data_that_agree_in_what_they_say() {
        let are_refuted = |kept: [f64; 2]| {
            found_of(|block| kept[usize::from(block >= 12)], |of, model| of.are_refuted_together(&model))
        };
        assert!(!are_refuted([0.2, 0.2]) && are_refuted([-0.1, -0.1]));
        // Of the four deep blocks kept two say the opposite of the others: the error is higher, but what they bear out is uncertain.
        assert!(!are_refuted([0.2, -0.25]));
    }
}
