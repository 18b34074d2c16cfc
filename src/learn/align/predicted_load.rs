//! The predicted load of a program over time, in parts whose factors are fitted to a log. In: timeline, job, other
//! geometries, the clock of a machine, a lag. Out: [`PredictedLoad`], means over the span of a reading, on a grid of
//! time.

use crate::force::contact::Engaged;
use crate::learn::program::clock::Clock;
use crate::learn::program::declared::declared_or_aluminium;
use crate::learn::program::simulated::ProgramView;
use crate::learn::program::timeline::{Activity, Timeline};
use crate::machine::Job;
use crate::machine::material::LinearEdge;
use crate::units::watts_from_n_mm_s;

/// Number of parts of a load: tare, cutting, edge, run-up; changes by other geometries; an increase after entries.
pub(in crate::learn) const PARTS: usize = 8;
/// The first four, which every load has.
const CERTAIN: usize = 4;
/// Factors on the parts before they are fitted.
const BEFORE_FIT: [f64; PARTS] = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
/// Path after an entry over which the load may be increased, mm. Judgement.
const ENTRY_MM: f64 = 10.0;

/// Parts of one spot: the four certain ones; of each other part, cutting per mm/s of feed and edge.
pub(in crate::learn) type Part = ([f64; CERTAIN], [[f64; 2]; PARTS - CERTAIN]);

/// Adds the changes by other geometries, and an increase after entries: the load itself, falling linearly to 0 over
/// [`ENTRY_MM`].
pub(in crate::learn) fn with_uncertain_parts(parts: &mut [Part], known: &ProgramView) {
    let mut since_mm = 0.0;
    for (k, (spot, (sure, more))) in known.timeline.spots.iter().zip(parts.iter_mut()).enumerate() {
        let Some(coefficients) = known.job.tool(spot.tool).map(|tool| declared_or_aluminium(known.job, tool)) else {
            continue;
        };
        let declared = of_cut(&coefficients, &spot.engaged, spot.rps);
        for (slot, other) in more.iter_mut().zip(known.others.iter().take(PARTS - CERTAIN - 1)) {
            let changed = of_cut(&coefficients, &other.engaged[k], spot.rps);
            *slot = [0, 1].map(|i| (changed[i] - declared[i]) / other.size);
        }
        let left = (1.0 - since_mm / ENTRY_MM).max(0.0);
        more[PARTS - CERTAIN - 1] = [sure[1] * left, sure[2] * left];
        since_mm = if spot.engaged.section_mm2 > 1e-6 { since_mm + spot.length_mm } else { 0.0 };
    }
}

/// Power of a cut, W: cutting per mm/s of feed, and edge.
fn of_cut(k: &LinearEdge, e: &Engaged, rps: f64) -> [f64; 2] {
    [watts_from_n_mm_s(k.k_tc) * e.section_mm2, watts_from_n_mm_s(k.k_te) * e.contact_mm2 * rps]
}

/// Parts of the load of every spot by the declared coefficients: tare, cutting per mm/s, edge, and the power that
/// accelerates the spindle at the end of its run-up (in units of the tare).
pub(in crate::learn) fn parts(timeline: &Timeline, job: &Job, force: bool) -> Vec<Part> {
    let none = [[0.0; 2]; PARTS - CERTAIN];
    timeline
        .spots
        .iter()
        .map(|spot| {
            let Some(tool) = job.tool(spot.tool) else { return ([0.0; CERTAIN], none) };
            let k = declared_or_aluminium(job, tool);
            let e = &spot.engaged;
            if force {
                let [tc, rc, te, re] = e.peak;
                let cutting = (tc * k.k_tc + rc * k.k_rc) / spot.speed_mm_s().max(1e-9);
                return ([0.0, cutting, te * k.k_te + re * k.k_re, 0.0], none);
            }
            let tare = if spot.rps > 0.0 { job.machine.spindle.tare_w.at(spot.rps).max(1.0) } else { 0.0 };
            let running = if spot.activity == Activity::RunUp { 1.0 } else { 0.0 };
            let [cutting, edge] = of_cut(&k, e, spot.rps);
            ([tare, cutting, edge, running * tare], none)
        })
        .collect()
}

/// The parts of the predicted load over program time.
pub(in crate::learn) struct PredictedLoad {
    step_s: f64,
    pub(in crate::learn) parts: [Vec<f64>; PARTS],
}

impl PredictedLoad {
    pub(in crate::learn) fn new(timeline: &Timeline, clock: &Clock, parts: &[Part], lag_s: f64, span_s: f64) -> Self {
        let step_s = f64::max(0.02, clock.total_s() / 200_000.0);
        let count = (clock.total_s() / step_s) as usize + 1;
        let mut out: [Vec<f64>; PARTS] = std::array::from_fn(|_| Vec::with_capacity(count));
        let keep = (-step_s / lag_s.max(1e-9)).exp();
        let (mut k, mut level) = (0, [0.0; PARTS]);
        for i in 0..count {
            let t = (i as f64 + 0.5) * step_s;
            while k + 1 < parts.len() && clock.starts[k + 1] < t {
                k += 1;
            }
            let speed = timeline.spots[k].length_mm / (clock.starts[k + 1] - clock.starts[k]).max(1e-9);
            let share = (t - clock.starts[k]) / (clock.starts[k + 1] - clock.starts[k]).max(1e-9);
            let turning = if timeline.spots[k].activity == Activity::RunUp { share.clamp(0.0, 1.0) } else { 1.0 };
            let ([tare, cutting, edge, run_up], more) = parts[k];
            let mut now = [0.0; PARTS];
            now[..CERTAIN].copy_from_slice(&[tare * turning, cutting * speed, edge, run_up * turning]);
            now[CERTAIN..].iter_mut().zip(more).for_each(|(n, [cutting, edge])| *n = cutting * speed + edge);
            for b in 0..PARTS {
                level[b] = if lag_s > 0.0 { now[b] + keep * (level[b] - now[b]) } else { now[b] };
                out[b].push(level[b]);
            }
        }
        for part in &mut out {
            smooth(part, span_s / step_s);
        }
        Self { step_s, parts: out }
    }

