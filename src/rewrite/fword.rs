//! F numbers. In: a feed, the unit of F words in force, and how the file writes them. Out: the number to be written, rounded
//! down, so that what the control reads is never above the feed asked for.
//!
//! Per minute: F = 60 v / u; inverse time: F = 60 v / L (1/min for the block of length L); per revolution: F = v / (n u),
//! where v is the feed in mm/s, u the unit of length in mm, n the spindle speed in rev/s.

use crate::nc::{Dialect, FeedMode};
use crate::units;

use super::decimal::{Decimal, NumberStyle};

/// The unit an F word is in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedUnit {
    /// Per minute, inverse time, per revolution.
    pub mode: FeedMode,
    /// Millimetres in the unit of length of F ([`Dialect::feed_unit_mm`]).
    pub unit_mm: f64,
    /// Spindle speed, rev/s.
    pub rps: f64,
    /// Length of the block, mm.
    pub length_mm: f64,
    /// Feed of the tool centre over what F says ([`crate::nc::Feed::over_contour`]).
    pub over_contour: f64,
}

impl FeedUnit {
    /// F for a feed in mm/s.
    pub fn f_of(&self, feed_mm_s: f64) -> f64 {
        match self.mode {
            FeedMode::PerMinute => units::mm_min_from_mm_s(feed_mm_s) / (self.unit_mm * self.over_contour),
            FeedMode::InverseTime => units::mm_min_from_mm_s(feed_mm_s) / self.length_mm,
            FeedMode::PerRev => feed_mm_s / (self.rps * self.unit_mm * self.over_contour),
        }
    }
    /// Can a feed be said in this unit at all?
    pub fn is_usable(&self) -> bool {
        match self.mode {
            FeedMode::PerMinute => true,
            FeedMode::InverseTime => self.length_mm > 0.0,
            FeedMode::PerRev => self.rps > 0.0,
        }
    }
    fn digits(&self, dialect: Dialect) -> usize {
        let inch = self.unit_mm > 1.0;
        match self.mode {
            FeedMode::PerMinute => dialect.feed_digits(inch),
            FeedMode::InverseTime => 2,
            FeedMode::PerRev => 3 + usize::from(inch),
        }
    }
}

/// Most digits an F word may have after the point.
pub const MOST_DIGITS: u32 = 5;
/// Largest part of an F number in inverse time or per revolution that rounding may take.
const COARSEST: f64 = 0.005;

/// The F number for a feed: rounded down to the digits of the dialect or of the file, whichever are more; further digits
/// are added while the number would be zero or (other than per minute) coarser than 0.5 %.
pub fn round_down(feed_mm_s: f64, unit: FeedUnit, style: NumberStyle, dialect: Dialect) -> Option<Decimal> {
    let value = unit.f_of(feed_mm_s);
    if !unit.is_usable() || !value.is_finite() || value <= 0.0 || value > 1e9 {
        return None;
    }
    let first = (unit.digits(dialect) as u32).max(style.digits);
    let fine = |number: &Decimal| {
        let lost = value - number.value();
        !number.is_zero() && (unit.mode == FeedMode::PerMinute || lost <= COARSEST * value)
    };
    (first..=MOST_DIGITS.max(first)).map(|digits| Decimal::at_most(value, digits)).find(fine)
}

/// The whole F number for a feed, rounded down; `None` where that would be zero, or in inverse time or per revolution too coarse.
pub fn round_down_to_whole(feed_mm_s: f64, unit: FeedUnit) -> Option<Decimal> {
    let value = unit.f_of(feed_mm_s);
    if !unit.is_usable() || !value.is_finite() || value > 1e9 {
        return None;
    }
    let number = Decimal::at_most(value, 0);
    let fine = unit.mode == FeedMode::PerMinute || value - number.value() <= COARSEST * value;
    (value > 0.0 && !number.is_zero() && fine).then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(feed_mm_min: f64, mode: FeedMode, like: &str) -> Option<String> {
        let unit = FeedUnit { mode, unit_mm: 1.0, rps: 50.0, length_mm: 3.0, over_contour: 1.0 };
        let style = NumberStyle::of(like.as_bytes(), true);
        let number = round_down(units::mm_s_from_mm_min(feed_mm_min), unit, style, Dialect::Fanuc)?;
        Some(style.write(number))
    }

    #[test]
    fn feeds_are_rounded_down_in_their_own_unit() {
        assert_eq!(write(1240.9, FeedMode::PerMinute, "600").as_deref(), Some("1240"));
        assert_eq!(write(1240.97, FeedMode::PerMinute, "600.0").as_deref(), Some("1240.9"));
        assert_eq!(write(0.04, FeedMode::PerMinute, "600").as_deref(), Some("0.04"));
        // 1240 / 3 = 413.33 per minute; 1240 / 3000 = 0.41333 mm per revolution
        assert_eq!(write(1240.0, FeedMode::InverseTime, "1.").as_deref(), Some("413.33"));
        assert_eq!(write(1240.0, FeedMode::PerRev, ".1").as_deref(), Some(".413"));
        assert_eq!(write(0.0, FeedMode::PerMinute, "600"), None);
        assert_eq!(write(f64::NAN, FeedMode::PerMinute, "600"), None);
    }
}
