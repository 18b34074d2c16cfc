//! Reads a measured log: a table, MTConnect adapter output (SHDR) or MTConnect streams.
//!
//! In: bytes. Out: [`Log`]: rising times in s from the first sample ([`clock`]), positions, lines or blocks, feed, speed, tool, and
//! the measured quantities; missing values are NaN. Gaps and implausible values cause warnings. SHDR lines `timestamp|item|value|item|value…` give a
//! row at every stamp with the last value of each item.

pub mod error;
pub mod names;
pub mod stamps;
pub mod layout;
pub mod cells;
pub mod clock;
pub mod columns;
pub mod gaps;
pub mod mtconnect;
pub mod on_change;
pub mod oddities;
pub mod positions;
pub mod quantity;
pub mod resultant;
pub mod sampled;
pub mod overview;
pub mod shdr;
pub mod signal;

pub use sampled::Log;

use crate::learn::log::columns::{DataError, Frame, read};
use crate::learn::log::quantity::MEASURED;

/// Reads a log; `mapping` renames columns (theirs, ours).
pub fn read_log(bytes: &[u8], mapping: &[(String, String)]) -> Result<Log, DataError> {
    read_as(bytes, mapping, from_frame)
}

/// The same, but a log without a load is accepted if it has positions or lines.
pub fn read_any_log(bytes: &[u8], mapping: &[(String, String)]) -> Result<Log, DataError> {
    read_as(bytes, mapping, with_or_without_load)
}

/// A log from columns; it needs a load, positions or lines.
fn with_or_without_load(frame: &Frame) -> Result<Log, DataError> {
    let log = of_columns(frame)?;
    let moves_alone = load_column(frame).is_none() && (log.position_mm.is_some() || log.line.is_some());
    if moves_alone { Ok(log) } else { with_load(log, frame) }
}

fn read_as(
    bytes: &[u8],
    mapping: &[(String, String)],
    log: impl Fn(&Frame) -> Result<Log, DataError>,
) -> Result<Log, DataError> {
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(DataError::Empty("the log has no samples"));
    }
    let (kind, frame) = frame(bytes, mapping)?;
    let mut log = Log { on_change: kind.is_on_change(), ..log(&frame)? };
    if !log.on_change {
        log.warnings.extend(gaps::in_words(&gaps::gaps(&log.time_s)));
    }
    log.warnings.extend(oddities::of(&log));
    let spikes = oddities::leave_out_spikes(&mut log);
    log.warnings.extend(spikes);
    log.warnings.extend(not_used(&frame).filter(|_| kind == Kind::Table));
    Ok(log)
}

/// Columns with numbers that have no meaning here, in words: a load under a name of its own would otherwise be missed in silence.
fn not_used(frame: &Frame) -> Option<String> {
    let is_unknown = |name: &&String| {
        !names::is_ours(name) && frame.numbers(name).is_some_and(|of| of.iter().any(|v| v.is_finite()))
    };
    let unknown: Vec<&str> = frame.names().iter().filter(is_unknown).map(String::as_str).collect();
    (!unknown.is_empty()).then(|| {
        format!(
            "columns that are not used: {}; --columns THEIRS=OURS gives one a meaning, and `feedwright log` proposes some",
            unknown.join(", ")
        )
    })
}

/// What kind of file a log is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A table: text or workbook.
    Table,
    /// Output of an MTConnect adapter.
    Shdr,
    /// Response of an MTConnect agent.
    Streams,
}

impl Kind {
    /// Does it have rows only when a value changes?
    pub fn is_on_change(self) -> bool {
        self != Kind::Table
    }
}

/// The columns of a log of any kind.
pub fn frame(bytes: &[u8], mapping: &[(String, String)]) -> Result<(Kind, Frame), DataError> {
    if mtconnect::is_streams(bytes) {
        return Ok((Kind::Streams, mtconnect::streams(bytes, mapping)?));
    }
    if shdr::is_shdr(bytes) {
        return Ok((Kind::Shdr, shdr::shdr(bytes, mapping)?));
    }
    Ok((Kind::Table, read(bytes, mapping)?))
}

/// What to do about a log without names.
const NO_NAMES: &str = "the log has no header: --columns time_s,x_mm,… names its columns in their order; a counter of the readings, as \
                        halsampler -t writes it, is sample_1000hz if there are 1000 a second";

/// A log from columns.
pub fn from_frame(frame: &Frame) -> Result<Log, DataError> {
    with_load(of_columns(frame)?, frame)
}

/// Refuses a log that measures no load.
fn with_load(log: Log, frame: &Frame) -> Result<Log, DataError> {
    match load_column(frame) {
        _ if !log.measured.is_empty() => Ok(log),
        Some(name) => Err(DataError::Unfit(format!("the column `{name}` holds no reading"))),
        None => Err(DataError::NoColumn { missing: MEASURED.join(" or "), present: frame.names().join(", ") }),
    }
}

