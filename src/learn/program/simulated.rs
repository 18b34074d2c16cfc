//! A program as a log is compared with it: simulated as declared, with each geometry that an effect may ask for, and
//! timed on slower machines. In: program, job. Out: [`SimulatedProgram`], and [`ProgramView`], what the rooms below
//! look at.

use crate::engage::{EngageError, EngagementMap, Loader, engage};
use crate::learn::log::resultant::Sample;
use crate::learn::program::other_geometry::{SizeChanges, options, other_geometries};
use crate::learn::program::runout_grid::RunoutGrid;
use crate::learn::program::timeline::{Timeline, speed_ratios, timeline};
use crate::learn::program::variant::OtherGeometry;
use crate::machine::Job;
use crate::nc::{Environment, Toolpath, interpret, parse, unit};

/// Accelerations tried, over the declared one.
const SLOWER: [f64; 14] = [0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.09, 0.06, 0.045, 0.03, 0.02, 0.015, 0.01, 0.007];

/// Everything that is known of the spots.
pub struct ProgramView<'a> {
    /// The job.
    pub job: &'a Job,
    /// The program in time.
    pub timeline: &'a Timeline,
    /// Other geometries.
    pub others: Vec<OtherGeometry>,
    /// Speed over declared speed on slower machines, spot by spot: (factor, ratios).
    pub slower: Vec<(f64, Vec<f64>)>,
    /// Runouts under which the forces of the spots were worked out.
    pub runouts: RunoutGrid,
}

/// What belongs to a program and a job, whatever the log says.
pub struct SimulatedProgram {
    pub(in crate::learn) path: Toolpath,
    pub(in crate::learn) map: EngagementMap,
    pub(in crate::learn) timeline: Timeline,
    pub(in crate::learn) others: Vec<OtherGeometry>,
    pub(in crate::learn) slower: Vec<(f64, Vec<f64>)>,
    pub(in crate::learn) forces: Option<Sample>,
}

/// Simulates the program as declared and with each geometry that an effect may ask for, in stock without files.
#[cfg(feature = "rooms")]
pub fn simulate(program: &[u8], job: &Job, with_forces: bool) -> Result<SimulatedProgram, EngageError> {
    simulate_for(program, job, with_forces.then(Sample::default), None)
}

/// The same, for forces that are sampled so (`None`: no forces are measured), and with what reads the files of stock.
pub fn simulate_for(
    program: &[u8],
    job: &Job,
    forces: Option<Sample>,
    loader: Option<Loader>,
) -> Result<SimulatedProgram, EngageError> {
    let program = parse(program.to_vec(), None);
    let path = interpret(&program, &unit::with_its_unit(&program, Environment::from_job(job), Some(job)));
    let map = engage(&path, job, &options(loader), &|_| ())?;
    let timeline = timeline(&path, &map, job, forces);
    let others = other_geometries(&path, &timeline, job, SizeChanges::usual(job), forces, loader);
    let slower = SLOWER.iter().map(|f| (*f, speed_ratios(&path, &map, job, &timeline, *f))).collect();
    Ok(SimulatedProgram { path, map, timeline, others, slower, forces })
}

impl SimulatedProgram {
    /// Moves of the program.
    pub fn toolpath(&self) -> &Toolpath {
        &self.path
    }
    /// Everything that is known of its spots.
    pub fn known<'a>(&'a self, job: &'a Job) -> ProgramView<'a> {
        self.known_at(job, &self.timeline, RunoutGrid::default())
    }
    pub(in crate::learn) fn known_at<'a>(
        &'a self,
        job: &'a Job,
        timeline: &'a Timeline,
        runouts: RunoutGrid,
    ) -> ProgramView<'a> {
        ProgramView { job, timeline, others: self.others.clone(), slower: self.slower.clone(), runouts }
    }
    /// Its spots in time.
    pub fn timeline(&self) -> &Timeline {
        &self.timeline
    }
    /// Engagement with the stock and the tool that were found.
    pub(in crate::learn) fn with_sizes(
        &self,
        job: &Job,
        sizes: SizeChanges,
        loader: Option<Loader>,
    ) -> Vec<OtherGeometry> {
        other_geometries(self.toolpath(), self.timeline(), job, sizes, self.forces, loader)
    }
}
