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
use crate::learn::program::timeline::{Spot, Timeline};
use crate::learn::regress::statistics::median;
use crate::numeric::golden_section;

/// Least gain in log-likelihood of a slower machine over the declared one, nats. Judgement.
const SLOWER_GAIN_NATS: f64 = 10.0;
/// Shortest hold, s, and standard deviations by which a run has to be too long or too short. Judgement.
const SHORTEST_HOLD_S: f64 = 1.5;
const SURE: f64 = 6.0;
/// Share of the time by which a run is too long in which the load of the cut has to be gone for a hold. Judgement.
const GONE: f64 = 0.7;
/// Share of the readings below which the spindle counts as idle, and above which a run counts as in a cut. Judgement.
const IDLE: f64 = 0.05;
/// Mean error of the lengths of runs, as a logarithm, above which their lines may be miscounted, and the share of it that is left if they
/// are. Judgement: an override of a half is 0.7, and stays with any count.
const MISCOUNTED: f64 = 0.4;
const FEWER: f64 = 0.3;
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
    let holds = Holds(holds_in_runs(log, &timed_runs(&log.time_s, &legs, &runs, &declared), timeline));
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
    let pauses = pauses(log, &holds, &drift, &placed);
    let placed = in_runs(&runs, lines.len());
    Some(Aligned {
        uncertainty_s: median_uncertainty(&program_s, &sample_uncertainty_s),
        program_s,
        placed,
        method: Method::Line,
        sample_uncertainty_s,
        misfit: lost as f64 / lines.len().max(1) as f64,
        read_later_s: 0.0,
        acceleration: (clock.factor < 1.0).then_some((clock.factor, nats)),
        feed_ratio: Some(ratios),
        holds: holds.0.clone(),
        pauses,
    })
}

/// Numbers the lines of a log as those of the program if they count from another one, with a warning.
pub fn count_from_first(log: &mut Log, timeline: &Timeline) {
    let Some(lines) = &log.line else { return };
    let (legs, clock) = (legs(timeline), Clock::new(timeline, &[], 1.0));
    let off = |by: f64| {
        let own: Vec<f64> = lines.iter().map(|line| line + by).collect();
        error_of_lengths(&timed_runs(&log.time_s, &legs, &runs(&own, &legs).0, &clock))
    };
    let plain = off(0.0);
    let better = |by: &f64| plain > MISCOUNTED && off(*by) < FEWER * plain;
    let Some(by) = [1.0, -1.0].into_iter().find(better) else { return };
    log.line = Some(lines.iter().map(|line| line + by).collect());
    log.warnings.push(format!(
        "the lines last as long as those of the program only with {by:+} to their number: so they are read"
    ));
}

/// Mean of |ln(length / planned length)| over the runs that are long enough to tell.
fn error_of_lengths(runs: &[TimedRun]) -> f64 {
    let lasted_s = |run: &TimedRun| (run.times_s[1] - run.times_s[0]).max(1e-9);
    let long = runs.iter().filter(|run| run.planned_s.max(lasted_s(run)) > 10.0 * run.deviation_s);
    let errors: Vec<f64> = long.map(|run| (lasted_s(run) / run.planned_s.max(1e-9)).ln().abs()).collect();
    errors.iter().sum::<f64>() / errors.len().max(1) as f64
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

/// Runs that belong to a leg, in order, and the number of samples that do not. A leg that comes again after lines before it is
/// repeated: the program was begun again there.
fn runs(lines: &[f64], legs: &[Leg]) -> (Vec<LineRun>, usize) {
    let (mut runs, mut next, mut from, mut lost): (Vec<LineRun>, _, _, _) = (Vec::new(), 0, 0, 0);
    let mut went_back = false;
    while from < lines.len() {
        let to = (from..lines.len()).find(|i| lines[*i] != lines[from]).unwrap_or(lines.len());
        let is_own = |leg: &Leg| f64::from(leg.line) == lines[from];
        let ahead = legs[next..].iter().position(is_own).map(|k| next + k);
        went_back |= ahead.is_none() && legs[..next].iter().any(is_own);
        let is_again = |leg: &usize| went_back && runs.last().is_some_and(|last| last.leg == *leg);
        match ahead.filter(|leg| !is_again(leg)) {
            Some(leg) => {
                (next, went_back) = (leg, false);
                runs.push(LineRun { from, to, leg });
            }
            None => lost += to - from,
        }
        from = to;
    }
    (runs, lost)
}

/// Is each sample in a run?
fn in_runs(runs: &[LineRun], samples: usize) -> Vec<bool> {
    let mut placed = vec![false; samples];
    for run in runs {
        placed[run.from..run.to].fill(true);
    }
    placed
}

/// A run between two boundaries that were both passed between two of its samples and the next.
struct TimedRun {
    /// Its samples, and the spots of its leg: from … to (exclusive).
    samples: [usize; 2],
    spots: [usize; 2],
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
            spots: [leg.from, leg.to],
            times_s: ends.map(|[lo, hi]| f64::midpoint(lo, hi)),
            deviation_s: (squares.sum::<f64>() / 12.0).sqrt(),
            planned_s: clock.starts[leg.to] - clock.starts[leg.from],
        })
    };
    runs.windows(3).filter_map(of).collect()
}

