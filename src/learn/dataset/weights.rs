//! Weights of the samples of a log. In: samples placed in the program. Out: a weight for each, 1 for a reliable one;
//! cells of samples that are all reliable or all doubtful.
//!
//! The weight is 1/(1 + (e/σ)²), with σ the noise of neighbouring samples and e the error of the load, predicted or
//! measured, that an error of the alignment within its uncertainty at that sample causes. While the spindle changes its
//! speed, the power that its mass and drive take is unknown; there e is the range of the readings.

use crate::force::contact::Engaged;
use crate::learn::dataset::placed_log::PlacedLog;
use crate::learn::dataset::samples::{Base, Class};
use crate::learn::log::quantity::Quantity;
use crate::learn::program::timeline::{Activity, Spot};
use crate::learn::program::variant::{OtherGeometry, Variant};
use crate::learn::regress::statistics::median;

/// Largest weight of samples during run-ups and tool changes. Judgement, like the other constants here.
const RUN_UP_WEIGHT: f64 = 1e-3;
/// Time before and after a change of spindle speed in which readings are doubtful, s.
const SETTLING_S: f64 = 0.35;
/// Relative difference of readings of the same spindle speed.
const SAME_SPEED: f64 = 0.02;
/// Time before and after a sample in which the range of the load is taken, in standard uncertainties of the alignment.
const DOUBT: f64 = 2.5;

