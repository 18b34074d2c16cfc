//! Settings and errors of the simulation. In: filled by the caller. Out: [`Options`] for [`super::engage()`], [`EngageError`] from it.

use std::path::Path;

use crate::machine::MOST_MM;

/// Reads a file for the simulation: the core itself opens none.
pub type Loader<'a> = &'a (dyn Fn(&Path) -> std::io::Result<Vec<u8>> + Sync);

/// Settings of [`super::engage()`].
#[derive(Clone, Copy)]
pub struct Options<'a> {
    /// Longest stretch between two sampled points, mm.
    pub spacing_mm: f64,
    /// Cell of the height field, mm, in place of the job's.
    pub cell_mm: Option<f64>,
    /// Most memory the height field may take, bytes; `None`: as much as it needs.
    pub max_memory_bytes: Option<u64>,
    /// Rings of a cutter, but for those of a cylindrical side, are cut into so many, each with arcs of its own.
    pub ring_parts: u32,
    /// Reads STL and saved stock.
    pub loader: Option<Loader<'a>>,
}

impl Default for Options<'_> {
    fn default() -> Self {
        Self { spacing_mm: 1.0, cell_mm: None, max_memory_bytes: None, ring_parts: 1, loader: None }
    }
}

/// Why engagement cannot be worked out.
#[derive(Debug, thiserror::Error)]
pub enum EngageError {
    /// There is no stock.
    #[error("the setup describes no stock: give [stock] box = {{ min = […], max = […] }}")]
    NoStock,
    /// A blank without volume, or with numbers that are none.
    #[error("the stock has no volume: its upper corner must lie above its lower corner in X, Y and Z")]
    EmptyStock,
    /// The cell is not a positive number.
    #[error("the resolution must be a positive number of millimetres, not {0}")]
    BadCell(f64),
    /// A move that no mill makes.
    #[error(
        "line {line}: the tool would go {distance_m:.0} m from the zero point, farther than any mill ({} m): correct the coordinate, or the unit of the program",
        MOST_MM / 1e3
    )]
    TooFar {
        /// Line of the program.
        line: u32,
        /// Largest coordinate, m.
        distance_m: f64,
    },
    /// The height field would not fit.
    #[error(
        "a height field with cells of {cell_mm:.3} mm needs {needed_mib} MiB, {allowed_mib} MiB are allowed for it, half of --max-memory: use --resolution {fits_mm:.3} or more, or raise --max-memory"
    )]
    Memory {
        /// Cell asked for, mm.
        cell_mm: f64,
        /// Memory it needs, MiB.
        needed_mib: u64,
        /// Memory allowed, MiB.
        allowed_mib: u64,
        /// Smallest cell that fits, mm.
        fits_mm: f64,
    },
    /// A stock file cannot be read.
    #[error("cannot read the stock {path}: {why}")]
    StockFile {
        /// Its path.
        path: String,
        /// What is wrong with it.
        why: String,
    },
}
