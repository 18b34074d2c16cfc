//! Coefficients from steady cuts: each model is a linear regression on columns that its mechanics give.
//!
//! * `power` (Xu, Eq. 3.7): P = tare + (k_tc Q + k_te A)·1e-3 W.
//! * `linear-edge` from mean forces (Niu, Eqs 2–3; force on the workpiece, x along the feed, y into the wall, climb):
//!   with k = N a_p/2π and ψ = acos(1 − a_e/R), F_x = k[f(−K_t sin²ψ/2 + K_r(ψ − sin ψ cos ψ)/2) − K_te sin ψ +
//!   K_re(1 − cos ψ)], F_y = k[f(K_t(ψ − sin ψ cos ψ)/2 + K_r sin²ψ/2) + K_te(1 − cos ψ) + K_re sin ψ].
//! * `kienzle`: P = tare + k_c11·Q·h^(−m)·1e-3, h = Q/A; m by golden section.
//! * `layer` (Nishida, Eq. 1): F/Δz = C₀ + C₁L + C₂t_m + C₃L t_m, L in mm, t_m in µm, on the layer at height t_z.
//! * `response` (Kakino, Ibaraki): F = b₀ + b_l L + b_t t_m on the whole depth.
//! * `polynomial` (Niu, Eq. 4): each test is inverted to (K_t, K_r) first; their polynomials are then regressed on the
//!   subset of the eleven terms that leaving one test out supports.
//!
//! Bounds: cutting and edge coefficients are not negative; where the free answer is, it is solved again within them.

pub mod experiment;
pub mod load_meter;
pub mod plan;
pub mod polynomial;
pub mod sigmoid;
pub mod test_program;

use crate::force::closed::{SteadyCut, immersion_rad};
use crate::learn::dataset::samples::Data;
use crate::learn::dataset::steady_table::{Quantity, Side, SteadyRow, column_factor, measured_quantity, row_rates};
use crate::learn::diagnose::answer::errors;
use crate::learn::log::columns::{DataError, Frame};
use crate::learn::log::plausible::{doubts, readable};
use crate::learn::regress::linear::{Fit, Loss, leave_group_out, leave_one_out, robust};
use crate::learn::report::{Errors, Value};
use crate::schedule::cone::bounded_least_squares;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// What a calibration answers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Calibration {
    /// Model.
    pub model: String,
    /// Tests used.
    pub tests: usize,
    /// Parameters with standard errors.
    pub parameters: Vec<Value>,
    /// What follows from them, or was found beside them, and is no parameter of the force model.
    pub derived: Vec<Value>,
    /// Tare, W, where the model has one.
    pub tare: Option<f64>,
    /// Covariance of the parameters.
    pub covariance: Vec<Vec<f64>>,
    /// Condition number of the scaled columns.
    pub condition: f64,
    /// Groups of parameters the tests cannot tell apart.
    pub indistinguishable: Vec<Vec<String>>,
    /// Errors in sample.
    pub train: Errors,
    /// Root mean square error of tests that the fit has not seen.
    pub leave_one_out_rmse: f64,
    /// The same leaving whole set-ups out; `None` with a single one.
    pub leave_set_up_out_rmse: Option<f64>,
    /// Relative standard uncertainty of forces that follow from it.
    pub force_uncertainty: Option<f64>,
    /// What was noticed.
    pub notes: Vec<String>,
    /// Why no model file should rest on it; empty: nothing speaks against one.
    pub doubts: Vec<String>,
}

/// How a calibration is run.
#[derive(Debug, Clone, Copy, Default)]
pub struct CalibrateOptions {
    /// Tare, W, when it is known.
    pub known_tare_w: Option<f64>,
    /// Treatment of outliers.
    pub loss: Loss,
    /// k_tc that the setup declares, where it has one, N/mm².
    pub declared_k_tc: Option<f64>,
}

/// Quantities that must change from cut to cut.
const MEASURED: [&str; 5] =
    ["spindle_power_w", "spindle_torque_nm", "spindle_load_percent", "spindle_current_a", "force_xy_n"];
/// Share of the variance that a calibration must explain to be worth a model file.
const LEAST_R2: f64 = 0.3;
/// Share of a regression's variance: normal coefficients from Xu's ratios are uncertain by this much (flat, ball).
pub(in crate::learn) const RATIO_UNCERTAINTY: [f64; 2] = [0.16, 0.30];

/// A regression: names, units, columns, target, groups.
struct Problem {
    names: Vec<(String, String)>,
    /// True for parameters that physics keeps from being negative.
    positive: Vec<bool>,
    x: DMatrix<f64>,
    y: Vec<f64>,
    groups: Vec<usize>,
}