/// Feed over the predicted one by the times at which a load shows the legs of the program to begin and end, sample by sample; `reached_s`: the
/// time of the log, without holds, at a time of the program.
pub(in crate::learn) fn ratios_of_legs(
    timeline: &Timeline,
    clock: &Clock,
    time_s: &[f64],
    deviation_s: f64,
    reached_s: impl Fn(f64) -> f64,
) -> Vec<f64> {
    let sample = |at_s: f64| time_s.partition_point(|time| *time < at_s);
    let run = |leg: &Leg| {
        let planned = [clock.starts[leg.from], clock.starts[leg.to]];
        let times_s = planned.map(&reached_s);
        TimedRun {
            samples: times_s.map(sample),
            spots: [leg.from, leg.to],
            times_s,
            deviation_s,
            planned_s: planned[1] - planned[0],
        }
    };
    let runs: Vec<TimedRun> = legs(timeline).iter().map(run).filter(|run| run.samples[0] < run.samples[1]).collect();
    feed_ratios(&runs, time_s.len())
}

/// Time over the planned one of most runs: clocks and declared accelerations are never quite right. Further off it is an override of
/// most of the program.
fn usual_pace(runs: &[TimedRun]) -> f64 {
    let long = runs.iter().filter(|run| run.planned_s > 10.0 * run.deviation_s);
    let paces: Vec<f64> = long.map(|run| (run.times_s[1] - run.times_s[0]) / run.planned_s).collect();
    let pace = if paces.is_empty() { 1.0 } else { median(&paces) };
    if (pace - 1.0).abs() < LEAST_OFF { pace } else { 1.0 }
}

/// Holds within runs, (from, to), s: a run that lasts longer than its leg, in which the load of the cut is gone for so much longer than the leg
/// is out of the material. Under an override the cut itself lasts longer.
fn holds_in_runs(log: &Log, runs: &[TimedRun], timeline: &Timeline) -> Vec<(f64, f64)> {
    let Some((_, load)) = log.measured.first() else { return Vec::new() };
    let Some(idle) = quantile(load, IDLE) else { return Vec::new() };
    let pace = usual_pace(runs);
    let hold = |run: &TimedRun| {
        let extra_s = run.times_s[1] - run.times_s[0] - pace * run.planned_s;
        let [from, to] = run.samples;
        let step_s = (log.time_s[to - 1] - log.time_s[from]) / (to - from).max(2) as f64;
        let count = (extra_s / step_s.max(1e-9)) as usize;
        if extra_s < SHORTEST_HOLD_S.max(SURE * run.deviation_s) || count + 2 > to - from {
            return None;
        }
        let own = &load[from..to];
        let low = f64::midpoint(idle, quantile(own, 1.0 - IDLE)?);
        let low_s = step_s * own.iter().filter(|value| **value < low).count() as f64;
        let in_air = |spot: &&Spot| spot.engaged.section_mm2 <= 1e-6;
        let spots = timeline.spots[run.spots[0]..run.spots[1]].iter().filter(in_air);
        let air_s = pace * spots.map(|spot| spot.end_s - spot.start_s).sum::<f64>();
        let is_hold = air_s < 0.5 * run.planned_s && low_s - air_s > GONE * extra_s;
        let sum = |at: usize| own[at..at + count].iter().sum::<f64>();
        let quiet = (0..=own.len() - count).min_by(|a, b| sum(*a).total_cmp(&sum(*b)))?;
        let begin_s = log.time_s[from + quiet] - 0.5 * step_s;
        is_hold.then_some((begin_s, begin_s + extra_s))
    };
    runs.iter().filter_map(hold).collect()
}

