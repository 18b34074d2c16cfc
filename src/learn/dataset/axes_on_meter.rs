//! What the drives of the axes add to a spindle reading, where the meter measures them too. In: samples laid along the
//! program, those in air. Out: factors on the speed v and on v·max(0, a), a the acceleration; and how far what they add
//! changes within the uncertainty of where each sample belongs.
//!
//! A rapid takes some tenths of a second and begins and ends at rest, so what it adds rises and falls within hundredths
//! of a second: a sample placed wrong by that much is off by all of it. Where the meter does not measure the axes, both
//! factors are nearly 0.

use crate::learn::align::Method;
use crate::learn::dataset::placed_log::PlacedLog;
use crate::learn::program::motion::motion;
use crate::learn::program::timeline::Activity;
use crate::learn::regress::linear::{Loss, robust};
use nalgebra::DMatrix;

/// Fewest readings in rapids that say what the axes take.
const FEWEST: usize = 10;
/// Times that are looked at within the doubt of a sample.
const TIMES: usize = 9;

impl PlacedLog<'_> {
    /// Factors on the speed along the path and on v·max(0, a) that the readings in air show; none is negative.
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
        // With a lag what is left of a cut is in the reading before as well; the axes are not.
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

    /// Range of what the axes take over the times at which a sample may have been taken.
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