/// Fits `model` to a table. `to_shaft` turns a meter reading into power at the motor shaft.
pub fn calibrate(
    frame: &Frame,
    rows: &[SteadyRow],
    model: &str,
    options: CalibrateOptions,
    to_shaft: impl Fn(f64) -> f64,
) -> Result<Calibration, DataError> {
    for name in MEASURED {
        frame.numbers(name).map_or(Ok(()), |values| readable(name, &values))?;
    }
    let mut result = fitted(frame, rows, model, options, to_shaft)?;
    result.doubts = doubts(&result.parameters, options.declared_k_tc);
    let judged = matches!(model, "power" | "kienzle" | "layer" | "response") && frame.numbers("force_x_n").is_none();
    if judged && (result.train.r2.is_nan() || result.train.r2 < LEAST_R2) {
        result.doubts.push("the cuts explain next to nothing of what was measured: are columns swapped?".into());
    }
    if result.tests <= result.parameters.len() && model != "polynomial" && frame.numbers("force_x_n").is_none() {
        result.doubts.push(format!(
            "{} measurements for {} coefficients leave nothing to judge them by",
            result.tests,
            result.parameters.len()
        ));
    }
    Ok(result)
}

fn fitted(
    frame: &Frame,
    rows: &[SteadyRow],
    model: &str,
    options: CalibrateOptions,
    to_shaft: impl Fn(f64) -> f64,
) -> Result<Calibration, DataError> {
    match model {
        "linear-edge" if frame.numbers("force_x_n").is_some() => mean_force(frame, rows, options),
        "power" | "linear-edge" => power(frame, rows, options, &to_shaft, None),
        "kienzle" => kienzle(frame, rows, options, &to_shaft),
        "layer" => layer(frame, rows, options),
        "response" => response(frame, rows, options),
        "polynomial" => polynomial::calibrate(frame, rows),
        other => Err(DataError::Unfit(format!(
            "the model {other} cannot be calibrated from a table; those that can: power, linear-edge, kienzle, layer, \
             response, polynomial"
        ))),
    }
}

fn power(
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
        names.push(("tare", unit));
    }
    let relative = quantity == Quantity::Relative;
    let column = |i: usize, j: usize| if j < edge_columns { cut(i, j == 1) } else { 1.0 };
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
        y: used.iter().map(|i| to_shaft(reading[*i]) - tare.unwrap_or(0.0)).collect(),
        groups: groups(rows, &used),
    };
    let mut result = solved("power", &problem, options.loss)?;
    result.tare = tare.or_else(|| result.parameters.iter().find(|p| p.name == "tare").map(|p| p.value));
    let ball = rows.first().is_some_and(|row| row.cut.shape == crate::machine::Shape::Ball);
    result.force_uncertainty = Some(RATIO_UNCERTAINTY[usize::from(ball)]);
    result.notes.push(
        "normal coefficients by the ratios K_nc/K_tc = 0.395 and K_ne/K_te = 0.566 (Xu and others; 0.7 is conservative) until forces are measured"
            .into(),
    );
    Ok(result)
}

fn kienzle(
    frame: &Frame,
    rows: &[SteadyRow],
    options: CalibrateOptions,
    to_shaft: &impl Fn(f64) -> f64,
) -> Result<Calibration, DataError> {
    let at = |m: f64| power(frame, rows, options, to_shaft, Some(m));
    let cost = |m: f64| at(m).map_or(f64::INFINITY, |c| c.train.rmse);
    let (mut lo, mut hi) = (0.0, 0.9);
    for _ in 0..60 {
        let (a, b) = (hi - 0.618_034 * (hi - lo), lo + 0.618_034 * (hi - lo));
        if cost(a) < cost(b) { hi = b } else { lo = a }
    }
    let m = 0.5 * (lo + hi);
    let mut result = at(m)?;
    // Curvature of the squares along m, the other parameters refitted.
    let (step, squares) = (0.01, |m: f64| cost(m).powi(2) * result.tests as f64);
    let bend = (squares(m + step) - 2.0 * squares(m) + squares(m - step)) / (step * step);
    let freedom = result.tests.saturating_sub(result.parameters.len() + 1).max(1) as f64;
    let std_error = (2.0 * squares(m) / freedom / bend.max(1e-300)).sqrt();
    result.model = "kienzle".into();
    result.parameters.insert(1, Value { name: "m_c".into(), value: m, std_error, unit: "-".into() });
    result.covariance.clear();
    Ok(result)
}

