//! Statistics of samples: median, scale, dot product, correlation. In: values. Out: one number.

/// 1.4826 times the median absolute value: the standard deviation if the residuals are normal.
pub fn scale_of(residuals: &[f64]) -> f64 {
    let magnitudes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
    1.4826 * median(&magnitudes)
}

/// Median; 0 for no values.
pub fn median(values: &[f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let mut parted = values.to_vec();
    let half = parted.len() / 2;
    let (below, middle, _) = parted.select_nth_unstable_by(half, f64::total_cmp);
    let middle = *middle;
    if values.len() % 2 == 1 {
        middle
    } else {
        0.5 * (below.iter().copied().fold(f64::NEG_INFINITY, f64::max) + middle)
    }
}

/// Partial sums of [`dot`]: as many as fill the widest registers often enough that no addition waits for the one before.
const SUMS: usize = 32;

/// Σ aᵢ bᵢ over the shorter length, the same to the last bit whatever registers the processor has.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || in_partial_sums(a, b),
    )
}

#[allow(clippy::inline_always, reason = "what is called from there keeps the narrow registers")]
#[inline(always)]
fn in_partial_sums(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let (a, b) = (a[..n].chunks_exact(SUMS), b[..n].chunks_exact(SUMS));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(x, y)| x * y).sum();
    let mut sums = [0.0; SUMS];
    for (x, y) in a.zip(b) {
        for k in 0..SUMS {
            sums[k] += x[k] * y[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Root mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Pearson correlation of pairs; 0 if either does not vary.
pub fn correlation(pairs: &[(f64, f64)]) -> f64 {
    let n = pairs.len().max(1) as f64;
    let (mx, my) = (pairs.iter().map(|p| p.0).sum::<f64>() / n, pairs.iter().map(|p| p.1).sum::<f64>() / n);
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (x, y) in pairs {
        xx += (x - mx).powi(2);
        yy += (y - my).powi(2);
        xy += (x - mx) * (y - my);
    }
    if xx > 0.0 && yy > 0.0 { xy / (xx * yy).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_of_products_is_that_of_a_loop_whatever_the_length() {
        for n in [0, 1, 7, 31, 32, 33, 64, 101] {
            let (a, b): (Vec<f64>, Vec<f64>) = (0..n).map(|k| (f64::from(k), 3.0 - f64::from(k % 5))).unzip();
            let plain: f64 = a.iter().zip(&b).map(|(x, y)| x * y).sum();
            assert!((dot(&a, &b) - plain).abs() <= 1e-12 * plain.abs());
        }
        assert_eq!(dot(&[1.0, 2.0, 3.0], &[4.0]), 4.0);
    }

    #[test]
    fn correlation_has_a_sign_and_knows_no_scale() {
        let pairs = |slope: f64| (0..9).map(|k| (f64::from(k), 3.0 + slope * f64::from(k))).collect::<Vec<_>>();
        assert!((correlation(&pairs(0.2)) - 1.0).abs() < 1e-12 && (correlation(&pairs(-7.0)) + 1.0).abs() < 1e-12);
        assert_eq!(correlation(&pairs(0.0)), 0.0);
        assert_eq!(correlation(&[]), 0.0);
    }
}
