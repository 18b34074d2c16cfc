//! Finds a predicted load P in a measured one y by dynamic time warping. In: both on a grid of time. Out: [`Match`].
//!
//! The lag d(t) = log time − program time is found by dynamic programming (Viterbi) over a grid of lags. Cost: Σ
//! min(((y(t) − a − b·P(t − d))/s)², 9) + λ per step of the lag + μ per hold (the program stands, at any load). a, b
//! and s come from matching quantiles in the first round, and from robust regression at the present alignment in two
//! more. Where nothing was measured (NaN) only changes of the lag cost. A change of feed override is a series of steps
//! of the lag.

use crate::learn::regress::linear::{Loss, robust_coefficients};
use crate::learn::regress::statistics::{correlation, scale_of};
use nalgebra::DMatrix;

/// A measured load aligned with the predicted one.
#[derive(Debug, Clone, PartialEq)]
pub struct Match {
    /// Program time of each measured grid point, s; NaN outside the program.
    pub program_s: Vec<f64>,
    /// Was something measured there?
    pub known: Vec<bool>,
    /// Mean cost per grid point: about 1 for a perfect match.
    pub cost: f64,
    /// Correlation of measured and predicted load where they overlap.
    pub correlation: f64,
    /// Grid, s.
    pub step_s: f64,
}

/// Cost of a step of the lag, λ. Judgement, like the other costs.
const STEP_COST: f64 = 6.0;
/// Cost of a hold, μ, and of every grid point in it: while the program is held the load is unknown, but it does not
/// change.
const HOLD_COST: f64 = 60.0;
const HELD_COST: f64 = 3.0;
const CAP: f64 = 9.0;
/// Number of quantiles by which the loads are compared in the first round, and s then, as a share of the standard
/// deviation of the measured load.
const RANKS: usize = 200;
const RANK_DEVIATION: f64 = 0.3;

/// Matches `measured` to `predicted`, both on a grid of `step_s`, with lags up to `reach_s` either way beyond the
/// difference in length; steps of the lag and holds cost `stiffness` times as much.
pub fn match_load(
    measured: &[f64],
    predicted: &[f64],
    step_s: f64,
    reach_s: f64,
    stiffness: [f64; 2],
) -> Option<Match> {
    if measured.len() < 50 || predicted.len() < 50 {
        return None;
    }
    let extra = (measured.len() as f64 - predicted.len() as f64) * step_s;
    let low = ((extra.min(0.0) - reach_s) / step_s).floor() as i64;
    let high = ((extra.max(0.0) + reach_s) / step_s).ceil() as i64;
    let (mut lags, mut cost) = (Vec::new(), f64::INFINITY);
    for round in 0..3 {
        let (a, b, s) = if round == 0 { by_rank(measured, predicted) } else { regression(measured, predicted, &lags)? };
        let scaled: Vec<f64> = predicted.iter().map(|p| a + b * p).collect();
        let standing = measured_floor(measured);
        (lags, cost) = viterbi(measured, &scaled, s, low..=high, standing, stiffness);
    }
    let program_s: Vec<f64> = lags
        .iter()
        .enumerate()
        .map(|(i, lag)| {
            let k = i as i64 - lag;
            if k >= 0 && (k as usize) < predicted.len() { k as f64 * step_s } else { f64::NAN }
        })
        .collect();
    let correlation = overlap(measured, predicted, &program_s, step_s);
    Some(Match { program_s, known: measured.iter().map(|y| y.is_finite()).collect(), cost, correlation, step_s })
}

/// Reading outside the program, while the spindle stands: the 1 % quantile.
fn measured_floor(measured: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = measured.iter().copied().filter(|y| y.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 100]
}

