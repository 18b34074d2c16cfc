//! Relative error of the predicted load of a cut. In: held-out residuals, predicted load of the cut in each sample.
//! Out: the standard deviation of the true load about the predicted one, as a share of it.
//!
//! A reading is y = ŷ + P·u + τ + ε: P the predicted load of the cut, u the relative error of that load, τ the error of
//! the tare, ε the noise of the sensor. The noise is independent from reading to reading, and no load of the process; u
//! and τ persist over neighbouring readings. The product of neighbouring residuals r = y − ŷ therefore has the mean
//!
//! mean of rᵢ rᵢ₊₁ = var(τ) + var(u)·Pᵢ Pᵢ₊₁
//!
//! without ε; autocorrelated noise adds to the first term as long as it does not grow with the load. Both terms follow
//! by least squares, var(τ) not below 0. Large loads weigh most: there limits act. Errors of the load that change
//! within one sample (a tenth of a second or more) are not seen. A table of steady cuts has no neighbouring readings;
//! the noise cannot be separated there, and the whole held-out error counts: mean of r² = var(u)·P².
//!
//! The errors u are common to a stretch of the log, and a log has few stretches. The standard error of var(u) follows
//! from leaving out each stretch in turn (jackknife: Efron and Stein 1981). The result is the square root of var(u)
//! plus one standard error, so that a log that shows no error by chance does not promise a perfect prediction.

use std::collections::BTreeMap;

use crate::learn::dataset::samples::Data;

/// Fewest pairs or cuts for a result.
const FEWEST: usize = 8;

/// Relative standard deviation of the load; see the head of the file. Residuals that are not finite are skipped; `None`
/// if too few are left.
pub fn scatter_of_load(data: &Data, residual: &[f64], cut: &[f64]) -> Option<f64> {
    let series = data.is_series();
    let products = if series { neighbours(data, residual, cut) } else { alone(data, residual, cut) };
    if products.iter().filter(|p| p.of_cut > 0.0).count() < FEWEST {
        return None;
    }
    let of = if series { slope_beside_level } else { slope };
    let sums = sums_by_stretch(&products);
    let whole = sums.iter().fold(Sums::default(), |sum, own| sum.plus(own, 1.0));
    let variance = of(&whole).filter(|v| v.is_finite())?;
    let without: Vec<f64> = sums.iter().filter_map(|own| of(&whole.plus(own, -1.0))).collect();
    Some((variance.max(0.0) + standard_error(&without)).sqrt())
}

/// √((S − 1)/S Σ (vₛ − v̄)²) of S estimates, each without one stretch.
fn standard_error(without: &[f64]) -> f64 {
    let n = without.len().max(1) as f64;
    let mean = without.iter().sum::<f64>() / n;
    ((n - 1.0) / n * without.iter().map(|v| (v - mean).powi(2)).sum::<f64>()).sqrt()
}

/// rᵢ rⱼ and Pᵢ Pⱼ of two readings, with their weight.
struct Product {
    of_residuals: f64,
    of_cut: f64,
    weight: f64,
    stretch: usize,
}

fn product(data: &Data, residual: &[f64], cut: &[f64], i: usize, j: usize) -> Option<Product> {
    let weight = (data.weight[i] * data.weight[j]).sqrt();
    let of_residuals = residual[i] * residual[j];
    let stretch = data.block[j];
    (weight > 0.0 && of_residuals.is_finite()).then_some(Product {
        of_residuals,
        of_cut: cut[i] * cut[j],
        weight,
        stretch,
    })
}

fn neighbours(data: &Data, residual: &[f64], cut: &[f64]) -> Vec<Product> {
    let beside = |i: &usize| data.run[i - 1] == data.run[*i] && data.channel[i - 1] == data.channel[*i];
    (1..data.len()).filter(beside).filter_map(|i| product(data, residual, cut, i - 1, i)).collect()
}

fn alone(data: &Data, residual: &[f64], cut: &[f64]) -> Vec<Product> {
    (0..data.len()).filter_map(|i| product(data, residual, cut, i, i)).collect()
}

/// Σ w, Σ w q, Σ w z, Σ w q², Σ w q z of products z of residuals and q of cuts.
#[derive(Clone, Copy, Default)]
struct Sums([f64; 5]);

impl Sums {
    fn plus(&self, other: &Self, times: f64) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + times * other.0[k]))
    }
}

fn sums_by_stretch(products: &[Product]) -> Vec<Sums> {
    let mut sums: BTreeMap<usize, Sums> = BTreeMap::new();
    for Product { of_residuals: z, of_cut: q, weight, stretch } in products {
        let own = sums.entry(*stretch).or_default();
        *own = own.plus(&Sums([1.0, *q, *z, q * q, q * z]), *weight);
    }
    sums.into_values().collect()
}

