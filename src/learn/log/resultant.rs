//! Resultant in the XY plane of the measured force components, for comparison with the predicted one.
//!
//! In: a log with F_x and F_y, the kind of its samples, a window. Out: the log with `force_xy_n`: for peak samples
//! their magnitude; for instantaneous samples the largest magnitude within half a window on either side; for means
//! (over whole turns) the magnitude of the mean vector, which is compared with the predicted magnitude of the mean
//! force. It is the same on the tool and on the workpiece.

use crate::learn::log::sampled::Log;
use std::collections::VecDeque;

/// What a sample of a force is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sample {
    /// The force at that moment.
    Instant,
    /// The mean over the window.
    Mean,
    /// The largest over the window.
    #[default]
    Peak,
}

/// Name of a measured force that is a mean over time.
pub const MEAN_FORCE: &str = "force_xy_n (mean)";

/// Window if none is given and the log has no spindle speed, s.
const WINDOW_S: f64 = 0.1;

/// Adds the resultant if it is missing, and converts instantaneous samples to peaks.
pub fn resultant(log: &mut Log, sample: Sample, window_s: Option<f64>) {
    let find = |log: &Log, name: &str| log.measured.iter().position(|(n, _)| *n == name);
    let values = match (find(log, "force_xy_n"), find(log, "force_x_n"), find(log, "force_y_n")) {
        (Some(k), ..) => log.measured.remove(k).1,
        (None, Some(x), Some(y)) => {
            log.measured[x].1.iter().zip(&log.measured[y].1).map(|(x, y)| x.hypot(*y)).collect()
        }
        _ => return,
    };
    let peaks = match sample {
        Sample::Peak | Sample::Mean => values,
        Sample::Instant => rolling_peak(&log.time_s, &values, window_s.unwrap_or_else(|| turn_s(log))),
    };
    log.measured.push(("force_xy_n", peaks));
}

/// Duration of one turn of the spindle by the log, s.
fn turn_s(log: &Log) -> f64 {
    let running: Vec<f64> = log.rps.iter().flatten().copied().filter(|n| *n > 0.1).collect();
    if running.is_empty() { WINDOW_S } else { 1.0 / crate::learn::regress::statistics::median(&running) }
}

/// Largest value within half a window on either side.
fn rolling_peak(time_s: &[f64], values: &[f64], window_s: f64) -> Vec<f64> {
    let (mut next, mut largest) = (0, VecDeque::<usize>::new());
    (0..values.len())
        .map(|i| {
            while next < values.len() && time_s[next] <= time_s[i] + 0.5 * window_s {
                while largest.back().is_some_and(|k| values[*k] <= values[next]) {
                    largest.pop_back();
                }
                if values[next].is_finite() {
                    largest.push_back(next);
                }
                next += 1;
            }
            while largest.front().is_some_and(|k| time_s[*k] < time_s[i] - 0.5 * window_s) {
                largest.pop_front();
            }
            largest.front().map_or(f64::NAN, |k| values[*k])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_of_instants_are_those_of_a_turn() {
        let time_s: Vec<f64> = (0..400).map(|k| f64::from(k) * 1e-3).collect();
        let force = |phase: f64| time_s.iter().map(|t| 100.0 * (t * 314.159 + phase).sin()).collect::<Vec<f64>>();
        let mut log = Log { time_s: time_s.clone(), ..Log::default() };
        log.measured = vec![("force_x_n", force(0.0)), ("force_y_n", vec![0.0; 400])];
        resultant(&mut log, Sample::Instant, Some(0.02));
        let peaks = &log.measured.last().unwrap().1;
        assert!(peaks.iter().all(|p| (99.0..=100.0).contains(p)), "{peaks:?}");
    }
}
