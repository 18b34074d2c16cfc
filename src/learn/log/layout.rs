//! Layout of a table in its file. In: the first rows. Out: column names with units, first row of data, number format. A
//! preamble before the header and a row of units below it are recognised; without a header the columns are `column_1`,
//! `column_2`, …

use super::cells::{Separator, longest_run};
use super::names::is_ours;
use super::stamps::{is_stamp, reading};

/// Layout of a table in its file.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// What separates the cells.
    pub separator: Separator,
    /// Names as written in the file; units of a row of units in brackets.
    pub names: Vec<String>,
    /// Rows before the first row of data.
    pub first_row: usize,
    /// Rows before the header.
    pub preamble: usize,
    /// Does the file name its columns?
    pub has_header: bool,
    /// Is there a row of units?
    pub has_units: bool,
    /// Numbers are written with a comma: `1,5`.
    pub decimal_comma: bool,
}

/// Rows with numbers in them that a preamble may have above a header of as many cells. Judgement.
const PREAMBLE: usize = 10;

/// Finds the layout from the first rows; `remark` is the last comment before the data.
pub fn layout(rows: &[Vec<String>], remark: &[String], separator: Separator) -> Layout {
    let (begin, length, mut cells) = longest_run(rows);
    // A single column, or rows of different lengths: the first row is the header.
    let begin = if length == 0 { 0 } else { begin };
    if length == 0 {
        cells = rows.first().map_or(0, Vec::len);
    }
    let named = |at: usize| rows[at].iter().filter(|cell| is_ours(cell)).count();
    let preamble = (begin..begin + length.min(PREAMBLE)).find(|at| is_header(&rows[*at]) && named(*at) >= 2);
    let begin_words = preamble.unwrap_or(begin);
    let first_value = (begin_words..begin + length).find(|at| !is_header(&rows[*at]));
    // Rows of words above the first values: lines of the preamble with as many cells, the header, a row of units.
    let units_at = first_value.filter(|at| *at > begin).map(|at| at - 1).filter(|at| is_units(&rows[*at]));
    let words = begin_words..units_at.or(first_value).unwrap_or(begin + 1).min(rows.len());
    let above = begin.checked_sub(1).filter(|at| is_header(&rows[*at]) && rows[*at].len().abs_diff(cells) <= 1);
    let header = words.filter(|at| is_header(&rows[*at])).max_by_key(|at| named(*at)).or(above);
    let mut first_row = header.map_or(begin, |at| at + 1);
    let own = header.map(|at| rows[at].clone());
    let remarked = (own.is_none() && remark.len() == cells && is_header(remark)).then(|| remark.to_vec());
    let has_header = own.is_some() || remarked.is_some();
    let mut names = own.or(remarked).unwrap_or_else(|| (1..=cells).map(|k| format!("column_{k}")).collect());
    let units = rows.get(first_row).filter(|row| header.is_some() && is_units(row));
    let has_units = units.is_some();
    if let Some(units) = units {
        for (name, unit) in names.iter_mut().zip(units).filter(|(_, unit)| !unit.is_empty()) {
            *name = format!("{name} [{}]", unit.trim_matches(['[', ']', '(', ')']));
        }
        first_row += 1;
    }
    let data = &rows[first_row.min(rows.len())..];
    Layout {
        separator,
        names,
        preamble: header.unwrap_or(first_row),
        first_row,
        has_header,
        has_units,
        decimal_comma: is_decimal_comma(data, separator),
    }
}

/// Is a row a header: with words, without numbers or times?
fn is_header(row: &[String]) -> bool {
    let value = |cell: &String| number(cell, true).is_some() || number(cell, false).is_some() || is_stamp(cell);
    row.iter().any(|cell| cell.contains(char::is_alphabetic)) && !row.iter().any(value)
}

/// Is it a row of units: every non-empty cell a known unit or in brackets?
fn is_units(row: &[String]) -> bool {
    let units = crate::units::header_units();
    let known = |cell: &str| {
        let plain = super::names::plain(cell);
        cell == "-" || units.contains(&plain.as_str()) || (cell.starts_with(['[', '(']) && cell.ends_with([']', ')']))
    };
    let said: Vec<&String> = row.iter().filter(|cell| !cell.is_empty()).collect();
    !said.is_empty() && said.iter().all(|cell| known(cell))
}

/// Do more numbers have a decimal comma than a decimal point? What may be either, like `1,234`, is a decimal number where the comma does
/// not separate the cells, and if nothing else tells.
fn is_decimal_comma(rows: &[Vec<String>], separator: Separator) -> bool {
    let of = |comma: bool, either: bool| {
        let mark = if comma { ',' } else { '.' };
        let fits = |cell: &&String| {
            cell.contains(mark) && number(cell, comma).is_some() && number(cell, !comma).is_some() == either
        };
        rows.iter().flatten().filter(fits).count()
    };
    match (of(true, false), of(false, false)) {
        (0, 0) => separator != Separator::Byte(b',') && of(true, true) > of(false, true),
        (commas, points) => commas > points,
    }
}

