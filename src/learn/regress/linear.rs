//! Linear least squares. In: a matrix X (rows: measurements, columns: parameters), a vector y and weights w. Out: the
//! coefficients β that minimise Σ wᵢ (yᵢ − xᵢβ)², their covariance, leverage and condition.
//!
//! Columns are scaled to unit length, then X = U S Vᵀ by singular value decomposition. Singular values below 1e-9 of
//! the largest count as zero (minimum-norm solution); parameters with a share in their singular vectors cannot be
//! separated. The leverage hᵢ = Σ u²ᵢ gives leave-one-out residuals rᵢ/(1 − hᵢ) without refitting. Robust fits reweight
//! iteratively (Huber 1.345 σ, Tukey 4.685 σ, 95 % efficiency for normal errors; σ from the median absolute residual).

use crate::learn::regress::statistics::{dot, scale_of};
use nalgebra::{DMatrix, DVector};

/// How outliers are treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Loss {
    /// Plain squares.
    #[default]
    Squares,
    /// Huber: linear beyond 1.345 σ.
    Huber,
    /// Tukey: weight 0 beyond 4.685 σ.
    Tukey,
}

/// Result of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// β.
    pub coefficients: Vec<f64>,
    /// Standard errors of β; infinite for parameters that cannot be separated.
    pub std_errors: Vec<f64>,
    /// Covariance of β, row by row.
    pub covariance: Vec<Vec<f64>>,
    /// yᵢ − xᵢβ.
    pub residuals: Vec<f64>,
    /// hᵢ.
    pub leverage: Vec<f64>,
    /// Final weights, after robust reweighting.
    pub weights: Vec<f64>,
    /// √(Σ w r² / (Σw·(n − p)/n)).
    pub sigma: f64,
    /// Condition number of the scaled matrix.
    pub condition: f64,
    /// Groups of parameters that the data cannot separate.
    pub indistinguishable: Vec<Vec<usize>>,
}

/// Smallest singular value that counts, relative to the largest.
const RANK_TOLERANCE: f64 = 1e-9;

/// Weighted least squares; `None` without rows or columns, or if a value is not finite.
pub fn least_squares(x: &DMatrix<f64>, y: &[f64], weights: &[f64]) -> Option<Fit> {
    let (n, p) = x.shape();
    let finite = x.iter().chain(y).chain(weights).all(|v| v.is_finite());
    if n == 0 || p == 0 || y.len() != n || weights.len() != n || !finite {
        return None;
    }
    let root: Vec<f64> = weights.iter().map(|w| w.max(0.0).sqrt()).collect();
    let mut scaled = DMatrix::from_fn(n, p, |i, j| x[(i, j)] * root[i]);
    let scale: Vec<f64> = (0..p).map(|j| scaled.column(j).norm().max(f64::MIN_POSITIVE)).collect();
    for (mut column, scale) in scaled.column_iter_mut().zip(&scale) {
        column.scale_mut(1.0 / scale);
    }
    let rhs = DVector::from_fn(n, |i, _| y[i] * root[i]);
    let svd = scaled.svd(true, true);
    let (u, v_t) = (svd.u.as_ref()?, svd.v_t.as_ref()?);
    let largest = svd.singular_values.max();
    let kept: Vec<usize> =
        (0..svd.singular_values.len()).filter(|&k| svd.singular_values[k] > RANK_TOLERANCE * largest).collect();
    let mut beta = vec![0.0; p];
    let mut covariance = vec![vec![0.0; p]; p];
    for &k in &kept {
        let s = svd.singular_values[k];
        let along = u.column(k).dot(&rhs) / s;
        for a in 0..p {
            beta[a] += v_t[(k, a)] * along / scale[a];
            for b in 0..p {
                covariance[a][b] += v_t[(k, a)] * v_t[(k, b)] / (s * s * scale[a] * scale[b]);
            }
        }
    }
    let residuals: Vec<f64> = (0..n).map(|i| y[i] - (0..p).map(|j| x[(i, j)] * beta[j]).sum::<f64>()).collect();
    let leverage = (0..n).map(|i| kept.iter().map(|&k| u[(i, k)] * u[(i, k)]).sum()).collect();
    let used = weights.iter().filter(|w| **w > 0.0).count();
    let mean_weight = weights.iter().sum::<f64>() / used.max(1) as f64;
    let squares: f64 = residuals.iter().zip(weights).map(|(r, w)| w * r * r).sum();
    let freedom = used.saturating_sub(kept.len());
    let sigma = if freedom == 0 { 0.0 } else { (squares / mean_weight / freedom as f64).sqrt() };
    for row in &mut covariance {
        for value in row {
            *value *= sigma * sigma * mean_weight;
        }
    }
    let indistinguishable = null_groups(v_t, &svd.singular_values, largest, p);
    let unknown = |j: usize| indistinguishable.iter().any(|group| group.contains(&j));
    let std_errors =
        (0..p).map(|j| if unknown(j) { f64::INFINITY } else { covariance[j][j].max(0.0).sqrt() }).collect();
    let smallest = if n < p { 0.0 } else { svd.singular_values.min() };
    Some(Fit {
        coefficients: beta,
        std_errors,
        covariance,
        residuals,
        leverage,
        weights: weights.to_vec(),
        sigma,
        condition: if smallest > 0.0 { largest / smallest } else { f64::INFINITY },
        indistinguishable,
    })
}

