//! Simulation of the moved program, read back from its text, with the finish. In: its motions, the stretches of the
//! finishing path. Out: their loads, and the standard deviation of the forces from the covariance of the coefficients.

use super::met_stock::Sample;
use super::programs::Programs;
use super::task::{SemifinishError, Task};
use crate::engage::Event;
use crate::force::Loads;
use crate::machine::Job;
use crate::nc::Toolpath;
use crate::path::Vec3;
use crate::schedule::confidence::doubt;

/// Result of the simulation.
pub struct Written {
    /// Loads at the samples.
    pub loads: Vec<Loads>,
    /// Standard deviation of the forces from the covariance of the coefficients, N; empty where none is known.
    pub deviation_n: Vec<f64>,
    /// Collisions and the like.
    pub events: Vec<Event>,
    /// Motions of both programs.
    pub toolpath: Toolpath,
}

/// Simulates the semi-finish of a task without offsets, and the finish.
pub fn written(task: &Task, samples: &[Sample]) -> Result<Written, SemifinishError> {
    let programs = Programs::new(task)?;
    let simulated = programs.simulated(&vec![Vec3::zeros(); programs.knots.list.len()], None)?;
    let loads = Programs::loads(&simulated, task.job, samples);
    // The varied jobs do not depend on the value of the confidence, but there must be one.
    let asked = Job { confidence: Some(0.95), ..task.job.clone() };
    let others: Vec<Vec<Loads>> =
        doubt(&asked, 1.0).jobs.iter().map(|job| Programs::loads(&simulated, job, samples)).collect();
    let square = |k: usize| {
        let off = |other: &Vec<Loads>| other[k].force_xy_peak_n - loads[k].force_xy_peak_n;
        others.iter().map(|other| off(other).powi(2)).sum::<f64>().sqrt()
    };
    let deviation_n = if others.is_empty() { Vec::new() } else { (0..samples.len()).map(square).collect() };
    Ok(Written { loads, deviation_n, events: simulated.map.events.clone(), toolpath: simulated.toolpath })
}
