//! Curves without a name: free functions of one covariate, used as rivals of the named effects and, where none of those
//! explains the residual, as effects of their own. In: a diagnosis, a model, its held-out residuals. Out: curves that
//! these residuals follow ([`super::free_curve`]), and the model with the best of them ([`crate::effects::unnamed`]).
//!
//! A curve can fit any dependence on its covariate. If a curve along a covariate that a named effect does not depend on
//! explains more than the effect corrected by any curve over its own covariates, the effect is only a proxy for another
//! cause.

use crate::effects::unnamed::{BEYOND, CURVES, KNOTS};
use crate::effects::{Covariate, Effect, Multiplies, Way};
use crate::learn::dataset::samples::{Class, Data};
use crate::learn::diagnose::criteria::{LEAST_WEIGHT, MOST_TURNS, MOST_TURNS_OF_A_PLACE, has_way, turning_points};
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::forms::FORM_ROUNDS;
use crate::learn::diagnose::free_curve::{Curve, CurveFit, Residual};
use crate::learn::diagnose::trial::{Trial, score_of};
use crate::learn::model::cross_validation::{certainty_of_gain, held_out_residuals, improvement_by_case, t_statistic};
use crate::learn::model::design::{Acting, FittedEffect, acting, changed_columns};
use crate::learn::model::fit::{Fitted, fit, part};
use rayon::prelude::*;

/// Best curves that are fitted with the model before they are ordered as rivals, beside that of the tool: every tool has coefficients of its own, and
/// what goes with it does so as well.
const FITTED: usize = 6;

/// Most rounds in which curve and base coefficients are fitted by turns.
const REFINED: usize = 3;

/// A curve that a residual follows.
#[derive(Clone)]
pub(in crate::learn) struct ResidualCurve {
    pub(in crate::learn) covariate: Covariate,
    pub(in crate::learn) effect: &'static Effect,
    pub(in crate::learn) fit: CurveFit,
}

/// Predicted parts of each reading, one of which a curve multiplies.
struct Loads {
    cut: Vec<f64>,
    tare: Vec<f64>,
    all: Vec<f64>,
}