fn mean_force(frame: &Frame, rows: &[SteadyRow], options: CalibrateOptions) -> Result<Calibration, DataError> {
    let (fx, fy) = (frame.needed("force_x_n")?, frame.needed("force_y_n")?);
    let used: Vec<usize> = (0..rows.len()).filter(|i| fx[*i].is_finite() && fy[*i].is_finite()).collect();
    // Relative least squares: every component is divided by its measured magnitude, or a tenth of the resultant where it
    // passes through zero.
    let line = |k: usize| {
        let (i, y) = (used[k / 2], k % 2 == 1);
        let measured = if y { fy[i] } else { fx[i] };
        (mean_force_columns(&rows[i], y), measured)
    };
    let scale = |k: usize| 1.0 / relative_to(line(k).1, [fx[used[k / 2]], fy[used[k / 2]]]);
    let problem = Problem {
        names: [("k_tc", "N/mm²"), ("k_rc", "N/mm²"), ("k_te", "N/mm"), ("k_re", "N/mm")]
            .map(|(n, u)| (n.to_owned(), u.to_owned()))
            .to_vec(),
        positive: vec![true; 4],
        x: DMatrix::from_fn(2 * used.len(), 4, |k, j| line(k).0[j] * scale(k)),
        y: (0..2 * used.len()).map(|k| line(k).1 * scale(k)).collect(),
        groups: (0..2 * used.len()).map(|k| k / 2).collect(),
    };
    let mut result = solved("linear-edge", &problem, options.loss)?;
    result.tests = used.len();
    result.notes.push("errors are relative to each measured force; the held-out error leaves whole tests out".into());
    Ok(result)
}

/// What an error of a force component is measured by: its magnitude, and not less than a tenth of the resultant.
pub fn relative_to(component_n: f64, forces_n: [f64; 2]) -> f64 {
    component_n.abs().max(0.1 * forces_n[0].hypot(forces_n[1])).max(1e-6)
}

/// Columns of F_x or F_y for K_t, K_r, K_te, K_re. In conventional milling the teeth run the other way along the same wall:
/// the tangential columns change their sign.
pub fn mean_force_columns(row: &SteadyRow, y: bool) -> [f64; 4] {
    let columns = climb_columns(row, y);
    let turn = if row.side == Side::Up { -1.0 } else { 1.0 };
    [turn * columns[0], columns[1], turn * columns[2], columns[3]]
}

fn climb_columns(row: &SteadyRow, y: bool) -> [f64; 4] {
    let c = &row.cut;
    let psi = immersion_rad(0.5 * c.diameter_mm, c.radial_depth_mm, None);
    let k = f64::from(c.flutes) * c.axial_depth_mm / TAU;
    let f = c.feed_mm_s / (f64::from(c.flutes) * c.rps);
    let (s, co) = psi.sin_cos();
    let (half, turn) = (0.5 * s * s, 0.5 * (psi - s * co));
    if y {
        [k * f * turn, k * f * half, k * (1.0 - co), k * s]
    } else {
        [-k * f * half, k * f * turn, -k * s, k * (1.0 - co)]
    }
}

/// Length of contact (mm) and largest chip thickness (mm) in a plane at `height_mm` above the tip of a ball.
pub fn ball_layer(ball_mm: f64, height_mm: f64, radial_mm: f64, feed_per_tooth_mm: f64) -> (f64, f64) {
    let below = (ball_mm - height_mm).max(0.0);
    let r = (ball_mm * ball_mm - below * below).max(0.0).sqrt();
    let alpha = immersion_rad(r, radial_mm, None);
    let fz = feed_per_tooth_mm;
    (r * alpha, r - (r * r + fz * fz - 2.0 * r * fz * alpha.sin()).max(0.0).sqrt())
}

fn layer(frame: &Frame, rows: &[SteadyRow], options: CalibrateOptions) -> Result<Calibration, DataError> {
    let force = frame.needed("force_xy_n")?;
    let layers = if rows.iter().any(|row| row.layer_height_mm.is_some()) {
        given_layers(rows, &force)
    } else {
        layers_by_difference(rows, &force)
    };
    let geometry = |layer: &Layer| {
        let c = &layer.row.cut;
        let fz = c.feed_mm_s / (f64::from(c.flutes) * c.rps);
        let (length, chip) = ball_layer(0.5 * c.diameter_mm, layer.middle_mm, c.radial_depth_mm, fz);
        (length, chip * 1e3)
    };
    let known: Vec<(f64, f64)> = layers.iter().map(geometry).collect();
    let column = |k: usize, j: usize| [1.0, known[k].0, known[k].1, known[k].0 * known[k].1][j];
    let problem = Problem {
        names: [("c0", "N/mm"), ("c1", "N/mm²"), ("c2", "N/(mm·µm)"), ("c3", "N/(mm²·µm)")]
            .map(|(n, u)| (n.to_owned(), u.to_owned()))
            .to_vec(),
        positive: vec![false; 4],
        x: DMatrix::from_fn(layers.len(), 4, column),
        y: layers.iter().map(|layer| layer.force_n / layer.thickness_mm).collect(),
        groups: (0..layers.len()).collect(),
    };
    let mut result = solved("layer", &problem, options.loss)?;
    result.notes.push("force per mm of height of a layer is fitted".into());
    Ok(result)
}

