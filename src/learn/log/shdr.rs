//! MTConnect adapter output (SHDR): lines `timestamp|item|value|item|value…`. In: bytes. Out: columns, one row a stamp, with the last value
//! of each item: what does not change is known there without a stamp.

use crate::learn::log::columns::{DataError, Frame};
use jiff::Timestamp;
use jiff::civil::DateTime;
use jiff::tz::TimeZone;

/// Does a file look like adapter output?
pub fn is_shdr(bytes: &[u8]) -> bool {
    let first = bytes.split(|b| *b == b'\n').find(|l| !l.is_empty() && l[0] != b'*').unwrap_or(&[]);
    first.split(|b| *b == b'|').count() >= 3 && !first.contains(&b',')
}

/// Items of adapters and our names.
const ITEMS: [(&str, &str); 14] = [
    ("block_number", "block"),
    ("block", "block"),
    ("line", "line"),
    ("linenumber", "line"),
    ("feed_rate", "feed_mm_min"),
    ("path_feedrate", "feed_mm_min"),
    ("spindle_speed", "spindle_rpm"),
    ("current_tool", "tool"),
    ("tool_number", "tool"),
    ("spindle_load", "spindle_load_percent"),
    ("spindle_power", "spindle_power_w"),
    ("xabs", "x_mm"),
    ("yabs", "y_mm"),
    ("zabs", "z_mm"),
];

/// Adapter output as columns, one row per stamp, values held until they change.
pub fn shdr(bytes: &[u8], mapping: &[(String, String)]) -> Result<Frame, DataError> {
    let text = String::from_utf8_lossy(bytes);
    let name_of = |item: &str| {
        let lower = item.to_lowercase();
        let mapped = mapping.iter().find(|(theirs, _)| theirs.eq_ignore_ascii_case(item)).map(|(_, ours)| ours.clone());
        mapped.unwrap_or_else(|| ITEMS.iter().find(|(i, _)| *i == lower).map_or(lower, |(_, ours)| (*ours).to_owned()))
    };
    let mut names: Vec<String> = Vec::new();
    let mut rows: Vec<(f64, Vec<(usize, f64)>)> = Vec::new();
    for line in text.lines() {
        let mut fields = line.trim().split('|');
        let Some(stamp) = fields.next().and_then(stamp_s) else { continue };
        if rows.last().is_none_or(|(t, _)| *t != stamp) {
            rows.push((stamp, Vec::new()));
        }
        while let (Some(item), Some(value)) = (fields.next(), fields.next()) {
            let Ok(value) = value.trim().parse::<f64>() else { continue };
            let name = name_of(item.trim());
            let k = names.iter().position(|n| *n == name).unwrap_or_else(|| {
                names.push(name);
                names.len() - 1
            });
            if let Some((_, changes)) = rows.last_mut() {
                changes.push((k, value));
            }
        }
    }
    if rows.is_empty() {
        return Err(DataError::Empty("no line of the adapter output has a stamp"));
    }
    let mut held = vec![f64::NAN; names.len()];
    let mut columns = vec![Vec::with_capacity(rows.len()); names.len() + 1];
    for (stamp, changes) in &rows {
        for (k, value) in changes {
            held[*k] = *value;
        }
        columns[0].push(*stamp);
        held.iter().enumerate().for_each(|(k, value)| columns[k + 1].push(*value));
    }
    let names = std::iter::once("time_s".to_owned()).chain(names);
    Ok(Frame::from_numbers(names.zip(columns).collect()))
}

/// Seconds since 1970 from a stamp: a number, or a date and time of ISO 8601 with its offset; without one it is taken as UTC. `None` for
/// anything else, and for a date that no calendar has.
pub fn stamp_s(text: &str) -> Option<f64> {
    if let Ok(seconds) = text.parse::<f64>() {
        return Some(seconds);
    }
    let utc = || TimeZone::UTC.to_timestamp(text.parse::<DateTime>().ok()?).ok();
    let stamp = text.parse::<Timestamp>().ok().or_else(utc)?;
    Some(stamp.as_second() as f64 + f64::from(stamp.subsec_nanosecond()) * 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::log::read_log;

    #[test]
    fn adapter_lines_hold_their_values() {
        let text = "2017-02-02T19:03:08.5Z|Block_Number|3|Spindle_power|10\n2017-02-02T19:03:09.0Z|Spindle_power|12\n";
        let frame = shdr(text.as_bytes(), &[]).unwrap();
        assert_eq!(frame.numbers("block").unwrap(), [3.0, 3.0]);
        assert_eq!(frame.numbers("spindle_power_w").unwrap(), [10.0, 12.0]);
        let time = frame.numbers("time_s").unwrap();
        assert!((time[1] - time[0] - 0.5).abs() < 1e-6);
        // Nothing changes for a while: no gap.
        let second = |k: u32| if k > 9 { 90 + k } else { k };
        let lines: Vec<String> = (0..30).map(|k| format!("{}|Spindle_power|{k}", second(k))).collect();
        let log = read_log(lines.join("\n").as_bytes(), &[]).unwrap();
        assert!(log.on_change && log.warnings.is_empty());
        assert_eq!(stamp_s("1970-01-02T00:00:01Z"), Some(86_401.0));
        assert_eq!(stamp_s("2000-03-01T00:00:00Z"), Some(951_868_800.0));
    }

    #[test]
    fn stamps_are_dates_of_a_calendar_with_or_without_an_offset() {
        assert_eq!(stamp_s("2017-02-02T19:03:08.25Z"), Some(1_486_062_188.25));
        assert_eq!(stamp_s("2017-02-02T20:03:08.25+01:00"), stamp_s("2017-02-02T19:03:08.25Z"));
        assert_eq!(stamp_s("2017-02-02T19:03:08.25"), stamp_s("2017-02-02T19:03:08.25Z"));
        assert_eq!(stamp_s("12.5"), Some(12.5));
        for wrong in ["", "2017-02-30T19:03:08Z", "2017-02-02T25:03:08Z", "yesterday"] {
            assert_eq!(stamp_s(wrong), None, "{wrong}");
        }
    }
}
