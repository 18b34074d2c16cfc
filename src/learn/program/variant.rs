//! Differences from the setup that change the columns of the data: larger stock, tool diameter, runout, curvature of
//! the path, a lag of the measuring chain. Data have an additional set of columns for each.

use crate::effects::Geometry;
use crate::force::contact::Engaged;

/// A change of the columns by something other than a coefficient.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variant {
    /// Per mm by which the top of the stock is higher.
    StockTop,
    /// Per mm by which all sides of the stock stand proud.
    StockSide,
    /// Per mm by which one side of the stock stands proud: −x, +x, −y, +y.
    StockFace(usize),
    /// Per rad that the stock is turned.
    StockTurn,
    /// Per mm of tool diameter.
    Diameter,
    /// With the curvature of the path, minus without.
    Curved,
    /// With one runout of [`super::runout_grid::RunoutGrid`], minus without.
    Runout {
        /// Index into the offsets.
        offset: usize,
        /// Index into the phases.
        phase: usize,
    },
    /// Mean since the reading before, minus value at the reading: the input of a measuring chain with a lag.
    OverSpan,
}

impl Variant {
    /// The variant whose columns show a change of the geometry.
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

/// The engagement of the spots with another geometry.
#[derive(Debug, Clone)]
pub struct OtherGeometry {
    /// What is changed.
    pub variant: Variant,
    /// Size of the change, mm (rad of a turn).
    pub size: f64,
    /// Engagement, spot by spot.
    pub engaged: Vec<Engaged>,
    /// Index of the other geometry that is changed; `None`: the declared one.
    pub over: Option<usize>,
}

impl OtherGeometry {
    /// Is it the same change by the same size?
    #[allow(clippy::float_cmp, reason = "sizes that were simulated are compared, not computed anew")]
    pub fn is_same(&self, other: &Self) -> bool {
        self.variant == other.variant && self.size == other.size
    }
}
