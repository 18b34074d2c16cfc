//! Whether what was found stands alone. In: the diagnosis and the model at the end of a search. Out: the model in which
//! a name has given way to what clearly explains more in its place; and beside each name that stays what explains as much.
//!
//! A name is found by what it adds to the model before it. That it is the right one shows only at the end, beside all the
//! others: each is taken out in turn, and every other effect and every curve along what it does not follow is fitted in its
//! place. Judged is what they leave on data left out; of the name, in any shape along its own covariates, for real effects
//! never have the form of the list.

use crate::effects::{Covariate, Effect, Multiplies};
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::evidence::Present;
use crate::learn::diagnose::forms::{FORM_ROUNDS, is_shape_of, remove};
use crate::learn::diagnose::trial::{Trial, p_value, score_of, unphysical};
use crate::learn::diagnose::unnamed::{LAST_RANK, ResidualCurve, is_there_without_a_cut, is_unnamed, rank};
use crate::learn::model::cross_validation::{certainty_of_gain, improvement_by_case, t_statistic};
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::report::{Confounded, Rejected};

/// Most rivals that are said beside a name: those with a name, best first, then the curves.
const SAID: usize = 3;

/// What may stand in the place of an effect.
enum Rival {
    Named(Trial),
    Curve(ResidualCurve),
}

/// The place of one effect in a model, without it.
struct Contest<'a> {
    own: &'a FittedEffect,
    /// Log-likelihood ratio of the effect there, by samples that count.
    gain: f64,
    present: Present<'a>,
    /// What the effect leaves there on data left out, in any shape along what it follows.
    shaped: Vec<f64>,
    /// Everything else, with what it leaves, least first.
    rivals: Vec<(Rival, Vec<f64>)>,
}

impl Rival {
    fn said(&self) -> String {
        match self {
            Self::Named(trial) => trial.effect.name.to_owned(),
            Self::Curve(found) => {
                let of = word(found.effect.multiplies);
                format!("a curve of the {of} along {}", found.covariate.name())
            }
        }
    }
}

/// The part of a reading in a word.
pub(in crate::learn) fn word(part: Multiplies) -> &'static str {
    match part {
        Multiplies::Load => "load",
        Multiplies::Tare => "tare",
        Multiplies::Reading => "reading",
    }
}

/// What a contest for every place of a model comes to.
pub(in crate::learn) enum Outcome {
    /// The model with something else in the place of a name that it clearly explains more than.
    Exchanged(Fitted),
    /// Every name holds its place; what each cannot be told from.
    Holds(Vec<Confounded>),
}

