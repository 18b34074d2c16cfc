//! Curves without a name that the data kept for the judgement contradict. In: a diagnosis and its final model. Out: the model without them.
//!
//! Curves are chosen by cross-validation on the training data. If the error on the data kept for the judgement is higher with the model than
//! without any effect, no model would be written, and a curve that raises it belongs to the stretches it was learned on alone. It is taken
//! back and said among what was rejected. Nothing is chosen by these data for the better: what is left is what was found without that curve.

use crate::learn::diagnose::criteria::is_no_worse;
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::forms::{FORM_ROUNDS, remove};
use crate::learn::diagnose::unnamed::is_unnamed;
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

    /// Names that are left of a curve with a step between depths of 3 and 4 mm, where the load of the deep cuts is higher by `share` in
    /// training and by `kept` in the fifth of the blocks that are kept for the judgement.
    fn left(share: f64, kept: f64) -> (Vec<&'static str>, usize) {
        let is_kept = |block: usize| block % 5 == 2;
        let is_deep = |block: usize| block % 2 == 1;
        let more = |i: usize| match (is_deep(i / EACH), is_kept(i / EACH)) {
            (true, true) => kept,
            (true, false) => share,
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
        let found = diagnosis.without_contradicted_curves(model);
        (found.model.effects.iter().map(|each| each.effect.name).collect(), diagnosis.rejected.len())
    }

    #[test]
    fn a_curve_that_the_kept_data_contradict_is_taken_back_and_one_that_they_share_stays() {
        assert_eq!(left(0.2, 0.2), (vec!["unnamed-load-axial-depth"], 0));
        assert_eq!(left(0.2, 0.11), (vec!["unnamed-load-axial-depth"], 0));
        assert_eq!(left(0.2, -0.1), (vec![], 1));
    }
}
