//! One cause in the place of two. In: the diagnosis and a model in which curves without a name stand beside other effects: named ones, or a curve of
//! the tare that readings without a cut show. Out: the model with one curve in the place of such an effect and the curves, where it explains as much.
//!
//! A rival of a name is fitted beside the curves, and a rival of a curve beside the names. If each takes half of what a third cause does, as a
//! stock that stands proud and a curve over the immersion may do of a pump that stops for a minute, none of the two is ever without the other,
//! and the third never has a place. So it is tried in the place of both. A gearbox range that raises the whole reading is likewise told as a tare
//! and some curve of the load.

use crate::effects::Multiplies;
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::forms::FORM_ROUNDS;
use crate::learn::diagnose::residual::inflation;
use crate::learn::diagnose::trial::{Trial, p_value};
use crate::learn::diagnose::unnamed::{ResidualCurve, is_shape_of, is_unnamed};
use crate::learn::model::cross_validation::held_out_residuals;
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::report::Rejected;

impl Diagnosis<'_> {
    /// The model with one curve in the place of an effect (a name, or a curve that readings without a cut show) and of the curves that are
    /// no shape of it. The curve must have no higher held-out error than what it replaces, and explain no less for its parameters.
    pub(in crate::learn) fn one_curve_for_both(&mut self, model: &Fitted) -> Option<Fitted> {
        let found: Vec<&FittedEffect> = model.model.effects.iter().filter(|each| self.is_found(each)).collect();
        found.into_iter().find_map(|own| self.one_curve_for(model, own))
    }

    /// Was it found here, and is it no curve that the loads alone show?
    fn is_found(&self, each: &FittedEffect) -> bool {
        let is_known = self.options.known.iter().any(|known| known.effect.name == each.effect.name);
        (!is_unnamed(each.effect) || self.has_own_data(each.effect)) && !is_known
    }

    /// Cost of a model that is compared with `model`: n/φ · ln RSS + k ln(n/φ) for k parameters (Schwarz 1978), with φ the inflation of
    /// the residual of `model`.
    pub(in crate::learn) fn cost_beside(&self, model: &Fitted) -> impl Fn(&Fitted) -> f64 {
        let n = self.train.used().count() as f64 / inflation(&self.train, &model.residuals(&self.train));
        move |fitted| {
            let parameters: usize = fitted.model.effects.iter().map(|each| self.parameters_of(each)).sum();
            n * fitted.squares.max(1e-300).ln() + parameters as f64 * n.max(2.0).ln()
        }
    }

    fn one_curve_for(&mut self, model: &Fitted, own: &FittedEffect) -> Option<Fitted> {
        let effects = &model.model.effects;
        let is_beside = |each: &&FittedEffect| is_unnamed(each.effect) && !self.has_own_data(each.effect);
        if !effects.iter().filter(is_beside).any(|each| !is_shape_of(own, each)) {
            return None;
        }
        let goes = |each: &FittedEffect| each.effect.name == own.effect.name || is_beside(&each);
        let stays: Vec<FittedEffect> = effects.iter().filter(|each| !goes(each)).cloned().collect();
        let without = fit(&self.train, &stays, FORM_ROUNDS)?;
        let (trial, found) = self.least_of_those_that_replace(model, &without, own)?;
        let why = format!("alone it explains as much as {} with a curve beside it", own.effect.name);
        let errors = [&stays, &trial.fitted.model.effects].map(|each| self.judgement_errors(each).rmse);
        self.evidence.push((trial.effect.name, why, p_value(&trial), errors));
        self.rejected.retain(|each| each.name != own.effect.name);
        if !is_unnamed(own.effect) {
            let along = found.covariate.name();
            let why = format!("a curve along {along} explains as much as it does with another beside it");
            self.rejected.push(Rejected { name: own.effect.name.into(), why });
        }
        Some(trial.fitted)
    }

    /// Of the curves that may stand on `without` in the place of what `model` has more, `own` among it, the one of least cost.
    fn least_of_those_that_replace(
        &self,
        model: &Fitted,
        without: &Fitted,
        own: &FittedEffect,
    ) -> Option<(Trial, ResidualCurve)> {
        let cost = self.cost_beside(model);
        let [before, of_both] =
            [without, model].map(|fitted| held_out_residuals(&self.train, &fitted.model.effects, self.split));
        // Readings without a cut show an effect on the tare. Only what acts on them too can replace it.
        let acts_on_own_data =
            |found: &ResidualCurve| !self.has_own_data(own.effect) || found.effect.multiplies == Multiplies::Reading;
        let replaces = |found: ResidualCurve| {
            if !acts_on_own_data(&found) || self.is_better(&found.fit.left, &of_both) {
                return None;
            }
            let (trial, after) = self.judged_curve(without, &before, &found)?;
            let explains_no_less = !self.is_better(&after, &of_both) && cost(&trial.fitted) <= cost(model);
            explains_no_less.then_some((trial, found))
        };
        let those = self.curves_beside(without, &before).into_iter().filter_map(replaces);
        those.min_by(|(a, _), (b, _)| cost(&a.fitted).total_cmp(&cost(&b.fitted)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::effects::named;
    use crate::effects::unnamed::{BEYOND, KNOTS};
    use crate::learn::dataset::samples::{Base, Class};
    use crate::learn::diagnose::diagnosis::Options;
    use crate::learn::diagnose::made_data::{EACH, begun, fifths, in_first, made};
    use crate::learn::model::cross_validation::Split;

    /// A curve with two values of its covariate.
    fn along(name: &str, at: [f64; 2]) -> FittedEffect {
        let effect = named(name).unwrap();
        let mut values = vec![BEYOND; KNOTS];
        values.resize(2 * KNOTS, 1.0);
        values.push(0.0);
        (values[0], values[1]) = (at[0], at[1]);
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
        let sides = in_first("up-down-asymmetry", &[0.0, 0.0]);
        let model = fit(&data, &[sides, along("unnamed-load-axial-depth", [3.0, 4.0])], FORM_ROUNDS).unwrap();
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

    /// The curve in the place of one of the tare over the spindle speed, shown by readings without a cut, and one of the load over the depth,
    /// where the tare of fast cuts is a fifth larger, and the load by a fifth in fast cuts or in deep ones.
    fn of_speed(load_is_of_speed: bool) -> Option<&'static str> {
        let (is_fast, is_deep) = (|i: usize| (i / EACH) % 4 < 2, |i: usize| (i / EACH).is_multiple_of(3));
        let is_harder = |i: usize| if load_is_of_speed { is_fast(i) } else { is_deep(i) };
        let state = |i: usize| State {
            time_s: i as f64,
            rps: if is_fast(i) { 150.0 } else { 90.0 },
            axial_depth_mm: if is_deep(i) { 4.0 } else { 3.0 },
            ..State::default()
        };
        let mut data = made(|i| if is_harder(i) { 0.2 } else { 0.0 }, 1.0, state);
        let bounds = crate::learn::dataset::samples::UNBOUNDED;
        data.base.push(Base { name: "tare".into(), unit: String::new(), class: Class::Tare, prior: None, bounds });
        data.columns.push(vec![1.0; data.len()]);
        for i in 0..data.len() {
            data.reading[i] += if is_fast(i) { 60.0 } else { 50.0 };
        }
        let split = fifths(&data);
        let options = Options { candidates: Vec::new(), ..Options::default() };
        let mut diagnosis = begun(&data, &split, &options, 1.0);
        let of_tare = along("unnamed-tare-spindle-speed", [90.0, 150.0]);
        diagnosis.shown_by_idle = vec![of_tare.clone()];
        let model = fit(&data, &[of_tare, along("unnamed-load-axial-depth", [3.0, 4.0])], FORM_ROUNDS).unwrap();
        Some(diagnosis.one_curve_for_both(&model)?.model.effects[0].effect.name)
    }

    #[test]
    fn what_readings_without_a_cut_show_gives_way_to_one_cause_of_the_whole_reading_alone() {
        assert_eq!(of_speed(true), Some("unnamed-reading-spindle-speed"));
        assert_eq!(of_speed(false), None);
    }
}
