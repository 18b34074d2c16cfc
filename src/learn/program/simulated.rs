//! A simulated program for comparison with a log: engagement as declared and with each other geometry that an effect
//! may need, and times on slower machines. In: program, job. Out: [`SimulatedProgram`], and its view for the rooms
//! below, [`ProgramView`].

use crate::engage::{EngageError, EngagementMap, Loader, engage};
use crate::learn::log::resultant::Sample;
use crate::learn::program::other_geometry::{SizeChanges, beside_usual, options, other_geometries, usual_geometries};
use crate::learn::program::runout_grid::RunoutGrid;
use crate::learn::program::timeline::{Timeline, speed_ratios, timeline};
use crate::learn::program::variant::OtherGeometry;
use crate::machine::Job;
use crate::nc::{Environment, Toolpath, interpret, parse, unit};
use rayon::prelude::*;

/// Accelerations that are tried, over the declared one.
const SLOWER: [f64; 14] = [0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.09, 0.06, 0.045, 0.03, 0.02, 0.015, 0.01, 0.007];

/// What the rooms below need of a simulated program.
pub struct ProgramView<'a> {
    /// The job.
    pub job: &'a Job,
    /// The program over time.
    pub timeline: &'a Timeline,
    /// Other geometries.
    pub others: &'a [OtherGeometry],
    /// Speed over declared speed on slower machines, spot by spot: (factor, ratios).
    pub slower: &'a [(f64, Vec<f64>)],
    /// Runouts for which the forces of the spots were computed.
    pub runouts: RunoutGrid,
}

/// A program simulated for a job, independent of any log.
pub struct SimulatedProgram {
    pub(in crate::learn) path: Toolpath,
    pub(in crate::learn) map: EngagementMap,
    pub(in crate::learn) timeline: Timeline,
    pub(in crate::learn) others: Vec<OtherGeometry>,
    pub(in crate::learn) slower: Vec<(f64, Vec<f64>)>,
    pub(in crate::learn) forces: Option<Sample>,
}

/// Simulates the program as declared and with each other geometry, without stock from files.
#[cfg(feature = "rooms")]
pub fn simulate(program: &[u8], job: &Job, with_forces: bool) -> Result<SimulatedProgram, EngageError> {
    simulate_for(program, job, with_forces.then(Sample::default), None)
}

/// The same, for forces sampled in this way (`None`: no forces are measured), with a loader for stock files.
pub fn simulate_for(
    program: &[u8],
    job: &Job,
    forces: Option<Sample>,
    loader: Option<Loader>,
) -> Result<SimulatedProgram, EngageError> {
    let declared = simulate_declared(program, job, forces, loader)?;
    let others = usual_geometries(&declared.path, &declared.map, &declared.timeline, job, forces, loader);
    Ok(SimulatedProgram { others, ..declared })
}

/// The program as declared alone.
pub fn simulate_declared(
    program: &[u8],
    job: &Job,
    forces: Option<Sample>,
    loader: Option<Loader>,
) -> Result<SimulatedProgram, EngageError> {
    let program = parse(program.to_vec(), None);
    let path = interpret(&program, &unit::with_its_unit(&program, Environment::from_job(job), Some(job)));
    let map = engage(&path, job, &options(loader), &|_| ())?;
    let timeline = timeline(&path, &map, job, forces);
    let slower = SLOWER.par_iter().map(|f| (*f, speed_ratios(&path, &map, job, &timeline, *f))).collect();
    Ok(SimulatedProgram { path, map, timeline, others: Vec::new(), slower, forces })
}

impl SimulatedProgram {
    /// Moves of the program.
    pub fn toolpath(&self) -> &Toolpath {
        &self.path
    }
    /// View of the program as declared.
    pub fn known<'a>(&'a self, job: &'a Job) -> ProgramView<'a> {
        self.known_at(job, &self.timeline, RunoutGrid::default())
    }
    pub(in crate::learn) fn known_at<'a>(
        &'a self,
        job: &'a Job,
        timeline: &'a Timeline,
        runouts: RunoutGrid,
    ) -> ProgramView<'a> {
        ProgramView { job, timeline, others: &self.others, slower: &self.slower, runouts }
    }
    /// Its spots over time.
    pub fn timeline(&self) -> &Timeline {
        &self.timeline
    }
    /// Engagement with the stock and the tool that were found, and with the usual changes; `None` where the stock cannot be read.
    pub(in crate::learn) fn with_sizes(
        &self,
        job: &Job,
        sizes: SizeChanges,
        loader: Option<Loader>,
    ) -> Option<Vec<OtherGeometry>> {
        let found = other_geometries(self.toolpath(), &self.map, self.timeline(), job, sizes, self.forces, loader);
        (!found.is_empty()).then(|| beside_usual(found, &self.others))
    }
}
