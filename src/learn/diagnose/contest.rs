//! Comparison of each named effect with everything that could replace it. In: the diagnosis and the model at the end of
//! a search. Out: the model in which a clearly better rival has replaced an effect, or for each effect the rivals it is
//! confounded with.
//!
//! An effect is added for what it explains beside the effects found before it; those found after it may show that
//! another one was the cause. So each is removed in turn, and every other effect, and every curve along a covariate
//! that it does not depend on, is fitted in its place. They are compared by their held-out residuals. The effect itself
//! may be corrected by any curve over its own covariates, because real effects deviate from the law of the list.

use crate::effects::{Covariate, Effect, Multiplies};
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::evidence::Present;
use crate::learn::diagnose::forms::{FORM_ROUNDS, remove};
use crate::learn::diagnose::trial::{Trial, p_value, score_of, unphysical};
use crate::learn::diagnose::unnamed::{ResidualCurve, is_shape_of, is_there_without_a_cut, is_unnamed};
use crate::learn::diagnose::which_curve::only_grows;
use crate::learn::model::cross_validation::{improvement_by_case, t_statistic};
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::report::{Confounded, Rejected};

/// Most rivals that are reported with an effect: the tool, named ones, then curves, each best first.
const SAID: usize = 3;

/// What may replace an effect.
enum Rival {
    Named(Trial),
    Curve(ResidualCurve),
}

/// One effect of a model and its rivals.
struct Contest<'a> {
    own: &'a FittedEffect,
    /// Gain of the effect (twice the log-likelihood ratio) in the model without it.
    gain: f64,
    /// The model without the effect.
    present: Present<'a>,
    /// Held-out residuals with the effect in its most flexible form.
    shaped: Vec<f64>,
    /// Each rival with its held-out residuals, least first.
    rivals: Vec<(Rival, Vec<f64>)>,
}

impl Rival {
    /// The part of the reading that it changes.
    fn multiplies(&self) -> Multiplies {
        match self {
            Self::Named(trial) => trial.effect.multiplies,
            Self::Curve(found) => found.effect.multiplies,
        }
    }

    fn in_words(&self) -> String {
        match self {
            Self::Named(trial) => trial.effect.name.to_owned(),
            Self::Curve(found) => {
                let of = part_name(found.effect.multiplies);
                format!("a curve of the {of} along {}", found.covariate.name())
            }
        }
    }
}

/// Name of a part of the reading.
pub(in crate::learn) fn part_name(part: Multiplies) -> &'static str {
    match part {
        Multiplies::Load => "load",
        Multiplies::Tare => "tare",
        Multiplies::Reading => "reading",
    }
}

/// Result of comparing every effect of a model with its rivals.
pub(in crate::learn) enum Outcome {
    /// The model in which a clearly better rival has replaced an effect.
    Exchanged(Fitted),
    /// No rival is clearly better; the rivals that each effect is confounded with.
    Holds(Vec<Confounded>),
}

