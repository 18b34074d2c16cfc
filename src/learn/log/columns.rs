//! Measured data as columns of numbers and text, for logs and tables of steady cuts. In: bytes. Out: [`Frame`].
//!
//! `#` lines are comments; first row, names and number format are found by [`super::layout`]. Headers become lower case
//! with `_` between words; a unit at the end is converted to that of the requested column (`feed_mm_s` to
//! `feed_mm_min`, `power [kW]` to `spindle_power_w`). Missing values (empty, NA, NaN, -) are NaN.

use super::cells::{self, SAMPLE};
use super::layout::{self, Layout, layout};
use super::names::{counter_hz, is_alias, plain, quantity, same};
use super::stamps;
use crate::units::header_factor;

pub use super::error::DataError;

/// Columns of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frame {
    names: Vec<String>,
    cells: Vec<Vec<String>>,
    /// Number of rows.
    pub rows: usize,
    /// Warnings.
    pub warnings: Vec<String>,
    /// Layout of the table in its file; `None` for other files.
    pub layout: Option<Layout>,
}

/// Reads a file; `mapping` renames columns (theirs, ours) first. If the first names are empty, it names the columns in
/// order.
pub fn read(bytes: &[u8], mapping: &[(String, String)]) -> Result<Frame, DataError> {
    let cells = cells::open(bytes)?;
    let sample: Vec<Vec<String>> = cells.rows().take(SAMPLE).collect::<Result<_, _>>()?;
    if sample.is_empty() {
        return Err(DataError::Empty("no header and no rows"));
    }
    let mut layout = layout(&sample, &cells.last_remark(), cells.separator);
    name_in_order(&mut layout, mapping)?;
    for (theirs, _) in mapping.iter().filter(|(theirs, _)| !theirs.is_empty()) {
        if !layout.names.iter().any(|name| same(theirs, name)) {
            let present: Vec<String> = layout.names.iter().map(|name| plain(name)).collect();
            return Err(DataError::Unfit(format!(
                "--columns: the data have no column `{theirs}`; there are: {}",
                present.join(", ")
            )));
        }
    }
    let rename = |name: &String| {
        let mapped = mapping.iter().find(|(theirs, _)| same(theirs, name));
        mapped.map_or_else(|| plain(name), |(_, ours)| plain(ours))
    };
    let names: Vec<String> = layout.names.iter().map(rename).collect();
    let mut frame = Frame { cells: vec![Vec::new(); names.len()], names, ..Frame::default() };
    for record in cells.rows().skip(layout.first_row) {
        let mut record = record?;
        for (k, column) in frame.cells.iter_mut().enumerate() {
            column.push(record.get_mut(k).map(std::mem::take).unwrap_or_default());
        }
        frame.rows += 1;
    }
    if frame.rows == 0 {
        return Err(DataError::Empty("a header without rows"));
    }
    frame.warnings.extend(two_of_a_kind(&frame));
    frame.layout = Some(layout);
    Ok(frame)
}

/// Names the columns in order, for a file without a header (or with one that is of no use).
fn name_in_order(layout: &mut Layout, mapping: &[(String, String)]) -> Result<(), DataError> {
    let given: Vec<&String> = mapping.iter().filter(|(theirs, _)| theirs.is_empty()).map(|(_, ours)| ours).collect();
    if given.is_empty() {
        return Ok(());
    }
    if given.len() != layout.names.len() {
        return Err(DataError::Unfit(format!(
            "--columns names {} columns; the data have {}: {}",
            given.len(),
            layout.names.len(),
            layout.names.join(", ")
        )));
    }
    layout.names = given.into_iter().cloned().collect();
    Ok(())
}

/// Warnings about columns of the same quantity, of which one is read.
fn two_of_a_kind(frame: &Frame) -> Vec<String> {
    let kinds: Vec<String> = frame.names.iter().map(|name| quantity(name).0).collect();
    let mut said: Vec<String> = Vec::new();
    for (k, kind) in kinds.iter().enumerate() {
        if let Some(first) = kinds[..k].iter().position(|other| other == kind).filter(|_| !kind.is_empty()) {
            let read =
                frame.place(kind).map_or("the first", |place| if place == k { "the second" } else { "the first" });
            said.push(format!(
                "columns {} and {} are both {kind}: {read} is read; --columns says which is meant",
                frame.names[first], frame.names[k]
            ));
        }
    }
    said
}

