//! Measurements as the diagnosis sees them: one reading per row, beside the columns that a base coefficient multiplies
//! and the state in which it was taken.
//!
//! The base model is linear: reading = Σ β_b · column_b, each column belonging to a [`Class`] that effects act on (the
//! tare, the cutting terms, the edge terms). How the columns change with the geometry or the motion is given by further
//! columns ([`Data::variants`]), so that an effect is only ever a cheap change of columns. A table of steady cuts and a
//! log that was aligned with its program both end as [`Data`].

use crate::effects::State;
use crate::learn::program::runout_grid::RunoutGrid;
use crate::learn::program::variant::Variant;

/// What a base coefficient stands for, and so which effects act on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// Power or load without a cut.
    Tare,
    /// Per chip thickness (k_?c).
    Cutting,
    /// Per cutting edge (k_?e).
    Edge,
}

/// One base coefficient.
#[derive(Debug, Clone, PartialEq)]
pub struct Base {
    /// Name in reports.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// What effects act on it.
    pub class: Class,
    /// What the setup says of it: value and standard deviation.
    pub prior: Option<(f64, f64)>,
    /// Values that physics allows.
    pub bounds: (f64, f64),
}

/// No bounds.
pub const UNBOUNDED: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// Change of every column, [`Base`] by [`Base`].
#[derive(Debug, Clone, PartialEq)]
pub struct VariantColumns {
    /// What changes.
    pub variant: Variant,
    /// Size of the change that was simulated, of either sign: mm, rad; 1 for what has none.
    pub size: f64,
    /// Change of the columns there over that size.
    pub columns: Vec<Vec<f64>>,
}

/// Actual over declared feed, if the machine accelerated less than declared.
#[derive(Debug, Clone, PartialEq)]
pub struct SlowerMachine {
    /// True over declared acceleration.
    pub factor: f64,
    /// Feed ratio of each sample.
    pub ratio: Vec<f64>,
}

/// Everything a diagnosis looks at.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Data {
    /// Base coefficients.
    pub base: Vec<Base>,
    /// Columns, base by base.
    pub columns: Vec<Vec<f64>>,
    /// Readings.
    pub reading: Vec<f64>,
    /// Relative weights; 0 is left out.
    pub weight: Vec<f64>,
    /// State of each sample.
    pub state: Vec<State>,
    /// Length of time that a sample stands for, s; 0 for tables.
    pub span_s: Vec<f64>,
    /// Readings that a sample is the mean of; empty for tables.
    pub readings_per_sample: Vec<f64>,
    /// Variance with which the load of a sample is known, over that of its reading: infinite where nobody knows it;
    /// empty:
    /// 0. What a chain with a lag keeps of such loads is known from the readings alone.
    pub load_variance: Vec<f64>,
    /// Samples with the same number follow each other without a gap (logs); in tables every sample has its own.
    pub run: Vec<usize>,
    /// Measured quantity (power 0, others after it).
    pub channel: Vec<usize>,
    /// Block for splits: pass, part, tool or stretch of time.
    pub block: Vec<usize>,
    /// Kind of cut for the transfer check.
    pub kind: Vec<usize>,
    /// Names of the kinds.
    pub kind_names: Vec<String>,
    /// Names of the channels.
    pub channel_names: Vec<String>,
    /// How columns change with geometry.
    pub variants: Vec<VariantColumns>,
    /// The runouts of [`Variant::Runout`].
    pub runouts: RunoutGrid,
    /// How feeds change with the machine, by falling factor; the factor 1 is implied.
    pub slower: Vec<SlowerMachine>,
    /// Acceleration over the declared one that the times of the blocks show (with how many nats), whatever the loads
    /// say.
    pub timed_acceleration: Option<(f64, f64)>,
    /// What the times of the samples in the program are known to, s; 0 for tables.
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
    /// Columns of a variant.
    pub fn variant(&self, variant: Variant) -> Option<&VariantColumns> {
        self.variants.iter().find(|v| v.variant == variant)
    }
    /// The same data with other weights.
    pub fn with_weights(&self, weight: Vec<f64>) -> Data {
        Data { weight, ..self.clone() }
    }
    /// Indices of the samples that count.
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
    /// Do samples follow each other in time, as in a log?
    pub fn is_series(&self) -> bool {
        self.run.windows(2).filter(|pair| pair[0] == pair[1]).count() * 2 > self.len()
    }
}
