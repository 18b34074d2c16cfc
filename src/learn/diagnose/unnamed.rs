//! What follows a covariate and bears no name: as a rival of the effects that do, and as an effect of its own where
//! none of them explains it. In: a diagnosis, a model, what it leaves on data left out. Out: curves that the residual
//! follows ([`super::free_curve`]), and the model with the best of them ([`crate::effects::unnamed`]).
//!
//! A curve takes the shape of anything that depends on its covariate. If one along a covariate that an effect knows
//! nothing of explains more than the effect does in any shape, the effect only stands in for what is not in the list.

use crate::effects::unnamed::{BEYOND, CURVES, KNOTS};
use crate::effects::{Covariate, Effect, Multiplies};
use crate::learn::dataset::samples::{Class, Data};
use crate::learn::diagnose::criteria::{
    ENGAGEMENT_KNOWN_TO, LEAST_EXCESS, NOISE_KNOWN_TO, follows_a_curve, is_clearly_better, lowers_held_out,
    takes_enough,
};
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::forms::FORM_ROUNDS;
use crate::learn::diagnose::free_curve::{Curve, Follows, Residual};
use crate::learn::diagnose::trial::{Trial, score_of};
use crate::learn::model::cross_validation::{certainty_of_gain, held_out_residuals, improvement_by_case, t_statistic};
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{Fitted, fit, part};
use rayon::prelude::*;

/// Curves whose fit is judged on data left out, best first.
const JUDGED: usize = 3;

/// Curves that are fitted together with the model before the best of them is sought, best first.
const FITTED: usize = 6;

/// A curve that a residual follows.
pub(in crate::learn) struct Found {
    pub(in crate::learn) covariate: Covariate,
    pub(in crate::learn) effect: &'static Effect,
    pub(in crate::learn) follows: Follows,
}

/// Rank of what only grows while the program runs.
pub(in crate::learn) const LAST_RANK: usize = 2;

/// What is preferred where a residual follows several covariates as well: a quantity of the process, then a place, then
/// anything that only grows while the program runs.
pub(in crate::learn) fn rank(covariate: Covariate) -> usize {
    match covariate {
        Covariate::X | Covariate::Y => 1,
        Covariate::Sliding | Covariate::Volume | Covariate::Time => LAST_RANK,
        _ => 0,
    }
}

/// Can what a spindle takes while nothing is cut follow it? A tare that follows depth, immersion, chip or the way since entry
/// is load of the cut, put where no limit of the tool sees it.
pub(in crate::learn) fn is_there_without_a_cut(covariate: Covariate) -> bool {
    use Covariate::{Heading, PathAcceleration, PathSpeed, Slope, SpindleSpeed, Time, Tool, X, Y, Z};
    matches!(covariate, Time | SpindleSpeed | PathSpeed | PathAcceleration | Tool | Heading | Slope | X | Y | Z)
}

/// Is it a curve, and not an effect of the list?
pub(in crate::learn) fn is_unnamed(effect: &Effect) -> bool {
    CURVES.iter().any(|(_, curve)| curve.name == effect.name)
}