/// a, b of y ≈ a + b P between equal quantiles of the two loads, and s.
fn by_rank(measured: &[f64], predicted: &[f64]) -> (f64, f64, f64) {
    let sorted = |values: &[f64]| {
        let mut known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        known.sort_by(f64::total_cmp);
        known
    };
    let (y, p) = (sorted(measured), sorted(predicted));
    let at = |of: &[f64], k: usize| of[(2 * k + 1) * of.len() / (2 * RANKS)];
    let mean = |of: &[f64]| (0..RANKS).map(|k| at(of, k)).sum::<f64>() / RANKS as f64;
    let (my, mp) = (mean(&y), mean(&p));
    let product = |u: &[f64], mu: f64, v: &[f64], mv: f64| {
        (0..RANKS).map(|k| (at(u, k) - mu) * (at(v, k) - mv)).sum::<f64>() / RANKS as f64
    };
    let b = (product(&y, my, &p, mp) / product(&p, mp, &p, mp).max(1e-18)).max(1e-9);
    (my - b * mp, b, (RANK_DEVIATION * product(&y, my, &y, my).sqrt()).max(1e-9))
}

/// a, b of y ≈ a + b P at these lags by robust regression, and the robust standard deviation s.
fn regression(measured: &[f64], predicted: &[f64], lags: &[i64]) -> Option<(f64, f64, f64)> {
    let pairs: Vec<(f64, f64)> = (0..measured.len())
        .filter_map(|i| {
            let k = i as i64 - lags[i];
            let both = k >= 0 && (k as usize) < predicted.len() && measured[i].is_finite();
            both.then(|| (predicted[k as usize], measured[i]))
        })
        .collect();
    let x = DMatrix::from_fn(pairs.len(), 2, |i, j| if j == 0 { 1.0 } else { pairs[i].0 });
    let y: Vec<f64> = pairs.iter().map(|p| p.1).collect();
    let (found, residuals) = robust_coefficients(&x, &y, &vec![1.0; y.len()], Loss::Tukey)?;
    let top = y.iter().copied().fold(0.0, f64::max);
    Some((found[0], found[1].max(1e-9), scale_of(&residuals).max(0.01 * top).max(1e-9)))
}

/// The lags of least cost. At every time the machine runs or is held; while it is held the lag grows with time.
fn viterbi(
    measured: &[f64],
    scaled: &[f64],
    s: f64,
    lags: std::ops::RangeInclusive<i64>,
    standing: f64,
    stiffness: [f64; 2],
) -> (Vec<i64>, f64) {
    let low = *lags.start();
    let states = (lags.end() - low + 1) as usize;
    let [step_cost, hold_cost] = [STEP_COST * stiffness[0], HOLD_COST * stiffness[1]];
    let n = measured.len();
    let cost = |off: f64| if off.is_finite() { (off / s).powi(2).min(CAP) } else { 0.0 };
    // The expected load at the lags of one time lies in one piece: that of lag d at time i is the (n − 1 − i + d)-th.
    let at = |m: usize| usize::try_from(n as i64 - 1 - m as i64 - low).ok().and_then(|k| scaled.get(k)).copied();
    let expected: Vec<f64> = (0..n + states).map(|m| at(m).unwrap_or(standing)).collect();
    let expected_at = |i: usize| &expected[n - 1 - i..n - 1 - i + states];
    // With a lag beyond either end, which no way leads through.
    let beyond = f64::INFINITY;
    let mut runs = vec![beyond; states + 2];
    runs[1..=states].iter_mut().zip(expected_at(0)).for_each(|(r, e)| *r = cost(measured[0] - e));
    let mut held = vec![beyond; states + 1];
    // Predecessor of a running state: 0 the same lag, 1 one less (the machine is slower), 2 one more, 3 held. Of a held
    // state: 1 held, 0 running.
    let mut from = vec![[0u8; 2]; n * states];
    let (mut next_runs, mut next_held) = (runs.clone(), held.clone());
    for i in 1..n {
        let (changes, expected) = (cost(measured[i] - measured[i - 1]), expected_at(i));
        let from = &mut from[i * states..(i + 1) * states];
        for d in 0..states {
            let (less, same, more) = (runs[d] + step_cost, runs[d + 1], runs[d + 2] + step_cost);
            let mut best = (same, 0u8);
            for way in [(less, 1), (more, 2), (held[d + 1], 3)] {
                best = if way.0 < best.0 { way } else { best };
            }
            next_runs[d + 1] = best.0 + cost(measured[i] - expected[d]);
            let (begins, goes_on) = (runs[d] + hold_cost, held[d]);
            next_held[d + 1] = begins.min(goes_on) + HELD_COST + changes;
            from[d] = [best.1, u8::from(goes_on <= begins)];
        }
        std::mem::swap(&mut runs, &mut next_runs);
        std::mem::swap(&mut held, &mut next_held);
    }
    let runs = &runs[1..=states];
    let mut d = (0..states).min_by(|a, b| runs[*a].total_cmp(&runs[*b])).unwrap_or(0);
    let total = runs[d] / n as f64;
    let mut lags = vec![0; n];
    let mut is_held = false;
    for i in (0..n).rev() {
        lags[i] = low + d as i64;
        let [running, holding] = from[i * states + d];
        match (is_held, running) {
            (true, _) => (d, is_held) = (d.saturating_sub(1), holding == 1),
            (false, 1) => d -= 1,
            (false, 2) => d += 1,
            (false, 3) => {
                is_held = true;
            }
            _ => {}
        }
    }
    without_leading_hold(&mut lags);
    (lags, total)
}

