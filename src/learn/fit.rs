//! Fits base coefficients and the parameters of effects together.
//!
//! Model of a reading: y = measure(Σ_b β_b·X_b(θ)), where X(θ) are the columns of [`Data`] as the effects change them:
//! tare columns times Π tare, cutting columns times Π cutting · feed ratio, edge columns times Π edge, after the geometry
//! variants were added; a lag filters X along time; the drive adds the excess c·P/P_max. β and θ minimise
//! Σ w (y − ŷ)² + Σ ((β − prior)/sd)²·σ² by damped Gauss–Newton (Levenberg–Marquardt), analytic in β, by differences in
//! θ, with θ kept inside its bounds.

use super::samples::{Class, Data, Variant};
use super::timeline::RUNOUTS_MM;
use crate::effects::{Change, Effect};
use nalgebra::{DMatrix, DVector};

/// An effect with values of its parameters.
#[derive(Debug, Clone)]
pub struct Use {
    /// Which.
    pub effect: &'static Effect,
    /// Values in the order of its parameters.
    pub values: Vec<f64>,
    /// Which of them are fitted; the others stay.
    pub free: Vec<bool>,
}

impl Use {
    /// Parameters that the data were asked for.
    pub fn asked(&self) -> usize {
        self.free.iter().filter(|f| **f).count()
    }
}

/// Base coefficients and effects.
#[derive(Debug, Clone, Default)]
pub struct Model {
    /// β.
    pub base: Vec<f64>,
    /// Effects in the order added.
    pub effects: Vec<Use>,
}

/// A fitted model.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// It.
    pub model: Model,
    /// Prediction of every sample, also of those with no weight.
    pub predicted: Vec<f64>,
    /// Σ w (y − ŷ)², and what the priors add.
    pub squares: f64,
    /// Covariance of (β, θ) for unit weight variance, times σ².
    pub covariance: DMatrix<f64>,
    /// Largest over smallest singular value of the scaled Jacobian of β.
    pub condition: f64,
}

impl Fitted {
    /// y − ŷ.
    pub fn residuals(&self, data: &Data) -> Vec<f64> {
        data.reading.iter().zip(&self.predicted).map(|(y, p)| y - p).collect()
    }
    /// Standard error of base coefficient `b`.
    pub fn std_error(&self, b: usize) -> f64 {
        self.covariance[(b, b)].max(0.0).sqrt()
    }
}

/// Predictions of a model.
pub fn predict(data: &Data, model: &Model) -> Vec<f64> {
    let columns = changed_columns(data, &model.effects);
    measured(&combine(&columns, &model.base, data.len()), data, &model.effects)
}

/// Columns as the effects change them.
pub fn changed_columns(data: &Data, effects: &[Use]) -> Vec<Vec<f64>> {
    let n = data.len();
    let mut columns = data.columns.clone();
    if effects.is_empty() {
        return columns;
    }
    let changes: Vec<Change> = (0..n).map(|i| combined_change(effects, data, i)).collect();
    for extra in &data.variants {
        for (column, more) in columns.iter_mut().zip(&extra.columns) {
            for i in 0..n {
                column[i] += size_of(extra.variant, &changes[i]) * more[i];
            }
        }
    }
    for (b, column) in columns.iter_mut().enumerate() {
        let class = data.base[b].class;
        for i in 0..n {
            column[i] *= match class {
                Class::Tare => changes[i].tare,
                Class::Cutting => changes[i].cutting,
                Class::Edge => changes[i].edge,
            };
        }
    }
    slow_down(data, changes.first(), &mut columns);
    if let Some(lag_s) = changes.first().map(|c| c.lag_s).filter(|lag| *lag > 0.0) {
        for column in &mut columns {
            filter(column, data, lag_s);
        }
    }
    columns
}

/// How much of a variant a change asks for, mm (or 0 … 1 for the curvature).
fn size_of(variant: Variant, change: &Change) -> f64 {
    match variant {
        Variant::StockTop => change.stock_top_mm,
        Variant::StockSide => change.stock_side_mm,
        Variant::Diameter => change.diameter_mm,
        Variant::Curved => change.curved,
        Variant::SmallRunout => runout_shares(change.runout_mm)[0],
        Variant::LargeRunout => runout_shares(change.runout_mm)[1],
    }
}