impl Diagnosis<'_> {
    /// Every curve that is wanted, of what a model leaves, least squares first.
    pub(in crate::learn) fn curves(
        &self,
        present: &Fitted,
        left: &[f64],
        wanted: impl Fn(Covariate, Multiplies) -> bool + Sync,
    ) -> Vec<Found> {
        let data = &self.train;
        let (cut, tare) = (self.cut(present), part(data, present, &[Class::Tare]));
        let open = CURVES.par_iter().filter(|(covariate, effect)| wanted(*covariate, effect.multiplies));
        let found = open.filter_map(|(covariate, effect)| {
            let load = if effect.multiplies == Multiplies::Tare { &tare } else { &cut };
            let values: Vec<f64> = data.state.iter().map(|state| covariate.of(state)).collect();
            let follows = Residual { data, split: self.split, left, load }.follows(&values)?;
            Some(Found { covariate: *covariate, effect, follows })
        });
        let mut found: Vec<Found> = found.collect();
        found.sort_by(|a, b| a.follows.squares.total_cmp(&b.follows.squares));
        found
    }

    /// The same, the best of them fitted together with the model: alone a curve has to share the residual with coefficients
    /// that already bend towards what it shows.
    pub(in crate::learn) fn fitted_curves(
        &self,
        present: &Fitted,
        left: &[f64],
        wanted: impl Fn(Covariate, Multiplies) -> bool + Sync,
    ) -> Vec<Found> {
        let mut found = self.curves(present, left, wanted);
        found.iter_mut().take(FITTED).for_each(|each| self.fit_together(present, each));
        found.sort_by(|a, b| a.follows.squares.total_cmp(&b.follows.squares));
        found
    }

    /// Fits a curve together with the model.
    fn fit_together(&self, model: &Fitted, found: &mut Found) {
        let each = as_effect(found.effect, &found.follows.curve);
        let effects: Vec<FittedEffect> = model.model.effects.iter().cloned().chain([each]).collect();
        let Some(fitted) = fit(&self.train, &effects, FORM_ROUNDS) else { return };
        let left = held_out_residuals(&self.train, &fitted.model.effects, self.split);
        let finite = self.train.used().filter(|i| left[*i].is_finite());
        let squares = finite.map(|i| self.train.weight[i] * left[i].powi(2)).sum();
        if squares < found.follows.squares {
            (found.follows.left, found.follows.squares) = (left, squares);
        }
    }

    /// What a model leaves when the best curve of those wanted is taken from it as well, if that is clear.
    pub(in crate::learn) fn less_any_shape(
        &self,
        model: &Fitted,
        left: &[f64],
        wanted: impl Fn(Covariate, Multiplies) -> bool + Sync,
    ) -> Vec<f64> {
        let best = self.curves(model, left, wanted).into_iter().next();
        let better = best.filter(|found| self.is_better(left, &found.follows.left));
        better.map_or_else(|| left.to_vec(), |found| found.follows.left)
    }

    /// Does `after` leave clearly less than `before`, block by block?
    pub(in crate::learn) fn is_better(&self, before: &[f64], after: &[f64]) -> bool {
        is_clearly_better(t_statistic(&improvement_by_case(&self.train, before, after)))
    }

    /// The curves that may stand beside a model without a name, least squares first.
    pub(in crate::learn) fn curves_beside(&self, present: &Fitted, left: &[f64]) -> Vec<Found> {
        let has = |effect: &Effect| present.model.effects.iter().any(|each| each.effect.name == effect.name);
        // In a table nothing is read without a cut: there a curve of the tare may be a step on the way to the name.
        let is_series = self.data.is_series();
        let may_follow = |covariate, part| !is_series || part == Multiplies::Load || is_there_without_a_cut(covariate);
        // The coefficients of a few dozen cuts bend far towards what a curve would show, so there it is fitted with them. In logs,
        // curves fitted with the model took the place of laws that were right (a chipped edge, a cutting speed).
        let mut found = if is_series {
            self.curves(present, left, may_follow)
        } else {
            self.fitted_curves(present, left, may_follow)
        };
        found.retain(|each| !has(each.effect));
        found
    }

    /// The model with the curve that explains most of what it leaves; `None` where none is clear.
    pub(in crate::learn) fn with_unnamed(&mut self, present: &Fitted) -> Option<Fitted> {
        let before = held_out_residuals(&self.train, &present.model.effects, self.split);
        let clear = |found: &Found| {
            let t = certainty_of_gain(&self.train, &before, &found.follows.left);
            follows_a_curve(self.drop_of(&before, &found.follows.left), t)
        };
        let mut found = self.curves_beside(present, &before);
        found.retain(clear);
        self.tried += found.len();
        let least = &found.first()?.follows.left.clone();
        // Of those that no other is clearly ahead of, what says most about the process comes first.
        let as_good = |each: &Found| !self.is_better(&each.follows.left, least);
        found.sort_by_key(|each| if as_good(each) { rank(each.covariate) } else { usize::MAX });
        let judged = found.iter().take(JUDGED).find_map(|each| self.judged_curve(present, &before, each));
        let (trial, after) = judged?;
        let share = self.share_of_excess(&before, &after, &before, LEAST_EXCESS);
        let text = format!(
            "no effect of the list explains it; the curve takes away {:.0} % of what is left beyond the noise",
            100.0 * share.min(1.0)
        );
        let errors = [self.judged(&present.model.effects), self.judged(&trial.fitted.model.effects)];
        let p = self.p_of_the_search(&trial);
        self.evidence.push((trial.effect.name, text, p, errors.map(|e| e.rmse)));
        Some(trial.fitted)
    }

    /// The curve fitted together with the model, and what both leave on data left out; `None` where that is not less.
    pub(in crate::learn) fn judged_curve(
        &self,
        present: &Fitted,
        before: &[f64],
        found: &Found,
    ) -> Option<(Trial, Vec<f64>)> {
        let each = as_effect(found.effect, &found.follows.curve);
        let effects: Vec<FittedEffect> = present.model.effects.iter().cloned().chain([each.clone()]).collect();
        let fitted = fit(&self.train, &effects, FORM_ROUNDS)?;
        let (score, gain) = score_of(&self.train, present, &fitted, each.asked());
        // A factor on its bound belongs to a part that the data do not tell.
        let is_told = fitted.model.effects.last().is_some_and(|last| {
            let inside = |k: usize| {
                let parameter = &last.effect.parameters[k];
                last.values[k] > parameter.min && last.values[k] < parameter.max
            };
            (KNOTS..2 * KNOTS).filter(|k| last.free[*k]).all(inside)
        });
        if score < self.threshold() || !is_told {
            return None;
        }
        let after = held_out_residuals(&self.train, &fitted.model.effects, self.split);
        let t = certainty_of_gain(&self.train, before, &after);
        let share = self.share_of_excess(before, &after, &self.base_residual, LEAST_EXCESS);
        let of_rest = self.share_of_excess(before, &after, before, NOISE_KNOWN_TO);
        let shows = lowers_held_out(self.drop_of(before, &after), t)
            && takes_enough(share, of_rest)
            && self.change_of_load(present, before, &after) >= ENGAGEMENT_KNOWN_TO;
        shows.then_some((Trial { effect: found.effect, fitted, gain, score }, after))
    }
}

