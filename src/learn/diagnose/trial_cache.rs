//! A cache of trials. In: a model. Out: the trials of every candidate on top of it, and the held-out residuals of those
//! whose instant or region is searched again without each fold.
//!
//! Trials take most of the time of a diagnosis, and models recur: the rivals of the only effect of a model are fitted
//! on top of the base model, as in the first step of the search.

use crate::effects::Effect;
use crate::learn::diagnose::trial::Trial;
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::Fitted;

/// Relative difference of the squares below which two fits of the same effects are the same model: ten times the
/// tolerance of a fit; with ten thousand samples 0.1 in twice the log-likelihood.
const SAME_SQUARES: f64 = 1e-5;

/// See the head of the file.
#[derive(Clone, Default)]
pub(in crate::learn) struct TrialCache(Vec<CachedModel>);

/// What was fitted on top of one model.
#[derive(Clone)]
struct CachedModel {
    effects: Vec<FittedEffect>,
    squares: f64,
    trials: Vec<Trial>,
    left: Vec<(&'static str, Vec<f64>)>,
}

impl CachedModel {
    fn is_of(&self, model: &Fitted) -> bool {
        let effects = &model.model.effects;
        self.effects.len() == effects.len()
            && self.effects.iter().zip(effects).all(|(one, other)| is_same_form(one, other))
            && (self.squares - model.squares).abs() <= SAME_SQUARES * model.squares
    }
}

impl TrialCache {
    /// The trials on top of a model, if they are known.
    pub(in crate::learn) fn trials(&self, model: &Fitted) -> Option<&[Trial]> {
        self.0.iter().find(|cached| cached.is_of(model)).map(|cached| cached.trials.as_slice())
    }

    pub(in crate::learn) fn keep_trials(&mut self, model: &Fitted, trials: &[Trial]) {
        let effects = model.model.effects.clone();
        self.0.push(CachedModel { effects, squares: model.squares, trials: trials.to_vec(), left: Vec::new() });
    }

    /// Held-out residuals of an effect on top of a model, if they are known.
    pub(in crate::learn) fn left(&self, model: &Fitted, effect: &Effect) -> Option<&[f64]> {
        let cached = self.0.iter().find(|cached| cached.is_of(model))?;
        cached.left.iter().find(|(name, _)| *name == effect.name).map(|(_, left)| left.as_slice())
    }

    pub(in crate::learn) fn keep_left(&mut self, model: &Fitted, effect: &'static Effect, left: &[f64]) {
        if let Some(cached) = self.0.iter_mut().find(|cached| cached.is_of(model)) {
            cached.left.push((effect.name, left.to_vec()));
        }
    }
}

/// Is it the same effect in the same form, at the same instant if it has one?
fn is_same_form(one: &FittedEffect, other: &FittedEffect) -> bool {
    let is_same_value = |k: usize| !one.effect.parameters[k].is_scanned() || one.values[k] == other.values[k];
    one.effect.name == other.effect.name && one.free == other.free && (0..one.values.len()).all(is_same_value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{State, named};
    use crate::learn::diagnose::made_data::{in_first, made};
    use crate::learn::model::fit::fit;

    #[test]
    fn a_model_that_comes_back_is_known_and_another_fit_or_form_of_its_effects_is_not() {
        let up = |i: usize| if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        let state = |i: usize| State { up_share: up(i), up_share_chip: up(i), ..State::default() };
        let data = made(|i| 0.2 * up(i), 1.0, state);
        let up_down = named("up-down-asymmetry").unwrap();
        let with = |free: bool, rounds: usize| {
            let both = [0.0, 0.0];
            fit(&data, &[in_first(up_down.name, &both[..=usize::from(free)])], rounds).unwrap()
        };
        let (plain, model) = (fit(&data, &[], 0).unwrap(), with(false, 25));
        let trial = Trial { effect: up_down, fitted: model.clone(), gain: 1.0, score: 1.0 };
        let mut cache = TrialCache::default();
        cache.keep_trials(&plain, std::slice::from_ref(&trial));
        cache.keep_left(&plain, up_down, &[1.0]);
        assert!(cache.trials(&plain).is_some() && cache.left(&plain, up_down) == Some(&[1.0][..]));
        assert!(cache.trials(&model).is_none() && cache.left(&model, up_down).is_none());
        cache.keep_trials(&model, &[]);
        // Fitted again it is the same model; not fitted to convergence, or with another free parameter, it is not.
        assert!(cache.trials(&with(false, 30)).is_some());
        assert!(cache.trials(&with(false, 0)).is_none() && cache.trials(&with(true, 25)).is_none());
    }
}
