//! Caps that hold at a stated confidence. In: the covariance of the process model's parameters, the confidence, the length that the program
//! cuts. Out: process models one standard deviation away along each independent direction of the covariance, and caps with a margin for them.
//!
//! With the covariance Σ = Σ_k w_k w_kᵀ of the parameters θ, the variance of a load is Σ_k (L(θ + w_k) − L(θ))² to first
//! order. Coefficients that are known to a percent do not make a load known to a percent: the residual that the model left on
//! held-out data (`scatter` s, a share of the load) will be there in the next cut as well. A cap at confidence c keeps
//! L + z σ ≤ limit with σ² = Σ_k (L(θ + w_k) − L(θ))² + (m s L)², z being the one-sided normal quantile of c. In the last term L is
//! the load of the cut without the tare, which has no scatter.
//!
//! A wrong coefficient is wrong everywhere in the same way. The residual differs from place to place, and the limit has to hold at the place
//! where it is largest: the largest of n independent residuals stays below z_n s with Φ(z_n)ⁿ = c (Šidák), so m = z_n / z. Two places one
//! tool diameter apart have no material in common, so n is the length of cut over the diameter. A rough count is enough: for 10, 100, 1000
//! places z_n is 2.6, 3.3, 3.9 at 95 %.
//!
//! A log shows how loads grow with the feed only up to the highest feed in it, f₁ for a given tool. Beyond f₁ the load is taken to grow in
//! proportion, L(f) = L(f₁) f/f₁. That is an upper bound for every law with an edge force, or with a specific force that falls with the
//! chip thickness, whatever share of the measured load is edge force.
//!
//! Where the model has no covariance, because its coefficients were not measured, the standard uncertainty of all forces that the setup states
//! is used instead. Parameters that the covariance does not name keep their ratio to those that it does.

use nalgebra::{DMatrix, SymmetricEigen};
use statrs::distribution::{ContinuousCDF, Normal};

use super::stress::with_coefficients;
use crate::engage::{EngagementMap, Station};
use crate::force::{Cap, LoadLine};
use crate::ids::MoveId;
use crate::machine::material::{ForceModel, LinearEdge, Process};
use crate::machine::{Job, LimitKind};
use crate::nc::{Move, Toolpath};

/// Number of times a cap is worked out again with the margin at the last cap: the margin depends on the feed.
const ROUNDS: usize = 3;

/// The uncertainty of a process model: the job with each of the models one standard deviation away, and the standard deviations that
/// the confidence asks for.
#[derive(Debug, Clone, Default)]
pub struct ModelUncertainty {
    /// The jobs.
    pub jobs: Vec<Job>,
    /// Standard deviations to keep away from a limit.
    pub deviations: f64,
}

/// The uncertainty of a job's process model, for a program of so many independent `places`; empty where the setup asks for no confidence.
pub fn doubt(job: &Job, places: f64) -> ModelUncertainty {
    let Some(confidence) = job.confidence else { return ModelUncertainty::default() };
    let normal = Normal::new(0.0, 1.0).expect("the standard normal distribution");
    let deviations = normal.inverse_cdf(confidence).max(0.0);
    let of_largest = normal.inverse_cdf(confidence.powf(places.max(1.0).recip()));
    let more = if deviations > 0.0 { of_largest / deviations } else { 1.0 };
    let mut jobs: Vec<Job> = apart(&job.process).into_iter().map(|process| Job { process, ..job.clone() }).collect();
    if jobs.is_empty() {
        let stated = job.tools.iter().filter_map(|tool| job.material(tool)?.uncertainty).fold(0.0, f64::max);
        jobs.extend((stated > 0.0).then(|| with_coefficients(job, 1.0 + stated)));
    }
    jobs.extend(job.process.scatter.filter(|s| *s > 0.0).map(|s| with_coefficients(job, 1.0 + more * s)));
    ModelUncertainty { jobs, deviations }
}

/// Number of independent places of a program: its length of cut in tool diameters.
pub fn places(toolpath: &Toolpath, map: &EngagementMap, job: &Job) -> f64 {
    let of_move = |(id, motion): (MoveId, &Move)| {
        let cut = map.stations_of(id).iter().filter(|station| station.arc_count > 0);
        let diameter_mm = job.tool(motion.tool).map_or(f64::INFINITY, |tool| tool.diameter_mm);
        cut.map(Station::length_mm).sum::<f64>() / diameter_mm
    };
    toolpath.iter_moves().map(of_move).sum()
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

/// The margin that caps leave below a limit.
#[derive(Debug, Clone, Copy)]
pub struct Margin<'a> {
    /// The same cut under the jobs of [`ModelUncertainty`].
    pub others: &'a [LoadLine],
    /// Standard deviations to keep away.
    pub deviations: f64,
    /// Highest feed per tooth that was measured with this tool, mm.
    pub measured_mm: Option<f64>,
}

impl Margin<'_> {
    /// Upper bound of a load at a feed: L + z σ.
    fn most(&self, line: &LoadLine, kind: LimitKind, feed_mm_s: f64) -> f64 {
        let load = |line: &LoadLine| line.loads(feed_mm_s).bounded_by(kind).unwrap_or(0.0);
        let mean = load(line);
        mean + self.deviations * self.others.iter().map(|other| (load(other) - mean).powi(2)).sum::<f64>().sqrt()
    }

    /// Cap of one load.
    pub fn cap(&self, line: &LoadLine, kind: LimitKind, limit: f64) -> Cap {
        let mut cap = line.cap(kind, limit);
        for _ in 0..ROUNDS {
            let Cap::Feed { feed_mm_s, .. } = cap else { break };
            let mean = line.loads(feed_mm_s).bounded_by(kind).unwrap_or(0.0);
            let most = self.most(line, kind, feed_mm_s);
            if most <= mean {
                break;
            }
            cap = line.cap(kind, limit * mean / most);
        }
        self.in_proportion(line, kind, limit).filter(|beyond| is_below(*beyond, cap)).unwrap_or(cap)
    }

    /// The cap where the load grows in proportion beyond the highest feed measured. `None` where the cap lies below that feed, or no feed
    /// was measured.
    fn in_proportion(&self, line: &LoadLine, kind: LimitKind, limit: f64) -> Option<Cap> {
        if matches!(kind, LimitKind::ChipThickness | LimitKind::FeedPerTooth) {
            return None;
        }
        let measured_mm_s = line.feed_mm_s(self.measured_mm?);
        let idle = line.idle(kind, measured_mm_s);
        let load = self.most(line, kind, measured_mm_s) - idle;
        let by = (limit - idle) / load;
        (load > 0.0 && by >= 1.0).then(|| Cap::Feed { feed_mm_s: measured_mm_s * by, per_unit: measured_mm_s / load })
    }
}

fn is_below(cap: Cap, other: Cap) -> bool {
    match (cap, other) {
        (Cap::Feed { feed_mm_s: a, .. }, Cap::Feed { feed_mm_s: b, .. }) => a < b,
        (Cap::Feed { .. }, Cap::Free) => true,
        _ => false,
    }
}