/// A curve as the effect that it is: factors over that of its heaviest part, which stays 1 beside the base coefficients.
fn as_effect(effect: &'static Effect, curve: &Curve) -> FittedEffect {
    let heaviest = curve.weight.iter().copied().fold(0.0, f64::max);
    let level = curve.weight.iter().position(|w| *w == heaviest).unwrap_or(0);
    let n = curve.knots.len().min(KNOTS);
    let reference = (1.0 + curve.knots[level][1]).max(0.05);
    let bounds = (effect.parameters[KNOTS].min, effect.parameters[KNOTS].max);
    let factor = |k: usize| ((1.0 + curve.knots[k][1]) / reference).clamp(bounds.0, bounds.1);
    let at = (0..KNOTS).map(|k| if k < n { curve.knots[k][0] } else { BEYOND });
    let factors = (0..KNOTS).map(|k| if k < n { factor(k) } else { 1.0 });
    let free = |k: usize| (KNOTS..KNOTS + n).contains(&k) && curve.weight[k - KNOTS] < heaviest;
    let steps = f64::from(u8::from(curve.in_steps));
    FittedEffect {
        effect,
        values: at.chain(factors).chain([steps]).collect(),
        free: (0..=2 * KNOTS).map(free).collect(),
    }
}

/// The data with the reading that a model has for every sample, as a covariate of its own.
pub(in crate::learn) fn with_predicted_loads(data: &Data, predicted: &[f64]) -> Data {
    let mut data = data.clone();
    data.state.iter_mut().zip(predicted).for_each(|(state, load)| state.load = *load);
    data
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::learn::dataset::samples::{Base, UNBOUNDED};
    use crate::learn::model::cross_validation::Split;
    use crate::path::Vec3;

    #[test]
    fn a_tare_follows_nothing_that_only_a_cut_has() {
        use Covariate::{
            AxialDepth, ChipThickness, Curvature, FeedPerTooth, Load, RadialDepth, SinceEntry, Sliding, UpShare, Volume,
        };
        let of_cut = [
            FeedPerTooth,
            ChipThickness,
            AxialDepth,
            RadialDepth,
            UpShare,
            SinceEntry,
            Curvature,
            Load,
            Sliding,
            Volume,
        ];
        for (covariate, _) in CURVES {
            assert_ne!(is_there_without_a_cut(*covariate), of_cut.contains(covariate), "{}", covariate.name());
        }
    }

    #[test]
    fn the_heaviest_part_of_a_curve_is_the_base_and_the_others_are_fitted() {
        let effect = crate::effects::named("unnamed-load-z").unwrap();
        let curve = Curve { knots: vec![[-9.0, 0.17], [-4.5, -0.02]], weight: vec![10.0, 90.0], in_steps: true };
        let each = as_effect(effect, &curve);
        assert_eq!(crate::effects::unnamed::knots(&each.values), [[-4.5, 1.17 / 0.98], [-4.5, 1.0]]);
        assert_eq!(each.asked(), 1);
        assert!(effect.is_physical(&each.values) && is_unnamed(effect));
        assert!(!is_unnamed(crate::effects::named("flank-wear").unwrap()));
    }

    #[test]
    fn a_curve_knows_nothing_of_what_only_the_samples_left_out_show() {
        // Six passes at depths of their own, by turns a fifth easier and harder.
        let (blocks, each) = (6, 20);
        let n = blocks * each;
        let harder = |i: usize| if (i / each).is_multiple_of(2) { 1.2 } else { 0.8 };
        let load: Vec<f64> = (0..n).map(|i| 100.0 + 10.0 * (i % 7) as f64).collect();
        let state = |i: usize| State { position: Vec3::new(0.0, 0.0, (i / each) as f64), ..State::default() };
        let data = Data {
            base: vec![Base {
                name: "k_tc".into(),
                unit: String::new(),
                class: Class::Cutting,
                prior: None,
                bounds: UNBOUNDED,
            }],
            reading: (0..n).map(|i| load[i] * harder(i)).collect(),
            columns: vec![load],
            weight: vec![1.0; n],
            state: (0..n).map(state).collect(),
            block: (0..n).map(|i| i / each).collect(),
            ..table_of(n)
        };
        let split = Split { test: vec![false; n], fold: data.block.clone(), folds: blocks, how: String::new() };
        let effect = crate::effects::named("unnamed-load-z").unwrap();
        let knots = (0..blocks).map(|k| [k as f64, harder(k * each) - 1.0]).collect();
        let curve = as_effect(effect, &Curve { knots, weight: vec![10.0, 9.0, 8.0, 7.0, 6.0, 5.0], in_steps: true });
        // All of them are followed to the end where every one is seen.
        assert!(fit(&data, std::slice::from_ref(&curve), FORM_ROUNDS).unwrap().squares < 1e-6);
        let squares = |effects: &[FittedEffect]| -> f64 {
            held_out_residuals(&data, effects, &split).iter().map(|r| r * r).sum()
        };
        assert!(squares(&[curve]) > 0.8 * squares(&[]));
    }

    /// Samples of a table without anything of their own.
    fn table_of(n: usize) -> Data {
        Data {
            span_s: vec![1.0; n],
            readings_per_sample: vec![1.0; n],
            run: (0..n).collect(),
            channel: vec![0; n],
            kind: vec![0; n],
            ..Data::default()
        }
    }

    #[test]
    fn time_is_the_last_that_a_residual_may_follow() {
        assert!(rank(Covariate::Z) < rank(Covariate::X) && rank(Covariate::Y) < rank(Covariate::Time));
    }
}
