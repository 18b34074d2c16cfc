//! Overview of a log without its program. In: bytes. Out: its kind and layout, the meaning of each column, the clock,
//! stops and overrides, and proposals for columns that are not recognised.

use super::columns::Frame;
use super::error::DataError;
use super::gaps::{gaps, median_step};
use super::layout::Layout;
use super::names::{OURS, quantity};
use super::quantity::MEASURED;
use super::stamps::is_stamp;
use super::{Kind, Log, frame, oddities, with_or_without_load};

/// A column.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnOverview {
    /// Its name after renaming.
    pub name: String,
    /// Our column that it is read as; `None`: it is not used.
    pub read_as: Option<&'static str>,
    /// Proposed name, if it is not used.
    pub proposed: Option<String>,
    /// Least and greatest value, in the file's unit; `None`: no numbers.
    pub range: Option<[f64; 2]>,
    /// Cells without a value, percent.
    pub missing_percent: f64,
}

/// A stop or an override that the log shows.
#[derive(Debug, Clone, PartialEq)]
pub struct LogEvent {
    /// From, to, s.
    pub time_s: [f64; 2],
    /// In words.
    pub what: String,
}

/// Overview of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct LogOverview {
    /// Kind of file.
    pub kind: Kind,
    /// Layout, if it is a table.
    pub layout: Option<Layout>,
    /// Rows.
    pub rows: usize,
    /// The columns in their order.
    pub columns: Vec<ColumnOverview>,
    /// Length and median step of its clock, s.
    pub clock_s: Option<[f64; 2]>,
    /// Stretches without readings, s.
    pub gaps_s: Vec<[f64; 2]>,
    /// Stops and overrides.
    pub events: Vec<LogEvent>,
    /// Warnings.
    pub warnings: Vec<String>,
    /// Why `learn` cannot use it; `None` if it can.
    pub unusable: Option<String>,
}

/// Words in column names of other software, English and German, and our column; the first match counts.
const WORDS: [(&[&str], &str); 17] = [
    (&["override"], "feed_override_percent"),
    (&["power", "leistung", "wattage", "watt"], "spindle_power_w"),
    (&["torque", "moment", "drehmoment"], "spindle_torque_nm"),
    (&["current", "strom", "ampere", "amps"], "spindle_current_a"),
    (&["load", "last", "auslastung", "utilization", "utilisation"], "spindle_load_percent"),
    (&["rpm", "drehzahl", "spindlespeed", "speed"], "spindle_rpm"),
    (&["feed", "feedrate", "vorschub", "bahnvorschub"], "feed_mm_min"),
    (&["line", "satz", "zeile", "lineno"], "line"),
    (&["tool", "werkzeug", "toolno"], "tool"),
    (&["time", "zeit", "timestamp", "uhrzeit", "seconds", "sekunden"], "time_s"),
    (&["forcex", "kraftx"], "force_x_n"),
    (&["forcey", "krafty"], "force_y_n"),
    (&["forcez", "kraftz"], "force_z_n"),
    (&["x", "xpos", "xact", "posx", "xist", "istx"], "x_mm"),
    (&["y", "ypos", "yact", "posy", "yist", "isty"], "y_mm"),
    (&["z", "zpos", "zact", "posz", "zist", "istz"], "z_mm"),
    (&["n"], "spindle_rpm"),
];

/// Units that only one of our columns has, where no word tells the quantity.
const UNITS: [(&str, &str); 4] =
    [("rpm", "spindle_rpm"), ("w", "spindle_power_w"), ("nm", "spindle_torque_nm"), ("mm_min", "feed_mm_min")];

