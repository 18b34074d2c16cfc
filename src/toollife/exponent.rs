//! The exponent p of the feed in the wear law, from readings. In: readings of the index with the lengths cut before them, for several exponents;
//! prior knowledge of the rate. Out: the exponent with its uncertainty, and the one to regulate with.
//!
//! The index is a + k W(p), W(p) = ∫ (f/f₀)^p ds. For each p from −1 to 2 the line is fitted as [`super::trend`] does it, with one
//! noise for all of them: that of the best. With a flat prior on p, its density is e^(−L(p)), L(p) being half the sum of the squared residuals
//! and of the squared distance of k from its prior, each in standard deviations. Two feeds determine p by the ratio of their rates. A single feed
//! other than f₀ determines it too, but only as well as k is known from tool to tool.
//!
//! A declared p is used as long as the readings do not refute it; after that p comes from the readings. A slower feed counts as sparing the tool
//! only if that is as probable as the assurance with which the tool has to last.

use super::trend::{self, Known, Reading};
pub use crate::machine::wear::{Lengths, POWERS};

/// From the lowest power to the highest, in this many steps.
const STEPS: usize = 30;
/// Its length.
const STEP: f64 = 3.0 / STEPS as f64;
/// Half the difference of squared deviations by which a declared power is refuted: the 0.995 quantile of χ² with one degree of
/// freedom is 7.88.
const REFUTED: f64 = 0.5 * 7.88;
/// Standard deviation of a power that is anything from −1 to 2: 3/√12. Readings that leave more than half of it tell nothing.
const ANYTHING: f64 = 0.866;
/// Readings that leave something to judge the line by.
const LEAST: usize = 3;

/// What readings say of the power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Mean.
    pub power: f64,
    /// Standard deviation.
    pub deviation: f64,
    /// Do they tell it at all?
    pub is_told: bool,
    /// Do they refute the declared one?
    pub refutes: bool,
    /// Probability that it is above 0: that a slower feed spares the tool.
    pub spares: f64,
}

/// The power from readings of the index, in order; `None` with fewer than three.
pub fn estimate(readings: &[(Lengths, f64)], known: &Known, declared: f64) -> Option<Estimate> {
    if readings.len() < LEAST {
        return None;
    }
    let at = |power: f64| -> Vec<Reading> {
        readings.iter().map(|(lengths, index)| Reading { at_m: lengths.at(power), index: *index }).collect()
    };
    // One run-in and one noise for all: those of the power that leaves the least.
    let fitted = POWERS.iter().chain([&declared]).filter_map(|power| trend::trend(&at(*power), known));
    let best = fitted.min_by(|a, b| a.run_in.cmp(&b.run_in).then(a.noise.total_cmp(&b.noise)))?;
    let cost = |power: f64| trend::misfit(&at(power)[best.run_in..], best.noise, known);
    let powers: Vec<f64> = (0..=STEPS).map(|k| POWERS[0] + STEP * k as f64).collect();
    let costs: Vec<f64> = powers.iter().map(|power| cost(*power)).collect();
    let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
    let density: Vec<f64> = costs.iter().map(|cost| (least - cost).exp()).collect();
    let sum = |of: &dyn Fn(f64) -> f64| powers.iter().zip(&density).map(|(power, d)| d * of(*power)).sum::<f64>();
    let power = sum(&|p| p) / sum(&|_| 1.0);
    let variance = sum(&|p| (p - power).powi(2)) / sum(&|_| 1.0);
    // What a step leaves open adds to it.
    let deviation = (variance + STEP * STEP / 12.0).sqrt();
    Some(Estimate {
        power,
        deviation,
        is_told: deviation < 0.5 * ANYTHING,
        refutes: cost(declared) > least + REFUTED,
        spares: sum(&|p| f64::from(u8::from(p > 0.0))) / sum(&|_| 1.0),
    })
}

/// The power to regulate with: the declared one while nothing refutes it, then that of the readings, but none above 0 unless it is above
/// 0 with the assurance asked for.
pub fn trusted(estimate: Option<&Estimate>, declared: f64, assurance: f64) -> f64 {
    match estimate.filter(|estimate| estimate.refutes) {
        None => declared,
        Some(estimate) if estimate.spares >= assurance => estimate.power.max(0.0),
        Some(estimate) => estimate.power.min(0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: Known = Known { rate: 0.5, rate_deviation: 0.11, noise: 3.0 };

    /// Ten readings, one every 30 m, at these ratios of the feed in turn; the index rises by `rate` ratio^power per metre.
    fn readings(rate: f64, power: f64, ratios: &[f64]) -> Vec<(Lengths, f64)> {
        let (mut lengths, mut index) = (Lengths::default(), 90.0);
        let reading = |ratio: &f64| {
            lengths = lengths.and(&Lengths(POWERS.map(|p| 30.0 * ratio.powf(p))));
            index += 30.0 * rate * ratio.powf(power);
            (lengths, index)
        };
        ratios.iter().cycle().take(10).map(reading).collect()
    }

    #[test]
    fn two_feeds_tell_the_power_whatever_the_rate() {
        for power in [-1.0, 0.0, 1.0, 2.0] {
            let found = estimate(&readings(0.6, power, &[0.5, 1.0]), &KNOWN, power).unwrap();
            assert!((found.power - power).abs() < 2.0 * found.deviation, "{power}: {found:?}");
            assert!(found.is_told && !found.refutes, "{power}: {found:?}");
            assert_eq!(trusted(Some(&found), power, 0.9), power);
        }
    }

    #[test]
    fn one_feed_tells_it_no_better_than_the_rate_is_known() {
        let alike = estimate(&readings(0.6, 1.0, &[1.0]), &KNOWN, 1.0).unwrap();
        assert!(!alike.is_told && !alike.refutes && alike.deviation > 0.8, "{alike:?}");
        // At half the feed the powers −1 and 1 differ by a factor of 4, the rates of tools by a fifth.
        let slow = estimate(&readings(0.5, -1.0, &[0.5]), &KNOWN, 1.0).unwrap();
        assert!(slow.refutes && slow.spares < 0.1, "{slow:?}");
        let loose = Known { rate_deviation: 5.0, ..KNOWN };
        assert!(!estimate(&readings(0.5, -1.0, &[0.5]), &loose, 1.0).unwrap().refutes);
        assert!(estimate(&readings(0.5, -1.0, &[0.5])[..2], &KNOWN, 1.0).is_none());
    }

    #[test]
    fn a_power_that_is_refuted_gives_way_and_spares_only_where_that_is_sure() {
        let found = |truth: f64, declared: f64| estimate(&readings(0.5, truth, &[0.5, 1.0]), &KNOWN, declared).unwrap();
        let wrong = found(-1.0, 1.0);
        assert!(wrong.refutes && trusted(Some(&wrong), 1.0, 0.9) < -0.7, "{wrong:?}");
        let spares = found(1.5, -1.0);
        assert!(spares.refutes && (trusted(Some(&spares), -1.0, 0.9) - 1.5).abs() < 0.3, "{spares:?}");
        // As likely above 0 as below.
        let neither = Estimate { power: 0.1, spares: 0.6, ..wrong };
        assert_eq!(trusted(Some(&neither), 1.0, 0.9), 0.0);
    }
}
