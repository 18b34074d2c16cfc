//! A log after reading: times, positions and readings of each sample.

/// A log.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Log {
    /// Time, s.
    pub time_s: Vec<f64>,
    /// Position, mm, each axis.
    pub position_mm: Option<[Vec<f64>; 3]>,
    /// Physical line, 1-based.
    pub line: Option<Vec<f64>>,
    /// Feed along the path, mm/s.
    pub feed_mm_s: Option<Vec<f64>>,
    /// Spindle speed, rev/s.
    pub rps: Option<Vec<f64>>,
    /// Tool.
    pub tool: Option<Vec<f64>>,
    /// Measured quantities: name and values.
    pub measured: Vec<(&'static str, Vec<f64>)>,
    /// Are there rows only when a value changes? Then values hold until the next row, and a time without rows is no
    /// gap.
    pub on_change: bool,
    /// How much higher it lies than the path of its program, mm, where X and Y agree: the depth of its cuts is then not known.
    pub higher_mm: Option<f64>,
    /// Warnings.
    pub warnings: Vec<String>,
}
