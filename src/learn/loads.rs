//! Ties a log to the program by its load alone. In: log, timeline, slower machines, job. Out: [`Aligned`].
//!
//! 1. Coarse: the load that each machine would have (the declared acceleration and lower ones) is found in the measured one
//!    by dynamic programming over the lag ([`super::matching`]); the machine with the best correlation is taken.
//! 2. Fine: in windows of the program the reading is y ≈ c₀ + (1 + c)·ŷ(T) − δ·ŷ′(T), by which every window observes its
//!    own shift δ beside its own level, with the variance σ²/Σŷ′². The drift is smoothed over the windows
//!    ([`super::drift`]); the acceleration is chosen under which it is the least surprising. ŷ is refitted (tare, cutting
//!    and edge part by robust least squares), and both are repeated.
//!    Where the stock may stand proud, the mill be smaller or an entry take more, cuts would seem to begin earlier or later
//!    than they do: what each of these adds to the load is fitted beside the other parts.
//! 3. A lag of the sensor looks like a late alignment: first-order lags are tried on ŷ, and kept where they lower the
//!    squares clearly, so that the alignment is that of the load and not of its echo.

use super::align::Aligned;
use super::cells::Known;
use super::clock::{Clock, Slower};
use super::drift::{Drift, Seen, drift, interpolated};
use super::holds::Holds;
use super::linear::{Loss, robust, scale_of};
use super::lines::likeliest;
use super::log::Log;
use super::matching::{Match, match_load};
use super::measured::{Measured, gridded, thinned};
use super::timeline::{Doing, Timeline};
use crate::force::contact::Engaged;
use crate::machine::material::{ForceModel, LinearEdge};
use crate::machine::{Job, Tool};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;

/// Lags beyond the difference in length that are searched, s.
const REACH_S: f64 = 20.0;
/// Uncertainty of a sample beside that of the drift, s.
const LEAST_S: f64 = 0.01;
/// Length of a window that observes its shift, s.
const WINDOW_S: f64 = 6.0;
/// Time over which the slope of the predicted load is taken, s, round by round.
const SLOPES_S: [f64; 8] = [0.4, 0.3, 0.2, 0.3, 0.2, 0.15, 0.1, 0.1];
/// Lags of the sensor that are tried, s.
const LAGS_S: [f64; 7] = [0.3, 0.5, 0.75, 1.0, 1.4, 2.0, 3.0];
/// Share of the squares that a lag must take away.
const LAG_PAYS: f64 = 0.3;
/// Factors on what steps of the lag and holds cost in the coarse match, falling, and the share of the squares that a looser match must
/// take away.
const STIFFNESS: [[f64; 2]; 4] = [[100.0, 100.0], [10.0, 100.0], [1.0, 10.0], [1.0, 1.0]];
const LOOSER_PAYS: f64 = 0.03;
/// Ratio of the accelerations of machines next to each other, and how often it is halved about the best of them.
const NEXT_MACHINE: f64 = 1.5;
const BETWEEN: usize = 3;
/// Round before which lags are tried.
const LAG_ROUND: usize = 3;
/// Parts of a load: tare, cutting, edge, run-up; what other geometries add, and what an entry may.
const PARTS: usize = 8;
/// Those that a load always has.
const SURE: usize = 4;
/// Factors on the parts before they are fitted.
const BEFORE_FIT: [f64; PARTS] = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
/// Way over which an entry may take more, mm.
const ENTRY_MM: f64 = 10.0;

