//! Alignment by line numbers. In: log, timeline, slower machines. Out: [`Aligned`].
//!
//! Runs of equal line numbers are matched in order to the legs of the program (consecutive spots of one line). Between
//! two runs the boundary of their legs was passed between two samples: an observation of the drift of the log's clock,
//! with the variance of a uniform distribution (width²/12). The drift is smoothed ([`super::drift`]), so that many
//! boundaries place a sample more accurately than the two next to it. The acceleration of the machine is the one with
//! the most likely drift.

use crate::learn::align::drift::{Drift, Observation, drift};
use crate::learn::align::holds::Holds;
use crate::learn::align::{Aligned, Method, median_uncertainty};
use crate::learn::log::Log;
use crate::learn::log::gaps::median_step;
use crate::learn::program::clock::{Clock, Slower};
use crate::learn::program::timeline::Timeline;
use crate::learn::regress::statistics::median;
use crate::numeric::golden_section;

/// Least gain in log-likelihood of a slower machine over the declared one, nats. Judgement.
const SLOWER_GAIN_NATS: f64 = 10.0;
/// Shortest hold, s, and standard deviations by which a run has to be too long or too short. Judgement.
const SHORTEST_HOLD_S: f64 = 1.5;
const SURE: f64 = 6.0;
/// Share of the load of the cut that has to be gone in a hold. Judgement.
const GONE: f64 = 0.5;
/// Time over which the lengths of runs show the feed, s, and its least deviation from the predicted one. Judgement, as for the feeds that are
/// listed.
const FEED_SPAN_S: f64 = 4.0;
const LEAST_OFF: f64 = 0.05;
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
    let declared = Clock::new(timeline, slower, 1.0);
    let holds = Holds(holds_in_runs(log, &timed_runs(&log.time_s, &legs, &runs, &declared)));
    // The clock of the log without the holds.
    let running: Vec<f64> = log.time_s.iter().map(|time| holds.running_s(*time)).collect();
    let walk = |factor: f64| {
        let clock = Clock::new(timeline, slower, factor);
        let seen = boundaries(&running, &legs, &runs, &clock);
        drift(&seen).map(|drift| (clock, drift))
    };
    let (clock, _, nats) = most_likely_acceleration(slower, &walk)?;
    let ratios = feed_ratios(&timed_runs(&running, &legs, &runs, &clock), lines.len());
    // The same at the predicted feed: what is left of the drift is that of the clocks.
    let running = at_predicted_feed(&running, &ratios);
    let drift = drift(&boundaries(&running, &legs, &runs, &clock))?;
    let mut program_s = vec![f64::NAN; lines.len()];
    let placed = drift.program_s(&running);
    for run in &runs {
        let leg = &legs[run.leg];
        let [from, to] = [clock.starts[leg.from], clock.starts[leg.to]];
        for i in run.from..run.to {
            let beyond = leg.from == 0 && placed[i] < 0.0 || leg.to + 1 == clock.starts.len() && placed[i] > to;
            if !beyond && !holds.holds(log.time_s[i]) {
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
        read_later_s: 0.0,
        acceleration: (clock.factor < 1.0).then_some((clock.factor, nats)),
        feed_ratio: Some(ratios),
        holds: holds.0.clone(),
        pauses: pauses(log, &holds, &drift, &placed),
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

/// A run between two boundaries that were both passed between two of its samples and the next.
struct TimedRun {
    /// Its samples: from … to (exclusive).
    samples: [usize; 2],
    /// When it began and ended, s.
    times_s: [f64; 2],
    /// Standard deviation of its length, s.
    deviation_s: f64,
    /// How long the program takes for it, s.
    planned_s: f64,
}

/// The runs between two others. Legs between them without a sample add to the uncertainty of their length.
fn timed_runs(time_s: &[f64], legs: &[Leg], runs: &[LineRun], clock: &Clock) -> Vec<TimedRun> {
    let of = |three: &[LineRun]| {
        let [before, run, after] = three else { return None };
        let ends = [[before.to - 1, run.from], [run.to - 1, after.from]].map(|pair| pair.map(|i| time_s[i]));
        let leg = &legs[run.leg];
        let unseen_s = [
            clock.starts[leg.from] - clock.starts[legs[before.leg].to],
            clock.starts[legs[after.leg].from] - clock.starts[leg.to],
        ];
        let squares = ends.iter().zip(unseen_s).map(|([lo, hi], unseen_s)| (hi - lo).powi(2) + unseen_s.powi(2));
        (before.leg < run.leg && run.leg < after.leg).then(|| TimedRun {
            samples: [run.from, run.to],
            times_s: ends.map(|[lo, hi]| f64::midpoint(lo, hi)),
            deviation_s: (squares.sum::<f64>() / 12.0).sqrt(),
            planned_s: clock.starts[leg.to] - clock.starts[leg.from],
        })
    };
    runs.windows(3).filter_map(of).collect()
}

/// Time over the planned one of most runs: clocks and declared accelerations are never quite right.
fn usual_pace(runs: &[TimedRun]) -> f64 {
    let long = runs.iter().filter(|run| run.planned_s > 10.0 * run.deviation_s);
    let paces: Vec<f64> = long.map(|run| (run.times_s[1] - run.times_s[0]) / run.planned_s).collect();
    if paces.is_empty() { 1.0 } else { median(&paces) }
}

/// Holds within runs, (from, to), s: a run that lasts longer than its leg, with a stretch as long as the difference in which the load of the
/// cut is gone.
fn holds_in_runs(log: &Log, runs: &[TimedRun]) -> Vec<(f64, f64)> {
    let Some((_, load)) = log.measured.first() else { return Vec::new() };
    let mut known: Vec<f64> = load.iter().copied().filter(|value| value.is_finite()).collect();
    known.sort_by(f64::total_cmp);
    let Some(idle) = known.get(known.len() / 20) else { return Vec::new() };
    let pace = usual_pace(runs);
    let hold = |run: &TimedRun| {
        let extra_s = run.times_s[1] - run.times_s[0] - pace * run.planned_s;
        let [from, to] = run.samples;
        let step_s = (log.time_s[to - 1] - log.time_s[from]) / (to - from).max(2) as f64;
        let count = (extra_s / step_s.max(1e-9)) as usize;
        if extra_s < SHORTEST_HOLD_S.max(SURE * run.deviation_s) || count + 2 > to - from {
            return None;
        }
        let mean = |range: &[f64]| range.iter().sum::<f64>() / range.len().max(1) as f64;
        let own = &load[from..to];
        let quiet =
            (0..=own.len() - count).min_by(|a, b| mean(&own[*a..a + count]).total_cmp(&mean(&own[*b..b + count])))?;
        let rest: Vec<f64> = [&own[..quiet], &own[quiet + count..]].concat();
        let (still, cut) = (mean(&own[quiet..quiet + count]), mean(&rest));
        let is_gone = cut - still > GONE * (cut - idle) && cut > still;
        let begin_s = log.time_s[from + quiet] - 0.5 * step_s;
        is_gone.then_some((begin_s, begin_s + extra_s))
    };
    runs.iter().filter_map(hold).collect()
}

/// Feed over the predicted one by the lengths of the runs, sample by sample; 1 where they show no other.
fn feed_ratios(runs: &[TimedRun], samples: usize) -> Vec<f64> {
    let pace = usual_pace(runs);
    let mut ratios = vec![1.0; samples];
    for (k, run) in runs.iter().enumerate() {
        let [first, last] = long_enough(runs, k);
        let planned_s: f64 = runs[first..=last].iter().map(|run| run.planned_s).sum();
        let lasted_s = (runs[last].times_s[1] - runs[first].times_s[0]) / pace;
        let deviation_s = runs[first].deviation_s.hypot(runs[last].deviation_s);
        let ratio = planned_s / lasted_s.max(1e-9);
        if (lasted_s - planned_s).abs() > SURE * deviation_s && (ratio - 1.0).abs() > LEAST_OFF {
            ratios[run.samples[0]..run.samples[1]].fill(ratio);
        }
    }
    ratios
}

/// Holds, and pauses at boundaries, (time in the log, length), s; `placed`: time of the program at each sample.
fn pauses(log: &Log, holds: &Holds, drift: &Drift, placed: &[f64]) -> Vec<(f64, f64)> {
    let log_s = |at_s: f64| log.time_s.get(placed.partition_point(|placed| *placed < at_s)).copied();
    let own = holds.0.iter().map(|(from, to)| (*from, to - from));
    let between = drift.pauses.iter().filter(|(_, length_s)| *length_s > 0.0);
    let between = between.filter_map(|(at_s, length_s)| Some((log_s(*at_s)?, *length_s)));
    let mut all: Vec<(f64, f64)> = own.chain(between).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}

/// A clock that runs so much slower where the machine does.
fn at_predicted_feed(time_s: &[f64], ratios: &[f64]) -> Vec<f64> {
    let Some(first) = time_s.first() else { return Vec::new() };
    let mut sum = *first;
    let step = |(pair, ratio): (&[f64], &f64)| {
        sum += ratio * (pair[1] - pair[0]);
        sum
    };
    std::iter::once(*first).chain(time_s.windows(2).zip(&ratios[1..]).map(step)).collect()
}

/// First and last of the adjacent runs about a run that together last long enough to show the feed.
fn long_enough(runs: &[TimedRun], k: usize) -> [usize; 2] {
    let adjacent = |a: usize| runs.get(a + 1).is_some_and(|after| runs[a].samples[1] == after.samples[0]);
    let (mut first, mut last) = (k, k);
    while runs[last].times_s[1] - runs[first].times_s[0] < FEED_SPAN_S {
        let before = first > 0 && adjacent(first - 1);
        let after = adjacent(last);
        first -= usize::from(before);
        last += usize::from(after);
        if !before && !after {
            break;
        }
    }
    [first, last]
}

/// Observations of the drift at the boundaries between consecutive runs.
fn boundaries(time_s: &[f64], legs: &[Leg], runs: &[LineRun], clock: &Clock) -> Vec<Observation> {
    let between = |pair: &[LineRun]| {
        let (before, after) = (&pair[0], &pair[1]);
        let [lo, hi] = [time_s[before.to - 1], time_s[after.from]];
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