impl Diagnosis<'_> {
    /// Holds every name of a model against what may stand in its place.
    pub(in crate::learn) fn contested(&mut self, model: &Fitted, may_exchange: bool) -> Outcome {
        let mut in_doubt = Vec::new();
        for e in self.open_places(model) {
            // Curves over its own covariates are its shape: they leave the model with it.
            let own = &model.model.effects[e];
            let others = remove(&model.model.effects, e).into_iter().filter(|each| !is_shape_of(own, each));
            let Some(without_it) = fit(&self.train, &others.collect::<Vec<_>>(), FORM_ROUNDS) else { continue };
            let contest = self.contest(model, e, &without_it);
            if let Some(exchanged) = may_exchange.then(|| self.winner(&contest)).flatten() {
                return Outcome::Exchanged(exchanged);
            }
            in_doubt.extend(self.doubt(&contest));
        }
        Outcome::Holds(in_doubt)
    }

    /// What a name cannot be told from.
    fn doubt(&self, contest: &Contest) -> Option<Confounded> {
        let own = contest.own.effect;
        let drop = |left: &[f64]| self.drop_of(&contest.present.left, left);
        let as_good = |rival: &Rival, left: &[f64]| {
            let worse = t_statistic(&improvement_by_case(&self.train, left, &contest.shaped));
            // An instant or a place is looked for anew without each fold: of two such the likelihood is the fairer judge.
            let are_looked_for = |trial: &Trial| own.is_looked_for() && trial.effect.is_looked_for();
            let is_as_likely = |trial: &Trial| contest.gain - trial.gain < self.criteria().confounded_within;
            let as_likely = matches!(rival, Rival::Named(trial) if are_looked_for(trial) && is_as_likely(trial));
            as_likely || self.criteria().leaves_as_much(drop(left) / drop(&contest.shaped).max(1e-12), worse)
        };
        let as_good = contest.rivals.iter().filter(|(rival, left)| as_good(rival, left)).map(|(rival, _)| rival);
        // What a cut can part from it comes first.
        let (named, curves): (Vec<&Rival>, Vec<&Rival>) = as_good.partition(|rival| matches!(rival, Rival::Named(_)));
        let rivals: Vec<&Rival> = named.into_iter().chain(curves).take(SAID).collect();
        let apart = rivals.iter().filter_map(|rival| match rival {
            Rival::Named(trial) => Some(trial.effect.separated_by),
            Rival::Curve(_) => None,
        });
        let experiment: Vec<&str> = std::iter::once(own.separated_by).chain(apart).collect();
        (!rivals.is_empty()).then(|| Confounded {
            names: std::iter::once(own.name.to_owned()).chain(rivals.iter().map(|r| r.said())).collect(),
            why: "in its place each leaves as little on data left out".to_owned(),
            experiment: experiment.join("; "),
        })
    }

    /// The effects of a model that have a name and were found by what they leave.
    fn open_places(&self, model: &Fitted) -> Vec<usize> {
        let is_open = |each: &FittedEffect| !is_unnamed(each.effect) && !self.is_timed(each.effect);
        (0..model.model.effects.len()).filter(|e| is_open(&model.model.effects[*e])).collect()
    }

    /// See [`Contest`].
    fn contest<'a>(&mut self, model: &'a Fitted, e: usize, without_it: &'a Fitted) -> Contest<'a> {
        let own = &model.model.effects[e];
        let present = self.present(without_it);
        let others = without_it.model.effects.iter().cloned();
        let found = fit(&self.train, &others.chain([own.clone()]).collect::<Vec<_>>(), FORM_ROUNDS);
        let found = found.unwrap_or_else(|| model.clone());
        let (score, gain) = score_of(&self.train, without_it, &found, own.asked());
        let trial = Trial { effect: own.effect, fitted: found, gain, score };
        let left = self.unseen_residuals(without_it, &trial);
        let shaped = self.less_any_shape(&trial.fitted, &left, |covariate, part| follows(own.effect, covariate, part));
        let mut rivals: Vec<(Rival, Vec<f64>)> = Vec::new();
        for trial in self.trials(without_it, false) {
            let sound = unphysical(trial.fitted.model.effects.last(), self.data.clock_s).is_none();
            if trial.effect.name != own.effect.name && sound && trial.score > self.threshold() {
                let left = self.unseen_residuals(without_it, &trial);
                rivals.push((Rival::Named(trial), left));
            }
        }
        let wanted = |covariate, part| {
            !follows(own.effect, covariate, part) && (part == Multiplies::Load || is_there_without_a_cut(covariate))
        };
        for found in self.fitted_curves(without_it, &present.left, wanted) {
            let left = found.follows.left.clone();
            rivals.push((Rival::Curve(found), left));
        }
        rivals.sort_by(|a, b| self.drop_of(&present.left, &b.1).total_cmp(&self.drop_of(&present.left, &a.1)));
        Contest { own, gain, present, shaped, rivals }
    }

    /// Does a rival leave clearly less than a name? What only grows while the program runs must show as much as a curve of its
    /// own has to: time is the answer only where no quantity of the process is as good.
    fn takes_the_place(&self, rival: &Rival, shaped: &[f64], left: &[f64]) -> bool {
        let is_late = matches!(rival, Rival::Curve(found) if rank(found.covariate) == LAST_RANK);
        let t = t_statistic(&improvement_by_case(&self.train, shaped, left));
        if is_late {
            self.criteria().follows_a_curve(self.drop_of(shaped, left), certainty_of_gain(&self.train, shaped, left))
        } else {
            self.criteria().is_clearly_better(t)
        }
    }

    /// The model with the best rival, where that leaves clearly less than the name in any shape, and stands every test of
    /// what is added.
    fn winner(&mut self, contest: &Contest) -> Option<Fitted> {
        let Contest { own, present, shaped, rivals, .. } = contest;
        let (rival, left) = rivals.first()?;
        if !self.takes_the_place(rival, shaped, left) {
            return None;
        }
        let (trial, why) = match rival {
            Rival::Named(trial) => {
                self.shown(present, trial).ok()?;
                let why = format!("in the place of {} it leaves less on data left out", own.effect.name);
                (Trial { effect: trial.effect, fitted: trial.fitted.clone(), ..*trial }, why)
            }
            Rival::Curve(found) => {
                let (trial, _) = self.judged_curve(present.model, &present.left, found)?;
                (trial, format!("the curve leaves less on data left out than {} in any shape", own.effect.name))
            }
        };
        let errors = [&present.model.model.effects, &trial.fitted.model.effects].map(|each| self.judged(each).rmse);
        self.evidence.push((trial.effect.name, why, p_value(&trial), errors));
        self.rejected.retain(|r| r.name != trial.effect.name && r.name != own.effect.name);
        self.rejected.push(Rejected {
            name: own.effect.name.into(),
            why: format!("{} leaves clearly less on data left out", rival.said()),
        });
        Some(trial.fitted)
    }
}

