//! Drift of the clock of a log against the clock of its program.
//!
//! In: observations of the drift d = log time − program time, each at a program time T with a variance. Out: the
//! smoothed drift with its variance at each of them, pauses, and the likelihood.
//!
//! d is a random walk with variance q per second of the program, estimated by a Kalman filter with Rauch–Tung–Striebel
//! smoothing (Rauch, Tung and Striebel 1965); q is the most likely of a few values. An observation more than [`JUMP`]
//! standard deviations off with which the next ones agree is a pause: there the walk starts again. A single one is an
//! outlier and left out.

/// One observation of the drift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// Program time, s.
    pub at_s: f64,
    /// Log time minus program time, s.
    pub drift_s: f64,
    /// Its variance, s².
    pub variance: f64,
}

/// The smoothed drift.
#[derive(Debug, Clone, Default)]
pub struct Drift {
    /// Program times, s, rising.
    pub at_s: Vec<f64>,
    /// Drift there, s.
    pub drift_s: Vec<f64>,
    /// Its standard deviation, s.
    pub deviation_s: Vec<f64>,
    /// Pauses: (program time, length), s.
    pub pauses: Vec<(f64, f64)>,
    /// Log-likelihood of the observations.
    pub likelihood: f64,
    /// Local variance of the walk at each of them, s² per second of the program; see [`walks`].
    pub walk: Vec<f64>,
}

/// Standard deviations from which an observation is an outlier or a pause. Judgement.
const JUMP: f64 = 6.0;
/// Values of √q that are tried, s per √s.
const WALKS: [f64; 11] = [0.0005, 0.001, 0.002, 0.0035, 0.006, 0.011, 0.02, 0.035, 0.06, 0.11, 0.2];

/// Observations on either side over which the local variance of the walk is averaged.
const ABOUT: usize = 4;

/// Most likely drift; `None` without observations.
pub fn drift(seen: &[Observation]) -> Option<Drift> {
    let smoothed = WALKS.iter().filter_map(|walk| smooth(seen, walk * walk));
    smoothed.max_by(|a, b| a.likelihood.total_cmp(&b.likelihood))
}

impl Drift {
    /// Log time at which a program time is reached.
    pub fn log_s(&self, program_s: f64) -> f64 {
        program_s + interpolated(&self.at_s, &self.drift_s, program_s)
    }

    /// Program time at each of the rising log times.
    pub fn program_s(&self, log_s: &[f64]) -> Vec<f64> {
        let mut reached: Vec<f64> = self.at_s.iter().zip(&self.drift_s).map(|(t, d)| t + d).collect();
        for k in 1..reached.len() {
            reached[k] = reached[k].max(reached[k - 1] + 1e-9);
        }
        let (first, last) = (0, reached.len() - 1);
        let place = |t: &f64| {
            if *t <= reached[first] {
                self.at_s[first] + t - reached[first]
            } else if *t >= reached[last] {
                self.at_s[last] + t - reached[last]
            } else {
                interpolated(&reached, &self.at_s, *t)
            }
        };
        log_s.iter().map(place).collect()
    }

    /// Standard deviation of the drift at program times: that of the nearest observations, and the variance of the walk
    /// since then. For NaN times the root mean square over all observations.
    pub fn deviations_s(&self, program_s: &[f64]) -> Vec<f64> {
        let whole = self.uncertainty_s();
        let of = |t: &f64| if t.is_finite() { self.deviation_at(*t) } else { whole };
        program_s.iter().map(of).collect()
    }

    fn deviation_at(&self, program_s: f64) -> f64 {
        let k = self.at_s.partition_point(|t| *t <= program_s);
        let (before, after) =
            (k.checked_sub(1).map(|k| program_s - self.at_s[k]), self.at_s.get(k).map(|t| t - program_s));
        let alone_s = match (before, after) {
            (Some(before), Some(after)) => before * after / (before + after).max(1e-12),
            (one, other) => one.or(other).unwrap_or(0.0),
        };
        interpolated(&self.at_s, &self.deviation_s, program_s)
            .hypot((interpolated(&self.at_s, &self.walk, program_s) * alone_s).sqrt())
    }

    /// Root mean square of the deviations.
    pub fn uncertainty_s(&self) -> f64 {
        let n = self.deviation_s.len().max(1) as f64;
        (self.deviation_s.iter().map(|s| s * s).sum::<f64>() / n).sqrt()
    }
}