/// Ties samples by the measured quantity `index`; `None` when it cannot be found in the program.
pub fn by_load(log: &Log, index: usize, known: &Known) -> Option<Aligned> {
    let (timeline, slower, job) = (known.timeline, known.slower.as_slice(), known.job);
    let force = log.measured[index].0.starts_with("force");
    let measured = thinned(log, index)?;
    let mut parts = parts(timeline, job, force);
    if !force {
        with_doubtful(&mut parts, known);
    }
    // What nobody declared makes the load differ as an error of the alignment would: a match that follows every difference
    // may go astray, one that follows none misses what happened. The loads as they are fitted in the end decide.
    let matches = coarse(&measured, timeline, slower, &parts);
    let tied: Vec<Tied> =
        matches.into_par_iter().filter_map(|found| tie(&measured, timeline, slower, &parts, found)).collect();
    let best =
        tied.into_iter().reduce(
            |stiffer, looser| {
                if looser.square < (1.0 - LOOSER_PAYS) * stiffer.square { looser } else { stiffer }
            },
        )?;
    let Tied { state, nats, holds, correlation, .. } = best;
    let running: Vec<f64> = log.time_s.iter().map(|t| holds.running_s(*t)).collect();
    let placed = state.walk.program_s(&running);
    let held = |t: &f64| holds.0.iter().any(|(from, to)| t > from && t < to);
    let placed: Vec<f64> =
        placed.into_iter().zip(&log.time_s).map(|(p, t)| if held(t) { f64::NAN } else { p }).collect();
    let pauses = holds.pauses(&state.walk);
    Some(Aligned {
        program_s: placed.iter().map(|t| state.clock.declared_s(timeline, *t)).collect(),
        method: "load",
        each_s: state.walk.deviations_s(&placed).into_iter().map(|s| s.hypot(LEAST_S)).collect(),
        uncertainty_s: state.walk.uncertainty_s().hypot(LEAST_S),
        misfit: (1.0 - correlation).clamp(0.0, 1.0),
        acceleration: (state.clock.factor < 1.0).then_some((state.clock.factor, nats)),
        pauses,
    })
}

/// A match that was followed to its end.
struct Tied {
    state: State,
    /// By how much the machine is likelier than the declared one.
    nats: f64,
    holds: Holds,
    /// Of the measured load and the fitted one, and the mean square of what it leaves.
    correlation: f64,
    square: f64,
}

/// Refines a match.
fn tie(
    measured: &Measured,
    timeline: &Timeline,
    slower: &[Slower],
    parts: &[Part],
    (clock, found): (Clock, Match),
) -> Option<Tied> {
    let holds = Holds::new(&found);
    let seen = matched(&found, &clock, &holds);
    let measured = measured.without(&holds);
    let mut state = State { walk: drift(&seen)?, clock, lag_s: 0.0, scale: 1.0 };
    let mut nats = 0.0;
    for (round, slope_s) in SLOPES_S.iter().enumerate() {
        let mut predicted = Predicted::new(timeline, &state.clock, parts, state.lag_s, measured.span_s);
        if round == LAG_ROUND {
            (state.lag_s, state.walk) = lagged(&measured, timeline, &state, parts);
            predicted = Predicted::new(timeline, &state.clock, parts, state.lag_s, measured.span_s);
        }
        let seen = shifts(&measured, &predicted, &mut state, *slope_s)?;
        let places: Vec<(Seen, (usize, f64))> =
            seen.iter().filter_map(|s| Some((*s, state.clock.place(s.at_s)?))).collect();
        let walk = |factor: f64| {
            let clock = Clock::new(timeline, slower, factor);
            let again = |(s, place): &(Seen, (usize, f64))| {
                let at_s = clock.time(*place);
                Seen { at_s, drift_s: s.at_s + s.drift_s - at_s, variance: s.variance }
            };
            let seen: Vec<Seen> = places.iter().map(again).collect();
            drift(&seen).map(|d| (clock, d))
        };
        if round <= LAG_ROUND + 1 {
            (state.clock, state.walk, nats) = likeliest(slower, &walk)?;
        } else {
            (state.clock, state.walk) = walk(state.clock.factor)?;
        }
    }
    let predicted = Predicted::new(timeline, &state.clock, parts, state.lag_s, measured.span_s);
    let square = squares(&measured, &predicted, &state.walk.program_s(&measured.time_s)) / measured.load.len() as f64;
    let correlation = correlation(&measured, &predicted, &state.walk);
    Some(Tied { state, nats, holds, correlation, square })
}

/// The present alignment.
struct State {
    clock: Clock,
    walk: Drift,
    lag_s: f64,
    /// Deviation of the residual.
    scale: f64,
}

/// One spot's parts: the sure ones as they are, of the others what cutting adds per mm/s and what edges add.
type Part = ([f64; SURE], [[f64; 2]; PARTS - SURE]);