/// Parameters with a share in the singular vectors of singular values that count as zero.
fn null_groups(v_t: &DMatrix<f64>, values: &DVector<f64>, largest: f64, p: usize) -> Vec<Vec<usize>> {
    let weak = |k: usize| values[k] <= RANK_TOLERANCE * largest;
    let mut groups: Vec<Vec<usize>> = (0..values.len())
        .filter(|&k| weak(k))
        .map(|k| (0..p).filter(|&j| v_t[(k, j)].abs() > 0.05).collect())
        .collect();
    if values.len() < p {
        groups.push((0..p).collect());
    }
    groups
}

/// Robust least squares by iterative reweighting.
pub fn robust(x: &DMatrix<f64>, y: &[f64], weights: &[f64], loss: Loss) -> Option<Fit> {
    if loss == Loss::Squares {
        return least_squares(x, y, weights);
    }
    least_squares(x, y, &reweighted(x, y, weights, loss)?.weights)
}

/// Coefficients and residuals of the same, without what else a fit tells: a decomposition takes many times as long.
pub fn robust_coefficients(x: &DMatrix<f64>, y: &[f64], weights: &[f64], loss: Loss) -> Option<(Vec<f64>, Vec<f64>)> {
    reweighted(x, y, weights, loss).map(|found| (found.beta, found.residuals))
}

/// Where the iterations end.
struct Reweighted {
    beta: Vec<f64>,
    residuals: Vec<f64>,
    weights: Vec<f64>,
}

/// The iterations use the normal equations where these are well conditioned.
fn reweighted(x: &DMatrix<f64>, y: &[f64], weights: &[f64], loss: Loss) -> Option<Reweighted> {
    let solve = |weights: &[f64]| {
        by_normal_equations(x, y, weights).or_else(|| Some(least_squares(x, y, weights)?.coefficients))
    };
    if x.is_empty() {
        return None;
    }
    let beta = solve(weights)?;
    let mut at = Reweighted { residuals: residuals_of(x, y, &beta), beta, weights: weights.to_vec() };
    for _ in 0..30 {
        let sigma = scale_of(&at.residuals);
        if sigma <= 0.0 {
            break;
        }
        let next: Vec<f64> = at.residuals.iter().zip(weights).map(|(r, w)| w * influence(r / sigma, loss)).collect();
        let solved = solve(&next)?;
        let moved = solved.iter().zip(&at.beta).any(|(a, b)| (a - b).abs() > 1e-9 * b.abs());
        at = Reweighted { residuals: residuals_of(x, y, &solved), beta: solved, weights: next };
        if !moved {
            break;
        }
    }
    Some(at)
}

fn residuals_of(x: &DMatrix<f64>, y: &[f64], beta: &[f64]) -> Vec<f64> {
    let mut residuals = y.to_vec();
    for (column, beta) in x.column_iter().zip(beta) {
        residuals.iter_mut().zip(column.iter()).for_each(|(r, x)| *r -= x * beta);
    }
    residuals
}

/// Least pivot of the scaled normal equations at which they are used: half the digits of a double are left.
const LEAST_PIVOT: f64 = 1e-8;

/// β from (XᵀWX) β = XᵀWy scaled to a unit diagonal; `None` if the columns are nearly dependent.
fn by_normal_equations(x: &DMatrix<f64>, y: &[f64], weights: &[f64]) -> Option<Vec<f64>> {
    let p = x.ncols();
    let column = |j: usize| &x.as_slice()[j * x.nrows()..(j + 1) * x.nrows()];
    let (mut normal, mut rhs) = (DMatrix::zeros(p, p), DVector::zeros(p));
    for a in 0..p {
        let weighted: Vec<f64> = column(a).iter().zip(weights).map(|(x, w)| w * x).collect();
        rhs[a] = dot(&weighted, y);
        for b in 0..=a {
            normal[(a, b)] = dot(&weighted, column(b));
            normal[(b, a)] = normal[(a, b)];
        }
    }
    let scale: Vec<f64> = (0..p).map(|k| f64::sqrt(normal[(k, k)])).collect();
    if scale.iter().any(|s| s.is_nan() || *s <= 0.0) {
        return None;
    }
    let unit = DMatrix::from_fn(p, p, |a, b| normal[(a, b)] / (scale[a] * scale[b]));
    let solver = unit.cholesky()?;
    let pivots = solver.l_dirty().diagonal();
    if pivots.iter().any(|l| l * l < LEAST_PIVOT) {
        return None;
    }
    let solved = solver.solve(&DVector::from_fn(p, |k, _| rhs[k] / scale[k]));
    Some((0..p).map(|k| solved[k] / scale[k]).collect())
}

