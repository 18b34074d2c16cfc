//! Alignment by the load alone. In: log, timeline, slower machines, job. Out: [`Aligned`].
//!
//! 1. Coarse: the predicted load of each machine (with the declared acceleration and lower ones) is found in the
//!    measured one by dynamic programming over the lag ([`super::matching`]); the machine with the best correlation is
//!    chosen.
//! 2. Fine: in windows of the program y ≈ c₀ + (1 + c)·ŷ(T) − δ·ŷ′(T) is fitted; each window thus gives an observation
//!    of the shift δ, independent of its level. The drift is smoothed over the windows ([`super::drift`]); the
//!    acceleration with the most likely drift is chosen. ŷ is refitted (tare, cutting and edge part by robust least
//!    squares), and both are repeated. With stock that stands proud, a smaller mill or a higher load at entries, cuts
//!    would seem to begin earlier or later than they do: the change of the load by each of these is fitted together
//!    with the other parts.
//! 3. The fitted load is matched again, as the first match knew neither the machine nor the parts.
//! 4. A lag of the sensor looks like a late alignment: first-order lags of ŷ are tried and kept if they lower the
//!    squares clearly.

use crate::learn::align::drift::{Drift, Observation, drift, interpolated};
use crate::learn::align::holds::Holds;
use crate::learn::align::line::{most_likely_acceleration, ratios_of_legs};
use crate::learn::align::matching::{Match, match_load};
use crate::learn::align::measured_load::{MeasuredLoad, gridded, thinned};
use crate::learn::align::predicted_load::{PARTS, Part, PredictedLoad, parts, with_uncertain_parts};
use crate::learn::align::{Aligned, Method, median_uncertainty};
use crate::learn::log::Log;
use crate::learn::program::clock::{Clock, Slower};
use crate::learn::program::simulated::ProgramView;
use crate::learn::program::timeline::Timeline;
use crate::learn::regress::linear::{Loss, robust_coefficients};
use crate::learn::regress::statistics::{correlation, median, scale_of};
use nalgebra::{DMatrix, Matrix3, SMatrix, SVector, Vector3};
use rayon::prelude::*;

/// Range of lags that is searched beyond the difference in length, s.
const REACH_S: f64 = 20.0;
/// Uncertainty of a sample in addition to that of the drift, s.
const LEAST_S: f64 = 0.01;
/// Length of a window, s.
const WINDOW_S: f64 = 6.0;
/// Time over which the slope ŷ′ is taken in each round, s.
const SLOPES_S: [f64; 8] = [0.4, 0.3, 0.2, 0.3, 0.2, 0.15, 0.1, 0.1];
/// Lags of the sensor that are tried, s.
const LAGS_S: [f64; 7] = [0.3, 0.5, 0.75, 1.0, 1.4, 2.0, 3.0];
/// Least relative drop of the squares for a lag. Judgement.
const LAG_GAIN: f64 = 0.3;
/// Factors on the costs of steps and holds in the coarse match, from stiff to loose, and the least relative drop of the
/// squares for a looser match. Judgement.
const STIFFNESS: [[f64; 2]; 4] = [[100.0, 100.0], [10.0, 100.0], [1.0, 10.0], [1.0, 1.0]];
const LOOSER_GAIN: f64 = 0.03;
/// Ratio of neighbouring accelerations that are tried, and how often the interval about the best one is halved.
const NEXT_MACHINE: f64 = 1.5;
const BETWEEN: usize = 3;
/// Time about the place of a hold over which the load of the cut is taken, s: it is known to about a step of the match. Judgement.
const HELD_S: f64 = 0.5;
/// Standard deviation of the length of a leg by the load at its ends, s. Judgement: stock or tool may differ from the declared ones.
const EDGE_S: f64 = 0.15;
/// Round before which lags are tried.
const LAG_ROUND: usize = 3;

