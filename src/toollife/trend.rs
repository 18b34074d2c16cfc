//! Trend of the wear index. In: readings of the index over the length cut, and prior knowledge of the rate. Out: [`Trend`]: a line with its
//! uncertainty, and the length at which the index reaches its end, with an interval.
//!
//! Length is counted as that at the reference feed ([`crate::machine::wear`]): a metre cut at feed f counts (f/f₀)^p. In this
//! count the index rises along a line, β(W) = a + k W, whatever the feeds were. The line is a least-squares fit with
//!
//! - the rate known beforehand, k ± scatter·k from tool to tool, as one more equation (Bayes' rule for a normal prior);
//! - Huber's weights (1964), so that one bad reading does not turn it;
//! - the first readings left out while they lie outside the line of those after them: an edge runs in before it wears evenly.
//!
//! The noise of a reading is pooled from the residuals and from its prior value; otherwise two readings would seem to lie exactly on their line.

use crate::numeric::{bisect, middle};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Residuals beyond this many deviations count less (Huber 1964: 95 % of the efficiency where nothing is wrong).
const HUBER: f64 = 1.345;
/// A first reading further than this many deviations from the line of the later ones belongs to the run-in.
const RUN_IN: f64 = 3.0;
/// Readings that must stay behind the run-in: a line, and one more to judge it by.
const LEAST: usize = 3;
/// Number of readings that the prior value of the noise counts for. Our judgement.
const PRIOR_READINGS: f64 = 3.0;

/// A reading of the index.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Length cut since the edge was fresh, at the reference feed, m.
    pub at_m: f64,
    /// Index.
    pub index: f64,
}

/// What is known before the readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// Rate of the index, per m at the reference feed.
    pub rate: f64,
    /// Its standard deviation from tool to tool.
    pub rate_deviation: f64,
    /// Standard deviation of one reading, in the unit of the index.
    pub noise: f64,
}

/// The line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trend {
    /// Where the line is known best, m at the reference feed.
    pub centre_m: f64,
    /// Index there.
    pub index: f64,
    /// Rate, per m.
    pub rate: f64,
    /// Variance of the index there.
    pub index_variance: f64,
    /// Variance of the rate; the two are independent at the centre.
    pub rate_variance: f64,
    /// Standard deviation of one reading about the line.
    pub noise: f64,
    /// Degrees of freedom of that.
    pub freedom: f64,
    /// First readings that were left out.
    pub run_in: usize,
    /// Readings whose weight is below a half.
    pub outliers: usize,
}

/// Fits the line; `None` without a reading. Readings in the order of their lengths.
pub fn trend(readings: &[Reading], known: &Known) -> Option<Trend> {
    let most = readings.len().saturating_sub(LEAST);
    let runs_in = |skip: &usize| {
        let Some(later) = line(&readings[skip + 1..], known) else { return false };
        let first = readings[*skip];
        (first.index - later.at(first.at_m)).abs() > RUN_IN * later.deviation_of_reading(first.at_m)
    };
    let run_in = (0..most).take_while(runs_in).count();
    line(&readings[run_in..], known).map(|trend| Trend { run_in, ..trend })
}

/// The robust line with its prior.
fn line(readings: &[Reading], known: &Known) -> Option<Trend> {
    let n = readings.len() as f64;
    let mut weights = vec![1.0; readings.len()];
    let mut noise = known.noise;
    let mut found = None;
    for _ in 0..30 {
        let trend = weighted(readings, &weights, noise, known)?;
        let residual = |reading: &Reading| reading.index - trend.at(reading.at_m);
        let squares: f64 = readings.iter().zip(&weights).map(|(r, w)| w * residual(r).powi(2)).sum();
        let freedom = PRIOR_READINGS + (n - 2.0).max(0.0);
        noise = ((PRIOR_READINGS * known.noise.powi(2) + squares) / freedom).sqrt();
        let weight = |reading: &Reading| (HUBER * noise / residual(reading).abs().max(1e-300)).min(1.0);
        weights = readings.iter().map(weight).collect();
        let outliers = weights.iter().filter(|weight| **weight < 0.5).count();
        found = Some(Trend { noise, freedom, outliers, ..trend });
    }
    found
}

