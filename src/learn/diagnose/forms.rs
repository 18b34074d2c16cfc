//! Choice of the form of an effect that is already in the model. In: the diagnosis, the model. Out: the model with the
//! form of clearly better score, if there is one.

use crate::effects::Parameter;
use crate::learn::diagnose::candidates::starts;
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::trial::{score_of, unphysical};
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{Fitted, fit};
use rayon::prelude::*;

/// Iterations of a fit until it has converged.
pub(in crate::learn) const FORM_ROUNDS: usize = 25;

impl Diagnosis<'_> {
    /// If the last effect was searched for (an instant or region), tries its optional parameters, which the search left
    /// neutral, and keeps the best.
    pub(in crate::learn) fn with_best_shape(&self, found: Fitted) -> Fitted {
        let Some((last, others)) = found.model.effects.split_last().filter(|(u, _)| u.effect.is_looked_for()) else {
            return found;
        };
        let free = |k: usize, start: f64| {
            let mut each = last.clone();
            (each.values[k], each.free[k]) = (start, true);
            let effects: Vec<FittedEffect> = others.iter().chain([&each]).cloned().collect();
            let fitted = fit(&self.train, &effects, FORM_ROUNDS)?;
            let sound = unphysical(fitted.model.effects.last(), self.data).is_none();
            sound.then(|| (score_of(&self.train, &found, &fitted, 1).0, fitted))
        };
        let shapes = last.effect.parameters.iter().enumerate().filter(|(k, p)| p.neutral == Some(last.values[*k]));
        let starts: Vec<(usize, f64)> =
            shapes.flat_map(|(k, p)| p.starts.iter().map(move |start| (k, *start))).collect();
        let tried: Vec<(f64, Fitted)> = starts.par_iter().filter_map(|(k, start)| free(*k, *start)).collect();
        let best = tried
            .into_iter()
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(score, _)| *score > self.criteria().form_margin);
        best.map_or(found, |(_, fitted)| fitted)
    }

    /// The model with the `k`-th effect in the form of best score beside the effects added after it; `None` if that is
    /// not better than `same`, the score of its present form. The fit starts from the other effects as they are in
    /// `present`, because those of `without_it` have taken over a part of this effect.
    pub(in crate::learn) fn other_form(
        &self,
        present: &Fitted,
        k: usize,
        without_it: &Fitted,
        same: f64,
    ) -> Option<Fitted> {
        let own = present.model.effects[k].effect;
        if !own.parameters.iter().any(|p| p.neutral.is_some()) || own.parameters.iter().any(Parameter::is_scanned) {
            return None;
        }
        let others = remove(&present.model.effects, k);
        let fitted = |each: &FittedEffect| {
            let effects: Vec<FittedEffect> = others.iter().chain([each]).cloned().collect();
            let fitted = fit(&self.train, &effects, FORM_ROUNDS)?;
            let (score, _) = score_of(&self.train, without_it, &fitted, each.free_count());
            Some((score, fitted))
        };
        let sound = |f: &Fitted| unphysical(f.model.effects.last(), self.data).is_none();
        let forms = starts(own, &self.train, present);
        let best = forms.par_iter().filter_map(fitted).filter(|(_, f)| sound(f)).max_by(|a, b| a.0.total_cmp(&b.0));
        best.filter(|(score, _)| *score > same + self.criteria().form_margin).map(|(_, fitted)| fitted)
    }
}

/// The effects without the `k`-th.
pub(in crate::learn) fn remove(effects: &[FittedEffect], k: usize) -> Vec<FittedEffect> {
    effects.iter().enumerate().filter(|(e, _)| *e != k).map(|(_, each)| each.clone()).collect()
}
