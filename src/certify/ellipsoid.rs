//! The confidence ellipsoid of the coefficients. In: a force model, its covariance or its stated uncertainty, a confidence. Out: the ellipsoid
//! that contains the coefficients at that confidence, and the largest value that a load can have on it.
//!
//! Seven numbers make the loads of the linear edge model: k_tc, k_rc, k_ac (N/mm²), k_te, k_re, k_ae (N/mm) and the tare (W). With
//! the covariance Σ of p of them they are μ + G δ, where G says how those without a row of their own follow (they keep their ratio
//! to k_tc or k_te), and lie in δᵀ Σ⁻¹ δ ≤ r², r² the quantile of χ² with p degrees of freedom: **all loads of the program at once**
//! hold with that probability, which is more than each for itself. On the ellipsoid aᵀκ ≤ aᵀμ + r √(aᵀ G Σ Gᵀ a). A scatter s, the
//! share of a cut's load that the model left unexplained, is one more independent direction: (1 + s v) aᵀκ with u² + v² ≤ r² is at
//! most aᵀμ + r √(b² + s² (aᵀμ)²) + s r² b / 2, where b² = aᵀ G Σ Gᵀ a, since u v ≤ r² / 2.

use nalgebra::DMatrix;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::machine::material::{ForceModel, LinearEdge};
use crate::machine::{Job, Tool};

/// Numbers that loads are made of, in this order everywhere.
pub const NAMES: [&str; 7] = ["k_tc", "k_rc", "k_ac", "k_te", "k_re", "k_ae", "tare"];
/// How many.
pub const P: usize = NAMES.len();
/// Bound of the rounding of sums of some hundred products, relative to the sum of their magnitudes (Higham's γ_n = n u / (1 − n u) is
/// 1e-13 for a thousand terms).
const ROUNDING: f64 = 1e-12;

/// Coefficients with what is not known of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Ellipsoid {
    /// The best values.
    pub mean: [f64; P],
    /// r² G Σ Gᵀ.
    pub shape: [[f64; P]; P],
    /// r s of the scatter, and r² s / 2.
    scatter: [f64; 2],
    /// Radius.
    pub radius: f64,
}

impl Ellipsoid {
    /// Of a tool; refused in words where it is not one of this model.
    pub fn of(job: &Job, tool: &Tool, rps: f64, confidence: f64) -> Result<Self, String> {
        let edge = linear_edge(job, tool)?;
        let tare = tare_w(job, rps);
        let mean = [edge.k_tc, edge.k_rc, edge.k_ac, edge.k_te, edge.k_re, edge.k_ae, tare];
        let process = &job.process;
        let scatter = process.scatter.unwrap_or(0.0);
        let known = !process.covariance_of.is_empty();
        let stated = job.tools.iter().filter_map(|tool| job.material(tool)?.uncertainty).fold(0.0, f64::max);
        let (names, covariance) = if known {
            (process.covariance_of.clone(), process.covariance.clone())
        } else if stated <= 0.0 {
            (Vec::new(), Vec::new())
        } else {
            (vec!["all".to_owned()], vec![vec![stated * stated]])
        };
        let columns = names.iter().map(|name| column(name, &names, &mean)).collect::<Result<Vec<_>, _>>()?;
        let covariance = positive(&covariance, names.len())?;
        let directions = names.len() + usize::from(scatter > 0.0);
        let radius = radius(confidence, directions)?;
        let led = DMatrix::from_fn(P, names.len(), |i, k| columns[k][i]);
        let product = &led * covariance * led.transpose() * (radius * radius);
        let shape = std::array::from_fn(|i| std::array::from_fn(|k| product[(i, k)]));
        let scatter = [radius * scatter, 0.5 * radius * radius * scatter];
        let ellipsoid = Self { mean, shape, scatter, radius };
        let low = (0..P - 1).find(|k| ellipsoid.mean[*k] - ellipsoid.half_width(*k) < 0.0);
        low.map_or(Ok(ellipsoid), |k| Err(format!("{} may be negative at this confidence", NAMES[k])))
    }

    /// How far one of the numbers may be from its best value.
    pub fn half_width(&self, k: usize) -> f64 {
        self.shape[k][k].max(0.0).sqrt() * (1.0 + ROUNDING)
    }