/// A cell as a number. Thousands may be apart: `1.234,5` or `1 234,5` with a decimal comma, `1,234.5` or `1'234.5` without.
pub fn number(cell: &str, decimal_comma: bool) -> Option<f64> {
    if !decimal_comma && let Ok(number) = cell.parse() {
        return Some(reading(number));
    }
    let (mark, group) = if decimal_comma { (',', '.') } else { ('.', ',') };
    let whole = &cell[..cell.find([mark, 'e', 'E']).unwrap_or(cell.len())];
    let apart = [group, ' ', '\u{a0}', '\u{202f}', '\'', '’'].into_iter().find(|apart| whole.contains(*apart));
    let joined = match apart {
        Some(apart) if are_thousands(whole, apart) => whole.replace(apart, ""),
        Some(_) => return None,
        None => whole.to_owned(),
    };
    let rest = cell[whole.len()..].replacen(mark, ".", 1);
    let digits = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
    let text = joined + &rest;
    text.chars().all(digits).then(|| text.parse().ok().map(reading))?
}

/// Is it one to three digits without a leading zero, and three after each separator?
fn are_thousands(whole: &str, apart: char) -> bool {
    let mut groups = whole.trim_start_matches(['+', '-']).split(apart);
    let is_first = |group: &str| (1..=3).contains(&group.len()) && !group.starts_with('0');
    groups.next().is_some_and(is_first)
        && groups.all(|group| group.len() == 3 && group.bytes().all(|b| b.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::super::cells::open;
    use super::*;

    fn of(text: &str) -> Layout {
        let cells = open(text.as_bytes()).unwrap();
        let rows: Vec<Vec<String>> = cells.rows().map(Result::unwrap).collect();
        layout(&rows, &cells.last_remark(), cells.separator)
    }

    #[test]
    fn preambles_units_and_missing_headers_are_found() {
        let plain = of("time_s,power\n0,5\n1,6\n");
        assert!(plain.has_header && plain.first_row == 1 && plain.preamble == 0 && !plain.decimal_comma);
        let export = of("Measurement 7\nMachine;VMC\n\nTime;Power\ns;kW\n0,02;1,5\n0,04;1,6\n0,06;1,7\n");
        assert_eq!(export.names, ["Time [s]", "Power [kW]"]);
        assert!(export.has_units && export.decimal_comma && export.first_row == 4, "{export:?}");
        let bare = of("0 1.5 2.5\n1 3.5 4\n2 1 1\n");
        assert!(!bare.has_header && bare.names == ["column_1", "column_2", "column_3"] && bare.first_row == 0);
        let remarked = of("# halsampler\n# time_s x_mm spindle_power_w\n0 1.5 2.5\n1 3.5 4\n");
        assert_eq!(remarked.names, ["time_s", "x_mm", "spindle_power_w"]);
        let words = of("group,side,feed\na,up,5\nb,down,6\n");
        assert!(words.has_header && words.first_row == 1);
        // A row of words and missing values below the header is a row of data.
        assert_eq!(of("group,side,feed\na,up,NA\nb,down,6\nc,up,7\n").first_row, 1);
    }

    #[test]
    fn what_no_instrument_reads_is_missing() {
        assert_eq!([number("1e20", false), number("-1,8e18", true)], [Some(1e20), Some(-1.8e18)]);
        assert!(["1.1e20", "1e308", "-inf"].iter().all(|cell| number(cell, false).unwrap().is_nan()));
        assert!(number("1,1e20", true).unwrap().is_nan() && number("watt", false).is_none());
    }

    #[test]
    fn thousands_may_be_apart_and_a_date_is_no_number() {
        for (cell, comma, value) in [
            ("8,000", false, Some(8000.0)),
            ("-1,234.5", false, Some(-1234.5)),
            ("1'234.5", false, Some(1234.5)),
            ("1 234 567,5", true, Some(1_234_567.5)),
            ("1\u{a0}234", true, Some(1234.0)),
            ("1,5", false, None),
            ("0,500", false, None),
            ("0.500", true, None),
            ("28.11.2026", true, None),
            ("1.2345,6", true, None),
            ("1 2", false, None),
        ] {
            assert_eq!(number(cell, comma), value, "{cell}");
        }
        let comma = |text: &str| of(text).decimal_comma;
        assert!(!comma("time_s;n\n0.5;8,000\n1.5;8,000\n2;9\n"), "thousands");
        assert!(comma("time_s,x\n\"0,5\",\"1,25\"\n\"1,5\",\"2,25\"\n"), "in quotes");
        assert!(!comma("time_s,n\n0,\"8,000\"\n1,\"8,000\"\n"), "thousands in quotes");
        assert!(comma("time_s;x\n1;1,234\n2;1,235\n"));
    }

    #[test]
    fn a_preamble_may_have_as_many_cells_as_the_header() {
        let found = of("Logger,3000,\nStart,2026-11-28,23:59:30\ntime_s,x_mm,power\n0,1,5\n1,2,6\n2,3,7\n");
        assert!(found.has_header && found.first_row == 3 && found.preamble == 2, "{found:?}");
        assert_eq!(found.names, ["time_s", "x_mm", "power"]);
    }

    #[test]
    fn numbers_with_a_comma_are_numbers() {
        assert_eq!(number("1.234,5", true), Some(1234.5));
        assert_eq!(number("-0,02", true), Some(-0.02));
        assert_eq!(number("1.5", false), Some(1.5));
        assert_eq!(number("up", true), None);
        assert_eq!(number("", true), None);
    }
}
