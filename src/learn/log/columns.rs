//! Reads measured data: CSV with a header into columns of numbers and of text. A log and a table of steady cuts begin
//! here.
//!
//! `#` lines are comments. A header is lower-cased, everything between words becomes `_`, and a unit at its end that
//! measures the same as the wanted one is converted (`feed_mm_s` is read as `feed_mm_min`, `power [kW]` as
//! `spindle_power_w`). Missing values (empty, NA, NaN, -) are NaN. Separator is the comma, the semicolon or the tab
//! that the header has most of.

use crate::units::{header_factor, header_units};

/// Why data cannot be used at all.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DataError {
    /// No rows.
    #[error("the data are empty: {0}")]
    Empty(&'static str),
    /// Not CSV.
    #[error("the data cannot be read: {0}")]
    Unreadable(String),
    /// A column that is needed is not there.
    #[error(
        "the data have no column `{missing}`; there are: {present}. Rename it in the header or map it with --columns"
    )]
    NoColumn {
        /// Wanted.
        missing: String,
        /// Found.
        present: String,
    },
    /// The data are there, but they do not fit what they are said to be.
    #[error("{0}")]
    Unfit(String),
}

/// Columns of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frame {
    names: Vec<String>,
    cells: Vec<Vec<String>>,
    /// Number of rows.
    pub rows: usize,
    /// What was noticed.
    pub warnings: Vec<String>,
}

/// Other names that quantities go by.
const ALIASES: &[(&str, &str)] = &[
    ("power", "spindle_power"),
    ("pm", "spindle_power"),
    ("torque", "spindle_torque"),
    ("current", "spindle_current"),
    ("load", "spindle_load"),
    ("spindle_speed", "spindle"),
    ("rotary_velocity", "spindle"),
    ("s", "spindle"),
    ("n", "spindle"),
    ("timestamp", "time"),
    ("t", "time"),
    ("feedrate", "feed"),
    ("feed_rate", "feed"),
    ("path_feedrate", "feed"),
    ("ft", "feed_per_tooth"),
    ("fz", "feed_per_tooth"),
    ("ap", "axial_depth"),
    ("da", "axial_depth"),
    ("axial", "axial_depth"),
    ("depth_of_cut", "axial_depth"),
    ("ae", "radial_depth"),
    ("rd", "radial_depth"),
    ("dw", "radial_depth"),
    ("radial", "radial_depth"),
    ("width_of_cut", "radial_depth"),
    ("tz", "layer_height"),
    ("qdot", "removal_rate"),
    ("adot", "contact_rate"),
    ("cutting_strategy", "side"),
    ("cut", "side"),
    ("tool_number", "tool"),
    ("fx", "force_x"),
    ("fy", "force_y"),
    ("fz_force", "force_z"),
    ("fxy", "force_xy"),
    ("line_number", "line"),
    ("block_number", "block"),
];

/// Reads a file; `mapping` renames columns (theirs, ours) first.
pub fn read(bytes: &[u8], mapping: &[(String, String)]) -> Result<Frame, DataError> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}');
    let header = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#'));
    let header = header.ok_or(DataError::Empty("no header and no rows"))?;
    let separator = [b',', b';', b'\t'].into_iter().max_by_key(|c| header.bytes().filter(|b| b == c).count());
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator.unwrap_or(b','))
        .comment(Some(b'#'))
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let headers = reader.headers().map_err(|e| DataError::Unreadable(e.to_string()))?.clone();
    for (theirs, _) in mapping {
        if !headers.iter().any(|name| same(theirs, name)) {
            let present: Vec<String> = headers.iter().map(plain).collect();
            return Err(DataError::Unfit(format!(
                "--columns: the data have no column `{theirs}`; there are: {}",
                present.join(", ")
            )));
        }
    }
    let rename =
        |name: &str| mapping.iter().find(|(theirs, _)| same(theirs, name)).map_or(plain(name), |(_, ours)| plain(ours));
    let names: Vec<String> = headers.iter().map(rename).collect();
    let mut frame = Frame { cells: vec![Vec::new(); names.len()], names, ..Frame::default() };
    for record in reader.records() {
        let record = record.map_err(|e| DataError::Unreadable(e.to_string()))?;
        for (k, column) in frame.cells.iter_mut().enumerate() {
            column.push(record.get(k).unwrap_or("").to_owned());
        }
        frame.rows += 1;
    }
    if frame.rows == 0 {
        return Err(DataError::Empty("a header without rows"));
    }
    Ok(frame)
}

/// Whether a name given to `--columns` means this header: as it stands in the file, or as messages print it.
fn same(given: &str, header: &str) -> bool {
    given == header || plain(given) == plain(header)
}