/// Half the squared residuals about the line with this noise, beyond [`HUBER`] of them only linear, and the squared distance of the
/// rate from what was known of it, each in its deviations.
pub fn misfit(readings: &[Reading], noise: f64, known: &Known) -> f64 {
    let mut weights = vec![1.0; readings.len()];
    let mut cost = f64::INFINITY;
    for _ in 0..8 {
        let Some(trend) = weighted(readings, &weights, noise, known) else { return f64::INFINITY };
        let off: Vec<f64> = readings.iter().map(|r| ((r.index - trend.at(r.at_m)) / noise).abs()).collect();
        let huber = |off: &f64| if *off <= HUBER { 0.5 * off * off } else { HUBER * (off - 0.5 * HUBER) };
        let prior = (trend.rate - known.rate) / known.rate_deviation.max(1e-9 * known.rate);
        cost = off.iter().map(huber).sum::<f64>() + 0.5 * prior * prior;
        weights = off.iter().map(|off| (HUBER / off.max(1e-300)).min(1.0)).collect();
    }
    cost
}

fn weighted(readings: &[Reading], weights: &[f64], noise: f64, known: &Known) -> Option<Trend> {
    let sum = |of: &dyn Fn(&Reading) -> f64| readings.iter().zip(weights).map(|(r, w)| w * of(r)).sum::<f64>();
    let count = sum(&|_| 1.0);
    if count <= 0.0 {
        return None;
    }
    let centre_m = sum(&|r| r.at_m) / count;
    let index = sum(&|r| r.index) / count;
    // Information of the readings and of the prior, in units of 1/variance of a reading.
    let spread = sum(&|r| (r.at_m - centre_m).powi(2));
    let prior = if known.rate_deviation > 0.0 { (noise / known.rate_deviation).powi(2) } else { f64::INFINITY };
    let rate = if prior.is_finite() {
        (sum(&|r| (r.at_m - centre_m) * (r.index - index)) + prior * known.rate) / (spread + prior)
    } else {
        known.rate
    };
    Some(Trend {
        centre_m,
        index,
        rate,
        index_variance: noise.powi(2) / count,
        rate_variance: if prior.is_finite() { noise.powi(2) / (spread + prior) } else { 0.0 },
        noise,
        freedom: PRIOR_READINGS,
        run_in: 0,
        outliers: 0,
    })
}

