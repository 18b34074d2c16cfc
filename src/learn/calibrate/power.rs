//! Calibration from spindle power: `power` (Xu, Jerard, Fussell, Eq. 3.7), P = tare + (k_tc Q + k_te A)·1e-3 W with
//! removal rate Q, mm³/s, and contact rate A, mm²/s; and `kienzle`, P = tare + k_c11·Q·h^(−m)·1e-3 W with h = Q/A, mm,
//! and m by golden section.

use crate::learn::calibrate::calibration::{CalibrateOptions, Calibration};
use crate::learn::calibrate::regression::{Problem, groups, regression};
use crate::learn::dataset::steady_table::{SteadyRow, measured_quantity, row_rates};
use crate::learn::log::columns::{DataError, Frame};
use crate::learn::log::quantity::Quantity;
use crate::learn::log::quantity::{column_factor, tare_factor};
use crate::learn::report::Estimate;
use crate::numeric::golden_section;
use nalgebra::DMatrix;

/// Relative uncertainty of forces whose radial coefficients follow from Xu's ratios: flat, ball end mills.
pub(in crate::learn) const RATIO_UNCERTAINTY: [f64; 2] = [0.16, 0.30];

pub(in crate::learn) fn power(
    frame: &Frame,
    rows: &[SteadyRow],
    options: CalibrateOptions,
    to_shaft: &impl Fn(f64) -> f64,
    exponent: Option<f64>,
) -> Result<Calibration, DataError> {
    let (name, quantity, unit) = measured_quantity(frame)?;
    let reading = frame.needed(name)?;
    let used: Vec<usize> = (0..rows.len()).filter(|i| reading[*i].is_finite()).collect();
    let tare = options.known_tare_w;
    let rps = |i: usize| rows[i].cut.rps;
    let reference_rps = used.first().map_or(1.0, |i| rps(*i));
    // If a speed is missing, the tare cannot depend on it.
    let spindle = options.spindle.filter(|_| used.iter().all(|i| rps(*i).is_finite()));
    let cut = |i: usize, edge: bool| {
        let r = row_rates(&rows[i], false);
        let h = r.removal_rate_mm3_s / r.contact_rate_mm2_s.max(1e-12);
        let chip = exponent.map_or(1.0, |m| h.max(1e-6).powf(-m));
        column_factor(quantity, rows[i].cut.rps) * if edge { r.contact_rate_mm2_s } else { r.removal_rate_mm3_s * chip }
    };
    let mut names = vec![if exponent.is_some() { ("k_c11", "N/mm²") } else { ("k_tc", "N/mm²") }];
    if exponent.is_none() {
        names.push(("k_te", "N/mm"));
    }
    let edge_columns = names.len();
    if tare.is_none() {
        names.push(("tare", if quantity == Quantity::Torque { "W" } else { unit }));
    }
    let relative = quantity == Quantity::Relative;
    let column = |i: usize, j: usize| {
        if j < edge_columns { cut(i, j == 1) } else { tare_factor(quantity, spindle, rps(i), reference_rps) }
    };
    let problem = Problem {
        names: names
            .iter()
            .map(|(n, u)| {
                (
                    (*n).to_owned(),
                    if relative && *n != "tare" { format!("{unit} per 1000 of the rate") } else { (*u).to_owned() },
                )
            })
            .collect(),
        positive: vec![true; names.len()],
        x: DMatrix::from_fn(used.len(), names.len(), |k, j| column(used[k], j)),
        y: used
            .iter()
            .map(|i| to_shaft(reading[*i]) - tare.map_or(0.0, |w| w * tare_factor(quantity, None, rps(*i), rps(*i))))
            .collect(),
        groups: groups(rows, &used),
    };
    let mut result = regression("power", &problem, options.loss)?;
    let fitted = result.parameters.iter().find(|p| p.name == "tare").map(|p| p.value);
    result.tare = tare.or(fitted);
    result.tare_rps = fitted.map(|_| reference_rps).filter(|rps| rps.is_finite());
    let ball = rows.first().is_some_and(|row| row.cut.shape == crate::machine::Shape::Ball);
    result.force_uncertainty = Some(RATIO_UNCERTAINTY[usize::from(ball)]);
    result.notes.push(
        "normal coefficients by the ratios K_nc/K_tc = 0.395 and K_ne/K_te = 0.566 (Xu and others; 0.7 is \
         conservative) until forces are measured"
            .into(),
    );
    Ok(result)
}

pub(in crate::learn) fn kienzle(
    frame: &Frame,
    rows: &[SteadyRow],
    options: CalibrateOptions,
    to_shaft: &impl Fn(f64) -> f64,
) -> Result<Calibration, DataError> {
    let at = |m: f64| power(frame, rows, options, to_shaft, Some(m));
    let cost = |m: f64| at(m).map_or(f64::INFINITY, |c| c.train.rmse);
    let (m, _) = golden_section(cost, 0.0, 0.9, 1e-9);
    let mut result = at(m)?;
    // Standard error of m from the curvature of the squares along m, the other parameters refitted.
    let (step, squares) = (0.01, |m: f64| cost(m).powi(2) * result.tests as f64);
    let bend = (squares(m + step) - 2.0 * squares(m) + squares(m - step)) / (step * step);
    let freedom = result.tests.saturating_sub(result.parameters.len() + 1).max(1) as f64;
    let std_error = (2.0 * squares(m) / freedom / bend.max(1e-300)).sqrt();
    result.model = "kienzle".into();
    result.parameters.insert(1, Estimate { name: "m_c".into(), value: m, std_error, unit: "-".into() });
    result.covariance.clear();
    Ok(result)
}