/// Aligns a log by the measured quantity `index`; `None` if it cannot be found in the program.
pub fn by_load(log: &Log, index: usize, known: &ProgramView) -> Option<Aligned> {
    let (timeline, slower, job) = (known.timeline, known.slower, known.job);
    let force = log.measured[index].0.starts_with("force");
    let measured = thinned(log, index)?;
    let mut parts = parts(timeline, job, force);
    if !force {
        with_uncertain_parts(&mut parts, known);
    }
    // Differences from the declared stock and tool look like errors of the alignment: a loose match may follow them, a
    // stiff one may miss a pause. So several are refined, and the residual of the fitted loads decides.
    let search = Search { measured: &measured, timeline, slower, parts: &parts };
    let first = search.best_of(coarse(&measured, timeline, slower, &parts), None)?;
    let best = search.best_of(search.matched_again(&first), Some(first))?;
    let Refined { state, nats, holds, correlation, .. } = best;
    let running: Vec<f64> = log.time_s.iter().map(|t| holds.running_s(*t)).collect();
    let placed = state.walk.program_s(&running);
    let held = |t: &f64| holds.0.iter().any(|(from, to)| t > from && t < to);
    let placed: Vec<f64> =
        placed.into_iter().zip(&log.time_s).map(|(p, t)| if held(t) { f64::NAN } else { p }).collect();
    let pauses = holds.pauses(&state.walk);
    let stood = search.without_load(&holds, &state);
    let program_s: Vec<f64> = placed.iter().map(|t| state.clock.declared_s(timeline, *t)).collect();
    // A hold in which the cut goes on is time at another feed.
    let stands = Holds(holds.0.iter().copied().filter(|(from_s, _)| stood.contains(from_s)).collect());
    let reached_s = |at_s: f64| stands.running_s(holds.log_s(state.walk.log_s(at_s)));
    let without_stands: Vec<f64> = log.time_s.iter().map(|time| stands.running_s(*time)).collect();
    let feed_ratio = ratios_of_legs(timeline, &state.clock, &without_stands, EDGE_S, reached_s);
    let sample_uncertainty_s: Vec<f64> =
        state.walk.deviations_s(&placed).into_iter().map(|s| s.hypot(LEAST_S)).collect();
    Some(Aligned {
        uncertainty_s: median_uncertainty(&program_s, &sample_uncertainty_s),
        placed: program_s.iter().map(|t| t.is_finite()).collect(),
        program_s,
        method: Method::Load,
        sample_uncertainty_s,
        holds: pauses
            .iter()
            .filter(|(at_s, _)| stood.contains(at_s))
            .map(|(at_s, long_s)| (*at_s, at_s + long_s))
            .collect(),
        feed_ratio: Some(feed_ratio),
        read_later_s: 0.0,
        misfit: (1.0 - correlation).clamp(0.0, 1.0),
        acceleration: (state.clock.factor < 1.0).then_some((state.clock.factor, nats)),
        pauses,
    })
}

/// A match after refinement.
struct Refined {
    state: State,
    /// Gain in log-likelihood of the machine over the declared one, nats.
    nats: f64,
    holds: Holds,
    /// Correlation of the measured and the fitted load.
    correlation: f64,
    /// Mean square of the residual.
    square: f64,
}

/// Measured load, and the program that it is searched in.
struct Search<'a> {
    measured: &'a MeasuredLoad,
    timeline: &'a Timeline,
    slower: &'a [Slower],
    parts: &'a [Part],
}

