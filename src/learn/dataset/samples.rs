//! Measurements for the diagnosis: one row per sample, with its reading, the columns that base coefficients multiply,
//! and the state in which it was taken. A table of steady cuts and an aligned log both become [`Data`].
//!
//! The base model is linear: reading = Σ β_b · column_b. Each column belongs to a [`Class`] that effects act on (tare,
//! cutting terms, edge terms). Changes of the columns by geometry or motion are precomputed as further columns
//! ([`Data::variants`]), so that evaluating an effect is cheap.

use crate::effects::State;
use crate::learn::program::runout_grid::RunoutGrid;
use crate::learn::program::variant::Variant;

/// Kind of a base coefficient, which decides which effects act on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// Reading without a cut.
    Tare,
    /// Cutting coefficient (k_tc, k_rc): proportional to chip thickness.
    Cutting,
    /// Edge coefficient (k_te, k_re): independent of chip thickness.
    Edge,
}

/// One base coefficient.
#[derive(Debug, Clone, PartialEq)]
pub struct Base {
    /// Name in reports.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Its class.
    pub class: Class,
    /// Value and standard deviation by the setup.
    pub prior: Option<(f64, f64)>,
    /// Least and largest physical value.
    pub bounds: (f64, f64),
}

/// No bounds.
pub const UNBOUNDED: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// Change of every column with one variant, in the order of [`Base`].
#[derive(Debug, Clone, PartialEq)]
pub struct VariantColumns {
    /// What changes.
    pub variant: Variant,
    /// Size of the change that was simulated, of either sign: mm, rad; 1 for what has none.
    pub size: f64,
    /// Change of the columns there over that size.
    pub columns: Vec<Vec<f64>>,
}

/// Realised over declared feed, if the machine accelerated less than declared.
#[derive(Debug, Clone, PartialEq)]
pub struct SlowerMachine {
    /// Acceleration over the declared one.
    pub factor: f64,
    /// Feed ratio of each sample.
    pub ratio: Vec<f64>,
}

/// The data of a diagnosis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Data {
    /// Base coefficients.
    pub base: Vec<Base>,
    /// Columns, base by base.
    pub columns: Vec<Vec<f64>>,
    /// Readings.
    pub reading: Vec<f64>,
    /// Relative weights; samples of weight 0 are left out.
    pub weight: Vec<f64>,
    /// State of each sample.
    pub state: Vec<State>,
    /// Time that a sample covers, s; 0 for tables.
    pub span_s: Vec<f64>,
    /// Number of readings that a sample is the mean of; empty for tables.
    pub readings_per_sample: Vec<f64>,
    /// Variance of the predicted load of a sample over that of its reading: infinite if it is unknown; empty: all 0. A
    /// lag carries uncertain loads into later samples, where only readings determine them.
    pub load_variance: Vec<f64>,
    /// Number of the run of consecutive samples without a gap (logs); in tables every sample has its own.
    pub run: Vec<usize>,
    /// Measured quantity (power 0, others after it).
    pub channel: Vec<usize>,
    /// Block for splits: set-up, pass, part or stretch of time.
    pub block: Vec<usize>,
    /// Line of the program; empty for tables.
    pub line: Vec<u32>,
    /// Kind of cut; in logs the operation.
    pub kind: Vec<usize>,
    /// Names of the kinds.
    pub kind_names: Vec<String>,
    /// Names of the channels.
    pub channel_names: Vec<String>,
    /// Changes of the columns by geometry.
    pub variants: Vec<VariantColumns>,
    /// The runouts of [`Variant::Runout`].
    pub runouts: RunoutGrid,
    /// Feed ratios on slower machines, by falling factor; the factor 1 is implied.
    pub slower: Vec<SlowerMachine>,
    /// Acceleration over the declared one that the block times show, with its gain in log-likelihood, nats; independent
    /// of the loads.
    pub timed_acceleration: Option<(f64, f64)>,
    /// Uncertainty of the program times of the samples, s; 0 for tables.
    pub clock_s: f64,
}

impl Data {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.reading.len()
    }
    /// True without samples.
    #[allow(dead_code, reason = "a public `len` has it beside it (clippy::len_without_is_empty)")]
    pub fn is_empty(&self) -> bool {
        self.reading.is_empty()
    }
    /// The same data with other weights.
    pub fn with_weights(&self, weight: Vec<f64>) -> Data {
        Data { weight, ..self.clone() }
    }
    /// Line of the program at a time of the log, s: that of the last sample with weight that is not later.
    pub fn line_at(&self, time_s: f64) -> Option<u32> {
        let before = self.used().filter(|i| self.state[*i].time_s <= time_s);
        let last = before.max_by(|a, b| self.state[*a].time_s.total_cmp(&self.state[*b].time_s))?;
        self.line.get(last).copied()
    }
    /// Indices of the samples with weight.
    pub fn used(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.len()).filter(|i| self.weight[*i] > 0.0)
    }
    /// Blocks that have samples with weight, in order.
    pub fn blocks(&self) -> Vec<usize> {
        let mut blocks: Vec<usize> = self.used().map(|i| self.block[i]).collect();
        blocks.sort_unstable();
        blocks.dedup();
        blocks
    }
    /// Is it a log: do most samples follow the one before without a gap?
    pub fn is_series(&self) -> bool {
        self.run.windows(2).filter(|pair| pair[0] == pair[1]).count() * 2 > self.len()
    }
}