/// Linear between the points, constant beyond them.
pub fn interpolated(x: &[f64], y: &[f64], at: f64) -> f64 {
    let k = x.partition_point(|v| *v <= at);
    if k == 0 || k == x.len() {
        return y[k.min(x.len() - 1)];
    }
    let t = (at - x[k - 1]) / (x[k] - x[k - 1]).max(1e-12);
    y[k - 1] + t * (y[k] - y[k - 1])
}

/// State of the filter at one observation: before and after it, mean and variance.
#[derive(Clone, Copy)]
struct Step {
    ahead: [f64; 2],
    after: [f64; 2],
    begins: bool,
}

fn smooth(seen: &[Observation], q: f64) -> Option<Drift> {
    let first = seen.first()?;
    let mut steps: Vec<Step> = Vec::with_capacity(seen.len());
    let (mut likelihood, mut pauses) = (0.0, Vec::new());
    let mut state = [first.drift_s, first.variance];
    for (k, each) in seen.iter().enumerate() {
        let gap = if k == 0 { 0.0 } else { (each.at_s - seen[k - 1].at_s).max(0.0) };
        let ahead = [state[0], state[1] + q * gap];
        let (off, spread) = (each.drift_s - ahead[0], ahead[1] + each.variance);
        let far = k > 0 && off * off > JUMP * JUMP * spread;
        let stays = far && persists(seen, k, ahead[0]);
        state = if stays {
            pauses.push((each.at_s, off));
            [each.drift_s, each.variance]
        } else if far {
            ahead
        } else {
            let gain = if k == 0 { 0.0 } else { ahead[1] / spread };
            [ahead[0] + gain * off, ahead[1] * (1.0 - gain)]
        };
        likelihood -= 0.5 * ((off * off / spread).min(JUMP * JUMP) + spread.ln());
        steps.push(Step { ahead, after: state, begins: stays });
    }
    let (mut drift_s, mut deviation_s) = (vec![0.0; seen.len()], vec![0.0; seen.len()]);
    let mut next = steps[steps.len() - 1].after;
    for k in (0..steps.len()).rev() {
        if k + 1 < steps.len() {
            let (own, ahead) = (steps[k].after, steps[k + 1].ahead);
            next = if steps[k + 1].begins {
                own
            } else {
                let gain = own[1] / ahead[1].max(1e-18);
                [own[0] + gain * (next[0] - ahead[0]), own[1] + gain * gain * (next[1] - ahead[1])]
            };
        }
        drift_s[k] = next[0];
        deviation_s[k] = next[1].max(0.0).sqrt();
    }
    let at_s: Vec<f64> = seen.iter().map(|s| s.at_s).collect();
    let walk = walks(&at_s, &drift_s, q);
    Some(Drift { at_s, drift_s, deviation_s, pauses, likelihood, walk })
}

/// Local variance q of the walk per second at each observation, at most that of the whole. Between two neighbours a and
/// b seconds away the squared deviation of a walk from the straight line has the mean q a b/(a + b); averaged over
/// [`ABOUT`] observations on either side.
fn walks(at_s: &[f64], drift_s: &[f64], whole: f64) -> Vec<f64> {
    let own = |k: usize| {
        let (a, b) = ((at_s[k] - at_s[k - 1]).max(1e-6), (at_s[k + 1] - at_s[k]).max(1e-6));
        let off = drift_s[k] - (b * drift_s[k - 1] + a * drift_s[k + 1]) / (a + b);
        off * off * (a + b) / (a * b)
    };
    let inner: Vec<f64> = (1..at_s.len().saturating_sub(1)).map(own).collect();
    let about = |k: usize| {
        let near = &inner[k.saturating_sub(ABOUT + 1).min(inner.len())..(k + ABOUT).min(inner.len())];
        if near.is_empty() { whole } else { (near.iter().sum::<f64>() / near.len() as f64).min(whole) }
    };
    (0..at_s.len()).map(about).collect()
}

/// Do the next observations agree with this one rather than with the expected drift?
fn persists(seen: &[Observation], k: usize, expected: f64) -> bool {
    let after = &seen[k + 1..(k + 5).min(seen.len())];
    let nearer = |s: &&Observation| (s.drift_s - seen[k].drift_s).abs() < (s.drift_s - expected).abs();
    after.len() >= 2 && after.iter().filter(nearer).count() * 4 >= after.len() * 3
}

