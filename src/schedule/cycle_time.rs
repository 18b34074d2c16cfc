//! Fitting the model of the control to one measured cycle time. In: the time that the original program takes on the machine. Out: pairs of
//! acceleration (as a factor on those of the setup) and corner tolerance that reproduce this time, and the least and largest saving that
//! they predict.
//!
//! One measured time cannot tell acceleration from corner tolerance: for each of a range of tolerances the factor on the
//! accelerations is found by bisection, and the saving is predicted with each pair.

use super::problem::FeedPiece;
use super::realise::realise;
use crate::machine::Machine;
use crate::nc::Toolpath;
use crate::numeric::bisect_ratio;

/// Corner tolerances tried, as factors on the one of the setup.
const TOLERANCES: [f64; 5] = [0.2, 0.5, 1.0, 2.0, 5.0];
/// Factors on the accelerations between which the fit is sought.
const FACTORS: [f64; 2] = [0.02, 50.0];

/// One pair of acceleration and corner tolerance with which the program takes the measured time.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The machine with the fitted values.
    pub machine: Machine,
    /// Factor on the accelerations of the setup.
    pub acceleration: f64,
    /// Corner tolerance, mm.
    pub corner_tolerance_mm: f64,
    /// Time of the program with it, s.
    pub total_s: f64,
}

/// Controls under which the program with these feeds takes `measured_s`; empty when no acceleration explains it (dwells, tool
/// changes or feeds alone take longer, or it is faster than the feeds allow).
pub fn fits(toolpath: &Toolpath, feeds: &[FeedPiece], machine: &Machine, measured_s: f64) -> Vec<Fit> {
    let fit = |tolerance: &f64| fit_at(toolpath, feeds, machine, machine.corner_tolerance_mm * tolerance, measured_s);
    TOLERANCES.iter().filter_map(fit).collect()
}

/// Least and largest saving in percent over the fits; `None` without fits.
pub fn saved_percent(toolpath: &Toolpath, after: &[FeedPiece], fits: &[Fit]) -> Option<(f64, f64)> {
    let saved = |fit: &Fit| 100.0 * (1.0 - realise(toolpath, after, &fit.machine).total_s / fit.total_s);
    let all: Vec<f64> = fits.iter().map(saved).collect();
    let least = all.iter().copied().reduce(f64::min)?;
    Some((least, all.iter().copied().fold(least, f64::max)))
}

fn fit_at(toolpath: &Toolpath, feeds: &[FeedPiece], machine: &Machine, tolerance: f64, measured_s: f64) -> Option<Fit> {
    let with = |factor: f64| {
        let mut machine = machine.clone();
        machine.corner_tolerance_mm = tolerance;
        for axis in &mut machine.axes {
            axis.acceleration_mm_s2 *= factor;
        }
        machine
    };
    let time = |factor: f64| realise(toolpath, feeds, &with(factor)).total_s;
    let [low, high] = FACTORS;
    if time(low) < measured_s || time(high) > measured_s {
        return None;
    }
    let [_, acceleration] = bisect_ratio(|factor| time(factor) > measured_s, low, high, 40);
    let total_s = time(acceleration);
    Some(Fit { machine: with(acceleration), acceleration, corner_tolerance_mm: tolerance, total_s })
}
