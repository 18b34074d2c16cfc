//! Numbers that stand for many: median, spread, correlation. In: values. Out: one number.

/// Standard deviation from the median absolute value (normal consistent).
pub fn scale_of(residuals: &[f64]) -> f64 {
    let magnitudes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
    1.4826 * median(&magnitudes)
}

/// Median; 0 for no values.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => 0.0,
        n if n % 2 == 1 => sorted[n / 2],
        n => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}

/// Root mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Correlation of pairs; 0 where either does not vary.
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
    fn correlation_has_a_sign_and_knows_no_scale() {
        let pairs = |slope: f64| (0..9).map(|k| (f64::from(k), 3.0 + slope * f64::from(k))).collect::<Vec<_>>();
        assert!((correlation(&pairs(0.2)) - 1.0).abs() < 1e-12 && (correlation(&pairs(-7.0)) + 1.0).abs() < 1e-12);
        assert_eq!(correlation(&pairs(0.0)), 0.0);
        assert_eq!(correlation(&[]), 0.0);
    }
}