#[cfg(test)]
mod tests {
    use super::*;

    fn observed(n: usize, drift: impl Fn(f64) -> f64) -> Vec<Observation> {
        let noise = |k: usize| 0.03 * (((k * 7919) % 101) as f64 / 50.0 - 1.0);
        let at = |k: usize| 1.5 * k as f64;
        (0..n).map(|k| Observation { at_s: at(k), drift_s: drift(at(k)) + noise(k), variance: 3e-4 }).collect()
    }

    #[test]
    fn a_constant_drift_is_known_better_than_any_observation() {
        let found = drift(&observed(100, |_| 2.5)).unwrap();
        assert!(found.drift_s.iter().all(|d| (d - 2.5).abs() < 0.01), "{:?}", found.drift_s);
        assert!(found.uncertainty_s() < 0.01 && found.pauses.is_empty());
    }

    #[test]
    fn a_pause_is_found_where_it_is_and_a_stretch_is_followed() {
        let found = drift(&observed(100, |t| 2.5 + 0.01 * t + if t > 70.0 { 4.0 } else { 0.0 })).unwrap();
        assert_eq!(found.pauses.len(), 1);
        let (at, length) = found.pauses[0];
        assert!((at - 70.5).abs() < 1.0 && (length - 4.0).abs() < 0.1, "{:?}", found.pauses);
        assert!((found.log_s(60.0) - 63.1).abs() < 0.03 && (found.log_s(120.0) - 127.7).abs() < 0.03);
        let back = found.program_s(&[found.log_s(60.0), found.log_s(120.0)]);
        assert!((back[0] - 60.0).abs() < 1e-6 && (back[1] - 120.0).abs() < 1e-6);
    }

    #[test]
    fn it_is_less_certain_far_from_observations() {
        let seen: Vec<Observation> = observed(100, |t| 2.5 + 0.02 * (0.3 * t).sin())
            .into_iter()
            .enumerate()
            .filter(|(k, _)| !(40..70).contains(k))
            .map(|(_, s)| s)
            .collect();
        let found = drift(&seen).unwrap();
        let [amid, at_gap] = [30.0, 59.0].map(|t| found.deviations_s(&[t])[0]);
        assert!(at_gap > 1.2 * amid, "{amid} {at_gap}");
        assert_eq!(found.deviations_s(&[f64::NAN]), [found.uncertainty_s()]);
    }

    /// A clock with a random walk of 0.02 s per √s, observed every 6 s.
    #[test]
    fn between_observations_it_is_as_uncertain_as_the_clock_walks() {
        let mut chance = crate::learn::regress::random::Chance::new(3);
        let mut normal = || (0..12).map(|_| chance.unit()).sum::<f64>() - 6.0;
        let (mut truth, mut now) = (Vec::new(), 1.0);
        for _ in 0..6000 {
            truth.push(now);
            now += 0.02 * 0.5f64.sqrt() * normal();
        }
        let observe = |k: usize| Observation { at_s: 0.5 * k as f64, drift_s: truth[k], variance: 1e-6 };
        let found = drift(&(0..truth.len()).step_by(12).map(observe).collect::<Vec<_>>()).unwrap();
        let times: Vec<f64> = (0..truth.len() - 12).map(|k| 0.5 * k as f64).collect();
        let stated = found.deviations_s(&times);
        let of_stated =
            |(k, s): (usize, &f64)| (interpolated(&found.at_s, &found.drift_s, times[k]) - truth[k]).abs() / s;
        let off: Vec<f64> = stated.iter().enumerate().map(of_stated).collect();
        let within = |by: f64| off.iter().filter(|e| **e <= by).count() as f64 / off.len() as f64;
        assert!(
            (within(1.0) - 0.68).abs() < 0.08 && (within(2.0) - 0.95).abs() < 0.04,
            "{} {}",
            within(1.0),
            within(2.0)
        );
    }

    #[test]
    fn one_wrong_observation_moves_nothing() {
        let mut seen = observed(60, |_| 1.0);
        seen[30].drift_s = 9.0;
        let found = drift(&seen).unwrap();
        assert!(found.pauses.is_empty() && found.drift_s.iter().all(|d| (d - 1.0).abs() < 0.03));
    }
}