/// A hold with which the log begins is none: nothing of the program ran before it. What stands there is before the program, or a part of it
/// whose load is far from the predicted one, as a tare that is still cold is; the lag behind the hold holds there too.
fn without_leading_hold(lags: &mut [i64]) {
    let Some(end) = (LATEST_BEGIN..lags.len()).find(|i| lags[*i] != lags[i - 1] + 1) else { return };
    if end > LATEST_BEGIN {
        let behind = lags[end - 1];
        lags[..end].fill(behind);
    }
}

/// Steps of the grid (0.2 s or more) after which a hold at the latest counts as one with which the log begins: the match may run one or two before
/// standing is cheaper. Judgement.
const LATEST_BEGIN: usize = 3;

/// Correlation of both loads where they overlap.
fn overlap(measured: &[f64], predicted: &[f64], program_s: &[f64], step_s: f64) -> f64 {
    let pairs: Vec<(f64, f64)> = measured
        .iter()
        .zip(program_s)
        .filter(|(y, t)| y.is_finite() && t.is_finite())
        .map(|(y, t)| (*y, predicted[((t / step_s).round() as usize).min(predicted.len() - 1)]))
        .collect();
    correlation(&pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pulses(n: usize) -> Vec<f64> {
        (0..n).map(|i| if (i / 17 + i / 41) % 2 == 0 { 0.0 } else { 100.0 + ((i / 41) % 5) as f64 * 30.0 }).collect()
    }

    #[test]
    fn finds_offset_and_a_pause() {
        let predicted = pulses(600);
        let mut measured = vec![0.0; 25];
        measured.extend(&predicted[..300]);
        measured.extend([predicted[299]; 12]);
        measured.extend(&predicted[300..]);
        let noisy: Vec<f64> =
            measured.iter().enumerate().map(|(i, y)| y * 1.3 + 40.0 + ((i * 7919) % 13) as f64 - 6.0).collect();
        let m = match_load(&noisy, &predicted, 0.1, 5.0, [1.0; 2]).unwrap();
        assert!((m.program_s[125] - 10.0).abs() < 0.11, "{}", m.program_s[125]);
        assert!((m.program_s[437] - 40.0).abs() < 0.11, "{}", m.program_s[437]);
        assert!(m.correlation > 0.95);
    }

    /// The lag behind a hold with which the log begins holds there too; a hold further on stays one.
    #[test]
    fn a_log_does_not_begin_with_a_hold() {
        let mut lags = vec![-3, -2, -1, 0, 1, 2, 2, 2, 3, 4, 5, 5];
        without_leading_hold(&mut lags);
        assert_eq!(lags, [2, 2, 2, 2, 2, 2, 2, 2, 3, 4, 5, 5]);
        let mut after_two = vec![0, 0, 0, 1, 2, 3, 3];
        without_leading_hold(&mut after_two);
        assert_eq!(after_two, [3; 7]);
        let mut late = vec![0, 0, 0, 0, 1, 2, 3, 3];
        without_leading_hold(&mut late);
        assert_eq!(late, [0, 0, 0, 0, 1, 2, 3, 3]);
    }
}