    /// The largest value of Σ aₖ κₖ on it, not below the exact one.
    pub fn most(&self, a: &[f64; P]) -> f64 {
        let spread: f64 = (0..P).map(|i| a[i] * (0..P).map(|k| self.shape[i][k] * a[k]).sum::<f64>()).sum();
        let reach: f64 = (0..P).map(|i| a[i].abs() * self.shape[i][i].max(0.0).sqrt()).sum();
        let b = (spread.max(0.0) + ROUNDING * reach * reach).sqrt();
        let cut: f64 = (0..P - 1).map(|k| a[k] * self.mean[k]).sum();
        let size: f64 = (0..P).map(|k| (a[k] * self.mean[k]).abs()).sum();
        let [s, pair] = self.scatter;
        let most = cut + a[P - 1] * self.mean[P - 1] + b.hypot(s * cut) + pair * b / self.radius.max(1e-9);
        most + ROUNDING * (size + reach + s * size)
    }

    /// Factor on what is added to a load apart from [`Self::most`].
    pub fn scattered(&self) -> f64 {
        1.0 + self.scatter[0]
    }
}

/// The coefficients of a tool, if they are of the linear edge model.
fn linear_edge(job: &Job, tool: &Tool) -> Result<LinearEdge, String> {
    let own = tool.coefficients.as_ref().or_else(|| job.stocks.first().map(|stock| &stock.material));
    let model = job.process.base.as_ref().or(own.map(|material| &material.model));
    match model {
        Some(ForceModel::LinearEdge(edge)) => Ok(*edge),
        Some(other) => Err(format!("the force model {} (only linear-edge is)", other.name())),
        None => Err("a tool without coefficients".to_owned()),
    }
}

/// Power of the spindle with nothing cut at a speed: its curve, through what was measured at one speed where that is known.
fn tare_w(job: &Job, rps: f64) -> f64 {
    let curve = &job.machine.spindle.tare_w;
    match (job.process.tare_w, job.process.tare_rps) {
        (Some(measured), Some(there)) if curve.at(there) > 0.0 => measured * curve.at(rps) / curve.at(there),
        (Some(measured), _) => measured,
        (None, _) => curve.at(rps),
    }
}

/// How the seven numbers move with one of those that have a variance.
fn column(name: &str, names: &[String], mean: &[f64; P]) -> Result<[f64; P], String> {
    if name == "all" {
        return Ok(std::array::from_fn(|k| if k + 1 < P { mean[k] } else { 0.0 }));
    }
    let own = NAMES.iter().position(|known| *known == name).ok_or(format!("a covariance of {name}"))?;
    let mut column = [0.0; P];
    column[own] = 1.0;
    let led = match own {
        0 => [1, 2],
        3 => [4, 5],
        _ => return Ok(column),
    };
    for follower in led {
        if names.iter().all(|known| known != NAMES[follower]) && mean[own] != 0.0 {
            column[follower] = mean[follower] / mean[own];
        }
    }
    Ok(column)
}

/// A covariance: square, finite, and positive but for rounding.
fn positive(matrix: &[Vec<f64>], n: usize) -> Result<DMatrix<f64>, String> {
    if matrix.len() != n || matrix.iter().any(|row| row.len() != n || row.iter().any(|value| !value.is_finite())) {
        return Err("a covariance that is no square table of numbers".to_owned());
    }
    let symmetric = DMatrix::from_fn(n, n, |i, k| 0.5 * (matrix[i][k] + matrix[k][i]));
    // Scaled to a unit diagonal, so that the smallest of the coefficients counts as much as the largest.
    let scale = |k: usize| symmetric[(k, k)].abs().sqrt().max(f64::MIN_POSITIVE);
    let scaled = DMatrix::from_fn(n, n, |i, k| symmetric[(i, k)] / scale(i) / scale(k));
    if n > 0 && scaled.symmetric_eigenvalues().min() < -1e-9 {
        return Err("a covariance that is not positive".to_owned());
    }
    Ok(symmetric)
}

/// Radius that holds a normal vector of so many directions with this probability; 0 without any.
pub fn radius(confidence: f64, directions: usize) -> Result<f64, String> {
    if !(0.5..1.0).contains(&confidence) {
        return Err(format!("a confidence of {confidence}"));
    }
    if directions == 0 {
        return Ok(0.0);
    }
    let chi = ChiSquared::new(directions as f64).map_err(|error| error.to_string())?;
    Ok(chi.inverse_cdf(confidence).sqrt() * (1.0 + 1e-6))
}
