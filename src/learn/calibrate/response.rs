//! Calibration of `response` (response surface; Kakino, Ibaraki): F = β₀ + β₁X₁ + β₂X₂ + β₁₁X₁² + β₂₂X₂² + β₁₂X₁X₂ for
//! the whole depth, where X₁ is the length of contact L and X₂ the largest chip t_m, both scaled to −1 … 1 over the
//! table: X = (x − middle) / half range. The model file has the same polynomial in mm: F = b₀ + b_l L + b_t t_m + b_ll
//! L² + b_tt t_m² + b_lt L t_m.
//!
//! A square needs three levels of its variable, the product needs cuts that are not all on a line. Terms that the table
//! does not determine are left out with a note. The plane alone is used if the other terms do not lower the error on
//! tests left out. Levels of a variable that differ by less than [`APART`] of its largest value count as one.

use crate::force::closed::immersion_rad;
use crate::learn::calibrate::calibration::{CalibrateOptions, Calibration};
use crate::learn::calibrate::regression::{Problem, groups, regression};
use crate::learn::dataset::steady_table::SteadyRow;
use crate::learn::log::columns::{DataError, Frame};
use crate::learn::report::Estimate;
use nalgebra::DMatrix;

/// Least difference of two levels, as a share of the largest value: tables are rounded to about 1 %.
const APART: f64 = 0.01;
/// Terms: name and unit in mm, powers of X₁ and X₂.
const TERMS: [(&str, &str, [i32; 2]); 6] = [
    ("b0", "N", [0, 0]),
    ("b_l", "N/mm", [1, 0]),
    ("b_t", "N/mm", [0, 1]),
    ("b_ll", "N/mm²", [2, 0]),
    ("b_tt", "N/mm²", [0, 2]),
    ("b_lt", "N/mm²", [1, 1]),
];
const NORMALISED: [&str; 6] = ["beta_0", "beta_1", "beta_2", "beta_11", "beta_22", "beta_12"];

pub(in crate::learn) fn response(
    frame: &Frame,
    rows: &[SteadyRow],
    options: CalibrateOptions,
) -> Result<Calibration, DataError> {
    let force = frame.needed("force_xy_n")?;
    let used: Vec<usize> = (0..rows.len()).filter(|i| force[*i].is_finite()).collect();
    let met: Vec<[f64; 2]> = used.iter().map(|i| contact_and_chip(&rows[*i])).collect();
    let scales = [0, 1].map(|axis| Scale::of(met.iter().map(|x| x[axis])));
    let x: Vec<[f64; 2]> = met.iter().map(|m| [scales[0].of_value(m[0]), scales[1].of_value(m[1])]).collect();
    let fit = |terms: &[usize]| {
        let problem = Problem {
            names: terms.iter().map(|t| (NORMALISED[*t].to_owned(), "N".to_owned())).collect(),
            positive: vec![false; terms.len()],
            x: DMatrix::from_fn(used.len(), terms.len(), |k, j| power(x[k], TERMS[terms[j]].2)),
            y: used.iter().map(|i| force[*i]).collect(),
            groups: groups(rows, &used),
        };
        regression("response", &problem, options.loss).map(|found| in_mm(found, terms, &scales))
    };
    let (terms, plane) = (determined_terms(&met, &x), fit(&[0, 1, 2])?);
    let mut found = if terms.len() > 3 { fit(&terms)? } else { plane.clone() };
    let left: Vec<&str> = (0..TERMS.len()).filter(|t| !terms.contains(t)).map(|t| TERMS[t].0).collect();
    if !left.is_empty() {
        let needed = "that needs cuts at three lengths of contact, each with three chips";
        found.notes.push(format!("the table does not determine {}: {needed}", left.join(", ")));
    }
    // Squares and product that do not lower the error on tests left out fit only noise.
    let held_out = [&plane, &found].map(|fit| fit.leave_one_out_rmse);
    if terms.len() > 3 && held_out[1] >= held_out[0] {
        let [plane_n, all_n] = held_out;
        let why = format!("off by {all_n:.2} N on tests left out, the plane alone by {plane_n:.2} N");
        return Ok(Calibration {
            notes: [plane.notes, vec![format!("no squares and no product: {why}")]].concat(),
            ..plane
        });
    }
    Ok(found)
}

/// Length of contact and largest chip, mm.
fn contact_and_chip(row: &SteadyRow) -> [f64; 2] {
    let c = &row.cut;
    let r = 0.5 * c.diameter_mm;
    let theta = immersion_rad(r, c.radial_depth_mm, c.path_radius_mm);
    let fz = c.feed_mm_s / (f64::from(c.flutes) * c.rps);
    [r * theta, fz * if theta > 0.5 * std::f64::consts::PI { 1.0 } else { theta.sin() }]
}