impl Diagnosis<'_> {
    /// Compares every named effect of a model with its rivals.
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

    /// The rivals that an effect is confounded with.
    fn doubt(&self, contest: &Contest) -> Option<Confounded> {
        let own = contest.own.effect;
        let drop = |left: &[f64]| self.drop_of(&contest.present.left, left);
        let as_good = |rival: &Rival, left: &[f64]| {
            let worse = t_statistic(&improvement_by_case(&self.train, left, &contest.shaped));
            // Instants and regions are searched anew without each fold, and the result varies from fold to fold. Two
            // such effects are therefore compared by their likelihood as well.
            let are_looked_for = |trial: &Trial| own.is_looked_for() && trial.effect.is_looked_for();
            let is_as_likely = |trial: &Trial| contest.gain - trial.gain < self.criteria().confounded_within;
            let as_likely = matches!(rival, Rival::Named(trial) if are_looked_for(trial) && is_as_likely(trial));
            as_likely || self.criteria().leaves_as_much(drop(left) / drop(&contest.shaped).max(1e-12), worse)
        };
        // Where nothing is cut, a change of the load shows nothing and one of the tare or of the whole reading shows all of itself.
        let acts_without_a_cut =
            |rival: &Rival| own.multiplies != Multiplies::Load || rival.multiplies() != Multiplies::Load;
        let is_refuted = |rival: &Rival, left: &[f64]| {
            acts_without_a_cut(rival)
                && self.criteria().is_surely_worse(self.worse_without_a_cut(left, &contest.shaped))
        };
        // Time tells any cut from the next, so that it explains whatever differs between them: no doubt about a cause in the process.
        let is_late = own.covariates.iter().all(|covariate| only_grows(*covariate));
        let is_time = |rival: &Rival| matches!(rival, Rival::Curve(found) if only_grows(found.covariate));
        let rivals = contest.rivals.iter().filter(|(rival, _)| is_late || !is_time(rival));
        let as_good = rivals.filter(|(rival, left)| as_good(rival, left) && !is_refuted(rival, left));
        // Every tool has coefficients of its own, so a tool that goes with the effect is the likeliest rival. Then those with a name: each names
        // the experiment that separates it.
        let mut rivals: Vec<&Rival> = as_good.map(|(rival, _)| rival).collect();
        rivals.sort_by_key(|rival| match rival {
            Rival::Curve(found) if found.covariate == Covariate::Tool => 0,
            Rival::Named(_) => 1,
            Rival::Curve(_) => 2,
        });
        rivals.truncate(SAID);
        let apart = rivals.iter().filter_map(|rival| match rival {
            Rival::Named(trial) => Some(trial.effect.separated_by),
            Rival::Curve(_) => None,
        });
        let experiment: Vec<&str> = std::iter::once(own.separated_by).chain(apart).collect();
        (!rivals.is_empty()).then(|| Confounded {
            names: std::iter::once(own.name.to_owned()).chain(rivals.iter().map(|r| r.in_words())).collect(),
            why: "in its place each has as low a held-out error".to_owned(),
            experiment: experiment.join("; "),
        })
    }

    /// Named effects of a model, except those that data of their own show.
    fn open_places(&self, model: &Fitted) -> Vec<usize> {
        let effects = &model.model.effects;
        let is_open = |each: &FittedEffect| !is_unnamed(each.effect) && !self.is_settled(each.effect, effects);
        (0..model.model.effects.len()).filter(|e| is_open(&effects[*e])).collect()
    }

    /// Fits the model without the `e`-th effect, and in its place the effect again and each rival.
    fn contest<'a>(&mut self, model: &'a Fitted, e: usize, without_it: &'a Fitted) -> Contest<'a> {
        let own = &model.model.effects[e];
        let present = self.present(without_it);
        let others = without_it.model.effects.iter().cloned();
        let found = fit(&self.train, &others.chain([own.clone()]).collect::<Vec<_>>(), FORM_ROUNDS);
        let found = found.unwrap_or_else(|| model.clone());
        let (score, gain) = score_of(&self.train, without_it, &found, self.parameters_of(own));
        let trial = Trial { effect: own.effect, fitted: found, gain, score };
        let left = self.held_out_of_trial(without_it, &trial);
        let shapes = |covariate, part| follows(own.effect, covariate, part);
        let shaped = self.flexible(without_it, &present.left, (&trial, &left), shapes);
        let mut rivals: Vec<(Rival, Vec<f64>)> = Vec::new();
        for trial in self.trials(without_it, false) {
            let sound = unphysical(trial.fitted.model.effects.last(), self.data).is_none();
            if trial.effect.name != own.effect.name && sound && trial.score > self.threshold() {
                let left = self.held_out_of_trial(without_it, &trial);
                rivals.push((Rival::Named(trial), left));
            }
        }
        let wanted = |covariate, part| {
            !follows(own.effect, covariate, part) && (part == Multiplies::Load || is_there_without_a_cut(covariate))
        };
        for found in self.fitted_curves(without_it, &present.left, wanted) {
            let left = found.fit.left.clone();
            rivals.push((Rival::Curve(found), left));
        }
        rivals.sort_by(|a, b| self.drop_of(&present.left, &b.1).total_cmp(&self.drop_of(&present.left, &a.1)));
        Contest { own, gain, present, shaped, rivals }
    }

    /// Is a rival clearly better than an effect? A curve over something that only grows while the program runs correlates
    /// with every change during the program.
    fn takes_the_place(&self, rival: &Rival, present: &Present, shaped: &[f64], left: &[f64]) -> bool {
        if matches!(rival, Rival::Curve(found) if only_grows(found.covariate)) {
            return self.is_clearly_late(&present.left, shaped, left);
        }
        self.criteria().is_clearly_better(t_statistic(&improvement_by_case(&self.train, shaped, left)))
    }

    /// The named rival that follows the covariate of the curve `best`, passes every test and lowers the held-out error nearly as much. What its
    /// law lacks may be added beside it as a curve.
    fn law_of<'a>(&mut self, best: &Rival, least: &[f64], contest: &'a Contest) -> Option<&'a Rival> {
        let Rival::Curve(curve) = best else { return None };
        let present = &contest.present;
        let drop = |left: &[f64]| self.drop_of(&present.left, left);
        let is_law = |(rival, left): &&(Rival, Vec<f64>)| {
            let Rival::Named(trial) = rival else { return false };
            trial.effect.knows(curve.covariate, curve.effect.multiplies)
                && self.criteria().takes_as_much(drop(left) / drop(least).max(1e-12))
        };
        let laws: Vec<&Rival> = contest.rivals.iter().filter(is_law).map(|(rival, _)| rival).collect();
        laws.into_iter().find(|law| matches!(law, Rival::Named(trial) if self.tested(present, trial).is_ok()))
    }

    /// Where a curve is the best rival, the one that is preferred among all.
    fn preferred_curve<'a>(&self, best: &Rival, contest: &'a Contest) -> Option<&'a Rival> {
        let Rival::Curve(_) = best else { return None };
        let curve = |(rival, left): &'a (Rival, Vec<f64>)| match rival {
            Rival::Curve(found) => Some((rival, (found, left.as_slice()))),
            Rival::Named(_) => None,
        };
        let (rivals, curves): (Vec<&Rival>, Vec<_>) = contest.rivals.iter().filter_map(curve).unzip();
        self.preferred(&contest.present.left, &curves).map(|k| rivals[k])
    }

    /// The model with the best rival, if it is clearly better than the effect with any curve over its own covariates,
    /// and passes every test of an added effect.
    fn winner(&mut self, contest: &Contest) -> Option<Fitted> {
        let Contest { own, present, shaped, rivals, .. } = contest;
        let (best, least) = rivals.first()?;
        if !self.takes_the_place(best, present, shaped, least) {
            return None;
        }
        let rival = self.law_of(best, least, contest).or_else(|| self.preferred_curve(best, contest)).unwrap_or(best);
        let (trial, why) = match rival {
            Rival::Named(trial) => {
                self.tested(present, trial).ok()?;
                let why = format!("in the place of {} it has a lower held-out error", own.effect.name);
                (Trial { effect: trial.effect, fitted: trial.fitted.clone(), ..*trial }, why)
            }
            Rival::Curve(found) => {
                let (trial, _) = self.judged_curve(present.model, &present.left, found)?;
                (trial, format!("its held-out error is lower than that of {} with any curve", own.effect.name))
            }
        };
        let errors =
            [&present.model.model.effects, &trial.fitted.model.effects].map(|each| self.judgement_errors(each).rmse);
        self.evidence.push((trial.effect.name, why, p_value(&trial), errors));
        self.rejected.retain(|r| r.name != trial.effect.name && r.name != own.effect.name);
        self.rejected.push(Rejected {
            name: own.effect.name.into(),
            why: format!("{} has a clearly lower held-out error", rival.in_words()),
        });
        Some(trial.fitted)
    }
}

