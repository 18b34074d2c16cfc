//! Searches that begin with each of the effects that may come first. In: the diagnosis, the model it begins with. Out: of the models at which
//! these searches end, the one of least cost, and what its effects are confounded with.
//!
//! Of two causes at once, a third that resembles a little of both may explain more than either alone: of a smaller cutter and losses of the
//! drive, stock that stands proud. Effects are added one after the other, and exchanged one for one: from there the two are out of reach.

use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::search::Passed;
use crate::learn::diagnose::unnamed::is_unnamed;
use crate::learn::model::cross_validation::held_out_residuals;
use crate::learn::model::fit::Fitted;
use crate::learn::report::Confounded;
use rayon::prelude::*;

/// Most searches, a bound on the time: with three, logs of twelve minutes took up to a third longer than with one.
const WAYS: usize = 3;

impl Diagnosis<'_> {
    /// See the head of the file. An effect that is in the model of the first search is not begun with: that model already has it.
    pub(in crate::learn) fn least_of_the_ways(&mut self, begin: &Fitted) -> (Fitted, Vec<Confounded>) {
        let mut firsts = self.passing(begin, true).into_iter();
        let start = self.clone();
        let best = self.search_after(begin, firsts.next());
        let has = |first: &Passed| best.0.model.effects.iter().any(|each| each.effect.name == first.trial.effect.name);
        let others: Vec<Passed> = firsts.take(WAYS - 1).filter(|first| !has(first)).collect();
        let from = |first| {
            let mut way = Diagnosis { cache: self.cache.clone(), tried: self.tried, ..start.clone() };
            let end = way.search_after(begin, Some(first));
            (way, end)
        };
        let mut ways: Vec<_> = others.into_par_iter().map(from).collect();
        let models: Vec<&Fitted> = ways.iter().map(|(_, (model, _))| model).collect();
        let Some(least) = self.least_of(&best.0, &models) else { return best };
        let (way, end) = ways.swap_remove(least);
        *self = way;
        end
    }

    /// Of other models the one of least cost, if that is below the cost of this one, and its held-out error not clearly above. It may need no
    /// more curves without a name: these correct a wrong name as well as a true one. Nor may it only have names beside all of this one, where the
    /// search has refused them; in the place of a curve they may stand.
    fn least_of(&self, best: &Fitted, others: &[&Fitted]) -> Option<usize> {
        let cost = self.cost_beside(best);
        let left_out = |model: &Fitted| held_out_residuals(&self.train, &model.model.effects, self.split);
        let left = left_out(best);
        let own = names(best);
        let curves = |model: &Fitted| model.model.effects.len() - names(model).len();
        let has_all = |other: &Fitted| !own.is_empty() && own.iter().all(|name| names(other).contains(name));
        let has_more = |other: &Fitted| has_all(other) && names(other).len() > own.len();
        let only_adds = |other: &Fitted| has_more(other) && curves(other) == curves(best);
        let is_less = |other: &Fitted| {
            curves(other) <= curves(best)
                && !only_adds(other)
                && cost(other) < cost(best)
                && !self.is_better(&left_out(other), &left)
        };
        let less = (0..others.len()).filter(|k| is_less(others[*k]));
        less.min_by(|a, b| cost(others[*a]).total_cmp(&cost(others[*b])))
    }
}

/// The effects of a model that have a name.
fn names(model: &Fitted) -> Vec<&str> {
    model.model.effects.iter().filter(|each| !is_unnamed(each.effect)).map(|each| each.effect.name).collect()
}

#[cfg(test)]
mod tests {
    use crate::effects::unnamed::{BEYOND, KNOTS};
    use crate::effects::{State, named};
    use crate::learn::diagnose::diagnosis::Options;
    use crate::learn::diagnose::forms::FORM_ROUNDS;
    use crate::learn::diagnose::made_data::{EACH, begun, fifths, in_first, made};
    use crate::learn::model::design::FittedEffect;
    use crate::learn::model::fit::{Fitted, fit};

    /// Which of four models costs less than one with these names, if the load depends on milling mode and speed by these shares. The fourth has a curve.
    fn least(shares: [f64; 2], beside: &[&str]) -> Option<usize> {
        least_beside(shares, beside, &[])
    }

