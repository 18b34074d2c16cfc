//! Feeds that hold at a stated confidence. In: what the process model knows of its own parameters, a confidence. Out: the
//! process models one standard deviation away along each independent direction, and caps that leave room for them.
//!
//! With the covariance Σ = Σ_k w_k w_kᵀ of the parameters θ, the variance of a load is Σ_k (L(θ + w_k) − L(θ))² to first
//! order. Coefficients that are known to a percent do not make a load known to a percent: what the model left unexplained
//! on held-out data (`scatter` s, a share of the load) is there in the next cut as well. A cap at confidence c keeps
//! L + z σ ≤ limit with σ² = Σ_k (L(θ + w_k) − L(θ))² + (s L)², z the one-sided normal quantile, L that of the cut alone: a tare has no
//! scatter. Without either a relative standard uncertainty of all forces takes their place. Parameters that are not named in the
//! covariance keep their ratio to those that are.

use nalgebra::{DMatrix, SymmetricEigen};
use statrs::distribution::{ContinuousCDF, Normal};

use super::stress::with_coefficients;
use crate::force::{Cap, LoadLine};
use crate::machine::material::{ForceModel, LinearEdge, Process};
use crate::machine::{Job, LimitKind};

/// How often a cap is taken again at the margin of the cap before.
const ROUNDS: usize = 3;

/// Jobs one standard deviation away, and how many of them the confidence asks for.
#[derive(Debug, Clone, Default)]
pub struct Doubt {
    /// The jobs.
    pub jobs: Vec<Job>,
    /// Standard deviations to keep away from a limit.
    pub deviations: f64,
}

/// What is known of the parameters of a job at its confidence; empty when none is asked for.
pub fn doubt(job: &Job) -> Doubt {
    let Some(confidence) = job.confidence else { return Doubt::default() };
    let normal = Normal::new(0.0, 1.0).expect("the standard normal distribution");
    let mut jobs: Vec<Job> = apart(&job.process).into_iter().map(|process| Job { process, ..job.clone() }).collect();
    jobs.extend(job.process.scatter.filter(|s| *s > 0.0).map(|s| with_coefficients(job, 1.0 + s)));
    if jobs.is_empty() {
        let stated = job.tools.iter().filter_map(|tool| job.material(tool)?.uncertainty).fold(0.0, f64::max);
        jobs.extend((stated > 0.0).then(|| with_coefficients(job, 1.0 + stated)));
    }
    Doubt { jobs, deviations: normal.inverse_cdf(confidence).max(0.0) }
}

/// The process models at θ + w_k; empty where the covariance is not known.
fn apart(process: &Process) -> Vec<Process> {
    let names = &process.covariance_of;
    let p = names.len();
    if p == 0 || process.covariance.len() != p || process.covariance.iter().any(|row| row.len() != p) {
        return Vec::new();
    }
    let matrix = DMatrix::from_fn(p, p, |i, j| 0.5 * (process.covariance[i][j] + process.covariance[j][i]));
    if matrix.iter().any(|value| !value.is_finite()) {
        return Vec::new();
    }
    let eigen = SymmetricEigen::new(matrix);
    let directions = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    let steps = directions.map(|(value, vector)| vector * value.max(0.0).sqrt());
    steps.map(|step| moved(process, step.as_slice())).collect()
}

fn moved(process: &Process, step: &[f64]) -> Process {
    let mut moved = process.clone();
    for (name, by) in process.covariance_of.iter().zip(step) {
        if name == "tare" {
            moved.tare_w = moved.tare_w.map(|tare| tare + by);
        }
        match &mut moved.base {
            Some(ForceModel::LinearEdge(k)) => move_edge(k, name, *by, process),
            Some(ForceModel::Named { parameters, .. }) => {
                parameters.iter_mut().filter(|(key, _)| key == name).for_each(|(_, value)| *value += by);
            }
            None => {}
        }
    }
    moved
}

/// Moves a coefficient, and with it those that only keep their ratio to it.
fn move_edge(k: &mut LinearEdge, name: &str, by: f64, process: &Process) {
    let own = |name: &str| process.covariance_of.iter().any(|known| known == name);
    let share = |of: f64| if of == 0.0 { 0.0 } else { by / of };
    match name {
        "k_tc" => {
            let share = share(k.k_tc);
            k.k_tc += by;
            k.k_rc *= if own("k_rc") { 1.0 } else { 1.0 + share };
            k.k_ac *= if own("k_ac") { 1.0 } else { 1.0 + share };
        }
        "k_te" => {
            let share = share(k.k_te);
            k.k_te += by;
            k.k_re *= if own("k_re") { 1.0 } else { 1.0 + share };
            k.k_ae *= if own("k_ae") { 1.0 } else { 1.0 + share };
        }
        "k_rc" => k.k_rc += by,
        "k_re" => k.k_re += by,
        "k_ac" => k.k_ac += by,
        "k_ae" => k.k_ae += by,
        _ => {}
    }
}

/// Cap of one load that leaves `deviations` standard deviations, by the same cut under the jobs of [`Doubt`].
pub fn cap(line: &LoadLine, others: &[LoadLine], deviations: f64, kind: LimitKind, limit: f64) -> Cap {
    let mut cap = line.cap(kind, limit);
    for _ in 0..ROUNDS {
        let Cap::Feed { feed_mm_s, .. } = cap else { return cap };
        let load = |line: &LoadLine| line.loads(feed_mm_s).bounded_by(kind).unwrap_or(0.0);
        let mean = load(line);
        let variance: f64 = others.iter().map(|other| (load(other) - mean).powi(2)).sum();
        if variance <= 0.0 {
            return cap;
        }
        cap = line.cap(kind, limit * mean / (mean + deviations * variance.sqrt()));
    }
    cap
}
