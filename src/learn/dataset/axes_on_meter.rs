//! Power of the axis drives in a reading, if the meter measures more than the spindle. In: samples placed in the
//! program, in air. Out: factors on the speed v and on v·max(0, a), a the acceleration; range of that power within the
//! uncertainty of the alignment.
//!
//! A rapid takes some tenths of a second and begins and ends at rest, so this power rises and falls within hundredths
//! of a second, and a sample misplaced by as much has an error of all of it. If the meter does not measure the axes,
//! both factors are nearly 0.

use crate::learn::align::Method;
use crate::learn::dataset::placed_log::PlacedLog;
use crate::learn::program::motion::motion;
use crate::learn::program::timeline::Activity;
use crate::learn::regress::linear::{Loss, robust};
use nalgebra::DMatrix;

/// Fewest readings in rapids for a fit. Judgement.
const FEWEST: usize = 10;
/// Number of times within the uncertainty of a sample at which the power is computed.
const TIMES: usize = 9;

impl PlacedLog<'_> {
    /// Factors on v and on v·max(0, a) fitted to the readings in air; not negative, 0 if rapids are too few.
    pub(in crate::learn) fn axes_shown(&self, valid: &[usize], values: &[f64]) -> [f64; 2] {
        let spots = &self.known.timeline.spots;
        let in_air = |i: &usize| {
            let spot = self.spot[*i].map(|k| &spots[k]);
            spot.is_some_and(|s| {
                matches!(s.activity, Activity::Rapid | Activity::Dwell | Activity::Feed)
                    && s.engaged.section_mm2 <= 1e-6
            })
        };
        let air: Vec<[usize; 2]> = valid.windows(2).map(|p| [p[0], p[1]]).filter(|[_, i]| in_air(i)).collect();
        let rapid = |[_, i]: &&[usize; 2]| self.spot[*i].is_some_and(|k| spots[k].activity == Activity::Rapid);
        if air.iter().filter(rapid).count() < FEWEST {
            return [0.0; 2];
        }
        // The reading before is a regressor, for the tail of a cut in a lagging sensor.
        let row = |[before, i]: &[usize; 2]| {
            let [v, a] = self.motion(*i);
            let rps = self.spot[*i].map_or(0.0, |k| self.rps(*i, &spots[k]));
            [self.tare_shape(rps), v, v * a.max(0.0), values[*before]]
        };
        let rows: Vec<[f64; 4]> = air.iter().map(row).collect();
        let x = DMatrix::from_fn(rows.len(), 4, |r, c| rows[r][c]);
        let y: Vec<f64> = air.iter().map(|[_, i]| values[*i]).collect();
        let fit = robust(&x, &y, &vec![1.0; y.len()], Loss::Huber);
        fit.map_or([0.0; 2], |f| [1, 2].map(|k| f.coefficients[k].max(0.0)))
    }

    /// Range of the power of the axes within `doubt_s` of a sample.
    pub(in crate::learn) fn axes_spread(&self, i: usize, doubt_s: f64, shown: [f64; 2]) -> f64 {
        if shown == [0.0; 2] {
            return 0.0;
        }
        let (timeline, machine) = (self.known.timeline, &self.known.job.machine);
        let by_way = self.aligned.method == Method::Position;
        let at = |k: usize| {
            let at_s = self.aligned.program_s[i] + doubt_s * (2.0 * k as f64 / (TIMES - 1) as f64 - 1.0);
            let (v, a) = motion(timeline, timeline.at(at_s)?, at_s, by_way, machine);
            Some(shown[0] * v + shown[1] * v * a.max(0.0))
        };
        let (lo, hi) =
            (0..TIMES).filter_map(at).fold((f64::INFINITY, 0.0), |(lo, hi), p| (f64::min(lo, p), f64::max(hi, p)));
        (hi - lo).max(0.0)
    }
}
