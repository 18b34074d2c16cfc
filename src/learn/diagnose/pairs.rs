//! Two effects that explain together what neither explains alone. In: the diagnosis, the base model. Out: the model with both.

use crate::learn::dataset::errors::errors;
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::trial::{Trial, score_of, unphysical};
use crate::learn::diagnose::unnamed::ResidualCurve;
use crate::learn::model::cross_validation::{held_out_residuals, improvement_by_case, t_statistic};
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::report::Rejected;

/// Candidates of best score whose pairs are tried when none is found alone.
const PAIRED: usize = 6;
/// Pairs of best score that are judged on held-out data.
const PAIRS_JUDGED: usize = 4;

impl Diagnosis<'_> {
    /// Two effects that explain together what neither explains alone, because each masks the other in the fit.
    pub(in crate::learn) fn pair(&mut self, base: &Fitted) -> Option<Fitted> {
        let left = errors(&self.train, |i| self.base_residual[i]).rmse;
        if !self.criteria().pairs_are_worth_it(left, self.floor) {
            return None;
        }
        let mut first = self.trials(base, false);
        first.sort_by(|a, b| b.score.total_cmp(&a.score));
        first.truncate(PAIRED);
        let mut pairs: Vec<(f64, Trial)> = Vec::new();
        for one in &first {
            for two in self.trials(&one.fitted, false) {
                let asked = two.fitted.model.effects.iter().map(FittedEffect::free_count).sum();
                let (score, _) = score_of(&self.train, base, &two.fitted, asked);
                if score > 2.0 * self.threshold()
                    && two.fitted.model.effects.iter().all(|u| unphysical(Some(u), self.data).is_none())
                {
                    pairs.push((score, two));
                }
            }
        }
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
        pairs.truncate(PAIRS_JUDGED);
        let curves = self.fitted_curves(base, &self.base_residual, |_, _| true);
        let judged = pairs.into_iter().find_map(|(score, two)| {
            let after = held_out_residuals(&self.train, &two.fitted.model.effects, self.split);
            let share =
                self.share_of_excess(&self.base_residual, &after, &self.base_residual, self.criteria().least_excess);
            let t = t_statistic(&improvement_by_case(&self.train, &self.base_residual, &after));
            // A change of load within the error of the engagement is no evidence, for two effects as for one.
            let is_seen = self.change_of_load(base, &self.base_residual, &after) >= self.criteria().engagement_known_to;
            let enough = is_seen && self.criteria().pair_explains(share, t) && !self.leaves_much(&after);
            let better = |found: &ResidualCurve| {
                let knows = |u: &FittedEffect| u.effect.knows(found.covariate, found.effect.multiplies);
                let known = two.fitted.model.effects.iter().any(knows);
                !known && self.is_better(&after, &found.fit.left)
            };
            // A single curve with the same held-out error is the simpler explanation.
            let simpler = || curves.first().is_some_and(|found| !self.is_better(&found.fit.left, &after));
            let new = base.model.effects.len()..two.fitted.model.effects.len();
            let is_accident = |e| self.why_between_operations(&two.fitted, e, &self.base_residual).is_none();
            let sound = enough && !curves.iter().any(better) && !simpler() && new.into_iter().all(is_accident);
            sound.then_some((score, two, share))
        });
        let (score, two, share) = judged?;
        let errors = [self.judgement_errors(&[]).rmse, self.judgement_errors(&two.fitted.model.effects).rmse];
        for each in &two.fitted.model.effects[base.model.effects.len()..] {
            let text = format!(
                "only together with the other it removes {:.0} % of what the base model leaves beyond the noise \
                 (score {score:.1})",
                100.0 * share
            );
            self.evidence.push((each.effect.name, text, self.p_of_the_search(&two), errors));
            self.rejected.retain(|r| r.name != each.effect.name);
        }
        self.pair = two.fitted.model.effects[base.model.effects.len()..].iter().map(|u| u.effect.name).collect();
        Some(self.prune(two.fitted)).filter(|left| left.model.effects.len() > base.model.effects.len() + 1)
    }

    /// The model without the second effect of a pair after the first was removed: alone it explains nothing.
    pub(in crate::learn) fn without_pair(&mut self, present: &Fitted) -> Fitted {
        let is_left = |each: &&FittedEffect| !self.pair.contains(&each.effect.name);
        let others: Vec<FittedEffect> = present.model.effects.iter().filter(is_left).cloned().collect();
        for name in present.model.effects.iter().map(|u| u.effect.name).filter(|name| self.pair.contains(name)) {
            self.rejected
                .push(Rejected { name: name.into(), why: "it explained the residual only with another".into() });
        }
        fit(&self.train, &others, 12).unwrap_or_else(|| present.clone())
    }
}