/// v of z = v·q by least squares.
fn slope(Sums([_, _, _, qq, qz]): &Sums) -> Option<f64> {
    (*qq > 0.0).then(|| qz / qq)
}

/// v of z = t + v·q with t ≥ 0, by least squares.
fn slope_beside_level(sums: &Sums) -> Option<f64> {
    let Sums([one, q, z, qq, qz]) = sums;
    let determinant = one * qq - q * q;
    if determinant <= 1e-9 * one * qq {
        return slope(sums);
    }
    let v = (one * qz - q * z) / determinant;
    if z - v * q < 0.0 { slope(sums) } else { Some(v) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::learn::regress::random::Chance;

    /// Uniform random number about 0 with this standard deviation.
    fn even(chance: &mut Chance, deviation: f64) -> f64 {
        (chance.unit() - 0.5) * 12.0_f64.sqrt() * deviation
    }

    /// Cuts of 100 to 500 W, ten samples each, with air between. Standard deviations: `u` of the load and `tare` W,
    /// both constant in a stretch, and `noise` W in each reading.
    fn residuals(u: f64, tare: f64, noise: f64, is_log: bool) -> (Data, Vec<f64>, Vec<f64>) {
        let mut chance = Chance::new(7);
        let (mut residual, mut cut) = (Vec::new(), Vec::new());
        for stretch in 0..400 {
            let watts = if stretch % 4 == 0 { 0.0 } else { 100.0 * (1 + stretch % 5) as f64 };
            let (off, base) = (even(&mut chance, u), even(&mut chance, tare));
            for _ in 0..10 {
                cut.push(watts);
                residual.push(watts * off + base + even(&mut chance, noise));
            }
        }
        let n = cut.len();
        let data = Data {
            reading: vec![0.0; n],
            weight: vec![1.0; n],
            state: vec![State::default(); n],
            run: (0..n).map(|i| if is_log { 0 } else { i }).collect(),
            channel: vec![0; n],
            block: (0..n).map(|i| i / 10).collect(),
            ..Data::default()
        };
        (data, residual, cut)
    }

    fn scatter(u: f64, tare: f64, noise: f64) -> f64 {
        let (data, residual, cut) = residuals(u, tare, noise, true);
        scatter_of_load(&data, &residual, &cut).unwrap()
    }

    #[test]
    fn what_the_model_misses_is_parted_from_the_noise_of_the_sensor() {
        // One pair in ten spans two stretches with independent errors: √0.9 of the 5 %. Above that the standard error
        // of the variance, a tenth with 300 stretches.
        assert!((0.044..0.058).contains(&scatter(0.05, 0.0, 0.0)), "{}", scatter(0.05, 0.0, 0.0));
        // A noise of 30 W, 10 % of the mean load, does not count.
        assert!((0.042..0.060).contains(&scatter(0.05, 0.0, 30.0)), "{}", scatter(0.05, 0.0, 30.0));
        let least = scatter(0.0, 0.0, 30.0);
        assert!(least > 0.0 && least < 0.02, "{least}");
    }

    #[test]
    fn a_log_of_few_stretches_promises_less() {
        let (all, residual, cut) = residuals(0.05, 0.0, 0.0, true);
        let mut few = all.clone();
        few.weight[150..].fill(0.0);
        // Ratio of the result to the best estimate.
        let by = |data: &Data| {
            let of = sums_by_stretch(&neighbours(data, &residual, &cut));
            let whole = of.iter().fold(Sums::default(), |sum, own| sum.plus(own, 1.0));
            scatter_of_load(data, &residual, &cut).unwrap() / slope_beside_level(&whole).unwrap().sqrt()
        };
        assert!(by(&all) > 1.0 && by(&all) < 1.1 && by(&few) > by(&all), "{} {}", by(&all), by(&few));
    }

    #[test]
    fn a_tare_that_wanders_is_no_load_of_the_cut() {
        assert!(scatter(0.0, 20.0, 10.0) < 0.035, "{}", scatter(0.0, 20.0, 10.0));
    }

    #[test]
    fn in_a_table_the_whole_error_counts() {
        let (data, residual, cut) = residuals(0.05, 0.0, 0.0, false);
        let whole = scatter_of_load(&data, &residual, &cut).unwrap();
        assert!((0.045..0.060).contains(&whole), "{whole}");
        let few: Vec<f64> = (0..residual.len()).map(|i| if i < 12 { residual[i] } else { f64::NAN }).collect();
        assert_eq!(scatter_of_load(&data, &few, &cut), None);
    }
}