/// Overview of a log; `mapping` as for `learn`.
///
/// # Errors
/// A file that holds no rows of cells.
pub fn overview(bytes: &[u8], mapping: &[(String, String)]) -> Result<LogOverview, DataError> {
    let (kind, frame) = frame(bytes, mapping)?;
    let read = with_or_without_load(&frame).map(|log| Log { on_change: kind.is_on_change(), ..log });
    let mut seen = LogOverview {
        kind,
        rows: frame.rows,
        columns: columns(&frame),
        clock_s: None,
        gaps_s: Vec::new(),
        events: Vec::new(),
        warnings: frame.warnings.clone(),
        unusable: None,
        layout: frame.layout.clone(),
    };
    match read {
        Ok(mut log) => {
            let end = log.time_s.last().copied().unwrap_or(0.0);
            seen.clock_s = Some([end, median_step(&log.time_s)]);
            if !log.on_change {
                seen.gaps_s = gaps(&log.time_s);
            }
            seen.events = events(&log, frame.numbers("feed_override_percent").as_deref());
            seen.warnings = [log.warnings.clone(), oddities::of(&log), oddities::leave_out_spikes(&mut log)].concat();
            if log.measured.is_empty() {
                seen.unusable =
                    proposes_load(&seen).then(|| "no load is read, but one of the columns proposed may be it".into());
                seen.warnings.push("no load is measured: `learn` finds the times of the machine only".into());
            }
        }
        Err(error) => seen.unusable = Some(error.to_string()),
    }
    Ok(seen)
}

/// Is a column of a load proposed?
fn proposes_load(seen: &LogOverview) -> bool {
    let ours = |theirs: &str| quantity(theirs).0;
    seen.proposed().iter().any(|(_, proposed)| MEASURED.iter().any(|load| ours(load) == ours(proposed)))
}

impl LogOverview {
    /// The proposed mapping: (theirs, ours).
    pub fn proposed(&self) -> Vec<(String, String)> {
        let of = |column: &ColumnOverview| Some((column.name.clone(), column.proposed.clone()?));
        self.columns.iter().filter_map(of).collect()
    }
}

