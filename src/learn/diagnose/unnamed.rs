//! What follows a covariate and bears no name: as a rival of the effects that do, and as an effect of its own where
//! none of them explains it. In: a diagnosis, a model, what it leaves on data left out. Out: curves that the residual
//! follows ([`super::free_curve`]), and the model with the best of them ([`crate::effects::unnamed`]).
//!
//! A curve takes the shape of anything that depends on its covariate. If one along a covariate that an effect knows
//! nothing of explains more than the effect does in any shape, the effect only stands in for what is not in the list.

use crate::effects::unnamed::{BEYOND, CURVES, KNOTS};
use crate::effects::{Covariate, Effect, Multiplies, Way};
use crate::learn::dataset::samples::{Class, Data};
use crate::learn::diagnose::criteria::{LEAST_WEIGHT, MOST_TURNS, MOST_TURNS_OF_A_PLACE, goes, turns};
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::forms::FORM_ROUNDS;
use crate::learn::diagnose::free_curve::{Curve, Follows, Residual};
use crate::learn::diagnose::trial::{Trial, score_of};
use crate::learn::model::cross_validation::{certainty_of_gain, held_out_residuals, improvement_by_case, t_statistic};
use crate::learn::model::design::{Acting, FittedEffect, acting, changed_columns};
use crate::learn::model::fit::{Fitted, fit, part};
use rayon::prelude::*;

/// Curves whose fit is judged on data left out, best first.
const JUDGED: usize = 4;

/// Curves that are fitted together with the model before the best of them is sought, best first.
const FITTED: usize = 6;

/// Most times that a curve is found anew in what the coefficients leave without bending towards it.
const REFINED: usize = 3;

/// A curve that a residual follows.
#[derive(Clone)]
pub(in crate::learn) struct ResidualCurve {
    pub(in crate::learn) covariate: Covariate,
    pub(in crate::learn) effect: &'static Effect,
    pub(in crate::learn) follows: Follows,
}

/// What curves are chosen by.
struct Standing<'a> {
    rank: usize,
    parts: usize,
    /// Does it only tell tools apart? Then it is no law over anything, and the least that can be said.
    is_of_tools: bool,
    /// On data left out.
    left: &'a [f64],
}

/// What a model has a curve multiply.
struct Loads {
    cut: Vec<f64>,
    tare: Vec<f64>,
    all: Vec<f64>,
}

impl Loads {
    fn of(data: &Data, present: &Fitted) -> Self {
        let [cut, tare] =
            [vec![Class::Cutting, Class::Edge], vec![Class::Tare]].map(|classes| part(data, present, &classes));
        // Where nothing has a tare, the whole is the load.
        let all = cut.iter().zip(&tare).map(|(cut, tare)| if *tare > 0.0 { cut + tare } else { 0.0 }).collect();
        Self { cut, tare, all }
    }

    fn what(&self, multiplies: Multiplies) -> &[f64] {
        match multiplies {
            Multiplies::Load => &self.cut,
            Multiplies::Tare => &self.tare,
            Multiplies::Reading => &self.all,
        }
    }
}

impl<'a> Standing<'a> {
    fn of(found: &ResidualCurve, left: &'a [f64]) -> Self {
        Self {
            rank: rank_of_curve(found.effect, found.covariate),
            parts: found.follows.curve.knots.len(),
            is_of_tools: found.covariate == Covariate::Tool,
            left,
        }
    }
}

/// Rank of what only grows while the program runs.
pub(in crate::learn) const LAST_RANK: usize = 2;

/// What is preferred where a residual follows several covariates as well: a quantity of the process, then a place or the feed (which a
/// cut knows as chips alone), then anything that only grows while the program runs.
pub(in crate::learn) fn rank(covariate: Covariate) -> usize {
    match covariate {
        Covariate::X | Covariate::Y | Covariate::PathSpeed => 1,
        Covariate::Sliding | Covariate::Volume | Covariate::Time => LAST_RANK,
        _ => 0,
    }
}

/// The same of a curve: what a spindle takes without a cut hardly knows where the tool is, or whither it goes.
fn rank_of_curve(effect: &Effect, covariate: Covariate) -> usize {
    let is_place = matches!(covariate, Covariate::Z | Covariate::Heading | Covariate::Slope);
    rank(covariate).max(usize::from(is_place && effect.multiplies == Multiplies::Tare))
}

