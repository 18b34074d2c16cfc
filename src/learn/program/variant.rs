//! What may differ from the setup so that the columns of the data change: stock that stands out, the tool's diameter or
//! its runout, the curvature of the path, a measuring chain that lags. Data have one more set of columns for each that
//! is asked for.

use crate::effects::Geometry;
use crate::force::contact::Engaged;

/// How the columns change when something other than a coefficient changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variant {
    /// Per mm that the top of the stock stands higher.
    StockTop,
    /// Per mm that the sides of the stock stand out.
    StockSide,
    /// Per mm that one side of the stock stands out: −x, +x, −y, +y.
    StockFace(usize),
    /// Per mm of tool diameter.
    Diameter,
    /// With the curvature of the path, minus without.
    Curved,
    /// Under one of [`super::runout_grid::RunoutGrid`]: which offset, and which way it points.
    Runout {
        /// Index into the offsets.
        offset: usize,
        /// Index into the phases.
        phase: usize,
    },
    /// Mean since the reading before, minus at the reading: what a chain with a lag is fed with.
    OverSpan,
}

impl Variant {
    /// The variant that shows a change of the geometry.
    pub fn of(geometry: Geometry) -> Self {
        match geometry {
            Geometry::StockTop => Variant::StockTop,
            Geometry::StockSide => Variant::StockSide,
            Geometry::Diameter => Variant::Diameter,
            Geometry::Curved => Variant::Curved,
            Geometry::Runout => Variant::Runout { offset: 1, phase: 0 },
        }
    }
}

/// The engagement of the spots under another geometry.
#[derive(Debug, Clone)]
pub struct OtherGeometry {
    /// Which.
    pub variant: Variant,
    /// Size of the change, mm.
    pub size_mm: f64,
    /// Engagement, spot by spot.
    pub engaged: Vec<Engaged>,
    /// The other one that it is changed from; `None`: the declared one.
    pub over: Option<usize>,
}