fn columns(frame: &Frame) -> Vec<ColumnOverview> {
    let read: Vec<(usize, &'static str)> =
        OURS.iter().filter_map(|(_, ours)| Some((frame.place(ours)?, *ours))).collect();
    let mut taken: Vec<&str> = read.iter().map(|(_, ours)| *ours).collect();
    let mut columns: Vec<ColumnOverview> = Vec::new();
    for (k, name) in frame.names().iter().enumerate() {
        let read_as = read.iter().find(|(place, _)| *place == k).map(|(_, ours)| *ours);
        let values = frame.numbers(name).unwrap_or_default();
        let known = values.iter().filter(|value| value.is_finite());
        let range = known.clone().fold(None, |range: Option<[f64; 2]>, value| {
            let [least, most] = range.unwrap_or([*value, *value]);
            Some([least.min(*value), most.max(*value)])
        });
        let empty = frame.text(name).map_or(0, |cells| cells.iter().filter(|cell| cell.is_empty()).count());
        columns.push(ColumnOverview {
            name: name.clone(),
            read_as,
            proposed: None,
            range,
            missing_percent: 100.0 * empty as f64 / frame.rows.max(1) as f64,
        });
    }
    for column in columns.iter_mut().filter(|column| column.read_as.is_none()) {
        let is_time = || frame.text(&column.name).is_some_and(|cells| cells.iter().any(|cell| is_stamp(cell)));
        let fits = |ours: &str| if column.range.is_some() { true } else { ours == "time_s" && is_time() };
        let proposed = proposal(&column.name).filter(|(ours, _)| !taken.contains(ours) && fits(ours));
        taken.extend(proposed.as_ref().map(|(ours, _)| *ours));
        column.proposed = proposed.map(|(_, text)| text);
    }
    columns
}

/// Our column for the words of a name, and the proposed name with the unit of the file.
fn proposal(name: &str) -> Option<(&'static str, String)> {
    let (base, unit) = quantity(name);
    // "Spindelleistung" and "spindlepower" are the spindle's.
    let of_spindle = |word: &str| {
        let rest = word.strip_prefix("spindel").or_else(|| word.strip_prefix("spindle"));
        rest.filter(|rest| !rest.is_empty()).unwrap_or(word).to_owned()
    };
    let words: Vec<String> = base.split('_').map(of_spindle).collect();
    let joined = words.concat();
    let of_feed = |base: &str| ["rapid", "spindle", "spindel", "speed"].iter().all(|other| !base.contains(other));
    if base.contains("override") && !of_feed(&base) {
        return None;
    }
    let fits = |listed: &&[&str]| {
        let own = |word: &&str| words.iter().any(|own| own == word || word.len() > 3 && own.ends_with(*word));
        listed.iter().any(|word| own(word) || joined == **word)
    };
    let by_unit =
        |(probe, _): &&(&str, &str)| unit.is_some_and(|unit| crate::units::header_factor(unit, probe).is_some());
    let by_word = WORDS.iter().find(|(listed, _)| fits(listed)).map(|(_, ours)| ours);
    let ours = by_word.or_else(|| UNITS.iter().find(by_unit).map(|(_, ours)| ours))?;
    let (own, own_unit) = quantity(ours);
    let measures = unit.zip(own_unit).is_none_or(|(theirs, ours)| crate::units::header_factor(theirs, ours).is_some());
    measures.then(|| (*ours, unit.map_or((*ours).to_owned(), |unit| format!("{own}_{unit}"))))
}

/// Shortest stop or override that is reported, s; shorter ones are corners or tool changes.
const TOLD_S: f64 = 2.0;

fn events(log: &Log, override_percent: Option<&[f64]>) -> Vec<LogEvent> {
    let mut found = Vec::new();
    if let Some(rps) = &log.rps {
        found.extend(stretches(log, |i| rps[i] < 0.1, |_| "the spindle stands".to_owned()));
    }
    if let Some([x, y, z]) = &log.position_mm {
        let still = |i: usize| i > 0 && x[i] == x[i - 1] && y[i] == y[i - 1] && z[i] == z[i - 1];
        found.extend(stretches(log, still, |_| "the axes stand".to_owned()));
    }
    if let Some(percent) = override_percent.filter(|values| values.len() == log.time_s.len()) {
        let off = |i: usize| percent[i].is_finite() && (percent[i] - 100.0).abs() > 0.5;
        found.extend(stretches(log, off, |i| format!("feed override at {} %", percent[i])));
    }
    found.sort_by(|a, b| a.time_s[0].total_cmp(&b.time_s[0]));
    found
}

fn stretches(log: &Log, holds: impl Fn(usize) -> bool, what: impl Fn(usize) -> String) -> Vec<LogEvent> {
    let mut found = Vec::new();
    let mut begin = None;
    for i in 0..=log.time_s.len() {
        match (i < log.time_s.len() && holds(i), begin) {
            (true, None) => begin = Some(i),
            (false, Some(from)) => {
                let time_s = [log.time_s[from], log.time_s[i.min(log.time_s.len() - 1)]];
                if time_s[1] - time_s[0] >= TOLD_S {
                    found.push(LogEvent { time_s, what: what(from) });
                }
                begin = None;
            }
            _ => {}
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_other_software_are_proposed_with_their_units() {
        let of = |name: &str| proposal(name).map(|(_, text)| text);
        assert_eq!(of("spindel_leistung_kw").as_deref(), Some("spindle_power_kw"));
        assert_eq!(of("spindelleistung_kw").as_deref(), Some("spindle_power_kw"));
        assert_eq!(of("spindeldrehzahl").as_deref(), Some("spindle_rpm"));
        assert_eq!(of("auslastung_percent").as_deref(), Some("spindle_load_percent"));
        assert_eq!(of("x_ist_mm").as_deref(), Some("x_mm"));
        assert_eq!(of("drehzahl").as_deref(), Some("spindle_rpm"));
        assert_eq!(of("temperature_c"), None);
        assert_eq!(of("p_mech_s_kw").as_deref(), Some("spindle_power_kw"));
        assert_eq!(of("v_ist_s_1_min").as_deref(), Some("spindle_1_min"));
        assert_eq!(of("channel_spindle_driveload_u1_1_percent").as_deref(), Some("spindle_load_percent"));
        assert_eq!([of("rapid_override"), of("spindle_override_percent")], [None, None]);
        // A power in amperes is not recognised.
        assert_eq!(of("power_meter_a"), None);
    }
}
