//! Shape of a blank before the first cut. In: a shape in mm. Out: its extent, its height over every point of the plane, and
//! a signed distance in the plane at a given height (negative inside), exact for boxes and cylinders.

use super::field::Field;
use crate::machine::Box3;
use crate::path::Vec3;

/// Initial shape of a piece of stock, in the common frame.
#[derive(Debug, Clone)]
pub enum Blank {
    /// A box.
    Box(Box3),
    /// An upright cylinder.
    Cylinder {
        /// Centre in XY, mm.
        centre: [f64; 2],
        /// Radius, mm.
        radius: f64,
        /// Lower and upper face, mm.
        z: [f64; 2],
    },
    /// Heights over a grid; nothing above or beside them.
    Heights(Box<Field>),
}

impl Blank {
    /// Smallest box that holds it.
    pub fn extent(&self) -> Box3 {
        match self {
            Blank::Box(extent) => *extent,
            Blank::Cylinder { centre: [x, y], radius, z } => {
                Box3 { min: Vec3::new(x - radius, y - radius, z[0]), max: Vec3::new(x + radius, y + radius, z[1]) }
            }
            Blank::Heights(field) => field.extent,
        }
    }
    /// Height of its top over (x, y); minus infinity beside it.
    pub fn height(&self, x: f64, y: f64) -> f64 {
        match self {
            Blank::Box(extent) => extent.max.z,
            Blank::Cylinder { centre, radius, z } => {
                if (x - centre[0]).hypot(y - centre[1]) <= *radius {
                    z[1]
                } else {
                    f64::NEG_INFINITY
                }
            }
            Blank::Heights(field) => field.height(x, y).map_or(f64::NEG_INFINITY, f64::from),
        }
    }
    /// Its field of cells of at most `cell_mm`.
    pub fn field(&self, cell_mm: f64) -> Field {
        match self {
            Blank::Heights(field) if fits(field, cell_mm) => Field::clone(field),
            _ => Field::new(self.extent(), cell_mm, |x, y| self.height(x, y)),
        }
    }
    /// Signed distance in the plane to its section at height `z` (for heights over a grid: half a cell either way).
    pub fn distance(&self, p: [f64; 2], z: f64) -> f64 {
        match self {
            Blank::Box(extent) => {
                if z < extent.min.z || z > extent.max.z {
                    return f64::INFINITY;
                }
                let beyond = |axis: usize| (extent.min[axis] - p[axis]).max(p[axis] - extent.max[axis]);
                outside_box(beyond(0), beyond(1))
            }
            Blank::Cylinder { centre, radius, z: [low, high] } => {
                if z < *low || z > *high {
                    return f64::INFINITY;
                }
                (p[0] - centre[0]).hypot(p[1] - centre[1]) - radius
            }
            Blank::Heights(field) => {
                let half = 0.5 * field.cell[0].min(field.cell[1]);
                let inside = z >= field.extent.min.z && field.height(p[0], p[1]).is_some_and(|h| z < f64::from(h));
                if inside { -half } else { half }
            }
        }
    }
}

/// Are these the cells asked for?
fn fits(field: &Field, cell_mm: f64) -> bool {
    field.size == super::field::cells(&field.extent, cell_mm)
}

fn outside_box(x: f64, y: f64) -> f64 {
    if x > 0.0 && y > 0.0 { x.hypot(y) } else { x.max(y) }
}