impl Loads {
    fn of(data: &Data, present: &Fitted) -> Self {
        let [cut, tare] =
            [vec![Class::Cutting, Class::Edge], vec![Class::Tare]].map(|classes| part(data, present, &classes));
        // Without a tare the whole reading is the load: no separate curve of the reading.
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

/// Is this shape physically plausible? Wear only grows, so over sliding distance and volume the load may only rise.
/// Over a quantity of the cut it rises, falls, or has one peak or trough. Over a position it may turn twice: a hard
/// layer between two soft ones. A curve with more turning points would separate operations by a quantity that only
/// happens to differ between them. Over time (any number of events), tool number and direction of feed every shape is
/// possible.
fn is_plausible(covariate: Covariate, curve: &Curve) -> bool {
    let shares: Vec<f64> = curve.knots.iter().map(|knot| knot[1]).collect();
    match covariate {
        Covariate::Sliding | Covariate::Volume => has_way(Way::Up, &shares),
        Covariate::X | Covariate::Y | Covariate::Z => {
            turning_points(&determined_shares(curve)) <= MOST_TURNS_OF_A_PLACE
        }
        Covariate::Time | Covariate::Tool | Covariate::Heading => true,
        _ => turning_points(&determined_shares(curve)) <= MOST_TURNS,
    }
}

/// Values at the knots whose weight is large enough to determine them.
fn determined_shares(curve: &Curve) -> Vec<f64> {
    let whole: f64 = curve.weight.iter().sum();
    let is_determined = |k: &usize| curve.weight[*k] >= LEAST_WEIGHT * whole;
    (0..curve.knots.len()).filter(is_determined).map(|k| curve.knots[k][1]).collect()
}

/// Can the tare depend on this covariate? A tare that follows depth, immersion, chip thickness or the way since entry
/// would be load of the cut, booked where no limit of the tool applies to it.
pub(in crate::learn) fn is_there_without_a_cut(covariate: Covariate) -> bool {
    use Covariate::{Coolant, Heading, PathAcceleration, PathSpeed, Slope, SpindleSpeed, Time, Tool, X, Y, Z};
    matches!(
        covariate,
        Time | SpindleSpeed | PathSpeed | PathAcceleration | Tool | Coolant | Heading | Slope | X | Y | Z
    )
}

/// Is it a curve without a name rather than an effect of the list?
pub(in crate::learn) fn is_unnamed(effect: &Effect) -> bool {
    CURVES.iter().any(|(_, curve)| curve.name == effect.name)
}

/// Is `each` a curve without a name over what an effect of the list follows?
pub(in crate::learn) fn is_shape_of(own: &FittedEffect, each: &FittedEffect) -> bool {
    let mut along = each.effect.covariates.iter();
    !is_unnamed(own.effect) && is_unnamed(each.effect) && along.any(|c| own.effect.knows(*c, each.effect.multiplies))
}

impl Diagnosis<'_> {
    /// Curves over the `wanted` covariates that the held-out residuals `left` of a model follow, in plausible shapes
    /// ([`is_plausible`]); least held-out squares first.
    pub(in crate::learn) fn curves(
        &self,
        present: &Fitted,
        left: &[f64],
        wanted: impl Fn(Covariate, Multiplies) -> bool + Sync,
    ) -> Vec<ResidualCurve> {
        self.curves_of_shapes(present, left, wanted, is_plausible)
    }

    /// The same in the shapes that `is_plausible` accepts.
    pub(in crate::learn) fn curves_of_shapes(
        &self,
        present: &Fitted,
        left: &[f64],
        wanted: impl Fn(Covariate, Multiplies) -> bool + Sync,
        is_plausible: impl Fn(Covariate, &Curve) -> bool + Sync,
    ) -> Vec<ResidualCurve> {
        let data = &self.train;
        let loads = Loads::of(data, present);
        // Of readings without a cut a factor of the whole is one of the tare.
        let has_load = data.base.iter().any(|base| base.class != Class::Tare);
        let is_open = |part| has_load || part == Multiplies::Tare;
        let open = CURVES
            .par_iter()
            .filter(|(covariate, effect)| is_open(effect.multiplies) && wanted(*covariate, effect.multiplies));
        let found = open.filter_map(|(covariate, effect)| {
            let residual = Residual { data, split: self.split, left, load: loads.what(effect.multiplies) };
            let fit = residual.best_curve(self.along(*covariate)?, |curve| is_plausible(*covariate, curve))?;
            Some(ResidualCurve { covariate: *covariate, effect, fit })
        });
        let mut found: Vec<ResidualCurve> = found.collect();
        found.sort_by(|a, b| a.fit.squares.total_cmp(&b.fit.squares));
        found
    }

    /// The same, with the best refitted together with the model: the base coefficients have already absorbed a part of
    /// what a curve would explain.
    pub(in crate::learn) fn fitted_curves(
        &self,
        present: &Fitted,
        left: &[f64],
        wanted: impl Fn(Covariate, Multiplies) -> bool + Sync,
    ) -> Vec<ResidualCurve> {
        let mut found = self.curves(present, left, wanted);
        let tool = found.iter().skip(FITTED).position(|each| each.covariate == Covariate::Tool);
        for k in (0..found.len().min(FITTED)).chain(tool.map(|k| FITTED + k)) {
            self.fit_together(present, &mut found[k]);
        }
        found.sort_by(|a, b| a.fit.squares.total_cmp(&b.fit.squares));
        found
    }

    /// Finds curves again in the residual that the base coefficients leave when they are fitted together with the
    /// curve.
    fn refitted_beside_base(&self, present: &Fitted, left: &[f64], found: &mut [ResidualCurve]) {
        let data = &self.train;
        let loads = Loads::of(data, present);
        let acting: Vec<Acting> = present.model.effects.iter().map(|each| acting(each, data)).collect();
        let columns = changed_columns(data, &acting.iter().collect::<Vec<_>>());
        found.par_iter_mut().for_each(|each| {
            let load = loads.what(each.effect.multiplies);
            let Some(along) = self.along(each.covariate) else { return };
            for _ in 0..REFINED {
                let beside_curve = Residual { data, split: self.split, left, load }.beside_curve(
                    &each.fit.curve,
                    &along.values,
                    &columns,
                );
                let again = beside_curve.and_then(|left| {
                    let residual = Residual { data, split: self.split, left: &left, load };
                    residual.best_curve(along, |curve| is_plausible(each.covariate, curve))
                });
                match again {
                    Some(again) if again.squares < each.fit.squares => each.fit = again,
                    _ => break,
                }
            }
        });
        found.sort_by(|a, b| a.fit.squares.total_cmp(&b.fit.squares));
    }

    /// Fits a curve together with the model and keeps the held-out residuals of that, if they are smaller.
    fn fit_together(&self, model: &Fitted, found: &mut ResidualCurve) {
        let each = as_effect(found.effect, &found.fit.curve);
        let effects: Vec<FittedEffect> = model.model.effects.iter().cloned().chain([each]).collect();
        let Some(fitted) = fit(&self.train, &effects, FORM_ROUNDS) else { return };
        let left = held_out_residuals(&self.train, &fitted.model.effects, self.split);
        let finite = self.train.used().filter(|i| left[*i].is_finite());
        let squares = finite.map(|i| self.train.weight[i] * left[i].powi(2)).sum();
        if squares < found.fit.squares {
            (found.fit.left, found.fit.squares) = (left, squares);
        }
    }

    /// Held-out residuals `left` of a model less the best of the wanted curves; unchanged if that is not clearly
    /// better.
    pub(in crate::learn) fn less_best_curve(
        &self,
        model: &Fitted,
        left: &[f64],
        wanted: impl Fn(Covariate, Multiplies) -> bool + Sync,
    ) -> Vec<f64> {
        let best = self.curves(model, left, wanted).into_iter().next();
        let better = best.filter(|found| self.is_better(left, &found.fit.left));
        better.map_or_else(|| left.to_vec(), |found| found.fit.left)
    }

    /// Held-out residuals of an effect in its most flexible form: its law corrected by the best of the `wanted` curves, or in the place of
    /// the law a curve of its family that goes its way, whichever leaves less. `left`: those without it; `after`: those with its law.
    pub(in crate::learn) fn flexible(
        &self,
        present: &Fitted,
        left: &[f64],
        (trial, after): (&Trial, &[f64]),
        wanted: impl Fn(Covariate, Multiplies) -> bool + Sync,
    ) -> Vec<f64> {
        let effect = trial.effect;
        let is_family = |covariate, part| part == effect.multiplies && effect.family.contains(&covariate);
        let goes_its_way = |_, curve: &Curve| has_way(effect.way, &determined_shares(curve));
        let mut free = self.curves_of_shapes(present, left, is_family, goes_its_way);
        self.refitted_beside_base(present, left, &mut free);
        for found in &mut free {
            self.fit_together(present, found);
        }
        let corrected = self.less_best_curve(&trial.fitted, after, wanted);
        let all = free.into_iter().map(|found| found.fit.left).chain([corrected]);
        all.max_by(|a, b| self.drop_of(left, a).total_cmp(&self.drop_of(left, b))).unwrap_or_default()
    }

    /// Are the held-out residuals `after` clearly smaller than `before`?
    pub(in crate::learn) fn is_better(&self, before: &[f64], after: &[f64]) -> bool {
        self.criteria().is_clearly_better(t_statistic(&improvement_by_case(&self.train, before, after)))
    }

    /// The curves that may be added to a model, least held-out squares first.
    pub(in crate::learn) fn curves_beside(&self, present: &Fitted, left: &[f64]) -> Vec<ResidualCurve> {
        let has = |effect: &Effect| present.model.effects.iter().any(|each| each.effect.name == effect.name);
        // A table has no reading without a cut, so a curve of the tare over a quantity of the cut cannot be excluded
        // there.
        let is_series = self.data.is_series();
        let may_follow = |covariate, part| !is_series || part == Multiplies::Load || is_there_without_a_cut(covariate);
        // The base coefficients absorb a part of what a curve would explain; those of a few dozen cuts absorb much, so
        // that the curves of a table are fitted together with the whole model.
        let mut found = if is_series {
            let mut found = self.curves(present, left, may_follow);
            self.refitted_beside_base(present, left, &mut found);
            found
        } else {
            self.fitted_curves(present, left, may_follow)
        };
        found.retain(|each| !has(each.effect));
        found
    }

    /// The curve fitted together with the model, and the held-out residuals of that; `None` if it does not pass the
    /// tests.
    pub(in crate::learn) fn judged_curve(
        &self,
        present: &Fitted,
        before: &[f64],
        found: &ResidualCurve,
    ) -> Option<(Trial, Vec<f64>)> {
        let each = as_effect(found.effect, &found.fit.curve);
        let effects: Vec<FittedEffect> = present.model.effects.iter().cloned().chain([each.clone()]).collect();
        let fitted = fit(&self.train, &effects, FORM_ROUNDS)?;
        let (score, gain) = score_of(&self.train, present, &fitted, each.free_count());
        // A factor at its bound is not determined by the data.
        let is_determined = fitted.model.effects.last().is_some_and(|last| {
            let inside = |k: usize| {
                let parameter = &last.effect.parameters[k];
                last.values[k] > parameter.min && last.values[k] < parameter.max
            };
            (KNOTS..2 * KNOTS).filter(|k| last.free[*k]).all(inside)
        });
        if score < self.threshold() || !is_determined {
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

/// A curve as an effect: factors at its knots over that of the knot with the largest weight, which stays 1 because the
/// base coefficients already scale the whole load.
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

/// The data with the reading predicted for each sample as a covariate ([`Covariate::Load`]).
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
    use crate::path::Vec3;

    #[test]
    fn a_tare_follows_nothing_that_only_a_cut_has() {
        use Covariate::{
            AxialDepth, ChipThickness, Curvature, CuttingSpeed, FeedPerTooth, Immersion, Load, RadialDepth, SinceEntry,
            Sliding, UpShare, Volume,
        };
        let of_cut = [
            CuttingSpeed,
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
        assert_eq!(each.free_count(), 1);
        assert!(effect.is_physical(&each.values) && is_unnamed(effect));
        assert!(!is_unnamed(crate::effects::named("flank-wear").unwrap()));
    }

    #[test]
    fn a_curve_knows_nothing_of_what_only_the_samples_left_out_show() {
        // Six passes at six depths, in turn a fifth easier and a fifth harder.
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
        // Fitted to all blocks it leaves nothing.
        assert!(fit(&data, std::slice::from_ref(&curve), FORM_ROUNDS).unwrap().squares < 1e-6);
        let squares = |effects: &[FittedEffect]| -> f64 {
            held_out_residuals(&data, effects, &split).iter().map(|r| r * r).sum()
        };
        assert!(squares(&[curve]) > 0.8 * squares(&[]));
    }

    /// Samples of a table, all alike.
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
    fn what_wears_only_grows_and_time_may_come_and_go() {
        let up = Curve { knots: vec![[0.0, 0.0], [1.0, 0.2]], weight: vec![1.0; 2], in_steps: true };
        let back = Curve { knots: vec![[0.0, 0.0], [1.0, 0.2], [2.0, 0.0]], weight: vec![1.0; 3], in_steps: true };
        assert!(
            is_plausible(Covariate::Sliding, &up)
                && !is_plausible(Covariate::Sliding, &back)
                && is_plausible(Covariate::Time, &back)
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
        assert!(is_plausible(Covariate::AxialDepth, &through(&[0.0, 0.15, 0.0], &[1.0; 3])));
        assert!(!is_plausible(Covariate::AxialDepth, &zigzag) && is_plausible(Covariate::Z, &zigzag));
        let again = through(&[0.0, 0.15, 0.0, 0.13, 0.0], &[1.0; 5]);
        assert!(!is_plausible(Covariate::Z, &again) && is_plausible(Covariate::Time, &again));
        // A part with hardly any load does not count as a turning point.
        assert!(is_plausible(Covariate::AxialDepth, &through(&[0.0, 0.15, 0.0, 0.13], &[1.0, 1.0, 1.0, 0.05])));
    }

    #[test]
    fn what_takes_its_share_of_tare_and_load_alike_is_said_of_the_whole_reading() {
        let fast = |block: usize| (block / 2).is_multiple_of(2);
        let state = |i: usize| State { rps: if fast(i / EACH) { 150.0 } else { 90.0 }, ..State::default() };
        // Tare 50. In the fast half of the blocks the load is a fifth higher, and the tare by `of_tare`.
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
}
