//! Alignment by line numbers. In: log, timeline, slower machines. Out: [`Aligned`].
//!
//! Runs of equal line numbers are matched in order to the legs of the program (consecutive spots of one line). Between
//! two runs the boundary of their legs was passed between two samples: an observation of the drift of the log's clock,
//! with the variance of a uniform distribution (width²/12). The drift is smoothed ([`super::drift`]), so that many
//! boundaries place a sample more accurately than the two next to it. The acceleration of the machine is the one with
//! the most likely drift.

use crate::learn::align::drift::{Drift, Observation, drift};
use crate::learn::align::{Aligned, Method, median_uncertainty};
use crate::learn::log::Log;
use crate::learn::log::gaps::median_step;
use crate::learn::program::clock::{Clock, Slower};
use crate::learn::program::timeline::Timeline;
use crate::numeric::golden_section;

/// Least gain in log-likelihood of a slower machine over the declared one, nats. Judgement.
const SLOWER_GAIN_NATS: f64 = 10.0;
/// Least uncertainty of a sample, in sampling intervals.
const LEAST_STEPS: f64 = 0.02;
/// Most positions whose times are compared.
const MOST_PLACES: usize = 800;
/// Tolerance of the logarithm of the factor, as a share of the distance between the factors tried beside it.
const NARROW: f64 = 1e-3;

/// Aligns a log by its lines; `None` if it has none or they belong to no leg.
pub fn by_line(log: &Log, timeline: &Timeline, slower: &[Slower]) -> Option<Aligned> {
    let lines = log.line.as_ref()?;
    let legs = legs(timeline);
    let (runs, lost) = runs(lines, &legs);
    let walk = |factor: f64| {
        let clock = Clock::new(timeline, slower, factor);
        let seen = boundaries(log, &legs, &runs, &clock);
        drift(&seen).map(|drift| (clock, drift))
    };
    let (clock, drift, nats) = most_likely_acceleration(slower, &walk)?;
    let mut program_s = vec![f64::NAN; lines.len()];
    let placed = drift.program_s(&log.time_s);
    for run in &runs {
        let leg = &legs[run.leg];
        let [from, to] = [clock.starts[leg.from], clock.starts[leg.to]];
        for i in run.from..run.to {
            let beyond = leg.from == 0 && placed[i] < 0.0 || leg.to + 1 == clock.starts.len() && placed[i] > to;
            if !beyond {
                program_s[i] = clock.declared_s(timeline, placed[i].clamp(from, (to - 1e-6).max(from)));
            }
        }
    }
    let least_s = LEAST_STEPS * median_step(&log.time_s);
    let sample_uncertainty_s: Vec<f64> = drift.deviations_s(&placed).into_iter().map(|s| s.max(least_s)).collect();
    Some(Aligned {
        uncertainty_s: median_uncertainty(&program_s, &sample_uncertainty_s),
        program_s,
        method: Method::Line,
        sample_uncertainty_s,
        misfit: lost as f64 / lines.len().max(1) as f64,
        acceleration: (clock.factor < 1.0).then_some((clock.factor, nats)),
        pauses: drift.pauses.iter().filter(|p| p.1 > 0.0).map(|(t, length)| (drift.log_s(*t), *length)).collect(),
    })
}