fn influence(z: f64, loss: Loss) -> f64 {
    match loss {
        Loss::Squares => 1.0,
        Loss::Huber => (1.345 / z.abs().max(1e-12)).min(1.0),
        Loss::Tukey => (1.0 - (z / 4.685).powi(2)).max(0.0).powi(2),
    }
}

/// Residual of each row by the fit to the other rows.
pub fn leave_one_out(fit: &Fit) -> Vec<f64> {
    fit.residuals.iter().zip(&fit.leverage).map(|(r, h)| if *h < 1.0 - 1e-9 { r / (1.0 - h) } else { *r }).collect()
}

/// Residual of each row by the fit to the other groups; NaN if the others have fewer rows than parameters.
pub fn leave_group_out(x: &DMatrix<f64>, y: &[f64], groups: &[usize], loss: Loss) -> Vec<f64> {
    let mut errors = vec![f64::NAN; y.len()];
    let mut names = groups.to_vec();
    names.sort_unstable();
    names.dedup();
    for name in names {
        let weights: Vec<f64> = groups.iter().map(|g| if *g == name { 0.0 } else { 1.0 }).collect();
        if weights.iter().sum::<f64>() < x.ncols() as f64 {
            continue;
        }
        let Some(fit) = robust(x, y, &weights, loss) else { continue };
        for i in (0..y.len()).filter(|i| groups[*i] == name) {
            errors[i] = fit.residuals[i];
        }
    }
    errors
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(n: usize) -> (DMatrix<f64>, Vec<f64>) {
        let x = DMatrix::from_fn(n, 2, |i, j| if j == 0 { 1.0 } else { i as f64 });
        let y = (0..n).map(|i| 3.0 + 2.0 * i as f64 + if i % 2 == 0 { 0.1 } else { -0.1 }).collect();
        (x, y)
    }

    #[test]
    fn standard_errors_are_those_of_the_normal_equations() {
        let (x, y) = line(10);
        let fit = least_squares(&x, &y, &[1.0; 10]).unwrap();
        let inverse = (x.transpose() * &x).try_inverse().unwrap();
        let sse: f64 = fit.residuals.iter().map(|r| r * r).sum();
        for j in 0..2 {
            assert!((fit.std_errors[j] - (inverse[(j, j)] * sse / 8.0).sqrt()).abs() < 1e-12);
        }
    }

    #[test]
    fn leverage_gives_what_refitting_gives() {
        let (x, y) = line(8);
        let fit = least_squares(&x, &y, &[1.0; 8]).unwrap();
        let groups: Vec<usize> = (0..8).collect();
        let refitted = leave_group_out(&x, &y, &groups, Loss::Squares);
        for (a, b) in leave_one_out(&fit).iter().zip(refitted) {
            assert!((a - b).abs() < 1e-10);
        }
    }

    #[test]
    fn an_outlier_moves_squares_but_not_tukey() {
        let (x, mut y) = line(20);
        y[7] += 50.0;
        let plain = least_squares(&x, &y, &[1.0; 20]).unwrap();
        let tukey = robust(&x, &y, &[1.0; 20], Loss::Tukey).unwrap();
        assert!((plain.coefficients[0] - 3.0).abs() > 1.0);
        assert!((tukey.coefficients[0] - 3.0).abs() < 0.1 && (tukey.coefficients[1] - 2.0).abs() < 0.01);
    }

    #[test]
    fn normal_equations_give_what_the_decomposition_gives_and_know_when_they_do_not() {
        let x = DMatrix::from_fn(50, 3, |i, j| [1.0, (i * 7 % 11) as f64, (i * 5 % 13) as f64][j]);
        let y: Vec<f64> = (0..50).map(|i| 2.0 + (i * 3 % 7) as f64).collect();
        let weights: Vec<f64> = (0..50).map(|i| f64::from(u8::from(i % 9 > 0))).collect();
        let whole = least_squares(&x, &y, &weights).unwrap().coefficients;
        let quick = by_normal_equations(&x, &y, &weights).unwrap();
        assert!(whole.iter().zip(&quick).all(|(a, b)| (a - b).abs() < 1e-9), "{whole:?} {quick:?}");
        let nearly = |apart: f64| DMatrix::from_fn(50, 2, |i, j| 1.0 + i as f64 + apart * j as f64 * (i % 3) as f64);
        assert!(by_normal_equations(&nearly(1e-2), &y, &weights).is_some());
        assert!(by_normal_equations(&nearly(1e-4), &y, &weights).is_none());
    }

    #[test]
    fn names_the_parameters_that_cannot_be_told_apart() {
        let x = DMatrix::from_fn(6, 3, |i, j| [1.0, i as f64, 2.0 * i as f64][j]);
        let y: Vec<f64> = (0..6).map(|i| 1.0 + i as f64).collect();
        let fit = least_squares(&x, &y, &[1.0; 6]).unwrap();
        assert_eq!(fit.indistinguishable, vec![vec![1, 2]]);
        assert!(fit.std_errors[1].is_infinite() && fit.std_errors[0].is_finite());
    }
}