/// Adds what the other geometries change, and what an entry may add: the load, falling to nothing over [`ENTRY_MM`].
fn with_doubtful(parts: &mut [Part], known: &Known) {
    let mut since_mm = 0.0;
    for (k, (spot, (sure, more))) in known.timeline.spots.iter().zip(parts.iter_mut()).enumerate() {
        let Some(coefficients) = known.job.tool(spot.tool).map(|tool| coefficients(known.job, tool)) else { continue };
        let declared = of_cut(&coefficients, &spot.engaged, spot.rps);
        for (slot, other) in more.iter_mut().zip(known.others.iter().take(PARTS - SURE - 1)) {
            let changed = of_cut(&coefficients, &other.engaged[k], spot.rps);
            *slot = [0, 1].map(|i| (changed[i] - declared[i]) / other.size_mm);
        }
        let left = (1.0 - since_mm / ENTRY_MM).max(0.0);
        more[PARTS - SURE - 1] = [sure[1] * left, sure[2] * left];
        since_mm = if spot.engaged.section_mm2 > 1e-6 { since_mm + spot.length_mm } else { 0.0 };
    }
}

fn coefficients(job: &Job, tool: &Tool) -> LinearEdge {
    match job.material(tool).map(|m| &m.model) {
        Some(ForceModel::LinearEdge(k)) => *k,
        _ => LinearEdge { k_tc: 1000.0, k_te: 15.0, ..LinearEdge::default() },
    }
}

/// Power of a cut: what cutting takes per mm/s, and edges.
fn of_cut(k: &LinearEdge, e: &Engaged, rps: f64) -> [f64; 2] {
    [1e-3 * k.k_tc * e.section_mm2, 1e-3 * k.k_te * e.contact_mm2 * rps]
}

/// Parts of the load of every spot by the declared coefficients: tare, cutting per mm/s, edge, and what the mass of the
/// spindle takes at the end of its run-up (in units of the tare).
fn parts(timeline: &Timeline, job: &Job, force: bool) -> Vec<Part> {
    let none = [[0.0; 2]; PARTS - SURE];
    timeline
        .spots
        .iter()
        .map(|spot| {
            let Some(tool) = job.tool(spot.tool) else { return ([0.0; SURE], none) };
            let k = coefficients(job, tool);
            let e = &spot.engaged;
            if force {
                let [tc, rc, te, re] = e.peak;
                let cutting = (tc * k.k_tc + rc * k.k_rc) / spot.speed_mm_s().max(1e-9);
                return ([0.0, cutting, te * k.k_te + re * k.k_re, 0.0], none);
            }
            let tare = if spot.rps > 0.0 { job.machine.spindle.tare_w.at(spot.rps).max(1.0) } else { 0.0 };
            let running = if spot.doing == Doing::RunUp { 1.0 } else { 0.0 };
            let [cutting, edge] = of_cut(&k, e, spot.rps);
            ([tare, cutting, edge, running * tare], none)
        })
        .collect()
}

/// Predicted parts of the load over program time.
struct Predicted {
    step_s: f64,
    parts: [Vec<f64>; PARTS],
    /// Factors on the parts.
    factors: [f64; PARTS],
}

impl Predicted {
    fn new(timeline: &Timeline, clock: &Clock, parts: &[Part], lag_s: f64, span_s: f64) -> Self {
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
            let turning = if timeline.spots[k].doing == Doing::RunUp { share.clamp(0.0, 1.0) } else { 1.0 };
            let ([tare, cutting, edge, run_up], more) = parts[k];
            let mut now = [0.0; PARTS];
            now[..SURE].copy_from_slice(&[tare * turning, cutting * speed, edge, run_up * turning]);
            now[SURE..].iter_mut().zip(more).for_each(|(n, [cutting, edge])| *n = cutting * speed + edge);
            for b in 0..PARTS {
                level[b] = if lag_s > 0.0 { now[b] + keep * (level[b] - now[b]) } else { now[b] };
                out[b].push(level[b]);
            }
        }
        for part in &mut out {
            smooth(part, span_s / step_s);
        }
        Self { step_s, parts: out, factors: BEFORE_FIT }
    }

    /// Linear between the middles of the steps, nothing outside the program.
    fn part(&self, b: usize, t: f64) -> f64 {
        let (part, at) = (&self.parts[b], t / self.step_s);
        if at < 0.0 || at >= part.len() as f64 {
            return 0.0;
        }
        let past = (at - 0.5).max(0.0);
        let k = past as usize;
        let next = part[(k + 1).min(part.len() - 1)];
        part[k] + (past - k as f64) * (next - part[k])
    }

    fn at(&self, t: f64) -> f64 {
        (0..PARTS).map(|b| self.factors[b] * self.part(b, t)).sum()
    }

    /// Change per second over `width` seconds.
    fn slope(&self, t: f64, width: f64) -> f64 {
        (self.at(t + 0.5 * width) - self.at(t - 0.5 * width)) / width
    }

    /// Mean over `width` seconds.
    fn mean(&self, t: f64, width: f64) -> f64 {
        (-2..=2).map(|k| self.at(t + width * f64::from(k) / 5.0)).sum::<f64>() / 5.0
    }
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

