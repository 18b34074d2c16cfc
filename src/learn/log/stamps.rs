//! Time stamps of logs. In: a cell. Out: seconds: a plain number unchanged; a date and time (ISO 8601, day.month.year, month/day/year or
//! year/month/day) since 1970; a time of day since midnight, of 24 hours or of twelve with AM and PM, continued over midnight within a column.
//! A column that counts days as spreadsheets do, or thousandths, millionths or billionths of a second from 1970, is recognised by its size.

use crate::learn::regress::statistics::median;
use jiff::Timestamp;
use jiff::civil::{Date, DateTime, Time};
use jiff::tz::TimeZone;

const DAY_S: f64 = 86_400.0;
const HOUR_S: f64 = 3_600.0;

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

/// A date and time like `23.11.2026 12:34:56.7`, `11/23/2026 12:34:56 PM` or `2026/11/23 12:34:56`. With strokes the month comes before the day
/// unless it cannot be one: which of the two is meant changes the time between two readings at the end of a month only.
fn day_first(text: &str) -> Option<DateTime> {
    let (date, time) = text.split_once([' ', 'T'])?;
    let with_strokes = date.contains('/');
    let parts: Vec<i16> = date.split(['.', '/']).map(|part| part.parse().ok()).collect::<Option<_>>()?;
    let [day, month, year] = match parts[..] {
        [year, month, day] if with_strokes && year > 31 => [day, month, year],
        [month, day, year] if with_strokes && month <= 12 => [day, month, year],
        [day, month, year] => [day, month, year],
        _ => return None,
    };
    let date = Date::new(year, i8::try_from(month).ok()?, i8::try_from(day).ok()?).ok()?;
    Some(date.to_datetime(time_of_day(time)?))
}

/// A time of day like `12:34:56.7`, `12:34:56:700`, or `1:34:56 PM`: 12 AM is midnight, 12 PM noon.
fn time_of_day(text: &str) -> Option<Time> {
    let mut text = text.trim().to_ascii_lowercase();
    if let Some((whole, thousandths)) = text.rsplit_once(':').filter(|(whole, _)| whole.matches(':').count() == 2) {
        text = format!("{whole}.{thousandths}");
    }
    let half = [("am", 0), ("pm", 12)].into_iter().find_map(|(half, add)| Some((text.strip_suffix(half)?, add)));
    let two_digits = |clock: &str| if clock.find(':') == Some(1) { format!("0{clock}") } else { clock.to_owned() };
    let Some((clock, add)) = half else { return two_digits(&text).parse().ok() };
    let time = two_digits(clock.trim()).parse::<Time>().ok().filter(|time| (1..=12).contains(&time.hour()))?;
    time.with().hour(time.hour() % 12 + add).build().ok()
}

/// Seconds within an hour from minutes and seconds with a fraction, `34:56.7`, as spreadsheets show times.
fn minutes_s(text: &str) -> Option<f64> {
    let (minutes, seconds) = text.trim().split_once(':')?;
    let seconds = Some(seconds.replace(',', ".")).filter(|seconds| seconds.contains('.'))?;
    let [minutes, seconds]: [f64; 2] = [minutes.parse().ok()?, seconds.parse().ok()?];
    ((0.0..60.0).contains(&minutes) && (0.0..60.0).contains(&seconds)).then_some(60.0 * minutes + seconds)
}

/// Seconds since midnight from a time like `12:34:56.7`, `12:34:56,7` or `1:34:56 PM`.
fn clock_s(text: &str) -> Option<f64> {
    let text = text.trim().replace(',', ".");
    let time = text.contains(':').then(|| time_of_day(&text))??;
    let whole = f64::from(time.hour()) * 3600.0 + f64::from(time.minute()) * 60.0 + f64::from(time.second());
    Some(whole + f64::from(time.subsec_nanosecond()) * 1e-9)
}

/// Seconds from 1970 to the year 5138: a greater count is of thousandths of a second, or of something smaller.
const MOST_SECONDS: f64 = 1e11;

/// Days from the end of 1899 to 1982 and to 2119, as spreadsheets count them, and the longest step from reading to reading that such days
/// can be told by: nobody logs so often by the second.
const DAYS: std::ops::Range<f64> = 30_000.0..80_000.0;
const STEP_OF_DAYS: f64 = 2e-5;