/// Shares of the changes at two runouts: linear between none, the smaller and the larger, and on beyond.
fn runout_shares(offset_mm: f64) -> [f64; 2] {
    let [small, large] = RUNOUTS_MM;
    if offset_mm <= small {
        return [offset_mm / small, 0.0];
    }
    let t = (offset_mm - small) / (large - small);
    [1.0 - t, t]
}

fn combined_change(effects: &[Use], data: &Data, i: usize) -> Change {
    let mut sum = Change::default();
    for each in effects {
        let one = (each.effect.change)(&each.values, &data.state[i]);
        // In air a covariate of the cut is not known, and nothing is there to change.
        let known = |factor: f64| if factor.is_finite() { factor } else { 1.0 };
        sum.tare *= known(one.tare);
        sum.cutting *= known(one.cutting);
        sum.edge *= known(one.edge);
        sum.peak_chip_mm += one.peak_chip_mm;
        sum.runout_mm += one.runout_mm;
        sum.stock_top_mm += one.stock_top_mm;
        sum.stock_side_mm += one.stock_side_mm;
        sum.diameter_mm += one.diameter_mm;
        sum.acceleration *= one.acceleration;
        sum.reading_excess += one.reading_excess;
        sum.lag_s += one.lag_s;
        sum.curved += one.curved;
    }
    sum
}

/// Cutting columns are proportional to the feed; between two factors the ratio is linear in the factor's logarithm.
fn slow_down(data: &Data, change: Option<&Change>, columns: &mut [Vec<f64>]) {
    let Some(factor) = change.map(|c| c.acceleration).filter(|f| *f < 1.0) else { return };
    let Some(last) = data.slower.last() else { return };
    let after = data.slower.iter().position(|s| s.factor <= factor);
    let (below, t) = match after {
        None => (last, 1.0),
        Some(k) => {
            let above = if k == 0 { 1.0 } else { data.slower[k - 1].factor };
            (&data.slower[k], (above / factor).ln() / (above / data.slower[k].factor).ln())
        }
    };
    let above = after.filter(|k| *k > 0).map(|k| &data.slower[k - 1].ratio);
    for (b, column) in columns.iter_mut().enumerate() {
        if data.base[b].class == Class::Cutting {
            for (i, value) in column.iter_mut().enumerate() {
                let high = above.map_or(1.0, |ratio| ratio[i]);
                *value *= high + t * (below.ratio[i] - high);
            }
        }
    }
}

/// First-order lag along the runs; the value of a sample is the mean of the filtered signal over its span.
fn filter(column: &mut [f64], data: &Data, lag_s: f64) {
    let mut level = 0.0;
    for (i, value) in column.iter_mut().enumerate() {
        if i == 0 || data.run[i] != data.run[i - 1] {
            level = *value;
        }
        let x = data.span_s[i] / lag_s;
        let keep = (-x).exp();
        let share = if x > 1e-9 { (1.0 - keep) / x } else { 1.0 };
        let input = *value;
        *value = input + (level - input) * share;
        level = input + (level - input) * keep;
    }
}

fn combine(columns: &[Vec<f64>], base: &[f64], n: usize) -> Vec<f64> {
    let mut sum = vec![0.0; n];
    for (column, beta) in columns.iter().zip(base) {
        for (s, x) in sum.iter_mut().zip(column) {
            *s += beta * x;
        }
    }
    sum
}

/// The reading that the measuring chain makes of a load.
fn measured(load: &[f64], data: &Data, effects: &[Use]) -> Vec<f64> {
    let excess = reading_excess(data, effects);
    if excess == 0.0 {
        return load.to_vec();
    }
    let top = top_reading(data);
    load.iter().map(|p| p * (1.0 + excess * p / top)).collect()
}

fn reading_excess(data: &Data, effects: &[Use]) -> f64 {
    if data.is_empty() { 0.0 } else { combined_change(effects, data, 0).reading_excess }
}

/// Scale of the efficiency effect: the 99th percentile of the readings.
pub fn top_reading(data: &Data) -> f64 {
    let mut sorted: Vec<f64> = data.used().map(|i| data.reading[i]).collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() * 99 / 100).copied().unwrap_or(1.0).abs().max(1e-9)
}

