//! Numbers for people. In: values. Out: texts with few significant digits, times, lengths in the unit of the program.

use crate::units::MM_PER_INCH;

/// Seconds as people read them.
pub fn clock(seconds: f64) -> String {
    if seconds < 60.0 {
        return format!("{seconds:.1} s");
    }
    let whole = seconds.round() as u64;
    let (hours, minutes, rest) = (whole / 3600, whole / 60 % 60, whole % 60);
    if hours > 0 { format!("{hours}:{minutes:02}:{rest:02} h") } else { format!("{minutes}:{rest:02} min") }
}

/// A length in the unit of the program.
pub fn length(mm: f64, inch: bool) -> String {
    if inch { format!("{} in", short(mm / MM_PER_INCH)) } else { format!("{} mm", short(mm)) }
}

/// Numbers from here on are shown with a power of ten: none that a shop deals with has ten digits before its point, and nobody counts
/// three hundred of a slip like `1e308`.
const PLAIN: f64 = 1e10;

/// Four significant digits.
pub fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value:.0}");
    }
    if value.abs() < 5e-7 {
        return "0".to_owned();
    }
    if value.abs() >= PLAIN {
        return format!("{value:.3e}");
    }
    let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// What holds the feeds, by the share of the cutting time.
/// A value to be written with this many decimals: what rounds to zero is 0, without a sign.
pub fn unsigned_zero(value: f64, decimals: i32) -> f64 {
    if value.abs() <= 0.5 * 10f64.powi(-decimals) { 0.0 } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_without_end_are_short() {
        assert_eq!([short(9_999_000_000.0), short(1e10), short(-1e308)], ["9999000000", "1.000e10", "-1.000e308"]);
        assert_eq!([short(0.0), short(12.345), short(0.000_000_1)], ["0", "12.35", "0"].map(str::to_owned));
    }
}