/// Middle and half range of a variable.
#[derive(Clone, Copy)]
struct Scale {
    middle: f64,
    half: f64,
}

impl Scale {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let half = 0.5 * (high - low);
        // A constant variable is not scaled.
        if half > 0.0 { Self { middle: 0.5 * (low + high), half } } else { Self { middle: 0.0, half: 1.0 } }
    }
    fn of_value(self, value: f64) -> f64 {
        (value - self.middle) / self.half
    }
}

fn power(x: [f64; 2], [a, b]: [i32; 2]) -> f64 {
    x[0].powi(a) * x[1].powi(b)
}

/// Terms that the table determines; those of the plane are always included.
fn determined_terms(met: &[[f64; 2]], x: &[[f64; 2]]) -> Vec<usize> {
    let levels = |axis: usize| {
        let mut values: Vec<f64> = met.iter().map(|m| m[axis]).collect();
        values.sort_by(f64::total_cmp);
        let apart = APART * values.last().copied().unwrap_or(0.0);
        values.dedup_by(|b, a| *b - *a <= apart);
        values.len()
    };
    let squares = [levels(0) >= 3, levels(1) >= 3];
    // The product needs X₁ and X₂ that are not linearly dependent, beyond rounding.
    let n = x.len() as f64;
    let mean = |of: &dyn Fn(&[f64; 2]) -> f64| x.iter().map(of).sum::<f64>() / n;
    let m = [mean(&|x| x[0]), mean(&|x| x[1])];
    let [xx, yy, xy] = [[0, 0], [1, 1], [0, 1]].map(|[a, b]| mean(&|x| (x[a] - m[a]) * (x[b] - m[b])));
    let crossed = xx * yy - xy * xy > APART * xx * yy && levels(0) >= 2 && levels(1) >= 2;
    let wanted = [true, true, true, squares[0], squares[1], crossed];
    let mut terms: Vec<usize> = (0..TERMS.len()).filter(|t| wanted[*t]).collect();
    // At least one measurement more than terms, so that there is a residual.
    while terms.len() > 3 && terms.len() >= x.len() {
        terms.pop();
    }
    terms
}

/// The polynomial in X₁ and X₂ converted to L and t_m, with its covariance.
fn in_mm(found: Calibration, terms: &[usize], scales: &[Scale; 2]) -> Calibration {
    let of = |name: &str| found.parameters.iter().position(|parameter| parameter.name == name);
    let columns: Vec<(usize, usize)> =
        terms.iter().filter_map(|t| of(NORMALISED[*t]).map(|column| (*t, column))).collect();
    // X^a = Σ C(a, i) x^i (−middle)^(a−i) / half^a.
    let choose = |a: i32, i: i32| if i == 1 && a == 2 { 2.0 } else { 1.0 };
    let part = |scale: &Scale, a: i32, i: i32| {
        if i > a { 0.0 } else { choose(a, i) * (-scale.middle).powi(a - i) / scale.half.powi(a) }
    };
    let to_mm = DMatrix::from_fn(terms.len(), found.parameters.len(), |row, column| {
        let Some((t, _)) = columns.iter().find(|(_, known)| *known == column) else { return 0.0 };
        let ([i, j], [a, b]) = (TERMS[terms[row]].2, TERMS[*t].2);
        part(&scales[0], a, i) * part(&scales[1], b, j)
    });
    let n = found.parameters.len();
    let covariance =
        DMatrix::from_fn(n, n, |a, b| found.covariance.get(a).and_then(|row| row.get(b)).copied().unwrap_or(f64::NAN));
    let covariance = &to_mm * covariance * to_mm.transpose();
    let values = &to_mm * nalgebra::DVector::from_iterator(n, found.parameters.iter().map(|p| p.value));
    let parameters = terms.iter().enumerate().map(|(k, t)| Estimate {
        name: TERMS[*t].0.to_owned(),
        value: values[k],
        std_error: covariance[(k, k)].max(0.0).sqrt(),
        unit: TERMS[*t].1.to_owned(),
    });
    let middles = [("x1", &scales[0]), ("x2", &scales[1])].into_iter().flat_map(|(name, scale)| {
        [("middle", scale.middle), ("half_range", scale.half)].map(|(what, value)| Estimate {
            name: format!("{name}_{what}"),
            value,
            std_error: 0.0,
            unit: "mm".to_owned(),
        })
    });
    let parameters: Vec<Estimate> = parameters.collect();
    let derived = found.parameters.iter().cloned().chain(middles).collect();
    let covariance = covariance.row_iter().map(|row| row.iter().copied().collect()).collect();
    Calibration { parameters, derived, covariance, ..found }
}
