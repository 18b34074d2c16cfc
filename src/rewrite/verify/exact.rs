//! Exact decimal numbers for the proof. In: the bytes of a number. Out: sums and comparisons without rounding.

/// A plain number without rounding: so many billionths, and the digits behind its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exact {
    billionths: i128,
    digits: u32,
}

/// Digits behind the point beyond which no number is compared.
const MOST_DIGITS: u32 = 9;
/// Digits before the point beyond which none is.
const MOST_WHOLE: usize = 15;

impl Exact {
    /// Nothing.
    pub const ZERO: Self = Self { billionths: 0, digits: 0 };

    /// Reads `-.5`, `600.`, `+1.250`; `None`: no plain number, or one with more digits than are compared.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let text = std::str::from_utf8(bytes).ok()?;
        let unsigned = text.strip_prefix(['+', '-']).unwrap_or(text);
        let (whole, fraction) = unsigned.split_once('.').unwrap_or((unsigned, ""));
        let only_digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
        let digits = u32::try_from(fraction.len()).ok().filter(|digits| *digits <= MOST_DIGITS)?;
        if !only_digits(whole)
            || !only_digits(fraction)
            || whole.len() > MOST_WHOLE
            || whole.len() + fraction.len() == 0
        {
            return None;
        }
        let value = |part: &str| if part.is_empty() { Some(0) } else { part.parse::<i128>().ok() };
        let size = value(whole)? * 10_i128.pow(MOST_DIGITS) + value(fraction)? * 10_i128.pow(MOST_DIGITS - digits);
        Some(Self { billionths: if text.starts_with('-') { -size } else { size }, digits })
    }
    /// The sum.
    pub fn plus(self, other: Self) -> Self {
        Self { billionths: self.billionths + other.billionths, digits: self.digits.max(other.digits) }
    }
    /// The same number, however it is written?
    pub fn equals(self, other: Self) -> bool {
        self.billionths == other.billionths
    }
    /// Digits behind the point, as written.
    pub fn digits(self) -> u32 {
        self.digits
    }
    /// Its value.
    pub fn value(self) -> f64 {
        self.billionths as f64 / 1e9
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_exact() {
        let read = |text: &str| Exact::read(text.as_bytes());
        let sum = read("0.1").unwrap().plus(read(".2000").unwrap());
        assert!(sum.equals(read("+0.3").unwrap()) && sum.digits() == 4);
        assert!(!sum.equals(read("0.300000001").unwrap()));
        assert_eq!(read("-12.50").unwrap().value(), -12.5);
        for bad in ["", ".", "-", "1.2.3", "1e4", "1234567890123456", "1.0000000001", "--1", " 1"] {
            assert_eq!(read(bad), None, "{bad}");
        }
    }
}