impl Frame {
    /// From columns of numbers that already have our names (adapter output).
    pub fn from_numbers(columns: Vec<(String, Vec<f64>)>) -> Self {
        let rows = columns.first().map_or(0, |(_, values)| values.len());
        let text =
            |values: Vec<f64>| values.iter().map(|v| if v.is_nan() { String::new() } else { v.to_string() }).collect();
        let (names, cells) = columns.into_iter().map(|(name, values)| (name, text(values))).unzip();
        Self { names, cells, rows, ..Self::default() }
    }

    fn find(&self, wanted: &str) -> Option<(usize, f64)> {
        let wanted = plain(wanted);
        if let Some(k) = self.names.iter().position(|name| *name == wanted) {
            return Some((k, 1.0));
        }
        let (base, unit) = quantity(&wanted);
        let mut full_names_first = [false, true]
            .into_iter()
            .flat_map(|alias| self.names.iter().enumerate().filter(move |(_, name)| is_alias(name) == alias));
        let found = full_names_first.find_map(|(k, name)| {
            let (own, own_unit) = quantity(name);
            if own != base {
                return None;
            }
            match (own_unit, unit) {
                (Some(from), Some(to)) => header_factor(from, to).map(|factor| (k, factor)),
                _ => Some((k, 1.0)),
            }
        });
        found.or_else(|| {
            let mut counters = self.names.iter().enumerate().filter(|_| base == "time");
            counters.find_map(|(k, name)| Some((k, 1.0 / counter_hz(name)?)))
        })
    }

    /// Number of the column that a wanted name is read from.
    pub fn place(&self, wanted: &str) -> Option<usize> {
        self.find(wanted).map(|(k, _)| k)
    }

    /// Numbers of a column in the unit of the wanted name; missing values are NaN; `None`: no such column.
    pub fn numbers(&self, wanted: &str) -> Option<Vec<f64>> {
        let (k, factor) = self.find(wanted)?;
        let comma = self.layout.as_ref().is_some_and(|layout| layout.decimal_comma);
        let value = |cell: &String| layout::number(cell, comma).map_or(f64::NAN, |value| value * factor);
        Some(self.cells[k].iter().map(value).collect())
    }

    /// Times in s, whether they are numbers, dates or times of day; `None`: no such column.
    pub fn times(&self, wanted: &str) -> Option<Vec<f64>> {
        let (k, _) = self.find(wanted)?;
        let known = self.cells[k].iter().find(|cell| !cell.is_empty());
        if known.is_some_and(|cell| stamps::is_stamp(cell)) {
            return Some(stamps::times_s(&self.cells[k]));
        }
        self.numbers(wanted)
    }

    /// Numbers of a required column.
    pub fn needed(&self, wanted: &str) -> Result<Vec<f64>, DataError> {
        let missing = || DataError::NoColumn { missing: wanted.to_owned(), present: self.names.join(", ") };
        self.numbers(wanted).ok_or_else(missing)
    }

    /// Text of a column.
    pub fn text(&self, wanted: &str) -> Option<&[String]> {
        self.find(wanted).map(|(k, _)| self.cells[k].as_slice())
    }

    /// Names of the columns after renaming.
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
    fn a_full_name_goes_before_a_short_one_and_a_counter_is_a_clock() {
        let frame = read(b"t,time,s\n7,0.5,100\n7,1.5,100\n", &[]).unwrap();
        assert_eq!(frame.times("time_s").unwrap(), [0.5, 1.5]);
        assert!(frame.warnings[0].contains("t and time are both time: the second is read"), "{:?}", frame.warnings);
        let names = ["sample_500hz", "x_mm"].map(|ours| (String::new(), ours.to_owned()));
        let frame = read(b"0 1.5\n1 2.5\n4 3.5\n", &names).unwrap();
        assert_eq!(frame.times("time_s").unwrap(), [0.0, 0.002, 0.008]);
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
