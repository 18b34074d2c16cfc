//! Exact decimal numbers of NC words, and the style in which a file writes them. In: the bytes of a number, or a value with its number of
//! digits. Out: differences without rounding, and bytes in the style of the file.
//!
//! A [`Decimal`] is `units · 10^-digits` with whole `units`.

/// A number with a fixed count of digits after the point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decimal {
    units: i64,
    digits: u32,
}

/// Digits after the point beyond which no number is written or taken apart.
const MAX_DIGITS: u32 = 9;

fn power(digits: u32) -> i64 {
    10_i64.pow(digits)
}

impl Decimal {
    /// Reads a plain number (`-.5`, `600.`, `+1.250`); `None` when it is none, or too long to be added exactly.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let (sign, rest) = match bytes.first()? {
            b'-' => (-1, &bytes[1..]),
            b'+' => (1, &bytes[1..]),
            _ => (1, bytes),
        };
        let whole = rest.iter().take_while(|b| b.is_ascii_digit()).count();
        let fraction = rest.get(whole + 1..).unwrap_or(&[]);
        let pointed = rest.get(whole).is_none_or(|&b| b == b'.');
        let all = rest[..whole].iter().chain(fraction);
        if !pointed || !fraction.iter().all(u8::is_ascii_digit) || whole + fraction.len() == 0 {
            return None;
        }
        let digits = u32::try_from(fraction.len()).ok().filter(|&digits| digits <= MAX_DIGITS)?;
        let add = |sum: i64, &b: &u8| sum.checked_mul(10)?.checked_add(i64::from(b - b'0'));
        let units = all.copied().collect::<Vec<_>>().iter().try_fold(0_i64, add)?;
        (units < power(15)).then_some(Self { units: sign * units, digits })
    }
    /// The multiple of 10^-digits nearest to `value`.
    pub fn nearest(value: f64, digits: u32) -> Self {
        Self { units: (value * power(digits) as f64).round() as i64, digits }
    }
    /// The largest multiple of 10^-digits that is not above `value`, where a value within a millionth of a unit of a
    /// multiple counts as that multiple (it was computed from it).
    pub fn at_most(value: f64, digits: u32) -> Self {
        Self { units: (value * power(digits) as f64 + 1e-6).floor() as i64, digits }
    }
    /// The least number of so many digits that is not below a value, but for rounding.
    pub fn at_least(value: f64, digits: u32) -> Self {
        Self { units: (value * power(digits) as f64 - 1e-6).ceil() as i64, digits }
    }
    /// Its value.
    pub fn value(self) -> f64 {
        self.units as f64 / power(self.digits) as f64
    }
    /// Exact difference.
    pub fn minus(self, other: Self) -> Self {
        let digits = self.digits.max(other.digits);
        let scaled = |number: Self| number.units * power(digits - number.digits);
        Self { units: scaled(self) - scaled(other), digits }
    }
    /// Digits after the point.
    pub fn digits(self) -> u32 {
        self.digits
    }
    /// Is it zero?
    pub fn is_zero(self) -> bool {
        self.units == 0
    }
}

/// How a file writes a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NumberStyle {
    /// Digits after the point that are always written.
    pub digits: u32,
    /// Is a point written when nothing follows it (`600.`)?
    pub point: bool,
    /// Is the zero before the point written (`0.5`, not `.5`)?
    pub leading_zero: bool,
    /// Is a plus sign written?
    pub plus: bool,
    /// Digits before the point that are always written (`F0600`: 4); 0 and 1 mean nothing special.
    pub whole: u32,
}

impl NumberStyle {
    /// The style of one number; `leading_zero` is used if the number itself does not show it.
    pub fn of(number: &[u8], leading_zero: bool) -> Self {
        let plus = number.first() == Some(&b'+');
        let bare = number.iter().position(|b| b.is_ascii_digit() || *b == b'.').map_or(&[][..], |at| &number[at..]);
        let whole = bare.iter().take_while(|b| b.is_ascii_digit()).count();
        let padded = whole > 1 && bare[0] == b'0';
        let point = bare.get(whole) == Some(&b'.');
        let digits = if point { (bare.len() - whole - 1) as u32 } else { 0 };
        let leading_zero = match whole {
            0 => false,
            1 if bare[0] == b'0' && digits > 0 => true,
            _ => leading_zero,
        };
        Self { digits: digits.min(MAX_DIGITS), point, leading_zero, plus, whole: if padded { whole as u32 } else { 0 } }
    }
    /// Writes a number in this style, without zeros at the end that the style does not require.
    pub fn write(&self, number: Decimal) -> String {
        let (mut units, mut digits) = (number.units.unsigned_abs(), number.digits);
        while digits > self.digits && units.is_multiple_of(10) {
            units /= 10;
            digits -= 1;
        }
        while digits < self.digits {
            units *= 10;
            digits += 1;
        }
        let scale = power(digits) as u64;
        let mut whole = format!("{:0width$}", units / scale, width = self.whole as usize);
        if whole == "0" && digits > 0 && !self.leading_zero {
            whole.clear();
        }
        let fraction =
            if digits > 0 { format!("{:0width$}", units % scale, width = digits as usize) } else { String::new() };
        let point = if digits > 0 || self.point { "." } else { "" };
        let sign = if number.units < 0 {
            "-"
        } else if self.plus {
            "+"
        } else {
            ""
        };
        format!("{sign}{whole}{point}{fraction}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rewritten(like: &str, value: f64, digits: u32) -> String {
        NumberStyle::of(like.as_bytes(), true).write(Decimal::at_most(value, digits))
    }

    #[test]
    fn numbers_copy_the_manner_of_the_file() {
        assert_eq!(rewritten("600", 1240.0, 1), "1240");
        assert_eq!(rewritten("600", 1240.57, 1), "1240.5");
        assert_eq!(rewritten("600.", 1240.57, 0), "1240.");
        assert_eq!(rewritten("6000.0", 1240.0, 1), "1240.0");
        assert_eq!(rewritten(".5", 0.75, 2), ".75");
        assert_eq!(rewritten("0.5", 0.759, 2), "0.75");
        assert_eq!(rewritten("+5.00", 0.5, 2), "+0.50");
        assert_eq!(rewritten("0600", 75.0, 0), "0075");
        assert_eq!(rewritten("5", 0.5, 1), "0.5");
    }

    #[test]
    fn decimals_add_exactly() {
        let read = |text: &str| Decimal::read(text.as_bytes());
        let rest = read("0.3").unwrap().minus(read("0.1").unwrap()).minus(read(".2000").unwrap());
        assert!(rest.is_zero());
        assert_eq!(read("-12.50").unwrap().value(), -12.5);
        for bad in ["", ".", "-", "1.2.3", "1e4", "99999999999999999999", "1.0000000001"] {
            assert_eq!(read(bad), None, "{bad}");
        }
    }

    #[test]
    fn rounding_down_never_exceeds_and_keeps_grid_values() {
        assert_eq!(Decimal::at_most(1_239.999_999_999_9, 0).value(), 1240.0);
        assert_eq!(Decimal::at_most(1239.99, 0).value(), 1239.0);
    }
}