impl Search<'_> {
    /// The best of these matches after refinement, and of one refined before.
    fn best_of(&self, matches: Vec<(Clock, Match)>, before: Option<Refined>) -> Option<Refined> {
        let follow = |found| refine(self.measured, self.timeline, self.slower, self.parts, found);
        let refined: Vec<Refined> = matches.into_par_iter().filter_map(follow).collect();
        let better = |stiffer: Refined, looser: Refined| {
            if looser.square < (1.0 - LOOSER_GAIN) * stiffer.square { looser } else { stiffer }
        };
        before.into_iter().chain(refined).reduce(better)
    }

    /// Beginnings of the holds during which the load of the cut is gone: nearer to that without a cut than to that of the place where the
    /// program stands, or within the scatter of it. A cut that goes on at another feed is none.
    fn without_load(&self, holds: &Holds, state: &State) -> Vec<f64> {
        let measured = self.measured.without(holds);
        let predicted = PredictedLoad::new(self.timeline, &state.clock, self.parts, state.lag_s, measured.span_s);
        let Some((factors, _)) = refitted(&measured, &predicted, &state.walk.program_s(&measured.time_s)) else {
            return Vec::new();
        };
        let (idle, whole) = (predicted.with(without_cut(factors)), predicted.with(factors));
        let is_gone = |(from_s, to_s): &(f64, f64)| {
            let own = self.measured.time_s.iter().zip(&self.measured.load);
            let own: Vec<f64> = own.filter(|(t, _)| (from_s..to_s).contains(t)).map(|(_, load)| *load).collect();
            let place = state.walk.program_s(&[holds.running_s(*from_s)])[0];
            let of_cut = whole.mean(place, HELD_S) - idle.at(place);
            !own.is_empty() && median(&own) < idle.at(place) + (0.5 * of_cut).max(state.scale)
        };
        holds.0.iter().filter(|hold| is_gone(hold)).map(|hold| hold.0).collect()
    }

    /// Matches of the fitted load on the machine found.
    fn matched_again(&self, refined: &Refined) -> Vec<(Clock, Match)> {
        let state = &refined.state;
        let measured = self.measured.without(&refined.holds);
        let fine = PredictedLoad::new(self.timeline, &state.clock, self.parts, state.lag_s, measured.span_s);
        let fitted = refitted(&measured, &fine, &state.walk.program_s(&measured.time_s));
        let Some((factors, _)) = fitted else { return Vec::new() };
        let (step_s, on_grid) = grid(self.measured);
        let plain = PredictedLoad::new(self.timeline, &state.clock, self.parts, state.lag_s, 0.0);
        let loads = plain.with(factors).on_grid(state.clock.total_s(), step_s);
        let again = |stiffness: &[f64; 2]| {
            Some((state.clock.clone(), match_load(&on_grid, &loads, step_s, REACH_S, *stiffness)?))
        };
        distinct(STIFFNESS.par_iter().filter_map(again).collect())
    }
}

/// Matches without repetitions.
fn distinct(mut matches: Vec<(Clock, Match)>) -> Vec<(Clock, Match)> {
    let places = |found: &Match| found.program_s.iter().map(|t| t.to_bits()).collect::<Vec<u64>>();
    matches.dedup_by(|b, a| a.0.factor == b.0.factor && places(&a.1) == places(&b.1));
    matches
}

/// The measured load on a grid, and its step, s.
fn grid(measured: &MeasuredLoad) -> (f64, Vec<f64>) {
    let step_s = (measured.time_s.last().copied().unwrap_or(0.0) / 3000.0).max(0.2);
    (step_s, gridded(measured, step_s))
}

