//! Calibration of `polynomial` (Niu, Wang, Zhao, Huang): K_t and K_r, N/mm², as polynomials in a_p, f_t, a_e (mm) and n
//! (rev/min).
//!
//! (K_t, K_r) of each test follow from its mean forces by a 2 × 2 system; the polynomials are fitted to them. Of the
//! eleven terms a subset is selected forward, one term at a time, by the error on tests left out.

use crate::force::closed::mean_force_factors;
use crate::learn::calibrate::calibration::Calibration;
use crate::learn::dataset::errors::errors;
use crate::learn::dataset::samples::Data;
use crate::learn::dataset::steady_table::SteadyRow;
use crate::learn::log::columns::{DataError, Frame};
use crate::learn::regress::linear::{Fit, least_squares, leave_one_out};
use crate::learn::regress::statistics::rms;
use crate::learn::report::Estimate;
use crate::units::rpm_from_rps;
use nalgebra::{DMatrix, Matrix2, Vector2};

const TERMS: [&str; 11] = ["1", "a_p", "f_t", "a_e", "a_p²", "f_t²", "a_e²", "a_p n", "a_p f_t", "a_p a_e", "f_t a_e"];

/// (K_t, K_r) of one test from its mean forces, without edge forces.
pub fn inverted(row: &SteadyRow, force_x_n: f64, force_y_n: f64) -> Option<[f64; 2]> {
    let (x, y) = (
        mean_force_factors(&row.cut, row.is_conventional(), false),
        mean_force_factors(&row.cut, row.is_conventional(), true),
    );
    let k = Matrix2::new(x[0], x[1], y[0], y[1]).lu().solve(&Vector2::new(force_x_n, force_y_n))?;
    Some([k[0], k[1]])
}

/// Values of the eleven terms for one test.
pub fn terms(row: &SteadyRow) -> [f64; 11] {
    let c = &row.cut;
    let n = rpm_from_rps(c.rps);
    let (ap, ae, ft) = (c.axial_depth_mm, c.radial_depth_mm, c.feed_mm_s / (f64::from(c.flutes) * c.rps));
    [1.0, ap, ft, ae, ap * ap, ft * ft, ae * ae, ap * n, ap * ft, ap * ae, ft * ae]
}

/// Calibration from a table with mean forces F_x and F_y.
pub fn calibrate(frame: &Frame, rows: &[SteadyRow]) -> Result<Calibration, DataError> {
    let (fx, fy) = (frame.needed("force_x_n")?, frame.needed("force_y_n")?);
    let solved: Vec<Option<[f64; 2]>> = (0..rows.len()).map(|i| inverted(&rows[i], fx[i], fy[i])).collect();
    let tests: Vec<usize> = (0..rows.len()).filter(|i| solved[*i].is_some()).collect();
    if tests.len() < 4 {
        return Err(DataError::Unfit(format!("{} tests cannot support a polynomial; 4 are the least", tests.len())));
    }
    let all: Vec<[f64; 11]> = tests.iter().map(|i| terms(&rows[*i])).collect();
    let mut result = Calibration { model: "polynomial".into(), tests: tests.len(), ..Calibration::default() };
    if tests.len() <= TERMS.len() {
        result.notes.push(format!(
            "refused: {} terms cannot be identified from {} tests; the subset that leaving one test out supports is \
             used",
            TERMS.len(),
            tests.len()
        ));
    }
    let mut held_out = Vec::new();
    for (k, letter) in ["a", "b"].iter().enumerate() {
        let y: Vec<f64> = tests.iter().map(|i| solved[*i].map_or(0.0, |s| s[k])).collect();
        let (chosen, fit) =
            subset(&all, &y).ok_or_else(|| DataError::Unfit("the tests have values that are no numbers".into()))?;
        let kept: Vec<&str> = chosen.iter().map(|j| TERMS[*j]).collect();
        result.notes.push(format!(
            "{letter}: {} (left-out rms {:.0} N/mm²)",
            kept.join(", "),
            rms(&leave_one_out(&fit))
        ));
        held_out.extend(leave_one_out(&fit).iter().zip(&y).map(|(r, y)| r / y));
        for (position, j) in chosen.iter().enumerate() {
            result.parameters.push(Estimate {
                name: format!("{letter}{j}"),
                value: fit.coefficients[position],
                std_error: fit.std_errors[position],
                unit: format!("N/mm² per {}", TERMS[*j]),
            });
        }
        result.condition = result.condition.max(fit.condition);
        let data = Data { reading: y.clone(), weight: vec![1.0; y.len()], ..Data::default() };
        result.train = errors(&data, |i| fit.residuals[i]);
    }
    result.leave_one_out_rmse = rms(&held_out);
    result.notes.push("the held-out error is relative to K".into());
    Ok(result)
}

/// Terms added one at a time while the error on tests left out falls by more than 2 %, with the fit.
fn subset(all: &[[f64; 11]], y: &[f64]) -> Option<(Vec<usize>, Fit)> {
    let fit_of = |chosen: &[usize]| {
        let x = DMatrix::from_fn(y.len(), chosen.len(), |i, j| all[i][chosen[j]]);
        least_squares(&x, y, &vec![1.0; y.len()])
    };
    let mut chosen = vec![0];
    let mut best = fit_of(&chosen)?;
    // Leaving one test out needs more tests than terms.
    while chosen.len() + 2 < y.len() {
        let trials = (1..TERMS.len()).filter(|j| !chosen.contains(j)).filter_map(|j| {
            let grown: Vec<usize> = chosen.iter().copied().chain([j]).collect();
            let fit = fit_of(&grown)?;
            fit.indistinguishable.is_empty().then(|| (rms(&leave_one_out(&fit)), grown, fit))
        });
        let Some((error, grown, fit)) = trials.min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        if error > 0.98 * rms(&leave_one_out(&best)) {
            break;
        }
        (chosen, best) = (grown, fit);
    }
    Some((chosen, best))
}
