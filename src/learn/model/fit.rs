//! Fits base coefficients β and the parameters θ of effects together. In: data, effects with start values. Out:
//! [`Fitted`].
//!
//! Model of a reading: ŷ = P·(1 + c·(P/P₁)^p), P = Σ_b β_b·X_b(θ), where X(θ) are the columns of [`Data`] as the
//! effects change them ([`super::design`]) and c and p describe the excess of the drive. β and θ minimise
//! Σ w (y − ŷ)² + Σ ((β − prior)/sd)² by damped Gauss–Newton steps (Levenberg 1944, Marquardt 1963) within bounds, with derivatives
//! analytic in β and by differences in θ; after every step of θ, β is solved for again (variable projection, Golub and
//! Pereyra 1973).

use crate::effects::{Geometry, Parameter, Place};
use crate::learn::dataset::samples::{Class, Data};
use crate::learn::model::design::{
    Acting, FittedEffect, acting, acting_on, before_drive, changed_columns, combined, leaves_parts, load,
    load_from_readings, load_of_parts, measured, parts, slopes_of_readings,
};
use crate::learn::regress::statistics::dot;
use nalgebra::{DMatrix, DVector};
use std::rc::Rc;

/// Base coefficients and effects.
#[derive(Debug, Clone, Default)]
pub struct Model {
    /// β.
    pub base: Vec<f64>,
    /// Effects in the order added.
    pub effects: Vec<FittedEffect>,
}

impl Model {
    /// Number of parameters that are fitted: the base coefficients and the free ones of the effects.
    pub fn parameter_count(&self) -> usize {
        self.base.len() + self.effects.iter().map(FittedEffect::free_count).sum::<usize>()
    }
}

/// A fitted model.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// Coefficients and parameters.
    pub model: Model,
    /// Prediction of every sample, also of those with no weight.
    pub predicted: Vec<f64>,
    /// The minimised sum: Σ w (y − ŷ)² + Σ ((β − prior)/sd)².
    pub squares: f64,
}

/// How well the data determine the parameters of a fitted model.
#[derive(Debug, Clone)]
pub struct Certainty {
    /// Covariance of (β, θ): σ² times the pseudo-inverse of the normal matrix.
    pub covariance: DMatrix<f64>,
    /// Largest over smallest singular value of the scaled Jacobian of β.
    pub condition: f64,
}

impl Certainty {
    /// Standard error of the k-th of (β, θ).
    pub fn std_error(&self, k: usize) -> f64 {
        self.covariance[(k, k)].max(0.0).sqrt()
    }
}

/// Covariance and condition of a fitted model.
pub fn certainty(data: &Data, fitted: &Fitted) -> Certainty {
    let search = Search::new(data, &data.weight);
    let (base, effects) = (&fitted.model.base, &fitted.model.effects);
    let at = search.point(base.clone(), effects.clone(), search.acting(effects));
    let (normal, _) = search.normal_equations(&at);
    let seen = (0..normal.nrows()).filter(|&k| normal[(k, k)] > 0.0).count();
    let freedom = search.used.len().saturating_sub(seen).max(1) as f64;
    Certainty {
        covariance: pseudo_inverse(&normal) * (at.objective / freedom),
        condition: condition_of(&normal.view((0, 0), (base.len(), base.len())).into_owned()),
    }
}

impl Fitted {
    /// y − ŷ.
    pub fn residuals(&self, data: &Data) -> Vec<f64> {
        data.reading.iter().zip(&self.predicted).map(|(y, p)| y - p).collect()
    }
}

/// Predictions of a model.
pub fn predict(data: &Data, model: &Model) -> Vec<f64> {
    let acting: Vec<Acting> = model.effects.iter().map(|each| acting(each, data)).collect();
    let acting: Vec<&Acting> = acting.iter().collect();
    measured(data, load(data, &acting, &model.base), &acting)
}

/// Part of the present prediction that belongs to the given classes.
pub fn part(data: &Data, present: &Fitted, classes: &[Class]) -> Vec<f64> {
    let acting: Vec<Acting> = present.model.effects.iter().map(|each| acting(each, data)).collect();
    let columns = changed_columns(data, &acting.iter().collect::<Vec<_>>());
    let mut sum = vec![0.0; data.len()];
    for (b, column) in columns.iter().enumerate() {
        if classes.contains(&data.base[b].class) {
            sum.iter_mut().zip(column).for_each(|(s, x)| *s += present.model.base[b] * x);
        }
    }
    sum
}