/// Refines a match.
fn refine(
    measured: &MeasuredLoad,
    timeline: &Timeline,
    slower: &[Slower],
    parts: &[Part],
    (clock, found): (Clock, Match),
) -> Option<Refined> {
    let holds = Holds::new(&found);
    let seen = matched(&found, &clock, &holds);
    let measured = measured.without(&holds);
    let mut state = State { walk: drift(&seen)?, clock, lag_s: 0.0, scale: 1.0 };
    let mut nats = 0.0;
    for (round, slope_s) in SLOPES_S.iter().enumerate() {
        let mut predicted = PredictedLoad::new(timeline, &state.clock, parts, state.lag_s, measured.span_s);
        if round == LAG_ROUND {
            (state.lag_s, state.walk) = best_lag(&measured, timeline, &state, parts);
            predicted = PredictedLoad::new(timeline, &state.clock, parts, state.lag_s, measured.span_s);
        }
        let seen = shifts(&measured, &predicted, &mut state, *slope_s)?;
        let places: Vec<(Observation, (usize, f64))> =
            seen.iter().filter_map(|s| Some((*s, state.clock.place(s.at_s)?))).collect();
        let walk = |factor: f64| {
            let clock = Clock::new(timeline, slower, factor);
            let again = |(s, place): &(Observation, (usize, f64))| {
                let at_s = clock.time(*place);
                Observation { at_s, drift_s: s.at_s + s.drift_s - at_s, variance: s.variance }
            };
            let seen: Vec<Observation> = places.iter().map(again).collect();
            drift(&seen).map(|d| (clock, d))
        };
        if round <= LAG_ROUND + 1 {
            (state.clock, state.walk, nats) = most_likely_acceleration(slower, &walk)?;
        } else {
            (state.clock, state.walk) = walk(state.clock.factor)?;
        }
    }
    let predicted = PredictedLoad::new(timeline, &state.clock, parts, state.lag_s, measured.span_s);
    let square = squares(&measured, &predicted, &state.walk.program_s(&measured.time_s)) / measured.load.len() as f64;
    let correlation = agreement(&measured, &predicted, &state.walk);
    Some(Refined { state, nats, holds, correlation, square })
}

/// The present alignment.
struct State {
    clock: Clock,
    walk: Drift,
    lag_s: f64,
    /// Standard deviation of the residual.
    scale: f64,
}

/// For every stiffness the best machine and its match.
fn coarse(measured: &MeasuredLoad, timeline: &Timeline, slower: &[Slower], parts: &[Part]) -> Vec<(Clock, Match)> {
    let end = measured.time_s.last().copied().unwrap_or(0.0);
    let (step, on_grid) = grid(measured);
    let factors = std::iter::once(1.0).chain(slower.iter().map(|(f, _)| *f));
    let clocks = factors.map(|factor| Clock::new(timeline, slower, factor));
    let with_loads = |clock: Clock| {
        let predicted = PredictedLoad::new(timeline, &clock, parts, 0.0, 0.0);
        let loads = predicted.before_fit().on_grid(clock.total_s(), step);
        (clock, loads)
    };
    let short = |clock: &Clock| clock.factor == 1.0 || clock.total_s() <= end + REACH_S;
    let machines: Vec<(Clock, Vec<f64>)> = clocks.take_while(short).map(with_loads).collect();
    let best = |stiffness: &[f64; 2]| {
        let miss_of = |(clock, loads): &(Clock, Vec<f64>)| {
            let found = match_load(&on_grid, loads, step, REACH_S, *stiffness)?;
            Some((1.0 - found.correlation, clock.clone(), found))
        };
        let mut best: Option<(f64, Clock, Match)> = None;
        for tried in machines.iter().filter_map(miss_of) {
            // A slower machine must fit clearly better. Compared by correlation, because each match has its own unit of
            // cost.
            if best.as_ref().is_none_or(|(least, ..)| tried.0 < 0.9 * least) {
                best = Some(tried);
            }
        }
        let mut best = best?;
        // A stiff match cannot follow a machine between those tried: interpolate.
        let mut apart = NEXT_MACHINE;
        for _ in 0..if best.1.factor < 1.0 { BETWEEN } else { 0 } {
            apart = apart.sqrt();
            let beside = [apart, 1.0 / apart].map(|by| Clock::new(timeline, slower, (by * best.1.factor).min(1.0)));
            let tried = beside.into_iter().filter(short).filter_map(|clock| miss_of(&with_loads(clock)));
            best = tried.fold(best, |least, other| if other.0 < least.0 { other } else { least });
        }
        Some((best.1, best.2))
    };
    distinct(STIFFNESS.par_iter().filter_map(best).collect())
}