/// Name of the first column of a load, with or without values.
fn load_column(frame: &Frame) -> Option<&'static str> {
    MEASURED.iter().find(|name| frame.numbers(name).is_some()).copied()
}

fn of_columns(frame: &Frame) -> Result<Log, DataError> {
    let time = match frame.times("time_s") {
        Some(time) => time,
        None if frame.layout.as_ref().is_some_and(|layout| !layout.has_header) => {
            return Err(DataError::Unfit(NO_NAMES.into()));
        }
        None => frame.needed("time_s")?,
    };
    let mut warnings = frame.warnings.clone();
    if let Some(first) = frame.text("time_s").and_then(|cells| cells.iter().find(|cell| !cell.is_empty()))
        && time.iter().all(|time| time.is_nan())
    {
        return Err(DataError::Unfit(format!(
            "no cell of the times can be read (the first is `{first}`): write seconds, a date and time, or a time of day"
        )));
    }
    let (time, counted) = stamps::counted_s(time);
    warnings.extend(counted.map(|counted| format!("the times count {counted} and are taken for that")));
    let (order, time_s) = clock::ordered(&time, &mut warnings)?;
    let take = |name: &str| frame.numbers(name).map(|values| order.iter().map(|i| values[*i]).collect::<Vec<f64>>());
    let known = |values: &Vec<f64>| values.iter().any(|v| v.is_finite());
    let axes = ["x_mm", "y_mm", "z_mm"].map(take);
    let measured: Vec<(&'static str, Vec<f64>)> =
        MEASURED.iter().filter_map(|name| take(name).filter(known).map(|values| (*name, values))).collect();
    let one_based = |lines: Vec<f64>| lines.into_iter().map(|l| l + 1.0).collect();
    let given = axes.iter().flatten().filter(|axis| known(axis)).count();
    let position = match axes {
        [Some(x), Some(y), Some(z)] if given == 3 => Some(positions::of_every_reading([x, y, z], &time_s)),
        _ => None,
    };
    if (1..3).contains(&given) {
        warnings
            .push("positions are used only with all three of x_mm, y_mm and z_mm; here one or two of them are".into());
    }
    let position_mm = position.map(|(axes, said)| {
        warnings.extend(said);
        axes
    });
    Ok(Log {
        time_s,
        position_mm,
        line: take("line").or_else(|| take("block").map(one_based)).filter(known).map(carried),
        feed_mm_s: take("feed_mm_min")
            .filter(known)
            .map(|f| f.into_iter().map(crate::units::mm_s_from_mm_min).collect()),
        rps: take("spindle_rpm")
            .filter(known)
            .map(|n| carried(n.into_iter().map(|n| crate::units::rps_from_rpm(n.abs())).collect())),
        tool: take("tool").filter(known).map(carried),
        measured,
        on_change: false,
        higher_mm: None,
        warnings,
    })
}

/// Replaces missing values by the one before.
fn carried(mut values: Vec<f64>) -> Vec<f64> {
    let mut last = values.iter().copied().find(|v| v.is_finite()).unwrap_or(f64::NAN);
    for value in &mut values {
        if value.is_finite() {
            last = *value;
        } else {
            *value = last;
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_of_numbers_without_a_meaning_is_said() {
        let said = |header: &str| {
            let rows = (0..40).map(|k| format!("{k},{},7", 500 + k % 3)).collect::<Vec<_>>().join("\n");
            read_log(format!("{header}\n{rows}").as_bytes(), &[]).unwrap().warnings
        };
        assert!(said("time_s,spindle_power_w,vibration")[0].contains("not used: vibration;"));
        assert!(said("time_s,spindle_power_w,group").is_empty());
    }

    #[test]
    fn odd_clocks_are_said() {
        let rows = |times: &[f64]| {
            let body: String = times.iter().map(|t| format!("{t},500")).collect::<Vec<_>>().join("\n");
            read_log(format!("time_s,spindle_power_w\n{body}").as_bytes(), &[])
        };
        let rising: Vec<f64> = (0..40).map(f64::from).collect();
        assert!(rows(&rising).unwrap().warnings.is_empty());
        let falling: Vec<f64> = rising.iter().rev().copied().collect();
        assert!(rows(&falling).unwrap_err().to_string().contains("backwards"));
        let mut swapped = rising.clone();
        swapped.swap(10, 11);
        assert_eq!(rows(&swapped).unwrap().time_s, rising);
        let late = |k: f64| k + if k > 30.0 { 100.0 } else { 0.0 } + if k > 20.0 { 8.0 } else { 0.0 };
        let gaps = rows(&rising.iter().map(|k| late(*k)).collect::<Vec<f64>>()).unwrap().warnings;
        assert_eq!(gaps.len(), 1);
        assert!(
            gaps[0].contains("gaps in the time stamps: 2, together 110.0 s, the longest 101.0 s from 38.0 s"),
            "{gaps:?}"
        );
        assert!(rows(&[1.0; 30]).unwrap_err().to_string().contains("stands still"));
        assert!(rows(&[]).is_err());
    }
}