/// Fits β and the parameters of all effects, from the values in `effects`; `None` when no sample counts.
pub fn fit(data: &Data, effects: &[Use], iterations: usize) -> Option<Fitted> {
    let used: Vec<usize> = data.used().collect();
    if used.len() < data.base.len() {
        return None;
    }
    let mut search = Search { data, used, theta: effects.to_vec(), base: Vec::new() };
    search.base = search.best_base()?;
    let bounded = search.clamp_base();
    let mut squares = search.objective(&search.base, &search.theta);
    let mut damping = 1e-3;
    let free: usize = effects.iter().map(|e| e.values.len()).sum();
    let rounds = if bounded { iterations.max(12) } else { iterations };
    for _ in 0..if free == 0 && !bounded && reading_excess(data, effects) == 0.0 { 0 } else { rounds } {
        let (normal, gradient) = search.normal_equations();
        let mut improved = false;
        for _ in 0..6 {
            let Some(step) = search.step_within(&normal, &gradient, damping) else { break };
            let (base, theta) = search.moved(&step);
            let next = search.objective(&base, &theta);
            if next.is_finite() && next < squares {
                improved = squares - next > 1e-7 * squares;
                (search.base, search.theta, squares) = (base, theta, next);
                damping = (damping * 0.2).max(1e-12);
                break;
            }
            damping *= 10.0;
        }
        if !improved {
            break;
        }
    }
    Some(search.finish())
}

/// Columns of dŷ/dβ, then dŷ/dθ, at a fitted model.
pub fn jacobian(data: &Data, fitted: &Fitted) -> Vec<Vec<f64>> {
    let model = fitted.model.clone();
    Search { data, used: Vec::new(), theta: model.effects, base: model.base }.jacobian()
}

struct Search<'a> {
    data: &'a Data,
    used: Vec<usize>,
    theta: Vec<Use>,
    base: Vec<f64>,
}