/// Observations of the drift by a match, one per window.
fn matched(found: &Match, clock: &Clock, holds: &Holds) -> Vec<Observation> {
    let size = (WINDOW_S / found.step_s).ceil() as usize;
    let total = clock.total_s();
    let pairs: Vec<(f64, f64)> = found
        .program_s
        .iter()
        .enumerate()
        .filter(|(i, t)| found.known[*i] && t.is_finite() && **t <= total)
        .map(|(i, t)| (*t, holds.running_s(i as f64 * found.step_s) - t))
        .collect();
    pairs
        .chunks(size)
        .map(|c| {
            let middle = c[c.len() / 2];
            Observation { at_s: middle.0, drift_s: middle.1, variance: found.step_s.powi(2) }
        })
        .collect()
}

/// Refits the parts of the load and fits the shift of each window.
fn shifts(
    measured: &MeasuredLoad,
    predicted: &PredictedLoad,
    state: &mut State,
    width_s: f64,
) -> Option<Vec<Observation>> {
    let placed = state.walk.program_s(&measured.time_s);
    let (factors, scale) = refitted(measured, predicted, &placed)?;
    state.scale = scale;
    let predicted = predicted.with(factors);
    let inside: Vec<usize> = (0..placed.len())
        .filter(|i| placed[*i] >= -WINDOW_S && placed[*i] <= state.clock.total_s() + WINDOW_S)
        .collect();
    let mut seen = Vec::new();
    let mut first = 0;
    while first < inside.len() {
        let begin = placed[inside[first]];
        let last = first + inside[first..].partition_point(|i| placed[*i] < begin + WINDOW_S);
        let rows: Vec<[f64; 4]> = inside[first..last]
            .iter()
            .map(|&i| {
                let t = placed[i];
                [measured.load[i] - predicted.at(t), predicted.slope(t, width_s), predicted.mean(t, width_s), t]
            })
            .collect();
        let at_s = (begin + 0.5 * WINDOW_S).clamp(0.0, state.clock.total_s());
        if let Some((shift, variance)) = shift(&rows, scale) {
            let known = interpolated(&state.walk.at_s, &state.walk.drift_s, at_s);
            seen.push(Observation { at_s, drift_s: known + shift.clamp(-0.75, 0.75), variance });
        }
        first = last.max(first + 1);
    }
    Some(seen)
}

/// δ of r ≈ c₀ + c·ŷ − δ·ŷ′ and its variance; `None` if the load hardly changes in the window. Rows: r, ŷ′, ŷ, T.
fn shift(rows: &[[f64; 4]], scale: f64) -> Option<(f64, f64)> {
    if rows.len() < 8 {
        return None;
    }
    let mean = rows.iter().map(|r| r[2]).sum::<f64>() / rows.len() as f64;
    let (mut normal, mut rhs) = (Matrix3::<f64>::zeros(), Vector3::<f64>::zeros());
    for [r, slope, level, _] in rows {
        let x = Vector3::new(-slope, level - mean, 1.0);
        normal += x * x.transpose();
        rhs += x * *r;
    }
    // Ridge terms, for windows with an almost constant load.
    normal[(1, 1)] += 10.0 * scale * scale / 0.04;
    normal[(2, 2)] += 1e-6;
    let inverse = normal.try_inverse()?;
    let found = inverse * rhs;
    // The residual is autocorrelated, and its variance differs from window to window: robust variance with Bartlett
    // weights (Newey and West 1987).
    let scores: Vec<f64> = rows
        .iter()
        .map(|[r, slope, level, _]| {
            let x = Vector3::new(-slope, level - mean, 1.0);
            (inverse * x)[0] * (r - found.dot(&x))
        })
        .collect();
    let together = |lag: usize| scores.iter().zip(&scores[lag..]).map(|(a, b)| a * b).sum::<f64>();
    let lags = scores.len() / 6;
    let near: f64 = (1..=lags).map(|k| 2.0 * (1.0 - k as f64 / (lags + 1) as f64) * together(k)).sum();
    let variance = (inverse[(0, 0)] * scale * scale).max(together(0) + near) + 1e-5;
    (variance.is_finite() && variance < 0.04).then_some((found[0], variance))
}

