//! A file as rows of text cells. In: bytes. Out: its separator and its rows: of a text with commas, semicolons, tabs or
//! blanks between the cells, or of the sheet of a workbook with the most rows.

use super::error::DataError;
use calamine::Reader;

/// What separates the cells of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Separator {
    /// One character.
    Byte(u8),
    /// Any number of blanks.
    Blanks,
    /// None: cells of a workbook.
    Workbook,
}

impl Separator {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Separator::Byte(b';') => "semicolons",
            Separator::Byte(b'\t') => "tabs",
            Separator::Byte(b'|') => "bars",
            Separator::Byte(_) => "commas",
            Separator::Blanks => "blanks",
            Separator::Workbook => "cells of a workbook",
        }
    }
}

/// Separators in order of preference. The one with the longest run of lines of equal cell count is chosen, of equal
/// ones the first: with semicolons or tabs the commas are decimal.
const SEPARATORS: [Separator; 5] =
    [Separator::Byte(b';'), Separator::Byte(b'\t'), Separator::Byte(b'|'), Separator::Byte(b','), Separator::Blanks];

/// Number of lines from which separator and layout are found.
pub const SAMPLE: usize = 300;

/// A file's rows.
#[derive(Debug)]
pub struct Cells<'a> {
    /// What separates them.
    pub separator: Separator,
    text: std::borrow::Cow<'a, str>,
    sheet: Vec<Vec<String>>,
}

/// Beginnings of files that are no tables, and what to do.
const OTHER_KINDS: [(&[u8], &str); 6] = [
    (b"\xd0\xcf\x11\xe0", "it is a workbook of the old kind (.xls): save it as .xlsx or CSV"),
    (b"%PDF", "it is a PDF: export the log as CSV"),
    (b"\x1f\x8b", "it is compressed (gzip): unpack it"),
    (b"{", "it is JSON: export the log as CSV"),
    (b"[{", "it is JSON: export the log as CSV"),
    (b"<", "it is XML or HTML, and no answer of an MTConnect agent: export the log as CSV"),
];

/// Opens a file.
///
/// # Errors
/// A workbook that cannot be read, or a file of another kind.
pub fn open(bytes: &[u8]) -> Result<Cells<'_>, DataError> {
    if bytes.starts_with(b"PK\x03\x04") {
        return Ok(Cells { separator: Separator::Workbook, text: "".into(), sheet: workbook(bytes)? });
    }
    let text = match bytes {
        // Measuring software on Windows writes UTF-16.
        [0xff, 0xfe, rest @ ..] => utf16(rest, u16::from_le_bytes).into(),
        [0xfe, 0xff, rest @ ..] => utf16(rest, u16::from_be_bytes).into(),
        _ if is_every_other_nul(bytes, 1) => utf16(bytes, u16::from_le_bytes).into(),
        _ if is_every_other_nul(bytes, 0) => utf16(bytes, u16::from_be_bytes).into(),
        _ => String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)),
    };
    let begins =
        |(begin, _): &&(&[u8], &str)| text.trim_start().as_bytes().starts_with(begin) || bytes.starts_with(begin);
    if let Some((_, what)) = OTHER_KINDS.iter().find(begins) {
        return Err(DataError::Unreadable((*what).to_owned()));
    }
    if text.contains('\0') {
        return Err(DataError::Unreadable("it is not a text: export the log as CSV".to_owned()));
    }
    let mut cells = Cells { separator: Separator::Byte(b','), text, sheet: Vec::new() };
    let mut best = 1;
    for separator in SEPARATORS {
        cells.separator = separator;
        let rows: Vec<Vec<String>> = cells.rows().take(SAMPLE).filter_map(Result::ok).collect();
        let (_, length, _) = longest_run(&rows);
        if length > best {
            best = length;
        }
    }
    let of = |separator: &Separator| {
        let probe = Cells { separator: *separator, text: cells.text.as_ref().into(), sheet: Vec::new() };
        let rows: Vec<Vec<String>> = probe.rows().take(SAMPLE).filter_map(Result::ok).collect();
        longest_run(&rows).1
    };
    let chosen = SEPARATORS.into_iter().find(|separator| of(separator) >= best && best > 1);
    cells.separator = chosen.unwrap_or(Separator::Byte(b','));
    Ok(cells)
}

