//! Decimal numbers of NC text. In: bytes. Out: the value and its length in bytes. Values are correctly rounded: numbers of up to 15 digits by
//! one exact division, longer ones by the standard library.

const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// Reads `[+-]digits[.digits]` at the start of `bytes`: at least one digit, no exponent. `None` when there is no number.
#[inline]
pub fn decimal(bytes: &[u8]) -> Option<(f64, usize)> {
    let (negative, sign) = match bytes.first() {
        Some(b'-') => (true, 1),
        Some(b'+') => (false, 1),
        _ => (false, 0),
    };
    let (at, mantissa) = run_of_digits(bytes, sign, 0);
    let (mut end, mut mantissa, mut digits, mut places) = (at, mantissa, at - sign, 0);
    if bytes.get(at) == Some(&b'.') {
        (end, mantissa) = run_of_digits(bytes, at + 1, mantissa);
        places = end - at - 1;
        digits += places;
    }
    if digits == 0 {
        return None;
    }
    let magnitude = if digits <= 15 { mantissa as f64 / POWERS[places] } else { long(&bytes[sign..end])? };
    Some((if negative { -magnitude } else { magnitude }, end))
}

/// Digits from `at` on, appended to `mantissa`: where they end, and the longer mantissa (meaningless beyond 19 digits).
#[inline]
fn run_of_digits(bytes: &[u8], mut at: usize, mut mantissa: u64) -> (usize, u64) {
    while let Some(&byte) = bytes.get(at) {
        let digit = byte.wrapping_sub(b'0');
        if digit > 9 {
            break;
        }
        mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
        at += 1;
    }
    (at, mantissa)
}

#[cold]
fn long(digits: &[u8]) -> Option<f64> {
    std::str::from_utf8(digits).ok()?.parse().ok().filter(|value: &f64| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_standard_library() {
        for text in
            ["0", "1", "-0.125", "+3.7", ".5", "5.", "123456789012345", "0.000000000000001", "-1234567.8901234567"]
        {
            let (value, used) = decimal(text.as_bytes()).unwrap();
            assert_eq!((value, used), (text.parse::<f64>().unwrap(), text.len()), "{text}");
        }
        assert_eq!(decimal(b"X"), None);
        assert_eq!(decimal(b"--5"), None);
        assert_eq!(decimal(b"."), None);
        assert_eq!(decimal(b"1e400"), Some((1.0, 1)));
        assert_eq!(decimal("9".repeat(400).as_bytes()), None, "no infinity");
    }
}