/// Factors of the tare alone.
fn without_cut(factors: [f64; PARTS]) -> [f64; PARTS] {
    std::array::from_fn(|part| if part == 0 { factors[part] } else { 0.0 })
}

/// Factors on the parts at this alignment, and the standard deviation of the residual.
fn refitted(measured: &MeasuredLoad, predicted: &PredictedLoad, placed: &[f64]) -> Option<([f64; PARTS], f64)> {
    let inside: Vec<usize> = (0..placed.len()).filter(|i| placed[*i].is_finite()).collect();
    let used: Vec<usize> = (0..PARTS).filter(|b| predicted.parts[*b].iter().any(|x| *x != 0.0)).collect();
    let parts: Vec<[f64; PARTS]> = inside.iter().map(|i| predicted.at(placed[*i])).collect();
    let x = DMatrix::from_fn(inside.len(), used.len(), |r, c| parts[r][used[c]]);
    let y: Vec<f64> = inside.iter().map(|i| measured.load[*i]).collect();
    let (coefficients, residuals) = robust_coefficients(&x, &y, &vec![1.0; y.len()], Loss::Huber)?;
    let mut factors = [0.0; PARTS];
    for (b, factor) in used.iter().zip(&coefficients) {
        factors[*b] = *factor;
    }
    let top = y.iter().copied().fold(0.0, f64::max);
    Some((factors, scale_of(&residuals).max(0.002 * top).max(1e-9)))
}

/// The lag of the sensor with the least squares, s, and the drift with it.
fn best_lag(measured: &MeasuredLoad, timeline: &Timeline, state: &State, parts: &[Part]) -> (f64, Drift) {
    let moved = |by: f64| {
        let drift_s = state.walk.drift_s.iter().map(|d| d + by).collect();
        Drift { drift_s, ..state.walk.clone() }
    };
    let mut best = (f64::INFINITY, 0.0, 0.0);
    for lag_s in std::iter::once(0.0).chain(LAGS_S) {
        let predicted = PredictedLoad::new(timeline, &state.clock, parts, lag_s, measured.span_s);
        for k in 0..=8 {
            let by = -lag_s * f64::from(k) / 8.0;
            let squares = squares(measured, &predicted, &moved(by).program_s(&measured.time_s));
            let pays = if lag_s > 0.0 { 1.0 - LAG_GAIN } else { 1.0 };
            if squares < best.0 * if best.1 == 0.0 { pays } else { 1.0 } {
                best = (squares, lag_s, by);
            }
            if lag_s == 0.0 {
                break;
            }
        }
    }
    (best.1, moved(best.2))
}

/// Least squares over the factors on the parts.
fn squares(measured: &MeasuredLoad, predicted: &PredictedLoad, placed: &[f64]) -> f64 {
    let (mut normal, mut rhs, mut whole) = (Normal::zeros(), SVector::<f64, PARTS>::zeros(), 0.0);
    for (t, y) in placed.iter().zip(&measured.load) {
        let x = SVector::from(predicted.at(*t));
        normal += x * x.transpose();
        rhs += x * *y;
        whole += y * y;
    }
    let full = normal + Normal::identity() * (1e-9 * whole);
    full.cholesky().map_or(f64::INFINITY, |c| whole - rhs.dot(&c.solve(&rhs)))
}

/// Normal equations of the factors on the parts.
type Normal = SMatrix<f64, PARTS, PARTS>;

/// Correlation of the measured load and the fitted one.
fn agreement(measured: &MeasuredLoad, predicted: &PredictedLoad, walk: &Drift) -> f64 {
    let placed = walk.program_s(&measured.time_s);
    let Some((factors, _)) = refitted(measured, predicted, &placed) else { return 0.0 };
    let predicted = predicted.with(factors);
    let pairs: Vec<(f64, f64)> = placed.iter().zip(&measured.load).map(|(t, y)| (predicted.at(*t), *y)).collect();
    correlation(&pairs)
}