/// Is nearly every other byte of the first ones NUL, from this one on: text in sixteen bits without a mark?
fn is_every_other_nul(bytes: &[u8], from: usize) -> bool {
    let head = &bytes[..bytes.len().min(400)];
    let nul = |from: usize| head.iter().skip(from).step_by(2).filter(|byte| **byte == 0).count();
    nul(from) * 10 > head.len() * 4 && nul(1 - from) == 0
}

fn utf16(bytes: &[u8], pair: fn([u8; 2]) -> u16) -> String {
    let units = bytes.chunks_exact(2).map(|two| pair([two[0], two[1]]));
    char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
}

/// Longest run of rows with the same number of cells (at least two): first row, number of rows, number of cells.
pub fn longest_run(rows: &[Vec<String>]) -> (usize, usize, usize) {
    let (mut best, mut begin) = ((0, 0, 0), 0);
    for at in 0..rows.len() {
        if at > 0 && rows[at].len() != rows[at - 1].len() {
            begin = at;
        }
        if rows[at].len() > 1 && at + 1 - begin > best.1 {
            best = (begin, at + 1 - begin, rows[at].len());
        }
    }
    best
}

impl Cells<'_> {
    /// Its rows in order, without comments (`#`) and empty lines.
    pub fn rows(&self) -> Box<dyn Iterator<Item = Result<Vec<String>, DataError>> + '_> {
        match self.separator {
            Separator::Workbook => Box::new(self.sheet.iter().map(|row| Ok(row.clone()))),
            Separator::Blanks => {
                let lines = self.text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
                Box::new(lines.map(|line| Ok(line.split_whitespace().map(str::to_owned).collect())))
            }
            Separator::Byte(separator) => {
                let reader = csv::ReaderBuilder::new()
                    .delimiter(separator)
                    .comment(Some(b'#'))
                    .flexible(true)
                    .has_headers(false)
                    .trim(csv::Trim::All)
                    .from_reader(self.text.as_bytes());
                Box::new(reader.into_records().map(|record| match record {
                    Ok(record) => Ok(record.iter().map(str::to_owned).collect()),
                    Err(error) => Err(DataError::Unreadable(error.to_string())),
                }))
            }
        }
    }

    /// The last comment before the data, as cells: LinuxCNC and numpy write column names there.
    pub fn last_remark(&self) -> Vec<String> {
        let remarks = self.text.lines().take_while(|line| line.starts_with('#') || line.trim().is_empty());
        let last = remarks.filter(|line| line.starts_with('#')).last().unwrap_or_default().trim_start_matches('#');
        match self.separator {
            Separator::Byte(byte) => last.split(char::from(byte)).map(|cell| cell.trim().to_owned()).collect(),
            _ => last.split_whitespace().map(str::to_owned).collect(),
        }
    }
}

/// The sheet of a workbook that has the most rows, as text.
fn workbook(bytes: &[u8]) -> Result<Vec<Vec<String>>, DataError> {
    let wrong = |error: calamine::XlsxError| DataError::Unreadable(format!("the workbook: {error}"));
    let mut book: calamine::Xlsx<_> = calamine::Xlsx::new(std::io::Cursor::new(bytes)).map_err(wrong)?;
    let mut best: Vec<Vec<String>> = Vec::new();
    for name in book.sheet_names().clone() {
        let mut reader = match book.worksheet_cells_reader(&name) {
            // A sheet of charts.
            Err(calamine::XlsxError::NotAWorksheet(_)) => continue,
            reader => reader.map_err(wrong)?,
        };
        let mut found = Vec::new();
        while let Some(of_sheet) = reader.next_cell().map_err(wrong)? {
            let text = cell(&of_sheet.get_value().clone().into());
            if !text.is_empty() {
                found.push((of_sheet.get_position(), text));
            }
        }
        let rows = in_rows(found, MOST_CELLS)?;
        if rows.len() > best.len() {
            best = rows;
        }
    }
    Ok(best)
}

/// Columns that a sheet can have.
const MOST_COLUMNS: u32 = 16_384;
/// Most cells of a sheet, those that are empty before another one of their row included.
const MOST_CELLS: usize = 30_000_000;

/// Cells by their row and column, in rows that begin at the first column that is used and end at their own last cell. A cell says itself
/// where it stands, which may be anywhere.
fn in_rows(mut cells: Vec<((u32, u32), String)>, most: usize) -> Result<Vec<Vec<String>>, DataError> {
    cells.sort_by_key(|(place, _)| *place);
    let first = cells.iter().map(|((_, column), _)| *column).min().unwrap_or(0);
    let (mut rows, mut row_now, mut count) = (Vec::<Vec<String>>::new(), None, 0);
    for ((row, column), text) in cells {
        if row_now != Some(row) {
            row_now = Some(row);
            rows.push(Vec::new());
        }
        let Some(cells) = rows.last_mut() else { continue };
        let place = (column - first) as usize;
        count += (place + 1).saturating_sub(cells.len());
        if column >= MOST_COLUMNS || count > most {
            return Err(DataError::Unreadable("the workbook: a sheet is larger than any can be".into()));
        }
        cells.resize(cells.len().max(place + 1), String::new());
        cells[place] = text;
    }
    Ok(rows)
}

