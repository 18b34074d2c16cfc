//! Errors of a model. In: data, residuals. Out: [`Errors`].

use crate::learn::dataset::samples::Data;
use crate::learn::report::Errors;

/// Weighted errors over the samples with weight and a finite residual.
pub fn errors(data: &Data, residual: impl Fn(usize) -> f64) -> Errors {
    let used: Vec<usize> = data.used().filter(|i| residual(*i).is_finite()).collect();
    let sum = |of: &dyn Fn(usize) -> f64| used.iter().map(|&i| data.weight[i] * of(i)).sum::<f64>();
    let whole = sum(&|_| 1.0).max(1e-300);
    let mean = sum(&|i| data.reading[i]) / whole;
    let squares = sum(&|i| residual(i).powi(2));
    let total = sum(&|i| (data.reading[i] - mean).powi(2));
    let top = used.iter().map(|i| data.reading[*i].abs()).fold(0.0, f64::max);
    let large = |i: usize| if data.reading[i].abs() > 0.05 * top { 1.0 } else { 0.0 };
    let relative = sum(&|i| large(i) * (residual(i) / data.reading[i].abs().max(1e-300)).abs());
    Errors {
        rmse: (squares / whole).sqrt(),
        mape: 100.0 * relative / sum(&large).max(1e-300),
        r2: 1.0 - squares / total.max(1e-300),
    }
}
