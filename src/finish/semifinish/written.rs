//! The moved program as it was read back, simulated with the finish. In: its motions, the stretches of the finishing
//! path. Out: loads there, and how far the forces may be off by what is uncertain in the coefficients.

use super::bench::Bench;
use super::met::Sample;
use super::task::{SemifinishError, Task};
use crate::engage::Event;
use crate::force::Loads;
use crate::machine::Job;
use crate::nc::Toolpath;
use crate::path::Vec3;
use crate::schedule::confidence::doubt;

/// What was found.
pub struct Written {
    /// Loads at the samples.
    pub loads: Vec<Loads>,
    /// Standard deviation of the forces from the covariance of the coefficients, N; empty where none is known.
    pub deviation_n: Vec<f64>,
    /// What must not happen, with the toolpath of both programs.
    pub events: Vec<Event>,
    /// Motions of both.
    pub toolpath: Toolpath,
}

/// Looks at the semi-finish of a task as it stands.
pub fn written(task: &Task, samples: &[Sample]) -> Result<Written, SemifinishError> {
    let bench = Bench::new(task)?;
    let look = bench.look(&vec![Vec3::zeros(); bench.knots.list.len()], None)?;
    let loads = Bench::loads(&look, task.job, samples);
    // The jobs do not depend on the confidence, only on its being asked for.
    let asked = Job { confidence: Some(0.95), ..task.job.clone() };
    let others: Vec<Vec<Loads>> = doubt(&asked, 1.0).jobs.iter().map(|job| Bench::loads(&look, job, samples)).collect();
    let square = |k: usize| {
        let off = |other: &Vec<Loads>| other[k].force_xy_peak_n - loads[k].force_xy_peak_n;
        others.iter().map(|other| off(other).powi(2)).sum::<f64>().sqrt()
    };
    let deviation_n = if others.is_empty() { Vec::new() } else { (0..samples.len()).map(square).collect() };
    Ok(Written { loads, deviation_n, events: look.map.events.clone(), toolpath: look.toolpath })
}
