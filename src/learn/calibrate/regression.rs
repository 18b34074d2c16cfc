//! A calibration as a linear regression. In: columns from the mechanics of cutting, readings, set-ups. Out:
//! [`Calibration`] with errors on the tests fitted and with tests or set-ups left out. Cutting and edge coefficients
//! are not negative: if the unconstrained solution has a negative one, the problem is solved again with bounds.

use crate::learn::calibrate::calibration::Calibration;
use crate::learn::dataset::errors::errors;
use crate::learn::dataset::samples::Data;
use crate::learn::dataset::steady_table::{SteadyRow, numbered};
use crate::learn::log::columns::DataError;
use crate::learn::regress::linear::{Fit, Loss, leave_group_out, leave_one_out, robust};
use crate::learn::regress::statistics::rms;
use crate::learn::report::Estimate;
use crate::schedule::cone::bounded_least_squares;
use nalgebra::{DMatrix, DVector};

/// A linear regression.
pub(in crate::learn) struct Problem {
    /// Names and units of the parameters.
    pub(in crate::learn) names: Vec<(String, String)>,
    /// Parameters that must not be negative.
    pub(in crate::learn) positive: Vec<bool>,
    /// Columns.
    pub(in crate::learn) x: DMatrix<f64>,
    /// Readings.
    pub(in crate::learn) y: Vec<f64>,
    /// Set-up of each reading.
    pub(in crate::learn) groups: Vec<usize>,
}

pub(in crate::learn) fn groups(rows: &[SteadyRow], used: &[usize]) -> Vec<usize> {
    numbered(used.iter().map(|i| rows[*i].group.as_str())).0
}

pub(in crate::learn) fn regression(model: &str, problem: &Problem, loss: Loss) -> Result<Calibration, DataError> {
    let n = problem.y.len();
    let p = problem.names.len();
    if n < p {
        return Err(DataError::Unfit(format!("{n} measurements cannot give {p} parameters of the model {model}")));
    }
    let fit = robust(&problem.x, &problem.y, &vec![1.0; n], loss)
        .ok_or_else(|| DataError::Unfit("the table has values that are no numbers".into()))?;
    let (values, mut notes) = within_bounds(problem, &fit)?;
    let residuals: Vec<f64> =
        (0..n).map(|i| problem.y[i] - (0..p).map(|j| problem.x[(i, j)] * values[j]).sum::<f64>()).collect();
    let dropped = fit.weights.iter().filter(|w| **w < 0.1).count();
    if dropped > 0 {
        notes.push(format!("{dropped} outliers have next to no weight"));
    }
    let name = |j: &usize| problem.names[*j].0.clone();
    let mut distinct = problem.groups.clone();
    distinct.sort_unstable();
    distinct.dedup();
    let judged = Data { reading: problem.y.clone(), weight: vec![1.0; n], ..Data::default() };
    let by_group = leave_group_out(&problem.x, &problem.y, &problem.groups, loss);
    let single = distinct.len() == n;
    Ok(Calibration {
        model: model.to_owned(),
        tests: n,
        parameters: (0..p)
            .map(|j| Estimate {
                name: problem.names[j].0.clone(),
                value: values[j],
                std_error: fit.std_errors[j],
                unit: problem.names[j].1.clone(),
            })
            .collect(),
        covariance: fit.covariance.clone(),
        condition: fit.condition,
        indistinguishable: fit.indistinguishable.iter().map(|g| g.iter().map(name).collect()).collect(),
        train: errors(&judged, |i| residuals[i]),
        leave_one_out_rmse: rms(&leave_one_out(&fit)),
        leave_set_up_out_rmse: (distinct.len() > 1 && !single && by_group.iter().all(|r| r.is_finite()))
            .then(|| rms(&by_group)),
        notes,
        ..Calibration::default()
    })
}

/// The unconstrained solution, or the one with bounds if that has a negative coefficient that must not be; with a note.
fn within_bounds(problem: &Problem, fit: &Fit) -> Result<(Vec<f64>, Vec<String>), DataError> {
    let negative: Vec<usize> =
        (0..problem.names.len()).filter(|j| problem.positive[*j] && fit.coefficients[*j] < 0.0).collect();
    if negative.is_empty() {
        return Ok((fit.coefficients.clone(), Vec::new()));
    }
    let low: Vec<f64> = problem.positive.iter().map(|p| if *p { 0.0 } else { f64::NEG_INFINITY }).collect();
    let high = vec![f64::INFINITY; low.len()];
    let root: Vec<f64> = fit.weights.iter().map(|w| w.sqrt()).collect();
    let a = DMatrix::from_fn(problem.x.nrows(), problem.x.ncols(), |i, j| problem.x[(i, j)] * root[i]);
    let b = DVector::from_fn(problem.y.len(), |i, _| problem.y[i] * root[i]);
    let values = bounded_least_squares(&a, &b, &low, &high)
        .ok_or_else(|| DataError::Unfit("the bounded fit has no answer".into()))?;
    let names: Vec<&str> = negative.iter().map(|j| problem.names[*j].0.as_str()).collect();
    Ok((values, vec![format!("{} would be negative and was kept at its bound", names.join(", "))]))
}
