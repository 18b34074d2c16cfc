//! Linear edge coefficients before learning: those that the setup declares, or a default. In: job, tool. Out:
//! [`LinearEdge`].

use crate::machine::material::{ForceModel, LinearEdge};
use crate::machine::{Job, Tool};

/// Aluminium 6061-T6, N/mm² and N/mm: k_tc and k_te fitted to the spindle power of Table 5 of Xu, Jerard and Fussell
/// (2007), the radial ones by their ratios 0.395 and 0.566, the axial ones assumed. Used for the shape of a load if the
/// setup declares no linear coefficients; results of learning rest on the readings.
pub const ALUMINIUM: LinearEdge =
    LinearEdge { k_tc: 842.0, k_rc: 332.0, k_ac: 150.0, k_te: 15.2, k_re: 8.6, k_ae: 2.0 };

/// Coefficients that the setup declares for a tool; `None` if its material has another model.
pub fn declared(job: &Job, tool: &Tool) -> Option<LinearEdge> {
    if let ForceModel::LinearEdge(k) = job.material(tool)?.model { Some(k) } else { None }
}

/// The same, or those of [`ALUMINIUM`].
pub fn declared_or_aluminium(job: &Job, tool: &Tool) -> LinearEdge {
    declared(job, tool).unwrap_or(ALUMINIUM)
}

/// Coefficients of the first tool that has a material.
pub fn of_job(job: &Job) -> Option<LinearEdge> {
    declared(job, job.tools.iter().find(|tool| job.material(tool).is_some())?)
}

/// Coefficients of the process model learned before, or else those of [`of_job`].
pub fn in_force(job: &Job) -> Option<LinearEdge> {
    match &job.process.base {
        Some(ForceModel::LinearEdge(k)) => Some(*k),
        Some(_) => None,
        None => of_job(job),
    }
}
