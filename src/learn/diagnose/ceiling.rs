//! Readings that stop at a ceiling whatever the load: a meter at the end of its range, a drive at its limit. In: [`Data`]. Out: the data
//! without those samples, and the ceiling, for each measured quantity that has one. A sample at the ceiling only says that the load is
//! larger.
//!
//! Two models are compared: ŷ = P and ŷ = min(P, C), P being the base model fitted to the samples below the ceiling C. C is accepted if
//! its score n/φ · ln(S₀/S) − 2 ln(n/φ) passes the threshold of an effect, and if the samples whose P lies above C look like a ceiling:
//! they scatter about C no more than others about P, and do not rise with P.

use crate::learn::dataset::samples::Data;
use crate::learn::diagnose::criteria::{Criteria, can_be_at_a_ceiling, is_ceiling};
use crate::learn::diagnose::residual::inflation;
use crate::learn::model::fit::fit;
use crate::learn::regress::statistics::rms;
use crate::learn::report::Ceiling;

/// Ceilings that are tried, between the largest reading and [`LOWEST`] of it.
const TRIED: usize = 30;
/// Lowest ceiling that is tried, over the largest reading. A lower one would cut off most of what was measured. Judgement.
const LOWEST: f64 = 0.4;
/// Rounds in which the samples at a ceiling and the base model are found from each other.
const ROUNDS: usize = 3;

/// The data without the samples at a ceiling, and the ceilings.
pub(in crate::learn) fn without_ceilings(data: &Data, criteria: &Criteria) -> (Data, Vec<Ceiling>) {
    let channels = data.channel.iter().max().map_or(0, |last| last + 1);
    let mut rest = data.clone();
    let mut ceilings = Vec::new();
    for channel in 0..channels {
        let Some(found) = ceiling(&rest, channel, criteria) else { continue };
        for i in &found.above {
            rest.weight[*i] = 0.0;
        }
        let name = data.channel_names.get(channel).cloned().unwrap_or_default();
        ceilings.push(Ceiling { name, reading: found.reading, samples: found.above.len() });
    }
    (rest, ceilings)
}

/// A ceiling and the samples whose load lies above it.
struct Found {
    reading: f64,
    above: Vec<usize>,
    squares: f64,
    /// Readings less min(P, C).
    residual: Vec<f64>,
    /// P.
    load: Vec<f64>,
}

/// The ceiling of a measured quantity.
fn ceiling(data: &Data, channel: usize, criteria: &Criteria) -> Option<Found> {
    let of_channel = |i: &usize| data.channel[*i] == channel;
    let used: Vec<usize> = data.used().filter(of_channel).collect();
    let largest = used.iter().map(|i| data.reading[*i]).fold(0.0, f64::max);
    let at = |k: usize| largest * (1.0 - (1.0 - LOWEST) * k as f64 / TRIED as f64);
    let best =
        (0..TRIED).filter_map(|k| at_ceiling(data, &used, at(k))).min_by(|a, b| a.squares.total_cmp(&b.squares))?;
    let plain = fit(data, &[], 0)?;
    let squares = |residual: &[f64]| used.iter().map(|i| data.weight[*i] * residual[*i].powi(2)).sum::<f64>();
    let n = used.len() as f64 / inflation(data, &best.residual);
    let gain = n * (squares(&plain.residuals(data)) / best.squares.max(1e-300)).ln();
    let is_clear = gain - 2.0 * n.max(2.0).ln() > criteria.least_score(data.is_series());
    (is_clear && is_level(data, &used, &best)).then_some(best)
}

