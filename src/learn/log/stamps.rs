//! Time stamps of logs. In: a cell. Out: seconds: a plain number unchanged; a date and time (ISO 8601 or
//! day.month.year) since 1970; a time of day since midnight, continued over midnight within a column.

use jiff::Timestamp;
use jiff::civil::{Date, DateTime, Time};
use jiff::tz::TimeZone;

const DAY_S: f64 = 86_400.0;

/// Largest number that can be a reading in any unit (nanoseconds since 1970 are 1.8e18); larger ones are overflows or
/// sentinels (1e308, 3.4e38).
const MOST: f64 = 1e20;

/// A number as a reading; NaN (missing) if it is too large for one.
pub fn reading(number: f64) -> f64 {
    if number.abs() > MOST { f64::NAN } else { number }
}

/// Seconds since 1970 from a time stamp: a number, or a date and time with its offset, without one in UTC. `None` for
/// anything else and for dates that do not exist.
pub fn stamp_s(text: &str) -> Option<f64> {
    if let Ok(seconds) = text.parse::<f64>() {
        return Some(reading(seconds)).filter(|seconds| !seconds.is_nan());
    }
    let text = text.trim().replace(',', ".");
    let utc = || TimeZone::UTC.to_timestamp(text.parse::<DateTime>().ok().or_else(|| day_first(&text))?).ok();
    let stamp = text.parse::<Timestamp>().ok().or_else(utc)?;
    Some(stamp.as_second() as f64 + f64::from(stamp.subsec_nanosecond()) * 1e-9)
}

/// A date and time like `23.11.2026 12:34:56.7`.
fn day_first(text: &str) -> Option<DateTime> {
    let (date, time) = text.split_once([' ', 'T'])?;
    let parts: Vec<i16> = date.split('.').map(|part| part.parse().ok()).collect::<Option<_>>()?;
    let [day, month, year] = parts[..] else { return None };
    let date = Date::new(year, i8::try_from(month).ok()?, i8::try_from(day).ok()?).ok()?;
    Some(date.to_datetime(time.trim().parse::<Time>().ok()?))
}

/// Seconds since midnight from a time like `12:34:56.7` or `12:34:56,7`.
fn clock_s(text: &str) -> Option<f64> {
    let text = text.trim().replace(',', ".");
    let time = text.contains(':').then(|| text.parse::<Time>().ok())??;
    let whole = f64::from(time.hour()) * 3600.0 + f64::from(time.minute()) * 60.0 + f64::from(time.second());
    Some(whole + f64::from(time.subsec_nanosecond()) * 1e-9)
}

/// Is a cell a date or time of day, and no plain number?
pub fn is_stamp(text: &str) -> bool {
    text.parse::<f64>().is_err() && (clock_s(text).is_some() || stamp_s(text).is_some())
}

/// The times of a column, s; NaN if a cell cannot be read. A fall of the time of day by more than half a day is
/// midnight.
pub fn times_s(cells: &[String]) -> Vec<f64> {
    let (mut days, mut last) = (0.0, f64::NEG_INFINITY);
    let mut one = |cell: &String| {
        let Some(clock) = clock_s(cell) else { return stamp_s(cell).unwrap_or(f64::NAN) };
        if clock < last - 0.5 * DAY_S {
            days += DAY_S;
        }
        last = clock;
        days + clock
    };
    cells.iter().map(&mut one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_are_dates_of_a_calendar_with_or_without_an_offset() {
        assert_eq!(stamp_s("2017-02-02T19:03:08.25Z"), Some(1_486_062_188.25));
        assert_eq!(stamp_s("2017-02-02T20:03:08.25+01:00"), stamp_s("2017-02-02T19:03:08.25Z"));
        assert_eq!(stamp_s("2017-02-02T19:03:08.25"), stamp_s("2017-02-02T19:03:08.25Z"));
        assert_eq!(stamp_s("2017-02-02 19:03:08,25"), stamp_s("2017-02-02T19:03:08.25Z"));
        assert_eq!(stamp_s("02.02.2017 19:03:08.25"), stamp_s("2017-02-02T19:03:08.25Z"));
        assert_eq!(stamp_s("1970-01-02T00:00:01Z"), Some(86_401.0));
        assert_eq!(stamp_s("2000-03-01T00:00:00Z"), Some(951_868_800.0));
        assert_eq!(stamp_s("12.5"), Some(12.5));
        assert_eq!([stamp_s("1.8e18"), stamp_s("1e308"), stamp_s("inf")], [Some(1.8e18), None, None]);
        for wrong in ["", "2017-02-30T19:03:08Z", "2017-02-02T25:03:08Z", "31.02.2017 10:00:00", "yesterday"] {
            assert_eq!(stamp_s(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn times_of_day_go_on_over_midnight() {
        let cells = ["23:59:59.5", "00:00:00,5", "00:00:01"].map(str::to_owned);
        assert_eq!(times_s(&cells), [86_399.5, 86_400.5, 86_401.0]);
        assert!(is_stamp("10:00:00") && !is_stamp("12.5") && !is_stamp("up"));
    }
}