/// Does the effect depend on this covariate, so that a curve along it only corrects the effect's law? If all its
/// covariates only grow while the program runs, any other such covariate counts as well.
fn follows(effect: &Effect, covariate: Covariate, part: Multiplies) -> bool {
    let is_late = effect.covariates.iter().all(|own| only_grows(*own));
    effect.knows(covariate, part) || (is_late && only_grows(covariate) && effect.multiplies == part)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{State, named};
    use crate::learn::dataset::samples::Data;
    use crate::learn::diagnose::diagnosis::Options;
    use crate::learn::diagnose::made_data::{EACH, begun, fifths, in_first, made};
    use crate::path::Vec3;

    /// Blocks each cut in up or climb milling at one height; the load of each is larger by `share`.
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

    /// `up-down-asymmetry` fitted to the data and compared with its rivals.
    fn contested(data: &Data) -> Outcome {
        let split = fifths(data);
        let up_down = named("up-down-asymmetry").unwrap();
        let options = Options { candidates: vec![up_down], ..Options::default() };
        let model = fit(data, &[in_first(up_down.name, &[0.1])], FORM_ROUNDS).unwrap();
        begun(data, &split, &options, 1.0).contested(&model, true)
    }

    /// +1 or −1 for each block, alternating every `every` blocks.
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
        // The load depends on the height; three of four high blocks are cut up, and three of four low ones climb.
        let z = by_turns(4);
        let up = |block: usize| if block.is_multiple_of(4) { -z(block) } else { z(block) };
        let data = blocks(up, &z, |block| 0.2 * z(block));
        let Outcome::Exchanged(fitted) = contested(&data) else { panic!("the name stays") };
        let names: Vec<&str> = fitted.model.effects.iter().map(|each| each.effect.name).collect();
        assert_eq!(names, ["unnamed-load-z"]);
        // A tool for each height has coefficients of its own, whatever the height does.
        let mut data = data;
        for (i, state) in data.state.iter_mut().enumerate() {
            state.tool = 1.5 + 0.5 * z(i / EACH);
        }
        let Outcome::Exchanged(fitted) = contested(&data) else { panic!("the name stays") };
        assert_eq!(fitted.model.effects[0].effect.name, "unnamed-load-tool");
    }

    #[test]
    fn a_name_gives_way_to_the_law_of_the_curve_that_explains_more_where_the_law_takes_nearly_as_much() {
        // Chips of four thicknesses; three of four blocks with thin ones are cut up, three of four with thick ones climb.
        let thin = by_turns(4);
        let up = |block: usize| if block.is_multiple_of(4) { -thin(block) } else { thin(block) };
        let h_mm = |block: usize| [0.02, 0.03, 0.06, 0.09][usize::from(thin(block) < 0.0) * 2 + block / 8 % 2];
        let given_way = |shares: [f64; 4]| {
            let share = |block: usize| shares[usize::from(thin(block) < 0.0) * 2 + block / 8 % 2];
            let mut data = blocks(up, by_turns(1), share);
            for (i, state) in data.state.iter_mut().enumerate() {
                state.chip_thickness_mm = h_mm(i / EACH);
            }
            let split = fifths(&data);
            let [up_down, size] = ["up-down-asymmetry", "size-effect"].map(|name| named(name).unwrap());
            let options = Options { candidates: vec![up_down, size], ..Options::default() };
            let model = fit(&data, &[in_first(up_down.name, &[0.1])], FORM_ROUNDS).unwrap();
            let Outcome::Exchanged(fitted) = begun(&data, &split, &options, 1.0).contested(&model, true) else {
                panic!("the name stays")
            };
            fitted.model.effects[0].effect.name
        };
        // Nearly (h/h₀)^−p, which a curve fits a little better; then a load that no law of thin chips has.
        assert_eq!(given_way([0.28, 0.15, -0.05, -0.2]), "size-effect");
        assert_eq!(given_way([0.0, 0.3, 0.0, -0.3]), "unnamed-load-chip-thickness");
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
        // The first `together` of depth, width, curvature, spindle speed and tool change together with up and climb milling.
        let up = by_turns(1);
        let said = |together: usize| {
            let mut data = blocks(&up, by_turns(3), |block| 0.2 * up(block));
            for (i, state) in data.state.iter_mut().enumerate() {
                let go = |k: usize| if k < together { up(i / EACH) } else { 0.0 };
                state.axial_depth_mm = 3.0 + go(0);
                state.radial_depth_mm = 5.0 + go(1);
                state.curvature_per_mm = 0.1 + 0.05 * go(2);
                state.rps = 100.0 + go(3);
                state.tool = 1.5 + 0.5 * go(4);
            }
            let Outcome::Holds(in_doubt) = contested(&data) else { panic!("the name goes") };
            in_doubt[0].names[1..].to_vec()
        };
        assert_eq!([1, 2, 3, 4].map(|together| said(together).len()), [1, 2, 3, 3]);
        let with_tool = said(5);
        assert!(with_tool[0] == "a curve of the load along tool" && with_tool.len() == 3, "{with_tool:?}");
    }

    #[test]
    fn a_name_gives_way_to_time_where_that_clearly_explains_more_and_not_where_it_explains_as_much() {
        // The load rises half way. Three of four blocks before that are cut climb, three of four after it up.
        let late = by_turns(12);
        let mostly = |block: usize| if block.is_multiple_of(4) { late(block) } else { -late(block) };
        let share = |block: usize| -0.2 * late(block);
        let Outcome::Exchanged(fitted) = contested(&blocks(mostly, by_turns(1), share)) else {
            panic!("the name stays")
        };
        assert_eq!(fitted.model.effects[0].effect.name, "unnamed-load-time");
        let as_good = contested(&blocks(|block| -late(block), by_turns(1), share));
        assert!(matches!(as_good, Outcome::Holds(in_doubt) if in_doubt.is_empty()));
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
