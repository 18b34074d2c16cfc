//! Why measured data cannot be used. Out: one sentence that says what to do.

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