/// Is this curve one that a law can have? Wear only grows, so over sliding distance and volume the load may only rise. Over a
/// quantity of the cut it rises, falls, or has one peak or trough. Over a place it may turn twice: a hard layer between two soft
/// ones. A curve with more turns would tell operations apart by a quantity that only happens to differ between them. Over time
/// (any number of events), the number of a tool and the direction of feed every shape is possible.
fn may_go(covariate: Covariate, curve: &Curve) -> bool {
    let shares: Vec<f64> = curve.knots.iter().map(|knot| knot[1]).collect();
    match covariate {
        Covariate::Sliding | Covariate::Volume => goes(Way::Up, &shares),
        Covariate::X | Covariate::Y | Covariate::Z => turns(&told(curve)) <= MOST_TURNS_OF_A_PLACE,
        Covariate::Time | Covariate::Tool | Covariate::Heading => true,
        _ => turns(&told(curve)) <= MOST_TURNS,
    }
}

/// Shares of the parts that enough of the load lies in to be told.
fn told(curve: &Curve) -> Vec<f64> {
    let whole: f64 = curve.weight.iter().sum();
    let is_told = |k: &usize| curve.weight[*k] >= LEAST_WEIGHT * whole;
    (0..curve.knots.len()).filter(is_told).map(|k| curve.knots[k][1]).collect()
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
    /// The curves that a model's residual `left` follows, over the `wanted` covariates, in shapes that a law can have
    /// ([`may_go`]). Least squares first.
    pub(in crate::learn) fn curves(
        &self,
        present: &Fitted,
        left: &[f64],
        wanted: impl Fn(Covariate, Multiplies) -> bool + Sync,
    ) -> Vec<ResidualCurve> {
        self.curves_that_go(present, left, wanted, may_go)
    }

    /// The same in whatever shapes `may_go` lets through.
    pub(in crate::learn) fn curves_that_go(
        &self,
        present: &Fitted,
        left: &[f64],
        wanted: impl Fn(Covariate, Multiplies) -> bool + Sync,
        may_go: impl Fn(Covariate, &Curve) -> bool + Sync,
    ) -> Vec<ResidualCurve> {
        let data = &self.train;
        let loads = Loads::of(data, present);
        let open = CURVES.par_iter().filter(|(covariate, effect)| wanted(*covariate, effect.multiplies));
        let found = open.filter_map(|(covariate, effect)| {
            let residual = Residual { data, split: self.split, left, load: loads.what(effect.multiplies) };
            let follows = residual.follows(self.along(*covariate)?, |curve| may_go(*covariate, curve))?;
            Some(ResidualCurve { covariate: *covariate, effect, follows })
        });
        let mut found: Vec<ResidualCurve> = found.collect();
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
    ) -> Vec<ResidualCurve> {
        let mut found = self.curves(present, left, wanted);
        found.iter_mut().take(FITTED).for_each(|each| self.fit_together(present, each));
        found.sort_by(|a, b| a.follows.squares.total_cmp(&b.follows.squares));
        found
    }

    /// Curves that are found anew in what is left when the base coefficients do not bend towards them.
    fn free_of_base(&self, present: &Fitted, left: &[f64], found: &mut [ResidualCurve]) {
        let data = &self.train;
        let loads = Loads::of(data, present);
        let acting: Vec<Acting> = present.model.effects.iter().map(|each| acting(each, data)).collect();
        let columns = changed_columns(data, &acting.iter().collect::<Vec<_>>());
        found.par_iter_mut().for_each(|each| {
            let load = loads.what(each.effect.multiplies);
            let Some(along) = self.along(each.covariate) else { return };
            for _ in 0..REFINED {
                let freed = Residual { data, split: self.split, left, load }.freed(
                    &each.follows.curve,
                    &along.values,
                    &columns,
                );
                let again = freed.and_then(|left| {
                    let residual = Residual { data, split: self.split, left: &left, load };
                    residual.follows(along, |curve| may_go(each.covariate, curve))
                });
                match again {
                    Some(again) if again.squares < each.follows.squares => each.follows = again,
                    _ => break,
                }
            }
        });
        found.sort_by(|a, b| a.follows.squares.total_cmp(&b.follows.squares));
    }

    /// Fits a curve together with the model.
    fn fit_together(&self, model: &Fitted, found: &mut ResidualCurve) {
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
        self.criteria().is_clearly_better(t_statistic(&improvement_by_case(&self.train, before, after)))
    }

    /// The curves that may stand beside a model without a name, least squares first.
    pub(in crate::learn) fn curves_beside(&self, present: &Fitted, left: &[f64]) -> Vec<ResidualCurve> {
        let has = |effect: &Effect| present.model.effects.iter().any(|each| each.effect.name == effect.name);
        // In a table nothing is read without a cut: there a curve of the tare may be a step on the way to the name.
        let is_series = self.data.is_series();
        let may_follow = |covariate, part| !is_series || part == Multiplies::Load || is_there_without_a_cut(covariate);
        // The coefficients bend towards what a curve would show, those of a few dozen cuts far.
        let mut found = if is_series {
            let mut found = self.curves(present, left, may_follow);
            self.free_of_base(present, left, &mut found);
            found
        } else {
            self.fitted_curves(present, left, may_follow)
        };
        found.retain(|each| !has(each.effect));
        found
    }

    /// The model with the curve that explains most of what it leaves; `None` where none is clear.
    pub(in crate::learn) fn with_unnamed(&mut self, present: &Fitted) -> Option<Fitted> {
        let before = held_out_residuals(&self.train, &present.model.effects, self.split);
        let clear = |found: &ResidualCurve| {
            let t = certainty_of_gain(&self.train, &before, &found.follows.left);
            self.criteria().follows_a_curve(self.drop_of(&before, &found.follows.left), t)
        };
        let mut found = self.curves_beside(present, &before);
        found.retain(clear);
        self.tried += found.len();
        let (trial, after) = self.best_curve(present, &before, &found)?;
        let share = self.share_of_excess(&before, &after, &before, self.criteria().least_excess);
        let text = format!(
            "no effect of the list explains it; the curve takes away {:.0} % of what is left beyond the noise",
            100.0 * share.min(1.0)
        );
        let errors = [self.judged(&present.model.effects), self.judged(&trial.fitted.model.effects)];
        let p = self.p_of_the_search(&trial);
        self.evidence.push((trial.effect.name, text, p, errors.map(|e| e.rmse)));
        Some(trial.fitted)
    }

    /// The best of curves, least squares first, fitted together with the model, and what both leave on data left out.
    fn best_curve(&self, present: &Fitted, before: &[f64], found: &[ResidualCurve]) -> Option<(Trial, Vec<f64>)> {
        let alone: Vec<Standing> = found.iter().map(|each| Standing::of(each, &each.follows.left)).collect();
        let mut order: Vec<usize> = (1..found.len()).collect();
        order.sort_by_cached_key(|k| self.preference(before, &alone[0], &alone[*k]));
        let chosen = (0..found.len().min(1)).chain(order).take(JUDGED).map(|k| &found[k]);
        let mut judged: Vec<(&ResidualCurve, (Trial, Vec<f64>))> =
            chosen.filter_map(|each| Some((each, self.judged_curve(present, before, each)?))).collect();
        judged.sort_by(|(_, a), (_, b)| self.drop_of(before, &b.1).total_cmp(&self.drop_of(before, &a.1)));
        let together: Vec<Standing> = judged.iter().map(|(each, (_, left))| Standing::of(each, left)).collect();
        let best = (0..judged.len()).min_by_key(|k| self.preference(before, &together[0], &together[*k]))?;
        Some(judged.swap_remove(best).1)
    }

    /// Of curves that none is clearly ahead of, or that take nearly as much with fewer parts, what says most about the process
    /// comes first, then what has fewest parts, then a difference between tools: its rank, its parts, and whether it is none of tools.
    /// What only grows while the program runs is ahead where it
    /// shows as much more as a curve of its own has to.
    fn preference(&self, before: &[f64], least: &Standing, each: &Standing) -> (usize, usize, bool) {
        let share = self.drop_of(before, each.left) / self.drop_of(before, least.left).max(1e-12);
        let is_simpler = each.parts < least.parts && self.criteria().takes_as_much(share);
        let is_behind = if least.rank >= LAST_RANK && each.rank < LAST_RANK {
            let certainty = certainty_of_gain(&self.train, each.left, least.left);
            self.criteria().follows_a_curve(self.drop_of(each.left, least.left), certainty)
        } else {
            let t = t_statistic(&improvement_by_case(&self.train, each.left, least.left));
            self.criteria().lowers_held_out(self.drop_of(each.left, least.left), t)
        };
        if is_simpler || !is_behind { (each.rank, each.parts, !each.is_of_tools) } else { (usize::MAX, 0, true) }
    }

    /// The curve fitted together with the model, and what both leave on data left out; `None` where that is not less.
    pub(in crate::learn) fn judged_curve(
        &self,
        present: &Fitted,
        before: &[f64],
        found: &ResidualCurve,
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
        let share = self.share_of_excess(before, &after, &self.base_residual, self.criteria().least_excess);
        let of_rest = self.share_of_excess(before, &after, before, self.criteria().noise_known_to);
        let shows = self.criteria().lowers_held_out(self.drop_of(before, &after), t)
            && self.criteria().takes_enough(share, of_rest)
            && self.change_of_load(present, before, &after) >= self.criteria().engagement_known_to;
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
    use crate::learn::diagnose::diagnosis::Options;
    use crate::learn::diagnose::made_data::{EACH, begun, fifths, made};
    use crate::learn::model::cross_validation::Split;
    use crate::machine::wear::Lengths;
    use crate::path::Vec3;

    #[test]
    fn a_tare_follows_nothing_that_only_a_cut_has() {
        use Covariate::{
            AxialDepth, ChipThickness, Curvature, FeedPerTooth, Immersion, Load, RadialDepth, SinceEntry, Sliding,
            UpShare, Volume,
        };
        let of_cut = [
            FeedPerTooth,
            ChipThickness,
            AxialDepth,
            RadialDepth,
            Immersion,
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

    /// Names of the curves that are found where the share of block b that is missing is `share(b)`.
    fn found(share: impl Fn(usize) -> f64, state: impl Fn(usize) -> State) -> Vec<&'static str> {
        let data = made(|i| share(i / EACH), 1.0, state);
        let (split, options) = (fifths(&data), Options { candidates: Vec::new(), ..Options::default() });
        let mut diagnosis = begun(&data, &split, &options, 1.0);
        let plain = fit(&data, &[], 0).unwrap();
        let found = diagnosis.with_unnamed(&plain);
        found.iter().flat_map(|found| &found.model.effects).map(|each| each.effect.name).collect()
    }

    /// A sample of a tool that has slid as far as the log is long.
    fn worn(i: usize) -> State {
        State { time_s: i as f64, slid: Lengths::at_reference(i as f64), ..State::default() }
    }

    #[test]
    fn what_comes_and_goes_while_the_log_runs_is_said_of_the_time() {
        let window = |block: usize| if (9..15).contains(&block) { 0.2 } else { 0.0 };
        assert_eq!(found(window, worn), ["unnamed-load-time"]);
        assert_eq!(found(|_| 0.0, worn), [""; 0]);
        let up = Curve { knots: vec![[0.0, 0.0], [1.0, 0.2]], weight: vec![1.0; 2], in_steps: true };
        let back = Curve { knots: vec![[0.0, 0.0], [1.0, 0.2], [2.0, 0.0]], weight: vec![1.0; 3], in_steps: true };
        assert!(
            may_go(Covariate::Sliding, &up) && !may_go(Covariate::Sliding, &back) && may_go(Covariate::Time, &back)
        );
    }

    #[test]
    fn along_a_quantity_of_the_cut_a_load_has_one_peak_and_no_second() {
        let through = |shares: &[f64], weight: &[f64]| Curve {
            knots: shares.iter().enumerate().map(|(k, share)| [k as f64, *share]).collect(),
            weight: weight.to_vec(),
            in_steps: true,
        };
        let zigzag = through(&[0.0, 0.15, 0.0, 0.13], &[1.0; 4]);
        assert!(may_go(Covariate::AxialDepth, &through(&[0.0, 0.15, 0.0], &[1.0; 3])));
        assert!(!may_go(Covariate::AxialDepth, &zigzag) && may_go(Covariate::Z, &zigzag));
        let again = through(&[0.0, 0.15, 0.0, 0.13, 0.0], &[1.0; 5]);
        assert!(!may_go(Covariate::Z, &again) && may_go(Covariate::Time, &again));
        // A part that hardly any load lies in says nothing of the way.
        assert!(may_go(Covariate::AxialDepth, &through(&[0.0, 0.15, 0.0, 0.13], &[1.0, 1.0, 1.0, 0.05])));
    }

    #[test]
    fn what_takes_its_share_of_tare_and_load_alike_is_said_of_the_whole_reading() {
        let fast = |block: usize| (block / 2).is_multiple_of(2);
        let state = |i: usize| State { rps: if fast(i / EACH) { 150.0 } else { 90.0 }, ..State::default() };
        // Of a tare of 50 and the load of the cut, the fast half of the blocks shows a fifth more: of both, or of the load alone.
        let said = |of_tare: f64| {
            let mut data = made(|i| if fast(i / EACH) { 0.2 } else { 0.0 }, 1.0, state);
            data.base.push(Base {
                name: "tare".into(),
                unit: String::new(),
                class: Class::Tare,
                prior: None,
                bounds: UNBOUNDED,
            });
            data.columns.push(vec![50.0; data.len()]);
            let tare = |i: usize| if fast(i / EACH) { 50.0 * (1.0 + of_tare) } else { 50.0 };
            (0..data.len()).for_each(|i| data.reading[i] += tare(i));
            let (split, options) = (fifths(&data), Options { candidates: Vec::new(), ..Options::default() });
            let plain = fit(&data, &[], 0).unwrap();
            let left = held_out_residuals(&data, &[], &split);
            let found = begun(&data, &split, &options, 1.0).fitted_curves(&plain, &left, |_, _| true);
            found[0].effect.name
        };
        assert_eq!([0.2, 0.0].map(said), ["unnamed-reading-spindle-speed", "unnamed-load-spindle-speed"]);
    }

    #[test]
    fn of_curves_that_take_nearly_as_much_the_simpler_one_is_said_and_time_comes_last() {
        let data = made(|_| 0.0, 1.0, worn);
        let (split, options) = (fifths(&data), Options { candidates: Vec::new(), ..Options::default() });
        let diagnosis = begun(&data, &split, &options, 1.0);
        let wobble = |i: usize| ((i * 7919) % 101) as f64 / 50.0 - 1.0;
        let left = |off: f64| (0..data.len()).map(|i| off + wobble(i)).collect::<Vec<f64>>();
        let [before, least, more, much] = [10.0, 1.0, 1.5, 4.0].map(left);
        let key = |of: (usize, usize, &[f64]), than: (usize, usize, &[f64])| {
            let standing = |(rank, parts, left)| Standing { rank, parts, is_of_tools: false, left };
            let (rank, parts, _) = diagnosis.preference(&before, &standing(than), &standing(of));
            (rank, parts)
        };
        assert_eq!(key((0, 2, &more), (0, 6, &least)), (0, 2));
        assert_eq!(key((0, 6, &more), (0, 6, &least)), (usize::MAX, 0));
        assert_eq!(key((0, 2, &much), (0, 6, &least)), (usize::MAX, 0));
        // By half a percent, however clearly, time is not ahead of a quantity of the process.
        let nearly = left(1.004);
        assert_eq!(key((0, 6, &nearly), (LAST_RANK, 2, &least)), (0, 6));
        assert_eq!(key((0, 6, &nearly), (0, 2, &least)), (0, 6));
        assert_eq!(key((0, 6, &left(1.02)), (0, 2, &least)), (usize::MAX, 0));
        // Of two that say the same of these data, a difference between tools comes first.
        let same = |is_of_tools| Standing { rank: 0, parts: 2, is_of_tools, left: &least };
        assert!(
            diagnosis.preference(&before, &same(false), &same(true))
                < diagnosis.preference(&before, &same(true), &same(false))
        );
        let [z, time] = ["unnamed-tare-z", "unnamed-load-time"].map(|name| crate::effects::named(name).unwrap());
        assert!(rank_of_curve(z, Covariate::Z) == 1 && rank_of_curve(time, Covariate::Time) == LAST_RANK);
    }

    #[test]
    fn time_is_the_last_that_a_residual_may_follow() {
        assert!(rank(Covariate::Z) < rank(Covariate::X) && rank(Covariate::Y) < rank(Covariate::Time));
    }
}
