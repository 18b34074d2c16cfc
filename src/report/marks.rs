//! Marks of files that Feedwright wrote. In: nothing. Out: texts in the heads of JSON, SVG, HTML, TOML and CSV files, by which an existing file
//! is recognised before it is replaced.

/// Value of the JSON key `written_by`.
pub const WRITTEN_BY: &str = concat!("feedwright ", env!("CARGO_PKG_VERSION"));
/// Stands in the head of every SVG, HTML and TOML file that is written.
pub const MARK: &str = "ritten by feedwright";
/// The first columns of the CSV table.
pub const CSV_HEAD: &str = "line,motion,s_mm,time_before_s,time_after_s,x_mm,y_mm,z_mm,feed_before_mm_min";