/// The value below which this share of the finite ones lies.
fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut known: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    known.sort_by(f64::total_cmp);
    known.get((share * known.len().saturating_sub(1) as f64) as usize).copied()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::contact::Engaged;
    use crate::ids::MoveId;
    use crate::learn::program::timeline::Activity;
    use crate::path::Vec3;

    /// Thirty cuts of 3 s, each a line of its own; the first second of each is in air.
    fn thirty_cuts() -> Timeline {
        let spot = |k: usize| Spot {
            start_s: k as f64,
            end_s: (k + 1) as f64,
            activity: Activity::Feed,
            move_id: Some(MoveId((k / 3) as u32)),
            middle_mm: 0.5,
            line: 1 + (k / 3) as u32,
            block: 0,
            tool: 1,
            coolant: false,
            rps: 100.0,
            from: Vec3::new(k as f64, 0.0, 0.0),
            to: Vec3::new((k + 1) as f64, 0.0, 0.0),
            direction: Vec3::new(1.0, 0.0, 0.0),
            length_mm: 1.0,
            curvature_per_mm: 0.0,
            engaged: Engaged { section_mm2: if k.is_multiple_of(3) { 0.0 } else { 2.0 }, ..Engaged::default() },
        };
        Timeline { spots: (0..90).map(spot).collect(), runouts: Vec::new() }
    }

    /// A log of it at 20 Hz in which the program advances at `rate(program time, log time)`.
    fn logged(rate: impl Fn(f64, f64) -> f64) -> Log {
        let (mut time_s, mut line, mut load) = (Vec::new(), Vec::new(), Vec::new());
        let (mut at_s, mut now_s): (f64, f64) = (0.01, 0.0);
        while at_s < 89.9 {
            let rate = rate(at_s, now_s);
            time_s.push(now_s);
            line.push((at_s / 3.0).floor() + 1.0);
            load.push(if at_s % 3.0 < 1.0 || rate == 0.0 { 50.0 } else { 50.0 + 200.0 * rate });
            at_s += 0.05 * rate;
            now_s += 0.05;
        }
        Log { time_s, line: Some(line), measured: vec![("spindle_power_w", load)], ..Log::default() }
    }

    #[test]
    fn a_hold_within_a_line_is_where_the_load_is_gone() {
        let log = logged(|_, now_s| if (31.5..38.0).contains(&now_s) { 0.0 } else { 1.0 });
        let found = by_line(&log, &thirty_cuts(), &[]).unwrap();
        let [(from_s, to_s)] = found.holds[..] else { panic!("{:?}", found.holds) };
        assert!((from_s - 31.5).abs() < 0.2 && (to_s - 38.0).abs() < 0.2, "{from_s} to {to_s}");
        assert!(found.feed_ratio.unwrap().iter().all(|ratio| *ratio == 1.0));
        let held = |i: usize| (31.7..37.8).contains(&log.time_s[i]);
        assert!((0..log.time_s.len()).filter(|i| held(*i)).all(|i| found.program_s[i].is_nan()));
    }

    #[test]
    fn lines_that_last_longer_in_and_out_of_the_cut_show_an_override() {
        let slow = |at_s: f64| if (30.0..60.0).contains(&at_s) { 0.8 } else { 1.0 };
        let log = logged(|at_s, _| slow(at_s));
        let found = by_line(&log, &thirty_cuts(), &[]).unwrap();
        assert_eq!(found.holds, []);
        let ratios = found.feed_ratio.unwrap();
        // The place in the program and the feed are both known but at the borders of the override.
        for (i, ratio) in ratios.iter().enumerate() {
            let at_s = log.line.as_ref().map_or(0.0, |line| 3.0 * (line[i] - 0.5));
            if (at_s - 30.0).abs() > 6.0 && (at_s - 60.0).abs() > 6.0 {
                assert!((ratio - slow(at_s)).abs() < 0.02, "{ratio} at {at_s}");
            }
        }
        let half = log.time_s.iter().position(|time| *time >= 30.0 + 15.0 / 0.8).unwrap();
        assert!((found.program_s[half] - 45.0).abs() < 0.2, "{}", found.program_s[half]);
    }

    #[test]
    fn an_override_of_most_of_the_program_is_one_and_the_rest_runs_as_programmed() {
        let slow = |at_s: f64| if at_s < 60.0 { 0.7 } else { 1.0 };
        let found = by_line(&logged(|at_s, _| slow(at_s)), &thirty_cuts(), &[]).unwrap();
        let ratios = found.feed_ratio.unwrap();
        let inner = |at_s: f64| (6.0..54.0).contains(&at_s) || (66.0..84.0).contains(&at_s);
        for (ratio, at_s) in ratios.iter().zip(&found.program_s).filter(|(_, at_s)| inner(**at_s)) {
            assert!((ratio - slow(*at_s)).abs() < 0.02, "{ratio} at {at_s}");
        }
    }

    #[test]
    fn lines_that_count_from_another_one_are_renumbered() {
        // Lines of unlike lengths.
        const ENDS_S: [f64; 13] = [7.0, 9.0, 13.0, 22.0, 25.0, 30.0, 41.0, 43.0, 52.0, 55.0, 60.0, 71.0, 73.0];
        let line = |at_s: f64| 1 + ENDS_S.iter().filter(|end_s| **end_s <= at_s).count() as u32;
        let mut program = thirty_cuts();
        program.spots.iter_mut().for_each(|spot| spot.line = line(spot.start_s));
        let counted = |by: f64| {
            let log = logged(|_, _| 1.0);
            let lines = log.time_s.iter().map(|time| f64::from(line(time + 0.01)) + by).collect();
            let mut log = Log { line: Some(lines), ..log };
            count_from_first(&mut log, &program);
            (log.line.unwrap()[40], log.warnings.len())
        };
        assert_eq!([counted(0.0), counted(1.0), counted(-1.0)], [(1.0, 0), (1.0, 1), (1.0, 1)]);
    }

    #[test]
    fn lines_that_run_again_belong_to_nothing() {
        let mut log = logged(|_, _| 1.0);
        let lines = log.line.clone().unwrap();
        let at = |line: f64| lines.iter().position(|own| *own == line).unwrap();
        // Lines 10 to 12 twice.
        let again: Vec<usize> = (0..at(13.0)).chain(at(10.0)..lines.len()).collect();
        log.line = Some(again.iter().map(|i| lines[*i]).collect());
        log.measured[0].1 = again.iter().map(|i| log.measured[0].1[*i]).collect();
        log.time_s = (0..again.len()).map(|k| 0.05 * k as f64).collect();
        let found = by_line(&log, &thirty_cuts(), &[]).unwrap();
        let repeated = at(13.0)..2 * at(13.0) - at(10.0);
        assert!((0..again.len()).all(|i| found.placed[i] != repeated.contains(&i)));
        assert!(repeated.clone().all(|i| found.program_s[i].is_nan()));
    }

    #[test]
    fn a_clock_that_is_slow_throughout_is_no_override() {
        let log = logged(|_, _| 0.97);
        let found = by_line(&log, &thirty_cuts(), &[]).unwrap();
        assert!(found.holds.is_empty() && found.feed_ratio.unwrap().iter().all(|ratio| *ratio == 1.0));
    }
}