impl PlacedLog<'_> {
    /// Load of each spot by the declared coefficients in the declared geometry and in the first of each kind of other ones, for weights
    /// only: what was found, or else a usual size.
    pub(in crate::learn) fn rough_loads(&self, quantity: Option<Quantity>, base: &[Base]) -> Vec<Vec<f64>> {
        let value = |b: &Base| b.prior.map_or(if b.class == Class::Tare { 0.0 } else { 1.0 }, |(mean, _)| mean);
        let load = |spot: &Spot, engaged: &Engaged| -> f64 {
            base.iter().map(|b| Self::column(&b.name, quantity, spot.rps, spot, engaged) * value(b)).sum()
        };
        let spots = &self.known.timeline.spots;
        let declared = spots.iter().map(|spot| load(spot, &spot.engaged)).collect();
        let other = |o: &OtherGeometry| spots.iter().zip(&o.engaged).map(|(spot, e)| load(spot, e)).collect();
        let others = &self.known.others;
        // A turn moves the ends of the faces by as much as faces that stand out, which are among them.
        let is_first = |k: &usize| {
            let variant = others[*k].variant;
            variant != Variant::StockTurn && others[..*k].iter().all(|before| before.variant != variant)
        };
        std::iter::once(declared).chain((0..others.len()).filter(is_first).map(|k| other(&others[k]))).collect()
    }

    /// Does the spindle change its speed within [`SETTLING_S`] of this sample?
    fn speed_settles(&self, i: usize) -> bool {
        let last = self.spot.len() - 1;
        let near = |k: &usize| (self.log.time_s[*k] - self.log.time_s[i]).abs() <= SETTLING_S;
        let before = (0..i).rev().take_while(near);
        let around =
            before.chain([i]).chain((i + 1..=last).take_while(near)).chain([i.saturating_sub(1), (i + 1).min(last)]);
        let own = self.spot[i].map_or(0.0, |s| self.rps(i, &self.known.timeline.spots[s]));
        around.into_iter().any(|k| {
            let Some(s) = self.spot[k] else { return false };
            let spot = &self.known.timeline.spots[s];
            matches!(spot.activity, Activity::RunUp | Activity::ToolChange)
                || (self.rps(k, spot) - own).abs() > SAME_SPEED * own
        })
    }

    /// Variance of the predicted load of a cell whose readings have these weights, over the variance of their mean:
    /// infinite while the spindle changes its speed; 0 just after that, when low weights are not due to the load.
    pub(in crate::learn) fn load_variance(&self, last: usize, weights: &[f64]) -> f64 {
        let spot = |k: usize| self.spot[k].map(|s| &self.known.timeline.spots[s]);
        let rps = |k: usize| spot(k).map_or(0.0, |spot| self.rps(k, spot));
        let before = last.saturating_sub(1);
        let turns_up = |k: usize| spot(k).is_some_and(|s| matches!(s.activity, Activity::RunUp | Activity::ToolChange));
        if turns_up(last) || turns_up(before) || (rps(last) - rps(before)).abs() > SAME_SPEED * rps(before) {
            return f64::INFINITY;
        }
        if self.speed_settles(last) {
            return 0.0;
        }
        // A sample of weight 1/(1 + (e/σ)²) has the load error e, which neighbours share; their noise is independent.
        weights.iter().map(|weight| 1.0 / weight - 1.0).sum()
    }

    /// Weights of the `valid` samples of `values`.
    pub(in crate::learn) fn weights(&self, valid: &[usize], values: &[f64], loads: &[Vec<f64>]) -> Vec<f64> {
        let sigma = noise(valid, values);
        let axes = self.axes_shown(valid, values);
        let settles: Vec<(usize, bool)> = valid.iter().map(|&i| (i, self.speed_settles(i))).collect();
        let measured = self.measured_spreads(valid, values);
        let mut next = 0;
        let of_stretch = |stretch: &[(usize, bool)]| -> Vec<f64> {
            let measured = &measured[next..next + stretch.len()];
            next += stretch.len();
            if !stretch[0].1 {
                let of_axes = |i: usize| self.axes_spread(i, DOUBT * self.aligned.sample_uncertainty_s[i], axes);
                let spread = |i: usize, measured: f64| self.predicted_spread(i, loads).max(of_axes(i)).max(measured);
                let each = stretch.iter().zip(measured);
                return each.map(|((i, _), m)| weight_of(0.5 * spread(*i, *m), sigma)).collect();
            }
            let bounds = (f64::INFINITY, f64::NEG_INFINITY);
            let (lo, hi) = stretch.iter().fold(bounds, |(lo, hi), (i, _)| (lo.min(values[*i]), hi.max(values[*i])));
            vec![RUN_UP_WEIGHT.min(weight_of(hi - lo, sigma)); stretch.len()]
        };
        settles.chunk_by(|a, b| a.1 == b.1).flat_map(of_stretch).collect()
    }

    /// Range of the readings within [`DOUBT`] of each, with linear interpolation between neighbours. Readings within
    /// half of that time are averaged first, so that their noise does not count.
    fn measured_spreads(&self, valid: &[usize], values: &[f64]) -> Vec<f64> {
        let about = |k: usize| DOUBT * self.aligned.sample_uncertainty_s[valid[k]];
        let time = |k: usize| self.log.time_s[valid[k]];
        let mut groups: Vec<(f64, f64, usize, f64)> = Vec::new();
        let mut first = 0;
        while first < valid.len() {
            let within = 0.5 * about(first);
            let near = (first + 1..valid.len()).take_while(|k| time(*k) - time(first) < within).count();
            let members = &valid[first..=first + near];
            let mean = |of: &[f64]| members.iter().map(|i| of[*i]).sum::<f64>() / members.len() as f64;
            groups.push((
                mean(&self.log.time_s),
                mean(values),
                members.len(),
                DOUBT * mean(&self.aligned.sample_uncertainty_s),
            ));
            first += near + 1;
        }
        let step = |k: usize, other: Option<&(f64, f64, usize, f64)>| {
            let Some((at_s, value, ..)) = other else { return 0.0 };
            let apart_s = (at_s - groups[k].0).abs().max(1e-9);
            (value - groups[k].1) * (groups[k].3 / apart_s).min(1.0)
        };
        let spread = |k: usize| {
            let (before, after) = (step(k, groups[..k].last()), step(k, groups.get(k + 1)));
            before.max(after).max(0.0) - before.min(after).min(0.0)
        };
        (0..groups.len()).flat_map(|k| std::iter::repeat_n(spread(k), groups[k].2)).collect()
    }

    /// Range of the predicted loads within [`DOUBT`] of a sample, in the geometry in which it is largest.
    fn predicted_spread(&self, i: usize, loads: &[Vec<f64>]) -> f64 {
        let (at, about) = (self.aligned.program_s[i], DOUBT * self.aligned.sample_uncertainty_s[i]);
        let end_s = self.known.timeline.total_s();
        let [first, own, last] = [at - about, at, at + about].map(|t| self.spot_shares(t.clamp(0.0, end_s)));
        let [from, to] = [first[0].0, last[0].0];
        let spread = |load: &Vec<f64>| {
            let between = |about: &[(usize, f64); 2]| about.iter().map(|(k, share)| share * load[*k]).sum::<f64>();
            let whole = load[(from + 1).min(to)..to.max(from)].iter().copied();
            let near = [&first, &own, &last].map(between).into_iter().chain(whole);
            let (lo, hi) = near.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
            hi - lo
        };
        loads.iter().map(spread).fold(0.0, f64::max)
    }
}

/// 1/(1 + (e/σ)²).
fn weight_of(error: f64, sigma: f64) -> f64 {
    1.0 / (1.0 + (error / sigma).powi(2))
}

/// Number of samples in each cell: neighbours that are all reliable or all doubtful, at most as many as about `count`
/// cells need.
pub(in crate::learn) fn cell_sizes(weights: &[f64], count: usize) -> Vec<usize> {
    let most = weights.len().div_ceil(count).max(1);
    let sure = |weight: &f64| *weight > 0.5;
    let stretches = weights.chunk_by(|a, b| sure(a) == sure(b)).map(<[f64]>::len);
    stretches.flat_map(|n| std::iter::repeat_n(most, n / most).chain((n % most > 0).then_some(n % most))).collect()
}

/// Noise from neighbouring samples: median |difference| / (0.6745·√2).
fn noise(valid: &[usize], values: &[f64]) -> f64 {
    let steps: Vec<f64> = valid.windows(2).map(|p| (values[p[1]] - values[p[0]]).abs()).collect();
    (median(&steps) / 0.954).max(1e-9)
}