/// For every stiffness the best machine and where its load was found.
fn coarse(measured: &Measured, timeline: &Timeline, slower: &[Slower], parts: &[Part]) -> Vec<(Clock, Match)> {
    let end = measured.time_s.last().copied().unwrap_or(0.0);
    let step = (end / 3000.0).max(0.2);
    let on_grid = gridded(measured, step);
    let factors = std::iter::once(1.0).chain(slower.iter().map(|(f, _)| *f));
    let clocks = factors.map(|factor| Clock::new(timeline, slower, factor));
    let with_loads = |clock: Clock| {
        let predicted = Predicted::new(timeline, &clock, parts, 0.0, 0.0);
        let count = (clock.total_s() / step) as usize;
        let loads = (0..count).map(|i| predicted.mean((i as f64 + 0.5) * step, step)).collect();
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
            // A slower machine must fit clearly better; costs are in units of each match's own deviation and do not compare.
            if best.as_ref().is_none_or(|(least, ..)| tried.0 < 0.9 * least) {
                best = Some(tried);
            }
        }
        let mut best = best?;
        // Between the machines that were tried a stiff match follows none.
        let mut apart = NEXT_MACHINE;
        for _ in 0..if best.1.factor < 1.0 { BETWEEN } else { 0 } {
            apart = apart.sqrt();
            let beside = [apart, 1.0 / apart].map(|by| Clock::new(timeline, slower, (by * best.1.factor).min(1.0)));
            let tried = beside.into_iter().filter(short).filter_map(|clock| miss_of(&with_loads(clock)));
            best = tried.fold(best, |least, other| if other.0 < least.0 { other } else { least });
        }
        Some((best.1, best.2))
    };
    let mut matches: Vec<(Clock, Match)> = STIFFNESS.par_iter().filter_map(best).collect();
    let places = |found: &Match| found.program_s.iter().map(|t| t.to_bits()).collect::<Vec<u64>>();
    matches.dedup_by(|b, a| a.0.factor == b.0.factor && places(&a.1) == places(&b.1));
    matches
}

/// Drift that a match shows, window by window.
fn matched(found: &Match, clock: &Clock, holds: &Holds) -> Vec<Seen> {
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
            Seen { at_s: middle.0, drift_s: middle.1, variance: found.step_s.powi(2) }
        })
        .collect()
}

/// Refits the parts of the load and lets every window observe its own shift.
fn shifts(measured: &Measured, predicted: &Predicted, state: &mut State, width_s: f64) -> Option<Vec<Seen>> {
    let placed = state.walk.program_s(&measured.time_s);
    let (factors, scale) = refitted(measured, predicted, &placed)?;
    state.scale = scale;
    let predicted = Predicted { factors, parts: predicted.parts.clone(), ..*predicted };
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
            seen.push(Seen { at_s, drift_s: known + shift.clamp(-0.75, 0.75), variance });
        }
        first = last.max(first + 1);
    }
    Some(seen)
}

/// δ of r ≈ c₀ + c·ŷ − δ·ŷ′ and its variance; `None` where the load has no edge.
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
    // Levels that hardly vary have no factor of their own.
    normal[(1, 1)] += 10.0 * scale * scale / 0.04;
    normal[(2, 2)] += 1e-6;
    let inverse = normal.try_inverse()?;
    let found = inverse * rhs;
    // What is left need not be white, nor as small as elsewhere: neighbours count together.
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