/// Relative drop of the squares below which a fit has converged: with ten thousand samples 0.01 in twice the
/// log-likelihood, far below every threshold of [`crate::learn::diagnose::criteria`].
const CONVERGED: f64 = 1e-6;

/// Fits β and the parameters of all effects, from the values in `effects`; `None` with fewer samples than base
/// coefficients.
pub fn fit(data: &Data, effects: &[FittedEffect], iterations: usize) -> Option<Fitted> {
    fit_weighed(data, &data.weight, effects, iterations)
}

/// The same with other weights than those of the data.
pub fn fit_weighed(data: &Data, weight: &[f64], effects: &[FittedEffect], iterations: usize) -> Option<Fitted> {
    let search = Search::new(data, weight);
    if search.used.len() < data.base.len() {
        return None;
    }
    let acting = search.acting(effects);
    let (base, bounded) = search.best_base(&acting)?;
    let mut at = search.point(base, effects.to_vec(), acting);
    let mut damping = 1e-3;
    let free: usize = effects.iter().map(|e| e.values.len()).sum();
    let rounds = if bounded { iterations.max(12) } else { iterations };
    for _ in 0..if free == 0 && !bounded && at.excess() == 0.0 { 0 } else { rounds } {
        let (normal, gradient) = search.normal_equations(&at);
        let mut improved = false;
        for _ in 0..6 {
            let Some(step) = search.step_within(&at, &normal, &gradient, damping) else { break };
            let next = search.moved(&at, &step);
            if next.objective.is_finite() && next.objective < at.objective {
                improved = at.objective - next.objective > CONVERGED * at.objective;
                at = next;
                damping = (damping * 0.2).max(1e-12);
                break;
            }
            damping *= 10.0;
        }
        if !improved {
            break;
        }
    }
    let model = Model { base: at.base, effects: at.theta };
    Some(Fitted { model, predicted: at.predicted, squares: at.objective })
}

/// Columns of dŷ/dβ, then dŷ/dθ, at a fitted model; 0 for θ that are not fitted.
pub fn jacobian(data: &Data, fitted: &Fitted) -> Vec<Vec<f64>> {
    let search = Search::new(data, &data.weight);
    let effects = &fitted.model.effects;
    let at = search.point(fitted.model.base.clone(), effects.clone(), search.acting(effects));
    let mut columns = search.jacobian(&at);
    for column in &mut columns {
        column.resize(data.len(), 0.0);
    }
    columns
}

struct Search<'a> {
    data: &'a Data,
    weight: &'a [f64],
    used: Vec<usize>,
    /// Base coefficients whose column is 0 in every sample with weight. The tail that a lag leaves in later samples is
    /// too little to determine them: they keep the value of their prior.
    without_data: Vec<bool>,
    /// Where the borders of a region may lie in X and Y.
    borders_mm: [(f64, f64); 2],
}

/// A model with its prediction of the data.
struct Point {
    base: Vec<f64>,
    theta: Vec<FittedEffect>,
    acting: Vec<Rc<Acting>>,
    /// The load before the factors of the effects.
    parts: [Vec<f64>; 3],
    /// Σ β·column, before the drive's excess.
    load: Vec<f64>,
    predicted: Vec<f64>,
    /// Σ w (y − ŷ)² + Σ ((β − prior)/sd)².
    objective: f64,
}

impl Point {
    fn acting(&self) -> Vec<&Acting> {
        self.acting.iter().map(Rc::as_ref).collect()
    }

    fn excess(&self) -> f64 {
        combined(&self.acting()).excess.at_full
    }
}

impl<'a> Search<'a> {
    fn new(data: &'a Data, weight: &'a [f64]) -> Self {
        let used: Vec<usize> = (0..data.len()).filter(|i| weight[*i] > 0.0).collect();
        let without_data = data.columns.iter().map(|column| used.iter().all(|i| column[*i] == 0.0)).collect();
        Self { data, weight, used, without_data, borders_mm: [0, 1].map(|axis| borders_mm(data, axis)) }
    }

