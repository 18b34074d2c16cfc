//! The two layouts of passes: side by side in one direction, or each at one height. In: the layout, the tool on the surface, the requirements.
//! Out: the plan, the best plan of a constant step, the lower bound of the time, all for that layout.

use super::columns::Columns;
use super::comparison;
use super::contour;
use super::least_straight::least_straight_s;
use super::least_time::{Alike, Over};
use super::levels::Grid;
use super::passes::{self, Constant, Requirements};
use super::path::Drawing;
use super::plan::Plan;
use super::reach::{Place, ToolOnSurface};
use super::steep::Steep;

/// Layout of the passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Layout {
    /// Side by side.
    Parallel {
        /// Their direction from +X, rad.
        direction_rad: f64,
        /// Largest angle of a pass to it, rad.
        turn_rad: f64,
    },
    /// Each at one height (constant z).
    Contour {
        /// Least slope, rad; shallower ground is left out.
        shallowest_rad: f64,
    },
}

impl Layout {
    /// Angle from the frame of the plan to the work frame, rad.
    pub fn frame_rad(&self) -> f64 {
        match self {
            Layout::Parallel { direction_rad, .. } => *direction_rad,
            Layout::Contour { .. } => 0.0,
        }
    }

    /// Tangent of the largest angle of a pass to its direction.
    pub fn turn(&self) -> f64 {
        match self {
            Layout::Parallel { turn_rad, .. } => turn_rad.tan(),
            Layout::Contour { .. } => 0.0,
        }
    }
}

/// The area for passes on a surface.
pub enum PassArea {
    /// Columns, for parallel passes.
    Columns(Columns),
    /// The steep part, for passes of one height.
    Steep(Steep),
}

impl PassArea {
    /// The area within a box, with columns or cells of `fine_mm`.
    pub fn new(layout: &Layout, on_surface: &ToolOnSurface, low: [f64; 2], high: [f64; 2], fine_mm: f64) -> Self {
        match layout {
            Layout::Parallel { .. } => PassArea::Columns(Columns::new(on_surface, low, high, fine_mm, 0.5 * fine_mm)),
            Layout::Contour { shallowest_rad } => {
                PassArea::Steep(Steep::new(Grid::new(on_surface.dropper, low, high, fine_mm), *shallowest_rad))
            }
        }
    }

    /// Places on it, about `apart_mm` apart, with their areas.
    pub fn places(&self, apart_mm: f64) -> Vec<Place> {
        match self {
            PassArea::Columns(columns) => columns.places(apart_mm),
            PassArea::Steep(steep) => steep.places(apart_mm),
        }
    }

    /// Plans the passes; those side by side such that they keep the scallop limit as they are drawn.
    pub fn plan(&self, on_surface: &ToolOnSurface, required: &Requirements, drawing: &Drawing) -> Plan {
        match self {
            PassArea::Columns(columns) => passes::plan(on_surface, columns, required, Some(drawing)),
            PassArea::Steep(steep) => contour::plan(on_surface, steep, required),
        }
    }

    /// The best plan of one step and one feed that keep force and scallop at all places of a plan: `everywhere_mm`.
    pub fn constant(
        &self,
        on_surface: &ToolOnSurface,
        required: &Requirements,
        everywhere_mm: &[[f64; 2]],
    ) -> Option<(Constant, f64, Plan)> {
        match self {
            PassArea::Columns(columns) => comparison::constant(on_surface, columns, required, everywhere_mm),
            PassArea::Steep(steep) => contour::constant(on_surface, steep, required, everywhere_mm),
        }
    }

    /// Lower bounds of the time of passes with this layout, s, from places `apart_mm` apart.
    pub fn least_alike_s<const N: usize>(
        &self,
        on_surface: &ToolOnSurface,
        (places, apart_mm): (&[Place], f64),
        required: Alike<N>,
    ) -> [f64; N] {
        match self {
            PassArea::Columns(columns) if required[0].turn == 0.0 => {
                least_straight_s(on_surface, columns, required, apart_mm)
            }
            PassArea::Columns(_) => comparison::least_alike_s(on_surface, places, required),
            PassArea::Steep(_) => Over { on_surface, places, required }.least_of_one_height_s(),
        }
    }
}
