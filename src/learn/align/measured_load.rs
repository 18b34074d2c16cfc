//! The measured load for the alignment. In: log, measured quantity. Out: at most some thousand points, or means over a
//! grid; neither averages over gaps.

use crate::learn::align::holds::Holds;
use crate::learn::log::Log;
use crate::learn::log::gaps::gaps;

/// Most points of the measured load.
const MOST_POINTS: f64 = 8000.0;

/// The measured load, thinned.
pub(in crate::learn) struct MeasuredLoad {
    /// Time of each point, s.
    pub(in crate::learn) time_s: Vec<f64>,
    /// Load, unit of the reading.
    pub(in crate::learn) load: Vec<f64>,
    /// Time over which each point is a mean, s.
    pub(in crate::learn) span_s: f64,
    /// Stretches in which nothing was measured: from, to, s.
    pub(in crate::learn) gaps: Vec<[f64; 2]>,
}

impl MeasuredLoad {
    /// The load without the holds, at running times ([`Holds::running_s`]).
    pub(in crate::learn) fn without(&self, holds: &Holds) -> Self {
        let inside = |t: f64| holds.0.iter().any(|(from, to)| t > *from && t < *to);
        let kept: Vec<usize> = (0..self.time_s.len()).filter(|i| !inside(self.time_s[*i])).collect();
        Self {
            time_s: kept.iter().map(|i| holds.running_s(self.time_s[*i])).collect(),
            load: kept.iter().map(|i| self.load[*i]).collect(),
            span_s: self.span_s,
            gaps: self.gaps.iter().map(|gap| gap.map(|t| holds.running_s(t))).collect(),
        }
    }
}

/// The load as means of a few readings each, never over a gap.
pub(in crate::learn) fn thinned(log: &Log, index: usize) -> Option<MeasuredLoad> {
    let values = &log.measured[index].1;
    let known: Vec<usize> = (0..values.len()).filter(|i| values[*i].is_finite()).collect();
    let times: Vec<f64> = known.iter().map(|i| log.time_s[*i]).collect();
    let gaps = if log.on_change { Vec::new() } else { gaps(&times) };
    let size = (known.len() as f64 / MOST_POINTS).ceil().max(1.0) as usize;
    let mean = |of: &dyn Fn(usize) -> f64, c: &[usize]| c.iter().map(|i| of(*i)).sum::<f64>() / c.len() as f64;
    let in_gaps: f64 = gaps.iter().map(|[from, to]| to - from).sum();
    let step_s = (times.last()? - times.first()? - in_gaps) / (times.len() - gaps.len()) as f64;
    let begins = |i: usize| gaps.binary_search_by(|gap| gap[1].total_cmp(&log.time_s[i])).is_ok();
    let chunks: Vec<&[usize]> = known.chunk_by(|_, after| !begins(*after)).flat_map(|c| c.chunks(size)).collect();
    let measured = MeasuredLoad {
        span_s: (size - 1) as f64 * step_s,
        time_s: chunks.iter().map(|c| mean(&|i| log.time_s[i], c)).collect(),
        load: chunks.iter().map(|c| mean(&|i| values[i], c)).collect(),
        gaps,
    };
    (measured.load.len() >= 50).then_some(measured)
}

/// Means of the load over a grid, NaN in gaps; other steps without a reading have the value before.
pub(in crate::learn) fn gridded(measured: &MeasuredLoad, step: f64) -> Vec<f64> {
    let count = (measured.time_s.last().copied().unwrap_or(0.0) / step) as usize + 1;
    let (mut sums, mut counts) = (vec![0.0; count], vec![0.0; count]);
    for (t, v) in measured.time_s.iter().zip(&measured.load) {
        let k = ((t / step) as usize).min(count - 1);
        sums[k] += v;
        counts[k] += 1.0;
    }
    let mut last = measured.load.first().copied().unwrap_or(0.0);
    let mut grid = Vec::with_capacity(count);
    for (sum, number) in sums.iter().zip(&counts) {
        last = if *number > 0.0 { sum / number } else { last };
        grid.push(last);
    }
    for [from, to] in &measured.gaps {
        let inside = (from / step) as usize + 1..((to / step) as usize).min(count);
        inside.filter(|k| counts[*k] == 0.0).for_each(|k| grid[k] = f64::NAN);
    }
    grid
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 40 000 readings of a ramp with two gaps, thinned five to one.
    #[test]
    fn no_mean_is_taken_over_a_gap_and_nothing_is_read_into_it() {
        let kept = |k: &usize| !(10_003..13_000).contains(k) && !(20_002..20_009).contains(k);
        let time_s: Vec<f64> = (0..40_000).filter(kept).map(|k| 0.01 * k as f64).collect();
        let log = Log { measured: vec![("spindle_power_w", time_s.clone())], time_s, ..Log::default() };
        let thin = thinned(&log, 0).unwrap();
        assert_eq!(thin.gaps.len(), 2);
        assert!(thin.time_s.iter().all(|t| thin.gaps.iter().all(|[from, to]| t <= from || t >= to)));
        assert!((thin.span_s - 0.04).abs() < 1e-4, "{}", thin.span_s);
        let grid = gridded(&thin, 0.1);
        for (k, value) in grid.iter().enumerate() {
            let missing = (1001..1300).contains(&k);
            assert_eq!(value.is_nan(), missing, "{k}: {value}");
            assert!(missing || (value - 0.1 * (k as f64 + 0.5)).abs() < 0.1, "{k}: {value}");
        }
    }
}