    fn acting(&self, theta: &[FittedEffect]) -> Vec<Rc<Acting>> {
        theta.iter().map(|each| Rc::new(acting(each, self.data))).collect()
    }

    /// The same for effects next to a point; those with unchanged values are reused.
    fn acting_beside(&self, at: &Point, theta: &[FittedEffect]) -> Vec<Rc<Acting>> {
        let beside = |((each, last), acts): ((&FittedEffect, &FittedEffect), &Rc<Acting>)| {
            if each.values == last.values { Rc::clone(acts) } else { Rc::new(acting(each, self.data)) }
        };
        theta.iter().zip(&at.theta).zip(&at.acting).map(beside).collect()
    }

    fn point(&self, base: Vec<f64>, theta: Vec<FittedEffect>, acting: Vec<Rc<Acting>>) -> Point {
        let all: Vec<&Acting> = acting.iter().map(Rc::as_ref).collect();
        let parts = parts(self.data, &all, &base);
        let load = load_of_parts(self.data, &parts, &all);
        let predicted = measured(self.data, load.clone(), &all);
        let objective = self.squares(&predicted) + self.prior(&base);
        Point { base, theta, acting, parts, load, predicted, objective }
    }

    /// β for these θ by linear least squares, clamped to its bounds, and whether it was clamped. If the drive has an
    /// excess, the readings are converted to loads first, and each is weighted by the slope of its reading over the
    /// load.
    fn best_base(&self, acting: &[Rc<Acting>]) -> Option<(Vec<f64>, bool)> {
        let all: Vec<&Acting> = acting.iter().map(Rc::as_ref).collect();
        let excess = combined(&all).excess;
        let mut columns = self.columns(&all);
        let mut rest = before_drive(self.data, &excess);
        let slopes = slopes_of_readings(self.data, &rest, &excess);
        if let Some(kept) = load_from_readings(self.data, &all) {
            rest.iter_mut().zip(&kept).for_each(|(y, k)| *y -= k);
        }
        if let Some(slopes) = &slopes {
            for column in columns.iter_mut().chain([&mut rest]) {
                column.iter_mut().zip(slopes).for_each(|(x, s)| *x *= s);
            }
        }
        let (mut normal, mut rhs) = self.sums(&columns, &rest);
        self.with_priors(&mut normal, &mut rhs, &vec![0.0; columns.len()]);
        let mut base: Vec<f64> = damped_step(&normal, &rhs, 1e-13)?.iter().copied().collect();
        let mut outside = false;
        for (value, spec) in base.iter_mut().zip(&self.data.base) {
            let inside = value.clamp(spec.bounds.0, spec.bounds.1);
            outside |= inside != *value;
            *value = inside;
        }
        Some((base, outside))
    }

    /// Columns of the base coefficients as the effects change them.
    fn columns(&self, acting: &[&Acting]) -> Vec<Vec<f64>> {
        let mut columns = changed_columns(self.data, acting);
        columns
            .iter_mut()
            .zip(&self.without_data)
            .filter(|(_, without_data)| **without_data)
            .for_each(|(column, _)| column.fill(0.0));
        columns
    }

    /// XᵀWX and XᵀWy; an empty column counts as 0. Columns are finite in samples without weight too, so these add 0.
    fn sums(&self, columns: &[Vec<f64>], y: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        let p = columns.len();
        let (mut normal, mut rhs) = (DMatrix::zeros(p, p), DVector::zeros(p));
        for a in 0..p {
            let weighted: Vec<f64> = columns[a].iter().zip(self.weight).map(|(x, w)| w * x).collect();
            if weighted.iter().all(|w| *w == 0.0) {
                continue;
            }
            rhs[a] = dot(&weighted, y);
            for b in 0..=a {
                normal[(a, b)] = dot(&weighted, &columns[b]);
                normal[(b, a)] = normal[(a, b)];
            }
        }
        (normal, rhs)
    }

    /// Adds the terms of the priors of β at β = `base`.
    fn with_priors(&self, normal: &mut DMatrix<f64>, gradient: &mut DVector<f64>, base: &[f64]) {
        for (b, spec) in self.data.base.iter().enumerate() {
            if let Some((mean, sd)) = spec.prior {
                normal[(b, b)] += 1.0 / (sd * sd);
                gradient[b] += (mean - base[b]) / (sd * sd);
            }
        }
    }