/// Factors on the parts at this alignment, and the deviation of what is left.
fn refitted(measured: &Measured, predicted: &Predicted, placed: &[f64]) -> Option<([f64; PARTS], f64)> {
    let inside: Vec<usize> = (0..placed.len()).filter(|i| placed[*i].is_finite()).collect();
    let used: Vec<usize> = (0..PARTS).filter(|b| predicted.parts[*b].iter().any(|x| *x != 0.0)).collect();
    let x = DMatrix::from_fn(inside.len(), used.len(), |r, c| predicted.part(used[c], placed[inside[r]]));
    let y: Vec<f64> = inside.iter().map(|i| measured.load[*i]).collect();
    let fit = robust(&x, &y, &vec![1.0; y.len()], Loss::Huber)?;
    let mut factors = [0.0; PARTS];
    for (b, factor) in used.iter().zip(&fit.coefficients) {
        factors[*b] = *factor;
    }
    let top = y.iter().copied().fold(0.0, f64::max);
    Some((factors, scale_of(&fit.residuals).max(0.002 * top).max(1e-9)))
}

/// The lag of the sensor that lowers the squares most, with the alignment it asks for.
fn lagged(measured: &Measured, timeline: &Timeline, state: &State, parts: &[Part]) -> (f64, Drift) {
    let moved = |by: f64| {
        let drift_s = state.walk.drift_s.iter().map(|d| d + by).collect();
        Drift { drift_s, ..state.walk.clone() }
    };
    let mut best = (f64::INFINITY, 0.0, 0.0);
    for lag_s in std::iter::once(0.0).chain(LAGS_S) {
        let predicted = Predicted::new(timeline, &state.clock, parts, lag_s, measured.span_s);
        for k in 0..=8 {
            let by = -lag_s * f64::from(k) / 8.0;
            let squares = squares(measured, &predicted, &moved(by).program_s(&measured.time_s));
            let pays = if lag_s > 0.0 { 1.0 - LAG_PAYS } else { 1.0 };
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

/// Squares that the best factors on the parts leave.
fn squares(measured: &Measured, predicted: &Predicted, placed: &[f64]) -> f64 {
    let (mut normal, mut rhs, mut whole) = (DMatrix::<f64>::zeros(PARTS, PARTS), DVector::<f64>::zeros(PARTS), 0.0);
    for (t, y) in placed.iter().zip(&measured.load) {
        let x = DVector::from_fn(PARTS, |b, _| predicted.part(b, *t));
        normal.syger(1.0, &x, &x, 1.0);
        rhs.axpy(*y, &x, 1.0);
        whole += y * y;
    }
    let full =
        DMatrix::from_fn(PARTS, PARTS, |a, b| normal[(a.max(b), a.min(b))] + if a == b { 1e-9 * whole } else { 0.0 });
    full.cholesky().map_or(f64::INFINITY, |c| whole - rhs.dot(&c.solve(&rhs)))
}

fn correlation(measured: &Measured, predicted: &Predicted, walk: &Drift) -> f64 {
    let placed = walk.program_s(&measured.time_s);
    let Some((factors, _)) = refitted(measured, predicted, &placed) else { return 0.0 };
    let predicted = Predicted { factors, parts: predicted.parts.clone(), ..*predicted };
    let pairs: Vec<(f64, f64)> = placed.iter().zip(&measured.load).map(|(t, y)| (predicted.at(*t), *y)).collect();
    let n = pairs.len().max(1) as f64;
    let (mp, my) = (pairs.iter().map(|p| p.0).sum::<f64>() / n, pairs.iter().map(|p| p.1).sum::<f64>() / n);
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>();
    let spread = sum(&|p| (p.0 - mp).powi(2)) * sum(&|p| (p.1 - my).powi(2));
    if spread > 0.0 { sum(&|p| (p.0 - mp) * (p.1 - my)) / spread.sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A steady rise is its own mean, whatever the number of steps it is taken over.
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
        let predicted = Predicted { step_s: 0.02, parts, factors: BEFORE_FIT };
        for t in [0.01, 0.153, 0.5, 0.985] {
            assert!((predicted.part(0, t) - t).abs() < 1e-12, "{t}: {}", predicted.part(0, t));
        }
        assert_eq!([-0.001, 1.0].map(|t| predicted.part(0, t)), [0.0, 0.0]);
    }
}