/// Force of one layer of a ball end.
struct Layer<'a> {
    row: &'a SteadyRow,
    middle_mm: f64,
    thickness_mm: f64,
    force_n: f64,
}

/// Rows that are layers themselves: `axial_depth_mm` is their thickness.
fn given_layers<'a>(rows: &'a [SteadyRow], force: &[f64]) -> Vec<Layer<'a>> {
    let layer = |(row, force): (&'a SteadyRow, &f64)| {
        let middle_mm = row.layer_height_mm?;
        force.is_finite().then_some(Layer { row, middle_mm, thickness_mm: row.cut.axial_depth_mm, force_n: *force })
    };
    rows.iter().zip(force).filter_map(layer).collect()
}

/// Cuts of growing depth: a layer's force is that of a cut less that of the next shallower one of the same width and feed.
/// A width that comes at fewer than three depths is no series: grooves that make room for the others look like that.
fn layers_by_difference<'a>(rows: &'a [SteadyRow], force: &[f64]) -> Vec<Layer<'a>> {
    let near = |a: f64, b: f64, share: f64| (a - b).abs() <= share * b.abs();
    let alike = |a: &SteadyCut, b: &SteadyCut| {
        near(a.feed_mm_s, b.feed_mm_s, 0.03)
            && near(a.rps, b.rps, 0.03)
            && near(a.radial_depth_mm, b.radial_depth_mm, 0.03)
    };
    let usable = |i: &usize| force[*i].is_finite() && rows[*i].cut.axial_depth_mm > 1e-6;
    let used: Vec<usize> = (0..rows.len()).filter(usable).collect();
    let depth = |i: usize| rows[i].cut.axial_depth_mm;
    let series = |i: usize| used.iter().filter(|j| alike(&rows[**j].cut, &rows[i].cut)).count() >= 3;
    used.iter()
        .filter(|i| series(**i))
        .filter_map(|&i| {
            let shallower = used.iter().filter(|j| alike(&rows[**j].cut, &rows[i].cut) && depth(**j) < depth(i) - 1e-6);
            let below = shallower.max_by(|a, b| depth(**a).total_cmp(&depth(**b))).copied()?;
            Some(Layer {
                row: &rows[i],
                middle_mm: 0.5 * (depth(i) + depth(below)),
                thickness_mm: depth(i) - depth(below),
                force_n: force[i] - force[below],
            })
        })
        .collect()
}

fn response(frame: &Frame, rows: &[SteadyRow], options: CalibrateOptions) -> Result<Calibration, DataError> {
    let force = frame.needed("force_xy_n")?;
    let used: Vec<usize> = (0..rows.len()).filter(|i| force[*i].is_finite()).collect();
    let geometry = |i: usize| {
        let c = &rows[i].cut;
        let r = 0.5 * c.diameter_mm;
        let theta = immersion_rad(r, c.radial_depth_mm, c.path_radius_mm);
        let fz = c.feed_mm_s / (f64::from(c.flutes) * c.rps);
        (r * theta, fz * if theta > 0.5 * std::f64::consts::PI { 1.0 } else { theta.sin() })
    };
    let problem = Problem {
        names: [("b0", "N"), ("b_l", "N/mm"), ("b_t", "N/mm")].map(|(n, u)| (n.to_owned(), u.to_owned())).to_vec(),
        positive: vec![false; 3],
        x: DMatrix::from_fn(used.len(), 3, |k, j| [1.0, geometry(used[k]).0, geometry(used[k]).1][j]),
        y: used.iter().map(|i| force[*i]).collect(),
        groups: groups(rows, &used),
    };
    solved("response", &problem, options.loss)
}

fn groups(rows: &[SteadyRow], used: &[usize]) -> Vec<usize> {
    crate::learn::dataset::steady_table::numbered(used.iter().map(|i| rows[*i].group.as_str())).0
}

fn solved(model: &str, problem: &Problem, loss: Loss) -> Result<Calibration, DataError> {
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
            .map(|j| Value {
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

/// The free answer, or the best within the bounds of physics where it leaves them.
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

/// Root mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}