impl Trend {
    /// Before any reading: an index that is known, and the rate as it is known.
    pub fn before(at_m: f64, index: f64, known: &Known) -> Self {
        Self {
            centre_m: at_m,
            index,
            rate: known.rate,
            index_variance: known.noise.powi(2),
            rate_variance: known.rate_deviation.powi(2),
            noise: known.noise,
            freedom: PRIOR_READINGS,
            run_in: 0,
            outliers: 0,
        }
    }
    /// Index at a length, m at the reference feed.
    pub fn at(&self, m: f64) -> f64 {
        self.index + self.rate * (m - self.centre_m)
    }
    /// Standard deviation of the line there.
    pub fn deviation(&self, m: f64) -> f64 {
        (self.index_variance + self.rate_variance * (m - self.centre_m).powi(2)).sqrt()
    }
    fn deviation_of_reading(&self, m: f64) -> f64 {
        self.deviation(m).hypot(self.noise)
    }
    /// Length at which the tool is worn out with this probability, m at the reference feed: the index there lies above its
    /// end with it. `end` and its standard deviation from tool to tool. `None`: at no length (the rise is not certain).
    pub fn worn_out_m(&self, probability: f64, end: f64, end_deviation: f64) -> Option<f64> {
        let t = StudentsT::new(0.0, 1.0, self.freedom.max(1.0)).ok()?.inverse_cdf(probability);
        // Positive where it is worn out with more than this probability.
        let over = |m: f64| self.at(m) - end - t * self.deviation(m).hypot(end_deviation);
        let (low, mut step) = (self.centre_m, 1.0);
        if over(low) >= 0.0 {
            // Past already, or not known better than to where the readings are.
            let likely_m = self.centre_m + (end - self.index) / self.rate;
            return (self.rate > 0.0).then(|| likely_m.min(self.centre_m));
        }
        while over(low + step) < 0.0 {
            step *= 2.0;
            if step > 1e7 {
                return None;
            }
        }
        Some(middle(bisect(|m| over(m) < 0.0, low, low + step, 80)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: Known = Known { rate: 0.3, rate_deviation: 0.06, noise: 3.0 };

    fn readings(of: impl Fn(f64) -> f64) -> Vec<Reading> {
        (1..=10).map(|k| 30.0 * f64::from(k)).map(|at_m| Reading { at_m, index: of(at_m) }).collect()
    }

    #[test]
    fn an_exact_line_is_found_and_its_end_too() {
        let trend = trend(&readings(|s| 150.0 + 0.4 * s), &Known { rate_deviation: 1e3, ..KNOWN }).unwrap();
        assert!((trend.rate - 0.4).abs() < 1e-6 && (trend.at(0.0) - 150.0).abs() < 1e-4 && trend.run_in == 0);
        let end_m = trend.worn_out_m(0.5, 400.0, 0.0).unwrap();
        assert!((end_m - 625.0).abs() < 0.01, "{end_m}");
        let [early, late] = [0.05, 0.95].map(|share| trend.worn_out_m(share, 400.0, 0.0).unwrap());
        assert!(early < 625.0 && 625.0 < late);
    }

    #[test]
    fn the_run_in_is_left_out_and_nothing_else() {
        let run_in = |s: f64| 150.0 + 0.3 * s - 40.0 * (-s / 25.0).exp();
        let found = trend(&readings(run_in), &KNOWN).unwrap();
        assert!((1..=3).contains(&found.run_in), "{}", found.run_in);
        let whole = line(&readings(run_in), &KNOWN).unwrap();
        let [off, off_whole] = [found, whole].map(|trend| (trend.rate - 0.3).abs());
        // What is left of the run-in behind the first reading, 3.6 N, is within the noise.
        assert!(off < 0.6 * off_whole, "{off} {off_whole}");
        // A first reading that is off by less than the noise stays in.
        let mut near = readings(|s| 150.0 + 0.3 * s);
        near[0].index -= 4.0;
        assert_eq!(trend(&near, &KNOWN).unwrap().run_in, 0);
        near[0].index -= 20.0;
        assert_eq!(trend(&near, &KNOWN).unwrap().run_in, 1);
    }

    #[test]
    fn one_bad_reading_does_not_turn_the_line() {
        let mut bad = readings(|s| 150.0 + 0.3 * s);
        bad[7].index += 80.0;
        let found = trend(&bad, &KNOWN).unwrap();
        assert_eq!(found.outliers, 1);
        assert!((found.rate - 0.3).abs() < 0.05, "{}", found.rate);
    }

    #[test]
    fn one_reading_says_the_level_and_leaves_the_rate_as_it_was_known() {
        let found = trend(&[Reading { at_m: 30.0, index: 170.0 }], &KNOWN).unwrap();
        assert_eq!([found.rate, found.index], [0.3, 170.0]);
        assert!((found.rate_variance.sqrt() / 0.06 - 1.0).abs() < 1e-9);
        assert!(trend(&[], &KNOWN).is_none());
    }

    #[test]
    fn a_rate_that_may_be_none_has_no_latest_end() {
        let loose = Known { rate_deviation: 1.0, noise: 20.0, ..KNOWN };
        let found = trend(&readings(|s| 150.0 + 0.01 * s)[..3], &loose).unwrap();
        assert_eq!(found.worn_out_m(0.99, 400.0, 0.0), None);
        assert!(found.worn_out_m(0.01, 400.0, 0.0).is_some());
    }
}