/// The base model and the samples above a ceiling, found from each other.
fn at_ceiling(data: &Data, used: &[usize], ceiling: f64) -> Option<Found> {
    let mut above: Vec<usize> = used.iter().copied().filter(|i| data.reading[*i] >= ceiling).collect();
    let mut load = Vec::new();
    for _ in 0..ROUNDS {
        let mut weight = data.weight.clone();
        for i in &above {
            weight[*i] = 0.0;
        }
        let fitted = fit(&data.with_weights(weight), &[], 0)?;
        above = used.iter().copied().filter(|i| fitted.predicted[*i] > ceiling).collect();
        load = fitted.predicted;
    }
    if !can_be_at_a_ceiling(above.len(), used.len()) {
        return None;
    }
    // The level is the mean of the readings at it; what was tried only says which they are.
    let weight: f64 = above.iter().map(|i| data.weight[*i]).sum();
    let reading = above.iter().map(|i| data.weight[*i] * data.reading[*i]).sum::<f64>() / weight;
    let residual: Vec<f64> = data.reading.iter().zip(&load).map(|(y, p)| y - p.min(reading)).collect();
    let squares = used.iter().map(|i| data.weight[*i] * residual[*i].powi(2)).sum();
    Some(Found { reading, above, squares, residual, load })
}

/// Do the samples above a ceiling lie on it?
fn is_level(data: &Data, used: &[usize], found: &Found) -> bool {
    let is_above = |i: &usize| found.above.contains(i);
    let residuals = |of: &dyn Fn(&usize) -> bool| -> Vec<f64> {
        used.iter().filter(|i| of(i)).map(|i| found.residual[*i]).collect()
    };
    // Others under a load that is not small: where nothing is cut the noise is less.
    let others = rms(&residuals(&|i| !is_above(i) && data.reading[*i] > 0.5 * found.reading));
    let n = found.above.len() as f64;
    let loads: Vec<f64> = found.above.iter().map(|i| found.load[*i]).collect();
    let mean_load = loads.iter().sum::<f64>() / n;
    let spread: f64 = loads.iter().map(|load| (load - mean_load).powi(2)).sum();
    let along: f64 = found.above.iter().zip(&loads).map(|(i, load)| (load - mean_load) * found.residual[*i]).sum();
    is_ceiling(rms(&residuals(&is_above)), mean_load - found.reading, others, along / spread.max(1e-300))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::learn::diagnose::made_data::{BLOCKS, EACH, made};

    /// Ceilings of readings that are this of their loads of 100 to 160, with a noise between −2 and 2.
    fn found(reading: impl Fn(f64) -> f64) -> Vec<Ceiling> {
        let mut data = made(|_| 0.0, 0.0, |i| State { time_s: i as f64, ..State::default() });
        let noise = |i: usize| 2.0 * (((i * 7919) % 101) as f64 / 50.0 - 1.0);
        data.reading.iter_mut().enumerate().for_each(|(i, y)| *y = reading(*y) + noise(i));
        without_ceilings(&data, &Criteria::default()).1
    }

    #[test]
    fn readings_that_stop_at_a_level_are_left_out_and_said() {
        let ceilings = found(|load| load.min(135.0));
        assert_eq!(ceilings.len(), 1);
        // 140, 150 and 160 of seven loads.
        assert!((ceilings[0].reading / 135.0 - 1.0).abs() < 0.005 && ceilings[0].samples == BLOCKS * EACH * 3 / 7);
        let most = found(|load| load.min(115.0));
        assert_eq!(most.iter().map(|each| each.samples).collect::<Vec<_>>(), [BLOCKS * EACH * 5 / 7]);
    }

    #[test]
    fn a_ceiling_may_rise_a_little_with_the_load_and_scatter_a_little_more_than_the_rest() {
        let rising = |slope: f64| found(|load| if load > 135.0 { 140.0 + slope * (load - 150.0) } else { load }).len();
        assert_eq!([0.2, 0.4].map(rising), [1, 0]);
        // Beside the noise of ±2, whose root mean square is 1.2: readings by turns above and below the level.
        let scattered = |by: f64| {
            let turn = std::cell::Cell::new(1.0);
            let at_level = |load: f64| {
                turn.set(-turn.get());
                if load > 135.0 { 135.0 + by * turn.get() } else { load }
            };
            found(at_level).len()
        };
        assert_eq!([0.5, 3.0].map(scattered), [1, 0]);
    }

    #[test]
    fn readings_that_go_on_rising_have_no_ceiling_nor_has_a_level_of_most_of_them() {
        assert_eq!(found(|load| load), []);
        assert_eq!(found(|load| load.min(135.0 + 0.5 * (load - 135.0))), []);
        // 110 to 160 of seven loads.
        assert_eq!(found(|load| load.min(105.0)), []);
    }
}
