//! Errors of measured data: one sentence with the remedy.

/// Why data cannot be used at all.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DataError {
    /// No rows.
    #[error("the data are empty: {0}")]
    Empty(&'static str),
    /// Not CSV.
    #[error("the data cannot be read: {0}")]
    Unreadable(String),
    /// A required column is missing.
    #[error(
        "the data have no column `{missing}`; there are: {present}. Rename it in the header or map it with --columns"
    )]
    NoColumn {
        /// Wanted.
        missing: String,
        /// Found.
        present: String,
    },
    /// The data are readable but cannot be used for this purpose.
    #[error("{0}")]
    Unfit(String),
}
