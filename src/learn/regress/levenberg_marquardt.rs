//! Nonlinear least squares. In: residuals r(x), variables with bounds. Out: x that minimises Σ r², its covariance, and
//! the condition number. Levenberg–Marquardt (Marquardt 1963) with the Jacobian J by differences of stated step: (JᵀJ +
//! λ diag JᵀJ) Δ = −Jᵀr, λ falling on success and rising on failure; x is clamped to its bounds after each step.

use crate::learn::regress::linear::least_squares;
use nalgebra::{DMatrix, DVector};

/// A variable of the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variable {
    /// Start value.
    pub start: f64,
    /// Step of the differences.
    pub step: f64,
    /// Least value.
    pub low: f64,
    /// Greatest value.
    pub high: f64,
}

/// The result of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// The variables.
    pub x: Vec<f64>,
    /// Residuals there.
    pub residuals: Vec<f64>,
    /// Covariance of x from the residual variance.
    pub covariance: Vec<Vec<f64>>,
    /// Condition number of the scaled Jacobian.
    pub condition: f64,
}

impl Solution {
    /// Σ r².
    pub fn squares(&self) -> f64 {
        squares(&self.residuals)
    }
    /// Variance of a smooth function of x, by its gradient in differences of `step`.
    pub fn variance_of(&self, step: &[f64], f: impl Fn(&[f64]) -> f64) -> f64 {
        let at = f(&self.x);
        let gradient: Vec<f64> = (0..self.x.len())
            .map(|j| {
                let mut x = self.x.clone();
                x[j] += step[j];
                (f(&x) - at) / step[j]
            })
            .collect();
        let row = |a: usize| (0..gradient.len()).map(|b| self.covariance[a][b] * gradient[b]).sum::<f64>();
        (0..gradient.len()).map(|a| gradient[a] * row(a)).sum::<f64>().max(0.0)
    }
}

/// Searches from the start values, at most `rounds` steps. `None` if a residual is NaN.
pub fn levenberg_marquardt(
    variables: &[Variable],
    rounds: usize,
    residuals: impl Fn(&[f64]) -> Vec<f64>,
) -> Option<Solution> {
    let mut x: Vec<f64> = variables.iter().map(|v| v.start).collect();
    let mut r = residuals(&x);
    let mut damping = 1e-2;
    let mut j = jacobian(variables, &x, &r, &residuals);
    for _ in 0..rounds {
        let before = squares(&r);
        let mut moved = false;
        for _ in 0..8 {
            let Some(trial) = step(variables, &x, &j, &r, damping) else { break };
            let next = residuals(&trial);
            if squares(&next) < before {
                (x, r, moved) = (trial, next, true);
                damping = (damping * 0.2).max(1e-10);
                break;
            }
            damping *= 6.0;
        }
        if !moved {
            break;
        }
        j = jacobian(variables, &x, &r, &residuals);
        if before - squares(&r) < 1e-9 * before {
            break;
        }
    }
    let fit = least_squares(&j, &r, &vec![1.0; r.len()])?;
    Some(Solution { x, residuals: r, covariance: fit.covariance, condition: fit.condition })
}

fn squares(r: &[f64]) -> f64 {
    r.iter().map(|r| r * r).sum()
}

fn jacobian(v: &[Variable], x: &[f64], r: &[f64], residuals: &impl Fn(&[f64]) -> Vec<f64>) -> DMatrix<f64> {
    let mut j = DMatrix::zeros(r.len(), x.len());
    for k in 0..x.len() {
        let step = if x[k] + v[k].step > v[k].high { -v[k].step } else { v[k].step };
        let mut moved = x.to_vec();
        moved[k] += step;
        for (i, (a, b)) in residuals(&moved).iter().zip(r).enumerate() {
            j[(i, k)] = (a - b) / step;
        }
    }
    j
}

fn step(v: &[Variable], x: &[f64], j: &DMatrix<f64>, r: &[f64], damping: f64) -> Option<Vec<f64>> {
    let mut normal = j.transpose() * j;
    let gradient = j.transpose() * DVector::from_column_slice(r);
    let largest = normal.diagonal().max();
    for k in 0..x.len() {
        normal[(k, k)] += damping * normal[(k, k)].max(1e-12 * largest);
    }
    let solved = normal.cholesky()?.solve(&gradient);
    Some((0..x.len()).map(|k| (x[k] - solved[k]).clamp(v[k].low, v[k].high)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_a_decay_and_its_errors() {
        let variable = |start: f64| Variable { start, step: 1e-6, low: 0.0, high: 10.0 };
        let noise = |i: usize| 0.01 * if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        let y = |x: &[f64], t: f64| x[0] * (-x[1] * t).exp();
        let r = |x: &[f64]| -> Vec<f64> {
            (0..50).map(|i| y(x, 0.1 * i as f64) - y(&[2.0, 0.7], 0.1 * i as f64) - noise(i)).collect()
        };
        let s = levenberg_marquardt(&[variable(1.0), variable(0.2)], 50, r).unwrap();
        assert!((s.x[0] - 2.0).abs() < 0.01 && (s.x[1] - 0.7).abs() < 0.01, "{s:?}");
        let error = s.variance_of(&[1e-6; 2], |x| x[0]).sqrt();
        assert!((0.001..0.01).contains(&error) && (error - s.covariance[0][0].sqrt()).abs() < 1e-9, "{error}");
    }
}