/// Lower case, words joined by one `_`.
fn plain(name: &str) -> String {
    let spaced: String =
        name.to_lowercase().replace('%', " percent ").replace('µ', "u").replace('³', "3").replace('²', "2");
    let words: Vec<&str> =
        spaced.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty() && *w != "per").collect();
    words.join("_").replace("feed_tooth", "feed_per_tooth")
}

/// (quantity, unit) of a header.
fn quantity(name: &str) -> (String, Option<&'static str>) {
    let unit = header_units().into_iter().find(|unit| name.strip_suffix(unit).is_some_and(|head| head.ends_with('_')));
    let base = unit.map_or(name, |u| &name[..name.len() - u.len() - 1]);
    let alias = ALIASES.iter().find(|(theirs, _)| *theirs == base).map_or(base, |(_, ours)| ours);
    (alias.to_owned(), unit)
}

impl Frame {
    /// From columns of numbers already in our names (used for adapter output).
    pub fn from_numbers(columns: Vec<(String, Vec<f64>)>) -> Self {
        let rows = columns.first().map_or(0, |(_, values)| values.len());
        let text =
            |values: Vec<f64>| values.iter().map(|v| if v.is_nan() { String::new() } else { v.to_string() }).collect();
        let (names, cells) = columns.into_iter().map(|(name, values)| (name, text(values))).unzip();
        Self { names, cells, rows, warnings: Vec::new() }
    }

    fn find(&self, wanted: &str) -> Option<(usize, f64)> {
        if let Some(k) = self.names.iter().position(|name| name == &plain(wanted)) {
            return Some((k, 1.0));
        }
        let (base, unit) = quantity(&plain(wanted));
        self.names.iter().enumerate().find_map(|(k, name)| {
            let (own, own_unit) = quantity(name);
            if own != base {
                return None;
            }
            match (own_unit, unit) {
                (Some(from), Some(to)) => header_factor(from, to).map(|factor| (k, factor)),
                _ => Some((k, 1.0)),
            }
        })
    }

    /// Numbers of a column in the unit of the wanted name; missing values are NaN; `None`: no such column.
    pub fn numbers(&self, wanted: &str) -> Option<Vec<f64>> {
        let (k, factor) = self.find(wanted)?;
        Some(self.cells[k].iter().map(|cell| cell.parse::<f64>().map_or(f64::NAN, |v| v * factor)).collect())
    }

    /// Numbers of a column that must be there.
    pub fn needed(&self, wanted: &str) -> Result<Vec<f64>, DataError> {
        let missing = || DataError::NoColumn { missing: wanted.to_owned(), present: self.names.join(", ") };
        self.numbers(wanted).ok_or_else(missing)
    }

    /// Text of a column.
    pub fn text(&self, wanted: &str) -> Option<&[String]> {
        self.find(wanted).map(|(k, _)| self.cells[k].as_slice())
    }

    /// Names of the columns as understood.
    pub fn names(&self) -> &[String] {
        &self.names
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_in_headers_are_converted() {
        let frame =
            read(b"# a comment\ntime [ms];Feed (mm/s);Power [kW];group\n500;2.0;1.5;a\n;NaN;-;b\n", &[]).unwrap();
        assert_eq!(frame.numbers("time_s").unwrap()[0], 0.5);
        assert_eq!(frame.numbers("feed_mm_min").unwrap()[0], 120.0);
        assert_eq!(frame.numbers("spindle_power_w").unwrap()[0], 1500.0);
        assert!(frame.numbers("time_s").unwrap()[1].is_nan() && frame.numbers("feed_mm_min").unwrap()[1].is_nan());
        assert_eq!(frame.text("group").unwrap(), ["a", "b"]);
        assert!(frame.numbers("axial_depth_mm").is_none());
    }

    #[test]
    fn a_mapping_takes_the_names_that_its_own_error_prints() {
        let of = |theirs: &str| read(b"Pm [kW],n\n3,9\n", &[(theirs.to_owned(), "spindle_power_kw".to_owned())]);
        for theirs in ["Pm [kW]", "pm_kw"] {
            assert_eq!(of(theirs).unwrap().needed("spindle_power_w").unwrap(), [3000.0], "{theirs}");
        }
        let said = of("power").unwrap_err().to_string();
        assert!(said.contains("`power`") && said.contains("pm_kw, n"), "{said}");
    }

    #[test]
    fn a_mapping_renames_and_a_missing_column_is_said() {
        let mapping = [("P".to_owned(), "spindle_power_w".to_owned())];
        let frame = read(b"P\n3\n", &mapping).unwrap();
        assert_eq!(frame.needed("spindle_power_w").unwrap(), [3.0]);
        assert!(frame.needed("time_s").unwrap_err().to_string().contains("time_s"));
        assert!(matches!(read(b"", &[]), Err(DataError::Empty(_))));
    }
}