    /// A damped step; β and θ that are at a bound and would cross it are held there (active set).
    fn step_within(
        &self,
        at: &Point,
        normal: &DMatrix<f64>,
        gradient: &DVector<f64>,
        damping: f64,
    ) -> Option<DVector<f64>> {
        let (mut normal, mut gradient) = (normal.clone(), gradient.clone());
        let bounded = self.bounded(at);
        for _ in 0..=bounded.len() {
            let step = damped_step(&normal, &gradient, damping)?;
            let crosses = |&k: &usize| {
                let (value, (lo, hi)) = bounded[k];
                (value <= lo && step[k] < 0.0) || (value >= hi && step[k] > 0.0)
            };
            let crossing: Vec<usize> = (0..bounded.len()).filter(crosses).collect();
            if crossing.is_empty() {
                return Some(step);
            }
            for k in crossing {
                normal.row_mut(k).fill(0.0);
                normal.column_mut(k).fill(0.0);
                gradient[k] = 0.0;
            }
        }
        None
    }

    /// Values and bounds of β, then of θ.
    fn bounded(&self, at: &Point) -> Vec<(f64, (f64, f64))> {
        let base = at.base.iter().zip(&self.data.base).map(|(value, spec)| (*value, spec.bounds));
        let bounds = |p: &Parameter| match p.place {
            Some(Place::XMin | Place::XMax) => self.borders_mm[0],
            Some(Place::YMin | Place::YMax) => self.borders_mm[1],
            _ => (p.min, p.max),
        };
        let own = |each: &FittedEffect| {
            let mut bounds: Vec<(f64, f64)> = each.effect.parameters.iter().map(bounds).collect();
            let told = each.values.get(1).and_then(|phase| self.data.runouts.phases_told(*phase));
            if let Some(told) = told.filter(|_| each.effect.changes(Geometry::Runout)) {
                bounds[1] = told;
            }
            each.values.clone().into_iter().zip(bounds)
        };
        base.chain(at.theta.iter().flat_map(own)).collect()
    }

    fn squares(&self, predicted: &[f64]) -> f64 {
        self.used.iter().map(|&i| self.weight[i] * (self.data.reading[i] - predicted[i]).powi(2)).sum()
    }

    fn prior(&self, base: &[f64]) -> f64 {
        let pull = |(spec, value): (&crate::learn::dataset::samples::Base, &f64)| {
            spec.prior.map_or(0.0, |(mean, sd)| ((value - mean) / sd).powi(2))
        };
        self.data.base.iter().zip(base).map(pull).sum()
    }

    /// JᵀWJ and JᵀWr over (β, θ).
    fn normal_equations(&self, at: &Point) -> (DMatrix<f64>, DVector<f64>) {
        let residual: Vec<f64> = self.data.reading.iter().zip(&at.predicted).map(|(y, p)| y - p).collect();
        let (mut normal, mut gradient) = self.sums(&self.jacobian(at), &residual);
        self.with_priors(&mut normal, &mut gradient, &at.base);
        (normal, gradient)
    }

    /// Columns of dŷ/dβ, then dŷ/dθ; empty for θ that are not fitted.
    fn jacobian(&self, at: &Point) -> Vec<Vec<f64>> {
        let mut columns = self.columns(&at.acting());
        if let Some(slopes) = slopes_of_readings(self.data, &at.load, &combined(&at.acting()).excess) {
            for column in &mut columns {
                column.iter_mut().zip(&slopes).for_each(|(x, slope)| *x *= slope);
            }
        }
        for e in 0..at.theta.len() {
            for k in 0..at.theta[e].values.len() {
                columns.push(self.slope(e, k, at));
            }
        }
        columns
    }

