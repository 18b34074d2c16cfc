//! Numbers of the page. In: a value. Out: the same with five significant digits, which is more than can be seen.

/// A value with five significant digits: more cannot be seen, and each digit is a byte of the page.
pub fn digits(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return 0.0;
    }
    let places = 4 - value.abs().log10().floor() as i32;
    // Text to number and back gives the shortest spelling.
    format!("{value:.*}", places.clamp(0, 12) as usize).parse().unwrap_or(value) + 0.0
}

#[cfg(test)]
mod tests {
    use super::digits;

    #[test]
    fn numbers_keep_five_digits() {
        let found = [1234.567, 0.012_345_67, -98.765_43, 0.0, f64::NAN, 123_456.7].map(digits);
        assert_eq!(found, [1234.6, 0.012_346, -98.765, 0.0, 0.0, 123_457.0]);
    }
}