impl Search<'_> {
    /// β for the present θ: exact when the chain is linear.
    fn best_base(&self) -> Option<Vec<f64>> {
        let columns = changed_columns(self.data, &self.theta);
        let p = columns.len();
        let (mut normal, mut rhs) = (DMatrix::zeros(p, p), DVector::zeros(p));
        for &i in &self.used {
            let w = self.data.weight[i];
            for a in 0..p {
                rhs[a] += w * columns[a][i] * self.data.reading[i];
                for b in 0..=a {
                    normal[(a, b)] += w * columns[a][i] * columns[b][i];
                }
            }
        }
        mirror(&mut normal);
        for (b, base) in self.data.base.iter().enumerate() {
            if let Some((mean, sd)) = base.prior {
                normal[(b, b)] += 1.0 / (sd * sd);
                rhs[b] += mean / (sd * sd);
            }
        }
        damped_step(&normal, &rhs, 1e-13).map(|step| step.iter().copied().collect())
    }

    /// Puts β within its bounds; true when it was not.
    fn clamp_base(&mut self) -> bool {
        let mut outside = false;
        for (value, base) in self.base.iter_mut().zip(&self.data.base) {
            let inside = value.clamp(base.bounds.0, base.bounds.1);
            outside |= inside != *value;
            *value = inside;
        }
        outside
    }

    /// A step that leaves those β alone that stand on a bound and would cross it.
    fn step_within(&self, normal: &DMatrix<f64>, gradient: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
        let (mut normal, mut gradient) = (normal.clone(), gradient.clone());
        for _ in 0..=self.base.len() {
            let step = damped_step(&normal, &gradient, damping)?;
            let crossing: Vec<usize> = (0..self.base.len())
                .filter(|&b| {
                    let (lo, hi) = self.data.base[b].bounds;
                    (self.base[b] <= lo && step[b] < 0.0) || (self.base[b] >= hi && step[b] > 0.0)
                })
                .collect();
            if crossing.is_empty() {
                return Some(step);
            }
            for b in crossing {
                normal.row_mut(b).fill(0.0);
                normal.column_mut(b).fill(0.0);
                gradient[b] = 0.0;
            }
        }
        None
    }

    fn objective(&self, base: &[f64], theta: &[Use]) -> f64 {
        let model = Model { base: base.to_vec(), effects: theta.to_vec() };
        let predicted = predict(self.data, &model);
        self.squares(&predicted) + self.prior(base)
    }

    fn squares(&self, predicted: &[f64]) -> f64 {
        self.used.iter().map(|&i| self.data.weight[i] * (self.data.reading[i] - predicted[i]).powi(2)).sum()
    }

    fn prior(&self, base: &[f64]) -> f64 {
        let pull = |(spec, value): (&super::samples::Base, &f64)| {
            spec.prior.map_or(0.0, |(mean, sd)| ((value - mean) / sd).powi(2))
        };
        self.data.base.iter().zip(base).map(pull).sum()
    }

    /// JᵀWJ and JᵀWr over (β, θ).
    fn normal_equations(&self) -> (DMatrix<f64>, DVector<f64>) {
        let jacobian = self.jacobian();
        let model = Model { base: self.base.clone(), effects: self.theta.clone() };
        let predicted = predict(self.data, &model);
        let p = jacobian.len();
        let (mut normal, mut gradient) = (DMatrix::zeros(p, p), DVector::zeros(p));
        for &i in &self.used {
            let w = self.data.weight[i];
            let r = self.data.reading[i] - predicted[i];
            for a in 0..p {
                let wa = w * jacobian[a][i];
                gradient[a] += wa * r;
                for b in 0..=a {
                    normal[(a, b)] += wa * jacobian[b][i];
                }
            }
        }
        mirror(&mut normal);
        for (b, base) in self.data.base.iter().enumerate() {
            if let Some((mean, sd)) = base.prior {
                normal[(b, b)] += 1.0 / (sd * sd);
                gradient[b] += (mean - self.base[b]) / (sd * sd);
            }
        }
        (normal, gradient)
    }

    /// Columns of dŷ/dβ, then dŷ/dθ.
    fn jacobian(&self) -> Vec<Vec<f64>> {
        let n = self.data.len();
        let mut columns = changed_columns(self.data, &self.theta);
        let load = combine(&columns, &self.base, n);
        let excess = reading_excess(self.data, &self.theta);
        if excess != 0.0 {
            let top = top_reading(self.data);
            for column in &mut columns {
                column.iter_mut().zip(&load).for_each(|(x, p)| *x *= 1.0 + 2.0 * excess * p / top);
            }
        }
        let at = measured(&load, self.data, &self.theta);
        for e in 0..self.theta.len() {
            for k in 0..self.theta[e].values.len() {
                columns.push(self.slope(e, k, &at));
            }
        }
        columns
    }

    fn slope(&self, e: usize, k: usize, at: &[f64]) -> Vec<f64> {
        let mut theta = self.theta.clone();
        let parameter = &theta[e].effect.parameters[k];
        if parameter.scanned || !theta[e].free[k] {
            return vec![0.0; at.len()];
        }
        let value = theta[e].values[k];
        let size = 1e-4 * value.abs().max(1e-2 * parameter.max.min(1.0));
        let step = if value + size > parameter.max { -size } else { size };
        theta[e].values[k] = value + step;
        let moved = predict(self.data, &Model { base: self.base.clone(), effects: theta });
        moved.iter().zip(at).map(|(m, a)| (m - a) / step).collect()
    }

    fn moved(&self, step: &DVector<f64>) -> (Vec<f64>, Vec<Use>) {
        let p = self.base.len();
        let within =
            |((b, s), spec): ((&f64, &f64), &super::samples::Base)| (b + s).clamp(spec.bounds.0, spec.bounds.1);
        let base = self.base.iter().zip(step.iter()).zip(&self.data.base).map(within).collect();
        let mut theta = self.theta.clone();
        let mut next = p;
        for each in &mut theta {
            for (value, parameter) in each.values.iter_mut().zip(each.effect.parameters) {
                *value = (*value + step[next]).clamp(parameter.min, parameter.max);
                next += 1;
            }
        }
        (base, theta)
    }

    fn finish(self) -> Fitted {
        let (normal, _) = self.normal_equations();
        let model = Model { base: self.base.clone(), effects: self.theta.clone() };
        let predicted = predict(self.data, &model);
        let squares = self.squares(&predicted) + self.prior(&self.base);
        let seen = (0..normal.nrows()).filter(|&k| normal[(k, k)] > 0.0).count();
        let freedom = self.used.len().saturating_sub(seen).max(1) as f64;
        let covariance = pseudo_inverse(&normal) * (squares / freedom);
        let condition = condition_of(&normal.view((0, 0), (self.base.len(), self.base.len())).into_owned());
        Fitted { model, predicted, squares, covariance, condition }
    }
}

fn mirror(m: &mut DMatrix<f64>) {
    for a in 0..m.nrows() {
        for b in 0..a {
            m[(b, a)] = m[(a, b)];
        }
    }
}

/// Unit diagonal, and the factors that were taken out; parameters that nothing depends on are pinned.
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

fn pseudo_inverse(normal: &DMatrix<f64>) -> DMatrix<f64> {
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