    fn slope(&self, e: usize, k: usize, at: &Point) -> Vec<f64> {
        let mut each = at.theta[e].clone();
        let parameter = &each.effect.parameters[k];
        if parameter.is_scanned() || !each.free[k] {
            return Vec::new();
        }
        let value = each.values[k];
        let size = 1e-4 * value.abs().max(1e-2 * parameter.max.min(1.0));
        let step = if value + size > parameter.max { -size } else { size };
        each.values[k] = value + step;
        // With a lag a sample depends on those before it, also on those without weight.
        let all_count = self.used.len() == self.data.len() || combined(&at.acting()).lag_s > 0.0;
        let own =
            if all_count { acting(&each, self.data) } else { acting_on(&each, self.data, self.used.iter().copied()) };
        let mut all = at.acting();
        all[e] = &own;
        let load = if leaves_parts(&at.acting[e], &own) {
            load_of_parts(self.data, &at.parts, &all)
        } else {
            load(self.data, &all, &at.base)
        };
        let moved = measured(self.data, load, &all);
        moved.iter().zip(&at.predicted).map(|(m, a)| (m - a) / step).collect()
    }

    /// θ moved by the step, with the β that are best there, because the prediction depends on products of β and θ. β
    /// moves by the step itself if the reading is not linear in it or the best β is outside its bounds.
    fn moved(&self, at: &Point, step: &DVector<f64>) -> Point {
        let mut next = self.bounded(at).into_iter().zip(step.iter()).map(|((v, (lo, hi)), s)| (v + s).clamp(lo, hi));
        let stepped: Vec<f64> = next.by_ref().take(at.base.len()).collect();
        let mut theta = at.theta.clone();
        theta.iter_mut().flat_map(|each| &mut each.values).zip(next).for_each(|(value, moved)| *value = moved);
        let acting = self.acting_beside(at, &theta);
        let linear = combined(&acting.iter().map(Rc::as_ref).collect::<Vec<_>>()).excess.at_full == 0.0;
        let best = self.best_base(&acting).filter(|(_, outside)| linear && !outside);
        self.point(best.map_or(stepped, |(base, _)| base), theta, acting)
    }
}

/// Where a border of a region may lie along an axis: among the places of the tool, or up to their whole extent beyond, mm. What lies
/// farther out no cut shows, and a border there would drift without end.
fn borders_mm(data: &Data, axis: usize) -> (f64, f64) {
    let places = data.state.iter().map(|state| state.position[axis]).filter(|at| at.is_finite());
    let (least, most) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), at| (a.min(at), b.max(at)));
    let beyond = (most - least).max(0.0);
    if least > most { (f64::NEG_INFINITY, f64::INFINITY) } else { (least - beyond, most + beyond) }
}

/// The normal matrix scaled to a unit diagonal, and the scale factors; 0 for parameters without influence.
fn scaled(normal: &DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
    let p = normal.nrows();
    let scale: Vec<f64> = (0..p).map(|k| normal[(k, k)].sqrt()).map(|s| if s > 1e-150 { s } else { 0.0 }).collect();
    let unit = DMatrix::from_fn(p, p, |a, b| {
        if scale[a] > 0.0 && scale[b] > 0.0 { normal[(a, b)] / (scale[a] * scale[b]) } else { f64::from(a == b) }
    });
    (unit, scale)
}

fn damped_step(normal: &DMatrix<f64>, gradient: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
    let (mut unit, scale) = scaled(normal);
    for k in 0..unit.nrows() {
        unit[(k, k)] += damping;
    }
    let per = |k: usize, v: f64| if scale[k] > 0.0 { v / scale[k] } else { 0.0 };
    let rhs = DVector::from_fn(gradient.len(), |k, _| per(k, gradient[k]));
    let solved = unit.cholesky()?.solve(&rhs);
    Some(DVector::from_fn(solved.len(), |k, _| per(k, solved[k])))
}

/// Pseudo-inverse, computed from the matrix scaled to a unit diagonal; 0 for parameters without influence.
pub fn pseudo_inverse(normal: &DMatrix<f64>) -> DMatrix<f64> {
    let p = normal.nrows();
    let (unit, scale) = scaled(normal);
    let inverse = unit.pseudo_inverse(1e-12).unwrap_or_else(|_| DMatrix::zeros(p, p));
    DMatrix::from_fn(
        p,
        p,
        |a, b| {
            if scale[a] > 0.0 && scale[b] > 0.0 { inverse[(a, b)] / (scale[a] * scale[b]) } else { 0.0 }
        },
    )
}