    /// The same where curves over the speed, bent at these two, rps, stand beside the names.
    fn least_beside(shares: [f64; 2], beside: &[&str], bends_rps: &[[f64; 2]]) -> Option<usize> {
        let turn = |i: usize, every: usize| if ((i / EACH) / every).is_multiple_of(2) { 1.0 } else { -1.0 };
        let state = |i: usize| State {
            up_share: turn(i, 1),
            up_share_chip: turn(i, 1),
            cutting_speed_mm_s: 3000.0 + 1000.0 * turn(i, 2),
            rps: 90.0 + 30.0 * turn(i, 2),
            ..State::default()
        };
        let data = made(|i| shares[0] * turn(i, 1) + shares[1] * turn(i, 2), 1.0, state);
        let (split, options) = (fifths(&data), Options { candidates: Vec::new(), ..Options::default() });
        let with = |names: &[&str]| {
            let each = |name: &&str| in_first(name, &[0.0]);
            fit(&data, &names.iter().map(each).collect::<Vec<_>>(), FORM_ROUNDS).unwrap()
        };
        let both = ["up-down-asymmetry", "cutting-speed"];
        let curve = |bends: [f64; 2]| {
            let at = |k: usize| bends.get(k).copied().unwrap_or(BEYOND);
            let values: Vec<f64> = (0..KNOTS).map(at).chain(vec![1.0; KNOTS]).chain([0.0]).collect();
            let free = (0..values.len()).map(|k| k == KNOTS + 1).collect();
            FittedEffect { effect: named("unnamed-load-spindle-speed").unwrap(), values, free }
        };
        let with_curves = |model: &Fitted, bends: &[[f64; 2]]| {
            let curves = bends.iter().map(|bends| curve(*bends)).collect();
            fit(&data, &[model.model.effects.clone(), curves].concat(), FORM_ROUNDS).unwrap()
        };
        let [up, fast, both] = [&both[..1], &both[1..], &both].map(with);
        let corrected = with_curves(&up, &[[60.0, 120.0]]);
        let models = [&up, &fast, &both, &corrected];
        begun(&data, &split, &options, 1.0).least_of(&with_curves(&with(beside), bends_rps), &models)
    }

    #[test]
    fn the_model_of_least_cost_has_each_cause_there_is_and_no_other() {
        assert_eq!(least([0.1, 0.1], &[]), Some(2));
        assert_eq!(least([0.1, 0.0], &[]), Some(0));
        assert_eq!(least([0.0, 0.1], &[]), Some(1));
        assert_eq!(least([0.0, 0.0], &[]), None);
    }

    #[test]
    fn a_name_that_was_refused_beside_another_does_not_come_back_another_way() {
        assert_eq!(least([0.12, 0.1], &["up-down-asymmetry"]), None);
    }

    #[test]
    fn a_name_may_stand_in_the_place_of_a_curve_that_explains_less() {
        // No speed is above the bends.
        let useless = [[300.0, 400.0]];
        assert_eq!(least_beside([0.1, 0.1], &["up-down-asymmetry"], &useless), Some(2));
        assert_eq!(least_beside([0.1, 0.0], &["up-down-asymmetry"], &[[60.0, 120.0]]), Some(0));
    }
    #[test]
    fn the_same_name_in_a_form_of_less_cost_takes_the_place_of_the_other() {
        let up = |i: usize| if (i / EACH).is_multiple_of(2) { 1.0 } else { -1.0 };
        let data = made(|i| 0.1 * up(i), 1.0, |i| State { up_share: up(i), up_share_chip: up(i), ..State::default() });
        let (split, options) = (fifths(&data), Options { candidates: Vec::new(), ..Options::default() });
        let with = |values: &[f64]| fit(&data, &[in_first("up-down-asymmetry", values)], FORM_ROUNDS).unwrap();
        // These loads have no edge coefficients: a second parameter changes nothing.
        let [one, two] = [with(&[0.0]), with(&[0.0; 2])];
        let search = begun(&data, &split, &options, 1.0);
        assert_eq!([search.least_of(&two, &[&one]), search.least_of(&one, &[&two])], [Some(0), None]);
    }
}