/// Clock and drift of the most likely acceleration (the declared one unless another is clearly better), and the gain in
/// log-likelihood of the best over the declared one, nats.
pub fn most_likely_acceleration(
    slower: &[Slower],
    walk: &impl Fn(f64) -> Option<(Clock, Drift)>,
) -> Option<(Clock, Drift, f64)> {
    let declared = walk(1.0)?;
    let factors: Vec<f64> = std::iter::once(1.0).chain(slower.iter().map(|(f, _)| *f)).collect();
    let likelihood = |factor: f64| walk(factor).map_or(f64::NEG_INFINITY, |(_, d)| d.likelihood);
    let (best, _) = factors.iter().enumerate().map(|(k, f)| (k, likelihood(*f))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let [low, high] = [(best + 1).min(factors.len() - 1), best.saturating_sub(1)].map(|beside| factors[beside].ln());
    let (factor_log, _) = golden_section(|log| -likelihood(log.exp()), low, high, NARROW * (high - low));
    let found = walk(factor_log.exp())?;
    let nats = found.1.likelihood - declared.1.likelihood;
    let (clock, drift) = if nats > SLOWER_GAIN_NATS { found } else { declared };
    Some((clock, drift, nats))
}

/// Acceleration that the times between known positions show: (factor, nats) if it is clearly below the declared one.
pub fn acceleration_shown(log: &Log, program_s: &[f64], timeline: &Timeline, slower: &[Slower]) -> Option<(f64, f64)> {
    let moving = |i: &usize| timeline.at(program_s[*i]).is_some_and(|k| timeline.spots[k].move_id.is_some());
    let known: Vec<usize> = (0..program_s.len()).filter(moving).collect();
    let declared = Clock::new(timeline, slower, 1.0);
    let variance = (0.2 * median_step(&log.time_s)).powi(2);
    let places: Vec<(f64, (usize, f64))> = known
        .iter()
        .step_by(known.len().div_ceil(MOST_PLACES).max(1))
        .filter_map(|&i| Some((log.time_s[i], declared.place(program_s[i])?)))
        .collect();
    let walk = |factor: f64| {
        let clock = Clock::new(timeline, slower, factor);
        let seen = places.iter().map(|(t, place)| (t, clock.time(*place)));
        let seen: Vec<Observation> = seen.map(|(t, at_s)| Observation { at_s, drift_s: t - at_s, variance }).collect();
        drift(&seen).map(|d| (clock, d))
    };
    let (clock, _, nats) = most_likely_acceleration(slower, &walk)?;
    (clock.factor < 1.0).then_some((clock.factor, nats))
}

/// Consecutive spots of one line: from … to (exclusive).
struct Leg {
    line: u32,
    from: usize,
    to: usize,
}

/// Consecutive samples of one line, and their leg.
struct LineRun {
    from: usize,
    to: usize,
    leg: usize,
}

fn legs(timeline: &Timeline) -> Vec<Leg> {
    let mut legs: Vec<Leg> = Vec::new();
    for (k, spot) in timeline.spots.iter().enumerate() {
        match legs.last_mut() {
            Some(leg) if leg.line == spot.line => leg.to = k + 1,
            _ => legs.push(Leg { line: spot.line, from: k, to: k + 1 }),
        }
    }
    legs
}

/// Runs that belong to a leg, in order, and the number of samples that do not.
fn runs(lines: &[f64], legs: &[Leg]) -> (Vec<LineRun>, usize) {
    let (mut runs, mut next, mut from, mut lost) = (Vec::new(), 0, 0, 0);
    while from < lines.len() {
        let to = (from..lines.len()).find(|i| lines[*i] != lines[from]).unwrap_or(lines.len());
        match legs[next..].iter().position(|leg| f64::from(leg.line) == lines[from]) {
            Some(k) => {
                next += k;
                runs.push(LineRun { from, to, leg: next });
            }
            None => lost += to - from,
        }
        from = to;
    }
    (runs, lost)
}

/// Observations of the drift at the boundaries between consecutive runs.
fn boundaries(log: &Log, legs: &[Leg], runs: &[LineRun], clock: &Clock) -> Vec<Observation> {
    let between = |pair: &[LineRun]| {
        let (before, after) = (&pair[0], &pair[1]);
        let [lo, hi] = [log.time_s[before.to - 1], log.time_s[after.from]];
        let [end, start] = [clock.starts[legs[before.leg].to], clock.starts[legs[after.leg].from]];
        // Legs in between without a sample add to the uncertainty.
        let width = (hi - lo).powi(2) + (start - end).max(0.0).powi(2);
        let at_s = f64::midpoint(end, start);
        (after.leg > before.leg).then(|| Observation {
            at_s,
            drift_s: f64::midpoint(lo, hi) - at_s,
            variance: width / 12.0,
        })
    };
    runs.windows(2).filter_map(between).collect()
}