fn condition_of(normal: &DMatrix<f64>) -> f64 {
    let values = scaled(normal).0.symmetric_eigenvalues();
    (values.max() / values.min().max(1e-300)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{State, named};
    use crate::learn::dataset::samples::{Base, Class, UNBOUNDED};
    use crate::learn::model::starts::{forms, start_values};
    use crate::machine::wear::Lengths;
    use crate::path::Vec3;

    /// Cuts with an edge coefficient that has grown by two thirds at the end.
    fn worn() -> Data {
        let n = 600;
        let base =
            |name: &str, class| Base { name: name.into(), unit: String::new(), class, prior: None, bounds: UNBOUNDED };
        let cut = |i: usize| 0.2 + 0.02 * (i % 7) as f64;
        let edge = |i: usize| 5.0 + 0.3 * (i % 5) as f64;
        let grown = |i: usize| 1.0 + i as f64 / 900.0;
        let slid = |i: usize| Lengths::at_reference(1e6 * i as f64 / n as f64);
        let state = |i: usize| State { time_s: i as f64, slid: slid(i), ..State::default() };
        Data {
            base: vec![base("k_tc", Class::Cutting), base("k_te", Class::Edge)],
            columns: vec![(0..n).map(cut).collect(), (0..n).map(edge).collect()],
            reading: (0..n).map(|i| 820.0 * cut(i) + 17.0 * grown(i) * edge(i)).collect(),
            weight: vec![1.0; n],
            state: (0..n).map(state).collect(),
            span_s: vec![1.0; n],
            run: vec![0; n],
            channel: vec![0; n],
            ..Data::default()
        }
    }

    #[test]
    fn what_no_sample_shows_is_not_told_by_what_a_lag_leaves_of_it() {
        let mut data = worn();
        // A run-up of the spindle in samples without weight; the next samples have its tail and an error.
        data.base.push(Base { name: "run_up".into(), prior: Some((0.0, 1e3)), ..data.base[0].clone() });
        data.columns.push((0..600).map(|i| if i < 10 { 1.0 } else { 0.0 }).collect());
        data.weight[..10].fill(0.0);
        data.reading[10..14].iter_mut().for_each(|y| *y += 5.0);
        data.readings_per_sample = vec![1.0; 600];
        let lag = FittedEffect { effect: named("sensor-lag").unwrap(), values: vec![0.3], free: vec![true] };
        let found = fit(&data, std::slice::from_ref(&lag), 8).unwrap();
        assert_eq!(found.model.base[2], 0.0);
        // With weight on these samples it is determined.
        data.weight[..10].fill(1.0);
        assert!(fit(&data, &[lag], 8).unwrap().model.base[2] != 0.0);
    }

    #[test]
    fn every_form_of_wear_ends_at_the_growth_that_is_there() {
        let data = worn();
        let wear = named("flank-wear").unwrap();
        for each in start_values(wear).iter().flat_map(|values| forms(wear, values)) {
            let found = fit(&data, std::slice::from_ref(&each), 25).unwrap();
            let [growth, run_in, _, end, ..] = found.model.effects[0].values[..] else { panic!("its stages") };
            assert!((growth - 2.0 / 30.0).abs() < 1e-4, "{:?}: {growth}", each.free);
            assert!(run_in < 1e-3 && end < 1e-5 && (found.model.base[1] - 17.0).abs() < 0.02);
        }
    }

    #[test]
    fn borders_of_a_region_stay_where_cuts_may_show_them() {
        let mut data = worn();
        for (i, state) in data.state.iter_mut().enumerate() {
            state.position = Vec3::new((i % 101) as f64, (i / 101) as f64, 0.0);
        }
        assert_eq!([0, 1].map(|axis| borders_mm(&data, axis)), [(-100.0, 200.0), (-5.0, 10.0)]);
        let values = vec![0.2, -1e5, 50.0, 0.0, 1e5, 0.4, 4.0];
        let far = FittedEffect { effect: named("hard-zone").unwrap(), free: vec![true; values.len()], values };
        let found = fit(&data, &[far], 25).unwrap();
        let [_, x_min, _, _, y_max, ..] = found.model.effects[0].values[..] else { panic!("its borders") };
        assert!(x_min >= -100.0 && y_max <= 10.0, "{x_min} {y_max}");
    }
}