/// A time of day as text.
fn clock(seconds: f64) -> String {
    let (hours, minutes) = ((seconds / 3600.0).floor(), (seconds / 60.0).floor() % 60.0);
    format!("{hours:02}:{minutes:02}:{:09.6}", (seconds - 3600.0 * hours - 60.0 * minutes).min(59.999_999))
}

/// A cell as text; a date becomes a stamp of ISO 8601.
fn cell(data: &calamine::Data) -> String {
    match data {
        calamine::Data::DateTime(when) => {
            // Days since 1899-12-30, of which 1970 is day 25 569; below one day it is a time of day.
            let seconds = when.as_f64() * 86_400.0;
            if seconds < 86_400.0 { clock(seconds) } else { format!("{}", seconds - 25_569.0 * 86_400.0) }
        }
        other => other.to_string().trim().to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_separator_is_the_one_the_lines_agree_on() {
        let of = |text: &str| open(text.as_bytes()).unwrap().separator;
        assert_eq!(of("a,b\n1,2\n3,4\n"), Separator::Byte(b','));
        assert_eq!(of("a;b\n1,5;2,5\n3,1;4,2\n"), Separator::Byte(b';'));
        assert_eq!(of("a\tb\n1,5\t2,5\n"), Separator::Byte(b'\t'));
        assert_eq!(of("0 1.5 2.5\n1 3.5 4\n"), Separator::Blanks);
        assert_eq!(of("time stamp,power\n2026-01-02 10:00:00,5\n2026-01-02 10:00:01,6\n"), Separator::Byte(b','));
        assert_eq!(of("one\n1\n"), Separator::Byte(b','));
    }

    #[test]
    fn cells_of_a_sheet_stand_where_they_say() {
        let rows = |cells: &[(u32, u32)]| in_rows(cells.iter().map(|place| (*place, "1".to_owned())).collect(), 50_000);
        assert_eq!(rows(&[(9, 4), (2, 3), (2, 5)]).unwrap(), [vec!["1", "", "1"], vec!["", "1"]]);
        assert_eq!(rows(&[]).unwrap(), [[""; 0]; 0]);
        assert_eq!(rows(&[(0, 0), (u32::MAX, 16_383)]).unwrap()[1].len(), 16_384);
        assert!(rows(&[(0, 0), (0, 16_384)]).is_err());
        assert!(rows(&[(0, 0), (1, 16_383), (2, 16_383), (3, 16_383)]).is_ok());
        assert!(rows(&[(0, 0), (1, 16_383), (2, 16_383), (3, 16_383), (4, 16_383)]).is_err());
    }

    #[test]
    fn text_in_sixteen_bits_is_read() {
        let mut bytes = vec![0xff, 0xfe];
        "a;b\n1;2\n".encode_utf16().for_each(|unit| bytes.extend(unit.to_le_bytes()));
        for bytes in [&bytes[..], &bytes[2..]] {
            let cells = open(bytes).unwrap();
            assert_eq!(cells.rows().next().unwrap().unwrap(), ["a", "b"]);
        }
    }

    #[test]
    fn a_file_of_another_kind_is_said_to_be_one() {
        for (bytes, what) in [
            (&b"\n[{\"time_s\": 0}]"[..], "JSON"),
            (b"{\"time_s\": 0}\n{\"time_s\": 1}", "JSON"),
            (b"<html>", "HTML"),
            (b"%PDF-1.4", "PDF"),
            (b"\xd0\xcf\x11\xe0\xa1\xb1", "xls"),
            (b"\x7fELF\x02\0\0\0", "not a text"),
        ] {
            let said = open(bytes).unwrap_err().to_string();
            assert!(said.contains(what), "{said}");
        }
    }

    #[test]
    fn a_time_of_day_of_a_workbook_is_one_of_a_clock() {
        assert_eq!([86_399.5, 0.0, 3_661.25].map(clock), ["23:59:59.500000", "00:00:00.000000", "01:01:01.250000"]);
    }
}
