//! Logs that record only changes. In: time stamps, each with the items that changed. Out: columns, one row per time
//! stamp with the last value of every item.

use super::columns::{DataError, Frame};

/// Items of adapters and agents in lower case, and our columns.
const ITEMS: [(&str, &str); 35] = [
    ("block_number", "block"),
    ("block", "block"),
    ("line", "line"),
    ("linenumber", "line"),
    ("feed_rate", "feed_mm_min"),
    ("path_feedrate", "feed_mm_min"),
    ("spindle_speed", "spindle_rpm"),
    ("spindlespeed", "spindle_rpm"),
    ("rotaryvelocity", "spindle_rpm"),
    ("current_tool", "tool"),
    ("tool_number", "tool"),
    ("toolnumber", "tool"),
    ("toolid", "tool"),
    ("spindle_load", "spindle_load_percent"),
    ("spindleload", "spindle_load_percent"),
    ("sload", "spindle_load_percent"),
    ("s1load", "spindle_load_percent"),
    ("s1speed", "spindle_rpm"),
    ("srpm", "spindle_rpm"),
    ("xact", "x_mm"),
    ("yact", "y_mm"),
    ("zact", "z_mm"),
    ("spindle_power", "spindle_power_w"),
    ("wattage", "spindle_power_w"),
    ("xabs", "x_mm"),
    ("yabs", "y_mm"),
    ("zabs", "z_mm"),
    ("xpos", "x_mm"),
    ("ypos", "y_mm"),
    ("zpos", "z_mm"),
    ("xwork", "x_mm"),
    ("ywork", "y_mm"),
    ("zwork", "z_mm"),
    ("fovr", "feed_override_percent"),
    ("feed_override", "feed_override_percent"),
];

/// The changes at each time stamp.
#[derive(Debug, Default)]
pub struct Changes {
    names: Vec<String>,
    rows: Vec<(f64, Vec<(usize, f64)>)>,
}

impl Changes {
    /// Records an item at a time stamp; of its possible `names` the first known one counts.
    pub fn note(&mut self, stamp_s: f64, names: &[&str], value: f64, factor: f64, mapping: &[(String, String)]) {
        let name = our_name(names, mapping);
        let k = self.names.iter().position(|known| *known == name).unwrap_or_else(|| {
            self.names.push(name);
            self.names.len() - 1
        });
        self.stamp(stamp_s);
        if let Some((_, changes)) = self.rows.last_mut() {
            changes.push((k, value * factor));
        }
    }

    /// Records a time stamp, with or without numbers.
    pub fn stamp(&mut self, stamp_s: f64) {
        if self.rows.last().is_none_or(|(last, _)| *last != stamp_s) {
            self.rows.push((stamp_s, Vec::new()));
        }
    }

    /// Sorts by time; a file may list one item after the other.
    pub fn sort(&mut self) {
        self.rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        let rows = std::mem::take(&mut self.rows);
        for (stamp, changes) in rows {
            self.stamp(stamp);
            if let Some((_, own)) = self.rows.last_mut() {
                own.extend(changes);
            }
        }
    }

    /// One row per time stamp, values held until they change.
    ///
    /// # Errors
    /// No stamp at all.
    pub fn held(self) -> Result<Frame, DataError> {
        if self.rows.is_empty() {
            return Err(DataError::Empty("no line of the adapter output has a stamp"));
        }
        let mut held = vec![f64::NAN; self.names.len()];
        let mut columns = vec![Vec::with_capacity(self.rows.len()); self.names.len() + 1];
        for (stamp, changes) in &self.rows {
            for (k, value) in changes {
                held[*k] = *value;
            }
            columns[0].push(*stamp);
            held.iter().enumerate().for_each(|(k, value)| columns[k + 1].push(*value));
        }
        let names = std::iter::once("time_s".to_owned()).chain(self.names);
        Ok(Frame::from_numbers(names.zip(columns).collect()))
    }
}

fn our_name(names: &[&str], mapping: &[(String, String)]) -> String {
    let mapped = mapping.iter().find(|(theirs, _)| names.iter().any(|name| theirs.eq_ignore_ascii_case(name)));
    if let Some((_, ours)) = mapped {
        return ours.clone();
    }
    let known = names.iter().find_map(|name| ITEMS.iter().find(|(item, _)| name.eq_ignore_ascii_case(item)));
    known.map_or_else(|| names.first().unwrap_or(&"").to_lowercase(), |(_, ours)| (*ours).to_owned())
}
