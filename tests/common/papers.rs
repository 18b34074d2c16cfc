//! Tables of the reference papers, read from ../shared.

use std::collections::BTreeMap;
use std::path::Path;

/// One row: column name to text.
pub type Row = BTreeMap<String, String>;

/// Rows of a table; a test that asks for one is ignored where ../shared is absent.
pub fn table(file: &str) -> Vec<Row> {
    let path = Path::new("../shared/reference/papers").join(file);
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_path(path).expect("the table opens");
    reader.deserialize().collect::<Result<_, _>>().expect("the table has a header and full rows")
}

/// A number of a row.
pub fn number(row: &Row, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column} = {:?}", row[column]))
}