/// Is a curve along this covariate a shape of the effect? Of one that only knows how long the program has run, along
/// anything that only grows with it.
fn follows(effect: &Effect, covariate: Covariate, part: Multiplies) -> bool {
    let is_late = effect.covariates.iter().all(|own| rank(*own) == LAST_RANK);
    effect.knows(covariate, part) || (is_late && rank(covariate) == LAST_RANK && effect.multiplies == part)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{State, named};
    use crate::learn::dataset::samples::Data;
    use crate::learn::diagnose::diagnosis::Options;
    use crate::learn::diagnose::made_data::{EACH, begun, fifths, made};
    use crate::path::Vec3;

    /// Blocks each cut up or climb and at a height; `share` of the load is missing there.
    fn blocks(up: impl Fn(usize) -> f64, z_mm: impl Fn(usize) -> f64, share: impl Fn(usize) -> f64) -> Data {
        let state = |i: usize| State {
            time_s: i as f64,
            position: Vec3::new((i * 31 % EACH) as f64, 0.0, z_mm(i / EACH)),
            up_share: up(i / EACH),
            up_share_chip: up(i / EACH),
            ..State::default()
        };
        made(|i| share(i / EACH), 1.0, state)
    }

    /// The contest for the place of `up-down-asymmetry`, fitted to the data.
    fn contested(data: &Data) -> Outcome {
        let split = fifths(data);
        let up_down = named("up-down-asymmetry").unwrap();
        let options = Options { candidates: vec![up_down], ..Options::default() };
        let each = FittedEffect { effect: up_down, values: vec![0.1, 0.0], free: vec![true, false] };
        let model = fit(data, &[each], FORM_ROUNDS).unwrap();
        begun(data, &split, &options, 1.0).contested(&model, true)
    }

    /// +1 or −1 for each block, by turns of `every`.
    fn by_turns(every: usize) -> impl Fn(usize) -> f64 {
        move |block| if (block / every).is_multiple_of(2) { 1.0 } else { -1.0 }
    }

    #[test]
    fn a_name_holds_its_place_where_nothing_else_explains_as_much() {
        let up = by_turns(1);
        let data = blocks(&up, by_turns(3), |block| 0.2 * up(block));
        assert!(matches!(contested(&data), Outcome::Holds(in_doubt) if in_doubt.is_empty()));
    }

    #[test]
    fn a_name_gives_way_to_a_curve_that_clearly_explains_more() {
        // What is missing goes with the height; three of four blocks above are cut up, and three of four below climb.
        let z = by_turns(4);
        let up = |block: usize| if block.is_multiple_of(4) { -z(block) } else { z(block) };
        let data = blocks(up, &z, |block| 0.2 * z(block));
        let Outcome::Exchanged(fitted) = contested(&data) else { panic!("the name stays") };
        let names: Vec<&str> = fitted.model.effects.iter().map(|each| each.effect.name).collect();
        assert_eq!(names, ["unnamed-load-z"]);
    }

    #[test]
    fn a_name_is_in_doubt_beside_a_curve_that_explains_as_much() {
        let up = by_turns(1);
        let data = blocks(&up, &up, |block| 0.2 * up(block));
        let Outcome::Holds(in_doubt) = contested(&data) else { panic!("the name goes") };
        assert_eq!(in_doubt[0].names, ["up-down-asymmetry", "a curve of the load along position z"]);
        assert!(in_doubt[0].experiment.contains("up and climb"));
    }

    #[test]
    fn beside_a_name_three_that_explain_as_much_are_said_and_not_a_fourth() {
        // Height, depth, width, curvature and speed of the spindle change together with the way of milling, as many as are asked for.
        let up = by_turns(1);
        let said = |together: usize| {
            let mut data = blocks(&up, by_turns(3), |block| 0.2 * up(block));
            for (i, state) in data.state.iter_mut().enumerate() {
                let go = |k: usize| if k < together { up(i / EACH) } else { 0.0 };
                state.axial_depth_mm = 3.0 + go(0);
                state.radial_depth_mm = 5.0 + go(1);
                state.curvature_per_mm = 0.1 + 0.05 * go(2);
                state.rps = 100.0 + go(3);
            }
            let Outcome::Holds(in_doubt) = contested(&data) else { panic!("the name goes") };
            in_doubt[0].names.len() - 1
        };
        assert_eq!([1, 2, 3, 4].map(said), [1, 2, 3, 3]);
    }

    #[test]
    fn a_name_gives_way_to_time_where_that_clearly_explains_more_and_not_where_it_explains_as_much() {
        // What is missing begins half way. Three of four blocks before it are cut climb, three of four after it up.
        let late = by_turns(12);
        let mostly = |block: usize| if block.is_multiple_of(4) { late(block) } else { -late(block) };
        let share = |block: usize| -0.2 * late(block);
        let Outcome::Exchanged(fitted) = contested(&blocks(mostly, by_turns(1), share)) else {
            panic!("the name stays")
        };
        assert_eq!(fitted.model.effects[0].effect.name, "unnamed-load-time");
        let as_good = contested(&blocks(|block| -late(block), by_turns(1), share));
        assert!(matches!(as_good, Outcome::Holds(_)));
    }

    #[test]
    fn what_grows_with_the_program_is_a_shape_of_what_only_knows_its_time() {
        let chipping = named("edge-chipping").unwrap();
        assert!(follows(chipping, Covariate::Sliding, Multiplies::Load));
        assert!(
            !follows(chipping, Covariate::Sliding, Multiplies::Tare)
                && !follows(chipping, Covariate::Z, Multiplies::Load)
        );
        let zone = named("hard-zone").unwrap();
        assert!(follows(zone, Covariate::Z, Multiplies::Load) && !follows(zone, Covariate::Time, Multiplies::Load));
    }
}
