//! Options of a run beside the setup. In: [`Wanted`], a job, results of the run. Out: limits from the program itself (`--reference`), stock and
//! margins for a confidence, the model of the control fitted to a measured cycle time.

use crate::engage::EngagementMap;
use crate::machine::Job;
use crate::nc::Toolpath;
use crate::outcome::ProgramRun;
use crate::outcome::answers::{Cycle, Moved, Reference, Surface};
use crate::schedule::cycle_time::{fits, saved_percent};
use crate::schedule::feed_marks::final_surface;
use crate::schedule::operations::{Section, segments};
use crate::schedule::reference::{distributions, limited_to_itself};
use crate::schedule::stress::{with_coefficients, with_grown_stock};
use crate::schedule::{self, Problem};
use crate::setup::Assumption;

/// Factors on the coefficients under which limits from the program itself are looked at again.
const FACTORS: [f64; 2] = [0.7, 1.3];

/// Options of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Wanted {
    /// Limits are this percentile of the loads that each operation meets in the program as it stands.
    pub reference: Option<f64>,
    /// The written program is simulated again under variations of what was assumed.
    pub stress: bool,
    /// Measured cycle time of the original on the machine, s.
    pub cycle_time_s: Option<f64>,
    /// Confidence at which load limits hold.
    pub confidence: Option<f64>,
    /// A certificate is made of the written program, at the confidence asked for.
    pub certificate: bool,
    /// The files of subprograms are written again beside the output; else their feeds stay.
    pub rewrites_files: bool,
}

/// The job at a confidence: the stock at its largest, the process model's doubt in the caps.
pub fn at_confidence(job: &mut Job, confidence: f64) -> Assumption {
    *job = with_grown_stock(job);
    job.confidence = Some(confidence);
    let is_stated =
        job.tools.iter().any(|tool| job.material(tool).is_some_and(|material| material.uncertainty.is_some()));
    let known = match (job.process.covariance_of.is_empty(), is_stated) {
        (false, _) => "the covariance",
        (true, true) => "the stated uncertainty",
        (true, false) => "no stated uncertainty (`uncertainty` under [material] leaves room for one)",
    };
    let scatter = job.process.scatter.map_or_else(String::new, |s| {
        format!(" and {:.1} % of a cut's load that the model does not explain", 100.0 * s)
    });
    Assumption {
        key: "confidence".into(),
        value: format!("{confidence}, by {known} of the coefficients{scatter}; stock grown by its uncertainty"),
        source: "--confidence".into(),
    }
}

/// Limits every operation to a percentile of its own loads; how the highest feeds in cuts move when the coefficients are off.
pub fn limit_to_itself(
    job: &mut Job,
    sections: &[Section],
    toolpath: &Toolpath,
    map: &EngagementMap,
    percentile: f64,
) -> Reference {
    let own = segments(sections, toolpath, map, job);
    let held = |job: &Job| limited_to_itself(job, &own, &distributions(&own, toolpath, map, job), percentile);
    let own = held(job);
    let plain = schedule::problem(toolpath, map, &own);
    let coefficients = FACTORS
        .iter()
        .map(|&factor| {
            let other = schedule::problem(toolpath, map, &held(&with_coefficients(job, factor)));
            let (mean_percent, largest_percent) = moved(&plain, &other);
            Moved { factor, mean_percent, largest_percent }
        })
        .collect();
    *job = own;
    Reference { percentile, coefficients }
}

/// Mean over the cut length, and largest, change of the highest feeds, %.
fn moved(plain: &Problem, other: &Problem) -> (f64, f64) {
    let (mut length, mut sum, mut largest) = (0.0, 0.0, 0.0f64);
    for (a, b) in plain.nodes.iter().zip(&other.nodes).filter(|(a, _)| a.cutting && a.free) {
        let change = 100.0 * (b.cap.feed_mm_s / a.cap.feed_mm_s - 1.0);
        length += a.length_mm();
        sum += change * a.length_mm();
        largest = if change.abs() > largest.abs() { change } else { largest };
    }
    (if length > 0.0 { sum / length } else { 0.0 }, largest)
}

/// Final surfaces before and after; `None` without any.
pub fn final_surface_of(run: &ProgramRun) -> Option<Surface> {
    let [before, after] =
        [&run.before[..], run.after()].map(|feeds| final_surface(&run.toolpath, &run.map, &run.job, feeds));
    (before.length_mm > 0.0).then_some(Surface {
        length_mm: before.length_mm,
        commanded_s: [before.commanded_s, after.commanded_s],
        mark_max_mm: [before.mark_max_mm, after.mark_max_mm],
        mark_mean_mm: [before.mark_mean_mm, after.mark_mean_mm],
    })
}

/// The control fitted to a measured time of the original, and what it says of the saving.
pub fn fit_control(run: &ProgramRun, measured_s: f64) -> Cycle {
    let found = fits(&run.toolpath, &run.before, &run.job.machine, measured_s);
    let factors = || found.iter().map(|fit| fit.acceleration);
    let acceleration =
        (!found.is_empty()).then(|| [factors().fold(f64::INFINITY, f64::min), factors().fold(0.0, f64::max)]);
    let written = run.written.as_ref();
    let saved = written.and_then(|written| saved_percent(&run.toolpath, &written.after, &found));
    Cycle { measured_s, acceleration, saved_percent: saved.map(|(least, most)| [least, most]) }
}
