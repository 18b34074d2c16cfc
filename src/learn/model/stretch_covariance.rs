//! Covariance of the parameters of a model with correlated errors (cluster-robust or "sandwich" estimate). In: data, a
//! fitted model. Out: the covariance of (β, θ).
//!
//! Errors of a model are common to stretches ([`Data::block`]), so neighbouring readings are not independent. With the
//! Jacobian J of the predictions, N = JᵀWJ + prior terms, R Rᵀ = N⁻¹, and the scores g_s = Σ_{i in s} wᵢ rᵢ Jᵢ of S
//! stretches, the covariance is (Liang and Zeger, Biometrika 73, 1986)
//!
//! S/(S − 1) N⁻¹ Σ_s g_s g_sᵀ N⁻¹ = R M Rᵀ, M = S/(S − 1) Σ_s (Rᵀg_s)(Rᵀg_s)ᵀ.
//!
//! With independent readings each eigenvalue of M would be σ²; smaller ones, by chance in few stretches, are raised to
//! that.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::learn::dataset::samples::Data;
use crate::learn::model::fit::{Fitted, jacobian};

/// Least eigenvalue of the scaled normal matrix, over the largest, that counts as determined.
const LEAST_EIGENVALUE: f64 = 1e-12;

/// Covariance of (β, θ); see the head of the file.
pub fn covariance_of_stretches(data: &Data, fitted: &Fitted) -> DMatrix<f64> {
    let (columns, residual) = (jacobian(data, fitted), fitted.residuals(data));
    let p = columns.len();
    let row = |i: usize| DVector::from_fn(p, |k, _| columns[k][i]);
    let mut normal = DMatrix::zeros(p, p);
    let mut scores: BTreeMap<usize, DVector<f64>> = BTreeMap::new();
    for i in data.used() {
        let (own, weight) = (row(i), data.weight[i]);
        normal.syger(weight, &own, &own, 1.0);
        *scores.entry(data.block[i]).or_insert_with(|| DVector::zeros(p)) += weight * residual[i] * own;
    }
    normal.fill_upper_triangle_with_lower_triangle();
    for (k, base) in data.base.iter().enumerate() {
        normal[(k, k)] += base.prior.map_or(0.0, |(_, deviation)| deviation.powi(-2));
    }
    let seen = (0..p).filter(|&k| normal[(k, k)] > 0.0).count();
    let independent = fitted.squares / data.used().count().saturating_sub(seen).max(1) as f64;
    let root = inverse_root(&normal);
    let stretches = scores.len() as f64;
    let mut between = DMatrix::zeros(p, p);
    for score in scores.values() {
        let of_unit = root.tr_mul(score);
        between += &of_unit * of_unit.transpose() * (stretches / (stretches - 1.0).max(1.0));
    }
    let eigen = SymmetricEigen::new(between);
    let at_least = DMatrix::from_diagonal(&eigen.eigenvalues.map(|value| value.max(independent)));
    &root * &eigen.eigenvectors * at_least * eigen.eigenvectors.transpose() * root.transpose()
}

/// R with R Rᵀ = N⁻¹; 0 in directions that are not determined.
fn inverse_root(normal: &DMatrix<f64>) -> DMatrix<f64> {
    let p = normal.nrows();
    // Scaled to a unit diagonal.
    let unit = |k: usize| if normal[(k, k)] > 0.0 { normal[(k, k)].sqrt().recip() } else { 0.0 };
    let eigen = SymmetricEigen::new(DMatrix::from_fn(p, p, |i, j| unit(i) * normal[(i, j)] * unit(j)));
    let least = LEAST_EIGENVALUE * eigen.eigenvalues.max();
    let roots = eigen.eigenvalues.map(|value| if value > least { value.sqrt().recip() } else { 0.0 });
    DMatrix::from_fn(p, p, |i, j| unit(i) * eigen.eigenvectors[(i, j)] * roots[j])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::learn::dataset::samples::{Base, Class, UNBOUNDED};
    use crate::learn::model::fit::fit;
    use crate::learn::regress::random::Chance;

    /// y = 2 + 3x in 40 stretches of 25 readings; x differs from stretch to stretch. Errors are independent for each
    /// reading, or common to a stretch (`together`).
    fn line(together: bool, seed: u64) -> Data {
        let mut chance = Chance::new(seed);
        let n = 1000;
        let stretches: Vec<[f64; 2]> = (0..40).map(|_| [chance.unit(), chance.unit() - 0.5]).collect();
        let off: Vec<f64> = (0..n).map(|i| if together { stretches[i / 25][1] } else { chance.unit() - 0.5 }).collect();
        let x = |i: usize| stretches[i / 25][0];
        let base =
            |name: &str, class| Base { name: name.into(), unit: "W".into(), class, prior: None, bounds: UNBOUNDED };
        Data {
            base: vec![base("level", Class::Tare), base("slope", Class::Cutting)],
            columns: vec![vec![1.0; n], (0..n).map(x).collect()],
            reading: (0..n).map(|i| 2.0 + 3.0 * x(i) + off[i]).collect(),
            weight: vec![1.0; n],
            state: vec![State::default(); n],
            run: vec![0; n],
            channel: vec![0; n],
            block: (0..n).map(|i| i / 25).collect(),
            ..Data::default()
        }
    }

    /// Mean standard error of the slope over many draws, and its standard deviation.
    fn told_and_true(together: bool) -> [f64; 2] {
        let found: Vec<[f64; 2]> = (0..200)
            .map(|seed| {
                let data = line(together, 11 + seed);
                let fitted = fit(&data, &[], 8).unwrap();
                [covariance_of_stretches(&data, &fitted)[(1, 1)].sqrt(), fitted.model.base[1] - 3.0]
            })
            .collect();
        let n = found.len() as f64;
        [found.iter().map(|f| f[0]).sum::<f64>() / n, (found.iter().map(|f| f[1].powi(2)).sum::<f64>() / n).sqrt()]
    }

    #[test]
    fn what_is_off_together_over_a_stretch_counts_once() {
        for together in [true, false] {
            let [told, truth] = told_and_true(together);
            assert!((0.9..1.35).contains(&(told / truth)), "{together}: told {told}, true {truth}");
        }
    }

    #[test]
    fn what_the_data_do_not_tell_has_no_covariance() {
        let mut data = line(false, 3);
        data.columns[1].fill(0.0);
        let fitted = fit(&data, &[], 8).unwrap();
        let covariance = covariance_of_stretches(&data, &fitted);
        assert!(covariance[(1, 1)] == 0.0 && covariance[(0, 0)] > 0.0, "{covariance}");
    }
}