    /// The sum of the parts with these factors.
    pub(in crate::learn) fn with(&self, factors: [f64; PARTS]) -> FittedLoad {
        let sum = |k: usize| (0..PARTS).map(|b| factors[b] * self.parts[b][k]).sum();
        FittedLoad { step_s: self.step_s, load: (0..self.parts[0].len()).map(sum).collect() }
    }

    /// The sum before a fit: tare, cutting and edge by the declared coefficients.
    pub(in crate::learn) fn before_fit(&self) -> FittedLoad {
        self.with(BEFORE_FIT)
    }

    /// Every part at a time, linear between the middles of the steps, 0 outside the program.
    pub(in crate::learn) fn at(&self, t: f64) -> [f64; PARTS] {
        let Some(between) = between(self.parts[0].len(), self.step_s, t) else { return [0.0; PARTS] };
        std::array::from_fn(|b| linear(&self.parts[b], between))
    }
}

/// A load over program time.
pub(in crate::learn) struct FittedLoad {
    step_s: f64,
    load: Vec<f64>,
}

impl FittedLoad {
    /// The load at a time, linear between the middles of the steps, 0 outside the program.
    pub(in crate::learn) fn at(&self, t: f64) -> f64 {
        between(self.load.len(), self.step_s, t).map_or(0.0, |place| linear(&self.load, place))
    }

    /// Change per second over `width` seconds.
    pub(in crate::learn) fn slope(&self, t: f64, width: f64) -> f64 {
        (self.at(t + 0.5 * width) - self.at(t - 0.5 * width)) / width
    }

    /// Means over the steps of a grid.
    pub(in crate::learn) fn on_grid(&self, total_s: f64, step_s: f64) -> Vec<f64> {
        (0..(total_s / step_s) as usize).map(|i| self.mean((i as f64 + 0.5) * step_s, step_s)).collect()
    }

    /// Mean over `width` seconds.
    pub(in crate::learn) fn mean(&self, t: f64, width: f64) -> f64 {
        (-2..=2).map(|k| self.at(t + width * f64::from(k) / 5.0)).sum::<f64>() / 5.0
    }
}

/// Of `count` steps the two whose middles a time lies between, and the share of the way; `None` outside the program.
fn between(count: usize, step_s: f64, t: f64) -> Option<(usize, usize, f64)> {
    let at = t / step_s;
    if at < 0.0 || at >= count as f64 {
        return None;
    }
    let past = (at - 0.5).max(0.0);
    let k = past as usize;
    Some((k, (k + 1).min(count - 1), past - k as f64))
}

fn linear(values: &[f64], (k, next, share): (usize, usize, f64)) -> f64 {
    values[k] + share * (values[next] - values[k])
}

/// Running mean over `width` steps about the middle of each.
fn smooth(values: &mut [f64], width: f64) {
    if width <= 1.0 {
        return;
    }
    let mut sums = vec![0.0; values.len() + 1];
    for (k, v) in values.iter().enumerate() {
        sums[k + 1] = sums[k] + v;
    }
    let before = |at: f64| {
        let k = (at as usize).min(sums.len() - 2);
        sums[k] + (at - k as f64) * (sums[k + 1] - sums[k])
    };
    for (k, value) in values.iter_mut().enumerate() {
        let middle = k as f64 + 0.5;
        let (from, to) = ((middle - 0.5 * width).max(0.0), (middle + 0.5 * width).min(sums.len() as f64 - 1.0));
        *value = (before(to) - before(from)) / (to - from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The running mean of a linear rise is the rise itself.
    #[test]
    fn a_mean_over_any_width_stays_about_its_middle() {
        for width in [1.5, 2.0, 3.0, 4.35, 6.0] {
            let mut rise: Vec<f64> = (0..40).map(f64::from).collect();
            smooth(&mut rise, width);
            assert!((4..36).all(|k| (rise[k] - k as f64).abs() < 1e-9), "{width}: {rise:?}");
        }
    }

    #[test]
    fn a_load_is_read_between_the_middles_of_its_steps() {
        let rise: Vec<f64> = (0..50).map(|k| 0.02 * (f64::from(k) + 0.5)).collect();
        let parts: [Vec<f64>; PARTS] = std::array::from_fn(|_| rise.clone());
        let predicted = PredictedLoad { step_s: 0.02, parts };
        for t in [0.01, 0.153, 0.5, 0.985] {
            assert!((predicted.at(t)[0] - t).abs() < 1e-12, "{t}: {}", predicted.at(t)[0]);
            assert!((predicted.before_fit().at(t) - 3.0 * t).abs() < 1e-12, "three parts count before a fit");
        }
        assert_eq!([-0.001, 1.0].map(|t| predicted.at(t)[0]), [0.0, 0.0]);
    }
}
