//! What each effect is worth beside those added later. In: the diagnosis, a model. Out: the model without those that are no longer worth their
//! parameters, and the names that the data kept for the judgement refute.

use crate::learn::dataset::errors::errors;
use crate::learn::diagnose::criteria::{is_less_than_whole, is_lower};
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::forms::{FORM_ROUNDS, remove};
use crate::learn::diagnose::trial::{score_of, unphysical};
use crate::learn::diagnose::unnamed::{is_shape_of, is_unnamed};
use crate::learn::model::cross_validation::{held_out_residuals, improvement_by_case, share_borne_out, t_statistic};
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::report::Rejected;

impl Diagnosis<'_> {
    /// Removes effects whose score beside the others is too low, and changes the others to a form of clearly better
    /// score.
    pub(in crate::learn) fn prune(&mut self, fitted: Fitted) -> Fitted {
        let mut present = fitted;
        let mut k = 0;
        while present.model.effects.len() > 1 && k < present.model.effects.len() {
            let others: Vec<FittedEffect> = remove(&present.model.effects, k);
            let Some(without_it) = fit(&self.train, &others, 12) else { break };
            let own = present.model.effects[k].effect;
            if self.is_settled(own, &others) {
                k += 1;
                continue;
            }
            let Some((score, lowers)) = self.worth_of(&present, &without_it, k) else { break };
            let explained = (score < self.threshold() || !lowers)
                .then(|| "the effects added after it explain as much".to_owned())
                .or_else(|| unphysical(Some(&present.model.effects[k]), self.data));
            if let Some(why) = explained {
                self.rejected.push(Rejected { name: own.name.into(), why });
                present = if self.pair.contains(&own.name) { self.without_pair(&without_it) } else { without_it };
                k = 0;
                continue;
            }
            if let Some(fuller) = self.other_form(&present, k, &without_it, score) {
                present = fuller;
            }
            k += 1;
        }
        present
    }

    /// Score of the `k`-th effect beside the others, and whether it lowers the held-out error if there are curves
    /// without a name. Curves over its own covariates correct its law and are left out of both models, so that they
    /// cannot replace it.
    fn worth_of(&self, present: &Fitted, without_it: &Fitted, k: usize) -> Option<(f64, bool)> {
        let effects = &present.model.effects;
        let own = &effects[k];
        let score = |without: &Fitted, with: &Fitted| score_of(&self.train, without, with, self.parameters_of(own)).0;
        if !effects.iter().any(|each| is_unnamed(each.effect)) {
            return Some((score(without_it, present), true));
        }
        let others: Vec<FittedEffect> = remove(effects, k).into_iter().filter(|each| !is_shape_of(own, each)).collect();
        let with: Vec<FittedEffect> = others.iter().chain([own]).cloned().collect();
        let [before, after] = [&others, &with].map(|each| held_out_residuals(&self.train, each, self.split));
        let t = t_statistic(&improvement_by_case(&self.train, &before, &after));
        let lowers = self.criteria().lowers_held_out(self.drop_of(&before, &after), t);
        if with.len() == effects.len() {
            return Some((score(without_it, present), lowers));
        }
        Some((score(&fit(&self.train, &others, FORM_ROUNDS)?, &fit(&self.train, &with, FORM_ROUNDS)?), lowers))
    }

    /// The named effects that the data kept for the judgement refute: the error there is hardly lower with one, and what it predicts there
    /// is not borne out ([`share_borne_out`]). An effect that acts on few of these data is not refuted by them. Curves over its own
    /// covariates are the shape of an effect and are left out with it. An effect with data of its own is not asked.
    pub(in crate::learn) fn refuted(&self, fitted: &Fitted) -> Vec<&'static str> {
        let effects = &fitted.model.effects;
        let rmse = |residual: &[f64]| errors(self.data, |i| residual[i]).rmse;
        let with = self.judgement_residuals(effects);
        let is_refuted = |e: &usize| {
            let is_open = |each: &FittedEffect| !is_shape_of(&effects[*e], each);
            let others: Vec<FittedEffect> = remove(effects, *e).into_iter().filter(is_open).collect();
            let without = self.judgement_residuals(&others);
            let [share, std_error] = share_borne_out(self.data, &without, &with);
            !is_lower(rmse(&without), rmse(&with)) && is_less_than_whole(share, std_error)
        };
        let is_asked = |e: &usize| !is_unnamed(effects[*e].effect) && !self.has_own_data(effects[*e].effect);
        (0..effects.len()).filter(is_asked).filter(is_refuted).map(|e| effects[e].effect.name).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{State, named};
    use crate::learn::diagnose::diagnosis::Options;
    use crate::learn::diagnose::made_data::{EACH, begun, fifths, in_first, made};
    use crate::path::Vec3;

    /// Names that are left of a zone and of a difference between up and down milling, if the load is larger by the share `excess` in the
    /// zone.
    fn left(excess: f64) -> Vec<&'static str> {
        let (block, x_mm) = (|i: usize| i / EACH, |i: usize| 100.0 * (i % EACH) as f64 / EACH as f64);
        let is_hard = |i: usize| (8..16).contains(&block(i)) && (30.0..70.0).contains(&x_mm(i));
        let up = |i: usize| if block(i).is_multiple_of(2) { 1.0 } else { -1.0 };
        let state = |i: usize| State {
            time_s: i as f64,
            position: Vec3::new(x_mm(i), 5.0 * block(i) as f64, 0.0),
            up_share: up(i),
            up_share_chip: up(i),
            ..State::default()
        };
        let data = made(|i| (1.0 + 0.2 * up(i)) * (1.0 + if is_hard(i) { excess } else { 0.0 }) - 1.0, 1.0, state);
        let zone = in_first("hard-zone", &[1.0, 30.0, 70.0, 38.0, 77.0, 0.05, 8.0]);
        let up_down = in_first("up-down-asymmetry", &[0.2, 0.2]);
        let (split, options) = (fifths(&data), Options { candidates: Vec::new(), ..Options::default() });
        let model = fit(&data, &[zone, up_down], FORM_ROUNDS).unwrap();
        let pruned = begun(&data, &split, &options, 1.0).prune(model);
        pruned.model.effects.iter().map(|each| each.effect.name).collect()
    }

    #[test]
    fn an_effect_that_a_later_fit_drives_into_its_bound_is_no_longer_named() {
        assert_eq!(left(1.0), ["hard-zone", "up-down-asymmetry"]);
        assert_eq!(left(9.0), ["up-down-asymmetry"]);
    }

    #[test]
    fn what_readings_without_a_cut_show_is_settled_but_beside_losses_of_the_drive() {
        let data = made(|_| 0.0, 1.0, |_| State::default());
        let (split, options) = (fifths(&data), Options::default());
        let of = |name: &str| {
            let effect = named(name).unwrap();
            let values: Vec<f64> = effect.parameters.iter().map(|parameter| parameter.starts[0]).collect();
            FittedEffect { effect, free: vec![true; values.len()], values }
        };
        let tare = of("tare-speed");
        let mut diagnosis = begun(&data, &split, &options, 1.0);
        let is_settled =
            |of: &Diagnosis, beside: &FittedEffect| of.is_settled(tare.effect, std::slice::from_ref(beside));
        assert!(!is_settled(&diagnosis, &of("flank-wear")));
        diagnosis.shown_by_idle.push(tare.clone());
        assert!(is_settled(&diagnosis, &of("flank-wear")) && !is_settled(&diagnosis, &of("drive-efficiency")));
        assert_eq!(diagnosis.parameters_of(&tare.held()), tare.free_count());
        assert_eq!(diagnosis.parameters_of(&of("flank-wear").held()), 0);
    }
}