/// Times in seconds of a column of numbers that may count days, or smaller parts of a second, from a date; and what they were taken for if
/// so.
pub fn counted_s(times: Vec<f64>) -> (Vec<f64>, Option<&'static str>) {
    let known: Vec<f64> = times.iter().copied().filter(|time| time.is_finite()).collect();
    let steps: Vec<f64> = known.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0).collect();
    let often = steps.len() > 10 && median(&steps) < STEP_OF_DAYS;
    if often && known.iter().all(|time| DAYS.contains(time)) {
        return (times.into_iter().map(|time| time * DAY_S).collect(), Some("days from 1899, as spreadsheets do,"));
    }
    let least = times.iter().copied().filter(|time| time.is_finite()).fold(f64::INFINITY, f64::min);
    let parts = [(1e3, "milliseconds from 1970"), (1e6, "microseconds from 1970"), (1e9, "nanoseconds from 1970")];
    let meant = parts.into_iter().find(|(per_second, _)| least.is_finite() && least / per_second < MOST_SECONDS);
    match meant {
        Some((per_second, name)) if least > MOST_SECONDS => {
            (times.into_iter().map(|time| time / per_second).collect(), Some(name))
        }
        _ => (times, None),
    }
}

/// Is a cell a date or time of day, and no plain number?
pub fn is_stamp(text: &str) -> bool {
    text.parse::<f64>().is_err() && (minutes_s(text).is_some() || clock_s(text).is_some() || stamp_s(text).is_some())
}

/// The times of a column, s; NaN if a cell cannot be read. A fall of the time of day by more than half a day is
/// midnight; one of minutes and seconds by more than half an hour is the next hour.
pub fn times_s(cells: &[String]) -> Vec<f64> {
    let (mut before, mut last) = (0.0, f64::NEG_INFINITY);
    let mut one = |cell: &String| {
        let within = minutes_s(cell).map(|time| (time, HOUR_S)).or_else(|| Some((clock_s(cell)?, DAY_S)));
        let Some((clock, round)) = within else { return stamp_s(cell).unwrap_or(f64::NAN) };
        if clock < last - 0.5 * round {
            before += round;
        }
        last = clock;
        before + clock
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
    fn a_count_from_1970_is_taken_for_the_part_of_a_second_that_it_must_be() {
        let of = |first: f64| {
            let (times, said) = counted_s(vec![f64::NAN, first, first * (1.0 + 1e-9)]);
            (times[1], said)
        };
        // 21 November 2026; the last count of seconds, in the year 5138, and a thousandth of a second of 1973.
        assert_eq!(of(1.795e9), (1.795e9, None));
        assert_eq!(of(0.99e11), (0.99e11, None));
        assert_eq!(of(1.01e11), (1.01e8, Some("milliseconds from 1970")));
        assert_eq!(of(1.795e12), (1.795e9, Some("milliseconds from 1970")));
        assert_eq!(of(1.795e15), (1.795e9, Some("microseconds from 1970")));
        assert_eq!(of(1.795e18), (1.795e9, Some("nanoseconds from 1970")));
        assert_eq!(counted_s(vec![f64::NAN]).1, None);
    }

    #[test]
    fn days_of_a_spreadsheet_are_told_by_their_size_and_their_steps() {
        let count = |step: f64| counted_s((0..30).map(|k| 46_354.5 + step * f64::from(k)).collect());
        let (times, said) = count(0.1 / 86_400.0);
        assert!((times[29] - times[0] - 2.9).abs() < 1e-4 && said.unwrap().starts_with("days"), "{said:?}");
        assert_eq!(count(0.001).1, None);
    }

    #[test]
    fn clocks_of_twelve_hours_and_dates_with_strokes_are_read() {
        let clock = |text: &str| clock_s(text).map(|seconds| seconds / 3600.0);
        let noon = ["12:00:00 AM", "1:30:00 am", "12:00:00 PM", "11:30:00PM"].map(clock);
        assert_eq!(noon, [Some(0.0), Some(1.5), Some(12.0), Some(23.5)]);
        assert_eq!(["13:00:00 PM", "0:30:00 AM", "PM"].map(clock), [None; 3]);
        let day = stamp_s("2017-02-03T19:03:08.25Z");
        for text in ["2/3/2017 7:03:08.25 PM", "02/03/2017 19:03:08.25", "2017/02/03 19:03:08.25"] {
            assert_eq!(stamp_s(text), day, "{text}");
        }
        assert_eq!(stamp_s("23/11/2026 10:00:00"), stamp_s("2026-11-23T10:00:00Z"));
    }

    #[test]
    fn times_of_day_go_on_over_midnight() {
        let cells = ["23:59:59.5", "00:00:00,5", "00:00:01"].map(str::to_owned);
        assert_eq!(times_s(&cells), [86_399.5, 86_400.5, 86_401.0]);
        assert!(is_stamp("10:00:00") && !is_stamp("12.5") && !is_stamp("up"));
        let cells = ["59:59.5", "00:00,5", "00:01.0"].map(str::to_owned);
        assert_eq!(times_s(&cells), [3599.5, 3600.5, 3601.0]);
        let cells = ["9:59:59:750", "10:00:00:250"].map(str::to_owned);
        assert_eq!(times_s(&cells), [35_999.75, 36_000.25]);
    }
}
